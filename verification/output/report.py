"""The written report: one HTML file that asks no other file and no other host."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from jinja2 import Environment, PackageLoader, StrictUndefined

from ndtheory import __version__
from ndtheory.texts import printable
from verification.comparison import Comparison
from verification.ledger.record import on_the_printed_proof

if TYPE_CHECKING:
    from verification.cli.console import Part

#: What the table below a heading of the screen shows.
TABLES = {
    "HOW LARGE ARE THE CONSTANTS?": "The constants of the theorem on this mesh, with the bounds proved of them.",
    "DOES ONE STEP CONTRACT?": "Each bound that follows from the constants: the friction k below which every small "
    "theta, and some theta, contracts; the theta allowed at the friction of this problem; by which factor one step of "
    "this run multiplies the error at most.",
    "WHAT HAPPENED": "The rate by which one step multiplies the error in the long run, and the steps to the tolerance: "
    "as forecast half way, as computed at the solution, and as seen.",
    "WHAT DO SEMIDEFINITE PROGRAMS PROVE OF ONE STEP?": "The same for the bound that takes the matrices of the bodies.",
    "DOES THE RUN AGREE WITH THE BOUND?": "Each bound beside the largest ratio of successive residuals in the norm "
    "(5.21), in which forces count by the energy that they store in the Neumann body; linearised: the forecast beside "
    "the end of the run.",
    "WHICH THETA?": "The theta with the least proved factor, and the one that rho alone suggests.",
    "WHAT DOES THE THEOREM NEED TO KNOW?": "The constants on this mesh: those of Section 5, then rho and those of the "
    "theorem in energy norms.",
}

#: Which figure stands below a heading of the screen, and what it shows.
FIGURES = {
    "WHAT HAPPENED": {
        "residuals": "The residual step by step (points), and how each bound proves that it falls (lines).",
        "bodies": "The bodies and what happens along Gamma_c: where its nodes stick, slip or are open, and the "
        "pressure and shear they bear.",
    },
    "WHAT DOES EACH ESTIMATE GIVE AWAY?": {
        "waterfall": "What the inequalities of the proof give away, in decades. At the top each one stands by itself, "
        "at the pair of forces that comes closest to equality; these pairs differ, so these bars do not add up. Below "
        "it one quantity is followed step by step to its bound in each panel, and the bars add up; what leads from the "
        "repaired to the printed bound is only the unit of stress."
    },
}

GLOSSARY = {
    "Neumann body": "The body that gets the linear problem of step I: the contact forces are a load on it. The other "
    "one is the contact body.",
    "theta": "The relaxation factor: the next forces are theta times the new ones plus 1 - theta times the old ones.",
    "rho": "The largest stiffness of the contact body relative to the Neumann body, over all shapes of Gamma_c.",
    "edition": "A form of the theorem with the constants of this mesh. Printed: the paper's, letter by letter. "
    "Repaired: with the factor 1/m that (5.30) lost.",
    "energy": "The same proof in energy norms.",
    "lmi": "The bound by semidefinite programs, from the conditions of contact and friction node by node. Its "
    "quadratic form is checked in floating point.",
    "verified, v": "The level of a number: it is proved for the exact data on this mesh, with all rounding errors "
    "bounded. A number without a mark was computed in doubles.",
    "factor": "The number by which a bound says that one step multiplies the error at most.",
    "rate": "The number by which one step multiplies the error in the long run, observed or predicted.",
    "ratio": "The quotient of two successive residuals of the run.",
    "residual": "How far the forces are from being reproduced by a step without relaxation.",
    "decade": "A factor of ten.",
    "stick, slip, open": "A contact node touches and does not slide; touches and slides; does not touch.",
}

VERDICTS = {
    "CONSISTENT": "The largest ratio seen, rounding included, is below the bound, or attains it.",
    "VIOLATED": "It is above: for a proved bound a bug or an error in the proof, for the printed one a finding; for "
    "linearised, a forecast that missed.",
    "INCONCLUSIVE": "The difference is smaller than rounding.",
    "HYPOTHESES_NOT_MET": "The theorem draws no conclusion at this friction and theta.",
    "NOT_COMPUTED": "There is nothing to hold against the run; the reason stands beside it.",
}

#: Beyond three columns, or with cells longer than this, a table is shown row by row on a phone.
NARROW = 20


@dataclass(kw_only=True)
class Section:
    """A heading of the screen and what is said below it."""

    heading: str
    parts: list[Part] = field(default_factory=list)

    @property
    def shown(self) -> str:
        """The heading in small letters."""
        return self.heading.capitalize()

    @property
    def figures(self) -> Mapping[str, str]:
        """Captions of the figures that stand below it, by name."""
        return FIGURES.get(self.heading, {})

    def caption(self) -> str:
        """What its table shows."""
        return TABLES[self.heading]


def _sections(parts: list[Part]) -> Iterator[Section]:
    """What is said before the first heading, then what is said below each."""
    section = Section(heading="")
    for part in parts:
        if part.kind == "heading":
            yield section
            section = Section(heading=part.text)
        else:
            section.parts.append(part)
    yield section


def _labelled(text: str) -> tuple[str, str]:
    """A line of the screen as its label and the rest; the screen sets them apart by three spaces at least.

    >>> _labelled("  nodes               17 stick, 8 slip")
    ('nodes', '17 stick, 8 slip')
    >>> _labelled("  m = 3 MPa")
    ('', 'm = 3 MPa')
    """
    label, _, rest = re.sub(" {3,}", "\t", text.strip()).partition("\t")
    return (label, rest) if rest else ("", label)


def _wide(part: Part) -> bool:
    """Whether a table does not fit on a phone side by side."""
    return len(part.head) > 3 or any(len(cell) > NARROW for row in part.rows for cell in row)


def _inline(name: str, svg: str) -> str:
    """An SVG without its prologue and with ids of its own, so that two can stand in one page."""
    svg = re.sub(r"^.*?(?=<svg)", "", svg, flags=re.DOTALL)
    for reference in ('id="', 'href="#', "url(#"):
        svg = svg.replace(reference, f"{reference}{name}-")
    return svg


def report(comparison: Comparison, figures: Mapping[str, str]) -> str:
    """Render a comparison: what the screen says in its own words and digits, figures, and what its words mean.

    Parameters
    ----------
    comparison : Comparison
    figures : mapping from ``bodies``, ``residuals``, ``waterfall`` to SVG text
    """
    from verification.cli import notebook
    from verification.cli.console import figures as shown
    from verification.cli.console import near_one

    environment = Environment(
        loader=PackageLoader("verification", "data"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters |= {"shown": shown, "near_one": near_one, "labelled": _labelled}
    environment.tests["wide"] = _wide
    title = printable(comparison.run.pair.title)
    first, *sections = _sections(notebook.report(comparison))
    return environment.get_template("report.html.j2").render(
        run=comparison.run,
        title=title,
        setting=[part.text.removeprefix(title).removeprefix(" | ") for part in first.parts],
        sections=[section for section in sections if section.parts],
        figures={name: _inline(name, text) for name, text in figures.items()},
        glossary=GLOSSARY,
        verdicts=VERDICTS,
        on_the_printed_proof=on_the_printed_proof(),
        version=__version__,
    )
