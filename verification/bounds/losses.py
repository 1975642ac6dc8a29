"""Losses of the inequalities of the proof, in decades; :mod:`verification.semidefinite.losses` locates them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Loss:
    """Loss of one inequality.

    Attributes
    ----------
    label : str
        The paper's.
    decades : float
        ``log10(right/left)`` at the worst pair, >= 0; of an inequality between squares it counts the squares.
    searched : bool
        True if that pair was found by search (the loss may then be smaller), not as an eigenvector.
    only_unit : bool
        True if nothing is lost: the effect of a change of the unit of stress.
    """

    label: str
    decades: float
    searched: bool
    only_unit: bool = False


@dataclass(frozen=True, kw_only=True)
class Losses:
    """The losses of each inequality, ``links``, and of two chains, whose steps add up.

    ``friction`` leads from the largest friction term found to its bound (5.30), repaired and then printed,
    ``lipschitz`` from the largest ``|||T psi - T psi~||| / |||psi - psi~|||`` found to its bound (5.38).
    """

    links: tuple[Loss, ...]
    friction: tuple[Loss, ...]
    lipschitz: tuple[Loss, ...]

    def to_dict(self) -> dict[str, Any]:
        """The object ``losses`` of ``ndtheory.compare/1``."""
        return {name: [vars(loss) for loss in losses] for name, losses in vars(self).items()}
