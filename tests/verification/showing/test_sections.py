"""Results as sections: the same parts on a terminal, in a notebook and in a report, and numbers that are numbers."""

import ast
import html
import re
from dataclasses import replace
from pathlib import Path

import pytest
from kinds import KINDS, OTHERS, problem
from known import continuum_once
from processes import ended

import verification as vf
from ndtheory import Number
from verification import FILLS, registry
from verification.bounds.bound import Bound, BoundResult, Thresholds
from verification.cli import main
from verification.document import Document
from verification.output.report import report
from verification.registry import BOUNDS
from verification.sections import comparison as of_comparison
from verification.show import numbers
from verification.show.layout import lines, text
from verification.show.parts import (
    Block,
    Facts,
    Labelled,
    Next,
    Note,
    Quantity,
    Section,
    Table,
    closing,
    section,
    shown,
    table,
)

ROOT = Path(__file__).parents[3] / "verification"
ALL = KINDS | OTHERS

#: No figure: none is asked for.
NO_FIGURES: dict[str, str] = {}


@pytest.fixture(scope="module")
def results(shared) -> dict[str, Document]:
    with pytest.MonkeyPatch.context() as patch:
        continuum_once(patch, shared)
        return {name: make(problem(10)) for name, make in ALL.items()}


def terminal(sections) -> str:
    return "\n".join(line for line, _ in lines(sections, "terminal"))


def words(text: str) -> str:
    """The words of a text, one space apart."""
    return " ".join(text.split())


def page_words(page: str) -> str:
    """Those of a page of HTML, its raised powers and the lowered index of Gamma_c as they are typed."""
    typed = re.sub(r"<sup>(.*?)</sup>", r"^\1", page.replace("Γ<sub>c</sub>", "Gamma_c"))
    return words(html.unescape(re.sub(r"<[^>]*>", " ", typed)))


def tables(result) -> list[Table]:
    return [part for each in result.sections() for part in each.parts if isinstance(part, Table)]


def texts(each: Section) -> list[str]:
    """The title of a section and the texts of its parts."""
    found = [each.title]
    for part in each.parts:
        match part:
            case Table():
                found += [str(cell) for row in part.rows for cell in row]
            case Facts():
                found += part.facts
            case Labelled() | Note():
                found.append(part.text)
            case Block():
                found += part.lines
    return [words(text) for text in found]


# --- each kind of result ---


def test_every_kind_of_result_that_has_sections_is_among_these(results):
    for result in results.values():
        result.sections()
    known = {kind for kind in registry.sections.registry if kind is not object}
    assert known == {type(result) for result in results.values()}
    assert {kind.__module__.removeprefix("verification.") for kind in known} == set(FILLS["sections"])


def test_a_terminal_and_a_notebook_show_every_title_and_every_number(results):
    for name, result in results.items():
        every, first = result.sections(), registry.screen(result)
        view, screen, full = page_words(result._repr_html_()), words(terminal(first)), words(terminal(every))
        for place, page, given in (("notebook", view, first), ("terminal", full, every)):
            sections = shown(given, place)
            assert sections, name
            missing = [found for each in sections for found in texts(each) if found not in page]
            # a cell that is folded in the last column of a table is not in one piece
            assert [found for found in missing if set(found.split()) - set(page.split())] == [], name
        assert view == " ".join(screen.partition("All numbers: ")[0].partition("Next: ")[0].split()), name


@pytest.mark.parametrize("name", ["Comparison", "Comparison with proofs"])
def test_a_report_shows_every_title_and_every_number(results, name):
    page = report(results[name], NO_FIGURES)
    sections = shown(results[name].sections(), "report")
    headings = re.findall(r"<h2>(.*?)</h2>", page)[:-1]  # the last one is over the glossary
    assert headings == [each.title.capitalize() for each in sections if each.title]
    assert [found for each in sections for found in texts(each)[1:] if found not in page_words(page)] == []
    cells = {html.unescape(cell) for cell in re.findall(r"<td[^>]*>(.*?)</td>", page)}
    found = [cell for each in sections for part in each.parts if isinstance(part, Table) for row in part.rows
             for cell in row if isinstance(cell, Quantity)]  # fmt: skip
    assert len(found) > 30
    assert {str(cell) for cell in found} <= cells


def test_the_ids_of_sections_are_names_and_every_command_to_type_is_for_terminals_alone(results):
    for name, result in results.items():
        sections = result.sections()
        ids = [each.id for each in shown(sections, "terminal")]
        assert len(ids) == len(set(ids)), name
        assert all(part.only == "terminal" for each in sections for part in each.parts if isinstance(part, Next)), name
        assert "Next: " not in result._repr_html_(), name


# --- numbers ---

NUMBER = re.compile(r"(?:[<>]= )?-?\d[\d.]*(?:e[+-]?\d+)?(?: [evg])?|\(.*, .*\)(?: [evg])?")
#: Columns of names and of units.
WORDS = ("unit", "statement")


def test_what_reads_as_a_number_in_a_table_is_a_number_with_its_unit_and_level(results):
    for each in (each for result in results.values() for each in tables(result)):
        for row in each.rows:
            cells = dict(zip(each.head, row, strict=True)) if len(set(each.head)) == len(row) else {}
            for head, cell in zip(each.head, row, strict=True):
                if isinstance(cell, Quantity):
                    assert isinstance(cell.value, (int, float, tuple))
                    assert cell.unit == cells.get("unit", cell.unit)
                    assert cell.level == cells.get("level", cell.level)
                elif head not in WORDS:
                    assert not NUMBER.fullmatch(cell), (each.head, cell)


def test_tables_of_results_with_numbers_have_some(results):
    without = {name for name, result in results.items() if not any(
        isinstance(cell, Quantity) for each in tables(result) for row in each.rows for cell in row)}  # fmt: skip
    assert without == {
        "Solution", "Certificate", "Checked", "Advice with friction", "Plan", "Rows of a ledger", "Reproduction",
    }  # fmt: skip


def test_a_number_that_is_read_is_the_one_that_was_computed_to_its_figures(results):
    seen = 0
    for result in results.values():
        for cell in (cell for each in tables(result) for row in each.rows for cell in row):
            if isinstance(cell, Quantity) and (read := re.fullmatch(r"(?:[<>]= )?(-?[\d.e+-]+)(?: [evg])?", cell.text)):
                assert float(read[1]) == pytest.approx(cell.value, rel=1e-2)
                seen += 1
    assert seen > 200


def test_the_level_of_a_number_that_is_proved_goes_with_it(results):
    cells = [cell for each in tables(results["Comparison with proofs"]) for row in each.rows for cell in row]
    marked = [cell for cell in cells if str(cell).endswith(" v")]
    assert len([cell for cell in marked if isinstance(cell, Quantity)]) > 5
    assert {cell.level for cell in marked if isinstance(cell, Quantity)} == {"verified"}
    levels = {cell.level for each in tables(results["ContinuumCertificate"]) for row in each.rows for cell in row
              if isinstance(cell, Quantity)}  # fmt: skip
    assert levels == {"guaranteed"}


def test_an_interval_that_is_proved_is_rounded_inwards():
    assert str(numbers.interval((0.12345, 0.98765), "verified")) == "(0.124, 0.987) v"
    assert str(numbers.interval((0.12345, 0.98765), "float")) == "(0.123, 0.988)"
    assert numbers.interval(None, "float") == "-"


@pytest.mark.parametrize("number", [0, 7, 123456])
def test_a_count_keeps_all_its_digits_and_the_words_before_it(number):
    assert numbers.count(number) == Quantity(number, str(number))
    assert numbers.count(number, "<= ") == Quantity(number, f"<= {number}")
    assert numbers.count(None, "<= ") == numbers.NONE


# --- one title, one place ---


def strings(path: Path) -> list[str]:
    """Texts of a module that are no docstrings."""
    tree = ast.parse(path.read_text("utf-8"))
    told = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    return [n.value for n in ast.walk(tree) if isinstance(n, ast.Constant) and id(n) not in told and n.value]


def test_a_title_that_is_renamed_in_its_one_place_is_renamed_everywhere(results, monkeypatch, tmp_path, capsys):
    result = results["Comparison"]
    old, new = "DOES THE RUN AGREE WITH THE BOUND?", "WHO IS RIGHT?"
    places = [path for path in ROOT.rglob("*.py") if old in strings(path)]
    assert places == [ROOT / "sections" / "comparison.py"]
    source = places[0].read_text("utf-8")
    assert source.count(old) == 1
    pages = lambda: (page_words(report(result, {"residuals": "<svg></svg>"})), words(terminal(result.sections())))
    before = pages()
    scope: dict = {"__name__": of_comparison.__name__}
    exec(
        compile(
            source.replace(old, new)
            .replace("@registry.sections.register", "")
            .replace("@registry.screen.register", ""),
            str(places[0]),
            "exec",
        ),
        scope,
    )
    monkeypatch.setattr(of_comparison.verdicts, "__code__", scope["verdicts"].__code__)
    after = pages()
    assert after == (before[0].replace(old.capitalize(), new.capitalize()), before[1].replace(old, new))
    file = tmp_path / "problem.toml"
    file.write_text(problem(10).to_toml(), encoding="utf-8")
    assert main(["compare", str(file), "--bounds", "energy", "--full"]) == 0
    assert new in (out := capsys.readouterr().out)
    assert old not in out


def test_no_module_of_sections_names_a_bound():
    found = [(path.name, text) for path in ROOT.rglob("sections*/*.py") for text in strings(path) if text in BOUNDS]
    assert found == []


def test_sections_are_made_without_a_terminal_a_browser_and_a_figure():
    heavy = ["click", "rich", "matplotlib", "jinja2", "verification.cli", "verification.figures", "verification.output"]
    modules = sorted({f"verification.{name}" for names in FILLS["sections"].values() for name in names})
    code = f"import sys, {', '.join(modules)}; print([name for name in {heavy} if name in sys.modules])"
    done = ended(code)
    assert done.stdout.strip() == "[]"


# --- what is registered ---


class MadeUp(Bound):
    """A bound of no theorem."""

    name, words, colour = "made-up", "a bound of no theorem", "#123456"

    def evaluate(self, subject, theta=None, *, progress=lambda what, share: None):
        return BoundResult(
            name=self.name,
            proved=True,
            theta=None if theta is None else float(theta),
            factor=Number.of_float(0.875),
            one_minus_factor=Number.of_float(0.125),
            interval=(0.0, 0.625),
            friction=Thresholds(every=Number.of_float(0.4321), some=Number.of_float(0.8765), on="k"),
        )

    def remarks(self, result, unit):
        return (f"{self.name}: of no theorem, in {unit}",)


class ByPrograms(MadeUp):
    name, calculated = "by-programs", False


def test_a_bound_that_is_registered_is_shown_everywhere(monkeypatch, capsys, tmp_path):
    for bound in (MadeUp(), ByPrograms()):
        monkeypatch.setitem(BOUNDS, bound.name, bound)
    bounds = ("made-up", "by-programs")
    result = vf.compare(problem(10), bounds=bounds)
    file = tmp_path / "problem.toml"
    file.write_text(problem(10).to_toml(), encoding="utf-8")
    assert main(["compare", str(file), "--bounds", ",".join(bounds), "--full"]) == 0
    for name in bounds:
        assert f"{name} contracts 0.875 <= 207 consistent" in page_words(result._repr_html_())
    for said in (words(capsys.readouterr().out), page_words(report(result, NO_FIGURES))):
        for name in bounds:
            assert f"{name} 0.432 0.876 (0, 0.625) 0.875 contracts" in said
            assert f"{name}: of no theorem, in MPa" in said
            assert f"{name} consistent" in said


class Weather(Document):
    schema, units = "test.weather/1", {}

    def content(self):
        return {"sun": True}


class Storm(Weather):
    pass


def test_a_kind_of_result_without_sections_is_shown_as_its_document_and_may_register_its_own():
    assert Weather().sections() == ()
    assert "test.weather/1" in Weather()._repr_html_()
    registry.sections.register(Storm, lambda found: (section("sky", "HOW IS THE SKY?", found.schema),))
    assert text(Storm().sections()) == "HOW IS THE SKY?\n  test.weather/1"


# --- parts ---


def test_sections_of_one_id_in_a_row_are_one():
    first = section("a", "ONE", "first")
    more, other = section("a", "", "second"), section("b", "TWO", "third")
    assert shown([first, more, other], "report") == (section("a", "ONE", "first", "second"), other)
    together = list(lines([first, more, other], "terminal"))
    apart = [*lines([first], "terminal"), *lines([more], "terminal", after="a")]
    assert [*apart, *lines([other], "terminal", after="a")] == together
    assert [line for line, title in together if title] == ["ONE", "TWO"]


def test_what_is_for_one_place_is_shown_there_alone():
    parts = [Note("everywhere"), Note("of a page", only="report"), Note("of a screen", only="terminal")]
    sections = [section("a", "A", *parts), replace(section("b", "B", "last"), only="report")]
    assert [part.text for each in shown(sections, "report") for part in each.parts] == [
        "everywhere", "of a page", "last",
    ]  # fmt: skip
    assert [line for line, _ in lines(sections, "terminal")] == ["A", "  everywhere", "  of a screen"]
    assert text(sections) == "A\n  everywhere"


def test_texts_from_outside_lose_their_characters_of_control():
    hostile = "a\x1b[2Jb"
    parts = (Note(hostile), Facts(hostile, (hostile,)), Labelled(hostile, hostile), table([hostile], [[hostile]]))
    made = section("a", hostile, *parts, Block((hostile,)), Quantity(1.0, hostile), caption=hostile)
    assert "\x1b" not in repr(made)
    assert all(line.isprintable() for line, _ in lines([section("a", hostile, *parts)], "terminal"))


def test_a_part_without_a_layout_is_an_error():
    with pytest.raises(TypeError, match="Quantity has no layout"):
        list(lines([section("a", "A", Quantity(1.0, "1"))], "terminal"))


def test_a_command_for_a_problem_that_was_not_typed_is_left_out():
    typed = closing("anything", then=Next(("run",), problem=True))
    assert [line for line, _ in lines([section("a", "A"), typed], "terminal")][-1] == "Not claimed: anything."
    assert [line for line, _ in lines([closing("", then="open it")], "terminal")] == ["Next: open it"]
