"""Mesh files: materials, sections that promise too much, includes, and the variants of the formats."""

import struct
import subprocess
import sys
from pathlib import Path

import meshio
import numpy as np
import pytest
from mesh_writer import GMSH41, LINE, MSH, SQUARE, lines_of, refused
from processes import environment

from fem1d2d import from_file
from fem1d2d.mesh import measures

pytestmark = pytest.mark.usefixtures("meshes_read_here")


# --- one material ---


def surfaces(path, named, tags, version="2.2"):
    """The square with a tag for each of its triangles, which are two surfaces of its geometry, and names of tags."""
    names = "".join(f'2 {tag} "{name}"\n' for name, tag in named.items())
    if version == "2.2":
        text = MSH.replace('2\n1 1 "bottom"\n2 9 "body"\n', f'{1 + len(named)}\n1 1 "bottom"\n{names}')
        cells = [f"2 2 {tags[0]} 1 1 2 3", f"2 2 {tags[1]} 2 1 3 4"]
        path.write_text(text.format(count=3, elements="\n".join(f"{i} {e}" for i, e in enumerate([LINE, *cells], 1))))
        return path
    listed = [f"{len(of)} {' '.join(map(str, of))}".strip() for of in tags]
    text = GMSH41.replace('5\n0 5 "corner"', f'{4 + len(named)}\n0 5 "corner"').replace('2 3 "body"\n', names)
    text = text.replace("2 4 1 0\n", "2 4 2 0\n").replace(
        "0 1 3 4 1 2 3 4\n", f"0 {listed[0]} 0\n2 0 0 0 1 1 0 {listed[1]} 0\n"
    )
    text = text.replace("6 7 1 7\n", "7 7 1 7\n").replace("2 1 2 2\n5 2 4 9\n", "2 1 2 1\n5 2 4 9\n2 2 2 1\n")
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("named", "tags", "found"),
    [({"rubber": 9, "steel": 8}, (9, 8), '"rubber", "steel"'), ({"steel": 9}, (9, 8), '"8", "steel"')],
)
@pytest.mark.parametrize("version", ["2.2", "4.1"])
def test_two_named_surfaces_are_two_materials(tmp_path, version, named, tags, found):
    tags = tags if version == "2.2" else [[tag] for tag in tags]
    path = surfaces(tmp_path / "body.msh", named, tags, version)
    refused(path, f"needed one material: its triangles are split into the groups {found}; write a file for each")


@pytest.mark.parametrize(
    ("named", "tags"),
    [
        ({"body": 9}, (9, 9)),
        ({"body": 9, "nothing": 8}, (9, 9)),
        ({}, (9, 9)),
        ({}, (9, 8)),  # numbers without names
        ({}, (0, 0)),
        ({"part": 9}, (9, 0)),  # what is in no group
    ],
)
def test_surfaces_of_one_group_or_without_names_are_one_material(tmp_path, named, tags):
    assert len(from_file(surfaces(tmp_path / "body.msh", named, tags)).cells) == 2


@pytest.mark.parametrize(
    ("named", "tags"),
    [
        ({"body": 9}, ([9], [9])),
        ({}, ([9], [8])),
        ({"all": 9, "rubber": 7, "steel": 8}, ([7, 9], [8, 9])),
        ({"all": 9, "steel": 8}, ([9], [9, 8])),
    ],
)
def test_a_group_of_all_surfaces_is_one_material_whatever_other_groups_they_are_in(tmp_path, named, tags):
    assert len(from_file(surfaces(tmp_path / "body.msh", named, tags, "4.1")).cells) == 2


def abaqus(path, *more, cells="*ELEMENT, TYPE=CPS3\n2, 1, 2, 3\n3, 1, 3, 4\n4, 2, 5, 3\n"):
    """A square and a triangle at its right side in one Abaqus file."""
    nodes = "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 1, 1, 0\n4, 0, 1, 0\n5, 2, 0, 0\n"
    path.write_text(nodes + "*ELEMENT, TYPE=T3D2\n1, 1, 2\n" + cells + "*ELSET, ELSET=bottom\n1\n" + "\n".join(more))
    return path


STEEL, RUBBER = "*Elset, elset=steel\n 2, 3", "*ELSET, ELSET=rubber\n4"


@pytest.mark.parametrize(
    ("more", "found"),
    [
        ([STEEL, RUBBER], 'groups "rubber", "steel"'),
        ([STEEL, "*ELSET, ELSET=rest, GENERATE\n3, 4, 1"], 'groups "rest", "steel"'),
        (
            [STEEL, RUBBER, "*ELSET, ELSET=all\n2,3,4", "*SOLID SECTION, ELSET=steel, MATERIAL=S\n1.",
             "*Solid Section, elset=rubber, material=R\n1."],
            'materials "R", "S"',
        ),
    ],
)  # fmt: skip
def test_element_sets_that_split_all_triangles_are_materials(tmp_path, more, found):
    refused(abaqus(tmp_path / "body.inp", *more), f"needed one material: its triangles are split into the {found}; ")


@pytest.mark.parametrize(
    "more",
    [
        [STEEL],  # neighbours of a side
        ["*ELSET, ELSET=left\n3", "*ELSET, ELSET=right\n4"],
        ["*ELSET, ELSET=all\n2,3,4"],
        [STEEL, RUBBER, "*ELSET, ELSET=all\n2,3,4"],
        ["*ELSET, ELSET=everything, GENERATE\n1, 4, 1", STEEL, RUBBER],
        [STEEL, RUBBER, "*SOLID SECTION, ELSET=steel, MATERIAL=s\n1.", "*SOLID SECTION, ELSET=rubber, MATERIAL=S\n1."],
    ],
)
def test_element_sets_that_leave_triangles_out_or_hold_all_are_no_materials(tmp_path, more):
    assert len(from_file(abaqus(tmp_path / "body.inp", *more)).cells) == 3


# --- what meshio would mix up in an Abaqus file ---


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("*ELSET, ELSET=top\n2\n*ELSET, ELSET=top\n3\n", "needed one \\*ELSET or \\*NSET for each name"),
        ("*NSET, NSET=top\n2\n*NSET, NSET=top\n3\n", "needed one \\*ELSET or \\*NSET for each name"),
        ("*ELSET, ELSET=all\nbottom\n", "an \\*ELSET lists names of other sets"),
        ("*ELSET, ELSET=all\n1, 2\nbottom,\n", "an \\*ELSET lists names of other sets"),
        ("*ELEMENT, TYPE=T3D2, ELSET=edge\n9, 2, 3\n", "needed a different ELSET for each \\*ELEMENT"),
    ],
)
def test_sets_that_meshio_would_cut_short_or_give_to_others_are_refused(tmp_path, content, message):
    refused(abaqus(tmp_path / "body.inp", content), message)


@pytest.mark.parametrize("second", ["first", ""])
def test_sets_of_elements_that_meshio_would_count_in_another_way_are_refused(tmp_path, second):
    sets = ["first", second, "third"]
    blocks = [
        f"*ELEMENT, TYPE=T3D2{f', ELSET={name}' * bool(name)}\n{i}, {i}, {i + 1}\n" for i, name in enumerate(sets, 1)
    ]
    (tmp_path / "body.inp").write_text("*NODE\n1,0,0\n2,1,0\n3,1,1\n4,0,1\n" + "".join(blocks))
    refused(tmp_path / "body.inp", "needed a different ELSET for each \\*ELEMENT")


# --- files that lead elsewhere ---


@pytest.mark.parametrize(
    "line",
    [
        "*INCLUDE, INPUT={}", "*include,input={}", "*Include ,Input = {}", "  * INCLUDE, INPUT={}", "INCLUDE,INPUT={}",
        "*INCL*UDE,={}", "*\u0131nclude,={}", "\u2003*INCLUDE\x0b,={}", "*NODE, INPUT={}",
        "*Element, TYPE=CPS3, input={}",
    ],
)  # fmt: skip
@pytest.mark.parametrize("before", ["", "*ELSET, ELSET=top\n2\n", "*HEADING\r"])
def test_an_abaqus_file_that_includes_another_one_is_refused(tmp_path, monkeypatch, line, before):
    monkeypatch.setattr(meshio, "read", None)
    (tmp_path / "body.inp").write_bytes(f"{before}{line.format(tmp_path / 'other.inp')}\n*NODE\n".encode())
    refused(tmp_path / "body.inp", "it includes another file: needed one file that holds the whole mesh")


def test_a_comment_or_a_set_may_be_called_include(tmp_path):
    path = abaqus(tmp_path / "body.inp", "** *INCLUDE, INPUT=other.inp", "*ELSET, ELSET=include\n2")
    assert list(from_file(path).sides) == ["bottom"]


# --- the variants of Gmsh's format ---

BINARY41 = b"$MeshFormat\n4.1 1 8\n\1\0\0\0\n$EndMeshFormat\n"

GMSH40 = """$MeshFormat
4.0 0 8
$EndMeshFormat
$PhysicalNames
1
1 7 "base"
$EndPhysicalNames
$Entities
0 1 1 0
1 0 0 0 1 0 0 1 7 0
1 0 0 0 1 1 0 0 0
$EndEntities
$Nodes
1 4
1 2 0 4
1 0 0 0
2 1 0 0
3 1 1 0
4 0 1 0
$EndNodes
$Elements
2 3
1 1 1 1
1 1 2
1 2 2 2
2 1 2 3
3 1 3 4
$EndElements
"""


def binary41():
    """The unit square with the named line "base" as Gmsh writes it in binary."""
    ints, sizes = (lambda *of: struct.pack(f"{len(of)}i", *of)), (lambda *of: struct.pack(f"{len(of)}Q", *of))
    floats = lambda *of: struct.pack(f"{len(of)}d", *of)
    corners = [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0]
    sections = {
        "PhysicalNames": b'1\n1 7 "base"\n',
        "Entities": sizes(0, 1, 1, 0) + ints(1) + floats(0, 0, 0, 1, 0, 0) + sizes(1) + ints(7) + sizes(0)
        + ints(1) + floats(0, 0, 0, 1, 1, 0) + sizes(1) + ints(8) + sizes(0),
        "Nodes": sizes(1, 4, 1, 4) + ints(2, 1, 0) + sizes(4) + sizes(1, 2, 3, 4) + floats(*corners),
        "Elements": sizes(2, 3, 1, 3) + ints(1, 1, 1) + sizes(1) + sizes(1, 1, 2)
        + ints(2, 1, 2) + sizes(2) + sizes(2, 1, 2, 3, 3, 1, 3, 4),
    }  # fmt: skip
    written = b"".join(b"$%b\n%b\n$End%b\n" % (name.encode(), data, name.encode()) for name, data in sections.items())
    return BINARY41 + written


@pytest.mark.parametrize("content", [GMSH40.replace("1 0 0 0 1 1 0 0 0", "1 0 0 0 1 1 0 1 8 0").encode(), binary41()])
def test_format_4_0_and_the_binary_variant_of_4_1_are_read(tmp_path, content):
    (tmp_path / "body.msh").write_bytes(content)
    mesh = from_file(tmp_path / "body.msh")
    assert mesh.points.tolist() == SQUARE[:, :2].tolist()
    assert measures(mesh.points, mesh.cells).tolist() == [0.5, 0.5]
    assert lines_of(mesh) == {"base": {frozenset([(0.0, 0.0), (1.0, 0.0)])}}


def test_a_node_number_of_format_4_0_below_one_is_no_node_counted_from_the_end(tmp_path):
    text = GMSH40.replace("1 0 0 0 1 1 0 0 0", "1 0 0 0 1 1 0 1 8 0").replace("3 1 3 4\n", "3 1 3 -1\n")
    (tmp_path / "body.msh").write_text(text)
    refused(tmp_path / "body.msh", "an element names node -1: nodes are numbered from 1")


# --- what other programs write ---


def test_points_of_one_plane_up_to_rounding_are_in_it(tmp_path):
    square = SQUARE + np.array([[0, 0, 0], [0, 0, 1e-17], [0, 0, -3e-12], [0, 0, 0]])
    for tilt, fits in ((0.0, True), (1e-6, False)):
        points = square + tilt * square[:, :1] * [0, 0, 1]
        cells = [("line", [[0, 1]]), ("triangle", [[0, 1, 2], [0, 2, 3]])]
        data = {"gmsh:physical": [[1], [9, 9]], "gmsh:geometrical": [[1], [9, 9]]}
        mesh = meshio.Mesh(points, cells, cell_data=data, field_data={"bottom": [1, 1], "body": [9, 2]})
        meshio.write(tmp_path / "flat.msh", mesh, file_format="gmsh22", binary=False)
        if fits:
            assert len(from_file(tmp_path / "flat.msh").points) == 4
        else:
            refused(tmp_path / "flat.msh", "the points do not lie in a plane")


def test_the_command_that_a_refusal_names_writes_a_gmsh_file(tmp_path):
    """The ending .msh alone is that of another format to meshio."""
    meshio.write(tmp_path / "in.vtk", meshio.Mesh(SQUARE, [("triangle", [[0, 1, 2], [0, 2, 3]])]))
    command = [Path(sys.executable).with_name("meshio"), "convert", "-o", "gmsh22", "in.vtk", "out.msh"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, env=environment())
    assert (tmp_path / "out.msh").read_bytes().startswith(b"$MeshFormat")
    refused(tmp_path / "out.msh", "no named lines")
