"""Advice from one run of any code, by its ratio of residuals."""

from __future__ import annotations

from ndtheory.constants import LARGEST, SMALLEST, take
from ndtheory.energy_norms import predicted_theta
from ndtheory.number import Numeric
from verification.coupling.advice import Advice
from verification.coupling.kinds import kind_of
from verification.coupling.readings import (
    LARGEST_TO_PASTE,
    Made,
    NextRun,
    Observed,
    assumed,
    few,
    read_observed,
    rounded_down,
    spread,
)
from verification.coupling.runs import OneRun, decided
from verification.coupling.runs_with_friction import friction_bounds, next_with_friction, readings_with_friction


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
    assumed(tied, friction)  # one of both at most
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
    made = [Made(theta=t, falls=r < 1, rises=r >= 1, ratio=r)]
    found = decided(made, readings, following, rho, tied=tied, friction_bounds=bounds)
    return Advice.of(OneRun(kind=kind_of(tied=tied), rubs=friction, theta=t, ratio=r, **found))
