"""Bad input: status 2, nothing on stdout, one line that names file, key, value received and what is needed."""

import re
from itertools import cycle

import pytest
from complaints import assert_names
from strategies import AT_NIGHT

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
    ("body1.poisson", "0.5", "a number with -1 < nu < 0.5"),
    ("body2.poisson", "-1", "a number with -1 < nu < 0.5"),
    ("contact.friction", "-1e-300", "a number >= 0"),
    ("contact.radius", "-0.1", "a number > 0"),
    ("contact.gap", "-1", "a number >= 0"),
    ("contact.law", '"coulomb"', 'one of "nonlocal", "local"'),
    ("iteration.theta", "1", "a number with 0 < theta < 1"),
    ("iteration.tolerance", "1", "a number with 0 < tolerance < 1"),
    ("iteration.max_iterations", "0", "a whole number >= 1"),
    ("iteration.max_iterations", "12.5", "a whole number >= 1"),
    ("iteration.max_iterations", "true", "a whole number >= 1"),
    ("iteration.neumann_body", "3", "one of 1, 2"),
    ("iteration.neumann_body", "true", "one of 1, 2"),
    ("iteration.relaxation", '"faster"', '"constant"'),
    ("dimension", "3", "one of 1, 2"),
    ("dimension", "2.0", "one of 1, 2"),
    ("title", "1", "a text in quotes"),
    ("units.length", "1", "a text in quotes"),
    ("body1.shape", '"circle"', '"rectangle"'),
    ("body1.shape", '"interval"', '"rectangle"'),
    ("body1.cells", "[0, 2]", "whole number"),
    ("body1.cells", "[true, 2]", "whole number"),
    ("body1.cells", "[10]", "two whole numbers"),
    ("body1.cells", "10", "two whole numbers"),
    ("body1.cells", "[1000000, 1000000]", "at most"),
    ("body1.x", "[2.0, 0.0]", "a < b"),
    ("body1.x", "[0.0, 1.0, 2.0]", "a < b"),
    ("contact.interval", "[1.6, 0.4]", "a < b"),
    ("body1.fixed", '["bottum"]', "left, right, bottom, top"),
    ("body1.fixed", '["bottom", "bottom"]', "once"),
    ("body1.fixed", '"bottom"', "a list of side names"),
    ("body2.prescribed", '["top"]', "a table"),
    ("body2.prescribed", "{ middle = [0, 0] }", "left, right, bottom, top"),
    ("body2.prescribed", "{ top = -0.015 }", "two numbers, along x and y"),
    ("body2.prescribed", '{ top = ["fixed", -0.015] }', '"free"'),
    ("body1.prescribed", "{ bottom = [0.0, 0.0] }", "fixed already"),
    ("body1.traction", "{ bottom = [0.0, 1.0] }", "held"),
    ("body1.traction", '{ left = ["free", 1.0] }', "two numbers, along x and y"),
]

BESIDE_SHAPE = ["x", "y", "cells", "young", "poisson", "fixed", "body_force"]

#: What fits key by key and not together: edits, then fragments of the line.
TOGETHER = {
    "a mesh and a shape": ({"body1.mesh": '"a.msh"'}, ["body1.shape", "not both"]),
    "body 1 can move rigidly": ({"body1.fixed": None}, ["body1", "fix or prescribe"]),
    "a body so slender that its stiffness is rounding": (
        {"body1.y": "[-1e7, 0]"},
        ["body1", "lost in rounding", "needed more than 1e-13", "less slender", "ndtheory solve"],
    ),
    "a body that bends in the last digit alone": ({"body2.y": "[0, 1e6]"}, ["body2", "lost in rounding"]),
    "body 2 can slide": (
        {"body2.prescribed": '{ top = ["free", 0.0] }', "iteration.neumann_body": "2"},
        ["body2", "can move rigidly", "1 free motion", "give body 1 the Neumann problem", "iteration.neumann_body = 1"],
    ),
    "nothing but free sides": (
        {"body2.prescribed": '{ top = ["free", "free"] }', "iteration.neumann_body": "2"},
        ["body2", "3 free motions", "fix or prescribe"],
    ),
    "both bodies can slide": (
        {
            "body1.fixed": None,
            "body1.prescribed": '{ bottom = ["free", 0.0] }',
            "body2.prescribed": '{ top = ["free", 0.0] }',
        },
        ["body2", "body1 and body2 can move rigidly together", "fix or prescribe"],
    ),
    "a modulus beyond the doubles": (
        {"body1.young": "1e400"},
        ["young = 1E+400", "> 0, of a size between 1e-30 and 1e+30"],
    ),
    "a modulus below the doubles": ({"body1.young": '"1/1e400"'}, ["a size between 1e-30 and 1e+30"]),
    "a part along both axes": (
        {"body2.parts": '{ a = { side = "bottom", x = [0.4, 1.0], y = [0.0, 1.0] } }'},
        ["body2.parts.a", "along x or along y, received both"],
    ),
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
    "drawn into each other": ({"body2.y": "[-0.1, 0.3]"}, ["body2.y", "the bodies overlap", "y = -0.1", "5 %", "0.3"]),
    "the upper body first": ({"body1.y": "[0.3, 0.6]"}, ["body2.y", "the bodies overlap", "y = 0.6", "y = 0"]),
    "apart along x": ({"body2.x": "[3.0, 4.2]"}, ["body2.x", "do not meet", "0 to 2", "3 to 4.2"]),
    "an interval outside the overlap": ({"contact.interval": "[0.2, 1.6]"}, ["contact.interval", "[0.4, 1.6]"]),
    "an interval that ends between nodes": (
        {"contact.interval": "[0.5, 1.5]"},
        ["contact.interval", "begin and end at nodes", "0.4, 0.6, 1.4, 1.6"],
    ),
    "an interval with one node": ({"contact.interval": "[0.55, 0.65]"}, ["contact.interval", "at nodes"]),
    "an interval without a node": ({"contact.interval": "[0.45, 0.55]"}, ["contact.interval", "at nodes", "0.4, 0.6"]),
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
    "a bar that flies": ({"body1.fixed": None}, ["body1", "nothing is left to iterate", "ndtheory solve"]),
    "bars in each other": ({"body2.x": "[0.9, 2.0]"}, ["body2.x", "the bodies overlap", "x = 1", "x = 0.9"]),
}

#: What is no problem file at all: bytes, then fragments.
CONTENTS = {
    "an empty file": (b"", ["empty", "ndtheory example"]),
    "comments alone": (b"# nothing\n", ["body1", "missing"]),
    "malformed TOML": (b"[body1\nx = 1", ["not TOML", "line 1"]),
    "a table opened twice": (b"[norm]\nlength = 1\n[norm]\n", ["not TOML", "norm", "line 3"]),
    "binary rubbish": (bytes(range(256)) * 8, ["UTF-8"]),
    "half a letter of UTF-16": ("title = 'a'".encode("utf-16")[:-1], ["UTF-8"]),
    "Latin-1": ("title = 'Münze'".encode("latin-1"), ["UTF-8"]),
    "a null byte": (b"title = 'a'\n\0", ["not TOML"]),
    "brackets without end": (b"a = " + b"[" * 100_000, ["not TOML"]),
    "a number of 9999 digits": (b"a = " + b"9" * 9999, ["line 1", "too many digits", "up to 1e+30"]),
    "an exponent of 20 digits": (b"a = 1\nb = 1e" + b"9" * 20, ["line 2", "too many digits"]),
}


def each_value_and_each_key(keys, *whole):
    """Every value for some of the keys, three kinds of them for the others."""
    few = ["true", "nan", '"x"']
    return [(key, needed, value) for key, needed in keys.items() for value in (NO_NUMBERS if key in whole else few)]


@pytest.mark.parametrize(("key", "needed", "value"), each_value_and_each_key(NUMBERS, "body1.young", "iteration.theta"))
def test_what_is_no_number_is_refused_where_a_number_is_needed(call, write, key, needed, value):
    shown = [] if key == "iteration.theta" and value in ("{}", "[]") else [value]
    assert_names(call("run", write({key: value})).complaint, "problem.toml", f"{key} = ", *shown, f"needed {needed}")


@pytest.mark.parametrize(("key", "needed", "value"), each_value_and_each_key(PAIRS, "body1.x"))
def test_what_is_no_number_is_refused_within_a_pair(call, write, key, needed, value):
    assert_names(call("run", write({key: f"[0.4, {value}]"})).complaint, "problem.toml", f"{key} = ", value, needed)


@pytest.mark.parametrize(("key", "value", "needed"), VALUES, ids=lambda v: str(v)[:40])
def test_a_value_that_does_not_fit_is_refused_by_name(call, write, key, value, needed):
    received = re.findall(r'"[^"]*"|[\w.-]+', value)[0 if value.startswith("{") else -1]
    assert_names(call("run", write({key: value})).complaint, "problem.toml", key, received, needed)


@pytest.mark.parametrize(
    ("table", "value"),
    [
        *[("contact", value) for value in ("3", "[]", '"x"', "[{x = 1}]", "true")],
        *[("units", "3"), ("body1", "[]"), ("body2", '"x"'), ("iteration", "[{x = 1}]"), ("norm", "true")],
    ],
)
def test_a_table_that_is_none_is_refused_by_name(call, write, table, value):
    file = write({table: value})
    file.write_text(file.read_text("utf-8").replace(f"[{table}]", "[elsewhere]"), encoding="utf-8")
    named = (f"{table} = {value}", "a table")
    if table == "contact" and "{" in value:  # a table of two bodies
        named = ("contact[1].bodies", "missing")
    assert_names(call("run", file).complaint, "problem.toml", *named)


@pytest.mark.parametrize(
    ("command", "edits", "fragments"),
    [(command, *case) for command, case in zip(cycle(["run", "compare", "constants"]), TOGETHER.values())],
    ids=TOGETHER,
)
def test_what_does_not_fit_together_is_refused_by_name(call, write, command, edits, fragments):
    assert_names(call(command, write(edits)).complaint, "problem.toml", *fragments)


@pytest.mark.parametrize(("edits", "fragments"), BARS.values(), ids=BARS)
def test_bars_are_refused_what_only_plane_bodies_have(call, write, edits, fragments):
    file = write(edits, "bars.toml", examples()["two-bars"])
    assert_names(call("run", file).complaint, "bars.toml", *fragments)


@pytest.mark.parametrize(
    ("key", "guess"),
    [
        ("body2.presribed", "prescribed"),
        ("iteration.Theta", "theta"),
        ("units.time", "stress"),
        ("mesh.cells", "norm"),
        ("contact.mu", "friction"),
    ],
)
def test_an_unknown_key_or_table_is_refused_with_the_known_ones(call, write, key, guess):
    line = call("run", write({key: "1"})).complaint
    assert_names(line, "problem.toml", key.removesuffix(".cells"), "unknown", guess)


@pytest.mark.parametrize("key", ["body1.young", "body2.cells"])
def test_a_missing_key_is_named(call, write, key):
    assert_names(call("run", write({key: None})).complaint, "problem.toml", key, "missing")


@pytest.mark.parametrize(("content", "fragments"), CONTENTS.values(), ids=CONTENTS)
def test_what_is_no_problem_file_is_refused(call, tmp_path, content, fragments):
    file = tmp_path / "problem.toml"
    file.write_bytes(content)
    assert_names(call("run", file).complaint, "problem.toml", *fragments)


@pytest.mark.parametrize(
    ("command", "name", "needed"),
    [
        ("run", "missing.toml", "no such file"),
        ("run", "missing/problem.toml", "no such file"),
        ("compare", "folder", "folder"),
        ("constants", "problem.toml/inside", "directory"),
        ("solve", "loop", "symbolic links"),
        ("run", "n" * 300, "too long"),
        ("run", "\N{GREEK SMALL LETTER RHO}.toml", "no such file"),
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


def test_a_body_that_can_move_is_named_with_the_problem_that_it_cannot_have(call, write):
    slides = {"body2.prescribed": '{ top = ["free", -0.015] }'}
    path = write(slides | {"iteration.neumann_body": "2"})
    named = ("problem.toml: body2", "can move rigidly", "the Neumann problem of step I", "is singular")
    for command in ("run", "constants", "compare"):
        assert_names(call(command, path).complaint, *named)
    assert call("run", path, "--swap-roles", "--json").document["converged"]
    path = write(slides)
    assert call("run", path, "--json").document["converged"]
    assert_names(call("run", path, "--swap-roles").complaint, *named)


def test_a_third_body_is_no_misspelling_of_the_second(call, write):
    line = call("run", write({"body3.young": "1"})).complaint
    assert_names(line, "problem.toml: contact", "needed tables [[contact]]", "more than two bodies")
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


@pytest.mark.parametrize("command", ["compare", "advise"])
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


# --- numbers that a file may hold and arithmetic may not ---


SIZES = ["1e300", "1e-300", *["1e150", "1e-150"] * AT_NIGHT]


@pytest.mark.parametrize("value", SIZES)
@pytest.mark.parametrize(
    "key", ["body1.young", "body2.young", "contact.friction", "contact.radius", "contact.gap", "norm.length"]
)
def test_no_size_of_a_number_crashes_a_command(call, write, key, value):
    for command in ("solve", "compare", *["constants", "run"] * AT_NIGHT):
        answer = call(command, write({key: value}), "--json")
        assert "Traceback" not in answer.err
        if answer.status == 2:
            assert_names(answer.complaint, "problem.toml", key)
        else:
            assert answer.document


@pytest.mark.parametrize("value", SIZES)
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
