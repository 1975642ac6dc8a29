"""The measured constants against dense eigensolves of matrices assembled here, scaling laws and closed forms."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from itertools import pairwise, product
from typing import Any

import numpy as np
import pytest
import strategies
from dense_oracle import DensePair, close, rounding, stretched, top, with_moduli
from hypothesis import given
from hypothesis import strategies as st
from problem_list import bars, changed
from scipy.linalg import eigh

import verification as vf
from fem1d2d import Condensation
from ndtheory import PRINTED, REPAIRED, evaluate
from verification.interface.body import Body
from verification.interface.pair import pair_from

CONSTANTS = ("m", "M", "C_R", "C_s", "C_tr", "C_tr_half", "C_K", "rho_max", "rho_min", "rho_normal")


def values(data: Mapping[str, Any]) -> dict[str, float]:
    """All constants of a problem given as a dictionary."""
    measured = vf.measure(vf.Problem.from_dict(data))
    bodies = {
        f"{name}{i}": getattr(body, name).value
        for i, body in enumerate((measured.body1, measured.body2), 1)
        for name in ("m", "M")
    }
    return bodies | {name: getattr(measured, name).value for name in CONSTANTS}


def condensed(S: np.ndarray, t: int) -> np.ndarray:
    """Tangential components left to themselves: the inverse of the normal block of the inverse."""
    return np.linalg.inv(np.linalg.inv(S)[t:, t:])


def quotients(dense: DensePair) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Pencils (X, Y) of which a constant squared is the largest eigenvalue; of m it is 1/m, of M it is M.

    C_R, C_s and C_tr belong to the body or bodies for which it is largest.
    """
    bodies = (dense.body1, dense.body2)
    worst = lambda pencils: max(pencils, key=lambda pencil: top(*pencil)[0])
    return {
        "m": worst([(b.H, b.A) for b in bodies]),
        "M1": (bodies[0].A, bodies[0].H),
        "M2": (bodies[1].A, bodies[1].H),
        "C_R": worst([(a.N, b.E) for a, b in product(bodies, bodies)]),
        "C_s": worst([(dense.squared_stress(b), b.E) for b in bodies]),
        "C_tr": worst([(dense.B_T, b.E) for b in bodies]),
    }


def dense_values(dense: DensePair) -> dict[str, float]:
    """The constants by their definitions, with eigensolves of full matrices."""
    bodies, one, two = (dense.body1, dense.body2), dense.contact, dense.neumann
    found = {name: top(*pencil)[0] for name, pencil in quotients(dense).items()}
    kept = [dense.keep_tangential(b) for b in bodies]
    roots = {name: np.sqrt(found[name]) for name in ("C_R", "C_s", "C_tr")}
    return {
        **{f"m{i}": eigh(b.A, b.H, eigvals_only=True)[0] for i, b in enumerate(bodies, 1)},
        "M1": found["M1"],
        "M2": found["M2"],
        "m": 1 / found["m"],
        "M": found["M1"] + found["M2"],
        **roots,
        "C_tr_half": np.sqrt(max(min(top(X, b.E)[0] for X in kept) for b in bodies)),
        "C_K": dense.friction * roots["C_s"] * roots["C_tr"],
        "rho_max": top(one.S, two.S)[0],
        "rho_min": eigh(one.S, two.S, eigvals_only=True)[0],
        "rho_normal": top(condensed(one.S, dense.t), condensed(two.S, dense.t))[0],
    }


@strategies.fewer(3, at_night=1)
@given(data=strategies.contact_problems(most_cells=8))
def test_measured_constants_are_the_extremal_eigenvalues_of_dense_pencils(data):
    """The least eigenvalue of A loses as many digits as the condition of A has."""
    dense = DensePair.of(pair_from(vf.Problem.from_dict(data)))
    found, expected = values(data), dense_values(dense)
    if data["dimension"] == 1:
        assert [found.pop(name) for name in ("C_s", "C_tr", "C_tr_half", "C_K")] == [0.0] * 4
        expected = {name: value for name, value in expected.items() if name in found}
    close(found, expected, rounding(dense.body1, dense.body2))


@strategies.fewer(10, at_night=5)
@given(data=strategies.plane_problems(most_cells=14))
def test_the_sparse_eigensolver_finds_the_same_ends_as_the_dense_one(data):
    for name in ("body1", "body2"):
        data[name]["cells"][1] += 3
    found, dense = values(data), DensePair.of(pair_from(vf.Problem.from_dict(data)))
    for i, body in enumerate((dense.body1, dense.body2), 1):
        low, high = 1 / eigh(body.H, body.A, eigvals_only=True)[-1], eigh(body.A, body.H, eigvals_only=True)[-1]
        close(found, {f"m{i}": low, f"M{i}": high}, rounding(body))


@strategies.fewer(6, at_night=2)
@given(data=strategies.plane_problems(), seed=st.integers(0, 2**32 - 1))
def test_each_constant_bounds_every_vector_and_is_attained(data, seed):
    """By its eigenvector, to 1e-9: nine tenths of it would not do."""
    dense, found = DensePair.of(pair_from(vf.Problem.from_dict(data))), values(data)
    square = {"m": 1 / found["m"], "M1": found["M1"], "M2": found["M2"]}
    square |= {name: found[name] ** 2 for name in ("C_R", "C_s", "C_tr")}
    random = np.random.default_rng(seed)
    for name, (X, Y) in quotients(dense).items():
        for x in random.standard_normal((5, len(X))):
            assert x @ X @ x <= (1 + 1e-9) * square[name] * (x @ Y @ x)
        x = top(X, Y)[1]
        attained = (x @ X @ x) / (x @ Y @ x)
        assert attained >= (1 - 1e-9) * square[name]
        assert attained > 0.9 * square[name]


@strategies.fewer(3, at_night=1)
@given(data=strategies.plane_problems())
def test_M_of_a_plane_body_is_at_most_the_larger_of_2_mu_and_2_mu_plus_2_lambda(data):
    """``(div v)^2 <= 2 |eps|^2`` and ``|eps| <= |grad v|`` pointwise."""
    found = values(data)
    for i in (1, 2):
        E, nu = (float(data[f"body{i}"][name]) for name in ("young", "poisson"))
        mu, lame = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))
        assert found[f"M{i}"] <= (1 + 1e-9) * max(2 * mu, 2 * mu + 2 * lame)


# --- without lifts ----------------------------------------------------------------------------------------------------


def test_constants_and_displacements_need_no_dense_lift(monkeypatch):
    """It has as many numbers as unknowns times contact nodes: on large meshes it would be most of time and memory."""
    problem = vf.example("section6")
    expected = {name: getattr(vf.measure(problem), name).value for name in CONSTANTS}

    def refuse(condensation):
        raise AssertionError("a dense lift")

    monkeypatch.setattr(Condensation, "lift", property(refuse))
    run = vf.run(problem)
    assert np.isfinite(np.concatenate(run.displacements)).all()
    close({name: getattr(vf.measure(problem), name).value for name in CONSTANTS}, expected)


def by_lifts(body: Body, form: Any) -> np.ndarray:
    """``R' X R`` from the dense lift."""
    fields = np.zeros((len(body.positions), len(body.interface)))
    fields[body.interface] = np.eye(len(body.interface))
    fields[body.elastic.inside] = body.elastic.lift
    return fields.T @ (form @ fields)


def test_the_matrices_of_a_fine_mesh_are_those_of_dense_lifts():
    """About 4,000 unknowns, 73 contact nodes, to 1e-12 of their norm; the constants by them, too."""
    pair = pair_from(vf.example("section6").changed(cells=((120, 10), (72, 10))))
    for side in (pair.body1, pair.body2):
        body = side.mesh_body
        for found, form in ((body.elastic.schur, body.stiffness), (body.lift_gram, body.gram_matrix)):
            exact = by_lifts(body, form)
            assert np.linalg.norm(found - exact, 2) <= 1e-12 * np.linalg.norm(exact, 2)
        E = body.gram.schur
        assert top(body.lift_gram, E)[0] == pytest.approx(top(by_lifts(body, body.gram_matrix), E)[0], rel=1e-11)


# --- units ------------------------------------------------------------------------------------------------------------


def thresholds(edition, data: Mapping[str, Any]) -> dict[str, float]:
    """C_2 to C_5, on k."""
    bounds = evaluate(edition, vf.measure(vf.Problem.from_dict(data)).constants())
    return {name: getattr(bounds, name).value for name in ("C2", "C3", "C4", "C5")}


@strategies.fewer(6, at_night=2)
@given(data=strategies.plane_problems())
def test_another_unit_of_stress_leaves_the_repaired_thresholds_and_moves_the_printed_ones(data):
    """m goes from 1e-3 to 1e3 as both moduli are multiplied by 1e6: m~ goes from 1e-3 to 1."""
    small = with_moduli(data, Fraction(1e-3 / values(data)["m"]))
    large = with_moduli(small, Fraction(10**6))
    before, after = values(small), values(large)
    dense = DensePair.of(pair_from(vf.Problem.from_dict(data)))
    near = 10 * rounding(dense.body1, dense.body2)  # thresholds are of degree up to 7 in m, M and C_R
    stresses = ("m", "M", "C_s", "C_K")
    close(after, {name: before[name] * (1e6 if name in stresses else 1) for name in CONSTANTS}, near)
    close(thresholds(REPAIRED, large), thresholds(REPAIRED, small), near)
    printed_small, printed_large = thresholds(PRINTED, small), thresholds(PRINTED, large)
    assert all(printed_large[name] < 1e-3 * printed_small[name] for name in printed_small)


@strategies.fewer(6, at_night=2)
@given(data=strategies.plane_problems())
def test_the_editions_agree_in_the_unit_of_stress_in_which_m_is_1(data):
    """As nearly as m is 1 there: it is measured anew, and thresholds are of degree up to 7 in m, M and C_R."""
    unit = with_moduli(data, 1 / Fraction(values(data)["m"]))
    dense = DensePair.of(pair_from(vf.Problem.from_dict(unit)))
    close(thresholds(PRINTED, unit), thresholds(REPAIRED, unit), 10 * rounding(dense.body1, dense.body2))


@strategies.fewer(6, at_night=2)
@given(data=strategies.contact_problems(), c=st.sampled_from([Fraction(1, 1000), Fraction(3), Fraction(254, 10)]))
def test_another_unit_of_length_changes_nothing_if_L_goes_with_it(data, c):
    """But C_s and C_tr, which hold a length^(1/2): their product C_K does not."""
    before, after = values(data), values(stretched(data, c) | {"norm": {"length": c * data["norm"]["length"]}})
    powers = {"C_tr": 0.5, "C_s": -0.5}
    close(after, {name: before[name] * float(c) ** powers.get(name, 0) for name in CONSTANTS})


@strategies.fewer(6, at_night=2)
@given(data=strategies.contact_problems())
def test_swapped_roles_swap_rho_max_and_the_inverse_of_rho_min(data):
    problem = vf.Problem.from_dict(data)
    here, there = vf.measure(problem), vf.measure(problem.swapped())
    for name in ("m", "M", "C_R", "C_s", "C_tr", "C_tr_half", "C_K"):
        assert getattr(here, name) == getattr(there, name)
    close(
        {"max": there.rho_max.value, "min": there.rho_min.value},
        {"max": 1 / here.rho_min.value, "min": 1 / here.rho_max.value},
    )


# --- mirrors ----------------------------------------------------------------------------------------------------------


def mirrored(data: dict[str, Any], factor: Fraction) -> dict[str, Any]:
    """Body 2 the mirror image of body 1, `factor` times as stiff; an even number of rows mirrors the diagonals too."""
    data["body1"]["cells"][1] = 2
    flip = {"bottom": "top", "top": "bottom"}
    below = data["body1"]
    above = below | {"y": [-y for y in reversed(below["y"])], "young": factor * below["young"]}
    above["fixed"] = [flip.get(side, side) for side in below["fixed"]]
    above["prescribed"] = {flip.get(side, side): v for side, v in below["prescribed"].items()}
    above["traction"] = {}
    ends = data["contact"]["interval"]
    x = below["x"]
    ends = ends if x[0] <= ends[0] and ends[1] <= x[1] else x
    return data | {"body1": below | {"traction": {}}, "body2": above, "contact": data["contact"] | {"interval": ends}}


@strategies.fewer(6, at_night=2)
@given(data=strategies.plane_problems(), factor=st.sampled_from([Fraction(1), Fraction(7, 2), Fraction(1, 50)]))
def test_mirror_images_differ_by_the_ratio_of_their_moduli_alone(data, factor):
    data = mirrored(data, factor)
    found = values(data)
    ratio = float(factor) if data["iteration"]["neumann_body"] == 1 else 1 / float(factor)
    close(found, {"rho_normal": ratio, "m2": float(factor) * found["m1"], "M2": float(factor) * found["M1"]})
    # the mirror turns (S_1, S_2) into (S_2, S_1) up to that ratio
    close({"": found["rho_max"] * found["rho_min"]}, {"": ratio**2})
    assert found["C_R"] >= 1 - 1e-9


def section_6(rows: int, per_length: int, left: str = "0.4") -> dict[str, Any]:
    """Square or flat cells: `per_length` of them in a length of 1, `rows` in the thickness."""
    ends = [Fraction(left), Fraction(left) + Fraction(6, 5)]
    return changed(
        body1={"cells": [2 * per_length, rows]},
        body2={"x": ends, "cells": [per_length * 6 // 5, rows]},
        contact={"radius": "0.1"},
    )


@pytest.mark.parametrize(("rows", "per_length", "left"), [(2, 10, "0.4"), (2, 10, "0"), (4, 20, "0.2"), (6, 20, "0.4")])
def test_rho_normal_of_the_section_6_model_is_the_ratio_of_the_moduli(rows, per_length, left):
    """With Neumann body 1, and tangential components free, ``rho_normal = E2/E1`` exactly, wherever body 2 sits.

    At most: mirror body 2 at Gamma_c. Where the diagonals of the cells agree, the image is a union Q of cells of body 1
    and carries the same mesh. Any displacement of body 1 with normal trace phi restricts to Q, with the bottom held, so
    its energy is at least E1/E2 times the least energy of body 2 with that trace: ``S1 >= (E1/E2) S2``.

    At least: let Q have nx columns and ny rows of cells. Look for v on Q that vanishes on its left and right side and
    whose nodal forces vanish in every free component but the normal ones on Gamma_c. Extended by zero it is in
    equilibrium in body 1 as well, for the cells outside Q are at rest: v is the minimiser of both bodies for its
    trace, and attains the bound; the trace is not zero, or v would be. Unknowns: 2 ny in each of nx - 1 columns of
    nodes. Conditions: 2 ny - 1 in each of nx + 1 columns. Unknowns win if ``nx + 1 > 4 ny``: a body at least four times
    as long as thick, in square cells, as in Section 6.
    """
    assert per_length * 6 // 5 + 1 > 4 * rows
    assert (int(Fraction(left) * per_length) + rows) % 2 == 0  # the diagonals agree
    found = values(section_6(rows, per_length, left))["rho_normal"]
    assert abs(found / (2 / 7) - 1) < 1e-12


def test_rho_normal_falls_short_of_the_ratio_of_the_moduli_where_the_upper_body_is_too_short():
    """nx + 1 < 4 ny: no oscillation fits between sides at rest, and the ratio of the moduli is a bound only."""
    found = values(section_6(2, 5))["rho_normal"] / (2 / 7)
    assert 0.999 < found < 1 - 1e-5


def test_rho_normal_may_exceed_the_ratio_of_the_moduli_where_the_diagonals_of_the_cells_differ():
    assert values(section_6(3, 10))["rho_normal"] / (2 / 7) > 1.1


# --- two bars ---------------------------------------------------------------------------------------------------------


def of_bars(lengths, young, cells: int = 1, neumann_body: int = 2) -> dict[str, float]:
    """The constants of two bars that meet at 0."""
    role = {"neumann_body": neumann_body}
    return values(bars(lengths, young, (cells, cells), -lengths[0], iteration=role))


lengths = strategies.decimals(-1.5, 1)


@given(L1=lengths, L2=lengths, young=strategies.youngs(), cells=st.integers(1, 30))
def test_two_bars_on_a_mesh_have_closed_forms(L1, L2, young, cells):
    """Modes sin(w x), ``w = (2j - 1) pi/(2 L)``: laplace over mass is ``l = 6/h^2 (1 - cos w h)/(2 + cos w h)``.

    So ``a/|.|^2 = E l/(l + 1)``, least at j = 1, largest at j = n. S_a = E_a/L_a; the lift is linear.
    """
    found = of_bars((L1, L2), young, cells)
    expected = {}
    for i, (L, E) in enumerate(zip((float(L1), float(L2)), map(float, young), strict=True), 1):
        for name, j in (("m", 1), ("M", cells)):
            h = L / cells
            angle = (2 * j - 1) * np.pi * h / (2 * L)
            # 1 - cos angle without cancellation
            ratio = 6 / h**2 * 2 * np.sin(angle / 2) ** 2 / (2 + np.cos(angle))
            expected[f"{name}{i}"] = E * ratio / (ratio + 1)
    rho = float(young[0] / L1 / (young[1] / L2))
    close(found, expected)
    close(found, {"rho_max": rho, "rho_min": rho, "rho_normal": rho}, 1e-12)
    close(of_bars((L1, L2), young, cells, neumann_body=1), {"rho_max": 1 / rho}, 1e-12)


@pytest.mark.parametrize(("L1", "L2", "young"), [(1, 1, (1, 1)), (Fraction(1, 3), 2, (70000, 20000)), (3, 2, (1, 40))])
def test_refined_bars_reach_the_closed_forms_of_the_continuum_by_a_quarter_each_halving(L1, L2, young):
    """``m^a = E/(1 + (2L/pi)^2)`` from above, ``M^a = E`` from below, ``C_R^2 = max (L_a/3 + 1/L_a)/coth(L_b)``."""
    limits = {}
    for i, (L, E) in enumerate(((L1, young[0]), (L2, young[1])), 1):
        limits |= {f"m{i}": E / (1 + (2 * float(L) / np.pi) ** 2), f"M{i}": float(E)}
    both = [float(L1), float(L2)]
    limits["C_R"] = np.sqrt(max((a / 3 + 1 / a) * np.tanh(b) for a in both for b in both))
    errors = {name: [] for name in limits}
    for cells in (8, 16, 32, 64):
        found = of_bars((L1, L2), young, cells)
        for name, limit in limits.items():
            errors[name].append(found[name] - limit)
    for name, error in errors.items():
        assert all(e > 0 for e in error) if name[0] == "m" else all(e < 0 for e in error)
        assert all(abs(coarse / fine - 4) < 0.15 for coarse, fine in pairwise(error))
