"""Advice from nothing but the moduli of two bodies."""

from __future__ import annotations

from collections.abc import Sequence

from verification.advice.roles import Advice
from verification.advice.seen_moduli import Corners, ModuliRole, SeenModuli, excluded_from
from verification.sections.advised import next_run, pasted, which_body
from verification.sections.numbers import figures, near_one
from verification.sections.parts import Cell, Facts, Section, Sections, Table, closing, section

PLANES = {"strain": "plane strain", "stress": "plane stress", "3d": "three-dimensional"}
ENDS: dict[Corners, str] = {
    "none": "any geometry",
    "1": "corners of body 1",
    "2": "corners of body 2",
    "both": "corners of both bodies",
}


def sections(found: Advice, seen: SeenModuli) -> Sections:
    """The sections of advice from moduli."""
    each = (f"body {i}: E = {float(b.young):.5g}, nu = {float(b.poisson):.5g}" for i, b in enumerate(seen.bodies, 1))
    started = [role for role in seen.roles if role.start is not None]
    tried = next((role for role in started if found.neumann_body in (role.neumann_body, None)), None)
    then = ""
    if found.next is not None:
        theta = f"{found.next.theta:g}"
        then = f"ndtheory advise run --theta {theta} --ratio R (R: the ratio of that run)"
    last = []
    if tried is not None and tried.start is not None:
        last.append(pasted(tried.neumann_body, tried.start.theta_guess))
    elif found.next is not None:
        last.append(next_run(found.next))
    return (
        section("setting", "", Facts("", (*each, PLANES[seen.bodies[0].plane]))),
        _bounds(seen),
        _excluded(seen),
        _who(found, seen),
        _start(started),
        *last,
        closing("a bound of rho from above with friction, or where no image fits", then=then),
    )


def _bounds(seen: SeenModuli) -> Section:
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
        "Proved for the continuum, where both bodies are homogeneous and isotropic near one inner point of Gamma_c, "
        "or near a corner of 90 degrees at its end; fine meshes come close. rho may be larger."
    )
    return section("bounds", "HOW LARGE IS RHO AT LEAST?", Table(heads, tuple(rows)), proved)


def _excluded(seen: SeenModuli) -> Section:
    stuck = "where a piece may stick" if seen.corners in (None, "none") else "where a piece at such an end may stick"
    notes = []
    for role in seen.roles:
        bounds = seen.bounds(role)
        kinds = ((excluded_from(bounds.stick), stuck), (excluded_from(bounds.slide), "without friction"))
        found = [f"{figures(theta)} and above {where}" for theta, where in kinds if theta is not None]
        notes.append(f"body {role.neumann_body}: {', '.join(found) or 'none up to 1 is excluded'}")
    return section("excluded", "WHICH THETAS CANNOT CONTRACT ON FINE MESHES?", *notes)


def _who(found: Advice, seen: SeenModuli) -> Section:
    free, says = seen.smaller("slide"), ""
    if seen.smaller("stick") is None and free is None:
        says = "No difference: the bounds of both roles are the same"
        says += "." if seen.corners else ", unless one body ends in corners."
    elif found.neumann_body is not None:
        says = f"Try body {found.neumann_body}: the bound is smaller. Two lower bounds prove no order of the roles."
        if free not in (None, found.neumann_body):
            says += f" Without friction body {free} has the smaller one."
    return which_body(says)


def _start(started: Sequence[ModuliRole]) -> Section:
    notes = []
    for role in started:
        start, body = role.start, f"body {role.neumann_body}"
        assert start is not None
        rate = near_one(start.factor_free(start.theta_free).value)
        notes += [
            f"{body}, without friction: theta = {start.theta_free:.4g}, factor {rate} a step, proved: rho_normal <="
            f" {figures(float(start.s))} by the mirror image, in the continuum and on nested meshes",
            f"{body}, with friction: theta = {start.theta_guess:.4g}, a guess: rho at most {figures(start.guess)}, as"
            f" with {start.guessed_from}",
        ]
    if not started:
        notes.append("None: a lower bound of rho gives no theta, 2/(2 + bound) can diverge.")
        notes.append("If the mirror image of a body fits into the other one, say --mirror.")
    return section("start", "WHICH THETA TO START WITH?", *notes)
