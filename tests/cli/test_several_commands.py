"""The commands on a file with more than two bodies: they work, or refuse in one line."""

import pytest

THREE = """
title = "Three plates"
[body1]
shape = "rectangle"
x = [0, 4]
y = [0, 1]
cells = [8, 2]
young = 2e4
poisson = 0.3
fixed = ["bottom"]
[body2]
shape = "rectangle"
x = [0, 4]
y = [1, 2]
cells = [10, 10]
young = 3e4
poisson = 0.3
parts = { west = { side = "left", y = [1.3, 1.7] }, east = { side = "right", y = [1.3, 1.7] } }
fixed = ["west", "east"]
[body3]
shape = "rectangle"
x = [0, 4]
y = [2, 3]
cells = [8, 2]
young = 2e4
poisson = 0.3
prescribed = { top = [0.001, -0.01] }
[[contact]]
bodies = [1, 2]
surface = ["top", "bottom"]
friction = 0.1
radius = 0.5
[[contact]]
bodies = [3, 2]
surface = ["bottom", "top"]
friction = 0.05
radius = 0.5
[iteration]
neumann_bodies = [1, 3]
theta = "auto"
"""


@pytest.fixture
def three(tmp_path):
    (tmp_path / "three.toml").write_text(THREE)
    return str(tmp_path / "three.toml")


@pytest.mark.parametrize(
    ("command", "seen"),
    [
        ("solve", ("E 20000 / 30000 / 20000 MPa", "Neumann bodies: 1, 3", "1 on 2 ", "3 on 2 ", " normal, ")),
        (
            "run",
            ("k = 0.050 to 0.10, non-local, r = 0.5 mm", "converged", "of body 2, Neumann grid: 18 of bodies 1, 3"),
        ),
        ("constants", ("rho_max", "the contacts are tables [[contact]]")),
        (
            "advise",
            (
                "bodies 1, 3: predicted rate",
                "Solvers of bodies 1, 3 read",
                "neumann_bodies = [1, 3]",
                "times the friction",
            ),
        ),
    ],
)
def test_a_command_names_the_bodies_of_each_role(call, three, command, seen):
    found = call(command, three)
    assert found.status == 0, found.err
    words = " ".join(found.out.split())
    for text in seen:
        assert text in words


def test_a_key_of_each_contact_is_not_suggested_as_one_that_can_be_set(call, three):
    known = call("run", three, "--set", "friction=0.3").complaint.partition("known here: ")[2]
    assert {*known.split(", ")} >= {"body1", "body2", "body3", "contact", "iteration"}
    assert "friction" not in known


@pytest.mark.parametrize(
    ("command", "needed"),
    [
        (("certify", "-o", "c.json"), "a certificate is about two bodies"),
        (("certify", "--continuum", "-o", "c.json"), "needed one table [contact], and two bodies"),
        (("explore", "-o", "e.html"), "the page shows two bodies"),
        (("march",), "needed [[step]] tables"),
        (("advise", "--snippets", "preCICE"), "the blocks couple two solvers"),
        (("run", "--set", "contact.friction=0.4"), "contact is a list of tables, which only a file changes"),
        (("run", "--set", "iteration.neumann_bodies=[1]"), "not none of 3 and 2"),
    ],
    ids=" ".join,
)
def test_what_is_for_two_bodies_is_refused_in_one_line(call, three, tmp_path, monkeypatch, command, needed):
    monkeypatch.chdir(tmp_path)
    found = call(command[0], three, *command[1:])
    assert (found.status, found.out, found.err.count("\n")) == (2, "", 1)
    assert needed in found.err
