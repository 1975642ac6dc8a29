"""Commands that read a problem file: example, demo, constants, run, solve, compare."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any, ClassVar

import click

from ndtheory.keys import key
from verification.cli.console import complain, deliver, one_by_one, progress, remember, say, stages, warn
from verification.cli.forms import cli
from verification.cli.options import BOUNDS, FOLDER, FULL, JSON, PATH, RUN, SWAP, Typed, into, number, of_a_file, writer
from verification.document import Document

if TYPE_CHECKING:
    from verification.algorithm.runs import Run
    from verification.comparison import Comparison
    from verification.problem.specification import Problem


def examples() -> dict[str, str]:
    """The built-in problem files by name, as text."""
    from verification.problem.examples import examples as built_in

    return built_in()


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Examples(Document):
    """The built-in problem files: their titles, or one of them, or what files were written."""

    schema: ClassVar[str] = "ndtheory.examples/1"
    units: ClassVar[Mapping[str, str]] = {"length": "see each file", "stress": "see each file"}  # type: ignore[misc]

    examples: Mapping[str, str] | None = key(
        "titles by name", absent="where one was named, and with `--inputs`", default=None
    )
    name: str | None = key("the example that was named", absent="where none was", default=None)
    toml: str | None = key("its text", absent="where none was named", default=None)
    written: Mapping[str, str] | None = key(
        "what the files of `--inputs` hold, by their paths", absent="without `--inputs`", default=None
    )


@cli.command()
@click.argument(
    "name", required=False, shell_complete=lambda at, key, begun: [one for one in examples() if one.startswith(begun)]
)
@click.option(
    "--inputs",
    type=PATH,
    metavar="FOLDER",
    help="Write a file for each command that reads one: problems, a mesh, a sweep, matrices, vectors, a log of a run.",
)
@JSON
def example(name: str | None, inputs: Path | None, as_json: bool) -> None:
    """List the built-in problem files, or print one of them.

    \b
    Example:
      ndtheory example section6 > my.toml
      ndtheory example --inputs trial
    """
    available = examples()
    if name is not None and inputs is not None:
        raise click.UsageError(f"received {name} and --inputs: needed one of them")
    if inputs is not None:
        from verification.output.inputs import INPUTS, write_inputs

        with stages() as tell:
            tell("computing a run", None)
            write_inputs(inputs)
        written = {str(inputs / file): what for file, what in INPUTS.items()}
        found, shown = Examples(written=written), [f"{file}: {what}" for file, what in written.items()]
        shown.append(f"\nNext: ndtheory compare {quote(str(inputs / 'my.toml'))}")
    elif name is None:
        import tomllib

        titles = {key: str(tomllib.loads(text)["title"]) for key, text in available.items()}
        found, shown = Examples(examples=titles), [f"  {key:14}  {title}" for key, title in titles.items()]
        shown.append("\nNext: ndtheory example section6 > ex.toml; ndtheory compare ex.toml")
    elif name in available:
        found, shown = Examples(name=name, toml=available[name]), [available[name].rstrip()]
    else:
        from verification.problem.examples import unknown_example

        raise click.UsageError(unknown_example(name, available))
    say(found.to_json() if as_json else "\n".join(shown))


def load_problem(
    file: Path, keys: Mapping[str, str], *, theta: str | None = None, relaxation: str | None = None, swap: bool = False
) -> Problem:
    """The problem of a file, changed by the options: first --set, then the others."""
    from verification.problem import ProblemError
    from verification.problem import load as read
    from verification.problem.readers import takes_theta

    chosen = {} if relaxation is None else {"iteration.relaxation": relaxation}
    problem = read(file).with_keys({**keys, **chosen})
    if theta is not None:
        rule = problem.iteration.relaxation
        if not takes_theta(rule):
            needed = f'needed no theta beside relaxation = "{rule}", which takes its own step'
            raise ProblemError(str(file), "--theta", theta, needed)
        problem = problem.with_theta(theta)
    return remember(problem.swapped() if swap else problem)


def load(typed: Typed) -> Problem:
    """The problem as it was typed."""
    return load_problem(typed.file, typed.keys, theta=typed.theta, relaxation=typed.relaxation, swap=typed.swap)


@cli.command()
@of_a_file(SWAP)
@click.option(
    "--refine",
    callback=number("a whole number from 0 to 8", lambda n: 0 <= n <= 8, int),
    default="0",
    metavar="N",
    help="Also measure on meshes halved 1 to N times.",
)
@click.option("--verified", is_flag=True, help="Prove bounds of each constant, for the exact data of FILE on its mesh.")
@JSON
def constants(typed: Typed, refine: int, verified: bool, as_json: bool) -> None:
    """Measure m, M, C_R, C_s, C_tr, C_K and rho on the mesh of FILE.

    m, M and C_K come in the file's unit of stress.

    \b
    Example:
      ndtheory constants my.toml --refine 2
      ndtheory constants my.toml --verified
      ndtheory constants my.toml --set body1.young=2e4
    """
    from verification.constants import measure
    from verification.sections.constants import sections

    problem = load(typed)
    with stages() as tell:
        measured = measure(problem, refine=refine, verified=verified, progress=tell)
    deliver(measured, sections, as_json, typing=typed.command)
    if "levels" in measured.reason:
        raise KeyboardInterrupt(f"{measured.reason['levels']}: what was computed is shown")


@cli.command()
@of_a_file(*RUN)
@click.option("--start", type=PATH, metavar="g.npy", help="Begin with the forces of this file.")
@FOLDER
@JSON
def run(typed: Typed, solver: Any, start: Path | None, folder: Path | None, as_json: bool) -> int:
    """Run the Neumann-Dirichlet iteration on FILE.

    Exit 0 if it converged, 1 if it did not, 130 after Ctrl-C (what was computed is shown and written).

    \b
    Example:
      ndtheory run my.toml --theta 0.6 -o results
      ndtheory run my.toml --set contact.friction=0.4 --relaxation newton
      ndtheory run my.toml --start g.npy
    """
    problem = load(typed)  # before what loads arrays: a file may be missing
    from verification.algorithm import runs
    from verification.algorithm.start import forces
    from verification.coupling.matrix_files import read_vector
    from verification.interface.pair import pair_from
    from verification.sections.run import sections

    write = writer(folder, "run")
    pair = pair_from(problem, obstacle=True)
    g = None if start is None else forces(read_vector(start), pair, str(start))
    warn(pair.warnings, wide=as_json)
    with stages() as tell, progress(tell, problem.iteration.tolerance) as watch:
        finished = runs.run(pair, start=g, solver=solver, watch=watch)
        tell("linearising", None)
        try:
            finished = finished.linearise()
        except KeyboardInterrupt:  # costs no run
            finished = replace(finished, interrupted=True).linearise()
    said = finished.warnings[len(pair.warnings) :]
    deliver(finished, sections, as_json, write, folder, typing=typed.command, warnings=said)
    return _status_of_run(finished, typed.swap)


@cli.command()
@of_a_file()
@FOLDER
@JSON
def solve(typed: Typed, folder: Path | None, as_json: bool) -> int:
    """Solve both bodies of FILE at once, without decomposition.

    This global method shares only the matrices with the iteration.  One body may be rigid (shape = "rigid"), and
    a body may be held by contact alone in one direction.  Exit 1 if no solution was found that passes the checks.

    \b
    Example:
      ndtheory solve my.toml -o results
      ndtheory solve my.toml --set 'body2.prescribed.top=[0, -0.03]'
    """
    from verification.algorithm import monolithic
    from verification.interface.assembly import discretise
    from verification.sections import run

    problem = load(typed)
    write = writer(folder, "solve")
    bodies = discretise(problem)
    warn(bodies.warnings, wide=as_json)
    with stages() as tell:
        tell("solving both bodies at once", None)
        solution = monolithic.solve(bodies)
    typing, said = replace(typed, folder=folder).command, solution.warnings[len(bodies.warnings) :]
    deliver(solution, run.solution, as_json, write, folder, typing=typing, warnings=said)
    return 0


@cli.command()
@of_a_file(*RUN)
@click.option(
    "--exact", is_flag=True, help="Tighten the semidefinite bound to within 0.1 % of a factor that some loads attain."
)
@click.option("--verified", is_flag=True, help="Prove constants and bounds, for the exact data of FILE on its mesh.")
@BOUNDS
@FULL
@FOLDER
@JSON
def compare(
    typed: Typed,
    folder: Path | None,
    solver: Any,
    full: bool,
    as_json: bool,
    bounds: tuple[str, ...] | None,
    **asked: Any,
) -> int:
    """Measure constants, evaluate bounds, run, and judge each bound.

    Exit 1 if a proved bound is violated or the run stalls or diverges, 3 if rounding hides the answer.  Reaching
    max_iterations does not count as a failure here: the verdicts judge single steps.

    \b
    Example:
      ndtheory compare my.toml -o results
      ndtheory compare my.toml --set contact.friction=0.4
      ndtheory compare my.toml --verified
      ndtheory compare my.toml --bounds printed,repaired,energy
    """
    if asked["exact"] and bounds is not None:
        from verification import registry

        if all(registry.BOUNDS[name].calculated for name in bounds):
            needed = "needed a bound among them that can be brought closer"
            raise click.ClickException(f"received --exact with --bounds {','.join(bounds)}: {needed}")
    return _compare(load(typed), typed, folder, solver, full, as_json, bounds=bounds, **asked)


@cli.command()
@into("Folder to write.", default="ndtheory-demo", show_default=True)
@FULL
@JSON
def demo(folder: Path, full: bool, as_json: bool) -> int:
    """Compare bounds with a run, for the built-in model of Section 6.

    A folder gets the problem file, the report, the figures and the JSON document.

    \b
    Example:
      ndtheory demo -o section6
    """
    from verification.output.folder import Folder

    typed = Typed(file=Folder(folder, "compare").write_problem(examples()["section6"]))
    status = _compare(load(typed), typed, folder, "auto", full, as_json)
    for line in [] if as_json else unreached():
        complain(line)
    return status


def _compare(
    problem: Problem, typed: Typed, folder: Path | None, solver: Any, full: bool, as_json: bool, **asked: Any
) -> int:
    from verification import comparison as verdicts
    from verification.interface.pair import pair_from
    from verification.sections.comparison import FirstParts, Parts, proofs
    from verification.sections.comparison import verdicts as last

    write = writer(folder, "compare")
    pair = pair_from(problem)
    warn(pair.warnings, wide=as_json)
    begin, end = (Parts, last) if full else (FirstParts, proofs)
    parts = None if as_json else begin(pair, one_by_one(needed=write is not None))
    with stages() as tell, progress(tell, problem.iteration.tolerance) as watch, parts or nullcontext():
        comparison = verdicts.compare(pair, solver=solver, watch=watch, progress=tell, listener=parts, **asked)
    said = comparison.run.warnings[len(pair.warnings) :]
    deliver(comparison, end, as_json, write, folder, typing=typed.command, warnings=said, after="answer")
    return _status_of_comparison(comparison, typed.swap)


def _status_of_run(finished: Run, swapped: bool) -> int:
    if finished.interrupted:
        ended = "" if finished.outcome == "interrupted" else f"the run had ended ({finished.outcome}), "
        complain(f"interrupted after {ended}{finished.evaluations} evaluations of T: what was computed is kept")
        return 130
    complain_of(finished, swapped)
    return 0 if finished.converged else 1


def _status_of_comparison(comparison: Comparison, swapped: bool) -> int:
    run = comparison.run
    if comparison.proved_violated and not run.interrupted:
        complain("a proved bound is violated: a bug in this program or an error in the proof; please report it")
        return 1
    if run.interrupted or run.outcome in ("stalled", "diverged"):
        return _status_of_run(run, swapped)
    complain_of(run, swapped)
    return 3 if comparison.inconclusive else 0


def complain_of(finished: Run, swapped: bool) -> None:
    """Report the remedy of a run that did not converge, with ``--swap-roles`` or without."""
    if (change := finished.remedy) is not None:
        complain(change.sentence("--theta", "without --swap-roles" if swapped else "--swap-roles"))


def unreached() -> list[str]:
    """Messages for a user whose shell does not find the command that was started by the name ``ndtheory``."""
    started, found = Path(sys.argv[0]), shutil.which("ndtheory")
    if started.name != "ndtheory" or not started.exists() or (found and os.path.samefile(found, started)):
        return []
    near = Path(os.path.relpath(started)) if started.absolute().is_relative_to(Path.cwd()) else started
    said = [f"`ndtheory` is not on the PATH of this shell: type {quote(str(near))} for it"]
    if near.with_name("activate").exists():
        said.append(f"or, once in each shell: source {quote(str(near.with_name('activate')))}")
    return said
