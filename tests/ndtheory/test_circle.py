"""The circle criterion at one wave number, against the norm that it says exists and against matrices on the circle."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import eigvalsh
from strategies import fewer

from ndtheory.continuum.circle import Multipliers, TwoLayers, disk, energy_form, pencil
from ndtheory.continuum.intervals import Interval
from ndtheory.continuum.strip import Strip, smooth, times_smooth
from ndtheory.moduli import Moduli

positive = st.floats(0.1, 10)


@st.composite
def flexibilities(draw):
    """TT, NN, NT of a positive definite matrix."""
    along, across, share = draw(positive), draw(positive), draw(st.floats(-0.9, 0.9))
    return along, across, share * np.sqrt(along * across)


def form(contact, neumann, h, by, smooth_square):
    """M(h), from its definition."""
    matrix = lambda a: np.array([[a[0], a[2]], [a[2], a[1]]])
    V = h * matrix(neumann) + matrix(contact)
    weighted = np.diag([1, by.normal]) @ V
    taken = by.beta * np.outer(V[0].conj(), V[0])
    taken[1, 1] += by.alpha * smooth_square * abs(h) ** 2
    return (weighted + weighted.conj().T) / 2 - taken


def on_circle(theta, q, phi):
    return theta / (q * np.exp(1j * phi) - (1 - theta))


@given(flexibilities(), flexibilities(), st.floats(0.05, 1), st.floats(0.02, 1), positive, positive, positive)
def test_two_matrices_and_one_number_are_the_form_on_the_whole_circle(contact, neumann, theta, share, lam, alpha, beta):
    q = 1 - theta + share * theta
    by, low_high = Multipliers(normal=lam, alpha=alpha / 100, beta=beta / 100), disk(theta, q)
    found = pencil(contact, neumann, by, 0.7, low_high)
    for phi in np.linspace(0, np.pi, 25):
        h = on_circle(theta, q, phi)
        M = form(contact, neumann, h, by, 0.7)
        u = (h.real - low_high[0]) / (low_high[1] - low_high[0])
        first, second, middle = found.determinants
        determinant = first * (1 - u) ** 2 + 2 * middle * u * (1 - u) + second * u**2
        size = np.abs(M).max() ** 2 + abs(first) + abs(second)
        assert determinant == pytest.approx(np.linalg.det(M).real, abs=1e-9 * size)
        low, high = found.low, found.high
        assert (1 - u) * low[0] + u * high[0] == pytest.approx(M[0, 0].real, abs=1e-9 * np.sqrt(size))
    assert (
        abs(
            form(contact, neumann, low_high[1], by, 0.7) - form(contact, neumann, on_circle(theta, q, 0), by, 0.7)
        ).max()
        < 1e-6 * np.abs(M).max() + 1e-6 * abs(low_high[1]) ** 2
    )


def norm_exists(contact, neumann, theta, q, by, smooth_square):
    """A conic solver: does some Q make ``q^2 |g|^2 - |(1 - theta) g + theta p|^2 + M`` positive definite?  And Q."""
    import cvxpy as cp

    Q = cp.Variable((2, 2), symmetric=True)
    A = lambda a: np.array([[a[0], a[2]], [a[2], a[1]]])
    jump = np.hstack([A(neumann), A(contact)])
    force, taken = np.eye(4)[2:], np.eye(4)[:2]
    step = (1 - theta) * taken + theta * force
    M = np.outer(force[0], jump[0]) + by.normal * np.outer(force[1], jump[1])
    M = (M + M.T) / 2 - by.beta * np.outer(jump[0], jump[0])
    M -= by.alpha * smooth_square * np.outer(taken[1], taken[1])
    slack = cp.Variable()
    whole = q**2 * taken.T @ Q @ taken - step.T @ Q @ step + M - slack * np.eye(4)
    problem = cp.Problem(cp.Maximize(slack), [(whole + whole.T) / 2 >> 0])
    problem.solve(solver=cp.CLARABEL)
    return problem.status in ("optimal", "optimal_inaccurate") and slack.value > 1e-7, Q.value


@fewer(2)
@given(flexibilities(), flexibilities(), st.floats(0.1, 1), st.floats(0.1, 1), st.floats(0.3, 3), st.floats(0, 0.3))
def test_a_norm_exists_where_the_form_is_definite_on_the_circle_and_nowhere_else(c, n, theta, share, lam, size):
    q = 1 - theta + share * theta
    by = Multipliers(normal=lam, alpha=size, beta=size / 3)
    least = min(eigvalsh(form(c, n, on_circle(theta, q, phi), by, 1.0))[0] for phi in np.linspace(0, np.pi, 2001))
    if abs(least) < 1e-3:  # near the border a solver decides nothing
        return
    exists, Q = norm_exists(c, n, theta, q, by, 1.0)
    assert exists == (least > 0)
    if exists:
        assert np.linalg.eigvalsh(Q)[0] > 0


@pytest.mark.parametrize("radius", [Fraction(1, 10), Fraction(3)])
def test_the_smoothing_lies_in_its_enclosures(radius):
    xi = lambda t: float(np.sinc(float(radius) * t / 2 / np.pi) ** 4)
    for lo, hi in ((0, 1), (1, 3), (3, 50), (50, 70), (100, 4000), (2, None), (90, None)):
        part = Fraction(lo), None if hi is None else Fraction(hi)
        inside, times = smooth(part, radius), times_smooth(part, radius) if lo else None
        for t in np.linspace(max(lo, 1e-9), hi or 10 * lo + 100, 40):
            assert float(inside.lo) - 1e-15 <= xi(t) <= float(inside.hi) * (1 + 1e-12) + 1e-15
            if times is not None:
                assert float(times.lo) - 1e-12 <= t * xi(t) <= float(times.hi) * (1 + 1e-12) + 1e-12


def test_what_is_proved_in_intervals_is_refused_with_a_little_less():
    strip = lambda young: Strip(body=Moduli(young=young, poisson="0.3"), thickness=Fraction(3, 10))
    layers = TwoLayers(contact=strip(20000), neumann=strip(70000), radius=Fraction(1, 10))
    beta = Fraction(4904)
    by = Multipliers(normal=Fraction(11), alpha=Fraction(4, 100) / (4 * beta), beta=beta)
    theta = Fraction(7, 10)
    assert layers.contracts(disk(theta, Fraction("0.349")), by)
    for worse in (
        disk(theta, Fraction("0.345")),  # no norm has this factor with these multipliers
        disk(theta, Fraction("0.31")),
    ):
        assert not layers.contracts(worse, by)
    for changed in ({"normal": Fraction(1)}, {"alpha": 2 * by.alpha}, {"beta": 3 * beta}):
        assert not layers.contracts(disk(theta, Fraction("0.349")), Multipliers(**{**vars(by), **changed}))
    assert not layers.swapped.contracts(disk(theta, Fraction("0.349")), by)


@given(flexibilities(), flexibilities(), st.floats(0.1, 1), st.floats(0.1, 1.5), positive, positive, positive)
def test_the_form_in_energy_is_its_definition(contact, neumann, theta, q, lam, alpha, beta):
    by, weight = Multipliers(normal=lam, alpha=alpha, beta=beta), 1.7
    found = np.array(energy_form(contact, neumann, by, 0.6, (theta, 1 - theta, q**2), weight))
    A = lambda a: np.array([[a[0], a[2]], [a[2], a[1]]])
    x = np.array([0.3, -1.2, 0.7, 2.0])
    g, p = x[:2], x[2:]
    v, step = A(neumann) @ g + A(contact) @ p, theta * p + (1 - theta) * g
    M = p[0] * v[0] + lam * p[1] * v[1] - alpha * 0.6 * g[1] ** 2 - beta * v[0] ** 2
    wanted = q**2 * g @ A(neumann) @ g - step @ A(neumann) @ step + weight * M
    assert x @ found @ x == pytest.approx(wanted, abs=1e-9 * np.abs(found).max())


def test_intervals_enclose_the_form_between_wave_numbers():
    strip = lambda young: Strip(body=Moduli(young=young, poisson="0.3"), thickness=Fraction(3, 10))
    layers = TwoLayers(contact=strip(20000), neumann=strip(70000), radius=Fraction(1, 10))
    by = Multipliers(normal=Fraction(11), alpha=Fraction(1, 10**6), beta=Fraction(4904)).enclosed
    ends = tuple(map(Interval.of, disk(Fraction(7, 10), Fraction("0.349"))))
    for lo, hi in ((1, 2), (5, 6), (20, 24)):
        whole = pencil(*layers.enclosed((Fraction(lo), Fraction(hi)), by), ends)
        point = pencil(*layers.enclosed((Fraction(lo + hi, 2),) * 2, by), ends)
        numbers = lambda found: (*found.low, *found.high, found.turn)
        for wide, narrow in zip(numbers(whole), numbers(point), strict=True):
            assert wide.lo <= narrow.lo <= narrow.hi <= wide.hi
