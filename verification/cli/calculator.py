"""``ndtheory bounds``: the bound calculator, without finite elements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import click

from ndtheory import EDITIONS, Bounds, Constants, EnergyBounds, EnergyConstants, HypothesisError, relaxation_factor
from ndtheory.constants import take
from ndtheory.number import Level
from verification.bounds.bound import BoundResult, Subject, bounded
from verification.bounds.section5 import Section5
from verification.bounds.table import BOUNDS
from verification.cli.console import figures, heading, note, say, table
from verification.cli.levels import LEGEND, at_least, factor, marked, rounded
from verification.document import Document
from verification.ledger.record import on_the_printed_proof

#: The constants of Section 5 by key, and the options that give them.
CONSTANTS = {"m": "--m", "M": "--M", "C_R": "--CR", "C_s": "--Cs", "C_tr": "--Ctr", "k": "--k", "C_K": "--CK"}
ENERGY = {"rho": "--rho", "kappa_1": "--kappa1", "kappa_2": "--kappa2"}


class BoundsDocument(Document):
    """``ndtheory.bounds/1``."""

    schema: ClassVar[str] = "ndtheory.bounds/1"
    units: Mapping[str, str] = {"length": "any", "stress": "that of m"}

    def __init__(self, inputs: Mapping[str, Any], results: Mapping[str, BoundResult]) -> None:
        self.inputs, self.results = inputs, results

    def content(self) -> dict[str, Any]:
        return {
            "inputs": dict(self.inputs),
            "editions": {name: result.to_dict() for name, result in self.results.items()},
            "reason": {name: result.not_computed for name, result in self.results.items() if result.not_computed},
        }


@click.command()
@click.option("--m", "m", metavar="NUMBER", help="Smaller coercivity m^a of the bodies (stress).")
@click.option("--M", "M", metavar="NUMBER", help="Sum of the continuity constants M^a (stress), at least m.")
@click.option("--CR", "C_R", metavar="NUMBER", help="Lift constant, at least 1.")
@click.option("--Cs", "C_s", metavar="NUMBER", help="Constant of w -> S(sigma_N(w)) into L2.")
@click.option("--Ctr", "C_tr", metavar="NUMBER", help="Constant of the tangential trace into L2.")
@click.option("--k", "k", metavar="NUMBER", help="Coefficient of friction.")
@click.option("--CK", "C_K", metavar="NUMBER", help="Product k Cs Ctr (stress), instead of those three.")
@click.option("--theta", "theta", metavar="NUMBER", help="Relaxation factor, 0 < theta < 1.")
@click.option(
    "--edition",
    type=click.Choice([*(edition.name for edition in EDITIONS), "both"]),
    default="both",
    show_default=True,
    help="Editions of Section 5.",
)
@click.option("--rho", metavar="NUMBER", help="Bound in energy norms: stiffness ratio of the bodies on Gamma_c.")
@click.option("--kappa1", "kappa_1", metavar="NUMBER", help="Bound in energy norms: k C_s C_t1; 0 without friction.")
@click.option("--kappa2", "kappa_2", metavar="NUMBER", help="Bound in energy norms: k C_s C_t2; 0 without friction.")
@click.option("--check", is_flag=True, help="Exit 1 unless contraction at theta is proved.")
@click.option("--json", "as_json", is_flag=True, help="One JSON document on stdout.")
def bounds(edition: str, theta: str | None, check: bool, as_json: bool, **given: str | None) -> int:
    """For which theta and friction does one step contract?

    Numbers may be rationals (1/3).  m, M, Cs and CK are in any one unit of stress; the printed theorem depends on
    which, the repaired one does not.  --rho, --kappa1 and --kappa2, dimensionless, give the theorem in energy norms
    (`ndtheory constants` measures all of them), beside the others or alone.

    \b
    Examples, m and M in MPa:
      ndtheory bounds --m 3084 --M 153229 --CR 1.70 --CK 1e-8 --theta 1e-4
      ndtheory bounds --rho 0.475 --kappa1 0.986 --kappa2 0.427 --theta 0.7
    """
    of_section_5 = {key: given[key] for key in CONSTANTS}
    of_norms = {key: given[key] for key in ENERGY}
    if check and theta is None:
        raise click.UsageError("--check needs --theta", click.get_current_context())
    alone = of_norms["rho"] is not None and not any(
        of_section_5[key] is not None for key in ("m", "M", "C_R", "C_K", "C_s", "C_tr")
    )
    constants = None if alone else _constants(of_section_5)
    friction = (
        take("k", 0 if given["k"] is None else given["k"], "a number k >= 0", lambda k: k >= 0)
        if constants is None
        else constants.C_K
    )
    energy = _energy(of_norms, friction > 0)
    subject = Subject(constants=constants, energy=energy)
    results = {}
    for name, bound in BOUNDS.items():
        if not bound.calculated:
            continue
        of_paper = isinstance(bound, Section5)
        if of_paper and (alone or edition not in (name, "both")):
            results[name] = bound.absent("needs --m, --M, --CR and --CK" if alone else "not asked for")
        elif not of_paper and energy is None:
            results[name] = bound.absent("needs --rho, and --kappa1, --kappa2 with friction")
        else:
            results[name] = bound.evaluate(subject, theta)
    if as_json:
        inputs: dict[str, Any] = {key: None if constants is None else getattr(constants, key) for key in CONSTANTS}
        inputs |= {key: None if energy is None else getattr(energy, key) for key in ENERGY}
        inputs["theta"] = None if theta is None else relaxation_factor(theta)
        absent = dict.fromkeys((key for key, value in inputs.items() if value is None), "not given")
        inputs = {key: None if value is None else float(value) for key, value in inputs.items()} | {"reason": absent}
        say(BoundsDocument(inputs, results).to_json(), lines=True)
    else:
        _screen(constants, {name: result for name, result in results.items() if not result.not_computed})
    proved = any(result.factor is not None and result.proved for result in results.values())
    return 1 if check and not proved else 0


def _constants(given: Mapping[str, str | None]) -> Constants:
    for key in ("m", "M", "C_R"):
        if given[key] is None:
            needed = "needed --m, --M, --CR and --CK, or --rho"
            raise click.UsageError(f"{CONSTANTS[key]} is missing: {needed}", click.get_current_context())
    return Constants(**given)


def _energy(given: Mapping[str, str | None], rubs: bool) -> EnergyConstants | None:
    """The constants of the bound in energy norms; None where they were not given."""
    missing = [ENERGY[key] for key in ENERGY if given[key] is None]
    if len(missing) == len(ENERGY):
        return None
    if given["rho"] is None or len(missing) == 1 or (rubs and missing):
        needed = "the bound in energy norms needs --rho, and with friction --kappa1 and --kappa2"
        raise click.UsageError(f"{', '.join(missing)} missing: {needed}", click.get_current_context())
    try:
        return EnergyConstants(**{key: value for key, value in given.items() if value is not None})
    except HypothesisError as error:
        raise HypothesisError(ENERGY[error.key], error.value, error.needed) from None


def bounds_table(rows: Sequence[BoundResult], unit: str) -> None:
    """Print the bounds, in which unit of stress the printed one speaks, and which factor below the last occurs.

    Parameters
    ----------
    rows : sequence of BoundResult
    unit : str
        "MPa", or what the unit of stress is that of.
    """
    rows = [row if row.proved else row.in_doubles() for row in rows]
    friction, theta = bounded(rows), rows[0].theta
    end = [] if theta is None else [f"theta = {theta:.4g}"]
    lines = [
        ["", "every small", "some", "", "", *([] if theta is None else [""])],
        ["bound", f"theta {friction} <", f"theta {friction} <", "theta allowed", "factor", *end],
    ]
    for row in rows:
        interval = "-" if row.interval is None else marked(_ends(*row.interval, row.interval_level), row.interval_level)
        line = [row.name, *_allowed(row), interval, factor(row.factor, row.one_minus_factor)]
        if theta is not None:
            line.append("no conclusion" if row.factor is None else marked("contracts", row.level))
        lines.append(line)
    table(lines, heads=2)
    notes = [f"printed: with stresses in {unit}" for row in rows if row.name == "printed"]
    attained = [row.detail for row in rows if row.name == "lmi"]
    notes += [f"lmi: {found.lower:.3f} occurs for some loads, {found.gap:.2%} less" for found in attained]
    if notes:
        note("; ".join(notes) if attained else f"{notes[0]}; in another unit its figures are others", "  ")
    for found in attained:
        if found.divided is not None:
            doubles = figures(found.divided, 4)
            note(f"lmi: proved is the factor of one program; dividing the pieces of T gives {doubles} in doubles", "  ")
    if any(row.marked for row in rows):
        note(LEGEND, "  ")


def _allowed(row: BoundResult) -> list[str]:
    """The two thresholds on friction."""
    friction = row.friction
    if friction.on == "any":
        return ["any", "any"]
    times = " x this" if friction.on == "multiple" else ""
    return ["-" if value is None else at_least(value) + times for value in (friction.every, friction.some)]


def _ends(low: float, high: float, level: Level) -> str:
    """An interval, its ends rounded inward where each theta in it is proved to contract."""
    if level == "float":
        return f"({low:.3g}, {figures(high)})"
    return f"({rounded(low, 3, up=True)}, {rounded(high, 3, up=False)})"


def _screen(constants: Constants | None, results: Mapping[str, BoundResult]) -> None:
    if constants is not None:
        values = ", ".join(f"{key} = {figures(float(getattr(constants, key)))}" for key in ("m", "M", "C_R", "C_K"))
        say(values + ("" if constants.k is None else f" (k = {figures(float(constants.k))})"))
    details = {name: result.detail for name, result in results.items()}
    energy = details.get("energy")
    if isinstance(energy, EnergyBounds):
        say(", ".join(f"{key} = {figures(getattr(energy, key))}" for key in ENERGY))
    heading("DOES ONE STEP CONTRACT?")
    bounds_table(list(results.values()), "the unit of --m")
    section_5 = {name: found for name, found in details.items() if isinstance(found, Bounds)}
    if section_5:
        heading("THE CONSTANTS OF SECTION 5")
        names = ["C_T", "C0", "C1", "C2", "C3", "C4", "C5", "C6"]
        some = next(iter(section_5.values()))
        rows = [["", *section_5, "unit"]]
        for name in names:
            unit = f"on {some.threshold_on}" if name in ("C2", "C3", "C4", "C5") else "1"
            rows.append([name, *(figures(getattr(b, name), 6) for b in section_5.values()), unit])
        table(rows, right=range(1, len(section_5) + 1))
    if isinstance(energy, EnergyBounds):
        thetas(energy)
    say()
    if not all(b.proved for b in section_5.values()):
        note(on_the_printed_proof())
    say("Next: ndtheory example section6 > my.toml; ndtheory constants my.toml")


def thetas(energy: EnergyBounds) -> None:
    """Show the theta with the least proved factor, and the predicted one."""
    heading("WHICH THETA?")
    rows = [["", "theta", "factor", ""]]
    if energy.theta_proved is None:
        rows.append(["proved", "-", "-", "q >= 1 for every theta: no conclusion"])
    else:
        rows.append(["proved", figures(energy.theta_proved), figures(energy.factor_proved), "least proved factor"])
    frictionless = energy.friction_multiple is None
    note = "proved too: there is no friction" if frictionless else "2/(2 + rho), not a bound"
    rows.append(["predicted", figures(energy.theta_predicted), figures(energy.rate_predicted), note])
    table(rows)
