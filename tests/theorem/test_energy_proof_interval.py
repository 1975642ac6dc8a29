"""The algebra of the theorem in energy norms: where q is below 1, and the theta where it is least."""

import sympy as sp
from energy_symbols import (
    DATA,
    FRICTION,
    SLOPE,
    VERTEX,
    d,
    e,
    kappa_1,
    kappa_2,
    never_negative,
    positive,
    rho,
    right_side,
    s,
    theta,
    x,
    zero,
)

from ndtheory import energy_norms

# --- where q is below 1 --------------------------------------------------------------------------------------------


def line(at, theta):
    """The line in theta whose sign is that of q^2 - 1 at one x."""
    f = energy_norms.work(at, *FRICTION)
    return 2 * (f - 1) + theta * (1 - 2 * f + rho * at**2)


def test_the_quadratic_is_below_1_where_a_line_in_theta_is_negative():
    assert zero(right_side(x) - 1 - theta * line(x, theta))
    assert not zero(right_side(x) - 1 - line(x, theta))
    assert not zero(right_side(x) - 1 - theta * line(x, -theta))
    assert sp.Poly(line(x, theta), theta).degree() == 1


def test_a_maximum_of_lines_is_below_0_on_one_interval():
    """Between two thetas a line is below its larger end: their means bound it."""
    p, q, share = sp.symbols("p q share", real=True)
    between = share * p + (1 - share) * q
    assert zero(line(x, between) - share * line(x, p) - (1 - share) * line(x, q))
    assert not zero(right_side(x, between) - share * right_side(x, p) - (1 - share) * right_side(x, q))


def test_small_thetas_contract_if_the_friction_number_is_below_1():
    """The highest line at theta = 0."""
    highest = energy_norms.friction_number(*FRICTION)
    assert zero(2 * (highest - 1) - line(kappa_1 / 2, 0))
    assert not zero(highest - 1 - line(kappa_1 / 2, 0))
    assert zero(2 * (highest - 1) - line(x, 0) - 2 * (x - kappa_1 / 2) ** 2)


def test_the_quadratic_solved_for_the_interval_is_the_highest_line_times_2_minus_2_plus_rho_theta():
    a, b, c = energy_norms.end_quadratic(*DATA)
    solved = a * theta**2 + b * theta + c
    highest = -energy_norms.one_minus_inside(theta, *DATA) / theta
    assert zero(solved - highest * (2 - (2 + rho) * theta))
    assert not zero(solved + highest * (2 - (2 + rho) * theta))
    assert not zero(solved - highest * (2 - rho * theta))
    assert not zero(a * theta**2 - b * theta + c - highest * (2 - (2 + rho) * theta))
    assert zero(highest - line(VERTEX, theta))


def test_the_quadratic_solved_for_the_interval_tells_the_friction_number_at_0_and_has_a_short_discriminant():
    a, b, c = energy_norms.end_quadratic(*DATA)
    assert zero(c - 4 * (energy_norms.friction_number(*FRICTION) - 1))
    assert not zero(c - 2 * (energy_norms.friction_number(*FRICTION) - 1))
    assert zero(b**2 - 4 * a * c - 4 * ((1 + rho * (1 - kappa_2)) ** 2 - rho * kappa_1**2))
    assert not zero(b**2 - 4 * a * c - 4 * ((1 + rho * (1 - kappa_2)) ** 2 + rho * kappa_1**2))


def test_at_the_friction_threshold_small_thetas_contract_if_sqrt_rho_kappa_1_is_below_2():
    """c = 0 leaves theta (a theta + b), and then 1 - kappa_2 = kappa_1^2/4."""
    _, b, c = energy_norms.end_quadratic(*DATA)
    assert zero(b + 2 * c - 2 * (rho * (1 - kappa_2) - 1))
    assert not zero(b - 2 * c - 2 * (rho * (1 - kappa_2) - 1))
    assert zero(rho * (1 - kappa_2) - 1 + rho * c / 4 - (rho * kappa_1**2 / 4 - 1))


def test_without_kappa_1_the_quadratic_solved_for_the_interval_has_the_turning_theta_as_a_second_root():
    """There h (2 - (2 + rho) theta) vanishes, but h in general does not."""
    a, b, c = (value.subs(kappa_1, 0) for value in energy_norms.end_quadratic(*DATA))
    at = 2 / (2 + rho)
    assert zero(a * at**2 + b * at + c)
    assert not zero((1 - 2 * (1 - kappa_2.subs(kappa_1, 0))) * at + 2 * (1 - kappa_2.subs(kappa_1, 0)))


def test_from_the_turning_theta_on_q_is_below_1_up_to_2_over_1_plus_sqrt_rho_r():
    gain = lambda at: energy_norms.one_minus_end(at, *DATA)
    assert zero(gain(2 / SLOPE))
    assert not zero(gain(1 / SLOPE))
    assert positive(gain(2 / SLOPE / (1 + d)))
    assert positive(-gain(2 / SLOPE * (1 + d)))


# --- the best theta ------------------------------------------------------------------------------------------------


def test_the_slope_inside_is_the_derivative_of_the_branch_inside():
    derivative = sp.diff(energy_norms.one_minus_inside(theta, *DATA), theta)
    assert zero(derivative - energy_norms.slope_inside(theta, *DATA))
    assert not zero(derivative + energy_norms.slope_inside(theta, *DATA))
    assert not zero(derivative - energy_norms.slope_inside(theta, rho, 2 * kappa_1, kappa_2))
    frictionless = sp.diff(energy_norms.one_minus_inside(theta, rho, 0, kappa_2), theta)
    assert zero(frictionless - energy_norms.slope_inside(theta, rho, 0, kappa_2))


def test_q_at_most_c_is_an_interval_of_theta_for_each_c_up_to_1():
    """With tau = theta/(1 - theta) and u = 1/tau: for each x a quadratic in u with the coefficient 1 - c >= 0 of u^2.

    So it is convex in u: at a mean of two u it is at most the mean, and u falls with theta.
    """
    u, c = sp.symbols("u c", positive=True)
    f = energy_norms.work(x, *FRICTION)
    convex = lambda u: (1 - c) * u**2 + 2 * (f - c) * u + rho * x**2 - c
    excess = right_side(x, 1 / (1 + u)) - c
    assert zero(excess * (1 + u) ** 2 - convex(u))
    assert not zero(excess * (1 + u) ** 2 - convex(-u))
    assert not zero(excess * (1 + u) - convex(u))
    p, q, share = sp.symbols("p q share", positive=True)
    missing = share * convex(p) + (1 - share) * convex(q) - convex(share * p + (1 - share) * q)
    assert zero(missing - (1 - c) * share * (1 - share) * (p - q) ** 2)
    assert not zero(missing - (1 + c) * share * (1 - share) * (p - q) ** 2)


def test_where_q_is_below_1_the_logarithm_of_1_minus_q_squared_is_concave_so_q_has_one_minimum():
    """1 - q^2 = theta H with -H a maximum of lines, so H'' <= 0; here on the branch inside, theta = 2/(2 + rho + d).

    (log (theta H))'' = -1/theta^2 + H''/H - (H'/H)^2: three terms, none positive, the first negative.
    """
    H = sp.cancel(energy_norms.one_minus_inside(theta, *DATA) / theta)
    bend = sp.diff(H, theta, 2)
    assert zero(bend + 2 * kappa_1**2 * rho**2 / (2 - (2 + rho) * theta) ** 3)
    assert not zero(bend - 2 * kappa_1**2 * rho**2 / (2 - (2 + rho) * theta) ** 3)
    assert never_negative(-bend.subs(theta, 2 / (2 + rho + d)))
    assert not never_negative(bend.subs(theta, 2 / (2 + rho + d)))
    any_H = sp.Function("H")(theta)
    second = sp.diff(sp.log(theta * any_H), theta, 2)
    terms = -1 / theta**2 + any_H.diff(theta, 2) / any_H - (any_H.diff(theta) / any_H) ** 2
    assert zero(second - terms)
    assert not zero(second - terms - 2 / theta**2)


# --- more friction, a stiffer contact body -------------------------------------------------------------------------


def test_at_fixed_x_the_quadratic_grows_with_rho_and_with_both_kappas():
    """theta = 1/(1 + d), x = e >= 0; r grows too, as shown above."""
    any_rho, k1, k2 = sp.symbols("rho k1 k2")
    square = energy_norms.square_at(e, 1 / (1 + d), any_rho, k1, k2)
    for symbol in (any_rho, k1, k2):
        assert never_negative(sp.diff(square, symbol))
        assert not never_negative(-sp.diff(square, symbol))


def test_the_friction_multiple_makes_the_friction_number_1():
    k1, k2 = sp.symbols("k1 k2", positive=True)
    reached = lambda t: sp.radsimp(energy_norms.friction_number(t * k1, t * k2)) - 1
    t = energy_norms.friction_multiple(k1, k2)
    assert zero(reached(t))
    assert not zero(reached(t / 2))
    assert not zero(reached(2 / (k2 + sp.sqrt(k2**2 + k1))))
    assert energy_norms.friction_multiple(k1, 0) == 2 / k1
    assert energy_norms.friction_multiple(0, k2) == 1 / k2


# --- without friction ----------------------------------------------------------------------------------------------


def test_without_friction_the_formulas_are_those_of_gradient_descent():
    none = (rho, sp.S.Zero, sp.S.Zero)
    best, rate = energy_norms.predicted_theta(rho), energy_norms.predicted_rate(rho)
    assert zero(energy_norms.largest_ratio(*none) - s)
    assert zero(energy_norms.turning_theta(*none) - best)
    assert not zero(energy_norms.turning_theta(*none) - 2 / (1 + rho))
    assert zero(1 - energy_norms.one_minus_inside(theta, *none) - (1 - theta) ** 2)
    assert not zero(1 - energy_norms.one_minus_inside(theta, *none) - (1 - theta))
    assert zero(1 - energy_norms.one_minus_end(theta, *none) - (1 - theta - theta * rho) ** 2)
    assert not zero(1 - energy_norms.one_minus_end(theta, *none) - (1 - theta + theta * rho) ** 2)
    for branch in (energy_norms.one_minus_inside, energy_norms.one_minus_end):
        assert zero(1 - branch(best, *none) - rate**2)
        assert not zero(1 - branch(best, *none) - rate)
    assert zero(energy_norms.one_minus_end(2 / (1 + rho), *none))
    assert not zero(energy_norms.one_minus_inside(2 / (1 + rho), *none))


def test_without_friction_the_end_branch_is_the_larger_exactly_above_2_over_2_plus_rho():
    """The difference of the squares has the sign of theta - 2/(2 + rho)."""
    larger = (1 - theta - theta * rho) ** 2 - (1 - theta) ** 2
    multiple = theta * rho * (2 + rho)
    assert zero(larger - multiple * (theta - energy_norms.predicted_theta(rho)))
    assert not zero(larger + multiple * (theta - energy_norms.predicted_theta(rho)))
    assert positive(multiple.subs(theta, d))


def test_without_friction_q_falls_to_2_over_2_plus_rho_and_grows_from_there():
    none = (rho, sp.S.Zero, sp.S.Zero)
    best = energy_norms.predicted_theta(rho)
    assert positive(energy_norms.slope_inside(best / (1 + d), *none))
    assert positive(-sp.diff(energy_norms.one_minus_end(theta, *none), theta).subs(theta, best * (1 + d)))
    assert not positive(-energy_norms.slope_inside(best / (1 + d), *none))
    assert positive(energy_norms.predicted_theta(rho))
    assert positive(1 - energy_norms.predicted_rate(rho))
