"""Two equal cylinders, pressed and then sheared: slip zone and shear of Cattaneo and Mindlin, in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from mesh_writer import write_gmsh22
from strategies import AT_NIGHT

import verification as vf

E, NU, RADIUS, FRICTION = 70000.0, 0.3, 1.0, 0.3

#: Half the width of the contact, to which the elements are fitted; bodies reach twenty times as far.
HALF, REACH = 0.02, 20

#: The top goes down by this (as much as makes that contact), and aside by these.
DOWN, ASIDE = "-0.00166", ("0.000255", "0.0005")


def graded(h, fine, growth=1.15):
    """Distances from the contact: of size h where it is fine, then growing."""
    found, step = [0.0], h
    while found[-1] < REACH * HALF:
        step *= growth if found[-1] > fine else 1.0
        found.append(found[-1] + step)
    return np.array(found)


def crossed(path, x, y, bend=0.0):
    """Write rectangles split by both diagonals, so that all nodes of a side are alike and both bodies mirror images.

    The side at y = 0 has this curvature.
    """
    X, Y = np.meshgrid(x, y, indexing="ij")
    Y = Y + bend * X**2 / 2 * (1 - np.abs(Y) / np.abs(y).max())
    middle = lambda A: (A[1:, 1:] + A[:-1, 1:] + A[1:, :-1] + A[:-1, :-1]) / 4
    points = np.concatenate([np.column_stack([A.ravel(), B.ravel()]) for A, B in ((X, Y), (middle(X), middle(Y)))])
    node = np.arange(X.size).reshape(X.shape)
    centre = X.size + np.arange(middle(X).size).reshape(middle(X).shape)
    around = node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]
    cells = [np.stack([around[i], around[i - 3], centre], -1).reshape(-1, 3) for i in range(4)]
    line = lambda nodes: np.column_stack([nodes[:-1], nodes[1:]])
    sides = {"bottom": node[:, 0], "top": node[:, -1], "left": node[0], "right": node[-1]}
    write_gmsh22(path, points, np.concatenate(cells), {name: line(nodes) for name, nodes in sides.items()})
    return str(path)


def pressed_and_sheared(folder, elements, drawn=None):
    """The ends of both steps of shear, with so many elements in half the contact.

    ``drawn`` are the keys of Gamma_c on cylinders that are drawn as such; else the gap alone is theirs.
    """
    h = HALF / elements
    half, depth = graded(h, 1.3 * HALF), graded(h, 0.4 * HALF)
    x, end = np.concatenate([-half[:0:-1], half]), half[half > 1.3 * HALF][0]
    bend = 0.0 if drawn is None else 1 / RADIUS
    low = crossed(folder / "low.msh", x, -depth[::-1], -bend)
    high = crossed(folder / "high.msh", x, depth, bend)
    where = {"interval": [float(-end), float(end)]} if drawn is None else drawn
    step = lambda aside, count: {"increments": count, "body2": {"prescribed": {"top": [aside, DOWN]}}}
    problem = vf.Problem.from_dict({
        "body1": {"mesh": low, "young": E, "poisson": str(NU), "fixed": ["bottom"]},
        "body2": {"mesh": high, "young": E, "poisson": str(NU), "prescribed": {"top": [0, DOWN]}},
        "contact": where | {"friction": str(FRICTION), "law": "local"},
        "iteration": {"theta": "0.5"},
        "step": [step(0, 2), *(step(aside, 1) for aside in ASIDE)],
    })  # fmt: skip
    pair = vf.build(problem)
    if drawn is None:
        gap = pair.interface.contact.x**2 / RADIUS  # x^2 / 2R of each cylinder
        pair = replace(pair, interface=replace(pair.interface, gap=gap))
    found = vf.march(pair)
    assert found.converged
    return h, [each.contact for each in found.increments[2:]]


at_night = pytest.mark.skipif(not AT_NIGHT, reason="finer meshes, three seconds: by night")


#: A straight line with the gap of the cylinders, or the whole sides of cylinders that are drawn.
DRAWN = pytest.mark.parametrize("drawn", [None, {"surface": ["top", "bottom"]}], ids=["gap", "named sides"])


@DRAWN
@pytest.mark.parametrize("elements", [12, pytest.param(14, marks=at_night), pytest.param(20, marks=at_night)])
def test_slip_zone_and_shear_are_those_of_cattaneo_and_mindlin(tmp_path, elements, drawn):
    """Equal cylinders end on a straight line, by symmetry: the normals of one alone would put the shear off by 6 %."""
    h, ends = pressed_and_sheared(tmp_path, elements, drawn)
    ratios = []
    for contact in ends:
        assert set(contact.normal[:, 1]) == {1.0}
        P, T = contact.force["normal"], -contact.force["tangential"]
        a = np.sqrt(4 * P * (RADIUS / 2) * 2 * (1 - NU**2) / (np.pi * E))  # Hertz: E* = E / (2 (1 - nu^2))
        peak, ratio = 2 * P / (np.pi * a), T / (FRICTION * P)
        c = a * np.sqrt(1 - ratio)
        sticks = np.array(contact.status) == "stick"
        assert abs(np.abs(contact.x[sticks]).max() - c) <= h
        inside = lambda r, x=contact.x: np.sqrt(np.maximum(1 - x**2 / r**2, 0))
        exact = FRICTION * peak * (inside(a) - c / a * inside(c))
        off = np.abs(-contact.shear - exact)
        away = (np.abs(np.abs(contact.x) - c) > 0.1 * a) & (np.abs(contact.x) < 0.9 * a)
        assert off[away].max() <= 0.01 * FRICTION * peak
        ratios.append(ratio)
    assert 0.3 < ratios[0] < 0.5
    assert 0.6 < ratios[1] < 0.75
