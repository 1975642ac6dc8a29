r"""The theorem in energy norms for two rectangles in the continuum: bounds of its constants without finite elements.

Two rectangles touch along the interval Gamma_c of a straight line; the side of each opposite Gamma_c is clamped, or
moved as given, and no other side is held.  S is the convolution with the hat kernel of radius r on Gamma_c.  Then

* ``C_s^2 <= sup over xi of S_NN(xi) sinc^4(r xi/2)`` with the strip of the Neumann body
  (:mod:`ndtheory.continuum.strip`),
* ``C_ta^2 <= (d/G) K`` with a rational K (:mod:`ndtheory.continuum.segments`),
* ``rho <= (1 + eps) R`` with R the largest ratio of both strips' forms, and eps the energy of a cut-off,
* K and eps are smaller where a :class:`~ndtheory.continuum.calibration.Calibration` of a body proves it,
* ``rho`` is at least the bounds from the wedges at both ends of Gamma_c (:mod:`ndtheory.continuum.wedges`),
* ``rho_normal <= s`` where the mirror image of the contact body fits (:func:`ndtheory.moduli.mirror`).

The proofs are in ``docs/continuum.md``.  Every number here is exact or rounded outward, so conclusions from them are
guaranteed for the continuum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from ndtheory.constants import EnergyConstants
from ndtheory.continuum.calibration import Calibration, loss
from ndtheory.continuum.intervals import Interval
from ndtheory.continuum.segments import bound, bound_at_end, zones
from ndtheory.continuum.strip import Strip, largest_ratio_of_strips, largest_smoothed
from ndtheory.continuum.wedges import Wedge, end_bound
from ndtheory.energy_norms import EnergyBounds, evaluate_energy
from ndtheory.errors import HypothesisError
from ndtheory.keys import Part, key
from ndtheory.moduli import Moduli, mirror
from ndtheory.number import Number, Numeric, above, below

#: A little more than 4/pi^2.
FOUR_OVER_PI_SQUARE = Fraction(40529, 100000)


@dataclass(frozen=True, kw_only=True)
class Rectangle:
    """A body whose side opposite Gamma_c is clamped, and no other side held; HypothesisError for other values.

    ``left`` < ``right`` are its ends along Gamma_c, ``thickness`` is d > 0, from Gamma_c to the clamped side, lengths;
    ``body`` is not incompressible, kappa > 1.
    """

    left: Fraction
    right: Fraction
    thickness: Fraction
    body: Moduli

    def __post_init__(self) -> None:
        if not self.left < self.right:
            raise HypothesisError("x", f"[{self.left}, {self.right}]", "a first end below the second one")
        if not self.thickness > 0:
            raise HypothesisError("d", self.thickness, "a thickness d > 0")
        if not self.body.kappa > 1:
            raise HypothesisError("nu", self.body.poisson, "a compressible body, nu < 1/2")

    @property
    def strip(self) -> Strip:
        """The strip that contains it."""
        return Strip(body=self.body, thickness=self.thickness)

    def in_thicknesses(self, ends: tuple[Fraction, Fraction]) -> tuple[Fraction, Fraction, Fraction]:
        """Its length, and where an interval on it begins and ends, from its left side."""
        length, lo, hi = ((end - self.left) / self.thickness for end in (self.right, *ends))
        return length, lo, hi


@dataclass(frozen=True, kw_only=True)
class TwoRectangles:
    """Two rectangles in contact; HypothesisError for other values.

    ``contact`` is the body of step II, ``neumann`` the one of step I; ``interval`` has the ends of Gamma_c, inside
    both, and ``radius`` is r > 0 of the hat kernel.

    Examples
    --------
    Section 6 with its own friction:

    >>> tenths = lambda *values: (Fraction(value, 10) for value in values)
    >>> def body(left, right, young):
    ...     left, right, thickness = tenths(left, right, 3)
    ...     return Rectangle(left=left, right=right, thickness=thickness, body=Moduli(young=young, poisson="0.3"))
    >>> upper_body, lower_body, ends = body(4, 16, 20000), body(0, 20, 70000), tuple(tenths(4, 16))
    >>> model = TwoRectangles(contact=upper_body, neumann=lower_body, interval=ends, radius=Fraction(1, 10))
    >>> found = continuum_constants(model)
    >>> says = statement(found, friction="0.2", theta="0.4")
    >>> says.verdict, says.factor.level, round(says.factor.hi, 3)
    ('contraction', 'guaranteed', 0.947)
    """

    contact: Rectangle
    neumann: Rectangle
    interval: tuple[Fraction, Fraction]
    radius: Fraction

    def __post_init__(self) -> None:
        lo, hi = self.interval
        for body in (self.contact, self.neumann):
            if not body.left <= lo < hi <= body.right:
                needed = f"an interval on both bodies, inside [{body.left}, {body.right}]"
                raise HypothesisError("Gamma_c", f"[{lo}, {hi}]", needed)
        if not self.radius > 0:
            raise HypothesisError("r", self.radius, "a radius r > 0")

    @property
    def margins(self) -> tuple[Fraction, Fraction]:
        """Lengths of the Neumann body beyond both ends of Gamma_c."""
        return self.interval[0] - self.neumann.left, self.neumann.right - self.interval[1]


def upper(value: Fraction) -> Number:
    """A number that is proved to be at most a rational."""
    hi = above(value)
    return Number(value=hi, hi=hi, level="guaranteed")


def lower(value: Fraction) -> Number:
    """A number that is proved to be at least a rational."""
    lo = below(value)
    return Number(value=lo, lo=lo, level="guaranteed")


def _root(square: Fraction) -> Number:
    return upper(Fraction(Interval.of(square).sqrt().hi))


#: Arguments of the keys of upper bounds; the certificate gives their reasons.
AT_MOST: dict[str, Any] = {"of": upper, "type": "Number", "why": None}


@dataclass(frozen=True, kw_only=True)
class ContinuumConstants(Part):
    """Upper bounds of the constants in energy norms, exact rationals, and a lower bound of rho.

    Those of C_s, C_t1 and C_t2 are squares here, and roots in documents; ``reason`` says why a bound is None.
    """

    C_s_square: Fraction = key("at most", name="C_s", unit="√(stress/length)", of=_root, type="Number")
    C_t1_square: Fraction = key("at most; contact body", name="C_t1", unit="√(length/stress)", of=_root, type="Number")
    C_t2_square: Fraction = key("at most; Neumann body", name="C_t2", unit="√(length/stress)", of=_root, type="Number")
    K: tuple[Fraction, Fraction] = key(
        r"the rationals $K$ of both bodies, $C_t^2 \le (d/G)K$", unit="1", type="list of text"
    )
    strips: Fraction = key("$R$, at most: the contact strip's form over the Neumann strip's", **AT_MOST)
    cut_off: Fraction | None = key(
        r"$\varepsilon$, at most", null=r"where $\Gamma_c$ reaches an end of the Neumann body", **AT_MOST
    )
    rho: Fraction | None = key(r"at most, $(1 + \varepsilon)R$", null=r"where $\varepsilon$ is", **AT_MOST)
    rho_ends: Fraction = key(
        r"at least: the bound from the wedges at the ends of $\Gamma_c$; not less than `rho_least`",
        of=lower,
        type="Number",
    )
    rho_normal: Fraction | None = key("at most, by a mirror image", null="where it does not fit", **AT_MOST)
    reason: dict[str, str]

    def kappa(self, friction: Fraction) -> tuple[Fraction, Fraction]:
        """Upper bounds of kappa_1 and kappa_2."""
        return tuple(  # type: ignore[return-value]
            friction * Fraction(Interval.of(self.C_s_square * square).sqrt().hi)
            for square in (self.C_t1_square, self.C_t2_square)
        )


def cut_off(model: TwoRectangles, proofs: Sequence[Calibration] = ()) -> Fraction | None:
    """eps with ``a(chi v) <= (1 + eps) a(v)`` for lifts v into the Neumann body, chi falling to 0 beside Gamma_c.

    The least one of a linear chi and, for each calibration, of the chi that it proves best.  None if Gamma_c reaches an
    end of the Neumann body.
    """
    body, (lo, hi) = model.neumann, model.interval
    if min(model.margins) <= 0:
        return None
    # each side's segments stay on their side of the middle of Gamma_c, so that they meet no strain of the other side
    room = (hi - lo) / 2 / body.thickness
    steepest = (body.thickness / min(model.margins)) ** 2
    kappa = body.body.kappa
    along = (kappa + 1) / (kappa - 1) * bound_at_end(room, kappa) / 2
    across = FOUR_OVER_PI_SQUARE * (kappa + 1) / 8
    found = [(along + across) * steepest]
    length, first, last = body.in_thicknesses(model.interval)
    for proof in proofs:
        reach = min((proof.reach(Fraction(0), first), proof.reach(last, length)), key=lambda side: side.lo)
        if reach.lo > 0:
            found.append(loss(reach))
    return min(found)


def ends(model: TwoRectangles) -> Fraction:
    """The larger lower bound of rho from both ends of Gamma_c.

    A rectangle is a wedge of 90 degrees where it ends with Gamma_c, and of 180 degrees where it goes on; the side
    beyond Gamma_c is free.
    """
    lo, hi = model.interval
    openings = {
        tuple(180 if goes_on else 90 for goes_on in sides)
        for sides in (
            (model.contact.left < lo, model.neumann.left < lo),
            (hi < model.contact.right, hi < model.neumann.right),
        )
    }
    contact, neumann = model.contact.body, model.neumann.body
    return max(
        end_bound(Wedge(body=contact, degrees=one), Wedge(body=neumann, degrees=other)).least for one, other in openings
    )


def continuum_constants(
    model: TwoRectangles, *, contact: Sequence[Calibration] = (), neumann: Sequence[Calibration] = ()
) -> ContinuumConstants:
    """Bound C_s, C_t1, C_t2 from above and rho from both sides for the continuum.

    Parameters
    ----------
    model : TwoRectangles
    contact, neumann : sequence of Calibration
        Proofs for the bodies, where there are any: each bound is the best one of these and of the closed forms.

    Raises
    ------
    HypothesisError
        A calibration of another body.
    Unproved
        A search among intervals found no answer.
    """
    reason: dict[str, str] = {}
    factors, squares = [], []
    for body, proofs in ((model.contact, contact), (model.neumann, neumann)):
        length, lo, hi = body.in_thicknesses(model.interval)
        kappa = body.body.kappa
        for proof in proofs:
            if (proof.kappa, proof.x[-1]) != (kappa, length):
                received = f"kappa = {proof.kappa}, length {proof.x[-1]}"
                raise HypothesisError("calibration", received, f"one for kappa = {kappa} and length {length}")
        weights = [proof.trace(lo, hi) for proof in proofs]
        factors.append(min([bound(zones(length, lo, hi, kappa), kappa), *(1 / tau for tau in weights if tau > 0)]))
        squares.append(factors[-1] * body.thickness / body.body.shear)
    strips = largest_ratio_of_strips(model.contact.strip, model.neumann.strip)
    eps = cut_off(model, neumann)
    if eps is None:
        text = "Gamma_c reaches an end of the Neumann body: there is no room for a cut-off"
        reason |= {"cut_off": text, "rho": text}
    inner, outer = model.contact, model.neumann
    mirrored = mirror(inner.body, outer.body)
    fits = outer.left <= inner.left and inner.right <= outer.right and inner.thickness >= outer.thickness
    if not fits:
        mirrored = None
        reason["rho_normal"] = "needed a contact body that is as thick and goes beyond no end of the Neumann body"
    return ContinuumConstants(
        C_s_square=Fraction(largest_smoothed(outer.strip, model.radius).hi),
        C_t1_square=squares[0],
        C_t2_square=squares[1],
        K=(factors[0], factors[1]),
        strips=strips,
        cut_off=eps,
        rho=None if eps is None else (1 + eps) * strips,
        rho_ends=ends(model),
        rho_normal=mirrored,
        reason=reason,
    )


def friction_threshold(constants: ContinuumConstants) -> Number:
    """A friction below which every small theta contracts; only how small depends on rho."""
    first, second = (Interval.of(value) for value in constants.kappa(Fraction(1)))
    return lower(Fraction((2 / (second + (second.square() + first.square()).sqrt())).lo))


def statement(constants: ContinuumConstants, *, friction: Numeric, theta: Numeric | None = None) -> EnergyBounds | None:
    """The answer of the theorem in energy norms for the continuum; None if rho is not bounded.

    ``friction`` is an upper bound of the coefficient k >= 0, ``theta`` where a factor is wanted, 0 < theta <= 1.

    q grows with its constants, so the values for upper bounds are bounds: ``factor`` and ``factor_proved`` from above,
    ``theta_max_proved`` and both multiples of friction from below.
    """
    k = Fraction(friction)
    rho = constants.rho_normal if k == 0 and constants.rho_normal is not None else constants.rho
    if rho is None:
        return None
    bounds = map(above, (rho, *constants.kappa(k)))
    rho_, kappa_1, kappa_2 = (Number(value=hi, lo=hi, hi=hi, level="guaranteed") for hi in bounds)
    return evaluate_energy(EnergyConstants(rho=rho_, kappa_1=kappa_1, kappa_2=kappa_2), theta)
