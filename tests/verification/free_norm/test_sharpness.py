"""How sharp the circle criterion is: no piece of T_theta beats its factor, and the table of docs/layers.md."""

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from common_norms import CommonNorm, different, symmetries
from periodic import SECTION_6, drawn
from sequences import Sequences, digits, piece, regular
from strategies import AT_NIGHT

import verification as vf
from verification.free_norm.cells import NEAR, CellCircles
from verification.free_norm.norm import FreeNorm
from verification.semidefinite.neighbours import squared
from verification.semidefinite.pattern_search import worst_piece

#: Layers that are drawn, and starts of each search.
DRAWS, STARTS = (200, 6) if AT_NIGHT else (2, 2)

#: Half a unit of the third digit of a number in the table, and a little more.
ROUNDED = 6e-4


class Row(NamedTuple):
    """The best patterns that long searches found on the cells of Section 6: among regular ones, one, and several."""

    regular: str
    one: str
    several: str
    moved: int  # nodes by which the several move each time


FOUND = {
    (0.2, 0.4): Row("142", "122004143411", "534442221415 214115504442 241445221445", 0),
    (0.2, 0.6): Row("152", "143411122004", "252111552044 552111552344 555044225211", 0),
    (0.2, 0.7): Row("152", "200414341112", "504425254115 251455221445 221155534442", 0),
    (0.2, 0.8): Row("521", "041434111220", "235445554444 311312524444 104300331441 524444555145", 6),
    (0.9, 0.4): Row("14", "112225352500", "155344422411", 6),
    (0.9, 0.6): Row("14", "122004143411", "222511555344", 6),
    (0.9, 0.7): Row("14", "141414141414", "115553442225", 6),
    (0.9, 0.8): Row("14", "141414141414", "155552244113 555224411315", 4),
    (1.6, 0.4): Row("25", "252525252525", "241155504422", 6),
    (1.6, 0.6): Row("25", "252525252525", "442555115324 115553442555", 6),
    (1.6, 0.7): Row("25", "141414141414", "511553144555 234125521555", 6),
    (1.6, 0.8): Row("14", "141414141414", "111142552523 522214201414", 10),
}


def table(columns: int) -> dict[tuple[float, float], list[float]]:
    """The numbers of the table of docs/layers.md with so many columns: of each k and theta."""
    page = (Path(__file__).parents[3] / "docs" / "layers.md").read_text("utf-8")
    lines = page.partition("## How sharp is it?")[2].partition("\n## ")[0].splitlines()
    rows = [line.strip("|").split("|") for line in lines if line.startswith(("| 0.", "| 1."))]
    numbers = [[float(cell) for cell in row] for row in rows if len(row) == columns]
    return {(k, theta): values for k, theta, *values in numbers}


@pytest.mark.parametrize("seed", range(3))
def test_jacobians_of_many_pieces_at_once_are_those_of_each(seed):
    random = np.random.default_rng(seed)
    mesh, k, theta = drawn(seed)
    pair, patterns = mesh.pair(k), random.integers(0, 6, (20, mesh.columns))
    found = Sequences(pair, theta).jacobians(patterns)
    for J, pattern in zip(found, patterns, strict=True):
        expected = theta * piece(pair, pattern).force + (1 - theta) * np.eye(len(J))
        np.testing.assert_allclose(J, expected, atol=1e-9 * np.abs(expected).max())


def test_pieces_that_move_are_a_longer_sequence_of_pieces():
    """The diagonals repeat after two columns."""
    random, pair = np.random.default_rng(3), SECTION_6.pair(0.9)
    patterns = random.integers(0, 6, (2, SECTION_6.columns))
    moved = Sequences(pair, 0.7, moved=4)
    there = [np.roll(patterns, -4 * i, axis=1) for i in range(3)]
    assert moved.radius(patterns) == pytest.approx(Sequences(pair, 0.7).radius(np.vstack(there)), rel=1e-9)


@pytest.mark.parametrize("seed", range(2000, 2000 + DRAWS))
def test_no_sequence_of_pieces_beats_the_factor_and_no_piece_does_in_its_norm(seed):
    mesh, k, theta = drawn(seed, columns=(6, 8))
    pair, random = mesh.pair(k), np.random.default_rng(seed)
    proved = FreeNorm(pair, vf.measure(pair)).factor(theta)
    if proved is None:
        return
    step = lambda found: squared(theta * found.force + (1 - theta) * found.g, proved.norm.matrix)
    worst = worst_piece(pair, step, random=random, gram=proved.norm.matrix).value ** 0.5
    assert worst <= proved.factor
    still, moving = Sequences(pair, theta), Sequences(pair, theta, moved=2)
    radii = [still.radius(pattern[None]) for pattern in regular(mesh.columns, 2)]
    for one, length in ((still, 1), (moving, 1), (still, 2)):
        radii.append(one.search(random, length=length, starts=STARTS)[1])
    assert max(radii) <= proved.factor


@pytest.mark.parametrize("given", FOUND, ids=str)
def test_the_table_has_the_radii_of_the_patterns_that_were_found(given):
    k, theta = given
    pair, row = SECTION_6.pair(k), FOUND[given]
    still, moving = Sequences(pair, theta), Sequences(pair, theta, moved=row.moved)
    repeated = digits(row.regular * SECTION_6.columns)[:, : SECTION_6.columns]
    factor, *radii = table(6)[given]
    found = [still.radius(repeated), still.radius(digits(row.one)), moving.radius(digits(row.several))]
    assert radii == pytest.approx(found, abs=ROUNDED)
    assert radii == sorted(radii)
    assert max(radii) < factor


@pytest.mark.parametrize("given", list(FOUND) if AT_NIGHT else list(FOUND)[2::11], ids=str)
def test_the_table_has_the_factors_of_the_mesh(given):
    k, theta = given
    found = CellCircles(SECTION_6.cells, SECTION_6.radius / SECTION_6.width, k, SECTION_6.phases).factor(theta)
    assert table(6)[given][0] == pytest.approx(found, abs=ROUNDED + NEAR * found)


@pytest.mark.parametrize("given", list(FOUND) if AT_NIGHT else list(FOUND)[1::11], ids=str)
def test_a_new_search_finds_less_than_the_factor(given):
    k, theta = given
    pair, random, factor = SECTION_6.pair(k), np.random.default_rng(0), table(6)[given][0]
    patterns = regular(SECTION_6.columns, 3)
    one = Sequences(pair, theta)
    best = max(patterns, key=lambda pattern: one.radius(pattern[None]))
    assert one.radius(best[None]) == pytest.approx(table(6)[given][1], abs=ROUNDED)
    assert one.climb(best[None])[1] < factor
    for moved, length in ((0, 1), (2, 1), (6, 1), (0, 2), (2, 2)):
        assert Sequences(pair, theta, moved=moved).search(random, length=length, starts=STARTS)[1] < factor


def test_different_patterns_and_their_images_are_all():
    patterns = different(4)
    mirrored = np.array([0, 2, 1, 3, 5, 4])[np.roll(patterns[:, ::-1], 1, axis=1)]
    images = [np.roll(some, 2 * i, axis=1) for some in (patterns, mirrored) for i in range(2)]
    assert len(np.unique(np.vstack(images), axis=0)) == 6**4
    pair = replace(SECTION_6, columns=4, period=0.2).pair(0.9)
    J = Sequences(pair, 0.7).jacobians(np.vstack([patterns[:30], mirrored[:30]]))
    move = symmetries(4)[2]  # the reflection
    np.testing.assert_allclose(J[30:], move @ J[:30] @ move.T, atol=1e-9 * np.abs(J).max())


@pytest.mark.skipif(not AT_NIGHT, reason="half a minute each: by night")
@pytest.mark.parametrize("given", table(5), ids=str)
def test_on_six_columns_a_quadratic_norm_proves_more_than_the_multipliers(given):
    """By programs for a few dozen pieces, and |J|_Q of all."""
    k, theta = given
    mesh = replace(SECTION_6, columns=6, period=0.3)
    pair, random = mesh.pair(k), np.random.default_rng(0)
    factor = CellCircles(mesh.cells, mesh.radius / mesh.width, k, mesh.phases).factor(theta)
    low, best = CommonNorm(pair, theta).least(1 - theta, 1.02 * factor)
    kinds = [(1, 0), (1, 2), (2, 0), (2, 2), (3, 0)]
    product = max(Sequences(pair, theta, moved=moved).search(random, length=m, starts=20)[1] for m, moved in kinds)
    assert product < best < factor
    assert best <= low * 1.006
    by_multipliers, by_norm, by_product = table(5)[given]
    assert by_multipliers == pytest.approx(factor, abs=ROUNDED + NEAR * factor)
    assert by_norm == pytest.approx(best, rel=6e-3)
    assert by_product == pytest.approx(product, abs=2e-3)
