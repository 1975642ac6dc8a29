"""The Lipschitz constant of T_theta between two bounds: branch and bound over signs of slip and states of nodes.

T is piecewise affine, so that its Lipschitz constant is the largest ``|J|`` of its pieces.  On a piece each node keeps
a sign eps_j, with which step II gives ``p_T v_T = eps_j w k zeta v_T`` in place of the inequality (2.6): both sides
are 0 where the node sticks.  So the set of pieces with the largest bound is divided in two, by the sign of a node or by
its state, until the bound of every set is close to the largest ``|J|`` found.  Proofs in ``docs/energy.md``.

:func:`work_out` does all of it for one pair: both bounds, the thetas and the friction that they allow.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import count
from typing import Any, ClassVar

import numpy as np

from fem1d2d.mesh import Bools
from ndtheory import Number
from ndtheory.keys import Part, derived, key, says
from ndtheory.number import above, below
from verification.algorithm.affine_piece import Piece
from verification.algorithm.rates import ForceNorm
from verification.constants import Measured
from verification.contact.active_set import Signs
from verification.interface.pair import ContactPair
from verification.machine.progress import Progress, silent
from verification.machine.threads import one_thread
from verification.semidefinite import LMIError
from verification.semidefinite.conditions import TINY, Pieces
from verification.semidefinite.interior_point import Optimum, Stop, Weights
from verification.semidefinite.mirror import Mirror
from verification.semidefinite.multipliers import Certified, QuadraticForms, friction_threshold
from verification.semidefinite.pattern_search import factor_search
from verification.value import freeze

#: The search ends where the upper bound exceeds the lower by this share.
GAP = 1e-2

#: And here where it may take as long as it takes.
CLOSE = 1e-3

#: Programs solved at 25 contact nodes unless more are asked for: some 3 s, and enough for a gap of 1 % on Section 6.
#: Counted, not timed, so that every machine gives the same number.
PROGRAMS = 50

#: And never more than this: at most 8 s on a hundred random problems of up to 9 nodes.
MOST = 160

#: Programs for a certificate that divides the pieces, at most: a minute or so up to 25 contact nodes.  Section 6 needs
#: 204 to reach CLOSE at theta = 0.7; some random problems of 8 nodes would need more than ten minutes.
CERTIFIED = 2000

#: Signs are fixed where that may save this share of what the bound is too large by.
WORTH = 0.3

#: What images of multipliers prove may be weaker by this share, which rounding costs, before a program is solved.
SAME_BOUND = 1e-9

#: A pattern read off the moments is climbed from where its ``|J|`` reaches this share of the best.
PROMISING = 0.995

#: Why the values of this bound are not called certified.
NOT_CERTIFIED = "checked in doubles with a bound on their rounding, for the interface matrices as computed"


@dataclass(frozen=True, kw_only=True, eq=False)
class Enclosure:
    """Bounds of the Lipschitz constant of T_theta in the norm (5.21), or in another one, over all loads and gaps.

    ``upper`` is proved by multipliers for every set of pieces, ``whole`` by one program for all pieces together.
    ``lower`` is the largest ``|J|`` found, of ``piece``; its spectral radius in another norm.  ``tree`` has the sets of
    pieces into which all were divided, with the proof of each; ``programs`` were solved; ``norm`` is None for (5.21).
    """

    upper: Certified
    whole: Certified
    tree: Leaf | Division
    lower: float
    piece: Piece
    programs: int
    norm: ForceNorm | None = None

    @property
    def gap(self) -> float:
        """``upper / lower - 1``."""
        return self.upper.value / self.lower - 1


@dataclass(frozen=True, kw_only=True, eq=False)
class Leaf:
    """Some pieces: the bound proved for them, the pieces that its multipliers are for, and the program's answer."""

    pieces: Pieces
    upper: Certified
    proved_on: Pieces
    proposal: Optimum | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Division:
    """Some pieces in two: those with 1 at a node and those with -1, in the field of :class:`Pieces` of some name."""

    name: str
    node: int
    cases: tuple[Leaf | Division, ...]


def budget(n: int) -> int:
    """Number of programs to solve for n contact nodes: as many as take some seconds.

    Examples
    --------
    >>> [budget(n) for n in (13, 25, 49, 97)]
    [160, 50, 9, 1]
    """
    return max(1, min(MOST, int(PROGRAMS * (25 / n) ** 2.5)))


def enclose(
    pair: ContactPair,
    forms: QuadraticForms,
    theta: float,
    *,
    gap: float,
    programs: int | None,
    progress: Progress = silent,
) -> Enclosure:
    """Enclose the Lipschitz constant of T_theta for 0 < theta <= 1.

    The search ends where ``upper <= (1 + gap) lower``, or after so many ``programs`` (see :func:`budget`); None: no
    limit.

    Raises
    ------
    LMIError
        No multipliers prove anything.
    """
    with one_thread():
        upper, proposal = forms.on(forms.everywhere, theta)
        root = Leaf(pieces=forms.everywhere, upper=upper, proved_on=forms.everywhere, proposal=proposal)
        search = factor_search(pair, theta)
        patterns = [*search.extremes(), *_read_off(forms, root, search.sign)]
        best = max((search.climb(search.found(*pattern)) for pattern in patterns), key=lambda found: found.value)
        order, solved, mirror = count(), 1, forms.mirror
        leaves, bounded = [(-upper.value, next(order), root)], {root.pieces.key: root}
        divisions: dict[bytes, tuple[str, int]] = {}
        while True:
            worst, lower = leaves[0][2], best.piece.factor(theta)
            if worst.upper.value <= (1 + gap) * lower:
                break
            division = _division(forms, worst, lower)
            if division is None:
                break
            parts = worst.pieces.divided(*division)
            if programs is not None and solved + len(parts) > programs:
                break
            stop = Stop(accuracy=gap / 100, enough=((1 + gap) * lower) ** 2 * (1 - SAME_BOUND))
            progress(
                f"semidefinite bound: {100 * (worst.upper.value / lower - 1):.2f} % above a factor that occurs", None
            )
            heapq.heappop(leaves)
            divisions[worst.pieces.key] = division
            for part in parts:
                leaf = None if mirror is None else _mirrored(forms, mirror, bounded, part, theta)
                if leaf is None:
                    leaf, solved = _solved(forms, worst, part, theta, stop), solved + 1
                    for pattern in _read_off(forms, leaf, search.sign):
                        start = search.above(PROMISING**2 * best.value, *pattern)
                        if start is not None:
                            best = max(best, search.climb(start), key=lambda found: found.value)
                bounded[part.key] = leaf
                heapq.heappush(leaves, (-leaf.upper.value, next(order), leaf))
        best = search.climb(best, side_by_side=True)
        lower = max(lower, best.piece.factor(theta))

    def tree(pieces: Pieces) -> Leaf | Division:
        if pieces.key not in divisions:
            return replace(bounded[pieces.key], proposal=None)
        name, node = divisions[pieces.key]
        return Division(name=name, node=node, cases=tuple(map(tree, pieces.divided(name, node))))

    return Enclosure(
        upper=worst.upper, whole=root.upper, tree=tree(root.pieces), lower=lower, piece=best.piece, programs=solved
    )


def _solved(forms: QuadraticForms, parent: Leaf, part: Pieces, theta: float, stop: Stop) -> Leaf:
    """The bound for a part of a set of pieces: by its own program, or from the whole set."""
    start = None
    if parent.proposal is not None and (part.signs != parent.pieces.signs).any():  # by what a node does is too far away
        start = parent.pieces, parent.proposal
    try:
        upper, proposal = forms.on(part, theta, stop=stop, parent=start)
    except LMIError:
        return replace(parent, pieces=part, proposal=None)
    if parent.upper.value < upper.value:
        return replace(parent, pieces=part, proposal=proposal)
    return Leaf(pieces=part, upper=upper, proved_on=part, proposal=proposal)


def _mirrored(
    forms: QuadraticForms, mirror: Mirror, bounded: dict[bytes, Leaf], part: Pieces, theta: float
) -> Leaf | None:
    """The bound from images of multipliers for the image of a set of pieces; None where neither is known."""
    other = bounded.get(mirror.pieces(part).key)
    if other is None or other.proposal is None:
        return None
    upper = forms.proved_by(mirror.multipliers(other.upper.multipliers), theta)
    if upper is None or upper.value > other.upper.value * (1 + SAME_BOUND):
        return None
    proposal = mirror.proposal(other.proposal, forms, other.pieces)
    return Leaf(pieces=part, upper=upper, proved_on=mirror.pieces(other.proved_on), proposal=proposal)


def _division(forms: QuadraticForms, leaf: Leaf, lower: float) -> tuple[str, int] | None:
    """The division of a set of pieces, at the node where it promises most in the moments of the worst pairs.

    First by signs, whose relaxation costs the difference of ``tau |zeta| |v_T|`` and ``tau |zeta v_T|``; where that is
    little of the excess of the bound, by the state of a node.
    """
    if leaf.proposal is None or len(forms.families) == 1:
        return None
    pieces, moments, (lam, tau, *_) = leaf.pieces, leaf.proposal.moments, leaf.upper.multipliers
    (force, jump), (shear, slip), (zeta, _), (slide, _), *_ = forms.families
    of = lambda a, b: np.einsum("ij,ij->i", a @ moments, b)
    sizes = lambda a, b: np.sqrt(np.maximum(of(a, a) * of(b, b), 0.0))
    free = pieces.signs == 0
    lost = np.where(free & (pieces.slip == 0), tau * (sizes(zeta, slide) - np.abs(of(zeta, slide))), 0.0)
    if lost.sum() >= WORTH * (leaf.upper.value**2 - lower**2):
        return "signs", int(np.argmax(lost))
    signed = shear - pieces.signs[:, None] * forms.reach
    both = np.concatenate(
        [
            np.where((pieces.normal == 0) & (not forms.lifts), lam * sizes(force, jump), -1.0),
            np.where(~free & (pieces.slip == 0), tau * sizes(signed, slip), -1.0),
        ]
    )
    node = int(np.argmax(both))
    if both[node] >= 0:
        return ("normal", node) if node < len(lam) else ("slip", node - len(lam))
    if free.any():
        return "signs", int(np.argmax(np.where(free, lost, -1.0)))
    return None


def _read_off(forms: QuadraticForms, leaf: Leaf, sign: Signs) -> Iterator[tuple[Bools, Signs]]:
    """State of each node, touching and sliding, in the pairs of forces that are worst in the moments of a leaf."""
    if leaf.proposal is None:
        return
    normal = leaf.pieces.normal
    first, second = np.linalg.eigh(leaf.proposal.moments)[1][:, -2:].T
    for worst in (first, second, first + second, first - second):
        relative = lambda rows, at=worst: np.abs(rows @ at) / np.maximum(np.linalg.norm(rows, axis=1), TINY)
        (force, jump), *friction = forms.families
        touching = np.where(normal != 0, normal > 0, relative(force) > relative(jump))
        if not friction:
            yield touching, np.ones(len(sign), dtype=np.int8)
            continue
        (shear, slip), (zeta, _), (slide, _), *_ = friction
        seen = np.sign((shear @ worst) * (slip @ worst) * (zeta @ worst) * (slide @ worst))
        eps = np.where(leaf.pieces.signs != 0, leaf.pieces.signs, np.where(seen != 0, seen, 1))
        rests = relative(shear - eps[:, None] * forms.reach) < relative(slip)
        slides = np.where(leaf.pieces.slip != 0, leaf.pieces.slip > 0, rests)
        yield touching, np.where(slides, eps * np.where(sign != 0, sign, 1), 0).astype(np.int8)


# --- the result -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Semidefinite(Part):
    """Result of the semidefinite bound for a pair of bodies at one theta.

    ``lipschitz`` is in the norm (5.21), checked in doubles with a bound on their rounding; ``not_proved`` says why it
    is not proved, ``gave_up`` why the solver proposed no multipliers at this theta, so that it comes from the known
    ones. ``whole`` is the proof of one program for all pieces of T together, ``divided`` the smaller ``lipschitz`` in
    doubles, beside a proved one; ``largest`` are the multipliers behind ``theta_max``, over theta.
    """

    part: ClassVar[str] = "Semidefinite bound"

    lipschitz: Number = key("the Lipschitz constant that the program bounds, also above 1")
    lower: float = key("the largest factor found; it occurs for some loads and gaps")
    programs: int = key("number of semidefinite programs that were solved for both")
    theta_max: Number | None = key(
        "every smaller theta contracts; with `--verified` every theta up to `lo` is proved to",
        null="where none is found to",
        why="no theta is proved to contract at this friction",
    )
    friction_threshold: Number | None = key(
        "friction below which every small theta contracts, with `--verified` proved up to `lo`",
        null="without a law of friction, or where $C_{t1}$ is infinite",
        why=lambda found: found.no_threshold,
    )
    gave_up: str = ""
    no_threshold: str = "no law of friction"
    whole: Certified | None = None
    divided: Number | None = key(
        "the smaller value that results from dividing the pieces of $T$ into groups, in doubles",
        absent="unless `certified`",
        default=None,
    )
    largest: Weights = ()
    not_proved: str = NOT_CERTIFIED
    unverified: Mapping[str, str] | None = key(
        "why `theta_max` or `friction_threshold` is not proved", absent="without `--verified`", default=None
    )

    @property
    @says(null="where it is not below 1", why=lambda found: found.why_no_factor)
    def factor(self) -> Number | None:
        """A proved factor of one step in real arithmetic: the Lipschitz constant where it contracts."""
        return self.lipschitz if self.lipschitz.value < 1 else None

    gap = derived("`lipschitz / lower - 1`", lambda bound: bound.lipschitz.value / bound.lower - 1, float)

    @property
    @says()
    def certified(self) -> bool:
        """True if `lipschitz` is proved, at level `verified`.

        By the multipliers of one program, for all pieces of T at once.
        """
        return self.lipschitz.level != "float"

    @property
    def why_no_factor(self) -> str:
        """Why this theta has no conclusion; empty where it has one."""
        if self.factor is not None:
            return ""
        return self.gave_up or f"its bound {self.lipschitz.value:.3g} of the Lipschitz constant is not below 1"

    @property
    def reason(self) -> dict[str, str]:
        """Why the Lipschitz constant is not proved."""
        return {} if self.certified else {"certified": self.not_proved}

    def proved(
        self, pair: ContactPair, measured: Measured, theta: Fraction, *, progress: Progress = silent
    ) -> Semidefinite:
        """The same for its pair with numbers that are proved for the rational data, or the reasons why some are not.

        The proved Lipschitz constant comes from a single program: its multipliers hold for all pieces of T at once, and
        one quadratic form decides.  A smaller one from dividing the pieces stays in ``divided``.
        """
        from verification.certificate.claims import Confirmation, NoCertificate

        assert self.whole is not None
        found_beside = {"theta_max": self.theta_max, "friction_threshold": self.friction_threshold}
        numbers = {name: number for name, number in found_beside.items() if number is not None}
        try:
            confirmation = Confirmation(pair, progress=progress)
        except NoCertificate as error:
            return replace(self, not_proved=str(error), unverified=dict.fromkeys(numbers, str(error)))

        def multipliers(k: float) -> Weights:
            found = QuadraticForms(pair, measured, friction=k).friction_number()
            return tuple(2 * values for values in found.multipliers)

        proofs: dict[str, Callable[[Number], Fraction]] = {
            "theta_max": lambda number: confirmation.theta_max(number.value, self.largest),
            "friction_threshold": lambda number: confirmation.friction_threshold(number.value, multipliers),
        }
        kept: dict[str, Any] = {}
        why: dict[str, str] = {}
        for name, number in numbers.items():
            try:
                kept[name] = Number.within(number.value, below(proofs[name](number)), None, "verified")
            except (NoCertificate, LMIError) as error:
                why[name] = str(error)
        beside = replace(self, **kept, unverified=why)
        try:
            found = confirmation.factor(theta, self.whole.value, self.whole.multipliers)
        except NoCertificate as error:
            return replace(beside, not_proved=str(error))
        most = above(found)
        if not most < 1:
            return replace(beside, not_proved=f"1 - {float(1 - found):.3g} is proved, which no double tells from 1")
        number = Number.within(self.whole.value, None, most, "verified")
        return replace(beside, lipschitz=number, divided=self.lipschitz, not_proved="")


def work_out(
    pair: ContactPair, measured: Measured, theta: float, *, exact: bool = False, progress: Progress = silent
) -> Semidefinite:
    """Solve the programs of a pair of bodies at one theta.

    With ``exact`` it goes on to a gap of CLOSE, however many programs that takes.

    Raises
    ------
    LMIError
    ValueError
        As :class:`verification.semidefinite.conditions.Conditions`.
    """
    progress("semidefinite bound: largest theta", None)
    forms = QuadraticForms(pair, measured)
    largest = forms.largest_theta()
    energy = measured.friction_threshold
    allowed = None if energy is None else friction_threshold(pair, measured, energy.value, progress=progress)
    progress("semidefinite bound: factor of one step", None)
    asked = {"gap": CLOSE, "programs": None} if exact else {"gap": GAP, "programs": budget(pair.contact.grid.n)}
    found = enclose(pair, forms, theta, **asked, progress=progress)
    return Semidefinite(
        lipschitz=Number.of_float(found.upper.value),
        whole=replace(found.whole, multipliers=freeze(tuple(map(np.array, found.whole.multipliers)))),
        largest=() if largest is None else freeze(tuple(map(np.array, largest.multipliers))),
        lower=found.lower,
        programs=found.programs,
        theta_max=None if largest is None else Number.of_float(largest.value),
        friction_threshold=None if allowed is None else Number.of_float(allowed),
        gave_up=found.upper.gave_up,
        no_threshold=measured.why_no_threshold,
    )


def thetas(
    pair: ContactPair, measured: Measured, *, progress: Progress = silent
) -> tuple[float, Callable[[float], float | None]]:
    """The largest friction that is allowed, and the function that finds the largest theta at a friction below.

    What it found at a larger friction it starts from, and proves here, too: the conditions grow with k.

    Raises
    ------
    LMIError
    ValueError
        As :func:`work_out`, and without a law of friction.
    """
    if measured.friction_threshold is None:
        raise ValueError(measured.why_no_threshold)
    last = friction_threshold(pair, measured, measured.friction_threshold.value, progress=progress)
    found: dict[float, Certified | None] = {}

    def largest(k: float) -> float | None:
        above = found.get(min((other for other in found if other > k), default=k))
        here = above
        if above is None or above.value < 1:
            progress(f"semidefinite bound: largest theta at k = {k:.3g}", None)
            forms = QuadraticForms(pair, measured, friction=k)
            here = forms.largest_theta(None if above is None else above.early)
            if above is not None and (here is None or here.value < above.value):
                here = replace(above, early=None)
        found[k] = here
        return None if here is None else here.value

    return last, largest
