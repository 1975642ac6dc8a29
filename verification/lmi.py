"""The semidefinite edition: nearly the exact Lipschitz constant of T_theta, by a program whose answer is checked.

For a pair of forces let g, p be the differences of psi and of T psi, v that of the jump and zeta that of S sigma_N.
Step II gives, node by node::

    p_N v_N >= 0                                             (2.4)
    p_T v_T + w k |zeta| |v_T| >= 0                          (2.6)

and the second, times tau, implies ``tau p_T v_T + w k (a zeta^2 + b v_T^2) >= 0`` for ``4 a b >= tau^2``.  So q is a
Lipschitz constant of T_theta once the quadratic form::

    q^2 |g|^2 - |theta p + (1 - theta) g|^2 - sum_j [lambda p_N v_N + tau p_T v_T + w k (a zeta^2 + b v_T^2)]_j

in (g, p) is positive semidefinite for some multipliers lambda, tau, a, b >= 0.  The solver only proposes multipliers:
the bound is the least q for which the form *with them* is positive semidefinite, an eigenvalue.  One set of multipliers
is known in closed form, and proves the factor of the theorem in energy norms: this edition is never weaker.  Proofs in
``docs/sharp.md``.
"""

from __future__ import annotations

import contextlib
import math
import warnings
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cvxpy as cp
import numpy as np
from scipy.linalg import cho_factor, cho_solve, eigvalsh, solve_triangular

from fem1d2d.mesh import Floats
from ndtheory import Number
from ndtheory.sharp import contraction_interval, turning_theta, worst_ratio
from verification.measured import Measured
from verification.pair import Pair
from verification.threads import one_thread

#: Rows of the form up to which Clarabel is as fast as SCS; its work grows with the sixth power of them.
SMALL = 40

#: Accuracy asked of SCS; the certificate decides what is reported.
TOLERANCE = 1e-4

#: Beyond this a program takes minutes.
MOST_NODES = 40

#: The friction threshold is searched until its bracket is this narrow, relatively.
NARROW = 1e-2


class LMIError(RuntimeError):
    """The solver proposed no multipliers that certify anything."""


Weights = tuple[Floats, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Certified:
    """A value with the multipliers that prove it, up to rounding.

    Attributes
    ----------
    value : float
        What the multipliers prove.
    proposed : float
        What the solver believed to be optimal.
    multipliers : tuple of arrays
        lambda, tau, a, b by node; lambda alone without friction.
    """

    value: float
    proposed: float
    multipliers: Weights


class SemidefiniteEdition:
    """The quadratic forms of a pair of bodies, in coordinates in which ``|g|`` and ``|d_1|`` are Euclidean norms.

    Parameters
    ----------
    pair : Pair
    measured : Measured
        Its constants.
    friction : float, optional
        k; the problem's by default.
    nodewise : bool
        Multipliers of their own for every node, or one set for all.

    Raises
    ------
    ValueError
        A contact node is held, or there are more than ``MOST_NODES``.
    """

    def __init__(self, pair: Pair, measured: Measured, *, friction: float | None = None, nodewise: bool = True) -> None:
        if pair.n > MOST_NODES:
            raise ValueError(f"{pair.n} contact nodes: the semidefinite edition takes at most {MOST_NODES}")
        if not all(body.unknown.all() for body in pair.elastic):
            raise ValueError("a contact node is held: the semidefinite edition needs every one free")
        self.nodewise = nodewise
        k = float(pair.problem.contact.friction) if friction is None else friction
        measured = measured.with_friction(k)
        constants = measured.energy_constants()
        if constants is None:
            raise ValueError("rho does not exist: " + next(iter(measured.reason.values()), ""))
        self._measured = measured
        self._sharp = float(constants.at_work), float(constants.kappa_1), float(constants.kappa_2)
        size, normal = pair.normal.stop, pair.normal
        carries = slice(0, size) if k else normal  # without friction p_T = 0
        # g = L_2 y and p = B z with L_2 L_2' = S_2 and B' S_1^-1 B = 1: |y| = |||g|||, |z| = |d_1|
        L_2, flexible = pair.neumann.root, pair.contact.inverse
        root = np.linalg.cholesky(flexible[carries, carries])
        B = np.zeros((size, len(root)))
        B[carries] = solve_triangular(root.T, np.eye(len(root)), lower=False)
        self.size = size
        self.g = np.hstack([np.eye(size), np.zeros(B.shape)])
        self.p = np.hstack([np.zeros((size, size)), L_2.T @ pair.neumann.flexibility(B)])
        force = np.hstack([np.zeros((size, size)), B])
        jump = np.hstack([-pair.neumann.flexibility(L_2), -flexible @ B])
        families = [(force[normal], jump[normal])]
        if k:
            assert pair.regularisation is not None
            zeta = pair.regularisation @ np.hstack([L_2[normal], np.zeros((pair.n, B.shape[1]))])
            weight = np.sqrt(k * pair.weights)[:, None]
            slide = pair.tangential
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
        """The least certified Lipschitz constant of T_theta in the norm (5.21), for 0 < theta <= 1.

        Raises
        ------
        LMIError
        """
        step = theta * self.p + (1 - theta) * self.g
        found = self._least(-step.T @ step, self._known(theta))
        root = lambda square: float(np.sqrt(max(square, 0.0)))
        return Certified(value=root(found.value), proposed=root(found.proposed), multipliers=found.multipliers)

    def friction_number(self) -> Certified:
        """The least certified c with ``<g, p> <= c |g|^2``: every small theta contracts where c < 1.

        Raises
        ------
        LMIError
        """
        return self._least(-self._cross, self._uniform(1.0, self._sharp[1] / 2))

    def largest_theta(self) -> Certified | None:
        """The largest certified theta <= 1 below which every T_theta contracts; None where there is none.

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
        best = None
        for proposed, multipliers in self._candidates(still, -moving, known, maximise=True):
            rest = still - self.conditions(multipliers)
            if not eigvalsh(rest)[0] > 0:
                continue
            theta = min(1 / float(eigvalsh(moving, rest)[-1]), 1.0)
            if best is None or theta > best.value:
                best = Certified(value=theta, proposed=proposed, multipliers=multipliers)
        return best

    def _least(self, fixed: Floats, known: tuple[Floats, ...]) -> Certified:
        """The least s for which ``s |g|^2 + fixed - conditions`` is positive semidefinite, certified."""
        found = []
        for proposed, multipliers in self._candidates(fixed, self.g.T @ self.g, known):
            form, n = fixed - self.conditions(multipliers), self.size
            with contextlib.suppress(np.linalg.LinAlgError):  # multipliers that certify nothing
                inner = cho_solve(cho_factor(form[n:, n:]), form[n:, :n])
                value = -float(eigvalsh(form[:n, :n] - form[:n, n:] @ inner)[0])
                found.append(Certified(value=value, proposed=proposed, multipliers=multipliers))
        if not found:
            raise LMIError("no multipliers certify anything")
        return min(found, key=lambda certified: certified.value)

    def _candidates(
        self, fixed: Floats, free: Floats, known: Weights, *, maximise: bool = False
    ) -> list[tuple[float, Weights]]:
        """What the solver proposes, drawn towards known multipliers by several steps, and those alone.

        Where both branches of q meet, the block of d_1 is singular: multipliers a little larger are inside.
        """
        alone = [(math.nan, tuple((1 + more) * m for m in known)) for more in (0.0, 1e-12, 1e-9, 1e-6)]
        try:
            proposed, multipliers = self._program.solve(fixed, free, maximise=maximise)
        except LMIError:
            return alone
        shares = (1.0, 0.9999, 0.999, 0.99, 0.9)
        mixed = (tuple(s * a + (1 - s) * b for a, b in zip(multipliers, known, strict=True)) for s in shares)
        return [*((proposed, weights) for weights in mixed), *alone]

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
    def _program(self) -> _Program:
        return _Program(self)


class _Program:
    """``fixed + s free - conditions`` positive semidefinite, in s and the multipliers, as cvxpy sees it."""

    def __init__(self, edition: SemidefiniteEdition) -> None:
        self._families = edition.families
        lengths = [np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1) for a, b in edition.families]
        if not edition.nodewise:
            lengths = [np.full_like(scale, scale.mean()) for scale in lengths]
        self._scales = lengths  # the solver sees numbers near one in any unit
        self._nodewise = edition.nodewise
        self._variables = [cp.Variable(len(s) if edition.nodewise else 1, nonneg=True) for s in lengths]

    def solve(self, fixed: Floats, free: Floats, *, maximise: bool = False) -> tuple[float, tuple[Floats, ...]]:
        """The least s (or the largest, at most 1), and multipliers with ``4 a b >= tau^2``.

        Raises
        ------
        LMIError
        """
        s = cp.Variable()
        total: Any = fixed.ravel() + s * free.ravel()
        for variable, scale, (a, b) in zip(self._variables, self._scales, self._families, strict=True):
            forms = a[:, :, None] * b[:, None, :]
            forms = (forms + forms.transpose(0, 2, 1)).reshape(len(scale), -1).T / (2 * scale)
            total = total - (forms if self._nodewise else forms.sum(axis=1, keepdims=True)) @ variable
        size = len(fixed)
        constraints = [cp.reshape(total, (size, size), order="C") >> 0]
        if len(self._variables) > 1:
            tau, a, b = self._variables[1:]
            ratio = np.sqrt(self._scales[2] * self._scales[3]) / self._scales[1]
            for j in range(tau.size):
                constraints.append(cp.SOC(a[j] + b[j], cp.hstack([ratio[j] * tau[j], a[j] - b[j]])))
        problem = (
            cp.Problem(cp.Maximize(s), [*constraints, s <= 1]) if maximise else cp.Problem(cp.Minimize(s), constraints)
        )
        with warnings.catch_warnings(), one_thread():
            warnings.simplefilter("ignore")  # "may be inaccurate": the certificate decides
            try:
                if size <= SMALL:
                    problem.solve(solver=cp.CLARABEL)
                else:
                    problem.solve(solver=cp.SCS, eps=TOLERANCE, max_iters=20_000)
            except cp.SolverError as error:
                raise LMIError(f"the solver failed: {error}") from None
        if s.value is None:
            raise LMIError(f"the solver found no multipliers: {problem.status}")
        values = [np.maximum(np.asarray(v.value), 0.0) / z for v, z in zip(self._variables, self._scales, strict=True)]
        if len(values) > 1:
            values[1] = np.minimum(values[1], 2 * np.sqrt(values[2] * values[3]))
        return float(s.value), tuple(values)


def friction_threshold(pair: Pair, measured: Measured, start: float, *, nodewise: bool = True) -> float:
    """The friction below which every small theta is certified to contract: a bound from below, close to ``NARROW``.

    Parameters
    ----------
    pair : Pair
    measured : Measured
    start : float
        The threshold of the theorem in energy norms, which is below it.

    Raises
    ------
    LMIError
    """

    def spare(k: float) -> float:
        return 1 - SemidefiniteEdition(pair, measured, friction=k, nodewise=nodewise).friction_number().value

    low, high, k = 0.0, float("inf"), start
    while high - low > NARROW * high or high == float("inf"):
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


@dataclass(frozen=True, kw_only=True)
class Semidefinite:
    """What the semidefinite edition says of a pair of bodies at one theta.

    Attributes
    ----------
    lipschitz : Number
        A certified Lipschitz constant of T_theta in the norm (5.21).
    theta_max : Number or None
        Every smaller theta contracts; None where none is certified.
    friction_threshold : Number or None
        Every small theta contracts below it; None without a law of friction.
    """

    lipschitz: Number
    theta_max: Number | None
    friction_threshold: Number | None

    @property
    def factor(self) -> Number | None:
        """The Lipschitz constant where it is a contraction factor."""
        return self.lipschitz if self.lipschitz.value < 1 else None

    def to_dict(self) -> dict[str, Any]:
        """The object ``lmi`` of ``ndtheory.compare/1``; every value was certified with the returned multipliers."""
        numbers = {
            "factor": self.factor,
            "lipschitz": self.lipschitz,
            "theta_max": self.theta_max,
            "friction_threshold": self.friction_threshold,
        }
        reasons = {
            "factor": f"Lipschitz constant {self.lipschitz.value:.4g} >= 1: no conclusion",
            "theta_max": "no theta is certified at this friction",
            "friction_threshold": "no law of friction",
        }
        return {
            **{name: None if number is None else number.to_dict() for name, number in numbers.items()},
            "certified": True,
            "reason": {name: reasons[name] for name, number in numbers.items() if number is None},
        }


def evaluate_lmi(pair: Pair, measured: Measured, theta: float) -> Semidefinite:
    """The semidefinite edition for the problem's friction.

    Parameters
    ----------
    pair : Pair
    measured : Measured
    theta : float

    Raises
    ------
    LMIError
    ValueError
        As :class:`SemidefiniteEdition`.
    """
    edition = SemidefiniteEdition(pair, measured)
    largest = edition.largest_theta()
    sharp = measured.friction_threshold
    allowed = None if sharp is None else friction_threshold(pair, measured, sharp.value)
    return Semidefinite(
        lipschitz=Number.of_float(edition.factor(theta).value),
        theta_max=None if largest is None else Number.of_float(largest.value),
        friction_threshold=None if allowed is None else Number.of_float(allowed),
    )
