"""What the ratio of a run of any code can mean for rho, and the run that decides."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Literal

from ndtheory.energy_norms import predicted_theta
from ndtheory.number import below, directed

#: The largest theta that is offered to paste.
LARGEST_TO_PASTE = Fraction(99, 100)

#: A ratio must be steady over so many steps at least.
FEWEST_STEPS = 10

#: How far from 1 the ratio of a residual that stays at a level may come out, at most and at least.  In 52 runs of the
#: model of Section 6 whose contact opened and closed in turn, averages over ten steps lay between 0.92 and 1.11, over
#: twenty between 0.96 and 1.06.
WIDEST, NARROWEST = Fraction(1, 10), Fraction(3, 100)

#: Beyond this theta four figures would lead back to a smaller one.
NEXT_TO_1 = Fraction(999, 1000)

#: A run to make next has a theta larger by this factor at least, unless that would come too close to 1.
SHORTEST_STEP = Fraction(9, 8)

#: The readings that need nodes that open: none of a tied interface.
OF_OPEN_NODES = ("open", "level")

#: A run shows nothing new if its theta and another one differ by less than this share, also of 1 - theta.
ANEW = Fraction(1, 100)

#: Ratios this close to 1 - theta, as a share of theta and of 1 - theta, are those of open nodes.
SAME = Fraction(1, 20)


def steps_needed(theta: Fraction) -> int:
    """Over how many steps at least a ratio must be steady, for a level to be told from a decay."""
    return max(FEWEST_STEPS, math.ceil(5 / theta))


@dataclass(frozen=True, kw_only=True)
class RunReading:
    """One thing that the ratio of a run can mean.

    Attributes
    ----------
    kind : {'mode-high', 'mode-low', 'level', 'plateau', 'open'}
        What sets the pace: the stiffest mode in contact, which changes sign in every step; the softest one, which keeps
        its sign; contact that opens and closes in turn, so that the residual stays at a level; a tied run that
        diverges, so that its relative residual stays at a plateau; nodes that are open.
    value : float or None
        rho where all of Gamma_c is closed and nothing slides; None where the reading gives a bound at most.
    lo : float or None
        If this reading is right, rho is at least this without friction, or tied.
    says : str
        The same in words.
    """

    kind: Literal["mode-high", "mode-low", "level", "plateau", "open"]
    value: float | None = None
    lo: float | None = None
    says: str

    def to_dict(self) -> dict[str, Any]:
        """A member of ``readings``; the level is that of the arithmetic."""
        reason = {"rho.hi": "a run bounds rho from below at most"}
        if self.value is None:
            reason["rho.value"] = "this reading does not tell rho itself"
        if self.lo is None:
            reason["rho.lo"] = "this reading does not bound rho"
        rho = {"value": self.value, "lo": self.lo, "hi": None, "level": "float" if self.lo is None else "exact"}
        return {"kind": self.kind, "rho": rho, "says": self.says, "reason": reason}


@dataclass(frozen=True, kw_only=True)
class NextRun:
    """The run to make next: its theta, and what it will show.

    Attributes
    ----------
    theta : float
    why : str
    kept : bool
        True if a run with this theta was made and is to be kept.
    again : bool
        True if that run is to be made again because its log was too short or not steady.
    """

    theta: float
    why: str
    kept: bool = False
    again: bool = False

    def to_dict(self) -> dict[str, Any]:
        """The object ``next``."""
        return {"theta": self.theta, "why": self.why}


@dataclass(frozen=True, kw_only=True)
class SeenRun:
    """What was given of a run of any code with constant theta.

    Attributes
    ----------
    theta : Fraction
    ratio : Fraction
        Of the residual ``|T g - g|``, absolute and before relaxation, from one step to the next.
    """

    theta: Fraction
    ratio: Fraction

    @property
    def steps(self) -> int:
        """Over how many steps at least the ratio must be steady."""
        return steps_needed(self.theta)

    def to_dict(self) -> dict[str, Any]:
        """The object ``run``."""
        return {
            "theta": float(self.theta),
            "ratio": float(self.ratio),
            "residual": "|Tg - g|, absolute and unrelaxed",
            "steady_over": self.steps,
        }


@dataclass(frozen=True, kw_only=True)
class Observed:
    """A number that was read from a run, and between which values it lies.

    Attributes
    ----------
    value, least, most : Fraction
    """

    value: Fraction
    least: Fraction
    most: Fraction

    @classmethod
    def known(cls, value: Fraction) -> Observed:
        """A number that was given."""
        return cls(value=value, least=value, most=value)


def read_ratio(theta: Fraction, r: Fraction) -> tuple[SeenRun, tuple[RunReading, ...], NextRun, Fraction | None]:
    """Every reading of a ratio r of residuals at theta, and the run to make next.

    :func:`verification.advice.from_runs.advise_run` says what the readings are.

    Returns
    -------
    run, readings, next, rho
        rho of the only reading that is left; None where there are several.
    """
    return SeenRun(theta=theta, ratio=r), *read_observed(theta, Observed.known(r))


def read_observed(theta: Fraction, ratio: Observed) -> tuple[tuple[RunReading, ...], NextRun, Fraction | None]:
    """The same of a ratio known within limits: bounds hold for all of it, and no reading of a part is left out."""
    r = ratio.value
    high = (1 + r) / theta - 1
    readings = _readings(theta, ratio, high)
    kinds = [reading.kind for reading in readings]
    best = predicted_theta(high)
    between = 2 / (high + Fraction(7, 4))  # above the best theta of mode-high, below the one at which it diverges
    if kinds == ["mode-high"]:
        following = min(best, LARGEST_TO_PASTE)
        why = f"the best one if rho is {_few(high)}, and smaller than that of this run, which converges"
    elif r > 1 + spread(theta):
        following = between
        confirmed = f"a ratio of {_few(following * (1 + high) - 1)} there confirms mode-high"
        why = f"smaller, as this run does not converge; {confirmed}, and else come back with what you see"
    elif "level" in kinds:
        following = theta / 2
        why = f"half of {_few(theta)}, which does not converge, or hardly; come back with the ratio that you see there"
    else:
        following = min(between if between >= SHORTEST_STEP * theta else 3 * theta / 2, (1 + theta) / 2)
        confirmed = f"a ratio of {_few(following * (1 + high) - 1)} there confirms mode-high"
        why = f"larger; {confirmed}, a smaller one rules it out"
        if following * (1 + high) >= 2:
            why += f"; if the residual does not fall there, keep {_few(theta)}, which converges"
    rho = high if kinds == ["mode-high"] else None
    return readings, NextRun(theta=rounded_down(following), why=why), rho


def read_plateau(theta: Fraction, plateau: Observed) -> tuple[tuple[RunReading, ...], NextRun]:
    """The readings of a relative residual ``|T g - g|/|T g|`` that stays at P > 1, and the run to make next.

    In a tied run that diverges the stiffest mode remains of g, of which ``T g`` is ``-rho`` times, so that
    ``P = (1 + rho)/rho``.  It diverges where ``theta (1 + rho) > 2`` alone: a larger P is none of these plateaus.
    """
    least = 2 / theta - 1
    rho = 1 / (plateau.value - 1)
    found = []
    following, why = theta / 2, f"half of {_few(theta)}, which does not converge; come back with its log"
    if rho > least:
        says = (
            f"a tied run diverges, its relative residual at {_few(plateau.value)} = 1 + 1/rho: nothing opens or slides"
        )
        lo = max(1 / (plateau.most - 1), least)
        found.append(RunReading(kind="plateau", value=float(rho), lo=below(lo), says=says))
        following = 2 / (rho + Fraction(7, 4))
        why = f"smaller; a ratio of {_few(following * (1 + rho) - 1)} there confirms plateau"
    found.append(level(theta))
    return tuple(found), NextRun(theta=rounded_down(following), why=why)


def check_assumed(tied: bool, friction: bool) -> None:
    """Raise ValueError where an interface is both tied and with friction."""
    if tied and friction:
        raise ValueError("tied with friction: needed one of them, as nothing slips on a tied interface")


def assumed(tied: bool, friction: bool) -> str:
    """The assumption under which runs are read."""
    if friction:
        return "there is friction, with which no ratio of residuals bounds rho"
    return "nothing opens or slips" if tied else "no friction, or a tied interface"


def same_run(theta: Fraction | float, other: Fraction) -> bool:
    """True if a run with this theta shows nothing that one with the other does not."""
    near = abs(Fraction(theta) - other) < ANEW * min(other, 1 - other)
    return near or f"{float(theta):g}" == f"{float(other):g}"


def level(theta: Fraction, bounds: bool = True) -> RunReading:
    """A residual that stays at a level, or grows for a while only; whether that tells of rho."""
    least = 2 / theta - 1
    says = "contact opens and closes in turn, and the residual stays at a level or grows for a while only"
    if bounds:
        says += (
            f": without friction rho is at least {_at_least(least)}, nothing more; "
            "with friction this does not bound rho"
        )
    else:
        says += ", or the solvers of both sides are no more accurate: this says nothing of rho"
    return RunReading(kind="level", lo=below(least) if bounds else None, says=says)


def _readings(theta: Fraction, ratio: Observed, value: Fraction) -> tuple[RunReading, ...]:
    """What a ratio can mean; ``value`` is the lambda of a mode that changes its sign."""
    r, high, low = ratio.value, (1 + ratio.least) / theta - 1, (1 - ratio.most) / theta - 1
    fastest = f"the stiffest mode in this run has lambda = {_few((1 + ratio.most) / theta - 1)} at most"
    about = "and about that if all of Gamma_c stays closed"
    proved = f"without friction, or tied, rho is at least {_at_least(high)}, {about}"
    found = []
    if ratio.least > 1:
        says = f"the residual grows by this ratio in every step: {proved}"
    elif ratio.least > 1 - theta:
        says = f"the stiffest mode changes its sign in every step: {proved}"
    else:
        says = f"the stiffest mode changes its sign in every step and is the slowest: {proved}"
    found.append(RunReading(kind="mode-high", value=float(value), lo=below(high), says=says))
    if ratio.least <= 1 - theta:
        low = max(low, Fraction(0))
        bound = f"without friction, or tied, rho is at least {_at_least(low)}"
        says = f"the softest mode keeps its sign and is the slowest: {bound}; {fastest}"
        found.append(RunReading(kind="mode-low", lo=below(low), says=says))
    sure = max(ratio.most - r, r - ratio.least)
    open_too = abs(r - (1 - theta)) <= SAME * min(theta, 1 - theta) + sure
    if open_too:
        says = f"nodes that are open set the pace, 1 - theta a step, whatever rho is; {fastest}"
        found.append(RunReading(kind="open", says=says))
    if ratio.most >= 1 - spread(theta) and ratio.most > 1 - theta and not open_too:
        found.append(level(theta))
    return tuple(found)


def spread(theta: Fraction) -> Fraction:
    """How far from 1 the ratio of a residual that stays at a level may come out, averaged over the steps asked for."""
    return min(WIDEST, max(NARROWEST, theta / 2))


def _few(value: Fraction) -> str:
    return f"{float(value):.4g}"


def _at_least(value: Fraction) -> str:
    """A bound from below in four figures, not above it."""
    return f"{float(directed(value, 4, up=False)):.4g}"


def rounded_down(theta: Fraction) -> float:
    """A theta in four figures, not above the one meant; next to 1 in four figures of ``1 - theta``."""
    if theta > NEXT_TO_1:
        return float(1 - directed(1 - theta, 4, up=True))
    return float(directed(theta, 4, up=False))
