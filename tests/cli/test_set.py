"""--set and --relaxation: keys of the problem file given with the call, and what the shell completes."""

import re
from pathlib import Path

import pytest

from verification.registry import RULES

#: Commands that take a problem file, and what else they need.
COMMANDS = {"constants": [], "run": [], "compare": [], "solve": [], "advise": [], "region": ["-o", "plane.svg"]}


# --- --set ---


@pytest.mark.parametrize("command", ["compare", "solve", "advise"])
def test_a_key_set_is_a_key_of_the_file(call, write, command):
    edits = {"contact.friction": '"1/3"', "body2.prescribed": '{ top = ["free", -0.02], left = [0.0, "free"] }'}
    edits |= {"body1.cells": "[5, 1]", "body2.cells": "[3, 1]", "contact.interval": "[0.8, 1.6]"}
    typed = ["contact.friction=1/3", 'body2.prescribed.top=["free", -0.02]', 'body2.prescribed.left=[0, "free"]']
    typed += ["body1.cells=[5, 1]", "body2.cells=[3, 1]", "contact.interval=[0.8, 1.6]"]
    words = [word for pair in typed for word in ("--set", pair)]
    expected = call(command, write(edits), "--json")
    found = call(command, write(), *words, "--json")
    assert found.document == expected.document
    assert (found.status, found.err) == (expected.status, expected.err)


def test_a_key_set_reaches_the_plane_of_theta_and_k(call, write, tmp_path):
    line = call("region", write(), "--set", "contact.law=local", "-o", tmp_path / "plane.svg").complaint
    assert 'problem.toml: contact.law = "local": no region is proved for it' in line


def test_a_title_of_several_words_needs_the_quotes_of_the_shell_alone(call, write):
    assert call("run", write(), "--set", "title=Two words").out.startswith("Two words | ")


def test_of_a_key_set_twice_the_last_counts_and_comes_last(call, write):
    words = ["--set", "body2.prescribed.top=[0, -1]", "--set", "body2.prescribed={ top = [0, -0.02] }"]
    once = call("run", write(), *words[2:], "--json")
    assert call("run", write(), *words, "--json").document == once.document
    again = [*words[2:], *words, "--set", "contact.friction=0.3", "--set", "contact.friction=0.2"]
    assert call("run", write(), *again, "--json").document == once.document


def test_other_options_count_more_than_keys_set(call, write):
    words = ["--set", "iteration.theta=0.1", "--set", "iteration.relaxation=newton"]
    found = call("run", write(), *words, "--theta", "0.6", "--relaxation", "constant", "--json").document
    assert found == call("run", write(), "--theta", "0.6", "--json").document
    swapped = call("run", write(), "--set", "iteration.neumann_body=2", "--swap-roles", "--json").document
    assert swapped["neumann_body"] == 1


@pytest.mark.parametrize(
    ("typed", "fragments"),
    [
        ("contact.fricton=0.4", ["problem.toml: contact.fricton: unknown key", "friction"]),
        ("contact.friction=-1", ["problem.toml: contact.friction = -1: needed a number >= 0"]),
        ("contact=1", ["problem.toml: contact = 1: needed a table"]),
        ("body1.cells=[40, 6", ["problem.toml: body1.cells", "[40, 6", "not a TOML value"]),
        ("=1", ["problem.toml", "the name of a key"]),
        ("contact.friction", ["run: --set = contact.friction: needed KEY=VALUE, such as contact.friction=0.4"]),
        ("", ["run: --set = : needed KEY=VALUE"]),
        ("a\x1b[2J", ["--set", "KEY=VALUE"]),
        ("x" * 5000 + "=1", ["problem.toml: xxx", "unknown key"]),
    ],
    ids=lambda v: str(v)[:24],
)
def test_what_cannot_be_set_is_refused_in_one_short_line(call, write, tmp_path, typed, fragments):
    file = write()
    for command, more in COMMANDS.items() if typed == "contact=1" else [("run", [])]:
        line = call(command, file, *more, "--set", typed)
        assert [f for f in fragments if f not in line.complaint] == []
        assert line.complaint.isprintable()
        assert len(line.complaint.replace(str(tmp_path), "")) < 700


def test_a_key_is_set_in_a_file_alone(call):
    line = call("advise", "run", "--theta", "0.1", "--ratio", "1.4", "--set", "contact.friction=0.4").complaint
    assert "--set is an option of ndtheory advise FILE" in line


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_that_takes_a_file_explains_how_a_key_is_set(call, command):
    screen = call(command, "--help").out
    assert "--set KEY=VALUE" in screen
    assert "contact.friction=0.4" in screen
    assert re.search(rf"(?m)^    ndtheory {command} my.toml --set ", screen)


def test_the_file_is_left_as_it_was(call, write):
    file = write()
    before = file.read_bytes()
    assert call("run", file, "--set", "contact.friction=0.3").status == 0
    assert file.read_bytes() == before


# --- --relaxation ---


@pytest.mark.parametrize(("command", "rule"), [*(("run", rule) for rule in RULES), ("compare", "newton")])
def test_a_rule_of_the_call_is_a_rule_of_the_file(call, write, command, rule):
    without = {"contact.friction": "0", "iteration.theta": '"auto"', "body1.cells": "[5, 1]", "body2.cells": "[3, 1]"}
    expected = call(command, write(without | {"iteration.relaxation": f'"{rule}"'}), "--json")
    found = call(command, write(without | {"iteration.relaxation": '"aitken"'}), "--relaxation", rule, "--json")
    assert found.document == expected.document
    assert (found.status, found.err) == (expected.status, expected.err)


def test_momentum_of_the_call_takes_no_notice_of_the_theta_of_the_file(call, write):
    gently = {"contact.friction": "0", "body2.prescribed": "{ top = [0, -0.01] }"}  # strains below 5 %
    answer = call("run", write(gently), "--relaxation", "momentum", "--json")
    assert answer.err == ""
    assert answer.document["warnings"] == []
    set_too = call("run", write(gently), "--relaxation", "momentum", "--set", "iteration.theta=0.7", "--json")
    assert set_too.err == "warning: iteration.theta = 0.7 is not used: momentum takes its step from rho\n"
    line = call("run", write(), "--relaxation", "momentum", "--theta", "0.5").complaint
    assert '--theta = "0.5": needed no theta beside relaxation = "momentum"' in line


@pytest.mark.parametrize("rule", ["", "Newton", "faster"])
def test_an_unknown_rule_is_refused_with_the_known_ones(call, write, rule):
    line = call("run", write(), "--relaxation", rule).complaint
    assert all(known in line for known in RULES)
    assert f"--relaxation = {rule}: needed one of " in line


# --- what the shell completes ---


@pytest.fixture
def complete(call, monkeypatch):
    """``complete("run", "--rel")``: what the shell is told when the tab key is pressed after these words."""

    def told(*words):
        monkeypatch.setenv("_NDTHEORY_COMPLETE", "bash_complete")
        monkeypatch.setenv("COMP_WORDS", " ".join(["ndtheory", *words]))
        monkeypatch.setenv("COMP_CWORD", str(len(words)))
        answer = call()
        assert (answer.status, answer.err) == (0, "")
        return [line.partition(",")[2] for line in answer.out.splitlines()]

    return told


@pytest.mark.parametrize(
    ("shell", "needed"), [("bash", "complete -o nosort -F"), ("zsh", "compdef"), ("fish", "complete --no-files")]
)
def test_a_shell_is_given_its_script(call, monkeypatch, shell, needed):
    monkeypatch.setenv("_NDTHEORY_COMPLETE", f"{shell}_source")
    answer = call()
    assert answer.status == 0
    assert needed in answer.out
    assert f"_NDTHEORY_COMPLETE={shell}_complete" in answer.out


def test_names_that_the_program_knows_are_completed(complete):
    family = [f"section6-{nodes}" for nodes in (60, 190, 666, 2482)]
    others = ["signorini", "stack", "two-bars"]
    assert complete("example", "") == ["chain", "history", "inside", "jaws", "section6", *family, *others]
    assert complete("example", "s") == ["section6", *family, "signorini", "stack"]
    assert complete("run", "my.toml", "--relaxation", "") == list(RULES)
    assert complete("compare", "--relaxation", "an") == ["anderson"]
    assert complete("con") == ["constants"]
    assert complete("run", "--sw") == ["--swap-roles"]
    assert {"--set", "--solver", "--start", "--swap-roles"} == set(complete("run", "--s"))


def test_the_readme_tells_the_line_that_completes(call, monkeypatch):
    readme = (Path(__file__).parents[2] / "README.md").read_text("utf-8")
    variable, value = re.search(r'eval "\$\((\w+)=(\w+) ndtheory\)"', readme).groups()
    monkeypatch.setenv(variable, value)
    assert "_ndtheory_completion()" in call().out
