"""Meanings that the ratio of a run of any code can have for rho, and the run to make next, which is never one made."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, ClassVar, Literal

from ndtheory.energy_norms import parallel_theta, predicted_theta
from ndtheory.keys import Part, key
from ndtheory.keys import says as means
from ndtheory.number import below, directed
from verification.coupling.kinds import CONTACT, LARGEST_TO_PASTE, Kind

#: A ratio must be steady over so many steps at least.
FEWEST_STEPS = 10

#: Rows of a log with theta = 1: one more than steps, and some in which the faster modes die out.
ROWS = FEWEST_STEPS + 6

#: How far from 1 the ratio of a residual that stays at a level may come out, at most and at least.  In 52 runs of the
#: model of Section 6 whose contact opened and closed alternately, averages over ten steps lay between 0.92 and 1.11,
#: over twenty between 0.96 and 1.06.
WIDEST, NARROWEST = Fraction(1, 10), Fraction(3, 100)


def shows_most(kind: Kind) -> str:
    """The run that shows most: with theta = 1 a mode is multiplied by ``-lambda``, and an open node by 0."""
    tends = "sqrt(rho)" if kind.parallel else "rho" if kind.signed else "the largest |lambda|"
    given = kind.given("if nothing slips or opens, ")
    rows = f"{ROWS} rows of absolute residuals with theta = 1, if they may be run, as they may diverge"
    return f"{rows}: {given}their ratio tends to {tends}, which relative ones of a run that grows do not show"


def or_at_one(least: float, kind: Kind) -> str:
    """The offer to begin with theta = 1, after a sentence; nothing where rho is known to be above 1, as it grows."""
    return "" if least > 1 else f". Or begin with {shows_most(kind)}"


#: A run with this theta or a larger one shows what one with theta = 1 would.
LIKE_ONE = Fraction(9, 10)

#: Beyond this theta four figures would lead back to a smaller one.
NEXT_TO_1 = Fraction(999, 1000)

#: A run to make next has a theta larger by this factor at least, unless that would come too close to 1.
SHORTEST_STEP = Fraction(9, 8)

_LIMITS: dict[str, Any] = {
    "says": "between which values it lies: scatter, drift and rounding of a window, and the spread of the windows; of "
    "ten windows and more, and where pooled, without the outer tenths",
    "type": "number",
    "unit": "1",
    "of": float,
}

#: The readings that need nodes that open, which a tied interface does not have.
OF_OPEN_NODES = ("open", "level")

#: A run shows nothing new if its theta and another one differ by less than this share, also of 1 - theta.
ANEW = Fraction(1, 100)

#: A ratio is surely below another one by this share of it.
SURE = Fraction(1, 1000)

#: Ratios this close to 1 - theta, as a share of theta and of 1 - theta, are those of open nodes.
SAME = Fraction(1, 20)


@dataclass(frozen=True, kw_only=True)
class RunReading(Part):
    """One possible meaning of the ratio of a run.

    Its ``kind`` is the cause of the pace: the stiffest mode in contact, which changes sign in every step; the softest
    one, which keeps its sign; contact that opens and closes alternately, so that the residual stays at a level; a tied
    run that diverges, so that its relative residual stays at a plateau; nodes that are open.
    """

    part: ClassVar[str] = "Reading of a run"

    kind: Literal["mode-high", "mode-low", "level", "plateau", "open"] = key(
        "`mode-high`, `mode-low`, `level`, `plateau` or `open`"
    )
    value: float | None = key(
        "rho where all of Gamma_c is closed and nothing slides; null where it does not follow, and with friction",
        name="rho.value",
        type="number or null",
        unit="1",
        default=None,
    )
    lo: float | None = key(
        "rho is at least this if the reading is right, without friction or tied; null where that does not bound rho",
        name="rho.lo",
        type="number or null",
        unit="1",
        default=None,
    )

    @property
    @means("null: a run bounds rho from below at most", name="rho.hi", type="number or null", unit="1")
    def hi(self) -> None:
        """No bound from above."""

    @property
    @means("the level of the arithmetic, see **Number**", name="rho.level")
    def level(self) -> str:
        return "float" if self.lo is None else "exact"

    @property
    @means("why `rho.value`, `rho.lo` or `rho.hi` is null")
    def reason(self) -> dict[str, str]:
        why = {"value": "this reading does not tell rho itself", "lo": "this reading does not bound rho"}
        reason = {f"rho.{name}": words for name, words in why.items() if getattr(self, name) is None}
        return {"rho.hi": "a run bounds rho from below at most"} | reason

    says: str = key("the same in words")


@dataclass(frozen=True, kw_only=True)
class NextRun(Part):
    """The run to make next: its theta, and why.

    ``kept`` is True if a run with this theta was made and is to be kept, ``again`` if it is to be made again because
    its log was too short or not steady.
    """

    theta: float = key(unit="1")
    why: str = key("what it will show; it begins with `keep it` where a run with this theta is to be kept")
    kept: bool = False
    again: bool = False


@dataclass(frozen=True, kw_only=True)
class Observed(Part):
    """A number that was read from a run, and its limits; it ``moves`` where a window visibly has not settled."""

    value: Fraction = key("the median over the windows", type="number", unit="1", of=float)
    least: Fraction = key(**_LIMITS)
    most: Fraction = key(**_LIMITS)
    moves: bool = False

    @classmethod
    def of(cls, value: float | Fraction, least: float | Fraction, most: float | Fraction) -> Observed:
        """The exact values of some numbers."""
        return cls(value=Fraction(value), least=Fraction(least), most=Fraction(most))

    @classmethod
    def known(cls, value: Fraction) -> Observed:
        """A number that was given."""
        return cls(value=value, least=value, most=value)

    def of_relaxed(self, theta: Fraction) -> Observed:
        """The plateau of relaxed data where this one is of other data: ``1 + 1/q`` with ``q = theta (1 + rho) - 1``."""
        there = lambda plateau: 1 + 1 / ((1 + 1 / (plateau - 1)) / theta - 1)
        return Observed(value=there(self.value), least=there(self.least), most=there(self.most))

    def __str__(self) -> str:
        return f"{few(self.value)} ({few(self.least)} to {few(self.most)})"


@dataclass(frozen=True, kw_only=True)
class Made:
    """A run that was made: its residual ``falls`` to the end of the log, or it ``rises``: it does not converge.

    ``ratio`` is the ratio by which it falls or grows at most, None where it is not steady and the run did not arrive;
    ``mean`` is its mean over all steps.
    """

    theta: Fraction
    falls: bool
    rises: bool = False
    ratio: Fraction | None = None
    mean: float = 1.0

    @property
    def pace(self) -> float:
        """The ratio, or the mean where it is not steady."""
        return self.mean if self.ratio is None else float(self.ratio)


def few(value: float | Fraction) -> str:
    """A number in four figures."""
    return f"{float(value):.4g}"


def rounded_down(theta: float | Fraction) -> float:
    """A theta in four figures, not above the one meant; next to 1 in four figures of ``1 - theta``."""
    theta = Fraction(theta)
    if NEXT_TO_1 < theta < 1:
        return float(1 - directed(1 - theta, 4, up=True))
    return float(directed(theta, 4, up=False))


def steps_needed(theta: Fraction) -> int:
    """Number of steps over which a ratio must be steady, so that a level differs from a decay."""
    return max(FEWEST_STEPS, math.ceil(5 / theta))


def spread(theta: Fraction) -> Fraction:
    """Largest distance from 1 of the ratio of a residual at a level, averaged over the steps needed."""
    return min(WIDEST, max(NARROWEST, theta / 2))


# --- readings ---------------------------------------------------------------------------------------------------------


def read_observed(
    theta: Fraction, ratio: Observed, kind: Kind = CONTACT, *, measured: bool = False
) -> tuple[tuple[RunReading, ...], NextRun, Fraction | None]:
    """Every reading of a ratio of residuals at theta, the run to make next, and rho of the only reading.

    :func:`verification.coupling.from_runs.advise_run` explains the readings.  Bounds hold for the ratio within its
    limits, and no reading of a part is left out.  rho is None where there are several readings.
    """
    r = ratio.value
    high = (1 + r) / theta - 1
    readings = _readings(theta, ratio, high, kind, measured and 1 - ratio.most > 2 * (ratio.most - ratio.least))
    kinds = [reading.kind for reading in readings]
    best = predicted_theta(high)
    between = 2 / (high + Fraction(7, 4))  # above the best theta of mode-high, below the one at which it diverges
    if kinds == ["mode-high"]:
        following = min(best, LARGEST_TO_PASTE)
        why = f"the best one if rho is {few(high)} and the least eigenvalue 0; smaller than this run's, which converges"
    elif r > 1 + spread(theta):
        following = between
        confirmed = f"a ratio of {few(following * (1 + high) - 1)} there confirms mode-high"
        why = f"smaller, as this run does not converge; {confirmed}; with another ratio, repeat this command"
    elif "level" in kinds:
        following = theta / 2
        why = f"half of {few(theta)}, which does not converge, or hardly; the ratio of that run narrows rho"
    else:
        following = min(between if between >= SHORTEST_STEP * theta else 3 * theta / 2, (1 + theta) / 2)
        confirmed = f"a ratio of {few(following * (1 + high) - 1)} there confirms mode-high"
        why = f"larger; {confirmed}, a smaller one rules it out"
    rho = high if kinds == ["mode-high"] else None
    return readings, NextRun(theta=rounded_down(following), why=why), rho


def _readings(theta: Fraction, ratio: Observed, value: Fraction, kind: Kind, falls: bool) -> tuple[RunReading, ...]:
    """The readings of a ratio; ``value`` is lambda of a mode that changes its sign; what ``falls`` is at no level."""
    r, high, low = ratio.value, (1 + ratio.least) / theta - 1, (1 - ratio.most) / theta - 1
    fastest = f"the stiffest mode in this run has lambda = {few((1 + ratio.most) / theta - 1)} at most"
    given = kind.given("without friction, or tied, ")
    about = f"and about that{kind.given(' if all of Gamma_c stays closed')}"
    proved = f"{given}rho is at least {_at_least(high)}, {about}"
    if ratio.least > 1:
        says = f"the residual grows by this ratio in every step: {proved}"
    elif ratio.least > 1 - theta:
        says = f"the stiffest mode changes its sign in every step: {proved}"
    else:
        says = f"the stiffest mode changes its sign in every step and is the slowest: {proved}"
    found = [RunReading(kind="mode-high", value=float(value), lo=below(high), says=says)]
    if ratio.least <= 1 - theta:
        low = max(low, Fraction(0))
        bound = f"{given}rho is at least {_at_least(low)}"
        says = f"the softest mode keeps its sign and is the slowest: {bound}; {fastest}"
        found.append(RunReading(kind="mode-low", lo=below(low), says=says))
    sure = max(ratio.most - r, r - ratio.least)
    open_too = abs(r - (1 - theta)) <= SAME * min(theta, 1 - theta) + sure
    if open_too:
        says = f"nodes that are open set the pace, 1 - theta a step, whatever rho is; {fastest}"
        found.append(RunReading(kind="open", says=says))
    if ratio.most >= 1 - spread(theta) and ratio.most > 1 - theta and not (open_too or falls):
        found.append(level(theta))
    return tuple(found)


def rho_in_parallel(theta: Fraction, ratio: Fraction) -> Fraction:
    """rho by the ratio of a *parallel* run: ``r^2 = (1 - theta)^2 + theta^2 rho``."""
    return (ratio**2 - (1 - theta) ** 2) / theta**2


def read_parallel(
    theta: Fraction, ratio: Observed, kind: Kind
) -> tuple[tuple[RunReading, ...], NextRun, Fraction | None]:
    """The same for *parallel* coupling, where each mode turns and the stiffest one is always the slowest."""
    least, rho = (rho_in_parallel(theta, r) for r in (ratio.least, ratio.value))
    if ratio.most < (1 - SURE) * (1 - theta):
        why = f"no such coupling falls faster than {few(1 - theta)} a step at {few(theta)}: is it serial?"
        return (), NextRun(theta=rounded_down(theta / 2), why=f"half of it; {why}"), None
    least, rho = max(least, Fraction(0)), max(rho, Fraction(0))
    given = kind.given("without friction, or tied, ")
    says = f"the stiffest mode turns and is the slowest: {given}rho is at least {_at_least(least)}"
    found = [RunReading(kind="mode-high", value=float(rho), lo=below(least), says=says)]
    if not kind.linear and ratio.most >= 1 - spread(theta):
        found.append(level(theta))
    why = f"1/(1 + rho) with rho = {few(rho)}"
    decides = None if len(found) > 1 else rho
    return tuple(found), NextRun(theta=rounded_down(min(parallel_theta(rho), LARGEST_TO_PASTE)), why=why), decides


def read_plateau(theta: Fraction, plateau: Observed) -> tuple[tuple[RunReading, ...], NextRun]:
    """The readings of a relative residual ``|T g - g|/|T g|`` that stays at P > 1, and the run to make next.

    In a tied run that diverges the stiffest mode remains of g, of which ``T g`` is ``-rho`` times, so that
    ``P = (1 + rho)/rho``.  It diverges only where ``theta (1 + rho) > 2``: a larger P is none of these plateaus.
    """
    least = 2 / theta - 1
    rho = 1 / (plateau.value - 1)
    found = []
    following, why = theta / 2, f"half of {few(theta)}, which does not converge; its log narrows rho"
    if rho > least:
        at = f"the relative residual of relaxed data at {few(plateau.value)} = 1 + 1/rho"
        says = f"a tied run diverges, {at}: nothing opens or slides"
        lo = max(1 / (plateau.most - 1), least)
        found.append(RunReading(kind="plateau", value=float(rho), lo=below(lo), says=says))
        following = 2 / (rho + Fraction(7, 4))
        why = f"smaller; a ratio of {few(following * (1 + rho) - 1)} there confirms plateau"
    return (*found, level(theta)), NextRun(theta=rounded_down(following), why=why)


def level(theta: Fraction, bounds: bool = True) -> RunReading:
    """A residual that stays at a level, or grows only for a while; with ``bounds`` it bounds rho without friction."""
    least = 2 / theta - 1
    says = "contact opens and closes alternately, and the residual stays at a level or grows for a while only"
    if bounds:
        says += ": without friction, if a longer run stays there too, and with solvers more accurate than that level, "
        says += f"rho is at least {_at_least(least)}; with friction this does not bound rho"
    else:
        says += ", or the solvers of both sides are not more accurate: this says nothing about rho"
    return RunReading(kind="level", lo=below(least) if bounds else None, says=says)


def _at_least(value: Fraction) -> str:
    """A bound from below in four figures, not above it."""
    return few(Fraction(directed(value, 4, up=False)))


# --- the run to make next ---------------------------------------------------------------------------------------------


def same_run(theta: Fraction | float, other: Fraction) -> bool:
    """True if a run with this theta shows nothing that one with the other does not."""
    near = abs(Fraction(theta) - other) < ANEW * (other if other > 1 else min(other, 1 - other))
    return near or f"{float(theta):g}" == f"{float(other):g}"


def kept(theta: Fraction, why: str) -> NextRun:
    """The theta of a run that is to be kept."""
    return NextRun(theta=float(theta), why=why if why.startswith("keep it") else f"keep it: {why}", kept=True)


def best_if(rho: Fraction, because: str, least: Fraction = Fraction(0)) -> NextRun:
    """The best theta for a rho, no smaller than the ``least`` one that may be given."""
    theta = max(min(predicted_theta(rho), LARGEST_TO_PASTE), least)
    return NextRun(theta=rounded_down(theta), why=f"2/(2 + rho) with rho = {few(rho)}, {because}")


def fastest_of(made: Sequence[Made]) -> NextRun:
    """The fastest run, to be kept where its log shows that it is, or made again over more steps."""
    best = min(made, key=lambda one: (one.pace, one.theta))
    falls = f"it falls fastest of these runs, by {best.pace:.3g} a step"
    if best.ratio is not None:
        return kept(best.theta, falls)
    return near(best.theta, made, f"{few(best.theta)} {falls[3:]} in the mean, and shows no steady ratio")


def near(theta: Fraction, made: Sequence[Made], why: str) -> NextRun:
    """A run at a theta, or a little below it where one was made there, over enough steps."""
    given = theta
    while any(same_run(theta, one.theta) for one in made):
        theta *= Fraction(9, 10)
    steps = 2 * steps_needed(theta)
    below = "a little smaller, " * (theta < given)
    return NextRun(theta=rounded_down(theta), why=f"{below}{steps} steps or more in one time window: {why}")


def pasted_or_not(following: NextRun, made: Sequence[Made]) -> NextRun | None:
    """The theta to paste: kept where a run with it falls; None where it is not below all that do not converge."""
    low = min((one.theta for one in made if one.rises), default=None)
    if low is not None and (following.theta > low or same_run(following.theta, low)):
        return None
    twin = next((one for one in made if same_run(following.theta, one.theta)), None)
    return following if twin is None or following.kept else kept(twin.theta, following.why)


def at_risk(following: NextRun, made: Sequence[Made]) -> NextRun:
    """The run that is proposed, with a warning where it is none of those made and no such theta or larger one falls."""
    low = max((one.theta for one in made if one.falls), default=Fraction(0))
    if following.kept or following.again or following.theta <= low:
        return following
    falls = f"; {few(low)} falls in its log, and near that solution a smaller theta does too" if low else ""
    return replace(following, why=f"{following.why}; it may diverge there{falls}")


def anew(following: NextRun, made: Sequence[Made]) -> NextRun:
    """The run that was proposed, or another one where a run with that theta was made.

    Between the largest theta that falls and the next one above it, or above all of them, or below all where none falls;
    the fastest run is kept where that leaves no other theta.  A log that is too short is asked for again where there
    are none at another theta.
    """
    thetas = [one.theta for one in made]
    again = following.again and all(same_run(thetas[0], theta) for theta in thetas)
    if following.kept or again or not any(same_run(following.theta, theta) for theta in thetas):
        return following
    falling = [one for one in made if one.falls]
    low = max((one.theta for one in falling), default=None)
    if low is None:
        theta, why = min(thetas) / 2, "half of the smallest theta so far, as no run is seen to converge"
    elif beyond := [theta for theta in thetas if theta > low]:
        high = min(beyond)
        theta = Fraction(math.sqrt(low * high)) if high > SHORTEST_STEP * low else low
        why = f"between {few(low)}, which falls, and {few(high)}, which does not or shows no ratio"
    else:
        theta = min(3 * low / 2, (1 + low) / 2) if SHORTEST_STEP * low < 1 else low
        why = f"larger than {few(low)}, which falls"
    if theta == low:
        return fastest_of(falling)
    steps = f"{steps_needed(theta)} steps or more in one time window"
    return NextRun(theta=rounded_down(theta), why=f"{why}; give all logs together, the new one with {steps}")
