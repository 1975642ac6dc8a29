"""Bad input: status 2, nothing on stdout, one line that names file, key, value received and what is needed."""

import io
import os
import re
import zipfile

import meshio
import numpy as np
import pytest
import scipy.sparse as sp

from fem1d2d import rectangle
from verification.advice.matrix_files import read_matrix
from verification.cli.problems import examples

NUMBERS = {
    "body1.young": "a number > 0",
    "body2.poisson": "a number with -1 < nu < 0.5",
    "contact.friction": "a number >= 0",
    "contact.radius": "a number > 0",
    "contact.gap": "a number >= 0",
    "iteration.theta": "a number with 0 < theta < 1",
    "iteration.tolerance": "a number with 0 < tolerance < 1",
    "norm.length": "a number > 0",
}
PAIRS = {
    "body1.x": "[a, b] with a < b",
    "body2.y": "[a, b] with a < b",
    "contact.interval": "[a, b] with a < b",
    "body1.body_force": "two numbers, along x and y",
}
NO_NUMBERS = [
    *["true", "false", "nan", "-nan", "inf", "-inf", "1e400", "1e-400", '"1/0"', '"0/0"', '"x"', '""', '"1 000"'],
    *['"nan"', '"1e400"', "[]", "[1.0]", "{}", "1979-05-27", '"9e9999999999"'],
]

#: What no single key may hold: key, value, what is needed.
VALUES = [
    ("body1.young", "0", "a number > 0"),
    ("body1.young", "-1", "a number > 0"),
    ("body1.poisson", "0.5", "a number with -1 < nu < 0.5"),
    ("body2.poisson", "-1", "a number with -1 < nu < 0.5"),
    ("body2.poisson", '"1/2"', "a number with -1 < nu < 0.5"),
    ("contact.friction", "-1e-300", "a number >= 0"),
    ("contact.radius", "0", "a number > 0"),
    ("contact.radius", "-0.1", "a number > 0"),
    ("contact.gap", "-1", "a number >= 0"),
    ("contact.law", '"coulomb"', 'one of "nonlocal", "local"'),
    ("contact.law", "1", 'one of "nonlocal", "local"'),
    ("iteration.theta", "0", "a number with 0 < theta < 1"),
    ("iteration.theta", "1", "a number with 0 < theta < 1"),
    ("iteration.theta", "-0.5", "a number with 0 < theta < 1"),
    ("iteration.theta", "1.5", "a number with 0 < theta < 1"),
    ("iteration.tolerance", "0", "a number with 0 < tolerance < 1"),
    ("iteration.tolerance", "-1e-9", "a number with 0 < tolerance < 1"),
    ("iteration.tolerance", "1", "a number with 0 < tolerance < 1"),
    ("iteration.max_iterations", "0", "a whole number >= 1"),
    ("iteration.max_iterations", "-3", "a whole number >= 1"),
    ("iteration.max_iterations", "12.5", "a whole number >= 1"),
    ("iteration.max_iterations", "true", "a whole number >= 1"),
    ("iteration.max_iterations", '"9"', "a whole number >= 1"),
    ("iteration.neumann_body", "3", "one of 1, 2"),
    ("iteration.neumann_body", "true", "one of 1, 2"),
    ("iteration.neumann_body", '"1"', "one of 1, 2"),
    ("iteration.relaxation", '"faster"', '"constant"'),
    ("dimension", "3", "one of 1, 2"),
    ("dimension", "2.0", "one of 1, 2"),
    ("dimension", "true", "one of 1, 2"),
    ("title", "1", "a text in quotes"),
    ("title", '["a"]', "a text in quotes"),
    ("units.length", "1", "a text in quotes"),
    ("body1.shape", '"circle"', '"rectangle"'),
    ("body1.shape", '"interval"', '"rectangle"'),
    ("body1.cells", "[0, 2]", "whole number"),
    ("body1.cells", "[10, -2]", "whole number"),
    ("body1.cells", "[12.5, 2]", "whole number"),
    ("body1.cells", "[10.0, 2]", "whole number"),
    ("body1.cells", "[true, 2]", "whole number"),
    ("body1.cells", "[10]", "two whole numbers"),
    ("body1.cells", "[10, 2, 2]", "two whole numbers"),
    ("body1.cells", "10", "two whole numbers"),
    ("body1.cells", "[1000000, 1000000]", "at most"),
    ("body1.x", "[2.0, 0.0]", "a < b"),
    ("body1.x", "[1.0, 1.0]", "a < b"),
    ("body1.x", "[0.0, 1.0, 2.0]", "a < b"),
    ("body1.x", "[0.0, true]", "a < b"),
    ("contact.interval", "[1.6, 0.4]", "a < b"),
    ("body1.fixed", '["bottum"]', "left, right, bottom, top"),
    ("body1.fixed", '["Bottom"]', "left, right, bottom, top"),
    ("body1.fixed", '["bottom", "bottom"]', "once"),
    ("body1.fixed", '"bottom"', "a list of side names"),
    ("body1.fixed", "[1]", "a list of side names"),
    ("body2.prescribed", '["top"]', "a table"),
    ("body2.prescribed", "{ middle = [0, 0] }", "left, right, bottom, top"),
    ("body2.prescribed", "{ top = -0.015 }", "two numbers, along x and y"),
    ("body2.prescribed", "{ top = [0.0, -0.015, 0.0] }", "two numbers, along x and y"),
    ("body2.prescribed", '{ top = ["fixed", -0.015] }', '"free"'),
    ("body1.prescribed", "{ bottom = [0.0, 0.0] }", "fixed already"),
    ("body1.traction", "{ middle = [0.0, 1.0] }", "left, right, bottom, top"),
    ("body1.traction", "{ bottom = [0.0, 1.0] }", "held"),
    ("body1.traction", '{ left = ["free", 1.0] }', "two numbers, along x and y"),
    ("body1.body_force", "1.0", "two numbers, along x and y"),
]

BESIDE_SHAPE = ["x", "y", "cells", "young", "poisson", "fixed", "body_force"]

#: What fits key by key and not together: edits, then fragments of the line.
TOGETHER = {
    "a mesh and a shape": ({"body1.mesh": '"a.msh"'}, ["body1.shape", "not both"]),
    "body 1 can move rigidly": ({"body1.fixed": None}, ["body1", "fix or prescribe"]),
    "body 2 can slide": ({"body2.prescribed": '{ top = ["free", 0.0] }'}, ["body2", "can move rigidly", "1 free"]),
    "nothing but free sides": ({"body2.prescribed": '{ top = ["free", "free"] }'}, ["body2", "fix or prescribe"]),
    "a fixed contact side": ({"body1.fixed": '["bottom", "top"]'}, ["body1.fixed", "normal component", "(0.4, 0)"]),
    "a fixed corner": (
        {"body2.prescribed": None, "body2.fixed": '["left"]'},
        ["body2.fixed", '"left"', "normal component", "(0.4, 0)"],
    ),
    "a corner held by another side than the fixed one": (
        {"body2.prescribed": '{ left = ["free", 0.0] }', "body2.fixed": '["top"]'},
        ["body2.prescribed", "left", "normal component", "(0.4, 0)"],
    ),
    "two values at a corner": (
        {"body2.prescribed": '{ top = [0.0, -0.015], left = [0.1, "free"] }'},
        ["body2.prescribed", "'top'", "0.1", "(0.4, 0.3)"],
    ),
    "apart along y": ({"body2.y": "[0.1, 0.4]"}, ["body2.y", "do not meet", "y = 0.1", "contact.gap"]),
    "drawn into each other": ({"body2.y": "[-0.1, 0.3]"}, ["body2.y", "do not meet", "y = -0.1"]),
    "the upper body first": ({"body1.y": "[0.3, 0.6]"}, ["body2.y", "do not meet", "y = 0.6"]),
    "drawn apart by another gap": (
        {"body2.y": "[0.1, 0.4]", "contact.gap": "0.05"},
        ["body2.y", "do not meet", "contact.gap"],
    ),
    "apart along x": ({"body2.x": "[3.0, 4.2]"}, ["body2.x", "do not meet", "0 to 2", "3 to 4.2"]),
    "corner to corner": ({"body2.x": "[2.0, 3.2]"}, ["body2.x", "do not meet"]),
    "an interval outside the overlap": ({"contact.interval": "[0.2, 1.6]"}, ["contact.interval", "[0.4, 1.6]"]),
    "an interval far from the overlap": ({"contact.interval": "[5.0, 6.0]"}, ["contact.interval", "[0.4, 1.6]"]),
    "an interval that ends between nodes": (
        {"contact.interval": "[0.5, 1.5]"},
        ["contact.interval", "begin and end at nodes", "0.6 to 1.4"],
    ),
    "an interval with one node": ({"contact.interval": "[0.55, 0.65]"}, ["contact.interval", "at nodes"]),
    "an interval without a node": ({"contact.interval": "[0.45, 0.55]"}, ["contact.interval", "nowhere"]),
    "grids that do not match": ({"body2.cells": "[7, 2]"}, ["body2.cells", "non-matching grids", "7", "8"]),
    "friction without a radius": ({"contact.radius": None}, ["contact.radius", "missing", 'law = "local"']),
    "a rigid body": (
        {"body1.shape": '"rigid"'} | dict.fromkeys(f"body1.{key}" for key in BESIDE_SHAPE),
        ["body1.shape", '"rigid"', "elastic body"],
    ),
    "another word for auto": ({"iteration.theta": '"automatic"'}, ["iteration.theta", '"automatic"', 'or "auto"']),
    "an unknown relaxation": ({"iteration.relaxation": '"broyden"'}, ["iteration.relaxation", '"broyden"', "aitken"]),
    "a force where only contact forces act": (
        {"body2.traction": "{ bottom = [0.0, -9.0] }"},
        ["body2.traction", "bottom"],
    ),
}

BARS = {
    "a bar has no y": ({"body1.y": "[0, 1]"}, ["body1.y", "unknown key"]),
    "a bar has no Poisson ratio": ({"body1.poisson": "0.3"}, ["body1.poisson", "Poisson ratio"]),
    "two bars have no friction": ({"contact.friction": "0.1"}, ["contact.friction", "0"]),
    "two bars meet at a point": ({"contact.interval": "[0, 1]"}, ["contact.interval", "at a point"]),
    "a bar has one number of cells": ({"body1.cells": "[8]"}, ["body1.cells", "[8]", "a whole number >= 1"]),
    "a bar has no bottom": ({"body1.fixed": '["bottom"]'}, ["body1.fixed", "bottom", "left, right"]),
    "a bar held at its contact end": ({"body1.fixed": '["left", "right"]'}, ["body1.fixed", "normal component"]),
    "a bar that flies": ({"body1.fixed": None}, ["body1", "fix or prescribe"]),
    "bars apart": ({"body2.x": "[1.5, 2.0]"}, ["body2.x", "do not meet", "x = 1.5"]),
}

#: What is no problem file at all: bytes, then fragments.
CONTENTS = {
    "an empty file": (b"", ["empty", "ndtheory example"]),
    "a blank file": (b" \n\t\n", ["empty", "ndtheory example"]),
    "comments alone": (b"# nothing\n", ["body1", "missing"]),
    "malformed TOML": (b"[body1\nx = 1", ["not TOML", "line 1"]),
    "an unclosed string": (b'title = "a\n', ["not TOML", "line 1"]),
    "a key set twice": (b"title = 'a'\ntitle = 'b'\n", ["not TOML", "line 2"]),
    "a table opened twice": (b"[norm]\nlength = 1\n[norm]\n", ["not TOML", "norm", "line 3"]),
    "binary rubbish": (bytes(range(256)) * 8, ["UTF-8"]),
    "UTF-16": ("title = 'a'".encode("utf-16"), ["UTF-8"]),
    "Latin-1": ("title = 'Münze'".encode("latin-1"), ["UTF-8"]),
    "a null byte": (b"title = 'a'\n\0", ["not TOML"]),
    "brackets without end": (b"a = " + b"[" * 100_000, ["not TOML"]),
    "a number of 9999 digits": (b"a = " + b"9" * 9999, ["not TOML", "digits"]),
    "JSON": (b'{"title": "a"}', ["not TOML", "line 1"]),
}


def spoken(value: str) -> str:
    """A value as a line may show it: the spelling of numbers is free."""
    return value.lower().replace("+", "").replace("infinity", "inf").replace(".0", "").replace('"', "'")


def assert_names(line: str, *fragments: str) -> None:
    said = spoken(line)
    assert [fragment for fragment in fragments if spoken(fragment) not in said] == []


@pytest.mark.parametrize("value", NO_NUMBERS)
@pytest.mark.parametrize(("key", "needed"), NUMBERS.items(), ids=NUMBERS)
def test_what_is_no_number_is_refused_where_a_number_is_needed(call, write, key, needed, value):
    shown = [] if key == "iteration.theta" and value in ("{}", "[]") else [value]
    assert_names(call("run", write({key: value})).complaint, "problem.toml", f"{key} = ", *shown, f"needed {needed}")


@pytest.mark.parametrize("value", NO_NUMBERS)
@pytest.mark.parametrize(("key", "needed"), PAIRS.items(), ids=PAIRS)
def test_what_is_no_number_is_refused_within_a_pair(call, write, key, needed, value):
    assert_names(call("run", write({key: f"[0.4, {value}]"})).complaint, "problem.toml", f"{key} = ", value, needed)


@pytest.mark.parametrize(("key", "value", "needed"), VALUES, ids=lambda v: str(v)[:40])
def test_a_value_that_does_not_fit_is_refused_by_name(call, write, key, value, needed):
    received = re.findall(r'"[^"]*"|[\w.-]+', value)[0 if value.startswith("{") else -1]
    assert_names(call("run", write({key: value})).complaint, "problem.toml", key, received, needed)


@pytest.mark.parametrize("value", ["3", "[]", '"x"', "[{x = 1}]", "true"])
@pytest.mark.parametrize("table", ["units", "body1", "body2", "contact", "iteration", "norm"])
def test_a_table_that_is_none_is_refused_by_name(call, write, table, value):
    file = write({table: value})
    file.write_text(file.read_text("utf-8").replace(f"[{table}]", "[elsewhere]"), encoding="utf-8")
    assert_names(call("run", file).complaint, "problem.toml", f"{table} = {value}", "a table")


@pytest.mark.parametrize("command", ["run", "compare", "constants"])
@pytest.mark.parametrize(("edits", "fragments"), TOGETHER.values(), ids=TOGETHER)
def test_what_does_not_fit_together_is_refused_by_name(call, write, command, edits, fragments):
    assert_names(call(command, write(edits)).complaint, "problem.toml", *fragments)


@pytest.mark.parametrize(("edits", "fragments"), BARS.values(), ids=BARS)
def test_bars_are_refused_what_only_plane_bodies_have(call, write, edits, fragments):
    file = write(edits, "bars.toml", examples()["two-bars"])
    assert_names(call("run", file).complaint, "bars.toml", *fragments)


@pytest.mark.parametrize(
    ("key", "guess"),
    [
        ("titel", "title"),
        ("body1.yuong", "young"),
        ("body2.presribed", "prescribed"),
        ("contact.fricton", "friction"),
        ("iteration.max_iteration", "max_iterations"),
        ("iteration.Theta", "theta"),
        ("norm.lenght", "length"),
        ("units.time", "stress"),
        ("mesh.cells", "norm"),
        ("contact.mu", "friction"),
    ],
)
def test_an_unknown_key_or_table_is_refused_with_the_known_ones(call, write, key, guess):
    line = call("run", write({key: "1"})).complaint
    assert_names(line, "problem.toml", key.removesuffix(".cells"), "unknown", guess)


@pytest.mark.parametrize("key", ["body1.shape", "body1.x", "body1.young", "body1.poisson", "body2.y", "body2.cells"])
def test_a_missing_key_is_named(call, write, key):
    assert_names(call("run", write({key: None})).complaint, "problem.toml", key, "missing")


@pytest.mark.parametrize(("content", "fragments"), CONTENTS.values(), ids=CONTENTS)
def test_what_is_no_problem_file_is_refused(call, tmp_path, content, fragments):
    file = tmp_path / "problem.toml"
    file.write_bytes(content)
    assert_names(call("run", file).complaint, "problem.toml", *fragments)


@pytest.mark.parametrize("command", ["run", "compare", "constants", "solve"])
@pytest.mark.parametrize(
    ("name", "needed"),
    [
        ("missing.toml", "no such file"),
        ("missing/problem.toml", "no such file"),
        ("folder", "folder"),
        ("problem.toml/inside", "directory"),
        ("loop", "symbolic links"),
        ("n" * 300, "too long"),
        ("\N{GREEK SMALL LETTER RHO}.toml", "no such file"),
    ],
    ids=lambda v: v[:20],
)
def test_what_is_no_file_is_refused(call, write, tmp_path, command, name, needed):
    write()
    (tmp_path / "folder").mkdir()
    (tmp_path / "loop").symlink_to("loop")
    assert_names(call(command, tmp_path / name).complaint, name, needed)


@pytest.mark.parametrize("place", ["file", "key", "side", "value", "table"])
def test_a_line_break_in_what_was_received_does_not_break_the_line(call, write, tmp_path, place):
    edits = {
        "file": {"body1.young": "-1"},
        "key": {r'iteration."a\nb"': "1"},
        "side": {"body2.prescribed": r'{ "a\nb" = [0, 0] }'},
        "value": {"contact.law": r'"a\nb"'},
        "table": {r'"a\nb".x': "1"},
    }
    line = call("run", write(edits[place], "a\nb.toml" if place == "file" else "problem.toml")).complaint
    assert line.isprintable()


@pytest.mark.parametrize(
    ("arguments", "fragments"),
    [
        ("run", ["FILE"]),
        ("run FILE FILE", ["extra argument"]),
        ("run FILE --bogus", ["--bogus"]),
        ("run FILE --refine 1", ["--refine"]),
        ("run FILE --theta", ["--theta"]),
        ("run FILE --theta nan", ["theta = nan", "0 < theta < 1"]),
        ("run FILE --theta 1/0", ["theta = 1/0", "0 < theta < 1"]),
        ("run FILE --theta -1", ["theta = -1", "0 < theta < 1"]),
        ("run FILE --theta 0", ["theta = 0", "0 < theta < 1"]),
        ("run FILE --theta 1", ["theta = 1", "0 < theta < 1"]),
        ("run FILE --theta 1e400", ["theta = 1e400", "0 < theta < 1"]),
        ("run FILE --theta=", ["theta = ", "0 < theta < 1"]),
        ("compare FILE --theta x", ["theta = x", "0 < theta < 1"]),
        ("run FILE --solver Auto", ["--solver", "Auto", "active-set"]),
        ("run FILE --swap-roles=1", ["--swap-roles"]),
        ("constants FILE --refine 9", ["--refine", "9", "8"]),
        ("constants FILE --refine -1", ["--refine", "-1"]),
        ("constants FILE --refine 1.5", ["--refine", "1.5"]),
        ("constants FILE --theta 0.5", ["--theta"]),
        ("example nothing", ["nothing", "section6", "two-bars"]),
        ("example section6.toml", ["section6.toml", "section6"]),
        ("example ../section6", ["../section6"]),
        ("demo FILE", ["extra argument"]),
        ("demo -o", ["-o"]),
        ("Run FILE", ["Run"]),
        ("bogus", ["bogus"]),
        ("--bogus", ["--bogus"]),
        ("bounds", ["--m"]),
        ("bounds --m 1 --M 2", ["--CR"]),
        ("bounds --m 1 --M 2 --CR 1", ["C_K"]),
        ("bounds --m 1 --M 2 --CR 1 --k 1 --Cs 1", ["C_tr"]),
        ("bounds --m 1 --M 2 --CR 1 --CK 0 --k 1", ["C_K", "k"]),
        ("bounds --m 0 --M 2 --CR 1 --CK 0", ["m = 0", "m > 0"]),
        ("bounds --m nan --M 2 --CR 1 --CK 0", ["m = nan", "m > 0"]),
        ("bounds --m 1e-400 --M 2 --CR 1 --CK 0", ["m = 1e-400", "m > 0"]),
        ("bounds --m= --M 2 --CR 1 --CK 0", ["m = ", "m > 0"]),
        ("bounds --m 3 --M 2 --CR 1 --CK 0", ["M = 2", "M >= m = 3"]),
        ("bounds --m 1 --M inf --CR 1 --CK 0", ["M = inf", "M >= m = 1"]),
        ("bounds --m 1 --M 2 --CR 0.99 --CK 0", ["C_R = 0.99", "C_R >= 1"]),
        ("bounds --m 1 --M 2 --CR 1 --CK -1", ["C_K = -1", "C_K >= 0"]),
        ("bounds --m 1 --M 2 --CR 1 --k -1 --Cs 1 --Ctr 1", ["k = -1", "k >= 0"]),
        ("bounds --m 1 --M 2 --CR 1 --CK 0 --theta 1", ["theta = 1", "0 < theta < 1"]),
        ("bounds --m 1 --M 2 --cr 1 --CK 0", ["--cr"]),
        ("bounds --m 1 --M 2 --CR 1 --CK 0 --check", ["--check", "--theta"]),
        ("bounds --m 1 --M 2 --CR 1 --CK 0 --edition Printed", ["--edition", "Printed", "repaired"]),
        ("bounds --m 1 --M 2 --CR 1 --CK 0 extra", ["extra"]),
    ],
)
def test_a_bad_call_is_refused_by_name(call, write, arguments, fragments):
    file = write()
    assert_names(call(*(str(file) if a == "FILE" else a for a in arguments.split(" "))).complaint, *fragments)


@pytest.mark.parametrize(
    ("options", "fragments"),
    [
        ("--kappa1 1", ["--m", "or --rho"]),
        ("--rho 1 --kappa1 1", ["--kappa2 missing"]),
        ("--rho 1 --k 0.2", ["--kappa1", "--kappa2", "with friction"]),
        ("--m 1 --M 2 --CR 1 --CK 1 --rho 1", ["--kappa1", "--kappa2", "with friction"]),
        ("--rho 0", ["--rho", "0", "rho > 0"]),
        ("--rho -1", ["--rho", "-1", "rho > 0"]),
        ("--rho nan", ["--rho", "nan"]),
        ("--rho 1 --kappa1 -1 --kappa2 1", ["--kappa1", "-1", ">= 0"]),
        ("--rho 1 --kappa1 1 --kappa2 nan", ["--kappa2", "nan", ">= 0"]),
        ("--rho 1 --theta 1", ["theta", "0 < theta < 1"]),
    ],
)
def test_the_sharp_edition_needs_rho_and_with_friction_both_kappas(call, options, fragments):
    assert_names(call("bounds", *options.split()).complaint, *fragments)


@pytest.mark.parametrize("folder", ["problem.toml", "problem.toml/results", "missing/../problem.toml", ""])
@pytest.mark.parametrize("command", ["run", "compare", "demo", "solve"])
def test_an_output_folder_that_cannot_be_one_is_refused_before_anything_is_computed(
    call, write, tmp_path, monkeypatch, command, folder
):
    file = write()
    (tmp_path / "missing").mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("verification.interface.assembly.build", None)
    monkeypatch.setattr("verification.interface.assembly.discretise", None)
    assert_names(call(*([command] if command == "demo" else [command, file]), "-o", folder).complaint, folder, "folder")


@pytest.mark.parametrize(
    ("neumann", "body2"), [(2, "the Neumann problem of step I"), (1, "the contact problem of step II")]
)
def test_a_body_that_can_move_is_named_with_the_problem_it_has(call, write, neumann, body2):
    edits = {"body2.prescribed": '{ top = ["free", 0.0] }', "iteration.neumann_body": str(neumann)}
    assert_names(call("run", write(edits)).complaint, "problem.toml: body2", "can move rigidly", body2, "is singular")


def test_a_third_body_is_no_misspelling_of_the_second(call, write):
    line = call("run", write({"body3.young": "1"})).complaint
    assert_names(line, "problem.toml: body3", "unknown table", "known here: ", "body1, body2")
    assert "did you mean" not in line


@pytest.mark.parametrize(
    ("key", "shown"), [('""', ': ""'), ('body1.""', 'body1.""'), ('contact.""', 'contact.""'), ('"".x', ': ""')]
)
def test_an_empty_key_is_shown_in_quotes(call, write, key, shown):
    assert_names(call("run", write({key: "1"})).complaint, "problem.toml", shown, "unknown")


LONG = "x" * 5000


@pytest.mark.parametrize(
    "edits",
    [
        {LONG: "1"},
        {f"body1.{LONG}": "1"},
        {f"{LONG}.x": "1"},
        {"body1.fixed": f'["{LONG}"]'},
        {"body2.prescribed": f"{{ {LONG} = [0, 0] }}"},
        {"contact.law": f'"{LONG}"'},
        {"iteration.theta": f'"0.{"3" * 5000}x"'},
        {"body1.mesh": f'"{LONG}"', **dict.fromkeys(f"body1.{key}" for key in ("shape", "x", "y", "cells"))},
    ],
    ids=lambda edits: next(iter(edits))[:20],
)
def test_what_was_received_is_not_repeated_at_length(call, write, tmp_path, edits):
    line = call("run", write(edits)).complaint
    assert_names(line, "problem.toml: ")
    assert len(line.replace(str(tmp_path), "")) < 700


@pytest.mark.parametrize("command", ["run", "solve", "constants", "advise"])
def test_a_path_is_not_repeated_at_length(call, command):
    line = call(command, "9" * 5000 + ".toml").complaint
    assert_names(line, "9.toml", "too long")
    assert len(line) < 700


@pytest.mark.parametrize("value", ["0.5\nx", "0.5\x1b[2Jx", "9" * 5000, "0." + "3" * 5000 + "x"], ids=lambda v: v[:8])
def test_a_theta_of_the_command_line_is_refused_on_one_short_line(call, write, value):
    line = call("run", write(), "--theta", value).complaint
    assert line.isprintable()
    assert len(line) < 700
    assert_names(line, "theta = ", "0 < theta < 1")


@pytest.mark.parametrize("command", ["constants", "compare", "run", "advise"])
def test_moduli_that_doubles_cannot_hold_side_by_side_are_refused(call, write, command):
    line = call(command, write({"body1.young": "1e30", "body2.young": "1e-30"})).complaint
    assert_names(
        line,
        "problem.toml",
        "body2.young = ",
        "1e-30",
        "needed a modulus within 1e30 times that of body1, 1e30",
        "rigid",
    )


# --- files without an end ---


def endless(path, kind):
    """A pipe nobody writes to, a device, or a file of 3 GB that takes no room."""
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    else:
        with path.open("wb") as file:
            file.truncate(3 * 10**9)
    return path


ENDLESS = {"pipe": "this is a pipe or a device", "device": "this is a pipe or a device", "large": "this one has 3000"}


@pytest.mark.parametrize(("kind", "says"), ENDLESS.items())
@pytest.mark.parametrize("command", ["run", "compare", "constants", "solve", "advise"])
def test_a_problem_file_without_an_end_is_refused_unread(call, tmp_path, command, kind, says):
    assert_names(call(command, endless(tmp_path / "problem.toml", kind)).complaint, "problem.toml", says)


@pytest.mark.parametrize(("kind", "says"), ENDLESS.items())
def test_a_mesh_file_without_an_end_is_refused_unread(call, write, tmp_path, kind, says):
    endless(tmp_path / "body1.msh", kind)
    assert_names(call("run", write(MESHED)).complaint, "problem.toml", "body1.mesh", "body1.msh", says)


@pytest.mark.parametrize(("kind", "says"), ENDLESS.items())
def test_a_matrix_without_an_end_is_refused_unread(call, tmp_path, kind, says):
    bad = endless(tmp_path / "bad.npz", kind)
    np.save(tmp_path / "good.npy", np.eye(2))
    assert_names(call("advise", "--S1", bad, "--S2", tmp_path / "good.npy").complaint, "bad.npz", says)


@pytest.mark.parametrize("kind", ["pipe", "device"])
@pytest.mark.parametrize(
    ("command", "name"), [("run", "run.json"), ("compare", "report.html"), ("solve", "bodies.svg")]
)
def test_a_result_without_an_end_is_somebody_elses(call, write, tmp_path, kind, command, name):
    (tmp_path / "results").mkdir()
    endless(tmp_path / "results" / name, kind)
    line = call(command, write(), "-o", tmp_path / "results").complaint
    assert_names(line, name, "not written by this program")


def packed(path, **headers):
    """An archive of arrays whose headers promise more than their data hold."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, (shape, kind) in headers.items():
            head = io.BytesIO()
            np.lib.format.write_array_header_1_0(head, {"shape": shape, "fortran_order": False, "descr": kind})
            archive.writestr(f"{name}.npy", head.getvalue() + bytes(10_000_000))
    return path


@pytest.mark.parametrize(
    ("headers", "says"),
    [
        ({"S": ((100_000, 100_000), "<f8")}, "needed at most 4000 rows, received 100000"),
        ({"S": ((10**12,), "<f8")}, "needed at most 4000 rows, received 1000000"),
        ({"S": ((3,), "<U300000000")}, "not a matrix"),
        ({"format": ((), "|S3"), "shape": ((2,), "<i8"), "data": ((10**11,), "<f8")}, "needed at most 4000 rows"),
    ],
)
def test_a_matrix_that_would_fill_the_memory_is_refused_by_its_header(call, tmp_path, headers, says):
    bomb = packed(tmp_path / "bomb.npz", **headers)
    assert bomb.stat().st_size < 100_000
    assert_names(call("advise", "--S1", bomb, "--S2", bomb).complaint, "bomb.npz", says)


@pytest.mark.parametrize("blocks", [((0, 0), (0, 0, 0)), ((2, 2), (1, 0, 0)), ((2, 2), (1, 0, 2))])
def test_a_matrix_of_empty_blocks_is_refused(call, tmp_path, blocks):
    shape, data = blocks
    np.savez(
        tmp_path / "S.npz", format=np.array(b"bsr"), shape=np.array(shape), data=np.zeros(data),
        indices=np.zeros(len(np.zeros(data)), dtype=int), indptr=np.array([0, len(np.zeros(data))]),
    )  # fmt: skip
    answer = call("advise", "--S1", tmp_path / "S.npz", "--S2", tmp_path / "S.npz")
    assert_names(answer.complaint, "S.npz", "not a matrix")


@pytest.mark.parametrize("entry", ["1.7e308", "1e300", "5e-324"])
def test_a_matrix_at_the_ends_of_the_doubles_is_judged_without_a_warning_of_numpy(call, tmp_path, entry):
    np.save(tmp_path / "S.npy", float(entry) * np.eye(3))
    np.save(tmp_path / "bad.npy", float(entry) * (np.eye(3) - 1))
    answer = call("advise", "--S1", tmp_path / "S.npy", "--S2", tmp_path / "S.npy")
    assert (answer.status, answer.err) == (0, "")
    line = call("advise", "--S1", tmp_path / "S.npy", "--S2", tmp_path / "bad.npy").complaint
    assert_names(line, "S2 is indefinite", "needed a positive definite matrix")


@pytest.mark.parametrize("entry", ["1.7e308", "1e300", "1e-300"])
def test_a_matrix_whose_sums_would_overflow_is_read_in_any_unit(call, tmp_path, entry):
    np.save(tmp_path / "S.npy", float(entry) * (np.eye(3) / 2 + np.ones((3, 3)) / 9))
    answer = call("advise", "--S1", tmp_path / "S.npy", "--S2", tmp_path / "S.npy", "--json")
    assert (answer.status, answer.err) == (0, "")
    assert answer.document["roles"][0]["rho"]["value"] == pytest.approx(1, rel=1e-9)


def test_a_matrix_whose_header_is_damaged_is_refused(call, tmp_path):
    np.save(tmp_path / "S.npy", np.eye(3))
    whole = (tmp_path / "S.npy").read_bytes()
    (tmp_path / "S.npy").write_bytes(whole.replace(b"}", b"{", 1))
    assert_names(
        call("advise", "--S1", tmp_path / "S.npy", "--S2", tmp_path / "S.npy").complaint, "S.npy", "not a matrix"
    )


@pytest.mark.parametrize("kind", ["csr", "csc", "coo", "dia", "bsr"])
def test_a_sparse_matrix_of_every_kind_is_read(tmp_path, kind):
    full = np.diag([2.0, 3.0, 4.0, 5.0]) + np.eye(4, k=1) + np.eye(4, k=-1)
    sp.save_npz(tmp_path / "S.npz", sp.coo_array(full).asformat(kind))
    assert np.array_equal(read_matrix(tmp_path / "S.npz"), full)


# --- numbers that a file may hold and arithmetic may not ---


@pytest.mark.parametrize("value", ["1e300", "1e150", "1e-150", "1e-300"])
@pytest.mark.parametrize(
    "key", ["body1.young", "body2.young", "contact.friction", "contact.radius", "contact.gap", "norm.length"]
)
def test_no_size_of_a_number_crashes_a_command(call, write, key, value):
    for command in ("constants", "run", "solve", "compare"):
        answer = call(command, write({key: value}), "--json")
        assert "Traceback" not in answer.err
        if answer.status == 2:
            assert_names(answer.complaint, "problem.toml", key)
        else:
            assert answer.document


@pytest.mark.parametrize("value", ["1e300", "1e150", "1e-150", "1e-300"])
@pytest.mark.parametrize("option", ["--m", "--M", "--CR", "--Cs", "--Ctr", "--k"])
def test_no_size_of_a_constant_crashes_the_calculator(call, option, value):
    given = {"--m": "1", "--M": "2", "--CR": "1", "--Cs": "1", "--Ctr": "1", "--k": "0"} | {option: value}
    answer = call("bounds", *(word for pair in given.items() for word in pair), "--json")
    assert "Traceback" not in answer.err
    if answer.status == 2:
        assert answer.complaint
    else:
        assert answer.document


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("body1.poisson", "0." + "4" + "9" * 30),
        ("body1.poisson", "-0." + "9" * 30),
        ("body2.y", "[0.0, 1e-300]"),
        ("body1.x", "[0.0, 1e300]"),
        ("body1.x", "[2.0, 2.00000000000000000000000000001]"),
        ("body1.x", "[1e16, 1.0000000000000002e16]"),
    ],
    ids=["nearly 1/2", "nearly -1", "flat", "long", "one double", "no doubles for the nodes"],
)
def test_what_is_distinct_in_decimals_and_not_in_doubles_is_refused_by_name(call, write, key, value):
    assert_names(call("run", write({key: value})).complaint, "problem.toml", key[:5])


@pytest.mark.parametrize("key", ["body1.young", "iteration.theta", "iteration.neumann_body", "title", "body1.cells"])
def test_a_hexadecimal_number_of_5000_digits_is_refused(call, write, key):
    assert_names(call("run", write({key: "0x" + "F" * 5000})).complaint, "problem.toml", key)


# --- mesh files ---


def mesh_file(
    path, x=(0.0, 2.0), y=(-0.3, 0.0), cells=(10, 2), names=("left", "right", "bottom", "top"), lift=None, twice=False
):
    """The built-in rectangle as a Gmsh file; ``lift`` moves its upper side, ``twice`` doubles its cells."""
    mesh = rectangle(x, y, cells)
    listed = np.tile(mesh.cells, (2 if twice else 1, 1))
    points = np.column_stack([mesh.points, np.zeros(len(mesh.points))])
    if lift is not None:
        upper = points[:, 1] == y[1]
        points[upper, 1] += lift(points[upper, 0])
    sides = ("left", "right", "bottom", "top")
    tags = np.concatenate([np.full(len(mesh.sides[side]), i) for i, side in enumerate(sides, 1)])
    inside = np.full(len(listed), 9)
    meshio.write(
        path,
        meshio.Mesh(
            points,
            [("line", np.concatenate([mesh.sides[side] for side in sides])), ("triangle", listed)],
            cell_data={"gmsh:physical": [tags, inside], "gmsh:geometrical": [tags, inside]},
            field_data={name: np.array([i, 1]) for i, name in enumerate(names, 1)},
        ),
        file_format="gmsh22",
        binary=False,
    )


MESHED = {"body1.mesh": '"body1.msh"'} | dict.fromkeys(f"body1.{key}" for key in ("shape", "x", "y", "cells"))


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("missing.msh", None),
        ("folder.msh", "folder"),
        ("rubbish.msh", bytes(range(256))),
        ("text.msh", b"hello\nworld\n"),
        ("empty.msh", b""),
        ("text.vtu", b"<xml"),
        ("text.unheard", b"hello"),
        ("noending", b"hello"),
        ("line\nbreak.msh", b""),
    ],
    ids=lambda v: str(v)[:12],
)
def test_an_unreadable_mesh_is_refused_by_name(call, write, tmp_path, name, content):
    if content == "folder":
        (tmp_path / name).mkdir()
    elif content is not None:
        (tmp_path / name).write_bytes(content)
    escaped = name.replace("\n", "\\n")
    line = call("run", write(MESHED | {"body1.mesh": f'"{escaped}"'})).complaint
    assert_names(line, "problem.toml", "body1.mesh", name.partition("\n")[0])


@pytest.mark.parametrize(
    ("changes", "fragments"),
    [
        ({"names": ("left", "right", "under", "top")}, ["body1.fixed", '"bottom"', "left, right, under, top"]),
        ({"cells": (20, 2)}, ["non-matching grids", "13", "7"]),
        ({"lift": lambda x: 0.1 * x}, ["contact", "top"]),
        ({"y": (-0.4, -0.1)}, ["do not meet", "y = -0.1"]),
    ],
    ids=["unknown side", "other grid", "slope", "apart"],
)
def test_a_mesh_that_does_not_fit_is_refused_by_name(call, write, tmp_path, changes, fragments):
    mesh_file(tmp_path / "body1.msh", **changes)
    assert_names(call("run", write(MESHED)).complaint, "problem.toml", *fragments)


def test_a_mesh_file_cannot_be_halved_and_that_is_said_before_anything_is_measured(call, write, tmp_path, monkeypatch):
    mesh_file(tmp_path / "body1.msh")
    monkeypatch.setattr("verification.constants._measure", None)
    line = call("constants", write(MESHED), "--refine", "1").complaint
    assert_names(line, "problem.toml", "body1.mesh", "body1.msh", "halved")


@pytest.mark.parametrize(
    ("fault", "says"),
    [
        (lambda lines: [*lines, lines[0]], "listed twice|2 times"),
        (lambda lines: [*lines, [*lines[0][:-1], "12"]], "none of the boundary"),
        (lambda lines: [*lines, lines[-1]], "have the same nodes"),
    ],
    ids=["a line twice", "a line inside", "a cell twice"],
)
@pytest.mark.parametrize("command", ["run", "compare", "constants", "solve"])
def test_a_malformed_mesh_is_refused_by_its_fault(call, write, tmp_path, command, fault, says):
    mesh_file(tmp_path / "body1.msh")
    head, _, rest = (tmp_path / "body1.msh").read_text().partition("$Elements\n")
    _count, *lines = rest.partition("\n$EndElements")[0].splitlines()
    lines = fault([line.split() for line in lines])
    listed = "\n".join(" ".join([str(i), *line[1:]]) for i, line in enumerate(lines, 1))
    (tmp_path / "body1.msh").write_text(f"{head}$Elements\n{len(lines)}\n{listed}\n$EndElements\n")
    line = call(command, write(MESHED)).complaint
    assert_names(line, "problem.toml: body1.mesh", "body1.msh")
    assert re.search(says, line)
    assert "matching" not in line


def test_a_mesh_with_every_cell_twice_is_refused_as_that(call, write, tmp_path):
    """Not for its grid on Gamma_c: no edge would be left on the boundary."""
    mesh_file(tmp_path / "body1.msh", twice=True)
    line = call("run", write(MESHED)).complaint
    assert_names(line, "body1.mesh", "have the same nodes: each cell is needed once")
    assert "matching" not in line


@pytest.mark.parametrize("command", ["run", "compare", "constants", "solve"])
def test_reading_a_mesh_prints_nothing_beside_the_document(call, write, tmp_path, command):
    mesh_file(tmp_path / "body1.msh")
    answer = call(command, write(MESHED), "--json")
    assert (answer.status, answer.err) == (0, "")
    assert answer.document
