"""The deformed bodies with the contact stresses along Gamma_c."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from fem1d2d.mesh import Floats
from verification.algorithm.runs import Run
from verification.figures.style import BODY1, BODY2, PRESSURE, SHEAR, STATES, legend_beside, new_figure, plain, styled
from verification.interface.assembly import TwoBodies
from verification.interface.fields import ContactFields
from verification.monolithic import Solution

#: Displacements are drawn so that the largest is about this fraction of the picture.
SHARE = 0.06


def draw_bodies(result: Run | Solution) -> Figure:
    """Deformed meshes above, pressure, shear and states along Gamma_c below; of a run the last iterate is drawn."""
    bodies = result.bodies
    moved = [float(np.abs(u).max()) for u in result.displacements if u is not None]
    size = max(float(np.ptp(body.mesh.points[:, 0])) for body in bodies.elastic)
    scale = _round_down(SHARE * size / max(moved)) if max(moved) > 0 else 1.0
    plane = bodies.problem.dimension == 2
    with styled():
        figure = new_figure(7.2, 5.2 if plane else 2.6)
        axes = figure.subplots(2, 1, height_ratios=[1.2, 1], sharex=True) if plane else [figure.subplots()]
        _draw_meshes(axes[0], bodies, result.displacements, scale)
        if plane:
            _draw_stresses(axes[1], result.contact, bodies.problem.units)
    return figure


def _round_down(value: float) -> float:
    """The largest of 1, 2, 5 times a power of ten below a value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(factor for factor in (1.0, 2.0, 5.0) if factor * power <= value * (1 + 1e-12)) * power)


def _lift(bodies: TwoBodies, scale: float) -> float:
    """The shift of body 2 in the drawing: a flat gap is scaled as displacements are, so that contact looks closed."""
    if bodies.body1 is None or bodies.body2 is None or np.ptp(bodies.interface.gap) > 0:
        return 0.0
    levels = [float(body.mesh.points[body.nodes[0], -1]) for body in (bodies.body1, bodies.body2)]
    return scale * float(bodies.interface.gap[0]) - (levels[1] - levels[0])


def _draw_meshes(ax: Axes, bodies: TwoBodies, displacements: tuple[Floats | None, Floats | None], scale: float) -> None:
    length = bodies.problem.units["length"]
    colours, lifts = (BODY1, BODY2), (0.0, _lift(bodies, scale))
    for i, (body, u) in enumerate(zip((bodies.body1, bodies.body2), displacements, strict=True)):
        if body is None or u is None:
            continue
        points = body.mesh.points + scale * u
        points[:, -1] += lifts[i]
        if bodies.problem.dimension == 2:
            style: dict[str, Any] = {"facecolor": colours[i] + "30", "edgecolor": colours[i], "linewidth": 0.4}
            ax.add_collection(PolyCollection(list(points[body.mesh.cells]), label=f"body {i + 1}", **style))
        else:
            line = np.column_stack([points[:, 0], np.full(len(points), 0.2 * i)])
            bar = LineCollection([line], colors=colours[i], linewidths=6, alpha=0.5, label=f"body {i + 1}")
            ax.add_collection(bar)
            ax.plot(line[:, 0], line[:, 1], "|", color=colours[i])
    if bodies.problem.dimension == 2 and len(bodies.elastic) == 1:
        ax.axhline(_obstacle(bodies), color="0.3", linewidth=2, label="obstacle")
    ax.autoscale_view()
    if bodies.problem.dimension == 2:
        ax.set_aspect("equal")
        ax.set_ylabel(f"y [{plain(length)}]")
    else:
        ax.set_ylim(-0.4, 0.8)
        ax.set_yticks([])
        ax.set_xlabel(f"x [{plain(length)}]")
    ax.set_title(f"{plain(bodies.problem.title)}: deformed, displacements x {scale:g}")
    legend_beside(ax)


def _obstacle(bodies: TwoBodies) -> float:
    """The height of the face of the obstacle."""
    body, sign = (bodies.body2, -1.0) if bodies.body1 is None else (bodies.body1, 1.0)
    assert body is not None
    return float(body.mesh.points[body.nodes[0], 1] + sign * bodies.interface.gap[0])


def _draw_stresses(ax: Axes, contact: ContactFields, units: Mapping[str, str]) -> None:
    ax.axhline(0, color="0.8", linewidth=0.8)
    ax.plot(contact.x, contact.pressure, "-", color=PRESSURE, label="pressure $-\\sigma_N$")
    ax.plot(contact.x, contact.shear, "--", color=SHEAR, label="shear $\\sigma_T$ on body 2")
    states = np.array(contact.status)
    for name, marker in (("stick", "s"), ("slip", "o"), ("open", "x")):
        here = states == name
        if here.any():
            ax.plot(
                contact.x[here], contact.shear[here], marker, color=STATES[name], markersize=4, label=name, linestyle=""
            )
    ax.set_xlabel(f"x along $\\Gamma_c$ [{plain(units['length'])}]")
    ax.set_ylabel(f"stress [{plain(units['stress'])}]")
    legend_beside(ax)
