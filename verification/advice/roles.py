"""Which body gets the Neumann problem, and which theta: advice from the theorem and from rho."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from ndtheory import EnergyConstants, Number, evaluate_sharp
from ndtheory.sharp import predicted_rate, predicted_theta
from verification.advice.readings import NextRun, RunReading, SeenRun
from verification.advice.role import Role
from verification.advice.seen import Interval, SeenLog
from verification.advice.seen_matrices import SeenMatrices
from verification.algorithm.theta import automatic, by_prediction, sharp_bounds
from verification.constants import measure
from verification.document import Document
from verification.interface.build import build
from verification.interface.pair import ContactPair, SingularRole, TwoBodies
from verification.operators import Pencils, needs_matrices, pair_or_bodies
from verification.problem import Problem, load
from verification.problem.tables import ProblemError
from verification.progress import Progress, silent

if TYPE_CHECKING:
    from verification.advice.from_moduli import SeenModuli
    from verification.figures import Figure

#: What is unknown of matrices and runs from elsewhere.
UNITS = {"length": "any", "stress": "any"}


@dataclass(frozen=True, kw_only=True, repr=False)
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
    readings : tuple of RunReading
        What that run can mean.
    next : NextRun or None
        The run to make next.
    logs : tuple of SeenLog
        What was seen in the logs of other runs.
    interval : Interval or None
        What these logs say of rho together.
    moduli : SeenModuli or None
        What was given of two bodies, and bounds of rho from below.
    matrices : SeenMatrices or None
        What was seen of the matrices that were given; None where none were.
    """

    schema: ClassVar[str] = "ndtheory.advice/1"

    neumann_body: Literal[1, 2] | None
    roles: tuple[Role, ...]
    units: Mapping[str, str]
    friction: float | None = None
    outside: tuple[str, ...] = ()
    run: SeenRun | None = None
    readings: tuple[RunReading, ...] = ()
    next: NextRun | None = None
    logs: tuple[SeenLog, ...] = ()
    interval: Interval | None = None
    matrices: SeenMatrices | None = None
    problem: Problem | None = None
    moduli: SeenModuli | None = None

    @property
    def summary(self) -> str:
        if self.moduli is not None:
            return self.moduli.summary
        if not self.roles:
            return f"{len(self.readings)} readings of {'logs' if self.logs else 'a run'}"
        best = self.best
        who = "" if self.neumann_body is None else f"Neumann problem to body {self.neumann_body}, "
        return f"{who}theta = {best.predicted[0]:.4g} predicted, rate {best.predicted[1]:.4g}"

    def plot(self) -> Figure:
        """The factor of one step over theta, for each assignment of the roles."""
        from verification.figures import draw_factor

        if not self.roles:
            raise ValueError("no reading is left alone: make the run that `next` names")
        if self.moduli is not None:
            raise ValueError("moduli bound rho from below only: no factor of a step follows")
        named = {f"Neumann body {role.neumann_body}" if role.neumann_body else "that run": role for role in self.roles}
        energy = {
            name: role.energy or EnergyConstants(rho=role.rho.value)
            for name, role in named.items()
            if role.rho is not None
        }
        return draw_factor(energy)

    @property
    def best(self) -> Role:
        """The role that is advised; the only one where there is no choice.

        Raises
        ------
        ValueError
            The ratio of a run has several readings: ``next`` is the run to make.
        """
        if not self.roles:
            raise ValueError("no reading is left alone: make the run that `next` names")
        return next((r for r in self.roles if r.neumann_body == self.neumann_body), self.roles[0])

    def content(self) -> dict[str, Any]:
        reason = {} if self.neumann_body else {"neumann_body": "one run tells nothing of the other assignment"}
        if self.run is None:
            reason["run"] = "logs were given" if self.logs else "no run was given"
        if self.next is None:
            reason["next"] = "no run was given"
        if self.interval is None:
            reason["interval"] = "no logs were given"
        if self.moduli is None:
            reason["moduli"] = "no moduli were given"
        elif not self.neumann_body:
            reason["neumann_body"] = "both roles have the same bounds"
        if self.matrices is None:
            reason["matrices"] = "no matrices were given"
        return {
            "neumann_body": self.neumann_body,
            "roles": [role.to_dict() for role in self.roles],
            "run": None if self.run is None else self.run.to_dict(),
            "readings": [reading.to_dict() for reading in self.readings],
            "next": None if self.next is None else self.next.to_dict(),
            "logs": [log.to_dict() for log in self.logs],
            "interval": None if self.interval is None else self.interval.to_dict(),
            "moduli": None if self.moduli is None else self.moduli.to_dict(),
            "matrices": None if self.matrices is None else self.matrices.to_dict(),
            "outside_theorem": list(self.outside),
            "reason": reason,
        }


def advise(problem: Problem | ContactPair | Path | str, *, progress: Progress = silent) -> Advice:
    """Advise on the roles of the bodies and on theta.

    The body whose prediction ``rho/(2 + rho)`` is smaller gets the Neumann problem.

    Parameters
    ----------
    problem : Problem, ContactPair or path
    progress : callable
        Told the steps that rho takes where there are too many contact nodes for matrices.

    Returns
    -------
    Advice

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
    pair: ContactPair | TwoBodies
    try:
        pair = pair_or_bodies(problem)
        roles = (
            _roles_without_matrices(pair, progress) if isinstance(pair, TwoBodies) else (_role(pair), _exchanged(pair))
        )
    except SingularRole as error:
        assert not isinstance(problem, ContactPair)  # made with roles that are not singular
        given = problem if isinstance(problem, Problem) else load(problem)
        pair = build(given.swapped())  # refused itself where contact holds that body, too
        roles = (Role.refused(given.iteration.neumann_body, error), _role(pair))
    best = min((role for role in roles if role.rho is not None), key=lambda role: role.predicted[1])
    return Advice(
        neumann_body=best.neumann_body,
        roles=roles,
        units=UNITS if pair.problem is None else pair.problem.units,
        problem=pair.problem,
        friction=float(pair.friction),
        outside=tuple(pair.outside),
    )


def _exchanged(pair: ContactPair) -> Role:
    """The other assignment of the roles, which may be refused."""
    try:
        return _role(pair.swapped())
    except ValueError as error:
        return Role.refused(pair.contact_body, error)


def _role(pair: ContactPair) -> Role:
    measured = measure(pair)
    sharp = sharp_bounds(measured)
    if measured.rho_max is None:
        raise ProblemError(pair.source, "contact", None, f"no advice: {measured.why_no_energy}")
    if sharp is None:
        return _predicted_role(pair, measured.rho_max, measured.why_no_energy)
    outside = pair.outside
    threshold = None if outside else measured.friction_threshold
    if outside:
        proved = ("theta_proved", "factor_proved", "theta_max_proved", "friction_threshold")
        reason = dict.fromkeys(proved, f"outside the theorem: {outside[0]}")
    else:
        reason = {name: why for name, why in sharp.reason.items() if name in Role.__dataclass_fields__}
        if threshold is None:
            reason["friction_threshold"] = measured.why_no_threshold
    return Role(
        neumann_body=pair.neumann_body,
        rho=sharp.rho,
        theta_proved=None if outside else sharp.theta_proved,
        factor_proved=None if outside else sharp.factor_proved,
        theta_max_proved=None if outside else sharp.theta_max_proved,
        theta_predicted=sharp.theta_predicted,
        rate_predicted=sharp.rate_predicted,
        friction_threshold=threshold,
        reason=reason,
        theta_auto=automatic(sharp, outside, pair.settings.tolerance),
        energy=None if outside else measured.energy_constants(),
    )


def _predicted_role(pair: ContactPair, rho: Number, why: str) -> Role:
    """A role of which rho is known, and of which no theorem speaks."""
    return Role(
        neumann_body=pair.neumann_body,
        rho=rho,
        theta_proved=None,
        factor_proved=None,
        theta_max_proved=None,
        theta_predicted=float(predicted_theta(Fraction(rho.value))),
        rate_predicted=float(predicted_rate(Fraction(rho.value))),
        friction_threshold=None,
        reason=dict.fromkeys(("theta_proved", "factor_proved", "theta_max_proved", "friction_threshold"), why),
        theta_auto=by_prediction(rho.value, why),
    )


def _roles_without_matrices(bodies: TwoBodies, progress: Progress) -> tuple[Role, ...]:
    """Both roles, the file's first: rho alone, and what it proves without friction."""
    pencils, problem = Pencils(bodies, progress), bodies.problem
    for why in pencils.reason.values():
        raise ProblemError(problem.source, "contact", None, f"no advice: {why}")
    needed, rubs, outside = needs_matrices(bodies), bool(bodies.friction), bodies.outside
    roles = []
    for neumann in (problem.iteration.neumann_body, problem.swapped().iteration.neumann_body):
        rho = pencils.largest(neumann_body=neumann, normal=not rubs).value
        reason = {"theta_auto": needed, "friction_threshold": needed}
        nothing = f"outside the theorem: {outside[0]}" if outside else needed if rubs else None
        unproved: dict[str, Any] = {}
        if nothing is not None:
            unproved = dict.fromkeys(("theta_proved", "factor_proved", "theta_max_proved"))
            reason |= dict.fromkeys((*unproved, "friction_threshold"), nothing)
        roles.append(replace(plain_role(neumann, Fraction(rho)), reason=reason, **unproved))
    return tuple(roles)


def plain_role(neumann_body: Any, rho: Fraction) -> Role:
    """What rho alone says, without friction."""
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
