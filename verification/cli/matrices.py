"""``advise`` from matrices: the options, and the files behind them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ndtheory import HypothesisError, exact

if TYPE_CHECKING:
    from verification.advice.roles import Advice
    from verification.progress import Progress

_FILES = {
    "--S1": "Interface stiffness of body 1: .npy, .npz, .mtx, .mat, .csv or .txt; one file may hold both, by name.",
    "--S2": "Interface stiffness of body 2.",
    "--map": "Transfer P from the unknowns or nodes of the Neumann body to those of the contact body: P.npz of a run.",
    "--x": "Positions of the nodes of the contact body, increasing.",
    "--kernel": "Operator S of the law of friction: normal nodal forces of the Neumann body to stress at these nodes.",
    "--weights": "Weights of the quadrature on these nodes; those of the trapezoid rule by default.",
}
_NUMBERS = {"--radius": ("LENGTH", "Radius of the hat kernel, in the unit of --x.")}

#: Names of the options as parameters of the command.
NAMES = {"--S1": "S1", "--S2": "S2", "--map": "transfer", "--neumann-body": "neumann_body"} | {
    option: option[2:] for option in ("--x", "--kernel", "--weights", "--friction", "--radius")
}


def matrix_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of matrices to a command."""
    made = [
        click.option(option, NAMES[option], type=click.Path(path_type=Path), metavar="MATRIX", help=words)
        for option, words in _FILES.items()
    ]
    made += [
        click.option(option, NAMES[option], metavar=metavar, help=words)
        for option, (metavar, words) in _NUMBERS.items()
    ]
    rubs = (
        "Friction k >= 0 of matrices, with --x and --radius, or with --kernel and --weights or --x; of runs and logs "
    )
    rubs += "there is some: no number is needed, and the advice gives bounds and the run to make next."
    made.append(click.option("--friction", "friction", metavar="[k]", help=rubs))
    body = "From whose unknowns --map leads, where its shape fits both ways."
    made.append(click.option("--neumann-body", "neumann_body", type=click.Choice(["1", "2"]), help=body))
    for option in reversed(made):
        command = option(command)
    return command


def some_friction(given: str | None) -> bool:
    """True if ``--friction`` says that runs have friction: without a number, or with one above 0.

    Raises
    ------
    click.UsageError
        A number below 0, or none.
    """
    try:
        k = exact(given) if given else None
    except ValueError:
        k = Fraction(-1)
    if k is not None and not k >= 0:
        needed = "needed no number, or k >= 0; of runs and logs it says that there is friction"
        raise click.UsageError(f"--friction = {given}: {needed}", click.get_current_context())
    return given is not None and k != 0


def advice_from_files(given: Mapping[str, Any], tell: Progress, *, tied: bool) -> Advice:
    """The advice that the options ask for.

    Parameters
    ----------
    given : mapping
        The options that were given, by the names of their parameters.
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
    S1, S2 = given.get("S1"), given.get("S2")
    others = [option for option, name in NAMES.items() if name in given and name not in ("S1", "S2")]
    if given.get("friction") == "":
        raise click.UsageError("received --friction without a number: matrices need one, as --friction 0.2", context)
    if S1 is None:
        received = " with ".join(["--S2"] * (S2 is not None) + others)
        raise click.UsageError(f"received {received} without --S1: needed both --S1 and --S2", context)
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
    if "radius" in given:
        values["radius"] = _radius(given["radius"], context)
    if "neumann_body" in given:
        values["neumann_body"] = int(given["neumann_body"])
    files = ", ".join(dict.fromkeys(str(value) for value in given.values() if isinstance(value, Path)))
    try:
        return advise_matrices(**values, friction=given.get("friction"), tied=tied, progress=tell)
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


def _radius(text: str, context: click.Context) -> float:
    try:
        radius = float(exact(text))
    except (ValueError, OverflowError):
        radius = 0.0
    if not 0 < radius < float("inf"):
        raise click.UsageError(f"--radius = {text}: needed a number > 0", context)
    return radius
