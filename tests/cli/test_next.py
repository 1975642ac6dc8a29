"""The command that a screen suggests next names the problem that was typed."""

import shlex

import pytest

import verification as vf
from ndtheory.statements import statements

SMALL = {"body1.cells": "[10, 2]", "body2.cells": "[6, 2]"}
SETS = ("--set", "contact.friction=0.3", "--set", "body1.y=[-0.4, 0]", "--set", 'title="a b"')


def suggested(answer):
    last = answer.out.splitlines()[-1]
    assert last.startswith("Next: ndtheory ")
    return shlex.split(last.removeprefix("Next: ndtheory "))


@pytest.mark.parametrize("command", ["run", "compare", "advise"])
def test_keys_that_were_set_are_set_again(call, write, command):
    file = write(SMALL)
    asked = call(command, file, *SETS, "--json").document["problem"]
    assert asked["contact"]["friction"] == 0.3
    words = suggested(call(command, file, *SETS))
    answer = call(*words, "--json").document["problem"]
    changed = {"theta", "neumann_body"} if command == "advise" else set()  # which advice is about
    for problem in (asked, answer):
        problem["iteration"] = {key: value for key, value in problem["iteration"].items() if key not in changed}
    assert answer == asked


def test_a_comparison_is_suggested_with_the_theta_the_rule_and_the_roles_of_the_run(call, write):
    options = ("--theta", "0.3", "--relaxation", "aitken", "--swap-roles")
    file = write(SMALL)
    run = call("run", file, *options, "--json").document["problem"]
    words = suggested(call("run", file, *options))
    assert words == ["compare", str(file), *options]
    assert call(*words, "--json").document["problem"] == run


@pytest.mark.parametrize(
    ("given", "about"),
    [
        ("--rho 0.475", ["x-energy"]),
        ("--m 1 --M 2 --CR 1 --CK 0", ["thm-5.9"]),
        ("--m 1 --M 2 --CR 1 --CK 0 --rho 2", ["thm-5.9", "x-energy"]),
    ],
)
def test_the_calculator_leads_to_the_theorems_that_its_constants_enter(call, given, about):
    assert suggested(call("bounds", *given.split())) == ["verify", *about]
    assert {*about} <= statements().keys()


def test_a_history_whose_files_are_written_leads_to_its_page(call, quick, write, tmp_path):
    file = write(text=vf.example("history").to_toml())
    assert suggested(call("march", file)) == ["march", str(file), "-o", "results"]
    written = call("march", file, "-o", tmp_path / "om")
    assert suggested(written) == ["explore", str(file), "-o", "page.html"]


def test_a_law_that_only_the_global_method_has_here_does_not_lead_to_a_run(call, write):
    file, sets = write(SMALL), ("--set", "contact.law=local-contact")
    assert suggested(call("solve", file, *sets))[0] == "run"
    differ = ("--set", "body2.cells=[7, 2]")
    assert suggested(call("solve", file, *sets, *differ))[0] == "solve"
    assert call("run", file, *sets, *differ).status == 2


OBSTACLE = """
[body1]
shape = "rectangle"
x = [0, 2]
y = [-1, 0]
cells = [4, 2]
young = 1
poisson = 0.3
prescribed = { bottom = [0, 0.01] }
[body2]
shape = "rigid"
x = [0, 2]
y = [0, 1]
[contact]
friction = 0.1
law = "local"
"""


def test_a_solution_on_an_obstacle_whose_files_are_written_asks_for_no_other_folder(call, quick, tmp_path):
    file = tmp_path / "obstacle.toml"
    file.write_text(OBSTACLE, "utf-8")
    assert suggested(call("solve", file)) == ["solve", str(file), "-o", "results"]
    assert "Next:" not in call("solve", file, "-o", tmp_path / "om").out


@pytest.mark.parametrize("command", ["constants", "compare"])
def test_exchanged_roles_stay_exchanged_in_the_command_that_is_suggested(call, write, command):
    file = write(SMALL)
    theta = ("--theta", "0.1") if command == "compare" else ()  # with which the run converges
    words = suggested(call(command, file, "--swap-roles", *theta))
    assert words == [{"constants": "compare", "compare": "advise"}[command], str(file), "--swap-roles"]


def test_constants_are_those_of_the_roles(call, write):
    file, other = write(SMALL), write(SMALL | {"iteration.neumann_body": "2"}, "other.toml")
    swapped, asked = (
        call("constants", file, "--swap-roles", "--json").document,
        call("constants", other, "--json").document,
    )
    assert swapped["rho_max"] == asked["rho_max"]
    assert swapped["rho_max"] != call("constants", file, "--json").document["rho_max"]


def test_the_advice_suggests_no_theta_to_a_rule_that_takes_its_own_step(call, write):
    file = write(SMALL | {"contact.friction": "0", "iteration.relaxation": '"momentum"', "iteration.theta": None})
    words = suggested(call("advise", file))
    assert words[:2] == ["run", str(file)]
    assert "--theta" not in words
    assert call(*words).status == 0


def test_what_cannot_be_pasted_from_a_screen_is_not_suggested(call, write):
    file = write(SMALL)
    assert "Next:" not in call("run", file, "--set", "contact.friction=\n0.3").out
    assert "Next:" in call("run", file, "--set", "contact.friction=0.3").out


@pytest.mark.parametrize(("command", "name"), [("run", "problem.toml"), ("compare", "contact.csv")])
def test_a_folder_where_a_result_belongs_is_refused_before_anything_is_computed(call, write, tmp_path, command, name):
    (tmp_path / "results" / name).mkdir(parents=True)
    line = call(command, write(SMALL), "-o", tmp_path / "results").complaint
    assert f"{name}: this is a folder: needed another folder or name (-o)" in line
    assert [path.name for path in (tmp_path / "results").iterdir()] == [name]


@pytest.mark.parametrize("name", ["run", "matrices", "-x.toml"])
def test_a_file_that_is_named_like_a_command_or_an_option_is_suggested_as_a_path(
    call, write, tmp_path, monkeypatch, name
):
    (tmp_path / name).write_bytes(write().read_bytes())
    monkeypatch.chdir(tmp_path)
    *_, last = call("compare", "--bounds", "energy", "--", name).out.splitlines()
    assert last == f"Next: ndtheory advise ./{name}"
    assert call(*last.removeprefix("Next: ndtheory ").split()).status == 0
