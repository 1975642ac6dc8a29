"""The constants of the theorem in energy norms: rho, kappa_1, kappa_2."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from ndtheory.constants import GivenConstants, plain
from ndtheory.number import Number, Numeric

#: Sizes whose squares and quotients fit into a double.
SMALLEST, LARGEST = Fraction(1, 10**75), Fraction(10**75)


def _friction(kappa: Fraction) -> bool:
    return kappa == 0 or SMALLEST <= kappa <= LARGEST


@dataclass(frozen=True, kw_only=True)
class EnergyConstants(GivenConstants):
    """rho, kappa_1 and kappa_2: all that the theorem in energy norms knows of the two bodies and of friction.

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

    def __init__(
        self,
        *,
        rho: Numeric | Number,
        kappa_1: Numeric | Number = 0,
        kappa_2: Numeric | Number = 0,
        rho_normal: Numeric | Number | None = None,
    ) -> None:
        keep = self._keep
        largest = keep("rho", rho, "a number rho > 0 (1e-75 to 1e75)", lambda v: SMALLEST <= v <= LARGEST)
        if rho_normal is None:
            object.__setattr__(self, "rho_normal", None)
        else:
            needed = f"a number 0 < rho_normal <= rho = {plain(rho)}"
            keep("rho_normal", rho_normal, needed, lambda v: 0 < v <= largest)
        keep("kappa_1", kappa_1, "a number kappa_1 >= 0 (0, or 1e-75 to 1e75)", _friction)
        keep("kappa_2", kappa_2, "a number kappa_2 >= 0 (0, or 1e-75 to 1e75)", _friction)

    @property
    def frictionless(self) -> bool:
        """Whether kappa_1 = kappa_2 = 0: no node sticks, and tangential components carry no force."""
        return self.kappa_1 == 0 == self.kappa_2

    @property
    def at_work(self) -> Fraction:
        """The rho that enters q: rho_normal without friction (where it is known), else rho."""
        return self.rho_normal if self.frictionless and self.rho_normal is not None else self.rho

    @property
    def corners(self) -> tuple[tuple[Fraction, ...], tuple[Fraction, ...]] | None:
        """rho at work, kappa_1 and kappa_2 where the theorem says most, all least, and where it says least.

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
