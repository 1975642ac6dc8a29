"""False bounds among random pencils that are nearly singular, with exact rationals as the truth; there must be none.

python benchmarks/near_singular.py [--count N] [--seed S]

Each case is a symmetric matrix K = L D L' of rationals whose last pivot is between 1e-6 and 1e-24, positive, negative
or 0, and an H that is positive definite.  Three things are held against elimination in rationals:

* that ``A - lambda H``, which is K, is positive definite, where that is said to be proved;
* the bounds of the Schur complement of K on some of its rows;
* the bounds of the largest eigenvalue of a pencil of A and H.
"""

from __future__ import annotations

import argparse
import random
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from time import perf_counter
from typing import Any

import numpy as np
import scipy.sparse as sp

from fem1d2d.enclosed import Enclosed
from fem1d2d.loewner import Elimination, positive_definite
from fem1d2d.proved import enclose_largest

#: The shift lambda of a pencil: a double, as a bound that is tried is one.
SHIFTS = (0.5, 1.0, 0.1, 3.7, 1e-3)


def pivots(matrix: Any) -> list[Fraction] | None:
    """The pivots of a symmetric matrix of rationals; None where one of them, but the last, is 0."""
    rows = [list(row) for row in matrix]
    found = []
    for k, row in enumerate(rows):
        found.append(row[k])
        if k + 1 < len(rows) and not row[k]:
            return None
        for other in rows[k + 1 :]:
            factor = other[k] / row[k]
            for j in range(k, len(rows)):
                other[j] -= factor * row[j]
    return found


def definite(matrix: Any) -> bool:
    """Whether a symmetric matrix of rationals is positive definite."""
    found = pivots(matrix)
    return found is not None and all(pivot > 0 for pivot in found)


def schur(matrix: Any, inside: list[int], interface: list[int]) -> Any:
    """The Schur complement of a matrix of rationals on some of its rows."""
    order = [*inside, *interface]
    rows = [[matrix[i][j] for j in order] for i in order]
    for k in range(len(inside)):
        for other in rows[k + 1 :]:
            factor = other[k] / rows[k][k]
            for j in range(k, len(order)):
                other[j] -= factor * rows[k][j]
    return rationals([row[len(inside) :] for row in rows[len(inside) :]])


def rationals(rows: Any) -> Any:
    """A matrix of rationals from rows of them, or of the doubles that are meant."""
    return np.array([[Fraction(x) for x in row] for row in rows], dtype=object)


@dataclass(frozen=True, kw_only=True)
class Case:
    """A nearly singular K, and ``A = K + shift H``."""

    K: Any
    H: Any
    shift: float
    sparse: bool
    coarse: bool
    inside: list[int]
    interface: list[int]

    @property
    def A(self) -> Any:
        """``K + shift H``."""
        return self.K + Fraction(self.shift) * self.H

    def enclosed(self, exact: Any) -> Enclosed:
        """A matrix of rationals as doubles with radii, sparse or dense; where coarse, far larger ones than rounding."""
        dense = Enclosed.rounded(exact)
        if self.coarse:
            middle = dense.middle.astype(np.float32).astype(float)
            dense = Enclosed(middle=middle, radius=2.0**-23 * np.abs(middle))
        if not self.sparse:
            return dense
        return Enclosed(middle=sp.csc_array(dense.middle), radius=sp.csc_array(dense.radius))

    @classmethod
    def drawn(cls, draw: random.Random) -> Case:
        """A case; every third has entries that doubles hold exactly, so that rounding alone can go wrong."""
        n = draw.randint(1, 6)
        units = [Fraction(1, 2**10)] if draw.random() < 1 / 3 else [Fraction(1, d) for d in (3, 7, 10, 11)]
        number = lambda: draw.randint(-40, 40) * draw.choice(units)
        L = rationals([[1 if i == j else number() if j < i else 0 for j in range(n)] for i in range(n)])
        last = draw.choice([1, -1, -1, 0]) * Fraction(1, 2 ** draw.randint(20, 80))
        D = [abs(number()) + units[0] for _ in range(n - 1)] + [last]
        K = L @ np.diag(rationals([D])[0]) @ L.T
        B = rationals([[number() for _ in range(n)] for _ in range(n)])
        H = B @ B.T + np.diag(rationals([[1] * n])[0])
        order = draw.sample(range(n), n)
        cut = draw.randint(0, n - 1)
        K = K[np.ix_(order, order)]
        return cls(
            K=K,
            H=H,
            shift=draw.choice(SHIFTS),
            sparse=draw.random() < 0.2,
            coarse=draw.random() < 0.2,
            inside=sorted(set(range(n)) - set(order[:cut])),
            interface=order[:cut],
        )


def claims(case: Case) -> Iterator[tuple[str, bool]]:
    """What is proved of a case, and whether it is true."""
    A, H = case.enclosed(case.A), case.enclosed(case.H)
    if positive_definite(A.plus(-case.shift, H)):
        yield "definite", definite(case.K)
    K = case.enclosed(case.K)
    # the unknowns inside come first in the order of the positions, as they do in `schur`
    eliminated = Elimination(K, np.array(case.interface, dtype=np.int64))
    low = eliminated.bound(1)
    if low is not None:
        corner = [[case.K[i][j] for j in case.inside] for i in case.inside]
        yield "definite inside", definite(corner)
        high = eliminated.bound(-1)
        if case.interface:
            S = schur(case.K, case.inside, case.interface)
            yield "Schur complement from below", definite(S - rationals(low.tolist()))
            if high is not None:
                yield "Schur complement from above", definite(rationals(high.tolist()) - S)
    if not case.sparse:
        below, above = enclose_largest((A, H))
        if above is not None:
            yield "eigenvalue from above", definite(Fraction(above) * case.H - case.A)
        if below is not None:
            yield "eigenvalue from below", not definite(Fraction(below) * case.H - case.A)


def count(cases: int, seed: int = 0) -> tuple[Counter[str], Counter[str]]:
    """How many claims were made, and how many of them are false, by kind."""
    made: Counter[str] = Counter()
    false: Counter[str] = Counter()
    draw = random.Random(seed)
    for _ in range(cases):
        for kind, holds in claims(Case.drawn(draw)):
            made[kind] += 1
            false[kind] += not holds
    return made, +false


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    started = perf_counter()
    made, false = count(options.count, options.seed)
    print(f"{options.count} cases from seed {options.seed}, {perf_counter() - started:.0f} s")
    for kind, number in sorted(made.items()):
        print(f"  {kind:30} {number:8} proved, {false[kind]} of them false")
    raise SystemExit(1 if false else 0)
