"""The best theta of a problem, found in four ways: by runs, by rho, by the Jacobian at the solution, and by each proof.

The four answer different questions.  Runs from g = 0 show which theta took the fewest steps of those that were tried.
``2/(2 + rho)`` needs no run; it is proved to be best without friction, and a prediction with it.  The Jacobian of T at
the solution says which theta has the least spectral radius once no contact node changes its state any more.  A bound
proves a factor of each step for each theta, and has a theta at which that factor is least.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from ndtheory import EnergyBounds
from verification.algorithm.linearisation import NotLinear
from verification.algorithm.monolithic import SolveError
from verification.algorithm.theta import energy_bounds
from verification.constants import Measured, measure
from verification.contact import ContactError
from verification.interface.build import pair_of
from verification.interface.pair import ContactPair
from verification.problem.specification import Problem
from verification.semidefinite import LMIError
from verification.semidefinite.multipliers import QuadraticForms
from verification.sweeps.pieces import KnownPieces
from verification.sweeps.row import Row
from verification.sweeps.sweep import sweep

#: The odds theta/(1 - theta) of the predicted theta are multiplied by these for the runs.  Contact that stays closed
#: and sticks has its best theta at half of them at least, ``1/(1 + rho)``; above, runs soon stall, which takes longest.
ODDS = tuple(2.0 ** (i / 4) for i in range(-5, 4))

#: The least factor that programs prove is looked for up to this factor around the predicted theta, until its square
#: and what this is below 1 are known to this share.
AROUND, CLOSE = 4.0, 1e-3

#: Programs after which it ends anyway; three to seven are usual.
MOST = 12


@dataclass(frozen=True, kw_only=True)
class Fewest:
    """The thetas of fewest steps among those that were run.

    ``low`` and ``high``, the least and the largest of them, took so many ``steps``; ``below`` and ``above`` are the
    next thetas beyond, which took more or did not arrive; None where none was run: fewer steps may lie beyond.
    """

    steps: int
    low: float
    high: float
    below: float | None
    above: float | None

    @property
    def theta(self) -> float:
        """The middle of ``low`` and ``high``."""
        return (self.low + self.high) / 2

    @classmethod
    def of(cls, rows: Sequence[Row], column: str = "iterations") -> Fewest | None:
        """From rows of a sweep that differ only in theta; None where no run arrived.

        ``column`` is 'iterations' or 'iterations_paper', the test that ends the count.

        Examples
        --------
        >>> seen = [(0.2, 9), (0.3, 7), (0.4, 7), (0.5, None)]
        >>> Fewest.of([{"theta": theta, "iterations": steps} for theta, steps in seen])
        Fewest(steps=7, low=0.3, high=0.4, below=0.2, above=0.5)
        """
        counts = sorted((row["theta"], row[column]) for row in rows)
        least = min((steps for _, steps in counts if steps is not None), default=None)
        if least is None:
            return None
        thetas = [None, *(theta for theta, _ in counts), None]
        best = [i for i, (_, steps) in enumerate(counts, 1) if steps == least]
        low, high = best[0], best[-1]
        return cls(steps=least, low=thetas[low], high=thetas[high], below=thetas[low - 1], above=thetas[high + 1])


@dataclass(frozen=True, kw_only=True)
class Least:
    """A theta and the factor of one step that is least there."""

    theta: float
    factor: float


@dataclass(frozen=True, kw_only=True)
class BestTheta:
    """The best theta of a problem in its roles and at its friction.

    ``rho`` is rho_normal without friction, ``predicted`` is ``2/(2 + rho)``.  ``seen`` is None where no run arrived, or
    none was made; ``linearised`` is the theta of least spectral radius of the Jacobian of T_theta at the solution;
    ``energy`` and ``semidefinite`` have the theta of least proved factor below 1, of the theorem in energy norms and of
    the semidefinite bound.  ``reason`` says why one of the four is None.
    """

    rho: float
    predicted: float
    seen: Fewest | None
    linearised: Least | None
    energy: Least | None
    semidefinite: Least | None
    reason: Mapping[str, str] = field(default_factory=dict)


def best_theta(
    problem: Problem | ContactPair | Path | str, *, runs: bool = True, semidefinite: bool = True
) -> BestTheta:
    """The best theta of a problem, found in four ways.

    Parameters
    ----------
    problem : Problem, ContactPair or path
    runs : bool
        True to find the theta of fewest steps, by runs at the predicted theta and at eight around it.
    semidefinite : bool
        True to find the least factor that the semidefinite bound proves: some five programs.

    Raises
    ------
    ValueError
        The theorem in energy norms does not apply.

    Examples
    --------
    >>> from verification.problem.examples import example
    >>> bars = example("two-bars").changed(young=(2, 1))
    >>> found = best_theta(bars)
    >>> round(found.predicted, 12), round(found.energy.theta, 12), round(found.energy.factor, 12)
    (0.5, 0.5, 0.5)

    One bar in contact has one mode, which theta = 1/3 removes in one step; the proof covers open bars, too.

    >>> round(found.linearised.theta, 3), abs(found.seen.theta - 1/3) < 0.03
    (0.333, True)
    """
    pair = pair_of(problem)
    measured = measure(pair)
    energy = energy_bounds(measured)
    if energy is None:
        raise ValueError(f"the theorem in energy norms does not apply: {measured.why_no_energy}")
    rho, predicted = float(energy.rho.value), energy.theta_predicted
    outside = pair.outside[0] if pair.outside else ""
    reason: dict[str, str] = {}

    def found(name: str, why_not: str, work: Callable[[], Any], none: str = "") -> Any:
        """The result of some work; None, with the reason, where it was not asked for or cannot be worked out."""
        value = None
        try:
            value = None if why_not else work()
        except (ContactError, SolveError, LMIError, ValueError) as error:
            why_not = str(error)
        if value is None:
            reason[name] = why_not or none
        return value

    of_program = lambda: _semidefinite(pair, measured, predicted)
    return BestTheta(
        rho=rho,
        predicted=predicted,
        seen=found("seen", "" if runs else "no runs were asked for", lambda: _seen(pair, rho), "no run converged"),
        linearised=found("linearised", "", lambda: _linearised(pair, measured)),
        energy=found("energy", outside, lambda: _energy(energy), "q(theta) is below 1 for no theta"),
        semidefinite=found(
            "semidefinite",
            outside or ("" if semidefinite else "it was not asked for"),
            of_program,
            "no theta is proved to contract",
        ),
        reason=reason,
    )


def _seen(pair: ContactPair, rho: float) -> Fewest | None:
    odds = [share * 2 / rho for share in ODDS]
    return Fewest.of(sweep(pair, theta=[each / (1 + each) for each in odds], rule=["constant"]).rows)


def _energy(energy: EnergyBounds) -> Least | None:
    theta, factor = energy.theta_proved, energy.factor_proved
    return None if theta is None or factor is None else Least(theta=theta, factor=factor.value)


def _linearised(pair: ContactPair, measured: Measured) -> Least:
    """The moduli of the eigenvalues ``1 - theta + theta mu`` are convex functions of theta, and so is their largest."""
    known = KnownPieces(pair, measured)
    solution = known.solution()
    piece = known.piece(solution)
    if not piece.balanced:
        raise NotLinear("contact and friction just hold the contact body: a change of g sets it in motion")
    eigenvalues = np.diagonal(piece.modes[0])
    radius = lambda theta: float(np.abs(1 - theta + theta * eigenvalues).max(initial=0.0))
    found = _least(radius, 1e-6, 1.0)
    if radius(1.0) <= found.factor:
        raise NotLinear("the spectral radius falls up to theta = 1")
    return found


def _semidefinite(pair: ContactPair, measured: Measured, predicted: float) -> Least | None:
    """Each program bounds the square of all factors by a parabola; the next is solved where the highest is least."""
    forms = QuadraticForms(pair, measured)
    low, high = predicted / AROUND, min(1.0, predicted * AROUND)
    theta = predicted
    found: list[Least] = []
    below: list[np.polynomial.Polynomial] = []
    for _ in range(MOST):
        certified, proposal = forms.on(forms.everywhere, theta)
        found.append(Least(theta=theta, factor=certified.value))
        if proposal is None:
            break
        below.append(forms.square_from_below(proposal))
        lowest = _least(lambda theta: max(float(parabola(theta)) for parabola in below), low, high)
        square = min(each.factor for each in found) ** 2
        if square - lowest.factor <= CLOSE * min(square, abs(1 - square)):
            break
        theta = lowest.theta
    best = min(found, key=lambda each: each.factor)
    return best if best.factor < 1 else None


def _least(factor: Callable[[float], float], low: float, high: float) -> Least:
    """The least value of a convex function of theta between two thetas."""
    found = minimize_scalar(
        lambda power: factor(math.exp(power)),
        bounds=(math.log(low), math.log(high)),
        method="bounded",
        options={"xatol": 1e-6},
    )
    return Least(theta=math.exp(found.x), factor=float(found.fun))
