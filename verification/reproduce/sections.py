"""The figures of Section 6, run again: each beside what the paper says of it."""

from __future__ import annotations

from verification import registry
from verification.reproduce.claims import CLAIMS, zones
from verification.reproduce.experiments import Outcome, Reproduction, Result
from verification.show.parts import Facts, Section, Sections, closing, section, table

#: A reading that shows its figure, one that does not, and one of which nothing was computed.
WORDS = {True: "yes", False: "no", None: "refused"}


@registry.sections.register
def sections(found: Reproduction) -> Sections:
    """The sections."""
    about = "Section 6 of the paper, run again on its meshes; non-local law, r = 0.1 mm"
    figures = [_figure(result) for result in found.results]
    if len(found.results) > 1:
        said = f"{found.closest.name}: {found.reproduced(found.closest)} of {len(found.results)} reproduced"
        title = "WHICH READING COMES NEAREST TO ALL?"
        figures.append(section("nearest", title, said))
    return (
        section("setting", "", Facts(about)),
        *figures,
        closing("that the authors ran one of these readings", then="ndtheory sweep --help"),
    )


def _figure(result: Result) -> Section:
    claim = CLAIMS[result.figure]
    of_text = [outcome for outcome in result.outcomes if not outcome.reading.departs]
    shown = of_text + ([] if result.closest in of_text else [result.closest])
    held = [outcome.reading for outcome in result.outcomes if outcome.holds]
    refused = sum(outcome.holds is None for outcome in result.outcomes)
    notes = [
        f"reproduced in {len(held)} of {len(result.outcomes)} readings, {refused} of which are refused",
        f"nearest: {result.closest.reading.name}",
    ]
    if held:
        assumed = "; ".join(", ".join([*reading.assumes, *reading.departs]) for reading in held[:3])
        notes.append(f"under the assumption that {assumed}")
    rows = [(_short(outcome), WORDS[outcome.holds], _says(outcome)) for outcome in shown]
    title = f"{result.figure.upper()}: {result.verdict.upper()}"
    claims = f"the paper: {claim.says}", f"reproduced means: {claim.criterion}"
    return section(result.figure, title, *claims, table(("reading", "", "what it shows"), rows), *notes)


def _short(outcome: Outcome) -> str:
    reading = outcome.reading
    parts = [
        reading.position.split()[0],
        reading.top.split()[0],
        "" if reading.moved == "whole top" else reading.moved.removeprefix("left "),
        "" if reading.neumann_body == 1 else "roles of Section 3",
        "" if reading.moduli == "as printed" else "moduli exchanged",
    ]
    return ", ".join(filter(None, parts))


def _says(outcome: Outcome) -> str:
    if outcome.holds is None:
        return outcome.reason
    if outcome.contact is not None:
        return ", ".join(f"{state} to {high:.2f}" for state, _, high in zones(outcome.contact))
    found = []
    for curve in outcome.curves:
        at = curve.steps_at_printed
        best = "none converges" if not curve.best else f"{curve.best[0]:g}: {curve.fewest}"
        found.append(f"{best} (0.6: {'-' if at is None else at})")
    return "best theta: steps " + "; ".join(found)
