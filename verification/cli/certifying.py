"""The command certify: a proof of contraction that a stranger can check again."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from verification.cli.console import deliver, heading, near_one, note, say, stages
from verification.cli.failing import fail
from verification.cli.problems import JSON, SET, SWAP, THETA, load_problem
from verification.cli.typed import Typed

if TYPE_CHECKING:
    from verification.certificate.contraction import Certificate, Checked
    from verification.document import Document

#: A certificate of a hundred contact nodes has a few megabytes.
MOST_BYTES = 100_000_000


class Certifying(click.Choice[str]):
    """The name of a bound that can propose a certificate."""

    def __init__(self) -> None:
        self.case_sensitive = True

    @property
    def choices(self) -> Sequence[str]:  # type: ignore[override]
        """Those of the bounds that are registered, the strongest first."""
        from verification.bounds.table import certifying

        return certifying()[::-1]


@click.command()
@click.argument("file", type=click.Path(path_type=Path), required=False)
@SET
@THETA
@SWAP
@click.option("--edition", type=Certifying(), help="Bound that proposes the factor; the strongest by default.")
@click.option(
    "--continuum", is_flag=True, help="Of FILE without its mesh: two rectangles, each held at its outer side."
)
@click.option("-o", "--output", "target", type=click.Path(path_type=Path), metavar="CERTIFICATE", help="A .json file.")
@click.option(
    "--check",
    "given",
    type=click.Path(path_type=Path),
    metavar="CERTIFICATE",
    help="Check this one again; with FILE also whether it is about the bodies of FILE.",
)
@JSON
def certify(
    file: Path | None,
    keys: dict[str, str],
    theta: str | None,
    swap: bool,
    edition: Any,
    continuum: bool,
    target: Path | None,
    given: Path | None,
    as_json: bool,
) -> int:
    """Prove that one step contracts on the meshes of FILE in exact numbers, or in the continuum.

    The certificate of a mesh holds the bodies in rational numbers and the multipliers that prove the factor.  Whoever
    doubts it checks it with a script of some 200 lines, verification/certificate/check.py, which imports nothing of
    this program (only python-flint, for balls).  Exit 1 where contraction is not proved.

    \b
    Examples:
      ndtheory certify my.toml --theta 0.5 -o certificate.json
      ndtheory certify --check certificate.json
      ndtheory certify --check certificate.json my.toml
      ndtheory certify --continuum my.toml --theta 0.4
    """
    context = click.get_current_context()
    for first, used, second, also in (
        ("--theta", theta, "--check", given),
        ("-o", target, "--check", given),
        ("--edition", edition, "--check", given),
        ("--continuum", continuum or None, "--check", given),
        ("--edition", edition, "--continuum", continuum or None),
    ):
        if used is not None and also is not None:
            raise click.UsageError(f"received {first} with {second}: needed one of both", context)
    if file is None and given is None:
        raise click.UsageError("received nothing: needed FILE, or --check CERTIFICATE", context)
    if target is not None:
        _check_target(target, context)
    if continuum:
        from verification.cli.continuum_screen import prove as prove_continuum

        assert file is not None
        return prove_continuum(file, keys, theta=theta, swap=swap, target=target, as_json=as_json)
    if given is not None:
        return _check(given, None if file is None else load_problem(file, keys, swap=swap), as_json)
    assert file is not None
    from verification.certificate.claims import NoCertificate
    from verification.certificate.contraction import certify as prove

    problem = load_problem(file, keys, theta=theta, swap=swap)
    try:
        with stages() as tell:
            found = prove(problem, edition=edition, progress=tell)
    except NoCertificate as error:
        return fail(error, "not proved", "no certificate")

    typed = Typed(file=file, keys=keys, theta=theta, swap=swap)
    deliver(found, lambda: show(found, target, typed), as_json, writing(found, target), target)
    return 0


def _check_target(target: Path, context: click.Context) -> None:
    """Refuse a name under which nothing can be written."""
    from verification.output.folder import check_ours
    from verification.problem.tables import ProblemError

    if target.suffix != ".json":
        raise click.UsageError(f"-o {target}: needed a name ending in .json", context)
    if not target.parent.is_dir():
        raise ProblemError(str(target), "", None, "needed a name in a folder that exists (-o)")
    check_ours(target)


def writing(found: Document, target: Path | None) -> Callable[[], None] | None:
    """What writes a certificate; None where no name was given."""
    from verification.output.folder import staged

    if target is None:
        return None

    def write() -> None:
        with staged(target.parent, shown=target) as room:
            (room / target.name).write_text(found.to_json(), encoding="utf-8")

    return write


def show(found: Certificate, target: Path | None = None, typed: Typed | None = None) -> None:
    """The screen of ``certify``."""
    from verification.bounds.table import BOUNDS

    discrete = found.discrete
    nodes = sum(len(discrete[name]["points"]) for name in ("body1", "body2"))
    say(f"{found.problem.title}: {nodes} nodes, {len(discrete['weights'])} contact nodes")
    say(f"k = {float(found.problem.contact.friction):g}, Neumann body {discrete['neumann_body']}")
    heading("WHAT IS PROVED?")
    factor, theta = near_one(float(found.factor)), float(found.theta)
    note(
        f"On these meshes T_theta with theta = {theta:g} has the Lipschitz constant {factor} in the norm (5.21),"
        " whatever the loads and the gap: it contracts.  Level: verified.",
        "  ",
    )
    if found.lower is not None:
        note(f"No proof can give less than {found.lower:.6g}, a factor that two forces attain (in doubles).", "  ")
    heading("BY WHAT?")
    note(
        f"Multipliers proposed by {BOUNDS[found.edition].words}; with them the quadratic form of the proof is positive"
        f" definite for the rational data of the problem, in balls of {found.claim['bits']} bits.",
        "  ",
    )
    say()
    say("Not claimed: anything about the continuum.")
    if target is not None:
        say(f"Next: ndtheory certify --check {target}")
    elif typed is not None:
        typed.suggest("certify", "-o", "certificate.json", iteration=True)


def _check(path: Path, problem: Any, as_json: bool) -> int:
    from verification.certificate.contraction import check_again
    from verification.problem.tables import ProblemError, unreadable

    if why := unreadable(path, MOST_BYTES):
        raise ProblemError(str(path), "", None, why)
    try:
        document = json.loads(path.read_bytes())
        with stages() as tell:
            tell(f"checking {path}", None)
            found = check_again(document, problem)
    except (ValueError, RecursionError) as error:
        if isinstance(error, ProblemError):
            raise
        raise ProblemError(str(path), "", None, f"needed a certificate: {error}") from None
    deliver(found, lambda: show_checked(found, path), as_json)
    return 0 if found.accepted and found.same is not False else 1


def show_checked(found: Checked, path: Path | None = None) -> None:
    """The screen of ``certify --check``."""
    heading("WHAT WAS CHECKED?")
    for words in found.words.split("; "):
        say(f"  {words}")
    say(f"  sha256 {found.sha256}")
    heading("IS IT PROVED?")
    say("  ACCEPTED: the claim holds for these bodies" if found.accepted else "  REFUSED")
    if found.why:
        note(found.why, "    ")
    if found.same is not None and found.problem is not None:
        about = "are those" if found.same else "ARE NOT those"
        note(f"The bodies {about} of {found.problem.source}.", "  ")
    else:
        say("  Whose bodies these are was not compared: give the problem file, too.")
    say()
    say("Not claimed: anything about the continuum.")
    say("Next: python check.py CERTIFICATE (verification/certificate/check.py, alone)")
