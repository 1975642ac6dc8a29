"""Advice from the moduli of two bodies: lower bounds of rho, and a theta where a mirror image fits."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from fractions import Fraction
from typing import Any, get_args

from ndtheory import HypothesisError, Number
from ndtheory.constants import take
from ndtheory.moduli import Moduli, Plane, column, end, free_end, half_planes, layer, mirror
from ndtheory.number import below
from verification.coupling.advice import Advice
from verification.coupling.kinds import BodyNumber, Kind, kind_of
from verification.coupling.seen_moduli import Corners, ElasticBodies, LowerBounds, ModuliRole, StartTheta
from verification.coupling.waves import Film, Fluid, Heat, read_waves, shown

#: Sizes of E, and how close nu may come to -1 and to 1/2: bounds of rho then stay between 1e-75 and 1e75.
LARGEST_YOUNG, CLOSEST = 10**24, Fraction(1, 10**12)


def advise_moduli(
    *,
    young: Any = None,
    poisson: Any = None,
    plane: Plane = "strain",
    corners: Corners | None = None,
    mirror: Collection[int] = (),
    flat: bool = False,
    conductivity: Any = None,
    film: Any = None,
    capacity: Sequence[Any] | None = None,
    density: Sequence[Any] | None = None,
    thickness: Any = None,
    length: Any = None,
    dt: Any = None,
    kind: str | Kind | None = None,
    parallel: bool = False,
) -> Advice:
    """Advice from the material data of two bodies, before there is a mesh: elastic, with heat, or a fluid at a wall.

    For each role the advice has the bounds of rho from below that every geometry has in the continuum:
    ``(G_c/G_n) kappa_n`` where a piece of Gamma_c may stick, ``E*_c/E*_n`` without friction, with c for the contact
    body and n for the Neumann body; corners of 90 degrees at the ends of Gamma_c have larger ones.  In the continuum no
    theta from ``2/(1 + bound)`` on contracts, and no larger one on matching meshes that are fine enough.  The role with
    the smaller bound is worth trying first: two lower bounds prove no order.

    A bound from below gives no theta.  There is a theta to start with only where Gamma_c is flat, the mirror image of
    the contact body lies in the Neumann body, and wherever the contact body is held its image is held too.  Then
    ``rho_normal <= s`` with the s of :func:`ndtheory.moduli.mirror`, in the continuum and on meshes whose mirror image
    refines the mesh of the Neumann body, and ``theta = 2/(2 + s)`` contracts by ``s/(2 + s)`` in each step without
    friction: the factor is ``max(1 - theta, |1 - theta (1 + rho_normal)|)``.  With friction
    ``rho <= s lambda_max(J S_n J, S_n)``, with the reflection J.  The second factor is guessed: from a slender column,
    whose factor exceeds any layer's, or from a layer and its ends where the Neumann body is ``flat``
    (:func:`ndtheory.moduli.column`, :func:`ndtheory.moduli.layer`, :func:`ndtheory.moduli.end`).

    Two flat plates that exchange heat have both ends of their spectrum, hence a theta to paste and its factor
    (:func:`ndtheory.moduli.conduction`); so has a wall beside a fluid of a given film coefficient
    (:func:`ndtheory.moduli.cooled`).  A fluid at a wall, the Neumann body, has a lower bound of rho, the added mass of
    the longest wave over the wall's own mass (:func:`ndtheory.moduli.added_mass`).  All are tied.

    Parameters
    ----------
    young, poisson : pair of numbers
        E and nu of bodies 1 and 2; E in one unit of stress.  One number each for a wall.
    plane : {'strain', 'stress', '3d'}
    corners : {'none', '1', '2', 'both'}, optional
        The body that ends in corners of 90 degrees at the ends of Gamma_c, where that is known.
    mirror : collection of {1, 2}
        The bodies whose mirror image fits into the other one, with the supports.
    flat : bool
        True if a body into which such an image fits is at least twice as wide as high, and held along its other side.
    conductivity, capacity, density : pair of numbers
        Of plates 1 and 2, the capacity per volume for a step in time; density of the fluid and of the wall.  One number
        each of a wall beside a film.
    film : number
        Film coefficient of a fluid at a wall, flux per temperature.
    thickness, length, dt : number or pair of numbers
        Thickness of the wall, or of both plates, which are thick without it; length of the wall between the lines that
        hold it, of a tube its length and radius; step in time.  All in one set of units.
    kind : {'contact', 'tied'}, optional
        Of elastic bodies, contact by default; heat and a fluid at a wall are tied.
    parallel : bool
        True if both solvers run at once, and both fields are relaxed.

    Returns
    -------
    Advice

    Raises
    ------
    HypothesisError
        Numbers are out of their range, the data are of two kinds or do not fit the kind of coupling, or a mirror image
        cannot fit with these corners.

    Examples
    --------
    >>> found = advise_moduli(young=(70000, 20000), poisson=("0.3", "0.3"))
    >>> found.neumann_body, [round(role.rho.value, 3) for role in found.roles], found.next.theta
    (1, [0.514, 6.3], 0.2799)
    >>> fits = advise_moduli(young=(70000, 20000), poisson=("0.3", "0.3"), corners="2", mirror=[2], flat=True)
    >>> fits.best.theta_proved, fits.next.theta
    (0.875, 0.7954)
    >>> heat = advise_moduli(conductivity=(50, "0.5"), capacity=("3.6e6", "1.6e6"))
    >>> heat.neumann_body, heat.theta, round(heat.best.rate_tied, 4)
    (1, 0.963, 0.0273)
    >>> air = advise_moduli(film=10, conductivity=50, thickness="0.02")
    >>> air.neumann_body, air.theta
    (2, 0.99)
    >>> water = advise_moduli(density=(1000, 1200), thickness="1e-3", length=("0.05", "0.005"))
    >>> round(water.best.rho.value, 1), water.method.name
    (85.5, 'iqn-ils')
    """
    of = kind_of(kind, parallel=parallel)
    if not of.signed:
        raise HypothesisError("kind", of.name, "contact or tied: moduli give no advice on other couplings")
    waves = {
        "film": film,
        "conductivity": conductivity,
        "capacity": capacity,
        "density": density,
        "length": length,
        "dt": dt,
    }
    given = {key: value for key, value in (waves | {"thickness": thickness}).items() if value is not None}
    if conductivity is not None or density is not None or film is not None:
        elastic = {"plane": plane != "strain" and plane, "corners": corners, "mirror": [*mirror], "flat": flat}
        given |= {key: value for key, value in elastic.items() if value}
        given |= {key: value for key, value in (("young", young), ("poisson", poisson)) if value is not None}
        source = Film if film is not None else Fluid if conductivity is None else Heat
        return Advice.of(read_waves(source, given, parallel=of.parallel))
    for key, value in given.items():
        raise HypothesisError(key, shown(value), f"no {key} beside young: it belongs to conductivity or density")
    bodies = _bodies(young, poisson, plane)
    if corners is not None and corners not in get_args(Corners):
        raise HypothesisError("corners", corners, f"one of {', '.join(get_args(Corners))}")
    both: tuple[BodyNumber, ...] = (1, 2)
    fits = tuple(body for body in both if body in mirror)
    if len(set(mirror)) != len(fits):
        raise HypothesisError("mirror", list(mirror), "bodies 1, 2 or both")
    for body in fits:
        if corners == str(3 - body):
            needed = f"a mirror image that fits: that of body {body} goes on where body {3 - body} ends in a corner"
            raise HypothesisError("mirror", body, needed)
    if flat and not fits:
        raise HypothesisError("flat", flat, "a mirror image that fits (mirror)")
    roles = _role(1, bodies, corners, fits, flat), _role(2, bodies, corners, fits, flat)
    return Advice.of(ElasticBodies(kind=of, bodies=bodies, corners=corners, mirror=fits, flat=flat, roles=roles))


def _bodies(young: Sequence[Any], poisson: Sequence[Any], plane: Plane) -> tuple[Moduli, Moduli]:
    given = {}
    for key, pair, of in (("young", young, "E1,E2"), ("poisson", poisson, "nu1,nu2")):
        if isinstance(pair, str) or not hasattr(pair, "__len__") or len(pair) != 2:
            raise HypothesisError(key, shown(pair), f"two numbers {of}, of body 1 and of body 2")
        given[key] = pair
    needed = "numbers E > 0 (1e-24 to 1e24)"
    E = [take("young", v, needed, lambda v: Fraction(1, LARGEST_YOUNG) <= v <= LARGEST_YOUNG) for v in given["young"]]
    needed = "numbers with -1 < nu <= 1/2 (1e-12 from both ends, or 1/2 itself)"
    half = Fraction(1, 2)
    nu = [
        take("poisson", v, needed, lambda v: v == half or -1 + CLOSEST <= v <= half - CLOSEST) for v in given["poisson"]
    ]
    one, two = (Moduli(young=e, poisson=n, plane=plane) for e, n in zip(E, nu, strict=True))
    return one, two


def _role(
    neumann_body: BodyNumber, bodies: tuple[Moduli, Moduli], corners: Corners | None, fits: tuple[int, ...], flat: bool
) -> ModuliRole:
    contact_body = 3 - neumann_body
    neumann, contact = bodies[neumann_body - 1], bodies[contact_body - 1]
    patch, s = half_planes(contact, neumann), mirror(contact, neumann)
    bounds: dict[Corners, LowerBounds] = {}
    for name in get_args(Corners):
        openings = _opening(contact_body, name), _opening(neumann_body, name)
        stick, slide = end(contact, neumann, openings)[1], free_end(contact, neumann, openings)
        bounds[name] = LowerBounds(corners=name, stick=_larger(patch.high, stick), slide=_larger(patch.free, slide))
    if contact_body not in fits or s is None:
        why = (
            f"body {contact_body} is incompressible and body {neumann_body} is not: no multiple of its energy is enough"
        )
        if contact_body not in fits:
            why = f"needed: the mirror image of body {contact_body} fits into body {neumann_body} (--shape)"
        return ModuliRole(neumann_body=neumann_body, corners=bounds, start=None, why_no_start=why)
    # the angle of an image that fits is at most the Neumann body's, which may be a corner unless `corners` excludes it
    angle = math.pi / 2 if corners is None else _opening(neumann_body, corners)
    reflected = max(layer(neumann), end(neumann, neumann, (angle, angle))[1])
    words = "a layer and its ends"
    if not flat:
        reflected, words = max(reflected, column()), "a slender column, more than any layer"
    start = StartTheta(s=s, guess=float(s) * reflected, guessed_from=words)
    return ModuliRole(neumann_body=neumann_body, corners=bounds, start=start)


def _opening(body: int, corners: Corners) -> float:
    return math.pi / 2 if corners in (str(body), "both") else math.pi


def _larger(exact: Fraction, computed: float) -> Number:
    """A rational bound from below as a double that is one too, or the computed one where that is larger."""
    if computed > exact * (1 + Fraction(1, 10**12)):
        return Number.of_float(computed)
    bound = below(exact)
    return Number(value=bound, lo=bound, level="exact")
