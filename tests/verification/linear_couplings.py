"""Linear couplings ``T x = b - H x`` for the tests of what vectors show, and runs of them."""

import numpy as np

from verification.algorithm.relaxation import RULES


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
