"""Loss of each inequality of Section 5, in decades: where a threshold of 1e-21 comes from.

An inequality ``left <= right`` loses ``log10(right/left)`` at the pair of forces that comes closest to equality.  Where
both sides are linear in one unknown that pair is an eigenvector; where T is involved it is the best one of a search
over contact patterns (:mod:`verification.semidefinite.pattern_search`), on each of which both sides are quadratic forms
in psi - psi~.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import count, pairwise
from typing import Any

import numpy as np
from scipy.linalg import eigvalsh

from fem1d2d.mesh import Floats
from ndtheory import PRINTED, REPAIRED
from ndtheory import bounds as formulas
from verification.bounds.losses import Loss, Losses
from verification.constants import Measured
from verification.dense import symmetric
from verification.interface.pair import ContactPair
from verification.machine.progress import Progress, silent
from verification.machine.threads import one_thread
from verification.registry import PROOFS, Prover
from verification.semidefinite import LARGEST
from verification.semidefinite.neighbours import Factors, squared
from verification.semidefinite.pattern_search import worst_piece

#: Number of searches of patterns for the losses of one problem, and of starts of each.
SEARCHES, STARTS = 6, 2


@dataclass(frozen=True, kw_only=True)
class Suprema:
    """Largest values, squared, that are eigenvalues: with m, M, C_R they give the losses that need no search.

    Each is a power of the moduli times a number of the geometry.

    ``reaction`` and ``energy`` are of the contact body's reaction, in the dual norm over its displacement, and in the
    norm (5.21) over its energy; ``force`` and ``displacement`` of the dual norm of a force and of the Neumann body's
    displacement, over the norm (5.21) of the force; ``displacement_dual`` and ``force_dual`` of the Neumann body's
    displacement and of the norm (5.21), over the dual norm of the force.
    """

    reaction: float
    energy: float
    force: float
    displacement: float
    displacement_dual: float
    force_dual: float


#: The inequalities of which :func:`quotients` returns the loss, in its order.
EXACT = ("(5.18)", "(5.19)", "(5.22)", "(5.23)", "(5.29)")


def quotients(
    m: Any,
    M: Any,
    C_R: Any,
    reaction: Any,
    energy: Any,
    force: Any,
    displacement: Any,
    displacement_dual: Any,
    force_dual: Any,
) -> tuple[Any, ...]:
    """Squares of right over left side of the inequalities :data:`EXACT` at their worst pairs; of (5.29) the quotient.

    The last one is for (5.19) as a step of a chain, after the largest displacement.  Arguments of any number type, the
    last six as in :class:`Suprema`.

    Examples
    --------
    >>> quotients(1, 2, 3, 4, 5, 6, 7, 8, 9)[0]
    9.0
    """
    a = M * C_R
    return (
        a * a / reaction,
        1 / (m * m * displacement_dual),
        1 / (m * force_dual),
        M * M / (m * force),
        a * a / (m * m * energy),
        force / (m * m * displacement),
    )


class LossForms:
    """The Gram matrices of Section 5; in y with ``psi - psi~ = L_2 y`` the length of y is the norm (5.21).

    "1" is the contact body and "2" the Neumann body, whatever their numbers in the file; no contact node is held.
    """

    def __init__(self, pair: ContactPair) -> None:
        self.pair = pair
        self.root, self.inverse = pair.neumann.root, pair.neumann.inverse
        self.N_1, self.E_1 = pair.contact.lift_gram, pair.contact.gram
        self.N_2, self.E_2 = pair.neumann.lift_gram, pair.neumann.gram
        self.dual: Floats = np.asarray(np.linalg.inv(self.E_2))  # of the norm of V^2'
        self.d_2 = self.inverse @ self.root


def suprema(forms: LossForms) -> Suprema:
    """Find them for a pair."""
    S_1, N_1, dual = forms.pair.contact.schur, forms.N_1, forms.dual
    felt = forms.pair.interface.carry_back(S_1)  # the contact body's reaction, as the Neumann body receives it
    norm, size2 = square(forms.root, dual), square(forms.d_2, forms.N_2)
    return Suprema(
        reaction=top(square(felt, dual), N_1),
        energy=top(square(felt, forms.inverse), S_1),
        force=top(norm),
        displacement=top(size2),
        displacement_dual=top(size2, norm),
        force_dual=top(np.eye(len(norm)), norm),
    )


def top(form: Floats, against: Floats | None = None) -> float:
    """The largest eigenvalue of a symmetric form, against the identity by default."""
    return float(eigvalsh(form, against)[-1])


def square(rows: Floats, gram: Floats) -> Floats:
    """``rows' gram rows``, symmetric to the last digit."""
    return symmetric(rows.T @ gram @ rows)


def locate(pair: ContactPair, measured: Measured, *, progress: Progress = silent) -> Losses | None:
    """Find the loss of each inequality at the problem's friction; None if a constant does not exist or a node is held.

    ``progress`` is called with the share of the searches that are done.
    """
    constants = measured.constants()
    if constants is None or pair.held:
        return None
    m, M, C_R, x = (float(v) for v in (constants.m, constants.M, constants.C_R, constants.C_K))
    A, done = M * C_R, count()
    X = (A + x + math.sqrt(x * m)) / m  # (5.11)
    with one_thread():
        forms = LossForms(pair)
        N_1, dual = forms.N_1, forms.dual

        def found(factors: Factors, over: Floats | None = None) -> float:
            """The largest value of a quadratic form over another one of the force, the norm (5.21) by default."""
            progress("searching what the inequalities lose", next(done) / SEARCHES)
            random = np.random.default_rng(0)
            return worst_piece(pair, factors, gram=over, random=random, starts=STARTS).value

        def force(gram: Floats, over: Floats | None = None) -> float:
            """``|T psi - T psi~|`` in a norm, squared."""
            return found(lambda some: squared(some.force, gram), over)

        def trace(over: Floats | None = None) -> float:
            """``|w^1 - w~^1|_1``, squared."""
            return found(lambda some: squared(some.d_1, N_1), over)

        # suprema against e = |||psi - psi~|||, squared
        F = found(lambda some: some.friction)
        t, t_dual, d1 = force(forms.inverse), force(dual), trace()
        # and against other norms
        ratio, T_dual = trace(square(forms.inverse, forms.N_2)), force(dual, dual)
        eigen = suprema(forms)
    d2, psi_dual = eigen.displacement, eigen.force

    decades = lambda right, left: math.log10(right / left) if left > 0 else math.inf
    half = lambda right, left: decades(right * right, left) / 2
    P = lambda edition: formulas.P(x, edition.coercivity(m), M, C_R, edition.unit(m))
    C_T = formulas.lipschitz(m, M, C_R, x)
    exact = zip(EXACT, map(math.log10, quotients(m, M, C_R, **vars(eigen))), strict=False)
    links = [
        Loss(label="(5.11)", decades=half(X, ratio), searched=True),
        Loss(label="(5.16)", decades=half(C_T, T_dual), searched=True),
        *(Loss(label=label, decades=d if label == "(5.29)" else d / 2, searched=False) for label, d in exact),
        Loss(label="(5.38)", decades=decades((C_T * M / m) ** 2, t), searched=True),
    ]
    lipschitz = _chain(
        ("", math.sqrt(t)),
        ("(5.22)", math.sqrt(t_dual / m)),
        ("(5.18)", A * math.sqrt(d1 / m)),
        ("(5.11)", A * X * math.sqrt(d2 / m)),
        ("(5.19)", A * X / m * math.sqrt(psi_dual / m)),
        ("(5.23)", A * X * M / m**2),
    )
    friction: tuple[Loss, ...] = ()
    if x > 0 and F > 0:
        links.insert(-1, Loss(label="(5.30)", decades=decades(P(REPAIRED), F), searched=True))
        worst = math.sqrt(ratio)
        friction = _chain(
            ("", F),
            ("(5.13)", x * (worst + 1) * d2),
            ("(5.11)", x * (X + 1) * d2),
            ("(5.19)", x * (X + 1) / m**2 * psi_dual),
            ("(5.23)", P(REPAIRED)),
        )
        # both editions agree in the unit of stress in which m = 1
        unit = math.log10(P(PRINTED) / P(REPAIRED))
        friction += (Loss(label="m~ and the lost 1/m", decades=unit, searched=False, only_unit=True),)
    return Losses(links=tuple(links), friction=friction, lipschitz=lipschitz)


def _chain(*bounds: tuple[str, float]) -> tuple[Loss, ...]:
    """Successive bounds of one quantity, as the decades each adds."""
    return tuple(
        Loss(label=label, decades=math.log10(value / before), searched=label not in ("(5.19)", "(5.23)"))
        for (_, before), (label, value) in pairwise(bounds)
    )


def for_comparison(pair: ContactPair, measured: Measured, *, progress: Progress) -> tuple[Losses | None, str]:
    """The losses, or None and why they were not worked out."""
    if pair.contact.grid.n > LARGEST:
        return None, f"{pair.contact.grid.n} contact nodes: worked out up to {LARGEST}"
    found = locate(pair, measured, progress=progress)
    return found, "" if found is not None else measured.why_no_constants or "a contact node is held"


PROOFS.provide(Prover("losses", for_comparison))
