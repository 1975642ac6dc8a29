"""The whole ledger, computed once, and the command on its rows."""

import json
from dataclasses import replace

import pytest
from ledger_calls import Whole

from verification import ledger
from verification.ledger import sources


@pytest.fixture(scope="session")
def whole(evidence):
    """Made of the evidence of all sources, each asked once in the session."""

    def source(name):
        found, shares = evidence(name)

        def again(ids, level, watch):
            for share in shares:
                watch(share)
            return found

        return again

    told, gathered = [], {name: source(name) for name in sources.SOURCES}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sources, "SOURCES", gathered)
        return Whole(ledger.verify(watch=lambda what, share: told.append((what, share))), told)


@pytest.fixture
def kept(whole, monkeypatch):
    """The command on the rows of the whole ledger, computed once; ``kept(change)`` puts other rows in their place."""

    def use(change=lambda row: row):
        def answer(ids=(), *, level="quick", watch=None):
            chosen = tuple(change(row) for row in whole.ledger.rows if not ids or row.statement.id in ids)
            return replace(whole.ledger, rows=chosen, level=level)

        monkeypatch.setattr(ledger, "verify", answer)

    use()
    return use


@pytest.fixture(scope="session")
def document(whole):
    """The document of the whole ledger."""

    def refuse(name):
        raise AssertionError(f"{name} in a JSON document")

    return json.loads(whole.ledger.to_json(), parse_constant=refuse)
