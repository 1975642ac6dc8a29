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


@pytest.mark.parametrize("path", sorted(TESTS.rglob("*.py")), ids=lambda path: path.name)
def test_one_module_alone_starts_processes_and_says_how_long_they_may_take(path):
    tree = ast.parse(path.read_text("utf-8"))
    imported = {a.name for node in ast.walk(tree) if isinstance(node, ast.Import) for a in node.names}
    imported |= {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    keywords = [node for node in ast.walk(tree) if isinstance(node, ast.keyword)]
    limits = [node for node in keywords if node.arg == "timeout" and isinstance(node.value, ast.Constant)]
    if path.name != "processes.py":
        assert "subprocess" not in imported, "start it by processes.running or processes.ended"
        assert limits == []
