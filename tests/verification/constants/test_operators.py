"""rho from solves with the bodies, beside the eigenvalues of dense interface matrices; problems too large for those."""

import json
import pickle

import jsonschema
import numpy as np
import pytest
from problem_list import blocks, changed, small
from strategies import AT_NIGHT

import verification as vf
from verification.cli.main import main
from verification.constants.measured import ENERGY_NAMES, NAMES
from verification.constants.operators import Pencils, Traces
from verification.interface import assembly
from verification.interface.assembly import TooManyContactNodes, held_bodies

#: What needs no interface matrices.
ALWAYS = ("m", "M", "rho_max", "rho_min", "rho_normal")


def unequal(cells=60, layers=(4, 3), width=2, heights=("0.3", "0.1"), friction="0.2"):
    """Two strips of unequal thickness, modulus and Poisson ratio."""
    data = blocks(
        width=width, heights=heights, cells=[(cells, layers[0]), (cells, layers[1])], young=(70000, 20000),
        poisson=("0.3", "0.4"),
    )  # fmt: skip
    return vf.Problem.from_dict(
        changed(data, contact={"friction": friction, "radius": "0.5"}, iteration={"neumann_body": 1})
    )


def by_operators(problem, told=None):
    told = [] if told is None else told
    pencils = Pencils(held_bodies(problem, dense=False), lambda what, share: told.append(what))
    neumann = problem.iteration.neumann_body
    return {
        "rho_max": pencils.largest(neumann_body=neumann).value,
        "rho_min": 1 / pencils.largest(neumann_body=3 - neumann).value,
        "rho_normal": pencils.largest(neumann_body=neumann, normal=True).value,
    }


@pytest.fixture
def few(monkeypatch):
    """Interface matrices end at 20 contact nodes."""
    monkeypatch.setattr(assembly, "MOST_CONTACT_NODES", 20)


# --- the same digits --------------------------------------------------------------------------------------------------


#: By name: width, heights, cells, and the Neumann body; at night both.
SHAPES = {
    "thin upper": (2, ("0.3", "0.1"), 60, 1),
    "thin lower": (2, ("0.1", "0.3"), 60, 2),
    "long": (20, ("0.1", "0.3"), 200, 1),
    "tall": (1, (2, 1), 25, 2),
    "few nodes": (2, (1, 1), 12, 1),
}
if AT_NIGHT:
    SHAPES |= {f"{name}, other roles": (*shape, 3 - neumann) for name, (*shape, neumann) in SHAPES.items()}


@pytest.mark.parametrize(("width", "heights", "cells", "neumann"), SHAPES.values(), ids=SHAPES)
def test_solves_with_the_bodies_give_rho_to_the_digits_of_dense_interface_matrices(width, heights, cells, neumann):
    problem = unequal(cells, width=width, heights=heights).changed(neumann_body=neumann)
    dense = vf.measure(problem)
    for name, value in by_operators(problem).items():
        assert value == pytest.approx(getattr(dense, name).value, rel=1e-9), name


def test_gamma_c_may_be_a_part_of_the_faces():
    """The corners of the upper plate of Section 6 stand on the lower one."""
    problem = vf.Problem.from_dict(small(body1={"cells": [80, 8]}, body2={"cells": [48, 6]}))
    dense = vf.measure(problem)
    for name, value in by_operators(problem).items():
        assert value == pytest.approx(getattr(dense, name).value, rel=1e-9), name


def test_mirror_images_have_one_ratio_on_all_normal_traces():
    """An eigenvalue for every node: without tangential components a body and its mirror image are alike."""
    data = blocks(width=2, cells=[(60, 4), (60, 4)], young=(7, 2), poisson=("0.3", "0.3"))
    assert by_operators(vf.Problem.from_dict(data))["rho_normal"] == pytest.approx(3.5, rel=1e-12)


@pytest.mark.parametrize("neumann", [1, 2])
def test_a_residual_bounds_the_distance_to_an_eigenvalue_of_the_dense_pencil(neumann):
    problem = unequal(cells=40)
    bodies = held_bodies(problem)
    lower, upper = (body.elastic.schur for body in bodies.elastic)
    S_c, S_n = (lower, upper) if neumann == 2 else (upper, lower)
    spectrum = np.linalg.eigvals(np.linalg.solve(S_n, S_c)).real
    found = Pencils(bodies).largest(neumann_body=neumann)
    assert found.residual <= 1e-9 * found.value
    assert np.abs(spectrum - found.value).min() <= found.residual + 1e-11 * found.value
    assert found.value == pytest.approx(spectrum.max(), rel=1e-9)


def test_the_value_repeats_to_the_digit():
    one, other = (by_operators(unequal(cells=50)) for _ in range(2))
    assert one == other


# --- that it is the largest -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("normal", [False, True])
def test_the_pivots_of_the_joined_matrix_count_the_eigenvalues_above_a_shift(normal):
    bodies = held_bodies(unequal(cells=30))
    pencils = Pencils(bodies)
    S = [
        np.column_stack([traces.force(e) for e in np.eye(len(traces.interface))])
        for traces in (Traces(b, b.interface[-31:] if normal else b.interface) for b in bodies.elastic)
    ]
    spectrum = np.sort(np.linalg.eigvals(np.linalg.solve(S[0], S[1])).real)[::-1]  # Neumann body 1
    for above in (0, 1, 2, 5, len(spectrum) // 2):
        shift = spectrum[0] * 1.01 if above == 0 else (spectrum[above - 1] + spectrum[above]) / 2
        _, count = pencils.shifted(shift, neumann_body=1, normal=normal)
        assert count == above


def test_a_shift_among_the_eigenvalues_is_raised_above_them():
    """Long strips: some dozen waves are nearly as stiff as the stiffest, and the rough value lies among them."""
    told = []
    problem = unequal(cells=160, width=16, heights=("0.1", "0.3"), layers=(8, 6))
    found = by_operators(problem, told)
    counts = [what for what in told if "counting" in what and "rho_normal" in what]
    assert len(counts) > 1
    assert found["rho_normal"] == pytest.approx(vf.measure(problem).rho_normal.value, rel=1e-9)


# --- beyond the size of interface matrices ----------------------------------------------------------------------------


def test_beyond_the_limit_rho_m_and_M_are_measured_and_the_rest_tells_why_not(monkeypatch):
    problem = unequal(cells=40)
    dense = vf.measure(problem)
    monkeypatch.setattr(assembly, "MOST_CONTACT_NODES", 20)
    large = vf.measure(problem)
    for name in ALWAYS:
        assert getattr(large, name).value == pytest.approx(getattr(dense, name).value, rel=1e-9), name
    rest = {name for name in (*NAMES, *ENERGY_NAMES) if name not in ALWAYS}
    assert {name for name in (*NAMES, *ENERGY_NAMES) if getattr(large, name) is None} == rest == set(large.reason)
    assert set(large.reason.values()) == {"41 contact nodes: dense interface matrices end at 20"}
    said = vf.schema("constants")["properties"]
    assert all("above 2000 contact nodes" in said[name]["description"] for name in rest)
    assert (large.nodes, large.interface_nodes) == (dense.nodes, dense.interface_nodes)
    assert pickle.loads(pickle.dumps(large)).rho_max == large.rho_max
    assert large.to_dict().keys() == dense.to_dict().keys()
    with pytest.raises(ValueError, match="energy norms does not apply: 41 contact nodes"):
        large.plot()


def test_without_friction_what_is_proved_is_proved_at_every_size(monkeypatch):
    problem = unequal(cells=40, friction=0)
    dense, of_dense = vf.measure(problem), vf.advise(problem)
    monkeypatch.setattr(assembly, "MOST_CONTACT_NODES", 20)
    large, of_large = vf.measure(problem), vf.advise(problem)
    assert [large.C_K.value, large.kappa_1.value, large.kappa_2.value] == [0, 0, 0]
    assert large.energy_constants().at_work == pytest.approx(float(dense.energy_constants().at_work), rel=1e-9)
    assert of_large.neumann_body == of_dense.neumann_body
    for one, other in zip(of_large.roles, of_dense.roles, strict=True):
        assert one.neumann_body == other.neumann_body
        assert one.theta_proved == pytest.approx(other.theta_proved, rel=1e-9)
        assert one.factor_proved.value == pytest.approx(other.factor_proved.value, rel=1e-9)
        assert one.theta_max_proved.value == pytest.approx(other.theta_max_proved.value, rel=1e-9)
        assert set(one.reason) == {"theta_auto", "friction_threshold", "rho_min"}


def test_with_friction_a_role_has_its_prediction_and_says_why_nothing_is_proved(monkeypatch):
    problem = unequal(cells=40)
    dense = vf.advise(problem)
    monkeypatch.setattr(assembly, "MOST_CONTACT_NODES", 20)
    large = vf.advise(problem)
    assert large.neumann_body == dense.neumann_body
    for one, other in zip(large.roles, dense.roles, strict=True):
        assert one.neumann_body == other.neumann_body
        assert one.rho.value == pytest.approx(other.rho.value, rel=1e-9)
        assert one.theta_predicted == pytest.approx(other.theta_predicted, rel=1e-9)
        assert one.rate_predicted == pytest.approx(other.rate_predicted, rel=1e-9)
        nothing = {name for name, value in one.to_dict().items() if value is None and "cells" not in name}
        assert nothing == {"theta_proved", "factor_proved", "theta_max_proved", "friction_threshold", "theta_auto"}
        assert {one.reason[name] for name in nothing} == {"41 contact nodes: dense interface matrices end at 20"}


def test_outside_the_theorem_nothing_is_proved_at_any_size(few):
    local = vf.Problem.from_dict(changed(unequal(cells=40).to_dict(), contact={"law": "local", "radius": None}))
    for role in vf.advise(local).roles:
        assert role.reason["theta_proved"].startswith("outside the theorem")


def test_halvings_may_cross_the_limit(few):
    levels = vf.measure(unequal(cells=15), refine=1).levels
    assert [level.interface_nodes for level in levels] == [16, 31]
    assert [level.C_R is None for level in levels] == [False, True]
    assert all(level.rho_max is not None for level in levels)


def test_bodies_that_hold_different_components_have_no_rho_without_interface_matrices(few):
    data = unequal(cells=40).to_dict()
    held = changed(data, body1={"prescribed": {"left": [0, "free"]}})
    measured = vf.measure(vf.Problem.from_dict(held))
    assert measured.rho_max is None is measured.rho_min
    assert "different tangential components" in measured.reason["rho_max"]
    jsonschema.validate(measured.to_dict(), vf.schema("constants"))
    assert measured.m is not None
    with pytest.raises(vf.ProblemError, match="no advice: the bodies hold different"):
        vf.advise(vf.Problem.from_dict(held))


@pytest.mark.parametrize("answer", [vf.measure, vf.advise])
@pytest.mark.parametrize(
    ("nodes", "body2"),
    [("31 and 25", {"cells": [30, 6]}), ("25 and 26", {"x": ["0.41", "1.61"]})],
    ids=["finer", "moved aside"],
)
def test_on_grids_that_differ_one_line_says_that_rho_needs_matrices(few, nodes, body2, answer):
    problem = vf.Problem.from_dict(changed(vf.example("section6").to_dict(), body2=body2, contact={"interval": None}))
    needed = rf"^<dict>: contact: needed one grid for both bodies, these have {nodes} nodes: .* up to 20 contact nodes$"
    with pytest.raises(vf.ProblemError, match=needed):
        answer(problem)


@pytest.mark.parametrize("answer", [vf.build, vf.run, vf.solve, vf.compare])
def test_what_needs_interface_matrices_refuses_in_one_line(few, answer):
    with pytest.raises(TooManyContactNodes, match=r"^<dict>: contact: needed at most 20 contact nodes, these are 41$"):
        answer(unequal(cells=40))


def test_a_body_that_moves_rigidly_is_refused_at_any_size(few):
    loose = changed(unequal(cells=40).to_dict(), body2={"prescribed": {"top": ["free", "-1/50"]}})
    with pytest.raises(vf.ProblemError, match="can move rigidly"):
        vf.measure(vf.Problem.from_dict(loose))


def test_each_step_of_a_large_problem_is_told(few):
    told = []
    for answer in (vf.measure, vf.advise):
        told.clear()
        answer(unequal(cells=40), progress=lambda what, share: told.append(what))
        for name in ("rho, Neumann body 1", "rho, Neumann body 2"):
            assert f"{name}: step 1 of Lanczos" in told
            assert any(what.startswith(f"{name}: counting the eigenvalues above") for what in told)


# --- on the screen ----------------------------------------------------------------------------------------------------


@pytest.fixture
def file(few, tmp_path):
    path = tmp_path / "large.toml"
    path.write_text(unequal(cells=40).to_toml(), encoding="utf-8")
    return path


@pytest.mark.parametrize(("command", "following"), [("constants", "advise"), ("advise", "constants")])
def test_the_commands_show_what_there_is_and_suggest_one_that_answers(file, command, following, capsys):
    assert main([command, str(file)]) == 0
    screen = capsys.readouterr().out
    assert max(map(len, screen.splitlines()[:-1])) <= 80
    assert "dense interface matrices end at" in screen
    assert screen.splitlines()[-1] == f"Next: ndtheory {following} {file}"


@pytest.mark.parametrize("command", ["constants", "advise"])
def test_the_document_of_a_large_problem_says_why_each_null_is_one(file, command, capsys):
    assert main([command, str(file), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    for part in [document, *document.get("roles", [])]:
        assert {name for name, value in part.items() if value is None} == set(part["reason"])


@pytest.mark.parametrize("command", ["run", "solve", "compare"])
def test_a_command_that_needs_interface_matrices_ends_with_one_line(file, command, capsys):
    assert main([command, str(file)]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.splitlines()[-1].endswith("contact: needed at most 20 contact nodes, these are 41")
