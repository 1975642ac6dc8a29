"""One look for all figures: readable for the colour-blind and in grey print."""

from __future__ import annotations

import re
import threading
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import LogFormatterSciNotation

from fem1d2d.mesh import Floats
from ndtheory.texts import clean, printable

#: Blue, vermilion and their kin from the palette of Okabe and Ito; they differ in lightness too.
BODIES = BODY1, BODY2 = "#0072B2", "#D55E00"
#: Light areas of both bodies, which differ in grey print.
FILLS = "#A6CBE3", "#FBE6D6"
PRESSURE, SHEAR = "#000000", "#CC79A7"
STATES = {"stick": "#009E73", "slip": "#E69F00", "open": "#999999"}
STATE_MARKERS = {"stick": "s", "slip": "o", "open": "x"}
#: Colour and marker of a run by its outcome.
OUTCOMES = {
    "converged": ("#0072B2", "o"),
    "limit": ("#B35900", "^"),
    "stalled": ("#D55E00", "s"),
    "diverged": ("#000000", "X"),
}

#: The axis of theta.
THETA = "relaxation factor theta"

#: Digits of an exponent.
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

PARAMETERS: Any = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "legend.frameon": False,
    "svg.hashsalt": "ndtheory",  # the same figure gives the same file
    "svg.fonttype": "none",
}


#: matplotlib has one set of parameters for all threads: one draws at a time.
_drawing = threading.RLock()


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of the given size in inches, free of any window system."""
    with styled():
        figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


@contextmanager
def styled() -> Iterator[None]:
    """A context in which axes and artists take the house's parameters, whatever the user's configuration says."""
    with _drawing, mpl.rc_context(), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a character that no installed font has
        mpl.rcdefaults()
        mpl.rcParams.update(PARAMETERS)
        yield


def norm(inside: str) -> str:
    """The norm (5.21) of a force, as mathematics."""
    return rf"$|\!|\!|{inside}|\!|\!|$"


def ink(fill: str) -> str:
    """Dark or light grey for marks on a fill, whichever stands out more in grey print."""
    red, green, blue = to_rgb(fill)
    return "0.15" if 0.299 * red + 0.587 * green + 0.114 * blue > 0.5 else "0.9"


def legend_beside(ax: Axes) -> None:
    """The legend to the right of the axes, where it covers nothing."""
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def mark_states(ax: Axes, status: Sequence[str], x: Floats, y: Floats) -> None:
    """The state of each contact node as a marker on a curve."""
    for name, marker in STATE_MARKERS.items():
        here = np.array(status) == name
        if here.any():
            look: Any = {"color": STATES[name], "markeredgecolor": "0.15", "markeredgewidth": 0.6, "markersize": 4}
            ax.plot(x[here], y[here], marker, label=name, **look)


def mark_unfinished(ax: Axes, outcome: str, shown: str = "") -> None:
    """A mark across the axes: the run did not converge, and what is shown is not a solution."""
    box = {"facecolor": "white", "edgecolor": "#A00000", "linewidth": 1.5}
    look: Any = {
        "color": "#A00000",
        "ha": "center",
        "xycoords": "axes fraction",
        "textcoords": "offset points",
        "bbox": box,
    }
    ax.annotate(f"not converged ({outcome})", (0.5, 0.5), (0, 0), weight="bold", size=12, **look)
    if shown:
        ax.annotate(shown, (0.5, 0.5), (0, -20), **look)


def plain(text: str) -> str:
    """A text from outside, literally: no mathematics between dollar signs, no control characters."""
    return printable(text).replace("$", r"\$")


class Powers(LogFormatterSciNotation):
    """Powers of ten in the characters of the font: a fifth of writing a figure is setting them as mathematics."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        text = super().__call__(x, pos).removeprefix(r"$\mathdefault{").removesuffix("}$")
        text = text.replace(r"\times", "\N{MULTIPLICATION SIGN}")
        return re.sub(r"\^{(.*)}", lambda power: power[1].translate(RAISED), text)


def save(figure: Figure, path: Path) -> None:
    """Write a figure; the ending of the path chooses SVG or PNG.

    The axes are laid out only for the first file: that takes longer than to draw them.
    """
    for text in figure.findobj(Text):
        lines = text.get_text().split("\n")
        if not all(map(clean, lines)):  # no XML, where it is an SVG
            text.set_text("\n".join(map(printable, lines)))
    for axis in (axis for ax in figure.axes for axis in (ax.xaxis, ax.yaxis)):
        if type(axis.get_major_formatter()) is LogFormatterSciNotation:  # not for a second file
            axis.set_major_formatter(Powers())
            axis.set_minor_formatter(Powers())
    metadata = {"Creator": "ndtheory", "Date": None} if path.suffix == ".svg" else {"Software": "ndtheory"}
    with styled():
        figure.savefig(path, dpi=160, metadata=metadata)
        figure.set_layout_engine(None)
