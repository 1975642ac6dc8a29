"""Limits of rho on meshes of equal cells: 40 families against the prediction, and bounds from above on each mesh."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.linalg import eigh
from scipy.sparse.linalg import splu
from strategies import AT_NIGHT
from test_rho_of_cells import Family, normal

import verification as vf
from fem1d2d import plane_strain, rectangle, stiffness
from fem1d2d.layers import FacingLayers, Layer, peaks
from ndtheory.moduli import Moduli, half_planes

F = Fraction


def top(contact: np.ndarray, neumann: np.ndarray) -> float:
    return float(eigh(contact, neumann, eigvals_only=True)[-1])


def apart(S: np.ndarray) -> np.ndarray:
    """Components x and y of each node in turn: all x first."""
    order = np.r_[0 : len(S) : 2, 1 : len(S) : 2]
    return S[np.ix_(order, order)]


# --- bodies without ends: 40 families ---------------------------------------------------------------------------------


class Columns:
    """Two columns of cells of a body, from rectangle()'s mesh, whose ends are joined with a phase; far side clamped."""

    def __init__(self, aspect: Fraction, rows: int, material, *, upper: bool) -> None:
        mesh = rectangle((0.0, 2 * float(aspect)), (0.0, float(rows)), (2, rows))
        node = np.arange(len(mesh.points)).reshape(3, rows + 1)
        self.stiffness, self.rows = sp.csr_array(stiffness(mesh, material)), rows
        self.node = (node[:, ::-1] if upper else node)[:, 1:]  # from the clamped side to the surface

    def surface(self, phase: float) -> np.ndarray:
        """The Schur complement of the surface on waves that change by a phase over both columns."""
        place = 4 * np.arange(self.rows) + 2 * (np.arange(3) % 2)[:, None]
        row, column = ((base[..., None] + [0, 1]).ravel() for base in (2 * self.node, place))
        value = np.repeat([1, 1, np.exp(1j * phase)], 2 * self.rows)
        fold = sp.csr_array((value, (row, column)), shape=(self.stiffness.shape[0], 4 * self.rows))
        K = sp.csc_array(fold.conj().T @ self.stiffness @ fold)
        inner = 4 * self.rows - 4
        coupled = K[:inner, inner:].toarray()
        found = K[inner:, inner:].toarray() - coupled.conj().T @ splu(K[:inner, :inner]).solve(coupled)
        return (found + found.conj().T) / 2


def on_waves(family: Family, columns: int, waves, thickness: Fraction | int = 1) -> np.ndarray:
    """rho and rho_N of periodic bodies, wave by wave, shape (n, 2); the unit of their thickness is the period."""
    both = [
        Columns(aspect, int(columns * aspect * thickness), plane_strain(float(F(young)), float(nu)), upper=upper)
        for aspect, young, nu, upper in zip(
            family.aspects, (family.young, "1"), family.poisson, (True, False), strict=True
        )
    ]  # all numbers of rows are even, so that the diagonals mirror
    found = []
    for wave in waves:
        phase = 4 * np.pi * wave / columns
        S_c, S_n = (body.surface(phase) for body in both)
        if not family.mirrored:  # the Neumann body is moved by one column
            move = np.roll(np.eye(4), 2, axis=1).astype(complex)
            move[2:] *= np.exp(1j * phase)
            S_n = move @ S_n @ move.conj().T
        S_c, S_n = apart(S_c), apart(S_n)
        found.append((top(S_c, S_n), top(normal(S_c), normal(S_n))))
    return np.array(found)


def strip(young: str, poisson: str, wave: Fraction | int) -> np.ndarray:
    """The symbol of a clamped strip of thickness 1, for amplitudes (i T, N), at the wave number 2 pi wave."""
    nu = float(poisson)
    G, kappa, x = float(F(young)) / 2 / (1 + nu), 3 - 4 * nu, 2 * np.pi * float(wave)
    if not wave:
        return G * np.diag([1.0, (kappa + 1) / (kappa - 1)])
    s, sinh = np.sinh(x) ** 2, np.sinh(2 * x)
    T, N = (x * (kappa + 1) * (kappa * sinh + sign * 2 * x) / 2 for sign in (-1, 1))
    across = x * (kappa * (kappa - 1) * s - 2 * x**2)
    return G * np.array([[T, across], [across, N]]) / (kappa**2 * s - x**2)


def continuum(family: Family, thickness: Fraction | int = 1) -> np.ndarray:
    """rho and rho_N of both strips of the continuum; waves shorter than an eighth of the thickness have half-planes."""
    flip = np.array([[1, -1], [-1, 1]])
    pairs = [
        (strip(family.young, family.poisson[0], wave), flip * strip("1", family.poisson[1], wave))
        for wave in (thickness * n for n in range(int(8 / thickness)))
    ]
    return np.max([family.limit, *((top(*pair), top(*map(normal, pair))) for pair in pairs)], axis=0)


#: Columns of three meshes: the next terms in the error of a long wave are of the orders 2, 4 and 6 in 1/columns.
COLUMNS = (64, 128, 256)

#: Waves in one period from which on none is extrapolated: their ratios are those of the coarsest mesh.
LONG = 5


@pytest.mark.parametrize("seed", range(40) if AT_NIGHT else range(0, 40, 8))
def test_the_limit_without_ends_is_the_larger_one_of_the_continuum_and_of_the_cells(seed):
    family = Family.drawn(seed)
    predicted = np.max([family.predicted, continuum(family)], axis=0)
    coarse, middle, fine = (on_waves(family, columns, range(LONG)) for columns in COLUMNS)
    first, second = middle + (middle - coarse) / 3, fine + (fine - middle) / 3
    short = on_waves(family, COLUMNS[0], range(LONG, COLUMNS[0] // 2 + 1))
    measured = np.concatenate([second + (second - first) / 15, short]).max(axis=0)
    assert measured == pytest.approx(predicted, rel=2e-3)
    assert (measured <= predicted * (1 + 1e-6)).all()  # six digits are those of the search for the largest wave


def test_on_few_rows_rho_without_ends_may_lie_above_its_limit():
    """Bodies half as thick as the period is long, flat cells, nearly incompressible: 8 % at 8 columns."""
    family, columns, thickness = Family((F(4), F(2)), ("0.49", "0.49"), "1", 1, False), 8, F(1, 2)
    limit = np.max([family.predicted, continuum(family, thickness)], axis=0)
    found = on_waves(family, columns, range(columns // 2), thickness).max(axis=0)
    assert found[1] == pytest.approx(1.077 * limit[1], rel=1e-3)
    finer = on_waves(family, 8 * columns, range(4 * columns), thickness).max(axis=0)
    assert finer[1] == pytest.approx(limit[1], rel=1e-6)


def test_the_strip_of_the_continuum_is_the_limit_of_many_thin_rows():
    family = Family((F(1), F(1)), ("0.3", "0.45"), "1", 1, True)
    for wave in (0, 1, 3):
        surface = Columns(F(1), 256, plane_strain(1.0, 0.3), upper=False).surface(4 * np.pi * wave / 256)
        long = np.kron(np.ones(2), np.eye(2)).T * np.exp(2j * np.pi * wave / 256 * np.repeat([0, 1], 2))[:, None]
        found = np.linalg.eigvalsh(long.conj().T @ np.linalg.solve(surface, long) * 2 / 256 / 4)
        assert 1 / found[::-1] == pytest.approx(np.linalg.eigvalsh(strip("1", "0.3", wave)), rel=5e-3)
    assert continuum(family)[0] >= family.limit[0]


# --- bounds from above, on each mesh ----------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Held:
    """A contact body on a longer Neumann body that is held on all other sides."""

    aspects: tuple[Fraction, Fraction]  # of the contact body and of the Neumann body
    poisson: tuple[str, str]
    rows: tuple[int, int]
    columns: int  # of the contact body
    beside: tuple[int, int]  # columns of the Neumann body on the left and on the right of it
    upper: bool  # the contact body lies above
    clamped: bool  # the contact body is held on its far side

    def problem(self, sides: tuple[str, ...] = ("left", "right")) -> vf.Problem:
        left, right = self.beside
        spans = ((0, self.columns), (-left, self.columns + right))
        bodies = [
            {"shape": "rectangle", "x": list(span), "cells": [span[1] - span[0], rows], "young": 1, "poisson": nu}
            for span, rows, nu in zip(spans, self.rows, self.poisson, strict=True)
        ]
        for body, above, aspect in zip(bodies, (self.upper, not self.upper), self.aspects, strict=True):
            high = str(body["cells"][1] / aspect)
            body["y"] = [0, high] if above else ["-" + high, 0]
        contact, neumann = bodies
        far = ("top", "bottom") if self.upper else ("bottom", "top")
        if self.clamped:
            contact["fixed"] = [far[0]]
        neumann["fixed"] = [far[1], *sides]
        lower, upper = (neumann, contact) if self.upper else (contact, neumann)
        tables = {"contact": {"friction": 0}, "iteration": {"neumann_body": 1 if self.upper else 2}}
        return vf.Problem.from_dict({"dimension": 2, "body1": lower, "body2": upper} | tables)

    def measured(self, sides: tuple[str, ...] = ("left", "right")) -> np.ndarray:
        """rho and rho_N of the mesh."""
        pair = vf.build(self.problem(sides))
        S_c, S_n = pair.contact.schur, pair.neumann.schur
        return np.array([top(S_c, S_n), top(condensed(S_c), normal(S_n))])

    def layers(self, *, endless: bool) -> FacingLayers:
        """Both bodies continued without ends; rectangle() lets cell (i, j) rise where i + j is even."""
        below = lambda column, rows: (column + rows - 1) % 2 == 0
        above = lambda column: column % 2 == 1  # seen from the other side
        first = (0, self.beside[0])  # columns above the first contact node
        rising = (
            (above(first[0]), below(first[1], self.rows[1]))
            if self.upper
            else (below(first[0], self.rows[0]), above(first[1]))
        )
        contact, neumann = (
            Layer(
                material=plane_strain(1.0, float(nu)), aspect=float(aspect), rising=up, rows=None if endless else rows
            )
            for nu, aspect, up, rows in zip(self.poisson, self.aspects, rising, self.rows, strict=True)
        )
        return FacingLayers(contact=contact, neumann=neumann)

    def bound(self) -> np.ndarray:
        """What the page proves of rho and rho_N."""
        if self.clamped:
            phases = np.concatenate([np.geomspace(1e-4, 0.1, 60), np.linspace(0.1, np.pi, 400)])
            return np.array([found.max() for found in self.layers(endless=False).ratios(phases)])
        moduli = (Moduli(young=1, poisson=nu) for nu in self.poisson)
        long = half_planes(*moduli)
        ratios = (peak.ratio for peak in peaks(self.layers(endless=True)))
        return np.maximum(list(ratios), [float(long.high), float(long.free)])


def condensed(S: np.ndarray) -> np.ndarray:
    """The tangential components condensed out, where the body may turn and move freely, too."""
    n = len(S) // 2
    return S[n:, n:] - S[n:, :n] @ np.linalg.pinv(S[:n, :n], rcond=1e-10, hermitian=True) @ S[:n, n:]


def drawn(seed: int, *, clamped: bool) -> Held:
    random = np.random.default_rng(seed)
    pick = lambda values: tuple(values[i] for i in random.integers(0, len(values), 2))
    return Held(
        aspects=pick((F(1, 4), F(1, 2), F(1), F(2), F(4))),
        poisson=pick(("0", "0.3", "0.45", "0.49")),
        rows=tuple(map(int, random.integers(1, 9, 2))),
        columns=int(random.integers(2, 17)),
        beside=tuple(map(int, random.integers(1, 5, 2))),
        upper=bool(random.random() < 0.5),
        clamped=clamped,
    )


class Seen(NamedTuple):
    held: Held
    found: np.ndarray
    bound: np.ndarray


@pytest.fixture(scope="module", params=[True, False], ids=["contact body clamped", "held by contact only"])
def seen(request) -> list[Seen]:
    draws = (drawn(seed, clamped=request.param) for seed in range(15, 400 if AT_NIGHT else 40))
    return [Seen(held, held.measured(), held.bound()) for held in draws]


def test_rho_is_at_most_that_of_layers_and_without_a_clamped_side_that_of_the_cells(seen):
    for each in seen:
        assert (each.found <= each.bound * (1 + 1e-6)).all(), each.held


def test_a_smaller_bound_is_found_out(seen):
    shares = np.array([each.found / each.bound for each in seen])
    assert (shares.max(axis=0) > 0.99).all()


@pytest.mark.parametrize("clamped", [True, False])
def test_with_free_sides_of_the_neumann_body_near_the_contact_the_bound_is_false(clamped):
    square = Held(
        aspects=(F(1), F(1)), poisson=("0.3", "0.3"), rows=(16, 16), columns=16, beside=(1, 1), upper=True,
        clamped=clamped,
    )  # fmt: skip
    assert (square.measured() <= square.bound()).all()
    assert square.measured(sides=())[0] > 1.15 * square.bound()[0]


def test_where_the_contact_body_is_clamped_rho_of_the_cells_is_no_bound_on_a_mesh():
    thin = Held(
        aspects=(F(1, 4), F(1)), poisson=("0.45", "0.45"), rows=(2, 16), columns=16, beside=(8, 8), upper=True,
        clamped=True,
    )  # fmt: skip
    endless = Held(**{**vars(thin), "clamped": False})
    assert (thin.measured() > 1.01 * endless.bound()).any()
