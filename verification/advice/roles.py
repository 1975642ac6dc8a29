"""Which body gets the Neumann problem, and which theta: advice from the theorem and from rho."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any, ClassVar, Literal

from ndtheory import EnergyConstants, Number, evaluate_energy
from verification.advice.readings import LARGEST_TO_PASTE, NextRun, RunReading, SeenRun, rounded_down
from verification.advice.role import Role, best_of, fewer, in_steps, role_of, steps, with_both_ends
from verification.advice.runs_with_friction import FrictionBounds
from verification.advice.seen import RhoInterval, SeenLog
from verification.advice.seen_matrices import SeenMatrices
from verification.advice.seen_moduli import SeenModuli
from verification.advice.snippets import Coupling, snippet
from verification.algorithm.theta import automatic, by_prediction, energy_bounds
from verification.constants import measure
from verification.constants.operators import Pencils, needs_matrices, pair_or_bodies
from verification.document import Document
from verification.interface.assembly import SingularRole, TwoBodies
from verification.interface.build import build
from verification.interface.pair import UNITS, ContactPair
from verification.problem import Problem, load
from verification.problem.tables import ProblemError
from verification.progress import Progress, silent


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
    interval : RhoInterval or None
        What these logs say of rho together.
    moduli : SeenModuli or None
        What was given of two bodies, and bounds of rho from below.
    matrices : SeenMatrices or None
        What was seen of the matrices that were given; None where none were.
    tied : bool
        Whether the advice is for an interface of which nothing opens or slips.
    assumes : str or None
        The assumption under which runs were read; None where none were given.
    friction_bounds : FrictionBounds or None
        What runs prove with friction; None unless friction was given.
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
    interval: RhoInterval | None = None
    matrices: SeenMatrices | None = None
    problem: Problem | None = None
    moduli: SeenModuli | None = None
    tied: bool = False
    assumes: str | None = None
    friction_bounds: FrictionBounds | None = None

    @classmethod
    def between(cls, roles: Sequence[Role], *, tied: bool, **known: Any) -> Advice:
        """The advice for the role that takes fewer steps; one of them at least is not refused."""
        return cls(neumann_body=best_of(roles, tied=tied).neumann_body, roles=tuple(roles), tied=tied, **known)

    @property
    def summary(self) -> str:
        if self.moduli is not None:
            return self.moduli.summary
        if not self.roles:
            return f"assumed: {self.assumes}; {len(self.readings)} readings of {'logs' if self.logs else 'a run'}"
        theta, rate = self.chosen(self.best)
        who = "" if self.neumann_body is None else f"Neumann problem to body {self.neumann_body}, "
        who = who if self.assumes is None else f"assumed: {self.assumes}; "
        return f"{who}theta = {theta:.4g} {'if tied' if self.tied else 'predicted'}, rate {rate:.4g}"

    def chosen(self, role: Role) -> tuple[float, float]:
        """theta and rate by which a role is judged here."""
        return role.advised(tied=self.tied and role.ends is not None)

    @property
    def theta(self) -> float | None:
        """The theta to paste, not above the one that is meant; None while several readings are left, or of moduli."""
        if not self.roles or self.moduli is not None:
            return None
        if self.next is not None:
            return self.next.theta
        return rounded_down(min(Fraction(self.chosen(self.best)[0]), LARGEST_TO_PASTE))

    @property
    def why_no_theta(self) -> str:
        """Why there is no theta to paste; empty where there is one."""
        if self.theta is not None:
            return ""
        if self.moduli is not None:
            return "moduli bound rho from below: a theta to start with stands in moduli.roles.start, where there is one"
        if self.friction_bounds is not None:
            return "with friction no run decides theta: make the run that `next` names"
        return "several readings are left: make the run that `next` names"

    @property
    def other(self) -> Role | None:
        """The role that is not advised; None where it is unknown or refused."""
        rest = [role for role in self.roles if role is not self.best and role.rho is not None]
        return rest[0] if rest else None

    @property
    def no_difference(self) -> bool:
        """Whether both roles take the same number of steps, but for SAME of it."""
        return self.other is not None and not fewer(self.chosen(self.other)[1], self.chosen(self.best)[1], either=True)

    @property
    def quote(self) -> str | None:
        """The reason for the advice in two sentences, to be quoted; None where there is no theta to paste.

        They have rho in both roles, the theta that follows from it, and the steps of both.
        """
        if self.theta is None:
            return None
        best, other = self.best, self.other
        tied = self.tied and best.ends is not None
        theta, rate = self.chosen(best)
        first = "" if self.assumes is None else f"Assumed: {self.assumes}. "
        first += f"rho (stiffness of contact body over Neumann body on the interface, at worst) is {_rho(best, tied)}"
        if self.neumann_body is not None:
            first += f" with body {self.neumann_body} as Neumann body"
        if other is not None:
            first += f", {_rho(other, tied)} with the roles exchanged"
        formula = "2/(2+rho)"
        if tied and best.rho_min is not None:
            formula = "2/(2+rho_min+rho)"
            first += f"; rho_min (at best) is {best.rho_min.value:.3g}"
        bound = "at most " * (tied or best.proved)
        then = f"So relax by {formula} = {theta:.3g}: {bound}{in_steps(rate)} to 1e-9"
        then += " if nothing opens or slips" if tied else " without friction" if best.proved else " are predicted"
        if other is not None:
            away = in_steps(self.chosen(other)[1]).removesuffix(" steps")
            then += ", the same with the roles exchanged" if self.no_difference else f", against {away}"
        return f"{first}. {then}."

    def snippet(self, library: str) -> str:
        """What to paste into the configuration of a coupling library: preCICE, Kratos or Norma.

        Raises
        ------
        ValueError
            Several readings are left, or no such library.
        """
        if self.theta is None:
            raise ValueError(self.why_no_theta)
        count = steps(self.chosen(self.best)[1])
        return snippet(library, Coupling(neumann_body=self.neumann_body, theta=self.theta, steps=count, tied=self.tied))

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
        if self.assumes is None:
            reason["assumes"] = "no run was given"
        if self.friction_bounds is None:
            reason["friction_bounds"] = "no run with friction was given"
        if self.matrices is None:
            reason["matrices"] = "no matrices were given"
        if self.theta is None:
            reason |= dict.fromkeys(("theta", "quote"), self.why_no_theta)
        return {
            "neumann_body": self.neumann_body,
            "theta": self.theta,
            "tied": self.tied,
            "assumes": self.assumes,
            "quote": self.quote,
            "roles": [role.to_dict() for role in self.roles],
            "run": None if self.run is None else self.run.to_dict(),
            "readings": [reading.to_dict() for reading in self.readings],
            "next": None if self.next is None else self.next.to_dict(),
            "logs": [log.to_dict() for log in self.logs],
            "interval": None if self.interval is None else self.interval.to_dict(),
            "friction_bounds": None if self.friction_bounds is None else self.friction_bounds.to_dict(),
            "moduli": None if self.moduli is None else self.moduli.to_dict(),
            "matrices": None if self.matrices is None else self.matrices.to_dict(),
            "outside_theorem": list(self.outside),
            "reason": reason,
        }


def advise(problem: Problem | ContactPair | Path | str, *, tied: bool = False, progress: Progress = silent) -> Advice:
    """Advise on the roles of the bodies and on theta.

    The body whose prediction ``rho/(2 + rho)`` is smaller gets the Neumann problem; for a tied interface the one whose
    rate ``(rho - rho_min)/(2 + rho_min + rho)`` is.

    Parameters
    ----------
    problem : Problem, ContactPair or path
    tied : bool
        Whether to advise by what holds where nothing opens or slips.
    progress : callable
        Called with the steps that rho takes where there are too many contact nodes for matrices.

    Returns
    -------
    Advice

    Raises
    ------
    ProblemError
        As :func:`verification.measure`, and where the bodies hold different components of Gamma_c.

    Examples
    --------
    >>> from verification.problem.examples import example
    >>> found = advise(example("two-bars"))
    >>> found.neumann_body, round(found.best.theta_predicted, 6)
    (1, 0.857143)
    """
    pair: ContactPair | TwoBodies
    try:
        pair = pair_or_bodies(problem)
        roles = (
            _roles_without_matrices(pair, tied, progress)
            if isinstance(pair, TwoBodies)
            else (_role(pair), _exchanged(pair))
        )
    except SingularRole as error:
        assert not isinstance(problem, ContactPair)  # made with roles that are not singular
        given = problem if isinstance(problem, Problem) else load(problem)
        pair = build(given.swapped())  # refused itself where contact holds that body, too
        roles = (Role.refused(given.iteration.neumann_body, error), _role(pair))
    return Advice.between(
        roles,
        tied=tied,
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
    energy = energy_bounds(measured)
    if measured.rho_max is None:
        raise ProblemError(pair.source, "contact", None, f"no advice: {measured.why_no_energy}")
    if energy is None:
        nothing = measured.why_no_energy
        auto = by_prediction(measured.rho_max.value, nothing)
    else:
        nothing = f"outside the theorem: {pair.outside[0]}" if pair.outside else ""
        auto = automatic(energy, pair.outside, pair.settings.tolerance)
    return role_of(
        pair.neumann_body,
        measured.rho_max if energy is None else energy.rho,
        bounds=energy,
        nothing=nothing,
        threshold=None if nothing else measured.friction_threshold,
        no_threshold="" if nothing else measured.why_no_threshold,
        theta_auto=auto,
        energy=None if nothing else measured.energy_constants(),
        rho_min=measured.rho_min,
        rho_tied=measured.rho_max,
    )


def _roles_without_matrices(bodies: TwoBodies, tied: bool, progress: Progress) -> tuple[Role, ...]:
    """Both roles, the file's first: rho alone, and what it proves without friction.

    Of frictionless contact rho is rho_normal, and a tied interface needs two eigenvalues more.
    """
    pencils, problem = Pencils(bodies, progress), bodies.problem
    for why in pencils.reason.values():
        raise ProblemError(problem.source, "contact", None, f"no advice: {why}")
    needed, rubs, outside = needs_matrices(bodies), bool(bodies.friction), bodies.outside
    roles = []
    for neumann in (problem.iteration.neumann_body, problem.swapped().iteration.neumann_body):
        rho = pencils.largest(neumann_body=neumann, normal=not rubs).value
        nothing = f"outside the theorem: {outside[0]}" if outside else needed if rubs else ""
        role = plain_role(
            neumann, Fraction(rho), nothing=nothing, no_threshold=nothing or needed, reason={"theta_auto": needed}
        )
        roles.append(role)
    if rubs:
        return with_both_ends(roles)
    if not tied:
        more = "without friction rho is rho_normal, and a tied interface needs two more eigenvalues: ask for tied"
        return tuple(replace(role, reason={**role.reason, "rho_min": more}) for role in roles)
    bodies_of = (problem.iteration.neumann_body, problem.contact_body)
    ends = with_both_ends(
        [
            replace(role, rho=Number.of_float(pencils.largest(neumann_body=neumann).value))
            for role, neumann in zip(roles, bodies_of, strict=True)
        ]
    )
    pairs = zip(roles, ends, strict=True)
    return tuple(replace(role, rho_min=end.rho_min, rho_tied=end.rho_tied) for role, end in pairs)


def plain_role(neumann_body: Any, rho: Fraction, **settings: Any) -> Role:
    """The role without friction, from rho; ``settings`` are those of :func:`role_of`."""
    bounds = evaluate_energy(EnergyConstants(rho=rho))
    settings.setdefault("no_threshold", "matrices alone say nothing of friction: the proved values are for k = 0")
    return role_of(neumann_body, bounds.rho, bounds=bounds, **settings)


def _rho(role: Role, tied: bool) -> str:
    rho = role.rho_tied if tied and role.rho_tied is not None else role.rho
    return "unknown" if rho is None else f"{rho.value:.3g}"
