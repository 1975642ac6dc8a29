"""What moduli say of rho: against Navier's equations, against stresses in wedges, and against finite elements."""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import eigh, expm

import verification as vf
from ndtheory import HypothesisError
from ndtheory.moduli import Moduli, antiplane, column, end, free_end, half_planes, layer, mirror, wedge

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


# --- in space, at free ends, of layers and columns -------------------------------------------------------------------


def space_stiffness(body: Moduli, *, upper: bool) -> sp.Matrix:
    """Traction on the surface z = 0 over ``exp(i (3x + 4y)/5)`` times its displacement, from Navier's equations."""
    X = x, y, z = sp.symbols("x y z", real=True)
    mu = sp.Rational(body.shear.numerator, body.shear.denominator)
    nu = sp.Rational(body.poisson.numerator, body.poisson.denominator)
    lam = 2 * mu * nu / (1 - 2 * nu)
    inward = 1 if upper else -1  # the body lies at inward * z > 0
    a, b = sp.Matrix(sp.symbols("a1:4")), sp.Matrix(sp.symbols("b1:4"))
    wave = sp.exp(sp.I * (3 * x + 4 * y) / 5 - inward * z)
    u = (a + b * inward * z) * wave
    gradient = sp.Matrix(3, 3, lambda i, j: sp.diff(u[i], X[j]))
    stress = lam * gradient.trace() * sp.eye(3) + mu * (gradient + gradient.T)
    balance = [sum(sp.diff(stress[i, j], X[j]) for j in range(3)) for i in range(3)]
    conditions = [sp.expand(sp.simplify(e / wave)) for e in balance]
    found = sp.solve([c for e in conditions for c in sp.Poly(e, z).all_coeffs()], list(b), dict=True)[0]
    traction = -inward * stress[:, 2].subs(found).subs({x: 0, y: 0, z: 0})
    return sp.simplify(traction.jacobian(a))


def rational(value) -> sp.Rational:
    return sp.Rational(value.numerator, value.denominator)


def test_half_spaces_have_the_stiffnesses_of_plane_strain_and_the_antiplane_one_between_them():
    contact, neumann = Moduli(young=3, poisson="1/5", plane="3d"), Moduli(young=7, poisson="2/5", plane="3d")
    K_c, K_n = space_stiffness(contact, upper=True), space_stiffness(neumann, upper=False)
    patch = half_planes(contact, neumann)
    expected = [rational(v) for v in (patch.low, antiplane(contact, neumann), patch.high)]
    assert sorted((K_n.inv() * K_c).eigenvals(), key=float) == expected
    free = [1 / K.inv()[2, 2] for K in (K_c, K_n)]  # no shear in either direction
    assert sp.simplify(free[0] / free[1]) == rational(patch.free)


@given(bodies, bodies)
def test_the_antiplane_ratio_never_sets_rho(contact, neumann):
    assert min(contact.kappa, neumann.kappa) >= 1
    assert half_planes(contact, neumann).low <= antiplane(contact, neumann) <= half_planes(contact, neumann).high


@given(youngs, ratios, youngs, ratios)
def test_in_space_s_is_least_among_the_multiples_of_all_six_strains(young_c, nu_c, young_n, nu_n):
    contact, neumann = Moduli(young=young_c, poisson=nu_c, plane="3d"), Moduli(young=young_n, poisson=nu_n, plane="3d")

    def energy(body):
        nu, E = float(body.poisson), float(body.young)
        flexibility = np.zeros((6, 6))  # Hooke's law, strains from stresses
        flexibility[:3, :3] = (np.eye(3) * (1 + nu) - nu * np.ones((3, 3))) / E
        flexibility[3:, 3:] = np.eye(3) * (1 + nu) / E
        return np.linalg.inv(flexibility)

    s = eigh(energy(contact), energy(neumann), eigvals_only=True)[-1]
    assert float(mirror(contact, neumann)) == pytest.approx(s, rel=1e-9)


def test_in_space_unequal_poisson_ratios_need_another_s_than_in_plane_strain():
    soft, stiff = ("0.1", "0.4")
    of = lambda plane: mirror(Moduli(young=1, poisson=stiff, plane=plane), Moduli(young=1, poisson=soft, plane=plane))
    assert of("3d") > of("strain")
    assert mirror(Moduli(young=1, poisson="1/2", plane="3d"), Moduli(young=1, poisson=soft, plane="3d")) is None


@given(bodies, bodies, angles, angles)
def test_a_free_end_has_the_ratio_of_the_flexibilities_against_a_normal_force(contact, neumann, upper, lower):
    ratio = float(contact.e_star / neumann.e_star)
    normal = lambda K: np.linalg.inv(K)[1, 1]
    expected = ratio * normal(spread(-lower, 0)) / normal(spread(0, upper))
    assert free_end(contact, neumann, (upper, lower)) == pytest.approx(expected, rel=1e-7)
    low, high = end(contact, neumann, (upper, lower))
    assert low * (1 - 1e-9) <= expected <= high * (1 + 1e-9)


def test_an_edge_in_space_has_the_antiplane_ratio_of_its_angles_besides():
    dense, foam = Moduli(young=1, poisson="1/2", plane="3d"), Moduli(young=1, poisson="-9/10", plane="3d")
    openings = (math.pi, math.pi / 2)
    plane = [Moduli(young=1, poisson=body.poisson) for body in (foam, dense)]
    assert end(foam, dense, openings)[1] == pytest.approx(2 * float(antiplane(foam, dense)))
    assert end(foam, dense, openings)[1] > end(*plane, openings)[1]
    assert end(dense, dense, openings) == end(plane[1], plane[1], openings)


def layer_stiffness(nu: float, x: float) -> np.ndarray:
    """Of a layer of thickness 1 and G = 1, held below, against exp(i x X): the field equations along its thickness."""
    lam = 2 * nu / (1 - 2 * nu)
    P = lam + 2
    # d/dY of (u, v/i, T, N/i), with T = sigma_xy, N = sigma_yy and fields (u, i v', T, i N') exp(i x X)
    A = np.array(
        [[0, x, 1, 0], [-lam * x / P, 0, 0, 1 / P], [(P - lam**2 / P) * x**2, 0, 0, lam * x / P], [0, 0, -x, 0]]
    )
    transfer = expm(A)
    return transfer[2:, 2:] @ np.linalg.inv(transfer[:2, 2:])


@pytest.mark.parametrize("nu", [-0.5, 0, 0.3, 0.4, 0.45, 0.49])
def test_a_layer_and_its_mirror_image_differ_at_most_by_the_ratio_of_its_worst_wave(nu):
    J = np.diag([1, -1])
    worst = 0.0
    for x in np.geomspace(0.05, 8, 300):
        S = layer_stiffness(nu, x)
        assert pytest.approx(S.T, rel=1e-6) == S
        worst = max(worst, eigh(J @ S @ J, S, eigvals_only=True)[-1])
    assert layer(Moduli(young=1, poisson=nu)) == pytest.approx(worst, rel=1e-3)


@given(bodies)
def test_a_layer_lies_between_a_half_plane_and_a_column(body):
    assert float(body.kappa) <= layer(body)
    assert layer(body) <= max(float(body.kappa), column())


def test_a_column_has_the_ratio_of_the_flexibilities_of_a_beam():
    t = sp.Symbol("t", positive=True)  # moments at the height t of a unit force and of a unit moment at the end
    moments = [1 - t, sp.Integer(1)]
    F = sp.Matrix(2, 2, lambda i, j: sp.integrate(moments[i] * moments[j], (t, 0, 1)))
    J = sp.diag(1, -1)
    largest = max((F * (J * F * J).inv()).eigenvals(), key=float)
    assert sp.simplify(largest - (2 + sp.sqrt(3)) ** 2) == 0
    assert column() == pytest.approx(float(largest), rel=1e-12)


def test_a_body_in_neither_plane_nor_space_is_refused():
    with pytest.raises(HypothesisError, match="plane = shell: needed one of strain, stress, 3d"):
        Moduli(young=1, poisson="0.3", plane="shell")
