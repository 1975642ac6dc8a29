"""The largest ``|J|`` of an affine piece of T_theta, for the bodies of a certificate: by enumeration, in rationals.

At each node the trace is open or closed, and sticks, or slips with a friction force that has the sign of S sigma_N or
the other one.  Each combination occurs for some loads, for the direction of slip is free.  The bodies are condensed and
``|J|`` is held against a claim in rationals, without the checker.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from flint import arb_mat, ctx, fmpq, fmpq_mat
from numpy.typing import NDArray

#: What a node does: whether it is closed, and the sign of its friction force beside S sigma_N; None where it sticks.
STATES = tuple(product((False, True), (None, 1, -1)))

#: Of the balls in which most pieces are decided.
BITS = 256


def number(text: str) -> fmpq:
    """A rational from its text."""
    exact = Fraction(text)
    return fmpq(exact.numerator, exact.denominator)


def matrix(rows: Any) -> fmpq_mat:
    """A matrix of rationals from rows of texts."""
    return fmpq_mat([[number(x) for x in row] for row in rows])


def condensed(body: dict[str, Any]) -> fmpq_mat:
    """The Schur complement of a body on its contact nodes, tangential components first: strains, then one solve."""
    points = [[number(x) for x in point] for point in body["points"]]
    E, nu = number(body["young"]), number(body["poisson"])
    scale = E / ((1 + nu) * (1 - 2 * nu))
    C = fmpq_mat([[1 - nu, nu, 0], [nu, 1 - nu, 0], [0, 0, (1 - 2 * nu) / 2]])  # Voigt
    entries: dict[tuple[Any, Any], fmpq] = {}
    for cell in body["cells"]:
        p = [points[i] for i in cell]
        two = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (p[1][1] - p[0][1])
        columns = []
        for i in range(3):
            q, r = p[(i + 1) % 3], p[(i + 2) % 3]
            gx, gy = (q[1] - r[1]) / two, (r[0] - q[0]) / two
            columns += [[gx, 0, gy], [0, gy, gx]]
        B = fmpq_mat(columns)
        energy = B * C * B.transpose()
        unknowns = [(node, p) for node in cell for p in (0, 1)]
        for (i, s), (j, t) in product(enumerate(unknowns), repeat=2):
            entries[s, t] = entries.get((s, t), fmpq(0)) + scale * energy[i, j] * two / 2
    keep = [(node, p) for p in (0, 1) for node in body["surface"]]
    inside = sorted({s for s, _ in entries} - {(node, p) for node, p in body["held"]} - set(keep))
    block = lambda rows, columns: fmpq_mat(
        len(rows), len(columns), [entries.get((s, t), fmpq(0)) for s in rows for t in columns]
    )
    if not inside:
        return block(keep, keep)
    return block(keep, keep) - block(keep, inside) * block(inside, inside).solve(block(inside, keep))


def doubles(exact: fmpq_mat) -> NDArray[np.float64]:
    """The nearest doubles."""
    return np.array([[int(x.p) / int(x.q) for x in row] for row in exact.tolist()])


def definite(form: Any) -> bool:
    """Whether a symmetric matrix of rationals is positive definite, or all those in balls are: by its pivots."""
    rows = form.tolist()
    for k, row in enumerate(rows):
        if not row[k] > 0:
            return False
        for i in range(k + 1, len(rows)):
            share = row[i] / row[k]
            rows[i] = [*rows[i][:i], *(x - share * y for x, y in zip(rows[i][i:], row[i:], strict=True))]
    return True


class Step:
    """The pieces of T_theta in rationals or in balls.

    Parameters
    ----------
    kind : type
        fmpq_mat or arb_mat.
    theta : fmpq
    S_c, S_n, P : fmpq_mat
        The stiffness of the contact body and of the Neumann body, and the transfer of traces.
    friction : fmpq_mat
        The friction force of each component that slips along with S sigma_N, a form in the trace of the Neumann body.
    """

    def __init__(self, kind: Any, theta: fmpq, S_c: fmpq_mat, S_n: fmpq_mat, P: fmpq_mat, friction: fmpq_mat) -> None:
        self.kind, self.theta = kind, theta
        self.S_n, self.inverse, self.back = kind(S_n), kind(S_n.inv()), kind(theta * P.transpose() * S_c)
        self.kept = kind((1 - theta) * S_n)
        # rows of the systems of step II, and of what stands on their right
        size = S_c.nrows()
        self.unit = kind(fmpq_mat([[int(i == j) for j in range(size)] for i in range(size)])).tolist()
        self.stiffness, self.follows = kind(S_c).tolist(), kind(-P).tolist()
        self.friction = {0: kind(0 * friction).tolist(), 1: kind(friction).tolist(), -1: kind(-friction).tolist()}

    def bounds(self, signs: list[int | None], factor: fmpq) -> bool:
        """Whether ``|J|`` of one piece is below a factor; in balls False says nothing."""
        left = [self.unit[i] if sign is None else self.stiffness[i] for i, sign in enumerate(signs)]
        right = [self.follows[i] if sign is None else self.friction[sign][i] for i, sign in enumerate(signs)]
        image = self.back * self.kind(left).solve(self.kind(right)) + self.kept
        return definite(factor * factor * self.S_n - image.transpose() * self.inverse * image)


class Truth:
    """The largest ``|J|`` of T_theta over all affine pieces, for the bodies that a certificate describes.

    Raises
    ------
    ZeroDivisionError
        A body that is not held, by which T is not defined.
    """

    def __init__(self, discrete: dict[str, Any], theta: str) -> None:
        bodies = [condensed(discrete[name]) for name in ("body1", "body2")]
        S_c, S_n = bodies if discrete["neumann_body"] == 2 else bodies[::-1]
        if not S_n.det():  # in doubles it may look definite
            raise ZeroDivisionError("the Neumann body is not held")
        self.n, m = n, m = S_c.nrows() // 2, S_n.nrows() // 2
        P, k = matrix(discrete["transfer"] or np.eye(n, dtype=int).astype(str).tolist()), number(discrete["friction"])
        transfer = fmpq_mat([[*row, *[0] * m] for row in P.tolist()] + [[*[0] * m, *row] for row in P.tolist()])
        friction = [[fmpq(0)] * 2 * m for _ in range(2 * n)]
        if k:
            weights = [k * number(w) for w in discrete["weights"]]
            stress = matrix(discrete["kernel"]) * fmpq_mat(S_n.tolist()[m:])
            friction[:n] = [[w * x for x in row] for w, row in zip(weights, stress.tolist(), strict=True)]
        self.data = number(theta), S_c, S_n, transfer, fmpq_mat(friction)
        # without friction every node slides
        self.states = [state for state in STATES if k or state[1] == 1]

    @cached_property
    def exact(self) -> Step:
        """The pieces in rationals."""
        return Step(fmpq_mat, *self.data)

    @cached_property
    def balls(self) -> Step:
        """The pieces in balls."""
        return Step(arb_mat, *self.data)

    @cached_property
    def patterns(self) -> list[list[int | None]]:
        """What holds of each component in step II: the sign of its friction, or 0; None where the trace follows."""
        friction = lambda of: [rubs for _, rubs in of]
        return [
            friction(of) + [None if closed else 0 for closed, _ in of] for of in product(self.states, repeat=self.n)
        ]

    @cached_property
    def sizes(self) -> NDArray[np.float64]:
        """``|J|`` of all pieces, in doubles."""
        theta, (S_c, S_n, P, friction) = float(Fraction(str(self.data[0]))), map(doubles, self.data[1:])
        signs = np.array([[0 if sign is None else sign for sign in of] for of in self.patterns])[:, :, None]
        follows = np.array([[sign is None for sign in of] for of in self.patterns])[:, :, None]
        left = np.where(follows, np.eye(2 * self.n), S_c)
        right = np.where(follows, -P, signs * friction)
        image = theta * P.T @ (S_c @ np.linalg.solve(left, right)) + (1 - theta) * S_n
        root = np.linalg.cholesky(S_n)
        halves = np.linalg.solve(root, image)
        J = np.linalg.solve(root, halves.transpose(0, 2, 1))
        return np.linalg.norm(J, 2, axis=(1, 2))

    @property
    def largest(self) -> float:
        """The truth in doubles."""
        return float(self.sizes.max())

    def bounds(self, signs: list[int | None], factor: fmpq) -> bool:
        """Whether ``|J|`` of one piece is below a factor: in balls, and in rationals where these do not suffice."""
        with ctx.workprec(BITS):
            try:
                return self.balls.bounds(signs, factor) or self.exact.bounds(signs, factor)
            except ZeroDivisionError:  # in balls
                return self.exact.bounds(signs, factor)

    def allows(self, factor: fmpq) -> bool:
        """Whether the piece that has the largest ``|J|`` in doubles is below a factor.

        No factor is right where contact alone holds the contact body: the systems of some pieces have no solution, by
        their rationals, though in doubles they may look regular.
        """
        try:
            return self.bounds(self.patterns[int(self.sizes.argmax())], factor)
        except ZeroDivisionError:
            return False

    def holds(self, factor: str) -> bool:
        """Whether T_theta has a Lipschitz constant below a factor; the pieces of largest ``|J|`` are decided first."""
        return all(self.bounds(self.patterns[i], number(factor)) for i in np.argsort(-self.sizes))
