"""The paper's claims about its figures, and the criteria for calling them reproduced, set before any run."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from ndtheory.keys import Part, key, says
from verification.interface.fields import ContactFields

Verdict = Literal["reproduced", "reproduced under an assumption", "undecided", "not reproduced"]

#: The theta that Section 6.3 calls the best.
PRINTED_THETA = 0.6

#: A theta serves a curve if it takes at most this many times the fewest steps.
SERVES = 1.25

#: The steps depend little on the mesh if the fewest steps on all meshes differ by at most this factor.
ALIKE = 1.5

#: The zones of Figure 5, from the left end of Gamma_c in mm; the first, "sliding", must be stick.
ZONES: tuple[tuple[str, float], ...] = (("stick", 0.6), ("slip", 1.0), ("open", math.inf))


@dataclass(frozen=True, kw_only=True)
class Claim:
    """A claim of the paper in short, and the criterion by which a reading reproduces it.

    ``axes`` maps the axes of a sweep to their values, none for Figure 5; ``labels`` name its curves, in order.
    """

    name: str
    says: str
    criterion: str
    axes: Mapping[str, Any] = field(default_factory=dict)
    labels: tuple[str, ...] = ()


NODES = (60, 190, 666, 2482)
HARD, SOFT = 70000, 20000

MODULI = ((HARD, SOFT), (SOFT, HARD), (SOFT, SOFT))

_ONE_THETA = (
    f"on every curve theta = 0.6 takes at most {SERVES:g} times the fewest steps (increment test, steps of 0.05)"
)

CLAIMS: dict[str, Claim] = {
    claim.name: claim
    for claim in (
        Claim(
            name="fig5",
            says="stick for 0 < x <= 0.6, slip for 0.6 < x < 1, no contact for x > 1 (190 nodes)",
            criterion="these zones from the left, each end within the width of a cell",
        ),
        Claim(
            name="fig10",
            says="on meshes of 60, 190, 666, 2482 nodes 0.6 is the best theta, and the steps depend little on the mesh",
            criterion=f"{_ONE_THETA}, and the fewest steps differ by a factor of at most {ALIKE:g}",
            axes={"refine": range(len(NODES))},
            labels=tuple(f"{nodes} nodes" for nodes in NODES),
        ),
        Claim(
            name="fig11",
            says="with k = 0.1, 0.2, 0.4 the best theta is always about 0.6 (190 nodes)",
            criterion=_ONE_THETA,
            axes={"refine": [1], "friction": ["0.1", "0.2", "0.4"]},
            labels=("k = 0.1", "k = 0.2", "k = 0.4"),
        ),
        Claim(
            name="fig12",
            says="with E1/E2 = 3.5, 2/7 and 1 the same kind of results (190 nodes)",
            criterion=_ONE_THETA,
            axes={"refine": [1], "young": MODULI},
            labels=tuple(f"E1 = {a:g}, E2 = {b:g}" for a, b in MODULI),
        ),
    )
}

#: The claim of Section 6.3 on the curve that Figures 10, 11 and 12 have in common.
OPTIMUM = Claim(
    name="sec-6.3",
    says="0.6 is the best theta (190 nodes, k = 0.2, E1 = 70000, E2 = 20000)",
    criterion=_ONE_THETA,
    axes={"refine": [1]},
    labels=("190 nodes",),
)


#: What the steps at the printed theta share.
IF_CONVERGED: dict[str, Any] = {"null": "where it does not converge", "why": None}


@dataclass(frozen=True, kw_only=True)
class Curve(Part):
    """Steps over theta by the increment test, and by the unrelaxed residual; None where it was not met.

    If only some theta were run, all of them may need fewer steps than ``fewest``, and each cost is a lower bound.
    """

    label: str = key("what the curve varies")
    steps: Mapping[float, int | None]
    unrelaxed: Mapping[float, int | None]
    rho: float | None = key(r"$\rho$", type="number")

    @property
    @says("by the increment test", name="fewest_steps", null="where no theta converges", why=None)
    def fewest(self) -> int | None:
        return min((n for n in self.steps.values() if n is not None), default=None)

    @property
    @says("the thetas of fewest steps", unit="1", name="best_theta", type="free")
    def best(self) -> tuple[float, ...]:
        return tuple(theta for theta, n in self.steps.items() if n is not None and n == self.fewest)

    @property
    @says(r"steps at $\theta = 0.6$ by the increment test", **IF_CONVERGED)
    def steps_at_printed(self) -> int | None:
        return self.steps.get(PRINTED_THETA)

    @property
    @says("the same by the unrelaxed residual", **IF_CONVERGED)
    def unrelaxed_at_printed(self) -> int | None:
        return self.unrelaxed.get(PRINTED_THETA)

    def cost_at(self, theta: float) -> float:
        """Steps at a theta over the fewest; inf where it does not arrive."""
        at, fewest = self.steps.get(theta), self.fewest
        return math.inf if at is None or not fewest else at / fewest

    @property
    def cost(self) -> float:
        """The cost of the printed theta."""
        return self.cost_at(PRINTED_THETA)


def curves_hold(name: str, curves: Sequence[Curve]) -> bool:
    """True if the curves of a reading meet the criterion of the figure."""
    fewest = [curve.fewest or math.inf for curve in curves]
    alike = name != "fig10" or (math.inf not in fewest and max(fewest) <= ALIKE * min(fewest))
    return alike and all(curve.cost <= SERVES for curve in curves)


def zones(contact: ContactFields) -> list[tuple[str, float, float]]:
    """Runs of nodes in one state, with x from the left end of Gamma_c; an end lies half way between nodes."""
    x = contact.x - contact.x[0]
    ends = [0.0, *((x[:-1] + x[1:]) / 2), float(x[-1])]
    found: list[tuple[str, float, float]] = []
    for state, low, high in zip(contact.status, ends[:-1], ends[1:], strict=True):
        if found and found[-1][0] == state:
            found[-1] = (state, found[-1][1], float(high))
        else:
            found.append((state, float(low), float(high)))
    return found


def zones_hold(contact: ContactFields) -> bool:
    """True if Gamma_c has the zones of Figure 5, each end within the width of a cell."""
    found, width = zones(contact), float(np.diff(contact.x).max())
    if [state for state, _, _ in found] != [state for state, _ in ZONES]:
        return False
    return all(abs(high - end) <= width for (_, _, high), (_, end) in zip(found[:-1], ZONES[:-1], strict=True))


def share_as_printed(contact: ContactFields) -> float:
    """The share of the length of Gamma_c that is in the state of Figure 5."""
    same = 0.0
    for state, low, high in zones(contact):
        before = 0.0
        for printed, end in ZONES:
            same += max(0.0, min(high, end) - max(low, before)) * (printed == state)
            before = end
    return same / float(np.ptp(contact.x))
