"""Laws of friction: the operator S from normal forces to the stress that bounds friction.

A law is an object with an operator, its words, and its relation to the theorem.  :class:`Nonlocal` and :class:`Local`
are in problem files; another one derives from :class:`Law` and is handed to :func:`verification.build`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from fem1d2d.mesh import Floats
from verification.interface.interface import Interface, Law
from verification.registry import LAWS
from verification.value import Value

#: Part of the friction that the kernel may lose or add without a warning.  The share under an even pressure agrees
#: within 0.01 with the share of a block that slides as a whole: 0.93 and 0.92 at radius 0.2 on a length of 1, 0.67 and
#: 0.67 at 1.
SHARE = 0.1

#: Where a node has less than this part of the largest pressure the law may be far off: it carries next to nothing.
LITTLE = 1e-3

#: The other way out of friction that is not Coulomb's at the nodes, where there are two bodies.
OF_TWO = ', or `ndtheory solve` with law = "local-contact", where it is that at each node'


def hat(t: Floats, radius: float) -> Floats:
    """Return the kernel ``omega_r(t) = max(0, 1 - |t|/r)/r``, of integral 1, unit 1/length.

    >>> hat(np.array([0.0, 0.5, 2.0]), 1.0)
    array([1. , 0.5, 0. ])
    """
    return np.maximum(0, 1 - np.abs(t) / radius) / radius


@dataclass(frozen=True, kw_only=True)
class Nonlocal(Law):
    """The law of the paper (2.5) with a hat kernel: ``(S f)_j = sum_i f_i omega_r(x_j - x_i)``.

    S is linear and not renormalised at the ends.  At a plane of symmetry the kernel is reflected, so that half of a
    symmetric body has the friction bound of the whole one.

    Attributes
    ----------
    radius : float
        r > 0, unit of length.

    Raises
    ------
    ValueError
        A radius that is not positive.
    """

    name, label, needs_radius = "nonlocal", "non-local", True
    radius: float

    def __post_init__(self) -> None:
        if not self.radius > 0:
            raise ValueError(f"radius {self.radius}: the non-local law needs a positive radius")

    @classmethod
    def of(cls, radius: Fraction | None) -> Nonlocal | None:
        return None if radius is None else cls(radius=float(radius))

    def scaled(self, length: float) -> Nonlocal:
        return replace(self, radius=self.radius * length)

    def exact(self, radius: Fraction | None) -> Nonlocal:
        return replace(self, radius=radius)  # type: ignore[arg-type]

    @property
    def words(self) -> str:
        return f"non-local, r = {self.radius:g}"

    def operator(self, interface: Interface) -> Floats:
        x, y = interface.contact.x[:, None], interface.neumann.x[None, :]
        return sum(
            (hat(x - image, self.radius) for image in interface.reflected(y, self.radius)), hat(x - y, self.radius)
        )

    def warnings_after(self, interface: Interface, k: float, pressure: Floats, bound: Floats) -> list[str]:
        closed = pressure > LITTLE * pressure.max(initial=0.0)
        closed = closed if closed.any() else ~closed
        weights = interface.contact.weights * closed
        # an even pressure there as the kernel averages it, and the force that a body then carries while it slides, as
        # a part of k times the normal force
        pressed = interface.join.values_back(weights)
        even = (self.operator(interface) @ pressed)[closed]
        length, inside = float(weights.sum()), pressed > 0
        share = float(weights[closed] @ even) / length
        r, width = self.radius, float(np.diff(interface.neumann.x)[inside[1:] | inside[:-1]].max(initial=0.0))
        if r < width * (1 - 1e-9):
            effect = f"multiplies friction by about width/radius = {width / r:.3g}"
            if not interface.one_grid:
                effect = f"multiplies the friction bound of a node by {even.min():.2f} to {even.max():.2f}"
            below = f"contact.radius = {r:g} is below the mesh width {width:g}"
            return [f"{below}: the kernel sees single nodes and {effect}"]
        if share < 1 - SHARE:
            return [
                f"contact.radius = {r:g} is not small against the length {length:g} of the closed part of Gamma_c: the"
                " kernel is cut off at the ends, and a body that slides under an even pressure carries"
                f" {100 * share:.0f} % of k times the normal force"
            ]
        if share > 1 + SHARE:
            return [
                f"contact.radius = {r:g} is not a multiple of the mesh width {width:g}: sums of the kernel multiply"
                f" friction by about {share:.2f}"
            ]
        return []


@dataclass(frozen=True, kw_only=True)
class Local(Law):
    """Coulomb's law itself: ``(S f)_j = f_j / w_j``, carried to the contact grid where the grids differ."""

    name, label = "local", "local"
    outside = "the local Coulomb law: S must map into L2(Gamma_c)"

    @property
    def words(self) -> str:
        return "local law"

    def operator(self, interface: Interface) -> Floats:
        return interface.join.values(np.diag(1 / interface.neumann.weights))

    def warnings_after(self, interface: Interface, k: float, pressure: Floats, bound: Floats) -> list[str]:
        coulomb = k * pressure * (1.0 if interface.shares is None else interface.shares)
        pressed = (coulomb > LITTLE * coulomb.max(initial=0.0)) & (bound > 0)  # it is 0 where a support stands in
        ratios = bound[pressed] / coulomb[pressed]
        if interface.one_grid or (np.abs(ratios - 1) <= SHARE).all():
            return []
        return [
            'contact.law = "local" on grids that differ: the friction bound of closed nodes is'
            f" {ratios.min():.2g} to {ratios.max():.2g} times k times their pressure; needed one grid on both sides of"
            f" Gamma_c{OF_TWO}"
        ]


@dataclass(frozen=True, kw_only=True)
class LocalOfContact(Law):
    """Coulomb's law with the pressure of the contact grid itself, ``(S r)_j = r_j / w_j``, as other codes have it.

    On one grid it is :class:`Local`.
    """

    name, label, of_contact = "local-contact", "local", True
    outside = Local.outside

    @property
    def words(self) -> str:
        return "local law, pressure of the contact grid"

    def operator(self, interface: Interface) -> Floats:
        return np.diag(1 / interface.contact.weights)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class GivenOperator(Value, Law):
    """An operator S given as a matrix, shape (contact nodes, Neumann nodes), unit 1/length.

    ``words`` and ``outside`` come from its law, where that is known.
    """

    name, label = "given", "given"
    matrix: Floats
    words: str = "operator S given as a matrix"
    outside: str = ""

    def scaled(self, length: float) -> GivenOperator:
        return replace(self, matrix=self.matrix / length)

    @property
    def summary(self) -> str:
        return self.words

    def operator(self, interface: Interface) -> Floats:
        return self.matrix


LAWS.provide(Nonlocal, Local, LocalOfContact)
