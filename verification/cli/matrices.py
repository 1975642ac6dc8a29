"""``advise matrices``: the files behind it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ndtheory import HypothesisError

if TYPE_CHECKING:
    from verification.advice.roles import Advice
    from verification.progress import Progress


def advice_from_files(given: Mapping[str, Any], tell: Progress, *, tied: bool) -> Advice:
    """The advice that the options ask for.

    Parameters
    ----------
    given : mapping
        The options that were given, by the names of their parameters; S1 is one of them.
    tell : callable
    tied : bool
        ``--tied``.

    Raises
    ------
    ProblemError, click.UsageError
    """
    from verification.advice.from_matrices import advise_matrices
    from verification.advice.matrix_files import is_interface, names_in, read_matrix
    from verification.advice.roles import advise

    context = click.get_current_context()
    S1, S2 = given["S1"], given.get("S2")
    options = {parameter.name: parameter.opts[0] for parameter in context.command.params}
    others = [option for name, option in options.items() if name in given and name not in ("S1", "S2")]
    if S2 in (None, S1) and is_interface(S1):
        if others:
            raise click.UsageError(f"received {others[0]} with {S1}: an interface file has all of it", context)
        return advise(S1, tied=tied, progress=tell)
    if S2 is None:
        held = names_in(S1)
        if not {"S1", "S2"} <= set(held):
            raise click.UsageError(f"{S1}: needed both --S1 and --S2, or one file with arrays S1 and S2", context)
        S2 = S1
    if S1 == S2 and set(names_in(S1)).intersection(("S1", "S2")) == {"S1"}:
        raise click.UsageError(f"{S1}: needed arrays S1 and S2 for --S2 as well, received S1 alone", context)
    values: dict[str, Any] = {"S1": read_matrix(S1, "S1"), "S2": read_matrix(S2, "S2")}
    for name in ("transfer", "x", "kernel", "weights"):
        if name in given:
            values[name] = read_matrix(given[name], "P" if name == "transfer" else name)
    for name in ("x", "weights"):
        if name in values and values[name].size == max(values[name].shape, default=0):
            values[name] = values[name].ravel()  # one row or one column
    if "transfer" in given and "friction" in given:
        values |= _grids(given["transfer"], given)
    values |= {name: given[name] for name in ("radius", "friction") if name in given}
    if "neumann_body" in given:
        values["neumann_body"] = int(given["neumann_body"])
    files = ", ".join(dict.fromkeys(str(value) for value in given.values() if isinstance(value, Path)))
    try:
        return advise_matrices(**values, tied=tied, progress=tell)
    except (ValueError, MemoryError) as error:
        of_option = isinstance(error, HypothesisError) and error.key == "friction"
        raise click.UsageError(f"--{error}" if of_option else f"{files}: {error}", context) from None


def _grids(transfer: Path, given: Mapping[str, Any]) -> dict[str, Any]:
    """The positions and weights of both grids, where the file of the transfer has them and no option gives them."""
    from verification.advice.matrix_files import names_in, read_array

    held = set(names_in(transfer))
    wanted = {"x_neumann": "x_neumann", "x": "x_contact", "weights": "weights_contact"}
    if "radius" not in given:
        del wanted["x_neumann"]
    return {name: read_array(transfer, of) for name, of in wanted.items() if of in held and name not in given}
