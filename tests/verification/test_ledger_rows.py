"""How evidence becomes a verdict, and that the recorded verdicts are those the checks earn."""

import itertools

import pytest

from ndtheory.statements import statements
from ndtheory.symbolic import checks
from verification.ledger import Evidence
from verification.ledger.evidence import METHODS, settle
from verification.ledger.rows import exact, recorded

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
        ([("discrete", "printed", True), ("reading", "printed", True)], "NUMERICAL"),
        ([("dimension", "printed", True)], "INCONCLUSIVE"),  # equal units say nothing
        ([("dimension", "printed", True), ("reading", "printed", True)], "ASSUMED"),
        ([("symbolic", "printed", False)], "REFUTED"),
        ([("discrete", "printed", False)], "REFUTED"),
        ([("symbolic", "printed", False), ("symbolic", "repaired", True)], "REPAIRED"),
        ([("symbolic", "step", False), ("symbolic", "repaired", True)], "REPAIRED"),
        ([("dimension", "printed", False), ("symbolic", "repaired", True)], "REPAIRED"),
        ([("reading", "step", False), ("reading", "repaired", True)], "REPAIRED"),
        ([("symbolic", "printed", False), ("dimension", "repaired", True)], "REFUTED"),
        ([("symbolic", "printed", False), ("discrete", "repaired", True)], "REFUTED"),
        ([("symbolic", "printed", False), ("symbolic", "repaired", False)], "INCONCLUSIVE"),
        ([("symbolic", "step", False), ("symbolic", "repaired", None), ("reading", "repaired", True)], "INCONCLUSIVE"),
        ([("symbolic", "printed", None), ("symbolic", "step", True)], "INCONCLUSIVE"),
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
            assert any(of != "repaired" and holds is False for _, of, holds in kinds)


def test_the_order_of_evidence_does_not_matter():
    for kinds in itertools.combinations(KINDS, 2):
        assert settle(seen(*kinds)) == settle(seen(*kinds[::-1]))


def test_every_statement_has_a_recorded_verdict_and_nothing_else_has():
    assert list(recorded()) == list(statements())


def test_every_fault_has_a_verdict_that_says_so():
    for id, statement in statements().items():
        assert (recorded()[id] in ("REPAIRED", "REFUTED")) == bool(statement.fault), id


def test_every_row_recorded_as_proved_rests_on_exact_arithmetic():
    proved = {id for id, verdict in recorded().items() if verdict == "PROVED"}
    assert proved <= {check.id for check in checks()}
    found = exact(proved, "quick", lambda share: None)
    for id in proved:
        assert all(e.holds for e in found[id]), id
        assert any(e.method == "symbolic" for e in found[id]), id
