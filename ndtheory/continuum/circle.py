r"""The circle criterion for two layers: a factor of contraction by wave number, in a norm that need not be known.

Two layers touch along any part of a line; the far side of each is clamped.  One step of the iteration is
``R = (1 - theta) g + theta p``, where p are the forces of step II.  With multipliers that are the same everywhere, the
conditions of step II are integrated inequalities, and there is a norm in which T_theta contracts by q if (and, for
these multipliers, only if), for every wave number and every complex h on the circle::

    h = theta/(z - (1 - theta)),   |z| = q,

the Hermitian form  ``M(h) = Re p_T* v_T + lambda Re p_N* v_N - alpha |smooth h p_N|^2 - beta |v_T|^2``  of the forces p
is positive definite, where ``v = (h A_n + A_c) p`` is the jump, A_n and A_c are the flexibilities of both layers,
lambda, alpha and beta are positive and ``4 alpha beta >= k^2``.  The proof is in ``docs/layers.md``.

The circle is symmetric to the real axis, which it meets in :func:`disk`.  All of M but ``i Im h`` times an
antisymmetric matrix is affine in Re h on the circle, so that M is decided by two real matrices of two rows, those at
both ends, and by one number: :class:`Pencil`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from typing import Self

from ndtheory.continuum.intervals import Interval
from ndtheory.continuum.strip import Part, Strip, everywhere, smooth, times_smooth
from ndtheory.errors import HypothesisError
from ndtheory.scalar import Scalar

#: The shortest part of wave numbers into which a proof divides, over its first end.
SHORTEST = Fraction(1, 2**20)

#: A symmetric matrix of two rows: TT, NN and NT.
Symmetric = tuple[Scalar, Scalar, Scalar]


def disk(theta: Scalar, q: Scalar) -> tuple[Scalar, Scalar]:
    """The two points of the real axis on the circle of theta and q > 1 - theta.

    HypothesisError for another q.  Smaller disks belong to larger q.  Every small theta contracts where the criterion
    holds on the disk from 0 to 1, to which those of q = 1 shrink as theta tends to 0.

    Examples
    --------
    >>> disk(Fraction(7, 10), Fraction(1, 2))
    (Fraction(-7, 8), Fraction(7, 2))
    """
    if not q > 1 - theta:
        raise HypothesisError("q", q, f"a factor above 1 - theta = {1 - theta}")
    return -theta / (q + 1 - theta), theta / (q - 1 + theta)


@dataclass(frozen=True, kw_only=True)
class Multipliers:
    """lambda, alpha and beta > 0; ``tau`` is 1.  alpha has the unit length/stress, beta stress/length."""

    normal: Scalar
    alpha: Scalar
    beta: Scalar

    @property
    def enclosed(self) -> Self:
        """The same as intervals."""
        return replace(self, **{name: Interval.of(value) for name, value in vars(self).items()})


#: Both flexibilities, multipliers, and the square of the smoothing, as intervals.
Enclosed = tuple[Symmetric, Symmetric, Multipliers, Interval]


@dataclass(frozen=True)
class Pencil:
    """The form M on a circle: ``(1 - u) low + u high + i turn sqrt(u (1 - u)) J``, 0 <= u <= 1, J' = -J.

    ``low`` and ``high`` are M at both ends of the disk; ``turn`` has any sign.
    """

    low: Symmetric
    high: Symmetric
    turn: Scalar

    @property
    def determinants(self) -> tuple[Scalar, Scalar, Scalar]:
        """The determinant of M in Bernstein's form: its values at both ends, and the coefficient of ``2 u (1 - u)``."""
        (a, b, c), (p, q, r) = self.low, self.high
        return a * b - c**2, p * q - r**2, (a * q + p * b - self.turn**2) / 2 - c * r


def flexibility(form: Sequence[Scalar], *, side: int) -> Symmetric:
    """The inverse of TT, NN and NT of a layer on a side, -1 or 1, of the surface."""
    along, across, mixed = form
    determinant = along * across - mixed**2
    return across / determinant, along / determinant, -side * mixed / determinant


def pencil(
    contact: Symmetric, neumann: Symmetric, by: Multipliers, smooth_square: Scalar, ends: tuple[Scalar, Scalar]
) -> Pencil:
    """M of two flexibilities at one wave number on the circle with some ends; ``smooth_square`` is ``|smooth|^2``.

    Examples
    --------
    Without friction M is ``A_c + Re(h) A_n``.

    >>> rigid = Multipliers(normal=Fraction(1), alpha=Fraction(0), beta=Fraction(0))
    >>> found = pencil((2, 1, 0), (1, 1, 0), rigid, 1, (Fraction(-1), Fraction(2)))
    >>> found.low[:2] == (1, 0), found.high[:2] == (4, 3), found.determinants == (0, 12, Fraction(3, 2))
    (True, True, True)
    """
    (c_T, c_N, c_X), (n_T, n_N, n_X) = contact, neumann
    lam, beta = by.normal, by.beta

    def at(x: Scalar) -> Symmetric:
        along, across, mixed = c_T + x * n_T, c_N + x * n_N, c_X + x * n_X
        return (
            along - beta * along**2,
            lam * across - beta * mixed**2 - by.alpha * smooth_square * x**2,
            (1 + lam) * mixed / 2 - beta * along * mixed,
        )

    low, high = ends
    turn = (high - low) * ((1 - lam) * n_X / 2 - beta * (c_T * n_X - c_X * n_T))
    return Pencil(at(low), at(high), turn)


@dataclass(frozen=True, kw_only=True)
class TwoLayers:
    """Two layers that touch along any part of a line, with the hat kernel of a radius r > 0.

    ``contact`` is the layer of step II, ``neumann`` the one of step I; ``radius`` is a length.
    """

    contact: Strip
    neumann: Strip
    radius: Fraction

    @property
    def swapped(self) -> TwoLayers:
        """The same with the roles exchanged."""
        return TwoLayers(contact=self.neumann, neumann=self.contact, radius=self.radius)

    def contracts(self, ends: tuple[Fraction, Fraction], by: Multipliers) -> bool:
        """True if M is proved to be positive definite at every wave number, on the circle with some ends.

        ``ends`` are those of :func:`disk`.  False, too, where :func:`~ndtheory.continuum.strip.everywhere` leaves it
        open, and for multipliers that are not positive.

        Examples
        --------
        The layers of Section 6 contract by 0.36 at theta = 0.7, with multipliers that allow k = 0.2:

        >>> from ndtheory.moduli import Moduli
        >>> soft, hard = (Strip(body=Moduli(young=E, poisson="0.3"), thickness=Fraction(3, 10)) for E in (20000, 70000))
        >>> layers = TwoLayers(contact=soft, neumann=hard, radius=Fraction(1, 10))
        >>> by = Multipliers(normal=Fraction(11), alpha=Fraction("0.2") ** 2 / (4 * 5900), beta=Fraction(5900))
        >>> layers.contracts(disk(Fraction(7, 10), Fraction(36, 100)), by)
        True
        """
        circle = (Interval.of(ends[0]), Interval.of(ends[1]))
        return self.everywhere(by, lambda given: definite(pencil(*given, circle)))

    def contracts_in_energy(self, theta: Fraction, q: Fraction, by: Multipliers, weight: Fraction) -> bool:
        """True if T_theta is proved to contract by q in the norm (5.21), by the multipliers times a weight > 0.

        There the norm is the energy of the Neumann layer, ``|g|^2 = g' A_n g``, and the form of g and p::

            q^2 |g|^2 - |theta p + (1 - theta) g|^2 + weight M(g, p)

        must be positive definite at every wave number, with ``v = A_n g + A_c p`` in M.
        """
        size, step = Interval.of(weight), (Interval.of(theta), Interval.of(1 - theta), Interval.of(q).square())
        return weight > 0 and self.everywhere(by, lambda given: _positive(energy_form(*given, step, size)))

    def everywhere(self, by: Multipliers, holds: Callable[[Enclosed], bool]) -> bool:
        """True if multipliers are positive and something is shown to hold on parts that cover all wave numbers."""
        sizes = [1 / self.contact.thickness, 1 / self.neumann.thickness, 6 / self.radius]
        positive = min(by.normal, by.alpha, by.beta) > 0
        return positive and everywhere(lambda part: holds(self.enclosed(part, by.enclosed)), sizes, shortest=SHORTEST)

    def enclosed(self, part: Part, by: Multipliers) -> Enclosed:
        """Both flexibilities, the multipliers and the smoothing for :func:`pencil` on a part of the wave numbers.

        Times xi where both layers are thick beside the waves.
        """
        contact, neumann, smoothed, fading = _forms(self, part)
        return contact, neumann, by if fading is None else replace(by, beta=by.beta * fading), smoothed


#: Flexibilities, square of the smoothing, and 1/xi where they are times xi, on parts that several proofs ask for.
@lru_cache(maxsize=2**14)
def _forms(layers: TwoLayers, part: Part) -> tuple[Symmetric, Symmetric, Interval, Interval | None]:
    long = part[0] * min(layers.contact.thickness, layers.neumann.thickness) >= 1
    contact = flexibility(_stiffness(layers.contact, part, over=long), side=-1)
    neumann = flexibility(_stiffness(layers.neumann, part, over=long), side=1)
    if not long:
        return contact, neumann, smooth(part, layers.radius), None
    fading = Interval.between(0 if part[1] is None else 1 / part[1], 1 / part[0])
    return contact, neumann, times_smooth(part, layers.radius), fading


def energy_form(
    contact: Symmetric,
    neumann: Symmetric,
    by: Multipliers,
    smooth_square: Scalar,
    step: tuple[Scalar, Scalar, Scalar],
    weight: Scalar,
) -> list[list[Scalar]]:
    """The form of :meth:`TwoLayers.contracts_in_energy`, of (g_T, g_N, p_T, p_N); ``step`` is theta, 1 - theta, q^2."""
    theta, rest, square = step
    (n_T, n_N, n_X), (c_T, c_N, c_X) = neumann, contact
    v_T, v_N = (n_T, n_X, c_T, c_X), (n_X, n_N, c_X, c_N)
    g_T, g_N, p_T, p_N = ([int(i == j) for j in range(4)] for i in range(4))
    moved = lambda n_1, n_2: (rest * n_1, rest * n_2, theta * n_1, theta * n_2)  # A_n (theta p + (1 - theta) g)
    terms = (
        (square, g_T, (n_T, n_X, 0, 0)),
        (square, g_N, (n_X, n_N, 0, 0)),
        (-1, (rest, 0, theta, 0), moved(n_T, n_X)),
        (-1, (0, rest, 0, theta), moved(n_X, n_N)),
        (weight, p_T, v_T),
        (weight * by.normal, p_N, v_N),
        (-weight * by.alpha * smooth_square, g_N, g_N),
        (-weight * by.beta, v_T, v_T),
    )
    entry = lambda i, j: sum(times * (a[i] * b[j] + a[j] * b[i]) / 2 for times, a, b in terms)
    return [[entry(i, j) for j in range(4)] for i in range(4)]


def _positive(form: list[list[Interval]]) -> bool:
    """True if a symmetric matrix is proved to be positive definite, by elimination."""
    rows = [list(row) for row in form]
    for k in reversed(range(len(rows))):  # the forces of step II first
        if rows[k][k].lo <= 0:
            return False
        for i in range(k):
            for j in range(i + 1):
                rows[i][j] = rows[i][j] - rows[k][i] * rows[k][j] / rows[k][k]
    return True


def _stiffness(strip: Strip, part: Part, *, over: bool) -> tuple[Interval, ...]:
    """TT, NN and NT of a layer on a part, over xi where asked for; by the sharper of two enclosures."""
    if over:
        return strip.over_wave_number(part)
    lo, hi = part
    if hi is None or lo * strip.thickness < 1:
        return strip.form(part)
    return tuple(Interval.between(lo, hi) * entry for entry in strip.over_wave_number(part))


def definite(form: Pencil) -> bool:
    """True if M is proved to be positive definite on the whole circle."""
    low, high, middle = form.determinants
    if min(form.low[0].lo, form.high[0].lo, low.lo, high.lo) <= 0:
        return False
    return bool(middle.lo > 0 or (Interval.of(middle.lo).square() - Interval.of(low.lo) * high.lo).hi < 0)
