"""The algebra of the theorem in energy norms, for all admissible constants at once.

The functions of ``ndtheory.energy_norms`` are called with symbols.  Writing ``sqrt(rho) = s`` and ``kappa_2 = e (s +
kappa_1 + e)`` with e >= 0 reaches every kappa_2 >= 0 once and turns r into ``s + kappa_1 + e``: all that follows is
rational.  An equality is a difference whose numerator expands to 0; an inequality has a certificate, a quotient of
polynomials in quantities >= 0 without one negative coefficient.  Each check refutes a formula with a sign or a factor
changed.
"""

import sympy as sp
from energy_symbols import (
    DATA,
    FRICTION,
    RATIO,
    SLOPE,
    TURN,
    VERTEX,
    d,
    e,
    g,
    kappa_1,
    kappa_2,
    never_negative,
    plain,
    positive,
    r,
    rho,
    right_side,
    s,
    theta,
    x,
    zero,
)

from ndtheory import energy_norms

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
    found = energy_norms.largest_ratio(rho, kappa_1, k2) - s - kappa_1
    assert zero(sp.expand(found * (found + s + kappa_1)) - k2)
    assert not zero(sp.expand(found * (found + s - kappa_1)) - k2)


def test_r_squared_is_sqrt_rho_plus_kappa_1_times_r_plus_kappa_2():
    """In symbols that hide no root: any rho, kappa_1, kappa_2."""
    any_rho, k1, k2 = sp.symbols("rho k1 k2", positive=True)
    root = energy_norms.largest_ratio(any_rho, k1, k2)
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
    ratio = energy_norms.largest_ratio(root**2, k1, k2)
    here = {root: s, k1: kappa_1, k2: kappa_2}
    for symbol in (root, k1):
        assert zero(sp.diff(ratio, symbol).subs(here) - r / (2 * r - s - kappa_1))
        assert not zero(sp.diff(ratio, symbol).subs(here) - r / (2 * r + s - kappa_1))
    assert zero(sp.diff(ratio, k2).subs(here) - 1 / (2 * r - s - kappa_1))
    assert positive(1 / (2 * r - s - kappa_1))
    assert not positive(1 / (2 * r - s - 3 * kappa_1))


# --- f and the quadratic -------------------------------------------------------------------------------------------


def test_the_work_at_r_is_minus_sqrt_rho_r():
    assert zero(energy_norms.work(RATIO, *FRICTION) + s * r)
    assert not zero(energy_norms.work(RATIO, *FRICTION) + rho * r)
    assert not zero(energy_norms.work(RATIO, *FRICTION) - s * r)


def test_the_largest_work_is_kappa_2_plus_a_quarter_of_kappa_1_squared_at_half_kappa_1_below_r():
    number = energy_norms.friction_number(*FRICTION)
    assert zero(number - energy_norms.work(x, *FRICTION) - (x - kappa_1 / 2) ** 2)
    assert not zero(number - energy_norms.work(x, *FRICTION) - (x + kappa_1 / 2) ** 2)
    assert not zero(kappa_2 + kappa_1**2 / 2 - energy_norms.work(x, *FRICTION) - (x - kappa_1 / 2) ** 2)
    assert positive(RATIO - kappa_1 / 2)
    assert not positive(RATIO - 2 * kappa_1)


def test_at_r_the_right_hand_side_is_a_square():
    assert zero(right_side(RATIO) - (1 - theta * (1 + s * r)) ** 2)
    assert not zero(right_side(RATIO) - (1 - theta * (1 + rho * r)) ** 2)
    assert not zero(right_side(RATIO) - (1 - theta * (1 - s * r)) ** 2)
    assert zero(1 - right_side(RATIO) - energy_norms.one_minus_end(theta, *DATA))
    assert not zero(1 + right_side(RATIO) - energy_norms.one_minus_end(theta, *DATA))


def test_the_vertex_and_its_value_are_those_of_the_branch_inside(monkeypatch):
    slope = lambda at: sp.diff(right_side(x), x).subs(x, at)
    assert zero(slope(VERTEX))
    assert not zero(slope(2 * VERTEX))
    assert zero(1 - right_side(VERTEX) - energy_norms.one_minus_inside(theta, *DATA))
    assert not zero(1 - right_side(-VERTEX) - energy_norms.one_minus_inside(theta, *DATA))
    assert not zero(1 - right_side(VERTEX / 2) - energy_norms.one_minus_inside(theta, *DATA))
    monkeypatch.setattr(energy_norms, "turning_theta", lambda *data: sp.oo)  # every theta is below it
    assert zero(energy_norms.worst_ratio(theta, *DATA) - VERTEX)
    assert zero(energy_norms.one_minus_square(theta, *DATA) - 1 + right_side(VERTEX))
    monkeypatch.setattr(energy_norms, "turning_theta", lambda *data: sp.S.Zero)  # every theta is above it
    assert zero(energy_norms.worst_ratio(theta, *DATA) - RATIO)
    assert zero(energy_norms.one_minus_square(theta, *DATA) - 1 + right_side(RATIO))


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
    end, inside = (
        f(theta, *DATA).subs(theta, TURN) for f in (energy_norms.one_minus_end, energy_norms.one_minus_inside)
    )
    assert zero(end - inside)
    assert not zero(end + inside)
    assert not zero(end - energy_norms.one_minus_inside(theta, rho, kappa_1, 2 * kappa_2).subs(theta, TURN))


def test_at_the_turning_theta_the_quadratic_is_level_at_r():
    slope = sp.diff(right_side(x), x).subs(x, r)
    assert zero(slope.subs(theta, TURN))
    assert not zero(slope.subs(theta, TURN / 2))


def test_with_kappa_1_q_has_no_kink_at_the_turning_theta_and_without_it_has_one():
    end = sp.diff(plain(energy_norms.one_minus_end(theta, *DATA)), theta)
    inside = energy_norms.slope_inside(theta, *DATA)
    assert zero((end - inside).subs(theta, TURN))
    assert not zero((end + inside).subs(theta, TURN))
    frictionless = [
        sp.diff(f(theta, rho, 0, 0), theta) for f in (energy_norms.one_minus_end, energy_norms.one_minus_inside)
    ]
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
    """q^2 grows there already: it has no kink, and this is its slope from there on."""
    slope = -sp.diff(energy_norms.one_minus_end(theta, *DATA), theta).subs(theta, TURN)
    assert positive(slope)
    assert not positive(-slope)
