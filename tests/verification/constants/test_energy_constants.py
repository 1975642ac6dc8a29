"""rho, C_s, C_t1, C_t2 and the kappas of the theorem in energy norms, against dense pencils of whole bodies."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import strategies
from dense_oracle import DenseBody, DensePair, close, stretched, symmetric, top, trace, with_moduli
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.linalg import eigh

import verification as vf
from verification.constants import Measured
from verification.interface.pair import pair_from

NAMES = ("rho_max", "rho_min", "rho_normal", "C_s_energy", "C_t1", "C_t2", "kappa_1", "kappa_2")

seeds = st.integers(0, 2**32 - 1)


def values(measured: Measured) -> dict[str, float]:
    return {name: getattr(measured, name).value for name in NAMES}


def measured_of(data: Mapping[str, Any]) -> Measured:
    return vf.measure(vf.Problem.from_dict(data))


# --- pencils of whole bodies ------------------------------------------------------------------------------------------


def flexibility(body: DenseBody) -> np.ndarray:
    """Interface displacements under nodal forces on the interface: the inverse of S, from the whole body."""
    T = trace(body)
    return symmetric(T @ np.linalg.solve(body.A, T.T))


def normal_stress(dense: DensePair, body: DenseBody) -> np.ndarray:
    """S sigma_N of any displacement w: the functional ``phi -> a(w, R_D(phi n))``, through the hat."""
    return dense.hat @ (body.R.T @ body.A)[dense.t :]


def quotients(dense: DensePair) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Pencils (X, Y) whose largest eigenvalue is a constant squared, or rho itself.

    Those of C_s, C_t1 and C_t2 go over all displacements of a body.  That of rho goes over interface forces: the
    quotient of the energies that they cause in both bodies; of rho_normal over normal ones alone.
    """
    one, two, t = dense.contact, dense.neumann, dense.t
    F_1, F_2 = flexibility(one), flexibility(two)
    Z = normal_stress(dense, two)
    slides = lambda body: symmetric(trace(body).T @ dense.B_T @ trace(body))
    return {
        "rho_max": (F_2, F_1),
        "rho_normal": (F_2[t:, t:], F_1[t:, t:]),
        "C_s_energy": (symmetric(Z.T @ np.diag(dense.weights) @ Z), two.A),
        "C_t1": (slides(one), one.A),
        "C_t2": (slides(two), two.A),
    }


def rounding(dense: DensePair) -> float:
    """1e-9, or what the condition of the stiffness matrices leaves of sixteen digits."""
    conditions = [np.linalg.cond(body.A) for body in (dense.body1, dense.body2)]
    return max(1e-9, 20 * np.finfo(float).eps * max(conditions))


def dense_values(dense: DensePair) -> dict[str, float]:
    found = {name: top(*pencil)[0] for name, pencil in quotients(dense).items()}
    found |= {name: np.sqrt(max(found[name], 0.0)) for name in ("C_s_energy", "C_t1", "C_t2")}
    found["rho_min"] = eigh(flexibility(dense.neumann), flexibility(dense.contact), eigvals_only=True)[0]
    k = dense.friction
    return found | {f"kappa_{i}": k * found["C_s_energy"] * found[f"C_t{i}"] for i in (1, 2)}


@strategies.fewer(6, at_night=3)
@given(data=strategies.contact_problems(most_cells=8))
def test_the_energy_constants_are_the_extremal_eigenvalues_of_pencils_of_whole_bodies(data):
    found, dense = values(measured_of(data)), DensePair.of(pair_from(vf.Problem.from_dict(data)))
    expected = dense_values(dense)
    if data["dimension"] == 1:
        assert [found[name] for name in ("C_s_energy", "C_t1", "C_t2", "kappa_1", "kappa_2")] == [0.0] * 5
        expected = {name: expected[name] for name in ("rho_max", "rho_min", "rho_normal")}
    close(found, expected, rounding(dense))


@strategies.fewer(6, at_night=3)
@given(data=strategies.plane_problems(), seed=seeds)
def test_each_energy_constant_bounds_every_vector_and_is_attained(data, seed):
    """By its eigenvector, to rounding: 0.99 of it would not do."""
    dense, found = DensePair.of(pair_from(vf.Problem.from_dict(data))), values(measured_of(data))
    near, random = rounding(dense), np.random.default_rng(seed)
    for name, (X, Y) in quotients(dense).items():
        square = found[name] if name.startswith("rho") else found[name] ** 2
        for x in random.standard_normal((5, len(X))):
            assert x @ X @ x <= (1 + near) * square * (x @ Y @ x)
        x = top(X, Y)[1]
        attained = (x @ X @ x) / (x @ Y @ x)
        assert attained >= (1 - near) * square
        assert attained > 0.99**2 * square


@strategies.fewer(6, at_night=3)
@given(data=strategies.plane_problems(), seed=seeds)
def test_rho_bounds_the_reaction_by_the_energy_of_the_contact_body(data, seed):
    """``|||S_1 d_1|||^2 <= rho |d_1|^2``; without friction, where only normal forces act, with rho_normal."""
    dense, found = DensePair.of(pair_from(vf.Problem.from_dict(data))), values(measured_of(data))
    S_1, F_2, t = dense.contact.S, flexibility(dense.neumann), dense.t
    near, random = rounding(dense), np.random.default_rng(seed)
    for force in random.standard_normal((5, len(S_1))):
        d_1 = np.linalg.solve(S_1, force)
        assert force @ F_2 @ force <= (1 + near) * found["rho_max"] * (d_1 @ force)
        force[:t] = 0
        d_1 = np.linalg.solve(S_1, force)
        assert force @ F_2 @ force <= (1 + near) * found["rho_normal"] * (d_1 @ force)
    assert found["rho_min"] * (1 - near) <= found["rho_normal"] <= found["rho_max"] * (1 + near)


@strategies.fewer(6, at_night=3)
@given(data=strategies.plane_problems(), seed=seeds)
def test_the_kappas_bound_the_friction_term(data, seed):
    """``sum_j w_j k |zeta_j| |(d_1 - d_2)_Tj| <= kappa_1 |d_1| |d_2| + kappa_2 |d_2|^2``, zeta = R (S_2 d_2)_N."""
    dense, found = DensePair.of(pair_from(vf.Problem.from_dict(data))), values(measured_of(data))
    S_1, S_2, t = dense.contact.S, dense.neumann.S, dense.t
    random = np.random.default_rng(seed)
    for _ in range(5):
        d_1, d_2 = random.standard_normal((2, len(S_1)))
        zeta = dense.hat @ (S_2 @ d_2)[t:]
        term = dense.friction * float(dense.weights @ (np.abs(zeta) * np.abs((d_1 - d_2)[:t])))
        energy_1, energy_2 = np.sqrt(d_1 @ S_1 @ d_1), np.sqrt(d_2 @ S_2 @ d_2)
        bound = found["kappa_1"] * energy_1 * energy_2 + found["kappa_2"] * energy_2**2
        assert term <= (1 + 1e-9) * bound


# --- units and roles --------------------------------------------------------------------------------------------------


CHANGES: dict[str, tuple[Callable[[Mapping[str, Any], Fraction], dict[str, Any]], dict[str, float]]] = {
    "stress": (with_moduli, {"C_s_energy": 0.5, "C_t1": -0.5, "C_t2": -0.5}),
    "length": (stretched, {"C_s_energy": -0.5, "C_t1": 0.5, "C_t2": 0.5}),
}


@pytest.mark.parametrize("unit", CHANGES)
@strategies.fewer(8, at_night=4)
@given(data=strategies.contact_problems(), c=st.sampled_from([Fraction(1, 1000), Fraction(254, 10), Fraction(10) ** 6]))
def test_rho_and_the_kappas_know_no_units(unit, data, c):
    """C_s goes with the root of stress over length, C_t1 and C_t2 with its inverse."""
    change, powers = CHANGES[unit]
    dense = DensePair.of(pair_from(vf.Problem.from_dict(data)))
    before, after = values(measured_of(data)), values(measured_of(change(data, c)))
    expected = {name: before[name] * float(c) ** powers.get(name, 0) for name in NAMES}
    close(after, expected, 10 * rounding(dense))


@strategies.fewer(8, at_night=4)
@given(data=strategies.contact_problems(), c=st.sampled_from([Fraction(1, 50), Fraction(1, 3), Fraction(40)]))
def test_rho_goes_with_the_ratio_of_the_moduli(data, c):
    """One body c times as stiff: rho c times as large or small, C_s and C_t of that body by its root."""
    dense = DensePair.of(pair_from(vf.Problem.from_dict(data)))
    stiffer = data | {"body1": data["body1"] | {"young": c * data["body1"]["young"]}}
    before, after = values(measured_of(data)), values(measured_of(stiffer))
    root, contact = float(c) ** 0.5, data["iteration"]["neumann_body"] == 2
    factors = {"C_t1": 1 / root, "kappa_1": 1 / root} if contact else {"C_s_energy": root, "C_t2": 1 / root}
    factors |= {} if contact else {"kappa_1": root}
    factors |= {name: float(c) if contact else 1 / float(c) for name in ("rho_max", "rho_min", "rho_normal")}
    close(after, {name: before[name] * factors.get(name, 1.0) for name in NAMES}, 10 * rounding(dense))


@strategies.fewer(8, at_night=4)
@given(data=strategies.contact_problems())
def test_swapped_roles_turn_rho_over_and_exchange_the_traces(data):
    """C_s becomes that of the other body: from its own pencil."""
    problem = vf.Problem.from_dict(data)
    here, there = values(vf.measure(problem)), values(vf.measure(problem.swapped()))
    dense = DensePair.of(pair_from(problem.swapped()))
    near = rounding(dense)
    exchanged = {"rho_max": 1 / here["rho_min"], "rho_min": 1 / here["rho_max"]}
    close(there, exchanged | {"C_t1": here["C_t2"], "C_t2": here["C_t1"]}, near)
    expected = dense_values(dense)
    close(there, {name: expected[name] for name in ("C_s_energy", "rho_normal") if here[name]}, near)
    assert there["kappa_1"] * here["C_s_energy"] == pytest.approx(here["kappa_2"] * there["C_s_energy"], rel=1e-9)


# --- another friction -------------------------------------------------------------------------------------------------

frictions = st.integers(1, 400).map(lambda n: Fraction(n, 100))


@strategies.fewer(6, at_night=3)
@given(data=strategies.plane_problems(), k=frictions)
def test_with_friction_gives_what_measuring_at_that_friction_gives(data, k):
    other = data | {"contact": data["contact"] | {"friction": k}}
    moved, measured = measured_of(data).with_friction(float(k)), measured_of(other)
    assert moved.friction == measured.friction
    close(values(moved), values(measured), 1e-14)
    assert moved.C_K.value == pytest.approx(measured.C_K.value, rel=1e-14)
    assert moved.energy_constants().at_work == measured.energy_constants().at_work


@strategies.fewer(3)
@given(data=strategies.plane_problems(), k=frictions)
def test_the_friction_threshold_is_where_kappa_2_plus_a_quarter_of_kappa_1_squared_is_1(data, k):
    """Whatever friction it was found at."""
    measured = measured_of(data)
    threshold = measured.friction_threshold.value
    at = measured.with_friction(threshold)
    assert at.kappa_2.value + at.kappa_1.value**2 / 4 == pytest.approx(1, rel=1e-12)
    assert measured.with_friction(float(k)).friction_threshold.value == threshold


@strategies.fewer(4)
@given(data=strategies.plane_problems(friction=st.just(Fraction(0))), k=frictions)
def test_without_a_law_of_friction_there_is_no_threshold_and_no_other_friction(data, k):
    assume(data["contact"]["law"] == "nonlocal")
    lawless = data | {"contact": {key: v for key, v in data["contact"].items() if key not in ("radius", "friction")}}
    measured = measured_of(lawless)
    assert measured.friction_threshold is None
    assert (measured.kappa_1.value, measured.kappa_2.value, measured.C_s_energy) == (0.0, 0.0, None)
    assert measured.with_friction(0.0).energy_constants() == measured.energy_constants()
    with pytest.raises(ValueError, match="law of friction"):
        measured.with_friction(float(k))


@strategies.fewer(2, at_night=1)
@given(data=strategies.bar_problems())
def test_rho_of_two_bars_is_the_ratio_of_their_stiffnesses(data):
    """``E/L``, contact bar over Neumann bar; no friction, no threshold."""
    measured = measured_of(data)
    stiffness = [Fraction(b["young"]) / (b["x"][1] - b["x"][0]) for b in (data["body1"], data["body2"])]
    contact, neumann = stiffness if data["iteration"]["neumann_body"] == 2 else reversed(stiffness)
    rho = float(contact / neumann)
    close(values(measured), {"rho_max": rho, "rho_min": rho, "rho_normal": rho}, 1e-12)
    assert measured.friction_threshold is None
    with pytest.raises(ValueError, match="law of friction"):
        measured.with_friction(0.1)


@strategies.fewer(4)
@given(data=strategies.plane_problems())
def test_the_constants_that_enter_the_theorem_are_those_measured(data):
    """With rho_normal where there is no friction."""
    measured = measured_of(data)
    entering = measured.energy_constants()
    assert float(entering.rho) == measured.rho_max.value
    assert (float(entering.kappa_1), float(entering.kappa_2)) == (measured.kappa_1.value, measured.kappa_2.value)
    assert entering.at_work == (entering.rho if data["contact"]["friction"] else entering.rho_normal)
