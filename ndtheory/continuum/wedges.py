r"""Lower bounds of rho from an end of Gamma_c: the stiffness of a wedge against traces on one of its sides.

A wedge ``0 < phi < omega`` has its side phi = 0 on Gamma_c; the side phi = omega is free, or clamped.  A displacement
``r^(i xi) h`` of the side on Gamma_c costs the energy ``h* S(xi) h`` for each real xi (:meth:`Wedge.symbol`), and
displacements with different xi are orthogonal.  For large xi, S is the form of a half-plane; for small xi the
eigenvalues of a free wedge are ``E* xi^2/2`` times the stiffnesses of :func:`ndtheory.moduli.wedge`.

For two wedges that share the side on Gamma_c the largest eigenvalue of ``(S_contact, S_neumann)`` is a lower bound of
rho in the continuum, at every xi.  The proof is in ``docs/continuum.md``.  Numbers are enclosed in decimals that are
rounded outward, so these bounds are guaranteed.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Context, Decimal
from fractions import Fraction
from functools import lru_cache
from typing import Any

from ndtheory.constants import take
from ndtheory.continuum.intervals import DIGITS, Interval, sinc
from ndtheory.errors import HypothesisError
from ndtheory.moduli import Moduli, half_planes
from ndtheory.number import Numeric

_CUT = Decimal("3.141592653589793238462643383279502884197")
PI = Interval(_CUT, _CUT.next_plus(Context(DIGITS)))

#: Least and largest xi that are tried: there the symbols are within 1e-9 of their limits.
SMALLEST, LARGEST = 1e-6, 20.0

#: Ratio of two neighbours among the xi that are tried first, and how often the steps beside the best are then halved.
STEP, HALVINGS = 1.4, 10


@dataclass(frozen=True, kw_only=True)
class Wedge:
    """A body near an end of Gamma_c; HypothesisError for other values.

    ``body`` is of the plane and not incompressible, kappa > 1; ``degrees``, 0 < degrees < 360, is its opening there,
    180 where the surface goes on; the side beyond Gamma_c is ``clamped``, or free.
    """

    body: Moduli
    degrees: Any
    clamped: bool = False

    def __post_init__(self) -> None:
        given = take("degrees", self.degrees, "an opening with 0 < degrees < 360", lambda v: 0 < v < 360)
        object.__setattr__(self, "degrees", given)
        if self.body.plane == "3d":
            raise HypothesisError("plane", self.body.plane, "a body in the plane, strain or stress")
        if not self.body.kappa > 1:
            raise HypothesisError("nu", self.body.poisson, "a compressible body, kappa > 1")

    def symbol(self, xi: Numeric) -> tuple[Interval, Interval, Interval, Interval]:
        """S_11, S_22 and the real and the imaginary part of S_12 at xi > 0, enclosed; unit stress.

        S belongs to the components ``u_x + i u_y`` and ``u_x - i u_y``, x along Gamma_c away from the apex and y into
        the wedge.  With ``c = 1`` for a free other side and ``c = -kappa`` for a clamped one

            S_11 = G xi ((kappa + 1) (kappa + c e^(2 xi omega))/D - 1),
            S_22 = G xi (1 - (kappa + 1) (kappa + c e^(-2 xi omega))/D),
            S_12 = 2 G xi^2 (kappa + 1) sin(omega) e^(i omega)/D,
            D = (kappa + c e^(2 xi omega)) (kappa + c e^(-2 xi omega)) + 4 xi^2 sin^2(omega).

        S(-xi) has S_11 and S_22 exchanged, and the same S_12.

        Examples
        --------
        A half-plane with G = 1 and kappa = 9/5: the eigenvalues tend to xi/kappa and xi.

        >>> wedge = Wedge(body=Moduli(young="2.6", poisson="0.3"), degrees=180)
        >>> [round(float(value.lo), 4) for value in wedge.symbol(9)[:2]]
        [5.0, 9.0]
        """
        at = take("xi", xi, "a number > 0", lambda v: v > 0)
        opening, sine, cosine = _angle(self.degrees)
        kappa, c = self.body.kappa, -self.body.kappa if self.clamped else Fraction(1)
        grown = kappa + c * (2 * at * opening).exp()
        fallen = kappa + c * (-2 * at * opening).exp()
        determinant = grown * fallen + 4 * at**2 * sine.square()
        scale, off = self.body.shear * at, 2 * at * (kappa + 1) * sine / determinant
        first = (kappa + 1) * grown / determinant - 1
        second = 1 - (kappa + 1) * fallen / determinant
        return first * scale, second * scale, off * cosine * scale, off * sine * scale


@lru_cache(maxsize=64)
def _angle(degrees: Fraction) -> tuple[Interval, Interval, Interval]:
    """An angle, its sine and its cosine, by doubling the angle twice from a quarter, at most pi/2."""
    eighth, quarter = PI * (degrees / 1440), PI * (degrees / 720)
    sine = quarter * sinc(quarter)
    cosine = 1 - 2 * (eighth * sinc(eighth)).square()
    sine, cosine = 2 * sine * cosine, 1 - 2 * sine.square()
    return PI * (degrees / 180), 2 * sine * cosine, 1 - 2 * sine.square()


def ratio(contact: Wedge, neumann: Wedge, xi: Numeric, *, normal: bool = False) -> Interval:
    """The largest ratio of both symbols at one xi, contact body over Neumann body, enclosed; it bounds rho from below.

    Parameters
    ----------
    contact, neumann : Wedge
        On opposite sides of Gamma_c.
    xi : number
        Positive; -xi gives the same.
    normal : bool
        True to condense tangential displacements out: that bounds rho_normal from below.

    Examples
    --------
    Wedges of 90 degrees, of one material: near xi = 0 the ratio is ``(pi + 2)/(pi - 2) = 4.5039``.

    >>> corner = Wedge(body=Moduli(young=1, poisson="0.3"), degrees=90)
    >>> round(float(ratio(corner, corner, "1e-6").lo), 4), round(float(ratio(corner, corner, 1).lo), 4)
    (4.5039, 2.4652)
    """
    n_1, n_2, n_re, n_im = neumann.symbol(xi)
    c_2, c_1, c_re, minus_c_im = contact.symbol(xi)  # the mirror image exchanges both components
    det_c, det_n = c_1 * c_2 - c_re.square() - minus_c_im.square(), n_1 * n_2 - n_re.square() - n_im.square()
    if normal:  # a form without its tangential part is det S over S_xx
        return det_c / det_n * (n_1 + n_2 + 2 * n_re) / (c_1 + c_2 + 2 * c_re)
    trace = c_1 * n_2 + c_2 * n_1 - 2 * (c_re * n_re - minus_c_im * n_im)
    square = trace.square() - 4 * det_c * det_n  # the eigenvalues are real, hence >= 0
    return (trace + Interval(max(square.lo, Decimal(0)), square.hi).sqrt()) / (2 * det_n)


@dataclass(frozen=True, kw_only=True)
class EndBound:
    """A lower bound of rho from one end of Gamma_c.

    rho is proved to be at least ``least``, which the symbols give at ``xi``; None in the limit of large xi, where both
    bodies are like half-planes.
    """

    least: Fraction
    xi: Fraction | None


def end_bound(contact: Wedge, neumann: Wedge, *, normal: bool = False) -> EndBound:
    """The largest :func:`ratio` that a search among the xi finds; each one is a bound.

    That the search found the supremum over all xi is not proved: the bound does not need it.

    Raises
    ------
    HypothesisError
        The contact body is clamped beside Gamma_c and the Neumann body is free: rho is infinite.

    Examples
    --------
    Flat on a corner of 120 degrees: neither xi = 0 nor the half-planes have the largest ratio.

    >>> flat, corner = (Moduli(young=1, poisson=nu) for nu in ("0.3", "0"))
    >>> found = end_bound(Wedge(body=flat, degrees=180), Wedge(body=corner, degrees=120))
    >>> round(float(found.least), 4), round(float(found.xi), 2)
    (3.0134, 0.31)
    """
    if contact.clamped and not neumann.clamped:
        raise HypothesisError("clamped", "contact body only", "a finite rho: the Neumann body clamped there, too")
    patch = half_planes(contact.body, neumann.body)
    best = EndBound(least=patch.free if normal else patch.high, xi=None)
    tried: dict[float, Fraction] = {}

    def at(xi: float) -> Fraction:
        if xi not in tried:
            tried[xi] = Fraction(ratio(contact, neumann, Fraction(xi), normal=normal).lo)
        return tried[xi]

    xi, step = SMALLEST, STEP
    while xi < LARGEST:
        at(xi)
        xi *= step
    xi = max(tried, key=at)
    for _ in range(HALVINGS):
        step = step**0.5
        xi = max((xi, xi * step, xi / step), key=at)
    return EndBound(least=at(xi), xi=Fraction(xi)) if at(xi) > best.least else best
