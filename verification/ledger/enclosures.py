"""Inequalities of Sections 4 and 5 on named bodies, both sides between proved bounds for the exact data.

Where the bounds of the sides do not overlap, the inequality is decided on these bodies: one that fails there is
refuted by proof, and of one that holds this is one case.  Where they overlap nothing is said.  Equalities, which cannot
be decided so, are left to :mod:`verification.ledger.rational_pairs`.  In all units taken m is below 1, so that m~ is m.

A pair of forces differs on a piece of T by d_2 = u, a vector of doubles, and ``g = S_n u``.  Where all nodes are open
and slip one way ``p_T = w k sign S g_N``, ``p_N = 0``, and ``d_1 = -S_c^-1 p``; where all stick ``d_1 = u`` and
``p = -S_c u``.  An inverse is enclosed in two ways, for a vector y that a solver gives and its residual
``r = x - Y y``::

    x' Y^-1 x = 2 x' y - y' Y y + r' Y^-1 r,      |Y^-1 x - y|_Y^2 = r' Y^-1 r <= |r|^2 / least eigenvalue of Y.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from decimal import Decimal
from fractions import Fraction
from functools import cache, cached_property, partial
from typing import Any

import numpy as np

from fem1d2d.mesh import Floats
from fem1d2d.pencil import largest
from fem1d2d.proofs.enclosed import Enclosed, upwards
from fem1d2d.proofs.proved import Ends
from ndtheory import Number
from ndtheory import bounds as formulas
from ndtheory.continuum.intervals import Interval
from ndtheory.number import SLACK, decimal, directed, working_precision
from verification.certificate.proved_constants import Between, Proof, entries
from verification.interface.body import Condensed, material_of
from verification.ledger.cases import ENCLOSED, three_digits
from verification.ledger.differences import directions, uniform_piece
from verification.ledger.evidence import Aspect, Evidence, source
from verification.ledger.inequalities import ENTRIES, SEED, RightSides, terms_of
from verification.ledger.worst import Trial
from verification.machine.progress import silent
from verification.problem.specification import Problem

#: So many times the friction of its problems, what Section 5 prints from (5.31) on fails in a small unit of stress.
MUCH = Fraction(10**8)


class EnclosedBodies:
    """The bodies of a problem of ENCLOSED whose grids are one, with what is proved of them.

    "1" is the contact body and "2" the Neumann body.
    """

    def __init__(self, name: str) -> None:
        self.name, self.problem = name, Problem.from_dict(ENCLOSED[name])
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

    @property
    def largest(self) -> list[Interval]:
        """M^a."""
        return self.of_bodies("M")

    @property
    def continuity(self) -> list[Interval]:
        """The bounds of M^a that follow from the materials."""
        specs = (getattr(self.problem, name) for name in self.names)
        return [Interval.of(material_of(spec, Fraction).continuity(2)) for spec in specs]

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

    ``energy_1`` is ``a^1(w^1 - w~^1, w^1 - w~^1)``, ``work`` is ``<T psi - T psi~, w^2 - w~^2>``, ``friction`` the
    friction term, and ``size_1``, ``size_2`` are ``|w^a - w~^a|_a`` in H1.  ``norm`` and ``norm_T`` are the norm (5.21)
    of ``psi - psi~`` and of ``T psi - T psi~``, ``dual`` and ``dual_T`` their norms in the dual of V^2.
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

    @property
    def inner(self) -> Interval:
        """The inner product of ``T psi - T psi~`` and ``psi - psi~`` is the work, by (5.25) and (5.26)."""
        return self.work

    @property
    def step(self) -> Interval:
        """``|||psi - T psi - (psi~ - T psi~)|||``."""
        return (self.norm.square() - 2 * self.work + self.norm_T.square()).sqrt()

    def relaxed(self, theta: Fraction) -> Interval:
        """``|||T_theta psi - T_theta psi~|||`` (5.7)."""
        rest = 1 - theta
        square = theta**2 * self.norm_T.square() + rest**2 * self.norm.square() + 2 * theta * rest * self.work
        return square.sqrt()


class Sticks(Apart):
    """All nodes touch and stick, in the direction in which body 1 is stiffest relative to body 2."""

    def __init__(self, bodies: EnclosedBodies) -> None:
        pair = bodies.case.pair
        u = largest(pair.contact.schur, pair.neumann.schur).vector
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
        friction = Enclosed.rounded(np.array([[more * bodies.problem.contact.friction]], dtype=object))
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

#: The bodies on which what rests on (5.13) alone fails as printed, with C_tr into H^1/2.
ROLLERS = "layers of a ten-thousandth between rollers"

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
Key = tuple[str, Aspect]


@dataclass(frozen=True, kw_only=True, eq=False)
class EnclosedConstants(RightSides):
    """The constants as Section 5 reads them, and its right sides, all enclosed.

    The bracket of (5.30) adds a stress to 1 if ``printed``; ``unit`` is the unit of stress in units of the file,
    ``share`` the factor of the bodies' friction; C_K has C_tr into H^1/2 if ``half``.
    """

    bodies: EnclosedBodies
    printed: bool = False
    unit: Fraction = OWN
    share: Fraction = Fraction(1)
    half: bool = False

    @property
    def m(self) -> Interval:
        return self.bodies.number("m") * self.unit

    @property
    def M(self) -> Interval:
        return self.bodies.number("M") * self.unit

    @property
    def C_K(self) -> Interval:
        return self.C_K_half if self.half else self.bodies.number("C_K") * self.unit * self.share

    @property
    def C_R(self) -> Interval:
        return self.bodies.number("C_R")

    @property
    def C_K_half(self) -> Interval:
        """``k C_s C_tr`` with C_tr into H^1/2 (5.8), in the unit of the file."""
        of = self.bodies
        return of.problem.contact.friction * of.number("C_s") * of.number("C_tr_half")

    @property
    def energy(self) -> tuple[Interval, ...]:
        """rho, kappa_1, kappa_2 of the theorem in energy norms."""
        return tuple(map(self.bodies.number, ("rho_max", "kappa_1", "kappa_2")))

    @property
    def X(self) -> Any:
        """The factor of (5.11)."""
        return (self.A + self.C_K + (self.C_K * self.m).sqrt()) / self.m

    def grows(self, formula: Callable[..., Any]) -> Interval:
        x, m, M, C_R = self.C_K, self.m, self.M, self.C_R
        edition = formulas.PRINTED if self.printed else formulas.REPAIRED
        with working_precision():
            low = formula(x.lo, m.hi, M.lo, C_R.lo, edition.unit(m.hi)) * (1 - SLACK)
            high = formula(x.hi, m.lo, M.hi, C_R.hi, edition.unit(m.lo)) * (1 + SLACK)
        return Interval.between(low, high)

    @property
    def C_T(self) -> Interval:
        """(5.16)."""
        return self.grows(lambda x, m, M, C_R, u: formulas.lipschitz(m, M, C_R, x))

    @property
    def Q(self) -> Interval:
        """The Lipschitz constant of T squared, as h_1 has it."""
        return (self.C_T * self.M / self.m).square()

    @property
    def C_0(self) -> Any:
        """(5.37)."""
        return 2 * self.give / (1 + 2 * self.give)

    def contracting(self) -> EnclosedConstants:
        """The same at a friction below C_2, as repaired."""
        slight = three_digits(float(JUST_BELOW) * self.bodies.case.reading.threshold / float(self.C_K.hi))
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
        """``1 - K(theta)^2``."""
        h_1, h_2 = formulas.one_minus_h1(theta, self.D, self.Q), formulas.one_minus_h2(theta, self.P)
        return Interval(min(h_1.lo, h_2.lo), min(h_1.hi, h_2.hi))

    def of_energy(self, formula: Callable[..., Any]) -> Interval:
        with working_precision():
            low, high = formula(*(c.lo for c in self.energy)), formula(*(c.hi for c in self.energy))
            return Interval.between(low * (1 - SLACK), high * (1 + SLACK))

    def q_squared(self, theta: Fraction) -> Interval:
        found: Interval = super().q_squared(decimal(theta))
        return found


#: The statements that are decided only of the bodies.
OF_BODIES: tuple[Key, ...] = tuple(key for key, each in ENTRIES.items() if each.about == "bodies")

#: The statements that follow from (5.30), for theta at or close to C_0, where they say most.
STEPS = ("5.31", "5.32", "5.33", "5.36", "5.39", "5.44")

#: The statements that follow from (5.13) without (5.30).
BY_TRACES = ("5.11", "5.14", "5.15", "prop-5.4", "5.38")

#: For a pair of forces where all nodes are open and slip one way.
OF_PAIRS: tuple[Key, ...] = (
    *((id, "printed") for id in ("5.13", *BY_TRACES, "5.18", "5.19", "5.22", "5.23")),
    *((id, "printed") for id in ("x-root-M", "5.29", "5.30", "x-reaction", "x-friction-energy")),
    *((id, "repaired") for id in ("5.11", "5.13", "5.14", "5.15", "prop-5.4", "5.30", *STEPS)),
)

#: For such a pair at much friction, in a small unit of stress.
OF_MUCH: tuple[Key, ...] = tuple((id, "printed") for id in STEPS)

#: A friction just below C_2, and theta at this share of the way through the interval of Proposition 5.6.
CONTRACTION: Mapping[Key, Fraction] = {
    ("prop-5.6.1", "printed"): Fraction(9, 10),
    ("prop-5.6.1", "repaired"): Fraction(9, 10),
    ("5.47", "printed"): HALF,
    ("5.47", "repaired"): HALF,
    ("x-merged-interval", "repaired"): Fraction(1, 10),
}

#: For a pair of forces where all nodes stick.
OF_STICKING: tuple[Key, ...] = (("5.38", "repaired"), ("x-ratio", "printed"), ("x-energy", "printed"), *CONTRACTION)

#: All of them, in the order in which they are decided.
DECIDED: tuple[Key, ...] = (*OF_BODIES, *OF_PAIRS, *OF_MUCH, *OF_STICKING)

#: On the layer: what fails as printed, and where the interval of Proposition 5.6 is the widest.
ON_LAYER = {("4.7", "printed"), ("5.30", "printed"), *OF_MUCH, *CONTRACTION}


def place(key: Key) -> str:
    """The name of the bodies on which it is decided."""
    if key[1] == "printed" and key[0] in BY_TRACES:
        return ROLLERS
    return LAYER if key in ON_LAYER else PLATE


def both_sides(d: Any, r: Any, key: Key) -> Sides:
    """Both sides of an inequality for two bodies, or for a pair of forces, each term on the side where it is positive.

    theta is 1/2 unless the inequality is sharper at another one.  Contraction is decided as in Proposition 5.6: the
    gain ``1 - K(theta)^2`` is at most the gain of a step, both over theta.
    """
    (id, of), inequality, theta = key, ENTRIES[key], HALF
    if key in OF_BODIES:
        sides = (map(Interval.of, side(d, r, 0)) for side in (inequality.left, inequality.right))
        return list(zip(*sides, strict=True))
    if key in CONTRACTION:
        inequality, r = ENTRIES["prop-5.6.1", of], r.contracting()
        theta = r.inside(CONTRACTION[key])
    elif id == "5.39":
        theta = Fraction(r.C_0.hi)  # the smallest one that is proved not to lie below C_0
    elif id == "5.44" or key in OF_MUCH:
        theta = three_digits(float(JUST_BELOW) * float(r.C_0.lo))  # proved to lie below C_0
    terms = [*terms_of(inequality.left(d, r, theta)), *(-term for term in terms_of(inequality.right(d, r, theta)))]
    left = sum((term for term in terms if term.hi > 0), Interval.of(0))
    right = sum((-term for term in terms if term.hi <= 0), Interval.of(0))
    # the squares of both sides, without the root of energy_1
    return [(left.square(), right.square())] if id == "x-ratio" else [(left, right)]


def on_bodies(bodies: EnclosedBodies, id: str, of: Aspect) -> Evidence | None:
    """The evidence of an inequality on some bodies; None where the enclosures overlap."""
    key: Key = (id, of)
    unit = SMALL if key == ("5.30", "printed") else TINY if key in OF_MUCH else OWN
    share = MUCH if key in OF_MUCH else Fraction(1)
    where = bodies.name
    try:
        half = place(key) == ROLLERS
        reading = EnclosedConstants(bodies=bodies, printed=of == "printed", unit=unit, share=share, half=half)
        subject: Any = bodies
        if key in OF_STICKING:
            subject, where = bodies.sticks, f"{where}, all nodes sticking"
            if key in CONTRACTION:
                where += f", k just below C_2, theta at {float(CONTRACTION[key]):g} of the interval"
        elif key not in OF_BODIES:
            subject = bodies.slides_much if key in OF_MUCH else bodies.slides
            where += ", all nodes open and sliding one way"
            if key in OF_MUCH:
                where += f", k = {float(share * bodies.problem.contact.friction):g}"
        sides = both_sides(subject, reading, key)
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
    squares = ", of their squares" if ENTRIES[key].squares or id == "x-ratio" else ""
    in_unit = "" if unit == OWN else f", unit {float(unit):g}"
    data: dict[str, Any] = {
        "where": where,
        "problem": {name: dict(table) for name, table in ENCLOSED[bodies.name].items()},
        "ratio": [at_least(6), at_most(6)],
        **({} if unit == OWN else {"unit": float(unit)}),
        **({} if share == 1 else {"friction": float(share)}),
    }
    text = f"{said}{squares} ({where}{in_unit}): both sides between proved bounds, for the exact data"
    return Evidence(method="verified", of=of, holds=not fails, text=text, data=data)


def _decided(id: str, known: Callable[[str], EnclosedBodies]) -> list[Evidence]:
    """The evidence of all forms of a statement."""
    found = [on_bodies(known(place(key)), *key) for key in DECIDED if key[0] == id]
    return [evidence for evidence in found if evidence is not None]


#: Inequalities on named bodies, decided by enclosures of both sides, the same at both levels.
enclosed = source({id: partial(_decided, id) for id, _ in DECIDED}, lambda level, watch: cache(EnclosedBodies))
