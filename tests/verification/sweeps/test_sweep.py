"""Sweeps: a row is what a single run of the same problem shows, whatever stands beside it."""

import csv
import io
import pickle
import tomllib
import tracemalloc
from fractions import Fraction
from itertools import islice, pairwise

import numpy as np
import pytest
from problem_list import PROBLEMS
from strategies import AT_NIGHT

import verification as vf
from ndtheory import evaluate_energy
from verification.algorithm.linearisation import NotLinear
from verification.contact import ContactError, active_set
from verification.contact.step import contact_model
from verification.interface import body
from verification.registry import RULES
from verification.sweeps import grid, pieces, workers
from verification.sweeps import row as of_rows
from verification.sweeps.pieces import KnownPieces
from verification.sweeps.row import RESULTS, SharedBodies, row

SMALL = vf.example("section6").changed(cells=((10, 2), (8, 2)), radius="0.2", max_iterations=200)
BARS = vf.Problem.from_dict(
    {
        "dimension": 1,
        "body1": {"shape": "interval", "x": [0, 1], "cells": 4, "young": 2, "fixed": ["left"]},
        "body2": {"shape": "interval", "x": [1, 2], "cells": 4, "young": 1, "prescribed": {"right": -0.1}},
    }
)

#: Runs that converge, stall, run away and reach their limit.
WIDE = {"theta": [0.02, 0.3, 0.7, 0.95], "friction": [0, "1/5", 1], "neumann_body": [1, 2]}


@pytest.fixture(scope="module")
def wide():
    return vf.sweep(SMALL, **WIDE)


def changed(problem, found):
    """The problem of a row, made without a sweep."""
    refined = problem.refined(found["refine"])
    names = ("theta", "friction", "neumann_body", "law", "radius")
    return refined.changed(
        young=(found["young1"], found["young2"]), relaxation=found["rule"], **{name: found[name] for name in names}
    )


def steps_of_the_paper(pair, theta, most):
    """n of the first |g_n - g_{n-1}| below 1e-9, or below 1e-9 |g_n|, from the forces of the iteration alone."""
    forces = [state.g for state in islice(vf.iterate(pair, theta=theta), most + 1)]
    for n, (before, g) in enumerate(pairwise(forces), 1):
        increment = sum((a - b) ** 2 for a, b in zip(g, before, strict=True)) ** 0.5
        if increment < 1e-9 or increment < 1e-9 * sum(a * a for a in g) ** 0.5:
            return n
    return None


# --- rows ---


def test_rows_show_what_single_runs_show(wide):
    outcomes = set()
    for found in wide.rows[:: 1 if AT_NIGHT else 3]:  # four thetas change fastest: every third row has each of them
        problem = changed(SMALL, found)
        run, measured = vf.run(problem).linearise(), vf.measure(problem)
        outcomes.add(found["outcome"])
        assert (found["outcome"], found["steps"]) == (run.outcome, run.iterations)
        assert found["iterations"] == (run.iterations if run.converged else None)
        assert (found["observed_rate"] is None) == (run.observed_rate is None)
        if run.observed_rate is not None:
            assert found["observed_rate"] == pytest.approx(run.observed_rate.value, rel=1e-6)
        linear = None if run.linearised is None else pytest.approx(run.linearised.rate, rel=1e-9)
        assert found["linearised_rate"] == linear
        assert found["rho"] == pytest.approx(measured.rho_max.value, rel=1e-12)
        proved = evaluate_energy(measured.energy_constants(), found["theta"]).factor
        assert (found["energy_factor"] < 1) == (proved is not None)
        if proved is not None:
            assert found["energy_factor"] == pytest.approx(proved.value, rel=1e-12)
    assert outcomes >= {"converged", "stalled", "limit"}


@pytest.mark.parametrize("name", PROBLEMS)
def test_a_row_of_any_problem_is_its_run(name):
    problem = vf.Problem.from_dict(PROBLEMS[name])
    found = row(problem, {})
    try:
        run = vf.run(problem).linearise()
    except (vf.ProblemError, vf.ContactError):
        assert found["outcome"] in ("refused", "error")
        return
    assert (found["steps"], found["outcome"]) == (run.iterations, run.outcome)
    assert found["theta"] == float(run.theta)
    if run.observed_rate is not None and found["observed_rate"] is not None:
        assert found["observed_rate"] == pytest.approx(run.observed_rate.value, rel=1e-5, abs=1e-9)
    if run.linearised is not None:
        assert found["linearised_rate"] == pytest.approx(run.linearised.rate, rel=1e-7, abs=1e-9)


def test_what_is_null_has_a_reason_and_nothing_else_has(wide):
    for found in wide.rows:
        missing = {name for name in RESULTS if found[name] is None} - {"reason"}
        assert missing == {part.partition(":")[0] for part in (found["reason"] or "").split("; ") if part}


def test_a_row_does_not_depend_on_the_rows_before_it(wide):
    values = list(grid.SweepGrid.of(WIDE).rows())
    bodies = SharedBodies(SMALL)
    backwards = [row(SMALL, each, bodies) for each in reversed(values)]
    assert tuple(reversed(backwards)) == wide.rows
    assert row(SMALL, values[5]) == wide.rows[5]


def test_several_processes_give_the_same_rows_to_the_last_digit(wide):
    told = []
    together = vf.sweep(SMALL, **WIDE, jobs=2, progress=lambda what, share: told.append((what, share)))
    assert together.rows == wide.rows
    assert told[-1] == (f"runs: {len(wide.rows)} done, 0 failed, 0 left, about 0 s to go", 1.0)
    assert [share for _, share in told] == sorted(share for _, share in told)


def test_scaling_both_moduli_changes_no_rate():
    found = vf.sweep(SMALL, theta=[0.5], young=[(7e4, 2e4), ("0.7", "0.2"), (2e4, 2e4)])
    first, second, other = found.rows
    assert first["rho"] == second["rho"] != other["rho"]
    assert first["iterations"] == second["iterations"]
    assert first["iterations_paper"] > second["iterations_paper"]  # its absolute part depends on the unit
    assert second["linearised_rate"] == pytest.approx(first["linearised_rate"], rel=1e-9)


def test_rules_and_laws_vary_too():
    found = vf.sweep(SMALL, rule=["constant", "aitken", "momentum"], law=["nonlocal", "local"], theta=[0.5])
    assert [(each["law"], each["rule"]) for each in found.rows] == [
        (law, rule) for law in ("nonlocal", "local") for rule in ("constant", "aitken", "momentum")
    ]
    for each in found.rows:
        run = vf.run(SMALL.changed(law=each["law"], theta="1/2"), rule=each["rule"])
        assert (each["steps"], each["theta"]) == (run.iterations, float(run.theta))
        assert (each["linearised_rate"] is None) == (each["rule"] != "constant")
        assert (each["energy_factor"] is None) == (each["rule"] != "constant" or each["law"] == "local")


def test_what_is_proved_of_a_row_is_proved_of_its_rule():
    """q(theta) is about a constant theta, and momentum without friction has a rate of its own."""
    found = vf.sweep(SMALL, friction=[0, "1/5", 5], rule=list(RULES), theta=[0.4]).rows
    seen = {(each["rule"], each["friction"]): each for each in found}
    for (rule, friction), each in seen.items():
        run = vf.run(SMALL.changed(friction=friction, theta="2/5"), rule=rule)
        if rule == "constant":
            q = each["energy_factor"]
            assert each["proved_rate"] == (q if q < 1 else None)
        else:
            assert each["energy_factor"] is None
            assert each["proved_rate"] == (None if run.proved_rate is None else pytest.approx(run.proved_rate.value))
    proved = {key for key, each in seen.items() if each["proved_rate"] is not None}
    assert proved == {("constant", 0.0), ("constant", 0.2), ("momentum", 0.0)}
    assert "no constant theta" in seen["momentum", 0.0]["reason"]
    assert "not below 1" in seen["constant", 5.0]["reason"]


# --- the paper's count ---


@pytest.mark.parametrize("scale", [1, "1e-9"])
def test_the_count_of_the_paper_is_that_of_the_forces(scale):
    problem = SMALL.changed(young=(7e4 * float(scale), 2e4 * float(scale)))
    for each in vf.sweep(problem, theta=[0.1, 0.2, 0.5, 0.8, 0.95]).rows:
        assert each["iterations_paper"] == steps_of_the_paper(vf.build(problem), each["theta"], 200)


def test_the_count_of_the_paper_goes_on_after_the_run_has_ended():
    found = vf.sweep(SMALL, theta=[0.1, 0.9]).rows
    assert found[0]["iterations_paper"] < found[0]["iterations"]
    assert found[1]["iterations_paper"] > found[1]["iterations"]
    pair = vf.build(SMALL)
    assert [each["iterations_paper"] for each in found] == [steps_of_the_paper(pair, t, 200) for t in (0.1, 0.9)]
    most = found[1]["iterations"]
    short = vf.sweep(SMALL.changed(max_iterations=most), theta=[0.9]).rows[0]
    assert (short["iterations"], short["iterations_paper"]) == (most, None)
    assert "iterations_paper" in short["reason"]


@pytest.mark.parametrize("bound", [1.2e-9, 0.8e-9])
def test_another_bound_in_the_stopping_rule_gives_other_counts(monkeypatch, bound):
    monkeypatch.setattr(of_rows, "PAPER", bound)
    found = vf.sweep(SMALL, theta=[0.05, 0.1]).rows
    pair = vf.build(SMALL)
    assert [each["iterations_paper"] for each in found] != [steps_of_the_paper(pair, t, 200) for t in (0.05, 0.1)]


def test_forces_that_vanish_meet_the_test_of_the_paper_at_once():
    apart = SMALL.changed(gap="0.1")
    assert vf.sweep(apart, theta=[0.5]).rows[0]["iterations_paper"] == 1
    assert not vf.run(apart).last.image.any()


# --- the grid ---


def test_rows_are_the_product_with_theta_changing_fastest():
    found = vf.sweep(BARS, theta=["1/3", 0.5], young=[(2, 1), (1, 1)], neumann_body=[2, 1])
    order = [(each["young1"], each["neumann_body"], round(each["theta"], 3)) for each in found.rows]
    assert order == [(young, role, theta) for young in (2.0, 1.0) for role in (2, 1) for theta in (0.333, 0.5)]
    assert found.axes == ("young1", "young2", "neumann_body", "theta")


def test_without_a_grid_there_is_one_row():
    found = vf.sweep(BARS)
    assert [each["theta"] for each in found.rows] == [0.5]


@pytest.mark.parametrize(
    ("axes", "key", "needed"),
    [
        ({"theta": [1.0]}, "theta", "0 < theta < 1"),
        ({"theta": []}, "theta", "at least one"),
        ({"theta": 0.5}, "theta", "a list"),
        ({"theta": "0.5"}, "theta", "a list"),
        ({"theta": [0.5, "1/2"]}, "theta", "once"),
        ({"theta": [float("nan")]}, "theta", "0 < theta < 1"),
        ({"friction": [-0.1]}, "friction", "a number >= 0"),
        ({"friction": [True]}, "friction", "a number >= 0"),
        ({"young": [1, 2]}, "young", "two numbers"),
        ({"young": [(1, 0)]}, "young", "> 0"),
        ({"refine": [1.0]}, "refine", "whole number"),
        ({"refine": [9]}, "refine", "0 to 8"),
        ({"neumann_body": [3]}, "neumann_body", "one of 1, 2"),
        ({"law": ["coulomb"]}, "law", "one of"),
        ({"rule": ["newtonn"]}, "rule", "one of"),
        ({"radius": [0]}, "radius", "> 0"),
        ({"friction": list(range(500)), "radius": list(range(1, 501))}, "grid", "rows"),
    ],
    ids=lambda value: str(value)[:40],
)
def test_a_value_that_fits_no_problem_is_refused_by_name(axes, key, needed):
    with pytest.raises(vf.ProblemError) as refused:
        vf.sweep(SMALL, **axes)
    assert refused.value.key == key
    assert needed in str(refused.value)
    assert "\n" not in str(refused.value)


def test_what_only_some_rows_cannot_do_is_a_reason_and_no_error():
    loose = vf.example("section6").changed(cells=((10, 2), (6, 2)))
    found = vf.sweep(loose, refine=[0, 8], theta=[0.5]).rows
    assert [each["outcome"] for each in found] == ["converged", "refused"]
    assert "at most 250000 cells" in found[1]["reason"]
    assert {found[1][name] for name in RESULTS} == {None, "refused", found[1]["reason"]}
    without = vf.sweep(BARS, friction=[0, 0.5]).rows
    assert [each["outcome"] for each in without] == ["converged", "refused"]


def test_an_error_in_one_row_costs_no_other(monkeypatch):
    def broken(*args):
        if args[2].theta > 0.5:
            raise ZeroDivisionError("made up")
        return kept(*args)

    from verification.sweeps import row as module

    kept = module.course
    monkeypatch.setattr(module, "course", broken)
    found = vf.sweep(SMALL, theta=[0.4, 0.6, 0.5]).rows
    assert [each["outcome"] for each in found] == ["converged", "error", "converged"]
    assert found[1]["reason"] == "outcome: ZeroDivisionError: made up"
    assert found[1]["rho"] == found[0]["rho"]


def test_a_pair_from_matrices_varies_theta_friction_and_roles():
    pair = vf.build(S1=np.diag([3.0, 2.0]), S2=np.eye(2), load2=np.array([0.0, -1.0]), x=np.array([0.0]))
    found = vf.sweep(pair, theta=[0.3, 0.5], neumann_body=[1, 2])
    assert [each["iterations"] for each in found.rows] == [
        vf.run(roles, theta=theta).iterations for roles in (pair.swapped(), pair) for theta in (0.3, 0.5)
    ]
    assert "problem" not in found.to_dict()
    refused = vf.sweep(pair, young=[(1, 2)]).rows[0]
    assert (refused["outcome"], "needed a problem" in refused["reason"]) == ("refused", True)


# --- what is shared ---


def test_bodies_are_condensed_once_a_mesh(monkeypatch):
    made = []
    monkeypatch.setattr(body, "FEW", 0)
    condensation = body.Condensation
    monkeypatch.setattr(body, "Condensation", lambda *args, **kw: made.append(args) or condensation(*args, **kw))

    def refuse(pieces):
        raise NotLinear("the global method, which factorises by itself, is not what is counted")

    monkeypatch.setattr(KnownPieces, "solution", refuse)
    short = SMALL.changed(max_iterations=5)
    vf.sweep(short, refine=[0, 1], friction=[0.1, 0.3], law=["nonlocal", "local"], radius=[0.2, 0.3])
    assert len(made) == 4  # two bodies, two meshes
    vf.sweep(short, refine=[0, 1], theta=[0.4, 0.6], young=[(7e4, 2e4), (2e4, 7e4), (1, 1)], neumann_body=[1, 2])
    assert len(made) == 8


# --- the document ---


def test_the_table_reads_back_from_csv(wide):
    text = wide.to_csv()
    lines = text.splitlines()
    head = [line for line in lines if line.startswith("#")]
    assert head[0].startswith("# ndtheory ")
    toml = "\n".join(line[2:] for line in head[1:])

    assert vf.Problem.from_dict(tomllib.loads(toml)) == SMALL
    read = list(csv.DictReader(line for line in io.StringIO(text) if not line.startswith("#")))
    assert len(read) == len(wide.rows)
    for one, found in zip(read, wide.rows, strict=True):
        assert list(one) == list(found)
        assert one == {name: "" if value is None else str(value) for name, value in found.items()}


def test_what_reads_comments_anywhere_in_a_line_reads_whole_rows(monkeypatch):
    """As pandas does with ``comment="#"``, whether a field stands in quotes or not."""

    def fails(*args, **named):
        raise ContactError("body #2, by a, b")

    monkeypatch.setattr(KnownPieces, "steps", fails)
    found = vf.sweep(BARS, theta=[0.3, 0.5])
    kept = [line.split("#")[0] for line in found.to_csv().splitlines()]
    read = list(csv.DictReader(line for line in kept if line))
    assert [one["reason"] for one in read] == ["outcome: body %232, by a, b"] * 2
    assert [each["reason"] for each in found.rows] == [one["reason"] for one in read]


def test_rows_of_one_friction_factorise_each_pattern_once(monkeypatch):
    made, original = [], active_set.System.__init__

    def counted(self, S, free, pattern, motions=None):
        made.append(pattern)
        original(self, S, free, pattern, motions)

    monkeypatch.setattr(active_set.System, "__init__", counted)
    found = vf.sweep(SMALL, theta=[0.1, 0.3, 0.95], neumann_body=[2]).rows
    assert [each["outcome"] for each in found] == ["converged", "stalled", "stalled"]
    assert len(made) == len(set(made)) > 3


def test_a_sweep_travels_and_is_shown(wide):
    again = pickle.loads(pickle.dumps(wide))
    assert (again.rows, again.to_json()) == (wide.rows, wide.to_json())
    assert repr(wide).startswith("<Sweep: Section 6, centred, 24 runs over neumann_body, friction, theta, ")
    assert "WHICH THETA TAKES THE FEWEST STEPS?" in wide._repr_html_()
    assert list(wide.table()) == list(wide.rows[0])
    assert wide.table()["theta"][:4] == WIDE["theta"]


def test_a_figure_has_a_curve_for_each_value_of_a_third_column(wide):
    axes = wide.plot("theta", "iterations", curves="friction").axes[0]
    labels = axes.get_legend_handles_labels()[1]
    assert labels == ["friction = 0", "friction = 0.2", "friction = 1"]
    drawn = sum(len(line.get_xdata()) for line in axes.get_lines())
    assert drawn == sum(each["iterations"] is not None for each in wide.rows)
    assert len(wide.plot("theta", "steps").axes[0].get_lines()) == 6
    with pytest.raises(ValueError, match="needed one of theta"):
        wide.plot("nonsense")
    with pytest.raises(ValueError, match="no row has a number"):
        wide.plot("theta", "law")


def test_what_six_frictions_keep_at_121_contact_nodes_stays_below_100_megabytes(capfd):
    """Beside the pair; with all pieces of each of 16 frictions it was 0.7 GB, and processes were ended for it."""
    contact_model()  # importing it takes memory of its own
    fine = vf.example("section6").changed(cells=((200, 3), (120, 3)))
    bodies = SharedBodies(fine)
    assert bodies.setting({}).pair.contact.grid.n == 121
    frictions, theta, most = [Fraction(i, 20) for i in (1, 4, 7, 10, 13, 16)], Fraction(3, 10), []
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        for k in frictions:
            assert row(fine, {"friction": k, "theta": theta}, bodies)["outcome"] == "converged"
            most.append(tracemalloc.get_traced_memory()[1] - before)
    finally:
        tracemalloc.stop()
    assert max(most) < 100e6
    vf.sweep(fine, friction=frictions, theta=[theta], jobs=2)
    assert capfd.readouterr().err == ""


def test_steps_on_one_affine_piece_are_taken_together(monkeypatch):
    evaluated, original = [], pieces.iterate_at
    monkeypatch.setattr(pieces, "iterate_at", lambda *args: evaluated.append(args) or original(*args))
    monkeypatch.setattr(of_rows, "iterates", None)  # which evaluates them one by one
    [found] = vf.sweep(SMALL, theta=["0.3"]).rows
    assert found["outcome"] == "converged"
    assert len(evaluated) < found["steps"] / 4


def test_rows_that_are_refused_for_one_reason_find_it_once(monkeypatch):
    made, condense = [], of_rows.pair_from
    monkeypatch.setattr(of_rows, "pair_from", lambda *args, **named: made.append(args) or condense(*args, **named))
    sliding = SMALL.changed(neumann_body=2)
    data = sliding.to_dict()
    data["body2"]["prescribed"] = {"top": ["free", "-0.015"]}
    found = vf.sweep(vf.Problem.from_dict(data), theta=[0.1, 0.2, 0.3])
    assert {entry["outcome"] for entry in found.rows} == {"refused"}
    assert len({entry["reason"] for entry in found.rows}) == 1
    assert len(made) == 1


def test_ctrl_c_keeps_the_rows_that_are_done(monkeypatch):
    def interrupted(*args):
        found = row(*args)
        if found["theta"] == 0.5:
            raise KeyboardInterrupt
        return found

    monkeypatch.setattr(workers, "row", interrupted)
    found = vf.sweep(SMALL, theta=[0.3, 0.4, 0.5, 0.6])
    assert [each["theta"] for each in found.rows] == [0.3, 0.4]
    assert found.to_dict()["reason"] == {"rows": "interrupted after 2 of 4 rows"}
    assert "# interrupted after 2 of 4 rows" in found.to_csv()
    with pytest.raises(KeyboardInterrupt):
        vf.sweep(SMALL, theta=[0.5])
