"""The bounds that follow from constants, and the table of all bounds, from the weakest to the strongest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

from ndtheory import PRINTED, REPAIRED, Constants, EnergyBounds, EnergyConstants, Number, evaluate, evaluate_energy
from ndtheory.bounds import Answer, Edition
from ndtheory.constants import relaxation_factor
from ndtheory.keys import Key, Part, derived, key, says
from ndtheory.number import Level, Numeric, weakest
from ndtheory.texts import did_you_mean
from verification.bounds.bound import Bound, BoundResult, Subject, Thresholds
from verification.document import Document
from verification.machine.progress import Progress, silent
from verification.registry import BOUNDS

if TYPE_CHECKING:
    from verification.constants import Measured

#: The constants that may be given to the calculator, for Section 5 and for the theorem in energy norms.
SECTION_5, ENERGY = ("m", "M", "C_R", "C_s", "C_tr", "k", "C_K"), ("rho", "kappa_1", "kappa_2")

_where = partial(Key, null="where it was not asked for, or was not worked out")

#: The documents of bounds by name.
BY_NAME = {
    "printed": _where(says="the theorem as printed", type="Bound of Section 5"),
    "repaired": _where(says="the theorem as repaired", type="Bound of Section 5"),
    "energy": _where(says="the theorem in energy norms", type="Bound in energy norms"),
    "*": _where(says="a registered bound that follows from constants", type="Registered bound"),
}

_given = partial(Key, says="as given", type="number")

#: The keys of what was given.
INPUTS = {
    **dict.fromkeys(("m", "M", "C_K"), _given(unit="stress", null="where only `--rho` was")),
    "C_R": _given(null="where only `--rho` was"),
    **dict.fromkeys(("C_s", "C_tr"), _given(unit="stress/√length, √length", null="where `C_K` or only `--rho` was")),
    **dict.fromkeys(("k", "theta"), _given(null="where it was not")),
    **dict.fromkeys(ENERGY, _given(null="without the bound in energy norms")),
    "reason": Key(says="why an input is null", type="map of text"),
}

#: Why an edition that its own proof does not cover has no interval: Proposition 5.6 as printed needs the sum.
NO_SUM = "needed M >= 2 m, as M is the sum of the constants of both bodies (4.2)"


class Calculation(Bound):
    """A bound that follows from constants by one of the two theorems."""

    def answer(self, found: Answer, level: Level, *, proved: bool = True, **more: Any) -> BoundResult:
        """The result for an answer from constants of a level."""
        return BoundResult(
            name=self.name,
            proved=proved,
            theta=found.theta,
            factor=found.factor,
            one_minus_factor=found.one_minus_factor,
            interval=found.interval_proved or found.interval,
            interval_level=weakest([level, "verified"]) if found.interval_proved else "float",
            detail=found,
            **more,
        )


class Section5(Calculation):
    """An edition of Proposition 5.6."""

    edition: ClassVar[Edition]

    def evaluate(self, subject: Subject, theta: Numeric | None = None, *, progress: Progress = silent) -> BoundResult:
        if subject.constants is None:
            return self.absent(subject.why)
        found, why = evaluate(self.edition, subject.constants, theta), ""
        friction = Thresholds(every=found.C4, some=found.C2, on="any" if found.C2 is None else found.threshold_on)
        if not found.proved and 2 * subject.constants.m > subject.constants.M:
            found, why, friction = found.without_conclusion(NO_SUM), NO_SUM, Thresholds(on=found.threshold_on)
        elif theta is not None and found.factor is None:
            given = float(subject.constants.C_K if subject.constants.k is None else subject.constants.k)
            why = _why_not(found.interval, found.C2, given, found.theta, subject.varies)
            if self.of_unit and subject.measured is not None:
                why += f" (in {subject.measured.units['stress']})"
        return self.answer(found, subject.constants.level, proved=found.proved, friction=friction, why=why)


class Printed(Section5):
    """As the paper prints it: in a unit of stress in which m >= 1."""

    name, words, edition = "printed", "the theorem as printed", PRINTED
    colour, dashes, fill, hatch = "#555555", ":", "#4A4A4A", "xx"
    finding = of_unit = True

    def remarks(self, result: BoundResult | None, unit: str) -> tuple[str, ...]:
        return (f"{self.name}: its numbers are for stresses in {unit} and change with the unit",)


class Repaired(Section5):
    """With the lost power of m put back: the same in every unit."""

    name, words, edition = "repaired", "the theorem repaired", REPAIRED
    colour, dashes, fill, hatch = "#0B5A94", (0, (5, 1, 1, 1, 1, 1)), "#3F82B5", "//"
    certifies = True


class Energy(Calculation):
    """The same proof as Section 5, with no constant larger than it must be; see ``docs/energy.md``."""

    name, words = "energy", "the theorem in energy norms"
    colour, dashes, fill, hatch = "#00724F", (0, (7, 2)), "#70BB9A", ".."
    attained = True  # without friction
    certifies = True

    def evaluate(self, subject: Subject, theta: Numeric | None = None, *, progress: Progress = silent) -> BoundResult:
        if subject.energy is None:
            return self.absent(subject.why_energy)
        found = evaluate_energy(subject.energy, theta)
        friction = Thresholds(every=found.friction_multiple, some=found.friction_limit_multiple, on="multiple")
        why, without = "", False
        if subject.measured is not None:  # then they are known on k
            measured = subject.measured
            friction = Thresholds(every=measured.friction_threshold, some=measured.friction_limit, on="k")
            without = measured.C_t1 is None  # no friction is allowed
            if theta is not None and found.factor is None:
                why = _why_not(found.interval, friction.some, measured.friction, found.theta, subject.varies)
        friction = Thresholds(on="any") if friction.every is None and not without else friction
        return self.answer(found, subject.energy.level, friction=friction, why=why)

    def objects(self, result: BoundResult, measured: Measured, verdict: str) -> dict[str, Any]:
        """Its document with both rho and both thresholds on k."""
        found = result.detail
        return {self.name: None if found is None else EnergyOfPair(found=found, measured=measured)}


_THRESHOLD: dict[str, Any] = {
    "hint": Number,
    "null": "without a law of friction, or where $C_{t1}$ is infinite",
    "why": lambda of_pair: of_pair.measured.why_no_threshold,
}


@dataclass(frozen=True, kw_only=True)
class EnergyOfPair(Part):
    """The bound in energy norms beside the constants of a pair."""

    part: ClassVar[str] = "Measured bound in energy norms"

    found: EnergyBounds
    measured: Measured

    bound = derived(
        "except that `rho` is `rho_max` of the constants here",
        lambda of_pair: replace(of_pair.found, rho=of_pair.measured.rho_max),
        EnergyBounds,
        spread=True,
    )
    rho_normal = derived("as in the constants", lambda of_pair: of_pair.measured.rho_normal, Number)
    rho_at_work = derived("the one of the two that enters the bound", lambda of_pair: of_pair.found.rho, Number)
    friction_threshold = derived(
        "$k_s$: every small theta contracts below it", lambda of_pair: of_pair.measured.friction_threshold, **_THRESHOLD
    )
    friction_limit = derived(
        "$k_e$: some theta contracts below it", lambda of_pair: of_pair.measured.friction_limit, **_THRESHOLD
    )


def _why_not(
    interval: tuple[float, float] | None, threshold: Number | None, friction: float, theta: float | None, varies: bool
) -> str:
    """Reason why a bound has no conclusion at a theta."""
    if interval is not None and theta is not None:
        return f"theta = {theta:g} is outside ({interval[0]:.2g}, {interval[1]:.2g})"
    if threshold is None:
        return f"friction {friction:g} is above what the bound allows"
    scale = threshold.value
    if varies:
        return f"needed less than {scale / friction:.2g} times the friction along Gamma_c"
    return f"friction {friction:g} {'is at' if friction == scale else 'exceeds'} its limit {scale:.2g}"


BOUNDS.provide(Printed(), Repaired(), Energy())


def certifying() -> tuple[str, ...]:
    """The names of the bounds that can propose a certificate, in the order of :data:`BOUNDS`."""
    return tuple(name for name, bound in BOUNDS.items() if bound.certifies)


def strongest() -> str:
    """The bound that proposes a certificate where none is named: the last of our own, whatever is registered beside."""
    certify = certifying()
    ours = [name for name in BOUNDS.ours if name in certify and not BOUNDS[name].on_request]
    return (ours or certify)[-1]


def chosen(names: Sequence[str] | str | None) -> tuple[str, ...]:
    """The names of some bounds, of a sequence or of a text with commas, in the order of :data:`BOUNDS`.

    None stands for all but those that are worked out on request.

    Raises
    ------
    ValueError
        No name at all, or one that no bound has; the message lists the names there are.

    Examples
    --------
    >>> chosen("energy, printed")
    ('printed', 'energy')
    """
    if names is None:
        return tuple(name for name, bound in BOUNDS.items() if not bound.on_request)
    listed = [name.strip() for name in names.split(",")] if isinstance(names, str) else list(names)
    known = ", ".join(BOUNDS)
    if not any(listed):
        raise ValueError(f"needed one bound at least of {known}")
    for name in listed:
        if name not in BOUNDS:
            raise ValueError(f"no bound {str(name)!r}, there are {known}{did_you_mean(str(name), BOUNDS)}")
    return tuple(name for name in BOUNDS if name in listed)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Calculated(Document):
    """The document of the calculator, ``ndtheory.bounds/1``: results by bound for constants that were given."""

    schema: ClassVar[str] = "ndtheory.bounds/1"
    units: ClassVar[Mapping[str, str]] = {"length": "any", "stress": "that of m"}  # type: ignore[misc]

    constants: Constants | None
    energy: EnergyConstants | None
    theta: Any
    results: Mapping[str, BoundResult] = key(name="editions", inside=BY_NAME)

    @property
    def no_sum(self) -> str:
        """The remark where no two bodies have these m and M; empty elsewhere."""
        given = self.constants
        less = given is not None and 2 * given.m > given.M
        return "M < 2 m: no two bodies have that, as M is the sum M^1 + M^2 (4.2)" if less else ""

    @property
    @says(inside=INPUTS)
    def inputs(self) -> dict[str, Any]:
        """The constants that were given, and theta."""
        given: dict[str, Any] = {name: getattr(self.constants, name, None) for name in SECTION_5}
        given |= {name: getattr(self.energy, name, None) for name in ENERGY}
        given["theta"] = None if self.theta is None else relaxation_factor(self.theta)
        absent = {name: "not given" for name, value in given.items() if value is None}
        return {name: None if value is None else float(value) for name, value in given.items()} | {"reason": absent}

    @property
    @says()
    def reason(self) -> dict[str, str]:
        """Why one of `editions` is null."""
        return {name: result.not_computed for name, result in self.results.items() if result.not_computed}
