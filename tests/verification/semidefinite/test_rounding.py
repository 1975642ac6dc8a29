"""Positive definiteness in spite of rounding, held against exact rationals."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from chain_problems import case, few_nodes
from problem_list import blocks
from rational_forms import exact, form_of, is_definite, rational
from strategies import AT_NIGHT

import verification as vf
from fem1d2d.proofs.enclosed import UNIT, Enclosed
from fem1d2d.proofs.loewner import positive_definite
from verification.constants import measure
from verification.interface.pair import pair_from
from verification.semidefinite import LMIError
from verification.semidefinite.multipliers import QuadraticForms


def test_what_is_called_definite_is_so_in_rationals_however_close_to_singular():
    """``L D L'`` with one pivot down to 1e-18 of either sign, rounded once."""
    random = np.random.default_rng(1)
    said = {True: 0, False: 0}
    count = 4000 if AT_NIGHT else 1000
    for _ in range(count):
        n = int(random.integers(2, 5))
        L, D = exact(np.tril(random.uniform(-1, 1, (n, n)), -1) + np.eye(n)), exact(random.uniform(0.1, 1, n))
        D[int(random.integers(n))] = rational(random.choice([-1, 1]) * 10.0 ** random.uniform(-18, -12))
        A = L * D @ L.T
        rounded = np.array([[float(Fraction(int(v.p), int(v.q))) for v in row] for row in A])
        found = positive_definite(Enclosed(middle=rounded, radius=2 * UNIT * np.abs(rounded)))
        said[found] += 1
        assert is_definite(A) or not found
    assert min(said.values()) > count / 10


def test_what_is_large_does_not_hide_what_is_small():
    """A radius beside an entry that is large says nothing of one that is small, whatever the units of both."""
    A, radius = np.array([[2.0, 1.0], [1.0, 2.0]]), np.full((2, 2), 0.4)
    for size in (1.0, 1e-10, 1e-100):
        scale = np.outer((1.0, size), (1.0, size))
        assert positive_definite(Enclosed(middle=A * scale, radius=radius * scale))
        assert not positive_definite(Enclosed(middle=A * scale, radius=1.5 * radius * scale))


# --- the semidefinite bound -----------------------------------------------------------------------------------------


def proved(pair, multipliers, theta: float, square: Fraction) -> bool:
    """True if multipliers prove the square of a factor in rationals."""
    wk = exact(pair.contact.grid.weights) * rational(float(pair.friction))
    given = {"step": (theta, 1 - Fraction(theta)), "wk": wk, "kernel": pair.interface.kernel}
    return is_definite(form_of(pair.contact.schur, pair.neumann.schur, multipliers, square, **given))


def slender(length: int) -> vf.Problem:
    """A tower on a block: the longer, the closer to singular its stiffness on Gamma_c."""
    data = blocks(
        heights=(1, length),
        cells=((2, 2), (2, 40)),
        body2={"prescribed": {"top": [0, -1]}},
        contact={"friction": "1/5", "radius": 1},
        iteration={"theta": "1/2", "neumann_body": 1},
    )
    return vf.Problem.from_dict(data)


@pytest.mark.parametrize("index", range(6))
def test_the_multipliers_prove_the_factor_in_rationals(index):
    pair, measured, theta, _ = case(few_nodes(index))
    found = QuadraticForms(pair, measured).factor(theta)
    _, tau, a, b = found.multipliers
    assert min(m.min() for m in found.multipliers) >= 0
    assert all(4 * Fraction(x) * Fraction(y) >= Fraction(z) ** 2 for x, y, z in zip(a, b, tau, strict=True))
    assert proved(pair, found.multipliers, theta, Fraction(found.value) ** 2 * (1 + Fraction(1, 10**15)))
    assert not proved(pair, found.multipliers, theta, Fraction(found.value) ** 2 * (1 - Fraction(1, 10**5)))


@pytest.mark.parametrize(("length", "condition"), [(10**2, 1e7), (10**3, 1e9), (10**4, 1e11), (5 * 10**4, 1e12)])
def test_near_singular_stiffness_makes_the_factor_larger_never_too_small(length, condition):
    """The value that is given is proved in rationals; it gives away at most a thousandth for it."""
    pair = pair_from(slender(length))
    assert np.linalg.cond(pair.contact.schur) > condition
    found = QuadraticForms(pair, measure(pair)).factor(0.5)
    assert found.evaluated < found.value < 1.001 * found.evaluated
    assert proved(pair, found.multipliers, 0.5, Fraction(found.value) ** 2 * (1 + Fraction(1, 10**15)))


def test_where_rounding_hides_what_the_multipliers_leave_nothing_is_claimed(monkeypatch):
    """A tower 1e6 times as high as wide: condition 4e15."""
    monkeypatch.setattr("verification.interface.pair.LEAST_RCOND", 0.0)  # such bodies are refused
    pair = pair_from(slender(10**6))
    with pytest.raises(LMIError):
        QuadraticForms(pair, measure(pair)).factor(0.5)
