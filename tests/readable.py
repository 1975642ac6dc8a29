"""Measures of a figure for readers who see no colours: luminance, contrast, and styles that tell curves apart."""

from collections.abc import Iterator
from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.backend_bases import RendererBase
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text

#: Least contrast of text and of lines with what is behind them, by the guidelines for accessible pages (WCAG 2.2).
TEXT, LINES = 4.5, 3.0

#: Least difference in grey print of two curves with the same dashes and markers.
APART = 0.15


def grey(colour: Any) -> float:
    """Lightness in grey print, 0 to 1."""
    return float(np.dot(to_rgb(colour), (0.299, 0.587, 0.114)))


def contrast(one: Any, other: Any) -> float:
    """Ratio of relative luminances, 1 to 21, as the guidelines define it."""

    def luminance(colour):
        channels = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(colour)]
        return float(np.dot(channels, (0.2126, 0.7152, 0.0722)))

    high, low = sorted((luminance(one), luminance(other)), reverse=True)
    return (high + 0.05) / (low + 0.05)


class Dashes(RendererBase):
    """A renderer that keeps the dashes of the first path that it is given."""

    found: Any = None

    def draw_path(self, gc, path, transform, rgbFace=None):
        self.found = self.found or str(gc.get_dashes())


def style(line: Line2D) -> tuple[str, str, bool]:
    """What is left of a curve without its colour: dashes over its width, marker, whether that is hollow."""
    dashes = ""
    if line.get_linestyle() not in ("None", "none", "", " "):
        alike = Line2D([0, 1], [0, 1], linestyle=line.get_linestyle(), linewidth=1.0)
        alike.draw(pen := Dashes())
        dashes = pen.found
    hollow = np.array_equal(to_rgb(line.get_markerfacecolor()), (1.0, 1.0, 1.0))
    return dashes, str(line.get_marker()), hollow


def faults(figure: Figure) -> Iterator[str]:
    """Texts and curves that are too light, and pairs of curves in one panel that only their colours tell apart."""
    figure.draw_without_rendering()
    for text in figure.findobj(Text):
        box = text.get_bbox_patch()
        behind = "white" if box is None else box.get_facecolor()[:3]
        if text.get_text() and contrast(text.get_color(), behind) < TEXT:
            yield f"text {text.get_text()!r}"
    for ax in figure.axes:
        lines = [line for line in ax.lines if not str(line.get_label()).startswith("_")]
        for line in lines:
            inked = line.get_color() if style(line)[0] else line.get_markeredgecolor()
            if contrast(inked, "white") < LINES:
                yield f"line {line.get_label()!r}"
        for one, other in combinations(lines, 2):
            if style(one) == style(other) and abs(grey(one.get_color()) - grey(other.get_color())) < APART:
                yield f"{one.get_label()!r} and {other.get_label()!r}"
