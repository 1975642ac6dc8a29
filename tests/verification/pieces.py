"""T near a force: what the tests of its affine pieces share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import islice

import numpy as np
from hypothesis import strategies as st
from problem_list import blocks

import verification as vf
from verification.algorithm.affine_piece import Piece, piece_of
from verification.algorithm.fixed_point import FixedPointMap, iterate_at
from verification.algorithm.iterate import Iterate
from verification.contact import ContactError
from verification.interface.pair import ContactPair, pair_from

seeds = st.integers(0, 2**32 - 1).map(np.random.default_rng)


class Evaluated:
    """T at forces, with all that the piece around one of them decides on."""

    def __init__(self, pair: ContactPair) -> None:
        self.pair, self.t = pair, pair.contact.grid.t

    def __call__(self, g: np.ndarray) -> Iterate:
        try:
            return iterate_at(FixedPointMap(self.pair, "active-set"), g)
        except ContactError:
            return iterate_at(FixedPointMap(self.pair, "cvxpy"), g)

    def stress(self, g: np.ndarray) -> np.ndarray:
        """S sigma_N; none without a law of friction, or where nothing rubs."""
        if self.pair.interface.kernel is None or not self.pair.friction:
            return np.zeros(0)
        return self.pair.interface.kernel @ g[self.t :]

    def same(self, g: np.ndarray, state: Iterate) -> bool:
        """Whether g lies on the piece of a state; where no friction can act, the direction of slip does not matter."""
        sign, one, two = np.sign(self.stress(state.g)), self(g).contact.pattern, state.contact.pattern
        rubs = self.pair.bound(state.g) != 0
        return (
            np.array_equal(np.sign(self.stress(g)), sign)
            and np.array_equal(one.touching, two.touching)
            and np.array_equal(one.sliding[rubs], two.sliding[rubs])
        )

    def reach(self, state: Iterate, step: np.ndarray) -> float:
        """The largest 2^-i for which the piece of a state contains both ends of a step; 0 beyond i = 20.

        The piece is convex: then it contains all between.
        """
        for i in range(21):
            if self.same(state.g + step / 2**i, state) and self.same(state.g - step / 2**i, state):
                return 0.5**i
        return 0.0

    def slack(self, state: Iterate, piece: Piece) -> np.ndarray:
        """How far each inequality of step II, and each sign of S sigma_N, is from its end."""
        v, force, sliding, t = state.contact.v, state.contact.force, piece.pattern.sliding, self.t
        bound = self.pair.bound(state.g)
        rubs, slips = piece.sign != 0, (sliding != 0)
        touching = np.where(piece.pattern.touching, force[t:], -v[t:])
        if not rubs.any():
            return touching
        sticks = np.concatenate([(bound - force[:t])[rubs & ~slips], (bound + force[:t])[rubs & ~slips]])
        return np.concatenate(
            [touching, (sliding * v[:t])[rubs & slips], sticks, (piece.sign * self.stress(state.g))[rubs]]
        )


def forces(pair: ContactPair, random: np.random.Generator) -> np.ndarray:
    """A random force of the size of the loads."""
    size = max(pair.neumann.dual_norm(side.load) for side in (pair.neumann, pair.contact)) or 1.0
    force = pair.neumann.root @ random.standard_normal(pair.neumann.root.shape[1])
    return 10 ** random.uniform(-1, 1) * size * force / pair.neumann.dual_norm(force)


def along_a_run(pair: ContactPair, count: int) -> np.ndarray:
    """The force after some steps from 0, with a theta of 0.3."""
    *_, state = islice(vf.iterate(pair, theta=0.3), count + 1)
    return state.g


def assert_affine(
    pair: ContactPair,
    g: np.ndarray,
    random: np.random.Generator,
    change: Callable[[Piece], Piece] = lambda piece: piece,
) -> bool:
    """T' d, and the derivatives of the jump and of the friction bound, are differences over a step of any length.

    Returns whether the piece was large enough for a step.
    """
    T = Evaluated(pair)
    state = T(g)
    piece = change(piece_of(pair, state.g, state.contact.pattern))
    norm, basis = pair.neumann.dual_norm, piece.basis
    size = norm(g) or norm(state.image) or 1.0
    d = basis @ random.standard_normal(basis.shape[1])
    d[pair.contact.grid.normal][piece.still] = 0.0  # to the last digit
    d *= size / norm(d)
    length = T.reach(state, d)
    if length < 1e-4:
        return False
    step = length * d
    ahead, behind = T(g + step), T(g - step)
    bound = pair.bound
    # rounding: some units in the last place of all that is added up, over the length of the step
    u = np.abs(pair.contact.stiffness) @ (np.abs(state.displacement) + np.abs(state.contact.v))
    terms = u + np.abs(pair.contact.load) + np.abs(g)
    rounding = 1e-14 * np.linalg.norm(terms) / length
    flexible = np.linalg.norm(pair.contact.inverse, 2)
    for derivative, difference, error in (
        (piece.force @ d, (ahead.image - behind.image) / (2 * length), rounding),
        (piece.jump @ d, (ahead.contact.v - behind.contact.v) / (2 * length), rounding * flexible),
        (piece.bound @ d, (bound(g + step) - bound(g - step)) / (2 * length), rounding),
    ):
        assert np.linalg.norm(derivative - difference) <= 1e-9 * np.linalg.norm(derivative) + error
    return True


def held(neumann: bool) -> ContactPair:
    """The lower body on rollers at a side that ends at Gamma_c; it has the Neumann problem or the contact problem."""
    data = blocks(
        body1={"prescribed": {"left": [0, "free"]}},
        body2={"prescribed": {"top": ["1/50", "-1/50"]}},
        contact={"friction": "1/2", "radius": "1/3"},
        iteration={"neumann_body": 1 if neumann else 2},
    )
    pair = pair_from(vf.Problem.from_dict(data))
    assert not pair.body1.free[0]
    return pair


def at_solution(pair: ContactPair) -> Iterate | None:
    """T at its fixed point, to rounding; None where no rule finds it."""
    for relaxation in ("newton", "anderson", "aitken"):
        settings = replace(pair.settings, tolerance=1e-13, relaxation=relaxation, max_iterations=100)
        found = vf.run(replace(pair, settings=settings), theta="1/3")
        if found.converged:
            return found.last
    return None
