"""The largest spectral radius of a piece of T_theta, which no norm beats."""

from fractions import Fraction
from functools import reduce
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from problem_list import small
from strategies import AT_NIGHT, fewer

import verification as vf
from verification.free_norm.norm import FreeNorm
from verification.free_norm.radius import Climb, largest_radius, radius
from verification.semidefinite.pattern_search import factor_search, largest_factor
from verification.testing.strategies import matrix_pairs, mesh_pairs, positive_definite

FRICTIONS = st.sampled_from([Fraction(0), Fraction(1, 10), Fraction(3, 10), Fraction(1), Fraction(3)])
THETAS = st.integers(1, 19).map(lambda n: n / 20)

#: A radius may exceed a factor by the rounding of eigenvalues that are defective, as those of open nodes that slide.
ROUNDING = 1e-7


def assert_no_norm_beats_it(pair, theta, length):
    measured = vf.measure(pair)
    found = largest_radius(pair, theta, evaluations=60, length=length)
    if pair.rubs and not pair.interface.kernel.any():  # no force reaches a node: multipliers need a law of friction
        pair = pair.at(friction=0)
    proved = FreeNorm(pair, measured).factor(theta)
    assert proved is None or found.value <= proved.factor + ROUNDING


@fewer(5, at_night=10)
@given(mesh_pairs(friction=FRICTIONS, law="nonlocal", varying=True), THETAS, st.integers(1, 3))
def test_no_proved_norm_has_a_factor_below_a_radius_on_meshes(pair, theta, length):
    assert_no_norm_beats_it(pair, theta, length)


@fewer(5, at_night=10)
@given(matrix_pairs(friction=FRICTIONS, most_nodes=3), THETAS, st.integers(1, 3))
def test_no_proved_norm_has_a_factor_below_a_radius_on_random_matrices(pair, theta, length):
    assert_no_norm_beats_it(pair, theta, length)


def random_pair(seed, nodes):
    random = np.random.default_rng(seed)
    S1, S2 = (positive_definite(random, 2 * nodes) for _ in range(2))
    kernel = np.abs(random.normal(size=(nodes, nodes))) + np.eye(nodes)
    if seed % 3 == 0:
        kernel = np.outer(*random.normal(size=(2, nodes)))  # of rank 1
    x, weights = np.arange(float(nodes)), np.full(nodes, 1 / nodes)
    return vf.build(S1=S1, S2=S2, x=x, weights=weights, kernel=kernel, friction=(0, "0.3", 1, 3)[seed % 4])


@pytest.mark.parametrize("seed", range(60 if AT_NIGHT else 12))
def test_on_few_nodes_the_search_finds_the_largest_of_all_pieces(seed):
    pair, theta = random_pair(seed, nodes=2 + seed % 2), (0.2, 0.5, 0.8)[seed % 3]
    search = factor_search(pair, theta)
    patterns = (map(np.array, zip(*states, strict=True)) for states in product(search.states, repeat=2 + seed % 2))
    largest = max(radius(search.piece(*pattern).relaxed(theta)) for pattern in patterns)
    assert largest_radius(pair, theta).value == pytest.approx(largest, rel=1e-8)


@pytest.mark.parametrize("role", [1, 2])
@pytest.mark.parametrize("theta", [0.3, 0.8])
def test_without_friction_the_radius_is_the_factor_in_the_energy_norm(role, theta):
    """The pieces are selfadjoint, so nothing is gained by another norm."""
    pair = vf.build(vf.Problem.from_dict(small(contact={"friction": 0}, iteration={"neumann_body": role})))
    factor = max(1 - theta, theta * (1 + vf.measure(pair).rho_normal.value) - 1)
    assert largest_radius(pair, theta).value == pytest.approx(factor, rel=1e-9)
    assert largest_factor(pair, theta, random=np.random.default_rng(0)).value == pytest.approx(factor, rel=1e-9)


def test_a_single_contact_node_has_the_radii_of_open_and_closed():
    bars = vf.build(vf.example("two-bars"))
    rho = vf.measure(bars).rho_normal.value
    for theta in (0.3, 0.9):
        assert largest_radius(bars, theta).value == pytest.approx(max(1 - theta, abs(1 - theta - theta * rho)))


def test_the_same_search_finds_the_same_and_keeps_to_its_budget():
    pair = vf.build(vf.Problem.from_dict(small()))
    found = [largest_radius(pair, 0.7, evaluations=n, length=2) for n in (150, 150, 10)]
    assert found[0].value == found[1].value >= found[2].value
    assert [p.pattern for p in found[0].pieces] == [p.pattern for p in found[1].pieces]
    assert found[0].evaluations <= 300
    assert found[2].evaluations <= 20


def test_several_pieces_have_the_radius_of_the_product_and_at_least_that_of_one():
    pair, theta = vf.build(vf.Problem.from_dict(small())).at(friction="0.6"), 0.8
    one, three = (largest_radius(pair, theta, length=m) for m in (1, 3))
    step = reduce(lambda taken, piece: piece.relaxed(theta) @ taken, three.pieces, np.eye(14))
    assert three.value == pytest.approx(radius(step) ** (1 / 3))
    assert three.value > one.value + 1e-3


def test_a_piece_on_which_a_free_body_would_be_set_in_motion_does_not_count():
    """The top may slide: where all nodes slide one way and friction changes, nothing holds the upper body."""
    pair = vf.build(vf.Problem.from_dict(small(body2={"prescribed": {"top": ["free", "-0.015"]}})))
    climb = Climb(pair, 0.7, evaluations=4)
    stick, opened = (climb.search.piece(*pattern) for pattern in climb.search.extremes())
    assert (stick.balanced, opened.balanced) == (True, False)
    assert climb.at(stick).value > 0.3
    assert climb.at(opened).value == climb.at(stick, opened).value == 0
    assert all(piece.balanced for piece in largest_radius(pair, 0.7).pieces)


#: Friction, theta, and how far the radius is below the factor in the free norm at most, on Section 6 with 25 nodes.
GAPS = [(0.2, 0.7, 0.08)]
GAPS_AT_NIGHT = [(1.6, 0.4, 0.04), (0.2, 0.6, 0.05), (0.2, 0.8, 0.21), (0.9, 0.6, 0.1), (0.9, 0.4, 0.05)]


@pytest.mark.parametrize(("k", "theta", "gap"), GAPS + GAPS_AT_NIGHT * AT_NIGHT)
def test_on_section_6_little_is_left_between_the_radius_and_the_factor_in_the_free_norm(k, theta, gap):
    pair = vf.build(vf.example("section6")).at(friction=k)
    factor, found = FreeNorm(pair, vf.measure(pair)).factor(theta).factor, largest_radius(pair, theta).value
    assert (1 - gap) * factor < found < factor
