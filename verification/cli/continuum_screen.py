"""What ``ndtheory certify --continuum`` does and shows."""

from __future__ import annotations

from collections.abc import Mapping
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from pathlib import Path
from typing import TYPE_CHECKING, Any

from verification.cli.console import deliver, figures, heading, note, say, stages, table
from verification.cli.failing import fail
from verification.cli.problems import load_problem
from verification.cli.typed import Typed

if TYPE_CHECKING:
    from verification.certificate.continuum import ContinuumCertificate


def prove(
    file: Path, keys: Mapping[str, str], *, theta: str | None, swap: bool, target: Path | None, as_json: bool
) -> int:
    """Bound the continuous problem of a file and show what follows; 1 where contraction is not proved."""
    from ndtheory.strip import Unproved
    from verification.certificate.continuum import certify_continuum
    from verification.output.files import writing

    problem = load_problem(file, keys, theta=theta, swap=swap)
    try:
        with stages() as tell:
            found = certify_continuum(problem, tell)
    except Unproved as error:
        return fail(error, "not proved", "nothing is proved")
    typed = Typed(file=file, keys=keys, theta=theta, swap=swap)
    deliver(found, lambda: show(found, typed), as_json, writing(found, target), target)
    return 0 if found.contracts else 1


def _at_most(number: dict[str, float] | None) -> str:
    return "no bound" if number is None else f"<= {_outward(number['hi'], 1)}"


def _at_least(number: dict[str, float] | None) -> str:
    return "no bound" if number is None else f">= {_outward(number['lo'], -1)}"


def _outward(value: float, side: int) -> str:
    """Four figures, rounded up (1) or down (-1)."""
    rounding = ROUND_CEILING if side > 0 else ROUND_FLOOR
    return f"{float(Context(prec=4, rounding=rounding).plus(Decimal(value))):.4g}"


def show(found: ContinuumCertificate, typed: Typed | None = None) -> None:
    """The screen."""
    problem, document = found.problem, found.content()
    constants, k = document["constants"], float(found.friction)
    stress, length = problem.units["stress"], problem.units["length"]
    say(f"{problem.title}: the continuous problem, no mesh")
    radius = "" if problem.contact.radius is None else f", r = {float(problem.contact.radius):g} {length}"
    say(f"Neumann body: {'lower' if problem.iteration.neumann_body == 1 else 'upper'} | k = {k:g}{radius}")
    heading("WHAT WAS USED?")
    first, second = (f"K = {figures(float(value))}" for value in found.constants.segments)
    table(
        [
            ("bound", "", "unit", "by"),
            ("C_s", _at_most(constants["C_s"]), f"sqrt({stress}/{length})", "strip of the Neumann body, intervals"),
            ("C_t1", _at_most(constants["C_t1"]), f"sqrt({length}/{stress})", f"segments, contact body, {first}"),
            ("C_t2", _at_most(constants["C_t2"]), f"sqrt({length}/{stress})", f"segments, Neumann body, {second}"),
            ("R", _at_most(constants["strips"]), "", "both strips, intervals"),
            ("eps", _at_most(constants["cut_off"]), "", "cut-off beside Gamma_c, segments"),
            ("rho", _at_most(constants["rho"]), "", "(1 + eps) R"),
            ("rho", _at_least(constants["rho_least"]), "", "half-planes"),
            ("rho", _at_least(constants["rho_ends"]), "", "wedges at the ends of Gamma_c"),
            ("rho_normal", _at_most(constants["rho_normal"]), "", "mirror image"),
            ("kappa_1", _at_most(constants["kappa_1"]), "", "k C_s C_t1"),
            ("kappa_2", _at_most(constants["kappa_2"]), "", "k C_s C_t2"),
        ]
    )
    heading("DOES ONE STEP CONTRACT IN THE CONTINUUM?")
    threshold = _outward(document["friction_threshold"]["lo"], -1)
    note(f"Every small theta contracts for k < {threshold}: one fixed point, and (P1) has exactly one solution.", "  ")
    if document["friction_limit"] is not None:
        note(f"Some theta contracts for k < {_outward(document['friction_limit']['lo'], -1)}.", "  ")
    if found.energy is None:
        note(f"For no single theta is anything proved. {document['reason']['rho']}.", "  ")
    elif document["interval"] is None:
        note(f"At k = {k:g} no theta is proved to contract: no conclusion.", "  ")
    else:
        lo, hi = document["interval"][0], "1"
        if found.energy.interval != (0.0, 1.0):
            hi = _outward(document["theta_max_proved"]["lo"], -1)
        best = f"{document['theta_proved']:.3f}, factor {_at_most(document['factor_proved'])}"
        note(f"At k = {k:g}: {lo:.4g} < theta < {hi}; the best proved theta is {best}.", "  ")
        if document["factor"] is not None:
            note(f"theta = {document['theta']:g}: factor {_at_most(document['factor'])}, guaranteed.", "  ")
        elif document["theta"] is not None:
            note(f"theta = {document['theta']:g}: no conclusion.", "  ")
    _on_the_mesh(found, document)
    say()
    note(f"Not claimed: {document['not_claimed']}.")
    if typed is not None:
        typed.suggest("compare", iteration=True)


def _on_the_mesh(found: ContinuumCertificate, document: Mapping[str, Any]) -> None:
    """rho of the mesh beside rho of the continuum, and whether the theta contracts on both."""
    mesh, k = document["mesh"], document["friction"]
    heading("DOES IT CONTRACT ON THE MESH OF THE FILE?")
    name = "rho" if k else "rho_normal"
    if mesh["theta_limit"] is None:
        note(f"Not known. {mesh['reason']['rho']}.", "  ")
        note("The mesh may need a smaller theta than the continuum, and so may every finer one.", "  ")
        return
    continuum = document["constants"][name] or document["constants"]["rho"]
    bound = "no bound" if continuum is None else f"{_at_most(continuum)}, guaranteed"
    nodes = mesh["interface_nodes"]
    note(f"{name}: {mesh[name]['value']:.5g} on {nodes} contact nodes (float); in the continuum {bound}.", "  ")
    limit, where = mesh["theta_limit"], " where all of Gamma_c sticks" if k else ""
    if limit <= 1:
        note(f"On this mesh no theta from {limit:.4g} on contracts{where} (float).", "  ")
    judged = f"theta = {mesh['theta']:.4g}" if mesh["theta"] is not None else ""
    if judged and mesh["contracts"]:
        note(f"{judged} contracts on this mesh (float).", "  ")
    elif judged and mesh["contracts"] is None:
        note(f"{judged}: no conclusion on this mesh; `ndtheory compare` has sharper bounds.", "  ")
    elif judged and found.contracts:
        note(
            f"{judged} contracts in the continuum (guaranteed), and NOT on this mesh (float). Finer meshes of such"
            " cells may need a smaller theta for good, too.",
            "  ",
        )
    elif judged:
        note(f"{judged} does not contract on this mesh (float).", "  ")
