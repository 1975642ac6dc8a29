"""Advice from one run of any code: what its ratio of residuals says of rho."""

from __future__ import annotations

from fractions import Fraction

from ndtheory import Number
from ndtheory.constants import take
from ndtheory.energy import LARGEST, SMALLEST
from ndtheory.energy_norms import predicted_rate, predicted_theta
from ndtheory.number import Numeric
from verification.advice.next_run import Made, anew, pasted_or_not
from verification.advice.readings import (
    LARGEST_TO_PASTE,
    OF_OPEN_NODES,
    NextRun,
    Observed,
    assumed,
    check_assumed,
    read_ratio,
    rounded_down,
    spread,
)
from verification.advice.role import Role
from verification.advice.roles import Advice
from verification.advice.runs_with_friction import friction_bounds, next_with_friction, readings_with_friction
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
    elif tied:
        readings = tuple(reading for reading in readings if reading.kind not in OF_OPEN_NODES)
        if rho is None and r > 1 + spread(t):
            rho = (1 + r) / t - 1
            best = rounded_down(min(predicted_theta(rho), LARGEST_TO_PASTE))
            why = f"2/(2 + rho) with rho = {float(rho):.4g}, the pace at which a tied run grows"
            following = NextRun(theta=best, why=why)
    made = [Made(theta=t, falls=r < 1, rises=r >= 1, ratio=r)]
    if rho is not None and (paste := pasted_or_not(following, made)) is not None:
        following = paste
    else:
        following, rho = anew(following, made), None
    return Advice(
        neumann_body=None,
        roles=() if rho is None else (role_of_run(rho),),
        units=UNITS,
        run=run,
        readings=readings,
        next=following,
        tied=tied,
        assumes=assumed(tied, friction),
        friction_bounds=bounds,
    )


def role_of_run(rho: Fraction) -> Role:
    """What is predicted of the roles that a run had, of which rho was read from its residuals."""
    nothing = "an observed ratio proves nothing"
    return Role(
        neumann_body=None,
        rho=Number.of_float(rho),
        theta_proved=None,
        factor_proved=None,
        theta_max_proved=None,
        theta_predicted=float(predicted_theta(rho)),
        rate_predicted=float(predicted_rate(rho)),
        friction_threshold=None,
        reason={
            "neumann_body": "whichever body had the Neumann problem in that run",
            **dict.fromkeys(("theta_proved", "factor_proved", "theta_max_proved", "friction_threshold"), nothing),
        },
    )
