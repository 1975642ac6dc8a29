"""The ruler of steps: what bounds promise of one run, what is predicted of it, and what it took, on one axis."""

from __future__ import annotations

from matplotlib.figure import Figure

from verification.bounds.ruler import ruler
from verification.comparison import Comparison
from verification.figures.style import new_figure, plain, styled


def draw_ruler(found: Comparison) -> Figure:
    """A bar for each mark, from one step on; what bounds promise ends in an arrow to the left: it is at most that."""
    run = found.run
    marks, tolerance = ruler(found.computed, run), run.pair.settings.tolerance
    silent = [bound.name for bound in found.computed if bound.name not in {mark.name for mark in marks}]
    with styled():
        figure = new_figure(7.2, 1.3 + 0.3 * len(marks))
        ax = figure.subplots()
        for i, mark in enumerate(marks):
            steps = float(mark.steps)  # which may be no integer of numpy
            ax.plot([1, steps], [i, i], color=mark.colour, linewidth=1.2, alpha=0.5)
            ax.plot(steps, i, "<" if mark.promised else "o", color=mark.colour, markersize=6)
            count = f"{mark.steps}" if steps < 1e5 else f"{steps:.1e}"
            words = f"at most {count}" if mark.promised else count
            ax.annotate(words, (steps, i), (8, 0), textcoords="offset points", va="center")
        ax.set(xscale="log", xlim=(1, min(30.0 * max((mark.steps for mark in marks), default=1), 1e250)))
        ax.set_yticks(range(len(marks)), [mark.name for mark in marks])
        ax.set_ylim(len(marks) - 0.4, -0.6)
        none = f"; no promise by {', '.join(silent)}" if silent else ""
        ax.set_xlabel(f"steps to {tolerance:g}{none}")
        ax.set_title(f"{plain(run.pair.title)}: theta = {float(run.theta):g}, k = {float(run.pair.friction):g}")
    return figure
