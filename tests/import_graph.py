"""Every import of a source: what it names, on which line, and whether it stands in a function or is for types alone."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Literal, NamedTuple

PACKAGES = ("fem1d2d", "ndtheory", "verification")

ROOT = Path(__file__).parents[1]


def module_name(path: Path) -> str:
    """The module in a file below the root."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


#: Every module of the packages, with its file.
FILES = {module_name(path): path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))}

COMPUTED = "a name computed at run time"

Kind = Literal["module", "function", "types", "name"]


class Import(NamedTuple):
    """An import.

    Attributes
    ----------
    module : str
        Who imports.
    line : int
    name : str
        What; absolute, and ``from a import b`` counts as a.b.
    kind : {'module', 'function', 'types', 'name'}
        Where it stands: in the module, in a function, under TYPE_CHECKING; or a call of ``import_module``.
    """

    module: str
    line: int
    name: str
    kind: Kind


def within(module: str, *owners: str) -> bool:
    """True if a module is one of the owners, or in one of them."""
    return any(module == owner or module.startswith(owner + ".") for owner in owners)


def called(call: ast.Call) -> str:
    """The last part of the name of what is called."""
    return getattr(call.func, "attr", getattr(call.func, "id", ""))


def written_name(call: ast.Call) -> str:
    """The module a call of `import_module` names; of an f-string the packages before its first brace."""
    name = call.args[0] if call.args else None
    if isinstance(name, ast.JoinedStr) and "." in (text := getattr(name.values[0], "value", "")):
        return text
    return name.value if isinstance(name, ast.Constant) else COMPUTED


def imports(module: str, text: str, is_package: bool = False) -> Iterator[Import]:
    """All that a source imports, wherever it is indented."""
    waiting: list[tuple[ast.AST, Kind]] = [(ast.parse(text), "module")]
    nodes = ast.AST if re.search("import_module|__import__", text) else (ast.stmt, ast.ExceptHandler, ast.match_case)
    while waiting:
        node, kind = waiting.pop()
        if isinstance(node, ast.Import):
            yield from (Import(module, node.lineno, alias.name, kind) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parents = module.split(".")[: None if is_package else -1]
            start = parents[: len(parents) - node.level + 1] if node.level else []
            base = [*start, *([node.module] if node.module else [])]
            yield from (Import(module, node.lineno, ".".join([*base, alias.name]), kind) for alias in node.names)
        elif isinstance(node, ast.Call) and called(node) in ("import_module", "__import__"):
            yield Import(module, node.lineno, written_name(node), "name")
        elif isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            kind = "function"
        elif kind == "module" and isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            kind = "types"
        children = [child for child in ast.iter_child_nodes(node) if isinstance(child, nodes)]
        waiting.extend((child, kind) for child in reversed(children))


def edges(sources: Mapping[str, str], packages: frozenset[str] = frozenset()) -> list[Import]:
    """Every import of some sources; of a name in a module of ours the module.
    ``packages`` are those of the modules that are packages, as relative imports need it.
    """

    def ours(name: str) -> str:
        """The longest beginning of a name that is a module."""
        while name not in sources and "." in name:
            name = name.rpartition(".")[0]
        return name

    found = []
    for module, text in sources.items():
        for each in imports(module, text, module in packages):
            target = ours(each.name) if each.name.split(".")[0] in PACKAGES else each.name
            if target != module:
                found.append(Import(module, each.line, target, each.kind))
    return found


def ours() -> list[Import]:
    """Every import of the packages."""
    texts = {module: path.read_text("utf-8") for module, path in FILES.items()}
    return edges(texts, frozenset(module for module, path in FILES.items() if path.name == "__init__.py"))
