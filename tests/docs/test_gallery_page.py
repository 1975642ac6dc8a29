"""The cases of docs/gallery.md: their values, what must change them, their files, and their page."""

import re
import sys
from importlib import import_module
from pathlib import Path

import meshio
import numpy as np
import pytest
from strategies import AT_NIGHT

import verification as vf

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "gallery.md").read_text("utf-8")
sys.path.append(str(DOCS / "cases"))
try:
    cases, meshes = import_module("cases"), import_module("meshes")
finally:
    sys.path.remove(str(DOCS / "cases"))
CASES = cases.CASES

#: Differences that were measured, row by row, rounded up; EXACT ones are rounding, at most 4e-11 (of a history).
EXACT = 1e-10
MEASURED = {
    "hertz": (2.6e-4, 2.9e-4),
    "roller": (1.2e-3, 2.2e-3),
    "cattaneo": (5.3e-3, 4.8e-3),
    "mindlin": (2.4e-3, 3.5e-3),
    "ssnv128": (3.7e-4, 4.4e-4, 2.1e-3, 3.1e-4, 2.8e-2),
    "patch": (EXACT,),
    "punch": (1.2e-4, 1.5e-2),
    "pin": (2.4e-3, 1.8e-3),
    "press-fit": (2.1e-3,),
    "stack": (EXACT,),
    "column": (EXACT,),
    "drag": (EXACT,),
    "slope": (EXACT,),
}

#: Keys of the file that are changed by about a tenth or less, so that the answer must be off.
MUTANTS = {
    "hertz": ({"body2.young": "2.0e5"}, {"body2.poisson": "0.28"}, {"body2.traction.top": "[0, -155]"}),
    "roller": ({"body1.young": "1.9e5"}, {"body2.young": "6.9e4"}, {"body2.traction.top": "[0, -44]"}),
    "cattaneo": ({"contact.friction": "0.29"}, {"body1.young": "6.7e4"}),
    "mindlin": ({"contact.friction": "0.29"}, {"body2.young": "7.3e4"}),
    "ssnv128": ({"contact.friction": "0.9"}, {"body2.poisson": "0.21"}, {"body2.traction.left": "[-150, 0]"}),
    "patch": ({"body2.traction.top": "[0, -100.0001]"}, {"contact.friction": "0.3", "contact.law": "local"}),
    "punch": ({"body1.traction.bottom": "[0, 0.051]"}, {"contact.interval": "[0, 0.96]"}),
    "pin": ({"body1.young": "2.1e5"}, {"body2.traction.left": "[0, -2950]"}, {"contact.gap": "0.0002"}),
    "press-fit": ({"body1.young": "1.9e5"}, {"body2.young": "6.9e4"}, {"contact.gap": "0.001"}),
    "stack": ({"body2.young": "7.01e4"}, {"body3.prescribed.top": '["free", -0.011]'}),
    "column": ({"body2.young.steel": "2e5"}, {"body2.poisson": "0.45"}),
    "drag": ({"contact.friction": "0.301"}, {"contact.law": "nonlocal", "contact.radius": "0.2"}),
    "slope": ({"contact.friction": "0.29"}, {"contact.law": "nonlocal", "contact.radius": "0.4"}),
}


pytestmark = pytest.mark.usefixtures("meshes_read_here")


def allowed(name):
    """A fifth more than was measured."""
    return 1.2 * np.array(MEASURED[name])


@pytest.mark.parametrize("name", CASES)
def test_a_case_has_the_value_from_elsewhere(name):
    rows = CASES[name].rows
    assert len(rows) == len(MEASURED[name])
    assert [(row.quantity, row.difference) for row, most in zip(rows, allowed(name), strict=True)
            if not row.difference <= most] == []  # fmt: skip


#: By day one of each case, and all of them by night.
SOME = [(name, keys) for name, each in MUTANTS.items() for keys in (each if AT_NIGHT else each[-1:])]


@pytest.mark.parametrize(("name", "keys"), SOME, ids=str)
def test_a_change_of_the_file_is_noticed(name, keys):
    case = CASES[name]
    problem = cases.solved(case.file).problem
    other = problem.with_keys(keys)
    found = vf.march(other) if other.steps else vf.solve(other)
    rows = list(case.compare(problem, found))
    assert any(not row.difference <= most for row, most in zip(rows, allowed(name), strict=True))


@pytest.mark.parametrize(("name", "side"), [("drag", "top"), ("slope", "handle")])
def test_another_direction_is_noticed(name, side):
    """A block that is drawn to the left, and a sledge that is pushed downhill: the force has another sign."""
    data = cases.solved(name).problem.to_dict()
    pulled = data["step"][-1]["body2"]["prescribed"]
    pulled[side] = [-pulled[side][0], pulled[side][1]]
    found = vf.march(vf.Problem.from_dict(data))
    assert [row.difference > 1 for row in CASES[name].compare(found.problem, found)] == [True]


@pytest.mark.parametrize("name", ["roller", "patch", "pin", "press-fit", "stack", "column"])
def test_the_iteration_ends_at_the_same_pressure(name):
    """The tolerance of the files is 1e-9, relative; measured: at most 5e-9 of the largest pressure."""
    found = cases.solved(name)
    run = vf.run(found.problem)
    assert run.converged
    assert np.abs(run.contact.pressure - found.contact.pressure).max() <= 1e-7 * found.contact.pressure.max()


def test_each_history_is_finished_and_no_warning_but_that_of_the_overlap_is_given():
    results = {case.file: cases.solved(case.file) for case in CASES.values()}
    assert all(result.converged for result in results.values() if isinstance(result, vf.History))
    told = {file: result.warnings for file, result in results.items() if result.warnings}
    assert list(told) == ["press-fit"]
    assert "overlap" in told["press-fit"][0]


def test_the_pressure_of_the_pin_has_the_force_as_its_resultant_and_that_of_hertz_as_its_limit():
    """So the closed form is checked apart from any mesh; both differences are of quadrature or of the limit."""
    problem = cases.solved("pin").problem
    end = 1.5
    x = np.linspace(-end, end, 400_001)
    force = 2 * np.pi * cases.HUB * 3000
    assert np.trapezoid(cases.of_pin(problem, x) * np.cos(x), x) == pytest.approx(force, rel=1e-5)
    small = problem.with_keys({"body2.traction.left": "[0, -3]"})
    radius, force = cases.PIN**2 / cases.CLEARANCE, force / 1000
    a, p0 = cases.hertz(force, radius, cases.plane(problem.body2) / 2)
    assert cases.of_pin(small, 0.0) == pytest.approx(p0, rel=1e-3)
    assert cases.of_pin(small, 1.01 * a) == 0 < cases.of_pin(small, 0.99 * a)


def test_the_pressure_at_the_corner_of_the_punch_is_no_result(tmp_path):
    """Cells half as large multiply it by the root of 2, as 1/sqrt(distance) does; the middle changes by 0.2 %."""
    problem = cases.solved("punch").problem
    coarse = cases.solved("punch").contact.pressure[[0, -1]]
    meshes.bed(tmp_path / "bed.msh", 0.005)
    fine = vf.solve(problem.with_keys({"body1.mesh": str(tmp_path / "bed.msh")})).contact.pressure[[0, -1]]
    assert fine / coarse == pytest.approx([1, np.sqrt(2)], rel=2e-3)


def test_the_script_writes_the_mesh_files_and_they_are_small(tmp_path):
    meshes.main(tmp_path)
    written = sorted(path.name for path in tmp_path.iterdir())
    assert written == sorted(path.name for path in (DOCS / "cases").glob("*.msh"))
    for name in written:
        kept = DOCS / "cases" / name
        assert kept.stat().st_size < 60_000
        one, other = meshio.gmsh.read(kept), meshio.gmsh.read(tmp_path / name)
        assert one.points == pytest.approx(other.points, abs=1e-7)
        assert [cells.data.tolist() for cells in one.cells] == [cells.data.tolist() for cells in other.cells]


@pytest.mark.parametrize("name", ["cattaneo", "mindlin"])
def test_the_closed_form_is_drawn_on_the_shear(name):
    """Measured at the nodes: a root mean square of 2 % and 5 % of the largest shear, most of it where slip begins."""
    lines = {line.get_label(): line.get_xydata() for line in CASES[name].figure.axes[0].lines}
    known, shear = lines["closed form"], lines["shear on body 2"]
    off = np.interp(shear[:, 0], *known.T, left=0, right=0) - shear[:, 1]
    assert np.sqrt(np.mean(off**2)) <= 0.06 * np.abs(known[:, 1]).max()


def test_the_page_has_each_case_its_file_its_meshes_and_a_picture_with_words():
    assert set(CASES) == set(MEASURED) == set(MUTANTS)
    assert PAGE.count("image: {") == len(CASES)
    for name, case in CASES.items():
        assert f"(gallery-{name})=\n## {case.title}\n" in PAGE
        assert f'CASES["{name}"].figure' in PAGE
        assert f"literalinclude}} cases/{case.file}.toml" in PAGE
        for mesh in re.findall(r'mesh = "(.*?)"', (DOCS / "cases" / f"{case.file}.toml").read_text("utf-8")):
            assert f"<cases/{mesh}>" in PAGE
    assert {path.stem for path in (DOCS / "cases").glob("*.toml")} == {case.file for case in CASES.values()}


def test_each_case_has_its_rows_in_the_table_and_a_picture():
    lines = cases.table().splitlines()
    assert len(lines) == 2 + sum(map(len, MEASURED.values()))
    assert all(len(line.split(" | ")) == 7 for line in lines[2:])
    for name in ("hertz", "mindlin", "pin", "slope"):
        assert CASES[name].figure.axes
