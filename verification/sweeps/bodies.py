"""Data that runs of a sweep share: condensed bodies for every law, modulus and role; constants for every friction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import Any

from verification.constants import Measured, measure
from verification.interface.interface import Law
from verification.interface.pair import ContactPair, pair_from
from verification.problem.specification import Problem
from verification.problem.tables import ProblemError
from verification.sweeps.course import KnownPieces

#: The axes of a grid that change bodies or what joins them; friction and theta do not.
OF_BODIES = ("young", "neumann_body", "law", "radius")

#: Values of those axes, as pairs of name and value.
Changes = tuple[tuple[str, Any], ...]

#: Number of pairs and constants that are kept: rows that share them are neighbours.
KEPT = 16


@dataclass(frozen=True, kw_only=True, eq=False)
class RowSetting:
    """Shared data of rows that differ only in theta or in the rule.

    ``pieces`` are the affine pieces of T that runs have passed through.
    """

    pair: ContactPair
    measured: Measured
    pieces: KnownPieces

    @cached_property
    def energy(self) -> tuple[float, float, float] | None:
        """rho, kappa_1 and kappa_2 of the theorem in energy norms; None where they do not exist."""
        found = self.measured.energy_constants()
        return None if found is None else (float(found.at_work), float(found.kappa_1), float(found.kappa_2))


class SharedBodies:
    """The pairs and the constants of a sweep of ``start``, each made once while it is in use.

    A row does not depend on the rows before it: bodies are always scaled from those of the problem on the mesh of the
    row, and constants always measured for the modulus of body 2 that the problem has.
    """

    def __init__(self, start: Problem | ContactPair) -> None:
        self.start = start
        self.problem = start if isinstance(start, Problem) else start.problem
        self._law: Law | None = None if isinstance(start, Problem) else start.interface.law
        self._base = lru_cache(maxsize=2)(self._condense)
        self._pair = lru_cache(maxsize=KEPT)(self._change)
        self._constants = lru_cache(maxsize=KEPT)(self._measure)
        self._setting = lru_cache(maxsize=KEPT)(self._set)

    def setting(self, values: Mapping[str, Any]) -> RowSetting:
        """Return the data that a row shares with the rows of the same bodies and friction."""
        return self._setting(*self._key(values), values.get("friction"))

    def _set(self, refine: int, changes: Changes, friction: Fraction | None) -> RowSetting:
        pair = self._pair(refine, changes)
        if friction is not None:
            pair = pair.at(friction=friction)
        named = dict(changes)
        if "young" in named and self.problem is not None:
            # rho and the kappas do not change where both moduli are multiplied by one number
            lower, upper = named["young"]
            second = self.problem.body2.young
            named["young"] = (lower / upper * second, second)
        measured = self._constants(refine, tuple(named.items()))
        if measured.of_friction:  # else friction is absent, or its constants do not exist
            measured = measured.with_friction(float(pair.friction))
        return RowSetting(pair=pair, measured=measured, pieces=KnownPieces(pair))

    @staticmethod
    def _key(values: Mapping[str, Any]) -> tuple[int, Changes]:
        return values.get("refine", 0), tuple((name, values[name]) for name in OF_BODIES if name in values)

    def _condense(self, refine: int) -> ContactPair:
        """Condense the bodies of the problem on a mesh halved so often."""
        if isinstance(self.start, ContactPair) and not refine:
            return self.start
        return pair_from(self._refined(refine), law=self._law)

    def _refined(self, refine: int) -> Problem:
        if self.problem is None:
            raise ProblemError("<matrices>", "refine", refine, "needed a problem, whose mesh can be halved")
        return self.problem.refined(refine)

    def _change(self, refine: int, changes: Changes) -> ContactPair:
        changed = dict(changes)
        if self.problem is None:
            base = self._base(refine)
            roles = changed.pop("neumann_body", base.neumann_body)
            if changed:
                name, value = next(iter(changed.items()))
                raise ProblemError("<matrices>", name, value, "needed a problem, whose values can change")
            return base if roles == base.neumann_body else base.swapped()
        try:
            base = self._base(refine)
        except ProblemError:  # the roles or the law of the problem do not fit; those of the row may
            if not changed:
                raise
            law = None if {"law", "radius"} & changed.keys() else self._law
            return pair_from(self._refined(refine).changed(**changed), law=law)
        return base.changed(**changed) if changed else base

    def _measure(self, refine: int, changes: Changes) -> Measured:
        """Measure rho and the constants of the energy norms, not those of Section 5."""
        pair = self._pair(refine, changes)
        contact, neumann = replace(pair.contact, body=None), replace(pair.neumann, body=None)
        return measure(replace(pair, contact=contact, neumann=neumann, problem=None))
