"""Cells of files that are no linear triangles: quadrilaterals and cells of second order become these."""

import meshio
import numpy as np
import pytest
from mesh_writer import refused

from fem1d2d import Material, Mesh, from_file, stiffness
from fem1d2d.mesh import crossed, measures

NX, NY = 3, 2


pytestmark = pytest.mark.usefixtures("meshes_read_here")


def grid(order):
    """Nodes of a bent grid of 3 x 2 cells with ``order`` steps along each edge, by their places."""
    s, t = np.meshgrid(np.arange(order * NX + 1), np.arange(order * NY + 1), indexing="ij")
    s, t = s / (order * NX), t / (order * NY)
    x, y = 3 * s + 0.3 * t, 2 * t + 0.4 * s * (1 - s) + 0.9 * s * t
    number = np.arange(s.size).reshape(s.shape)
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(s.size)]), number


def cells_of(kind, number):
    """Cells of a kind in the order of nodes that VTK, meshio and Abaqus have, and the edges of the bottom."""
    found, step = [], 1 if kind == "quad" else 2
    for i in range(NX):
        for j in range(NY):
            a, b = step * i, step * j
            corner = [number[a, b], number[a + step, b], number[a + step, b + step], number[a, b + step]]
            if kind == "quad":
                found.append(corner)
                continue
            middle = [number[a + 1, b], number[a + 2, b + 1], number[a + 1, b + 2], number[a, b + 1]]
            centre = number[a + 1, b + 1]
            if kind == "triangle6":
                found.append([corner[0], corner[1], corner[2], middle[0], middle[1], centre])
                found.append([corner[0], corner[2], corner[3], centre, middle[2], middle[3]])
            else:
                found.append([*corner, *middle, centre][: 8 if kind == "quad8" else 9])
    bottom = number[:, 0]
    edges = [bottom[i : i + step + 1] for i in range(0, step * NX, step)]
    return np.array(found), np.array([edge[[0, -1, *range(1, step)]] for edge in edges])


KINDS = {"quad": 4, "triangle6": 4, "quad8": 16, "quad9": 16}


def gmsh(path, kind, version="2.2"):
    points, number = grid(1 if kind == "quad" else 2)
    cells, edges = cells_of(kind, number)
    if kind == "quad8":  # its centre is no node
        used, cells = np.unique(cells, return_inverse=True)
        inverse = np.full(len(points), -1)
        inverse[used] = np.arange(len(used))
        points, cells, edges = points[used], cells.reshape(-1, 8), inverse[edges]
    line = "line" if kind == "quad" else "line3"
    blocks = [(line, edges), (kind, cells)]
    tags = [np.full(len(edges), 1), np.full(len(cells), 2)]
    names = {"bottom": np.array([1, 1]), "body": np.array([2, 2])}
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.write(
        path,
        meshio.Mesh(points, blocks, cell_data=data, field_data=names),
        f"gmsh{version.replace('.', '')}",
        binary=False,
    )
    return points, cells


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_cell_becomes_triangles_that_fill_it(kind, tmp_path):
    points, cells = gmsh(tmp_path / "body.msh", kind)
    mesh = from_file(tmp_path / "body.msh")
    assert len(mesh.cells) == KINDS[kind] * len(cells)
    boundary = measures(mesh.points, mesh.cells).sum()
    x, y = mesh.points[mesh.boundary].transpose(2, 0, 1)
    outline = float((x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]).sum()) / 2
    assert boundary == pytest.approx(outline, rel=1e-12)
    count = NX if kind == "quad" else 2 * NX
    assert len(mesh.sides["bottom"]) == count
    assert mesh.surfaces["body"].tolist() == list(range(len(mesh.cells)))
    words = {"quad": "6 quadrilaterals", "triangle6": "12 triangles of second order"}
    assert mesh.cut == words.get(kind, "6 quadrilaterals of second order")
    given = {tuple(row) for row in points[:, :2].tolist()}
    assert given <= {tuple(row) for row in mesh.points.tolist()}


def crossing(a, b, c, d):
    """Where two diagonals meet, from two equations of two lines."""
    s, _ = np.linalg.solve(np.column_stack([c - a, b - d])[:2], (b - a)[:2])
    return a + s * (c - a)


def test_quadrilaterals_are_those_that_are_cut_by_hand(tmp_path):
    """The same cells, points and stiffness, with the middle where the diagonals cross."""
    points, cells = gmsh(tmp_path / "body.msh", "quad")
    mesh = from_file(tmp_path / "body.msh")
    middle = np.array([crossing(*points[four]) for four in cells])
    assert np.abs(middle - points[cells].mean(axis=1)).max() > 0.02
    number = len(points) + np.arange(len(cells))
    by_hand = [
        [a, b, m] for four, m in zip(cells, number, strict=True) for a, b in zip(four, np.roll(four, -1), strict=True)
    ]
    hand = Mesh(points=np.concatenate([points, middle])[:, :2], cells=np.array(by_hand), sides={})
    assert crossed(mesh)
    assert mesh.points == pytest.approx(hand.points, abs=1e-14)
    assert mesh.cells.tolist() == hand.cells.tolist()
    law = Material(lame_lambda=2.0, lame_mu=1.0)
    assert stiffness(mesh, law).toarray() == pytest.approx(stiffness(hand, law).toarray(), abs=1e-12)


@pytest.mark.parametrize("kind", ["quad", "quad8", "quad9"])
def test_four_triangles_of_a_quadrilateral_meet_on_both_diagonals(kind, tmp_path):
    gmsh(tmp_path / "body.msh", kind)
    mesh = from_file(tmp_path / "body.msh")
    for centre, corners in zip(mesh.points[mesh.centres], mesh.points[mesh.quadrilaterals[1]], strict=True):
        for i in (0, 1):
            u, v = corners[i] - centre, corners[i + 2] - centre
            assert abs(u[0] * v[1] - u[1] * v[0]) < 1e-14
            assert u @ v < 0


@pytest.mark.parametrize(
    ("corner", "at"),
    [
        ((1.0, 0.6), "crossing"),  # moved, and still far from the edges
        ((0.53, 0.53), "mean"),  # the diagonals cross near it
        ((0.4, 0.4), "mean"),  # concave: they cross outside
    ],
)
def test_a_quadrilateral_that_is_nearly_a_triangle_or_concave_is_cut_from_the_mean_of_its_corners(corner, at, tmp_path):
    points = np.array([[0, 0, 0], [1, 0, 0], [*corner, 0], [0, 1, 0]], dtype=float)
    blocks = [("line", np.array([[0, 1]])), ("quad", np.array([[0, 1, 2, 3]]))]
    tags = [np.array([1]), np.array([2])]
    names = {"bottom": np.array([1, 1]), "body": np.array([2, 2])}
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.write(
        tmp_path / "one.msh", meshio.Mesh(points, blocks, cell_data=data, field_data=names), "gmsh22", binary=False
    )
    expected = crossing(*points) if at == "crossing" else points.mean(axis=0)
    mesh = from_file(tmp_path / "one.msh")
    assert mesh.points[mesh.centres[0]] == pytest.approx(expected[:2], abs=1e-15)
    assert measures(mesh.points, mesh.cells).min() > 0


def test_the_middle_of_a_quadrilateral_without_a_node_there_is_that_of_its_shape_functions(tmp_path):
    """A serendipity cell is exact for quadratic maps: its centre is the image of the centre."""
    gmsh(tmp_path / "eight.msh", "quad8")
    gmsh(tmp_path / "nine.msh", "quad9")
    eight, nine = (from_file(tmp_path / f"{name}.msh") for name in ("eight", "nine"))
    order = lambda mesh: mesh.points[np.lexsort(mesh.points.round(9).T)]
    assert order(eight) == pytest.approx(order(nine), abs=1e-12)


def test_cells_of_several_kinds_in_one_file_are_one_body(tmp_path):
    points = np.array([[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 0.5]], dtype=float)
    blocks = [("line", [[0, 1], [1, 2]]), ("triangle", [[1, 2, 5], [1, 5, 4]]), ("quad", [[0, 1, 4, 3]])]
    tags = [np.full(len(rows), 1 + (kind != "line")) for kind, rows in blocks]
    file = meshio.Mesh(
        np.column_stack([points, np.zeros(6)]),
        [(kind, np.array(rows)) for kind, rows in blocks],
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={"bottom": np.array([1, 1]), "body": np.array([2, 2])},
    )
    meshio.write(tmp_path / "both.msh", file, "gmsh22", binary=False)
    mesh = from_file(tmp_path / "both.msh")
    assert (len(mesh.cells), len(mesh.points)) == (6, 7)
    assert sorted(mesh.surfaces["body"].tolist()) == list(range(6))
    assert mesh.cut == "1 quadrilaterals"


# --- Abaqus -----------------------------------------------------------------------------------------------------------

INP = """*NODE
1, 0., 0.
2, 1., 0.
3, 1., 1.
4, 0., 1.
5, .5, 0.
6, 1., .5
7, .5, 1.
8, 0., .5
*ELEMENT, TYPE={of}, ELSET=body
1, {nodes}
*ELEMENT, TYPE={line}, ELSET=bottom
2, {edge}
"""
TYPES = {
    "CPE4": "strain",
    "CPE4R": "strain",
    "CPS4I": "stress",
    "CPE8R": "strain",
    "CPS8": "stress",
    "S4R": "",
    "S8R": "",
}


@pytest.mark.parametrize("of", TYPES)
def test_plane_elements_of_abaqus_are_read_and_those_of_the_other_plane_are_refused(of, tmp_path):
    many = "8" in of
    path = tmp_path / "body.inp"
    nodes, edge = ("1, 2, 3, 4, 5, 6, 7, 8", "1, 2, 5") if many else ("1, 2, 3, 4", "1, 2")
    path.write_text(INP.format(of=of, nodes=nodes, line="T2D3" if many else "T2D2", edge=edge))
    for plane in ("strain", "stress", None):
        if plane is not None and TYPES[of] not in ("", plane):
            with pytest.raises(
                ValueError, match=rf"elements {of} are of plane {TYPES[of]}: needed those of plane {plane}"
            ):
                from_file(path, plane=plane)
        else:
            assert len(from_file(path, plane=plane).cells) == (16 if many else 4)


def test_triangles_of_second_order_and_of_both_planes_are_read_and_axisymmetric_ones_refused(tmp_path):
    path = tmp_path / "body.inp"
    text = INP.format(of="CPS6M", nodes="1, 2, 3, 5, 6, 8", line="T2D3", edge="1, 2, 5")
    path.write_text(text.replace("8, 0., .5", "8, .5, .5"))
    assert len(from_file(path, plane="stress").cells) == 4
    path.write_text(INP.format(of="CAX4", nodes="1, 2, 3, 4", line="T2D2", edge="1, 2"))
    refused(path, "its elements CAX4 are axisymmetric: needed those of plane strain or stress")
