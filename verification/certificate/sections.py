"""A certificate of one step on a mesh, the check of one, and the proof for the continuous problem."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import partial
from pathlib import Path
from shlex import quote
from typing import Any

from ndtheory.number import directed
from verification import registry
from verification.certificate import check
from verification.certificate.continuum import ContinuumCertificate
from verification.certificate.contraction import Certificate, Checked
from verification.problem.specs import PLACES
from verification.show.numbers import figures, rounded
from verification.show.parts import Cell, Facts, Note, Quantity, Section, Sections, closing, following, section, table

CLAIMS = "anything about the continuum"


@registry.sections.register
def sections(found: Certificate, target: Path | None = None) -> Sections:
    """The sections; ``target`` is where the certificate is written."""
    discrete, claim = found.discrete, []
    nodes = sum(len(discrete[name]["points"]) for name in ("body1", "body2"))
    spare, theta = float(1 - found.factor), float(found.theta)
    few = lambda digits: rounded(float(found.factor), digits, up=True)
    factor = f"1 - {rounded(spare, 2, up=False)}" if 0 < spare < 1e-3 else few(4)
    norm = found.claim.get("norm")
    name = "the norm (5.21)" if norm is None else "the norm Q of the certificate"
    claim.append(
        f"On these meshes a step with theta = {theta:g} multiplies the difference of two forces, in {name}, by"
        f" {factor} at most, for all loads and gaps: it contracts.  Level: verified."
    )
    if norm is not None:
        root = rounded(float(Fraction(norm["condition"])) ** 0.5, 4, up=True)
        claim.append(
            f"Q is at least (5.21) and at most {root} times (5.21), so after i steps the error in (5.21) is at most"
            f" {root} x {few(4)}^i times the first one."
        )
        claim.append(
            f"A piece of T has the spectral radius {found.lower:.4g} (in doubles): no norm has a smaller factor."
        )
    elif found.lower is not None:
        gap = float(found.factor) / found.lower - 1
        claim.append(
            f"Proved factor {few(6)}, attained {found.lower:.6g} by two forces (in doubles):"
            f" {100 * max(gap, 0.0):.2f} % apart.  No proof can give less than the attained factor."
        )
    sets = "" if found.sets == 1 else f"The pieces of T are divided into {found.sets} sets, each with its own form.  "
    words = registry.BOUNDS[found.edition].words
    proposed = words[:1].upper() + words[1:]
    proof = (
        f"{sets}{proposed} proposes multipliers.  With them the quadratic form of the proof is positive"
        f" definite for the exact rational data, which {found.claim['bits']}-bit interval arithmetic proves."
    )
    then = following("certify", "-o", "certificate.json", iteration=True)
    about = f"{found.problem.title}: {nodes} nodes, {len(discrete['weights'])} contact nodes"
    bodies = f"k = {found.problem.friction_words}, Neumann body {discrete['neumann_body']}"
    return (
        section("setting", "", Facts(about), Facts(bodies)),
        section("proved", "WHAT IS PROVED?", *claim),
        section("proof", "BY WHAT?", proof),
        closing(CLAIMS, then=then if target is None else f"ndtheory certify --check {quote(str(target))}"),
    )


@registry.sections.register
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


def _at_most(number: Mapping[str, float] | None, unit: str = "", *, up: bool = True) -> Cell:
    if number is None:
        return "no bound"
    end, sign = (number["hi"], "<=") if up else (number["lo"], ">=")
    return Quantity(end, f"{sign} {_few(end, up)}", unit, "guaranteed")


_at_least = partial(_at_most, up=False)


def _few(value: float, up: bool) -> str:
    """A bound in four figures; one below 1 that would be rounded to 1 as its distance from 1."""
    few = float(directed(value, 4, up=up))
    return f"1 - {_few(1 - value, False)}" if value < 1 <= few else f"{few:.4g}"


@registry.sections.register
def continuum(found: ContinuumCertificate) -> Sections:
    """The sections of a proof for the continuous problem."""
    problem, document = found.problem, found.content()
    stress, length = problem.units["stress"], problem.units["length"]
    radius = [] if problem.contact.radius is None else [f"r = {float(problem.contact.radius):g} {length}"]
    number = problem.iteration.neumann_body
    body = f"Neumann body: {number} ({PLACES[number]})"
    friction = ", ".join([f"k = {problem.friction_words}", *radius])
    return (
        section("setting", "", Facts(f"{problem.title}: the continuous problem, no mesh"), Facts(body, (friction,))),
        _used(found, document["constants"], f"sqrt({stress}/{length})", f"sqrt({length}/{stress})"),
        section("continuum", "DOES ONE STEP CONTRACT IN THE CONTINUUM?", *_contracts(found, document)),
        section("mesh", "DOES IT CONTRACT ON THE MESH OF THE FILE?", *_on_the_mesh(found, document)),
        closing(document["not_claimed"], then=following("compare", iteration=True)),
    )


def _used(found: ContinuumCertificate, constants: Mapping[str, Any], of_stress: str, of_trace: str) -> Section:
    """The bounds behind the proof."""
    first, second = (f"K = {figures(float(value))}" for value in found.constants.K)
    used = (
        ("C_s", "C_s", _at_most, of_stress, "smoothed pressure, Neumann body; strip"),
        ("C_t1", "C_t1", _at_most, of_trace, f"trace, contact body; {first}"),
        ("C_t2", "C_t2", _at_most, of_trace, f"trace, Neumann body; {second}"),
        ("R", "strips", _at_most, "", "ratio of stiffness of two strips"),
        ("eps", "cut_off", _at_most, "", "loss by the cut-off beside Gamma_c"),
        ("rho", "rho", _at_most, "", "(1 + eps) R"),
        ("rho", "rho_least", _at_least, "", "half-planes"),
        ("rho", "rho_ends", _at_least, "", "wedges at the ends of Gamma_c"),
        ("rho_normal", "rho_normal", _at_most, "", "mirror image"),
        ("kappa_1", "kappa_1", _at_most, "", "k C_s C_t1"),
        ("kappa_2", "kappa_2", _at_most, "", "k C_s C_t2"),
    )
    rows = [(name, bound(constants[key], unit), unit, by) for name, key, bound, unit, by in used]
    return section("used", "WHICH BOUNDS ENTER THE PROOF?", table(("bound", "", "unit", "meaning; method"), rows))


def _contracts(found: ContinuumCertificate, document: Mapping[str, Any]) -> list[str]:
    k, threshold = float(found.friction), _few(document["friction_threshold"]["lo"], False)
    name = "k" if found.problem.contact.profile is None else "max k"
    said = [f"Every small theta contracts for {name} < {threshold}: one fixed point, and exactly one solution."]
    if document["friction_limit"] is not None:
        said.append(f"Some theta contracts for {name} < {_few(document['friction_limit']['lo'], False)}.")
    if found.energy is None:
        said.append(f"Nothing is proved for any particular theta. {document['reason']['rho']}.")
    elif document["interval"] is None:
        said.append(f"At {name} = {k:g} no theta is proved to contract in energy norms.")
    else:
        lo, hi = document["interval"][0], "1"
        if found.energy.interval != (0.0, 1.0):
            hi = _few(document["theta_max_proved"]["lo"], False)
        best = f"{_few(document['theta_proved'], False)}, factor {_at_most(document['factor_proved'])}"
        said.append(f"At {name} = {k:g}: {_few(lo, True)} < theta < {hi}; the best proved theta is {best}.")
        if document["factor"] is not None:
            said.append(f"theta = {document['theta']:g}: factor {_at_most(document['factor'])}, guaranteed.")
        elif document["theta"] is not None:
            said.append(f"theta = {document['theta']:g}: no conclusion in energy norms.")
    return [*said, *_in_a_free_norm(name, k, document["free_norm"])]


def _in_a_free_norm(name: str, k: float, free: Mapping[str, Any]) -> list[str]:
    """The numbers in a norm that the proof chooses."""
    threshold, top, factor = free["friction_threshold"], free["theta_max"], free["factor"]
    if threshold is None:
        return []
    most = _few(threshold["lo"], False)
    said = [f"In a norm that the proof chooses every small theta contracts for {name} < {most}."]
    if top is not None:
        here = f"There, at {name} = {k:g}: every theta <= {_few(top['lo'], False)}"
        here += "" if factor is None else f"; the file's theta by a factor {_at_most(factor)}"
        if free["theta_best"] is not None:
            here += f"; theta = {figures(free['theta_best'])} by {_at_most(free['factor_best'])}"
        said.append(f"{here}, guaranteed.")
    return said


def _on_the_mesh(found: ContinuumCertificate, document: Mapping[str, Any]) -> list[str]:
    """rho of the mesh beside rho of the continuum, and whether the theta contracts on both."""
    mesh, k = document["mesh"], document["friction"]
    name, limit = "rho" if k else "rho_normal", mesh["theta_limit"]
    if limit is None:
        said = [f"Not known. {mesh['reason']['rho']}."]
        return [*said, "The mesh may need a smaller theta than the continuum.", _on_finer_meshes(mesh, name)]
    continuum = document["constants"][name] or document["constants"]["rho"]
    bound = "no bound" if continuum is None else f"{_at_most(continuum)}, guaranteed"
    nodes, where = mesh["interface_nodes"], " where all of Gamma_c sticks" if k else ""
    said = [f"{name}: {mesh[name]['value']:.5g} on {nodes} contact nodes (float); in the continuum {bound}."]
    if limit <= 1:
        said.append(f"On this mesh no theta from {limit:.4g} on contracts{where} (float).")
    if mesh["theta"] is not None:
        judged = f"theta = {mesh['theta']:.4g}"
        if mesh["contracts"]:
            said.append(f"{judged} contracts on this mesh (float).")
        elif mesh["contracts"] is None:
            said.append(f"{judged}: no conclusion on this mesh; `ndtheory compare` has sharper bounds.")
        elif found.contracts:
            said.append(f"{judged} contracts in the continuum (guaranteed), and NOT on this mesh (float).")
        else:
            said.append(f"{judged} does not contract on this mesh (float).")
    return [*said, _on_finer_meshes(mesh, name)]


def _on_finer_meshes(mesh: Mapping[str, Any], name: str) -> str:
    """The limit that short waves set on finer meshes of the file's cells."""
    key = {"rho": "rho_cells", "rho_normal": "rho_normal_cells"}[name]
    if mesh[key] is None:
        return f"Every finer mesh may need a smaller theta, too; {key} is not known: {mesh['reason'][key]}."
    rho, where = mesh[key]["value"], " where all of Gamma_c sticks" if name == "rho" else ""
    least = f"{name} of finer meshes of such cells tends to {rho:.5g} or more (float)"
    limit = f"no theta above {2 / (1 + rho):.4g} contracts on fine ones{where}" if rho > 1 else "this excludes no theta"
    return f"{least}: {limit}."
