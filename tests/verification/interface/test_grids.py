"""Two bodies whose grids along Gamma_c differ: patch tests, both methods against each other, other codes, refusals."""

import csv
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given
from hypothesis import strategies as st
from mesh_writer import write_gmsh22
from problem_list import SHEARED, changed
from two_methods import assert_same

import verification as vf
from fem1d2d import rectangle
from verification.interface.assembly import discretise
from verification.interface.files import write_interface, write_transfer
from verification.ledger.cases import problem as drawn
from verification.reproduce.readings import HALF, ModelReading

#: Grids of 11 and 9 contact nodes, as the paper's coarsest mesh has them; upper body Neumann where nothing is said.
APART = changed(
    body1={"cells": [10, 2]}, body2={"cells": [8, 2]}, iteration={"tolerance": 1e-12, "max_iterations": 3000}
)

PROBLEMS = {
    "Section 6 of 60 nodes": APART,
    "sheared until it slips": changed(APART, body2={"prescribed": SHEARED}, contact={"friction": "0.1"}),
    "local law": changed(APART, body2={"prescribed": SHEARED}, contact={"law": "local", "radius": None}),
    "without friction": changed(APART, contact={"friction": 0}),
    "left edges aligned": changed(APART, body2={"x": [0, "1.2"]}),
    "part of the top moved, so that it opens": changed(
        APART,
        body2={"prescribed": {"left": ["0", "free"], "top": [0, "-0.01"]}, "x": [0, "1.2"]},
        contact={"interval": ["0.3", "1.2"]},
        iteration={"neumann_body": 1},
    ),
    "a gap that closes in part": changed(
        APART, body2={"prescribed": {"top": [0, "-0.02"]}, "body_force": [0, -3000]}, contact={"gap": "0.012"}
    ),
    "ends between nodes of the lower body": changed(APART, body2={"x": ["0.43", "1.55"]}),
    "one cell against seven": changed(APART, body1={"x": ["0.3", "1.7"], "cells": [1, 2]}, body2={"cells": [7, 2]}),
    "seven cells against one": changed(APART, body1={"cells": [35, 2]}, body2={"cells": [1, 2]}),
}


def run_of(problem):
    """A run at a theta that suits the roles."""
    return vf.run(problem.with_theta(min(1.8 / (2 + vf.measure(problem).rho_max.value), 0.9)), solver="active-set")


def roles():
    for name, data in PROBLEMS.items():
        problem = vf.Problem.from_dict(data)
        for one in (problem, problem.swapped()):
            try:
                discretise(one)
            except vf.ProblemError:  # no nodes of the contact body at the ends
                continue
            yield pytest.param(one, id=f"{name}, Neumann body {one.iteration.neumann_body}")


@pytest.mark.parametrize("problem", list(roles()))
def test_the_limit_of_the_iteration_is_the_global_solution(problem):
    run, solution = run_of(problem), vf.solve(problem)
    assert not run.pair.interface.one_grid
    assert run.converged
    assert solution.kkt_residual <= 1e-11
    assert_same(run, solution)


def test_most_of_these_problems_stand_in_both_roles():
    assert len(list(roles())) >= 2 * len(PROBLEMS) - 3


# --- patch tests ------------------------------------------------------------------------------------------------------


def pressed(cells, young=(7, 2), heights=("0.3", "0.5"), width=1):
    """Two blocks of one width on rollers, pressed without friction: every field is affine."""
    free = {"left": [0, "free"]}
    return changed(
        {
            "body1": {"shape": "rectangle", "x": [0, width], "y": [f"-{heights[0]}", 0], "cells": [cells[0], 2]}
            | {"young": young[0], "poisson": "0.3", "prescribed": free | {"bottom": ["free", 0]}},
            "body2": {"shape": "rectangle", "x": [0, width], "y": [0, heights[1]], "cells": [cells[1], 3]}
            | {"young": young[1], "poisson": "0.3", "prescribed": free | {"top": ["free", "-0.01"]}},
            "contact": {"friction": 0},
            "iteration": {"tolerance": 1e-13, "max_iterations": 3000},
        }
    )


@given(st.integers(1, 12), st.integers(1, 12), st.sampled_from([1, 2]))
def test_a_constant_pressure_passes_to_rounding_on_any_pair_of_grids(lower, upper, role):
    """In plane strain a block of height h gives by ``h (1 - nu^2)/E`` times the pressure."""
    problem = vf.Problem.from_dict(changed(pressed((lower, upper)), iteration={"neumann_body": role}))
    expected = 0.01 / ((1 - 0.3**2) * (0.3 / 7 + 0.5 / 2))
    found = vf.solve(problem).contact
    assert np.abs(found.pressure / expected - 1).max() < 1e-11
    assert found.force["normal"] == pytest.approx(expected, rel=1e-12)


def test_with_the_value_of_the_nearest_node_the_pressure_is_visibly_not_constant():
    pair = vf.build(vf.Problem.from_dict(pressed((8, 6))))
    lower, upper = pair.along_y
    x, other = pair.interface.contact.x, pair.interface.neumann.x
    nearest = np.zeros((len(x), len(other)))
    nearest[np.arange(len(x)), np.abs(x[:, None] - other).argmin(axis=1)] = 1
    P = {"mortar": pair.interface.transfer, "nearest": nearest}
    apart = {}
    for name, transfer in P.items():
        F1, F2 = (side.inverse[side.grid.normal, side.grid.normal] for side in (lower, upper))
        W = F1 + transfer @ F2 @ transfer.T  # all closed, no friction: one linear system
        apart_by = lower.unloaded[lower.grid.normal] - transfer @ upper.unloaded[upper.grid.normal]
        pressure = np.linalg.solve(W, apart_by) / pair.interface.contact.weights
        apart[name] = np.ptp(pressure) / pressure.mean()
    assert apart["nearest"] > 0.04
    assert apart["mortar"] < 1e-11


@given(st.integers(0, 2**32 - 1))
def test_rigid_motions_pass_and_forces_keep_their_sum_and_moment(seed):
    pair = vf.build(drawn(np.random.default_rng(seed), matching=False))
    interface = pair.interface
    n, m, random = interface.contact.n, interface.neumann.n, np.random.default_rng(seed)
    a, b, c = random.normal(size=3)
    moved = lambda x: np.concatenate([np.full(len(x), a), b + c * x])
    assert np.abs(interface.carry(moved(interface.neumann.x)) - moved(interface.contact.x)).max() < 1e-12
    force = random.normal(size=2 * n)
    back = interface.carry_back(force)
    assert len(back) == 2 * m
    assert moved(interface.neumann.x) @ back == pytest.approx(moved(interface.contact.x) @ force, abs=1e-11)
    assert (
        np.abs(interface.neumann.weights - interface.carry_back(np.tile(interface.contact.weights, 2))[:m]).max()
        < 1e-14
    )


# --- orders -----------------------------------------------------------------------------------------------------------


def orders(errors):
    """log2 of the ratio of the errors of each mesh and of its halving."""
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


@pytest.mark.parametrize("upper", [4, 3], ids=["matching", "non-matching"])
def test_a_linear_pressure_is_met_of_order_three_halves_and_its_force_exactly(upper):
    """Blocks on rollers, one side free, pulled along Gamma_c: p falls by nu/(1 - nu) f a unit of length."""
    constant, slope = 0.01 / ((1 - 0.3**2) * (0.3 / 7 + 0.5 / 2)), 0.3 / 0.7 * 0.05
    pull = {"body_force": ["0.05", 0]}
    errors = []
    for n in (1, 2, 4, 8):
        problem = vf.Problem.from_dict(changed(pressed((4, upper)), body1=pull, body2=pull))
        found = vf.solve(problem.changed(cells=((4 * n, 2 * n), (upper * n, 2 * n)))).contact
        assert found.force["normal"] == pytest.approx(constant - slope / 2, rel=1e-12)
        off = found.pressure - (constant - slope * (1 - found.x))
        errors.append(np.sqrt(np.gradient(found.x) @ off**2))
    assert np.abs(orders(errors) - 1.5).max() < 0.1


def test_the_force_of_section_6_converges_with_the_same_order_on_both_kinds_of_grids():
    """Corners limit it: 2 lambda = 1.42 where the clamped top meets a free side, near 3/2 on these meshes."""
    force = lambda n, upper: vf.solve(
        vf.example("section6").changed(cells=((10 * n, 2 * n), (upper * n, 2 * n)), radius="0.2")
    ).contact.force["normal"]
    fine = force(16, 6)
    for upper in (6, 8):
        assert np.abs(orders([abs(force(n, upper) / fine - 1) for n in (1, 2, 4)]) - 1.5).max() < 0.15
    assert 1 < abs(force(1, 6) / fine - 1) / abs(force(1, 8) / fine - 1) < 1.3


# --- against other codes ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", ["local", "local-contact"])
@pytest.mark.parametrize("role", [1, 2])
def test_pressure_and_force_of_the_mesh_of_2482_nodes_are_those_of_three_other_codes(law, role):
    """Local law: total force within 0.3 %, pressure within 1 % away from the corners."""
    problem = vf.example("section6").changed(cells=((80, 16), (64, 16)), law=law, radius=None, neumann_body=role)
    found = vf.solve(problem).contact
    with (Path(__file__).parents[1] / "reference_local_coulomb.csv").open() as file:
        rows = [(float(row["s_mm"]), float(row["p_skfemQ1_37570"])) for row in csv.DictReader(file)]
    assert found.force["normal"] == pytest.approx(1200.9, rel=0.003)
    for s, p in rows:
        if 0.15 <= s <= 1.05:
            assert np.interp(s, found.x - found.x[0], found.pressure) == pytest.approx(p, rel=0.01)


def test_the_two_readings_of_the_local_law_differ_slightly_and_are_one_on_one_grid():
    force = lambda problem: np.array(list(vf.solve(problem).contact.force.values()))
    problem = vf.Problem.from_dict(PROBLEMS["local law"]).changed(cells=((20, 4), (16, 4)))
    ours, other = force(problem), force(problem.changed(law="local-contact"))
    assert 1e-7 < np.abs(ours - other).max() / ours[0] < 1e-3
    one_grid = problem.changed(cells=((20, 4), (12, 4)))
    assert np.abs(force(one_grid) - force(one_grid.changed(law="local-contact"))).max() <= 1e-12 * ours[0]
    assert vf.run(one_grid.changed(law="local-contact")).converged


# --- roles, refusals --------------------------------------------------------------------------------------------------


def test_exchanging_the_roles_takes_the_transfer_of_the_other_direction():
    problem = vf.Problem.from_dict(APART)
    pair = vf.build(problem)
    other = pair.swapped()
    again = vf.build(problem.swapped())
    assert np.array_equal(other.interface.transfer, again.interface.transfer)
    assert other.interface.transfer.shape == pair.interface.transfer.shape[::-1]
    assert other.contact.body is pair.neumann.body or np.array_equal(other.contact.schur, again.contact.schur)
    assert np.array_equal(other.swapped().interface.transfer, pair.interface.transfer)
    assert [role.neumann_body for role in vf.advise(pair).roles] == [pair.neumann_body, other.neumann_body]


def test_a_role_whose_body_has_no_nodes_at_the_ends_is_refused_by_name_and_the_other_one_advised():
    problem = vf.Problem.from_dict(PROBLEMS["ends between nodes of the lower body"])
    good = problem if problem.contact_body == 2 else problem.swapped()
    advice = vf.advise(good)
    assert advice.neumann_body == 1
    assert advice.roles[1].rho is None
    assert "body 1" in advice.roles[1].reason["rho"]
    with pytest.raises(
        vf.ProblemError, match=r"nodes of the contact body, body 1.*let body 1 have the Neumann problem"
    ):
        vf.solve(good.swapped())
    with pytest.raises(ValueError, match="refused"):
        _ = advice.roles[1].predicted
    assert vf.advise(good).plot() is not None


def test_the_iteration_refuses_a_law_that_takes_the_forces_of_the_contact_grid():
    problem = vf.Problem.from_dict(APART).changed(law="local-contact", radius=None)
    with pytest.raises(vf.ProblemError, match=r"contact\.law"):
        vf.run(problem)
    assert vf.solve(problem).contact.force["normal"] > 0


def test_a_kernel_that_reaches_no_node_of_the_neumann_grid_is_refused():
    with pytest.raises(vf.ProblemError, match=r"contact\.radius = 0\.001: .*larger"):
        vf.solve(vf.Problem.from_dict(changed(APART, body1={"x": ["0.38", "1.71"]}, contact={"radius": "0.001"})))


def test_a_surface_with_a_hole_under_gamma_c_is_refused(tmp_path):
    """A notch in the top of the lower body: the nodes on both sides of it are no neighbours."""
    mesh = rectangle((0.0, 2.0), (-0.3, 0.0), (10, 3))
    centres = mesh.points[mesh.cells].mean(axis=1)
    kept = mesh.cells[~((np.abs(centres[:, 0] - 0.9) < 0.1) & (centres[:, 1] > -0.2))]
    write_gmsh22(tmp_path / "notched.msh", mesh.points, kept, {"bottom": mesh.sides["bottom"]})
    notched = {"mesh": str(tmp_path / "notched.msh"), "young": 70000, "poisson": "0.3", "fixed": ["bottom"]}
    with pytest.raises(vf.ProblemError, match=r"body 1 has no surface between x = 0\.8 and 1"):
        vf.solve(vf.Problem.from_dict(APART | {"body1": notched}))


def test_a_body_with_a_node_that_lies_far_away_is_refused(tmp_path):
    """A typing error in one coordinate: beside 1e9 no edge of the surface has a length."""
    mesh = rectangle((0.0, 2.0), (-0.3, 0.0), (10, 2))
    points = mesh.points.copy()
    points[np.argmax(points.sum(axis=1)), 1] = 1e9
    write_gmsh22(tmp_path / "far.msh", points, mesh.cells, {"bottom": mesh.sides["bottom"]})
    far = {"mesh": str(tmp_path / "far.msh"), "young": 70000, "poisson": "0.3", "fixed": ["bottom"]}
    data = APART | {"body1": far, "contact": APART["contact"] | {"interval": ["0.4", "1.6"]}}
    with pytest.raises(vf.ProblemError, match=r"body1: its extents are 2 and 1e\+09"):
        vf.run(vf.Problem.from_dict(data))


def test_mesh_files_with_any_positions_of_nodes_are_taken(tmp_path):
    """Nodes along Gamma_c moved at random: the pressed blocks still have a constant pressure."""
    random = np.random.default_rng(1)
    data = pressed((7, 5))
    for name, y, cells in (("body1", (-0.3, 0.0), (7, 2)), ("body2", (0.0, 0.5), (5, 3))):
        mesh = rectangle((0.0, 1.0), y, cells)
        points = mesh.points.copy()
        moves = (points[:, 0] > 0) & (points[:, 0] < 1)
        points[moves, 0] += random.uniform(-0.3, 0.3, moves.sum()) / cells[0]
        write_gmsh22(tmp_path / f"{name}.msh", points, mesh.cells, mesh.sides)
        body = {key: value for key, value in data[name].items() if key not in ("shape", "x", "y", "cells")}
        data[name] = body | {"mesh": str(tmp_path / f"{name}.msh")}
    found = vf.solve(vf.Problem.from_dict(data)).contact
    expected = 0.01 / ((1 - 0.3**2) * (0.3 / 7 + 0.5 / 2))
    assert np.abs(found.pressure / expected - 1).max() < 1e-11


@pytest.mark.parametrize("ends", [("0.43", "1.55"), ("0.41", "0.59"), ("0.4", "1.6"), ("0.2", "1.33")])
def test_a_traction_acts_on_what_gamma_c_leaves_of_a_side(ends):
    """Also on the part of an edge at whose other part the bodies touch; moments about x = 0 too."""
    top = {"traction": {"top": [3, -5]}}
    data = changed(APART, body1=top, body2={"x": list(ends)}, iteration={"neumann_body": 1})
    body = discretise(vf.Problem.from_dict(data)).body1
    without = discretise(vf.Problem.from_dict(changed(data, body1={"traction": None}))).body1
    a, b = map(float, ends)
    load = np.zeros(body.mesh.points.shape)
    load.ravel()[body.positions] = body.load - without.load
    assert load.sum(axis=0) == pytest.approx([3 * (2 - (b - a)), -5 * (2 - (b - a))], rel=1e-12)
    moment = -5 * (2**2 - (b**2 - a**2)) / 2
    assert load[:, 1] @ body.mesh.points[:, 0] == pytest.approx(moment, rel=1e-12)


# --- files ------------------------------------------------------------------------------------------------------------


def test_the_transfer_is_written_for_other_codes_and_the_pair_reads_back_the_same(tmp_path):
    pair = vf.build(vf.Problem.from_dict(PROBLEMS["ends between nodes of the lower body"]).changed(neumann_body=1))
    write_transfer(pair.interface, tmp_path / "P.npz")
    P = sp.load_npz(tmp_path / "P.npz")
    assert np.array_equal(P.toarray(), pair.interface.transfer)
    with np.load(tmp_path / "P.npz") as arrays:
        assert np.abs(P.T @ arrays["weights_contact"] - arrays["weights_neumann"]).max() < 1e-15
        assert np.abs(P @ arrays["x_neumann"] - arrays["x_contact"]).max() < 1e-14
    write_interface(pair, tmp_path / "interface.npz")
    again = vf.build(tmp_path / "interface.npz")
    assert vf.run(again).history == vf.run(pair).history
    assert vf.advise(again).roles[1].rho is None
    assert "transfer" in vf.advise(again).roles[1].reason["rho"]


def test_strong_friction_that_newton_and_sweeps_alone_do_not_solve_is_solved():
    """k = 1 where the theorem allows 0.06: newton's patterns repeat, and ten thousand sweeps come no nearer."""
    pair = vf.build(drawn(np.random.default_rng(262), matching=False))
    assert pair.friction == 1
    run, solution = vf.run(pair.changed(theta="0.3", tolerance=1e-12)), vf.solve(pair)
    assert run.converged
    assert np.abs(run.contact.pressure - solution.contact.pressure).max() <= 1e-9 * solution.contact.pressure.max()


@pytest.mark.parametrize("moved", ["whole top", "left half"])
def test_a_run_of_bodies_on_an_axis_of_symmetry_converges_to_the_global_method(moved):
    reading = ModelReading(position=HALF, moved=moved, top="free to slide", neumann_body=2, moduli="exchanged")
    for nodes in (60, 190):
        problem = reading.problem(nodes)
        run, wanted = vf.run(problem, theta="0.1"), vf.solve(problem).contact
        assert run.converged
        assert np.abs(run.contact.shear - wanted.shear).max() < 1e-6 * wanted.pressure.max()
        assert run.contact.shear[0] == wanted.shear[0] == 0
