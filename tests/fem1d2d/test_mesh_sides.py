"""Sides and bodies that files name in other ways: surfaces and sets of nodes, numbers, pieces, lines off the body."""

from itertools import pairwise

import pytest
from mesh_writer import CELLS, LINE, MSH, lines_of, refused

from fem1d2d import MeshError, from_file

pytestmark = pytest.mark.usefixtures("meshes_read_here")

#: A square and a triangle at its right side, both of second order, and a line at the bottom, typed by hand.
NODES = """*NODE
1, 0, 0, 0
2, 1, 0, 0
3, 1, 1, 0
4, 0, 1, 0
5, 2, 0, 0
12, .5, 0, 0
23, 1, .5, 0
34, .5, 1, 0
41, 0, .5, 0
25, 1.5, 0, 0
53, 1.5, .5, 0
"""
LINEAR = """*ELEMENT, TYPE=T2D2
1, 1, 2
*ELEMENT, TYPE={quad}4
7, 1, 2, 3, 4
*ELEMENT, TYPE={triangle}3
9, 2, 5, 3
"""
SECOND = """*ELEMENT, TYPE=T2D3
1, 1, 2, 12
*ELEMENT, TYPE=CPE8R
7, 1, 2, 3, 4,
12, 23, 34, 41
*ELEMENT, TYPE=CPE6
9, 2, 5, 3, 25, 53, 23
"""
SQUARE = "*ELSET, ELSET=Block\n7\n"
CORNERS = {"1": (0.0, 0.0), "2": (1.0, 0.0), "3": (1.0, 1.0), "4": (0.0, 1.0), "5": (2.0, 0.0)}


def around(*corners, halved):
    """The edges between corners, in two halves where elements are of second order."""
    found = set()
    for a, b in pairwise(corners):
        ends = CORNERS[a], CORNERS[b]
        middle = tuple((x + y) / 2 for x, y in zip(*ends, strict=True))
        found |= {frozenset([end, middle]) for end in ends} if halved else {frozenset(ends)}
    return found


SURFACES = {
    "a set": ("*SURFACE, TYPE=ELEMENT, NAME=top\nBLOCK, S3\n", "34"),
    "a number": ("*Surface, name=top, type=element\n7, s3\n", "34"),
    "two faces": ("*SURFACE, NAME=top\nBlock, S3\n 7 , S4\n", "341"),
    "a triangle": ("*SURFACE, NAME=top\n9, S1\n9, S2\n", "253"),
    "edges of shells": ("*SURFACE, NAME=top, TYPE=ELEMENT\nBlock, E3\n", "34"),
    "two elements": ("*SURFACE, NAME=top, TYPE=ELEMENT\nBlock, S1\n9, S1\n", "125"),
    "a line": ("*SURFACE, NAME=top, TYPE=ELEMENT\n1, SPOS\n", "12"),
    "nodes": ("*NSET, NSET=top\n3, 4, 34\n", "34"),
    "nodes of corners": ("*NSET, NSET=top\n5, 2, 25, 1, 12\n", "125"),
}


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("halved", [False, True])
@pytest.mark.parametrize(("quad", "triangle"), [("CPE", "CPE"), ("S", "S")])
def test_a_surface_by_faces_and_a_set_of_nodes_are_sides(tmp_path, name, halved, quad, triangle):
    words, corners = SURFACES[name]
    cells = SECOND if halved else LINEAR.format(quad=quad, triangle=triangle)
    nodes = NODES if halved else NODES.split("12, .5")[0]
    words = words if halved else words.replace(", 34", "").replace(", 25, 1, 12", ", 1")
    (tmp_path / "body.inp").write_text(nodes + cells + SQUARE + words)
    assert lines_of(from_file(tmp_path / "body.inp")) == {"top": around(*corners, halved=halved)}


@pytest.mark.parametrize(
    "words",
    [
        "*SURFACE, TYPE=NODE, NAME=top\nBlock\n",
        "*SURFACE, NAME=top\nBlock, SPOS\n",  # a face of the plate
        "*NSET, NSET=top\n1\n",
    ],
)
def test_what_has_no_edge_is_no_side(tmp_path, words):
    (tmp_path / "body.inp").write_text(
        NODES.split("12, .5")[0] + LINEAR.format(quad="CPE", triangle="CPE") + SQUARE + words
    )
    refused(
        tmp_path / "body.inp", "no named lines; give the sides physical names, in Abaqus a \\*SURFACE or an \\*NSET"
    )


@pytest.mark.parametrize(
    ("lists", "why"),
    [
        ("Block, S3\nBlok, S3", "surface top lists Blok, which is no element set"),
        ("-1, S3", "surface top lists -1, which is no element set"),
        ("1, S3\n8, S3", "surface top lists an element that it does not have"),
        ("Block, S3\n9, S4", "surface top names face 4 of an element with 3"),
    ],
)
def test_a_surface_that_lists_what_the_file_lacks_is_refused_and_loses_no_edge(tmp_path, lists, why):
    (tmp_path / "body.inp").write_text(
        NODES.split("12, .5")[0] + LINEAR.format(quad="CPE", triangle="CPE") + SQUARE + f"*SURFACE, NAME=top\n{lists}\n"
    )
    refused(tmp_path / "body.inp", why)


def test_a_set_with_a_node_inside_is_no_side(tmp_path):
    block = "*ELEMENT, TYPE=CPS3\n1, 1, 2, 5\n2, 2, 3, 5\n3, 3, 4, 5\n4, 4, 1, 5\n"
    nodes = NODES.split("5, 2")[0] + "5, .5, .5, 0\n"
    (tmp_path / "body.inp").write_text(f"{nodes}{block}*NSET, NSET=all\n1, 2, 3, 4, 5\n*NSET, NSET=left\n1, 4\n")
    assert lines_of(from_file(tmp_path / "body.inp")) == {"left": {frozenset([(0.0, 0.0), (0.0, 1.0)])}}


# --- numbers in place of names ---


def gmsh(path, elements, names=""):
    text = MSH.replace('2\n1 1 "bottom"\n2 9 "body"\n', names or "0\n")
    path.write_text(text.format(count=len(elements), elements="\n".join(f"{i} {e}" for i, e in enumerate(elements, 1))))
    return path


def test_groups_without_names_have_their_numbers_and_without_groups_those_of_the_geometry(tmp_path):
    bottom = {frozenset([(0.0, 0.0), (1.0, 0.0)])}
    mesh = from_file(gmsh(tmp_path / "body.msh", ["1 2 5 77 1 2", *CELLS]))
    assert (lines_of(mesh), list(mesh.surfaces)) == ({"5": bottom}, ["9"])
    mesh = from_file(gmsh(tmp_path / "body.msh", [f"{kind} 2 0 {tag} {of}" for kind, tag, of in NONE]))
    assert (lines_of(mesh), sorted(mesh.surfaces)) == ({"77": bottom}, ["8", "9"])
    mesh = from_file(gmsh(tmp_path / "body.msh", [LINE, "1 2 5 1 2 3", *CELLS], '1\n1 1 "bottom"\n'))
    assert list(lines_of(mesh)) == ["bottom", "5"]


NONE = [("1", 77, "1 2"), ("2", 8, "1 2 3"), ("2", 9, "1 3 4")]

# --- lines that are no edges of the body ---


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("1 3", "lies on no outer edge from (0, 0) to (1, 1); the nearest one runs from (0, 0) to (1, 0)"),
        ("2 4", "lies on no outer edge from (1, 0) to (0, 1); "),
    ],
)
def test_a_line_that_is_no_edge_of_the_outline_is_no_side_and_is_told_with_the_nearest_edge(tmp_path, line, said):
    text = MSH.replace("2\n1 1", '3\n1 2 "mid"\n1 1')
    elements = [LINE, f"1 2 2 2 {line}", *CELLS]
    (tmp_path / "body.msh").write_text(
        text.format(count=4, elements="\n".join(f"{i} {e}" for i, e in enumerate(elements, 1)))
    )
    mesh = from_file(tmp_path / "body.msh")
    assert list(mesh.sides) == ["bottom"]
    assert mesh.lacks("mid").startswith(f"the line 'mid' of the file {said}")
    assert mesh.lacks("left") == "its sides: bottom"


# --- pieces of a surface ---


def test_the_pieces_of_a_surface_are_groups(tmp_path):
    apart = "*NODE\n1, 0, 0\n2, 1, 0\n3, 0, 1\n4, 5, 0\n5, 6, 0\n6, 5, 1\n"
    cells = "*ELEMENT, TYPE=CPS3, ELSET=all\n1, 1, 2, 3\n2, 4, 5, 6\n*NSET, NSET=base\n1, 2, 4, 5\n"
    (tmp_path / "both.inp").write_text(apart + cells)
    for group, x in (("all.1", 0), ("all.2", 5)):
        mesh = from_file(tmp_path / "both.inp", group=[group])
        assert lines_of(mesh) == {"base": {frozenset([(x, 0.0), (x + 1.0, 0.0)])}}
    with pytest.raises(MeshError, match=r"no surface 'all.3'; needed names .* in it: all, all\.1, all\.2$"):
        from_file(tmp_path / "both.inp", group=["all.3"])
