"""Which theta "auto" takes, and what becomes of a theta beside momentum."""

import math
import tomllib
from decimal import Decimal
from fractions import Fraction as F

import numpy as np
import pytest
from problem_list import changed

import verification as vf
from ndtheory import EnergyConstants, evaluate_sharp
from verification.advice.roles import advise_matrices
from verification.algorithm.theta import automatic, choose, sharp_bounds
from verification.cli.problems import examples
from verification.interface.assembly import build


def steps(theta, rho, tolerance=1e-9):
    """Steps that a bonded mode of stiffness rho and an open node need, each counted on its own."""
    slowest = max(abs(1 - theta), abs(1 - theta - theta * rho))
    error, count = 1.0, 0
    while error > tolerance:
        error, count = error * slowest, count + 1
    return count


def softened(poisson, neumann_body=1, **iteration):
    """Section 6 with a nearly incompressible upper body."""
    tables = {"body2": {"poisson": poisson}, "contact": {"radius": "0.2"}}
    data = changed(**tables, iteration={"neumann_body": neumann_body, "theta": "auto", **iteration})
    return vf.Problem.from_dict(data)


@pytest.mark.parametrize("kappa", [0, 0.05, 0.2, 0.4, 0.5, 0.6, 0.8, 0.9])
@pytest.mark.parametrize("rho", [0.3, 2, 15, 40])
def test_the_proved_theta_is_taken_unless_it_needs_more_than_twice_the_steps(rho, kappa):
    sharp = evaluate_sharp(EnergyConstants(rho=rho, kappa_1=kappa, kappa_2=kappa))
    chosen = automatic(sharp)
    if sharp.theta_proved is None:
        assert (chosen.source, chosen.theta) == ("predicted", F(str(sharp.theta_predicted)))
        assert "no theta is proved" in chosen.why
        return
    proved, predicted = (steps(theta, rho) for theta in (sharp.theta_proved, sharp.theta_predicted))
    slow = proved > 2 * predicted
    assert chosen.source == ("predicted" if slow else "proved")
    assert float(chosen.theta) == (sharp.theta_predicted if slow else sharp.theta_proved)
    if kappa:
        assert f"{predicted if slow else proved} steps predicted" in chosen.why
        assert f" {proved if slow else predicted} at the" in chosen.why


def test_both_sources_occur_among_those_cases():
    of = lambda kappa: automatic(evaluate_sharp(EnergyConstants(rho=15, kappa_1=kappa, kappa_2=kappa))).source
    assert [of(0.2), of(0.8)] == ["proved", "predicted"]


@pytest.mark.parametrize("size", ["1e-70", "1e-20", "1e20", "1e70"])
def test_no_size_of_rho_stops_the_choice(size):
    chosen = automatic(evaluate_sharp(EnergyConstants(rho=size, kappa_1="1e-3", kappa_2="1e-3")))
    assert 0 < chosen.theta < 1


@pytest.fixture(scope="module")
def section6():
    return vf.Problem.from_dict(tomllib.loads(examples()["section6"], parse_float=Decimal))


def test_the_flagship_keeps_its_proved_theta_though_its_bound_asks_for_many_steps(section6):
    sharp = sharp_bounds(vf.measure(section6))
    chosen = choose(build(section6), "auto")
    assert chosen.source == "proved"
    assert float(chosen.theta) == pytest.approx(0.7012, abs=1e-4)
    bound = math.log(1e-9) / math.log(sharp.factor_proved.value)
    assert bound > 2 * math.log(1e-9) / math.log(sharp.rate_predicted)
    assert chosen.why.startswith("18 steps predicted, at most twice the 13 ")
    finished = vf.run(section6, theta="auto")
    assert (finished.converged, finished.iterations) == (True, 17)


@pytest.mark.parametrize("poisson", ["0.49", "0.495"])
def test_a_nearly_incompressible_body_gets_the_predicted_theta_and_less_than_half_the_steps(poisson):
    problem = softened(poisson)
    proved = sharp_bounds(vf.measure(problem)).theta_proved
    chosen, slow = vf.run(problem), vf.run(problem, theta=repr(proved))
    assert chosen.to_dict()["theta_source"] == "predicted"
    assert f"at the proved theta {proved:.4g}" in chosen.to_dict()["theta_reason"]
    assert chosen.converged
    assert slow.converged
    assert 2 * chosen.iterations < slow.iterations


def test_where_there_is_no_file_there_is_no_automatic_theta():
    role = advise_matrices(np.eye(2), np.eye(2)).to_dict()["roles"][0]
    assert role["theta_auto"] is None
    assert "theta_auto" in role["reason"]


# --- momentum takes its step from rho -------------------------------------------------------------------------------


@pytest.mark.parametrize("relaxation", ["constant", "aitken", "anderson", "newton"])
def test_the_other_rules_take_a_theta_without_a_word(relaxation):
    problem = vf.Problem.from_dict(changed(iteration={"relaxation": relaxation}))
    assert problem.iteration.warnings == []
    assert choose(build(problem), "0.3").theta == F(3, 10)


def test_the_step_of_momentum_is_that_of_rho_whatever_theta_is():
    pair = build(vf.Problem.from_dict(changed(contact={"friction": 0}, iteration={"relaxation": "momentum"})))
    assert choose(pair, 0.5) == choose(pair, "auto") == choose(pair)
    assert choose(pair).source == "momentum"
