"""Stiffness of wedges: against Ritz's method, Airy's functions, known limits, closed forms and finite elements."""

import math
from fractions import Fraction as F

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import legendre
from scipy.linalg import eigh
from strategies import fewer

from fem1d2d import Condensation, plane_strain, sector, stiffness
from ndtheory import HypothesisError
from ndtheory.continuum.wedges import Wedge, end_bound, ratio
from ndtheory.moduli import Moduli, end, free_end, half_planes

bodies = st.builds(Moduli, young=st.integers(1, 1000), poisson=st.fractions("-0.9", "0.48", max_denominator=50))
openings = st.integers(15, 345)
wedges = st.builds(Wedge, body=bodies, degrees=openings, clamped=st.booleans())
free_wedges = st.builds(Wedge, body=bodies, degrees=openings)
numbers = st.fractions("0.05", 3, max_denominator=40)

CIRCULAR = np.array([[1, 1j], [1, -1j]])  # (u_x, u_y) to (u_x + i u_y, u_x - i u_y)


def matrix(wedge, xi):
    """The middle of what is enclosed, in the components along Gamma_c and across it."""
    first, second, real, imag = (float(value.lo + value.hi) / 2 for value in wedge.symbol(xi))
    return CIRCULAR.conj().T @ np.array([[first, real + 1j * imag], [real - 1j * imag, second]]) @ CIRCULAR


def opposite(S):
    """That of the mirror image."""
    return np.diag([1, -1]) @ S @ np.diag([1, -1])


def by_ritz(wedge, xi, degree=40):
    """The least energy over ``r^(i xi) U(phi)``, U polynomials in the components e_r, e_phi: no field equation."""
    omega, G, kappa = math.radians(wedge.degrees), float(wedge.body.shear), float(wedge.body.kappa)
    x, weights = legendre.leggauss(2 * degree)
    V = legendre.legvander(x, degree)
    dV = np.stack([legendre.legval(x, legendre.legder(row)) for row in np.eye(degree + 1)], -1) * 2 / omega
    nothing, exponent = np.zeros_like(V), 1j * xi
    rr, pp = np.hstack([exponent * V, nothing]), np.hstack([V, dV])
    rp = np.hstack([dV, (exponent - 1) * V]) / 2
    of = lambda e: e.conj().T @ (weights[:, None] * omega / 2 * e)
    energy = 2 * G * (of(rr) + of(pp) + 2 * of(rp)) + G * (3 - kappa) / (kappa - 1) * of(rr + pp)
    ends = [np.kron(np.eye(2), (-1.0) ** np.arange(degree + 1))]
    if wedge.clamped:
        ends.append(np.kron(np.eye(2), np.ones(degree + 1)))
    held = np.vstack(ends)
    saddle = np.block([[energy, held.T], [held, np.zeros((len(held), len(held)))]])
    load = np.zeros((len(saddle), 2))
    load[2 * degree + 2 :][:2] = np.eye(2)
    U = np.linalg.solve(saddle, load)[: 2 * degree + 2]
    return U.conj().T @ energy @ U


@fewer(3)
@given(wedges, numbers)
def test_the_symbol_is_the_least_energy_among_polynomials_in_the_angle(wedge, xi):
    expected = by_ritz(wedge, float(xi))
    assert matrix(wedge, xi) == pytest.approx(expected, rel=1e-8, abs=1e-8 * abs(expected).max())


@mpmath.workdps(30)
def by_airy(wedge, xi):
    """Tractions on Gamma_c over displacements there, from ``r^(s+1) F(phi)`` with four constants, s = i xi.

    ``F = A cos((s+1) phi) + B sin((s+1) phi) + C cos((s-1) phi) + D sin((s-1) phi)``: stresses by two derivatives,
    displacements by Williams' function psi.
    """
    s, omega = mpmath.mpc(0, xi), mpmath.radians(mpmath.mpf(int(wedge.degrees)))
    kappa, G = (mpmath.mpf(v.numerator) / v.denominator for v in (wedge.body.kappa, wedge.body.shear))
    p, m, quarter = s + 1, s - 1, (kappa + 1) / 4

    def at(phi):
        """Rows u_r, u_phi, stress_r_phi, stress_phi_phi, over powers of r, for each constant."""
        c, d, e, f = mpmath.cos(p * phi), mpmath.sin(p * phi), mpmath.cos(m * phi), mpmath.sin(m * phi)
        shape, slope = [c, d, e, f], [-p * d, p * c, -m * f, m * e]
        psi, dpsi = [0, 0, 4 * f / m, -4 * e / m], [0, 0, 4 * e, 4 * f]
        columns = zip(shape, slope, psi, dpsi, strict=True)
        return [
            [(-p * F_ + quarter * dpsi_) / (2 * G), (-dF + quarter * m * psi_) / (2 * G), -s * dF, s * p * F_]
            for F_, dF, psi_, dpsi_ in columns
        ]

    near, far = (mpmath.matrix(at(phi)).T for phi in (mpmath.mpf(0), omega))
    beyond = far[0:2, :] if wedge.clamped else far[2:4, :]
    system = mpmath.matrix(4, 4)
    system[0:2, :], system[2:4, :] = near[0:2, :], beyond
    constants = mpmath.inverse(system)[:, 0:2]  # unit displacements on Gamma_c
    return np.array((-(near[2:4, :] * constants)).tolist(), complex)  # the outward normal is -e_phi


@given(wedges, numbers)
def test_the_symbol_gives_the_tractions_of_airy_s_functions(wedge, xi):
    expected = by_airy(wedge, mpmath.mpf(xi.numerator) / xi.denominator)
    assert matrix(wedge, xi) == pytest.approx(expected, rel=1e-12, abs=1e-12 * abs(expected).max())


@given(wedges, numbers)
def test_the_enclosure_is_narrow_and_holds_the_formula_in_another_arithmetic(wedge, xi):
    with mpmath.workdps(60):
        at, omega = mpmath.mpf(xi.numerator) / xi.denominator, mpmath.pi * int(wedge.degrees) / 180
        kappa, G = (mpmath.mpf(v.numerator) / v.denominator for v in (wedge.body.kappa, wedge.body.shear))
        c, E = (-kappa if wedge.clamped else 1), mpmath.expj(2 * omega)
        power = mpmath.exp(-2 * at * omega)
        M = mpmath.matrix([[kappa + c * power, 1j * at * (E - 1)], [1j * at * (1 / E - 1), kappa + c / power]])
        S = G * at * mpmath.diag([1, -1]) * ((kappa + 1) * mpmath.inverse(M) - mpmath.eye(2))
        found = wedge.symbol(xi)
        for enclosed, value in zip(found, (S[0, 0].real, S[1, 1].real, S[0, 1].real, S[0, 1].imag), strict=True):
            assert mpmath.mpf(str(enclosed.lo)) <= value <= mpmath.mpf(str(enclosed.hi))
            assert enclosed.hi - enclosed.lo < 10**-30 * max(1, float(G))


# --- limits ----------------------------------------------------------------------------------------------------------


@given(bodies, bodies, numbers)
def test_two_half_planes_have_a_ratio_that_rises_from_e_star_to_that_of_short_waves(contact, neumann, xi):
    found = ratio(Wedge(body=contact, degrees=180), Wedge(body=neumann, degrees=180), xi)
    p, kappa_c, kappa_n = math.exp(-2 * math.pi * xi), float(contact.kappa), float(neumann.kappa)
    G = float(contact.shear / neumann.shear)
    assert float(found.lo) == pytest.approx(G * (kappa_n + p) / (kappa_c * p + 1), rel=1e-12)
    assert found.hi <= half_planes(contact, neumann).high * (1 + F(1, 10**30))


@given(wedges, wedges)
def test_at_large_exponents_both_wedges_are_half_planes(contact, neumann):
    far = 4000 / min(contact.degrees, neumann.degrees)
    found = ratio(contact, neumann, F(far))
    assert float(found.lo) == pytest.approx(float(half_planes(contact.body, neumann.body).high), rel=1e-6)
    found = ratio(contact, neumann, F(far), normal=True)
    assert float(found.lo) == pytest.approx(float(half_planes(contact.body, neumann.body).free), rel=1e-6)


def first_order(wedge):
    r"""The relative size of what S has beside its limit ``xi^2 S_0``, per unit of xi.

    The formula of the symbol gives ``S = xi^2 (S_0 + xi s diag(1, -1) + O(xi^2))``,

        S_0 = 2 G/(kappa + 1) [[omega, sin(omega) e^(i omega)], [sin(omega) e^(-i omega), omega]],
        s = -2 G ((kappa - 1) omega^2 + 2 sin^2(omega))/(kappa + 1)^2,

    and the eigenvalues of ``s S_0^-1 diag(1, -1)`` are plus and minus ``|s|/det(S_0)^(1/2)``.
    """
    omega, kappa = math.radians(wedge.degrees), float(wedge.body.kappa)
    sine = math.sin(omega)
    return ((kappa - 1) * omega**2 + 2 * sine**2) / ((kappa + 1) * math.sqrt(omega**2 - sine**2))


#: Of second order in an exponent of 1e-6, with the squares of angles up to 2 pi, and of rounding.
NEGLIGIBLE = 1e-10


@given(free_wedges, free_wedges)
def test_at_small_exponents_free_wedges_answer_like_michell_s_to_a_force_at_the_apex(contact, neumann):
    """Each S lies between ``1 -+ xi first_order`` times its limit, so the largest eigenvalue of two of them does too.

    Where the limits have two equal eigenvalues, as those of half-planes, the first order counts; without tangential
    forces there is none, as the ratio is even in xi.
    """
    xi, angles = 1e-6, (math.radians(contact.degrees), math.radians(neumann.degrees))
    found = float(ratio(contact, neumann, F(1, 10**6)).lo)
    within = xi * (first_order(contact) + first_order(neumann)) + NEGLIGIBLE
    assert found == pytest.approx(end(contact.body, neumann.body, angles)[1], rel=within)
    found = float(ratio(contact, neumann, F(1, 10**6), normal=True).lo)
    assert found == pytest.approx(free_end(contact.body, neumann.body, angles), rel=NEGLIGIBLE)


@given(bodies, bodies)
def test_two_half_planes_differ_from_their_limit_by_all_of_the_first_order(contact, neumann):
    pair = Wedge(body=contact, degrees=180), Wedge(body=neumann, degrees=180)
    found, (_, limit) = float(ratio(*pair, F(1, 10**6)).lo), end(contact, neumann, (math.pi, math.pi))
    assert found / limit - 1 == pytest.approx(1e-6 * sum(map(first_order, pair)), abs=NEGLIGIBLE)


@given(wedges, wedges, numbers)
def test_the_ratio_is_the_largest_eigenvalue_of_both_symbols_with_one_body_reflected(contact, neumann, xi):
    C, N = opposite(matrix(contact, xi)), matrix(neumann, xi)
    assert float(ratio(contact, neumann, xi).lo) == pytest.approx(eigh(C, N, eigvals_only=True)[-1], rel=1e-7)
    left = lambda S: (np.linalg.det(S) / S[0, 0]).real
    assert float(ratio(contact, neumann, xi, normal=True).lo) == pytest.approx(left(C) / left(N), rel=1e-7)


@given(free_wedges, free_wedges, numbers)
def test_without_tangential_forces_poisson_s_ratio_enters_through_e_star_alone(contact, neumann, xi):
    def stiff(wedge):
        x, omega = float(xi), math.radians(wedge.degrees)
        whole = math.sinh(x * omega) ** 2 - (x * math.sin(omega)) ** 2
        return float(wedge.body.e_star) * whole / (math.sinh(2 * x * omega) + x * math.sin(2 * omega))

    found = float(ratio(contact, neumann, xi, normal=True).lo)
    assert found == pytest.approx(stiff(contact) / stiff(neumann), rel=1e-9)


@given(wedges, numbers)
def test_mirror_images_have_equal_energies_without_tangential_forces_and_reciprocal_eigenvalues_with_them(wedge, xi):
    assert float(ratio(wedge, wedge, xi, normal=True).lo) == pytest.approx(1, rel=1e-12)
    least, largest = eigh(opposite(matrix(wedge, xi)), matrix(wedge, xi), eigvals_only=True)
    assert float(ratio(wedge, wedge, xi).lo) == pytest.approx(largest, rel=1e-7)
    assert least * largest == pytest.approx(1, rel=1e-6)


@given(bodies, openings, openings, numbers)
def test_more_material_and_a_clamped_side_make_a_wedge_stiffer(body, one, other, xi):
    small, large = sorted((one, other))
    free = [matrix(Wedge(body=body, degrees=opening), xi) for opening in (small, large)]
    clamped = [matrix(Wedge(body=body, degrees=opening, clamped=True), xi) for opening in (small, large)]
    for less, more in ((free[0], free[1]), (clamped[1], clamped[0]), (free[1], clamped[1])):
        assert eigh(more - less, eigvals_only=True)[0] >= -1e-12 * abs(more).max()


# --- bounds ----------------------------------------------------------------------------------------------------------

SOFT, HARD = Moduli(young=20000, poisson="0.3"), Moduli(young=70000, poisson="0.3")


def bound(contact, neumann, angles, **how):
    one, other = angles
    return end_bound(Wedge(body=contact, degrees=one), Wedge(body=neumann, degrees=other), **how)


def test_the_end_of_section_6_adds_nothing_above_the_half_planes_and_sets_rho_with_exchanged_roles():
    lower = bound(SOFT, HARD, (90, 180))
    assert (lower.least, lower.xi) == (half_planes(SOFT, HARD).high, None)
    assert bound(SOFT, HARD, (90, 180), normal=True).least == F(2, 7)  # what the mirror proves from above
    assert float(bound(HARD, SOFT, (180, 90)).least) == pytest.approx(3.5 * math.pi / (math.pi / 2 - 1), rel=1e-9)
    both = 3.5 * (math.pi + 2) / (math.pi - 2)
    assert float(bound(HARD, SOFT, (90, 90)).least) == pytest.approx(both, rel=1e-9)


def test_neither_a_force_at_the_apex_nor_half_planes_need_have_the_largest_ratio():
    stiff, soft = Moduli(young=1, poisson="0.3"), Moduli(young=1, poisson=0)
    for neumann, opening in ((stiff, 135), (soft, 120)):
        found = bound(stiff, neumann, (180, opening))
        known = max(end(stiff, neumann, (math.pi, math.radians(opening)))[1], float(half_planes(stiff, neumann).high))
        assert found.least > 1.05 * known
        assert found.least == pytest.approx(
            max(
                F(ratio(Wedge(body=stiff, degrees=180), Wedge(body=neumann, degrees=opening), F(n, 100)).lo)
                for n in range(20, 50)
            ),
            rel=1e-4,
        )


@fewer(5, at_night=2)
@given(wedges, wedges, numbers)
def test_no_exponent_exceeds_what_the_search_finds(contact, neumann, xi):
    if contact.clamped and not neumann.clamped:
        with pytest.raises(HypothesisError, match="clamped"):
            end_bound(contact, neumann)
        return
    for normal in (False, True):
        found = end_bound(contact, neumann, normal=normal)
        assert F(ratio(contact, neumann, xi, normal=normal).lo) <= found.least * F(10001, 10000)


def test_a_clamped_contact_body_at_a_free_neumann_body_has_no_finite_rho():
    contact, neumann = Wedge(body=SOFT, degrees=90, clamped=True), Wedge(body=SOFT, degrees=90)
    growing = [ratio(contact, neumann, F(1, 10**n)).lo for n in (1, 2, 3)]
    assert growing[1] > 90 * growing[0] > 0
    assert growing[2] > 90 * growing[1]


@pytest.mark.parametrize(
    ("make", "key"),
    [
        (lambda: Wedge(body=SOFT, degrees=0), "degrees"),
        (lambda: Wedge(body=SOFT, degrees=360), "degrees"),
        (lambda: Wedge(body=Moduli(young=1, poisson="1/2"), degrees=90), "nu"),
        (lambda: Wedge(body=Moduli(young=1, poisson="0.3", plane="3d"), degrees=90), "plane"),
        (lambda: Wedge(body=SOFT, degrees=90).symbol(0), "xi"),
    ],
)
def test_what_the_theory_does_not_speak_of_is_refused(make, key):
    with pytest.raises(HypothesisError, match=key):
        make()


# --- finite elements -------------------------------------------------------------------------------------------------


def on_the_side(wedge, radii, cells, last, *, above=True):
    """Schur complement of a sector, its arc clamped, on the nodes of Gamma_c up to one: those of phi = 0."""
    omega = math.radians(wedge.degrees)
    mesh = sector((0.0, omega) if above else (-omega, 0.0), radii, cells)
    near, beyond = ("first", "second") if above else ("second", "first")
    unknowns = lambda nodes: (2 * np.asarray(nodes)[:, None] + [0, 1]).ravel()
    held = [mesh.sides["arc"], mesh.sides[beyond]] if wedge.clamped else [mesh.sides["arc"]]
    free = np.setdiff1d(np.arange(2 * len(mesh.points)), unknowns(np.unique(np.concatenate(held))))
    nodes = mesh.sides[near][:last, 1]
    A = stiffness(mesh, plane_strain(float(wedge.body.young), float(wedge.body.poisson)))
    return Condensation(A[free][:, free].tocsc(), np.searchsorted(free, unknowns(nodes))).schur


@pytest.mark.parametrize("clamped", [False, True])
def test_energies_on_graded_meshes_fall_to_the_integral_of_the_symbol_like_the_square_of_the_cells(clamped):
    """A wave of finite length along Gamma_c, far from the apex and from the arc in powers of ten."""
    wedge = Wedge(body=Moduli(young=3, poisson="0.2"), degrees=130, clamped=clamped)
    width, centre, xi, h = 1.2, math.log(1e-6), 0.8, np.array([1.0, 0.4 - 0.7j])

    wave = lambda s: np.exp(1j * xi * s - ((s - centre) / width) ** 2 / 2)
    points, weights = np.polynomial.hermite.hermgauss(60)  # the transform of the wave is a Gaussian around xi

    def symbol(at):
        """S at any real number: of -xi it is the conjugate."""
        S = matrix(wedge, F(abs(at)))
        return S if at > 0 else S.conj()

    exact = width * sum(w * (h.conj() @ symbol(xi + x / width) @ h).real for x, w in zip(points, weights, strict=True))
    errors = []
    for cells in (12, 24):
        ratio_of_radii = math.exp(math.radians(130) / cells)
        count = math.ceil(math.log(1e12) / math.log(ratio_of_radii))
        radii = ratio_of_radii ** np.arange(-count, 1.0)
        S = on_the_side(wedge, radii, cells, count)
        v = np.kron(wave(np.log(radii[:-1])), h)
        errors.append((v.conj() @ S @ v).real / exact - 1)
    assert 0 < errors[1] < 0.02
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.15)


def test_rho_on_graded_meshes_shows_the_branch_between_the_apex_and_the_half_planes():
    flat, corner = (
        Wedge(body=Moduli(young=1, poisson="0.3"), degrees=180),
        Wedge(body=Moduli(young=1, poisson=0), degrees=120),
    )
    known = max(
        end(flat.body, corner.body, (math.pi, 2 * math.pi / 3))[1], float(half_planes(flat.body, corner.body).high)
    )
    found = []
    for cells in (8, 16):
        radii = np.append(np.geomspace(1e-13, 0.25, 6 * cells), np.linspace(0.25, 1, cells // 2)[1:])
        S_c, S_n = (
            on_the_side(wedge, radii, cells, 6 * cells, above=above) for wedge, above in ((flat, True), (corner, False))
        )
        found.append(eigh(S_c, S_n, eigvals_only=True)[-1])
    assert found == sorted(found)
    assert found[-1] > 1.05 * known
    assert found[-1] == pytest.approx(float(end_bound(flat, corner).least), rel=0.02)
