"""What ``advise`` shows of the moduli of two bodies."""

from __future__ import annotations

from verification.advice.roles import Advice
from verification.advice.seen_moduli import Corners, ModuliRole, SeenModuli, Start, excluded_from
from verification.cli.console import figures, heading, near_one, note, say, table

PLANES = {"strain": "plane strain", "stress": "plane stress", "3d": "three-dimensional"}
ENDS: dict[Corners, str] = {
    "none": "any geometry",
    "1": "corners of body 1",
    "2": "corners of body 2",
    "both": "corners of both bodies",
}


def moduli(found: Advice, seen: SeenModuli) -> None:
    """The screen of ``advise --young --poisson``."""
    say()
    each = (f"body {i}: E = {float(b.young):.5g}, nu = {float(b.poisson):.5g}" for i, b in enumerate(seen.bodies, 1))
    note(f"{' | '.join(each)} | {PLANES[seen.bodies[0].plane]}")
    _bounds(seen)
    _excluded(seen)
    _who(found, seen)
    started = [role for role in seen.roles if role.start is not None]
    _start(started)
    tried = next((role for role in started if found.neumann_body in (role.neumann_body, None)), None)
    if tried is not None and tried.start is not None:
        _paste(tried, tried.start)
    elif found.next is not None:
        heading("WHICH RUN NEXT?")
        note(f"theta = {found.next.theta:g}: {found.next.why}", "  ")
    say()
    say("Not claimed: a bound of rho from above with friction, or where no image fits.")
    if found.next is not None:
        say(f"Next: ndtheory advise --theta {found.next.theta:g} --ratio R (R: the ratio of that run)")


def _bounds(seen: SeenModuli) -> None:
    heading("HOW LARGE IS RHO AT LEAST?")
    rows = [["Neumann problem on", "body 1", "", "body 2", ""]]
    rows.append(["where a piece of Gamma_c", "sticks", "slides", "sticks", "slides"])
    for name, words in ENDS.items():
        if seen.corners not in (None, name) and name != "none":
            continue
        row = [words]
        for role in seen.roles:
            bounds = role.corners[name]
            row += [figures(bounds.stick), figures(bounds.slide)]
        rows.append(row)
    table(rows, heads=2)
    note(
        "Proved for the continuum, where both bodies are homogeneous and isotropic near one inner point of Gamma_c, "
        "or near a corner of 90 degrees at its end; fine meshes come close. rho may be larger.",
        "  ",
    )


def _excluded(seen: SeenModuli) -> None:
    heading("WHICH THETAS CANNOT CONTRACT ON FINE MESHES?")
    stuck = "where a piece may stick" if seen.corners in (None, "none") else "where a piece at such an end may stick"
    for role in seen.roles:
        bounds = seen.bounds(role)
        parts = [
            f"{figures(theta)} and above {where}"
            for theta, where in (
                (excluded_from(bounds.stick), stuck),
                (excluded_from(bounds.slide), "without friction"),
            )
            if theta is not None
        ]
        note(f"body {role.neumann_body}: {', '.join(parts) or 'none up to 1 is excluded'}", "  ")


def _who(found: Advice, seen: SeenModuli) -> None:
    heading("WHICH BODY GETS THE NEUMANN PROBLEM?")
    free = seen.smaller("slide")
    if seen.smaller("stick") is None and free is None:
        says = "No difference: the bounds of both roles are the same"
        says += "." if seen.corners else ", unless one body ends in corners."
    elif found.neumann_body is not None:
        says = f"Try body {found.neumann_body}: the bound is smaller. Two lower bounds prove no order of the roles."
        if free not in (None, found.neumann_body):
            says += f" Without friction body {free} has the smaller one."
    note(says, "  ")


def _start(started: list[ModuliRole]) -> None:
    heading("WHICH THETA TO START WITH?")
    if not started:
        note("None: a lower bound of rho gives no theta, 2/(2 + bound) can diverge.", "  ")
        note("If the mirror image of a body fits into the other one, say --mirror.", "  ")
        return
    for role in started:
        start = role.start
        assert start is not None
        rate = near_one(start.factor_free(start.theta_free).value)
        note(
            f"body {role.neumann_body}, without friction: theta = {start.theta_free:.4g}, factor {rate} a step, "
            f"proved: rho_normal <= {figures(float(start.s))} by the mirror image, in the continuum and on nested "
            "meshes",
            "  ",
        )
        note(
            f"body {role.neumann_body}, with friction: theta = {start.theta_guess:.4g}, a guess: rho at "
            f"most {figures(start.guess)}, as with {start.guessed_from}",
            "  ",
        )


def _paste(role: ModuliRole, start: Start) -> None:
    heading("TO PASTE")
    say(f"  neumann_body = {role.neumann_body}")
    say(f"  theta = {start.theta_guess:g}")
    say(f'  <acceleration:constant><relaxation value="{start.theta_guess:g}" /></acceleration:constant>')
