"""Inequalities of Sections 4 and 5 on named bodies, both sides between proved bounds for the exact data.

Where the bounds of the sides do not overlap, the inequality is decided on these bodies: one that fails there is
refuted by proof, and of one that holds this is one case.  Where they overlap nothing is said.  Equalities, which cannot
be decided so, are left to :mod:`verification.ledger.rational_pairs`.  In all units taken m is below 1, so that m~ is m.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import Any, Literal

from fem1d2d import plane_strain
from ndtheory import bounds as formulas
from ndtheory import energy_norms
from ndtheory.intervals import Interval
from ndtheory.number import SLACK, decimal, directed, working_precision
from verification.ledger.cases import NAMED, three_digits
from verification.ledger.enclosed_pairs import MUCH, Apart, EnclosedBodies
from verification.ledger.evidence import Evidence, Level
from verification.threads import one_thread

#: The bodies on which most is decided, and those on which (5.30) as printed fails, in a unit of stress.
PLATE, LAYER = "plate of thickness 0.01 clamped at one end", "layer of a ten-thousandth on a block"

#: Of stress, in units of the file: the one in which (5.30) as printed fails, and that of the file.
SMALL, OWN = Fraction(1, 10**6), Fraction(1)

#: The unit of stress in which what is printed from (5.31) on fails on the layer with much friction, as it does on any
#: pair of bodies (:mod:`verification.ledger.large_friction`).
TINY = Fraction(1, 10**14)

HALF = Fraction(1, 2)

#: The share of C_0 and of C_2 that is just below it.
JUST_BELOW = Fraction(99, 100)

#: An inequality with both sides; several that are to hold together.
Sides = list[tuple[Interval, Interval]]

#: A statement, and what of it is decided.
Key = tuple[str, Literal["printed", "step", "repaired"]]


@dataclass(frozen=True, kw_only=True, eq=False)
class EnclosedConstants:
    """The constants as Section 5 reads them, and its right sides, all enclosed.

    Attributes
    ----------
    bodies : EnclosedBodies
    printed : bool
        Whether the bracket of (5.30) adds a stress to 1.
    unit : Fraction
        Of stress, in units of the file.
    share : Fraction
        Of the friction of the bodies, at which the constants are read.
    """

    bodies: EnclosedBodies
    printed: bool = False
    unit: Fraction = OWN
    share: Fraction = Fraction(1)

    def stress(self, name: str) -> Interval:
        """A constant that is a stress, in that unit."""
        return self.bodies.number(name) * self.unit * (self.share if name == "C_K" else 1)

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

    def h_1(self, theta: Fraction) -> Interval:
        """After (5.39)."""
        gain: Interval = formulas.one_minus_h1(theta, self.D, self.Q)
        return 1 - gain

    def h_2(self, theta: Fraction) -> Interval:
        """(5.45)."""
        gain: Interval = formulas.one_minus_h2(theta, self.P)
        return 1 - gain

    @property
    def D(self) -> Interval:
        """``C_T^2/C_R^2 - P``."""
        return self.grows(formulas.D)

    @property
    def Q(self) -> Interval:
        """The Lipschitz constant of T squared, as h_1 has it."""
        return (self.C_T * self.stress("M") / self.stress("m")).square()

    @property
    def C_0(self) -> Interval:
        """(5.37)."""
        return 2 * self.give / (1 + 2 * self.give)

    @property
    def below_C_0(self) -> Fraction:
        """A theta that is proved to lie below C_0."""
        return three_digits(float(JUST_BELOW) * float(self.C_0.lo))

    @property
    def at_C_0(self) -> Fraction:
        """The smallest theta that is proved not to lie below C_0."""
        return Fraction(self.C_0.hi)

    def contracting(self) -> EnclosedConstants:
        """The same at a friction below C_2, as repaired."""
        slight = three_digits(float(JUST_BELOW) * self.bodies.case.reading.threshold / float(self.stress("C_K").hi))
        found = replace(self, share=slight)
        if not found.P.hi < (1 + found.give).lo:
            raise ArithmeticError("the friction is not proved to lie below C_2")
        return found

    def inside(self, share: Fraction) -> Fraction:
        """A theta between the ends of Proposition 5.6, the upper one C_1; share is about that of the way."""
        low = Interval.of(0) if self.P.hi <= 1 else formulas.C6(self.P)
        high = formulas.C1(self.D, self.Q)
        theta = three_digits(float(low.hi) + float(share) * (float(high.lo) - float(low.hi)))
        if not low.hi < theta < high.lo:
            raise ArithmeticError(f"theta = {theta} is not proved to lie inside the interval")
        return theta

    def gain(self, theta: Fraction) -> Interval:
        """``(1 - K(theta)^2)/theta``."""
        h_1, h_2 = (2 * (1 + self.D) - theta * (1 + 2 * self.D + self.Q), (2 - theta) - 2 * (1 - theta) * self.P)
        return Interval(min(h_1.lo, h_2.lo), min(h_1.hi, h_2.hi))

    def _energy(self, formula: Callable[..., Any]) -> Interval:
        """A formula of rho, kappa_1 and kappa_2 that grows with each (:mod:`ndtheory.energy_norms`)."""
        constants = [self.bodies.number(name) for name in ("rho_max", "kappa_1", "kappa_2")]
        with working_precision():
            low, high = formula(*(c.lo for c in constants)), formula(*(c.hi for c in constants))
            return Interval.between(low * (1 - SLACK), high * (1 + SLACK))

    @property
    def ratio(self) -> Interval:
        """r, the largest ``|w^1 - w~^1|/|w^2 - w~^2|`` in energy norms."""
        return self._energy(energy_norms.largest_ratio)

    def q_squared(self, theta: Fraction) -> Interval:
        """``q(theta)^2`` of the theorem in energy norms."""
        return self._energy(lambda *constants: 1 - energy_norms.one_minus_square(decimal(theta), *constants))


ONE = Interval.of(1)


#: Of the bodies alone; both sides are squares.
OF_BODIES: Mapping[Key, Callable[[EnclosedBodies], Sides]] = {
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

Pairs = Mapping[Key, Callable[[Apart, EnclosedConstants], tuple[Interval, Interval]]]


def contracts(d: Apart, r: EnclosedConstants, share: Fraction) -> tuple[Interval, Interval]:
    """``1 - K(theta)^2`` is at most what a step takes away, both over theta; share as for ``inside``."""
    slight = r.contracting()
    theta = slight.inside(share)
    return slight.gain(theta) * d.norm.square(), d.gain(theta)


def of_step(d: Apart, r: EnclosedConstants, theta: Fraction) -> tuple[Interval, Interval]:
    """(5.32), with the term of ``|||T psi - T psi~|||^2`` on the side on which it is positive."""
    term, weight = d.norm_T.square(), r.weight(theta)
    left, right = d.step(theta), r.h_2(theta) * d.norm.square()
    return (left, right + weight * term) if weight.lo >= 0 else (left - weight * term, right)


#: What follows from (5.30), close to C_0 where it says most.
STEPS: Mapping[str, Callable[[Apart, EnclosedConstants], tuple[Interval, Interval]]] = {
    "5.31": lambda d, r: (d.work + r.give * d.norm_T.square(), r.P * d.norm.square()),
    **{id: lambda d, r: of_step(d, r, r.below_C_0) for id in ("5.32", "5.33", "5.36")},
    "5.39": lambda d, r: (d.step(r.at_C_0), r.h_1(r.at_C_0) * d.norm.square()),
    "5.44": lambda d, r: (d.step(r.below_C_0), r.h_2(r.below_C_0) * d.norm.square()),
}

#: Of a pair of forces at much friction, in a small unit of stress.
OF_MUCH: Pairs = {(id, "printed"): sides for id, sides in STEPS.items()}

#: A friction just below C_2, and theta at this share of the way through the interval of Proposition 5.6.
CONTRACTION: Mapping[Key, Fraction] = {
    ("prop-5.6.1", "printed"): Fraction(9, 10),
    ("prop-5.6.1", "repaired"): Fraction(9, 10),
    ("5.47", "printed"): HALF,
    ("5.47", "repaired"): HALF,
    ("x-merged-interval", "repaired"): Fraction(1, 10),
}

#: Of a pair of forces where all nodes stick.
OF_STICKING: Pairs = {
    ("5.38", "printed"): lambda d, r: (r.weight(HALF) * d.norm_T.square(), r.weight(HALF) * r.Q * d.norm.square()),
    ("x-ratio", "printed"): lambda d, r: (d.energy_1, (r.ratio * d.norm).square()),
    ("x-energy", "printed"): lambda d, r: (d.step(HALF), r.q_squared(HALF) * d.norm.square()),
    **{key: partial(contracts, share=share) for key, share in CONTRACTION.items()},
}

#: Of a pair of forces where all nodes are open and slip one way, at theta = 1/2 where none is said.
OF_PAIRS: Pairs = {
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
    ("5.15", "printed"): lambda d, r: (
        r.stress("m") * (d.size_1 - (r.A + r.stress("C_K")) / (2 * r.stress("m")) * d.size_2).square(),
        ((r.A + r.stress("C_K")).square() / (4 * r.stress("m")) + r.stress("C_K")) * d.size_2.square(),
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
    **{(id, "repaired"): STEPS[id] for id in ("5.39", "5.44")},
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

#: On the layer: what fails as printed, and where the interval of Proposition 5.6 is the widest.
ON_LAYER = {("4.7", "printed"), ("5.30", "printed"), *OF_MUCH, *CONTRACTION}


def enclosed(
    ids: Collection[str] | None = None, level: Level = "quick", watch: Callable[[float], None] = lambda done: None
) -> dict[str, list[Evidence]]:
    """Decide inequalities on named bodies by enclosures of both sides: a ``Source``, the same at both levels."""
    wanted = [key for key in (*OF_BODIES, *OF_PAIRS, *OF_MUCH, *OF_STICKING) if ids is None or key[0] in ids]
    found: dict[str, list[Evidence]] = {}
    with one_thread():
        known: dict[str, EnclosedBodies] = {}
        for done, key in enumerate(wanted):
            watch(done / len(wanted))
            name = LAYER if key in ON_LAYER else PLATE
            bodies = known[name] = known.get(name) or EnclosedBodies(name)
            if (evidence := decide(bodies, *key)) is not None:
                found.setdefault(key[0], []).append(evidence)
    watch(1.0)
    return found


def decide(bodies: EnclosedBodies, id: str, of: Literal["printed", "step", "repaired"]) -> Evidence | None:
    """The evidence of an inequality on some bodies; None where the enclosures overlap.

    Parameters
    ----------
    bodies : EnclosedBodies
    id : str
        Of the statement.
    of : {'printed', 'step', 'repaired'}
    """
    key: Key = (id, of)
    unit = SMALL if key == ("5.30", "printed") else TINY if key in OF_MUCH else OWN
    share = MUCH if key in OF_MUCH else Fraction(1)
    where = bodies.name
    try:
        reading = EnclosedConstants(bodies=bodies, printed=of == "printed", unit=unit, share=share)
        if key in OF_BODIES:
            sides = OF_BODIES[key](bodies)
        elif key in OF_STICKING:
            sides = [OF_STICKING[key](bodies.sticks, reading)]
            where += ", all nodes sticking"
            if key in CONTRACTION:
                where += f", k just below C_2, theta at {float(CONTRACTION[key]):g} of the interval"
        elif key in OF_MUCH:
            sides = [OF_MUCH[key](bodies.slides_much, reading)]
            where += f", all nodes open and slipping one way, k = {float(share * bodies.problem.contact.friction):g}"
        else:
            sides = [OF_PAIRS[key](bodies.slides, reading)]
            where += ", all nodes open and slipping one way"
    except ArithmeticError:  # a bound that was not proved
        return None
    fails = any(left.lo > right.hi for left, right in sides)
    if not fails and not all(left.hi <= right.lo for left, right in sides):
        return None
    ratios = [left / right for left, right in sides]
    low, high = max(ratio.lo for ratio in ratios), max(ratio.hi for ratio in ratios)
    at_least = lambda digits: float(directed(low, digits, up=False))
    at_most = lambda digits: float(directed(high, digits, up=True))
    said = f"left/right >= {at_least(4):.4g}" if fails else f"left/right <= {at_most(4):.4g}"
    squares = ", of their squares" if key in OF_BODIES else ""
    in_unit = "" if unit == OWN else f", unit {float(unit):g}"
    data: dict[str, Any] = {
        "where": where,
        "problem": {name: dict(table) for name, table in NAMED[bodies.name].items()},
        "ratio": [at_least(6), at_most(6)],
        **({} if unit == OWN else {"unit": float(unit)}),
        **({} if share == 1 else {"friction": float(share)}),
    }
    text = f"{said}{squares} ({where}{in_unit}): both sides between proved bounds, for the exact data"
    return Evidence(method="verified", of=of, holds=not fails, text=text, data=data)
