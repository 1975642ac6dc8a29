"""The inequalities of Sections 4 and 5, each with both of its sides; :mod:`verification.ledger.worst` searches.

Both sides are functions of a :class:`Difference` and of the constants as an edition reads them; formulas come from
:mod:`ndtheory.bounds`.  C_tr is the constant into L2(Gamma_c); ``of="printed"`` takes (5.8) at its word in (5.13) and
in what follows from it without (5.30).  It reads m as m itself up to (5.33), as ``min(m, 1)`` from (5.36) on, and adds
a stress to 1 in the bracket of (5.30): there the right side depends on the unit of stress, so several are tried.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, Literal

import numpy as np

from ndtheory import PRINTED, energy_norms
from ndtheory import bounds as formulas
from ndtheory.continuum.intervals import Interval
from verification.constants import Measured
from verification.ledger.differences import Difference
from verification.ledger.evidence import Aspect

SEED = 2008

#: Random problems, of 2 to 9 contact nodes; starts of each search over pieces; pairs of random forces per problem.
LEVELS: dict[str, tuple[int, int, int]] = {"quick": (30, 1, 6), "full": (400, 3, 12)}

#: Relative error granted to a ratio: the constants are eigenvalues right to about 1e-12, and equalities are seen to
#: hold to 3e-13 of the energies at conditions of S_1 up to 1e5, the thin bodies included.
ALLOWANCE = 1e-9

#: Where terms of different sizes are added: what is granted over the energies behind them; 6e-13 is seen.
ROUNDING = 1e-11

#: Units of stress, in units of the file.
UNITS = (1.0, 1e3, 1e-3, 1e-6)

THETAS = (0.1, 0.5, 0.9)

#: Shares of C_2 at which contraction is tested.
SHARES = (Fraction(1, 100), Fraction(99, 100))


class RightSides(ABC):
    """Right sides of Section 5 over numbers of any type, from the constants of a class that inherits."""

    m: Any
    M: Any
    C_R: Any
    Q: Any
    energy: Any

    @abstractmethod
    def grows(self, formula: Callable[..., Any]) -> Any:
        """A formula of C_K, m, M, C_R and u that falls with m and grows with the others (:mod:`ndtheory.bounds`)."""

    def of_energy(self, formula: Callable[..., Any]) -> Any:
        """A formula of rho, kappa_1 and kappa_2 that grows with each (:mod:`ndtheory.energy_norms`)."""
        return float(formula(*self.energy))

    @cached_property
    def P(self) -> Any:
        """The factor of (5.30)."""
        return self.grows(formulas.P)

    @cached_property
    def D(self) -> Any:
        """``C_T^2/C_R^2 - P``."""
        return self.grows(formulas.D)

    @property
    def ratio(self) -> Any:
        """r, the largest ``|w^1 - w~^1|/|w^2 - w~^2|`` in energy norms."""
        return self.of_energy(energy_norms.largest_ratio)

    def q_squared(self, theta: Any) -> Any:
        """``q(theta)^2`` of the theorem in energy norms."""
        return self.of_energy(lambda *constants: 1 - energy_norms.one_minus_square(theta, *constants))

    @property
    def A(self) -> Any:
        """``M C_R``."""
        return self.M * self.C_R

    @property
    def give(self) -> Any:
        """``m^2/(M C_R)^2`` of (5.29)."""
        return (self.m / self.A) ** 2

    def weight(self, theta: Any) -> Any:
        """The coefficient of ``|||T psi - T psi~|||^2`` in (5.32): positive above C_0."""
        return theta**2 - 2 * theta * (1 - theta) * self.give

    def h_1(self, theta: Any) -> Any:
        """After (5.39)."""
        return 1 - formulas.one_minus_h1(theta, self.D, self.Q)

    def h_2(self, theta: Any) -> Any:
        """(5.45)."""
        return 1 - formulas.one_minus_h2(theta, self.P)


@dataclass(frozen=True, kw_only=True)
class Reading(RightSides):
    """The constants as an inequality reads them, and the right sides that contain them.

    ``m`` is ``min(m, 1)`` from (5.36) on as printed, ``coercivity`` m itself, ``u`` the stress of the bracket in
    (5.30): m, or 1 as printed.  ``C_K_half`` is ``k C_s C_tr`` with C_tr into H^1/2 (5.8), and ``energy`` has rho,
    kappa_1, kappa_2 of the theorem in energy norms.
    """

    m: float
    M: float
    C_R: float
    C_K: float
    u: float
    coercivity: float
    C_K_half: float
    energy: tuple[float, float, float]

    @classmethod
    def of(cls, measured: Measured) -> Reading:
        """The constants as repaired; ValueError where one does not exist."""
        constants, energy, half = measured.constants(), measured.energy_constants(), measured.C_tr_half
        if constants is None or energy is None or half is None:
            raise ValueError("the constants of the theorem are needed")
        C_s = 0.0 if measured.C_s is None else measured.C_s.value
        return cls(
            m=float(constants.m),
            M=float(constants.M),
            C_R=float(constants.C_R),
            C_K=float(constants.C_K),
            u=float(constants.m),
            coercivity=float(constants.m),
            C_K_half=measured.friction * C_s * half.value,
            energy=(float(energy.at_work), float(energy.kappa_1), float(energy.kappa_2)),
        )

    def in_unit(self, unit: float) -> Reading:
        """All stresses times a factor, before an edition is chosen."""
        scaled = {name: getattr(self, name) * unit for name in ("m", "M", "C_K", "u", "coercivity", "C_K_half")}
        return replace(self, **scaled)

    @property
    def by_half(self) -> Reading:
        """With C_tr into H^1/2, as (5.8) has it."""
        return replace(self, C_K=self.C_K_half)

    @property
    def bracket(self) -> Reading:
        """(5.30) to (5.33) as printed."""
        return replace(self, u=PRINTED.unit(self.m))

    @property
    def printed(self) -> Reading:
        """(5.36) on as printed."""
        return replace(self, m=PRINTED.coercivity(self.m), u=PRINTED.unit(self.m))

    @cached_property
    def C_T(self) -> float:
        """(5.16), where m is m itself in both editions."""
        return float(formulas.lipschitz(self.coercivity, self.M, self.C_R, self.C_K))

    @cached_property
    def X(self) -> float:
        """The factor of (5.11), by (5.16)."""
        return float(self.C_T * self.coercivity / self.A)

    def grows(self, formula: Callable[..., Any]) -> float:
        return float(formula(self.C_K, self.m, self.M, self.C_R, self.u))

    @cached_property
    def Q(self) -> float:
        """The Lipschitz constant of T squared, as h_1 has it."""
        return float(formulas.Q(self.C_K, self.m, self.M, self.C_R))

    @cached_property
    def C_0(self) -> float:
        """(5.37)."""
        return float(formulas.C0(self.m, self.M, self.C_R))

    def gain(self, theta: float) -> float:
        """``1 - K(theta)^2``."""
        h_1, h_2 = formulas.one_minus_h1(theta, self.D, self.Q), formulas.one_minus_h2(theta, self.P)
        return float(min(h_1, h_2))

    @cached_property
    def threshold(self) -> float:
        """``k C_s C_tr`` at k = C_2 (5.43)."""
        return float(formulas.inverse_G(self.m**3 * (1 + self.give), self.m, self.M, self.C_R, self.u))

    def contracting(self) -> tuple[float, ...]:
        """Thetas inside the interval of Proposition 5.6; empty where it is."""
        if not self.threshold > self.C_K:
            return ()
        low = float(formulas.C6(self.P)) if self.P > 1 else 0.0
        high = float(formulas.C1(self.D, self.Q))
        return tuple(low + share * (high - low) for share in (0.1, 0.5, 0.9) if low < high)

    def from_C0(self) -> tuple[float, ...]:
        """C_0 and the thetas above it inside the interval."""
        inside = self.contracting()
        return (self.C_0, *(theta for theta in inside if theta > self.C_0)) if inside else ()


#: Numbers, or arrays of them.
Terms = Any
Side = Callable[[Any, Any, Any], Terms]

everywhere = lambda r: THETAS
above = lambda r: tuple(theta for theta in (1.5 * r.C_0, *THETAS) if r.C_0 < theta < 1)
below = lambda r: tuple(share * r.C_0 for share in (0.1, 0.5, 0.99))


@dataclass(frozen=True)
class Inequality:
    """``left <= right``, or ``left = right``, of the statement ``id``.

    Attributes
    ----------
    left, right : callable
        Difference (or :class:`verification.ledger.worst.Trial`), constants, theta -> a number; several numbers are
        added, or compared one by one where ``about`` is 'bodies'.  Of several differences: arrays of them.  The same
        formulas take intervals (:mod:`verification.ledger.enclosures`).
    equality : bool
        Then both sides may be vectors whose Euclidean norm is (5.21).
    about : {'pairs', 'contraction', 'bodies'}
        Two forces; two forces at a friction below C_2; only the two bodies.
    reading : callable
        How the constants are read.
    thetas : callable or None
        Constants -> the thetas tried.
    units : tuple of float
        Units of stress tried, in units of the file.
    squares : bool
        True if both sides are squares of norms, whose ratio is then taken.
    one_grid : bool
        True to try it only where both bodies have one grid along Gamma_c.
    remark : str
        Added to the text on grids that differ.
    """

    id: str
    left: Side
    right: Side
    _: KW_ONLY
    of: Aspect = "printed"
    equality: bool = False
    about: Literal["pairs", "contraction", "bodies"] = "pairs"
    reading: Callable[[Reading], Reading] = lambda r: r
    thetas: Callable[[Reading], Sequence[float]] | None = None
    units: tuple[float, ...] = (1.0,)
    squares: bool = False
    one_grid: bool = False
    remark: str = ""

    def ratio(self, subject: Any, reading: Reading, theta: float = 0.0) -> Any:
        """Left over right for a Trial or a Difference; an array for several of these.

        Negative terms change sides first, so that the ratio is at most 1 exactly where the inequality holds.  For an
        equality: 1 plus the difference over the energies.
        """
        left, right = self.left(subject, reading, theta), self.right(subject, reading, theta)
        if self.about == "bodies":
            worst = float(np.max(np.asarray(left) / np.asarray(right)))
            return float(np.sqrt(worst)) if self.squares else worst
        if self.equality:
            apart, size = np.abs(left - right), subject.size
            if np.ndim(apart) > np.ndim(size):
                apart, size = np.linalg.norm(apart, axis=-1), np.sqrt(size)
            return 1 + apart / size
        terms = [*terms_of(left), *(-term for term in terms_of(right))]
        positive = sum(np.maximum(term, 0.0) for term in terms)
        negative = sum(np.maximum(-term, 0.0) for term in terms)
        infinite = ~np.isfinite(positive + negative)  # also what is not a number
        if len(terms) > 2:
            positive = positive - ROUNDING * subject.size
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(positive > 0, positive / np.asarray(negative), 0.0)
        return np.where(infinite, math.inf, ratio)[()]


def terms_of(side: Terms) -> tuple[Any, ...]:
    """The terms of a side."""
    return side if isinstance(side, tuple) else (side,)


def _both(
    id: str,
    left: Side,
    right: Side,
    reading: Callable[[Reading], Reading] = lambda r: r.printed,
    units: tuple[float, ...] = UNITS,
    **options: Any,
) -> list[Inequality]:
    """An inequality as printed, with the constants as the paper reads them, and repaired."""
    printed = Inequality(id, left, right, reading=reading, units=units, **options)
    return [printed, Inequality(id, left, right, of="repaired", **options)]


#: How the paper reads the constants: the lost 1/m in (5.30) to (5.33); (5.13) by C_tr into H^1/2, in any unit.
EARLY: dict[str, Any] = {"reading": lambda r: r.bracket}
BY_TRACES: dict[str, Any] = {"reading": lambda r: r.by_half, "units": (1.0,)}


def _root(x: Any) -> Any:
    """The square root of an interval, or of numbers, where a negative one is rounding."""
    return x.sqrt() if isinstance(x, Interval) else np.sqrt(np.maximum(x, 0.0))


def _lifts(b: Any, r: Reading, theta: float) -> Any:
    """The squared norms of both lifts."""
    return [b.top(N, E) for N, E in zip(b.N, b.E, strict=True)]


def _square_of_step(d: Difference, r: Reading, theta: float) -> Any:
    return d.relaxed(theta) ** 2


#: Where the grids differ, a trace of one body is not a trace of the other body.  P leads from the Neumann grid to the
#: contact grid, and takes some traces to 0 where the Neumann grid has more nodes; nothing leads back.
ONE_TRACE_SPACE = "bodies whose grids differ have no common space of traces on which to compare its norms"

INEQUALITIES: tuple[Inequality, ...] = (
    # --- Section 4: only the two bodies
    Inequality(
        "4.7",
        lambda b, r, _: [b.top(b.E[1], b.N[0]), b.top(b.E[0], b.N[1])],
        lambda b, r, _: [1, 1],
        about="bodies",
        squares=True,
        one_grid=True,
    ),
    Inequality(
        "4.7",
        lambda b, r, _: [b.top(E, N) for E, N in zip(b.E, b.N, strict=True)],
        lambda b, r, _: [1, 1],
        of="repaired",
        about="bodies",
        squares=True,
    ),
    Inequality("4.8", _lifts, lambda b, r, _: b.contrast, of="repaired", about="bodies", squares=True),
    # by the constant between the norms of traces, which a mesh always has and the proof must supply
    Inequality(
        "prop-4.1.1",
        lambda b, r, _: [b.top(b.N[0], b.N[1]), b.top(b.N[1], b.N[0])],
        lambda b, r, _: [c * between for c, between in zip(b.contrast, b.across(b.E), strict=True)],
        of="repaired",
        about="bodies",
        squares=True,
        one_grid=True,
    ),
    Inequality(
        "prop-4.1.2",
        lambda b, r, _: b.across(b.N),
        lambda b, r, _: [c * between for c, between in zip(b.contrast, b.across(b.E), strict=False)],
        about="bodies",
        squares=True,
        remark=" (there only of the contact body's lift, as nothing leads from its grid to the other one)",
    ),
    Inequality("x-continuity", lambda b, r, _: b.largest, lambda b, r, _: b.continuity, about="bodies"),
    Inequality("x-lift-bound", _lifts, lambda b, r, _: b.contrast, about="bodies"),
    # --- Section 5: two forces
    *_both("5.11", lambda d, r, _: d.size_1, lambda d, r, _: r.X * d.size_2, **BY_TRACES),
    Inequality("5.12", lambda d, r, _: d.energy_1, lambda d, r, _: (d.mixed_1, d.friction)),
    Inequality("5.13", lambda d, r, _: d.friction, lambda d, r, _: r.C_K_half * (d.size_1 * d.size_2 + d.size_2**2)),
    Inequality(
        "5.13", lambda d, r, _: d.friction, lambda d, r, _: r.C_K * (d.size_1 * d.size_2 + d.size_2**2), of="repaired"
    ),
    *_both(
        "5.14",
        lambda d, r, _: r.m * d.size_1**2,
        lambda d, r, _: (r.A + r.C_K) * d.size_1 * d.size_2 + r.C_K * d.size_2**2,
        **BY_TRACES,
    ),
    *_both(
        "5.15",
        lambda d, r, _: r.m * (d.size_1 - (r.A + r.C_K) / (2 * r.m) * d.size_2) ** 2,
        lambda d, r, _: ((r.A + r.C_K) ** 2 / (4 * r.m) + r.C_K) * d.size_2**2,
        **BY_TRACES,
    ),
    *_both("prop-5.4", lambda d, r, _: d.dual_T, lambda d, r, _: r.C_T * d.dual, **BY_TRACES),
    Inequality(
        "5.17",
        lambda d, r, _: d.reaction @ d.setting.coordinates.T,
        lambda d, r, _: -(d.d_1 @ d.setting.felt_1.T) @ d.setting.coordinates.T,
        equality=True,
    ),
    Inequality("5.18", lambda d, r, _: d.dual_T, lambda d, r, _: r.A * d.size_1),
    Inequality("5.19", lambda d, r, _: d.size_2, lambda d, r, _: d.dual / r.m),
    Inequality("5.22", lambda d, r, _: d.norm, lambda d, r, _: d.dual / _root(r.m)),
    Inequality("5.23", lambda d, r, _: d.dual, lambda d, r, _: r.M / _root(r.m) * d.norm),
    Inequality("x-root-M", lambda d, r, _: d.dual, lambda d, r, _: _root(r.M) * d.norm),
    Inequality(
        "5.24",
        _square_of_step,
        lambda d, r, t: t**2 * d.norm_T**2 + (1 - t) ** 2 * d.norm**2 + 2 * t * (1 - t) * d.inner,
        equality=True,
        thetas=everywhere,
    ),
    Inequality("5.25", lambda d, r, _: d.inner, lambda d, r, _: d.mixed_2, equality=True),
    Inequality("5.26", lambda d, r, _: d.mixed_2, lambda d, r, _: d.work, equality=True),
    Inequality("5.27", lambda d, r, _: d.work, lambda d, r, _: -d.mixed_1, equality=True),
    Inequality("5.28", lambda d, r, _: -d.mixed_1, lambda d, r, _: (-d.energy_1, d.friction)),
    Inequality("5.29", lambda d, r, _: -d.energy_1, lambda d, r, _: -r.give * d.norm_T**2),
    *_both("5.30", lambda d, r, _: d.friction, lambda d, r, _: r.P * d.norm**2, **EARLY),
    *_both("5.31", lambda d, r, _: d.inner, lambda d, r, _: (-r.give * d.norm_T**2, r.P * d.norm**2), **EARLY),
    *(
        inequality
        for id, read in (("5.32", EARLY), ("5.33", EARLY), ("5.36", {}))
        for inequality in _both(
            id,
            _square_of_step,
            lambda d, r, t: (r.weight(t) * d.norm_T**2, r.h_2(t) * d.norm**2),
            **read,
            thetas=everywhere,
        )
    ),
    *_both(
        "5.38",
        lambda d, r, t: r.weight(t) * d.norm_T**2,
        lambda d, r, t: r.weight(t) * (r.C_T * r.M / r.m) ** 2 * d.norm**2,
        reading=lambda r: r.by_half.printed,
        thetas=above,
    ),
    *_both("5.39", _square_of_step, lambda d, r, t: r.h_1(t) * d.norm**2, thetas=above),
    *_both("5.44", _square_of_step, lambda d, r, t: r.h_2(t) * d.norm**2, thetas=below),
    Inequality("x-reaction", lambda d, r, _: d.norm_T**2, lambda d, r, _: r.energy[0] * d.energy_1),
    Inequality(
        "x-friction-energy",
        lambda d, r, _: d.friction,
        lambda d, r, _: r.energy[1] * _root(d.energy_1) * d.norm + r.energy[2] * d.norm**2,
    ),
    Inequality("x-ratio", lambda d, r, _: _root(d.energy_1), lambda d, r, _: r.ratio * d.norm),
    Inequality("x-energy", _square_of_step, lambda d, r, t: r.q_squared(t) * d.norm**2, thetas=everywhere),
    # --- Proposition 5.6.  (1 - K^2)/theta e^2 <= (e^2 - |||T_theta psi - T_theta psi~|||^2)/theta: nothing of 1 - K
    # is lost to rounding where theta is small
    *(
        inequality
        for id, thetas in (("prop-5.6.1", Reading.from_C0), ("x-merged-interval", Reading.contracting))
        for inequality in _both(
            id,
            lambda d, r, t: r.gain(t) / t * d.norm**2,
            lambda d, r, t: 2 * (d.norm**2 - d.inner) - t * d.step**2,
            about="contraction",
            thetas=thetas,
        )
    ),
    *_both(
        "5.47",
        lambda d, r, t: d.relaxed(t),
        lambda d, r, t: math.sqrt(1 - r.gain(t)) * d.norm,
        about="contraction",
        thetas=Reading.contracting,
    ),
)

#: The inequalities by statement and form.
ENTRIES: Mapping[tuple[str, Aspect], Inequality] = {(each.id, each.of): each for each in INEQUALITIES}
