"""More than two bodies: against the global method, two pairs as one problem, roles, documents, refusals."""

import json
import pickle

import jsonschema
import numpy as np
import pytest
from mesh_writer import rotation, write_gmsh22
from stacks import close, plate, stack, touch

import verification as vf
from fem1d2d import rectangle
from verification.interface.assembly import SingularRole, discretise
from verification.problem.colours import OddRing, colours


def pairs(**more):
    """Two pairs that do not touch each other; the second is ten times as wide."""
    return {
        "body1": plate((0, 1), fixed=["bottom"]),
        "body2": plate((1, 2), prescribed={"top": ["0.001", "-0.01"]}),
        "body3": plate((0, 1), "3e4", x=(10, 50), fixed=["bottom"]),
        "body4": plate((1, 2), "1e4", x=(10, 50), prescribed={"top": ["0.02", "-0.03"]}),
        "contact": [touch(1, 2), touch(3, 4, "0.1", radius=10)],
    } | more


def held(**more):
    """Three plates that supports hold, so that both colourings work; their grids differ."""
    hands = {f"{name} hand": {"side": name, "y": ["1.3", "1.7"]} for name in ("left", "right")}
    return {
        "body1": plate((0, 1), fixed=["bottom"]),
        "body2": plate((1, 2), parts=hands, fixed=list(hands)) | {"cells": [12, 10]},
        "body3": plate((2, 3), cells=10, prescribed={"top": ["0.001", "-0.01"]}),
        "contact": [touch(1, 2, "0.1"), touch(3, 2, "0.05", surface=["bottom", "top"])],
        "iteration": {"theta": "auto", "neumann_bodies": [1, 3]},
    } | more


read = vf.Problem.from_dict


@pytest.mark.parametrize("data", [stack(), stack((8, 10, 7)), held()], ids=["stack", "grids differ", "held"])
def test_a_run_has_the_stresses_of_the_global_method(data):
    pair = vf.build(read(data))
    run, found = vf.run(pair), vf.solve(pair)
    assert run.converged
    assert close(run.contact.pressure, found.contact.pressure)
    assert close(run.contact.shear, found.contact.shear, 1e-7)
    assert run.to_dict()["coupled_residual"] < 1e-8


@pytest.mark.parametrize(("name", "number"), [("stack", 3), ("jaws", 3), ("chain", 5)])
def test_a_built_in_problem_of_several_bodies_has_the_forces_of_the_global_method(name, number):
    problem = vf.example(name)
    pair = vf.build(problem)
    run, found = vf.run(pair), vf.solve(pair)
    assert len(problem.bodies) == number
    assert run.converged
    assert close(run.contact.pressure, found.contact.pressure)
    assert close(run.contact.shear, found.contact.shear, 1e-7)
    assert run.contact.pattern == found.contact.pattern
    assert all(found.contact.pattern[state] for state in ("stick", "slip"))
    assert vf.advise(pair).neumann_body == problem.iteration.neumann_body


def test_bodies_that_stick_together_are_one_body():
    """A row of three blocks, of which two stick together, and a row of two on the same cells."""

    def block(x, columns, **more):
        shape = {"shape": "rectangle", "x": x, "y": [0, 2], "cells": [columns, 4]}
        return shape | {"young": "2e4", "poisson": "0.3"} | more

    touch = {"surface": ["right", "left"], "radius": "0.5"}
    last = block([4, 6], 4, young="5e4", prescribed={"right": ["-0.01", "0.001"]})
    one = {"body1": block([0, 4], 8, fixed=["left"]), "body2": last, "contact": touch | {"friction": "0.1"}}
    apart = {"body1": block([0, 2], 4, fixed=["left"]), "body2": block([2, 4], 4), "body3": last}
    lines = [touch | {"bodies": [1, 2], "friction": "1e6"}, touch | {"bodies": [2, 3], "friction": "0.1"}]
    found, expected = (vf.solve(read(data)).to_dict() for data in (apart | {"contact": lines}, one))
    assert expected["pattern"] == {"stick": 2, "slip": 3, "open": 0}
    for name in ("pressure", "shear", "slip", "x", "y", "s", "normal"):
        assert close(np.array(found["contact"][name])[5:], np.array(expected["contact"][name]), 1e-11), name
    assert found["forces"][1]["vector"] == pytest.approx(expected["force"]["vector"], rel=1e-11)


def test_two_blocks_share_a_side_of_a_base_and_a_traction_acts_beside_them():
    base = plate((-1, 0), x=(0, 10), fixed=["bottom"], traction={"top": [0, -1]}) | {"cells": [40, 4]}
    one = plate((0, 1), x=(1, 3), prescribed={"top": ["0.001", "-0.01"]})
    other = plate((0, 1), cells=12, x=(6, 9), prescribed={"top": ["-0.001", "-0.005"]})
    data = {"body1": base, "body2": one, "body3": other, "contact": [touch(1, 2), touch(1, 3)]}
    problem = read(data | {"iteration": {"neumann_bodies": [1], "theta": "auto"}})
    bodies, run, found = discretise(problem), vf.run(problem), vf.solve(problem)
    assert bodies.body1.load.sum() == pytest.approx(-1 * (10 - 2 - 3), rel=1e-12)
    assert run.converged
    assert close(run.contact.pressure, found.contact.pressure)
    swapped = vf.solve(problem.swapped()).contact
    assert [swapped.x[line.contact][[0, -1]].tolist() for line in swapped.lines] == [[1, 3], [6, 9]]
    assert swapped.force["normal"] == pytest.approx(found.contact.force["normal"], rel=0.02)


def test_a_floating_plate_carries_on_what_presses_on_it():
    first, second = vf.solve(read(stack())).to_dict()["forces"]
    assert (first["bodies"], second["bodies"]) == ([1, 2], [2, 3])
    assert first["normal"] == pytest.approx(second["normal"], rel=1e-11)
    assert first["vector"] == pytest.approx(second["vector"], rel=1e-9)


def test_every_order_of_bodies_and_contacts_gives_the_same_forces_on_the_second_body():
    """Reversed bodies reverse the line and the body on which the force acts, and keep pressure, shear and slip."""
    table = {"s": [0, 1, 4], "k": ["0.4", "0.1", "0.2"]}
    mirrored = {"s": [0, 3, 4], "k": ["0.2", "0.1", "0.4"]}
    data = stack(contact=[touch(1, 2, table), touch(2, 3, "0.2")])
    turned = [touch(3, 2, "0.2", surface=["bottom", "top"]), touch(2, 1, mirrored, surface=["bottom", "top"])]
    one, other = (vf.solve(read(each)).to_dict() for each in (data, data | {"contact": turned}))
    for mine, its in zip(one["forces"], other["forces"][::-1], strict=True):
        assert mine["bodies"] == its["bodies"][::-1]
        assert mine["vector"] == pytest.approx([-v for v in its["vector"]], rel=1e-9)
        assert mine["tangential"] == pytest.approx(its["tangential"], rel=1e-9)
    lists = {name: np.array(other["contact"][name]) for name in ("pressure", "shear", "slip", "gap", "bound", "x", "s")}
    for name, values in lists.items():
        expected = np.array(one["contact"][name])
        back = np.concatenate([values[9:][::-1], values[:9][::-1]])
        back = 4 - back if name == "s" else back
        assert np.allclose(back, expected, rtol=0, atol=1e-9 * max(np.abs(expected).max(), 1e-6)), name
    assert other["contact"]["interface"] == [0] * 9 + [1] * 9


def test_normals_lead_from_the_first_body_of_a_contact_to_the_second():
    contact = vf.solve(read(held())).to_dict()["contact"]
    line = np.array(contact["interface"])
    assert np.allclose(np.array(contact["normal"])[line == 0], [0, 1], rtol=0, atol=1e-15)
    assert np.allclose(np.array(contact["normal"])[line == 1], [0, -1], rtol=0, atol=1e-15)
    for number, x in ((0, contact["x"][0]), (1, contact["x"][-1])):  # body 2 lies on the left of the direction of s
        assert x == 0
        assert np.array(contact["s"])[line == number][0] == 0


def test_the_roles_of_the_colours_are_those_of_a_file_with_the_other_colour():
    problem = read(held())
    pair = vf.build(problem)
    swapped, other = pair.swapped(), vf.build(read(held(iteration={"theta": "auto", "neumann_bodies": [2]})))
    assert swapped.problem == other.problem
    assert np.array_equal(swapped.contact.schur, other.contact.schur)
    assert vf.measure(swapped).to_dict() == vf.measure(other).to_dict()
    assert problem.changed(neumann_body=2).iteration.neumann_body == 2
    found = vf.advise(problem)
    assert [role.neumann_body for role in found.roles] == [1, 2]
    assert all(role.rho is not None for role in found.roles)
    assert "with bodies 1, 3 as Neumann bodies" in found.quote
    with pytest.raises(ValueError, match="the blocks couple two solvers"):
        found.snippet("preCICE")


def test_two_pairs_as_one_problem_have_the_results_of_both():
    data = pairs(iteration={"neumann_bodies": [2, 4], "theta": "1/4"})
    whole = vf.build(read(data))
    parts = []
    for i, contact in ((1, data["contact"][0]), (3, data["contact"][1])):
        rest = {key: value for key, value in contact.items() if key != "bodies"}
        two = {"body1": data[f"body{i}"], "body2": data[f"body{i + 1}"], "contact": rest}
        parts.append(vf.build(read(two | {"iteration": {"theta": "1/4"}})))
    run, runs = vf.run(whole), [vf.run(part) for part in parts]
    assert all(each.converged for each in (run, *runs))
    assert close(run.contact.pressure, np.concatenate([each.contact.pressure for each in runs]))
    assert close(run.contact.shear, np.concatenate([each.contact.shear for each in runs]))
    of_parts, found = [vf.measure(part) for part in parts], vf.measure(whole)
    for name in ("rho_max", "rho_normal", "C_R", "C_tr", "M"):
        largest = max(getattr(part, name).value for part in of_parts)
        if name == "M":  # the largest of each role
            largest = sum(max(getattr(part, body).M.value for part in of_parts) for body in ("body1", "body2"))
        assert getattr(found, name).value == pytest.approx(largest, rel=1e-9), name
    assert found.m.value == pytest.approx(min(part.m.value for part in of_parts), rel=1e-9)
    C_s, C_t2 = (
        max(values) for values in zip(*((p.friction * p.C_s_energy.value, p.C_t2.value) for p in of_parts), strict=True)
    )
    assert found.kappa_2.value == pytest.approx(C_s * C_t2, rel=1e-9)
    assert not whole.interface.kernel[:9, 9:].any()


def test_two_bodies_in_two_tables_are_two_bodies_with_two_lines():
    parts = {"west": {"side": "top", "x": [0, 1]}, "east": {"side": "top", "x": [3, 4]}}
    data = stack(contact=[touch(1, 2, surface=["west", "bottom"]), touch(1, 2, surface=["east", "bottom"])])
    data["body1"] |= {"parts": parts}
    data["body2"] |= {"parts": {name: part | {"side": "bottom"} for name, part in parts.items()}}
    data["body2"]["prescribed"] = {"top": [0, "-0.01"]}
    data["contact"] = [touch(1, 2, surface=[name, name]) for name in parts]
    del data["body3"]
    found = vf.solve(read(data)).to_dict()
    assert found["colours"] == [[1], [2]]
    west, east = (each["normal"] for each in found["forces"])
    assert west == pytest.approx(east, rel=0.1)  # the diagonals of the cells are no mirror images


def test_friction_of_each_line_bounds_that_line():
    pair = vf.build(read(stack(frictions=("0.4", "0.1"))))
    bound = pair.bound(np.ones(pair.neumann.grid.size))
    assert bound[:9] == pytest.approx(4 * bound[9:], rel=1e-12)
    less = pair.at(friction="0.2")
    assert less.bound(np.ones(pair.neumann.grid.size)) == pytest.approx(bound / 2, rel=1e-14)
    assert [str(contact.friction) for contact in less.problem.contacts] == ["1/5", "1/20"]
    assert np.array_equal(vf.build(less.problem).interface.kernel, pair.interface.kernel)


def test_a_problem_of_several_bodies_is_written_pickled_and_refined():
    problem = read(held(body3=plate((2, 3), cells=10, prescribed={"top": ["0.001", "-0.01"]}, body_force=[0, -1])))
    again = read(problem.to_dict())
    assert again == problem
    assert again.digest == problem.digest != read(held()).digest
    assert pickle.loads(pickle.dumps(problem)) == problem
    assert problem.with_keys({"body3.young": "5e4"}).bodies[3].young == 50000
    assert problem.refined(1).bodies[3].cells == (20, 4)
    pair = vf.build(problem)
    assert close(vf.run(pickle.loads(pickle.dumps(pair))).contact.pressure, vf.run(pair).contact.pressure, 1e-12)


def test_a_body_force_acts_on_its_own_body():
    weight = {"body2": plate((1, 2), "7e4", body_force=[0, -2])}
    below, above = (each["vector"][1] for each in vf.solve(read(stack() | weight)).to_dict()["forces"])
    assert below - above == pytest.approx(2 * 4, rel=1e-9)  # force per volume times area


@pytest.mark.parametrize(
    "make", [vf.run, vf.solve, vf.measure, vf.advise, lambda problem: vf.compare(problem, bounds=("energy",))]
)
def test_documents_of_several_bodies_fit_their_schemas(make):
    document = json.loads(make(read(held())).to_json())
    jsonschema.validate(document, vf.schema(document["schema"]))
    assert document["colours"] == [[1, 3], [2]]


def test_a_neumann_body_that_is_not_held_is_refused_with_the_other_colour():
    with pytest.raises(
        SingularRole, match=r"body2 can move rigidly .* set iteration\.neumann_bodies = \[1, 3\]"
    ) as caught:
        vf.build(read(stack(iteration={"neumann_bodies": [2]})))
    assert caught.value.key == "body2"
    refused = vf.advise(read(stack())).roles[1]
    assert refused.singular
    assert "body2 can move rigidly" in refused.reason["rho"]


def test_a_chain_held_only_at_its_ends_is_solved_but_iterated_in_no_colouring():
    data = stack(body3=plate((2, 3)), body4=plate((3, 4), prescribed={"top": [0, "-0.01"]}))
    data["contact"] = [*data["contact"], touch(3, 4)]
    for roles in ([2, 4], [1, 3]):
        with pytest.raises(SingularRole, match="of a chain held only at its ends neither colouring works"):
            vf.run(read(data | {"iteration": {"neumann_bodies": roles}}))
    normal = [each["normal"] for each in vf.solve(read(data)).to_dict()["forces"]]
    assert normal == pytest.approx(normal[:1] * 3, rel=1e-9)


def test_bodies_that_move_together_are_refused():
    with pytest.raises(vf.ProblemError, match="contact: bodies that touch can move rigidly together"):
        vf.solve(read(stack(body1=plate((0, 1)), body3=plate((2, 3)))))


@pytest.mark.parametrize(
    ("change", "key", "needed"),
    [
        (
            {"contact": [touch(1, 2), touch(2, 3), touch(1, 3)]},
            "contact.bodies",
            "bodies 1, 2, 3 touch each other in a ring",
        ),
        ({"contact": [touch(1, 2), touch(2, 5)]}, "contact[2].bodies", "needed one of 1, 2, 3"),
        ({"contact": [touch(1, 2), touch(2, 2)]}, "contact[2].bodies", "two different numbers"),
        ({"contact": [touch(1, 2)]}, "body3", "needed a table [[contact]]"),
        ({"contact": []}, "contact", "needed a table, or several, each as [[contact]]"),
        ({"contact": [touch(1, 2), 3]}, "contact", "needed tables, each as [[contact]]"),
        ({"contact": {"surface": ["top", "bottom"]}}, "contact", "needed tables [[contact]]"),
        ({"contact": [touch(1, 2), {"bodies": [2, 3]}]}, "contact[2].surface", "two names of sides"),
        ({"contact": [touch(1, 2), touch(2, 3, gap=1)]}, "contact[2].gap", "needed 0"),
        (
            {"contact": [touch(1, 2), touch(2, 3, law="local-contact")]},
            "contact[2].law",
            'needed "nonlocal" or "local"',
        ),
        ({"contact": [touch(1, 2), touch(2, 3, interval=[0, 1])]}, "contact[2].surface", "either surface or interval"),
        ({"contact": [touch(1, 2), touch(2, 3, radios=1)]}, "contact[2].radios", "did you mean 'radius'"),
        ({"body3": plate((2, 3), -1)}, "body3.young", "a number > 0"),
        ({"body3": {"shape": "rigid"}}, "body3.shape", "one that is fixed and stiff replaces an obstacle"),
        ({"body3": plate((2, 3), "1e-28")}, "body3.young", "within 1e+08"),
        ({"body4": plate((3, 4))}, "body4", "needed a table [[contact]]"),
        ({"body" + "9" * 5000: plate((3, 4))}, "body" + "9" * 5000, "unknown table"),
        ({"step": [{"body4": {}}]}, "step[1].body4", "known here: name, increments, body1, body2, body3"),
        ({"iteration": {"neumann_body": 2}}, "iteration.neumann_body", "needed neumann_bodies, a list"),
        ({"iteration": {"neumann_bodies": [1, 2]}}, "iteration.neumann_bodies", "not both of 1 and 2"),
        ({"iteration": {"neumann_bodies": [1]}}, "iteration.neumann_bodies", "not none of 2 and 3"),
        ({"iteration": {"neumann_bodies": [1, 1, 3]}}, "iteration.neumann_bodies", "different numbers"),
        ({"iteration": {"neumann_bodies": 2}}, "iteration.neumann_bodies", "a list of different numbers"),
    ],
)
def test_what_does_not_fit_is_refused_when_the_problem_is_read(change, key, needed):
    with pytest.raises(vf.ProblemError) as caught:
        read(stack() | change)
    assert caught.value.key == key
    assert needed in caught.value.needed
    assert str(caught.value).isprintable()


@pytest.mark.parametrize(
    ("change", "key", "needed"),
    [
        (
            {"contact": [touch(1, 2), touch(2, 3, surface=["lid", "bottom"])]},
            "contact[2].surface",
            "body 2 has no side 'lid'",
        ),
        ({"contact": [touch(1, 2), touch(2, 3, surface=["top", "top"])]}, "contact[2].surface", "of body 3"),
        ({"contact": [touch(1, 2), touch(2, 3, surface=["bottom", "bottom"])]}, "contact[2].surface", ""),
        (
            {"contact": [touch(1, 2), touch(2, 3, {"s": [0, 1], "k": [0, 1]})]},
            "contact[2].friction.s",
            "the length of Gamma_c, 4",
        ),
        ({"body3": plate((2, 3), fixed=["bottom"])}, "body3.fixed", "holds the one at (4, 2)"),
        (
            {"body3": plate((2, 3), fixed=["top"], traction={"bottom": [0, 1]})},
            "body3.traction.bottom",
            "Gamma_c covers",
        ),
        (
            {"body3": plate((2, 3), prescribed={"top": [0, 0], "left": [0, 1]})},
            "body3.prescribed",
            "side 'body3.top' prescribes 0",
        ),
        (
            {"body3": plate((0, 1), x=(4, 5)), "contact": [touch(1, 2), touch(2, 3, surface=["left", "top"])]},
            "contact",
            "bodies 1, 3 have one role",
        ),
    ],
    ids=str,
)
def test_what_does_not_fit_is_refused_by_the_number_of_its_body(change, key, needed):
    with pytest.raises(vf.ProblemError) as caught:
        vf.build(read(stack() | change))
    assert caught.value.key == key
    assert needed in caught.value.needed
    assert str(caught.value).isprintable()


@pytest.mark.parametrize(
    "make",
    [vf.explore, lambda problem: problem.changed(young=(1, 2)), lambda problem: problem.changed(friction=lambda s: s)],
)
def test_what_takes_two_bodies_says_so(make):
    with pytest.raises(vf.ProblemError, match=r"more than two bodies|needed one table \[contact\]|\[\[contact\]\]"):
        make(read(held()))


def test_an_odd_ring_is_named_and_an_even_one_has_two_colours():
    assert colours([(1, 2), (2, 3), (3, 4), (4, 1)]) == [({1, 3}, {2, 4})]
    with pytest.raises(OddRing) as caught:
        colours([(1, 2), (2, 3), (3, 4), (4, 5), (5, 3), (2, 6)])
    ring = caught.value.ring
    assert len(ring) == len(set(ring)) == 3
    assert set(ring) == {3, 4, 5}


def test_three_springs_in_a_ring_never_converge_undamped():
    """Each passes its force on to the next one; eigenvalues exp(+-2 pi i/3) and 1."""
    ring = np.roll(np.eye(3), 1, axis=0)
    roots = np.exp(2j * np.pi * np.arange(3) / 3)
    assert np.sort_complex(np.linalg.eigvals(ring)) == pytest.approx(np.sort_complex(roots), abs=1e-12)


def test_a_problem_turned_by_an_angle_has_the_same_results(tmp_path):
    found = []
    for angle in (0.0, 0.7):
        turn = rotation(angle)
        data = stack(cells=(8, 10, 7))
        for i in (1, 2, 3):
            body = data[f"body{i}"]
            mesh = rectangle((0.0, 4.0), (i - 1.0, float(i)), tuple(body["cells"]))
            path = tmp_path / f"body{i}.msh"
            write_gmsh22(path, mesh.points @ turn, mesh.cells, mesh.sides)
            rest = {key: value for key, value in body.items() if key not in ("shape", "x", "y", "cells")}
            data[f"body{i}"] = rest | {"mesh": str(path)}
        data["body3"]["prescribed"] = {"top": (np.array([0.001, -0.01]) @ turn).tolist()}
        problem = read(data)
        run, measured = vf.run(problem), vf.measure(problem)
        assert run.converged
        forces = [force["vector"] @ turn.T for force in run.to_dict()["forces"]]
        constants = [measured.rho_max.value, measured.rho_normal.value, measured.M.value, measured.kappa_2.value]
        found.append((run.contact.pressure, run.contact.shear, np.array(forces), np.array(constants)))
    assert all(close(one, other) for one, other in zip(*found, strict=True))


def test_bodies_of_one_role_that_lie_in_each_other_are_told_as_those_of_two_roles_are():
    """Two blocks on bases of their own, 0.3 apart; the left one is pushed by 0.5 to the right."""
    bases = {f"body{i}": plate((0, 1), cells=6, x=x, fixed=["bottom"]) for i, x in ((1, (0, 2)), (3, ("2.3", "4.3")))}
    pushed = plate((1, 2), "3e4", cells=6, x=(0, 2), prescribed={"top": ["0.5", "-0.01"]})
    other = plate((1, 2), "3e4", cells=6, x=("2.3", "4.3"), prescribed={"top": ["0.003", "-0.004"]})
    pairs = {"body2": pushed, "body4": other, "contact": [touch(1, 2), touch(3, 4)]}
    for roles in ([2, 4], [2, 3]):
        found = vf.solve(read(bases | pairs | {"iteration": {"neumann_bodies": roles}}))
        assert any("the bodies overlap" in words for words in found.warnings)
        assert found.checks.penetration_outside == pytest.approx(0.197, abs=1e-3)


def test_a_stack_of_three_without_friction_has_the_pressure_of_springs_in_series():
    """Uniaxial stress: each plate is held by a roller at its left side; grids and Poisson ratios differ."""
    sizes = {1: (0, 1, 2e4, 0.3, 6), 2: (1, 1.5, 7e4, 0.1, 9), 3: (1.5, 3, 1e4, 0.45, 4)}
    ends = {1: {"bottom": ["free", 0]}, 2: {}, 3: {"top": ["free", "-0.01"]}}
    bodies = {}
    for i, (low, high, E, nu, cells) in sizes.items():
        middle = {"roller": {"side": "left", "y": [str((3 * low + high) / 4), str((low + 3 * high) / 4)]}}
        held = {"prescribed": {"roller": [0, "free"]} | ends[i], "parts": middle}
        bodies[f"body{i}"] = plate((str(low), str(high)), str(E), x=(0, 2), **held) | {
            "poisson": str(nu),
            "cells": [cells, 4],
        }
    iteration = {"theta": "auto", "neumann_bodies": [1, 3]}
    problem = read(bodies | {"contact": [touch(1, 2, 0), touch(2, 3, 0)], "iteration": iteration})
    exact = 0.01 / sum((high - low) * (1 - nu**2) / E for low, high, E, nu, _ in sizes.values())
    assert vf.solve(problem).contact.pressure == pytest.approx(exact, rel=1e-10)
    assert vf.run(problem).contact.pressure == pytest.approx(exact, rel=1e-7)


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_sweep_whose_mesh_file_is_gone_is_refused_before_any_row(tmp_path, jobs):
    data, mesh = stack(), rectangle((0.0, 4.0), (1.0, 2.0), (8, 2))
    write_gmsh22(tmp_path / "body2.msh", mesh.points, mesh.cells, mesh.sides)
    data["body2"] = {"mesh": str(tmp_path / "body2.msh"), "young": "7e4", "poisson": "0.3"}
    problem = read(data)
    (tmp_path / "body2.msh").unlink()
    with pytest.raises(vf.ProblemError, match=r"body2\.msh: no such file"):
        vf.sweep(problem, theta=["0.3", "0.4"], jobs=jobs, store=tmp_path / "rows.sqlite")
