"""The Lipschitz constant of one step, between two bounds: semidefinite programs solved, and their answers proved."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from ndtheory import Number
from ndtheory.number import above, below
from verification.bounds.exact import CLOSE, GAP, budget, enclose
from verification.bounds.interior_point import LMIError as LMIError
from verification.bounds.interior_point import Weights
from verification.bounds.multipliers import Certified, QuadraticForms, friction_threshold
from verification.certificate.claims import Confirmation, NoCertificate
from verification.constants import Measured
from verification.interface.pair import ContactPair
from verification.progress import Progress, silent
from verification.value import freeze, to_plain

#: Why the values of this bound are not called certified.
NOT_CERTIFIED = "checked in doubles with a bound on their rounding, for the interface matrices as computed"


@dataclass(frozen=True, kw_only=True)
class Semidefinite:
    """Result of the semidefinite bound for a pair of bodies at one theta.

    Attributes
    ----------
    lipschitz : Number
        A Lipschitz constant of T_theta in the norm (5.21), checked in doubles with a bound on their rounding.
    lower : float
        The largest factor found, of an affine piece of T_theta that some loads and gaps bring about.
    programs, why_apart : int, str
        Number of programs that brought both so close; why they are further apart than was asked for.
    theta_max : Number or None
        Every smaller theta contracts; None where none is proved to.
    friction_threshold, no_threshold : Number or None, str
        Every small theta contracts below it; why there is none, as without a law of friction.
    gave_up : str
        Why the solver proposed no multipliers at this theta, so that ``lipschitz`` comes from the known ones.
    whole, divided : Certified or None, Number or None
        The proof of one program for all pieces of T together, and the smaller ``lipschitz`` in doubles, beside a proved
        one, that dividing the pieces gives.
    largest : tuple of arrays
        The multipliers behind ``theta_max``, over theta.
    not_proved, unverified : str, mapping or None
        Why ``lipschitz`` is not proved; why ``theta_max`` or ``friction_threshold`` is not, None where that was not
        tried.
    """

    lipschitz: Number
    lower: float
    programs: int
    why_apart: str
    theta_max: Number | None
    friction_threshold: Number | None
    gave_up: str = ""
    no_threshold: str = "no law of friction"
    whole: Certified | None = None
    divided: Number | None = None
    largest: Weights = ()
    not_proved: str = NOT_CERTIFIED
    unverified: Mapping[str, str] | None = None

    @property
    def factor(self) -> Number | None:
        """The Lipschitz constant where it is a contraction factor."""
        return self.lipschitz if self.lipschitz.value < 1 else None

    @property
    def gap(self) -> float:
        """Relative distance of the bound from the largest factor found."""
        return self.lipschitz.value / self.lower - 1

    @property
    def certified(self) -> bool:
        """True if the factor is proved beyond a computation in doubles."""
        return self.lipschitz.level != "float"

    @property
    def why_no_factor(self) -> str:
        """Why this theta has no conclusion; empty where it has one."""
        if self.factor is not None:
            return ""
        return self.gave_up or f"its bound {self.lipschitz.value:.3g} of the Lipschitz constant is not below 1"

    def to_dict(self) -> dict[str, Any]:
        """The object ``lmi`` of ``ndtheory.compare/1``."""
        reasons = {
            "factor": self.why_no_factor,
            "lipschitz": "",
            "theta_max": "no theta is proved to contract at this friction",
            "friction_threshold": self.no_threshold,
        }
        reason = {name: why for name, why in reasons.items() if getattr(self, name) is None}
        return {
            **{name: to_plain(getattr(self, name)) for name in reasons},
            "lower": self.lower,
            "gap": self.gap,
            "programs": self.programs,
            "certified": self.certified,
            **({} if self.divided is None else {"divided": self.divided.to_dict()}),
            **({} if self.unverified is None else {"unverified": dict(self.unverified)}),
            "reason": reason if self.certified else reason | {"certified": self.not_proved},
        }

    def proved(
        self, pair: ContactPair, measured: Measured, theta: Fraction, *, progress: Progress = silent
    ) -> Semidefinite:
        """The same for its pair with numbers that are proved for the rational data, or the reasons why some are not.

        The proved Lipschitz constant comes from a single program: its multipliers hold for all pieces of T at once, and
        one quadratic form decides.  A smaller one from dividing the pieces stays in ``divided``.
        """
        assert self.whole is not None
        try:
            confirmation = Confirmation(pair, progress=progress)
        except NoCertificate as error:
            return replace(self, not_proved=str(error), unverified=dict.fromkeys(self._found_beside(), str(error)))

        def multipliers(k: float) -> Weights:
            found = QuadraticForms(pair, measured, friction=k).friction_number()
            return tuple(2 * values for values in found.multipliers)

        proofs: dict[str, Callable[[Number], Fraction]] = {
            "theta_max": lambda number: confirmation.theta_max(number.value, self.largest),
            "friction_threshold": lambda number: confirmation.friction_threshold(number.value, multipliers),
        }
        kept: dict[str, Any] = {}
        why: dict[str, str] = {}
        for name, number in self._found_beside().items():
            try:
                least = below(proofs[name](number))
                kept[name] = Number(value=max(number.value, least), lo=least, level="verified")
            except (NoCertificate, LMIError) as error:
                why[name] = str(error)
        beside = replace(self, **kept, unverified=why)
        try:
            found = confirmation.factor(theta, self.whole.value, self.whole.multipliers)
        except NoCertificate as error:
            return replace(beside, not_proved=str(error))
        most = above(found)
        if not most < 1:
            return replace(beside, not_proved=f"1 - {float(1 - found):.3g} is proved, which no double tells from 1")
        number = Number(value=min(self.whole.value, most), hi=most, level="verified")
        return replace(beside, lipschitz=number, divided=self.lipschitz, not_proved="")

    def _found_beside(self) -> dict[str, Number]:
        """The largest theta and the friction threshold, where there are any."""
        found = {"theta_max": self.theta_max, "friction_threshold": self.friction_threshold}
        return {name: number for name, number in found.items() if number is not None}


def work_out(
    pair: ContactPair, measured: Measured, theta: float, *, exact: bool = False, progress: Progress = silent
) -> Semidefinite:
    """Solve the programs of a pair of bodies at one theta.

    With ``exact`` it goes on to a gap of :data:`verification.bounds.exact.CLOSE`, however many programs that takes.

    Raises
    ------
    LMIError
    ValueError
        As :class:`verification.bounds.multipliers.QuadraticForms`.
    """
    progress("semidefinite bound: largest theta", None)
    forms = QuadraticForms(pair, measured)
    largest = forms.largest_theta()
    energy = measured.friction_threshold
    allowed = None if energy is None else friction_threshold(pair, measured, energy.value, progress=progress)
    progress("semidefinite bound: factor of one step", None)
    asked = {"gap": CLOSE, "programs": None} if exact else {"gap": GAP, "programs": budget(pair.contact.grid.n)}
    found = enclose(pair, forms, theta, **asked, progress=progress)
    return Semidefinite(
        lipschitz=Number.of_float(found.upper.value),
        whole=replace(found.whole, multipliers=freeze(tuple(map(np.array, found.whole.multipliers)))),
        largest=() if largest is None else freeze(tuple(map(np.array, largest.multipliers))),
        lower=found.lower,
        programs=found.programs,
        why_apart=found.why_apart,
        theta_max=None if largest is None else Number.of_float(largest.value),
        friction_threshold=None if allowed is None else Number.of_float(allowed),
        gave_up=found.upper.gave_up,
        no_threshold=measured.why_no_threshold,
    )


def thetas(
    pair: ContactPair, measured: Measured, count: int, *, progress: Progress = silent
) -> tuple[float, list[tuple[float, float]]]:
    """The largest friction that is allowed, and so many values up to it with the largest theta at each.

    Raises
    ------
    LMIError
    ValueError
        As :func:`work_out`, and without a law of friction.
    """
    if measured.friction_threshold is None:
        raise ValueError(measured.why_no_threshold)
    last = friction_threshold(pair, measured, measured.friction_threshold.value, progress=progress)
    kept = []
    for i, k in enumerate(last * np.arange(1, count + 1) / count):
        progress(f"semidefinite bound: largest theta at k = {k:.3g}", i / count)
        found = QuadraticForms(pair, measured, friction=float(k)).largest_theta()
        if found is not None:
            kept.append((float(k), found.value))
    return last, kept
