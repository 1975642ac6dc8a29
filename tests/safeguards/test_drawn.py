"""Mutants drawn at random: what is drawn, which tests run, and the table of the page."""

from __future__ import annotations

import ast
from datetime import date

import pytest
from safeguards import drawn as program
from safeguards.drawn import DRAWN, PAGE, ROOT, drawn, main, rows, status, survivors, totals, with_row
from safeguards.mission import EQUIVALENT, MISSION
from strategies import AT_NIGHT


@pytest.mark.parametrize("module", MISSION if AT_NIGHT else [*MISSION][::6])
def test_ten_changes_of_one_place_are_drawn_from_the_text_of_each_module(module):
    source = (ROOT / module).read_text("utf-8")
    found = drawn(module, source)
    assert len(found) == DRAWN
    assert all(ast.parse(text) and text != source for text in found.values())


@pytest.mark.skipif(not AT_NIGHT, reason="a module that changes may draw other mutants: looked at by night")
@pytest.mark.parametrize("module", EQUIVALENT)
def test_what_is_listed_as_equivalent_is_drawn(module):
    assert set(EQUIVALENT[module]) <= set(drawn(module, (ROOT / module).read_text("utf-8")))


def test_the_draw_stays_the_same_where_other_lines_are_changed():
    source = (ROOT / (module := min(MISSION))).read_text("utf-8")
    assert list(drawn(module, "# a comment\n" + source + "WORD = 'a'\n")) == list(drawn(module, source))


def test_the_list_names_files_that_exist():
    for module, tests in MISSION.items():
        assert [name for name in (module, *tests) if not (ROOT / name).exists()] == []
    assert set(EQUIVALENT) <= set(MISSION)


@pytest.mark.parametrize(
    ("expression", "changes"),
    [
        ("a < b", ["a > b"]),
        ("a is None", ["a is not None"]),
        ("a + b", ["a", "a - b"]),
        ("np.minimum(a, b)", ["np.maximum"]),
        ("a & b", ["a", "b"]),
        ("a and b or c", ["a and b", "c", "a", "b"]),
        ("-a", ["a"]),
        ("7 * a", ["8"]),
        ("1e3 * a", ["2000.0"]),
    ],
)
def test_each_kind_of_change(expression, changes):
    found = [name.partition(" -> ")[2] for name in drawn("m.py", f"def f(a, b, c):\n    return {expression}\n")]
    assert sorted(found) == sorted(changes)


def test_messages_types_and_texts_are_not_changed():
    source = '''"""Text."""
TRUE = True
@cache(1 + 1)
def f(a: Literal[1, 2] = None) -> dict[1, 2]:
    """Text of f."""
    progress("so far", 1 - a)
    assert a > 1
    raise ValueError(f"{a + 1}: needed 2" + str(1 - a))
'''
    assert drawn("m.py", source) == {}


def test_a_module_is_tried_on_a_copy_and_what_its_tests_do_not_notice_is_named(tmp_path, monkeypatch):
    source = "def least(a, b):\n    return min(a, b)\n\n\nSPARE = 7\n"
    path = tmp_path / "small.py"
    path.write_text(source)
    monkeypatch.setitem(MISSION, "small.py", ("test_small.py",))
    monkeypatch.setattr(program, "status", lambda folder, tests, seconds=None: 0 if "min" in path.read_text() else None)
    assert survivors("small.py", tmp_path) == ["module: 7 -> 8"]
    assert path.read_text() == source


def test_tests_that_fail_without_a_mutant_are_an_error_and_those_that_take_too_long_are_ended(tmp_path, monkeypatch):
    monkeypatch.setitem(MISSION, "small.py", ("test_small.py",))
    (tmp_path / "small.py").write_text("SPARE = 7\n")
    (tmp_path / "test_small.py").write_text("def test():\n    assert False\n")
    assert status(tmp_path, ["test_small.py"], 0.01) is None
    if not AT_NIGHT:  # by night the tests of a copy run in a process of their own
        monkeypatch.setattr(program, "status", lambda folder, tests, seconds=None: 1)
    with pytest.raises(RuntimeError, match=r"test_small\.py: do not pass without a mutant"):
        survivors("small.py", tmp_path)


def test_the_table_has_a_row_of_each_module_that_was_tried_and_their_sums():
    text = (ROOT / PAGE).read_text("utf-8")
    found = rows(text)
    assert list(found) == [module for module in MISSION if module in found]
    for module, (count, noticed, equivalent, unnoticed, _) in found.items():
        assert int(count) == int(noticed) + int(equivalent) + int(unnoticed) == DRAWN
        assert int(equivalent) <= len(EQUIVALENT.get(module, ()))
    assert f"| all | {' | '.join(map(str, totals(found)))} | " in text


def test_a_row_is_written_in_the_place_of_the_old_one_and_nothing_else_changes(monkeypatch):
    first, second, *_ = MISSION
    monkeypatch.setitem(EQUIVALENT, first, {"a": "for a reason"})
    text = f"Before.\n\n{program.HEAD}| all | 0 | 0 | 0 | 0 | - |\n\nAfter.\n"
    text = with_row(with_row(text, second, [], date(2020, 1, 2)), first, ["a", "b"], date(2020, 1, 3))
    table = f"| `{first}` | 10 | 8 | 1 | 1 | 2020-01-03 |\n| `{second}` | 10 | 10 | 0 | 0 | 2020-01-02 |\n"
    assert text == f"Before.\n\n{program.HEAD}{table}| all | 20 | 18 | 1 | 1 | 94 % noticed |\n\nAfter.\n"
    again = with_row(text, first, [], date(2020, 1, 4))
    assert again.count(f"`{first}`") == 1
    assert "| all | 20 | 20 | 0 | 0 | 100 % noticed |" in again


def test_an_unknown_module_is_one_line(capsys):
    assert main(["nonsense.py"]) == 2
    assert capsys.readouterr().err.startswith("nonsense.py: not in the list; needed some of fem1d2d/assembly.py, ")
