"""Random problems with real loads, and problems whose loads bring about a contact pattern that was chosen."""

from __future__ import annotations

from collections.abc import Iterator
from copy import deepcopy
from fractions import Fraction
from functools import lru_cache
from itertools import count, islice, product
from typing import Any

import numpy as np

from verification.algorithm.affine_piece import Piece
from verification.algorithm.fixed_point import FixedPointMap
from verification.algorithm.runs import Run, run
from verification.constants import Measured, measure
from verification.contact import ContactError, ContactSolution
from verification.contact.active_set import Pattern
from verification.interface.pair import ContactPair, pair_from
from verification.ledger.cases import problem, three_digits
from verification.ledger.large_friction import loaded


def relaxation_factor(random: np.random.Generator, rho: float) -> float:
    """Three digits between 0.3 and 1.1 times the predicted theta, at most 0.97."""
    return float(three_digits(min(2 / (2 + rho) * random.uniform(0.3, 1.1), 0.97)))


def case(
    seed: int, friction: Any = None, *, matching: bool = True, **iteration: Any
) -> tuple[ContactPair, Measured, float, np.random.Generator]:
    """The problem of a seed with its constants, a theta, and the generator that drew them."""
    *known, random = _drawn(seed, friction, matching, tuple(iteration.items()))
    return *known, deepcopy(random)


@lru_cache(maxsize=256)  # the same few seeds are asked for again and again
def _drawn(
    seed: int, friction: Any, matching: bool, iteration: tuple[tuple[str, Any], ...]
) -> tuple[ContactPair, Measured, float, np.random.Generator]:
    random = np.random.default_rng(seed)
    pair = pair_from(problem(random, friction, matching=matching, **dict(iteration)))
    measured = measure(pair)
    return pair, measured, relaxation_factor(random, measured.rho_max.value), random


def few_nodes(index: int, least: int = 1) -> int:
    """The seed of one of the problems with friction on so few contact nodes that their 6^n pieces can be counted."""
    fits = lambda pair: least <= pair.contact.grid.n <= 3 and pair.friction
    return next(islice((seed for seed in count() if fits(case(seed)[0])), index, None))


def energy(measured: Measured) -> tuple[Fraction, Fraction, Fraction]:
    """rho at work, kappa_1, kappa_2."""
    constants = measured.energy_constants()
    return constants.at_work, constants.kappa_1, constants.kappa_2


def run_of(pair: ContactPair, measured: Measured, theta: float) -> Run:
    """A run with its linearisation, by the active set alone where that is enough."""
    try:
        return run(pair, theta=theta, measured=measured, solver="active-set").linearise()
    except ContactError:
        return run(pair, theta=theta, measured=measured).linearise()


def step_II(pair: ContactPair, g: np.ndarray) -> ContactSolution:
    """Step II for one force; its reaction is T g."""
    try:
        return FixedPointMap(pair, "active-set")(g)[1]
    except ContactError:
        return FixedPointMap(pair, "cvxpy")(g)[1]


with_loads = loaded


def state_of(
    pair: ContactPair, pattern: Pattern, g: np.ndarray, random: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """A jump and a reaction with a pattern at g, every inequality of step II strict: of size 1 in S_1 and R g_N.

    Open nodes are apart by 0.5 to 1, touching ones press; sliding ones slide by 0.5 to 1, sticking ones carry less than
    half of what friction could.
    """
    t, n = pair.contact.grid.t, pair.contact.grid.n
    contact = pair.contact.schur
    bound = pair.bound(g)
    large = lambda size: random.uniform(0.5, 1, size)
    length = np.linalg.norm(g) / np.linalg.norm(contact, 2)
    slide, gap = pattern.sliding * large(t) * length, -large(n) * length
    shear = np.where(pattern.sliding != 0, pattern.sliding * bound, random.uniform(-0.5, 0.5, t) * bound)
    pressure = large(n) * np.abs(g).max()
    v = np.concatenate([slide, np.where(pattern.touching, 0.0, gap)])
    return v, np.concatenate([shear, np.where(pattern.touching, pressure, 0.0)])


def every_piece(pair: ContactPair) -> Iterator[Piece]:
    """Every contact pattern; the sign of S sigma_N only turns the direction of slip."""
    n, t = pair.contact.grid.n, pair.contact.grid.t
    rubs = bool(pair.friction)
    for choice in product(product((True, False), (0, 1, -1) if rubs else (1,)), repeat=n):
        touching, sliding = (np.array(values) for values in zip(*choice, strict=True))
        pattern = Pattern(touching=touching, sliding=sliding.astype(np.int8))
        yield Piece(
            pair=pair, pattern=pattern, sign=np.full(t, int(rubs), dtype=np.int8), still=np.zeros(n, dtype=bool)
        )
