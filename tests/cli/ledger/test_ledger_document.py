"""The ledger as one JSON document: keys, levels, reasons, and counterexamples in rationals."""

import math
from fractions import Fraction

from ledger_calls import KEYS, METHODS, OF, RAW, STATEMENTS, VERDICTS

import ndtheory
from verification.ledger.evidence import settle


def plain_numbers(part):
    """Every number below a part of a document."""
    if isinstance(part, dict):
        part = list(part.values())
    if isinstance(part, list):
        for value in part:
            yield from plain_numbers(value)
    elif isinstance(part, (int, float)) and not isinstance(part, bool):
        yield part


def unexplained(part, explained=frozenset(), path=""):
    """Paths of nulls for which no object on the way names a reason; an undecided `holds` has its text."""
    if isinstance(part, dict):
        explained = explained | set(part.get("reason") or {})
        for key, value in part.items():
            undecided = key == "holds" and part.get("text")
            if value is None and key not in explained and not undecided:
                yield f"{path}.{key}"
            yield from unexplained(value, explained, f"{path}.{key}")
    elif isinstance(part, list):
        for i, value in enumerate(part):
            yield from unexplained(value, explained, f"{path}[{i}]")


def test_json_puts_one_document_on_stdout_and_nothing_on_stderr(call, kept, document):
    answer = call("verify", "--json")
    assert (answer.status, answer.err) == (0, "")
    assert answer.document == document


def test_the_document_names_its_schema_version_units_level_and_counts(document):
    assert document["schema"] == "ndtheory.ledger/1"
    assert document["version"] == ndtheory.__version__
    assert isinstance(document["units"], dict)
    assert document["level"] == "quick"
    verdicts = [s["verdict"] for s in document["statements"]]
    assert document["counts"] == {verdict: verdicts.count(verdict) for verdict in set(verdicts)}


def test_every_statement_of_the_document_has_the_keys_of_the_interface(document):
    assert [s["id"] for s in document["statements"]] == list(STATEMENTS)
    for s in document["statements"]:
        assert set(s) >= KEYS
        assert all(isinstance(s[key], str) for key in KEYS - {"evidence"})
        assert all(s[key] for key in KEYS - {"note"})
        assert s["verdict"] in VERDICTS
        assert s["method"] in METHODS
        assert set(s["leans_on"]) <= set(STATEMENTS)
        assert ("fault" in s) == bool(STATEMENTS[s["id"]].fault)


def test_every_piece_of_evidence_has_a_method_an_object_an_outcome_and_a_text(document):
    for s in document["statements"]:
        assert s["evidence"]
        for e in s["evidence"]:
            assert {"method", "of", "holds", "text"} <= set(e) <= {"method", "of", "holds", "text", "data"}
            assert e["method"] in METHODS
            assert e["of"] in OF
            assert e["holds"] in (True, False, None)
            assert e["text"].strip()
            assert RAW.findall(e["text"]) == []


def test_the_evidence_of_a_statement_comes_strongest_first_and_holds_what_decided(document):
    order = ["symbolic", "dimension", "verified", "discrete", "reading"]
    for s in document["statements"]:
        places = [order.index(e["method"]) for e in s["evidence"]]
        assert places == sorted(places)
        assert s["method"] in {e["method"] for e in s["evidence"]}


def test_floating_point_proves_nothing(document):
    for s in document["statements"]:
        exact = [e for e in s["evidence"] if e["method"] == "symbolic" and e["holds"]]
        if s["verdict"] == "PROVED":
            assert s["method"] == "symbolic"
            assert exact
            assert all(e["holds"] for e in s["evidence"])
        if s["verdict"] == "NUMERICAL":
            assert not exact
        if s["verdict"] in ("REPAIRED", "REFUTED"):
            assert any(e["holds"] is False and e["of"] != "repaired" for e in s["evidence"])


def test_no_verdict_rests_on_units(whole):
    for row in whole.ledger.rows:
        assert settle([e for e in row.evidence if e.method != "dimension"]) == (row.verdict, row.method)


def test_every_number_of_the_document_is_finite(document):
    numbers = list(plain_numbers(document))
    assert numbers
    assert all(map(math.isfinite, numbers))


def test_a_null_has_a_reason_beside_it(document):
    assert list(unexplained(document)) == []


def test_an_exact_counterexample_is_made_of_rationals(document):
    refuted = 0
    for s in document["statements"]:
        for e in s["evidence"]:
            at = e.get("data", {}).get("counterexample")
            assert at is None or (e["method"] == "symbolic" and e["holds"] is False and at)
            if at is not None:
                refuted += bool(at)  # numbers alone need no point: the text names them
                assert all(isinstance(value, str) and str(Fraction(value)) == value for value in at.values())
    assert refuted


def test_the_counterexample_to_5_30_is_one(document):
    row = next(s for s in document["statements"] if s["id"] == "5.30")
    (at,) = (
        e["data"]["counterexample"]
        for e in row["evidence"]
        if e["method"] == "symbolic" and e["of"] == "printed" and not e["holds"]
    )
    e, kappa, m = (Fraction(at[name]) for name in ("e", "kappa", "lambda"))
    M, C_R, C_K = 2 * m, 1, kappa * m
    bound = C_K / m**2 * (M * C_R + C_K + Fraction(math.isqrt(int(C_K * m))) + 1) * M**2 / m * e**2
    assert C_K * m == math.isqrt(int(C_K * m)) ** 2
    assert kappa**2 * e**2 > bound


def test_random_evidence_says_its_seed_and_how_much_was_tried(document):
    random = 0
    for s in document["statements"]:
        for e in s["evidence"]:
            data = e.get("data", {})
            assert (e["method"] != "discrete") or data
            if {"cases", "pairs"} & set(data):
                random += 1
                assert isinstance(data["seed"], int)
                assert all(data[key] > 0 for key in {"cases", "pairs"} & set(data))
                assert data["problems"]
    assert random
