"""Hypothesis strategies for problems, pairs, forces and relaxation factors: every case drawn is valid.

Dictionaries have the keys of a problem file; ``Problem.from_dict`` takes them.  Nothing is held on Gamma_c.  Strategies
that many cases ask for are kept, because hypothesis examines each new one.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from typing import Any, Literal

import numpy as np
from hypothesis import strategies as st

from fem1d2d.mesh import Floats
from verification.interface.build import build
from verification.interface.friction import hat
from verification.interface.pair import ContactPair
from verification.problem import Problem

Numbers = st.SearchStrategy[Fraction]

SEEDS = st.integers(0, 2**32 - 1)


@cache
def log_uniform(low: float, high: float, digits: int = 7) -> st.SearchStrategy[Fraction]:
    """Rationals of a few digits between 10^low and 10^high, even in the exponent."""
    return st.floats(low, high).map(lambda exponent: Fraction(f"{10**exponent:.{digits - 1}e}"))


@cache
def thetas() -> st.SearchStrategy[Fraction]:
    """0 < theta < 1, also next to 0 and 1."""
    small = log_uniform(-12, -0.01)
    return st.one_of(st.integers(1, 99).map(lambda n: Fraction(n, 100)), small, small.map(lambda t: 1 - t))


THICKNESS = ["1/50", "1/20", "1/6", "1/3", "1", "2"]


def decimals(low: float, high: float) -> st.SearchStrategy[Fraction]:
    """Rationals of three digits between 10^low and 10^high, even in the exponent."""
    return log_uniform(low, high, digits=3)


@cache
def strains(largest: str = "1/20") -> st.SearchStrategy[Fraction]:
    """Small numbers of either sign, often zero."""
    return st.one_of(st.just(Fraction(0)), st.integers(-20, 20).map(lambda i: Fraction(i, 20) * Fraction(largest)))


@cache
def youngs() -> st.SearchStrategy[tuple[Fraction, Fraction]]:
    """E1, E2 between 1e-2 and 1e10, ratio within 1/50 to 50; equal moduli are common."""
    ratio = st.one_of(st.just(Fraction(1)), st.sampled_from([Fraction(1, 50), Fraction(50)]), decimals(-1.69, 1.69))
    return st.tuples(decimals(-0.3, 8.3), ratio).map(lambda pair: (pair[0], pair[0] * pair[1]))


@st.composite
def supports_and_loads(
    draw: st.DrawFn, far: str, clear: list[str], young: Fraction, height: Fraction, length: Fraction
) -> dict[str, Any]:
    """Gamma_u and the loads of a rectangle: ``far`` lies opposite Gamma_c, the sides ``clear`` do not touch it.

    Every choice leaves no rigid motion: a whole side held, or rollers on two.
    """
    kinds = ["clamped", "clamped", "moved"]
    if clear:
        kinds += ["side", "corner", "rollers"]
    if len(clear) == 2:
        kinds.append("both sides")
    kind = draw(st.sampled_from(kinds))
    side = draw(st.sampled_from(clear)) if clear else ""
    slip, push = draw(strains()) * height, draw(strains()) * height
    fixed: list[str] = []
    prescribed: dict[str, list[Any]] = {}
    if kind == "clamped":
        fixed = [far]
    elif kind == "moved":
        prescribed = {far: [slip, push]}
    elif kind == "side":
        fixed = [side]
    elif kind == "corner":
        fixed = [side, far]
    elif kind == "both sides":
        fixed = ["left", "right"]
    else:
        prescribed = {far: ["free", push], side: [slip, "free"]}
    held: dict[str, tuple[bool, ...]] = dict.fromkeys(fixed, (True, True))
    held |= {name: tuple(v != "free" for v in values) for name, values in prescribed.items()}
    traction = {}
    loaded = ["left", "right", *(["bottom", "top"] if clear else [far])]  # a side that is all Gamma_c takes no traction
    for name in draw(st.lists(st.sampled_from(loaded), max_size=2, unique=True)):
        force = [Fraction(0) if h else young * draw(strains()) for h in held.get(name, (False, False))]
        traction[name] = force
    body_force = [young / length * draw(strains()) for _ in range(2)]
    return {"fixed": fixed, "prescribed": prescribed, "traction": traction, "body_force": body_force}


@st.composite
def plane_problems(
    draw: st.DrawFn,
    friction: Numbers | None = None,
    law: str | None = None,
    theta: Numbers | None = None,
    most_cells: int = 6,
    varying: bool = False,
) -> dict[str, Any]:
    """Two rectangles whose grids match; body 1 wider, equal or narrower, offset by whole cells.

    By default friction is 0 to 1, and the law mostly the non-local one; the discrete inequalities hold for the local
    one as well.  With ``varying`` it is mostly a table along Gamma_c, whose largest value may lie beside the nodes.
    """
    h = draw(st.sampled_from([Fraction(1, 20), Fraction(1, 4), Fraction(1), Fraction(30)]))
    n1, n2 = draw(st.integers(1, most_cells)), draw(st.integers(1, most_cells))
    shift = draw(st.one_of(st.just(0), st.integers(1 - n2, n1 - 1)))  # left end of body 2, in cells of body 1
    low, high = max(0, shift), min(n1, shift + n2)
    begin = draw(st.integers(low, high - 1))
    end = draw(st.integers(begin + 1, high))
    if draw(st.booleans()):
        begin, end = low, high
    origin = draw(st.sampled_from([Fraction(0), Fraction(-3, 7)]))
    x = lambda i: origin + h * i
    young = draw(youngs())
    bodies = []
    for first, cells, far, E in ((0, n1, "bottom", young[0]), (shift, n2, "top", young[1])):
        clear = [s for s, apart in (("left", begin > first), ("right", end < first + cells)) if apart]
        length = h * cells
        height = length * Fraction(draw(st.sampled_from(THICKNESS)))
        bodies.append(
            {
                "shape": "rectangle",
                "x": [x(first), x(first + cells)],
                "y": [-height, 0] if far == "bottom" else [0, height],
                "cells": [cells, draw(st.integers(1, 3))],
                "young": E,
                "poisson": Fraction(draw(st.sampled_from(["-0.5", "0", "0.3", "0.3", "0.45"]))),
                **draw(supports_and_loads(far, clear, E, height, length)),
            }
        )
    span = h * (end - begin)
    k: Any = draw(st.integers(0, 10).map(lambda i: Fraction(i, 10)) if friction is None else friction)
    if varying and draw(st.integers(0, 3)):
        inner = draw(st.lists(st.integers(1, 7), max_size=2, unique=True).map(sorted))
        s = [Fraction(0), *(span * i / 8 for i in inner), span]
        k = {"s": s, "k": [k * draw(st.sampled_from([0, Fraction(1, 3), 1])) for _ in s]}
    return {
        "dimension": 2,
        "body1": bodies[0],
        "body2": bodies[1],
        "contact": {
            "interval": [x(begin), x(end)],
            "friction": k,
            "law": draw(st.sampled_from(["nonlocal", "nonlocal", "nonlocal", "local"])) if law is None else law,
            "radius": draw(st.sampled_from([h / 2, h * Fraction(3, 2), span])),
            "gap": draw(st.sampled_from([Fraction(0), h / 1000, h / 30])),
        },
        "iteration": {
            "neumann_body": draw(st.sampled_from([1, 2])),
            "theta": draw(thetas() if theta is None else theta),
        },
        "norm": {"length": h * draw(st.sampled_from([Fraction(1, 2), Fraction(4), Fraction(100)]))},
    }


@st.composite
def bar_problems(draw: st.DrawFn) -> dict[str, Any]:
    """Two bars that meet at a point, both ends held, with body forces."""
    a, b = draw(decimals(-1.5, 1)), draw(decimals(-1.5, 1))
    origin = draw(st.sampled_from([Fraction(0), Fraction(-5, 3)]))
    young = draw(youngs())
    bodies = []
    for ends, side, E in (([origin - a, origin], "left", young[0]), ([origin, origin + b], "right", young[1])):
        length = ends[1] - ends[0]
        body: dict[str, Any] = {"shape": "interval", "x": ends, "cells": draw(st.integers(1, 5)), "young": E}
        body |= draw(st.sampled_from([{"fixed": [side]}, {"prescribed": {side: length * draw(strains("1/5"))}}]))
        bodies.append(body | {"body_force": E / length * draw(strains("1/5"))})
    return {
        "dimension": 1,
        "body1": bodies[0],
        "body2": bodies[1],
        "contact": {"gap": draw(st.sampled_from([Fraction(0), a / 100]))},
        "iteration": {"neumann_body": draw(st.sampled_from([1, 2])), "theta": draw(thetas())},
        "norm": {"length": draw(decimals(-1, 2))},
    }


def contact_problems(**plane: Any) -> st.SearchStrategy[dict[str, Any]]:
    """Mostly in two dimensions."""
    return st.integers(0, 5).flatmap(lambda i: bar_problems() if i == 5 else plane_problems(**plane))


def problems(**plane: Any) -> st.SearchStrategy[Problem]:
    """Problems, mostly in two dimensions; keywords are those of :func:`plane_problems`."""
    return contact_problems(**plane).map(Problem.from_dict)


# --- pairs and forces -------------------------------------------------------------------------------------------------


def positive_definite(random: np.random.Generator, size: int) -> Floats:
    """A symmetric positive definite matrix of condition some ten, as of a body with few contact nodes."""
    A = random.normal(size=(size, size))
    return np.asarray(A @ A.T + size * np.eye(size) / 2)


@st.composite
def matrix_pairs(draw: st.DrawFn, *, friction: Numbers | None = None, most_nodes: int = 4) -> ContactPair:
    """Pairs made from random matrices, loads, gaps and kernels, in both roles.

    Friction is by default 0 to 1, often 0.  Grids that differ have a random transfer that carries a constant exactly.
    """
    n = m = draw(st.integers(1, most_nodes))
    differ = draw(st.booleans())
    if differ:
        m = draw(st.integers(1, most_nodes))
    role: Literal[1, 2] = draw(st.sampled_from([1, 2]))
    k = draw(
        st.sampled_from([Fraction(0), Fraction(1, 10), Fraction(1, 2), Fraction(1)]) if friction is None else friction
    )
    stiff = 2.0 ** draw(st.integers(-3, 3))
    gap = draw(st.sampled_from([0.0, 0.05, 1e3]))  # closed, open in places, open everywhere
    radius = draw(st.sampled_from([0.2, 0.5, 2.0]))
    random = np.random.default_rng(draw(SEEDS))
    sizes = (2 * n, 2 * m) if role == 2 else (2 * m, 2 * n)
    x, y = np.sort(random.uniform(0, 1, n)), np.linspace(0, 1, m)
    transfer = None
    if differ:
        transfer = random.uniform(-0.1, 1, (n, m))
        transfer /= transfer.sum(axis=1, keepdims=True)
    return build(
        S1=stiff * positive_definite(random, sizes[0]),
        S2=positive_definite(random, sizes[1]),
        load1=stiff * random.normal(size=sizes[0]),
        load2=random.normal(size=sizes[1]),
        x=x,
        gap=gap * random.uniform(0, 1, n),
        kernel=hat(x[:, None] - (y if differ else x)[None, :], radius),
        transfer=transfer,
        friction=k,
        neumann_body=role,
    )


def mesh_pairs(**plane: Any) -> st.SearchStrategy[ContactPair]:
    """Pairs of small meshes in one and two dimensions; keywords are those of :func:`plane_problems`."""
    return problems(**({"most_cells": 3} | plane)).map(build)


def pairs(*, friction: Numbers | None = None) -> st.SearchStrategy[ContactPair]:
    """Pairs of every kind: from matrices and from small meshes, with and without friction, in both roles.

    Friction is by default 0 to 1; bars have none.
    """
    return st.one_of(matrix_pairs(friction=friction), mesh_pairs(friction=friction))


def force_scale(pair: ContactPair) -> float:
    """A force that is typical of a pair: of the order of its loads."""
    sides, interface = (pair.contact, pair.neumann), pair.interface
    loads = max(float(np.abs(side.load).max()) for side in sides)
    closing = min(float(np.abs(side.schur).max()) for side in sides) * float(interface.gap.max())
    return loads or closing or float(np.abs(pair.neumann.schur).max())


@st.composite
def forces(draw: st.DrawFn, pair: ContactPair) -> Floats:
    """Nodal forces on the Neumann body of a pair, from much smaller to much larger than its loads."""
    random, exponent = np.random.default_rng(draw(SEEDS)), draw(st.integers(-3, 3))
    size = force_scale(pair) * 10.0**exponent
    return np.asarray(size * random.normal(size=pair.neumann.grid.size))
