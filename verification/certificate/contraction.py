"""A certificate that T_theta contracts on a mesh: rational data from which anyone can decide the claim again.

The solver of the semidefinite bound proposes multipliers in doubles.  They are rounded to decimals, and the bodies are
described in the rational numbers of the problem file; :mod:`verification.certificate.check`, which knows nothing of
this library, then decides in balls whether these multipliers prove the factor for these bodies.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from decimal import ROUND_DOWN, ROUND_UP, Context, Decimal
from fractions import Fraction
from importlib.util import find_spec
from typing import Any, ClassVar, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from verification.algorithm.theta import choose
from verification.bounds.bound import Subject
from verification.bounds.program import LMIError, Weights
from verification.bounds.table import BOUNDS
from verification.certificate.exact_bodies import ExactInterface, NotExact, exact_points
from verification.constants import FROM_MATRICES, Measured, measure
from verification.document import Document
from verification.interface.assembly import build
from verification.interface.body import Body
from verification.interface.pair import UNITS, ContactPair
from verification.problem import Problem, ProblemError
from verification.problem.specification import BodySpec
from verification.progress import Progress, silent

Edition = Literal["lmi", "sharp", "repaired"]

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


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Checked(Document):
    """What came of checking a certificate again.

    Attributes
    ----------
    accepted : bool
        Whether its multipliers prove its claim for its bodies.
    why : str
        Why it is refused; empty where it is not.
    words : str
        What was checked.
    sha256 : str
        Of the bodies and what joins them.
    same : bool or None
        Whether these are the bodies of the problem it was held against; None without one.
    """

    schema: ClassVar[str] = "ndtheory.certificate-check/1"

    units: Mapping[str, str]
    accepted: bool
    why: str
    words: str
    sha256: str
    same: bool | None = None
    problem: Problem | None = None

    @property
    def summary(self) -> str:
        return f"accepted: {self.words}" if self.accepted else f"refused: {self.why}"

    def content(self) -> dict[str, Any]:
        reason = {} if self.same is not None else {"same": "no problem was given to hold it against"}
        return {
            "accepted": self.accepted,
            "why": self.why,
            "words": self.words,
            "sha256": self.sha256,
            "same": self.same,
            "reason": reason,
        }


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Certificate(Document):
    """A claim about T_theta, the bodies that it is about, and what proves it.

    Attributes
    ----------
    edition : {'lmi', 'sharp', 'repaired'}
        Which bound proposed the factor: the semidefinite one, that in energy norms, or that of Section 5 repaired.
    discrete : dict
        Bodies, transfer, weights, kernel and friction in rationals, as texts.
    claim : dict
        theta, the factor, the multipliers and the bits of the balls in which they prove it.
    lower : float or None
        The largest factor found of a pair of forces, in doubles: no certificate proves less.
    """

    schema: ClassVar[str] = "ndtheory.certificate/1"

    edition: Edition
    discrete: dict[str, Any]
    claim: dict[str, Any]
    problem: Problem
    lower: float | None = None

    @property
    def units(self) -> dict[str, str]:  # type: ignore[override]
        return dict(self.problem.units)

    @property
    def factor(self) -> Fraction:
        """The Lipschitz constant that is proved."""
        return Fraction(self.claim["factor"])

    @property
    def theta(self) -> Fraction:
        """The relaxation factor."""
        return Fraction(self.claim["theta"])

    @property
    def summary(self) -> str:
        return f"theta = {float(self.theta):.4g}, factor {float(self.factor):.6g} proved ({self.edition})"

    def content(self) -> dict[str, Any]:
        from verification.certificate.check import digest

        return {
            "kind": "contraction",
            "edition": self.edition,
            "sha256": digest(self.discrete),
            "claim": self.claim,
            "lower": self.lower,
            "reason": {} if self.lower is not None else {"lower": "not computed for this edition"},
            "discrete": self.discrete,
        }


def certify(
    problem: Problem, *, theta: Any = None, edition: Edition = "lmi", progress: Progress = silent
) -> Certificate:
    """Prove that one step contracts on the meshes of a problem, for its rational data.

    Parameters
    ----------
    problem : Problem
        Two plane bodies.
    theta : number or 'auto', optional
        The problem's by default.
    edition : {'lmi', 'sharp', 'repaired'}
        Which bound proposes factor and multipliers.
    progress : callable

    Returns
    -------
    Certificate

    Raises
    ------
    NoCertificate
        The bound has no conclusion, or its multipliers do not prove what they should in rationals.
    ProblemError
        Not two plane bodies of which the theorem speaks.
    ImportError
        python-flint is not there.

    Examples
    --------
    >>> from verification.problem.examples import example
    >>> found = certify(example("section6-60"), theta="0.7")
    >>> found.lower < found.factor < 1
    True
    """
    if find_spec("flint") is None:
        raise ModuleNotFoundError("python-flint is not installed", name="flint")
    refuse = lambda key, needed: ProblemError(problem.source, key, None, needed)
    if edition not in get_args(Edition):
        raise ValueError(f"edition {edition!r}: needed one of {', '.join(get_args(Edition))}")
    if problem.dimension != 2:
        raise refuse("dimension", "needed a plane problem: in 1D rho is a ratio of exact numbers")
    pair = build(problem)
    measured = measure(pair)
    if pair.outside:
        raise refuse("contact", f"outside the theorem: {pair.outside[0]}")
    chosen = choose(pair, theta, measured).theta
    assert isinstance(chosen, Fraction)
    progress(f"{BOUNDS[edition].words} proposes multipliers", None)
    spare, multipliers, lower = _proposed(pair, measured, chosen, edition)
    discrete = describe(problem, pair)
    claim = Claims(discrete, progress).confirmed(chosen, spare, multipliers)
    if claim is None:
        raise NoCertificate(f"{BOUNDS[edition].words} {NOT_CONFIRMED.format(spare)}")
    return Certificate(edition=edition, discrete=discrete, claim=claim, problem=problem, lower=lower)


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
        if find_spec("flint") is None:
            raise NoCertificate("python-flint is not installed: needed the extra `certify`")
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
        claim = self._claims.confirmed(theta, 1 - factor, _written(multipliers))
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
            if self._claims.accepted(found, Fraction(1), _written(_times(float(found), multipliers))):
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
                if claims.accepted(theta, Fraction(1), _written(_times(float(theta), multipliers))):
                    return found
        raise NoCertificate(f"k = {k:.6g} in doubles {NOT_BELOW}")


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
        from verification.certificate.check import check, surface_stiffness

        for bits in BITS:
            claim = {"theta": str(theta), "factor": str(factor), "bits": bits, "multipliers": multipliers}
            self.progress(f"checking the factor {float(factor):.10g} in balls of {bits} bits", None)

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


def _times(factor: float, multipliers: Weights) -> Weights:
    return tuple(factor * values for values in multipliers)


def check_again(document: Any, problem: Problem | None = None) -> Checked:
    """Decide the claim of a certificate anew, from its rational data alone.

    Parameters
    ----------
    document : dict
        As ``certificate.json`` holds it.
    problem : Problem, optional
        Whose bodies the certificate should be about.

    Returns
    -------
    Checked

    Raises
    ------
    ValueError
        Not a certificate of contraction.
    ImportError
        python-flint is not there.

    Examples
    --------
    >>> from verification.problem.examples import example
    >>> document = certify(example("section6-60"), edition="sharp").to_dict()
    >>> document["claim"]["factor"] = "1/2"
    >>> check_again(document).accepted
    False
    """
    from verification.certificate import check

    if not isinstance(document, dict) or document.get("schema") != Certificate.schema:
        raise ValueError(f"needed a document of the schema {Certificate.schema}")
    try:
        words, found = check.words(document), check.digest(document["discrete"])
    except check.UNREADABLE as error:
        raise ValueError(f"not a certificate of contraction: {type(error).__name__}: {error}") from None
    try:
        check.examine(document)
        why = ""
    except check.UNREADABLE as error:
        why = str(error)
    return Checked(
        units=UNITS if problem is None else problem.units,
        problem=problem,
        accepted=not why,
        why=why,
        words=words,
        sha256=found,
        same=None if problem is None else describe(problem) == document["discrete"],
    )


def describe(problem: Problem, pair: ContactPair | None = None) -> dict[str, Any]:
    """The bodies of a plane problem and what joins them, in rationals as texts; see ``docs/json.md``.

    Coordinates of a mesh file are the doubles that were read from it.
    """
    pair = build(problem) if pair is None else pair
    meshed = [side.mesh_body for side in (pair.body1, pair.body2)]
    points = [exact_points(spec, body) for spec, body in zip((problem.body1, problem.body2), meshed, strict=True)]
    along = [p[body.nodes, 0] for p, body in zip(points, meshed, strict=True)]
    joined = ExactInterface(pair, *(along if pair.contact_body == 1 else along[::-1]))
    rows = lambda matrix: None if matrix is None else [_texts(row) for row in matrix]
    return {
        "body1": _described(problem.body1, meshed[0], points[0]),
        "body2": _described(problem.body2, meshed[1], points[1]),
        "neumann_body": pair.neumann_body,
        "friction": str(pair.friction),
        "weights": _texts(joined.grid.weights),
        "kernel": rows(joined.exact_kernel if pair.friction else None),
        "transfer": rows(joined.exact_transfer),
    }


def _described(spec: BodySpec, body: Body, points: NDArray[Any]) -> dict[str, Any]:
    return {
        "points": [_texts(point) for point in points],
        "cells": body.mesh.cells.tolist(),
        "held": np.argwhere(body.known.known).tolist(),
        "surface": body.nodes.tolist(),
        "young": str(spec.young),
        "poisson": str(spec.poisson),
    }


def _texts(values: Iterable[Any]) -> list[str]:
    return [str(Fraction(value)) for value in values]


def _proposed(
    pair: ContactPair, measured: Measured, theta: Fraction, edition: Edition
) -> tuple[float, dict[str, Any], float | None]:
    """What the factor of a bound is below 1, multipliers that should prove it, and the largest factor found."""
    from verification.bounds.exact import enclose
    from verification.bounds.multipliers import QuadraticForms

    try:
        forms = QuadraticForms(pair, measured)
        if edition == "lmi":
            found = enclose(pair, forms, float(theta), gap=math.inf, programs=1)
            lower, spare, multipliers = found.lower, 1 - found.upper.value, found.upper.multipliers
            why = f"its bound of the factor is {found.upper.value:.4g}"
        else:
            result = BOUNDS[edition].evaluate(Subject.of(pair, measured), theta)
            one_minus = result.one_minus_factor
            lower, spare, multipliers = None, 0.0 if one_minus is None else one_minus.value, forms.known(float(theta))
            why = result.why or result.not_computed
    except (LMIError, ValueError) as error:
        raise NoCertificate(str(error)) from None
    if not spare > 0:
        at = f"theta = {float(theta):g}, k = {float(pair.friction):g}"
        raise NoCertificate(f"{BOUNDS[edition].words} proves no contraction at {at}: {why}")
    return spare, _written(multipliers), lower


def _written(multipliers: Weights) -> dict[str, Any]:
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
