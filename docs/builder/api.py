"""One page of the API for each module, and the page that lists them; both are made from the packages as they are."""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("ndtheory", "fem1d2d", "verification")

#: Commands have a page of their own, and nobody imports their modules.
COMMANDS = "verification.cli"

#: No page of the navigation lists it: the page of modules does.
PAGE = """---
orphan: true
---

# {name}

```{{eval-rst}}
.. automodule:: {name}
   :{members}:
```
"""

HEAD = """# All modules

Every module of the three packages has a page with its functions and classes. {doc}`/architecture` says which of them
may import which.
"""


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
    return (ast.get_docstring(ast.parse(path.read_text("utf-8"))) or "").partition("\n")[0]


def pages(found: dict[str, Path]) -> dict[str, str]:
    """The page of each module, by its name: a package shows its text, a module also its members."""
    members = {True: "no-members", False: "members"}
    return {name: PAGE.format(name=name, members=members[path.name == "__init__.py"]) for name, path in found.items()}


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
