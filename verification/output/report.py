"""The written report: one HTML file that loads nothing from other files or hosts."""

from __future__ import annotations

import re
from collections.abc import Mapping
from html import escape

from jinja2 import Environment, PackageLoader, StrictUndefined

from ndtheory import __version__
from ndtheory.texts import printable
from verification.comparison import Comparison
from verification.sections.bounds import on_the_printed_proof
from verification.show.parts import shown

GLOSSARY = {
    "Neumann body": "The body that gets the linear problem of step I: the contact forces are a load on it. The other "
    "one is the contact body.",
    "theta": "The relaxation factor: the next forces are theta times the new ones plus 1 - theta times the old ones.",
    "rho": "The largest stiffness of the contact body relative to the Neumann body, over all shapes of Gamma_c.",
    "edition": "A form of the theorem with the constants of this mesh. Printed: exactly as published. "
    "Repaired: with the factor 1/m that (5.30) lost.",
    "energy": "The bound by the proof of the theorem in energy norms.",
    "lmi": "The bound by semidefinite programs, from the conditions of contact and friction node by node. Its "
    "quadratic form is checked in floating point.",
    "lyapunov": "The bound in a norm that the proof chooses, instead of (5.21).",
    "verified, v": "The level of a number: it is proved for the exact data on this mesh, with all rounding errors "
    "bounded. A number without a mark was computed in doubles.",
    "factor": "The largest number by which one step multiplies the error, according to a bound.",
    "rate": "The number by which one step multiplies the error in the long run, observed or predicted.",
    "ratio": "The quotient of two successive residuals of the run.",
    "residual": "The difference between the forces after a step without relaxation and the forces before it.",
    "decade": "A factor of ten.",
    "stick, slip, open": "A contact node touches and does not slide; touches and slides; does not touch.",
}

VERDICTS = {
    "consistent": "The largest ratio seen, rounding included, is below the bound, or attains it.",
    "violated": "The ratio is above the bound: for a proved bound a bug or an error in the proof, for the printed one "
    "a finding. A violated forecast was wrong.",
    "inconclusive": "The difference is smaller than rounding.",
    "no conclusion": "The theorem draws no conclusion at this friction and theta.",
    "not computed": "No number was available to compare with the run; the reason is given.",
}

#: Beyond three columns, or with cells longer than this, a table is shown row by row on a phone.
NARROW = 20


class _Raised(str):
    """HTML of a text with its powers raised and the index of Gamma_c lowered, which jinja2 takes as it is."""

    def __new__(cls, text: object) -> _Raised:
        powers = re.sub(r"(?<=\w)\^(-?\d+(?:\.\d+)?)", r"<sup>\1</sup>", escape(str(text)))
        return super().__new__(cls, powers.replace("Gamma_c", "Γ<sub>c</sub>"))

    def __html__(self) -> str:
        return self


def _inline(name: str, svg: str) -> str:
    """An SVG without its prologue, its ids made unique, so that a page can contain several."""
    svg = re.sub(r"^.*?(?=<svg)", "", svg, flags=re.DOTALL)
    for reference in ('id="', 'href="#', "url(#"):
        svg = svg.replace(reference, f"{reference}{name}-")
    return svg


def report(comparison: Comparison, figures: Mapping[str, str]) -> str:
    """Render a comparison: its sections with figures, the SVG texts by name, and what its words mean."""
    environment = Environment(
        loader=PackageLoader("verification", "data"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.tests["wide"] = lambda of: len(of.head) > 3 or any(len(str(x)) > NARROW for row in of.rows for x in row)
    environment.filters["raised"] = _Raised
    setting, *sections = shown(comparison.sections(), "report")
    return environment.get_template("report.html.j2").render(
        title=printable(comparison.run.pair.title),
        setting=setting,
        sections=sections,
        figures={name: _inline(name, text) for name, text in figures.items()},
        glossary=GLOSSARY,
        verdicts=VERDICTS,
        on_the_printed_proof=on_the_printed_proof(),
        version=__version__,
    )
