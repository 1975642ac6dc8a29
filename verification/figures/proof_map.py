"""A map of the proof as an SVG: statements by verdict, each below those that it leans on, and losses of its steps."""

from __future__ import annotations

import textwrap
from collections.abc import Collection, Mapping, Sequence
from xml.sax.saxutils import escape

from ndtheory.statements import Statement, proof_of, recorded, statements
from verification.bounds.losses import Loss, Losses
from verification.figures.layers import Point, layered

#: Steps that lose something: the edge, the chain of :class:`Losses`, and the inequalities whose decades it adds up.
STEPS: dict[tuple[str, str], tuple[str, tuple[str, ...]]] = {
    ("5.13", "5.30"): ("friction", ("(5.13)",)),
    ("5.11", "5.30"): ("friction", ("(5.11)",)),
    ("5.19", "5.30"): ("friction", ("(5.19)",)),
    ("5.23", "5.30"): ("friction", ("(5.23)",)),
    ("5.30", "5.31"): ("friction", ("(5.13)", "(5.11)", "(5.19)", "(5.23)")),
    ("5.29", "5.31"): ("links", ("(5.29)",)),
    ("5.18", "5.16"): ("lipschitz", ("(5.18)",)),
    ("5.11", "5.16"): ("lipschitz", ("(5.11)",)),
    ("5.19", "5.16"): ("lipschitz", ("(5.19)",)),
    ("5.16", "prop-5.4"): ("lipschitz", ("(5.18)", "(5.11)", "(5.19)")),
    ("prop-5.4", "5.38"): ("lipschitz", ("(5.18)", "(5.11)", "(5.19)")),
    ("5.22", "5.38"): ("lipschitz", ("(5.22)",)),
    ("5.23", "5.38"): ("lipschitz", ("(5.23)",)),
    ("5.38", "5.39"): ("lipschitz", ("(5.22)", "(5.18)", "(5.11)", "(5.19)", "(5.23)")),
}

#: The step by which the printed edition goes on with its own (5.30), which depends on the unit of stress.
PRINTED = ("5.30", "5.31")

#: The statements of the steps, and those through which they reach the first claim of Proposition 5.6 and the theorem.
CHAIN = (
    *dict.fromkeys(id for step in STEPS for id in step),
    *("5.32", "5.33", "5.36", "5.40", "prop-5.6.1", "thm-5.9.1", "thm-5.9"),
)

#: Fill, outline and shape by verdict; the shapes differ too.
LOOKS = {
    "PROVED": ("#d5efe3", "#00704f", "rectangle"),
    "REPAIRED": ("#fdeac2", "#8a5a00", "hexagon"),
    "REFUTED": ("#f9d3c3", "#a03c00", "crossed"),
    "NUMERICAL": ("#d6e8f7", "#00568a", "slanted"),
    "ASSUMED": ("#ececec", "#4d4d4d", "rounded"),
    "INCONCLUSIVE": ("#ffffff", "#4d4d4d", "broken"),
}

#: Sizes in pixels: a box, the space between boxes, the margin of a map and its least width.
BOX, GAP, MARGIN, NARROWEST = (136.0, 48.0), (8.0, 34.0), 10.0, 460.0

#: Width of an edge in pixels: without a loss, more for each decade, and at most.
WIDTH = {"thin": 1.2, "decade": 1.0, "most": 24.0}

#: Letters of a line in a box; pixels of a letter of the legend, and of one of its columns.
LINE, LETTER, COLUMN = 19, 6.1, 230

STYLE = """
.map{color:#111}
.map text.short{font:12px sans-serif;fill:#111;text-anchor:middle}
.map text.number{font:10px sans-serif;fill:#333;text-anchor:middle}
.map text.legend{font:11px sans-serif;fill:currentColor}
.map .edge{fill:none;stroke:#7d7d7d}
.map .edge.loss{stroke:#0072b2}
.map .edge.searched{stroke-dasharray:9 2}
.map .edge.printed{stroke:#e58a4e}
.map .asked path{stroke-width:3}
"""


def draw_map(
    ids: Collection[str] = (),
    *,
    losses: Losses | None = None,
    of: str = "",
    verdicts: Mapping[str, str] | None = None,
    grounds: bool = True,
) -> str:
    """Draw statements and all that they lean on, directly or not; an edge that follows from others is left out.

    Parameters
    ----------
    ids : collection of str
        All statements by default.
    losses : Losses, optional
        Widths of edges.
    of : str
        The problem that has these losses.
    verdicts : mapping, optional
        Verdicts over the recorded ones.
    grounds : bool
        False to leave out what is not in ``ids``.
    """
    shown = {id: one for id, one in proof_of(ids or statements()).items() if grounds or id in ids}
    found = {id: (verdicts or {}).get(id) or recorded().get(id, "INCONCLUSIVE") for id in shown}
    wide = {begin for begin, _ in STEPS} if losses else set[str]()
    drawn = layered(
        _edges(shown),
        most=4 if len(shown) < 100 else 6,
        box=BOX,
        gap=GAP,
        lane=lambda id: WIDTH["most"] / 2 if id in wide else 2.0,
    )
    width = max(drawn.size[0], NARROWEST) + 2 * MARGIN
    legend, below = _legend(list(dict.fromkeys(found.values())), width - 2 * MARGIN, losses, of)
    height = drawn.size[1] + below + 3 * MARGIN
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" class="map" width="{width:.0f}" height="{height:.0f}"'
        f' viewBox="0 0 {width:.0f} {height:.0f}" role="group" aria-label="Map of the proof">',
        '<metadata xmlns:dc="http://purl.org/dc/elements/1.1/"><dc:title>ndtheory</dc:title></metadata>',
        f'<style>{STYLE}</style><rect class="paper" width="100%" height="100%" fill="#fff"/>',
        f'<g transform="translate({(width - drawn.size[0]) / 2:.1f},{MARGIN:g})">',
        *(_edge(edge, drawn.edges[edge], losses) for edge in sorted(drawn.edges, key=STEPS.__contains__)),
        *(_node(shown[id], found[id], centre, grounds and id in ids) for id, centre in drawn.centres.items()),
        f'</g><g transform="translate({MARGIN:g},{drawn.size[1] + 2 * MARGIN:.0f})">',
        *legend,
        "</g></svg>",
    ]
    return "\n".join(parts) + "\n"


def _edges(shown: Mapping[str, Statement]) -> dict[str, list[str]]:
    """The statements from which an edge leads to each: those that it leans on, and no other of these does."""
    direct = {id: [ground for ground in one.leans_on if ground in shown] for id, one in shown.items()}
    behind: dict[str, set[str]] = {}  # of each all that it leans on, directly or not

    def reach(id: str) -> set[str]:
        if id not in behind:
            behind[id] = {other for ground in direct[id] for other in (ground, *reach(ground))}
        return behind[id]

    return {
        id: [one for one in grounds if (one, id) in STEPS or not any(one in reach(other) for other in grounds)]
        for id, grounds in direct.items()
    }


def width_of(decades: float) -> float:
    """Width of an edge in pixels."""
    return min(WIDTH["thin"] + WIDTH["decade"] * max(decades, 0.0), WIDTH["most"])


def losses_of(edge: tuple[str, str], losses: Losses | None) -> list[Loss]:
    """The losses that an edge adds up; none where it loses nothing."""
    chain, labels = STEPS.get(edge, ("links", ()))
    return [] if losses is None else [loss for loss in getattr(losses, chain) if loss.label in labels]


def _edge(edge: tuple[str, str], points: Sequence[Point], losses: Losses | None) -> str:
    path = f"M{points[0][0]:.1f},{points[0][1]:.1f}"
    for (x, y), (to, end) in zip(points[::2], points[1::2], strict=True):
        path += f"L{x:.1f},{y:.1f}C{x:.1f},{(y + end) / 2:.1f} {to:.1f},{(y + end) / 2:.1f} {to:.1f},{end:.1f}"
    lost = losses_of(edge, losses)
    decades = sum(loss.decades for loss in lost)
    draw = lambda kind, size: (
        f'<path class="edge{kind}" data-edge="{edge[0]} {edge[1]}" stroke-width="{size:.1f}" d="{path}"/>'
    )
    if not lost:
        return draw("", WIDTH["thin"])
    drawn = draw(" loss searched" if any(loss.searched for loss in lost) else " loss", width_of(decades))
    unit = sum(loss.decades for loss in losses.friction if loss.only_unit) if losses and edge == PRINTED else 0.0
    return draw(" printed", width_of(decades + unit)) + drawn if edge == PRINTED else drawn


def _shape(look: tuple[str, str, str], x: float, y: float, width: float, height: float) -> str:
    """The outline of a box around a point."""
    fill, line, kind = look
    a, b, c = x - width / 2, y - height / 2, height / 5
    point = lambda *values: " ".join(f"{round(value, 1):g}" for value in values)
    paths = {
        "hexagon": f"M{point(a + c, b)}h{point(width - 2 * c)}l{point(c, height / 2, -c, height / 2)}"
        f"h{point(2 * c - width)}l{point(-c, -height / 2)}z",
        "rounded": f"M{point(a + 2 * c, b)}h{point(width - 4 * c)}a{point(2 * c, 2.5 * c, 0, 0, 1, 0, height)}"
        f"h{point(4 * c - width)}a{point(2 * c, 2.5 * c, 0, 0, 1, 0, -height)}z",
        "slanted": f"M{point(a + c, b)}h{point(width - c)}l{point(-c, height)}h{point(c - width)}z",
    }
    path = paths.get(kind, f"M{point(a, b)}h{point(width)}v{point(height)}h{point(-width)}z")
    if kind == "crossed":
        path += f"l{point(c, c)}m{point(0, -c)}l{point(-c, c)}"
    dash = ' stroke-dasharray="4 3"' if kind == "broken" else ""
    return f'<path fill="{fill}" stroke="{line}"{dash} d="{path}"/>'


def number(statement: Statement) -> str:
    """The number of a statement: the paper's label, or its id where that is long, has a formula, or there is none."""
    short = statement.kind != "own" and "$" not in statement.label and len(statement.label) <= 18
    return statement.label if short else statement.id


def _node(statement: Statement, verdict: str, centre: Point, asked: bool) -> str:
    x, y = centre
    lines = textwrap.wrap(statement.short or statement.title, LINE, break_long_words=False)
    name = number(statement)
    squeezed = f' textLength="{BOX[0] - 14:g}" lengthAdjust="spacingAndGlyphs"' if len(name) > 22 else ""
    top = y - 7.0 * (len(lines) - 1)
    return (
        f'<g class="node{" asked" * asked}" data-id="{statement.id}"><title>{escape(f"{name}: {verdict}")}</title>'
        + _shape(LOOKS[verdict], x, y, *BOX)
        + f'<text class="number" x="{x:.1f}" y="{top - 5:.1f}"{squeezed}>{escape(name)}</text>'
        + "".join(
            f'<text class="short" x="{x:.1f}" y="{top + 9 + 13 * i:.1f}">{escape(line)}</text>'
            for i, line in enumerate(lines)
        )
        + "</g>"
    )


def _legend(verdicts: Sequence[str], width: float, losses: Losses | None, of: str) -> tuple[list[str], float]:
    """The lines of the legend below a map, and their height."""
    sample = lambda kind, size: f'<path class="edge{kind}" stroke-width="{size:.1f}" d="M0,0h34"/>'
    entries = [(word.lower(), _shape(LOOKS[word], 17, 0, 34, 16)) for word in verdicts]
    entries.append(("is used in the proof", sample("", WIDTH["thin"])))
    texts = [
        "Edges go down, from a statement to one whose proof leans on it; an edge that follows from others is left out."
    ]
    if losses is not None:
        entries += [
            ("the step loses one power of ten", sample(" loss", width_of(1))),
            ("five, from a pair found by search", sample(" loss searched", width_of(5))),
            ("more as printed, by the unit", sample(" printed", width_of(10))),
        ]
        said = lambda chain: ", ".join(f"{loss.label} {loss.decades:.1f}" for loss in chain)
        texts += [
            f"Powers of ten lost, {of}. The friction term to its bound (5.30): {said(losses.friction)}.",
            f"The change of T to the root of its bound (5.38): {said(losses.lipschitz)}."
            " Found by search, a loss may be less.",
        ]
    columns = max(1, int(width // COLUMN))
    parts = []
    for i, (words, drawn) in enumerate(entries):
        place = f"translate({i % columns * COLUMN},{i // columns * 28 + 14})"
        parts.append(f'<g transform="{place}">{drawn}<text class="legend" x="42" y="4">{escape(words)}</text></g>')
    y = (len(entries) + columns - 1) // columns * 28 + 10
    for i, text in enumerate(texts):
        for line in textwrap.wrap(text, int(width / LETTER)):
            y += 16
            parts.append(f'<text class="legend{" lost" * (i > 0)}" x="0" y="{y}">{escape(line)}</text>')
    return parts, y + 6.0
