"""A widget made of scenes: a question, sliders with few positions, and what the library computed for each position."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from typing import Any

from matplotlib.figure import Figure

from verification.figures import style

#: The colours of ``verification/data/drawing.js``.
COLOURS = {"blue": "#0072b2", "red": "#d55e00", "green": "#009e73", "orange": "#e69f00", "grey": "#777777"}

#: The size of words in the still picture, in points: as large beside the axes as in the page.
WORDS = 7


def axis(name: str, low: float, high: float, *, log: bool = False, bare: bool = False) -> dict[str, Any]:
    """An axis of a chart; with ``log`` a logarithmic one, ``bare`` without numbers."""
    return {"name": name, "low": low, "high": high, "log": log, **({"bare": True} if bare else {})}


def line(points: Iterable[Sequence[float]], colour: str = "blue", *, dashed: bool = False) -> dict[str, Any]:
    """A curve through points (x, y)."""
    return {"kind": "line", "points": _rounded(points), "colour": colour, "dashed": dashed}


def dots(points: Iterable[Sequence[float]], colour: str = "blue", *, hollow: bool = False) -> dict[str, Any]:
    """A dot at each point (x, y)."""
    return {"kind": "dots", "points": _rounded(points), "colour": colour, "hollow": hollow}


def crosses(points: Iterable[Sequence[float]], colour: str = "red") -> dict[str, Any]:
    """A cross at each point (x, y)."""
    return {"kind": "crosses", "points": _rounded(points), "colour": colour}


def note(x: float, y: float, text: str, colour: str = "", *, anchor: str = "start") -> dict[str, Any]:
    """Words beside (x, y), which is their ``start``, ``middle`` or ``end``."""
    return {"kind": "note", "points": _rounded([(x, y)]), "text": text, "colour": colour, "anchor": anchor}


def chart(
    label: str, x: Mapping[str, Any], y: Mapping[str, Any], fixed: Iterable[Any] = (), before: Iterable[Any] = ()
) -> dict[str, Any]:
    """A chart; ``fixed`` are the marks that belong to every scene, ``before`` those of the question only."""
    return {"label": label, "x": x, "y": y, "fixed": list(fixed), "before": list(before)}


def slider(name: str, label: str, values: Iterable[Any], start: int) -> dict[str, Any]:
    """A slider with a position for each value, as text; the answer moves it to the position ``start``."""
    return {"name": name, "label": label, "values": [str(value) for value in values], "start": start}


def scene(says: str, *marks: Iterable[Any], rows: Iterable[Sequence[Any]] = ()) -> dict[str, Any]:
    """What one position of the sliders shows: a sentence, the marks of each chart, the rows of the table."""
    return {"says": says, "marks": [list(each) for each in marks], "rows": [list(row) for row in rows]}


def widget(
    *,
    question: str,
    answers: Sequence[str],
    right: str,
    wrong: Mapping[str, str],
    why: str,
    sliders: Sequence[Mapping[str, Any]],
    charts: Sequence[Mapping[str, Any]],
    head: Sequence[str],
    scenes: Mapping[tuple[int, ...], Mapping[str, Any]],
) -> dict[str, Any]:
    """The data of a widget, for ``docs/widgets/scenes.js``.

    Parameters
    ----------
    question, right, why : str
        What is asked, the answer, and what is said after it.
    wrong : mapping
        What is said first of each other choice: a sentence.
    answers : sequence of str
        The choices, the right one among them.
    sliders, charts : sequence of mapping
        By :func:`slider` and :func:`chart`.
    head : sequence of str
        The heads of the columns of the table.
    scenes : mapping
        By :func:`scene`: one for each combination of positions, in the order of the sliders.
    """
    positions = set(product(*(range(len(each["values"])) for each in sliders)))
    if {right, *wrong} != set(answers) or set(scenes) != positions:
        raise ValueError(f"{question}: needed {answers} right or wrong, and a scene for each of {positions}")
    return {
        "question": question,
        "answers": list(answers),
        "right": right,
        "wrong": dict(wrong),
        "why": why,
        "sliders": list(sliders),
        "charts": list(charts),
        "head": list(head),
        "scenes": {",".join(map(str, at)): one for at, one in scenes.items()},
    }


def still(data: Mapping[str, Any]) -> Figure:
    """The scene of the answer as a figure."""
    at = ",".join(str(each["start"]) for each in data["sliders"])
    figure = style.new_figure(3.6 * len(data["charts"]), 3.2)
    with style.styled():
        axes = figure.subplots(1, len(data["charts"]), squeeze=False)[0]
        for ax, chart, marks in zip(axes, data["charts"], data["scenes"][at]["marks"], strict=True):
            x, y = chart["x"], chart["y"]
            ax.set(xlabel=x["name"], ylabel=y["name"], title=chart["label"])
            ax.set(xscale="log" if x["log"] else "linear", yscale="log" if y["log"] else "linear")
            ax.set(xlim=(x["low"], x["high"]), ylim=(y["low"], y["high"]))
            if y.get("bare"):
                ax.set_yticks([])
            for mark in [*chart["fixed"], *marks]:
                _draw(ax, mark)
    return figure


def _draw(ax: Any, mark: Mapping[str, Any]) -> None:
    xs, ys = zip(*mark["points"], strict=True) if mark["points"] else ((), ())
    colour = COLOURS.get(mark["colour"], "black")
    if mark["kind"] == "line":
        ax.plot(xs, ys, "--" if mark["dashed"] else "-", color=colour)
    elif mark["kind"] == "dots":
        ax.plot(xs, ys, "o", color=colour, markersize=4, mfc="none" if mark["hollow"] else colour)
    elif mark["kind"] == "crosses":
        ax.plot(xs, ys, "x", color=colour, markersize=4)
    else:
        sides = {"start": "left", "middle": "center", "end": "right"}
        ax.text(xs[0], ys[0], mark["text"], ha=sides[mark["anchor"]], clip_on=True, fontsize=WORDS)


def _rounded(points: Iterable[Sequence[float]]) -> list[list[float]]:
    """Six digits, as a pixel needs four; whole numbers without a point, as each character is loaded."""
    short = lambda value: int(value) if value == int(value) else value
    return [[short(float(f"{value:.6g}")) for value in point] for point in points]
