"""Section 5 for two forces on measured bodies: each inequality as two sides, and pairs of forces to put in."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from dense_oracle import DensePair
from hypothesis import strategies as st
from problem_list import bars, blocks

import verification as vf
from ndtheory import REPAIRED, evaluate
from verification.algorithm.fixed_point import FixedPointMap
from verification.contact import ContactError
from verification.interface.pair import pair_from

EPS = np.finfo(float).eps

#: Relative error granted to a right-hand side: its constants are eigenvalues, right to this much (test_constants).
RELATIVE = 1e-9


@dataclass(frozen=True, kw_only=True)
class Constants:
    """m, M, C_R and C_K as an inequality reads them; u is the stress that (5.30) takes for 1 where it lost 1/m."""

    m: float
    M: float
    C_R: float
    C_s: float
    C_tr: float
    k: float
    u: float

    @property
    def C_K(self) -> float:
        return self.k * self.C_s * self.C_tr

    @property
    def sum(self) -> float:
        """``M C_R + C_K + sqrt(C_K m)``."""
        return self.M * self.C_R + self.C_K + np.sqrt(self.C_K * self.m)

    @property
    def C_T(self) -> float:
        """(5.16); (5.35) where m is m~."""
        return self.M * self.C_R / self.m**2 * self.sum

    @property
    def friction_term(self) -> float:
        """What follows ``2 theta (1 - theta)`` in (5.36); repaired it has a further 1/m in its first part."""
        return self.M**2 / self.m * (self.C_K * self.C_T / (self.M * self.C_R * self.u) + self.C_K / self.m**2)

    @property
    def C0(self) -> float:
        """(5.37)."""
        return 2 * self.m**2 / (self.M**2 * self.C_R**2 + 2 * self.m**2)

    def weight(self, theta: float) -> float:
        """The coefficient of ``|||T psi - T psi~|||^2`` in (5.36)."""
        return theta**2 - 2 * theta * (1 - theta) * (self.m / (self.M * self.C_R)) ** 2

    def h1(self, theta: float) -> float:
        """After (5.39)."""
        return self.weight(theta) * (self.C_T * self.M / self.m) ** 2 + self.h2(theta)

    def h2(self, theta: float) -> float:
        """(5.45)."""
        return (1 - theta) ** 2 + 2 * theta * (1 - theta) * self.friction_term

    @property
    def printed(self) -> Constants:
        """From (5.34) on: m~ for m."""
        return replace(self, m=min(self.m, 1.0), u=1.0)


class Case:
    """A problem with its dense matrices, its measured constants and T."""

    def __init__(self, problem: vf.Problem) -> None:
        self.pair = pair_from(problem)
        self.dense = DensePair.of(self.pair)
        self.measured = vf.measure(self.pair)
        one, two = self.dense.contact, self.dense.neumann
        self.S1, self.N1, self.l1 = one.S, one.N, one.condensed_load
        self.S2, self.N2, self.l2 = two.S, two.N, two.condensed_load
        self.flexibility, self.dual, self.P = np.linalg.inv(two.S), np.linalg.inv(two.E), self.dense.P
        gap = float(problem.contact.gap)
        self.gap = np.concatenate([np.zeros(self.dense.t), np.full(len(self.S1) - self.dense.t, gap)])
        self.step_from = FixedPointMap(self.pair, "active-set")

    @cached_property
    def constants(self) -> Constants:
        value = self.measured
        return Constants(
            m=value.m.value,
            M=value.M.value,
            C_R=value.C_R.value,
            C_s=value.C_s.value,
            C_tr=value.C_tr.value,
            k=self.dense.friction,
            u=value.m.value,
        )

    def T(self, psi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The forces of body 1 at the contact nodes, of which T psi is P' times, and w^1 - P w^2 - gap there."""
        try:
            _, solution = self.step_from(psi)
        except ContactError:
            _, solution = FixedPointMap(self.pair, "cvxpy")(psi)
        return solution.force, solution.v

    @cached_property
    def scale(self) -> float:
        """|||.||| of the forces that the loads and the gap bring up; or of 1 % of strain if none do."""
        u = np.abs(self.P @ self.flexibility @ self.l2) + self.gap
        forces = (np.abs(self.P.T) @ (np.abs(self.S1) @ u + np.abs(self.l1)), np.abs(self.l2))
        spec = self.pair.problem.body1
        natural = float(np.sqrt(np.diag(self.S2).max()) * (spec.x[1] - spec.x[0])) / 100
        return max(self.norm(f) for f in forces) or natural

    @cached_property
    def condition(self) -> float:
        """How much S_1 may magnify rounding."""
        return float(np.linalg.cond(self.S1))

    def norm(self, psi: np.ndarray) -> float:
        """(5.21)."""
        return float(np.sqrt(psi @ self.flexibility @ psi))

    def dual_norm(self, psi: np.ndarray) -> float:
        """The supremum of ``<psi, v>/||v||`` over V^2."""
        return float(np.sqrt(psi @ self.dual @ psi))

    def rounding(self, psi: np.ndarray, v: np.ndarray) -> np.ndarray:
        """How much rounding may change each force of body 1: some units in the last place of all that it adds."""
        u = np.abs(self.P) @ np.abs(self.flexibility @ (psi + self.l2))
        felt = np.abs(self.P) @ np.abs(psi)
        return 32 * EPS * (np.abs(self.S1) @ (u + self.gap + np.abs(v)) + np.abs(self.l1) + felt)


class TwoForces:
    """psi and psi~, all that Section 5 compares of them, and what of it may be rounding."""

    def __init__(self, case: Case, psi: np.ndarray, other: np.ndarray) -> None:
        t, w, normal = case.dense.t, case.dense.weights, case.pair.neumann.grid.normal
        (image, v), (other_image, other_v) = case.T(psi), case.T(other)
        self.case, self.d, self.forces = case, psi - other, image - other_image
        self.dT = case.P.T @ self.forces
        self.d2 = case.flexibility @ self.d  # trace of w^2 - w~^2, by (5.6)
        self.dv = v - other_v
        self.d1 = case.P @ self.d2 + self.dv
        self.size1, self.size2 = np.sqrt(self.d1 @ case.N1 @ self.d1), np.sqrt(self.d2 @ case.N2 @ self.d2)
        self.norm, self.dual = case.norm(self.d), case.dual_norm(self.d)
        self.norm_T, self.dual_T = case.norm(self.dT), case.dual_norm(self.dT)
        self.energy1 = self.d1 @ case.S1 @ self.d1
        stress, other_stress = np.abs(case.dense.hat @ psi[normal]), np.abs(case.dense.hat @ other[normal])
        jumps = np.abs(v[:t]) - np.abs(other_v[:t])
        wk = case.dense.friction * w[:t]
        #: ``- int k (|S sigma_N| - |S sigma~_N|) (|[w_T]| - |[w~_T]|)``, the integral by the trapezoid rule.
        self.friction = -float(np.sum(wk * (stress - other_stress)[:t] * jumps))

        error = case.rounding(psi, v) + case.rounding(other, other_v)
        slip = 32 * EPS * max(np.abs(v).max(), np.abs(other_v).max(), np.abs(self.d2).max())
        u = np.abs(case.flexibility @ psi) + np.abs(case.flexibility @ other)
        moved = np.full(len(v), slip) + 32 * EPS * np.abs(case.P) @ u
        returned = np.abs(case.P.T) @ error
        self.rounding = {
            "force": case.norm(returned),
            "dual": case.dual_norm(returned),
            "trace": case.condition * np.sqrt(moved @ case.N1 @ moved),
            "friction": case.condition * float(np.sum(wk * (stress + other_stress)[:t])) * slip,
            "work": float(error @ np.abs(self.dv)) + case.condition * slip * float(np.sum(np.abs(self.forces))),
        }

    def relaxed(self, theta: float) -> float:
        """``|||T_theta psi - T_theta psi~|||``."""
        return self.case.norm(theta * self.dT + (1 - theta) * self.d)


root = lambda square: np.sqrt(max(square, 0.0))

#: Left side, right side, rounding of the left one. Energies are compared by their roots.
Inequality = Callable[[Constants, TwoForces, float], tuple[float, float, float]]
INEQUALITIES: dict[str, Inequality] = {
    "(5.11)": lambda c, p, theta: (
        p.size1,
        ((c.M * c.C_R + c.C_K) / c.m + np.sqrt(c.C_K / c.m)) * p.size2,
        p.rounding["trace"],
    ),
    "(5.12)": lambda c, p, theta: (-p.forces @ p.dv, p.friction, p.rounding["work"] + p.rounding["friction"]),
    "(5.13)": lambda c, p, theta: (p.friction, c.C_K * (p.size1 * p.size2 + p.size2**2), p.rounding["friction"]),
    "(5.16)": lambda c, p, theta: (p.dual_T, c.C_T * p.dual, p.rounding["dual"]),
    "(5.18)": lambda c, p, theta: (p.dual_T, c.M * c.C_R * p.size1, p.rounding["dual"]),
    "(5.19)": lambda c, p, theta: (p.size2, p.dual / c.m, 0.0),
    "(5.22)": lambda c, p, theta: (p.norm, p.dual / np.sqrt(c.m), 0.0),
    "(5.23)": lambda c, p, theta: (p.dual, c.M / np.sqrt(c.m) * p.norm, 0.0),
    "(5.29)": lambda c, p, theta: (
        c.m / (c.M * c.C_R) * p.norm_T,
        root(p.energy1),
        c.m / (c.M * c.C_R) * p.rounding["force"],
    ),
    "(5.30)": lambda c, p, theta: (
        p.friction,
        c.C_K / c.m**2 * (c.sum / c.u + 1) * c.M**2 / c.m * p.norm**2,
        p.rounding["friction"],
    ),
    "(5.36)": lambda c, p, theta: (
        p.relaxed(theta),
        root(c.weight(theta) * p.norm_T**2 + c.h2(theta) * p.norm**2),
        p.rounding["force"],
    ),
    "(5.39), (5.44)": lambda c, p, theta: (
        p.relaxed(theta),
        root(c.h1(theta) if theta >= c.C0 else c.h2(theta)) * p.norm,
        p.rounding["force"],
    ),
}
FROM_5_34 = ("(5.36)", "(5.39), (5.44)")


def ratio(name: str, constants: Constants, forces: TwoForces, theta: float) -> float:
    """Left side over right side, rounding taken off; 0 where the left side is not positive."""
    left, right, rounding = INEQUALITIES[name](constants, forces, theta)
    left -= rounding
    if not left > 0:
        return 0.0
    return left / right if right > 0 else float("inf")


def ratios(case: Case, forces: TwoForces, theta: float) -> dict[str, float]:
    """Every inequality in its repaired form, and as printed where m >= 1."""
    c = case.constants
    found = {name: ratio(name, c, forces, theta) for name in INEQUALITIES}
    if c.m >= 1:
        found["(5.30) printed"] = ratio("(5.30)", replace(c, u=1.0), forces, theta)
        found |= {f"{name} printed": ratio(name, c.printed, forces, theta) for name in FROM_5_34}
    return found


def assert_all_hold(found: dict[str, float]) -> None:
    assert {name: value for name, value in found.items() if value > 1 + RELATIVE} == {}


# --- pairs of forces --------------------------------------------------------------------------------------------------


def directions(case: Case, random: np.random.Generator) -> np.ndarray:
    """A force of size 1 in (5.21): rough, smooth, or even over all modes."""
    n, kind = len(case.S2), random.integers(3)
    noise = random.standard_normal(n)
    force = (noise, case.S2 @ np.cumsum(noise), np.linalg.cholesky(case.S2) @ noise)[kind]
    return force / case.norm(force)


def one_node(case: Case, psi: np.ndarray, step: np.ndarray) -> np.ndarray:
    """psi + step at one component only: where step is largest."""
    return psi + np.where(np.abs(step) == np.abs(step).max(), step, 0.0)


def same_normal(case: Case, psi: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Equal normal parts: the friction bounds agree (in 1D: one force)."""
    grid = case.pair.neumann.grid
    return np.concatenate([(psi + step)[grid.tangential], psi[grid.normal]])


def pressing(case: Case, psi: np.ndarray) -> np.ndarray:
    """All normal parts compressive."""
    grid = case.pair.neumann.grid
    return np.concatenate([psi[grid.tangential], np.abs(psi[grid.normal])])


PAIRS: dict[str, Callable[[Case, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]] = {
    "any": lambda case, psi, step: (psi, step),
    "neighbouring": lambda case, psi, step: (psi, psi + step / 100),
    "opposite": lambda case, psi, step: (psi, -psi),
    "enormous": lambda case, psi, step: (1e4 * psi, 1e4 * (psi + step)),
    "differing at one node": lambda case, psi, step: (psi, one_node(case, psi, step)),
    "differing tangentially": lambda case, psi, step: (psi, same_normal(case, psi, step)),
    "pressing": lambda case, psi, step: (pressing(case, psi), pressing(case, psi + step)),
    "pulling": lambda case, psi, step: (-10 * pressing(case, psi), -10 * pressing(case, psi + step)),
}


def draw_pair(case: Case, kind: str, random: np.random.Generator) -> TwoForces:
    """Forces from a tenth to ten times those that the loads bring up."""
    psi, step = (case.scale * 10 ** random.uniform(-1, 1) * directions(case, random) for _ in range(2))
    return TwoForces(case, *PAIRS[kind](case, psi, step))


def thetas_for(case: Case, random: np.random.Generator) -> list[float]:
    """Over (0, 1) and on both sides of C_0."""
    C0 = case.constants.C0
    return [float(random.uniform(0, 1)), 0.999, C0 * float(random.uniform(0, 1)), min(C0 * 1.5, 0.99)]


def with_friction(case: Case, k: float) -> Case:
    problem = case.pair.problem
    return Case(problem.rubbing(Fraction(k)))


def threshold(case: Case) -> float | None:
    """C_2 of the repaired edition, on k; None where any friction is below."""
    C2 = evaluate(REPAIRED, case.measured.constants()).C2
    return None if C2 is None else C2.value


seeds = st.integers(0, 2**32 - 1).map(np.random.default_rng)
#: As the file says, or this share of the threshold C_2.
frictions = st.one_of(st.none(), st.none(), st.sampled_from([0.0, 0.5, 0.99, 3.0]))


def case_at_friction(data: dict[str, Any], share: float | None) -> Case:
    case = Case(vf.Problem.from_dict(data))
    C2 = None if share is None else threshold(case)
    return case if C2 is None else with_friction(case, share * C2)


# --- a search for the worst pair --------------------------------------------------------------------------------------


def plates(moved: Sequence[Any] = (0, "-1/100"), contact: Mapping[str, Any] | None = None, **given: Any) -> Case:
    """Two plates of equal width, the upper one moved at its top."""
    shape = {"heights": ("1/4", "1/4"), "young": (1, 1)} | given
    contact = {"friction": "0.3", "radius": "1/2"} | (contact or {})
    return Case(vf.Problem.from_dict(blocks(**shape, body2={"prescribed": {"top": list(moved)}}, contact=contact)))


def short_bars(young1: int = 1, young2: int = 1) -> Case:
    """Two bars pressed together."""
    lengths, pushed = (Fraction(1, 100), Fraction(1, 20)), {"prescribed": {"right": Fraction(-1, 2000)}}
    start = -lengths[0]
    return Case(vf.Problem.from_dict(bars(lengths, (young1, young2), (1, 1), start, body2=pushed)))
