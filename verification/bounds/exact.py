"""The Lipschitz constant of T_theta between two bounds: branch and bound over signs of slip and states of nodes.

T is piecewise affine, so that its Lipschitz constant is the largest ``|J|`` of its pieces.  On a piece each node keeps
a sign eps_j, with which step II gives ``p_T v_T = eps_j w k zeta v_T`` in place of the inequality (2.6): both sides
are 0 where the node sticks.  So the set of pieces that the bound is largest for is divided in two, by the sign of a
node or by what it does, until what is proved for every set is close to the largest ``|J|`` found.  Proofs in
``docs/energy.md``.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import count

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from fem1d2d.mesh import Floats
from verification.algorithm.affine_piece import Piece
from verification.bounds.conditions import TINY, Conditions, Pieces, Signs
from verification.bounds.interior_point import LMIError, Optimum, Stop, Weights
from verification.bounds.multipliers import Certified, QuadraticForms
from verification.bounds.pattern_search import factor_search
from verification.interface.grid import Grid
from verification.interface.pair import ContactPair
from verification.progress import Progress, silent
from verification.threads import one_thread

#: The search ends where the upper bound exceeds the lower by this share.
GAP = 1e-2

#: And here where it may take as long as it takes.
CLOSE = 1e-3

#: Programs solved at 25 contact nodes unless more are asked for: some 3 s, and enough for a gap of 1 % on Section 6.
#: Counted, not timed, so that every machine gives the same number.
PROGRAMS = 50

#: And never more than this: at most 8 s on a hundred random problems of up to 9 nodes.
MOST = 160

#: Signs are fixed where that may save this share of what the bound is too large by.
WORTH = 0.3

#: What images of multipliers prove may be weaker by this share, which rounding costs, before a program is solved.
SAME_BOUND = 1e-9

#: Entries that differ by less, relative to the diagonal or to the largest, are equal: rounding leaves 1e-14 on Section
#: 6 with 97 contact nodes.
SAME = 1e-12

#: A pattern read off the moments is climbed from where its ``|J|`` reaches this share of the best.
PROMISING = 0.995


@dataclass(frozen=True, kw_only=True, eq=False)
class Enclosure:
    """Bounds of the Lipschitz constant of T_theta in the norm (5.21), over all loads and gaps.

    Attributes
    ----------
    upper, whole : Certified
        Proved by multipliers for every set of pieces, and by one program for all pieces together.
    lower, piece : float, Piece
        The largest ``|J|`` found, and its piece.
    programs, why_apart : int, str
        Number of programs that were solved; why the gap is larger than was asked for.
    """

    upper: Certified
    whole: Certified
    lower: float
    piece: Piece
    programs: int
    why_apart: str

    @property
    def gap(self) -> float:
        """``upper / lower - 1``."""
        return self.upper.value / self.lower - 1


@dataclass(frozen=True, kw_only=True, eq=False)
class Leaf:
    """Some pieces: the bound proved for them, and the program's answer."""

    pieces: Pieces
    upper: Certified
    proposal: Optimum | None


def budget(n: int) -> int:
    """Number of programs to solve for n contact nodes: as many as take some seconds.

    Examples
    --------
    >>> [budget(n) for n in (13, 25, 49, 97)]
    [160, 50, 9, 1]
    """
    return max(1, min(MOST, int(PROGRAMS * (25 / n) ** 2.5)))


def enclose(
    pair: ContactPair,
    forms: QuadraticForms,
    theta: float,
    *,
    gap: float,
    programs: int | None,
    progress: Progress = silent,
) -> Enclosure:
    """Enclose the Lipschitz constant of T_theta for 0 < theta <= 1.

    The search ends where ``upper <= (1 + gap) lower``, or after so many ``programs`` (see :func:`budget`); None: no
    limit.

    Raises
    ------
    LMIError
        No multipliers prove anything.
    """
    with one_thread():
        upper, proposal = forms.on(forms.everywhere, theta)
        root = Leaf(pieces=forms.everywhere, upper=upper, proposal=proposal)
        search = factor_search(pair, theta)
        patterns = [*search.extremes(), *_read_off(forms, root, search.sign)]
        best = max((search.climb(search.found(*pattern)) for pattern in patterns), key=lambda found: found.value)
        order, solved, mirror = count(), 1, Mirror.of(pair, forms)
        leaves, bounded, why = [(-upper.value, next(order), root)], {root.pieces.key: root}, ""
        while True:
            worst, lower = leaves[0][2], best.piece.factor(theta)
            if worst.upper.value <= (1 + gap) * lower:
                break
            parts = _divided(forms, worst, lower)
            if not parts:
                why = "the worst set of pieces cannot be divided"
                break
            if programs is not None and solved + len(parts) > programs:
                why = f"{solved} programs were solved"
                break
            stop = Stop(accuracy=gap / 100, enough=((1 + gap) * lower) ** 2 * (1 - SAME_BOUND))
            progress(f"semidefinite bound: {worst.upper.value / lower - 1:.2%} above a factor that occurs", None)
            heapq.heappop(leaves)
            for part in parts:
                leaf = None if mirror is None else _mirrored(forms, mirror, bounded, part, theta)
                if leaf is None:
                    leaf, solved = _solved(forms, worst, part, theta, stop), solved + 1
                    for pattern in _read_off(forms, leaf, search.sign):
                        start = search.above(PROMISING**2 * best.value, *pattern)
                        if start is not None:
                            best = max(best, search.climb(start), key=lambda found: found.value)
                bounded[part.key] = leaf
                heapq.heappush(leaves, (-leaf.upper.value, next(order), leaf))
    return Enclosure(upper=worst.upper, whole=root.upper, lower=lower, piece=best.piece, programs=solved, why_apart=why)


def _solved(forms: QuadraticForms, parent: Leaf, part: Pieces, theta: float, stop: Stop) -> Leaf:
    """The bound for a part of a set of pieces: by its own program, or from the whole set."""
    start = None
    if parent.proposal is not None and (part.signs != parent.pieces.signs).any():  # by what a node does is too far away
        start = parent.pieces, parent.proposal
    try:
        upper, proposal = forms.on(part, theta, stop=stop, parent=start)
    except LMIError:
        return replace(parent, pieces=part, proposal=None)
    return Leaf(pieces=part, upper=min(upper, parent.upper, key=lambda certified: certified.value), proposal=proposal)


def _mirrored(
    forms: QuadraticForms, mirror: Mirror, bounded: dict[bytes, Leaf], part: Pieces, theta: float
) -> Leaf | None:
    """The bound from images of multipliers for the image of a set of pieces; None where neither is known."""
    other = bounded.get(mirror.pieces(part).key)
    if other is None or other.proposal is None:
        return None
    upper = forms.proved_by(mirror.multipliers(other.upper.multipliers), theta)
    if upper is None or upper.value > other.upper.value * (1 + SAME_BOUND):
        return None
    return Leaf(pieces=part, upper=upper, proposal=mirror.proposal(other.proposal, forms, other.pieces))


def _divided(forms: QuadraticForms, leaf: Leaf, lower: float) -> list[Pieces]:
    """A set of pieces in two, at the node where that promises most in the moments of the worst pairs.

    First by signs, whose relaxation costs the difference of ``tau |zeta| |v_T|`` and ``tau |zeta v_T|``; where that is
    little of the excess of the bound, by the state of a node.
    """
    if leaf.proposal is None or len(forms.families) == 1:
        return []
    pieces, moments, (lam, tau, *_) = leaf.pieces, leaf.proposal.moments, leaf.upper.multipliers
    (force, jump), (shear, slip), (zeta, _), (slide, _), *_ = forms.families
    of = lambda a, b: np.einsum("ij,ij->i", a @ moments, b)
    sizes = lambda a, b: np.sqrt(np.maximum(of(a, a) * of(b, b), 0.0))
    free = pieces.signs == 0
    lost = np.where(free & (pieces.slip == 0), tau * (sizes(zeta, slide) - np.abs(of(zeta, slide))), 0.0)
    if lost.sum() >= WORTH * (leaf.upper.value**2 - lower**2):
        node = int(np.argmax(lost))
        return [pieces.where("signs", node, sign) for sign in (1, -1)]
    signed = shear - pieces.signs[:, None] * forms.reach
    both = np.concatenate(
        [
            np.where(pieces.normal == 0, lam * sizes(force, jump), -1.0),
            np.where(~free & (pieces.slip == 0), tau * sizes(signed, slip), -1.0),
        ]
    )
    node = int(np.argmax(both))
    if both[node] >= 0:
        name, node = ("normal", node) if node < len(lam) else ("slip", node - len(lam))
        return [pieces.where(name, node, value) for value in (1, -1)]
    if free.any():
        node = int(np.argmax(np.where(free, lost, -1.0)))
        return [pieces.where("signs", node, sign) for sign in (1, -1)]
    return []


def _read_off(forms: QuadraticForms, leaf: Leaf, sign: Signs) -> Iterator[tuple[NDArray[np.bool_], Signs]]:
    """State of each node, touching and sliding, in the pairs of forces that are worst in the moments of a leaf."""
    if leaf.proposal is None:
        return
    normal = leaf.pieces.normal
    first, second = np.linalg.eigh(leaf.proposal.moments)[1][:, -2:].T
    for worst in (first, second, first + second, first - second):
        relative = lambda rows, at=worst: np.abs(rows @ at) / np.maximum(np.linalg.norm(rows, axis=1), TINY)
        (force, jump), *friction = forms.families
        touching = np.where(normal != 0, normal > 0, relative(force) > relative(jump))
        if not friction:
            yield touching, np.ones(len(sign), dtype=np.int8)
            continue
        (shear, slip), (zeta, _), (slide, _), *_ = friction
        seen = np.sign((shear @ worst) * (slip @ worst) * (zeta @ worst) * (slide @ worst))
        eps = np.where(leaf.pieces.signs != 0, leaf.pieces.signs, np.where(seen != 0, seen, 1))
        rests = relative(shear - eps[:, None] * forms.reach) < relative(slip)
        slides = np.where(leaf.pieces.slip != 0, leaf.pieces.slip > 0, rests)
        yield touching, np.where(slides, eps * np.where(sign != 0, sign, 1), 0).astype(np.int8)


# --- mirror images ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True, eq=False)
class Mirror:
    """The reflection of a pair of bodies that is its own mirror image.

    The reflection of Gamma_c about its middle reverses the order of the nodes and turns tangential components round.
    Where it changes neither the matrices of a pair nor its law of friction, two forces and their images fulfil the same
    conditions of step II, with the other sign of slip against S sigma_N: so a set of pieces and its mirror image have
    the same Lipschitz constant, and the images of multipliers prove the image of a claim.  Images are only proposals:
    they are checked as any multipliers, with the matrices as they are.

    ``turn``, shape (d, d), is the reflection in the coordinates of :class:`verification.bounds.conditions.Conditions`.
    """

    turn: Floats

    @classmethod
    def of(cls, pair: ContactPair, forms: Conditions) -> Mirror | None:
        """The reflection; None where the pair is not its own mirror image to rounding, and without friction."""
        interface, contact, neumann = pair.interface, pair.contact, pair.neumann
        if interface.kernel is None or len(forms.families) == 1:
            return None
        same = _alike(contact.grid.weights, contact.grid.weights[::-1]) and _alike(
            interface.kernel, interface.kernel[::-1, ::-1]
        )
        if interface.transfer is not None:
            same = same and _alike(interface.transfer, interface.transfer[::-1, ::-1])
        if not (same and _is_even(contact.stiffness, contact.grid) and _is_even(neumann.stiffness, neumann.grid)):
            return None
        L_2, carried = neumann.root, forms.carried
        turns = (
            np.linalg.solve(L_2, _reflected(L_2, neumann.grid)),
            np.linalg.solve(carried, _reflected(carried, contact.grid)),
        )
        return cls(turn=block_diag(*turns))

    def pieces(self, pieces: Pieces) -> Pieces:
        """The images of some pieces."""
        return Pieces(signs=-pieces.signs[::-1], normal=pieces.normal[::-1], slip=pieces.slip[::-1])

    def multipliers(self, multipliers: Weights) -> Weights:
        """The images of multipliers; those of ``w k zeta v_T`` and of ``p_T sqrt(w k) zeta`` change sign."""
        signs = (1, 1, 1, 1, -1, 1, 1, 1, -1)
        return tuple(sign * values[::-1] for sign, values in zip(signs, multipliers, strict=False))

    def proposal(self, found: Optimum, forms: Conditions, pieces: Pieces) -> Optimum:
        """The image of a solver's answer for some pieces."""
        reverse = lambda y: np.concatenate([part[::-1] for part in forms.parts(y, pieces)])
        early = None if found.early is None else (found.early[0], reverse(found.early[1]))
        return replace(found, y=reverse(found.y), moments=self.turn @ found.moments @ self.turn.T, early=early)


def _reflected(rows: Floats, grid: Grid) -> Floats:
    """Interface vectors, as columns, reflected."""
    return np.concatenate([-rows[grid.tangential][::-1], rows[grid.normal][::-1]])


def _is_even(S: Floats, grid: Grid) -> bool:
    """True if the reflection does not change a symmetric positive definite matrix, entry by entry."""
    root = np.sqrt(np.diag(S))
    scaled = S / np.outer(root, root)
    return bool(np.abs(_reflected(_reflected(scaled, grid).T, grid) - scaled).max() <= SAME)


def _alike(a: Floats, b: Floats) -> bool:
    return bool(np.abs(a - b).max() <= SAME * np.abs(a).max())
