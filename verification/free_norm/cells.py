"""The circle criterion for two layers of equal cells: one factor for all periodic meshes of these cells.

The cells repeat after N columns.  On waves ``u(x + N columns) = e^(i phase) u(x)`` the stiffness of a layer is a
Hermitian matrix of 2 N rows (:mod:`fem1d2d.layers`).  With multipliers that repeat as well, the form M(h) of
:mod:`verification.free_norm.circle` is one Hermitian matrix of 2 N rows for each phase.

A mesh whose sides are identified has finitely many phases.  Multipliers that do not repeat prove no more there: they
may be moved by N columns, and M(h) is linear in them, so that the mean over all places proves the same factor.  A
factor for all phases holds for every period, and for contact on any part of the surface: forces that vanish outside it
are among all forces, and what friction takes from M is no larger there.

The numbers are in doubles, at finitely many phases and points of a circle.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fem1d2d.layers import FacingLayers
from fem1d2d.mesh import Floats
from ndtheory.continuum.circle import disk
from verification.free_norm.circle import (
    INSIDE,
    LOOKED_AT,
    LOOKS,
    START,
    STOP,
    Complex,
    Ends,
    everywhere,
    point,
    real_rows,
)
from verification.interface.friction import hat
from verification.machine.threads import one_thread
from verification.semidefinite.interior_point import Program

#: Phases that represent all of them; the least one is this, over the larger of the numbers of rows.
PHASES, LONG = 48, 0.05

#: Places, a point of the circle and a phase, that a program has at most.
MOST = 24

#: How closely a factor is known.
NEAR = 1e-3


class CellCircles:
    """Multipliers for circles of h, at some phases, for two layers of equal cells and one friction.

    Parameters
    ----------
    layers : FacingLayers
        Clamped, with columns that face each other: ValueError otherwise.
    radius, friction : float
        r > 0 of the hat kernel in columns, and k > 0.
    phases : sequence of float, optional
        In radians per period of the cells, 0 to pi.

    Examples
    --------
    Section 6 at k = 0.2 and theta = 0.7, two layers with six rows of cells, whatever their period:

    >>> from fem1d2d import plane_strain
    >>> from fem1d2d.layers import Layer
    >>> soft, hard = (Layer(material=plane_strain(E, 0.3), aspect=1.0, rows=6) for E in (20000, 70000))
    >>> found = CellCircles(FacingLayers(contact=soft, neumann=hard), 2.0, 0.2).factor(0.7)
    >>> 0.33 < found < 0.35
    True
    """

    def __init__(
        self, layers: FacingLayers, radius: float, friction: float, phases: Sequence[float] | None = None
    ) -> None:
        rows = [layer.rows for layer in (layers.contact, layers.neumann) if layer.rows is not None]
        if not layers.matching or len(rows) < 2:
            raise ValueError("needed columns of cells that face each other, and clamped layers")
        if phases is None:
            phases = np.geomspace(LONG / max(rows), np.pi, PHASES).tolist()
        self.N, around = layers.columns[0], np.array(phases, dtype=float)
        turn = np.tile([1.0, -1.0], self.N)  # the Neumann body lies on the other side
        A_n = np.linalg.inv(layers.neumann.surface(around, self.N) * np.outer(turn, turn))
        p = np.linalg.cholesky(layers.contact.surface(around, self.N))  # |d_1| is Euclidean
        v_g, v_p, none = -A_n @ p, -np.linalg.inv(p).conj().swapaxes(1, 2), np.zeros_like(p[:, ::2])
        shifts = self.N * np.arange(-np.ceil(radius) - 1, np.ceil(radius) + 2)
        apart = np.subtract.outer(np.arange(self.N), np.arange(self.N))
        S = sum(hat(apart - shift, radius) * np.exp(1j * around * shift / self.N)[:, None, None] for shift in shifts)
        zeta, slide = np.sqrt(friction) * S @ p[:, 1::2], np.sqrt(friction) * np.stack([v_g, v_p])[:, :, ::2]
        stack = lambda *rows: np.concatenate(rows, axis=1)
        #: left and right rows of the conditions, each for the g of a wave and for its p
        self._left = stack(none, none, zeta, slide[0]), stack(p[:, 1::2], p[:, ::2], none, slide[1])
        self._right = (
            stack(v_g[:, 1::2], v_g[:, ::2], zeta, slide[0]),
            stack(v_p[:, 1::2], v_p[:, ::2], none, slide[1]),
        )
        self._at = [(0, 0), (0, -1), (LOOKS - 1, 0), (LOOKS - 1, -1)]

    def find(self, ends: Ends) -> Floats | None:
        """lambda, tau, a and b of the nodes in one period with which M > 0 on the circle with some ends, or None."""
        half, N = point(ends, LOOKED_AT), self.N
        h = np.concatenate([half, half.conj()])[:, None, None, None]
        left, right = (h * of_g + of_p for of_g, of_p in (self._left, self._right))
        nodes, start = np.arange(N), START * np.repeat([1.0, INSIDE, 1.0, 1.0], N)

        def program(at: list[tuple[int, int]]) -> Program:
            a, b = (np.hstack([real_rows(rows[place]) for place in at]) for rows in (left, right))
            size, wide = a.shape[1], 4 * N
            least = min(float(np.linalg.eigvalsh(_form(left[place], right[place], start))[0]) for place in at)
            return Program(
                fixed=np.zeros((size, size)), free=np.eye(size), left=a, right=b, s=1 + abs(least) - least, y=start,
                cones=np.stack([N + nodes, 2 * N + nodes, 3 * N + nodes], axis=1), stop=STOP,
                most=np.repeat([1.0, np.inf], [N, 3 * N]), tie=np.vstack([np.eye(4 * N)] * 2),
                blocks=tuple(slice(k, k + wide) for k in range(0, size, wide)),
            )  # fmt: skip

        def least(y: Floats) -> tuple[float, tuple[int, int]]:
            values = np.linalg.eigvalsh(_form(left, right, y))[..., 0]
            place, phase = np.unravel_index(int(values.argmin()), values.shape)
            return float(values.min()), (int(place), int(phase))

        found = everywhere(program, least, self._at, MOST)
        if found is None:
            return None
        y, _, self._at = found  # circles nearby need the same points
        return y

    @one_thread()
    def factor(self, theta: float) -> float | None:
        """The least factor of T_theta in a free norm that is found, 0 < theta < 1; None where none below 1 is."""
        low, high = 1 - theta, 1.0
        if self.find(disk(theta, high)) is None:
            return None
        while high - low > NEAR * high:
            q = (low + high) / 2
            low, high = (low, q) if self.find(disk(theta, q)) is not None else (q, high)
        return high


def _form(left: Complex, right: Complex, y: Floats) -> Complex:
    """M with some multipliers."""
    form = -left.conj().swapaxes(-1, -2) @ (y[:, None] * right)
    return (form + form.conj().swapaxes(-1, -2)) / 2
