"""Every command is on the page of commands, with an example and all its options, and its document has a schema."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import click
import pytest

from verification.cli.main import cli, main

ROOT = Path(__file__).parents[2]
DOCUMENTS = (ROOT / "docs" / "json.md").read_text("utf-8")


@pytest.fixture(scope="module")
def pages():
    sys.path.append(str(ROOT / "docs"))
    try:
        from builder import commands, documents  # noqa: F401
    finally:
        sys.path.remove(str(ROOT / "docs"))
    return commands


def test_every_command_is_documented(pages):
    assert pages.undocumented(cli, "ndtheory", DOCUMENTS) == []


def test_each_block_of_the_page_is_what_the_command_prints_for_help(pages, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    blocks = re.findall(r"^## `ndtheory ([^`]+)`\n\n```text\n(.*?)\n```$", pages.page(cli, "ndtheory"), re.M | re.S)
    assert {*cli.commands, "advise run"} < {typed for typed, _ in blocks}
    for typed, shown in blocks:
        assert main([*typed.split(), "--help"]) == 0
        assert capsys.readouterr().out == f"{shown}\n"
        assert max(map(len, shown.splitlines())) <= 80
        assert "\b" not in shown


def test_a_command_without_a_page_or_a_schema_is_found(pages):
    group = click.Group("ndtheory", commands={name: command for name, command in cli.commands.items() if name == "run"})
    inner = click.Group("mine", help="Several.\n\n\b\nExample:\n  ndtheory mine forces")

    @inner.command()
    @click.option("--largest", is_flag=True)
    def forces(largest: bool) -> None:
        """Say what I compute."""

    group.add_command(inner)
    assert pages.undocumented(group, "ndtheory", DOCUMENTS) == [
        "ndtheory mine: no schema on the page of documents",
        "ndtheory mine forces: no example in its help",
        "ndtheory mine forces: no help for --largest",
        "ndtheory mine forces: no schema on the page of documents",
    ]
    forces.help = "Say it.\n\n\b\nExample:\n  ndtheory mine forces"
    forces.params[0].help = "Only the largest."
    assert (
        pages.undocumented(group, "ndtheory", DOCUMENTS + "\nWritten by `ndtheory mine`, `ndtheory mine forces`.\n")
        == []
    )
    assert "## `ndtheory mine forces`" in pages.page(group, "ndtheory")


def test_types_on_the_page_of_documents_have_the_names_of_parts_in_bold(pages):
    shown = sys.modules["builder"].documents.shown
    assert shown("list of Reading of a run") == "list of **Reading of a run**"
    assert (shown("Number"), shown("list of list of number")) == ("**Number**", "list of list of number")
