"""Two layers without ends: what is proved in each norm, in both roles."""

from __future__ import annotations

from ndtheory import Number
from verification import registry
from verification.free_norm.two_layers import Layers, LayersRole
from verification.show.numbers import figures, marked
from verification.show.parts import Cell, Facts, Quantity, Section, Sections, closing, section, table

CLAIMS = "anything about bodies with ends, of which this is a prediction, or about the local law"

#: The meaning of the mark of a number that is proved for layers.
PROVED = (
    "g (guaranteed): proved in intervals for every wave number, for the layers and every part of the line in contact"
)


@registry.sections.register
def sections(found: Layers) -> Sections:
    """The sections of the calculator for layers."""
    neumann, contact = found.bodies
    layer = lambda name, strip: Facts(
        f"{name}: E = {float(strip.body.young):g}, nu = {float(strip.body.poisson):g}, depth {float(strip.thickness):g}"
    )
    about = f"k = {float(found.friction):g}, hat kernel of radius {float(found.radius):g}"
    heads = ("quantity", f"Neumann body {found.roles[0].neumann}", f"Neumann body {found.roles[1].neumann}")
    rows = [(words, *(_cell(role, at) for role in found.roles)) for words, at in QUANTITIES]
    notes = [PROVED] * found.proved or ["in doubles; --verified proves the numbers in intervals"]
    return (
        section("setting", "", layer("layer 1", neumann), layer("layer 2", contact), Facts(about)),
        _contracts(found),
        section("numbers", "WHICH THETA, WHICH FRICTION?", table(heads, rows, right=(1, 2)), *notes),
        closing(CLAIMS),
    )


def _contracts(found: Layers) -> Section:
    said = []
    for role in found.roles:
        if role.theta is None:
            said.append(f"Neumann body {role.neumann}: no theta is proved to contract at this friction.")
            continue
        free, energy = role.lyapunov.factor, role.energy.factor
        inside = "no norm is found in which it contracts" if free is None else f"a step contracts by {_figure(free)}"
        plain = "nothing is found"
        if energy is not None:
            plain = f"the factor is {_figure(energy)}{', no contraction' * (energy.value >= 1)}"
        said.append(f"Neumann body {role.neumann}, theta = {role.theta:g}: {inside}; in the norm (5.21) {plain}.")
    return section("contracts", "DOES ONE STEP CONTRACT?", *said)


#: The rows of the table.
QUANTITIES = (
    ("factor in the free norm", lambda role: role.lyapunov.factor),
    ("factor in the norm (5.21)", lambda role: role.energy.factor),
    ("best theta", lambda role: role.lyapunov.theta_best),
    ("factor there", lambda role: role.lyapunov.factor_best),
    ("every theta contracts below", lambda role: role.lyapunov.theta_max),
    ("friction: small theta contracts below", lambda role: role.lyapunov.friction_threshold),
)


def _cell(role: LayersRole, at: object) -> Cell:
    value = at(role)  # type: ignore[operator]
    if not isinstance(value, Number):
        return figures(value)
    return Quantity(value.value, marked(str(_figure(value)), value.level), level=value.level)


def _figure(value: Number) -> Cell:
    return figures(value, 4)
