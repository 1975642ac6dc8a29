"""Two layers without ends: what is proved in each norm, in both roles."""

from __future__ import annotations

from collections.abc import Callable

from ndtheory import Number
from verification import registry
from verification.bounds.bound import rest_of
from verification.free_norm.two_layers import Layers, LayersRole
from verification.show.numbers import at_least, factor, figures
from verification.show.parts import Cell, Facts, Sections, closing, section, table

CLAIMS = "anything about bodies with ends, of which this is a prediction, or about the local law"

#: The meaning of the mark of a number that is proved for layers.
PROVED = (
    "g (guaranteed): proved in intervals for every wave number, for the layers and every part of the line in contact"
)


#: A factor, near 1 as its distance from 1.
_at_most: Callable[[Number | None], Cell] = lambda number: factor(number, number and rest_of(number))

#: The rows of the table: proved bounds are rounded to the safe side.
QUANTITIES: dict[str, Callable[[LayersRole], Cell]] = {
    "factor in the free norm": lambda role: _at_most(role.lyapunov.factor),
    "factor in the norm (5.21)": lambda role: _at_most(role.energy.factor),
    "best theta": lambda role: figures(role.lyapunov.theta_best),
    "factor there": lambda role: _at_most(role.lyapunov.factor_best),
    "every theta contracts below": lambda role: at_least(role.lyapunov.theta_max),
    "friction: small theta contracts below": lambda role: at_least(role.lyapunov.friction_threshold),
}


@registry.sections.register
def sections(found: Layers) -> Sections:
    """The sections of the calculator for layers."""
    given, facts = found.inputs, []
    for i in (0, 1):
        young, poisson, depth = (given[name][i] for name in ("young", "poisson", "depth"))
        facts.append(Facts(f"layer {i + 1}: E = {young:g}, nu = {poisson:g}, depth {depth:g}"))
    facts.append(Facts(f"k = {given['friction']:g}, hat kernel of radius {given['radius']:g}"))
    head = ("quantity", *(f"Neumann body {role.neumann}" for role in found.roles))
    rows = [(words, *map(cell, found.roles)) for words, cell in QUANTITIES.items()]
    note = PROVED if found.proved else "in doubles; --verified proves the numbers in intervals"
    return (
        section("setting", "", *facts),
        section("contracts", "DOES ONE STEP CONTRACT?", *map(_contracts, found.roles)),
        section("numbers", "WHICH THETA, WHICH FRICTION?", table(head, rows, right=(1, 2)), note),
        closing(CLAIMS),
    )


def _contracts(role: LayersRole) -> str:
    if role.theta is None:
        return f"Neumann body {role.neumann}: no theta is found to contract at this friction."
    free, energy = role.lyapunov.factor, role.energy.factor
    none = "no factor below 1 is found"
    inside = f"{none} in the free norm" if free is None else f"a step contracts by {_at_most(free)}"
    plain = none if energy is None or energy.value >= 1 else f"the factor is {_at_most(energy)}"
    return f"Neumann body {role.neumann}, theta = {role.theta:g}: {inside}; in the norm (5.21) {plain}."
