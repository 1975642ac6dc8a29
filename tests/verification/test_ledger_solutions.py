"""What the ledger says of solutions, of iterates and of Section 6."""

import itertools
import json
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from ledger_evidence import HOLDS, PRINTED, REPAIRED, STEP, holds

from verification.interface.assembly import build
from verification.ledger import experiments as section_6
from verification.ledger import solutions as ledger
from verification.ledger import sweeps as sweeps_of
from verification.ledger.evidence import settle
from verification.ledger.experiments import Stopped, experiments
from verification.ledger.solutions import solutions
from verification.ledger.sweeps import Best, Count, Model, Sweeps
from verification.monolithic import solve

EXPECTED = {
    "2.3": [(PRINTED, False), (REPAIRED, True)],
    "2.4": HOLDS,
    "2.6": HOLDS,
    "3.1.3": [(PRINTED, False), (REPAIRED, True)],
    "4.4": HOLDS,
    "4.5": HOLDS,
    "4.9.1": HOLDS,
    "4.9.2": [(PRINTED, False), (REPAIRED, True)],
    "4.9.3": HOLDS,
    "prop-5.1": [(STEP, True), (REPAIRED, True), (PRINTED, True)],
    "5.1": HOLDS,
    "5.2": HOLDS,
    "lemma-5.2": HOLDS,
    "5.3": HOLDS,
    "5.4": [(PRINTED, True), (PRINTED, True)],
    "5.5": HOLDS,
    "5.6": HOLDS,
    "thm-5.9.1": [(PRINTED, True), (REPAIRED, True)],
    "thm-5.9.2": [(PRINTED, True), (REPAIRED, True)],
}
OF_SECTION_6 = {
    "sec-6.2": HOLDS,
    "fig-5": [(PRINTED, None)],
    "sec-6.3-stop": [(PRINTED, False), (REPAIRED, True)],
    "sec-6.3": [(PRINTED, None)],
    "fig-10": HOLDS,
    "fig-11": HOLDS,
    "fig-12": [(PRINTED, False)],
}


@pytest.fixture(scope="module")
def found(evidence):
    return evidence("solutions")[0]


@pytest.fixture(scope="module")
def seen(evidence):
    return evidence("experiments of Section 6")[0]


@pytest.mark.parametrize("statement", EXPECTED)
def test_a_statement_about_solutions_gets_its_evidence(found, statement):
    assert holds(found[statement]) == EXPECTED[statement]


def test_every_check_of_solutions_and_of_section_6_is_expected():
    assert set(ledger.CHECKS) == set(EXPECTED)
    assert set(section_6.CHECKS) == set(OF_SECTION_6)


@pytest.mark.parametrize("statement", OF_SECTION_6)
def test_a_result_of_section_6_gets_its_evidence(seen, statement):
    assert holds(seen[statement]) == OF_SECTION_6[statement]


def test_evidence_is_plain_data_and_repeats_itself(found):
    text = json.dumps([e.to_dict() for e in found["4.9.2"]], allow_nan=False)
    assert json.dumps([e.to_dict() for e in solutions(["4.9.2"])["4.9.2"]]) == text


def test_floating_point_proves_nothing(found, seen):
    verdicts = {settle(evidence)[0] for evidence in (*found.values(), *seen.values())}
    assert verdicts == {"NUMERICAL", "REFUTED", "INCONCLUSIVE"}


def test_only_what_is_asked_is_answered_and_the_share_done_is_told():
    shares = []
    assert set(solutions(["2.4", "5.6", "fig-5"], "quick", shares.append)) == {"2.4", "5.6"}
    assert shares == [0, 0.5, 1]


# Section 6.


def test_the_model_has_nearly_the_numbers_of_nodes_of_the_paper():
    pairs = [build(Model(halvings=h).problem) for h in range(4)]
    nodes = [len(pair.body1.body.mesh.points) + len(pair.body2.body.mesh.points) for pair in pairs]
    assert nodes == [54, 170, 594, 2210]  # 60, 190, 666, 2482 in the paper


def test_a_run_that_stops_early_does_not_give_the_same_results():
    problem = Model().problem
    loose = replace(problem, iteration=replace(problem.iteration, tolerance=1e-5))
    assert section_6.difference(build(loose)) > sweeps_of.SAME
    tight = replace(problem, iteration=replace(problem.iteration, tolerance=1e-12))
    assert section_6.difference(build(tight)) < 1e-10


def test_the_increment_is_theta_times_the_unrelaxed_residual():
    run = sweeps_of.trace(build(Model().problem), 0.3, 20)
    for n in range(1, 20):
        step = np.linalg.norm(run.g[n] - run.g[n - 1])
        assert step == pytest.approx(0.3 * run.residuals[n - 1] * np.linalg.norm(image(run, n, 0.3)), rel=1e-9)


def image(run, n, theta):
    """T g_{n-1} from two consecutive forces."""
    return (run.g[n] - (1 - theta) * run.g[n - 1]) / theta


def test_steps_are_counted_by_interpolation():
    assert sweeps_of.steps_to([1.0, 1e-4, 1e-8], 1e-6) == pytest.approx(1.5)
    assert sweeps_of.steps_to([1.0, 0.1], 1e-6) is None


def test_equal_moduli_give_the_same_steps_whatever_their_size():
    # 0.2e3 in Section 6.3 is most likely 0.2e5; only the quotient matters
    counts = []
    for young in (Fraction(200), Fraction(20000)):
        pair = build(Model(young=(young, young), halvings=0).problem)
        counts.append(sweeps_of.trace(pair, 0.5).stop(absolute=False))
    assert counts[0] == counts[1]


def test_zones_are_read_from_left_to_right():
    x = np.array([0.4, 0.8, 1.0, 1.4, 1.6])
    found = section_6.zones(x, ["stick", "stick", "slip", "slip", "open"])
    assert section_6.as_printed(found, 0.2)
    assert not section_6.as_printed(found, 0.1)
    assert not section_6.as_printed(section_6.zones(x, ["stick"] * 5), 0.2)


def test_the_zones_of_mirrored_readings_mirror_each_other(seen):
    readings = {(r["geometry"], r["u_x on the top"]): r["zones"] for r in seen["fig-5"][0].data["readings"]}
    # P1 triangles are not symmetric: up to one cell
    right = readings["right edges aligned", "held"]
    left = [
        {"state": z["state"], "from": 1.2 - z["to"], "to": 1.2 - z["from"]}
        for z in reversed(readings["left edges aligned", "held"])
    ]
    assert [z["state"] for z in left] == [z["state"] for z in right]
    assert all(abs(a["to"] - b["to"]) <= 0.1 + 1e-9 for a, b in zip(left, right, strict=True))


class Made(Sweeps):
    """Sweeps of given numbers of steps."""

    def __init__(self, steps):
        super().__init__("quick")
        self.counts = lambda model: {
            theta: Count(increment=steps(model)(float(theta)), residual=None) for theta in self.thetas
        }
        self.row = lambda model: {
            "best_theta": float(self.best(model).theta),
            "iterations": self.best(model).steps,
            "iterations_at_0.6": 1,
        }
        self.rho = lambda model: 1.0


def of_figure_11(shift):
    """What is said of figure 11 where the best theta of the largest friction is `shift` of a geometry from the others'.

    At its best theta every model takes 20 steps.
    """
    valley = lambda best: lambda theta: 20 + 400 * (theta - best) ** 2
    steps = lambda model: valley(0.5 + (model.friction == Fraction(2, 5)) * shift(model.geometry))
    sweeps = Made(steps)
    assert sweeps.best(Model(friction=Fraction(1, 10))) == Best(theta=Fraction(1, 2), steps=20)
    (evidence,) = section_6.CHECKS["fig-11"](sweeps)
    return evidence.holds


@pytest.mark.parametrize(("shift", "verdict"), [(0.05, True), (0.4, False)])
def test_whether_one_theta_serves_is_found_out(shift, verdict):
    assert of_figure_11(lambda geometry: shift) is verdict


def test_readings_that_differ_decide_nothing():
    assert of_figure_11(lambda geometry: 0.4 * (geometry == sweeps_of.TWO[0])) is None


@pytest.mark.parametrize(("shows", "verdict"), [((True,), True), ((True, False), None), ((False,), None)])
def test_figure_5_holds_where_every_reading_shows_its_zones_and_no_reading_refutes_it(monkeypatch, shows, verdict):
    """The paper's bodies are not known in full: a reading that shows other zones may not be theirs."""
    answers = itertools.cycle(shows)
    monkeypatch.setattr(section_6, "as_printed", lambda found, width: next(answers))
    (evidence,) = experiments(["fig-5"])["fig-5"]
    assert evidence.holds is verdict


def test_the_best_theta_holds_where_it_serves_every_reading(monkeypatch):
    steps = {"iterations": 20, "iterations_at_0.6": 21}
    told = {"geometry": "made", "neumann_body": 1, "E1": 7e4, "E2": 2e4, "best_theta": 0.65}
    sweeps = Made(None)
    sweeps.row = lambda model: told | steps
    claim = section_6.CHECKS["sec-6.3"]
    assert claim(sweeps)[0].holds is True
    steps["iterations_at_0.6"] = 40
    assert claim(sweeps)[0].holds is None
    steps["iterations_at_0.6"] = None
    assert claim(sweeps)[0].holds is None


def test_figure_12_says_which_readings_were_tried_and_what_each_gave(seen):
    (evidence,) = seen["fig-12"]
    rows = evidence.data["rows"]
    assert len(rows) == 4
    for name, family in rows.items():
        best = ", ".join(f"{row['best_theta']:g}" for row in family)
        at = ", ".join(f"{row['iterations_at_0.6'] or 'none'}" for row in family)
        assert f"{name}: best {best} (" in evidence.text
        assert f"{name}: {at}" in evidence.text
    assert "tried are 4 readings of the geometry and of the roles, with the top held and k = 0.2" in evidence.text
    assert evidence.text.endswith(f"{family[0]['nodes']} nodes")


def ends(residual_slow, residual_fast, steps_in_tpa):
    at = lambda steps, residual: Stopped(steps=steps, residual=residual, error=residual)
    return {
        (section_6.SLOW, "MPa"): at(300, residual_slow),
        (section_6.SLOW, "TPa"): at(300, residual_slow),
        (section_6.FAST, "MPa"): at(20, residual_fast),
        (section_6.FAST, "TPa"): at(steps_in_tpa, residual_fast),
    }


@pytest.mark.parametrize(
    ("runs", "verdict"),
    [
        (ends(9e-10, 8e-10, 20), True),
        (ends(2e-8, 8e-10, 20), False),  # a small theta stops earlier
        (ends(9e-10, 8e-10, 14), False),  # the unit of force changes the number of steps
    ],
)
def test_a_test_measures_the_error_if_neither_theta_nor_the_unit_matters(monkeypatch, runs, verdict):
    names = {size: name for name, size in section_6.UNITS.items()}
    fair = ends(9e-10, 8e-10, 20)
    monkeypatch.setattr(section_6, "stopped", lambda model, *at: tuple(r[at[0], names[at[1]]] for r in (runs, fair)))
    assert holds(section_6.CHECKS["sec-6.3-stop"](Made(None))) == [(PRINTED, verdict), (REPAIRED, True)]


def test_the_increment_test_hides_the_factor_one_over_theta(seen):
    runs = seen["sec-6.3-stop"][0].data["runs"]
    slow = runs["theta 0.05, MPa"]
    # the last increment is at most 1e-9, and theta times the residual before it
    assert 0.9e-9 / 0.05 < slow["residual"] < 1e-9 / 0.05
    assert slow["error"] > 10e-9


def test_a_global_solution_gives_the_zones(seen):
    contact = solve(Model(halvings=2).problem).contact
    told = seen["fig-5"][0].data["readings"][0]["zones"]
    assert section_6.zones(contact.x, contact.status) == told
