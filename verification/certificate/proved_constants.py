"""The constants of a problem between proved bounds.

Each constant is the largest eigenvalue of a pencil, or its root.  Where the pencil has Schur complements, matrices that
are proved to be at least and at most them take their place (:mod:`fem1d2d.proofs.loewner`): a larger X and a smaller Y
give an upper bound, the other way round a lower one.  Forms that are no Schur complements are bounded by these:

* C_s, whose form is quadratic in S_a: ``low <= S_a <= high`` gives ``|S_a - low|_ij <= sqrt(G_ii G_jj)`` with
  ``G = high - low``, since ``0 <= S_a - low <= G``.
* C_R, the H1 norm of the elastic lift: a lift in doubles is off by ``A_II^-1 r``, r its residual, whose H1 norm is at
  most ``|r|/sqrt(m^a s)`` with s a lower bound of the eigenvalues of A_II.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from fem1d2d.mesh import Bools, Floats
from fem1d2d.proofs.enclosed import UNIT, Enclosed, gamma, upwards
from fem1d2d.proofs.loewner import Elimination, positive_definite
from fem1d2d.proofs.proved import Ends, enclose_largest, inverse, root
from ndtheory import Number
from verification.certificate.exact_bodies import ExactBody, ExactInterface, NotExact
from verification.constants.measured import ALL_NAMES, FROM_MATRICES, PRODUCTS, BodyConstants, Measured, product
from verification.constants.operators import needs_matrices
from verification.interface.assembly import TwoBodies
from verification.interface.body import Name
from verification.interface.pair import ContactPair
from verification.machine.progress import Progress, silent
from verification.machine.threads import one_thread
from verification.registry import PROOFS, Prover

#: A form between two others in the order of symmetric matrices: from below and from above.
Between = tuple[Enclosed, Enclosed]

#: Why a proof was tried and not found.
NOT_PROVED = "rounding errors exceed what is to be proved"

#: The lift of more entries than these is not made.
MOST_OF_LIFT = 20_000_000

#: Share of the square of a lift that its error gets; the larger one of this and the error itself.
SHARE = 2.0**-40

NOTHING: Ends = (None, None)
ZERO = Number(value=0.0, lo=0.0, hi=0.0, level="exact")


def verify(measured: Measured, of: ContactPair | TwoBodies, *, progress: Progress = silent) -> Measured:
    """The same constants between proved bounds, for the exact data of the problem on its mesh.

    The values of ``measured`` are taken as guesses, and kept where they lie between the bounds.  Proved numbers have
    the level ``verified``; ``unverified`` says why a number still is ``float``.
    """
    if of.problem is None:
        return replace(measured, unverified=dict.fromkeys(_known(measured), FROM_MATRICES))
    with one_thread():
        return Proof(measured, of, progress).result()


def _known(measured: Measured) -> list[str]:
    return [name for name in ALL_NAMES if getattr(measured, name) is not None]


def _join(ends: list[Ends], combine: Callable[[Any], float]) -> Ends:
    """Bounds of what grows with each of some numbers."""
    low, high = (None if any(end is None for end in side) else combine(side) for side in zip(*ends, strict=True))
    return low, high


class Proof:
    """One problem whose constants are proved one after the other; parameters as for :func:`verify`.

    After :meth:`result` there are ``bodies``, the :class:`ExactBody` by name, and ``S`` and ``E``, the Schur
    complements of their stiffness and of their Gram matrix on the interface, between others.
    """

    def __init__(self, measured: Measured, of: ContactPair | TwoBodies, progress: Progress) -> None:
        self.measured, self.of, self.progress = measured, of, progress
        self.numbers: dict[str, Any] = {}
        self.why: dict[str, str] = {}

    def result(self) -> Measured:
        """The constants with what was proved."""
        measured = self.measured
        try:
            assert self.of.problem is not None
            self.bodies = {body.name: ExactBody.of(self.of.problem, body) for body in self._mesh_bodies()}
        except NotExact as error:
            return replace(measured, unverified=dict.fromkeys(_known(measured), str(error)))
        self._of_bodies()
        if isinstance(self.of, TwoBodies):
            self.why |= dict.fromkeys(_known(measured), needs_matrices(self.of))
        elif measured.rho_max is not None:
            self._of_pair(self.of)
        for name in _known(measured):
            value = getattr(measured, name)
            if value.level == "exact" or name in self.numbers:
                self.why.pop(name, None)
            elif value.level == "float":
                self.why.setdefault(name, NOT_PROVED)
        return replace(measured, **self.numbers, unverified=self.why)

    def _mesh_bodies(self) -> list[Any]:
        of = self.of
        return of.elastic if isinstance(of, TwoBodies) else [of.body1.mesh_body, of.body2.mesh_body]

    def _keep(self, name: str, ends: Ends) -> Ends:
        value = getattr(self.measured, name)
        if value is not None and value.level == "float" and ends != NOTHING:
            self.numbers[name] = Number.within(value.value, *ends, "verified")
        return ends

    # --- m and M ------------------------------------------------------------------------------------------------------

    def _of_bodies(self) -> None:
        ends: dict[str, dict[str, Ends]] = {"m": {}, "M": {}}
        for name, body in self.bodies.items():
            plain: BodyConstants = getattr(self.measured, name)
            order = Elimination(body.stiffness).order
            A, H = body.stiffness, body.gram
            own: dict[str, Ends] = {}
            if plain.m.level == "exact":
                ends["m"][name] = (0.0, 0.0)
            else:
                self.progress(f"proving m of {name}", None)
                ends["m"][name] = inverse(enclose_largest((H, A), guess=1 / plain.m.value, order=order))
                own["m"] = ends["m"][name]
            self.progress(f"proving M of {name}", None)
            own["M"] = ends["M"][name] = enclose_largest((A, H), guess=plain.M.value, order=order)
            proved = {key: both for key, both in own.items() if both != NOTHING}
            kept = {key: Number.within(getattr(plain, key).value, *both, "verified") for key, both in proved.items()}
            self.numbers[name] = replace(plain, m=kept.get("m", plain.m), M=kept.get("M", plain.M))
        self.m = {name: low for name, (low, _) in ends["m"].items()}
        self._keep("m", _join(list(ends["m"].values()), min))
        low, high = _join(list(ends["M"].values()), sum)
        low, high = (None if end is None else math.nextafter(end, to) for end, to in ((low, 0.0), (high, math.inf)))
        self._keep("M", (low, high))

    # --- along Gamma_c ------------------------------------------------------------------------------------------------

    def _of_pair(self, pair: ContactPair) -> None:
        contact, neumann = (self.bodies[side.mesh_body.name] for side in (pair.contact, pair.neumann))
        self.pair, self.contact, self.neumann = pair, contact.body.name, neumann.body.name
        self.joint = ExactInterface(pair, contact.x, neumann.x)
        self.progress("proving Schur complements", None)
        self.S = {name: self._schur(body, body.stiffness) for name, body in self.bodies.items()}
        self.E = {name: self._schur(body, body.gram) for name, body in self.bodies.items()}
        free, grid = pair.contact.free, pair.contact.grid
        measured = self.measured
        self.tangential: Bools = (np.arange(grid.size) < grid.t)[free]
        self.progress("proving the constants along Gamma_c", None)
        self._of_rho()
        with self._or_why("C_R"):
            self._keep("C_R", root(self._lifts()))
        if self.tangential.any():
            self._of_traces()
            with self._or_why("C_s", "C_s_energy"):
                self._of_friction()
        else:
            found = ("C_tr", "C_tr_half", "C_s", "C_s_energy", "C_t1", "C_t2")  # nothing is tangential
            self.numbers |= {name: ZERO for name in found if getattr(measured, name) is not None}
        self._products()

    @contextmanager
    def _or_why(self, *names: str) -> Iterator[None]:
        try:
            yield
        except NotExact as error:
            self.why |= dict.fromkeys(names, str(error))

    @staticmethod
    def _schur(body: ExactBody, matrix: Enclosed) -> Between | None:
        elimination = Elimination(matrix, body.body.interface, body.body.order)
        found = elimination.bound(1), elimination.bound(-1)
        return None if found[0] is None or found[1] is None else _between(found[0], found[1])

    def largest(self, X: Between | None, Y: Between | None) -> Ends:
        """Bounds of the largest eigenvalue of a pencil of two forms between others."""
        if X is None or Y is None:
            return NOTHING
        return enclose_largest((X[1], Y[0]), (X[0], Y[1]))

    def felt(self, X: Between | None, *, normal: bool = False) -> Between | None:
        """A form of the contact body on the Neumann grid."""
        return None if X is None else (self.joint.felt(X[0], normal=normal), self.joint.felt(X[1], normal=normal))

    def _of_rho(self) -> None:
        carried, neumann = self.felt(self.S[self.contact]), self.S[self.neumann]
        self._keep("rho_max", self.largest(carried, neumann))
        if self.pair.contact.free.sum() < self.pair.neumann.free.sum():  # P has a kernel
            self.numbers["rho_min"] = ZERO
        elif not self.pair.contact.loose:
            self._keep("rho_min", inverse(self.largest(neumann, carried)))
        contact = self.felt(self._normal(self.S[self.contact], self.contact), normal=True)
        self._keep(
            "rho_normal", self.largest(contact, neumann if self.joint.mixes else self._normal(neumann, self.neumann))
        )

    def _count(self, name: Name) -> int:
        """Contact nodes of a body, which are the last of its interface components."""
        return len(self.bodies[name].body.nodes)

    def _normal(self, X: Between | None, name: Name) -> Between | None:
        """The form with its tangential components condensed out."""
        if X is None:
            return None
        size = X[0].middle.shape[0]
        normal = np.arange(size - self._count(name), size)
        low, high = Elimination(X[0], normal).bound(1), Elimination(X[1], normal).bound(-1)
        return None if low is None or high is None else _between(low, high)

    def _of_traces(self) -> None:
        mass = self.joint.tangential_mass(self.tangential)
        B = {self.contact: (mass, mass), self.neumann: self.felt((mass, mass))}
        for key, name in (("C_t1", self.contact), ("C_t2", self.neumann)):
            self._keep(key, root(self.largest(B[name], self.S[name])))
        self._keep("C_tr", root(_join([self.largest(B[name], self.E[name]) for name in self.bodies], max)))
        halves: dict[str, list[Ends]] = {name: [] for name in self.bodies}
        for a, b in self._fits():
            halves[b].append(self.largest(self._in(self._slides(a), a, b), self.E[b]))
        self._keep("C_tr_half", root(_join([_join(ends, min) for ends in halves.values()], max)))

    def _fits(self) -> list[tuple[Name, Name]]:
        """A form of the first body in the norm of the second: of the same traces any, else what P carries."""
        same, names = self.pair.same_traces, list(self.bodies)
        return [(a, b) for b in names for a in names if same or a == b or b == self.neumann]

    def _in(self, X: Between | None, a: Name, b: Name) -> Between | None:
        return X if a == b else self.felt(X)

    def _slides(self, name: Name) -> Between | None:
        """``T' E T``: T keeps the tangential part."""
        E = self.E[name]
        if E is None:
            return None
        n = E[0].middle.shape[0]
        kept = np.arange(n) < n - self._count(name)
        low, high = (np.where(np.outer(kept, kept), X.middle, 0.0) for X in E)
        return _between(low, high)

    def _of_friction(self) -> None:
        kernel = self.joint.kernel
        if kernel is None:
            return
        S = self.S[self.neumann]
        if S is not None:
            normal = np.arange(S[0].middle.shape[0])[-self._count(self.neumann) :]
            stress = [kernel.times(X.block(normal, normal)).times(kernel.T).symmetric() for X in S]
            inverse_weights = self.joint.inverse_weights
            found = self.largest((stress[0], stress[1]), (inverse_weights, inverse_weights))
            self._keep("C_s_energy", root(found))
        self._keep("C_s", root(_join([self._stress(name, kernel) for name in self.bodies], max)))

    def _stress(self, name: Name, kernel: Enclosed) -> Ends:
        """``|S sigma_N|^2`` in the weights, on a body's harmonic fields, in its H^1/2 norm."""
        S = self.S[name]
        if S is None:
            return NOTHING
        forces = entries(S)
        every = np.arange(len(forces.middle))
        normal = forces.block(every[-self._count(name) :], every)
        P = self.joint.transfer_of_traces
        if name == self.contact and self.joint.mixes and P is not None:
            columns = np.arange(P.middle.shape[1])[-self._count(self.neumann) :]
            normal = P.block(every, columns).T.times(forces)
        elif name == self.contact and self.joint.transfer is not None:
            normal = self.joint.transfer.T.times(normal)
        z = kernel.times(normal)
        square = z.T.times(self.joint.weights).times(z).symmetric()
        return self.largest((square, square), self.E[name])

    def _lifts(self) -> Ends:
        forms = {name: self.lift(body) for name, body in self.bodies.items()}
        return _join([self.largest(self._in(forms[a], a, b), self.E[b]) for a, b in self._fits()], max)

    def lift(self, body: ExactBody) -> Between | None:
        """``R' H R`` with the elastic lift R."""
        own, A, H = body.body, body.stiffness, body.gram
        interface, inside = own.interface, np.setdiff1d(np.arange(A.middle.shape[0]), own.interface)
        b = len(interface)
        if len(inside) * b > MOST_OF_LIFT:
            raise NotExact(f"the lift has {len(inside)} x {b} entries: needed at most {MOST_OF_LIFT}")
        V = np.zeros((A.middle.shape[0], b))
        V[interface] = np.eye(b)
        V[inside] = own.elastic.lift
        form = Enclosed.exactly(V.T).times(_product(H, V)).symmetric()
        error = 0.0  # the square of the H1 norm of what the lift is off by, over |phi|^2
        if len(inside):
            rest = _product(A.block(inside, np.arange(A.middle.shape[0])), V)
            sizes = np.abs(rest.middle) + rest.radius
            residual = float(upwards((sizes**2).sum(), sizes.size + 4))
            stiff, coercive = _least(A.block(inside, inside)), self.m[own.name]
            if stiff is None or not coercive:
                return None
            error = residual / stiff / coercive * (1 + 16 * UNIT)
        share = max(math.sqrt(error), SHARE)
        identity = Enclosed.exactly(np.eye(b) * error * (1 + 1 / share) * (1 + 16 * UNIT))
        # (1 - t) |a|^2 - (1/t - 1) |e|^2 <= |a + e|^2 <= (1 + t) |a|^2 + (1 + 1/t) |e|^2 for every t > 0
        return form.plus(-1.0, identity, factor=1 - share), form.plus(1.0, identity, factor=1 + share)

    # --- products -----------------------------------------------------------------------------------------------------

    def _products(self) -> None:
        friction = self.pair.friction
        law = self.pair.interface.kernel is not None
        for name, *factors in PRODUCTS:
            if getattr(self.measured, name) is None:
                continue
            if not (friction and law):
                self.numbers[name] = ZERO
            elif all(factor in self.numbers for factor in factors):
                self.numbers[name] = product(friction, *(self.numbers[factor] for factor in factors))


def _between(low: Floats, high: Floats) -> Between:
    return Enclosed.exactly(low), Enclosed.exactly(high)


def entries(form: Between) -> Enclosed:
    """A form between two others, entry by entry."""
    low, high = (X.middle for X in form)
    gap = np.maximum(np.diag(high) - np.diag(low), 0.0) * (1 + 4 * UNIT)
    return Enclosed(middle=low, radius=np.sqrt(np.outer(gap, gap)) * (1 + 8 * UNIT))


def _product(A: Enclosed, V: Floats) -> Enclosed:
    """``A V`` for a sparse A and a dense matrix of doubles."""
    sizes = np.abs(V)
    terms = np.diff(A.middle.tocsr().indptr)[:, None]
    radius = A.radius @ sizes + gamma(terms + 1) * (abs(A.middle) @ sizes)
    most = int(np.max(terms, initial=0)) + int(np.max(np.diff(A.radius.tocsr().indptr), initial=0))
    return Enclosed(middle=np.asarray(A.middle @ V), radius=np.asarray(upwards(radius, most + 8)))


def _least(A: Enclosed) -> float | None:
    """A lower bound of the smallest eigenvalue of a sparse positive definite matrix, about half of it."""
    elimination = Elimination(A)
    if elimination.plain is None:
        return None
    x = np.random.default_rng(0).standard_normal(A.middle.shape[0])
    for _ in range(10):
        x = elimination.plain[2](x / np.linalg.norm(x))
    least = 0.5 / float(np.linalg.norm(x))
    identity = Enclosed.exactly(sp.eye_array(A.middle.shape[0], format="csc"))
    return least if positive_definite(A.plus(-least, identity), elimination.order) else None


PROOFS.provide(Prover("constants", verify))
