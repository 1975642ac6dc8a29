"""The certificate of the semidefinite edition: its multipliers, its form, and what they prove of all theta."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from chain_problems import case, energy, step_II
from dense_oracle import DensePair
from scipy.linalg import block_diag, eigh
from strategies import AT_NIGHT

from ndtheory import energy_norms
from verification.interface.pair import ContactPair
from verification.semidefinite import LMIError
from verification.semidefinite.multipliers import NARROW, QuadraticForms, friction_threshold
from verification.semidefinite.pattern_search import largest_factor, worst_piece

Multipliers = tuple[np.ndarray, ...]


# --- the certificate --------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Forms:
    """The quadratic forms of the semidefinite bound, from dense matrices of their own.

    In the vectors (g, p) of a pair: ``p = -S_1 d_1``, ``d_2 = S_2^-1 g``.  Without friction p has no tangential part.
    """

    S_1: np.ndarray
    S_2: np.ndarray
    hat: np.ndarray
    weight: np.ndarray  # w_j k
    t: int

    @classmethod
    def of(cls, pair: ContactPair, weight: float = 1.0) -> Forms:
        dense = DensePair.of(pair)
        k = weight * dense.friction * dense.weights
        return cls(S_1=dense.contact.S, S_2=dense.neumann.S, hat=dense.hat, weight=k, t=dense.t)

    def terms(self, g: np.ndarray, p: np.ndarray, multipliers: Multipliers) -> float:
        """Sigma for one pair, term by term."""
        jump = -np.linalg.solve(self.S_1, p) - np.linalg.solve(self.S_2, g)
        t = self.t
        total = float(multipliers[0] @ (p[t:] * jump[t:]))
        if len(multipliers) > 1:
            _, tau, a, b = multipliers
            zeta = self.hat @ g[t:]
            total += float(tau @ (p[:t] * jump[:t]) + self.weight @ (a * zeta**2 + b * jump[:t] ** 2))
        return total

    def value(self, g: np.ndarray, p: np.ndarray, multipliers: Multipliers, q: float, theta: float) -> float:
        """Phi_q for one pair."""
        square = lambda force: float(force @ np.linalg.solve(self.S_2, force))
        return q**2 * square(g) - square(theta * p + (1 - theta) * g) - self.terms(g, p, multipliers)

    def matrix(self, multipliers: Multipliers, q: float, theta: float) -> np.ndarray:
        """Phi_q in the columns of ``basis``."""
        g, p = np.split(self.basis(multipliers), [len(self.S_2)])
        flexible, t = np.linalg.inv(self.S_2), self.t
        jump, step = -np.linalg.solve(self.S_1, p) - flexible @ g, theta * p + (1 - theta) * g
        form = q**2 * g.T @ flexible @ g - step.T @ flexible @ step - p[t:].T @ np.diag(multipliers[0]) @ jump[t:]
        if len(multipliers) > 1:
            _, tau, a, b = multipliers
            zeta = self.hat @ g[t:]
            form -= p[:t].T @ np.diag(tau) @ jump[:t] + zeta.T @ np.diag(self.weight * a) @ zeta
            form -= jump[:t].T @ np.diag(self.weight * b) @ jump[:t]
        return (form + form.T) / 2

    def basis(self, multipliers: Multipliers) -> np.ndarray:
        """Pairs (g, p) as columns: ``|||g|||`` and ``|d_1|`` are Euclidean in them."""
        flexible = np.linalg.inv(self.S_1)
        carries = slice(0, None) if len(multipliers) > 1 else slice(self.t, None)
        p = np.zeros((len(self.S_1), len(flexible[carries])))
        p[carries] = np.linalg.inv(np.linalg.cholesky(flexible[carries, carries])).T
        return block_diag(np.linalg.cholesky(self.S_2), p)

    def least(self, multipliers: Multipliers, theta: float) -> float:
        """The least q for which Phi_q is positive semidefinite."""
        form, n = self.matrix(multipliers, 0.0, theta), len(self.S_2)
        rest = form[:n, :n] - form[:n, n:] @ np.linalg.solve(form[n:, n:], form[n:, :n])
        return float(np.sqrt(max(-np.linalg.eigvalsh(rest)[0], 0.0)))

    def prove(self, multipliers: Multipliers, q: float, theta: float) -> bool:
        """Whether multipliers prove a factor: those of the cone, for which the form is positive semidefinite."""
        if any((m < 0).any() for m in multipliers):
            return False
        if len(multipliers) > 1:
            _, tau, a, b = multipliers
            if (4 * a * b < tau**2 * (1 - 1e-12)).any():
                return False
        try:
            np.linalg.cholesky(self.matrix(multipliers, q, theta))
        except np.linalg.LinAlgError:
            return False
        return True


CERTIFIED = range(0, 36, 3 if AT_NIGHT else 6)


@cache
def proved(seed):
    """The factor of a seed with its multipliers."""
    pair, measured, theta, _ = case(seed)
    return QuadraticForms(pair, measured).factor(theta)


@pytest.mark.parametrize("seed", CERTIFIED)
def test_the_multipliers_prove_the_factor_and_no_smaller_one(seed):
    pair, _, theta, random = case(seed)
    found = proved(seed)
    forms, q = Forms.of(pair), found.value
    assert forms.prove(found.multipliers, q * (1 + 1e-6), theta)
    assert not forms.prove(found.multipliers, q * (1 - 1e-6), theta)
    assert forms.least(found.multipliers, theta) == pytest.approx(q, rel=1e-7)
    # term by term, in the directions in which the form is least and in random ones
    form, basis = forms.matrix(found.multipliers, q, theta), forms.basis(found.multipliers)
    for x in [*eigh(form)[1].T[:3], *random.standard_normal((20, len(form)))]:
        g, p = np.split(basis @ x, [len(forms.S_2)])
        value = forms.value(g, p, found.multipliers, q, theta)
        assert value == pytest.approx(x @ form @ x, rel=1e-9, abs=1e-9 * np.abs(form).max() * (x @ x))
        assert value >= -1e-9 * np.abs(form).max() * (x @ x)


@pytest.mark.parametrize("seed", range(0, 40, 4 if AT_NIGHT else 8))
def test_the_form_of_the_edition_is_the_one_written_down(seed):
    """For multipliers of any kind."""
    pair, measured, theta, random = case(seed)
    edition, forms = QuadraticForms(pair, measured), Forms.of(pair)
    count = 4 if measured.friction else 1
    multipliers = tuple(random.standard_normal(pair.contact.grid.n) for _ in range(count))
    basis, sizes = forms.basis(multipliers), edition.conditions(multipliers)
    x = random.standard_normal((2, len(sizes)))
    # in both coordinates |||g||| and |d_1| are Euclidean: the eigenvalues agree
    for q in (0.0, 2.0):
        step = theta * edition.p + (1 - theta) * edition.g
        form = q**2 * edition.g.T @ edition.g - step.T @ step - sizes
        expected = forms.matrix(multipliers, q, theta)
        scale = np.abs(expected).max()
        assert np.abs(np.linalg.eigvalsh(form) - np.linalg.eigvalsh(expected)).max() < 1e-9 * scale
    assert basis.shape[1] == len(sizes) == x.shape[1]


@pytest.mark.parametrize("seed", range(0, 40, 2 if AT_NIGHT else 4))
def test_two_forces_obey_the_conditions_of_step_II_node_by_node(seed):
    """So that Sigma >= 0 for any multipliers of the cone, and the quotient is below the factor they prove."""
    pair, _, _, random = case(seed)
    forms, neumann, t = Forms.of(pair), pair.neumann, pair.contact.grid.t
    size = max(neumann.dual_norm(side.load) for side in (neumann, pair.contact)) or 1.0
    for length in (0.1, 1.0, 10.0):
        first, second = (neumann.root @ random.standard_normal((2, neumann.root.shape[1], 1)))[..., 0] * length * size
        one, two = step_II(pair, first), step_II(pair, second)
        g, p, jump = first - second, one.force - two.force, one.v - two.v
        rounding = 1e-12 * np.abs(p).max() * np.abs(jump).max()
        assert (p[t:] * jump[t:] >= -rounding).all()
        reach = forms.weight * np.abs(forms.hat @ g[t:])
        assert (p[:t] * jump[:t] + reach * np.abs(jump[:t]) >= -rounding).all()


#: Multipliers and a form that claim more than is proved.
CHEATS: dict[str, Callable[[Multipliers], Multipliers]] = {
    "one lambda negative": lambda lam, *rest: (np.where(lam == lam.max(), -lam, lam), *rest),
    "tau beyond 2 sqrt(a b)": lambda lam, tau, a, b: (lam, np.maximum(tau, 2.002 * np.sqrt(a * b)), a, b),
    "no a": lambda lam, tau, a, b: (lam, tau, 0 * a, b),
    "no b": lambda lam, tau, a, b: (lam, tau, a, 0 * b),
}


@pytest.mark.parametrize("cheat", CHEATS)
def test_multipliers_outside_the_cone_are_refused(cheat):
    for seed in (2, 12):
        pair, _, theta, _ = case(seed)
        found, forms = proved(seed), Forms.of(pair)
        assert len(found.multipliers) == 4
        assert forms.prove(found.multipliers, 1.01 * found.value, theta)
        assert not forms.prove(CHEATS[cheat](*found.multipliers), 1.01 * found.value, theta)


@pytest.mark.parametrize("weight", [0.0, 0.9])
def test_a_form_with_less_weight_on_friction_is_refused(weight):
    """It would prove less than two forces show, or less than its multipliers do."""
    below = 0
    for seed in range(0, 16, 2):
        pair, measured, theta, random = case(seed)
        if measured.friction:
            found = proved(seed)
            claim = Forms.of(pair, weight).least(found.multipliers, theta)
            if claim < found.value * (1 - 1e-3):
                below += claim < largest_factor(pair, theta, random=random).value
                assert not Forms.of(pair).prove(found.multipliers, claim * (1 + 1e-6), theta)
    assert below > 3


# --- all theta at once ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", CERTIFIED)
def test_a_program_at_one_theta_bounds_the_square_of_the_factor_at_every_other(seed):
    pair, measured, theta, _ = case(seed)
    forms = QuadraticForms(pair, measured)
    bound, found = forms.on(forms.everywhere, theta)
    square = forms.square_from_below(found)
    assert square(theta) == pytest.approx(bound.value**2, rel=1e-5)
    shares = {
        other: square(other) / forms.factor(other).value ** 2
        for other in (0.2 * theta, 0.99 * theta, 1.01 * theta, 1.0)
    }
    assert all(share < 1 + 1e-5 for share in shares.values())
    assert all(shares[other] > 0.999 for other in (0.99 * theta, 1.01 * theta))


@pytest.mark.parametrize("seed", range(0, 40, 4 if AT_NIGHT else 8))
def test_below_the_largest_theta_of_the_edition_its_multipliers_prove_every_theta(seed):
    """Times theta, with q = 1; above it they do not."""
    pair, measured, _, _ = case(seed)
    found, forms = QuadraticForms(pair, measured).largest_theta(), Forms.of(pair)
    interval = energy_norms.contraction_interval(*(float(v) for v in energy(measured)), 1e-12)
    assert found is not None or interval is None
    if found is None:
        return
    assert found.value >= (0 if interval is None else interval[1]) * (1 - 1e-6)
    holds = lambda theta: forms.prove(tuple(theta * m for m in found.multipliers), 1.0, theta)
    assert all(holds(share * found.value) for share in (0.01, 0.3, 0.9, 1 - 1e-6))
    assert found.value == 1 or not holds(found.value * (1 + 1e-6))


@pytest.mark.parametrize("seed", range(0, 40, 4 if AT_NIGHT else 8))
def test_the_friction_number_bounds_the_work_of_every_piece_and_is_at_most_that_of_the_theorem(seed):
    """``<g, p> <= c |||g|||^2``."""
    pair, measured, _, random = case(seed)
    c = QuadraticForms(pair, measured).friction_number().value
    work = lambda found: (found.force @ pair.neumann.inverse, found.g)
    _, kappa_1, kappa_2 = (float(v) for v in energy(measured))
    assert worst_piece(pair, work, random=random).value <= c + 1e-9
    assert c <= energy_norms.friction_number(kappa_1, kappa_2) + 1e-9


@pytest.mark.parametrize("seed", [2, 11, 23])
def test_the_friction_threshold_lies_where_the_friction_number_reaches_1(seed):
    """From below, within a share of NARROW; never below that of the theorem in energy norms where both are resolved."""
    pair, measured, _, _ = case(seed)
    start = measured.friction_threshold.value
    found = friction_threshold(pair, measured, start)
    number = lambda k: QuadraticForms(pair, measured, friction=k).friction_number()
    assert number(found).value < 1
    assert number(found * (1 + 1.5 * NARROW)).evaluated >= 1
    assert found >= start * (1 - NARROW)


def test_where_no_friction_leaves_multipliers_that_prove_anything_no_threshold_is_named(monkeypatch):
    pair, measured, _, _ = case(2)

    def fail(self, near, *, stop):
        raise LMIError("made up")

    monkeypatch.setattr(QuadraticForms, "friction_number", fail)
    with pytest.raises(LMIError, match="no friction above"):
        friction_threshold(pair, measured, measured.friction_threshold.value)
