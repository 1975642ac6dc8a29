"""Sections of advice from material data: elastic bodies, plates that exchange heat, a fluid at a wall."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from verification.coupling.advice import Advice
from verification.coupling.kinds import LARGEST_TO_PASTE
from verification.coupling.readings import NextRun, rounded_down
from verification.coupling.sections import next_run, of, pasted, pasted_for, reads, which_body, which_method
from verification.coupling.seen_moduli import Corners, ElasticBodies, ModuliRole, excluded_from
from verification.coupling.waves import Fluid, Heat, Waves
from verification.show.numbers import figures, near_one, rounded
from verification.show.parts import Cell, Facts, Section, Sections, Table, closing, section, table

#: What the bodies are called.
Names = Mapping[int | None, str]

PLANES = {"strain": "plane strain", "stress": "plane stress", "3d": "three-dimensional"}
ENDS: dict[Corners, str] = {
    "none": "any geometry",
    "1": "corners of body 1",
    "2": "corners of body 2",
    "both": "corners of both bodies",
}


@of.register
def _of_moduli(seen: ElasticBodies, found: Advice) -> Sections:
    """The sections of advice from moduli."""
    each = (f"body {i}: E = {float(b.young):.5g}, nu = {float(b.poisson):.5g}" for i, b in enumerate(seen.bodies, 1))
    started = [role for role in seen.roles if role.start is not None]
    first = seen.next_run()
    last = (pasted(seen.tried.neumann_body, first.theta),) if seen.tried.start else ()
    then = f"ndtheory advise run {seen.kind.typed}--theta {first.theta:g} --ratio R (R: the ratio of that run)"
    return (
        section("setting", "", Facts("", (*each, PLANES[seen.bodies[0].plane]))),
        _least_rho(seen),
        _excluded(seen),
        _who(found, seen),
        *_parallel(found, {1: "body 1", 2: "body 2"}),
        _start(started, None if last else first, seen.kind.parallel),
        *last,
        closing("a bound of rho from above with friction, or where no image fits", then=then),
    )


def _least_rho(seen: ElasticBodies) -> Section:
    heads = (
        ("Neumann problem on", "body 1", "", "body 2", ""),
        ("where a piece of Gamma_c", "sticks", "slides", "sticks", "slides"),
    )
    rows: list[tuple[Cell, ...]] = []
    for name, words in ENDS.items():
        if seen.corners in (None, name) or name == "none":
            bounds = [role.corners[name] for role in seen.roles]
            rows.append((words, *(figures(end) for bound in bounds for end in (bound.stick, bound.slide))))
    proved = (
        "Proved without a mesh if both bodies are homogeneous and isotropic near one inner point of Gamma_c, or near a "
        "corner of 90 degrees at its end. On fine meshes rho is close to it, or larger."
    )
    return section("bounds", "HOW LARGE IS RHO AT LEAST?", Table(heads, tuple(rows)), proved)


def _excluded(seen: ElasticBodies) -> Section:
    stuck = "where a piece may stick" if seen.corners in (None, "none") else "where a piece at such an end may stick"
    notes = []
    for role in seen.roles:
        bounds = seen.bounds(role)
        kinds = ((excluded_from(bounds.stick), stuck), (excluded_from(bounds.slide), "without friction"))
        found = [f"{rounded(theta, 3, up=True)} and above {where}" for theta, where in kinds if theta is not None]
        notes.append(f"body {role.neumann_body}: {', '.join(found) or 'none up to 1 is excluded'}")
    return section("excluded", "WHICH THETAS CANNOT CONTRACT ON FINE MESHES?", *notes)


def _who(found: Advice, seen: ElasticBodies) -> Section:
    free, says = seen.smaller("slide"), ""
    if seen.smaller("stick") is None and free is None:
        says = "No difference: the bounds of both roles are the same"
        says += "." if seen.corners else ", unless one body ends in corners."
    elif found.neumann_body is not None:
        says = f"Try body {found.neumann_body}: the bound is smaller. Lower bounds cannot prove which role is better."
        if free not in (None, found.neumann_body):
            says += f" Without friction body {free} has the smaller one."
    return which_body(says)


def _start(started: Sequence[ModuliRole], first: NextRun | None, parallel: bool) -> Section:
    notes = []
    for role in started:
        start, body = role.start, f"body {role.neumann_body}"
        assert start is not None
        rate = near_one(start.factor_free(start.theta_free).value)
        notes += [
            f"{body}, without friction: theta = {start.theta_free:.4g}, factor {rate} a step, proved: rho_normal <="
            f" {rounded(float(start.s), 3, up=True)} by the mirror image, in the continuum and on nested meshes",
            f"{body}, with friction: theta = {start.theta_guess:.4g}, a guess: rho at most {figures(start.guess)}, as"
            f" with {start.guessed_from}",
        ]
    if first is not None:
        notes.append(f"theta = {first.theta:g}, a guess: {first.why}")
    if not started:
        notes[-1] += ". One is proved where the mirror image of a body fits into the other one: --shape mirror-1 or -2"
    elif parallel:
        notes.append("These are for serial coupling; the theta to paste is 1/(1 + rho) with the guess of rho.")
    return section("start", "WHICH THETA TO START WITH?", *notes)


@of.register
def _of_heat(seen: Heat, found: Advice) -> Iterator[Section]:
    names: Names = {1: "the fluid", 2: "the wall"} if seen.first == "film" else {1: "plate 1", 2: "plate 2"}
    yield _setting(seen)
    body = found.neumann_body or 2
    said = [reads(names[body], names[3 - body], "fluxes", "temperatures")]
    said += [f"With the roles exchanged: {role.reason['rho']}." for role in found.roles if role.rho is None]
    if found.no_difference and len({figures(role.rho_tied) for role in found.roles}) == 1:
        said.append("It makes no difference with the roles exchanged.")
    yield which_body(*said)
    yield _theta_of_heat(found, seen, names)
    yield from _parallel(found, names)
    yield from which_method(found, names)
    relaxed = "Fluxes and temperatures are both relaxed." if found.parallel else "For temperatures the same."
    yield pasted_for(found, None, relaxed, data=("Heat-Flux", "Temperature"))
    claims = "anything about plates that are not flat, or coarse meshes; the command below reads those"
    yield closing(
        claims, then=f"ndtheory advise vectors {seen.kind.typed}X.npy TX.npy (iterates of a run: your shapes)"
    )


@of.register
def _of_fluid(seen: Fluid, found: Advice) -> Iterator[Section]:
    names: Names = {1: "the fluid", 2: "the wall"}
    yield _setting(seen)
    refused = f"With the roles exchanged: {found.roles[1].reason['rho']}."
    yield which_body(reads(names[2], names[1], "pressures"), refused)
    yield _bounds_of_fluid(found, seen)
    yield from _parallel(found, names)
    yield from which_method(found, names)
    yield next_run(seen.next_run())
    then = f"ndtheory advise run {seen.kind.typed}--theta {seen.next_run().theta:g} --ratio R"
    yield closing("a bound of rho from above, or anything with a viscous or compressible fluid", then=then)


def _setting(seen: Waves) -> Section:
    data = (f"{name} {', '.join(f'{float(v):.5g}' for v in values)}" for name, values in seen.given.items())
    return section("setting", "", Facts("", tuple(data)))


def _theta_of_heat(found: Advice, seen: Heat, names: Names) -> Section:
    """Both ends of the spectrum of two plates, and the theta for them."""
    rows: list[tuple[Cell, ...]] = []
    possible = [role for role in found.roles if role.rho is not None]
    for role in possible:
        ends = figures(role.rho_min), figures(role.rho_tied)
        theta = rounded_down(min(role.theta_tied or 0, LARGEST_TO_PASTE))
        best = figures(theta), near_one(role.factor_where_tied(theta) or 0)
        limit = None if role.rho_tied is None else excluded_from(role.rho_tied)
        diverges = "never" if limit is None else rounded(limit, 3, up=True)
        rows.append((names[role.neumann_body or 2], *ends, *best, diverges))
    thick, dt = "thickness" not in seen.given, seen.one("dt")
    of, over = f"flat {'thick ' * thick}plates: conductance of the plate that reads temperatures", "the other one's"
    if seen.first == "film":
        of, over = f"a flat {'thick ' * thick}wall: the film coefficient", "the wall's conductance"
    both = "least and largest over all waves of temperature, proved in the continuum"
    notes = [f"For {of} over {over}, {both}; theta = 2/(2 + least + largest)."]
    if dt is not None:
        pairs = zip(seen.given["conductivity"], seen.given["capacity"], strict=True)
        reach = " and ".join(f"{3 * math.sqrt(k * dt / c):.3g}" for k, c in pairs)
        notes.append(f"In dt heat reaches 3 sqrt(k dt/c), {reach}, into a plate; a thicker one counts as thick.")
    elif "capacity" in seen.given:
        notes.append("This holds for every step in time dt. A plate of more than 3 sqrt(k dt/c) counts as thick.")
    if "capacity" in seen.given and seen.first != "film":
        coarse = "Cells must be smaller than sqrt(k dt/c): with larger ones lambda is c times cell height over the same"
        notes.append(f"{coarse} of the other plate, and this theta may diverge.")
    elif not thick:
        held = "The wall is held at a given temperature on its other side."
        plates = "Both plates are held at given temperatures on their other sides."
        notes.append(held if seen.first == "film" else plates)
    if found.parallel:
        notes.append("These thetas and factors are for serial coupling.")
    heads = ("reads fluxes", "least", "largest", "theta", "factor a step", "diverges from")
    return section("theta", "WHICH THETA?", table(heads, rows), *notes)


def _bounds_of_fluid(found: Advice, seen: Fluid) -> Section:
    """The lower bound of rho of a fluid and a wall, and the thetas that it excludes."""
    rho = found.roles[0].rho
    assert rho is not None
    short = "" if "young" in seen.given else ", where steps in time are so short that stiffness does not count"
    where = "tube" if len(seen.given["length"]) == 2 else "square over the plate"
    notes = (
        f"rho >= {rounded(rho.value, 3, up=False)}: added mass over the mass of the wall, for the longest wave{short}",
        f"Proved if the fluid fills the {where}, has no viscosity and is incompressible, and both solvers use one time "
        "scheme.",
        f"Theta from {rounded(2 / (1 + rho.value), 3, up=True)} on diverges."
        if rho.value > 1
        else "No theta up to 1 is excluded.",
    )
    return section("bounds", "HOW LARGE IS RHO AT LEAST?", *notes)


def _parallel(found: Advice, names: Names) -> Sections:
    """theta and factor of parallel coupling for each role, where it was asked for."""
    if not found.parallel:
        return ()
    notes = ["A mode lambda is multiplied by 1 - theta +- i theta sqrt(lambda) where nothing opens or slips."]
    for one in found.parallel:
        most, least = ("at most ", "at least ") if one.bound else ("", "")
        best = (
            f"Neumann problem on {names[one.neumann_body or 2]}: best theta = 1/(1 + rho), {most}{figures(one.theta)}"
        )
        notes.append(f"{best}; factor {least}{near_one(one.factor)} a step")
    return (section("parallel", "WHAT IF BOTH SOLVERS RUN AT ONCE?", *notes),)
