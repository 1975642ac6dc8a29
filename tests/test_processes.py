"""What a test starts ends with it, gets nothing of the shell that started the tests, and has no limit of its own."""

import ast
import os
import re
import select
import signal
import subprocess
from pathlib import Path

import pytest
from processes import PATIENCE, ended, environment, running

TESTS = Path(__file__).parent
ROOT = TESTS.parent

#: A process whose child inherits the pipe given by number; both wait for ever.
PARENT = """
import subprocess, sys
child = "import sys; print('ready', flush=True); sys.stdin.read()"
subprocess.run([sys.executable, "-c", child], stdin=0, pass_fds=[int(sys.argv[1])])
"""


def test_a_test_that_fails_leaves_neither_the_process_nor_its_child_behind():
    reader, held = os.pipe()
    stdin, never_written = os.pipe()
    started = []

    def fail():
        with running(PARENT, held, stdin=stdin, pass_fds=[held]) as process:
            started.append(process)
            assert process.stdout.readline() == "ready\n"  # the child's word
            raise AssertionError

    with pytest.raises(AssertionError):
        fail()
    os.close(held)
    assert started[0].returncode == -signal.SIGKILL
    assert select.select([reader], [], [], PATIENCE)[0] == [reader]
    assert os.read(reader, 1) == b""  # nobody holds the other end: the child has gone too
    for end in (reader, stdin, never_written):
        os.close(end)


#: What decides how Python behaves; the last one is none of Python's.
EXPORTED = {
    "PYTHONUNBUFFERED": "1",
    "PYTHONDONTWRITEBYTECODE": "1",
    "PYTHONPATH": "/nowhere",
    "PYTHONHASHSEED": "7",
    "PYTHONOPTIMIZE": "2",
    "PYTHONWARNINGS": "error",
    "LANG": "C.UTF-8",
}


def test_what_a_shell_exports_reaches_neither_the_children_of_tests_nor_what_make_starts(monkeypatch):
    for name, value in EXPORTED.items():
        monkeypatch.setenv(name, value)
    seen = ended("import os; print(*os.environ, sep='\\n')").stdout.split()
    make = ["make", "--no-print-directory", "--eval=show: ; @env", "show"]
    shown = subprocess.run(make, cwd=ROOT, env=dict(os.environ), capture_output=True, text=True, check=True).stdout
    told = re.findall(r"(?m)^(\w+)=", shown)
    assert [sorted(EXPORTED.keys() & names) for names in (seen, told)] == [["LANG"]] * 2


def test_children_of_tests_that_were_started_by_nohup_or_in_the_background_end_by_signals():
    for number in (signal.SIGHUP, signal.SIGINT):
        before = signal.signal(number, signal.SIG_IGN)
        try:
            assert ended(f"import os, time; os.kill(os.getpid(), {int(number)}); time.sleep(9)").returncode == -number
        finally:
            signal.signal(number, before)


def test_continuous_integration_runs_the_tests_in_the_shell_of_a_stranger():
    """The lines of the script that begin the tests, with a command in place of make."""
    lines = (ROOT / ".ci" / "run").read_text("utf-8").splitlines()
    begun = [line for line in lines if "clean" in line]
    script = "set -euo pipefail\n" + "\n".join(begun).replace("make test", "env")
    given = environment(PIP_CERT="a file", PYTHONUNBUFFERED="1", COLUMNS="40", TERM="dumb")
    done = subprocess.run(["bash", "-c", script], env=given, capture_output=True, text=True, check=True)
    told = dict(line.partition("=")[::2] for line in done.stdout.splitlines())
    assert set(told) - {"_"} == {"PATH", "HOME", "LANG", "CI", "PIP_CERT"}
    assert (told["CI"], told["PIP_CERT"]) == ("true", "a file")


def test_no_test_hands_its_own_environment_on():
    starts = {f"subprocess.{name}" for name in ("run", "Popen", "check_output", "check_call")}
    sources = {path: path.read_text("utf-8") for path in TESTS.rglob("*.py")}
    for path, text in sources.items():
        if not any(name in text for name in starts):
            continue
        calls = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call)]
        words = [[keyword.arg for keyword in call.keywords] for call in calls if ast.unparse(call.func) in starts]
        assert all("env" in each or None in each for each in words), path


def limits(text):
    """The numbers that a source gives as ``timeout``."""
    keywords = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.keyword) and node.arg == "timeout"]
    return [keyword.value.value for keyword in keywords if isinstance(keyword.value, ast.Constant)]


def test_no_test_has_a_limit_of_a_few_seconds_of_its_own():
    texts = {path.name: path.read_text("utf-8") for path in TESTS.rglob("*.py")}
    assert {name: limits(text) for name, text in texts.items() if "timeout=" in text and limits(text)} == {}
    assert limits("run(command, timeout=9)") == [9]
