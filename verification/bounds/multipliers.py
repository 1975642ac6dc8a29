"""The semidefinite bound: nearly the exact Lipschitz constant of T_theta, by a program whose answer is checked.

For a pair of forces let g, p be the differences of psi and of T psi, v that of the jump and zeta that of S sigma_N.
Step II gives, node by node::

    p_N v_N >= 0                                             (2.4)
    p_T v_T + w k |zeta| |v_T| >= 0                          (2.6)

and the second, times tau, implies ``tau p_T v_T + w k (a zeta^2 + b v_T^2) >= 0`` for ``4 a b >= tau^2``.  So q is a
Lipschitz constant of T_theta once the quadratic form::

    q^2 |g|^2 - |theta p + (1 - theta) g|^2 - sum_j [lambda p_N v_N + tau p_T v_T + w k (a zeta^2 + b v_T^2)]_j

in (g, p) is positive semidefinite for some multipliers lambda, tau, a, b >= 0.  The solver only proposes multipliers:
the bound is a q for which the form *with them* is positive definite, checked in doubles with a bound on their
rounding.  One set of multipliers is known in closed form, and proves the factor of the theorem in energy norms: up to
that rounding this bound is never weaker.  Proofs in ``docs/sharp.md``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve, eigvalsh, solve_triangular

from fem1d2d.mesh import Floats
from ndtheory.sharp import contraction_interval, turning_theta, worst_ratio
from verification.bounds.bound import LARGEST
from verification.bounds.program import LMIError, Program, Weights
from verification.bounds.trace_forms import TraceForms
from verification.constants import Measured
from verification.interface.pair import ContactPair
from verification.progress import Progress, silent

#: The friction threshold is searched until its bracket is this narrow, relatively.
NARROW = 1e-2

#: It is given up below this share of the threshold of the theorem in energy norms, which it should exceed.
LEAST = 1e-2

#: A value that rounding leaves undecided is moved to the safe side by these shares, from none to 1.7 %.
SHARES = (0.0, *(1e-15 * 4.0**k for k in range(23)))


@dataclass(frozen=True, kw_only=True, eq=False)
class Certified:
    """A value with the multipliers that prove it.

    Attributes
    ----------
    value : float
        What the multipliers prove, on the safe side of ``evaluated`` by a bound on the rounding of the check.
    evaluated : float
        The eigenvalue that these multipliers give in doubles.
    proposed : float
        What the solver believed to be optimal; nan where the multipliers are the known ones.
    multipliers : tuple of arrays
        lambda, tau, a, b by node; lambda alone without friction.
    gave_up : str
        Why the solver proposed nothing; empty where it did.
    """

    value: float
    evaluated: float
    proposed: float
    multipliers: Weights
    gave_up: str = ""


class QuadraticForms:
    """The quadratic forms of a pair of bodies, in coordinates in which ``|g|`` and ``|d_1|`` are Euclidean norms.

    What the solver proposes in them is checked in traces (:class:`verification.bounds.trace_forms.TraceForms`).

    Parameters
    ----------
    pair : ContactPair
        The bodies whose conditions of step II are multiplied.
    measured : Measured
        Their constants.
    friction : float, optional
        k; the problem's by default.
    nodewise : bool
        Multipliers of their own for every node, or one set for all.

    Raises
    ------
    ValueError
        A contact node is held, or there are more than :data:`verification.bounds.bound.LARGEST`.
    """

    def __init__(
        self, pair: ContactPair, measured: Measured, *, friction: float | None = None, nodewise: bool = True
    ) -> None:
        if pair.contact.grid.n > LARGEST:
            raise ValueError(f"{pair.contact.grid.n} contact nodes: worked out up to {LARGEST}")
        if pair.held:
            raise ValueError("a contact node is held: the semidefinite bound needs every one free")
        self.nodewise = nodewise
        k = float(pair.friction) if friction is None else friction
        measured = measured.with_friction(k)
        constants = measured.energy_constants()
        if constants is None:
            raise ValueError("rho does not exist: " + next(iter(measured.reason.values()), ""))
        self._measured = measured
        self._sharp = float(constants.at_work), float(constants.kappa_1), float(constants.kappa_2)
        contact, neumann, interface = pair.contact.grid, pair.neumann.grid, pair.interface
        carries = slice(0, contact.size) if k else contact.normal  # without friction p_T = 0
        # g = L_2 y and p = B z with L_2 L_2' = S_2 and B' S_1^-1 B = 1: |y| = |||g|||, |z| = |d_1|
        L_2, flexible = pair.neumann.root, pair.contact.inverse
        inner = flexible[carries, carries]
        turn = solve_triangular(np.linalg.cholesky(inner).T, np.eye(len(inner)), lower=False)
        B = np.zeros((contact.size, len(inner)))
        B[carries] = turn
        S_1 = pair.contact.stiffness if k else cho_solve(cho_factor(inner), np.eye(len(inner)))
        near = block_diag(pair.neumann.flexibility(L_2), inner @ turn)
        self._traces = TraceForms(pair, k, S_1=S_1, carries=carries, near=near)
        self.size = neumann.size
        self.g = np.hstack([np.eye(neumann.size), np.zeros((neumann.size, len(inner)))])
        back = L_2.T @ pair.neumann.flexibility(interface.carry_back(B))
        self.p = np.hstack([np.zeros((neumann.size, neumann.size)), back])
        force = np.hstack([np.zeros((contact.size, neumann.size)), B])
        jump = np.hstack([-interface.carry(pair.neumann.flexibility(L_2)), -flexible @ B])
        normal = contact.normal
        families = [(force[normal], jump[normal])]
        if k:
            assert interface.kernel is not None
            zeta = interface.kernel @ np.hstack([L_2[neumann.normal], np.zeros((neumann.n, B.shape[1]))])
            weight = np.sqrt(k * contact.weights)[:, None]
            slide = contact.tangential
            families.append((force[slide], jump[slide]))
            families += [(rows, rows) for rows in (weight * zeta, weight * jump[slide])]
        self.families = families

    def conditions(self, multipliers: Weights) -> Floats:
        """The sum over the nodes of the multiplied conditions, a symmetric matrix."""
        total = np.zeros((self.g.shape[1],) * 2)
        for values, (a, b) in zip(multipliers, self.families, strict=True):
            total += a.T @ (values[:, None] * b)
        return (total + total.T) / 2

    @property
    def _cross(self) -> Floats:
        """The form ``<g, p>``."""
        cross = self.g.T @ self.p
        return np.asarray(cross + cross.T) / 2

    def factor(self, theta: float) -> Certified:
        """The least Lipschitz constant of T_theta in the norm (5.21) that multipliers prove, for 0 < theta <= 1.

        Raises
        ------
        LMIError
        """
        step = theta * self.p + (1 - theta) * self.g
        found = self._least(
            -step.T @ step,
            self._known(theta),
            lambda value, weights: self._traces.definite(weights, square=value, step=(theta, 1 - theta)),
        )
        root = lambda square: float(np.sqrt(max(square, 0.0)))
        above = math.nextafter(root(found.value), math.inf)  # a root rounds either way; the bound must not
        return replace(found, value=above, evaluated=root(found.evaluated), proposed=root(found.proposed))

    def friction_number(self) -> Certified:
        """The least c with ``<g, p> <= c |g|^2`` that multipliers prove: every small theta contracts where c < 1.

        Raises
        ------
        LMIError
        """
        return self._least(
            -self._cross,
            self._uniform(1.0, self._sharp[1] / 2),
            lambda value, weights: self._traces.definite(weights, square=value, cross=1.0),
        )

    def largest_theta(self) -> Certified | None:
        """The largest theta <= 1 below which multipliers prove that every T_theta contracts; None where there is none.

        With q = 1 the form, over theta, is linear in theta and the multipliers: one program answers for all theta.

        Raises
        ------
        LMIError
        """
        move = self.p - self.g
        still, moving = 2 * (self.g.T @ self.g - self._cross), move.T @ move
        sharp = contraction_interval(*self._sharp, 1e-12)
        highest = 0.5 if sharp is None else sharp[1] * (1 - 1e-9)
        known = tuple(m / highest for m in self._known(highest))
        candidates, gave_up = self._candidates(still, -moving, known, maximise=True)
        found = []
        for proposed, multipliers in candidates:
            rest = still - self.conditions(multipliers)
            if not eigvalsh(rest)[0] > 0:
                continue
            theta = min(1 / float(eigvalsh(moving, rest)[-1]), 1.0)
            holds = lambda t, weights=multipliers: self._traces.definite(
                weights, square=2.0, cross=2.0, step=(1.0, -1.0), weight=t
            )
            safe = next((t for share in SHARES if holds(t := theta * (1 - share))), None)
            if safe is not None:
                found.append(
                    Certified(value=safe, evaluated=theta, proposed=proposed, multipliers=multipliers, gave_up=gave_up)
                )
        return max(found, key=lambda certified: certified.value, default=None)

    def _least(self, fixed: Floats, known: Weights, holds: Callable[[float, Weights], bool]) -> Certified:
        """The least s for which multipliers prove that ``s |g|^2 + fixed - conditions`` is positive definite."""
        candidates, gave_up = self._candidates(fixed, self.g.T @ self.g, known)
        found = []
        for proposed, multipliers in candidates:
            form, n = fixed - self.conditions(multipliers), self.size
            try:
                inner = cho_solve(cho_factor(form[n:, n:]), form[n:, :n])
            except np.linalg.LinAlgError:  # multipliers that prove nothing
                continue
            least = -float(eigvalsh(form[:n, :n] - form[:n, n:] @ inner)[0])
            size = max(abs(least), 1e-3)
            safe = next((s for share in SHARES if holds(s := least + share * size, multipliers)), None)
            if safe is not None:
                found.append(
                    Certified(value=safe, evaluated=least, proposed=proposed, multipliers=multipliers, gave_up=gave_up)
                )
        if not found:
            raise LMIError(gave_up or "no multipliers prove anything: what they leave is lost in rounding")
        return min(found, key=lambda certified: certified.value)

    def _candidates(
        self, fixed: Floats, free: Floats, known: Weights, *, maximise: bool = False
    ) -> tuple[list[tuple[float, Weights]], str]:
        """What the solver proposes, drawn towards known multipliers by several steps, and those alone.

        Where both branches of q meet, the block of d_1 is singular: multipliers a little larger are inside.  The text
        says why the solver gave up; it is empty where it did not.
        """
        alone = [(math.nan, tuple((1 + more) * m for m in known)) for more in (0.0, 1e-12, 1e-9, 1e-6)]
        try:
            proposed, multipliers = self._program.solve(fixed, free, maximise=maximise)
        except LMIError as error:
            return [(value, _inside(weights)) for value, weights in alone], str(error)
        shares = (1.0, 0.9999, 0.999, 0.99, 0.9)
        mixed = (tuple(s * a + (1 - s) * b for a, b in zip(multipliers, known, strict=True)) for s in shares)
        tried = [*((proposed, weights) for weights in mixed), *alone]
        return [(value, _inside(weights)) for value, weights in tried], ""

    def _known(self, theta: float) -> Weights:
        """The multipliers that prove the factor q(theta) of the theorem in energy norms.

        ``2 theta (1 - theta)`` where the worst ratio lies inside, and more where it is r, so that r is stationary.
        """
        rho, kappa_1, _ = self._sharp
        X, weight = worst_ratio(theta, *self._sharp), 2 * theta * (1 - theta)
        if theta >= turning_theta(*self._sharp):
            slope = 2 * X - kappa_1
            weight += max(2 * theta**2 * rho * X - weight * slope, 0.0) / (slope - math.sqrt(rho))
        return self._uniform(weight, X)

    def _uniform(self, weight: float, X: float) -> Weights:
        """``lambda = tau = weight``, and a, b with ``4 a b = tau^2`` that are best at the ratio X = |d_1|/|d_2|."""
        values = [weight]
        if len(self.families) > 1:
            C_s, C_t1, C_t2 = (n.value for n in self._measured.of_friction)
            alpha = (C_t1 * X + C_t2) / C_s
            values = [weight, weight, weight * alpha / 2, weight / (2 * alpha)]
        return tuple(np.full(len(a), value) for value, (a, _) in zip(values, self.families, strict=True))

    @cached_property
    def _program(self) -> Program:
        return Program(self.families, nodewise=self.nodewise)


def _inside(multipliers: Weights) -> Weights:
    """Multipliers of the cone ``4 a b >= tau^2``, rounding included."""
    if len(multipliers) == 1:
        return multipliers
    lam, tau, a, b = multipliers
    return lam, np.minimum(tau, 2 * np.sqrt(a * b) * (1 - 1e-15)), a, b


def friction_threshold(
    pair: ContactPair, measured: Measured, start: float, *, nodewise: bool = True, progress: Progress = silent
) -> float:
    """The friction below which every small theta is certified to contract: a bound from below, close to ``NARROW``.

    Parameters
    ----------
    pair : ContactPair
        The bodies, at any friction.
    measured : Measured
        Their constants.
    start : float
        The threshold of the theorem in energy norms, which is below it.
    progress : callable
        Told which friction is tried.

    Raises
    ------
    LMIError
    """

    def spare(k: float) -> float:
        progress(f"semidefinite bound: friction threshold, k = {k:.3g} is tried", None)
        try:
            return 1 - QuadraticForms(pair, measured, friction=k, nodewise=nodewise).friction_number().value
        except LMIError:  # nothing is proved at this friction
            return -1.0

    low, high, k = 0.0, float("inf"), start
    while high - low > NARROW * high or high == float("inf"):
        if high < LEAST * start:
            raise LMIError(f"no friction above {high:.1e} leaves multipliers that prove anything")
        left = spare(k)
        if left > 0:
            low = k
        else:
            high = k
        guess = k / max(1 - left, 1e-3)  # c grows about linearly with k
        inside = 0.3 * NARROW * guess
        k = guess + inside if left > 0 else guess - inside
        if not low < k < high:
            k = (low + high) / 2
    return low
