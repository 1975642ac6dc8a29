"""The deformed bodies, in colours or with their stresses, above what happens along Gamma_c."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from fem1d2d import depths, stresses, von_mises
from fem1d2d.mesh import Floats
from verification.algorithm.monolithic import Solution
from verification.algorithm.runs import Run
from verification.figures import style
from verification.figures.style import BODIES, FILLS, PRESSURE, SHEAR, legend_beside, mark_states, plain
from verification.interface.assembly import TwoBodies
from verification.interface.fields import ContactFields
from verification.interface.joining import obstacle_edges
from verification.registry import draw as main_figure

#: Stresses that colour the cells: what the colour bar calls them, and their values from the tensors.
STRESSES = {"mises": ("von Mises stress", von_mises), "sigma_yy": (r"$\sigma_{yy}$", lambda tensors: tensors[:, 1, 1])}

#: Displacements are drawn so that the largest is about this fraction of the picture.
SHARE = 0.06

#: The deepest that one drawn body may reach into the other, relative to the width: a pixel or two.
DENT = 0.002

#: Inches: the widest that a panel becomes beside its legend, and the height of those along Gamma_c.
WIDE, HIGH = 5.1, 2.3

#: A picture of the bodies is at most this many times as high as wide: x reaches further on both sides of tall ones.
TALL = 0.8

BOTH = np.array([-1.0, 1.0])


def draw_bodies(result: Run | Solution, *, stress: str = "", motions: bool = False, zoom: bool = False) -> Figure:
    """Deformed meshes above, pressure, shear and states along Gamma_c below; of a run the last iterate is drawn.

    All panels have one x axis; along a named line those below have s, and arrows show the tractions on body 2.
    Displacements are enlarged as far as the drawn bodies do not overlap.

    Parameters
    ----------
    stress : {'', 'mises', 'sigma_yy'}
        Stress that colours the cells, if any; ValueError for another name.
    motions : bool
        Whether a further panel has gap and slip along Gamma_c.
    zoom : bool
        True to draw only the part where the bodies touch, or all of Gamma_c if they do not touch.
    """
    if stress not in ("", *STRESSES):
        raise ValueError(f"stress {stress!r}: needed one of {', '.join(STRESSES)}")
    bodies, contact = result.bodies, result.contact
    moved = [u for u in result.displacements if u is not None]
    scale = _scale(bodies, moved)
    drawn, plane = _placed(bodies, moved, scale), bodies.problem.dimension == 2
    x, y = _ends(bodies, drawn, scale, contact if zoom and plane else None)
    panels = (_draw_stresses, _draw_motions)[: 1 + motions] if plane else ()
    heights = [WIDE * float(np.ptp(y) / np.ptp(x)), *[HIGH for _ in panels]]
    named = plane and bodies.interface.contact.normals is not None
    with style.styled():
        figure = style.new_figure(7.2, 1.1 + sum(heights))
        axes = figure.subplots(len(heights), 1, height_ratios=heights, sharex=not named, squeeze=False)[:, 0]
        axes[0].set(xlim=x, ylim=y, title=f"{plain(bodies.problem.title)}: deformed, displacements x {scale:g}")
        cells = _draw_meshes(axes[0], bodies, drawn, scale)
        if stress:
            tensors = (stresses(body.mesh, body.material, u) for body, u in zip(bodies.elastic, moved, strict=True))
            _colour(axes[0], cells, stress, [STRESSES[stress][1](tensor) for tensor in tensors], bodies)
        else:
            legend_beside(axes[0])
        if isinstance(result, Run) and not result.converged:
            style.mark_unfinished(axes[0], result.outcome, result.unfinished)
        length = plain(bodies.problem.units["length"])
        if named:
            _draw_tractions(axes[0], contact, bodies, drawn)
            axes[0].set_xlabel(f"x [{length}]")
        for ax, draw in zip(axes[1:], panels, strict=True):
            seen = contact if contact.lines else contact.between(*x)
            draw(ax, seen.unrolled() if named else seen, bodies)
            legend_beside(ax)
        where = ("s along $\\Gamma_c$" if named else "x along $\\Gamma_c$") if plane else "x"
        where = "s along one contact after another" if contact.lines else where
        axes[-1].set_xlabel(f"{where} [{length}]")
    return figure


def _scale(bodies: TwoBodies, moved: Sequence[Floats]) -> float:
    """The largest round factor of displacements at which the drawn bodies do not overlap; 1 if they do at any above."""
    largest = max(float(np.abs(u).max()) for u in moved)
    size = max(float(np.ptp(body.mesh.points[:, 0])) for body in bodies.elastic)
    scale = _round_down(SHARE * size / largest) if largest > 0 else 1.0
    while scale > 1 and _overlap(bodies, _placed(bodies, moved, scale), scale) > DENT * size:
        scale = _round_down(0.6 * scale)
    return scale


def _round_down(value: float) -> float:
    """The largest of 1, 2, 5 times a power of ten below a value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(factor for factor in (1.0, 2.0, 5.0) if factor * power <= value * (1 + 1e-12)) * power)


def _placed(bodies: TwoBodies, moved: Sequence[Floats], scale: float) -> list[Floats]:
    """The drawn places of the nodes of each elastic body; a flat gap is scaled too, so that contact looks closed."""
    found = [body.mesh.points + scale * u for body, u in zip(bodies.elastic, moved, strict=True)]
    if len(found) == 2 and np.ptp(bodies.interface.gap) == 0 and bodies.interface.contact.normals is None:
        below, above = (float(body.mesh.points[body.nodes[0], -1]) for body in bodies.elastic)
        found[1][:, -1] += scale * float(bodies.interface.gap[0]) - (above - below)
    return found


def _obstacle(bodies: TwoBodies, scale: float) -> Floats:
    """The face of the obstacle as it is drawn, shape (n, 2): a flat gap is scaled, and what has no ends is endless."""
    (body,), gap = bodies.elastic, bodies.interface.gap
    spec = bodies.problem.body1 if bodies.body1 is None else bodies.problem.body2
    if spec.face:
        return np.array(spec.face)
    sign = -1.0 if bodies.body1 is None else 1.0
    height = float(body.mesh.points[body.nodes[0], 1] + sign * gap[0] * (scale if np.ptp(gap) == 0 else 1.0))
    x = body.mesh.points[:, 0]
    beyond = 2 * float(np.ptp(x))
    low, high = (x.min() - beyond, x.max() + beyond) if spec.x is None else (float(end) for end in spec.x)
    return np.array([[low, height], [high, height]])


def _overlap(bodies: TwoBodies, drawn: list[Floats], scale: float) -> float:
    """Greatest depth of one drawn body in the other, or in the obstacle."""
    if bodies.problem.dimension == 1:
        return 0.0
    if len(drawn) == 1:
        own = drawn[0][bodies.elastic[0].nodes]
        spec, upper = (bodies.problem.body1, True) if bodies.body1 is None else (bodies.problem.body2, False)
        if spec.face:
            size, grid = float(np.ptp(drawn[0], axis=0).max()), bodies.interface.contact
            return float(depths(own, *obstacle_edges(spec, size, grid, upper=upper)).max())
        beyond = own[:, 1] - _obstacle(bodies, scale)[0, 1]
        return float((-beyond if upper else beyond).max())
    edges = [points[body.mesh.boundary.T] for body, points in zip(bodies.elastic, drawn, strict=True)]
    return max(float(depths(own[0], *other).max()) for own, other in (edges, edges[::-1]))


def _ends(bodies: TwoBodies, drawn: list[Floats], scale: float, contact: ContactFields | None) -> tuple[Floats, Floats]:
    """The ends of both axes: around all bodies, or around what touches of a contact that is zoomed."""
    points = np.concatenate(drawn)
    x = np.array([points[:, 0].min(), points[:, 0].max()])
    if bodies.problem.dimension == 1:
        return x + 0.04 * np.ptp(x) * BOTH, 0.1 + 0.15 * np.ptp(x) * BOTH
    y = np.array([points[:, 1].min(), points[:, 1].max()])
    if len(drawn) == 1:  # what of the obstacle lies opposite the body, not further away than a fifth of its size
        face, near = _obstacle(bodies, scale), 0.2 * np.ptp(points, axis=0).max()
        opposite = face[((face > points.min(axis=0) - near) & (face < points.max(axis=0) + near)).any(axis=1)]
        seen = np.clip([*y, *opposite[:, 1]], y[0] - near, y[1] + near)
        y = np.array([seen.min(), seen.max()])
    if contact is None:
        x, y = x + 0.04 * np.ptp(x) * BOTH, y + 0.06 * np.ptp(y) * BOTH
    else:
        body, touching = min(bodies.problem.contact_body, len(drawn)) - 1, np.array(contact.status) != "open"
        line = drawn[body][bodies.elastic[body].nodes]
        part = line[touching] if touching.sum() > 1 else line
        centre, size = (part.min(axis=0) + part.max(axis=0)) / 2, np.ptp(part, axis=0)
        around = 3 * np.median(np.linalg.norm(np.diff(line, axis=0), axis=1))  # what touches may have a gap inside
        x = centre[0] + (size.max() / 2 + around) * BOTH
        y = centre[1] + max(0.2 * np.ptp(x), size[1] / 2 + around) * BOTH
    return x + max(0.0, np.ptp(y) / TALL - np.ptp(x)) / 2 * BOTH, y


def _draw_meshes(ax: Axes, bodies: TwoBodies, drawn: list[Floats], scale: float) -> list[PolyCollection]:
    """Draw the cells of each body, those of bars as boxes at two heights."""
    found, length = [], plain(bodies.problem.units["length"])
    for body, points in zip(bodies.elastic, drawn, strict=True):
        i = int(body.name[-1]) - 1
        cells = points[body.mesh.cells]
        if bodies.problem.dimension == 1:
            high = 0.02 * np.ptp(ax.get_xlim())
            box = 0.1 + 3 * high * (2 * i - 1) + high * np.array([-1, -1, 1, 1])
            cells = np.stack([cells[:, [0, 1, 1, 0], 0], np.tile(box, (len(cells), 1))], axis=-1)
        found.append(PolyCollection(list(cells), facecolor=FILLS[i], edgecolor=BODIES[i], linewidth=0.4))
        found[-1].set_label(bodies.problem.words(i + 1))
        ax.add_collection(found[-1])
    ax.set_aspect("equal")
    if bodies.problem.dimension == 1:
        ax.set_yticks([])
        return found
    ax.set_ylabel(f"y [{length}]")
    if len(drawn) == 1:
        ax.plot(*_obstacle(bodies, scale).T, color="0.3", linewidth=2, label="obstacle")
    return found


def _draw_tractions(ax: Axes, contact: ContactFields, bodies: TwoBodies, drawn: list[Floats]) -> None:
    """Arrows of the tractions on body 2 from the contact nodes, the longest a tenth of the picture."""
    body, traction = min(bodies.problem.contact_body, len(drawn)) - 1, contact.tractions
    largest, size = float(np.linalg.norm(traction, axis=1).max()), float(np.ptp(ax.get_xlim()))
    if largest:
        look: Any = {"angles": "xy", "scale_units": "xy", "width": 0.003, "color": PRESSURE, "zorder": 3}
        places = drawn[body][bodies.elastic[body].nodes]
        ax.quiver(*places.T, *traction.T, scale=largest / (0.1 * size), **look)


def _colour(ax: Axes, cells: list[PolyCollection], stress: str, values: list[Floats], bodies: TwoBodies) -> None:
    """Colour the cells by a stress, name the bodies in the middle of what is seen of them, and add the colour bar."""
    every = np.concatenate(values)
    low, high = (float(end(0.0, value)) for end, value in zip((min, max), np.percentile(every, (1, 99)), strict=True))
    above, below = (distance > 1e-6 * (high - low) for distance in (every.max() - high, low - every.min()))
    beyond = ("neither", "max", "min", "both")[int(above) + 2 * int(below)]
    corner, opposite = zip(ax.get_xlim(), ax.get_ylim(), strict=True)
    look: Any = {"ha": "center", "va": "center", "bbox": {"facecolor": "white", "linewidth": 0, "pad": 1.5}}
    for collection, colours, body in zip(cells, values, bodies.elastic, strict=True):
        collection.set(array=colours, clim=(low, high), cmap="viridis", edgecolor="0.5")
        corners = np.array([path.vertices for path in collection.get_paths()])
        for i in bodies.problem.numbers(int(body.name[-1])):
            own = corners[body.mesh.surfaces[f"body{i}"]] if bodies.interface.several else corners
            points = own.reshape(-1, 2)
            seen = points[((points > corner) & (points < opposite)).all(axis=1)]
            if len(seen):
                ax.text(float(seen[:, 0].mean()), float(seen[:, 1].mean()), f"body {i}", **look)
    words = f"{STRESSES[stress][0]}\n[{plain(bodies.problem.units['stress'])}]"
    ax.figure.colorbar(cells[0], ax.inset_axes((1.03, 0.0, 0.025, 1.0)), extend=beyond, label=words)


def _draw_stresses(ax: Axes, contact: ContactFields, bodies: TwoBodies) -> None:
    law = bodies.interface.law
    if law is not None and contact.bound.any():
        look: Any = {"facecolor": "0.9", "edgecolor": "0.4", "linestyle": ":"}
        ax.fill_between(contact.x, -contact.bound, contact.bound, label=f"friction bound\n({plain(law.words)})", **look)
    who = "the second" if bodies.interface.several else "body 2"
    curves = ("pressure $-\\sigma_N$", contact.pressure), (f"shear $\\sigma_T$ on {who}", contact.shear)
    _draw_along(ax, contact, curves, f"stress [{plain(bodies.problem.units['stress'])}]")


def _draw_motions(ax: Axes, contact: ContactFields, bodies: TwoBodies) -> None:
    curves = ("gap", contact.gap), ("slip $u^1_T - u^2_T$", contact.slip)
    _draw_along(ax, contact, curves, f"gap, slip [{plain(bodies.problem.units['length'])}]")


def _draw_along(ax: Axes, contact: ContactFields, curves: Sequence[tuple[str, Floats]], label: str) -> None:
    """A normal and a tangential quantity along Gamma_c, the states on the latter."""
    ax.axhline(0, color="0.8", linewidth=0.8)
    for (name, values), look, colour in zip(curves, ("-", "--"), (PRESSURE, SHEAR), strict=True):
        ax.plot(contact.x, values, look, color=colour, label=name)
    mark_states(ax, contact.status, contact.x, curves[1][1])
    ax.set_ylabel(label)


main_figure.register(Solution, draw_bodies)
