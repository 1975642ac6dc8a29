"""Factors, thetas and frictions that the checker of certificates accepts for the rational data of two bodies.

Multipliers come in doubles from the semidefinite bound and are rounded to decimals; a number that they prove in doubles
is made worse by a small share until :mod:`verification.certificate.check` accepts it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from decimal import ROUND_DOWN, ROUND_UP, Context, Decimal
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from flint import ctx
from numpy.typing import NDArray

from fem1d2d.element import lacks
from ndtheory.keys import Part, document, key
from verification.algorithm.rates import ForceNorm
from verification.certificate.check import check, surface_stiffness
from verification.certificate.exact_bodies import ExactInterface, NotExact, exact_normals, exact_points
from verification.constants.measured import FROM_MATRICES
from verification.dense import STILL
from verification.interface.body import Body, Condensed
from verification.interface.pair import ContactPair, pair_from
from verification.machine.progress import Progress, silent
from verification.problem import Problem
from verification.problem.specs import BodySpec
from verification.semidefinite.conditions import times
from verification.semidefinite.interior_point import Weights

#: Shares by which 1 minus a factor is made smaller, until the multipliers prove it for the rational bodies.
MARGINS = (1e-10, 1e-8, 1e-6, 1e-4, 1e-2)

#: Bits of the balls to begin with: these and one for so many unknowns of the larger body, as the radii of its
#: elimination grow by at most one for 19 on Section 6; a multiple of STEP, and never more than MOST.
FEWEST, UNKNOWNS, STEP, MOST = 96, 24, 32, 1280

#: Of several claims, each weaker than the one before, so many are tried before balls of more bits are: these lose 1e-6.
SHARP = 3

#: Bits that the stiffness matrices keep beyond their condition squared: MARGINS ask the checker to tell 1e-10 of 1
#: minus the factor, which is 2^-33 of it, and this leaves as many again.
LEFT = 64

#: The condition of a norm is claimed larger by this share.
WIDER = 1e-4

#: Digits of a multiplier and of a factor.
DIGITS = 12

#: Shares by which a theta or a friction is made smaller than in doubles, until the checker accepts it.
LESS = (0.0, 1e-9, 1e-6, 1e-4, 1e-3, 1e-2)

#: Thetas at which a friction is tried that every small theta is to bear.
SMALL = (Fraction(1, 10**3), Fraction(1, 10**6), Fraction(1, 10**9))

PLANE = "needed a plane problem (dimension = 2): in 1D rho is a ratio of stiffnesses, which needs no proof"
NOT_CONFIRMED = "gives 1 - {:.3g} in doubles, which is not confirmed in rationals"
NOT_BELOW = f"is not confirmed in rationals, nor what is smaller by a share of {LESS[-1]:g}"


class NoCertificate(RuntimeError):
    """Contraction is not proved; the message says what was tried."""


class Claims:
    """The checker for the bodies that :func:`describe` gives, each of which is eliminated once for all claims."""

    def __init__(self, discrete: dict[str, Any], progress: Progress, known: dict[Any, Any] | None = None) -> None:
        self.discrete, self.progress = discrete, progress
        self.known: dict[Any, Any] = {} if known is None else known

    def accepted(
        self, theta: Fraction, factor: Fraction, multipliers: dict[str, Any], norm: dict[str, Any] | None = None
    ) -> dict[str, Any] | None:
        """The claim of a factor with the bits in which the checker accepts it; None where it does not.

        ``norm`` is the one of the claim, as :func:`written_norm` has it; (5.21) by default.
        """
        return self.first_accepted([(theta, factor, multipliers)], norm)

    def first_accepted(
        self, wanted: Sequence[tuple[Fraction, Fraction, dict[str, Any]]], norm: dict[str, Any] | None = None
    ) -> dict[str, Any] | None:
        """The first claim of several, each of theta, factor and multipliers, that is accepted; None where none is.

        The first SHARP are tried before more bits are, as these need another elimination; weaker ones are not.
        """
        most = _allowed(1.5 * self.bits)
        for bits in sorted({self.bits, most}):
            for theta, factor, multipliers in wanted if bits == most else wanted[:SHARP]:
                claim = {"theta": str(theta), "factor": str(factor), "bits": bits, "multipliers": multipliers}
                claim |= {} if norm is None else {"norm": norm}
                words = f"checking theta = {float(theta):.6g}, factor {float(factor):.10g} in balls of {bits} bits"
                self.progress(words, None)
                with suppress(ValueError, ZeroDivisionError):
                    check(self.discrete, claim, lambda body, both, bits=bits: self._eliminated(body, both, bits))
                    return claim
        return None

    @cached_property
    def bits(self) -> int:
        """The bits of balls in which both stiffness matrices keep LEFT beyond their condition squared, or MOST."""
        bodies = self.discrete["body1"], self.discrete["body2"]
        bits, missing = 0, FEWEST + max(2 * len(body["points"]) for body in bodies) / UNKNOWNS
        while missing > 0 and bits < MOST:
            bits = _allowed(bits + missing)
            self.progress(f"eliminating the unknowns off the interface in balls of {bits} bits", None)
            missing = max(self._missing(number, bits) for number in (1, 2))
        return bits

    def _missing(self, number: int, bits: int) -> float:
        """The bits that a body's stiffness matrix lacks; half as many as there are where it cannot be eliminated."""
        both = number == self.discrete["neumann_body"] or Fraction(self.discrete["friction"]) != 0
        try:
            S = self._eliminated(self.discrete[f"body{number}"], both, bits)
        except (ValueError, ZeroDivisionError):
            return bits / 2
        balls = np.array([[(float(x.mid()), float(x.rad())) for x in row] for row in S.tolist()])
        if not np.isfinite(balls).all():
            return bits / 2
        scale = 1 / np.sqrt(np.diag(balls[..., 0]))
        middle, radius = (scale[:, None] * balls[..., part] * scale for part in (0, 1))
        values = np.linalg.eigvalsh(middle)
        condition = values[-1] / values[values > STILL * values[-1]][0]  # rigid motions left out
        wide = float(radius.max()) * condition**2
        return LEFT + math.log2(wide) if wide else 0.0  # no unknown off the interface, nothing is rounded

    def _eliminated(self, body: dict[str, Any], both: bool, bits: int) -> Any:
        key = (json.dumps(body), both, bits)
        if key not in self.known:
            with ctx.workprec(bits):
                self.known[key] = surface_stiffness(body, both=both)
        return self.known[key]

    def confirmed(
        self, theta: Fraction, spare: float, multipliers: dict[str, Any], norm: dict[str, Any] | None = None
    ) -> dict[str, Any] | None:
        """A claim that is accepted, its factor below 1 by nearly ``spare``; None where none is."""
        factors = [1 - _decimal(spare * (1 - margin), ROUND_DOWN) for margin in MARGINS]
        return self.first_accepted([(theta, factor, multipliers) for factor in factors], norm)


class Confirmation:
    """Claims about the rational data of one pair of bodies, decided as a certificate's would be.

    Raises
    ------
    NoCertificate
        No claim about this pair can be proved.
    """

    def __init__(self, pair: ContactPair, *, progress: Progress = silent) -> None:
        if pair.problem is None:
            raise NoCertificate(FROM_MATRICES)
        if pair.problem.dimension != 2:
            raise NoCertificate(PLANE)
        if pair.outside:
            raise NoCertificate(f"outside the theorem: {pair.outside[0]}")
        if pair.contact.lifts:
            raise NoCertificate("the contact body can be lifted rigidly: its form in traces is not definite")
        try:
            claims = Claims(describe(pair.problem, pair), progress)
        except NotExact as error:
            raise NoCertificate(str(error)) from None
        self.pair, self.problem, self.progress, self._claims = pair, pair.problem, progress, claims

    def factor(
        self, theta: Fraction, factor: float, multipliers: Weights, norm: dict[str, Any] | None = None
    ) -> Fraction:
        """A factor of one step that is confirmed, larger than the one that the multipliers prove in doubles.

        In a norm that :func:`written_norm` gives, (5.21) by default.  NoCertificate where none is.
        """
        if not factor < 1:
            raise NoCertificate(f"the factor of one program is {factor:.4g}, which does not contract")
        claim = self._claims.confirmed(theta, 1 - factor, written(multipliers), norm)
        if claim is None:
            raise NoCertificate(f"the factor of one program {NOT_CONFIRMED.format(1 - factor)}")
        return Fraction(claim["factor"])

    def contracts(self, theta: float, multipliers: Weights, norm: dict[str, Any], k: float | None = None) -> None:
        """Confirm that every theta up to one contracts in a norm, at the pair's friction or at k and below.

        With 1 as the factor the multiplied form is positive definite, so that the factor is below 1; smaller thetas
        contract in the same norm, and the conditions of a larger friction hold at a smaller one.  NoCertificate where
        it is not confirmed.
        """
        claims = self._claims
        if k is not None:
            described = describe(self.problem, replace(self.pair, friction=Fraction(k)))
            claims = Claims(described, self.progress, self._claims.known)
        if claims.accepted(Fraction(theta), Fraction(1), written(multipliers), norm) is None:
            at = "" if k is None else f", k = {k:.6g}"
            raise NoCertificate(f"theta = {theta:.6g}{at} is not confirmed in rationals")

    def theta_max(self, theta: float, multipliers: Weights) -> Fraction:
        """A theta up to which every one contracts, a little below the one in doubles, from its multipliers over theta.

        Over theta the form with q = 1 is ``2 |g|^2 - 2 <g, p> - theta |p - g|^2`` minus the multiplied conditions: it
        grows as theta falls, so that one certificate answers for all smaller ones.  NoCertificate where none is
        accepted.
        """
        thetas = [_decimal(theta * (1 - share), ROUND_DOWN) for share in LESS]
        wanted = [(each, Fraction(1), written(times(float(each), multipliers))) for each in thetas]
        if claim := self._claims.first_accepted(wanted):
            return Fraction(claim["theta"])
        raise NoCertificate(f"theta = {theta:.6g} in doubles {NOT_BELOW}")

    def friction_threshold(self, k: float, propose: Callable[[float], Weights]) -> Fraction:
        """A friction up to which every small theta contracts, a little below the one in doubles.

        The multiplied conditions grow with k, so that one certificate answers for all smaller k, and with one theta for
        all smaller ones: see :meth:`theta_max`.  ``propose`` takes a friction to multipliers over theta, as of ``2
        |g|^2 - 2 <g, p>``.

        Raises
        ------
        NoCertificate
        LMIError
        """
        for share in LESS:
            found = _decimal(k * (1 - share), ROUND_DOWN)
            claims = Claims(
                describe(self.problem, replace(self.pair, friction=found)), self.progress, self._claims.known
            )
            multipliers = propose(float(found))
            for theta in SMALL:
                if claims.accepted(theta, Fraction(1), written(times(float(theta), multipliers))):
                    return found
        raise NoCertificate(f"k = {k:.6g} in doubles {NOT_BELOW}")


def written(multipliers: Weights, equal: Sequence[float] = ()) -> dict[str, Any]:
    """Multipliers as rationals, rounded so that ``4 a b >= tau^2`` stays; one for all nodes where they are equal.

    ``equal`` are multipliers of equations that hold on some pieces, in the order of the divisions that lead to them.
    """
    if len(multipliers) < 4:
        multipliers = (*multipliers, *(np.zeros(1),) * 3)
    rules = {"lambda": None, "tau": ROUND_DOWN, "a": ROUND_UP, "b": ROUND_UP}
    found: dict[str, Any] = {}
    for (name, rounding), values in zip(rules.items(), multipliers, strict=True):
        texts = [str(_decimal(value, rounding)) for value in values.tolist()]
        found[name] = texts[0] if len(set(texts)) == 1 else texts
    return found | ({"equal": [str(_decimal(float(value))) for value in equal]} if len(equal) else {})


@dataclass(frozen=True, kw_only=True)
class RationalNorm(Part):
    """A norm in rationals, as texts; normal components of forces are along y."""

    part = "Norm in rationals"

    matrix: list[Any] = key(
        r"rows of the lower triangle of $Q$, $|g|^2 = g^\top Q g$", unit="length/stress", type="list of free"
    )
    condition: str = key(r"at most the largest $g^\top Q g$ where (5.21) is 1; at least 1 is the least", unit="1")


def written_norm(norm: ForceNorm, neumann: Condensed) -> dict[str, Any]:
    """A norm as the checker reads it."""
    matrix = neumann.orient_form(norm.matrix)
    rows = [[str(_decimal(float(value))) for value in row[: i + 1]] for i, row in enumerate(matrix)]
    condition = _decimal(norm.condition * (1 + WIDER), ROUND_UP, digits=5)
    return document(RationalNorm(matrix=rows, condition=str(condition)))


def _allowed(bits: float) -> int:
    return min(STEP * math.ceil(bits / STEP), MOST)


def _decimal(value: float, rounding: str | None = None, digits: int = DIGITS) -> Fraction:
    """A double as a decimal of some digits."""
    return Fraction(Context(prec=digits, rounding=rounding).create_decimal(Decimal(value)))


# --- the bodies -------------------------------------------------------------------------------------------------------


def describe(problem: Problem, pair: ContactPair | None = None) -> dict[str, Any]:
    """The bodies of a plane problem and how they are joined, in rationals as texts; see ``docs/json.md``.

    Coordinates of a mesh file are the doubles that were read from it.
    """
    if problem.several:
        raise problem.refuse("contact", None, "needed one table [contact]: a certificate is about two bodies")
    for name, spec in (("body1", problem.body1), ("body2", problem.body2)):
        if spec.materials:
            needed = "needed a number: a certificate is about bodies of one material each"
            raise problem.refuse(f"{name}.young", [*spec.materials], needed)
    pair = pair_from(problem) if pair is None else pair
    meshed = [side.mesh_body for side in (pair.body1, pair.body2)]
    for body in meshed:
        if why := lacks(body.mesh, "proofs"):
            raise problem.refuse(body.name, None, why)
    points = [exact_points(spec, body) for spec, body in zip((problem.body1, problem.body2), meshed, strict=True)]
    along = [p[body.nodes, 0] for p, body in zip(points, meshed, strict=True)]
    joined = ExactInterface(pair, *(along if pair.contact_body == 1 else along[::-1]))
    rows = lambda matrix: None if matrix is None else [_texts(row) for row in matrix]
    return {
        "body1": RationalBody.of(problem.body1, meshed[0], points[0]).to_dict(),
        "body2": RationalBody.of(problem.body2, meshed[1], points[1]).to_dict(),
        "neumann_body": pair.neumann_body,
        "friction": str(pair.friction),
        "weights": _texts(joined.grid.weights),
        "kernel": rows(joined.exact_kernel if pair.friction else None),
        "transfer": rows(joined.exact_transfer),
    }


def same(one: Any, other: Any) -> bool:
    """True if two descriptions are about the same bodies.

    A key that is null counts as equal to one that is missing.  A later key is null at its default, as the transfer is
    on one grid, so that certificates written before are still about their bodies.

    >>> same({"transfer": None, "friction": "1/5"}, {"friction": "1/5"}), same({"friction": "1/5"}, {"friction": "0"})
    (True, False)
    """
    if not (isinstance(one, Mapping) and isinstance(other, Mapping)):
        return bool(one == other)
    return all(same(one.get(key), other.get(key)) for key in one.keys() | other.keys())


@dataclass(frozen=True, kw_only=True)
class RationalBody(Part):
    """A body in rationals, as texts."""

    part = "Body in rationals"

    points: list[Any] = key("x and y of each node", unit="length", type="list of free")
    cells: list[Any] = key("three nodes of each triangle, anticlockwise", type="list of free")
    held: list[Any] = key(r"node and component (0 or 1) of each unknown that $\Gamma_u$ holds", type="list of free")
    surface: list[int] = key(r"the nodes on $\Gamma_c$ in the direction of $s$", unit="")
    normals: list[Any] | None = key(
        "unit normals at these nodes, rational and equal to the measured ones up to rounding",
        unit="1",
        type="list of free",
        absent="where all are (0, 1)",
    )
    young: str = key(
        "E, of plane strain; of plates in plane stress $E'$ of the {doc}`substitution <problem_file>`", unit="stress"
    )
    poisson: str = key(r"$\nu$, or $\nu'$", unit="1")

    @classmethod
    def of(cls, spec: BodySpec, body: Body, points: NDArray[Any]) -> RationalBody:
        """A body of a problem on its mesh."""
        normals = exact_normals(body.normals)
        return cls(
            points=[_texts(point) for point in points],
            cells=body.mesh.cells.tolist(),
            held=np.argwhere(body.known.held).tolist(),
            surface=body.nodes.tolist(),
            normals=None if normals is None else [_texts(normal) for normal in normals],
            young=str(spec.moduli.young),
            poisson=str(spec.moduli.poisson),
        )


def _texts(values: Iterable[Any]) -> list[str]:
    return [str(Fraction(value)) for value in values]
