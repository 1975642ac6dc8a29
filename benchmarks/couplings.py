"""Couplings whose spectrum is known, and what the advice from their logs, vectors and matrices costs.

Bodies are those of scikit-fem, blocks with a curved outer side in the plane and bricks in space, and two plates of this
project where there is friction; they are tied, or in contact that is pressed and may open.  Walls that exchange heat,
tubes and membranes with added mass, masses on springs and bodies with convection are tied, too.  In each coupling a run
writes the log that preCICE would write, `advise_logs` reads it, and the runs that the advice asks for are made, three
at most; `advise_vectors` reads nine iterates of Aitken, and `advise_matrices` both matrices.  Each theta is compared
with the best one of a scan, and the methods with each other.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import islice, product
from pathlib import Path
from typing import Any

import numpy as np
import skfem
from scipy.linalg import cho_factor, cho_solve, cholesky, eigh, solve_triangular
from scipy.optimize import nnls
from scipy.sparse.linalg import splu
from skfem.models.elasticity import lame_parameters, linear_elasticity

import verification as vf
from verification.coupling.methods import METHODS, NEAR
from verification.coupling.methods import advised as methods_advised
from verification.coupling.readings import steps_needed
from verification.registry import RULES

#: A run has arrived where its residual is this share of the force.
ARRIVED = 1e-8

#: Runs that the advice may ask for after the first one, and steps after which a run is given up.
ASKED_FOR, LONGEST = 3, 6000

#: A residual is multiplied by ``exp(NOISE z)`` with a normal z in every second coupling.
NOISE = 0.01

Floats = np.ndarray


@dataclass(frozen=True, kw_only=True)
class Body:
    """A body condensed onto Gamma_c, unknowns by component, the normal one last.

    Attributes
    ----------
    stiffness : array, shape (n, n)
    load : array, shape (n,)
    """

    stiffness: Floats
    load: Floats


def body(mesh: skfem.Mesh, element: Any, moduli: tuple[float, float], push: Callable[[Floats], Floats]) -> Body:
    """A body of scikit-fem condensed onto its boundary ``contact``, where the last axis is normal.

    Parameters
    ----------
    mesh, element : mesh with boundaries ``contact`` and ``outer``, scalar element
    moduli : tuple
        Young's modulus and Poisson's ratio; plane strain in the plane.
    push : callable
        By how much places of ``outer`` are moved along the last axis; along the others they are held.
    """
    basis = skfem.Basis(mesh, skfem.ElementVector(element))
    K = linear_elasticity(*lame_parameters(*moduli)).assemble(basis).tocsc()
    on_facets = basis.facet_dofs if len(basis.facet_dofs) else np.empty((mesh.dim(), 0), int)
    by_component = np.hstack([basis.nodal_dofs, on_facets])
    outer, contact = (basis.get_dofs(name).all() for name in ("outer", "contact"))
    places = basis.doflocs
    ordered = [np.intersect1d(component, contact) for component in by_component]
    contact = np.concatenate([dofs[np.lexsort(places[:-1, dofs])] for dofs in ordered])
    x = np.zeros(K.shape[0])
    pushed = np.intersect1d(outer, by_component[-1])
    x[pushed] = push(places[:, pushed])
    inner = np.setdiff1d(np.arange(len(x)), np.concatenate([outer, contact]))
    solve, across = splu(K[inner][:, inner]).solve, K[contact][:, inner]
    S = K[contact][:, contact].toarray() - across @ solve(K[inner][:, contact].toarray())
    return Body(stiffness=(S + S.T) / 2, load=across @ solve((K @ x)[inner]) - (K @ x)[contact])


def block(side: int, moduli: tuple[float, float], *, curve: float = 0.0, deep: float = 0.4, push: float = 0.0) -> Body:
    """A block of second order in the plane, below (-1) or above (1) Gamma_c; its outer side is an arc."""
    mesh = skfem.MeshQuad.init_tensor(np.linspace(0, 1, 9), np.linspace(0, deep, 4))
    return body(_bent(mesh, side, deep, curve), skfem.ElementQuad2(), moduli, lambda at: push * (0.6 - at[0]))


def brick(side: int, moduli: tuple[float, float], *, curve: float = 0.0, deep: float = 0.4, push: float = 0.0) -> Body:
    """A brick of trilinear elements, below (-1) or above (1) Gamma_c; its outer side is bent."""
    flat = np.linspace(0, 1, 6)
    mesh = skfem.MeshHex.init_tensor(flat, flat, np.linspace(0, deep, 4))
    return body(
        _bent(mesh, side, deep, curve), skfem.ElementHex1(), moduli, lambda at: push * (0.8 - at[0] - at[1] / 2)
    )


def _bent(mesh: skfem.Mesh, side: int, deep: float, curve: float) -> skfem.Mesh:
    """The mesh with its sides named and its outer side pulled into an arc."""
    at_height = lambda height: lambda at: np.isclose(at[-1], height)
    mesh = mesh.with_boundaries({"contact": at_height(0), "outer": at_height(deep)})
    p = mesh.p.copy()
    p[-1] *= side * (1 + curve * np.sin(np.pi * p[0]))
    return replace(mesh, doflocs=p)


def without_friction(given: Body, dim: int) -> Body:
    """The same for the normal unknowns alone: without friction nothing holds the tangential ones."""
    S, normal = given.stiffness, len(given.load) // dim
    t, n = slice(None, -normal), slice(-normal, None)
    left = np.linalg.solve(S[t, t], S[t, n]).T
    stiffness = S[n, n] - left @ S[t, n]
    return Body(stiffness=(stiffness + stiffness.T) / 2, load=given.load[n] - left @ given.load[t])


@dataclass(frozen=True, kw_only=True)
class Tied:
    """Two bodies tied along Gamma_c: ``T g = l_c - S_c S_n^-1 (g + l_n)``."""

    name: str
    contact: Body
    neumann: Body
    tied = True
    linear = True
    largest = 1.0  # the largest theta that may be run

    @cached_property
    def spectrum(self) -> Floats:
        """The eigenvalues of (S_c, S_n)."""
        return eigh(self.contact.stiffness, self.neumann.stiffness, eigvals_only=True)

    @cached_property
    def solve(self) -> Callable[[Floats], Floats]:
        """``f -> S_n^-1 f``."""
        factor = cho_factor(self.neumann.stiffness)
        return lambda force: cho_solve(factor, force)

    def forces(self, theta: float, rule: str = "constant") -> Iterator[tuple[Floats, Floats]]:
        """g and T g, step by step."""
        following, g = RULES[rule].on_vectors(theta), np.zeros(len(self.neumann.load))
        while True:
            image = self.image(self.solve(g + self.neumann.load))
            yield g, image
            g = following(g, image)

    def image(self, u: Floats) -> Floats:
        """What the contact body answers to the displacement of the Neumann body."""
        return self.contact.load - self.contact.stiffness @ u


@dataclass(frozen=True, kw_only=True)
class Contact(Tied):
    """The same in contact without friction, of normal unknowns: ``side (phi - u) >= 0`` for the contact body's phi."""

    side: int
    tied = False
    linear = False

    @cached_property
    def _root(self) -> Floats:
        return cholesky(self.contact.stiffness)

    def image(self, u: Floats) -> Floats:
        # phi = u + side z, z >= 0, and R' R = S: the least of |R z - R^-T (l - S u) side|
        free = self.side * (self.contact.load - self.contact.stiffness @ u)
        z, _ = nnls(self._root, solve_triangular(self._root, free, trans="T"))
        return self.contact.load - self.contact.stiffness @ (u + self.side * z)


@dataclass(frozen=True, kw_only=True)
class Asymmetric(Tied):
    """The same of matrices that are not symmetric."""

    @cached_property
    def spectrum(self) -> Floats:
        values = np.linalg.eigvals(np.linalg.solve(self.neumann.stiffness, self.contact.stiffness))
        return values[np.argsort(values.real)]

    @cached_property
    def solve(self) -> Callable[[Floats], Floats]:
        return lambda force: np.linalg.solve(self.neumann.stiffness, force)


@dataclass(frozen=True, kw_only=True)
class Plates:
    """Two plates of this project in contact with friction."""

    name: str
    pair: vf.ContactPair
    tied = False
    linear = False
    largest = 0.99  # the iteration needs theta < 1

    @cached_property
    def spectrum(self) -> Floats:
        """The eigenvalues of the matrices of both bodies, all unknowns."""
        return eigh(self.pair.contact.schur, self.pair.neumann.schur, eigvals_only=True)

    def forces(self, theta: float, rule: str = "constant") -> Iterator[tuple[Floats, Floats]]:
        """g and T g, step by step."""
        return ((s.g, s.image) for s in vf.iterate(self.pair, theta=repr(float(theta)), rule=rule))


Coupling = Tied | Contact | Plates


def residuals(coupling: Coupling, theta: float, most: int) -> list[tuple[float, float]]:
    """``|T g - g|`` and ``|T g|`` of a run, until rounding or 1e60."""
    found = []
    for g, image in islice(coupling.forces(theta), most):
        found.append((float(np.linalg.norm(image - g)), float(np.linalg.norm(image))))
        if not 1e-13 * found[0][0] < found[-1][0] < 1e60 * found[0][0]:
            break
    return found


def steps(coupling: Coupling, theta: float, most: int = LONGEST, rule: str = "constant") -> float:
    """Steps until the residual is ARRIVED of the force; inf where that takes more than ``most``."""
    for n, (g, image) in enumerate(islice(coupling.forces(theta, rule), most)):
        size = float(np.linalg.norm(image - g))
        if size <= ARRIVED * float(np.linalg.norm(image)):
            return max(n, 1)
        if not size < 1e60:
            break
    return math.inf


def fewest(coupling: Coupling) -> tuple[int, float]:
    """The fewest steps of a scan over theta, and the theta that takes them."""
    low, high = float(coupling.spectrum[0].real), float(coupling.spectrum[-1].real)
    middle = 2 / (1 + min(low, 1) + high)
    thetas = sorted({min(middle * 1.06**k, 0.999) for k in range(-16, 31)}, key=lambda theta: abs(theta - middle))
    best, at = LONGEST, middle
    for theta in thetas:
        n = steps(coupling, theta, best)
        if n < best:
            best, at = int(n), theta
    return best, at


def log(coupling: Coupling, theta: float, path: Path, seed: int | None) -> Path:
    """A run as preCICE logs it; with a seed, noise on its residuals."""
    rows = np.array(residuals(coupling, theta, 60 + 3 * steps_needed(Fraction(repr(theta)))))
    absolute, relative = rows[:, 0], rows[:, 0] / rows[:, 1]
    if seed is not None:
        factor = np.exp(NOISE * np.random.default_rng(seed).normal(size=len(rows)))
        absolute, relative = absolute * factor, relative * factor
    lines = ["  TimeWindow  Iteration  ResAbs(Solid-Mesh:Force)  ResRel(Solid-Mesh:Force)"]
    lines += [f"{1:12d}  {n:9d}  {a:.8e}  {r:.8e}" for n, (a, r) in enumerate(zip(absolute, relative, strict=True), 1)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def aitken_log(coupling: Coupling, first: float, path: Path, tolerance: float = 1e-6) -> Path:
    """A run of Aitken as columns: its residuals, and the factor after each."""
    rows, before = ["iteration,res,omega"], None
    for n, (g, image) in enumerate(islice(coupling.forces(first, "aitken"), LONGEST), 1):
        residual = image - g
        if before is not None:
            x, r, size = before
            rows.append(f"{n - 1},{size:.8e},{float((g - x) @ r) / size**2:.8e}")
        before = g, residual, float(np.linalg.norm(residual))
        if before[2] < tolerance * float(np.linalg.norm(image)):
            break
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


@dataclass(frozen=True, kw_only=True)
class Followed:
    """What following the advice has led to.

    Attributes
    ----------
    name : str
    least, largest : float
        Ends of the spectrum of (S_c, S_n).
    noise : bool
    runs : tuple of float
        The thetas that were run for a log.
    theta : float
        The one that is pasted, or of the run to make next.
    decided : bool
        Whether it is advised: to be pasted, or to be kept of a run that converged.
    steps : int or None
        What it takes; None where the run does not arrive.
    fewest : int
    best : float
        The fewest steps of the scan, and their theta.
    why : str
    """

    name: str
    least: float
    largest: float
    noise: bool
    runs: tuple[float, ...]
    theta: float
    decided: bool
    steps: int | None
    fewest: int
    best: float
    why: str

    @property
    def good(self) -> bool:
        """Whether the advice takes at most 1.4 times the fewest steps; a run to make is no advice."""
        return self.decided and self.steps is not None and 5 * self.steps <= 7 * self.fewest


def followed(chosen: Iterable[Coupling], first: float, folder: Path) -> Iterator[Followed]:
    """The advice followed in each coupling, with noise in every second one, of each kind and in both roles."""
    for i, coupling in enumerate(chosen):
        yield follow(coupling, first, folder, i if (i + i // 4) % 4 in (1, 2) else None)


def follow(coupling: Coupling, first: float, folder: Path, seed: int | None) -> Followed:
    """Make the first run and those that the advice asks for, and take the theta that it ends with."""
    logs: list[tuple[Path, str]] = []
    theta, runs = min(first, coupling.largest), []
    for n in range(1 + ASKED_FOR):
        runs.append(theta)
        logs.append((log(coupling, theta, folder / f"{n}.log", None if seed is None else 97 * seed + n), repr(theta)))
        found = vf.advise_logs(logs, tied=coupling.tied)
        assert found.next is not None
        theta = found.next.theta
        kept = (
            theta in runs
            and not found.next.again
            and found.interval is not None
            and found.interval.contradiction is None
        )
        if found.roles or kept:
            break
    best, at = fewest(coupling)
    taken = steps(coupling, theta)
    return Followed(
        name=coupling.name,
        least=float(coupling.spectrum[0].real),
        largest=float(coupling.spectrum[-1].real),
        noise=seed is not None,
        runs=tuple(runs),
        theta=theta,
        decided=bool(found.roles) or kept,
        steps=int(taken) if math.isfinite(taken) else None,
        fewest=best,
        best=at,
        why=found.next.why,
    )


#: Young's modulus and Poisson's ratio of the body below and of the one above.
MODULI = (((210.0, 0.3), (70.0, 0.33)), ((70.0, 0.33), (70.0, 0.33)), ((110.0, 0.34), (3.0, 0.38)))


def couplings() -> Iterator[Coupling]:
    """The thirty: tied and in contact, in the plane and in space, in both roles; six with friction."""
    for (make, dim), (lower, upper) in product(((block, 2), (brick, 3)), MODULI):
        below = make(-1, lower, curve=0.3, deep=0.4)
        above = make(1, upper, curve=-0.3, deep=0.3, push=-0.01)
        for neumann in (1, 2):
            name = f"{lower[0]:g}/{upper[0]:g}, {dim}D, Neumann body {neumann}"
            bodies = (below, above) if neumann == 2 else (above, below)
            yield Tied(name=f"tied, {name}", contact=bodies[0], neumann=bodies[1])
            free = [without_friction(given, dim) for given in bodies]
            yield Contact(name=f"contact, {name}", contact=free[0], neumann=free[1], side=-1 if neumann == 2 else 1)
    for (E1, E2), neumann in product(((70000, 20000), (20000, 20000), (20000, 70000)), (1, 2)):
        plates = vf.example("section6").changed(young=(E1, E2), cells=((10, 2), (6, 2)), friction="0.2")
        plates = plates.changed(neumann_body=neumann)
        yield Plates(name=f"friction 0.2, {E1 // 1000}/{E2 // 1000}, 2D, Neumann body {neumann}", pair=vf.build(plates))


# --- other kinds ------------------------------------------------------------------------------------------------------


def _of_modes(name: str, contact: Floats, neumann: Floats, seed: int) -> Tied:
    """A coupling of given stiffnesses of sine modes, as matrices of values at nodes on a line, with random loads."""
    n, loads = len(contact), np.random.default_rng(seed).normal(size=(2, len(contact)))
    i = np.arange(1, n + 1)
    V = np.sqrt(2 / (n + 1)) * np.sin(np.outer(i, i) * np.pi / (n + 1))
    bodies = (Body(stiffness=V @ np.diag(S) @ V, load=load) for S, load in zip((contact, neumann), loads, strict=True))
    return Tied(name=name, contact=next(bodies), neumann=next(bodies))


def _conducts(q: Floats, conductivity: float, depth: float, capacity_by_dt: float) -> Floats:
    """The flux that a wall of this depth, held at its other side, answers to a temperature of wave number q."""
    p = np.sqrt(q**2 + capacity_by_dt / conductivity)
    return conductivity * p / np.tanh(p * depth)


def heat(seed: int) -> Tied:
    """Two walls in the plane, in the steady state or in a step in time."""
    r = np.random.default_rng(seed)
    q = np.arange(1, 31) * np.pi / 2
    walls = 10 ** r.uniform(-1, 1, size=(2, 2))
    step = 10 ** r.uniform(0, 3, size=2) * (seed % 2)
    of = [_conducts(q, k, d, c) for (k, d), c in zip(walls, step, strict=True)]
    return _of_modes(f"heat, k {walls[0, 0]:.2g}/{walls[1, 0]:.2g}{', in time' * (seed % 2)}", *of, seed)


def membrane(seed: int) -> Tied:
    """A stretched wall that a fluid without compressibility loads: added mass of more or less weight."""
    r = np.random.default_rng(seed)
    q = np.arange(1, 41) * np.pi / r.uniform(1, 10)
    weight = 10 ** r.uniform(-1, 1.5)
    of = weight / (q * np.tanh(q * 0.5)), 1 + 10 ** r.uniform(-4, -1) * q**2
    return _of_modes(f"added mass {weight:.2g}", *of, seed)


def tube(seed: int) -> Tied:
    """An elastic tube with a fluid that flows along it."""
    r = np.random.default_rng(seed)
    q = 2 * 61 * np.sin(np.arange(1, 61) * np.pi / 122)
    stiff = 10 ** r.uniform(-1, 1)
    of = 10 ** r.uniform(1, 4) / q**2, stiff + 10 ** r.uniform(-4, -2) * q**2
    return _of_modes(f"tube {stiff:.2g}", *of, seed)


def lumped(seed: int) -> Tied:
    """One to four masses on springs."""
    r = np.random.default_rng(seed)
    n = 1 + seed % 4
    bodies = []
    for _ in range(2):
        A = r.normal(size=(n, n))
        bodies.append(Body(stiffness=A @ A.T + 0.3 * np.eye(n), load=r.normal(size=n)))
    return Tied(name=f"lumped, {n} unknown{'s' * (n > 1)}", contact=bodies[0], neumann=bodies[1])


def convection(seed: int) -> Asymmetric:
    """Two regions with diffusion and a flow along the interface."""
    r = np.random.default_rng(seed)
    n = 30
    second = (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)) * (n + 1)
    first = np.eye(n) - np.eye(n, k=-1)
    bodies = []
    for _ in range(2):
        a, b, c = 10 ** r.uniform(-1.5, 0.5), r.uniform(0, 3), 10 ** r.uniform(-1, 1)
        bodies.append(Body(stiffness=a * second / (n + 1) + b * first + c * np.eye(n), load=r.normal(size=n)))
    return Asymmetric(name="convection", contact=bodies[0], neumann=bodies[1])


#: The kinds, and the seeds: half of them were made after the rules were fixed.
KINDS, SEEDS, UNSEEN = (heat, membrane, tube, lumped, convection), (1, 2), (101, 102)


def others() -> Iterator[tuple[Coupling, bool]]:
    """Twenty couplings of other kinds, and whether the rules were fixed before they were made."""
    for seed in (*SEEDS, *UNSEEN):
        for kind in KINDS:
            yield kind(seed), seed in UNSEEN


@dataclass(frozen=True, kw_only=True)
class Advised:
    """The cost of the advice from vectors and from matrices, and of the methods.

    Attributes
    ----------
    name : str
    unseen, linear : bool
        Whether the rules were fixed before it was made; whether it is linear.
    largest : float
        The largest real part of an eigenvalue of (S_c, S_n).
    fewest : int
        The fewest steps of the scan over theta.
    vectors, matrices : float or None
        theta from nine iterates of Aitken, and from both matrices; None where none is advised.
    vectors_steps, matrices_steps : int or None
        What it takes; None where the run does not arrive.
    methods : mapping
        Steps of a constant theta, Aitken and IQN-ILS with the theta from the matrices.
    method : str or None
        The one that the vectors advise, in the roles as they are.
    """

    name: str
    unseen: bool
    linear: bool
    largest: float
    fewest: int
    vectors: float | None
    vectors_steps: int | None
    matrices: float | None
    matrices_steps: int | None
    methods: dict[str, int | None]
    method: str | None

    def verdict(self, theta: float | None, count: int | None) -> str:
        """``right`` within 1.4 times the fewest steps, else ``slow``; ``wrong`` if it diverges; ``silent``."""
        if theta is None:
            return "silent"
        if count is None:
            return "slow" if self.linear and theta * (1 + self.largest) < 2 else "wrong"
        return "right" if 5 * count <= 7 * self.fewest else "slow"

    @property
    def verdicts(self) -> dict[str, str]:
        """Of the theta from vectors, and of the one from matrices."""
        return {name: self.verdict(getattr(self, name), getattr(self, f"{name}_steps")) for name in ADVICE}

    @property
    def method_good(self) -> bool:
        """Whether the method takes at most 1.3 times the fewest steps of all three."""
        known = [count for count in self.methods.values() if count is not None]
        taken = None if self.method is None else self.methods[self.method]
        return taken is not None and taken <= NEAR * min(known)


#: The other sources of advice, as Advised names them.
ADVICE = ("vectors", "matrices")


def advised(coupling: Coupling, unseen: bool = False) -> Advised:
    """The advice from vectors and from matrices, and the steps of each."""
    count = lambda theta, rule="constant": None if theta is None else _whole(steps(coupling, theta, rule=rule))
    states = list(islice(coupling.forces(0.5, "aitken"), 9))
    kind = "general" if isinstance(coupling, Asymmetric) else "tied" if coupling.tied else "contact"  # may be complex
    found = vf.advise_vectors([g for g, _ in states], [image for _, image in states], kind=kind)
    if isinstance(coupling, Plates):
        role = vf.advise(coupling.pair).roles[0]
        matrices = role.advised()[0]
    else:
        of = vf.advise_matrices(coupling.contact.stiffness, coupling.neumann.stiffness, tied=coupling.tied)
        role = next(role for role in of.roles if role.neumann_body == 2)
        matrices = role.advised(tied=coupling.tied)[0]
    own = [row for row in found.methods if not row.exchanged]
    best = methods_advised(own, tied=coupling.tied)
    return Advised(
        name=coupling.name,
        unseen=unseen,
        linear=coupling.linear,
        largest=float(coupling.spectrum[-1].real),
        fewest=fewest(coupling)[0],
        vectors=found.theta,
        vectors_steps=count(found.theta),
        matrices=matrices,
        matrices_steps=count(matrices),
        methods={rule: count(matrices, rule) for rule in METHODS},
        method=None if best is None else best.name,
    )


def _whole(count: float) -> int | None:
    return int(count) if math.isfinite(count) else None
