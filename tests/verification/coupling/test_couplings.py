"""The advice from logs on couplings of another code, whose spectrum is known."""

import itertools
import json
import math
from fractions import Fraction as F
from importlib import import_module
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from coupling_logs import linear_run, noisy, precice
from strategies import AT_NIGHT

import verification as vf
from verification.coupling.ends import Box, cheapest, common, dearest, of_ratio

BENCHMARKS = Path(__file__).parents[3] / "benchmarks"


@pytest.fixture(scope="module")
def made():
    """The module of the thirty couplings, which makes them once."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCHMARKS))
        module = import_module("couplings")
        every = list(module.couplings())
        patch.setattr(module, "couplings", lambda: iter(every))
        yield module


def logged(folder, modes, thetas, noise=0.0, column="ResAbs(M:F)"):
    logs = []
    for n, theta in enumerate(thetas):
        series = linear_run(modes, theta, 60 + 3 * max(10, math.ceil(5 / theta)))["Rel" in column]
        series = noisy(series, noise, n) if noise else series
        logs.append((precice(folder / f"{n}.log", [{column: series}]), repr(theta)))
    return logs


# --- tied interfaces -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("start", "noise"), [(0.05, 0), (0.5, 0.01), *([(0.05, 0.01), (0.5, 0)] * AT_NIGHT)])
@pytest.mark.parametrize("modes", [(4.7, 10.0, 18.55), (0.05, 1.0, 3.0), (0.6, 2.0, 10.4), (7.35, 25.0, 60.0)], ids=str)
def test_logs_of_tied_runs_end_at_the_theta_that_serves_both_ends_of_the_spectrum(tmp_path, modes, start, noise):
    theta, best = start, 2 / (2 + modes[0] + modes[-1])
    runs = []
    for _ in range(6):
        runs.append(theta)
        found = vf.advise_logs(logged(tmp_path, modes, runs, noise), tied=True)
        theta = found.next.theta
        if found.roles:
            break
    assert found.roles
    q = lambda theta: max(abs(1 - theta * (1 + mode)) for mode in modes)
    assert math.log(q(best)) / math.log(q(theta)) <= 1.4
    assert [reading.kind for reading in found.readings] == ["mode-high"]
    assert found.best.rho.value >= 0.95 * modes[-1]  # the upper end of what the logs leave
    assert "upper end" in found.readings[0].says


def test_a_tied_interface_without_soft_modes_needs_a_smaller_theta_than_one_that_may_open(tmp_path):
    found = vf.advise_logs(logged(tmp_path, (4.7, 10.0, 18.55), (0.5, 0.05)), tied=True)
    assert found.roles
    assert found.next.theta == pytest.approx(2 / (2 + 4.7 + 18.55), rel=0.03)
    assert "smallest eigenvalue" in found.next.why
    assert found.next.theta < 0.85 * found.best.theta_predicted  # 2/(2 + rho)


def test_logs_that_no_tied_interface_has_are_told_as_such(tmp_path):
    one, other = logged(tmp_path, (1.0, 9.0), (0.15,)), logged(tmp_path, (30.0, 90.0), (0.5, 0.02))[1:]
    found = vf.advise_logs([*one, *other], tied=True)
    assert found.roles == ()
    assert found.interval.contradiction is not None or "no tied interface" in found.next.why


def test_the_plateau_of_a_tied_run_tells_the_stiffest_mode_to_the_advice(tmp_path):
    logs = logged(tmp_path, (0.2, 0.5, 10.72), (0.5,), column="ResRel(M:F)")
    found = vf.advise_logs(logs, tied=True)
    assert "plateau" in [reading.kind for reading in found.logs[0].readings]
    assert 1 / 11.72 * 0.9 < found.next.theta < 2 / 11.72


# --- the region of pairs that logs leave -----------------------------------------------------------------------------


@pytest.mark.parametrize(("a", "b"), [(1.0, 4.0), (2.0, 11.0), (5.0, 6.0)])
def test_the_pair_of_a_run_lies_in_what_its_ratio_leaves_and_two_thetas_tell_it(a, b):
    q = lambda theta: max(abs(1 - theta * a), abs(1 - theta * b))
    inside = lambda boxes: any(box.a[0] <= a <= box.a[1] and box.b[0] <= b <= box.b[1] for box in boxes)
    best = 2 / (a + b)
    left = [of_ratio(theta, q(theta), q(theta)) for theta in (0.4 * best, 0.8 * best, best, 1.1 * best)]
    assert all(inside(boxes) for boxes in left)
    both = common([left[1], left[3]])
    assert inside(both)
    theta, dear = cheapest(both, 1.0)
    assert dear <= 1.4
    assert theta == pytest.approx(best, rel=0.1)


def test_no_theta_has_a_smaller_factor_than_two_over_the_sum_of_both_ends():
    for a, b in ((F(1), F(4)), (F(3, 2), F(9)), (F(5), F(5))):
        q = lambda theta, a=a, b=b: max(abs(1 - theta * a), abs(1 - theta * b))
        assert q(2 / (a + b)) == (b - a) / (b + a)
        assert all(q(F(n, 100)) >= (b - a) / (b + a) for n in range(1, 101))


def test_a_theta_that_may_diverge_is_infinitely_dear_and_an_empty_region_is_empty():
    box = Box(a=(1.0, 1.2), b=(8.0, 12.0))
    assert dearest(0.17, [box]) == math.inf
    assert dearest(0.14, [box]) < math.inf
    assert common([[box], [Box(a=(1.0, 1.2), b=(20.0, 30.0))]]) == []


# --- contact ---------------------------------------------------------------------------------------------------------


def test_a_run_that_has_arrived_while_its_ratios_still_rise_limits_the_ratio(tmp_path):
    series = [1.0]
    for n in range(26):
        series.append(series[-1] * 0.4 * (1 - 0.6 * math.exp(-n / 8)))
    (seen,) = vf.advise_logs([(precice(tmp_path / "a.log", [{"ResAbs(M:F)": series}]), "0.32")]).logs
    assert seen.slowest is not None
    assert seen.slowest.least < 0.4 * (1 - 0.6 * math.exp(-25 / 8)) <= seen.slowest.most
    assert seen.slowest.most >= 0.4
    jumping = [value * (1.5 if n % 3 == 0 else 1) for n, value in enumerate(series)]
    (seen,) = vf.advise_logs([(precice(tmp_path / "b.log", [{"ResAbs(M:F)": jumping}]), "0.32")]).logs
    assert seen.slowest is None


def test_a_run_that_converges_in_ten_steps_is_kept(tmp_path):
    found = vf.advise_logs(logged(tmp_path, (0.01, 0.1), (0.5, 0.93)))
    assert found.next.theta == 0.93
    assert found.next.why.startswith("keep it")


def test_after_two_runs_that_stay_at_a_level_a_quarter_comes_next(tmp_path):
    series = [1 + 0.3 * (-1) ** n for n in range(80)]
    logs = [(precice(tmp_path / f"{theta}.log", [{"ResAbs(M:F)": series}]), theta) for theta in ("0.5", "0.25")]
    assert vf.advise_logs(logs[:1]).next.theta == 0.25
    assert vf.advise_logs(logs).next.theta == 0.0625


def test_the_bodies_of_the_other_code_have_symmetric_matrices_and_feel_a_rigid_push(made):
    flat = made.block(-1, (70.0, 0.3), push=1.0)
    S = flat.stiffness
    assert np.abs(S - S.T).max() <= 1e-12 * np.abs(S).max()
    assert np.linalg.eigvalsh(S).min() > 0
    one, two = made.brick(1, (70.0, 0.3)), made.brick(1, (140.0, 0.3))
    assert np.allclose(two.stiffness, 2 * one.stiffness)
    assert not one.load.any()


def test_the_spectrum_of_a_tied_coupling_is_that_of_its_iteration(made):
    tied = next(iter(made.couplings()))
    (g, image), (other, its_image) = islice(tied.forces(0.3), 2)
    modes = np.linalg.eigvals(np.linalg.solve(tied.neumann.stiffness.T, tied.contact.stiffness.T).T).real
    assert modes.max() == pytest.approx(tied.spectrum[-1])
    assert np.allclose(other, g + 0.3 * (image - g))
    S_c, S_n = tied.contact.stiffness, tied.neumann.stiffness
    assert np.allclose(its_image - image, -S_c @ np.linalg.solve(S_n, other - g))


def test_the_contact_step_of_the_couplings_obeys_the_conditions_of_signorini(made):
    contact = next(one for one in made.couplings() if one.name.startswith("contact"))
    for _, image in islice(contact.forces(0.3), 6):
        force = contact.side * image
        assert force.max() <= 1e-9 * np.abs(force).max()
    states = [image for _, image in islice(contact.forces(0.3), 40)]
    pressed = np.abs(states[-1]) > 1e-9 * np.abs(states[-1]).max()
    assert 0 < pressed.sum() < len(pressed)


#: Tied in the plane, in contact in both dimensions, with friction: those that take the least time.
CHOSEN = (0, 3, 17, 29)


def test_following_the_logs_of_another_code_costs_at_most_1_4_times_the_fewest_steps(made, tmp_path):
    chosen = [one for i, one in enumerate(made.couplings()) if i in CHOSEN]
    found = list(made.followed(chosen, 0.5, tmp_path))
    assert [one.name for one in found if one.decided and one.steps is None] == []
    assert [one.name for one in found if not one.good] == []


def test_the_recorded_table_keeps_what_its_page_says():
    """Nine of ten within 1.4 times the fewest steps, and no theta that is advised diverges."""
    record = json.loads((BENCHMARKS / "records" / "advice" / "couplings.json").read_text("utf-8"))
    assert record["first"][0]["theta"] == 0.5
    for kind, body in itertools.product(("tied", "contact", "friction"), ("Neumann body 1", "Neumann body 2")):
        both = [one for one in record["first"][0]["couplings"] if one["name"].startswith(kind)]
        assert {one["noise"] for one in both if one["name"].endswith(body)} == {True, False}, (kind, body)
    for tried in record["first"]:
        rows = tried["couplings"]
        assert len(rows) == 50
        assert [one["name"] for one in rows if one["decided"] and one["steps"] is None] == []
        known = [one for one in rows if one["steps"] is not None]
        assert all(one["good"] == (one["decided"] and one["steps"] <= 1.4 * one["fewest"]) for one in known)
        assert all(len(one["runs"]) <= 1 + record["asked_for"] for one in rows)
        assert all(one["why"] for one in rows)
        rubbing = [one for one in rows if one["name"].startswith("friction") and one["decided"]]
        assert all(one["steps"] <= 2 * one["fewest"] for one in rubbing)
    assert sum(one["good"] for one in record["first"][0]["couplings"]) >= 45
    linear = [one for one in record["advice"] if one["linear"]]
    assert sum(one["verdicts"]["vectors"] == "right" for one in linear) >= 0.9 * len(linear)
    assert {one["verdicts"]["vectors"] for one in linear} <= {"right", "silent"}
    assert sum(one["method_good"] for one in linear) >= 0.9 * len(linear)
    assert all(one["verdicts"]["vectors"] != "wrong" for one in record["advice"])


def test_the_record_of_other_kinds_has_ten_of_each_and_no_theta_that_diverges():
    record = json.loads((BENCHMARKS / "records" / "advice" / "kinds.json").read_text("utf-8"))
    assert {kind: len(some) for kind, some in record["kinds"].items()} == {"general": 10, "parallel": 10}
    for some in record["kinds"].values():
        verdicts = [verdict for one in some for verdict in one["verdicts"].values()]
        assert "wrong" not in verdicts
        assert verdicts.count("right") >= 0.8 * len(verdicts)
        assert all(one["converged"] for one in some)
        assert sum(one["unseen"] for one in some) >= 4


def test_two_couplings_of_other_kinds_have_their_recorded_verdicts(made, monkeypatch):
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    bench = import_module("bench_kinds")
    record = json.loads((BENCHMARKS / "records" / "advice" / "kinds.json").read_text("utf-8"))["kinds"]
    for kind, some in (("general", bench.loops()), ("parallel", bench.at_once())):
        known = list(zip(some, record[kind], strict=True))
        for n in range(10) if AT_NIGHT else (3,):
            loop, recorded = known[n]
            assert bench.judged(loop, n if n % 2 else None)["verdicts"] == recorded["verdicts"], loop.name


@pytest.mark.parametrize("full", [False, True])
def test_a_record_of_some_first_thetas_alone_never_takes_the_place_of_all(made, tmp_path, monkeypatch, capsys, full):
    bench = import_module("bench_couplings")
    monkeypatch.setattr(bench, "followed", lambda *given: iter(()))
    monkeypatch.setattr(bench, "couplings", lambda: iter(()))
    monkeypatch.setattr(bench, "others", lambda: iter(()))
    monkeypatch.setattr("sys.argv", ["bench_couplings.py", "--record", str(tmp_path), *["--full"] * full])
    bench.main()
    found = [json.loads(path.read_text("utf-8")) for path in tmp_path.glob("advice/*.json")]
    assert [[row["theta"] for row in record["first"]] for record in found] == [[0.5, 0.1, 0.3, 0.9, 0.99]] * full
    assert ("no record" in capsys.readouterr().out) != full


# --- Aitken, friction ------------------------------------------------------------------------------------------------


def test_one_log_of_aitken_gives_a_theta_for_tied_couplings_of_every_kind(made, tmp_path):
    chosen = [coupling for coupling in islice(made.couplings(), 9) if coupling.tied][:: 1 if AT_NIGHT else 2]
    seeds = (2, 101) if AT_NIGHT else (2,)
    chosen += [kind(seed) for kind in (made.heat, made.lumped, made.convection) for seed in seeds]
    for coupling in chosen:
        log = made.aitken_log(coupling, 0.5, tmp_path / "a.csv")
        found = vf.advise_logs([(log, None)], tied=True)
        assert not found.accelerated[0].factors.doubt
        fewest, _ = made.fewest(coupling)
        assert 5 * made.steps(coupling, found.theta) <= 7 * fewest, coupling.name
        assert vf.advise_logs([(log, None)]).theta is None  # contact may change: a run to make


@pytest.mark.parametrize("first", [0.5, 1.0])
def test_a_frictional_coupling_gets_no_theta_that_costs_more_than_twice_the_best(made, tmp_path, first):
    """By day two of the six, others for each first theta; the recorded table has all."""
    plates = [coupling for coupling in made.couplings() if isinstance(coupling, made.Plates)]
    assert len(plates) == 6
    for coupling in plates if AT_NIGHT else plates[2 + (first == 1.0) :: 2]:
        log = made.log(coupling, min(first, coupling.largest), tmp_path / "f.log", None)
        rubbing = vf.advise_logs([(log, repr(min(first, coupling.largest)))], friction=True)
        assert (rubbing.theta, rubbing.roles) == (None, ())
        followed = made.follow(coupling, first, tmp_path, None)  # as if nobody had said that there is friction
        if followed.decided:
            assert followed.steps is not None, coupling.name
            assert followed.steps <= 2 * followed.fewest, coupling.name
