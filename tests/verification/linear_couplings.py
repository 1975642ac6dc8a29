"""Linear couplings ``T x = b - H x`` for the tests of what vectors show, and runs of them."""

import numpy as np

from verification.registry import RULES


class Linear:
    """A coupling whose H is similar to ``S_n^-1 S_c``, with random stiffnesses of given eigenvalues."""

    def __init__(self, values, seed=0, *, skew=0.0):
        generator, n = np.random.default_rng(seed), len(values)
        Q, _ = np.linalg.qr(generator.normal(size=(n, n)))
        R, _ = np.linalg.qr(generator.normal(size=(n, n)))
        root = R @ np.diag(np.exp(generator.uniform(-0.5, 0.5, n))) @ R.T  # S_n^(1/2)
        turned = np.diag(np.asarray(values, dtype=float))
        for i in range(0, n - 1, 2):
            turned[i, i + 1], turned[i + 1, i] = skew, -skew
        self.H = root @ Q @ turned @ Q.T @ np.linalg.inv(root)
        self.b = generator.normal(size=n) + 2.0
        self.values = np.linalg.eigvals(self.H)

    def __call__(self, x):
        return self.b - self.H @ x

    @property
    def solution(self):
        return np.linalg.solve(np.eye(len(self.b)) + self.H, self.b)

    def run(self, rule, theta, count):
        """So many iterates and their images, as rows."""
        following, x = RULES[rule].on_vectors(theta), np.zeros(len(self.b))
        X, TX = [], []
        for _ in range(count):
            X.append(x)
            TX.append(self(x))
            x = following(x, TX[-1])
        return np.array(X), np.array(TX)

    def steps(self, rule, theta, tolerance=1e-6, most=3000):
        """Evaluations until ``|Tx - x| < tolerance |Tx|``; None where it takes more than ``most``."""
        following, x = RULES[rule].on_vectors(theta), np.zeros(len(self.b))
        for n in range(1, most + 1):
            y = self(x)
            if np.linalg.norm(y - x) < tolerance * np.linalg.norm(y):
                return n
            if not np.linalg.norm(y) < 1e60:
                return None
            x = following(x, y)
        return None


def strips(points=40, rows=12):
    """Two plane strips that exchange heat, smooth data: from a flux to temperatures, and from these to a flux.

    The one of k = 15 and depth 0.25 reads the flux, the one of k = 400 and depth 1.5 returns it; also the eigenvalues.
    """
    i = np.arange(points * rows).reshape(rows, points)
    dx, condensed = 1 / points, []
    for k, depth, held in ((15.0, 0.25, 500 + 200 * np.sin(3 * dx * i[0])), (400.0, 1.5, np.full(points, 300.0))):
        h, A, b = depth / rows, np.zeros((i.size, i.size)), np.zeros(i.size)
        along = np.full((rows, points - 1), k * h / dx)
        along[0] /= 2  # the row on Gamma_c has half the height
        for p, q, c in (
            (i[:, :-1].ravel(), i[:, 1:].ravel(), along.ravel()),
            (i[:-1].ravel(), i[1:].ravel(), np.full((rows - 1) * points, k * dx / h)),
        ):
            for one, other, sign in ((p, p, 1), (q, q, 1), (p, q, -1), (q, p, -1)):
                np.add.at(A, (one, other), sign * c)
        A[i[-1], i[-1]] += k * dx / h
        b[i[-1]] = k * dx / h * held
        c, f = i[0], i[1:].ravel()
        inner = np.linalg.solve(A[np.ix_(f, f)], np.column_stack([A[np.ix_(f, c)], b[f]]))
        S = A[np.ix_(c, c)] - A[np.ix_(c, f)] @ inner[:, :-1]
        condensed.append((S, -A[np.ix_(c, f)] @ inner[:, -1]))
    (S1, l1), (S2, l2) = condensed
    values = np.sort(np.linalg.eigvals(np.linalg.solve(S1, S2)).real)
    return (lambda q: np.linalg.solve(S1, q * dx + l1)), (lambda T: (l2 - S2 @ T) / dx), values
