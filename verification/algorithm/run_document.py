"""What the document of a run says: every value, and why one is null."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from verification.algorithm.ending import NO_FORCE

if TYPE_CHECKING:
    from verification.algorithm.runs import Run


def run_document(run: Run) -> dict[str, Any]:
    """The values of ``ndtheory.run/1``; what is null has a reason beside it."""
    rate = run.observed_rate
    solvers = [iterate.contact.solver for iterate in run.iterates]
    linear = run.linearised
    proved = run.proved_rate
    reason: dict[str, str] = {}
    if proved is None:
        reason["proved_rate"] = "momentum without friction has one; for a constant theta see the bounds"
    if linear is None:
        names = ("linearised_rate", "linearised_norm", "linearised_radius", "linearised_margin", "predicted_rate")
        reason |= dict.fromkeys(names, run.why_not_linearised)
    else:
        if linear.predicted is None:
            reason["predicted_rate"] = "the run did not end in a stretch of steps without a change of state"
        if not np.isfinite(linear.margin):
            reason["linearised_margin"] = "no change of g changes a state"
    if run.coupled_residual is None:
        reason["coupled_residual"] = NO_FORCE
    if run.start.why:
        reason["start"] = run.start.why
    few = "fewer than two step ratios stand clear of rounding"
    if rate is None:
        why = "the run diverged: it shows growth, not a rate" if run.outcome == "diverged" else few
        reason |= {"observed_rate": why, "observed_rate_interval": why}
    if run.observed_growth is None:
        reason["observed_growth"] = "the run did not diverge" if run.outcome != "diverged" else few
    if run.forecast is None:
        reason["forecast"] = run.why_no_forecast
    return {
        "title": run.pair.title,
        "theta": float(run.theta),
        "theta_source": run.choice.source,
        "theta_reason": run.choice.why,
        "relaxation": run.relaxation,
        "start": run.start.source,
        "neumann_body": run.pair.neumann_body,
        "grids": {"contact_body": run.pair.contact_body, **run.pair.interface.counts},
        "iterations": run.iterations,
        "evaluations": run.evaluations,
        "outcome": run.outcome,
        "converged": run.converged,
        "proved_rate": None if proved is None else proved.to_dict(),
        "observed_rate": None if rate is None else rate.value,
        "observed_rate_interval": None if rate is None else [rate.lo, rate.hi],
        "observed_growth": run.observed_growth,
        "forecast": None if run.forecast is None else vars(run.forecast),
        "linearised_rate": None if linear is None else linear.rate,
        "linearised_norm": None if linear is None else linear.norm,
        "linearised_radius": None if linear is None else linear.radius,
        "linearised_margin": None if linear is None or not np.isfinite(linear.margin) else linear.margin,
        "predicted_rate": None if linear is None else linear.predicted,
        "unrelaxed_residual": _finite(run.last.relative_residual),
        "coupled_residual": None if run.coupled_residual is None else _finite(run.coupled_residual),
        "kkt_residual": run.last.contact.kkt.residual,
        "solves": {"cvxpy": solvers.count("cvxpy"), "active_set": solvers.count("active-set")},
        **run.contact.to_dict(),
        "checks": run.checks.to_dict(),
        "history": [_finite(r) for r in run.history],
        "outside_theorem": run.outside,
        "warnings": run.warnings,
        "reason": reason,
    }


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
