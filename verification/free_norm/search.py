"""The circle criterion for two layers, evaluated: factors, thetas and friction, by a search for multipliers.

The criterion and its proof in intervals are in :mod:`ndtheory.continuum.circle`.  For given multipliers lambda and beta
each wave number allows alphas up to one, in closed form, so that the largest friction ``2 sqrt(alpha beta)`` is sought
in a plane.  The set of multipliers is convex and the square root concave, so a grid that is drawn in on its best point
finds the largest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import brentq, minimize_scalar

from fem1d2d.mesh import Floats
from ndtheory.continuum.circle import Multipliers, Pencil, Symmetric, TwoLayers, disk, flexibility, pencil
from ndtheory.continuum.strip import Strip, symbols
from ndtheory.errors import HypothesisError
from verification.semidefinite.interior_point import Program, solve

#: Wave numbers of a search between two, by thickness and radius; and two at which nothing changes any more.
WAVES, BETWEEN, ENDS = 120, (0.03, 60.0), (1e-3, 1e3)

#: Points of the grid of lambda and beta, the first half widths of it in logarithms, and what is left of them each time.
GRID, WIDTHS, DRAWN_IN = (11, 9), (7.0, 3.0), 0.45

#: How often the grid is drawn in: 7 * 0.45^11 leaves 1e-3 of lambda, where the friction is flat.
TIMES = 11

#: Layers, radii and stiffnesses whose ratios are larger than this are refused.
RATIO = 10**6

#: How well factors and relaxation factors are known.
NEAR = 1e-5

#: The program in the norm (5.21) begins with each so many of the wave numbers.
FEWER = 3

#: The square of the smoothing is at least this, where no alpha would be too large.
LEAST = 1e-30


@dataclass(frozen=True)
class Allowed:
    """The largest friction that the criterion allows on a circle; negative where it holds for none."""

    friction: float
    by: Multipliers


class Search:
    """The search for multipliers of two layers.

    Examples
    --------
    >>> from fractions import Fraction
    >>> from ndtheory.moduli import Moduli
    >>> soft, hard = (Strip(body=Moduli(young=E, poisson="0.3"), thickness=Fraction(3, 10)) for E in (20000, 70000))
    >>> layers = Search(TwoLayers(contact=soft, neumann=hard, radius=Fraction(1, 10)))
    >>> round(layers.factor(0.7, 0.2), 4), round(layers.friction_threshold, 1)
    (0.3473, 5.1)
    """

    def __init__(self, layers: TwoLayers) -> None:
        self.layers = layers
        #: Decides multipliers in intervals: its ``contracts(ends, by)``.
        self.criterion: Any = layers
        depths = [float(strip.thickness) for strip in (layers.contact, layers.neumann)]
        radius = float(layers.radius)
        long, short = 1 / max(depths), 1 / min(*depths, radius)
        inner = np.geomspace(BETWEEN[0] * long, BETWEEN[1] * short, WAVES)
        xi = np.array([ENDS[0] * long, *inner, ENDS[1] * short])
        self.contact = _layer(layers.contact, xi, side=-1)
        self.neumann = _layer(layers.neumann, xi, side=1)
        self.smooth = np.maximum(np.sinc(radius * xi / (2 * np.pi)) ** 4, LEAST)

    def allowed(self, ends: tuple[float, float]) -> Allowed:
        """The largest friction allowed on the circle with some ends."""
        along = max(float((self.contact[0] + x * self.neumann[0]).max()) for x in ends)
        none = Allowed(-1.0, Multipliers(normal=1.0, alpha=0.0, beta=0.0))
        if min(float((self.contact[0] + x * self.neumann[0]).min()) for x in ends) <= 0:
            return none

        def at(normal: Floats, beta: Floats) -> tuple[Floats, Floats]:
            beta = np.exp(beta) / along
            return self.largest_alpha(ends, np.exp(normal), beta), beta

        normal, beta = drawn_in(at, (0.0, -1.5), WIDTHS, GRID, ((-np.inf, np.inf), (-np.inf, 0.0)))
        alpha, beta = at(normal, beta)
        if alpha <= 0:
            return none
        by = Multipliers(normal=float(np.exp(normal)), alpha=float(alpha), beta=float(beta))
        return Allowed(float(np.sqrt(4 * alpha * beta)), by)

    def largest_alpha(self, ends: tuple[float, float], normal: Floats, beta: Floats) -> Floats:
        """The largest alpha for which M is positive semidefinite at all wave numbers; -inf without one."""
        by = Multipliers(normal=normal[..., None], alpha=0.0, beta=beta[..., None])
        return self.alpha_of(pencil(self.contact, self.neumann, by, 0.0, ends), ends)

    def alpha_of(self, form: Pencil, ends: tuple[float, float]) -> Floats:
        """The largest alpha with which a form without one stays positive semidefinite at all wave numbers, or -inf."""
        low, high = form.low[0], form.high[0]
        # the determinant falls by alpha times these, in Bernstein's form too
        x, y = ends
        taken = (self.smooth * x**2 * low, self.smooth * y**2 * high, self.smooth * (y**2 * low + x**2 * high) / 2)
        found = np.where((low > 0) & (high > 0), least_ratio(form.determinants, taken), -np.inf)
        return np.asarray(found.min(axis=-1))

    def factor(self, theta: float, k: float) -> float | None:
        """The least q for which T_theta contracts by q at friction k, 0 < theta <= 1; None where there is none."""
        missing = lambda q: self.allowed(disk(theta, q)).friction - k
        near = min(NEAR, theta / 1000)
        least = 1 - theta + near
        return _least(missing, least, 1.0, near) if least > 1 - theta else None  # else lost in rounding

    def largest_theta(self, k: float) -> float | None:
        """The theta <= 1 below which every T_theta contracts at friction k; None where no theta does."""
        missing = lambda share: self.allowed(disk(1 - share, 1.0)).friction - k
        share = _least(missing, 0.0, 1 - NEAR)
        return None if share is None else 1 - share

    def best_theta(self, k: float, largest: float) -> tuple[float, float]:
        """The theta <= ``largest`` with the least factor at friction k, to 0.005 in three digits, and that factor."""
        factor = lambda theta: self.factor(theta, k) or 1.0
        theta = best_up_to(largest, factor, 5e-3)
        return theta, factor(theta)

    def energy_factor(self, theta: float, k: float) -> tuple[float, Multipliers, float]:
        """The least factor in the norm (5.21) by multipliers that all wave numbers share; these, and their weight.

        LMIError where none prove anything.
        """
        move, pairs = self._energy_forms(theta, k)
        some = np.arange(len(move)) % FEWER == 0
        while True:  # wave numbers join where the multipliers of the others need a larger factor
            found = solve(self._energy_program(theta, k, move[some], [(a[some], b[some]) for a, b in pairs]))
            squares = _least_squares(move, pairs, found.y)
            beside = np.pad(squares, 1, constant_values=-np.inf)
            top = (squares > (1 + NEAR) * found.s) & (squares >= beside[:-2]) & (squares >= beside[2:]) & ~some
            if not top.any():
                break
            some |= top
        normal, tangential, alpha, beta = found.y
        by = Multipliers(normal=normal / tangential, alpha=k * alpha / tangential, beta=k * beta / tangential)
        return float(np.sqrt(squares.max())), by, float(tangential)

    def _energy_forms(self, theta: float, k: float) -> tuple[Floats, list[tuple[Floats, Floats]]]:
        """T_theta as two rows for each wave number, and the factors of the products that have multipliers.

        The coordinates are those in which the energies of g and p are squares of lengths.
        """
        roots = [np.linalg.cholesky(_matrices(form)) for form in (self.neumann, self.contact)]
        L, C = (np.linalg.inv(root.transpose(0, 2, 1)) for root in roots)  # g = L y, p = C z
        zero = np.zeros_like(L)
        force, taken = np.concatenate([zero, C], axis=2), np.concatenate([L, zero], axis=2)
        jump = -np.concatenate([roots[0], roots[1]], axis=2)
        back = L.transpose(0, 2, 1) @ _matrices(self.neumann)
        move = theta * back @ force + (1 - theta) * np.concatenate([np.broadcast_to(np.eye(2), L.shape), zero], axis=2)
        size = np.sqrt(k)
        zeta, slide = size * np.sqrt(self.smooth)[:, None] * taken[:, 1], size * jump[:, 0]
        return move, [(force[:, 1], jump[:, 1]), (force[:, 0], jump[:, 0]), (zeta, zeta), (slide, slide)]

    def _energy_program(self, theta: float, k: float, move: Floats, pairs: Sequence[tuple[Floats, Floats]]) -> Program:
        """The program of the least square of the factor, one block of four rows for each wave number."""
        waves, spread = len(move), lambda rows: block_diag(*rows[:, None])
        left, right = (np.vstack([spread(pair[i]) for pair in pairs]) for i in (0, 1))
        rho = 1 / min(
            np.linalg.eigvals(np.linalg.solve(_matrices(self.neumann), _matrices(self.contact))).real.min(), 1
        )
        b = 0.1 / (k * float(self.contact[0].max()))
        tau = 4 * theta**2 * (1 + rho)
        return Program(
            fixed=block_diag(*(-move.transpose(0, 2, 1) @ move)),
            free=block_diag(*[np.diag([1.0, 1.0, 0.0, 0.0])] * waves),
            left=left,
            right=right,
            tie=np.repeat(np.eye(4), waves, axis=0),
            cones=np.array([[1, 2, 3]]),
            most=np.full(4, np.inf),
            s=1e4,
            y=np.array([tau, tau, tau / b, tau * b]),
            blocks=tuple(slice(4 * i, 4 * i + 4) for i in range(waves)),
        )

    @property
    def friction_threshold(self) -> float:
        """The friction below which every small theta contracts, and above which the search finds none that does."""
        return self.allowed((0.0, 1.0)).friction


def _least_squares(move: Floats, pairs: Sequence[tuple[Floats, Floats]], multipliers: Floats) -> Floats:
    """For each wave number the least square of a factor that multipliers prove; inf where they prove none."""
    form = move.transpose(0, 2, 1) @ move
    for multiplier, (a, b) in zip(multipliers, pairs, strict=True):
        form += multiplier * (a[:, :, None] * b[:, None] + b[:, :, None] * a[:, None]) / 2
    own, mixed, rest = form[:, :2, :2], form[:, :2, 2:], -form[:, 2:, 2:]
    least = np.linalg.eigvalsh(own + mixed @ np.linalg.solve(rest, mixed.transpose(0, 2, 1)))[:, -1]
    return np.where(np.linalg.eigvalsh(rest)[:, 0] > 0, least, np.inf)


def comparable(layers: TwoLayers) -> TwoLayers:
    """The layers; HypothesisError where stiffnesses or lengths differ too much for doubles."""
    both = (layers.contact, layers.neumann)
    lengths = [*(strip.thickness for strip in both), layers.radius]
    for name, values in (("young", [strip.body.shear for strip in both]), ("depth, radius", lengths)):
        if max(values) > RATIO * min(values):
            raise HypothesisError(name, ", ".join(str(float(value)) for value in values), f"ratios up to {RATIO:g}")
    return layers


def _layer(strip: Strip, xi: Floats, *, side: int) -> Symmetric:
    """The flexibility of a layer for wave numbers > 0."""
    x = xi * float(strip.thickness)
    fading = np.exp(-2 * x)
    kappa, scale = float(strip.body.kappa), float(strip.body.shear) * xi
    form = symbols(kappa, (1 - fading**2) / 2, (np.expm1(-2 * x) / 2) ** 2, x * fading, x**2 * fading)
    return flexibility([scale * entry for entry in form], side=side)


def _matrices(form: Symmetric) -> Floats:
    """Symmetric matrices of two rows, one for each wave number."""
    along, across, mixed = form
    return np.array([[along, mixed], [mixed, across]]).transpose(2, 0, 1)


def best_up_to(largest: float, factor: Callable[[float], float], near: float) -> float:
    """The theta <= ``largest`` with the least factor, in three digits, to ``near`` or a tenth of ``largest``."""
    options = {"xatol": min(near, largest / 10)}
    found = minimize_scalar(factor, bounds=(0.0, largest), method="bounded", options=options)
    return min(float(f"{found.x:.3g}"), largest)


def drawn_in(
    at: Callable[..., tuple[Floats, Floats]],
    centre: Sequence[float],
    widths: Sequence[float],
    points: Sequence[int],
    limits: Sequence[tuple[float, float]],
) -> list[Floats]:
    """The point with the largest product of alpha and beta, on grids that are drawn in on their best point."""
    for _ in range(TIMES):
        axes = [
            np.linspace(c - w, c + w, n).clip(*limit)
            for c, w, n, limit in zip(centre, widths, points, limits, strict=True)
        ]
        alpha, beta = at(*np.meshgrid(*axes, indexing="ij", sparse=True))
        best = alpha * beta if alpha.max() > 0 else alpha  # nothing is allowed yet: where the least is missing
        centre = [axis[i] for axis, i in zip(axes, np.unravel_index(int(best.argmax()), best.shape), strict=True)]
        widths = [DRAWN_IN * width for width in widths]
    return [np.asarray(c) for c in centre]


def least_ratio(over: tuple[Any, Any, Any], under: tuple[Any, Any, Any]) -> Floats:
    """The least ratio of two quadratic polynomials in Bernstein's form (ends, middle) on [0, 1], the second one > 0."""
    with np.errstate(all="ignore"):
        f, g, m, p, q, r = np.broadcast_arrays(*over, *under)
        best = np.asarray(np.minimum(np.where(p > 0, f / p, np.where(f < 0, -np.inf, np.inf)), g / q))
        inner = ~((r > 0) & (m / r >= best))  # elsewhere an end is the least: the ratio is a mean of the three
        f, g, m, p, q, r = (each[inner] for each in (f, g, m, p, q, r))
        a, b, c = g * r - m * q, g * p - f * q, m * p - f * r  # of its derivative, in t = u/(1 - u)
        half = -(b + np.copysign(np.sqrt(np.maximum(b**2 - 4 * a * c, 0)), b)) / 2
        for t in (half / a, c / half):
            value = (f + 2 * m * t + g * t**2) / (p + 2 * r * t + q * t**2)
            best[inner] = np.where((t > 0) & np.isfinite(value), np.minimum(best[inner], value), best[inner])
    return best


def _least(missing: Callable[[float], float], low: float, high: float, near: float = NEAR) -> float | None:
    """The least value from which on something that grows is >= 0, on the safe side; None where it is nowhere."""
    missing = cache(missing)  # the search for a zero begins and ends where it was asked already
    if missing(high) < 0:
        return None
    if missing(low) >= 0:
        return low
    found = brentq(missing, low, high, xtol=near)
    while missing(found) < 0:
        found = min(found + near, high)
    return float(found)
