"""Hypothesis strategies that draw valid cases by construction."""

from fractions import Fraction
from functools import cache

import numpy as np
import oracle
from hypothesis import settings
from hypothesis import strategies as st

from fem1d2d import Material, Mesh, plane_strain, rectangle, supports
from verification.testing.strategies import (  # noqa: F401  part of what this module offers
    bar_problems,
    contact_problems,
    decimals,
    log_uniform,
    plane_problems,
    thetas,
    youngs,
)

# --- the theory: constants m, M, C_R, C_K and the relaxation factor, all rational ------------------------------------


#: Relative width of the layer between C4 and C5 below which no case is drawn; 1e-12..1e12 gives 1e-60 at the least.
THINNEST = Fraction(1, 10**70)


#: Stresses, whatever the unit.
ANY_STRESS = log_uniform(-12, 12)


@cache
def offsets(smallest: int = 20) -> st.SearchStrategy[Fraction]:
    """Relative distances: 0.3 to 10^-smallest, of either sign."""
    return st.builds(lambda sign, j: sign * Fraction(3, 10**j), st.sampled_from([-1, 1]), st.integers(1, smallest))


@st.composite
def bodies(draw, m=ANY_STRESS):
    """m, M, C_R with 0 < m <= M <= 1e6 m and C_R >= 1."""
    m = draw(m)
    return {"m": m, "M": m * draw(log_uniform(0, 6)), "C_R": draw(log_uniform(0, 12))}


def layer(paper: oracle.Paper) -> tuple[Fraction, Fraction]:
    """C4 and C5 on C_K: between them a' < -1 and T_theta still contracts for C6 < theta < C1."""
    return oracle.rational(paper.threshold("C4"), 90), oracle.rational(paper.threshold("C5"), 90)


@st.composite
def frictions(draw, body, editions=tuple(oracle.EDITIONS), thinnest=THINNEST):
    """C_K >= 0 beside given m, M, C_R: zero, any, next to a threshold, or between C4 and C5.

    The last needs (C5 - C4)/C4 >= `thinnest`, about (m~/(M C_R))^2.
    """
    paper = oracle.EDITIONS[draw(st.sampled_from(editions))](**body, C_K=0)
    kinds = ["any", "near", "zero"]
    if (paper.m / (paper.M * paper.C_R)) ** 2 >= float(thinnest):
        kinds.append("layer")
    kind = draw(st.sampled_from(kinds))
    if kind == "zero":
        return Fraction(0)
    if kind == "any":
        return draw(log_uniform(-12, 12))
    if kind == "near":
        threshold = paper.threshold(draw(st.sampled_from(["C2", "C3", "C4"])))
        return oracle.rational(threshold, 90) * (1 + draw(offsets()))
    low, high = layer(paper)
    return low + Fraction(draw(st.integers(1, 99)), 100) * (high - low)


@st.composite
def constants(draw, m=ANY_STRESS, editions=tuple(oracle.EDITIONS), thinnest=THINNEST):
    """Admissible m, M, C_R, C_K: keywords of `ndtheory.Constants` and of the oracle."""
    body = draw(bodies(m))
    return {**body, "C_K": draw(frictions(body, editions, thinnest))}


@st.composite
def square_constants(draw, edition: str = "repaired"):
    """Admissible constants with m and C_K squares of rationals: every root in Section 5 is then rational."""
    root_m = draw(log_uniform(-6, 6))
    body = draw(bodies(st.just(root_m**2)))
    return {**body, "C_K": oracle.rational(oracle.square_root(draw(frictions(body, (edition,)))), 60) ** 2}


@st.composite
def thetas_near_ends(draw, paper: oracle.Paper):
    """0 < theta < 1 next to C0, C1 or C6 of one edition at one set of constants, but not at it."""
    ends = [end for end in (paper.C0, paper.C1, paper.C6) if end is not None and end > 0]
    end = oracle.rational(draw(st.sampled_from(ends)), 90)
    theta = end * (1 + draw(offsets()))
    return theta if theta < 1 else 2 * end - theta


@st.composite
def theory_cases(draw, edition: str, m=ANY_STRESS, thinnest=THINNEST):
    """Constants, and 0 < theta < 1 anywhere or near an end of the interval of `edition`."""
    given = draw(constants(m, (edition,), thinnest))
    return given, draw(st.one_of(thetas_near_ends(oracle.EDITIONS[edition](**given)), thetas()))


# --- elastic bodies: triangles, meshes, materials and supports, all with rational data --------------------------------


@cache
def numbers(low, high, denominator: int = 16) -> st.SearchStrategy[Fraction]:
    """Multiples of 1/denominator from low to high; with a power of two they are exact in floats."""
    ends = int(low * denominator), int(high * denominator)
    return st.integers(*ends).map(lambda n: Fraction(n, denominator))


@cache
def vectors(low=-4, high=4, denominator: int = 16, size: int = 2) -> st.SearchStrategy[np.ndarray]:
    """Vectors of rationals."""
    return st.tuples(*[numbers(low, high, denominator)] * size).map(lambda x: np.array(x, dtype=object))


@cache
def powers_of_two(low: int = -3, high: int = 3) -> st.SearchStrategy[Fraction]:
    """2^low to 2^high."""
    return st.integers(low, high).map(lambda k: Fraction(2) ** k)


@st.composite
def maps(draw, unimodular: bool = False):
    """Matrices of positive determinant, shape (2, 2); unimodular: up to a factor 2^k shears and quarter turns."""
    quarter = np.array([[Fraction(0), Fraction(-1)], [Fraction(1), Fraction(0)]], dtype=object)
    b, c = draw(numbers(-1, 1, 4)), draw(numbers(-1, 1, 4))
    sizes = powers_of_two() if unimodular else numbers(Fraction(1, 4), 2)
    stretch = np.array([[draw(sizes), Fraction(0)], [Fraction(0), draw(sizes)]], dtype=object)
    shear = np.array([[1, b], [0, 1]], dtype=object) @ np.array([[1, 0], [c, 1]], dtype=object)
    for _ in range(draw(st.integers(0, 3))):
        shear = quarter @ shear
    return shear @ stretch


@st.composite
def triangles(draw, denominator: int = 12):
    """One positively oriented triangle: p, p + u, p + s u + t Qu with t > 0 and Q the quarter turn."""
    any_sign, positive = numbers(-2, 2, denominator), numbers(Fraction(1, 4), 2, denominator)
    p, a, b, s, t = (draw(x) for x in (vectors(denominator=denominator), positive, any_sign, any_sign, positive))
    u, Qu = np.array([a, b], dtype=object), np.array([-b, a], dtype=object)
    points, first = np.array([p, p + u, p + s * u + t * Qu], dtype=object), draw(st.integers(0, 2))
    return Mesh(points=np.roll(points, first, axis=0), cells=np.array([[0, 1, 2]]), sides={})


@st.composite
def lines(draw, most: int = 5, denominator: int = 12):
    """A line in one to `most` unequal cells, nodes in order."""
    steps = draw(st.lists(numbers(Fraction(1, 4), 2, denominator), min_size=1, max_size=most))
    points = draw(numbers(-4, 4, denominator)) + np.cumsum([Fraction(0), *steps])
    nodes = np.arange(len(points))
    sides = {"left": nodes[:1, None], "right": nodes[-1:, None]}
    return Mesh(points=points[:, None], cells=np.column_stack([nodes[:-1], nodes[1:]]), sides=sides)


def renumbered(mesh: Mesh, order) -> Mesh:
    """The same mesh with node order[i] called i."""
    name = np.argsort(order)
    sides = {side: name[facets] for side, facets in mesh.sides.items()}
    return Mesh(points=mesh.points[order], cells=name[mesh.cells], sides=sides)


def in_floats(mesh: Mesh) -> Mesh:
    """The same mesh with its coordinates in floats."""
    return Mesh(points=mesh.points.astype(float), cells=mesh.cells, sides=mesh.sides)


@st.composite
def plane_grids(draw, most: int = 2, least: int = 1, exact: bool = False):
    """What `plane_meshes` are made of: rational points, cells, sides.  It is no mesh yet, which would be judged."""
    nx, ny = draw(st.integers(least, most)), draw(st.integers(least, most))
    grid = rectangle((0.0, float(nx)), (0.0, float(ny)), (nx, ny))
    random = np.random.default_rng(draw(st.integers(0, 2**16)))
    moves = 0 if exact else random.integers(-2, 3, grid.points.shape) * Fraction(1, 16)
    corners = grid.points.astype(int) + Fraction(0)
    points = draw(vectors()) + (corners + moves) @ draw(maps(unimodular=exact)).T
    order = random.permutation(len(points))
    name = np.argsort(order)
    return points[order], name[grid.cells], {side: name[facets] for side, facets in grid.sides.items()}


def plane_meshes(most: int = 2, least: int = 1, exact: bool = False) -> st.SearchStrategy[Mesh]:
    """Grids of `least` to `most` cells a side, each node moved by up to 1/8 cell, mapped linearly, nodes in any order.

    Twice the area of a triangle is at least 1/4 of a cell's.  `exact`: no node is moved, areas are powers of two.
    """
    return plane_grids(most, least, exact).map(lambda grid: Mesh(points=grid[0], cells=grid[1], sides=grid[2]))


def meshes(most: int = 2) -> st.SearchStrategy[Mesh]:
    """Lines and plane meshes."""
    return st.one_of(lines(denominator=16), plane_meshes(most))


@st.composite
def materials(draw, binary: bool = False):
    """Lame parameters with lame_mu > 0 and 3 lame_lambda + 2 lame_mu > 0; `binary`: exact in floats."""
    if not binary:
        return plane_strain(draw(numbers(Fraction(1, 2), 50, 6)), draw(numbers(Fraction(-9, 10), Fraction(9, 20), 20)))
    mu = draw(numbers(Fraction(1, 4), 8, 8))
    return Material(lame_lambda=mu * draw(numbers(Fraction(-5, 8), 8, 8)), lame_mu=mu)


@st.composite
def held_bodies(draw, most: int = 4):
    """A plane mesh and a material in floats, and the unknowns left free by one to three held sides.

    The top keeps a free node: two cells a side at least.
    """
    points, cells, sides = draw(plane_grids(most, least=2))
    mesh, material = Mesh(points=points.astype(float), cells=cells, sides=sides), draw(materials())
    held = draw(st.lists(st.sampled_from(["left", "right", "bottom"]), min_size=1, max_size=3, unique=True))
    known = supports(mesh, {side: [0.0, 0.0] for side in held}).held
    floats = Material(lame_lambda=float(material.lame_lambda), lame_mu=float(material.lame_mu))
    return mesh, floats, np.flatnonzero(~known.ravel())


#: What the profiles for every day ask of a property, at most.
EVERY_DAY = 25

#: What they ask of a property whose examples cost much, at least.
LEAST = 5

#: Whether the profile asks for more than that.
AT_NIGHT = settings.default.max_examples > EVERY_DAY


def fewer(share: int, at_night: int | None = None) -> settings:
    """The profile's number of examples, divided: for examples that cost a dense factorisation or two.

    By `at_night`, where that is given, in profiles that ask for more than those for every day.
    """
    most = settings.default.max_examples
    return settings(max_examples=max(LEAST, most // (at_night if at_night and AT_NIGHT else share)))


# --- end of elastic bodies --------------------------------------------------------------------------------------------
