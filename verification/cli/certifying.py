"""The command certify: a proof of contraction that anyone can check independently."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from verification.cli.console import deliver, fail, stages
from verification.cli.forms import cli
from verification.cli.options import JSON, PATH, SET, SWAP, THETA, Registered, Typed, one_file
from verification.cli.problems import load_problem

#: A certificate of a hundred contact nodes has a few megabytes.
MOST_BYTES = 100_000_000


def _editions() -> Sequence[str]:
    from verification.bounds.table import certifying

    return certifying()[::-1]


@cli.command()
@click.argument("file", type=PATH, required=False)
@SET
@THETA
@SWAP
@click.option("--edition", type=Registered(_editions), help="Bound that proposes the factor; the strongest by default.")
@click.option(
    "--exact",
    is_flag=True,
    help="Treat contact states case by case, until some loads nearly attain the factor; slower.",
)
@click.option(
    "--continuum", is_flag=True, help="Prove it without a mesh, for two rectangles, each held at its outer side."
)
@one_file(".json", words="File of the certificate")
@click.option(
    "--check",
    "given",
    type=PATH,
    metavar="FILE.json",
    help="Check this one again; with FILE also whether it is about the bodies of FILE.",
)
@JSON
def certify(
    file: Path | None,
    keys: dict[str, str],
    theta: str | None,
    swap: bool,
    edition: Any,
    exact: bool,
    continuum: bool,
    target: Path | None,
    given: Path | None,
    as_json: bool,
) -> int:
    """Prove in exact numbers that one step contracts for FILE.

    It is proved on the meshes of FILE, or with --continuum without a mesh.

    The certificate of a mesh holds the bodies in rational numbers and the multipliers that prove the factor.  Anyone
    can check it with a script of 350 lines, verification/certificate/check.py, which imports nothing of this
    program (only python-flint, for interval arithmetic).  Exit 1 where contraction is not proved.

    \b
    Examples:
      ndtheory certify my.toml --theta 0.5 -o certificate.json
      ndtheory certify my.toml --exact -o certificate.json
      ndtheory certify --check certificate.json
      ndtheory certify --check certificate.json my.toml
      ndtheory certify --continuum my.toml --theta 0.6
    """
    context = click.get_current_context()
    for first, used, second, also in (
        ("--theta", theta, "--check", given),
        ("-o", target, "--check", given),
        ("--edition", edition, "--check", given),
        ("--continuum", continuum or None, "--check", given),
        ("--edition", edition, "--continuum", continuum or None),
        ("--exact", exact or None, "--edition", edition),
        ("--exact", exact or None, "--check", given),
        ("--exact", exact or None, "--continuum", continuum or None),
    ):
        if used is not None and also is not None:
            raise click.UsageError(f"received {first} with {second}: needed one of both", context)
    if file is None and given is None:
        raise click.UsageError("received nothing: needed FILE, or --check FILE.json", context)
    if continuum:
        assert file is not None
        return _prove_continuum(file, keys, theta=theta, swap=swap, target=target, as_json=as_json)
    if given is not None:
        return _check(given, None if file is None else load_problem(file, keys, swap=swap), as_json)
    assert file is not None
    from verification.certificate.claims import NoCertificate
    from verification.certificate.contraction import certify as prove
    from verification.certificate.sections import sections
    from verification.output.files import writing

    problem = load_problem(file, keys, theta=theta, swap=swap)
    try:
        with stages() as tell:
            found = prove(problem, edition=edition, exact=exact, progress=tell)
    except NoCertificate as error:
        return fail(error, "not proved", "no certificate")
    typed = Typed(file=file, keys=keys, theta=theta, swap=swap)
    shown = lambda found: sections(found, target)
    deliver(found, shown, as_json, writing(target), target, typing=typed.command)
    return 0


def _prove_continuum(
    file: Path, keys: Mapping[str, str], *, theta: str | None, swap: bool, target: Path | None, as_json: bool
) -> int:
    """Bound the continuous problem of a file and show what follows; 1 where contraction is not proved."""
    from ndtheory.continuum.strip import Unproved
    from verification.certificate.continuum import certify_continuum
    from verification.certificate.sections import continuum
    from verification.output.files import writing

    problem = load_problem(file, keys, theta=theta, swap=swap)
    try:
        with stages() as tell:
            found = certify_continuum(problem, tell)
    except Unproved as error:
        return fail(error, "not proved", "nothing is proved")
    typed = Typed(file=file, keys=keys, theta=theta, swap=swap)
    deliver(found, continuum, as_json, writing(target), target, typing=typed.command)
    return 0 if found.contracts else 1


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
