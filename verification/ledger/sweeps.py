"""Runs of the Section 6 model over theta, mesh, friction, moduli and roles, with the stopping test of 6.3."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np

from fem1d2d.mesh import Floats
from verification.algorithm.fixed_point import FixedPointMap
from verification.constants import measure
from verification.contact import ContactError
from verification.interface.assembly import build
from verification.interface.pair import ContactPair
from verification.ledger.evidence import Level, figure
from verification.problem import Problem, load

Neumann = Literal[1, 2]
Top = Literal["held", "free"]

#: The test of Section 6.3.
STOP = 1e-9

#: Beyond so many steps a theta is no candidate for the best one.
MOST_STEPS = 150

#: A run without a new least residual over so many steps is given up.
PATIENCE = 40

#: theta moves in such steps; a best theta that moves by no more has not moved.
STEP = Fraction(1, 20)

#: Results are the same below this relative difference.
SAME = 1e-8

#: Where the upper body, 1.2 long, may sit on the lower one, 2 long.
GEOMETRIES = {
    "centred": (Fraction(2, 5), Fraction(8, 5)),
    "left edges aligned": (Fraction(0), Fraction(6, 5)),
    "right edges aligned": (Fraction(4, 5), Fraction(2)),
}
#: Those whose best theta is asked for; the third mirrors the second.
TWO = ("centred", "left edges aligned")

#: Radius of the kernel of S: at least the width of a cell of every mesh.
RADIUS = Fraction(1, 5)

HARD, SOFT = Fraction(70000), Fraction(20000)


@dataclass(frozen=True, kw_only=True)
class Model:
    """A reading of Section 6.1.

    Attributes
    ----------
    geometry : str
    neumann : {1, 2}
        1 as in Section 6, 2 as in Section 3.
    young : pair of Fraction
        E1 of the lower, E2 of the upper body, MPa.
    friction : Fraction
    halvings : int
        Of the mesh with 10 x 2 and 6 x 2 cells, 54 nodes.
    top : 'held' or 'free'
        Whether u_x = 0 on the top.
    """

    geometry: str = "centred"
    neumann: Neumann = 1
    young: tuple[Fraction, Fraction] = (HARD, SOFT)
    friction: Fraction = Fraction(1, 5)
    halvings: int = 1
    top: Top = "held"

    @property
    def problem(self) -> Problem:
        """The problem, from the built-in file."""
        base = load(Path(__file__).parents[1] / "data" / "section6.toml")
        side, down = (Fraction(0) if self.top == "held" else None), base.body2.prescribed["top"][1]
        lower = replace(base.body1, cells=(10, 2), young=self.young[0])
        upper = replace(
            base.body2, x=GEOMETRIES[self.geometry], cells=(6, 2), young=self.young[1], prescribed={"top": (side, down)}
        )
        contact = replace(base.contact, friction=self.friction, radius=RADIUS)
        iteration = replace(base.iteration, neumann_body=self.neumann)
        return replace(base, body1=lower, body2=upper, contact=contact, iteration=iteration).refined(self.halvings)


@dataclass(frozen=True, kw_only=True)
class Count:
    """Steps to the stopping test, and to the same bound on the unrelaxed residual; fractions by interpolation.

    None where it was not reached in ``MOST_STEPS``.
    """

    increment: float | None
    residual: float | None


def steps_to(values: Sequence[float], bound: float = STOP) -> float | None:
    """Where a sequence first falls to a bound, interpolated logarithmically, so that no two thetas tie."""
    for n, value in enumerate(values):
        if value <= bound:
            if n == 0 or value <= 0:
                return float(n)
            before = values[n - 1]
            return n - 1 + math.log(before / bound) / math.log(before / value)
    return None


@dataclass(frozen=True, kw_only=True, eq=False)
class Trace:
    """A run of (4.9) from g = 0, with the Euclidean norms of Section 6.3.

    Attributes
    ----------
    g : list of array
        g_0, g_1, ..
    increments, residuals : list of float
        ``|g_n - g_{n-1}|/|g_n|`` from n = 1 on, ``|T g_n - g_n|/|T g_n|`` from n = 0 on.
    """

    g: list[Floats]
    increments: list[float]
    residuals: list[float]

    def stop(self, bound: float = STOP, *, absolute: bool = True) -> int | None:
        """n at which the printed test stops."""
        for n, relative in enumerate(self.increments, 1):
            if relative < bound or (absolute and float(np.linalg.norm(self.g[n] - self.g[n - 1])) < bound):
                return n
        return None


def trace(pair: ContactPair, theta: float, steps: int = MOST_STEPS, bound: float = STOP) -> Trace:
    """Run until the relative increment and the unrelaxed residual are at most a bound, or wander about."""
    T, size = FixedPointMap(pair, "active-set"), lambda force: float(np.linalg.norm(force))
    g = np.zeros(len(pair.neumann.load))
    result = Trace(g=[g], increments=[], residuals=[])
    least, since = math.inf, 0
    for _ in range(steps + 1):
        try:
            image = T(g)[1].force
        except ContactError:
            image = FixedPointMap(pair)(g)[1].force
        result.residuals.append(size(image - g) / size(image) if image.any() else math.inf)
        least, since = min(least, result.residuals[-1]), since + 1 if result.residuals[-1] >= least else 0
        small = bool(result.increments) and result.increments[-1] <= bound and result.residuals[-1] <= bound
        if small or since > PATIENCE:
            break
        following = theta * image + (1 - theta) * g
        result.increments.append(size(following - g) / size(following) if following.any() else math.inf)
        result.g.append(following)
        g = following
    return result


class Sweeps:
    """Numbers of steps over theta, each counted once.

    Parameters
    ----------
    level : {'quick', 'full'}
    """

    def __init__(self, level: Level) -> None:
        self.level = level
        self.pair = cache(lambda model: build(model.problem))
        self.rho = cache(lambda model: rho_of(self.pair(model)))
        self.counts = cache(self._counts)

    @property
    def halvings(self) -> int:
        """Of the mesh on which models are compared."""
        return 1 if self.level == "quick" else 2

    @property
    def thetas(self) -> list[Fraction]:
        """0.05 to 0.95; full halves the steps."""
        step = STEP if self.level == "quick" else STEP / 2
        return [n * step for n in range(1, int(1 / step))]

    def _counts(self, model: Model) -> dict[Fraction, Count]:
        """Outward from 2/(2 + rho); what takes more than twice the fewest steps so far is not followed to its end.

        Quick goes on in either direction until that happens, full tries every theta.
        """
        start, result = 2 / (2 + self.rho(model)), {}
        limit, arrived = MOST_STEPS, False
        for side in ([t for t in self.thetas if t > start], [t for t in reversed(self.thetas) if t <= start]):
            for theta in side:
                seen = trace(self.pair(model), float(theta), limit)
                count = Count(increment=steps_to([math.inf, *seen.increments]), residual=steps_to(seen.residuals))
                result[theta] = count
                if count.increment is not None and count.residual is not None:
                    limit = min(limit, math.ceil(2 * max(count.increment, count.residual)) + 5)
                    arrived = True
                elif arrived and self.level == "quick":
                    break
        return result

    def best(self, model: Model, test: Literal["increment", "residual"] = "increment") -> Best | None:
        """The theta of fewest steps; None where none arrives."""
        steps = {t: n for t, c in self.counts(model).items() if (n := getattr(c, test)) is not None}
        if not steps:
            return None
        theta = min(steps, key=steps.__getitem__)
        return Best(theta=theta, steps=math.ceil(steps[theta] - 1e-6))

    def at(self, model: Model, theta: Fraction) -> int | None:
        """Steps of the printed test, or None."""
        return trace(self.pair(model), float(theta)).stop(absolute=False)

    def serves(self, models: Sequence[Model]) -> tuple[Fraction, float]:
        """The one theta that costs least, and by which factor at worst it takes more steps than the best of a model."""
        factors = {}
        for theta in self.thetas:
            costs = []
            for model in models:
                steps = {t: c.increment for t, c in self.counts(model).items() if c.increment is not None}
                costs.append(steps[theta] / min(steps.values()) if theta in steps else math.inf)
            factors[theta] = max(costs)
        theta = min(factors, key=factors.__getitem__)
        return theta, factors[theta]

    def row(self, model: Model) -> dict[str, Any]:
        """Figures of a model."""
        best, unrelaxed, rho = self.best(model), self.best(model, "residual"), self.rho(model)
        pair = self.pair(model)
        row = {
            "geometry": model.geometry,
            "neumann_body": model.neumann,
            "E1": float(model.young[0]),
            "E2": float(model.young[1]),
            "friction": float(model.friction),
            "nodes": sum(len(body.mesh.points) for body in pair.on_meshes().elastic),
            "best_theta": None if best is None else float(best.theta),
            "iterations": None if best is None else best.steps,
            "best_theta_residual": None if unrelaxed is None else float(unrelaxed.theta),
            "iterations_residual": None if unrelaxed is None else unrelaxed.steps,
            "iterations_at_0.6": self.at(model, Fraction(3, 5)),
            "rho": figure(rho),
            "predicted_theta": figure(2 / (2 + rho)),
        }
        missing = [name for name, value in row.items() if value is None]
        return row | {"reason": dict.fromkeys(missing, f"not within {MOST_STEPS} steps")}


@dataclass(frozen=True, kw_only=True)
class Best:
    """The best of the thetas tried."""

    theta: Fraction
    steps: int


def rho_of(pair: ContactPair) -> float:
    """rho of the roles."""
    rho = measure(pair).rho_max
    assert rho is not None
    return rho.value
