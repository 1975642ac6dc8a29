"""False bounds among random pencils that are nearly singular, with exact integers as the truth; there must be none.

python benchmarks/near_singular.py [--count N] [--seed S] [--jobs J]

Each case is a symmetric matrix K = L D L' whose last pivot, or last two, are between 1e-6 and 1e-24, positive, negative
or 0, an H that is positive definite, and a double lambda.  It is the least eigenvalue of ``A = K + lambda H``, or the
largest one of ``A = lambda H - K``: nearly, and exactly where such a pivot is 0.  These are held against elimination
without fractions in integers:

* that K is positive definite with lambda replaced by a double up to three places beside it, where that is said to be
  proved;
* the bounds of the Schur complement of K on some of its rows;
* the bounds of the largest eigenvalue of A and H, found from no guess or from a double beside lambda.
"""

from __future__ import annotations

import argparse
import math
import random
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from time import perf_counter

import numpy as np
import scipy.sparse as sp
from joblib import Parallel, delayed

from fem1d2d.mesh import Floats
from fem1d2d.proofs.enclosed import Enclosed
from fem1d2d.proofs.loewner import Elimination, positive_definite
from fem1d2d.proofs.proved import enclose_largest
from verification.machine.threads import one_thread

#: The lambda of a pencil: a double, as a bound that is tried is one.
SHIFTS = (0.5, 1.0, 0.1, 3.7, 1e-3)

#: How many doubles from lambda a claim is tried.
BESIDE = (-3, -2, -1, 0, 1, 2, 3)

#: Entries are integers times 2^-BITS, of which the last FACTOR are for a factor that makes doubles round them.
BITS, FACTOR = 128, 32

#: Cases drawn from one seed, which one process counts.
BLOCK = 1000

#: A symmetric matrix of integers, by rows.
Integers = list[list[int]]


def pivots(matrix: Integers) -> list[int]:
    """The signs of the pivots of a symmetric matrix of integers, up to the first that is 0.

    By Bareiss' elimination: its entries are minors, so that each division leaves no rest.
    """
    rows, before, found = [row[:] for row in matrix], 1, []
    for k, row in enumerate(rows):
        pivot = row[k]
        found.append((pivot > 0) - (pivot < 0) if before > 0 else (pivot < 0) - (pivot > 0))
        if not pivot:
            return found
        for i in range(k + 1, len(rows)):
            other, share = rows[i], row[i]
            for j in range(i, len(rows)):
                other[j] = (pivot * other[j] - share * row[j]) // before
        before = pivot
    return found


def definite(matrix: Integers) -> bool:
    """Whether a symmetric matrix of integers is positive definite."""
    return pivots(matrix) == [1] * len(matrix)


def combined(a: int, X: Integers, b: int, Y: Integers) -> Integers:
    """``a X + b Y``."""
    return [[a * x + b * y for x, y in zip(*rows, strict=True)] for rows in zip(X, Y, strict=True)]


def moved(x: float, steps: int) -> float:
    """The double some steps above another one, or below it."""
    for _ in range(abs(steps)):
        x = math.nextafter(x, math.copysign(math.inf, steps))
    return x


@dataclass(frozen=True, kw_only=True)
class Case:
    """A nearly singular K, and a pencil of which ``shift`` is nearly the least (side 1) or largest (-1) eigenvalue.

    ``K``, ``H`` and ``A`` hold integers, and 2^-BITS times these is meant.
    """

    K: Integers
    H: Integers
    shift: float
    side: int
    beside: float
    guessed: bool
    sparse: bool
    coarse: bool
    inside: list[int]
    interface: list[int]
    order: list[int] | None

    @property
    def A(self) -> Integers:
        """``K + shift H``, or ``shift H - K``."""
        return combined(self.side, self.K, 1, self.times(self.shift))

    def times(self, shift: float) -> Integers:
        """``shift H``, whose entries are integers."""
        p, q = shift.as_integer_ratio()
        return [[p * x // q for x in row] for row in self.H]

    def enclosed(self, exact: Integers) -> Enclosed:
        """A matrix as doubles with radii, sparse or dense; where coarse, far larger ones than those of rounding."""
        whole = Enclosed.rounded(np.array(exact, dtype=object))
        dense = Enclosed(middle=2.0**-BITS * whole.middle, radius=2.0**-BITS * whole.radius)
        if self.coarse:
            middle = dense.middle.astype(np.float32).astype(float)
            dense = Enclosed(middle=middle, radius=2.0**-23 * np.abs(middle))
        if not self.sparse:
            return dense
        return Enclosed(middle=sp.csc_array(dense.middle), radius=sp.csc_array(dense.radius))

    def less(self, bound: Floats) -> Integers:
        """K minus a matrix of doubles on the interface, the unknowns inside first, times a power of 2.

        It has the pivots of K inside, and then those of the Schur complement minus the bound.
        """
        ratios = [[x.as_integer_ratio() for x in row] for row in bound.tolist()]
        scale = max(q for row in ratios for _, q in row)
        order = [*self.inside, *self.interface]
        result = [[scale * self.K[i][j] for j in order] for i in order]
        for row, own in zip(result[len(self.inside) :], ratios, strict=True):
            for j, (p, q) in enumerate(own, len(self.inside)):
                row[j] -= (p * (scale // q)) << BITS
        return result

    @classmethod
    def drawn(cls, draw: random.Random) -> Case:
        """A case; every third has entries that doubles hold exactly, so that rounding alone can go wrong."""
        n = draw.randint(1, 6)
        held = draw.random() < 1 / 3
        unit, shares = (2**10, (1,)) if held else (2310, (770, 330, 231, 210))  # 1/3, 1/7, 1/10, 1/11
        factor = lambda: 2**FACTOR if held else draw.getrandbits(FACTOR - 1) + 2 ** (FACTOR - 1) | 1
        sparse = draw.random() < 0.1
        zeros = 0.5 if sparse and draw.random() < 0.5 else 0.0
        number = lambda: draw.randint(-40, 40) * draw.choice(shares) if not zeros or draw.random() > zeros else 0
        room = BITS - FACTOR
        D = [abs(number()) + shares[0] << room for _ in range(n)]
        for i in range(max(n - 1 - (draw.random() < 0.2), 0), n):
            D[i] = draw.choice([1, -1, -1, 0]) * unit << room - draw.randint(20, 80)
        L = [[number() for _ in range(i)] + [unit] for i in range(n)]
        times = factor()
        K = [[0] * n for _ in range(n)]
        for i in range(n):
            for j in range(i + 1):
                K[i][j] = K[j][i] = times * sum(L[i][m] * D[m] * L[j][m] for m in range(j + 1))
        B = [[number() for _ in range(n)] for _ in range(n)]
        times = factor() * unit << room
        H = [[times * (sum(map(int.__mul__, B[i], B[j])) + unit**2 * (i == j)) for j in range(n)] for i in range(n)]
        order = draw.sample(range(n), n)
        cut = draw.randint(0, n - 1)
        inside, interface = sorted(order[cut:]), order[:cut]
        shift = draw.choice(SHIFTS)
        return cls(
            K=[[K[i][j] for j in order] for i in order],
            H=H,
            shift=shift,
            side=draw.choice([1, -1]),
            beside=moved(shift, draw.choice(BESIDE)),
            guessed=draw.random() < 0.5,
            sparse=sparse,
            coarse=draw.random() < 0.2,
            inside=inside,
            interface=interface,
            order=draw.sample(inside, n - cut) + interface if draw.random() < 0.5 else None,
        )


def claims(case: Case) -> Iterator[tuple[str, bool]]:
    """What is proved of a case, and whether it is true."""
    exact, side = case.A, case.side
    A, H, K = case.enclosed(exact), case.enclosed(case.H), case.enclosed(case.K)
    order = None if case.order is None else np.array(case.order)
    shifted = A.plus(-case.beside, H) if side > 0 else H.plus(-1.0, A, factor=case.beside)
    if positive_definite(shifted, order):
        yield "definite", definite(combined(side, exact, -side, case.times(case.beside)))
    eliminated = Elimination(K, np.array(case.interface, dtype=np.int64), order)
    low = eliminated.bound(1)
    if low is not None:
        corner = [[case.K[i][j] for j in case.inside] for i in case.inside]
        yield "definite inside", definite(corner)
        high = eliminated.bound(-1)
        if case.interface:
            yield "Schur complement from below", definite(case.less(low))
            if high is not None:
                signs = [1] * len(case.inside) + [-1] * len(case.interface)
                yield "Schur complement from above", pivots(case.less(high)) == signs
    guess = case.beside if side < 0 and case.guessed else None
    if not case.sparse or guess is not None:
        below, above = enclose_largest((A, H), guess=guess, order=order)
        if above is not None:
            p, q = above.as_integer_ratio()
            yield "eigenvalue from above", definite(combined(p, case.H, -q, exact))
        if below is not None:
            p, q = below.as_integer_ratio()
            yield "eigenvalue from below", not definite(combined(p, case.H, -q, exact))


def counted(cases: int, seed: str) -> tuple[Counter[str], Counter[str]]:
    """How many claims were made, and how many of them are false, by kind."""
    made: Counter[str] = Counter()
    false: Counter[str] = Counter()
    draw = random.Random(seed)
    with one_thread():
        for _ in range(cases):
            for kind, holds in claims(Case.drawn(draw)):
                made[kind] += 1
                false[kind] += not holds
    return made, +false


def count(cases: int, seed: int = 0, jobs: int = 1) -> tuple[Counter[str], Counter[str]]:
    """The same in blocks, each of which has a seed of its own: the numbers do not depend on the processes."""
    made: Counter[str] = Counter()
    false: Counter[str] = Counter()
    blocks = [(min(BLOCK, cases - start), f"{seed}, {start // BLOCK}") for start in range(0, cases, BLOCK)]
    for one, wrong in Parallel(n_jobs=jobs, return_as="generator")(delayed(counted)(*block) for block in blocks):
        made += one
        false += wrong
    return made, false


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args()
    started = perf_counter()
    made, false = count(options.count, options.seed, options.jobs)
    print(f"{options.count} cases from seed {options.seed}, {perf_counter() - started:.0f} s")
    for kind, number in sorted(made.items()):
        print(f"  {kind:30} {number:8} proved, {false[kind]} of them false")
    raise SystemExit(1 if false else 0)
