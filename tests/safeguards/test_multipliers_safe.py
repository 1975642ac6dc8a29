"""What multipliers prove is what the check found proved, whatever eigenvalues and solvers say of it."""

from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest
from problem_list import blocks, small

import verification as vf
from verification.semidefinite import LMIError, interior_point
from verification.semidefinite.multipliers import NARROW, QuadraticForms, friction_threshold

THETAS = np.linspace(0.1, 0.9, 9)


def bodies(**tables):
    pair = vf.build(vf.Problem.from_dict(tables))
    return pair, vf.measure(pair)


@pytest.fixture(scope="module")
def section_6():
    """With the roles in which rho is large, so that the largest theta lies below 1."""
    return bodies(**small(iteration={"neumann_body": 2}))


class Strict:
    """A check that calls a form definite from a square on, or up to a weight, and keeps what it was asked."""

    def __init__(self, margin=0.0, weight=np.inf):
        self.margin, self.weight, self.proved = margin, weight, []
        self.least = None

    def with_multipliers(self, multipliers, *, cross=0.0, step=None):
        def definite(square, weight=1.0):
            if self.least is None:
                self.least = square * (1 + self.margin)
            said = square >= self.least and weight <= self.weight
            if said:
                self.proved.append((square, weight, multipliers))
            return said

        return definite


def checked_by(forms, check):
    forms.traces = check
    return forms


@pytest.mark.parametrize("margin", [0.0, 1e-10, 1e-3])
def test_a_factor_is_the_root_of_a_square_that_was_proved_rounded_upwards(section_6, margin):
    forms = QuadraticForms(*section_6)
    for theta in THETAS:
        check = checked_by(forms, Strict(margin)).traces
        found = forms.factor(theta)
        squares = [square for square, _, multipliers in check.proved if multipliers is found.multipliers]
        assert Fraction(found.value) ** 2 >= Fraction(min(squares))
        assert found.value**2 == pytest.approx(min(squares), rel=1e-14)
        check = checked_by(forms, Strict(margin)).traces
        given = forms.proved_by(found.multipliers, theta)
        assert Fraction(given.value) ** 2 >= Fraction(min(square for square, _, _ in check.proved))


@pytest.mark.parametrize("margin", [0.0, 1e-10, 1e-3])
def test_a_friction_number_was_proved(section_6, margin):
    forms = QuadraticForms(*section_6)
    check = checked_by(forms, Strict(margin)).traces
    found = forms.friction_number()
    assert found.value in [square for square, _, multipliers in check.proved if multipliers is found.multipliers]


def test_a_check_that_never_holds_leaves_nothing(section_6):
    forms = checked_by(QuadraticForms(*section_6), Strict(np.inf))
    given = QuadraticForms(*section_6).factor(0.5).multipliers
    assert forms.proved_by(given, 0.5) is None
    for said in (lambda: forms.factor(0.5), forms.friction_number):
        with pytest.raises(LMIError):
            said()
    forms = checked_by(QuadraticForms(*section_6), Strict(weight=0.0))
    assert forms.largest_theta() is None


@pytest.mark.parametrize("share", [1.0, 1 - 3e-11, 1 - 1e-7, 0.9999])
def test_the_largest_theta_was_proved_and_lies_below_what_eigenvalues_say(section_6, share):
    forms = QuadraticForms(*section_6)
    said = forms.largest_theta()
    assert said.value < said.evaluated
    check = checked_by(forms, Strict(weight=share * said.evaluated)).traces
    check.least = -np.inf
    found = forms.largest_theta()
    assert found.value <= share * said.evaluated
    assert any(found.value == weight and found.multipliers is m for _, weight, m in check.proved)


def test_no_theta_above_1_is_proved():
    """A soft contact body: 2/(1 + rho) lies beyond 1."""
    pair, measured = bodies(**blocks(young=(1, 40), iteration={"neumann_body": 2}))
    assert measured.rho_max.value < 0.5
    found = QuadraticForms(pair, measured).largest_theta()
    assert (found.value, found.evaluated) == (1, 1)


# --- what a solver proposes -------------------------------------------------------------------------------------------


def in_the_cone(multipliers) -> bool:
    lam, tau, a, b = (list(map(Fraction, m)) for m in multipliers)
    return min(map(min, (lam, tau, a, b))) >= 0 and all(4 * x * y >= z * z for x, y, z in zip(a, b, tau, strict=True))


def beyond(optimum, cones, *, pressed=0.0, below=0.0, sheared=None, mirrored=1.0):
    """What was found, with less of the multipliers of (2.4) or of all, another tau over 2 sqrt(a b), a, b times one."""
    y = optimum.y - below
    y[: len(cones)] -= pressed
    if sheared is not None:
        y[cones[:, 0]] = sheared * 2 * np.sqrt(y[cones[:, 1]] * y[cones[:, 2]])
    y[cones[:, 1:]] *= mirrored
    return replace(optimum, y=y)


WRONG = [{"pressed": 0.5}, {"pressed": 10.0}, {"below": 1.0}, {"sheared": 1.0}, {"sheared": 1.1}, {"mirrored": -1.0}]


@pytest.mark.parametrize("wrong", WRONG, ids=str)
def test_a_solver_that_leaves_the_cone_proves_nothing_beyond_it(section_6, wrong):
    solver = lambda program: beyond(interior_point.solve(program), program.cones, **wrong)
    forms, honest = QuadraticForms(*section_6, solver=solver), QuadraticForms(*section_6)
    found = forms.factor(0.6)
    assert in_the_cone(found.multipliers)
    assert found.value >= honest.factor(0.6).value * (1 - 1e-5)
    assert in_the_cone(forms.friction_number().multipliers)
    largest = forms.largest_theta()
    assert in_the_cone(largest.multipliers)
    assert largest.value <= honest.largest_theta().value * (1 + 1e-5)


def test_proposals_that_prove_nothing_leave_what_is_known(section_6):
    for factor in (0.0, 1e6):
        solver = lambda program, factor=factor: replace(found := interior_point.solve(program), y=factor * found.y)
        forms = QuadraticForms(*section_6, solver=solver)
        found = forms.factor(0.1)
        assert in_the_cone(found.multipliers)
        assert QuadraticForms(*section_6).factor(0.1).value <= found.value < 1
        assert forms.largest_theta().value > 0.1


# --- the threshold of friction ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("power", [1, 3])
@pytest.mark.parametrize("proved_below", [np.inf, 1.0])
@pytest.mark.parametrize("start", [0.2, 0.999, 1.00002, 1.0005, 1.002, 1.2])
def test_a_threshold_is_a_friction_whose_number_is_below_1(section_6, monkeypatch, start, proved_below, power):
    """Made-up numbers ``c = k^p``, of which none is proved beyond 1 where ``proved_below`` says so."""
    tried = {}

    def number(forms, near, *, stop):
        k = tried["last"] = forms.friction
        tried[k] = k
        if k >= proved_below:
            raise LMIError("made up")
        return SimpleNamespace(value=k**power, early=None)

    init = QuadraticForms.__init__

    def remember(forms, pair, measured, *, friction=None):
        init(forms, pair, measured, friction=friction)
        forms.friction = friction

    monkeypatch.setattr(QuadraticForms, "__init__", remember)
    monkeypatch.setattr(QuadraticForms, "friction_number", number)
    found = friction_threshold(*section_6, start)
    assert found in tried
    near = NARROW if power == 1 else 1.1 * NARROW  # a curve lies below its chord
    assert (1 - near) * (1 - 1e-9) <= found < 1
