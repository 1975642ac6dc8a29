"""Extremal eigenvalues against spectra known by construction and against a dense solver; residuals as error bounds."""

import itertools

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from hypothesis import given
from hypothesis import strategies as st
from strategies import fewer, held_bodies, in_floats, plane_meshes, powers_of_two

from fem1d2d import (
    Condensation,
    bar,
    extremes_by_solves,
    gram,
    interval,
    largest,
    largest_of,
    largest_sparse,
    plane_strain,
    rectangle,
    solver,
    stiffness,
    supports,
    surface,
)
from fem1d2d.pencil import DENSE, LONG_BASIS, rayleigh_quotient

EPS = np.finfo(float).eps


@st.composite
def pencils(draw, least=1, most=70):
    """A = L D L', B = L L' with integers D and |L_ij| <= 1/2 beside a unit diagonal: the eigenvalues are D, exactly.

    Columns of X with L'X = I are the eigenvectors.
    """
    n = draw(st.integers(least, most))
    random = np.random.default_rng(draw(st.integers(0, 2**16)))
    D = random.integers(-20, 21, n).astype(float)
    D[0] = 1.0  # not all zero
    L = np.eye(n) + np.diag(random.integers(-2, 3, n - 1) / 4, -1)
    order = random.permutation(n)
    A, B = (M[np.ix_(order, order)] for M in (L * D @ L.T, L @ L.T))
    return A, B, D, np.linalg.inv(L.T)[order]


def sparse(A, B):
    return sp.csc_array(A), sp.csc_array(B), sp.linalg.splu(sp.csc_array(B)).solve


def with_an_eigenvalue_of_multiplicity(k, n, seed):
    """A = L D L', B = L L' as above; the largest entry of D, 20, stands k times in it."""
    random = np.random.default_rng(seed)
    D = np.concatenate([np.full(k, 20.0), random.integers(-20, 20, n - k)])
    L = np.eye(n) + np.diag(random.integers(-2, 3, n - 1) / 4, -1)
    order = random.permutation(n)
    return [M[np.ix_(order, order)] for M in (L * D @ L.T, L @ L.T)]


# --- values -----------------------------------------------------------------------------------------------------------


@given(pencils())
def test_the_largest_eigenvalue_is_the_largest_entry_of_the_diagonal_it_was_made_of(pencil):
    A, B, D, _ = pencil
    for found in (largest(A, B), largest_sparse(*sparse(A, B))):
        assert found.value == pytest.approx(D.max(), abs=1e-13 * np.abs(D).max())
        assert found.residual <= 1e-9 * np.abs(D).max()


@pytest.mark.parametrize("multiplicity", [2, 3, 6, 8])
def test_the_residual_at_a_multiple_eigenvalue_is_as_small_as_at_a_simple_one(multiplicity):
    """Without a restart 1 to 3 % of them, not the same on every processor, end at 1e-10 to 3e-8."""
    for seed in range(100):
        n = DENSE + 1 + seed % 10
        found = largest_sparse(*sparse(*with_an_eigenvalue_of_multiplicity(multiplicity, n, seed)))
        assert found.value == pytest.approx(20, rel=1e-13)
        assert found.residual <= 1e-10 * 20


@pytest.mark.parametrize(("others", "most"), [(0.01, 12), (0.5, 24)])
def test_lanczos_ends_at_the_step_at_which_the_residual_is_small_enough(others, most):
    """The farther the other eigenvalues lie, the fewer solves."""
    n = 500
    diagonal = np.append(np.linspace(0, others, n - 1), 1.0)
    solves = []

    def solve(r):
        solves.append(1)
        return r / 2

    found = largest_sparse(sp.diags_array(diagonal, format="csc"), 2 * sp.eye_array(n, format="csc"), solve)
    assert found.value == pytest.approx(0.5, rel=1e-14)
    assert found.residual <= 1e-10 * 0.5
    assert len(solves) <= most


def test_a_spectrum_that_the_vectors_kept_cannot_resolve_takes_restarts():
    n = 1000
    diagonal = np.linspace(0.0, 1.0, n) ** 0.5
    found = largest_sparse(*sparse(np.diag(diagonal), np.eye(n)))
    assert found.value == pytest.approx(1, rel=1e-12)
    assert found.residual <= 1e-10


@given(pencils())
def test_the_eigenvector_has_norm_one_and_its_residual_is_the_one_reported(pencil):
    A, B, _, _ = pencil
    for found in (largest(A, B), largest_sparse(*sparse(A, B))):
        x = found.vector
        assert x @ B @ x == pytest.approx(1, rel=len(A) * EPS)
        r = A @ x - found.value * (B @ x)
        assert np.sqrt(r @ np.linalg.solve(B, r)) == pytest.approx(found.residual, rel=1e-6, abs=len(A) * 40 * EPS)
        assert found.value == pytest.approx(x @ A @ x, abs=len(A) * 40 * EPS)


@fewer(6, at_night=2)
@given(held_bodies(most=5))
def test_m_and_M_of_an_elastic_body_are_those_of_a_dense_solver(body):
    mesh, material, free = body
    A, H = (matrix[free][:, free].tocsc() for matrix in (stiffness(mesh, material), gram(mesh)))
    spectrum = scipy.linalg.eigh(A.toarray(), H.toarray(), eigvals_only=True)
    low = largest_sparse(H, A, solver(A))
    high = largest_sparse(A, H, solver(H))
    assert 1 / low.value == pytest.approx(spectrum[0], rel=1e-11)
    assert high.value == pytest.approx(spectrum[-1], rel=1e-11)
    dense = largest(H.toarray(), A.toarray()), largest(A.toarray(), H.toarray())
    assert [low.value, high.value] == pytest.approx([dense[0].value, dense[1].value], rel=1e-11)


@fewer(6, at_night=2)
@given(held_bodies(most=4), powers_of_two(-20, 20))
def test_scaling_the_modulus_scales_the_eigenvalue_and_scaling_the_norm_divides_it(body, c):
    mesh, material, free = body
    A, H = (matrix[free][:, free].toarray() for matrix in (stiffness(mesh, material), gram(mesh)))
    c = float(c)
    once = largest(A, H).value
    assert largest(c * A, H).value == pytest.approx(c * once, rel=1e-13)
    assert largest(A, c * H).value == pytest.approx(once / c, rel=1e-13)


@given(pencils(), st.integers(-8, 8))
def test_shifting_the_pencil_shifts_the_eigenvalue(pencil, shift):
    A, B, D, _ = pencil
    assert largest(A + shift * B, B).value == pytest.approx(D.max() + shift, abs=30 * len(A) * EPS)


@pytest.mark.parametrize("n", [1, 2, DENSE - 1, DENSE, DENSE + 1, 2 * DENSE])
def test_a_pencil_of_multiples_has_one_eigenvalue_at_every_size(n):
    B = np.diag(np.full(n, 4.0)) + np.diag(np.ones(n - 1), 1) + np.diag(np.ones(n - 1), -1)
    assert largest(3 * B, B).value == pytest.approx(3, rel=n * EPS)
    assert largest_sparse(*sparse(3 * B, B)).value == pytest.approx(3, rel=n * EPS)


@pytest.mark.parametrize("nx", [2, 4, 6, 8, 10, 12, 14, 16])
def test_of_two_equal_bodies_the_stiffer_is_so_on_every_trace_by_the_quotient_of_the_moduli(nx):
    mesh = rectangle((0.0, 2.0), (0.0, 0.3), (nx, 4))
    free = np.flatnonzero(~supports(mesh, {"bottom": [0.0, 0.0]}).held.ravel())
    top = surface(mesh, upper=True)
    trace = np.searchsorted(free, np.concatenate([2 * top, 2 * top + 1]))
    S1, S2 = (
        Condensation(stiffness(mesh, plane_strain(young, 0.3))[free][:, free].tocsc(), trace).schur
        for young in (7e4, 2e4)
    )
    assert largest(S1, S2).value == pytest.approx(7 / 2, rel=1e-12)
    assert largest(S2, S1).value == pytest.approx(2 / 7, rel=1e-12)


@pytest.mark.parametrize("n", [DENSE, DENSE + 1])
def test_the_dense_and_the_sparse_solver_agree_on_both_sides_of_the_size_that_divides_them(n):
    mesh = interval((0.0, 1.0), n)
    A, H = (matrix[1:][:, 1:].tocsc() for matrix in (stiffness(mesh, bar(2.0)), gram(mesh)))
    found = largest_sparse(A, H, sp.linalg.splu(H).solve)
    assert found.value == pytest.approx(largest(A.toarray(), H.toarray()).value, rel=1e-13)


def test_the_largest_eigenvalue_is_not_the_largest_in_size():
    A = np.diag([-5.0, 2.0])
    assert largest(A, np.eye(2)).value == pytest.approx(2, rel=4 * EPS)
    wide = np.diag(np.linspace(-100, 1, 50))
    assert largest_sparse(*sparse(wide, np.eye(50))).value == pytest.approx(1, rel=1e-12)


@given(pencils(least=DENSE + 1), st.sampled_from([0.25, 1.0, 1000.0]))
def test_an_upper_bound_of_the_spectrum_does_not_change_the_eigenvalue(pencil, slack):
    A, B, D, X = pencil
    found = largest_sparse(*sparse(A, B), above=D.max() + slack)
    assert found.value == pytest.approx(D.max(), abs=1e-12 * (np.abs(D).max() + slack))
    assert np.abs(D - found.value).min() <= found.residual + 1e-13 * np.abs(D).max()
    top = np.isclose(D, D.max(), rtol=0)
    overlap = (B @ X[:, top]).T @ found.vector  # the vector lies in the eigenspace
    assert np.linalg.norm(overlap) == pytest.approx(1, rel=1e-9)


def test_an_upper_bound_tells_apart_what_crowds_below_it():
    """A body without lateral contraction: the top of its spectrum crowds below 2 mu."""
    mesh, law = rectangle((0.0, 2.0), (0.0, 0.3), (16, 4)), plane_strain(1.0, 0.0)
    free = np.flatnonzero(~supports(mesh, {"bottom": [0.0, 0.0]}).held.ravel())
    A, H = (matrix[free][:, free].tocsc() for matrix in (stiffness(mesh, law), gram(mesh)))
    found = largest_sparse(A, H, solver(H), above=law.continuity(2))
    assert found.value == pytest.approx(scipy.linalg.eigh(A.toarray(), H.toarray(), eigvals_only=True)[-1], rel=1e-13)
    again = largest_sparse(A, H, solver(H), above=law.continuity(2))
    assert (found.value, found.vector.tolist()) == (again.value, again.vector.tolist())


@given(st.integers(1, 80), st.floats(0, 1), st.integers(0, 2**16))
def test_a_largest_eigenvalue_of_high_multiplicity_is_found_also_when_rounding_splits_it(n, share, seed):
    """As rho of two bodies that are alike, wholly or in part: of dense matrices, `share` of the spectrum lower."""
    random = np.random.default_rng(seed)
    G = random.standard_normal((n, n))
    B = G @ G.T + n * np.eye(n)
    L, Q = np.linalg.cholesky(B), np.linalg.qr(random.standard_normal((n, n)))[0]
    D = np.where(np.arange(n) < share * (n - 1), random.choice([-1.0, 0.5, 1.25], n), 1.5)
    A = L @ (Q * D) @ Q.T @ L.T
    assert largest((A + A.T) / 2, B).value == pytest.approx(1.5, rel=n * 16 * EPS)


@pytest.mark.parametrize("n", [10, 30])
def test_a_pencil_all_of_whose_eigenvalues_are_one_has_that_one(n):
    """A subset that LAPACK is asked for may be empty then, which some of these rotations of the identity show."""
    for seed in range(100):
        Q = np.linalg.qr(np.random.default_rng(seed).standard_normal((n, n)))[0]
        assert largest(Q @ Q.T, np.eye(n)).value == pytest.approx(1.0, rel=n * 16 * EPS)


# --- from products and solves alone -----------------------------------------------------------------------------------


def by_operators(A, B, **options):
    """The largest eigenvalue where nothing but products and solves is handed over."""
    operator = lambda apply: sp.linalg.LinearOperator(A.shape, matvec=apply, dtype=float)
    solve = operator(lambda r: np.linalg.solve(B, r))
    return largest_of(operator(A.__matmul__).matvec, operator(B.__matmul__).matvec, solve.matvec, len(A), **options)


@given(pencils())
def test_products_and_solves_alone_give_the_eigenvalue_of_the_matrices(pencil):
    A, B, D, _ = pencil
    found = by_operators(A, B)
    assert found.value == pytest.approx(D.max(), abs=1e-13 * np.abs(D).max())
    assert found.residual <= 1e-9 * np.abs(D).max()
    assert np.abs(D - found.value).min() <= found.residual + 1e-13 * np.abs(D).max()


def test_each_step_of_lanczos_is_told():
    told = []
    by_operators(np.diag(np.arange(1.0, 101.0)), np.eye(100), progress=told.append)
    assert told
    assert told == list(range(1, len(told) + 1))


def test_lanczos_stops_earlier_where_less_is_asked():
    D, steps = np.linspace(1.0, 2.0, 100) ** 0.1, []
    for tolerance in (1e-3, 1e-10):
        told = []
        found = by_operators(np.diag(D), np.eye(100), tolerance=tolerance, progress=told.append)
        assert found.residual <= tolerance * found.value
        assert found.value <= D.max() * (1 + 1e-14)
        steps.append(len(told))
    assert steps[0] < steps[1] / 2


def test_a_shift_just_above_a_crowd_takes_a_tenth_of_the_steps():
    """Eigenvalues as those of waves along Gamma_c about the stiffest one, ``1 - (j/n)^2``: the gap is 1/n^2."""
    n = 1000
    D, B, shift = 3 * (1 - (np.arange(n) / n) ** 2), np.full(n, 2.0), 3 * (1 + 1e-5)
    pencil = (lambda x: B * D * x, lambda x: B * x, lambda r: r / B, n)
    plain, shifted = [], []
    one = largest_of(*pencil, progress=plain.append)
    other = largest_of(*pencil, above=(shift, lambda r: r / (B * (shift - D))), progress=shifted.append)
    assert [one.value, other.value] == pytest.approx([3, 3], rel=1e-13)
    assert len(shifted) < len(plain) / 10


# --- it repeats -------------------------------------------------------------------------------------------------------


@fewer(5)
@given(held_bodies(most=5), st.integers(0, 2**16))
def test_an_eigenvalue_repeats_to_the_digit_whatever_the_global_random_state(body, seed):
    mesh, material, free = body
    A, H = (matrix[free][:, free].tocsc() for matrix in (stiffness(mesh, material), gram(mesh)))
    solve = solver(H)
    one = largest_sparse(A, H, solve)
    np.random.seed(seed)  # noqa: NPY002
    other = largest_sparse(A, H, solve)
    assert one.value == other.value
    assert one.residual == other.residual
    assert np.array_equal(one.vector, other.vector)


def test_an_eigenvector_is_read_only():
    found = largest(np.eye(2), np.eye(2))
    with pytest.raises(ValueError, match="read-only"):
        found.vector[0] = 0


# --- residuals bound errors -------------------------------------------------------------------------------------------


def certified(A, B, x):
    return rayleigh_quotient(A.__matmul__, x, B @ x, lambda r: np.linalg.solve(B, r))


@given(pencils(), st.integers(0, 2**16))
def test_some_eigenvalue_lies_within_the_residual_of_any_vector_s_rayleigh_quotient(pencil, seed):
    A, B, D, _ = pencil
    found = certified(A, B, np.random.default_rng(seed).standard_normal(len(A)))
    assert np.abs(D - found.value).min() <= found.residual + 1e-13 * np.abs(D).max()


@given(pencils(least=2), st.data())
def test_the_residual_is_exactly_the_distance_for_the_mean_of_two_eigenvectors(pencil, data):
    A, B, D, X = pencil
    i, j = data.draw(st.permutations(range(len(A))))[:2]
    found = certified(A, B, X[:, i] + X[:, j])
    assert found.value == pytest.approx((D[i] + D[j]) / 2, abs=1e-12)
    assert found.residual == pytest.approx(abs(D[i] - D[j]) / 2, abs=1e-6 if D[i] == D[j] else 1e-12)


@given(pencils(least=2), st.integers(0, 2**16), st.integers(1, 5))
def test_near_an_isolated_eigenvalue_the_error_is_below_the_square_of_the_residual_over_the_gap(pencil, seed, digits):
    A, B, D, X = pencil
    top = D.argmax()
    rest = np.delete(D, top)
    noise = np.random.default_rng(seed).standard_normal(len(A))
    found = certified(A, B, X[:, top] + 10.0**-digits * X @ noise / np.linalg.norm(noise))
    gap = found.value - rest.max()
    error = D[top] - found.value
    assert error >= -1e-12
    assert error * gap <= found.residual**2 + 1e-12
    if D[top] > rest.max():
        assert error <= 40 * 100.0**-digits + 1e-12


@given(pencils())
def test_the_residual_of_what_is_returned_bounds_its_distance_to_the_spectrum(pencil):
    A, B, D, _ = pencil
    for found in (largest(A, B), largest_sparse(*sparse(A, B))):
        assert np.abs(D - found.value).min() <= found.residual + 1e-13 * np.abs(D).max()


@fewer(4, at_night=1)
@given(plane_meshes(3), st.sampled_from([-0.9, -0.3, 0.0, 0.3, 0.45]))
def test_no_body_exceeds_the_continuity_of_its_material(mesh, poisson):
    """M^a <= max(2 mu, 2 mu + 2 lambda), attained nowhere but approached; for positive and negative Poisson ratios."""
    law = plane_strain(1.0, poisson)
    A, H = stiffness(in_floats(mesh), law).toarray(), gram(in_floats(mesh)).toarray()
    assert largest(A, H).value < law.continuity(2)


# --- products and solves alone ----------------------------------------------------------------------------------------


@given(pencils())
def test_both_ends_of_a_spectrum_need_one_product_and_one_solve_a_step(pencil):
    A, B, D, _ = pencil
    calls = {"products": 0, "solves": 0}

    def counted(name, matrix):
        def apply(vector):
            calls[name] += 1
            return matrix @ vector

        return apply

    found = extremes_by_solves(counted("products", A), counted("solves", np.linalg.inv(B)), len(D), tolerance=1e-10)
    unit = np.abs(D).max()
    assert found.largest.value == pytest.approx(D.max(), abs=1e-9 * unit)
    assert found.least.value == pytest.approx(D.min(), abs=1e-3 * unit)
    assert calls["products"] == found.steps + 2  # and one to see each residual
    assert calls["solves"] == found.steps + 1 + 4
    for end in (found.least, found.largest):
        assert end.vector @ B @ end.vector == pytest.approx(1, rel=1e-9)
        assert np.abs(D - end.value).min() <= end.residual + 1e-10 * unit


@pytest.mark.parametrize("n", [1000, 3000])
def test_a_restart_keeps_what_was_found(n):
    """A spectrum that crowds at its upper end takes more steps than there are vectors."""
    D = 1 - (1 - np.linspace(0, 1, n)) ** 2
    told = []
    found = extremes_by_solves(
        lambda x: D * x, lambda r: r, n, tolerance=1e-4, progress=lambda *step: told.append(step)
    )
    values = [value for _, value, _ in told]
    assert all(later >= earlier - 1e-13 for earlier, later in itertools.pairwise(values))
    assert 1 - found.largest.residual <= found.largest.value <= 1 + 1e-12
    assert found.largest.residual <= 1.01e-4
    assert found.steps > LONG_BASIS
    assert told[-1][0] == found.steps


def test_a_limit_of_steps_ends_with_what_is_known_and_its_residual():
    D = np.linspace(1.0, 2.0, 2000)
    found = extremes_by_solves(lambda x: D * x, lambda r: r, 2000, tolerance=1e-12, most=10)
    assert found.steps == 10
    assert found.largest.value < 2
    assert np.abs(D - found.largest.value).min() <= found.largest.residual
    assert found.largest.residual > 1e-3


@pytest.mark.parametrize(
    ("A", "B", "error"),
    [
        (np.full((2, 2), np.nan), np.eye(2), ValueError),
        (np.eye(2), np.diag([1.0, np.inf]), ValueError),
        (np.eye(2), np.diag([1.0, -1.0]), np.linalg.LinAlgError),
        (np.eye(2), np.diag([1.0, 0.0]), np.linalg.LinAlgError),
    ],
)
def test_a_dense_pencil_without_a_largest_eigenvalue_is_refused(A, B, error):
    with pytest.raises(error, match="a pencil"):
        largest(A, B)


@pytest.mark.parametrize("n", [1, 2, 9, 41])
def test_the_largest_eigenvalue_of_a_dense_pencil_leaves_its_matrices_alone(n):
    random = np.random.default_rng(n)
    (A, B) = (M @ M.T + np.eye(n) for M in random.standard_normal((2, n, n)))
    before = A.copy(), B.copy()
    found = largest(A, B)
    assert found.value == pytest.approx(scipy.linalg.eigvalsh(A, B)[-1], rel=1e-12)
    assert np.array_equal((A, B), before)
