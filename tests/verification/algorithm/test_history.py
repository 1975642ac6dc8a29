"""A loading history: each increment is a problem of the theorem's kind, and the global method finds the same path."""

import json
import pickle
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from histories import PATH, VARIANTS, pressed_and_sheared
from hypothesis import given
from hypothesis import strategies as st
from problem_list import LOWER, bars, changed

import verification as vf
from fem1d2d import condense
from verification.algorithm.fixed_point import FixedPointMap, iterate_at
from verification.algorithm.history import History
from verification.algorithm.rates import noise
from verification.algorithm.start import LEAST, tied_size
from verification.interface.files import write_interface
from verification.problem.steps import at_rest, moments
from verification.testing.strategies import SEEDS, forces, matrix_pairs


def problem(path=PATH, times=1, **tables):
    return vf.Problem.from_dict(pressed_and_sheared(path, times, **tables))


@pytest.fixture(scope="module")
def twins():
    """The same history by both methods."""
    whole = problem()
    return vf.march(whole), vf.march(whole, method="monolithic")


def apart(one: History, two: History, *names: str) -> float:
    """The largest difference of stresses (or slips), relative to the largest traction (or slip)."""
    assert len(one.increments) == len(two.increments)
    size = max(np.abs(two.fields[name]).max() for name in names)
    return max(np.abs(one.fields[name] - two.fields[name]).max() for name in names) / size


# --- the map of an increment ------------------------------------------------------------------------------------------


def with_loads(pair, random):
    """The pair under other loads on both bodies."""
    neumann = replace(pair.neumann, load=pair.neumann.load + random.normal(size=pair.neumann.grid.size))
    return replace(
        pair, contact=replace(pair.contact, load=random.normal(size=pair.contact.grid.size)), neumann=neumann
    )


@given(st.data())
def test_the_image_of_a_force_stays_when_slip_is_measured_from_the_slip_of_that_force(data):
    pair = data.draw(matrix_pairs())
    g = data.draw(forces(pair))
    before = iterate_at(FixedPointMap(pair), g)
    slipped = pair.normal_sign * before.contact.v[pair.contact.grid.tangential]
    after = iterate_at(FixedPointMap(replace(pair, interface=replace(pair.interface, slipped=slipped))), g)
    size = np.abs(before.image).max() + np.abs(pair.contact.schur).max() * np.abs(before.displacement).max()
    assert np.abs(after.image - before.image).max() <= 1e-10 * size
    length = np.abs(before.contact.v).max() + np.abs(before.displacement).max()
    assert np.abs(after.contact.v[pair.contact.grid.tangential]).max() <= 1e-10 * length


@given(st.data())
def test_the_first_residual_of_an_increment_is_bounded_by_the_energy_of_the_jump_that_its_loads_cause(data):
    pair = data.draw(matrix_pairs())
    g, random = data.draw(forces(pair)), np.random.default_rng(data.draw(SEEDS))
    other = with_loads(pair, random)
    images = [iterate_at(FixedPointMap(each), g).image for each in (pair, other)]
    jumps = [each.contact.unloaded - each.interface.carry(each.neumann.unloaded) for each in (pair, other)]
    change = jumps[1] - jumps[0]
    bound = np.sqrt(vf.measure(pair).rho_max.value * (change @ pair.contact.schur @ change))
    rounding = noise(pair, iterate_at(FixedPointMap(pair), g)) + noise(other, iterate_at(FixedPointMap(other), g))
    assert pair.neumann.dual_norm(images[1] - images[0]) <= bound * (1 + 1e-9) + 100 * rounding


def test_that_bound_is_not_far_where_all_nodes_stick():
    path = {"press": (1, [0, "-0.01"]), "a bit more": (1, [0, "-0.011"])}
    second = vf.march(problem(path, contact={"friction": "5"})).increments[1]
    assert second.contact.pattern["stick"] == len(second.contact.x)
    assert 0.5 * second.promise.residual < second.result.iterates[0].residual <= second.promise.residual


def test_one_sliding_node_between_two_springs_follows_the_element_of_jenkins():
    s_c, s_n, pressing, k = 3.0, 2.0, 5.0, Fraction(1, 5)
    pair = vf.build(
        S1=np.diag([s_c, 1.0]),
        S2=np.diag([s_n, 1e3]),
        x=np.array([0.0]),
        weights=np.array([1.0]),
        kernel=np.eye(1),
        friction=k,
    )
    stiff, slipped, force, before = s_c * s_n / (s_c + s_n), 0.0, 0.0, 0.0
    for moved in (0.3, 0.9, 2.0, 1.5, -0.5, -2.0, 0.0, 2.0):
        load = np.array([s_n * moved, -1e3 * pressing])
        now = replace(
            pair,
            neumann=replace(pair.neumann, load=load),
            interface=replace(pair.interface, slipped=np.array([slipped])),
        )
        run = vf.run(replace(now, settings=replace(now.settings, tolerance=1e-13)), theta="0.4")
        bound = float(k) * run.contact.pressure[0]
        force = np.clip(force + stiff * (moved - before), -bound, bound)
        assert run.contact.shear[0] == pytest.approx(-force, abs=1e-9 * pressing)
        assert run.contact.slip[0] == pytest.approx(force / stiff - moved, abs=1e-8)
        assert run.contact.slip_increment[0] == pytest.approx(run.contact.slip[0] - slipped, abs=1e-12)
        slipped, before = float(run.contact.slip[0]), moved


# --- loads ------------------------------------------------------------------------------------------------------------

LOADED = {
    "body1": {"body_force": [3, -4]},
    "body2": {"traction": {"right": [50, 20]}, "prescribed": {"top": ["0.002", "-0.012"]}, "body_force": [1, 2]},
}


@pytest.mark.parametrize("roles", [1, 2])
def test_loads_change_as_if_the_bodies_were_assembled_anew(roles):
    rest = vf.Problem.from_dict(changed(iteration={"neumann_body": roles}))
    loaded = vf.Problem.from_dict(changed(iteration={"neumann_body": roles}, **LOADED))
    pair, anew = vf.build(rest).under(loaded), vf.build(loaded)
    for one, two in ((pair.contact, anew.contact), (pair.neumann, anew.neumann)):
        assert np.abs(one.load - two.load).max() <= 1e-12 * np.abs(two.load).max()
        assert np.array_equal(one.known, two.known)
        assert np.array_equal(one.schur, two.schur)
    assert apart_solutions(vf.solve(pair), vf.solve(loaded)) <= 1e-11
    assert vf.run(pair).iterations == vf.run(anew).iterations


def apart_solutions(one, two):
    pressed = np.abs(one.contact.pressure - two.contact.pressure).max() / np.abs(two.contact.pressure).max()
    moved = max(
        np.abs(a - b).max() / np.abs(b).max() for a, b in zip(one.displacements, two.displacements, strict=True)
    )
    return max(pressed, moved)


@pytest.mark.parametrize("method", ["iteration", "monolithic"])
def test_bodies_are_factorised_once_however_many_increments_there_are(monkeypatch, method):
    made, factorise = [], condense.splu
    monkeypatch.setattr(condense, "splu", lambda *given, **options: made.append(1) or factorise(*given, **options))
    counts = []
    for times in (1, 2):
        made.clear()
        found = vf.march(problem(times=times, body1={"cells": [20, 6]}, body2={"cells": [12, 8]}), method=method)
        assert all(field is not None for each in found.increments for field in each.result.displacements)
        counts.append(len(made))
    assert counts[0] == counts[1] > 0


# --- the path ---------------------------------------------------------------------------------------------------------


def test_an_increment_measures_slip_from_the_one_before_and_starts_from_its_forces(twins):
    for history in twins:
        slip = history.fields["slip"]
        assert np.abs(np.diff(slip, axis=0) - history.fields["slip_increment"][1:]).max() <= 1e-15
        assert np.array_equal(slip[0], history.fields["slip_increment"][0])
    runs = [each.result for each in twins[0].increments]
    assert all(np.array_equal(one.last.g, two.start.g) for one, two in pairwise(runs))


@pytest.mark.parametrize("name", VARIANTS)
def test_iteration_and_global_method_agree_to_1e_8_of_the_largest_traction(name):
    whole = problem(**VARIANTS[name])
    one, two = (vf.march(whole, method=method) for method in ("iteration", "monolithic"))
    assert one.converged, one.ended
    assert two.converged
    assert apart(one, two, "pressure", "shear") <= 1e-8
    assert apart(one, two, "slip") <= 1e-8
    assert {state for each in two.increments for state in each.contact.status} == {"stick", "slip", "open"}


def test_over_100_increments_they_agree_as_well():
    path = {name: (count, top) for (name, (_, top)), count in zip(PATH.items(), (16, 16, 28, 28, 12), strict=True)}
    one, two = (vf.march(problem(path), method=method) for method in ("iteration", "monolithic"))
    assert len(one.increments) == 100
    assert apart(one, two, "pressure", "shear") <= 1e-8


def test_the_law_of_the_contact_grid_on_grids_that_differ_is_left_to_the_global_method():
    whole = problem(body2={"cells": [7, 2]}, contact={"law": "local-contact", "radius": None})
    assert vf.march(whole, method="monolithic").converged
    with pytest.raises(vf.ProblemError, match=r"contact\.law"):
        vf.march(whole)


def test_an_increment_without_load_changes_nothing():
    path = {"press": (2, [0, "-0.01"]), "shear": (4, ["0.006", "-0.01"]), "rest": (2, ["0.006", "-0.01"])}
    for method in ("iteration", "monolithic"):
        found = vf.march(problem(path), method=method)
        assert found.converged
        *_, last, first, second = found.increments
        assert last.contact.pattern["slip"] > 0  # at their bound, from which a shift of 0 must not move them
        for each in (first, second):
            for name in ("pressure", "shear", "slip"):
                was, now = getattr(last.contact, name), getattr(each.contact, name)
                assert np.abs(now - was).max() <= 1e-9 * np.abs(was).max()
            assert each.promise is None or (each.promise.load, each.iterations, each.promise.steps) == (0, 0, 0)


def test_an_elastic_leg_may_be_cut_into_any_number_of_increments():
    before = {"press": (3, [0, "-0.01"]), "shear": (4, ["0.004", "-0.01"])}
    ends = []
    for count in (1, 2, 5, 16):
        path = before | {"back": (count, ["0.0035", "-0.01"])}
        found = vf.march(problem(path, iteration={"tolerance": 1e-12})).increments
        assert all(each.contact.pattern["slip"] == 0 for each in found[7:])
        ends.append(found[-1].contact)
    for name in ("pressure", "shear", "slip"):
        whole = getattr(ends[0], name)
        assert all(np.abs(getattr(end, name) - whole).max() <= 1e-10 * np.abs(whole).max() for end in ends)


def test_one_proportional_loading_is_what_the_static_law_says():
    static = vf.solve(vf.Problem.from_dict(changed(iteration={"tolerance": 1e-11}))).contact
    for count in (1, 7):
        path = {"press": (count, [0, "-0.015"])}
        found = vf.march(problem(path, iteration={"tolerance": 1e-11})).increments[-1].contact
        for name in ("pressure", "shear", "slip"):
            assert (
                np.abs(getattr(found, name) - getattr(static, name)).max() <= 1e-9 * np.abs(getattr(static, name)).max()
            )


def test_after_unloading_the_static_law_has_another_shear():
    path = {"press": (4, [0, "-0.01"]), "half": (4, [0, "-0.005"])}
    found = vf.march(problem(path)).increments
    largest = max(np.abs(each.contact.shear).max() for each in found)
    static = vf.solve(found[-1].result.problem).contact
    assert np.abs(static.shear - found[-1].contact.shear).max() > 0.3 * largest
    assert np.abs(static.pressure - found[-1].contact.pressure).max() < 0.1 * static.pressure.max()


def test_a_cycle_of_small_shear_shakes_down_and_a_large_one_takes_work_for_ever():
    def taken(size):
        there, back = [size, "-0.01"], [f"-{size}", "-0.01"]
        path = {"press": (3, [0, "-0.01"])} | {f"{i}": (6, back if i % 2 else there) for i in range(5)}
        found = vf.march(problem(path))
        return [sum(each.dissipated for each in found.increments if each.step == i) for i in range(2, 7)]

    small, large = taken("0.001"), taken("0.008")
    assert small[0] > 0
    assert small[3] + small[4] <= 1e-6 * small[0]
    assert large[3] == pytest.approx(large[4], rel=1e-3)
    assert large[4] > 0.1 * large[0]


# --- ends and documents -----------------------------------------------------------------------------------------------


def test_bars_have_histories_too():
    data = bars(iteration={"theta": "1/5"}) | {
        "step": [
            {"increments": 3, "body2": {"prescribed": {"right": "-1/10"}}},
            {"increments": 2, "body2": {"prescribed": {"right": "1/10"}}},
        ]
    }
    one, two = (vf.march(vf.Problem.from_dict(data), method=method) for method in ("iteration", "monolithic"))
    assert apart(one, two, "pressure") <= 1e-9
    assert [each.contact.status[0] for each in one.increments] == ["slip", "slip", "slip", "open", "open"]
    assert one.plot().axes[0].get_ylabel() == "normal force [MPa]"


def test_along_an_upright_line_the_displacement_that_slides_the_bodies_drives_the_loop():
    box = lambda x, **more: LOWER | {"x": x, "y": [0, 1], "cells": [3, 4]} | more
    left = box([-1, 0], fixed=["left"])
    right = box([0, 1], young=20000, prescribed={"right": ["-0.005", 0]})
    tops = [["-0.005", 0], ["-0.005", "0.002"]]
    data = {
        "body1": left,
        "body2": right,
        "contact": {"friction": "0.2", "radius": "0.3", "surface": ["right", "left"]},
        "step": [{"increments": 2, "body2": {"prescribed": {"right": top}}} for top in tops],
    }
    found = vf.march(vf.Problem.from_dict(data), method="monolithic")
    label, values, axis = found.driven
    assert (label, axis) == ("displacement of right of body2 along y", 0)
    assert values == pytest.approx([0, 0, 0, 0.001, 0.002])


def test_an_obstacle_has_a_history_by_the_global_method():
    data = pressed_and_sheared(body1={"shape": "rigid", **dict.fromkeys(("cells", "young", "poisson", "fixed"))})
    found = vf.march(vf.Problem.from_dict(data), method="monolithic")
    assert found.converged
    assert found.increments[-1].contact.pattern["open"] == 7
    with pytest.raises(vf.ProblemError, match="rigid"):
        vf.march(vf.Problem.from_dict(data))


def test_a_history_is_pickled_tabled_and_written_as_a_document(twins):
    for history in twins:
        again = pickle.loads(pickle.dumps(history))
        assert again.to_json() == history.to_json()
        field, same = (each.increments[-2].result.displacements[1] for each in (history, again))
        assert np.abs(same - field).max() <= 1e-12 * np.abs(field).max()
        document = json.loads(history.to_json())
        assert document["schema"] == "ndtheory.history/1"
        assert [each["time"] for each in document["increments"]][:7] == pytest.approx([*(np.arange(1, 7) / 6), 1.2])
        assert document["increments"][-1]["time"] == len(PATH)
        assert [each["step"] for each in document["increments"]] == [1] * 6 + [2] * 5 + [3] * 8 + [4] * 8 + [5] * 3
        assert vf.Problem.from_dict(document["problem"]) == history.problem
        table = history.table()
        assert {len(column) for column in table.values()} == {30}
        assert {len(column) for column in history.contact_table().values()} == {30 * 7}


def test_a_problem_without_steps_and_a_pair_of_matrices_have_no_history():
    with pytest.raises(vf.ProblemError, match=r"step: needed \[\[step\]\] tables"):
        vf.march(vf.Problem.from_dict(changed()))
    with pytest.raises(ValueError, match="made from matrices"):
        vf.march(vf.build(S1=np.eye(2), S2=np.eye(2), x=np.zeros(1)))
    with pytest.raises(ValueError, match="method 'newton'"):
        vf.march(problem(), method="newton")


def test_a_pair_keeps_its_own_gap_and_law():
    whole = problem()
    pair = vf.build(whole)
    open_one = replace(pair, interface=replace(pair.interface, gap=pair.interface.gap + 0.02))
    assert vf.march(open_one).increments[5].contact.force["normal"] == 0
    assert vf.march(pair).to_json() == vf.march(whole).to_json()


def test_a_run_that_does_not_converge_ends_the_history():
    found = vf.march(problem(iteration={"max_iterations": 3}))
    assert not found.converged
    assert [each.outcome for each in found.increments] == ["limit"]
    assert "increment 1 of 30" in found.ended


def test_ctrl_c_keeps_the_increments_that_are_done():
    def watch(increment, planned):
        if increment.time == 1:
            raise KeyboardInterrupt

    found = vf.march(problem(), watch=watch)
    assert found.interrupted
    assert (len(found.increments), found.planned) == (6, 30)
    assert json.loads(found.to_json())["ended"] == "interrupted after increment 6 of 30"


def test_an_increment_that_has_no_solution_ends_the_history_with_the_reason():
    data = pressed_and_sheared(body2={"prescribed": {"top": ["free", "-0.01"]}})
    pull = {"top": ["free", "-0.01"]}
    data["step"] = [
        {"name": "press", "increments": 2, "body2": {"prescribed": pull}},
        {"name": "pull", "increments": 2, "body2": {"prescribed": pull, "traction": {"right": [5000, 0]}}},
    ]
    found = vf.march(vf.Problem.from_dict(data))
    assert not found.converged
    assert len(found.increments) >= 2
    assert "moves" in found.ended or "move" in found.ended


def test_slip_so_far_survives_changes_of_the_pair_and_its_file(tmp_path):
    whole = problem()
    run = vf.march(whole).increments[10].result
    pair = run.pair
    assert np.abs(pair.interface.slipped).max() > 0
    for other in (pair.swapped(), pair.changed(young=(None, 30000)), pair.at(friction="0.1")):
        assert np.array_equal(other.interface.slipped, pair.interface.slipped)
    one, two = vf.solve(pair).contact, vf.solve(pair.swapped()).contact
    assert np.abs(one.shear - two.shear).max() <= 1e-9 * np.abs(one.shear).max()
    swapped = vf.run(pair.swapped(), theta="0.1").contact
    assert np.abs(one.shear - swapped.shear).max() <= 1e-6 * np.abs(one.shear).max()
    write_interface(pair, tmp_path / "interface.npz")
    assert np.array_equal(vf.build(tmp_path / "interface.npz").interface.slipped, pair.interface.slipped)
    with pytest.raises(vf.ProblemError, match="contact"):
        pair.changed(cells=((20, 2), (12, 2)))


def test_moments_are_equal_increments_between_exact_loads():
    whole = problem()
    every = list(moments(whole))
    assert every[0].problem.body2.prescribed["top"] == (0, Fraction(-1, 600))
    assert every[5].problem.body2.prescribed["top"] == (0, Fraction(-1, 100))
    assert every[6].problem.body2.prescribed["top"] == (Fraction(4, 5000), Fraction(-1, 100))
    assert at_rest(whole).body2.prescribed["top"] == (0, 0)
    assert not every[0].problem.steps
    assert [each.time for each in every[:3]] == [Fraction(i, 6) for i in (1, 2, 3)]


def test_warnings_name_the_worst_state_of_the_history_once():
    path = {"press": (8, [0, "-0.04"])}
    found = vf.march(problem(path))
    strains = [each.result.checks.largest_strain for each in found.increments]
    told = [line for line in found.warnings if "strain" in line]
    assert sum(strain > 0.05 for strain in strains) > 1
    assert told == [line for line in found.increments[-1].result.warnings if "strain" in line]


def test_bodies_that_part_are_warned_of_only_where_they_never_meet():
    lifts = {"press": (1, [0, "-0.01"]), "lift": (1, [0, "0.01"])}
    far = {"near": (1, [0, "-0.001"]), "nearer": (1, [0, "-0.002"])}
    apart = {"contact": {"gap": "0.005"}}
    for method in ("iteration", "monolithic"):
        for path, more, said in ((lifts, {}, 0), (lifts, apart, 0), (far, apart, 1)):
            found = vf.march(problem(path, **more), method=method)
            assert sum("nothing touches" in line for line in found.warnings) == said


@pytest.mark.parametrize("end", ["-0.02", "-0.010000000001"])
def test_a_history_goes_on_where_contact_just_closes_or_just_opens(end):
    """After the first increment, and before the last one, the gap is 0 up to rounding."""
    finer = {"body1": {"cells": [30, 2]}, "body2": {"cells": [18, 2]}, "contact": {"gap": "0.01"}}
    path = {"press": (2, [0, end]), "lift": (2, [0, 0])}
    one, two = (vf.march(problem(path, **finer), method=method) for method in ("iteration", "monolithic"))
    assert one.converged
    assert len(one.increments) == 4
    force = np.array([[each.contact.force["normal"] for each in history.increments] for history in (one, two)])
    assert force[0] == pytest.approx(force[1], abs=1e-9 * force.max() + 1e-10)
    assert one.increments[0].run.iterations < 3


def test_forces_small_beside_the_largest_of_a_history_are_none_and_others_are_not():
    """A residual ends at the tolerance times LEAST of the largest force, tied or of an increment before."""
    path = {"press": (1, [0, "-0.01"]), "ease": (1, [0, "-0.001"]), "lift": (1, [0, "0.01"])}
    found = vf.march(problem(path))
    press, ease, lift = (each.run for each in found.increments)
    largest = max(tied_size(each.pair) for each in (press, lift))
    assert largest > press.last.size > 2 * ease.last.size
    for run in (press, ease, lift):
        assert run.start.scale == pytest.approx(LEAST * largest, rel=1e-9)
    assert lift.last.scale == lift.start.scale
    assert lift.last.residual <= 1e-9 * lift.start.scale < lift.iterates[-2].residual
    slight = {"press": (1, [0, "-0.02"]), "ease": (1, [0, "-0.0100001"])}
    last = vf.march(problem(slight, contact={"gap": "0.01"})).increments[-1].run.last
    assert last.scale < 1e-4 * largest
    assert last.scale == pytest.approx(last.size, rel=1e-8)
