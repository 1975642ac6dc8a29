"""Results in a folder: only our own files, each whole or not at all."""

import errno
import json
import re
import signal
from dataclasses import replace
from pathlib import Path

import pytest
from processes import ended
from small_result import ONE_STEP, problem

import verification as vf
from verification import figures
from verification.output.files import FILES, staged
from verification.output.folder import Folder

FIGURES = {f"{figure}.{ending}" for figure in ("bodies", "residuals") for ending in ("svg", "png")}
DRAWN = {"compare.json", "report.html", "ruler.svg", "ruler.png", "waterfall.svg", "waterfall.png"}
TABLES = {"problem.toml", "contact.csv", "history.csv", "sides.csv", "interface.npz"} | {"body1.vtu", "body2.vtu"}
WRITTEN = {"run": FIGURES | TABLES | {"run.json"}, "comparison": FIGURES | TABLES | DRAWN}
OURS = WRITTEN["comparison"] - {"problem.toml"}  # that of a user stays as it is


@pytest.fixture(scope="module")
def results(comparison):
    return {"run": comparison.run, "comparison": comparison}


def write(folder: Path, kind: str, result) -> None:
    Folder(folder, "compare" if kind == "comparison" else "run").write(result)


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


# --- the folder ---


@pytest.fixture
def quick(monkeypatch):
    """Figures that cost nothing: only their files matter here."""
    monkeypatch.setattr(figures, "draw_bodies", lambda result: "bodies")
    monkeypatch.setattr(figures, "draw_residuals", lambda run, bounds=(): "residuals")
    monkeypatch.setattr(figures, "draw_ruler", lambda found: "ruler")
    monkeypatch.setattr(figures, "draw_waterfall", lambda losses, unit: "waterfall")
    monkeypatch.setattr(
        figures,
        "save",
        lambda figure, path: path.write_bytes(b"<svg><dc:title>ndtheory</dc:title>Software\x00ndtheory</svg>"),
    )


@pytest.mark.parametrize("kind", WRITTEN)
def test_the_documented_files_are_written_and_the_same_again(quick, results, tmp_path, kind):
    write(tmp_path / "a" / "b", kind, results[kind])
    first = contents(tmp_path / "a" / "b")
    assert set(first) == WRITTEN[kind]
    write(tmp_path / "a" / "b", kind, results[kind])
    assert contents(tmp_path / "a" / "b") == first


@pytest.mark.parametrize("kind", WRITTEN)
def test_a_written_document_is_the_result_as_json(quick, results, tmp_path, kind):
    write(tmp_path, kind, results[kind])
    text = (tmp_path / ("run.json" if kind == "run" else "compare.json")).read_text("utf-8")
    assert json.loads(text) == json.loads(results[kind].to_json())


def test_a_comparison_takes_the_place_of_the_run_before_it(quick, results, tmp_path):
    write(tmp_path, "run", results["run"])
    write(tmp_path, "comparison", results["comparison"])
    assert set(contents(tmp_path)) == WRITTEN["run"] | WRITTEN["comparison"]


@pytest.mark.parametrize(
    ("name", "foreign"),
    [
        *((name, b"my own") for name in sorted(OURS)),
        ("report.html", b""),
        ("report.html", b"measured with ndtheory, by hand"),
        ("compare.json", b'{"note": "beside ndtheory"}'),
    ],
)
def test_a_file_of_somebody_else_is_kept_and_nothing_is_written_beside_it(quick, results, tmp_path, name, foreign):
    (tmp_path / name).write_bytes(foreign)
    with pytest.raises(vf.ProblemError) as error:
        write(tmp_path, "comparison", results["comparison"])
    assert name in str(error.value)
    assert "another folder" in error.value.needed
    assert contents(tmp_path) == {name: foreign}


@pytest.mark.parametrize("name", sorted({*OURS, "problem.toml"}))
def test_a_folder_in_the_place_of_a_file_is_refused(quick, results, tmp_path, name):
    (tmp_path / name).mkdir()
    with pytest.raises(vf.ProblemError, match=re.escape(name)):
        write(tmp_path, "comparison", results["comparison"])


def test_other_files_of_the_folder_are_left_alone(quick, results, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "own.svg").write_text("mine")
    write(tmp_path, "comparison", results["comparison"])
    assert (tmp_path / "notes.txt").read_text() == (tmp_path / "own.svg").read_text() == "mine"


@pytest.mark.parametrize("failing", range(4))
@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()], ids=repr)
def test_a_file_is_whole_or_not_there_when_writing_fails(quick, results, tmp_path, monkeypatch, error, failing):
    save, left = figures.save, iter(range(9))

    def fail(figure, path):
        if next(left) == failing:
            path.write_bytes(b"half of a ndtheory figure")
            raise error
        save(figure, path)

    write(tmp_path, "run", results["run"])
    before = contents(tmp_path)
    monkeypatch.setattr(figures, "save", fail)
    with pytest.raises((type(error), vf.ProblemError)):
        write(tmp_path, "run", vf.run(problem(iteration=ONE_STEP)))
    assert contents(tmp_path) == before


def test_a_figure_that_files_do_not_list_replaces_nothing(quick, results, tmp_path, monkeypatch):
    (tmp_path / "bodies.svg").write_text("of a user", encoding="utf-8")
    listed = tuple(name for name in FILES["run"] if name != "bodies.svg")
    monkeypatch.setitem(FILES, "run", listed)
    with pytest.raises(RuntimeError, match=r"bodies\.svg: needed in FILES"):
        Folder(tmp_path, "run").write(results["run"])
    assert (tmp_path / "bodies.svg").read_text("utf-8") == "of a user"
    assert [path.name for path in tmp_path.iterdir()] == ["bodies.svg"]


def test_a_report_that_fails_leaves_the_comparison_before_it(quick, comparison, tmp_path, monkeypatch):
    """The document of another theta beside an old report would be two runs in one folder."""
    write(tmp_path, "comparison", comparison)
    before = contents(tmp_path)

    def fail(*arguments):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("verification.output.report.report", fail)
    with pytest.raises(vf.ProblemError, match="No space left"):
        write(tmp_path, "comparison", replace(comparison, run=vf.run(problem(iteration=ONE_STEP))))
    assert contents(tmp_path) == before


def test_ctrl_c_in_a_new_folder_keeps_the_document(quick, results, tmp_path, monkeypatch):
    def interrupt(figure, path):
        path.write_bytes(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr(figures, "save", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write(tmp_path, "run", results["run"])
    assert set(contents(tmp_path)) == {"run.json"}


def test_a_comparison_without_losses_takes_the_waterfall_of_another_away(quick, comparison, tmp_path):
    write(tmp_path, "comparison", comparison)
    write(tmp_path, "comparison", replace(comparison, losses=None, reason={"losses": "made up"}))
    assert set(contents(tmp_path)) == WRITTEN["comparison"] - {"waterfall.svg", "waterfall.png"}


#: Writes two files into a folder, and is killed: before they take their places, or when one of them has.
KILLED = """
import os, signal, sys
from pathlib import Path
from verification.output.files import staged

folder, moves = Path(sys.argv[1]), int(sys.argv[2])
replace = Path.replace

def moved(self, target):
    global moves
    if moves == 0:
        os.kill(os.getpid(), signal.SIGKILL)
    moves -= 1
    return replace(self, target)

Path.replace = moved
with staged(folder, ("a.json", "b.json", "c.json")) as room:
    for name in ("a.json", "b.json"):
        (room / name).write_text("new")
    if moves < 0:
        os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.parametrize("moves", [-1, 0, 1])
def test_a_process_that_is_killed_leaves_files_of_one_run(tmp_path, moves):
    for name in ("a.json", "b.json", "c.json"):
        (tmp_path / name).write_text("old")
    killed = ended(KILLED, tmp_path, moves)
    assert killed.returncode == -signal.SIGKILL
    left = {path.name: path.read_text() for path in tmp_path.iterdir() if path.is_file()}
    assert left == {-1: dict.fromkeys(("a.json", "b.json", "c.json"), "old"), 0: {}, 1: {"a.json": "new"}}[moves]


#: Writes a file into a folder, and gets a signal before it is there.
ENDED = """
import os, sys, time
from pathlib import Path
from verification.output.files import staged

with staged(Path(sys.argv[1])) as room:
    (room / "a.json").write_text("new")
    os.kill(os.getpid(), int(sys.argv[2]))
    time.sleep(60)
"""


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_process_that_is_ended_while_it_writes_leaves_nothing_and_ends_by_the_signal(tmp_path, number):
    assert ended(ENDED, tmp_path, int(number)).returncode == -number
    assert list(tmp_path.iterdir()) == []


def test_files_that_another_process_is_writing_are_left_to_it(tmp_path):
    with staged(tmp_path) as room:
        (room / "a.json").write_text("mine")
        with staged(tmp_path) as other:
            (other / "b.json").write_text("its own")
        assert (room / "a.json").read_text() == "mine"
    assert contents(tmp_path) == {"a.json": b"mine", "b.json": b"its own"}


@pytest.mark.parametrize("place", ["file", "file/folder", "loop"])
def test_what_cannot_be_a_folder_is_refused_with_its_name(tmp_path, place):
    (tmp_path / "file").write_text("a file")
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(vf.ProblemError) as error:
        Folder(tmp_path / place, "run")
    assert str(tmp_path / place) in error.value.file
    assert "folder" in error.value.needed


def test_a_folder_that_cannot_be_written_to_is_refused_at_once(tmp_path, monkeypatch):
    def refuse(dir):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr("tempfile.TemporaryFile", refuse)
    with pytest.raises(vf.ProblemError, match="Permission denied"):
        Folder(tmp_path, "run")


def test_an_edited_problem_is_not_overwritten(tmp_path):
    folder = Folder(tmp_path, "compare")
    assert folder.write_problem("a = 1\n") == tmp_path / "problem.toml"
    folder.write_problem("a = 1\n")
    (tmp_path / "problem.toml").write_text("a = 2\n")
    with pytest.raises(vf.ProblemError, match=r"problem\.toml"):
        folder.write_problem("a = 1\n")
    assert (tmp_path / "problem.toml").read_text() == "a = 2\n"


def test_the_figures_that_are_written_can_be_overwritten(quick, comparison, written, tmp_path):
    for path in written.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    write(tmp_path, "comparison", comparison)
    differ = {name for name, content in contents(tmp_path).items() if content != contents(written)[name]}
    assert differ == {name for name in WRITTEN["comparison"] if name.endswith(("svg", "png", "html"))}
