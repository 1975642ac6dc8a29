"""Step II: the exact active set first, the convex program where it fails, one certificate for both."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from fem1d2d.mesh import Bools, Floats
from verification.contact.active_set import ActiveSet, Pattern, Systems
from verification.contact.kkt import KKT, TOLERANCE, KKTCertificate
from verification.dense import STILL
from verification.machine.interrupts import undisturbed
from verification.value import Value

if TYPE_CHECKING:
    from verification.contact.model import ContactModel

Solver = Literal["auto", "cvxpy", "active-set"]

#: Number of the last steps whose loads and patterns are remembered.
KEPT = 128

#: Most unknowns of the convex program: for 500 contact nodes cvxpy and Clarabel take some 5 s, eight times as long for
#: twice as many.
MOST_UNKNOWNS = 1000


class ContactError(RuntimeError):
    """Step II has no minimiser, or no solver reached the KKT certificate."""


class NoMinimiser(ContactError):
    """Nothing holds the contact body in step II: its energy has no minimum."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ContactSolution(Value):
    """A solution of step II with its KKT residuals, which are below the tolerance except those of :class:`ProgramStep`.

    ``v``, shape (t + n,), is the tangential slip and the normal penetration (<= 0: minus the gap), unit of length;
    ``force``, of the same shape, are nodal forces on the other body; ``solver`` found the active set.
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
        ``cvxpy``: the convex program finds the active set at every step; ``active-set``: it never does; ``auto``: it
        does where the active set does not close with its certificate.
    near : str
        What an error should name besides, as a Poisson ratio near 1/2.
    motions : array, shape (t + n, k), optional
        Orthonormal traces of the rigid motions that only contact holds: the kernel of S.
    body : str
        The name of the body in errors.
    systems : Systems, optional
        Of the same matrix, shared with other steps.
    """

    def __init__(
        self,
        S: Floats,
        free: Bools,
        tangential: int,
        solver: Solver = "auto",
        near: str = "",
        motions: Floats | None = None,
        body: str = "the contact body",
        systems: Systems | None = None,
    ) -> None:
        if solver not in ("auto", "cvxpy", "active-set"):
            raise ValueError(f"solver {solver!r}: needed 'auto', 'cvxpy' or 'active-set'")
        self._S, self._free, self._t, self._solver, self._near, self._body = S, free, tangential, solver, near, body
        self._motions = np.zeros((len(S), 0)) if motions is None or not motions.size else motions
        self._active = ActiveSet(S, free, tangential, self._motions, systems)
        self._certificate = KKTCertificate(S, free)
        self._model: ContactModel | None = None
        self._first = Pattern.sticking(len(S) - tangential, tangential)
        self._loads, self._patterns, self._solved = np.zeros((KEPT, len(S))), [self._first] * KEPT, 0
        self.restart()

    def restart(self) -> None:
        """Forget the last pattern, as for the first step of a run; no digit depends on what else is kept."""
        self._pattern, self._steady = self._first, False  # steady: the last step kept the pattern of the one before

    def solve(self, q: Floats, bound: Floats) -> ContactSolution:
        """Solve and certify.

        The program's answer gives the active set; the linear system of that set gives the digits Clarabel leaves out.

        Raises
        ------
        NoMinimiser, ContactError
            Without a minimiser, or a certificate; with too many unknowns for the program that was asked for.
        """
        start, found = self._pattern, None
        if self._solver != "cvxpy":
            close = lambda *hint: self._by_active_set(q, bound, start, "active-set", *hint)
            found = close() if self._steady else None
            if found is None and (hint := self._nearest(q)) != start:
                found = close(hint)
            if found is None and not self._steady:
                found = close()
        if found is None and (way := way_out(self._motions, q, bound)):
            raise NoMinimiser(f"step II has no minimiser: the loads move {self._body} {way}")
        too_many = ""
        if found is None and self._solver != "active-set":
            try:
                answer = self._of_program(q, bound)
            except ContactError as error:
                if self._solver == "cvxpy":
                    raise
                answer, too_many = None, f"; {error}"
            found = answer and self._by_active_set(q, bound, answer.pattern, "cvxpy")
        if found is None:
            found = self._by_active_set(q, bound, self._first, "active-set") or self._by_a_guess(q, bound)
        if found is None:
            why = f": {self._near} is too near 1/2 for doubles" if self._near else ""
            raise ContactError(f"the contact step did not reach a KKT residual of {TOLERANCE:g}{why}{too_many}")
        self._pattern, self._steady = found.pattern, found.pattern == start
        place = self._solved % KEPT
        self._loads[place], self._patterns[place], self._solved = q, found.pattern, self._solved + 1
        return found

    def _nearest(self, q: Floats) -> Pattern:
        """Return the pattern of the step whose loads were nearest to these: a run comes back to where it was."""
        off = self._loads[: self._solved or 1] - q
        return self._patterns[np.argmin(np.einsum("ij,ij->i", off, off))]

    def _by_active_set(
        self,
        q: Floats,
        bound: Floats,
        start: Pattern,
        solver: Literal["cvxpy", "active-set"],
        hint: Pattern | None = None,
    ) -> ContactSolution | None:
        closed = self._active.solve(q, bound, start, hint)
        return closed and self._certified(q, bound, closed, solver)

    def _by_a_guess(self, q: Floats, bound: Floats) -> ContactSolution | None:
        """Return the best of the guesses among which the active set cycles, if that one is certified.

        Signs are read with a slack of 1e-14 of the largest force.  Where forces, or jumps times stiffness, are hardly
        further than that from where a condition changes, as with a friction bound of 1e-13, the nodes may turn each
        other for ever, though each of the guesses meets all conditions to a share of the tolerance.
        """
        repeated = self._active.repeated(q, bound, self._first)
        guesses = (self._certified(q, bound, guess, "active-set") for guess in repeated)
        return min(filter(None, guesses), key=lambda found: found.kkt.residual, default=None)

    def _certified(
        self, q: Floats, bound: Floats, guess: tuple[Floats, Floats, Pattern], solver: Literal["cvxpy", "active-set"]
    ) -> ContactSolution | None:
        v, force, pattern = guess
        kkt = self._certificate.measure(q, bound, v, force)
        if not kkt.residual <= TOLERANCE:
            return None
        return ContactSolution(v=v, force=force, pattern=pattern, kkt=kkt, solver=solver)

    def _of_program(self, q: Floats, bound: Floats) -> ContactSolution | None:
        """Return the answer of the convex program itself, or None where it gives none; ContactError if too large."""
        if (unknowns := self._free.sum()) > MOST_UNKNOWNS:
            limit = f"it is not tried beyond {MOST_UNKNOWNS}, as cvxpy would take minutes"
            raise ContactError(f"the convex program of step II has {unknowns} unknowns: {limit}")
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
    """Step II by the convex program with no active set behind it: right only to the tolerance of the program."""

    def solve(self, q: Floats, bound: Floats) -> ContactSolution:
        """Solve; the certificate is measured but need not hold.

        ContactError where the program has too many unknowns or gives no answer.
        """
        found = self._of_program(q, bound)
        if found is None:
            raise ContactError("cvxpy's solver gave no answer to the contact step")
        return found


def contact_model() -> type[ContactModel]:
    """Import the convex program of step II; cvxpy, which comes with it, takes a second.

    Ctrl-C waits: cvxpy takes an import that it breaks for a solver that is missing.
    """
    with undisturbed():
        from verification.contact.model import ContactModel
    return ContactModel


def way_out(motions: Floats, q: Floats, bound: Floats) -> str:
    """Describe how the loads move a body that only contact holds; empty where contact and friction can hold it.

    The energy of step II is convex and quadratic, with friction piecewise linear, on a polyhedron.  It has a minimiser
    if and only if it does not fall without end, which only rigid motions can cause: with the loads q, the friction
    bounds beta and every rigid motion z that does not penetrate (z_N <= 0), a minimiser exists if and only if::

        q' z <= sum_j beta_j |z_T,j| .

    Parameters
    ----------
    motions : array, shape (t + n, k)
        Orthonormal traces of the rigid motions; normal components along n.
    q : array, shape (t + n,)
        The loads; forces that do no work in the motions may be left out.
    bound : array, shape (t,)
        Friction bounds.
    """
    if not motions.shape[1]:
        return ""
    if _work(motions, q, bound, sliding=True):
        return f"along Gamma_c, where friction holds {float(bound.sum()):.3g} at most"
    return "off" if _work(motions, q, bound, sliding=False) else ""


def _work(motions: Floats, q: Floats, bound: Floats, *, sliding: bool) -> bool:
    """Return True if the loads do more work in some motion (tangential only, if ``sliding``) than friction takes."""
    t, k = len(bound), motions.shape[1]
    size = max(float(np.abs(q).max()), float(bound.max(initial=0.0)))
    if size == 0.0:
        return False
    slip, normal, one = motions[:t], motions[t:], np.eye(t)
    if k == 1:  # the work grows in proportion to the motion, either way
        up, down = normal.max() > STILL, normal.min() < -STILL
        ways = ([] if up or (sliding and down) else [1]) + ([] if down or (sliding and up) else [-1])
        friction = float(bound @ np.abs(slip[:, 0]))
        return any(way * float(motions[:, 0] @ q) - friction > TOLERANCE * size for way in ways)
    from scipy.optimize import linprog  # slow to import and seldom needed

    moves = np.hstack([normal, np.zeros((len(normal), t))])
    rubs = np.block([[slip, -one], [-slip, -one]])
    kept = {"A_ub": rubs, "b_ub": np.zeros(len(rubs)), "A_eq": moves, "b_eq": np.zeros(len(moves))}
    if not sliding:
        kept = {"A_ub": np.vstack([rubs, moves]), "b_ub": np.zeros(len(rubs) + len(moves))}
    found = linprog(
        np.concatenate([-(motions.T @ q), bound]) / size, bounds=[(-1, 1)] * k + [(0, None)] * t, method="highs", **kept
    )
    return bool(found.status == 0 and found.fun < -TOLERANCE)
