"""The written report: one HTML file that asks no other file and no other host."""

from __future__ import annotations

import re
from collections.abc import Mapping

from jinja2 import Environment, PackageLoader, StrictUndefined

from ndtheory import Number, __version__
from verification.bounds.bound import bounded
from verification.comparison import Comparison
from verification.ledger.record import on_the_printed_proof


def _shown(value: float | Number | None) -> str:
    number = value.value if isinstance(value, Number) else value
    return "-" if number is None else f"{number:.6g}"


def _inline(name: str, svg: str) -> str:
    """An SVG without its prologue and with ids of its own, so that two can stand in one page."""
    svg = re.sub(r"^.*?(?=<svg)", "", svg, flags=re.DOTALL)
    for reference in ('id="', 'href="#', "url(#"):
        svg = svg.replace(reference, f"{reference}{name}-")
    return svg


def report(comparison: Comparison, figures: Mapping[str, str]) -> str:
    """Render a comparison.

    Parameters
    ----------
    comparison : Comparison
    figures : mapping from ``bodies``, ``residuals`` to SVG text
    """
    environment = Environment(
        loader=PackageLoader("verification", "data"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters["shown"] = _shown
    return environment.get_template("report.html.j2").render(
        comparison=comparison,
        run=comparison.run,
        bounded=bounded(comparison.computed),
        problem=comparison.run.pair.problem,
        title="".join(c if c.isprintable() else " " for c in comparison.run.pair.title),
        measured=comparison.measured,
        figures={name: _inline(name, text) for name, text in figures.items()},
        on_the_printed_proof=on_the_printed_proof(),
        version=__version__,
    )
