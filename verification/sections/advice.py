"""Advice: roles and theta, from a problem, from matrices, from runs or from moduli."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from verification.advice.readings import LARGEST_TO_PASTE
from verification.advice.role import Role, in_steps, steps
from verification.advice.roles import Advice
from verification.advice.snippets import SNIPPETS
from verification.problem.reading import takes_theta
from verification.sections import logs, moduli
from verification.sections.advised import given, pasted, which_body
from verification.sections.numbers import NONE, count, figures, near_one
from verification.sections.parts import Block, Cell, Next, Section, Sections, closing, following, of, section, table
from verification.sections.setting import outside_the_theorem

NAMES = {1: "body 1", 2: "body 2", None: "as in that run"}


@of.register
def sections(found: Advice) -> Sections:
    """The sections."""
    return moduli.sections(found, found.moduli) if found.moduli is not None else tuple(_sections(found))


def _sections(found: Advice) -> Iterator[Section]:
    if found.assumes is not None:
        yield logs.assumed(found)
    if found.matrices is not None:
        yield given(found.matrices)
    if found.run is not None:
        yield from logs.of_a_run(found, found.run)
    if found.interval is not None:
        yield from logs.of_logs(found, found.interval)
        if found.roles:
            others = "Predicted for the roles that the bodies have; logs tell nothing of the other assignment."
            yield _paste(found, others)
    if found.roles and not found.logs:
        yield _which_body(found)
        yield _which_theta(found)
        yield from _friction(found)
        yield _paste(found)
        if found.quote is not None:
            yield section("quote", "TO QUOTE", found.quote)
    yield _end(found)


def _end(found: Advice) -> Section:
    """The limits of the advice, and the command to type next."""
    outside = map(outside_the_theorem, found.outside)
    if found.next is None:
        tied = "that nothing opens or slips"
        claims = tied if found.tied else "that the predicted theta is the best one for your loads"
        return closing(claims, *outside, then=_after_a_problem(found))
    theta = f"{found.next.theta:g}"
    assumed = "--tied " * found.tied + "--friction " * (found.friction_bounds is not None)
    if found.next.kept and not found.roles:
        then = f"no run; keep theta = {theta}"
    elif found.logs:
        then = f"the same with --log LOG --theta {theta} (LOG: the log of that run)"
    else:
        then = f"ndtheory advise run {assumed}--theta {theta} --ratio R (R: its ratio)"
    return closing("a bound of rho with friction, or that a reading is the right one", *outside, then=then)


def _after_a_problem(found: Advice) -> Next | str:
    if found.problem is None:
        return "ndtheory advise --help"
    if found.best.theta_auto is None:  # too large for a run
        return following("constants")
    taken = found.theta is not None and takes_theta(found.problem.iteration.relaxation)
    theta = ["--theta", f"{found.theta:g}"] if taken else []
    return following("run", *theta, exchanged=found.roles[0].neumann_body != found.neumann_body)


def _which_body(found: Advice) -> Section:
    """Which body gets the Neumann problem, what exchanging the roles changes, and who reads what."""
    best, other = found.best, found.other
    if found.neumann_body is None:
        said = ["One run tells nothing of the other assignment."]
        neumann, contact = "the Neumann body", "the contact body"
    else:
        rate = found.chosen(best)[1]
        kind = "rate if tied" if found.tied else "predicted rate"
        said = [f"{NAMES[found.neumann_body]}: {kind} {near_one(rate)} a step, {in_steps(rate)} to 1e-9,"]
        if other is None:
            refused = next(role for role in found.roles if role is not best)
            said.append(f"{NAMES[refused.neumann_body]}: {refused.reason['rho']}")
        elif found.no_difference:
            said.append("and no difference with the roles exchanged")
        else:
            away = found.chosen(other)[1]
            said.append(f"against {near_one(away)} with the roles exchanged, {in_steps(away)}")
        neumann, contact = NAMES[found.neumann_body], f"{NAMES[3 - found.neumann_body]}, the contact body,"
    writes = "reads forces and writes displacements", "reads displacements and writes forces"
    said.append(f"The solver of {neumann} {writes[0]}, that of {contact} {writes[1]}.")
    return which_body(*said)


def _which_theta(found: Advice) -> Section:
    """What is predicted and proved of each role, what holds if nothing opens or slips, and what "auto" takes."""
    rows: list[tuple[Cell, ...]] = []
    why = {}
    possible = [role for role in found.roles if role.rho is not None]
    for role in possible:
        name, rate = NAMES[role.neumann_body], role.predicted[1]
        theta, bound = figures(role.theta_predicted), "proved" if role.proved else "not a bound"
        rows.append((name, figures(role.rho), "predicted", theta, near_one(rate), count(steps(rate)), bound))
        if role.factor_proved is not None and role.theta_proved is not None:
            q = role.factor_proved.value
            level = role.factor_proved.level
            factor = replace(near_one(q), level=level)
            rows.append(("", "", "proved", figures(role.theta_proved), factor, count(steps(q), "<= "), ""))
        else:
            rows.append(("", "", "proved", NONE, NONE, NONE, "no conclusion"))
            if role.theta_auto is None:  # which says it below
                why[name] = role.reason["theta_proved"]
        if role.theta_tied is not None and role.rate_tied is not None:
            rate = role.rate_tied
            numbers = (figures(role.theta_tied), near_one(rate), count(steps(rate), "<= "))
            rows.append(("", "", "if tied", *numbers, _at_predicted(role)))
        elif found.tied:
            why[name] = role.why_not_tied
    said = [*_together(why), "predicted: theta = 2/(2 + rho); proved: the theta of least proved factor"]
    ends = [
        f"{figures(role.rho_min)}, {figures(role.rho_tied)} ({NAMES[role.neumann_body]})"
        for role in possible
        if role.ends is not None
    ]
    if ends:
        said.append(f"if tied, nothing opens or slips: 2/(2+rho_min+rho) of {', '.join(ends)}")
    said.append(f"steps: to 1e-9 of the first error{'; at the end those of the predicted theta' * bool(ends)}")
    for role in possible:
        auto = role.theta_auto
        if auto is not None:
            takes = f'theta = "auto" takes {float(auto.theta):.4g}, the {auto.source} one: {auto.why}'
            said.append(f"{NAMES[role.neumann_body]}: {takes}")
    lines = table(("Neumann", "rho", "", "theta", "rate", "steps", ""), rows)
    return section("theta", "WHICH THETA?", lines, *said)


def _at_predicted(role: Role) -> str:
    """The steps of the predicted theta where nothing opens or slips."""
    theta = role.predicted[0]
    rate = role.factor_where_tied(theta)
    if rate is None or rate >= 1:
        return f"grows at {figures(theta)}"
    return f"{count(steps(rate))} at {figures(theta)}"


def _friction(found: Advice) -> Iterator[Section]:
    """How much friction is proved."""
    if found.friction is None:
        return
    said = {}
    for role in found.roles:
        if role.rho is None:
            continue
        said[NAMES[role.neumann_body]] = role.reason.get("friction_threshold", "")
        if role.friction_threshold is not None:
            allowed = f"every small theta contracts for k < {figures(role.friction_threshold)}"
            said[NAMES[role.neumann_body]] = f"{allowed} (here k = {figures(found.friction, 2)})"
    yield section("friction", "HOW MUCH FRICTION IS PROVED?", *_together(said))


def _together(said: Mapping[str, str]) -> list[str]:
    """What is to be said of each role, once where it is the same of both."""
    return [
        f"{', '.join(name for name, own in said.items() if own == text)}: {text}"
        for text in dict.fromkeys(said.values())
    ]


def _paste(found: Advice, *more: str) -> Section:
    """Lines to paste, and notes on them."""
    said = [f"Whole blocks: --snippets {', '.join(SNIPPETS)} or all."]
    auto = found.best.theta_auto
    if auto is not None and found.theta is not None:
        if found.theta == float(LARGEST_TO_PASTE) <= auto.theta:
            said.append(f'theta = "auto" takes {float(auto.theta):.4g}; {found.theta:g} is the largest to paste.')
        elif abs(found.theta - float(auto.theta)) <= 1e-3 * found.theta:
            said.append('This is what theta = "auto" takes, rounded.')
        elif found.tied:
            said.append('theta = "auto" takes another one, since contact may open and slip.')
        elif auto.source == "proved":
            said.append('theta = "auto" keeps to the proved one up to twice the predicted steps.')
    same = "The same theta for forces and displacements (heat: fluxes and temperatures) in serial coupling"
    said.append(f"{same}, not in parallel coupling.")
    said.append("Transient: rho is that of K + c M/dt^2; the better role may change with dt.")
    return pasted(found.neumann_body, found.theta, *said, *more)


def snippets(found: Advice, library: str) -> Sections:
    """The whole blocks for a library, or for all of them, each below its name."""
    names = list(SNIPPETS) if library == "all" else [library]
    titles = names if library == "all" else [""]
    return tuple(
        section(name, title, Block(tuple(found.snippet(name).split("\n"))))
        for name, title in zip(names, titles, strict=True)
    )
