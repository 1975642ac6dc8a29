"""Problems made from problems: values and keys set by name, read by the readers of the file, refused by their words."""

import dataclasses
import doctest
from decimal import Decimal
from fractions import Fraction as F
from pathlib import Path

import numpy as np
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st
from strategies import fewer

import verification as vf
from verification.interface.friction import Local
from verification.registry import LAWS
from verification.sweeps.grid import SweepGrid

PLANE = vf.example("section6")
BARS = vf.example("two-bars")
RIGID = vf.Problem.from_dict(
    {
        "body1": {"shape": "rigid"},
        "body2": {"shape": "rectangle", "x": [0, 1], "y": [0, 1], "cells": [2, 2], "young": 1, "poisson": 0},
        "contact": {"friction": "0.2", "law": "local"},
    }
)


def test_arrays_of_numpy_are_values_for_both_bodies():
    given = {"young": np.array([70000.0, 20000.0]), "cells": np.array([[10, 2], [6, 2]]), "friction": np.float64(0.25)}
    plain = {name: value.tolist() for name, value in given.items()}
    assert PLANE.changed(**given) == PLANE.changed(**plain)
    axes = {"young": [given["young"]], "refine": np.array([0, 1]), "neumann_body": [np.int64(1)], "theta": (0.5,)}
    plain = {"young": [plain["young"]], "refine": [0, 1], "neumann_body": [1], "theta": [0.5]}
    assert SweepGrid.of(axes) == SweepGrid.of(plain)


def put(problem, key, value):
    """The problem with one field replaced by its dotted path, unread."""
    table, _, name = key.rpartition(".")
    if not table:
        return dataclasses.replace(problem, **{name: value})
    if table == "contact":
        return dataclasses.replace(problem, contacts=(dataclasses.replace(problem.contact, **{name: value}),))
    return dataclasses.replace(problem, **{table: dataclasses.replace(getattr(problem, table), **{name: value})})


# --- changed ---


@pytest.mark.parametrize(
    ("values", "key", "value"),
    [
        ({"friction": "1/3"}, "contact.friction", F(1, 3)),
        ({"friction": 0.1}, "contact.friction", F(1, 10)),
        ({"friction": np.float64(0.1)}, "contact.friction", F(1, 10)),
        ({"friction": Decimal("0.30")}, "contact.friction", F(3, 10)),
        ({"law": "local"}, "contact.law", "local"),
        ({"radius": "0.2"}, "contact.radius", F(1, 5)),
        ({"gap": "0.001"}, "contact.gap", F(1, 1000)),
        ({"young": (None, 3)}, "body2.young", F(3)),
        ({"poisson": [0.25, None]}, "body1.poisson", F(1, 4)),
        ({"cells": ((20, 3), None)}, "body1.cells", (20, 3)),
        ({"neumann_body": 2}, "iteration.neumann_body", 2),
        ({"theta": "auto"}, "iteration.theta", "auto"),
        ({"theta": "1/3"}, "iteration.theta", F(1, 3)),
        ({"relaxation": "newton"}, "iteration.relaxation", "newton"),
        ({"tolerance": 1e-6}, "iteration.tolerance", 1e-6),
        ({"max_iterations": 7}, "iteration.max_iterations", 7),
        ({"title": "other"}, "title", "other"),
    ],
    ids=str,
)
def test_one_value_is_changed_and_no_other(values, key, value):
    assert PLANE.changed(**values) == put(PLANE, key, value) != PLANE


def test_both_bodies_are_changed_by_one_pair():
    other = PLANE.changed(young=(1, 2), poisson=(0, "1/3"), cells=((4, 1), (3, 2)))
    assert (other.body1.young, other.body2.young) == (1, 2)
    assert (other.body1.poisson, other.body2.poisson) == (0, F(1, 3))
    assert (other.body1.cells, other.body2.cells) == ((4, 1), (3, 2))
    assert BARS.changed(cells=(3, 5)).body2.cells == (5,)


@fewer(3)
@given(strategies.contact_problems())
def test_no_change_is_no_change(data):
    problem = vf.Problem.from_dict(data, source="my.toml")
    same = problem.changed()
    assert same == problem
    assert same.source == "my.toml"


@fewer(3)
@given(strategies.plane_problems(), st.fractions(0, 10**9))
def test_friction_is_changed_exactly(data, k):
    problem = vf.Problem.from_dict(data)
    if k and k < F(1, 10**30):
        k = F(1, 10**30)
    assert problem.changed(friction=k) == put(problem, "contact.friction", k)


@fewer(3)
@given(strategies.contact_problems(), strategies.thetas())
def test_changes_of_different_keys_commute(data, theta):
    problem = vf.Problem.from_dict(data)
    young = {"young": (problem.body2.young, problem.body1.young)}
    assert problem.changed(theta=theta).changed(**young) == problem.changed(**young, theta=theta)
    assert problem.changed(theta=theta) == problem.with_theta(theta)
    assert problem.changed(neumann_body=3 - problem.iteration.neumann_body) == problem.swapped()
    cells = tuple(
        body.cells[0] * 2 if problem.dimension == 1 else tuple(2 * n for n in body.cells)
        for body in (problem.body1, problem.body2)
    )
    assert problem.changed(cells=cells) == problem.refined(1)


def test_a_rigid_body_stays_as_it_is():
    assert RIGID.changed(young=(None, 7), friction="0.3").body1 == RIGID.body1


def test_momentum_without_a_theta_takes_its_step_from_rho():
    assert PLANE.iteration.theta == F(7, 10)
    assert PLANE.changed(relaxation="momentum").iteration.theta == "auto"
    kept = PLANE.changed(relaxation="momentum", theta="0.7").iteration
    assert kept.theta == F(7, 10)
    assert PLANE.with_keys({"iteration.relaxation": "momentum"}) == PLANE.changed(relaxation="momentum")
    assert PLANE.changed(relaxation="aitken").iteration.theta == F(7, 10)


@pytest.mark.parametrize(
    ("problem", "values", "key", "needed"),
    [
        (PLANE, {"friction": -1}, "contact.friction", "a number >= 0"),
        (PLANE, {"young": (None, 0)}, "body2.young", "a number > 0"),
        (PLANE, {"young": ("1e-29", "1e29")}, "body2.young", "a modulus within 1e+30 times"),
        (PLANE, {"cells": (40, 6)}, "body1.cells", "two whole numbers >= 1"),
        (PLANE, {"young": 3}, "young", "two values, for body 1 and body 2"),
        (PLANE, {"young": "7e4"}, "young", "None leaves a body as it is"),
        (PLANE, {"young": (1, 2, 3)}, "young", "two values"),
        (PLANE, {"neumann_body": 3}, "iteration.neumann_body", "one of 1, 2"),
        (PLANE, {"theta": 1}, "iteration.theta", "0 < theta < 1"),
        (PLANE, {"title": 3}, "title", "a text in quotes"),
        (PLANE, {"title": "half \ud83d"}, "title", "half a surrogate pair"),
        (BARS, {"friction": "0.1"}, "contact.friction", "two bars have no friction"),
        (BARS, {"poisson": (0.3, None)}, "body1.poisson", "no Poisson ratio"),
        (RIGID, {"young": (1, None)}, "body1.young", "unknown key"),
        (RIGID, {"law": "nonlocal"}, "contact.radius", "missing"),
    ],
    ids=str,
)
def test_a_value_that_does_not_fit_is_refused_by_the_key_of_the_file(problem, values, key, needed):
    problem = dataclasses.replace(problem, source="my.toml")
    with pytest.raises(vf.ProblemError) as caught:
        problem.changed(**values)
    assert (caught.value.file, caught.value.key) == ("my.toml", key)
    assert needed in caught.value.needed
    assert str(caught.value).startswith(f"my.toml: {key}")
    assert str(caught.value).isprintable()


def test_an_unknown_name_is_no_keyword():
    with pytest.raises(TypeError, match="frction"):
        PLANE.changed(frction=1)


# --- dotted keys ---


@pytest.mark.parametrize(
    ("key", "typed", "same"),
    [
        ("contact.friction", "0.4", {"friction": F(2, 5)}),
        ("contact.friction", "1/3", {"friction": F(1, 3)}),
        ("contact.friction", '"1/3"', {"friction": F(1, 3)}),
        ("contact.friction", " 4e-1 # a comment", {"friction": F(2, 5)}),
        ("contact.friction", F(1, 7), {"friction": F(1, 7)}),
        ("body1.cells", "[20, 3]", {"cells": ((20, 3), None)}),
        ("body1.cells", [20, 3], {"cells": ((20, 3), None)}),
        ("iteration.theta", "auto", {"theta": "auto"}),
        ("iteration.theta", '"auto"', {"theta": "auto"}),
        ("iteration . theta", "0.5", {"theta": F(1, 2)}),
        ('"iteration".theta', "0.5", {"theta": F(1, 2)}),
        ("contact.law", "local", {"law": "local"}),
        ("title", "Two words, and ünïcode", {"title": "Two words, and ünïcode"}),
        ("title", '""', {"title": ""}),
        ("title", "a # b", {"title": "a # b"}),
    ],
)
def test_a_key_takes_a_toml_value_or_the_words_that_are_none(key, typed, same):
    expected = PLANE.changed(**same) if same != {"title": ""} else dataclasses.replace(PLANE, title="")
    assert PLANE.with_keys({key: typed}) == expected


def test_keys_that_have_no_keyword_are_set():
    other = PLANE.with_keys({"contact.interval": "[0.6, 1.4]", "norm.length": "2", "units.length": "m"})
    assert other.contact.interval == (F(3, 5), F(7, 5))
    assert (other.length, other.units["length"]) == (2, "m")
    moved = PLANE.with_keys({"body2.prescribed.top": '["free", -0.02]', "body1.traction": "{ left = [1, 0] }"})
    assert dict(moved.body2.prescribed) == {"top": (None, F(-1, 50))}
    assert dict(moved.body1.traction) == {"left": (1, 0)}
    both = PLANE.with_keys({"body2.prescribed": "{ top = [0, -1] }", "body2.prescribed.left": '[0, "free"]'})
    assert dict(both.body2.prescribed) == {"left": (0, None), "top": (0, -1)}


def test_no_keys_are_no_change():
    assert PLANE.with_keys({}) == PLANE


@pytest.mark.parametrize(
    ("key", "typed", "named", "needed"),
    [
        ("contact.fricton", "0.4", "contact.fricton", "did you mean 'friction'"),
        ("wibble", "1", "wibble", "known here"),
        ("wibble.x", "1", "wibble", "unknown table"),
        ("contact.friction.x", "1", "contact.friction.x", "contact.friction is no table"),
        ("contact.friction", "", "contact.friction", "needed a value"),
        ("contact.friction", "-0.4", "contact.friction", "a number >= 0"),
        ("contact.friction", "0.4\nlaw = 1", "contact.friction", "a number >= 0"),
        ("contact.friction", "1" * 5000, "contact.friction", "a number >= 0"),
        ("contact", "0.4", "contact", "a table"),
        ("body1.cells", "[40, 6", "body1.cells", "not a TOML value"),
        ("body1.cells", "[" * 10_000, "body1.cells", "not a TOML value"),
        ("body1.fixed", '["bottom', "body1.fixed", "not a TOML value"),
        ("title", '"a', "title", "not a TOML value"),
        ("", "1", '""', "the name of a key"),
        ("contact.", "1", "contact.", "the name of a key"),
        ("title = 1 #", "1", "title = 1 #", "the name of a key"),
        ("title\nx", "1", r"title\nx", "the name of a key"),
        ("." * 5000, "1", None, "the name of a key"),
    ],
    ids=lambda v: str(v)[:20],
)
def test_a_key_or_a_value_that_cannot_be_read_is_refused_by_its_name(key, typed, named, needed):
    with pytest.raises(vf.ProblemError) as caught:
        dataclasses.replace(PLANE, source="my.toml").with_keys({key: typed})
    assert needed in caught.value.needed
    message = str(caught.value)
    assert message.isprintable()
    assert len(message) < 700
    if named is not None:
        assert message.startswith(f"my.toml: {named}")


# --- the built-in problems ---


def test_a_built_in_problem_is_had_by_its_name():
    assert PLANE.title == "Section 6, centred"
    assert BARS.dimension == 1
    assert vf.example("inside").contact.friction == F(1, 10**7)


@pytest.mark.parametrize("name", ["", "section7", "section6.toml", "../section6"])
def test_an_unknown_name_is_answered_with_the_known_ones(name):
    with pytest.raises(
        ValueError, match=f"no example '{name}'; there are chain, history, inside, .*, section6-60, .*, stack, two-bars"
    ):
        vf.example(name)


# --- the page of the documentation ---


def test_the_page_of_the_problem_file_shows_what_the_program_answers():
    page = Path(__file__).parents[3] / "docs" / "problem_file.md"
    found = doctest.testfile(str(page), module_relative=False)
    assert found.attempted >= 5
    assert found.failed == 0


def test_a_law_that_is_registered_is_one_of_the_words_of_a_problem_file(monkeypatch):
    class Even(Local):
        name, label, needs_radius = "even", "even", True

    with pytest.raises(vf.ProblemError, match=r'contact\.law = "even"'):
        PLANE.changed(law="even")
    monkeypatch.setitem(LAWS, "even", Even)
    assert PLANE.changed(law="even").contact.law == "even"
    without = PLANE.to_dict()
    without["contact"] = {"friction": 0.2, "law": "even"}
    with pytest.raises(vf.ProblemError, match="the even law needs the radius of its kernel"):
        vf.Problem.from_dict(without)
