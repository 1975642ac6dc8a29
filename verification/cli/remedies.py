"""Advice after a run that did not converge."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from verification.algorithm.runs import Run
    from verification.interface.pair import ContactPair


def remedy(finished: Run, swapped: bool) -> str:
    """Advice after a run that did not converge, in one sentence.

    Parameters
    ----------
    finished : Run
    swapped : bool
        Whether its roles are those of --swap-roles.
    """
    from verification.algorithm.ending import MOST
    from verification.algorithm.rates import noise
    from verification.constants import measure

    pair, theta, last = finished.pair, float(finished.theta), finished.last
    apart = finished.coupled_residual is not None and finished.coupled_residual > MOST
    if finished.outcome == "limit" and not apart:
        return "not converged: max_iterations was reached while the residual still fell; raise it, or change theta"
    if last.residual <= 100 * noise(pair, last):
        reached = f"{last.relative_residual:.1e}"
        return f"{finished.outcome}: the residual fell to rounding, {reached}; the tolerance must be larger than that"
    if theta < 1e-9:
        return f"{finished.outcome}: a step of theta = {theta:g} is lost in rounding; try a larger theta"
    rho = measure(pair)
    here = f"{finished.outcome}: theta = {theta:g} does not contract here"
    if finished.outcome == "limit":
        here = "not converged: max_iterations was reached far from a state of contact"
    roles = "without --swap-roles" if swapped else "--swap-roles"
    exchanged = _exchanged(pair)
    if rho.rho_max is None:
        return f"{here}; try a smaller theta" + (f", or {roles}" if exchanged else "")
    beside = None if exchanged is None else measure(exchanged).rho_max
    good, other = _worth_trying(rho.rho_max.value), 0.0 if beside is None else _worth_trying(beside.value)
    better = f", or {roles} with --theta {other:.2g}" if other > good else ""
    if theta <= good:
        return f"{here}; try --theta {theta / 2:.2g}{better}"
    return f"{here}; try --theta {good:.2g} (2/(2 + rho), rho = {rho.rho_max.value:.3g}){better}"


def _exchanged(pair: ContactPair) -> ContactPair | None:
    """The pair with its roles exchanged; None where these roles are refused."""
    try:
        return pair.swapped()
    except ValueError:  # problem errors are such
        return None


def _worth_trying(rho: float) -> float:
    """2/(2 + rho), and below 1 when it is written with two figures."""
    return min(2 / (2 + rho), 0.99)
