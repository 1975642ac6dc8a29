"""Advice from the convergence logs of other runs: readings of each log, and bounds of rho from all of them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from ndtheory import HypothesisError
from ndtheory.constants import SMALLEST, take
from ndtheory.energy_norms import predicted_theta
from ndtheory.number import below
from verification.coupling import ends, general
from verification.coupling.accelerated import after_accelerated, seen_accelerated, spectrum_of
from verification.coupling.advice import Advice
from verification.coupling.ends import DEAR, GROWS, SETTLED, Box
from verification.coupling.kinds import CONTACT, LARGEST_TO_PASTE, Kind, kind_of
from verification.coupling.log_files import Log, read_log
from verification.coupling.pace import CONVERGED, RELATIVE, Pace
from verification.coupling.readings import (
    NARROWEST,
    NextRun,
    Observed,
    RunReading,
    best_if,
    few,
    kept,
    level,
    pasted_or_not,
    read_observed,
    read_parallel,
    read_plateau,
    rounded_down,
    steps_needed,
)
from verification.coupling.runs import LARGE, Logs, decided
from verification.coupling.runs_with_friction import by_kind, friction_bounds, readings_with_friction, with_friction
from verification.coupling.seen import (
    AGREE,
    LogBound,
    RhoInterval,
    SeenColumn,
    SeenLog,
    bounds,
    of_both_fields,
    seen_column,
)
from verification.problem.tables import ProblemError

#: Readings that are left, the run to make next, and rho where the logs decide it.
Decision = tuple[tuple[RunReading, ...], NextRun, Fraction | None]

#: What a log without its factor may be of.
UNNAMED = (
    "of a run with Aitken give the vectors instead, ndtheory advise vectors, or a log with its factors; "
    "a quasi-Newton run of preCICE is recognised by its iterations.log in the same folder"
)

#: A pooled ratio exceeds 1 - theta, the pace of open nodes, by this share of theta.
BEYOND = Fraction(1, 20)

#: The smallest theta that a log may have: for a smaller one a ratio has to be steady over millions of steps.
SMALLEST_THETA = Fraction(1, 10**6)

#: What windows show that are too short one by one.
WINDOWS = "windows show no ratio one by one; their second halves have a ratio of {} together"

#: A window too short to be read does not converge where it has FEW steps, and its last residual is this share of the
#: largest one; a run is kept that converges within SHORT iterations without a ratio.
HIGH, FEW, SHORT = 0.9, 5, 40


def advise_logs(
    logs: Iterable[tuple[Path | str, Any]],
    *,
    tied: bool = False,
    friction: bool = False,
    pattern: str | None = None,
    kind: str | Kind | None = None,
    parallel: bool = False,
    format: str | None = None,
    log10: bool = False,
) -> Advice:
    """Advice from the convergence logs of runs of any code, with a constant theta or with Aitken.

    A log whose residual changes by a steady ratio r a step is read as
    :func:`verification.coupling.from_runs.advise_run` reads r.  A residual that stays at a level belongs to a run that
    does not converge; a *relative* residual ``|T g - g|/|T g|`` that stays at P > 1 to a tied run that diverges with
    ``rho = 1/(P - 1)``.  A residual that is neither steady nor at a level shows nothing.

    Logs whose bounds of rho exclude each other are reported as contradictory.  With friction no theta is pasted;
    :mod:`verification.coupling.runs_with_friction` has the bounds that are proved then.

    The theta to paste is predicted to take at most 1.4 times the fewest steps wherever both ends of the spectrum may
    lie by the logs (:mod:`verification.coupling.ends`); in contact it is not above the theta of a run that converged.

    :mod:`verification.coupling.accelerated` reads logs with Aitken's factors, and :mod:`verification.coupling.general`
    those of kind general; in *parallel* coupling the stiffest mode is the slowest in every log.

    The run to make next has a theta that no log has, unless its reason begins with "keep it" or "the same again".

    Parameters
    ----------
    logs : iterable of tuple
        Logs of one coupling with the same roles: the path and the relaxation factor of each, 0 < theta <= 1 (100 of
        kind general); None if the log names its factor, or if the relaxation was not constant.
    tied : bool
        True if the interface is tied, so that nothing opens or slips.
    friction : bool
        True if there is friction.  Otherwise the advice assumes that there is none, or that the interface is tied.
    pattern : str, optional
        A regular expression for logs of another form: its one group is a residual, or its groups are named
        ``residual``, ``iteration``, ``theta`` and ``omega``, a factor of Aitken.
    kind : {'contact', 'tied', 'general'}, optional
        ``tied`` is short for the second one.
    parallel : bool
        True if both solvers ran at once; the log should have the residuals of both fields.
    format : str, optional
        The name of a known format (:mod:`verification.coupling.log_formats`), where a log is not recognised by itself.
    log10 : bool
        True if residuals are decimal logarithms.

    Returns
    -------
    Advice
        With a role, and a theta to paste, only where the logs decide; else ``next`` is the run to make.

    Raises
    ------
    ProblemError
        A log that cannot be read.
    HypothesisError
        A theta outside its range, or none for a log that names none.
    ValueError
        No log, friction where nothing slips or in parallel coupling, kind general in parallel coupling, no such kind,
        or an invalid pattern or format.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     log = Path(folder) / "residuals.txt"
    ...     _ = log.write_text("".join(f"{0.8**n:.8e}\\n" for n in range(40)), encoding="utf-8")
    ...     found = advise_logs([(log, "0.45")])
    >>> [reading.kind for reading in found.readings], found.theta, float(found.next.theta)  # a second run decides
    (['mode-high'], None, 0.3161)
    """
    of = kind_of(kind, tied=tied, parallel=parallel)
    needed = f"the theta of a log, {of.thetas} (1e-6 or more)"
    allowed = lambda value: max(SMALLEST, SMALLEST_THETA) <= value <= of.longest
    number = lambda theta: None if theta is None else take("theta", theta, needed, allowed)
    given = [(Path(path), number(theta)) for path, theta in logs]
    if not given:
        raise ValueError("needed one log or more")
    of.assumes(friction)  # what goes together
    read = [(read_log(path, pattern, name=format, log10=log10), theta) for path, theta in given]
    read = [(of_both_fields(log) if of.parallel else log, theta) for log, theta in read]
    accelerated = tuple(seen_accelerated(log) for log, _ in read if log.accelerator is not None)
    seen = tuple(seen_log(log, _theta_of(log, theta), of, friction) for log, theta in read if log.accelerator is None)
    spectrum, made = spectrum_of(accelerated, of), [log.made for log in seen]
    interval = interval_of(*(([], []) if friction or not of.signed else bounds(seen, of)))
    known: dict[str, Any] = {"kind": of, "rubs": friction, "accelerated": accelerated, "logs": seen}
    known["interval"] = interval
    if not seen:
        ends_seen, following = spectrum if of.linear else None, after_accelerated(spectrum, of)
        return Advice.of(Logs(readings=(), rho=None, next=following, spectrum=ends_seen, **known))
    if not of.signed:
        steady = [(log.theta, log.slowest, log.length) for log in seen if not log.explodes]
        boxes = general.boxes_of([(at, ratio, steps) for at, ratio, steps in steady if ratio is not None])
        following, ends_seen = general.decide(boxes, made)
        readings = () if ends_seen and ends_seen.theta else next((log.readings for log in seen if log.readings), ())
        found = Logs(readings=readings, rho=None, next=following, spectrum=ends_seen, **known)
    else:
        readings, following, rho = with_friction(seen) if friction else decide(seen, interval, of)
        with_it = friction_bounds(*by_kind(seen)) if friction else None
        found = Logs(**decided(made, readings, following, rho, kind=of, friction_bounds=with_it), **known)
    undecided = found.rho is None and found.spectrum is None and interval.contradiction is None
    if undecided and of.linear and spectrum is not None:
        paste = pasted_or_not(after_accelerated(spectrum, of), made)
        found = found if paste is None else replace(found, spectrum=spectrum, next=paste)
    return Advice.of(found)


def _theta_of(log: Log, theta: Fraction | None) -> Fraction:
    """The theta that was given for a log, or that it names in all its digits."""
    if theta is not None:
        return theta
    if log.needs_theta:
        raise HypothesisError("theta", None, f"the relaxation factor of {log.path}, which does not name it ({UNNAMED})")
    return Fraction(repr(log.theta))


def seen_log(log: Log, theta: Fraction, kind: Kind = CONTACT, friction: bool = False) -> SeenLog:
    """One log as it was seen, with its readings."""
    off = max(log.theta_rounding, 1e-3 * float(theta))
    if log.theta is not None and abs(log.theta - float(theta)) > off * (1 + 1e-9):
        named = f"the log names a relaxation factor of {log.theta:g}: needed the same theta, received {float(theta):g}"
        raise ProblemError(str(log.path), "", None, named)
    columns = tuple(seen_column(column, theta, kind) for column in log.columns)
    bare = SeenLog(
        file=str(log.path),
        form=log.form,
        theta=theta,
        columns=columns,
        readings=(),
        next=longer(columns, theta),
        rho=None,
        notes=log.notes,
    )
    ratio, plateau, rho = bare.slowest, bare.plateau, None
    readings: tuple[RunReading, ...]
    grows = ratio is not None and ratio.least > 1
    if not kind.signed:
        return bare if ratio is None else replace(bare, readings=general.readings_of(theta, ratio))
    if kind.parallel and bare.stays:
        why = f"a quarter of {few(theta)}, which hardly converges, if at all; absolute residuals of that run narrow rho"
        readings, following = (level(theta),), NextRun(theta=rounded_down(theta / 4), why=why)
    elif kind.parallel and ratio is not None:
        readings, following, rho = read_parallel(theta, ratio, kind)
    elif ratio is not None and grows:
        readings, following, _ = read_observed(theta, ratio, kind)
        if plateau is not None and one_mode(theta, ratio, plateau):
            also = [reading for reading in read_plateau(theta, plateau)[0] if reading.kind == "plateau"]
            readings = (*readings[:1], *also, *readings[1:])
        if bare.explodes:
            because = "the least one whose residual grows so fast"
            following = best_if((1 + ratio.least) / theta - 1, because, SMALLEST_THETA)
    elif plateau is not None:
        readings, following = read_plateau(theta, plateau)
        if (other := bare.rho_elsewise) is not None:
            words = f"; if these data are not relaxed, rho is {few(other)}"
            readings = tuple(replace(one, says=one.says + words * (one.kind == "plateau")) for one in readings)
    elif bare.stays:
        readings, following, _ = read_observed(theta, Observed.of(1, 1 - min(NARROWEST, theta / 5), 1), kind)
        if all(column.residual in RELATIVE for column in columns if column.count("level")):
            readings = (level(theta),)  # of a relative residual also a run that grows
    elif ratio is not None:
        readings, following, rho = read_observed(theta, ratio, kind, measured=bare.converges)
        if not bare.converges and all(reading.kind != "level" for reading in readings):
            readings, rho = (*readings, level(theta, bounds=False)), None
    else:
        return bare if bare.pooled is None else replace(bare, next=of_pooled(theta, bare.pooled))
    if friction:
        readings, rho = readings_with_friction(readings), None
    return replace(bare, readings=readings, next=following, rho=rho)


def of_pooled(theta: Fraction, ratio: Observed) -> NextRun:
    """The run to make where the windows of a transient show no ratio one by one."""
    why = WINDOWS.format(ratio)
    if ratio.most <= ends.SWIFT:
        return kept(theta, f"{why}, and none much faster is to be found")
    beyond = ratio.value > 1 - theta + BEYOND * theta  # then only the stiffest mode has this pace
    following = read_observed(theta, Observed.known(ratio.value) if beyond else ratio)[1]
    accelerated = "of an Aitken or IQN-ILS run this says nothing: give its vectors to ndtheory advise vectors"
    return replace(following, why=f"{why}: {following.why}; {accelerated}")


def one_mode(theta: Fraction, ratio: Observed, plateau: Observed) -> bool:
    """True if the growth and the plateau of a run belong to one mode, as in a tied run."""
    low, high = 1 / (plateau.most - 1), 1 / (plateau.least - 1)
    return (1 + ratio.least) / theta <= AGREE * (1 + high) and 1 + low <= AGREE * (1 + ratio.most) / theta


def longer(columns: tuple[SeenColumn, ...], theta: Fraction) -> NextRun:
    """The run to make where a log shows nothing steady."""
    paces = [one for column in columns for one in column.paces]
    if any(one.adapts for one in paces):
        why = "the same again, constant: this residual rises and falls as with Aitken or quasi-Newton"
        vectors = "of such a run give the vectors to ndtheory advise vectors"
        return NextRun(theta=float(theta), why=f"{why}; {vectors}", again=True)
    if all(one.height < CONVERGED for one in paces):
        why = f"{_within(paces)}, and shows no ratio"
        if all(one.length <= SHORT for one in paces):
            return kept(theta, why)
        return NextRun(theta=rounded_down((1 + theta) / 2), why=f"larger than {few(theta)}: there {why}")
    if any(one.lost for one in paces):
        why = "a quarter of it, as the residual runs away before a ratio shows"
        return NextRun(theta=rounded_down(theta / 4), why=why)
    if all(one.kind == "short" and one.height > HIGH and one.steps >= FEW for one in paces):
        why = "half of it, as the residual is about as large at the end of each window as ever"
        return NextRun(theta=rounded_down(theta / 2), why=why)
    if any(one.kind == "floor" for one in paces):
        reached = f"the residual stays at {max(one.height for one in paces):.0e} of its largest value"
        why = f"the same again, with solvers that converge further: {reached} before a ratio shows, which may be noise"
        return NextRun(theta=float(theta), why=why, again=True)
    steps = f"{steps_needed(theta)} steps or more in one time window"
    again = f"the same again, constant and without Aitken or quasi-Newton, {steps}"
    if all(one.kind == "short" for one in paces):
        why = f"{again}: smaller limits of convergence and a larger number of iterations"
    else:
        why = f"{again}, until the residual falls or grows steadily; a relative one must fall below 0.1 first"
    return NextRun(theta=float(theta), why=why, again=True)


def _within(paces: Sequence[Pace]) -> str:
    most = max(one.length for one in paces)
    return f"the run converges within {most} iteration{'s' * (most > 1)}"


def interval_of(lower: list[LogBound], upper: list[LogBound]) -> RhoInterval:
    """The largest bound from below beside the smallest estimate from above that it leaves."""
    lo = max(lower, key=lambda bound: bound.value, default=None)
    hi = min(upper, key=lambda bound: bound.value, default=None)
    contradiction = None
    if lo is not None and hi is not None and 1 + lo.value > AGREE * (1 + hi.value):
        one, other = (f"{bound.log.file} with theta = {few(bound.log.theta)}" for bound in (hi, lo))
        contradiction = (
            f"by {one} rho is at most {few(hi.value)}, by {other} at least {few(lo.value)}: the first is too short to "
            "show the stiffest mode, there is friction, contact changes between the runs, a theta was not constant, "
            "the coupling is not symmetric (as with convection), or they are not runs of one problem in the same roles"
        )
    elif lo is not None:
        hi = min((one for one in upper if one.value >= lo.value), key=lambda bound: bound.value, default=None)
    return RhoInterval(lo=lo, hi=hi, contradiction=contradiction)


def decide(logs: tuple[SeenLog, ...], interval: RhoInterval, kind: Kind) -> Decision:
    """The readings that are left, the run to make next, and rho where the logs decide."""
    falling = [log for log in logs if log.converges]
    rising = [log for log in logs if log.diverges]
    if falling:
        base = max(falling, key=lambda log: log.theta)
    elif rising:
        base = min(rising, key=lambda log: log.theta)
    else:
        base = next((log for log in logs if log.readings), max(logs, key=lambda log: log.length))
    if interval.contradiction is not None:
        why = "the logs contradict each other"
        return contrary(logs, base, kind, why, ", in one time window, with ResAbs in the log")
    lo = interval.lo
    if (swift := next((log for log in logs if log.swift), None)) is not None and base.rho is None:
        why = f"{_within(swift.paces)}: there are few steps to gain"
        return swift.readings, kept(swift.theta, why), None
    if kind.parallel:
        return base.readings, base.next, base.rho
    if (by_all := by_ends(logs, base, None if lo is None else lo.value, kind)) is not None:
        return by_all
    if not falling and len(rising) > 1:
        if lo is not None and predicted_theta(lo.value) < base.theta / 4:
            return base.readings, best_if(lo.value, "the least one by these logs, of which none converges"), None
        why = "a quarter of the smallest theta so far, as none converges; the log of that run narrows rho"
        return base.readings, NextRun(theta=rounded_down(base.theta / 4), why=why), None
    return base.readings, base.next, base.rho


def boxes_of(log: SeenLog, kind: Kind) -> list[Box]:
    """Limits of the ends of the spectrum by a log; in contact of the modes that are left near the solution."""
    ratio, plateau, theta, tied = log.slowest, log.plateau, float(log.theta), kind.linear
    left: list[Sequence[Box]] = []
    if ratio is not None and log.converges:
        left.append(ends.of_ratio(theta, float(ratio.least), float(ratio.most)))
    if tied and log.diverges:
        left.append(ends.of_stiffest(2 * (1 - SETTLED) / theta))
    if tied and ratio is not None and ratio.least > 1:
        least, most = (1 + float(ratio.least)) / theta, (1 + float(ratio.most)) / theta
        settled = most <= GROWS * least and not log.explodes
        left.append(ends.of_stiffest(least, most * (1 + SETTLED) if settled else math.inf))
    if tied and plateau is not None:
        low, high = float(1 / (plateau.most - 1)), float(1 / (plateau.least - 1))
        left.append(ends.of_stiffest(1 + low * (1 - SETTLED), 1 + high * (1 + SETTLED)))
    return ends.common(left)


def by_ends(logs: tuple[SeenLog, ...], base: SeenLog, lo: Fraction | None, kind: Kind) -> Decision | None:
    """The same by the limits that all logs give the ends of the spectrum; None where these do not limit rho."""
    boxes, tied = ends.common([boxes_of(log, kind) for log in logs]), kind.linear
    known, most = [float(log.theta) for log in logs], float(LARGEST_TO_PASTE)
    if not boxes:
        if not tied:
            return None
        why = "no linear coupling with real eigenvalues has all of these logs: a coupling with convection, one that is "
        why += "not linear, or leave out tied"
        return contrary(logs, base, kind, why)
    stiffest, rising = max(box.b[1] for box in boxes), [float(log.theta) for log in logs if log.diverges]
    if math.isinf(stiffest):
        return None
    grown = "; runs that grow bound rho from below, and its upper end is an estimate" * (tied and bool(rising))
    theta, dear = ends.cheapest(boxes, most if tied else float(base.theta))
    if dear <= DEAR:
        says = f"the logs together leave one reading: {ends_in_words(boxes)}; rho is taken at its upper end"
        only = RunReading(kind="mode-high", value=stiffest - 1, lo=None if lo is None else below(lo), says=says)
        following = NextRun(theta=rounded_down(theta), why=cost_in_words(boxes, dear, kind) + grown)
        return (only,), following, Fraction(stiffest) - 1
    theta = rounded_down(ends.telling(boxes, known, most if tied else min([most, *rising])))
    unsure = f"no theta is sure to be within {DEAR:g} times the fewest steps{grown}"
    unsure += "; any constant theta is slow with so large a rho: take IQN-ILS" * (lo is not None and lo > LARGE)
    run = f"a run of {steps_needed(Fraction(theta))} steps or more with this theta narrows rho"
    why = f"{run}. So far {ends_in_words(boxes)}, and {unsure}"
    return base.readings, NextRun(theta=theta, why=why), None


def ends_in_words(boxes: Sequence[Box]) -> str:
    """The limits of the smallest and the largest eigenvalue, in words."""
    within = []
    for which, limits in (("smallest", [box.a for box in boxes]), ("largest", [box.b for box in boxes])):
        low, high = (f"{max(z - 1, 0):.3g}" for z in (min(z for z, _ in limits), max(z for _, z in limits)))
        between = f"{low} or more" if high == "inf" else low if low == high else f"{low} to {high}"
        within.append(f"the {which} eigenvalue is {between}")
    return " and ".join(within)


def cost_in_words(boxes: Sequence[Box], dear: float, kind: Kind) -> str:
    """The reason for a theta, in words."""
    times = "" if dear < 1.05 else f"at most {math.ceil(10 * dear - 1e-9) / 10:g} times "
    same = kind.given(" where contact does not change")
    where = f"of the modes that the logs show{same}, with {ends.FEWEST_MODES} modes and {ends.FEWEST:g} steps or more"
    return f"{times}the fewest steps if {ends_in_words(boxes)}, {where}"


def contrary(logs: Sequence[SeenLog], base: SeenLog, kind: Kind, why: str, how: str = "") -> Decision:
    """The run that falls fastest, to be kept, or half of the smallest theta, where logs do not go together."""
    falls = [(log.slowest.most, log.theta) for log in logs if log.converges and log.slowest is not None]
    if falls and kind.linear:
        return base.readings, kept(min(falls)[1], f"it falls fastest; {why}"), None
    half = rounded_down(min(log.theta for log in logs) / 2)
    return base.readings, NextRun(theta=half, why=f"half of the smallest theta{how}: {why}"), None
