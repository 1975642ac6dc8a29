"""``vf.check``: the record is what the library computes, and each page says which answers can be checked."""

import json
import math
import re
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

import verification as vf

DOCS = Path(__file__).parents[2] / "docs"
KNOWN = json.loads((files("verification") / "data" / "exercises.json").read_text("utf-8"))


def answer_to(name):
    return right[0] if len(right := KNOWN[name]["right"]) == 1 else right


def agree(one, other):
    if isinstance(one, str):
        return one == other
    return math.isclose(one, other, rel_tol=1e-6)


def test_the_record_is_what_the_library_computes_now(builder):
    made = json.loads(builder.exercises.text())
    assert len(made) >= 12
    assert list(made) == list(KNOWN), "python docs/builder/exercises.py"
    for name, record in made.items():
        old = KNOWN[name]
        assert (record["asks"], list(record["wrong"])) == (old["asks"], list(old["wrong"]))
        for ours, theirs in [
            (record["right"], old["right"]),
            *((record["wrong"][x], old["wrong"][x]) for x in old["wrong"]),
        ]:
            assert all(map(agree, ours, theirs)), name


@pytest.mark.parametrize("name", KNOWN)
def test_the_answer_is_right_and_a_usual_mistake_gets_its_hint(name):
    assert vf.check(name, answer_to(name)) == "right"
    right, hints = KNOWN[name]["right"], set()
    for numbers in KNOWN[name]["wrong"].values():
        said = vf.check(name, numbers)
        if said != "right":
            start, _, hint = said.partition(". ")
            assert start == "Not yet" if len(right) == 1 else re.fullmatch(r"Not yet, number \d", start)
            assert hint in KNOWN[name]["wrong"]
            hints.add(hint)
    assert hints
    if not isinstance(right[0], str):
        assert vf.check(name, [1.0173 * 7.3 * abs(x) + 11 for x in right]).startswith("Not yet")


def test_an_answer_may_be_fractions_an_array_or_rounded_to_three_digits():
    assert vf.check("two_bars.2", ("1/3", "3/4", "6/7", "3/2")) == "right"
    assert vf.check("two_bars.2", np.array([0.333, 0.75, 0.857, 1.5])) == "right"
    assert vf.check("two_bars.3", np.array(KNOWN["two_bars.3"]["right"][0])) == "right"
    assert vf.check("theorem_and_experiment.2", ["violated", "consistent", "INCONCLUSIVE"]) == "right"


def test_the_hints_fit_the_mistakes_that_they_are_for():
    t = 2 / math.pi
    assert vf.check("two_bars.3", 1 / (1 + t)) == "Not yet. Did you forget a square?"
    assert vf.check("two_bars.2", [3, 1 / 4, 2 / 5, 1 / 2]) == "Not yet, number 1. Did you take the other body?"
    assert vf.check("constants.1", 90) == "Not yet. Is this in degrees? Take radians."
    assert vf.check("two_bars.2", [1 / 3, 1 / 4, 6 / 7, 3 / 2]) == "Not yet, number 2. Did you take the other body?"
    assert vf.check("open_or_closed.3", [3 / 4, 1 / 2]) == "Not yet, number 1. Did you exchange theta and 1 - theta?"
    assert vf.check("two_bars.3", 123.4) == "Not yet."
    assert vf.check("two_bars.2", [1 / 3, 3 / 4, 6 / 7, 1]).endswith("The limit may exceed 1.")
    assert vf.check("which_side.3", [10.8, 111]).startswith("Not yet, number 1. Is it rounded up?")
    assert vf.check("theorem_and_experiment.2", ["VIOLATED", "CONSISTENT", "CONSISTENT"]).startswith(
        "Not yet, number 3. "
    )


def test_a_hint_explains_all_that_is_wrong_and_none_is_given_for_a_coincidence():
    assert vf.check("other_code.1", [1, 2, 3]) == "Not yet, number 1."
    assert vf.check("two_bars.2", [3, 0.75, 0.857, 0.9]) == "Not yet, number 1."  # 3 is that of the other body
    assert vf.check("which_side.3", [12, 112]) == "Not yet, number 1."  # no 1 + lambda in a number of steps


def test_right_answers_in_another_order_are_named_as_such():
    said = "Not yet, number 1. These are the right answers in another order; needed both theta for rho = 3."
    assert vf.check("open_or_closed.3", [0.5, 0.25]) == said
    assert "in another order" in vf.check("theorem_and_experiment.2", ["consistent", "violated", "inconclusive"][::-1])
    assert "in another order" not in vf.check("open_or_closed.3", [0.25, 0.25])


#: What an answer of two digits or more is told that agrees as far as its digits go, and one of a single digit.
SHORT, MORE = "Right as far as it goes; give three digits.", "Give three digits."


@pytest.mark.parametrize(
    ("name", "answer", "short"),
    [
        ("two_bars.2", [0.33, 0.75, 0.86, 1.5], True),
        ("two_bars.2", ["0.33", "3/4", ".86", "1.5"], True),
        ("two_bars.2", [0.33, 0.75, 0.87, 1.5], False),
        ("two_bars.2", [0.34, 0.75, 0.857, 1.5], False),
        ("two_bars.2", [0, 0.75, 0.857, 1.5], False),
        ("two_bars.2", ["1/4", 0.75, 0.857, 1.5], False),
        ("which_side.1", 0.59, True),
        ("which_side.1", 0.58, False),
        ("which_side.1", 0.6, False),
        ("which_side.1", 1e-5, False),
        ("which_side.3", [11, 110], False),
    ],
)
def test_an_answer_with_too_few_digits_is_neither_right_nor_wrong(name, answer, short):
    assert vf.check(name, answer) != "right"
    assert (vf.check(name, answer) == SHORT) == short


@pytest.mark.parametrize(
    "name", [name for name in KNOWN if all(isinstance(x, float) and x < 100 for x in KNOWN[name]["right"])]
)
def test_an_answer_rounded_to_two_digits_is_right_or_asked_for_a_third(name):
    assert vf.check(name, [float(f"{x:.2g}") for x in KNOWN[name]["right"]]) in ("right", SHORT)


@pytest.mark.parametrize("name", [name for name in KNOWN if all(isinstance(x, float) for x in KNOWN[name]["right"])])
def test_one_digit_is_never_called_right_unless_it_is_the_answer(name):
    right = KNOWN[name]["right"]
    for short in ([round(x) for x in right], [float(f"{x:.1g}") for x in right], [f"{x:.0e}" for x in right]):
        said = vf.check(name, short)
        if not all(math.isclose(float(x), of, rel_tol=0.005) for x, of in zip(short, right, strict=True)):
            assert said == MORE or said.startswith("Not yet"), (short, said)


@pytest.mark.parametrize(
    ("name", "answer"),
    [("two_bars.3", 1), ("constants.1", 2), ("open_or_closed.2", [2, 2]), ("theorem_and_experiment.3", 1)],
)
def test_a_whole_number_near_the_answer_is_asked_for_digits(name, answer):
    assert vf.check(name, answer) == MORE


def test_a_multiple_of_pi_is_a_number():
    for text in ("pi/2", "2*pi/4", " 0.5 * pi", "1/2*pi"):
        assert vf.check("constants.1", text) == "right"
    assert vf.check("constants.1", "pi") == "Not yet. Is there a factor 2 too many?"
    assert vf.check("two_bars.3", "pi/2") == "Not yet."


@pytest.mark.parametrize(
    ("name", "answer", "hint"),
    [
        ("friction.1", [0.518, 0.586], "square of C_s"),
        ("friction.1", [0.732, 0.75], "S_c alone"),
        ("friction.2", 4, "tangential jump"),
        ("prediction.1", [14, 28], "rounded down"),
        ("prediction.1", [7, 21], "natural logarithm"),
        ("other_code.1", [0.5, 7, 0.222], "No node of bonded"),
        ("other_code.1", [7, 17.5, 0.0755], "stiffest mode the slowest in both"),
        ("open_or_closed.1", [0.412, 0.588], "factor of an open node"),
        ("open_or_closed.1", [0.701, 0.401], "the 1 of 1"),
        ("which_side.1", 1, "the same shape"),
        ("printed_theorem.3", [1.7, 0.304], "rounds its bars"),
    ],
)
def test_a_plausible_mistake_has_a_hint(name, answer, hint):
    assert hint in vf.check(name, answer)


@pytest.mark.parametrize(
    ("name", "answer", "said"),
    [
        ("two_bars.4", 1, "two_bars.4 has no check; these exercises have one: two_bars.1, two_bars.2, two_bars.3"),
        ("prediction.2", 1, "prediction.2 has no check; these exercises have one: prediction.1, prediction.3"),
        ("twobars.1", 1, "twobars.1 has no check; these exercises have one: two_bars.1"),
        (3, 1, f"3 has no check; these exercises have one: {', '.join(KNOWN)}"),
        ("two_bars.2", 1, f"two_bars.2: needed {KNOWN['two_bars.2']['asks']}, 4 in all; received 1"),
        ("two_bars.3", "pi5", "'pi5' is not a number; needed a number such as 1.571, '2/3' or 'pi/2'"),
        ("two_bars.3", b"1", """"b'1'" is not a number; needed a number such as 1.571, '2/3' or 'pi/2'"""),
        ("two_bars.3", {1: 2}, "'{1: 2}' is not a number; needed a number such as 1.571, '2/3' or 'pi/2'"),
        ("two_bars.3", None, "'None' is not a number; needed a number such as 1.571, '2/3' or 'pi/2'"),
        ("two_bars.3", math.nan, "'nan' is not a finite number; needed a number such as 1.571, '2/3' or 'pi/2'"),
        (
            "theorem_and_experiment.2",
            ["x", "y", "z"],
            "'x' is not a verdict; needed some of CONSISTENT, VIOLATED, INCONCLUSIVE, HYPOTHESES_NOT_MET, NOT_COMPUTED",
        ),
    ],
)
def test_a_wrong_name_or_format_is_answered_in_one_line_without_a_traceback(name, answer, said):
    assert vf.check(name, answer) == said


EXERCISE = re.compile(r"\{admonition\} Exercise (\d):.*?\{dropdown\} Solution", re.DOTALL)


def line(name):
    return f'*Check:* `vf.check("{name}", {"[..]" if len(KNOWN[name]["right"]) > 1 else ".."})` takes'


@pytest.mark.parametrize("name", KNOWN)
def test_the_page_says_below_the_exercise_how_to_check_it_and_its_own_numbers_are_right(name):
    page, number = name.split(".")
    text = (DOCS / "examples" / f"{page}.md").read_text("utf-8")
    (exercise,) = (found[0] for found in EXERCISE.finditer(text) if found[1] == number)
    assert f"{line(name)} {KNOWN[name]['asks']}.\n" in exercise
    assert f'assert vf.check("{name}", ' in text


def test_every_line_on_a_page_belongs_to_an_exercise_of_the_record():
    pages = [path.read_text("utf-8") for path in [*DOCS.glob("*.md"), *(DOCS / "examples").glob("*.md")]]
    named = {name for text in pages for name in re.findall(r'vf\.check\("([\w.]+)"', text)}
    assert named == set(KNOWN)
