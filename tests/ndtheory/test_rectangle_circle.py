"""The circle criterion for two rectangles: its proof in intervals against an evaluation in doubles from the definition.

That evaluation has flexibilities of layers of its own, and draws differences of rectangles and layers at their bounds.
"""

from dataclasses import dataclass, replace
from fractions import Fraction as F

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import eigvalsh

from ndtheory.continuum.circle import TwoLayers, disk
from ndtheory.continuum.rectangle_circle import SMALL_THETAS, RectangleCircle, RectangleMultipliers
from ndtheory.continuum.strip import Strip
from ndtheory.moduli import Moduli

STRIPS = {young: Strip(body=Moduli(young=young, poisson="0.3"), thickness=F(3, 10)) for young in (20000, 70000)}

#: Section 6 with r = 0.1 mm and the bounds of its constants, rounded up.
SECTION_6 = RectangleCircle(
    layers=TwoLayers(contact=STRIPS[20000], neumann=STRIPS[70000], radius=F(1, 10)),
    C_t1_square=F("5.7945e-5"),
    C_t2_square=F("9.7244e-6"),
    cut_off=F("0.42538"),
)

#: The same with the roles exchanged: Gamma_c is a whole side of the Neumann body.
EXCHANGED = RectangleCircle(
    layers=SECTION_6.layers.swapped, C_t1_square=SECTION_6.C_t2_square, C_t2_square=SECTION_6.C_t1_square, cut_off=None
)


def allowing(k, beta, nu, mu):
    """Multipliers that allow a friction."""
    beta = F(beta)
    return RectangleMultipliers(alpha=F(k) ** 2 / (4 * beta), beta=beta, nu=F(nu), mu=F(mu))


#: A criterion, the ends of a circle, and multipliers that prove it there.
PROVED = {
    "every small theta": (SECTION_6, SMALL_THETAS, allowing("0.7898", 14253, 0, "0.6")),
    "roles exchanged": (EXCHANGED, SMALL_THETAS, allowing("0.7963", 14490, 0, 1)),
    "0.7": (SECTION_6, disk(F("0.7"), F("0.4836")), allowing("0.2", 8692, "1.15787", "0.3")),
    "0.6, k = 0.6": (SECTION_6, disk(F("0.6"), F("0.8863")), allowing("0.6", 12595, "0.601882", "0.3")),
}

cases = pytest.mark.parametrize("case", PROVED)


def layer(young, xi, side):
    """The flexibility of a layer of thickness 0.3 and nu = 0.3 for (iT, N), from its stiffness in docs/continuum.md."""
    G, kappa, x = young / 2.6, 1.8, 0.3 * xi
    D = kappa**2 * np.sinh(x) ** 2 - x**2
    along, across = ((kappa + 1) * (kappa * np.sinh(2 * x) + s * 2 * x) / (2 * D) for s in (-1, 1))
    mixed = side * (kappa * (kappa - 1) * np.sinh(x) ** 2 - 2 * x**2) / D
    return np.linalg.inv(G * xi * np.array([[along, mixed], [mixed, across]]))


def smooth(xi):
    """The square of the smoothing with r = 0.1."""
    return np.sinc(0.1 * xi / 2 / np.pi) ** 4


def on_circle(ends, count):
    low, high = map(float, ends)
    return (low + high) / 2 + (high - low) / 2 * np.exp(1j * np.linspace(0, np.pi, count))


@dataclass
class Written:
    """The criterion in doubles, from the text of the theorem."""

    circle: RectangleCircle
    ends: tuple
    by: RectangleMultipliers

    def __post_init__(self):
        strips = (self.circle.layers.contact, self.circle.layers.neumann)
        self.young = [float(strip.body.young) for strip in strips]
        self.c2, self.t2, self.eps = (
            float(value or 0) for value in (self.circle.C_t1_square, self.circle.C_t2_square, self.circle.cut_off)
        )
        self.alpha, self.beta, self.nu, self.mu = (
            float(getattr(self.by, name)) for name in ("alpha", "beta", "nu", "mu")
        )

    def flexibilities(self, xi):
        """A_c and A_n."""
        return layer(self.young[0], xi, -1), layer(self.young[1], xi, 1)

    @property
    def sigma(self):
        h = on_circle(self.ends, 2001)
        h = h[abs(h) > 1e-9]
        return (abs(h) ** 2 / (h.real + self.nu)).max()

    def b(self, A_c, A_n):
        taken = (1 - self.mu) * self.eps * A_n[0, 0] + self.mu * (self.t2 - A_n[0, 0])
        return 1 / self.beta - (self.c2 - A_c[0, 0]) - self.sigma * taken

    def forms(self, xi, h):
        """The Hermitian matrix of p for each h."""
        A_c, A_n = self.flexibilities(xi)
        v = h[:, None, None] * A_n + A_c
        slides = v[:, :1].conj().transpose(0, 2, 1) @ v[:, :1]
        found = (v + v.conj().transpose(0, 2, 1)) / 2 - self.nu * self.eps * A_n - slides / self.b(A_c, A_n)
        found[:, 1, 1] -= self.alpha * abs(h) ** 2 * smooth(xi)
        return found

    def least(self, waves=300, points=31):
        """The least eigenvalue against A_c, over wave numbers and the circle."""
        found = []
        for xi in np.geomspace(0.05, 900, waves):
            L = np.linalg.inv(np.linalg.cholesky(self.flexibilities(xi)[0]))
            found.append(np.linalg.eigvalsh(L @ self.forms(xi, on_circle(self.ends, points)) @ L.T).min())
        return min(found)


def rougher(by, times):
    """Multipliers for the friction times a number."""
    return replace(by, alpha=by.alpha * F(times) ** 2)


@cases
def test_what_is_proved_is_positive_in_doubles_and_is_neither_at_larger_friction(case):
    circle, ends, by = PROVED[case]
    assert circle.contracts(ends, by)
    assert Written(circle, ends, by).least() > 2e-4
    more = rougher(by, "1.3")
    if case in ("every small theta", "0.7"):
        assert not circle.contracts(ends, more)
    assert Written(circle, ends, more).least() < -0.01


@cases
@given(st.floats(0.05, 300), st.floats(0, 1))
def test_the_pencil_is_the_form_of_the_theorem(case, xi, u):
    circle, ends, by = PROVED[case]
    written = Written(circle, ends, by)
    as_tuple = lambda A: (A[0, 0], A[1, 1], A[0, 1])
    A_c, A_n = map(as_tuple, written.flexibilities(xi))
    circle = replace(circle, C_t1_square=written.c2, C_t2_square=written.t2, cut_off=written.eps)
    by, (low, high) = (
        replace(by, alpha=written.alpha, beta=written.beta, mu=written.mu, nu=written.nu),
        map(float, ends),
    )
    slack = circle.slack(A_c[0], A_n[0], by.beta, by, written.sigma)
    assert slack == pytest.approx(by.beta * written.b(*written.flexibilities(xi)), rel=1e-5)
    found = circle.pencil(A_c, A_n, by, smooth(xi), (low, high), slack, by.nu)
    h = (1 - u) * low + u * high + 1j * np.sqrt(u * (1 - u)) * (high - low)
    M = written.forms(xi, np.array([h]))[0]
    turn = 1j * found.turn * np.sqrt(u * (1 - u))
    entries = [(1 - u) * a + u * b for a, b in zip(found.low, found.high, strict=True)]
    wanted = np.array([[entries[0], entries[2] + turn], [entries[2] - turn, entries[1]]])
    size = np.abs(M).max() + np.abs(found.high).max()
    assert min(np.abs(M - wanted).max(), np.abs(M - wanted.conj()).max()) < 1e-5 * size


@pytest.mark.parametrize(
    ("case", "worse"),
    [
        ("every small theta", {"C_t1_square": F("7e-5")}),
        ("every small theta", {"C_t2_square": F("2e-5")}),
        ("every small theta", {"cut_off": F(2)}),
        ("0.7", {"cut_off": F("0.6")}),
    ],
)
def test_a_larger_constant_is_refused(case, worse):
    circle, ends, by = PROVED[case]
    assert not replace(circle, **worse).contracts(ends, by)


@pytest.mark.parametrize(
    ("case", "changed"),
    [
        ("0.7", {"nu": F(1, 5)}),  # not above -x_1 = 0.89
        ("0.7", {"nu": F(9, 10), "alpha": F(1, 10**9), "beta": F(6000)}),  # x_1^2/(x_1 + nu) = 119
        ("0.7", {"mu": F(-1, 10)}),
        ("0.7", {"normal": F(2)}),
        ("0.7", {"alpha": F(0)}),
        ("every small theta", {"beta": F(10**6)}),  # b < 0
        ("every small theta", {"nu": F(-1, 10)}),
        ("every small theta", {"mu": F(11, 10)}),
        ("roles exchanged", {"mu": F(9, 10)}),  # there is no cut-off
    ],
)
def test_other_multipliers_are_refused(case, changed):
    circle, ends, by = PROVED[case]
    assert not circle.contracts(ends, replace(by, **changed))


def test_without_a_cut_off_nothing_is_proved_for_any_theta():
    small = allowing("0.01", 10000, 1, 1)
    assert not EXCHANGED.contracts(disk(F(1, 10), F(99, 100)), small)
    assert replace(EXCHANGED, cut_off=F(1, 100)).contracts(disk(F(1, 10), F(99, 100)), replace(small, nu=F(1, 10)))
    assert not replace(SECTION_6, cut_off=None).contracts(*PROVED["every small theta"][1:])


def least_of_bodies(written, draws, rng):
    """The least eigenvalue of M against A_c over differences of rectangles and layers at their bounds, on six waves."""
    A_c, A_n, smoothed, T = np.zeros((12, 12)), np.zeros((12, 12)), np.zeros(12), np.eye(12)[::2]
    for i, xi in enumerate(np.geomspace(2, 60, 6)):
        here = slice(2 * i, 2 * i + 2)
        A_c[here, here], A_n[here, here] = written.flexibilities(xi)
        smoothed[2 * i + 1] = smooth(xi)
    along = lambda E: T @ E @ T.T
    limits = [
        (written.c2 * np.eye(6) - along(A_c), None),
        (
            # the proof uses the mean of both bounds only
            (1 - written.mu) * written.eps * along(A_n) + written.mu * (written.t2 * np.eye(6) - along(A_n)),
            written.eps * A_n if written.nu else None,
        ),
    ]
    least = np.inf
    for _ in range(draws):
        found = []
        for tangential, whole in limits:
            X = (rng.normal(size=(12, 2)) + 1j * rng.normal(size=(12, 2))) * 10.0 ** rng.uniform(-2, 2, (12, 1))
            E = X @ X.conj().T
            size = eigvalsh(along(E), tangential)[-1]
            found.append(E / max(size, 0 if whole is None else eigvalsh(E, whole)[-1]))
        for h in on_circle(written.ends, 9):
            v = h * (A_n + found[1]) + A_c + found[0]
            M = (v + v.conj().T) / 2 - written.alpha * abs(h) ** 2 * np.diag(smoothed)
            M -= written.beta * (T @ v).conj().T @ (T @ v)
            least = min(least, eigvalsh(M, A_c)[0])
    return least


@cases
def test_bodies_at_the_bounds_of_the_comparison_are_positive_and_no_longer_at_larger_friction(case):
    circle, ends, by = PROVED[case]
    rng = np.random.default_rng(1)
    assert least_of_bodies(Written(circle, ends, by), 60, rng) > 0
    assert least_of_bodies(Written(circle, ends, rougher(by, "1.3")), 20, rng) < -0.01
