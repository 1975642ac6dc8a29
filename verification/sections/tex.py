"""Formulas in TeX as a terminal can show them, without a change of meaning."""

from __future__ import annotations

import re
from collections.abc import Iterator

#: What TeX names and a terminal shows otherwise.
SIGNS = {
    "le": "<=", "ge": ">=", "ne": "!=", "cdot": "*", "ldots": "..", "to": "->", "mapsto": "->", "leftarrow": "<-",
    "prime": "'", "langle": "<", "rangle": ">", "|": "|", ",": " ", "left": "", "right": "", "pm": "+-",
}  # fmt: skip
RELATIONS = {"=", "<=", ">=", "!=", "->", "<-", "in"}
ACCENTS = {"tilde": "~", "bar": "", "mathrm": ""}
TOKEN = re.compile(r"\\[A-Za-z]+\s*|\\.|\s+|.", re.DOTALL)


def plain(text: str) -> str:
    r"""A text with formulas between dollars, each of them written out.

    >>> plain(r"$\theta \le \frac{1}{2}$ and $\sqrt{\frac{C_K}{m}}$")
    'theta <= 1/2 and sqrt(C_K/m)'
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
        return f" {token} " if token in RELATIONS else (" " if token.isspace() else token)
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
    """Whether an atom is a letter, a name or a number, with scripts, or begins with one."""
    return bool(atom) and (atom[0].isalnum() or atom[-1:].isalnum()) and atom.strip() not in RELATIONS
