"""Figures of sweeps: one column over another in curves, and steps of the relaxation rules over the moduli."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from verification.figures.style import legend_beside, new_figure, plain, styled
from verification.registry import draw as main_figure
from verification.sweeps.row import Row, title
from verification.sweeps.sweep import Sweep

MARKERS = "osD^vPX*"

#: The end of the colour map: what follows is too light on white.
DARK = 0.6


def draw_sweep(sweep: Sweep, x: str, y: str, curves: str | None = None) -> Figure:
    """One column over another; a row without a number there has no point.

    Each value of the column ``curves`` has its colour.  Rows that differ in a further axis are never joined by a line.
    By default each combination of the other axes has a curve.

    Raises
    ------
    ValueError
        A column that there is not, or nothing to draw.
    """
    for name in (x, y, *([] if curves is None else [curves])):
        if name not in sweep.columns:
            raise ValueError(f"column {name!r}: needed one of {', '.join(sweep.columns)}")
    # the axes beside x
    others = [name for name in sweep.axes if name not in (x, curves)]
    colours = sweep.values([curves] if curves else others)
    lines = sweep.values([*([curves] if curves else []), *others])
    points = {
        key: sorted(
            (row[x], row[y])
            for row in rows
            if row[x] is not None and isinstance(row[y], (int, float)) and np.isfinite(row[y])
        )
        for key, rows in lines.items()
    }
    if not any(points.values()):
        raise ValueError(f"no row has a number for {y} and a value for {x}")
    with styled():
        figure = new_figure(7.2, 4.2)
        ax = figure.subplots()
        shades = mpl.colormaps["viridis"](np.linspace(0, DARK, max(len(colours), 1)))
        for i, (key, shade) in enumerate(zip(colours, shades, strict=True)):
            label: str | None = ", ".join(
                f"{name} = {value:g}" if isinstance(value, float) else f"{name} = {value}"
                for name, value in zip([curves] if curves else others, key, strict=True)
            )
            for line, pairs in points.items():
                if line[: len(key)] == key and pairs:
                    ax.plot(
                        *zip(*pairs, strict=True), f"{MARKERS[i % len(MARKERS)]}-", color=shade, ms=3.5, label=label
                    )
                    label = None
        ax.set(xlabel=plain(title(x, sweep.units)), ylabel=plain(title(y, sweep.units)), title=plain(sweep.summary))
        if any(key for key in colours):
            legend_beside(ax)
    return figure


def draw_rules(panels: Mapping[str, Sequence[Row]]) -> Figure:
    """Steps over E1/E2, a curve for each rule, solid and with full markers where its rate is proved.

    ``panels`` maps titles to rows of sweeps, which need the columns young1, young2, rule, iterations and proved_rate; a
    run that did not arrive has no point.  Two panels lie side by side.  No rows raise ValueError.
    """
    names = list(dict.fromkeys(row["rule"] for rows in panels.values() for row in rows))
    if not names:
        raise ValueError("needed at least one row")
    columns = min(2, len(panels))
    with styled():
        lines = -(-len(panels) // columns)
        figure = new_figure(7.2, 0.8 + 2.4 * lines)
        grid = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
        shades = mpl.colormaps["viridis"](np.linspace(0, DARK, len(names)))
        for ax, (title, rows) in zip(grid.flat, panels.items(), strict=False):
            for name, shade, marker in zip(names, shades, MARKERS, strict=False):
                found = sorted((row["young1"] / row["young2"], row["iterations"], row["proved_rate"] is not None)
                               for row in rows if row["rule"] == name and row["iterations"] is not None)  # fmt: skip
                steps = np.array([max(count, 1) for _, count, _ in found])  # 0 has no place on a logarithmic axis
                ratio, proved = np.array([r for r, _, _ in found]), np.array([p for _, _, p in found], dtype=bool)
                style = {"color": shade, "marker": marker, "markersize": 4.5}
                ax.plot(ratio, steps, linestyle=(0, (2, 2)), linewidth=0.9, markerfacecolor="white", **style)
                ax.plot(ratio, np.where(proved, steps, np.nan), "-", linewidth=1.6, **style)
                ax.plot([], [], "-", label=plain(name), **style)
            ax.set(xscale="log", yscale="log", title=plain(title))
            ax.grid(color="0.9", linewidth=0.6)
        for ax in grid[-1]:
            ax.set_xlabel("E1/E2, lower over upper body")
        for ax in grid[:, 0]:
            ax.set_ylabel("steps")
        figure.legend(*grid.flat[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(names))
    return figure


main_figure.register(Sweep, draw_sweep)
