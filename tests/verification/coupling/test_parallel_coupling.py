"""Parallel coupling, both solvers at once: from logs, vectors, matrices and moduli, and driven by `couple`."""

import numpy as np
import pytest
from coupling_logs import kinds, precice
from hypothesis import given
from hypothesis import strategies as st
from strategies import log_uniform

import verification as vf
from ndtheory.energy_norms import parallel_factor, parallel_theta
from verification.algorithm.rates import steps
from verification.coupling.readings import rho_in_parallel
from verification.coupling.spectrum import Spectrum


class Solvers:
    """Two linear solvers on some unknowns, the second in a unit that is larger by ``unit``."""

    def __init__(self, n=12, unit=1e6, high=6.0, seed=0):
        generator = np.random.default_rng(seed)
        Q, R = (np.linalg.qr(generator.normal(size=(n, n)))[0] for _ in range(2))
        self.S_n = unit * Q @ np.diag(np.geomspace(1, 4, n)) @ Q.T
        root = np.linalg.cholesky(self.S_n)
        self.values = np.geomspace(0.1, high, n)
        self.S_c = root @ R @ np.diag(self.values) @ R.T @ root.T
        self.load, self.moved = generator.normal(size=n) * unit, generator.normal(size=n)

    def neumann(self, g):
        return np.linalg.solve(self.S_n, g) + self.moved

    def contact(self, u):
        return self.load - self.S_c @ u

    @property
    def solution(self):
        n = len(self.load)
        return np.linalg.solve(np.eye(n) + self.S_c @ np.linalg.inv(self.S_n), self.contact(self.moved))

    def rows(self, theta, count):
        """Force and displacement of a run with constant theta, one behind the other, and their images."""
        n, X, TX = len(self.load), [], []
        x = np.zeros(2 * n)
        for _ in range(count):
            image = np.concatenate([self.contact(x[n:]), self.neumann(x[:n])])
            X.append(x)
            TX.append(image)
            x = x + theta * (image - x)
        return np.array(X), np.array(TX)

    def log(self, path, theta, count=80):
        """The residuals of both fields as preCICE logs them."""
        X, TX = self.rows(theta, count)
        halves = np.split(TX - X, 2, axis=1)
        named = zip(("ResAbs(M:Force)", "ResAbs(M:Displacement)"), halves, strict=True)
        return precice(path, [{name: np.linalg.norm(half, axis=1) for name, half in named}])


# --- the formulas ----------------------------------------------------------------------------------------------------


@given(st.lists(log_uniform(-3, 3), min_size=1, max_size=6), st.floats(0.01, 1))
def test_the_roots_of_the_eigenvalues_have_the_factor_of_the_formula(values, theta):
    found = Spectrum.of([float(value) for value in values]).parallel()
    high = max(map(float, values))
    assert found.factor(theta) == pytest.approx(parallel_factor(theta, high), rel=1e-9)
    assert found.factor(float(parallel_theta(high))) <= found.factor(theta) * (1 + 1e-9)
    assert float(rho_in_parallel(theta, found.factor(theta))) == pytest.approx(high, rel=1e-6, abs=1e-6 / theta**2)


def test_both_solvers_on_old_data_have_these_eigenvalues():
    solvers = Solvers(n=4, unit=3.0)
    n = len(solvers.load)
    J = np.block([[np.zeros((n, n)), -solvers.S_c], [np.linalg.inv(solvers.S_n), np.zeros((n, n))]])
    found = Spectrum.of(solvers.values).parallel()
    theta = 0.3
    seen = np.abs(np.linalg.eigvals((1 - theta) * np.eye(2 * n) + theta * J)).max()
    assert found.factor(theta) == pytest.approx(seen)


# --- sources ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("theta", ["0.1", "0.14", "0.3", "0.6"])
def test_one_log_of_both_fields_shows_rho_whether_it_falls_or_grows(tmp_path, theta):
    solvers = Solvers()
    found = vf.advise_logs([(solvers.log(tmp_path / "a.log", float(theta), 150), theta)], tied=True, parallel=True)
    assert kinds(found) == ["mode-high"]
    assert found.best.rho.value == pytest.approx(6, rel=0.05)
    assert found.theta == pytest.approx(1 / 7, rel=0.05)
    assert {row.method for row in found.methods} == {"constant", "iqn-ils"}
    constant = next(row.steps for row in found.methods if row.method == "constant" and not row.exchanged)
    assert constant == pytest.approx(steps(parallel_factor(1 / 7, 6)) * 2 / 3, rel=0.2)  # to 1e-6


def test_a_ratio_shows_rho_and_one_that_no_parallel_coupling_has_is_told():
    found = vf.advise_run("0.5", "0.75", tied=True, parallel=True)
    assert (found.best.rho.value, found.theta) == (1.25, 0.4444)
    assert "1/(1+rho) = 0.444" in found.quote
    assert found.to_dict()["parallel"][0]["theta"] == pytest.approx(1 / 2.25)
    too_fast = vf.advise_run("0.5", "0.2", tied=True, parallel=True)
    assert too_fast.theta is None
    assert "is it serial?" in too_fast.next.why


def test_contact_whose_residual_hardly_falls_may_be_at_a_level():
    found = vf.advise_run("0.5", "0.99", parallel=True)
    assert kinds(found) == ["mode-high", "level"]
    assert found.theta is None


@pytest.mark.parametrize("unit", [1.0, 1e8])
def test_vectors_of_both_fields_show_the_eigenvalues_of_the_serial_coupling(unit):
    solvers = Solvers(n=5, unit=unit)
    found = vf.advise_vectors(*solvers.rows(0.2, 12), tied=True, parallel=True)
    assert (found.spectrum.low, found.spectrum.high) == pytest.approx((0.1, 6), rel=1e-3)
    assert found.theta == pytest.approx(1 / 7, rel=0.02)
    assert found.vectors.unknowns == 5
    with pytest.raises(ValueError, match="both fields in a row"):
        vf.advise_vectors(np.eye(3), np.eye(3), parallel=True)


@pytest.mark.parametrize("moved", [1, 0])
@pytest.mark.parametrize("unit", [1.0, 1e10])
def test_only_forces_that_are_0_show_open_nodes(unit, moved):
    """Nothing opens, whatever the unit of displacements is, and if they begin with 0."""
    solvers = Solvers(unit=unit)
    solvers.moved *= moved
    found, tied = (vf.advise_vectors(*solvers.rows(0.2, 20), kind=kind, parallel=True) for kind in ("contact", "tied"))
    assert (found.theta, found.method.name) == (tied.theta, tied.method.name)
    run = vf.couple(solvers.neumann, solvers.contact, start=np.zeros(12), kind="contact", parallel=True, theta=0.1)
    assert (run.advice.tied, run.advice.method.name) == (True, tied.method.name)
    for seen in (found.vectors, run.advice.vectors):
        assert not seen.changing
        assert not seen.loaded


@pytest.mark.parametrize("kind", ["contact", "tied"])
def test_a_rate_of_both_at_once_is_no_bound_of_steps(kind):
    found = vf.advise_matrices(1 / 7 * np.eye(1), np.eye(1), kind=kind, parallel=True)
    assert "steps to 1e-9" in found.quote
    assert "at most" not in found.quote


def test_what_leaves_the_known_directions_of_the_other_field_is_an_error():
    """Two iterates whose force has changed in one mode, and whose displacement in the other."""
    values = np.array([0.3, 4.0])
    X = np.array([[0.0, 0, 0, 0], [1.0, 0, 0, 1.0]])
    TX = np.hstack([1 - values * X[:, 2:], X[:, :2]])
    assert vf.advise_vectors(X, TX, tied=True, parallel=True).theta is None


def test_images_that_do_not_follow_from_the_other_field_are_told():
    X = np.random.default_rng(0).normal(size=(9, 12))
    found = vf.advise_vectors(
        np.tile(X, (2, 1)), np.random.default_rng(1).normal(size=(18, 12)), tied=True, parallel=True
    )
    assert found.theta is None
    assert found.roles == ()


@pytest.mark.parametrize("skew", [0.2, 1.0, 8.0])
def test_eigenvalues_that_are_complex_leave_a_parallel_theta_or_none(skew):
    """The factor is that of both solvers on old data, and where some mode grows for any theta the role is refused."""
    S_c, S_n = np.array([[1.0, skew], [-skew, 1.0]]), np.eye(2)
    joint = 1 + Spectrum.of(np.linalg.eigvals(S_c)).parallel().values
    found = vf.advise_matrices(S_c, S_n, tied=True, parallel=True)
    second = next(role for role in found.roles if role.neumann_body == 2)
    assert (second.rho is None) == (joint.real.min() <= 0)
    assert second.rho is not None or "no theta above 0 converges" in second.reason["rho"]
    for one in found.parallel:
        own = joint if one.neumann_body == 2 else 1 + Spectrum.of(1 / np.linalg.eigvals(S_c)).parallel().values
        assert one.factor == pytest.approx(np.abs(1 - one.theta * own).max())
        assert all(one.factor <= np.abs(1 - theta * own).max() + 1e-9 for theta in np.linspace(0, 1, 201))


def test_matrices_choose_the_role_with_the_smaller_rho():
    """Serial coupling compares the spread of both ends, which exchanging the roles does not change by much."""
    found = vf.advise_matrices(np.diag([0.5, 6.0]), np.eye(2), tied=True, parallel=True)
    rho = {1: 2.0, 2: 6.0}
    assert found.neumann_body == 1
    assert {one.neumann_body: one.theta for one in found.parallel} == pytest.approx(
        {n: 1 / (1 + r) for n, r in rho.items()}
    )
    assert found.theta == pytest.approx(1 / 3, abs=1e-3)


@pytest.mark.parametrize("theta", [0.5, 0.2])
def test_a_relative_residual_that_stays_at_a_level_gives_no_theta_to_paste(tmp_path, theta):
    """The limit is 2/21: a lower bound of rho is no rho."""
    solvers = Solvers(n=30, unit=1.0, high=20.0)
    X, TX = solvers.rows(theta, 80)
    both = zip(np.split(TX - X, 2, axis=1), np.split(TX, 2, axis=1), strict=True)
    fields = [np.linalg.norm(r, axis=1) / np.linalg.norm(image, axis=1) for r, image in both]
    log = precice(tmp_path / "a.log", [{f"ResRel(M:{name})": field for name, field in zip("FU", fields, strict=True)}])
    found = vf.advise_logs([(log, theta)], tied=True, parallel=True)
    assert found.theta is None
    assert found.next.theta < theta


def test_one_field_that_grows_while_the_other_one_falls_decides_nothing(tmp_path):
    """theta = 0.1, lambda = 1: the run converges by 0.9055 a step."""
    rows = {"ResAbs(M:F)": [1e-3, 0.101, 0.181], "ResAbs(M:U)": [1.0, 0.9, 0.8]}
    found = vf.advise_logs([(precice(tmp_path / "a.log", [rows]), "0.1")], tied=True, parallel=True)
    assert (found.theta, found.interval.lo, found.methods) == (None, None, ())


def test_windows_of_open_nodes_bound_nothing(tmp_path):
    """Their pace is 1 - theta, whatever rho is."""
    for theta in (0.05, 0.35):
        series = [{"ResAbs(M:F)": [round((1 - theta) ** n, 3) for n in range(5)]}] * 40
        found = vf.advise_logs([(precice(tmp_path / "a.log", series), theta)])
        assert (found.interval.lo, found.readings) == (None, ())


# --- couple ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rule", ["constant", "anderson", "iqn-ils"])
@pytest.mark.parametrize("unit", [1.0, 1e6])
def test_couple_drives_both_at_once_whatever_their_units_are(rule, unit):
    solvers = Solvers(unit=unit)
    found = vf.couple(
        solvers.neumann, solvers.contact, start=np.zeros(12), rule=rule, theta=1 / 7, kind="tied", parallel=True,
        max_iterations=400,
    )  # fmt: skip
    assert found.converged
    assert found.force == pytest.approx(solvers.solution, rel=1e-4, abs=1e-4 * np.abs(solvers.solution).max())
    assert solvers.neumann(found.force) == pytest.approx(found.displacement)
    assert found.spectrum.high == pytest.approx(6, rel=0.02)
    assert found.iterations == vf.couple(
        Solvers(unit=unit * 1024).neumann, Solvers(unit=unit * 1024).contact, start=np.zeros(12), rule=rule,
        theta=1 / 7, kind="tied", parallel=True, max_iterations=400,
    ).iterations  # fmt: skip


def test_a_field_that_does_not_move_at_first_is_measured_when_it_does():
    """A pulse in the structure: the first residual of the pressure is 0."""
    pulsed = {"neumann": lambda p: 1e-9 * (p + 1e5), "contact": lambda d: -3e9 * d, "start": np.zeros(20)}
    for rule, theta, most in (("constant", 0.05, 330), ("iqn-ils", 0.05, 8)):
        found = vf.couple(**pulsed, parallel=True, kind="tied", rule=rule, theta=theta, max_iterations=500)
        assert (found.converged, found.iterations <= most) == (True, True)
        assert found.force == pytest.approx(-3e5 / 4)


def test_numbers_beyond_all_measure_end_a_coupling_as_diverged():
    """They grow in every second step alone, so that no residual has grown three times in a row."""
    calls = []

    def contact(u):
        calls.append(1)
        return u * (1e10 if len(calls) % 2 else -1e-3)

    found = vf.couple(lambda g: g, contact, start=np.ones(3), rule="constant", theta=1, max_iterations=60)
    assert found.diverged
    assert found.iterations < 20


def test_an_absolute_tolerance_is_one_of_the_force_alone():
    """In its unit every displacement is small."""
    small = {"neumann": lambda g: 1e-7 * (g + 10), "contact": lambda u: -1e7 * u, "start": np.zeros(3)}
    found = vf.couple(**small, parallel=True, kind="tied", theta=0.4, absolute=0.1, max_iterations=200)
    assert found.converged
    assert found.force == pytest.approx(-5, abs=0.3)


def test_each_solver_gets_what_the_other_answered_before():
    given = []

    def neumann(g):
        given.append(("g", float(g[0])))
        return 2 * g + 1

    def contact(u):
        given.append(("u", float(u[0])))
        return 3 - u

    vf.couple(neumann, contact, start=[5.0], rule="constant", theta=1, parallel=True, max_iterations=3)
    assert given == [("g", 5.0), ("u", 0.0), ("g", 3.0), ("u", 11.0), ("g", -8.0), ("u", 7.0)]


def test_a_field_that_has_not_arrived_keeps_the_coupling_going():
    """The force is right from the start, in a unit in which it hides the displacement."""
    coupling = vf.Coupling(rule="constant", theta=1, parallel=True, tolerance=1e-6)
    coupling.see([1e9, 1.0], [1e9, 1.1])
    assert not coupling.arrived
    assert coupling.residual == pytest.approx(0.1 / 1.1)
    coupling.see([1e9, 1.0], [1e9, 1.0])
    assert coupling.arrived
    with pytest.raises(ValueError, match="both fields"):
        vf.Coupling(parallel=True).see([1.0], [2.0])


@pytest.mark.parametrize("rows", [3, 4, 6])
def test_parallel_positive_feedback_has_a_document_while_rho_is_only_bounded(rows):
    """All eigenvalues that are seen may be below 0: their roots are real, and no square root of rho is."""
    for seed in range(20):
        random = np.random.default_rng(seed)
        one = random.standard_normal((8, 8)) * 0.3
        T = lambda x, one=one: np.concatenate([x[8:] @ one, x[:8]]) + 1
        X = np.cumsum(random.standard_normal((rows, 16)), axis=0)
        found = vf.advise_vectors(X, [T(x) for x in X], kind="general", parallel=True)
        assert found.to_json()


@pytest.mark.parametrize("theta", [0.2, 0.22, 0.24, 0.26, 0.28])
@pytest.mark.parametrize("count", [40, 60, 90])
def test_relative_residuals_that_turn_and_still_fall_are_at_no_level(tmp_path, theta, count):
    """rho is 6: theta converges below 2/7 = 0.2857, and residuals fall by 0.99 a step at 0.28."""
    coupling = Solvers()
    X, TX = coupling.rows(theta, count)
    fields = zip(np.split(TX - X, 2, axis=1), np.split(TX, 2, axis=1), strict=True)
    relative = [np.linalg.norm(r, axis=1) / np.linalg.norm(image, axis=1) for r, image in fields]
    log = precice(tmp_path / "a.log", [dict(zip(("ResRel(M:F)", "ResRel(M:D)"), relative, strict=True))])
    found = vf.advise_logs([(log, theta)], tied=True, parallel=True)
    assert found.interval.lo is None or found.interval.lo.value <= 6.0
