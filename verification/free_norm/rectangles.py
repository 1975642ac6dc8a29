"""Two rectangles in the continuum in a norm that the proof chooses: the search for multipliers, and proved numbers."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from fem1d2d.mesh import Floats
from ndtheory import Number
from ndtheory.continuum.rectangle_circle import RectangleCircle, RectangleMultipliers
from ndtheory.continuum.rectangles import ContinuumConstants, TwoRectangles
from ndtheory.keys import Part, key
from verification.free_norm.numbers import numbers, proved
from verification.free_norm.search import LEAST, Allowed, Search, drawn_in

#: Points of the grid of beta and nu, and its first half widths: of the logarithms of beta and of nu over -x_1 - 1.
GRID, WIDTHS = (9, 9), (2.0, 4.0)

#: Limits of these logarithms.  That of beta is 0 where b has a zero; near it a proof in intervals takes long.
LIMITS = ((-np.inf, -1e-2), (-9.0, 6.0))

#: The values of mu that are tried until the friction falls: it is nearly concave in mu.
SHARES = (1.0, 0.95, 0.75, 0.5, 0.25, 0.0)

#: beta is at most as many times 1/C_t1^2.
MOST = 1e3

#: As in :mod:`verification.free_norm.numbers`, without the least one: there a proof takes several seconds.
MARGINS = (1e-3, 3e-3, 8e-3, 1.6e-2)


class RectangleSearch(Search):
    """The search for multipliers of two rectangles."""

    def __init__(self, circle: RectangleCircle) -> None:
        super().__init__(circle.layers)
        self.criterion = circle
        self.circle = RectangleCircle(
            layers=circle.layers,
            C_t1_square=float(circle.C_t1_square),
            C_t2_square=float(circle.C_t2_square),
            cut_off=None if circle.cut_off is None else float(circle.cut_off),
        )

    def allowed(self, ends: tuple[float, float]) -> Allowed:
        """The largest friction allowed on the circle with some ends."""
        best = Allowed(-1.0, RectangleMultipliers(alpha=0.0, beta=0.0, nu=0.0, mu=1.0))
        if self.circle.cut_off is None:
            return best if ends[0] else self.with_share(ends, 1.0)
        for mu in SHARES:
            found = self.with_share(ends, mu)
            if found.friction < best.friction:
                break
            best = found
        return best

    def with_share(self, ends: tuple[float, float], mu: float) -> Allowed:
        """The same for one mu."""
        unit = 1 / self.circle.C_t1_square

        def by(beta: Floats, nu: Floats) -> RectangleMultipliers:
            one = RectangleMultipliers(normal=1.0, alpha=0.0, beta=unit, nu=-ends[0] * (1 + np.exp(nu)), mu=mu)
            missing = (1 - self.slack(ends, one)).max(axis=-1)  # b > 0 for every beta below unit/missing
            return replace(one, beta=np.exp(beta) * unit / np.maximum(missing, 1 / MOST))

        def at(beta: Floats, nu: Floats) -> tuple[Floats, Floats]:
            one = by(beta, nu)
            return self.alpha_by(ends, one), one.beta

        found = drawn_in(at, (-1.0, 0.0), WIDTHS, GRID if ends[0] else (GRID[0], 1), LIMITS)
        one = by(*found)
        alpha = float(self.alpha_by(ends, one))
        best = replace(one, alpha=alpha, beta=float(one.beta), nu=float(one.nu))
        return Allowed(float(np.sqrt(4 * alpha * best.beta)) if alpha > 0 else -1.0, best)

    def slack(self, ends: tuple[float, float], by: RectangleMultipliers) -> Floats:
        """``beta b`` at all wave numbers, along a last axis."""
        (low, high), nu = ends, np.asarray(by.nu)[..., None]
        sigma = np.maximum(low**2 / (low + nu) if low else 0.0, high**2 / (high + nu))
        by = replace(by, beta=np.asarray(by.beta)[..., None])
        return np.asarray(self.circle.slack(self.contact[0], self.neumann[0], by.beta, by, sigma))

    def alpha_by(self, ends: tuple[float, float], by: RectangleMultipliers) -> Floats:
        """The largest alpha for which the criterion holds at all wave numbers; -inf without one."""
        slack = self.slack(ends, by)
        over, nu = replace(by, beta=np.asarray(by.beta)[..., None]), np.asarray(by.nu)[..., None]
        form = self.circle.pencil(self.contact, self.neumann, over, 0.0, ends, np.maximum(slack, LEAST), nu)
        return np.where(slack.min(axis=-1) > 0, self.alpha_of(form, ends), -np.inf)


_proved: dict[str, Any] = {"null": "without friction, and where nothing is proved", "default": None}


@dataclass(frozen=True, kw_only=True)
class RectangleNorm(Part):
    """Guaranteed numbers of two rectangles in a norm that the proof chooses; ``reason`` says why one is None."""

    friction_threshold: Number | None = key(r"at least: every small $\theta$ contracts for smaller $k$", **_proved)
    theta_max: Number | None = key(r"at least: every $\theta$ up to it contracts at the file's friction", **_proved)
    factor: Number | None = key(r"the factor at the file's $\theta$, at most", **_proved)
    theta_best: float | None = key(r"the $\theta$ of the least factor found", **_proved)
    factor_best: Number | None = key("the factor there, at most", **_proved)
    reason: dict[str, str] = field(default_factory=dict)


#: The numbers that are about one friction.
AT_FRICTION = ("theta_max", "factor", "theta_best", "factor_best")


def rectangle_norm(
    model: TwoRectangles, constants: ContinuumConstants, friction: Fraction, theta: Fraction | None
) -> RectangleNorm:
    """Prove contraction of two rectangles by the circle criterion, from bounds of their constants.

    ``constants`` are bounds for the ``model``, ``friction`` an upper bound of k >= 0, without which nothing is
    gained, and all numbers are None; ``theta`` is where a factor is wanted.
    """
    names = ("friction_threshold", *AT_FRICTION)
    if not friction:
        return RectangleNorm(reason=dict.fromkeys(names, "without friction no norm is better than (5.21)"))
    search = RectangleSearch(RectangleCircle.of(model, constants))
    found = numbers(search, friction, theta, partial(proved, margins=MARGINS))
    if theta is None:
        found.pop("factor", None)
    known = {name: value for name, value in found.items() if getattr(value, "level", "") != "float"}
    if "factor_best" not in known:
        known.pop("theta_best", None)
    none = "at this friction no multipliers prove contraction"
    why = constants.reason.get("cut_off", "the search proves none" if "theta_max" in known else none)
    reason = dict.fromkeys(names, why) | ({"factor": "the file gives no theta"} if theta is None else {})
    return RectangleNorm(**known, reason={name: text for name, text in reason.items() if name not in known})
