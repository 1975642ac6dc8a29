"""Few steps of a run: a residual that explodes, short windows, and a rho for which no constant theta is good."""

import numpy as np
import pytest
from coupling_logs import kinds, linear_run, written
from hypothesis import given
from hypothesis import strategies as st
from strategies import log_uniform

import verification as vf


def explodes(path, *residuals):
    return written(path, "".join(f"{value:g}\n" for value in residuals))


@pytest.mark.parametrize("tied", [False, True])
def test_a_log_that_explodes_bounds_rho_by_its_last_ratio(tmp_path, tied):
    log = explodes(tmp_path / "a.txt", 1, 40, 1600, 64000)
    found = vf.advise_logs([(log, "0.5")], tied=tied)
    assert found.interval.lo.value == pytest.approx(81, rel=1e-6)
    assert found.interval.lo.value <= 81
    assert "ratios only rise" in found.interval.lo.assumes
    assert found.next.theta == pytest.approx(2 / 83, rel=1e-3)
    assert not found.next.again
    assert kinds(found) == ["mode-high"] + ["level"] * (not tied)
    assert found.theta is None
    assert {row.method for row in found.methods} == {"constant", "aitken", "iqn-ils"}
    assert {row.bound for row in found.methods} == {"at least"}
    assert found.method.name == ("iqn-ils" if tied else "aitken")


@given(st.lists(log_uniform(-2, 3), min_size=1, max_size=6), st.integers(4, 9))
def test_the_bound_by_few_steps_is_never_above_rho(tmp_path_factory, modes, count):
    """Of runs whose ratios rise, as those of symmetric couplings do."""
    modes = [float(mode) for mode in modes]
    absolute = linear_run(modes, 1.0, count)[0]
    log = explodes(tmp_path_factory.mktemp("few") / "a.txt", *absolute)
    found = vf.advise_logs([(log, "1")], tied=True)
    if found.interval.lo is not None:
        assert float(found.interval.lo.value) <= max(modes) * (1 + 1e-3) + 1e-3
        assert found.next.theta < 1


def test_two_rises_are_needed_and_numbers_beyond_all_measure_are_none(tmp_path):
    for residuals in ([1, 40], [1, 0.5, 40], [1, 40, 1600, 800], [1, 1.4, 1.96], [1, 1e50, 1e100, 1e200]):
        found = vf.advise_logs([(explodes(tmp_path / "a.txt", *residuals), "0.5")], tied=True)
        assert found.logs[0].columns[0].count("growth") == 0
        assert found.interval.lo is None


def test_two_runs_that_explode_lead_below_the_larger_bound(tmp_path):
    logs = [
        (explodes(tmp_path / "a.txt", 1, 40, 1600, 64000), "0.5"),  # 81
        (explodes(tmp_path / "b.txt", 1, 8, 80, 800), "0.1"),  # 109
    ]
    found = vf.advise_logs(logs, tied=True)
    assert found.next.theta == pytest.approx(2 / 111, rel=1e-3)


def test_forty_windows_of_four_iterations_lead_to_the_theta_for_rho(tmp_path):
    random, modes, theta = np.random.default_rng(0), np.geomspace(0.3, 6.52, 15), 0.25
    rows, solution = ["TimeWindow Iteration ResAbs(M:F)"], np.zeros(15)
    for window in range(1, 41):
        error = solution - (solution := 0.1 * random.normal(size=15))
        for iteration in range(1, 5):
            rows.append(f"{window} {iteration} {np.linalg.norm((1 + modes) * error):.8e}")
            error = (1 - theta * (1 + modes)) * error
    found = vf.advise_logs([(written(tmp_path / "a.log", "\n".join(rows) + "\n"), theta)], tied=True)
    assert (found.interval.lo, found.readings) == (None, ())
    assert found.next.theta == pytest.approx(2 / 8.52, rel=0.05)
    with_friction = vf.advise_logs([(tmp_path / "a.log", theta)], friction=True)
    assert (with_friction.interval.lo, with_friction.readings) == (None, ())


@pytest.mark.parametrize("ratio", ["1.5", "5.5"])
def test_the_methods_are_compared_as_soon_as_every_reading_has_a_large_rho(ratio):
    for theta, compared in (("0.9", False), ("0.182", False), ("0.181", True), ("0.1", True)):
        undecided = vf.advise_run(theta, ratio)
        least = min(reading.lo for reading in undecided.readings)
        assert least == pytest.approx(2 / float(theta) - 1, rel=1e-3)  # by the level, whatever the ratio
        assert (least > 10) == compared
        assert (undecided.theta, bool(undecided.methods)) == (None, compared)


# --- the sentence to quote -------------------------------------------------------------------------------------------


def test_the_quote_names_the_formula_that_gave_theta():
    tied = vf.advise_matrices(np.diag([0.5, 3.0]), np.eye(2), tied=True)
    assert "2/(2+rho_min+rho) = " in tied.quote
    contact = vf.advise_matrices(np.diag([0.5, 3.0]), np.eye(2))
    assert "2/(2+rho) = " in contact.quote
    turned = np.array([[1.0, 2.0], [-2.0, 1.0]])
    complex_ones = vf.advise_matrices(turned, np.eye(2), tied=True)
    assert "2/(2+" not in complex_ones.quote
    assert "the theta of least factor over the eigenvalues" in complex_ones.quote
    for found in (tied, contact, complex_ones):
        theta, _ = found.chosen(found.best)
        assert f" = {theta:.3g}: " in found.quote


def test_the_quote_of_logs_has_the_reason_of_their_theta(tmp_path):
    logs = []
    for n, theta in enumerate((0.2, 0.45)):
        absolute = linear_run((1.5, 2.0, 3.0), theta, 60)[0]
        logs.append((explodes(tmp_path / f"{n}.txt", *absolute), theta))
    found = vf.advise_logs(logs, tied=True)
    assert found.theta == pytest.approx(2 / 6.5, rel=0.05)
    assert f"theta = {found.theta:.4g}: " in found.quote
    assert found.next.why in found.quote
