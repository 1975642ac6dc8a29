"""A layered drawing of a graph without circles: boxes in rows, and edges that only go down.

Rows are filled from the last one upwards (T. C. Hu, 1961), each with what has the longest chain above it.  An edge that
passes a row has a lane there, which it shares with the other edges from the same box.  Sweeps put each row in the order
of the means of its neighbours (Sugiyama, Tagawa and Toda, 1981), and then place it by isotonic regression.
"""

from __future__ import annotations

from bisect import bisect_right, insort
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from graphlib import TopologicalSorter
from itertools import accumulate, pairwise, product
from statistics import fmean

Point = tuple[float, float]

#: A box, if its row is given, or the lane of the edges from that box in a row further down.
Item = tuple[str, int]

Links = Mapping[Item, Sequence[Item]]

#: Number of sweeps over all rows for their order, and for the places in them.
SWEEPS, PLACING = 30, 80


@dataclass(frozen=True, kw_only=True)
class Layers:
    """Places of boxes and edges; x grows to the right and y downwards.

    Attributes
    ----------
    centres : mapping from box to point
        Row by row, each from the left.
    edges : mapping from pair of boxes to points
        Points of an even number: between rows the edge goes from each point with an even index, 0 at the first, to the
        next one; from there it goes straight down through a row.
    size : pair of floats
    """

    centres: Mapping[str, Point]
    edges: Mapping[tuple[str, str], tuple[Point, ...]]
    size: Point


def layered(
    above: Mapping[str, Sequence[str]], *, most: int, box: Point, gap: Point, lane: Callable[[str], float]
) -> Layers:
    """Draw a graph.

    Parameters
    ----------
    above : mapping from box to boxes
        The boxes from which edges lead to it.
    most : int
        Largest number of boxes in a row.
    box, gap : pair of floats
        Width and height of a box, and of the space between two.
    lane : callable
        Width of a lane of the edges from a box.

    Raises
    ------
    graphlib.CycleError
        The edges make a circle.

    Examples
    --------
    >>> drawn = layered({"a": [], "b": ["a"]}, most=3, box=(20.0, 10.0), gap=(4.0, 6.0), lane=len)
    >>> drawn.edges
    {('a', 'b'): ((12.0, 10.0), (12.0, 16.0))}
    """
    row = {id: i for i, ids in enumerate(_rows(above, most)) for id in ids}
    items, down = _with_lanes(row, above)
    up: dict[Item, list[Item]] = {item: [] for items_ in items for item in items_}
    for item, later in down.items():
        for other in later:
            up[other].append(item)
    items = _ordered(items, down, up)
    is_lane = lambda item: item[1] != row[item[0]]
    size = lambda item: gap[0] + (lane(item[0]) if is_lane(item) else box[0])
    width = max(sum(map(size, one)) for one in items)
    x = _placed(items, down, up, is_lane, size, width)
    top = lambda k: k * (box[1] + gap[1])
    edges: dict[tuple[str, str], tuple[Point, ...]] = {}
    for end, heads in above.items():
        ordered = sorted(heads, key=lambda id: (x[id, row[end] - 1], id))
        for i, begin in enumerate(ordered):
            lanes = [(x[begin, k], y) for k in range(row[begin] + 1, row[end]) for y in (top(k), top(k) + box[1])]
            port = 0.7 * box[0] * ((i + 0.5) / len(heads) - 0.5)
            first, last = (x[begin, row[begin]], top(row[begin]) + box[1]), (x[end, row[end]] + port, top(row[end]))
            edges[begin, end] = (first, *lanes, last)
    centres = {id: (x[id, k], top(k) + box[1] / 2) for one in items for id, k in one if k == row[id]}
    return Layers(centres=centres, edges=edges, size=(width, top(len(items)) - gap[1]))


def _rows(above: Mapping[str, Sequence[str]], most: int) -> list[list[str]]:
    """Boxes by rows, each below all from which edges lead to it."""
    below: dict[str, set[str]] = {id: set() for id in above}
    for id, heads in above.items():
        for head in heads:
            below[head].add(id)
    depth: dict[str, int] = {}  # the longest chain above each
    for id in TopologicalSorter(above).static_order():
        depth[id] = max((depth[head] + 1 for head in above[id]), default=0)
    rows: list[list[str]] = []
    placed: set[str] = set()
    while len(placed) < len(above):
        ready = [id for id in above if id not in placed and below[id] <= placed]
        rows.append(sorted(ready, key=lambda id: -depth[id])[:most])
        placed.update(rows[-1])
    return rows[::-1]


def _with_lanes(
    row: Mapping[str, int], above: Mapping[str, Sequence[str]]
) -> tuple[list[list[Item]], dict[Item, list[Item]]]:
    """The items of each row, and to each the items of the next row below it."""
    items: list[list[Item]] = [[] for _ in range(max(row.values()) + 1)]
    down: dict[Item, list[Item]] = {}
    for begin, first in row.items():
        ends = [(id, row[id]) for id, heads in above.items() if begin in heads]
        for k in range(first, max((k for _, k in ends), default=first + 1)):
            items[k].append((begin, k))
            down[begin, k] = [end for end in ends if end[1] == k + 1]
            if any(end[1] > k + 1 for end in ends):
                down[begin, k].append((begin, k + 1))
    return items, down


def _crossings(upper: Sequence[Item], lower: Sequence[Item], down: Links) -> int:
    """The number of pairs of edges that cross between two rows."""
    place = {item: i for i, item in enumerate(lower)}
    total, seen = 0, list[int]()
    for item in upper:
        ends = [place[end] for end in down[item]]
        total += sum(len(seen) - bisect_right(seen, end) for end in ends)
        for end in ends:
            insort(seen, end)
    return total


def _ordered(rows: list[list[Item]], down: Links, up: Links) -> list[list[Item]]:
    """Each row in an order with few crossings."""
    count = lambda rows: sum(_crossings(*two, down) for two in pairwise(rows))
    best, fewest = rows, count(rows)
    rows = [list(row) for row in rows]
    for sweep in range(SWEEPS):
        step, ties = (1, up) if sweep % 2 == 0 else (-1, down)
        for fixed, row in pairwise(rows[::step]):
            near = {item: (i + 0.5) / len(fixed) for i, item in enumerate(fixed)}
            own = {item: (i + 0.5) / len(row) for i, item in enumerate(row)}
            means = {item: fmean([near[other] for other in ties[item]] or [own[item]]) for item in row}
            row.sort(key=means.__getitem__)
        _exchange(rows, down, up)
        if (found := count(rows)) < fewest:
            best, fewest = [list(row) for row in rows], found
    return best


def _exchange(rows: list[list[Item]], down: Links, up: Links) -> None:
    """Exchange neighbours in a row wherever fewer of their edges cross then."""
    for above, row, below in zip([[], *rows], rows, [*rows[1:], []], strict=False):
        place = {item: i for beside in (above, below) for i, item in enumerate(beside)}
        ends = {item: [[place[end] for end in links[item]] for links in (up, down)] for item in row}
        pairs = lambda a, b, ends=ends: (ij for two in zip(ends[a], ends[b], strict=True) for ij in product(*two))
        crossed = lambda a, b, pairs=pairs: sum(i > j for i, j in pairs(a, b))
        for i in range(len(row) - 1):
            a, b = row[i : i + 2]
            if crossed(b, a) < crossed(a, b):
                row[i : i + 2] = b, a


def _placed(
    rows: Sequence[Sequence[Item]],
    down: Links,
    up: Links,
    lane: Callable[[Item], bool],
    size: Callable[[Item], float],
    width: float,
) -> dict[Item, float]:
    """The x of each item: in the order of its row, near the mean of its neighbours."""
    x: dict[Item, float] = {}
    for row in rows:
        x |= zip(row, spread([width / 2] * len(row), list(map(size, row)), width), strict=True)
    for sweep in range(PLACING):
        first, second = (up, down) if sweep % 2 == 0 else (down, up)
        for row in rows if sweep % 2 == 0 else rows[::-1]:
            wanted = []
            for item in row:  # a lane goes straight down to where it ends
                near = [*first[item], *(second[item] if sweep > PLACING / 4 or not first[item] else ())] or [item]
                if lane(item):
                    near = [other for other in down[item] if lane(other)] or list(down[item])
                wanted.append(fmean([x[other] for other in near]))
            x |= zip(row, spread(wanted, list(map(size, row)), width), strict=True)
    return x


def spread(wanted: Sequence[float], sizes: Sequence[float], width: float) -> list[float]:
    """Centres without overlap, between 0 and the width, whose squared distances to the wanted ones are least.

    Without the sizes before them the centres may not decrease: neighbours that would are given their mean.
    """
    before = list(accumulate(((a + b) / 2 for a, b in pairwise(sizes)), initial=0.0))
    blocks: list[tuple[float, int]] = []
    for value, shift in zip(wanted, before, strict=True):
        block = (value - shift, 1)
        while blocks and blocks[-1][0] >= block[0]:
            (a, m), (b, n) = blocks.pop(), block
            block = ((a * m + b * n) / (m + n), m + n)
        blocks.append(block)
    low, high = sizes[0] / 2, width - sizes[-1] / 2 - before[-1]
    levels = [min(max(mean, low), high) for mean, count in blocks for _ in range(count)]
    return [level + shift for level, shift in zip(levels, before, strict=True)]
