"""The constants as an inequality of Sections 4 and 5 reads them, and the right sides made of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from ndtheory import PRINTED, energy_norms
from ndtheory import bounds as formulas
from verification.constants import Measured


@dataclass(frozen=True, kw_only=True)
class Reading:
    """The constants as an inequality reads them, and the right sides made of them.

    Attributes
    ----------
    m, M, C_R, C_K : float
        m is ``min(m, 1)`` from (5.36) on as printed.
    u : float
        The stress of the bracket in (5.30): m, or 1 as printed.
    coercivity : float
        m itself.
    C_K_half : float
        ``k C_s C_tr`` with C_tr into H^1/2 (5.8).
    energy : tuple of float
        rho, kappa_1, kappa_2 of the theorem in energy norms.
    """

    m: float
    M: float
    C_R: float
    C_K: float
    u: float
    coercivity: float
    C_K_half: float
    energy: tuple[float, float, float]

    @classmethod
    def of(cls, measured: Measured) -> Reading:
        """As repaired.

        Raises
        ------
        ValueError
            A constant does not exist.
        """
        constants, energy, half = measured.constants(), measured.energy_constants(), measured.C_tr_half
        if constants is None or energy is None or half is None:
            raise ValueError("the constants of the theorem are needed")
        C_s = 0.0 if measured.C_s is None else measured.C_s.value
        return cls(
            m=float(constants.m),
            M=float(constants.M),
            C_R=float(constants.C_R),
            C_K=float(constants.C_K),
            u=float(constants.m),
            coercivity=float(constants.m),
            C_K_half=measured.friction * C_s * half.value,
            energy=(float(energy.at_work), float(energy.kappa_1), float(energy.kappa_2)),
        )

    def in_unit(self, unit: float) -> Reading:
        """All stresses times a factor, before an edition is chosen."""
        scaled = {name: getattr(self, name) * unit for name in ("m", "M", "C_K", "u", "coercivity", "C_K_half")}
        return replace(self, **scaled)

    @property
    def bracket(self) -> Reading:
        """(5.30) to (5.33) as printed."""
        return replace(self, u=PRINTED.unit(self.m))

    @property
    def printed(self) -> Reading:
        """(5.36) on as printed."""
        return replace(self, m=PRINTED.coercivity(self.m), u=PRINTED.unit(self.m))

    @cached_property
    def A(self) -> float:
        """``M C_R``."""
        return self.M * self.C_R

    @cached_property
    def C_T(self) -> float:
        """(5.16), where m is m itself in both editions."""
        return float(formulas.lipschitz(self.coercivity, self.M, self.C_R, self.C_K))

    @cached_property
    def X(self) -> float:
        """The factor of (5.11), by (5.16)."""
        return self.C_T * self.coercivity / self.A

    @cached_property
    def give(self) -> float:
        """``m^2/(M C_R)^2`` of (5.29)."""
        return (self.m / self.A) ** 2

    @cached_property
    def P(self) -> float:
        """The factor of (5.30)."""
        return float(formulas.P(self.C_K, self.m, self.M, self.C_R, self.u))

    @cached_property
    def Q(self) -> float:
        """The Lipschitz constant of T squared, as h_1 has it."""
        return float(formulas.Q(self.C_K, self.m, self.M, self.C_R))

    @cached_property
    def D(self) -> float:
        """``C_T^2/C_R^2 - P``."""
        return float(formulas.D(self.C_K, self.m, self.M, self.C_R, self.u))

    @cached_property
    def C_0(self) -> float:
        """(5.37)."""
        return float(formulas.C0(self.m, self.M, self.C_R))

    def weight(self, theta: float) -> float:
        """The coefficient of ``|||T psi - T psi~|||^2`` in (5.32): positive above C_0."""
        return theta**2 - 2 * theta * (1 - theta) * self.give

    def h_1(self, theta: float) -> float:
        """After (5.39)."""
        return 1 - float(formulas.one_minus_h1(theta, self.D, self.Q))

    def h_2(self, theta: float) -> float:
        """(5.45)."""
        return 1 - float(formulas.one_minus_h2(theta, self.P))

    def gain(self, theta: float) -> float:
        """``1 - K(theta)^2``."""
        h_1, h_2 = formulas.one_minus_h1(theta, self.D, self.Q), formulas.one_minus_h2(theta, self.P)
        return float(min(h_1, h_2))

    @cached_property
    def threshold(self) -> float:
        """``k C_s C_tr`` at k = C_2 (5.43)."""
        return float(formulas.inverse_G(self.m**3 * (1 + self.give), self.m, self.M, self.C_R, self.u))

    def contracting(self) -> tuple[float, ...]:
        """Thetas inside the interval of Proposition 5.6; empty where it is."""
        if not self.threshold > self.C_K:
            return ()
        low = float(formulas.C6(self.P)) if self.P > 1 else 0.0
        high = float(formulas.C1(self.D, self.Q))
        return tuple(low + share * (high - low) for share in (0.1, 0.5, 0.9) if low < high)

    def from_C0(self) -> tuple[float, ...]:
        """C_0 and the thetas above it inside the interval."""
        C0, inside = float(formulas.C0(self.m, self.M, self.C_R)), self.contracting()
        return (C0, *(theta for theta in inside if theta > C0)) if inside else ()

    def q_squared(self, theta: float) -> float:
        """``q(theta)^2`` of the theorem in energy norms."""
        return 1 - float(energy_norms.one_minus_square(theta, *self.energy))
