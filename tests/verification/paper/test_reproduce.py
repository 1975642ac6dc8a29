"""The experiments of Section 6: readings, verdicts, and what stands behind them."""

import csv
import math
import signal

import numpy as np
import pytest
from strategies import AT_NIGHT

import verification as vf
from verification.interface.assembly import discretise
from verification.interface.fields import ContactFields
from verification.machine.interrupts import term_interrupts
from verification.output.folder import Folder
from verification.reproduce import FIGURES, READINGS, reproduce
from verification.reproduce.claims import CLAIMS, OPTIMUM, Curve, curves_hold, share_as_printed, zones, zones_hold
from verification.reproduce.experiments import THETAS, Outcome, Reproduction, Result, outcome_of, shared
from verification.reproduce.refutation import Runs, judged
from verification.sweeps.grid import SweepGrid
from verification.sweeps.sweep import sweep_grid
from verification.sweeps.workers import alone

LITERAL = [reading for reading in READINGS if not reading.departs]
HELD_BY_CONTACT = [
    reading
    for reading in READINGS
    if (reading.top, reading.neumann_body, reading.moduli) == ("free to slide", 1, "as printed")
    and reading.position != "half model"
]
CLAMPED = next(reading for reading in LITERAL if reading.top == "clamped")
CURVES = [CLAIMS[name] for name in ("fig10", "fig11", "fig12")]


@pytest.mark.parametrize("nodes", [60, 190, 666, 2482])
def test_the_family_has_the_paper_s_numbers_of_nodes_and_grids_that_differ(nodes):
    problem = vf.example(f"section6-{nodes}")
    bodies = discretise(problem)
    assert sum(len(body.mesh.points) for body in bodies.elastic) == nodes
    assert not bodies.interface.one_grid
    assert problem.refined(1).body1.cells == tuple(2 * n for n in problem.body1.cells)


def test_readings_are_every_combination_and_four_leave_the_text_nowhere():
    assert len(set(READINGS)) == len(READINGS) == 72
    assert len(LITERAL) == 4
    assert len({reading.name for reading in READINGS}) == 72
    for reading in READINGS:
        problem = reading.problem(60)
        assert problem.iteration.neumann_body == reading.neumann_body
        top = problem.body2.prescribed["top" if reading.moved == "whole top" else "moved"]
        assert (top[0] is None) == (reading.top == "free to slide")
        assert float(top[1]) == -0.015
        assert ("Section 3" in " ".join(reading.departs)) == (reading.neumann_body == 2)
        assert ("axis of symmetry" in " ".join(reading.departs)) == (reading.position == "half model")
        assert ("exchanged" in " ".join(reading.departs)) == (reading.moduli == "exchanged")
        assert (problem.body1.young > problem.body2.young) == (reading.moduli == "as printed")


@pytest.mark.parametrize("top", ["clamped", "free to slide"])
def test_the_left_sides_of_a_half_model_move_along_the_axis_of_symmetry_alone(top):
    reading = next(r for r in READINGS if (r.position, r.moved, r.top) == ("half model", "left two thirds", top))
    for body, ends in zip(discretise(reading.problem(190)).elastic, (2.0, 1.2), strict=True):
        points, known = body.mesh.points, body.known.held
        left = points[:, 0] == 0
        assert points[:, 0].max() == ends
        assert known[left, 0].all()
        inside = left & (np.abs(points[:, 1]) < 0.3)
        assert inside.any()
        assert not known[inside, 1].any()


def test_a_part_of_the_top_ends_at_its_share_of_the_length():
    half = next(r for r in READINGS if r.moved == "left half" and r.position == "centred")
    body = discretise(half.problem(190)).body2
    held = body.mesh.points[body.known.held.any(axis=1), 0]
    assert (held.min(), held.max()) == pytest.approx((0.4, 1.0))


@pytest.mark.parametrize("reading", HELD_BY_CONTACT, ids=lambda reading: reading.name)
def test_an_upper_body_that_only_contact_holds_gets_the_steps_of_a_single_run(reading):
    problem = reading.problem(190)
    (row,) = vf.sweep(problem, theta=["17/20"]).rows
    run = vf.run(problem, theta="17/20")
    assert (row["outcome"], row["iterations"]) == ("converged", run.iterations)


def fields(*states: str) -> ContactFields:
    """A contact of 13 nodes over 1.2 mm in given states."""
    x = np.linspace(0.4, 1.6, 13)
    zero = np.zeros(13)
    rest = dict.fromkeys(("pressure", "shear", "bound", "gap", "slip", "slip_increment"), zero)
    return ContactFields(x=x, s=x - x[0], weights=zero + 0.1, status=states, **rest)


PRINTED = ("stick",) * 6 + ("slip",) * 4 + ("open",) * 3


def test_zones_are_read_off_half_way_between_nodes_and_must_be_those_of_figure_5():
    printed = fields(*PRINTED)
    assert [(s, round(a, 3), round(b, 3)) for s, a, b in zones(printed)] == [
        ("stick", 0.0, 0.55), ("slip", 0.55, 0.95), ("open", 0.95, 1.2)
    ]  # fmt: skip
    assert zones_hold(printed)
    assert share_as_printed(printed) == pytest.approx(1.1 / 1.2)
    assert not zones_hold(fields("slip", *PRINTED[1:]))
    assert not zones_hold(fields(*("stick",) * 4, *("slip",) * 6, *("open",) * 3))
    assert not zones_hold(fields(*("stick",) * 13))
    assert share_as_printed(fields(*("stick",) * 13)) == pytest.approx(0.5)


def curve(**steps: int | None) -> Curve:
    of = {float(f"0.{name[1:]}"): n for name, n in steps.items()}
    return Curve(label="", steps=of, unrelaxed=of, rho=1.0)


def test_a_curve_is_served_by_the_printed_theta_within_a_quarter_more_steps():
    assert curve(t6=25, t8=20).cost == 1.25
    assert curves_hold("fig11", [curve(t6=25, t8=20)])
    assert not curves_hold("fig11", [curve(t6=25, t8=20), curve(t6=26, t8=20)])
    assert curve(t6=None, t8=20).cost == math.inf
    assert curve(t6=None, t8=None).fewest is None
    assert curves_hold("fig10", [curve(t6=20), curve(t6=30)])
    assert not curves_hold("fig10", [curve(t6=20), curve(t6=31)])
    assert curves_hold("fig12", [curve(t6=20), curve(t6=31)])
    assert curve(t5=20, t6=20, t8=24).best == (0.5, 0.6)


def outcomes(held):
    return tuple(Outcome(reading=reading, holds=holds) for reading, holds in zip(READINGS, held, strict=True))


def test_a_figure_is_reproduced_where_every_reading_of_the_text_shows_it():
    of_text = [not reading.departs for reading in READINGS]
    assert Result(figure="fig10", outcomes=outcomes(of_text)).verdict == "reproduced"
    one = [reading == CLAMPED for reading in READINGS]
    assert Result(figure="fig10", outcomes=outcomes(one)).verdict == "reproduced under an assumption"
    assert Result(figure="fig10", outcomes=outcomes([not held for held in of_text])).verdict != "reproduced"
    assert Result(figure="fig10", outcomes=outcomes([False] * len(READINGS))).verdict == "not reproduced"
    assert Result(figure="fig10", outcomes=outcomes([None] * len(READINGS))).verdict == "not reproduced"
    together = Reproduction(results=(Result(figure="fig10", outcomes=outcomes(one)),))
    assert together.closest == CLAMPED


def test_a_figure_is_undecided_where_a_reading_that_ran_may_yet_show_it():
    seen = (curve(t6=20),)
    perhaps = Outcome(reading=CLAMPED, holds=None, curves=seen)
    refused = Outcome(reading=LITERAL[-1], holds=None)
    against, shows = (Outcome(reading=READINGS[-1], holds=holds, curves=seen) for holds in (False, True))
    verdict = lambda *made: Result(figure="fig10", outcomes=made).verdict
    assert verdict(perhaps, refused, against) == "undecided"
    assert verdict(refused, against) == "not reproduced"
    assert verdict(perhaps, shows) == "reproduced under an assumption"  # that of the text did not show it


def row(theta, steps, outcome="converged"):
    return {"theta": float(theta), "iterations": steps, "iterations_paper": steps, "outcome": outcome, "rho": 1.0} | {
        "reason": "made so"
    }


def test_runs_that_failed_leave_a_reading_undecided_unless_others_refute_it():
    fail = lambda theta: row(theta, None, "error")
    judged = lambda **rows: outcome_of("fig11", CLAMPED, rows)
    assert judged(a=[row(0.6, 20), row(0.7, 20)]).holds is True
    undecided = judged(a=[row(0.6, 20), fail(0.7)])
    assert (undecided.holds, undecided.refused, undecided.reason) == (None, False, "made so")
    assert judged(a=[fail(0.6), row(0.7, 20)]).refused
    assert judged(a=[row(0.6, 26), row(0.7, 20), fail(0.8)]).holds is False
    assert judged(a=[fail(0.6)], b=[row(0.6, 26), row(0.7, 20)]).holds is False
    assert judged(a=[row(0.6, None), fail(0.7)]).holds is False  # 0.6 does not arrive


class Counted:
    """Steps over theta that nobody ran, and which theta were asked for."""

    def __init__(self, steps, others):
        self.steps, self.others, self.asked = steps, others, []

    def __call__(self, values):
        self.asked.append(values["theta"])
        return row(values["theta"], self.steps.get(float(values["theta"]), self.others))


@pytest.mark.parametrize(
    ("steps", "others", "holds", "runs"),
    [
        ({}, 20, True, 19),  # as many everywhere
        ({0.95: 16}, 20, True, 19),  # 20 is 1.25 times 16
        ({0.95: 15}, 20, False, None),
        ({0.05: 15}, 20, False, None),
        ({0.65: 15}, 20, False, 2),  # the one next to 2/(2 + rho) is tried first
        ({0.6: None}, 20, False, 1),
        ({}, None, False, 1),
        ({0.6: 20}, None, True, 19),  # no other arrives
    ],
)
def test_a_reading_is_refuted_by_a_theta_that_takes_too_few_steps_and_by_no_other(steps, others, holds, runs):
    made = Counted(steps, others)
    found = judged(OPTIMUM, Runs(CLAMPED, made))
    assert found.holds is holds
    assert runs is None or len(made.asked) == runs
    every = [row(theta, steps.get(float(theta), others)) for theta in THETAS]
    assert outcome_of("sec-6.3", CLAMPED, {"all": every}).holds is holds
    assert found.closeness >= outcome_of("sec-6.3", CLAMPED, {"all": every}).closeness


def test_a_curve_whose_run_at_0_6_failed_leaves_it_to_the_others_to_refute():
    fails = lambda values: "friction" not in values and float(values["theta"]) == 0.6
    best = lambda values: 20 if float(values["theta"]) == 0.6 else 10
    run = lambda values: row(values["theta"], best(values), "error" if fails(values) else "converged")
    assert judged(CLAIMS["fig11"], Runs(CLAMPED, run)).holds is False
    assert judged(OPTIMUM, Runs(CLAMPED, run)).holds is None


def test_figures_share_the_runs_of_the_curve_that_they_have_in_common():
    made = Counted({0.65: 10}, 20)
    runs = Runs(CLAMPED, made)
    assert [judged(claim, runs).holds for claim in (*CURVES, OPTIMUM)] == [False] * 4
    assert len(made.asked) == 2


def test_figures_make_the_rows_of_that_curve_once_and_they_are_those_that_each_would_make():
    problem, made = CLAMPED.problem(60), []

    def counted(start, wanted):
        made.extend(wanted)
        yield from alone(start, wanted)

    work = shared(counted, problem)
    axes = [CLAIMS["fig10"].axes | {"refine": [1]}, CLAIMS["fig11"].axes, CLAIMS["fig12"].axes]
    for given in axes:
        grid = SweepGrid.of({**given, "theta": ["0.3"]})
        assert sweep_grid(problem, grid, work=work).rows == sweep_grid(problem, grid).rows
    assert len(made) == 1 + 2 + 2


def test_meshes_that_are_not_run_leave_a_figure_undecided_and_refute_it_as_well():
    fine = lambda values: row(values["theta"], 20 if values["refine"] < 3 or float(values["theta"]) == 0.95 else 40)
    figure_10 = lambda **meshes: judged(CLAIMS["fig10"], Runs(CLAMPED, fine), **meshes)
    assert figure_10().holds is False
    assert figure_10(meshes=[0, 1, 2]).holds is None
    assert figure_10(meshes=[3]).holds is False
    alike = lambda values: row(values["theta"], 20 + 4 * values["refine"])
    assert judged(CLAIMS["fig10"], Runs(CLAMPED, alike)).holds is False  # 32 steps on the finest, 20 on the coarsest


@pytest.fixture(scope="module")
def found():
    return reproduce(["fig5", "fig11"], readings=[CLAMPED])


@pytest.mark.parametrize("reading", [CLAMPED, *[READINGS[5]] * AT_NIGHT], ids=lambda reading: reading.name)
def test_early_refutation_says_of_a_reading_what_all_its_runs_say(found, reading):
    result = (found if reading == CLAMPED else reproduce(["fig11"], readings=[reading])).results[-1]
    early = judged(CLAIMS["fig11"], Runs(reading))
    assert early.holds is result.outcomes[0].holds
    assert early.closeness >= result.outcomes[0].closeness
    whole = {curve.label: curve for curve in result.outcomes[0].curves}
    for curve in early.curves:
        assert all(whole[curve.label].steps[theta] == n for theta, n in curve.steps.items())


def test_steps_are_those_of_single_runs_by_both_rules(found):
    (outcome,) = found.results[1].outcomes
    problem = CLAMPED.problem(190).changed(friction="0.4")
    run = vf.run(problem, theta="0.85")
    strongest = outcome.curves[-1]
    assert strongest.unrelaxed[0.85] == run.iterations
    assert strongest.rho == pytest.approx(vf.measure(problem).rho_max.value, rel=1e-9)
    assert strongest.steps[0.1] < strongest.unrelaxed[0.1]  # the increment test shrinks with theta
    assert strongest.steps[0.85] == strongest.fewest


def test_the_literal_reading_is_closed_everywhere_and_its_best_theta_is_not_the_printed_one(found):
    zones_found, curves_found = (result.outcomes[0] for result in found.results)
    assert "open" not in zones_found.contact.status
    assert zones_found.holds is False
    assert curves_found.holds is False
    assert all(0.8 <= theta <= 0.9 for one in curves_found.curves for theta in one.best)


def test_rows_figures_and_the_document_are_written_and_known_as_ours(found, tmp_path):
    Folder(tmp_path, "reproduce").write(found)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"reproduce.json", "reproduce.svg", "reproduce.png", "fig5.csv", "fig11.csv"}
    lines = (tmp_path / "fig11.csv").read_text("utf-8").splitlines()
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    assert len(rows) == 3 * 19
    assert {row["reading"] for row in rows} == {CLAMPED.name}
    assert "MPa" in lines[0]
    Folder(tmp_path, "reproduce").write(found)  # over its own files


def test_unknown_figures_are_refused_and_every_claim_says_when_it_holds():
    with pytest.raises(ValueError, match=r"fig7.*fig5, fig10, fig11, fig12"):
        reproduce(["fig7"])
    assert tuple(CLAIMS) == FIGURES
    assert all(claim.says and claim.criterion for claim in CLAIMS.values())


def test_an_interrupted_figure_goes_on_and_a_whole_one_is_drawn_again_without_a_run(tmp_path, monkeypatch):
    from verification.sweeps import workers

    place, told = tmp_path / "runs.sqlite", []

    def until_row_20(what, share):
        told.append((what, share))
        if what == "fig11: row 20 of 57":
            signal.raise_signal(signal.SIGTERM)

    with pytest.raises(KeyboardInterrupt), term_interrupts():
        reproduce(["fig11"], readings=[CLAMPED], store=place, progress=until_row_20)
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    assert told[-1] == ("fig11: row 20 of 57", 20 / 57)
    begins = []
    first = reproduce(["fig11"], readings=[CLAMPED], store=place, progress=lambda what, share: begins.append(what))
    assert begins[:2] == ["fig11: row 0 of 57", "fig11: row 20 of 57"]
    assert begins[-1].startswith("fig11: row 57 of 57")
    monkeypatch.setattr(workers, "row", None)
    again = reproduce(["fig11"], readings=[CLAMPED], store=place)
    assert [result.rows for result in again.results] == [result.rows for result in first.results]
    assert again.to_json() == first.to_json()
