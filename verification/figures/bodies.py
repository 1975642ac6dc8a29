"""The deformed bodies with the contact stresses along Gamma_c."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from fem1d2d.mesh import Floats
from verification.figures.style import BODY1, BODY2, PRESSURE, SHEAR, STATES, new_figure, styled
from verification.runs import Run

#: Displacements are drawn so that the largest is about this fraction of the picture.
SHARE = 0.06


def draw_bodies(run: Run) -> Figure:
    """Deformed meshes above, pressure and shear along Gamma_c below, the state of each node between them.

    Parameters
    ----------
    run : Run
        The state drawn is its last one.
    """
    pair = run.pair
    displacements = displacement_fields(run)
    largest = max(float(np.abs(u).max()) for u in displacements)
    size = max(float(np.ptp(body.mesh.points[:, 0])) for body in (pair.body1, pair.body2))
    scale = _round_down(SHARE * size / largest) if largest > 0 else 1.0
    plane = pair.problem.dimension == 2
    with styled():
        figure = new_figure(7.2, 5.2 if plane else 2.6)
        axes = figure.subplots(2, 1, height_ratios=[1.2, 1], sharex=True) if plane else [figure.subplots()]
        _draw_meshes(axes[0], run, displacements, scale)
        if plane:
            _draw_stresses(axes[1], run)
    return figure


def displacement_fields(run: Run) -> tuple[Floats, Floats]:
    """Displacements of all nodes of body 1 and body 2 at the last state, shape (nodes, d), unit of length."""
    pair, state = run.pair, run.last
    neumann = pair.orient(state.displacement)
    moved = state.displacement + state.contact.v
    moved[pair.normal] += pair.gap
    contact = pair.orient(moved)
    if pair.problem.iteration.neumann_body == 2:
        return pair.body1.displacement(contact), pair.body2.displacement(neumann)
    return pair.body1.displacement(neumann), pair.body2.displacement(contact)


def _round_down(value: float) -> float:
    """The largest of 1, 2, 5 times a power of ten below a value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(factor for factor in (1.0, 2.0, 5.0) if factor * power <= value * (1 + 1e-12)) * power)


def _draw_meshes(ax: Axes, run: Run, displacements: tuple[Floats, Floats], scale: float) -> None:
    pair = run.pair
    length = pair.problem.units["length"]
    drawn = float(pair.body2.mesh.points[pair.body2.nodes[0], -1] - pair.body1.mesh.points[pair.body1.nodes[0], -1])
    lift = [0.0, scale * float(pair.gap[0]) - drawn]  # the gap grows with the displacements: touching bodies touch
    for body, u, colour, shift in zip((pair.body1, pair.body2), displacements, (BODY1, BODY2), lift, strict=True):
        moved = body.mesh.points + scale * u
        name = "body 1" if body is pair.body1 else "body 2"
        name += ", Neumann" if body is pair.neumann.body else ", contact"
        moved[:, -1] += shift
        if pair.problem.dimension == 2:
            style: dict[str, Any] = {"facecolor": colour + "30", "edgecolor": colour, "linewidth": 0.4}
            ax.add_collection(PolyCollection(list(moved[body.mesh.cells]), label=name, **style))
        else:
            level = 0.0 if body is pair.body1 else 0.2
            points = np.column_stack([moved[:, 0], np.full(len(moved), level)])
            ax.add_collection(LineCollection([points], colors=colour, linewidths=6, alpha=0.5, label=name))
            ax.plot(points[:, 0], points[:, 1], "|", color=colour)
    ax.autoscale_view()
    if pair.problem.dimension == 2:
        ax.set_aspect("equal")
        ax.set_ylabel(f"y [{length}]")
    else:
        ax.set_ylim(-0.4, 0.8)
        ax.set_yticks([])
        ax.set_xlabel(f"x [{length}]")
    ax.set_title(f"{pair.problem.title}: deformed, displacements x {scale:g}")
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def _draw_stresses(ax: Axes, run: Run) -> None:
    contact, units = run.contact, run.units
    ax.axhline(0, color="0.8", linewidth=0.8)
    ax.plot(contact.x, contact.pressure, "-", color=PRESSURE, label="pressure $-\\sigma_N$")
    ax.plot(contact.x, contact.shear, "--", color=SHEAR, label="shear $\\sigma_T$ on body 2")
    states = np.array(contact.state)
    for name, marker in (("stick", "s"), ("slip", "o"), ("open", "x")):
        here = states == name
        if here.any():
            ax.plot(
                contact.x[here], contact.shear[here], marker, color=STATES[name], markersize=4, label=name, linestyle=""
            )
    ax.set_xlabel(f"x along $\\Gamma_c$ [{units['length']}]")
    ax.set_ylabel(f"stress [{units['stress']}]")
    ax.legend(ncols=1, loc="center left", bbox_to_anchor=(1.0, 0.5))
