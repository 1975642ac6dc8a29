"""Constants: m, M and C_R over the size of the plates and over the halvings of their mesh."""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np

import verification as vf
from builder.scenes import axis, chart, dots, line, note, scene, slider, widget

LABEL = (
    "Constants m, M and C_R, relative to those at size 1, over the size of the plates and over the halvings of the mesh"
)

#: The factors by which the plates of the page are made larger.
SIZES = tuple(Fraction(size) for size in ("1/10", "1", "10", "100"))

HALVINGS = range(4)

#: The constants, and how each is drawn: its colour, dashed or not, its dots hollow or not.
LOOKS = {"m": ("blue", False, False), "M": ("red", True, True), "C_R": ("green", False, True)}


@cache
def data() -> dict[str, Any]:
    """Constants of the plates at each size on each mesh."""
    measured = {(i, n): _measure(size, n) for i, size in enumerate(SIZES) for n in HALVINGS}
    one, large = SIZES.index(Fraction(1)), len(SIZES) - 1
    relative = {
        name: {(i, n): here[name] / measured[one, n][name] for (i, n), here in measured.items()} for name in LOOKS
    }
    scenes = {}
    for (i, n), here in measured.items():
        over_sizes = {name: [(float(size), of[j, n]) for j, size in enumerate(SIZES)] for name, of in relative.items()}
        over_halvings = {name: [(float(k), of[i, k]) for k in HALVINGS] for name, of in relative.items()}
        now, before = {name: of[i, n] for name, of in relative.items()}, measured[one, n]
        scenes[i, n] = scene(
            f"Size {float(SIZES[i]):g}, mesh halved {n} times: m = {_mpa(here['m'])} MPa, M = {_mpa(here['M'])} MPa, "
            f"C_R = {here['C_R']:.2f}"
            + (
                "."
                if i == one
                else f", which are {', '.join(f'{of:.3g}' for of in now.values())} times those of size 1."
            ),
            [*_curves(over_sizes, 125), _upright(float(SIZES[i]))],
            [*_curves(over_halvings, HALVINGS[-1] + 0.15), _upright(n)],
            rows=[
                (name, f"{here[name]:.4g}", f"{before[name]:.4g}", f"{here[name] / before[name]:.3g}") for name in here
            ],
        )
    fall = {name: 1 / relative[name][large, 0] for name in LOOKS}
    back = relative["M"][large, HALVINGS[-1]]
    return widget(
        question=f"Both plates are made {SIZES[large]} times as large, with the same material and the same number of "
        "cells. Which constant changes by the largest factor?",
        answers=list(LOOKS),
        right="m",
        wrong={
            "M": f"M changes by a factor of {fall['M']:.1f} only.",
            "C_R": f"C_R changes by a factor of {max(fall['C_R'], 1 / fall['C_R']):.1f} only.",
        },
        why=f"m falls by a factor of {fall['m']:.0f}: a large plate can move far as a whole with little strain. "
        f"M falls by {fall['M']:.1f} because the cells are large too: with {HALVINGS[-1]} halvings it is back at "
        f"{100 * back:.0f} % of its value at size 1, while m stays low.",
        sliders=[
            slider("size", "size", [f"{float(size):g}" for size in SIZES], large),
            slider("halvings", "halvings", HALVINGS, 0),
        ],
        charts=[
            chart(
                "Constants over the size, on one mesh",
                axis("size of both plates", 0.05, 700, log=True),
                axis("relative to size 1", *RANGE, log=True),
                [line([(0.05, 1), (100, 1)], "grey"), note(0.316, 1.25, "no change", anchor="middle")],
            ),
            chart(
                "Constants over the halvings, at one size",
                axis("halvings of the mesh", -0.3, 3.9),
                axis("relative to size 1", *RANGE, log=True),
            ),
        ],
        head=("constant", "here", "at size 1, same mesh", "ratio"),
        scenes=scenes,
    )


#: The ratios that are drawn.
RANGE = 1e-3, 10


def _measure(size: Fraction, halvings: int) -> dict[str, float]:
    """The constants of larger plates: the norm has the only length that is not theirs."""
    plates = vf.example("section6").changed(cells=((20, 3), (12, 3))).refined(halvings)
    found = vf.measure(plates.with_keys({"norm.length": str(1 / size)}))
    return {"m": found.m.value, "M": found.M.value, "C_R": found.C_R.value, "rho": found.rho_max.value}


def _mpa(stress: float) -> str:
    return f"{stress:.0f}" if stress >= 1000 else f"{stress:.3g}"


def _upright(x: float) -> dict[str, Any]:
    return line([(x, RANGE[0]), (x, RANGE[1])], "grey", dashed=True)


def _curves(curves: dict[str, list[tuple[float, float]]], end: float) -> list[dict[str, Any]]:
    """The curves, each with its name at the end; names that would lie on each other are one."""
    marks = []
    for name, points in curves.items():
        colour, dashed, hollow = LOOKS[name]
        marks += [line(points, colour, dashed=dashed), dots(points, colour, hollow=hollow)]
    groups: list[list[str]] = []
    for name in sorted(curves, key=lambda name: curves[name][-1][1]):
        if groups and curves[name][-1][1] < 1.8 * curves[groups[-1][-1]][-1][1]:
            groups[-1].append(name)
        else:
            groups.append([name])
    for group in groups:
        middle = np.exp(np.mean([np.log(curves[name][-1][1]) for name in group]))
        names = "all" if len(group) == len(curves) else ", ".join(group)
        marks.append(note(end, 0.85 * middle, names))
    return marks
