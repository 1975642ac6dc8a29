"""Pages of the API, made from the packages as they are: one for each module, their list, and the public names."""

from __future__ import annotations

import ast
import inspect
import re
import typing
from pathlib import Path
from typing import Any

import verification as vf

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("ndtheory", "fem1d2d", "verification")

#: Commands have a page of their own, and nobody imports their modules.
COMMANDS = "verification.cli"

#: No page of the navigation lists it: the page of modules does.
PAGE = """---
orphan: true
---

# {name}

{calls}```{{eval-rst}}
.. automodule:: {name}
   :{members}:
```
"""

#: On the page of ``verification``, whose names are in its modules.
BY_TASK = "{doc}`/api/index` lists its public names by task, and {doc}`/generated/modules` all modules.\n\n"

HEAD = """# All modules

Every module of the three packages has a page with its functions and classes. {doc}`/architecture` says which of them
may import which.
"""


#: The public names of ``verification`` in the order of what a reader does with them.
TASKS = {
    "Describe a problem": ("load", "example", "Problem", "ProblemError"),
    "Run the iteration, or solve both bodies at once": (
        *("run", "Run", "iterate", "Iterate", "march", "History"),
        *("solve", "Solution", "SolveError", "ContactError"),
    ),
    "Measure constants, evaluate bounds, check the paper": (
        *("measure", "Measured", "compare", "Comparison", "verify", "Ledger"),
    ),
    "Prove that a step contracts": ("certify", "check_again"),
    "Choose the roles and theta of a coupling": (
        *("advise", "advise_matrices", "advise_vectors", "advise_logs", "advise_run", "advise_moduli", "Advice"),
    ),
    "Couple two solvers": ("couple", "Coupling"),
    "Make many runs, and keep results": ("sweep", "Sweep", "explore", "Exploration", "schema"),
    "Check the answer to an exercise": ("check",),
    "Add parts of your own": ("build", "ContactPair", "Rule", "Law"),
}


def summary(one: Any) -> str:
    """First sentence of a docstring as Markdown, with the targets of its roles as code."""
    text = (inspect.getdoc(one) or "").partition("\n\n")[0].replace("\n", " ")
    return _with_code(text)


def place(one: Any) -> str:
    """Name under which the pages of modules have a function or a class."""
    return f"{one.__module__}.{one.__qualname__}"


def link(one: Any, words: str = "") -> str:
    """A function or a class as a link in Markdown; what is not ours has no page."""
    if not one.__module__.startswith(PACKAGES):
        return f"`{one.__qualname__}`"
    return f"{{py:{'class' if inspect.isclass(one) else 'func'}}}`{words or one.__qualname__} <{place(one)}>`"


def returned(one: Any) -> str:
    """Result of a call as Markdown; a class returns none."""
    if inspect.isclass(one):
        return ""
    found = typing.get_type_hints(one)["return"]
    parts = [part for part in typing.get_args(found) if part.__module__.startswith(PACKAGES)]
    return f"iterator of {link(*parts)}" if parts else link(typing.get_origin(found) or found)


def calls() -> str:
    """The public names of ``verification`` by task, as Markdown."""
    parts = []
    for task, names in TASKS.items():
        parts += [f"**{task}**", "", "| name | returns | meaning |", "|---|---|---|"]
        for name in names:
            one = getattr(vf, name)
            meaning = summary(one).replace("|", r"\|")
            parts.append(f"| {link(one, f'vf.{name}')} | {returned(one)} | {meaning} |")
        parts.append("")
    return "\n".join(parts)


def modules(root: Path = ROOT) -> dict[str, Path]:
    """Every module that a program may import: its name and its file."""
    found = {}
    for package in PACKAGES:
        for path in sorted((root / package).rglob("*.py")):
            parts = path.relative_to(root).with_suffix("").parts
            name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
            if name != COMMANDS and not name.startswith(f"{COMMANDS}."):
                found[name] = path
    return found


def sentence(path: Path) -> str:
    """First line of a module's docstring, empty where it has none."""
    return _with_code((ast.get_docstring(ast.parse(path.read_text("utf-8"))) or "").partition("\n")[0])


def _with_code(text: str) -> str:
    """A text with the targets of its roles as code."""
    return re.sub(r":\w+:`~?([^`]+)`", r"`\1`", text)


def pages(found: dict[str, Path]) -> dict[str, str]:
    """The page of each module, by its name: a package shows its text, a module also its members."""
    members = {True: "no-members", False: "members"}
    return {
        name: PAGE.format(name=name, members=members[path.name == "__init__.py"], calls=BY_TASK * (name == vf.__name__))
        for name, path in found.items()
    }


def index(found: dict[str, Path]) -> str:
    """The page that lists the modules with the first sentence of each, package by package."""
    parts = [HEAD]
    packages = [name for name, path in found.items() if path.name == "__init__.py"]
    for package in packages:
        inside = [name for name in found if name.rpartition(".")[0] == package and name not in packages]
        rows = [f"| {{doc}}`{name} <api/{name}>` | {sentence(found[name])} |" for name in (package, *inside)]
        parts.append("\n".join([f"## {package}\n", "| module | contents |", "|---|---|", *rows, ""]))
    return "\n".join(parts)


def write(folder: Path, root: Path = ROOT) -> None:
    """Write all of these pages; those of modules that are gone are removed."""
    found = modules(root)
    texts = {folder / "api" / f"{name}.md": text for name, text in pages(found).items()}
    texts[folder / "modules.md"] = index(found)
    (folder / "api").mkdir(parents=True, exist_ok=True)
    for stale in set((folder / "api").glob("*.md")) - set(texts):
        stale.unlink()
    for path, text in texts.items():
        if not path.exists() or path.read_text("utf-8") != text:
            path.write_text(text, encoding="utf-8")
