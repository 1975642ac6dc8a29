"""Eigenvalues of a coupling: all of them, their ends, or estimates.

While contact does not change, ``T x - T y = -H (x - y)`` with ``H`` similar to ``S_n^-1 S_c``.  Its eigenvalues lambda
are real and at least 0 where both are symmetric stiffnesses; open nodes have lambda = 0.  A mode is multiplied by
``1 - theta (1 + lambda)`` in a step with constant theta.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from verification.value import Value

#: Number of modes that stand for a spectrum of which only the ends are known.
BETWEEN = 20

#: Steps are those until ``|T x - x| < 1e-6 |T x|``, as coupling libraries stop, from x = 0.
TOLERANCE = 1e-6

#: The accuracy of a theta as a share of its upper limit, which may be small.
EXACT = {"xatol": 1e-9}

#: The least error of an end that has not settled, as a share of 1 + lambda.
MARGIN = 0.03

#: An eigenvalue is complex if its imaginary part exceeds this share of the largest 1 + lambda.
REAL = 0.02

Complex = NDArray[np.complex128]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Spectrum(Value):
    """The eigenvalues lambda of a coupling by increasing real part, or those that stand for them in predictions.

    They are all eigenvalues, lie between two known ends, or are Ritz values of vectors; errors of both ends are
    estimated, and 0 where these are known.
    """

    values: Complex
    source: Literal["eigenvalues", "ends", "vectors"]
    error_low: float = 0.0
    error_high: float = 0.0

    @classmethod
    def of(cls, values: Any) -> Spectrum:
        """All eigenvalues, in any order."""
        found = np.asarray(values, dtype=complex)
        return cls(values=found[np.argsort(found.real)], source="eigenvalues")

    @classmethod
    def between(cls, low: float, high: float) -> Spectrum:
        """Modes between two ends, ``low <= high``: the extrema of a Chebyshev polynomial, dense at both ends."""
        x = np.cos(np.pi * np.arange(BETWEEN) / (BETWEEN - 1))[::-1]
        return cls(values=(low + (high - low) * (1 + x) / 2).astype(complex), source="ends")

    @property
    def low(self) -> float:
        """The least real part."""
        return float(self.values[0].real)

    @property
    def high(self) -> float:
        """The largest real part: rho, where the spectrum is real."""
        return float(self.values[-1].real)

    @property
    def real(self) -> bool:
        """True if no imaginary part counts."""
        return bool(np.abs(self.values.imag).max() <= REAL * (1 + abs(self.high)))

    @property
    def unsure(self) -> bool:
        """True if the error of the largest eigenvalue is larger than 1 + lambda itself."""
        return self.error_high > 1 + abs(self.high)

    @property
    def summary(self) -> str:
        return f"lambda from {self.low:.4g} to {self.high:.4g}, {self.source}"

    def exchanged(self) -> Spectrum:
        """The eigenvalues with the roles of both solvers exchanged: one over each; ValueError where one is not > 0."""
        if not self.low > 0:
            raise ValueError("an eigenvalue is 0: the exchanged roles have no spectrum")
        found = 1 / self.values
        return Spectrum(
            values=found[np.argsort(found.real)],
            source=self.source,
            error_low=self.error_high / self.high**2,
            error_high=self.error_low / self.low**2,
        )

    def with_open_nodes(self) -> Spectrum:
        """The same with a mode for nodes that are open, lambda = 0."""
        if self.low <= 0:
            return self
        return Spectrum(
            values=np.concatenate([[0j], self.values]), source=self.source, error_low=0.0, error_high=self.error_high
        )

    def lowest(self, least: float) -> Spectrum:
        """The same with the least eigenvalue at the lower end of its error, or at the least one that may be."""
        return replace(self, values=np.append(max(self.low - self.error_low, min(self.low, least)), self.values[1:]))

    def parallel(self) -> Spectrum:
        """The same for *parallel* coupling, an error added at the upper end: both square roots of minus each."""
        roots = np.sqrt(-np.append(self.values, self.values[-1] + self.error_high))
        found = np.concatenate([roots, -roots])
        return Spectrum(values=found[np.argsort(found.real)], source=self.source)

    def factor(self, theta: float) -> float:
        """``max |1 - theta (1 + lambda)|``, the factor of a step with constant theta for the worst mode."""
        return float(np.abs(1 - theta * (1 + self.values)).max())

    @property
    def theta(self) -> float:
        """The theta of fewest steps for both ends, the upper one with its error, or of least factor.

        Of an estimate with real eigenvalues both ends arrive together from equal first errors: the residual of a stiff
        mode is 1 + lambda times its error, so that theta is a little below ``2/(2+low+high)``, which it is where the
        ends are known.  0 where a mode grows for any theta above 0.
        """
        if self.low <= -1:
            return 0.0
        if self.real:
            a, b = 1 + self.low, 1 + self.high + self.error_high
            if self.source != "vectors" or not TOLERANCE < a < (1 - TOLERANCE) * b:
                return 2 / (a + b)
            cost = lambda share: max(math.log(z / TOLERANCE) / -math.log(abs(1 - share * z / b)) for z in (a, b))
            return float(minimize_scalar(cost, bounds=(1, 2 * b / (a + b)), method="bounded", options=EXACT).x / b)
        z = 1 + np.append(self.values, self.values[-1] + self.error_high)
        most = float((2 * z.real / np.abs(z) ** 2).min())  # from there on a mode grows
        factor = lambda share: float(np.abs(1 - share * most * z).max())
        return float(minimize_scalar(factor, bounds=(0, 1), method="bounded", options=EXACT).x * most)
