"""The search on random problems for a pair of forces that breaks an inequality: the worst ratio of its two sides."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any, Literal

import numpy as np
from scipy.linalg import eigvalsh

from fem1d2d.mesh import Floats
from verification.constants import Measured, measure
from verification.interface.body import Body
from verification.interface.pair import ContactPair, pair_from
from verification.ledger.cases import NAMED, problem
from verification.ledger.differences import Difference, DrawnSetting, draw_pairs
from verification.ledger.evidence import Evidence, figure
from verification.ledger.inequalities import (
    ALLOWANCE,
    INEQUALITIES,
    LEVELS,
    ONE_TRACE_SPACE,
    SEED,
    SHARES,
    Inequality,
    Reading,
)
from verification.machine.threads import one_thread
from verification.problem.specification import Problem
from verification.semidefinite.losses import top


@dataclass(frozen=True, kw_only=True, eq=False)
class Trial:
    """The bodies of a problem with the constants of its mesh."""

    name: str
    pair: ContactPair
    measured: Measured

    @classmethod
    def of(cls, name: str, problem: Problem) -> Trial:
        """Build the bodies of a problem and measure its constants."""
        pair = pair_from(problem)
        return cls(name=name, pair=pair, measured=measure(pair))

    @cached_property
    def setting(self) -> DrawnSetting:
        """The matrices in which differences are measured."""
        return DrawnSetting(pair=self.pair)

    @cached_property
    def reading(self) -> Reading:
        """The constants, as repaired."""
        return Reading.of(self.measured)

    @property
    def bodies(self) -> tuple[Body, Body]:
        """The contact body and the Neumann body: the order of all that follows."""
        return self.pair.contact.mesh_body, self.pair.neumann.mesh_body

    @property
    def N(self) -> tuple[Floats, Floats]:
        """H1 norms squared of the lifts."""
        return self.setting.forms.N_1, self.setting.forms.N_2

    @property
    def E(self) -> tuple[Floats, Floats]:
        """The norms squared of H^1/2(Gamma_c)."""
        return self.setting.forms.E_1, self.setting.forms.E_2

    @property
    def contrast(self) -> list[float]:
        """``M^a/m^a``."""
        return [one.M.value / one.m.value for one in (getattr(self.measured, body.name) for body in self.bodies)]

    @cached_property
    def largest(self) -> list[float]:
        """M^a from the whole spectrum of a dense pencil."""
        return [float(eigvalsh(each.stiffness.toarray(), each.gram_matrix.toarray())[-1]) for each in self.bodies]

    @property
    def continuity(self) -> list[float]:
        """The bounds of M^a that follow from the materials."""
        return [body.material.continuity(body.mesh.dimension) for body in self.bodies]

    #: The largest eigenvalue of a pencil.
    top = staticmethod(top)

    @property
    def grids_differ(self) -> bool:
        """True if the bodies have different grids along Gamma_c."""
        return not self.pair.interface.one_grid

    def across(self, forms: tuple[Floats, Floats]) -> list[float]:
        """The largest quotients of each form over the other body's squared norm of H^1/2(Gamma_c).

        Where the grids differ only of the contact body's form: nothing leads from its grid to the other one.
        """
        one, other = forms
        values = [top(self.pair.interface.carry_form(one), self.E[1])]
        return values if self.grids_differ else [*values, top(other, self.E[0])]

    def at_share(self, share: Fraction) -> Trial:
        """The same bodies at a share of the friction C_2 of the repaired bound."""
        unit = self.measured.with_friction(1.0).C_K
        k = float(share) * self.reading.threshold / (math.nan if unit is None else unit.value)
        pair = self.pair.at(friction=Fraction(k))
        return Trial(name=self.name, pair=pair, measured=self.measured.with_friction(k))


@dataclass(kw_only=True)
class WorstTally:
    """The worst ratio of one inequality so far.

    ``pairs`` and ``problems`` were compared, and in ``apart`` of the problems the grids differ.  ``by_unit`` has for
    each unit of stress the worst ratio, where, the theta, and the name of the problem; ``worst_apart`` is the worst
    ratio where the grids differ, in any unit of stress, -inf where nothing was compared there.
    """

    inequality: Inequality
    pairs: int = 0
    problems: int = 0
    apart: int = 0
    by_unit: dict[float, tuple[float, str, float | None, str]] = field(default_factory=dict)
    worst_apart: float = -math.inf

    def take(self, case: Trial, subjects: Trial | Difference) -> None:
        """Compare both sides on the pairs of a problem, unless the inequality needs one grid and there are two."""
        inequality = self.inequality
        if inequality.one_grid and case.grids_differ:
            return
        self.problems += 1
        self.apart += case.grids_differ
        self.pairs += 1 if isinstance(subjects, Trial) else len(subjects)
        for unit in inequality.units:
            reading = inequality.reading(case.reading.in_unit(unit))
            thetas = (None,) if inequality.thetas is None else inequality.thetas(reading)
            ratios = [np.atleast_1d(inequality.ratio(subjects, reading, theta or 0.0)) for theta in thetas]
            if not ratios or not len(ratios[0]):
                continue
            by_pair = np.nan_to_num(np.stack(ratios, axis=1), nan=math.inf, posinf=math.inf)
            if case.grids_differ:
                self.worst_apart = max(float(by_pair.max()), self.worst_apart)
            for place in np.flatnonzero(by_pair > self._to_beat(unit)).tolist():
                ratio = float(by_pair.ravel()[place])
                # equal up to rounding: the first one stays, on any machine
                if ratio > self._to_beat(unit):
                    number, which = divmod(place, len(thetas))
                    where = case.name if inequality.about == "bodies" else f"{case.name}, pair {number + 1}"
                    self.by_unit[unit] = (ratio, where, thetas[which], case.name)

    def _to_beat(self, unit: float) -> float:
        """The number that a ratio must exceed to be the worst."""
        return self.by_unit[unit][0] * (1 + ALLOWANCE) if unit in self.by_unit else -math.inf

    @property
    def evidence(self) -> Evidence | None:
        """The worst ratio as evidence; None where nothing was compared."""
        if not self.by_unit:
            return None
        unit = max(self.by_unit, key=lambda unit: (figure(self.by_unit[unit][0], 7), unit == 1.0))
        worst, where, theta, name = self.by_unit[unit]
        holds = worst <= 1 + ALLOWANCE
        data: dict[str, Any] = {
            "seed": SEED,
            "problems": self.problems,
            "pairs": self.pairs,
            "worst_ratio": _digits(worst),
            "where": where,
        }
        bodies = self.inequality.about == "bodies"
        count = f"{self.problems} problems" if bodies else f"{self.pairs} pairs on {self.problems} problems"
        if bodies:
            del data["pairs"]
        if theta is not None:
            data["theta"] = _digits(theta)
        if len(self.inequality.units) > 1:
            data |= {"unit": unit, "worst_ratio_by_unit": {f"{u:g}": _digits(v[0]) for u, v in self.by_unit.items()}}
        if name in NAMED:
            data["problem"] = {key: dict(table) for key, table in NAMED[name].items()}
        if self.inequality.one_grid:
            count += f", in each of which both bodies have one grid ({ONE_TRACE_SPACE})"
        else:
            data["grids_differ"] = {"problems": self.apart, "worst_ratio": _digits(self.worst_apart)}
            count += f", of which {self.apart} have grids that differ{self.inequality.remark}"
        sides = "left/right" if not self.inequality.equality else "1 + |left - right|/energy"
        units = self.inequality.units
        if len(units) > 1:
            count += ", stress in units of " + ", ".join(f"{u:g}" for u in units)
        at = where if len(units) == 1 else f"{where}, unit {unit:g}"
        found = f"{sides} {'<=' if holds else '='} {worst:.4g} ({at}), {count}"
        return Evidence(method="discrete", of=self.inequality.of, holds=holds, text=found, data=data)


def _digits(value: float) -> float | None:
    """A number to the seven digits that another machine finds too; None unless it is finite."""
    return figure(value, 7) if math.isfinite(value) else None


def draw_cases(
    count: int, apart: Callable[[int], bool] = lambda number: number % 3 == 0
) -> Iterator[tuple[Trial, np.random.Generator]]:
    """The problems of a pass, each with its own random generator: named ones, then ``count`` random ones.

    Every fifth random problem has friction 10.  ``apart`` chooses, by their numbers, the problems whose grids are drawn
    apart; now and then these come out as one grid.
    """
    for number, (name, data) in enumerate(NAMED.items()):
        yield Trial.of(name, Problem.from_dict(data)), np.random.default_rng([SEED, 0, number])
    for number in range(1, count + 1):
        random = np.random.default_rng([SEED, number])
        drawn = problem(random, 10 if number % 5 == 0 else None, matching=not apart(number))
        yield Trial.of(f"problem {number}", drawn), random


def discrete(
    ids: Collection[str] | None = None,
    level: Literal["quick", "full"] = "quick",
    watch: Callable[[float], None] = lambda done: None,
) -> dict[str, list[Evidence]]:
    """Search random problems for a pair that breaks an inequality: a ``Source``, which takes 30 or, at full, 400.

    One pass over the problems serves all inequalities, and what is found of one does not depend on which others were
    asked for.
    """
    tallies = [WorstTally(inequality=inequality) for inequality in INEQUALITIES if ids is None or inequality.id in ids]
    if not tallies:  # no problem need be built
        watch(1.0)
        return {}
    about = lambda kind: [tally for tally in tallies if tally.inequality.about == kind]
    count, starts, realised = LEVELS[level]
    total = count + len(NAMED)
    with one_thread():
        for done, (case, random) in enumerate(draw_cases(count), start=1):
            for tally in about("bodies"):
                tally.take(case, case)
            if about("pairs"):
                found = pairs_of(case, random, starts=starts, realised=realised)
                for tally in about("pairs"):
                    tally.take(case, found)
            if about("contraction"):
                for share in SHARES:
                    slight = case.at_share(share)
                    found = pairs_of(slight, np.random.default_rng([SEED, done]), starts=0, realised=realised)
                    for tally in about("contraction"):
                        tally.take(slight, found)
            watch(done / total)
    result: dict[str, list[Evidence]] = {}
    for tally in tallies:
        if (evidence := tally.evidence) is not None:
            result.setdefault(tally.inequality.id, []).append(evidence)
    return result


def pairs_of(case: Trial, random: np.random.Generator, *, starts: int, realised: int) -> Difference:
    """The pairs of a problem; a named one has no loads worth trying."""
    realised = 0 if case.name in NAMED else realised
    return Difference.of(list(draw_pairs(case.setting, random, starts=starts, realised=realised)))
