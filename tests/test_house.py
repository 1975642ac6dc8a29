"""The house: which room may know which, read from every import statement, wherever it is indented."""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from import_graph import COMPUTED, called, imports, within

ROOT = Path(__file__).parents[1]
ROOMS = ("fem1d2d", "ndtheory", "verification")

#: module: the modules and packages that alone may import it
DOORS = {
    "cvxpy": ("verification.contact.model", "verification.semidefinite.model"),
    "matplotlib": ("verification.figures", "verification.document"),
    "click": ("verification.cli",),
    "rich": ("verification.cli",),
    "hypothesis": ("verification.testing",),
    "flint": ("verification.certificate", "fem1d2d.proofs.layers_proved"),
    "sqlite3": ("verification.sweeps.store",),
    "distributed": ("verification.sweeps.workers",),
    "xarray": ("verification.sweeps.export",),
    "KratosMultiphysics": ("verification.coupling.kratos",),
}
#: what the theory may know beside the standard library and itself
THEORY = {"ndtheory.symbolic": "sympy"}
#: who prints: the command, and a script that stands alone
PRINTS = ("verification.cli", "verification.certificate.check")


def forbidden(module: str, imported: str) -> bool:
    """Whether `module` may not import `imported`."""
    room, top = module.partition(".")[0], imported.partition(".")[0]
    if imported == COMPUTED:
        return True
    if room != "verification" and top in ROOMS and top != room:
        return True
    if room == "ndtheory":
        known = [library for owner, library in THEORY.items() if within(module, owner)]
        return top not in {"ndtheory", *sys.stdlib_module_names, *known}
    return top in DOORS and not within(module, *DOORS[top])


def violations(module: str, source: str, is_package: bool = False) -> list[str]:
    """Each broken rule of the house, as `module:line: what`."""
    tree = ast.parse(source)
    found = [
        f"{module}:{line}: imports {name}"
        for line, name, _ in imports(module, tree, is_package)
        if forbidden(module, name)
    ]
    if not within(module, *PRINTS):
        names = (node for node in ast.walk(tree) if isinstance(node, ast.Name))
        found += [f"{module}:{node.lineno}: print" for node in names if node.id == "print"]
    return found


FILES = [path.relative_to(ROOT) for room in ROOMS for path in sorted((ROOT / room).rglob("*.py"))]


def test_no_edge_leaves_the_plan_of_the_house():
    found = []
    for path in FILES:
        is_package = path.name == "__init__.py"
        parts = path.parent.parts if is_package else path.with_suffix("").parts
        found += violations(".".join(parts), (ROOT / path).read_text(encoding="utf-8"), is_package)
    assert found == []


def test_every_room_has_been_read():
    assert {path.parts[0] for path in FILES} == set(ROOMS)


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("fem1d2d.mesh", "import ndtheory"),
        ("fem1d2d.mesh", "def f():\n    if True:\n        from verification.problem.specification import Problem"),
        ("fem1d2d.mesh", "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import ndtheory.bounds as b"),
        ("fem1d2d.mesh", "from .. import ndtheory"),
        ("ndtheory.bounds", "import fem1d2d.mesh"),
        ("ndtheory.bounds", "import os, verification"),
        ("ndtheory.bounds", "try:\n    import numpy\nexcept ImportError:\n    pass"),
        ("ndtheory.bounds", "import sympy"),
        ("ndtheory.symbolic", "import numpy"),
        ("ndtheory.symbolics", "import sympy"),
        ("ndtheory.bounds", "import importlib\nimportlib.import_module('scipy')"),
        ("ndtheory.bounds", "numpy = __import__('numpy')"),
        ("verification.sweep", "from importlib import import_module\nimport_module(name)"),
        ("verification.sweep", "import_module(f'cv{x}')"),
        ("fem1d2d.mesh", "import_module(f'verification.{x}')"),
        ("verification.algorithm.fixed_point", "import cvxpy as cp"),
        ("verification.contact.kkt", "from cvxpy.constraints import Zero"),
        ("verification.output.report", "import matplotlib.pyplot as plt"),
        ("fem1d2d.mesh", "def plot(self):\n    from matplotlib import pyplot"),
        ("verification.output.report", "from rich.table import Table"),
        ("verification.client", "import click"),
        ("verification.algorithm.relaxation", "from hypothesis import strategies"),
        ("verification.algorithm.fixed_point", "print('done')"),
        ("ndtheory.bounds", "def f(say=print):\n    say(1)"),
    ],
)
def test_a_forbidden_edge_is_found(module, source):
    assert len(violations(module, source)) == 1


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("fem1d2d.mesh", "import numpy\nfrom scipy import sparse\nfrom fem1d2d import element\nfrom . import material"),
        ("ndtheory.bounds", "from decimal import Decimal\nfrom ndtheory.number import sqrt\nfrom .errors import X"),
        ("ndtheory.symbolic", "import sympy"),
        ("verification", "importlib.import_module(f'verification.{home}')"),
        ("verification.compare", "import ndtheory, fem1d2d, numpy"),
        ("verification.contact.model", "import cvxpy"),
        ("verification.semidefinite.model", "def f():\n    import cvxpy"),
        ("verification.figures.region", "import matplotlib"),
        ("verification.figures", "import matplotlib"),
        ("verification.testing.rules", "from hypothesis import strategies"),
        ("verification.cli.run", "import click\nfrom rich import print\nprint('done')"),
        ("verification.algorithm.fixed_point", "# print('done')\nlog.info('print')"),
    ],
)
def test_an_edge_of_the_plan_is_let_through(module, source):
    assert violations(module, source) == []


def test_relative_imports_are_resolved_from_packages_and_from_modules():
    assert [each.name for each in imports("a.b", ast.parse("from .c import d\nfrom .. import e"), is_package=True)] == [
        "a.b.c.d",
        "a.e",
    ]
    assert [each.name for each in imports("a.b", ast.parse("from .c import d\nfrom . import e"))] == ["a.c.d", "a.e"]


# --- SECURITY.md: nothing that is read is executed ---

#: Modules that execute what they read, or send it away, and functions that do.
EXECUTE = ("dill", "ftplib", "http", "marshal", "pickle", "runpy", "shelve", "smtplib", "socket", "urllib", "yaml")
FUNCTIONS = ("compile", "eval", "exec", "execfile", "parse_expr", "read_pickle", "system", "popen", "urlopen")


def executing(source: str) -> list[str]:
    """Each place that could execute what it reads, or open a connection, as `line: what`."""
    tree, found = ast.parse(source), []
    for name, line in ((each.name, each.line) for each in imports("m", tree)):
        found += [f"{line}: imports {name}"] if name.partition(".")[0] in EXECUTE else []
    for node in (node for node in ast.walk(tree) if isinstance(node, ast.Call)):
        written, keywords = ast.unparse(node.func), {key.arg: ast.unparse(key.value) for key in node.keywords}
        if written.rpartition(".")[2] in FUNCTIONS and written != "re.compile":
            found.append(f"{node.lineno}: {written}")
        if written == "np.load" and keywords.get("allow_pickle") != "False":
            found.append(f"{node.lineno}: {written} without allow_pickle=False")
        if written.endswith("Environment") and keywords.get("autoescape") != "True":
            found.append(f"{node.lineno}: {written} without autoescape=True")
    return found


def test_nothing_that_is_read_is_executed():
    found = {str(path): executing((ROOT / path).read_text(encoding="utf-8")) for path in FILES}
    assert {path: places for path, places in found.items() if places} == {}


@pytest.mark.parametrize(
    "source",
    [
        "import pickle",
        "from urllib.request import urlopen",
        "eval(text)",
        "sympy.parse_expr(text)",
        "np.load(file)",
        "np.load(file, allow_pickle=True)",
        "jinja2.Environment(loader=loader)",
    ],
)
def test_a_place_that_could_execute_what_it_reads_is_found(source):
    assert len(executing(source)) == 1


@pytest.mark.parametrize(
    "source", ["np.load(file, allow_pickle=False)", "re.compile(a)", "json.loads(a)", "import sys"]
)
def test_what_only_reads_is_let_through(source):
    assert executing(source) == []


# --- the tests themselves ---

TESTS = sorted((ROOT / "tests").rglob("*.py"))


def private_names(source: str) -> Iterator[str]:
    """Every private name that a test reads, imports or replaces, ``__dict__`` too; ``_a_`` and ``__a__`` are none."""
    for node in ast.walk(ast.parse(source)):
        names = [node.attr] if isinstance(node, ast.Attribute) else []
        if isinstance(node, ast.ImportFrom):
            names = [part for alias in node.names for part in [*(node.module or "").split("."), alias.name]]
        elif isinstance(node, ast.Call) and called(node).endswith("attr"):
            names = [part for a in node.args[:2] if isinstance(a, ast.Constant) for part in str(a.value).split(".")]
        yield from (name for name in names if re.fullmatch(r"_(?!_).*(?<!_)|__dict__", name))


def test_tests_use_no_private_names():
    found = [(path.name, name) for path in TESTS for name in private_names(path.read_text(encoding="utf-8"))]
    assert found == []


@pytest.mark.parametrize(
    "source",
    [
        *("energy_norms._roots(1)", "from a import _b", "from a._b import c", "self._x = 1", "vars(x), x.__dict__"),
        *('monkeypatch.setattr(rows, "_sources", f)', 'monkeypatch.setattr("a.b._c", None)', 'getattr(x, "_y")'),
    ],
)
def test_a_private_name_is_found(source):
    assert len(list(private_names(source))) == 1


def test_a_special_name_is_no_private_one():
    assert (
        list(private_names("from __future__ import annotations\nf.__name__, a.b_, _, x._repr_html_ = 1, 2, 3, 4")) == []
    )


def test_no_file_of_tests_is_longer_than_450_lines():
    assert [path.name for path in TESTS if path.read_text(encoding="utf-8").count("\n") > 450] == []


def test_no_two_files_of_tests_have_one_name():
    """pytest imports them by their names: of two, the second one would be an error of the whole session."""
    names = [path.name for path in TESTS if path.name.startswith("test_")]
    assert sorted(name for name in set(names) if names.count(name) > 1) == []
