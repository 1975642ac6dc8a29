"""The four commands of `advise`: which words name one, what each takes, and where an option that moved is found."""

import shutil

import click
import numpy as np
import pytest
from advice_calls import GOOD, saved
from click.shell_completion import ShellComplete
from complaints import assert_names

from verification.cli.main import cli


def test_the_group_has_its_forms_and_the_default_is_one_of_them():
    group = cli.commands["advise"]
    assert isinstance(group, click.Group)
    assert list(group.forms()) == ["advise FILE", "advise matrices", "advise run", "advise moduli", "advise vectors"]
    for form in group.forms().values():  # and at most ten options that may be given or not, beside the kind
        options = [p for p in form.params if isinstance(p, click.Option) and not p.required and p.name != "as_json"]
        assert 0 < len(options) <= 10 + 3 * any(p.name == "kind" for p in options)
        assert all(p.help for p in options)


def test_the_help_of_advise_lists_its_commands_and_the_options_of_a_file(call):
    screen = call("advise", "--help").out
    assert screen.startswith("Usage: ndtheory advise [OPTIONS] FILE\n   or: ndtheory advise COMMAND [OPTIONS]\n")
    options, listed = screen.partition("Options:\n")[2].split("Commands:\n")
    assert all(f"  {option}" in options for option in ("--set", "--swap-roles", "--tied", "--snippets", "--json"))
    assert [line.split()[0] for line in listed.splitlines()] == ["matrices", "run", "moduli", "vectors"]
    assert "--S1" not in screen
    assert "./run" in screen


@pytest.mark.parametrize(
    ("name", "unit"), [("", "no unit"), ("matrices", "unit"), ("run", "no unit"), ("moduli", "MPa")]
)
def test_the_help_of_each_form_names_its_units(call, name, unit):
    assert unit in " ".join(call("advise", *name.split(), "--help").out.split())


@pytest.mark.parametrize("words", ["--tied --set contact.friction=0.1 FILE", "--tied FILE --set contact.friction=0.1"])
def test_options_stand_before_or_after_the_file(call, write, words):
    file = str(write())
    expected = call("advise", file, "--set", "contact.friction=0.1", "--tied", "--json").document
    assert expected["tied"] is True
    assert call("advise", "--json", *words.replace("FILE", file).split()).document == expected


def test_options_may_stand_before_the_name_of_a_command(call):
    expected = call("advise", "run", "--theta", "0.1", "--ratio", "1.4", "--json").document
    assert call("advise", "--json", "run", "--theta", "0.1", "--ratio", "1.4").document == expected


@pytest.mark.parametrize("name", ["run", "matrices", "moduli"])
def test_a_file_with_the_name_of_a_command_is_given_by_its_path(call, write, tmp_path, monkeypatch, name):
    shutil.copy(write(), tmp_path / name)
    monkeypatch.chdir(tmp_path)
    assert call("advise", f"./{name}", "--json").document["roles"]
    needed = {"run": "neither --log nor --ratio", "moduli": "no material"}.get(name, "Missing option")
    assert needed in call("advise", name).complaint
    assert call("advise", "--set", "contact.friction=0.1", f"./{name}").status == 0


def test_a_value_that_names_a_command_is_a_value(call, write):
    assert call("advise", "--set", "title=run", write(), "--json").document["problem"]["title"] == "run"


@pytest.mark.parametrize(
    ("words", "named"),
    [
        ("--S1 a.npz --S2 b.npz", "advise matrices"),
        ("--S2 b.npz --friction 0.2", "advise matrices"),
        ("--log a.log --theta 0.3", "advise run"),
        ("--theta 0.1 --ratio 1.4", "advise run"),
        ("--tied --theta 0.1 --ratio 1.4", "advise run"),
        ("--ratio=1.4 --theta=0.1", "advise run"),
        ("--young 7e4,2e4 --poisson 0.3,0.3", "advise moduli"),
        ("my.toml --shape mirror-1", "advise moduli"),
        ("--friction --log a.log --theta 0.3", "advise matrices and ndtheory advise run"),
        ("run --S1 a.npz", "advise matrices"),
        ("matrices --log a.log", "advise run"),
        ("moduli --set contact.friction=0", "advise FILE"),
    ],
)
def test_an_option_of_another_form_is_refused_with_the_name_of_that_form(call, words, named):
    complaint = call("advise", *words.split()).complaint
    assert f"is an option of ndtheory {named}" in complaint
    assert len(complaint) < 120


def test_an_option_of_no_form_is_answered_with_the_nearest(call):
    assert_names(call("advise", "run", "--thet", "0.1").complaint, "--thet", "--theta")
    assert_names(call("advise", "--bogus").complaint, "No such option", "--bogus")


def test_advise_without_a_file_says_what_it_takes(call):
    for words in ((), ("--tied",)):
        needed = "needed one FILE, or one of the commands matrices, run, moduli, vectors first"
        assert f"received nothing: {needed}" in call("advise", *words).complaint
    complaint = call("advise", "iterates", "X.npy", "TX.npy").complaint
    assert_names(complaint, "received iterates X.npy TX.npy: needed one FILE, or one of the commands matrices,")


def test_a_misspelt_command_of_advise_is_no_missing_file(call, write, tmp_path, monkeypatch):
    assert_names(call("advise", "matrics").complaint, "no such file", "did you mean 'matrices'?")
    assert "did you mean" not in call("advise", "matrices.toml").complaint
    shutil.copy(write(), tmp_path / "matrix")
    monkeypatch.chdir(tmp_path)
    assert call("advise", "matrix").status == 0


def test_exchanged_roles_are_listed_first_and_the_next_line_is_about_the_file(call, write):
    file = write()
    plain, swapped = (call("advise", file, *words, "--json").document for words in ((), ("--swap-roles",)))
    assert swapped["roles"] == plain["roles"][::-1]
    assert swapped["neumann_body"] == plain["neumann_body"] == 1
    other = write("wrong roles", "other.toml")
    for words in ((), ("--swap-roles",)):
        assert "--swap-roles" not in call("advise", file, *words).out.splitlines()[-1]
        assert "--swap-roles" in call("advise", other, *words).out.splitlines()[-1]


def test_an_interface_file_has_no_keys_and_no_roles_to_change(call, tmp_path):
    path = saved(tmp_path, "interface", GOOD, np.savez)
    for words in (("--set", "contact.friction=0"), ("--swap-roles",)):
        assert f"{words[0]} with {path}: it changes a problem file" in call("advise", path, *words).complaint


@pytest.mark.parametrize(
    ("words", "begun", "expected"),
    [
        (["advise"], "m", ["matrices", "moduli"]),
        (["advise"], "my", []),
        (["advise"], "--sw", ["--swap-roles"]),
        (["advise", "run"], "--th", ["--theta"]),
        (["advise", "matrices"], "--S", ["--S1", "--S2"]),
        (["advise", "my.toml", "--snippets"], "pre", ["preCICE"]),
    ],
)
def test_the_shell_completes_commands_options_and_their_values(words, begun, expected):
    found = ShellComplete(cli, {}, "ndtheory", "_NDTHEORY_COMPLETE").get_completions(words, begun)
    plain = [item.value for item in found if item.type == "plain"]
    assert [value.casefold() for value in plain] == [value.casefold() for value in expected]
    files = [item for item in found if item.type == "file"]
    assert bool(files) == (words == ["advise"] and not begun.startswith("-"))
