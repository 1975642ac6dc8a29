"""Each part of a comparison is shown as soon as it is known; what takes long comes last."""

import html
import json
import os
import signal

import pytest
from processes import SKETCHED, ended, on_a_terminal

import verification as vf
from verification import comparison
from verification.cli import main
from verification.contact import ContactError
from verification.semidefinite import lipschitz, losses

#: Says on the same stdout when something slow begins, unbuffered: the order of its lines is what a reader sees.  The
#: process ends where figures begin, so that what was not written by then is never written.
MARKED = """
    import os, sys

    out = os.dup(1)

    def mark(what):
        os.write(out, f"--- {what}\\n".encode())

    class Imports:
        def find_spec(self, name, path, target=None):
            if name in ("numpy", "cvxpy", "matplotlib"):
                mark(name)
            if name == "matplotlib":
                os._exit(0)

    sys.meta_path.insert(0, Imports())
    from verification import comparison
    from verification.semidefinite import lipschitz, losses
    from verification.cli import main

    def marked(module, name):
        compute = getattr(module, name)

        def begun(*args, **options):
            mark(name)
            return compute(*args, **options)

        setattr(module, name, begun)

    for module, name in ((comparison, "run"), (losses, "locate"), (lipschitz, "work_out")):
        marked(module, name)
    sys.exit(main())
"""

#: The screen with what begins in between.
ORDER = [
    "--- numpy",
    "--- run",
    "DOES IT CONVERGE, AND HOW FAST?",
    "DOES ONE STEP CONTRACT?",
    "WHAT HAPPENED",
    "--- cvxpy",
    "  check by cvxpy      ",
    "--- locate",
    "HOW MUCH DOES EACH ESTIMATE LOSE?",
    "--- work_out",
    "WHAT DO SEMIDEFINITE PROGRAMS PROVE OF ONE STEP?",
    "DOES THE RUN AGREE WITH THE BOUND?",
    "Next: ndtheory advise ",
    "--- matplotlib",
]

#: What a comparison says on a terminal that it is doing.
STAGES = ["measuring", "iterating", "linearising", "repeating the run by cvxpy", "searching", "semidefinite bound"]


def test_a_reader_has_each_table_before_what_is_slower_begins(write, tmp_path):
    found = ended(MARKED, "compare", write(), "--full", "-o", tmp_path / "results")
    assert (found.returncode, found.stderr) == (0, "")
    seen = [begin for line in found.stdout.splitlines() for begin in ORDER if line.startswith(begin)]
    assert seen == ORDER


def test_a_document_is_written_last_and_alone(write, capfd, monkeypatch):
    out = os.dup(1)

    def marked(name, compute):
        def begun(*args, **options):
            os.write(out, f"--- {name}\n".encode())
            return compute(*args, **options)

        return begun

    for module, name in ((comparison, "run"), (losses, "locate"), (lipschitz, "work_out")):
        monkeypatch.setattr(module, name, marked(name, getattr(module, name)))
    status = main(["compare", str(write()), "--json"])
    os.close(out)
    marks, begin, document = capfd.readouterr().out.partition("{")
    assert (status, marks) == (0, "--- run\n--- locate\n--- work_out\n")
    assert json.loads(begin + document)["schema"] == "ndtheory.compare/1"


@pytest.mark.parametrize("edits", ["held tangentially", "wrong roles", "apart"], ids=str)
def test_the_parts_make_the_view_of_a_notebook(call, write, edits):
    """A command says on stderr which change may let a run converge, a notebook among the parts."""
    file = write(edits)
    *shown, more, following = call("compare", file).out.splitlines()
    assert (more, following[:6]) == ("All numbers: --full.", "Next: ")
    view = vf.compare(vf.load(file))._repr_html_()
    lines = html.unescape(view.removeprefix("<pre>").removesuffix("</pre>")).splitlines()
    added = [line for line in lines if line not in shown]
    assert [line for line in lines if line not in added] == shown
    assert ("does not contract here; try theta =" in " ".join(added)) == (edits == "wrong roles")
    assert bool(added) == (edits == "wrong roles")


def test_a_listener_hears_what_the_comparison_then_holds(write):
    class Heard(comparison.Listener):
        def __init__(self):
            self.parts = []

        def constants(self, measured, choice):
            self.parts += [measured, choice]

        def bounds(self, results, measured):
            self.parts += [*results, measured]

        def run(self, finished):
            self.parts += [finished.to_dict()]

        def cvxpy(self, reference, why):
            self.parts += [reference, why]

        def losses(self, losses, why):
            self.parts += [losses, why]

        def programs(self, results):
            self.parts += results

    first, again = Heard(), Heard()
    vf.compare(vf.load(write()), listener=first).tell(again)
    assert len(first.parts) == 12
    assert first.parts == again.parts


def interrupt(*args, **options):
    signal.raise_signal(signal.SIGINT)


def fail(*args, **options):
    raise RuntimeError("made up")


def test_ctrl_c_after_the_first_tables_leaves_them_and_says_what_is_missing(call, write, monkeypatch):
    whole = call("compare", write(), "--full").out
    monkeypatch.setattr("verification.semidefinite.losses.locate", interrupt)
    answer = call("compare", write(), "--full")
    assert answer.status == 130
    assert answer.err.startswith("interrupted after the run had ended (converged), ")
    assert answer.err.count("\n") == 1
    before, slow, after = answer.out.partition("\nHOW MUCH DOES EACH ESTIMATE LOSE?\n")
    assert slow
    assert whole.startswith(before)
    assert after.startswith("  losses: interrupted before it was worked out\n")
    assert "\n  lmi: interrupted before it was worked out\n" in after
    assert "interrupted before it was worked out" not in before


@pytest.mark.parametrize(
    ("what", "status", "says"),
    [(interrupt, 130, "interrupted; what was computed is shown above\n"), (fail, 70, "RuntimeError: made up\n")],
    ids=["interrupt", "error"],
)
@pytest.mark.parametrize(
    ("module", "name", "last"),
    [(comparison, "run", "DOES ONE STEP CONTRACT?"), (lipschitz, "work_out", "HOW MUCH DOES EACH ESTIMATE LOSE?")],
    ids=["run", "programs"],
)
def test_what_ends_a_comparison_leaves_the_tables_before_it(
    call, write, monkeypatch, module, name, last, what, status, says
):
    whole = call("compare", write(), "--full").out
    monkeypatch.setattr(module, name, what)
    answer = call("compare", write(), "--full")
    assert answer.status == status
    assert last in answer.out
    if (what, name) == (interrupt, "work_out"):  # the run is known: the rest is told without the bound
        assert "DOES THE RUN AGREE WITH THE BOUND?" in answer.out
        assert answer.err.count("\n") == 1
    elif name == "run":  # the answer, which comes first otherwise, needs it
        first, _, rest = whole.partition("\nDOES IT CONVERGE, AND HOW FAST?\n")
        assert (first + rest[rest.index("\nDOES ONE STEP CONTRACT?") :]).startswith(answer.out)
        assert says in answer.err
    else:
        assert whole.startswith(answer.out)
        assert says in answer.err
    assert (status == 70) == ("Traceback" in answer.err)


def test_a_broken_import_by_ctrl_c_after_the_first_tables_does_not_deny_them(call, write, monkeypatch):
    def broken(*args, **options):
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise ImportError("initialization failed") from None

    monkeypatch.setattr(comparison, "run", broken)
    answer = call("compare", write(), "--full")
    assert (answer.status, answer.err) == (130, "interrupted; what was computed is shown above\n")
    assert "DOES ONE STEP CONTRACT?" in answer.out


@pytest.mark.parametrize(
    "options", [["--theta", "2"], ["--set", "iteration.max_iterations=2000000000"]], ids=["theta", "memory"]
)
def test_bad_input_is_told_before_anything_is_shown(call, write, options):
    assert call("compare", write(), *options).complaint


def test_a_reader_that_goes_away_costs_no_file(write, tmp_path):
    reader, writer = os.pipe()
    os.close(reader)
    found = ended(SKETCHED, "compare", write("without friction"), "-o", tmp_path / "results", stdout=writer)
    os.close(writer)
    strained, written = found.stderr.splitlines()
    assert (found.returncode, written) == (0, f"written: {tmp_path / 'results'}")  # which have the answer
    assert strained.startswith("warning: the largest principal strain is 5.1 %")
    assert (tmp_path / "results" / "report.html").exists()


def test_the_live_line_of_a_terminal_names_what_is_done_and_makes_room_for_each_part(
    call, quick, write, tmp_path, monkeypatch
):
    def none(run):
        raise ContactError("not asked for")

    monkeypatch.setattr(comparison, "by_cvxpy_alone", none)
    command = ["compare", write("without friction"), "-o", tmp_path / "results"]
    expected = call(*command).out.splitlines()
    text = on_a_terminal(*command, code=SKETCHED, columns=200, streams=["stdout", "stderr"])
    lines = [line.split("\r")[-1] for line in text.replace("\r\n", "\n").split("\n")]  # what a line ends as
    found = [text.find(stage) for stage in [*STAGES, "drawing and writing"]]
    assert -1 not in found
    assert found == sorted(found)
    assert [line for line in lines if line in expected and line] == [line for line in expected if line]
