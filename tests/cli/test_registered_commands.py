"""Commands with a bound, a rule and a law that are registered."""

import pytest
from made_up import Cautious, Exponential, Finding, Halfway, TooGood

from verification.registry import BOUNDS, LAWS, RULES


@pytest.mark.parametrize(
    ("bound", "status", "verdict"),
    [(Halfway(), 0, "consistent"), (TooGood(), 1, "violated"), (Finding(), 0, "violated")],
    ids=["true", "violated", "a finding"],
)
def test_a_registered_bound_has_its_verdict_on_the_screen_and_its_exit_status(
    call, write, monkeypatch, bound, status, verdict
):
    monkeypatch.setitem(BOUNDS, bound.name, bound)
    answer = call("compare", write(), "--bounds", f"energy,{bound.name}", "--full")
    assert answer.status == status
    rows = answer.out[answer.out.index("DOES THE RUN AGREE") :].splitlines()
    assert any(row.split("  ")[1].strip() == bound.name and verdict in row for row in rows if row.startswith("  "))
    assert ("a proved bound is violated" in answer.err) == bool(status)


def test_a_registered_rule_and_a_registered_law_are_named_by_options(call, write, monkeypatch):
    monkeypatch.setitem(RULES, "cautious", Cautious())
    monkeypatch.setitem(LAWS, "made-up", Exponential)
    answer = call("run", write(), "--relaxation", "cautious", "--set", "contact.law=made-up")
    assert answer.status == 0
    assert "with the cautious relaxation" in answer.out
    assert "exponential, r = 0.3 mm" in answer.out


def test_names_of_bounds_are_those_of_the_moment(call, write, monkeypatch):
    known = ", ".join(BOUNDS)
    assert call("compare", write(), "--bounds", "halfway").complaint.endswith(f"there are {known}")
    monkeypatch.setitem(BOUNDS, "halfway", Halfway())
    assert call("compare", write(), "--bounds", "no").complaint.endswith(f"there are {known}, halfway")
