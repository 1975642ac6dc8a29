"""The Jacobian of T_theta at the solution: the rate it gives, what a run excites of it, and a forecast of the run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import ztrexc

from fem1d2d.mesh import Floats
from ndtheory.keys import Part, key
from verification.algorithm.affine_piece import Piece, piece_of
from verification.algorithm.fixed_point import FixedPointMap, iterate_at
from verification.algorithm.iterate import Iterate
from verification.algorithm.monolithic import solution_force
from verification.algorithm.rates import CLEAR_OF_NOISE, noise, noises, observed_rate, rate_of
from verification.interface.pair import ContactPair

#: Largest number of contact nodes for a linearisation: eigenvalues of larger Jacobians take minutes.
MOST_NODES = 300

#: A mode whose share of the error is below this is not excited: rounding alone does not count.
SHARE = 1e-10


@dataclass(frozen=True, kw_only=True)
class Linearisation:
    """The Jacobian J of T_theta at the solution g*, in the norm (5.21).

    T is piecewise affine, so near g* the error obeys ``e <- J e`` exactly.  J is not normal: single steps may exceed
    rho(J), never ``|J|``.

    Attributes
    ----------
    radius : float
        rho(J).
    excited : float or None
        The spectral radius of J on the modes that the run excites; None where the run did not reach the solution.
    norm : float
        ``|J|``.
    margin : float
        Distance that g may move until a node changes state, ``|||g - g*||| / |||g*|||``.
    predicted : float or None
        The rate that J gives for the run's own error over the very steps that the observed rate compares; None where
        they lie elsewhere.  It tests J, not the future: :class:`Forecast` is what could be said before.  It differs
        from ``excited`` as long as no single mode dominates.
    """

    radius: float
    excited: float | None
    norm: float
    margin: float
    predicted: float | None

    @property
    def rate(self) -> float:
        """The rate to expect of the run."""
        return self.radius if self.excited is None else self.excited


class NotLinear(ValueError):
    """Linearisation does not apply, for the reason in the message."""


def at_solution(T: FixedPointMap) -> Iterate:
    """Evaluate T at the solution of the global method; NotLinear for a pair made from matrices."""
    if T.pair.problem is None:
        raise NotLinear("the run did not arrive, and without meshes the global method has nothing to solve")
    return iterate_at(T, solution_force(T.pair))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Near:
    """T_theta on the affine piece of an iterate: its Jacobian J in the coordinates of ``piece.basis``.

    ``error`` is ``g - g*`` there, by one Newton step; ``margin`` is the distance that g may move, in the norm (5.21),
    until a node changes state.
    """

    piece: Piece
    J: Floats
    error: Floats
    margin: float

    def step(self, error: Floats) -> float:
        """Return the size of a relaxation step from an error, in the norm (5.21): theta times the residual."""
        return float(np.linalg.norm(self.J @ error - error))


def _near(pair: ContactPair, iterate: Iterate, theta: float, piece: Piece | None = None) -> _Near:
    """Linearise T_theta at an iterate close to the solution: no node may change its state in between."""
    if pair.contact.grid.n > MOST_NODES:
        raise NotLinear(f"{pair.contact.grid.n} contact nodes: T is linearised up to {MOST_NODES}")
    piece = piece or piece_of(pair, iterate.g, iterate.contact.pattern)
    if not piece.balanced:
        raise NotLinear("contact and friction just hold the contact body: a change of g sets it in motion")
    basis, inverse = piece.basis, pair.neumann.flexibility
    J = piece.relaxed(theta)
    try:
        # one Newton step: exact on an affine piece
        newton = np.linalg.solve(np.eye(len(J)) - J, theta * basis.T @ inverse(iterate.g - iterate.image))
    except np.linalg.LinAlgError:
        raise NotLinear("1 is an eigenvalue of the Jacobian: the solution is not isolated") from None
    error: Floats = np.asarray(newton, dtype=float)
    margin, node = _margin(piece, iterate)
    if not margin > np.linalg.norm(error) + noise(pair, iterate):
        raise NotLinear(f"the node at {pair.contact.grid.place(node)} is about to change its state")
    return _Near(piece=piece, J=J, error=error, margin=margin)


def linearise(pair: ContactPair, iterate: Iterate, theta: float, history: Sequence[Iterate] = ()) -> Linearisation:
    """Linearise T_theta at the solution next to an iterate.

    Parameters
    ----------
    iterate : Iterate
        Close to the solution: no node may change its state in between.
    history : sequence of Iterate
        The run that led there; its error decides what is excited.

    Raises
    ------
    NotLinear
        A node about to change its state (strict complementarity fails), or too many nodes.
    """
    near = _near(pair, iterate, theta)
    piece, J = near.piece, near.J
    excited = predicted = None
    if history:
        observed = observed_rate(pair, history)
        first = len(history) - 1
        while first > 0 and _same(piece, piece_of(pair, history[first - 1].g, history[first - 1].contact.pattern)):
            first -= 1
        start = near.error + piece.basis.T @ pair.neumann.flexibility(history[first].g - iterate.g)
        excited = _excited(piece, theta, start)
        if observed is not None and first <= observed.begin:
            e = np.linalg.matrix_power(J, observed.begin - first) @ start
            steps = observed.end - observed.begin
            after = near.step(np.linalg.matrix_power(J, steps) @ e)
            predicted = (after / near.step(e)) ** (1 / steps) if near.step(e) > 0 else None
    size = pair.neumann.dual_norm(iterate.g)
    return Linearisation(
        radius=_radius(piece, theta),
        excited=excited,
        norm=float(np.linalg.norm(J, 2)) if len(J) else 0.0,
        margin=near.margin / size if size else float("inf"),
        predicted=predicted,
    )


def linearised_rate(piece: Piece, iterate: Iterate, theta: float, first: Floats | None = None) -> float:
    """Return only the rate of :func:`linearise`, on the piece of an iterate close to the solution.

    ``first`` is the g with which a run came onto this piece for good: its error decides what is excited.

    Raises
    ------
    NotLinear
        As for :func:`linearise`.
    """
    near = _near(piece.pair, iterate, theta, piece)
    if first is None:
        return _radius(piece, theta)
    start = near.error + piece.basis.T @ piece.pair.neumann.flexibility(first - iterate.g)
    return _excited(piece, theta, start)


@dataclass(frozen=True, kw_only=True)
class Forecast(Part):
    """Prediction of the rest of a run, made half way from the iterates up to there."""

    made_at_iteration: int = key("the first one with half the decades to the tolerance behind it")
    rate: float = key("that the run should show at its end, as `observed_rate` is defined")
    iterations: int = key("steps to the tolerance")
    tolerance: float = key("of the relative residual")


def forecast(pair: ContactPair, iterates: Sequence[Iterate], theta: float, tolerance: float, most: int) -> Forecast:
    """Predict, half way to the tolerance of a run, how it will end.

    From there on the error is taken to obey ``e <- J e`` with the Jacobian of the piece that the run is on: right if
    no node changes its state any more.

    Parameters
    ----------
    iterates : sequence of Iterate
        The run; those after the one half way are not used.
    tolerance : float
        Of the relative residual.
    most : int
        Iterations after which the run stops.

    Raises
    ------
    NotLinear
        Why nothing can be predicted.
    """
    half = next((i for i, s in enumerate(iterates) if s.residual <= math.sqrt(tolerance) * s.scale), None)
    if half is None:
        raise NotLinear("the run never got half way to the tolerance")
    iterate = iterates[half]
    if iterate.residual <= tolerance * iterate.scale:
        raise NotLinear("the run converged before a forecast could be made half way")
    seen = iterates[: half + 1]
    residuals, floors = [s.residual for s in seen], noises(pair, seen)
    if tolerance * iterate.scale <= CLEAR_OF_NOISE * floors[-1]:
        raise NotLinear("the tolerance lies within rounding")
    near = _near(pair, iterate, theta)
    error = near.error
    while residuals[-1] > tolerance * iterate.scale:
        if len(residuals) > most:
            raise NotLinear(f"the forecast at iteration {half} is that {most} iterations do not suffice")
        error = near.J @ error
        residuals.append(near.step(error) / theta)
    more = len(residuals) - len(seen)
    patterns = [s.contact.pattern for s in seen] + [iterate.contact.pattern] * more
    rate = rate_of(residuals, floors + floors[-1:] * more, patterns)  # over the steps that the observed one takes
    if rate is None:
        raise NotLinear("the run is too short for a rate")
    return Forecast(made_at_iteration=half, rate=rate.value, iterations=len(residuals) - 1, tolerance=tolerance)


def _same(a: Piece, b: Piece) -> bool:
    return a.pattern == b.pattern and np.array_equal(a.sign, b.sign)


def _margin(piece: Piece, iterate: Iterate) -> tuple[float, int]:
    """Return the distance in the norm (5.21) from g to the next change of state, and its contact node."""
    pair, t, changes = piece.pair, piece.pair.contact.grid.t, piece.changes
    v, force = iterate.contact.v, iterate.contact.force
    slack = [np.where(piece.pattern.touching, force[t:], -v[t:])]
    if len(changes.rubs):
        stress, limit, sliding = pair.interface.stress(iterate.g), pair.bound(iterate.g), piece.pattern.sliding
        slips, sticks = changes.slips, changes.sticks
        slack += [sliding[slips] * v[slips], limit[sticks] - force[sticks], limit[sticks] + force[sticks]]
        slack.append(np.abs(stress[changes.rubs]))
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.where(changes.speed > 0, np.concatenate(slack) / changes.speed, np.inf)
    least = int(np.argmin(distance))
    return float(distance[least]), int(changes.nodes[least])


def _excited(piece: Piece, theta: float, error: Floats) -> float:
    """Return the largest modulus of an eigenvalue of J whose modes have a share of the error.

    The modes of modulus >= r have no share if and only if the error is orthogonal to the left invariant subspace of
    those eigenvalues.  This subspace is spanned by the first columns of a Schur form of J' whose eigenvalues fall in
    modulus; they are brought forward one by one until one shows.
    """
    size = float(np.linalg.norm(error))
    if size == 0.0:
        return 0.0
    form, vectors = piece.modes
    moduli = _moduli(piece, theta)
    seen, modulus = 0.0, 0.0
    for first in range(len(form)):
        largest = first + int(np.argmax(moduli[first:]))
        modulus = float(moduli[largest])
        if largest > first:
            form, vectors, _ = ztrexc(form, vectors, largest + 1, first + 1)
            # those in between move down; the new diagonal is off by a root of eps where J is defective
            moduli[first : largest + 1] = np.roll(moduli[first : largest + 1], 1)
        seen += float(abs(np.vdot(vectors[:, first], error))) ** 2
        if seen > (SHARE * size) ** 2:
            break
    return modulus


def _moduli(piece: Piece, theta: float) -> Floats:
    """Return the moduli of the eigenvalues of J in the order of ``piece.modes``."""
    moduli: Floats = np.abs(1 - theta + theta * np.diagonal(piece.modes[0]))
    return moduli


def _radius(piece: Piece, theta: float) -> float:
    """Return rho(J), from the same eigenvalues as the excited one, so that it is never below that one."""
    return float(_moduli(piece, theta).max(initial=0.0))
