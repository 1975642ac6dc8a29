"""The discrete problem a second time: every matrix dense, in textbook form, from the mesh and the numbers of the file.

Nothing of the assembly, the condensation, the norms or the eigensolvers under test is used; only their nodes and cells.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.linalg import block_diag, eigh

from verification.interface.pair import ContactPair


def dense_stiffness(points: np.ndarray, cells: np.ndarray, young: float, poisson: float) -> np.ndarray:
    """``sum of area B' D B`` with strains (e_xx, e_yy, 2 e_xy) in plane strain; ``E/h [1 -1; -1 1]`` for a bar."""
    d = points.shape[1]
    A = np.zeros((d * len(points), d * len(points)))
    D = np.diag([1 - poisson, 1 - poisson, (1 - 2 * poisson) / 2])
    D[0, 1] = D[1, 0] = poisson
    D *= young / ((1 + poisson) * (1 - 2 * poisson))
    for cell in cells:
        size, slopes = cell_slopes(points[cell])
        B = slopes[:, None] if d == 1 else np.zeros((3, 6))
        if d == 2:
            B[0, 0::2] = B[2, 1::2] = slopes[:, 0]
            B[1, 1::2] = B[2, 0::2] = slopes[:, 1]
        local = young * size * np.outer(slopes, slopes) if d == 1 else size * B.T @ D @ B
        rows = (d * cell[:, None] + np.arange(d)).ravel()
        A[np.ix_(rows, rows)] += local
    return A


def dense_gram(points: np.ndarray, cells: np.ndarray, length: float) -> np.ndarray:
    """``int u v / L^2 + grad u . grad v`` for each component; the mass by a quadrature that is exact for squares."""
    d = points.shape[1]
    gram = np.zeros((len(points), len(points)))
    # Simpson's rule on a bar, the midpoints of the edges of a triangle
    nodes = np.array([[1, 0], [0.5, 0.5], [0, 1]]) if d == 1 else (np.ones((3, 3)) - np.eye(3)) / 2
    weights = np.array([1, 4, 1]) / 6 if d == 1 else np.ones(3) / 3
    mass = nodes.T @ np.diag(weights) @ nodes
    for cell in cells:
        size, slopes = cell_slopes(points[cell])
        slopes = slopes.reshape(d + 1, d)
        gram[np.ix_(cell, cell)] += size * (mass / length**2 + slopes @ slopes.T)
    return np.kron(gram, np.eye(d))


def cell_slopes(vertices: np.ndarray) -> tuple[float, np.ndarray]:
    """Length or area of a cell, and the slopes of its barycentric coordinates."""
    d = vertices.shape[1]
    coefficients = np.linalg.inv(np.column_stack([np.ones(d + 1), vertices]))
    size = abs(np.linalg.det(np.column_stack([np.ones(d + 1), vertices]))) / (1 if d == 1 else 2)
    return size, coefficients[1:].T if d == 2 else coefficients[1]


@dataclass(frozen=True, kw_only=True)
class DenseBody:
    """A body: A and H on its unknowns, the interface among them, its load.

    Interface vectors list the tangential components (none in 1D), then the normal ones, along `up` times y.
    """

    A: np.ndarray
    H: np.ndarray
    trace: np.ndarray
    load: np.ndarray
    up: float
    everything: np.ndarray  # stiffness on all degrees of freedom
    forces: np.ndarray  # body force and tractions on all degrees of freedom
    held: np.ndarray  # which degrees of freedom Gamma_u holds
    values: np.ndarray  # their displacements, 0 elsewhere
    interface: np.ndarray  # interface components among all degrees of freedom

    @cached_property
    def signs(self) -> np.ndarray:
        """-1 on the normal components of a body whose normal points down."""
        n = len(self.trace)
        t = n // 2 if self.flat else 0
        return np.where(np.arange(n) < t, 1.0, self.up)

    @property
    def flat(self) -> bool:
        """Whether there are tangential components."""
        return len(self.trace) > 1

    @cached_property
    def inside(self) -> np.ndarray:
        """The unknowns off the interface."""
        return np.setdiff1d(np.arange(len(self.A)), self.trace)

    def lift(self, matrix: np.ndarray) -> np.ndarray:
        """The extension of least energy off the interface, columns for oriented interface values."""
        R = np.zeros((len(matrix), len(self.trace)))
        R[self.trace, np.arange(len(self.trace))] = self.signs
        if len(self.inside):
            R[self.inside] = -np.linalg.solve(matrix[np.ix_(self.inside, self.inside)], matrix[self.inside] @ R)
        return R

    @cached_property
    def R(self) -> np.ndarray:
        """R_D of (4.5)."""
        return self.lift(self.A)

    @cached_property
    def S(self) -> np.ndarray:
        """``phi' S phi = a(R phi, R phi)``."""
        return symmetric(self.R.T @ self.A @ self.R)

    @cached_property
    def N(self) -> np.ndarray:
        """``phi' N phi = |R phi|^2`` in H1."""
        return symmetric(self.R.T @ self.H @ self.R)

    @cached_property
    def E(self) -> np.ndarray:
        """``phi' E phi``: the norm squared of H^1/2(Gamma_c), the least H1 norm of an extension."""
        least = self.lift(self.H)
        return symmetric(least.T @ self.H @ least)

    @cached_property
    def condensed_load(self) -> np.ndarray:
        """``L(R phi)``."""
        return self.R.T @ self.load


def trace(body: DenseBody) -> np.ndarray:
    """The matrix from a displacement of the unknowns to its trace along the normal of the contact body."""
    result = np.zeros((len(body.trace), len(body.A)))
    result[np.arange(len(body.trace)), body.trace] = body.signs
    return result


def symmetric(matrix: np.ndarray) -> np.ndarray:
    return (matrix + matrix.T) / 2


def dense_body(pair: ContactPair, name: str) -> DenseBody:
    """Assemble ``body1`` or ``body2`` of a pair from its mesh and its entry in the problem file."""
    body, spec = getattr(pair, name).body, getattr(pair.problem, name)
    points, cells, nodes = body.mesh.points.astype(float), body.mesh.cells, body.nodes
    d = points.shape[1]
    young, poisson = float(spec.young), float(spec.poisson)
    A = dense_stiffness(points, cells, young, poisson)
    H = dense_gram(points, cells, float(pair.problem.length))

    axis, end = {"left": (0, 0), "right": (0, 1), "bottom": (1, 0), "top": (1, 1)}, (points.min(0), points.max(0))
    on = lambda side: points[:, axis[side][0]] == end[axis[side][1]][axis[side][0]]
    held, values, forces = (np.zeros_like(points) for _ in range(3))
    for side, given in [(s, [0] * d) for s in spec.fixed] + list(spec.prescribed.items()):
        for p, value in enumerate(given):
            if value is not None:
                held[on(side), p], values[on(side), p] = 1, float(value)
    for cell in cells:
        size, _ = cell_slopes(points[cell])
        forces[cell] += size / (d + 1) * np.array([float(f) for f in spec.body_force])
    for side, force in spec.traction.items():
        ends = np.flatnonzero(on(side))
        along = points[ends, 1 - axis[side][0]] if d == 2 else None
        ends = ends if d == 1 else ends[np.argsort(along)]
        pieces = [(i,) for i in ends] if d == 1 else list(pairwise(ends))
        for piece in pieces:
            if not np.isin(piece, nodes).all():  # a traction acts off Gamma_c
                size = 1.0 if d == 1 else np.linalg.norm(points[piece[1]] - points[piece[0]])
                forces[list(piece)] += size / len(piece) * np.array([float(t) for t in force])
    held, values, forces = held.ravel().astype(bool), values.ravel(), forces.ravel()
    free = np.flatnonzero(~held)
    interface = np.concatenate([d * nodes + p for p in range(d)])
    return DenseBody(
        A=A[np.ix_(free, free)],
        H=H[np.ix_(free, free)],
        trace=np.searchsorted(free, interface),
        load=(forces - A @ values)[free],
        up=pair.normal_sign,
        everything=A,
        forces=forces,
        held=held,
        values=values,
        interface=interface,
    )


def top(A: np.ndarray, B: np.ndarray) -> tuple[float, np.ndarray]:
    """Largest eigenvalue of ``A x = value B x`` and its vector, from the full dense spectrum."""
    values, vectors = eigh(A, B)
    return float(values[-1]), vectors[:, -1]


def hat_operator(x: np.ndarray, forces_at: np.ndarray, weights: np.ndarray, law: str, radius: float) -> np.ndarray:
    """S on normal nodal forces: the hat of integral 1, or division by the weights (on one grid)."""
    if law == "local":
        return np.diag(1 / weights)
    return np.array([[max(0.0, 1 - abs(a - b) / radius) / radius for b in forces_at] for a in x])


@dataclass(frozen=True, kw_only=True)
class DensePair:
    """Both bodies, in the frame of the contact body, with their roles; theorem problems only (nothing held on Gamma_c).

    `contact` solves step II, `neumann` step I.
    """

    pair: ContactPair
    body1: DenseBody
    body2: DenseBody

    @classmethod
    def of(cls, pair: ContactPair) -> DensePair:
        return cls(pair=pair, body1=dense_body(pair, "body1"), body2=dense_body(pair, "body2"))

    @property
    def contact(self) -> DenseBody:
        return self.body1 if self.pair.neumann_body == 2 else self.body2

    @property
    def neumann(self) -> DenseBody:
        return self.body2 if self.pair.neumann_body == 2 else self.body1

    @cached_property
    def t(self) -> int:
        """Number of tangential components."""
        return self.pair.contact.grid.n if self.pair.contact.grid.dimension == 2 else 0

    @cached_property
    def weights(self) -> np.ndarray:
        """The trapezoid rule on Gamma_c."""
        x = self.pair.contact.grid.x
        if len(x) == 1:
            return np.ones(1)
        w = np.zeros(len(x))
        w[:-1] += np.diff(x) / 2
        w[1:] += np.diff(x) / 2
        return w

    @cached_property
    def hat(self) -> np.ndarray:
        """S as a matrix; of no effect where there is no friction law."""
        spec = self.pair.problem.contact
        if spec.law == "nonlocal" and spec.radius is None:
            return np.zeros((len(self.weights), len(self.weights)))
        x = self.pair.contact.grid.x, self.pair.neumann.grid.x
        return hat_operator(*x, self.weights, spec.law, float(spec.radius or 0))

    @cached_property
    def P(self) -> np.ndarray:
        """Traces on the Neumann grid to the contact grid; its nodal matrix is held against its definition elsewhere."""
        return np.kron(np.eye(self.pair.contact.grid.dimension), self.pair.interface.transfer)

    @cached_property
    def friction(self) -> float:
        return float(self.pair.friction)

    @cached_property
    def B_T(self) -> np.ndarray:
        """``phi' B_T phi``: the L2(Gamma_c) norm squared of the tangential part, lumped."""
        return np.diag(np.concatenate([self.weights[: self.t], np.zeros(len(self.weights))]))

    def squared_stress(self, body: DenseBody) -> np.ndarray:
        """``phi' X phi``: the L2(Gamma_c) norm squared of S sigma_N of the lift of phi."""
        Z = self.hat @ body.S[self.t :]
        return symmetric(Z.T @ np.diag(self.weights) @ Z)

    def keep_tangential(self, body: DenseBody) -> np.ndarray:
        """``phi' X phi``: the H^1/2 norm squared of the tangential part of phi."""
        kept = np.zeros_like(body.E)
        kept[: self.t, : self.t] = body.E[: self.t, : self.t]
        return kept

    @cached_property
    def union(self) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness and Gram matrix of both bodies together."""
        bodies = (self.body1, self.body2)
        return block_diag(*(b.A for b in bodies)), block_diag(*(b.H for b in bodies))


def rounding(*bodies: DenseBody, solves: int = 1) -> float:
    """1e-9, or on thin bodies what the condition of the stiffness matrix leaves of sixteen digits after some solves."""
    return max(1e-9, *(20 * solves * np.finfo(float).eps * np.linalg.cond(body.A) for body in bodies))


# --- other units ------------------------------------------------------------------------------------------------------


def close(found: Mapping[str, float], expected: Mapping[str, float], relative: float = 1e-9) -> None:
    """Every expected value is met."""
    off = {
        name: (found[name], value)
        for name, value in expected.items()
        if not abs(found[name] - value) <= relative * abs(value)
    }
    assert off == {}, off


def with_moduli(data: Mapping[str, Any], factor: Fraction) -> dict[str, Any]:
    """Both moduli times a factor."""
    return {**data, **{name: data[name] | {"young": data[name]["young"] * factor} for name in ("body1", "body2")}}


def stretched(data: Mapping[str, Any], c: Fraction) -> dict[str, Any]:
    """Every length times c."""
    scale = lambda table, keys: {key: [c * v for v in table[key]] for key in keys if key in table}
    other = {**data, **{name: data[name] | scale(data[name], ("x", "y")) for name in ("body1", "body2")}}
    contact = data["contact"] | scale(data["contact"], ("interval",))
    other["contact"] = contact | {key: c * contact[key] for key in ("radius", "gap") if key in contact}
    return other
