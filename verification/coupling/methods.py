"""Methods of relaxation compared on a spectrum: steps of each in both roles, and the one to take."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fem1d2d.mesh import Floats
from ndtheory.keys import Part, key
from verification.algorithm.loop import Ending, Evaluation, Outcome, evaluations, follow
from verification.coupling.kinds import METHODS, BodyNumber
from verification.coupling.spectrum import TOLERANCE, Spectrum
from verification.registry import RULES

#: The most evaluations of T that are simulated, and those that a formula counts for a constant theta.
MOST, COUNTED = 1000, 10**9

#: A residual may grow by this factor before a method arrives.
FAR = 1e60

#: A constant theta is kept if it takes at most so many times the fewest steps; Aitken, whose steps are predicted less
#: well, is preferred to IQN-ILS within the second number.
NEAR, NEAR_AITKEN = 1.3, 1.15

#: Nor is it given up, or are roles exchanged, for so few steps.
LITTLE = 2


@dataclass(frozen=True, kw_only=True)
class MethodRow(Part):
    """A method in one assignment of the roles."""

    method: str = key("`constant`, `aitken` or `iqn-ils`")
    neumann_body: BodyNumber | None = key(
        "the body with the Neumann problem",
        type="integer",
        null="where bodies have no numbers, as of vectors and logs",
        why="the bodies have no numbers",
    )
    exchanged: bool = key("whether the roles are exchanged, compared with the file or the run")
    theta: float = key("the constant factor; of the other two the first one", unit="1")
    steps: int | None = key(
        r"evaluations of $T$ from $x = 0$ until $\lvert Tx - x\rvert < 10^{-6}\,\lvert Tx\rvert$, with every "
        "eigenvalue equally in the first error",
        unit="1",
        null="where it does not arrive, or may not by the error of the least eigenvalue",
        why=lambda row: f"not in {COUNTED if row.method == 'constant' else MOST:g} steps",
    )
    bound: str | None = key(
        "`at most` of a constant theta where only the largest eigenvalue is known: then `steps` suffice for "
        "eigenvalues from 0 to it and any first error; `at least` of a prediction for the least rho of a run's bound",
        null="of a prediction",
        why="a prediction, no bound",
        default=None,
    )


@dataclass(frozen=True, kw_only=True)
class Advised(Part):
    """The method that is advised."""

    name: str = key("one of `methods.method`")
    neumann_body: BodyNumber | None = key("as in `methods`, also null", type="integer or null")
    exchanged: bool = key("as in `methods`")
    reason: str = key("its steps, and those of others")


def rows(
    spectrum: Spectrum, *, theta: float, neumann_body: BodyNumber | None, exchanged: bool, one_end: bool = False
) -> tuple[MethodRow, ...]:
    """The methods in one assignment of the roles, simulated on its spectrum with theta as the factor.

    With ``one_end`` only the largest eigenvalue is known, and the steps of a constant theta are :func:`at_most`.
    """
    bounded = lambda method: one_end and method == "constant"
    return tuple(
        MethodRow(
            method=method,
            neumann_body=neumann_body,
            exchanged=exchanged,
            theta=theta,
            steps=at_most(spectrum.high, theta) if bounded(method) else steps(spectrum, method, theta),
            bound="at most" if bounded(method) else None,
        )
        for method in METHODS
    )


def at_most(high: float, theta: float) -> int | None:
    """Evaluations of T that suffice with constant theta for eigenvalues from 0 to ``high``, whatever the solution is.

    With ``q = max(1 - theta, |1 - theta (1 + high)|)`` each mode of a solution of size 1 has ``|T x - x|`` at most
    ``(1 + high) q^n`` after n steps, and ``|T x|`` at least ``1 - high q^n``; so have their sums of squares.

    Examples
    --------
    >>> at_most(3.0, 0.4), steps(Spectrum.of([3.0]), "constant", 0.4), at_most(3.0, 0.5)
    (31, 31, None)
    """
    q = max(1 - theta, abs(1 - theta * (1 + high)))
    if not 0 < q < 1:
        return None
    steps = math.log(TOLERANCE / (1 + high * (1 + TOLERANCE))) / math.log(q)
    return math.floor(steps) + 2 if steps < COUNTED else None


def steps(spectrum: Spectrum, method: str, theta: float) -> int | None:
    """Evaluations of T from x = 0 until the relative residual is below TOLERANCE; None beyond what is simulated.

    The modes have equal weight in the first error.

    Examples
    --------
    >>> one = Spectrum.of([3.0])
    >>> [steps(one, "constant", theta) for theta in (0.25, 0.2, 0.5)], steps(one, "aitken", 0.1)
    ([2, 11, None], 3)
    """
    values = tuple(complex(value) for value in spectrum.values)
    return _counted(values, theta) if method == "constant" else _simulated(values, method, theta)


def _counted(values: tuple[complex, ...], theta: float) -> int | None:
    """Evaluations with a constant factor: the error of a mode is ``-(1 - theta (1 + lambda))^n``."""
    factors, sizes = 1 - theta * (1 + np.array(values)), 1 + np.array(values)

    def arrived(n: int) -> bool:
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            error = -(factors**n)
            residual, image = -sizes * error, 1 - np.array(values) * error
            return bool(np.linalg.norm(residual) < TOLERANCE * np.linalg.norm(image))

    if not np.abs(factors).max() < 1:
        return None
    last = 1
    while not arrived(last):
        last *= 2
        if last > COUNTED:
            return None
    low, high = last // 2, last
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if arrived(middle) else (middle, high)
    return high + 1  # n steps have n + 1 evaluations


@lru_cache(maxsize=256)
def _simulated(values: tuple[complex, ...], method: str, theta: float) -> int | None:
    """Evaluations of a rule of the library on the modes, complex ones as their real and imaginary parts."""
    lambdas, m = np.array(values), len(values)
    real = bool((lambdas.imag == 0).all())
    solution = np.concatenate([np.ones(m), np.zeros(0 if real else m)])

    def image(x: Floats) -> Floats:
        error = x - solution
        if real:
            return np.asarray(solution - lambdas.real * error)
        moved = lambdas * (error[:m] + 1j * error[m:])
        return np.asarray(solution - np.concatenate([moved.real, moved.imag]))

    ending, seen = Ending(TOLERANCE, MOST - 1, patience=math.inf, runaway=FAR), list[Evaluation]()
    states = evaluations(image, RULES[method].on_vectors(theta), np.zeros(len(solution)))
    arrives = follow(states, lambda found: ending.at(found.residual, found.scale), seen) is Outcome.CONVERGED
    return len(seen) if arrives else None


def advised(table: Sequence[MethodRow], *, tied: bool, exchanged: bool | None = None) -> Advised | None:
    """The simplest method that takes hardly more than the fewest steps of the table, or of one assignment of it.

    To exchange the roles is less simple than any method.  IQN-ILS is advised only where the interface is ``tied``: it
    combines iterates of different contact patterns, and of four stiff couplings in contact three did not arrive in 300
    steps.  None where no method arrives.
    """
    own = [row for row in table if exchanged is None or row.exchanged == exchanged]
    arriving = [row for row in own if row.steps is not None and (tied or row.method != "iqn-ils")]
    if not arriving:
        return None
    kept = [row for row in arriving if not row.exchanged]
    near = lambda row, fewest, times: _count(row) <= max(times * fewest, fewest + LITTLE * (times > 1))
    if kept and near(min(kept, key=_count), min(map(_count, arriving)), NEAR):
        arriving = kept
    fewest = min(map(_count, arriving))
    taken = min(
        (row for row in arriving if near(row, fewest, WITHIN[row.method])),
        key=lambda row: (METHODS.index(row.method), _count(row)),
    )
    return Advised(
        name=taken.method,
        neumann_body=taken.neumann_body,
        exchanged=taken.exchanged,
        reason=_reason(taken, [row for row in own if row.exchanged == taken.exchanged], tied),
    )


def _count(row: MethodRow) -> float:
    return math.inf if row.steps is None else row.steps


def _reason(taken: MethodRow, same: Sequence[MethodRow], tied: bool) -> str:
    constant = next(row for row in same if row.method == "constant")
    bound = f"{constant.bound} " if constant.bound else ""
    fewest = min(same, key=_count)
    others = "" if fewest.method == taken.method else f"; {NAMES[fewest.method]} takes {fewest.steps}"
    if others:
        others += ", hardly fewer" if tied or fewest.method != "iqn-ils" else " if contact does not change"
    if taken.method == "constant":
        return f"{bound}{taken.steps} steps{others or ', and no method takes fewer'}"
    known = "may not arrive"
    if constant.steps is not None:
        known = f"takes {bound}{constant.steps}, {constant.steps / _count(taken):.2g} times as many"
    return f"{taken.steps} steps; a constant theta {known}{others}"


#: How many times the fewest steps a method may take to be advised.
WITHIN = {"constant": NEAR, "aitken": NEAR_AITKEN, "iqn-ils": 1.0}

#: The methods in sentences.
NAMES = {"constant": "constant theta", "aitken": "Aitken", "iqn-ils": "IQN-ILS"}
