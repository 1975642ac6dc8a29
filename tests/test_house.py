"""The house: who prints, what is never executed, what an import does, and what tests may know.

Who may import what is in test_floors.
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from import_graph import PACKAGES, called, within
from processes import ended
from strategies import AT_NIGHT

ROOT = Path(__file__).parents[1]
SOURCES = {
    path.relative_to(ROOT).as_posix(): path.read_text("utf-8")
    for room in PACKAGES
    for path in (ROOT / room).rglob("*.py")
}

#: who prints: the command, and a script that stands alone
PRINTS = ("verification.cli", "verification.certificate.check")


def nodes(source: str, pattern: str) -> Iterator[ast.AST]:
    """The nodes of a source; none where its text has no match of a pattern."""
    return ast.walk(ast.parse(source)) if re.search(pattern, source) else iter(())


def printing(source: str) -> list[int]:
    """The lines of a source that name ``print``."""
    return [node.lineno for node in nodes(source, r"\bprint\b") if isinstance(node, ast.Name) and node.id == "print"]


def test_only_the_command_prints():
    modules = {name.removesuffix(".py").replace("/", "."): printing(text) for name, text in SOURCES.items()}
    assert {module: lines for module, lines in modules.items() if lines and not within(module, *PRINTS)} == {}
    assert printing("# print('done')\ndef f(say=print):\n    log.info('print')") == [2]


# --- SECURITY.md: nothing that is read is executed ---

#: Functions that execute what they read, or open a connection.
FUNCTIONS = ("compile", "eval", "exec", "execfile", "parse_expr", "read_pickle", "system", "popen", "urlopen")


def executing(source: str) -> list[str]:
    """Each place that could execute what it reads, or open a connection, as `line: what`."""
    found = []
    mentioned = rf"(?<!\bre\.)\b({'|'.join(FUNCTIONS)})\b|np\.load|Environment\("
    for node in (node for node in nodes(source, mentioned) if isinstance(node, ast.Call)):
        written, keywords = ast.unparse(node.func), {key.arg: ast.unparse(key.value) for key in node.keywords}
        if written.rpartition(".")[2] in FUNCTIONS and written != "re.compile":
            found.append(f"{node.lineno}: {written}")
        if written == "np.load" and keywords.get("allow_pickle") != "False":
            found.append(f"{node.lineno}: {written} without allow_pickle=False")
        if written.endswith("Environment") and keywords.get("autoescape") != "True":
            found.append(f"{node.lineno}: {written} without autoescape=True")
    return found


def test_nothing_that_is_read_is_executed():
    found = {name: executing(text) for name, text in SOURCES.items()}
    assert {name: places for name, places in found.items() if places} == {}


@pytest.mark.parametrize(
    "source",
    [
        "eval(text)",
        "sympy.parse_expr(text)",
        "np.load(file)",
        "np.load(file, allow_pickle=True)",
        "jinja2.Environment(loader=loader)",
    ],
)
def test_a_place_that_could_execute_what_it_reads_is_found(source):
    assert len(executing(source)) == 1


@pytest.mark.parametrize("source", ["np.load(file, allow_pickle=False)", "re.compile(a)", "json.loads(a)"])
def test_what_only_reads_is_let_through(source):
    assert executing(source) == []


# --- imports, in a process: another test may have imported the same in this one ---

#: Without hypothesis, which says how often it was asked for, every name at the top is fetched.  Then each module of
#: ours is imported.  At every import on the way, and at the end, what lies in sys.modules under a name that could be
#: imported must be what would be imported: another thread may ask for it at that moment.
IMPORTS = """
import importlib, pkgutil, sys
from importlib.machinery import PathFinder

class Missing:
    asked = 0

    def find_spec(self, name, path=None, target=None):
        if name == "hypothesis":
            Missing.asked += 1
            raise ModuleNotFoundError(name)

stand_ins, seen = set(), set()

def look(event, arguments=()):
    if event != "import":
        return
    for name in reversed(list(sys.modules)):
        module = sys.modules.get(name)
        if (name, id(module)) in seen:
            break
        seen.add((name, id(module)))
        parent, _, last = name.rpartition(".")
        path = getattr(sys.modules.get(parent), "__path__", None) if parent else None
        if getattr(module, "__spec__", None) is None and (path or not parent) and PathFinder.find_spec(name, path):
            stand_ins.add(name)

look("import")
stand_ins.clear()  # what an interpreter starts with
sys.addaudithook(look)
sys.meta_path.insert(0, Missing())
import verification as vf

for name in vf.__all__:
    getattr(vf, name)
print(Missing.asked)
try:
    import verification.testing
except ImportError as error:
    print(error)
del sys.meta_path[0]
for package in ("fem1d2d", "ndtheory", "verification"):
    package = importlib.import_module(package)
    for module in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        if not module.name.startswith(tuple(sys.argv[1:])):
            importlib.import_module(module.name)
look("import")
print(*stand_ins)
import scipy.stats
assert sys.modules["scipy.stats"] is scipy.stats
assert scipy.stats.norm.cdf(0) == 0.5
"""


def test_only_the_kit_asks_for_hypothesis_and_no_import_puts_a_substitute_where_other_threads_import():
    by_night = ("ndtheory.symbolic.", "verification.figures.", "verification.testing.")  # sympy, matplotlib, hypothesis
    done = ended(IMPORTS, *(() if AT_NIGHT else by_night))
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == [
        "0",
        "verification.testing needs hypothesis: pip install hypothesis",
        "",  # no substitute
    ]


# --- the tests themselves ---

TESTS = sorted((ROOT / "tests").rglob("*.py"))


def private_names(source: str) -> Iterator[str]:
    """Every private name that a test reads, imports or replaces, ``__dict__`` too; ``_a_`` and ``__a__`` are none."""
    for node in nodes(source, r"(?<!\w)_(?!_)\w|__dict__"):
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
