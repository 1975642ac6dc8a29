"""Mesh files: what is read, what is cleaned, what is refused and in which words.

They are read in this process here, which saves 0.2 s for each; test_mesh_process is about the process that reads them.
"""

import os
import tempfile
from pathlib import Path

import meshio
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mesh_writer import CELLS, GMSH41, LINE, MSH, SQUARE, lines_of, refused
from strategies import fewer, in_floats, plane_meshes

from fem1d2d import MeshError, from_file, gram, mesh_reader, rectangle, surface
from fem1d2d.mesh import measures

TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])


pytestmark = pytest.mark.usefixtures("meshes_read_here")


def write(path, points, triangles, sides=None, *, more=(), binary=False):
    """A gmsh 2.2 file: named sides as blocks of lines, one physical number each."""
    sides = sides or {}
    blocks = [*[("line", np.array(facets)) for facets in sides.values()], ("triangle", np.array(triangles)), *more]
    blocks = [(kind, cells) for kind, cells in blocks if len(cells)]
    tags = [np.full(len(cells), i + 1) for i, (_, cells) in enumerate(blocks)]
    names = {name: np.array([i + 1, 1]) for i, name in enumerate(sides)}
    mesh = meshio.Mesh(points, blocks, field_data=names, cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags})
    meshio.write(path, mesh, file_format="gmsh22", binary=binary)
    return path


# --- read -------------------------------------------------------------------------------------------------------------


@fewer(2)
@given(plane_meshes(most=3), st.booleans(), st.floats(-5, 5), st.integers(0, 3), st.randoms(use_true_random=False))
def test_a_mesh_comes_back_with_triangles_turned_and_unused_points_left_out(mesh, binary, z, extra, random):
    mesh = in_floats(mesh)
    flipped = [cell[::-1] if random.random() < 0.5 else cell for cell in mesh.cells]
    points = np.concatenate([np.full((extra, 2), 77.0), mesh.points])
    points = np.column_stack([points, np.full(len(points), z)])
    with tempfile.TemporaryDirectory() as folder:
        sides = {side: facets + extra for side, facets in mesh.sides.items()}
        path = write(Path(folder) / "body.msh", points, np.array(flipped) + extra, sides, binary=binary)
        found = from_file(path)
    assert np.array_equal(found.points, mesh.points)
    assert [set(cell) for cell in found.cells.tolist()] == [set(cell) for cell in mesh.cells.tolist()]
    assert (measures(found.points, found.cells) == measures(mesh.points, mesh.cells)).all()
    assert {side: facets.tolist() for side, facets in found.sides.items()} == {
        side: facets.tolist() for side, facets in mesh.sides.items()
    }


@pytest.mark.parametrize("convert", [str, Path])
def test_a_path_may_be_a_string(tmp_path, convert):
    path = write(tmp_path / "body.msh", SQUARE, TRIANGLES, {"bottom": [[0, 1]]})
    assert lines_of(from_file(convert(path))) == {"bottom": {frozenset([(0.0, 0.0), (1.0, 0.0)])}}


def test_a_rectangle_read_from_a_file_has_the_matrices_of_a_rectangle(tmp_path):
    mesh = rectangle((0.0, 2.0), (0.0, 1.0), (3, 2))
    path = write(tmp_path / "body.msh", np.pad(mesh.points, ((0, 0), (0, 1))), mesh.cells, mesh.sides)
    found = from_file(path)
    assert np.array_equal(gram(found).toarray(), gram(mesh).toarray())
    assert surface(found, upper=True).tolist() == surface(mesh, upper=True).tolist()


def test_gmsh_s_own_format_gives_sides_by_their_physical_names(tmp_path):
    path = tmp_path / "square.msh"
    path.write_text(GMSH41)
    mesh = from_file(path)
    assert mesh.points.tolist() == [[0, 0], [1, 0], [1, 1], [0, 1]]
    assert measures(mesh.points, mesh.cells).tolist() == [0.5, 0.5]
    edge = lambda a, b: frozenset([tuple(SQUARE[a, :2].tolist()), tuple(SQUARE[b, :2].tolist())])
    around = [edge(0, 1), edge(1, 2), edge(2, 3), edge(3, 0)]
    assert lines_of(mesh) == {"base": {around[0]}, "flank": {around[1], around[3]}, "all": set(around)}


@pytest.mark.parametrize("name", ["body.msh", "body.inp", "rubbish.msh", "rubbish.inp"])
def test_reading_a_mesh_writes_nothing_to_standard_output(tmp_path, capsys, name):
    path = tmp_path / name
    if name.startswith("rubbish"):
        path.write_text("$MeshFormat\nworld\n" if name.endswith("msh") else "*ELEMENT\n")
        with pytest.raises(MeshError, match="meshio cannot read it"):
            from_file(path)
    else:
        meshio.write(path, square_with_sets()) if name.endswith("inp") else path.write_text(GMSH41)
        from_file(path)
    assert capsys.readouterr().out == ""


def square_with_sets():
    """Two triangles and two blocks of lines, each a named set."""
    none = np.array([], dtype=int)
    cells = [("line", np.array([[0, 1]])), ("line", np.array([[2, 3]])), ("triangle", TRIANGLES)]
    return meshio.Mesh(
        SQUARE, cells, cell_sets={"bottom": [np.array([0]), none, none], "top": [none, np.array([0]), none]}
    )


def test_named_sets_of_lines_of_another_format_are_sides(tmp_path):
    path = tmp_path / "body.inp"
    meshio.write(path, square_with_sets())
    assert {side: facets.tolist() for side, facets in from_file(path).sides.items()} == {
        "bottom": [[0, 1]],
        "top": [[2, 3]],
    }


def test_points_of_two_coordinates_are_read(tmp_path):
    path = tmp_path / "body.inp"
    path.write_text(
        "*NODE\n1, 0, 0\n2, 1, 0\n3, 0, 1\n"
        "*ELEMENT, TYPE=T3D2, ELSET=base\n1, 1, 2\n*ELEMENT, TYPE=CPS3, ELSET=all\n2, 1, 2, 3\n"
    )
    assert mesh_reader.contents(path)["points"].shape == (3, 2)
    assert lines_of(from_file(path)) == {"base": {frozenset([(0.0, 0.0), (1.0, 0.0)])}}


@pytest.mark.parametrize("name", ["BODY.MSH", "body.Msh", "a.b.vtk.msh"])
def test_an_ending_may_have_capitals_and_a_name_may_have_dots(tmp_path, name):
    path = write(tmp_path / "body.msh", SQUARE, TRIANGLES, {"bottom": [[0, 1]]}).rename(tmp_path / name)
    assert list(from_file(path).sides) == ["bottom"]


# --- refused ----------------------------------------------------------------------------------------------------------


def test_a_missing_file_is_refused(tmp_path):
    refused(tmp_path / "absent.msh", "no such mesh file")


def test_a_folder_is_refused(tmp_path):
    (tmp_path / "folder.msh").mkdir()
    refused(tmp_path / "folder.msh", "a regular file is needed")


@pytest.mark.parametrize("kind", ["pipe", "device"])
def test_what_has_no_end_is_refused(tmp_path, kind):
    path = tmp_path / "body.msh"
    os.mkfifo(path) if kind == "pipe" else path.symlink_to("/dev/zero")
    refused(path, "a regular file is needed")


RUBBISH = [
    b"",
    b"$MeshFormat\n\xff\x13\x80" * 64,
    b"hello\nworld\n",
    b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 1 1",
]


@pytest.mark.parametrize("content", RUBBISH, ids=["empty", "binary", "words", "cut short"])
@pytest.mark.parametrize("ending", [".msh", ".inp"])
def test_rubbish_is_refused_whatever_it_is_called(tmp_path, content, ending):
    path = tmp_path / f"rubbish{ending}"
    path.write_bytes(content)
    with pytest.raises(
        MeshError, match=r"no Gmsh file|meshio cannot read it|text in UTF-8|no triangles or|do not fit its format"
    ):
        from_file(path)


@pytest.mark.parametrize(
    "ending", [*sorted({*meshio.extension_to_filetypes} - {".msh", ".inp"}), ".xyz", ".msh.gz", ""]
)
def test_a_file_with_another_ending_is_refused_unread_with_a_way_to_convert_it(tmp_path, ending):
    path = tmp_path / f"body{ending}"
    path.write_bytes(b"")
    found = f"the ending '{path.suffix}'" if ending else "no ending"
    refused(
        path,
        f"needed a Gmsh file .* or an Abaqus file .*, this one has {found}; `meshio convert -o gmsh22 FILE out.msh`",
    )


def test_a_file_of_fluent_is_no_gmsh_file_in_spite_of_its_ending(tmp_path):
    path = tmp_path / "body.msh"
    path.write_text('(0 "GAMBIT to Fluent File")\n')
    refused(path, r"no Gmsh file: needed \$MeshFormat on its first line")


def test_a_file_cut_anywhere_is_refused_or_read_but_nothing_else_escapes(tmp_path):
    path = tmp_path / "cut.msh"
    whole = write(tmp_path / "whole.msh", SQUARE, TRIANGLES, {"bottom": [[0, 1]]}, binary=True).read_bytes()
    outcomes = set()
    for length in range(0, len(whole), 7):
        path.write_bytes(whole[:length])
        try:
            outcomes.add(len(from_file(path).cells))
        except MeshError:
            outcomes.add("refused")
    assert outcomes == {"refused", 2}  # 2 where nothing but the closing mark is missing: never a part of the body


def test_the_refusal_of_an_unreadable_file_names_its_cause(tmp_path):
    path = tmp_path / "rubbish.inp"
    path.write_text("*NODE\n1, x, 0\n")
    refused(path, r"meshio cannot read it \(could not convert string to float: ' x'\)")


@pytest.mark.parametrize("rubbish", ["x" * 2000, "\x01" * 300, "\u00ff\u00fe" * 300])
def test_the_refusal_of_rubbish_repeats_little_of_it(tmp_path, rubbish):
    path = tmp_path / "rubbish.inp"
    path.write_text(f"*NODE\n1, {rubbish}, 0\n", encoding="utf-8")
    refused(path, "meshio cannot read it")
    with pytest.raises(MeshError) as caught:
        from_file(path)
    assert len(str(caught.value)) < len(str(path)) + 140
    assert str(caught.value).isprintable()


def test_elements_of_no_group_beside_those_of_groups_are_refused_with_the_setting_of_gmsh(tmp_path):
    path = tmp_path / "all.msh"
    path.write_text(GMSH41.replace("3 0 1 0 1 1 0 1 9 2 3 -4", "3 0 1 0 1 1 0 0 2 3 -4"))
    refused(path, "to a physical group and others to none: Mesh.SaveAll = 1 of gmsh .* save it with Mesh.SaveAll = 0")


def test_a_file_in_another_encoding_is_refused(tmp_path):
    path = tmp_path / "body.inp"
    path.write_bytes("*ELSET, ELSET=Fläche\n".encode("latin-1"))
    refused(path, "needed text in UTF-8")


def test_a_file_without_cells_of_a_plane_is_refused_by_what_it_has(tmp_path):
    path = write(tmp_path / "body.msh", SQUARE, [], {"bottom": [[0, 1]]}, more=[("tetra", np.array([[0, 1, 2, 3]]))])
    refused(path, "no triangles or quadrilaterals in it, only line, tetra")


def test_a_file_without_cells_is_refused(tmp_path):
    path = tmp_path / "body.msh"
    path.write_text("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n")
    refused(path, "no triangles or quadrilaterals in it, only nothing")


def test_points_off_the_plane_are_refused(tmp_path):
    points = SQUARE.copy()
    points[2, 2] = 0.1
    path = write(tmp_path / "body.msh", points, TRIANGLES, {"bottom": [[0, 1]]})
    refused(path, "the points do not lie in a plane z = constant")


def test_a_name_of_a_surface_is_no_side(tmp_path):
    tags = [np.array([1, 1])]
    mesh = meshio.Mesh(
        SQUARE,
        [("triangle", TRIANGLES)],
        field_data={"body": np.array([1, 2])},
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
    )
    meshio.write(tmp_path / "body.msh", mesh, file_format="gmsh22", binary=False)
    refused(tmp_path / "body.msh", "no named lines")


def test_a_flat_triangle_is_refused(tmp_path):
    points = np.concatenate([SQUARE, [[0.5, 0.0, 0.0]]])
    path = write(tmp_path / "body.msh", points, [*TRIANGLES, [0, 4, 1]], {"bottom": [[0, 1]]})
    with pytest.raises(MeshError, match="cell 2 has no positive area"):
        from_file(path)


def test_a_body_partly_of_other_cells_is_refused_and_not_cut_down_to_its_triangles(tmp_path):
    points = np.concatenate([SQUARE, [[2.0, 0.0, 0.0], [2.0, 1.0, 0.0]]])
    more = [("tetra", np.array([[1, 4, 5, 2]]))]
    path = write(tmp_path / "body.msh", points, TRIANGLES, {"bottom": [[0, 1]]}, more=more)
    refused(path, "needed only triangles and quadrilaterals, it has tetra too")


# --- files whose numbers do not fit together ---


def written(path, *elements):
    numbered = "\n".join(f"{i} {element}" for i, element in enumerate(elements, 1))
    path.write_text(MSH.format(count=len(elements), elements=numbered))
    return path


@pytest.mark.parametrize(
    ("elements", "message"),
    [
        ([LINE, LINE, *CELLS], r"side 'bottom' lists the facet from \(0, 0\) to \(1, 0\) 2 times: once is needed"),
        ([LINE, "1 2 1 1 2 1", *CELLS], "2 times"),
        ([LINE, *CELLS, *CELLS], "cells 0 and 2 have the same nodes: each cell is needed once"),
        ([LINE, *CELLS, "2 2 9 1 3 2 1"], "cells 0 and 2 have the same nodes"),
        ([LINE, *CELLS, "2 2 9 1 1 2 4"], r"cells \d and 2 lie on the same side of the facet"),
        ([LINE, *CELLS, "2 2 9 1 2 3 4"], r"cells \d and 2 lie on the same side of the facet"),
        ([LINE, "2 2 9 1 1 2 0", *CELLS], "an element names node 0: nodes are numbered from 1"),
        ([LINE, "2 2 9 1 1 2 -1", *CELLS], "an element names node -1: nodes are numbered from 1"),
        ([LINE, "2 2 9 1 1 2 7", *CELLS], "meshio cannot read it"),
        (["1 2 1 1 1 0", *CELLS], "an element names node 0: nodes are numbered from 1"),
        (
            CELLS,
            r"it names lines \(bottom\), but no element belongs to one: Mesh.SaveAll = 1 of gmsh writes such files",
        ),
        ([LINE, *CELLS, "2 2 9 1 1 2 " + "7" * 25], "its contents do not fit its format"),
        ([LINE, *CELLS, "99 2 9 1 1 2"], r"meshio cannot read it \(its contents do not fit its format\)"),
        ([LINE], "no triangles or quadrilaterals in it, only line; give the surface a physical name too"),
        ([LINE, *("2 3 9 1 1 2 3", "2 3 9 1 1 3 4")], "its contents do not fit its format"),
    ],
)
def test_a_file_whose_cells_or_sides_do_not_fit_together_is_refused(tmp_path, elements, message):
    refused(written(tmp_path / "body.msh", *elements), message)


@pytest.mark.parametrize("turned", [[0], [1], [0, 1]])
def test_triangles_listed_clockwise_are_turned_over(tmp_path, turned):
    backwards = lambda cell: " ".join(cell.split()[:4] + cell.split()[:3:-1])
    cells = [backwards(cell) if i in turned else cell for i, cell in enumerate(CELLS)]
    found = from_file(written(tmp_path / "body.msh", LINE, *cells))
    assert measures(found.points, found.cells).tolist() == [0.5, 0.5]
    assert len(found.boundary) == 4


@pytest.mark.parametrize(("where", "node"), [("triangles", -1), ("triangles", -4), ("lines", -1)])
def test_a_node_number_below_one_is_no_node_counted_from_the_end(tmp_path, where, node):
    """meshio would take the last one: a valid square, of another body."""
    triangles, lines = TRIANGLES.copy(), [[3, 0]]
    if where == "triangles":
        triangles[1, 2] = node
    else:
        lines = [[node, 0]]
    path = write(tmp_path / "body.msh", SQUARE, triangles, {"left": lines})
    refused(path, f"an element names node {node + 1}: nodes are numbered from 1")


def test_a_node_number_below_one_of_format_4_is_refused(tmp_path):
    path = tmp_path / "square.msh"
    path.write_text(GMSH41.replace("6 2 11 9\n", "6 2 0 9\n"))
    refused(path, "an element names node 0: nodes are numbered from 1")


def test_names_without_lines_are_left_out(tmp_path):
    path = written(tmp_path / "body.msh", LINE, *CELLS)
    path.write_text(path.read_text().replace('2\n1 1 "bottom"', '3\n1 2 "nothing"\n1 1 "bottom"'))
    assert list(from_file(path).sides) == ["bottom"]


@pytest.mark.parametrize("name", ["m" * 300 + ".msh", "a\0b.msh"])
def test_a_path_that_can_name_no_file_is_refused_as_one(tmp_path, name):
    with pytest.raises(MeshError, match=r"cannot be read: |no such mesh file"):
        from_file(tmp_path / name)
