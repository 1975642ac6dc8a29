"""Runs with friction: no bound of rho is claimed, what is claimed holds, and the runs lead to a fast theta."""

import math
from dataclasses import replace
from fractions import Fraction as F
from itertools import pairwise

import numpy as np
import pytest
from coupling_logs import contact_run, precice
from hypothesis import given
from hypothesis import strategies as st
from strategies import AT_NIGHT

import verification as vf
from verification.coupling.readings import Observed
from verification.coupling.runs_with_friction import friction_bounds, least_rate, next_with_friction
from verification.show.layout import text

THETAS, RATIOS = st.fractions(F(1, 10**4), 1), st.fractions(F(1, 1000), 20)


def steady(folder, ratios, steps=200):
    """Logs that change by a steady ratio at each theta."""
    return [
        (precice(folder / f"{theta}.log", [{"ResAbs(M:F)": [r**n for n in range(steps)]}]), theta)
        for theta, r in ratios.items()
    ]


# --- what is said ----------------------------------------------------------------------------------------------------


def test_a_converging_log_with_friction_is_not_read_as_a_large_rho(tmp_path):
    """0.9022 and 0.711 a step are a coupling with rho = 0.97, which was read as 4.4 and slowed down by 2.7."""
    logs = steady(tmp_path, {"0.1": 0.9022, "0.3146": 0.711})
    found = vf.advise_logs(logs, friction=True)
    assert (found.roles, found.theta, found.quote) == ((), None, None)
    assert (found.interval.lo, found.interval.hi, found.interval.contradiction) == (None, None, None)
    assert {(one.value, one.lo) for one in (*found.readings, *found.logs[0].readings)} == {(None, None)}
    assert found.next.theta > 0.3146
    assert "friction" in found.assumes
    assert "friction" in found.why_no_theta
    plain = vf.advise_logs(logs)
    assert plain.roles
    assert plain.assumes == "no friction, or a tied interface"
    assert plain.summary.startswith("assumed: no friction, or a tied interface; ")
    assert plain.quote.startswith("Assumed: no friction, or a tied interface. ")


@given(THETAS, RATIOS)
def test_no_ratio_bounds_rho_or_decides_a_theta_with_friction(theta, r):
    found = vf.advise_run(theta, r, friction=True)
    assert found.roles == ()
    assert found.theta is None
    assert all(one.value is None and one.lo is None and "proved" not in one.says for one in found.readings)
    assert found.next.kept or found.next.theta != float(theta)
    bounds = found.friction_bounds
    exactly = 1 - (1 - r) / theta
    if bounds.image is None:
        assert exactly <= 0
    else:
        assert F(bounds.image) <= max(exactly, 1 if r >= F(9, 10) else 0)
        assert 1 - theta + theta * F(bounds.image) <= max(r, 1)
    if bounds.eigenvalue is not None:
        least, most = map(F, bounds.eigenvalue)
        assert least <= (1 - r) / theta
        assert most >= (1 + r) / theta
        assert F(bounds.rate) >= r


def test_a_run_that_does_not_converge_has_an_image_of_1_at_least_and_bounds_are_rounded_outwards():
    level = friction_bounds([], [(F(1, 3), None)])
    assert (level.image, level.theta, level.rate, level.eigenvalue) == (1.0, None, None, None)
    assert set(level.to_dict()["reason"]) == {"theta", "rate", "eigenvalue"}
    seen = Observed(value=F(9, 10), least=F(8, 9), most=F(10, 11))
    found = friction_bounds([(F(1, 3), seen), (F(1, 7), replace(seen, moves=True))], [])
    assert found.theta == 1 / 3  # the largest that falls
    moves = friction_bounds([(F(1, 3), replace(seen, moves=True)), (F(1, 7), seen)], [])
    assert (moves.image, moves.theta, moves.rate, moves.eigenvalue) == (found.image, None, None, None)
    assert F(found.image) <= 1 - (1 - F(8, 9)) * 3 < F(math.nextafter(found.image, 2))
    least, most = map(F, found.eigenvalue)
    assert least <= 3 * F(1, 11) < F(math.nextafter(float(least), 9))
    assert most >= 3 * F(21, 11) > F(math.nextafter(float(most), 0))
    assert friction_bounds([(F(1, 3), Observed.known(F(2, 3)))], []).image is None


def test_of_ratios_that_still_rise_nothing_is_estimated_and_what_is_estimated_says_so(tmp_path):
    """Modes of 0.41 and 0.58 a step, the slower one small at first: the ratio so far was said to prove a bound."""
    advised = lambda series: vf.advise_logs(
        [(precice(tmp_path / "a", [{"ResAbs(M:F)": series}]), "0.85")], friction=True
    )
    screen = lambda found: " ".join(text(found.sections()).split())
    rising = advised([0.41**n + 3e-3 * 0.58**n for n in range(21)])
    assert rising.logs[0].slowest.moves
    bounds = rising.friction_bounds
    assert (bounds.theta, bounds.rate, bounds.eigenvalue) == (None, None, None)
    assert bounds.image > 0
    assert "Estimated" not in screen(rising)
    settled = advised([0.58**n for n in range(40)])
    assert settled.friction_bounds.rate == pytest.approx(0.58, rel=1e-3)
    assert not settled.logs[0].slowest.moves
    said = screen(settled).partition("WHAT IS PROVED OR ESTIMATED WITH FRICTION?")[2]
    proved, estimated = said.split("Estimated, of the modes seen at theta = 0.85, if the ratio is the limit")
    assert "of the log, if absolute; if residuals go on so" in proved
    assert "|1 + lambda|" not in proved
    assert "More steps may show slower modes." in estimated
    assert "Nothing: no residual falls, or the ratio of the largest theta has not settled." in screen(
        advised([0.1**n for n in range(5)])
    )


def test_tied_with_friction_is_refused(tmp_path):
    for call in (
        lambda: vf.advise_run("0.1", "0.9", tied=True, friction=True),
        lambda: vf.advise_logs(steady(tmp_path, {"0.1": 0.9}), tied=True, friction=True),
    ):
        with pytest.raises(ValueError, match="tied with friction"):
            call()


# --- what holds ------------------------------------------------------------------------------------------------------


@given(
    st.lists(st.tuples(st.floats(0.05, 20), st.floats(-1.4, 1.4)), min_size=1, max_size=8),
    st.lists(st.integers(1, 60), min_size=2, max_size=5, unique=True),
)
def test_no_theta_beats_what_convexity_leaves_of_complex_modes(polar, hundredths):
    modes = [r * complex(math.cos(phi), math.sin(phi)) for r, phi in polar]
    q = lambda theta: max(abs(1 - theta * z) for z in modes)
    runs = [(n / 100, q(n / 100)) for n in hundredths]
    points = [(0.0, 1.0, 1.0), *((theta, ratio, ratio) for theta, ratio in runs)]
    assert least_rate([*points, *points], 0.5) == least_rate(points, 0.5)  # the same run twice
    for theta in np.linspace(0.001, 0.99, 30):
        assert least_rate(points, float(theta)) <= q(theta) + 1e-9
    for theta, ratio in runs:
        for share in (0.1, 0.5, 0.9):  # what is said of a smaller theta
            assert q(share * theta) <= 1 - (1 - ratio) * share + 1e-12


def test_a_fastest_run_is_kept_where_no_theta_can_take_1_4_times_fewer_steps():
    seen = lambda *runs: [(F(theta), Observed.known(F(ratio))) for theta, ratio in runs]
    found = next_with_friction(seen(("0.4", "0.65"), ("0.5", "0.6"), ("0.6", "0.7")), [])
    assert (found.theta, found.kept) == (0.5, True)
    assert "keep it" in found.why
    wider = next_with_friction(seen(("0.1", "0.9"), ("0.5", "0.6"), ("0.9", "0.97")), [])
    assert not wider.kept
    assert 0.1 < wider.theta < 0.5  # the wider gap
    assert next_with_friction(seen(("0.1", "0.9"), ("0.2", "0.8")), [F(9, 10)]).theta > 0.2
    assert next_with_friction(seen(("0.5", "0.505")), [F(11, 20)]).kept  # the next one does not converge
    assert next_with_friction(seen(("0.5", "0.6")), [F(11, 20)]).theta == 0.25  # slower than open nodes
    assert next_with_friction(seen(("0.5", "0.1")), []).kept
    near = next_with_friction(seen(("0.1", "0.9"), ("0.2", "0.8")), [F(3, 10), F(9, 10)])
    assert 0.1 < near.theta < 0.3  # the next run above counts, not the largest
    tight = next_with_friction(seen(("0.46", "0.218"), ("0.5", "0.15")), [F(11, 20)])
    assert tight.kept  # although a steep line would allow a faster theta
    assert "leave no room" in tight.why
    assert next_with_friction([], [F(1, 2)]).theta == 0.25
    assert next_with_friction([], [F(1, 2), F(1, 4)]).theta == 0.0625
    assert next_with_friction(seen(("0.3", "0.9")), []).theta < 0.3  # slower than open nodes
    assert next_with_friction(seen(("0.3", "0.7")), []).theta > 0.3


#: Young's moduli of the two plates, and which one is the Neumann body.
PLATES = [((7e4, 2e4), 1), ((2e4, 2e4), 2), ((2e4, 7e4), 1), ((1e3, 5e4), 2)]


@pytest.mark.parametrize(
    ("young", "neumann_body", "friction"),
    [(*plate, k) for i, plate in enumerate(PLATES) for k in (("0.2", "1") if AT_NIGHT else (("0.2", "1")[i % 2],))],
)
def test_runs_with_friction_lead_to_a_fast_theta_and_what_they_prove_holds(tmp_path, young, neumann_body, friction):
    problem = vf.example("section6").changed(young=young, cells=((10, 2), (6, 2)), friction=friction)
    pair = vf.build(problem.changed(neumann_body=neumann_body))
    energy = vf.measure(pair).energy_constants()
    rho, kappa_1, kappa_2 = map(float, (energy.rho, energy.kappa_1, energy.kappa_2))
    s = math.sqrt(rho) + kappa_1
    most = math.sqrt(rho) * (s + math.sqrt(s**2 + 4 * kappa_2)) / 2
    theta, logs = 0.5, []
    for n in range(10):
        series, _ = contact_run(pair, theta, 60 + 3 * max(10, math.ceil(5 / theta)))
        logs.append((precice(tmp_path / f"{n}.log", [{"ResAbs(M:F)": series}]), repr(theta)))
        found = vf.advise_logs(logs, friction=True)
        assert found.roles == ()
        assert found.friction_bounds.image is None or found.friction_bounds.image <= most * (1 + 1e-9)
        if found.next.kept:
            break
        theta = found.next.theta
    assert found.next.kept
    count = lambda theta: next((n for n, r in enumerate(contact_run(pair, theta, 400)[1], 1) if r < 1e-8), math.inf)
    fewest = min(count(found.next.theta * share) for share in (0.5, 0.7, 0.85, 1, 1.15) if found.next.theta * share < 1)
    assert count(found.next.theta) <= 1.4 * fewest


def test_a_ratio_of_a_run_with_friction_may_exceed_what_rho_allows_without():
    """The bound (1 + r)/theta - 1 <= rho is false with friction: the counterexample that the pages name."""
    pair = vf.build(vf.example("section6").changed(cells=((10, 2), (6, 2)), friction="0.2"))
    rho = vf.measure(pair).rho_max.value
    theta = 0.1
    series, _ = contact_run(pair, theta, 120)
    ratios = [b / a for a, b in pairwise(series)][50:110]
    r = math.exp(np.mean(np.log(ratios)))
    assert r > 1 - theta
    assert (1 + r) / theta - 1 > 2 * rho


@pytest.mark.parametrize("theta", ["0.02", "0.1", "0.6"])
def test_the_next_run_with_friction_is_explained_by_where_it_lies(theta):
    found = vf.advise_run(theta, "0.3", friction=True).next
    where = "larger" if found.theta > float(theta) else "smaller"
    assert found.why.startswith(f"{where} than {theta}")
    risk = f"; it may diverge there; {theta} falls in its log, and near that solution a smaller theta does too" * (
        where == "larger"
    )
    assert found.why.endswith(f"that run shows whether a {where} one is faster{risk}")
