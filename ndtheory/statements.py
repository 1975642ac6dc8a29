"""The numbered statements of the paper, and facts of ours: what each claims, and what is wrong with it if anything is.

The texts are data, in ``statements.toml`` beside this module.  So are the recorded verdicts; each must be earned by
evidence (:mod:`verification.ledger`).  Pages and screens quote verdicts and texts from here, so that none of them
contradicts another or the ledger.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Collection
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from typing import Any, Literal

from ndtheory.keys import ABSENT, Part, key

Fault = Literal["false as printed", "does not follow", "gap", "typo"]

#: The texts of a statement that may be quoted.
TEXTS = ("title", "claims", "wrong", "repair", "proof", "note")


#: What keys share that only a statement with a fault has.
IF_FAULT: dict[str, Any] = {"default": "", "absent": "without a fault", "of": lambda text: text or ABSENT}


@dataclass(frozen=True, kw_only=True)
class Statement(Part):
    """A statement in our own words, with formulas in TeX.

    Attributes
    ----------
    fault : {'false as printed', 'does not follow', 'gap', 'typo'} or None
        A counterexample exists; the step is broken; a hypothesis or argument is missing; a sign or an index that the
        rest of the paper contradicts.
    same_as : str
        The statement whose fault it inherits; empty where the fault is its own.
    reading : str
        What a definition or a cited result rests on.
    verdict : str
        The recorded one; empty where none is recorded.
    short : str
        The title in at most four words without formulas; empty where the title is such.
    """

    id: str = key("as `5.30`, `prop-5.6.2`, `C5`, `case-2-1`, `fig-10`; own facts begin with `x-`")
    label: str = key("the paper's, as `(5.30)`")
    kind: str = key("definition, equation, inequality, theorem and so on")
    title: str = key("in our own words")
    claims: str = key("in our own words")
    leans_on: tuple[str, ...] = key("ids that its proof uses", default=())
    fault: Fault | None = key(
        "`false as printed`, `does not follow`, `gap` or `typo`", default=None, absent="without a fault"
    )
    wrong: str = key("what is wrong", **IF_FAULT)
    repair: str = key("its repaired form", **IF_FAULT)
    proof: str = key("the proof of the repair", **IF_FAULT)
    note: str = key("what else a reader should know; mostly empty", default="")
    same_as: str = ""
    reading: str = ""
    verdict: str = ""
    short: str = ""


@lru_cache(maxsize=1)
def statements() -> dict[str, Statement]:
    """All statements by id, in the order of the paper, own facts last.

    Examples
    --------
    >>> statements()["5.30"].fault
    'false as printed'
    """
    rows = _file()["statement"]
    return {row["id"]: Statement(**{**row, "leans_on": tuple(row.get("leans_on", ()))}) for row in rows}


def recorded() -> dict[str, str]:
    """The recorded verdicts by id."""
    return {id: statement.verdict for id, statement in statements().items() if statement.verdict}


def quote(id: str, what: str = "verdict") -> str:
    """The recorded verdict on a statement, or one of its texts.

    Parameters
    ----------
    id : str
        Of the statement.
    what : str
        'verdict', or a text: 'title', 'claims', 'wrong', 'repair', 'proof', 'note', with formulas in TeX.

    Raises
    ------
    ValueError
        No such statement, or it has no such text.

    Examples
    --------
    >>> quote("5.12"), quote("5.12", "title")
    ('PROVED', 'Both obstacle problems added')
    """
    if id not in statements():
        raise ValueError(f"{id!r}: no such statement")
    if what == "verdict":
        return recorded()[id]
    text: str = getattr(statements()[id], what) if what in TEXTS else ""
    if not text:
        raise ValueError(f"{what!r} of {id}: needed 'verdict' or one of {', '.join(TEXTS)} that is not empty")
    return text


def proof_of(ids: Collection[str]) -> dict[str, Statement]:
    """Some statements with all that they lean on, directly or not, in the order of the paper.

    Examples
    --------
    >>> list(proof_of(["4.3"]))
    ['4.1', '4.2', '4.3']
    """
    found, left = set(), list(ids)
    while left:
        id = left.pop()
        if id not in found:
            found.add(id)
            left += statements()[id].leans_on
    return {id: one for id, one in statements().items() if id in found}


def symbols(statement: Statement) -> dict[str, str]:
    r"""Symbols of a statement's formulas, in TeX, each with its meaning in a few words.

    Those are left out that the statement defines itself, and those whose meaning depends on the statement.

    Examples
    --------
    >>> symbols(statements()["5.17"])
    {'T': 'one step without relaxation: forces to forces'}
    """
    formulas = " ; ".join((statement.claims + " " + statement.repair).split("$")[1::2])
    return {name: words for name, words in _file()["symbols"].items() if _occurs(name, formulas)}


def _occurs(name: str, formulas: str) -> bool:
    """True if a symbol occurs in formulas, with any exponent, and none of them is its definition."""
    more = "" if "_" in name else r"(?![_(])"  # another index is another symbol, e(u) is a strain
    one = rf"(?<![A-Za-z\\_]){re.escape(name)}(?![A-Za-z]){more}"
    return bool(re.search(one, formulas)) and not re.search(one + r"\s*=", formulas)


@lru_cache(maxsize=1)
def _file() -> dict[str, Any]:
    return tomllib.loads(files("ndtheory").joinpath("statements.toml").read_text("utf-8"))
