"""Which pairs of forces the inequalities of Section 5 are tried on: random ones, and the worst on the pieces of T."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from fem1d2d.mesh import Floats
from verification.algorithm.affine_piece import Piece
from verification.bounds.losses import LossForms, square, top
from verification.bounds.neighbours import Factors, squared
from verification.bounds.pattern_search import Form, signs, worst_piece
from verification.contact.active_set import Pattern
from verification.interface.pair import ContactPair
from verification.ledger.differences import Difference, DrawnSetting, along, between

#: Distances of two random forces, over their size.
DISTANCES = (0.1, 0.3, 1.0, 3.0)

#: Random directions on each piece, beside the worst ones.
RANDOM_DIRECTIONS = 2


def random_pairs(setting: DrawnSetting, random: np.random.Generator, count: int) -> Iterator[Difference]:
    """Forces from a tenth to ten times those that the loads bring up, at several distances; every second one presses.

    Parameters
    ----------
    setting : DrawnSetting
    random : Generator
    count : int
    """
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


def work_form(forms: LossForms, piece: Piece) -> Floats:
    """The work ``<T psi - T psi~, w^2 - w~^2>`` as a quadratic form in y."""
    form = forms.d_2.T @ forms.force(piece)
    return np.asarray(form + form.T) / 2


def uniform_piece(pair: ContactPair, *, touching: bool, sliding: int) -> Piece:
    """The piece on which every node does the same."""
    t = pair.contact.grid.t
    pattern = Pattern(touching=np.full(pair.contact.grid.n, touching), sliding=np.full(t, sliding, dtype=np.int8))
    still: NDArray[np.bool_] = np.zeros(pair.neumann.grid.n, dtype=bool)
    return Piece(pair=pair, pattern=pattern, sign=signs(pair), still=still)


def pieces(setting: DrawnSetting, random: np.random.Generator, *, starts: int) -> list[Piece]:
    """Pieces of T on which an inequality comes close to equality.

    All nodes stick, all are open and slide one way, and the worst of a search for the largest friction term, the
    largest ``|||T psi - T psi~|||`` and the largest work.

    Parameters
    ----------
    setting : DrawnSetting
    random : Generator
    starts : int
        Of each search; 0 leaves the searches out.
    """
    pair, forms = setting.pair, setting.forms
    friction = bool(pair.friction)
    found = [uniform_piece(pair, touching=True, sliding=0 if friction else 1)]
    found.append(uniform_piece(pair, touching=False, sliding=1))
    objectives: list[tuple[Form, Factors]] = [
        (lambda piece: square(forms.force(piece), forms.inverse), lambda found: squared(found.force, forms.inverse)),
        (lambda piece: work_form(forms, piece), lambda found: (found.force @ forms.inverse, found.g)),
    ]
    if friction:
        objectives.append((forms.friction, lambda found: found.friction))
    if starts:
        found += [
            worst_piece(pair, form, factors=factors, random=random, starts=starts).piece for form, factors in objectives
        ]
    return found


def directions(setting: DrawnSetting, piece: Piece, random: np.random.Generator) -> list[Floats]:
    """Directions on a piece: the worst ones of the pencils of Section 5, and random ones.

    Parameters
    ----------
    setting : DrawnSetting
    piece : Piece
    random : Generator
    """
    forms = setting.forms
    T, work, F = forms.force(piece), work_form(forms, piece), forms.friction(piece)
    size_1, size_2 = square(forms.d_1(piece), forms.N_1), square(forms.d_2, forms.N_2)
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
    worst = [eigh(form, against, subset_by_index=[len(F) - 1] * 2)[1][:, 0] for form, against in pencils]
    return worst + [random.standard_normal(len(F)) for _ in range(RANDOM_DIRECTIONS)]


def draw_pairs(
    setting: DrawnSetting, random: np.random.Generator, *, starts: int, realised: int
) -> Iterator[Difference]:
    """Pairs of one problem from both sources.

    Parameters
    ----------
    setting : DrawnSetting
    random : Generator
    starts : int
        Of each search over pieces.
    realised : int
        Pairs of random forces.
    """
    yield from random_pairs(setting, random, realised)
    for piece in pieces(setting, random, starts=starts):
        for y in directions(setting, piece, random):
            yield along(setting, piece, y)
