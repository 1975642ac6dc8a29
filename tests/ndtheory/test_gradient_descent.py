"""Without friction q is the rate of gradient descent; momentum has a faster one.  Both beside performance estimation.

Step III is a gradient step of length theta for an energy that is 1-strongly convex and (1 + rho)-smooth.  PEPit finds
the worst function of that class by a semidefinite program whose value is exact (Taylor, Hendrickx, Glineur 2017), and
knows nothing of contact.  Clarabel solves it to 1e-9; a solution it calls inaccurate is a warning, and fails the test.
"""

from math import sqrt

import pytest
from PEPit import PEP
from PEPit.functions import SmoothStronglyConvexFunction

from ndtheory import EnergyConstants, evaluate_sharp

SOLVER = {"wrapper": "cvxpy", "solver": "CLARABEL", "verbose": 0}
SOLVER |= dict.fromkeys(("tol_gap_abs", "tol_gap_rel", "tol_feas"), 1e-9)

#: A gap of 1e-9 is one part of the solver's error, feasibility the other: values up to 20 came out to 2e-7.
TOLERANCE = 1e-6

RHOS = [0.1, 0.47, 1.2, 5.7]
for_each_rho = pytest.mark.parametrize("rho", RHOS)


def worst_case(problem: PEP) -> float:
    """The largest value of the performance metric; the bound from above and the example from below agree."""
    above, below = (problem.solve(**SOLVER, return_primal_or_dual=side) for side in ("dual", "primal"))
    assert above == pytest.approx(below, abs=TOLERANCE)
    return above


def convex_energy(rho):
    """A problem, its energy, and where that is least."""
    problem = PEP()
    energy = problem.declare_function(SmoothStronglyConvexFunction, mu=1, L=1 + rho)
    return problem, energy, energy.stationary_point()


# --- gradient descent ----------------------------------------------------------------------------------------------


def gradient_step(rho, theta) -> float:
    """The largest |x_1 - x*|^2 with |x_0 - x*| <= 1."""
    problem, energy, least = convex_energy(rho)
    start = problem.set_initial_point()
    problem.set_initial_condition((start - least) ** 2 <= 1)
    problem.set_performance_metric((start - theta * energy.gradient(start) - least) ** 2)
    return worst_case(problem)


@for_each_rho
@pytest.mark.parametrize("place", [0.1, 0.5, 0.9, 1.0, 1.1, 1.5, 1.9])
def test_a_gradient_step_contracts_by_q_and_no_better(rho, place):
    """On both branches: from 0 to 2/(2 + rho) as place goes to 1, from there to the end of the interval up to 2."""
    bounds = evaluate_sharp(EnergyConstants(rho=rho))
    best, end = bounds.theta_predicted, bounds.interval[1]
    theta = place * best if place <= 1 else best + (place - 1) * (end - best)
    q = evaluate_sharp(EnergyConstants(rho=rho), theta).factor.value
    found = gradient_step(rho, theta)
    assert found == pytest.approx(q**2, abs=TOLERANCE)
    for wrong in (0.99 * q, 1.01 * q, min(1 - theta, abs(1 - theta - theta * rho)) if place != 1 else 1):
        assert found != pytest.approx(wrong**2, abs=TOLERANCE)


@for_each_rho
def test_the_best_gradient_step_contracts_by_rho_over_2_plus_rho(rho):
    bounds = evaluate_sharp(EnergyConstants(rho=rho))
    assert bounds.theta_proved == bounds.theta_predicted == pytest.approx(2 / (2 + rho), rel=1e-15)
    best = gradient_step(rho, bounds.theta_proved)
    assert best == pytest.approx((rho / (2 + rho)) ** 2, abs=TOLERANCE)
    assert min(gradient_step(rho, share * bounds.theta_proved) for share in (0.99, 1.01)) > best + 1e-4 * TOLERANCE


@pytest.mark.parametrize("rho", [1.2, 5.7])
def test_at_the_end_of_the_interval_a_gradient_step_need_not_contract(rho):
    end = evaluate_sharp(EnergyConstants(rho=rho)).interval[1]
    assert gradient_step(rho, end) == pytest.approx(1, abs=TOLERANCE)
    assert gradient_step(rho, 1.01 * end) > 1 + 1e-3


# --- momentum ------------------------------------------------------------------------------------------------------


def momentum_rate(rho) -> float:
    """p = 1 - 1/sqrt(1 + rho)."""
    return 1 - 1 / sqrt(1 + rho)


def triple_momentum(energy, before, now, rho, steps, p=None):
    """Van Scoy, Freeman and Lynch (2018), from xi_{-1} and xi_0: after each step y, its gradient and value, and x."""
    L, p = 1 + rho, momentum_rate(rho) if p is None else p
    alpha, beta = (1 + p) / L, p**2 / (2 - p)
    gamma, delta = p**2 / ((1 + p) * (2 - p)), p**2 / (1 - p**2)
    for _ in range(steps):
        y = (1 + gamma) * now - gamma * before
        gradient, value = energy.oracle(y)
        before, now = now, (1 + beta) * now - beta * before - alpha * gradient
        yield y, gradient, value, (1 + delta) * now - delta * before


def lyapunov_step(rho, weight=1.0) -> float:
    """The largest V after a step with V <= 1 before it, over p^2.

    ``V = f(y) - f* - |grad f(y)|^2/(2 L) - |y - x* - grad f(y)/L|^2/(2 (1 - 1/L)) + weight |x - x*|^2/(1 - 1/L)``,
    y the last point where the gradient was taken and x the output after it: L = 1 + rho, the convexity is 1.
    """
    problem, energy, least = convex_energy(rho)
    start = (problem.set_initial_point(), problem.set_initial_point())
    L = 1 + rho
    before, after = (
        value
        - energy(least)
        - gradient**2 / (2 * L)
        - (y - least - gradient / L) ** 2 / (2 * (1 - 1 / L))
        + weight / (1 - 1 / L) * (x - least) ** 2
        for y, gradient, value, x in triple_momentum(energy, *start, rho, 2)
    )
    problem.set_initial_condition(before <= 1)
    problem.set_performance_metric(after / momentum_rate(rho) ** 2)
    return worst_case(problem)


@for_each_rho
def test_a_step_of_the_triple_momentum_method_shrinks_a_lyapunov_function_by_exactly_p_squared(rho):
    """So |x_n - x*| <= C p^n from any start: all but the last term of V together are >= 0 on the class."""
    assert lyapunov_step(rho) == pytest.approx(1, abs=TOLERANCE)


@pytest.mark.parametrize("weight", [0.5, 0.9, 1.1])
def test_with_another_weight_it_shrinks_by_less(weight):
    assert lyapunov_step(1.2, weight) == pytest.approx(max(weight, 1 / weight), abs=TOLERANCE)


def after_steps(rho, steps, p=None) -> float:
    """The largest |x_n - x*|^2 from xi_0 = xi_{-1} with |xi_0 - x*| <= 1, over p^(2 n)."""
    problem, energy, least = convex_energy(rho)
    start = problem.set_initial_point()
    problem.set_initial_condition((start - least) ** 2 <= 1)
    *_, (_, _, _, x) = triple_momentum(energy, start, start, rho, steps, p)
    problem.set_performance_metric((x - least) ** 2 / momentum_rate(rho) ** (2 * steps))
    return worst_case(problem)


#: As far as p^(2 n) >= 1e-5: beyond, errors of the solver count 1e5 times.
STEPS = [(rho, n) for rho in RHOS for n in range(1, 7) if momentum_rate(rho) ** (2 * n) >= 1e-5]


@pytest.mark.parametrize(("rho", "steps"), STEPS)
def test_from_rest_the_worst_error_after_n_steps_of_momentum_is_sqrt_1_plus_rho_times_p_to_the_n(rho, steps):
    """So the ratio of successive worst cases is p from the first step on."""
    assert after_steps(rho, steps) == pytest.approx(1 + rho, rel=TOLERANCE)


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_with_the_parameters_of_another_p_the_worst_error_shrinks_by_less_than_p_a_step(share):
    third, fourth = (after_steps(5.7, steps, share * momentum_rate(5.7)) for steps in (3, 4))
    assert fourth > 1.1 * third


@for_each_rho
def test_momentum_is_faster_than_every_constant_theta(rho):
    assert momentum_rate(rho) < evaluate_sharp(EnergyConstants(rho=rho)).factor_proved.value
