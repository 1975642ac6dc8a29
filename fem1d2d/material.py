"""Hooke's law: the Lame parameters of a bar, of plane strain and of plane stress."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True, kw_only=True)
class Material:
    """Lame parameters in the file's unit of stress: ``sigma = lame_lambda tr(eps) I + 2 lame_mu eps``.

    Each is a number, or an array of one for each cell, shape (c,).  ``thin`` is True in plane stress, where sigma and
    eps have only components in the plane.
    """

    lame_lambda: Any
    lame_mu: Any
    thin: bool = False

    @classmethod
    def of_cells(cls, materials: Sequence[Material], which: Any) -> Material:
        """Return the material of a body in which cell i has ``materials[which[i]]``; one material stays as it is."""
        if len(materials) == 1:
            return materials[0]
        first, second = (np.array([getattr(m, name) for m in materials]) for name in ("lame_lambda", "lame_mu"))
        return cls(lame_lambda=first[which], lame_mu=second[which], thin=materials[0].thin)

    def on(self, cells: Any) -> Material:
        """Return the material of some cells, given by their numbers."""
        if np.ndim(self.lame_mu) == 0:
            return self
        return Material(lame_lambda=self.lame_lambda[cells], lame_mu=self.lame_mu[cells], thin=self.thin)

    @property
    def kinds(self) -> Any:
        """A number for each cell, the same for equal parameters, shape (c,); None if there is one material."""
        if np.ndim(self.lame_mu) == 0:
            return None
        known: dict[Any, int] = {}
        pairs = zip(self.lame_lambda.tolist(), self.lame_mu.tolist(), strict=True)
        return np.array([known.setdefault(pair, len(known)) for pair in pairs])

    def over(self, other: Material) -> float | None:
        """Return how many times as stiff it is as a material of the same Poisson's ratio.

        Of materials that differ from cell to cell 1 where they are the same, else None.

        Examples
        --------
        >>> plane_strain(4.0, 0.25).over(plane_strain(2.0, 0.25))
        2.0
        """
        if np.ndim(self.lame_mu) == np.ndim(other.lame_mu) == 0:
            return float(self.continuity(2) / other.continuity(2))
        parameters = ("lame_lambda", "lame_mu")
        return 1.0 if all(np.array_equal(getattr(self, p), getattr(other, p)) for p in parameters) else None

    def continuity(self, dimension: int) -> Any:
        """An upper bound of M^a (4.1) for any body of this material, unit stress.

        ``lame_lambda tr(eps)^2 + 2 lame_mu |eps|^2 <= max(2 lame_mu, d lame_lambda + 2 lame_mu) |eps|^2`` because
        ``tr(eps)^2 <= d |eps|^2``, and ``|eps| <= |grad v|``.

        Examples
        --------
        >>> Material(lame_lambda=1.0, lame_mu=1.0).continuity(2)
        4.0
        """
        each = 2 * self.lame_mu, dimension * self.lame_lambda + 2 * self.lame_mu
        return max(each) if np.ndim(self.lame_mu) == 0 else np.max(each)


def plane_strain(young: Any, poisson: Any) -> Material:
    """Isotropic plane strain, as in Section 6.1 of the paper.

    ``lame_lambda = E nu / ((1 - 2 nu)(1 + nu))``, ``lame_mu = E / (2 (1 + nu))``; any scalar.

    Parameters
    ----------
    young : scalar
        E in the unit of stress that the parameters are to have; ValueError unless E > 0.
    poisson : scalar
        nu; ValueError unless -1 < nu < 1/2.

    Examples
    --------
    >>> plane_strain(2.5, 0.25)
    Material(lame_lambda=1.0, lame_mu=1.0, thin=False)
    """
    _check(young)
    if not -1 < poisson < 0.5:
        raise ValueError(f"Poisson ratio {poisson}: a number with -1 < nu < 0.5 is needed")
    return Material(
        lame_lambda=young * poisson / ((1 - 2 * poisson) * (1 + poisson)), lame_mu=young / (2 * (1 + poisson))
    )


def plane_stress(young: Any, poisson: Any) -> Material:
    """Isotropic plane stress: a thin plate that nothing loads across its plane.

    ``lame_lambda = E nu / (1 - nu^2)``, ``lame_mu = E / (2 (1 + nu))``; any scalar.  They are those of plane strain for
    the moduli ``E (1 + 2 nu)/(1 + nu)^2`` and ``nu/(1 + nu)``.

    Parameters
    ----------
    young : scalar
        E in the unit of stress that the parameters are to have; ValueError unless E > 0.
    poisson : scalar
        nu; ValueError unless -1 < nu <= 1/2.

    Examples
    --------
    >>> plane_stress(3.0, 0.5)
    Material(lame_lambda=2.0, lame_mu=1.0, thin=True)
    """
    _check(young)
    if not -1 < poisson <= 0.5:
        raise ValueError(f"Poisson ratio {poisson}: a number with -1 < nu <= 0.5 is needed")
    return Material(lame_lambda=young * poisson / (1 - poisson**2), lame_mu=young / (2 * (1 + poisson)), thin=True)


def _check(young: Any) -> None:
    if not young > 0:
        raise ValueError(f"Young modulus {young}: a positive number is needed")


def bar(young: Any) -> Material:
    """A bar of unit cross-section: ``sigma = E eps``, that is lame_lambda = E and lame_mu = 0 in one dimension.

    ``young`` is E in the unit of stress that the parameters are to have; ValueError unless E > 0.
    """
    _check(young)
    return Material(lame_lambda=young, lame_mu=young * 0)
