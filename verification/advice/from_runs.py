"""Advice from one run of any code: what its ratio of residuals says of rho."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from ndtheory import Number
from ndtheory.constants import LARGEST, SMALLEST, take
from ndtheory.energy_norms import predicted_theta
from ndtheory.number import Numeric
from verification.advice.next_run import Made, anew, pasted_or_not
from verification.advice.readings import (
    LARGEST_TO_PASTE,
    OF_OPEN_NODES,
    NextRun,
    Observed,
    RunReading,
    assumed,
    check_assumed,
    read_ratio,
    rounded_down,
    spread,
)
from verification.advice.role import role_of
from verification.advice.roles import Advice
from verification.advice.runs_with_friction import (
    FrictionBounds,
    friction_bounds,
    next_with_friction,
    readings_with_friction,
)
from verification.interface.pair import UNITS


def advise_run(theta: Numeric, ratio: Numeric, *, tied: bool = False, friction: bool = False) -> Advice:
    """Advice from one run of any code with constant theta: what it says of rho, and the run to make next.

    While contact does not change, a mode is multiplied by ``1 - theta (1 + lambda)`` in a step, with lambda at most
    rho, and an open node by ``1 - theta``.  A residual has no sign, so that a ratio r of residuals can mean

    * ``mode-high``: ``lambda = (1 + r)/theta - 1``.  Without friction or tied, rho is at least that wherever
      ``r > 1 - theta``, since no step is longer than ``max(1 - theta, |1 - theta - theta rho|)``;
    * ``mode-low``: ``lambda = (1 - r)/theta - 1``, where ``r <= 1 - theta``;
    * ``open``: nothing of rho, where r is about ``1 - theta``;
    * ``level``: contact opens and closes in turn, where r is about 1 or the growth does not last.  Without friction
      theta does not contract, so that rho is at least ``2/theta - 1``.

    With friction these bounds are false: a coupling with rho = 0.97 had a ratio of 0.9022 at theta = 0.1, where the
    first one is 18.  What is proved then is in :mod:`verification.advice.runs_with_friction`.

    Parameters
    ----------
    theta : number
        The run's relaxation factor, 0 < theta <= 1.
    ratio : number
        r > 0, that of the absolute unrelaxed residual ``|T g - g|`` from one step to the next, steady over the last ten
        steps or more, and over ``5/theta`` where these are more; above 1 where the run diverged, and 1 where the
        residual rises and falls and has no steady ratio.
    tied : bool
        Whether nothing opens or slips.  A step is linear then: ``open`` and ``level`` are no readings, and a run that
        grows goes on at the pace of the stiffest mode, which tells rho.
    friction : bool
        Whether there is friction: then no theta is pasted.  Without it the advice assumes that there is none, or that
        the interface is tied.

    Returns
    -------
    Advice
        Without roles while several readings are left.

    Raises
    ------
    HypothesisError
        theta or the ratio is no number of its range.
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
    check_assumed(tied, friction)
    t = take("theta", theta, "the theta of a run, 0 < theta <= 1 (1e-75 or more)", lambda v: SMALLEST <= v <= 1)
    needed = "the ratio of consecutive residuals, a number > 0 (1e-75 to 1e75)"
    r = take("ratio", ratio, needed, lambda v: SMALLEST <= v <= LARGEST)
    run, readings, following, rho = read_ratio(t, r)
    observed, falls = Observed.known(r), r < 1 - spread(t)
    bounds = None
    if friction:
        falling, rising = ([(t, observed)], []) if falls else ([], [(t, observed)])
        readings, rho, bounds = readings_with_friction(readings), None, friction_bounds(falling, rising)
        following = next_with_friction(falling, [at for at, _ in rising])
    elif tied and rho is None and r > 1 + spread(t):
        rho = (1 + r) / t - 1
        best = rounded_down(min(predicted_theta(rho), LARGEST_TO_PASTE))
        why = f"2/(2 + rho) with rho = {float(rho):.4g}, the pace at which a tied run grows"
        following = NextRun(theta=best, why=why)
    made = [Made(theta=t, falls=r < 1, rises=r >= 1, ratio=r)]
    return advice_of_runs(made, readings, following, rho, tied=tied, bounds=bounds, run=run)


def advice_of_runs(
    made: Sequence[Made],
    readings: Sequence[RunReading],
    following: NextRun,
    rho: Fraction | None,
    *,
    tied: bool,
    bounds: FrictionBounds | None,
    **seen: Any,
) -> Advice:
    """The advice from what runs show: a theta to paste where they decide rho, else a run that was not made yet.

    Parameters
    ----------
    made : sequence of Made
    readings : sequence of RunReading
        What they can mean; of these a tied interface has none that needs nodes that open.
    following : NextRun
        The theta to paste, or the run that is proposed.
    rho : Fraction or None
        None while several readings are left.
    tied : bool
    bounds : FrictionBounds or None
        What is proved with friction; None without friction.
    **seen
        Attributes of the advice: what was given.
    """
    if rho is not None and (paste := pasted_or_not(following, made)) is not None:
        following = paste
    else:
        following, rho = anew(following, made), None
    roles = []
    if rho is not None:
        nothing = "an observed ratio proves nothing"
        who = {"neumann_body": "whichever body had the Neumann problem in that run"}
        roles.append(role_of(None, Number.of_float(rho), ratio=rho, nothing=nothing, reason=who))
    return Advice(
        neumann_body=None,
        roles=tuple(roles),
        units=UNITS,
        readings=tuple(one for one in readings if not (tied and one.kind in OF_OPEN_NODES)),
        next=following,
        tied=tied,
        assumes=assumed(tied, bounds is not None),
        friction_bounds=bounds,
        **seen,
    )
