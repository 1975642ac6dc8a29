"""What iterates and their images show of the spectrum of a coupling."""

import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from linear_couplings import Linear, strips
from strategies import AT_NIGHT

import verification as vf
from verification.coupling.methods import steps
from verification.coupling.spectrum import Spectrum
from verification.coupling.vectors import falls, seen_in
from verification.registry import RULES


def estimated(low, high, error_low, error_high):
    return Spectrum(values=np.array([low, high], complex), source="vectors", error_low=error_low, error_high=error_high)


spectra = st.lists(st.floats(0.01, 30), min_size=2, max_size=12).map(sorted)
seeds = st.integers(0, 10**6)


@given(spectra, seeds)
def test_where_the_iterates_span_the_space_the_eigenvalues_are_all_of_them(values, seed):
    coupling = Linear(values, seed)
    X = np.random.default_rng(seed).normal(size=(len(values) + 3, len(values)))
    seen = seen_in(X, np.array([coupling(x) for x in X]))
    assert seen.directions == len(values)
    assert np.sort(seen.ritz.real) == pytest.approx(values, rel=1e-6, abs=1e-6)
    assert seen.symmetric
    assert not seen.changing


@given(spectra, seeds, st.integers(2, 9))
def test_ritz_values_lie_between_the_ends_where_the_inner_product_is_that_of_the_energy(values, seed, count):
    """With S_n = 1 the Euclidean norm is the one of the energy."""
    generator, n = np.random.default_rng(seed), len(values)
    Q, _ = np.linalg.qr(generator.normal(size=(n, n)))
    H, X = Q @ np.diag(values) @ Q.T, generator.normal(size=(count, n))
    seen = seen_in(X, 1.0 - X @ H)
    room = 1e-7 * (1 + values[-1])
    assert values[0] - room <= seen.ritz.real.min() <= seen.ritz.real.max() <= values[-1] + room
    # and an eigenvalue lies within each residual
    for end, error in ((seen.spectrum.low, seen.spectrum.error_low), (seen.spectrum.high, seen.spectrum.error_high)):
        assert error >= 0
        assert np.isfinite(end)


@given(spectra, seeds, st.floats(-6, 6), st.integers(3, 9))
def test_units_a_shift_and_a_rotation_change_no_eigenvalue(values, seed, decades, count):
    coupling, generator = Linear(values, seed), np.random.default_rng(seed)
    X, TX = coupling.run("constant", 1 / (2 + values[-1]), count)
    Q, _ = np.linalg.qr(generator.normal(size=(len(values),) * 2))
    shift, unit = generator.normal(size=len(values)), 10.0**decades
    seen, other = seen_in(X, TX), seen_in(unit * (X @ Q + shift), unit * (TX @ Q + shift))
    if seen.directions == other.directions:  # a direction may lie at the edge of rounding
        assert other.ritz.real.max() == pytest.approx(seen.ritz.real.max(), rel=1e-3)
        assert other.ritz.real.min() == pytest.approx(seen.ritz.real.min(), rel=1e-2, abs=1e-2 * (1 + values[-1]))


@pytest.mark.parametrize("rule", ["constant", "aitken", "anderson", "iqn-ils"])
@pytest.mark.parametrize("seed", range(5 if AT_NIGHT else 2))
def test_runs_by_any_method_show_the_ends(rule, seed):
    coupling = Linear(np.linspace(0.3, 6.0, 10), seed)
    seen = seen_in(*coupling.run(rule, 0.25, 10))
    assert seen.spectrum.high == pytest.approx(6.0, rel=0.05)
    assert seen.spectrum.low == pytest.approx(0.3, abs=0.25)


@pytest.mark.parametrize("seed", range(40 if AT_NIGHT else 8))
def test_theta_from_nine_iterates_of_aitken_never_diverges_and_is_near_the_best(seed):
    generator = np.random.default_rng(seed)
    low, high = 10 ** generator.uniform(-2, 0), 10 ** generator.uniform(0, 2.5)
    values = np.concatenate([[low, high], low + (high - low) * generator.beta(0.5, 0.5, size=24)])
    coupling = Linear(values, seed)
    theta = vf.advise_vectors(*coupling.run("aitken", 0.5, 9)).theta
    assert theta < 2 / (1 + high)
    taken = coupling.steps("constant", theta)
    best = min(coupling.steps("constant", 2 / (2 + low + high) * 1.05**k) or 3000 for k in range(-8, 3))
    assert taken is not None
    assert taken <= 1.4 * best


@pytest.mark.parametrize(("rule", "theta"), [("iqn-ils", 0.5), ("aitken", 0.5), ("constant", 0.5), ("constant", 0.05)])
def test_no_theta_diverges_where_smooth_data_hide_the_stiff_modes(rule, theta):
    neumann, contact, values = strips()
    assert values[[0, -1]] == pytest.approx([4.444, 104.4], rel=1e-3)
    following, x = RULES[rule].on_vectors(theta), np.zeros(len(values))
    X, TX, found = [], [], {}
    for count in range(1, 21):
        X.append(x)
        TX.append(contact(neumann(x)))
        x = following(x, TX[-1])
        if count > 1:
            found[count] = vf.advise_vectors(X, TX)
    thetas = {count: one.theta for count, one in found.items()}
    assert {count for count in thetas if thetas[count] is None} >= set(range(2, 10))
    assert all(theta * (1 + values[-1]) < 2 for theta in thetas.values() if theta is not None)
    if rule != "constant":  # both constant runs diverge, and their last iterates hold one mode above rounding
        assert thetas[20] == pytest.approx(2 / (2 + values[0] + values[-1]), rel=0.04)
    unfinished = found[6]
    assert "rho changes with every iterate (27.5, 36.1, 47.3), not found yet" in unfinished.summary
    assert unfinished.best.theta_predicted is unfinished.best.theta_tied is unfinished.quote is None
    assert unfinished.method.exchanged
    assert unfinished.methods[0].theta == pytest.approx(2 / (2 + 1 / values[0] + 1 / values[-1]), rel=0.01)
    said = str(unfinished.sections())
    assert "TO PASTE" not in said
    assert "'not found'" in said
    with pytest.raises(ValueError, match="not found yet"):
        unfinished.snippet("preCICE")


@pytest.mark.parametrize("tied", [False, True])
def test_a_wrong_sign_leaves_no_theta_and_no_method(tied):
    neumann, contact, _ = strips()
    coupled = vf.couple(neumann, lambda T: -contact(T), start=np.zeros(40), max_iterations=12)
    assert coupled.advice.theta is None
    assert "one solver with the wrong sign" in coupled.advice.summary
    coupling = Linear([0.5, 2.0, 8.0])
    X = np.random.default_rng(0).normal(size=(5, 3))
    found = vf.advise_vectors(X, [-coupling(x) for x in X], tied=tied)
    assert (found.theta, found.methods, found.method, found.spectrum) == (None, (), None, None)
    assert "all eigenvalues seem to be negative" in found.summary
    assert "open nodes" not in str(found.sections())
    assert "wrong sign" in found.to_dict()["reason"]["theta"]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("tied", [False, True])
@pytest.mark.parametrize("least", [-1.0, -3.0])
def test_an_eigenvalue_of_minus_one_or_less_leaves_no_theta(least, tied):
    X = np.random.default_rng(0).normal(size=(5, 3))
    found = vf.advise_vectors(X, -X * [least, 2.0, 8.0], tied=tied)
    assert found.theta is None
    assert f"an eigenvalue seems to be {least:g}, which these make: " in found.why_no_theta


def test_a_coupling_that_is_not_symmetric_has_complex_eigenvalues_and_a_theta_for_them():
    coupling = Linear([1.0, 1.0, 3.0, 3.0], skew=2.0)
    X = np.random.default_rng(1).normal(size=(6, 4))
    found = vf.advise_vectors(X, [coupling(x) for x in X])
    assert not found.vectors.symmetric
    assert sorted(found.spectrum.values.imag) == pytest.approx([-2, -2, 2, 2])
    grid = np.linspace(0.01, 0.6, 2000)
    factors = np.abs(1 - grid[:, None] * (1 + coupling.values)).max(axis=1)
    assert found.theta == pytest.approx(grid[factors.argmin()], abs=2e-3)
    assert "not symmetric" in str(found.sections())
    assert "real part" in found.quote
    assert "rho" not in found.quote


def test_complex_eigenvalues_of_contact_have_no_error_that_is_known():
    """Section 6 with friction: slip changes in the first steps, and the eigenvalue 1.14 found from all is none of T."""
    problem = vf.example("section6")
    for friction, known in (("0.2", False), ("0", True)):
        made = vf.run(problem.changed(friction=friction), theta="0.5")
        found = vf.advise_vectors([each.g for each in made.iterates], [each.image for each in made.iterates])
        assert (found.vectors.symmetric, found.vectors.error_high is not None) == (known, known)
        assert (found.theta is None) is not known  # 1.14, 1.09, 1.14 with more iterates
        assert ("friction, contact that changes, noise" in found.why_no_theta) is not known
    rho = vf.measure(problem.changed(friction="0")).rho_normal.value
    assert abs(found.spectrum.high - rho) <= found.vectors.error_high
    turned = Linear([1.0, 1.0, 3.0, 3.0], skew=2.0)
    X = np.random.default_rng(1).normal(size=(6, 4))
    assert vf.advise_vectors(X, [turned(x) for x in X], tied=True).vectors.error_high is not None
    slips = vf.advise_vectors(X, [turned(x) for x in X])
    assert "no error is known" in str(slips.sections())
    assert "rho (stiffness" not in slips.quote


def test_noise_of_the_solvers_is_measured_and_what_it_drowns_is_left_out():
    coupling, generator = Linear(np.linspace(0.5, 8, 6)), np.random.default_rng(0)
    X = generator.normal(size=(12, 6))
    X[6:] = X[:6] * 1.5 - 0.2
    TX = np.array([coupling(x) for x in X])
    clean = seen_in(X, TX)
    noisy = seen_in(X, TX + 1e-6 * generator.normal(size=TX.shape))
    assert noisy.noise is None or noisy.noise < 1e-3
    assert noisy.spectrum.high == pytest.approx(clean.spectrum.high, rel=1e-3)


@pytest.mark.parametrize("written", [np.float32, lambda a: np.vectorize(lambda v: float(f"{v:.6e}"))(a)])
@pytest.mark.parametrize("seed", range(6 if AT_NIGHT else 2))
def test_vectors_of_few_digits_show_what_their_digits_hold(written, seed):
    coupling = Linear(np.linspace(2.5, 13.5, 12), seed)
    exact = coupling.run("aitken", 0.1, 9)
    X, TX = (np.asarray(written(rows)) for rows in exact)
    found, whole = vf.advise_vectors(X, TX), vf.advise_vectors(*exact)
    assert found.spectrum.high == pytest.approx(whole.spectrum.high, rel=0.02)
    assert 1.5 < found.spectrum.low < 4.5
    assert found.theta == pytest.approx(whole.theta, rel=0.05)


def test_zeros_of_a_tied_coupling_show_no_open_node():
    values = np.array([0.5, 1.0, 3.0])
    X = np.random.default_rng(0).normal(size=(6, 3))
    TX = 1 - X * values
    TX[3:, 0] = 0.0
    X[3:, 0] = 2.0  # 1 - 0.5 * 2 = 0
    assert vf.advise_vectors(X, TX).vectors.changing
    found = vf.advise_vectors(X, TX, tied=True)
    assert not found.vectors.changing
    assert found.spectrum.high == pytest.approx(3.0)


def test_contact_that_opens_and_closes_is_recognised():
    """At theta = 0.6 the second image has one closed node, all others six; at 0.3 the same node is always open."""
    data = vf.example("section6").changed(friction=0, cells=((10, 2), (6, 2)), young=(20000, 40000)).to_dict()
    data["body2"]["traction"] = {"right": [0, 4000]}
    lifted = vf.Problem.from_dict(data)
    found = {}
    for theta in ("0.3", "0.6"):
        states = [state for state, _ in zip(vf.iterate(lifted, theta=theta), range(8), strict=False)]
        found[theta] = vf.advise_vectors([s.g for s in states], [s.image for s in states])
    assert [found[theta].vectors.changing for theta in found] == [False, True]
    assert [found[theta].vectors.used for theta in found] == [8, 6]
    assert found["0.6"].spectrum.low > 0  # the node that is open bore no force: it has no error
    assert not found["0.6"].tied
    assert not any(row.exchanged for row in found["0.6"].methods)
    closed = found["0.3"].spectrum.high
    assert found["0.6"].spectrum.high == pytest.approx(closed, rel=0.05)
    assert closed <= vf.measure(lifted).rho_normal.value * 1.001
    assert all(each.theta <= 2 / (1 + closed) for each in found.values())
    assert "bear no force in any" in str(found["0.6"].sections())
    given = [[s.g for s in states], [s.image for s in states]]
    given[0][0] = given[0][0] + 1e-3 * np.abs(given[1][0]).max()
    loaded = vf.advise_vectors(*given)
    assert loaded.spectrum.low == 0  # a force where a node is open in the end has an error of its own
    assert "open nodes too" in str(loaded.sections())


def test_four_iterates_after_contact_has_changed_are_enough_and_are_the_last_ones():
    coupling, X = Linear([0.5, 2.0, 8.0]), np.random.default_rng(3).normal(size=(7, 3))
    TX = np.array([coupling(x) for x in X])
    TX[:3, 0] = 0.0  # open in the first three
    seen = seen_in(X, TX)
    assert (seen.iterates, seen.used, seen.changing, seen.settled) == (7, 4, True, True)
    assert np.sort(seen.ritz.real) == pytest.approx([0.5, 2.0, 8.0])
    assert seen_in(X[:6], TX[:6]).used == 6  # three are too few
    assert not seen_in(X[:6], TX[:6]).settled


def test_no_difference_is_taken_across_the_begin_of_a_step_in_time():
    coupling, X = Linear([0.5, 2.0, 8.0]), np.random.default_rng(4).normal(size=(9, 3))
    TX, starts = np.array([coupling(x) for x in X]), np.arange(9) == 5
    TX[5:] += [1.0, -2.0, 3.0]  # the load of the next step
    TX[:2, 0] = 0.0  # and contact changes in the first one
    seen = seen_in(X, TX, starts=starts)
    assert seen.used == 7
    assert np.sort(seen.ritz.real) == pytest.approx([0.5, 2.0, 8.0])


def test_ends_of_exchanged_roles_and_their_errors_are_those_of_one_over_each_end():
    one = Spectrum.of([0.5, 2.0, 8.0])
    assert one.exchanged().values.real == pytest.approx([1 / 8, 1 / 2, 2])
    assert one.exchanged().exchanged().values.real == pytest.approx(one.values.real)
    with pytest.raises(ValueError, match="0: the exchanged roles have no spectrum"):
        one.with_open_nodes().exchanged()
    other = estimated(0.5, 8.0, 1e-6, 1e-4).exchanged()
    assert other.error_low == pytest.approx(1 / 8 - 1 / (8 + 1e-4), rel=1e-4)
    assert other.error_high == pytest.approx(1 / 0.5 - 1 / (0.5 + 1e-6), rel=1e-4)
    assert other.source == "vectors"


def test_eigenvalues_are_sorted_and_modes_between_two_ends_are_the_extrema_of_a_chebyshev_polynomial():
    assert Spectrum.of([8.0, 0.5, 2.0]).values.tolist() == [0.5, 2.0, 8.0]
    assert Spectrum.of([8.0, 0.5, 2.0]).source == "eigenvalues"
    between = Spectrum.between(1.0, 3.0)
    x = between.values.real - 2
    assert (between.low, between.high) == (1.0, 3.0)
    assert np.polynomial.Chebyshev.basis(len(x) - 1)(x) == pytest.approx((-1.0) ** np.arange(len(x))[::-1])


@pytest.mark.parametrize(("imaginary", "real"), [(0.019, True), (0.021, False)])
def test_a_spectrum_is_complex_from_a_fiftieth_of_the_largest_eigenvalue_of_1_plus_H_on(imaginary, real):
    assert Spectrum.of([1.0 + imaginary * 5j, 1.0 - imaginary * 5j, 4.0]).real == real


def test_a_mode_of_open_nodes_is_exact_and_is_added_once():
    more = estimated(0.5, 8.0, 0.1, 0.2).with_open_nodes()
    assert more.values.tolist() == [0.0, 0.5, 8.0]
    assert (more.error_low, more.error_high) == (0.0, 0.2)
    assert more.with_open_nodes() is more


@pytest.mark.parametrize("low", [0.5, 0.1, -0.3, -0.9])
def test_theta_has_room_for_the_error_of_the_largest_eigenvalue_only(low):
    """Both ends arrive after as many steps, from equal errors: their residuals are 1 + lambda times these.

    Room below the least eigenvalue would bring theta closer to the limit of the largest one.
    """
    theta = estimated(low, 4.0, 0.2, 0.4).theta
    counts = [math.log((1 + end) / 1e-6) / -math.log(abs(1 - theta * (1 + end))) for end in (low, 4.4)]
    assert counts[0] == pytest.approx(counts[1])
    assert 1 / 5.4 < theta < 2 / (2 + low + 4.4)


@pytest.mark.parametrize("high", [3.0, 30.0, 300.0])
def test_theta_of_an_estimate_takes_hardly_more_than_the_fewest_steps(high):
    one = estimated(0.1, high, 0.0, 0.0)
    fewest = min(steps(one, "constant", one.theta * (1 + k / 1000)) or 10**9 for k in range(-60, 60))
    assert steps(one, "constant", one.theta) <= 1.03 * fewest + 1
    if high >= 30:  # the stiff mode's residual is 30 times its error
        assert steps(one, "constant", 2 / (2.1 + high)) >= 1.15 * fewest


@pytest.mark.parametrize("values", [[1 + 2j, 1 - 2j], [0.1 + 1j, 0.1 - 1j, 3.0], [0.0, 0.5 + 0.4j, 0.5 - 0.4j]])
def test_theta_of_a_complex_spectrum_has_the_least_factor(values):
    one = Spectrum.of(values)
    assert not one.real
    assert one.factor(one.theta) <= min(map(one.factor, np.linspace(0, 2, 2001))) + 1e-6


def test_the_document_has_the_vectors_and_the_ends():
    coupling = Linear([0.5, 2.0, 8.0])
    found = vf.advise_vectors(*coupling.run("aitken", 0.5, 5))
    document = found.to_dict()
    assert document["spectrum"] == {"low": found.spectrum.low, "high": found.spectrum.high}
    assert [row["method"] for row in document["methods"]] == ["constant", "aitken", "iqn-ils"] * 2
    assert [row["exchanged"] for row in document["methods"]] == [False] * 3 + [True] * 3
    assert document["vectors"]["unknowns"] == 3
    assert document["roles"][0]["rho"]["level"] == "float"
    assert document["roles"][0]["theta_proved"] is None
    assert pickle.loads(pickle.dumps(found)).to_json() == found.to_json()


@pytest.mark.parametrize(
    ("X", "TX", "needed"),
    [
        ([[1.0, 2.0]], [[1.0, 2.0]], "X is 1 x 2: needed a row of real numbers for each iterate, two rows or more"),
        ([1.0, 2.0], [1.0, 2.0], "X is a vector of 2: needed a row of real numbers for each iterate"),
        ([[1.0], [2.0]], [[1.0], [2.0], [3.0]], "X and TX are 2 x 1 and 3 x 1"),
        ([[1.0], [np.nan]], [[1.0], [2.0]], "X has entries that are not finite"),
        ([[1.0], [2.0]], [["a"], ["b"]], "TX has no real numbers"),
        ([[1.0, 2.0], [2.0]], [[1.0], [2.0]], "X has rows of different lengths"),
        ([[1.0], [1.0]], [[2.0], [2.0]], "the iterates do not differ above rounding"),
    ],
)
def test_bad_vectors_are_refused(X, TX, needed):
    with pytest.raises(ValueError, match=needed):
        vf.advise_vectors(X, TX)


@pytest.mark.filterwarnings("error")
def test_images_that_are_their_iterates_are_solutions_and_show_no_spectrum():
    X = np.random.default_rng(4).normal(size=(5, 3))
    with pytest.raises(ValueError, match="T x = x for every iterate, up to rounding: each is a solution already"):
        vf.advise_vectors(X, X + 1e-14)
    with pytest.raises(ValueError, match=r"T x - x is the same for every iterate.*all eigenvalues are -1"):
        vf.advise_vectors(X, X + 0.3)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("unit", [1e-200, 1e59])
def test_vectors_in_any_unit_show_the_same_spectrum(unit):
    X = np.random.default_rng(6).normal(size=(5, 3))
    image = -X * [0.5, 1.0, 2.0]
    one, two = (vf.advise_vectors(X * size, image * size) for size in (1.0, unit))
    assert two.spectrum.low == pytest.approx(one.spectrum.low)
    assert two.spectrum.high == pytest.approx(one.spectrum.high)


def test_exchanged_roles_are_advised_only_where_the_least_eigenvalue_is_found():
    """Six iterates of a stiff coupling show the largest eigenvalue and not the least: one over it would be far off."""
    stiff = Linear(np.logspace(-3, np.log10(200), 40))
    X, TX = stiff.run("constant", 2 / (2 + 200), 6)
    found = vf.advise_vectors(X, TX, kind="tied")
    assert found.vectors.high_found
    assert not found.vectors.low_found
    assert found.methods
    assert not any(row.exchanged for row in found.methods)
    few = Linear([0.5, 2.0, 9.0])
    whole = vf.advise_vectors(*few.run("constant", 0.15, 6), kind="tied")
    assert whole.vectors.low_found
    assert any(row.exchanged for row in whole.methods)


def test_iterates_that_come_back_are_no_progress_and_leave_no_theta():
    """Saturating solvers at theta = 1/2: two iterates alternate, and their mode would be 2/theta - 1 = 3."""
    X, TX, x = [], [], np.linspace(1.0, 2.0, 5)
    for _ in range(12):
        X.append(x)
        TX.append(-4 * np.tanh(3 * x))
        x = (x + TX[-1]) / 2
    found = vf.advise_vectors(X, TX, kind="tied")
    assert (found.vectors.period, found.theta, found.method) == (2, None, None)
    assert "the iterates come back after 2 steps, up to 3 % of a step" in found.why_no_theta
    assert "more iterates" in found.why_no_theta
    assert vf.advise_vectors(*Linear([0.5, 2.0]).run("constant", 0.5, 12)).vectors.period == 0


@pytest.mark.parametrize("factor", [-0.9, -0.975, -0.99, -1.02])
@pytest.mark.parametrize("steps", [12, 60])
def test_a_linear_mode_that_alternates_slowly_is_no_cycle_and_leaves_its_theta(factor, steps):
    """The factor of the stiffest mode is close to -1; a little smaller theta converges."""
    linear = Linear([0.2, 0.7, 1.5, 3.0])
    found = vf.advise_vectors(*linear.run("constant", (1 - factor) / 4, steps), kind="tied")
    assert (found.vectors.period, found.theta) == (0, pytest.approx(0.379, abs=1e-3))


def test_where_no_theta_converges_the_method_that_does_is_named():
    found = vf.advise_vectors(*Linear([-1.6, -0.5, 0.3, 2.0]).run("iqn-ils", 0.2, 6), kind="general")
    assert found.theta is None
    assert found.method.name == "iqn-ils"
    assert "WHICH METHOD?" in str(found.sections())


def test_a_largest_eigenvalue_that_falls_with_more_iterates_is_of_noise_or_no_linear_solver():
    assert falls((36.1, 29.0, 31.6))
    assert not falls((1.0, 1.2, 1.19))
