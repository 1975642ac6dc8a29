"""The command certify: a proof of contraction that anyone can check independently."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import click

from verification.cli.console import deliver, fail, stages
from verification.cli.forms import cli
from verification.cli.options import JSON, PATH, SET, SWAP, THETA, OneOf, Registered, Typed, one_file
from verification.cli.problems import load
from verification.show.parts import Sections

#: A certificate of a hundred contact nodes has a few megabytes.
MOST_BYTES = 100_000_000


def _editions() -> Sequence[str]:
    from verification.bounds.table import certifying
    from verification.registry import BOUNDS

    return [name for name in certifying()[::-1] if not BOUNDS[name].on_request]


@cli.command()
@click.argument("file", type=PATH, required=False)
@SET
@THETA
@SWAP
@click.option("--edition", type=Registered(_editions), help="Bound that proposes the factor; the strongest by default.")
@click.option(
    "--norm",
    type=OneOf(["energy", "lyapunov"]),
    default="energy",
    help="Norm of the claim: energy is the norm (5.21), lyapunov is one that the proof chooses.",
)
@click.option(
    "--exact",
    is_flag=True,
    help="Treat contact states case by case, until some loads nearly attain the factor; slower.",
)
@click.option(
    "--continuum", is_flag=True, help="Prove contraction without a mesh, for two rectangles held at their outer sides."
)
@one_file(".json", words="File of the certificate")
@click.option(
    "--check",
    "given",
    type=PATH,
    metavar="FILE.json",
    help="Check this certificate again; with FILE, also check that it is about the bodies of FILE.",
)
@JSON
def certify(
    file: Path | None,
    keys: dict[str, str],
    theta: str | None,
    swap: bool,
    edition: Any,
    norm: str,
    exact: bool,
    continuum: bool,
    target: Path | None,
    given: Path | None,
    as_json: bool,
) -> int:
    """Prove in exact numbers that one step contracts for FILE.

    The proof is for the meshes of FILE, or with --continuum for the bodies without a mesh.

    The certificate of a mesh holds the bodies in rational numbers and the multipliers that prove the factor.  Anyone
    can check it with a script of under 400 lines, verification/certificate/check.py, which imports nothing of this
    program (only python-flint, for interval arithmetic).  Exit 1 if contraction is not proved.

    \b
    Examples:
      ndtheory certify my.toml --theta 0.5 -o certificate.json
      ndtheory certify my.toml --exact -o certificate.json
      ndtheory certify my.toml --norm lyapunov -o certificate.json
      ndtheory certify --check certificate.json
      ndtheory certify --check certificate.json my.toml
      ndtheory certify --continuum my.toml --theta 0.6
    """
    used = {"--theta": theta, "-o": target, "--edition": edition, "--check": given}
    used |= {"--exact": exact or None, "--continuum": continuum or None}
    used["--norm lyapunov"] = norm if norm != "energy" else None
    for option, *others in (
        ("--check", "--theta", "-o", "--edition", "--continuum", "--exact", "--norm lyapunov"),
        ("--norm lyapunov", "--edition", "--continuum", "--exact"),
        ("--continuum", "--edition", "--exact"),
        ("--edition", "--exact"),
    ):
        if clash := [other for other in others if None not in (used[other], used[option])]:
            raise click.UsageError(f"received {clash[0]} with {option}: needed one of both")
    if file is None and (given is None or keys or swap):
        raise click.UsageError("received no FILE: needed it, or --check FILE.json without --set and --swap-roles")
    typed = Typed(file=file or Path(), keys=keys, theta=theta, swap=swap)
    problem: Any = None if file is None else load(typed)
    if given is not None:
        return _check(given, problem, as_json)
    from ndtheory.continuum.strip import Unproved
    from verification.certificate import sections as shown
    from verification.certificate.claims import NoCertificate
    from verification.certificate.continuum import certify_continuum
    from verification.certificate.contraction import certify as prove
    from verification.output.files import writing

    own = None if norm == "energy" else norm
    sections: Callable[[Any], Sections] = shown.continuum if continuum else lambda found: shown.sections(found, target)
    try:
        with stages() as tell:
            found: Any = (
                certify_continuum(problem, tell)
                if continuum
                else prove(problem, edition=edition or own, exact=exact, progress=tell)
            )
    except (NoCertificate, Unproved) as error:
        return fail(error, "not proved", "nothing is proved" if continuum else "no certificate")
    deliver(found, sections, as_json, writing(target), target, typing=typed.command)
    return 1 if continuum and not found.contracts else 0


def _check(path: Path, problem: Any, as_json: bool) -> int:
    from verification.certificate.contraction import check_again
    from verification.certificate.sections import checked
    from verification.problem.tables import ProblemError, unreadable

    if why := unreadable(path, MOST_BYTES):
        raise ProblemError(str(path), "", None, why)
    try:
        document = json.loads(path.read_bytes())
    except (ValueError, RecursionError):
        needed = "needed a certificate, a JSON document as `ndtheory certify FILE -o certificate.json` writes it"
        raise ProblemError(str(path), "", None, needed) from None
    try:
        with stages() as tell:
            tell(f"checking {path}", None)
            found = check_again(document, problem)
    except (ValueError, RecursionError) as error:
        if isinstance(error, ProblemError):
            raise
        raise ProblemError(str(path), "", None, f"needed a certificate: {error}") from None
    deliver(found, checked, as_json)
    return 0 if found.accepted and found.same is not False else 1
