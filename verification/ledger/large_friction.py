"""Failure of the printed (5.30) on any pair of bodies: much friction, a unit of stress in which m is a small number.

All nodes are open and slide one way, for loads that are put on the contact body, without a gap.  There the friction
term grows as k^2; the printed bound grows as k where the unit makes its bracket 1 (``docs/theory.md``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial

import numpy as np
from scipy.linalg import eigh

from fem1d2d.mesh import Floats
from verification.interface.pair import ContactPair
from verification.ledger.cases import three_digits
from verification.ledger.differences import Difference, DrawnSetting, along, between, uniform_piece
from verification.ledger.evidence import Evidence, Level, Watch, figure, source
from verification.ledger.inequalities import SEED, Reading
from verification.ledger.worst import Trial, draw_cases
from verification.semidefinite.losses import square
from verification.semidefinite.neighbours import answers

#: Random problems, beside the named ones.
COUNT: dict[str, int] = {"quick": 6, "full": 60}

#: Friction over that from which each bound is exceeded where the bracket is 1: both sides then differ by this factor.
BEYOND = 4

#: C_K and the rest of the printed bracket in the unit that is chosen, beside its 1.
BRACKET = 1e-3

#: Half the distance of the two forces over their size: far too little to change a state whose inequalities are strict.
STEP = 1e-4


@dataclass(frozen=True, kw_only=True)
class Witness:
    """Two forces that violate the printed inequality, for loads made for them.

    ``name`` names the problem; ``reading`` has the constants, as repaired, in the chosen unit: all stresses are
    multiplied by ``unit``.
    """

    name: str
    difference: Difference
    reading: Reading
    friction: float
    unit: float

    def ratios(self, *, printed: bool) -> dict[str, float]:
        """Left over right of each inequality, as printed or as repaired: theta just below C_0, in (5.39) C_0.

        (5.32), (5.33) and (5.36) are the same where m is below 1.  Negative terms change sides first.
        """
        d, r = self.difference, self.reading.printed if printed else self.reading
        e2, t2 = d.norm**2 * self.unit, d.norm_T**2 * self.unit
        work, friction = d.inner * self.unit, d.friction * self.unit
        below, at = 0.99 * r.C_0, r.C_0
        step = lambda theta: theta**2 * t2 + (1 - theta) ** 2 * e2 + 2 * theta * (1 - theta) * work
        of_step = (step(below) - min(r.weight(below), 0.0) * t2) / (r.h_2(below) * e2)
        return {
            "5.30": friction / (r.P * e2),
            "5.31": (max(work, 0.0) + r.give * t2) / (r.P * e2 + max(-work, 0.0)),
            **dict.fromkeys(("5.32", "5.33", "5.36"), of_step),
            "5.39": step(at) / (r.h_2(at) * e2),  # h_1(C_0) = h_2(C_0)
            "5.44": step(below) / (r.h_2(below) * e2),
        }


IDS = ("5.30", "5.31", "5.32", "5.33", "5.36", "5.39", "5.44", "x-printed-false-everywhere")


def loaded(pair: ContactPair, g: Floats, v: Floats, force: Floats) -> ContactPair:
    """The same bodies, the contact body loaded so that step II answers g with the jump v and the reaction ``force``.

    ``l_1 = force + S_1 (u_2 + offset + v)``, applied as forces on the contact nodes: condensation changes none of them.
    g acts on the grid of the Neumann body; v and the reaction, on the contact grid, must obey step II.
    """
    neumann, contact = pair.neumann, pair.contact
    u = pair.interface.carry(neumann.known + neumann.flexibility(g + neumann.load)) + v + pair.offset
    return replace(pair, contact=replace(contact, load=force + contact.schur @ u), problem=None)


def witness(case: Trial, random: np.random.Generator) -> Witness:
    """Friction, a unit, loads and two forces that violate the printed inequality; the problem has a law of friction."""
    one = case.measured.with_friction(1.0)
    reading = Reading.of(one)
    steep = reading.C_K * reading.M**2 / reading.m**3  # of the printed bound in k, where the bracket is 1
    first = DrawnSetting(pair=_with_friction(case.pair, Fraction(1)))
    piece = uniform_piece(first.pair, touching=False, sliding=1)
    T, felt = answers(piece).force.T, case.pair.neumann.grid
    y = eigh(square(T, first.forms.inverse))[1][:, -1]
    unit_step = along(first, piece, y)  # |y| = 1: e = 1; F = alpha k^2 + gamma k, W = gamma k, t^2 = beta k^2
    gamma, beta = unit_step.work, unit_step.norm_T**2
    alpha = unit_step.friction - gamma
    least = max((steep + abs(gamma)) / alpha, (steep + abs(gamma)) / (reading.give * beta))
    k = three_digits(BEYOND * least)
    pair = _with_friction(case.pair, k)
    reading = Reading.of(case.measured.with_friction(float(k)))
    unit = BRACKET / (reading.A + 2 * reading.C_K + reading.m)  # sqrt(m x) <= m + x
    setting, grid = DrawnSetting(pair=pair), pair.contact.grid
    g = np.concatenate([random.uniform(-1, 1, felt.t), random.uniform(0.5, 1, felt.n)])
    length = STEP * np.abs(g[felt.normal]).min() / np.abs(setting.forms.root @ y).max()
    change = along(setting, uniform_piece(pair, touching=False, sliding=1), length * y)
    # nodes slide and are open by more than the two forces change
    far = np.linalg.norm(g) / np.linalg.norm(pair.contact.schur, 2)
    far = max(far, np.abs(change.d_1 - pair.interface.carry(change.d_2)).max() / STEP)
    jump = far * np.concatenate([random.uniform(0.5, 1, grid.t), -random.uniform(0.5, 1, grid.n)])
    pair = loaded(pair, g, jump, np.concatenate([pair.bound(g), np.zeros(grid.n)]))
    difference = between(DrawnSetting(pair=pair), g + change.force, g - change.force)
    return Witness(name=case.name, difference=difference, reading=reading.in_unit(unit), friction=float(k), unit=unit)


def _with_friction(pair: ContactPair, k: Fraction) -> ContactPair:
    """The same bodies at another friction, without a gap."""
    interface = replace(pair.interface, gap=np.zeros(pair.contact.grid.n))
    return replace(pair.at(friction=k), interface=interface, problem=None)


def witnesses(level: Level, watch: Watch) -> list[Witness]:
    """Break what is printed on each of some problems, on 6 random ones or, at full, 60."""
    cases = [(case, random) for case, random in draw_cases(COUNT[level]) if case.measured.of_friction]
    found: list[Witness] = []
    for case, random in cases:
        watch(len(found) / len(cases))
        found.append(witness(case, random))
    return found


def _evidence(id: str, found: Sequence[Witness]) -> list[Evidence]:
    everywhere = id.startswith("x-")
    of_all = [w.ratios(printed=True) for w in found]
    printed = [min(r.values()) if everywhere else r[id] for r in of_all]
    repaired = max(max(r.values()) if everywhere else r[id] for r in (w.ratios(printed=False) for w in found))
    # the forces differ little, so that a quotient is right to about four digits; equal ones: the first stays
    worst = int(np.argmax([figure(value, 2) for value in printed]))
    differ = sum(not w.difference.setting.pair.interface.one_grid for w in found)
    problems = f"{len(found)} problems, of which {differ} have grids that differ"
    count = {"seed": SEED, "problems": len(found), "pairs": len(found), "grids_differ": {"problems": differ}}
    data = {
        **count,
        "least_ratio": figure(min(printed), 2),
        "worst_ratio": figure(printed[worst], 2),
        "where": found[worst].name,
        "friction": figure(found[worst].friction, 3),
        "unit": figure(found[worst].unit, 3),
    }
    state = "all nodes open and sliding one way for loads of their own, no gap, much friction, a unit with small m"
    of_printed = f"{state}: left/right from {min(printed):.2g} to {max(printed):.2g} on {problems}"
    if everywhere:
        return [Evidence(method="discrete", of="printed", holds=min(printed) > 1, text=of_printed, data=data)]
    of_repaired = f"the same pairs, repaired: left/right <= {repaired:.2g} on {problems}"
    more = {**count, "worst_ratio": figure(repaired, 2)}
    return [
        Evidence(method="discrete", of="printed", holds=min(printed) <= 1, text=of_printed, data=data),
        Evidence(method="discrete", of="repaired", holds=repaired <= 1, text=of_repaired, data=more),
    ]


#: Evidence that the printed bound fails on any pair of bodies.
large_friction = source({id: partial(_evidence, id) for id in IDS}, witnesses)
