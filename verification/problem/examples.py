"""The built-in problems."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from decimal import Decimal
from importlib import resources
from string import digits

from ndtheory.texts import did_you_mean
from verification.problem.specification import Problem
from verification.problem.tables import short

#: The meshes of Section 6 by their number of nodes: how often the mesh of 60 nodes is halved.
FAMILY = {60: 0, 190: 1, 666: 2, 2482: 3}


def examples() -> dict[str, str]:
    """Return the texts of the built-in problem files by name."""
    files = [file for file in (resources.files("verification") / "data").iterdir() if file.name.endswith(".toml")]
    found = {file.name.removesuffix(".toml"): file.read_text("utf-8") for file in files}
    found |= {f"section6-{nodes}": _member(found["section6"], nodes) for nodes in FAMILY}
    return {name: found[name] for name in sorted(found, key=lambda name: (name.rstrip(digits), len(name), name))}


def _member(section6: str, nodes: int) -> str:
    """Return the file of Section 6 on a mesh of the paper: 10 x 2 and 8 x 2 cells, halved; the two grids differ."""
    n = 2 ** FAMILY[nodes]
    usual = "between the mesh width and 0.3 times the length of Gamma_c"
    half = f"half the lower body's mesh width: a node has\n{'# 0 to 2 times the friction of an even pressure':>77}"
    return (
        section6.replace(
            "# The two-body model of Section 6,", f"# The two-body model of Section 6 on its mesh of {nodes} nodes,"
        )
        .replace('title = "Section 6, centred"', f'title = "Section 6, {nodes} nodes"')
        .replace(usual, half if n == 1 else usual)
        .replace("cells = [40, 6]", f"cells = [{10 * n}, {2 * n}]")
        .replace("cells = [24, 6]", f"cells = [{8 * n}, {2 * n}]")
    )


def unknown_example(name: str, available: Iterable[str]) -> str:
    """Return the message for a name that no built-in problem has: the known ones, and the one that may be meant."""
    known = list(available)
    return f"no example {short(name)!r}; there are {', '.join(known)}{did_you_mean(name, known)}"


def instead_of(path: str) -> str:
    """Return what to type for a file that is missing and has the name of a built-in problem; empty for another name."""
    return f"; type ndtheory example {path} > {path}.toml for the built-in problem" if path in examples() else ""


def example(name: str) -> Problem:
    """A built-in problem.

    Parameters
    ----------
    name : str
        As ``ndtheory example`` lists them.

    Returns
    -------
    Problem

    Raises
    ------
    ValueError
        The name is unknown; the message lists the known ones.

    Examples
    --------
    >>> example("section6").title
    'Section 6, centred'
    """
    available = examples()
    if name not in available:
        raise ValueError(unknown_example(str(name), available))
    return Problem.from_dict(tomllib.loads(available[name], parse_float=Decimal))
