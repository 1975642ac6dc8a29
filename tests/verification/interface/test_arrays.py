"""Arrays from users: every way in takes the same ones, and refuses others by name in one line."""

from itertools import product

import numpy as np
import pytest
import scipy.sparse as sp

import verification as vf
from verification.interface.friction import GivenOperator

S, X = np.diag([3.0, 2.0, 3.0, 2.0]), np.array([[0.0, 0.0], [1.0, 2.0], [3.0, 5.0]])
RUBBING = {"S1": S, "S2": S, "x": np.arange(2.0), "kernel": np.eye(2), "friction": 0.1}


def built(**given):
    return vf.build(**RUBBING | given)


def coupled(start, answer=lambda u: 1 - u / 2):
    return vf.couple(lambda g: g, answer, start=start)


class Steady(GivenOperator):
    """A law of a user."""


def with_law(matrix):
    return vf.run(vf.build(S1=S, S2=S, x=np.arange(2.0), law=Steady(matrix=matrix), friction=0.1))


#: Every way in by the name of its array: an array that it takes, and what takes it.
DOORS = {
    "X": (X, lambda a: vf.advise_vectors(a, -X)),
    "TX": (-X, lambda a: vf.advise_vectors(X, a)),
    "start": (X[1], coupled),
    "what contact returned": (X[1], lambda a: coupled([0.0, 0.0], lambda u: a)),
    "Tg": (X[1], lambda a: vf.Coupling().next([0.0, 0.0], a)),
    "g": (X[1], lambda a: vf.Coupling().see(a, [0.0, 0.0])),
    "start: g": (X[:2].ravel(), lambda a: vf.run(built(), start=a)),
    "S1": (S, lambda a: built(S1=a)),
    "S2": (S, lambda a: built(S2=a)),
    "S1 of any unit": (S, lambda a: vf.advise_matrices(a, S)),
    "the transfer": (np.eye(4), lambda a: vf.advise_matrices(S, S, transfer=a)),
    "load of the neumann body": (X[:2].ravel(), lambda a: built(load2=a)),
    "x": (X[1], lambda a: built(x=a)),
    "weights": (X[1], lambda a: built(weights=a)),
    "gap": (X[1], lambda a: built(gap=a)),
    "kernel": (np.eye(2), lambda a: built(kernel=a)),
    "transfer": (np.eye(2), lambda a: built(transfer=a)),
    "friction": (X[1], lambda a: built(friction=a)),
    "operator S": (np.eye(2), with_law),
}

#: What no door takes, made from an array that it takes.
NONE = {
    "complex": (lambda a: a + 0j, "has no real numbers"),
    "masked": (lambda a: np.ma.masked_greater(a, a.max() - 0.5), "has masked entries"),
    "truth values": (lambda a: a > 0, "has no real numbers"),
    "texts": (lambda a: a.astype(str), "has no real numbers"),
    "a stack": (lambda a: np.stack([a, a]), "needed"),
    "not finite": (lambda a: np.where(a == a.max(), np.nan, a), "has entries that are not finite"),
    "squares that overflow": (lambda a: a * 1e300, "has an entry of size .*needed at most 1e.60"),
}

#: Doors at which a kind means something: texts are exact numbers there, or any unit is taken.
MEANT = {("friction", "texts"), ("S1 of any unit", "squares that overflow"), ("the transfer", "squares that overflow")}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("door", "kind"), [each for each in product(DOORS, NONE) if each not in MEANT])
def test_every_way_in_refuses_what_is_no_array_of_real_numbers_by_its_name(door, kind):
    array, take = DOORS[door]
    spoil, words = NONE[kind]
    with pytest.raises((ValueError, RuntimeError), match=f"{door.removesuffix(' of any unit')}.*{words}") as refused:
        take(spoil(array))
    assert len(str(refused.value).splitlines()) == 1


@pytest.mark.parametrize("door", DOORS)
def test_every_way_in_takes_whole_numbers_and_sequences(door):
    array, take = DOORS[door]
    take(array)
    take(array.astype(int).tolist())


def test_sparse_matrices_are_taken_where_dense_ones_are():
    pair = built(S1=sp.csr_array(S), kernel=sp.csr_array(np.eye(2)))
    assert np.array_equal(pair.along_y[0].schur, S)


@pytest.mark.parametrize("name", ["S1", "S2"])
def test_matrices_so_small_that_products_vanish_are_refused(name):
    with pytest.raises(ValueError, match=f"the largest entry of {name} is 3e-100: needed at least 1e-60, in another"):
        built(**{name: S * 1e-100})
