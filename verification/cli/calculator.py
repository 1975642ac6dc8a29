"""``ndtheory bounds``: the bound calculator, without finite elements."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

import click

from ndtheory import EDITIONS, Constants, EnergyConstants, HypothesisError
from ndtheory.constants import take
from verification.bounds.bound import NOT_ASKED, Subject
from verification.bounds.table import ENERGY, SECTION_5, Calculated
from verification.cli.console import as_figure, complain, deliver
from verification.cli.forms import cli
from verification.cli.options import JSON, OneOf, one_file
from verification.registry import BOUNDS
from verification.sections.bounds import sections

#: The options by the constants that they give.
OPTIONS = {key: f"--{key.replace('_', '')}" for key in (*SECTION_5, *ENERGY)}

_number = partial(click.option, metavar="NUMBER")


@cli.command()
@_number("--m", "m", help="Smaller coercivity m^a of the bodies (stress).")
@_number("--M", "M", help="Sum of the continuity constants M^a (stress), so at least 2 m.")
@_number("--CR", "C_R", help="Lift constant, at least 1.")
@_number("--Cs", "C_s", help="Constant of w -> S(sigma_N(w)) into L2.")
@_number("--Ctr", "C_tr", help="Constant of the tangential trace into L2.")
@_number("--k", "k", help="Coefficient of friction.")
@_number("--CK", "C_K", help="Product k Cs Ctr (stress), instead of those three.")
@_number("--theta", "theta", help="Relaxation factor, 0 < theta < 1.")
@click.option(
    "--edition",
    type=OneOf([*(edition.name for edition in EDITIONS), "both"]),
    default="both",
    show_default=True,
    help="Edition of the theorem of Section 5.",
)
@_number("--rho", help="Bound in energy norms: stiffness ratio of the bodies on Gamma_c.")
@_number("--kappa1", "kappa_1", help="Bound in energy norms: k C_s_energy C_t1, see `constants`; 0 without friction.")
@_number("--kappa2", "kappa_2", help="Bound in energy norms: k C_s_energy C_t2, see `constants`; 0 without friction.")
@one_file(".svg", ".png", words="Figure to draw: h_1 and h_2, which bound the squared factor, over theta")
@click.option("--check", is_flag=True, help="Exit 1 unless contraction at theta is proved.")
@JSON
def bounds(
    edition: str, theta: str | None, target: Path | None, check: bool, as_json: bool, **given: str | None
) -> int:
    """Calculate for which theta and friction one step contracts.

    Numbers may be rationals (1/3).  m, M, Cs and CK are in any one unit of stress.  The printed theorem depends on
    this unit, the repaired one does not.  --rho, --kappa1 and --kappa2 have no unit and give the theorem in energy
    norms, with the other constants or without.  `ndtheory constants` measures all of them.

    \b
    Examples, m and M in MPa:
      ndtheory bounds --m 3084 --M 153229 --CR 1.70 --CK 1e-8 --theta 1e-4
      ndtheory bounds --m 1 --M 2 --CR 1 --CK 0.05 -o h.svg
      ndtheory bounds --rho 0.475 --kappa1 0.986 --kappa2 0.427 --theta 0.7
    """
    of_section_5, of_norms = (
        {key: value for key, value in given.items() if key in keys and value is not None}
        for keys in (SECTION_5, ENERGY)
    )
    if check and theta is None:
        raise click.UsageError("--check needs --theta")
    alone = "rho" in of_norms and of_section_5.keys() <= {"k"}
    constants = None if alone else _constants(of_section_5)
    if target is not None and constants is None:
        raise click.UsageError("-o draws h_1 and h_2: it needs --m, --M, --CR and --CK")
    friction = (
        take("k", of_section_5.get("k", 0), "a number k >= 0", lambda k: k >= 0) if constants is None else constants.C_K
    )
    energy = _energy(of_norms, friction > 0)
    subject = Subject(
        constants=constants,
        energy=energy,
        why="needs --m, --M, --CR and --CK",
        why_energy="needs --rho, and --kappa1, --kappa2 with friction",
    )
    results = {}
    for name, bound in BOUNDS.items():
        if bound.calculated:
            left_out = bound.edition is not None and constants is not None and edition not in (name, "both")
            results[name] = bound.absent(NOT_ASKED) if left_out else bound.evaluate(subject, theta)
    found = Calculated(constants=constants, energy=energy, theta=theta, results=results)
    if as_json and found.no_sum:  # which the screen says itself
        complain(f"warning: {found.no_sum}")
    from verification.output.files import writing

    deliver(found, sections, as_json, writing(target, as_figure), target)
    proved = any(result.factor is not None and result.proved for result in results.values())
    return 1 if check and not proved else 0


def _constants(given: Mapping[str, str]) -> Constants:
    for key in ("m", "M", "C_R"):
        if key not in given:
            needed = "needed --m, --M, --CR and --CK, or --rho"
            raise click.UsageError(f"{OPTIONS[key]} is missing: {needed}")
    return Constants(**given)


def _energy(given: Mapping[str, str], rubs: bool) -> EnergyConstants | None:
    """The constants of the bound in energy norms; None where they were not given."""
    missing = [OPTIONS[key] for key in ENERGY if key not in given]
    if len(missing) == len(ENERGY):
        return None
    if "rho" not in given or len(missing) == 1 or (rubs and missing):
        needed = "the bound in energy norms needs --rho, and with friction --kappa1 and --kappa2"
        raise click.UsageError(f"{', '.join(missing)} missing: {needed}")
    try:
        return EnergyConstants(**given)
    except HypothesisError as error:
        raise HypothesisError(OPTIONS[error.key], error.value, error.needed) from None
