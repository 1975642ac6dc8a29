"""The constants that enter the theorem, with their hypotheses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from ndtheory.errors import HypothesisError
from ndtheory.number import exact


def take(key: str, value: Any, needed: str, holds: Callable[[Fraction], bool]) -> Fraction:
    """Read a number exactly and hold it against its hypothesis.

    Raises
    ------
    HypothesisError
        Not a number, or the hypothesis fails; ``needed`` says what was asked.
    """
    try:
        number = exact(value)
    except ValueError:
        raise HypothesisError(key, value, needed) from None
    if not holds(number):
        raise HypothesisError(key, value, needed)
    return number


def relaxation_factor(value: Any) -> Fraction:
    """Read theta exactly; Section 3 needs 0 < theta < 1.

    Raises
    ------
    HypothesisError

    Examples
    --------
    >>> relaxation_factor("1/3")
    Fraction(1, 3)
    """
    return take("theta", value, "a number with 0 < theta < 1", lambda theta: 0 < theta < 1)


@dataclass(frozen=True, kw_only=True)
class Constants:
    """m, M, C_R and C_K: all that Section 5 knows of the two bodies and of friction.

    Numbers are kept exactly as written (see :func:`ndtheory.number.exact`).

    Parameters
    ----------
    m, M : stress
        Smallest coercivity and sum of the continuity constants, (4.1), (4.2).  Hypothesis: 0 < m <= M.
    C_R : dimensionless
        Largest continuity constant of the lifts R_D^1, R_D^2 (after (5.7)).  Hypothesis: C_R >= 1.
    C_K : stress
        ``max|k| C_s C_tr`` (after (5.8)).  Hypothesis: C_K >= 0.
    k : dimensionless, optional
    C_s : stress / sqrt(length), optional
        Continuity constant of ``w -> S(sigma_N(w))`` into L2(Gamma_c).
    C_tr : sqrt(length), optional
        Continuity constant of the tangential trace into L2(Gamma_c).
        With all of ``k, C_s, C_tr`` given, C_K may be omitted and thresholds are on k; else they are on C_K.

    Raises
    ------
    HypothesisError
        Naming the constant, the value received and what was needed.

    Examples
    --------
    >>> Constants(m=1, M=2, C_R="3/2", C_s="1/2", C_tr="1/2", k="1/100").C_K
    Fraction(1, 400)
    """

    m: Fraction
    M: Fraction
    C_R: Fraction
    C_K: Fraction
    C_s: Fraction | None
    C_tr: Fraction | None
    k: Fraction | None

    def __init__(
        self, *, m: Any, M: Any, C_R: Any, C_K: Any = None, C_s: Any = None, C_tr: Any = None, k: Any = None
    ) -> None:
        def keep(key: str, value: Any, needed: str, holds: Any) -> Fraction:
            number = take(key, value, needed, holds)
            object.__setattr__(self, key, number)
            return number

        smallest = keep("m", m, "a number m > 0", lambda v: v > 0)
        keep("M", M, f"a number M >= m = {m}", lambda v: v >= smallest)
        keep("C_R", C_R, "a number C_R >= 1", lambda v: v >= 1)
        friction = {"C_s": C_s, "C_tr": C_tr, "k": k}
        given = [key for key, value in friction.items() if value is not None]
        for key, value in friction.items():
            if value is None:
                object.__setattr__(self, key, None)
            else:
                keep(key, value, f"a number {key} >= 0", lambda v: v >= 0)
        if C_K is not None:
            if given:
                raise HypothesisError("C_K", C_K, f"either C_K or C_s, C_tr and k, not C_K with {', '.join(given)}")
            keep("C_K", C_K, "a number C_K >= 0", lambda v: v >= 0)
        elif len(given) == 3:
            object.__setattr__(self, "C_K", exact(k) * exact(C_s) * exact(C_tr))
        else:
            missing = [key for key in friction if key not in given]
            raise HypothesisError(", ".join(missing), None, "C_s, C_tr and k, or C_K alone")

    @property
    def friction_scale(self) -> Fraction | None:
        """The product C_s C_tr, which turns a threshold on C_K into one on k; None where only C_K is known."""
        return None if self.C_s is None or self.C_tr is None else self.C_s * self.C_tr
