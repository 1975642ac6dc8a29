"""The cheat sheet: formulas for one coupling with an example each, as a page of the site and as a PDF of one page."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from math import ceil, log
from pathlib import Path
from textwrap import fill
from typing import NamedTuple

from matplotlib.figure import Figure

import verification as vf
from ndtheory import energy_norms
from verification.figures import style

#: The theta of a run that shows the stiffest mode, and of one that shows the softest.
LARGE, SMALL = 0.9, 0.5


class Line(NamedTuple):
    """What one wants to know, the formula in LaTeX, its value in the example."""

    question: str
    formula: str
    example: str


class Part(NamedTuple):
    """A heading, the words below it, and the lines."""

    title: str
    words: str
    lines: Sequence[Line]


def _limit(theta: float) -> str:
    """The end of an interval of theta, which is cut off at 1."""
    return f"{theta:.2f}{' (theta is at most 1)' * (theta > 1)}"


@cache
def parts() -> list[Part]:
    """All of the sheet; the values are those of Section 6, from the library's own functions."""
    measured = vf.measure(problem := vf.example("section6"))
    k = float(problem.contact.friction)
    rho, rho_min = measured.rho_max.value, measured.rho_min.value
    kappas = tuple(k * measured.C_s_energy.value * C_t.value for C_t in (measured.C_t1, measured.C_t2))
    rho_N = vf.measure(problem.changed(friction=0)).rho_normal.value
    rate = energy_norms.predicted_rate(rho)
    high, low = (
        energy_norms.tied_factor(theta, *ends) for theta, ends in ((LARGE, (rho, rho)), (SMALL, (rho_min, rho_min)))
    )
    every = k * energy_norms.friction_multiple(*kappas)
    some = k * energy_norms.friction_limit(rho, *kappas)
    number = energy_norms.friction_number(*kappas)
    return [
        Part(
            "Who is the Neumann body?",
            "The Neumann body reads forces and writes displacements; the contact body reads displacements and writes "
            "forces. Give the Neumann problem to the body for which rho is smaller: usually the stiffer one.",
            [
                Line(
                    "stiffness of the contact body over that of the Neumann body on the interface, at most",
                    r"\rho = \max_v \frac{v^\top S_c v}{v^\top S_n v}",
                    f"{rho:.3f}",
                ),
                Line(
                    "the same without tangential forces: it takes the place of rho if there is no friction",
                    r"\rho_N \leq \rho",
                    f"{rho_N:.3f}",
                ),
                Line("rho with the roles exchanged", r"1/\rho_{\min}", f"{1 / rho_min:.1f}"),
            ],
        ),
        Part(
            "Which theta?",
            "Proved without friction (with rho_N) and for tied bodies (with rho); predicted with friction (with rho).",
            [
                Line("no friction: the iteration converges below", r"2/(1 + \rho_N)", _limit(2 / (1 + rho_N))),
                Line("its best theta", r"2/(2 + \rho_N)", f"{energy_norms.predicted_theta(rho_N):.3f}"),
                Line("its factor per step", r"\rho_N/(2 + \rho_N)", f"{energy_norms.predicted_rate(rho_N):.3f}"),
                Line("friction: the predicted best theta", r"2/(2 + \rho)", f"{energy_norms.predicted_theta(rho):.3f}"),
                Line("the predicted factor per step", r"\rho/(2 + \rho)", f"{rate:.3f}"),
                Line("tied bodies: the iteration converges below", r"2/(1 + \rho)", _limit(2 / (1 + rho))),
                Line(
                    "their best theta (with friction: predicted if nothing opens or slips)",
                    r"2/(2 + \rho_{\min} + \rho)",
                    f"{energy_norms.tied_theta(rho_min, rho):.3f}",
                ),
                Line(
                    "their factor per step",
                    r"(\rho - \rho_{\min})/(2 + \rho_{\min} + \rho)",
                    f"{energy_norms.tied_rate(rho_min, rho):.3f}",
                ),
                Line(
                    "steps to 1e-9 at a factor q",
                    r"-9\,\ln 10/\ln q",
                    f"q = {rate:.3f}: {ceil(9 * log(10) / -log(rate))}",
                ),
            ],
        ),
        Part(
            "What does one run say?",
            "At a fixed theta the residual changes by the ratio r in each step, steadily. With open nodes r may be "
            "1 - theta, and then nothing follows.",
            [
                Line(
                    "factor of a mode with ratio lambda",
                    r"1 - \theta (1 + \lambda)",
                    f"theta = {LARGE}, lambda = {rho:.3f}: {1 - LARGE * (1 + rho):.3f}",
                ),
                Line(
                    "no friction, or tied bodies: the residual changes its sign",
                    r"\rho \geq (1 + r)/\theta - 1",
                    f"theta = {LARGE}, r = {high:.3f}: {(1 + high) / LARGE - 1:.3f}",
                ),
                Line(
                    "tied bodies only: the residual keeps its sign",
                    r"\rho_{\min} \leq (1 - r)/\theta - 1",
                    f"theta = {SMALL}, r = {low:.3f}: {(1 - low) / SMALL - 1:.3f}",
                ),
            ],
        ),
        Part(
            "How much friction?",
            "The theorem in energy norms; k is the friction coefficient, and the values are those at k = 0.2.",
            [
                Line(
                    "how friction enters",
                    r"\kappa_1 = k C_s C_{t1},\ \kappa_2 = k C_s C_{t2}",
                    "{:.3f}, {:.3f}".format(*kappas),
                ),
                Line(
                    "every small theta contracts if", r"\kappa_2 + \kappa_1^2/4 < 1", f"{number:.2f}: k < {every:.3f}"
                ),
                Line(
                    "for rho at most 1, some theta contracts if",
                    r"\frac{\rho}{1 + \rho} \left(\kappa_2 + \frac{\kappa_1}{\sqrt{\rho}}\right) < 1",
                    f"k < {some:.3f}",
                ),
            ],
        ),
    ]


def page() -> str:
    """The sheet as Markdown."""
    text = [
        "# One coupling on one page",
        "The formulas that a coupling needs, with the values of the {term}`plates of Section 6` as an example.\n"
        "{download}`The same as a PDF of one page <cheat_sheet.pdf>`.",
    ]
    for part in parts():
        rows = [f"| {line.question} | ${line.formula}$ | {line.example} |" for line in part.lines]
        text += [
            f"## {part.title}",
            part.words,
            "\n".join(["| quantity | formula | example |", "|---|---|---|", *rows]),
        ]
    text.append(
        "{doc}`/examples/which_side` derives rho and theta, {doc}`/energy` proves the thresholds of friction,\n"
        "{doc}`/coupling` reads logs. The commands are `ndtheory advise` and `ndtheory bounds --rho`."
    )
    return "\n\n".join(text) + "\n"


def drawn() -> Figure:
    """The sheet on one page of A4."""
    figure = Figure(figsize=(8.27, 11.69))
    write = lambda x, y, words, **how: figure.text(x, y, words, va="top", **how)
    write(0.07, 0.96, "One coupling on one page", fontsize=18, weight="bold")
    y = 0.915
    for part in parts():
        write(0.07, y, part.title, fontsize=13, weight="bold")
        words = fill(part.words, 100)
        write(0.07, y - 0.024, words, fontsize=9)
        y -= 0.054 + 0.013 * words.count("\n")
        for line in part.lines:
            question, formula = fill(line.question, 50), line.formula.replace(r"^\top", "^T")
            write(0.09, y, question, fontsize=9)
            write(0.47, y, f"${formula}$", fontsize=11)
            write(0.70, y, line.example, fontsize=9)
            y -= 0.027 + 0.009 * question.count("\n")
        y -= 0.018
    write(0.07, y, "Example: the plates of Section 6, Neumann problem on the lower one, k = 0.2.", fontsize=8)
    return figure


def write(folder: Path) -> None:
    """Write the page and the PDF."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "cheat_sheet.md").write_text(page(), encoding="utf-8")
    with style.styled():
        drawn().savefig(folder / "cheat_sheet.pdf", metadata={"Creator": "ndtheory", "CreationDate": None})
