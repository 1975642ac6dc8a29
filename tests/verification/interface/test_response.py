"""Displacements of a body under loads and contact forces, which the global method reads off one factorisation.

The other path solves with the sparse matrix for each unknown of the interface.
"""

from __future__ import annotations

from dataclasses import replace

import meshio
import numpy as np
import pytest
from hypothesis import given
from problem_list import bars, blocks, changed, plates
from strategies import fewer

import fem1d2d.condense
import verification as vf
from verification.interface import body as body_module
from verification.interface.assembly import discretise
from verification.testing.strategies import problems

PRESSED = {"prescribed": None, "traction": {"top": [0, -3000]}}

#: By name: the problem, and the numbers of rigid motions of its bodies.
PROBLEMS = {
    "two plates": (plates(), [0, 0]),
    "on another grid": (plates(body2={"cells": [7, 3]}), [0, 0]),
    "held tangentially at the ends": (
        blocks(body1={"fixed": ["bottom"], "prescribed": {"left": [0, "free"], "right": [0, "free"]}}),
        [0, 0],
    ),
    "a body that slides": (plates(body2={"prescribed": {"top": ["free", "-0.015"]}}), [0, 1]),
    "a body that slides, on another grid": (
        plates(body2={"prescribed": {"top": ["free", "-0.015"]}, "cells": [7, 3]}),
        [0, 1],
    ),
    "a body that nothing holds": (plates(body2=PRESSED), [0, 3]),
    "a body that nothing holds, on another grid": (plates(body2=PRESSED | {"cells": [7, 3]}), [0, 3]),
    "a body that lifts, held tangentially at an end": (
        plates(body2={"prescribed": {"left": [0, "free"]}, "traction": {"top": [0, -3000]}}),
        [0, 1],
    ),
    "an obstacle": (plates() | {"body1": {"shape": "rigid"}}, [0]),
    "bars": (bars(), [0, 0]),
    "a bar that contact holds": (
        bars(body2={"prescribed": None, "traction": {"right": [-1]}}, iteration={"neumann_body": 1}),
        [0, 1],
    ),
    "a long bar that contact holds": (
        bars(cells=(5, 300), body2={"prescribed": None, "traction": {"right": [-1]}}, iteration={"neumann_body": 1}),
        [0, 1],
    ),
}


def condition(body):
    """Of the stiffness matrix where no motion is left: its largest eigenvalue over the least that is not 0."""
    values = np.linalg.eigvalsh(body.stiffness.toarray())
    return values[-1] / values[body.motions.shape[1]]


def agrees(body):
    columns = np.zeros((len(body.positions), len(body.interface)))
    columns[body.interface, np.arange(len(body.interface))] = 1.0
    fields, loaded, found = body.solve(columns), body.solve(body.load), body.response
    slack = 64 * len(body.positions) * np.finfo(float).eps * condition(body)
    assert np.abs(found.flexibility - fields[body.interface]).max() <= slack * np.abs(fields).max()
    assert np.array_equal(found.flexibility, found.flexibility.T)
    assert np.abs(found.loaded - loaded).max() <= slack * np.abs(loaded).max()
    force = np.arange(1.0, len(body.interface) + 1)
    assert np.abs(found.field(force) - fields @ force).max() <= slack * np.abs(fields).max() * force.sum()


sparse_too = pytest.mark.parametrize("few", [body_module.FEW, 0])


@sparse_too
@pytest.mark.parametrize("name", sorted(PROBLEMS))
def test_one_factorisation_gives_what_a_solve_for_each_column_gives(name, few, monkeypatch):
    monkeypatch.setattr(body_module, "FEW", few)
    data, motions = PROBLEMS[name]
    bodies = discretise(vf.Problem.from_dict(data)).elastic
    assert [body.motions.shape[1] for body in bodies] == motions
    for body in bodies:
        agrees(body)


@fewer(4, at_night=1)
@given(problems())
def test_so_it_does_for_supports_and_loads_of_any_kind(problem):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(body_module, "FEW", 0)
        for body in discretise(problem).elastic:
            agrees(body)


@sparse_too
@pytest.mark.parametrize("name", [name for name, (_, motions) in sorted(PROBLEMS.items()) if any(motions)])
def test_forces_that_balance_the_loads_of_a_body_that_can_move_deform_it_in_equilibrium(name, few, monkeypatch):
    """The pinned unknowns carry nothing then: the flexibility is a generalised inverse where it is used."""
    monkeypatch.setattr(body_module, "FEW", few)
    data, motions = PROBLEMS[name]
    for body, k in zip(discretise(vf.Problem.from_dict(data)).elastic, motions, strict=True):
        if not k:
            continue
        M, on_interface = body.motions, body.motions[body.interface]
        force = np.random.default_rng(0).standard_normal(len(body.interface)) * np.abs(body.load).max()
        force -= np.linalg.pinv(on_interface.T) @ (on_interface.T @ force + M.T @ body.load)
        total = body.load.copy()
        total[body.interface] += force
        moved = body.response.loaded + body.response.field(force)
        size = abs(body.stiffness) @ np.abs(moved) + np.abs(total)
        assert np.abs(M.T @ total).max() <= 1e-10 * np.abs(total).sum()  # they balance
        assert np.abs(body.stiffness @ moved - total).max() <= 1e-10 * size.max()
        trace = body.response.loaded[body.interface] + body.response.flexibility @ force
        assert np.allclose(trace, moved[body.interface], rtol=0, atol=1e-10 * np.abs(moved).max())


def test_a_motion_that_no_contact_node_feels_is_pinned_too(tmp_path):
    """A triangle hangs on a corner of the upper block: it may turn, and no force on Gamma_c does work in that."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 1, 0], [2, 2, 0]], dtype=float)
    lines, triangles = np.array([[3, 2], [2, 1]]), np.array([[0, 1, 2], [0, 2, 3], [2, 4, 5]])
    found = []
    for name, count in (("plain", 2), ("flag", 3)):
        mesh = meshio.Mesh(
            points[: triangles[:count].max() + 1],
            [("line", lines), ("triangle", triangles[:count])],
            cell_data={"gmsh:physical": (tags := [np.array([1, 2]), np.full(count, 9)]), "gmsh:geometrical": tags},
            field_data={"top": np.array([1, 1]), "right": np.array([2, 1]), "body": np.array([9, 2])},
        )
        meshio.write(tmp_path / f"{name}.msh", mesh, file_format="gmsh22", binary=False)
        path = str(tmp_path / f"{name}.msh")
        upper = {"mesh": path, "young": 2, "poisson": 0, "prescribed": {"top": [0, "-0.01"], "right": [0, "free"]}}
        data = blocks(iteration={"neumann_body": 1}, contact={"interval": [0, 1], "radius": 1}) | {"body2": upper}
        found.append(vf.solve(vf.Problem.from_dict(data)))
    plain, flag = found
    body = flag.bodies.body2
    assert [plain.bodies.body2.motions.shape[1], body.motions.shape[1]] == [0, 1]
    assert np.abs(body.motions[body.interface]).max() < 1e-15
    agrees(body)
    assert np.allclose(flag.contact.pressure, plain.contact.pressure, rtol=1e-12)
    assert np.allclose(flag.displacements[1][:4], plain.displacements[1], rtol=0, atol=1e-14)


def test_the_global_method_factorises_each_body_once_its_displacements_included(monkeypatch):
    sizes, splu = [], fem1d2d.condense.splu

    def counted(matrix, **options):
        sizes.append(matrix.shape[0])
        return splu(matrix, **options)

    monkeypatch.setattr(fem1d2d.condense, "splu", counted)
    problem = vf.Problem.from_dict(changed(plates(), body1={"cells": [40, 6]}, body2={"cells": [24, 6]} | PRESSED))
    found = vf.solve(problem)
    assert all(np.isfinite(u).all() for u in found.displacements)
    assert found.checks.largest_strain > 0
    held, loose = found.bodies.elastic
    assert sizes == [len(held.positions), len(loose.positions) - 3]


# --- directions, and what makes two bodies the same -------------------------------------------------------------------


@pytest.mark.parametrize("neumann", [1, 2])
def test_a_form_is_oriented_as_the_vectors_that_it_takes(neumann):
    pair = vf.build(vf.Problem.from_dict(blocks(iteration={"neumann_body": neumann})))
    random = np.random.default_rng(0)
    for side in (pair.contact, pair.neumann):
        size = len(side.load)
        M = random.standard_normal((size, size))
        M, x, y = M + M.T, *random.standard_normal((2, size))
        assert x @ side.orient_form(M) @ y == pytest.approx(side.orient(x) @ M @ side.orient(y))
    assert pair.contact.upward == pair.neumann.upward == (neumann == 2)  # so that vectors are turned in one case


def test_a_known_displacement_is_taken_along_the_tangent_and_the_normal_of_each_contact_node():
    """A body on rollers along its whole left side, whose contact line is turned: components of one vector."""
    body = discretise(
        vf.Problem.from_dict(blocks(body1={"prescribed": {"left": ["1/100", "free"]}, "fixed": []}))
    ).body1
    angle = np.linspace(-0.3, 0.4, len(body.nodes))
    values = np.random.default_rng(0).standard_normal((len(body.nodes), 2))
    everywhere = body.known.values.copy()
    everywhere[body.nodes] = values
    known = replace(body.known, values=everywhere)
    turned = replace(body, normals=np.column_stack([np.sin(angle), np.cos(angle)]), known=known)
    along = values[:, 0] * np.cos(angle) - values[:, 1] * np.sin(angle)
    across = values[:, 0] * np.sin(angle) + values[:, 1] * np.cos(angle)
    assert turned.known_trace == pytest.approx(np.concatenate([along, across]))


def test_a_body_under_other_loads_or_with_another_norm_is_another_one():
    data = blocks()
    body = discretise(vf.Problem.from_dict(data)).body2
    same, loaded = (
        discretise(vf.Problem.from_dict(changed(data, body2=more))).body2 for more in ({}, {"body_force": [0, -1]})
    )
    moved = discretise(vf.Problem.from_dict(changed(data, body2={"prescribed": {"top": [0, "-1/40"]}}))).body2
    assert body.equals(same)
    assert not any(body.equals(other) for other in (loaded, moved, replace(body, length=2 * body.length)))
