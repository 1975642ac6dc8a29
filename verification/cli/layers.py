"""``ndtheory layers``: the circle criterion for two layers, without a mesh."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ndtheory import HypothesisError
from verification.cli.console import as_figure, deliver
from verification.cli.forms import cli
from verification.cli.options import JSON, one_file


@cli.command()
@click.option(
    "--young", required=True, metavar="E_N,E_C", help="Moduli, the Neumann body first, in one unit of stress."
)
@click.option("--poisson", required=True, metavar="NU_N,NU_C", help="Poisson ratios below 1/2, no unit.")
@click.option("--depth", required=True, metavar="D_N,D_C", help="Thicknesses, in one unit of length.")
@click.option("--friction", required=True, metavar="K", help="Coefficient of friction, k > 0.")
@click.option("--radius", required=True, metavar="R", help="Radius of the hat kernel, in the unit of --depth.")
@click.option("--theta", metavar="NUMBER", help="Relaxation factor, 0 < theta < 1; without it the best one.")
@click.option(
    "--verified", is_flag=True, help="Prove the numbers in intervals, for every wave number; takes up to minutes."
)
@one_file(".svg", ".png", words="Figure to draw, the factor over theta and k")
@JSON
def layers(target: Path | None, as_json: bool, **given: Any) -> None:
    """Bound the factor of one step between two layers, without a mesh.

    Two layers, each clamped at its far side, touch along any part of a line.  The proof
    chooses a norm for the factor; the factor in the norm (5.21) of the paper is shown, too, and both roles.  For
    bodies with ends the numbers are predictions.

    \b
    Example, in MPa and mm, the layers of Section 6:
      ndtheory layers --young 7e4,2e4 --poisson 0.3,0.3 --depth 0.3,0.3 \\
        --friction 0.2 --radius 0.1 --theta 0.7
    """
    from verification.document import Document
    from verification.free_norm.two_layers import two_layers

    given |= {name: given[name].split(",") for name in ("young", "poisson", "depth")}
    try:
        found = two_layers(**given)
    except HypothesisError as error:
        raise click.UsageError(f"--{error}") from None
    from verification.output.files import writing

    deliver(found, Document.sections, as_json, writing(target, as_figure), target)
