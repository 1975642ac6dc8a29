r"""The circle criterion for two rectangles: a factor of contraction in a norm that need not be known, for all waves.

Two rectangles of :mod:`ndtheory.continuum.rectangles` are more flexible than the layers that contain them,
``A_c = A_c^s + E_c`` and ``A_n = A_n^s + E_n`` with forms ``E >= 0`` on Gamma_c of which these bounds are known::

    T E_c T' <= C_t1^2 - A_c,TT,    T E_n T' <= C_t2^2 - A_n,TT,    E_n <= eps A_n^s

So there is a norm in which T_theta contracts by q if, for every wave number and every h on the circle of theta and q,
the form of :mod:`ndtheory.continuum.circle` with lambda = 1 less ``nu eps p* A_n p``, and with b in place of 1/beta, is
positive definite, where x_1 < 0 < x_2 are the ends of the circle, ``nu > -x_1`` and ``0 <= mu <= 1``::

    b = 1/beta - C_t1^2 + A_c,TT - sigma ((1 - mu) eps A_n,TT + mu (C_t2^2 - A_n,TT)) > 0
    sigma = max(x_1^2/(x_1 + nu), x_2^2/(x_2 + nu))

On the circle from 0 to 1, with nu = 0, it proves that every small theta contracts.  There mu = 1 needs no eps, and
Gamma_c may reach the sides of the Neumann body.  The proof is in ``docs/rectangles.md``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction

from ndtheory.continuum.circle import Enclosed, Multipliers, Pencil, Symmetric, TwoLayers, definite, pencil
from ndtheory.continuum.intervals import Interval
from ndtheory.continuum.rectangles import ContinuumConstants, TwoRectangles
from ndtheory.scalar import Scalar

#: The circle on which every small theta is decided.
SMALL_THETAS = (Fraction(0), Fraction(1))


@dataclass(frozen=True, kw_only=True)
class RectangleMultipliers(Multipliers):
    """Multipliers of two layers with lambda = 1, and the pure numbers nu and mu."""

    normal: Scalar = Fraction(1)
    nu: Scalar
    mu: Scalar


@dataclass(frozen=True, kw_only=True)
class RectangleCircle:
    """The criterion for two rectangles.

    ``layers`` contain them, and have the radius of the kernel.  ``C_t1_square`` and ``C_t2_square`` are upper bounds
    for the contact body and the Neumann body, unit length/stress.  ``cut_off`` is eps, at most; None where Gamma_c
    reaches a side of the Neumann body.

    Examples
    --------
    >>> from ndtheory.continuum.rectangles import Rectangle, continuum_constants
    >>> from ndtheory.moduli import Moduli
    >>> def body(left, right, young):
    ...     left, right, thickness = Fraction(left), Fraction(right), Fraction(3, 10)
    ...     return Rectangle(left=left, right=right, thickness=thickness, body=Moduli(young=young, poisson="0.3"))
    >>> upper_body, lower_body, ends = body("0.4", "1.6", 20000), body(0, 2, 70000), (Fraction("0.4"), Fraction("1.6"))
    >>> model = TwoRectangles(contact=upper_body, neumann=lower_body, interval=ends, radius=Fraction(1, 10))
    >>> section_6 = RectangleCircle.of(model, continuum_constants(model))
    >>> beta = Fraction(10000)
    >>> by = RectangleMultipliers(alpha=Fraction("0.6") ** 2 / (4 * beta), beta=beta, nu=0, mu=Fraction(3, 5))
    >>> section_6.contracts(SMALL_THETAS, by)  # every small theta contracts for k <= 0.6
    True
    """

    layers: TwoLayers
    C_t1_square: Scalar
    C_t2_square: Scalar
    cut_off: Scalar | None

    @classmethod
    def of(cls, model: TwoRectangles, constants: ContinuumConstants) -> RectangleCircle:
        """The criterion with the bounds of constants that were proved."""
        strips = {"contact": model.contact.strip, "neumann": model.neumann.strip}
        return cls(
            layers=TwoLayers(**strips, radius=model.radius),
            C_t1_square=constants.C_t1_square,
            C_t2_square=constants.C_t2_square,
            cut_off=constants.cut_off,
        )

    @property
    def enclosed(self) -> RectangleCircle:
        """The same with its bounds as intervals."""
        first, second = (Interval.of(bound) for bound in (self.C_t1_square, self.C_t2_square))
        cut_off = None if self.cut_off is None else Interval.of(self.cut_off)
        return replace(self, C_t1_square=first, C_t2_square=second, cut_off=cut_off)

    def contracts(self, ends: tuple[Fraction, Fraction], by: RectangleMultipliers) -> bool:
        """True if the criterion is proved at every wave number, on the circle with some ends.

        ``ends`` are those of :func:`~ndtheory.continuum.circle.disk`, or :data:`SMALL_THETAS`.  False where it is left
        open, and outside the hypotheses.
        """
        low, high = ends
        small = ends == SMALL_THETAS and by.nu == 0 and (self.cut_off is not None or by.mu == 1)
        any_theta = low < 0 < high and by.nu > -low and self.cut_off is not None
        if not (small or any_theta) or not 0 <= by.mu <= 1 or by.normal != 1:
            return False
        sigma = Interval.of(max(x**2 / (x + by.nu) for x in ends if x))
        circle, enclosed, own = (Interval.of(low), Interval.of(high)), by.enclosed, self.enclosed

        def holds(given: Enclosed) -> bool:
            slack = own.slack(given[0][0], given[1][0], given[2].beta, enclosed, sigma)
            return slack.lo > 0 and definite(own.pencil(*given, circle, slack, enclosed.nu))

        return self.layers.everywhere(by, holds)

    def slack(
        self, contact_T: Scalar, neumann_T: Scalar, beta: Scalar, by: RectangleMultipliers, sigma: Scalar
    ) -> Scalar:
        """``beta b`` from both tangential flexibilities; these times xi where ``beta`` is ``by.beta`` over xi."""
        eps = 0 if self.cut_off is None else self.cut_off
        kept = beta * (contact_T + sigma * (by.mu - (1 - by.mu) * eps) * neumann_T)
        return kept + (1 - by.beta * (self.C_t1_square + sigma * by.mu * self.C_t2_square))

    def pencil(
        self,
        contact: Symmetric,
        neumann: Symmetric,
        by: Multipliers,
        smooth_square: Scalar,
        ends: tuple[Scalar, Scalar],
        slack: Scalar,
        nu: Scalar,
    ) -> Pencil:
        """The form on the circle with some ends, from the slack at the same wave number."""
        form = pencil(contact, neumann, replace(by, beta=by.beta / slack), smooth_square, ends)
        cost = nu * (0 if self.cut_off is None else self.cut_off)
        low, high = (tuple(a - cost * n for a, n in zip(end, neumann, strict=True)) for end in (form.low, form.high))
        return replace(form, low=low, high=high)
