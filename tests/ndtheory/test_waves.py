"""Heat between plates and a fluid at a wall: bounds from material data against discretised models written for it."""

import math
from fractions import Fraction as F

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import special
from scipy.linalg import eigh, solve_banded

from ndtheory.energy_norms import parallel_factor
from ndtheory.moduli import Wall, added_mass, bessel_ratio, conduction

sizes = st.floats(1e-2, 1e2).map(lambda value: F(value).limit_denominator(1000))
pairs = st.tuples(sizes, sizes)


# --- heat ------------------------------------------------------------------------------------------------------------


def flux(q: float, k: float, d: float, c_by_dt: float, exchange: float, cells: int = 400) -> float:
    """Flux of a plate for the temperature cos(q x) of its side: a tridiagonal system across its thickness.

    At the other side heat is exchanged with this coefficient: 0 insulates, inf holds the temperature.
    """
    h = d / cells
    own = (k * q * q + c_by_dt) * h / 6
    bands = np.zeros((3, cells + 1))
    bands[1] = 2 * (k / h + 2 * own)
    bands[1, [0, -1]] /= 2
    bands[0, 1:] = bands[2, :-1] = own - k / h
    if math.isinf(exchange):
        bands = bands[:, :-1]
    else:
        bands[1, -1] += exchange
    load = np.zeros(bands.shape[1])
    load[0] = 1
    return 1 / float(solve_banded((1, 1), bands, load)[0])


@pytest.mark.parametrize("far", [(0.0, 0.0), (0.0, math.inf), (math.inf, 0.0), (3.0, 0.2), (math.inf, math.inf)])
@pytest.mark.parametrize("dt", [F(1, 100), F(1)])
def test_no_wave_of_two_plates_in_time_leaves_the_range_whatever_holds_their_other_sides(far, dt):
    k, c, d = (F(5), F(1, 2)), (F(3), F(4)), (F(1), F(1, 2))
    low, high = conduction(k, capacity=c, thickness=d, dt=dt)
    one, two = zip(map(float, k), map(float, d), (float(a / dt) for a in c), far, strict=True)
    found = [flux(q, *one) / flux(q, *two) for q in (0.0, 0.3, 1.0, 3.0, 10.0, 30.0)]
    assert low * (1 - 1e-3) <= min(found)
    assert max(found) <= high * (1 + 1e-3)


def test_the_range_of_steady_plates_is_attained_by_long_and_by_short_waves():
    k, d = (F(5), F(1, 2)), (F(1), F(3))
    low, high = conduction(k, thickness=d)
    assert (low, high) == (10, 30)
    ratio = lambda q: flux(q, 5, 1, 0, math.inf) / flux(q, 0.5, 3, 0, math.inf)
    assert ratio(1e-4) == pytest.approx(30, rel=1e-4)
    assert ratio(12.0) == pytest.approx(10, rel=1e-2)
    waves = [ratio(q) for q in np.geomspace(1e-2, 20, 12)]
    assert waves == sorted(waves, reverse=True)


def test_the_range_of_thick_plates_in_time_is_attained_and_free_of_the_step():
    k, c = (F(5), F(1, 2)), (F(3), F(4))
    low, high = conduction(k, capacity=c)
    assert (low, high) == (pytest.approx(math.sqrt(7.5)), 10)
    for dt in (F(1, 10), F(10)):
        ratio = lambda q, dt=float(dt): math.sqrt((25 * q * q + 15 / dt) / (0.25 * q * q + 2 / dt))
        assert ratio(0) == pytest.approx(low)
        assert ratio(1e6) == pytest.approx(high)
        thick = conduction(k, capacity=c, thickness=(F(1000), F(1000)), dt=dt)
        assert thick == (pytest.approx(low), pytest.approx(high))
    deep = [float(math.sqrt(a / b * 0.01)) * 5 for a, b in zip(k, c, strict=True)]
    with_cells = flux(0, 5, deep[0], 300, 0.0) / flux(0, 0.5, deep[1], 400, 0.0)
    assert with_cells == pytest.approx(low, rel=1e-3)


@given(pairs, st.none() | pairs, st.none() | pairs, sizes)
def test_plates_that_change_places_have_inverse_ranges_and_units_do_not_count(k, c, d, dt):
    given_ = {"capacity": c, "thickness": d, "dt": dt}
    turned = {key: value[::-1] if isinstance(value, tuple) else value for key, value in given_.items()}
    low, high = conduction(k, **given_)
    there = conduction(k[::-1], **turned)
    assert 0 <= low <= high
    if math.isfinite(high) and low > 0:
        assert there == (pytest.approx(1 / high), pytest.approx(1 / low))
    scaled = {"capacity": c and (7 * c[0], 7 * c[1]), "thickness": d and (3 * d[0], 3 * d[1]), "dt": dt * 9}
    assert conduction((7 * k[0], 7 * k[1]), **scaled) == (pytest.approx(low), pytest.approx(high))


@given(st.lists(st.floats(0, 50), min_size=1, max_size=6), st.floats(0.01, 1))
def test_parallel_coupling_multiplies_by_the_spectral_radius_of_both_fields_and_is_best_at_one_over_one_plus_rho(
    modes, theta
):
    def radius(theta):
        """Both fields of a mode, S_n = 1 and S_c = lambda: each solver reads what the other one wrote before."""
        steps = ((1 - theta) * np.eye(2) + theta * np.array([[0, 1], [-mode, 0]]) for mode in modes)
        return max(abs(np.linalg.eigvals(step)).max() for step in steps)

    rho = max(modes)
    assert parallel_factor(theta, rho) == pytest.approx(radius(theta), rel=1e-6)
    assert (radius(theta) < 1 - 1e-9) == (theta * (1 + rho) < 2 - 1e-9) or abs(theta * (1 + rho) - 2) < 1e-6
    assert radius(1 / (1 + rho)) <= radius(theta) * (1 + 1e-9)
    assert parallel_factor(1 / (1 + rho), rho) == pytest.approx(math.sqrt(rho / (1 + rho)))


# --- a fluid at a wall -----------------------------------------------------------------------------------------------


def over_a_plate(*, wide: float, deep: float, sides: str, top: str, n: int = 14) -> np.ndarray:
    """Added mass of a fluid of density 1 at the nodes of a plate of length 1, by bilinear elements on squares.

    The fluid reaches ``wide`` beyond both ends of the plate, where the bottom is rigid; ``sides`` and ``top`` are open
    (no pressure) or rigid.
    """
    h, columns, rows = 1 / n, round((1 + 2 * wide) * n), round(deep * n)
    number = np.arange((columns + 1) * (rows + 1)).reshape(rows + 1, columns + 1)
    K = np.zeros((number.size, number.size))
    local = np.array([[4, -1, -2, -1], [-1, 4, -1, -2], [-2, -1, 4, -1], [-1, -2, -1, 4]]) / 6
    for j in range(rows):
        for i in range(columns):
            at = [number[j, i], number[j, i + 1], number[j + 1, i + 1], number[j + 1, i]]
            K[np.ix_(at, at)] += local
    fixed = [number[:, [0, -1]].ravel()] * (sides == "open") + [number[-1]] * (top == "open")
    free = np.setdiff1d(number.ravel(), np.concatenate(fixed) if fixed else [])
    first = round(wide * n)
    plate = number[0, first + 1 : first + n]  # its ends do not move
    load = np.zeros((number.size, len(plate)))
    whole = number[0, first : first + n + 1]
    mass = h / 6 * (4 * np.eye(n + 1) + np.eye(n + 1, k=1) + np.eye(n + 1, k=-1))
    mass[[0, -1], [0, -1]] /= 2
    load[whole] = mass[:, 1:-1]
    found = np.zeros_like(load)
    found[free] = np.linalg.solve(K[np.ix_(free, free)], load[free])
    return load.T @ found


def beam(n: int, D: float) -> tuple[np.ndarray, np.ndarray]:
    """Mass of a plate of weight 1 and its stiffness D u'''', with ends that may turn."""
    h = 1 / n
    second = (2 * np.eye(n - 1) - np.eye(n - 1, k=1) - np.eye(n - 1, k=-1)) / h**2
    mass = h / 6 * (4 * np.eye(n - 1) + np.eye(n - 1, k=1) + np.eye(n - 1, k=-1))
    return mass, D * h * second @ second


FLUIDS = [
    {"wide": 0.0, "deep": 1.0, "sides": "open", "top": "open"},
    {"wide": 0.5, "deep": 1.0, "sides": "open", "top": "open"},
    {"wide": 0.0, "deep": 1.5, "sides": "open", "top": "rigid"},
    {"wide": 0.5, "deep": 1.5, "sides": "rigid", "top": "open"},
]


@pytest.mark.parametrize("fluid", FLUIDS, ids=str)
@pytest.mark.parametrize("stiff", [0, 0.02])
def test_rho_of_a_plate_is_at_least_the_bound_whatever_the_fluid_beyond_the_square(fluid, stiff):
    plate = Wall(density=F(1), thickness=F(1, 2), length=F(1), young=F(stiff).limit_denominator(100) or None)
    bound = added_mass(3, plate, dt=F(2))
    added = 3 * over_a_plate(**fluid)
    mass, bending = beam(14, stiff / 96)  # E h^3/12
    rho = eigh(added, mass / 2 + 4 * bending, eigvals_only=True)[-1]
    assert rho >= bound * (1 - 5e-3)
    if fluid is FLUIDS[0]:
        assert rho == pytest.approx(bound, rel=1e-2)  # the model of which it is the exact value


def test_a_fluid_that_does_not_fill_the_square_may_miss_the_bound():
    plate = Wall(density=F(1), thickness=F(1, 2), length=F(1))
    flat = 3 * over_a_plate(wide=0.0, deep=0.25, sides="open", top="open")
    assert eigh(flat, beam(14, 0)[0] / 2, eigvals_only=True)[-1] < 0.8 * added_mass(3, plate)


def in_a_tube(radius: float, ends: str, n: int = 20) -> np.ndarray:
    """Added mass of a fluid of density 1 per area of the wall of a tube of length 1, by elements in z and r."""
    h, rings = 1 / n, 10
    r, w = np.linspace(0, radius, rings + 1), radius / rings
    number = np.arange((n + 1) * (rings + 1)).reshape(rings + 1, n + 1)
    K = np.zeros((number.size, number.size))
    line = lambda size: (np.array([[1, -1], [-1, 1]]) / size, size / 6 * np.array([[2, 1], [1, 2]]))
    (Dz, Mz), (Dr, Mr) = line(h), line(w)
    for j in range(rings):
        middle = (r[j] + r[j + 1]) / 2  # the weight r, by its mean in each ring
        block = middle * (np.kron(Mr, Dz) + np.kron(Dr, Mz))
        for i in range(n):
            at = [number[j, i], number[j, i + 1], number[j + 1, i], number[j + 1, i + 1]]
            K[np.ix_(at, at)] += block
    fixed = number[:, [0, -1]].ravel() if ends == "open" else number[:, 0]
    free = np.setdiff1d(number.ravel(), fixed)
    mass = h / 6 * (4 * np.eye(n + 1) + np.eye(n + 1, k=1) + np.eye(n + 1, k=-1))
    mass[[0, -1], [0, -1]] /= 2
    load = np.zeros((number.size, n - 1))
    load[number[-1]] = radius * mass[:, 1:-1]
    found = np.zeros_like(load)
    found[free] = np.linalg.solve(K[np.ix_(free, free)], load[free])
    return load.T @ found / radius


@pytest.mark.parametrize("radius", [F(1, 20), F(1, 4), F(1)])
@pytest.mark.parametrize("ends", ["open", "one rigid"])
@pytest.mark.parametrize("stiff", [0, 5])
def test_rho_of_a_tube_is_at_least_the_bound_whatever_its_ends(radius, ends, stiff):
    tube = Wall(density=F(2), thickness=F(1, 10), length=F(1), radius=radius, young=F(stiff) or None, poisson=F(3, 10))
    bound = added_mass(1, tube, dt=F(1, 10))
    mass, bending = beam(20, stiff * 1e-3 / 12 / 0.91)
    wall = mass * (0.2 + 0.01 * stiff * 0.1 / 0.91 / float(radius) ** 2) + 0.01 * bending
    rho = eigh(in_a_tube(float(radius), ends), wall, eigvals_only=True)[-1]
    assert rho >= bound * (1 - 5e-3)
    if ends == "open":
        assert rho == pytest.approx(bound, rel=1e-2)


@given(sizes, sizes, sizes, sizes, st.none() | sizes, st.none() | sizes, st.integers(1, 8))
def test_stiffness_and_shorter_waves_only_lower_the_ratio_and_units_do_not_count(fluid, density, h, L, R, E, n):
    made = lambda young, s=1, m=1: Wall(
        density=density * m, thickness=h * s, length=L * s, radius=R and R * s, young=young, poisson=F(1, 4)
    )
    plain, stiff = added_mass(fluid, made(None), wave=n), added_mass(fluid, made(E), dt=F(1), wave=n)
    assert stiff <= plain
    assert added_mass(fluid, made(E), dt=F(1), wave=n + 1) <= stiff * (1 + 1e-12)
    scaled = added_mass(fluid * 5, made(E and E * 5 * 9, s=3, m=5), dt=F(1), wave=n)  # m -> 3 m, kg -> 135 kg
    assert scaled == pytest.approx(stiff)


@given(st.floats(1e-3, 300))
def test_the_ratio_of_bessel_functions_is_above_both_of_its_limits(x):
    exact = special.ive(0, x) / special.ive(1, x)
    assert exact >= bessel_ratio(x) * (1 - 1e-12)
    assert bessel_ratio(x) >= max(1, 0.99 * exact) * (1 - 2e-4)
    assert exact >= 2 / x
