"""rho of the cells of a problem: against measured rho on ever finer meshes, and where there is none."""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from halved_blocks import blocks, halved_by_hand
from scipy.linalg import eigh
from strategies import AT_NIGHT

import verification as vf
from fem1d2d import plane_strain
from fem1d2d.layers import FacingLayers, Layer, peaks
from fem1d2d.proofs.layers_proved import HalfPlane, enclosed_ratio
from verification.constants.cells import halved_cells, rho_of_cells

F = Fraction
ASPECTS = (F(1, 4), F(1, 2), F(1), F(2), F(4))


def normal(S: np.ndarray) -> np.ndarray:
    """The tangential components, which come first, condensed out."""
    n = len(S) // 2
    return S[n:, n:] - S[n:, :n] @ np.linalg.solve(S[:n, :n], S[:n, n:])


class Family(NamedTuple):
    """Meshes of a contact body of length 1 on a Neumann body of length 2, cells of both in columns of one width."""

    aspects: tuple[Fraction, Fraction]  # of the contact body and of the Neumann body
    poisson: tuple[str, str]
    young: str  # of the contact body; the Neumann body has 1
    neumann_body: int
    mirrored: bool

    @classmethod
    def drawn(cls, seed: int) -> Family:
        random = np.random.default_rng(seed)
        nu = lambda: str(random.choice(["0", "0.1", "0.2", "0.3", "0.4", "0.45", "0.49"]))
        aspects = tuple(ASPECTS[i] for i in random.integers(0, len(ASPECTS), 2))
        neumann_body = int(random.integers(1, 3))
        return cls(
            aspects, (nu(), nu()), str(random.choice(["1/4", "1", "3"])), neumann_body, bool(random.random() < 0.5)
        )

    def problem(self, columns: int) -> vf.Problem:
        """The mesh with so many columns on Gamma_c, a multiple of 8."""
        beyond = columns // 2 if self.mirrored else columns // 2 + 1
        bodies = []
        ends = ((F(0), F(1), columns), (F(-beyond, columns), F(beyond, columns) + 1, columns + 2 * beyond))
        for (left, right, count), aspect, nu, young in zip(
            ends, self.aspects, self.poisson, (self.young, "1"), strict=True
        ):
            rows = int(columns * aspect)  # an even number, as high as Gamma_c is long
            body = {"shape": "rectangle", "x": [str(left), str(right)], "cells": [count, rows]}
            bodies.append((body | {"young": young, "poisson": nu}, rows / aspect / columns))
        if self.neumann_body == 1:
            bodies.reverse()
        (lower, d_1), (upper, d_2) = bodies
        lower |= {"y": [str(-d_1), 0], "fixed": ["bottom"]}
        upper |= {"y": [0, str(d_2)], "prescribed": {"top": [0, "-0.01"]}}
        contact, iteration = {"friction": 0}, {"neumann_body": self.neumann_body}
        tables = {"body1": lower, "body2": upper, "contact": contact, "iteration": iteration}
        return vf.Problem.from_dict({"dimension": 2} | tables)

    def measured(self, columns: int) -> np.ndarray:
        """rho and rho_N of that mesh, from its Schur complements."""
        pair = vf.build(self.problem(columns))
        S_c, S_n = pair.contact.schur, pair.neumann.schur
        top = lambda a, b: eigh(a, b, eigvals_only=True)[-1]
        return np.array([top(S_c, S_n), top(normal(S_c), normal(S_n))])

    @property
    def interface(self) -> FacingLayers:
        """Half-planes of the cells."""
        layers = [
            Layer(material=plane_strain(float(F(young)), float(nu)), aspect=float(aspect), rising=rising)
            for young, nu, aspect, rising in zip(
                (self.young, "1"), self.poisson, self.aspects, (True, self.mirrored), strict=True
            )
        ]
        return FacingLayers(contact=layers[0], neumann=layers[1])

    @property
    def predicted(self) -> np.ndarray:
        """rho and rho_N of the cells, from the geometry."""
        return np.array([peak.ratio for peak in peaks(self.interface)])

    @property
    def limit(self) -> np.ndarray:
        """``(G_c/G_n) kappa_n`` and ``E*_c/E*_n``: long waves on half-planes, whatever the cells."""
        (c, n), young = map(F, self.poisson), F(self.young)
        return np.array([float(young * (1 + n) / (1 + c) * (3 - 4 * n)), float(young * (1 - n**2) / (1 - c**2))])


#: Columns along Gamma_c of both meshes of a family; 1/columns^2 is the order of what short waves miss.
COLUMNS = (64, 128) if AT_NIGHT else (32, 64)

#: By day some of those in which short waves decide, of each kind and with few cells.
FAMILIES = [Family.drawn(seed) for seed in (range(200) if AT_NIGHT else (11, 15, 21, 24, 30, 33, 38))]


@cache
def measured(family: Family) -> np.ndarray:
    """rho and rho_N on both meshes, shape (2, 2)."""
    return np.array([family.measured(columns) for columns in COLUMNS])


@pytest.mark.parametrize("family", [family for family in FAMILIES if "0.49" not in family.poisson], ids=str)
def test_where_a_short_wave_decides_rho_of_fine_meshes_tends_to_that_of_their_cells_from_below(family):
    """Elsewhere rho of the bodies decides, and may be larger: 0.31 of one family at night, 0.3 for its cells.

    Blocks that are nearly incompressible have long waves with larger ratios still, or need finer meshes: with a Poisson
    ratio of 0.49 three of 200 families at night lay above their cells, or 1.2 % below on 128 columns.

    Waves like those of half-planes are short against the body and long against the cells.  Where the largest ratio is
    theirs, or nearly so, rho approaches it more slowly and is not extrapolated here.
    """
    cells, found = np.maximum(family.predicted, family.limit), measured(family)
    short = family.predicted > 1.1 * family.limit
    assert (found[-1] <= cells * (1 + 2e-3))[short].all()
    extrapolated = found[-1] + (found[-1] - found[-2]) / 3
    assert extrapolated[short] == pytest.approx(cells[short], rel=2e-3)


@pytest.mark.skipif(not AT_NIGHT, reason="ten seconds and more for each family: at night")
@pytest.mark.parametrize("family", FAMILIES[:4], ids=str)
def test_the_enclosure_of_a_family_is_as_narrow_as_1e_9_and_lies_at_the_value_in_doubles(family):
    """Long waves have about six digits in doubles."""
    young = (F(family.young), F(1))
    bodies = [
        HalfPlane(aspect=aspect, shear=E / 2 / (1 + F(nu)), poisson=F(nu))
        for aspect, E, nu in zip(family.aspects, young, family.poisson, strict=True)
    ]
    layers = family.interface
    for normal, (peak, least) in enumerate(zip(peaks(layers, rounds=6), family.limit, strict=True)):
        lo, hi = enclosed_ratio(*bodies, peak.phase, mirrored=family.mirrored, normal=bool(normal))
        assert 0 < hi - lo <= 1e-9 * lo
        assert max(peak.ratio, least) == pytest.approx(lo, rel=3e-6)


def test_the_families_have_short_waves_that_decide_in_either_role_with_diagonals_that_mirror_or_not():
    deciding = [family for family in FAMILIES if (family.predicted > 1.1 * family.limit).any()]
    assert len(deciding) >= len(FAMILIES) / 2
    assert {(family.neumann_body, family.mirrored) for family in deciding} == {
        (b, m) for b in (1, 2) for m in (True, False)
    }


@pytest.mark.parametrize("family", [family for family in FAMILIES if family.mirrored][:10], ids=str)
def test_the_cells_of_a_file_are_those_of_its_mesh(family):
    found = rho_of_cells(family.problem(8)).numbers
    least = np.maximum(family.predicted, family.limit)
    assert [number.value for number in found.values()] == pytest.approx(least, rel=1e-6)


# --- which cells a file has once it is halved -------------------------------------------------------------------------


@pytest.mark.parametrize("offset", ["0", "1/8", "1/16", "3/16", "1/4"])
@pytest.mark.parametrize("rows", [3, 4])
def test_diagonals_mirror_after_one_halving_as_the_meshes_show(offset, rows):
    problem = blocks(offset=offset, cells=((16, rows), (8, 5)))
    interface = halved_cells(problem)
    matching, mirrored = halved_by_hand(problem)
    assert matching
    assert interface.matching
    assert (interface.contact.rising == interface.neumann.rising) == mirrored == (offset not in ("1/16", "3/16"))


def test_grids_that_differ_have_the_ratio_of_their_columns():
    interface = halved_cells(blocks(cells=((16, 4), (12, 4)), offset="1/48"))
    assert interface.columns == (6, 4)
    # contact nodes at k/24 - 23/48, Neumann nodes at j/16 - 1
    assert interface.offset == pytest.approx(-((25 / 48) % (1 / 16)) * 24)


def measured_apart(problem: vf.Problem) -> np.ndarray:
    """rho and rho_N of a mesh with a transfer."""
    pair = vf.build(problem)
    P, S_c, S_n = pair.interface.transfer, pair.contact.schur, pair.neumann.schur
    both = np.kron(np.eye(2), P)
    pairs = ((both.T @ S_c @ both, S_n), (P.T @ normal(S_c) @ P, normal(S_n)))
    return np.array([eigh(*matrices, eigvals_only=True)[-1] for matrices in pairs])


@pytest.mark.parametrize(
    ("cells", "offset", "short"),
    [
        (((16, 8), (12, 8)), "0", [1]),  # 3 columns of the contact body face 2; rho is that of long waves
        (((16, 8), (4, 4)), "0", [0, 1]),  # 1 faces 2
        (((16, 8), (8, 8)), "1/24", [1]),  # columns of one width, shifted by a third and, halved again, by two thirds
    ],
)
def test_with_a_transfer_rho_on_meshes_tends_to_that_of_their_cells_from_below(cells, offset, short):
    problem = blocks(cells=cells, offset=offset)
    limit = np.array([number.value for number in rho_of_cells(problem).numbers.values()])
    coarse, fine = (measured_apart(problem.refined(halvings)) for halvings in (2, 3))
    assert (coarse < fine).all()
    assert (fine < limit).all()
    assert (fine + (fine - coarse) / 3)[short] == pytest.approx(limit[short], rel=1e-3)


@pytest.mark.parametrize(
    ("problem", "why"),
    [
        (None, "matrices"),
        (vf.example("two-bars"), "bars"),
        (blocks(cells=((16, 4), (9, 4))), "cells have the lengths 8/9 to 1"),
        (blocks(cells=((16, 4), (8, 4)), body1={"prescribed": {"top": [0, "free"]}}), "body1 is held along Gamma_c"),
    ],
    ids=str,
)
def test_without_equal_cells_in_a_simple_ratio_there_is_none_and_a_reason(problem, why):
    found = rho_of_cells(problem)
    assert not found.numbers
    assert why in found.why


def test_a_document_has_both_or_the_reason_beside_null():
    has, lacks = (vf.measure(problem).to_dict() for problem in (blocks(), vf.example("two-bars")))
    for name in ("rho_cells", "rho_normal_cells"):
        assert has[name]["level"] == "float"
        assert name not in has["reason"]
        assert lacks[name] is None
        assert lacks["reason"][name] == "bars have no waves along Gamma_c"


def test_a_measurement_computes_them_only_when_they_are_read(monkeypatch):
    asked = []
    monkeypatch.setattr(
        "verification.constants.cells.rho_of_cells", lambda *a, **k: asked.append(a) or rho_of_cells(*a, **k)
    )
    found = vf.measure(blocks())
    assert not asked
    assert found.rho_cells.value == found.rho_cells.value > 1.79
    assert len(asked) == 1


def test_proved_bounds_enclose_both_and_grids_that_differ_say_why_there_are_none():
    rows = 4 if AT_NIGHT else 8  # equal cells, by day, are enclosed in a fifth of the time
    found = vf.measure(blocks(cells=((16, 8), (8, rows))), verified=True)
    for number in (found.rho_cells, found.rho_normal_cells):
        assert number.level == "verified"
        assert number.hi - number.lo <= 1e-9 * number.lo
    apart = vf.measure(blocks(cells=((16, 4), (6, 4))), verified=True).to_dict()
    assert apart["rho_cells"]["level"] == "float"
    assert "face each other" in apart["unverified"]["rho_cells"]
