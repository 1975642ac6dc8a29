"""Advice from matrices and operators: known spectra, the laws that rho obeys, and what is refused."""

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from hypothesis import given
from hypothesis import strategies as st
from problem_list import plates
from scipy.sparse.linalg import LinearOperator, aslinearoperator
from strategies import fewer

import verification as vf


def spd(random, n, condition=100.0):
    Q = np.linalg.qr(random.standard_normal((n, n)))[0]
    return Q @ np.diag(np.geomspace(1.0, condition, n)) @ Q.T


def symmetric(matrix):
    return (matrix + matrix.T) / 2


def by_body(found):
    return {role.neumann_body: role for role in found.roles}


def rho(found, neumann_body):
    return by_body(found)[neumann_body].rho.value


@st.composite
def couplings(draw, least=2, most=12):
    """S1 = X' D X and S2 = X' X: the eigenvalues of (S1, S2) are D, exactly up to rounding."""
    random = np.random.default_rng(draw(st.integers(0, 2**16)))
    n = draw(st.integers(least, most))
    D = np.sort(random.uniform(0.1, 10.0, n))
    X = np.linalg.qr(random.standard_normal((n, n)))[0] * random.uniform(0.5, 2.0, n)
    return symmetric(X.T @ np.diag(D) @ X), symmetric(X.T @ X), D, random


# --- known spectra and the laws of rho --------------------------------------------------------------------------------


@fewer(30)
@given(couplings())
def test_rho_of_both_roles_is_the_known_end_of_the_spectrum(coupling):
    S1, S2, D, _ = coupling
    found = vf.advise_matrices(S1, S2)
    assert rho(found, 2) == pytest.approx(D[-1], rel=1e-12)
    assert rho(found, 1) == pytest.approx(1 / D[0], rel=1e-12)
    assert by_body(found)[2].theta_predicted == pytest.approx(2 / (2 + D[-1]), rel=1e-12)


@fewer(20)
@given(couplings(), st.floats(-12, 12), st.floats(-12, 12))
def test_rho_knows_no_ordering_no_basis_and_the_ratio_of_the_units_alone(coupling, a, b):
    S1, S2, D, random = coupling
    order = random.permutation(len(D))
    permuted = vf.advise_matrices(S1[np.ix_(order, order)], S2[np.ix_(order, order)])
    Q = spd(random, len(D))
    congruent = vf.advise_matrices(symmetric(Q.T @ S1 @ Q), symmetric(Q.T @ S2 @ Q))
    scaled = vf.advise_matrices(10**a * S1, 10**b * S2)
    assert rho(permuted, 2) == pytest.approx(D[-1], rel=1e-10)
    assert rho(congruent, 2) == pytest.approx(D[-1], rel=1e-8)
    assert rho(scaled, 2) == pytest.approx(10 ** (a - b) * D[-1], rel=1e-10)
    assert rho(scaled, 1) == pytest.approx(10 ** (b - a) / D[0], rel=1e-10)


@fewer(20)
@given(st.integers(0, 2**16), st.integers(2, 9), st.integers(2, 9), st.sampled_from([1, 2]))
def test_a_transfer_enters_as_a_congruence(seed, n_c, n_n, neumann):
    """With P from the Neumann body; a new basis of the contact body's unknowns changes S_c and P, and not rho."""
    random = np.random.default_rng(seed)
    S_c, S_n, P = spd(random, n_c), spd(random, n_n), random.standard_normal((n_c, n_n))
    named = lambda S_c, S_n: (S_c, S_n) if neumann == 2 else (S_n, S_c)
    expected = scipy.linalg.eigvalsh(P.T @ S_c @ P, S_n)[-1]
    R = spd(random, n_c)
    for S, T in ((S_c, P), (symmetric(R.T @ S_c @ R), np.linalg.solve(R, P)), (S_c, sp.csr_array(P))):
        found = vf.advise_matrices(*named(S, S_n), transfer=T, neumann_body=neumann)
        assert rho(found, neumann) == pytest.approx(expected, rel=1e-8)
        refused = by_body(found)[3 - neumann]
        assert refused.rho is None
        assert "its own transfer" in refused.reason["rho"]
        assert not refused.singular
        assert found.neumann_body == neumann


@pytest.mark.parametrize("neumann", [1, 2])
def test_the_shape_of_a_transfer_tells_which_way_it_leads(neumann):
    random = np.random.default_rng(0)
    sizes = {neumann: 6, 3 - neumann: 4}
    S1, S2 = (spd(random, sizes[body]) for body in (1, 2))
    found = vf.advise_matrices(S1, S2, transfer=random.standard_normal((4, 6)))
    assert found.matrices.neumann_body == found.neumann_body == neumann
    assert found.matrices.notes == ()


def test_a_square_transfer_leads_from_body_2_unless_told_otherwise_and_that_is_said():
    random = np.random.default_rng(0)
    S1, S2, P = spd(random, 4), spd(random, 4), random.standard_normal((4, 4))
    found = vf.advise_matrices(S1, S2, transfer=P)
    assert found.neumann_body == 2
    assert "from body 2 to body 1" in found.matrices.notes[0]
    told = vf.advise_matrices(S1, S2, transfer=P, neumann_body=1)
    assert (told.neumann_body, told.matrices.notes) == (1, ())


@pytest.mark.parametrize("components", [1, 2, 3])
def test_a_transfer_of_values_at_nodes_acts_on_each_component(components):
    random = np.random.default_rng(1)
    S1, S2, P = spd(random, 5 * components), spd(random, 4 * components), random.standard_normal((5, 4))
    whole = np.kron(np.eye(components), P)
    found, expected = (vf.advise_matrices(S1, S2, transfer=T) for T in (P, whole))
    assert rho(found, 2) == pytest.approx(rho(expected, 2), rel=1e-12)
    assert (found.matrices.ordering is None) == (components == 1)  # whole vectors tell their own ordering


# --- refused one by one -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("singular", [1, 2])
@pytest.mark.parametrize("friction", [None, "0.1"])
def test_a_body_that_contact_alone_holds_is_refused_as_neumann_body_alone(singular, friction):
    """The advice is that of the problem whose upper body may slide."""
    data = plates()
    fixed = {"body1": {**data["body1"]}, "body2": {**data["body2"], "prescribed": {"top": ["free", "-0.015"]}}}
    problem = vf.Problem.from_dict({**data, **fixed}).changed(neumann_body=1, friction="0.1")
    pair = vf.build(problem)
    lower, upper = (side.schur for side in pair.along_y)
    S1, S2 = (lower, upper) if singular == 2 else (upper, lower)
    rubbing = {"friction": friction, "x": pair.contact.grid.x, "kernel": pair.interface.kernel}
    beside = {} if friction is None else rubbing
    found = vf.advise_matrices(S1, S2, **beside)
    roles = by_body(found)
    assert (roles[singular].rho, roles[singular].singular) == (None, True)
    assert f"S{singular} is singular (1 free motion)" in roles[singular].reason["rho"]
    assert found.neumann_body == 3 - singular
    expected = vf.advise(problem).best
    assert roles[3 - singular].rho.value == pytest.approx(expected.rho.value, rel=1e-9)
    assert roles[3 - singular].theta_predicted == pytest.approx(expected.theta_predicted, rel=1e-9)
    assert roles[3 - singular].rho_tied == roles[3 - singular].rho
    if friction is None:
        assert roles[3 - singular].rho_min.value == pytest.approx(0, abs=1e-9)  # in its motion it costs nothing
    with pytest.raises(ValueError, match=r"S1 is singular.*S2 is singular"):
        vf.advise_matrices(upper, upper)


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        ({"S1": None}, "no S1"),
        ({"S2": np.eye(5)}, "same interface unknowns, or a transfer"),
        ({"S1": -np.eye(4)}, "indefinite"),
        ({"S1": np.zeros((4, 4))}, "entries are 0"),
        ({"S1": np.eye(4) * 1j}, "real numbers"),
        ({"transfer": np.ones(4)}, "needed a matrix"),
        ({"transfer": np.full((4, 4), np.nan)}, "not finite"),
        ({"transfer": np.zeros((4, 4))}, "rho"),
        ({"transfer": np.ones((4, 3))}, "4 x 3, S1 has 4 rows"),
        ({"neumann_body": 3}, "1 or 2"),
        ({"friction": 0.1, "x": [0, 1], "x_neumann": [0, 1], "radius": 1, "transfer": np.ones((4, 4))}, "mixes"),
        ({"friction": 0.1, "x": [0, 1], "radius": 1, "transfer": np.eye(2)}, "x_neumann"),
        ({"solve2": np.linalg.inv, "friction": 0.1}, "friction with an operator"),
        ({"S1": lambda u: u, "S2": lambda u: u}, "how many unknowns body 1 has"),
        ({"S1": lambda u: u, "S2": lambda u: u, "unknowns": 0}, "whole number > 0"),
        ({"S1": lambda u: u, "S2": lambda u: u, "unknowns": 4}, r"solve2.*solve1|solve1.*solve2"),
        ({"S1": lambda u: u[:3], "solve2": np.eye(4)}, "what S1 returns is a vector of 3: needed 4"),
        ({"S1": lambda u: u * np.nan, "solve2": np.eye(4)}, "what S1 returns has entries that are not finite"),
        ({"S1": lambda u: -u, "solve2": np.eye(4)}, "S1 is not positive"),
        ({"S1": lambda u: u + np.cumsum(u), "solve2": np.eye(4)}, "S1 is not symmetric"),
        ({"S1": lambda u: u, "solve2": -np.eye(4)}, "solve2 is not positive"),
        ({"S1": lambda u: u, "solve2": 2 * np.eye(4)}, "solve2 is not the inverse of S2"),
        ({"S1": lambda u: u, "solve2": np.eye(5)}, "S2 and solve2 have 4 and 5 rows"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_in_words(arguments, why):
    with pytest.raises(ValueError, match=why):
        vf.advise_matrices(**{"S1": np.eye(4), "S2": np.eye(4)} | arguments)


# --- operators --------------------------------------------------------------------------------------------------------


@fewer(15)
@given(couplings(), st.integers(0, 3))
def test_operators_give_the_rho_of_their_matrices(coupling, form):
    S1, S2, D, _ = coupling
    n = len(D)
    solve = lambda f: np.linalg.solve(S2, f)
    given = [
        {"S1": S1.__matmul__, "solve2": solve, "unknowns": n},
        {"S1": aslinearoperator(S1), "solve2": LinearOperator((n, n), matvec=solve, dtype=float)},
        {"S1": S1.__matmul__, "S2": S2},
        {"S1": S1, "solve2": np.linalg.inv(S2)},
    ][form]
    found = vf.advise_matrices(**given)
    role = by_body(found)[2]
    assert role.theta_proved is role.factor_proved is role.theta_max_proved is None
    assert "may be larger" in role.reason["theta_proved"]
    (lanczos,) = found.matrices.lanczos
    assert role.rho.value == lanczos.rho == pytest.approx(D[-1], rel=1e-3)
    rounding = 1e-12 * D[-1]
    for missed, next_one, residual in (  # a Rayleigh quotient misses an end by residual^2 / gap at most (Temple, Kato)
        (D[-1] - lanczos.rho, lanczos.rho - D[-2], lanczos.residual),
        (lanczos.rho_min - D[0], D[1] - lanczos.rho_min, lanczos.residual_min),
    ):
        assert missed >= -rounding
        assert missed * next_one <= residual**2 + rounding * D[-1]
    other = by_body(found)[1]
    assert other.rho is None
    assert "needed products with S2 and solves with S1" in other.reason["rho"] or form in (2, 3)


def test_a_transfer_joins_operators_as_it_joins_matrices():
    random = np.random.default_rng(2)
    S1, S2, P = spd(random, 15), spd(random, 12), random.standard_normal((5, 4))
    expected = vf.advise_matrices(S1, S2, transfer=P)
    for T in (P, sp.csr_array(P), aslinearoperator(P), aslinearoperator(np.kron(np.eye(3), P))):
        found = vf.advise_matrices(S1.__matmul__, S2, transfer=T, unknowns=np.int64(15))
        assert rho(found, 2) == pytest.approx(rho(expected, 2), rel=1e-9)
        assert "its own transfer" in by_body(found)[1].reason["rho"]


def circulant(symbol, n):
    return lambda vector: np.fft.irfft(symbol * np.fft.rfft(vector), n)


def strip(G, thickness, n, kappa=1.8):
    """Normal stiffness of a strip held below, of period 1, for the wave numbers of n points."""
    xi = 2 * np.pi * np.maximum(np.arange(n // 2 + 1), 1e-3)
    x = np.minimum(xi * thickness, 40.0)
    s = np.sinh(x) ** 2
    return G * xi * (kappa + 1) * (kappa * np.sinh(2 * x) + 2 * x) / (2 * (kappa**2 * s - x**2))


@pytest.mark.parametrize(("thicknesses", "n"), [((0.3, 0.1), 50_000), ((0.1, 0.3), 50_000), ((0.01, 0.012), 20_000)])
def test_fifty_thousand_unknowns_of_known_spectrum_need_products_and_solves_alone(thicknesses, n):
    a, b = strip(2.0, thicknesses[0], n), strip(7.0, thicknesses[1], n)
    told = []
    found = vf.advise_matrices(
        circulant(a, n), solve2=circulant(1 / b, n), unknowns=n, progress=lambda what, share: told.append(what)
    )
    (lanczos,) = found.matrices.lanczos
    exact = (a / b).max()
    assert lanczos.rho <= exact * (1 + 1e-12)  # a Rayleigh quotient
    assert lanczos.rho == pytest.approx(exact, rel=1e-4)
    assert np.abs(a / b - lanczos.rho).min() <= lanczos.residual + 1e-12  # what the residual proves
    assert lanczos.rho_min >= (a / b).min() * (1 - 1e-12)
    assert "step 1 of Lanczos" in told[0]
    assert f"step {lanczos.steps} of Lanczos" in told[-1]


def test_a_sparse_matrix_beyond_the_size_of_dense_ones_is_an_operator():
    n = 5000
    chain = sp.diags_array([np.full(n - 1, -1.0), np.full(n, 3.0), np.full(n - 1, -1.0)], offsets=[-1, 0, 1]).tocsc()
    found = vf.advise_matrices(chain, 2 * sp.eye_array(n))
    assert rho(found, 2) == pytest.approx((3 + 2 * np.cos(np.pi / (n + 1))) / 2, rel=1e-4)
    assert rho(found, 1) == pytest.approx(2 / (3 - 2 * np.cos(np.pi / (n + 1))), rel=1e-4)
    assert any("assembled" in note for note in found.matrices.notes)
    with pytest.raises(ValueError, match="not positive definite"):
        vf.advise_matrices(chain - 2 * sp.eye_array(n), sp.eye_array(n))


def test_operators_that_are_slightly_asymmetric_are_told():
    random = np.random.default_rng(3)
    S, skew = spd(random, 30), random.standard_normal((30, 30))
    given = S + 1e-5 * (skew - skew.T)
    found = vf.advise_matrices(given.__matmul__, solve2=np.eye(30))
    assert any("S1 is asymmetric" in note for note in found.matrices.notes)
    assert rho(found, 2) == pytest.approx(100, rel=1e-4)
