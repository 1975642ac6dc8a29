"""The loss in each inequality of the proof, in powers of ten."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ndtheory.statements import statements
from verification.bounds.losses import Loss, Losses
from verification.bounds.table import Printed, Repaired
from verification.figures.style import STATES, new_figure, norm, styled

#: The change of T in the energy norm.
CHANGE = norm(r"T\psi-T\tilde\psi")

#: The inequalities between squares of norms.
SQUARED = ("(5.29)", "(5.38)")


def draw_waterfall(losses: Losses, unit: str) -> Figure:
    """Each inequality by itself, then the steps from the largest quantity found to its bound, added up.

    The step from the repaired to the printed bound depends only on ``unit``, the unit of stress.
    """
    chains = [
        ("each inequality by itself", losses.links),
        (
            f"from the largest friction term found to its bound (5.30), repaired, then printed in {unit}",
            losses.friction,
        ),
        ("from the largest CHANGE found to its bound (5.38)", losses.lipschitz),
    ]
    chains = [(title, chain) for title, chain in chains if chain]
    with styled():
        figure = new_figure(9.0, 0.7 + 0.32 * sum(len(chain) + 2 for _, chain in chains))
        shares = [len(chain) + 1 for _, chain in chains]
        axes = figure.subplots(len(chains), 1, squeeze=False, height_ratios=shares)[:, 0]
        for ax, (title, chain) in zip(axes, chains, strict=True):
            _draw(ax, title, chain, adds_up=chain is not losses.links)
    return figure


def _draw(ax: Axes, title: str, chain: Sequence[Loss], *, adds_up: bool) -> None:
    begin, farthest = 0.0, 0.0
    for i, loss in enumerate(chain):
        edition, hatch = (Printed, Printed.hatch) if loss.only_unit else (Repaired, None)
        ax.barh(i, loss.decades, left=begin, color=edition.colour, hatch=hatch, edgecolor="black", linewidth=0.5)
        end = begin + loss.decades
        farthest = max(farthest, end)
        says = f" {loss.decades:.1f}" + (", only the unit" if loss.only_unit else "")
        if loss.label in SQUARED:
            says += f" = 2 × {loss.decades / 2:.1f} (squared)"
        ax.text(max(begin, end), i, says, va="center")
        begin = end if adds_up else 0.0
    labels = [_in_words(loss.label) for loss in chain]
    if adds_up:
        ax.barh(len(chain), begin, color=STATES["open"], edgecolor="black", linewidth=0.5)
        ax.text(begin, len(chain), f" {begin:.1f}", va="center")
        labels.append("in all")
    ax.set_yticks(range(len(labels)), labels)
    ax.invert_yaxis()
    ax.set_xlim(right=1.12 * farthest)
    ax.set(xlabel="powers of ten lost", title=fill(title, 64).replace("CHANGE", CHANGE))


def _in_words(label: str) -> str:
    """The label of an inequality with the title of its statement, if it is one of the paper's."""
    statement = statements().get(label.strip("()"))
    return label.replace("m~", r"$\tilde m$") if statement is None else f"{statement.title} {label}"
