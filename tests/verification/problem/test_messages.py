"""Messages show values as a user would type them."""

from copy import deepcopy
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from problem_list import blocks

import verification as vf
from ndtheory import HypothesisError
from ndtheory.number import typed

THREE_TENTHS = 0.1 + 0.2


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (THREE_TENTHS, "0.3"),
        (-THREE_TENTHS, "-0.3"),
        (0.3, "0.3"),
        (12.0, "12.0"),  # which is no whole number
        (1e-300, "1e-300"),
        (Fraction(3, 10), "0.3"),
        (Fraction(-3, 10), "-0.3"),
        (Fraction(0.3), "0.3"),  # the double, of two long numbers
        (Fraction(THREE_TENTHS), "0.3"),
        (Fraction(1, 3), "1/3"),
        (Fraction(-100, 7), "-100/7"),
        (Fraction(300), "300"),
        (Fraction(10**40), "1e+40"),
        (Fraction(1, 10**40), "1e-40"),
        (Decimal("0.10"), "0.10"),
        ("x", "x"),
    ],
)
def test_a_number_is_shown_as_it_would_be_typed(value, text):
    assert typed(value) == text


def test_a_number_of_thousands_of_digits_is_shown_too():
    assert typed(Fraction(10**5000)) == "1e+5000"
    assert typed(10**5000) == "an integer of 16610 bits"


@pytest.mark.parametrize(
    ("keys", "shown"),
    [
        ({"body2": {"prescribed": {"top": ["free", THREE_TENTHS]}, "fixed": ["top"]}}, 'top = ["free", 0.3]: '),
        ({"body2": {"traction": {"top": [THREE_TENTHS, Fraction(1, 3)]}}}, "traction.top = [0.3, 1/3]: "),
        ({"contact": {"interval": [THREE_TENTHS, -THREE_TENTHS]}}, "interval = [0.3, -0.3]: "),
        ({"body1": {"young": -THREE_TENTHS}}, "young = -0.3: "),
        ({"iteration": {"theta": Fraction(7, 5)}}, "theta = 1.4: "),
        ({"body2": {"points": {"a": [Fraction(100, 3), THREE_TENTHS]}}}, "points.a = [100/3, 0.3]: "),
        ({"contact": {"friction": {"s": [0, THREE_TENTHS], "k": [1, 1]}, "law": "local"}}, "friction.s = [0, 0.3]: "),
    ],
)
def test_a_refusal_shows_numbers_and_free_components_as_a_file_has_them(keys, shown):
    with pytest.raises(vf.ProblemError) as refused:
        vf.solve(vf.Problem.from_dict(blocks(**keys)))
    assert shown in str(refused.value)
    assert "None" not in str(refused.value)


def test_supports_that_change_in_a_history_are_refused_with_free_and_the_remedy():
    steps = [{"body2": {"prescribed": {"top": [0, "free"]}}}, {"body2": {"prescribed": {"top": ["free", 0]}}}]
    data = blocks(body2={"prescribed": {"top": [0, "free"]}}) | {"step": steps}
    with pytest.raises(vf.ProblemError) as refused:
        vf.Problem.from_dict(data)
    said = 'body2.prescribed.top = ["free", 0]: needed "free" where it was "free" before, only there: supports stay'
    assert said in str(refused.value)
    assert str(refused.value).endswith("prescribe this component in each step, in place of a traction")


def test_a_hypothesis_shows_numbers_in_the_same_way():
    with pytest.raises(HypothesisError, match=r"^theta = 1\.3: needed"):
        vf.run(vf.Problem.from_dict(blocks()), theta=1 + THREE_TENTHS)


def test_numbers_and_arrays_of_numpy_are_numbers_and_lists():
    keys = {"cells": ((4, 4), (4, 4)), "contact": {"friction": "0.2", "radius": 1}, "iteration": {"theta": 0.5}}
    data = blocks(**keys, body2={"prescribed": {"top": [0, -0.25]}})
    given = deepcopy(data)
    for name in ("body1", "body2"):
        of = given[name]
        given[name] = of | {"x": np.array(of["x"]), "cells": [np.int64(4), np.int32(4)], "young": np.int64(of["young"])}
    given["body2"]["prescribed"] = {"top": np.array([0, -0.25])}
    given["contact"]["radius"] = np.array(1)
    given["iteration"]["theta"] = np.float32(0.5)
    assert vf.Problem.from_dict(given) == vf.Problem.from_dict(data)


@pytest.mark.parametrize(("table", "key"), [("iteration", "theta"), ("contact", "friction"), ("body1", "poisson")])
def test_an_array_in_place_of_a_number_is_refused_as_the_list_is(table, key):
    data = blocks()
    refused = []
    for value in (np.array([0.5, 0.25]), [0.5, 0.25]):
        tables = {**data, table: {**data.get(table, {}), key: value}}
        with pytest.raises(vf.ProblemError, match=rf"{table}.{key} = \[0.5, 0.25\]: needed ") as error:
            vf.Problem.from_dict(tables)
        refused.append(str(error.value))
    assert refused[0] == refused[1]
    with pytest.raises(HypothesisError, match="needed a number with 0 < theta < 1"):
        vf.run(vf.Problem.from_dict(data), theta=np.array([0.5, 0.25]))
