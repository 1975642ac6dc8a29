"""Warnings: what linear triangles cannot do near nu = 1/2, and what the kernel of the friction law does to friction."""

import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mesh_writer import write_curved, write_gmsh22
from problem_list import SHEARED, changed, plates

import verification as vf
from fem1d2d import rectangle
from verification.algorithm.monolithic import contact_system
from verification.cli.problems import examples
from verification.interface.assembly import LOCKING, PRESSURE_ERRORS, RATIOS, discretise
from verification.interface.friction import SHARE


def warned(data):
    return discretise(vf.Problem.from_dict(data)).warnings


# --- Poisson ratios near 1/2 ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("lower", "upper", "named"),
    [
        ("0.3", "0.3", None),
        ("0.449", "0.44", None),
        ("0.45", "0.3", "body1.poisson = 0.45"),
        ("0.3", "0.4999", "body2.poisson = 0.4999"),
        ("0.49", "0.499", "body1.poisson = 0.49 and body2.poisson = 0.499"),
    ],
)
def test_a_poisson_ratio_of_045_or_more_is_warned_of_by_its_key(lower, upper, named):
    warnings = warned(plates(body1={"poisson": lower}, body2={"poisson": upper}))
    assert warnings == [] if named is None else warnings[0].startswith(f"{named}: near 1/2 linear triangles ")
    assert len(warnings) == (named is not None)


def split(path, x, y, cells, both):
    """A rectangle whose cells are split by both diagonals or by one direction of them, as a mesh file."""
    mesh = rectangle(x, y, cells)
    node = np.arange((cells[0] + 1) * (cells[1] + 1)).reshape(cells[0] + 1, -1)
    sw, se, nw, ne = (block.ravel() for block in (node[:-1, :-1], node[1:, :-1], node[:-1, 1:], node[1:, 1:]))
    points, corners = mesh.points, [(sw, se, ne), (sw, ne, nw)]
    if both:
        middle = len(points) + np.arange(len(sw))
        points = np.concatenate([points, (points[sw] + points[ne]) / 2])
        corners = [(sw, se, middle), (se, ne, middle), (ne, nw, middle), (nw, sw, middle)]
    triangles = np.concatenate([np.column_stack(three) for three in corners])
    write_gmsh22(path, points, triangles, mesh.sides)
    return str(path)


def test_near_one_half_nothing_is_warned_of_where_all_cells_are_split_by_both_diagonals(tmp_path):
    data = plates(body1={"poisson": "0.49"}, body2={"poisson": "0.3"})
    for key in ("shape", "x", "y", "cells"):
        del data["body1"][key]
    for both in (True, False):
        data["body1"]["mesh"] = split(tmp_path / f"{both}.msh", (0.0, 2.0), (-0.3, 0.0), (20, 3), both)
        assert warned(data) == [] if both else "split by both diagonals" in warned(data)[0]


def pressures(poisson, cells, diagonals):
    """Gamma_c of the model of Section 6 with so many cells along it, and one Poisson's ratio."""
    data = vf.example("section6").to_dict()
    for name, most in (("body1", (40, 6)), ("body2", (24, 6))):
        data[name] |= {"poisson": poisson, "cells": [n * cells // 24 for n in most], "split": diagonals}
    return vf.solve(vf.Problem.from_dict(data)).contact


@pytest.mark.parametrize("i", [0, 2, 3])
def test_the_errors_of_pressure_in_a_hint_are_those_of_the_model(i):
    """Root mean squares over the middle three quarters, against three times as many cells split by both diagonals."""
    fine = pressures(str(RATIOS[i]), 72, "both")
    middle = lambda contact: (contact.x > 0.55) & (contact.x < 1.45)
    for diagonals, errors in zip(("alternating", "both"), PRESSURE_ERRORS["rectangle"], strict=False):
        found = pressures(str(RATIOS[i]), 24, diagonals)
        off = (found.pressure - np.interp(found.x, fine.x, fine.pressure))[middle(found)]
        size = np.sqrt((fine.pressure[middle(fine)] ** 2).mean())
        assert 100 * np.sqrt((off**2).mean()) / size == pytest.approx(errors[i], rel=0.05)


def test_a_screen_gives_the_error_of_pressure_to_expect_of_the_cells_of_the_file(tmp_path):
    hint = 'nodal pressures off by about 5 % at nu = 0.48 of body2, 1 % with split = "both"'
    shown = lambda data: " ".join(str(vf.solve(vf.Problem.from_dict(data)).sections()).split())
    assert hint in shown(plates(body2={"poisson": "0.48"}))
    assert hint in " ".join(str(vf.run(vf.Problem.from_dict(plates(body2={"poisson": "0.48"}))).sections()).split())
    assert "nodal pressures off" not in shown(plates())
    assert "nodal pressures off" not in shown(plates(body2={"poisson": "0.48", "split": "both"}))
    data = plates(body1={"poisson": "0.49"})
    for key in ("shape", "x", "y", "cells"):
        del data["body1"][key]
    data["body1"]["mesh"] = split(tmp_path / "one.msh", (0.0, 2.0), (-0.3, 0.0), (20, 3), False)
    assert "off by about 13 % or more at nu = 0.49 of body1, 0.3 % on quadrilaterals" in shown(data)


def test_near_one_half_one_diagonal_multiplies_the_force_and_both_diagonals_do_not_lock(tmp_path):
    """The figures of the page: 20 x 3 and 12 x 3 rectangles, nu = 0.499, against both diagonals twice as fine."""

    def force(halvings, diagonals):
        data = plates(body1={"poisson": "0.499"}, body2={"poisson": "0.499"}, contact={"radius": "0.1"})
        for name, x, y, cells in (
            ("body1", (0.0, 2.0), (-0.3, 0.0), (20, 3)),
            ("body2", (0.4, 1.6), (0.0, 0.3), (12, 3)),
        ):
            if diagonals != "alternating":
                for key in ("shape", "x", "y", "cells"):
                    del data[name][key]
                grid = tuple(n * 2**halvings for n in cells)
                path = tmp_path / f"{name}-{halvings}-{diagonals}.msh"
                data[name]["mesh"] = split(path, x, y, grid, diagonals == "both")
        return vf.solve(vf.Problem.from_dict(data)).to_dict()["force"]["normal"]

    fine = force(1, "both")
    assert force(0, "both") == pytest.approx(fine, rel=0.05)
    assert 1.1 < force(0, "alternating") / fine < 1.25
    assert 3 < force(0, "one") / fine < 6


@pytest.mark.parametrize("solver", ["auto", "active-set"])
def test_a_contact_step_that_fails_names_a_poisson_ratio_near_one_half(solver):
    sheared = {"poisson": "0.4999999999", "prescribed": SHEARED}
    data = changed(
        body1={"poisson": "0.4999999999"}, body2=sheared, contact={"friction": "0.6"}, iteration={"theta": "0.1"}
    )
    named = "body1.poisson = 0.4999999999 and body2.poisson = 0.4999999999 is too near 1/2"
    with pytest.raises(vf.ContactError, match=re.escape(named)):
        vf.run(vf.Problem.from_dict(data), solver=solver)


# --- the kernel of the friction law -----------------------------------------------------------------------------------

CELLS = 20


def block(radius, friction="0.2"):
    """A block on Gamma_c of length 1 and mesh width 1/20, pushed so far that it slides as a whole."""
    lower = {"shape": "rectangle", "x": [-1, 2], "y": [-1, 0], "cells": [3 * CELLS, CELLS // 2]}
    upper = {"shape": "rectangle", "x": [0, 1], "y": [0, "0.5"], "cells": [CELLS, CELLS // 2]}
    return {
        "body1": lower | {"young": 70000, "poisson": "0.3", "fixed": ["bottom"]},
        "body2": upper | {"young": 20000, "poisson": "0.3", "prescribed": {"top": ["0.05", "-0.01"]}},
        "contact": {"friction": friction, "radius": str(radius)},
        "iteration": {"neumann_body": 1},
    }


def of_the_kernel(data):
    """What is said of the radius after the problem is solved."""
    return [text for text in vf.solve(vf.Problem.from_dict(data)).warnings if "radius" in text]


def carried(radius):
    """Tangential force over k times the normal one."""
    solution = vf.solve(vf.Problem.from_dict(block(radius))).to_dict()
    assert solution["pattern"]["stick"] == 0
    return abs(solution["force"]["tangential"]) / (0.2 * solution["force"]["normal"])


@pytest.mark.parametrize("radius", ["0.4", "0.7", "1", "2"])
def test_a_wide_kernel_is_warned_of_with_what_its_ends_lose(radius):
    (warning,) = of_the_kernel(block(radius))
    percent = float(re.search(r"carries (\d+) % of k times the normal force", warning)[1])
    assert percent / 100 == pytest.approx(carried(radius), abs=0.015)
    assert f"contact.radius = {radius} is not small against the length 1 of the closed part of Gamma_c" in warning


@pytest.mark.parametrize("radius", ["0.025", "0.04"])
def test_a_kernel_narrower_than_a_cell_is_warned_of_with_its_multiple_of_friction(radius):
    (warning,) = of_the_kernel(block(radius))
    multiple = float(re.search(r"multiplies friction by about width/radius = ([\d.]+)", warning)[1])
    assert multiple == pytest.approx(0.05 / float(radius))
    assert carried(radius) == pytest.approx(multiple, rel=0.05)


@pytest.mark.parametrize("radius", ["0.05", "0.1", "0.2", "0.25"])
def test_a_kernel_that_is_wide_beside_a_cell_and_narrow_beside_the_interface_is_not_warned_of(radius):
    assert of_the_kernel(block(radius)) == []
    assert carried(radius) == pytest.approx(1 - float(radius) / 3, abs=0.02)


@pytest.mark.parametrize("radius", ["0.01", "2"])
def test_without_friction_the_kernel_changes_nothing_and_is_not_warned_of(radius):
    assert of_the_kernel(block(radius, friction=0)) == []


def test_a_radius_between_one_and_two_cells_that_adds_a_tenth_is_warned_of():
    fine = block("0.0133333")
    fine["body1"]["cells"], fine["body2"]["cells"] = [300, 2], [100, 2]
    (warning,) = of_the_kernel(fine)
    assert "contact.radius = 0.0133333 is not a multiple of the mesh width 0.01" in warning
    assert "by about 1.12" in warning


# --- the local law on grids that differ -------------------------------------------------------------------------------


def tipping(law, cells=(14, 2), push="0.1", **more):
    """A soft block whose top is pushed aside until it slides on its edge, and its columns and those of the plate."""
    plate = {"shape": "rectangle", "x": [0, 2], "y": [-1, 0], "cells": [cells[0], 7], "young": 1000, "poisson": "0.3"}
    block = {"shape": "rectangle", "x": ["0.5", "1.5"], "y": [0, 1], "cells": [cells[1], 2], "young": 100}
    top = {"poisson": "0.3", "prescribed": {"top": [push, "-0.002"]}}
    contact = {"friction": "0.8", "law": law, **more}
    iteration = {"neumann_body": 1, "theta": "0.5", "tolerance": 1e-9, "max_iterations": 500}
    bodies = {"title": "a block", "body1": plate | {"fixed": ["bottom"]}, "body2": block | top}
    return vf.Problem.from_dict(bodies | {"contact": contact, "iteration": iteration})


def of_the_bound(result):
    return [text for text in result.warnings if text.startswith("contact") and "closed nodes" in text]


def test_a_bound_that_is_not_coulombs_is_warned_of_with_its_range_and_coulombs_friction_is_not():
    carried = {}
    for law in ("local", "local-contact"):
        found = vf.solve(tipping(law))
        force, closed = found.contact.force, found.contact.pressure > 0
        carried[law] = abs(force["tangential"]) / (0.8 * force["normal"])
        ratios = found.contact.bound[closed] / (0.8 * found.contact.pressure[closed])
        assert force["normal"] > 0.1
        if law == "local":
            (text,) = of_the_bound(found)
            assert f"is {ratios.min():.2g} to {ratios.max():.2g} times k times their pressure" in text
            assert 'law = "local-contact"' in text
            assert "one grid on both sides" in text
        else:
            assert of_the_bound(found) == []
            assert ratios == pytest.approx(1)
    assert carried["local-contact"] == pytest.approx(1)
    assert carried["local"] > 2


@pytest.mark.parametrize("cells", [(16, 8), (14, 2), (6, 7)])
def test_an_even_pressure_is_bounded_as_coulomb_has_it_by_the_local_law_on_any_grids(cells):
    interface = discretise(tipping("local", cells)).interface
    assert interface.one_grid == (cells == (16, 8))
    assert interface.kernel @ interface.neumann.weights == pytest.approx(np.ones(interface.contact.n), rel=1e-12)


def test_a_run_that_converged_says_the_same_as_the_solution():
    run, solution = vf.run(tipping("local", push="0.01")), vf.solve(tipping("local", push="0.01"))
    assert run.converged
    assert of_the_bound(run) == of_the_bound(solution) != []


@pytest.mark.parametrize(
    ("law", "cells", "more"), [("local", (16, 8), {}), ("nonlocal", (14, 2), {"radius": "0.2"})], ids=["one grid", "S"]
)
def test_no_such_warning_on_one_grid_nor_for_another_law(law, cells, more):
    assert of_the_bound(vf.solve(tipping(law, cells, **more))) == []


def test_of_several_lines_the_one_with_the_law_is_named():
    stack = tomllib.loads(examples()["stack"])
    stack["body3"]["cells"] = [6, 4]
    stack["contact"][1] = {**stack["contact"][1], "law": "local"}
    del stack["contact"][1]["radius"]
    (text,) = of_the_bound(vf.solve(vf.Problem.from_dict(stack)))
    assert text.startswith("contact[2].law")
    assert text.endswith("needed one grid on both sides of Gamma_c")  # no line of several takes "local-contact"


# --- what the page and the built-in files say -------------------------------------------------------------------------

PAGE = (Path(__file__).parents[3] / "docs" / "problem_file.md").read_text("utf-8")


@pytest.mark.parametrize("name", ["section6", "inside"])
def test_a_built_in_file_with_friction_says_that_its_law_is_static(name):
    assert "static: right for one monotone loading, not for unloading" in examples()[name]


@pytest.mark.parametrize("nodes", [60, 190, 666])
def test_the_file_of_a_mesh_of_the_paper_says_what_its_radius_is_against_the_mesh_width(nodes):
    text = examples()[f"section6-{nodes}"]
    bodies = discretise(vf.example(f"section6-{nodes}"))
    width = float(np.diff(bodies.interface.neumann.x).max())
    even = bodies.interface.kernel @ bodies.interface.neumann.weights
    assert ("half the lower body's mesh width" in text) == (width == pytest.approx(0.2)) == (nodes == 60)
    assert ("between the mesh width and 0.3 times the length of Gamma_c" in text) == (width < 0.1 + 1e-9)
    narrow = "sees single nodes and multiplies the friction bound of a node by 0.00 to 2.00"
    if nodes == 60:  # no node is open
        solution = vf.solve(bodies)
        assert any(narrow in warning for warning in solution.warnings)
    assert (even.min() == pytest.approx(0) and even.max() == pytest.approx(2)) == (nodes == 60)


def test_the_page_gives_the_borders_of_the_warnings():
    assert f"From {LOCKING} on a warning is given" in PAGE
    assert f"below ${3 * SHARE:.1g}\\,\\ell$" in PAGE


@pytest.mark.parametrize(("radius", "part"), [("0.1", "0.96"), ("0.3", "0.89"), ("1", "0.66")])
def test_the_page_gives_the_friction_that_a_sliding_block_carries(radius, part):
    heads, _, values = (line.split("|")[2:-1] for line in PAGE[PAGE.index("| $r/\\ell$ |") :].splitlines()[:3])
    table = dict(zip(map(str.strip, heads), map(str.strip, values), strict=True))
    assert table[radius] == part
    assert carried(radius) == pytest.approx(float(part), abs=0.006)


# --- a load that is taken back ----------------------------------------------------------------------------------------

FULL, HALF = -0.015, -0.0075
HISTORY = " ".join((Path(__file__).parents[3] / "docs" / "loading_history.md").read_text("utf-8").split())


def pressed(name, down):
    """A model of Section 6 with its top at a height."""
    return vf.example(name).with_keys({"body2.prescribed.top": [0, down]})


def step_by_step(name, path):
    """Contact at the end of a path, each increment with friction against the slip since the last, by the iteration.

    ``|v_T - v_T^before|`` is ``|v_T|`` for a contact body whose trace is counted from v_T^before on: its load becomes
    ``l_c - S_c (v_T^before, 0)``.
    """
    before, found = 0.0, None
    for down in path:
        pair = vf.build(pressed(name, down))
        contact, shift = pair.contact, np.zeros(pair.contact.grid.size)
        shift[contact.grid.tangential] = pair.normal_sign * before  # slip is u1_T - u2_T; the contact body is body 2
        moved = replace(contact, load=contact.load - contact.schur @ shift)
        run = vf.run(replace(pair, contact=moved, settings=replace(pair.settings, tolerance=1e-12)))
        assert run.converged
        found, before = run.contact, before + run.contact.slip
    return found


def step_by_step_at_once(name, path):
    """The shear at the end of the same path by the global method, whose jump is counted from v_T^before on."""
    before, force = 0.0, None
    for down in path:
        bodies = discretise(pressed(name, down))
        system = contact_system(bodies)
        system.d0[: system.t] -= before
        solved = system.solve()
        force = solved.force
        before = before + system.jump(force, solved.motion)[: system.t]
    return force[: system.t] / bodies.interface.contact.weights


def off_after_unloading(name):
    """By how much the static law is off at half load, at all nodes and away from the ends, in shares of its maximum."""
    static = vf.solve(pressed(name, HALF)).contact
    true = step_by_step(name, [FULL, HALF])
    np.testing.assert_allclose(step_by_step_at_once(name, [FULL, HALF]), true.shear, atol=1e-8)
    off = np.abs(true.shear - static.shear) / np.abs(static.shear).max()
    x = static.x - static.x[0]
    return off, off[(x >= 0.15) & (x <= 1.05)].max()


def test_a_load_that_grows_in_proportion_needs_one_increment():
    once, often = (step_by_step("section6", np.linspace(0, FULL, n + 1)[1:]).shear for n in (1, 5))
    assert np.abs(once - often).max() <= 1e-12 * np.abs(once).max()
    assert "(to $10^{-12}$)" in PAGE


def test_the_page_gives_the_error_of_the_static_law_after_unloading():
    told = re.search(r"off by (\d+) % of its largest value at both end nodes.*? by (\d+) % between", HISTORY)
    off, inside = off_after_unloading("section6")
    assert off.max() == pytest.approx(off[0]) == pytest.approx(off[-1])
    assert [f"{100 * share:.0f}" for share in (off.max(), inside)] == list(told.groups())


def test_the_page_says_that_the_error_after_unloading_depends_on_the_mesh():
    told = re.search(r"`section6-666` the largest error is (\d+) %", HISTORY)
    off, _ = off_after_unloading("section6-666")
    assert f"{100 * off.max():.0f}" == told[1]


def test_a_bound_of_the_local_law_is_warned_of_beyond_a_tenth_and_at_closed_nodes_alone():
    data = changed(plates(), contact={"law": "local"}, body2={"cells": [7, 3]})
    interface = vf.build(vf.Problem.from_dict(data)).interface
    assert not interface.one_grid
    pressure = np.linspace(1.0, 2.0, interface.contact.n)
    pressure[0] = 0.0
    of = lambda shares: interface.law.warnings_after(interface, 0.2, pressure, 0.2 * pressure * shares)
    ones = np.ones(len(pressure))
    assert of(ones) == []
    assert of(np.where(np.arange(len(ones)) == 3, 1.09, 0.92)) == []
    (said,) = of(np.where(np.arange(len(ones)) == 3, 1.2, 0.8))
    assert "0.8 to 1.2 times k times their pressure" in said
    pressure *= 1e-9  # in another unit
    assert of(np.where(np.arange(len(ones)) == 3, 1.2, 0.8)) == [said]
    pressure[:] = 0.0
    assert of(ones) == []


# --- contact that grows under friction --------------------------------------------------------------------------------


def on_a_wheel(friction="0.1", *, steps=0):
    """A block that is pressed up against a wheel: one node touches at first, then others."""
    body = {"shape": "rectangle", "x": [-2, 2], "y": [-2, 0], "cells": [40, 10], "young": 1000, "poisson": "0.3"}
    loads = {"prescribed": {"bottom": ["0.001", "0.02"]}}
    wheel = {"shape": "rigid", "side": "wheel", "circle": {"centre": [0, 3], "radius": 3, "arc": [240, 300]}}
    contact = {"surface": ["top", "wheel"], "friction": friction, "law": "local"}
    step = {"step": [{"increments": steps, "body1": loads}]} if steps else {}
    return vf.Problem.from_dict({"body1": body | loads, "body2": wheel, "contact": contact, **step})


def test_a_static_solution_warns_of_friction_where_nodes_come_into_contact():
    warned = [line for line in vf.solve(on_a_wheel()).warnings if "that were apart touch with friction" in line]
    assert len(warned) == 1
    assert re.match(r"\d+ nodes that were apart", warned[0])
    assert any("that were apart" in line for line in vf.run(on_a_wheel()).warnings)
    assert not any("that were apart" in line for line in vf.solve(on_a_wheel("0")).warnings)
    assert not any("that were apart" in line for line in vf.solve(vf.Problem.from_dict(plates())).warnings)


def test_a_history_in_one_increment_warns_and_one_in_many_has_another_shear():
    one, many = (vf.march(on_a_wheel("0.3", steps=count), method="monolithic") for count in (1, 20))
    assert any("that were apart" in line for line in one.warnings)
    assert not any("that were apart" in line for line in many.warnings)
    shear = [abs(found.increments[-1].contact.shear).sum() for found in (one, many)]
    assert shear[1] < 0.9 * shear[0]


# --- the grid of the coarser body -------------------------------------------------------------------------------------


@pytest.mark.parametrize(("neumann", "warns"), [(1, False), (2, True)])
def test_a_contact_grid_much_coarser_than_the_other_one_is_warned_of_where_bodies_are_curved(neumann, warns, tmp_path):
    """A round body on fine cells over a block on coarse ones, in both roles; flat bodies may be coarse."""
    x = np.linspace(-0.2, 0.2, 41)
    round_one = {"mesh": write_curved(tmp_path / "high.msh", x, lambda x: 1 - np.sqrt(1 - x**2), lambda x: 0 * x + 0.2)}
    moduli = {"young": 1000, "poisson": "0.3"}
    low = {"shape": "rectangle", "x": ["-0.2", "0.2"], "y": ["-0.2", 0], "cells": [4, 2], "fixed": ["bottom"], **moduli}
    data = {"body1": low, "body2": round_one | moduli | {"prescribed": {"top": [0, "-0.001"]}}}
    data |= {"contact": {"surface": ["top", "bottom"]}, "iteration": {"neumann_body": neumann}}
    found = warned(data)
    assert any("10 times as long as the edges opposite" in line for line in found) == warns
    flat = plates(body2={"cells": [60, 3]}, iteration={"neumann_body": 2, "theta": "0.5"})
    assert not any("as long as" in line for line in warned(flat))
