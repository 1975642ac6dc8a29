"""Losses of the inequalities of the proof, in decades; :mod:`verification.semidefinite.losses` locates them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ndtheory.keys import Part, key


@dataclass(frozen=True, kw_only=True)
class Loss(Part):
    """Loss of one inequality, >= 0; of an inequality between squares it counts the squares."""

    part: ClassVar[str] = "Loss"

    label: str = key("of the inequality in the paper")
    decades: float = key(r"$\log_{10}$ of right side over left side at the worst pair")
    searched: bool = key("whether that pair was found by search, not as an eigenvector; the loss may then be smaller")
    only_unit: bool = key("whether this loss is due to the unit of stress only", default=False)


@dataclass(frozen=True, kw_only=True)
class Losses(Part):
    """The losses of each inequality, and of two chains whose steps add up; (5.30) is repaired and then printed."""

    links: tuple[Loss, ...] = key("each inequality separately")
    friction: tuple[Loss, ...] = key(
        "the steps from the largest friction term found to the bound (5.30) of the friction term, which add up"
    )
    lipschitz: tuple[Loss, ...] = key(
        "the steps from the largest Lipschitz quotient of $T$ found to the bound (5.38) of $T$ in the energy norm, "
        "which add up"
    )
