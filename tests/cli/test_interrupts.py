"""Ctrl-C in a process of its own, at many moments: one line, status 130, and on stdout one document or nothing."""

import json
import signal
import time
from contextlib import contextmanager

import pytest
from processes import PATIENCE, running
from strategies import AT_NIGHT

#: Says on stderr when the command begins: before that the interpreter answers for what Ctrl-C does.
CALL = """
    import os, sys
    import click
    from verification.cli import main

    begin = click.Group.main

    def here(*args, **options):
        os.write(2, b"here\\n")
        return begin(*args, **options)

    click.Group.main = here
    sys.exit(main())
"""


@contextmanager
def started(*arguments, code=CALL, mark="here"):
    """A process, once it has written a line on stderr; at once where that is None."""
    with running(code, *arguments) as process:
        if mark:
            assert any(line.strip() == mark for line in process.stderr), "it ended before it began"
        yield process


def interrupted(process, after):
    """Status, stdout and the lines of stderr of a process that gets Ctrl-C after some seconds."""
    time.sleep(after)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=PATIENCE)
    return process.returncode, out, [line for line in err.splitlines() if line]


def told(status, out, lines):
    """The document of an interrupted command, None where there is none; the rest of what it must be."""
    document = json.loads(out) if out else None
    if status == 0:  # too late
        assert document is not None
        assert lines == []
    else:
        assert status == 130
        assert len(lines) == 1
        assert lines[0].startswith("interrupted")
        assert document is not None or "before" in lines[0]
    return document


LONG = {"iteration.theta": "1e-4", "iteration.max_iterations": "100000"}


@pytest.mark.parametrize("moment", [0, 0.1, 0.4] if AT_NIGHT else [0.2])
def test_ctrl_c_while_the_command_starts_is_one_line(write, moment):
    with started("run", write(LONG), "--json") as process:
        told(*interrupted(process, moment))


@pytest.mark.parametrize(
    "module",
    [
        "verification.cli.main",
        "numpy",
        *["cvxpy", "click.core", "ndtheory.bounds", "verification.problem.specification", "scipy.linalg"] * AT_NIGHT,
    ],
)
def test_ctrl_c_while_a_module_is_imported_is_one_line(write, module):
    code = f"""
        import os, signal, sys

        class Interrupts:
            def find_spec(self, name, path, target=None):
                if name == {module!r}:
                    os.kill(os.getpid(), signal.SIGINT)

        sys.meta_path.insert(0, Interrupts())
        from verification.cli import main
        sys.exit(main())
    """
    with started("run", write(), "--solver", "cvxpy", "--json", code=code, mark=None) as process:
        out, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, out) == (130, "")
    assert err == "interrupted before anything was computed\n"


@pytest.mark.parametrize(
    ("command", "moment"),
    [
        ("compare", 0.3),
        ("verify", 0.5),
        *[("compare", moment) for moment in (0.8, 1.6, 4)] * AT_NIGHT,
        *[("region", moment) for moment in (0.5, 1, 2, 5)] * AT_NIGHT,
        *[("advise", moment) for moment in (0.1, 0.3, 0.6)] * AT_NIGHT,
        *[("constants", 0.6), ("constants", 2), ("verify", 2), ("solve", 0.3)] * AT_NIGHT,
    ],
)
def test_ctrl_c_in_any_command_leaves_one_document_or_none(write, tmp_path, command, moment):
    options = {
        "region": [write(), "-o", tmp_path / "plane.svg"],
        "constants": [write(), "--refine", "5"],
        "compare": [write(), "-o", tmp_path / "results"],
        "verify": ["5.30", "5.12"],
    }
    with started(command, *options.get(command, [write()]), "--json") as process:
        told(*interrupted(process, moment))


#: Says when the semidefinite bound is begun, which is worked out again and again: however fast the machine is, Ctrl-C
#: comes in time.  What cvxpy does on the way there is left out.
SOLVING = """
    import os, sys
    import click
    from verification.cli import main

    begin = click.Group.main

    def prepared(*args, **options):
        from verification import comparison
        from verification.registry import BOUNDS
        from verification.contact import ContactError

        def none(run):
            raise ContactError("not asked for")

        comparison.by_cvxpy_alone = none
        bound = type(BOUNDS["lmi"])
        evaluate = bound.evaluate

        def endless(*args, **options):
            os.write(2, b"solving\\n")
            while True:
                evaluate(*args, **options)

        bound.evaluate = endless
        return begin(*args, **options)

    click.Group.main = prepared
    sys.exit(main())
"""


@pytest.mark.parametrize("moment", [0, 0.05, 0.15, 0.4, 0.8] if AT_NIGHT else [0.3])
def test_ctrl_c_while_semidefinite_programs_are_solved_is_never_lost(write, moment):
    with started("compare", write(), "--json", code=SOLVING, mark="solving") as process:
        status, out, lines = interrupted(process, moment)
    document = json.loads(out)
    assert status == 130
    warned = [f"warning: {words}" for words in document["run"]["warnings"]]
    assert [line for line in lines if line not in warned] == [
        f"interrupted after the run had ended (converged), {document['run']['evaluations']} evaluations of T: "
        "what was computed is kept"
    ]
    assert (document["lmi"], document["verdicts"]["lmi"]) == (None, "NOT_COMPUTED")
    assert document["reason"]["lmi"] == "interrupted before it was worked out"
    assert document["run"]["converged"]


def test_a_second_ctrl_c_ends_a_solver_that_answers_none_at_once(write):
    """The solver waits as a library computes: other threads run, handlers of signals do not."""
    slow = """
        import ctypes, os, sys, threading
        from verification.cli import main
        from verification.contact.step import ContactStep

        def solve(self, q, bound):
            sys.setswitchinterval(1000)  # the other thread runs once the library lets it
            threading.Timer(0.1, os.write, (2, b"solving\\n")).start()
            mutex, lock = ctypes.create_string_buffer(256), ctypes.CDLL(None).pthread_mutex_lock
            ctypes.CDLL(None).pthread_mutex_init(mutex, None)
            lock(mutex)
            lock(mutex)  # for ever

        ContactStep.solve = solve
        sys.exit(main())
    """
    with started("run", write(), "--json", code=slow, mark="solving") as process:
        process.send_signal(signal.SIGINT)
        time.sleep(1)
        assert process.poll() is None
        while process.poll() is None:
            process.send_signal(signal.SIGINT)
            time.sleep(0.5)
        out, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, out, err) == (130, "", "interrupted twice: ended at once\n")


def test_what_a_library_prints_is_not_in_the_document(call, write, monkeypatch):
    from verification.algorithm import runs

    run = runs.run
    monkeypatch.setattr(runs, "run", lambda *args, **options: (print("python was here"), run(*args, **options))[1])
    answer = call("run", write(), "--json")
    assert answer.document["converged"]
    assert answer.err == "python was here\n"


@pytest.mark.parametrize("module", ["numpy", *["matplotlib", "cvxpy"] * AT_NIGHT])  # cvxpy: Ctrl-C waits for its end
def test_an_import_that_ctrl_c_breaks_is_no_bug(write, tmp_path, module):
    """An extension module may turn Ctrl-C into an error of its own."""
    code = f"""
        import os, signal, sys
        from verification.cli import main

        class Breaks:
            def find_spec(self, name, path, target=None):
                if name == {module!r}:
                    try:
                        os.kill(os.getpid(), signal.SIGINT)
                    except KeyboardInterrupt:
                        raise ImportError("initialization failed") from None

        sys.meta_path.insert(0, Breaks())
        sys.exit(main())
    """
    solver = "cvxpy" if module == "cvxpy" else "auto"
    command = ["run", write(), "--solver", solver, "-o", tmp_path / "results", "--json"]
    with started(*command, code=code, mark=None) as process:
        out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert "Traceback" not in err
    assert err.startswith("interrupted")
    assert err.count("\n") == 1
    assert (json.loads(out)["converged"] if out else module) in (True, module)


def test_constants_keep_the_meshes_that_were_measured(call, write, monkeypatch):
    from verification.interface import pair

    pair_from, built = pair.pair_from, []

    def interrupt(problem, **options):
        built.append(problem)
        if len(built) == 3:
            signal.raise_signal(signal.SIGINT)
        return pair_from(problem)

    monkeypatch.setattr(pair, "pair_from", interrupt)
    answer = call("constants", write(), "--refine", "4", "--json")
    assert answer.status == 130
    assert len(answer.document["levels"]) == 2
    assert answer.document["reason"]["levels"] == "interrupted after 1 of 4 halvings"
    assert answer.err == "interrupted after 1 of 4 halvings: what was computed is shown\n"


def test_region_draws_the_runs_that_were_made(call, quick, write, tmp_path, monkeypatch):
    from verification.sweeps import region as plane
    from verification.sweeps import workers

    monkeypatch.setattr(plane, "THETAS", (0.2, 0.4))
    monkeypatch.setattr(plane, "FRICTIONS", (0.1, 0.3))
    monkeypatch.setattr("verification.semidefinite.bound.LARGEST", 0)  # without the semidefinite bound
    row, rows = workers.row, []

    def interrupt(*args):
        rows.append(args)
        if len(rows) == 3:
            signal.raise_signal(signal.SIGINT)
        return row(*args)

    monkeypatch.setattr(workers, "row", interrupt)
    answer = call("region", write(), "-o", tmp_path / "plane.svg", "--json")
    assert answer.status == 130
    assert len(answer.document["points"]) == 2
    assert answer.document["reason"]["points"] == "interrupted after 2 of 4 runs"
    assert answer.err == "interrupted after 2 of 4 runs: what was computed is drawn\n"
    assert b"<dc:title>ndtheory</dc:title>" in (tmp_path / "plane.svg").read_bytes()
