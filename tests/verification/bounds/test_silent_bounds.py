"""Rows of bounds that draw no conclusion, and bounds that are registered beside ours."""

import pytest
from problem_list import plates

import verification as vf
from verification.bounds.bound import Bound, BoundResult, Thresholds
from verification.registry import BOUNDS
from verification.show.layout import text


class Silent(Bound):
    """A bound without a conclusion, or one that the pair does not suit."""

    words, colour = "a bound that says nothing", "#333333"

    def __init__(self, name, answer):
        self.name, self.answer = name, answer

    def evaluate(self, subject, theta=None, *, progress=None):
        return self.absent("it suits no pair") if self.answer is None else self.answer


@pytest.fixture
def registered():
    """``registered(name, answer)``: put a bound into the list, before all others where `first` is asked."""
    before = dict(BOUNDS)

    def put(name, answer, *, first=False):
        new, old = {name: Silent(name, answer)}, dict(BOUNDS)
        BOUNDS.clear()
        BOUNDS.update(new | old if first else old | new)

    yield put
    BOUNDS.clear()
    BOUNDS.update(before)


def compared():
    cells = {"body1.cells": "[10, 2]", "body2.cells": "[6, 2]"}
    problem = vf.Problem.from_dict(plates()).with_keys(cells)
    return vf.compare(problem, bounds=[name for name in BOUNDS if BOUNDS[name].calculated])


def test_a_bound_without_a_conclusion_allows_no_friction(registered):
    assert Thresholds().on == "k"
    registered("silent", BoundResult(name="silent", proved=True, why="it never speaks"))
    (row,) = [line for line in text(compared().sections()).splitlines() if line.startswith("  silent  ")][:1]
    assert "any" not in row
    assert row.split()[1:3] == ["-", "-"]


def test_the_column_of_theta_does_not_hang_on_the_first_bound(registered):
    registered("silent", BoundResult(name="silent", proved=True, why="it never speaks"), first=True)
    assert "theta = 0.7" in text(compared().sections()).partition("DOES ONE STEP CONTRACT?")[2].partition("WHAT")[0]


def test_a_bound_that_certifies_does_not_become_the_default_by_registration(registered):
    class Mine(type(BOUNDS["energy"])):
        name = "mine"

    registered("mine", None)
    BOUNDS["mine"] = Mine()
    problem = vf.example("section6").changed(cells=((10, 2), (8, 2)), radius="0.2")
    assert vf.certify(problem).edition == "lmi"
