"""Advice from one run of any code, by its ratio of residuals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

from ndtheory.constants import LARGEST, SMALLEST, take
from ndtheory.energy_norms import predicted_theta
from ndtheory.number import Numeric
from verification.coupling import methods
from verification.coupling.readings import (
    AT_ONE,
    LARGEST_TO_PASTE,
    LIKE_ONE,
    OF_OPEN_NODES,
    Made,
    NextRun,
    Observed,
    RunReading,
    SeenRun,
    anew,
    assumed,
    few,
    pasted_or_not,
    read_observed,
    rounded_down,
    spread,
)
from verification.coupling.roles import Advice, role_of, table_of
from verification.coupling.runs_with_friction import friction_bounds, next_with_friction, readings_with_friction
from verification.interface.pair import UNITS

#: Reason for a missing theta for a tied interface.
ONE_END = "residuals show one end of the spectrum"


def advise_run(theta: Numeric, ratio: Numeric, *, tied: bool = False, friction: bool = False) -> Advice:
    """Advice from one run of any code with constant theta: bounds of rho, and the run to make next.

    While contact does not change, a mode is multiplied by ``1 - theta (1 + lambda)`` in a step, with lambda, the
    stiffness ratio of this mode, at most rho, and an open node by ``1 - theta``. A residual has no sign, so that a
    ratio r of residuals can mean

    * ``mode-high``: ``lambda = (1 + r)/theta - 1``.  Without friction or tied, rho is at least that wherever
      ``r > 1 - theta``, since no step is longer than ``max(1 - theta, |1 - theta - theta rho|)``;
    * ``mode-low``: ``lambda = (1 - r)/theta - 1``, where ``r <= 1 - theta``;
    * ``open``: no bound of rho, where r is about ``1 - theta``;
    * ``level``: contact opens and closes alternately, where r is about 1 or the growth does not last.  Without friction
      theta does not contract, so that rho is at least ``2/theta - 1``.

    With friction these bounds are false: a coupling with rho = 0.97 had a ratio of 0.9022 at theta = 0.1, where the
    first one is 18.  :mod:`verification.coupling.runs_with_friction` has the bounds that are proved then.

    Parameters
    ----------
    theta : number
        The run's relaxation factor, 0 < theta <= 1.
    ratio : number
        r > 0: ratio of the absolute unrelaxed residual ``|T g - g|`` from one step to the next, steady over the last
        ten steps or more, and over ``5/theta`` where these are more; above 1 where the run diverged, and 1 where the
        residual rises and falls and has no steady ratio.
    tied : bool
        True if nothing opens or slips.  A step is linear then: ``open`` and ``level`` are excluded, and a run that
        grows goes on at the pace of the stiffest mode, which determines rho.
    friction : bool
        True if there is friction: then no theta is pasted.  Otherwise the advice assumes that there is none, or that
        the interface is tied.

    Returns
    -------
    Advice
        Without roles while several readings are left: ``best`` then raises ValueError, and ``next.theta`` is the theta
        of the run to make.

    Raises
    ------
    HypothesisError
        theta or the ratio is not a number in its range.
    ValueError
        Friction of a tied interface.

    Examples
    --------
    >>> found = advise_run("0.1", "1.4")
    >>> [(reading.kind, reading.lo) for reading in found.readings], found.next.theta
    ([('mode-high', 23.0), ('level', 19.0)], 0.0808)
    >>> advise_run("0.45", "0.8").best.rho.value
    3.0
    >>> advise_run("0.1", "1.4", tied=True).best.rho.value
    23.0
    >>> found = advise_run("0.1", "0.9022", friction=True)
    >>> found.roles, round(found.friction_bounds.image, 6), found.next.theta
    ((), 0.022, 0.3146)
    """
    assumes = assumed(tied, friction)
    t = take("theta", theta, "the theta of a run, 0 < theta <= 1 (1e-75 or more)", lambda v: SMALLEST <= v <= 1)
    needed = "the ratio of consecutive residuals, a number > 0 (1e-75 to 1e75)"
    r = take("ratio", ratio, needed, lambda v: SMALLEST <= v <= LARGEST)
    observed, falls = Observed.known(r), r < 1 - spread(t)
    readings, following, rho = read_observed(t, observed)
    bounds = None
    if friction:
        falling, rising = ([(t, observed)], []) if falls else ([], [(t, observed)])
        readings, rho, bounds = readings_with_friction(readings), None, friction_bounds(falling, rising)
        following = next_with_friction(falling, [at for at, _ in rising])
    elif tied and rho is None and r > 1 + spread(t):
        rho = (1 + r) / t - 1
        why = f"2/(2 + rho) with rho = {few(rho)}, the pace at which a tied run grows"
        following = NextRun(theta=rounded_down(min(predicted_theta(rho), LARGEST_TO_PASTE)), why=why)
    made, run = [Made(theta=t, falls=r < 1, rises=r >= 1, ratio=r)], SeenRun(theta=t, ratio=r)
    known = {"assumes": assumes, "friction_bounds": bounds, "run": run}
    return advice_of_runs(made, readings, following, rho, tied=tied, **known)


def advice_of_runs(
    made: Sequence[Made],
    readings: Sequence[RunReading],
    following: NextRun,
    rho: Fraction | None,
    *,
    tied: bool,
    **known: Any,
) -> Advice:
    """The advice from runs: a theta to paste where they decide rho, else a run that was not made yet.

    ``following`` is the theta to paste, or the run that is proposed; ``rho`` is None while several readings are left;
    readings that need nodes that open are left out where the interface is tied; ``known`` are other attributes of the
    advice.
    """
    if rho is not None and (paste := pasted_or_not(following, made)) is not None:
        following = paste
    else:
        following, rho = anew(following, made), None
        learns = not following.kept and known.get("friction_bounds") is None
        if learns and not any(one.rises or one.theta >= LIKE_ONE for one in made):
            following = replace(following, why=f"{following.why}. {AT_ONE}")
    roles = []
    if rho is not None:
        reason = {"neumann_body": "whichever body had the Neumann problem in that run", "rho_min": ONE_END}
        roles.append(role_of(None, rho, nothing="an observed ratio proves nothing", reason=reason))
    table = table_of(roles, tied=tied, one_end=True, theta=following.theta)
    return Advice(
        neumann_body=None,
        methods=table,
        method=methods.advised(table, tied=tied),
        roles=tuple(roles),
        units=UNITS,
        readings=tuple(one for one in readings if not (tied and one.kind in OF_OPEN_NODES)),
        next=following,
        tied=tied,
        **known,
    )
