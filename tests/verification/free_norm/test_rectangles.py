"""Two rectangles in a norm that the proof chooses: what the search finds, what is proved, and where it falls back."""

from dataclasses import replace
from fractions import Fraction as F
from pathlib import Path

import numpy as np
import pytest
from known import continuum_once
from strategies import AT_NIGHT

import verification as vf
from ndtheory.continuum.circle import disk
from ndtheory.continuum.rectangle_circle import RectangleCircle
from ndtheory.continuum.rectangles import friction_threshold, statement
from verification.certificate import continuum
from verification.certificate.continuum import two_rectangles
from verification.free_norm.numbers import with_friction
from verification.free_norm.rectangles import RectangleSearch, rectangle_norm

MODEL = two_rectangles(vf.example("section6").changed(radius="0.1"))
PAGE = Path(__file__).parents[3] / "docs" / "rectangles.md"
EXCHANGED = replace(MODEL, contact=MODEL.neumann, neumann=MODEL.contact)


@pytest.fixture(scope="module", autouse=True)
def known(shared):
    with pytest.MonkeyPatch.context() as patch:
        continuum_once(patch, shared)
        yield


@pytest.fixture(scope="module")
def own(known):
    return continuum.bounded(MODEL)


@pytest.fixture(scope="module")
def exchanged(known):
    return continuum.bounded(EXCHANGED)


@pytest.fixture(scope="module")
def search(own):
    return RectangleSearch(RectangleCircle.of(MODEL, own))


@pytest.fixture(scope="module")
def proved(own):
    return rectangle_norm(MODEL, own, F("0.2"), F("0.7"))


def test_section_6_is_proved_beyond_the_energy_norms(proved, own):
    assert proved.friction_threshold.lo > 0.8
    assert proved.friction_threshold.lo > 2.9 * friction_threshold(own).lo
    assert proved.theta_max.lo == 1
    assert proved.factor.hi < 0.47
    assert proved.factor_best.hi < 0.433
    assert {n.level for n in (proved.friction_threshold, proved.theta_max, proved.factor)} == {"guaranteed"}
    assert proved.reason == {}


def test_what_is_proved_is_what_the_search_found_on_the_safe_side(proved, search):
    assert 0.99 * search.friction_threshold < proved.friction_threshold.lo < search.friction_threshold
    assert search.factor(0.7, 0.2) < proved.factor.hi < 1.01 * search.factor(0.7, 0.2)
    assert search.factor(proved.theta_best, 0.2) < proved.factor_best.hi
    assert proved.factor_best.hi < proved.factor.hi


@pytest.mark.parametrize(
    ("theta", "k", "least", "most"), [(0.6, 0.2, 0.53, 0.5532), (0.7, 0.2, 0.46, 0.4836), (0.6, 0.6, 0.85, 0.8863)]
)
def test_factors_are_at_most_those_of_an_earlier_search_on_a_grid_of_mu(search, theta, k, least, most):
    assert least < search.factor(theta, k) < most


def test_factors_grow_with_friction_and_the_largest_theta_falls(search):
    factors = [search.factor(0.6, k) for k in (0.05, 0.2, 0.4, 0.6)]
    assert factors == sorted(factors)
    tops = [search.largest_theta(k) for k in (0.2, 0.5, 0.7)]
    assert tops == sorted(tops, reverse=True)
    assert search.largest_theta(0.9) is None
    assert search.factor(0.6, 0.9) is None


def test_half_a_step_contracts_by_the_mean_at_least(search):
    q = search.factor(0.7, 0.2)
    assert search.factor(0.35, 0.2) <= (1 + q) / 2 + 2e-3


@pytest.mark.parametrize("ends", [(0.0, 1.0), disk(0.7, 0.5), disk(0.9, 0.7)])
def test_the_multipliers_found_allow_their_friction_and_no_more(search, ends):
    best = search.allowed(ends)
    alpha = search.alpha_by(ends, best.by)
    assert best.friction == pytest.approx(2 * (alpha * best.by.beta) ** 0.5)
    rng = np.random.default_rng(1)
    for _ in range(200):  # no others near them allow more than the distance of two values of mu makes
        beta, nu = best.by.beta * np.exp(0.2 * rng.normal()), best.by.nu + abs(ends[0]) * 0.1 * rng.normal()
        if nu > -ends[0] or not ends[0]:
            other = replace(best.by, beta=beta, nu=nu if ends[0] else 0.0, mu=rng.uniform(0, 1))
            assert 2 * (max(search.alpha_by(ends, other), 0) * beta) ** 0.5 <= 1.02 * best.friction


@pytest.mark.skipif(not AT_NIGHT, reason="a refusal takes some seconds")
@pytest.mark.parametrize("ends", [(0.0, 1.0), disk(0.7, 0.5), disk(0.9, 0.7)])
def test_a_little_more_friction_is_not_proved_by_the_multipliers_found(search, ends):
    best, exact = search.allowed(ends), tuple(map(F, ends))
    assert search.criterion.contracts(exact, with_friction(best.by, F(best.friction * 0.995)))
    assert not search.criterion.contracts(exact, with_friction(best.by, F(best.friction * 1.01)))


def test_smaller_radii_allow_less_friction_like_the_root_of_the_radius(own, search):
    smaller = replace(MODEL, radius=F(1, 40))
    found = RectangleSearch(RectangleCircle.of(smaller, own)).friction_threshold
    assert found == pytest.approx(search.friction_threshold / 2, rel=2e-2)


def test_units_of_length_and_stress_do_not_matter(search):
    circle = search.criterion
    strip = lambda one: replace(one, thickness=1000 * one.thickness)
    layers = replace(
        circle.layers, contact=strip(circle.layers.contact), neumann=strip(circle.layers.neumann), radius=F(100)
    )
    squares = {"C_t1_square": 1000 * circle.C_t1_square, "C_t2_square": 1000 * circle.C_t2_square}
    other = RectangleSearch(replace(circle, layers=layers, **squares))
    assert other.friction_threshold == pytest.approx(search.friction_threshold, rel=1e-6)
    assert other.factor(0.7, 0.2) == pytest.approx(search.factor(0.7, 0.2), abs=1e-5)


def test_with_the_roles_exchanged_small_thetas_are_proved_and_none_in_numbers(exchanged):
    found = rectangle_norm(EXCHANGED, exchanged, F("0.2"), F("0.1"))
    assert 0.7963 < found.friction_threshold.lo < 0.8036
    assert found.theta_max is found.factor is found.theta_best is found.factor_best is None
    assert "no room for a cut-off" in found.reason["factor"]


def test_at_a_small_theta_no_factor_above_1_is_called_a_proof_of_contraction(own):
    """Beyond the energy norms; a share of the factor itself would lead above 1."""
    factor = rectangle_norm(MODEL, own, F("0.5"), F("0.0001")).factor
    assert factor is None or 1 - 1e-4 < factor.hi < 1


def test_without_friction_every_number_has_its_reason(own):
    found = rectangle_norm(MODEL, own, F(0), F("0.7")).to_dict()
    assert {value for name, value in found.items() if name != "reason"} == {None}
    assert set(found["reason"].values()) == {"without friction no norm is better than (5.21)"}


def test_a_number_that_no_interval_confirms_is_not_shown(exchanged, monkeypatch):
    monkeypatch.setattr(RectangleCircle, "contracts", lambda *_: False)
    found = rectangle_norm(EXCHANGED, exchanged, F("0.2"), None)
    assert all(value is None for name, value in vars(found).items() if name != "reason")
    assert set(found.reason) == {"friction_threshold", "theta_max", "factor", "theta_best", "factor_best"}


def test_the_page_has_what_is_proved_rounded_to_the_safe_side(proved, own, exchanged):
    lines = [line for line in PAGE.read_text("utf-8").splitlines() if line.startswith("| ")]
    names, free, energy = zip(*([cell.strip() for cell in line.split("|")[1:-1]] for line in lines[1:]), strict=True)
    other = rectangle_norm(EXCHANGED, exchanged, F("0.2"), None)
    least = [proved.friction_threshold, other.friction_threshold]
    for shown, number in zip(map(float, free[:2]), least, strict=True):
        assert number.lo - 2e-4 < shown <= number.lo
    assert free[2] == r"every $\theta \le 1$"
    assert proved.theta_max.lo == 1
    most = [rectangle_norm(MODEL, own, F("0.2"), F("0.6")).factor, proved.factor, proved.factor_best]
    for shown, number in zip(map(float, free[3:]), most, strict=True):
        assert number.hi <= shown < number.hi + 2e-4
    assert f"{proved.theta_best}" in names[-1]
    says = statement(own, friction="0.2", theta="0.6")
    known = [friction_threshold(own).lo, friction_threshold(exchanged).lo, says.theta_max_proved.lo]
    for shown, number in zip((energy[0], energy[1], energy[2].split()[-1].strip("$")), known, strict=True):
        assert number - 2e-4 < float(shown) <= number
    assert says.factor.hi <= float(energy[3]) < says.factor.hi + 2e-4
