"""The gallery of scripts: enough of them, each short, with its text and its picture.  The build runs them."""

import ast
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

DOCS = Path(__file__).parents[2] / "docs"
SCRIPTS = sorted((DOCS / "scripts").glob("*/*.py"))
TITLE = re.compile(r"(?P<title>[^\n]+)\n(?P<line>=+)\n\n(?P<text>.+)", re.DOTALL)


def faults(name: str, source: str) -> list[str]:
    """What a script has too much of, or lacks."""
    tree = ast.parse(source)
    told = TITLE.fullmatch(ast.get_docstring(tree) or "")
    below = "\n".join(source.splitlines()[tree.body[0].end_lineno :])
    pictures = re.findall(r"^figure\.savefig\((.*)\)$", below, re.MULTILINE)
    checks = {
        "a title, its line and text": told is not None and len(told["title"]) == len(told["line"]),
        "at most three lines of text": told is None or len(told["text"].splitlines()) <= 3,
        "at most 25 lines of code": sum(map(bool, map(str.strip, below.splitlines()))) <= 25,
        "one picture, named as the script": pictures == [f'"{name}.png"'] and below.count("savefig") == 1,
        "an assert": any(isinstance(node, ast.Assert) for node in ast.walk(tree)),
    }
    return [what for what, holds in checks.items() if not holds]


def test_there_are_at_least_24_scripts_with_different_titles():
    titles = [TITLE.match(ast.get_docstring(ast.parse(path.read_text("utf-8"))))["title"] for path in SCRIPTS]
    assert len(SCRIPTS) >= 24
    assert len(set(titles)) == len({path.name for path in SCRIPTS}) == len(SCRIPTS)


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_a_script_is_short_and_has_its_text_and_its_picture(path):
    assert faults(path.stem, path.read_text("utf-8")) == []


def test_the_run_in_five_lines_has_five_lines():
    """Not counted by folding: no line continues another one, and none has two statements."""
    source = (DOCS / "scripts" / "first" / "five_lines.py").read_text("utf-8")
    statements = ast.parse(source).body[1:]
    assert len(statements) == len([line for line in source.rpartition('"""')[2].splitlines() if line]) == 5
    assert len({each.lineno for each in statements}) == 5
    assert max(len(ast.get_source_segment(source, each)) for each in statements) <= 80


GOOD = '"""\nTwo\n===\n\nIt is two.\n"""\n\nfigure = draw(1 + 1)\nassert figure\nfigure.savefig("two.png")\n'


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("===", "=="),
        ("It is two.", "It\nis\nreally\ntwo."),
        ("figure = ", "x = 1\n" * 23 + "figure = "),
        ("two.png", "three.png"),
        ("assert figure", "assured = figure"),
    ],
)
def test_a_script_that_is_too_long_or_lacks_something_is_found(old, new):
    assert faults("two", GOOD) == []
    assert len(faults("two", GOOD.replace(old, new))) == 1


@pytest.fixture
def scripts(site_tools):
    pytest.importorskip("sphinx_gallery", reason="the tools of the site are not installed: make docs")
    sys.path.append(str(DOCS))
    try:
        from builder import scripts
    finally:
        sys.path.remove(str(DOCS))
    return scripts


def test_each_folder_of_scripts_has_its_place_and_its_heading(scripts):
    assert sorted(scripts.SECTIONS) == sorted({path.parent.name for path in SCRIPTS})
    assert all((DOCS / "scripts" / name / "GALLERY_HEADER.txt").exists() for name in scripts.SECTIONS)


def test_the_page_shows_the_picture_that_the_script_has_saved_and_refuses_another(scripts, tmp_path):
    from matplotlib.figure import Figure

    script, target = tmp_path / "two.py", tmp_path / "shown.png"
    script.write_text(GOOD)
    figure = Figure()
    figure.subplots().plot([1, 2], label="curve")
    figure.axes[0].set(xlabel="step", ylabel="force")
    figure.savefig(tmp_path / "three.png")
    variables = {
        "src_file": str(script), "image_path_iterator": iter([target]), "example_globals": {"figure": figure}
    }  # fmt: skip
    with pytest.raises(ValueError, match=r"two\.py: no picture; needed figure\.savefig\('two\.png'\)"):
        scripts.take_figure(("code", "", 1), variables, {"src_dir": str(tmp_path)})
    figure.savefig(tmp_path / "two.png")
    shown = scripts.take_figure(("code", "", 1), variables, {"src_dir": str(tmp_path)})
    assert ":alt: Two; force over step: curve\n" in shown
    assert target.exists()
    assert not (tmp_path / "two.png").exists()
    assert scripts.take_figure(("text", "", 1), variables, {}) == ""


def test_the_look_of_scripts_ends_with_them(scripts):
    import matplotlib as mpl

    before = dict(mpl.rcParams)
    with mpl.rc_context():
        scripts.dress({}, None, "before")
        assert mpl.rcParams["figure.figsize"] == list(scripts.LOOK["figure.figsize"])
        scripts.dress({}, None, "after")
        assert mpl.rcParams["figure.figsize"] == mpl.rcParamsDefault["figure.figsize"]
    assert dict(mpl.rcParams) == before


def test_thumbnails_get_the_titles_of_their_scripts(scripts):
    from docutils import nodes

    image = lambda: nodes.image(uri="a.png", alt="")
    page = nodes.container("", image(), nodes.reference("", "Two bars"), image(), nodes.reference("", "A region"))
    scripts.name_thumbnails(SimpleNamespace(), page, "generated/scripts/index")
    assert [shown["alt"] for shown in page.findall(nodes.image)] == [
        "The picture of the script: Two bars",
        "The picture of the script: A region",
    ]
