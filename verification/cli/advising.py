"""The four commands of advise: from a problem, from matrices, from runs of other codes, from material data."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import click
from click.shell_completion import CompletionItem

from ndtheory import HypothesisError, exact
from ndtheory.texts import did_you_mean
from verification.cli.console import complain, deliver, stages
from verification.cli.forms import AdviseCommand, AdviseGroup, Default, cli
from verification.cli.options import JSON, PATH, SET, SWAP, F, OneOf, Typed, number
from verification.cli.problems import load_problem
from verification.coupling.kinds import Kind, KindName, kind_of
from verification.coupling.snippets import SNIPPETS
from verification.show.layout import nothing_typed

if TYPE_CHECKING:
    from verification.coupling.advice import Advice
    from verification.machine.progress import Progress


def advice_from_files(given: Mapping[str, Any], tell: Progress, *, kind: Kind) -> Advice:
    """The advice from the options of ``advise matrices`` that were given, S1 among them, by parameter."""
    from verification.coupling.from_matrices import advise_matrices
    from verification.coupling.from_problems import advise
    from verification.coupling.matrix_files import names_in, read_matrix, read_vector
    from verification.interface.files import NEEDED

    S1, S2 = given["S1"], given.get("S2")
    options = {parameter.name: parameter.opts[0] for parameter in click.get_current_context().command.params}
    others = [option for name, option in options.items() if name in given and name not in ("S1", "S2")]
    held = set(names_in(S1)) if S2 in (None, S1) else set()
    if set(NEEDED) <= held:
        if others:
            raise click.UsageError(f"received {others[0]} with {S1}: an interface file has all of it")
        if kind.parallel or not kind.signed:
            needed = "an interface file is of two bodies in serial coupling, which are tied or in contact"
            raise click.UsageError(f"received {kind.typed}with {S1}: {needed}")
        return advise(S1, tied=kind.linear, progress=tell)
    if S2 is None and not {"S1", "S2"} <= held:
        raise click.UsageError(f"{S1}: needed both --S1 and --S2, or one file with arrays S1 and S2")
    if held & {"S1", "S2"} == {"S1"}:
        raise click.UsageError(f"{S1}: needed arrays S1 and S2 for --S2 as well, received S1 alone")
    values: dict[str, Any] = {"S1": read_matrix(S1, "S1"), "S2": read_matrix(S2 or S1, "S2")}
    reads = {"transfer": read_matrix, "kernel": read_matrix, "x": read_vector, "weights": read_vector}
    for name, read in reads.items():
        if name in given:
            values[name] = read(given[name], "P" if name == "transfer" else name)
    if "transfer" in given and "friction" in given:
        values |= _grids(given["transfer"], given)
    values |= {"friction": given["friction"]} if "friction" in given else {}
    values |= {"radius": float(exact(given["radius"]))} if "radius" in given else {}
    if "neumann_body" in given:
        values["neumann_body"] = int(given["neumann_body"])
    files = ", ".join(dict.fromkeys(str(value) for value in given.values() if isinstance(value, Path)))
    try:
        return advise_matrices(**values, kind=kind, progress=tell)
    except (ValueError, MemoryError) as error:
        of_option = isinstance(error, HypothesisError) and error.key == "friction"
        raise click.UsageError(f"--{error}" if of_option else f"{files}: {error}") from None


def _grids(transfer: Path, given: Mapping[str, Any]) -> dict[str, Any]:
    """The positions and weights of both grids, where the file of the transfer has them and no option gives them."""
    from verification.coupling.matrix_files import names_in, read_vector

    held = set(names_in(transfer))
    wanted = {"x_neumann": "x_neumann", "x": "x_contact", "weights": "weights_contact"}
    if "radius" not in given:
        del wanted["x_neumann"]
    return {name: read_vector(transfer, of) for name, of in wanted.items() if of in held and name not in given}


TIED = click.option("--tied", is_flag=True, help="Nothing opens or slips: tied bodies, heat, a fluid at a wall.")


def of_kind(command: Callable[..., None], *, general: bool = True) -> Callable[..., None]:
    """The options that say of which kind a coupling is, as one parameter ``kind``, ``general`` if that may be."""

    @click.option(
        "--kind",
        type=OneOf(get_args(KindName)[: 2 + general]),
        help="Kind of coupling: " + "general may have positive feedback; " * general + "by default contact.",
    )
    @TIED
    @click.option("--parallel", is_flag=True, help="Parallel coupling: both solvers run at once.")
    @wraps(command)
    def typed(kind: str | None, tied: bool, parallel: bool, **given: Any) -> None:
        try:
            of = kind_of(kind, tied=tied, parallel=parallel)
        except ValueError as error:
            raise click.UsageError(str(error)) from None
        if parallel and given.get("snippets"):
            raise click.UsageError("received --snippets with --parallel: the blocks are for serial coupling")
        command(kind=of, **given)

    return typed


SNIPPETS_OF = click.option(
    "--snippets",
    type=OneOf([*SNIPPETS, "all"], case_sensitive=False),
    help="Print whole blocks for the configuration of a coupling library instead; only for serial coupling.",
)


def _words(context: click.Context, parameter: click.Parameter, begun: str) -> list[CompletionItem]:
    return advise.complete(context, parameter, begun)


@click.command("advise", cls=Default)
@click.argument("file", type=PATH, shell_complete=_words)
@SET
@SWAP
@TIED
@SNIPPETS_OF
@JSON
def of_file(file: Path, keys: dict[str, str], swap: bool, tied: bool, snippets: str | None, as_json: bool) -> None:
    """Choose the body that gets the Neumann problem, and theta.

    The advice is for two solvers coupled along an interface: elastic contact, tied bodies, heat (temperature and flux),
    and a fluid with a structure (FSI, added mass).

    FILE is a problem file, or the interface.npz that a run has written.  The answer compares both assignments of the
    roles by theta (no unit) and the factor of a step, predicted and proved.  It has lines to paste for your library.

    The commands below need no problem file; two solvers that are Python functions are coupled by verification.couple.
    For a file named like a command, such as run, type ./run.

    \b
    Examples:
      ndtheory advise my.toml
      ndtheory advise run --log precice-Solid-convergence.log --theta 0.5
      ndtheory advise moduli --conductivity 50,0.5
      ndtheory advise my.toml --set contact.friction=0.4
      ndtheory advise my.toml --snippets preCICE
      ndtheory advise results/interface.npz
    """
    _no_document_of(snippets, as_json)
    meant = "" if file.suffix else did_you_mean(str(file), advise.commands)
    if meant and not file.exists():
        raise click.UsageError(f"{file}: no such file, and no command{meant}")
    changed = [option for option, given in (("--set", keys), ("--swap-roles", swap)) if given]
    if file.suffix == ".npz" and changed:
        raise click.UsageError(f"received {changed[0]} with {file}: it changes a problem file")
    if file.suffix in (".log", ".csv", ".dat"):
        raise click.UsageError(f"{file}: for a log type ndtheory advise run --log {file} --theta X")
    problem = file if file.suffix == ".npz" else load_problem(file, keys, swap=swap)
    from verification.coupling import from_problems

    with stages() as tell:
        found = from_problems.advise(problem, tied=tied, progress=tell)
    _show(found, snippets, as_json, Typed(file=file, keys=keys, swap=swap))


def _matrix(option: str, parameter: str, words: str, **settings: Any) -> Callable[[F], F]:
    """An option that names a file with a matrix."""
    return click.option(option, parameter, type=PATH, metavar="MATRIX", help=words, **settings)


@click.command(cls=AdviseCommand)
@_matrix("--S1", "S1", "Interface stiffness of body 1, or one file with S1 and S2.", required=True)
@_matrix("--S2", "S2", "Interface stiffness of body 2.")
@_matrix("--map", "transfer", "Transfer P, from the Neumann body's unknowns or nodes to the contact body's.")
@click.option(
    "--neumann-body", type=OneOf(["1", "2"]), help="Body from whose unknowns --map leads, if its shape fits both ways."
)
@of_kind
@click.option(
    "--friction",
    metavar="K",
    callback=number("a number >= 0, such as --friction 0.2", lambda k: k >= 0),
    help="Friction k >= 0, with --x and --radius, or with --kernel and --weights or --x.",
)
@_matrix("--x", "x", "Positions of the nodes of the contact body, increasing.")
@click.option(
    "--radius",
    metavar="LENGTH",
    callback=number("a number > 0", lambda radius: float(radius) > 0),
    help="Radius of the hat kernel, in the unit of --x.",
)
@_matrix("--kernel", "kernel", "Operator S of the law of friction: normal nodal forces to stress at these nodes.")
@_matrix("--weights", "weights", "Weights of the quadrature on these nodes; by default the trapezoid rule.")
@SNIPPETS_OF
@JSON
def matrices(kind: Kind, snippets: str | None, as_json: bool, **given: Any) -> None:
    """Advice from the interface stiffnesses of any code.

    S1 and S2 are the Schur complements of both bodies on the same interface unknowns, or on two grids with a --map.
    They are forces per displacement, in any one unit.  MATRIX is a file .npy, .npz, .mtx, .mat, .csv or .txt.  P.npz of
    a run is a --map, with the positions and weights of both grids.  With friction or a map, vectors list all tangential
    components from left to right, then all normal ones.

    In a transient the matrices are those of K + c M/dt^2 (c = 1/beta of Newmark's method): the better role may change
    with dt.

    \b
    Examples:
      ndtheory advise matrices --S1 a.npz --S2 b.mtx
      ndtheory advise matrices --S1 both.mat --map P.npz
      ndtheory advise matrices --S1 a.npz --S2 b.npz --tied
      ndtheory advise matrices --S1 a.npz --S2 b.npz --friction 0.2 \\
        --x x.npy --radius 0.1
    """
    _no_document_of(snippets, as_json)
    with stages() as tell:
        found = advice_from_files({name: value for name, value in given.items() if value is not None}, tell, kind=kind)
    _show(found, snippets, as_json)


@click.command(cls=AdviseCommand)
@click.option(
    "--log",
    "logs",
    metavar="FILE",
    type=PATH,
    multiple=True,
    help="Convergence log, such as precice-Solid-convergence.log; repeat it with the --theta of each.",
)
@click.option(
    "--theta",
    "thetas",
    metavar="NUMBER",
    multiple=True,
    help="Relaxation factor of the run, 0 < theta <= 1 (100 of kind general).  Give one for each log, in their order, "
    "or none if every log names its factor or is of Aitken or quasi-Newton.",
)
@click.option(
    "--ratio",
    "ratios",
    metavar="NUMBER",
    multiple=True,
    help="Ratio of the absolute, unrelaxed residuals |Tg - g| of successive steps, steady over 10 or more; 1 if they "
    "rise and fall.  Of kind general give one for each run, with its --theta.",
)
@click.option(
    "--pattern",
    metavar="REGEX",
    help="Regular expression for the lines of another log: its one group is the residual, or its groups are named "
    "residual, iteration, theta and omega (of Aitken).",
)
@click.option("--format", "name", metavar="NAME", help="Format of the logs if it is not recognised, such as SU2.")
@click.option("--log10", is_flag=True, help="The residuals are decimal logarithms, as those of SU2 are.")
@click.option("--friction", is_flag=True, help="There is friction; the answer has bounds and the next run.")
@of_kind
@SNIPPETS_OF
@JSON
def run(
    logs: tuple[Path, ...],
    thetas: tuple[str, ...],
    ratios: tuple[str, ...],
    pattern: str | None,
    name: str | None,
    log10: bool,
    friction: bool,
    kind: Kind,
    snippets: str | None,
    as_json: bool,
) -> None:
    """Bound rho from runs of any other code.

    Give runs with constant theta (no unit), as logs or as the ratio of the residuals of one run.  The answer lists the
    values of rho that fit, and which theta to run next.  Aitken's factors in a log show both ends of the spectrum.
    Without --friction the answer assumes that there is none.  Give the ratio of the absolute residual |Tg - g|, not of
    the relative one of coupling libraries; a log may hold either, in any unit.

    Logs may be of preCICE, Kratos, solids4foam, FOAM-FSI, Norma.jl, Feel++, MOOSE, CoCoNuT, OpenMDAO, Elmer, GEOS and
    SU2, columns of numbers, or others with a --pattern.

    \b
    Examples:
      ndtheory advise run --theta 0.1 --ratio 1.4
      ndtheory advise run --log precice-Solid-convergence.log --theta 0.5
      ndtheory advise run --log a.log --theta 0.3 --log b.log --theta 0.6
      ndtheory advise run --log a.log --theta 0.3 --friction
      ndtheory advise run --kind general --theta 1 --ratio 0.885
      ndtheory advise run --log out.txt --theta 0.5 --pattern 'res = (\\S+)'
    """
    _no_document_of(snippets, as_json)
    if bool(logs) == bool(ratios):
        received = "--log with --ratio" if logs else "neither --log nor --ratio"
        raise click.UsageError(f"received {received}: needed one of them; the ratio of a log is read from it")
    of_logs = {"--pattern": pattern, "--format": name, "--log10": log10}
    if not logs and (alone := [option for option, value in of_logs.items() if value]):
        raise click.UsageError(f"received {alone[0]} without --log")
    if pattern is not None and name is not None:
        raise click.UsageError("received --pattern with --format: needed one of them")
    if len(ratios) > 1 and kind.signed:
        needed = "needed one, or the --log of each; several ratios are of --kind general"
        raise click.UsageError(f"received {len(ratios)} --ratio: {needed}")
    try:
        kind.assumes(friction)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    from verification.coupling.from_logs import advise_logs
    from verification.coupling.from_runs import advise_run
    from verification.coupling.log_lines import PatternError

    try:
        form: dict[str, Any] = {"pattern": pattern, "log10": log10}
        given = _thetas_of(logs, thetas, {**form, "name": name})
        if len(given) != max(len(logs), len(ratios)):
            received = f"received {len(thetas)} --theta with {len(logs)} --log and {len(ratios)} --ratio"
            raise click.UsageError(f"{received}: needed one --theta for each of them")
        if logs:
            found = advise_logs(zip(logs, given, strict=True), kind=kind, friction=friction, format=name, **form)
        else:
            *earlier, last = zip(thetas, ratios, strict=True)
            found = advise_run(*last, kind=kind, friction=friction, earlier=earlier)
    except PatternError as error:
        what = f"--format = {name}" if pattern is None else f"--pattern = {pattern}"
        raise click.UsageError(f"{what}: {error}") from None
    except HypothesisError as error:
        raise click.UsageError(f"--{error}") from None
    _show(found, snippets, as_json)


def _thetas_of(logs: Sequence[Path], thetas: Sequence[str], form: Mapping[str, Any]) -> Sequence[str | None]:
    """The theta of each log; fewer than logs are for those that need one, then for the last that name their factor."""
    if not thetas or len(thetas) >= len(logs):
        return thetas or (None,) * len(logs)
    from verification.coupling.log_files import read_log

    read = [read_log(path, **form) for path in logs]
    needy = [k for k, log in enumerate(read) if log.needs_theta]
    naming = [k for k, log in enumerate(read) if log.accelerator is None and not log.needs_theta]
    spare = len(thetas) - len(needy)
    if not 0 <= spare <= len(naming):
        return thetas
    given = dict(zip(sorted([*needy, *naming[len(naming) - spare :]]), thetas, strict=True))
    return [given.get(k) for k in range(len(logs))]


#: Words of --shape, and the parameters of advise_moduli that they set.
SHAPES: dict[str, tuple[str, Any]] = {
    "plane-stress": ("plane", "stress"),
    "3d": ("plane", "3d"),
    "flat": ("flat", True),
    **{f"corners-{name}": ("corners", name) for name in ("none", "1", "2", "both")},
    **{f"mirror-{body}": ("mirror", body) for body in (1, 2)},
}


def _shape(context: click.Context, parameter: click.Parameter, value: str | None) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for word in value.split(",") if value else ():
        if word not in SHAPES:
            needed = f"some of {', '.join(SHAPES)}{did_you_mean(word, SHAPES)}"
            raise click.BadParameter(f"{word}: needed {needed}")
        key, meant = SHAPES[word]
        if found.get(key, meant) != meant and key != "mirror":
            raise click.BadParameter(f"{value}: needed one {key}, received two")
        found[key] = [*found.get(key, ()), meant] if key == "mirror" else meant
    if found.get("flat") and "mirror" not in found:
        raise click.BadParameter(f"{value}: needed mirror-1 or mirror-2 with flat")
    return found


@click.command(cls=AdviseCommand)
@click.option(
    "--young",
    metavar="E1,E2",
    help="Elastic bodies: moduli of bodies 1 and 2, in one unit of stress.  Fluid: E of the wall.",
)
@click.option("--poisson", metavar="NU1,NU2", help="Poisson ratios of bodies 1 and 2, no unit.  Fluid: nu of the wall.")
@click.option(
    "--shape",
    metavar="WORDS",
    callback=_shape,
    help="Elastic bodies, words with commas: plane-stress or 3d; corners-1, -2, -both or -none (the body that ends in "
    "corners of 90 degrees at the ends of Gamma_c); mirror-1 or -2 (the body whose mirror image in a flat Gamma_c, "
    "with its supports, lies inside the other one), and flat (that one is twice as wide as high, its far side held).",
)
@click.option("--conductivity", metavar="K1,K2", help="Heat flow: conductivities of plates 1 and 2.")
@click.option(
    "--film", metavar="H", help="Heat flow: film coefficient of a fluid at a wall; --conductivity of the wall."
)
@click.option(
    "--capacity", metavar="C1,C2", help="Heat flow in time: capacities per volume, density times specific heat."
)
@click.option("--density", metavar="RHO_F,RHO_S", help="A fluid: densities of the fluid and of the wall.")
@click.option(
    "--thickness",
    metavar="D1,D2",
    help="Heat flow: thicknesses of both plates; without it they are thick.  Fluid: of the wall.",
)
@click.option(
    "--length",
    metavar="L or L,R",
    help="A fluid: length of the wall between its ends; of a tube, its length and its radius.",
)
@click.option("--dt", metavar="TIME", help="Heat with a capacity, or fluid: the step in time.")
@partial(of_kind, general=False)
@JSON
def moduli(shape: dict[str, Any], kind: Kind, as_json: bool, **given: str | None) -> None:
    """Bound rho from material data, before there is a mesh.

    Elastic bodies: their moduli bound rho (no unit) from below, in both roles.  A theta to start with is proved only
    where the mirror image of one body fits into the other: say so with --shape.

    Heat: conductivities of two flat plates give theta, or the film coefficient of a fluid with the wall's conductivity.
    Fluid: densities bound rho from below by the added mass of the longest wave.  Units: any, one set for all.

    \b
    Examples, in MPa and in SI units:
      ndtheory advise moduli --young 7e4,2e4 --poisson 0.3,0.3
      ndtheory advise moduli --young 7e4,2e4 --poisson 0.3,0.3 \\
        --shape corners-2,mirror-2,flat
      ndtheory advise moduli --conductivity 50,0.5 --capacity 3.6e6,1.6e6
      ndtheory advise moduli --film 500 --conductivity 0.3 --thickness 0.01
      ndtheory advise moduli --density 1000,1200 --thickness 1e-3 \\
        --length 0.05,0.005
    """
    data: dict[str, Any] = {name: value.split(",") for name, value in given.items() if value is not None}
    if not {"young", "conductivity", "film", "density"} & data.keys():
        received = f"received {f'--{min(data)} alone' if data else 'no material'}"
        raise click.UsageError(f"{received}: needed --young and --poisson, --conductivity, --film or --density")
    from verification.coupling.from_moduli import advise_moduli

    try:
        found = advise_moduli(**data, **shape, kind=kind)
    except HypothesisError as error:
        option = "--shape, " if error.key in ("plane", "corners", "mirror", "flat") else "--"
        raise click.UsageError(f"{option}{error}") from None
    _show(found, None, as_json)


@click.command(cls=AdviseCommand)
@click.argument("iterates", metavar="X", type=PATH)
@click.argument("images", metavar="TX", type=PATH, required=False)
@of_kind
@SNIPPETS_OF
@JSON
def vectors(iterates: Path, images: Path | None, kind: Kind, snippets: str | None, as_json: bool) -> None:
    """Read the spectrum off a few iterates and their images.

    X has a row for each iterate of a run, TX the row that T made of it before relaxation, in any one unit; three to ten
    iterates of a run by any method are enough, all of one step in time.  Files are .npy, .npz (one file with X and TX
    too), .mtx, .mat, .csv or .txt.  The answer has the ends of the spectrum (no unit), theta, and the steps of a
    constant theta, Aitken and IQN-ILS.  With --parallel a row has both fields, one after the other.

    \b
    Examples:
      ndtheory advise vectors X.npy TX.npy
      ndtheory advise vectors run.npz
      ndtheory advise vectors X.npy TX.npy --tied --snippets preCICE
    """
    _no_document_of(snippets, as_json)
    from verification.coupling.from_vectors import advise_vectors
    from verification.coupling.matrix_files import names_in, read_matrix

    if images is None and not {"X", "TX"} <= set(names_in(iterates)):
        raise click.UsageError(f"{iterates}: needed X and TX, or one file with arrays X and TX")
    X, TX = read_matrix(iterates, "X"), read_matrix(images or iterates, "TX")
    try:
        found = advise_vectors(X, TX, kind=kind)
    except ValueError as error:
        files = ", ".join(map(str, dict.fromkeys([iterates, images or iterates])))
        raise click.UsageError(f"{files}: {error}") from None
    _show(found, snippets, as_json)


advise = AdviseGroup(of_file, [matrices, run, moduli, vectors])
cli.add_command(advise)


def _no_document_of(snippets: str | None, as_json: bool) -> None:
    if snippets is not None and as_json:
        raise click.UsageError("received --snippets with --json: a block to paste is no JSON document")


def _show(found: Advice, snippets: str | None, as_json: bool, typed: Typed | None = None) -> None:
    """Show the advice, or the blocks to paste where they were asked for and a theta is advised."""
    from verification.coupling.sections import snippets as blocks
    from verification.document import Document

    if snippets is not None and found.theta is not None:
        if found.theta > 1:
            raise click.UsageError(f"received --snippets where theta = {found.theta:g}: the libraries take at most 1")
        deliver(found, lambda found: blocks(found, snippets), as_json)
        if found.advised_exchanged:
            complain(f"the roles are not exchanged: {found.advised_exchanged}")
    else:
        deliver(found, Document.sections, as_json, typing=nothing_typed if typed is None else typed.command)
    if snippets is not None and found.theta is None:
        complain(f"no snippet: {found.why_no_theta.partition(':')[0]}; make the run that the answer names")
