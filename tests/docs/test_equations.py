"""The index of equations finds what names a statement, and nothing that does not."""

import re

import pytest

from ndtheory.statements import statements
from verification.ledger import quote


@pytest.fixture(scope="module")
def equations(builder):
    return builder.equations


@pytest.fixture(scope="module")
def entries(equations):
    """Label -> the lines below it."""
    parts = equations.page().split("\n## ")[1:]
    return {part.splitlines()[0]: part for part in parts}


def test_every_statement_has_an_entry_with_its_verdict(entries):
    assert len(entries) == len(statements())
    for statement in statements().values():
        assert f"[{quote(statement.id)}](ledger.md)" in entries[f"{statement.label}: {statement.title}"]


def test_a_number_leads_to_its_code_its_tests_and_its_pages(entries):
    entries = {heading.split(":")[0]: text for heading, text in entries.items()}
    assert "`verification.contact.kkt.KKT`" in entries["(2.4)"]
    assert "`ndtheory.bounds.one_minus_h1`" in entries["(5.39)"]
    assert re.search(r"`verification/paper/test_ledger_discrete\.py::\w+`", entries["(5.13)"])
    assert "{doc}`/theory`" in entries["(5.30)"]


def test_a_number_between_quotation_marks_counts_in_tables_of_checks_alone(equations):
    statement = statements()["2.2"]
    texts = [("verification.coupling.roles", 'young = "2.2"'), ("verification.ledger.solutions", 'CHECKS = {"2.2": f}')]
    assert equations.places(statement, texts) == ["verification.ledger.solutions"]
    assert equations.places(statement, [("verification.x", "Hooke's law (2.2)"), ("y", "(2.20), 2.2")]) == [
        "verification.x"
    ]


def test_most_statements_of_section_5_have_code_and_tests(equations):
    numbered = [s for s in statements().values() if re.fullmatch(r"5\.\d+", s.id)]
    with_code = [s.id for s in numbered if equations.places(s, equations.code())]
    with_tests = [s.id for s in numbered if equations.places(s, equations.tests())]
    assert len(with_code) == len(numbered)
    assert len(with_tests) > len(numbered) / 2
