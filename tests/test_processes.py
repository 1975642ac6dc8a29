"""What a test starts ends with it, and no test has a limit of its own."""

import ast
import os
import select
import signal
from pathlib import Path

import pytest
from processes import PATIENCE, running

TESTS = Path(__file__).parent

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


def limits(text):
    """The numbers that a source gives as ``timeout``."""
    keywords = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.keyword) and node.arg == "timeout"]
    return [keyword.value.value for keyword in keywords if isinstance(keyword.value, ast.Constant)]


def test_no_test_has_a_limit_of_a_few_seconds_of_its_own():
    texts = {path.name: path.read_text("utf-8") for path in TESTS.rglob("*.py")}
    assert {name: limits(text) for name, text in texts.items() if "timeout" in text and limits(text)} == {}
    assert limits("run(command, timeout=9)") == [9]
