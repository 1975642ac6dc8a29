"""What Section 5 compares: the difference of two solutions of steps I and II for two forces psi and psi~.

"1" is the contact body and "2" the Neumann body, whatever their numbers in the file.  A pair of forces is
pushed through steps I and II, or is a direction on an affine piece of T (:mod:`verification.algorithm.affine_piece`),
each of which occurs for suitable loads.  Which pairs are drawn says :mod:`verification.ledger.draws`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from fem1d2d.mesh import Floats
from verification.algorithm.affine_piece import Piece
from verification.algorithm.fixed_point import FixedPointMap
from verification.bounds.losses import LossForms
from verification.contact import ContactError, ContactSolution
from verification.interface.body import Body
from verification.interface.pair import ContactPair

#: In how many steps a force is brought up where the active set cycles, in turn: of 19 such cases on the quick level 11
#: need 16 steps, 6 need 64 and 2 need 256.
STEPS = (16, 64, 256)

#: Up to this share of the energies behind it a^1(w^1 - w~^1, w^1 - w~^1) is rounding: where the Neumann grid is the
#: finer one there are forces whose displacements P does not carry.  On 120 problems nothing lies from 1e-26 to 1e-11.
NO_MOTION = 1e-20


def lifted_energy(body: Body) -> Floats:
    """``R_a' A_a R_a`` from the lifted fields: ``a^a(R phi, R chi)`` on the interface.

    It equals the Schur complement because the lift is a-harmonic, which is used nowhere here.
    """
    elastic = body.elastic
    fields = np.zeros((len(body.positions), len(elastic.interface)))
    fields[elastic.interface] = np.eye(len(elastic.interface))
    fields[elastic.inside] = elastic.lift
    energy = fields.T @ (body.stiffness @ fields)
    return np.asarray((energy + energy.T) / 2)


@dataclass(frozen=True, kw_only=True, eq=False)
class DrawnSetting:
    """A problem with the matrices in which its differences are measured.

    Attributes
    ----------
    pair : ContactPair
        No contact node is held.
    """

    pair: ContactPair

    @cached_property
    def forms(self) -> LossForms:
        """Gram matrices and the forms on the pieces of T."""
        return LossForms(self.pair)

    @cached_property
    def bilinear_1(self) -> Floats:
        """``a^1(R phi, R chi)`` from the lifted fields."""
        return self.pair.contact.orient_form(lifted_energy(self.pair.contact.mesh_body))

    @cached_property
    def bilinear_2(self) -> Floats:
        """``a^2(R phi, R chi)`` from the lifted fields."""
        return self.pair.neumann.orient_form(lifted_energy(self.pair.neumann.mesh_body))

    @cached_property
    def felt_1(self) -> Floats:
        """``a^1(R P chi, R phi)`` for chi on the Neumann grid and phi on the contact grid, by P itself."""
        return self.pair.interface.carry(np.eye(self.pair.neumann.grid.size)).T @ self.bilinear_1

    @cached_property
    def coordinates(self) -> Floats:
        """The matrix that turns a force into coordinates whose Euclidean norm is (5.21)."""
        return np.asarray(self.forms.root.T @ self.forms.inverse)


@dataclass(frozen=True, kw_only=True, eq=False)
class Difference:
    """The difference of two solutions of steps I and II.

    Where the grids differ, what is of the Neumann body reaches the contact grid by P alone: step II stays below
    ``P w^2_N``, with ``P w^2_T`` in the jump, and (5.4) lifts ``P v``.  (5.12) takes ``w~^1 + R_D^1 P (w^2 - w~^2)``.

    Attributes
    ----------
    setting : DrawnSetting
    force : array
        ``psi - psi~``, nodal forces on the Neumann grid.
    reaction : array
        ``T psi - T psi~``, on the same grid.
    d_1, d_2 : array
        Traces of ``w^1 - w~^1`` on the contact grid and of ``w^2 - w~^2`` on the Neumann grid, unit of length.
    friction : float
        The friction term, left side of (5.13); an energy.
    size : float
        The energies from which the difference was formed: what rounding is relative to.
    """

    setting: DrawnSetting
    force: Floats
    reaction: Floats
    d_1: Floats
    d_2: Floats
    friction: float
    size: float

    @cached_property
    def size_1(self) -> float:
        """``|w^1 - w~^1|_1`` in H1."""
        return _norm(self.d_1, self.setting.forms.N_1)

    @cached_property
    def size_2(self) -> float:
        """``|w^2 - w~^2|_2`` in H1."""
        return _norm(self.d_2, self.setting.forms.N_2)

    @cached_property
    def norm(self) -> float:
        """``|||psi - psi~|||`` (5.21)."""
        return _norm(self.force, self.setting.forms.inverse)

    @cached_property
    def dual(self) -> float:
        """The norm of psi - psi~ in the dual of V^2."""
        return _norm(self.force, self.setting.forms.dual)

    @cached_property
    def norm_T(self) -> float:
        """``|||T psi - T psi~|||`` (5.21)."""
        return _norm(self.reaction, self.setting.forms.inverse)

    @cached_property
    def dual_T(self) -> float:
        """The norm of T psi - T psi~ in the dual of V^2."""
        return _norm(self.reaction, self.setting.forms.dual)

    @cached_property
    def energy_1(self) -> float:
        """``a^1(w^1 - w~^1, w^1 - w~^1)``."""
        return float(self.d_1 @ self.setting.bilinear_1 @ self.d_1)

    @cached_property
    def mixed_1(self) -> float:
        """``a^1(w^1 - w~^1, R_D^1 (w^2 - w~^2))``."""
        return float(self.d_2 @ self.setting.felt_1 @ self.d_1)

    @cached_property
    def lift_T(self) -> Floats:
        """The trace of ``R^2 (T psi - T psi~)`` (5.20)."""
        return self.setting.pair.neumann.flexibility(self.reaction)

    @cached_property
    def inner(self) -> float:
        """``a^2(R^2 (T psi - T psi~), R^2 (psi - psi~))``."""
        return float(self.lift_T @ self.setting.bilinear_2 @ self.setting.pair.neumann.flexibility(self.force))

    @cached_property
    def mixed_2(self) -> float:
        """``a^2(R^2 (T psi - T psi~), w^2 - w~^2)``."""
        return float(self.lift_T @ self.setting.bilinear_2 @ self.d_2)

    @cached_property
    def work(self) -> float:
        """``<T psi - T psi~, w^2 - w~^2>``."""
        return float(self.reaction @ self.d_2)

    @cached_property
    def step(self) -> float:
        """``|||psi - T psi - (psi~ - T psi~)|||``: the difference of the unrelaxed steps."""
        return _norm(self.force - self.reaction, self.setting.forms.inverse)

    @cached_property
    def relaxed(self) -> Callable[[float], float]:
        """theta -> ``|||T_theta psi - T_theta psi~|||`` (5.7), which many inequalities ask for."""
        inverse = self.setting.forms.inverse
        return cache(lambda theta: _norm(theta * self.reaction + (1 - theta) * self.force, inverse))


class Differences:
    """Several differences of one problem, whose numbers are arrays: attributes are those of :class:`Difference`.

    Parameters
    ----------
    each : sequence of Difference
        At least one.
    """

    def __init__(self, each: Sequence[Difference]) -> None:
        self.each, self.setting = each, each[0].setting

    def __len__(self) -> int:
        return len(self.each)

    def __iter__(self) -> Iterator[Difference]:
        return iter(self.each)

    def __getattr__(self, name: str) -> Floats:
        if name == "each" or name.startswith("_"):  # a copy asks before it has anything
            raise AttributeError(name)
        values = np.array([getattr(difference, name) for difference in self.each])
        setattr(self, name, values)
        return values

    @cached_property
    def relaxed(self) -> Callable[[float], Floats]:
        """theta -> the same of each."""
        inverse = self.setting.forms.inverse

        @cache
        def of_each(theta: float) -> Floats:
            steps = theta * self.reaction + (1 - theta) * self.force
            return np.asarray(np.sqrt(np.maximum(((steps @ inverse) * steps).sum(axis=1), 0.0)))

        return of_each


def _norm(v: Floats, gram: Floats) -> float:
    return math.sqrt(max(float(v @ gram @ v), 0.0))


# --- two forces pushed through steps I and II


def between(setting: DrawnSetting, psi: Floats, other: Floats) -> Difference:
    """The difference of the solutions for two forces.

    Raises
    ------
    ContactError
    """
    pair, t, forms = setting.pair, setting.pair.contact.grid.t, setting.forms
    solutions, states, images, stress, size = [], [], [], [], 0.0
    for force in (psi, other):
        u, solution = _solve(pair, force)
        image = pair.interface.carry_back(solution.force)
        w_1 = pair.interface.carry(u) + solution.v
        w_1[pair.contact.grid.normal] += pair.interface.gap
        parts = ((w_1, pair.contact.stiffness), (force + pair.neumann.load, forms.inverse), (image, forms.inverse))
        size += sum(_norm(v, gram) ** 2 for v, gram in parts)
        solutions.append(solution)
        states.append(u)
        images.append(image)
        stress.append(_stress(pair, force))
    weights = float(pair.friction) * pair.contact.grid.weights[:t]  # t = 0 in one dimension
    bounds = [np.abs(value)[:t] for value in stress]
    slips = [np.abs(solution.v[:t]) for solution in solutions]
    d_2 = states[0] - states[1]
    return Difference(
        setting=setting,
        force=psi - other,
        reaction=images[0] - images[1],
        d_1=pair.interface.carry(d_2) + solutions[0].v - solutions[1].v,
        d_2=d_2,
        friction=-float(weights @ ((bounds[0] - bounds[1]) * (slips[0] - slips[1]))),
        size=size + float(weights @ ((bounds[0] + bounds[1]) * (slips[0] + slips[1]))),
    )


def _solve(pair: ContactPair, force: Floats) -> tuple[Floats, ContactSolution]:
    """Steps I and II.

    Where the active set cycles the force is brought up in steps, each of which starts from the states of the last: any
    start leads to the one certified solution.  The convex program, whose import takes a second, comes last.
    """
    try:
        return FixedPointMap(pair, "active-set")(force)
    except ContactError:
        pass
    for steps in STEPS:
        brought_up = FixedPointMap(pair, "active-set")
        for share in np.arange(1, steps) / steps:
            with suppress(ContactError):
                brought_up(share * force)
        with suppress(ContactError):
            return brought_up(force)
    return FixedPointMap(pair, "cvxpy")(force)


def _stress(pair: ContactPair, force: Floats) -> Floats:
    """``S sigma_N`` at the nodes."""
    return pair.interface.stress(force)


# --- a direction on a piece of T


def along(setting: DrawnSetting, piece: Piece, y: Floats) -> Difference:
    """The difference on one piece of T in a direction ``psi - psi~ = L_2 y``."""
    forms, pair = setting.forms, setting.pair
    root, t = forms.root, pair.contact.grid.t
    force = root @ y
    d_2 = forms.inverse @ force
    carried, jump = pair.interface.carry(d_2), piece.jump @ force
    reaction = piece.force @ force
    bound, slip = piece.bound @ force, piece.pattern.sliding * jump[:t]
    d_1 = carried + jump
    parts = (
        (d_1, pair.contact.stiffness),
        (carried, pair.contact.stiffness),
        (force, forms.inverse),
        (reaction, forms.inverse),
    )
    size = sum(_norm(v, gram) ** 2 for v, gram in parts) + float(np.abs(bound) @ np.abs(slip))
    moves = _norm(d_1, pair.contact.stiffness) ** 2 > NO_MOTION * size
    return Difference(
        setting=setting,
        force=force,
        reaction=reaction * moves,
        d_1=d_1 * moves,
        d_2=d_2,
        friction=-float(bound @ slip),
        size=size,
    )
