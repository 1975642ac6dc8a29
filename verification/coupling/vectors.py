"""Eigenvalues of a coupling by a few iterates and their images."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem1d2d.mesh import Floats
from ndtheory import Number
from ndtheory.keys import derived, key
from verification.coupling.evidence import Evidence
from verification.coupling.kinds import CONTACT, Kind
from verification.coupling.methods import MethodRow
from verification.coupling.roles import PROVED, Role, unnumbered
from verification.coupling.spectrum import MARGIN, REAL, Complex, Spectrum
from verification.value import Value

#: The accuracy of vectors that a solver computed in doubles, and of those in single precision, over the largest entry.
DOUBLE, SINGLE = 1e-12, 1e-7

#: Differences of iterates count above so many times that accuracy.
ROUNDING = 100.0

#: Directions of the iterates count above this share of the first one, and where noise changes an image by less than
#: this share of it.
RANK, CLEAN = 1e-9, 1e-2

#: Most decimal digits of vectors that were written as texts, and the number of entries in which they are looked for.
DIGITS, SOME = 12, 1000

#: Ritz values with a larger share as residual stand for several eigenvalues: so many modes more are put between two of
#: them.  Predicted over real steps in 31 linear couplings: 0.82 to 1.28 for IQN-ILS, 0.62 to 1.27 for Aitken.
SETTLED, MORE = 0.02, 3

#: An end is found if 1 + lambda has changed by no more than this share over the last FEWER directions.  Over nine
#: iterates of Aitken in 40 random couplings it changed by 0.024 at most; in a coupling whose smooth data hide the
#: stiff modes it changed by 0.06 or more as long as theta diverged.
STEADY, FEWER = 0.05, 2

#: An end that rises ever more slowly, by no more than this share, may rise as much again: theta has room for it.  One
#: that fell by more than the second share, where no eigenvalue is below 0, is of no symmetric linear map.
RISING, FALLS = 0.2, 0.02

#: Iterates come back where they differ by no more than this share of a step, and ever less, down to the second share:
#: a linear mode with a factor near -1 changes them by as much from period to period.
BACK, RETURNED = 0.03, 1e-6

#: Two images of one iterate that are further apart, over its residual, leave no eigenvalue; nor do such moves of ends.
LOUD = 0.1

#: Residuals below this share of the value show a space that the coupling maps to itself.
INVARIANT = 1e-6

#: The fewest iterates of one contact pattern from which eigenvalues are read, and the first ones left out in turn.
FEWEST, LEFT_OUT = 4, 3

#: Entries of an image below this share of the largest are 0, by rounding: the force of an open node.
OPEN = 1e-12

#: The meaning of images that equal their iterates, and of those that one vector moves away from them.
SOLVED = "each is a solution already, or X was given for TX; needed iterates from before the run has converged"
SHIFTED = "all eigenvalues are -1, with which no theta above 0 converges; has one solver the wrong sign?"

#: What makes negative eigenvalues where a kind of coupling has none.
WRONG_SIGN = (
    "solvers with noise or a memory, one that is far from linear, one solver with the wrong sign (the second one must "
    "return the force that acts on the first body), or positive feedback (kind general)"
)

#: What two evaluations show.
MEMORY = "noise or a memory of the solvers, as one iterate given twice shows"

#: Why an eigenvalue of a general coupling may be -1 or less: noise leaves out a direction, or the error is too large.
DROWNED = "noise drowns a direction of the iterates, in which an eigenvalue of -1 or less may lie: needed less noise"
NEAR = "the least eigenvalue, {:.3g}, may by its error {:.2g} be -1 or less: then no theta converges; give more vectors"

_ERRORS = "estimated errors of both ends"
_UNKNOWN: dict[str, Any] = {
    "unit": "1",
    "null": "of contact with complex eigenvalues",
    "why": "the eigenvalues are complex: contact changes, or friction acts, and then no error is known",
}
_COUNTS = "length of a vector, number of iterates, of those that were read, and of their independent differences"


#: Vectors as rows, a power of 2 as their unit, so that no digit changes, and the accuracy of each row in it.
Scaled = tuple[Floats, float, Floats]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Vectors(Evidence, Value):
    """Iterates and their images, as they were read.

    Eigenvalues are read from the ``used`` iterates: the last ones whose images have the same entries 0, where these are
    FEWEST or more.  ``spectrum`` has ``ritz``, the Ritz values less 1, and modes between them; ``course`` is the
    largest lambda after fewer iterates, and after all; ``loaded`` is True where a node that is open in the last image
    bore a force in an iterate, so that its mode, lambda = 0, has a share in the error; ``period`` is the number of
    steps after which iterates come back, 0 where they do not; ``drowned`` says why an eigenvalue of a general coupling
    may be -1 or less; ``stays`` is the last residual over T x where it does not fall, above 1 of an explosion, else 0.
    An end is found if it no longer changes with more directions: the least one as the exchanged roles need it, in 1 +
    1/lambda, and the largest one in 1 + lambda.
    """

    unknowns: int = key(_COUNTS, unit="1")
    iterates: int = key(_COUNTS, unit="1")
    used: int = key(_COUNTS, unit="1")
    directions: int = key(_COUNTS, unit="1")
    spectrum: Spectrum
    ritz: Complex = key(
        r"Ritz values of $T$, `real` and `imaginary`: estimates of $\lambda$",
        name="eigenvalues",
        type="list of map of number",
        unit="1",
        of=lambda ritz: [{"real": float(v.real), "imaginary": float(v.imag)} for v in ritz],
    )

    error_low = derived(_ERRORS, lambda vectors: vectors.estimated_errors[0], float, **_UNKNOWN)
    error_high = derived(_ERRORS, lambda vectors: vectors.estimated_errors[1], float, **_UNKNOWN)

    symmetric: bool = key("whether the eigenvalues are real")
    changing: bool = key("whether nodes open or close between the iterates", name="contact_changes")
    settled: bool = key("false if they still do in the last four: then no theta follows")
    noise: float | None = key(
        "share by which images of dependent directions, or of one iterate given twice, differ: no error is less",
        unit="1",
        null="where all directions are independent and no iterate was given twice",
        why="the directions of the iterates are independent, and no iterate was given twice",
    )
    apart: float | None = key(
        "of an iterate that was given twice in succession how far its images are apart, over the largest residual so "
        "far: the noise of the solvers, or their memory",
        unit="1",
        null="where none was",
        why="no iterate was given twice in succession",
    )
    low_found: bool = key("false while 1 + 1/lambda of the least eigenvalue changes with every iterate")
    high_found: bool = key("false while the largest eigenvalue does: then no theta follows")
    course: tuple[float, ...]
    loaded: bool
    period: int
    drowned: str
    stays: float = 0.0

    @cached_property
    def seen(self) -> Spectrum:
        """The spectrum, with a mode for open nodes where one of them bore a force."""
        return self.spectrum.with_open_nodes() if self.loaded and not self.linear else self.spectrum

    @property
    def estimated_errors(self) -> tuple[float, float] | tuple[None, None]:
        """Errors of both ends; None where contact is not known to be the same in the iterates.

        Complex eigenvalues show that: a slip that begins or ends leaves no other trace.
        """
        one = self.kind.linear or self.symmetric
        return (self.spectrum.error_low, self.spectrum.error_high) if one else (None, None)

    @property
    def linear(self) -> bool:
        """True if nothing opens or slips, or is not seen to."""
        return self.kind.linear or not (self.changing or self.negative or not self.settled)

    def spectra(self) -> tuple[Role, ...]:
        """The roles of the run; rho is only bounded while the largest eigenvalue is not found."""
        if self.no_map or self.negative or not self.settled:
            return ()
        if self.high_found:
            return (self.estimated(self.seen, "vectors"),)
        why = self.why_no_theta
        names = ("theta_predicted", "rate_predicted", *PROVED, "friction_threshold", "rho_min")
        reason = unnumbered("vectors") | dict.fromkeys(names, why)
        rho = Number.of_float(max(self.seen.high, self.kind.least))
        return (Role(neumann_body=None, rho=rho, spectrum=self.seen, reason=reason, level="bounded"),)

    def methods(self, roles: Sequence[Role]) -> tuple[MethodRow, ...]:
        """In the roles of the run and exchanged; in these roles where no theta converges, which leaves IQN-ILS.

        While the largest eigenvalue is not found only exchanged, where the least one is: their largest eigenvalue is
        one over the least of these roles; their least one may be any down to 0.
        """
        if self.negative and not (self.kind.signed or self.kind.parallel):
            return self.rows_on(self.spectrum, None, theta=1 / float(np.abs(1 + self.spectrum.values).max()))
        low_found = self.low_found and self.linear
        if not roles or self.high_found:
            return self.on_estimates(self.seen, "vectors", low_found=low_found) if roles else ()
        if not low_found or self.seen.low - self.seen.error_low <= 0:
            return ()
        role = self.estimated(self.seen.exchanged().with_open_nodes(), "vectors")
        return self.in_role(role, tied=True, exchanged=True)

    @property
    def why_no_theta(self) -> str:
        """Why no theta follows."""
        if why := self.no_map or self.negative:
            return why
        if not self.settled:
            return "contact still changes in the last iterates, or slip: continue the run, and give more of its vectors"
        if self.high_found:
            return ""
        said = "rho is not found yet: these are too few independent directions" + " above the noise" * bool(self.noise)
        tops = ", ".join(f"{high:.3g}" for high in self.course)
        if odd := unsymmetric(self.kind, self.spectrum, self.course):
            causes = self.kind.given("friction, contact that changes, ") + MEMORY
            causes += ", a solver that is not linear, or convection (kind general)"
            return f"{odd.format(tops)}, as of no linear symmetric coupling: {causes}"
        if self.spectrum.unsure:
            said = f"rho seems to be {self.seen.high:.3g} with an error of {self.spectrum.error_high:.2g}"
        elif len(self.course) > 1:
            said = f"rho changes with every iterate ({tops}), not found yet"
        if self.stays > 1:
            return f"{said}; the run explodes, which leaves only rounding of other modes: give its first iterates"
        if self.stays:
            return f"{said}; ask for a residual above {2 * self.stays:.1g}: the noise keeps it from falling"
        return f"{said}; continue the run with IQN-ILS, and give more of its vectors"

    @property
    def no_map(self) -> str:
        """The reason why these vectors do not belong to one map T; empty where they may."""
        if (self.apart or 0.0) > LOUD:
            share = f"two images of one iterate differ by {self.apart:.2g} of its residual"
            return f"{share}: the solvers are too loose, or have a memory, so that T is not a function of x"
        if self.period:
            contact = self.kind.given("contact that opens and closes, ")
            causes = f"{contact}solvers that are not linear, or theta at its limit, where a mode hardly decays or grows"
            back = f"the iterates come back after {self.period} steps, up to {100 * BACK:.0f} % of a step"
            return f"hardly any progress: {back}, which these make: {causes}; more iterates or a smaller theta tell"
        if self.kind.parallel and (self.noise or 0.0) > LOUD:
            needed = "needed both fields in a row, their images likewise, and solvers with less noise"
            return f"images do not follow from the other field: {needed}"
        return ""

    @property
    def negative(self) -> str:
        """Why eigenvalues below 0 leave no theta; empty where there are none of these."""
        if self.no_map:
            return ""
        least = float(self.ritz.real.min())
        said, causes = f"an eigenvalue seems to be {least:.3g}", self.kind.given("contact that changes, ") + WRONG_SIGN
        if self.kind.signed and self.ritz.real.max() < -REAL:
            return f"all eigenvalues seem to be negative, which these make: {causes}"
        error = self.spectrum.error_low if self.spectrum.error_low <= 1 + least else 0.0  # a larger one excuses nothing
        below_0 = least < -max(REAL / (1 + self.kind.linear) * (1 + abs(self.spectrum.high)), error)
        if self.kind.signed and (least <= RANK - 1 or below_0):
            return f"{said}, which these make: {causes}"
        if self.kind.parallel and not self.spectrum.parallel().theta:
            return "by these eigenvalues no theta above 0 converges with both solvers at once: run one after the other"
        too = f"with -1 or less no theta above 0 converges; {MEMORY}, makes such eigenvalues too"
        return f"{said}: {too}" if least <= RANK - 1 else self.drowned


def seen_in(
    X: Floats,
    TX: Floats,
    *,
    kind: Kind = CONTACT,
    starts: NDArray[np.bool_] | None = None,
    changed: bool = False,
    bore: NDArray[np.bool_] | None = None,
) -> Vectors:
    """The spectrum by Ritz values: iterates x and their images T x as rows, of a run by any method.

    With an orthonormal basis U of the differences of the iterates, the eigenvalues of ``U' (1 + H) U`` lie between the
    ends of ``1 + H`` in the inner product in which H is selfadjoint, and nearly so in the Euclidean one.

    A vector of *parallel* coupling has two fields of one length, one after the other, of which each image depends on
    the other one.  Each has its basis, so that no unit counts, and H is minus the product of both maps.

    Parameters
    ----------
    X, TX : array, shape (k, n)
        k >= 2 vectors and what T makes of them.
    kind : Kind
        Of contact an image that is 0 shows an open node.
    starts : array of bool, shape (k,), optional
        Where another step in time begins, with another T of the same linear part.
    changed : bool
        Whether nodes opened or closed before these iterates.
    bore : array of bool, shape (n,), optional
        The forces that were not 0 before these iterates; of parallel coupling their field is the first.

    ValueError where the iterates, or their residuals, do not differ above rounding.
    """
    stays = _stays(X, TX, 1 + kind.parallel)
    unknowns = X.shape[1] // (1 + kind.parallel)
    forces, given = TX[:, :unknowns], len(X)  # displacements have another unit
    last = given if kind.linear else last_piece(forces)
    changing, read = last < given, last if last >= FEWEST else given
    loaded = bool((at_zero(forces)[-1] & (bears(X[:, :unknowns], forces) | (bore is not None and bore))).any())
    X, TX = X[-read:], TX[-read:]
    inside = np.ones(read - 1, dtype=bool) if starts is None else ~starts[-read + 1 :]
    values, residuals, noise = _ritz(X, TX, inside, kind)
    apart = _apart(X, TX, inside)
    unsure = (noise or 0.0) * float(np.abs(values).max())
    low, high = (max(_error(values, residuals, i), unsure) for i in (0, -1))
    negative = kind.signed and bool(values[0].real < 1 - max(REAL, low))
    later = list(_later(X, TX, inside, kind)) if noise is None else []  # else that shows whether T is one map
    moves = [np.abs((found[[0, -1]] - values[[0, -1]]).real) for found, _ in later]
    if later and LOUD * moves[0][0] > later[0][1][0]:  # more than its residual explains where T is linear
        low = max(low, float(moves[0][0]))
    sizes = np.abs(values)
    modes = _modes(values, residuals / np.maximum(sizes, RANK * sizes.max()), unknowns)
    spectrum = Spectrum(values=modes - 1, source="vectors")
    before = _before(X, TX, inside, len(values), kind)
    steady = lambda ends, within=STEADY: len(before) > 0 and max(ends) <= (1 + within) * min(ends)
    whole = len(values) == unknowns
    known = [whole or bool(residuals[i] <= INVARIANT * abs(values[i]) and stays <= 1) for i in (0, -1)]
    slips = not (kind.linear or spectrum.real) and bool((np.array(moves) > LOUD * values[-1].real).any())
    drowned = NEAR.format(values[0].real - 1, low) if low >= values[0].real else ""
    drowned = DROWNED if apart and _rank(X, inside) > len(values) else drowned
    tops, least = ([float(found[i].real) - (not i) for found in (*before, values)] for i in (-1, 0))
    course = tuple(top - 1 for top in tops[-1 if known[1] else 0 :])
    slows = len(tops) > FEWER and 0 <= tops[-1] - tops[-2] <= tops[-2] - tops[-3]
    rises = slows and not steady(tops) and steady(tops, RISING) and (spectrum.real or not kind.signed)
    moved = max(least) - least[-1], tops[-1] - (tops if rises else tops[-2:])[0]  # they may move as far again
    low, high = (max(error, far * (not sure)) for error, far, sure in zip((low, high), moved, known, strict=True))
    spectrum = replace(spectrum, error_low=low, error_high=high)
    return Vectors(
        kind=kind,
        unknowns=unknowns,
        iterates=given,
        used=read,
        directions=len(values),
        spectrum=spectrum,
        symmetric=spectrum.real,
        changing=changing or ((changed or negative) and not kind.linear),
        settled=not (slips or (changing and last < FEWEST)),
        ritz=values - 1,
        noise=noise,
        apart=apart,
        low_found=min(least) > 0 and (known[0] or steady([1 + 1 / one for one in least])),
        high_found=(known[1] or steady(tops) or rises) and not (spectrum.unsure or unsymmetric(kind, spectrum, course)),
        course=course,
        loaded=loaded,
        period=_period(X),
        drowned=drowned * (not kind.signed),
        stays=stays if noise else 0.0,
    )


def _rank(X: Floats, inside: NDArray[np.bool_]) -> int:
    """The number of independent differences of iterates, each of length 1."""
    D = np.diff(X, axis=0)[inside & (X[1:] != X[:-1]).any(axis=1)]
    D /= np.linalg.norm(D, axis=1, keepdims=True)
    return int(np.linalg.matrix_rank(D, tol=RANK * np.sqrt(len(D)))) if len(D) else 0


def falls(course: Sequence[float]) -> bool:
    """True if the largest eigenvalue falls with more iterates, which it does not where T is linear and symmetric."""
    return any(1 + more > (1 + FALLS) * (1 + less) for more, less in combinations(course, 2))


def unsymmetric(kind: Kind, spectrum: Spectrum, course: Sequence[float]) -> str:
    """Signs of a coupling that is not linear or not symmetric; eigenvalues of contact with friction may be complex."""
    if kind.signed and falls(course):
        return "more iterates show a smaller rho ({})"
    turns = spectrum.error_high < np.abs(spectrum.values.imag).max()
    return "eigenvalues are complex" if kind.name == "tied" and turns and not spectrum.real else ""


def _before(X: Floats, TX: Floats, inside: NDArray[np.bool_], directions: int, kind: Kind) -> list[Complex]:
    """Ritz values of fewer iterates, up to FEWER directions fewer; empty where none would be left."""
    found: list[Complex] = []
    with suppress(ValueError):
        for count in range(len(X) - 1, 1, -1):
            values = _ritz(X[:count], TX[:count], inside[: count - 1], kind)[0]
            if len(values) < min([directions, *map(len, found)]):
                found.append(values)
            if len(values) <= directions - FEWER:
                return found[::-1]
    return []


def _later(X: Floats, TX: Floats, inside: NDArray[np.bool_], kind: Kind) -> Iterator[tuple[Complex, Floats]]:
    """Ritz values and residuals without the first iterates."""
    with suppress(ValueError):
        for count in range(1, min(LEFT_OUT, len(X) - 3) + 1):
            yield _ritz(X[count:], TX[count:], inside[count:], kind)[:2]


def _ritz(X: Floats, TX: Floats, inside: NDArray[np.bool_], kind: Kind) -> tuple[Complex, Floats, float | None]:
    """Ritz values of ``1 + H`` by increasing real part, their residuals, and the noise of the images.

    Differences of consecutive rows count where ``inside``.
    """
    accuracy, half = _accuracy(X, TX), X.shape[1] // 2
    lost = np.zeros((1, 1))
    if kind.parallel:
        one, other = (_scaled(X[:, of], TX[:, of], accuracy) for of in (slice(half), slice(half, None)))
        U, there, noise = _images(one, (TX[:, half:], *other[1:]), inside)
        V, back, more = _images(other, (TX[:, :half], *one[1:]), inside)
        lost = np.linalg.norm(back, 2) * (there - V @ (V.T @ there))  # what no image of the other field is known of
        A, noise = U - back @ (V.T @ there), max((each for each in (noise, more) if each is not None), default=None)
    else:
        rows, unit, accurate = _scaled(X, TX, accuracy)
        fixed = bool(np.abs(TX - X).max() <= accurate[-1] * unit)
        same = "T x" if fixed else "T x - x"
        still = f"{same} {'= x' if fixed else 'is the same'} for every iterate, up to rounding: "
        still += SOLVED if fixed else SHIFTED
        U, A, noise = _images((rows, unit, accurate), (X - TX, unit, accurate), inside, still)
    values, vectors = np.linalg.eig(U.T @ A)
    order = np.argsort(values.real)
    values, vectors = values[order], vectors[:, order]
    residuals = np.linalg.norm(A @ vectors - (U @ vectors) * values, axis=0)
    if kind.parallel:
        residuals = residuals + np.linalg.norm(lost @ vectors, axis=0)
    return values, residuals, noise


def _scaled(rows: Floats, images: Floats, accuracy: float) -> Scaled:
    """Iterates of a field beside its images, accurate to a share of the largest entry so far: a run may explode."""
    largest = np.maximum.accumulate(np.abs(images).max(axis=1))
    unit = math.ldexp(1.0, math.frexp(max(largest[-1], float(np.abs(rows).max())))[1])
    return rows, unit, accuracy * largest / unit


def _images(
    given: Scaled, taken: Scaled, inside: NDArray[np.bool_], still: str = ""
) -> tuple[Floats, Floats, float | None]:
    """An orthonormal basis of the differences of some rows, what a linear map to others makes of it, and its noise.

    ``still`` is the error where the others do not differ; empty where they may be the same.
    """
    D, E = (np.diff(rows, axis=0)[inside].T / unit for rows, unit, _ in (given, taken))
    accurate, accuracy = (each[1:][inside] for *_, each in (given, taken))
    lengths, again = np.linalg.norm(D, axis=0), ~D.any(axis=0)
    kept = lengths > ROUNDING * accurate
    if not kept.any():
        raise ValueError("the iterates do not differ above rounding: needed two different ones")
    changes = np.linalg.norm(E, axis=0)
    loud = float(changes[again].max(initial=0.0))
    kept = heard if (heard := kept & (LOUD * changes > loud)).any() else kept
    lengths, accuracy = lengths[kept], accuracy[kept]
    D, E = D[:, kept] / lengths, E[:, kept] / lengths
    if still and (np.linalg.norm(E, axis=0) <= accuracy / lengths).all():
        raise ValueError(still)
    U, sigma, Vt = np.linalg.svd(D, full_matrices=False)
    images = E @ Vt.T
    sizes = np.linalg.norm(images, axis=0)
    rest = sigma <= RANK * sigma[0]
    largest = float((sizes[~rest] / sigma[~rest]).max()) or 1.0
    more = np.linalg.norm(E - images @ Vt, axis=0) if D.shape[1] > len(D) else []  # of more differences than unknowns
    noise = float(max([*sizes[rest], *more])) / largest if rest.any() or len(more) else None
    rounding = np.sqrt(((Vt * (np.maximum(accuracy, loud) / lengths)) ** 2).sum(axis=1)) / largest
    used = ~rest & (sigma * CLEAN >= np.maximum(rounding, noise or 0.0))
    if not used.any():
        used = sigma == sigma[0]
    if again.any():
        noise = max(noise or 0.0, loud and float((rounding[used] / sigma[used]).max()))
    return U[:, used], images[:, used] / sigma[used], noise


def _accuracy(X: Floats, TX: Floats) -> float:
    """Accuracy of vectors relative to the largest entry: as they were computed in doubles, or rounded to be written."""
    some = np.concatenate([TX.ravel()[:SOME], X.ravel()[:SOME]])
    with np.errstate(over="ignore"):
        single = some.astype(np.float32)
    if (some == single).all():
        whole = (some == np.rint(some)).all()  # numbers that any format holds
        return DOUBLE if whole else SINGLE
    for digits in range(1, DIGITS):
        if all(float(f"{value:.{digits - 1}e}") == value for value in some):
            return float(10.0 ** (1 - digits))
    return DOUBLE


def _apart(X: Floats, TX: Floats, inside: NDArray[np.bool_]) -> float | None:
    """The largest distance of two images of one iterate, over the largest residual up to it; None without any.

    It is 0 where the images are the same up to their accuracy.
    """
    least = ROUNDING * _accuracy(X, TX) * float(np.abs(TX).max())
    same = np.flatnonzero(inside & (X[1:] == X[:-1]).all(axis=1))
    residuals = np.maximum.accumulate(np.linalg.norm(TX - X, axis=1))
    shares = [float(np.linalg.norm(TX[i + 1] - TX[i])) / (residuals[i] or 1.0) for i in same]
    return max((share * (share * residuals[i] > least) for share, i in zip(shares, same, strict=True)), default=None)


def _period(X: Floats) -> int:
    """The least number of steps after which the last iterates come back, over four periods; 0 where they do not."""
    step = float(np.linalg.norm(X[-1] - X[-2]))
    for p in range(2, (len(X) - 1) // 4 + 1):
        apart = np.linalg.norm(X[p:] - X[:-p], axis=1)[-3 * p :] / (step or math.inf)
        if step and apart.max() <= BACK:
            return p if apart[-1] <= max(apart[0] / 2, RETURNED) else 0
    return 0


def _stays(X: Floats, TX: Floats, fields: int) -> float:
    """The median of the last third of the residuals over |T x|, where it is hardly below the least one before.

    Of several fields the larger one counts; 0 elsewhere, and of few iterates.
    """
    sizes, images = (np.linalg.norm(rows.reshape(len(X), fields, -1), axis=2) for rows in (TX - X, TX))
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = (sizes / images).max(axis=1)
    third = len(X) // 3
    stays = float(np.median(shares[-third:]))
    known = third >= FEWEST and (stays <= 1 or bool((LOUD * sizes[-1] > sizes[0]).any()))
    return stays if known and 1.25 * stays >= np.nanmin(shares[:-third]) else 0.0


def last_piece(TX: Floats) -> int:
    """Number of the last images with the same entries 0."""
    zero = at_zero(TX)
    same = (zero == zero[-1]).all(axis=1)
    return len(TX) if same.all() else int(np.argmin(same[::-1]))


def at_zero(rows: Floats) -> NDArray[np.bool_]:
    """Entries that are 0, by rounding: in contact the forces of open nodes."""
    return np.asarray(np.abs(rows) <= OPEN * float(np.abs(rows).max(initial=0.0)))


def bears(X: Floats, TX: Floats) -> NDArray[np.bool_]:
    """Entries that are not 0 in one of the iterates, or of their images."""
    return np.asarray(~(at_zero(X) & at_zero(TX)).all(axis=0))


def _modes(values: Complex, shares: Floats, unknowns: int) -> Complex:
    """Ritz values with modes between those that have not settled, as many as there are unknowns at most."""
    gaps = [i for i in range(len(values) - 1) if max(shares[i : i + 2]) > SETTLED]
    more = min(MORE, (unknowns - len(values)) // max(len(gaps), 1))
    between = [values[i] + (values[i + 1] - values[i]) * j / (more + 1) for i in gaps for j in range(1, more + 1)]
    found = np.concatenate([values, np.array(between, dtype=complex)])
    return found[np.argsort(found.real)]


def _error(values: Complex, residuals: Floats, end: int) -> float:
    """Estimate of the distance of a Ritz value from an eigenvalue: its residual, or less.

    In the inner product of the energy it is the square of the residual over the gap to the next value.
    It is another one here, hence not below MARGIN of the value: a theta 1 % too large may diverge, one 3 % too small
    takes 3 % more steps.  Of 120 random couplings two diverged without it, none with 0.01 to 0.1.
    """
    others = np.delete(np.abs(values - values[end]), end)
    residual, gap = float(residuals[end]), float(others.min(initial=np.inf))
    squared = residual**2 / gap if gap and not values.imag.any() else residual
    return min(residual, max(squared, MARGIN * float(abs(values[end]))))
