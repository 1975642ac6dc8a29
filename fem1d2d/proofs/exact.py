"""Stiffness and Gram matrices of the exact mesh and moduli: element matrices as rationals, rounded once.

A rational mesh and rational moduli give rational element matrices.  Cells that are translates of each other share
them, so that few are computed where a mesh is regular.  Each entry is rounded to the nearest double, and the rounding
of the sums over cells is bounded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem1d2d import element
from fem1d2d.assembly import assemble, unknowns
from fem1d2d.material import Material
from fem1d2d.mesh import Cells, Ints
from fem1d2d.outline import whole_numbers
from fem1d2d.proofs.enclosed import Enclosed, gamma, nearest


@dataclass(frozen=True, kw_only=True, eq=False)
class Shapes(Cells):
    """The cells of a mesh up to translations, as cells that share no node.

    Attributes
    ----------
    points : array of Fraction, shape (s k, d)
    cells : int array, shape (s, k)
    of_cell : int array, shape (c,)
        The shape of each cell of the mesh.
    """

    of_cell: Ints

    @classmethod
    def of(cls, points: NDArray[Any], cells: Ints, kinds: Ints | None = None) -> Shapes:
        """The shapes of cells, shape (c, k), with exact nodes: ``points`` are Fractions, shape (n, d).

        Cells of different ``kinds``, shape (c,), as those of different materials, share no shape.

        Examples
        --------
        >>> from fem1d2d import rectangle
        >>> mesh = rectangle((Fraction(0), Fraction(2)), (Fraction(0), Fraction(1, 3)), (6, 4))
        >>> len(mesh.cells), len(Shapes.of(mesh.points, mesh.cells).cells)
        (48, 4)
        """
        whole, unit = whole_numbers(points)
        corners = whole[cells]
        known: dict[tuple[Any, ...], int] = {}
        spokes = (corners[:, 1:] - corners[:, :1]).reshape(len(corners), -1)
        kinds = np.zeros(len(cells), dtype=np.int64) if kinds is None else kinds
        rows = zip(kinds.tolist(), spokes.tolist(), strict=True)
        of_cell = [known.setdefault((kind, *row), len(known)) for kind, row in rows]
        k, d = corners.shape[1:]
        first = [[Fraction(0)] * d + [Fraction(value, unit) for value in row] for _, *row in known]
        return cls(
            points=np.array(first, dtype=object).reshape(-1, d),
            cells=np.arange(k * len(known)).reshape(-1, k),
            of_cell=np.array(of_cell, dtype=np.int64),
        )


def fractions(values: NDArray[Any]) -> NDArray[Any]:
    """Doubles as the rationals that they are; rationals as they are."""
    if values.dtype == object:
        return values
    exact = np.empty(values.shape, dtype=object)
    exact.ravel()[:] = [Fraction(value) for value in values.ravel().tolist()]
    return exact


def stiffness(mesh: Cells, material: Material, shapes: Shapes | None = None) -> Enclosed:
    """As :func:`fem1d2d.assembly.stiffness`, with its radius.

    Parameters
    ----------
    mesh : Mesh
    material : Material
        Of rationals; if one for each cell, then ``shapes`` must tell them apart.
    shapes : Shapes, optional
        The shapes of the exact mesh, if the coordinates of this one are rounded; otherwise its doubles are exact.

    Raises
    ------
    TypeError
        The element computes in doubles.
    ValueError
        Entries that are not of ordinary size.
    """
    if shapes is None:
        shapes = Shapes.of(fractions(mesh.points), mesh.cells, material.kinds)
    material = material.on(np.unique(shapes.of_cell, return_index=True)[1])
    return _assembled(mesh, shapes, unknowns(mesh), lambda cells: element.stiffness(cells, material))


def gram(mesh: Cells, length: Fraction = Fraction(1), shapes: Shapes | None = None) -> Enclosed:
    """As :func:`fem1d2d.assembly.gram` for a rational L, with its radius; else as :func:`stiffness`."""
    local = lambda cells: element.laplace(cells) + element.mass(cells) / length**2
    scalar = _assembled(mesh, shapes, mesh.cells, local)
    each = lambda matrix: sp.kron(matrix, sp.eye_array(mesh.dimension), format="csc")
    return Enclosed(middle=each(scalar.middle), radius=each(scalar.radius))


def _assembled(mesh: Cells, shapes: Shapes | None, nodes: Ints, local: Callable[[Cells], NDArray[Any]]) -> Enclosed:
    """The sum of element matrices of the unknowns ``nodes``, shape (c, k), and a bound of its rounding."""
    shapes = Shapes.of(fractions(mesh.points), mesh.cells) if shapes is None else shapes
    k, size = nodes.shape[1], len(mesh.points) * nodes.shape[1] // mesh.cells.shape[1]
    entries = nearest(local(shapes)).reshape(-1, k, k)[shapes.of_cell]
    each = (entries, np.abs(entries), np.ones_like(entries))
    middle, moduli, terms = (assemble(nodes, values, size) for values in each)
    middle = (sp.tril(middle) + sp.tril(middle, -1).T).tocsc()
    # one rounding of each entry, and one of each sum; of both triangles of the middle either may be meant
    return Enclosed(middle=middle, radius=2 * gamma(float(terms.max()) + 4) * moduli)
