"""The change to try after a run that did not converge."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ndtheory.number import directed
from verification.algorithm.arrival import MOST
from verification.algorithm.iterate import Iterate
from verification.algorithm.loop import Outcome
from verification.algorithm.rates import CLEAR_OF_NOISE, ObservedRate, noise
from verification.algorithm.relaxation import Rule
from verification.constants import measure
from verification.interface.pair import ContactPair

#: A run is advised to go on up to so many iterations; where its rate needs more, another theta is advised.
LONGEST = 20_000


@dataclass(frozen=True, kw_only=True)
class Remedy:
    """A change of the problem that may let a run converge, with its reason.

    ``why`` has the outcome, and what caused it; ``key`` of the problem file gets the new ``value``.  ``advice`` is in
    words; where it is empty, a theta is advised, by a ``formula``, which may be empty.  ``exchanged`` is a theta for
    exchanged roles where that is larger, None where that is not advised.  The advice is about constant relaxation if
    ``constant``: the rule of the run takes no theta.
    """

    why: str
    value: str
    key: str = "iteration.theta"
    advice: str = ""
    formula: str = ""
    exchanged: str | None = None
    constant: bool = False

    @property
    def options(self) -> tuple[str, ...]:
        """The options that make the change in a command."""
        if self.key != "iteration.theta":
            return "--set", f"{self.key}={self.value}"
        return (*(("--relaxation", "constant") if self.constant else ()), "--theta", self.value)

    def sentence(self, theta: str = "theta =", roles: str = "exchanged roles") -> str:
        """Return the advice in one sentence; these words introduce a theta and name the exchange of roles."""
        rule = "constant relaxation with " if self.constant else ""
        advice = self.advice or f"try {rule}{theta} {self.value}{self.formula}"
        if self.exchanged is not None:
            advice += f", or {roles} with {theta} {self.exchanged}"
        return f"{self.why}; {advice}"


def remedy_of(
    pair: ContactPair,
    rule: Rule,
    theta: float,
    *,
    outcome: Outcome,
    last: Iterate,
    rate: ObservedRate | None,
    coupled: float | None,
) -> Remedy:
    """Return the change to try after a run that did not converge, from its end.

    ``pair``, ``rule`` and ``theta`` are the run's, the others its outcome, last iterate, observed rate and
    coupled residual.
    """
    tolerance, most, reached = pair.settings.tolerance, pair.settings.max_iterations, last.relative_residual
    constant = not rule.takes_theta
    if outcome == "limit" and (coupled is None or coupled <= MOST):
        why = "not converged: max_iterations was reached while the residual still fell"
        advice = "raise it, or change theta"
        left = math.log(tolerance / reached) / math.log(rate.hi) if rate is not None and rate.hi < 1 else math.inf
        if most + left <= LONGEST:
            longer = str(2 * (most + math.ceil(left)))  # the rate may still rise
            return Remedy(why=why, key="iteration.max_iterations", value=longer, advice=advice)
        return Remedy(why=why, value=_typed(_worth_trying(_rho(pair))), advice=advice, constant=constant)
    if last.residual <= CLEAR_OF_NOISE * noise(pair, last):
        why, advice = (
            f"{outcome}: the residual fell to rounding, {reached:.1e}",
            "the tolerance must be larger than that",
        )
        return Remedy(why=why, key="iteration.tolerance", value=f"{10 * reached:.0e}", advice=advice)
    rho = _rho(pair)
    good = _worth_trying(rho)
    if theta < 1e-9:
        why = f"{outcome}: a step of theta = {theta:g} is lost in rounding"
        return Remedy(why=why, value=_typed(good), advice="try a larger theta", constant=constant)
    why = f"{outcome}: theta = {theta:g} does not contract here"
    if outcome == "limit":
        why = "not converged: max_iterations was reached far from a state of contact"
    try:
        other = _worth_trying(_rho(pair.swapped()))
    except ValueError:  # these roles are refused; problem errors are such
        other = 0.0
    exchanged = _typed(other) if other > good else None
    if theta <= good and (outcome != "limit" or theta > good / 2):
        return Remedy(why=why, value=_typed(theta / 2), exchanged=exchanged, constant=constant)
    formula = f" (2/(2 + rho), rho = {rho:.4g})"
    return Remedy(why=why, value=_typed(good), formula=formula, exchanged=exchanged, constant=constant)


def _rho(pair: ContactPair) -> float:
    if pair.neumann.rigid:
        return 0.0  # as it does not move
    rho = measure(pair).rho_max
    assert rho is not None  # a pair has interface matrices
    return rho.value


def _worth_trying(rho: float) -> float:
    """Return 2/(2 + rho), and below 1 when it is written with a few figures."""
    return min(2 / (2 + rho), 0.99)


def _typed(theta: float) -> str:
    return f"{directed(theta, 3, up=False):g}"
