"""The semidefinite bound: nearly the exact Lipschitz constant of T_theta, by a program whose answer is checked.

For a pair of forces let g, p, v and zeta be the differences of psi, T psi, the jump and S sigma_N.
Step II gives, node by node::

    p_N v_N >= 0                                             (2.4)
    p_T v_T + w k |zeta| |v_T| >= 0                          (2.6)

and the second, times tau, implies ``tau p_T v_T + w k (a zeta^2 + b v_T^2) >= 0`` for ``4 a b >= tau^2``.  So q is a
Lipschitz constant of T_theta once the quadratic form::

    q^2 |g|^2 - |theta p + (1 - theta) g|^2 - sum_j [lambda p_N v_N + tau p_T v_T + w k (a zeta^2 + b v_T^2)]_j

in (g, p) is positive semidefinite for some multipliers lambda, tau, a, b >= 0.  The solver only proposes multipliers:
the bound is a q for which the form *with them* is positive definite, checked in doubles with a bound on their
rounding.  One set of multipliers is known in closed form, and proves the factor of the theorem in energy norms: up to
that rounding this bound is never weaker.  Proofs in ``docs/energy.md``.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve, eigvalsh

from fem1d2d.mesh import Floats
from ndtheory.energy_norms import contraction_interval
from verification.constants import Measured
from verification.interface.pair import ContactPair
from verification.machine.progress import Progress, silent
from verification.machine.threads import one_thread
from verification.semidefinite import LMIError, interior_point
from verification.semidefinite.conditions import Conditions, Pieces, inside, mixed, times
from verification.semidefinite.interior_point import USUAL, Optimum, Program, Stop, Weights
from verification.semidefinite.mirror import Mirror

#: The friction threshold is searched until its bracket is this narrow, relatively.
NARROW = 1e-2

#: It is given up below this share of the threshold of the theorem in energy norms, which it should exceed.
LEAST = 1e-2

#: So many of them are tried one by one, before the rest is bisected.
ENOUGH = 3

#: How much larger than where another friction leaves it the value of a program begins, relatively.
NEARBY = 0.1

Start = tuple[float, Weights]

#: Shares of a solver's proposal, the rest known multipliers, that are tried one after the other.
DRAWN = (1.0, 0.9999, 0.999, 0.99, 0.9)

#: By how much a is larger and b smaller than known, from one start to the next, until one is inside.
STRETCHES = (1.0, 2.0, 4.0, 16.0, 256.0)

#: The share of the largest tau that a and b allow with which a program starts.
INSIDE = 0.95

#: How much larger known multipliers are tried.
MORE = (0.0, 1e-12, 1e-9, 1e-6)

#: What rounding may cost, relatively, before other multipliers are tried.
TIGHT = 1e-10

#: A value that rounding leaves undecided is moved to the safe side by these shares, to at most 0.9 %.
SHARES = tuple(1e-11 * 2.0**k for k in range(31))


@dataclass(frozen=True, kw_only=True, eq=False)
class Certified:
    """A value with the multipliers that prove it.

    ``value`` is proved by the multipliers, on the safe side of ``evaluated``, the eigenvalue that they give in doubles,
    by a bound on the rounding of the check; ``proposed`` is the solver's optimum, nan where the multipliers are the
    known ones.  ``multipliers`` are lambda, tau, a, b by node, only lambda without friction.  ``gave_up`` says why the
    solver proposed nothing; empty where it did.  ``early`` is the value with lambda, tau, k a, k b far from the end of
    the central path: a start for a friction nearby.
    """

    value: float
    evaluated: float
    proposed: float
    multipliers: Weights
    gave_up: str = ""
    early: Start | None = None


class QuadraticForms(Conditions):
    """Proofs by multipliers for a pair of bodies: see the head of this module.

    Parameters
    ----------
    pair, measured, friction
        As for :class:`verification.semidefinite.conditions.Conditions`.
    solver : callable, optional
        Program -> Optimum, whose proposals are checked; :func:`verification.semidefinite.interior_point.solve` by
        default.
    """

    def __init__(
        self,
        pair: ContactPair,
        measured: Measured,
        *,
        friction: float | None = None,
        solver: Callable[[Program], Optimum] | None = None,
    ) -> None:
        super().__init__(pair, measured, friction=friction)
        self._solver = interior_point.solve if solver is None else solver
        self.mirror = Mirror.of(pair, self)

    def factor(self, theta: float) -> Certified:
        """The least Lipschitz constant of T_theta in the norm (5.21) that multipliers prove, for 0 < theta <= 1.

        LMIError where none do.
        """
        return self.on(self.everywhere, theta)[0]

    @property
    def everywhere(self) -> Pieces:
        """All pieces of T."""
        return Pieces.all(len(self.families[0][0]), len(self.families[1][0]) if len(self.families) > 1 else 0)

    @one_thread()
    def on(
        self, pieces: Pieces, theta: float, *, stop: Stop = USUAL, parent: tuple[Pieces, Optimum] | None = None
    ) -> tuple[Certified, Optimum | None]:
        """The same for some of the affine pieces of T, with the solver's proposal; None where it gave up.

        ``stop`` is for the program, whose s is the square of the constant.  ``parent`` is a set of which these are the
        pieces with more signs fixed, and its proposal: a start that saves half of the steps on Section 6.  LMIError
        where no multipliers prove anything.
        """
        fixed, start = self.fixed(theta), None
        if parent is not None and parent[1].early is not None:
            start = self.started(fixed, parent[1].early, parent[0], pieces)
        holds = lambda weights: self.traces.with_multipliers(weights, step=(theta, 1 - theta))
        found, proposal = self._least(fixed, self.known(theta), theta, holds, pieces, stop, start)
        return _root(found), proposal

    @one_thread()
    def proved_by(self, multipliers: Weights, theta: float) -> Certified | None:
        """The least Lipschitz constant of T_theta on some pieces that given multipliers prove; None if they do not."""
        evaluated = self._least_value(self.fixed(theta) - self.conditions(multipliers))
        if evaluated is None:
            return None
        holds = self.traces.with_multipliers(multipliers, step=(theta, 1 - theta))
        safe = on_the_safe_side(evaluated, holds)
        if safe is None:
            return None
        return _root(Certified(value=safe, evaluated=evaluated, proposed=math.nan, multipliers=multipliers))

    @one_thread()
    def friction_number(self, near: Start | None = None, *, stop: Stop = USUAL) -> Certified:
        """The least c with ``<g, p> <= c |g|^2`` that multipliers prove: every small theta contracts where c < 1.

        ``near`` is from the friction number at a friction nearby.  LMIError where none do.
        """
        holds = lambda weights: self.traces.with_multipliers(weights, cross=1.0)
        fixed, start = -self.cross, None
        if near is not None:
            start = self.program(fixed, self.everywhere, self._from(near), (1 + NEARBY) * near[0])
        found, proposal = self._least(fixed, self.towards_zero, 1.0, holds, self.everywhere, stop, start)
        return replace(found, early=self._early(proposal))

    def _from(self, near: Start) -> Weights:
        """The multipliers of a start at another friction; of a larger one they leave the form as definite as there."""
        lam, tau, a, b = near[1]
        a, b = a / self.k, b / self.k
        return lam, np.minimum(tau, 2 * INSIDE * np.sqrt(a * b)), a, b

    def _early(self, proposal: Optimum | None) -> Start | None:
        """A start from a solver's answer for all pieces; None where it has none, and without friction."""
        if proposal is None or proposal.early is None or not self.k:
            return None
        lam, tau, a, b = self.parts(proposal.early[1], self.everywhere)[:4]
        return proposal.early[0], (lam, tau, self.k * a, self.k * b)

    @one_thread()
    def largest_theta(self, near: Start | None = None) -> Certified | None:
        """The largest theta <= 1 below which multipliers prove that every T_theta contracts; None where there is none.

        With q = 1 the form, over theta, is linear in theta and the multipliers: one program answers for all theta. The
        program of the friction number says whether there is any, and starts it, unless ``near`` does: from the largest
        theta at a larger friction, whose multipliers prove as much here.  LMIError where the solver ends without an
        answer.
        """
        move = self.p - self.g
        still, moving = 2 * (self.free - self.cross), self.inner(move, move)
        proposals: list[tuple[float, Weights]] = []
        early = None
        try:
            if near is not None:
                start: Program | None = self.program(still, self.everywhere, self._from(near), near[0])
            else:
                below = self._program(-self.cross, self.towards_zero, 1.0, self.everywhere)
                found = self._solved(replace(below, stop=Stop(enough=1.0)))
                start = replace(below, s=0.0, y=2 * found.y) if found.s < 1 else None
            if start is not None:
                found = self._solved(replace(start, fixed=still, free=-moving, highest=1.01))
                if near is not None and not found.converged:
                    return self.largest_theta()
                proposals.append((found.s, self.by_node(found.y, self.everywhere)))
                early = self._early(found)
        except LMIError:  # the known multipliers may still prove something
            if near is not None:
                return self.largest_theta()
        energy = contraction_interval(*self.energy_bounds, 1e-12)
        if energy is not None:
            highest = energy[1] * (1 - 1e-9)
            proposals += [(math.nan, inside(times((1 + more) / highest, self.known(highest)))) for more in MORE]
        best = None
        for proposed, multipliers in proposals:
            least = 0.0 if best is None else best.value
            checked = self._check_theta(still - self.conditions(multipliers), moving, multipliers, least)
            if checked is None:
                continue
            safe, theta = (min(value, 1.0) for value in checked)
            if best is None or safe > best.value:
                best = Certified(value=safe, evaluated=theta, proposed=proposed, multipliers=multipliers, early=early)
        return best

    def _check_theta(
        self, rest: Floats, moving: Floats, multipliers: Weights, least: float
    ) -> tuple[float, float] | None:
        """The largest theta with ``rest - theta moving`` definite, on the safe side of rounding, and as evaluated.

        None where it is not proved, or cannot be above ``least``, which is at most 1.
        """
        if not eigvalsh(rest)[0] > 0:
            return None
        theta = 1 / float(eigvalsh(moving, rest)[-1])
        if min(theta, 1.0) <= least:
            return None
        definite = self.traces.with_multipliers(multipliers, cross=2.0, step=(1.0, -1.0))
        share = _least_share(lambda share: definite(2.0, theta * (1 - share)))
        return None if share is None else (theta * (1 - share), theta)

    def _least(
        self,
        fixed: Floats,
        known: Weights,
        theta: float,
        holds: Callable[[Weights], Callable[[float], bool]],
        pieces: Pieces,
        stop: Stop = USUAL,
        start: Program | None = None,
    ) -> tuple[Certified, Optimum | None]:
        """The least s for which multipliers prove that ``s |g|^2 + fixed - conditions`` is positive definite.

        What the solver proposes is drawn towards the known multipliers where rounding would cost something; where both
        branches of q meet, known ones a little larger are inside.
        """
        proposal, gave_up = None, ""
        drawn: list[Weights] = []
        try:
            proposal = self._proposed(fixed, known, theta, pieces, stop, start)
            found, towards = self.by_node(proposal.y, pieces), self.by_node(self.rows(known, pieces)[3], pieces)
            drawn = [mixed(share, found, towards) for share in DRAWN]
        except LMIError as error:
            gave_up = str(error)
        believed = math.nan if proposal is None else proposal.s
        tried = ((believed, drawn), (math.nan, [inside(times(1 + more, known)) for more in MORE]))
        best = None
        for proposed, candidates in tried:
            for multipliers in candidates:
                evaluated = self._least_value(fixed - self.conditions(multipliers))
                if evaluated is None:
                    continue
                if best is not None and evaluated >= best.value:  # nor do the others prove more: s is convex in them
                    break
                safe = on_the_safe_side(evaluated, holds(multipliers))
                if safe is None:
                    continue
                if best is None or safe < best.value:
                    best = Certified(
                        value=safe, evaluated=evaluated, proposed=proposed, multipliers=multipliers, gave_up=gave_up
                    )
                if safe <= evaluated + TIGHT * abs(evaluated):  # rounding costs nothing that others could save
                    break
        if best is None:
            raise LMIError(gave_up or "no multipliers prove anything: what they leave is lost in rounding")
        return best, proposal

    def _proposed(
        self, fixed: Floats, known: Weights, theta: float, pieces: Pieces, stop: Stop, start: Program | None
    ) -> Optimum:
        """The solver's proposal, from a start that is near its end, else from known multipliers.

        LMIError where it gives up.
        """
        if start is not None:
            try:
                found = self._solved(replace(start, stop=stop), pieces)
                if found.converged or found.s < stop.enough:
                    return found
            except LMIError:
                pass
        return self._solved(replace(self._program(fixed, known, theta, pieces), stop=stop), pieces)

    def _solved(self, program: Program, pieces: Pieces | None = None) -> Optimum:
        """The solver's answer for some pieces, all by default: by halves where a reflection leaves them the same."""
        if self.mirror is None or (pieces is not None and pieces.any):
            return self._solver(program)
        return self.mirror.solved(program, self._solver)

    def _least_value(self, form: Floats) -> float | None:
        """The least s for which ``s |g|^2 + form`` is positive semidefinite; None where the part of d_1 is not."""
        n = self.size
        try:
            inner = cho_solve(cho_factor(form[n:, n:]), form[n:, :n])
        except np.linalg.LinAlgError:
            return None
        return -float(eigvalsh(form[:n, :n] - form[:n, n:] @ inner)[0])

    def _program(self, fixed: Floats, known: Weights, theta: float, pieces: Pieces) -> Program:
        """The program of the least s; it starts from known multipliers that are moved inside the cone.

        LMIError where none are inside.
        """
        start = [2 * m + theta / 10 * more for m, more in zip(known, self.towards_zero, strict=True)]
        for stretch in STRETCHES if len(start) > 1 else STRETCHES[:1]:
            if len(start) > 1:  # the less b, the more is left to d_1
                lam, tau, a, b = start
                start = [lam, INSIDE * tau, stretch * a, b / stretch]
            program = self.program(fixed, pieces, tuple(start))
            least = self._least_value(fixed - self.conditions(self.by_node(program.y, pieces)))
            if least is not None:
                return replace(program, s=least + max(1.0, abs(least)))
        raise LMIError("the multipliers to start from are lost in rounding")


def _root(found: Certified) -> Certified:
    """A bound of a square as one of what is squared."""
    root = lambda square: float(np.sqrt(max(square, 0.0)))
    above = math.nextafter(root(found.value), math.inf)  # a root rounds either way; the bound must not
    return replace(found, value=above, evaluated=root(found.evaluated), proposed=root(found.proposed))


def on_the_safe_side(least: float, holds: Callable[[float], bool]) -> float | None:
    """The least s that multipliers prove, from what they give in doubles; None if there is none."""
    size = max(abs(least), 1e-3)
    share = _least_share(lambda share: holds(least + share * size))
    return None if share is None else least + share * size


def _least_share(holds: Callable[[float], bool]) -> float | None:
    """The first of :data:`SHARES` for which something holds that then holds for all larger ones; None without one."""
    for share in SHARES[:ENOUGH]:
        if holds(share):
            return share
    first = bisect_left(SHARES, True, lo=ENOUGH, key=holds)
    return SHARES[first] if first < len(SHARES) else None


def friction_threshold(pair: ContactPair, measured: Measured, start: float, *, progress: Progress = silent) -> float:
    """The friction below which every small theta is certified to contract: a bound from below, close to ``NARROW``.

    ``start`` is the threshold of the theorem in energy norms, which is below it.  LMIError where it would be below
    LEAST of that.
    """

    near: Start | None = None

    def spare(k: float) -> float:
        nonlocal near
        progress(f"semidefinite bound: friction threshold, k = {k:.3g} is tried", None)
        try:
            found = QuadraticForms(pair, measured, friction=k).friction_number(near, stop=Stop(accuracy=NARROW / 10))
        except LMIError:  # nothing is proved at this friction
            return math.nan
        near = found.early
        return 1 - found.value

    left, low, high, k = {0.0: 1.0, math.inf: math.nan}, 0.0, math.inf, start
    while not (
        high - low <= NARROW * high < math.inf
        or (high < 1.1 * low and (high - low) * left[low] <= NARROW * low * (left[low] - left[high]))  # by the chord
    ):
        if high < LEAST * start:
            raise LMIError(f"no friction above {high:.1e} leaves multipliers that prove anything")
        left[k] = spare(k)
        if left[k] > 0:
            low = k
        else:
            high = k
        guess = k / max(1 - left[k], 1e-3)  # c grows about linearly with k
        inside = 0.3 * NARROW * guess
        k = guess + inside if k == low else guess - inside
        if not low < k < high:
            k = (low + high) / 2
    return low
