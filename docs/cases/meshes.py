"""The mesh files of the gallery: ``python docs/cases/meshes.py`` writes them again.

They hold quadrilaterals, in Gmsh's text format 2.2.
"""

from pathlib import Path

import meshio
import numpy as np

HERE = Path(__file__).parent


def graded(fine, h, end, growth=1.3):
    """Positions from 0 to ``end``: cells of size h up to ``fine``, then each longer than the one before."""
    widths = h * growth ** np.arange(1, 200)
    beyond = np.cumsum(widths)[: int(np.searchsorted(np.cumsum(widths), end - fine)) + 1]
    return np.concatenate([np.linspace(0, fine, round(fine / h) + 1), fine + beyond * (end - fine) / beyond[-1]])


def mirrored(x):
    """The same positions on both sides of 0."""
    return np.concatenate([-x[:0:-1], x])


def between(x, t, low, high):
    """Corners between y = low(x) and y = high(x), at the parts t of the height."""
    y = np.outer(low(x), 1 - t) + np.outer(high(x), t)
    return np.stack([np.broadcast_to(x[:, None], y.shape), y], axis=-1)


def ring(radii, angles):
    """Corners of a sector of a ring."""
    return np.stack([np.outer(radii, np.cos(angles)), np.outer(radii, np.sin(angles))], axis=-1)


def write(path, corners, pad=0):
    """Write corners of shape (n, m, 2): sides ``left``, ``right`` (first and last row), ``bottom``, ``top``.

    So many of the lowest rows of cells are the surface ``rubber``, all others ``steel``.
    """
    n, m = corners.shape[:2]
    node = np.arange(n * m).reshape(n, m)
    quads = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], axis=-1).reshape(-1, 4)
    lines = [node[0], node[-1], node[:, 0], node[:, -1]]
    names = {side: np.array([i, 1]) for i, side in enumerate(("left", "right", "bottom", "top"), 1)}
    names |= {"steel": np.array([5, 2])} | ({"rubber": np.array([6, 2])} if pad else {})
    soft = np.tile(np.arange(m - 1) < pad, n - 1)
    tags = [np.concatenate([np.full(len(line) - 1, i) for i, line in enumerate(lines, 1)]), np.where(soft, 6, 5)]
    edges = np.concatenate([np.column_stack([line[:-1], line[1:]]) for line in lines])
    mesh = meshio.Mesh(
        np.pad(np.round(corners.reshape(-1, 2), 9) + 0.0, ((0, 0), (0, 1))),
        [("line", edges), ("quad", quads)],
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data=names,
    )
    meshio.write(path, mesh, file_format="gmsh22", binary=False, float_fmt=".9g")


def flat(y):
    return lambda x: np.full_like(x, y)


def arc(radius):
    """The lower side of a cylinder that touches y = 0."""
    return lambda x: radius - np.sqrt(radius**2 - x**2)


def bed(path, h):
    """A block under half a punch of width 2, with cells of size h beside the corner of the punch."""
    inner, beyond = 1 - graded(0.04, h, 1.0, 1.4)[::-1], 1 + graded(0.04, h, 19.0, 1.4)[1:]
    t = 1 - graded(0.04, h, 20.0, 1.4)[::-1] / 20
    write(path, between(np.concatenate([inner, beyond]), t, flat(-20.0), flat(0.0)))


def main(folder=HERE):
    """Write all of them."""
    save = lambda name, *corners, **more: write(folder / f"{name}.msh", *corners, **more)
    # Hertz: half the contact is 0.3 wide, the radius is 10.
    x, t = graded(0.4, 0.025, 5.0), graded(0.15, 0.025, 5.0) / 5
    save("roller", between(x, t, arc(10.0), flat(5.0)))
    x, t = graded(0.42, 0.03, 5.0), graded(0.15, 0.03, 5.0) / 5
    save("block", between(x, 1 - t[::-1], flat(-5.0), flat(0.0)))
    # Cattaneo and Mindlin: two equal cylinders, whole.
    x, t = mirrored(graded(0.39, 0.03, 5.0, 1.5)), graded(0.12, 0.03, 5.0, 1.5) / 5
    save("upper", between(x, t, arc(10.0), flat(5.0)))
    save("lower", between(x, 1 - t[::-1], flat(-5.0), lambda x: -arc(10.0)(x)))
    bed(folder / "bed.msh", 0.01)
    # A press fit: quarters of rings that overlap by 0.02.
    angles = np.linspace(0, np.pi / 2, 25)
    save("inner", ring(np.linspace(10, 20.01, 11), angles))
    save("outer", ring(np.linspace(19.99, 30, 9), angles))
    # A pin in a hole, right half: contact below, finer there.
    angles = -np.pi / 2 + np.linspace(0, np.pi, 49)
    save("pin", ring(1 - graded(0.1, 0.05, 0.95)[::-1], angles))
    angles = -np.pi / 2 + np.linspace(0, np.pi, 41)
    save("hole", ring(1.005 + graded(0.1, 0.05, 9.0), angles))
    # A column of two materials, and a slope of 1 to 5.
    save("column", between(np.linspace(0, 2, 5), np.linspace(0, 1, 9), flat(0.0), flat(4.0)), pad=4)
    slope = lambda x: 0.2 * x
    save("slope", between(np.linspace(-3, 3, 25), np.linspace(0, 1, 7), flat(-2.0), slope))
    save("sledge", between(np.linspace(-2, 2, 17), np.linspace(0, 1, 5), slope, lambda x: slope(x) + 1))


if __name__ == "__main__":
    main()
