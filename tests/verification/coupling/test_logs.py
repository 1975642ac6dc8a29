"""What convergence logs say of rho: what a series of residuals shows, and several logs together."""

import itertools
import math
from fractions import Fraction as F

import numpy as np
import pytest
from coupling_logs import MODES, contact_run, kinds, linear_run, noisy, precice, written
from problem_list import changed
from strategies import AT_NIGHT

import verification as vf
from verification.coupling import readings
from verification.coupling.from_logs import advise_logs
from verification.interface.pair import pair_from


def of(tmp_path, theta, modes=MODES, steps=120, name="run.log", column="ResAbs(Solid-Mesh:Force)"):
    absolute, relative = linear_run(modes, theta, steps)
    series = relative if "Rel" in column else absolute
    return precice(tmp_path / name, [{column: series}]), repr(theta)


@pytest.mark.parametrize("ratio", [0.27, 0.29, 0.31, 0.33])
def test_a_swift_run_with_theta_1_is_read_alike_by_relative_and_by_absolute_residuals(tmp_path, ratio):
    """Relative ones below 0.1 are two fewer; theta = 1 is not kept where a smaller one takes half of the steps."""
    steps = 1 + math.ceil(math.log(1e-6) / math.log(ratio))
    found = [
        advise_logs([of(tmp_path, 1.0, (0.02, 0.1, ratio), steps, column=column)], tied=True)
        for column in ("ResAbs(M:F)", "ResRel(M:F)")
    ]
    one, other = (advice.theta for advice in found)
    assert one == pytest.approx(other, rel=0.02)
    assert one < 0.9


@pytest.mark.parametrize(
    ("high", "column", "shows"), [(0.6, "Abs", 1), (0.6, "Rel", 1), (2.0, "Abs", 1), (2.0, "Rel", 0)]
)
def test_the_rows_with_theta_1_that_are_asked_for_show_the_ratio_but_relative_ones_no_growth(
    tmp_path, high, column, shows
):
    log = of(tmp_path, 1.0, (0.1, 0.3, high), readings.ROWS, column=f"Res{column}(M:F)")
    found = advise_logs([log], tied=True)
    (seen,) = found.logs
    assert (seen.slowest is not None) == shows
    if shows:
        assert float(seen.slowest.value) == pytest.approx(high, rel=0.02)
    grows = "Relative residuals stay so too where the run grows"
    assert (grows in str(found.sections())) == (not shows)


# --- one log ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("column", ["ResAbs(M:F)", "ResRel(M:F)", "ResDrop(M:F)"])
@pytest.mark.parametrize("theta", [0.05, 0.1, 0.2, 0.3, 0.42, 0.48])
def test_a_run_that_converges_bounds_rho_as_its_spectrum_has_it(tmp_path, theta, column):
    found = advise_logs([of(tmp_path, theta, column=column, steps=400)])
    (seen,) = found.logs
    factors = [1 - theta * (1 + mode) for mode in MODES]
    q = max(map(abs, factors))
    assert seen.slowest.least <= q * (1 + 1e-6)
    assert seen.slowest.most >= q * (1 - 0.01)
    assert float(seen.slowest.value) == pytest.approx(q, rel=0.02)
    assert found.interval.hi.value >= 3 * (1 - 1e-6)
    if min(factors) == -q:
        assert "mode-high" in kinds(found)
        assert found.interval.lo.value <= 3 * (1 + 1e-6)
    else:
        assert "mode-low" in kinds(found)
        assert found.roles == ()


@pytest.mark.parametrize("theta", [0.55, 0.7, 1.0])
def test_a_tied_run_that_diverges_tells_rho_by_its_ratio_and_by_its_plateau(tmp_path, theta):
    absolute = advise_logs([of(tmp_path, theta)])
    assert kinds(absolute)[0] == "mode-high"
    assert absolute.readings[0].value == pytest.approx(3, rel=1e-3)
    relative = advise_logs([of(tmp_path, theta, column="ResRel(M:F)", name="rel.log")])
    assert kinds(relative) == ["plateau", "level"]
    assert relative.readings[0].value == pytest.approx(3, rel=1e-3)
    assert relative.readings[0].lo <= 3 * (1 + 1e-9)
    assert relative.interval.lo.assumes == "a tied interface"
    for found in (absolute, relative):
        assert found.roles == ()  # nothing is pasted from a run that does not converge
        assert found.next.theta < 2 / 4
        tied = advise_logs([(found.logs[0].file, repr(theta))], tied=True)
        assert [reading.value for reading in tied.readings] == [pytest.approx(3, rel=1e-3)]
        assert 0.3 < tied.next.theta < 0.5  # this run converges, and tells the softest mode


@pytest.mark.parametrize("theta", [0.3, 0.5, 0.8])
def test_the_plateau_of_a_relative_residual_is_1_plus_1_over_rho_whatever_theta(tmp_path, theta):
    found = advise_logs([of(tmp_path, theta, (0.2, 0.5, 1.1, 10.72), column="ResRel(M:F)")])
    assert found.readings[0].value == pytest.approx(10.72, rel=1e-3)


def test_a_relative_residual_that_is_not_flat_or_too_high_is_no_plateau(tmp_path):
    theta = 0.5
    flat = {"at most 2/(2 - theta)": (1.3, 1 / 0.3), "more, of data not relaxed": (1.4, 6), "too high": (2.1, 0)}
    for name, (P, rho) in flat.items():
        log = written(tmp_path / "a.txt", "it rel_res\n" + "".join(f"{n} {P}\n" for n in range(40)))
        found = advise_logs([(log, theta)])
        assert kinds(found) == (["plateau", "level"] if rho else ["level"]), name
        assert rho == 0 or found.readings[0].value == pytest.approx(rho)
        assert ("if these data are not relaxed, rho is 7.667" in found.readings[0].says) == (P == 1.3)
    wavy = "".join(f"{n} {1.3 + 0.05 * (-1) ** n}\n" for n in range(40))
    found = advise_logs([(written(tmp_path / "b.txt", f"it rel_res\n{wavy}"), theta)])
    assert "plateau" not in kinds(found)


def test_a_residual_that_stays_at_a_level_is_a_cycle_and_bounds_rho_at_k_0_alone(tmp_path):
    """Section 6 with the roles exchanged, without friction, at twice the theta that contracts."""
    pair = pair_from(vf.Problem.from_dict(changed(contact={"friction": "0"}, iteration={"neumann_body": 2})))
    rho = vf.measure(pair).rho_normal.value
    theta = round(4 / (1 + rho), 3)
    absolute, relative = contact_run(pair, theta, 80)
    for name, series in {"ResAbs(M:F)": absolute, "ResRel(M:F)": relative}.items():
        found = advise_logs([(precice(tmp_path / "a.log", [{name: series}]), repr(theta))])
        assert kinds(found)[-1] == "level"
        assert found.roles == ()
        assert float(found.interval.lo.value) <= rho
        assert found.interval.lo.value == pytest.approx(2 / theta - 1)
        assert found.next.theta < theta


def test_a_steady_divergence_with_open_nodes_bounds_rho_and_is_neither_mode_nor_plateau(tmp_path):
    """4.51 a step with 16 of 25 nodes open: read as a mode it would give rho = 6.87, which is 45.6."""
    data = changed(
        body1={"young": 1e3, "poisson": "0.49", "cells": [40, 6]}, body2={"young": 5e4, "cells": [24, 6]},
        contact={"friction": "0"}, iteration={"neumann_body": 1},
    )  # fmt: skip
    pair = pair_from(vf.Problem.from_dict(data))
    rho = vf.measure(pair).rho_normal.value
    absolute, relative = contact_run(pair, 0.7, 60)
    log = precice(tmp_path / "a.log", [{"ResAbs(M:F)": absolute, "ResRel(M:F)": relative}])
    found, by_ratio = advise_logs([(log, "0.7")]), vf.advise_run("0.7", "4.5123")
    assert float(found.logs[0].slowest.value) == pytest.approx(4.5123, abs=1e-3)
    assert kinds(found) == ["mode-high", "level"]
    alone = advise_logs([(precice(tmp_path / "r.log", [{"ResRel(M:F)": relative}]), "0.7")])
    assert kinds(alone) == ["level"]  # 1.00180 and 1.00187 in turn: as a plateau they would say rho = 545
    for least in (found.interval.lo.value, by_ratio.readings[0].lo):
        assert least == pytest.approx(5.5123 / 0.7 - 1, abs=0.01)
        assert least < 0.5 * rho
    assert found.interval.hi is None
    assert found.roles == by_ratio.roles == ()
    logs, theta = [(log, "0.7")], found.next.theta
    for n in range(8):
        absolute, _ = contact_run(pair, theta, 60 + 3 * math.ceil(5 / theta))
        logs.append((precice(tmp_path / f"{n}.log", [{"ResAbs(M:F)": absolute}]), repr(theta)))
        found = advise_logs(logs)
        assert float(found.interval.lo.value) <= rho * (1 + 1e-6)
        if found.roles:
            break
        theta = found.next.theta
    assert found.best.rho.value == pytest.approx(rho, rel=0.03)
    assert contact_run(pair, found.next.theta, 200)[0][-1] < 1e-9


def test_aitken_and_anderson_give_no_steady_ratio(tmp_path):
    problem = vf.Problem.from_dict(changed(iteration={"neumann_body": 2, "max_iterations": 60, "tolerance": 1e-12}))
    for rule in ("aitken", "anderson"):
        history = vf.run(problem, theta="0.1", rule=rule).history
        found = advise_logs([(precice(tmp_path / "a.log", [{"ResAbs(M:F)": history}]), "0.1")])
        assert found.readings == ()
        assert found.roles == ()


def test_windows_are_put_together_with_their_spread_and_one_that_does_not_converge_decides(tmp_path):
    falls, _ = linear_run(MODES, 0.45, 40)
    names = ("ResAbs(M:F)",)
    few = [{names[0]: [v * 10**n for v in falls[: 20 + n]]} for n in range(5)]
    (seen,) = advise_logs([(precice(tmp_path / "a.log", few), "0.45")]).logs
    assert seen.columns[0].count("steady") == 5
    assert seen.slowest.least <= 0.8 <= seen.slowest.most
    level = {names[0]: [1 + 0.5 * (-1) ** (n // 2) for n in range(30)]}
    found = advise_logs([(precice(tmp_path / "b.log", [*few, level]), "0.45")])
    assert found.logs[0].columns[0].count("level") == 1
    assert "level" in kinds(found)
    assert found.roles == ()


def test_a_short_log_says_how_many_steps_are_needed_and_to_keep_a_theta_that_converges(tmp_path):
    absolute, _ = linear_run(MODES, 0.3, 8)
    found = advise_logs([(precice(tmp_path / "a.log", [{"ResRel(M:F)": absolute}] * 3), "0.3")])
    assert found.readings == ()
    assert found.next.theta == 0.3
    assert "17 steps or more" in found.next.why
    fast = linear_run((0.1, 0.12), 0.9, 9)[0]
    found = advise_logs([(precice(tmp_path / "c.log", [{"ResAbs(M:F)": fast}]), "0.9")])
    assert (found.roles, found.next.theta) == ((), 0.9)
    assert "keep it: the run converges within 9 iterations" in found.next.why
    lost = written(tmp_path / "b.txt", "1\n1e50\n1e100\n1e200\ninf\n")
    assert advise_logs([(lost, "0.3")]).next.theta == 0.075


def test_a_level_as_low_as_the_solvers_are_accurate_bounds_nothing(tmp_path):
    absolute, _ = linear_run(MODES, 0.45, 80)
    rng = np.random.default_rng(1)
    ends = lambda floor: [max(v, floor * absolute[0]) * (1 + 0.3 * rng.random()) for v in absolute]
    for floor, height in ((1e-4, "floor"), (1e-9, "steady")):
        steady = [v if v > 20 * floor * absolute[0] else w for v, w in zip(absolute, ends(floor), strict=True)]
        found = advise_logs([(precice(tmp_path / "a.log", [{"ResAbs(M:F)": steady}]), "0.45")])
        assert found.logs[0].columns[0].count(height) == 1
        assert found.readings[0].value == pytest.approx(3, rel=0.03)
        assert (found.logs[0].rho is None) == (height == "floor")
        if height == "floor":
            assert found.readings[-1].lo is None
            assert found.interval.hi is None


# --- several logs ----------------------------------------------------------------------------------------------------


def test_logs_at_different_theta_leave_an_interval_with_its_evidence(tmp_path):
    logs = [of(tmp_path, 0.3, name="a.log"), of(tmp_path, 0.8, name="b.log", column="ResRel(M:F)")]
    found = advise_logs(logs)
    lo, hi = found.interval.lo, found.interval.hi
    assert lo.value <= 3 * (1 + 1e-6)
    assert hi.value >= 3
    assert (lo.log.theta, hi.log.theta) == (F("0.8"), F("0.3"))
    assert "tied" in lo.assumes
    assert "closed" in hi.assumes
    assert found.interval.contradiction is None
    assert found.logs == advise_logs(logs).logs


def test_logs_that_exclude_each_other_are_told_and_never_averaged(tmp_path):
    stiff, soft = of(tmp_path, 0.3, (1, 9), name="a.log"), of(tmp_path, 0.45, (0.5, 3), name="b.log")
    found = advise_logs([stiff, soft])
    assert found.interval.contradiction is not None
    for part in ("a.log", "b.log", "at least 9", "at most 3"):
        assert part in found.interval.contradiction
    assert found.roles == advise_logs([stiff, soft], tied=True).roles == ()
    assert advise_logs([soft]).interval.contradiction is None


def test_a_theta_that_falls_fast_is_kept_only_where_no_softer_mode_leaves_a_faster_one(tmp_path):
    """Modes from 4.7 to 18.55: the fewest steps are at 2/(2 + 4.7 + 18.55) = 0.0792, and a smaller theta is safe."""
    modes = (4.7, 10.0, 18.55)
    logs = [of(tmp_path, theta, modes, name=f"{theta}.log") for theta in (0.0796, 0.0985)]
    third = advise_logs(logs).next
    assert third.theta < 0.0796
    found = advise_logs([*logs, of(tmp_path, third.theta, modes, name="third.log")])
    assert 0.07 < found.theta < 0.0796
    assert "the fewest steps" in found.next.why


def couplings():
    """Couplings with known spectrum: the largest eigenvalue, modes below it, open nodes in some."""
    rng = np.random.default_rng(20)
    for n in range(20):
        rho = 10 ** rng.uniform(-0.5, 1.6)
        soft = [0, 0] if n % 3 == 2 else []
        below = rng.uniform(0.02 * rho, 0.9 * rho, rng.integers(3, 30))
        yield f"{'open' if soft else 'tied'} {n}", (*soft, *np.sort(below), rho)


@pytest.mark.parametrize("noise", [0, 0.02])
def test_following_the_logs_pastes_a_theta_that_converges_in_few_steps(tmp_path, noise):
    """Of 20 couplings and three first thetas: none diverges, nine of ten take 1.4 times the steps of 2/(2 + rho).

    One of four with noise and another one without; at night all of both.
    """
    decided, costs = 0, []
    cases = list(itertools.product(couplings(), (0.05, 0.3, 0.9)))
    cases = cases if AT_NIGHT else cases[bool(noise) :: 4]
    for (name, modes), start in cases:
        logs, theta, rho = [], start, max(modes)
        for n in range(12):
            series = linear_run(modes, theta, 60 + 3 * max(10, math.ceil(5 / theta)))[0]
            series = noisy(series, noise, n) if noise else series
            logs.append((precice(tmp_path / f"{n}.log", [{"ResAbs(M:F)": series}]), repr(theta)))
            found = advise_logs(logs)
            assert found.interval.lo is None or found.interval.lo.value <= rho * (1.05 if noise else 1 + 1e-3)
            if found.roles or found.next.theta == theta:
                break
            theta = found.next.theta
        factor = max(abs(1 - found.next.theta * (1 + mode)) for mode in modes)
        assert factor < 1, name  # neither what is pasted nor what is kept diverges
        if found.roles:
            decided += 1
            costs.append(math.log(max(abs(1 - min(2 / (2 + rho), 0.99) * (1 + m)) for m in modes)) / math.log(factor))
    assert decided >= 0.9 * len(cases)
    assert np.quantile(costs, 0.9) <= 1.4


@pytest.mark.parametrize("friction", ["0", "0.2"])
@pytest.mark.parametrize("moduli", [(2e4, 7e4, 1), (7e4, 2e4, 2), (7e4, 2e4, 1)], ids=str)
def test_following_the_logs_of_two_bodies_in_contact_ends_in_a_theta_that_converges(tmp_path, moduli, friction):
    E1, E2, neumann_body = moduli
    moduli = {"body1": {"young": E1}, "body2": {"young": E2}}
    data = changed(**moduli, contact={"friction": friction}, iteration={"neumann_body": neumann_body})
    pair = pair_from(vf.Problem.from_dict(data))
    noises = (0, 0.01) if friction == "0" else (0.01, 0)
    runs = list(itertools.product((0.9, 0.3), noises))
    for start, noise in runs if AT_NIGHT else [runs[0] if neumann_body == 1 else runs[3]]:
        logs, theta = [], start
        for n in range(10):
            series = contact_run(pair, theta, 60 + 3 * max(10, math.ceil(5 / theta)))[0]
            series = noisy(series, noise, n) if noise else series
            logs.append((precice(tmp_path / f"{n}.log", [{"ResAbs(M:F)": series}]), repr(theta)))
            found = advise_logs(logs)
            if found.roles or found.next.theta == theta:
                break
            theta = found.next.theta
        final = contact_run(pair, found.next.theta, 400)[0]
        assert final[-1] <= 1e-6 * max(final)


@pytest.mark.parametrize("column", ["ResRel(M:F)", "ResAbs(M:F)"])
def test_a_longer_log_never_shows_less(tmp_path, column):
    """Nothing, a pooled ratio, a ratio: by the steps of the windows."""
    for theta in (0.3, 0.45):
        absolute, relative = linear_run(MODES, theta, 60)
        series = relative if "Rel" in column else absolute
        shown = []
        for steps in range(4, 60, 1 if AT_NIGHT else 5):
            log = precice(tmp_path / "a.log", [{column: series[:steps]}] * 12)
            (seen,) = advise_logs([(log, str(theta))]).logs[0].columns
            shown.append(2 if seen.ratio is not None else 1 if seen.pooled is not None else 0)
        assert shown == sorted(shown), shown
        assert shown[-1] == 2


def test_a_time_that_passes_in_every_row_begins_no_window(tmp_path):
    """A clock beside counted iterations; a time that stands while they are counted begins one."""
    rows = [(i, 0.8**i, 0.37 * i) for i in range(40)]
    log = tmp_path / "clock.csv"
    log.write_text("iter,residual,time\n" + "".join(f"{i},{r:.8e},{t:.3f}\n" for i, r, t in rows))
    found = advise_logs([(log, "0.45")])
    assert found.logs[0].columns[0].windows == 1
    assert found.readings[0].value == pytest.approx(3, rel=0.01)
    log.write_text("iter,residual,time\n" + "".join(f"{i % 20 + 1},{r:.8e},{i // 20}\n" for i, r, _ in rows))
    assert advise_logs([(log, "0.45")]).logs[0].columns[0].windows == 2


def test_a_log_that_explodes_says_no_less_with_more_rows(tmp_path):
    """Two modes: the ratio is not steady yet, and the last one still bounds rho."""
    sizes = np.abs([[(1 - (1 + mode)) ** i for i in range(13)] for mode in (7.3, 17.5)])
    residuals = np.sqrt(sizes[0] ** 2 + (1e-3 * sizes[1]) ** 2)
    log, bounds = tmp_path / "residuals.txt", []
    for rows in (4, 8, 11, 12, 13):
        log.write_text("".join(f"{r:.8e}\n" for r in residuals[:rows]))
        found = advise_logs([(log, "1")], kind="tied")
        bounds.append(found.interval.lo.value)
        assert 2 / (2 + 18) < found.next.theta < 0.3
    assert all(more >= less * (1 - F(1, 10**3)) for less, more in itertools.pairwise(bounds))
    assert 7.29 < bounds[0] < bounds[-1] <= 17.5


def test_a_residual_that_runs_away_asks_for_a_smaller_theta(tmp_path):
    log = tmp_path / "residuals.txt"
    for rows in ([1.0, 1e3, 1e14], [1.0, 1e5, 1e20, 1e40], [1.0, 50.0, "inf"], [1.0, 1e8, 1e16]):
        log.write_text("".join(f"{r}\n" for r in rows))
        assert 1e-6 <= advise_logs([(log, "1")], kind="tied").next.theta <= 0.25  # a run that this command reads


def test_logs_of_a_coupling_that_is_not_symmetric_keep_the_run_that_falls_fastest(tmp_path):
    """As with convection: no real eigenvalues have these ratios, and no theta is halved for it."""
    modes, logs = np.array([0.9 + 2j, 0.9 - 2j, 1.8, 0.84]), []
    for theta in (1.0, 0.5, 0.2, 0.3, 0.4):
        residuals = [np.abs((1 + modes) * (1 - theta * (1 + modes)) ** i).max() for i in range(60)]
        logs.append((tmp_path / f"{theta}.txt", str(theta)))
        logs[-1][0].write_text("".join(f"{r:.8e}\n" for r in residuals))
    contradict = advise_logs(logs[3:], kind="tied")
    assert contradict.interval.contradiction
    assert (contradict.next.theta, contradict.next.kept) == (0.3, True)
    found = advise_logs(logs[:3], kind="tied")
    assert found.theta is None
    assert (found.next.theta, found.next.kept) == (0.2, True)
    text = f"{found.next.why} {found.interval.contradiction} {found.interval.lo.assumes}"
    assert "convection" in text
    assert "real eigenvalues" in found.interval.lo.assumes
