"""Problem files and dictionaries: exact decimals, defaults, errors that can be read, and mesh files end to end."""

import copy
import dataclasses
import math
import tomllib
from decimal import Decimal
from fractions import Fraction as F

import numpy as np
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st
from mesh_writer import write_gmsh22
from problem_list import bars, small
from strategies import fewer

import verification as vf
from fem1d2d import rectangle
from ndtheory import HypothesisError
from verification.cli.problems import examples

PLANE = small()
BARS = bars((1, 1), (3, 1), (8, 8))


def changed(data, key, value):
    """A copy with one key set, by its dotted path."""
    data = copy.deepcopy(data)
    *tables, name = key.split(".")
    table = data
    for part in tables:
        table = table.setdefault(part, {})
    table[name] = value
    return data


def plane(key=None, value=None):
    return vf.Problem.from_dict(PLANE if key is None else changed(PLANE, key, value))


# --- exact numbers ---


@pytest.mark.parametrize(
    ("written", "value"),
    [
        ("0.1", F(1, 10)),
        ("1e-1", F(1, 10)),
        ('"1/3"', F(1, 3)),
        ('"0.1"', F(1, 10)),
        ('" 2 / 6 "', F(1, 3)),
        ("0.30000000000000000000000000000000000001", F(3, 10) + F(1, 10**38)),
        ("1_0.5e-2", F(21, 200)),
        ("+0.25", F(1, 4)),
    ],
)
def test_a_decimal_of_a_file_is_read_exactly(tmp_path, written, value):
    text = examples()["section6"].replace("theta = 0.7", f"theta = {written}")
    (tmp_path / "problem.toml").write_text(text, encoding="utf-8")
    assert vf.load(tmp_path / "problem.toml").iteration.theta == value


@pytest.mark.parametrize(
    ("given_value", "value"),
    [(0.1, F(1, 10)), ("1/3", F(1, 3)), (F(2, 7), F(2, 7)), (np.float64(0.3), F(3, 10)), (1e-3, F(1, 1000))],
)
def test_a_float_of_a_dictionary_means_its_shortest_decimal(given_value, value):
    assert plane("iteration.theta", given_value).iteration.theta == value
    assert plane("contact.friction", given_value).contact.friction == value


@fewer(3)
@given(strategies.contact_problems())
def test_every_number_of_a_dictionary_is_kept(data):
    problem = vf.Problem.from_dict(data)
    assert problem.length == data["norm"]["length"]
    assert problem.iteration.theta == data["iteration"]["theta"]
    for name in ("body1", "body2"):
        body = getattr(problem, name)
        assert body.young == data[name]["young"]
        assert list(body.x) == data[name]["x"]
        assert set(body.prescribed) == set(data[name].get("prescribed", ()))


@pytest.mark.parametrize("name", examples())
def test_a_file_and_its_tables_are_the_same_problem(tmp_path, name):
    path = tmp_path / f"{name}.toml"
    path.write_text(examples()[name], encoding="utf-8")
    tables = tomllib.loads(examples()[name], parse_float=Decimal)
    assert vf.load(path) == vf.load(str(path)) == vf.Problem.from_dict(tables, source=str(path))


# --- defaults ---


def test_what_is_left_out_takes_its_default():
    problem = vf.Problem.from_dict({name: PLANE[name] for name in ("body1", "body2")})
    assert problem.title == "untitled"
    assert problem.dimension == 2
    assert dict(problem.units) == {"length": "mm", "stress": "MPa"}
    assert problem.length == 1
    assert problem.source == "<dict>"
    assert problem.body1.body_force == (0, 0)
    assert dict(problem.body1.prescribed) == dict(problem.body1.traction) == {}
    contact, iteration = problem.contact, problem.iteration
    found = (contact.interval, contact.friction, contact.law, contact.radius, contact.gap)
    assert found == (None, 0, "nonlocal", None, 0)
    assert (iteration.neumann_body, iteration.theta, iteration.max_iterations) == (2, F(1, 2), 500)
    assert iteration.tolerance == 1e-9


def test_contact_reaches_as_far_as_the_bodies_overlap():
    whole = vf.measure(plane())
    assert whole.interface_nodes == 7
    assert vf.measure(plane("contact.interval", ["0.4", "1.6"])).content() == whole.content()
    assert vf.measure(plane("contact.interval", ["0.8", "1.2"])).interface_nodes == 3


@pytest.mark.parametrize("prescribed", ["-0.1", ["-0.1"], F(-1, 10)], ids=str)
def test_a_bar_takes_a_bare_number(prescribed):
    bars = vf.Problem.from_dict(changed(BARS, "body2.prescribed", {"right": prescribed}))
    assert bars.body2.prescribed["right"] == (F(-1, 10),)


def test_a_free_component_is_none():
    problem = plane("body2.prescribed", {"top": ["free", "-0.015"]})
    assert problem.body2.prescribed["top"] == (None, F(-3, 200))


# --- problems made from problems ---


@fewer(3)
@given(strategies.contact_problems(), strategies.thetas())
def test_another_theta_changes_theta_alone(data, theta):
    problem = vf.Problem.from_dict(data)
    other = problem.with_theta(theta)
    assert other.iteration.theta == theta
    assert other.with_theta(problem.iteration.theta) == problem


@pytest.mark.parametrize("theta", [0, 1, -1, 2, "x", math.nan, math.inf, None, True, "1/0"])
def test_a_theta_outside_the_interval_is_refused(theta):
    with pytest.raises(HypothesisError) as error:
        plane().with_theta(theta)
    assert error.value.key == "theta"


@fewer(3)
@given(strategies.contact_problems())
def test_swapping_twice_is_no_change(data):
    problem = vf.Problem.from_dict(data)
    assert problem.swapped().iteration.neumann_body == 3 - problem.iteration.neumann_body
    assert problem.swapped().swapped() == problem


@fewer(3)
@given(strategies.contact_problems(), st.integers(0, 4))
def test_halving_doubles_the_cells_each_time(data, halvings):
    problem = vf.Problem.from_dict(data)
    finer = problem.refined(halvings)
    assert finer.body1.cells == tuple(n * 2**halvings for n in problem.body1.cells)
    assert problem.refined(0) == problem
    assert problem.refined(1).refined(halvings) == problem.refined(halvings + 1)


@pytest.mark.parametrize("halvings", [-1, 1.5, "1"])
def test_a_mesh_is_halved_a_whole_number_of_times(halvings):
    with pytest.raises((ValueError, TypeError)):
        plane().refined(halvings)


def test_a_problem_is_frozen():
    problem = plane()
    with pytest.raises(dataclasses.FrozenInstanceError):
        problem.title = "other"


def test_a_dictionary_is_not_changed_by_reading_it():
    data = copy.deepcopy(PLANE)
    vf.Problem.from_dict(data)
    assert data == PLANE


@pytest.mark.parametrize("sequence", [list, tuple])
def test_lists_and_tuples_are_read_alike(sequence):
    data = changed(PLANE, "body1.fixed", sequence(["bottom"]))
    for key in ("x", "y", "cells"):
        data["body1"][key] = sequence(data["body1"][key])
    assert vf.Problem.from_dict(data) == plane()


# --- errors ---


@pytest.mark.parametrize(
    ("key", "value", "needed"),
    [
        ("body1.young", math.nan, "> 0"),
        ("contact.law", "Local", "nonlocal"),
        ("iteration.theta", 1, "0 < theta < 1"),
        ("body1.cells", [10, 0], "whole number"),
        ("body1.x", [2, 0], "a < b"),
        ("title", 3, "text"),
        ("norm", [], "table"),
    ],
    ids=str,
)
def test_an_error_carries_file_key_value_and_what_is_needed(key, value, needed):
    with pytest.raises(vf.ProblemError) as caught:
        vf.Problem.from_dict(changed(PLANE, key, value), source="my.toml")
    error = caught.value
    assert isinstance(error, ValueError)
    assert (error.file, error.key) == ("my.toml", key)
    assert error.value is value
    assert needed in error.needed
    message = str(error)
    assert message.startswith(f"my.toml: {key}")
    assert message.endswith(error.needed)
    assert message.isprintable()


@pytest.mark.parametrize("key", ["x", "poisson", "shape"])
def test_a_missing_key_has_no_value(key):
    data = copy.deepcopy(PLANE)
    del data["body1"][key]
    with pytest.raises(vf.ProblemError) as caught:
        vf.Problem.from_dict(data)
    assert (caught.value.file, caught.value.key, caught.value.value) == ("<dict>", f"body1.{key}", None)
    assert "missing" in caught.value.needed


@pytest.mark.parametrize(
    ("key", "meant"),
    [
        ("titel", "title"),
        ("body1.poison", "poisson"),
        ("contact.fricton", "friction"),
        ("norm.lenght", "length"),
        ("iteratoin", "iteration"),
    ],
)
def test_a_misspelt_key_is_answered_with_the_nearest_one(key, meant):
    with pytest.raises(vf.ProblemError, match=f"did you mean '{meant}'") as caught:
        plane(key, {} if key == "iteratoin" else 1)
    assert caught.value.key == key


@pytest.mark.parametrize("key", ["wibble", "body1.wibble", "contact.wibble", "units.wibble"])
def test_an_unknown_key_is_answered_with_the_known_ones(key):
    with pytest.raises(vf.ProblemError, match="known here: ") as caught:
        plane(key, 1)
    assert caught.value.key == key


@pytest.mark.parametrize("data", [None, 3, "title", [], [("body1", {})]], ids=repr)
def test_what_is_no_dictionary_is_refused(data):
    with pytest.raises(vf.ProblemError, match="a table of keys"):
        vf.Problem.from_dict(data)


@pytest.mark.parametrize(("content", "needed"), [(None, "no such file"), (b"\xff\xfe", "empty"), (b"\xff", "UTF-8")])
def test_what_is_no_problem_file_is_refused_with_its_name(tmp_path, content, needed):
    path = tmp_path / "my.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(vf.ProblemError, match=needed) as caught:
        vf.load(path)
    assert (caught.value.file, caught.value.key, caught.value.value) == (str(path), "", None)


@pytest.mark.parametrize(
    ("function", "key", "value", "named"),
    [
        (vf.measure, "body1.fixed", [], "body1"),
        (vf.run, "body1.fixed", ["bottom", "top"], "body1.fixed"),
        (vf.compare, "body2.x", [3, 4], "body2.x"),
        (lambda problem: next(vf.iterate(problem)), "contact.interval", [0, 1], "contact.interval"),
    ],
)
def test_a_problem_that_cannot_be_built_is_refused_by_every_function(function, key, value, named):
    problem = vf.Problem.from_dict(changed(PLANE, key, value), source="my.toml")
    with pytest.raises(vf.ProblemError) as caught:
        function(problem)
    assert (caught.value.file, caught.value.key) == ("my.toml", named)


# --- mesh files ---


def gmsh(path, mesh, version="2.2", order=None):
    """Write a rectangle for Gmsh with its sides as physical names; ``order`` renumbers the nodes."""
    number = np.arange(len(mesh.points)) if order is None else np.argsort(order)
    points = mesh.points if order is None else mesh.points[order]
    sides = {name: number[facets] for name, facets in mesh.sides.items()}
    cells = number[mesh.cells]
    if version == "2.2":
        write_gmsh22(path, points, cells, sides)
        return
    row = lambda values: " ".join(map(str, values))
    box = row([*points.min(axis=0), 0.0, *points.max(axis=0), 0.0])
    names = [f'1 {i} "{name}"' for i, name in enumerate(sides, 1)] + ['2 9 "body"']
    entities = ["0 4 1 0", *(f"{i} {box} 1 {i} 0" for i in range(1, 5)), f"1 {box} 1 9 0"]
    count = len(points)
    nodes = [f"1 {count} 1 {count}", f"2 1 0 {count}", *map(str, range(1, count + 1))]
    nodes += [row([repr(float(x)), repr(float(y)), 0.0]) for x, y in points]
    lines = sum(map(len, sides.values()))
    elements, tag = [f"5 {lines + len(cells)} 1 {lines + len(cells)}"], 0
    for i, block in enumerate([*sides.values(), cells], 1):
        elements.append(f"1 {i} 1 {len(block)}" if i < 5 else f"2 1 2 {len(block)}")
        for facet in block:
            tag += 1
            elements.append(row([tag, *(facet + 1)]))
    blocks = {
        "MeshFormat": ["4.1 0 8"],
        "PhysicalNames": [str(len(names)), *names],
        "Entities": entities,
        "Nodes": nodes,
        "Elements": elements,
    }
    path.write_text("".join(f"${name}\n" + "\n".join(block) + f"\n$End{name}\n" for name, block in blocks.items()))


def meshed(folder, version="2.2", order=None):
    """The plane problem with both bodies from files in a folder."""
    data = copy.deepcopy(PLANE)
    for name in ("body1", "body2"):
        body = data[name]
        ends = [tuple(float(F(end)) for end in body.pop(axis)) for axis in ("x", "y")]
        mesh = rectangle(*ends, tuple(body.pop("cells")))
        gmsh(folder / f"{name}.msh", mesh, version, None if order is None else order(len(mesh.points)))
        del body["shape"]
        body["mesh"] = f"{name}.msh"
    return vf.Problem.from_dict(data, source=str(folder / "problem.toml"))


@pytest.mark.usefixtures("known_bounds")
@pytest.mark.parametrize("version", ["2.2", "4.1"])
def test_a_rectangle_from_a_mesh_file_is_the_built_in_one(tmp_path, version):
    from_file, built_in = (vf.compare(given).content() for given in (meshed(tmp_path, version), plane()))
    reasons = [found["constants"].pop("reason") for found in (from_file, built_in)]
    for name in ("rho_cells", "rho_normal_cells"):  # a mesh file does not say that its cells are equal
        assert from_file["constants"].pop(name) is None
        assert "rectangle" in reasons[0].pop(name)
        assert built_in["constants"].pop(name) is not None
    assert reasons[0] == reasons[1]
    assert from_file == built_in


@pytest.mark.usefixtures("known_bounds")
def test_the_numbering_of_a_mesh_file_does_not_matter(tmp_path):
    renumbered = vf.compare(meshed(tmp_path, order=np.random.default_rng(7).permutation)).to_dict()
    expected = vf.compare(plane()).to_dict()
    for name in ("m", "M", "C_R", "C_s", "C_tr", "rho_max", "rho_min", "rho_normal"):
        found = renumbered["constants"][name]["value"]
        assert found == pytest.approx(expected["constants"][name]["value"], rel=1e-9)
    assert renumbered["run"]["contact"]["state"] == expected["run"]["contact"]["state"]
    pressure = expected["run"]["contact"]["pressure"]
    assert renumbered["run"]["contact"]["pressure"] == pytest.approx(pressure, rel=1e-9)
    assert renumbered["run"]["iterations"] == expected["run"]["iterations"]


def test_one_body_from_a_file_meets_a_built_in_one(tmp_path):
    both = meshed(tmp_path)
    mixed = dataclasses.replace(both, body2=plane().body2)
    assert vf.run(mixed).content() == vf.run(plane()).content()


def test_a_mesh_is_looked_for_beside_its_problem_file(tmp_path, monkeypatch):
    (tmp_path / "deep").mkdir()
    meshed(tmp_path / "deep")
    text = examples()["section6"].replace("friction = 0.2", "friction = 0.2 # coarse")
    for body, (x, y, cells) in {
        "body1": ("[0.0, 2.0]", "[-0.3, 0.0]", "[40, 6]"),
        "body2": ("[0.4, 1.6]", "[0.0, 0.3]", "[24, 6]"),
    }.items():
        text = text.replace(f'shape = "rectangle"\nx = {x}\ny = {y}\ncells = {cells}', f'mesh = "{body}.msh"')
    (tmp_path / "deep" / "problem.toml").write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert vf.measure(vf.load("deep/problem.toml")).interface_nodes == 7
    absolute = text.replace('"body', f'"{tmp_path}/deep/body')
    (tmp_path / "problem.toml").write_text(absolute, encoding="utf-8")
    assert vf.measure(vf.load("problem.toml")).interface_nodes == 7


def test_a_mesh_file_cannot_be_halved(tmp_path):
    problem = meshed(tmp_path)
    assert problem.refined(0) == problem
    with pytest.raises(vf.ProblemError, match="halved") as caught:
        problem.refined(1)
    assert caught.value.key == "body1.mesh"
