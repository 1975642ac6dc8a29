"""A comparison of some bounds: the others are left out, and all that takes longer than the run with them."""

from dataclasses import replace

import pytest
from made_up import Halfway, Slow
from problem_list import small

import verification as vf
from verification import comparison
from verification.algorithm.rates import largest_step_ratio
from verification.bounds.bound import NOT_ASKED
from verification.bounds.table import chosen
from verification.figures.factor import draw_proved
from verification.registry import BOUNDS, PROOFS, Prover

pytestmark = pytest.mark.usefixtures("known_bounds")

PROBLEM = vf.Problem.from_dict(small())
QUICK = ("printed", "repaired", "energy")
KNOWN = ", ".join(BOUNDS)
BY_DEFAULT = tuple(name for name, bound in BOUNDS.items() if not bound.on_request)


@pytest.fixture
def worked_out(monkeypatch):
    """The names of what is worked out."""
    seen = []
    for kind in {type(bound) for bound in BOUNDS.values()}:

        def evaluate(self, *args, before=kind.evaluate, **options):
            seen.append(self.name)
            return before(self, *args, **options)

        monkeypatch.setattr(kind, "evaluate", evaluate)
    reference, losses = comparison.by_cvxpy_alone, PROOFS["losses"].of
    made = lambda *args, **given: seen.append("losses") or losses(*args, **given)
    monkeypatch.setattr(comparison, "by_cvxpy_alone", lambda run: seen.append("reference") or reference(run))
    monkeypatch.setitem(PROOFS, "losses", Prover("losses", made))
    return seen


class Heard(comparison.Listener):
    """The names of the parts that are told, with the bounds."""

    def __init__(self):
        self.told = []

    def __getattribute__(self, name):
        if name in ("constants", "bounds", "run", "cvxpy", "losses", "programs"):
            return lambda *parts: self.told.append((name, [r.name for r in parts[0]] if name in BOUND_PARTS else []))
        return super().__getattribute__(name)


BOUND_PARTS = ("bounds", "programs")


def test_a_bound_that_was_not_asked_for_is_not_computed_and_says_so(worked_out):
    found = vf.compare(PROBLEM, bounds=QUICK)
    assert worked_out == list(QUICK)
    assert (found.verdicts["lmi"].verdict, found.verdicts["lmi"].reason) == ("NOT_COMPUTED", NOT_ASKED)
    document = found.to_dict()
    assert (document["verdicts"]["lmi"], document["reason"]["lmi"]) == ("NOT_COMPUTED", NOT_ASKED)
    assert document["lmi"] is None
    for name in ("losses", "cvxpy"):
        assert document[name] is None
        assert document["reason"][name] == "not asked for: it comes with lmi"
    assert [row.name for row in found.computed] == list(QUICK)


def test_what_was_asked_for_is_what_a_whole_comparison_has(worked_out):
    whole, some = vf.compare(PROBLEM).to_dict(), vf.compare(PROBLEM, bounds="energy,repaired").to_dict()
    assert some["energy"] == whole["energy"]
    for name in ("repaired", "energy"):
        assert some["bounds"]["editions"][name] == whole["bounds"]["editions"][name]
    assert (some["bounds"]["editions"]["printed"], some["bounds"]["reason"]["printed"]) == (None, NOT_ASKED)
    assert some["run"] == whole["run"]
    assert {name: some["reasons"][name] for name in ("repaired", "energy", "linearised")} == {
        name: whole["reasons"][name] for name in ("repaired", "energy", "linearised")
    }


def test_a_bound_that_takes_the_matrices_brings_what_takes_long(worked_out):
    found = vf.compare(PROBLEM, bounds=["lmi"])
    assert worked_out == ["reference", "losses", "lmi"]
    assert found.losses is not None
    assert found.cvxpy is not None
    assert found.bounds["energy"].not_computed == NOT_ASKED


@pytest.mark.parametrize("bounds", [None, ("lmi",), QUICK, BY_DEFAULT], ids=str)
def test_parts_are_told_again_as_they_were_told_first(bounds):
    first, again = Heard(), Heard()
    vf.compare(PROBLEM, bounds=bounds, listener=first).tell(again)
    assert again.told == first.told
    names = [name for part, listed in first.told for name in listed]
    assert names == list(bounds or BY_DEFAULT)
    slow = {"cvxpy", "losses", "programs"} & {part for part, _ in first.told}
    assert len(slow) == (0 if bounds == QUICK else 3)


def test_all_names_are_no_names(worked_out):
    assert vf.compare(PROBLEM, bounds=BY_DEFAULT).to_json() == vf.compare(PROBLEM).to_json()


def test_outside_the_theorem_too_a_bound_that_was_not_asked_for_is_not_computed():
    found = vf.compare(PROBLEM.changed(law="local"), bounds=["energy"])
    assert found.verdicts["energy"].verdict == "HYPOTHESES_NOT_MET"
    assert found.verdicts["repaired"].reason == NOT_ASKED


@pytest.mark.parametrize(("law", "drawn"), [("nonlocal", [True, True]), ("local", [False, False])])
def test_a_figure_shows_a_bound_only_where_the_theorem_applies(law, drawn):
    found = vf.compare(PROBLEM.changed(law=law), bounds=["energy"])
    assert found.bounds["energy"].factor is not None
    labels = [figure.axes[0].get_legend_handles_labels()[1] for figure in (found.plot(), draw_proved(found))]
    assert all(labels)
    assert [any("energy" in label for label in each) for each in labels] == drawn


def test_names_are_those_of_the_moment(monkeypatch):
    for bound in (Halfway(), Slow()):
        monkeypatch.setitem(BOUNDS, bound.name, bound)
    found = vf.compare(PROBLEM, bounds=["halfway"])
    assert [name for name, row in found.bounds.items() if row.asked] == ["halfway"]
    assert found.reason["losses"] == "not asked for: it comes with lmi or slow"
    assert vf.compare(PROBLEM, bounds=["slow"]).cvxpy is not None


@pytest.mark.parametrize(
    ("bounds", "message"),
    [
        ("enrgy", f"no bound 'enrgy', there are {KNOWN}; did you mean 'energy'?"),
        (["lmi", "x\n"], f"no bound 'x\\n', there are {KNOWN}"),
        ((), f"needed one bound at least of {KNOWN}"),
        ("", f"needed one bound at least of {KNOWN}"),
        (" , ", f"needed one bound at least of {KNOWN}"),
    ],
)
def test_an_unknown_name_and_none_are_refused_with_the_names_there_are(bounds, message):
    with pytest.raises(ValueError) as caught:
        vf.compare(PROBLEM, bounds=bounds)
    assert str(caught.value) == message


def test_names_are_taken_in_the_order_of_the_table():
    assert chosen(["lmi", "printed", "lmi"]) == ("printed", "lmi")
    assert chosen(None) == BY_DEFAULT == ("printed", "repaired", "energy", "lmi")


def test_a_bound_on_request_is_worked_out_judged_in_its_norm_and_written_only_then():
    found = vf.compare(PROBLEM, bounds=["lyapunov"])
    bound, document = found.bounds["lyapunov"], found.to_dict()
    written = document["lyapunov"]
    assert written["factor"]["value"] == bound.factor.value < 1
    assert written["condition"] == bound.norm.condition > 1
    assert written["radius"] <= written["factor"]["value"]
    assert written["verdict"] == document["verdicts"]["lyapunov"] == "CONSISTENT"
    assert written["factor_best"]["value"] <= written["factor"]["value"] * 1.01
    in_its_norm = largest_step_ratio(found.run.pair, found.run.iterates, bound.norm)
    assert f"{in_its_norm.value:.4g}" in found.verdicts["lyapunov"].reason
    without = vf.compare(PROBLEM, bounds=["energy"])
    assert "lyapunov" not in without.to_dict()
    assert "lyapunov" not in without.verdicts


# --- what a comparison says beside its bounds -------------------------------------------------------------------------


def test_why_no_bound_judges_a_run_by_another_rule_is_said_once():
    problem = vf.example("section6").changed(cells=((10, 2), (6, 2)), radius="0.2")
    accelerated = problem.with_keys({"iteration.relaxation": "aitken"})
    assert "outside the theorem: " in vf.compare(accelerated, bounds=("energy",)).verdicts["energy"].reason
    momentum = {"iteration.relaxation": "momentum", "contact.friction": "0"}
    said = vf.compare(problem.with_keys(momentum), bounds=("energy",)).verdicts["energy"].reason
    assert "the bounds hold for a constant theta, not for momentum" in said
    assert "constant theta" not in vf.compare(problem, bounds=("energy",)).verdicts["energy"].reason


def test_a_missing_step_ratio_has_its_reason_and_another_one_has_none():
    problem = vf.example("section6").changed(cells=((10, 2), (6, 2)), radius="0.2")
    found = vf.compare(problem, bounds=("energy",))
    assert found.step_ratio is not None
    assert "step_ratio" not in found.to_dict()["reason"]
    closing = {"contact.gap": "0.01499999999999995", "iteration.tolerance": "0.5"}
    lost = vf.compare(problem.with_keys(closing), bounds=("energy",))
    assert lost.step_ratio is None
    assert lost.to_dict()["reason"]["step_ratio"] == "no step is clear of rounding"


def test_a_forecast_that_fails_is_no_violated_proof():
    found = vf.compare(vf.example("section6").changed(cells=((10, 2), (6, 2)), radius="0.2"), bounds=("energy",))
    wrong = replace(found.verdicts["energy"], verdict="VIOLATED")
    assert not replace(found, verdicts=found.verdicts | {"linearised": wrong}).proved_violated
    assert replace(found, verdicts=found.verdicts | {"energy": wrong}).proved_violated
