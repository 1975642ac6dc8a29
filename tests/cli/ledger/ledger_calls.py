"""What the tests of the ledger share: statements by name, rows that cost little, a call in a fresh interpreter."""

import re
from dataclasses import dataclass

from processes import ended

from ndtheory.statements import statements
from verification import ledger

STATEMENTS = statements()

VERDICTS = {"PROVED", "REPAIRED", "REFUTED", "NUMERICAL", "ASSUMED", "INCONCLUSIVE"}
METHODS = {"symbolic", "dimension", "verified", "discrete", "reading"}
OF = {"printed", "step", "repaired"}
KEYS = {"id", "label", "kind", "title", "verdict", "method", "evidence", "note"}
WHOLE = {"ledger.json", "ledger.md", "errata.md", "verdicts.json"}
TEXTS = ["title", "claims", "wrong", "repair", "proof", "reading", "note", "label"]

#: Ids whose evidence costs next to nothing: read, computed exactly, seen at solutions.
READ, EXACT, SEEN = "5.9", "x-homogeneity", "2.4"

#: One of every source of evidence, and what leans on what.
SOME = [READ, "C5", EXACT, "5.30", SEEN, "fig-5"]

#: Ids that the interface names.
NAMED = ["2.1", "prop-5.6.2", "lemma-5.3", "thm-5.9", "C5", "case-2-1", "rem-5.10", "x-homogeneity"]
NAMED += ["fig-10", "sec-6.2"]

#: What a screen or a sheet shows where a program forgot to write a text.
RAW = re.compile(r"\bNone\b|Fraction\(|\bnan\b|\binf\b|[=:] (?:True|False)\b(?!,)|[\[{]'|array\(|float64")

CALL = "import sys; from verification.cli import main; sys.exit(main())"


@dataclass(frozen=True)
class Whole:
    """A whole ledger, and what was told while it was made."""

    ledger: ledger.Ledger
    told: list[tuple[str, float]]


def start(*arguments, code=CALL, **options):
    """The command in a fresh interpreter."""
    return ended(code, *arguments, **options)


def wide(answer):
    return [line for line in answer.out.splitlines() if len(line) > 80]


def one_line(text):
    """A paragraph of the screen, unfolded."""
    return " ".join(text.split())
