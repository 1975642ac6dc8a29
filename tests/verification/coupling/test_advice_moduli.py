"""Advice from moduli: against finite elements of many shapes, and against runs."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mesh_writer import write_gmsh22
from strategies import AT_NIGHT, fewer

import verification as vf
from fem1d2d import rectangle
from ndtheory import HypothesisError

youngs = st.integers(1, 100)
poissons = st.fractions("-0.5", "0.45", max_denominator=20)
planes = st.sampled_from(["strain", "stress", "3d"])


def blocks(*, young, poisson, lower=(0, 2), upper=("0.4", "1.6"), cells=((10, 2), (6, 2)), height="0.3", **changes):
    """A body held below and another one pressed from above, with the Neumann problem on the lower one."""
    body = {"shape": "rectangle"}
    contact = {"friction": changes.pop("friction", 0)}
    contact |= {"radius": "0.1"} if contact["friction"] else {}
    return vf.Problem.from_dict(
        {
            "body1": body
            | {"x": list(lower), "y": [f"-{height}", 0], "cells": list(cells[0]), "fixed": ["bottom"]}
            | {"young": young[0], "poisson": poisson[0]},
            "body2": body
            | {"x": list(upper), "y": [0, height], "cells": list(cells[1]), "prescribed": {"top": [0, "-0.015"]}}
            | {"young": young[1], "poisson": poisson[1]},
            "contact": contact | changes.pop("contact", {}),
            "iteration": {"neumann_body": 1, "max_iterations": 2000} | changes,
        }
    )


def both_roles(problem):
    """rho with the Neumann problem on body 1 and on body 2: on one grid the second pencil is the first turned over."""
    measured = vf.measure(problem)
    return measured.rho_max.value, 1 / measured.rho_min.value


# --- the bounds ------------------------------------------------------------------------------------------------------


@given(youngs, youngs, poissons, poissons, planes)
def test_bodies_and_their_numbers_change_places_together(E1, E2, nu1, nu2, plane):
    here = vf.advise_moduli(young=(E1, E2), poisson=(nu1, nu2), plane=plane, mirror=[2])
    there = vf.advise_moduli(young=(E2, E1), poisson=(nu2, nu1), plane=plane, mirror=[1])
    assert [role.rho for role in here.roles] == [role.rho for role in there.roles][::-1]
    assert here.neumann_body == {1: 2, 2: 1, None: None}[there.neumann_body]
    assert here.moduli.roles[0].start == there.moduli.roles[1].start
    assert here.next.theta == there.next.theta


@given(youngs, youngs, poissons, poissons, planes, st.integers(-15, 15))
def test_the_unit_of_stress_changes_nothing_but_the_moduli(E1, E2, nu1, nu2, plane, j):
    given_ = {"poisson": (nu1, nu2), "plane": plane, "mirror": [1, 2]}
    here = vf.advise_moduli(young=(E1, E2), **given_).to_dict()
    scaled = vf.advise_moduli(young=(E1 * Fraction(10) ** j, E2 * Fraction(10) ** j), **given_).to_dict()
    assert here["roles"] == scaled["roles"]
    assert here["moduli"]["roles"] == scaled["moduli"]["roles"]


@given(youngs, youngs, poissons, poissons)
def test_bounds_without_corners_are_the_rationals_rounded_down(E1, E2, nu1, nu2):
    found = vf.advise_moduli(young=(E1, E2), poisson=(nu1, nu2))
    for role, (c, n) in zip(found.roles, (((E2, nu2), (E1, nu1)), ((E1, nu1), (E2, nu2))), strict=True):
        G_c, G_n = (Fraction(E, 2) / (1 + nu) for E, nu in (c, n))
        bound = G_c / G_n * (3 - 4 * n[1])
        assert role.rho.level == "exact"
        assert Fraction(role.rho.lo) <= bound < Fraction(np.nextafter(role.rho.lo, np.inf))
        assert role.rho.hi is None


@given(youngs, youngs, poissons, poissons, planes)
def test_corners_only_raise_the_bounds_and_s_is_above_those_of_sliding(E1, E2, nu1, nu2, plane):
    seen = vf.advise_moduli(young=(E1, E2), poisson=(nu1, nu2), plane=plane, mirror=[1, 2]).moduli
    for role in seen.roles:
        every = role.corners["none"]
        for bounds in role.corners.values():
            assert bounds.stick.value >= every.stick.value
            assert bounds.slide.value >= every.slide.value
        assert role.start.s >= Fraction(every.slide.lo)
        assert 0 <= Fraction(role.start.to_dict()["s"]["hi"]) - role.start.s <= role.start.s * Fraction(2, 2**53)
        assert role.corners["both"].slide == every.slide  # both ends yield alike to a normal force
        assert role.start.guess >= max(role.corners["none"].stick.value, role.corners["both"].stick.value) * (1 - 1e-12)


@pytest.mark.parametrize(("nu1", "nu2", "above"), [("0.3", "0.3", 1.001), ("0.4", "0.1", 2)])
def test_on_flat_meshes_rho_rises_to_the_bounds_in_both_roles_and_beyond_if_poisson_ratios_differ(nu1, nu2, above):
    """Both bodies go on beyond Gamma_c, so that no corner counts."""
    found = vf.advise_moduli(young=(7, 2), poisson=(nu1, nu2))
    rho = []
    for n in (1, 3, 6):
        problem = blocks(
            young=(7, 2),
            poisson=(nu1, nu2),
            upper=(0, 2),
            cells=((20 * n, 2 * n),) * 2,
            contact={"interval": ["0.4", "1.6"]},
        )
        rho.append(both_roles(problem))
    for seen, role in zip(np.transpose(rho), found.roles, strict=True):
        assert list(seen) == sorted(seen)
        assert 0.95 * role.rho.lo < seen[-1] < above * role.rho.lo


def graded(path, layers: int, cells: int):
    """Section 6 on meshes whose cells halve from layer to layer towards both ends of Gamma_c."""
    towards = lambda a, b, n: b + (a - b) * np.append(0, 0.5 ** (np.arange(n * cells, -1, -1) / cells))
    half = towards(1.0, 0.4, layers - 1)
    inside = np.concatenate([half, 2 - half[-2::-1]])
    outside = towards(0.0, 0.4, layers - 1)
    y = towards(0.3, 0.0, layers)
    for name, columns, rows in (
        ("lower", np.concatenate([outside[::-1][:-1], inside, 2 - outside[1:]]), -y[::-1]),
        ("upper", inside, y),
    ):
        count = len(columns) - 1, len(rows) - 1
        mesh = rectangle((0.0, float(count[0])), (0.0, float(count[1])), count)
        column, row = np.rint(mesh.points.T).astype(int)
        write_gmsh22(path / f"{name}.msh", np.column_stack([columns[column], rows[row]]), mesh.cells, mesh.sides)
    return vf.Problem.from_dict(
        {
            "body1": {"mesh": str(path / "lower.msh"), "young": 7, "poisson": "0.3", "fixed": ["bottom"]},
            "body2": {"mesh": str(path / "upper.msh"), "young": 2, "poisson": "0.3"}
            | {"prescribed": {"top": [0, "-0.015"]}},
            "contact": {"friction": 0, "interval": ["0.4", "1.6"]},
            "iteration": {"neumann_body": 1},
        }
    )


def test_on_graded_meshes_corners_raise_rho_towards_their_bounds_with_and_without_friction(tmp_path):
    """One over the root of the distance to the bound grows alike with each two layers: the distance is 1/log^2 h."""
    bounds = vf.advise_moduli(young=(7, 2), poisson=("0.3", "0.3"), corners="2").moduli.roles[1].corners
    upper = [vf.measure(graded(tmp_path, layers, 3).swapped()) for layers in (3, 5, 7)]
    for name, kind in (("rho_max", "stick"), ("rho_normal", "slide")):
        seen = [getattr(measured, name).value for measured in upper]
        limit = getattr(bounds["2"], kind).value
        assert getattr(bounds["none"], kind).value < seen[0] < seen[1] < seen[2] < limit
        growth = np.diff([(limit - rho) ** -0.5 for rho in seen])
        assert 0.75 < growth[1] / growth[0] < 1.25, (name, seen, limit)
    for measured in upper:  # the corners add nothing in the other role
        assert 1 / measured.rho_min.value < 18 / 35


# --- the mirror image ------------------------------------------------------------------------------------------------


@st.composite
def mirrored(draw):
    """Blocks of one height: the mirror image of the upper mesh refines the lower one, diagonals too."""
    rows, columns, finer = draw(st.integers(1, 3)), draw(st.integers(2, 10)), draw(st.sampled_from([1, 1, 2]))
    left = 2 * draw(st.integers(0, 2)) + rows % 2
    right = draw(st.integers(0, 4))
    width, height = draw(st.sampled_from(["0.1", "0.3", "1"])), draw(st.sampled_from(["0.2", "0.5", "2"]))
    w = Fraction(width)
    return blocks(
        young=(draw(youngs), draw(youngs)),
        poisson=(draw(poissons), draw(poissons)),
        lower=(0, str((left + columns + right) * w)),
        upper=(str(left * w), str((left + columns) * w)),
        cells=((left + columns + right, rows), (columns * finer, rows * finer)),
        height=height,
    )


def advised(problem, **given_):
    bodies = problem.body1, problem.body2
    return vf.advise_moduli(young=[b.young for b in bodies], poisson=[b.poisson for b in bodies], mirror=[2], **given_)


@fewer(2, at_night=1)
@given(mirrored())
def test_where_the_mirror_image_fits_rho_normal_is_at_most_s_on_nested_meshes(problem):
    start = advised(problem).moduli.roles[0].start
    assert vf.measure(problem).rho_normal.value <= float(start.s) * (1 + 1e-8)


@fewer(2, at_night=1)
@given(mirrored())
def test_with_friction_the_guess_is_not_below_rho_of_any_block(problem):
    """A block may be a slender column: no guess from a layer has that."""
    assert vf.measure(problem).rho_max.value <= advised(problem).moduli.roles[0].start.guess


def test_rho_of_columns_rises_to_the_guess_and_a_flat_layer_is_far_from_it():
    rho = {}
    for height in ("0.25", "1", "4", "16"):
        aligned = blocks(
            young=(1, 1), poisson=("0.3", "0.3"), lower=(0, 1), upper=(0, 1), cells=((4, 48),) * 2, height=height
        )
        rho[height] = vf.measure(aligned).rho_max.value
    guess = {flat: advised(aligned, flat=flat).moduli.roles[0].start.guess for flat in (False, True)}
    assert rho["0.25"] < rho["1"] < rho["4"] < rho["16"] < guess[False]
    assert rho["16"] > 0.95 * guess[False]
    assert rho["0.25"] < guess[True] < rho["4"]


@pytest.mark.parametrize("nu", ["0.3", "0.49"])
def test_without_friction_the_theta_to_start_with_contracts_by_its_factor(nu):
    problem = blocks(young=(7, 2), poisson=(nu, nu))
    found = advised(problem, corners="2", flat=True)
    start = found.moduli.roles[0].start
    assert found.best.theta_proved == pytest.approx(2 / (2 + 2 / 7))
    assert found.best.factor_proved.value == pytest.approx(1 / 8)
    for theta in (start.theta_free, start.theta_guess):
        run = vf.run(problem.with_theta(str(theta)))
        assert run.converged
        assert run.observed_rate.value <= start.factor_free(theta).hi * (1 + 1e-3)


@pytest.mark.parametrize(
    ("young", "height"), [((7, 2), "0.3"), ((1, 5), "3"), *([((7, 2), "3"), ((1, 5), "0.3"), ((1, 1), "3")] * AT_NIGHT)]
)
def test_with_friction_runs_at_the_guess_converge_on_layers_and_columns(young, height):
    problem = blocks(
        young=young,
        poisson=("0.3", "0.3"),
        lower=(0, 1),
        upper=(0, 1),
        cells=((10, 4),) * 2,
        height=height,
        friction="0.4",
    )
    start = advised(problem, corners="both", flat=height == "0.3").moduli.roles[0].start
    assert vf.run(problem.with_theta(str(start.theta_guess))).converged


# --- what is advised -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("young", "rho", "bound"), [((70000, 20000), 15.1, 6.3), ((20000, 20000), 4.31, 1.8)])
def test_two_over_two_plus_bound_stalls_on_a_soft_upper_body_and_is_never_advised(young, rho, bound):
    """rho is far above its bound there; the run that is named instead converges."""
    problem = vf.example("section6").changed(young=young, neumann_body=2, cells=((40, 6), (24, 6)))
    assert vf.measure(problem).rho_max.value == pytest.approx(rho, rel=0.01)
    found = vf.advise_moduli(young=young, poisson=("0.3", "0.3"))
    assert found.roles[1].rho.value == pytest.approx(bound)
    stalls = 2 / (2 + bound)
    assert not vf.run(problem.with_theta(f"{stalls:.4f}")).converged
    named = {}
    for corners in (None, "none", "1", "2", "both"):
        asked = vf.advise_moduli(young=young, poisson=("0.3", "0.3"), corners=corners)
        for role in asked.roles:
            assert role.theta_proved is None
            assert role.theta_predicted is None
        with pytest.raises(ValueError, match="predicts no theta"):
            _ = asked.best.predicted
        named |= {(asked.neumann_body or 2, asked.next.theta): corners}
    for body, theta in named:
        assert vf.run(problem.changed(neumann_body=body).with_theta(str(theta))).converged


def test_the_role_with_the_smaller_bound_is_tried_first_and_equal_bounds_are_no_advice():
    assert vf.advise_moduli(young=(7, 2), poisson=("0.3", "0.3")).neumann_body == 1
    assert vf.advise_moduli(young=(2, 7), poisson=("0.3", "0.3")).neumann_body == 2
    same = vf.advise_moduli(young=(2, 2), poisson=("0.3", "0.3"))
    assert same.neumann_body is None
    assert "same bounds" in same.to_dict()["reason"]["neumann_body"]
    # the body that goes on beyond the ends is the better Neumann body then
    assert vf.advise_moduli(young=(2, 2), poisson=("0.3", "0.3"), corners="2").neumann_body == 1
    assert vf.advise_moduli(young=(2, 2), poisson=("0.3", "0.3"), corners="1").neumann_body == 2


def test_roles_may_be_tried_the_other_way_round_without_friction():
    """An almost incompressible body resists a normal load more than another one of its shear modulus."""
    found = vf.advise_moduli(young=(10, 11), poisson=("0.49", "0"))
    assert (found.neumann_body, found.moduli.smaller("slide")) == (1, 1)
    found = vf.advise_moduli(young=(100, 82), poisson=("0", "0.49"))
    assert found.neumann_body != found.moduli.smaller("slide")


def test_an_incompressible_body_is_held_by_no_multiple_of_a_compressible_one():
    found = vf.advise_moduli(young=(1, 1), poisson=("1/2", "0.3"), mirror=[1, 2])
    rubber, other = found.moduli.roles
    assert rubber.start is not None  # the Neumann body is incompressible
    assert other.start is None
    assert "body 1 is incompressible" in other.why_no_start
    stress = vf.advise_moduli(young=(1, 1), poisson=("1/2", "0.3"), plane="stress", mirror=[1, 2])
    assert all(role.start for role in stress.moduli.roles)  # no volume is kept in plane stress


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"young": "1,2"}, "young = 1,2: needed two numbers"),
        ({"young": 7}, "young = 7: needed two numbers"),
        ({"young": (1, "1e30")}, r"young = 1\S*: needed numbers E > 0 \(1e-24 to 1e24\)"),
        ({"young": (1, float("nan"))}, "young = nan"),
        ({"poisson": (-1, "0.3")}, "poisson = -1"),
        ({"plane": "shell"}, "plane = shell: needed one of strain, stress, 3d"),
        ({"corners": "3"}, "corners = 3: needed one of none, 1, 2, both"),
        ({"mirror": [3]}, r"mirror = \[3\]: needed bodies 1, 2 or both"),
        ({"flat": True}, "flat = True: needed a mirror image"),
    ],
)
def test_what_no_two_bodies_have_is_refused_by_name(changed, words):
    with pytest.raises(HypothesisError, match=words):
        vf.advise_moduli(**{"young": (1, 2), "poisson": ("0.3", "0.3")} | changed)


@given(
    st.tuples(*[st.sampled_from(["1e-24", "1", "1e24"])] * 2),
    st.tuples(*[st.sampled_from(["-0.999999999999", "0", "0.499999999999", "1/2"])] * 2),
    planes,
)
def test_extreme_moduli_have_finite_answers(young, poisson, plane):
    found = vf.advise_moduli(young=young, poisson=poisson, plane=plane, mirror=[1, 2])
    assert "NaN" not in found.to_json()
    assert "Infinity" not in found.to_json()
    assert 0 < found.next.theta < 1
    with pytest.raises(ValueError, match="bound rho from below"):
        found.plot()


# --- heat ------------------------------------------------------------------------------------------------------------

conductivities = st.tuples(st.integers(1, 100), st.integers(1, 100))


@fewer(2)
@given(conductivities, conductivities, st.tuples(st.integers(1, 9), st.integers(1, 9)), st.integers(1, 50))
def test_plates_coupled_by_the_advised_theta_contract_by_the_proved_factor(k, c, d, hundredths):
    """Plates with both other sides held: waves of any length, and the residual in the energy of the Neumann body."""
    dt = Fraction(hundredths, 100)
    found = vf.advise_moduli(conductivity=k, capacity=c, thickness=d, dt=dt)
    q = np.array([0.0, 0.1, 0.5, 1.0, 3.0, 10.0, 100.0])
    conductance = []
    for of, capacity, depth in zip(k, c, d, strict=True):
        p = np.sqrt(q**2 + capacity / (of * float(dt)))
        conductance.append(of * p / np.tanh(p * depth))
    contact, neumann = (conductance[body - 1] for body in (3 - found.neumann_body, found.neumann_body))
    run = vf.couple(
        lambda flux: flux / neumann,
        lambda temperature: 1 - contact * temperature,
        start=np.zeros(len(q)),
        rule="constant",
        theta=found.theta,
        tolerance=1e-9,
        max_iterations=2000,
    )
    assert run.converged
    factor = np.abs(1 - found.theta * (1 + contact / neumann)).max()
    assert factor <= found.best.rate_tied + 2e-3  # theta is rounded to four figures, and at most 0.99
    assert found.best.rho_min.value * (1 - 1e-12) <= (contact / neumann).min()
    assert (contact / neumann).max() <= found.best.rho_tied.value * (1 + 1e-12)


@pytest.mark.parametrize("k", [(50, 1), (1, 50), (3, 3)])
def test_both_plates_run_at_once_contract_by_the_factor_of_parallel_coupling(k):
    found = vf.advise_moduli(conductivity=k, capacity=(2, 1), parallel=True)
    one = next(one for one in found.parallel if one.neumann_body == found.neumann_body)
    q = np.geomspace(1e-3, 1e3, 30)
    S = [np.sqrt(of**2 * q**2 + of * capacity) for of, capacity in zip(k, (2, 1), strict=True)]
    contact, neumann = (S[body - 1] for body in (3 - found.neumann_body, found.neumann_body))
    flux, temperature, sizes = np.ones(30), np.zeros(30), []
    for _ in range(60):
        new = flux / neumann, -contact * temperature
        temperature, flux = (old + one.theta * (n - old) for old, n in zip((temperature, flux), new, strict=True))
        sizes.append(np.sqrt((flux**2 / neumann + contact**2 * temperature**2 / contact).sum()))
    assert (sizes[-1] / sizes[19]) ** (1 / 40) <= one.factor * (1 + 1e-6)
    with pytest.raises(ValueError, match="serial coupling"):
        found.snippet("preCICE")
