"""The best theta and friction: the factor over theta in two norms, by wave number and of runs, at each friction."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from builder.scenes import axis, chart, dots, line, note, scene, slider, widget

LABEL = "Factor of one step over theta in two norms, by wave number and of a run, and the best theta over friction"

#: What ``benchmarks/best_theta.py`` has recorded.
RECORD = Path(__file__).parents[3] / "benchmarks" / "records" / "theta" / "curves.json"

#: Each way to a factor: its words and its colour.
WAYS = {
    "energy": ("in the norm (5.21)", "red"),
    "free": ("in a free norm", "blue"),
    "waves": ("by wave number", "green"),
    "runs": ("rate of the run", "orange"),
}

#: The friction of the question, and the one before it.
ASKED, BEFORE = 0.8, 0.1

#: The words for the colours that are both orange on the screen.
SHADES = {"red": "dark orange", "orange": "light orange"}

#: The highest factor that is drawn.
HIGHEST = 1.25


def best(thetas: Sequence[float], factors: Sequence[float | None]) -> tuple[float, float] | None:
    """The theta with the least factor, and that factor; None where none is below 1."""
    known = [(factor, theta) for theta, factor in zip(thetas, factors, strict=True) if factor is not None]
    factor, theta = min(known, default=(1.0, 0.0))
    return (theta, factor) if factor < 1 else None


def curve(thetas: Sequence[float], factors: Sequence[float | None], colour: str) -> dict[str, Any]:
    """The factors that are known, as a line."""
    pairs = zip(thetas, factors, strict=True)
    return line([(theta, factor) for theta, factor in pairs if factor is not None], colour)


@cache
def data() -> dict[str, Any]:
    """A scene for each friction."""
    record = json.loads(RECORD.read_text("utf-8"))
    thetas, curves = record["thetas"], record["curves"]
    frictions = [at["k"] for at in curves]
    found = [{way: best(thetas, at[way]) for way in WAYS} for at in curves]
    over = [
        line([(k, at[way][0]) for k, at in zip(frictions, found, strict=True) if at[way]], colour)
        for way, (_, colour) in WAYS.items()
    ]
    scenes = {}
    for i, (k, at, here) in enumerate(zip(frictions, curves, found, strict=True)):
        marks = [curve(thetas, at["no_less"], "grey"), *(curve(thetas, at[way], WAYS[way][1]) for way in WAYS)]
        marks += [dots([here[way]], WAYS[way][1]) for way in WAYS if here[way]]
        scenes[(i,)] = scene(
            says(k, here),
            marks,
            [*over, *(dots([(k, here[way][0])], colour) for way, (_, colour) in WAYS.items() if here[way])],
            rows=[
                (words, *(("none", "") if here[way] is None else (f"{here[way][0]:.2f}", f"{here[way][1]:.3f}")))
                for way, (words, _) in WAYS.items()
            ],
        )
    first, asked = (found[frictions.index(k)] for k in (BEFORE, ASKED))
    places = [asked["free"][0], 0.45, asked["energy"][0]]
    right, *others = (f"near {theta:.2f}" for theta in places)
    start = curves[frictions.index(BEFORE)], curves[frictions.index(ASKED)]
    return widget(
        question="The plates of Section 6 have 7 contact nodes here. "
        f"In the norm (5.21) the best proved theta is {first['energy'][0]:.2f} at k = {BEFORE} and "
        f"{asked['energy'][0]:.2f} at k = {ASKED}: the dark orange curves are the factors of one step. If the proof "
        f"may choose the norm, where is the best theta at k = {ASKED}?",
        answers=[others[1], others[0], right],
        right=right,
        wrong={
            others[0]: "the free norm moves the best theta further than half way.",
            others[1]: "that is the best theta in (5.21), whose factor is larger.",
        },
        why=f"the least factor in a free norm is {asked['free'][1]:.3f} there, and {asked['energy'][1]:.3f} is the "
        f"least one in (5.21). At k = {BEFORE} the best theta in a free norm is {first['free'][0]:.2f}. Move k.",
        sliders=[slider("k", "friction k", [f"{k:g}" for k in frictions], frictions.index(ASKED))],
        charts=[
            chart(
                "Factor of one step over theta",
                axis("relaxation factor theta", 0, 1),
                axis("factor of one step", 0, HIGHEST),
                fixed=[line([(0, 1), (1, 1)], "grey", dashed=True), *legend()],
                before=[curve(thetas, at["energy"], "red") for at in start],
            ),
            chart(
                "Best theta over friction",
                axis("friction k", 0.04, 2, log=True),
                axis("theta of the least factor", 0, 1),
            ),
        ],
        head=("way", "best theta", "factor there"),
        scenes=scenes,
    )


def says(k: float, here: Mapping[str, tuple[float, float] | None]) -> str:
    """A sentence for one friction."""
    told = []
    for way, words in (("energy", "in (5.21)"), ("free", "in a free norm"), ("waves", "by wave number")):
        at = here[way]
        told.append(f"{words} none" if at is None else f"{words} {at[0]:.2f}, with the factor {at[1]:.3f}")
    run = here["runs"]
    assert run is not None, "a run converges at every friction of the record"
    return f"k = {k:g}: the best theta is {', '.join(told)}. The rate of the run is least at theta = {run[0]:.2f}."


def legend() -> list[dict[str, Any]]:
    """The words for the colours, below all curves."""
    named = [*((colour, words) for words, colour in WAYS.values()), ("grey", "no norm goes below")]
    lines = sorted(
        ((f"{SHADES.get(colour, colour)}: {words}", colour) for colour, words in named), key=lambda at: len(at[0])
    )
    return [note(0.02, 0.37 - 0.085 * i, *line) for i, line in enumerate(lines)]  # the curves leave most room below
