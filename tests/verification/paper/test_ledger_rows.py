"""How evidence becomes a verdict, and that the recorded verdicts are those the checks earn."""

import itertools

import pytest

from ndtheory.statements import recorded, statements
from ndtheory.symbolic.checks import checks
from ndtheory.symbolic.engine import Check, equal
from verification.ledger import Evidence
from verification.ledger.evidence import METHODS, settle
from verification.ledger.inequalities import INEQUALITIES
from verification.ledger.sources import exact

OF = ("printed", "step", "repaired")
HOLDS = (True, False, None)
KINDS = list(itertools.product(METHODS, OF, HOLDS))


def seen(*kinds):
    return [Evidence(method=method, of=of, holds=holds, text="") for method, of, holds in kinds]


def verdict(*kinds):
    return settle(seen(*kinds))[0]


@pytest.mark.parametrize(
    ("kinds", "expected"),
    [
        ([("symbolic", "printed", True)], "PROVED"),
        ([("symbolic", "repaired", True)], "PROVED"),  # a fact of ours
        ([("discrete", "printed", True)], "NUMERICAL"),
        ([("reading", "printed", True)], "ASSUMED"),
        ([("discrete", "printed", True), ("reading", "printed", True)], "ASSUMED"),  # a definition stays one
        ([("discrete", "printed", False), ("reading", "printed", True)], "REFUTED"),
        ([("dimension", "printed", True)], "INCONCLUSIVE"),  # equal units say nothing
        ([("dimension", "printed", True), ("reading", "printed", True)], "ASSUMED"),
        ([("symbolic", "printed", False)], "REFUTED"),
        ([("discrete", "printed", False)], "REFUTED"),
        ([("symbolic", "printed", False), ("symbolic", "repaired", True)], "REPAIRED"),
        ([("symbolic", "step", False), ("symbolic", "repaired", True)], "REPAIRED"),
        ([("dimension", "printed", False), ("symbolic", "repaired", True)], "INCONCLUSIVE"),  # units refute nothing
        ([("dimension", "printed", False), ("reading", "step", False), ("symbolic", "repaired", True)], "REPAIRED"),
        ([("reading", "step", False), ("reading", "repaired", True)], "REPAIRED"),
        ([("symbolic", "printed", False), ("dimension", "repaired", True)], "REFUTED"),
        ([("symbolic", "printed", False), ("discrete", "repaired", True)], "REFUTED"),
        ([("symbolic", "printed", False), ("symbolic", "repaired", False)], "INCONCLUSIVE"),
        ([("symbolic", "step", False), ("symbolic", "repaired", None), ("reading", "repaired", True)], "INCONCLUSIVE"),
        ([("symbolic", "printed", None), ("symbolic", "step", True)], "INCONCLUSIVE"),
        ([("verified", "printed", False)], "REFUTED"),
        ([("verified", "printed", False), ("symbolic", "repaired", True)], "REPAIRED"),
        ([("verified", "printed", True)], "NUMERICAL"),  # on one problem alone
        ([("verified", "printed", True), ("reading", "printed", True)], "ASSUMED"),
        ([("discrete", "printed", None)], "INCONCLUSIVE"),
        ([("discrete", "printed", None), ("reading", "printed", True)], "INCONCLUSIVE"),
        ([("symbolic", "printed", True), ("discrete", "printed", None)], "PROVED"),
        ([("symbolic", "printed", True), ("discrete", "printed", False)], "REFUTED"),  # a bug, and shown as one
        ([], "INCONCLUSIVE"),
    ],
)
def test_what_the_strongest_evidence_decides(kinds, expected):
    assert verdict(*kinds) == expected


def test_nothing_is_proved_on_floating_point_units_or_reading():
    for kinds in itertools.combinations(KINDS, 3):
        if verdict(*kinds) == "PROVED":
            assert any(method == "symbolic" and holds for method, _, holds in kinds)
            assert not any(holds is False for _, _, holds in kinds)


def test_nothing_is_repaired_without_a_proof_of_the_repair():
    for kinds in itertools.combinations(KINDS, 3):
        if verdict(*kinds) == "REPAIRED":
            assert any(m in ("symbolic", "reading") and of == "repaired" and holds for m, of, holds in kinds)
            assert any(m != "dimension" and of != "repaired" and holds is False for m, of, holds in kinds)


def test_the_order_of_evidence_does_not_matter():
    for kinds in itertools.combinations(KINDS, 2):
        assert settle(seen(*kinds)) == settle(seen(*kinds[::-1]))


def test_every_statement_has_a_recorded_verdict_and_nothing_else_has():
    assert list(recorded()) == list(statements())


def test_every_fault_has_a_verdict_that_says_so():
    for id, statement in statements().items():
        assert (recorded()[id] in ("REPAIRED", "REFUTED")) == bool(statement.fault), id


def test_every_row_recorded_as_proved_rests_on_exact_arithmetic(evidence):
    proved = {id for id, verdict in recorded().items() if verdict == "PROVED"}
    assert proved <= {check.id for check in checks()}
    found, _ = evidence("exact arithmetic and units")
    for id in proved:
        assert all(e.holds for e in found[id]), id
        assert any(e.method == "symbolic" for e in found[id]), id


def grounds(id):
    """Every statement that a proof of this one uses, directly or not."""
    reached, new = set(), {id}
    while new:
        new = {ground for one in new for ground in statements()[one].leans_on} - reached
        reached |= new
    return reached


def test_nothing_proved_leans_on_what_was_only_seen_on_examples():
    numerical = {id for id, verdict in recorded().items() if verdict == "NUMERICAL"}
    assert numerical
    for id, verdict in recorded().items():
        if verdict in ("PROVED", "REPAIRED"):
            assert grounds(id) & numerical == set(), id


def test_only_experiments_are_numerical():
    found = {id for id, verdict in recorded().items() if verdict == "NUMERICAL"}
    assert {statements()[id].kind for id in found} == {"experiment"}


@pytest.mark.parametrize("id", [s.id for s in statements().values() if s.kind == "law"])
def test_a_law_is_assumed_or_mended_and_never_proved_or_seen(id):
    assert recorded()[id] in ("ASSUMED", "REPAIRED")


@pytest.mark.parametrize("id", ["4.1", "4.4", "4.5", "4.9.1", "4.9.3", "5.4", "5.5", "5.6", "5.20", "5.34"])
def test_definitions_and_the_theorems_of_others_are_assumed(id):
    assert recorded()[id] == "ASSUMED"
    assert statements()[id].reading


@pytest.mark.parametrize("id", ["a-b", "5.41", "5.45", "5.46", "C1", "C6"])
def test_what_is_right_in_a_fixed_unit_of_stress_is_proved_with_a_note_on_units(id):
    assert recorded()[id] == "PROVED"
    assert "unit" in statements()[id].note
    forms = [check.forms for check in checks() if check.id == id]
    assert any("printed" in form for form in forms)


def test_one_case_refutes_and_proves_nothing(monkeypatch):
    one = Check(
        id="2.2",
        text="one bar",
        goals=lambda form: equal(form, 1),
        forms={"printed": 1, "repaired": 2},
        mutants={},
        one_case=True,
    )
    monkeypatch.setattr("verification.ledger.sources.checks", lambda: [one])
    found = exact(["2.2"], "quick", lambda share: None)["2.2"]
    assert [(e.method, e.of, e.holds) for e in found] == [("reading", "printed", True), ("symbolic", "repaired", False)]
    assert settle(found[:1])[0] == "ASSUMED"


@pytest.mark.parametrize("id", ["2.2", "3.1.1", "3.1.2", "3.1.3", "4.9.2", "4.9.3", "5.8"])
def test_a_bar_a_node_or_a_strip_is_called_one_case(id):
    assert all(check.one_case for check in checks() if check.id == id)


def test_no_bound_is_compared_with_the_very_number_it_is_made_of():
    """A constant of the mesh is the largest of some eigenvalues: that each is at most the largest shows nothing."""
    assert {i.id for i in INEQUALITIES} & {"4.1", "4.3", "x-max-suffices"} == set()
    assert [i.of for i in INEQUALITIES if i.id in ("4.8", "prop-4.1.1")] == ["repaired", "repaired"]
