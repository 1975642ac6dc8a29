"""Base of every bound on the factor of one step, and its result.

Every bound, from the printed theorem to the semidefinite program, derives from :class:`Bound` and answers with a
:class:`BoundResult`; tables, verdicts, regions, figures and reports loop over :data:`verification.registry.BOUNDS`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from heapq import heappop, heappush
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar

from ndtheory import Constants, EnergyConstants, Number
from ndtheory.bounds import FACTOR, Edition
from ndtheory.keys import Part, document, key, plain, says
from ndtheory.number import Level, Numeric, above, below
from verification.machine.progress import Progress, silent

if TYPE_CHECKING:
    from verification.algorithm.rates import ForceNorm
    from verification.constants import Measured
    from verification.interface.pair import ContactPair

#: The thetas between two values.
Ends = tuple[float, float]

#: Friction values that trace the border of a region, at most.
TRACED = 60

#: Between two of them the border is a straight line if that misses it by at most this share.
MISSED = 8e-3

#: The shares of the largest friction at which tracing begins.
FIRST = (1.0, 0.75, 0.5, 0.25, 1e-4)

#: Why a bound that was left out has no result.
NOT_ASKED = "not asked for"

_BELOW = {"null": "where it was not worked out", "why": "not worked out", "default": None}


@dataclass(frozen=True, kw_only=True)
class Thresholds(Part):
    """Friction that a bound allows; without a law of friction it is on ``any``."""

    every: Number | None = key("friction below which every small theta contracts", name="every_small_theta", **_BELOW)
    some: Number | None = key("friction below which some theta contracts", name="some_theta", **_BELOW)
    on: str = key(
        "what these two bound: `k`, `C_K`, `multiple` (of the friction given) or `any`",
        name="threshold_on",
        default="k",
    )

    def over(self, k: Fraction) -> Thresholds:
        """The same on the factor by which a friction k may grow; unchanged if they are not on k."""
        if self.on != "k" or not k:
            return self
        return Thresholds(every=_over(self.every, k), some=_over(self.some, k), on="multiple")


def _over(number: Number | None, k: Fraction) -> Number | None:
    """A number >= 0 over k > 0, its ends rounded outwards."""
    if number is None:
        return None
    low = None if number.lo is None else below(Fraction(number.lo) / k)
    high = None if number.hi is None else above(Fraction(number.hi) / k)
    return Number.within(number.value / float(k), low, high, number.level)


@dataclass(frozen=True, kw_only=True, eq=False)
class Subject:
    """Constants that were given, or measured of a pair, for which a bound is evaluated.

    ``constants`` are of Section 5, ``energy`` of the theorem in energy norms; ``why`` and ``why_energy``
    say why they do not exist.  ``pair`` and ``measured`` are the bodies and their constants; None where only constants
    were given.  A bound that can be brought closer to the Lipschitz constant is if ``exact``, however long that takes.
    """

    constants: Constants | None = None
    energy: EnergyConstants | None = None
    pair: ContactPair | None = None
    measured: Measured | None = None
    why: str = ""
    why_energy: str = ""
    exact: bool = False

    @classmethod
    def of(cls, pair: ContactPair, measured: Measured, *, exact: bool = False) -> Subject:
        """A pair and its measured constants."""
        return cls(
            constants=measured.constants(),
            energy=measured.energy_constants(),
            pair=pair,
            measured=measured,
            why=measured.why_no_constants,
            why_energy=measured.why_no_energy,
            exact=exact,
        )

    @property
    def varies(self) -> bool:
        """True if the coefficient of friction varies along Gamma_c: k is then the largest one."""
        return self.pair is not None and self.pair.interface.varies

    def at(self, k: float) -> Subject:
        """The same bodies at another friction."""
        assert self.measured is not None
        assert self.pair is not None
        return Subject.of(self.pair.at(friction=k), self.measured.with_friction(k))


def _no_factor(result: BoundResult) -> str:
    return result.why or "no theta was given"


_FACTOR = {"null": "without a conclusion", "why": _no_factor, "default": None}


@dataclass(frozen=True, kw_only=True)
class BoundResult(Part):
    """Result of a bound.

    It is ``proved`` or not; the printed theorem is, where m >= 1.  ``interval_level`` is the level of the interval: at
    any but ``float`` each theta in it is proved to contract.  ``norm`` is the one in which the factor holds; None for
    (5.21). ``why`` says why the factor is missing, ``not_computed`` why nothing was worked out.  ``detail`` is the full
    result of this bound beyond these attributes, which is the document then.
    """

    part: ClassVar[str] = "Registered bound"

    name: str
    proved: bool
    theta: float | None = key(
        "the one of the run", null="where the bound has no conclusion there", why=_no_factor, default=None
    )
    factor: Number | None = key(FACTOR, **_FACTOR)
    one_minus_factor: Number | None = key(FACTOR, **_FACTOR)
    interval: tuple[float, float] | None = key(
        "the thetas that contract", null="where there are none", why="not worked out", default=None
    )
    interval_level: Level = "float"
    friction: Thresholds = key(spread=True, default_factory=Thresholds)
    norm: ForceNorm | None = None
    why: str = ""
    not_computed: str = ""
    detail: Any = None

    @property
    @says(null="without theta", why=_no_factor)
    def verdict(self) -> str | None:
        """``contraction`` or ``no conclusion``."""
        return None if self.theta is None else "contraction" if self.factor is not None else "no conclusion"

    @property
    def asked(self) -> bool:
        """True if the bound was not left out."""
        return self.not_computed != NOT_ASKED

    @property
    def worked_out(self) -> bool:
        """True if the bound has something to show, be it only why it has no conclusion."""
        return self.detail is not None or not self.not_computed

    @property
    def level(self) -> Level:
        """Level of the factor; ``float`` where there is none."""
        return "float" if self.factor is None else self.factor.level

    @property
    def marked(self) -> bool:
        """True if some number is more than one in doubles."""
        numbers = (self.factor, self.friction.every, self.friction.some)
        levels = [self.interval_level, *(number.level for number in numbers if number is not None)]
        return any(level != "float" for level in levels)

    def in_doubles(self) -> BoundResult:
        """The same without enclosures, which prove nothing for an edition whose own proof does not hold."""
        plain = lambda number: None if number is None else Number.of_float(number.value)
        friction = replace(self.friction, every=plain(self.friction.every), some=plain(self.friction.some))
        factor, rest = plain(self.factor), plain(self.one_minus_factor)
        return replace(self, factor=factor, one_minus_factor=rest, interval_level="float", friction=friction)

    def to_dict(self) -> dict[str, Any] | None:  # type: ignore[override]
        """The bound's own document; None where nothing was worked out."""
        if not self.worked_out:
            return None
        found: dict[str, Any] = document(self) if self.detail is None else plain(self.detail)
        return found


@dataclass(frozen=True, kw_only=True)
class Region(Part):
    """The (theta, k) for which a bound proves contraction; below the first friction the region does not shrink."""

    k: tuple[float, ...] = key(
        "friction, increasing: between two of them the border is a straight line, off by at most 1 %"
    )
    theta: tuple[Ends, ...] = key("for each `k` the ends of the interval of theta")
    every: float = key("friction below which every small theta contracts", name="every_small_theta")
    some: float | None = key(
        "friction below which some theta does", name="some_theta", null="where it was not worked out", why=None
    )


class NotComputed(RuntimeError):
    """Why a bound was not worked out."""


class Bound(ABC):
    """A bound on the factor of one step, in the norm (5.21) unless a result has its own.

    Attributes
    ----------
    name, words : str
        Its name in documents and tables; a description for a reader.
    colour, dashes, fill, hatch : str or tuple
        Colour and style of its line in figures, on white; colour (``colour`` by default) and pattern of its region.
    edition : Edition or None
        The edition of Proposition 5.6 that it is; None for another bound.
    finding : bool
        True if a step beyond it is a finding about the paper's text, not a fault: only for the printed theorem.
    calculated : bool
        True if it follows from a few constants, without the matrices of a pair.
    attained : bool
        True if some pairs have a step as long as the bound: :mod:`verification.testing` then looks for one.
    of_unit : bool
        True if its numbers depend on the unit of stress, which is then shown beside them.
    apart : bool
        True if the document of a comparison has it under its name, not among ``bounds.editions``.
    repeats : float
        How closely its factor repeats for the same bodies in other units or for their mirror image.
    on_request : bool
        True if it is worked out only where its name is given.
    certifies : bool
        True if :func:`verification.certify` takes its factor: it is proved by multipliers that :meth:`enclose` returns,
        or by the multipliers of the theorem in energy norms.
    divides : bool
        True if :meth:`enclose` can divide the pieces of T into sets, with multipliers for each.
    """

    name: ClassVar[str]
    words: ClassVar[str]
    colour: ClassVar[str]
    dashes: ClassVar[str | tuple[int, tuple[int, ...]]] = "-."
    fill: ClassVar[str] = ""
    hatch: ClassVar[str] = ""
    edition: ClassVar[Edition | None] = None
    finding: ClassVar[bool] = False
    calculated: ClassVar[bool] = True
    attained: ClassVar[bool] = False
    of_unit: ClassVar[bool] = False
    apart: ClassVar[bool] = False
    repeats: ClassVar[float] = 1e-8
    on_request: ClassVar[bool] = False
    certifies: ClassVar[bool] = False
    divides: ClassVar[bool] = False

    @abstractmethod
    def evaluate(self, subject: Subject, theta: Numeric | None = None, *, progress: Progress = silent) -> BoundResult:
        """Evaluate the bound for a subject, at one theta if it is given, 0 < theta < 1.

        Raises
        ------
        HypothesisError
            theta outside (0, 1).
        """

    def curve(self, subject: Subject, thetas: Sequence[float]) -> list[float | None]:
        """Return the factor of one step at some thetas, None where none is proved."""
        found = [self.evaluate(subject, theta).factor for theta in thetas]
        return [None if factor is None else factor.value for factor in found]

    def region(self, subject: Subject, *, progress: Progress = silent) -> Region:
        """Trace where the bound proves contraction in the plane of theta and k: by its interval at each friction.

        NotComputed where that has no friction to vary.
        """
        found = self.evaluate(subject)
        if found.friction.some is None or found.friction.every is None:
            raise NotComputed(found.not_computed or "needed a law of friction to vary k")
        some = found.friction.some.value
        k, theta = trace(lambda k: self.evaluate(subject.at(k)).interval, some * (1 - 1e-6), TRACED)
        return Region(k=k, theta=theta, every=found.friction.every.value, some=some)

    def remarks(self, result: BoundResult | None, unit: str) -> tuple[str, ...]:
        """Remarks to print beside figures of this bound (beside a region ``result`` is None), in a unit of stress."""
        return ()

    def enclose(self, pair: ContactPair, forms: Any, theta: float, *, exact: bool, progress: Progress) -> Any:
        """Enclose the factor by multipliers of this bound's own, for a certificate; None where it has none.

        ``forms`` are :class:`verification.semidefinite.multipliers.QuadraticForms`, the enclosure is a
        :class:`verification.semidefinite.lipschitz.Enclosure`.

        With ``exact``, which is asked only of a bound that ``divides``, as closely as it can.

        Raises
        ------
        LMIError, ValueError
        """
        return None

    def objects(self, result: BoundResult, measured: Measured, verdict: str) -> dict[str, Any]:
        """The objects that the document of a comparison has of this bound beside ``bounds``, by their keys.

        ``verdict`` is the one of the run on it.

        An object is None where the bound was not worked out; the document then says why.
        """
        return {self.name: result.to_dict()} if self.apart else {}

    def absent(self, why: str) -> BoundResult:
        """The result where nothing was worked out."""
        return BoundResult(name=self.name, proved=False, not_computed=why)


def rest_of(factor: Number) -> Number:
    """1 minus a factor."""
    if factor.hi is None:
        return Number.of_float(1 - factor.value)
    return Number.within(1 - factor.value, below(1 - Fraction(factor.hi)), None, factor.level)


def bounded(results: Iterable[BoundResult]) -> str:
    """The quantity that the thresholds of a table bound, ``k`` or ``C_K``."""
    return next((result.friction.on for result in results if result.friction.on in ("k", "C_K")), "k")


def trace(
    interval: Callable[[float], Ends | None], last: float, most: int
) -> tuple[tuple[float, ...], tuple[Ends, ...]]:
    """Follow the border of a region up to a friction by straight lines, at most so many: halved where one misses it.

    Returns the frictions, and the interval of theta at each.
    """
    ks = [last * share for share in FIRST]
    found = {k: interval(k) for k in ks}
    most_theta = max((high for _, high in filter(None, found.values())), default=1.0)
    lines = [(-math.inf, high, low) for high, low in pairwise(ks)]
    while lines and len(found) < most:
        _, high, low = heappop(lines)
        k = (low + high) / 2
        found[k] = interval(k)
        missed = _missed(found[low], found[k], found[high], (high - low) / k, most_theta)
        if missed > MISSED and high - low > MISSED * high:
            heappush(lines, (-missed, high, k))
            heappush(lines, (-missed, k, low))
    kept = {k: ends for k, ends in sorted(found.items()) if ends is not None}
    return tuple(kept), tuple(kept.values())


def _missed(low: Ends | None, middle: Ends | None, high: Ends | None, width: float, most_theta: float) -> float:
    """The share by which a line between two frictions misses the border halfway.

    Of theta; where theta is small or the border steep, of k and of the largest theta.
    """
    if low is None or middle is None or high is None:
        return math.inf
    missed = 0.0
    for left, at, right in zip(low, middle, high, strict=True):
        off = abs(at - (left + right) / 2)
        if off:
            of_k = off * width / abs(right - left) if left != right else math.inf
            missed = max(missed, min(off / at if at else math.inf, max(off / most_theta, of_k)))
    return missed
