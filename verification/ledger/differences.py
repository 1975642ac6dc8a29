"""The difference of two solutions of steps I and II for two forces psi and psi~, and the pairs that are tried.

"1" is the contact body and "2" the Neumann body, whatever their numbers in the file.  A pair of forces is
pushed through steps I and II, or is a direction on an affine piece of T (:mod:`verification.algorithm.affine_piece`),
each of which occurs for suitable loads.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

import numpy as np

from fem1d2d.mesh import Bools, Floats
from fem1d2d.pencil import largest
from verification.algorithm.affine_piece import Piece
from verification.algorithm.fixed_point import FixedPointMap
from verification.contact import ContactError, ContactSolution
from verification.contact.active_set import Pattern
from verification.dense import symmetric
from verification.interface.body import Body
from verification.interface.pair import ContactPair
from verification.semidefinite.losses import LossForms, square, top
from verification.semidefinite.neighbours import Factors, answers, form_of, squared
from verification.semidefinite.pattern_search import signs, worst_piece

#: Numbers of steps, tried one after the other, in which a force is brought up where the active set cycles: of 19 such
#: cases on the quick level 11 need 16 steps, 6 need 64 and 2 need 256.
STEPS = (16, 64, 256)

#: Up to this share of the energies behind it a^1(w^1 - w~^1, w^1 - w~^1) is rounding: where the Neumann grid is the
#: finer one there are forces whose displacements P does not carry.  On 120 problems nothing lies from 1e-26 to 1e-11.
NO_MOTION = 1e-20


def lifted_energy(body: Body) -> Floats:
    """``a^a(R phi, R chi)`` on the interface from the lifted fields; that the lift is a-harmonic is not used."""
    elastic = body.elastic
    fields = np.zeros((len(body.positions), len(elastic.interface)))
    fields[elastic.interface] = np.eye(len(elastic.interface))
    fields[elastic.inside] = elastic.lift
    return symmetric(fields.T @ (body.stiffness @ fields))


@dataclass(frozen=True, kw_only=True, eq=False)
class DrawnSetting:
    """A pair of bodies, no contact node of which is held, with the matrices in which its differences are measured."""

    pair: ContactPair

    @cached_property
    def forms(self) -> LossForms:
        """Gram matrices of Section 5."""
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
    """The difference of two solutions of steps I and II, or several of one problem, one row of each array for each.

    Where the grids differ, only P leads from the Neumann body to the contact grid: step II stays below ``P w^2_N``,
    with ``P w^2_T`` in the jump, and (5.4) lifts ``P v``.  (5.12) takes ``w~^1 + R_D^1 P (w^2 - w~^2)``.

    ``force`` is ``psi - psi~``, nodal forces on the Neumann grid, and ``reaction`` is ``T psi - T psi~``; ``d_1`` and
    ``d_2`` are the traces of ``w^1 - w~^1`` on the contact grid and of ``w^2 - w~^2`` on the Neumann grid, unit of
    length. ``friction`` is the friction term, left side of (5.13), an energy; ``size`` are the energies from which the
    difference was formed: what rounding is relative to.
    """

    setting: DrawnSetting
    force: Floats
    reaction: Floats
    d_1: Floats
    d_2: Floats
    friction: Any
    size: Any

    @classmethod
    def of(cls, each: Sequence[Difference]) -> Difference:
        """Differences of one problem together."""
        arrays = {name: np.array([getattr(one, name) for one in each]) for name in ARRAYS}
        return cls(setting=each[0].setting, **arrays)

    def __len__(self) -> int:
        return len(self.force)

    def __iter__(self) -> Iterator[Difference]:
        return (replace(self, **{name: getattr(self, name)[i] for name in ARRAYS}) for i in range(len(self)))

    @cached_property
    def size_1(self) -> Any:
        """``|w^1 - w~^1|_1`` in H1."""
        return _norm(self.d_1, self.setting.forms.N_1)

    @cached_property
    def size_2(self) -> Any:
        """``|w^2 - w~^2|_2`` in H1."""
        return _norm(self.d_2, self.setting.forms.N_2)

    @cached_property
    def norm(self) -> Any:
        """``|||psi - psi~|||`` (5.21)."""
        return _norm(self.force, self.setting.forms.inverse)

    @cached_property
    def dual(self) -> Any:
        """The norm of psi - psi~ in the dual of V^2."""
        return _norm(self.force, self.setting.forms.dual)

    @cached_property
    def norm_T(self) -> Any:
        """``|||T psi - T psi~|||`` (5.21)."""
        return _norm(self.reaction, self.setting.forms.inverse)

    @cached_property
    def dual_T(self) -> Any:
        """The norm of T psi - T psi~ in the dual of V^2."""
        return _norm(self.reaction, self.setting.forms.dual)

    @cached_property
    def energy_1(self) -> Any:
        """``a^1(w^1 - w~^1, w^1 - w~^1)``."""
        return _product(self.d_1 @ self.setting.bilinear_1, self.d_1)

    @cached_property
    def mixed_1(self) -> Any:
        """``a^1(w^1 - w~^1, R_D^1 (w^2 - w~^2))``."""
        return _product(self.d_2 @ self.setting.felt_1, self.d_1)

    @cached_property
    def lift_T(self) -> Floats:
        """The trace of ``R^2 (T psi - T psi~)`` (5.20)."""
        return self.setting.pair.neumann.flexibility(self.reaction.T).T

    @cached_property
    def inner(self) -> Any:
        """``a^2(R^2 (T psi - T psi~), R^2 (psi - psi~))``."""
        lift = self.setting.pair.neumann.flexibility(self.force.T).T
        return _product(self.lift_T @ self.setting.bilinear_2, lift)

    @cached_property
    def mixed_2(self) -> Any:
        """``a^2(R^2 (T psi - T psi~), w^2 - w~^2)``."""
        return _product(self.lift_T @ self.setting.bilinear_2, self.d_2)

    @cached_property
    def work(self) -> Any:
        """``<T psi - T psi~, w^2 - w~^2>``."""
        return _product(self.reaction, self.d_2)

    @cached_property
    def step(self) -> Any:
        """``|||psi - T psi - (psi~ - T psi~)|||``: the difference of the unrelaxed steps."""
        return _norm(self.force - self.reaction, self.setting.forms.inverse)

    @cached_property
    def relaxed(self) -> Callable[[float], Any]:
        """theta -> ``|||T_theta psi - T_theta psi~|||`` (5.7), which many inequalities ask for."""
        inverse = self.setting.forms.inverse
        return cache(lambda theta: _norm(theta * self.reaction + (1 - theta) * self.force, inverse))


#: What several differences have one row each of.
ARRAYS = ("force", "reaction", "d_1", "d_2", "friction", "size")


def _product(v: Floats, w: Floats) -> Any:
    """The inner product of two vectors, or of each row of two matrices."""
    return (v * w).sum(axis=-1)


def _norm(v: Floats, gram: Floats) -> Any:
    return np.sqrt(np.maximum(_product(v @ gram, v), 0.0))


# --- two forces pushed through steps I and II


def between(setting: DrawnSetting, psi: Floats, other: Floats) -> Difference:
    """The difference of the solutions for two forces."""
    pair, t, forms = setting.pair, setting.pair.contact.grid.t, setting.forms
    solutions, states, images, size = [], [], [], 0.0
    for force in (psi, other):
        u, solution = _solve(pair, force)
        image = pair.interface.carry_back(solution.force)
        w_1 = pair.interface.carry(u) + solution.v + pair.offset
        parts = ((w_1, pair.contact.schur), (force + pair.neumann.load, forms.inverse), (image, forms.inverse))
        size += sum(_norm(v, gram) ** 2 for v, gram in parts)
        solutions.append(solution)
        states.append(u)
        images.append(image)
    weights = float(pair.friction) * pair.contact.grid.weights[:t]  # t = 0 in one dimension
    bounds = [np.abs(pair.interface.stress(force))[:t] for force in (psi, other)]
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
        (d_1, pair.contact.schur),
        (carried, pair.contact.schur),
        (force, forms.inverse),
        (reaction, forms.inverse),
    )
    size = sum(_norm(v, gram) ** 2 for v, gram in parts) + float(np.abs(bound) @ np.abs(slip))
    moves = _norm(d_1, pair.contact.schur) ** 2 > NO_MOTION * size
    return Difference(
        setting=setting,
        force=force,
        reaction=reaction * moves,
        d_1=d_1 * moves,
        d_2=d_2,
        friction=-float(bound @ slip),
        size=size,
    )


#: Distances of two random forces, over their size.
DISTANCES = (0.1, 0.3, 1.0, 3.0)

#: Random directions on each piece, beside the worst ones.
RANDOM_DIRECTIONS = 2


def random_pairs(setting: DrawnSetting, random: np.random.Generator, count: int) -> Iterator[Difference]:
    """Forces of 0.1 to 10 times the size that the loads cause, at several distances; every second one presses."""
    pair = setting.pair
    root = setting.forms.root
    loads = pair.neumann.load, pair.interface.carry_back(pair.contact.load)
    size = max(map(pair.neumann.dual_norm, loads)) or 1.0
    for i in range(count):
        psi, step = (root @ random.standard_normal(root.shape[1]) / math.sqrt(root.shape[1]) for _ in range(2))
        psi *= size * 10 ** random.uniform(-1, 1)
        other = psi + step * DISTANCES[i % len(DISTANCES)] * pair.neumann.dual_norm(psi)
        if i % 2:
            for force in (psi, other):
                force[pair.neumann.grid.normal] = np.abs(force[pair.neumann.grid.normal])
        yield between(setting, psi, other)


def uniform_piece(pair: ContactPair, *, touching: bool, sliding: int) -> Piece:
    """The piece on which all nodes have one state."""
    t = pair.contact.grid.t
    pattern = Pattern(touching=np.full(pair.contact.grid.n, touching), sliding=np.full(t, sliding, dtype=np.int8))
    still: Bools = np.zeros(pair.neumann.grid.n, dtype=bool)
    return Piece(pair=pair, pattern=pattern, sign=signs(pair), still=still)


def pieces(setting: DrawnSetting, random: np.random.Generator, *, starts: int) -> list[Piece]:
    """Pieces of T on which an inequality comes close to equality.

    All nodes stick; all are open and slide one way; the worst pieces of searches for the largest friction term, the
    largest ``|||T psi - T psi~|||`` and the largest work, from ``starts`` patterns each, 0 for no search.
    """
    pair, inverse = setting.pair, setting.forms.inverse
    friction = bool(pair.friction)
    found = [uniform_piece(pair, touching=True, sliding=0 if friction else 1)]
    found.append(uniform_piece(pair, touching=False, sliding=1))
    objectives: list[Factors] = [
        lambda found: squared(found.force, inverse),
        lambda found: (found.force @ inverse, found.g),
        *([lambda found: found.friction] if friction else []),
    ]
    if starts:
        found += [worst_piece(pair, factors, random=random, starts=starts).piece for factors in objectives]
    return found


def directions(setting: DrawnSetting, piece: Piece, random: np.random.Generator) -> list[Floats]:
    """Directions on a piece: the worst ones of the pencils of Section 5, and random ones."""
    forms, found = setting.forms, answers(piece)
    T, work, F = found.force.T, form_of((found.force @ forms.inverse, found.g)), form_of(found.friction)
    size_1, size_2 = square(found.d_1.T, forms.N_1), square(forms.d_2, forms.N_2)
    dual, one = square(forms.root, forms.dual), np.eye(len(F))
    square_T = square(T, forms.inverse)
    pencils = [
        (size_1, size_2),
        (square_T, one),
        (square(T, forms.dual), dual),
        (size_2, dual),
        (one, dual),
        (dual, one),
        (work, one),
        (square_T + 2 * work, one),  # T_theta at theta = 1/2
    ]
    if setting.pair.friction:
        # 2 |x| |y| <= |x|^2/r + r |y|^2 with equality at r = |x|/|y|: (5.13) where |x|/|y| is the largest there is
        r = math.sqrt(max(top(size_1, size_2), 1e-12))
        pencils += [(F, one), (F, size_1 / (2 * r) + (1 + r / 2) * size_2)]
    worst = [largest(form, against).vector for form, against in pencils]
    return worst + [random.standard_normal(len(F)) for _ in range(RANDOM_DIRECTIONS)]


def draw_pairs(
    setting: DrawnSetting, random: np.random.Generator, *, starts: int, realised: int
) -> Iterator[Difference]:
    """The pairs of one problem: ``realised`` random ones, and directions on pieces found from ``starts`` patterns."""
    yield from random_pairs(setting, random, realised)
    for piece in pieces(setting, random, starts=starts):
        for y in directions(setting, piece, random):
            yield along(setting, piece, y)
