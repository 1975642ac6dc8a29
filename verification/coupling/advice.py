"""Advice: the roles of the two bodies, theta, a method and the run to make next, as they follow from evidence."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import ClassVar

from ndtheory.keys import key, says
from verification.algorithm.rates import steps
from verification.coupling import methods
from verification.coupling.accelerated import Accelerated
from verification.coupling.evidence import Evidence, Parallel
from verification.coupling.kinds import BodyNumber, Kind
from verification.coupling.layers import RoleOfLayers
from verification.coupling.methods import Advised, MethodRow
from verification.coupling.readings import NextRun, RunReading, rounded_down
from verification.coupling.roles import Role, fewer, in_steps
from verification.coupling.runs import Logs, OneRun, Runs
from verification.coupling.runs_with_friction import FrictionBounds
from verification.coupling.seen import RhoInterval, SeenLog
from verification.coupling.seen_moduli import ElasticBodies
from verification.coupling.sides import Matrices
from verification.coupling.snippets import ONLY_CONSTANT, CouplingScheme, snippet
from verification.coupling.spectrum import Spectrum
from verification.coupling.vectors import Vectors
from verification.coupling.waves import Waves
from verification.document import Document
from verification.interface.pair import UNITS
from verification.problem import Problem

#: Two thetas are the same in a sentence if they differ by less than this share.
SAME_THETA = 5e-3


def _because(name: str, why: str) -> Callable[[Advice], str]:
    """Why a key is null: the evidence may have another reason than usual."""
    return lambda advice: advice.evidence.reasons.get(name, why)


@dataclass(frozen=True, kw_only=True, repr=False)
class Advice(Document):
    """Roles, theta, method and next run as they follow from evidence, by :meth:`of`."""

    schema: ClassVar[str] = "ndtheory.advice/1"

    evidence: Evidence
    units: Mapping[str, str]
    problem: Problem | None = None

    neumann_body: BodyNumber | None = key(
        "which body should get the Neumann problem",
        type="integer",
        null="where nothing follows from runs for the other assignment, and where moduli bound both roles alike",
        why=_because("neumann_body", "one run gives no information about the exchanged roles"),
    )

    @property
    @says(
        "the relaxation factor to paste, rounded to the safe side, for the roles as they are where bodies have no "
        "numbers (exchanged ones are in `methods`), for parallel coupling where that was asked for; the first factor "
        "of Aitken and IQN-ILS",
        unit="1",
        null="of moduli and of a fluid at a wall, while several readings of a run are left, and of runs with friction",
        why=lambda advice: advice.why_no_theta,
    )
    def theta(self) -> float | None:
        if self.why_no_theta:
            return None
        if self.next is not None:
            return self.next.theta
        return rounded_down(min(Fraction(self.chosen(self.best)[0]), self.coupling.most))

    @property
    @says(
        "the kind of coupling that was declared: `contact`, `tied` or `general`", name="kind", of=lambda kind: kind.name
    )
    def coupling(self) -> Kind:
        return self.evidence.kind

    @property
    @says("whether nothing opens or slips: of kind `tied` and `general`, and where vectors show it")
    def tied(self) -> bool:
        return self.evidence.linear

    @property
    def declared(self) -> bool:
        """True if the user says that nothing opens or slips, of solvers whose bodies have no numbers."""
        return self.coupling.linear and self.best.neumann_body is None

    @property
    @says(
        "the assumption under which runs are read: no friction or a tied interface, or friction with `--friction`",
        null="where no run was given",
        why="no run was given",
    )
    def assumes(self) -> str | None:
        return self.evidence.assumes

    @property
    @says(
        "the reason in a sentence or two, to be quoted",
        null="where `theta` is, and of heat",
        why=lambda advice: advice.why_no_theta or advice.evidence.reasons["quote"],
    )
    def quote(self) -> str | None:
        if self.theta is None or "quote" in self.evidence.reasons:
            return None
        best, other = self.best, self.other
        tied = self.tied and best.ends is not None
        theta, rate = self.chosen(best)
        first = "" if self.evidence.assumes is None else f"Assumed: {self.evidence.assumes}. "
        of, least = "rho (the largest eigenvalue lambda)", "rho_min (the least)"
        if best.spectrum is not None and not best.spectrum.real:
            of, least = "the largest real part of the eigenvalues, which are complex,", "the least real part"
        elif not self.declared:
            of = "rho (stiffness of contact body over Neumann body on the interface, at worst)"
            least = "rho_min (at best)"
        first += f"{of} is {'estimated at ' * (best.level == 'estimated')}{_rho(best, tied)}"
        if self.neumann_body is not None:
            words = self.evidence.words(self.neumann_body)
            first += f" with {words} as Neumann {words.split()[0]}"
        if other is not None:
            first += f", {_rho(other, tied)} with the roles exchanged"
        if tied and best.rho_min is not None:
            low = best.rho_min.value if best.spectrum is None else best.spectrum.low
            first += f"; {least} is {low:.3g}"
        if self.next is not None and abs(self.theta - theta) > SAME_THETA * theta:
            return f"{first}. So relax by theta = {self.theta:.4g}: {self.next.why}."
        bounded = (tied or best.proved) and not self.coupling.parallel  # whose steps have a rate, but no such bound
        taken = f"{'at most ' * bounded}{in_steps(rate)} to 1e-9"
        then = f"So relax by {self._formula(best, theta)} = {theta:.3g}: "
        then += self.steps_with_errors if best.level == "estimated" else taken
        linear = " if the coupling is linear" if self.declared else " if nothing opens or slips"
        then += linear if tied else " without friction" if bounded else " are predicted"
        if other is not None:
            away = in_steps(self.chosen(other)[1]).removesuffix(" steps")
            then += ", the same with the roles exchanged" if self.no_difference else f", against {away}"
        if (own := self.method_to_paste) != "constant":
            then += f". {methods.NAMES[own]} from there is predicted to take {self.steps_of(own)} to 1e-6"
            then += ", not " + self.steps_of("constant").removesuffix(" steps") if best.level != "estimated" else ""
        return f"{first}. {then}."

    def _formula(self, role: Role, theta: float) -> str:
        """The formula that gives a theta, by its value; words where eigenvalues are complex, or have errors."""
        assert role.rho is not None
        rho, least = role.rho.value, None if role.rho_min is None else role.rho_min.value
        forms = {"1/(1+rho)": 1 / (1 + rho)} if self.coupling.parallel else {"2/(2+rho)": 2 / (2 + rho)}
        if least is not None and self.tied and not self.coupling.parallel:
            forms = {"2/(2+rho_min+rho)": 2 / (2 + least + rho)} | forms
        real = role.spectrum is not None and role.spectrum.real
        near = (
            form for form in forms if (real or role.spectrum is None) and abs(forms[form] / theta - 1) <= SAME_THETA
        )
        of = "fewest steps" if real else "least factor"
        return next(near, f"the theta of {of} over the eigenvalues and their errors")

    methods: tuple[MethodRow, ...] = key(
        "steps of a constant theta, of Aitken and of IQN-ILS, in the roles as they are and exchanged, predicted on the "
        "spectrum as if contact did not change; while several readings of a run are left, only where rho is above 10 "
        "by each of them; empty of runs with friction, and of moduli but of heat and fluids"
    )
    method: Advised | None = key(
        "the method that is advised",
        null="where none converges, or nothing decides",
        why=lambda advice: advice.why_no_theta or "no method converges in the steps that are simulated",
    )
    roles: tuple[Role, ...] = key(
        "the assignment of the file first; for a run or for logs the one that they had, and none unless they decide"
    )

    @property
    @says(
        "the run of another code whose ratio was given", null="where none was", why=_because("run", "no run was given")
    )
    def run(self) -> OneRun | None:
        return self.evidence.if_from(OneRun)

    @property
    @says(
        "the possible readings of that run; for several logs the readings of the log that decides most, or the only "
        "reading that all logs leave"
    )
    def readings(self) -> tuple[RunReading, ...]:
        return found.readings if (found := self.evidence.if_from(Runs)) else ()

    next: NextRun | None = key(
        "the run to make next, at a theta that was not run, or the theta to paste where there are roles",
        null="where no run was given",
        why="no run was given",
    )

    @property
    @says("the logs that were given, in their order; empty where none were")
    def logs(self) -> tuple[SeenLog, ...]:
        return found.logs if (found := self.evidence.if_from(Logs)) else ()

    @property
    @says("the logs of runs whose relaxation was not constant; `logs` has the others")
    def accelerated(self) -> tuple[Accelerated, ...]:
        return found.accelerated if (found := self.evidence.if_from(Logs)) else ()

    @property
    @says("the bounds that follow from all logs together", null="where none were given", why="no logs were given")
    def interval(self) -> RhoInterval | None:
        return found.interval if (found := self.evidence.if_from(Logs)) else None

    @property
    @says(
        r"what is proved from runs with friction, where no bound of $\rho$ follows from a ratio",
        null="without `--friction`",
        why="no run with friction was given",
    )
    def friction_bounds(self) -> FrictionBounds | None:
        return found.friction_bounds if (found := self.evidence.if_from(Runs)) else None

    @property
    @says(
        "the given data of two bodies before there is a mesh",
        null="where moduli were not given",
        why="no moduli were given",
    )
    def moduli(self) -> ElasticBodies | None:
        return self.evidence.if_from(ElasticBodies)

    @property
    @says(
        "the given data of two plates that exchange heat, or of a fluid and a wall",
        null="where neither was given",
        why="neither heat nor a fluid was given",
    )
    def waves(self) -> Waves | None:
        return self.evidence.if_from(Waves)  # type: ignore[type-abstract]

    @property
    @says("for parallel coupling, in each role; empty where it was not asked for")
    def parallel(self) -> tuple[Parallel, ...]:
        possible = self.roles if self.evidence.kind.parallel else ()
        return tuple(Parallel.of(role) for role in possible if role.rho is not None)

    @property
    @says(
        "for each role of a file of two rectangles that are held at their outer sides, with friction: what layers of "
        "these depths without ends predict; empty elsewhere"
    )
    def layers(self) -> tuple[RoleOfLayers, ...]:
        return self.evidence.layers

    @property
    @says("findings about the given matrices or operators", null="where none were", why="no matrices were given")
    def matrices(self) -> Matrices | None:
        return self.evidence.if_from(Matrices)

    @property
    @says("what iterates and their images show", null="where none were given", why="no vectors were given")
    def vectors(self) -> Vectors | None:
        return self.evidence.if_from(Vectors)

    @property
    @says(
        r"the eigenvalues $\lambda$ in the roles that are advised, or of the run: `low` and `high`, the least and the "
        "largest real part",
        type="map of number",
        unit="1",
        null="where only bounds are known",
        of=lambda spectrum: {"low": spectrum.low, "high": spectrum.high},
        why=lambda advice: advice.why_no_theta or "only bounds of it are known",
    )
    def spectrum(self) -> Spectrum | None:
        return self.best.spectrum if self.roles else None

    @property
    @says("why the theorem does not apply to the problem; empty where it does")
    def outside_theorem(self) -> tuple[str, ...]:
        return self.evidence.outside

    @classmethod
    def of(cls, evidence: Evidence) -> Advice:
        """The advice that follows from evidence."""
        roles = evidence.spectra()
        body, table = evidence.prefers(roles), evidence.methods(roles)
        exchanged = None if body is None else roles[0].neumann_body != body
        return cls(
            evidence=evidence,
            units=UNITS if evidence.problem is None else evidence.problem.units,
            problem=evidence.problem,
            neumann_body=body,
            roles=roles,
            methods=table,
            method=methods.advised(table, tied=evidence.linear, exchanged=exchanged),
            next=evidence.next_run(),
        )

    @property
    def summary(self) -> str:
        if self.theta is None:
            return self.evidence.summary
        theta, rate = self.chosen(self.best)
        who = "" if self.neumann_body is None else f"Neumann problem to {self.evidence.words(self.neumann_body)}, "
        who = who if self.assumes is None else f"assumed: {self.assumes}; "
        return f"{who}theta = {theta:.4g} {'if tied' if self.tied else 'predicted'}, rate {rate:.4g}"

    def chosen(self, role: Role) -> tuple[float, float]:
        """theta and rate by which this advice judges a role."""
        return self.evidence.chosen(role)

    @property
    def why_no_theta(self) -> str:
        """Why the advice has no theta to paste; empty where it has one."""
        return self.evidence.why_no_theta

    @property
    def other(self) -> Role | None:
        """The role that is not advised; None where it is unknown or refused."""
        rest = [role for role in self.roles if role is not self.best and role.rho is not None]
        return rest[0] if rest else None

    @property
    def no_difference(self) -> bool:
        """True if the numbers of steps of both roles differ by at most SAME of them."""
        return self.other is not None and not fewer(self.chosen(self.other)[1], self.chosen(self.best)[1], either=True)

    def snippet(self, library: str, method: str | None = None) -> str:
        """Lines for the configuration of a coupling library: preCICE, Kratos or Norma.

        Parameters
        ----------
        library : str
        method : {'constant', 'aitken', 'iqn-ils'}, optional
            By default the one that is advised for these roles, where the library has it.

        Raises
        ------
        ValueError
            Several readings are left, no such library, or a method that the library does not have.
        """
        if self.theta is None:
            raise ValueError(self.why_no_theta)
        if self.problem is not None and self.problem.several:
            raise self.problem.refuse("contact", None, "the blocks couple two solvers: needed a file with two bodies")
        if self.theta > 1:
            raise ValueError(f"theta = {self.theta:g}: needed at most 1 for the blocks, as the libraries take no more")
        if self.evidence.kind.parallel:
            raise ValueError("the blocks are for serial coupling: needed advice without parallel")
        if method is None:
            method = "constant" if library in ONLY_CONSTANT else self.method_to_paste
        count = steps(self.chosen(self.best)[1])
        scheme = CouplingScheme(neumann_body=self.neumann_body, theta=self.theta, steps=count, tied=self.tied)
        return snippet(library, scheme, method)

    @property
    def method_to_paste(self) -> str:
        """The method that is advised in the roles of `theta`, where `method` may be for the exchanged ones.

        theta is the first factor of one that is not constant.
        """
        own = methods.advised(self.methods, tied=self.tied, exchanged=self.best is not self.roles[0])
        return "constant" if own is None else own.name

    @property
    def advised_exchanged(self) -> str:
        """The method advised with the roles exchanged, where theta is for the roles as they are; empty elsewhere."""
        if self.method is None or not self.method.exchanged or self.neumann_body is not None:
            return ""
        return f"exchanged, {methods.NAMES[self.method.name]} is advised"

    def steps_of(self, method: str) -> str:
        """The steps of a method in the roles of `theta`, to 1e-6, as words."""
        exchanged = self.best is not self.roles[0]
        row = next(row for row in self.methods if row.method == method and row.exchanged == exchanged)
        return "no end of steps" if row.steps is None else f"{f'{row.bound} ' if row.bound else ''}{row.steps} steps"

    @property
    def steps_with_errors(self) -> str:
        """The steps of an estimated theta to 1e-6, and those with the least eigenvalue at the end of its error."""
        said, seen = f"about {self.steps_of('constant')} to 1e-6", self.vectors
        if seen is None or self.theta is None or self.coupling.parallel:
            return said
        both = seen.seen, seen.seen.lowest(self.coupling.least)
        few, most = (methods.steps(each, "constant", self.theta) or 0 for each in both)
        if not most:
            return "in unknown steps (with the least eigenvalue at the end of its error none converges)"
        if None in seen.estimated_errors:
            return f"{said} (with an error that is not known)"
        wide = f"about {few} to {most} steps to 1e-6 (by the error of the least eigenvalue)"
        return wide if most > methods.NEAR * few else said

    @property
    def best(self) -> Role:
        """The role that is advised, or the only one; ValueError where none is, as by several readings of a run."""
        if not self.roles:
            raise ValueError(self.why_no_theta)
        return next((r for r in self.roles if r.neumann_body == self.neumann_body), self.roles[0])


def _rho(role: Role, tied: bool) -> str:
    rho = role.rho_tied if tied and role.rho_tied is not None else role.rho
    return "unknown" if rho is None else f"{rho.value:.3g}"
