"""Equalities of Section 5 on one pair of bodies in rationals: what is equal is equal to the last digit."""

from fractions import Fraction

import numpy as np
import pytest

from verification.algorithm.fixed_point import FixedPointMap
from verification.ledger import rational_pairs
from verification.ledger.inequalities import ENTRIES
from verification.ledger.rational_pairs import FORCES, IDS, RationalPair, both_sides, decided, in_rationals, solved


@pytest.fixture(scope="module")
def pair():
    return RationalPair()


EQUAL = [id for id in IDS if ENTRIES[id, "printed"].equality]
AT_MOST = [id for id in IDS if id not in EQUAL]


@pytest.mark.parametrize("id", EQUAL)
def test_both_sides_of_an_equality_are_one_rational(pair, id):
    (evidence,) = decided(id, pair)
    assert (evidence.method, evidence.of, evidence.holds) == ("verified", "printed", True)
    assert evidence.data["difference"] == "0"


@pytest.mark.parametrize("id", AT_MOST)
def test_an_inequality_between_rationals_is_strict_where_nodes_change_their_state(pair, id):
    assert len({solution.state for solution in pair.solutions}) == 2
    left, right = both_sides(id, pair)
    assert left < right
    assert decided(id, pair)[0].holds


@pytest.mark.parametrize("id", EQUAL)
def test_an_equality_that_is_off_by_a_billionth_is_refuted(pair, id, monkeypatch):
    left, right = both_sides(id, pair)
    monkeypatch.setattr(rational_pairs, "both_sides", lambda *of: (left, right * (1 + Fraction(1, 10**9))))
    assert decided(id, pair)[0].holds is False


@pytest.mark.parametrize("id", AT_MOST)
def test_an_inequality_without_its_friction_term_is_refuted(pair, id, monkeypatch):
    left, right = both_sides(id, pair)
    monkeypatch.setattr(rational_pairs, "both_sides", lambda *of: (left, right - 100 * pair.friction))
    assert decided(id, pair)[0].holds is False


def test_the_rational_bodies_and_solutions_are_those_of_the_program(pair):
    for side, own in ((pair.one, pair.pair.contact), (pair.two, pair.pair.neumann)):
        assert (side.energy == side.S).all()
        assert np.allclose(side.S.astype(float), own.schur, rtol=1e-13, atol=1e-14)
    for solution, g in zip(pair.solutions, FORCES, strict=True):
        u, found = FixedPointMap(pair.pair, "cvxpy")(g.astype(float))
        assert np.allclose(solution.w_2.astype(float), u, atol=1e-13)
        assert np.allclose(solution.reaction.astype(float), found.force, atol=1e-12)
        assert all(isinstance(value, Fraction) for value in solution.reaction)


def test_elimination_solves_in_rationals():
    A = np.array([[Fraction(4), Fraction(1), Fraction(0)], [1, Fraction(3), Fraction(1, 7)], [0, Fraction(1, 7), 2]])
    B = np.array([[Fraction(i + 1, j + 2) for j in range(2)] for i in range(3)])
    assert (A @ solved(A, B) == B).all()


def test_only_what_is_asked_for_is_decided():
    assert set(in_rationals(["5.24", "5.30"])) == {"5.24"}
    assert in_rationals([]) == {}
