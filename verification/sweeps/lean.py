"""Constant relaxation on the affine pieces of T: many steps by a few products of matrices.

While each contact node keeps its state, T is affine.  Such steps are taken together, and then every sign that step II
requires is checked for each of them.  Where one fails T is evaluated as elsewhere, with its certificate.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fem1d2d.mesh import Floats
from verification.algorithm.affine_piece import Piece, piece_of
from verification.algorithm.fixed_point import FixedPointMap, iterate_at
from verification.algorithm.iterate import Iterate
from verification.algorithm.linearisation import NotLinear, at_solution
from verification.algorithm.rates import Noise
from verification.algorithm.start import Start, begin_at
from verification.contact.active_set import SLACK, Pattern, Systems
from verification.interface.pair import ContactPair
from verification.monolithic import SolveError

#: Number of steps that are taken together: few at first, as the pattern changes most then.
FEWEST, MOST = 4, 64

#: Number of pieces of one pair that are kept.
KEPT = 64


@dataclass(frozen=True, kw_only=True, eq=False)
class Steps:
    """Consecutive evaluations of T on one piece, each an array over the steps.

    Attributes
    ----------
    g, u, image : array, shape (2 n, steps)
        g, its displacement and T g.
    residual, scale : array, shape (steps,)
        ``|||T g - g|||`` and the larger of ``|||g|||`` and ``|||T g|||`` in the norm (5.21).
    pattern, piece : object
        Equal for steps of one contact pattern, and of one affine piece.
    found : Iterate or None
        The one step, for other rules than constant relaxation.
    """

    g: Floats
    u: Floats
    image: Floats
    residual: Floats
    scale: Floats
    pattern: bytes
    piece: tuple[bytes, ...]
    found: Iterate | None = None

    def first(self, count: int) -> Steps:
        """Return the first of them."""
        arrays = {name: getattr(self, name)[..., :count] for name in ("g", "u", "image", "residual", "scale")}
        return replace(self, **arrays)


class Affine:
    """T on one affine piece of a pair without held contact nodes, with the signs that hold there."""

    def __init__(self, piece: Piece, systems: Systems) -> None:
        pair = piece.pair
        contact, interface = pair.contact, pair.interface
        self.piece, self.key = piece, key_of(piece)
        unloaded = interface.carry(pair.neumann.unloaded)
        obstacle = unloaded.copy()
        obstacle[contact.grid.normal] += interface.gap
        trace = interface.carry(pair.neumann.inverse)
        start = contact.load - contact.stiffness @ obstacle  # q of step II at g = 0, where the bound is 0 as well
        v, force = systems.of(piece.pattern).solve(start, np.zeros(contact.grid.t))
        parts = [
            (piece.reaction, force),
            (piece.jump, v),
            (-contact.stiffness @ trace, start),
            (pair.neumann.inverse, pair.neumann.unloaded),
            (piece.force, interface.carry_back(force)),
        ]
        self._matrix = np.vstack([matrix for matrix, _ in parts])
        self._offset = np.concatenate([offset for _, offset in parts])[:, None]
        self._image = parts[-1]
        self._stiffness = float(np.diag(contact.stiffness).max())
        self._sliding = piece.pattern.sliding.astype(float)[:, None]

    def relaxed(self, theta: float) -> tuple[Floats, Floats]:
        """Return T_theta as a matrix and its value at 0."""
        matrix, offset = self._image
        relaxed = theta * matrix
        relaxed[np.diag_indices_from(relaxed)] += 1 - theta
        return relaxed, theta * offset

    def on(self, g: Floats, norm: Norm) -> tuple[Steps, int]:
        """Evaluate T at the columns of g, and count those, from the first on, that the signs of the piece admit."""
        pair = self.piece.pair
        interface, t = pair.interface, pair.contact.grid.t
        found, size = self._matrix @ g + self._offset, pair.contact.grid.size
        force, v, q = (found[i * size : (i + 1) * size] for i in range(3))
        u, image = found[3 * size : -len(g)], found[-len(g) :]
        if pair.rubs and interface.kernel is not None:
            stress = interface.kernel @ g[pair.neumann.grid.normal]
            bound = norm.limits * np.abs(stress)
            kept = (np.sign(stress) == self.piece.sign[:, None]).all(axis=0)
        else:
            bound, kept = np.zeros((t, g.shape[1])), np.ones(g.shape[1], dtype=bool)
        slack = SLACK * np.maximum(np.abs(q).max(axis=0), bound.max(axis=0, initial=0.0))
        # the conditions of the active set, at every step
        kept &= (force[t:] >= -slack).all(axis=0) & (v[t:] <= slack / self._stiffness).all(axis=0)
        kept &= (np.abs(force[:t]) <= bound + slack).all(axis=0)
        kept &= ((self._sliding * v[:t] >= -slack / self._stiffness) | (bound == 0)).all(axis=0)
        steps = Steps(
            g=g,
            u=u,
            image=image,
            residual=norm.of(image - g),
            scale=np.maximum(norm.of(g), norm.of(image)),
            pattern=self.key[0],
            piece=self.key,
        )
        return steps, len(kept) if kept.all() else int(np.argmin(kept))


class Norm:
    """The norm (5.21) of columns, and the limit of friction at each node."""

    def __init__(self, pair: ContactPair) -> None:
        self._factor = np.linalg.inv(pair.neumann.root)
        self.limits = (float(pair.friction) * pair.contact.grid.weights)[:, None]

    def of(self, force: Floats) -> Floats:
        """Return ``sqrt(force' S2^-1 force)`` of every column."""
        return lengths(self._factor @ force)


def lengths(columns: Floats) -> Floats:
    """Return the Euclidean norm of every column."""
    found: Floats = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    return found


def key_of(piece: Piece) -> tuple[bytes, ...]:
    """Return a key that is equal for equal pieces of one pair; its first member is the pattern."""
    return piece.pattern.key, piece.sign.tobytes(), piece.still.tobytes()


class KnownPieces:
    """Shared data of the runs of one pair: its affine pieces, and the solution of the global method."""

    def __init__(self, pair: ContactPair) -> None:
        self.pair = pair
        contact = pair.contact
        self._systems = Systems(contact.stiffness, contact.free, contact.motions)
        self._found: dict[tuple[bytes, ...], Piece] = {}
        self._affine: dict[tuple[bytes, ...], Affine] = {}

    def map(self) -> FixedPointMap:
        """Return T for one run: the pattern it tries first depends on the steps before."""
        return FixedPointMap(self.pair, systems=self._systems)

    def piece(self, g: Floats, pattern: Pattern) -> Piece:
        """Return the piece around g."""
        new = piece_of(self.pair, g, pattern)
        if len(self._found) >= KEPT:
            self._found.clear()
            self._affine.clear()
        return self._found.setdefault(key_of(new), new)

    def affine(self, piece: Piece) -> Affine:
        """Return T on a piece."""
        key = key_of(piece)
        if key not in self._affine:
            self._affine[key] = Affine(piece, self._systems)
        return self._affine[key]

    @cached_property
    def norm(self) -> Norm:
        """The norm (5.21) of columns."""
        return Norm(self.pair)

    @cached_property
    def noise(self) -> Noise:
        """The rounding of one evaluation of T."""
        return Noise(self.pair)

    @cached_property
    def _solution(self) -> Iterate | Exception:
        try:
            return at_solution(self.map())
        except (NotLinear, SolveError, RuntimeError) as error:
            return error

    def solution(self) -> Iterate:
        """Return T at the solution of the global method; may raise NotLinear, SolveError or RuntimeError."""
        if isinstance(self._solution, Exception):
            raise self._solution
        return self._solution

    @cached_property
    def start(self) -> Start:
        """Start of the runs."""
        return begin_at(self.map())

    def steps(self, T: FixedPointMap, theta: float) -> Iterator[Steps]:
        """Yield the run of a new :meth:`map` with constant relaxation from its start, without end."""
        g = self.start.g
        while True:
            found = iterate_at(T, g)
            piece = self.piece(g, found.contact.pattern)
            yield replace(self.single(found), found=None)
            g = theta * found.image + (1 - theta) * g
            affine, count = self.affine(piece), FEWEST
            relaxed, kept = affine.relaxed(theta), count
            while kept == count:
                with np.errstate(over="ignore", invalid="ignore"):  # of a run that diverges; no sign admits it
                    taken, kept = affine.on(_walk(*relaxed, g, count), self.norm)
                if kept:
                    yield taken.first(kept)
                    g = theta * taken.image[:, kept - 1] + (1 - theta) * taken.g[:, kept - 1]
                if kept == count:
                    kept = count = min(2 * count, MOST)

    def single(self, found: Iterate) -> Steps:
        """Return one evaluation of T with its piece."""
        key = key_of(self.piece(found.g, found.contact.pattern))
        g, u, image = (column[:, None] for column in (found.g, found.displacement, found.image))
        residual, scale = np.array([found.residual]), np.array([found.scale])
        return Steps(g=g, u=u, image=image, residual=residual, scale=scale, pattern=key[0], piece=key, found=found)


def _walk(matrix: Floats, offset: Floats, g: Floats, count: int) -> Floats:
    """Return so many iterates as columns, from g on."""
    walked = np.empty((len(g), count))
    for i in range(count):
        walked[:, i] = g
        g = matrix @ g + offset
    return walked
