"""Which theta "auto" takes, and what becomes of a theta beside momentum."""

import math
import tomllib
from decimal import Decimal
from fractions import Fraction as F

import numpy as np
import pytest
from problem_list import changed

import verification as vf
from ndtheory import EnergyConstants, evaluate_energy
from verification.algorithm.relaxation import Constant
from verification.algorithm.theta import automatic, choose, energy_bounds
from verification.cli.problems import examples, load_problem
from verification.coupling.from_matrices import advise_matrices
from verification.interface.pair import pair_from
from verification.problem import ProblemError
from verification.registry import RULES


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
    energy = evaluate_energy(EnergyConstants(rho=rho, kappa_1=kappa, kappa_2=kappa))
    chosen = automatic(energy)
    if energy.theta_proved is None:
        assert (chosen.source, chosen.theta) == ("predicted", F(str(energy.theta_predicted)))
        assert "no theta is proved" in chosen.why
        return
    proved, predicted = (steps(theta, rho) for theta in (energy.theta_proved, energy.theta_predicted))
    slow = proved > 2 * predicted
    assert chosen.source == ("predicted" if slow else "proved")
    assert float(chosen.theta) == (energy.theta_predicted if slow else energy.theta_proved)
    if kappa:
        assert f"{predicted if slow else proved} steps" in chosen.why
        assert f" {proved if slow else predicted} {'at' if slow else 'of'} the" in chosen.why


def test_both_sources_occur_among_those_cases():
    of = lambda kappa: automatic(evaluate_energy(EnergyConstants(rho=15, kappa_1=kappa, kappa_2=kappa))).source
    assert [of(0.2), of(0.8)] == ["proved", "predicted"]


@pytest.mark.parametrize("size", ["1e-70", "1e-20", "1e20", "1e70"])
def test_no_size_of_rho_stops_the_choice(size):
    chosen = automatic(evaluate_energy(EnergyConstants(rho=size, kappa_1="1e-3", kappa_2="1e-3")))
    assert 0 < chosen.theta < 1


@pytest.fixture(scope="module")
def section6():
    return vf.Problem.from_dict(tomllib.loads(examples()["section6"], parse_float=Decimal))


def test_the_flagship_keeps_its_proved_theta_though_its_bound_asks_for_many_steps(section6):
    energy = energy_bounds(vf.measure(section6))
    chosen = choose(pair_from(section6), "auto")
    assert chosen.source == "proved"
    assert float(chosen.theta) == pytest.approx(0.7012, abs=1e-4)
    bound = math.log(1e-9) / math.log(energy.factor_proved.value)
    assert bound > 2 * math.log(1e-9) / math.log(energy.rate_predicted)
    assert chosen.why.startswith("18 steps expected, at most twice the 13 ")
    finished = vf.run(section6, theta="auto")
    assert (finished.converged, finished.iterations) == (True, 17)


@pytest.mark.parametrize("poisson", ["0.49", "0.495"])
def test_a_nearly_incompressible_body_gets_the_predicted_theta_and_less_than_half_the_steps(poisson):
    problem = softened(poisson)
    proved = energy_bounds(vf.measure(problem)).theta_proved
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
    choice = choose(pair_from(problem), "0.3")
    assert (choice.theta, choice.warnings) == (F(3, 10), [])


def test_the_step_of_momentum_is_that_of_rho_whatever_theta_is():
    pair = pair_from(vf.Problem.from_dict(changed(contact={"friction": 0}, iteration={"relaxation": "momentum"})))
    choices = [choose(pair, theta) for theta in (0.5, "auto", None)]
    assert len({(choice.theta, choice.rho, choice.source) for choice in choices}) == 1
    assert choices[0].source == "momentum"
    assert choose(pair, 0.5).warnings == ["theta = 0.5 is not used: momentum takes its step from rho"]


class Descent(Constant):
    """Another rule that takes its step from rho: a gradient step of length 1/(1 + rho)."""

    name = "descent"
    words = "gradient descent"
    needs_rho = True
    takes_theta = False

    def own_step(self, rho):
        return 1 / (1 + rho)


@pytest.fixture
def descent(monkeypatch):
    monkeypatch.setitem(RULES, "descent", Descent())


def test_a_rule_says_itself_that_it_takes_its_step_from_rho(descent):
    problem = vf.Problem.from_dict(changed(contact={"friction": 0}, iteration={"theta": 0.7}))
    assert problem.changed(relaxation="descent").iteration.theta == "auto"
    without = problem.to_dict() | {"iteration": {"relaxation": "descent"}}
    assert vf.Problem.from_dict(without).iteration.theta == "auto"
    kept = vf.run(problem.changed(relaxation="descent", theta=0.7))
    assert kept.choice.source == "descent"
    assert float(kept.theta) == pytest.approx(1 / (1 + kept.choice.rho), rel=1e-15)
    assert "iteration.theta = 0.7 is not used: descent takes its step from rho" in kept.warnings


def test_the_command_line_refuses_a_theta_beside_any_such_rule(descent, tmp_path):
    path = tmp_path / "problem.toml"
    path.write_text(vf.Problem.from_dict(changed(contact={"friction": 0})).to_toml(), encoding="utf-8")
    with pytest.raises(ProblemError, match='needed no theta beside relaxation = "descent"'):
        load_problem(path, {}, theta="0.5", relaxation="descent")


def test_a_warning_names_the_theta_of_the_rule_that_ran():
    """A rule of the call replaces the file's: its theta is not meant for it, and that of the call is."""
    problem = vf.Problem.from_dict(changed(contact={"friction": 0}, iteration={"theta": 0.7, "relaxation": "momentum"}))
    of_theta = lambda run: [warning for warning in run.warnings if "not used" in warning]
    assert of_theta(vf.run(problem, rule="constant")) == []
    constant = vf.Problem.from_dict(changed(contact={"friction": 0}, iteration={"theta": 0.7}))
    assert of_theta(vf.run(constant, rule="momentum")) == []
    told = of_theta(vf.run(constant, rule="momentum", theta=0.5))
    assert told == ["theta = 0.5 is not used: momentum takes its step from rho"]
