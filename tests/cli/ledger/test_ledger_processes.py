"""The ledger in processes of its own: the same again, Ctrl-C, a reader that goes away, imports."""

import json
import os
import re
import signal
from contextlib import contextmanager

import pytest
from ledger_calls import CALL, EXACT, READ, SEEN, SOME, WHOLE, start
from processes import environment
from strategies import AT_NIGHT

from verification import ledger

#: One computed exactly, one seen at solutions; at night one searched on random problems, too.
FEW = SOME if AT_NIGHT else ["C5", SEEN]

HEAVY = ["numpy", "scipy", "matplotlib", "cvxpy", "clarabel", "rich", "sympy"]


# --- the same again ---


def test_two_runs_on_the_same_rows_are_equal_to_the_bit():
    ids = [READ, EXACT, SEEN]
    assert ledger.verify(ids) == ledger.verify(ids[::-1])


def test_a_few_rows_alone_in_another_process_are_those_of_the_whole(document):
    """Another order of hashes, and nothing computed before."""
    answer = start("verify", *FEW, "--json", env=environment(PYTHONHASHSEED="7"))
    assert (answer.returncode, answer.stderr) == (0, "")
    expected = [s for s in document["statements"] if s["id"] in FEW]
    assert json.loads(answer.stdout)["statements"] == expected


# --- signals, pipes ---


@pytest.fixture
def told(monkeypatch):
    """``told(action)``: act on what is being done."""

    def arrange(action):
        @contextmanager
        def stages():
            yield action

        monkeypatch.setattr("verification.cli.ledger.stages", stages)

    return arrange


INTERRUPT = """
    import os, signal, sys
    from contextlib import contextmanager
    from verification.cli import ledger, main

    @contextmanager
    def stages():
        yield lambda what, share: os.kill(os.getpid(), signal.SIGINT) if what == "solutions" else None

    ledger.stages = stages
    sys.exit(main())
"""


def test_ctrl_c_in_the_middle_ends_the_process_with_130_and_one_line(tmp_path):
    answer = start("verify", EXACT, SEEN, "-o", str(tmp_path), code=INTERRUPT)
    assert answer.returncode == 130
    assert len(answer.stderr.split("\n")) <= 3
    assert re.fullmatch("interrupted .+", answer.stderr.strip())  # one line, below the ^C of the terminal
    assert [path.suffix for path in tmp_path.iterdir() if path.name not in WHOLE] == []


def test_ctrl_c_in_the_middle_does_not_say_that_nothing_was_computed(call, told):
    def interrupt(what, share):
        if what == "solutions":
            raise KeyboardInterrupt

    told(interrupt)
    answer = call("verify", EXACT, SEEN)
    assert answer.status == 130
    assert re.fullmatch("interrupted .+", answer.err.strip())
    assert "before anything was computed" not in answer.err


@pytest.mark.parametrize("options", [[], ["--json"]], ids=["screen", "json"])
def test_ctrl_c_while_files_are_written_keeps_the_result_that_was_shown(call, kept, tmp_path, monkeypatch, options):
    def interrupt(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr("verification.output.folder.Folder.write", interrupt)
    answer = call("verify", READ, "-o", tmp_path, *options)
    assert answer.status == 130
    assert answer.err == f"interrupted while {tmp_path} was written; the result is shown above\n"
    assert READ in answer.out


@pytest.mark.skipif(not AT_NIGHT, reason="by day another command has the reader that goes away")
@pytest.mark.parametrize("arguments", [[READ], [READ, "--json"], ["--help"]], ids=" ".join)
def test_a_reader_that_goes_away_is_no_crash(arguments):
    reader, writer = os.pipe()
    os.close(reader)
    answer = start("verify", *arguments, stdout=writer)
    os.close(writer)
    assert answer.stderr == ""
    assert answer.returncode == 128 + signal.SIGPIPE


def test_an_unknown_id_needs_no_arrays():
    code = "import atexit, sys; atexit.register(lambda: print(*sys.modules, file=sys.stderr)); " + CALL
    answer = start("verify", "5.99", code=code)
    assert answer.returncode == 2
    assert [name for name in HEAVY if name in answer.stderr.split()] == []
