"""One column of a sweep over another, in curves."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from verification.figures.style import THETA, legend_beside, new_figure, plain, styled
from verification.sweeps.sweep import Sweep

#: What is written beside an axis; the others have the name of their column.
WORDS = {
    "theta": THETA,
    "friction": "coefficient of friction k",
    "iterations": "steps to the tolerance of the residual",
    "iterations_paper": "steps by the test of Section 6.3",
    "refine": "halvings of the mesh",
    "rho": "rho",
}
MARKERS = "osD^vPX*"


def draw_sweep(sweep: Sweep, x: str, y: str, curves: str | None = None) -> Figure:
    """One column over another.

    Parameters
    ----------
    sweep : Sweep
    x, y : str
        Columns; a row without a number there has no point.
    curves : str, optional
        One colour for each value of this column.  Rows that differ in a further axis are never joined by a line.
        By default each combination of the other axes has a curve.

    Raises
    ------
    ValueError
        A column that there is not, or nothing to draw.
    """
    for name in (x, y, *([] if curves is None else [curves])):
        if name not in sweep.columns:
            raise ValueError(f"column {name!r}: needed one of {', '.join(sweep.columns)}")
    # the axes beside x; one that follows from those is no axis of its own
    others = [name for name in sweep.axes if name not in (x, curves)]
    colours = sweep.values([curves] if curves else others)
    lines = sweep.values([*([curves] if curves else []), *others])
    points = {
        key: sorted((row[x], row[y]) for row in rows if row[x] is not None and _drawn(row[y]))
        for key, rows in lines.items()
    }
    if not any(points.values()):
        raise ValueError(f"no row has a number for {y} and a value for {x}")
    with styled():
        figure = new_figure(7.2, 4.2)
        ax = figure.subplots()
        shades = mpl.colormaps["viridis"](np.linspace(0, 0.85, max(len(colours), 1)))
        for i, (key, shade) in enumerate(zip(colours, shades, strict=True)):
            label: str | None = ", ".join(
                f"{name} = {_text(value)}" for name, value in zip([curves] if curves else others, key, strict=True)
            )
            for line, pairs in points.items():
                if line[: len(key)] == key and pairs:
                    ax.plot(
                        *zip(*pairs, strict=True), f"{MARKERS[i % len(MARKERS)]}-", color=shade, ms=3.5, label=label
                    )
                    label = None
        ax.set_xlabel(_label(x, sweep))
        ax.set_ylabel(_label(y, sweep))
        ax.set_title(plain(sweep.summary))
        if any(key for key in colours):
            legend_beside(ax)
    return figure


def _drawn(value: Any) -> bool:
    return isinstance(value, (int, float)) and bool(np.isfinite(value))


def _text(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _label(name: str, sweep: Sweep) -> str:
    unit = {"young1": "stress", "young2": "stress", "radius": "length"}.get(name)
    return plain(WORDS.get(name, name) + (f" ({sweep.units[unit]})" if unit else ""))
