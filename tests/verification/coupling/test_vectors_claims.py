"""Vectors claim no more than they show: of runs that explode, slip, bend, or have an eigenvalue near -1."""

import numpy as np
import pytest
from linear_couplings import Linear

import verification as vf
from verification.coupling.kinds import GENERAL, TIED
from verification.coupling.spectrum import TOLERANCE, Spectrum
from verification.coupling.vectors import seen_in
from verification.registry import RULES


@pytest.mark.parametrize("high", [40.0, 700.0])
def test_a_run_that_explodes_keeps_what_its_first_rows_show(high):
    coupling = Linear(np.append(np.linspace(0.5, high / 4, 9), high))
    X, TX = coupling.run("constant", 0.5, 16)
    assert np.linalg.norm(X[-1]) > 1e14 * np.linalg.norm(TX[0])
    few, more = (seen_in(X[:count], TX[:count], kind=TIED) for count in (6, 16))
    assert more.spectrum.high == pytest.approx(high, rel=1e-6)
    assert more.directions >= few.directions
    assert abs(more.spectrum.low - 0.5) <= more.spectrum.error_low < few.spectrum.error_low


@pytest.mark.parametrize("high", [2.0, 1e3, 1e6, 1e9, 1e12])
def test_the_theta_of_an_estimate_is_as_sharp_for_a_huge_rho_as_for_a_small_one(high):
    ends = np.array([high / 20, high])
    theta = Spectrum(values=ends.astype(complex), source="vectors").theta
    soft, stiff = np.log((1 + ends) / TOLERANCE) / -np.log(np.abs(1 - theta * (1 + ends)))  # steps of both ends
    assert soft == pytest.approx(stiff, rel=1e-4)
    turning = Spectrum(values=high * np.array([0.05, 0.5 + 0.5j, 0.5 - 0.5j, 1.0]), source="eigenvalues")
    best = min(turning.factor(turning.theta * share) for share in np.linspace(0.1, 3, 2000))
    assert turning.factor(turning.theta) <= best + 1e-5


def test_rows_in_which_an_explosion_has_left_one_direction_give_no_theta_and_the_words_say_so():
    X, TX = Linear([0.5, 2.0, 7.0, 60.0]).run("constant", 0.5, 28)
    late = vf.advise_vectors(X[14:], TX[14:], kind="tied")
    assert late.vectors.directions == 1
    assert late.theta is None
    assert "the run explodes" in late.why_no_theta
    assert "noise keeps" not in late.why_no_theta


def test_the_error_of_the_least_eigenvalue_holds_where_it_still_moves():
    outside = 0
    for seed in range(20):
        generator = np.random.default_rng(seed)
        values = np.sort(generator.uniform(-0.9, generator.uniform(0.5, 8.0), 14))
        seen = seen_in(*Linear(values, seed).run("constant", 0.3, 6), kind=GENERAL)
        outside += seen.spectrum.low - values[0] > 2 * seen.spectrum.error_low
    assert outside <= 3


def test_no_number_of_steps_where_minus_one_is_within_the_error_of_the_least_eigenvalue():
    values = [-0.985, -0.8, -0.6, -0.4, -0.2, 0.0, 0.1]
    found = vf.advise_vectors(*Linear(values, 1).run("constant", 0.5, 6), kind="general")
    assert found.spectrum.low - found.vectors.error_low < -1
    assert "in unknown steps (with the least eigenvalue at the end of its error none converges)" in found.quote
    constant = next(row for row in found.methods if row.method == "constant")
    assert constant.steps is None
    assert "a constant theta may not arrive" in found.method.reason
    wide = vf.advise_vectors(*Linear(np.geomspace(0.1, 60.0, 20), 1).run("constant", 0.5, 6), kind="tied")
    assert "(by the error of the least eigenvalue)" in wide.quote


def test_a_basis_of_all_unknowns_is_not_exact_where_the_first_difference_bends():
    """Without it the least eigenvalue is another one, which the residual there does not explain."""
    coupling, following, x = Linear(np.linspace(-0.45, 1.2, 8), 13), RULES["iqn-ils"].on_vectors(0.5), np.zeros(8)
    T, X, TX = lambda x: coupling(x) - 0.05 * np.abs(x) * np.tanh(x), [], []
    for _ in range(9):
        X.append(x)
        TX.append(T(x))
        x = following(x, TX[-1])
    columns = [(T(X[-1] + 1e-6 * e) - T(X[-1] - 1e-6 * e)) / -2e-6 for e in np.eye(8)]
    seen = seen_in(np.array(X), np.array(TX), kind=GENERAL)
    assert seen.directions == 8
    least = np.linalg.eigvals(np.transpose(columns)).real.min()
    assert abs(seen.spectrum.low - least) == pytest.approx(seen.spectrum.error_low, rel=0.05)


def test_rows_of_contact_that_slipped_between_them_give_no_theta():
    generator = np.random.default_rng(8)
    before, after = Linear(np.sort(generator.uniform(0, 4, 7)), 8, skew=0.6), Linear(np.linspace(0.2, 2.5, 7), 9)
    x, X, TX = np.zeros(7), [], []
    for step in range(7):
        X.append(x)
        TX.append((before if step < 3 else after)(x))
        x = x + 0.4 * (TX[-1] - x)
    found = vf.advise_vectors(X, TX)
    assert not found.vectors.symmetric
    assert found.theta is None
    assert "contact still changes in the last iterates, or slip" in found.why_no_theta


def test_the_line_to_quote_and_the_table_have_one_number_of_steps():
    for values in ([0.9], [734.0], [0.5, 2.0, 5.0]):
        found = vf.advise_vectors(*Linear(values).run("constant", 0.3, 5), kind="tied")
        steps = next(row.steps for row in found.methods if row.method == "constant" and not row.exchanged)
        assert f"about {steps} steps to 1e-6" in found.quote
        assert "is estimated at " in found.quote
        assert "1e-9" not in found.quote
