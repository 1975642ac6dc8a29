"""Runs of other codes as evidence: one by its ratio of residuals, or several by their logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, ClassVar

from ndtheory.keys import key, says
from ndtheory.number import below
from verification.coupling.accelerated import Accelerated
from verification.coupling.evidence import Evidence
from verification.coupling.kinds import Kind
from verification.coupling.methods import MethodRow
from verification.coupling.readings import (
    LIKE_ONE,
    OF_OPEN_NODES,
    Made,
    NextRun,
    RunReading,
    anew,
    at_risk,
    or_at_one,
    pasted_or_not,
    steps_needed,
)
from verification.coupling.roles import Role, role_of
from verification.coupling.runs_with_friction import FrictionBounds
from verification.coupling.seen import RhoInterval, SeenLog
from verification.coupling.spectrum import Spectrum

#: What a spectrum by Aitken's factors is read from.
FACTORS = "Aitken's factors"

#: From this rho on a constant theta takes many steps, whatever else the runs leave open: the methods are compared then.
LARGE = 10.0

#: Why nothing is known of the exchanged roles, and of the lower end of the spectrum.
OF_ONE_RUN = {
    "neumann_body": "whichever body had the Neumann problem in that run",
    "rho_min": "residuals show one end of the spectrum",
}


@dataclass(frozen=True, kw_only=True)
class Runs(Evidence):
    """Runs of one coupling: possible ``readings``, bounds with friction, the ``next`` run, ``rho`` where it is decided.

    Where they do ``next`` is the theta to paste.  ``rubs`` is True if there is friction; ``spectrum`` lies between the
    ends that the runs show, where they show both, or that no constant theta converges.
    """

    readings: tuple[RunReading, ...]
    next: NextRun
    rho: Fraction | None
    friction_bounds: FrictionBounds | None = None
    rubs: bool = False
    spectrum: Spectrum | None = None

    #: Words for what was given.
    given_as: ClassVar[str]

    def spectra(self) -> tuple[Role, ...]:
        """The roles of the runs, where they decide rho or the spectrum."""
        if self.spectrum is not None and self.spectrum.theta:
            return (self.estimated(self.spectrum, self.shows),)
        if self.rho is None:
            return ()
        return (role_of(None, self.rho, nothing="an observed ratio proves nothing", reason=OF_ONE_RUN),)

    def methods(self, roles: Sequence[Role]) -> tuple[MethodRow, ...]:
        """For the theta to paste; on the spectrum, with the roles exchanged too, or by rho where only that is known."""
        if self.spectrum is not None and not self.spectrum.theta:
            rows = self.rows_on(self.spectrum, None, theta=1 / (1 + max(self.spectrum.high, 0.0)))
            return tuple(replace(row, bound="at least") for row in rows)
        if self.spectrum is not None:
            return self.on_estimates(self.spectrum, self.shows)
        if not roles and (rho := self.least_rho or 0.0) > LARGE and not self.rubs:
            return tuple(replace(row, bound="at least") for row in self.rows_on(Spectrum.between(0.0, rho), None))
        if self.kind.parallel:
            return super().methods(roles)
        each = (self.in_role(role, theta=self.next.theta, exchanged=False, one_end=True) for role in roles)
        return tuple(row for rows in each for row in rows)

    @property
    def least_rho(self) -> float | None:
        """rho is at least this, whichever reading is the right one; None where one of them does not bound it."""
        bounds = [reading.lo for reading in self.readings if reading.lo is not None]
        return min(bounds, default=None) if len(bounds) == len(self.readings) else None

    @property
    def shows(self) -> str:
        """The source from which the spectrum is read."""
        return self.given_as

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
        return self.kind.assumes(self.rubs)

    @property
    def why_no_theta(self) -> str:
        if self.spectrum is not None and not self.spectrum.theta:
            return "no constant theta above 0 converges by these runs, or a solver has the wrong sign"
        if self.rho is not None or self.spectrum is not None:
            return ""
        if self.friction_bounds is not None:
            return "with friction no run decides theta: make the run that `next` names"
        return "several readings or thetas are left: make the run that `next` names"

    @property
    def summary(self) -> str:
        return f"assumed: {self.assumes}; {len(self.readings)} readings of {self.given_as}"


@dataclass(frozen=True, kw_only=True)
class OneRun(Runs):
    """A run of any code with constant theta, and the ratio of its absolute unrelaxed residual from step to step.

    ``earlier`` has theta and ratio of the runs before it, of a coupling of kind general.
    """

    given_as = "a run"

    earlier: tuple[tuple[Fraction, Fraction], ...] = ()

    theta: Fraction = key("as given", type="number", unit="1", of=float)
    ratio: Fraction = key("as given", type="number", unit="1", of=float)
    residual: str = key("which residual the ratio is of", default="|Tg - g|, absolute and unrelaxed")

    @property
    @says("over how many steps at least the ratio must be steady", name="steady_over", unit="1")
    def steps(self) -> int:
        return steps_needed(self.theta)


@dataclass(frozen=True, kw_only=True)
class Logs(Runs):
    """Convergence logs of runs: of constant theta, and ``accelerated`` ones, with bounds of rho from all together."""

    given_as = "logs"
    reasons: ClassVar[Mapping[str, str]] = {"run": "logs were given"}

    logs: tuple[SeenLog, ...]
    accelerated: tuple[Accelerated, ...]
    interval: RhoInterval

    def spectra(self) -> tuple[Role, ...]:
        """The same, an estimate beside a run that was not relaxed by a constant."""
        return tuple(replace(role, level="estimated") if self.accelerated else role for role in super().spectra())

    @property
    def least_rho(self) -> float | None:
        """The bound of all logs together."""
        return None if self.interval.lo is None else below(self.interval.lo.value)

    @property
    def shows(self) -> str:
        """Aitken's factors, of a coupling whose eigenvalues are >= 0."""
        return FACTORS if self.kind.signed else self.given_as

    @property
    def why_no_theta(self) -> str:
        if self.spectrum is None and self.friction_bounds is None and self.accelerated and not self.readings:
            return "the runs decide no theta: make the run that `next` names"
        return super().why_no_theta


def decided(
    made: Sequence[Made],
    readings: Sequence[RunReading],
    following: NextRun,
    rho: Fraction | None,
    *,
    kind: Kind,
    friction_bounds: FrictionBounds | None,
) -> dict[str, Any]:
    """The fields of :class:`Runs`: a theta to paste where the runs decide rho, else a run that was not made yet.

    ``following`` is the theta to paste, or the run that is proposed; ``rho`` is None while several readings are left;
    readings that need nodes that open are left out where the interface is tied.
    """
    if rho is not None and (paste := pasted_or_not(following, made)) is not None:
        following = paste
    else:
        following, rho = at_risk(anew(following, made), made), None
        learns = not following.kept and friction_bounds is None
        if learns and not any(one.rises or one.theta >= LIKE_ONE for one in made):
            following = replace(following, why=following.why + or_at_one(0, kind))
    left = tuple(one for one in readings if not (kind.linear and one.kind in OF_OPEN_NODES))
    return {"readings": left, "next": following, "rho": rho, "friction_bounds": friction_bounds}
