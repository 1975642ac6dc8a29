"""Roles of the two bodies and theta: the advice, from the theorem and from rho."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from fractions import Fraction
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from scipy.linalg import eigh

from ndtheory import EnergyBounds, EnergyConstants, Number, evaluate_energy
from ndtheory.energy_norms import predicted_rate, predicted_theta, tied_factor, tied_rate, tied_theta
from verification.algorithm.rates import steps
from verification.algorithm.theta import Choice, automatic, by_prediction, energy_bounds
from verification.constants import measure
from verification.constants.measuring import normal_pencil, pencil
from verification.constants.operators import Pencils, needs_matrices, pair_or_bodies
from verification.coupling import methods
from verification.coupling.accelerated import Accelerated
from verification.coupling.cells import Suggested, no_cells, suggest
from verification.coupling.kinds import BodyNumber
from verification.coupling.methods import Advised, MethodRow
from verification.coupling.readings import LARGEST_TO_PASTE, NextRun, RunReading, SeenRun, rounded_down
from verification.coupling.runs_with_friction import FrictionBounds
from verification.coupling.seen import RhoInterval, SeenLog
from verification.coupling.seen_moduli import Parallel, SeenModuli, SeenWaves
from verification.coupling.sides import SeenMatrices
from verification.coupling.snippets import ONLY_CONSTANT, CouplingScheme, snippet
from verification.coupling.spectrum import SeenVectors, Spectrum
from verification.document import Document
from verification.interface.assembly import SingularRole, TwoBodies
from verification.interface.build import build
from verification.interface.pair import UNITS, ContactPair
from verification.machine.progress import Progress, silent
from verification.machine.threads import one_thread
from verification.problem import Problem, load
from verification.problem.tables import ProblemError
from verification.value import to_plain

#: Exchanging the roles makes no difference where it changes the number of steps by no more than this share of it.
SAME = 0.02

#: The entries of a role that rest on an upper bound of rho.
PROVED = ("theta_proved", "factor_proved", "theta_max_proved")

#: Up to so many unknowns all eigenvalues are found, for the predictions of methods; beyond only their ends.
ALL = 600

#: The entries of a role for a tied interface, in this order.
TIED = ("rho_min", "rho_tied", "theta_tied", "rate_tied")


#: Attributes of a role that its document leaves out.
UNSEEN = ("energy", "spectrum", "cells")


@dataclass(frozen=True, kw_only=True)
class Role:
    """Prediction and proofs for the iteration when one body gets the Neumann problem.

    Attributes
    ----------
    neumann_body : {1, 2} or None
        None where the number of that body is not known.
    rho : Number or None
        Largest ratio of the contact body's stiffness to the Neumann body's on the interface; with rho_normal without
        friction.  From moduli a bound from below.  None, as all that rests on it, where the role is refused.
    theta_proved : float or None
        The theta of least proved factor.
    factor_proved, theta_max_proved : Number or None
    theta_predicted, rate_predicted : float or None
        ``2/(2 + rho)`` and ``rho/(2 + rho)``: a prediction, proved without friction; None of a bound from below.
    friction_threshold : Number or None
        Friction below which every small theta is proved.
    singular : bool
        True if the Neumann problem has no unique solution, as contact alone holds that body; such a role is refused.
    reason : mapping
        Why a value is None.
    theta_auto : Choice or None
        The choice of ``theta = "auto"`` in these roles; None without a problem file.
    energy : EnergyConstants or None
        The constants behind the proved values; None where nothing is proved.
    rho_min, rho_tied : Number or None
        Both ends of the spectrum of (S of the contact body, S of the Neumann body): rho_tied is rho, except where rho
        is rho_normal.  None where they are not known, and ``reason["rho_min"]`` says why.
    spectrum : Spectrum or None
        Eigenvalues for predictions of methods; None where rho is only bounded from below.
    cells : Suggested or None
        rho of the file's cells in these roles, and cells with a smaller one; None without a problem file.
    """

    neumann_body: BodyNumber | None
    rho: Number | None
    theta_proved: float | None = None
    factor_proved: Number | None = None
    theta_max_proved: Number | None = None
    theta_predicted: float | None = None
    rate_predicted: float | None = None
    friction_threshold: Number | None = None
    reason: Mapping[str, str]
    singular: bool = False
    theta_auto: Choice | None = None
    energy: EnergyConstants | None = None
    rho_min: Number | None = None
    rho_tied: Number | None = None
    spectrum: Spectrum | None = None
    cells: Suggested | None = None

    @property
    def ends(self) -> tuple[Fraction, Fraction] | None:
        """rho_min and rho_tied; None where they are not known."""
        if self.rho_min is None or self.rho_tied is None:
            return None
        largest = Fraction(self.rho_tied.value)
        return min(max(Fraction(self.rho_min.value), Fraction(0)), largest), largest  # both may be rounded past

    @property
    def theta_tied(self) -> float | None:
        """``2/(2 + rho_min + rho_tied)``: the best theta where nothing opens or slips."""
        return None if self.ends is None else float(tied_theta(*self.ends))

    @property
    def rate_tied(self) -> float | None:
        """``(rho_tied - rho_min)/(2 + rho_min + rho_tied)``: at that theta no step has a larger factor there."""
        return None if self.ends is None else float(tied_rate(*self.ends))

    def factor_where_tied(self, theta: float) -> float | None:
        """The factor of another theta where nothing opens or slips; above 1 where it diverges."""
        return None if self.ends is None else float(tied_factor(Fraction(theta), *self.ends))

    @property
    def why_not_tied(self) -> str:
        """Why the ends of the spectrum are not known."""
        return self.reason.get("rho_min", "")

    @property
    def predicted(self) -> tuple[float, float]:
        """``theta_predicted`` and ``rate_predicted``.

        Raises
        ------
        ValueError
            The role is refused, or rho is bounded only from below.
        """
        if self.theta_predicted is None or self.rate_predicted is None:
            raise ValueError(self.reason["theta_predicted"])
        return self.theta_predicted, self.rate_predicted

    def advised(self, *, tied: bool = False) -> tuple[float, float]:
        """theta and the rate by which it is chosen: the predicted ones, or those for a tied interface.

        Where eigenvalues are complex, or estimated, the whole spectrum decides.

        Raises
        ------
        ValueError
            The role is refused, or the ends of its spectrum are not known.
        """
        if self.spectrum is not None and (self.spectrum.source == "vectors" or not self.spectrum.real):
            return self.spectrum.theta, self.spectrum.factor(self.spectrum.theta)
        if not tied:
            return self.predicted
        if self.theta_tied is None or self.rate_tied is None:
            raise ValueError(self.reason["rho"] if self.rho is None else self.why_not_tied)
        return self.theta_tied, self.rate_tied

    @property
    def proved(self) -> bool:
        """True if the predicted rate is proved, as it is without friction."""
        bound = self.factor_proved
        return bound is not None and self.rate_predicted is not None and bound.value <= (1 + 1e-9) * self.rate_predicted

    def to_dict(self) -> dict[str, Any]:
        """A member of ``roles``."""
        names = dict.fromkeys((*(field.name for field in fields(self) if field.name not in UNSEEN), *TIED))
        values = {name: to_plain(getattr(self, name)) for name in names}
        values["reason"] = dict(self.reason)
        if self.theta_auto is None:
            values["reason"].setdefault("theta_auto", "no problem file")
        if self.ends is None:
            values["reason"] |= dict.fromkeys(TIED, self.why_not_tied)
        entries, why = ({}, {}) if self.cells is None else self.cells.entries()
        return values | entries | {"reason": values["reason"] | why}

    @classmethod
    def refused(cls, neumann_body: BodyNumber, error: ValueError, *, of_file: bool = False) -> Role:
        """A role, of a problem file or of other input, that is refused: no value but the reason."""
        why = error.needed if isinstance(error, ProblemError) else str(error)
        given = ("neumann_body", "reason", "singular", *UNSEEN)
        values = [field.name for field in fields(cls) if field.name not in given]
        why = f"these roles are refused: {why}"
        return cls(
            neumann_body=neumann_body,
            **dict.fromkeys(values),
            reason=dict.fromkeys(values, why),
            cells=no_cells(why) if of_file else None,
            singular=isinstance(error, SingularRole),
        )


def role_of(
    neumann_body: BodyNumber | None,
    rho: Number | Fraction,
    *,
    bounds: EnergyBounds | None = None,
    nothing: str = "",
    threshold: Number | None = None,
    no_threshold: str = "",
    reason: Mapping[str, str] | None = None,
    **known: Any,
) -> Role:
    """The role for a known rho: its prediction, and the proofs of the theorem in energy norms.

    Parameters
    ----------
    neumann_body : {1, 2} or None
    rho : Number or Fraction
    bounds, nothing : EnergyBounds, optional, and str
        The theorem for this rho, and for the friction there is; why nothing is proved, empty where the bounds are.
    threshold, no_threshold : Number, optional, and str
        Friction below which every small theta is proved; why there is none, if it is not for want of a proof.
    reason : mapping, optional
        Why other values are None.
    **known
        Other attributes of :class:`Role`.
    """
    ratio = Fraction(rho.value) if isinstance(rho, Number) else rho
    theta, rate = float(predicted_theta(ratio)), float(predicted_rate(ratio))
    proved: dict[str, Any] = {}
    because = dict.fromkeys(PROVED, nothing)
    if bounds is not None:
        theta, rate = bounds.theta_predicted, bounds.rate_predicted
        if not nothing:
            proved = {name: getattr(bounds, name) for name in PROVED}
            because = {name: why for name, why in bounds.reason.items() if name in PROVED}
    if threshold is None:
        because["friction_threshold"] = no_threshold or nothing
    return Role(
        neumann_body=neumann_body,
        rho=rho if isinstance(rho, Number) else Number.of_float(rho),
        theta_predicted=theta,
        rate_predicted=rate,
        friction_threshold=threshold,
        reason={**(reason or {}), **because},
        **proved,
        **known,
    )


def role_on(
    neumann_body: BodyNumber | None, spectrum: Spectrum, *, nothing: str, reason: Mapping[str, str] | None = None
) -> Role:
    """The role of a spectrum of which nothing is proved; an end below 0 counts as 0."""
    low, high = (Number.of_float(max(end, 0.0)) for end in (spectrum.low, spectrum.high))
    known: dict[str, Any] = {"rho_min": low, "rho_tied": high, "spectrum": spectrum}
    return role_of(neumann_body, Fraction(high.value), nothing=nothing, reason=reason, **known)


def plain_role(neumann_body: BodyNumber, rho: Fraction, **settings: Any) -> Role:
    """The role without friction, from rho; ``settings`` are parameters of :func:`role_of`."""
    bounds = evaluate_energy(EnergyConstants(rho=rho))
    settings.setdefault("no_threshold", "matrices say nothing about friction: the proved values are for k = 0")
    return role_of(neumann_body, bounds.rho, bounds=bounds, **settings)


def table_of(
    roles: Sequence[Role], *, tied: bool, one_end: bool = False, theta: float | None = None
) -> tuple[MethodRow, ...]:
    """The methods in all roles that are not refused, the first role's own ones first.

    Contact that may open has a mode with lambda = 0 besides; with ``one_end`` only the largest eigenvalue is known;
    ``theta`` is the factor that is advised, where the role has another one.
    """
    found: list[MethodRow] = []
    for role in roles:
        if role.rho is None:
            continue
        spectrum = role.spectrum or Spectrum.between(float(role.ends[0] if role.ends else 0), role.rho.value)
        own = min(role.advised(tied=tied and role.ends is not None)[0], float(LARGEST_TO_PASTE))
        found += methods.rows(
            spectrum if tied else spectrum.with_open_nodes(),
            theta=own if theta is None else theta,
            neumann_body=role.neumann_body,
            exchanged=role is not roles[0],
            one_end=one_end,
        )
    return tuple(found)


def with_both_ends(roles: Sequence[Role], rho: Sequence[Number | None] = ()) -> tuple[Role, ...]:
    """Both roles of a pair on the same unknowns, with the ends of the spectrum where neither is refused.

    The eigenvalues of (S_n, S_c) and (S_c, S_n) are reciprocal: ``rho_min`` of one role is one over rho of the other.
    Both ``rho`` are given where the roles have rho_normal.
    """
    one, other = rho or [role.rho for role in roles]
    if one is None or other is None:
        return tuple(roles)
    least = [Number.of_float(1 / Fraction(number.value)) for number in (other, one)]
    ends = zip(roles, least, (one, other), strict=True)
    return tuple(replace(role, rho_min=low, rho_tied=high) for role, low, high in ends)


def spectrum_of(pair: ContactPair, *, normal: bool) -> Spectrum | None:
    """All eigenvalues of (P' S_c P, S_n), of the normal components if asked; None beyond ALL unknowns."""
    if pair.neumann.grid.size > ALL:
        return None
    with one_thread():
        return Spectrum.of(np.maximum(eigh(*(normal_pencil(pair) if normal else pencil(pair)), eigvals_only=True), 0.0))


def best_of(roles: Iterable[Role], *, tied: bool = False) -> Role:
    """The role that takes fewer steps; the first one where it makes no difference, or where the other is refused."""
    first, *rest = (role for role in roles if role.rho is not None)
    return next((role for role in rest if fewer(role.advised(tied=tied)[1], first.advised(tied=tied)[1])), first)


def in_steps(rate: float) -> str:
    """The steps to 1e-9 in words."""
    count = steps(rate)
    return "no end of steps" if count is None else f"{count} step{'s' * (count != 1)}"


def fewer(rate: float, other: float, *, either: bool = False) -> bool:
    """True if a rate takes fewer steps than another one, or with ``either`` more, by more than SAME of them."""
    one, two = (math.inf if count is None else count for count in map(steps, (rate, other)))
    return one < (1 - SAME) * two or (either and two < (1 - SAME) * one)


@dataclass(frozen=True, kw_only=True, repr=False)
class Advice(Document):
    """The advice.

    Attributes
    ----------
    neumann_body : {1, 2} or None
        The body that should get the Neumann problem; None where one run does not show the other assignment.
    roles : tuple of Role
        The file's assignment first; of a run only its own, and none while its ratio has several readings.
    friction : float or None
        None where it is not known.
    outside : tuple of str
        Why the theorem does not apply to the problem.
    run : SeenRun or None
        The run that was given as its ratio.
    readings : tuple of RunReading
        Possible meanings of the run or of the logs.
    next : NextRun or None
        The run to make next.
    logs : tuple of SeenLog
        The logs of other runs as they were read.
    accelerated : tuple of Accelerated
        Logs of runs whose relaxation was not constant.
    interval : RhoInterval or None
        Bounds of rho from these logs together.
    moduli : SeenModuli or None
        The moduli of two bodies, and bounds of rho from below.
    waves : SeenWaves or None
        Data of two plates that exchange heat, or of a fluid and a wall.
    parallel : tuple of Parallel
        theta and factor of parallel coupling for each role, where that was asked for: then `theta` is for it.
    matrices : SeenMatrices or None
        The matrices or operators that were given.
    tied : bool
        True if the advice is for an interface where nothing opens or slips.
    assumes : str or None
        The assumption under which runs were read; None where none were given.
    friction_bounds : FrictionBounds or None
        Bounds that runs prove with friction; None unless friction was given.
    vectors : SeenVectors or None
        The iterates and images that were given.
    methods : tuple of MethodRow
        Steps of a constant theta, of Aitken and of IQN-ILS in each role, predicted on the spectrum; empty where nothing
        decides it.
    method : Advised or None
        The one that is advised.
    """

    schema: ClassVar[str] = "ndtheory.advice/1"

    neumann_body: BodyNumber | None
    roles: tuple[Role, ...]
    units: Mapping[str, str]
    friction: float | None = None
    outside: tuple[str, ...] = ()
    run: SeenRun | None = None
    readings: tuple[RunReading, ...] = ()
    next: NextRun | None = None
    logs: tuple[SeenLog, ...] = ()
    accelerated: tuple[Accelerated, ...] = ()
    interval: RhoInterval | None = None
    matrices: SeenMatrices | None = None
    problem: Problem | None = None
    moduli: SeenModuli | None = None
    tied: bool = False
    assumes: str | None = None
    friction_bounds: FrictionBounds | None = None
    vectors: SeenVectors | None = None
    methods: tuple[MethodRow, ...] = ()
    method: Advised | None = None
    waves: SeenWaves | None = None
    parallel: tuple[Parallel, ...] = ()

    @classmethod
    def between(cls, roles: Sequence[Role], *, tied: bool, **known: Any) -> Advice:
        """The advice for the role that takes fewer steps; one of them at least must not be refused."""
        best, table = best_of(roles, tied=tied), table_of(roles, tied=tied)
        return cls(
            neumann_body=best.neumann_body,
            roles=tuple(roles),
            tied=tied,
            methods=table,
            method=methods.advised(table, tied=tied, exchanged=best is not roles[0]),
            **known,
        )

    @property
    def summary(self) -> str:
        if self.moduli is not None:
            return self.moduli.summary
        if self.theta is None and self.waves is not None and self.best.rho is not None:
            return f"rho is at least {self.best.rho.value:.4g} with the Neumann problem on the wall"
        if self.theta is None and self.vectors is not None:
            return self.why_no_theta
        if not self.roles:
            return f"assumed: {self.assumes}; {len(self.readings)} readings of {'a run' if self.run else 'logs'}"
        theta, rate = self.chosen(self.best)
        who = "" if self.neumann_body is None else f"Neumann problem to {self.words(self.neumann_body)}, "
        who = who if self.assumes is None else f"assumed: {self.assumes}; "
        return f"{who}theta = {theta:.4g} {'if tied' if self.tied else 'predicted'}, rate {rate:.4g}"

    def words(self, body: int) -> str:
        """Return what body 1 or body 2 stands for in the file: ``body 2``, or ``bodies 2, 4``."""
        return f"body {body}" if self.problem is None else self.problem.words(body)

    @property
    def spectrum(self) -> Spectrum | None:
        """The eigenvalues in the role that is advised; None where they are not known."""
        return self.best.spectrum if self.roles else None

    def chosen(self, role: Role) -> tuple[float, float]:
        """theta and rate by which this advice judges a role."""
        for one in self.parallel:
            if one.neumann_body == role.neumann_body and not one.bound:
                return one.theta, one.factor
        return role.advised(tied=self.tied and role.ends is not None)

    @property
    def theta(self) -> float | None:
        """The theta to paste, rounded down; None while several readings are left, or of moduli."""
        if not self.roles or self.moduli is not None or (self.waves is not None and self.next is not None):
            return None
        if self.vectors is not None and not self.vectors.high_found:
            return None
        if self.next is not None:
            return self.next.theta
        return rounded_down(min(Fraction(self.chosen(self.best)[0]), LARGEST_TO_PASTE))

    @property
    def why_no_theta(self) -> str:
        """Why the advice has no theta to paste; empty where it has one."""
        if self.theta is not None:
            return ""
        if self.moduli is not None:
            return "moduli bound rho from below: `next` is a theta to begin with"
        if self.waves is not None:
            return "one wave bounds rho from below: `next` is a run to begin with"
        if self.vectors is not None:
            return self.vectors.why_no_theta
        if self.friction_bounds is not None:
            return "with friction no run decides theta: make the run that `next` names"
        if self.accelerated and not self.readings:
            return "the runs decide no theta: make the run that `next` names"
        return "several readings are left: make the run that `next` names"

    @property
    def other(self) -> Role | None:
        """The role that is not advised; None where it is unknown or refused."""
        rest = [role for role in self.roles if role is not self.best and role.rho is not None]
        return rest[0] if rest else None

    @property
    def no_difference(self) -> bool:
        """True if the numbers of steps of both roles differ by at most SAME of them."""
        return self.other is not None and not fewer(self.chosen(self.other)[1], self.chosen(self.best)[1], either=True)

    @property
    def quote(self) -> str | None:
        """The reason for the advice in sentences to be quoted: rho, theta, steps, method; None without a theta."""
        if self.theta is None or self.waves is not None:
            return None
        best, other = self.best, self.other
        tied = self.tied and best.ends is not None
        theta, rate = self.chosen(best)
        first = "" if self.assumes is None else f"Assumed: {self.assumes}. "
        first += f"rho (stiffness of contact body over Neumann body on the interface, at worst) is {_rho(best, tied)}"
        if self.neumann_body is not None:
            words = self.words(self.neumann_body)
            first += f" with {words} as Neumann {words.split()[0]}"
        if other is not None:
            first += f", {_rho(other, tied)} with the roles exchanged"
        formula = "2/(2+rho)"
        if tied and best.rho_min is not None:
            formula = "2/(2+rho_min+rho)"
            first += f"; rho_min (at best) is {best.rho_min.value:.3g}"
        bound = "about " if self.vectors is not None or self.accelerated else "at most " * (tied or best.proved)
        then = f"So relax by {formula} = {theta:.3g}: {bound}{in_steps(rate)} to 1e-9"
        then += " if nothing opens or slips" if tied else " without friction" if best.proved else " are predicted"
        if other is not None:
            away = in_steps(self.chosen(other)[1]).removesuffix(" steps")
            then += ", the same with the roles exchanged" if self.no_difference else f", against {away}"
        if (own := self.method_to_paste) != "constant":
            then += f". {methods.NAMES[own]} from there is predicted to take {self.steps_of(own)} to 1e-6, not "
            then += self.steps_of("constant").removesuffix(" steps")
        return f"{first}. {then}."

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
        if self.parallel:
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
    def best(self) -> Role:
        """The role that is advised, or the only one.

        Raises
        ------
        ValueError
            The ratio of a run has several readings: ``next`` is the run to make.
        """
        if not self.roles:
            raise ValueError(self.why_no_theta)
        return next((r for r in self.roles if r.neumann_body == self.neumann_body), self.roles[0])

    def content(self) -> dict[str, Any]:
        origins = ("run", "readings", "next", "logs", "accelerated", "interval", "friction_bounds")
        inputs = ("moduli", "waves", "parallel", "matrices", "vectors")
        names = ("neumann_body", "theta", "tied", "assumes", "quote", "methods", "method", "roles", *origins, *inputs)
        found = {name: to_plain(getattr(self, name)) for name in names}
        known = self.spectrum
        found["spectrum"] = None if known is None else {"low": known.low, "high": known.high}
        same = "both roles have the same bounds"
        missing = {
            "neumann_body": same if self.moduli else "one run gives no information about the exchanged roles",
            "run": "logs were given" if self.logs or self.accelerated else "no run was given",
            "next": "no run was given",
            "interval": "no logs were given",
            "moduli": "no moduli were given",
            "waves": "neither heat nor a fluid was given",
            "assumes": "no run was given",
            "friction_bounds": "no run with friction was given",
            "matrices": "no matrices were given",
            "vectors": "no vectors were given",
            "method": ("parallel coupling" if self.parallel else "")
            or self.why_no_theta
            or "no method arrives in the steps that are simulated",
            "spectrum": self.why_no_theta or "only bounds of it are known",
            "theta": self.why_no_theta,
            "quote": self.why_no_theta or "no stiffness was given",
        }
        reason = {name: why for name, why in missing.items() if found[name] is None}
        return {**found, "outside_theorem": list(self.outside), "reason": reason}


def advise(problem: Problem | ContactPair | Path | str, *, tied: bool = False, progress: Progress = silent) -> Advice:
    """Advise on the roles of the bodies and on theta.

    rho and rho_min are the largest and the smallest ratio of two stiffnesses on the interface, of the contact body over
    the Neumann body.  The body with the smaller predicted rate ``rho/(2 + rho)`` gets the Neumann problem; for a tied
    interface the rate is ``(rho - rho_min)/(2 + rho_min + rho)``.

    Parameters
    ----------
    problem : Problem, ContactPair or path
    tied : bool
        True to advise for an interface where nothing opens or slips.
    progress : callable
        Called with the Lanczos steps where there are too many contact nodes for matrices.

    Returns
    -------
    Advice
        ``neumann_body`` is the body to read forces; ``best.theta_predicted``, ``best.rate_predicted`` and ``best.rho``
        belong to it; ``roles`` has both assignments.

    Raises
    ------
    ProblemError
        As :func:`verification.measure`, and where more contact nodes than interface matrices may have are held
        differently.

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
        if isinstance(pair, TwoBodies):
            roles = _roles_without_matrices(pair, tied, progress)
        else:
            roles = (_role(pair, tied), _exchanged(pair, tied))
    except SingularRole as error:
        assert not isinstance(problem, ContactPair)  # made with roles that are not singular
        given = problem if isinstance(problem, Problem) else load(problem)
        pair = build(given.swapped())  # refused itself where contact holds that body, too
        roles = (Role.refused(given.iteration.neumann_body, error, of_file=True), _role(pair, tied))
    return Advice.between(
        roles,
        tied=tied,
        units=UNITS if pair.problem is None else pair.problem.units,
        problem=pair.problem,
        friction=float(pair.friction),
        outside=tuple(pair.outside),
    )


def _exchanged(pair: ContactPair, tied: bool) -> Role:
    """The other assignment of the roles, which may be refused."""
    try:
        return _role(pair.swapped(), tied)
    except ValueError as error:
        return Role.refused(pair.contact_body, error, of_file=pair.problem is not None)


def _role(pair: ContactPair, tied: bool) -> Role:
    measured = measure(pair)
    energy = energy_bounds(measured)
    assert measured.rho_max is not None  # the two bodies have interface matrices
    if energy is None:
        nothing = measured.why_no_energy
        auto = by_prediction(measured.rho_max.value, nothing)
    else:
        nothing = f"outside the theorem: {pair.outside[0]}" if pair.outside else ""
        auto = automatic(energy, pair.outside, pair.settings.tolerance)
    rho, normal = measured.rho_max if energy is None else energy.rho, not (pair.friction or tied)
    return role_of(
        pair.neumann_body,
        rho,
        bounds=energy,
        nothing=nothing,
        threshold=None if nothing else measured.friction_threshold,
        no_threshold="" if nothing else measured.why_no_threshold,
        theta_auto=auto,
        energy=None if nothing else measured.energy_constants(),
        rho_min=measured.rho_min,
        rho_tied=measured.rho_max,
        spectrum=spectrum_of(pair, normal=normal),
        cells=None
        if pair.problem is None
        else suggest(pair.problem, rho if normal else measured.rho_max, normal=normal),
    )


def _roles_without_matrices(bodies: TwoBodies, tied: bool, progress: Progress) -> tuple[Role, ...]:
    """Both roles, the file's first, from rho, which is rho_normal in frictionless contact.

    A tied interface then needs two eigenvalues more.
    """
    pencils, problem = Pencils(bodies, progress), bodies.problem
    for why in pencils.reason.values():
        raise ProblemError(problem.source, "contact", None, f"no advice: {why}")
    needed, rubs, outside = needs_matrices(bodies), bool(bodies.friction), bodies.outside
    nothing = f"outside the theorem: {outside[0]}" if outside else needed if rubs else ""
    reason, order = {"theta_auto": needed}, (problem.iteration.neumann_body, problem.contact_body)
    if not (rubs or tied):
        more = "without friction rho is rho_normal, and a tied interface needs two more eigenvalues: ask for tied"
        reason["rho_min"] = more
    settings = {"nothing": nothing, "no_threshold": nothing or needed, "reason": reason}
    largest = lambda body, normal: pencils.largest(neumann_body=body, normal=normal).value
    roles = []
    for body, own in zip(order, (problem, problem.swapped()), strict=True):
        rho = Number.of_float(largest(body, not rubs))
        cells = suggest(own, rho, normal=not rubs)
        roles.append(plain_role(body, Fraction(rho.value), cells=cells, **settings))
    if rubs:
        return with_both_ends(roles)
    return with_both_ends(roles, [Number.of_float(largest(body, False)) for body in order]) if tied else tuple(roles)


def _rho(role: Role, tied: bool) -> str:
    rho = role.rho_tied if tied and role.rho_tied is not None else role.rho
    return "unknown" if rho is None else f"{rho.value:.3g}"
