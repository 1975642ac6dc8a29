"""The conditions of step II as quadratic forms, and the multipliers that are known in closed form."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, cho_factor, cho_solve, solve_triangular

from fem1d2d.mesh import Bools, Floats
from ndtheory.energy_norms import turning_theta, worst_ratio
from verification.constants import Measured
from verification.contact.active_set import Signs
from verification.dense import STILL, symmetric
from verification.interface.pair import ContactPair
from verification.machine.threads import one_thread
from verification.semidefinite import LARGEST
from verification.semidefinite.interior_point import Optimum, Program, Weights
from verification.semidefinite.trace_forms import TraceForms, families, weighed

Cones = NDArray[np.intp]


#: How much the square of a form of length 1 may weigh that is 0: the more, the nearer to leaving it out.
LARGE = 1e2

#: Lengths and squares smaller than this are 0.
TINY = 1e-300


@dataclass(frozen=True, kw_only=True, eq=False)
class Pieces:
    """Affine pieces of T with fixed states at some nodes; 0 where nothing is fixed.

    ``signs``, shape (t,), is eps where ``p_T v_T = eps w k zeta v_T``: the sign of slip against S sigma_N.  ``normal``,
    shape (n,), is 1 where the node touches, -1 where it is open.  ``slip``, shape (t,), is 1 where the node slides
    (then its sign is fixed, too), -1 where it sticks.
    """

    signs: Signs
    normal: Signs
    slip: Signs

    @classmethod
    def all(cls, n: int, t: int) -> Pieces:
        """All of them."""
        return cls(signs=np.zeros(t, np.int8), normal=np.zeros(n, np.int8), slip=np.zeros(t, np.int8))

    @property
    def any(self) -> bool:
        """True if anything is fixed."""
        return bool(self.signs.any() or self.normal.any() or self.slip.any())

    @property
    def zeros(self) -> tuple[Bools, ...]:
        """The nodes at which the jump, the normal force, the slip and ``p_T - eps w k zeta`` are 0."""
        return self.normal > 0, self.normal < 0, self.slip < 0, self.slip > 0

    @property
    def key(self) -> bytes:
        """A key by which they differ from others of the same bodies."""
        return self.signs.tobytes() + self.normal.tobytes() + self.slip.tobytes()

    def where(self, name: str, node: int, value: int) -> Pieces:
        """Those of them with something more in common."""
        values = getattr(self, name).copy()
        values[node] = value
        return replace(self, **{name: values})

    def divided(self, name: str, node: int) -> tuple[Pieces, Pieces]:
        """Those with 1 and those with -1 at a node: together all of them."""
        return self.where(name, node, 1), self.where(name, node, -1)


class Conditions:
    """The quadratic forms of a pair of bodies, in coordinates in which ``|g|`` and ``|d_1|`` are Euclidean norms.

    ``carried`` takes the coordinates of d_1 to forces p on the contact grid.  Proposals of a solver are checked in
    traces (:class:`verification.semidefinite.trace_forms.TraceForms`).  ``friction`` is k, the pair's by default.

    Where rigid motions z lift the contact body (``lifts``) p is orthogonal to them, and adding z to d_1 must not change
    the forms: ``sum_j lambda_j p_Nj z_Nj = 0``.  So all nodes have one lambda, and p and d_1 are taken modulo z.

    Raises
    ------
    ValueError
        A contact node is held, or there are more nodes than :data:`verification.semidefinite.LARGEST`.
    """

    @one_thread()
    def __init__(self, pair: ContactPair, measured: Measured, *, friction: float | None = None) -> None:
        if pair.contact.grid.n > LARGEST:
            raise ValueError(f"{pair.contact.grid.n} contact nodes: worked out up to {LARGEST}")
        if pair.held:
            raise ValueError("a contact node is held: the semidefinite bound needs every one free")
        self.k = k = float(pair.friction) if friction is None else friction
        measured = measured.with_friction(k)
        constants = measured.energy_constants()
        if constants is None:
            raise ValueError("the theorem in energy norms does not apply to it: " + measured.why_no_energy)
        self.measured, self.lifts = measured, pair.contact.lifts
        self.energy_bounds = float(constants.at_work), float(constants.kappa_1), float(constants.kappa_2)
        contact, neumann, interface = pair.contact.grid, pair.neumann.grid, pair.interface
        carries = slice(0, contact.size) if k else contact.normal  # without friction p_T = 0
        # g = L_2 y and p = B z with L_2 L_2' = S_2 and B' S_1^-1 B = 1: |y| = |||g|||, |z| = |d_1|
        L_2, flexible = pair.neumann.root, pair.contact.inverse  # without friction pinned motions do not matter
        inner = flexible[carries, carries]
        turn = solve_triangular(np.linalg.cholesky(inner).T, np.eye(len(inner)), lower=False)
        if self.lifts:
            held, lengths, _ = np.linalg.svd(turn.T @ pair.contact.motions[carries])
            turn = turn @ held[:, int((lengths > STILL * lengths[0]).sum()) :]
        B = np.zeros((contact.size, turn.shape[1]))
        B[carries] = turn
        S_1 = pair.contact.schur if k else cho_solve(cho_factor(inner), np.eye(len(inner)))
        near = pair.neumann.flexibility(L_2), inner @ turn
        self.traces = TraceForms(pair, k, S_1=S_1, carries=carries, near=near)
        self.size = neumann.size
        self.g = np.hstack([np.eye(neumann.size), np.zeros((neumann.size, B.shape[1]))])
        back = L_2.T @ pair.neumann.flexibility(interface.carry_back(B))
        self.p = np.hstack([np.zeros((neumann.size, neumann.size)), back])
        force = np.hstack([np.zeros((contact.size, neumann.size)), B])
        jump = np.hstack([-interface.carry(pair.neumann.flexibility(L_2)), -flexible @ B])
        taken = np.hstack([L_2, np.zeros((neumann.size, B.shape[1]))])
        self.families = families(pair, k, interface.kernel, taken, force, jump)
        if k:
            self.weight = np.sqrt(k * contact.weights)
            self.reach = self.weight[:, None] * self.families[2][0]  # w k zeta
        self.carried = B

    def conditions(self, multipliers: Weights) -> Floats:
        """The sum over the nodes of the multiplied conditions, a symmetric matrix."""
        return symmetric(weighed(multipliers, self.families))

    def inner(self, one: Floats, other: Floats) -> Floats:
        """The inner product of two linear forms in the norm of the factor: (5.21), Euclidean in these coordinates.

        Programs have that norm from here, their check from S_2.
        """
        return np.asarray(one.T @ other)

    @property
    def free(self) -> Floats:
        """The form ``|g|^2``."""
        return self.inner(self.g, self.g)

    @property
    def cross(self) -> Floats:
        """The form ``<g, p>``."""
        return symmetric(self.inner(self.g, self.p))

    def fixed(self, theta: float) -> Floats:
        """The form ``-|theta p + (1 - theta) g|^2``: what is left of a difference of forces after one step."""
        step = theta * self.p + (1 - theta) * self.g
        return self.inner(-step, step)

    def square_from_below(self, found: Optimum) -> np.polynomial.Polynomial:
        """A parabola in theta below the square of the factor that a program at any theta can prove, from one program.

        Its moments satisfy the dual constraints, which do not depend on theta.  At its own theta the parabola has the
        value that the solver found, up to its accuracy.
        """
        move, of = self.p - self.g, lambda form: float(np.vdot(found.moments, form))
        square = of(self.free)
        return np.polynomial.Polynomial([square, 2 * of(self.inner(self.g, move)), of(self.inner(move, move))]) / square

    def rows(self, multipliers: Weights, pieces: Pieces) -> tuple[Floats, Floats, Cones, Floats, Floats]:
        """Left and right rows of the products, positions of multipliers in cones, the multipliers, and their limits.

        Where a sign is fixed the two sums of friction are one product, ``tau (p_T - eps w k zeta) v_T``; a form that is
        0 at a node enters by its square, with a multiplier up to :data:`LARGE`.
        """
        (force, jump), *friction = self.families[:4]
        first = multipliers[0][: self._count]
        if not friction:
            return force, jump, np.empty((0, 3), dtype=np.intp), first, np.full(len(first), np.inf)
        (shear, slip), (zeta, _), (slide, _) = friction
        n, t = len(first), len(shear)
        either = np.flatnonzero(pieces.signs == 0)
        _, tau, a, b = multipliers
        signed = shear - pieces.signs[:, None] * self.reach
        zero = [rows[at] for rows, at in zip((jump, force, slip, signed), pieces.zeros, strict=True)]
        left = np.vstack([force, signed, zeta[either], slide[either], *(-rows for rows in zero)])
        right = np.vstack([jump, slip, zeta[either], slide[either], *zero])
        place = n + t + np.arange(len(either))
        cones = np.stack([n + either, place, place + len(either)], axis=1)
        squares = np.concatenate([1 / np.maximum(np.einsum("ij,ij->i", rows, rows), TINY) for rows in zero])
        y = np.concatenate([first, tau, a[either], b[either], squares])
        return left, right, cones, y, np.concatenate([np.full(len(y) - len(squares), np.inf), LARGE * squares])

    def by_node(self, y: Floats, pieces: Pieces) -> Weights:
        """The multipliers of :meth:`rows` as multipliers of the families, node by node; 0 in place of negative ones."""
        y, n = np.maximum(y, 0.0), len(self.families[0][0])
        if len(self.families) == 1:
            return (self._spread(y),)
        t = len(self.families[1][0])
        (lam, tau, a, b), (touching, open_, sticks, slides) = self._of_rows(y, pieces)
        tau = np.where(pieces.signs == 0, inside((lam, tau, a, b))[1], tau)
        if not pieces.any:
            return lam, tau, a, b
        jump, force, shear, mixed = np.zeros(n), np.zeros(n), np.zeros(t), np.zeros(t)
        jump[pieces.normal > 0], force[pieces.normal < 0] = -touching, -open_
        b[pieces.slip < 0] -= sticks / self.weight[pieces.slip < 0] ** 2
        shear[pieces.slip > 0] = -slides  # -(p_T - eps w k zeta)^2
        mixed[pieces.slip > 0] = (2 * pieces.signs * self.weight)[pieces.slip > 0] * slides
        a[pieces.slip > 0] -= self.weight[pieces.slip > 0] ** 2 * slides
        return lam, tau, a, b, -1.0 * pieces.signs * tau, jump, force, shear, mixed

    @property
    def _count(self) -> int:
        """Number of multipliers of (2.4)."""
        return 1 if self.lifts else len(self.families[0][0])

    def _spread(self, lam: Floats) -> Floats:
        """The multipliers of (2.4) node by node."""
        return np.asarray(np.repeat(lam, len(self.families[0][0]) // self._count))

    def tie(self, rows: Floats) -> Floats | None:
        """The multiplier of each of the :meth:`rows`, as :class:`Program` has it."""
        n = len(self.families[0][0])
        return block_diag(np.ones((n, 1)), np.eye(len(rows) - n)) if self.lifts else None

    def apart(self, multipliers: Weights, pieces: Pieces) -> tuple[Weights, Mapping[str, Floats]]:
        """The multipliers of the inequalities, node by node, and of equations that hold on pieces, by what is fixed.

        They are what :meth:`by_node` adds up: of the squares of v_N or p_N, of ``(p_T - eps w k zeta) v_T``, and of the
        squares of one of its factors.
        """
        if len(multipliers) <= 4:
            return multipliers, {}
        lam, tau, a, b, _, jump, force, shear, _ = multipliers
        free = pieces.signs == 0
        sticks = np.where(pieces.slip < 0, self.weight**2 * b, 0.0)
        rest = {"normal": jump + force, "signs": np.where(free, 0.0, tau), "slip": shear + sticks}
        return (lam, *(np.where(free, values, 0.0) for values in (tau, a, b))), rest

    def parts(self, y: Floats, pieces: Pieces) -> list[Floats]:
        """The multipliers of :meth:`rows` kind by kind, each from left to right."""
        either = int((pieces.signs == 0).sum())
        counts = [self._count, len(self.families[1][0]), either, either, *(at.sum() for at in pieces.zeros[:-1])]
        return np.split(y, np.cumsum(counts))

    def _of_rows(self, y: Floats, pieces: Pieces) -> tuple[Weights, list[Floats]]:
        """lambda, tau, a, b among the multipliers of :meth:`rows`, 0 for those that are not there, and the rest."""
        lam, tau, of_a, of_b, *rest = self.parts(y, pieces)
        lam = self._spread(lam)
        either = pieces.signs == 0
        a, b = np.zeros((2, len(tau)))
        a[either], b[either] = of_a, of_b
        return (lam, tau, a, b), rest

    def started(self, fixed: Floats, early: tuple[float, Floats], parent: Pieces, pieces: Pieces) -> Program:
        """The program of the least s for pieces with more signs fixed than ``parent``, from an early point of that.

        The matrix stays positive definite there: the equation of a sign takes the place of an inequality, with the same
        multiplier, and takes less.
        """
        s, y = early
        weights, squares = self._of_rows(y, parent)
        program, rest = self.program(fixed, pieces, weights, s), np.concatenate(squares)
        program.y[len(program.y) - len(rest) :] = rest
        return program

    def program(self, fixed: Floats, pieces: Pieces, multipliers: Weights, s: float = 0.0) -> Program:
        """The program of the least s that starts from some multipliers."""
        left, right, cones, y, most = self.rows(multipliers, pieces)
        free, tie = self.free, self.tie(left)
        return Program(fixed=fixed, free=free, left=left, right=right, cones=cones, most=most, s=s, y=y, tie=tie)

    def known(self, theta: float) -> Weights:
        """The multipliers that prove the factor q(theta) of the theorem in energy norms.

        ``2 theta (1 - theta)`` where the worst ratio lies inside, and more where it is r, so that r is stationary.
        """
        rho, kappa_1, _ = self.energy_bounds
        X, weight = worst_ratio(theta, *self.energy_bounds), 2 * theta * (1 - theta)
        if theta >= turning_theta(*self.energy_bounds):
            slope = 2 * X - kappa_1
            weight += max(2 * theta**2 * rho * X - weight * slope, 0.0) / (slope - math.sqrt(rho))
        return self.uniform(weight, X)

    @property
    def towards_zero(self) -> Weights:
        """Multipliers that prove the factor for theta towards 0, over theta."""
        return self.uniform(1.0, self.energy_bounds[1] / 2)

    def uniform(self, weight: float, X: float) -> Weights:
        """``lambda = tau = weight``, and a, b with ``4 a b = tau^2`` that are best at the ratio ``X = |d_1|/|d_2|``."""
        values = [weight]
        if len(self.families) > 1:
            C_s, C_t1, C_t2 = (n.value for n in self.measured.of_friction)
            alpha = (C_t1 * X + C_t2) / C_s
            values = [weight, weight, weight * alpha / 2, weight / (2 * alpha)]
        return tuple(np.full(len(a), value) for value, (a, _) in zip(values, self.families, strict=False))


def times(factor: float, multipliers: Weights) -> Weights:
    return tuple(factor * m for m in multipliers)


def mixed(share: float, one: Weights, other: Weights) -> Weights:
    return tuple(share * a + (1 - share) * b for a, b in zip(one, other, strict=True))


def inside(multipliers: Weights) -> Weights:
    """Multipliers with ``4 a b >= tau^2``, rounding included."""
    if len(multipliers) == 1:
        return multipliers
    lam, tau, a, b = multipliers
    return lam, np.minimum(tau, 2 * np.sqrt(a * b) * (1 - 1e-12)), a, b
