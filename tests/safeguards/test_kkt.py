"""The residual of step II shows each condition that is broken, by as much as it is: numbers worked out by hand."""

from dataclasses import fields
from fractions import Fraction
from math import isnan, nan

import numpy as np
import pytest

from verification.contact.kkt import KKT, KKTCertificate

#: Two nodes: tangential components first, then normal ones.
S = np.array([[4.0, 1, 0, 0], [1, 3, 1, 0], [0, 1, 2, 1], [0, 0, 1, 2]])
BOUND = np.array([2.0, 5.0])

#: The first node touches and slides to the right, the second sticks and is open.
V = np.array([1.0, 0, 0, -2])
FORCE = np.array([2.0, -4, 3, 0])
LOAD = S @ V + FORCE
EXACT = np.vectorize(Fraction, otypes=[object])
CARRIED = max(*abs(EXACT(S) @ EXACT(V)), *BOUND)

CONDITIONS = [field.name for field in fields(KKT)]


def broken(found: KKT) -> dict[str, float]:
    return {name: getattr(found, name) for name in CONDITIONS if getattr(found, name) != 0}


def test_a_solution_has_no_residual():
    assert broken(KKTCertificate(S).measure(LOAD, BOUND, V, FORCE)) == {}
    assert KKTCertificate(S).measure(LOAD, BOUND, V, FORCE).residual == 0


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("place", range(4))
def test_a_load_that_nothing_carries_is_seen_at_every_free_component(place, sign):
    off = np.zeros(4)
    off[place] = sign
    found = KKTCertificate(S).measure(LOAD + off, BOUND, V, FORCE)
    assert broken(found) == {"equilibrium": float(1 / Fraction(max(CARRIED, *abs(EXACT(LOAD + off)))))}
    for held in range(4):
        free = np.arange(4) != held
        expected = {} if held == place else broken(found)
        assert broken(KKTCertificate(S, free).measure(LOAD + off, BOUND, V, FORCE)) == expected


#: A component of the jump or of the reaction, what it becomes, and what each condition then misses, as a force.
WRONG = {
    "the open node lies in the other body": (V, 3, 1, {"non_penetration": 4}),
    "the node that touches lies in the other body": (V, 2, 1, {"non_penetration": 4, "complementarity": 3}),
    "the node that touches is pulled": (FORCE, 2, -1, {"compression": 1}),
    "the open node is pulled": (FORCE, 3, -1, {"compression": 1, "complementarity": 1}),
    "the open node is pressed": (FORCE, 3, 1, {"complementarity": 1}),
    "the node that touches is apart": (V, 2, -0.5, {"complementarity": 2}),
    "more friction than there can be": (FORCE, 1, -7, {"bound": 2}),
    "more friction the other way": (FORCE, 1, 7, {"bound": 2}),
    "less friction than a slide has": (FORCE, 0, 1, {"slip": 1}),
    "friction that pushes": (FORCE, 0, -2, {"slip": 4}),
    "a slide against its friction": (V, 0, -1, {"slip": 4}),
    "more friction than a slide has": (FORCE, 0, 3, {"bound": 1, "slip": 1}),
    "a slide below the bound": (V, 1, 0.25, {"slip": 1}),
}


@pytest.mark.parametrize("name", WRONG)
def test_each_condition_that_is_broken_has_its_size(name):
    whose, place, value, misses = WRONG[name]
    wrong = whose.copy()
    wrong[place] = value
    v, force = (wrong, FORCE) if whose is V else (V, wrong)
    found = KKTCertificate(S).measure(S @ v + force, BOUND, v, force)
    size = max(abs(S @ v + force).max(), abs(S @ v).max(), BOUND.max())
    assert broken(found) == {condition: miss / size for condition, miss in misses.items()}
    assert found.residual == max(misses.values()) / size


@pytest.mark.parametrize("name", CONDITIONS)
def test_the_residual_is_the_largest_of_all_conditions_and_no_number_where_one_is_none(name):
    none = dict.fromkeys(CONDITIONS, 0.0)
    assert KKT(**none | {name: 0.5}).residual == 0.5
    assert isnan(KKT(**none | {name: nan}).residual)


@pytest.mark.parametrize("place", range(4))
def test_what_is_no_number_has_no_residual_of_0(place):
    for whose in (LOAD, V, FORCE, BOUND):
        if place < len(whose):
            wrong = whose.copy()
            wrong[place] = nan
            q, bound, v, force = (wrong if whose is each else each for each in (LOAD, BOUND, V, FORCE))
            free = np.arange(4) != place
            if whose is not LOAD:  # a load of a support may be anything
                assert not KKTCertificate(S, free).measure(q, bound, v, force).residual <= 1
            assert not KKTCertificate(S).measure(q, bound, v, force).residual <= 1


def test_nothing_at_all_is_a_solution():
    zero = np.zeros(4)
    assert KKTCertificate(S).measure(zero, zero[:2], zero, zero).residual == 0
