"""Results travel: pickled and copied, one line long, read-only, with figures, tables and the view of a screen."""

import copy
import json
import pickle
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
import pytest
from problem_list import plates

import verification as vf
from verification.algorithm.affine_piece import piece_of
from verification.algorithm.loop import Outcome
from verification.bounds.bound import Region
from verification.document import Document
from verification.registry import draw
from verification.sweeps.region import Plane, Point

SMALL = {"body1.cells": "[10, 2]", "body2.cells": "[6, 2]"}

#: Iterates of two unknowns.
VECTORS = np.array([[1.0, 1.0], [0.5, -0.2], [0.1, 0.7], [-0.3, 0.2]])


@pytest.fixture(scope="module")
def problem() -> vf.Problem:
    """Section 6 with 7 contact nodes."""
    return vf.Problem.from_dict(plates()).with_keys(SMALL)


@pytest.fixture(scope="module")
def results(problem) -> dict[str, Document]:
    region = Region(k=(0.1, 0.2), theta=((0.0, 0.5), (0.0, 0.4)), every=0.3, some=0.4)
    point = Point(theta=0.4, k=0.1, outcome=Outcome.CONVERGED, iterations=12, coupled_residual=1e-9)
    return {
        "Measured": vf.measure(problem),
        "Run": vf.run(problem).linearise(),
        "Solution": vf.solve(problem),
        "Comparison": vf.compare(problem),
        "Advice": vf.advise(problem),
        "Plane": Plane(
            title="a plane",
            regions={"energy": region},
            points=(point,),
            reason={"lmi": "made up"},
            units=problem.units,
            problem=problem,
        ),
    }


#: By the kind of result, a title of its view.
TITLES = {
    "Measured": "WHICH CONSTANTS DOES THE THEOREM USE?",
    "Run": "WHAT HAPPENED",
    "Solution": "WHAT IS THE SOLUTION?",
    "Comparison": "DOES IT CONVERGE, AND HOW FAST?",
    "Advice": "WHICH BODY GETS THE NEUMANN PROBLEM?",
    "Plane": "WHERE IS ONE STEP PROVED TO CONTRACT?",
}


@pytest.mark.parametrize("name", TITLES)
def test_a_result_is_pickled_and_shown_on_one_line_in_a_notebook_and_a_figure_and_has_its_problem(
    results, problem, name
):
    result = results[name]
    for other in (pickle.loads(pickle.dumps(result)), copy.copy(result), copy.deepcopy(result)):
        assert type(other) is type(result)
        assert other.to_json() == result.to_json()
        assert repr(other) == repr(result)
    shown, view, figure = repr(result), result._repr_html_(), result.plot()
    assert shown.startswith(f"<{name}: ")
    assert "\n" not in shown
    assert len(shown) < 300
    assert TITLES[name] in view
    assert "Next: ndtheory" not in view  # there is no file to name
    assert "\x1b" not in view
    drawn = figure.axes[0]
    assert drawn.get_xlabel() or drawn.get_title() or len(figure.axes) > 1
    assert drawn.lines or drawn.collections
    assert vf.Problem.from_dict(json.loads(result.to_json())["problem"]) == problem


def test_a_problem_and_a_pair_are_pickled_and_run_to_the_same_result(problem):
    pair = vf.build(problem)
    expected = vf.run(pair).to_json()
    for other in (pickle.loads(pickle.dumps(problem)), pickle.loads(pickle.dumps(pair))):
        assert vf.run(other).to_json() == expected


def test_a_run_that_was_pickled_still_has_its_displacements_and_is_linearised_alike(results):
    run = results["Run"]
    other = pickle.loads(pickle.dumps(run))
    for here, there in zip(run.displacements, other.displacements, strict=True):
        assert np.array_equal(here, there)
    assert other.linearise().linearised == run.linearised


def test_a_body_is_pickled_without_its_stiffness_and_assembles_it_again_to_the_last_bit(results):
    run = results["Run"]
    for body in (run.pair.body1.body, run.pair.body2.body):
        written = pickle.dumps(body)
        assert body.stiffness.data.tobytes() not in written
        there = pickle.loads(written).stiffness
        for name in ("data", "indices", "indptr"):
            assert np.array_equal(getattr(there, name), getattr(body.stiffness, name))
            assert not getattr(there, name).flags.writeable


def arrays(value: Any, seen: set[int], path: str = "") -> list[tuple[str, np.ndarray]]:
    """Every array that can be reached from a result by its fields, and by what is worked out from them and kept."""
    if id(value) in seen:
        return []
    seen.add(id(value))
    if isinstance(value, np.ndarray):
        return [(path, value)]
    if isinstance(value, dict) or hasattr(value, "items"):
        return [found for key, member in dict(value).items() for found in arrays(member, seen, f"{path}[{key}]")]
    if isinstance(value, (tuple, list)):
        return [found for i, member in enumerate(value) for found in arrays(member, seen, f"{path}[{i}]")]
    if hasattr(value, "indptr"):
        return [(f"{path}.{name}", getattr(value, name)) for name in ("data", "indices", "indptr")]
    if is_dataclass(value):
        names = [field.name for field in fields(value)]
        return [found for name in names for found in arrays(getattr(value, name), seen, f"{path}.{name}")]
    return []


def test_no_array_that_is_handed_on_can_be_written(results, problem):
    pair = vf.build(problem)
    run = results["Run"]
    piece = piece_of(pair, run.last.g, run.last.contact.pattern)
    worked_out = {
        "neumann": {name: getattr(pair.neumann, name) for name in ("inverse", "root", "gram", "lift_gram")},
        "piece": {name: getattr(piece, name) for name in ("bound", "jump", "reaction", "basis")},
        "kernel": pair.interface.kernel,
        "contact": [run.contact, results["Solution"].contact],
    }
    given = [results, worked_out, pickle.loads(pickle.dumps(run)), pair, next(vf.iterate(pair, start=run.last.g))]
    found = arrays(given, set())
    assert len(found) > 80
    assert [path for path, array in found if array.flags.writeable] == []
    with pytest.raises(ValueError, match="read-only"):
        run.last.g[0] = 1.0


def test_what_a_result_holds_is_shown_on_one_line_too(results, problem):
    pair, run = vf.build(problem), results["Run"]
    shown = [repr(each) for each in (pair, pair.contact, pair.contact.grid, pair.contact.body, pair.interface)]
    shown += [repr(each) for each in (pair.on_meshes(), run.last, run.last.contact, run.contact, problem)]
    assert [text for text in shown if len(text) > 200 or "\n" in text] == []
    assert "7 contact nodes" in repr(pair)


def test_showing_a_result_computes_nothing(problem, monkeypatch):
    """A run is linearised when that is asked for, not by whoever looks at it."""
    run = vf.run(problem)
    monkeypatch.setattr("verification.algorithm.runs.linearise", None)
    monkeypatch.setattr("verification.algorithm.runs.forecast", None)
    document = run.to_dict()
    assert document["linearised_rate"] is None
    assert "linearise()" in document["reason"]["linearised_rate"]
    assert repr(run)
    assert "WHAT HAPPENED" in run._repr_html_()


def test_what_did_not_converge_is_called_no_solution_in_every_view(results, problem):
    """And the notebook names the change that a command reports on stderr."""
    short = replace(problem, iteration=replace(problem.iteration, max_iterations=3))
    steps = [{"increments": 2, "body2": {"prescribed": {"top": [0, "-0.01"]}}}]
    run, history = vf.run(short), vf.march(vf.Problem.from_dict(short.to_dict() | {"step": steps}))
    for result in (run, history):
        assert "last iterate, not a solution" in repr(result)
        assert "Last iterate, not a solution:" in result._repr_html_()
        assert "raise it, or change theta" in " ".join(result._repr_html_().split())
        figure = result.plot("bodies") if result is run else result.plot()
        assert "last iterate, not a solution" in " ".join(text.get_text() for text in figure.axes[0].texts)
    assert run.remedy.key == "iteration.max_iterations"
    assert vf.run(short.with_keys({run.remedy.key: run.remedy.value})).converged
    for result in (results["Run"], results["Solution"]):
        assert "not a solution" not in repr(result) + result._repr_html_()
    assert results["Run"].remedy is None


def test_what_has_no_screen_is_shown_as_its_document():
    S = np.diag([2.0, 3.0])
    run = vf.run(vf.build(S1=S, S2=np.eye(2), load2=np.array([0.0, -1.0]), x=np.array([0.0])))
    assert "ndtheory.run/1" in run._repr_html_()


def test_what_has_nothing_to_draw_says_so(problem):
    with pytest.raises(ValueError, match="next"):
        vf.advise_run("0.1", "1.4").plot()
    below = np.diag([-0.4, 0.3])
    with pytest.raises(ValueError, match="no eigenvalue is known to be 0"):
        vf.advise_vectors(VECTORS, -VECTORS @ below, kind="general").plot()


def test_the_figure_of_an_advice_has_a_proved_curve_only_where_something_is_proved(problem):
    local = problem.changed(law="local", radius=None)
    matrices = vf.advise_matrices(np.diag([1.0, 2.0]), np.eye(2))
    estimated = vf.advise_vectors(VECTORS, 1 - VECTORS @ np.diag([0.3, 2.0]), kind="tied")
    for advice, proved in ((vf.advise(problem), 2), (matrices, 2), (vf.advise(local), 0), (estimated, 0)):
        labels = [str(line.get_label()) for line in advice.plot().axes[0].get_lines()]
        assert sum(label.endswith("proved") for label in labels) == proved
        assert sum("predicted" in label for label in labels) == len(advice.roles)


def test_a_plane_in_which_no_bound_has_a_region_shows_its_runs(problem):
    point = Point(theta=0.4, k=0.01, outcome=Outcome.CONVERGED, iterations=12, coupled_residual=1e-9)
    reason = {"lmi": "62 contact nodes: worked out up to 61"}
    plane = Plane(title="none", regions={}, points=(point,), reason=reason, units=problem.units, problem=problem)
    for ax in plane.plot().axes:
        low, high = ax.get_ylim()
        assert low < point.k < high


class Heights(Document):
    """A result that no figure of ours is about."""

    schema = "heights/1"
    units = {"length": "m", "stress": "Pa"}

    def content(self):
        return {}


def test_a_type_of_result_has_the_figure_that_is_registered_for_it():
    with pytest.raises(ValueError, match="a Heights has no figure"):
        Heights().plot()

    class Higher(Heights):
        """Another one, so that the first stays without."""

    draw.register(Higher, lambda result, **options: f"drawn of {type(result).__name__}")
    assert Higher().plot() == "drawn of Higher"
    with pytest.raises(ValueError, match="a Heights has no figure"):
        Heights().plot()


def test_tables_are_plain_columns_of_one_length(results):
    run = results["Run"]
    table, contact = run.table(), run.contact.table()
    assert {len(column) for column in table.values()} == {run.evaluations}
    assert table["relative_residual"] == run.history
    assert [sum(row) for row in zip(table["stick"], table["slip"], table["open"], strict=True)] == [7] * run.evaluations
    assert {len(column) for column in contact.values()} == {7}
    assert contact["pressure"] == run.contact.pressure.tolist()
    json.dumps([table, contact])  # nothing but numbers and texts


def test_at_another_friction_a_document_carries_that_friction(problem):
    document = vf.run(vf.build(problem).at(friction="1/3")).to_dict()
    assert document["problem"]["contact"]["friction"] == "1/3"
    assert vf.Problem.from_dict(document["problem"]) == problem.changed(friction="1/3")


def test_a_file_a_problem_and_a_pair_are_taken_alike(problem, tmp_path):
    path = tmp_path / "problem.toml"
    path.write_text(problem.to_toml(), encoding="utf-8")
    pair = vf.build(problem)
    for function in (vf.run, vf.measure, vf.advise, vf.solve):
        answers = [replace_problem(function(given).to_dict()) for given in (problem, path, str(path), pair)]
        assert all(answer == answers[0] for answer in answers)


def replace_problem(document: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in document.items() if key != "problem"}


def test_with_other_settings_a_pair_runs_by_them(problem):
    pair = vf.build(problem)
    short = replace(pair, settings=replace(pair.settings, max_iterations=2))
    assert vf.run(short).iterations == 2


def test_a_run_too_short_for_its_small_theta_is_not_advised_to_take_a_smaller_one(problem):
    """Five steps at theta = 0.1 leave the residual and the joined state far from the solution, without a stall."""
    short = problem.changed(theta="0.1", max_iterations=5)
    run = vf.run(short)
    assert run.outcome == "limit"
    assert run.remedy.key == "iteration.theta"
    assert float(run.remedy.value) > 0.1
    longer = short.changed(theta=run.remedy.value, max_iterations=500)
    assert vf.run(longer).converged
