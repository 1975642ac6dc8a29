"""Half of a symmetric model is the whole one: a contact node on the plane of symmetry has no friction condition."""

from __future__ import annotations

import numpy as np
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st
from mesh_writer import write_gmsh22
from problem_list import PROBLEMS
from scipy.linalg import eigh

import verification as vf
from fem1d2d import rectangle
from verification.interface.files import read_interface, write_interface
from verification.problem import ProblemError

#: Results of a half and of the whole agree up to this.
SAME = 1e-9

AXIS = {"left": [0, "free"]}


def model(
    *,
    half,
    cells=((6, 2), (4, 3)),  # an even number along x, so that the diagonals of the whole mirror
    width=("1", "0.8"),
    friction="0.3",
    neumann_body=1,
    young=(70000, 20000),
    moved=("0", "-0.01"),
    down="1",
    gap="0",
    steps=(),
    **contact,
):
    """A block on a wider one, symmetric about x = 0; the middle part ``down`` of its top is moved."""
    lower, upper = ({"young": E, "poisson": "0.3"} for E in young)
    ends = [[0 if half else f"-{w}", w] for w in width]
    counts = [[n if half else 2 * n, m] for n, m in cells]
    edge = str(float(width[1]) * float(down))
    load = {"middle": list(moved)} | (AXIS if half else {})
    problem = {
        "body1": lower
        | {"shape": "rectangle", "x": ends[0], "y": ["-0.4", 0], "cells": counts[0], "fixed": ["bottom"]},
        "body2": upper
        | {"shape": "rectangle", "x": ends[1], "y": [0, "0.5"], "cells": counts[1], "prescribed": load}
        | {"parts": {"middle": {"side": "top", "x": [0 if half else f"-{edge}", edge]}}},
        "contact": {"friction": friction, "radius": "0.2", "gap": gap} | contact,
        "iteration": {"neumann_body": neumann_body, "theta": "0.5", "tolerance": 1e-13, "max_iterations": 2000},
    }
    if half:
        problem["body1"]["prescribed"] = dict(AXIS)
    if steps:
        at = lambda v: {"prescribed": {"middle": list(v)}}
        problem["step"] = [{"name": f"step {i}", "increments": 2, "body2": at(v)} for i, v in enumerate(steps)]
    return vf.Problem.from_dict(problem)


#: Grids that match and that do not, either role, both laws, contact that opens, no friction.
MODELS = {
    "one grid": {"cells": ((6, 2), (6, 3)), "width": ("1", "1")},
    "grids that differ": {},
    "a finer Neumann grid": {"cells": ((10, 2), (4, 3))},
    "a finer contact grid": {"cells": ((4, 2), (8, 3))},
    "the other body's grid": {
        "cells": ((4, 2), (6, 2)),
        "width": ("1", "1"),
        "neumann_body": 2,
        "young": (20000, 70000),
    },
    "local law": {"law": "local"},
    "without friction": {"friction": 0},
    "opens at the edge": {"down": "0.6", "moved": ("free", "-0.01"), "cells": ((10, 4), (10, 5)), "friction": "0.1"},
    "apart before the load": {"gap": "0.004"},
    "a wide kernel": {"radius": "0.7"},
}

by_name = pytest.mark.parametrize("name", MODELS)


def compared(half, whole):
    """Assert that two results agree on the right half of Gamma_c."""
    n, size = len(half.x), max(np.abs(whole.pressure).max(), np.abs(whole.shear).max())
    for name in ("pressure", "shear", "bound"):
        assert np.abs(getattr(half, name) - getattr(whole, name)[-n:]).max() <= SAME * size, name
    for name in ("gap", "slip"):
        assert np.abs(getattr(half, name) - getattr(whole, name)[-n:]).max() <= SAME * 0.01, name
    assert half.x == pytest.approx(whole.x[-n:], abs=1e-12)
    for mine, its, p, b in zip(half.status, whole.status[-n:], half.pressure, half.bound, strict=True):
        assert mine == its or min(p, b) <= SAME * size


@by_name
def test_half_a_model_has_the_stresses_of_the_whole_one_by_both_methods(name):
    half, whole = (model(half=half, **MODELS[name]) for half in (True, False))
    compared(vf.solve(half).contact, vf.solve(whole).contact)
    one, other = vf.run(half), vf.run(whole)
    assert one.converged
    assert abs(one.iterations - other.iterations) <= 1  # the residual of the last step is rounding
    compared(one.contact, other.contact)
    compared(one.contact, vf.solve(half).contact)


def arcs(folder, *, half, cells, curvature, friction="0.3", law="nonlocal"):
    """The same with curved sides that are joined by their names."""
    drawn = []
    for name, width, n, low, high in (
        ("low", 1.0, cells[0], lambda x: 0 * x - 0.5, lambda x: curvature * x * x),
        ("up", 0.8, cells[1], lambda x: 0.15 * x * x, lambda x: 0 * x + 0.6),
    ):
        flat = rectangle((0.0 if half else -1.0, 1.0), (0.0, 1.0), (n if half else 2 * n, 2))
        x, t = width * flat.points[:, 0], flat.points[:, 1]
        points = np.column_stack([x, (1 - t) * low(x) + t * high(x)])
        write_gmsh22(folder / f"{name}-{half}.msh", points, flat.cells, flat.sides)
        drawn.append({"mesh": str(folder / f"{name}-{half}.msh"), "poisson": "0.3", "prescribed": AXIS if half else {}})
    drawn[1]["prescribed"] = {"top": [0, "-0.02"]} | drawn[1]["prescribed"]
    return vf.Problem.from_dict({
        "body1": drawn[0] | {"young": 70000, "fixed": ["bottom"]},
        "body2": drawn[1] | {"young": 20000},
        "contact": {"surface": ["top", "bottom"], "friction": friction, "radius": "0.15", "law": law},
        "iteration": {"neumann_body": 1, "theta": "0.5", "tolerance": 1e-13},
    })  # fmt: skip


@pytest.mark.parametrize("given", [((8, 6), -0.2), ((6, 10), -0.2), ((6, 4), 0.1), ((8, 8), 0.0)], ids=str)
def test_half_of_curved_bodies_has_the_stresses_of_the_whole_ones(given, tmp_path):
    """Also where the curve through the nodes of the other body is evaluated beside the axis."""
    half, whole = (arcs(tmp_path, half=half, cells=given[0], curvature=given[1]) for half in (True, False))
    compared(vf.solve(half).contact, vf.solve(whole).contact)
    compared(vf.run(half).contact, vf.run(whole).contact)


@strategies.fewer(2)
@given(data=st.data())
def test_random_half_models_have_the_stresses_of_the_whole_one(data):
    draw = data.draw
    count = st.sampled_from([2, 4, 6, 8])
    cells = tuple((draw(count), draw(st.integers(1, 4))) for _ in range(2))
    friction = draw(st.sampled_from(["0", "0.1", "0.3", "0.6"]))
    # without friction only a clamped top tells where along x the whole of a body is
    moved = (draw(st.sampled_from(["0", "free"])) if friction != "0" else "0", "-0.01")
    given = {
        "cells": cells,
        "width": ("1", draw(st.sampled_from(["1", "0.9", "0.6"]))),
        "friction": friction,
        "law": draw(st.sampled_from(["nonlocal", "nonlocal", "local"])),
        "radius": draw(st.sampled_from(["0.2", "0.35", "0.8"])),
        "down": draw(st.sampled_from(["1", "0.5"])),
        "moved": moved,
        "neumann_body": 1,
    }
    half, whole = (model(half=half, **given) for half in (True, False))
    compared(vf.solve(half).contact, vf.solve(whole).contact)


def symmetric(grid):
    """A basis of the symmetric traces of a grid: tangential components odd, normal ones even; two blocks of columns."""
    n = grid.n
    columns = []
    for i in range((n + 1) // 2):
        for normal in (False, True):
            if normal or i != n - 1 - i:
                column = np.zeros(2 * n)
                column[n * normal + i], column[n * normal + n - 1 - i] = (1.0, 1.0) if normal else (-1.0, 1.0)
                columns.append(column)
    return np.column_stack(columns)


def largest(X, Y):
    return float(eigh(X, Y, eigvals_only=True)[-1])


@by_name
def test_the_constants_of_a_half_are_those_of_the_symmetric_functions_of_the_whole(name):
    half, whole = (vf.build(model(half=half, **MODELS[name])) for half in (True, False))
    found = vf.measure(half)
    contact, neumann, carry = whole.contact, whole.neumann, whole.interface.carry
    C, N = symmetric(contact.grid), symmetric(neumann.grid)
    P = carry(N)
    S_c, S_n = contact.schur, neumann.schur
    own, other = C.T @ S_c @ C, N.T @ S_n @ N
    assert found.rho_max.value == pytest.approx(largest(P.T @ S_c @ P, other), rel=SAME)
    t = contact.grid.t
    mass = np.diag(np.concatenate([contact.grid.weights, np.zeros(t)]))
    assert found.C_t1.value == pytest.approx(np.sqrt(largest(C.T @ mass @ C, own)), rel=SAME)
    assert found.C_t2.value == pytest.approx(np.sqrt(largest(P.T @ mass @ P, other)), rel=SAME)
    forces = (S_n @ N)[neumann.grid.normal]
    stress = whole.interface.kernel @ forces
    square = stress.T @ (contact.grid.weights[:, None] * stress)
    assert found.C_s_energy.value == pytest.approx(np.sqrt(largest(square, other)), rel=SAME)
    assert found.rho_max.value <= vf.measure(whole).rho_max.value * (1 + SAME)
    assert half.outside == whole.outside


def test_advice_for_a_half_is_that_for_the_whole_where_a_symmetric_function_decides():
    half, whole = (vf.advise(model(half=half, friction=0)) for half in (True, False))
    assert half.neumann_body == whole.neumann_body
    assert half.best.rho.value == pytest.approx(whole.best.rho.value, rel=SAME)
    assert half.best.theta_proved == pytest.approx(whole.best.theta_proved, rel=SAME)
    rubbing = vf.advise(model(half=True))
    assert rubbing.best.theta_proved is not None
    assert vf.run(model(half=True), theta="auto").converged


def test_a_history_of_a_half_is_that_of_the_whole():
    path = [("0", "-0.01"), ("0", "-0.002"), ("0", "-0.008")]
    half, whole = (vf.march(model(half=half, steps=path)) for half in (True, False))
    for one, other in zip(half.increments, whole.increments, strict=True):
        compared(one.contact, other.contact)


def test_a_plane_of_symmetry_that_moves_along_gamma_c_is_refused():
    data = model(half=True, steps=[("0", "-0.01")]).to_dict()
    data["body1"] |= {"fixed": [], "prescribed": {"bottom": ["free", 0], "left": [0, "free"]}}
    data["step"][0]["body1"] = {"prescribed": {"left": ["0.001", "free"]}}
    with pytest.raises(ProblemError, match="planes of symmetry"):
        vf.march(vf.Problem.from_dict(data))


@pytest.mark.parametrize("name", ["grids that differ", "one grid"])
def test_the_constants_of_a_half_are_verified(name):
    problem = model(half=True, **MODELS[name])
    measured, proved = vf.measure(problem), vf.measure(problem, verified=True)
    for constant in ("rho_max", "rho_normal", "C_R", "C_tr", "C_s", "C_t1", "C_t2", "C_s_energy"):
        number = getattr(proved, constant)
        assert number.level == "verified", constant
        assert number.lo <= number.value <= number.hi
        assert number.value == pytest.approx(getattr(measured, constant).value, rel=1e-7)


def test_half_a_model_in_a_file_of_matrices_runs_as_from_its_problem(tmp_path):
    pair = vf.build(model(half=True))
    write_interface(pair, tmp_path / "interface.npz")
    again = read_interface(tmp_path / "interface.npz")
    assert vf.run(again).contact.shear == pytest.approx(vf.run(pair).contact.shear, rel=1e-12, abs=1e-9)


def test_between_two_planes_of_symmetry_the_kernel_is_that_of_the_periodic_model():
    """Images are reflected in turn: a constant pressure gives the same stress everywhere, however wide the kernel."""
    problem = model(half=True, cells=((8, 2), (8, 2)), width=("1", "1"), radius="2.5").to_dict()
    for body in ("body1", "body2"):
        problem[body].setdefault("prescribed", {})["right"] = [0, "free"]
    pair = vf.build(vf.Problem.from_dict(problem))
    stress = pair.interface.stress(np.concatenate([np.zeros(9), pair.contact.grid.weights]))
    assert stress == pytest.approx(np.ones(9), rel=1e-12)
    assert vf.run(pair, theta="0.2").converged
    with pytest.raises(vf.ProblemError, match=r"contact\.radius = 5000: needed at most 1000 times the length"):
        pair.changed(radius=5000)  # one image for each length


def test_a_support_of_the_contact_body_alone_carries_the_shear_there_and_the_slip_past_it_is_shown():
    data = model(half=True, neumann_body=2, cells=((6, 2), (6, 2)), width=("1", "1")).to_dict()
    del data["body2"]["prescribed"]["left"]
    problem = vf.Problem.from_dict(data)
    run, solution = vf.run(problem, theta="0.05"), vf.solve(problem)
    assert run.converged
    for found in (run.contact, solution.contact):
        assert found.shear[0] == found.bound[0] == 0
        assert found.pressure[0] > 0
        assert found.status[0] == "slip"
        assert abs(found.slip[0]) > 1e-4
    first, second = run.displacements
    nodes = [body.nodes[0] for body in (run.pair.body1.mesh_body, run.pair.body2.mesh_body)]
    assert run.contact.slip[0] == pytest.approx(first[nodes[0], 0] - second[nodes[1], 0], rel=1e-9)
    assert solution.contact.slip[0] == pytest.approx(run.contact.slip[0], rel=1e-6)
    for outside in (run.pair.outside, solution.bodies.outside):
        assert "a contact node of body 1 is held tangentially" in outside[0]
        assert "supports on both bodies" in outside[0]
    assert vf.measure(problem).rho_max is not None


def test_the_screen_says_where_an_end_is_read_as_a_plane_of_symmetry():
    half, whole = (vf.Problem.from_dict(PROBLEMS[name]) for name in ("half of a symmetric model", "section 6"))
    for found in (vf.run, vf.solve):
        assert "half of a whole: a plane of symmetry at x = 0" in str(found(half).sections())
        assert "symmetry" not in str(found(whole).sections())
