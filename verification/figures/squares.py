"""The functions h_1 and h_2 that bound the square of the factor over theta: Figures 1 to 3 of the paper."""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator

from ndtheory import EDITIONS, Constants
from ndtheory import bounds as b
from ndtheory.bounds import Edition
from ndtheory.number import decimal, working_precision
from verification.bounds.table import Calculated
from verification.figures.style import BODY1, BODY2, THETA, new_figure, styled
from verification.registry import draw

#: Thetas of a curve.
POINTS = 160

#: The regimes of friction in Cases 2-1 to 2-3, with the sign of a' that is the paper's caption.
REGIMES = (
    "friction below $C_3$: $a' > 0$",
    "between $C_3$ and $C_4$: $-1 < a' < 0$",
    "between $C_4$ and $C_5$: $a' < -1$",
)


def draw_squares(constants: Constants, editions: Sequence[Edition] = EDITIONS) -> Figure:
    """One row for each edition of Section 5, one panel for each regime of friction; h_1 and h_2 over theta.

    A panel has the given friction if that lies in its regime, and otherwise the
    friction whose term P lies in the middle.  Where both functions are below 1 the step is proved to contract.
    """
    with styled():
        figure = new_figure(9.6, 0.7 + 2.6 * len(editions))
        for row, edition in zip(figure.subplots(len(editions), 3, squeeze=False), editions, strict=True):
            with working_precision():
                _draw_row(list(row), constants, edition)
        handles, labels = figure.axes[-1].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    return figure


def _draw_row(row: list[Axes], constants: Constants, edition: Edition) -> None:
    m, M, C_R, given = (decimal(value) for value in (constants.m, constants.M, constants.C_R, constants.C_K))
    read, unit = edition.coercivity(m), edition.unit(m)
    C0 = b.C0(read, M, C_R)
    ends = [Decimal(0), Decimal("0.5"), Decimal(1), (2 - C0) / (1 - C0) / 2]
    row[0].set_ylabel(r"$h_1$, $h_2$")
    for i, (ax, title) in enumerate(zip(row, REGIMES, strict=True)):
        P, words = b.P(given, read, M, C_R, unit), "as given"
        if not ends[i] <= P < ends[i + 1]:
            P, words = (ends[i] + ends[i + 1]) / 2, "chosen"
        friction = given if words == "as given" else b.inverse_G(P * read**3, read, M, C_R, unit)
        _draw(ax, C0, P, b.D(friction, read, M, C_R, unit), b.Q(friction, read, M, C_R))
        ax.set_title(f"{title}\n{edition.name}, $C_K$ = {float(friction):.3g}, {words}")


def _draw(ax: Axes, C0: Decimal, P: Decimal, D: Decimal, Q: Decimal) -> None:
    C1, low = b.C1(D, Q), float(b.lower_end(P))
    right = min(1.0, 1.3 * float(C1))
    thetas = np.linspace(0, right, POINTS).tolist()
    of_h1, of_h2 = (
        np.array([-float(gain(Decimal(theta), *rest)) for theta in thetas])
        for gain, rest in ((b.one_minus_h1, (D, Q)), (b.one_minus_h2, (P,)))
    )
    lowest = -float(b.one_minus_h2(C0, P))
    highest = max(-0.5 * lowest, 1.2 * float(of_h2[: POINTS // 2].max()))
    marks = [(" $C_1$", float(C1), "left"), ("$C_0$ ", float(C0), "right")] + [("$C_6$ ", low, "right")] * (low > 0)
    ax.axvspan(low, float(C1), color="0.9", label="proved to contract")
    ax.plot(thetas, np.maximum(of_h1, of_h2), color="0.55", linewidth=4, label="bound of the squared factor")
    ax.plot(thetas, of_h2, "-", color=BODY1, label="$h_2$")
    ax.plot(thetas, of_h1, "--", color=BODY2, label="$h_1$")
    ax.axhline(0, color="0.3", linewidth=0.8)
    for name, theta, side in marks:
        ax.axvline(theta, color="0.3", linestyle=":", linewidth=0.9)
        height = 0.5 if side == "left" else 1.0  # right of C_1 the curve of h_1 takes the room above
        ax.text(theta, height, name, transform=ax.get_xaxis_transform(), ha=side, va="top")
    ax.set(xlim=(0, right), ylim=(max(1.3 * lowest, -1.0), highest), xlabel=THETA)
    ax.xaxis.set_major_locator(MaxNLocator(4))
    ax.ticklabel_format(axis="x", scilimits=(-2, 3))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda y, _: _near_one(y, -lowest)))


def _near_one(above: float, span: float) -> str:
    """1 plus a number, so that neighbours on an axis of that span differ."""
    if span > 1e-3 or above == 0:
        return f"{round(1 + above, 9) + 0.0:g}"
    return f"1 {'-' if above < 0 else '+'} {abs(above):.2g}"


@draw.register
def _(result: Calculated) -> Figure:
    """h_1 and h_2 over theta, of the editions that were asked for."""
    if result.constants is None:
        raise ValueError("h_1 and h_2 need the constants m, M, C_R and C_K")
    chosen = [edition for edition in EDITIONS if not result.results[edition.name].not_computed]
    return draw_squares(result.constants, chosen)
