"""The complementarity system of both bodies on Gamma_c: its branches, Newton's method, the residual of its solution."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fem1d2d.mesh import Floats, Ints
from verification.contact.active_set import Pattern, Signs
from verification.dense import STILL, worst

#: A solution is accepted below this relative KKT residual.
TOLERANCE = 1e-11

#: Signs are read with this slack relative to the largest force or jump.
SLACK = 1e-14

#: Patterns after which Newton's method gives up, besides one for each node; it seldom needs more, or repeats itself.
LIMIT = 40

#: Sweeps before the next start of Newton's method, doubled each time, and the number of starts.
SWEEPS, RESTARTS = 10, 10

#: Number of problems with a given friction bound, and the parts of the way to its next value that the bound goes.
GIVEN, SHARES = 30, (1.0, 0.3)


class SolveError(RuntimeError):
    """The global method did not reach its KKT certificate."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Branches(Pattern):
    """The branch of each complementarity condition: the state of each node, and the sign of S lambda_N, shape (t,)."""

    threshold: Signs

    @cached_property
    def key(self) -> bytes:
        """Bytes that are equal for equal branches only."""
        return self.touching.tobytes() + self.sliding.tobytes() + self.threshold.tobytes()


class ContactSystem:
    """The complementarity system on Gamma_c.

    Parameters
    ----------
    flexibility : array, shape (t + n, t + n)
        W, symmetric positive semi-definite; zero rows where both bodies are held tangentially.
    jump : array, shape (t + n,)
        d_0, the jump without contact forces.
    friction : array, shape (t, n) or (t, t + n)
        ``w k S``: the friction bound is ``|friction lambda_N|``, or of all components of lambda.
    bound : array, shape (t,), optional
        A given friction bound instead: the Tresca problem.
    motions : array, shape (t + n, k), optional
        M: jumps of the rigid motions that only contact can hold; a column of 0 for one that it does not feel.
    resultant : array, shape (k,), optional
        The value that ``M' lambda`` must have: the work of the loads in those motions.
    """

    def __init__(
        self,
        flexibility: Floats,
        jump: Floats,
        friction: Floats,
        *,
        bound: Floats | None = None,
        motions: Floats | None = None,
        resultant: Floats | None = None,
    ) -> None:
        self.W, self.d0, self.friction, self.given = flexibility, jump, friction, bound
        self.M = np.zeros((len(jump), 0)) if motions is None else motions
        self.resultant = np.zeros(0) if resultant is None else resultant
        self.reach = float(np.abs(self.M).max(initial=0.0)) or 1.0
        self.t = len(friction)
        self.flexible = (np.diag(flexibility) > 0) | self.M.any(axis=1)
        self.linear_solves = 0

    def bound(self, force: Floats) -> Floats:
        """Friction bound on nodal forces, shape (t,)."""
        return np.abs(self._stress(force)) if self.given is None else self.given

    def _stress(self, force: Floats) -> Floats:
        """Return ``w k S lambda_N``, shape (t,)."""
        return np.asarray(self.friction @ force[-self.friction.shape[1] :])

    def jump(self, force: Floats, motion: Floats) -> Floats:
        """``d_0 - W force + M motion``."""
        return np.asarray(self.d0 - self.W @ force + self.M @ motion)

    def residual(self, force: Floats, motion: Floats) -> float:
        """Largest relative violation of a KKT condition; a pair is measured by its distance to the nearer branch."""
        t = self.t
        lengths = max(float(np.abs(part).max()) for part in (self.d0, self.W @ force, self.M @ motion))
        forces = float(np.abs(force).max())
        if lengths == 0.0:
            return 0.0 if forces == 0.0 else np.inf
        forces = forces or lengths / float(np.diag(self.W).max())
        d, f, b = self.jump(force, motion) / lengths, force / forces, self.bound(force) / forces
        active = self.flexible[:t]  # where both bodies are held no friction force is defined
        violations = [
            d[t:],
            -f[t:],
            np.minimum(np.abs(d[t:]), np.abs(f[t:])),
            (np.abs(f[:t]) - b)[active],
            np.minimum(np.abs(d[:t]), np.abs(f[:t] - b * np.sign(d[:t])))[active],
            np.abs(self.M.T @ force - self.resultant) / forces,
        ]
        return worst(np.concatenate(violations))

    @np.errstate(over="ignore", invalid="ignore", divide="ignore")
    def solve(self) -> Equilibrium:
        """Solve the system; SolveError where the certificate is not reached, as by numbers beyond the doubles."""
        found = self.newton(self.start())
        if found is None and self.given is None:
            found = self._from_given_bounds()
        force, count = np.zeros(len(self.d0)), SWEEPS
        for _ in range(RESTARTS):
            if found is not None:
                return found
            force = self._sweep(force, count)
            found = self.newton(self._branches(force))
            count *= 2
        if found is None:
            why = "" if self.M.shape[1] == 0 else "; contact alone holds a body, and the loads may pull or slide it off"
            raise SolveError(f"the global method did not reach a KKT residual of {TOLERANCE:g}{why}")
        return found

    def _from_given_bounds(self) -> Equilibrium | None:
        """Start Newton's method from problems with a given friction bound, each from the forces of the one before.

        Each of these is convex and has a solution for any friction; the bound moves part of the way where the whole way
        repeats itself.
        """
        for share in SHARES:
            bound = np.zeros(self.t)
            for _ in range(GIVEN):
                tresca = ContactSystem(
                    self.W, self.d0, self.friction, bound=bound, motions=self.M, resultant=self.resultant
                )
                try:
                    force = tresca.solve().force
                except SolveError:
                    return None
                finally:
                    self.linear_solves += tresca.linear_solves
                found = self.newton(self._branches(force))
                if found is not None:
                    return found
                bound = (1 - share) * bound + share * self.bound(force)
        return None

    def start(self) -> Branches:
        """Return branches for d_0, without contact forces, sticking; all touch if contact has to hold a body."""
        touching = self.d0[self.t :] > 0 if self.M.shape[1] == 0 else np.ones(len(self.d0) - self.t, dtype=bool)
        signs = np.ones(self.t, dtype=np.int8)
        return Branches(touching=touching, sliding=0 * signs, threshold=signs)

    def newton(self, branches: Branches) -> Equilibrium | None:
        """Solve for the branches and correct them by the signs found until they agree; None where they repeat."""
        seen: set[bytes] = set()
        for _ in range(LIMIT + len(self.d0) - self.t):
            if branches.key in seen:
                return None
            seen.add(branches.key)
            solved = self._equilibrium(branches)
            if solved is None:
                return None
            mended = self._mend(branches, *solved)
            if mended.key == branches.key:
                found = Equilibrium(force=solved[0], motion=solved[1], branches=branches)
                return found if self.residual(*solved) <= TOLERANCE else None
            branches = mended
        return None

    def _equilibrium(self, branches: Branches) -> tuple[Floats, Floats] | None:
        """Solve the linear system of branches: no jump where a node touches or sticks, its bound where it slides."""
        t = self.t
        rows = np.flatnonzero(np.concatenate([branches.sliding == 0, branches.touching]) & self.flexible)
        slides = np.flatnonzero((branches.sliding != 0) & self.flexible[:t])
        force = np.zeros(len(self.d0))
        # all forces as a linear function of those in `rows`: friction follows the normal ones by its law
        spread = np.zeros((len(self.d0), len(rows)))
        spread[rows, np.arange(len(rows))] = 1.0
        if self.given is None:
            law = (branches.sliding * branches.threshold)[slides, None] * self.friction[slides]
            spread[slides] = law @ spread[-law.shape[1] :]
            if law.shape[1] > len(force) - t:  # which has the sliding ones too
                spread[slides] = np.linalg.solve(np.eye(len(slides)) - law[:, slides], spread[slides])
        else:
            force[slides] = branches.sliding[slides] * self.given[slides]
        works = self.M.T @ spread
        matrix = np.block([[self.W[rows] @ spread, -self.M[rows]], [works, self._pins(rows, works)]])
        right = np.concatenate([(self.d0 - self.W @ force)[rows], self.resultant - self.M.T @ force])
        self.linear_solves += 1
        try:
            solved = np.linalg.solve(matrix, right) if len(right) else right
        except np.linalg.LinAlgError:
            return None
        return force + spread @ solved[: len(rows)], solved[len(rows) :]

    def _pins(self, rows: Ints, works: Floats) -> Floats:
        """Stiffness for the rigid motions that no touching or sticking node resists, nor friction that follows forces.

        It is exact: a solution exists only where the loads do no work in them.
        """
        k = self.M.shape[1]
        if not k:
            return np.zeros((0, 0))
        _, values, right = (
            np.linalg.svd(np.linalg.qr(self.M[rows], mode="r")) if len(rows) else (0, np.zeros(0), np.eye(k))
        )
        free = right[int((values > STILL * self.reach).sum()) :].T
        if not free.size or np.abs(free.T @ works).max(initial=0.0) > STILL * self.reach:
            return np.zeros((k, k))
        return np.asarray(free @ free.T) * self.reach**2 / float(np.diag(self.W).max())

    def _mend(self, branches: Branches, force: Floats, motion: Floats) -> Branches:
        """Return the branches that the signs require; a sliding node of the wrong sign goes to stick first."""
        t, bound, d = self.t, self.bound(force), self.jump(force, motion)
        weak = SLACK * max(float(np.abs(force).max()), float(bound.max(initial=0.0)))
        short = SLACK * max(float(np.abs(self.d0).max()), float(np.abs(d).max()))
        touching = np.where(branches.touching, force[t:] >= -weak, d[t:] > short)
        pushed = np.where(np.abs(force[:t]) > bound + weak, np.sign(force[:t]), 0)
        kept = np.where(branches.sliding * d[:t] >= -short, branches.sliding, 0)
        sliding = np.where(branches.sliding == 0, pushed, kept)
        smooth = np.where(branches.sliding == 0, 1, branches.sliding)  # a node whose bound is zero slides
        sliding = np.where(self.flexible[:t], np.where(bound == 0, smooth, sliding), 0)
        stress = self._stress(force)
        threshold = np.where(stress != 0, np.sign(stress), branches.threshold)
        return Branches(touching=touching, sliding=sliding.astype(np.int8), threshold=threshold.astype(np.int8))

    def _sprung(self) -> tuple[Floats, Floats]:
        """W and d_0 with soft springs on the rigid motions, for approximations: motion = c (resultant - M' force)."""
        k = self.M.shape[1]
        if k == 0:
            return self.W, self.d0
        c = 10 * float(np.diag(self.W).max()) / self.reach**2
        return self.W + c * self.M @ self.M.T, self.d0 + c * self.M @ self.resultant

    def _branches(self, force: Floats) -> Branches:
        """The nearer branch of each condition at an approximate force."""
        t, (W, d0) = self.t, self._sprung()
        trial = force + (d0 - W @ force) / np.where(self.flexible, np.diag(W), 1.0)
        slips = np.abs(trial[:t]) > self.bound(force)
        sign = np.sign(self._stress(force))
        return Branches(
            touching=trial[t:] > 0,
            sliding=np.where(slips & self.flexible[:t], np.sign(trial[:t]), 0).astype(np.int8),
            threshold=np.where(sign == 0, 1, sign).astype(np.int8),
        )

    def _sweep(self, force: Floats, count: int) -> Floats:
        """Nonlinear Gauss-Seidel sweeps, component by component; for a given bound they descend to the solution."""
        t, force, (W, d0) = self.t, force.copy(), self._sprung()
        d, diagonal = d0 - W @ force, np.diag(W)
        for _ in range(count):
            bound = self.bound(force)
            for i in np.flatnonzero(self.flexible):
                wanted = force[i] + d[i] / diagonal[i]
                wanted = max(wanted, 0.0) if i >= t else min(max(wanted, -bound[i]), bound[i])
                d -= W[:, i] * (wanted - force[i])
                force[i] = wanted
        return force


@dataclass(frozen=True, kw_only=True, eq=False)
class Equilibrium:
    """A certified solution: forces, shape (t + n,), coefficients of the rigid motions, shape (k,), and branches."""

    force: Floats
    motion: Floats
    branches: Branches
