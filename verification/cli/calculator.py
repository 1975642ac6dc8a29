"""``ndtheory bounds``: the bound calculator, without finite elements."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import click

from ndtheory import EDITIONS, Bounds, Constants, evaluate, relaxation_factor
from verification.cli.console import factor, figures, heading, say, table
from verification.document import Document


class BoundsDocument(Document):
    """``ndtheory.bounds/1``."""

    schema: ClassVar[str] = "ndtheory.bounds/1"
    units: Mapping[str, str] = {"length": "any", "stress": "that of m"}

    def __init__(self, inputs: Mapping[str, Any], editions: Mapping[str, Bounds]) -> None:
        self.inputs, self.editions = inputs, editions

    def content(self) -> dict[str, Any]:
        return {
            "inputs": dict(self.inputs),
            "editions": {
                **dict.fromkeys(("printed", "repaired")),
                **{name: bounds.to_dict() for name, bounds in self.editions.items()},
                "sharp": None,
            },
            "reason": {
                **{e.name: "not asked for" for e in EDITIONS if e.name not in self.editions},
                "sharp": "not computed by this version",
            },
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
    type=click.Choice(["printed", "repaired", "both"]),
    default="both",
    show_default=True,
    help="Edition of the theorem.",
)
@click.option("--rho", metavar="NUMBER", help="For the sharp edition (not supported yet).")
@click.option("--kappa1", metavar="NUMBER", help="For the sharp edition (not supported yet).")
@click.option("--kappa2", metavar="NUMBER", help="For the sharp edition (not supported yet).")
@click.option("--check", is_flag=True, help="Exit 1 unless contraction at theta is proved.")
@click.option("--json", "as_json", is_flag=True, help="One JSON document on stdout.")
def bounds(
    edition: str, theta: str | None, check: bool, as_json: bool, rho: Any, kappa1: Any, kappa2: Any, **given: str | None
) -> int:
    """For which theta and friction does one step contract?

    Numbers may be rationals (1/3).  m, M, Cs and CK are in any one unit of stress; the printed theorem depends on
    which, the repaired one does not.

    \b
    Example, m and M in MPa:
      ndtheory bounds --m 3084 --M 153229 --CR 1.70 --CK 1e-8 --theta 1e-4
    """
    for name, value in (("--rho", rho), ("--kappa1", kappa1), ("--kappa2", kappa2)):
        if value is not None:
            raise click.UsageError(
                f"{name} = {value}: the sharp edition is not supported yet", click.get_current_context()
            )
    for key, option in (("m", "--m"), ("M", "--M"), ("C_R", "--CR")):
        if given[key] is None:
            raise click.UsageError(f"{option} is missing: needed --m, --M, --CR and --CK", click.get_current_context())
    if check and theta is None:
        raise click.UsageError("--check needs --theta", click.get_current_context())
    constants = Constants(**given)
    chosen: dict[str, Bounds] = {e.name: evaluate(e, constants, theta) for e in EDITIONS if edition in (e.name, "both")}
    if as_json:
        inputs: dict[str, Any] = {key: getattr(constants, key) for key in given}
        inputs["theta"] = None if theta is None else relaxation_factor(theta)
        absent = dict.fromkeys((key for key, value in inputs.items() if value is None), "not given")
        inputs = {key: None if value is None else float(value) for key, value in inputs.items()} | {"reason": absent}
        say(BoundsDocument(inputs, chosen).to_json())
    else:
        _screen(constants, chosen)
    proved = any(b.verdict == "contraction" and b.proved for b in chosen.values())
    return 1 if check and not proved else 0


def edition_rows(editions: Mapping[str, Bounds], steps: bool = False) -> list[list[str]]:
    """The table of editions, head first; friction on k where that is known, else on C_K."""
    some = next(iter(editions.values()))
    head = ["edition", "friction allowed", "theta allowed", "factor"]
    if some.theta is not None:
        head.append(f"theta = {some.theta:.4g}")
    rows = [head]
    for name, b in editions.items():
        allowed = "any" if b.C2 is None else f"{b.threshold_on} < {figures(b.C2)}"
        interval = "-" if b.interval is None else f"{b.interval[0]:.3g} < theta < {figures(b.interval[1])}"
        row = [name, allowed, interval, factor(b.factor, b.one_minus_factor)]
        if b.theta is not None:
            row.append("contracts" if b.verdict == "contraction" else "no conclusion")
        rows.append(row)
    return rows


def _screen(constants: Constants, editions: Mapping[str, Bounds]) -> None:
    values = ", ".join(f"{key} = {figures(float(getattr(constants, key)))}" for key in ("m", "M", "C_R", "C_K"))
    say(values + ("" if constants.k is None else f" (k = {figures(float(constants.k))})"))
    heading("DOES ONE STEP CONTRACT?")
    table(edition_rows(editions))
    heading("THE CONSTANTS OF SECTION 5")
    names = ["C_T", "C0", "C1", "C2", "C3", "C4", "C5", "C6"]
    some = next(iter(editions.values()))
    rows = [["", *editions, "unit"]]
    for name in names:
        unit = f"on {some.threshold_on}" if name in ("C2", "C3", "C4", "C5") else "1"
        rows.append([name, *(figures(getattr(b, name), 6) for b in editions.values()), unit])
    table(rows, right=range(1, len(editions) + 1))
    say()
    for name, b in editions.items():
        if not b.proved:
            say(f"The {name} proof needs m >= 1: below it (5.30) does not follow.")
    say("Next: ndtheory example section6 > my.toml; ndtheory constants my.toml")
