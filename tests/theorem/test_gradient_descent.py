"""Without friction q is the rate of gradient descent; momentum has a faster one.  Both beside performance estimation.

Step III is a gradient step of length theta for an energy that is 1-strongly convex and (1 + rho)-smooth.  PEPit finds
the worst function of that class by a semidefinite program whose value is exact (Taylor, Hendrickx, Glineur 2017), and
knows nothing of contact.  A solver that stops early is no oracle and no refutation: the next attempt decides, and the
tolerance of the test follows from the one that came through.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING

import pytest

from ndtheory import EnergyConstants, evaluate_energy

if TYPE_CHECKING:  # it takes half a second, which is spent where one of these tests runs
    from PEPit import PEP

#: Tried in this order until one says that it has solved the program: the solver, and the tolerance it is given.  Which
#: programs Clarabel solves to 1e-9 hangs on the last digit, and so on the kernels of the BLAS; of 380 programs, each
#: with rho moved by up to 1e-9, it solved 342 to 1e-9 and all to 1e-8.
ATTEMPTS = [("CLARABEL", 1e-9), ("CLARABEL", 1e-8), ("SCS", 1e-8)]
OPTIONS = {"CLARABEL": ("tol_gap_abs", "tol_gap_rel", "tol_feas"), "SCS": ("eps_abs", "eps_rel")}

#: The gap is one part of a solver's error, feasibility the other: values came out to 130 times the tolerance.
MARGIN = 1000

RHOS = [0.1, 0.47, 1.2, 5.7]
for_each_rho = pytest.mark.parametrize("rho", RHOS)


class NoSolverCouldError(RuntimeError):
    """Every attempt stopped early: nothing was refuted, and nothing was shown."""


@dataclass(frozen=True, kw_only=True)
class Worst:
    """The worst case of a class of functions, and what the solver that found it may be wrong by, relative above 1."""

    value: float
    tolerance: float

    def is_near(self, expected: float) -> bool:
        return abs(self.value - expected) <= self.tolerance * max(1, abs(expected))


def both_sides(problem: PEP, solver: str, tolerance: float) -> tuple[float, float]:
    """The bound from above and the example from below; RuntimeError from a solver that stops before its tolerance."""
    from cvxpy.error import SolverError

    options = dict.fromkeys(OPTIONS[solver], tolerance) | {"wrapper": "cvxpy", "solver": solver, "verbose": 0}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            above, below = (problem.solve(**options, return_primal_or_dual=side) for side in ("dual", "primal"))
        except (SolverError, UserWarning) as stopped:  # failed; or a solution that it calls inaccurate
            raise RuntimeError(f"{solver} at {tolerance:g}: {str(stopped).splitlines()[0]}") from stopped
    if above is None or below is None:
        raise RuntimeError(f"{solver} at {tolerance:g}: the program has no finite value")
    return above, below


def worst_case(problem: PEP, scale: float = 1, attempts=ATTEMPTS) -> Worst:
    """The performance metric at its largest, over `scale`; the bound from above and the example from below agree."""
    stopped = []
    for solver, tolerance in attempts:
        try:
            above, below = both_sides(problem, solver, tolerance)
        except RuntimeError as error:
            stopped.append(str(error))
            continue
        found = Worst(value=above / scale, tolerance=MARGIN * tolerance)
        assert found.is_near(below / scale)
        return found
    raise NoSolverCouldError("; ".join(stopped))


def convex_energy(rho):
    """A problem, its energy, and where that is least."""
    from PEPit import PEP
    from PEPit.functions import SmoothStronglyConvexFunction

    problem = PEP()
    energy = problem.declare_function(SmoothStronglyConvexFunction, mu=1, L=1 + rho)
    return problem, energy, energy.stationary_point()


# --- gradient descent ----------------------------------------------------------------------------------------------


def gradient_step(rho, theta) -> Worst:
    """The largest |x_1 - x*|^2 with |x_0 - x*| <= 1."""
    problem, energy, least = convex_energy(rho)
    start = problem.set_initial_point()
    problem.set_initial_condition((start - least) ** 2 <= 1)
    problem.set_performance_metric((start - theta * energy.gradient(start) - least) ** 2)
    return worst_case(problem)


@for_each_rho
@pytest.mark.parametrize("place", [0.1, 0.9, 1.0, 1.5, 1.9])
def test_a_gradient_step_contracts_by_q_and_no_better(rho, place):
    """On both branches: from 0 to 2/(2 + rho) as place goes to 1, from there to the end of the interval up to 2."""
    bounds = evaluate_energy(EnergyConstants(rho=rho))
    best, end = bounds.theta_predicted, bounds.interval[1]
    theta = place * best if place <= 1 else best + (place - 1) * (end - best)
    q = evaluate_energy(EnergyConstants(rho=rho), theta).factor.value
    found = gradient_step(rho, theta)
    assert found.is_near(q**2)
    for wrong in (0.99 * q, 1.01 * q, min(1 - theta, abs(1 - theta - theta * rho)) if place != 1 else 1):
        assert not found.is_near(wrong**2)


@for_each_rho
def test_the_best_gradient_step_contracts_by_rho_over_2_plus_rho(rho):
    bounds = evaluate_energy(EnergyConstants(rho=rho))
    assert bounds.theta_proved == bounds.theta_predicted == pytest.approx(2 / (2 + rho), rel=1e-15)
    best = gradient_step(rho, bounds.theta_proved)
    assert best.is_near((rho / (2 + rho)) ** 2)
    for beside in (gradient_step(rho, share * bounds.theta_proved) for share in (0.99, 1.01)):
        assert beside.value - best.value > beside.tolerance + best.tolerance


@pytest.mark.parametrize("rho", [1.2, 5.7])
def test_at_the_end_of_the_interval_a_gradient_step_need_not_contract(rho):
    end = evaluate_energy(EnergyConstants(rho=rho)).interval[1]
    assert gradient_step(rho, end).is_near(1)
    assert gradient_step(rho, 1.01 * end).value > 1 + 1e-3


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


def lyapunov_step(rho, weight=1.0) -> Worst:
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
    assert lyapunov_step(rho).is_near(1)


@pytest.mark.parametrize("weight", [0.5, 0.9, 1.1])
def test_with_another_weight_it_shrinks_by_less(weight):
    assert lyapunov_step(1.2, weight).is_near(max(weight, 1 / weight))


def after_steps(rho, steps, p=None, attempts=ATTEMPTS) -> Worst:
    """The largest |x_n - x*|^2 from xi_0 = xi_{-1} with |xi_0 - x*| <= 1, over p^(2 n).

    The program has half of that factor, so that neither its value nor its multipliers are 1e5 times the other.
    """
    problem, energy, least = convex_energy(rho)
    start = problem.set_initial_point()
    problem.set_initial_condition((start - least) ** 2 <= 1)
    *_, (_, _, _, x) = triple_momentum(energy, start, start, rho, steps, p)
    half = momentum_rate(rho) ** steps
    problem.set_performance_metric((x - least) ** 2 / half)
    return worst_case(problem, scale=half, attempts=attempts)


#: As far as p^(2 n) >= 1e-5: beyond, errors of the solver count more than sqrt(1e5) times.
STEPS = [(rho, n) for rho in RHOS for n in range(1, 7) if momentum_rate(rho) ** (2 * n) >= 1e-5]


@pytest.mark.parametrize(("rho", "steps"), STEPS)
def test_from_rest_the_worst_error_after_n_steps_of_momentum_is_sqrt_1_plus_rho_times_p_to_the_n(rho, steps):
    """So the ratio of successive worst cases is p from the first step on."""
    assert after_steps(rho, steps).is_near(1 + rho)


def test_a_solver_that_stops_hands_over_to_the_next_whose_tolerance_is_the_test_s():
    second = after_steps(1.2, 2, attempts=[("CLARABEL", 1e-17), ("SCS", 1e-7)])
    assert second.tolerance == pytest.approx(1e-4, rel=1e-12)
    assert second.is_near(2.2)
    assert not second.is_near(2.2 * 1.001)


def test_that_every_solver_stops_is_not_told_as_a_claim_refuted():
    with pytest.raises(NoSolverCouldError, match=r"^CLARABEL at 1e-17: .+; CLARABEL at 1e-18: .+$"):
        after_steps(1.2, 2, attempts=[("CLARABEL", 1e-17), ("CLARABEL", 1e-18)])


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_with_the_parameters_of_another_p_the_worst_error_shrinks_by_less_than_p_a_step(share):
    third, fourth = (after_steps(5.7, steps, share * momentum_rate(5.7)) for steps in (3, 4))
    assert fourth.value > 1.1 * third.value


@for_each_rho
def test_momentum_is_faster_than_every_constant_theta(rho):
    assert momentum_rate(rho) < evaluate_energy(EnergyConstants(rho=rho)).factor_proved.value
