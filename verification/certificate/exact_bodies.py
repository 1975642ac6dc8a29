"""The discrete problem of the exact rationals of a problem: matrices with radii, and the join of the grids.

The topology (which nodes lie on which side, and which unknowns they hold) is taken from the bodies in doubles.  The
numbers are not: ends, moduli, length and radius are the rationals of the problem, the nodes of a rectangle divide its
exact sides, and the nodes of a mesh file are the doubles read from it.  Along a named line lengths are irrational: its
positions are the doubles found, and its normals the rational unit vectors nearest to those found.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem1d2d import interval, rectangle_points, trapezoid
from fem1d2d.element import lacks
from fem1d2d.mesh import Bools
from fem1d2d.proofs import exact
from fem1d2d.proofs.enclosed import UNIT, Enclosed, gamma, nearest
from fem1d2d.proofs.exact import Shapes
from verification.interface.body import Body, in_frames, material_of
from verification.interface.interface import Grid
from verification.interface.join import joined
from verification.interface.joining import transferred
from verification.interface.pair import ContactPair
from verification.problem.specification import Problem
from verification.problem.specs import BodySpec
from verification.registry import LAWS


class NotExact(ValueError):
    """Nothing can be proved: data that are not rational, or not of ordinary size."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ExactBody:
    """A body whose stiffness and Gram matrices, on its unknowns, are known up to a radius.

    ``body`` is the same in doubles, with its unknowns, its interface and its order of elimination; ``x`` are the
    positions of the contact nodes.
    """

    body: Body
    stiffness: Enclosed
    gram: Enclosed
    x: NDArray[Any]

    @classmethod
    def of(cls, problem: Problem, body: Body) -> ExactBody:
        """Return the body of a problem.

        Raises
        ------
        NotExact
            An element that computes in doubles, or entries that are not of ordinary size.
        """
        if problem.several:
            raise NotExact("the contacts are tables [[contact]]")
        if why := lacks(body.mesh, "proofs"):
            raise NotExact(f"{body.name}: {why}")
        spec: BodySpec = getattr(problem, body.name)
        points, mesh = exact_points(spec, body), body.mesh
        try:
            material = material_of(spec, Fraction, mesh)
            shapes = Shapes.of(points, mesh.cells, material.kinds)
            stiffness = exact.stiffness(mesh, material, shapes)
            gram = exact.gram(mesh, problem.length, shapes)
        except (TypeError, ValueError) as error:
            raise NotExact(f"{body.name}: {error}") from None
        free, x = body.positions, points[body.nodes, 0]
        matrices = (_in_frames(matrix.block(free, free), body) for matrix in (stiffness, gram))
        return cls(body=body, stiffness=next(matrices), gram=next(matrices), x=x)


def _in_frames(matrix: Enclosed, body: Body) -> Enclosed:
    """Return ``Q X Q'`` of the exact normals of a body, see :func:`verification.interface.body.in_frames`."""
    if body.turned is None or body.normals is None:
        return matrix
    exact_normals(body.normals)  # entries of Q are off by at most 4 units
    middle, pattern = in_frames(matrix.middle, body.turned), (body.turned != 0).astype(float)
    # two products of sums of two terms, an average, and Q itself; pattern has more than |Q|
    radius = pattern @ (matrix.radius + 2 * gamma(24) * abs(matrix.middle)) @ pattern.T
    return Enclosed(middle=middle, radius=(radius * (1 + 2 * gamma(16))).tocsc())


def exact_normals(normals: NDArray[Any] | None) -> NDArray[Any] | None:
    """Return rational unit vectors within 4 units of rounding of given ones; None for None.

    Raises
    ------
    NotExact
        Vectors whose length is not 1 to rounding.

    Examples
    --------
    >>> x, y = exact_normals(np.array([[0.6, 0.8]]))[0]
    >>> x * x + y * y, abs(x - Fraction(3, 5)) < 1e-15
    (Fraction(1, 1), True)
    """
    if normals is None:
        return None
    found = []
    for x, y in normals.tolist():
        half = Fraction(x / (1 + abs(y)))  # the tangent of half the angle
        square = half * half
        found.append((2 * half / (1 + square), (1 - square) / (1 + square) * (-1 if y < 0 else 1)))
    exact_ones = np.array(found, dtype=object)
    if np.abs((exact_ones - exact.fractions(normals)).astype(float)).max() > 4 * UNIT:
        raise NotExact("normals whose length is not 1 to rounding")
    return exact_ones


def exact_points(spec: BodySpec, body: Body) -> NDArray[Any]:
    """Return the nodes of a body in rationals, in the order of its mesh, shape (n, d)."""
    if spec.mesh is not None:
        return exact.fractions(body.mesh.points)
    assert spec.x is not None
    assert spec.cells is not None
    if spec.y is None:
        return interval(spec.x, spec.cells[0]).points
    return rectangle_points(spec.x, spec.y, (spec.cells[0], spec.cells[1]), spec.split)


class ExactInterface:
    """The join of the two grids of a pair in rationals.

    ``contact`` and ``neumann`` are the exact positions of the contact nodes of both bodies; the pair is made from a
    problem.
    """

    def __init__(self, pair: ContactPair, contact: NDArray[Any], neumann: NDArray[Any]) -> None:
        self.pair = pair
        one_grid, contact_grid, neumann_grid = pair.interface.one_grid, pair.contact.grid, pair.neumann.grid
        if pair.problem is not None and pair.problem.contact.surface is not None:
            contact, neumann = exact.fractions(contact_grid.x), exact.fractions(neumann_grid.x)
        # one grid has the positions of body 1, as in doubles
        x = (contact if pair.contact_body == 1 else neumann) if one_grid else contact
        self.grid = Grid(x=x, weights=trapezoid(x), dimension=pair.interface.contact.dimension)
        self.other, self.exact_transfer = self.grid, None
        if not one_grid:
            x, self.exact_transfer, weights = transferred(contact, neumann)
            self.other = Grid(x=x, weights=weights)
        normals = (exact_normals(grid.normals) for grid in (contact_grid, neumann_grid))
        self.join = pair.interface.holding(joined(self.exact_transfer, *normals))

    @cached_property
    def weights(self) -> Enclosed:
        """w on the diagonal, for the contact nodes."""
        return Enclosed.rounded(np.diag(self.grid.weights))

    @cached_property
    def inverse_weights(self) -> Enclosed:
        """1/w on the diagonal."""
        return Enclosed.rounded(np.diag(1 / self.grid.weights))

    @cached_property
    def transfer(self) -> Enclosed | None:
        """P; None where the grids are one."""
        return None if self.exact_transfer is None else Enclosed.rounded(self.exact_transfer)

    @cached_property
    def transfer_of_traces(self) -> Enclosed | None:
        """P on the components of a trace that Gamma_u leaves free; None where both bodies have the same."""
        if self.pair.same_traces:
            return None
        P = self.join.carry(np.eye(self.pair.neumann.grid.size, dtype=int))
        return Enclosed.rounded(P[self.pair.contact.free][:, self.pair.neumann.free])

    @property
    def mixes(self) -> bool:
        """True if P does not act alike on both components: a form of normal ones becomes one of all."""
        return not (self.join.alike or self.pair.same_traces)

    @cached_property
    def exact_kernel(self) -> NDArray[Any] | None:
        """S in rationals; None without a law of friction.

        Raises
        ------
        NotExact
            A law that is not the problem's, or one that computes in doubles.
        """
        law, problem = self.pair.interface.law, self.pair.problem
        assert problem is not None
        if law is None:
            return None
        contact = problem.contact
        if law != LAWS[contact.law].of_file(contact):
            raise NotExact("the law of friction was given from Python, and not by exact numbers")
        interface = replace(self.pair.interface, contact=self.grid, neumann=self.other, join=self.join)
        try:
            return np.asarray(interface.operator(law.exact(contact.radius)))
        except (TypeError, ValueError) as error:
            raise NotExact(f"law of friction: {error}") from None

    @cached_property
    def kernel(self) -> Enclosed | None:
        """S; None without a law of friction.  NotExact as :attr:`exact_kernel`, or for entries that are irrational."""
        try:
            return None if self.exact_kernel is None else Enclosed.rounded(self.exact_kernel)
        except (TypeError, ValueError) as error:
            raise NotExact(f"law of friction: {error}") from None

    def felt(self, form: Enclosed, *, normal: bool = False) -> Enclosed:
        """Return ``P' X P``: a form of the contact body on the Neumann grid, of all components or of normal ones.

        Where normals differ, a form of normal components becomes one of all.
        """
        P = self.transfer if normal and not self.mixes else self.transfer_of_traces
        if normal and self.mixes and P is not None:
            P = self.normal_rows(P)
        return form if P is None else P.T.times(form).times(P).symmetric()

    def normal_rows(self, P: Enclosed) -> Enclosed:
        """Return the rows of P on free components that give normal ones, which come last."""
        rows, columns = P.middle.shape
        return P.block(np.arange(rows - self.grid.n, rows), np.arange(columns))

    def tangential_mass(self, tangential: Bools) -> Enclosed:
        """Return B_T on the free components of the contact grid."""
        free = self.pair.contact.free[self.pair.contact.grid.tangential]
        entries = np.zeros(len(tangential), dtype=object)
        entries[tangential] = self.grid.weights[free]
        middle = nearest(entries)
        return Enclosed(middle=np.diag(middle), radius=np.diag(np.abs(middle)) * 2.0**-53)
