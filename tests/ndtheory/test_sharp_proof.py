"""The algebra of the theorem in energy norms, for all admissible constants at once.

The functions of ``ndtheory.sharp`` are called with symbols.  Writing ``sqrt(rho) = s`` and ``kappa_2 = e (s + kappa_1 +
e)`` with e >= 0 reaches every kappa_2 >= 0 once and turns r into ``s + kappa_1 + e``: all that follows is rational.  An
equality is a difference whose numerator expands to 0; an inequality has a certificate, a quotient of polynomials in
quantities >= 0 without one negative coefficient.  Each check refutes a formula with a sign or a factor changed.
"""

import pytest
import sympy as sp

from ndtheory import sharp

s, d = sp.symbols("s d", positive=True)  # d: any further amount > 0
kappa_1, e, g = sp.symbols("kappa_1 e g", nonnegative=True)
theta = sp.Symbol("theta", positive=True)
x = sp.Symbol("x", real=True)

rho = s**2
r = s + kappa_1 + e
kappa_2 = e * r
DATA = (rho, kappa_1, kappa_2)
FRICTION = (kappa_1, kappa_2)


def plain(expression):
    """The same with every root of a square taken."""
    is_root = lambda term: term.is_Pow and abs(term.exp) == sp.Rational(1, 2)
    return sp.sympify(expression).replace(is_root, lambda term: sp.sqrt(sp.factor(term.base)) ** (2 * term.exp))


def quotient(expression):
    """Numerator and denominator without a common factor, expanded."""
    return tuple(map(sp.expand, sp.fraction(sp.cancel(plain(expression)))))


def zero(expression) -> bool:
    """Whether an expression vanishes identically."""
    return sp.expand(sp.fraction(sp.together(plain(expression)))[0]) == 0


def certified(polynomial) -> bool:
    """Whether it is a polynomial in quantities >= 0 without a negative coefficient."""
    known = (s, d, kappa_1, e, g)
    return polynomial.free_symbols <= set(known) and min(sp.Poly(polynomial, *known).coeffs()) >= 0


def above_zero(polynomial) -> bool:
    """Whether, besides, one of its terms consists of quantities > 0 alone."""
    return certified(polynomial) and polynomial.subs({kappa_1: 0, e: 0, g: 0}) != 0


def never_negative(expression) -> bool:
    numerator, denominator = quotient(expression)
    return certified(numerator) and above_zero(denominator)


def positive(expression) -> bool:
    return all(map(above_zero, quotient(expression)))


RATIO = plain(sharp.largest_ratio(*DATA))
TURN = sp.cancel(plain(sharp.turning_theta(*DATA)))
VERTEX = (1 - theta) * kappa_1 / (2 - (2 + rho) * theta)
SLOPE = 1 + s * r  # of |1 - theta (1 + sqrt(rho) r)| in theta


def right_side(at, theta=theta, rho=rho):
    return sharp.square_at(at, theta, rho, *FRICTION)


# --- the checks themselves -----------------------------------------------------------------------------------------


def test_the_checks_tell_zero_positive_and_neither_apart():
    assert zero((s + e) ** 2 - s**2 - 2 * s * e - e**2)
    assert not zero(s - e)
    assert positive((s + e) / (1 + kappa_1))
    assert never_negative(e)
    assert not positive(e)
    assert not positive(s - e)
    assert not never_negative((s - e) / (s + 1))
    assert not never_negative(1 / (s - e))
    assert not never_negative(1 / e)
    assert not never_negative(x)


# --- r -------------------------------------------------------------------------------------------------------------


def test_every_kappa_2_from_0_on_is_reached_once():
    """It is 0 at e = 0, grows with e, and the e found from it is r - s - kappa_1."""
    k2 = sp.Symbol("kappa_2", nonnegative=True)
    assert kappa_2.subs(e, 0) == 0
    assert positive(sp.diff(kappa_2, e))
    found = sharp.largest_ratio(rho, kappa_1, k2) - s - kappa_1
    assert zero(sp.expand(found * (found + s + kappa_1)) - k2)
    assert not zero(sp.expand(found * (found + s - kappa_1)) - k2)


def test_r_squared_is_sqrt_rho_plus_kappa_1_times_r_plus_kappa_2():
    """In symbols that hide no root: any rho, kappa_1, kappa_2."""
    any_rho, k1, k2 = sp.symbols("rho k1 k2", positive=True)
    root = sharp.largest_ratio(any_rho, k1, k2)
    assert zero(sp.expand(root**2 - (sp.sqrt(any_rho) + k1) * root - k2))
    assert not zero(sp.expand(root**2 - (any_rho + k1) * root - k2))
    assert not zero(sp.expand(root**2 - (sp.sqrt(any_rho) + k1) * root + k2))
    assert zero(RATIO - r)
    assert not zero(RATIO - (r - e))


def test_no_x_above_r_satisfies_the_inequality_that_bounds_x():
    """x^2 - (sqrt(rho) + kappa_1) x - kappa_2 > 0 at x = r + d, and <= 0 from 0 to r."""
    excess = lambda x: x**2 - (s + kappa_1) * x - kappa_2
    assert positive(excess(RATIO + d))
    assert never_negative(-excess(RATIO / (1 + g)))
    assert not positive(excess(RATIO / 2 + d))
    assert not never_negative(-excess(RATIO * (1 + g)))


def test_r_grows_with_rho_and_with_both_kappas():
    """By the equation of r: r' (2 r - s - kappa_1) = (s' + kappa_1') r + kappa_2'."""
    root, k1, k2 = sp.symbols("root k1 k2", positive=True)
    ratio = sharp.largest_ratio(root**2, k1, k2)
    here = {root: s, k1: kappa_1, k2: kappa_2}
    for symbol in (root, k1):
        assert zero(sp.diff(ratio, symbol).subs(here) - r / (2 * r - s - kappa_1))
        assert not zero(sp.diff(ratio, symbol).subs(here) - r / (2 * r + s - kappa_1))
    assert zero(sp.diff(ratio, k2).subs(here) - 1 / (2 * r - s - kappa_1))
    assert positive(1 / (2 * r - s - kappa_1))
    assert not positive(1 / (2 * r - s - 3 * kappa_1))


# --- f and the quadratic -------------------------------------------------------------------------------------------


def test_the_work_at_r_is_minus_sqrt_rho_r():
    assert zero(sharp.work(RATIO, *FRICTION) + s * r)
    assert not zero(sharp.work(RATIO, *FRICTION) + rho * r)
    assert not zero(sharp.work(RATIO, *FRICTION) - s * r)


def test_the_largest_work_is_kappa_2_plus_a_quarter_of_kappa_1_squared_at_half_kappa_1_below_r():
    number = sharp.friction_number(*FRICTION)
    assert zero(number - sharp.work(x, *FRICTION) - (x - kappa_1 / 2) ** 2)
    assert not zero(number - sharp.work(x, *FRICTION) - (x + kappa_1 / 2) ** 2)
    assert not zero(kappa_2 + kappa_1**2 / 2 - sharp.work(x, *FRICTION) - (x - kappa_1 / 2) ** 2)
    assert positive(RATIO - kappa_1 / 2)
    assert not positive(RATIO - 2 * kappa_1)


def test_at_r_the_right_hand_side_is_a_square():
    assert zero(right_side(RATIO) - (1 - theta * (1 + s * r)) ** 2)
    assert not zero(right_side(RATIO) - (1 - theta * (1 + rho * r)) ** 2)
    assert not zero(right_side(RATIO) - (1 - theta * (1 - s * r)) ** 2)
    assert zero(1 - right_side(RATIO) - sharp.one_minus_end(theta, *DATA))
    assert not zero(1 + right_side(RATIO) - sharp.one_minus_end(theta, *DATA))


def test_the_vertex_and_its_value_are_those_of_the_branch_inside(monkeypatch):
    slope = lambda at: sp.diff(right_side(x), x).subs(x, at)
    assert zero(slope(VERTEX))
    assert not zero(slope(2 * VERTEX))
    assert zero(1 - right_side(VERTEX) - sharp.one_minus_inside(theta, *DATA))
    assert not zero(1 - right_side(-VERTEX) - sharp.one_minus_inside(theta, *DATA))
    assert not zero(1 - right_side(VERTEX / 2) - sharp.one_minus_inside(theta, *DATA))
    monkeypatch.setattr(sharp, "turning_theta", lambda *data: sp.oo)  # every theta is below it
    assert zero(sharp.worst_ratio(theta, *DATA) - VERTEX)
    assert zero(sharp.one_minus_square(theta, *DATA) - 1 + right_side(VERTEX))
    monkeypatch.setattr(sharp, "turning_theta", lambda *data: sp.S.Zero)  # every theta is above it
    assert zero(sharp.worst_ratio(theta, *DATA) - RATIO)
    assert zero(sharp.one_minus_square(theta, *DATA) - 1 + right_side(RATIO))


def test_below_2_over_2_plus_rho_the_quadratic_is_concave_and_from_there_on_it_grows():
    """Below: theta = 2/(2 + rho + d).  From there to 1: theta = (2 + g)/(2 + rho), rho = g + d."""
    concave = 2 / (2 + rho + d)
    assert positive(-sp.diff(right_side(x, concave), x, 2))
    assert not positive(-sp.diff(right_side(x, (2 + d) / (2 + rho)), x, 2))
    grows = sp.diff(right_side(x, (2 + g) / (2 + g + d), g + d), x)
    assert never_negative(grows.subs(x, e))
    assert not never_negative(grows.subs(x, -e))


# --- the turning theta ---------------------------------------------------------------------------------------------


def test_the_vertex_reaches_r_at_the_turning_theta_and_is_below_r_before_it():
    """r - x* is a positive multiple of theta_s - theta: with t = theta_s - theta in it, divided by t."""
    assert zero(VERTEX.subs(theta, TURN) - r)
    assert not zero(VERTEX.subs(theta, TURN) - 2 * r)
    multiple = ((2 + rho) * r - kappa_1) / (2 - (2 + rho) * theta)
    assert zero(r - VERTEX - multiple * (TURN - theta))
    assert not zero(r + VERTEX - multiple * (TURN - theta))
    assert positive((2 + rho) * r - kappa_1)
    assert not positive((2 - rho) * r - kappa_1)
    below = TURN / (1 + d)
    assert never_negative((1 - below) * kappa_1)
    assert positive(2 - (2 + rho) * below)
    assert not positive(2 - (3 + rho) * below)


def test_the_turning_theta_is_positive_below_1_and_at_most_2_over_2_plus_rho():
    assert positive(TURN)
    assert positive(1 - TURN)
    assert not positive(TURN - 1)
    assert never_negative(2 / (2 + rho) - TURN)
    assert not never_negative(2 / (3 + rho) - TURN)
    assert zero((2 / (2 + rho) - TURN).subs(kappa_1, 0))
    assert positive((2 / (2 + rho) - TURN).subs(kappa_1, kappa_1 + d))


def test_at_the_turning_theta_both_branches_have_the_same_value():
    end, inside = (f(theta, *DATA).subs(theta, TURN) for f in (sharp.one_minus_end, sharp.one_minus_inside))
    assert zero(end - inside)
    assert not zero(end + inside)
    assert not zero(end - sharp.one_minus_inside(theta, rho, kappa_1, 2 * kappa_2).subs(theta, TURN))


def test_at_the_turning_theta_the_quadratic_is_level_at_r():
    slope = sp.diff(right_side(x), x).subs(x, r)
    assert zero(slope.subs(theta, TURN))
    assert not zero(slope.subs(theta, TURN / 2))


def test_with_kappa_1_q_has_no_kink_at_the_turning_theta_and_without_it_has_one():
    end = sp.diff(plain(sharp.one_minus_end(theta, *DATA)), theta)
    inside = sharp.slope_inside(theta, *DATA)
    assert zero((end - inside).subs(theta, TURN))
    assert not zero((end + inside).subs(theta, TURN))
    frictionless = [sp.diff(f(theta, rho, 0, 0), theta) for f in (sharp.one_minus_end, sharp.one_minus_inside)]
    assert not zero((frictionless[0] - frictionless[1]).subs(theta, 2 / (2 + rho)))


def test_q_grows_from_the_turning_theta_on():
    """There ``theta (1 + sqrt(rho) r) > 1``, so the square root of the square is that less 1."""
    assert positive(TURN * SLOPE - 1)
    assert zero(TURN * SLOPE - 1 - s * r * (s + kappa_1 + 2 * e) / ((2 + rho) * r - kappa_1))
    assert not zero(TURN * SLOPE - 1 - s * r * (s - kappa_1 + 2 * e) / ((2 + rho) * r - kappa_1))
    assert not positive(TURN * SLOPE / 2 - 1)
    assert positive(sp.diff(right_side(RATIO), theta).subs(theta, TURN * (1 + d)))
    assert not positive(sp.diff(right_side(RATIO), theta).subs(theta, d))


def test_with_kappa_1_the_best_theta_is_below_the_turning_theta():
    """q^2 grows there already."""
    slope = sp.cancel(sharp.slope_inside(theta, *DATA).subs(theta, TURN))
    assert positive(-slope.subs(kappa_1, kappa_1 + d))
    assert not positive(slope.subs(kappa_1, kappa_1 + d))
    assert positive(-sp.diff(sharp.one_minus_end(theta, *DATA), theta).subs(theta, TURN))


# --- where q is below 1 --------------------------------------------------------------------------------------------


def line(at, theta):
    """The line in theta whose sign is that of q^2 - 1 at one x."""
    f = sharp.work(at, *FRICTION)
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
    highest = sharp.friction_number(*FRICTION)
    assert zero(2 * (highest - 1) - line(kappa_1 / 2, 0))
    assert not zero(highest - 1 - line(kappa_1 / 2, 0))
    assert zero(2 * (highest - 1) - line(x, 0) - 2 * (x - kappa_1 / 2) ** 2)


class Asked(Exception):
    """The coefficients of a polynomial whose roots were wanted."""


@pytest.fixture
def coefficients(monkeypatch):
    """a, b, c of the quadratic that `contraction_interval` solves."""

    def ask(a, b, c, *options):
        raise Asked(a, b, c)

    monkeypatch.setattr(sharp, "_roots", ask)
    with pytest.raises(Asked) as asked:
        sharp.contraction_interval(*DATA)
    return asked.value.args


def test_the_quadratic_solved_for_the_interval_is_the_highest_line_times_2_minus_2_plus_rho_theta(coefficients):
    a, b, c = coefficients
    solved = a * theta**2 + b * theta + c
    highest = -sharp.one_minus_inside(theta, *DATA) / theta
    assert zero(solved - highest * (2 - (2 + rho) * theta))
    assert not zero(solved + highest * (2 - (2 + rho) * theta))
    assert not zero(solved - highest * (2 - rho * theta))
    assert not zero(a * theta**2 - b * theta + c - highest * (2 - (2 + rho) * theta))
    assert zero(highest - line(VERTEX, theta))


def test_the_quadratic_solved_for_the_interval_tells_the_friction_number_at_0_and_has_a_short_discriminant(
    coefficients,
):
    a, b, c = coefficients
    assert zero(c - 4 * (sharp.friction_number(*FRICTION) - 1))
    assert not zero(c - 2 * (sharp.friction_number(*FRICTION) - 1))
    assert zero(b**2 - 4 * a * c - 4 * ((1 + rho * (1 - kappa_2)) ** 2 - rho * kappa_1**2))
    assert not zero(b**2 - 4 * a * c - 4 * ((1 + rho * (1 - kappa_2)) ** 2 + rho * kappa_1**2))


def test_at_the_friction_threshold_small_thetas_contract_if_sqrt_rho_kappa_1_is_below_2(coefficients):
    """c = 0 leaves theta (a theta + b), and then 1 - kappa_2 = kappa_1^2/4."""
    _, b, c = coefficients
    assert zero(b + 2 * c - 2 * (rho * (1 - kappa_2) - 1))
    assert not zero(b - 2 * c - 2 * (rho * (1 - kappa_2) - 1))
    assert zero(rho * (1 - kappa_2) - 1 + rho * c / 4 - (rho * kappa_1**2 / 4 - 1))


def test_without_kappa_1_the_quadratic_solved_for_the_interval_has_the_turning_theta_as_a_second_root(coefficients):
    """There h (2 - (2 + rho) theta) vanishes, but h in general does not."""
    a, b, c = (value.subs(kappa_1, 0) for value in coefficients)
    at = 2 / (2 + rho)
    assert zero(a * at**2 + b * at + c)
    assert not zero((1 - 2 * (1 - kappa_2.subs(kappa_1, 0))) * at + 2 * (1 - kappa_2.subs(kappa_1, 0)))


def test_from_the_turning_theta_on_q_is_below_1_up_to_2_over_1_plus_sqrt_rho_r():
    gain = lambda at: sharp.one_minus_end(at, *DATA)
    assert zero(gain(2 / SLOPE))
    assert not zero(gain(1 / SLOPE))
    assert positive(gain(2 / SLOPE / (1 + d)))
    assert positive(-gain(2 / SLOPE * (1 + d)))


# --- the best theta ------------------------------------------------------------------------------------------------


def test_the_slope_inside_is_the_derivative_of_the_branch_inside():
    derivative = sp.diff(sharp.one_minus_inside(theta, *DATA), theta)
    assert zero(derivative - sharp.slope_inside(theta, *DATA))
    assert not zero(derivative + sharp.slope_inside(theta, *DATA))
    assert not zero(derivative - sharp.slope_inside(theta, rho, 2 * kappa_1, kappa_2))
    frictionless = sp.diff(sharp.one_minus_inside(theta, rho, 0, kappa_2), theta)
    assert zero(frictionless - sharp.slope_inside(theta, rho, 0, kappa_2))


def test_q_at_most_c_is_an_interval_of_theta_for_each_c_up_to_1():
    """With tau = theta/(1 - theta) and u = 1/tau: for each x a quadratic in u with the coefficient 1 - c >= 0 of u^2.

    So it is convex in u: at a mean of two u it is at most the mean, and u falls with theta.
    """
    u, c = sp.symbols("u c", positive=True)
    f = sharp.work(x, *FRICTION)
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
    H = sp.cancel(sharp.one_minus_inside(theta, *DATA) / theta)
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
    square = sharp.square_at(e, 1 / (1 + d), any_rho, k1, k2)
    for symbol in (any_rho, k1, k2):
        assert never_negative(sp.diff(square, symbol))
        assert not never_negative(-sp.diff(square, symbol))


def test_the_friction_multiple_makes_the_friction_number_1():
    k1, k2 = sp.symbols("k1 k2", positive=True)
    reached = lambda t: sp.radsimp(sharp.friction_number(t * k1, t * k2)) - 1
    t = sharp.friction_multiple(k1, k2)
    assert zero(reached(t))
    assert not zero(reached(t / 2))
    assert not zero(reached(2 / (k2 + sp.sqrt(k2**2 + k1))))
    assert sharp.friction_multiple(k1, 0) == 2 / k1
    assert sharp.friction_multiple(0, k2) == 1 / k2


# --- without friction ----------------------------------------------------------------------------------------------


def test_without_friction_the_formulas_are_those_of_gradient_descent():
    none = (rho, sp.S.Zero, sp.S.Zero)
    best, rate = sharp.predicted_theta(rho), sharp.predicted_rate(rho)
    assert zero(sharp.largest_ratio(*none) - s)
    assert zero(sharp.turning_theta(*none) - best)
    assert not zero(sharp.turning_theta(*none) - 2 / (1 + rho))
    assert zero(1 - sharp.one_minus_inside(theta, *none) - (1 - theta) ** 2)
    assert not zero(1 - sharp.one_minus_inside(theta, *none) - (1 - theta))
    assert zero(1 - sharp.one_minus_end(theta, *none) - (1 - theta - theta * rho) ** 2)
    assert not zero(1 - sharp.one_minus_end(theta, *none) - (1 - theta + theta * rho) ** 2)
    for branch in (sharp.one_minus_inside, sharp.one_minus_end):
        assert zero(1 - branch(best, *none) - rate**2)
        assert not zero(1 - branch(best, *none) - rate)
    assert zero(sharp.one_minus_end(2 / (1 + rho), *none))
    assert not zero(sharp.one_minus_inside(2 / (1 + rho), *none))


def test_without_friction_the_end_branch_is_the_larger_exactly_above_2_over_2_plus_rho():
    """The difference of the squares has the sign of theta - 2/(2 + rho)."""
    larger = (1 - theta - theta * rho) ** 2 - (1 - theta) ** 2
    multiple = theta * rho * (2 + rho)
    assert zero(larger - multiple * (theta - sharp.predicted_theta(rho)))
    assert not zero(larger + multiple * (theta - sharp.predicted_theta(rho)))
    assert positive(multiple.subs(theta, d))


def test_without_friction_q_falls_to_2_over_2_plus_rho_and_grows_from_there():
    none = (rho, sp.S.Zero, sp.S.Zero)
    best = sharp.predicted_theta(rho)
    assert positive(sharp.slope_inside(best / (1 + d), *none))
    assert positive(-sp.diff(sharp.one_minus_end(theta, *none), theta).subs(theta, best * (1 + d)))
    assert not positive(-sharp.slope_inside(best / (1 + d), *none))
    assert positive(sharp.predicted_theta(rho))
    assert positive(1 - sharp.predicted_rate(rho))
