"""Properties of a step T of another code."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
from hypothesis import strategies as st
from scipy.linalg import eigh

from fem1d2d.mesh import Floats
from ndtheory import evaluate_energy
from verification.algorithm.fixed_point import FixedPointMap
from verification.algorithm.theta import below_one
from verification.constants import Measured, measure
from verification.interface.build import build
from verification.interface.pair import ContactPair
from verification.semidefinite.multipliers import QuadraticForms
from verification.testing.properties import Fails, Finding, Kit, Report
from verification.testing.strategies import forces

#: A step T: from nodal forces on the Neumann body to those that the contact body answers with.
StepMap = Callable[[Floats], Floats]

#: Forces so many times as large as the others no longer feel loads and gaps.
FAR = 4.0**15

#: Steps of a run, and the relative residual to which it must fall.
MOST, ARRIVED = 2000, 1e-6

#: How often a difference of forces is sent through T to find the one that grows most.
POWER = 12


def check_step(
    T: StepMap, pair: ContactPair | None = None, *, examples: int = 20, tolerance: float = 1e-6, **matrices: Any
) -> Report:
    """Compare a step T of another code with the theorem for its matrices, and with the step of this project.

    T takes and gives nodal forces on the Neumann body (per unit thickness): all tangential components from left to
    right, then all normal ones along y, which points from body 1 to body 2.

    ``stays below its bound``
        ``|T_theta f - T_theta g| <= factor |f - g|`` in the norm (5.21), ``T_theta = theta T + (1 - theta)``, at the
        theta that is proved to be best for the matrices and at others; for random forces, and for differences that T
        itself has enlarged.  The theorem in energy norms gives the factor, or the semidefinite bound where that theorem
        draws no conclusion.
    ``converges at the advised theta``
        Asked where the theorem proves that it does: ``g <- T_theta g`` reaches a fixed point.
    ``is independent of units``
        Far from the loads ``T(4 g) = 4 T(g)``.
    ``is the step of these matrices``
        T g is what this project computes, where a pair or loads are given; else it is far from the loads.

    Parameters
    ----------
    T : callable
        From an array to an array.
    pair : ContactPair, optional
        What T belongs to, with its loads; or else
    **matrices
        What :func:`verification.build` takes: S1, S2, and what is known of load1, load2, x, weights, gap, kernel,
        transfer, friction, neumann_body.  The bound on one step does not depend on loads and gap.
    tolerance : float
        How accurately T is computed, relative to the size of the forces.
    examples : int
        Cases drawn for each property.

    Raises
    ------
    Refused
        The first property that fails.
    ValueError
        Matrices that :func:`verification.build` refuses.
    """
    if pair is None:
        n = len(matrices["S1" if matrices.get("neumann_body", 2) == 2 else "S2"]) // 2
        pair = build(**({"x": np.arange(float(n))} | matrices))
        loaded = any(matrices.get(name) is not None for name in ("load1", "load2"))
    elif matrices:
        raise ValueError(f"received a pair and {', '.join(matrices)}: needed one of them")
    else:
        loaded = True
    check = _Check(T, pair, tolerance)
    kit = Kit(f"step T on {pair.neumann.grid.n} nodes", examples)
    pushed = {"force": forces(pair), "other": forces(pair), "share": st.sampled_from([0.3, 1.0, 1.0, 1.2])}
    cases = st.fixed_dictionaries(pushed)
    below = kit.examine("stays below its bound", cases, check.stays_below)
    converges = check.converges(kit)
    units = kit.examine("is independent of units", cases, check.is_independent_of_units)
    at, where = (lambda force: force, "with its loads") if loaded else (check.far, "far from its loads")
    ours = lambda force, other, share: check.is_ours(at(force))
    same = kit.examine("is the step of these matrices", cases, ours)
    return kit.report(below, converges, units, replace(same, detail=f"{same.detail}, {where}"))


class _Check:
    """T beside the pair of its matrices."""

    def __init__(self, T: StepMap, pair: ContactPair, tolerance: float) -> None:
        self.pair, self.tolerance = pair, tolerance
        self.norm = pair.neumann.dual_norm
        self._T, self._own = T, FixedPointMap(pair)
        self.measured: Measured = measure(pair)
        constants = self.measured.energy_constants()
        if constants is None:
            raise ValueError(self.measured.why_no_energy)
        self.constants = constants
        best = evaluate_energy(constants)
        self.theta = below_one(best.theta_predicted if best.theta_proved is None else best.theta_proved)
        self.proved = best.theta_proved is not None
        self._factors: dict[Fraction, float] = {}

    def image(self, g: Floats) -> Floats:
        """T g, in the directions that the pair uses."""
        pair = self.pair
        answer = np.asarray(self._T(pair.neumann.orient(g)), dtype=float)
        if answer.shape != g.shape or not np.isfinite(answer).all():
            raise Fails(f"needed {len(g)} finite numbers, received {answer!r}")
        return pair.neumann.orient(answer)

    def factor(self, theta: Fraction) -> float:
        """A proved Lipschitz constant of T_theta."""
        if theta not in self._factors:
            energy = evaluate_energy(self.constants, theta).factor
            found = (
                energy.value if energy is not None else QuadraticForms(self.pair, self.measured).factor(float(theta))
            )
            self._factors[theta] = found if isinstance(found, float) else found.value
        return self._factors[theta]

    def stays_below(self, force: Floats, other: Floats, share: float) -> None:
        theta = below_one(share * float(self.theta))
        factor = self.factor(theta)
        norm = self.norm
        for start, difference in ((force, other), (self.pressed(force), self.steepest())):
            at = self.image(start)
            d = difference * (norm(start) / (norm(difference) or 1.0))
            for _ in range(POWER):  # T sends the difference it enlarges most to minus a multiple of itself
                change = self.image(start + d) - at
                size = norm(change) + norm(at)
                relaxed = norm(float(theta) * change + (1 - float(theta)) * d)
                if not relaxed <= factor * norm(d) + self.tolerance * (size + norm(start)):
                    raise Fails(
                        f"at theta = {float(theta):.4g} a step has the factor {relaxed / norm(d):.6g},"
                        f" proved of these matrices is {factor:.6g}"
                    )
                if not norm(change) > 0:
                    break
                d = -change * (norm(start) / norm(change))

    def pressed(self, force: Floats) -> Floats:
        """A force that presses the bodies together everywhere, as large as the given one or larger than the loads."""
        grid, neumann = self.pair.neumann.grid, self.pair.neumann
        even = np.zeros(grid.size)
        even[grid.normal] = -1.0  # displacement towards the contact body, along its normal
        pressing = neumann.schur @ even
        return pressing * max(100 * self.norm(neumann.load), self.norm(force)) / self.norm(pressing)

    def steepest(self) -> Floats:
        """The force that a pair which sticks everywhere enlarges most."""
        contact = self.pair.interface.carry_form(self.pair.contact.schur)
        neumann = self.pair.neumann.schur
        return np.asarray(neumann @ eigh(contact, neumann)[1][:, -1])

    def converges(self, kit: Kit) -> Finding:
        property = "converges at the advised theta"
        if not self.proved:
            return Finding(property=property, verdict="not asked", detail="no theta is proved of these matrices")
        theta, g = float(self.theta), np.zeros(self.pair.neumann.grid.size)
        scale = 0.0
        limit = max(ARRIVED, 10 * self.tolerance)
        for n in range(MOST):
            try:
                image = self.image(g)
            except Fails as failure:
                raise kit.refused(property, str(failure), g=self.pair.neumann.orient(g)) from None
            scale = max(scale, self.norm(image))
            residual = self.norm(image - g)
            if residual <= limit * scale:
                return Finding(property=property, verdict="holds", detail=f"{n} steps at theta = {theta:.4g}")
            g = theta * image + (1 - theta) * g
        how = f"after {MOST} steps the residual is {residual / scale:.2g} of the forces at theta = {theta:.4g}"
        raise kit.refused(property, how, theta=theta)

    def far(self, force: Floats) -> Floats:
        """A force in the direction of a given one that no longer feels loads and gaps."""
        size = max(self.norm(self.image(np.zeros_like(force))), self.norm(force))
        return np.asarray(FAR * size / self.norm(force) * force)

    def is_independent_of_units(self, force: Floats, other: Floats, share: float) -> None:
        far = self.far(force)
        off = self.norm(self.image(4 * far) - 4 * self.image(far)) / (4 * self.norm(far))
        if not off <= self.tolerance:
            raise Fails(f"far from the loads T(4 g) differs from 4 T(g) by {off:.2g} of 4 g")

    def is_ours(self, force: Floats) -> None:
        expected = self.pair.interface.carry_back(self._own(force)[1].force)
        off, size = self.norm(self.image(force) - expected), self.norm(expected) + self.norm(force)
        if not off <= self.tolerance * size:
            raise Fails(f"T g differs from that of these matrices by {off / size:.2g} of the forces")
