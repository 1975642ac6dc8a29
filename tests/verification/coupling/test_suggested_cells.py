"""Cells that the advice suggests: they mirror on the meshes themselves, have a smaller rho there, and only then."""

from __future__ import annotations

from fractions import Fraction
from functools import cache

import numpy as np
import pytest
from halved_blocks import blocks, halved_by_hand
from strategies import AT_NIGHT

import verification as vf
from ndtheory import Number
from verification.constants.cells import halved_cells, rho_of_cells
from verification.coupling.cells import GAIN, Suggested, suggest

F = Fraction


def drawn(seed: int) -> vf.Problem:
    """A block on a longer one that it may overlap by any sixteenth, in drawn cells and roles."""
    random = np.random.default_rng(seed)
    counts = lambda: (int(random.choice([4, 6, 8, 12])), int(random.integers(1, 9)))
    return blocks(
        cells=((2 * counts()[0], counts()[1]), counts()),
        offset=str(F(int(random.integers(-8, 9)), 16)),
        iteration={"neumann_body": int(random.integers(1, 3))},
    )


SEEDS = range(200 if AT_NIGHT else 6)
LOW = Number.of_float(0.0)  # as if nothing but the cells decided rho
NAMES = ("rho_cells", "rho_normal_cells")


@cache
def suggested(seed: int, normal: bool) -> Suggested:
    return suggest(drawn(seed), LOW, normal=normal)


def test_some_problems_have_better_cells_and_some_have_none():
    found = [suggested(seed, normal) for seed in SEEDS for normal in (True, False)]
    assert len(SEEDS) / 2 <= sum(each.cells is not None for each in found) < 2 * len(SEEDS)


@pytest.mark.parametrize("normal", [True, False])
@pytest.mark.parametrize("seed", SEEDS)
def test_suggested_cells_have_one_shape_and_mirror_on_the_mesh_halved_or_not(seed, normal):
    problem, found = drawn(seed), suggested(seed, normal)
    if found.cells is None:  # how many have none is asked above
        return
    better = problem.changed(cells=found.cells)
    layers = halved_cells(better)
    assert layers.matching
    assert layers.contact.rising == layers.neumann.rising
    # rows are whole numbers, so that the shapes may differ a little
    assert 0.7 <= layers.contact.aspect / layers.neumann.aspect <= 1 / 0.7
    own, other = (rho_of_cells(p).numbers[NAMES[normal]].value for p in (problem, better))
    assert own > (1 + GAIN) * other
    assert found.found.numbers[NAMES[normal]].value == other
    assert halved_by_hand(better) == (True, True)
    assert halved_by_hand(better, halvings=0) == (True, True)


@pytest.mark.parametrize("normal", [True, False])
def test_fine_meshes_of_the_suggested_cells_have_the_smaller_rho(normal):
    """Section 6 with moduli exchanged, cells twice as high as wide in the upper body: 4.52 and 3.5."""
    tall = vf.example("section6").changed(young=(20000, 70000), friction=0, cells=((40, 6), (24, 3)), neumann_body=1)
    role = vf.advise(tall if normal else tall.changed(friction="0.2", radius="0.1")).roles[0]
    better = tall.changed(cells=role.cells.cells)
    name = "rho_normal" if normal else "rho_max"
    own, other = (getattr(vf.measure(p.refined(1)), name).value for p in (tall, better))
    assert own == pytest.approx(role.cells.value(role.cells.of_file).value, rel=2e-3)
    assert own > 1.2 * other
    assert other == pytest.approx(role.cells.value(role.cells.found).value, rel=0.02 if normal else 0.1)


def test_nothing_is_suggested_where_long_waves_or_the_ends_decide_or_cells_have_one_shape_already():
    upper = vf.example("section6").changed(cells=((40, 6), (24, 3)), neumann_body=2)
    role = vf.advise(upper).roles[0]
    assert role.cells.cells is None
    assert "ends of Gamma_c" in role.to_dict()["reason"]["cells"]
    for role in vf.advise(vf.example("section6")).roles:
        assert role.to_dict()["cells"] is None
    assert suggest(vf.example("section6"), LOW, normal=False).cells is None


def test_cells_wider_than_high_are_suggested_where_nu_is_above_a_third_and_have_the_smaller_rho_on_fine_meshes():
    square = lambda nu, **changes: vf.example("section6").changed(poisson=(nu, nu), **changes)
    found = suggest(square("0.4"), LOW, normal=False)
    assert found.cells == ((40, 12), (24, 12))
    assert found.found.numbers["rho_cells"].value == pytest.approx(2 / 7 * 1.4)  # that of half-planes without cells
    better = square("0.4", cells=found.cells)
    own, other = (vf.measure(problem).rho_max.value for problem in (square("0.4"), better))
    assert own > 1.15 * other
    assert suggest(square("1/3"), LOW, normal=False).cells is None
    stress = square("0.4").to_dict() | {"plane": "stress"}  # as bodies of plane strain with nu = 2/7
    assert suggest(vf.Problem.from_dict(stress), LOW, normal=False).cells is None


def test_the_screen_names_nu_where_it_asks_for_cells_wider_than_high():
    said = str(vf.advise(vf.example("section6").changed(poisson=("0.4", "0.4"))).sections())
    assert "with cells [40, 12], [24, 12] fine meshes have rho >= 0.400, not >= 0.457 (nu = 0.4 > 1/3)" in said


def test_a_role_that_is_refused_has_neither_and_the_reason():
    sliding = blocks(
        cells=((16, 4), (8, 2)), body2={"prescribed": {"top": ["free", "-0.01"]}}, iteration={"neumann_body": 2}
    )
    refused, other = (role.to_dict() for role in vf.advise(sliding).roles)
    for name in (*NAMES, "cells"):
        assert refused[name] is None
        assert "refused" in refused["reason"][name]
    assert other["rho_cells"]["value"] > 0


def test_where_bodies_are_known_by_matrices_the_keys_are_left_out():
    document = vf.advise_matrices(np.diag([2.0, 3.0]), np.eye(2)).to_dict()
    assert not {"rho_cells", "cells"} & set(document["roles"][0])
