"""A command that the shell does not find by its name says how it is reached."""

import sys

import pytest

from verification.cli import problems
from verification.cli.problems import unreached


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """``installed(folder)``: the command lies in tmp_path/folder, beside `activate`, and was started from there."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path / "elsewhere"))

    def install(folder, started=True, activate=True):
        command = tmp_path / folder / "ndtheory"
        command.parent.mkdir(parents=True, exist_ok=True)
        command.write_text("#!/bin/sh\n", encoding="utf-8")
        command.chmod(0o755)
        if activate:
            (command.parent / "activate").touch()
        if started:
            monkeypatch.setattr(sys, "argv", [str(command), "demo"])
        return command

    return install


def test_the_demo_of_an_environment_that_is_not_activated_ends_by_saying_how_the_command_is_reached(
    call, quick, write, installed, monkeypatch
):
    small = write().read_text("utf-8")
    monkeypatch.setattr(problems, "examples", lambda: {"section6": small})
    installed(".venv/bin")
    answer = call("demo")
    assert answer.status == 0
    assert answer.err.splitlines() == [
        "written: ndtheory-demo",
        "`ndtheory` is not on the PATH of this shell: type .venv/bin/ndtheory for it",
        "or, once in each shell: source .venv/bin/activate",
    ]
    assert call("demo", "--json").err == ""


def test_a_command_that_the_shell_finds_needs_no_word(installed, tmp_path, monkeypatch):
    command = installed(".venv/bin")
    monkeypatch.setenv("PATH", str(command.parent))
    assert unreached() == []
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "ndtheory").symlink_to(command)
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    assert unreached() == []


def test_another_command_of_that_name_on_the_path_is_not_taken_for_it(installed, monkeypatch):
    other = installed("other", started=False)
    installed(".venv/bin")
    monkeypatch.setenv("PATH", str(other.parent))
    assert ".venv/bin/ndtheory" in unreached()[0]


def test_a_command_elsewhere_is_named_in_full_and_no_script_is_named_that_is_not_there(
    installed, tmp_path, monkeypatch
):
    command = installed("a folder", activate=False)
    (tmp_path / "deep").mkdir()
    monkeypatch.chdir(tmp_path / "deep")
    [said] = unreached()
    assert f"type '{command}' for it" in said


@pytest.mark.parametrize("started", ["-c", "/missing/ndtheory", "pytest", ""])
def test_what_was_not_started_by_the_command_needs_no_word(installed, monkeypatch, started):
    installed(".venv/bin")
    monkeypatch.setattr(sys, "argv", [started])
    assert unreached() == []
