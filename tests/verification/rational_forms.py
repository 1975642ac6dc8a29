"""The form of the semidefinite bound in rationals, condition by condition, whatever numbers its matrices have."""

import math

import numpy as np
from flint import fmpq


def rational(x):
    return x if isinstance(x, fmpq) else fmpq(*x.as_integer_ratio())


#: An array of rationals from one of doubles or of fractions.
exact = np.vectorize(rational, otypes=[object])


def on_the_diagonal(*blocks):
    rows, columns = (np.cumsum([0, *(block.shape[i] for block in blocks)]) for i in (0, 1))
    found = np.full((rows[-1], columns[-1]), fmpq(0), dtype=object)
    for block, i, j in zip(blocks, rows, columns, strict=False):
        found[i : i + len(block), j : j + block.shape[1]] = block
    return found


def form_of(S_1, S_2, multipliers, square, *, cross=0, step=None, weight=1, wk=(), kernel=None, P=None):
    """``square |g|^2 - cross <g, p> - conditions`` in traces (d, c): ``g = S_2 d``, ``p = S_1 c``, jump ``-(d + c)``.

    With a step (a, b) the form has ``S_2 / weight`` before it and ``a p + b g`` beside that: it is definite if and only
    if it is without them less ``weight |a p + b g|^2``.  Without a kernel S_1 is that of the normal components.
    """
    eye = exact(np.eye(len(S_2) // 2, dtype=int))
    P = eye if P is None else exact(P)
    n, m, size = len(P), len(S_1), len(S_2)
    both = on_the_diagonal(P, P)
    S_1, S_2 = exact(S_1), exact(S_2)
    carried = exact(np.eye(2 * n, dtype=int))[:, 2 * n - m :]  # all components, or the normal ones
    none = np.full((2 * n, size), fmpq(0), dtype=object)
    d = np.hstack([exact(np.eye(size, dtype=int)), np.full((size, m), fmpq(0), dtype=object)])
    force, c = np.hstack([none, carried @ S_1]), np.hstack([none, carried])
    g, p, jump = S_2 @ d, both.T @ force, -(both @ d + c)
    one = [fmpq(1)] * n
    conditions = [(force[n:], jump[n:], one)]
    if kernel is not None:
        zeta, wk = exact(kernel) @ g[size // 2 :], exact(wk)
        conditions += [(force[:n], jump[:n], one), (zeta, zeta, wk), (jump[:n], jump[:n], wk), (zeta, jump[:n], wk)]
        conditions += [(rows, rows, one) for rows in (jump[n:], force[n:], force[:n])]
    found = rational(square) * d.T @ g - rational(cross) * d.T @ p
    for values, (left, right, times) in zip(multipliers, conditions, strict=False):
        found = found - left.T @ ((exact(values) * times)[:, None] * right)
    if step is not None:
        row = rational(step[0]) * p + rational(step[1]) * g
        found = np.block([[S_2 / rational(weight), row], [row.T, found]])
    return (found + found.T) / fmpq(2)


def seen_from(near, form, step, weight):
    """A form in the columns of :class:`verification.semidefinite.trace_forms.TraceForms`."""
    columns = [exact(each) for each in near]
    columns = columns if step is None else [columns[0] * rational(math.sqrt(weight)), *columns]
    turn = on_the_diagonal(*columns)
    return turn.T @ form @ turn


def is_definite(matrix):
    """True if a symmetric matrix of rationals is positive definite: all pivots are positive."""
    matrix = matrix.copy()
    for i in range(len(matrix)):
        if not matrix[i, i] > 0:
            return False
        matrix[i + 1 :, i + 1 :] -= np.outer(matrix[i + 1 :, i], matrix[i, i + 1 :]) / matrix[i, i]
    return True
