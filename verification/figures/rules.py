"""Steps of the relaxation rules over the ratio of the moduli."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from verification.figures.style import new_figure, plain, styled
from verification.figures.sweep import MARKERS
from verification.sweeps.row import Row


def draw_rules(panels: Mapping[str, Sequence[Row]], *, columns: int = 2) -> Figure:
    """Steps over E1/E2, a curve for each rule; a curve is solid, its markers are full, where a rate of it is proved.

    Parameters
    ----------
    panels : mapping from a title to rows of sweeps
        With the columns young1, young2, rule, iterations and proved_rate; a run that did not arrive has no point.
    columns : int
        Panels side by side.

    Raises
    ------
    ValueError
        No rows.
    """
    names = list(dict.fromkeys(row["rule"] for rows in panels.values() for row in rows))
    if not names:
        raise ValueError("needed at least one row")
    with styled():
        lines = -(-len(panels) // columns)
        figure = new_figure(7.2, 0.8 + 2.4 * lines)
        grid = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
        shades = mpl.colormaps["viridis"](np.linspace(0, 0.85, len(names)))
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
