"""The best theta in four ways: closed forms, neighbours that are no better, and figures that end where a proof does."""

import numpy as np
import pytest

import verification as vf
from ndtheory import evaluate_energy
from verification.bounds.bound import Subject
from verification.figures.best_theta import Panel, draw_best_theta
from verification.figures.sweep import draw_rules
from verification.registry import BOUNDS
from verification.semidefinite.multipliers import QuadraticForms
from verification.sweeps.best_theta import Fewest, best_theta

SMALL = vf.example("section6-60").changed(max_iterations=400)


def bars(stiffness_1, stiffness_2):
    """Two bars of one length in contact at a point: rho is the ratio of their stiffnesses."""
    body = {"shape": "interval", "cells": 2}
    return vf.Problem.from_dict(
        {
            "dimension": 1,
            "body1": body | {"x": [0, 1], "young": stiffness_1, "fixed": ["left"]},
            "body2": body | {"x": [1, 2], "young": stiffness_2, "prescribed": {"right": "-0.1"}},
        }
    )


@pytest.fixture(scope="module")
def small():
    return best_theta(SMALL)


@pytest.mark.parametrize(("one", "other"), [(2, 1), (1, 1), (1, 4)])
def test_bars_have_every_best_theta_in_closed_form(one, other):
    rho = one / other
    found = best_theta(bars(one, other))
    assert found.rho == pytest.approx(rho, rel=1e-12)
    assert found.predicted == pytest.approx(2 / (2 + rho), rel=1e-12)
    assert found.energy.theta == pytest.approx(2 / (2 + rho), rel=1e-12)
    assert found.energy.factor == pytest.approx(rho / (2 + rho), rel=1e-9)
    # contact stays closed: one mode, 1 - theta (1 + rho)
    assert found.linearised.theta == pytest.approx(1 / (1 + rho), rel=1e-5)
    assert found.linearised.factor < 1e-4
    assert found.seen.below < 1 / (1 + rho) < found.seen.above


def test_the_spectral_radius_is_least_at_the_theta_of_the_jacobian(small):
    radius = lambda theta: vf.run(SMALL, theta=theta).linearise().linearised.radius
    least = radius(small.linearised.theta)
    assert least == pytest.approx(small.linearised.factor, rel=1e-6)
    assert all(radius(small.linearised.theta * share) > least for share in (0.97, 1.03))


def test_the_proved_factors_are_least_at_their_thetas(small):
    pair, measured = vf.build(SMALL), vf.measure(SMALL)
    energy = evaluate_energy(measured.energy_constants())
    assert (small.energy.theta, small.energy.factor) == (energy.theta_proved, energy.factor_proved.value)
    at = lambda theta: BOUNDS["lmi"].evaluate(Subject.of(pair, measured), theta).factor.value
    assert small.semidefinite.factor < small.energy.factor
    assert at(small.semidefinite.theta) <= small.semidefinite.factor * (1 + 1e-6)
    whole = QuadraticForms(pair, measured).factor(small.semidefinite.theta).value
    assert whole == pytest.approx(small.semidefinite.factor, rel=1e-6)
    assert all(at(small.semidefinite.theta * share) > small.semidefinite.factor for share in (0.9, 1.1))


def test_no_run_between_the_ends_of_the_bar_takes_fewer_steps(small):
    seen = small.seen
    assert seen.below < seen.low <= seen.high < seen.above
    steps = lambda theta: vf.run(SMALL, theta=theta).iterations
    assert steps(seen.low) == steps(seen.high) == seen.steps
    assert min(steps(seen.below), steps(seen.above)) > seen.steps


def test_runs_that_do_not_arrive_are_no_fewest():
    rows = [{"theta": theta, "iterations": steps} for theta, steps in ((0.5, None), (0.1, 9), (0.3, 9), (0.2, 12))]
    assert Fewest.of(rows) == Fewest(steps=9, low=0.1, high=0.3, below=None, above=0.5)
    assert Fewest.of(rows[:1]) is None


def test_what_has_no_best_theta_says_why():
    rubbing = best_theta(SMALL.changed(friction=5), runs=False)
    assert (rubbing.energy, rubbing.seen, rubbing.semidefinite) == (None, None, None)
    assert rubbing.reason["energy"] == "q(theta) is below 1 for no theta"
    assert rubbing.reason["semidefinite"] == "no theta is proved to contract"
    assert rubbing.reason["seen"] == "no runs were asked for"
    apart = best_theta(SMALL.changed(gap="0.1", friction=0), runs=False, semidefinite=False)
    assert apart.reason["linearised"] == "the spectral radius falls up to theta = 1"  # all open: it is 1 - theta
    local = best_theta(SMALL.changed(law="local", radius=None), runs=False)
    assert (local.energy, local.semidefinite) == (None, None)
    assert local.reason["energy"] == local.reason["semidefinite"] == vf.build(SMALL.changed(law="local")).outside[0]
    short = best_theta(SMALL.changed(max_iterations=1), semidefinite=False)
    assert (short.seen, short.reason["seen"]) == (None, "no run converged")


def test_a_body_that_friction_alone_keeps_from_sliding_has_no_best_theta():
    block = {"shape": "rectangle", "x": [0, 1], "cells": [2, 2], "young": 1, "poisson": 0.3}
    sliding = vf.Problem.from_dict(
        {
            "body1": block | {"y": [-1, 0], "fixed": ["bottom"]},
            "body2": block | {"y": [0, 1], "prescribed": {"top": ["free", "-0.1"]}},
            "contact": {"friction": "0.1", "radius": 1},
            "iteration": {"neumann_body": 1},
        }
    )
    with pytest.raises(ValueError, match="the theorem in energy norms does not apply"):
        best_theta(sliding)


def test_a_curve_of_the_figure_ends_where_its_proof_does(small):
    none = best_theta(SMALL.changed(friction=5), runs=False)
    free = best_theta(SMALL.changed(friction=0), runs=False, semidefinite=False)
    panel = Panel(
        title="both", with_friction={1: small, 2: none}, without={1: free}, moduli={"inside": {1: 0.8, 2: 0.7}}
    )
    (ax,) = draw_best_theta([panel], "ratio").axes
    drawn = {line.get_label(): np.asarray(line.get_xdata()) for line in ax.get_lines()}
    assert drawn["proved with friction: energy norms"].tolist() == [1]
    assert drawn["proved with friction: semidefinite"].tolist() == [1]
    assert drawn["predicted: 2/(2 + rho)"].tolist() == [1, 2]
    assert drawn["inside"].tolist() == [1, 2]
    assert drawn["fewest steps in runs"].tolist() == [1]
    (bar,) = [line for line in ax.get_lines() if line.get_label().startswith("_")]
    assert bar.get_ydata() == pytest.approx((small.seen.below, small.seen.above))
    solid = {label for label in drawn if "proved" in label}
    styles = {line.get_label(): line.get_linestyle() for line in ax.get_lines()}
    assert {styles[label] for label in solid} == {"-"}
    assert all(styles[label] != "-" for label in drawn if "predicted" in label or label == "inside")


def test_rules_are_drawn_solid_where_a_rate_is_proved():
    rows = vf.sweep(SMALL, friction=[0], rule=["constant", "momentum", "aitken"], theta=[0.6]).rows
    rows += vf.sweep(SMALL.changed(young=(1, 1)), rule=["constant", "momentum", "aitken"], theta=[0.6]).rows
    (ax,) = draw_rules({"both": rows}).axes
    lines = [line for line in ax.get_lines() if len(line.get_xdata())]
    for dashed, solid, rule in zip(lines[::2], lines[1::2], ("constant", "momentum", "aitken"), strict=True):
        mine = sorted((row for row in rows if row["rule"] == rule), key=lambda row: row["young1"] / row["young2"])
        assert list(dashed.get_ydata()) == [row["iterations"] for row in mine]
        assert list(np.isnan(solid.get_ydata())) == [row["proved_rate"] is None for row in mine]
        assert (dashed.get_linestyle(), solid.get_linestyle()) == ("--", "-")
    assert [row["proved_rate"] is None for row in rows if row["rule"] == "aitken"] == [True, True]
    with pytest.raises(ValueError, match="at least one row"):
        draw_rules({"none": []})
