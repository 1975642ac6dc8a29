"""The safeguards of the advice from logs, each by a case that fails without it."""

import dataclasses
import math
import re
from fractions import Fraction as F
from pathlib import Path

import numpy as np
import pytest
from coupling_logs import kinds, linear_run, precice

import verification as vf
from ndtheory import HypothesisError
from verification.coupling import from_logs
from verification.coupling.ends import SWIFT, Box
from verification.coupling.kinds import CONTACT, TIED, kind_of
from verification.coupling.log_files import Column, Log
from verification.coupling.pace import Pace
from verification.coupling.readings import NextRun, Observed, read_observed, read_plateau
from verification.coupling.seen import LogBound, RhoInterval, SeenColumn, SeenLog, seen_column
from verification.problem.tables import ProblemError


def observed(value, least=None, most=None):
    return Observed(value=F(value), least=F(least or value), most=F(most or value))


def steady(ratio, steps, height):
    return Pace(kind="steady", value=ratio, least=ratio, most=ratio, steps=steps, length=steps, height=height)


def log(theta, ratio=None, *, kinds=("steady",), plateau=None, residual="absolute", file="a.log", paces=None, **more):
    """A log as it was seen, with the readings of its ratio."""
    ratio = ratio if ratio is None or isinstance(ratio, Observed) else observed(ratio)
    plateau = None if plateau is None else observed(*np.atleast_1d(plateau).tolist())
    paces = paces or tuple(Pace(kind=kind, steps=60, height=0.5) for kind in kinds)
    column = SeenColumn(name="r", residual=residual, paces=paces, windows=1, ratio=ratio, plateau=plateau)
    readings, following, rho = ((), NextRun(theta=float(theta), why="again"), None)
    if ratio is not None:
        readings, following, rho = read_observed(F(theta), ratio)
    given = {"readings": readings, "next": following, "rho": rho} | more
    return SeenLog(file=file, form="columns", theta=F(theta), columns=(column,), notes=(), **given)


def bound(value, file="a.log", theta="0.5"):
    return LogBound(value=F(value), log=log(theta, file=file), says="", assumes="")


def together(*logs, tied=False, interval=None):
    found = interval or from_logs.interval_of(*from_logs.bounds(logs))
    return from_logs.decide(logs, found, kind_of(tied=tied))


def logged(folder, windows, theta, name="ResAbs(M:F)"):
    windows = windows if isinstance(windows[0], list) else [windows]
    return precice(folder / "run.log", [{name: window} for window in windows]), theta


# --- what is let in --------------------------------------------------------------------------------------------------


def test_a_theta_below_one_millionth_or_above_1_is_refused(tmp_path):
    series = [0.9**n for n in range(60)]
    for theta in ("1e-7", "1.0001", "0", "9.99e-7"):
        with pytest.raises(HypothesisError, match="theta"):
            vf.advise_logs([logged(tmp_path, series, theta)])
    for theta in ("1e-6", "1"):
        assert vf.advise_logs([logged(tmp_path, series, theta)]).next is not None


def test_a_log_that_names_another_theta_is_refused_and_rounding_is_not():
    column = Column(name="r", residual="absolute", windows=(0.8 ** np.arange(60.0),), digits=0.0, decimals=0.0)
    named = lambda theta: Log(path=Path("a.log"), form="columns", columns=(column,), theta=theta)
    assert from_logs.seen_log(named(0.4504), F("0.45")).rho is not None
    assert from_logs.seen_log(named(0.4496), F("0.45")).rho is not None
    for theta in (0.451, 0.449):
        with pytest.raises(ProblemError, match="names a relaxation factor"):
            from_logs.seen_log(named(theta), F("0.45"))


def test_growth_and_plateau_are_those_of_one_mode_within_three_percent():
    """theta = 0.5 and 1 + rho = 11: a ratio of 4.5 and a plateau of 1.1."""
    theta, ratio = F(1, 2), observed("4.5")
    same = lambda P, r=ratio: from_logs.one_mode(theta, r, observed(P))
    plateau = lambda rho: 1 + 1 / F(rho)
    assert same(plateau(10))
    assert same(plateau(F(11) * F(102, 100) - 1))
    assert same(plateau(F(11) / F(102, 100) - 1))
    assert not same(plateau(F(11) * F(104, 100) - 1))
    assert not same(plateau(F(11) / F(104, 100) - 1))
    wide = observed("4.5", "4.2", "4.8")  # 1 + rho from 10.4 to 11.6
    assert same(plateau(F("11.5") - 1), wide)
    assert same(plateau(F("10.5") - 1), wide)
    loose = lambda least, most: from_logs.one_mode(theta, ratio, observed(least, least, most))
    assert loose(plateau(12), plateau(8))
    assert not loose(plateau(20), plateau(12))


def test_a_plateau_beside_growth_of_another_mode_is_no_reading(tmp_path):
    both = {"ResAbs(M:F)": [4.5**n for n in range(40)], "ResRel(M:F)": [1.1] * 40}
    shown = lambda: kinds(vf.advise_logs([(precice(tmp_path / "a.log", [both]), "0.5")]))
    assert shown() == ["mode-high", "plateau", "level"]
    both["ResRel(M:F)"] = [1.05] * 40
    assert shown() == ["mode-high", "level"]


@pytest.mark.parametrize("residual", ["absolute", "relative"])
def test_a_level_of_a_relative_residual_alone_is_no_mode(residual):
    values = np.array([1 + 0.3 * (-1) ** n for n in range(80)]) * (1 if residual == "absolute" else 2)
    column = Column(name="r", residual=residual, windows=(values,), digits=0.0, decimals=0.0)
    seen = from_logs.seen_log(Log(path=Path("a.log"), form="columns", columns=(column,)), F(1, 2))
    assert kinds(seen) == (["mode-high", "level"] if residual == "absolute" else ["level"])
    absolute = Column(name="s", residual="absolute", windows=(values,), digits=0.0, decimals=0.0)
    seen = from_logs.seen_log(Log(path=Path("a.log"), form="columns", columns=(column, absolute)), F(1, 2))
    assert kinds(seen) == ["mode-high", "level"]


def test_a_log_that_ends_at_a_low_level_decides_no_rho(tmp_path):
    series = [max(0.8**n, 1e-4) for n in range(90)]
    found = vf.advise_logs([logged(tmp_path, series, "0.45")])
    assert found.roles == ()
    assert kinds(found) == ["mode-high", "level"]
    assert found.readings[-1].lo is None
    assert found.interval.lo.value == pytest.approx(3)
    long = vf.advise_logs([logged(tmp_path, [max(0.8**n, 1e-4) for n in range(200)], "0.45")])
    assert (long.readings, long.interval.lo, long.interval.hi) == ((), None, None)  # 1 is no ratio of the run


def test_windows_that_grow_count_alone_and_short_ones_do_not_count_beside_long_ones():
    grows, falls = 1.3 ** np.arange(40.0), 0.8 ** np.arange(40.0)
    column = lambda *windows: Column(name="r", residual="absolute", windows=windows, digits=0.0, decimals=0.0)
    seen = seen_column(column(falls, grows, falls), F("0.45"))
    assert float(seen.ratio.value) == pytest.approx(1.3)
    assert seen.ratio.least > 1
    assert seen_column(column(falls, falls[:9]), F("0.45")).count("short") == 0
    assert seen_column(column(falls[:11], falls[:10]), F("0.45")).count("short") == 1
    assert seen_column(column(falls[:9], falls[:9]), F("0.45")).count("short") == 2
    many = seen_column(column(*[grows] * 5, *[falls] * 300), F("0.45"))
    assert len(many.paces) == 300
    assert float(many.ratio.value) == pytest.approx(0.8)  # the last ones
    assert many.pooled is None  # as they are read one by one


def test_of_a_log_that_shows_no_ratio_the_next_run_follows_its_end():
    column = lambda *paces: (
        SeenColumn(name="r", residual="absolute", paces=paces, windows=1, ratio=None, plateau=None),
    )
    longer = lambda *paces: from_logs.longer(column(*paces), F(3, 10))
    arrived = Pace(kind="unsteady", steps=20, height=1e-7)
    short = Pace(kind="short", steps=5, height=0.5)
    assert longer(arrived, Pace(kind="unsteady", steps=30, length=30, height=1e-8)).why.startswith(
        "keep it: the run converges within 30"
    )
    assert not longer(arrived, short).kept
    swift = Pace(kind="short", steps=1, length=2, height=1e-12)
    assert longer(swift).why.startswith("keep it: the run converges within 2 iterations,")
    assert not longer(Pace(kind="unsteady", steps=20, height=1e-6)).kept
    assert longer(Pace(kind="short", steps=5, height=0.5, lost=True), short).theta == 0.075
    assert "smaller limits" in longer(short, short).why
    assert "smaller limits" not in longer(short, Pace(kind="unsteady", steps=20, height=0.5)).why
    assert longer(short).again
    assert "17 steps or more" in longer(short).why


def test_a_swift_pace_of_short_windows_is_kept_and_a_slower_one_is_not():
    of = lambda *numbers: from_logs.of_pooled(F(3, 10), observed(*numbers))
    assert of("0.1").kept
    assert not of("0.1", "0.05", "0.13").kept  # the slowest tenth
    assert of(SWIFT).kept
    assert of("0.8").theta < 0.3 < of("0.2").theta


# --- several logs ----------------------------------------------------------------------------------------------------


def test_the_largest_bound_from_below_and_the_smallest_from_above_count():
    found = from_logs.interval_of([bound(1), bound(4), bound(2)], [bound(9), bound(5), bound(7)])
    assert (found.lo.value, found.hi.value, found.contradiction) == (4, 5, None)
    assert from_logs.interval_of([bound(4)], []).contradiction is None
    assert from_logs.interval_of([], [bound(4)]).contradiction is None


def test_bounds_contradict_each_other_beyond_three_percent_of_1_plus_rho():
    contradiction = lambda lo, hi: (
        from_logs.interval_of([bound(lo, "l.log")], [bound(hi, "h.log", "0.3")]).contradiction
    )
    assert contradiction(F("9.29"), 9) is None
    assert contradiction(F("9.3"), 9) is None
    found = contradiction(F("9.31"), 9)
    assert "h.log with theta = 0.3 rho is at most 9" in found
    assert "l.log with theta = 0.5 at least 9.31" in found
    assert "friction" in found


def test_the_log_that_decides_most_is_the_largest_that_falls_or_the_smallest_that_does_not():
    low, high = log("0.1", "0.9", file="low"), log("0.3", "0.7", file="high")
    rises, more = log("0.5", "1.5", file="rises"), log("0.7", "2.2", file="more")
    apart = RhoInterval(lo=None, hi=None, contradiction="so that nothing else decides")
    for logs in ((low, high, rises), (rises, high, low)):
        assert together(*logs, interval=apart)[0] == high.readings
    for logs in ((rises, more), (more, rises)):
        assert together(*logs)[0] == rises.readings
    unread = log("0.05")
    assert together(unread, replaced := log("0.4", readings=rises.readings))[0] == replaced.readings
    assert together(unread)[0] == ()


def test_contradictory_logs_ask_for_half_of_the_smallest_theta():
    logs = (log("0.3", "0.7"), log("0.2", "0.9"))
    found = together(*logs, interval=RhoInterval(lo=None, hi=None, contradiction="they do"))
    assert (found[1].theta, found[2]) == (0.1, None)
    assert found[0] == logs[0].readings


def test_a_swift_log_is_kept_unless_the_largest_decides_rho():
    swift = log("0.3", paces=(steady(0.05, 8, 1e-9), steady(0.05, 6, 1e-8)))
    slow = log("0.4", "0.55")
    assert slow.rho is None
    found = together(slow, swift)
    assert (found[1].theta, found[1].kept, found[2]) == (0.3, True, None)
    assert "within 8 iterations" in found[1].why
    decides = log("0.45", "0.8")
    assert together(decides)[1].theta < decides.next.theta  # as the softest mode is not known
    assert not together(decides, swift)[1].kept
    one = Pace(kind="short", steps=1, length=2, height=1e-12)
    assert "within 2 iterations:" in together(log("0.3", paces=(one,)))[1].why


def test_a_log_that_converges_slowly_without_a_ratio_is_not_kept():
    column = lambda *paces: (
        SeenColumn(name="r", residual="absolute", paces=paces, windows=1, ratio=None, plateau=None),
    )
    slow = from_logs.longer(column(Pace(kind="unsteady", steps=199, length=200, height=1e-7)), F(1, 20))
    assert not slow.kept
    assert slow.theta > 0.05


def test_growth_bounds_the_largest_eigenvalue_from_below_and_estimates_it_only_where_it_is_steady():
    """Of a run that has begun to grow just now the ratios still rise: 0.5 * 4.4 - 1 = 1.2 was seen as 1.1 to 1.2."""
    ends_of = lambda ratio: [box.b for box in from_logs.boxes_of(log("0.5", ratio), kind_of(tied=True))]
    assert ends_of(observed("1.15", "1.1", "1.2")) == [(pytest.approx(4.2), math.inf)]
    ((low, high),) = ends_of(observed("1.2", "1.199", "1.201"))
    assert (low, high) == (pytest.approx(4.398), pytest.approx(4.402 * 1.03))
    steady = together(log("0.5", observed("1.2", "1.199", "1.201")), tied=True)[1]
    assert "runs that grow bound rho from below" in steady.why
    assert "steps or more with this theta narrows rho" in steady.why


def test_after_several_runs_of_which_none_converges_a_quarter_comes_next():
    rising = (log("0.5", "1.5"), log("0.8", "2.2"))
    assert together(*rising)[1].theta == 0.125
    assert together(rising[0])[1] == rising[0].next
    fast = together(log("0.5", "60"), log("0.8", "99"))[1]  # rho is at least 124: 100/0.8 - 1
    assert fast.theta == pytest.approx(2 / 126, rel=1e-3)
    falls = log("0.1", observed("0.9", "0.5", "0.95"))
    assert together(falls, *rising)[1].theta > 0.1


def test_boxes_of_a_log_are_those_of_what_it_shows():
    holds = lambda seen, a, b, tied: any(
        box.a[0] <= a <= box.a[1] and box.b[0] <= b <= box.b[1] for box in from_logs.boxes_of(seen, kind_of(tied=tied))
    )
    falls = log("0.4", "0.8")  # 1 - 0.4 * 0.5, or 0.4 * 4.5 - 1
    assert holds(falls, 1.0, 4.5, False)
    assert not holds(falls, 1.0, 4.0, False)
    wide = log("0.4", observed("0.8", "0.7", "0.9"))
    assert all(holds(wide, 1.0, b, False) for b in (4.25, 4.5, 4.75))
    assert not any(holds(wide, 1.0, b, False) for b in (4.2, 4.8))
    grows = log("0.5", "1.5")
    assert not holds(grows, 1.0, 4.0, True)
    assert holds(grows, 1.0, 5.0, True)
    assert holds(grows, 1.0, 2.0, False)  # in contact nothing follows
    stays = log("0.5", kinds=("level",))
    assert not holds(stays, 1.0, 3.8, True)
    assert holds(stays, 1.0, 3.9, True)  # SETTLED below 4
    assert holds(stays, 1.0, 100.0, True)
    flat = log("0.5", kinds=("plateau",), plateau=["1.1", "1.08", "1.125"])  # rho from 8 to 12.5
    assert all(holds(flat, 1.0, 1 + rho, True) for rho in (7.8, 8, 12.5, 12.8))
    assert not any(holds(flat, 1.0, 1 + rho, True) for rho in (7.7, 12.9))
    assert holds(flat, 1.0, 50.0, False)


def test_what_logs_leave_together_decides_within_1_4_and_else_names_a_run_below_those_that_rise():
    one, other = log("0.2", "0.8"), log("0.45", "0.8")  # 1 and 4
    readings, following, rho = from_logs.by_ends((one, other), other, F(2), TIED)
    assert readings[0].lo == 2.0
    assert float(rho) == pytest.approx(3, rel=0.05)
    assert float(rho) >= 3
    assert readings[0].value == float(rho)
    assert following.theta == pytest.approx(0.4, rel=0.05)
    assert from_logs.by_ends((one, other), other, None, TIED)[0][0].lo is None
    base = log("0.38", "0.62")
    _, in_contact, rho = from_logs.by_ends((one, other, base), base, None, CONTACT)
    assert rho is not None
    assert in_contact.theta <= 0.38  # not above the base, which falls
    assert from_logs.by_ends((one, other, base), base, None, TIED)[1].theta > 0.38
    wide = log("0.1", observed("0.9"))
    _, following, rho = from_logs.by_ends((wide,), wide, None, CONTACT)
    assert rho is None
    assert "within 1.4 times" in following.why
    _, below, _ = from_logs.by_ends((wide, log("0.2", "1.5"), log("0.3", "1.9")), wide, None, CONTACT)
    assert 0.1 < below.theta < 0.2 < following.theta
    only = log("0.5", "1.5", file="no falls")
    assert from_logs.by_ends((only,), only, None, CONTACT) is None
    apart = (log("0.3", "0.95"), log("0.5", "0.2"))
    readings, following, rho = from_logs.by_ends(apart, apart[1], None, TIED)
    assert (following.theta, following.kept, rho) == (0.5, True, None)  # it falls fastest
    assert from_logs.by_ends(apart, apart[1], None, CONTACT) is None


def test_rho_is_taken_at_the_upper_end_of_all_that_is_left(monkeypatch):
    left = [Box(a=(1.0, 1.0), b=(1.3, 1.4)), Box(a=(1.0, 1.0), b=(1.1, 1.2))]
    monkeypatch.setattr("verification.coupling.ends.common", lambda each: left)
    falls = log("0.9", "0.2")
    assert float(from_logs.by_ends((falls,), falls, None, TIED)[2]) == pytest.approx(0.4)


def test_the_ends_of_the_spectrum_in_words():
    boxes = [Box(a=(0.9, 1.5), b=(4.0, 5.0)), Box(a=(1.2, 2.0), b=(3.0, 4.5))]
    assert from_logs.ends_in_words(boxes) == "the smallest eigenvalue is 0 to 1 and the largest eigenvalue is 2 to 4"
    assert from_logs.ends_in_words([Box(a=(1.5, 1.5), b=(4.0, 4.0))]).startswith("the smallest eigenvalue is 0.5 and")


@pytest.mark.parametrize(
    ("dear", "words"),
    [(1.0, "the fewest"), (1.049, "the fewest"), (1.05, "1.1 times"), (1.1 + 1e-15, "1.1 times"), (1.11, "1.2 times")],
)
def test_what_a_theta_costs_is_rounded_up_and_names_its_assumption(dear, words):
    said = from_logs.cost_in_words([Box(a=(1.0, 1.0), b=(4.0, 4.0))], dear, CONTACT)
    assert words in said
    assert "the logs show where contact does not change, with 5 modes and 7 steps or more" in said


@pytest.mark.parametrize("softest", [2.05, 1.33, 0.5, 0.0])
def test_in_contact_one_log_of_the_stiffest_mode_asks_for_the_run_that_shows_the_softest_one(tmp_path, softest):
    """lambda up to 2.21: the answer after one log took 19 steps where 6 suffice, with a softest mode of 2.05."""
    modes, theta, logs = (softest, 2.1, 2.2, 2.21), 0.5, []
    for n in range(4):
        logs.append((precice(tmp_path / f"{n}.log", [{"ResAbs(M:F)": linear_run(modes, theta, 60)[0]}]), repr(theta)))
        found = vf.advise_logs(logs)
        if found.theta is not None or found.next.kept:
            break
        theta = found.next.theta
    assert n > 0
    steps = lambda theta: max(7, math.log(1e-9) / math.log(max(abs(1 - theta * (1 + mode)) for mode in modes)))
    assert steps(found.next.theta) <= 1.45 * steps(2 / (2 + modes[0] + modes[-1]))
    least, most = (float(z) for z in re.search(r"smallest eigenvalue is (\S+) to (\S+) and", found.next.why).groups())
    assert least - 0.05 <= softest <= most + 0.05


def test_logs_of_which_no_linear_coupling_has_all_leave_the_theta_of_the_largest_that_falls():
    contrary = (log("0.3", "0.95"), log("0.5", "0.8"))
    apart = from_logs.decide(contrary, RhoInterval(lo=None, hi=None, contradiction=None), CONTACT)
    assert apart == (contrary[1].readings, contrary[1].next, contrary[1].rho)


def test_an_estimate_from_above_that_a_bound_from_below_excludes_is_not_shown():
    """rho of 0.8597 at least and of 0.8590 at most stood together, of a coupling with 0.939."""
    bounds = lambda *above: from_logs.interval_of([bound(F("0.8597"), "l.log")], [bound(one) for one in above])
    assert bounds(F("0.859")).hi is bounds(F("0.859")).contradiction is None
    assert bounds(F("0.859"), F("0.95"), 2).hi.value == F("0.95")
    upper = from_logs.bounds([log("0.45", "0.8")])[1][0]
    assert "a log that shows the stiffest mode" in upper.assumes
    assert "too short to show the stiffest mode" in from_logs.interval_of([bound(9)], [bound(3)]).contradiction


def test_bounds_of_a_log_use_the_safe_end_of_its_ratio(tmp_path):
    wide = observed("0.8", "0.75", "0.85")
    (lower,), (upper,) = from_logs.bounds([log("0.45", wide)])
    assert lower.value == F(7, 4) / F("0.45") - 1
    assert upper.value == F("1.85") / F("0.45") - 1
    for ratio in ("0.5", observed("0.57", "0.5", "0.6")):  # below 1 - theta in part
        assert from_logs.bounds([log("0.45", ratio)])[0] == []
    document = RhoInterval(lo=bound(F(1, 3)), hi=bound(F(1, 3)), contradiction=None).to_dict()
    assert F(document["lo"]["value"]) <= F(1, 3) <= F(document["hi"]["value"])
    assert document["lo"]["value"] < document["hi"]["value"]


def test_a_transient_in_which_one_window_stays_at_a_level_does_not_converge(tmp_path):
    falls = linear_run((0.2, 3.0), 0.45, 40)[0]
    level = [1 + 0.5 * (-1) ** (n // 2) for n in range(40)]
    found = vf.advise_logs([logged(tmp_path, [falls, falls, level], "0.45")])
    assert found.roles == ()
    assert found.interval.hi is None
    assert math.isfinite(found.interval.lo.value)


def test_a_theta_to_paste_that_was_run_is_the_one_of_that_run(tmp_path):
    logs = [
        (precice(tmp_path / f"{theta}.log", [{"ResAbs(M:F)": [r**n for n in range(150)]}]), theta)
        for theta, r in (("0.1", 0.9), ("0.15", 0.86))
    ]
    found = vf.advise_logs(logs)
    assert found.roles
    assert (found.theta, found.next.kept) == (0.15, True)


def test_a_ratio_decides_by_its_unsafe_end_and_a_run_by_its_slowest_field():
    assert log("0.3", observed("0.98", "0.95", "0.99")).converges
    assert not log("0.3", observed("0.98", "0.95", "1.02")).converges
    assert not log("0.3", observed("1.02", "0.99", "1.05")).diverges
    assert log("0.3", observed("1.02", "1.01", "1.05")).diverges
    fast, slow = (log("0.3", ratio).columns[0] for ratio in ("0.5", "0.8"))
    for columns in ((fast, slow), (slow, fast)):
        assert dataclasses.replace(log("0.3"), columns=columns).slowest.value == F("0.8")


def test_a_plateau_bounds_rho_by_its_upper_end():
    readings = read_plateau(F(1, 2), observed("1.1", "1.09", "1.125"))[0]
    seen = log("0.5", kinds=("plateau",), plateau=["1.1", "1.09", "1.125"], readings=readings)
    assert {one.value for one in from_logs.bounds([seen])[0]} == {F(3), F(8)}


def test_the_least_bound_from_above_is_that_of_the_interval_and_the_one_that_contradicts():
    above = [bound(2, "b.log"), bound(7)]
    assert from_logs.interval_of([], above).hi.value == 2
    refused = from_logs.interval_of([bound(5, "c.log")], above)
    assert refused.hi.value == 2
    assert "by b.log with theta = 0.5 rho is at most 2, by c.log with theta = 0.5 at least 5" in refused.contradiction


def test_a_log_too_short_to_be_read_falls_and_is_swift_where_each_window_is():
    of = lambda *heights, steps=2: log("0.3", paces=[Pace(kind="short", steps=steps, height=each) for each in heights])
    assert of(0.09, 0.01).falls
    assert not of(0.09, 0.5).falls
    assert of(0.01, 0.01).swift
    assert not of(0.01, 0.5).swift
    assert not of(0.01, steps=0).swift
    assert not Pace(kind="short", steps=2, height=0.01, lost=True).swift
    arrives = lambda arrived: Pace(kind="short", steps=9, height=1e-9, arrived=arrived).swift
    assert (arrives(False), arrives(True)) == (True, False)  # in a step more
