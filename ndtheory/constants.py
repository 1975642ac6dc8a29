"""The constants that enter the theorem, in the norms of the paper and in energy norms, with their hypotheses."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, ClassVar, TypeAlias

from ndtheory.errors import HypothesisError
from ndtheory.number import OF_SIZE, Level, Number, Numeric, UnusualSize, exact, weakest

#: m, M, C_R, C_K and C_s C_tr, the last None where only C_K is known.
Corner = tuple[Fraction, Fraction, Fraction, Fraction, Fraction | None]

#: Sizes between which enclosures are given; beyond them the cancellation in the bounds was not studied.
ORDINARY = Fraction(1, 10**30), Fraction(10**30)

#: Sizes of rho, kappa_1 and kappa_2 whose squares and quotients fit into a double.
SMALLEST, LARGEST = Fraction(1, 10**75), Fraction(10**75)


#: What a constant may be given as.
Given: TypeAlias = Numeric | Number


def take(key: str, value: Numeric, needed: str, holds: Callable[[Fraction], bool]) -> Fraction:
    """Read a number exactly; HypothesisError, quoting ``needed``, if it is none or the hypothesis does not hold."""
    try:
        number = exact(value)
        if holds(number):
            return number
    except UnusualSize as error:
        needed = f"{needed}, {OF_SIZE}" if holds(error.near) else needed
    except ValueError:
        pass
    raise HypothesisError(key, value, needed)


def relaxation_factor(value: Numeric) -> Fraction:
    """Read theta exactly; HypothesisError unless 0 < theta < 1, as Section 3 needs.

    Examples
    --------
    >>> relaxation_factor("1/3")
    Fraction(1, 3)
    """
    return take("theta", value, "a number with 0 < theta < 1", lambda theta: 0 < theta < 1)


@dataclass(frozen=True, kw_only=True)
class GivenConstants:
    """Constants as exact rationals, with the numbers that were given for them.

    A :class:`~ndtheory.number.Number` enters the formulas as its value, read like any float; its level and its ends
    are kept here.

    Attributes
    ----------
    numbers : tuple of (str, Number)
        The constants that were given as a Number, or as a float, which has level ``float``.
    """

    #: Least value that the hypotheses allow, where there is one: a lower end below it is moved there.
    floor: ClassVar[Mapping[str, int]]

    numbers: tuple[tuple[str, Number], ...] = field(init=False, repr=False, default=())

    def _keep(
        self, key: str, value: Any, needed: str, holds: Callable[[Fraction], bool], *, optional: bool = False
    ) -> None:
        given = Number.of_float(value) if isinstance(value, float) else value
        kept = None if optional and value is None else take(key, plain(value), needed, holds)
        if isinstance(given, Number):
            object.__setattr__(self, "numbers", (*self.numbers, (key, given)))
        object.__setattr__(self, key, kept)

    def factors(self, key: str) -> tuple[str, ...]:
        """The given constants whose product is this one: itself, unless it was computed from others."""
        return (key,)

    def number(self, key: str) -> Number | None:
        """A constant with its level and its ends; None where there is none.

        A constant that was written exactly is ``exact`` if a double is that number; otherwise it is ``verified``,
        between the two doubles next to it.

        Examples
        --------
        >>> c = Constants(m=Number(value=1.0, lo=0.9, hi=1.1, level="guaranteed"), M=2, C_R="4/3", C_K=0)
        >>> c.number("m").lo, c.number("M").level, c.number("C_R").level
        (0.9, 'exact', 'verified')
        """
        given, value, ends = dict(self.numbers), getattr(self, key), self.ends(key)
        if value is None or key in given:
            return given.get(key)
        level = weakest(given[factor].level for factor in self.factors(key) if factor in given)
        return Number.of_float(value) if ends is None else Number.enclosed(value, *ends, level)

    def ends(self, key: str) -> tuple[Fraction, Fraction] | None:
        """The enclosure of a constant as rationals, its value twice where it was written exactly; or None."""
        given, low, high = dict(self.numbers), Fraction(1), Fraction(1)
        for factor in self.factors(key):
            value, number = getattr(self, factor), given.get(factor)
            lo, hi = value, value
            if number is not None:
                if number.lo is None or number.hi is None:
                    return None
                # the value may be read as a decimal just outside the doubles that enclose it
                lo, hi = min(Fraction(number.lo), value), max(Fraction(number.hi), value)
                if factor in self.floor:
                    lo = max(lo, Fraction(self.floor[factor]))
            if value is None:
                return None
            low, high = low * lo, high * hi
        return low, high

    def enclosures(self, *keys: str) -> list[tuple[Fraction, Fraction]] | None:
        """The ends of some constants; None unless a Number was given and all of these have ends of ordinary size.

        Friction may be arbitrarily small: that makes no cancellation worse.
        """
        if not self.numbers:
            return None
        found = []
        for key in keys:
            ends, least = self.ends(key), 0 if self.floor.get(key) == 0 else ORDINARY[0]
            if ends is None or not least <= ends[0] <= ends[1] <= ORDINARY[1]:
                return None
            found.append(ends)
        return found

    @property
    def level(self) -> Level:
        """The weakest level of the constants given."""
        return weakest(number.level for _, number in self.numbers)


def plain(value: Given) -> Numeric:
    """The value of a Number; any other constant as it was given."""
    return value.value if isinstance(value, Number) else value


@dataclass(frozen=True, kw_only=True)
class Constants(GivenConstants):
    """m, M, C_R and C_K: the only numbers of the two bodies and of friction that enter Section 5.

    Numbers are kept exactly as written (see :func:`ndtheory.number.exact`).  Each may be a
    :class:`~ndtheory.number.Number` too: its level and its ends are kept (:meth:`number`) and enter the bounds.

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

    floor = {"C_R": 1, "C_K": 0, "C_s": 0, "C_tr": 0, "k": 0}

    m: Fraction
    M: Fraction
    C_R: Fraction
    C_K: Fraction
    C_s: Fraction | None
    C_tr: Fraction | None
    k: Fraction | None

    def __init__(
        self,
        *,
        m: Given,
        M: Given,
        C_R: Given,
        C_K: Given | None = None,
        C_s: Given | None = None,
        C_tr: Given | None = None,
        k: Given | None = None,
    ) -> None:
        keep = self._keep
        keep("m", m, "a number m > 0", lambda v: v > 0)
        keep("M", M, f"a number M >= m = {plain(m)}", lambda v: v >= self.m)
        keep("C_R", C_R, "a number C_R >= 1", lambda v: v >= 1)
        friction = {"C_s": C_s, "C_tr": C_tr, "k": k}
        for key, value in friction.items():
            keep(key, value, f"a number {key} >= 0", lambda v: v >= 0, optional=True)
        given = [key for key, value in friction.items() if value is not None]
        if C_K is not None:
            if given:
                raise HypothesisError("C_K", C_K, f"either C_K or C_s, C_tr and k, not C_K with {', '.join(given)}")
            keep("C_K", C_K, "a number C_K >= 0", lambda v: v >= 0)
        elif len(given) == 3:
            object.__setattr__(self, "C_K", math.prod(getattr(self, key) for key in friction))
        else:
            missing = [key for key in friction if key not in given]
            raise HypothesisError(", ".join(missing), None, "C_s, C_tr and k, or C_K alone")

    def factors(self, key: str) -> tuple[str, ...]:
        return ("k", "C_s", "C_tr") if key == "C_K" and self.k is not None else (key,)

    @property
    def friction_scale(self) -> Fraction | None:
        """The product C_s C_tr, which turns a threshold on C_K into one on k; None where only C_K is known."""
        return None if self.C_s is None or self.C_tr is None else self.C_s * self.C_tr

    @property
    def corners(self) -> tuple[Corner, Corner] | None:
        """m, M, C_R, C_K and the friction scale at two corners of their enclosures: strongest and weakest theorem.

        It says more the larger m and the smaller the others are (:mod:`ndtheory.bounds`).  None unless a constant was
        given as an enclosure, all others as one or exactly, and m <= M holds throughout.
        """
        ends = self.enclosures("m", "M", "C_R", "C_K", *(() if self.friction_scale is None else ("C_s", "C_tr")))
        if ends is None or ends[0][1] > ends[1][0]:
            return None
        m, M, C_R, C_K, *scale = ends
        best, worst = ((m[1 - i], M[i], C_R[i], C_K[i], scale[0][i] * scale[1][i] if scale else None) for i in (0, 1))
        return best, worst


@dataclass(frozen=True, kw_only=True)
class EnergyConstants(GivenConstants):
    """rho, kappa_1 and kappa_2: the only numbers of the bodies and of friction in the theorem in energy norms.

    Numbers are kept exactly as written (see :func:`ndtheory.number.exact`).  Each may be a
    :class:`~ndtheory.number.Number` too: its level and its ends are kept (:meth:`number`) and enter the bound.

    Parameters
    ----------
    rho : dimensionless
        Largest eigenvalue of ``S_1 phi = rho S_2 phi``, contact body over Neumann body.  Hypothesis: rho > 0;
        from 1e-75 to 1e75, so that its square fits into a double.
    kappa_1, kappa_2 : dimensionless, optional
        ``k C_s C_t1`` and ``k C_s C_t2`` with ``C_s = sup |S sigma_N(w)|_L2 / |w|_a2`` and
        ``C_ta = sup |v_T|_L2 / |v|_aa``; 0 by default.  Hypothesis: both >= 0, of
        sizes as rho where they are not 0.
    rho_normal : dimensionless, optional
        rho with the tangential components condensed out; takes the place of rho where kappa_1 = kappa_2 = 0.
        Hypothesis: 0 < rho_normal <= rho.

    Raises
    ------
    HypothesisError
        Naming the constant, the value received and what was needed.

    Examples
    --------
    >>> EnergyConstants(rho="3/2").at_work
    Fraction(3, 2)
    """

    floor = {"kappa_1": 0, "kappa_2": 0}

    rho: Fraction
    kappa_1: Fraction
    kappa_2: Fraction
    rho_normal: Fraction | None

    def __init__(self, *, rho: Given, kappa_1: Given = 0, kappa_2: Given = 0, rho_normal: Given | None = None) -> None:
        ordinary = lambda v: SMALLEST <= v <= LARGEST
        self._keep("rho", rho, "a number rho > 0 (1e-75 to 1e75)", ordinary)
        needed = f"a number 0 < rho_normal <= rho = {plain(rho)}"
        self._keep("rho_normal", rho_normal, needed, lambda v: 0 < v <= self.rho, optional=True)
        for key, kappa in {"kappa_1": kappa_1, "kappa_2": kappa_2}.items():
            self._keep(key, kappa, f"a number {key} >= 0 (0, or 1e-75 to 1e75)", lambda v: v == 0 or ordinary(v))

    @property
    def frictionless(self) -> bool:
        """True if kappa_1 = kappa_2 = 0: no node sticks, and tangential components carry no force."""
        return self.kappa_1 == 0 == self.kappa_2

    @property
    def at_work(self) -> Fraction:
        """The rho that enters q: rho_normal without friction (where it is known), else rho."""
        return self.rho_normal if self.frictionless and self.rho_normal is not None else self.rho

    @property
    def corners(self) -> tuple[tuple[Fraction, ...], tuple[Fraction, ...]] | None:
        """rho at work, kappa_1 and kappa_2 at their lower ends, where the theorem says most, and at their upper ends.

        None unless a constant was given as an enclosure, and all others as one or exactly.
        """
        normal = () if self.rho_normal is None else ("rho_normal",)
        ends = self.enclosures("kappa_1", "kappa_2", "rho", *normal)
        if ends is None:
            return None
        low, high = zip(*ends, strict=True)
        # the last is rho_normal where it is known
        best, worst = ((at[-1] if at[0] == 0 == at[1] else at[2], at[0], at[1]) for at in (low, high))
        return best, worst
