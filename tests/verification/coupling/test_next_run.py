"""The run to make next: never one that was made; what converges is kept; short windows of a transient are pooled."""

import math
import tempfile
from fractions import Fraction as F
from pathlib import Path

import numpy as np
import pytest
from coupling_logs import MODES, linear_run, precice
from hypothesis import assume, example, given
from hypothesis import strategies as st

import verification as vf
from verification.coupling.pace import pooled
from verification.coupling.readings import Made, NextRun, anew, at_risk, kept, pasted_or_not


def level(steps):
    return [1 + 0.3 * (-1) ** n for n in range(steps)]


def falling(ratio, steps):
    return [ratio**n for n in range(steps)]


def advised(folder, runs, **options):
    """The advice from ``{theta: residuals}``, or lists of these, one for each window."""
    logs = []
    for n, (theta, series) in enumerate(runs):
        windows = series if isinstance(series[0], list) else [series]
        logs.append((precice(folder / f"{n}.log", [{"ResAbs(M:F)": window} for window in windows]), theta))
    return vf.advise_logs(logs, **options)


# --- no run twice ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("steps", [12, 40, 79, 300])
def test_a_run_that_falls_below_two_levels_is_not_asked_for_again(tmp_path, steps):
    found = advised(tmp_path, [("0.5", level(80)), ("0.25", level(80)), ("0.0625", falling(0.93, steps))])
    assert found.next.theta not in (0.5, 0.25, 0.0625)
    assert found.next.theta < 0.25


@pytest.mark.parametrize("tied", [False, True])
@pytest.mark.parametrize("second", [0.85, 0.86, 0.75, 0.6])
@pytest.mark.parametrize("first", [0.905, 0.9, 0.8])
def test_after_runs_at_0_1_and_0_15_neither_is_asked_for(tmp_path, first, second, tied):
    found = advised(tmp_path, [("0.1", falling(first, 200)), ("0.15", falling(second, 120))], tied=tied)
    assert found.next.why.startswith("keep it") or found.next.theta not in (0.1, 0.15)
    assert found.next.kept == found.next.why.startswith("keep it")


@st.composite
def runs(draw):
    """Up to four runs: of one linear coupling, or each by itself, at thetas of two figures or near each other."""
    thetas = draw(st.lists(st.integers(2, 100), min_size=2, max_size=4))
    modes = draw(st.lists(st.floats(0.01, 30), min_size=1, max_size=4))
    found = []
    for n in thetas:
        theta, kind = n / 100, draw(st.sampled_from(["linear", "level", "ratio", "short", "noise"]))
        steps = 20 + math.ceil(6 / theta)
        if kind == "linear":
            series = linear_run(modes, theta, steps)[0]
        elif kind == "level":
            series = level(steps)
        elif kind == "noise":
            series = list(np.exp(np.random.default_rng(n).normal(0, 2, steps)))
        else:
            ratio = draw(st.floats(0.05, 1.5))
            series = falling(ratio, draw(st.integers(2, 9)) if kind == "short" else steps)
        assume(series[0] > 0)
        found.append((repr(theta), [float(value) for value in series]))
    return found


@example([("0.5", [1.0, 0.9])], {})  # too short to be read
@example([(repr(theta), list(linear_run((0.5, 3.0), theta, 60)[0])) for theta in (0.2, 0.45, 0.7)], {})  # roles
@given(runs(), st.sampled_from([{}, {"tied": True}, {"friction": True}]))
def test_the_next_run_is_never_one_that_was_given(made, options):
    with tempfile.TemporaryDirectory() as folder:
        found = advised(Path(folder), made, **options)
    printed = {f"{float(theta):g}" for theta, _ in made}
    assert 0 < found.next.theta < 1 or found.next.kept or found.next.again
    if found.next.why.startswith("keep it"):
        assert f"{found.next.theta:g}" in printed
    elif len(printed) > 1:
        assert f"{found.next.theta:g}" not in printed
        assert all(abs(found.next.theta / float(theta) - 1) > 1e-3 for theta, _ in made)
    elif found.next.again:  # one theta, of which no log can be read
        assert "the same again" in found.next.why
        assert all(log.readings == () for log in found.logs)
    if found.roles:
        assert all(found.next.theta < float(log.theta) for log in found.logs if log.diverges)


def test_a_theta_is_not_pasted_at_or_above_one_that_does_not_converge():
    made = [Made(theta=F(3, 10), falls=True), Made(theta=F(4, 10), falls=False, rises=True)]
    paste = lambda theta: pasted_or_not(NextRun(theta=theta, why="best"), made)
    assert paste(0.25).theta == 0.25
    assert (paste(0.3).kept, paste(0.3).why) == (True, "keep it: best")
    assert paste(0.2999).theta == 0.3  # no run of its own
    assert [paste(theta) for theta in (0.3999, 0.4, 0.5)] == [None] * 3
    assert pasted_or_not(NextRun(theta=0.5, why=""), made[:1]).theta == 0.5
    made.append(Made(theta=F(9, 10), falls=False, rises=True))
    assert paste(0.5) is None


def test_where_a_run_was_made_the_next_one_lies_in_the_gap_above_those_that_fall():
    fell, stayed = lambda t, r=None: Made(theta=F(t), falls=True, ratio=r), lambda t: Made(theta=F(t), falls=False)
    again = lambda theta, *made: anew(NextRun(theta=theta, why=""), made)
    assert again(0.2, fell("0.1")).theta == 0.2
    assert again(0.1, fell("0.1"), stayed("0.4")).theta == 0.2
    assert again(0.4, fell("0.1"), stayed("0.4"), stayed("0.9")).theta == 0.2
    assert again(0.1, fell("0.1")).theta == 0.15
    assert again(0.8, fell("0.8")).theta == 0.9
    assert again(0.95, fell("0.95", F(1, 2))).kept  # no room up to 1
    slow = again(0.95, fell("0.95"))  # of which no log shows that it is the fastest
    assert (slow.kept, slow.theta < 0.95, "no steady ratio" in slow.why) == (False, True, True)
    longer = NextRun(theta=0.1, why="the same again", again=True)
    assert anew(longer, [stayed("0.1"), stayed("0.1")]) is longer
    assert anew(longer, [stayed("0.1"), stayed("0.2")]).theta == 0.05
    assert again(0.4, stayed("0.8"), stayed("0.4")).theta == 0.2
    best = again(0.4, fell("0.4", F(1, 2)), fell("0.3", F(1, 3)), stayed("0.42"))
    assert (best.theta, best.kept) == (0.3, True)  # the fastest, as no gap is left
    assert again(0.4, fell("0.4"), fell("0.3", F(1, 3)), stayed("0.42")).theta == 0.3
    assert again(0.3, kept_run := fell("0.3")) != anew(kept(F(3, 10), "best"), [kept_run])
    assert again(0.4, fell("0.4"), stayed("0.46")).theta == pytest.approx(math.sqrt(0.4 * 0.46), rel=1e-3)


# --- a run that may diverge says so ----------------------------------------------------------------------------------


@pytest.mark.parametrize("slow", [-0.9, -0.9999, -1.001])
@pytest.mark.parametrize("share", [1.0, 1e-9])
@pytest.mark.parametrize("steps", [6, 24, 80])
@pytest.mark.parametrize("options", [{}, {"tied": True}, {"friction": True}, {"kind": "general"}], ids=str)
def test_a_run_that_is_asked_for_falls_or_is_said_to_diverge_perhaps(tmp_path, slow, share, steps, options):
    """Modes of factors 0.6 to 0.1 beside a share of one close to -1, in one log and in two."""
    for theta, earlier in ((0.05, None), (0.3, None), (0.3, 0.1), (0.3, 0.29)):
        z = np.array([0.4, 0.7, 0.9, 1 - slow]) / theta
        series = {
            at: np.linalg.norm((1 - at * z[:, None]) ** np.arange(steps) * [[1], [1], [1], [share]], axis=0)
            for at in (earlier, theta)
            if at
        }
        found = advised(tmp_path, [(repr(at), [float(r) for r in each]) for at, each in series.items()], **options)
        if found.theta is None and np.abs(1 - found.next.theta * z).max() > 1 + 1e-9:
            again = any(found.next.theta == at for at in series)
            assert again or "may diverge" in found.next.why


def test_the_warning_names_what_falls_and_leaves_out_smaller_thetas():
    falls, rises = Made(theta=F(3, 10), falls=True), Made(theta=F(4, 10), falls=False, rises=True)
    why = lambda theta, *made, **more: at_risk(NextRun(theta=theta, why="so", **more), made).why
    assert (
        why(0.35, falls, rises)
        == "so; it may diverge there; 0.3 falls in its log, and near that solution a smaller theta does too"
    )
    assert why(0.3, falls, rises) == why(0.2, falls) == "so"
    assert why(0.2, rises) == "so; it may diverge there"
    assert why(0.4, rises, again=True) == why(0.4, rises, kept=True) == "so"


# --- what converges is kept ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("option", [{}, {"tied": True}, {"friction": True}], ids=str)
@pytest.mark.parametrize("series", [[1, 0], [1, 1e-17], [1, 1e-8], [1, 1e-4], [1, 0.05, 0], [1, 0.1, 0.01]], ids=str)
def test_a_run_that_converges_in_two_iterations_is_kept(tmp_path, series, option):
    found = advised(tmp_path, [("0.3", [float(value) for value in series])], **option)
    assert found.next.why.startswith("keep it")
    assert (found.next.theta, found.next.kept) == (0.3, True)


def test_a_coupling_of_one_mode_at_its_best_theta_is_kept(tmp_path):
    """theta = 1/(1 + lambda) leaves a residual of exactly zero, which is no missing number."""
    found = advised(tmp_path, [("0.25", linear_run([3.0], 0.25, 4)[0])])
    assert found.next.why.startswith("keep it")
    assert advised(tmp_path, [("0.25", [1.0, 0.9])]).next.again  # two iterations that do not converge


def test_a_zero_that_is_written_with_two_decimals_is_no_convergence(tmp_path):
    path = tmp_path / "a.log"
    path.write_text("it res\n1 1.00\n2 0.60\n3 0.00\n", "utf-8")
    assert not vf.advise_logs([(path, "0.3")]).next.kept


# --- short windows ---------------------------------------------------------------------------------------------------


def transient(modes, theta, windows, steps, seed=0):
    """Residuals of a tied transient: loads that drift, each window from the solution of the one before."""
    rng, modes, x, found = np.random.default_rng(seed), np.array(modes), np.zeros(len(modes)), []
    for _ in range(windows):
        load, series = rng.normal(size=len(modes)), []
        for _ in range(steps):
            image = load - modes * x
            series.append(float(np.linalg.norm(image - x)))
            x = x + theta * (image - x)
        found.append(series)
    return found


@pytest.mark.parametrize("theta", [0.1, 0.2, 0.3, 0.45])
def test_short_windows_are_pooled_into_a_pace_that_names_the_next_run_and_bounds_nothing(tmp_path, theta):
    found = advised(tmp_path, [(repr(theta), transient(MODES, theta, 40, 8))])
    (column,) = found.logs[0].columns
    assert column.count("short") == 40
    assert column.ratio is None
    q = max(abs(1 - theta * (1 + mode)) for mode in MODES)
    assert 0.85 * q <= float(column.pooled.value) <= q * 1.001
    assert column.pooled.least <= column.pooled.value <= column.pooled.most
    assert "pooled" in column.says
    assert column.to_dict()["pooled"]["value"] == float(column.pooled.value)
    assert (found.roles, found.interval.lo, found.interval.hi, found.readings) == ((), None, None, ())
    if theta > 0.4:
        assert found.next.theta == pytest.approx(2 / (2 + max(MODES)), rel=0.1)
    assert "no ratio one by one" in found.next.why
    assert found.next.theta != theta


def test_few_windows_are_not_pooled_nor_those_of_high_relative_residuals(tmp_path):
    assert advised(tmp_path, [("0.3", transient((0.2, 3.0), 0.3, 4, 8))]).next.again
    few_steps = advised(tmp_path, [("0.02", transient((0.2, 3.0), 0.02, 5, 8))])
    assert few_steps.next.again  # 15 steps of 250
    assert advised(tmp_path, [("0.3", transient((0.2, 3.0), 0.3, 4, 16))]).next.again  # 28 steps of 17 in 4 windows
    settles = [[1.0, 0.1, 0.01, *(0.01 * share**n for n in range(1, 4))] for share in np.linspace(0.6, 0.8, 11)]
    (column,) = advised(tmp_path, [("0.3", settles)]).logs[0].columns
    ends = [float(getattr(column.pooled, name)) for name in ("least", "value", "most")]
    assert ends == pytest.approx([0.62, 0.7, 0.78], rel=1e-3)  # of the second half, without the outer tenths
    windows = [{"ResRel(M:F)": falling(0.9, 8)} for _ in range(40)]
    assert vf.advise_logs([(precice(tmp_path / "r.log", windows), "0.3")]).next.again
    low = [{"ResRel(M:F)": [0.05 * value for value in falling(0.9, 8)]} for _ in range(40)]
    assert vf.advise_logs([(precice(tmp_path / "l.log", low), "0.3")]).logs[0].columns[0].pooled is not None


def test_windows_that_converge_at_once_are_kept(tmp_path):
    found = advised(tmp_path, [("0.3", [falling(0.05, 4) for _ in range(30)])])
    assert found.next.why.startswith("keep it")


# --- theta = 1, and runs that grow fast ------------------------------------------------------------------------------


@pytest.mark.parametrize("theta", ["0.02", "0.1", "0.3", "1"])
@pytest.mark.parametrize("tied", [False, True])
def test_a_run_that_grows_a_millionfold_is_read_however_few_steps_it_has(tmp_path, theta, tied):
    """33 steps at theta = 0.02 are fewer than the 250 over which a level must be steady; 67**33 is no level."""
    found = advised(tmp_path, [(theta, falling(67.0, 33))], tied=tied)
    exactly = 68 / F(theta) - 1
    assert found.interval.lo.value == pytest.approx(float(exactly), rel=1e-6)
    assert F(found.interval.lo.to_dict()["value"]) <= exactly
    assert found.logs[0].diverges
    assert found.next.theta < float(theta)
    assert found.next.theta * (1 + float(exactly)) < 2  # below the limit of the stiffest mode
    short = advised(tmp_path, [("0.02", falling(1.3, 33))])  # 6000-fold: may be the way to a level
    assert short.logs[0].readings == ()


def test_no_run_is_asked_for_at_a_theta_that_a_log_may_not_have(tmp_path):
    assert advised(tmp_path, [("0.01", [1.0, 1e8, 1e16])]).next.theta == 1e-6


def test_after_a_level_of_parallel_coupling_a_quarter_comes_next(tmp_path):
    found = advised(tmp_path, [("0.5", level(80))], parallel=True)
    assert (found.next.theta, [one.kind for one in found.readings]) == (0.125, ["level"])


@given(runs(), st.sampled_from([{}, {"tied": True}, {"friction": True}]))
def test_theta_1_is_named_as_the_first_run_only_where_no_run_like_it_was_made_and_none_diverges(made, options):
    with tempfile.TemporaryDirectory() as folder:
        found = advised(Path(folder), made, **options)
    named = found.next.why.count("Or begin with 16 rows of absolute residuals with theta = 1")
    high, rises = any(float(theta) >= 0.9 for theta, _ in made), any(log.diverges for log in found.logs)
    decided = bool(found.roles) or found.next.kept
    assert named == (not (high or rises or decided or options.get("friction", False)))


@pytest.mark.parametrize("steps", [2, 3, 8, 9])
def test_a_pooled_ratio_is_the_mean_over_the_second_half_of_each_window(steps):
    """The first half falls twice as fast."""
    half, ratios = steps // 2, np.array([0.5, 0.6, 0.7, 0.8, 0.9])
    windows = [np.cumprod([1.0, *[ratio / 2] * (steps - half), *[ratio] * half]) for ratio in ratios]
    found = pooled(windows, relative=False, steps=5 * half)
    assert float(found.value) == pytest.approx(0.7, rel=1e-12)
    ends = np.exp(np.quantile(np.log(ratios), [0.1, 0.9]))
    assert [float(found.least), float(found.most)] == pytest.approx(ends, rel=1e-12)
    assert pooled(windows, relative=False, steps=5 * half + 1) is None
