"""Contact along named lines: a ramp, arcs of grids that differ, rotations, both methods, certificates, refusals."""

import json
import pickle
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.quiver import Quiver
from mesh_writer import rotation, write_gmsh22
from two_methods import assert_same

import verification as vf
from fem1d2d import element, plane_strain, rectangle
from fem1d2d.assembly import unknowns
from fem1d2d.mesh import Cells
from fem1d2d.proofs.exact import fractions
from verification.certificate import check
from verification.certificate.contraction import check_again
from verification.certificate.exact_bodies import ExactBody, exact_normals
from verification.interface.assembly import discretise
from verification.interface.files import read_interface, write_interface
from verification.ledger import cases, weak_forms
from verification.ledger.solutions import solutions
from verification.problem import ProblemError
from verification.show.layout import text

#: Documents of one problem in two positions agree up to this: rounding, and what conditions make of it.
ROTATED = 1e-9

#: Two meshes that Gmsh made, joined along an arc.
PIN = Path(__file__).parents[3] / "docs" / "meshes" / "pin.toml"

#: Size of the displacements that supports prescribe here.
MOVED = 0.01


def write(path, x, cells, low, high, *, angle=0.0):
    """A body between the curves y = low(x) and y = high(x), rotated; sides bottom, top, left, right."""
    flat = rectangle((0.0, 1.0), (0.0, 1.0), cells)
    across = x[0] + (x[1] - x[0]) * flat.points[:, 0]
    y = (1 - flat.points[:, 1]) * low(across) + flat.points[:, 1] * high(across)
    write_gmsh22(path, np.column_stack([across, y]) @ rotation(angle), flat.cells, flat.sides)
    return {"mesh": str(path)}


def sector(path, radii, ends, cells, *, angle=0.0):
    """A sector of a ring; sides bottom and top at its ends, left inside and right outside."""
    flat = rectangle(radii, ends, cells)
    r, a = flat.points.T
    write_gmsh22(path, np.column_stack([r * np.cos(a), r * np.sin(a)]) @ rotation(angle), flat.cells, flat.sides)
    return {"mesh": str(path)}


def vector(x, y, angle):
    return (np.array([x, y]) @ rotation(angle)).tolist()


def ramp(folder, h=0.2, upper=0.2, angle=0.0, friction=0, **contact):
    """Two bodies that meet on y = -0.3 x; the top of the upper one is moved down."""
    slope = lambda x: -0.3 * x
    name = lambda body: folder / f"{body}-{h}-{upper}-{angle}.msh"
    lower = write(name("low"), (-1, 1), (round(2 / h), round(1 / h)), lambda x: 0 * x - 1, slope, angle=angle)
    above = write(
        name("up"), (-0.8, 0.8), (round(1.6 / upper), round(1 / upper)), slope, lambda x: 0 * x + 1, angle=angle
    )
    return vf.Problem.from_dict({
        "body1": lower | {"young": 70000, "poisson": 0.3, "fixed": ["bottom"]},
        "body2": above | {"young": 20000, "poisson": 0.3, "prescribed": {"top": vector(0, -0.01, angle)}},
        "contact": {"surface": ["top", "bottom"], "friction": friction, "radius": 0.2} | contact,
        "iteration": {"neumann_body": 1, "theta": "1/2"},
    })  # fmt: skip


def shaft(folder, cells=(8, 7), angle=0.0, friction=0.3, neumann_body=2, **contact):
    """A sector of a shaft pressed sideways into one of a bush; that of the contact body is less wide."""
    ends = ((0.1, 0.9), (0.0, 1.0)) if neumann_body == 2 else ((0.0, 1.0), (0.1, 0.9))
    inner = sector(folder / f"shaft-{angle}-{ends}.msh", (1.0, 2.0), ends[0], (3, cells[0]), angle=angle)
    outer = sector(folder / f"bush-{angle}-{ends}.msh", (2.0, 3.0), ends[1], (3, cells[1]), angle=angle)
    return vf.Problem.from_dict({
        "body1": inner | {"young": 2e5, "poisson": 0.3, "prescribed": {"left": vector(0.007, 0.007, angle)}},
        "body2": outer | {"young": 1e5, "poisson": 0.25, "fixed": ["right"]},
        "contact": {"surface": ["right", "left"], "friction": friction, "radius": 0.3} | contact,
        "iteration": {"neumann_body": neumann_body, "theta": "2/5"},
    })  # fmt: skip


PROBLEMS = {
    "ramp, one grid": lambda path, **rest: ramp(path, **rest),
    "ramp": lambda path, **rest: ramp(path, upper=0.16, friction=0.3, **rest),
    "shaft, one grid": lambda path, **rest: shaft(path, cells=(8, 10), **rest),
    "shaft": lambda path, **rest: shaft(path, **rest),
    "bush as the contact body": lambda path, **rest: shaft(path, neumann_body=1, **rest),
    "shaft, without friction": lambda path, **rest: shaft(path, friction=0, **rest),
    "shaft, local law": lambda path, **rest: shaft(path, law="local", **rest),
}


@pytest.mark.parametrize("make", PROBLEMS.values(), ids=PROBLEMS)
def test_the_limit_of_the_iteration_is_the_global_solution(make, tmp_path):
    problem = make(tmp_path)
    run, solution = vf.run(problem.with_keys({"iteration.tolerance": 1e-12})), vf.solve(problem)
    assert run.converged
    assert_same(run, solution)
    assert vf.solve(run.pair).contact.pressure == pytest.approx(solution.contact.pressure, rel=1e-9)


#: Keys of documents that depend on the position of the bodies, or are rounding and what remains of an iteration.
OF_A_POSITION = {"x", "y", "vector", "problem", "penetration_at", "strain_at", "residual_m", "residual_M"}
ROUNDING = {
    "kkt_residual",
    "history",
    "unrelaxed_residual",
    "coupled_residual",
    "observed_rate_interval",
    "step_ratio",
    "observed_rate",
}


def numbers(document, path=""):
    """The numbers of a document that a rotation must not change, by their place; lists relative to their largest."""
    if isinstance(document, dict):
        for key, member in document.items():
            if key not in OF_A_POSITION | ROUNDING and not f"{path}.{key}".endswith(".contact.normal"):
                yield from numbers(member, f"{path}.{key}")
    elif isinstance(document, list) and document and all(isinstance(member, float) for member in document):
        values = np.array(document)
        yield path, values / (MOVED if path.endswith((".gap", ".slip")) else np.abs(values).max() or 1.0)
    elif isinstance(document, list):
        for i, member in enumerate(document):
            yield from numbers(member, f"{path}.{i}")
    elif isinstance(document, float) and document:
        yield path, np.array([1.0, document])


@pytest.mark.parametrize(("name", "angle"), [("ramp", 4.2), ("shaft", 0.6), ("shaft", np.pi)])
def test_a_rotation_of_the_whole_problem_changes_no_document(name, angle, tmp_path):
    plain, other = (PROBLEMS[name](tmp_path, angle=a) for a in (0.0, angle))
    compared = lambda problem: vf.compare(problem, bounds=("repaired", "energy"))
    for door, least in ((vf.solve, 8), (vf.run, 10), (vf.measure, 15), (vf.advise, 15), (compared, 25)):
        one, two = (dict(numbers(door(problem).to_dict())) for problem in (plain, other))
        assert len(one) >= least
        assert one.keys() == two.keys()
        for place, values in one.items():
            off = np.abs(values - two[place]) / np.maximum(np.abs(values), 1.0 if len(values) > 2 else 1e-300)
            assert off.max() <= ROTATED, (door, place)
    force, image = (vf.solve(problem).contact.to_dict()["force"]["vector"] for problem in (plain, other))
    assert vector(*force, angle) == pytest.approx(image, rel=1e-9)


def test_the_force_on_a_body_on_a_ramp_converges_to_that_along_the_normal(tmp_path):
    found = {h: vf.solve(ramp(tmp_path, h=h, upper=h)).contact.to_dict()["force"]["vector"] for h in (0.2, 0.1, 0.05)}
    assert found[0.1] == pytest.approx([69.2, 230.7], rel=0.01)
    assert found[0.05] == pytest.approx([69.2, 230.7], rel=0.003)
    changes = [np.hypot(*np.subtract(found[a], found[b])) for a, b in ((0.2, 0.1), (0.1, 0.05))]
    assert changes[1] < 0.4 * changes[0]
    for force in found.values():
        assert force[0] / force[1] == pytest.approx(0.3, rel=1e-9)  # the slope of the normal: there is no friction


@pytest.mark.parametrize("neumann_body", [1, 2])
def test_a_constant_pressure_passes_between_grids_that_differ_on_a_slope(neumann_body, tmp_path):
    angle = 0.4
    low = write(tmp_path / "low.msh", (0, 1), (5, 3), lambda x: 0 * x - 1, lambda x: 0 * x, angle=angle)
    up = write(tmp_path / "up.msh", (0, 1), (7, 2), lambda x: 0 * x, lambda x: 0 * x + 1, angle=angle)
    pressed = {"traction": {"top": vector(0, -3, angle)}}
    held = {"young": 100, "poisson": 0}  # without a Poisson ratio each column is pressed by itself
    problem = vf.Problem.from_dict({
        "body1": low | held | {"fixed": ["bottom"]},
        "body2": up | held | pressed,
        "contact": {"surface": ["top", "bottom"], "friction": 0.5, "law": "local"},
        "iteration": {"neumann_body": 1},
    }).with_keys({"iteration.neumann_body": neumann_body})  # fmt: skip
    found = vf.solve(problem).contact
    assert np.abs(found.pressure - 3).max() <= 1e-12 * 3
    assert np.abs(found.shear).max() <= 1e-12 * 3


def test_a_flat_line_by_name_is_the_interval(tmp_path):
    data = vf.example("section6").changed(cells=((12, 3), (10, 3))).to_dict()
    data["body1"]["parts"] = {"deck": {"side": "top", "x": [0, 2]}}
    data["contact"].pop("interval", None)
    plain = vf.Problem.from_dict(data)
    named = vf.Problem.from_dict(data | {"contact": data["contact"] | {"surface": ["deck", "bottom"]}})
    assert named.digest != plain.digest
    one, two = vf.build(plain), vf.build(named)
    assert two.interface.join.alike
    assert two.interface.contact.normals is None
    assert np.abs(one.contact.schur - two.contact.schur).max() == 0
    assert np.abs(one.interface.transfer - two.interface.transfer).max() <= 1e-14
    a, b = vf.solve(plain).contact, vf.solve(named).contact
    assert a.pressure == pytest.approx(b.pressure, rel=1e-11)
    assert a.x == pytest.approx(b.x, rel=1e-14)


def test_bodies_may_change_places(tmp_path):
    problem = ramp(tmp_path, upper=0.16, friction=0.3)
    data = problem.to_dict()
    exchanged = data | {
        "body1": data["body2"],
        "body2": data["body1"],
        "contact": data["contact"] | {"surface": ["bottom", "top"]},
        "iteration": data["iteration"] | {"neumann_body": 2},
    }
    one, two = vf.solve(problem).contact, vf.solve(vf.Problem.from_dict(exchanged)).contact
    assert two.pressure[::-1] == pytest.approx(one.pressure, rel=1e-10)
    assert two.shear[::-1] == pytest.approx(one.shear, rel=1e-9, abs=1e-10 * one.pressure.max())
    assert two.to_dict()["force"]["vector"] == pytest.approx([-f for f in one.to_dict()["force"]["vector"]], rel=1e-10)


@pytest.mark.parametrize("name", ["ramp", "shaft"])
def test_constants_are_verified_and_contraction_is_certified(name, tmp_path):
    problem = PROBLEMS[name](tmp_path) if name == "ramp" else shaft(tmp_path, cells=(4, 3), friction="1/10")
    if name == "ramp":
        problem = ramp(tmp_path, h=0.5, upper=0.4, friction="1/10")
    found = vf.measure(problem, verified=True)
    assert found.rho_max.level == found.rho_normal.level == found.C_s.level == found.C_R.level == "verified"
    assert found.rho_max.hi - found.rho_max.lo <= 1e-8 * found.rho_max.hi
    document = json.loads(vf.certify(problem.with_theta("1/5")).to_json())
    assert check_again(document, problem).accepted
    rotated = document["discrete"]["body1"]["normals"]
    rotated[0], rotated[1] = rotated[1], rotated[0]
    assert (rotated[0] == rotated[1]) == (name == "ramp")
    rotated[0] = ["1", "1/100"]
    document["sha256"] = check.digest(document["discrete"])
    assert "normals of length 1" in check_again(document).why


@pytest.mark.parametrize("name", ["ramp", "shaft"])
def test_the_matrices_of_exact_normals_lie_within_their_radius(name, tmp_path):
    problem = PROBLEMS[name](tmp_path)
    bodies = discretise(problem)
    body = bodies.body1
    found, normals = ExactBody.of(problem, body).stiffness, exact_normals(body.normals)
    spec = problem.body1
    cells = Cells(points=fractions(body.mesh.points), cells=body.mesh.cells)
    local, places = element.stiffness(cells, plane_strain(spec.young, spec.poisson)), unknowns(body.mesh)
    place = {int(u): i for i, u in enumerate(body.positions)}
    size, exact = len(place), {}
    for rows, entries in zip(places, local.reshape(len(places), 6, 6), strict=True):
        for i, row in zip(rows.tolist(), entries, strict=True):
            for j, entry in zip(rows.tolist(), row, strict=True):
                if i in place and j in place:
                    exact[place[i], place[j]] = exact.get((place[i], place[j]), 0) + entry
    rotate = {}
    for node, (x, y) in zip(body.nodes.tolist(), normals.tolist(), strict=True):
        a, b = place[2 * node], place[2 * node + 1]
        rotate |= {a: ((a, y), (b, -x)), b: ((a, x), (b, y))}
    checked = 0
    for i in list(rotate)[::3]:
        for j in range(size):
            value = sum(p * q * exact.get((k, m), 0) for k, p in rotate[i] for m, q in rotate.get(j, ((j, 1),)))
            off = abs(value - fractions(np.array([found.middle[i, j]]))[0])
            assert off <= found.radius[i, j]
            checked += value != 0
    assert checked > 20


def test_an_interface_file_keeps_a_line(tmp_path):
    pair = vf.build(shaft(tmp_path))
    assert not pair.interface.join.alike
    for one in (pair, vf.build(shaft(tmp_path, neumann_body=1))):
        write_interface(one, tmp_path / "interface.npz")
        again = read_interface(tmp_path / "interface.npz")
        assert vf.measure(again).rho_max.value == pytest.approx(vf.measure(one).rho_max.value, rel=1e-10)
        assert vf.run(again).contact.pressure == pytest.approx(vf.run(one).contact.pressure, rel=1e-8)


def test_what_does_not_fit_is_refused_in_one_line(tmp_path):
    problem = ramp(tmp_path)
    free = r"normal component of every contact node free, side '.*' holds the one at \(-0.8, 0.24\)"
    for key, value, message in (
        ("contact.surface", '["top", "below"]', "body 2 has no side 'below'; its sides: left, right, bottom, top"),
        (
            "contact.surface",
            '["bottom", "bottom"]',
            r"side 'bottom' of body 2 does not face \(-1, -1\)|'bottom' of body 1",
        ),
        ("contact.interval", "[-0.5, 0.5]", "needed either surface or interval, not both"),
        ("contact.surface", '["top"]', "two names of sides"),
        ("body1", {"shape": "rigid"}, "needed line or circle, and side"),
        ("body2.prescribed.left", '[0, "free"]', free),
    ):
        with pytest.raises(ProblemError, match=message) as caught:
            vf.solve(problem.with_keys({key: value}))
        assert "\n" not in str(caught.value)


def test_the_weak_forms_of_whole_fields_hold_along_lines_of_any_shape(monkeypatch, tmp_path):
    """What the ledger says of the equations of both bodies, of lifts and of the inequalities of contact."""
    drawn = {name: PROBLEMS[name](tmp_path) for name in ("ramp", "shaft", "bush as the contact body")}
    run = {"iteration.tolerance": 1e-13, "iteration.max_iterations": 3000}
    made = {name: problem.with_keys(run).to_dict() for name, problem in drawn.items()}
    monkeypatch.setattr(weak_forms, "PROBLEMS", made)
    asked = ["2.4", "2.6", "4.4", "4.5", "4.9.1", "4.9.3", "5.1", "5.2", "lemma-5.2", "5.3", "5.5", "5.6"]
    for statement, evidence in solutions(asked).items():
        assert all(one.holds for one in evidence), (statement, [one.text for one in evidence])


def test_figures_and_pages_draw_tractions_along_the_normals(tmp_path):
    problem = shaft(tmp_path)
    found = vf.solve(problem)
    figure = found.plot(motions=True)
    [arrows] = [drawn for drawn in figure.axes[0].collections if isinstance(drawn, Quiver)]
    contact = found.contact
    tangent = np.stack([contact.normal[:, 1], -contact.normal[:, 0]], axis=1)
    drawn = np.stack([arrows.U, arrows.V], axis=1)
    assert (drawn * contact.normal).sum(axis=1) == pytest.approx(contact.pressure, rel=1e-12)
    assert (drawn * tangent).sum(axis=1) == pytest.approx(contact.shear, rel=1e-9, abs=1e-9 * contact.pressure.max())
    assert figure.axes[1].lines[1].get_xdata() == pytest.approx(contact.s)
    smooth = problem.with_keys({"contact": {"surface": ["right", "left"]}})  # with one friction, the runs of one row
    page = vf.explore(vf.build(smooth)).page()
    assert f'"normals":{json.dumps(contact.normal.round(6).tolist(), separators=(",", ":"))}' in page


def test_sweeps_and_changes_share_bodies_along_a_line(tmp_path):
    problem = ramp(tmp_path, friction=0.3)
    pair = vf.build(problem)
    other = pair.changed(young=(None, 4e4))
    assert other.contact.body.turned is not None
    fresh = vf.build(problem.changed(young=(None, 4e4)))
    assert other.contact.schur == pytest.approx(fresh.contact.schur, rel=1e-12)
    table = vf.sweep(problem, theta=["0.4"], neumann_body=[1, 2])
    assert table.rows[0]["outcome"] == "converged"
    assert next(row["rho"] for row in table.rows if row["neumann_body"] == 2) > table.rows[0]["rho"]
    assert vf.run(pickle.loads(pickle.dumps(pair))).contact.pressure == pytest.approx(vf.run(pair).contact.pressure)


def test_a_constant_pressure_on_an_arc_passes_up_to_an_error_that_vanishes_with_the_cells(tmp_path):
    errors = []
    for times in (1, 2, 4):
        pair = vf.build(shaft(tmp_path, cells=(8 * times, 7 * times), friction=0))
        even = lambda grid: np.concatenate([0 * grid.weights, grid.weights])
        received, expected = pair.interface.carry_back(even(pair.contact.grid)), even(pair.neumann.grid)
        errors.append(pair.neumann.dual_norm(received - expected) / pair.neumann.dual_norm(expected))
    assert errors[0] <= 2.5e-3  # mostly at the ends, where the normals of the edges are off by half their angles
    assert errors[2] <= errors[0] / 8  # order 1.5 in this norm
    force = lambda grid, vectors: np.stack(
        [grid.components(vectors)[0] * grid.upright[:, 1] + grid.components(vectors)[1] * grid.upright[:, 0],
         grid.components(vectors)[1] * grid.upright[:, 1] - grid.components(vectors)[0] * grid.upright[:, 0]]
    ).sum(axis=1)  # fmt: skip
    total = force(pair.contact.grid, even(pair.contact.grid))
    assert force(pair.neumann.grid, received) == pytest.approx(total, rel=1e-12)  # no resultant is lost


def test_some_drawn_problems_of_the_ledger_meet_on_an_upright_line():
    for made in range(40):
        rng = np.random.default_rng(made)
        plates = cases.drawn(rng)
        if "surface" not in plates["contact"]:
            continue
        upright = vf.Problem.from_dict(plates)
        run, solution = vf.run(upright), vf.solve(upright)
        assert np.abs(run.contact.pressure - solution.contact.pressure).max() <= 1e-6 * solution.contact.pressure.max()
        assert set(np.abs(solution.contact.normal[:, 0])) == {1.0}
        return
    raise AssertionError("none of them is turned")


@pytest.mark.parametrize("neumann_body", [1, 2])
def test_a_quarter_turn_of_plates_with_two_rows_of_cells_changes_nothing(neumann_body):
    """An even number of rows keeps the diagonals."""
    data = cases.PROBLEMS["sheared, body 2 Neumann"]
    plates = data | {"iteration": data["iteration"] | {"neumann_body": neumann_body}}
    flat, upright = vf.Problem.from_dict(plates), vf.Problem.from_dict(cases.quarter_turn(plates, ["0.4", "1.6"]))
    one, two = vf.solve(flat).contact, vf.solve(upright).contact
    assert two.y == pytest.approx(one.x)
    assert two.pressure == pytest.approx(one.pressure, rel=1e-12)
    assert two.shear == pytest.approx(one.shear, rel=1e-11)
    a, b = vf.measure(flat), vf.measure(upright)
    for name in ("m", "M", "C_R", "C_s", "C_tr", "C_tr_half", "rho_max", "rho_min", "rho_normal", "kappa_1", "kappa_2"):
        assert getattr(b, name).value == pytest.approx(getattr(a, name).value, rel=1e-9), name


@pytest.mark.parametrize("friction", ["0", "0.2"])
def test_a_pin_that_only_its_groove_holds_feels_no_force_sideways(friction):
    loose = {"body2.prescribed.top": '["free", -0.01]', "contact.friction": friction}
    problem = vf.load(PIN).with_keys(loose | {"iteration.theta": "0.6"})
    run, solution = vf.run(problem), vf.solve(problem)
    assert run.pair.contact.loose
    assert np.abs(run.contact.pressure - solution.contact.pressure).max() <= 1e-8 * solution.contact.pressure.max()
    x, y = solution.contact.to_dict()["force"]["vector"]
    assert abs(x) <= 1e-12 * y
    assert y > 0


def test_the_screen_names_bodies_by_number_and_shows_the_force_along_both_axes():
    shown = text(vf.solve(PIN).sections())
    assert "Neumann body: 1 |" in shown
    assert "23 nodes of body 2, Neumann grid: 19 of body 1" in shown
    assert re.search(r"on body 2 +-13.62\d+ along x, 183.5\d+ along y", shown)


@pytest.mark.parametrize("cells", [(10, 8), (8, 14), (10, 9)], ids=str)
@pytest.mark.parametrize("named", [True, False])
def test_two_convex_bodies_that_touch_do_not_overlap_as_they_are_drawn(named, cells, tmp_path):
    """Where both grids have a node at the point that touches, and where only that of the contact body has one."""
    low = write(tmp_path / "low.msh", (-0.2, 0.2), (cells[0], 3), lambda x: 0 * x - 0.3, lambda x: -x * x / 50)
    up = write(tmp_path / "up.msh", (-0.25, 0.25), (cells[1], 3), lambda x: x * x / 2, lambda x: 0 * x + 0.3)
    where = {"surface": ["top", "bottom"]} if named else {"interval": [-0.2, 0.2]}
    problem = vf.Problem.from_dict({
        "body1": low | {"young": 70000, "poisson": 0.3, "fixed": ["bottom"]},
        "body2": up | {"young": 20000, "poisson": 0.3, "prescribed": {"top": [0, "-0.001"]}},
        "contact": where,
    })  # fmt: skip
    solution = vf.solve(problem)
    assert -1e-7 <= solution.bodies.interface.gap.min() <= 4e-4
    assert not [words for words in solution.warnings if "overlap" in words]
    assert solution.contact.force["normal"] > 0
