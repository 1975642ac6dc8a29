"""The constants of a small problem of two rectangles a second time: 40 digits, textbook matrices in rationals.

Of the code under test only the numbers of nodes and cells, the unknowns and the transfer (in rationals) are used.
"""

from __future__ import annotations

from fractions import Fraction as F

import numpy as np
from mpmath import mp

from fem1d2d import mortar
from verification.interface.pair import ContactPair

DIGITS = 40


def precise(matrix):
    """A matrix of rationals in mpmath."""
    return mp.matrix(
        [[mp.mpf(int(F(x).numerator)) / int(F(x).denominator) for x in row] for row in np.atleast_2d(matrix)]
    )


def symmetric(matrix):
    return (matrix + matrix.T) / 2


def points_of(spec):
    axes = [
        [a + (b - a) * F(i, n) for i in range(n + 1)] for (a, b), n in zip((spec.x, spec.y), spec.cells, strict=True)
    ]
    return [(x, y) for x in axes[0] for y in axes[1]]


def whole_matrices(points, cells, young, poisson, length):
    """``sum of area B' D B`` in plane strain, and the Gram matrix with the mass by the midpoints of the edges."""
    size = 2 * len(points)
    A, H = (np.zeros((size, size), dtype=object) + F(0) for _ in range(2))
    rigidity = young / ((1 + poisson) * (1 - 2 * poisson))
    D = rigidity * np.array([[1 - poisson, poisson, 0], [poisson, 1 - poisson, 0], [0, 0, (1 - 2 * poisson) / 2]])
    halves = [[F(0), F(1, 2), F(1, 2)], [F(1, 2), F(0), F(1, 2)], [F(1, 2), F(1, 2), F(0)]]
    for cell in cells:
        (x0, y0), (x1, y1), (x2, y2) = (points[i] for i in cell)
        twice = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        slopes = [((y1 - y2) / twice, (x2 - x1) / twice), ((y2 - y0) / twice, (x0 - x2) / twice),
                  ((y0 - y1) / twice, (x1 - x0) / twice)]  # fmt: skip
        B = np.zeros((3, 6), dtype=object) + F(0)
        for i, (gx, gy) in enumerate(slopes):
            B[0, 2 * i] = B[2, 2 * i + 1] = gx
            B[1, 2 * i + 1] = B[2, 2 * i] = gy
        rows = [2 * i + p for i in cell for p in (0, 1)]
        A[np.ix_(rows, rows)] += twice / 2 * (B.T @ D @ B)
        for i in range(3):
            for j in range(3):
                mass = twice / 6 * sum(q[i] * q[j] for q in halves)
                dot = twice / 2 * (slopes[i][0] * slopes[j][0] + slopes[i][1] * slopes[j][1])
                for p in (0, 1):
                    H[2 * cell[i] + p, 2 * cell[j] + p] += mass / length**2 + dot
    return A, H


def top(X, Y):
    """The largest eigenvalue of a pencil."""
    half = mp.inverse(mp.cholesky(Y))
    return max(mp.eigsy(symmetric(half * X * half.T), eigvals_only=True))


class PreciseBody:
    def __init__(self, problem, body):
        spec = getattr(problem, body.name)
        points = points_of(spec)
        A, H = whole_matrices(points, body.mesh.cells.tolist(), spec.young, spec.poisson, problem.length)
        free = body.positions
        self.A, self.H = (precise(matrix[np.ix_(free, free)]) for matrix in (A, H))
        self.x = [points[node][0] for node in body.nodes]
        B = body.interface.tolist()
        inside = [i for i in range(len(free)) if i not in B]
        pick = lambda M, rows, columns: mp.matrix([[M[i, j] for j in columns] for i in rows])
        lift = {}
        for name, M in (("S", self.A), ("E", self.H)):
            R = mp.zeros(len(free), len(B))
            for column, i in enumerate(B):
                R[i, column] = 1
            rest = -mp.inverse(pick(M, inside, inside)) * pick(M, inside, B) if inside else None
            for row, i in enumerate(inside):
                for column in range(len(B)):
                    R[i, column] = rest[row, column]
            lift[name] = R
        self.S = symmetric(lift["S"].T * self.A * lift["S"])
        self.E = symmetric(lift["E"].T * self.H * lift["E"])
        self.N = symmetric(lift["S"].T * self.H * lift["S"])


def block(M, rows, columns):
    return mp.matrix([[M[i, j] for j in columns] for i in rows])


def normal_alone(S):
    """The tangential components condensed out."""
    t = S.rows // 2
    T, N = range(t), range(t, 2 * t)
    return symmetric(block(S, N, N) - block(S, N, T) * mp.inverse(block(S, T, T)) * block(S, T, N))


def constants(pair: ContactPair) -> dict[str, mp.mpf]:
    """All of them by name, friction from the problem."""
    with mp.workdps(DIGITS):
        problem = pair.problem
        bodies = {body.name: PreciseBody(problem, body) for body in (pair.body1.mesh_body, pair.body2.mesh_body)}
        contact, neumann = (bodies[side.mesh_body.name] for side in (pair.contact, pair.neumann))
        x = contact.x
        P = np.eye(len(x), dtype=int) if x == neumann.x else mortar(np.array(x), np.array(neumann.x))
        n_c, n_n = P.shape
        one, both = precise(P), precise(np.kron(np.eye(2, dtype=int), P))
        w = [(x[min(i + 1, n_c - 1)] - x[max(i - 1, 0)]) / 2 for i in range(n_c)]
        r = problem.contact.radius
        kernel = precise([[max(F(0), 1 - abs(a - b) / r) / r for b in neumann.x] for a in x])
        W, zero = precise(np.diag(w)), [F(0)] * n_c
        B_c = precise(np.diag([*w, *zero]))
        carry = lambda X: symmetric(both.T * X * both)
        masses = {id(contact): B_c, id(neumann): carry(B_c)}
        fits = [(a, b) for b in bodies.values() for a in bodies.values() if n_c == n_n or a is b or b is neumann]
        felt = lambda X, a, b: X if a is b or x == neumann.x else carry(X)

        def tangential(body):
            t = body.E.rows // 2
            kept = precise(np.diag([1] * t + [0] * t))
            return kept * body.E * kept

        def stress(body):
            t = body.S.rows // 2
            rows = block(body.S, range(t, 2 * t), range(2 * t))
            z = kernel * (rows if body is neumann else one.T * rows)
            return symmetric(z.T * W * z)

        t = n_n
        S_NN = block(neumann.S, range(t, 2 * t), range(t, 2 * t))
        halves = {}
        for a, b in fits:
            halves.setdefault(id(b), []).append(top(felt(tangential(a), a, b), b.E))
        found = {
            "m": min(1 / top(body.H, body.A) for body in bodies.values()),
            "M": sum(top(body.A, body.H) for body in bodies.values()),
            "C_R": mp.sqrt(max(top(felt(a.N, a, b), b.E) for a, b in fits)),
            "C_s": mp.sqrt(max(top(stress(body), body.E) for body in bodies.values())),
            "C_tr": mp.sqrt(max(top(masses[id(body)], body.E) for body in bodies.values())),
            "C_tr_half": mp.sqrt(max(map(min, halves.values()))),
            "rho_max": top(carry(contact.S), neumann.S),
            "rho_min": 1 / top(neumann.S, carry(contact.S)) if n_c >= n_n else mp.mpf(0),
            "rho_normal": top(symmetric(one.T * normal_alone(contact.S) * one), normal_alone(neumann.S)),
            "C_s_energy": mp.sqrt(top(symmetric(kernel * S_NN * kernel.T), precise(np.diag([1 / v for v in w])))),
            "C_t1": mp.sqrt(top(B_c, contact.S)),
            "C_t2": mp.sqrt(top(masses[id(neumann)], neumann.S)),
        }
        k = mp.mpf(problem.contact.friction.numerator) / problem.contact.friction.denominator
        found["C_K"] = k * found["C_s"] * found["C_tr"]
        found["kappa_1"] = k * found["C_s_energy"] * found["C_t1"]
        found["kappa_2"] = k * found["C_s_energy"] * found["C_t2"]
        return found
