"""What the checker of certificates accepts of the rational data of two bodies: factors, thetas and frictions.

Multipliers come in doubles from the semidefinite bound and are rounded to decimals; a number that they prove in doubles
is made worse by a small share until :mod:`verification.certificate.check` accepts it.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from decimal import ROUND_DOWN, ROUND_UP, Context, Decimal
from fractions import Fraction
from typing import Any

import numpy as np

from verification.bounds.program import Weights
from verification.certificate.check import check, surface_stiffness
from verification.certificate.description import describe
from verification.constants.measured import FROM_MATRICES
from verification.interface.exact_bodies import NotExact
from verification.interface.pair import ContactPair
from verification.progress import Progress, silent

#: By which share what a factor is below 1 is made smaller, until the multipliers prove it for the rational bodies.
MARGINS = (1e-10, 1e-8, 1e-6, 1e-4, 1e-2)

#: Bits of the balls, tried in turn: radii grow by some twelve digits for every forty columns of a mesh.
BITS = (320, 640, 1280)

#: Digits of a multiplier and of a factor.
DIGITS = 12

#: By which share a theta or a friction is smaller than in doubles, in turn, until the checker accepts it.
LESS = (0.0, 1e-9, 1e-6, 1e-4, 1e-3, 1e-2)

#: Thetas at which a friction is tried that every small theta is to bear, in turn.
SMALL = (Fraction(1, 10**3), Fraction(1, 10**6), Fraction(1, 10**9))

NOT_CONFIRMED = "gives 1 - {:.3g} in doubles, which is not confirmed in rationals"
NOT_BELOW = f"is not confirmed in rationals, nor what is smaller by a share of {LESS[-1]:g}"


class NoCertificate(RuntimeError):
    """Contraction is not proved; the message says what was tried."""


class Claims:
    """The checker for some bodies, each of which is eliminated once for all claims.

    Parameters
    ----------
    discrete : dict
        The bodies as :func:`describe` gives them.
    progress : callable
    """

    def __init__(self, discrete: dict[str, Any], progress: Progress, known: dict[Any, Any] | None = None) -> None:
        self.discrete, self.progress = discrete, progress
        self._known: dict[Any, Any] = {} if known is None else known

    def at(self, discrete: dict[str, Any]) -> Claims:
        """Claims about the same bodies, joined otherwise."""
        return Claims(discrete, self.progress, self._known)

    def accepted(self, theta: Fraction, factor: Fraction, multipliers: dict[str, Any]) -> dict[str, Any] | None:
        """The claim of a factor with the bits in which the checker accepts it; None where it does not."""
        for bits in BITS:
            claim = {"theta": str(theta), "factor": str(factor), "bits": bits, "multipliers": multipliers}
            words = f"checking theta = {float(theta):.6g}, factor {float(factor):.10g} in balls of {bits} bits"
            self.progress(words, None)

            def eliminated(body: dict[str, Any], both: bool, bits: int = bits) -> Any:
                key = (json.dumps(body), both, bits)
                if key not in self._known:
                    self._known[key] = surface_stiffness(body, both=both)
                return self._known[key]

            try:
                check(self.discrete, claim, eliminated)
            except (ValueError, ZeroDivisionError):
                continue
            return claim
        return None

    def confirmed(self, theta: Fraction, spare: float, multipliers: dict[str, Any]) -> dict[str, Any] | None:
        """A claim that is accepted, its factor below 1 by nearly ``spare``; None where none is."""
        wanted = (1 - _decimal(spare * (1 - margin), ROUND_DOWN) for margin in MARGINS)
        return next(filter(None, (self.accepted(theta, factor, multipliers) for factor in wanted)), None)


class Confirmation:
    """Claims about the rational data of one pair of bodies, decided as a certificate's would be.

    Parameters
    ----------
    pair : ContactPair
    progress : callable

    Raises
    ------
    NoCertificate
        No claim about this pair can be proved.
    """

    def __init__(self, pair: ContactPair, *, progress: Progress = silent) -> None:
        if pair.problem is None:
            raise NoCertificate(FROM_MATRICES)
        if pair.problem.dimension != 2:
            raise NoCertificate("needed a plane problem: in 1D rho is a ratio of exact numbers")
        if pair.outside:
            raise NoCertificate(f"outside the theorem: {pair.outside[0]}")
        try:
            claims = Claims(describe(pair.problem, pair), progress)
        except NotExact as error:
            raise NoCertificate(str(error)) from None
        self.pair, self.problem, self._claims = pair, pair.problem, claims

    def factor(self, theta: Fraction, factor: float, multipliers: Weights) -> Fraction:
        """A factor of one step, larger than the one in doubles by a small share of what that is below 1.

        Parameters
        ----------
        theta : Fraction
        factor : float
            What the multipliers prove in doubles.
        multipliers : tuple of arrays
            lambda, tau, a, b by node; lambda alone without friction.

        Raises
        ------
        NoCertificate
        """
        if not factor < 1:
            raise NoCertificate(f"the factor of one program is {factor:.4g}, which is no contraction")
        claim = self._claims.confirmed(theta, 1 - factor, written(multipliers))
        if claim is None:
            raise NoCertificate(f"the factor of one program {NOT_CONFIRMED.format(1 - factor)}")
        return Fraction(claim["factor"])

    def theta_max(self, theta: float, multipliers: Weights) -> Fraction:
        """A theta up to which every one contracts, a little below that in doubles.

        Over theta the form with q = 1 is ``2 |g|^2 - 2 <g, p> - theta |p - g|^2`` minus the multiplied conditions: it
        grows as theta falls, so that one certificate answers for all smaller ones.

        Parameters
        ----------
        theta : float
            What the multipliers prove in doubles.
        multipliers : tuple of arrays
            Over theta.

        Raises
        ------
        NoCertificate
        """
        for share in LESS:
            found = _decimal(theta * (1 - share), ROUND_DOWN)
            if self._claims.accepted(found, Fraction(1), written(_times(float(found), multipliers))):
                return found
        raise NoCertificate(f"theta = {theta:.6g} in doubles {NOT_BELOW}")

    def friction_threshold(self, k: float, propose: Callable[[float], Weights]) -> Fraction:
        """A friction up to which every small theta contracts, a little below that in doubles.

        The multiplied conditions grow with k, so that one certificate answers for all that is smaller, and with one
        theta for all smaller ones: see :meth:`theta_max`.

        Parameters
        ----------
        k : float
            What was found in doubles.
        propose : callable
            Friction -> multipliers over theta, as of ``2 |g|^2 - 2 <g, p>``.

        Raises
        ------
        NoCertificate
        LMIError
        """
        for share in LESS:
            found = _decimal(k * (1 - share), ROUND_DOWN)
            claims = self._claims.at(describe(self.problem, replace(self.pair, friction=found)))
            multipliers = propose(float(found))
            for theta in SMALL:
                if claims.accepted(theta, Fraction(1), written(_times(float(theta), multipliers))):
                    return found
        raise NoCertificate(f"k = {k:.6g} in doubles {NOT_BELOW}")


def _times(factor: float, multipliers: Weights) -> Weights:
    return tuple(factor * values for values in multipliers)


def written(multipliers: Weights) -> dict[str, Any]:
    """Multipliers as rationals, rounded so that ``4 a b >= tau^2`` stays; one for all nodes where they are equal."""
    lam, tau, a, b = multipliers if len(multipliers) == 4 else (*multipliers, *(np.zeros(1),) * 3)
    found = {}
    for name, values, rounding in (
        ("lambda", lam, None),
        ("tau", tau, ROUND_DOWN),
        ("a", a, ROUND_UP),
        ("b", b, ROUND_UP),
    ):
        texts = [str(_decimal(value, rounding)) for value in values.tolist()]
        found[name] = texts[0] if len(set(texts)) == 1 else texts
    return found


def _decimal(value: float, rounding: str | None = None) -> Fraction:
    """A double as a decimal of some digits."""
    return Fraction(Context(prec=DIGITS, rounding=rounding).create_decimal(Decimal(value)))
