"""The house: what each module may import, how long a package may be, the table of docs/architecture.md.

``python tests/test_floors.py`` writes the table into the page.
"""

import graphlib
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest
from import_graph import COMPUTED, FILES, Import, edges, imports, within

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "architecture.md"
BEGIN, END = "<!-- floors: python tests/test_floors.py -->", "<!-- end of floors -->"

#: The modules of a package that no other floor has.
OTHERS = "*"

#: From the ground upwards: floor -> package -> its modules.  A module imports from its own floor and from those below.
FLOORS: dict[str, dict[str, str]] = {
    "theory": dict.fromkeys(("ndtheory.symbolic", "ndtheory.continuum", "ndtheory"), OTHERS),
    "elastic bodies": dict.fromkeys(("fem1d2d.proofs", "fem1d2d"), OTHERS),
    "for all of verification": {
        "verification": "dense registry spreadsheet value",
        "verification.machine": OTHERS,
        "verification.show": OTHERS,
    },
    "input": {"verification.problem": OTHERS},
    "results, extras": {"verification": "document extras schemas"},
    "bodies": {"verification.interface": OTHERS, "verification.contact": OTHERS},
    "constants": {"verification.constants": OTHERS},
    "iteration": {"verification.algorithm": OTHERS},
    "bounds": {"verification.bounds": OTHERS},
    "answers": {"verification": "comparison exercises", "verification.algorithm": "history"},
    "sections of the core": {"verification.sections": OTHERS},
    "proofs": {
        "verification.semidefinite": OTHERS,
        "verification.certificate": OTHERS,
        "verification.free_norm": "__init__ numbers rectangles search",
    },
    "free norm": {"verification.free_norm": OTHERS},
    "runs over grids": {"verification.sweeps": OTHERS},
    "couplings": {"verification.coupling": OTHERS},
    "the paper": {"verification.reproduce": OTHERS, "verification.ledger": OTHERS},
    "pages that move": {"verification.exploration": OTHERS},
    "figures": {"verification.figures": OTHERS},
    "files": {"verification.output": OTHERS},
    "names for users": {"verification": "__init__"},
    "commands, test kit": {"verification.cli": OTHERS, "verification.testing": OTHERS},
}

#: Floors of the core, which the mission needs; what stands above is a wing, and the core imports none.
CORE = tuple(FLOORS)[: tuple(FLOORS).index("proofs")]

#: Imports inside functions: who, what, and why not at the top of the module.
INSIDE = (
    ("verification.cli", "verification", "the command starts without arrays"),
    ("verification.cli", "ndtheory", "the command starts with what the calculator needs"),
    ("verification.cli.main", "importlib.metadata", "only a fault asks where to report it"),
    ("verification.cli.main", "fem1d2d", "only an error asks whether it is one of a mesh: numpy"),
    ("verification.cli", "tomllib", "one command in ten reads a file"),
    ("verification.cli.console", "rich", "only progress needs it"),
    ("verification.semidefinite.bound", "verification.semidefinite", "the calculator has bounds and no arrays"),
    ("verification.free_norm.bound", "verification.free_norm", "the calculator has bounds and no arrays"),
    ("verification.free_norm.bound", "verification.semidefinite", "the calculator has bounds and no arrays"),
    ("verification.free_norm.bound", "verification.certificate", "proofs are loaded once they are asked for"),
    ("verification.semidefinite.lipschitz", "verification.certificate", "proofs are loaded once they are asked for"),
    ("verification.ledger.rows", "verification.ledger.sources", "records are read without sympy, which takes a second"),
    ("verification.output.folder", "verification.figures", "matplotlib is loaded once there is something to draw"),
    ("verification.output.fields", "meshio", "half a second; only a folder needs it"),
    ("verification.exploration.page", "jinja2", "it is loaded once there is a page"),
    ("verification.output.folder", "verification.output.report", "jinja2 is loaded once there is a comparison"),
    ("verification.constants.cells", "fem1d2d.proofs.layers_proved", "balls take 50 ms to load; only proofs need them"),
    ("verification.contact.step", "verification.contact.model", "cvxpy takes a second, and few steps need it"),
    ("verification.contact.step", "scipy.optimize", "heavy; only bodies that contact alone holds need it"),
    ("verification.machine.threads", "threadpoolctl", "ledger records are read without it"),
    ("verification.sweeps.workers", "joblib", "heavy; only processes of one's own need it"),
    ("verification.sweeps.workers", "multiprocessing", "heavy; only processes of one's own need it"),
    ("verification.sweeps.workers", "asyncio", "few have a cluster"),
    ("verification.sweeps.workers", "distributed", "an extra"),
    ("verification.sweeps.export", "xarray", "an extra"),
    ("verification.coupling.kratos", "KratosMultiphysics", "Kratos itself loads the module, and few have it"),
    ("fem1d2d.mesh_reader", "meshio", "heavy; the format of the file decides"),
    ("fem1d2d.mesh_reader", "resource", "Windows has none"),
    ("fem1d2d.outline", "scipy.spatial", "heavy; only bodies drawn by files need it"),
)


#: Modules that execute what they read, or send it away: nobody imports them, as SECURITY.md says.
EXECUTE = ("dill", "ftplib", "http", "marshal", "pickle", "runpy", "shelve", "smtplib", "socket", "urllib", "yaml")

#: What only these may import, with what they hold.
DOORS = {
    "ndtheory": ("ndtheory", "verification"),
    "fem1d2d": ("fem1d2d", "verification"),
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
    **dict.fromkeys(EXECUTE, ()),
}

#: All that the theory knows beside the standard library, and who in it.
THEORY = {"sympy": ("ndtheory.symbolic",)}


def through_the_wall(found: list[Import]) -> Iterator[str]:
    """The imports of a library by a module that has no door to it, and those that name none."""
    for module, line, name, _ in found:
        library = name.partition(".")[0]
        owners = DOORS.get(library, (module,))
        if within(module, "ndtheory") and library not in {"ndtheory", *sys.stdlib_module_names}:
            owners = THEORY.get(library, ())
        if name == COMPUTED or not within(module, *owners):
            yield f"{module}:{line}: imports {name}"


def levels(floors: Mapping[str, Mapping[str, str]]) -> dict[str, int]:
    """The floor of each module by number, 0 for the ground.

    Raises
    ------
    ValueError
        A module that is listed twice.
    """
    found: dict[str, int] = {}
    whole: dict[str, int] = {}
    for number, packages in enumerate(floors.values()):
        for package, names in packages.items():
            for name in names.split():
                module = package if name in ("__init__", OTHERS) else f"{package}.{name}"
                stands = whole if name == OTHERS else found
                if module in stands:
                    raise ValueError(f"{module} stands on two floors")
                stands[module] = number
    owners = {
        module: module if path.name == "__init__.py" else module.rpartition(".")[0] for module, path in FILES.items()
    }
    return {module: whole[owner] for module, owner in owners.items() if owner in whole} | found


def upward(found: list[Import], level: Mapping[str, int]) -> list[str]:
    """The imports that go up, also for types."""
    return [
        f"{edge.module}:{edge.line}: imports {edge.name}, which stands above it"
        for edge in found
        if edge.name in level and level[edge.name] > level[edge.module]
    ]


def circle(found: list[Import]) -> list[str]:
    """Modules that import each other in a circle, also by name or for types; empty where there is none."""
    graph: dict[str, set[str]] = {}
    for edge in found:
        graph.setdefault(edge.module, set()).add(edge.name)
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        return list(error.args[1])
    return []


def unlisted(found: list[Import]) -> Iterator[str]:
    """The imports inside functions that no line of INSIDE is about."""
    for edge in found:
        listed = any(within(edge.module, who) and within(edge.name, what) for who, what, _ in INSIDE)
        if edge.kind == "function" and not listed:
            yield f"{edge.module}:{edge.line}: imports {edge.name} inside a function"


def table() -> str:
    """The floors as the page shows them, the highest first."""
    rows = ["| floor | packages and modules |", "|---|---|"]
    for floor, packages in reversed(FLOORS.items()):
        shown = []
        for package, names in packages.items():
            inside = ", ".join(f"`{name}`" for name in names.split() if name not in ("__init__", OTHERS))
            shown.append(f"**{package}**: {inside}" if inside else f"**{package}**")
        rows.append(f"| {floor} | {'<br>'.join(shown)} |")
    return "\n".join(rows)


def with_table(page: str) -> str:
    """The page with the table of today."""
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n{table()}\n{END}{after}"


def test_every_module_stands_on_exactly_one_floor():
    assert set(levels(FLOORS)) == set(FILES)


def test_no_import_goes_up(ours):
    assert upward(ours, levels(FLOORS)) == []


def test_no_import_closes_a_circle(ours):
    assert circle(ours) == []


def test_no_import_passes_a_wall_without_a_door(ours):
    assert list(through_the_wall(ours)) == []


def test_only_the_face_of_the_package_imports_by_name(ours):
    assert {edge.module for edge in ours if edge.kind == "name"} <= {"verification"}


def test_the_core_imports_no_wing(ours):
    wings = {module for module, floor in levels(FLOORS).items() if floor >= len(CORE)}
    crossing = [edge for edge in ours if edge.module not in wings and edge.name in wings]
    assert crossing == []


def test_imports_inside_functions_are_those_of_the_list(ours):
    assert list(unlisted(ours)) == []


def test_no_line_of_the_list_is_idle(ours):
    inside = [edge for edge in ours if edge.kind == "function"]
    idle = [who for who in INSIDE if not any(within(e.module, who[0]) and within(e.name, who[1]) for e in inside)]
    assert idle == []


def test_the_page_has_the_table_of_today():
    page = PAGE.read_text("utf-8")
    assert page == with_table(page), "docs/architecture.md is behind: python tests/test_floors.py"


# --- these tests find what they are for ---

LOW, MIDDLE, HIGH = "verification.value", "verification.problem.specs", "verification.cli.main"
PLANTED = {"ground": {"verification": "value", "verification.problem": "specs"}, "roof": {"verification.cli": "main"}}


def planted(**texts: str) -> list[Import]:
    """The imports of three modules: nothing, unless a text is given for one of them."""
    return edges({LOW: texts.get("low", ""), MIDDLE: texts.get("middle", ""), HIGH: texts.get("high", "")})


@pytest.mark.parametrize(
    "text",
    [
        "import verification.cli.main",
        "from verification.cli.main import cli",
        "from verification.cli import main",
        "def f():\n    if True:\n        from verification.cli.main import cli",
        "class A:\n    async def f(self):\n        import verification.cli.main as m",
        "if TYPE_CHECKING:\n    from verification.cli.main import cli",
        "from .cli import main",
        "try:\n    from verification.cli import main\nexcept ImportError:\n    pass",
    ],
)
def test_an_import_that_goes_up_is_found(text):
    assert len(upward(planted(low=text), levels(PLANTED))) == 1
    assert upward(planted(high=text.replace("cli.main", "value").replace("cli", "value")), levels(PLANTED)) == []


@pytest.mark.parametrize(
    "text", ["from {} import x", "def f():\n    from {} import x", "if TYPE_CHECKING:\n    import {}"]
)
def test_a_circle_on_one_floor_is_found_also_through_a_function_or_for_types(text):
    one = planted(low=f"import {MIDDLE}")
    assert circle(one) == upward(one, levels(PLANTED)) == []
    both = planted(low=f"import {MIDDLE}", middle=text.format(LOW))
    assert upward(both, levels(PLANTED)) == []
    assert set(circle(both)) == {LOW, MIDDLE}


def test_a_package_has_the_modules_that_no_other_floor_has():
    split = {"ground": {"verification.bounds": "table"}, "roof": {"verification.bounds": OTHERS}}
    found = levels(split)
    assert set(found) == {module for module in FILES if within(module, "verification.bounds")}
    assert {module for module, floor in found.items() if floor == 0} == {"verification.bounds.table"}
    with pytest.raises(ValueError, match=r"verification\.bounds stands on two floors"):
        levels(split | {"attic": {"verification.bounds": OTHERS}})


def test_a_module_on_no_floor_and_one_on_two_are_found():
    assert set(levels(PLANTED)) == {LOW, MIDDLE, HIGH}
    assert set(levels({"roof": PLANTED["roof"]})) != {LOW, MIDDLE, HIGH}
    with pytest.raises(ValueError, match=r"verification\.cli\.main stands on two floors"):
        levels(PLANTED | {"attic": {"verification.cli": "main"}})


def test_an_import_inside_a_function_needs_a_line_on_the_list():
    assert list(unlisted(planted(low="def f():\n    import numpy")))
    assert list(unlisted(planted(middle="def f():\n    from verification.value import Value")))
    assert list(unlisted(planted(high="def f():\n    from verification.value import Value"))) == []
    assert list(unlisted(planted(low="import numpy"))) == []


def test_an_import_by_name_is_no_way_past_the_lists():
    (edge,) = planted(low='def f():\n    return importlib.import_module("verification.cli.main").cli')
    assert edge == Import(LOW, 2, HIGH, "name")


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("fem1d2d.mesh", "import ndtheory"),
        ("fem1d2d.mesh", "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import ndtheory.bounds as b"),
        ("fem1d2d.mesh", "from .. import ndtheory"),
        ("ndtheory.bounds", "import os, fem1d2d.mesh"),
        ("ndtheory.bounds", "try:\n    import numpy\nexcept ImportError:\n    pass"),
        ("ndtheory.symbolics", "import sympy"),
        ("ndtheory.bounds", "import importlib\nimportlib.import_module('scipy')"),
        ("verification.sweep", "import_module(f'cv{x}')"),
        ("verification.contact.kkt", "def f():\n    from cvxpy.constraints import Zero"),
        ("verification.sweep", "from urllib.request import urlopen"),
    ],
)
def test_an_import_without_a_door_is_found(module, source):
    assert len(list(through_the_wall(edges({module: source})))) == 1


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("fem1d2d.mesh", "import numpy\nfrom fem1d2d import element\nfrom . import material"),
        ("ndtheory.bounds", "from decimal import Decimal\nfrom ndtheory.number import sqrt\nfrom .errors import X"),
        ("ndtheory.symbolic", "import sympy"),
        ("verification", "importlib.import_module(f'verification.{home}')"),
        ("verification.contact.model", "import ndtheory, fem1d2d, cvxpy"),
        ("verification.figures.region", "import matplotlib"),
    ],
)
def test_an_import_by_its_door_is_let_through(module, source):
    assert list(through_the_wall(edges({module: source}))) == []


def test_relative_imports_are_resolved_from_packages_and_from_modules():
    assert [each.name for each in imports("a.b", "from .c import d\nfrom .. import e", True)] == ["a.b.c.d", "a.e"]
    assert [each.name for each in imports("a.b", "from .c import d\nfrom . import e")] == ["a.c.d", "a.e"]


def test_a_page_that_is_behind_is_found():
    page = f"before\n{BEGIN}\n| floor |\n{END}\nafter\n"
    assert with_table(page) != page
    assert with_table(with_table(page)) == with_table(page)
    assert with_table(page).startswith("before\n")
    assert with_table(page).endswith("\nafter\n")


if __name__ == "__main__":
    PAGE.write_text(with_table(PAGE.read_text("utf-8")), "utf-8")
