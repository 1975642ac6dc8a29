"""Mutants drawn at random in each module that the answers rest on, and how many of them tests notice.

    PYTHONPATH=tests python -m safeguards.drawn [MODULE ...]     all modules one after the other, or those named

A mutant changes one place: it turns a comparison, changes a sign or a number, exchanges min and max, or drops a
conjunct or a term.  The draw depends on nothing but the text of the module.  Tests of the module run on a copy of the
project; the row of a module that is done is written into the page ``docs/verified.md``.
"""

from __future__ import annotations

import ast
import hashlib
import math
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from datetime import date
from functools import partial
from pathlib import Path

from safeguards.mission import EQUIVALENT, MISSION

from fem1d2d.mesh_reader import limit

ROOT = Path(__file__).parents[2]
PAGE = "docs/verified.md"
COLUMNS = ("drawn", "noticed", "equivalent", "unnoticed")
HEAD = f"| module | {' | '.join(COLUMNS)} | on |\n|---|---|---|---|---|---|\n"

#: Mutants of a module.
DRAWN = 10

#: Seconds of a processor and memory of the tests: a mutant may make a list longer for ever.
LONGEST, MEMORY = 3600, 8 * 2**30

TURNED = {ast.Lt: ast.Gt, ast.LtE: ast.GtE, ast.Eq: ast.NotEq, ast.Is: ast.IsNot, ast.In: ast.NotIn}
EXCHANGED = {"min": "max", "minimum": "maximum", "argmin": "argmax"}
TURNED, EXCHANGED = ({**each, **{after: before for before, after in each.items()}} for each in (TURNED, EXCHANGED))

#: Fields and nodes without meaning for a result: types, and messages.
TYPES = ("annotation", "returns", "decorator_list")
MESSAGES = (ast.Raise, ast.Assert, ast.JoinedStr)


def others(node: ast.expr) -> Iterator[ast.expr]:
    """Yield what may take the place of an expression."""
    match node:
        case ast.Compare(left, [op], right) if type(op) in TURNED:
            yield ast.Compare(left, [TURNED[type(op)]()], right)
        case ast.BinOp(left, ast.Add() | ast.Sub() as op, right):
            yield from (left, ast.BinOp(left, ast.Sub() if isinstance(op, ast.Add) else ast.Add(), right))
        case ast.BinOp(left, ast.BitAnd(), right):
            yield from (left, right)
        case ast.BoolOp(op, values):
            for i in range(len(values)):
                rest = values[:i] + values[i + 1 :]
                yield rest[0] if len(rest) == 1 else ast.BoolOp(op, rest)
        case ast.UnaryOp(ast.USub(), operand):
            yield operand
        case ast.Constant(int() | float() as value) if not isinstance(value, bool):
            yield ast.Constant(value + 1 if abs(value) < 10 else 2 * value)
        case ast.Name(name) if name in EXCHANGED:
            yield ast.Name(EXCHANGED[name], ast.Load())
        case ast.Attribute(value, name) if name in EXCHANGED:
            yield ast.Attribute(value, EXCHANGED[name], ast.Load())


def places(node: ast.AST, within: str = "") -> Iterator[tuple[str, ast.expr]]:
    """Yield each expression that counts, with the function that it is in."""
    if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
        within = f"{within}.{node.name}".lstrip(".")
    for field, value in ast.iter_fields(node):
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and field not in TYPES and not _tells(child):
                if isinstance(child, ast.expr):
                    yield within, child
                yield from places(child, within)


def _tells(node: ast.AST) -> bool:
    """True for a message, or a share of the work that is done."""
    return isinstance(node, MESSAGES) or (isinstance(node, ast.Call) and ast.unparse(node.func) == "progress")


def mutated(source: str, node: ast.expr, other: ast.expr) -> str:
    """Return a text with another expression in the place of one."""
    lines = source.encode().splitlines(keepends=True)
    begin, end = lines[: node.lineno], lines[node.end_lineno - 1 :]
    begin[-1], end[0] = begin[-1][: node.col_offset], end[0][node.end_col_offset :]
    return b"".join([*begin, f"({ast.unparse(other)})".encode(), *end]).decode()


def drawn(module: str, source: str) -> dict[str, str]:
    """Return mutants of a module by their names: its text with one place changed."""
    found: dict[str, tuple[ast.expr, ast.expr]] = {}
    for within, node in places(ast.parse(source)):
        for other in others(node):
            found.setdefault(f"{within or 'module'}: {ast.unparse(node)} -> {ast.unparse(other)}", (node, other))
    key = lambda name: hashlib.sha256(f"{module} {name}".encode()).digest()
    return {name: mutated(source, *found[name]) for name in sorted(found, key=key)[:DRAWN]}


# --- tests on a copy --------------------------------------------------------------------------------------------------


def copied(folder: Path) -> Path:
    """Copy the project, without what tools keep there, to be changed."""
    skipped = shutil.ignore_patterns("__pycache__", ".*", "_build", "*.egg-info")
    return Path(shutil.copytree(ROOT, folder, ignore=skipped, dirs_exist_ok=True))


def status(folder: Path, tests: Sequence[str], seconds: float | None = None) -> int | None:
    """Run tests on a copy up to the first one that fails, each with the same drawn cases.

    Returns
    -------
    int or None
        The exit status of pytest: 0 where they pass; None after so many seconds.
    """
    alone = {name: value for name, value in os.environ.items() if not name.startswith(("PYTEST", "HYPOTHESIS"))}
    environment = alone | {"HYPOTHESIS_PROFILE": "ci", "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "0", "-p", "no:cacheprovider", *tests]
    kept = {"cwd": folder, "env": environment, "capture_output": True, "preexec_fn": partial(limit, LONGEST, MEMORY)}
    try:
        return subprocess.run(command, timeout=seconds, **kept).returncode
    except subprocess.TimeoutExpired:
        return None


def survivors(module: str, folder: Path) -> list[str]:
    """Return the drawn mutants of a module with which its tests pass on a copy, in not much more time."""
    path, tests, begun = folder / module, MISSION[module], time.monotonic()
    source = path.read_text("utf-8")
    if status(folder, tests) != 0:
        raise RuntimeError(f"{' '.join(tests)}: do not pass without a mutant")
    seconds, found = 60 + 3 * (time.monotonic() - begun), []
    try:
        for name, text in drawn(module, source).items():
            path.write_text(text, "utf-8")
            passed = status(folder, tests, seconds) == 0
            print(f"{module}: {'not noticed' if passed else 'noticed'}: {name}", flush=True)
            found += [name] if passed else []
    finally:
        path.write_text(source, "utf-8")
    return found


# --- the page ---------------------------------------------------------------------------------------------------------


def rows(text: str) -> dict[str, tuple[str, ...]]:
    """The rows of the table on the page, by module: how many were drawn and so on, and the day."""
    lines = text.split(HEAD)[1].split("\n\n")[0].splitlines()
    cells = [[cell.strip(" `") for cell in line.strip("|").split("|")] for line in lines]
    return {name: tuple(rest) for name, *rest in cells if name != "all"}


def totals(found: Mapping[str, Sequence[str]]) -> list[int]:
    """The sums of all rows."""
    return [sum(int(row[i]) for row in found.values()) for i in range(len(COLUMNS))]


def share(found: Mapping[str, Sequence[str]]) -> float:
    """The share noticed of all mutants that are not equivalent."""
    drawn, noticed, equivalent, _ = totals(found)
    return noticed / (drawn - equivalent)


def with_row(text: str, module: str, left: Sequence[str], day: date) -> str:
    """The page with the row of a module, from its survivors, and with the share of all."""
    same = sum(name in EQUIVALENT.get(module, ()) for name in left)
    found = rows(text) | {module: (str(DRAWN), str(DRAWN - len(left)), str(same), str(len(left) - same), str(day))}
    lines = [f"| `{name}` | {' | '.join(found[name])} |" for name in MISSION if name in found]
    total = " | ".join(map(str, totals(found)))
    table = "\n".join([*lines, f"| all | {total} | {math.floor(100 * share(found))} % noticed |"])
    before, rest = text.split(HEAD)
    return before + HEAD + table + "".join(rest.partition("\n\n")[1:])


def main(modules: Sequence[str]) -> int:
    """Try modules and write their rows; the exit status, 1 where fewer than nine in ten are noticed."""
    if unknown := sorted(set(modules) - set(MISSION)):
        print(f"{', '.join(unknown)}: not in the list; needed some of {', '.join(MISSION)}", file=sys.stderr)
        return 2
    page = ROOT / PAGE
    with tempfile.TemporaryDirectory() as folder:
        copied(Path(folder))
        for module in modules or MISSION:
            left = survivors(module, Path(folder))
            page.write_text(with_row(page.read_text("utf-8"), module, left, date.today()), "utf-8")
    return int(share(rows(page.read_text("utf-8"))) < 0.9)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
