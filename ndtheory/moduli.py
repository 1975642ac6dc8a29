"""What the moduli of two bodies alone say of rho: the spectrum of their stiffnesses on a fine mesh.

On a flat patch of Gamma_c both bodies look like half-planes.  At the wave number xi a half-plane of shear modulus G
resists its two circularly polarised surface displacements with the stiffnesses ``2 G |xi|`` and ``2 G |xi|/kappa``,
where ``kappa = 3 - 4 nu`` in plane strain and ``(3 - nu)/(1 + nu)`` in plane stress, and bodies on opposite sides
exchange the two.  A patch that sticks therefore has waves whose ratio of stiffnesses, contact body over Neumann body,
is ``(G_c/G_n) kappa_n``, and others with ``(G_c/G_n)/kappa_c``; one that slides freely has ``E*_c/E*_n``.  Cut off,
such a wave of ever shorter length is an approximate eigenvector of the continuous problem with an error that tends to
0: the three values lie in the essential spectrum whatever the geometry, if the bodies are homogeneous and isotropic
near one point inside Gamma_c.  An end of Gamma_c adds values of its own.

So each value is a *lower* bound of rho in the continuum, and of rho on fine meshes up to what they do not resolve yet.
None is an upper bound: other thicknesses, supports or unequal Poisson ratios may make rho larger.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Literal

from ndtheory.constants import take


@dataclass(frozen=True, kw_only=True)
class Moduli:
    """A homogeneous isotropic body in the plane.

    Attributes
    ----------
    young : Fraction
        E > 0; unit stress, one for both bodies.
    poisson : Fraction
        -1 < nu <= 1/2.
    plane : {'strain', 'stress'}

    Raises
    ------
    HypothesisError

    Examples
    --------
    >>> Moduli(young=70000, poisson="0.3").kappa
    Fraction(9, 5)
    """

    young: Any
    poisson: Any
    plane: Literal["strain", "stress"] = "strain"

    def __post_init__(self) -> None:
        object.__setattr__(self, "young", take("E", self.young, "a number E > 0", lambda v: v > 0))
        needed = "a number with -1 < nu <= 1/2"
        object.__setattr__(self, "poisson", take("nu", self.poisson, needed, lambda v: -1 < v <= Fraction(1, 2)))

    @property
    def shear(self) -> Fraction:
        """``G = E/(2 (1 + nu))``, unit stress."""
        return Fraction(self.young / (2 * (1 + self.poisson)))

    @property
    def kappa(self) -> Fraction:
        """Kolosov's constant: ``3 - 4 nu`` in plane strain, ``(3 - nu)/(1 + nu)`` in plane stress."""
        nu = Fraction(self.poisson)
        return 3 - 4 * nu if self.plane == "strain" else (3 - nu) / (1 + nu)

    @property
    def e_star(self) -> Fraction:
        """``E* = 8 G/(kappa + 1)``: ``E/(1 - nu^2)`` in plane strain, E in plane stress; unit stress."""
        return 8 * self.shear / (self.kappa + 1)


@dataclass(frozen=True, kw_only=True)
class HalfPlanes:
    """Ratios of stiffnesses of two half-planes, contact body over Neumann body, exact.

    Attributes
    ----------
    high, low : Fraction
        ``(G_c/G_n) kappa_n`` and ``(G_c/G_n)/kappa_c``: of a patch that sticks.
    free : Fraction
        ``E*_c/E*_n``: of a patch that slides freely.
    """

    high: Fraction
    low: Fraction
    free: Fraction


def half_planes(contact: Moduli, neumann: Moduli) -> HalfPlanes:
    """What a flat patch of Gamma_c has in its essential spectrum.

    Examples
    --------
    >>> half_planes(Moduli(young=20000, poisson="0.3"), Moduli(young=70000, poisson="0.3"))
    HalfPlanes(high=Fraction(18, 35), low=Fraction(10, 63), free=Fraction(2, 7))
    """
    ratio = contact.shear / neumann.shear
    return HalfPlanes(high=ratio * neumann.kappa, low=ratio / contact.kappa, free=contact.e_star / neumann.e_star)


def wedge(opening: float) -> tuple[float, float]:
    """Stiffness of a wedge against a force at its apex, along and across its bisector, over E*.

    A force F at the apex displaces a point at the distance r by ``-(F/K) log r`` (Michell's radial stresses):
    ``K/E* = (alpha + sin alpha)/2`` along the bisector and ``(alpha - sin alpha)/2`` across it.  A flat surface has
    ``pi/2`` for both.

    Parameters
    ----------
    opening : float
        alpha in radians, 0 < alpha < 2 pi.

    Raises
    ------
    HypothesisError

    Examples
    --------
    >>> [round(k, 4) for k in wedge(math.pi / 2)]
    [1.2854, 0.2854]
    """
    alpha = float(take("alpha", opening, "an angle with 0 < alpha < 2 pi", lambda v: 0 < v < 2 * Fraction(math.pi)))
    return (alpha + math.sin(alpha)) / 2, (alpha - math.sin(alpha)) / 2


def end(contact: Moduli, neumann: Moduli, openings: tuple[float, float]) -> tuple[float, float]:
    """What an end of Gamma_c adds: the smaller and the larger ratio of the stiffnesses of both wedges there.

    The mesh approaches them like ``1/log^2 h``, from inside.

    Parameters
    ----------
    contact, neumann : Moduli
    openings : pair of float
        The angles of the contact body and of the Neumann body at that end, in radians; pi where the surface goes on.

    Raises
    ------
    HypothesisError

    Examples
    --------
    The upper body of Section 6, with corners of 90 degrees, on the flat lower one: the upper body has the Neumann
    problem.

    >>> hard, soft = Moduli(young=70000, poisson="0.3"), Moduli(young=20000, poisson="0.3")
    >>> [round(value, 3) for value in end(hard, soft, (math.pi, math.pi / 2))]
    [4.277, 19.264]
    """
    between = sum(openings) / 2  # the bisectors lie half of each angle above and below Gamma_c
    along_c, across_c = wedge(openings[0])
    along_n, across_n = wedge(openings[1])
    # the matrix of the Neumann wedge in the frame of the contact wedge
    c, s = math.cos(between) ** 2, math.sin(between) ** 2
    cross = (along_n - across_n) * math.cos(between) * math.sin(between)
    n_11, n_22 = c * along_n + s * across_n, s * along_n + c * across_n
    # eigenvalues x of K_c v = x K_n v: det K_n x^2 - trace x + det K_c = 0
    det_n, det_c = along_n * across_n, along_c * across_c
    trace = along_c * n_22 + across_c * n_11
    root = math.sqrt(max((along_c * n_22 - across_c * n_11) ** 2 + 4 * along_c * across_c * cross**2, 0.0))
    larger = (trace + root) / (2 * det_n)
    ratio = float(contact.e_star / neumann.e_star)
    return ratio * det_c / (det_n * larger), ratio * larger


def mirror(contact: Moduli, neumann: Moduli) -> Fraction | None:
    """The least s with ``C_c <= s C_n`` between energies of strains: the larger ratio of ``G`` and of ``lambda + mu``.

    Where Gamma_c is flat, the mirror image of the contact body lies in the Neumann body, and its supports on the image
    of Gamma_u too, that proves ``rho_normal <= s`` on nested meshes and in the continuum.  None where the contact body
    is incompressible and the Neumann body is not: no s is large enough.

    Examples
    --------
    >>> mirror(Moduli(young=20000, poisson="0.3"), Moduli(young=70000, poisson="0.3"))
    Fraction(2, 7)
    """
    ratio = contact.shear / neumann.shear
    if contact.kappa == 1:
        return ratio if neumann.kappa == 1 else None
    return ratio * max(Fraction(1), (neumann.kappa - 1) / (contact.kappa - 1))  # lambda + mu = 2 G/(kappa - 1)
