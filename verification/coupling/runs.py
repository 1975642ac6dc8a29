"""Runs of other codes as evidence: one by its ratio of residuals, or several by their logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, ClassVar

from ndtheory.keys import key, says
from verification.coupling.accelerated import Accelerated
from verification.coupling.evidence import Evidence
from verification.coupling.methods import MethodRow
from verification.coupling.readings import (
    AT_ONE,
    LIKE_ONE,
    OF_OPEN_NODES,
    Made,
    NextRun,
    RunReading,
    anew,
    assumed,
    pasted_or_not,
    steps_needed,
)
from verification.coupling.roles import Role, estimated, role_of
from verification.coupling.runs_with_friction import FrictionBounds
from verification.coupling.seen import RhoInterval, SeenLog
from verification.coupling.spectrum import Spectrum

#: What a spectrum by Aitken's factors is read from.
FACTORS = "Aitken's factors"

#: Why nothing is known of the exchanged roles, and of the lower end of the spectrum.
OF_ONE_RUN = {
    "neumann_body": "whichever body had the Neumann problem in that run",
    "rho_min": "residuals show one end of the spectrum",
}


@dataclass(frozen=True, kw_only=True)
class Runs(Evidence):
    """Runs of one coupling: possible ``readings``, bounds with friction, the ``next`` run, ``rho`` where it is decided.

    Where they do ``next`` is the theta to paste.  ``rubs`` is True if there is friction.
    """

    readings: tuple[RunReading, ...]
    next: NextRun
    rho: Fraction | None
    friction_bounds: FrictionBounds | None = None
    rubs: bool = False

    #: Words for what was given.
    given_as: ClassVar[str]

    def spectra(self) -> tuple[Role, ...]:
        """The roles of the runs, where they decide rho."""
        if self.rho is None:
            return ()
        return (role_of(None, self.rho, nothing="an observed ratio proves nothing", reason=OF_ONE_RUN),)

    def methods(self, roles: Sequence[Role]) -> tuple[MethodRow, ...]:
        """For the theta to paste; only the largest eigenvalue is known."""
        each = (self.in_role(role, theta=self.next.theta, exchanged=False, one_end=True) for role in roles)
        return tuple(row for rows in each for row in rows)

    @property
    def decided(self) -> bool:
        """True if a theta follows."""
        return not self.why_no_theta

    def next_run(self) -> NextRun:
        """The run to make next, or the theta to paste."""
        return self.next

    @property
    def assumes(self) -> str:
        """The assumption under which the runs are read."""
        return assumed(self.kind.tied, self.rubs)

    @property
    def why_no_theta(self) -> str:
        if self.rho is not None:
            return ""
        if self.friction_bounds is not None:
            return "with friction no run decides theta: make the run that `next` names"
        return "several readings are left: make the run that `next` names"

    @property
    def summary(self) -> str:
        return f"assumed: {self.assumes}; {len(self.readings)} readings of {self.given_as}"


@dataclass(frozen=True, kw_only=True)
class OneRun(Runs):
    """A run of any code with constant theta, and the ratio of its absolute unrelaxed residual from step to step."""

    given_as = "a run"

    theta: Fraction = key("as given", type="number", unit="1", of=float)
    ratio: Fraction = key("as given", type="number", unit="1", of=float)
    residual: str = key("which residual the ratio is of", default="|Tg - g|, absolute and unrelaxed")

    @property
    @says("over how many steps at least the ratio must be steady", name="steady_over", unit="1")
    def steps(self) -> int:
        return steps_needed(self.theta)


@dataclass(frozen=True, kw_only=True)
class Logs(Runs):
    """Convergence logs of runs: of constant theta, and ``accelerated`` ones, with bounds of rho from all together.

    ``spectrum`` lies between the ends that Aitken's factors show, where these decide theta.
    """

    given_as = "logs"
    reasons: ClassVar[Mapping[str, str]] = {"run": "logs were given"}

    logs: tuple[SeenLog, ...]
    accelerated: tuple[Accelerated, ...]
    interval: RhoInterval
    spectrum: Spectrum | None = None

    def spectra(self) -> tuple[Role, ...]:
        """The roles of the runs, where they decide rho; an estimate beside a run that was not relaxed by a constant."""
        if self.spectrum is not None:
            return (estimated(self.spectrum, FACTORS),)
        return tuple(replace(role, level="estimated" if self.accelerated else "known") for role in super().spectra())

    def methods(self, roles: Sequence[Role]) -> tuple[MethodRow, ...]:
        """On the spectrum by Aitken's factors, with the roles exchanged too, or for the theta to paste."""
        return super().methods(roles) if self.spectrum is None else self.on_estimates(self.spectrum, FACTORS)

    @property
    def why_no_theta(self) -> str:
        if self.spectrum is None and self.friction_bounds is None and self.accelerated and not self.readings:
            return "the runs decide no theta: make the run that `next` names"
        return "" if self.spectrum is not None else super().why_no_theta


#: The logs of no run.
NONE = Logs(
    readings=(),
    next=NextRun(theta=1.0, why=""),
    rho=None,
    logs=(),
    accelerated=(),
    interval=RhoInterval(lo=None, hi=None, contradiction=None),
)


def decided(
    made: Sequence[Made],
    readings: Sequence[RunReading],
    following: NextRun,
    rho: Fraction | None,
    *,
    tied: bool,
    friction_bounds: FrictionBounds | None,
) -> dict[str, Any]:
    """The fields of :class:`Runs`: a theta to paste where the runs decide rho, else a run that was not made yet.

    ``following`` is the theta to paste, or the run that is proposed; ``rho`` is None while several readings are left;
    readings that need nodes that open are left out where the interface is tied.
    """
    if rho is not None and (paste := pasted_or_not(following, made)) is not None:
        following = paste
    else:
        following, rho = anew(following, made), None
        learns = not following.kept and friction_bounds is None
        if learns and not any(one.rises or one.theta >= LIKE_ONE for one in made):
            following = replace(following, why=f"{following.why}. {AT_ONE}")
    left = tuple(one for one in readings if not (tied and one.kind in OF_OPEN_NODES))
    return {"readings": left, "next": following, "rho": rho, "friction_bounds": friction_bounds}
