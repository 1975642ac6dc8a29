"""One run of a sweep: when it ends, by which test, and at which rate; constant relaxation takes many steps at once.

While each contact node keeps its state, T is affine.  With constant relaxation such steps are taken together, by a few
products of matrices, and then every sign that step II requires is checked for each of them.  Where one fails T is
evaluated as elsewhere, with its certificate.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import count, groupby, repeat
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from fem1d2d.mesh import Floats
from verification.algorithm.affine_piece import Piece, signs_of
from verification.algorithm.arrival import NO_FORCE, arrived, coupled_residual
from verification.algorithm.fixed_point import FixedPointMap, iterate_at, iterates
from verification.algorithm.iterate import Iterate
from verification.algorithm.linearisation import NotLinear, at_solution, linearised_rate
from verification.algorithm.loop import Ending, Outcome, follow
from verification.algorithm.monolithic import SolveError
from verification.algorithm.rates import Noise, ObservedRate, rate_of
from verification.algorithm.relaxation import Constant, Relaxation, Rule, Step
from verification.algorithm.start import Start, begin_at, compared_with
from verification.algorithm.theta import Choice
from verification.contact import ContactError
from verification.contact.active_set import SLACK, Pattern, Systems
from verification.interface.pair import ContactPair

#: The bound of the test of Section 6.3.
PAPER = 1e-9

#: Steps without a new least residual after which a run most likely stalls; few other runs have as many.
WANDERS = 12

#: A residual within this share of the tolerance is on either side of it by rounding: it has about seven digits there.
TIE = 1e-6

#: Number of steps that are taken together: few at first, as the pattern changes most then.
FEWEST, MOST = 4, 64

#: Bytes of the pieces of one pair that are kept, besides the one in use.
KEPT = 48_000_000


@dataclass(frozen=True, kw_only=True, eq=False)
class Steps:
    """Consecutive evaluations of T on one piece, each an array over the steps.

    Attributes
    ----------
    g, u, image : array, shape (2 n, steps)
        g, its displacement and T g.
    residual, scale : array, shape (steps,)
        ``|||T g - g|||`` and the larger of ``|||g|||`` and ``|||T g|||`` in the norm (5.21).
    pattern, piece : object
        Equal for steps of one contact pattern, and of one affine piece.
    found : Iterate or None
        The one step, for other rules than constant relaxation.
    """

    g: Floats
    u: Floats
    image: Floats
    residual: Floats
    scale: Floats
    pattern: bytes
    piece: tuple[bytes, ...]
    found: Iterate | None = None

    def first(self, count: int) -> Steps:
        """Return the first of them."""
        arrays = {name: getattr(self, name)[..., :count] for name in ("g", "u", "image", "residual", "scale")}
        return replace(self, **arrays)


class Affine:
    """T on one affine piece of a pair without held contact nodes, with the signs that hold there."""

    def __init__(self, piece: Piece, systems: Systems) -> None:
        pair = piece.pair
        contact, interface = pair.contact, pair.interface
        self.piece, self.key = replace(piece), key_of(piece.pattern, piece.sign, piece.still)
        piece = replace(piece)  # neither copy hands on the matrices that it has: they are not kept twice
        obstacle = interface.carry(pair.neumann.unloaded) + pair.offset
        trace = interface.carry(pair.neumann.inverse)
        start = contact.load - contact.schur @ obstacle  # q of step II at g = 0, where the bound is 0 as well
        v, force = systems.of(piece.pattern).solve(start, np.zeros(contact.grid.t))
        parts = [
            (piece.reaction, force),
            (piece.jump, v),
            (-contact.schur @ trace, start),
            (pair.neumann.inverse, pair.neumann.unloaded),
            (piece.force, interface.carry_back(force)),
        ]
        self._matrix = np.vstack([matrix for matrix, _ in parts])
        self._offset = np.concatenate([offset for _, offset in parts])[:, None]
        self._image = -len(parts[-1][1])  # the rows of T g
        self._stiffness = float(np.diag(contact.schur).max())
        self._sliding = piece.pattern.sliding.astype(float)[:, None]

    def relaxed(self, theta: float) -> tuple[Floats, Floats]:
        """Return T_theta as a matrix and its value at 0."""
        relaxed = theta * self._matrix[self._image :]
        relaxed[np.diag_indices_from(relaxed)] += 1 - theta
        return relaxed, theta * self._offset[self._image :, 0]

    def on(self, g: Floats, norm: Norm) -> tuple[Steps, int]:
        """Evaluate T at the columns of g, and count those, from the first on, that the signs of the piece admit."""
        pair = self.piece.pair
        interface, t = pair.interface, pair.contact.grid.t
        found, size = self._matrix @ g + self._offset, pair.contact.grid.size
        force, v, q = (found[i * size : (i + 1) * size] for i in range(3))
        u, image = found[3 * size : -len(g)], found[-len(g) :]
        if pair.rubs and interface.kernel is not None:
            stress = interface.kernel @ g[pair.neumann.grid.normal]
            bound = norm.limits * np.abs(stress)
            kept = (np.sign(stress) == self.piece.sign[:, None]).all(axis=0)
        else:
            bound, kept = np.zeros((t, g.shape[1])), np.ones(g.shape[1], dtype=bool)
        slack = SLACK * np.maximum(np.abs(q).max(axis=0), bound.max(axis=0, initial=0.0))
        # the conditions of the active set, at every step
        kept &= (force[t:] >= -slack).all(axis=0) & (v[t:] <= slack / self._stiffness).all(axis=0)
        kept &= (np.abs(force[:t]) <= bound + slack).all(axis=0)
        kept &= ((self._sliding * v[:t] >= -slack / self._stiffness) | (bound == 0)).all(axis=0)
        steps = Steps(
            g=g,
            u=u,
            image=image,
            residual=norm.of(image - g),
            scale=np.maximum(norm.of(g), norm.of(image)),
            pattern=self.key[0],
            piece=self.key,
        )
        return steps, len(kept) if kept.all() else int(np.argmin(kept))


class Norm:
    """The norm (5.21) of columns, and the limit of friction at each node."""

    def __init__(self, pair: ContactPair) -> None:
        self._factor = np.linalg.inv(pair.neumann.root)
        self.limits = (float(pair.friction) * pair.contact.grid.weights)[:, None]

    def of(self, force: Floats) -> Floats:
        """Return ``sqrt(force' S2^-1 force)`` of every column."""
        return lengths(self._factor @ force)


def lengths(columns: Floats) -> Floats:
    """Return the Euclidean norm of every column."""
    found: Floats = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    return found


def key_of(pattern: Pattern, sign: NDArray[np.int8], still: NDArray[np.bool_]) -> tuple[bytes, ...]:
    """Return a key that is equal for equal pieces of one pair; its first member is the pattern."""
    return pattern.key, sign.tobytes(), still.tobytes()


K = TypeVar("K")


class Shelf(Generic[K]):
    """Values by their keys, of which the last used are kept: as many as have so many bytes in their own arrays."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._held: dict[object, K] = {}

    def get(self, key: object, make: Callable[[], K]) -> K:
        """Return the value of a key, and make it where it is not kept."""
        if key in self._held:
            value = self._held.pop(key)
            self._held[key] = value
            return value
        value = make()
        while self._held and self.nbytes > self._most:
            del self._held[next(iter(self._held))]
        self._held[key] = value
        return value

    @property
    def nbytes(self) -> int:
        """Bytes of the arrays of all values that are kept; they may have got some since they were made."""
        arrays = [array for value in self._held.values() for array in _arrays(tuple(vars(value).values()))]
        return sum({id(array): array.nbytes for array in arrays}.values())


def _arrays(value: object) -> Iterator[NDArray[Any]]:
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, tuple):
        for member in value:
            yield from _arrays(member)


class KnownPieces:
    """Shared data of the runs of one pair: its affine pieces, and the solution of the global method."""

    def __init__(self, pair: ContactPair) -> None:
        self.pair = pair
        contact = pair.contact
        self._systems = Systems(contact.schur, contact.free, contact.motions)
        self._pieces: Shelf[Piece] = Shelf(KEPT // 2)
        self._affine: Shelf[Affine] = Shelf(KEPT // 2)

    def map(self) -> FixedPointMap:
        """Return T for one run: the pattern it tries first depends on the steps before."""
        return FixedPointMap(self.pair, systems=self._systems)

    def piece(self, g: Floats, pattern: Pattern) -> Piece:
        """Return the piece around g."""
        sign, still = signs_of(self.pair, g, pattern)
        make = lambda: Piece(pair=self.pair, pattern=pattern, sign=sign, still=still)
        return self._pieces.get(key_of(pattern, sign, still), make)

    def key(self, found: Iterate) -> tuple[bytes, ...]:
        """Return the key of the piece of an iterate."""
        pattern = found.contact.pattern
        return key_of(pattern, *signs_of(self.pair, found.g, pattern))

    def affine(self, piece: Piece) -> Affine:
        """Return T on a piece."""
        key = key_of(piece.pattern, piece.sign, piece.still)
        return self._affine.get(key, lambda: Affine(piece, self._systems))

    @cached_property
    def norm(self) -> Norm:
        """The norm (5.21) of columns."""
        return Norm(self.pair)

    @cached_property
    def noise(self) -> Noise:
        """The rounding of one evaluation of T."""
        return Noise(self.pair)

    @cached_property
    def _solution(self) -> Iterate | Exception:
        try:
            return at_solution(self.map())
        except (NotLinear, SolveError, RuntimeError) as error:
            return error

    def solution(self) -> Iterate:
        """Return T at the solution of the global method; may raise NotLinear, SolveError or RuntimeError."""
        if isinstance(self._solution, Exception):
            raise self._solution
        return self._solution

    @cached_property
    def start(self) -> Start:
        """Start of the runs."""
        return begin_at(self.map())

    @cached_property
    def least(self) -> float:
        """Least size of the forces with which residuals are compared."""
        return compared_with(self.pair, self.start)

    def steps(self, T: FixedPointMap, theta: float) -> Iterator[Steps]:
        """Yield the run of a new :meth:`map` with constant relaxation from its start, without end."""
        found = iterate_at(T, self.start.g)
        while True:
            taken = self.single(found)
            yield replace(taken, found=None)
            g = theta * found.image + (1 - theta) * found.g
            with suppress(ContactError):  # which steps on the piece need not meet
                following = iterate_at(T, g)
                if self.key(following) != taken.piece:  # without the matrices of the piece, which take longer
                    found = following
                    continue
            affine, count = self.affine(self.piece(found.g, found.contact.pattern)), FEWEST
            relaxed, kept = affine.relaxed(theta), count
            while kept == count:
                with np.errstate(over="ignore", invalid="ignore"):  # of a run that diverges; no sign admits it
                    taken, kept = affine.on(_walk(*relaxed, g, count), self.norm)
                if kept:
                    yield taken.first(kept)
                    g = theta * taken.image[:, kept - 1] + (1 - theta) * taken.g[:, kept - 1]
                if kept == count:
                    kept = count = min(2 * count, MOST)
            found = iterate_at(T, g)

    def single(self, found: Iterate) -> Steps:
        """Return one evaluation of T with its piece."""
        key = self.key(found)
        g, u, image = (column[:, None] for column in (found.g, found.displacement, found.image))
        residual, scale = np.array([found.residual]), np.array([found.scale])
        return Steps(g=g, u=u, image=image, residual=residual, scale=scale, pattern=key[0], piece=key, found=found)


def _walk(matrix: Floats, offset: Floats, g: Floats, count: int) -> Floats:
    """Return so many iterates as columns, from g on."""
    walked = np.empty((len(g), count))
    for i in range(count):
        walked[:, i] = g
        g = matrix @ g + offset
    return walked


def meets_paper_test(g: Floats, before: Floats) -> NDArray[np.bool_]:
    """Apply the test of Section 6.3, ``|g_n - g_{n-1}|/|g_n| < 1e-9`` or ``|g_n - g_{n-1}| < 1e-9``, to every column.

    Norms are Euclidean; the second part is in the unit of force of the file.
    """
    increment = lengths(g - before)
    return (increment < PAPER) | (increment < PAPER * lengths(g))


class State(NamedTuple):
    """One evaluation of T in a sweep, of some steps their column ``i``; ``paper`` if the test of Section 6.3 is met."""

    residual: float
    scale: float
    paper: bool
    steps: Steps
    i: int

    def iterate(self, T: FixedPointMap, least: float) -> Iterate:
        """Return all values of this evaluation."""
        return self.steps.found or iterate_at(T, self.steps.g[:, self.i], least)


def states(batches: Iterable[Steps], least: float) -> Iterator[State]:
    """Yield the evaluations of a run one by one; ``least`` is a scale that none falls below."""
    before: Floats | None = None
    for steps in batches:
        g = steps.g
        before = np.full((len(g), 1), math.nan) if before is None else before
        paper = meets_paper_test(g, before if g.shape[1] == 1 else np.column_stack([before, g[:, :-1]])).tolist()
        scales = np.maximum(steps.scale, least).tolist()
        yield from map(State, steps.residual.tolist(), scales, paper, repeat(steps), count())
        before = g[:, -1:]


class Undecided(Exception):
    """Rounding decides when a run ends: its steps must be evaluated one by one."""


def course(
    pair: ContactPair, rule: Rule, choice: Choice, step: Step, pieces: KnownPieces
) -> tuple[dict[str, Any], dict[str, str]]:
    """Run a pair from its start until both tests are met, or the run stalls, runs away or reaches its limit.

    Returns
    -------
    dict
        The columns of the run in its row, by name: ``steps``, the number until the run ended; ``iterations``, the same
        if it converged; ``iterations_paper``, n at which the test of Section 6.3 is met; ``outcome``; the other three
        as a run has them.
    dict
        Why a column is None, by its name.

    Raises
    ------
    ContactError
        Step II did not reach its certificate before the run ended.
    """
    T = pieces.map()
    went = None
    if isinstance(step, Relaxation) and not pair.held:
        with suppress(Undecided):
            went = _follow(pieces, pieces.steps(T, step.theta), T, lean=True)
    if went is None:  # any rule, and where rounding decides: a residual that wanders, or meets the tolerance exactly
        T.restart()
        went = _follow(pieces, map(pieces.single, iterates(T, step, pieces.start.g, pieces.least)), T, lean=False)
    steps, outcome, why = len(went.seen) - 1, went.outcome, went.outcome.why
    reason = {"iterations": why.format(steps=steps)} if why else {}
    if went.paper is None:
        reason["iterations_paper"] = went.why or f"not met before the run ended: {outcome}"
    observed = None if outcome is Outcome.DIVERGED else went.rate(pieces.noise)
    if observed is None:
        diverged = outcome is Outcome.DIVERGED
        reason["observed_rate"] = "the run diverged" if diverged else "too few steps stand clear of the rounding"
    end: Iterate | None = None
    coupled, linear = None, None
    try:
        end = went.seen[-1].iterate(T, pieces.least)
        coupled = coupled_residual(pair, end)
    except ContactError as error:
        reason["coupled_residual"] = str(error)
    else:
        if coupled is None:
            reason["coupled_residual"] = NO_FORCE
    try:
        if not isinstance(rule, Constant):
            raise NotLinear(f"the {rule.name} relaxation is no constant theta")
        here, first = (end, went.entry) if end and outcome is Outcome.CONVERGED else (pieces.solution(), None)
        linear = linearised_rate(pieces.piece(here.g, here.contact.pattern), here, float(choice.theta), first)
    except (NotLinear, SolveError, ContactError) as error:
        reason["linearised_rate"] = str(error)
    columns = {
        "iterations": steps if outcome is Outcome.CONVERGED else None,
        "iterations_paper": went.paper,
        "steps": steps,
        "outcome": outcome.value,
        "observed_rate": None if observed is None else observed.value,
        "linearised_rate": linear,
        "coupled_residual": coupled,
    }
    return columns, reason


@dataclass(frozen=True, kw_only=True, eq=False)
class _Went:
    """A run to its end.

    Attributes
    ----------
    outcome : Outcome
    seen : list of State
        Every evaluation until it ended.
    paper : int or None
        n at which the test of Section 6.3 is met.
    why : str
        The error that ended it before that test was met.
    """

    outcome: Outcome
    seen: Sequence[State]
    paper: int | None
    why: str

    @property
    def batches(self) -> list[Steps]:
        """The steps that were taken together."""
        return [steps for steps, _ in groupby(state.steps for state in self.seen)]

    def rate(self, noise: Noise) -> ObservedRate | None:
        """Return the rate at its end."""
        g, u = (np.hstack([getattr(b, name) for b in self.batches])[:, : len(self.seen)] for name in "gu")
        floors: list[float] = noise.of(g, u).tolist()
        return rate_of([state.residual for state in self.seen], floors, [state.steps.pattern for state in self.seen])

    @property
    def entry(self) -> Floats:
        """The g with which it came onto the piece of its last g for good."""
        last = self.batches[-1]
        for steps in reversed(self.batches):
            if steps.piece != last.piece:
                break
            last = steps
        return last.g[:, 0]


def _follow(pieces: KnownPieces, batches: Iterable[Steps], T: FixedPointMap, *, lean: bool) -> _Went:
    """Follow a run to its end, and on until the test of Section 6.3 is met or the run is given up.

    Raises
    ------
    Undecided
        Of lean steps, which are not evaluated one by one.
    """
    pair, least, tolerance = pieces.pair, pieces.least, pieces.pair.settings.tolerance
    ending, walk, seen = Ending(tolerance, pair.settings.max_iterations), states(batches, least), list[State]()

    def ended(state: State) -> Outcome | None:
        outcome = ending.at(state.residual, state.scale, lambda: arrived(pair, state.iterate(T, least)))
        bound = tolerance * state.scale
        if lean and (ending.since > WANDERS or abs(state.residual - bound) <= TIE * bound):
            raise Undecided
        return outcome

    def met(state: State) -> Outcome | None:
        return Outcome.CONVERGED if state.paper else ending.at(state.residual, state.scale, lambda: False)

    outcome, why = follow(walk, ended, seen), ""
    paper = next((n for n, state in enumerate(seen) if state.paper), None)
    if paper is None and not ending.given_up(seen[-1].residual):
        after = list[State]()
        try:
            if follow(walk, met, after) is Outcome.CONVERGED:
                paper = len(seen) + len(after) - 1
        except ContactError as error:
            why = str(error)
    return _Went(outcome=outcome, seen=seen, paper=paper, why=why)
