"""Who solves step II: the exact active set first, the convex program where it fails, one certificate for both."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from fem1d2d.mesh import Floats
from verification.contact.active_set import ActiveSet, Pattern, Systems
from verification.contact.existence import way_out
from verification.contact.kkt import KKT, TOLERANCE, KKTCertificate
from verification.interrupts import undisturbed
from verification.value import Value

if TYPE_CHECKING:
    from verification.contact.model import ContactModel

Solver = Literal["auto", "cvxpy", "active-set"]


class ContactError(RuntimeError):
    """Step II has no minimiser, or no solver reached the KKT certificate."""


class NoMinimiser(ContactError):
    """Nothing holds the contact body in step II: its energy has no minimum."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ContactSolution(Value):
    """A solution of step II with its KKT residuals; but for :class:`ProgramStep` they are below the tolerance.

    Attributes
    ----------
    v : array, shape (t + n,)
        Tangential slip and normal penetration (<= 0: minus the gap), unit of length.
    force : array, shape (t + n,)
        Nodal forces on the other body.
    solver : {'cvxpy', 'active-set'}
        Who found the active set.
    """

    v: Floats
    force: Floats
    pattern: Pattern
    kkt: KKT
    solver: Literal["cvxpy", "active-set"]

    @property
    def summary(self) -> str:
        return f"KKT residual {self.kkt.residual:.1e}, by {self.solver}"


class ContactStep:
    """Step II for one contact body.

    Parameters
    ----------
    S : array, shape (t + n, t + n)
        Stiffness of the contact body, zero rows and columns where it is held.
    free : bool array, shape (t + n,)
    tangential : int
        t: n in two dimensions, 0 in one.
    solver : {'auto', 'cvxpy', 'active-set'}
        Who finds the active set.  ``cvxpy``: the convex program, at every step; ``active-set``: never the program;
        ``auto``: the program where the active set does not close with its certificate.
    near : str
        What an error should name besides, as a Poisson ratio near 1/2.
    motions : array, shape (t + n, k), optional
        Orthonormal traces of the rigid motions that contact alone holds: the kernel of S.
    body : str
        What an error calls the body.
    systems : Systems, optional
        Of the same matrix, shared with other steps.
    """

    def __init__(
        self,
        S: Floats,
        free: NDArray[np.bool_],
        tangential: int,
        solver: Solver = "auto",
        near: str = "",
        motions: Floats | None = None,
        body: str = "the contact body",
        systems: Systems | None = None,
    ) -> None:
        if solver not in ("auto", "cvxpy", "active-set"):
            raise ValueError(f"solver {solver!r}: needed 'auto', 'cvxpy' or 'active-set'")
        self._S, self._free, self._t, self._solver, self._near = S, free, tangential, solver, near
        self._body = body
        self._motions = np.zeros((len(S), 0)) if motions is None or not motions.size else motions
        self._active, self._certificate = (
            ActiveSet(S, free, tangential, self._motions, systems),
            KKTCertificate(S, free),
        )
        self._model: ContactModel | None = None
        self._pattern = Pattern.sticking(len(S) - tangential, tangential)

    def solve(self, q: Floats, bound: Floats) -> ContactSolution:
        """Solve and certify.

        The program's answer names the active set; the linear system of that set gives the digits Clarabel leaves out.

        Raises
        ------
        NoMinimiser, ContactError
            Without a minimiser, or a certificate.
        """
        found = None if self._solver == "cvxpy" else self._by_active_set(q, bound, self._pattern, "active-set")
        if found is None and (way := way_out(self._motions, q, bound)):
            raise NoMinimiser(f"step II has no minimiser: the loads move {self._body} {way}")
        if found is None and self._solver != "active-set":
            found = self._by_program(q, bound)
        if found is None:
            n = len(self._S) - self._t
            sticking = Pattern.sticking(n, self._t)
            found = self._by_active_set(q, bound, sticking, "active-set") or self._by_a_guess(q, bound, sticking)
        if found is None:
            why = f": {self._near} is too near 1/2 for doubles" if self._near else ""
            raise ContactError(f"the contact step did not reach a KKT residual of {TOLERANCE:g}{why}")
        self._pattern = found.pattern
        return found

    def _by_active_set(
        self, q: Floats, bound: Floats, start: Pattern, solver: Literal["cvxpy", "active-set"]
    ) -> ContactSolution | None:
        closed = self._active.solve(q, bound, start)
        if closed is None:
            return None
        return self._certified(q, bound, closed, solver)

    def _by_a_guess(self, q: Floats, bound: Floats, start: Pattern) -> ContactSolution | None:
        """The best of the guesses among which the active set goes round and round, if that is certified.

        Signs are read with a slack of 1e-14 of the largest force.  Where forces, or jumps times stiffness, differ from
        where a condition changes by little more, as with a friction bound of 1e-13, the nodes may turn each
        other for ever, though each of the guesses meets all conditions to a share of the tolerance.
        """
        guesses = (self._certified(q, bound, guess, "active-set") for guess in self._active.repeated(q, bound, start))
        certified = (found for found in guesses if found is not None)
        return min(certified, key=lambda found: found.kkt.residual, default=None)

    def _certified(
        self, q: Floats, bound: Floats, guess: tuple[Floats, Floats, Pattern], solver: Literal["cvxpy", "active-set"]
    ) -> ContactSolution | None:
        v, force, pattern = guess
        kkt = self._certificate.measure(q, bound, v, force)
        if not kkt.residual <= TOLERANCE:
            return None
        return ContactSolution(v=v, force=force, pattern=pattern, kkt=kkt, solver=solver)

    def _by_program(self, q: Floats, bound: Floats) -> ContactSolution | None:
        found = self._of_program(q, bound)
        return None if found is None else self._by_active_set(q, bound, found.pattern, "cvxpy")

    def _of_program(self, q: Floats, bound: Floats) -> ContactSolution | None:
        """What the convex program itself answers; None where it gives nothing."""
        if self._model is None:
            self._model = contact_model()(self._S, self._free, self._t, self._motions.shape[1])
        v = self._model.solve(q, bound)
        if v is None:
            return None
        force = q - self._S @ v
        pattern = Pattern.of(v, force, bound, float(np.diag(self._S).max()))
        kkt = self._certificate.measure(q, bound, v, force)
        return ContactSolution(v=v, force=force, pattern=pattern, kkt=kkt, solver="cvxpy")


class ProgramStep(ContactStep):
    """Step II as the convex program answers it, with no active set behind it: right to its tolerance alone."""

    def solve(self, q: Floats, bound: Floats) -> ContactSolution:
        """Solve; the certificate is measured and not asked for.

        Raises
        ------
        ContactError
            The program gives no answer.
        """
        found = self._of_program(q, bound)
        if found is None:
            raise ContactError("cvxpy's solver gave no answer to the contact step")
        return found


def contact_model() -> type[ContactModel]:
    """The convex program of step II.

    cvxpy comes with it: that takes a second, and cvxpy takes an import that Ctrl-C breaks for a solver that is missing.
    """
    with undisturbed():
        from verification.contact.model import ContactModel
    return ContactModel
