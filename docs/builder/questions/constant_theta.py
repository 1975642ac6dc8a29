"""The best theta on ever finer meshes: the ratio of stiffness of each wave, for cells of several shapes."""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np

from builder.scenes import axis, chart, dots, line, scene, slider, widget
from fem1d2d import plane_strain
from fem1d2d.layers import FacingLayers, Layer, peaks
from ndtheory.energy_norms import predicted_theta
from ndtheory.moduli import Moduli, half_planes

LABEL = "Ratio of stiffness over the wave number for two bodies of equal cells, and the predicted theta on fine meshes"

#: Poisson's ratio of both bodies, which are of one material.
NU = Fraction(3, 10)

#: Height over width of a cell: the positions of both sliders.
HEIGHTS = tuple(Fraction(2) ** power for power in range(-2, 3))

#: The cells of the question: those of the contact body twice as high as wide, the others square.
ASKED = (HEIGHTS.index(Fraction(2)), HEIGHTS.index(Fraction(1)))

#: The waves of the curve, in radians per column of cells; pi/2 is the end, where two waves exchange their places.
WAVES = np.linspace(0.02, np.pi / 2, 40)

#: The ends of the axes of rho and of theta.
RHO, THETA = (0.0, 7.0), (0.2, 0.6)


def interface(contact: Fraction, neumann: Fraction) -> FacingLayers:
    """Half-planes of cells of two heights, diagonals mirrored."""
    material = plane_strain(1.0, float(NU))
    layers = (Layer(material=material, aspect=float(1 / height)) for height in (contact, neumann))
    return FacingLayers(**dict(zip(("contact", "neumann"), layers, strict=True)))


def long_waves() -> float:
    """The ratio of half-planes without cells."""
    steel = Moduli(young=1, poisson=NU)
    return float(half_planes(steel, steel).high)


@cache
def rho_star(contact: Fraction, neumann: Fraction) -> float:
    """rho* of these cells."""
    return max(peaks(interface(contact, neumann))[0].ratio, long_waves())


@cache
def data() -> dict[str, Any]:
    """A scene for each pair of heights."""
    limit, scenes = long_waves(), {}
    for i, contact in enumerate(HEIGHTS):
        for j, neumann in enumerate(HEIGHTS):
            pair, star = interface(contact, neumann), rho_star(contact, neumann)
            theta = predicted_theta(star)
            ratios = pair.ratios(2 * WAVES)[0]
            best = int(np.argmax(ratios))
            decides = "waves as short as the cells decide" if star > 1.001 * limit else "long waves decide"
            scenes[i, j] = scene(
                f"Cells {contact} and {neumann} times as high as wide: rho* = {star:.3f}, {decides}, and fine meshes "
                f"have 2/(2 + rho) of at most {theta:.3f}.",
                [line(zip(WAVES, ratios, strict=True)), dots([(WAVES[best], ratios[best])], "red")],
                [
                    line([(float(h), predicted_theta(rho_star(h, neumann))) for h in HEIGHTS], "grey"),
                    dots([(float(contact), theta)], "red"),
                ],
                rows=[
                    (str(h), f"{rho_star(h, neumann):.3f}", f"{predicted_theta(rho_star(h, neumann)):.3f}")
                    for h in HEIGHTS
                ],
            )
    asked = rho_star(*(HEIGHTS[i] for i in ASKED))
    return widget(
        question=f"Two bodies are of one material, with nu = {float(NU):g}. The cells of the contact body are twice as "
        f"high as wide, and the Neumann body has square ones. Without a mesh short waves have the ratio {limit:g}. "
        "What does rho do as the mesh is halved again and again?",
        answers=[
            f"it tends to {limit:g}, as without a mesh",
            f"it tends to {asked:.2f} or more",
            "it grows without end",
        ],
        right=f"it tends to {asked:.2f} or more",
        wrong={
            f"it tends to {limit:g}, as without a mesh": "every mesh has waves as short as its cells.",
            "it grows without end": "the cells keep their shape, and short waves their ratio.",
        },
        why=f"the shortest waves have the ratio {asked:.3f} on every mesh of these cells, however fine it is. With "
        "cells of one shape on both sides long waves decide at this nu: move the first slider to 1.",
        sliders=[
            slider("contact", "height over width, contact body", HEIGHTS, ASKED[0]),
            slider("neumann", "height over width, Neumann body", HEIGHTS, ASKED[1]),
        ],
        charts=[
            chart(
                "Ratio of stiffness of each wave",
                axis("radians per column, or pi more", 0, 1.6),
                axis("stiffness ratio (dashed: no mesh)", *RHO),
                fixed=[line([(0, limit), (1.6, limit)], "grey", dashed=True)],
            ),
            chart(
                "Predicted theta on fine meshes, at most",
                axis("height over width, contact body", 0, 4.2),
                axis("2/(2 + rho*)", *THETA),
            ),
        ],
        head=("height over width, contact body", "rho*", "2/(2 + rho*)"),
        scenes=scenes,
    )
