"""A certificate that T_theta contracts on a mesh: rational data from which anyone can decide the claim again.

The solver of the semidefinite bound proposes multipliers in doubles.  They are rounded to decimals, and the bodies are
described in the rational numbers of the problem file; :mod:`verification.certificate.check`, which imports nothing of
this library, then decides in balls whether these multipliers prove the factor for these bodies.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from ndtheory.keys import Key, key, says
from ndtheory.number import Numeric
from verification.algorithm.theta import choose
from verification.bounds.bound import Subject
from verification.bounds.table import certifying, strongest
from verification.certificate import check
from verification.certificate.claims import (
    NOT_CONFIRMED,
    PLANE,
    Claims,
    NoCertificate,
    describe,
    same,
    written,
    written_norm,
)
from verification.constants import Measured, measure
from verification.document import Document
from verification.interface.pair import UNITS, ContactPair, pair_from
from verification.machine.progress import Progress, silent
from verification.problem import Problem, ProblemError, load
from verification.registry import BOUNDS
from verification.semidefinite import LMIError
from verification.semidefinite.conditions import Conditions
from verification.semidefinite.lipschitz import Division, Leaf
from verification.semidefinite.multipliers import QuadraticForms


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Checked(Document):
    """Result of checking a certificate again."""

    schema: ClassVar[str] = "ndtheory.certificate-check/1"

    units: Mapping[str, str]
    accepted: bool = key("whether the multipliers prove the claim for the bodies of the certificate")
    why: str = key("why not; empty where they do")
    words: str = key("what was checked")
    sha256: str = key("hash of the bodies and what joins them")
    same: bool | None = key(
        "whether these are the bodies of FILE", null="without it", why="no problem was given to compare it with"
    )
    problem: Problem | None = None

    @property
    def summary(self) -> str:
        return f"accepted: {self.words}" if self.accepted else f"refused: {self.why}"


_rational = partial(Key, type="text", unit="1")
_rows = partial(Key, type="list of free")
_multipliers = partial(Key, says="rationals, one for each contact node or one for all of them", type="free")

#: The keys of a claim.
CLAIM = {
    "theta": _rational(says="rational: the relaxation factor"),
    "factor": _rational(says=r"rational: a Lipschitz constant of $T_\theta$ in the norm, over all loads and gaps"),
    "radius": Key(
        says="rational: the kernel is the hat of this radius, which the checker decides",
        type="text",
        unit="length",
        absent="without friction, and where the kernel is another one: $k$ varies, or grids that differ meet along a"
        " line that is not level",
    ),
    "norm": Key(
        says="the norm of the claim; without it (5.21)",
        type="Norm in rationals",
        absent="for another edition than `lyapunov`",
    ),
    "bits": Key(says="bits of the balls in which the checker decides", type="integer", unit=""),
    "multipliers.lambda": _multipliers(unit="1"),
    "multipliers.tau": _multipliers(unit="1"),
    "multipliers.a": _multipliers(unit="length/stress"),
    "multipliers.b": _multipliers(unit="stress/length"),
}

#: The keys of the discrete problem.
DISCRETE = {
    "body1": Key(says="the lower body", type="Body in rationals"),
    "body2": Key(says="the upper body", type="Body in rationals"),
    "neumann_body": Key(says="which body has the Neumann problem", type="integer", unit=""),
    "friction": _rational(says="rational: k, the largest one where it varies"),
    "weights": Key(says="$w_j$ at the contact nodes", type="list of text", unit="length"),
    "kernel": _rows(
        says="a row for each contact node: S on the normal forces of the Neumann nodes,"
        " times $k_j/\\max k$ where k varies",
        unit="1/length",
        null="without friction",
    ),
    "transfer": _rows(
        says="a row for each contact node: P", unit="1", null="where both grids are one, and P the identity"
    ),
}


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Certificate(Document):
    """A claim about T_theta, the bodies that it is about, and its proof."""

    schema: ClassVar[str] = "ndtheory.certificate/1"
    kind: ClassVar[str] = "contraction"

    problem: Problem
    edition: str = key("which bound proposed the factor: `lmi`, `energy`, `repaired` or `lyapunov`")
    claim: dict[str, Any] = key(inside=CLAIM, type="object")
    lower: float | None = key(
        "the largest factor found of two forces, in doubles: no certificate proves less; for `lyapunov` the largest"
        " spectral radius found of a piece",
        null="for another edition than `lmi` and `lyapunov`",
        why="not computed for this edition",
    )
    discrete: dict[str, Any] = key("bodies and what joins them", inside=DISCRETE, type="object")

    @property
    @says("hash of `discrete`, written with sorted keys and without blanks")
    def sha256(self) -> str:
        return check.digest(self.discrete)

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
    def sets(self) -> int:
        """Number of sets of pieces, each with its own multipliers."""
        return sum(1 for _ in check.leaves(self.claim["multipliers"]))

    @property
    def summary(self) -> str:
        return f"theta = {float(self.theta):.4g}, factor {float(self.factor):.6g} proved ({self.edition})"


def certify(
    problem: Problem | Path | str,
    *,
    theta: Numeric | None = None,
    edition: str | None = None,
    exact: bool = False,
    progress: Progress = silent,
) -> Certificate:
    """Prove that one step contracts on the meshes of a problem, for its rational data.

    Parameters
    ----------
    problem : Problem or path
        Two plane bodies.
    theta : number or 'auto', optional
        The problem's by default.
    edition : str, optional
        Name of the bound that proposes factor and multipliers, 'repaired', 'energy', 'lmi' or, in its own norm,
        'lyapunov' among ours; by default the strongest one in the norm (5.21).
    exact : bool
        Divide the pieces of T into sets until the factor is nearly the largest that occurs; the certificate has
        multipliers for each set.  Only the edition 'lmi' does that.
    progress : callable

    Returns
    -------
    Certificate

    Raises
    ------
    NoCertificate
        The bound has no conclusion, or its multipliers do not prove what they should in rationals.
    ProblemError
        Not two plane bodies, or a problem outside the theorem.

    Examples
    --------
    >>> from verification.problem.examples import example
    >>> found = certify(example("section6-60"), theta="0.7")
    >>> found.lower < found.factor < 1
    True
    """
    problem = problem if isinstance(problem, Problem) else load(problem)
    refuse = lambda key, needed: ProblemError(problem.source, key, None, needed)
    edition = strongest() if edition is None else edition
    if edition not in certifying():
        raise ValueError(f"edition {edition!r}: needed one of {', '.join(certifying())}")
    if exact and not BOUNDS[edition].divides:
        raise ValueError(f"edition {edition!r} with exact: needed one that divides the pieces of T")
    if problem.dimension != 2:
        raise refuse("dimension", PLANE)
    pair = pair_from(problem)
    measured = measure(pair)
    if pair.outside:
        raise refuse("contact", f"outside the theorem: {pair.outside[0]}")
    chosen = choose(pair, theta, measured).theta
    assert isinstance(chosen, Fraction)
    progress(f"{BOUNDS[edition].words} proposes multipliers", None)
    spare, multipliers, lower, norm = _proposed(pair, measured, chosen, edition, exact, progress)
    discrete = describe(problem, pair)
    claim = Claims(discrete, progress).confirmed(chosen, spare, multipliers, norm)
    if claim is None:
        raise NoCertificate(f"{BOUNDS[edition].words} {NOT_CONFIRMED.format(spare)}")
    radius = problem.contact.radius
    if pair.friction and radius is not None and check.kernel_is_hat(discrete, str(radius)):
        claim["radius"] = str(radius)
    return Certificate(edition=edition, discrete=discrete, claim=claim, problem=problem, lower=lower)


def check_again(document: Any, problem: Problem | None = None) -> Checked:
    """Decide the claim of a certificate anew, only from its rational data.

    Parameters
    ----------
    document : dict
        As ``certificate.json`` holds it.
    problem : Problem, optional
        The problem whose bodies the certificate should be about.

    Returns
    -------
    Checked

    Raises
    ------
    ValueError
        Not a certificate of contraction.

    Examples
    --------
    >>> from verification.problem.examples import example
    >>> document = certify(example("section6-60"), edition="energy").to_dict()
    >>> document["claim"]["factor"] = "1/2"
    >>> check_again(document).accepted
    False
    """
    if not isinstance(document, dict) or document.get("schema") != Certificate.schema:
        raise ValueError(f"needed a document of the schema {Certificate.schema}")
    if "discrete" not in document:
        raise ValueError(
            "not a certificate of contraction on a mesh, as one of the continuum is not: it has no `discrete`"
        )
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
        same=None if problem is None else same(describe(problem), document["discrete"]),
    )


def _proposed(
    pair: ContactPair, measured: Measured, theta: Fraction, edition: str, exact: bool, progress: Progress
) -> tuple[float, dict[str, Any], float | None, dict[str, Any] | None]:
    """1 minus the factor of a bound, multipliers that should prove it, the largest factor found, and the norm."""

    bound, norm = BOUNDS[edition], None
    try:
        forms = QuadraticForms(pair, measured)
        found = bound.enclose(pair, forms, float(theta), exact=exact, progress=progress)
        if found is not None:
            lower, spare = found.lower, 1 - found.upper.value
            multipliers = _of_tree(found.tree, forms, pair.neumann.upward)
            norm = None if found.norm is None else written_norm(found.norm, pair.neumann)
            why = f"its bound of the factor is {found.upper.value:.4g}"
            if not exact and lower < 1 and bound.divides:
                why += f", the largest factor found {lower:.4g}; dividing the pieces (exact) may prove more"
        else:
            result = bound.evaluate(Subject.of(pair, measured), theta)
            one_minus = result.one_minus_factor
            lower, spare = None, 0.0 if one_minus is None else one_minus.value
            multipliers = written(forms.known(float(theta)))
            why = result.why or result.not_computed
    except (LMIError, ValueError) as error:
        raise NoCertificate(str(error)) from None
    if not spare > 0:
        at = f"theta = {float(theta):g}, k = {float(pair.friction):g}"
        raise NoCertificate(f"{bound.words} proves no contraction at {at}: {why}")
    return spare, multipliers, lower, norm


def _of_tree(
    tree: Leaf | Division, forms: Conditions, upward: bool, divisions: tuple[tuple[str, int], ...] = ()
) -> dict[str, Any]:
    """The multipliers of all sets of pieces, as the checker reads them.

    Its normal components are along y; where the pair's are not, zeta changes its sign, and so do the cases.
    """
    if isinstance(tree, Division):
        further = (*divisions, (tree.name, tree.node))
        cases = [_of_tree(case, forms, upward, further) for case in tree.cases]
        if tree.name == "signs" and not upward:
            cases.reverse()
        return {"divided": tree.name, "node": tree.node, "cases": cases}
    multipliers, equal = forms.apart(tree.upper.multipliers, tree.proved_on)
    return written(multipliers, [equal[name][node] if equal else 0.0 for name, node in divisions])
