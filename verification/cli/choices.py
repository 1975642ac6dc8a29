"""The commands advise and region: which roles and theta, and where contraction is proved."""

from __future__ import annotations

import re
from itertools import zip_longest
from pathlib import Path
from typing import Any

import click

from ndtheory import HypothesisError
from verification.advice.snippets import SNIPPETS
from verification.cli.console import Interrupted, complain, deliver, stages
from verification.cli.matrices import NAMES as OF_MATRICES
from verification.cli.matrices import advice_from_files, matrix_options, some_friction
from verification.cli.moduli import NAMES as OF_MODULI
from verification.cli.moduli import advice_from_moduli, moduli_options, of_moduli
from verification.cli.problems import FILE, JSON, SET, load_problem
from verification.cli.sweeping import STORE
from verification.cli.typed import Typed


class _Advise(click.Command):
    """The command with ``--friction``, which runs and logs need no number for: it is empty then."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        given: list[str] = []
        for word, after in zip_longest(args, args[1:], fillvalue="-"):
            given.append(word)
            if word == "--friction" and re.match(r"-(?![\d.])", after):
                given.append("")
        return super().parse_args(ctx, given)


@click.command(cls=_Advise)
@click.argument("file", type=click.Path(path_type=Path), required=False)
@SET
@matrix_options
@click.option(
    "--log",
    "logs",
    metavar="LOG",
    type=click.Path(path_type=Path),
    multiple=True,
    help="Convergence log of a run of any code, as precice-Solid-convergence.log; may be repeated with its --theta.",
)
@click.option(
    "--theta",
    "thetas",
    metavar="NUMBER",
    multiple=True,
    help="Relaxation factor of a run of any code, 0 < theta <= 1; of several logs one each, in their order.",
)
@click.option(
    "--ratio",
    metavar="NUMBER",
    help="Ratio of its residual |Tg - g|, absolute and unrelaxed, from one step to the next, steady over 10 or more; "
    "1 where it rises and falls.",
)
@moduli_options
@click.option("--tied", is_flag=True, help="Advise by what holds where nothing opens or slips.")
@click.option(
    "--snippets",
    type=click.Choice([*SNIPPETS, "all"], case_sensitive=False),
    help="Print whole blocks for the configuration of a coupling library instead, serial coupling.",
)
@JSON
def advise(
    file: Path | None,
    keys: dict[str, str],
    logs: tuple[Path, ...],
    thetas: tuple[str, ...],
    ratio: str | None,
    tied: bool,
    snippets: str | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Which body gets the Neumann problem, and which theta?

    Give a problem FILE, or the interface.npz that a run has written; or the Schur complements of both bodies on the
    same interface unknowns (force per displacement, any units), with a map between grids and with friction if there
    are such: then vectors list all tangential components from left to right, then all normal ones; or runs of any
    other code with constant theta, as logs or as the ratio of their residuals: what these can mean, and which theta to
    run next.  Without --friction these are read as runs without friction.  Give the ratio of the absolute residual
    |Tg - g|, not of the relative one of coupling libraries; a log may hold either.  Before there is a mesh, the moduli
    of both bodies alone bound rho from below.

    In a transient the matrices are those of K + c M/dt^2 (c = 1/beta of Newmark's method): give these as --S1 and --S2,
    since the better role may change with dt.

    \b
    Examples:
      ndtheory advise my.toml
      ndtheory advise my.toml --set contact.friction=0.4
      ndtheory advise results/interface.npz
      ndtheory advise --S1 a.npz --S2 b.mtx
      ndtheory advise --S1 both.mat --map P.npz
      ndtheory advise --S1 a.npz --S2 b.npz --friction 0.2 --x x.npy --radius 0.1
      ndtheory advise my.toml --tied
      ndtheory advise my.toml --snippets preCICE
      ndtheory advise --theta 0.1 --ratio 1.4
      ndtheory advise --log precice-Solid-convergence.log --theta 0.5
      ndtheory advise --log a.log --theta 0.3 --log b.log --theta 0.6
      ndtheory advise --log a.log --theta 0.3 --friction
      ndtheory advise --young 70000,20000 --poisson 0.3,0.3
    """
    context = click.get_current_context()
    theta = thetas[0] if thetas else None
    matrices, moduli = (
        {name: options[name] for name in names.values() if options[name] not in (None, False)}
        for names in (OF_MATRICES, OF_MODULI)
    )
    rubs = matrices.pop("friction", None) if logs or ratio is not None else None
    forms: dict[str, list[Any]] = {
        "FILE": [file],
        "--S1 and --S2": [matrices or None],
        "--theta and --ratio": [theta, ratio],
        of_moduli(moduli): [moduli or None],
    }
    if logs:
        if ratio is not None:
            raise click.UsageError("received --log with --ratio: a log shows its own ratio", context)
        forms["--log and --theta"] = [logs, forms.pop("--theta and --ratio")[0]]
    given = [name for name, values in forms.items() if any(value is not None for value in values)]
    if len(given) != 1:
        received = " with ".join(given) or "nothing"
        known = ["FILE", "--S1 and --S2", "--theta and --ratio", "--log and --theta", "--young and --poisson"]
        raise click.UsageError(f"received {received}: needed one of {', '.join(known)}", context)
    if any(value is None for value in forms[given[0]]):
        raise click.UsageError(f"needed both {given[0]}", context)
    if len(thetas) != max(len(logs), 1) and thetas:
        received = f"received {len(thetas)} --theta with {len(logs)} --log"
        raise click.UsageError(f"{received}: needed one --theta for each log, or one with --ratio", context)
    if keys and file is None:
        raise click.UsageError("received --set without FILE: it sets a key of a problem file", context)
    if snippets is not None and as_json:
        raise click.UsageError("received --snippets with --json: a block to paste is no JSON document", context)
    if tied and moduli:
        raise click.UsageError(
            "received --tied with --young: moduli bound both ends of the spectrum from inside", context
        )
    friction = some_friction(rubs)
    if tied and friction:
        raise click.UsageError("received --tied with --friction: nothing slips on a tied interface", context)
    from verification.advice import roles as advice
    from verification.cli import advice_screen

    if file is not None:
        if file.suffix == ".npz" and keys:
            raise click.UsageError(f"received --set with {file}: it sets a key of a problem file", context)
        problem = file if file.suffix == ".npz" else load_problem(file, keys)
        with stages() as tell:
            found = advice.advise(problem, tied=tied, progress=tell)
    elif matrices:
        with stages() as tell:
            found = advice_from_files(matrices, tell, tied=tied)
    elif moduli:
        found = advice_from_moduli(moduli)
    else:
        try:
            from verification.advice.from_logs import advise_logs
            from verification.advice.from_runs import advise_run

            of_logs = zip(logs, thetas, strict=True)
            assumed = {"tied": tied, "friction": friction}
            if logs:
                found = advise_logs(of_logs, **assumed)
            else:
                assert theta is not None
                assert ratio is not None
                found = advise_run(theta, ratio, **assumed)
        except HypothesisError as error:
            raise click.UsageError(f"--{error}", context) from None
    typed = None if file is None else Typed(file=file, keys=keys)
    if snippets is not None and found.theta is not None:
        show = lambda: advice_screen.snippets(found, snippets)
    else:
        show = lambda: advice_screen.advice(found, typed)
    deliver(found, show, as_json)
    if snippets is not None and found.theta is None:
        why = "several readings are left" if found.friction_bounds is None else "with friction no run decides theta"
        complain(f"no snippet: {why}, make the run that is named")


def _picture(context: click.Context, parameter: click.Parameter, value: Path) -> Path:
    if value.suffix not in (".svg", ".png"):
        raise click.BadParameter(f"{str(value)!r}: needed a name ending in .svg or .png", context, parameter)
    return value


@click.command()
@FILE
@SET
@click.option(
    "-o",
    "--output",
    "target",
    type=click.Path(path_type=Path),
    callback=_picture,
    required=True,
    metavar="PICTURE",
    help="Where to draw it: a name ending in .svg or .png.",
)
@STORE
@JSON
def region(file: Path, keys: dict[str, str], target: Path, store: Path | None, as_json: bool) -> None:
    """Draw the plane of theta and k: where one step is proved to contract, and what runs do there.

    Both axes are logarithmic; theta and k have no unit.  The regions are those of the printed, the repaired, the energy
    and the semidefinite bound for the bodies of FILE; the points are runs, coloured by outcome.

    \b
    Example:
      ndtheory region my.toml -o plane.svg
      ndtheory region my.toml --set body2.young=7e4 -o stiff.svg
    """
    from verification import figures
    from verification.bounds.region import chart
    from verification.cli import screens
    from verification.output.files import check_ours, staged
    from verification.problem.tables import ProblemError

    problem = load_problem(file, keys)
    if not target.parent.is_dir():
        raise ProblemError(str(target), "", None, "needed a name in a folder that exists (-o)")
    check_ours(target)
    with stages() as tell:
        plane = chart(problem, store=store, progress=tell)
    deliver(plane, lambda: screens.plane(plane, target), as_json)
    with stages() as tell, staged(target.parent, shown=target) as room:
        tell("drawing", None)
        figures.save(figures.draw_region(plane), room / target.name)
    if plane.interrupted:
        complain(f"{plane.reason['points']}: what was computed is drawn")
        raise Interrupted
