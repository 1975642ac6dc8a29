"""Advice from one run of any code, by its ratio of residuals."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ndtheory.constants import LARGEST, SMALLEST, take
from ndtheory.number import Numeric
from verification.coupling import general
from verification.coupling.advice import Advice
from verification.coupling.kinds import Kind, kind_of
from verification.coupling.readings import Made, Observed, best_if, read_observed, read_parallel, spread, steps_needed
from verification.coupling.runs import OneRun, decided
from verification.coupling.runs_with_friction import friction_bounds, next_with_friction, readings_with_friction


def advise_run(
    theta: Numeric,
    ratio: Numeric,
    *,
    tied: bool = False,
    friction: bool = False,
    kind: str | Kind | None = None,
    parallel: bool = False,
    earlier: Iterable[tuple[Numeric, Numeric]] = (),
) -> Advice:
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

    With friction these bounds are false: :mod:`verification.coupling.runs_with_friction` has those that are proved.

    Parameters
    ----------
    theta : number
        The run's relaxation factor, 0 < theta <= 1; up to 100 of a coupling of kind general.
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
    kind : {'contact', 'tied', 'general'}, optional
        Of a coupling of kind general lambda may be below 0, and ``mode-low`` is left for any ratio.
    parallel : bool
        True if both solvers ran at once: then r tells rho, by ``r^2 = (1 - theta)^2 + theta^2 rho``.
    earlier : iterable of tuple
        theta and ratio of runs before this one, of a coupling of kind general; of other kinds several runs need logs.

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
        Friction where nothing slips or in parallel coupling, an unknown kind, kind general in parallel coupling, or
        earlier runs of another kind.

    Examples
    --------
    >>> found = advise_run("0.1", "1.4")
    >>> [(reading.kind, reading.lo) for reading in found.readings], found.next.theta
    ([('mode-high', 23.0), ('level', 19.0)], 0.0808)
    >>> advise_run("0.45", "0.8").best.rho.value
    3.0
    >>> advise_run("0.1", "1.4", tied=True).best.rho.value
    23.0
    >>> [reading.lo for reading in advise_run(1, "0.75", kind="general").readings]
    [0.75, -0.75]
    >>> advise_run("1.5", "0.8", kind="general", earlier=[(1, "0.6"), ("0.8", "0.68")]).theta
    1.23
    >>> advise_run("0.5", "0.75", tied=True, parallel=True).best.rho.value
    1.25
    >>> found = advise_run("0.1", "0.9022", friction=True)
    >>> found.roles, round(found.friction_bounds.image, 6), found.next.theta
    ((), 0.022, 0.3146)
    """
    of = kind_of(kind, tied=tied, parallel=parallel)
    of.assumes(friction)  # what goes together
    needed = f"the theta of a run, {of.thetas} (1e-75 or more)"
    least = "the ratio of consecutive residuals, a number > 0 (1e-75 to 1e75)"
    each = [
        (
            take("theta", one, needed, lambda v: SMALLEST <= v <= of.longest),
            take("ratio", other, least, lambda v: SMALLEST <= v <= LARGEST),
        )
        for one, other in (*earlier, (theta, ratio))
    ]
    t, r = each[-1]
    observed, falls = Observed.known(r), r < 1 - spread(t)
    made = [Made(theta=t, falls=r < 1, rises=r >= 1, ratio=r) for t, r in each]
    known: dict[str, Any] = {"kind": of, "rubs": friction, "theta": t, "ratio": r}
    if not of.signed:
        following, spectrum = general.decide(
            general.boxes_of([(t, Observed.known(r), steps_needed(t)) for t, r in each]), made
        )
        readings = () if spectrum and spectrum.theta else general.readings_of(t, observed)
        known |= {"readings": readings, "earlier": tuple(each[:-1])}
        return Advice.of(OneRun(next=following, rho=None, spectrum=spectrum, **known))
    if len(each) > 1:
        raise ValueError(f"kind {of.name} with earlier runs: needed their logs, or kind general")
    readings, following, rho = read_parallel(t, observed, of) if of.parallel else read_observed(t, observed, of)
    bounds = None
    if friction:
        falling, rising = ([(t, observed)], []) if falls else ([], [(t, observed)])
        readings, rho, bounds = readings_with_friction(readings), None, friction_bounds(falling, rising)
        following = next_with_friction(falling, [at for at, _ in rising])
    elif of.linear and rho is None and r > 1 + spread(t):
        rho = (1 + r) / t - 1
        following = best_if(rho, "the pace at which a tied run grows")
    found = decided(made, readings, following, rho, kind=of, friction_bounds=bounds)
    return Advice.of(OneRun(**found, **known))
