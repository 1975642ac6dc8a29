"""A bound, a rule and a law that no module of the packages has: what is registered must be enough to show them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

import verification as vf
from ndtheory import Number
from verification.bounds.bound import Bound, BoundResult
from verification.bounds.table import Energy


class Halfway(Bound):
    """Half way between 1 and the factor in energy norms: true wherever that is."""

    name, words, colour, fill = "halfway", "half way to energy norms", "#CC79A7", "#F3D9E8"
    factor = 0.5

    def evaluate(self, subject, theta=None, *, progress=lambda *told: None):
        found = Energy().evaluate(subject, theta)
        if found.factor is None:
            return replace(found, name=self.name, detail=None)
        q = 1 - self.factor * (1 - found.factor.value)
        numbers = {"factor": Number.of_float(q), "one_minus_factor": Number.of_float(1 - q)}
        return replace(found, name=self.name, detail=None, **numbers)


class TooGood(Halfway):
    """A factor that runs exceed."""

    name, factor = "too good", 3.3


class Finding(TooGood):
    """The same, of which a step beyond it is a finding."""

    name, finding = "finding", True


class Slow(Halfway):
    """The same as a bound that takes the matrices of a pair."""

    name, calculated = "slow", False


class Silent(Bound):
    """A bound that applies to nothing."""

    name, words, colour = "silent", "no bound", "#000000"

    def evaluate(self, subject, theta=None, *, progress=lambda *told: None) -> BoundResult:
        return self.absent("made up: it applies to nothing")


@dataclass(frozen=True)
class Cautious(vf.Rule):
    """Half of every step with theta."""

    name, words = "cautious", "half steps"

    def begin(self, pair, theta, rho):
        return lambda iterate: iterate.g + theta / 2 * (iterate.image - iterate.g)

    def outside(self, friction):
        return "half steps: nothing is proved of them"


@dataclass(frozen=True, kw_only=True)
class Exponential(vf.Law):
    """``(S f)_j = sum_i f_i exp(-|x_j - x_i|/r) / (2 r)``."""

    name, label, needs_radius = "made-up", "exponential", True
    radius: float

    @classmethod
    def of(cls, radius):
        return None if radius is None else cls(radius=float(radius))

    @property
    def words(self):
        return f"exponential, r = {self.radius:g}"

    def operator(self, interface):
        t = np.abs(interface.contact.x[:, None] - interface.neumann.x[None, :])
        return np.exp(-t / self.radius) / (2 * self.radius)

    def scaled(self, length):
        return Exponential(radius=self.radius * length)
