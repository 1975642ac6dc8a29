"""A problem as a dictionary, as a key and as a value: nothing is lost, and what is equal is written alike."""

import copy
import dataclasses
import hashlib
import json
import os
import pickle
import re
import tomllib
from fractions import Fraction as F

import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st
from strategies import fewer
from written_problems import BUILT_IN, MESH, documents, problems, texts

import verification as vf
from ndtheory import exact
from verification.cli.problems import examples
from verification.problem.specs import BodySpec, ReadOnly
from verification.problem.writing import toml, written_number


@pytest.fixture(scope="module")
def meshes(tmp_path_factory):
    """A folder with two mesh files; what is in them is read by no test here."""
    folder = tmp_path_factory.mktemp("meshes")
    (folder / "body1.msh").write_bytes(b"one")
    (folder / "body2.msh").write_bytes(b"two")
    return folder


# --- numbers ---


@given(st.one_of(st.fractions(), strategies.log_uniform(-30, 30, 20), st.floats(1e-30, 1e30).map(exact)))
def test_a_number_is_read_back_exactly(value):
    written = written_number(value)
    assert exact(written) == value
    assert exact(json.loads(json.dumps(written))) == value


@pytest.mark.parametrize(
    ("value", "written"),
    [
        (F(0), 0),
        (F(1, 10), 0.1),
        (F(-3, 200), -0.015),
        (F(1, 3), "1/3"),
        (F(70000), 70000),
        (F(2**53), 2**53),
        (F(2**53 + 1), "9007199254740993/1"),
        (F(10**30), 1e30),
        (F(1, 10**30), 1e-30),
        (F(3, 10) + F(1, 10**20), "30000000000000000001/100000000000000000000"),
    ],
)
def test_a_number_is_written_as_one_where_its_printed_decimal_is_exact(value, written):
    assert written_number(value) == written
    assert type(written_number(value)) is type(written)


@pytest.mark.parametrize("digits", [301, 5000, 20000])
def test_a_number_of_any_length_is_read_back_exactly(digits):
    value = F(3 * 10**digits + 1, 10 ** (digits + 1))
    assert exact(written_number(value)) == value
    assert exact(written_number(1 / value)) == 1 / value


# --- dictionaries ---


@fewer(3)
@given(st.data())
def test_a_problem_is_had_back_from_its_dictionary_and_from_its_json_text(meshes, data):
    problem = data.draw(problems(meshes))
    document = problem.to_dict()
    assert vf.Problem.from_dict(document) == problem
    assert vf.Problem.from_dict(json.loads(json.dumps(document, allow_nan=False))) == problem
    assert vf.Problem.from_dict(document).to_dict() == document


@fewer(3)
@given(st.data())
def test_equal_problems_are_written_walked_and_keyed_alike(meshes, data):
    document = data.draw(documents(meshes))
    source = str(meshes / "problem.toml")
    problem = vf.Problem.from_dict(document, source)

    def reversed_tables(value):
        return {k: reversed_tables(v) for k, v in reversed(value.items())} if isinstance(value, dict) else value

    other = vf.Problem.from_dict(reversed_tables(document), source)
    assert other == problem
    assert hash(other) == hash(problem)
    assert other.digest == problem.digest
    assert json.dumps(other.to_dict()) == json.dumps(problem.to_dict())
    assert list(other.body2.traction) == list(problem.body2.traction)


@pytest.mark.parametrize("problem", BUILT_IN.values(), ids=BUILT_IN)
def test_a_dictionary_has_the_keys_of_the_file_and_the_defaults(problem):
    document = problem.to_dict()
    plane = ["plane"] if problem.dimension == 2 else []
    bodies, several = [f"body{i}" for i in problem.bodies], isinstance(document["contact"], list)
    steps = ["step"] if problem.steps else []
    assert list(document) == ["title", "dimension", *plane, "units", *bodies, "contact", "iteration", "norm", *steps]
    roles = "neumann_bodies" if several else "neumann_body"
    assert list(document["iteration"]) == [roles, "theta", "relaxation", "tolerance", "max_iterations"]
    for contact in document["contact"] if several else [document["contact"]]:
        assert contact["law"] == "nonlocal"
    assert document["body1"]["body_force"] == ([0, 0] if problem.dimension == 2 else 0)
    empty = [
        k for table in document.values() if isinstance(table, dict) for k, v in table.items() if v in (None, [], {})
    ]
    assert empty == []


def test_the_dictionary_of_section_6_is_the_one_of_its_file():
    assert BUILT_IN["section6"].to_dict()["body2"] == {
        "shape": "rectangle",
        "x": [0.4, 1.6],
        "y": [0, 0.3],
        "cells": [24, 6],
        "split": "alternating",
        "young": 20000,
        "poisson": 0.3,
        "prescribed": {"top": [0, -0.015]},
        "body_force": [0, 0],
    }
    bars = BUILT_IN["two-bars"].to_dict()
    assert (bars["body2"]["cells"], bars["body2"]["prescribed"]) == (8, {"right": -0.1})
    assert "poisson" not in bars["body1"]


# --- problem files ---


@fewer(3)
@given(st.data())
def test_a_problem_is_had_back_from_its_file_wherever_that_is_kept(meshes, tmp_path_factory, data):
    problem = data.draw(problems(meshes))
    path = tmp_path_factory.getbasetemp() / "written.toml"
    path.write_bytes(problem.to_toml().encode())
    found = vf.load(path)
    assert found == problem
    assert found.digest == problem.digest
    assert found.to_toml() == problem.to_toml()


@pytest.mark.parametrize("name", BUILT_IN)
def test_a_written_file_has_the_tables_of_the_built_in_one_in_their_order(name):
    headers = lambda text: re.findall(r"(?m)^\[\w+\]$", text)
    written = headers(BUILT_IN[name].to_toml())
    assert [header for header in written if header in headers(examples()[name])] == headers(examples()[name])
    assert tomllib.loads(BUILT_IN[name].to_toml()) == BUILT_IN[name].to_dict()


def test_the_file_of_two_bars_reads_as_one_written_by_hand():
    bars = BUILT_IN["two-bars"].changed(title='Two "bars"', theta="1/3")
    assert (
        bars.to_toml()
        == """\
title = "Two \\"bars\\""
dimension = 1

[units]
length = "m"
stress = "Pa"

[body1]
shape = "interval"
x = [0, 1]
cells = 8
young = 3
fixed = ["left"]
body_force = 0

[body2]
shape = "interval"
x = [1, 2]
cells = 8
young = 1
prescribed = { right = -0.1 }
body_force = 0

[contact]
friction = 0
law = "nonlocal"
gap = 0

[iteration]
neumann_body = 2
theta = "1/3"
relaxation = "constant"
tolerance = 1e-09
max_iterations = 500

[norm]
length = 1
"""
    )


def test_a_mesh_whose_path_is_no_text_is_written_as_json_and_not_as_toml(tmp_path):
    folder = tmp_path / os.fsdecode(b"caf\xe9")
    try:
        folder.mkdir()
    except OSError:
        return  # a file system of texts alone has no such path
    (folder / "body.msh").write_bytes(b"a mesh")
    problem = vf.Problem.from_dict(BUILT_IN["section6"].to_dict() | {"body1": MESH}, str(folder / "my.toml"))
    assert vf.Problem.from_dict(json.loads(json.dumps(problem.to_dict()))) == problem
    with pytest.raises(vf.ProblemError, match="needed a mesh file whose path is UTF-8") as caught:
        problem.to_toml()
    assert caught.value.key == "mesh"


trees = st.recursive(
    st.one_of(texts, st.booleans(), st.integers(-(2**63), 2**63 - 1), st.floats(allow_nan=False)),
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(texts, inner, max_size=3)),
    max_leaves=12,
)


@given(st.dictionaries(texts, trees, max_size=5))
def test_toml_is_read_back_as_what_was_written(data):
    written = toml(data)
    assert tomllib.loads(written) == data
    assert json.dumps(tomllib.loads(written), sort_keys=True) == json.dumps(data, sort_keys=True)  # 1 is not 1.0
    assert tomllib.loads(written.replace("\n", "\r\n")) == data


@pytest.mark.parametrize("code", [*range(0x21), 0x22, 0x5C, 0x7F, 0x80, 0x85, 0xA0, 0x2028, 0xFEFF, 0xFFFF, 0x1F600])
def test_every_character_keeps_its_place_in_a_text_and_in_a_key(code):
    text = f"a{chr(code)}b"
    assert tomllib.loads(toml({text: {text: text}})) == {text: {text: text}}
    assert all(c.isprintable() or ord(c) >= 0x80 for c in toml({"x": text}).rstrip("\n"))


@pytest.mark.parametrize("value", [None, {1}, F(1, 2), b"a"])
def test_what_toml_does_not_know_is_refused(value):
    with pytest.raises(TypeError, match=f"{type(value).__name__} is not a TOML value"):
        toml({"x": [value]})


# --- keys ---


@fewer(3)
@given(st.data())
def test_what_changes_no_number_changes_no_key(meshes, data):
    problem = data.draw(problems(meshes))
    labels = {"length": data.draw(texts), "stress": data.draw(texts)}
    renamed = dataclasses.replace(problem, title=data.draw(texts), units=labels, source="elsewhere")
    assert renamed.digest == problem.digest
    assert re.fullmatch("[0-9a-f]{64}", problem.digest)


@pytest.mark.parametrize(
    "values",
    [
        {"friction": "0.3"},
        {"law": "local"},
        {"radius": "0.11"},
        {"gap": "1e-9"},
        {"young": ("70000.0000000000000000000000000001", None)},
        {"poisson": (None, "1/3")},
        {"cells": ((41, 6), None)},
        {"neumann_body": 2},
        {"theta": "auto"},
        {"relaxation": "newton"},
        {"tolerance": 1e-8},
        {"max_iterations": 501},
    ],
    ids=str,
)
def test_what_changes_a_number_changes_the_key(values):
    problem = BUILT_IN["section6"]
    assert problem.changed(**values).digest != problem.digest


def test_bodies_that_change_places_have_another_key():
    data = BUILT_IN["two-bars"].to_dict()
    keys = ("young", "cells")
    one, two = ({k: data[name][k] for k in keys} for name in ("body1", "body2"))
    exchanged = data | {"body1": data["body1"] | two, "body2": data["body2"] | one}
    assert vf.Problem.from_dict(exchanged).digest != vf.Problem.from_dict(data).digest


def test_the_order_in_which_sides_are_fixed_does_not_matter_to_the_key():
    data = BUILT_IN["section6"].to_dict()
    keys = set()
    for fixed in (["bottom", "left"], ["left", "bottom"]):
        data["body1"]["fixed"] = fixed
        keys.add(vf.Problem.from_dict(data).digest)
    assert len(keys) == 1


def test_the_key_of_section_6_is_that_of_a_text_without_title_and_units():
    """A store of results keeps keys: another one for the same problem would lose what is stored."""
    text = (
        '{"body1":{"body_force":[0,0],"cells":[40,6],"fixed":["bottom"],"poisson":0.3,"shape":"rectangle","x":[0,2],'
        '"y":[-0.3,0],"young":70000},"body2":{"body_force":[0,0],"cells":[24,6],"poisson":0.3,'
        '"prescribed":{"top":[0,-0.015]},"shape":"rectangle","x":[0.4,1.6],"y":[0,0.3],"young":20000},'
        '"contact":{"friction":0.2,"gap":0,"law":"nonlocal","radius":0.1},"dimension":2,'
        '"iteration":{"max_iterations":500,"neumann_body":1,"relaxation":"constant","theta":0.7,"tolerance":1e-09},'
        '"norm":{"length":1}}'
    )
    assert BUILT_IN["section6"].digest == hashlib.sha256(text.encode()).hexdigest()


# --- values ---


@fewer(3)
@given(st.data())
def test_a_problem_is_a_value(meshes, data):
    problem = data.draw(problems(meshes))
    for travel in (copy.copy, copy.deepcopy, lambda p: pickle.loads(pickle.dumps(p))):
        other = travel(problem)
        assert other == problem
        assert hash(other) == hash(problem)
        assert other.digest == problem.digest
        assert other.source == problem.source
    assert len({problem, vf.Problem.from_dict(problem.to_dict())}) == 1


def test_where_a_problem_came_from_does_not_tell_it_from_another(tmp_path):
    (tmp_path / "my.toml").write_text(examples()["section6"], encoding="utf-8")
    loaded = vf.load(tmp_path / "my.toml")
    assert loaded.source != BUILT_IN["section6"].source
    assert loaded == BUILT_IN["section6"]
    assert hash(loaded) == hash(BUILT_IN["section6"])


@pytest.mark.parametrize(
    "mapping",
    [
        lambda problem: problem.units,
        lambda problem: problem.body2.prescribed,
        lambda problem: problem.body1.traction,
        lambda problem: BodySpec(shape="rigid").prescribed,
        lambda problem: dataclasses.replace(problem.body2, prescribed={"top": (F(0), F(1))}).prescribed,
        lambda problem: pickle.loads(pickle.dumps(problem)).units,
        lambda problem: copy.deepcopy(problem).units,
    ],
)
def test_a_mapping_in_a_problem_cannot_be_written(mapping):
    found = mapping(BUILT_IN["section6"])
    before = dict(found)
    with pytest.raises(TypeError):
        found["top"] = 1
    with pytest.raises(TypeError):
        del found["top"]
    for name in ("update", "clear", "pop", "popitem", "setdefault", "__ior__"):
        assert not hasattr(found, name)
    assert dict(found) == before


def test_a_dictionary_that_is_written_later_changes_no_problem():
    units, prescribed = {"length": "m", "stress": "Pa"}, {"top": (F(0), F(1))}
    problem = dataclasses.replace(BUILT_IN["section6"], units=units)
    body = dataclasses.replace(problem.body2, prescribed=prescribed)
    units["length"] = "km"
    prescribed.clear()
    assert problem.units["length"] == "m"
    assert dict(body.prescribed) == {"top": (0, 1)}


@given(st.dictionaries(texts, st.integers()))
def test_a_read_only_mapping_is_the_dictionary_it_was_made_of(values):
    frozen = ReadOnly(values)
    assert frozen == values == dict(frozen)
    assert ReadOnly(frozen) == ReadOnly(reversed(values.items())) == frozen
    assert hash(ReadOnly(reversed(values.items()))) == hash(frozen)
    assert list(frozen) == sorted(values)
    assert repr(frozen) == repr(dict(sorted(values.items())))
    assert len(frozen) == len(values)
