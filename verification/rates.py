"""The rate a run shows in the norm (5.21), with its noise floor, and the rate that linearisation predicts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import schur

from fem1d2d.mesh import Floats
from verification.jacobian import Piece, piece_of
from verification.pair import Pair
from verification.state import State

#: Residuals below this multiple of the noise are not used.
CLEAR_OF_NOISE = 100.0

#: Above this multiple of the noise a step ratio has eight digits.
FAR_FROM_NOISE = 1e8


@dataclass(frozen=True, kw_only=True)
class ObservedRate:
    """The rate at the end of a run.

    Attributes
    ----------
    value : float
        Geometric mean of the last quarter of the step ratios since the contact pattern last changed.
    lo, hi : float
        Hull of the rates over that quarter and over the one before it, widened by the noise.
    begin, end : int
        The states whose residuals it compares.
    """

    value: float
    lo: float
    hi: float
    begin: int
    end: int


def noise(pair: Pair, state: State) -> float:
    """Rounding error of one evaluation of T, as a residual in the norm (5.21).

    Forces are differences of products ``|S1| |u|`` and of loads, each with a relative error of some units in the last
    place.
    """
    neumann, contact = pair.neumann, pair.contact
    magnitude = np.abs(contact.stiffness) @ np.abs(state.displacement) + np.abs(contact.load) + np.abs(state.g)
    return float(4 * np.finfo(float).eps * neumann.dual_norm(magnitude))


def usable(residuals: Sequence[float], floor: float) -> int:
    """How many leading residuals stand above a floor."""
    return next((i for i, residual in enumerate(residuals) if not residual > floor), len(residuals))


def observed_rate(pair: Pair, states: Sequence[State]) -> ObservedRate | None:
    """The asymptotic rate, or None where fewer than two step ratios stand clear of the noise."""
    if not states:
        return None
    floor = noise(pair, states[-1])
    count = usable([s.residual for s in states], CLEAR_OF_NOISE * floor)
    if count < 3:
        return None
    last = states[count - 1].contact.pattern
    begin = count - 1
    while begin > 0 and states[begin - 1].contact.pattern == last:
        begin -= 1
    begin = min(begin, count - 3)
    end = count - 1
    # an even number of steps: modes of either sign alternate
    quarter = max(2, (end - begin) // 8 * 2)
    before = max(begin, end - 2 * quarter), end - quarter
    windows = [(end - quarter, end)] + ([before] if before[0] < before[1] else [])

    def rate(i: int, j: int, error: float = 0.0) -> float:
        return float(((states[j].residual + error) / (states[i].residual - error)) ** (1 / (j - i)))

    return ObservedRate(
        value=rate(end - quarter, end),
        lo=min(rate(i, j, -floor) for i, j in windows),
        hi=max(rate(i, j, floor) for i, j in windows),
        begin=end - quarter,
        end=end,
    )


@dataclass(frozen=True, kw_only=True)
class StepRatio:
    """The largest Lipschitz quotient of T_theta along a run, with its error.

    Consecutive iterates are a pair of Proposition 5.6: ``|||T_theta psi - T_theta psi~||| / |||psi - psi~|||``
    is the ratio of consecutive residuals.
    """

    value: float
    lo: float
    hi: float
    steps: int


def largest_step_ratio(pair: Pair, states: Sequence[State]) -> StepRatio | None:
    """The largest step ratio clear of the noise, or None where there is none.

    A step may end below the noise, not begin there.  Steps far above it count alone, where there are any.
    """
    if not states:
        return None
    if states[0].residual == 0:
        return StepRatio(value=0.0, lo=0.0, hi=0.0, steps=0)
    floor = noise(pair, states[-1])
    residuals = [s.residual for s in states]
    begins = residuals[:-1]
    count = usable(begins, FAR_FROM_NOISE * floor) or usable(begins, CLEAR_OF_NOISE * floor)
    if count < 1:
        return None
    before, after = np.array(begins[:count]), np.array(residuals[1 : count + 1])
    return StepRatio(
        value=float((after / before).max()),
        lo=max(float(((after - floor) / (before + floor)).max()), 0.0),
        hi=float(((after + floor) / (before - floor)).max()),
        steps=count,
    )


#: Contact nodes up to which T is linearised: eigenvalues of larger Jacobians take minutes.
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
        The spectral radius of J on what the run excites; None where the run did not reach the solution.
    norm : float
        ``|J|``.
    margin : float
        How far g may move until a node changes state, ``|||g - g*||| / |||g*|||``.
    predicted : float or None
        What J makes of the error over the very steps that the observed rate compares; None where they lie elsewhere.
        It differs from ``excited`` as long as no single mode dominates.
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
    """Why linearisation does not apply."""


def linearise(pair: Pair, state: State, theta: float, history: Sequence[State] = ()) -> Linearisation:
    """Linearise T_theta at the solution next to a state.

    Parameters
    ----------
    pair : Pair
    state : State
        Close to the solution: no node may change its state in between.
    theta : float
    history : sequence of State
        The run that led to the state; its error decides what is excited.

    Raises
    ------
    NotLinear
        A node about to change its state (strict complementarity fails), or too many nodes.
    """
    if pair.n > MOST_NODES:
        raise NotLinear(f"{pair.n} contact nodes: T is linearised up to {MOST_NODES}")
    piece = piece_of(pair, state.g, state.contact.pattern)
    basis, inverse = piece.basis, pair.neumann.flexibility
    J = piece.relaxed(theta)
    try:
        # one Newton step: exact on an affine piece
        error = np.linalg.solve(np.eye(len(J)) - J, theta * basis.T @ inverse(state.g - state.image))
    except np.linalg.LinAlgError:
        raise NotLinear("1 is an eigenvalue of the Jacobian: the solution is not isolated") from None
    margin, node = _margin(piece, state)
    if not margin > np.linalg.norm(error):
        raise NotLinear(f"the node at x = {pair.x[node]:g} is about to change its state")
    excited = predicted = None
    if history:
        observed = observed_rate(pair, history)
        first = len(history) - 1
        while first > 0 and _same(piece, piece_of(pair, history[first - 1].g, history[first - 1].contact.pattern)):
            first -= 1
        start = error + basis.T @ inverse(history[first].g - state.g)
        excited = _excited(J, start)
        if observed is not None and first <= observed.begin:
            e = np.linalg.matrix_power(J, observed.begin - first) @ start
            steps = observed.end - observed.begin
            residual = lambda e: float(np.linalg.norm(J @ e - e))
            after = residual(np.linalg.matrix_power(J, steps) @ e)
            predicted = (after / residual(e)) ** (1 / steps) if residual(e) > 0 else None
    size = pair.neumann.dual_norm(state.g)
    return Linearisation(
        radius=float(np.abs(np.linalg.eigvals(J)).max(initial=0.0)),
        excited=excited,
        norm=float(np.linalg.norm(J, 2)) if len(J) else 0.0,
        margin=margin / size if size else float("inf"),
        predicted=predicted,
    )


def _same(a: Piece, b: Piece) -> bool:
    return a.pattern == b.pattern and np.array_equal(a.sign, b.sign)


def _margin(piece: Piece, state: State) -> tuple[float, int]:
    """Distance in the norm (5.21) from g to the next change of state, and the node it happens at."""
    pair, t, touching = piece.pair, piece.pair.tangential.stop, piece.pattern.touching
    v, force, basis = state.contact.v, state.contact.force, piece.basis
    jump, reaction = piece.jump @ basis, piece.force @ basis
    rows = [np.where(touching[:, None], reaction[t:], -jump[t:])]
    slack = [np.where(touching, force[t:], -v[t:])]
    nodes = [np.arange(pair.n)]
    if t and piece.sign.any():
        assert pair.regularisation is not None
        stress, bound = pair.regularisation @ state.g[pair.normal], piece.bound @ basis
        limit = float(pair.problem.contact.friction) * pair.weights * np.abs(stress)
        sliding, rubs = piece.pattern.sliding, piece.sign != 0
        slips, sticks = np.flatnonzero(rubs & (sliding != 0)), np.flatnonzero(rubs & (sliding == 0))
        rows += [sliding[slips, None] * jump[slips], bound[sticks] - reaction[sticks], bound[sticks] + reaction[sticks]]
        slack += [sliding[slips] * v[slips], limit[sticks] - force[sticks], limit[sticks] + force[sticks]]
        rows.append(piece.sign[rubs, None] * (pair.regularisation[rubs] @ basis[pair.normal]))
        slack.append(np.abs(stress[rubs]))
        nodes += [slips, sticks, sticks, np.flatnonzero(rubs)]
    gradient = np.linalg.norm(np.vstack(rows), axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.where(gradient > 0, np.concatenate(slack) / gradient, np.inf)
    least = int(np.argmin(distance))
    return float(distance[least]), int(np.concatenate(nodes)[least])


def _excited(J: Floats, error: Floats) -> float:
    """The largest modulus of an eigenvalue of J whose modes have a share of the error.

    The modes of modulus >= r have no share if and only if the error is orthogonal to the left invariant subspace of
    those eigenvalues, which an ordered Schur form of J' spans with orthonormal columns.
    """
    size = float(np.linalg.norm(error))
    if size == 0.0:
        return 0.0
    moduli = np.unique(np.abs(np.linalg.eigvals(J)))[::-1]
    low, high = 0, len(moduli) - 1  # the first modulus that shows: by halving, as shares only grow
    while low < high:
        middle = (low + high) // 2
        r = moduli[middle] * (1 - 1e-9)
        _, vectors, count = schur(J.T, output="complex", sort=lambda z, r=r: abs(z) >= r)
        if np.linalg.norm(vectors[:, :count].conj().T @ error) > SHARE * size:
            high = middle
        else:
            low = middle + 1
    return float(moduli[low])
