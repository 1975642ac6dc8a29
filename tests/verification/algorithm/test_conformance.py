"""The conformance kit: all that is registered passes it, and what is wrong in one way is refused for that."""

from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from strategies import AT_NIGHT

import verification as vf
from ndtheory import Number
from verification.algorithm.fixed_point import FixedPointMap
from verification.algorithm.relaxation import Momentum, Rule, momentum_rate
from verification.bounds.bound import Subject
from verification.bounds.table import Energy
from verification.interface.friction import Local, Nonlocal, hat
from verification.interface.interface import Law
from verification.registry import BOUNDS, LAWS, RULES
from verification.semidefinite.pattern_search import largest_factor
from verification.testing import (
    Refused,
    check_bound,
    check_law,
    check_rule,
    check_step,
    forces,
    matrix_pairs,
    pairs,
    problems,
    thetas,
)
from verification.testing import properties as kit
from verification.testing.rules import solution, steps
from verification.testing.transforms import in_units, mirrored, reflect, upside_down


@pytest.fixture
def known_draws(monkeypatch):
    """What shows a fault is drawn the same each time but at night, and made simpler by few draws."""
    monkeypatch.setattr(kit, "SIMPLER", 4)
    usual = settings.get_current_profile_name()
    settings.register_profile("known draws", settings.default, derandomize=not AT_NIGHT)
    settings.load_profile("known draws")
    yield
    settings.load_profile(usual)


# --- what is registered passes ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("rule", RULES.values(), ids=list(RULES))
def test_a_registered_rule_passes_and_the_rate_of_momentum_is_attained(rule):
    found = check_rule(rule, examples=4 if rule.name == "momentum" else 3 if AT_NIGHT else 1)
    assert found["keeps its proved rate"].verdict == ("attained" if rule.name == "momentum" else "not asked")


@pytest.mark.parametrize("law", LAWS.values(), ids=list(LAWS))
def test_a_registered_law_passes(law):
    check_law(law.of(Fraction(3, 10)), examples=8 if AT_NIGHT else 3)


@pytest.mark.parametrize("bound", BOUNDS.values(), ids=list(BOUNDS))
def test_a_registered_bound_passes(bound):
    if bound.on_request and not AT_NIGHT:
        pytest.skip("twenty seconds: by night, and the tests of the free norm attack it by day")
    check_bound(bound, examples=(5 if bound.calculated else 2) if AT_NIGHT else 1)


MATRICES = {
    "S1": np.array([[3.0, 0.5, 0.1, 0.0], [0.5, 4.0, 0.0, 0.2], [0.1, 0.0, 5.0, 1.0], [0.0, 0.2, 1.0, 6.0]]),
    "S2": np.diag([2.0, 3.0, 2.5, 4.0]),
    "load1": np.array([0.1, 0.0, 0.3, -0.2]),
    "load2": np.array([0.2, -0.1, -1.0, -2.0]),
    "x": np.array([0.0, 1.0]),
    "gap": 0.01,
    "kernel": hat(np.array([[0.0, 1.0], [1.0, 0.0]]), 1.5),
}


def step_of(pair):
    """T of this project, with normal components along y, as another code would offer it."""
    T, turn = FixedPointMap(pair), pair.neumann.orient
    return lambda g: turn(pair.interface.carry_back(T(turn(g))[1].force))


@pytest.mark.parametrize(("neumann_body", "friction"), [(1, 0), (2, 0.1), (1, 1)])
def test_the_step_of_this_project_passes_with_its_loads_and_without_them(neumann_body, friction):
    given = MATRICES | {"friction": friction, "neumann_body": neumann_body}
    pair = vf.build(**given)
    report = check_step(step_of(pair), pair, examples=5)
    assert report["is the step of these matrices"].detail.endswith("with its loads")
    unloaded = {name: value for name, value in given.items() if name not in ("load1", "load2", "gap")}
    report = check_step(step_of(pair), **unloaded, examples=5)
    assert report["is the step of these matrices"].detail.endswith("far from its loads")


@pytest.mark.parametrize(("n", "seed"), [(2, 10), (2, 38), (3, 2), (3, 19), (3, 24), (3, 41)])
def test_newton_sees_no_side_where_a_step_ends_at_a_kink(n, seed):
    """Without neighbours in reach S sigma_N becomes 0 at an open node after one step: rounding gives it a sign."""
    random = np.random.default_rng([n, seed])
    S1, S2 = (A @ A.T + n * np.eye(2 * n) for A in random.normal(size=(2, 2 * n, 2 * n)))
    loads = {"load1": random.normal(size=2 * n), "load2": random.normal(size=2 * n)}
    pair = vf.build(S1=4 * S1, S2=S2, **loads, x=np.arange(n), kernel=np.eye(n), friction=1, neumann_body=2)
    start = random.normal(size=2 * n)
    own = steps(RULES["newton"], pair, Fraction(1, 4), start)
    image = steps(RULES["newton"], mirrored(pair), Fraction(1, 4), reflect(pair, start))
    assert min(np.abs(pair.interface.stress(g)).min() for g in own) < 1e-14 * np.abs(own).max()
    for g, h in zip(own, image, strict=True):
        assert reflect(pair, h) == pytest.approx(g, abs=1e-6 * np.abs(own).max())


def test_a_pair_whose_only_forces_are_rounding_has_a_solution_to_compare_with():
    """Two blocks, pushed along Gamma_c without friction."""
    side = {"shape": "rectangle", "x": [0, "0.05"], "cells": [1, 1], "young": 1, "poisson": "-0.5"}
    bodies = {"body1": {**side, "y": ["-0.001", 0], "fixed": ["bottom"]}, "body2": {**side, "y": [0, "0.001"]}}
    bodies["body2"]["prescribed"] = {"top": ["2.5e-05", 0]}
    given = {"contact": {"friction": 0, "radius": "0.025"}, "iteration": {"neumann_body": 1, "theta": "0.01"}}
    g, error = solution(vf.build(vf.Problem.from_dict(bodies | given)))
    assert max(np.abs(g).max(), error) < 1e-15


# --- rules that are wrong in one way ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Wrong(Rule):
    """Constant relaxation, but for one thing."""

    name = "wrong"
    words = "wrong relaxation"

    def outside(self, friction):
        return ""


class Remembering(Wrong):
    """Each run goes with a larger part of theta than the one before."""

    runs: list[int] = []

    def begin(self, pair, theta, rho):
        self.runs.append(0)
        part = theta * len(self.runs) / (len(self.runs) + 1)
        return lambda iterate: part * iterate.image + (1 - part) * iterate.g


class Sharing(Wrong):
    """The residual of the last step is kept in the rule, where another run finds it."""

    last: dict[int, np.ndarray] = {}

    def begin(self, pair, theta, rho):
        self.last.clear()

        def step(iterate):
            r = iterate.image - iterate.g
            before = self.last.get(len(r), r)
            self.last[len(r)] = r
            return iterate.g + theta * r + theta / 4 * (r - before)

        return step


class WithAUnit(Wrong):
    """1.0 is added to each force: of what unit?"""

    def begin(self, pair, theta, rho):
        return lambda iterate: theta * iterate.image + (1 - theta) * iterate.g + 1.0


class Saturating(Wrong):
    """Residuals are cut off at 1.0; the solution is that of T."""

    def begin(self, pair, theta, rho):
        return lambda iterate: iterate.g + theta * np.clip(iterate.image - iterate.g, -1.0, 1.0)


class LeftHanded(Wrong):
    """The first node moves half as far as the others."""

    def begin(self, pair, theta, rho):
        share = np.where(np.arange(pair.neumann.grid.size) == 0, theta / 2, theta)
        return lambda iterate: iterate.g + share * (iterate.image - iterate.g)


class OfTheUpperBody(Wrong):
    """It goes by the number of the Neumann body."""

    def begin(self, pair, theta, rho):
        part = theta / pair.neumann_body
        return lambda iterate: iterate.g + part * (iterate.image - iterate.g)


class Leaving(Wrong):
    """Relaxation away from the image: it stays at the solution, and reaches it from nowhere."""

    def begin(self, pair, theta, rho):
        return lambda iterate: iterate.g - theta * (iterate.image - iterate.g)


class Boasting(Momentum):
    """The triple momentum method, with 0.9 of its proved rate."""

    def proved_rate(self, rho):
        return 0.9 * momentum_rate(rho)


@pytest.mark.usefixtures("known_draws")
@pytest.mark.parametrize(
    ("rule", "property"),
    [
        (Remembering(), "starts afresh"),
        (Sharing(), "starts afresh"),
        (WithAUnit(), "stays at the solution"),
        (Saturating(), "is independent of units"),
        (LeftHanded(), "sees no left, right, top or bottom"),
        (OfTheUpperBody(), "sees no left, right, top or bottom"),
        (Leaving(), "ends at the solution"),
        (Boasting(), "keeps its proved rate"),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, Rule) else "",
)
def test_a_rule_that_is_wrong_in_one_way_is_refused(rule, property):
    with pytest.raises(Refused) as error:
        check_rule(rule, examples=3)
    assert error.value.property == property
    assert error.value.counterexample
    assert rule.name in str(error.value)


def test_a_rate_that_is_too_generous_is_reported_as_not_attained():
    class Modest(Momentum):
        def proved_rate(self, rho):
            return momentum_rate(rho) / 0.8 if momentum_rate(rho) < 0.8 else None

    assert check_rule(Modest(), examples=2)["keeps its proved rate"].verdict == "not attained"


# --- laws -------------------------------------------------------------------------------------------------------------


class Magnitudes(np.ndarray):
    """A matrix whose product is the magnitude of the product."""

    def __matmul__(self, other):
        return np.abs(np.asarray(self) @ np.asarray(other))


class Nonlinear(Local):
    """Only the magnitude of stress counts, and not in the friction bound alone."""

    def operator(self, interface):
        return super().operator(interface).view(Magnitudes)


class InOneUnit(Nonlocal):
    """Its radius is a number, whatever the unit."""

    def scaled(self, length):
        return self


class LocalInside(Local):
    """The local law, said to be inside the theorem."""

    outside = ""


class Skewed(Nonlocal):
    """It feels the pressure on the left."""

    def operator(self, interface):
        return hat(interface.contact.x[:, None] - interface.neumann.x[None, :] - self.radius / 5, self.radius)


class OfTheWrongGrid(Nonlocal):
    """Its rows are the nodes of the Neumann body."""

    def operator(self, interface):
        return super().operator(interface).T


@pytest.mark.usefixtures("known_draws")
@pytest.mark.parametrize(
    ("law", "property"),
    [
        (Nonlinear(), "linear"),
        (InOneUnit(radius=0.3), "is independent of units"),
        (LocalInside(), "maps into L2"),
        (Skewed(radius=0.3), "sees no left or right"),
        (OfTheWrongGrid(radius=0.3), "a matrix of its grids"),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, Law) else "",
)
def test_a_law_that_is_wrong_in_one_way_is_refused(law, property):
    with pytest.raises(Refused) as error:
        check_law(law, examples=10)
    assert error.value.property == property


# --- bounds -----------------------------------------------------------------------------------------------------------


@dataclass
class Changed(Energy):
    """The theorem in energy norms, with another factor."""

    change: object

    def evaluate(self, subject, theta=None, **options):
        found = super().evaluate(subject, theta, **options)
        if found.factor is None:
            return found
        factor = self.change(found.factor.value)
        return replace(
            found, factor=Number.of_float(factor), one_minus_factor=Number.of_float(1 - factor), detail=found.detail
        )


class Forgetting(Energy):
    """It forgets friction."""

    def evaluate(self, subject, theta=None, **options):
        without = subject if subject.measured is None else subject.at(0)
        return super().evaluate(without, theta, **options)


class OfALength(Energy):
    """It knows how long Gamma_c is, in its unit."""

    def evaluate(self, subject, theta=None, **options):
        found = super().evaluate(subject, theta, **options)
        if found.factor is None:
            return found
        lost = found.one_minus_factor.value / (1 + float(np.ptp(subject.pair.contact.grid.x)))
        return replace(found, factor=Number.of_float(1 - lost), one_minus_factor=Number.of_float(lost))


@pytest.mark.usefixtures("known_draws")
@pytest.mark.parametrize(
    ("bound", "property"),
    [
        (Changed(lambda q: 0.9 * q), "bounds every step"),
        (Changed(lambda q: 1 - (1 - q) / 0.9), "bounds every step"),
        (Forgetting(), "bounds every step"),
        (Changed(lambda q: 1 - (1 - q) / 4), "attained"),
        (OfALength(), "knows no unit of length"),
    ],
    ids=["0.9 of the factor", "more gain", "no friction", "a quarter of the gain", "a length"],
)
def test_a_bound_that_is_wrong_in_one_way_is_refused(bound, property):
    with pytest.raises(Refused) as error:
        check_bound(bound, examples=5 if "length" in property else 20)
    assert error.value.property == property


def test_a_contact_node_that_no_force_reaches_leaves_the_semidefinite_bound_as_it_is():
    """A row of S that is 0 has no scale to divide by."""
    kernel = MATRICES["kernel"] * np.array([[1.0], [0.0]])
    pair = vf.build(**(MATRICES | {"kernel": kernel, "friction": 0.1}))
    found = BOUNDS["lmi"].evaluate(Subject.of(pair, vf.measure(pair)), Fraction(3, 10))
    assert found.factor is not None
    assert largest_factor(pair, 0.3, random=np.random.default_rng(0)).value <= found.factor.value + 1e-9


# --- steps of other codes ---------------------------------------------------------------------------------------------


def unloaded(**changes):
    return {k: v for k, v in (MATRICES | changes).items() if k not in ("load1", "load2", "gap")}


@pytest.mark.parametrize("friction", [0, 0.1])
@pytest.mark.parametrize("loads", [True, False])
def test_a_step_with_a_tenth_more_stiffness_is_refused(friction, loads):
    stiffer = vf.build(**(MATRICES | {"S1": 1.1 * MATRICES["S1"], "friction": friction}))
    given = (MATRICES if loads else unloaded()) | {"friction": friction}
    with pytest.raises(Refused, match="these matrices"):
        check_step(step_of(stiffer), **given, examples=10)


@pytest.mark.parametrize(
    ("wrong", "property"),
    [
        (lambda T: lambda g: T(g)[:2], "stays below its bound"),
        (lambda T: lambda g: -20 * g, "stays below its bound"),
        (lambda T: lambda g: T(g) + 1e-2, "is the step of these matrices"),
    ],
    ids=["half of the forces", "another map", "a force too much"],
)
def test_a_step_that_is_another_map_is_refused(wrong, property):
    pair = vf.build(**MATRICES)
    with pytest.raises(Refused) as error:
        check_step(wrong(step_of(pair)), pair, examples=10)
    assert error.value.property == property


def test_a_step_takes_a_pair_or_matrices():
    pair = vf.build(**MATRICES)
    with pytest.raises(ValueError, match="a pair and S1"):
        check_step(step_of(pair), pair, S1=MATRICES["S1"])


# --- the strategies, and the images of a pair -------------------------------------------------------------------------


@settings(max_examples=15)
@given(problem=problems(most_cells=2), theta=thetas())
def test_problems_and_thetas_are_valid(problem, theta):
    assert vf.build(problem).contact.grid.n >= 1
    assert 0 < theta < 1


def test_pairs_are_of_every_kind():
    seen = []

    @settings(max_examples=60, database=None, derandomize=True)
    @given(pair=pairs())
    def draw(pair):
        seen.append(pair)

    draw()
    for kind in (
        lambda pair: pair.problem is None and pair.interface.one_grid,
        lambda pair: not pair.interface.one_grid,
        lambda pair: pair.problem is not None and pair.contact.grid.dimension == 2,
        lambda pair: pair.contact.grid.dimension == 1,
        lambda pair: pair.friction > 0,
        lambda pair: pair.neumann_body == 1,
        lambda pair: pair.neumann_body == 2,
    ):
        assert 0 < sum(map(kind, seen)) < len(seen)


@settings(max_examples=15)
@given(pair=pairs(), data=matrix_pairs().flatmap(lambda pair: forces(pair)))
def test_T_of_an_image_is_the_image_of_T(pair, data):
    """Units, mirror and renumbered bodies: what the kit takes for granted of T itself."""
    random = np.random.default_rng(abs(int(1e6 * data[0])) % 2**32)
    g = random.normal(size=pair.neumann.grid.size)
    T = lambda pair, g: pair.interface.carry_back(FixedPointMap(pair)(g)[1].force)
    image, size = T(pair, g), max(np.abs(T(pair, g)).max(), 1.0)
    assert reflect(pair, T(mirrored(pair), reflect(pair, g))) == pytest.approx(image, abs=1e-7 * size)
    assert np.array_equal(T(upside_down(pair), g), image)
    plane = pair.contact.grid.dimension == 2
    factor = 4.0**3 * (4.0**2 if plane else 1.0)
    scaled = T(in_units(pair, stress=4.0**3, length=4.0**2), factor * g) / factor
    assert scaled == pytest.approx(image, abs=1e-7 * size)
