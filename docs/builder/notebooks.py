"""Each page with code cells as a notebook to download: its text, its visible cells, and no solution."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from verification.ledger import quote

#: What the first cell of code begins with, so that the first cell is that of the page.
FIRST = "# Needs ndtheory (see its README) and Jupyter; figures are drawn below the cells.\n%matplotlib inline\n\n"

GLUE = re.compile(r"\{glue:text\}`([^`:]+)(?::[^`]*)?`")
LEDGER = re.compile(r"\{(?:verdict|ledger)\}`([^`]+)`")
ROLE = re.compile(r"\{([a-z:]+)\}`(?:([^`<]*?) ?<([^`>]*)>|([^`]*))`")
EQUATION = re.compile(r"(\s?)\$\$ \(([\w-]+)\)[ \t]*$", re.MULTILINE)
LABEL = re.compile(r"^:label: *([\w-]+)$", re.MULTILINE)
TARGET = re.compile(r"^\([\w-]+\)=\n", re.MULTILINE)
FENCE = re.compile(
    r"^([:`]{3,}) ?\{([a-z:]+)\}(?: +([^\n]*))?\n(?P<options>(?::[\w-]+:[^\n]*\n)*)(.*?)^\1 *$",
    re.DOTALL | re.MULTILINE,
)

#: A comment, as that which puts a paragraph on a slide.
COMMENT = re.compile(r"^% .*\n\n?", re.MULTILINE)

#: The line of what a page needs, which is emphasised as a whole.
NEEDS = re.compile(r"^\*(Needs .*)\*$", re.MULTILINE)

#: A link to another page: its words and that page.
LINK = re.compile(r"\[([^\]\n]+)\]\(([\w./-]+)\.md(?:#[\w-]+)?\)")

#: Roles that lead to a place on the site or to a work; the others show their target.
REFERENCES = ("doc", "ref", "numref", "eq", "prf:ref", "cite", "cite:t", "term", "py:func", "py:class", "py:mod")

#: From a role, its target and the words that the page gives it to Markdown.
Shown = Callable[[str, str, str], str]


def glued(path: Path) -> dict[str, str]:
    """What hidden cells computed for the text, from the file that myst_nb leaves beside an executed notebook."""
    if not path.exists():
        return {}
    found = json.loads(path.read_text(encoding="utf-8"))
    return {name: output["data"]["text/plain"].strip("'") for name, output in found.items()}


def plain(text: str, values: Mapping[str, str], shown: Shown) -> str:
    """Text of a page as any notebook shows it: numbers and verdicts in place, no roles, no directives, no solutions.

    Parameters
    ----------
    text : str
        In MyST Markdown.
    values : mapping
        The numbers of the text, as :func:`glued` returns them.
    shown : callable
        What a reference says, as :class:`builder.references.References`; asked for :data:`REFERENCES`.

    Examples
    --------
    >>> shown = lambda role, target, title: title or {"thm-zero": "Theorem 3", "eq-K": "(7)"}[target]
    >>> plain("rho is {glue:text}`rho`, by {prf:ref}`thm-zero` and the {term}`trace <traces>`.", {"rho": "3"}, shown)
    'rho is 3, by Theorem 3 and the trace.'
    >>> plain("(5.12) is {verdict}`5.12`, see [two bars](two_bars.md).", {}, shown)
    '(5.12) is PROVED, see two bars.'
    >>> plain("% slide 2\\n\\nTwo bars meet.", {}, shown)
    'Two bars meet.'
    >>> plain("*Needs {doc}`one`.  5 minutes.*", {}, lambda role, target, title: f"*{target}*")
    '*Needs one.  5 minutes.*'
    >>> print(plain(":::{prf:theorem} Small\\n:label: thm-zero\\n\\n$$ K < 1 $$ (eq-K)\\n:::", {}, shown))
    **Theorem 3** (Small)
    <BLANKLINE>
    <BLANKLINE>
    $$ K < 1 \\tag{7} $$
    <BLANKLINE>
    """

    def fence(match: re.Match[str]) -> str:
        _, kind, title, options, body = match.groups()
        if kind == "dropdown":
            return ""
        if kind == "widget":
            return f"On the site a picture to move is here: {shown('widget', title, '')}."
        inner = plain(body, values, shown)
        if kind.startswith("prf:"):
            label = LABEL.search(options)
            name = shown("prf:ref", label[1], "") if label else kind.removeprefix("prf:").title()
            return f"**{name}**{f' ({title})' if title else ''}\n\n{inner}"
        return f"**{title}**\n\n{inner}" if title else inner

    def role(match: re.Match[str]) -> str:
        name, title, target, alone = match.groups()
        if name in REFERENCES:
            return shown(name, alone or target, title or "")
        return title or alone.rsplit("/", 1)[-1]

    def equation(match: re.Match[str]) -> str:
        space, label = match.groups()
        return f"{space}\\tag{{{shown('eq', label, '').strip('()')}}}{space}$$"

    text = COMMENT.sub("", FENCE.sub(fence, text))
    text = TARGET.sub("", text)
    text = GLUE.sub(lambda match: values[match[1]], text)
    text = LEDGER.sub(lambda match: quote(*match[1].split()), text)
    text = EQUATION.sub(equation, text)
    text = LINK.sub(lambda match: shown("doc", match[2], match[1]), text)
    return NEEDS.sub(lambda match: f"*{match[1].replace('*', '')}*", ROLE.sub(role, text))


def portable(executed: Mapping[str, Any], values: Mapping[str, str], shown: Shown) -> dict[str, Any]:
    """A notebook without outputs and hidden cells from one that was executed.

    Parameters
    ----------
    executed : mapping
        The notebook as its file holds it.
    values : mapping
        The numbers of the text, as :func:`glued` returns them.
    shown : callable
        As for :func:`plain`.

    Raises
    ------
    KeyError
        A number in the text that no cell has computed, or a reference to nothing.
    """
    cells: list[dict[str, Any]] = []
    above = FIRST
    for cell in executed["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            cells.append({"cell_type": "markdown", "metadata": {}, "source": plain(source, values, shown)})
        elif cell["cell_type"] == "code" and "remove-cell" not in cell["metadata"].get("tags", ()):
            cells.append(_code(above + source))
            above = ""
    for i, cell in enumerate(cells):
        cell["id"] = f"cell-{i}"  # the same at every build
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return {"nbformat": 4, "nbformat_minor": 5, "metadata": {"kernelspec": kernel}, "cells": cells}


def _code(source: str) -> dict[str, Any]:
    return {"cell_type": "code", "metadata": {}, "source": source, "execution_count": None, "outputs": []}


def write(source: Path, target: Path, shown: Shown) -> None:
    """Write the portable notebook of an executed one.

    Raises
    ------
    KeyError
        A number in the text that no cell has computed, or a reference to nothing.
    """
    executed = json.loads(source.read_text(encoding="utf-8"))
    notebook = portable(executed, glued(source.with_suffix(".glue.json")), shown)
    target.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
