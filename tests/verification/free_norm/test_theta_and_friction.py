"""The record of best thetas over friction: it is what the library computes, and its claims are in order."""

import json
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from strategies import AT_NIGHT

import verification as vf
from verification.free_norm.norm import NEAR

BENCHMARKS = Path(__file__).parents[3] / "benchmarks"
BEST, CURVES = (
    json.loads((BENCHMARKS / "records" / "theta" / name).read_text("utf-8")) for name in ("best.json", "curves.json")
)
POINTS = {(case["name"], at["k"]): at for case in BEST["cases"] for at in case["points"]}

#: A search for a norm ends this close to its border, relatively; on another machine elsewhere.
CLOSE = 2 * NEAR


@pytest.fixture
def bench(monkeypatch):
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    return import_module("best_theta")


def test_the_record_has_every_pair_at_every_friction(bench):
    frictions = [float(k) for k in bench.FRICTIONS]
    assert {case["name"]: [at["k"] for at in case["points"]] for case in BEST["cases"]} == dict.fromkeys(
        bench.cases(), frictions
    )
    for case in BEST["cases"]:
        assert (case["title"], case["predicted"]) == (
            bench.cases()[case["name"]].title,
            bench.predicted(bench.cases()[case["name"]]),
        )
    assert CURVES["case"] == bench.SHOWN
    assert [at["k"] for at in CURVES["curves"]] == [float(k) for k in bench.POSITIONS]
    assert CURVES["thetas"] == list(bench.GRID[1::2])


@pytest.mark.skipif(not AT_NIGHT, reason="seven seconds and more for each point: by night")
@pytest.mark.parametrize(("name", "k"), list(POINTS))
def test_best_thetas_are_found_again(bench, name, k):
    """By the whole search; a theta may move by one of the grid where the factor is flat."""
    known, found = POINTS[name, k], bench.point(bench.cases()[name], f"{k:g}")
    for way in ("energy", "free", "waves"):
        if known[way] is None:
            assert found[way] is None
            continue
        assert found[way]["theta"] == pytest.approx(known[way]["theta"], abs=1.01 / 40)
        assert found[way]["factor"] == pytest.approx(known[way]["factor"], rel=1e-3 if way == "energy" else CLOSE)
    assert found["runs"] == known["runs"]
    if (found["free"] or {}).get("theta") == (known["free"] or {}).get("theta"):
        assert found["no_less"] == pytest.approx(known["no_less"], rel=1e-2)


@pytest.mark.parametrize("name", [case["name"] for case in BEST["cases"]] if AT_NIGHT else ["section-6-7"])
def test_thetas_beside_the_best_one_have_no_smaller_factor(bench, name):
    case = bench.cases()[name]
    for k in (0.2, 0.8):
        pair, at = case.pair.at(friction=k), POINTS[name, k]
        for way, factor, allowed in (("energy", bench.energy_factor, 1e-4), ("free", bench.free_factor, CLOSE)):
            if at[way] is None:
                assert factor(pair, bench.GRID[0]) > 1
                continue
            place = bench.GRID.index(at[way]["theta"])
            beside = [factor(pair, theta) for theta in bench.GRID[max(place - 1, 0) : place + 2]]
            least = min(value for value in beside if value is not None)
            assert least == pytest.approx(at[way]["factor"], rel=allowed)


# By another program for norms and multipliers, in plain numpy, on the smallest mesh: theta and factor in (5.21), and in
# a free norm.  They are not all best thetas: its thetas began at 0.6.
OTHER = {
    0.1: ((0.85, 0.274), (0.85, 0.209)),
    0.2: ((0.85, 0.435), (0.85, 0.244)),
    0.4: ((0.70, 0.752), (0.80, 0.300)),
    0.8: ((0.60, 1.216), (0.80, 0.398)),
    1.6: ((0.60, 2.24), (0.70, 0.602)),
}


@pytest.mark.parametrize("k", OTHER)
def test_the_curves_agree_with_another_program(k):
    (at,) = (curve for curve in CURVES["curves"] if curve["k"] == k)
    for way, (theta, factor) in zip(("energy", "free"), OTHER[k], strict=True):
        assert at[way][CURVES["thetas"].index(theta)] == pytest.approx(factor, rel=6e-3)


@pytest.mark.parametrize("at", CURVES["curves"] if AT_NIGHT else CURVES["curves"][4:5], ids=lambda at: f"k = {at['k']}")
def test_curves_are_found_again(bench, at):
    case, thetas = bench.cases()[bench.SHOWN], CURVES["thetas"]
    some = thetas if AT_NIGHT else [thetas[round(13 * at["k"]) % len(thetas)]]
    found = bench.curves(case, f"{at['k']:g}", some)
    for way in ("energy", "free", "waves", "runs", "no_less"):
        expected = [at[way][thetas.index(theta)] for theta in some]
        assert found[way] == pytest.approx(expected, rel=CLOSE if way != "energy" else 1e-3)


@pytest.mark.parametrize("at", CURVES["curves"], ids=lambda at: f"k = {at['k']}")
def test_no_curve_goes_below_what_no_norm_does_and_each_falls_and_then_rises(at):
    """The square of the factor in (5.21) is convex; that the others have one least value is what the search assumes."""
    energy, free, least = (np.array(at[way]) for way in ("energy", "free", "no_less"))
    assert (least <= free * (1 + 1e-3)).all()
    assert (free <= energy * (1 + CLOSE)).all()
    assert (np.array(at["runs"]) <= free * (1 + 1e-3)).all()
    assert (np.diff(energy**2, 2) > -1e-3).all()
    for values in (energy, free, np.array(at["waves"])):
        bottom = int(values.argmin())
        assert (np.diff(values[: bottom + 1]) < 0).all()
        assert (np.diff(values[bottom:]) > 0).all()


def test_the_search_for_the_best_theta_ends_where_the_whole_curve_is_least():
    for at in CURVES["curves"]:
        if at["k"] not in OTHER:
            continue
        point = POINTS[CURVES["case"], at["k"]]
        for way in ("energy", "free"):
            factor = min(at[way])
            if factor >= 1:
                assert point[way] is None
                continue
            theta = CURVES["thetas"][at[way].index(factor)]
            assert abs(point[way]["theta"] - theta) < 0.051
            assert factor * (1 - 0.08) < point[way]["factor"] <= factor * (1 + CLOSE)


@pytest.mark.parametrize(("best", "largest"), [(0.3, 0.7), (0.025, 0.05), (0.975, 1.0), (0.1, 0.125)])
def test_a_least_factor_beside_thetas_without_one_is_found(bench, best, largest):
    v = lambda theta: None if theta > largest + 1e-9 else 0.5 + 0.4 * abs(theta - best)
    assert bench.least(v) == {"theta": best, "factor": 0.5}
    assert bench.least(lambda theta: None) is None
    assert bench.least(lambda theta: 1 + theta) is None


def test_no_norm_contracts_for_equal_blocks_with_much_friction(bench):
    """A product of pieces expands at the least theta, so no larger theta contracts; runs under two loads converge."""
    at = POINTS["equal-blocks", 1.6]
    assert (at["energy"], at["free"]) == (None, None)
    assert at["no_less"] > 1
    if AT_NIGHT:
        pair = bench.cases()["equal-blocks"].pair.at(friction=1.6)
        assert 1 < bench.no_less(pair, bench.GRID[0]) == pytest.approx(at["no_less"], abs=1e-3)
    for problem in bench.cases()["equal-blocks"].loads.values():
        assert vf.run(problem.changed(friction="1.6"), theta="0.275").converged
