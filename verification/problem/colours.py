"""More than two bodies: two colours that keep bodies apart which touch each other, and the roles of the colours."""

from __future__ import annotations

from collections.abc import Container, Sequence

#: The numbers of two bodies that touch each other.
Touching = Sequence[tuple[int, int]]


class OddRing(ValueError):
    """Bodies that touch each other in a ring of an odd number, as their numbers along the ring."""

    def __init__(self, ring: Sequence[int]) -> None:
        super().__init__(f"bodies {', '.join(map(str, ring))} touch each other in a ring of an odd number")
        self.ring = tuple(ring)


def colours(touching: Touching) -> list[tuple[set[int], set[int]]]:
    """Return two colours for each group of bodies that touch, directly or through others.

    The first colour of a group has its body of the least number.

    Raises
    ------
    OddRing

    Examples
    --------
    >>> colours([(1, 2), (2, 3), (4, 5)])
    [({1, 3}, {2}), ({4}, {5})]
    """
    neighbours: dict[int, list[int]] = {}
    for one, other in touching:
        neighbours.setdefault(one, []).append(other)
        neighbours.setdefault(other, []).append(one)
    found: list[tuple[set[int], set[int]]] = []
    way: dict[int, list[int]] = {}  # from the first body of its group
    for first in sorted(neighbours):
        if first in way:
            continue
        way[first], group = [first], [first]
        for body in group:
            for other in neighbours[body]:
                if other not in way:
                    way[other] = [*way[body], other]
                    group.append(other)
                elif len(way[other]) % 2 == len(way[body]) % 2:
                    start, end = way[body], way[other]  # which part where the ring begins
                    common = sum(a == b for a, b in zip(start, end, strict=False))
                    raise OddRing(start[common - 1 :] + end[common:][::-1])
        even = {body for body in group if len(way[body]) % 2 == 0}
        found.append((set(group) - even, even))
    return found


def neumann_bodies(touching: Touching, held: Container[int], supported: Container[int]) -> set[int]:
    """Return the bodies with the Neumann problem in step I, by default, of each group one colour.

    It is the colour without the body of the least number, unless only in the other one all bodies are ``held``, or at
    least ``supported`` somewhere.

    Examples
    --------
    >>> neumann_bodies([(1, 2), (2, 3)], {1, 2, 3}, ()), neumann_bodies([(1, 2), (2, 3)], {1, 3}, ())
    ({2}, {1, 3})
    """
    chosen: set[int] = set()
    for first, second in colours(touching):
        for good in (held, supported, first | second):
            fit = [colour for colour in (second, first) if all(body in good for body in colour)]
            if fit:
                chosen |= fit[0]
                break
    return chosen
