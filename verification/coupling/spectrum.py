"""Eigenvalues of a coupling: all of them, their ends, or what a few iterates and their images show of them.

While contact does not change, ``T x - T y = -H (x - y)`` with ``H`` similar to ``S_n^-1 S_c``.  Its eigenvalues lambda
are real and at least 0 where both stiffnesses are symmetric; open nodes have lambda = 0.  A mode is multiplied by
``1 - theta (1 + lambda)`` in a step with constant theta.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from fem1d2d.mesh import Floats
from verification.value import Value

#: Number of modes that stand for a spectrum of which only the ends are known.
BETWEEN = 20

#: The accuracy of vectors that a solver computed in doubles, and of those in single precision, over the largest entry.
DOUBLE, SINGLE = 1e-12, 1e-7

#: Differences of iterates count above so many times that accuracy.
ROUNDING = 100.0

#: Directions of the iterates count above this share of the first one, and where noise changes an image by less than
#: this share of it.
RANK, CLEAN = 1e-9, 1e-2

#: Most decimal digits of vectors that were written as texts, and the number of entries in which they are looked for.
DIGITS, SOME = 12, 1000

#: Ritz values with a larger share as residual stand for several eigenvalues: so many modes more are put between two of
#: them.  Predicted over real steps in 31 linear couplings: 0.82 to 1.28 for IQN-ILS, 0.62 to 1.27 for Aitken.
SETTLED, MORE = 0.02, 3

#: The least error of an end that has not settled, as a share of 1 + lambda.
MARGIN = 0.03

#: An end is found if 1 + lambda has changed by no more than this share over the last FEWER directions, of which so many
#: must be left.  Over nine iterates of Aitken in 40 random couplings it changed by 0.024 at most; in a coupling whose
#: smooth data hide the stiff modes it changed by 0.06 or more as long as theta diverged.
STEADY, FEWER, LEFT = 0.05, 2, 1

#: Residuals below this share of the value show a space that the coupling maps to itself.
INVARIANT = 1e-6

#: The fewest iterates of one contact pattern from which eigenvalues are read.
FEWEST = 4

#: Entries of an image below this share of the largest are 0, by rounding: the force of an open node.
OPEN = 1e-12

#: An eigenvalue is complex if its imaginary part exceeds this share of the largest 1 + lambda.
REAL = 0.02

#: The meaning of images that equal their iterates, and of those that one vector moves away from them.
SOLVED = "each is a solution already, or X was given for TX; needed iterates from before the run has converged"
SHIFTED = "all eigenvalues are -1, with which no theta above 0 converges; one solver probably has the wrong sign"

Complex = NDArray[np.complex128]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Spectrum(Value):
    """The eigenvalues lambda of a coupling, as far as they are known.

    Attributes
    ----------
    values : array, shape (m,)
        lambda by increasing real part, no unit: all eigenvalues, or those that stand for them in predictions.
    source : {'eigenvalues', 'ends', 'vectors'}
        Whether they are all eigenvalues, lie between two known ends, or are Ritz values of vectors.
    error_low, error_high : float
        Estimated errors of both ends; 0 where they are known.
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
        """Modes between two ends, ``0 <= low <= high``: the extrema of a Chebyshev polynomial, dense at both ends."""
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

    def factor(self, theta: float) -> float:
        """``max |1 - theta (1 + lambda)|``, the factor of a step with constant theta for the worst mode."""
        return float(np.abs(1 - theta * (1 + self.values)).max())

    @property
    def theta(self) -> float:
        """The theta of least factor, the ends as far apart as their errors allow; ``2/(2+low+high)`` if it is real."""
        low, high = max(self.low - self.error_low, min(self.low, 0.0)), self.high + self.error_high
        if self.real:
            return 2 / (2 + low + high)
        most = 2 / (1 + max(high, 0.0))
        return float(minimize_scalar(self.factor, bounds=(0, most), method="bounded", options={"xatol": 1e-9}).x)


@dataclass(frozen=True, kw_only=True, repr=False)
class SeenVectors(Value):
    """Iterates and their images, as they were read.

    Attributes
    ----------
    unknowns, iterates, used : int
        The length of a vector, the number of iterates, and of those from which eigenvalues are read: the last ones
        whose images have the same entries 0, where these are FEWEST or more.
    directions : int
        Number of independent directions that their differences have above rounding.
    spectrum : Spectrum
    symmetric : bool
        True if the eigenvalues are real.
    changing : bool
        True if contact opens or closes: entries of T x are 0 in some images and not in others, or an eigenvalue is
        below 0.
    settled : bool
        False if contact still changes in the last FEWEST iterates: then no theta follows.
    ritz : array, shape (directions,)
        The Ritz values less 1: eigenvalues as the vectors show them.
    noise : float or None
        Share by which images of dependent directions differ; None where no directions depend on each other.
    low_found, high_found : bool
        True if an end no longer changes with more directions: the least one as the exchanged roles need it, in
        1 + 1/lambda, and the largest one in 1 + lambda.
    course : tuple of float
        The largest lambda after fewer iterates, and after all.
    """

    unknowns: int
    iterates: int
    used: int
    directions: int
    spectrum: Spectrum
    symmetric: bool
    changing: bool
    settled: bool
    ritz: Complex
    noise: float | None
    low_found: bool
    high_found: bool
    course: tuple[float, ...]

    @property
    def why_no_theta(self) -> str:
        """Why no theta follows; empty where one does."""
        if self.negative:
            return self.negative
        if not self.settled:
            return "contact still changes in the last iterates: continue the run, and give more of its vectors"
        if self.high_found:
            return ""
        said = "rho is not found yet: these are too few independent directions"
        if len(self.course) > 1:
            said = f"rho changes with every iterate ({', '.join(f'{high:.3g}' for high in self.course)}), not found yet"
        return f"{said}; continue the run with IQN-ILS, and give more of its vectors"

    @property
    def negative(self) -> str:
        """Why eigenvalues below 0 leave no theta; empty where there are none of these."""
        if self.ritz.real.max() < -REAL:
            needed = "the second solver must return the force that acts on the first body"
            return f"all eigenvalues are negative: one solver probably has the wrong sign ({needed})"
        if self.ritz.real.min() <= RANK - 1:
            return f"an eigenvalue is {self.ritz.real.min():.3g}: with -1 or less no theta above 0 converges"
        return ""

    def to_dict(self) -> dict[str, Any]:
        """The object ``vectors``."""
        return {
            "unknowns": self.unknowns,
            "iterates": self.iterates,
            "used": self.used,
            "directions": self.directions,
            "eigenvalues": [{"real": float(v.real), "imaginary": float(v.imag)} for v in self.ritz],
            "error_low": self.spectrum.error_low,
            "error_high": self.spectrum.error_high,
            "symmetric": self.symmetric,
            "contact_changes": self.changing,
            "settled": self.settled,
            "noise": self.noise,
            "low_found": self.low_found,
            "high_found": self.high_found,
            "reason": {} if self.noise is not None else {"noise": "the directions of the iterates are independent"},
        }


def seen_in(X: Floats, TX: Floats, *, tied: bool = False, starts: NDArray[np.bool_] | None = None) -> SeenVectors:
    """The spectrum by Ritz values: iterates x and their images T x as rows, of a run by any method.

    With an orthonormal basis U of the differences of the iterates, the eigenvalues of ``U' (1 + H) U`` lie between the
    ends of ``1 + H`` in the inner product in which H is selfadjoint, and nearly so in the Euclidean one.

    Parameters
    ----------
    X, TX : array, shape (k, n)
        k >= 2 vectors and what T makes of them.
    tied : bool
        True if an entry that is 0 shows no open node.
    starts : array of bool, shape (k,), optional
        Where another step in time begins, with another T of the same linear part.

    Raises
    ------
    ValueError
        The iterates, or their residuals, do not differ above rounding.
    """
    given, last = len(X), len(X) if tied else _last_piece(TX)
    changing, read = last < given, last if last >= FEWEST else given
    X, TX = X[-read:], TX[-read:]
    inside = np.ones(read - 1, dtype=bool) if starts is None else ~starts[-read + 1 :]
    values, residuals, noise = _ritz(X, TX, inside)
    low, high = (_error(values, residuals, i) for i in (0, -1))
    negative = bool(values[0].real < 1 - max(REAL, low))
    sizes = np.abs(values)
    modes = _modes(values, residuals / np.maximum(sizes, RANK * sizes.max()), X.shape[1])
    spectrum = Spectrum(values=modes - 1, source="vectors", error_low=low, error_high=high)
    before = _before(X, TX, inside, len(values))
    steady = lambda ends: len(before) > 0 and max(ends) <= (1 + STEADY) * min(ends)
    whole = len(values) == X.shape[1]
    known = [whole or bool(residuals[i] <= INVARIANT * abs(values[i])) for i in (0, -1)]
    tops = [float(found[-1].real) for found in (*before, values)]
    least = [float(found[0].real) - 1 for found in (*before, values)]
    return SeenVectors(
        unknowns=X.shape[1],
        iterates=given,
        used=read,
        directions=len(values),
        spectrum=spectrum,
        symmetric=spectrum.real,
        changing=changing or negative,
        settled=not changing or last >= FEWEST,
        ritz=values - 1,
        noise=noise,
        low_found=min(least) > 0 and (known[0] or steady([1 + 1 / low for low in least])),
        high_found=known[1] or steady(tops),
        course=tuple(top - 1 for top in tops),
    )


def _before(X: Floats, TX: Floats, inside: NDArray[np.bool_], directions: int) -> list[Complex]:
    """Ritz values of fewer iterates, up to FEWER directions fewer; empty where fewer than LEFT would be left."""
    found: list[Complex] = []
    for count in range(len(X) - 1, LEFT, -1):
        try:
            values = _ritz(X[:count], TX[:count], inside[: count - 1])[0]
        except ValueError:
            return []
        if len(values) < directions and all(len(values) < len(more) for more in found):
            found.append(values)
        if len(values) <= directions - FEWER:
            return found[::-1] if len(values) >= LEFT else []
    return []


def _ritz(X: Floats, TX: Floats, inside: NDArray[np.bool_]) -> tuple[Complex, Floats, float | None]:
    """Ritz values of ``1 + H`` by increasing real part, their residuals, and the noise of the images.

    Differences of consecutive rows count where ``inside``.
    """
    largest = float(np.abs(TX).max())
    unit = math.ldexp(1.0, math.frexp(max(largest, float(np.abs(X).max())))[1])  # a power of 2: no digit changes
    D, E = (np.diff(rows, axis=0)[inside].T / unit for rows in (X, TX - X))
    lengths = np.linalg.norm(D, axis=0)
    accuracy = _accuracy(X, TX) * largest / unit
    kept = lengths > ROUNDING * accuracy
    if not kept.any():
        raise ValueError("the iterates do not differ above rounding: needed two different ones")
    D, E = D[:, kept] / lengths[kept], E[:, kept] / lengths[kept]
    if (np.linalg.norm(E, axis=0) <= accuracy / lengths[kept]).all():
        if np.abs(TX - X).max() <= accuracy * unit:
            raise ValueError(f"T x = x for every iterate, up to rounding: {SOLVED}")
        raise ValueError(f"T x - x is the same for every iterate, up to rounding: {SHIFTED}")
    U, sigma, Vt = np.linalg.svd(D, full_matrices=False)
    images = -E @ Vt.T
    sizes = np.linalg.norm(images, axis=0)
    rest = sigma <= RANK * sigma[0]
    largest = float((sizes[~rest] / sigma[~rest]).max())
    noise = float(sizes[rest].max()) / largest if rest.any() else None
    rounding = np.sqrt(((Vt * (accuracy / lengths[kept])) ** 2).sum(axis=1)) / largest
    used = ~rest & (sigma * CLEAN >= np.maximum(rounding, noise or 0.0))
    if not used.any():
        used = sigma == sigma[0]
    U, A = U[:, used], images[:, used] / sigma[used]
    values, vectors = np.linalg.eig(U.T @ A)
    order = np.argsort(values.real)
    values, vectors = values[order], vectors[:, order]
    residuals = np.linalg.norm(A @ vectors - (U @ vectors) * values, axis=0)
    return values, residuals, noise


def _accuracy(X: Floats, TX: Floats) -> float:
    """Accuracy of vectors relative to the largest entry: as they were computed in doubles, or rounded to be written."""
    some = np.concatenate([TX.ravel()[:SOME], X.ravel()[:SOME]])
    with np.errstate(over="ignore"):
        single = some.astype(np.float32)
    if (some == single).all():
        whole = (some == np.rint(some)).all()  # numbers that any format holds
        return DOUBLE if whole else SINGLE
    for digits in range(1, DIGITS):
        if all(float(f"{value:.{digits - 1}e}") == value for value in some):
            return float(10.0 ** (1 - digits))
    return DOUBLE


def _last_piece(TX: Floats) -> int:
    """Number of the last images with the same entries 0."""
    zero = np.abs(TX) <= OPEN * float(np.abs(TX).max(initial=0.0))
    same = (zero == zero[-1]).all(axis=1)
    return len(TX) if same.all() else int(np.argmin(same[::-1]))


def _modes(values: Complex, shares: Floats, unknowns: int) -> Complex:
    """Ritz values with modes between those that have not settled, as many as there are unknowns at most."""
    gaps = [i for i in range(len(values) - 1) if max(shares[i : i + 2]) > SETTLED]
    more = min(MORE, (unknowns - len(values)) // max(len(gaps), 1))
    between = [values[i] + (values[i + 1] - values[i]) * j / (more + 1) for i in gaps for j in range(1, more + 1)]
    found = np.concatenate([values, np.array(between, dtype=complex)])
    return found[np.argsort(found.real)]


def _error(values: Complex, residuals: Floats, end: int) -> float:
    """Estimate of the distance of a Ritz value from an eigenvalue: its residual, or less.

    In the inner product of the energy it is the square of the residual over the gap to the next value.
    It is another one here, hence not below MARGIN of the value: a theta 1 % too large may diverge, one 3 % too small
    takes 3 % more steps.  Of 120 random couplings two diverged without it, none with 0.01 to 0.1.
    """
    others = np.delete(np.abs(values - values[end]), end)
    residual, gap = float(residuals[end]), float(others.min(initial=np.inf))
    return min(residual, max(residual**2 / gap if gap else residual, MARGIN * float(abs(values[end]))))
