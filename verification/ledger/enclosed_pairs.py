"""Named bodies, and a pair of forces on them, with all that Sections 4 and 5 compare between proved bounds.

A pair of forces is a difference of two on a piece of T, with d_2 = u, a vector of doubles, and ``g = S_n u``.  Where
all nodes are open and slip one way ``p_T = w k sign S g_N``, ``p_N = 0``, and ``d_1 = -S_c^-1 p``; where all stick
``d_1 = u`` and ``p = -S_c u``.  An inverse is met in two ways, for a vector y that a solver gives and its residual
``r = x - Y y``:

    x' Y^-1 x = 2 x' y - y' Y y + r' Y^-1 r,      |Y^-1 x - y|_Y^2 = r' Y^-1 r <= |r|^2 / least eigenvalue of Y.
"""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from functools import cached_property

import numpy as np
from scipy.linalg import eigh

from fem1d2d.enclosed import Enclosed, upwards
from fem1d2d.mesh import Floats
from fem1d2d.proved import Ends
from ndtheory import Number
from ndtheory.intervals import Interval
from verification.constants.proved import Between, Proof, entries
from verification.interface.body import Condensed
from verification.ledger.cases import NAMED
from verification.ledger.draws import directions, uniform_piece
from verification.ledger.inequalities import SEED
from verification.ledger.worst import Trial
from verification.problem.specification import Problem
from verification.progress import silent

#: So many times the friction of its problems, what Section 5 prints from (5.31) on fails in a small unit of stress.
MUCH = Fraction(10**8)


class EnclosedBodies:
    """Two bodies with what is proved of them; "1" is the contact body and "2" the Neumann body.

    Parameters
    ----------
    name : str
        Of a problem in :data:`verification.ledger.cases.NAMED`, whose grids are one.
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
    """The difference of two solutions on a piece of T.

    Parameters
    ----------
    bodies : EnclosedBodies
    u : array
        d_2.

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
    """Where all nodes touch and stick, in the direction in which the contact body is the stiffest beside the other.

    Parameters
    ----------
    bodies : EnclosedBodies
    """

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
    """Where all nodes are open and slip one way, in the direction in which the friction term is the largest.

    Parameters
    ----------
    bodies : EnclosedBodies
    more : Fraction
        How many times their friction.
    """

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
