"""Logs of runs that were not relaxed by a constant factor: what Aitken's factors show of the spectrum.

Aitken's factor after the residuals r and r' of two steps is ``<r, z r>/|z r|^2`` with ``z = 1 + H`` where a step is
linear, H having the eigenvalues lambda.  Where H is selfadjoint in the inner product, its inverse is a mean of
``1 + lambda``, and lies between the ends of the spectrum.  A code mostly has the Euclidean inner product, in which H is
nearly selfadjoint.  Nothing is proved: an end that no residual has in it does not show.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fem1d2d.mesh import Floats
from ndtheory.keys import Part, key
from ndtheory.keys import says as means
from verification.coupling.kinds import Kind
from verification.coupling.log_files import Log
from verification.coupling.readings import NextRun, few, rounded_down, shows_most
from verification.coupling.spectrum import MARGIN, Spectrum

#: A factor counts as long as the residual is above this share of the largest: the solvers' own accuracy is below it.
NOISE = 1e-8

#: The ends are read where the residual has fallen to this share, or so many factors count.  In 90 runs of 30 linear
#: couplings theta was within 1.4 times the fewest steps in all with six factors, and with four in 80; two of these were
#: too large, of runs that had hardly fallen.
FALLEN, ENOUGH = 1e-2, 6

#: 1 over a factor is below 1 by more than this only where contact changes, or the coupling is not linear or symmetric.
BELOW = 0.05


_ENDS = r"the least and the largest eigenvalue $\lambda$ that they show: estimates from inside the spectrum"
_USED = "factors from which the ends are read, above the noise of the solvers, and all of them"
_COUNTS = "time windows in the log, and the median of their iterations"


@dataclass(frozen=True, kw_only=True)
class SeenFactors(Part):
    """Ends of the spectrum by Aitken's factors."""

    used: int = key(_USED, unit="1")
    given: int = key(_USED, unit="1")
    low: float = key(_ENDS, unit="1")
    high: float = key(_ENDS, unit="1")
    fastest_fall: float = key("the last residual over the largest, in the window where that is least", unit="1")
    doubt: str = key("why no theta follows from them; empty where one does")

    @property
    def says(self) -> str:
        """The ends in words."""
        ends = f"factors, {self.used} of {self.given}: lambda from {few(self.low)} to {few(self.high)}"
        return f"{ends} or beyond, estimates{'; ' * bool(self.doubt)}{self.doubt}"


@dataclass(frozen=True, kw_only=True)
class Accelerated(Part):
    """A log of a run with Aitken, quasi-Newton or another rule that is not constant relaxation."""

    file: str = key("as in `logs`")
    form: str = key("as in `logs`")
    accelerator: str = key("the rule, as the log names it")
    windows: int = key(_COUNTS, unit="1")
    iterations: int = key(_COUNTS, unit="1")
    factors: SeenFactors | None = key(
        "what Aitken's factors show of the spectrum",
        null="where the log prints none",
        why="the log prints no Aitken factor for each iteration",
    )
    notes: tuple[str, ...] = key("lines that were left out")

    @property
    def counted(self) -> str:
        """The number of iterations, in words."""
        return f"{self.iterations} iterations" + f", the median of {self.windows} windows" * (self.windows > 1)

    @property
    @means("the same in words")
    def says(self) -> str:
        shown = "its residuals say nothing about rho" if self.factors is None else self.factors.says
        return f"{self.counted}; {shown}"


def seen_accelerated(log: Log) -> Accelerated:
    """A log whose relaxation was not constant, as it was seen."""
    assert log.accelerator is not None
    counts = log.counts or [len(window) for window in log.columns[0].windows]
    aitken = "aitken" in log.accelerator.lower()
    return Accelerated(
        file=str(log.path),
        form=log.form,
        accelerator=log.accelerator,
        windows=len(counts),
        iterations=int(np.median(counts)),
        factors=seen_factors(log) if aitken and log.factors else None,
        notes=log.notes,
    )


def seen_factors(log: Log) -> SeenFactors | None:
    """The ends that the factors of a log show; None where no factor counts."""
    column, inverse, given, fall = log.columns[0], list[Floats](), 0, 1.0
    for residuals, factors in zip(column.windows, log.factors, strict=False):
        given += int(np.isfinite(factors).sum())
        finite = residuals[np.isfinite(residuals) & (residuals > 0)]
        if not finite.size:
            continue
        fall = min(fall, float(finite[-1] / finite.max()))
        least = max(NOISE * float(finite.max()), 100 * column.decimals)
        after = factors[1:]  # the first one is the user's
        counts = np.isfinite(after) & (after != 0) & (np.minimum(residuals[:-1], residuals[1:]) >= least)
        inverse.append(1 / after[counts])
    found, doubt = np.concatenate([*inverse, []]), ""
    if not found.size:
        return None
    if found.min() < 1 - BELOW:
        doubt = "factors above 1 or below 0: contact changes, or the solvers are not accurate enough"
    elif fall > FALLEN and len(found) < ENOUGH:
        doubt = f"needed a residual that falls to {FALLEN:g} of its largest, or {ENOUGH} factors"
    return SeenFactors(
        used=len(found),
        given=given,
        low=max(float(found.min()) - 1, 0.0),
        high=max(float(found.max()) - 1, 0.0),
        fastest_fall=fall,
        doubt=doubt,
    )


def spectrum_of(logs: Iterable[Accelerated], kind: Kind) -> Spectrum | None:
    """The spectrum between the ends that the factors of all logs show, MARGIN added; None where each has a doubt.

    Of parallel coupling, and of kind general, factors show no ends.
    """
    known = [log.factors for log in logs if log.factors is not None and not log.factors.doubt]
    if not known or kind.parallel or not kind.signed:
        return None
    low, high = min(found.low for found in known), max(found.high for found in known)
    return Spectrum.between(low, high + MARGIN * (1 + high))


def after_accelerated(spectrum: Spectrum | None, kind: Kind) -> NextRun:
    """The theta to paste of a tied interface, or the run with constant relaxation that shows more."""
    if spectrum is None:
        why = f"{shows_most(kind)}. Or save some iterates of the run as it is, and type ndtheory advise vectors"
        return NextRun(theta=1.0, why=why)
    theta = rounded_down(min(Fraction(spectrum.theta), kind.most))
    ends = f"2/(2 + least + largest) with lambda from {few(spectrum.low)} to {few(spectrum.high)} by Aitken's factors"
    if kind.linear:
        return NextRun(theta=theta, why=f"{ends}, the largest with {100 * MARGIN:g} % added: an estimate")
    why = f"{ends}, an estimate for one contact pattern; with constant theta its log shows if it holds or diverges"
    return NextRun(theta=theta, why=why)
