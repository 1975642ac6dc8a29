r"""The largest ratio of stiffness of waves on two half-planes of equal cells, proved for all wave numbers, in balls.

The cells are those of :class:`fem1d2d.layers.Layer` with alternating diagonals, one column of the contact body facing
one of the Neumann body.  Waves of xi and of xi + pi radians per column occur together.  With the amplitudes
``x = (T_1, N_1, T_2, N_2)`` of the displacements ``(i T, N)`` of both, and the sign of the second one changed from each
row to the next, one row of cells is a real matrix ``K_0 + cos(xi) K_1 + sin(xi) K_2`` of the nodes above and below it,
with blocks ``A, B, B', C``.  The stiffness s of the surface is the fixed point of

    F(X) = min over E of  W(E) + E' X E,   W(E) = [1; E]' K [1; E]   (the energy of the first row),

and F increases with X.  So ``F(X) <= X`` proves ``s <= X``, and ``X <= F(X)`` proves ``X <= s`` for X > 0.  For trial
polynomials X, E in xi, with the residuals ``R = X - W - E'XE`` and ``g = B' + (C + (1 - eps) X) E``:

    (1 + eps) R + eps W >= 0                                  proves  s <= (1 + eps) X,
    eps W - (1 - eps) R - g' g / c >= 0,   C >= c > 0,        proves  (1 - eps) X <= s.

From 0 to ``xi_0`` X and E are the first terms of their expansions, exact for long waves; beyond, they interpolate s.
All are inequalities between polynomials, and what they prove holds for every symmetric X and every E.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np
from flint import arb, arb_mat, ctx
from scipy.linalg import eigh

from fem1d2d.mesh import Floats

#: A polynomial in t, -1 <= t <= 1, with matrices as coefficients, the constant one first.
Poly = list[Any]

#: Bits of a ball: elimination on waves of xi_0 radians loses some 100.
BITS = 256

#: eps, and the relative amount by which the bound to be proved exceeds the largest value seen.
EPSILON, ABOVE = Fraction(1, 2**34), Fraction(1, 2**31)

#: Long waves, up to xi_0 radians per column: the terms beyond the first ones are a few times xi_0.
LONG = Fraction(1, 2**40)

#: Degrees of X and E, and of the expansions of cos and sin.
DEGREE, TRIGONOMETRIC = 8, 14

#: Pieces of wave numbers have at most this length, and ends of at most this ratio.
LENGTH, RATIO = Fraction(1, 8), Fraction(3, 2)

#: A little more than pi/2, where the two waves are mirror images.
END = Fraction(1571, 1000)

#: The shortest piece into which a search divides.
SHORTEST = Fraction(1, 2**24)

#: Scales of the four amplitudes on long waves, as powers of xi: the energy of one row is like their square.
POWERS = (1, 1, 0, 0)


class Undecided(ArithmeticError):
    """An inequality that the balls do not decide."""


@dataclass(frozen=True)
class Stretch:
    """Wave numbers between two, and X with ``(1 - eps) X <= s <= (1 + eps) X`` there, from t = -1 to t = 1.

    From 0 on, X is constant, and the enclosure is that of ``D^-1 s D^-1`` with ``D = diag(xi^(POWERS/2))``.
    """

    lo: Fraction
    hi: Fraction
    X: Poly

    def on(self, lo: Fraction, hi: Fraction) -> Poly:
        """X on a part, from t = -1 to t = 1."""
        if not self.lo:
            return self.X
        middle = ball((lo + hi - self.lo - self.hi) / (self.hi - self.lo))
        half = ball((hi - lo) / (self.hi - self.lo))
        found = [self.X[-1]]
        for c in reversed(self.X[:-1]):  # Horner's rule at middle + half t
            found = _plus([c], _scaled(middle, found), [c * 0, *_scaled(half, found)])
        return found


# --- polynomials of matrices ------------------------------------------------------------------------------------------


def _plus(*terms: Poly) -> Poly:
    return [sum((p[k] for p in terms if k < len(p)), start=terms[0][0] * 0) for k in range(max(map(len, terms)))]


def _scaled(factor: Any, p: Poly) -> Poly:
    return [factor * c for c in p]


def _times(p: Poly, q: Poly) -> Poly:
    found = [p[0] * q[0] * 0 for _ in range(len(p) + len(q) - 1)]
    for i, a in enumerate(p):
        for j, b in enumerate(q):
            found[i + j] += a * b
    return found


def _transposed(p: Poly) -> Poly:
    return [c.transpose() for c in p]


def _part(p: Poly, rows: Sequence[int], columns: Sequence[int]) -> Poly:
    return [arb_mat([[c[i, j] for j in columns] for i in rows]) for c in p]


def ball(value: Fraction) -> Any:
    """A fraction as a ball."""
    return arb(value.numerator) / value.denominator


def _norm(c: Any) -> Any:
    """A bound of the spectral norm."""
    return sum((x.abs_upper() ** 2 for x in c.entries()), start=arb(0)).sqrt().upper()


def _definite(c: Any) -> bool:
    """True if a symmetric matrix is proved to be positive definite: all pivots are positive."""
    rows = [[c[i, j] for j in range(c.ncols())] for i in range(c.nrows())]
    for k, pivot in enumerate(rows):
        if not pivot[k] > 0:
            return False
        for row in rows[k + 1 :]:
            factor = row[k] / pivot[k]
            row[:] = [a - factor * b for a, b in zip(row, pivot, strict=True)]
    return True


def positive(p: Poly, scales: Sequence[Any]) -> bool:
    """True if a symmetric polynomial is proved to be positive definite for ``|t| <= 1``.

    Its linear part is if it is at both ends; the rest has at most the sum of its norms, also where its coefficients
    are balls in which they depend on t.
    """
    scale = arb_mat([[1 / scales[i] if i == j else 0 for j in range(len(scales))] for i in range(len(scales))])
    p = [scale * c * scale for c in p]
    rest = sum((_norm(c) for c in p[2:]), start=arb(0))
    least = arb_mat([[rest if i == j else 0 for j in range(len(scales))] for i in range(len(scales))])
    linear = p[1] if len(p) > 1 else p[0] * 0
    return _definite(p[0] + linear - least) and _definite(p[0] - linear - least)


# --- one body ---------------------------------------------------------------------------------------------------------


def row_of_cells(aspect: Fraction, modulus: Fraction) -> tuple[Any, Any, Any]:
    """K_0, K_1, K_2 of the nodes above and below a row, G = 1, ``modulus`` being ``(lambda + 2 G)/G``."""
    r, M = aspect, modulus
    T_1, N_1, T_2, N_2 = range(4)
    K = [[[Fraction(0)] * 8 for _ in range(8)] for _ in range(3)]

    def add(which: int, factor: Fraction, one: dict[int, int], other: dict[int, int]) -> None:
        for i, a in one.items():
            for j, b in other.items():
                K[which][i][j] += factor * a * b / 2
                K[which][j][i] += factor * a * b / 2

    difference = {k: {k: 1, k + 4: -1 if k < 2 else 1} for k in range(4)}  # the second wave changes its sign
    total = {k: {k: 1, k + 4: 1 if k < 2 else -1} for k in range(4)}
    for k, stiff, shear, sign in ((T_1, M, 1, -1), (N_1, 1, M, -1), (T_2, M, 1, 1), (N_2, 1, M, 1)):
        for node in (k, k + 4):  # 4 sin^2(xi/2) = 2 - 2 cos xi, for the second wave 2 + 2 cos xi
            add(0, Fraction(stiff) / r, {node: 1}, {node: 1})
            add(1, sign * Fraction(stiff) / r, {node: 1}, {node: 1})
        add(0, Fraction(shear) * r, difference[k], difference[k])
    for T, N, sign in ((T_1, N_1, 1), (T_2, N_2, -1)):  # mean of both diagonals
        add(2, -sign * (M - 2), total[T], difference[N])
        add(2, Fraction(sign), total[N], difference[T])
    add(2, M - 1, difference[T_2], difference[N_1])  # half their difference, for a rising diagonal in column 0
    add(2, 1 - M, difference[T_1], difference[N_2])
    return tuple(arb_mat([[ball(x) for x in row] for row in matrix]) for matrix in K)  # type: ignore[return-value]


def expanded(K: tuple[Any, Any, Any], middle: Fraction, half: Fraction) -> Poly:
    """The matrix of a row as a polynomial in t; the last coefficient is a ball in which it depends on t."""
    x, h, size = ball(middle), ball(half), arb(1)
    cos, sin = x.cos(), x.sin()
    found = []
    for k in range(TRIGONOMETRIC + 1):
        found.append((K[1] * cos + K[2] * sin) * size + (K[0] if k == 0 else K[0] * 0))
        cos, sin, size = -sin, cos, size * h / (k + 1)
    beyond = arb(0, size.upper())
    most = zip(K[1].entries(), K[2].entries(), strict=True)
    return [*found, arb_mat(8, 8, [beyond * (abs(a) + abs(b)) for a, b in most])]


_ABOVE, _BELOW = range(4), range(4, 8)


def surface(K: Any) -> tuple[Any, Any]:
    """About s and E at one wave number: slabs of rows are doubled, without bounds of errors."""
    A, B, C = (_part([K], *at)[0].mid() for at in ((_ABOVE, _ABOVE), (_ABOVE, _BELOW), (_BELOW, _BELOW)))
    first_B, first_C = B, C
    for _ in range(BITS):
        inner = (C + A).inv().mid()
        change = (B * inner * B.transpose()).mid()
        A, C, B = A - change, (C - B.transpose() * inner * B).mid(), -(B * inner * B).mid()
        A = ((A + A.transpose()) * arb("0.5")).mid()
        if _norm(change) < arb(2) ** (-BITS + 20):
            return A, (-(first_C + A).solve(first_B.transpose())).mid()
    raise Undecided(f"{BITS} doublings of the rows do not give the stiffness of a half-plane")


@lru_cache(maxsize=8)
def _nodes() -> tuple[list[Any], Any]:
    """Chebyshev's nodes, and the inverse of their Vandermonde matrix."""
    t = [arb.cos_pi(arb(2 * j + 1) / (2 * DEGREE + 2)).mid() for j in range(DEGREE + 1)]
    return t, arb_mat([[x**k for k in range(DEGREE + 1)] for x in t]).inv().mid()


def _through(values: Sequence[Any]) -> Poly:
    """The polynomial with about these values at the nodes; its coefficients are exact."""
    inverse = _nodes()[1]
    return [
        sum((inverse[k, j] * value for j, value in enumerate(values)), start=values[0] * 0).mid()
        for k in range(DEGREE + 1)
    ]


def _at(p: Poly, t: Any) -> Any:
    return sum((c * t**k for k, c in enumerate(p)), start=p[0] * 0)


def interpolated(K: tuple[Any, Any, Any], middle: Fraction, half: Fraction) -> tuple[Poly, Poly]:
    """About s and E on a piece, as polynomials."""
    angles = [ball(middle) + ball(half) * t for t in _nodes()[0]]
    found = [surface(K[0] + K[1] * angle.cos() + K[2] * angle.sin()) for angle in angles]
    return tuple(_through(values) for values in zip(*found, strict=True))  # type: ignore[return-value]


def long_waves(aspect: Fraction, modulus: Fraction) -> tuple[Poly, Poly]:
    """First terms of X and E in xi: a half-plane of the continuum, and two waves that change sign with each column."""
    r, M = aspect, modulus
    kappa = (M + 1) / (M - 1)
    a, b = 1 + 1 / kappa, 1 - 1 / kappa
    X, E = ([arb_mat(4, 4), arb_mat(4, 4)] for _ in range(2))
    surface, falls = ((a, b), (b, a)), ((a, b - 1), ((b + M - 2) / M, a / M))  # the displacement with depth, over xi
    for i in range(2):
        E[0][i, i] = 1
        for j in range(2):
            X[1][i, j], E[1][i, j] = ball(surface[i][j]), ball(-falls[i][j] / r)
    for k, p, q in ((2, 2 * M / r, r), (3, 2 / r, M * r)):
        X[0][k, k] = (ball(p) * ball(p + 2 * q)).sqrt()
        E[0][k, k] = -ball(q) / (ball(p + q) + X[0][k, k])
    return X, E


def proves(K: Poly, X: Poly, E: Poly, lo: Fraction, hi: Fraction) -> bool:
    """True if ``(1 - eps) X <= s <= (1 + eps) X`` is proved; from lo = 0 on the polynomials are in xi/hi."""
    A, B, C = (_part(K, *at) for at in ((_ABOVE, _ABOVE), (_ABOVE, _BELOW), (_BELOW, _BELOW)))
    eps, size = ball(EPSILON), ball((lo + hi) / 2 if lo else hi)
    BE, Et = _times(B, E), _transposed(E)
    W = _plus(A, BE, _transposed(BE), _times(Et, _times(C, E)))
    R = _plus(X, _scaled(-1, W), _scaled(-1, _times(Et, _times(X, E))))
    g = _plus(_transposed(B), _times(_plus(C, _scaled(1 - eps, X)), E))
    c = arb(float(eigh(_doubles(C[0]), eigvals_only=True)[0]) / 2)
    shift = arb_mat([[-c if i == j else 0 for j in range(4)] for i in range(4)])
    upper = _plus(_scaled(1 + eps, R), _scaled(eps, W))
    lower = _plus(_scaled(eps, W), _scaled(eps - 1, R), _scaled(-1 / c, _times(_transposed(g), g)))
    if not lo:
        upper, lower = _divided(upper), _divided(lower)
    scales = [size**power for power in POWERS]
    return (
        c > 0
        and positive(_plus(C, [shift]), [arb(1)] * 4)
        and (not lo or positive(X, [scale.sqrt() for scale in scales]))
        and all(positive(p, scales) for p in (upper, lower))
    )


def _divided(p: Poly) -> Poly:
    """``D^-1 p D^-1`` with ``D = diag((xi/xi_0)^POWERS)``; Undecided if a coefficient does not vanish as it must."""
    found = [c * 0 for c in p]
    for i, a in enumerate(POWERS):
        for j, b in enumerate(POWERS):
            for k, c in enumerate(p):
                if k >= a + b:
                    found[k - a - b][i, j] = c[i, j]
                elif not c[i, j].contains(0):
                    raise Undecided(f"coefficient {k} of entry {i}, {j} is {c[i, j]}")
    return found


@lru_cache(maxsize=32)
def pieces(aspect: Fraction, modulus: Fraction) -> tuple[Stretch, ...]:
    """s enclosed for all ``0 < xi <= pi/2``, in pieces from the first one on, G = 1; Undecided if a piece is too short.

    Parameters
    ----------
    aspect : Fraction
        Width over height of a cell.
    modulus : Fraction
        ``(lambda + 2 G)/G > 1``.
    """
    K = row_of_cells(aspect, modulus)
    first, E = ([c * ball(LONG) ** k for k, c in enumerate(p)] for p in long_waves(aspect, modulus))
    if not proves(expanded(K, Fraction(0), LONG), first, E, Fraction(0), LONG):
        raise Undecided(f"long waves, up to {float(LONG):g} radians per column")
    found = [Stretch(Fraction(0), LONG, [first[0] + first[1] / ball(LONG)])]
    waiting: list[tuple[Fraction, Fraction]] = []
    while not waiting or waiting[-1][1] < END:
        lo = waiting[-1][1] if waiting else LONG
        waiting.append((lo, min(lo * RATIO, lo + LENGTH, END)))
    waiting.reverse()
    while waiting:
        lo, hi = waiting.pop()
        middle, half = (lo + hi) / 2, (hi - lo) / 2
        X, E = interpolated(K, middle, half)
        if proves(expanded(K, middle, half), X, E, lo, hi):
            found.append(Stretch(lo, hi, X))
        elif half < lo * SHORTEST:
            raise Undecided(f"waves of {float(lo):g} to {float(hi):g} radians per column")
        else:
            waiting += [(middle, hi), (lo, middle)]
    return tuple(found)


# --- both bodies ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class HalfPlane:
    """Equal cells of an isotropic half-plane: ``aspect`` (width over height), ``shear`` G, ``poisson`` < 1/2."""

    aspect: Fraction
    shear: Fraction
    poisson: Fraction

    @property
    def modulus(self) -> Fraction:
        """``(lambda + 2 G)/G``."""
        return 2 * (1 - self.poisson) / (1 - 2 * self.poisson)


_T, _N = (0, 2), (1, 3)


def enclosed_ratio(
    contact: HalfPlane, neumann: HalfPlane, phase: float, *, mirrored: bool, normal: bool
) -> tuple[float, float]:
    """Bounds of the supremum over ``0 < xi < pi`` of the largest stiffness of waves, contact over Neumann body.

    Parameters
    ----------
    contact, neumann : HalfPlane
        Columns of equal width.
    phase : float
        About the 2 xi at which it is largest, 0 for long waves: the closer, the narrower are the bounds.
    mirrored : bool
        True if the diagonals of both bodies mirror each other.
    normal : bool
        True for the supremum with the tangential components condensed out.

    Returns
    -------
    pair of float
        The supremum lies between them; they differ by about 1e-9 of it.

    Raises
    ------
    Undecided
        The balls do not decide.

    Examples
    --------
    >>> from fractions import Fraction as F
    >>> tall, flat = (HalfPlane(aspect=aspect, shear=F(1), poisson=F(3, 10)) for aspect in (F(1, 2), F(1)))
    >>> bounds = enclosed_ratio(tall, flat, 0.0, mirrored=True, normal=True)
    >>> [round(bound, 6) for bound in bounds]
    [1.290994, 1.290994]
    """
    with ctx.workprec(BITS):
        ratio = ball(contact.shear / neumann.shear)
        signs = (1, -1, 1, -1) if mirrored else (1, -1, -1, 1)  # seen from the other side, and from the next column
        seen = lambda c: arb_mat([[c[i, j] * signs[i] * signs[j] for j in range(4)] for i in range(4)])
        both = [pieces(body.aspect, body.modulus) for body in (contact, neumann)]
        own = [Stretch(piece.lo, piece.hi, _scaled(ratio, piece.X)) for piece in both[0]]
        other = [Stretch(piece.lo, piece.hi, [seen(c) for c in piece.X]) for piece in both[1]]
        at = min(max(Fraction(phase) / 2, LONG), END - SHORTEST)
        least = max(_largest_at(_on(own, x), _on(other, x), normal) for x in (LONG / 2, at))
        most = least * (1 + ball(ABOVE))
        parts = [
            (max(a.lo, b.lo), min(a.hi, b.hi), a, b) for a in own for b in other if max(a.lo, b.lo) < min(a.hi, b.hi)
        ]
        while parts:
            lo, hi, a, b = parts.pop()
            scales = [ball((lo + hi) / 2 if lo else Fraction(1)).sqrt() ** power for power in POWERS]
            if at_most(most, a.on(lo, hi), b.on(lo, hi), scales, normal):
                continue
            if not lo or hi - lo < lo * SHORTEST:
                raise Undecided(f"a bound of {float(most):g} for waves of {float(lo):g} to {float(hi):g}")
            parts += [(lo, (lo + hi) / 2, a, b), ((lo + hi) / 2, hi, a, b)]
        return _double(least, -1), _double(most, 1)


def _on(side: Sequence[Stretch], x: Fraction) -> Any:
    """X at one wave number."""
    return next(piece.on(x, x)[0] for piece in side if piece.hi >= x)


def _double(bound: Any, side: int) -> float:
    """The double below or above a positive ball."""
    found = float(bound)
    while not (arb(found) - bound) * side >= 0:
        found = math.nextafter(found, side * math.inf)
    return found


def _largest_at(contact: Any, neumann: Any, normal: bool) -> Any:
    """A lower bound of the largest ratio at one wave number, at a vector found in doubles."""
    if normal:
        contact, neumann = (_schur(c) for c in (contact, neumann))
    X_c, X_n = _doubles(contact), _doubles(neumann)
    scale = np.sqrt(np.diag(X_n))
    vector = eigh(X_c / np.outer(scale, scale), X_n / np.outer(scale, scale))[1][:, -1] / scale
    v = arb_mat([[arb(float(x))] for x in vector])
    quotient = (v.transpose() * contact * v)[0, 0] / (v.transpose() * neumann * v)[0, 0]
    return quotient.lower() * (1 - ball(EPSILON)) / (1 + ball(EPSILON))


def _doubles(c: Any) -> Floats:
    return np.array([[float(x) for x in row] for row in c.tolist()])


def _schur(c: Any) -> Any:
    TT, TN, NN = (_part([c], *at)[0] for at in ((_T, _T), (_T, _N), (_N, _N)))
    return NN - TN.transpose() * TT.solve(TN)


def at_most(most: Any, contact: Poly, neumann: Poly, scales: Sequence[Any], normal: bool) -> bool:
    """True if ``s_c <= most s_n`` is proved for the symbols enclosed by two polynomials."""
    factors = most * (1 - ball(EPSILON)), -(1 + ball(EPSILON))
    if not normal:
        return positive(_plus(_scaled(factors[0], neumann), _scaled(factors[1], contact)), scales)
    (Q_c, _), (Q_n, r) = (_condensed(X) for X in (contact, neumann))
    t, n = ([scales[i] for i in part] for part in (_T, _N))
    eighth = arb_mat([[t[i] ** 2 / 8 if i == j else 0 for j in range(2)] for i in range(2)])
    TT = _part(neumann, _T, _T)
    off = _times(_transposed(r), _times([eighth.inv()], r))  # at least r' TT^-1 r
    form = _plus(_scaled(factors[0], _plus(Q_n, _scaled(-1, off))), _scaled(factors[1], Q_c))
    return positive(_plus(TT, [-eighth]), t) and positive(form, n)


def _condensed(X: Poly) -> tuple[Poly, Poly]:
    """``[E; 1]' X [E; 1]``, E about ``-TT^-1 TN``: at least the Schur complement.  And the residual ``TT E + TN``."""
    TT, TN, NN = (_part(X, *at) for at in ((_T, _T), (_T, _N), (_N, _N)))
    E = _through([-(_at(TT, t).solve(_at(TN, t))) for t in _nodes()[0]])
    r = _plus(_times(TT, E), TN)
    cross = _times(_transposed(TN), E)
    return _plus(NN, cross, _transposed(cross), _times(_transposed(E), _times(TT, E))), r
