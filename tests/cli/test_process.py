"""The command as a process of its own: what is imported, signals, pipes that close, streams that are not there."""

import json
import os
import re
import tomllib
from pathlib import Path

import pytest
from import_graph import FILES as MODULES
from processes import COMMAND, PATIENCE, SKETCHED, UNDRAWN, ended, environment, running
from strategies import AT_NIGHT

from verification.output.files import FILES

PROJECT = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text("utf-8"))["project"]

#: Every dependency but the one of the command line; each is imported by the name of its distribution.
HEAVY = [re.match(r"\w+", needed)[0] for needed in PROJECT["dependencies"] if not needed.startswith("click")]

BOUNDS = ["bounds", "--m", "3084", "--M", "153229", "--CR", "1.70", "--CK", "1e-8", "--theta", "1e-4"]


def start(*arguments, code=COMMAND, **streams):
    """The command in a fresh interpreter."""
    return ended(code, *arguments, **streams)


#: Calls the command with each line of arguments, and says on stderr which of some modules are there by then.
WATCHED = """
    import sys
    import ndtheory
    import verification
    from verification.cli import main

    heavy, *lines = sys.argv[1:]
    for line in ["--version", *lines]:
        main(line.split())
        print("", line, *(name for name in heavy.split() if name in sys.modules), sep="\\t", file=sys.stderr)
"""


def test_what_needs_no_arrays_starts_without_them_and_a_run_without_a_folder_draws_nothing(write):
    light = [BOUNDS, [*BOUNDS, "--json"], ["--help"], ["run", "--help"], ["example"], ["bogus"]]
    found = start(
        " ".join(HEAVY), *map(" ".join, [*light, ["run", "missing.toml"], ["run", str(write())]]), code=WATCHED
    )
    told = [line[1:].split("\t") for line in found.stderr.splitlines() if line.startswith("\t")]
    *early, (_, *missing), (_, *run) = told
    assert early == [["--version"], *([" ".join(words)] for words in light)]
    assert set(missing) <= {"numpy", "scipy"}  # a file may be missing after they came
    assert "numpy" in run
    assert "matplotlib" not in run


#: Calls the command, and says on stderr which modules are there by then.
COUNTED = """
    import sys
    from verification.cli import main

    assert main(sys.argv[1:]) in (0, 3)
    print("", *sys.modules, sep="\\t", file=sys.stderr)
"""


@pytest.mark.parametrize("arguments", [["compare", "FILE"], ["region", "FILE", "-o", "plane.svg"]])
def test_no_command_about_a_problem_loads_more_than_half_of_the_modules(write, tmp_path, monkeypatch, arguments):
    """These two load the most, of those that draw no folder."""
    monkeypatch.chdir(tmp_path)
    found = start(*(write() if a == "FILE" else a for a in arguments), code=COUNTED)
    (loaded,) = (MODULES.keys() & line.split("\t") for line in found.stderr.splitlines() if line.startswith("\t"))
    assert len(MODULES) / 4 < len(loaded) <= len(MODULES) / 2


def test_ctrl_c_ends_the_process_with_130_and_a_document(write):
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
    found = start("run", file, "--json", code=code)
    assert found.returncode == 130
    assert found.stderr == "interrupted after 5 evaluations of T: what was computed is kept\n"
    assert json.loads(found.stdout)["outcome"] == "interrupted"


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


@pytest.mark.parametrize(
    "arguments", [BOUNDS, *[["--help"], ["run", "FILE"], ["compare", "FILE", "--json"]] * AT_NIGHT]
)
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
        *((status, {}) for status in (0, 1, 2, *[3] * AT_NIGHT, 70, 130)),
        *((status, {"PYTHONUNBUFFERED": "1"}) for status in (0, *[1, 2, 3, 70, 130] * AT_NIGHT)),
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


def test_bad_input_has_its_status_even_where_nobody_reads_the_line(unread):
    found = start(*BOUNDS, "--m", "-1", stderr=unread)
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
    [([], "ascii"), *[(["--json"], "latin-1"), ([], "latin-1"), (["--json"], "ascii")] * AT_NIGHT],
)
def test_a_title_beyond_the_encoding_of_the_terminal_is_no_crash(write, options, encoding):
    file = write({"title": '"Kontakt \N{GREEK SMALL LETTER MU} \N{CJK UNIFIED IDEOGRAPH-63A5}"'})
    found = start("run", file, *options, env=environment(PYTHONIOENCODING=encoding), text=False)
    assert (found.returncode, found.stderr) == (0, b"")
    assert b"Kontakt" in found.stdout


def test_a_folder_that_was_removed_underneath_is_no_crash(call, write, tmp_path, monkeypatch):
    file, gone = write(), tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    assert call("run", file).status == 0
    assert call("demo").complaint


def test_two_runs_at_once_in_one_folder_leave_whole_files(write, tmp_path):
    command = ["run", write("without friction"), "-o", tmp_path / "results"]
    with running(UNDRAWN, *command) as one, running(UNDRAWN, *command) as other:
        said = [process.communicate(timeout=PATIENCE)[1] for process in (one, other)]
    assert [unwarned(err) for err in said] == [f"written: {tmp_path / 'results'}\n"] * 2
    assert (one.returncode, other.returncode) == (0, 0)
    assert json.loads((tmp_path / "results" / "run.json").read_text("utf-8"))["converged"]
    assert (tmp_path / "results" / "body1.vtu").read_bytes().rstrip().endswith(b"</VTKFile>")
    written = {path.name for path in (tmp_path / "results").iterdir()}
    assert written == {*FILES["run"], "problem.toml"} - {"P.npz", "points.csv"}  # one grid, and no points are named
