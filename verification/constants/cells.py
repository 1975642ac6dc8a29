"""rho of the cells of a problem: the limit that meshes of these cells have at short waves, however fine they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

from fem1d2d.element import lacks
from fem1d2d.layers import FacingLayers, Layer, peaks
from ndtheory import Number
from ndtheory.moduli import half_planes
from verification.interface import assembly
from verification.interface.body import material_of
from verification.machine.threads import one_thread
from verification.problem import Problem
from verification.problem.specs import BodySpec

#: Columns of cells of a body in one period up to which the waves of both grids are joined: a tenth of a second.
MOST_COLUMNS = 8

#: Rounds of the search for the wave at which a proof takes its lower bound: 1e-7 radians decide 1e-14.
FINE = 6

#: The sides along Gamma_c, of body 1 and of body 2.
SIDES = ("top", "bottom")

NAMES = ("rho_cells", "rho_normal_cells")

NO_PROBLEM = "the bodies are known by matrices only: needed two rectangles of equal cells"


class NoCells(ValueError):
    """Why a problem has no rho of its cells."""


@dataclass(frozen=True, kw_only=True)
class OfCells:
    """``rho_cells`` and ``rho_normal_cells``, or why there are none; ``unverified``: why they are not proved."""

    numbers: Mapping[str, Number]
    why: str = ""
    unverified: str = ""


def rho_of_cells(problem: Problem | None, *, verified: bool = False) -> OfCells:
    """Find rho of the cells of a problem.

    Both bodies are half-planes of the cells that the file has once halved.  Each value is the largest one over all
    waves along Gamma_c and the limit of long ones, ``(G_c/G_n) kappa_n`` and ``E*_c/E*_n``.  In doubles the waves are
    finitely many.  ``verified`` asks for proved bounds, which need columns of one width.
    """
    try:
        if problem is None:
            raise NoCells(NO_PROBLEM)
        interface = halved_cells(problem)
    except NoCells as error:
        return OfCells(numbers={}, why=str(error))
    contact, neumann = _roles(problem)
    limit = half_planes(contact.moduli, neumann.moduli)
    ratios = zip(NAMES, _largest(interface), (limit.high, limit.free), strict=True)
    numbers = {name: Number.of_float(max(found, float(least))) for name, found, least in ratios}
    if not verified:
        return OfCells(numbers=numbers)
    if not interface.matching:
        return OfCells(numbers=numbers, unverified="proved only for columns of cells that face each other")
    if "both" in (contact.split, neumann.split):
        return OfCells(numbers=numbers, unverified="proved only for cells that are split by one diagonal")
    proved = _enclosed(interface, contact, neumann)
    return OfCells(numbers={**numbers, **proved.numbers}, unverified=proved.unverified)


def halved_cells(problem: Problem) -> FacingLayers:
    """The layers of a problem whose cells are halved once.

    Raises
    ------
    NoCells
        One dimension, bodies not rectangular or held along Gamma_c, lengths of cells without a simple ratio.

    Examples
    --------
    >>> from verification.problem.examples import example
    >>> layers = halved_cells(example("section6"))
    >>> layers.contact.aspect, layers.neumann.aspect, layers.columns, layers.contact.rising == layers.neumann.rising
    (1.0, 1.0, (2, 2), True)
    """
    if problem.dimension == 1:
        raise NoCells("bars have no waves along Gamma_c")
    if problem.named:
        raise NoCells(
            "the contacts are tables [[contact]]" if problem.several else "Gamma_c is a named line, of any shape"
        )
    for (i, body), side in zip(problem.bodies.items(), SIDES, strict=True):
        if body.shape != "rectangle":
            raise NoCells(f"body{i} is not a rectangle of equal cells")
        if why := lacks(assembly.rectangle_of_cells((0.0, 1.0), (0.0, 1.0), (1, 1)), "waves"):
            raise NoCells(f"body{i}: {why}")
        if side in body.fixed or side in body.prescribed:
            raise NoCells(f"body{i} is held along Gamma_c")
    contact, neumann = _roles(problem)
    (a, _), (b, _) = size_c, size_n = _cell(contact), _cell(neumann)
    ratio = a / b
    columns = (ratio.denominator, ratio.numerator)  # in one period
    if any(count % 2 for count in columns):  # the diagonals alternate
        columns = (2 * columns[0], 2 * columns[1])
    if max(columns) > MOST_COLUMNS:
        most = MOST_COLUMNS // 2
        raise NoCells(
            f"cells have the lengths {ratio} to 1 along Gamma_c: needed a ratio of whole numbers up to {most}"
        )
    # the last Neumann node not to the right of a contact node; surface cells of halved meshes rise in odd columns
    assert contact.x is not None
    assert neumann.x is not None
    apart = (contact.x[0] - neumann.x[0]) / b
    first = apart.numerator // apart.denominator
    return FacingLayers(
        contact=_layer(contact, size_c, 0),
        neumann=_layer(neumann, size_n, first),
        columns=columns,
        offset=float((first - apart) / ratio),
    )


def _cell(body: BodySpec) -> tuple[Fraction, Fraction]:
    """Width and height of a halved cell, unit of length."""
    assert body.x is not None
    assert body.y is not None
    assert body.cells is not None
    return tuple(  # type: ignore[return-value]
        (hi - lo) / (2 * count) for (lo, hi), count in zip((body.x, body.y), body.cells, strict=True)
    )


def _layer(body: BodySpec, size: tuple[Fraction, Fraction], column: int) -> Layer:
    aspect, rising = float(size[0] / size[1]), column % 2 == 1
    return Layer(material=material_of(body), aspect=aspect, rising=rising, diagonals=body.split)


def _roles(problem: Problem) -> tuple[BodySpec, BodySpec]:
    """The contact body and the Neumann body."""
    bodies = (problem.body1, problem.body2)
    return bodies if problem.contact_body == 1 else bodies[::-1]


@lru_cache(maxsize=64)
def _largest(interface: FacingLayers) -> tuple[float, ...]:
    with one_thread():
        return tuple(peak.ratio for peak in peaks(interface))


@lru_cache(maxsize=64)
def _enclosed(interface: FacingLayers, contact: BodySpec, neumann: BodySpec) -> OfCells:
    from fem1d2d.proofs.layers_proved import HalfPlane, Undecided, enclosed_ratio

    bodies = []
    for body in (contact, neumann):
        (width, height), found = _cell(body), body.moduli
        bodies.append(HalfPlane(aspect=width / height, shear=found.shear, poisson=found.poisson))
    mirrored = interface.contact.rising == interface.neumann.rising
    numbers: dict[str, Number] = {}
    try:
        with one_thread():
            for name, peak in zip(NAMES, peaks(interface, rounds=FINE), strict=True):
                normal = name == "rho_normal_cells"
                lo, hi = enclosed_ratio(bodies[0], bodies[1], peak.phase, mirrored=mirrored, normal=normal)
                numbers[name] = Number(value=(lo + hi) / 2, lo=lo, hi=hi, level="verified")
    except (Undecided, ZeroDivisionError) as error:  # cells of extreme shape
        return OfCells(numbers=numbers, unverified=f"undecided in balls: {error}")
    return OfCells(numbers=numbers)
