"""Steps of methods predicted on a spectrum, and the method that is advised."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from linear_couplings import Linear

import verification as vf
from verification.coupling.methods import METHODS, MOST, NEAR, MethodRow, advised, at_most, rows, steps
from verification.coupling.readings import rounded_down
from verification.coupling.spectrum import Spectrum


def by_hand(values, theta, tolerance=1e-6, solution=1.0):
    """Constant relaxation of a diagonal model, one step after the other."""
    values, x = np.asarray(values), np.zeros(len(values))
    for n in range(1, 100_000):
        y = solution - values * (x - solution)
        if np.linalg.norm(y - x) < tolerance * np.linalg.norm(y):
            return n
        x = x + theta * (y - x)
    return None


def aitken_by_hand(values, theta, tolerance=1e-6):
    """Aitken by its other formula, the secant of the residual along the last step."""
    values, x, last = np.asarray(values), np.zeros(len(values)), None
    for n in range(1, MOST):
        r = -(1 + values) * (x - 1)
        if np.linalg.norm(r) < tolerance * np.linalg.norm(x + r):
            return n
        if last is not None:
            step, change = x - last[0], r - last[1]
            theta = -float(step @ change) / float(change @ change)  # least |step + theta change|
        last = x, r
        x = x + theta * r
    return None


def quasi_newton_by_hand(values, theta, tolerance=1e-6):
    """IQN-ILS by the inverse Jacobian ``W (V'V)^-1 V'`` in 60 digits."""
    import mpmath as mp

    with mp.workdps(60):
        lambdas, n = [mp.mpf(float(v)) for v in values], len(values)
        x, seen = mp.matrix([0] * n), []
        for count in range(1, 60):
            y = mp.matrix([1 - lambdas[i] * (x[i] - 1) for i in range(n)])
            r = y - x
            if mp.norm(r) < tolerance * mp.norm(y):
                return count
            seen.append((r, y))
            if len(seen) == 1:
                x = x + mp.mpf(theta) * r
                continue
            V = mp.matrix(n, len(seen) - 1)
            W = mp.matrix(n, len(seen) - 1)
            for j, (rj, yj) in enumerate(seen[:-1]):
                for i in range(n):
                    V[i, j], W[i, j] = rj[i] - r[i], yj[i] - y[i]
            c = mp.lu_solve(V.T * V, -(V.T * r))
            x = y + W * c
    return None


spectra = st.lists(st.floats(0.02, 40), min_size=2, max_size=8)


@given(spectra, st.floats(0.05, 0.98))
def test_steps_of_a_constant_theta_are_those_of_the_iteration(values, share):
    theta = share * 2 / (1 + max(values))
    assert steps(Spectrum.of(values), "constant", theta) == by_hand(values, theta)


@given(spectra)
def test_aitken_is_predicted_as_by_its_secant(values):
    theta = 1 / (1 + max(values))
    ours, other = steps(Spectrum.of(values), "aitken", theta), aitken_by_hand(values, theta)
    assert ours == pytest.approx(other, abs=1 + 0.1 * (other or 0))  # rounding grows along the steps


@given(st.lists(st.floats(0.05, 20), min_size=2, max_size=5, unique=True))
def test_iqn_ils_is_predicted_as_by_its_inverse_jacobian(values):
    spread = min((abs(a - b) for i, a in enumerate(values) for b in values[:i]), default=1.0)
    if spread < 0.05:  # modes that hardly differ are one mode, or two, by rounding
        return
    theta = 1 / (1 + max(values))
    assert steps(Spectrum.of(values), "iqn-ils", theta) == pytest.approx(quasi_newton_by_hand(values, theta), abs=1)


@given(st.floats(0.05, 10), st.floats(0, 2), st.floats(0.05, 0.95))
def test_complex_modes_are_those_of_a_rotation(a, slope, share):
    """A pair ``a +- ib`` is one mode, or a real system of two unknowns."""
    b = slope * (1 + a)
    block, x, n = np.array([[a, -b], [b, a]]), np.zeros(2), 1
    theta = share * 2 / ((1 + a) * (1 + slope**2))  # |1 - theta z| < 1 for z = 1 + a +- ib
    target = np.array([1.0, 0.0])
    while np.linalg.norm((y := target - block @ (x - target)) - x) >= 1e-6 * np.linalg.norm(y):
        x, n = x + theta * (y - x), n + 1
    assert steps(Spectrum.of([a + 1j * b]), "constant", theta) == n


def test_theta_that_diverges_has_no_steps():
    assert steps(Spectrum.of([3.0]), "constant", 0.5) is None
    assert steps(Spectrum.of([3.0]), "constant", 0.51) is None
    assert steps(Spectrum.of([0.0]), "constant", 1.0) == 2


@pytest.mark.parametrize("seed", range(6))
def test_predictions_on_all_eigenvalues_are_near_the_steps_of_couplings(seed):
    generator = np.random.default_rng(seed)
    coupling = Linear(10 ** generator.uniform(-1, 1.3, size=20), seed)
    spectrum = Spectrum.of(coupling.values)
    for method in METHODS:
        predicted, taken = steps(spectrum, method, spectrum.theta), coupling.steps(method, spectrum.theta)
        assert 0.6 <= predicted / taken <= 1.5, method


def table(own, exchanged=()):
    """Rows with these steps of each method, in the roles as they are and exchanged."""
    return [
        MethodRow(method=method, neumann_body=None, exchanged=other, theta=0.5, steps=count)
        for other, counts in ((False, own), (True, exchanged))
        for method, count in zip(METHODS, counts, strict=False)
    ]


@pytest.mark.parametrize(
    ("own", "exchanged", "tied", "name", "reason"),
    [
        ((12, 11, 10), (), True, "constant", "12 steps; IQN-ILS takes 10, hardly fewer"),
        ((4, 3), (2,), True, "constant", ""),  # neither a method nor exchanged roles for two steps
        ((5, 2), (), True, "aitken", ""),
        ((237, 52, 14), (), True, "iqn-ils", "14 steps; a constant theta takes 237, 17 times as many"),
        ((237, 52, 14), (), False, "aitken", "IQN-ILS takes 14 if contact does not change"),  # shown, not advised
        ((60, 22, 20), (), True, "aitken", ""),  # where both are about as fast
        ((60, 25, 20), (), True, "iqn-ils", ""),
        ((100, 30, 12), (11, 11, 10), True, "iqn-ils", ""),  # exchanged only where no method serves in these roles
        ((100, 30, 12), (6, 6, 6), True, "constant, exchanged", ""),
    ],
)
def test_the_simplest_method_that_costs_little_is_advised(own, exchanged, tied, name, reason):
    found = advised(table(own, exchanged), tied=tied)
    assert found.name + ", exchanged" * found.exchanged == name
    assert reason in found.reason
    assert NEAR * 10 >= 12


def test_without_a_method_that_arrives_none_is_advised_and_roles_may_be_left_as_they_are():
    assert advised(table((None, None, None)), tied=True) is None
    assert advised(table((100, 30, 12), (6, 6, 6)), tied=True, exchanged=False).name == "iqn-ils"


def test_rows_have_the_theta_of_the_role():
    found = rows(Spectrum.of([1.0, 3.0]), theta=1 / 3, neumann_body=2, exchanged=False)
    assert [one.method for one in found] == list(METHODS)
    assert {one.theta for one in found} == {1 / 3}
    assert all(one.steps is not None for one in found)


@pytest.mark.parametrize(("tied", "friction"), [(False, "0"), (True, "0"), (False, "0.2")])
def test_the_table_of_a_problem_is_that_of_its_matrices(tied, friction):
    problem = vf.example("section6").changed(friction=friction, cells=((10, 2), (6, 2)))
    found, pair = vf.advise(problem, tied=tied), vf.build(problem)
    assert [m.neumann_body for m in found.methods] == [1, 1, 1, 2, 2, 2]
    assert found.method.neumann_body == found.neumann_body == 1
    if friction != "0" or tied:
        S_c, S_n = pair.contact.schur, pair.neumann.schur
        values = np.sort(np.linalg.eigvals(np.linalg.solve(S_n, S_c)).real)
        other = vf.advise_matrices(S1=pair.neumann.schur, S2=pair.contact.schur, tied=tied)
        own = next(role for role in other.roles if role.neumann_body == 1)
        assert own.spectrum.values.real == pytest.approx(values, rel=1e-8)
    for one in found.methods[:3]:
        assert one.theta == found.theta == rounded_down(found.chosen(found.best)[0])  # the one to paste
    assert found.spectrum.high == pytest.approx(found.best.rho_tied.value if tied else found.best.rho.value)


def test_one_known_end_gives_bounds():
    found = vf.advise_run("0.45", "0.8")
    assert [one.bound for one in found.methods] == ["at most", None, None]
    constant, aitken, _ = found.methods
    rho = found.best.rho.value
    assert constant.steps >= steps(Spectrum.of([rho]), "constant", constant.theta)
    said = str(found.sections())
    assert f"<= {constant.steps}" in said
    assert f"<= {aitken.steps}" not in said
    assert f"at most {constant.steps}" in found.method.reason


@given(st.floats(0.01, 100), st.lists(st.floats(0, 1), min_size=1, max_size=5), st.floats(0.05, 0.999))
def test_the_bound_of_a_constant_theta_holds_for_all_eigenvalues_and_first_errors(high, shares, share):
    theta = share * 2 / (2 + high)
    bound = at_most(high, theta)
    values = np.array(shares) * high
    assert steps(Spectrum.of(values), "constant", theta) <= bound
    if bound < 1000:
        solution = np.random.default_rng(len(shares)).standard_normal(len(values))
        assert by_hand(values, theta, solution=solution) <= bound


@pytest.mark.parametrize("high", [0.3, 1.0, 3.0, 10.0, 100.0])
def test_the_bound_of_a_constant_theta_is_attained_at_the_largest_eigenvalue(high):
    theta = 2 / (2 + high)
    assert at_most(high, theta) == steps(Spectrum.of([high]), "constant", theta)
    assert at_most(high, 2.01 / (1 + high)) is None


@pytest.mark.parametrize("high", [0.5, 3.0, 40.0])
@pytest.mark.parametrize("n", [1, 2, 5])
def test_steps_of_a_constant_theta_are_counted_with_the_image_of_the_error_on_its_own_side(high, n):
    """``|T x| = 1 + high q^n`` for an error ``-q^n``: where ``(1 + high) q^n`` is the tolerance, a step less does."""
    q = (1e-6 / (1 + high)) ** (1 / n)
    theta = (1 - q) / (1 + high)
    assert steps(Spectrum.of([high]), "constant", theta) == by_hand([high], theta) == n + 1
