"""Evidence: what is known of a coupling from one source, under the kind of coupling that its user names."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import ClassVar, TypeVar

from ndtheory.energy_norms import parallel_factor, parallel_theta
from ndtheory.keys import Part, key
from verification.coupling import methods
from verification.coupling.kinds import CONTACT, BodyNumber, Kind
from verification.coupling.layers import RoleOfLayers
from verification.coupling.methods import MethodRow
from verification.coupling.readings import NextRun, rounded_down
from verification.coupling.roles import Role, estimated, fewer
from verification.coupling.spectrum import Spectrum
from verification.problem import Problem

E = TypeVar("E", bound="Evidence")


@dataclass(frozen=True, kw_only=True)
class Parallel(Part):
    """The best constant theta of *parallel* coupling where nothing opens or slips, and its factor a step."""

    neumann_body: BodyNumber | None = key("the body with the Neumann problem", type="integer")
    theta: float = key(
        r"$1/(1+\rho)$ and its factor a step, $\sqrt{\rho/(1+\rho)}$, where nothing opens or slips; by all eigenvalues "
        "where these are estimates, or any may be",
        unit="1",
    )
    factor: float = key(
        r"$1/(1+\rho)$ and its factor a step, $\sqrt{\rho/(1+\rho)}$, where nothing opens or slips", unit="1"
    )
    bound: bool = key(
        r"true where $\rho$ is bounded from below only: the best theta is at most, its factor at least this"
    )

    @classmethod
    def of(cls, role: Role) -> Parallel:
        """For a role that is not refused."""
        assert role.rho is not None
        spectrum = role.spectrum
        if spectrum is not None and (role.level == "estimated" or not spectrum.real or spectrum.low < 0):
            both = spectrum.parallel()
            theta, factor = both.theta, both.factor(both.theta)
        else:
            theta = parallel_theta(role.rho.value)
            factor = parallel_factor(theta, role.rho.value)
        return cls(neumann_body=role.neumann_body, theta=theta, factor=factor, bound=role.level == "bounded")


@dataclass(frozen=True, kw_only=True, eq=False)
class Evidence(Part, ABC):
    """Knowledge of a coupling from one source; its keys make the object that the document of an advice has from it.

    ``kind`` is the kind of coupling.  ``friction`` is None where it is not known; ``outside`` says why the theorem does
    not apply to the problem.
    """

    kind: Kind = CONTACT
    friction: float | None = None
    outside: tuple[str, ...] = ()
    problem: Problem | None = None

    #: Why keys of the document are null, where that is another reason than usual.
    reasons: ClassVar[Mapping[str, str]] = {}

    @property
    def linear(self) -> bool:
        """True if nothing opens or slips."""
        return self.kind.linear

    @abstractmethod
    def spectra(self) -> tuple[Role, ...]:
        """For each assignment of the roles what is known of both ends of its spectrum, the one that there is first.

        ``rho`` is the upper end, at the ``level`` of the role; the lower one is None where nothing is known of it.
        There are none while nothing is decided.
        """

    def prefers(self, roles: Sequence[Role]) -> BodyNumber | None:
        """The body that should get the Neumann problem; None where that is not known.

        It takes fewer steps; the first role stays where it makes no difference, or where the other one is refused.
        """
        possible = [role for role in roles if role.rho is not None]
        faster = (role for role in possible[1:] if fewer(self.chosen(role)[1], self.chosen(possible[0])[1]))
        return next(faster, possible[0]).neumann_body if roles else None

    def chosen(self, role: Role) -> tuple[float, float]:
        """theta and rate by which a role is judged."""
        if self.kind.parallel and role.level != "bounded":
            of = Parallel.of(role)
            return of.theta, of.factor
        return role.advised(tied=self.linear and role.ends is not None)

    def methods(self, roles: Sequence[Role]) -> tuple[MethodRow, ...]:
        """The methods in all roles whose rho is known, the first role's own ones first.

        Contact that may open has a mode with lambda = 0 besides.
        """
        known = [role for role in roles if role.rho is not None and role.level != "bounded"]
        return tuple(row for role in known for row in self.in_role(role, exchanged=role is not roles[0]))

    def in_role(
        self, role: Role, *, tied: bool | None = None, theta: float | None = None, **settings: bool
    ) -> tuple[MethodRow, ...]:
        """The methods in one role, for its own theta or another one; ``settings`` as of :func:`methods.rows`."""
        tied = self.linear if tied is None else tied
        assert role.rho is not None
        spectrum = role.spectrum or Spectrum.between(float(role.ends[0] if role.ends else 0), role.rho.value)
        spectrum = spectrum if tied else spectrum.with_open_nodes()
        if theta is None:
            theta = self.chosen(role)[0] if self.kind.parallel else role.advised(tied=tied and role.ends is not None)[0]
        return self.rows_on(
            spectrum, role.neumann_body, theta=rounded_down(min(Fraction(theta), self.kind.most)), **settings
        )

    def rows_on(
        self, spectrum: Spectrum, neumann_body: BodyNumber | None, *, theta: float | None = None, **settings: bool
    ) -> tuple[MethodRow, ...]:
        """The methods on a spectrum of serial coupling, for a theta or the best one; in parallel on its square roots.

        Modes that turn lead Aitken's factor astray: runs were seen not to arrive where their steps are predicted.
        """
        spectrum = spectrum.parallel() if self.kind.parallel else spectrum
        theta = spectrum.theta if theta is None else theta
        rows = methods.rows(spectrum, theta=theta, neumann_body=neumann_body, **{"exchanged": False} | settings)
        if self.kind.parallel:
            return tuple(row for row in rows if row.method != "aitken")
        if methods.steps(spectrum.lowest(self.kind.least), "constant", theta) is None:
            rows = tuple(replace(row, steps=None) if row.method == "constant" else row for row in rows)
        return rows

    def on_estimates(self, spectrum: Spectrum, of: str, *, low_found: bool = True) -> tuple[MethodRow, ...]:
        """The methods on an estimated spectrum, in which open nodes are already, and with the roles exchanged.

        These have one over the least eigenvalue as their largest: it must be found.
        """
        rows = self.in_role(self.estimated(spectrum, of), tied=True, exchanged=False)
        if low_found and spectrum.low - spectrum.error_low > 0:
            rows += self.in_role(self.estimated(spectrum.exchanged(), of), tied=True, exchanged=True)
        return rows

    def estimated(self, spectrum: Spectrum, of: str) -> Role:
        """The role of a spectrum that was read from something, under this kind."""
        return estimated(spectrum, of, least=self.kind.least)

    def next_run(self) -> NextRun | None:
        """The run to make next; None where there is nothing to run."""
        return None

    @property
    def layers(self) -> tuple[RoleOfLayers, ...]:
        """Predictions from layers without ends, one for each role; none where the bodies are not known."""
        return ()

    @property
    def assumes(self) -> str | None:
        """The assumption under which runs are read."""
        return None

    @property
    def why_no_theta(self) -> str:
        """The reason why no theta can be pasted; empty where one can."""
        return ""

    @property
    def negative(self) -> str:
        """Why eigenvalues below 0 leave no theta; empty where there are none of these."""
        return ""

    @property
    def summary(self) -> str:
        """One line where no theta follows."""
        return self.why_no_theta

    def words(self, body: int) -> str:
        """The bodies of the file for body 1 or body 2: ``body 2``, or ``bodies 2, 4``."""
        return f"body {body}" if self.problem is None else self.problem.words(body)

    def if_from(self, source: type[E]) -> E | None:
        """This, if it is from a source."""
        return self if isinstance(self, source) else None
