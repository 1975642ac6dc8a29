"""``compare --bounds``: some of the bounds, by their names."""

import pytest

from verification.bounds.table import chosen
from verification.registry import BOUNDS

KNOWN = ", ".join(BOUNDS)


def test_only_the_bounds_that_are_named_are_worked_out(call, write):
    answer = call("compare", write(), "--bounds", "energy,printed", "--full")
    assert answer.status == 0
    table = answer.out[answer.out.index("DOES ONE STEP CONTRACT?") : answer.out.index("WHAT HAPPENED")]
    assert [line.split()[0] for line in table.splitlines()[3:5]] == ["printed", "energy"]
    assert "repaired" not in table
    assert "SEMIDEFINITE" not in answer.out
    ends = [" ".join(line.split()) for line in answer.out.splitlines()]
    for name in ("repaired", "lmi"):
        assert f"{name} not computed not asked for" in ends


def test_the_document_and_the_report_say_what_was_not_asked_for(call, write, tmp_path, quick):
    folder = tmp_path / "results"
    answer = call("compare", write(), "--bounds", "energy", "--json", "-o", folder)
    assert answer.document["verdicts"]["lmi"] == "NOT_COMPUTED"
    assert answer.document["reasons"]["lmi"] == answer.document["reason"]["lmi"] == "not asked for"
    report = (folder / "report.html").read_text("utf-8")
    assert report.count("not asked for") == len(chosen(None)) - 1


@pytest.mark.parametrize(
    ("names", "says"),
    [
        ("enrgy", f"no bound 'enrgy', there are {KNOWN}; did you mean 'energy'?"),
        ("", f"needed one bound at least of {KNOWN}"),
        ("lmi,energy,x", f"no bound 'x', there are {KNOWN}"),
    ],
)
def test_what_is_no_bound_is_one_line(call, write, names, says):
    assert call("compare", write(), "--bounds", names).complaint == (f"ndtheory compare: --bounds = {names}: {says}")


def test_nothing_can_be_exact_where_no_bound_can_be_brought_closer(call, write):
    says = call("compare", write(), "--exact", "--bounds", "energy").complaint
    assert "received --exact with --bounds energy: needed a bound among them that can be brought closer" in says
