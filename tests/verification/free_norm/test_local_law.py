"""The local law: in the norm (5.21) one step grows like h^-1/2, spectral radii do not; the numbers of its page."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.special import zeta
from strategies import AT_NIGHT

import verification as vf
from verification.algorithm.affine_piece import Piece
from verification.contact.active_set import Pattern
from verification.free_norm.norm import FreeNorm
from verification.free_norm.radius import radius

THETA, K, NU, DEPTH, LENGTH, SHORTER = 0.7, 0.2, 0.3, 0.3, 2.0, 1.2
PAGE = Path(__file__).parents[3] / "docs" / "local_law.md"

#: |J| >= LAYERS theta k sqrt(d/((1 - nu) h)) for layers, and the energy of a saw-tooth over N/E* for bodies.
LAYERS = math.sqrt(28 * zeta(3) / math.pi**3)
BODIES = math.pi**3 / 32 * (lambda t: 13 * t / 35 + 12 / (5 * t) + 36 / t**3)(3 * math.pi / 2)

#: Contact nodes, by night and by day.
NODES, DAILY = [7, 13, 25, 49], [7, 13, 25]


def section_6(nodes):
    """Section 6 with the local law on matching cells, 10 x 2 and 6 x 2 of them halved."""
    along = nodes - 1
    rows = along // 3
    data = vf.example("section6").to_dict()
    data["body1"]["cells"], data["body2"]["cells"] = [round(along * LENGTH / SHORTER), rows], [along, rows]
    data["contact"]["law"] = "local"
    data["contact"].pop("radius", None)
    return vf.build(vf.Problem.from_dict(data))


def alternating(pair):
    """The derivative of a step where all nodes slide, in alternating directions."""
    n = pair.contact.grid.n
    sliding = np.where(np.arange(n) % 2 == 0, 1, -1).astype(np.int8)
    pattern = Pattern(touching=np.ones(n, bool), sliding=sliding)
    return Piece(pair=pair, pattern=pattern, sign=np.ones(n, np.int8), still=np.zeros(n, bool))


def rows_of(head):
    """The rows of numbers of the page's table with some words in its head."""
    lines = PAGE.read_text("utf-8").splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("|") and head in line)
    found = {}
    for line in lines[first + 2 :]:
        if not line.startswith("|"):
            break
        nodes, *rest = (cell.strip() for cell in line.strip("|").split("|"))
        found[int(nodes)] = [float(cell) if re.fullmatch(r"[\d.]+", cell) else None for cell in rest]
    return found


def test_the_constants_are_those_of_the_best_pressure_and_of_the_stress_field():
    """Sums over waves and quadrature of the stress field, in place of closed forms."""
    odd = 2 * np.arange(100000) + 1
    best = 1 / odd / (4 / np.pi**2 / odd.astype(float) ** 3).sum()
    energy = 0.5 * (best**2 * 2 / (np.pi * odd)).sum()
    assert energy == pytest.approx(math.pi**3 / 14 / zeta(3), rel=1e-6)
    assert 2 / (energy * (1 - NU)) == pytest.approx(LAYERS**2 / (1 - NU), rel=1e-6)
    points, weights = np.polynomial.legendre.leggauss(60)
    x, y = np.meshgrid(points + 1, 0.75 * (points + 1), indexing="ij")
    s = y / 1.5
    F, F2 = (1 + np.cos(np.pi * x)) / 4, -(np.pi**2) * np.cos(np.pi * x) / 4
    b, b2 = 1 - 3 * s**2 + 2 * s**3, (-6 + 12 * s) / 1.5**2
    assert ((F2 * b + F * b2) ** 2 * np.outer(weights, 0.75 * weights)).sum() / 2 == pytest.approx(BODIES, rel=1e-9)


@pytest.mark.parametrize("nodes", NODES if AT_NIGHT else DAILY)
def test_one_step_is_as_long_as_proved_and_as_the_page_says(nodes):
    pair = section_6(nodes)
    assert pair.contact.grid.n == nodes
    piece, h = alternating(pair), SHORTER / (nodes - 1)
    norm = piece.factor(THETA)
    proved = THETA * K * math.sqrt(2 * SHORTER * DEPTH / (BODIES * (1 - NU) * LENGTH * h))
    row = rows_of("share of")[nodes]
    assert [proved, norm, radius(piece.relaxed(THETA))] == pytest.approx([row[0], *row[2:4]], abs=6e-4)
    assert proved <= norm


def test_the_worst_force_is_a_saw_tooth_of_pressure_and_becomes_a_constant_shear():
    pair = section_6(25)
    J, root = alternating(pair).relaxed(THETA), pair.neumann.root
    images, _, forces = np.linalg.svd(J)
    worst, image = root @ forces[0], root @ images[:, 0]
    grid = pair.neumann.grid
    saw = np.where(np.arange(grid.n) % 2 == 0, 1.0, -1.0)
    cosine = lambda x, y: abs(x @ y) / np.linalg.norm(x) / np.linalg.norm(y)
    assert cosine(worst[grid.normal], saw) > 0.99
    assert cosine(image[grid.tangential], np.ones(grid.n)) > 0.98


@pytest.mark.parametrize("nodes", NODES if AT_NIGHT else DAILY[:2])
def test_the_factor_in_the_free_norm_is_what_the_page_says(nodes):
    pair = section_6(nodes)
    found = FreeNorm(pair, vf.measure(pair)).factor(THETA).factor
    assert found == pytest.approx(rows_of("factor in the free norm")[nodes][0], rel=8e-3)
