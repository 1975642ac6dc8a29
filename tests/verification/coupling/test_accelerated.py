"""Logs of Aitken and quasi-Newton runs, and of codes that print a line for each residual."""

import re
from pathlib import Path

import numpy as np
import pytest
from coupling_logs import MODES, linear_run, written
from hypothesis import given
from hypothesis import strategies as st

from ndtheory import HypothesisError
from verification.coupling.accelerated import seen_accelerated
from verification.coupling.from_logs import advise_logs
from verification.coupling.log_files import read_log
from verification.coupling.log_lines import Form, PatternError, form_of_pattern
from verification.problem.tables import ProblemError
from verification.registry import LOG_FORMATS

KRATOS = Path(__file__).parents[1] / "kratos_logs"


def aitken(modes, first=0.5, steps=12):
    """Residuals of a linear run, and the factor of Aitken after each: <r, z r>/|z r|^2 for z = 1 + H."""
    z = 1 + np.array(modes, float)
    residual, factor, residuals, factors = z.copy(), first, [], []
    for _ in range(steps):
        residuals.append(float(np.linalg.norm(residual)))
        factors.append(factor)
        factor_after = float(z @ residual**2 / (z**2 @ residual**2)) if residual.any() else first
        residual, factor = residual - factor * z * residual, factor_after
    return residuals, factors


def solids4foam(path, windows, words="Aitken"):
    """What solids4foam prints: the factor before an iteration, the first two of them given, and the residual after."""
    lines = []
    for time, (residuals, factors) in enumerate(windows, 1):
        before = [factors[0], *factors]
        for k, (residual, factor) in enumerate(zip(residuals, before, strict=False), 1):
            label = f" ({'fixed' if k < 3 else words})" if words else ""
            lines += [f"Time = {time}, iteration: {k}", f"Current fsi under-relaxation factor{label}: {factor:.6g}"]
            lines += ["Evolving fluid model: icoFluid", "    2, 5.2e-07, 7.1e-07, 0, 2"]
            lines.append(f"Current fsi relative residual norm: {residual / max(residuals[:k]):.6g}")
    return written(path, "\n".join(lines) + "\n")


def feel(path, residuals, factors):
    lines = [
        f"[Aitken] iteration : {n} theta={f:.6g} residualNorm : {r:.6g}"
        for n, (r, f) in enumerate(zip(residuals, factors, strict=True), 1)
    ]
    return written(path, "\n".join(lines) + "\n")


def moose(path, windows, name="Picard"):
    """What MOOSE prints: after each iteration all of the time step, with colours."""
    lines = []
    for residuals in windows:
        for last in range(1, len(residuals)):
            lines.append(f"\n 0 {name} |R| = \x1b[33m{residuals[0]:.6e}\x1b[39m")
            lines += [f"{n:2d} {name} |R| = \x1b[32m{residuals[n]:.6e}\x1b[39m" for n in range(1, last + 1)]
    return written(path, "\n".join(lines) + "\n")


def norma(path, residuals, relaxation="fixed, θ = 4.5000e-01"):
    lines = [f"[SCHWARZ] Relaxation: {relaxation}"]
    for n, r in enumerate(residuals, 1):
        status = "\x1b[33m[CONVERGING]\x1b[39m"
        lines += [
            f"[SCHWARZ] Iteration [{n}]",
            f"[SCHWARZ] Criterion [{n}] |ΔU| = {r:.3e} : |ΔU|/|U| = {r / 7:.3e} : {status}",
        ]
    return written(path, "\n".join(lines) + "\n")


# --- Aitken -----------------------------------------------------------------------------------------------------------


@given(st.lists(st.floats(0.01, 100), min_size=2, max_size=12, unique=True), st.floats(0.02, 1))
def test_one_over_a_factor_of_aitken_lies_between_the_ends_of_the_spectrum(modes, first):
    residuals, factors = aitken(modes, first, 15)
    for before, factor in zip(residuals, factors[1:], strict=False):
        if before > 1e-6 * max(residuals):
            assert 1 + min(modes) <= 1 / factor * (1 + 1e-6)
            assert 1 / factor <= (1 + max(modes)) * (1 + 1e-6)


def test_an_aitken_log_shows_both_ends_and_a_theta_for_a_tied_interface(tmp_path):
    log = solids4foam(tmp_path / "log", [aitken(MODES, 0.5, 14)])
    found = advise_logs([(log, None)], tied=True)
    seen = found.accelerated[0]
    assert (seen.accelerator, seen.form, seen.windows, seen.iterations) == ("Aitken", "solids4foam", 1, 14)
    assert seen.factors.low == pytest.approx(0.2, abs=0.1)
    assert seen.factors.high == pytest.approx(3, rel=0.05)
    assert found.theta == pytest.approx(2 / (2 + 0.2 + 3), rel=0.06)
    assert found.theta * 4 < 2  # contracts
    assert "an estimate" in found.next.why
    assert found.roles[0].theta_proved is None
    contact = advise_logs([(log, None)])
    assert (contact.theta, contact.next.theta) == (None, found.theta)
    assert advise_logs([(log, None)], friction=True).theta is None


def test_ends_are_those_of_all_windows_together(tmp_path):
    one, other = aitken((0.2, 1.0), 0.5, 6), aitken((1.0, 3.0), 0.5, 6)
    seen = seen_accelerated(read_log(solids4foam(tmp_path / "log", [one, other])))
    assert (seen.windows, seen.factors.given) == (2, 10)
    alone = [seen_accelerated(read_log(solids4foam(tmp_path / f"{n}", [run]))) for n, run in enumerate((one, other))]
    assert seen.factors.low == min(log.factors.low for log in alone)
    assert seen.factors.high == max(log.factors.high for log in alone)


def test_factors_below_the_noise_of_the_solvers_are_dropped(tmp_path):
    residuals, factors = aitken(MODES, 0.5, 14)
    clean = seen_accelerated(read_log(feel(tmp_path / "a", residuals, factors))).factors
    level = [1e-9 * residuals[0]] * 6
    noise = seen_accelerated(read_log(feel(tmp_path / "b", residuals + level, [*factors, 7.0, 1e-3, -4, 0.3, 90, 2])))
    assert (noise.factors.low, noise.factors.high) == (clean.low, clean.high)
    assert noise.factors.given == clean.given + 6


@pytest.mark.parametrize(
    ("factors", "words"), [([0.5, 0.4, -0.2, 0.4, 0.4, 0.4], "below 0"), ([0.5, 0.4, 1.3, 0.4, 0.4, 0.4], "above 1")]
)
def test_factors_that_no_linear_symmetric_coupling_has_decide_nothing(tmp_path, factors, words):
    found = advise_logs(
        [(feel(tmp_path / "a", [1, 0.5123456, 0.2123456, 0.1123456, 0.0512345, 0.0212345], factors), None)], tied=True
    )
    assert words in found.accelerated[0].factors.doubt
    assert (found.theta, found.next.theta) == (None, 1.0)


def test_aitken_in_columns_is_read_whoever_wrote_them(tmp_path):
    residuals, factors = aitken(MODES, 0.3, 10)
    rows = [f"{n},{r:.10g},{f:.10g}" for n, (r, f) in enumerate(zip(residuals, factors, strict=True), 1)]
    log = written(tmp_path / "a.csv", "it,res,omega\n" + "\n".join(rows) + "\n")
    found = seen_accelerated(read_log(log))
    same = seen_accelerated(read_log(feel(tmp_path / "b", residuals, factors)))
    assert found.factors.high == pytest.approx(same.factors.high, rel=1e-4)
    assert not found.factors.doubt


def test_the_aitken_log_of_kratos_shows_the_spectrum_of_its_two_plates():
    found = advise_logs([(KRATOS / "aitken.log", None)], tied=True)
    seen = found.accelerated[0]
    assert seen.accelerator == "AitkenConvergenceAccelerator"
    assert "needed a residual that falls" in seen.factors.doubt  # it was cut off after five factors
    constant = advise_logs([(KRATOS / "constant.log", "0.1")], tied=True)
    assert seen.factors.high <= float(constant.interval.hi.value)
    assert found.theta is None


# --- quasi-Newton -----------------------------------------------------------------------------------------------------

COUNTS = "TimeWindow TotalIterations Iterations Convergence QNColumns DeletedQNColumns DroppedQNColumns\n"


def test_a_quasi_newton_log_is_recognised_and_the_run_to_make_is_named(tmp_path):
    counts = tmp_path / "precice-Solid-iterations.log"
    written(counts, COUNTS + "1 6 6 1 0 0 0\n")
    with pytest.raises(ProblemError, match=r"convergence\.log"):
        advise_logs([(counts, "0.5")])
    written(counts, COUNTS + "1 6 6 1 5 0 0\n2 10 4 1 8 0 0\n3 14 4 1 9 0 0\n")
    found = advise_logs([(counts, None)])
    assert (found.accelerated[0].iterations, found.accelerated[0].windows) == (4, 3)
    assert "9 columns" in found.accelerated[0].accelerator
    assert (found.theta, found.next.theta, found.readings) == (None, 1.0, ())
    assert "advise vectors" in found.next.why
    log = written(tmp_path / "precice-Solid-convergence.log", "TimeWindow Iteration ResRel(Force)\n1 1 1.0\n1 2 0.1\n")
    assert advise_logs([(log, None)]).accelerated[0].accelerator == found.accelerated[0].accelerator


def test_iqn_ils_of_kratos_and_of_solids4foam_is_recognised(tmp_path):
    assert advise_logs([(KRATOS / "iqn-ils.log", None)]).accelerated[0].accelerator == "IQNILSConvergenceAccelerator"
    text = solids4foam(tmp_path / "log", [linear_pair()], "").read_text("utf-8")
    head, *rest = re.split(r"(?=Time = 1, iteration: 3)", text, maxsplit=1)
    silent = re.sub(r"Current fsi under-relaxation factor.*\n", "", rest[0])
    (tmp_path / "log").write_text(head + silent, "utf-8")
    assert advise_logs([(tmp_path / "log", None)]).accelerated[0].accelerator == "quasi-Newton"


def test_logs_with_constant_theta_decide_before_aitken_does(tmp_path):
    absolute, _ = linear_run(MODES, 0.45, 60)
    constant = norma(tmp_path / "n.log", absolute)
    other = solids4foam(tmp_path / "log", [aitken((0.2, 0.7), 0.5, 8)])
    both = advise_logs([(constant, None), (other, None)])
    assert both.readings[0].value == pytest.approx(3, rel=2e-2)
    assert (both.theta, both.spectrum) == (None, None)
    assert (len(both.logs), len(both.accelerated)) == (1, 1)


# --- forms ------------------------------------------------------------------------------------------------------------


def linear_pair(theta=0.45, steps=50):
    absolute, _ = linear_run(MODES, theta, steps)
    return absolute, [theta] * steps


def test_a_constant_run_has_one_reading_whichever_code_wrote_it(tmp_path):
    absolute, factors = linear_pair()
    plain = written(tmp_path / "plain.txt", "".join(f"step {n}: err={r:.6e};\n" for n, r in enumerate(absolute)))
    logs = {
        "solids4foam": (solids4foam(tmp_path / "s", [(absolute, factors)], ""), None, None),
        "Norma.jl": (norma(tmp_path / "n", absolute), None, None),
        "MOOSE": (moose(tmp_path / "m", [absolute[:30]]), "0.45", None),
        "pattern": (plain, "0.45", r"err=([^;]+)"),
    }
    for form, (path, theta, pattern) in logs.items():
        found = advise_logs([(path, theta)], pattern=pattern)
        assert found.logs[0].form == form
        assert found.readings[0].value == pytest.approx(3, rel=2e-2), form
        assert [column.windows for column in found.logs[0].columns] == [1]


def test_feel_names_its_fixed_theta_and_has_no_plateau(tmp_path):
    assert read_log(feel(tmp_path / "f", *linear_pair(0.7, 60))).theta == 0.7
    flat = feel(tmp_path / "g", [1.3] * 40, [0.9] * 40)
    assert all(column.plateau is None for column in advise_logs([(flat, None)]).logs[0].columns)


def test_moose_prints_a_window_again_and_again_and_it_counts_once(tmp_path):
    absolute, _ = linear_pair()
    log = read_log(moose(tmp_path / "m", [absolute[:8], absolute[:5]]))
    assert [len(window) for window in log.columns[0].windows] == [8, 5]
    assert log.columns[0].windows[0] == pytest.approx(absolute[:8], rel=1e-6)
    assert read_log(moose(tmp_path / "m", [absolute[:8]], "Steffensen")).accelerator == "Steffensen"


@pytest.mark.parametrize("words", ["Aitken recursive, θ₀ = 4.5000e-01, N0 = 2", "Anderson, θ₀ = 1.0"])
def test_norma_names_a_rule_that_is_not_constant(tmp_path, words):
    log = read_log(norma(tmp_path / "n", linear_pair()[0], words))
    assert log.accelerator == words.partition(",")[0]


def test_a_pattern_with_names_splits_windows_and_reads_factors(tmp_path):
    residuals, factors = aitken(MODES, 0.5, 9)
    rows = [f"it {n} r {r:.8e} w {f:.8f}" for n, (r, f) in enumerate(zip(residuals, factors, strict=True), 1)]
    log = written(tmp_path / "a.txt", "\n".join(rows * 2) + "\n")
    pattern = r"it (?P<iteration>\d+) r (?P<residual>\S+) w (?P<omega>\S+)"
    found = read_log(log, pattern)
    assert [len(window) for window in found.columns[0].windows] == [9, 9]
    assert found.accelerator == "Aitken"
    assert found.factors[1] == pytest.approx(factors, abs=1e-8)
    theta = rows[0].replace("w 0.50000000", "w 0.45")
    written(log, theta + "\n" + theta.replace("it 1", "it 2") + "\n")
    assert read_log(log, pattern.replace("omega", "theta")).theta == 0.45


@pytest.mark.parametrize(
    ("pattern", "words"),
    [
        ("(", "regular expression"),
        ("res", "one group"),
        (r"(\d+) (\d+)", "one group"),
        (r"(?P<res>\d+)", "group res"),
        (r"(?P<iteration>\d+)", "one group"),
        (r"(?P<residual>\d+) (\d+)", "one group"),
    ],
)
def test_a_pattern_that_is_none_is_refused(pattern, words):
    with pytest.raises(PatternError, match=words):
        form_of_pattern(pattern)


def test_a_form_of_logs_that_is_registered_is_read(tmp_path, monkeypatch):
    form = Form(name="mine", signs=("step:",), line=re.compile(r"step: (?P<residual>\S+)"))
    monkeypatch.setitem(LOG_FORMATS, "mine", form)
    log = written(tmp_path / "mine.log", "".join(f"step: {0.5**n:.8e}\n" for n in range(20)))
    assert read_log(log).form == "mine"
    assert set(LOG_FORMATS.ours) == set(LOG_FORMATS) - {"mine"}


def test_a_pattern_that_finds_nothing_or_no_number_is_refused_and_a_log_without_a_theta_needs_one(tmp_path):
    log = written(tmp_path / "a.txt", "res = 1.0\nres = x\n")
    with pytest.raises(ProblemError, match="found in no line"):
        read_log(log, r"error (\d+)")
    with pytest.raises(ProblemError, match=r"line 2: received 'x', needed a number"):
        read_log(log, r"res = (\S+)")
    log = moose(tmp_path / "m", [linear_pair()[0][:20]])
    with pytest.raises(HypothesisError, match="theta"):
        advise_logs([(log, None)])
