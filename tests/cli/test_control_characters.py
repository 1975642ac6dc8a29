"""No character of control leaves the command, wherever it came in; no cell of a table is a formula."""

import contextlib
import csv
import io
import json
import os
import re
import tomllib
import unicodedata
import xml.etree.ElementTree as ET
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, example, given, settings
from hypothesis import strategies as st
from problem_list import SMALL, edited
from strategies import AT_NIGHT, fewer

import verification as vf
from ndtheory.texts import CONTROL
from verification.cli import main
from verification.figures.style import new_figure, save
from verification.interface.files import write_interface
from verification.problem.writing import string
from verification.spreadsheet import as_csv

#: An example here costs some forty commands: those that hypothesis draws to find a shorter one would cost minutes.
WITHOUT_SHRINKING = (Phase.explicit, Phase.reuse, Phase.generate)

#: So many of them.
DEAR = 30 if AT_NIGHT else 2

#: One of each kind: C0, DEL, C1, separators of lines, overrides of the direction, what XML excludes.
KINDS = "\x00\x07\x08\t\n\r\x1b\x7f\x85\x9b\u2028\u2029\u202a\u202e\u2066\u2069\ufffe\uffff"

controls = st.sampled_from(KINDS)
#: Texts with a character of control at least, as a file of TOML can hold them.
hostile = st.builds(
    "{}{}{}".format, st.text("ab=[,'\" ", max_size=3), controls, st.text("ab]2J;-@+" + KINDS, max_size=5)
)
#: What may be part of the name of a file.
names = hostile.map(lambda text: re.sub("[\0/]", "_", text))


BIDI = ("LRE", "RLE", "PDF", "LRO", "RLO", "LRI", "RLI", "FSI", "PDI")


def test_the_characters_that_no_text_may_have_are_those_of_control_and_their_like():
    by_day = chain(range(0x3100), range(0xD700, 0xE100), range(0xFE00, 0x10100), range(0xE0000, 0xE0080))
    for c in map(chr, range(0x110000) if AT_NIGHT else by_day):
        control = unicodedata.category(c) in ("Cc", "Cs", "Zl", "Zp") or unicodedata.bidirectional(c) in BIDI
        assert (CONTROL.search(c) is not None) == (control or c in "\ufffe\uffff"), ascii(c)


@contextlib.contextmanager
def inside(folder):
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def assert_clean(text):
    """No character of control but the ends of lines."""
    assert CONTROL.search(text.replace("\n", "")) is None, ascii(text)


def called(*arguments):
    """The status of a call, once it is sure that it has said and written nothing of control."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = main([str(argument) for argument in arguments])
    assert_clean(out.getvalue())
    assert_clean(err.getvalue())
    assert "Traceback" not in err.getvalue()
    if status == 2:
        assert err.getvalue().count("\n") == 1, err.getvalue()
    if out.getvalue() and "--json" in arguments:
        json.loads(out.getvalue())
    return status


def assert_clean_files(folder):
    """What was written: texts, and SVG that is XML."""
    for path in Path(folder).rglob("*"):
        if path.suffix in (".json", ".csv", ".toml", ".html", ".svg", ".log"):
            assert_clean(path.read_text("utf-8"))
        if path.suffix == ".svg":
            ET.parse(path)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with a problem, a sweep of it, a log, an interface file and a certificate that is none."""
    folder = tmp_path_factory.mktemp("hostile")
    (folder / "small.toml").write_text(SMALL, encoding="utf-8")
    (folder / "grid.toml").write_text('problem = "small.toml"\n[grid]\ntheta = [0.5]\n', encoding="utf-8")
    write_interface(vf.build(folder / "small.toml"), folder / "small.npz")
    return folder


#: Where a text of somebody else comes in, and what is called then; "small.toml" is a problem with that text in it.
KEYS = ("title", "units.length", "units.stress", "contact.law", "body1.shape", "body1.mesh", "iteration.relaxation")


@pytest.mark.parametrize("key", KEYS)
@fewer(5)
@given(text=hostile)
def test_a_text_of_control_in_a_problem_file_is_refused_in_one_clean_line(place, key, text):
    path = place / "other.toml"
    path.write_text(edited(SMALL, {key: string(text)}), encoding="utf-8")
    assert called("solve", path) == 2
    assert called("solve", place / "small.toml", "--set", f"{key}={string(text)}", "--json") == 2


@fewer(2)
@given(text=hostile)
def test_a_title_of_control_is_named_as_its_escapes(text):
    with pytest.raises(vf.ProblemError, match="needed a text without control characters, this one has '") as error:
        vf.Problem.from_dict({**vf.example("two-bars").to_dict(), "title": text})
    assert "title = " in str(error.value)
    assert str(error.value).isprintable()


@settings(max_examples=DEAR, suppress_health_check=[HealthCheck.function_scoped_fixture], phases=WITHOUT_SHRINKING)
@given(text=hostile, name=names)
def test_no_character_of_control_leaves_a_command_wherever_it_comes_in(place, tmp_path, text, name):
    problem, grid, safe = place / "small.toml", place / "grid.toml", text.replace("\0", "")
    with inside(tmp_path):
        for words in (
            *(["example", text], [text], ["bounds", f"--{text}", "3"], ["verify", text], ["reproduce", text]),
            *(["solve", name], ["run", name], ["sweep", name], ["certify", "--check", name], ["advise", name + ".npz"]),
            *(["solve", problem, "--set", f"{text}=1"], ["solve", problem, "--set", f"title={text}"]),
            *(["run", problem, "--theta", text], ["run", problem, "--relaxation", text]),
            *(["sweep", grid, "--plot", text], ["sweep", grid, "--dask", safe], ["region", problem, "-o", name]),
            *(["advise", "run", "--log", name, "--theta", "0.5"], ["advise", "matrices", "--S1", name, "--S2", name]),
            *(
                ["advise", "run", "--theta", text, "--ratio", text],
                ["bounds", "--m", text],
                ["advise", "moduli", "--young", text, "--poisson", text],
            ),
        ):
            assert called(*words) in (0, 2)
        Path(name).write_text(SMALL, encoding="utf-8")
        Path(f"{name}.log").write_text(f"{text} {text}\n1 0.5\n2 0.25\n3 0.125\n", encoding="utf-8")
        Path(f"{name}.json").write_text(json.dumps({text: [text], "discrete": text}), encoding="utf-8")
        called("advise", "run", "--log", f"{name}.log", "--theta", "0.5")
        assert called("certify", "--check", f"{name}.json") == 2
        with np.load(place / "small.npz") as found:
            np.savez(f"{name}.npz", **dict(found) | {"law": f"{text}."})  # numpy drops zeros at the end
        assert called("advise", f"{name}.npz") == 2


@settings(max_examples=DEAR, suppress_health_check=[HealthCheck.function_scoped_fixture], phases=WITHOUT_SHRINKING)
@given(name=names)
def test_names_of_folders_and_files_are_shown_as_their_escapes(place, tmp_path, name):
    with inside(tmp_path):
        Path(name).mkdir(exist_ok=True)
        problem = Path(name, f"{name}.toml")
        problem.write_text(SMALL, encoding="utf-8")
        assert called("advise", problem) == 0
        grid = place / "grid.toml"
        log = Path(name, f"{name}.log")
        called("sweep", grid, "--jobs", "1", "-o", name, "--log", log, "--plot", "theta,iterations")
        assert_clean_files(name)


def test_a_figure_of_texts_of_control_is_xml(tmp_path):
    figure = new_figure(3, 2)
    ax = figure.subplots()
    for character in KINDS:
        ax.plot([1, 2], label=f"a{character}")
    ax.set(title=f"E{KINDS}", xlabel=f"x [{KINDS}m]")
    ax.legend()
    save(figure, tmp_path / "figure.svg")
    assert_clean_files(tmp_path)


def test_a_result_with_hostile_but_allowed_labels_is_written_clean(place, tmp_path):
    problem = vf.load(place / "small.toml").with_keys(
        {"title": string("=a,+b;@c</title><script>&"), "units.length": string('=1+1,"@x"'), "units.stress": "'-2+3'"}
    )
    path = tmp_path / "problem.toml"
    path.write_text(problem.to_toml(), encoding="utf-8")
    assert called("run", path, "-o", tmp_path / "out") == 0
    assert_clean_files(tmp_path / "out")
    for table in (tmp_path / "out").glob("*.csv"):
        assert_no_formula(table.read_text("utf-8"))


# --- tables ---

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


def assert_no_formula(text):
    """No cell begins like a formula, whichever of comma and semicolon separates, but numbers do."""
    for separator in ",;":
        for row in csv.reader(io.StringIO(text), delimiter=separator):
            for cell in row:
                begin = cell.lstrip(" \"'") if row[0].startswith("#") else cell.lstrip(" ")
                if begin[:1] and begin[0] in "=+-@\t\r\uff1d\uff0b\uff0d\uff20":
                    assert NUMBER.fullmatch(begin.rstrip(" \"']}")), row


cells = st.one_of(
    st.none(),
    st.integers(-3, 3),
    st.floats(-1, 1),
    st.builds(
        "{}{}".format, st.sampled_from(["=", "+", "-", "@", "\t=", "\r-", " =", "\uff1d", ""]), st.text("a1.e-(=,;\"' ")
    ),
)


@given(rows=st.lists(st.lists(cells, min_size=2, max_size=2), max_size=4), name=st.text("=a,-1;", min_size=1))
def test_no_cell_of_a_table_is_a_formula_and_numbers_stay(rows, name):
    text = as_csv([f"x in {name}"], ["=x", name], rows)
    assert_clean(text)
    first, *rest = text.splitlines()
    assert first.startswith("# ")
    read = list(csv.reader(rest))[1:]
    for row in read:
        for cell in row:
            assert not cell.lstrip().startswith(tuple("=+-@\uff1d")) or NUMBER.fullmatch(cell)
    for row, given_row in zip(read, rows, strict=True):
        for cell, value in zip(row, given_row, strict=True):
            if isinstance(value, (int, float)):
                assert float(cell) == value


@given(st.lists(st.text("=+-@,; 1e.'\"\\ab#[]", max_size=12), min_size=3, max_size=3))
@example(["", "", ";-1,"])  # between semicolons the cell is "-1,"
@example(["", "", ';"-1'])  # a quote that opens a cell may close in another line
def test_lines_above_a_table_have_no_formula_and_stay_toml(texts):
    problem = vf.example("two-bars").to_dict() | {
        "title": texts[0],
        "units": dict(zip(("length", "stress"), texts[1:], strict=True)),
    }
    found = vf.sweep(vf.Problem.from_dict(problem), theta=[0.5])
    text = found.to_csv()
    assert_no_formula(text)
    head = [line.removeprefix("#").removeprefix(" ") for line in text.splitlines() if line.startswith("#")]

    assert vf.Problem.from_dict(tomllib.loads("\n".join(head[1:]))).title == texts[0]
    assert text.splitlines()[len(head)].startswith("theta,")
