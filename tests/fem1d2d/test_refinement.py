"""Which refinements are nested, and what follows: the finer space contains the coarser one, constants move one way."""

from fractions import Fraction

import fem_oracle
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import AT_NIGHT, fewer, held_bodies, lines, materials, numbers, plane_meshes, powers_of_two

from fem1d2d import (
    Condensation,
    Mesh,
    bar,
    element,
    gram,
    interval,
    largest,
    plane_strain,
    rectangle,
    stiffness,
    supports,
)

UNIT = (Fraction(0), Fraction(1))
sizes = numbers(Fraction(1, 4), 3, 12)


# --- nested meshes ----------------------------------------------------------------------------------------------------


def red(mesh):
    """Uniform refinement: every cell is cut at the middles of its edges, in 2, or in 4 similar triangles.

    Returns the mesh and the matrix that evaluates coarse functions at fine nodes.
    """
    n, d = len(mesh.points), mesh.dimension
    pairs = sorted({tuple(sorted((a, b))) for cell in mesh.cells.tolist() for a in cell for b in cell if a != b})
    middle = {pair: n + i for i, pair in enumerate(pairs)} | {(a, a): a for a in range(n)}
    at = lambda a, b: middle[min(a, b), max(a, b)]
    evaluate = np.zeros((n + len(pairs), n), dtype=int)
    evaluate[np.arange(n), np.arange(n)] = 2
    for (a, b), i in middle.items():
        if a != b:
            evaluate[i, [a, b]] = 1
    corners = [[(i, i) if i == j else (min(i, j), max(i, j)) for j in range(d + 1)] for i in range(d + 1)]
    parts = [*corners, [(0, 1), (1, 2), (0, 2)]] if d == 2 else corners
    cut = lambda facet, parts: [[at(facet[i], facet[j]) for i, j in part] for part in parts]
    cells = [part for cell in mesh.cells.tolist() for part in cut(cell, parts)]
    halves = [[(0, 0), (0, 1)], [(0, 1), (1, 1)]] if d == 2 else [[(0, 0)]]
    sides = {
        s: np.array([part for f in facets.tolist() for part in cut(f, halves)]) for s, facets in mesh.sides.items()
    }
    return Mesh(points=evaluate @ mesh.points / 2, cells=np.array(cells), sides=sides), evaluate * Fraction(1, 2)


def barycentric(points, x):
    """Barycentric coordinates of x in a simplex."""
    gradients, _ = fem_oracle.hats(points)
    first = np.arange(len(points)) == 0
    return first + gradients @ (x - points[0])


def evaluation(coarse, fine):
    """The matrix that evaluates the coarse functions at the fine nodes."""
    matrix = fem_oracle.zeros(len(fine.points), len(coarse.points))
    for row, x in enumerate(fine.points):
        for cell in coarse.cells:
            weights = barycentric(coarse.points[cell], x)
            if min(weights) >= 0:
                matrix[row, cell] = weights
                break
    assert (matrix.sum(axis=1) == 1).all()
    return matrix


def is_nested(coarse, fine):
    """Whether each fine cell lies in one coarse cell."""
    inside = lambda cell, part: all(min(barycentric(coarse.points[cell], x)) >= 0 for x in fine.points[part])
    return all(any(inside(cell, part) for cell in coarse.cells) for part in fine.cells)


def forms(mesh):
    """Laplace and mass matrices of scalar functions, in rationals."""
    return [fem_oracle.assemble(mesh, matrix(mesh), 1) for matrix in (element.laplace, element.mass)]


def contains(fine, coarse, evaluate):
    """Whether coarse functions, evaluated at fine nodes, keep their energy and their L2 norm."""
    pairs = zip(forms(coarse), forms(fine), strict=True)
    return all(np.array_equal(evaluate.T @ b @ evaluate, a) for a, b in pairs)


# --- what is nested ---------------------------------------------------------------------------------------------------


@given(numbers(-2, 2, 12), sizes, st.integers(1, 4), st.integers(1, 4))
def test_an_interval_contains_the_functions_of_an_interval_with_a_divisor_of_its_cells(a, length, n, factor):
    coarse, fine = interval((a, a + length), n), interval((a, a + length), factor * n)
    assert is_nested(coarse, fine)
    assert contains(fine, coarse, evaluation(coarse, fine))


def test_intervals_whose_cell_counts_do_not_divide_are_not_nested():
    coarse, fine = interval(UNIT, 2), interval(UNIT, 3)
    assert not is_nested(coarse, fine)
    assert not contains(fine, coarse, evaluation(coarse, fine))


@pytest.mark.parametrize(
    ("cells", "factor"),
    [
        *[((1, 1), 2), ((1, 1), 3), ((1, 1), 4), ((2, 1), 3), ((1, 2), 2), ((2, 2), 2)],
        *[((2, 1), 2), ((2, 1), 4), ((1, 2), 3), ((1, 2), 4), ((2, 2), 3), ((2, 2), 4)] * AT_NIGHT,
    ],
)
def test_alternating_diagonals_are_nested_when_both_directions_are_divided_by_the_same_number(cells, factor):
    """The small cells along the diagonal of a cell all have one parity, and it gives them that diagonal's direction."""
    coarse = rectangle(UNIT, (Fraction(0), Fraction(2, 3)), cells)
    fine = rectangle(UNIT, (Fraction(0), Fraction(2, 3)), (factor * cells[0], factor * cells[1]))
    assert is_nested(coarse, fine)
    assert contains(fine, coarse, evaluation(coarse, fine))


@pytest.mark.parametrize("factors", [(1, 2), (2, 1), (2, 3), (2, 4), (3, 1)])
@pytest.mark.parametrize("cells", [(1, 1), (2, 1), (2, 2)])
def test_alternating_diagonals_are_not_nested_when_the_directions_are_divided_unequally(cells, factors):
    """A diagonal of a cell then has the slope of no edge of the finer mesh."""
    coarse = rectangle(UNIT, UNIT, cells)
    fine = rectangle(UNIT, UNIT, (factors[0] * cells[0], factors[1] * cells[1]))
    assert not is_nested(coarse, fine)
    assert not contains(fine, coarse, evaluation(coarse, fine))


@pytest.mark.parametrize("counts", [((2, 2), (3, 3)), ((2, 3), (3, 3)), ((1, 2), (2, 2))])
def test_rectangles_whose_cell_counts_are_no_common_multiple_are_not_nested(counts):
    coarse, fine = (rectangle(UNIT, UNIT, cells) for cells in counts)
    assert not is_nested(coarse, fine)
    assert not contains(fine, coarse, evaluation(coarse, fine))


@fewer(2)
@given(st.one_of(lines(most=3), plane_meshes()))
def test_cutting_every_cell_at_the_middles_of_its_edges_is_nested(mesh):
    fine, evaluate = red(mesh)
    assert np.array_equal(evaluate, evaluation(mesh, fine))
    assert contains(fine, mesh, evaluate)
    assert sum(map(len, fine.sides.values())) == mesh.dimension * sum(map(len, mesh.sides.values()))


@given(st.integers(-8, 8), powers_of_two(), st.integers(1, 9), st.integers(1, 9))
def test_halving_in_floats_keeps_every_coarse_node_to_the_bit(a, width, nx, ny):
    x, y = (float(a), float(a + width)), (0.0, 0.3)
    coarse, fine = rectangle(x, y, (nx, ny)), rectangle(x, y, (2 * nx, 2 * ny))
    kept = fine.points.reshape(2 * nx + 1, 2 * ny + 1, 2)[::2, ::2]
    assert np.array_equal(kept, coarse.points.reshape(nx + 1, ny + 1, 2))


# --- what follows -----------------------------------------------------------------------------------------------------


@fewer(10)
@given(plane_meshes(), materials())
def test_interpolation_into_a_nested_mesh_keeps_the_elastic_energy(mesh, material):
    fine, evaluate = red(mesh)
    both = np.kron(evaluate, np.eye(2, dtype=int))
    coarse_A, fine_A = (
        fem_oracle.assemble(m, element.stiffness(m, material).reshape(-1, 6, 6), 2) for m in (mesh, fine)
    )
    assert np.array_equal(both.T @ fine_A @ both, coarse_A)


def extremes(mesh, material, free, length=1.0):
    """m and M of a held body."""
    A, H = (matrix[free][:, free].toarray() for matrix in (stiffness(mesh, material), gram(mesh, length)))
    return 1 / largest(H, A).value, largest(A, H).value


@fewer(5)
@given(held_bodies(most=3), st.sampled_from([0.5, 1.0, 2.0]))
def test_m_falls_and_M_rises_when_a_held_body_is_cut_finer(body, length):
    mesh, material, free = body
    fine, _ = red(mesh)
    held = np.ones(mesh.points.shape, dtype=bool)
    held.ravel()[free] = False
    sides = [s for s, facets in mesh.sides.items() if held[facets].all()]
    known = supports(fine, dict.fromkeys(sides, (0.0, 0.0))).held.ravel()
    m, M = extremes(mesh, material, free, length)
    finer_m, finer_M = extremes(fine, material, np.flatnonzero(~known), length)
    assert finer_m < m
    assert finer_M > M
    assert finer_M < 2 * max(material.lame_mu, material.lame_mu + material.lame_lambda)


@pytest.mark.parametrize("cells", [(1, 1), (2, 1), (1, 2)])
@pytest.mark.parametrize("poisson", [-0.5, 0.3, 0.45])
def test_m_falls_and_M_rises_when_a_rectangle_is_halved(cells, poisson):
    levels = []
    for halvings in range(3):
        mesh = rectangle((0.0, 2.0), (0.0, 1.0), (cells[0] * 2**halvings, cells[1] * 2**halvings))
        known = supports(mesh, {"bottom": [0.0, 0.0]}).held.ravel()
        levels.append(extremes(mesh, plane_strain(1.0, poisson), np.flatnonzero(~known)))
    m, M = np.array(levels).T
    assert (np.diff(m) < 0).all()
    assert (np.diff(M) > 0).all()


@pytest.mark.parametrize("n", [1, 3, 5])
def test_m_falls_and_M_rises_when_a_bar_is_halved(n):
    levels = [extremes(interval((0.0, 2.0), n * 2**k), bar(3.0), np.arange(1, n * 2**k + 1)) for k in range(4)]
    m, M = np.array(levels).T
    assert (np.diff(m) < 0).all()
    assert (np.diff(M) > 0).all()


@fewer(5)
@given(plane_meshes(), materials())
def test_the_least_energy_for_given_interface_values_falls_on_a_nested_mesh(mesh, material):
    """phi' S phi is a minimum over a space that grows; phi is linear between the coarse nodes of the top."""
    fine, evaluate = red(mesh)
    top, finer_top = (np.unique(m.sides["top"]) for m in (mesh, fine))
    S, finer_S = (energy_of(m, material, nodes) for m, nodes in [(mesh, top), (fine, finer_top)])
    E = np.kron(evaluate[np.ix_(finer_top, top)].astype(float), np.eye(2))
    gain = np.linalg.eigvalsh(S - E.T @ finer_S @ E)
    assert gain.min() >= -1e-13 * np.trace(S)
    assert gain.max() > 1e-6 * np.trace(S)


def energy_of(mesh, material, nodes):
    """Schur complement on nodes of a body held at its bottom, where the interface leaves it free."""
    held = np.unique(mesh.sides["bottom"])
    free = (2 * np.setdiff1d(np.arange(len(mesh.points)), held)[:, None] + np.arange(2)).ravel()
    interface = np.searchsorted(free, (2 * nodes[:, None] + np.arange(2)).ravel())
    return Condensation(stiffness(mesh, material)[free][:, free].tocsc(), interface).schur
