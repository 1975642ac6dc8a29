"""What was seen of the interface matrices that advice was asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

#: From this share of zeros off the diagonal on a matrix looks assembled.  A Schur complement on an interface of which
#: the components do not act on each other has up to 2/3; linear triangles at 60 unknowns have 3/4 and more.
SPARSE = 0.75

#: The ordering that is assumed where it matters.
ORDERING = "all first components of the nodes (tangential, from left to right), then all second ones (normal)"


@dataclass(frozen=True, kw_only=True)
class SeenMatrix:
    """One matrix or operator.

    Attributes
    ----------
    rows : int
    form : {'matrix', 'operator'}
    asymmetry : float or None
        ``max |A - A'| / max |A|``; of an operator ``|x'Ay - y'Ax|`` over the size of its terms for two random vectors;
        None where it is known by its solves alone.
    zeros : float or None
        The share of zeros off the diagonal; None of an operator.
    free_motions : int or None
        How many rigid motions its supports leave; None of an operator.
    """

    rows: int
    form: Literal["matrix", "operator"]
    asymmetry: float | None = None
    zeros: float | None = None
    free_motions: int | None = None

    def notes(self, name: str, rounding: float) -> list[str]:
        """What a user should know of it.

        Parameters
        ----------
        name : str
        rounding : float
            An asymmetry up to this is rounding.
        """
        found = []
        if self.asymmetry is not None and self.asymmetry > rounding:
            taken = "its symmetric part is taken" if self.form == "matrix" else "no residual means less than that"
            found.append(f"{name} is asymmetric by {self.asymmetry:.2g} of its largest entry: {taken}")
        if self.zeros is not None and self.zeros >= SPARSE:
            found.append(
                f"{100 * self.zeros:.0f} % of the entries of {name} off the diagonal are 0, as in an assembled"
                f" stiffness matrix ({100 * SPARSE:.0f} % or more); a Schur complement on the interface is dense."
                "  If it is the matrix of a whole body, condense it first: rho below is not that of the coupling"
            )
        return found

    def to_dict(self) -> dict[str, Any]:
        """A member of ``matrices``."""
        reason = {
            name: "an operator tells no entries" if name != "asymmetry" else "known by its solves alone"
            for name in ("asymmetry", "zeros", "free_motions")
            if getattr(self, name) is None
        }
        return {**asdict(self), "reason": reason}


@dataclass(frozen=True, kw_only=True)
class SeenLanczos:
    """The ends of the spectrum of (S_c, S_n) for one role, by Lanczos.

    Attributes
    ----------
    neumann_body : {1, 2}
    rho, rho_min : float
        The largest and the least value found: Rayleigh quotients, so that the largest eigenvalue is at least ``rho``
        and the least one at most ``rho_min``.
    residual, residual_min : float
        Some eigenvalue lies within it.
    steps : int
    """

    neumann_body: Literal[1, 2]
    rho: float
    residual: float
    rho_min: float
    residual_min: float
    steps: int


@dataclass(frozen=True, kw_only=True)
class SeenMatrices:
    """What was given instead of a problem.

    Attributes
    ----------
    S1, S2 : SeenMatrix
    transfer : tuple of int or None
        Rows and columns of P as given; None where there is none.
    neumann_body : {1, 2} or None
        From whose unknowns P leads; None without.
    ordering : str or None
        The ordering that is assumed; None where rho does not depend on it.
    lanczos : tuple of SeenLanczos
        Empty where matrices gave the whole spectrum.
    notes : tuple of str
        What a user should know.
    """

    S1: SeenMatrix
    S2: SeenMatrix
    transfer: tuple[int, int] | None = None
    neumann_body: Literal[1, 2] | None = None
    ordering: str | None = None
    lanczos: tuple[SeenLanczos, ...] = ()
    notes: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """The key ``matrices``."""
        reason: Mapping[str, str] = {
            name: why
            for name, why in (
                ("transfer", "no transfer was given"),
                ("neumann_body", "no transfer was given"),
                ("ordering", "rho does not depend on it, so long as both have the same"),
            )
            if getattr(self, name) is None
        }
        return {
            "S1": self.S1.to_dict(),
            "S2": self.S2.to_dict(),
            "transfer": None if self.transfer is None else list(self.transfer),
            "neumann_body": self.neumann_body,
            "ordering": self.ordering,
            "lanczos": [asdict(found) for found in self.lanczos],
            "notes": list(self.notes),
            "reason": dict(reason),
        }
