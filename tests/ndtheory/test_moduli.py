"""What moduli say of rho: against Navier's equations, against stresses in wedges, and against finite elements."""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import eigh

import verification as vf
from ndtheory import HypothesisError
from ndtheory.moduli import Moduli, end, half_planes, mirror, wedge

youngs = st.integers(1, 1000)
ratios = st.fractions("-0.9", "0.48", max_denominator=50)
planes = st.sampled_from(["strain", "stress"])
bodies = st.builds(Moduli, young=youngs, poisson=ratios, plane=planes)
angles = st.floats(0.2, 6.0)


def surface_stiffness(body: Moduli, *, upper: bool) -> sp.Matrix:
    """Traction on the surface y = 0 over ``exp(i x)`` times its displacement, from Navier's equations."""
    x, y = sp.symbols("x y", real=True)
    mu = sp.Rational(body.shear.numerator, body.shear.denominator)
    nu = sp.Rational(body.poisson.numerator, body.poisson.denominator)
    lam = 2 * mu * nu / ((1 - nu) if body.plane == "stress" else (1 - 2 * nu))
    inward = 1 if upper else -1  # the body lies at inward * y > 0
    a, b = sp.Matrix(sp.symbols("a1 a2")), sp.Matrix(sp.symbols("b1 b2"))
    u = (a + b * inward * y) * sp.exp(sp.I * x - inward * y)
    gradient = sp.Matrix(2, 2, lambda i, j: sp.diff(u[i], (x, y)[j]))
    stress = lam * gradient.trace() * sp.eye(2) + mu * (gradient + gradient.T)
    balance = [sp.diff(stress[i, 0], x) + sp.diff(stress[i, 1], y) for i in range(2)]
    conditions = [sp.expand(sp.simplify(e * sp.exp(-sp.I * x + inward * y))) for e in balance]
    found = sp.solve([c for e in conditions for c in sp.Poly(e, y).all_coeffs()], list(b), dict=True)[0]
    traction = -inward * stress[:, 1].subs(found).subs({x: 0, y: 0})
    return sp.simplify(traction.jacobian(a))


@given(bodies, bodies)
def test_bodies_seen_from_each_other_have_inverse_spectra(one, other):
    here, there = half_planes(one, other), half_planes(other, one)
    assert here.high * there.low == 1
    assert here.low * there.high == 1
    assert here.free * there.free == 1
    assert here.low <= here.free <= here.high


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_half_planes_have_the_stiffnesses_that_navier_s_equations_give(plane):
    contact, neumann = Moduli(young=3, poisson="1/5", plane=plane), Moduli(young=7, poisson="2/5", plane=plane)
    K_c, K_n = surface_stiffness(contact, upper=True), surface_stiffness(neumann, upper=False)
    ratio = lambda A, B: sorted((B.inv() * A).eigenvals(), key=float)
    found = half_planes(contact, neumann)
    assert [sp.Rational(v.numerator, v.denominator) for v in (found.low, found.high)] == ratio(K_c, K_n)
    slide = lambda K: sp.Matrix([[sp.simplify(K[1, 1] - K[1, 0] * K[0, 1] / K[0, 0])]])  # no shear
    (free,) = ratio(slide(K_c), slide(K_n))
    assert found.free == free


def spread(low: float, high: float) -> np.ndarray:
    """``int e_r e_r'`` over the directions between two angles: a radial field u = (F/K) log r carries that, over E*."""
    points, weights = np.polynomial.legendre.leggauss(40)
    theta = (low + high) / 2 + (high - low) / 2 * points
    rays = np.array([np.cos(theta), np.sin(theta)])
    return (rays * weights * (high - low) / 2) @ rays.T


@given(angles)
def test_a_wedge_resists_by_the_integral_of_its_radial_stresses(alpha):
    assert np.diag(spread(-alpha / 2, alpha / 2)) == pytest.approx(wedge(alpha), rel=1e-9)


@given(bodies, bodies, angles, angles)
def test_an_end_has_the_extremal_ratios_of_both_wedges_in_one_frame(contact, neumann, upper, lower):
    ratio = float(contact.e_star / neumann.e_star)
    expected = ratio * eigh(spread(0, upper), spread(-lower, 0), eigvals_only=True)
    assert end(contact, neumann, (upper, lower)) == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize(
    ("openings", "low", "high"),
    [
        ((math.pi, math.pi), 1.0, 1.0),
        ((math.pi / 2, math.pi), (math.pi / 2 - 1) / math.pi, (math.pi / 2 + 1) / math.pi),
        ((math.pi, math.pi / 2), math.pi / (math.pi / 2 + 1), math.pi / (math.pi / 2 - 1)),
        ((math.pi / 2, math.pi / 2), (math.pi - 2) / (math.pi + 2), (math.pi + 2) / (math.pi - 2)),
    ],
)
def test_corners_of_ninety_degrees_in_closed_form(openings, low, high):
    body = Moduli(young=1, poisson="0.3")
    assert end(body, body, openings) == pytest.approx((low, high), rel=1e-12)


SOFT, HARD = Moduli(young=20000, poisson="0.3"), Moduli(young=70000, poisson="0.3")


def test_on_the_mesh_rho_of_section_6_rises_to_the_value_of_half_planes():
    """And the lower end of the spectrum falls to that of the exchanged roles; rho_normal is E_c/E_n by the mirror."""
    rho, lowest = [], []
    for n in (1, 2, 4, 8):  # the mirror image of the upper mesh lies in the lower one, cell by cell
        problem = vf.example("section6").changed(cells=((20 * n, 2 * n), (12 * n, 2 * n)))
        pair = vf.build(problem)
        measured, other = vf.measure(pair), vf.measure(pair.swapped())
        rho.append(measured.rho_max.value)
        lowest.append(other.rho_min.value)
        assert measured.rho_normal.value == pytest.approx(float(mirror(SOFT, HARD)), rel=1e-9)
    limit = half_planes(SOFT, HARD)
    assert rho == sorted(rho)
    assert 0.96 * float(limit.high) < rho[-1] < float(limit.high)
    assert lowest == sorted(lowest, reverse=True)
    assert float(half_planes(HARD, SOFT).low) < lowest[-1] < 1.04 * float(half_planes(HARD, SOFT).low)


@given(bodies, bodies)
def test_the_energy_of_the_contact_body_is_at_most_s_times_that_of_the_neumann_body_and_s_is_least(contact, neumann):
    def energy(body):
        """On the strains (xx, yy, xy)."""
        mu = float(body.shear)
        bulk = 2 * mu / (float(body.kappa) - 1)
        trace, deviator = np.array([1.0, 1, 0]), np.array([[0.5, -0.5, 0], [-0.5, 0.5, 0], [0, 0, 2]])
        return bulk * np.outer(trace, trace) + 2 * mu * deviator

    s = float(mirror(contact, neumann))
    assert eigh(energy(contact), energy(neumann), eigvals_only=True)[-1] == pytest.approx(s, rel=1e-9)


def test_incompressible_bodies():
    rubber = Moduli(young=1, poisson="1/2")
    assert rubber.kappa == 1
    assert mirror(rubber, SOFT) is None
    assert mirror(rubber, rubber) == 1
    assert mirror(SOFT, rubber) == SOFT.shear / rubber.shear


@pytest.mark.parametrize("given_", [{"young": 0}, {"young": "soft"}, {"poisson": "0.6"}, {"poisson": -1}])
def test_moduli_that_no_body_has_are_refused_by_name(given_):
    with pytest.raises(HypothesisError, match=r"E|nu"):
        Moduli(**{"young": 1, "poisson": "0.3"} | given_)


@pytest.mark.parametrize("alpha", [0, -1, 7, "wide"])
def test_an_opening_that_no_wedge_has_is_refused(alpha):
    with pytest.raises(HypothesisError, match="alpha"):
        wedge(alpha)
