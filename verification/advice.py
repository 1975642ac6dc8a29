"""Which body gets the Neumann problem, and which theta: advice from the theorem and from rho."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import ROUND_DOWN, Context, Decimal
from fractions import Fraction
from typing import Any, ClassVar, Literal

import numpy as np

from fem1d2d import largest
from fem1d2d.mesh import Floats
from ndtheory import EnergyConstants, Number, SharpBounds, evaluate_sharp, exact
from ndtheory.constants import take
from ndtheory.sharp import LARGEST, SMALLEST, predicted_factor, predicted_rate, predicted_theta
from verification.bodies import build
from verification.document import Document
from verification.matrices import check_matrix, size
from verification.measured import Measured, measure
from verification.pair import Pair
from verification.problem import Problem
from verification.reader import ProblemError
from verification.relaxation import momentum_step
from verification.threads import one_thread

#: A theta chosen for the user stays below 1 by this much, however soft the contact body.
CLOSEST_TO_ONE = 1 - 1e-6

#: An automatic theta need not be a proved one that takes more than so many times the steps of the predicted one.
TOO_SLOW = 2

#: The largest theta that is offered to paste.
LARGEST_TO_PASTE = Fraction(99, 100)

#: A ratio must be steady over so many steps at least.
FEWEST_STEPS = 10

#: How far from 1 the ratio of a residual that stays at a level may come out, at most and at least.  In 52 runs of the
#: model of Section 6 whose contact opened and closed in turn, averages over ten steps lay between 0.92 and 1.11, over
#: twenty between 0.96 and 1.06.
WIDEST, NARROWEST = Fraction(1, 10), Fraction(3, 100)

#: A run to make next has a theta larger by this factor at least, unless that would come too close to 1.
SHORTEST_STEP = Fraction(9, 8)

#: Ratios this close to 1 - theta, as a share of theta and of 1 - theta, are those of open nodes.
SAME = Fraction(1, 20)

#: What is unknown of matrices and runs from elsewhere.
UNITS = {"length": "any", "stress": "any"}


@dataclass(frozen=True, kw_only=True)
class Role:
    """What is known of the iteration when one body gets the Neumann problem.

    Attributes
    ----------
    neumann_body : {1, 2} or None
        None where it is not known which body that is.
    rho : Number
        Stiffness of the contact body over that of the Neumann body, at worst; with rho_normal without friction.
    theta_proved : float or None
        The theta of least proved factor.
    factor_proved, theta_max_proved : Number or None
    theta_predicted, rate_predicted : float
        ``2/(2 + rho)`` and ``rho/(2 + rho)``: a prediction, proved without friction.
    friction_threshold : Number or None
        Friction below which every small theta is proved.
    singular : bool
        Whether the Neumann problem has no unique solution; such roles are refused, so always False here.
    reason : mapping
        Why a value is None.
    theta_auto : Choice or None
        What ``theta = "auto"`` takes in these roles; None where there is no problem file.
    """

    neumann_body: Literal[1, 2] | None
    rho: Number
    theta_proved: float | None
    factor_proved: Number | None
    theta_max_proved: Number | None
    theta_predicted: float
    rate_predicted: float
    friction_threshold: Number | None
    reason: Mapping[str, str]
    singular: bool = False
    theta_auto: Choice | None = None

    def to_dict(self) -> dict[str, Any]:
        """A member of ``roles``."""
        values = {name: getattr(self, name) for name in self.__dataclass_fields__}
        values["reason"] = dict(self.reason)
        if self.theta_auto is None:
            values["reason"]["theta_auto"] = "no problem file"
        return {name: v.to_dict() if isinstance(v, (Number, Choice)) else v for name, v in values.items()}


@dataclass(frozen=True, kw_only=True)
class Reading:
    """One thing that the ratio of a run can mean.

    Attributes
    ----------
    kind : {'mode-high', 'mode-low', 'level', 'open'}
        What sets the pace: the stiffest mode in contact, which changes sign in every step; the softest one, which keeps
        its sign; contact that opens and closes in turn, so that the residual stays at a level; nodes that are open.
    value : float or None
        rho where all of Gamma_c is closed and nothing slides; None where the reading gives a bound at most.
    lo : float or None
        If this reading is right, rho is at least this without friction, or tied.
    says : str
        The same in words.
    """

    kind: Literal["mode-high", "mode-low", "level", "open"]
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
    """The run to make next: its theta, and what it will show."""

    theta: float
    why: str

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
        """Over how many steps at least the ratio must be steady, for a level to be told from a decay."""
        return max(FEWEST_STEPS, math.ceil(5 / self.theta))

    def to_dict(self) -> dict[str, Any]:
        """The object ``run``."""
        return {
            "theta": float(self.theta),
            "ratio": float(self.ratio),
            "residual": "|Tg - g|, absolute and unrelaxed",
            "steady_over": self.steps,
        }


@dataclass(frozen=True, kw_only=True)
class Advice(Document):
    """The advice.

    Attributes
    ----------
    neumann_body : {1, 2} or None
        Who should get the Neumann problem; None where one run tells nothing of the other assignment.
    roles : tuple of Role
        The file's assignment first; of a run the one that it had, and none while its ratio has several readings.
    friction : float or None
        None where it is not known.
    outside : tuple of str
        Why the theorem does not speak of the problem.
    run : SeenRun or None
        What was given of a run; None where the advice comes from a problem or from matrices.
    readings : tuple of Reading
        What that run can mean.
    next : NextRun or None
        The run to make next.
    """

    schema: ClassVar[str] = "ndtheory.advice/1"

    neumann_body: Literal[1, 2] | None
    roles: tuple[Role, ...]
    units: Mapping[str, str]
    friction: float | None = None
    outside: tuple[str, ...] = ()
    run: SeenRun | None = None
    readings: tuple[Reading, ...] = ()
    next: NextRun | None = None

    @property
    def best(self) -> Role:
        """The role that is advised; the only one where there is no choice.

        Raises
        ------
        ValueError
            The ratio of a run has several readings: ``next`` is the run to make.
        """
        if not self.roles:
            raise ValueError("the ratio of this run has several readings: make the run that `next` names")
        return next((r for r in self.roles if r.neumann_body == self.neumann_body), self.roles[0])

    def content(self) -> dict[str, Any]:
        reason = {} if self.neumann_body else {"neumann_body": "one run tells nothing of the other assignment"}
        if self.run is None:
            reason |= dict.fromkeys(("run", "next"), "no run was given")
        return {
            "neumann_body": self.neumann_body,
            "roles": [role.to_dict() for role in self.roles],
            "run": None if self.run is None else self.run.to_dict(),
            "readings": [reading.to_dict() for reading in self.readings],
            "next": None if self.next is None else self.next.to_dict(),
            "outside_theorem": list(self.outside),
            "reason": reason,
        }


def advise(problem: Problem) -> Advice:
    """Advise on the roles of the bodies and on theta.

    The body whose prediction ``rho/(2 + rho)`` is smaller gets the Neumann problem.

    Raises
    ------
    ProblemError
        As :func:`verification.measure`, and where the bodies hold different components of Gamma_c.

    Examples
    --------
    >>> bars = {"dimension": 1,
    ...     "body1": {"shape": "interval", "x": [0, 1], "cells": 8, "young": 3, "fixed": ["left"]},
    ...     "body2": {"shape": "interval", "x": [1, 2], "cells": 8, "young": 1, "fixed": ["right"]}}
    >>> found = advise(Problem.from_dict(bars))
    >>> found.neumann_body, round(found.best.theta_predicted, 6)
    (1, 0.857143)
    """
    pair = build(problem)
    roles = tuple(_role(problem_, pair) for problem_ in (problem, problem.swapped()))
    best = min(roles, key=lambda role: role.rate_predicted)
    return Advice(
        neumann_body=best.neumann_body,
        roles=roles,
        units=problem.units,
        friction=float(problem.contact.friction),
        outside=tuple(pair.outside),
    )


def _role(problem: Problem, pair: Pair) -> Role:
    measured = measure(replace(pair, problem=problem))
    sharp = sharp_bounds(measured)
    if sharp is None:
        why = next(iter(measured.reason.values()))
        raise ProblemError(problem.source, "contact", None, f"no advice: {why}")
    outside = pair.outside
    threshold = None if outside else measured.friction_threshold
    if outside:
        proved = ("theta_proved", "factor_proved", "theta_max_proved", "friction_threshold")
        reason = dict.fromkeys(proved, f"outside the theorem: {outside[0]}")
    else:
        reason = {name: why for name, why in sharp.reason.items() if name in Role.__dataclass_fields__}
        if threshold is None:
            reason["friction_threshold"] = "no law of friction"
    return Role(
        neumann_body=problem.iteration.neumann_body,
        rho=sharp.rho,
        theta_proved=None if outside else sharp.theta_proved,
        factor_proved=None if outside else sharp.factor_proved,
        theta_max_proved=None if outside else sharp.theta_max_proved,
        theta_predicted=sharp.theta_predicted,
        rate_predicted=sharp.rate_predicted,
        friction_threshold=threshold,
        reason=reason,
        theta_auto=automatic(sharp, outside, problem.iteration.tolerance),
    )


def sharp_bounds(measured: Measured, theta: Any = None) -> SharpBounds | None:
    """The theorem in energy norms for measured constants; None where they do not exist."""
    constants = measured.energy_constants()
    return None if constants is None else evaluate_sharp(constants, theta)


def advise_matrices(S1: Floats, S2: Floats) -> Advice:
    """Advice from the interface stiffness matrices alone, free of friction.

    Parameters
    ----------
    S1, S2 : array, shape (n, n)
        Schur complements of bodies 1 and 2 on the same interface unknowns; symmetric positive definite.

    Raises
    ------
    ValueError
        Matrices that are not square, finite, symmetric or positive definite, or do not fit.
    """
    for name, matrix in (("S1", S1), ("S2", S2)):
        check_matrix(name, matrix)
    if S1.shape != S2.shape:
        raise ValueError(f"S1 is {size(S1)}, S2 is {size(S2)}: needed matrices on the same interface unknowns")
    unit_1, unit_2 = float(np.abs(S1).max()), float(np.abs(S2).max())
    one, two = S1 / unit_1, S2 / unit_2  # entries of order 1, whatever the unit
    with one_thread():
        ratios = {2: Fraction(largest(one, two).value), 1: Fraction(largest(two, one).value)}
    unit = {2: Fraction(unit_1) / Fraction(unit_2), 1: Fraction(unit_2) / Fraction(unit_1)}
    roles = tuple(_plain_role(neumann, rho * unit[neumann]) for neumann, rho in ratios.items())
    best = min(roles, key=lambda role: role.rate_predicted)
    return Advice(neumann_body=best.neumann_body, roles=roles, units=UNITS)


def _plain_role(neumann_body: Any, rho: Fraction) -> Role:
    bounds = evaluate_sharp(EnergyConstants(rho=rho))
    return Role(
        neumann_body=neumann_body,
        rho=bounds.rho,
        theta_proved=bounds.theta_proved,
        factor_proved=bounds.factor_proved,
        theta_max_proved=bounds.theta_max_proved,
        theta_predicted=bounds.theta_predicted,
        rate_predicted=bounds.rate_predicted,
        friction_threshold=None,
        reason={"friction_threshold": "matrices alone say nothing of friction: the proved values are for k = 0"},
    )


def advise_run(theta: Any, ratio: Any) -> Advice:
    """What one run of any code with constant theta says of rho, and the run to make next.

    While contact does not change, a mode is multiplied by ``1 - theta (1 + lambda)`` in a step, with lambda at most
    rho, and an open node by ``1 - theta``.  A residual has no sign, so that a ratio r of residuals can mean

    * ``mode-high``: ``lambda = (1 + r)/theta - 1``.  Without friction or tied, rho is at least that wherever
      ``r > 1 - theta``, since no step is longer than ``max(1 - theta, |1 - theta - theta rho|)``;
    * ``mode-low``: ``lambda = (1 - r)/theta - 1``, where ``r <= 1 - theta``;
    * ``open``: nothing of rho, where r is about ``1 - theta``;
    * ``level``: contact opens and closes in turn, where r is about 1 or the growth does not last.  Without friction
      theta does not contract, so that rho is at least ``2/theta - 1``.

    With friction none of these bounds is proved.

    Parameters
    ----------
    theta : number
        The run's relaxation factor, 0 < theta <= 1.
    ratio : number
        r > 0, that of the absolute unrelaxed residual ``|T g - g|`` from one step to the next, steady over the last ten
        steps or more, and over ``5/theta`` where these are more; above 1 where the run diverged, and 1 where the
        residual rises and falls and has no steady ratio.

    Raises
    ------
    HypothesisError

    Examples
    --------
    >>> found = advise_run("0.1", "1.4")
    >>> [(reading.kind, reading.lo) for reading in found.readings], found.next.theta
    ([('mode-high', 23.0), ('level', 19.0)], 0.0808)
    >>> advise_run("0.45", "0.8").best.rho.value
    3.0
    """
    t = take("theta", theta, "the theta of a run, 0 < theta <= 1 (1e-75 or more)", lambda v: SMALLEST <= v <= 1)
    needed = "the ratio of consecutive residuals, a number > 0 (1e-75 to 1e75)"
    r = take("ratio", ratio, needed, lambda v: SMALLEST <= v <= LARGEST)
    high, low = (1 + r) / t - 1, (1 - r) / t - 1
    readings = _readings(t, r, high, low)
    kinds = [reading.kind for reading in readings]
    best = predicted_theta(high)
    between = 2 / (high + Fraction(7, 4))  # above the best theta of mode-high, below the one at which it diverges
    roles: tuple[Role, ...] = ()
    if kinds == ["mode-high"]:
        roles = (_role_of_run(high),)
        following = min(best, LARGEST_TO_PASTE)
        why = f"the best one if rho is {_few(high)}, and smaller than that of this run, which converges"
    elif r > 1 + _spread(t):
        following = between
        confirmed = f"a ratio of {_few(following * (1 + high) - 1)} there confirms mode-high"
        why = f"smaller, as this run does not converge; {confirmed}, and else come back with what you see"
    elif "level" in kinds:
        following = t / 2
        why = f"half of {_few(t)}, which does not converge, or hardly; come back with the ratio that you see there"
    else:
        following = min(between if between >= SHORTEST_STEP * t else 3 * t / 2, (1 + t) / 2)
        confirmed = f"a ratio of {_few(following * (1 + high) - 1)} there confirms mode-high"
        why = f"larger; {confirmed}, a smaller one rules it out"
        if following * (1 + high) >= 2:
            why += f"; if the residual does not fall there, keep {_few(t)}, which converges"
    return Advice(
        neumann_body=None,
        roles=roles,
        units=UNITS,
        run=SeenRun(theta=t, ratio=r),
        readings=readings,
        next=NextRun(theta=_rounded_down(following), why=why),
    )


def _readings(theta: Fraction, r: Fraction, high: Fraction, low: Fraction) -> tuple[Reading, ...]:
    """What a ratio r can mean; ``high`` and ``low`` are the lambda of a mode that changes or keeps its sign."""
    fastest = f"the stiffest mode in this run has lambda = {_few(high)} at most"
    proved = f"without friction, or tied, rho is at least {_few(high)}, and about that if all of Gamma_c stays closed"
    found = []
    if r > 1:
        says = f"the residual grows by this ratio in every step: {proved}"
    elif r > 1 - theta:
        says = f"the stiffest mode changes its sign in every step: {proved}"
    else:
        says = f"the stiffest mode changes its sign in every step and is the slowest: {proved}"
    found.append(Reading(kind="mode-high", value=float(high), lo=_double_below(high), says=says))
    if r <= 1 - theta:
        bound = f"without friction, or tied, rho is at least {_few(low)}"
        says = f"the softest mode keeps its sign and is the slowest: {bound}; {fastest}"
        found.append(Reading(kind="mode-low", lo=_double_below(low), says=says))
    open_too = abs(r - (1 - theta)) <= SAME * min(theta, 1 - theta)
    if open_too:
        says = f"nodes that are open set the pace, 1 - theta a step, whatever rho is; {fastest}"
        found.append(Reading(kind="open", says=says))
    if r >= 1 - _spread(theta) and r > 1 - theta and not open_too:
        least = 2 / theta - 1
        level = "contact opens and closes in turn, and the residual stays at a level or grows for a while only"
        bound = f"without friction rho is at least {_few(least)}, nothing more; with friction this says nothing of rho"
        found.append(Reading(kind="level", lo=_double_below(least), says=f"{level}: {bound}"))
    return tuple(found)


def _spread(theta: Fraction) -> Fraction:
    """How far from 1 the ratio of a residual that stays at a level may come out, averaged over the steps asked for."""
    return min(WIDEST, max(NARROWEST, theta / 2))


def _role_of_run(rho: Fraction) -> Role:
    nothing = "an observed ratio proves nothing"
    return Role(
        neumann_body=None,
        rho=Number.of_float(rho),
        theta_proved=None,
        factor_proved=None,
        theta_max_proved=None,
        theta_predicted=float(predicted_theta(rho)),
        rate_predicted=float(predicted_rate(rho)),
        friction_threshold=None,
        reason={
            "neumann_body": "whichever body had the Neumann problem in that run",
            **dict.fromkeys(("theta_proved", "factor_proved", "theta_max_proved", "friction_threshold"), nothing),
        },
    )


def _few(value: Fraction) -> str:
    return f"{float(value):.4g}"


def _double_below(value: Fraction) -> float:
    """The largest double that is not above a bound from below."""
    near = float(value)
    return near if Fraction(near) <= value else math.nextafter(near, -math.inf)


def _rounded_down(theta: Fraction) -> float:
    """A theta in four figures, not above the one meant."""
    return float(Context(prec=4, rounding=ROUND_DOWN).divide(Decimal(theta.numerator), Decimal(theta.denominator)))


@dataclass(frozen=True, kw_only=True)
class Choice:
    """The theta of a run and where it comes from.

    Attributes
    ----------
    theta : Fraction
    source : {'given', 'proved', 'predicted', 'momentum'}
        ``momentum``: the step that the triple momentum method takes for this rho.
    rho : float or None
        Known where it was needed.
    why : str
        Why this theta, in words.
    """

    theta: Fraction
    source: Literal["given", "proved", "predicted", "momentum"]
    rho: float | None = None
    why: str = "given by the problem or beside it"

    def to_dict(self) -> dict[str, Any]:
        """The object ``theta_auto`` of a role."""
        return {"theta": float(self.theta), "source": self.source, "why": self.why}


def choose(pair: Pair, theta: Any = None, measured: Measured | None = None) -> Choice:
    """The theta of a run: the given one, else the problem's; for "auto" that of :func:`automatic`.

    Momentum takes its step from rho, whatever theta is.

    Raises
    ------
    HypothesisError
        A given theta outside (0, 1).
    ProblemError
        "auto" or momentum where rho does not exist.
    """
    problem = pair.problem if theta is None else pair.problem.with_theta(theta)
    settings = problem.iteration
    momentum = settings.relaxation == "momentum"
    if settings.theta != "auto" and not momentum:
        return Choice(theta=settings.theta, source="given")
    sharp = sharp_bounds(measured or measure(pair))
    if sharp is None:
        key, value = ("iteration.relaxation", "momentum") if momentum else ("iteration.theta", "auto")
        needed = f"needed {'another rule' if momentum else 'a number'}: rho does not exist here"
        raise ProblemError(problem.source, key, value, needed)
    if momentum:
        rho = sharp.rho.value
        why = "the step of the triple momentum method for this rho"
        return Choice(theta=below_one(momentum_step(rho)), source="momentum", rho=rho, why=why)
    return automatic(sharp, pair.outside, settings.tolerance)


def automatic(sharp: SharpBounds, outside: Sequence[str] = (), tolerance: float = 1e-9) -> Choice:
    """The theta that theory chooses: the proved one, unless it is predicted to need more than twice as many steps.

    Both thetas are judged by one formula, :func:`ndtheory.sharp.predicted_factor`.  The proved factor would be no fair
    judge: with friction it is far from attained.

    Parameters
    ----------
    sharp : SharpBounds
    outside : sequence of str
        Why the theorem does not speak of the problem; empty where it does.
    tolerance : float
        What the steps lead to.

    Examples
    --------
    >>> chosen = automatic(evaluate_sharp(EnergyConstants(rho=2)))
    >>> chosen.source, chosen.theta
    ('proved', Fraction(1, 2))
    """
    rho = sharp.rho.value
    predicted = below_one(sharp.theta_predicted)
    nothing = outside[0] if outside else "q >= 1 for every theta" if sharp.theta_proved is None else None
    if nothing is not None or sharp.theta_proved is None:
        return Choice(theta=predicted, source="predicted", rho=rho, why=f"no theta is proved: {nothing}")
    proved = below_one(sharp.theta_proved)
    of_proved, of_predicted = (predicted_steps(theta, rho, tolerance) for theta in (proved, predicted))
    if of_proved > TOO_SLOW * of_predicted:
        why = f"{of_predicted} steps predicted, against {of_proved} at the proved theta {float(proved):.4g}"
        return Choice(theta=predicted, source="predicted", rho=rho, why=why)
    why = f"{of_proved} steps predicted, at most twice the {of_predicted} at the predicted theta {float(predicted):.4g}"
    if sharp.friction_multiple is None:
        why = "without friction the predicted one is proved"
    return Choice(theta=proved, source="proved", rho=rho, why=why)


def below_one(theta: float) -> Fraction:
    """A theta chosen for the user, below 1."""
    return exact(min(theta, CLOSEST_TO_ONE))


def predicted_steps(theta: Fraction, rho: float, tolerance: float) -> int:
    """Steps that the predicted factor needs from 1 down to a tolerance."""
    # of 1 - factor, as a small theta is lost in the factor itself
    gain = float(1 - predicted_factor(theta, Fraction(rho)))
    return math.ceil(math.log(tolerance) / math.log1p(-gain))
