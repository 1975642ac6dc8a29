"""Two solvers of any kind driven to one force: from a force to a displacement, and from a displacement to a force."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem1d2d.mesh import Floats
from ndtheory.constants import take
from verification.algorithm.loop import Ending, Evaluation, Outcome, evaluations, follow
from verification.algorithm.relaxation import InverseStep, Rule, rule_of
from verification.coupling.advice import Advice
from verification.coupling.kinds import kind_of
from verification.coupling.spectrum import Spectrum
from verification.coupling.vectors import DOUBLE, bears, last_piece, seen_in
from verification.interface.matrices import real_array
from verification.value import Value

#: The factor of the first step where none is given.
FIRST = Fraction(1, 2)

#: Number of iterates, with their images, from which eigenvalues are read: the last ones, and where nothing opens the
#: first FIRST_ONES too, in which the modes are that have died out since.
REMEMBERED, FIRST_ONES = 20, 10

#: Numbers beyond this end a coupling: it has diverged.
FAR_AWAY = 1e50

#: Number of steps over which the pace of the residual is measured.
PACE = 4

#: The steps in which a residual that has run away has grown, too: the first one may lie next to a solution of before.
GROWING = 3

Solver = Callable[[Floats], Any]


class _RunAway(Exception):
    """Numbers beyond FAR_AWAY: the coupling has diverged."""


class CouplingError(RuntimeError):
    """A solver returned something other than a vector of finite numbers."""


class Coupling:
    """The next force of a coupling whose loop is yours, and what its vectors show.

    In *parallel* coupling its vectors have both fields, first the force, then the displacement, of one length.  Each
    is measured by its first residual above 0, so that no unit counts.

    In a loop over time call :meth:`new_step` at the start of each step, and :meth:`see` for the last evaluation of it.
    It may be copied and pickled, for restarts and for steps in time that are tried again.

    Parameters
    ----------
    rule : {'constant', 'aitken', 'anderson', 'iqn-ils'} or Rule
        One that works on vectors.
    theta : number, optional
        The constant factor, or the first one, 0 < theta <= 1, and up to 100 of kind general; by default 1/2.
    kind : {'contact', 'tied', 'general'}
        Kind of the coupling; contact has zeros where nodes are open, general may have positive feedback.
    parallel : bool
        True if both solvers run at once, each on the old data of the other.
    reuse : int
        Steps in time whose changes IQN-ILS uses again in the next one, if they show what newer ones do not.
    absolute : float
        :attr:`arrived` is True as well where ``|Tg - g| <= absolute``.
    tolerance : float
        :attr:`arrived` is True where ``|Tg - g| <= tolerance |Tg|``, of each field.

    Raises
    ------
    ValueError
        The rule is unknown or needs both bodies, the kind is unknown, or a number is outside its range.

    Examples
    --------
    >>> coupling, g = Coupling(rule="aitken", theta=0.5), np.zeros(2)
    >>> for _ in range(9):
    ...     Tg = 1 - np.array([0.5, 3.0]) * (g - 1)
    ...     g = coupling.next(g, Tg)
    >>> round(coupling.spectrum.low, 6), round(coupling.spectrum.high, 6), coupling.advice.theta
    (0.5, 3.0, 0.3592)
    """

    def __init__(
        self,
        rule: Rule | str = "iqn-ils",
        theta: float | Fraction | str | None = None,
        *,
        kind: str = "contact",
        parallel: bool = False,
        absolute: float = 0.0,
        tolerance: float = 1e-6,
        reuse: int = 0,
    ) -> None:
        self.rule, self.kind = rule_of(rule), kind_of(kind, parallel=parallel)
        needed, most = f"the relaxation factor, {self.kind.thetas}", self.kind.longest
        self.theta = float(FIRST if theta is None else take("theta", theta, needed, lambda value: 0 < value <= most))
        self.tolerance = float(take("tolerance", tolerance, "a number > 0", lambda value: value > 0))
        self.absolute = float(take("absolute", absolute, "a number >= 0", lambda value: value >= 0))
        self.reuse = int(take("reuse", reuse, "a whole number >= 0", lambda value: 0 <= value == int(value)))
        self._following = self.rule.on_vectors(self.theta)
        self._scale: Floats | None = None
        self._seen: list[tuple[Floats, Floats, bool]] = []
        self._changed = False  # whether contact did, between evaluations that are forgotten
        self._bore: NDArray[np.bool_] | None = None  # the entries that were not 0 in one of these
        self._anew = True
        self._advice: Advice | None = None

    def __copy__(self) -> Coupling:
        """Independent, as by :func:`copy.deepcopy`."""
        return copy.deepcopy(self)

    def next(self, g: Any, Tg: Any) -> Floats:
        """The force with which T is evaluated next.

        Parameters
        ----------
        g : array, shape (n,), or number
            The force of this evaluation: the one that was returned before, or any other; in parallel coupling with the
            displacement behind it, shape (2 n,).
        Tg : array, shape (n,), or number
            What the contact body answered, not relaxed; in parallel coupling what it answered to that displacement,
            and behind it what the Neumann body answered to that force.

        Raises
        ------
        ValueError
            Other shapes, or numbers that are not finite.
        """
        self.see(g, Tg)
        return self.relaxed(*self._seen[-1][:2])

    def relaxed(self, g: Floats, Tg: Floats) -> Floats:
        """The next force after an evaluation that was taken in."""
        if not self.kind.parallel:
            return self._following(g, Tg)
        if self._scale is None:  # a field has not moved yet
            return g + self.theta * (Tg - g)
        return self._following(g / self._scale, Tg / self._scale) * self._scale

    @property
    def size(self) -> float:
        """``|Tg - g|`` of the last evaluation; of parallel coupling over its first size, which is 1."""
        g, Tg, _ = self._seen[-1]
        if self.kind.parallel and self._scale is None:
            return 1.0
        return float(np.linalg.norm((Tg - g) / (1.0 if self._scale is None else self._scale)))

    @property
    def _fields(self) -> list[tuple[float, float]]:
        """``|Tg - g|`` and ``|Tg|`` of each field in the last evaluation."""
        g, Tg = (np.split(v, 1 + self.kind.parallel) for v in self._seen[-1][:2])
        return [(float(np.linalg.norm(b - a)), float(np.linalg.norm(b))) for a, b in zip(g, Tg, strict=True)]

    @property
    def residual(self) -> float:
        """``|Tg - g| / |Tg|`` of the last evaluation, in parallel coupling of the field where it is larger."""
        return max(r / size if size else math.inf if r else 0.0 for r, size in self._fields)

    @property
    def arrived(self) -> bool:
        """True if the last evaluation is within the tolerance, each field of parallel coupling by itself."""
        absolute = (self.absolute, 0.0)  # in the unit of the force
        fields = zip(self._fields, absolute, strict=False)
        return all(r <= max(self.tolerance * size, least) < math.inf for (r, size), least in fields)

    def see(self, g: Any, Tg: Any) -> None:
        """Take in an evaluation without asking for the next force; parameters and errors as for :meth:`next`."""
        g = _vector("g", g, len(self._seen[-1][0]) if self._seen else None)
        if self.kind.parallel and len(g) % 2:
            raise ValueError(f"g has {len(g)} numbers: needed both fields, of one length, as the coupling is parallel")
        self._seen.append((g, _vector("Tg", Tg, len(g)), self._anew))
        sizes = [r for r, _ in self._fields]
        if self.kind.parallel and self._scale is None and all(sizes):
            self._scale = np.repeat(sizes, len(g) // 2)
        if len(self._seen) > REMEMBERED:
            left = FIRST_ONES if self.kind.linear else 0
            forgotten, before, begins = self._seen.pop(left)
            x, Tx, anew = self._seen[left]
            X, TX = (np.array(rows)[:, : len(g) // (1 + self.kind.parallel)] for rows in ([forgotten], [before, Tx]))
            self._changed |= last_piece(TX) < 2
            self._bore = bears(X, TX[:1]) | (self._bore is not None and self._bore)
            self._seen[left] = x, Tx, anew or begins
        self._anew, self._advice = False, None

    def new_step(self) -> None:
        """Begin another step in time: T has other loads.

        The rule forgets what it has seen except for the steps to ``reuse``.  No difference of vectors across steps
        counts for the spectrum.
        """
        following, self._anew = self._following, True
        if self.reuse and isinstance(following, InverseStep):
            self._following = following.next_step(self.reuse)
        else:
            self._following, self._scale = self.rule.on_vectors(self.theta), None

    @property
    def advice(self) -> Advice | None:
        """The advice from the vectors seen so far; None before two of them differ."""
        if self._advice is None and len(self._seen) > 1:
            X, TX, starts = map(np.array, zip(*self._seen, strict=True))
            try:
                seen = seen_in(X, TX, kind=self.kind, starts=starts, changed=self._changed, bore=self._bore)
                self._advice = Advice.of(seen)
            except ValueError:  # they do not differ above rounding
                return None
        return self._advice

    @property
    def spectrum(self) -> Spectrum | None:
        """The eigenvalues as the vectors show them; None before two of them differ."""
        advice = self.advice
        return None if advice is None else advice.spectrum


@dataclass(frozen=True, kw_only=True, repr=False)
class CouplingState(Value):
    """A coupling after an evaluation of T, as a listener receives it; as text it is one line.

    Attributes
    ----------
    iterations : int
        Evaluations of T so far.
    residual : float
        ``|Tg - g| / |Tg|``.
    steps_left : int or None
        Steps to the tolerance at the pace of the last few; None while the residual does not fall.
    advice : Advice or None
        From the vectors so far.
    """

    iterations: int
    residual: float
    steps_left: int | None
    advice: Advice | None

    @property
    def spectrum(self) -> Spectrum | None:
        """The eigenvalues seen so far."""
        return None if self.advice is None else self.advice.spectrum

    def __str__(self) -> str:
        return self.summary

    @property
    def summary(self) -> str:
        parts = [f"{self.iterations}: residual {self.residual:.1e}"]
        if self.spectrum is not None:
            parts.append(f"lambda {self.spectrum.low:.3g} to {self.spectrum.high:.3g}")
        if self.steps_left is not None:
            parts.append(f"about {self.steps_left} step{'s' * (self.steps_left != 1)} left")
        parts += [] if self.advice is None else exchange(self.advice)
        return ", ".join(parts)


def exchange(advice: Advice) -> list[str]:
    """A sentence where the exchanged roles take fewer steps by the method that is advised."""
    if advice.method is None or not advice.method.exchanged:
        return []
    own = [row.steps for row in advice.methods if not row.exchanged and row.steps is not None]
    there = next(row for row in advice.methods if row.exchanged and row.method == advice.method.name)
    if advice.theta is None:  # nothing is predicted of these roles
        return [f"exchange the roles: {there.steps} steps"]
    return [f"exchange the roles: {there.steps} instead of {min(own) if own else 'no end of'} steps"]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Coupled(Value):
    """The end of a coupling.

    Attributes
    ----------
    outcome : Outcome
        ``converged``; ``diverged`` if ``|Tg - g|`` ran away, or has grown in each of the last PACE steps; ``limit``;
        ``interrupted`` by the listener.
    iterations : int
        Evaluations of T.
    force : array, shape (n,)
        g of the last evaluation.
    displacement : array, shape (n,)
        What the Neumann body answered to it.
    history : tuple of float
        ``|Tg - g| / |Tg|`` of each evaluation.
    advice : Advice or None
        For the next coupling of the same solvers; None where no two vectors differ.
    """

    outcome: Outcome
    iterations: int
    force: Floats
    displacement: Floats
    history: tuple[float, ...]
    advice: Advice | None

    @property
    def spectrum(self) -> Spectrum | None:
        """The eigenvalues as the vectors show them, ``low`` and ``high`` at its ends."""
        return None if self.advice is None else self.advice.spectrum

    @property
    def converged(self) -> bool:
        """True if the last residual is within the tolerance."""
        return self.outcome is Outcome.CONVERGED

    @property
    def diverged(self) -> bool:
        """True if the residual ran away, or grew at the end."""
        return self.outcome is Outcome.DIVERGED

    @property
    def summary(self) -> str:
        end = f"{self.outcome.words}, {self.iterations} evaluations, residual {self.history[-1]:.1e}"
        return f"{end}, but {why}" if self.advice and (why := self.advice.evidence.negative) else end


def couple(
    neumann: Solver,
    contact: Solver,
    *,
    start: Any,
    rule: Rule | str = "iqn-ils",
    theta: float | Fraction | str | None = None,
    tolerance: float = 1e-6,
    absolute: float = 0.0,
    max_iterations: int = 100,
    listen: Callable[[CouplingState], Any] | None = None,
    kind: str = "contact",
    parallel: bool = False,
    twice: bool = False,
) -> Coupled:
    """Couple two solvers: ``T g = contact(neumann(g))``, relaxed by a rule until g and T g agree.

    Parameters
    ----------
    neumann, contact : callable
        From a force to the displacement of the Neumann body, and from a displacement to the force that the contact body
        answers, arrays of shape (n,); any other pair of quantities, as fluxes and temperatures.  They are called one
        after the other, once for each evaluation of T, with arrays that they may change; what they raise reaches the
        caller, and nothing is called after it.
    start : array, shape (n,), or number
        The first force; the first displacement of parallel coupling is 0.
    rule, theta, kind
        As for :class:`Coupling`.
    tolerance : float
        The coupling ends where ``|Tg - g| <= tolerance |Tg|``, in the Euclidean norm.
    absolute : float
        It also ends where ``|Tg - g| <= absolute``, in the unit of g.  If the solution is 0, only this ends it.
    parallel : bool
        True to call each solver with what the other one answered in the evaluation before, as if both ran at once.
        Force and displacement are relaxed together, and each must meet the tolerance.
    twice : bool
        True to evaluate T at the start once more, after the third evaluation: that shows the noise of the solvers, and
        whether they have a memory.
    max_iterations : int
        Largest number of evaluations of T, with the additional one of ``twice``; fewer if the residual runs away.
    listen : callable, optional
        Called with a :class:`CouplingState` after each evaluation: ``print`` shows one line each.  Where it returns
        True the coupling ends here, with the outcome ``interrupted``.

    Returns
    -------
    Coupled
        If its advice is to exchange the roles, the contact solver must take forces (fluxes) and return displacements
        (temperatures), and the Neumann solver the reverse: two other functions, not the two arguments swapped.

    Raises
    ------
    ValueError
        As :class:`Coupling`; ``start``, ``tolerance`` or ``max_iterations`` is invalid.
    CouplingError
        A solver returned numbers that are not finite, or not as many as the start has.

    Examples
    --------
    >>> found = couple(lambda g: g / 2, lambda u: 3 - 1.5 * u, start=0.0, theta=0.5)
    >>> found.converged, found.iterations, round(float(found.force[0]), 6), round(found.spectrum.high, 6)
    (True, 3, 1.714286, 0.75)
    """
    coupling = Coupling(rule, theta, kind=kind, parallel=parallel, absolute=absolute, tolerance=tolerance)
    g, whole = _vector("start", start), lambda value: value >= 1 and value.denominator == 1
    max_iterations = int(take("max_iterations", max_iterations, "a whole number > 0", whole))
    ending = Ending(1.0, max_iterations - 1 - twice, patience=math.inf, growing=GROWING)
    seen, history, displacement = list[Evaluation](), list[float](), g
    begin = np.concatenate([g, 0 * g]) if parallel else g

    def T(x: Floats) -> Floats:
        nonlocal displacement
        g, before = np.split(x, 2) if parallel else (x, None)
        moved = _answer("neumann", neumann, g, len(seen) + 1)
        force = _answer("contact", contact, moved if before is None else before, len(seen) + 1)
        if seen and max(np.abs(force).max(), np.abs(moved).max()) > FAR_AWAY:
            raise _RunAway
        if twice and len(seen) == 2 and x is not begin:  # a memory has another x now, in parallel coupling too
            coupling.see(begin, T(begin))
            coupling._seen.insert(1, coupling._seen.pop())
        displacement = moved
        return np.concatenate([force, displacement]) if parallel else force

    def ended(found: Evaluation) -> Outcome | None:
        coupling.see(found.g, found.image)
        history.append(coupling.residual)
        outcome = ending.at(coupling.size, coupling.size, lambda: coupling.arrived)
        if listen is not None:
            left = 0 if outcome is Outcome.CONVERGED else _steps_left(history, coupling.tolerance)
            advice = coupling.advice
            state = CouplingState(iterations=len(seen), residual=history[-1], steps_left=left, advice=advice)
            if listen(state) is True and outcome is not Outcome.CONVERGED:
                return Outcome.INTERRUPTED
        return Outcome.DIVERGED if outcome is Outcome.LIMIT and _grows(seen) else outcome

    try:
        outcome = follow(evaluations(T, coupling.relaxed, begin), ended, seen)
    except _RunAway:
        outcome = Outcome.DIVERGED
    return Coupled(
        outcome=outcome,
        iterations=len(seen) + (twice and len(seen) > 2),
        force=seen[-1].g[: len(g)],
        displacement=displacement,
        history=tuple(history),
        advice=coupling.advice,
    )


def _vector(name: str, given: Any, size: int | None = None) -> Floats:
    """A copy as an array of shape (n,); ValueError where it is none."""
    needed = "a vector of real numbers" if size is None else f"a vector of {size} real numbers"
    return real_array(name, given, (size,), needed, alone=size in (None, 1))


def _answer(name: str, solver: Solver, given: Floats, iterations: int) -> Floats:
    """The answer of a solver to a copy of a vector."""
    answer = solver(given.copy())
    try:
        return _vector(f"what {name} returned", answer, len(given))
    except ValueError as error:
        raise CouplingError(f"evaluation {iterations}: {error}") from None


def _grows(seen: list[Evaluation]) -> bool:
    """True if each of the last PACE steps has a larger residual than the one before."""
    some = seen[-1 - PACE :]
    return len(some) > PACE and all(before.residual * (1 + DOUBLE) < after.residual for before, after in pairwise(some))


def _steps_left(history: list[float], tolerance: float) -> int | None:
    """Steps to the tolerance at the pace of the last ones."""
    first, last, steps = history[-1 - PACE :][0], history[-1], min(len(history) - 1, PACE)
    if not 0 < last < first < math.inf:
        return None
    return max(math.ceil(math.log(tolerance / last) / (math.log(last / first) / steps)), 1)
