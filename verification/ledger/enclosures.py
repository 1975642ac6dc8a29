"""Inequalities of Sections 4 and 5 on named bodies, both sides between proved bounds for the exact data.

Where the bounds of the sides do not overlap, the inequality is decided on these bodies: one that fails there is
refuted by proof, and of one that holds this is one case.  Where they overlap nothing is said.  Equalities cannot be
decided so.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from fractions import Fraction
from typing import Any, Literal

from fem1d2d import plane_strain
from ndtheory import bounds as formulas
from ndtheory.intervals import Interval
from ndtheory.number import SLACK, working_precision
from verification.ledger.cases import NAMED
from verification.ledger.enclosed_pairs import Bodies, Slides
from verification.ledger.evidence import Evidence, Level
from verification.threads import one_thread

#: The bodies on which most is decided, and those on which (5.30) as printed fails, in a unit of stress.
PLATE, LAYER = "plate of thickness 0.01 clamped at one end", "layer of a ten-thousandth on a block"

#: Of stress, in units of the file: the one in which (5.30) as printed fails, and that of the file.
SMALL, OWN = Fraction(1, 10**6), Fraction(1)

HALF = Fraction(1, 2)

#: An inequality with both sides; several that are to hold together.
Sides = list[tuple[Interval, Interval]]

#: A statement, and what of it is decided.
Key = tuple[str, Literal["printed", "step", "repaired"]]


@dataclass(frozen=True, kw_only=True, eq=False)
class Constants:
    """The constants as Section 5 reads them, and its right sides, all enclosed.

    Attributes
    ----------
    bodies : Bodies
    printed : bool
        Whether the bracket of (5.30) adds a stress to 1.
    unit : Fraction
        Of stress, in units of the file.
    """

    bodies: Bodies
    printed: bool = False
    unit: Fraction = OWN

    def stress(self, name: str) -> Interval:
        """A constant that is a stress, in that unit."""
        return self.bodies.number(name) * self.unit

    @property
    def C_R(self) -> Interval:
        """Of both lifts."""
        return self.bodies.number("C_R")

    @property
    def A(self) -> Interval:
        """``M C_R``."""
        return self.stress("M") * self.C_R

    @property
    def give(self) -> Interval:
        """``m^2/(M C_R)^2`` of (5.29)."""
        return (self.stress("m") / self.A).square()

    @property
    def X(self) -> Interval:
        """The factor of (5.11)."""
        m, x = self.stress("m"), self.stress("C_K")
        return (self.A + x + (x * m).sqrt()) / m

    def grows(self, formula: Callable[..., Any]) -> Interval:
        """A formula of C_K, m, M, C_R and u that falls with m and grows with the others (:mod:`ndtheory.bounds`)."""
        x, m, M, C_R = (self.stress("C_K"), self.stress("m"), self.stress("M"), self.C_R)
        edition = formulas.PRINTED if self.printed else formulas.REPAIRED
        with working_precision():
            low = formula(x.lo, m.hi, M.lo, C_R.lo, edition.unit(m.hi)) * (1 - SLACK)
            high = formula(x.hi, m.lo, M.hi, C_R.hi, edition.unit(m.lo)) * (1 + SLACK)
        return Interval.between(low, high)

    @property
    def P(self) -> Interval:
        """The factor of (5.30)."""
        return self.grows(formulas.P)

    @property
    def C_T(self) -> Interval:
        """(5.16)."""
        return self.grows(lambda x, m, M, C_R, u: formulas.lipschitz(m, M, C_R, x))

    def weight(self, theta: Fraction) -> Interval:
        """The coefficient of ``|||T psi - T psi~|||^2`` in (5.32)."""
        return theta**2 - 2 * theta * (1 - theta) * self.give

    def h_2(self, theta: Fraction) -> Interval:
        """(5.45)."""
        return (1 - theta) ** 2 + 2 * theta * (1 - theta) * self.P


ONE = Interval.of(1)


#: Of the bodies alone; both sides are squares.
OF_BODIES: Mapping[Key, Callable[[Bodies], Sides]] = {
    ("4.7", "printed"): lambda b: [(b.top(b.E[1], b.N[0]), ONE), (b.top(b.E[0], b.N[1]), ONE)],
    ("4.7", "repaired"): lambda b: [(b.top(E, N), ONE) for E, N in zip(b.E, b.N, strict=True)],
    ("4.8", "repaired"): lambda b: [(b.top(N, E), c) for N, E, c in zip(b.N, b.E, b.contrast, strict=True)],
    ("prop-4.1.1", "repaired"): lambda b: [
        (b.top(b.N[i], b.N[1 - i]), b.contrast[i] * b.across(b.E)[i]) for i in (0, 1)
    ],
    ("prop-4.1.2", "printed"): lambda b: [
        (lifted, c * between) for lifted, c, between in zip(b.across(b.N), b.contrast, b.across(b.E), strict=True)
    ],
    ("x-continuity", "printed"): lambda b: [
        (M, Interval.of(plane_strain(spec.young, spec.poisson).continuity(2)))
        for M, spec in zip(b.of_bodies("M"), (getattr(b.problem, name) for name in b.names), strict=True)
    ],
    ("x-lift-bound", "printed"): lambda b: [(b.top(N, E), c) for N, E, c in zip(b.N, b.E, b.contrast, strict=True)],
}

#: Of a pair of forces, at theta = 1/2 where there is one.
OF_PAIRS: Mapping[Key, Callable[[Slides, Constants], tuple[Interval, Interval]]] = {
    ("5.11", "printed"): lambda d, r: (d.size_1, r.X * d.size_2),
    ("5.13", "printed"): lambda d, r: (
        d.friction,
        r.bodies.problem.contact.friction
        * r.bodies.number("C_s")
        * r.bodies.number("C_tr_half")
        * (d.size_1 * d.size_2 + d.size_2.square()),
    ),
    ("5.13", "repaired"): lambda d, r: (d.friction, r.stress("C_K") * (d.size_1 * d.size_2 + d.size_2.square())),
    ("5.14", "printed"): lambda d, r: (
        r.stress("m") * d.size_1.square(),
        (r.A + r.stress("C_K")) * d.size_1 * d.size_2 + r.stress("C_K") * d.size_2.square(),
    ),
    ("prop-5.4", "printed"): lambda d, r: (d.dual_T, r.C_T * d.dual),
    ("5.18", "printed"): lambda d, r: (d.dual_T, r.A * d.size_1),
    ("5.19", "printed"): lambda d, r: (d.size_2, d.dual / r.stress("m")),
    ("5.22", "printed"): lambda d, r: (d.norm, d.dual / r.stress("m").sqrt()),
    ("5.23", "printed"): lambda d, r: (d.dual, r.stress("M") / r.stress("m").sqrt() * d.norm),
    ("x-root-M", "printed"): lambda d, r: (d.dual, r.stress("M").sqrt() * d.norm),
    ("5.29", "printed"): lambda d, r: (r.give * d.norm_T.square(), d.energy_1),
    ("5.30", "printed"): lambda d, r: (d.friction, r.P * d.norm.square()),
    ("5.30", "repaired"): lambda d, r: (d.friction, r.P * d.norm.square()),
    ("5.31", "repaired"): lambda d, r: (d.work + r.give * d.norm_T.square(), r.P * d.norm.square()),
    **{
        (id, "repaired"): lambda d, r: (
            d.step(HALF),
            r.weight(HALF) * d.norm_T.square() + r.h_2(HALF) * d.norm.square(),
        )
        for id in ("5.32", "5.33", "5.36")
    },
    ("x-reaction", "printed"): lambda d, r: (d.norm_T.square(), r.bodies.number("rho_max") * d.energy_1),
    ("x-friction-energy", "printed"): lambda d, r: (
        d.friction,
        r.bodies.number("kappa_1") * d.energy_1.sqrt() * d.norm + r.bodies.number("kappa_2") * d.norm.square(),
    ),
}


def enclosed(
    ids: Collection[str] | None = None, level: Level = "quick", watch: Callable[[float], None] = lambda done: None
) -> dict[str, list[Evidence]]:
    """Decide inequalities on named bodies by enclosures of both sides.

    Parameters
    ----------
    ids : collection of str, optional
        Statements; all by default, unknown ones have no evidence here.
    level : {'quick', 'full'}
        The same at both.
    watch : callable
        Called with the share done.

    Returns
    -------
    dict
        Statement -> evidence.
    """
    wanted = [key for key in (*OF_BODIES, *OF_PAIRS) if ids is None or key[0] in ids]
    found: dict[str, list[Evidence]] = {}
    with one_thread():
        known: dict[str, Bodies] = {}
        for done, key in enumerate(wanted):
            watch(done / len(wanted))
            name = LAYER if key in (("4.7", "printed"), ("5.30", "printed")) else PLATE
            bodies = known[name] = known.get(name) or Bodies(name)
            if (evidence := decide(bodies, *key)) is not None:
                found.setdefault(key[0], []).append(evidence)
    watch(1.0)
    return found


def decide(bodies: Bodies, id: str, of: Literal["printed", "step", "repaired"]) -> Evidence | None:
    """The evidence of an inequality on some bodies; None where the enclosures overlap.

    Parameters
    ----------
    bodies : Bodies
    id : str
        Of the statement.
    of : {'printed', 'step', 'repaired'}
    """
    key: Key = (id, of)
    unit = SMALL if key == ("5.30", "printed") else OWN
    where = bodies.name
    try:
        if key in OF_BODIES:
            sides = OF_BODIES[key](bodies)
        else:
            reading = Constants(bodies=bodies, printed=of == "printed", unit=unit)
            sides = [OF_PAIRS[key](bodies.slides, reading)]
            where += ", all nodes open and slipping one way"
    except ArithmeticError:  # a bound that was not proved
        return None
    fails = any(left.lo > right.hi for left, right in sides)
    if not fails and not all(left.hi <= right.lo for left, right in sides):
        return None
    ratios = [left / right for left, right in sides]
    low, high = max(ratio.lo for ratio in ratios), max(ratio.hi for ratio in ratios)
    at_least = lambda digits: float(Context(digits, ROUND_FLOOR).create_decimal(low))
    at_most = lambda digits: float(Context(digits, ROUND_CEILING).create_decimal(high))
    said = f"left/right >= {at_least(4):.4g}" if fails else f"left/right <= {at_most(4):.4g}"
    squares = ", of their squares" if key in OF_BODIES else ""
    in_unit = "" if unit == OWN else f", unit {float(unit):g}"
    data: dict[str, Any] = {
        "where": where,
        "problem": {name: dict(table) for name, table in NAMED[bodies.name].items()},
        "ratio": [at_least(6), at_most(6)],
        **({} if unit == OWN else {"unit": float(unit)}),
    }
    text = f"{said}{squares} ({where}{in_unit}): both sides between proved bounds, for the exact data"
    return Evidence(method="verified", of=of, holds=not fails, text=text, data=data)
