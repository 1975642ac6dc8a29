"""A certificate of one step, and what came of checking one again."""

from __future__ import annotations

from pathlib import Path
from shlex import quote

from verification.bounds.table import named
from verification.certificate import check
from verification.certificate.contraction import Certificate, Checked
from verification.sections.numbers import near_one
from verification.sections.parts import Facts, Note, Sections, closing, following, of, section

CLAIMS = "anything about the continuum"


@of.register
def sections(found: Certificate, target: Path | None = None) -> Sections:
    """The sections; ``target`` is where the certificate is written."""
    discrete, claim = found.discrete, []
    nodes = sum(len(discrete[name]["points"]) for name in ("body1", "body2"))
    factor, theta = near_one(float(found.factor)), float(found.theta)
    claim.append(
        f"On these meshes T_theta with theta = {theta:g} has the Lipschitz constant {factor} in the norm (5.21),"
        " whatever the loads and the gap: it contracts.  Level: verified."
    )
    if found.lower is not None:
        claim.append(f"No proof can give less than {found.lower:.6g}, a factor that two forces attain (in doubles).")
    proof = (
        f"Multipliers proposed by {named(found.edition).words}; with them the quadratic form of the proof is positive"
        f" definite for the rational data of the problem, in balls of {found.claim['bits']} bits."
    )
    then = following("certify", "-o", "certificate.json", iteration=True)
    about = f"{found.problem.title}: {nodes} nodes, {len(discrete['weights'])} contact nodes"
    bodies = f"k = {float(found.problem.contact.friction):g}, Neumann body {discrete['neumann_body']}"
    return (
        section("setting", "", Facts(about), Facts(bodies)),
        section("proved", "WHAT IS PROVED?", *claim),
        section("proof", "BY WHAT?", proof),
        closing(CLAIMS, then=then if target is None else f"ndtheory certify --check {quote(str(target))}"),
    )


@of.register
def checked(found: Checked) -> Sections:
    """The sections of a check."""
    said: list[Note | str] = ["ACCEPTED: the claim holds for these bodies" if found.accepted else "REFUSED"]
    if found.why:
        said.append(Note(found.why, 4))
    if found.same is not None and found.problem is not None:
        said.append(f"The bodies {'are those' if found.same else 'ARE NOT those'} of {found.problem.source}.")
    else:
        said.append("Whose bodies these are was not compared: give the problem file, too.")
    what = (*found.words.split("; "), f"sha256 {found.sha256}")
    then = f"python {quote(check.__file__)} CERTIFICATE"
    return (
        section("checked", "WHAT WAS CHECKED?", *what),
        section("proved", "IS IT PROVED?", *said),
        closing(CLAIMS, then=then),
    )
