"""The forms of the semidefinite bound in traces (d, c), and whether they are positive definite in spite of rounding.

With ``g = S_2 d`` and ``p = P c`` every term but ``|a p + b g|^2`` is a product of the interface matrices themselves.
That term has an inverse, ``|.|^2 = .' S_2^-1 .``, which a Schur complement takes away: ``Q - weight M' S_2^-1 M`` is
positive definite if and only if ``[[S_2 / weight, M], [M', Q]]`` is.  So rounding enters only by sums and products, and
has a bound.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from fem1d2d.mesh import Floats
from fem1d2d.proofs.enclosed import Enclosed, gamma, upwards
from fem1d2d.proofs.loewner import positive_definite
from verification.dense import symmetric
from verification.interface.pair import ContactPair

Families = list[tuple[Floats, Floats]]


def families(pair: ContactPair, k: float, kernel: Floats | None, g: Floats, force: Floats, jump: Floats) -> Families:
    """Factors of the multiplied conditions, a row for each node; only of (2.4) without friction.

    ``g`` are forces on the Neumann grid, ``force`` and ``jump`` p and v on the contact grid, each as linear forms.
    Those behind the fourth are for :class:`verification.semidefinite.conditions.Pieces`.
    """
    contact = pair.contact.grid
    press, gap = force[contact.normal], jump[contact.normal]
    if not k:
        return [(press, gap)]
    assert kernel is not None
    shear, slip = force[contact.tangential], jump[contact.tangential]
    weight = np.sqrt(k * contact.weights)[:, None]
    zeta, slide = weight * (kernel @ g[pair.neumann.grid.normal]), weight * slip
    found = [(press, gap), (shear, slip), (zeta, zeta), (slide, slide)]
    return [*found, (zeta, slide), (gap, gap), (press, press), (shear, shear), (shear, zeta)]


def weighed(multipliers: Sequence[Floats], families: Families) -> Floats:
    """The sum over the nodes of the multiplied conditions; the last families are left out where nothing is fixed."""
    return np.asarray(sum(a.T @ (values[:, None] * b) for values, (a, b) in zip(multipliers, families, strict=False)))


class TraceForms:
    """The forms of a pair of bodies at a friction k > 0, or at 0, in place of the pair's.

    Without friction p has no tangential part: c is then the normal part of a trace and P has S_1 with the tangential
    components condensed out.

    ``S_1``, shape (m, m), leads from c to the components of p that are not 0, which ``carries`` selects.  ``near``,
    shapes (N, N) and (m, m), are changes of d and of c, as columns, in which the forms are of size 1: the nearer, the
    less is lost to rounding.
    """

    def __init__(
        self, pair: ContactPair, k: float, *, S_1: Floats, carries: slice, near: tuple[Floats, Floats]
    ) -> None:
        contact, interface = pair.contact.grid, pair.interface
        S_2, size = pair.neumann.schur, pair.neumann.grid.size
        still = np.zeros((contact.size, len(S_1)))
        moved, pressed = still.copy(), still.copy()
        moved[carries], pressed[carries] = np.eye(len(S_1)), S_1
        self._S_2, self._near = S_2, near
        none = np.zeros((size, len(S_1)))
        self._d = np.hstack([np.eye(size), none])
        self._g = np.hstack([S_2, none])
        self._p = np.hstack([np.zeros((size, size)), interface.carry_back(pressed)])
        moduli = interface.moduli
        self._p_size = np.hstack([np.zeros((size, size)), moduli.carry_back(np.abs(pressed))])
        force = np.hstack([np.zeros((contact.size, size)), pressed])
        jump = -np.hstack([interface.carry(np.eye(size)), moved])
        kernel = interface.kernel
        self._families = families(pair, k, kernel, self._g, force, jump)
        kernel = None if kernel is None else np.abs(kernel)
        self._sizes = families(pair, k, kernel, np.abs(self._g), np.abs(force), np.abs(jump))
        # inner products over nodes (a transfer has them too), over traces twice, and the scalars, weights and sums
        self._terms = 4 * (2 * size + len(S_1)) + (2 if interface.one_grid else 4) * contact.n + 30
        self._size = size
        self._free = _changed(S_2, near[:1])
        self._free_error = self._error(np.abs(S_2), near[:1])

    def _error(self, size: Floats, near: Sequence[Floats], more: int = 0) -> Floats:
        """A bound of the rounding errors of a form in the coordinates of some columns, from the moduli of its terms.

        ``more`` are the sums of a term beside those of :meth:`with_multipliers`.
        """
        terms = self._terms + more
        return np.asarray(upwards(gamma(terms) * _changed(size, [np.abs(columns) for columns in near]), terms))

    def with_multipliers(
        self, multipliers: Sequence[Floats], *, cross: float = 0.0, step: tuple[float, float] | None = None
    ) -> Callable[..., bool]:
        """Test of ``square |g|^2 - cross <g, p> - weight |a p + b g|^2 - conditions``, ``step`` being (a, b) if any.

        The result takes the square and, with a step, its weight, 1 by default; it is True if the form is positive
        definite for sure.
        """
        form = -cross * self._d.T @ self._p - weighed(multipliers, self._families)
        size = abs(cross) * self._d.T @ self._p_size + weighed([np.abs(m) for m in multipliers], self._sizes)
        near: tuple[Floats, ...] = self._near
        first = 0
        if step is not None:
            a, b = step
            row, row_size = a * self._p + b * self._g, abs(a) * self._p_size + abs(b) * np.abs(self._g)
            form = np.block([[self._S_2, row], [row.T, form]])
            size = np.block([[np.abs(self._S_2), row_size], [row_size.T, size]])
            near, first = (near[0], *near), len(row)
        form, size = _changed(form, near), self._error(size, near)
        d = slice(first, first + len(self._S_2))

        def definite(square: float, weight: float = 1.0) -> bool:
            matrix, error = form.copy(), size.copy()
            root = math.sqrt(weight)  # in coordinates larger by this, S_2 / weight is of size 1
            for part in (matrix, error):
                part[:first, :first] *= root * root / weight
                part[:first, first:] *= root
                part[first:, :first] *= root
            matrix[d, d] += square * self._free
            error[d, d] += abs(square) * self._free_error
            return positive_definite(Enclosed(middle=matrix, radius=error))

        return definite

    def in_norm(self, Q: Floats, multipliers: Sequence[Floats], *, step: tuple[float, float]) -> Callable[..., bool]:
        """Test of ``square |g|_Q^2 - |a p + b g|_Q^2 - conditions``, as above, with ``|g|_Q^2 = g' Q g``."""
        a, b = step
        row, row_size = a * self._p + b * self._g, abs(a) * self._p_size + abs(b) * np.abs(self._g)
        fixed, free = -row.T @ Q @ row - weighed(multipliers, self._families), self._g.T @ Q @ self._g
        sizes = (
            row_size.T @ np.abs(Q) @ row_size + weighed([np.abs(m) for m in multipliers], self._sizes),
            np.abs(self._g).T @ np.abs(Q) @ np.abs(self._g),
        )
        fixed, free = _changed(fixed, self._near), _changed(free, self._near)
        fixed_error, free_error = (self._error(size, self._near, 6 * self._size) for size in sizes)

        def definite(square: float) -> bool:
            return positive_definite(
                Enclosed(middle=fixed + square * free, radius=fixed_error + abs(square) * free_error)
            )

        return definite


def _changed(form: Floats, near: Sequence[Floats]) -> Floats:
    """A form in the coordinates of some columns, block by block on the diagonal; symmetric to the last digit."""
    form = symmetric(form)
    ends = np.cumsum([0, *(len(columns) for columns in near)])
    parts = [slice(*pair) for pair in pairwise(ends.tolist())]
    result = np.empty((sum(columns.shape[1] for columns in near),) * 2)
    for i, rows in enumerate(parts):
        for j, columns in enumerate(parts[: i + 1]):
            block = near[i].T @ form[rows, columns] @ near[j]
            result[rows, columns] = block if i > j else symmetric(block)
            result[columns, rows] = result[rows, columns].T
    return result
