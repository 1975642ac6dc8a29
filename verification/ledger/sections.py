"""The ledger: a summary of all rows, or each row that was asked for, with formulas as a terminal can show them."""

from __future__ import annotations

import re
from collections.abc import Iterator

from ndtheory.statements import symbols
from verification import registry
from verification.ledger.rows import Finding, Ledger
from verification.ledger.sheets import FAULTS, WORDS, outcome
from verification.show.numbers import count
from verification.show.parts import Facts, Note, Section, Sections, closing, section, table

#: Where the verdicts are defined.
DEFINED = Note("What each verdict means: docs/glossary.md, under verdict.", 0)


@registry.sections.register
def sections(found: Ledger) -> Sections:
    """The sections: a summary if every statement is there, else one for each row."""
    if found.whole:
        return _summary(found)
    grounds = list(dict.fromkeys(id for row in found.rows for id in row.statement.leans_on))
    return (*map(_row, found.rows), closing("", DEFINED, then=" ".join(["ndtheory verify", *grounds[:4]])))


def _summary(found: Ledger) -> Sections:
    about = "Bayada, Sabil, Sassi (2008)"
    own = sum(row.statement.kind == "own" for row in found.rows)
    verdicts = [(verdict, count(rows), WORDS[verdict]) for verdict, rows in found.counts.items()]
    faults = {
        name.lower(): [row.statement.id for row in found.rows if row.statement.fault == fault]
        for fault, name in FAULTS.items()
    }
    wrong = [f"{name}: {', '.join(ids)}" for name, ids in faults.items() if ids]
    sections = [
        section(
            "setting", "", Facts(about, (f"{len(found.rows) - own} of its statements, {own} of our own", found.level))
        ),
        section("stands", "HOW MANY STATEMENTS HOLD?", table(("verdict", "number", "means"), verdicts, right=[1])),
        section("wrong", "WHAT IS WRONG IN THE PAPER?", *wrong),
    ]
    if found.changed:
        changed = [(row.statement.id, row.recorded or "-", row.verdict) for row in found.changed]
        sections.append(section("changed", "WHAT HAS CHANGED?", table(("statement", "recorded", "now"), changed)))
    claims = "that a numerical row is proved, or a proof of the statements that it uses"
    return (*sections, closing(claims, DEFINED, then="ndtheory verify 5.30"))


def _row(row: Finding) -> Section:
    s = row.statement
    changed = f" (recorded: {row.recorded or '-'})" if row.changed else ""
    return section(s.id, f"{s.id}  {plain(s.title)}: {row.verdict}{changed}", *_said(row))


def _said(row: Finding) -> Iterator[Note | str]:
    s = row.statement
    yield plain(s.claims)
    if meanings := symbols(s):
        yield Note("; ".join(f"{plain(f'${name}$')}: {words}" for name, words in meanings.items()), 4)
    if s.fault:
        yield f"{s.fault}: {plain(s.wrong)}"
    if s.repair:
        yield f"repaired: {plain(s.repair)}"
        yield f"because: {plain(s.proof)}"
    if s.leans_on:
        yield f"uses {', '.join(s.leans_on)}"
    for e in row.evidence:
        method = f"{e.method}, {e.of}" if s.fault else e.method
        yield f"{method}: {outcome(e)}.  {plain(e.text)}"
        if at := e.data.get("counterexample"):
            yield Note("at " + ", ".join(f"{name} = {value}" for name, value in at.items()), 4)
    if s.note:
        yield plain(s.note)


#: Characters of a terminal for names of TeX.
SIGNS = {
    "le": "<=", "ge": ">=", "ne": "!=", "cdot": "*", "ldots": "..", "to": "->", "mapsto": "->", "leftarrow": "<-",
    "prime": "'", "langle": "<", "rangle": ">", "|": "|", ",": " ", "left": "", "right": "", "pm": "+-",
}  # fmt: skip
RELATIONS = {"=", "<=", ">=", "!=", "->", "<-", "in"}
ACCENTS = {"tilde": "~", "bar": "", "mathrm": ""}
TOKEN = re.compile(r"\\[A-Za-z]+\s*|\\.|\s+|.", re.DOTALL)


def plain(text: str) -> str:
    r"""A text with formulas between dollars, each of them written out.

    >>> plain(r"$\theta \le \frac{1}{2}$ and $0 < \theta < \sqrt{\frac{C_K}{m}}$")
    'theta <= 1/2 and 0 < theta < sqrt(C_K/m)'
    """
    parts = text.split("$")
    return "".join(_formula(part) if i % 2 else part for i, part in enumerate(parts))


def _formula(tex: str) -> str:
    return re.sub(r" +", " ", "".join(_atoms(iter(TOKEN.findall(tex)), "")).strip())


def _atoms(tokens: Iterator[str], end: str) -> list[str]:
    """Atoms up to a closing token: symbols with their scripts, numbers, brackets, signs."""
    found: list[str] = []
    for token in tokens:
        if token == end:
            break
        if token in "^_":
            script = _argument(tokens)
            if token == "_" and re.fullmatch(r"\([\w ]+\)", script):
                script = script[1:-1].replace(" ", "")  # an index of several letters
            found[-1 if found else 0 :] = [(found[-1] if found else "") + token + script]
            continue
        atom = _atom(token, tokens)
        if atom == "'" and found:
            found[-1] += atom
            continue
        if found and atom.isdigit() and re.fullmatch(r"[\d.]+", found[-1]):
            found[-1] += atom
            continue
        if found and _is_symbol(found[-1]) and _is_symbol(atom):
            found.append(" ")  # a product, as in TeX
        found.append(atom)
    return found


def _atom(token: str, tokens: Iterator[str]) -> str:
    if token == "{":
        return "".join(_atoms(tokens, "}"))
    if not token.startswith("\\"):
        return f" {token} " if token in {*RELATIONS, "<", ">"} else (" " if token.isspace() else token)
    name = token[1:].strip()
    if name == "frac":
        above, below = _argument(tokens), _argument(tokens)
        return f"{above}/{below}"
    if name == "sqrt":
        return f"sqrt({_argument(tokens).removeprefix('(').removesuffix(')')})"
    if name in ACCENTS:
        return _argument(tokens, bare=True) + ACCENTS[name]
    sign = SIGNS.get(name, name)
    return f" {sign} " if sign in RELATIONS else sign


def _argument(tokens: Iterator[str], *, bare: bool = False) -> str:
    """The next group or token; in brackets where it is more than one symbol or number."""
    for token in tokens:
        if token.isspace():
            continue
        inner = _atoms(tokens, "}") if token == "{" else [_atom(token, tokens)]
        text = "".join(inner).strip()
        return text if bare or len(inner) < 2 else f"({text})"
    return ""


def _is_symbol(atom: str) -> bool:
    """True if an atom is a letter, a name or a number, with scripts, or begins with one."""
    return bool(atom) and (atom[0].isalnum() or atom[-1:].isalnum()) and atom.strip() not in RELATIONS
