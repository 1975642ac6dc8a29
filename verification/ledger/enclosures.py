"""Inequalities of Sections 4 and 5 on named bodies, both sides between proved bounds for the exact data.

Where the bounds of the sides do not overlap, the inequality is decided on these bodies: one that fails there is
refuted by proof, and of one that holds this is one case.  Where they overlap nothing is said.  Equalities, which cannot
be decided so, are left to :mod:`verification.ledger.rational_pairs`.  In all units taken m is below 1, so that m~ is m.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from decimal import Decimal
from fractions import Fraction
from functools import cached_property, partial
from typing import Any, Literal

import numpy as np
from scipy.linalg import eigh

from fem1d2d import plane_strain
from fem1d2d.enclosed import Enclosed, upwards
from fem1d2d.mesh import Floats
from fem1d2d.proved import Ends
from ndtheory import Number, energy_norms
from ndtheory import bounds as formulas
from ndtheory.intervals import Interval
from ndtheory.number import SLACK, decimal, directed, working_precision
from verification.constants.proved import Between, Proof, entries
from verification.interface.body import Condensed
from verification.ledger.cases import NAMED, three_digits
from verification.ledger.differences import directions, uniform_piece
from verification.ledger.evidence import Evidence, Level
from verification.ledger.inequalities import SEED
from verification.ledger.worst import Trial
from verification.problem.specification import Problem
from verification.progress import silent
from verification.threads import one_thread

#: So many times the friction of its problems, what Section 5 prints from (5.31) on fails in a small unit of stress.
MUCH = Fraction(10**8)


class EnclosedBodies:
    """The bodies of a problem of NAMED whose grids are one, with what is proved of them.

    "1" is the contact body and "2" the Neumann body.
    """

    def __init__(self, name: str) -> None:
        self.name, self.problem = name, Problem.from_dict(NAMED[name])
        self.case = Trial.of(name, self.problem)
        self.proof = Proof(self.case.measured, self.case.pair, silent)
        self.measured = self.proof.result()
        self.names = self.proof.contact, self.proof.neumann

    def number(self, name: str) -> Interval:
        """A constant of both bodies."""
        return _interval(getattr(self.measured, name))

    def of_bodies(self, name: str) -> list[Interval]:
        """m or M of the contact body and of the Neumann body."""
        return [_interval(getattr(getattr(self.measured, body), name)) for body in self.names]

    @cached_property
    def N(self) -> list[Between]:
        """H1 norms squared of the lifts."""
        found = [self.proof.lift(self.proof.bodies[name]) for name in self.names]
        return [self._known(form) for form in found]

    @property
    def E(self) -> list[Between]:
        """The norms squared of H^1/2(Gamma_c)."""
        return [self._known(self.proof.E[name]) for name in self.names]

    @property
    def S(self) -> list[Between]:
        """The energies squared of the lifts."""
        return [self._known(self.proof.S[name]) for name in self.names]

    @staticmethod
    def _known(form: Between | None) -> Between:
        if form is None:
            raise ArithmeticError("rounding errors exceed what is to be proved")
        return form

    def top(self, form: Between, against: Between) -> Interval:
        """The largest eigenvalue of a pencil."""
        return _ends(self.proof.largest(form, against))

    @cached_property
    def contrast(self) -> list[Interval]:
        """``M^a/m^a``."""
        return [M / m for M, m in zip(self.of_bodies("M"), self.of_bodies("m"), strict=True)]

    def across(self, forms: list[Between]) -> list[Interval]:
        """Each of two forms against the norm of the other body's traces."""
        return [self.top(forms[0], self.E[1]), self.top(forms[1], self.E[0])]

    @cached_property
    def slides(self) -> Slides:
        """A pair of forces on which the friction term is large."""
        return Slides(self)

    @cached_property
    def slides_much(self) -> Slides:
        """The same at much more friction."""
        return Slides(self, MUCH)

    @cached_property
    def sticks(self) -> Sticks:
        """A pair of forces to which T answers with a large difference."""
        return Sticks(self)


class Apart:
    """The difference of two solutions on a piece of T where d_2 is u.

    Attributes
    ----------
    energy_1, work, friction : Interval
        ``a^1(w^1 - w~^1, w^1 - w~^1)``, ``<T psi - T psi~, w^2 - w~^2>`` and the friction term.
    size_1, size_2 : Interval
        ``|w^a - w~^a|_a`` in H1.
    norm, norm_T, dual, dual_T : Interval
        The norm (5.21) of ``psi - psi~`` and of ``T psi - T psi~``, and their norms in the dual of V^2.
    """

    energy_1: Interval
    work: Interval
    friction: Interval
    size_1: Interval
    norm_T: Interval
    dual_T: Interval

    def __init__(self, bodies: EnclosedBodies, u: Floats) -> None:
        self.u, self._proof, pair = u, bodies.proof, bodies.case.pair
        sides = (pair.contact, pair.neumann)
        self._S_1, self._S_2 = (_turned(form, side) for form, side in zip(bodies.S, sides, strict=True))
        self._N_1, N_2 = (_turned(form, side) for form, side in zip(bodies.N, sides, strict=True))
        self._E_2 = _turned(bodies.E[1], pair.neumann)
        self._force = entries(self._S_2).times(Enclosed.exactly(u[:, None]))
        self.size_2, self.norm = _form(N_2, u).sqrt(), _form(self._S_2, u).sqrt()
        self.dual = self._inverse_form(self._E_2, self._force)[0].sqrt()

    def _inverse_form(self, form: Between, x: Enclosed) -> tuple[Interval, Floats, Decimal]:
        identity = Enclosed.exactly(np.eye(len(self.u)))
        return _inverse_form(form, x, self._proof.largest((identity, identity), form)[1])  # 1/least eigenvalue

    def _answer(self, reaction: Enclosed) -> None:
        """Take ``T psi - T psi~``, the inner product of whose forces with those of psi is the work."""
        self.work = _scalar(reaction.T.times(Enclosed.exactly(self.u[:, None])))
        self.norm_T = self._inverse_form(self._S_2, reaction)[0].sqrt()
        self.dual_T = self._inverse_form(self._E_2, reaction)[0].sqrt()

    def step(self, theta: Fraction) -> Interval:
        """``|||T_theta psi - T_theta psi~|||^2`` (5.7)."""
        rest = 1 - theta
        return theta**2 * self.norm_T.square() + rest**2 * self.norm.square() + 2 * theta * rest * self.work

    def gain(self, theta: Fraction) -> Interval:
        """``(|||psi - psi~|||^2 - |||T_theta psi - T_theta psi~|||^2)/theta``, in which small thetas lose nothing."""
        norm, norm_T = self.norm.square(), self.norm_T.square()
        return 2 * (norm - self.work) - theta * (norm - 2 * self.work + norm_T)


class Sticks(Apart):
    """All nodes touch and stick; the direction is that of the largest stiffness of body 1 relative to body 2."""

    def __init__(self, bodies: EnclosedBodies) -> None:
        pair = bodies.case.pair
        n = len(pair.neumann.stiffness)
        u = eigh(pair.contact.stiffness, pair.neumann.stiffness, subset_by_index=[n - 1] * 2)[1][:, 0]
        super().__init__(bodies, u)
        back = entries(self._S_1).times(Enclosed.exactly(u[:, None]))
        self.energy_1, self.size_1 = _form(self._S_1, u), _form(self._N_1, u).sqrt()
        self.friction = Interval.of(0)
        self._answer(Enclosed(middle=-back.middle, radius=back.radius))


class Slides(Apart):
    """All nodes are open and slip one way, at ``more`` times the friction, with the largest friction term."""

    def __init__(self, bodies: EnclosedBodies, more: Fraction = Fraction(1)) -> None:
        pair, case = bodies.case.pair, bodies.case
        piece = uniform_piece(pair, touching=False, sliding=1)
        random = np.random.default_rng(SEED)
        forms = case.setting.forms
        worst = max(
            (forms.root @ y for y in directions(case.setting, piece, random)),
            key=lambda g: (
                float((piece.bound @ g) @ -(piece.jump @ g)[: pair.contact.grid.t]) / float(g @ forms.inverse @ g)
            ),
        )
        super().__init__(bodies, forms.inverse @ worst)
        t, kernel = pair.contact.grid.t, bodies.proof.joint.kernel
        assert kernel is not None
        zeta = kernel.times(self._force.block(np.arange(t, len(self.u)), np.arange(1)))
        signed = Enclosed(middle=piece.sign[:, None] * zeta.middle, radius=zeta.radius)
        friction = _times(more * bodies.problem.contact.friction)
        bound = bodies.proof.joint.weights.times(signed).times(friction)
        nothing = np.zeros((len(self.u) - t, 1))
        reaction = Enclosed(middle=np.vstack([bound.middle, nothing]), radius=np.vstack([bound.radius, nothing]))
        self._answer(reaction)
        self.energy_1, y, off = self._inverse_form(self._S_1, reaction)
        self.friction = self.energy_1 + self.work
        error = (Interval.of(off) / bodies.of_bodies("m")[0]).sqrt()  # of the H1 norm
        size = _form(self._N_1, y).sqrt()
        self.size_1 = Interval.between(max((size - error).lo, Decimal(0)), (size + error).hi)


def _interval(number: Number) -> Interval:
    return _ends((number.lo, number.hi))


def _ends(ends: Ends) -> Interval:
    low, high = ends
    if low is None or high is None:
        raise ArithmeticError("rounding errors exceed what is to be proved")
    return Interval.between(low, high)


def _turned(form: Between, side: Condensed) -> Between:
    """A form in the directions of the pair of bodies."""
    low, high = (Enclosed(middle=side.orient_form(X.middle), radius=X.radius) for X in form)
    return low, high


def _times(factor: Fraction) -> Enclosed:
    return Enclosed.rounded(np.array([[factor]], dtype=object))


def _scalar(found: Enclosed) -> Interval:
    value, radius = (Fraction(float(part[0, 0])) for part in (found.middle, found.radius))
    return Interval.between(value - radius, value + radius)


def _form(form: Between, x: Floats) -> Interval:
    """``x' X x``."""
    return Interval.between(form[0].form(x)[0], form[1].form(x)[1])


def _inverse_form(form: Between, x: Enclosed, inverse: float | None) -> tuple[Interval, Floats, Decimal]:
    """``x' Y^-1 x``, a vector of doubles near ``Y^-1 x``, and how far it may be from it, squared in the norm of Y."""
    if inverse is None:
        raise ArithmeticError("a form that is not proved to be definite")
    Y = entries(form)
    y = np.linalg.solve(Y.middle, x.middle[:, 0])
    column = Enclosed.exactly(y[:, None])
    residual = x.plus(-1.0, Y.times(column))
    sizes = np.abs(residual.middle) + residual.radius
    off = Interval.of(Fraction(float(upwards((sizes**2).sum(), sizes.size + 4)))) * Fraction(inverse)
    value = 2 * _scalar(x.T.times(column)) - _form(form, y)
    return Interval(value.lo, (value + off).hi), y, off.hi


#: The bodies on which most is decided, and those on which (5.30) as printed fails, in a unit of stress.
PLATE, LAYER = "plate of thickness 0.01 clamped at one end", "layer of a ten-thousandth on a block"

#: Units of stress in units of the file: the one in which (5.30) as printed fails, and the file's.
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
    printed : bool
        True if the bracket of (5.30) adds a stress to 1.
    unit : Fraction
        The unit of stress in units of the file.
    share : Fraction
        The friction over that of the bodies.
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
        """The constant of both lifts."""
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
        """A theta at about this share of the way between the ends of Proposition 5.6, the upper one being C_1."""
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


#: Only of the bodies; both sides are squares.
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

#: For a pair of forces at much friction, in a small unit of stress.
OF_MUCH: Pairs = {(id, "printed"): sides for id, sides in STEPS.items()}

#: A friction just below C_2, and theta at this share of the way through the interval of Proposition 5.6.
CONTRACTION: Mapping[Key, Fraction] = {
    ("prop-5.6.1", "printed"): Fraction(9, 10),
    ("prop-5.6.1", "repaired"): Fraction(9, 10),
    ("5.47", "printed"): HALF,
    ("5.47", "repaired"): HALF,
    ("x-merged-interval", "repaired"): Fraction(1, 10),
}

#: For a pair of forces where all nodes stick.
OF_STICKING: Pairs = {
    ("5.38", "printed"): lambda d, r: (r.weight(HALF) * d.norm_T.square(), r.weight(HALF) * r.Q * d.norm.square()),
    ("x-ratio", "printed"): lambda d, r: (d.energy_1, (r.ratio * d.norm).square()),
    ("x-energy", "printed"): lambda d, r: (d.step(HALF), r.q_squared(HALF) * d.norm.square()),
    **{key: partial(contracts, share=share) for key, share in CONTRACTION.items()},
}

#: For a pair of forces where all nodes are open and slip one way, at theta = 1/2 where none is said.
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
    """The evidence of an inequality on some bodies; None where the enclosures overlap."""
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
