"""Bounds of rho from material data: elastic moduli, conductivities, and the densities of a fluid and of a wall.

On a flat patch of Gamma_c both bodies behave like half-planes.  At the wave number xi a half-plane of shear modulus G
resists its two circularly polarised surface displacements with the stiffnesses ``2 G |xi|`` and ``2 G |xi|/kappa``
(kappa: :attr:`Moduli.kappa`), and bodies on opposite sides exchange the two.  So waves on a patch that sticks have the
ratios of stiffnesses, contact body over Neumann body, ``(G_c/G_n) kappa_n`` and ``(G_c/G_n)/kappa_c``; a patch that
slides freely has ``E*_c/E*_n``.  These three values lie in the essential spectrum for every geometry, if the bodies are
homogeneous and isotropic near one point inside Gamma_c (``docs/continuum.md``).  An end of Gamma_c adds other values.

So each value is a *lower* bound of rho in the continuum, and of rho on fine meshes up to what they do not resolve yet.
None is an upper bound: other thicknesses, supports or unequal Poisson ratios may make rho larger.

In space a wave along a flat patch moves a half-space in the plane of the wave as in plane strain, and also across it
(antiplane) with the stiffness ``G |xi|``.  The ratio of these, ``G_c/G_n``, lies between the two of a patch that
sticks, because kappa >= 1.

:func:`conduction` is for plates that exchange heat, :func:`added_mass` for a fluid at a wall.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal, get_args

from ndtheory.constants import take
from ndtheory.errors import HypothesisError
from ndtheory.number import Numeric

#: Plane strain, plane stress, or a body in space.
Plane = Literal["strain", "stress", "3d"]


@dataclass(frozen=True, kw_only=True)
class Moduli:
    """A homogeneous isotropic body, in the plane or in space; HypothesisError for values outside these ranges.

    Attributes
    ----------
    young : Fraction
        E > 0; unit stress, one for both bodies.
    poisson : Fraction
        -1 < nu <= 1/2.
    plane : {'strain', 'stress', '3d'}
        ``'3d'`` is a body in space, whose plane waves are waves of plane strain.

    Examples
    --------
    >>> Moduli(young=70000, poisson="0.3").kappa
    Fraction(9, 5)
    """

    young: Fraction
    poisson: Fraction
    plane: Plane

    def __init__(self, *, young: Numeric, poisson: Numeric, plane: Plane = "strain") -> None:
        object.__setattr__(self, "young", take("E", young, "a number E > 0", lambda v: v > 0))
        needed = "a number with -1 < nu <= 1/2"
        object.__setattr__(self, "poisson", take("nu", poisson, needed, lambda v: -1 < v <= Fraction(1, 2)))
        object.__setattr__(self, "plane", plane)
        if plane not in get_args(Plane):
            raise HypothesisError("plane", plane, f"one of {', '.join(get_args(Plane))}")

    @property
    def shear(self) -> Fraction:
        """``G = E/(2 (1 + nu))``, unit stress."""
        return Fraction(self.young / (2 * (1 + self.poisson)))

    @property
    def kappa(self) -> Fraction:
        """Kolosov's constant: ``3 - 4 nu`` in plane strain and in space, ``(3 - nu)/(1 + nu)`` in plane stress."""
        nu = Fraction(self.poisson)
        return (3 - nu) / (1 + nu) if self.plane == "stress" else 3 - 4 * nu

    @property
    def e_star(self) -> Fraction:
        """``E* = 8 G/(kappa + 1)``: ``E/(1 - nu^2)`` in plane strain and in space, E in plane stress; unit stress."""
        return 8 * self.shear / (self.kappa + 1)


@dataclass(frozen=True, kw_only=True)
class HalfPlanes:
    """Ratios of stiffnesses of two half-planes, contact body over Neumann body, exact.

    ``high`` and ``low`` are ``(G_c/G_n) kappa_n`` and ``(G_c/G_n)/kappa_c``, of a patch that sticks; ``free`` is
    ``E*_c/E*_n``, of one that slides freely.
    """

    high: Fraction
    low: Fraction
    free: Fraction


def half_planes(contact: Moduli, neumann: Moduli) -> HalfPlanes:
    """The values that a flat patch of Gamma_c has in its essential spectrum.

    Examples
    --------
    >>> half_planes(Moduli(young=20000, poisson="0.3"), Moduli(young=70000, poisson="0.3"))
    HalfPlanes(high=Fraction(18, 35), low=Fraction(10, 63), free=Fraction(2, 7))
    """
    ratio = contact.shear / neumann.shear
    return HalfPlanes(high=ratio * neumann.kappa, low=ratio / contact.kappa, free=contact.e_star / neumann.e_star)


def antiplane(contact: Moduli, neumann: Moduli) -> Fraction:
    """``G_c/G_n``: the ratio that waves across their own plane add in space, never the largest or the smallest one.

    Examples
    --------
    >>> antiplane(Moduli(young=1, poisson="0.3", plane="3d"), Moduli(young=2, poisson="0.3", plane="3d"))
    Fraction(1, 2)
    """
    return contact.shear / neumann.shear


def wedge(opening: float) -> tuple[float, float]:
    """Stiffness of a wedge against a force at its apex, along and across its bisector, over E*.

    A force F at the apex displaces a point at the distance r by ``-(F/K) log r`` (Michell's radial stresses):
    ``K/E* = (alpha + sin alpha)/2`` along the bisector and ``(alpha - sin alpha)/2`` across it.  A flat surface has
    ``pi/2`` for both.

    ``opening`` is alpha in radians; HypothesisError unless 0 < alpha < 2 pi.

    Examples
    --------
    >>> [round(k, 4) for k in wedge(math.pi / 2)]
    [1.2854, 0.2854]
    """
    alpha = float(take("alpha", opening, "an angle with 0 < alpha < 2 pi", lambda v: 0 < v < 2 * Fraction(math.pi)))
    return (alpha + math.sin(alpha)) / 2, (alpha - math.sin(alpha)) / 2


def end(contact: Moduli, neumann: Moduli, openings: tuple[float, float]) -> tuple[float, float]:
    """The smaller and the larger ratio that an end of Gamma_c adds, of the stiffnesses of both wedges there.

    A unit force in a direction d, spread over a short piece of Gamma_c of length e at its end, does the work
    ``d' K^-1 d log(1/e) + O(1)`` on each body.  For every force rho is at least the work on the Neumann body over the
    work on the contact body: as e tends to 0, at least the largest eigenvalue of ``(K_c, K_n)``.  Meshes approach the
    values like ``1/log^2 h``, from inside.  In space an end is an edge, and forces along it add
    ``(G_c alpha_c)/(G_n alpha_n)``.  In the plane :func:`ndtheory.continuum.wedges.end_bound` uses every power of r, of
    which a force at the apex is a limit, and may find a larger ratio; ``docs/continuum.md`` has the proof of both.

    Parameters
    ----------
    contact, neumann : Moduli
    openings : pair of float
        The angles of the contact body and of the Neumann body at that end, in radians, pi where the surface goes on;
        HypothesisError unless they lie between 0 and 2 pi.

    Examples
    --------
    The upper body of Section 6 as Neumann body, with corners of 90 degrees, on the flat lower one.

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
    low, high = ratio * det_c / (det_n * larger), ratio * larger
    if "3d" in (contact.plane, neumann.plane):
        along_edge = float(antiplane(contact, neumann)) * openings[0] / openings[1]
        return min(low, along_edge), max(high, along_edge)
    return low, high


def free_end(contact: Moduli, neumann: Moduli, openings: tuple[float, float]) -> float:
    """The ratio of stiffnesses against a normal force at an end of Gamma_c where both bodies slide freely.

    It bounds rho_normal from below by the argument of :func:`end` for normal forces, with the same parameters and
    errors.  A normal force at the apex displaces the face of a wedge along its normal by
    ``sin^2(alpha/2)/K_along + cos^2(alpha/2)/K_across`` times the logarithm, with the stiffnesses of :func:`wedge`.

    Examples
    --------
    A flat contact body on a Neumann body with corners of 90 degrees, of the same material:

    >>> body = Moduli(young=1, poisson="0.3")
    >>> round(free_end(body, body, (math.pi, math.pi / 2)), 3)
    3.363
    """

    def flexibility(opening: float) -> float:
        along, across = wedge(opening)
        return math.sin(opening / 2) ** 2 / along + math.cos(opening / 2) ** 2 / across

    return float(contact.e_star / neumann.e_star) * flexibility(openings[1]) / flexibility(openings[0])


def layer(body: Moduli) -> float:
    """The largest ratio of stiffnesses of a layer's mirror image and of the layer, for every thickness.

    The layer is infinitely long and held along its other side.  At x = (wave number times thickness) its surface has
    the stiffnesses of :func:`ndtheory.continuum.strip.symbols`, and its mirror image the same with NT of opposite sign:
    the ratio is ``(1 + q)/(1 - q)`` with ``q = |NT|/sqrt(TT NN)``.  Short waves have kappa, like a half-plane; in a
    nearly incompressible layer long ones have more.  The maximum is sought among waves a hundredth apart in log10 x,
    and is good to three figures.

    Examples
    --------
    >>> [round(layer(Moduli(young=1, poisson=nu)), 2) for nu in ("0.3", "0.45", "0.5")]
    [1.8, 2.47, 13.93]
    """
    kappa = float(body.kappa)

    def ratio(x: float) -> float:
        grows = kappa * math.sinh(2 * x)
        diagonal = (kappa + 1) / 2 * math.sqrt((grows - 2 * x) * (grows + 2 * x))
        q = abs(kappa * (kappa - 1) * math.sinh(x) ** 2 - 2 * x**2) / diagonal
        return (1 + q) / (1 - q)

    return max(kappa, *(ratio(10 ** (n / 100)) for n in range(-200, 101)))


def column() -> float:
    """The largest ratio of stiffnesses of a slender column's mirror image and of the column, at its end.

    The end of a beam that is held at the other end has, for a unit force and a unit moment, flexibilities proportional
    to ``((1/3, 1/2), (1/2, 1))``, and the mirror image turns to the other side: the ratio is ``(1 + q)/(1 - q)`` with
    ``q = (1/2)/sqrt(1/3)``, which is ``(2 + sqrt 3)^2`` for every material and section.

    Examples
    --------
    >>> round(column(), 3)
    13.928
    """
    q = math.sqrt(3) / 2
    return (1 + q) / (1 - q)


def mirror(contact: Moduli, neumann: Moduli) -> Fraction | None:
    """The least s with ``C_c <= s C_n`` between energies of strains.

    It is the larger of two ratios, of G and of ``lambda + mu``, in space ``lambda + 2 mu/3``.  If Gamma_c is flat, the
    mirror image of the contact body lies in the Neumann body, and mirrored supports lie on supports, that proves
    ``rho_normal <= s`` on nested meshes and in the continuum.  None if the contact body is incompressible and the
    Neumann body is not: no s is large enough.

    Examples
    --------
    >>> mirror(Moduli(young=20000, poisson="0.3"), Moduli(young=70000, poisson="0.3"))
    Fraction(2, 7)
    """
    ratio = contact.shear / neumann.shear
    if contact.kappa == 1:
        return ratio if neumann.kappa == 1 else None
    bulk = (neumann.kappa - 1) / (contact.kappa - 1)  # lambda + mu = 2 G/(kappa - 1)
    if "3d" in (contact.plane, neumann.plane):
        bulk *= (1 + contact.poisson) / (1 + neumann.poisson)  # lambda + 2 mu/3 = (lambda + mu) 2 (1 + nu)/3
    return ratio * max(Fraction(1), bulk)


def conduction(
    conductivity: Sequence[Fraction],
    *,
    capacity: Sequence[Fraction] | None = None,
    thickness: Sequence[Fraction] | None = None,
    dt: Fraction | None = None,
) -> tuple[float, float]:
    """The range of the ratio of conductances of two flat plates, contact body over Neumann body, over all waves.

    Without a thickness the plates are thick.  In the steady state the others are held at their other sides; in a step
    in time anything may hold them.  ``docs/coupling_waves.md`` has the formulas and their proofs.

    Parameters
    ----------
    conductivity, capacity, thickness : pair
        Of the contact body and of the Neumann body, each in any one unit; capacity is per volume, of a step in time.
    dt : Fraction, optional
        Needed with both capacity and thickness, in the unit of ``capacity thickness^2/conductivity``.

    Examples
    --------
    >>> conduction((1, 4)), conduction((1, 4), capacity=(1, 1)), conduction((1, 4), thickness=(1, 1))
    ((0.25, 0.25), (0.25, 0.5), (0.25, 0.25))
    """
    k, c, d, thick = conductivity, capacity, thickness, 1.0
    short = float(Fraction(k[0]) / k[1])
    if c is None:
        long = short if d is None else float(Fraction(k[0] * d[1]) / (k[1] * d[0]))
    else:
        long = math.sqrt(Fraction(k[0] * c[0]) / (k[1] * c[1]))
        if d is not None and dt is not None:
            thick = math.prod(math.tanh(d[i] / math.sqrt(k[i] * dt / c[i])) for i in (0, 1))
    return min(long, short) * thick, max(long, short) / thick if thick else math.inf


def cooled(
    film: Fraction,
    conductivity: Fraction,
    *,
    thickness: Fraction | None = None,
    capacity: Fraction | None = None,
    dt: Fraction | None = None,
) -> float:
    """The largest ratio of a film coefficient to the conductance of a flat plate, over all waves; the least is 0.

    In the steady state the plate, of a thickness, is held at a temperature on its other side; in a step in time, with
    a capacity per volume, anything may hold it, and without a thickness it is thick.

    Examples
    --------
    >>> cooled(10, 50, thickness=Fraction("0.02")), cooled(10, 4, capacity=1, dt=1)
    (0.004, 5.0)
    """
    if capacity is None or dt is None:
        return float(film * (thickness or math.inf) / conductivity)
    reach = math.sqrt(conductivity * dt / capacity)
    return float(film) * reach / float(conductivity) / (math.tanh(thickness / reach) if thickness else 1.0)


@dataclass(frozen=True, kw_only=True)
class Wall:
    """A wall beside a fluid: a plate held along two lines, ``length`` apart, or a tube; without E only masses count."""

    density: Fraction
    thickness: Fraction
    length: Fraction
    radius: Fraction | None = None
    young: Fraction | None = None
    poisson: Fraction = Fraction(0)

    def stiffness(self, wave: int = 1) -> Fraction | float:
        """Pressure per displacement of the wave ``sin(n pi x/L)``: ``D xi^4``, of a tube also ``E' h/R^2``.

        ``E' = E/(1 - nu^2)``, ``D = E' h^3/12``; an upper bound for a wall whose ends may turn.
        """
        if self.young is None:
            return 0
        plane = self.young / (1 - self.poisson**2) * self.thickness
        ring = 0 if self.radius is None else plane / self.radius**2
        return float(ring) + float(plane * self.thickness**2 / 12) * (wave * math.pi / float(self.length)) ** 4


def added_mass(fluid: Numeric, wall: Wall, *, dt: Fraction | None = None, wave: int = 1) -> float:
    """The added mass of a wave of the wall over its own mass, and stiffness times ``dt^2``: rho is at least this.

    The fluid, of this density, has no viscosity, is incompressible, and fills the square over the plate, or the tube.
    Without dt it is the limit for short steps in time.  ``docs/coupling_waves.md`` has the proof.

    Examples
    --------
    Water in a tube of silicone:

    >>> tube = Wall(density=1200, thickness=Fraction(1, 1000), length=Fraction(1, 20), radius=Fraction(1, 200))
    >>> round(added_mass(1000, tube), 1)
    85.5
    """
    xi = wave * math.pi / float(wall.length)
    m = math.tanh(wave * math.pi) / xi if wall.radius is None else bessel_ratio(xi * float(wall.radius)) / xi
    weight = float(wall.density * wall.thickness)
    return float(fluid) * m / (weight + float(wall.stiffness(wave)) * (0.0 if dt is None else float(dt) ** 2))


def bessel_ratio(x: float) -> float:
    """``I0(x)/I1(x)`` for x > 0, from their series; for x > 50 it is 1, less by about 1 %."""
    if x > 50:
        return 1.0
    i0 = i1 = a = b = 1.0
    for k in range(1, 200):
        a *= x * x / (4 * k * k)
        b *= x * x / (4 * k * (k + 1))
        i0, i1 = i0 + a, i1 + b
    return i0 / (i1 * x / 2)
