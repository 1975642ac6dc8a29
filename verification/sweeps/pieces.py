"""Steps of constant relaxation on one affine piece of T, many at once.

While each contact node keeps its state, T is affine.  Such steps are taken together, by a few products of matrices, and
then every sign that step II requires is checked for each of them.  Where one fails T is evaluated as elsewhere, with
its certificate.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from fem1d2d.mesh import Floats
from verification.algorithm.affine_piece import Piece, signs_of
from verification.algorithm.fixed_point import FixedPointMap, iterate_at
from verification.algorithm.iterate import Iterate
from verification.algorithm.linearisation import NotLinear, at_solution
from verification.algorithm.rates import Noise
from verification.algorithm.start import Start, begin_at, compared_with
from verification.constants import Measured
from verification.contact import ContactError
from verification.contact.active_set import SLACK, Pattern, Systems
from verification.interface.pair import ContactPair

#: Number of steps that are taken together: few at first, as the pattern changes most then.
FEWEST, MOST = 4, 64

#: Bytes of the pieces of one pair that are kept, and of T on them, besides the ones in use; matrices of a piece.
KEPT, MATRICES = 24_000_000, 8

#: A key that is equal for equal affine pieces of one pair: its pattern, and the bytes of its ``sign`` and ``still``.
Key = tuple[Pattern, bytes, bytes]


@dataclass(frozen=True, kw_only=True, eq=False)
class Steps:
    """Consecutive evaluations of T on one piece, each an array over the steps.

    ``g``, ``u`` and ``image``, shape (2 n, steps), are g, its displacement and T g; ``residual`` and ``scale``, shape
    (steps,), are ``|||T g - g|||`` and the larger of ``|||g|||`` and ``|||T g|||`` in the norm (5.21).  ``piece`` is
    the key of the piece, ``found`` the one step, where it was evaluated and not taken with others.
    """

    g: Floats
    u: Floats
    image: Floats
    residual: Floats
    scale: Floats
    piece: Key
    found: Iterate | None = None

    def first(self, count: int) -> Steps:
        """Return the first of them."""
        arrays = {name: getattr(self, name)[..., :count] for name in ("g", "u", "image", "residual", "scale")}
        return replace(self, **arrays)


class Affine:
    """T on one affine piece of a pair without held contact nodes, with the signs that hold there."""

    def __init__(self, piece: Piece, systems: Systems, factor: Floats) -> None:
        pair = self._pair = piece.pair
        contact, interface = pair.contact, pair.interface
        self._key = piece.pattern, piece.sign.tobytes(), piece.still.tobytes()
        self._sign, self._factor = piece.sign[:, None], factor
        self._limits = (float(pair.friction) * contact.grid.weights)[:, None]
        obstacle = interface.carry(pair.neumann.unloaded) + pair.offset
        trace = interface.carry(pair.neumann.inverse)
        start = contact.load - contact.schur @ obstacle  # q of step II at g = 0, where the bound is 0 as well
        v, force = systems.of(piece.pattern).solve(start, np.zeros(contact.grid.t))
        parts = [
            (piece.reaction, force),
            (piece.jump, v),
            (-contact.schur @ trace, start),
            (pair.neumann.inverse, pair.neumann.unloaded),
            (piece.force, interface.carry_back(force)),
        ]
        self._matrix = np.vstack([matrix for matrix, _ in parts])
        self._offset = np.concatenate([offset for _, offset in parts])[:, None]
        self._image = -len(parts[-1][1])  # the rows of T g
        self._stiffness = float(np.diag(contact.schur).max())
        self._sliding = piece.pattern.sliding.astype(float)[:, None]

    def relaxed(self, theta: float) -> tuple[Floats, Floats]:
        """Return T_theta as a matrix and its value at 0."""
        relaxed = theta * self._matrix[self._image :]
        relaxed[np.diag_indices_from(relaxed)] += 1 - theta
        return relaxed, theta * self._offset[self._image :, 0]

    def on(self, g: Floats) -> tuple[Steps, int]:
        """Evaluate T at the columns of g, and count those, from the first on, that the signs of the piece admit."""
        pair, norm = self._pair, lambda columns: lengths(self._factor @ columns)
        interface, t = pair.interface, pair.contact.grid.t
        found, size = self._matrix @ g + self._offset, pair.contact.grid.size
        force, v, q = (found[i * size : (i + 1) * size] for i in range(3))
        u, image = found[3 * size : -len(g)], found[-len(g) :]
        if pair.rubs and interface.kernel is not None:
            stress = interface.kernel @ g[pair.neumann.grid.normal]
            bound = self._limits * np.abs(stress)
            kept = (np.sign(stress) == self._sign).all(axis=0)
        else:
            bound, kept = np.zeros((t, g.shape[1])), np.ones(g.shape[1], dtype=bool)
        slack = SLACK * np.maximum(np.abs(q).max(axis=0), bound.max(axis=0, initial=0.0))
        # the conditions of the active set, at every step
        kept &= (force[t:] >= -slack).all(axis=0) & (v[t:] <= slack / self._stiffness).all(axis=0)
        kept &= (np.abs(force[:t]) <= bound + slack).all(axis=0)
        kept &= ((self._sliding * v[:t] >= -slack / self._stiffness) | (bound == 0)).all(axis=0)
        steps = Steps(
            g=g, u=u, image=image, residual=norm(image - g), scale=np.maximum(norm(g), norm(image)), piece=self._key
        )
        return steps, len(kept) if kept.all() else int(np.argmin(kept))


def lengths(columns: Floats) -> Floats:
    """Return the Euclidean norm of every column."""
    found: Floats = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    return found


class KnownPieces:
    """Shared data of the runs of one pair: its constants, its affine pieces, and the solution of the global method."""

    def __init__(self, pair: ContactPair, measured: Measured) -> None:
        self.pair, self.measured = pair, measured
        contact = pair.contact
        systems = self._systems = Systems(contact.schur, contact.free, contact.motions)
        factor = lru_cache(maxsize=1)(lambda: np.asarray(np.linalg.inv(pair.neumann.root), dtype=np.float64))

        def made(key: Key) -> Piece:
            sign, still = np.frombuffer(key[1], dtype=np.int8), np.frombuffer(key[2], dtype=bool)
            return Piece(pair=pair, pattern=key[0], sign=sign, still=still)

        kept = lru_cache(maxsize=1 + KEPT // (8 * MATRICES * contact.schur.size))
        self._piece = kept(made)
        self._affine = kept(lambda key: Affine(made(key), systems, factor()))

    def map(self) -> FixedPointMap:
        """Return T for one run: the pattern it tries first depends on the steps before."""
        return FixedPointMap(self.pair, systems=self._systems)

    def key(self, found: Iterate) -> Key:
        """Return the key of the piece of an iterate."""
        sign, still = signs_of(self.pair, found.g, found.contact.pattern)
        return found.contact.pattern, sign.tobytes(), still.tobytes()

    def piece(self, found: Iterate) -> Piece:
        """Return the piece of an iterate."""
        return self._piece(self.key(found))

    @cached_property
    def energy(self) -> tuple[float, float, float] | None:
        """rho, kappa_1 and kappa_2 of the theorem in energy norms; None where they do not exist."""
        found = self.measured.energy_constants()
        return None if found is None else (float(found.at_work), float(found.kappa_1), float(found.kappa_2))

    @cached_property
    def noise(self) -> Noise:
        """The rounding of one evaluation of T."""
        return Noise(self.pair)

    @cached_property
    def _solution(self) -> Iterate | Exception:
        try:
            return at_solution(self.map())
        except (NotLinear, RuntimeError) as error:
            return error

    def solution(self) -> Iterate:
        """Return T at the solution of the global method; may raise NotLinear or RuntimeError."""
        if isinstance(self._solution, Exception):
            raise self._solution
        return self._solution

    @cached_property
    def start(self) -> Start:
        """Start of the runs."""
        return begin_at(self.map())

    @cached_property
    def least(self) -> float:
        """Least size of the forces with which residuals are compared."""
        return compared_with(self.pair, self.start)

    def steps(self, T: FixedPointMap, theta: float) -> Iterator[Steps]:
        """Yield the run of a new :meth:`map` with constant relaxation from its start, without end."""
        found = iterate_at(T, self.start.g)
        while True:
            taken = self.single(found)
            yield replace(taken, found=None)
            g = theta * found.image + (1 - theta) * found.g
            with suppress(ContactError):  # which steps on the piece need not meet
                following = iterate_at(T, g)
                if self.key(following) != taken.piece:  # without the matrices of the piece, which take longer
                    found = following
                    continue
            affine, count = self._affine(taken.piece), FEWEST
            relaxed, kept = affine.relaxed(theta), count
            while kept == count:
                with np.errstate(over="ignore", invalid="ignore"):  # of a run that diverges; no sign admits it
                    taken, kept = affine.on(_walk(*relaxed, g, count))
                if kept:
                    yield taken.first(kept)
                    g = theta * taken.image[:, kept - 1] + (1 - theta) * taken.g[:, kept - 1]
                if kept == count:
                    kept = count = min(2 * count, MOST)
            found = iterate_at(T, g)

    def single(self, found: Iterate) -> Steps:
        """Return one evaluation of T with its piece."""
        g, u, image = (column[:, None] for column in (found.g, found.displacement, found.image))
        residual, scale = np.array([found.residual]), np.array([found.scale])
        return Steps(g=g, u=u, image=image, residual=residual, scale=scale, piece=self.key(found), found=found)


def _walk(matrix: Floats, offset: Floats, g: Floats, count: int) -> Floats:
    """Return so many iterates as columns, from g on."""
    walked = np.empty((len(g), count))
    for i in range(count):
        walked[:, i] = g
        g = matrix @ g + offset
    return walked
