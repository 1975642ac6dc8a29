"""Layers of equal cells: the stiffness of their surface at each wave number, exactly as the mesh has it.

A layer has node rows 0 (its surface), 1, 2, .. downwards, and equal cells a wide and b high, each split into two
triangles.  On waves ``u(x + N a) = e^(i phase) u(x)`` one row of cells is a Hermitian block of the N nodes above and
the N nodes below it.  Eliminating rows from the far side leaves the Schur complement of the surface: for a half-plane
the stable fixed point of that elimination, found by doubling the number of rows until nothing changes.

Energies are per N columns and do not depend on the size of a cell, only on its shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fem1d2d import element
from fem1d2d.material import Material
from fem1d2d.mesh import Cells, Floats, MeshError
from fem1d2d.trace import mortar

Complex = NDArray[Any]

#: Rows are doubled until a step changes the surface by less than this fraction.
CHANGE = 1e-15

#: Doublings of the number of rows: 2^60 rows damp every wave of more than 1e-15 radians per column.
MOST_DOUBLINGS = 60


@dataclass(frozen=True, kw_only=True)
class Layer:
    """A layer of equal cells below its surface.

    Attributes
    ----------
    material : Material
    aspect : float
        Width over height of a cell, > 0 and finite; MeshError otherwise.
    rising : bool
        True if the diagonal of the cell in column 0 below the surface runs from lower left to upper right.
    diagonals : {'alternating', 'uniform', 'both'}
        Alternating ones change from each cell to the next, along rows and columns, as those of
        :func:`fem1d2d.rectangle`.  In cells that are split by both, the nodes in the middle are eliminated.
    rows : int or None
        Rows of cells above a clamped side; None for a half-plane.
    """

    material: Material
    aspect: float
    rising: bool = True
    diagonals: Literal["alternating", "uniform", "both"] = "alternating"
    rows: int | None = None

    def __post_init__(self) -> None:
        if not 0 < self.aspect < np.inf:
            raise MeshError(f"aspect {self.aspect}: a positive number is needed")
        if not (self.rows is None or self.rows >= 1):
            raise MeshError(f"{self.rows} rows: at least one is needed")

    @property
    def period(self) -> int:
        """Columns after which the diagonals repeat."""
        return 2 if self.diagonals == "alternating" else 1

    def _cell(self, rising: bool) -> list[tuple[tuple[int, ...], Floats]]:
        """Stiffness matrices of a cell between some of its corners, counted from the lower left one."""
        points = [(0.0, 0.0), (self.aspect, 0.0), (self.aspect, 1.0), (0.0, 1.0), (self.aspect / 2, 0.5)]
        if self.diagonals != "both":
            halves = [(0, 1, 2), (0, 2, 3)] if rising else [(0, 1, 3), (1, 2, 3)]
            local = element.stiffness(Cells(points=np.array(points[:4]), cells=np.array(halves)), self.material)
            return list(zip(halves, local, strict=True))
        quarters = np.array([(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)])
        whole = np.zeros((5, 2, 5, 2))
        local = element.stiffness(Cells(points=np.array(points), cells=quarters), self.material)
        for quarter, matrix in zip(quarters, local, strict=True):
            whole[np.ix_(quarter, [0, 1], quarter, [0, 1])] += matrix
        k = whole.reshape(10, 10)
        rest = k[:8, :8] - k[:8, 8:] @ np.linalg.solve(k[8:, 8:], k[8:, :8])
        return [((0, 1, 2, 3), rest.reshape(4, 2, 4, 2))]

    def row(self, phases: Floats, columns: int) -> Complex:
        """The row of cells below the surface, shape (n, 4 N, 4 N), unit stress.

        Unknowns: the N nodes above it, then those below it, both components of each together.  The lower nodes of
        alternating diagonals are counted from one column further right, so that every row has the same matrix.

        Parameters
        ----------
        phases : array, shape (n,)
            In radians per N columns.
        columns : int
            N; MeshError unless it is a multiple of the period.
        """
        if columns < 1 or columns % self.period:
            raise MeshError(f"{columns} columns: a multiple of {self.period} is needed")
        shift = self.period - 1
        found = np.zeros((len(phases), 2, columns, 2, 2, columns, 2), dtype=complex)
        for column in range(columns):
            rising = self.rising ^ bool(shift and column % 2)
            corners = [(0, 0), (1, 0), (1, 1), (0, 1)]  # lower left, lower right, upper right, upper left
            for half, matrix in self._cell(rising):
                at = []
                for corner in half:
                    right, top = corners[corner]
                    turns, place = divmod(column + right - shift * (1 - top), columns)
                    at.append((1 - top, place, np.exp(1j * phases * turns)))
                for i, (r, m, ahead) in enumerate(at):
                    for j, (s, n, beyond) in enumerate(at):
                        found[:, r, m, :, s, n, :] += (ahead.conj() * beyond)[:, None, None] * matrix[i, :, j, :]
        return found.reshape(len(phases), 4 * columns, 4 * columns)

    def surface(self, phases: Floats, columns: int) -> Complex:
        """The Schur complement of the surface, shape (n, 2 N, 2 N), Hermitian, unit stress.

        Parameters
        ----------
        phases : array, shape (n,)
            As for :meth:`row`; for a half-plane none may be a multiple of 2 pi, at which it moves freely.
        columns : int

        Examples
        --------
        Long waves on a half-plane have the stiffnesses ``2 G xi`` and ``2 G xi / kappa`` of the continuum:

        >>> from fem1d2d import plane_strain
        >>> layer = Layer(material=plane_strain(2.6, 0.3), aspect=1.0, diagonals="uniform")
        >>> np.linalg.eigvalsh(layer.surface(np.array([0.001]), 1))[0].round(6)
        array([0.001111, 0.002   ])
        """
        k, n = self.row(np.asarray(phases, dtype=float), columns), 2 * columns
        above, across, below = k[:, :n, :n], k[:, :n, n:], k[:, n:, n:]
        if self.rows is not None:
            found = above
            for _ in range(self.rows - 1):
                found = above - across @ np.linalg.solve(below + found, _adjoint(across))
            return _hermitian(found)
        for _ in range(MOST_DOUBLINGS):
            inner = np.linalg.solve(below + above, np.concatenate([_adjoint(across), across], axis=-1))
            change, down = across @ inner[..., :n], inner[..., n:]  # the middle row of two equal slabs is left out
            above, below, across = above - change, below - _adjoint(across) @ down, -across @ down
            if (np.abs(change).max((1, 2)) <= CHANGE * np.abs(above).max((1, 2))).all():
                break
        return _hermitian(above)


@dataclass(frozen=True, kw_only=True)
class FacingLayers:
    """Two layers with a common surface, and the mortar transfer between their grids.

    Both layers are described as bodies below their surface, the upper one as its mirror image: equal cells and equal
    ``rising`` mean that the meshes mirror each other.

    Attributes
    ----------
    contact, neumann : Layer
        The body of step II and of step I.
    columns : tuple of int
        Columns of both layers in one period, multiples of their periods; MeshError otherwise.
    offset : float
        Position of the Neumann node 0 relative to the contact node 0, in columns of the contact body.
    """

    contact: Layer
    neumann: Layer
    columns: tuple[int, int] = (2, 2)
    offset: float = 0.0

    def __post_init__(self) -> None:
        for layer, columns in zip((self.contact, self.neumann), self.columns, strict=True):
            if columns < 1 or columns % layer.period:
                raise MeshError(f"{columns} columns: a multiple of {layer.period} is needed")

    @property
    def matching(self) -> bool:
        """True if both grids are one."""
        return self.columns[0] == self.columns[1] and self.offset == 0

    def transfer(self, phases: Floats) -> Complex:
        """P on waves, shape (n, N_c, N_n); of :func:`fem1d2d.mortar` on the endless grids."""
        own, other = self.columns
        if self.matching:
            return np.broadcast_to(np.eye(own, dtype=complex), (len(phases), own, own))
        contact, width = np.arange(-1.0, own + 1), own / other  # psi_j reaches over the cells beside node j
        first, last = int((contact[0] - self.offset) // width), int((contact[-1] - self.offset) // width) + 1
        P = mortar(contact, self.offset + width * np.arange(first, last + 1))[1:-1]
        found = np.zeros((len(phases), own, other), dtype=complex)
        for column, node in zip(P.T, range(first, last + 1), strict=True):
            turns, place = divmod(node, other)
            found[:, :, place] += np.exp(1j * turns * phases)[:, None] * column
        return found

    def ratios(self, phases: Floats) -> tuple[Floats, Floats]:
        """rho and rho_N of the waves: the largest stiffness, contact over Neumann body, at each phase, shape (n,).

        The second one has the tangential components of both condensed out.  Phases are in radians per period, none a
        multiple of 2 pi for half-planes.
        """
        phases = np.asarray(phases, dtype=float)
        own, other = self.columns
        P = self.transfer(phases)
        both = np.kron(P, np.eye(2))
        flip = np.tile([1.0, -1.0], other)  # the Neumann body lies on the other side
        S_c = self.contact.surface(phases, own)
        S_n = self.neumann.surface(phases, other) * np.outer(flip, flip)
        normal_c, normal_n = _normal(S_c), _normal(S_n)
        return _largest(_adjoint(both) @ S_c @ both, S_n), _largest(_adjoint(P) @ normal_c @ P, normal_n)


#: Waves between which the largest ratio is sought first; later ones divide the two gaps beside the best.
FIRST, LATER = 32, 8

#: The longest wave, in radians per period.  Its ratios differ from their limits by about its square, and by rounding
#: errors of up to 1e-12 over its square, so that they have about six digits.
LONGEST = 1e-3


class Peak(NamedTuple):
    """A wave, in radians per period, and its ratio of stiffness."""

    phase: float
    ratio: float


def peaks(interface: FacingLayers, *, rounds: int = 2) -> tuple[Peak, Peak]:
    """The waves of the largest rho and rho_N on two layers, in doubles, sought among finitely many waves.

    Each round after the first one divides the distance of waves by eight.

    Examples
    --------
    Cells of the upper body twice as high as wide, one material:

    >>> from fem1d2d import plane_strain
    >>> flat, tall = (Layer(material=plane_strain(2.6, 0.3), aspect=aspect) for aspect in (1.0, 0.5))
    >>> [round(peak.ratio, 4) for peak in peaks(FacingLayers(contact=tall, neumann=flat))]
    [2.3548, 1.291]
    """
    phases = np.linspace(0.0, np.pi, FIRST + 1)  # at 2 pi - phase there are the conjugate waves
    phases[0] = LONGEST
    first = interface.ratios(phases)
    found = []
    for which, ratios in enumerate(first):
        near, best = phases, int(np.argmax(ratios))
        for _ in range(rounds):
            near = np.linspace(near[max(best - 1, 0)], near[min(best + 1, len(near) - 1)], 2 * LATER + 1)
            ratios = interface.ratios(near)[which]
            best = int(np.argmax(ratios))
        found.append(Peak(float(near[best]), float(ratios[best])))
    return found[0], found[1]


def _normal(surface: Complex) -> Complex:
    """The tangential components condensed out."""
    t, n = surface[:, ::2], surface[:, 1::2]
    return _hermitian(n[..., 1::2] - n[..., ::2] @ np.linalg.solve(t[..., ::2], t[..., 1::2]))


def _largest(numerator: Complex, denominator: Complex) -> Floats:
    """The largest eigenvalues of Hermitian pairs, the second of each positive definite."""
    inverse = np.linalg.inv(np.linalg.cholesky(denominator))
    return np.asarray(np.linalg.eigvalsh(_hermitian(inverse @ numerator @ _adjoint(inverse)))[:, -1])


def _adjoint(matrices: Complex) -> Complex:
    return np.asarray(matrices.conj().swapaxes(-1, -2))


def _hermitian(matrices: Complex) -> Complex:
    return np.asarray((matrices + _adjoint(matrices)) / 2)
