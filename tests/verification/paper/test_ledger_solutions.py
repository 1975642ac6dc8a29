"""What the ledger says of solutions, of iterates and of Section 6."""

import json
from fractions import Fraction

import pytest
from ledger_evidence import HOLDS, PRINTED, REPAIRED, STEP, holds

from ndtheory.statements import statements
from verification.algorithm.monolithic import solution_force, solve
from verification.interface.pair import pair_from
from verification.ledger import experiments as section_6
from verification.ledger import solutions as ledger
from verification.ledger.evidence import settle
from verification.ledger.experiments import Section6, StoppedRuns
from verification.ledger.sheets import outcome
from verification.ledger.solutions import solutions
from verification.problem import Problem
from verification.reproduce import READINGS
from verification.reproduce.claims import NODES, zones, zones_hold
from verification.sweeps.sweep import sweep

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
    "fig-5": HOLDS,
    "sec-6.3": HOLDS,
    "fig-10": HOLDS,
    "fig-11": HOLDS,
    "fig-12": [(PRINTED, None)],
    "sec-7": [(PRINTED, None)],
    "x-no-theta-for-all-moduli": HOLDS,
    "x-increment-test": [*HOLDS, *HOLDS],
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

of = lambda section, id: section_6.CHECKS[id](section)[0]


def made(valley, outcome="converged"):
    """Rows of sweeps that nobody ran: ``valley(reading, values)`` maps theta to steps."""

    def run(reading, values):
        steps = valley(reading, values)(float(values["theta"])) if outcome == "converged" else None
        why = None if outcome == "converged" else "made so"
        return {"theta": float(values["theta"]), "iterations": steps, "iterations_paper": steps, "rho": 1.0} | {
            "outcome": outcome,
            "reason": why,
        }

    return run


def at(best):
    """20 steps at the best theta, and three times as many at a distance of 0.3."""
    return lambda theta: round(20 + 450 * (theta - best) ** 2)


#: A claim on one mesh, and one on all.
IDS = ["sec-6.3", "fig-10"]
OF_TEXT = [reading for reading in READINGS if not reading.departs]
ALL = len(READINGS)


@pytest.mark.parametrize("id", IDS)
def test_what_every_reading_shows_is_numerical_and_said_to_be_reproduced(id):
    evidence = of(Section6("full", run=made(lambda reading, values: at(0.6))), id)
    assert evidence.holds is True
    assert f"reproduced in every reading that leaves the text nowhere, and in {ALL} of the {ALL}" in evidence.text
    assert settle([evidence])[0] == "NUMERICAL"


@pytest.mark.parametrize("id", IDS)
def test_what_one_reading_shows_is_numerical_under_what_that_reading_assumes(id):
    shows = READINGS[-1]
    evidence = of(Section6("full", run=made(lambda reading, values: at(0.6 if reading == shows else 0.3))), id)
    assert evidence.holds is True
    assert f"reproduced under an assumption, in 1 of the {ALL} readings tried" in evidence.text
    for words in [*shows.assumes, *shows.departs]:
        assert words in evidence.text
    assert [found["holds"] for found in evidence.data["readings"]].count(True) == 1


@pytest.mark.parametrize("id", IDS)
def test_what_no_reading_shows_is_undecided_and_the_nearest_reading_is_named(id):
    near = READINGS[7]
    evidence = of(Section6("full", run=made(lambda reading, values: at(0.45 if reading == near else 0.3))), id)
    assert evidence.holds is None
    assert settle([evidence])[0] == "INCONCLUSIVE"
    assert f"in none of the {ALL} readings tried; " in evidence.text
    assert f"nearest comes {near.name}: theta = 0.6 takes 30 steps" in evidence.text
    assert {found["holds"] for found in evidence.data["readings"]} == {False}


def test_of_a_figure_of_all_meshes_quick_runs_them_until_one_reading_shows_it():
    show = READINGS[3:5]
    run = made(lambda reading, values: at(0.6 if reading in show else 0.3))
    quick, full = (of(Section6(level, run=run), "fig-10") for level in ("quick", "full"))
    assert (quick.holds, full.holds) == (True, True)
    assert f"in 1 of the {ALL} readings tried, and undecided in 1:" in quick.text
    assert f"in 2 of the {ALL} readings tried:" in full.text
    refuted = of(Section6("quick", run=made(lambda reading, values: at(0.3))), "fig-10")
    assert f"in none of the {ALL} readings tried" in refuted.text


def test_quick_and_full_agree_on_a_figure_that_only_finer_meshes_refute():
    coarse = lambda reading, values: at(0.6 if values["refine"] == 1 else 0.3)
    quick, full = (of(Section6(level, READINGS[:5], run=made(coarse)), "fig-10") for level in ("quick", "full"))
    assert (quick.holds, full.holds) == (None, None)
    assert "in none of the 5 readings tried" in quick.text
    assert quick.text == full.text


def test_one_curve_of_a_figure_that_0_6_does_not_serve_is_enough_against_a_reading():
    strong = lambda reading, values: at(0.3 if values.get("friction") == Fraction(2, 5) else 0.6)
    section = Section6("quick", run=made(strong))
    assert of(section, "fig-11").holds is None
    assert of(section, "fig-12").holds is True
    assert of(section, "sec-6.3").holds is True


@pytest.mark.parametrize("outcome", ["refused", "error"])
def test_runs_that_fail_show_nothing_and_refute_nothing(outcome):
    evidence = of(Section6("quick", run=made(None, outcome)), "fig-11")
    assert evidence.holds is None
    assert f"in none of the {ALL} readings tried, {ALL} of which are refused" in evidence.text
    assert {found["reason"]["holds"] for found in evidence.data["readings"]} == {"made so"}


def test_one_theta_for_all_moduli_is_refuted_by_two_curves_that_share_none_and_never_shown():
    turned = lambda best: lambda reading, values: at(best if "young" in values else 0.6)
    id = "x-no-theta-for-all-moduli"
    assert of(Section6("quick", run=made(turned(0.3))), id).holds is True
    assert of(Section6("quick", run=made(turned(0.65))), id).holds is None
    assert of(Section6("quick", run=made(None, "error")), id).holds is None


def test_section_7_is_shown_by_a_reading_that_shows_its_three_figures_and_refuted_by_none():
    best = lambda reading, values: at(0.3 if "young" in values and reading == READINGS[0] else 0.6)
    both = Section6("full", READINGS[:2], run=made(best))
    assert of(both, "sec-7").data["readings"] == [READINGS[1].name]
    assert of(both, "sec-7").holds is True
    evidence = of(Section6("full", READINGS[:1], run=made(best)), "sec-7")
    assert evidence.holds is None
    assert "fig12 is not reproduced; all three are shown by 0 of the 1 readings tried" in evidence.text
    assert settle([evidence])[0] == "INCONCLUSIVE"


STIFF_ABOVE = "whole top clamped, Neumann body upper, moduli exchanged"


@pytest.mark.parametrize("id", ["sec-6.3", "fig-10", "fig-11"])
def test_0_6_serves_where_the_upper_body_is_the_stiff_one_and_has_the_neumann_problem(seen, id):
    (evidence,) = seen[id]
    held = {found["reading"]: found["holds"] for found in evidence.data["readings"]}
    assert len(held) == ALL
    shown = {name for name, holds in held.items() if holds}
    assert shown
    assert all(name.endswith("Neumann body upper, moduli exchanged") for name in shown)
    assert f"centred, {STIFF_ABOVE}" in shown
    left = [name for name, holds in held.items() if holds is None and name not in shown]
    assert len(left) == 12 + 3 * (id == "fig-10")  # singular roles, and what quick leaves undecided
    if id == "fig-10":
        curves = next(found["curves"] for found in evidence.data["readings"] if found["holds"])
        assert {curve["label"] for curve in curves} == {f"{nodes} nodes" for nodes in NODES}
        for curve in curves:
            assert curve["steps"]["0.6"] <= 1.25 * min(curve["steps"].values())


def test_in_no_reading_is_0_6_the_best_theta_for_all_moduli(seen):
    (evidence,) = seen["fig-12"]
    assert f"in none of the {ALL} readings tried, 12 of which are refused" in evidence.text
    assert {found["holds"] for found in evidence.data["readings"] if "reason" not in found} == {False}
    assert seen["sec-7"][0].data["readings"] == []


def test_a_refuting_pair_of_counts_is_that_of_single_runs(seen):
    first = seen["fig-11"][0].data["readings"][0]
    assert first["reading"] == READINGS[0].name
    (curve,) = first["curves"]
    steps = curve["steps"]
    assert len(steps) == 2  # at 0.6, and next to 2/(2 + rho)
    rows = sweep(READINGS[0].problem(190), theta=list(steps)).rows
    assert [row["iterations_paper"] for row in rows] == list(steps.values())
    assert steps["0.6"] > 1.25 * min(steps.values())


def test_the_two_curves_against_one_theta_for_all_moduli_have_no_theta_in_common(seen):
    hard, soft = seen["x-no-theta-for-all-moduli"][0].data["curves"]
    assert len(hard["steps"]) + len(hard["not_met"]) == 19
    serve = {float(theta) for theta, n in hard["steps"].items() if n <= 1.25 * min(hard["steps"].values())}
    fail = {float(theta) for theta, n in soft["steps"].items() if n > 1.25 * min(soft["steps"].values())}
    assert serve
    assert serve <= fail | set(soft["not_met"])


def test_what_the_ledger_says_is_assumed_is_what_each_reading_has(seen):
    contacts = [reading.problem(190).contact for reading in READINGS]
    ((law, radius),) = {(contact.law, float(contact.radius)) for contact in contacts}
    assert seen["fig-5"][0].data["assumed"].items() >= {"law": law, "radius": radius}.items()


def test_figure_5_is_that_of_half_models_among_them_one_pressed_on_the_left_two_thirds_of_its_top(seen):
    (evidence,) = seen["fig-5"]
    held = {found["reading"]: found["holds"] for found in evidence.data["readings"]}
    shown = [reading for reading in READINGS if held[reading.name]]
    assert {reading.position for reading in shown} == {"half model"}
    assert {(reading.moved, reading.top, reading.moduli) for reading in shown} == {
        ("left two thirds", "clamped", "as printed"),
        ("left half", "clamped", "exchanged"),
        ("left half", "free to slide", "exchanged"),
    }
    contact = solve(shown[0].problem(190)).contact
    ends = {state: high for state, _, high in zones(contact)}
    assert list(ends) == ["stick", "slip", "open"]
    assert ends["stick"] == pytest.approx(0.6, abs=0.075)
    assert ends["slip"] == pytest.approx(1.0, abs=0.075)
    data = shown[0].problem(190).to_dict()
    local = Problem.from_dict({**data, "contact": {**data["contact"], "law": "local"}})
    assert zones_hold(solve(local).contact), "as the note of the statement says"
    assert statements()["fig-5"].note.endswith("with the local law a reading that shows the figure shows it, too.")


def test_evidence_from_readings_that_all_depart_from_the_text_is_told_so(seen):
    for id, departs in (("fig-5", True), ("fig-12", False)):
        (evidence,) = seen[id]
        assert evidence.data["departs"] is departs
        assert ("holds only in readings that depart from the text" in outcome(evidence)) is departs


def test_a_figure_that_no_reading_shows_is_told_with_the_zones_of_the_nearest():
    section = Section6("quick", [r for r in READINGS if r.position == "centred" and r.moved == "left half"][:2])
    evidence = of(section, "fig-5")
    assert evidence.holds is None
    assert "in none of the 2 readings tried; nearest comes centred, left half of the top" in evidence.text
    assert ": slip from 0 to " in evidence.text


def test_runs_that_stop_early_do_not_give_the_same_results():
    pair, contact = pair_from(READINGS[0].problem(190)), solve(READINGS[0].problem(190)).contact
    loose, tight = (section_6.finished(pair, section_6.PRINTED, bound).contact for bound in (1e-5, section_6.TIGHT))
    assert section_6.difference(loose, contact) > section_6.SAME
    assert section_6.difference(tight, contact) < 1e-10


def test_results_that_differ_in_one_reading_are_not_the_same(monkeypatch):
    run = made(lambda reading, values: at(0.6))
    few = Section6("quick", OF_TEXT[:1], run=run)
    assert of(few, "sec-6.2").holds is True
    monkeypatch.setattr(section_6, "TIGHT", 1e-5)
    assert of(few, "sec-6.2").holds is False


def test_half_models_have_the_same_results_by_both_methods():
    half = [reading for reading in READINGS if reading.position == "half model" and reading.moved == "whole top"]
    evidence = of(Section6("full", half), "sec-6.2")
    assert evidence.holds is True
    assert len(evidence.data["readings"]) >= 4  # in the others no run arrives
    assert f"of the {len(half)} readings that were tried" in evidence.text


def test_a_reading_whose_run_does_not_arrive_is_not_compared():
    evidence = of(Section6("quick", run=made(None, "error")), "sec-6.2")
    assert evidence.holds is None
    assert "in none of the 4 readings that are consistent with the text" in evidence.text


def ends(residual_slow, residual_fast, steps_in_tpa):
    at = lambda steps, residual: StoppedRuns(steps=steps, residual=residual, error=residual)
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
def test_a_test_measures_the_error_if_neither_theta_nor_the_unit_matters(runs, verdict):
    assert section_6.on_test("unrelaxed relative residual", runs, 1.0).holds is verdict
    assert section_6.on_test("increment", runs, 1.0).holds is not verdict


def test_both_tests_stop_where_the_residuals_of_a_run_say():
    pair = pair_from(READINGS[0].problem(190))
    printed, residual = section_6.stopped(pair, Fraction(3, 5), solution_force(pair))
    (row,) = sweep(READINGS[0].problem(190), theta=["3/5"]).rows
    assert printed.steps == row["iterations_paper"]
    assert residual.steps == row["iterations"]


def test_the_increment_test_hides_the_factor_one_over_theta(seen):
    runs = seen["x-increment-test"][0].data["runs"]
    # the last increment is at most 1e-9, and theta times the residual before it
    assert runs["theta 0.05, MPa"]["error"] > 10e-9
    assert runs["theta 0.05, MPa"]["residual"] > 10 * runs["theta 0.6, MPa"]["residual"]
