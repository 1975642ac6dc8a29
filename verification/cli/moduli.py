"""``advise`` from moduli alone: the options, and what they ask for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import click

from ndtheory import HypothesisError

if TYPE_CHECKING:
    from verification.advice.roles import Advice

_BODIES = ["none", "1", "2", "both"]
_OPTIONS: dict[str, dict[str, Any]] = {
    "--young": {"metavar": "E1,E2", "help": "Moduli of elasticity of body 1 and of body 2, in one unit of stress."},
    "--poisson": {"metavar": "NU1,NU2", "help": "Poisson ratios of body 1 and of body 2."},
    "--plane-stress": {"is_flag": True, "help": "With --young: plane stress; plane strain by default."},
    "--three-dimensional": {"is_flag": True, "help": "With --young: bodies in space."},
    "--corners": {
        "type": click.Choice(_BODIES),
        "help": "With --young: which body ends in corners of 90 degrees at the ends of Gamma_c.",
    },
    "--mirror": {
        "type": click.Choice(_BODIES[1:]),
        "help": "With --young: the body whose mirror image in a flat Gamma_c lies inside the other one, and wherever it"
        " is held, its image is held too.",
    },
    "--flat": {
        "is_flag": True,
        "help": "With --mirror: the other body is at least twice as wide as high and held along its other side.",
    },
}

#: Names of the options as parameters of the command.
NAMES = {option: option[2:].replace("-", "_") for option in _OPTIONS}


def moduli_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of moduli to a command."""
    for option, settings in reversed(_OPTIONS.items()):
        command = click.option(option, **settings)(command)
    return command


def of_moduli(given: Mapping[str, Any]) -> str:
    """What was given, in words."""
    others = [option for option, name in NAMES.items() if name in given]
    return others[0] if others and not {"young", "poisson"} & given.keys() else "--young and --poisson"


def advice_from_moduli(given: Mapping[str, Any]) -> Advice:
    """The advice that the options ask for.

    Parameters
    ----------
    given : mapping
        The options that were given, by the names of their parameters.

    Raises
    ------
    click.UsageError
    """
    from verification.advice.from_moduli import advise_moduli

    context = click.get_current_context()
    if not {"young", "poisson"} <= given.keys():
        received = " with ".join(option for option, name in NAMES.items() if name in given)
        raise click.UsageError(f"received {received}: needed both --young and --poisson", context)
    if "flat" in given and "mirror" not in given:
        needed = "received --flat without --mirror: it tells of the body that such an image fits into"
        raise click.UsageError(needed, context)
    if {"plane_stress", "three_dimensional"} <= given.keys():
        raise click.UsageError("received --plane-stress with --three-dimensional: needed one of both", context)
    try:
        return advise_moduli(
            young=given["young"].split(","),
            poisson=given["poisson"].split(","),
            plane="stress" if "plane_stress" in given else "3d" if "three_dimensional" in given else "strain",
            corners=given.get("corners"),
            mirror=[body for body in (1, 2) if given.get("mirror") in (str(body), "both")],
            flat="flat" in given,
        )
    except HypothesisError as error:
        raise click.UsageError(f"--{error}", context) from None
