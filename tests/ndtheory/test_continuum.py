"""The bounds for the continuum: each formula derived again, each bound held against grids, meshes and fields."""

from dataclasses import replace
from decimal import Decimal, localcontext
from fractions import Fraction as F
from itertools import pairwise

import mpmath
import numpy as np
import pytest
import scipy.linalg
import scipy.sparse.linalg
import sympy
from hypothesis import given
from hypothesis import strategies as st

from fem1d2d import plane_strain, rectangle, stiffness
from ndtheory import HypothesisError, evaluate_energy
from ndtheory.constants import EnergyConstants
from ndtheory.continuum.intervals import Interval, sinc
from ndtheory.continuum.rectangles import (
    Rectangle,
    TwoRectangles,
    continuum_constants,
    cut_off,
    ends,
    friction_threshold,
    statement,
)
from ndtheory.continuum.segments import Zone, bound, bound_at_end, meeting, zones
from ndtheory.continuum.strip import Strip, largest_ratio_of_strips, largest_smoothed, symbols
from ndtheory.moduli import Moduli, half_planes, mirror

HARD, SOFT = Moduli(young=70000, poisson="0.3"), Moduli(young=20000, poisson="0.3")
THICK = F(3, 10)


def body(left, right, moduli, thickness=THICK):
    return Rectangle(left=F(left), right=F(right), thickness=F(thickness), body=moduli)


def model(**changes):
    """The bodies of Section 6."""
    values = {
        "contact": body("0.4", "1.6", SOFT),
        "neumann": body(0, 2, HARD),
        "interval": (F("0.4"), F("1.6")),
        "radius": F("0.1"),
    }
    return TwoRectangles(**{**values, **changes})


@pytest.fixture(scope="module")
def section6():
    return continuum_constants(model())


# --- intervals ---

rationals = st.fractions(-50, 50, max_denominator=10**6)


@given(rationals, rationals, rationals, rationals)
def test_every_operation_encloses_the_exact_result(a, b, c, d):
    x, y = Interval.between(*sorted((a, b))), Interval.between(*sorted((c, d)))
    for p in (a, b, (a + b) / 2):
        for q in (c, d, (c + d) / 2):
            for enclosure, exact in ((x + y, p + q), (x - y, p - q), (x * y, p * q), (x.square(), p * p)):
                assert F(enclosure.lo) <= exact <= F(enclosure.hi)
            if not y.lo <= 0 <= y.hi:
                assert F((x / y).lo) <= p / q <= F((x / y).hi)
    assert F(x.modulus().lo) <= abs(a) <= F(x.modulus().hi)


@given(st.fractions(0, 3, max_denominator=10**6))
def test_exponential_root_and_sinc_enclose_their_values_to_thirty_digits(t):
    with mpmath.workdps(60):
        exact = mpmath.mpf(t.numerator) / t.denominator
        for enclosure, value in (
            (Interval.of(-t).exp(), mpmath.exp(-exact)),
            (Interval.of(t) ** 0.5, mpmath.sqrt(exact)),
            (sinc(Interval.of(t)), mpmath.sincpi(exact / mpmath.pi)),
        ):
            lo, hi = mpmath.mpf(str(enclosure.lo)), mpmath.mpf(str(enclosure.hi))
            assert lo <= value <= hi
            assert hi - lo < mpmath.mpf(10) ** -30


# --- the strip ---


def test_the_symbols_of_the_strip_follow_from_equilibrium_and_the_clamped_side():
    kappa, x = sympy.Rational(9, 5), sympy.Rational(7, 4)  # the wave number is 1 and d = x, G = 1
    y = sympy.Symbol("y")
    lame = (3 - kappa) / (kappa - 1)
    shapes = [sympy.cosh(y), sympy.sinh(y), y * sympy.cosh(y), y * sympy.sinh(y)]
    unknowns = sympy.symbols("a:8")
    # u = -U(y) sin(xi), w = W(y) cos(xi): the real part of (i U, W) e^(i xi)
    along = sum(a * shape for a, shape in zip(unknowns[:4], shapes, strict=True))
    across = sum(a * shape for a, shape in zip(unknowns[4:], shapes, strict=True))
    shear = sympy.diff(along, y) + across  # of -sin
    normal = -lame * along + (lame + 2) * sympy.diff(across, y)  # sigma_yy, of cos
    pull = -(lame + 2) * along + lame * sympy.diff(across, y)  # sigma_xx, of cos
    equilibrium = [pull + sympy.diff(shear, y), -shear + sympy.diff(normal, y)]
    conditions = [
        sympy.expand(equation.rewrite(sympy.exp) * sympy.exp(3 * y)).subs(y, at)
        for equation in equilibrium
        for at in (0, 1, 2, 3)
    ]
    sides = [along.subs(y, 0), across.subs(y, 0)]
    measured = []
    for top in ((1, 0), (0, 1)):
        values = [along.subs(y, x) - top[0], across.subs(y, x) - top[1]]
        system = sympy.linear_eq_to_matrix([*conditions, *sides, *values], unknowns)
        matrix, right = (np.array(part.evalf(30), float) for part in system)
        found = np.linalg.lstsq(matrix, right.ravel(), rcond=None)
        assert np.allclose(matrix @ found[0], right.ravel(), atol=1e-7)
        at = dict(zip(unknowns, found[0], strict=True))
        measured.append([float(traction.subs(y, x).subs(at)) for traction in (shear, normal)])
    tt, nn, nt = (float(v) for v in symbols(kappa, sympy.sinh(2 * x), sympy.sinh(x) ** 2, x, x * x))
    assert np.allclose(measured, [[tt, nt], [nt, nn]], rtol=1e-6)


@pytest.mark.parametrize("poisson", ["-0.3", "0", "0.3", "0.45"])
def test_intervals_of_wave_numbers_enclose_the_symbols(poisson):
    strip = Strip(body=Moduli(young=1, poisson=poisson), thickness=F(1, 2))
    for lo, hi in pairwise([F(0), F(1, 9), F(1), F(5, 2), F(9), F(40)]):
        for xi in (lo + (hi - lo) * F(j, 7) for j in range(1, 8)):
            x = mpmath.mpf(xi.numerator) / xi.denominator / 2
            exact = symbols(float(strip.body.kappa), mpmath.sinh(2 * x), mpmath.sinh(x) ** 2, x, x * x)
            for enclosure, value in zip(strip.form((lo, hi)), exact, strict=True):
                assert enclosure.lo <= Decimal(str(value * float(strip.body.shear) * 2 * x)) * (1 + Decimal("1e-12"))
                assert Decimal(str(value * float(strip.body.shear) * 2 * x)) * (1 - Decimal("1e-12")) <= enclosure.hi
            if lo >= 2:
                for enclosure, value in zip(strip.over_wave_number((lo, hi)), exact, strict=True):
                    there = Decimal(str(value * float(strip.body.shear)))
                    assert enclosure.lo * (1 - Decimal("1e-12")) <= there <= enclosure.hi * (1 + Decimal("1e-12"))


@given(st.fractions(F(1, 100), 20, max_denominator=10**6), st.sampled_from([3, 28]))
def test_a_wave_number_is_enclosed_to_the_last_digit_whatever_the_precision_of_the_caller(x, digits):
    """A Decimal between intervals would be rounded to the nearest in the caller's context."""
    strip = Strip(body=HARD, thickness=F(1))
    with localcontext() as context, mpmath.workdps(60):
        context.prec = digits
        found = strip.form((x, x))
        number = mpmath.mpf(x.numerator) / x.denominator
        exact = symbols(mpmath.mpf(9) / 5, mpmath.sinh(2 * number), mpmath.sinh(number) ** 2, number, number**2)
        unit = mpmath.mpf(strip.body.shear.numerator) / strip.body.shear.denominator * number
        for enclosed, value in zip(found, exact, strict=True):
            assert mpmath.mpf(str(enclosed.lo)) <= unit * value <= mpmath.mpf(str(enclosed.hi))


@pytest.mark.parametrize("radius", ["0.02", "0.1", "1", "7"])
def test_no_wave_number_exceeds_the_supremum_and_one_comes_near(radius):
    strip, r = Strip(body=HARD, thickness=THICK), float(F(radius))
    found = largest_smoothed(strip, F(radius))
    wave = np.geomspace(1e-3, 40 / r, 200_000)
    x = wave * 0.3
    with np.errstate(over="ignore"):
        e = np.exp(-2 * x)
    nn = symbols(1.8, (1 - e**2) / 2, (1 - e) ** 2 / 4, x * e, x * x * e)[1]
    values = float(HARD.shear) * wave * nn * np.sinc(wave * r / 2 / np.pi) ** 4
    assert values.max() <= float(found.hi)
    assert values.max() == pytest.approx(float(found.lo), rel=1e-3)


@pytest.mark.parametrize(
    ("thin", "thick", "nu", "nu_neumann"),
    [
        ("0.3", "0.3", "0.3", "0.3"),
        ("0.2", "0.5", "0.3", "0.3"),
        ("0.5", "0.1", "0.45", "0.3"),
        ("0.25", "2", "0.45", "-0.5"),  # NT of the two has different signs where the ratio is largest
    ],
)
def test_the_ratio_of_two_strips_bounds_every_wave_number_and_the_half_planes(thin, thick, nu, nu_neumann):
    contact = Strip(body=Moduli(young=20000, poisson=nu), thickness=F(thin))
    neumann = Strip(body=Moduli(young=70000, poisson=nu_neumann), thickness=F(thick))
    ratio = float(largest_ratio_of_strips(contact, neumann))
    seen = []
    for wave in np.geomspace(1e-2, 300, 200):
        forms = []
        for strip, sign in ((contact, -1), (neumann, 1)):
            x = wave * float(strip.thickness)
            e = np.exp(-2 * x)
            tt, nn, nt = symbols(float(strip.body.kappa), (1 - e**2) / 2, (1 - e) ** 2 / 4, x * e, x * x * e)
            forms.append(float(strip.body.shear) * np.array([[tt, sign * nt], [sign * nt, nn]]))
        seen.append(scipy.linalg.eigh(*forms, eigvals_only=True)[-1])
    assert max(seen) <= ratio <= max(seen) * 1.002
    assert ratio >= float(half_planes(contact.body, neumann.body).high)


# --- segments ---


def test_two_segments_give_the_displacement_of_every_field():
    x, y, s, t = sympy.symbols("x y s t")
    # y grows into the body; the side y = 1 is clamped
    field = [(1 - y) * (1 + x**2 * y - 3 * x), (1 - y) * (x**3 - 2 * y + 5)]
    e = sympy.Matrix(2, 2, lambda i, j: (sympy.diff(field[i], (x, y)[j]) + sympy.diff(field[j], (x, y)[i])) / 2)

    def along(slope):
        direction = sympy.Matrix([slope, 1])
        strain = (direction.T * e * direction)[0].subs(x, x + slope * y)
        return sympy.integrate(sympy.expand(strain), (y, 0, 1))

    assert sympy.simplify((along(s) - along(t)) / (t - s) - field[0].subs(y, 0)) == 0


def test_the_weight_of_two_segments_is_the_complementary_energy_of_their_stresses():
    nu, s, t = sympy.symbols("nu s t")
    lame = 2 * nu / (1 - 2 * nu)  # over G
    stress = [sympy.Matrix([[a * a, a], [a, 1]]) for a in (s, t)]
    # e with 2 e + lame tr(e) I = stress
    strain = (stress[0] - lame / (2 * lame + 2) * stress[0].trace() * sympy.eye(2)) / 2
    assert sympy.simplify((strain * stress[1]).trace() - meeting(s, t, 3 - 4 * nu)) == 0


def largest_trace(length, lo, hi, poisson, cells):
    """``G |v_T|^2 / (d a(v))`` on a mesh, |v_T| exact: its fields are some of those of the continuum."""
    mesh = rectangle((0.0, length), (0.0, 1.0), cells)
    young = 2 * (1 + poisson)  # G = 1
    A = stiffness(mesh, plane_strain(young, poisson)).tocsc()
    points = np.asarray(mesh.points)
    free = np.flatnonzero(np.repeat(points[:, 1] > 1e-9, 2))
    top = np.flatnonzero((points[:, 1] > 1 - 1e-9) & (points[:, 0] > lo - 1e-9) & (points[:, 0] < hi + 1e-9))
    top = top[np.argsort(points[top, 0])]
    widths = np.diff(points[top, 0])
    mass = np.diag(np.r_[widths, 0] / 3 + np.r_[0, widths] / 3) + np.diag(widths / 6, 1) + np.diag(widths / 6, -1)
    place = np.full(A.shape[0], -1)
    place[free] = np.arange(len(free))
    load = np.zeros((len(free), len(top)))
    load[place[2 * top], np.arange(len(top))] = 1
    flexibility = scipy.sparse.linalg.splu(A[free][:, free].tocsc()).solve(load)[place[2 * top]]
    root = scipy.linalg.cholesky(mass)
    return scipy.linalg.eigvalsh(root @ (flexibility + flexibility.T) / 2 @ root.T)[-1]


@pytest.mark.parametrize(
    ("length", "lo", "hi", "poisson", "cells"),
    [
        (4, 0, 4, 0.3, (48, 12)),
        (4, 0, 4, 0.0, (48, 12)),
        (4, 0, 4, 0.45, (48, 12)),
        (20 / 3, 4 / 3, 16 / 3, 0.3, (60, 10)),
        (1, 0, 1, 0.3, (24, 24)),
        (0.5, 0, 0.5, 0.3, (12, 24)),
        (3, 0, 2, 0.3, (36, 12)),
        (3, 0.5, 2, -0.4, (36, 12)),
        (2, 0.5, 2, 0.3, (24, 12)),
    ],
)
def test_no_mesh_shows_a_larger_tangential_trace_than_the_bound(length, lo, hi, poisson, cells):
    exact = [F(v).limit_denominator(1000) for v in (length, lo, hi)]
    kappa = 3 - 4 * F(str(poisson))
    chosen = zones(*exact, kappa)
    assert all(zone.inside(exact[0]) for zone in chosen)
    ends = [x + slope for zone in chosen for x in (zone.lo, zone.hi) for slope in (zone.left, zone.right)]
    assert 0 <= min(ends) <= max(ends) <= exact[0]
    assert [zone.hi for zone in chosen[:-1]] == [zone.lo for zone in chosen[1:]]
    assert (chosen[0].lo, chosen[-1].hi) == tuple(exact[1:])
    proved, seen = float(bound(chosen, kappa)), largest_trace(length, lo, hi, poisson, cells)
    assert 0.2 * proved < seen <= proved


def test_the_best_bound_for_a_length_of_four_thicknesses_is_at_least_five_quarters():
    assert largest_trace(4, 0, 4, 0.3, (48, 12)) > 1.25


def test_away_from_the_sides_the_bound_is_the_best_one():
    assert bound(zones(F(40), F(1), F(39), F(9, 5)), F(9, 5)) == 1
    assert largest_trace(24, 1, 23, 0.3, (240, 10)) > 0.93  # a long even shear has 1


def test_points_beside_a_side_with_two_slopes_have_the_bound_at_every_depth():
    kappa = F(9, 5)
    least = bound_at_end(F(2), kappa)
    for width in (F(1), F(4), F(40)):
        assert bound([Zone(lo=F(0), hi=width, left=F(0), right=F(23, 16))], kappa) <= least * F(101, 100)
    assert largest_trace(3, 0, 1, 0.3, (36, 12)) <= float(least)
    assert bound_at_end(F(1, 2), kappa) > least


def test_the_bound_is_the_largest_row_of_the_kernel_found_by_sampling():
    kappa, rng = F(9, 5), np.random.default_rng(1)
    chosen = [zone.in_doubles() for zone in zones(F(4), F(0), F(4), kappa)]
    depths = (np.arange(2000) + 0.5) / 2000
    rows = []
    for zone in chosen:
        for x in rng.uniform(float(zone.lo), float(zone.hi), 20):
            total = 0.0
            for s in (zone.left, zone.right):
                for other in chosen:
                    for t in (other.left, other.right):
                        meets = x + float(s - t) * depths
                        share = np.mean((meets > other.lo) & (meets < other.hi))
                        scale = (zone.right - zone.left) * (other.right - other.left)
                        total += share * abs(meeting(s, t, float(kappa))) / scale
            rows.append(total)
    assert max(rows) <= float(bound(chosen, kappa)) + 1e-3
    assert max(rows) > 0.9 * float(bound(chosen, kappa))


# --- what follows ---


def test_section_6_contracts_in_the_continuum_at_the_friction_of_the_paper(section6):
    assert friction_threshold(section6).lo > 0.235
    says = statement(section6, friction="0.2", theta="0.4")
    assert (says.verdict, says.factor.level) == ("contraction", "guaranteed")
    assert says.factor.hi < 0.947
    assert says.theta_max_proved.lo > 0.472
    assert statement(section6, friction="0.1").theta_max_proved.lo > 0.602
    assert statement(section6, friction="0.25").interval is None


@pytest.mark.parametrize(("radius", "threshold", "proved"), [("0.1", 0.2357, True), ("0.02", 0.1055, False)])
def test_what_is_proved_at_the_friction_of_the_paper_depends_on_a_radius_that_it_does_not_give(
    section6, radius, threshold, proved
):
    """At its theta, 0.6, nothing is proved with either radius."""
    found = largest_smoothed(model().neumann.strip, F(radius))  # the only constant with r in it
    constants = replace(section6, C_s_square=F(found.hi))
    assert friction_threshold(constants).lo == pytest.approx(threshold, abs=1e-4)
    says = statement(constants, friction="0.2", theta="0.6")
    assert (says.verdict, says.interval is not None) == ("no conclusion", proved)


def test_the_bounds_of_section_6_lie_above_what_is_known_of_its_constants(section6):
    assert section6.rho_normal == mirror(SOFT, HARD) == F(2, 7)
    assert half_planes(SOFT, HARD).high < section6.strips < section6.rho
    assert 659.7 < float(section6.C_s_square) ** 0.5 < 659.9
    shear = float(HARD.shear)
    assert section6.K[1] == 1
    assert section6.C_t2_square * shear == pytest.approx(0.3)


def test_an_end_bounds_rho_by_the_wedges_that_the_rectangles_are_there(section6):
    def rho_of(**changes):
        return float(ends(model(**changes)))

    assert section6.rho_ends == half_planes(SOFT, HARD).high < section6.rho  # 90 degrees on a flat body add nothing
    upper, lower = body("0.4", "1.6", SOFT), body(0, 2, HARD)
    assert rho_of(contact=lower, neumann=upper) == pytest.approx(3.5 * np.pi / (np.pi / 2 - 1), rel=1e-9)
    assert rho_of(neumann=body("0.4", 2, HARD)) == pytest.approx(2 / 7 * (np.pi + 2) / (np.pi - 2), rel=1e-9)
    assert rho_of(neumann=body(0, "1.6", HARD)) == rho_of(neumann=body("0.4", 2, HARD))  # either end
    inside = rho_of(contact=lower, neumann=upper, interval=(F("0.5"), F("1.5")))
    assert inside == pytest.approx(float(half_planes(HARD, SOFT).high))  # both go on


def test_the_statement_is_that_of_the_theorem_for_the_upper_bounds(section6):
    k = F("0.2")
    first, second = section6.kappa(k)
    assert float(first) == pytest.approx(0.2 * (section6.C_s_square * section6.C_t1_square) ** 0.5)
    there = evaluate_energy(EnergyConstants(rho=section6.rho, kappa_1=first, kappa_2=second), theta="0.4")
    assert statement(section6, friction=k, theta="0.4").factor.value == pytest.approx(there.factor.value)
    threshold = F(friction_threshold(section6).lo)
    a, b = section6.kappa(threshold)
    assert float(b + a * a / 4) == pytest.approx(1, abs=1e-12)
    assert b + a * a / 4 < 1


def test_without_friction_the_mirror_image_proves_the_classical_rate(section6):
    says = statement(section6, friction=0)
    assert says.theta_proved == pytest.approx(2 / (2 + 2 / 7))
    assert says.factor_proved.hi == pytest.approx(1 / 8)


def test_the_unit_of_length_and_stress_do_not_matter(section6):
    tall = continuum_constants(
        model(
            contact=body(4, 16, Moduli(young=2, poisson="0.3"), 3),
            neumann=body(0, 20, Moduli(young=7, poisson="0.3"), 3),
            interval=(F(4), F(16)),
            radius=F(1),
        )
    )
    for ours, theirs in zip(section6.kappa(F(1)), tall.kappa(F(1)), strict=True):
        assert float(ours) == pytest.approx(float(theirs), rel=1e-12)
    assert tall.cut_off == section6.cut_off


def test_where_the_edges_are_aligned_rho_has_no_bound_and_small_theta_still_contract():
    aligned = continuum_constants(model(contact=body(0, "1.2", SOFT), interval=(F(0), F("1.2"))))
    assert (aligned.rho, aligned.cut_off) == (None, None)
    assert "end of the Neumann body" in aligned.reason["rho"]
    assert statement(aligned, friction="0.1") is None
    assert statement(aligned, friction=0).factor_proved.hi == pytest.approx(1 / 8)  # the mirror image fits
    assert friction_threshold(aligned).lo > 0.1


@pytest.mark.parametrize("changes", [{"contact": body("0.3", "1.7", SOFT, "0.2")}, {"contact": body(-1, 3, SOFT)}])
def test_a_mirror_image_that_does_not_fit_proves_nothing(changes):
    found = continuum_constants(model(**changes))
    assert found.rho_normal is None
    assert "rho_normal" in found.reason


def test_the_cut_off_costs_less_where_the_neumann_body_is_longer():
    short, long = (cut_off(model(neumann=body(F("0.4") - m, F("1.6") + m, HARD))) for m in (F("0.4"), F(2)))
    assert long == short / 25


@pytest.mark.parametrize("poisson", ["-0.4", "0", "0.3", "0.45"])
def test_the_cut_off_costs_what_both_components_are_stretched_and_sheared_by_at_most(poisson):
    """``(lambda + 2 G) (chi' v_T)^2`` over depths y, each with the bound y/G, and ``G (chi' v_N)^2`` by Poincare."""
    young, nu, d, margin = 7.0, float(poisson), 0.3, 0.4
    shear, stretched = young / 2 / (1 + nu), young * (1 - nu) / (1 + nu) / (1 - 2 * nu)
    along = stretched * d**2 / 2 / shear * float(bound_at_end(F(2), 3 - 4 * F(poisson)))
    across = shear * (2 * d / np.pi) ** 2 / (young / (1 - nu**2))
    found = cut_off(model(neumann=body(0, 2, Moduli(young=7, poisson=poisson))))
    assert float(found) == pytest.approx((along + across) / margin**2, rel=1e-6)


def test_the_cut_off_bounds_its_energy_for_every_field_of_a_mesh():
    # sup of the energy that chi' adds over a(v), on a mesh with the margins of Section 6, by the entries of P1 fields
    mesh = rectangle((0.0, 2.0), (-0.3, 0.0), (40, 6))
    A = stiffness(mesh, plane_strain(7e4, 0.3)).tocsc()
    points, triangles = np.asarray(mesh.points), np.asarray(mesh.cells)
    shear, lame = 7e4 / 2.6, 7e4 * 0.3 / (1.3 * 0.4)
    B = np.zeros(A.shape)
    for nodes in triangles:
        p = points[nodes]
        if 0.4 < p[:, 0].mean() < 1.6:
            continue
        area = abs(np.linalg.det(np.c_[p[1] - p[0], p[2] - p[0]])) / 2
        mass = area / 12 * (np.ones((3, 3)) + np.eye(3)) / 0.4**2
        for c, weight in ((0, lame + 2 * shear), (1, shear)):
            B[np.ix_(2 * nodes + c, 2 * nodes + c)] += weight * mass
    free = np.flatnonzero(np.repeat(points[:, 1] > -0.3 + 1e-9, 2))
    largest = scipy.linalg.eigh(B[np.ix_(free, free)], A[free][:, free].toarray(), eigvals_only=True)[-1]
    assert 0.2 < largest <= float(cut_off(model()))


@pytest.mark.parametrize(
    ("make", "key"),
    [
        (lambda: body(1, 0, SOFT), "x"),
        (lambda: body(0, 1, SOFT, 0), "d"),
        (lambda: body(0, 1, Moduli(young=1, poisson="1/2")), "nu"),
        (lambda: model(interval=(F("0.3"), F(1))), "Gamma_c"),
        (lambda: model(radius=F(0)), "r"),
        (lambda: zones(F(1), F(-1), F(1), F(2)), "Gamma_c"),
    ],
)
def test_what_the_theory_does_not_speak_of_is_refused(make, key):
    with pytest.raises(HypothesisError) as refused:
        make()
    assert refused.value.key == key
