"""The command as a process of its own: what is imported, signals, pipes that close, streams that are not there."""

import json
import os
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from processes import COMMAND, PATIENCE, SKETCHED, ended, environment, running
from strategies import AT_NIGHT

from verification.output.files import FILES

PROJECT = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text("utf-8"))["project"]

#: Every dependency but the one of the command line; each is imported by the name of its distribution.
HEAVY = [re.match(r"\w+", needed)[0] for needed in PROJECT["dependencies"] if not needed.startswith("click")]

BOUNDS = ["bounds", "--m", "3084", "--M", "153229", "--CR", "1.70", "--CK", "1e-8", "--theta", "1e-4"]


def start(*arguments, code=COMMAND, **streams):
    """The command in a fresh interpreter."""
    return ended(code, *arguments, **streams)


def imported_by(code, *arguments):
    report = "import atexit; atexit.register(lambda: print(*sys.modules, file=sys.stderr)); "
    return set(start(*arguments, code=f"import sys; {report}{code}").stderr.split())


@pytest.mark.parametrize(
    ("code", "arguments"),
    [
        ("import ndtheory", []),
        ("import verification", []),
        (COMMAND, BOUNDS),
        (COMMAND, [*BOUNDS, "--json"]),
        (COMMAND, ["--help"]),
        (COMMAND, ["run", "--help"]),
        (COMMAND, ["example"]),
        (COMMAND, ["bogus"]),
        (COMMAND, ["run", "missing.toml"]),
    ],
    ids=["ndtheory", "verification", "bounds", "bounds --json", "--help", "run --help", "example", "bogus", "missing"],
)
def test_what_needs_no_arrays_starts_without_them(code, arguments):
    modules = imported_by(code, *arguments)
    assert "ndtheory" in modules or "verification" in modules
    light = [] if "missing.toml" not in arguments else ["numpy", "scipy"]  # a file may be missing after they came
    assert [name for name in HEAVY if name in modules and name not in light] == []


def test_a_run_without_a_folder_draws_nothing(write):
    assert "matplotlib" not in imported_by(COMMAND, "run", write())


def test_a_command_is_reached_by_its_entry_point(write):
    found = start("run", write(), "--json")
    assert (found.returncode, found.stderr) == (0, "")
    assert json.loads(found.stdout)["converged"]


@pytest.mark.parametrize("command", ["run", "compare"])
def test_ctrl_c_ends_the_process_with_130_and_a_document(write, command):
    file = write({"iteration.theta": "1e-4", "iteration.max_iterations": "100000"})
    code = """
        import os, signal, sys
        from contextlib import contextmanager
        from verification.cli import main, problems

        @contextmanager
        def progress(title, tolerance):
            yield lambda state: os.kill(os.getpid(), signal.SIGINT) if state.iteration == 4 else None

        problems.progress = progress
        sys.exit(main())
    """
    found = start(command, file, "--json", code=code)
    assert found.returncode == 130
    assert found.stderr == "interrupted after 5 evaluations of T: what was computed is kept\n"
    document = json.loads(found.stdout)
    assert (document if command == "run" else document["run"])["outcome"] == "interrupted"


def unwarned(err):
    """What stderr holds beside the warning that the strains of Section 6 exceed 5 %."""
    strained = "warning: the largest principal strain"
    return "".join(line for line in err.splitlines(keepends=True) if not line.startswith(strained))


@pytest.fixture
def unread():
    """A pipe that nobody reads."""
    reader, writer = os.pipe()
    os.close(reader)
    yield writer
    os.close(writer)


@pytest.mark.parametrize("arguments", [["--help"], BOUNDS, ["run", "FILE"], ["compare", "FILE", "--json"]])
def test_a_reader_that_goes_away_is_neither_a_crash_nor_a_failed_run(write, unread, arguments):
    file = write("without friction")
    code = SKETCHED if "compare" in arguments else COMMAND  # what is sketched is imported first
    found = start(*(file if a == "FILE" else a for a in arguments), code=code, stdout=unread)
    assert unwarned(found.stderr) == ""
    assert found.returncode == 141  # as if ended by SIGPIPE


#: A command that ends in every way in which commands end, when it has written on both streams.
ENDS = """
    import os, sys
    import click
    from verification.cli.console import complain, say
    from verification.cli.main import cli, main

    @cli.command()
    @click.argument("status", type=int)
    def ends(status):
        complain("a note")
        say("the answer")
        with open(os.devnull) as file:  # what a library writes on stdout or stderr must not stand in it
            assert file.fileno() > 2
        raised = {2: click.UsageError("no"), 70: ZeroDivisionError(), 130: KeyboardInterrupt()}
        if status in raised:
            raise raised[status]
        return status

    sys.exit(main())
"""


@pytest.mark.parametrize(
    ("status", "more"),
    [
        *((status, {}) for status in (0, 1, 2, 3, 70, 130)),
        *((status, {"PYTHONUNBUFFERED": "1"}) for status in (0, 2, *[1, 3, 70, 130] * AT_NIGHT)),
    ],
)
def test_a_status_survives_streams_that_are_closed_or_unread_but_an_answer_that_is_lost_is_never_0(
    unread, status, more
):
    ends = lambda **streams: start("ends", status, code=ENDS, env=environment(**more), **streams).returncode
    closed = lambda low: ends(first=lambda: os.closerange(low, 3))
    assert ends(stdout=unread, stderr=unread) == (status or 141)
    if AT_NIGHT or not (status or more):
        assert ends(stderr=unread) == status
        assert closed(2) == status
        assert closed(0) == (status or 2)


@pytest.mark.parametrize("arguments", [["run", "missing.toml"], ["bogus"], ["bounds"], ["run", "FILE", "--theta", "2"]])
def test_bad_input_has_its_status_even_where_nobody_reads_the_line(write, unread, arguments):
    file = write()
    found = start(*(file if a == "FILE" else a for a in arguments), stderr=unread)
    assert (found.returncode, found.stdout) == (2, "")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is always full")
def test_a_full_disk_behind_stdout_is_told_in_one_line(write):
    with open("/dev/full", "w", encoding="utf-8") as full:
        found = start(*BOUNDS, stdout=full)
    assert found.returncode not in (0, 1)
    assert found.stderr.count("\n") == 1
    assert "No space left on device" in found.stderr


@pytest.mark.parametrize(
    ("options", "encoding"),
    [([], "ascii"), (["--json"], "latin-1"), *[([], "latin-1"), (["--json"], "ascii")] * AT_NIGHT],
)
def test_a_title_beyond_the_encoding_of_the_terminal_is_no_crash(write, options, encoding):
    file = write({"title": '"Kontakt \N{GREEK SMALL LETTER MU} \N{CJK UNIFIED IDEOGRAPH-63A5}"'})
    found = start("run", file, *options, env=environment(PYTHONIOENCODING=encoding), text=False)
    assert (found.returncode, found.stderr) == (0, b"")
    assert b"Kontakt" in found.stdout


#: A column outside, a negative one, a row that ends outside, a last row that does.
OUTSIDE = [([0, 10**6], [0, 1, 2]), ([0, -(10**6)], [0, 1, 2]), ([0, 1], [0, 10**6, 2]), ([0, 1], [0, 2, 10**6])]


def test_a_sparse_matrix_that_points_outside_itself_is_refused_and_not_followed(tmp_path):
    """In a process, which would end by a signal."""
    np.savez(tmp_path / "good.npz", np.eye(2))
    bad = [tmp_path / f"bad{i}.npz" for i in range(len(OUTSIDE))]
    for file, (indices, indptr) in zip(bad, OUTSIDE, strict=True):
        np.savez(file, format="csr", shape=(2, 2), data=np.ones(2), indices=np.array(indices), indptr=np.array(indptr))
    each = """
        import sys
        from verification.cli import main
        good, *bad = sys.argv[1:]
        sys.exit({main(["advise", "matrices", "--S1", good, "--S2", file]) for file in bad} != {2})
    """
    found = start(tmp_path / "good.npz", *bad, code=each)
    assert (found.returncode, found.stdout) == (0, "")
    assert [file.name in line for file, line in zip(bad, found.stderr.splitlines(), strict=True)] == [True] * len(bad)


def test_a_folder_that_was_removed_underneath_is_no_crash(write, tmp_path):
    file = write()
    remove = f"import os; os.chdir({str(tmp_path)!r}); os.mkdir('gone'); os.chdir('gone'); os.rmdir('../gone'); "
    # a script has its own folder there; with the current one numpy cannot be imported by Python 3.13
    remove += "import sys; sys.path.remove(''); "
    assert start("run", file, code=remove + COMMAND).returncode == 0
    found = start("demo", code=remove + COMMAND)
    assert found.returncode == 2
    assert found.stderr.count("\n") == 1


def test_two_comparisons_at_once_in_one_folder_leave_whole_files(write, tmp_path):
    command = ["compare", write("without friction"), "-o", tmp_path / "results"]
    with running(SKETCHED, *command) as one, running(SKETCHED, *command) as other:
        said = [process.communicate(timeout=PATIENCE)[1] for process in (one, other)]
    assert [unwarned(err) for err in said] == [f"written: {tmp_path / 'results'}\n"] * 2
    assert (one.returncode, other.returncode) == (0, 0)
    assert json.loads((tmp_path / "results" / "compare.json").read_text("utf-8"))["run"]["converged"]
    assert (tmp_path / "results" / "report.html").read_text("utf-8").rstrip().endswith("</html>")
    assert len(list((tmp_path / "results").iterdir())) == len(
        FILES["compare"]
    )  # with the problem, and without P: one grid
