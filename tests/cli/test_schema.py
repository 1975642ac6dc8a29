"""``ndtheory schema`` prints what ``vf.schema`` returns, and refuses other names."""

from __future__ import annotations

import json

import pytest
from processes import ended

import verification as vf
from verification.schemas import names


@pytest.mark.parametrize("name", names())
def test_the_command_prints_the_schema_of_each_document(call, name):
    printed = json.loads(call("schema", name).out)
    assert printed == vf.schema(name) == vf.schema(printed["title"])


def test_a_process_of_its_own_has_the_parts_of_every_document():
    """No other test has imported the modules of a part before."""
    code = "import verification as vf; from verification.schemas import names; [vf.schema(name) for name in names()]"
    found = ended(code)
    assert (found.returncode, found.stderr) == (0, "")


def test_the_command_lists_the_documents(call):
    assert call("schema").out.split()[: len(names())] == names()


def test_an_unknown_document_is_refused(call):
    found = call("schema", "runs")
    assert (found.status, found.out, found.err.count("\n")) == (2, "", 1)
    assert "did you mean 'run'?" in found.err
