"""Advice: roles and theta, from a problem, from matrices, from runs or from moduli."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from verification import registry
from verification.algorithm.rates import steps
from verification.constants.measured import NO_LAW
from verification.coupling.accelerated import Accelerated
from verification.coupling.cells import NARROW, Suggested
from verification.coupling.kinds import BodyNumber
from verification.coupling.methods import NAMES as METHOD_NAMES
from verification.coupling.readings import LARGEST_TO_PASTE, NextRun, RunReading, SeenRun
from verification.coupling.readings import assumed as assumption
from verification.coupling.roles import Advice, Role, in_steps
from verification.coupling.runs_with_friction import FrictionBounds
from verification.coupling.seen import LogBound, RhoInterval, SeenLog
from verification.coupling.seen_moduli import Corners, ModuliRole, SeenModuli, SeenWaves, excluded_from
from verification.coupling.sides import SeenMatrices
from verification.coupling.snippets import SNIPPETS, CouplingScheme, precice_acceleration
from verification.coupling.spectrum import SeenVectors
from verification.problem.readers import takes_theta
from verification.show.numbers import NONE, count, figures, near_one, rounded
from verification.show.parts import (
    Block,
    Cell,
    Facts,
    Next,
    Note,
    Quantity,
    Section,
    Sections,
    Table,
    closing,
    following,
    outside_the_theorem,
    section,
    table,
)


def _name(found: Advice, body: int | None) -> str:
    """Words for the Neumann body of a role."""
    return "as in that run" if body is None else found.words(body)


#: The next step where nothing is left to type.
AS_ABOVE = "your coupling, with the lines above"

#: What it takes to exchange the roles of solvers that are already coupled.
EXCHANGED = (
    "To exchange the roles, the second solver, which now reads displacements (temperatures), must take forces "
    "(fluxes), and the first the reverse. To swap two arguments is not enough."
)


@registry.sections.register
def sections(found: Advice) -> Sections:
    """The sections."""
    if found.waves is not None:
        return _of_waves(found, found.waves)
    return _of_moduli(found, found.moduli) if found.moduli is not None else tuple(_sections(found))


def _sections(found: Advice) -> Iterator[Section]:
    if found.assumes is not None:
        yield assumed(found)
    if found.matrices is not None:
        yield given(found.matrices, found.friction)
    if found.vectors is not None:
        yield from of_vectors(found, found.vectors)
    if found.run is not None:
        yield from of_a_run(found, found.run)
    if found.interval is not None:
        yield from of_logs(found, found.interval)
        if found.roles:
            if any(row.bound for row in found.methods):
                yield _paste(found, _few_methods(found))
            else:
                yield from _which_method(found)
                yield _paste(found)
    if found.roles and found.interval is None:
        if found.vectors is None:
            yield _which_body(found)
            yield _which_theta(found)
        yield from _which_method(found)
        yield from _friction(found)
        if found.theta is not None:
            yield _paste(found)
        if found.quote is not None:
            yield section("quote", "TO QUOTE", found.quote)
    yield _end(found)


def _end(found: Advice) -> Section:
    """The limits of the advice, and the command to type next."""
    outside = map(outside_the_theorem, found.outside)
    if found.theta is None and found.vectors is not None:
        return closing("a theta", then="ndtheory advise vectors X.npy TX.npy (with more iterates)")
    if found.next is None:
        tied = "that nothing opens or slips"
        claims = tied if found.tied else "that the predicted theta is the best one for other loads or meshes"
        return closing(claims, *outside, then=_after_a_problem(found))
    theta = f"{found.next.theta:g}"
    assumed = "--tied " * found.tied + "--friction " * (found.friction_bounds is not None)
    if found.next.kept and not found.roles:
        then = f"no run; keep theta = {theta}"
    elif found.interval is not None and found.roles:
        then = AS_ABOVE
    elif found.interval is not None:
        then = f"a run with theta = {theta}; then this again plus --log LOG --theta {theta}"
    else:
        then = f"ndtheory advise run {assumed}--theta {theta} --ratio R (R: its ratio)"
    return closing("a bound of rho with friction, or that a reading is the right one", *outside, then=then)


def _after_a_problem(found: Advice) -> Next | str:
    if found.problem is None:
        return AS_ABOVE
    if found.best.theta_auto is None:  # too large for a run
        return following("constants")
    rule = found.problem.iteration.relaxation if (own := found.method_to_paste) == "constant" else own
    theta = ["--theta", f"{found.theta:g}"] if found.theta is not None and takes_theta(rule) else []
    theta += [] if own == "constant" else ["--relaxation", own]
    return following("run", *theta, exchanged=found.roles[0].neumann_body != found.neumann_body)


def _which_body(found: Advice) -> Section:
    """The body that gets the Neumann problem, the effect of exchanging the roles, and the data each solver reads."""
    best, other = found.best, found.other
    if found.neumann_body is None:
        said = ["One run gives no information about the exchanged roles."]
        neumann, contact = "the Neumann body", "the other one"
    else:
        rate = found.chosen(best)[1]
        kind = "rate if tied" if found.tied else "predicted rate"
        said = [f"{_name(found, found.neumann_body)}: {kind} {near_one(rate)} a step, {in_steps(rate)} to 1e-9,"]
        if other is None:
            refused = next(role for role in found.roles if role is not best)
            said.append(f"{_name(found, refused.neumann_body)}: {refused.reason['rho']}")
        elif found.no_difference:
            said.append("and no difference with the roles exchanged")
        else:
            away = found.chosen(other)[1]
            said.append(f"against {near_one(away)} with the roles exchanged, {in_steps(away)}")
        neumann, contact = found.words(found.neumann_body), found.words(3 - found.neumann_body)
    if found.problem is not None and found.problem.several:
        said.append(f"Solvers of {neumann} read forces and write displacements, those of {contact} the reverse.")
    else:
        said.append(f"{neumann}'s solver reads forces and writes displacements, {contact}'s the reverse.".capitalize())
    return which_body(*said)


def _which_theta(found: Advice) -> Section:
    """The predicted and the proved theta of each role, the one if nothing opens or slips, and the one of "auto"."""
    rows: list[tuple[Cell, ...]] = []
    why = {}
    possible = [role for role in found.roles if role.rho is not None]
    for role in possible:
        name, rate = _name(found, role.neumann_body), role.predicted[1]
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
    said = [*_together(why), "predicted: theta = 2/(2 + rho); proved: energy bound, doubles unless marked v"]
    ends = [
        f"{figures(role.rho_min)}, {figures(role.rho_tied)} ({_name(found, role.neumann_body)})"
        for role in possible
        if role.ends is not None
    ]
    if ends:
        said.append(f"if tied: 2/(2+rho_min+rho), {'; '.join(ends)}")
    said += [
        _cells(found, role, role.cells) for role in possible if role.cells is not None and role.cells.found is not None
    ]
    lines = table(("Neumann", "rho", "theta is", "theta", "per step", "to 1e-9", "note"), rows)
    return section("theta", "WHICH THETA?", lines, *said)


def _cells(found: Advice, role: Role, seen: Suggested) -> str:
    """Cells that make rho smaller."""
    assert seen.cells is not None
    assert seen.found is not None
    lower, upper = ("[{}, {}]".format(*counts) for counts in seen.cells)
    least, own = (figures(seen.value(of)) for of in (seen.found, seen.of_file))
    wide = f" (nu = {float(seen.poisson):.3g} > {NARROW})" if seen.poisson > NARROW else ""
    return (
        f"{_name(found, role.neumann_body)}: with cells {lower}, {upper} fine meshes have rho >= {least}, "
        f"not >= {own}{wide}"
    )


def _which_method(found: Advice, names: Mapping[int | None, str] | None = None) -> Iterator[Section]:
    """Steps of each method in each role, and the one that is advised."""
    if not found.methods:
        return
    named = found.methods[0].neumann_body is not None
    rows: list[tuple[Cell, ...]] = []
    for exchanged in dict.fromkeys(row.exchanged for row in found.methods):
        own = [row for row in found.methods if row.exchanged == exchanged]
        body = own[0].neumann_body
        roles = "exchanged" if exchanged else "as they are"
        if named:
            roles = _name(found, body) if names is None else names[body]
        rows.append((roles, figures(own[0].theta), *(count(row.steps, "<= " * bool(row.bound)) for row in own)))
    first, *others = (METHOD_NAMES[row.method] for row in own)
    heads = ("Neumann" if named else "roles", "theta", f"steps to 1e-6: {first}", *others)
    said = []
    if found.method is not None:
        who = ", with the roles exchanged" * (found.method.exchanged and not named)
        said.append(f"Advised: {METHOD_NAMES[found.method.name]}{who}: {found.method.reason}.")
        if who:
            said.append(EXCHANGED)
        if not found.tied:
            said.append("Predicted as if tied: where contact changes, IQN-ILS may not arrive.")
        elif found.method.name != "constant":
            said.append("Predicted, not proved.")
    yield section("method", "WHICH METHOD?", table(heads, rows), *said)


def _some(number: int, what: str) -> str:
    """A number of things."""
    return f"{number} {what}{'s' * (number != 1)}"


def _few_methods(found: Advice) -> str:
    """The same in one line, where only the largest eigenvalue is known."""
    each = [f"{METHOD_NAMES[row.method]} {count(row.steps, '<= ' * bool(row.bound))}" for row in found.methods]
    return f"Steps to 1e-6: {', '.join(each)} (for eigenvalues from 0 to the largest)."


def of_vectors(found: Advice, seen: SeenVectors) -> Iterator[Section]:
    """The eigenvalues that vectors show, and the theta for them."""
    spectrum = seen.spectrum
    of, directions = _some(seen.unknowns, "unknown"), _some(seen.directions, "independent direction")
    said = [f"{seen.iterates} iterates of {of}, {directions}"]
    kinds = ["real: the coupling looks symmetric" if seen.symmetric else "complex: the coupling is not symmetric"]
    if seen.changing and not seen.negative:
        kinds.append("contact changes between the iterates: a theta for open nodes as well")
        if seen.used < seen.iterates:
            kinds.append(f"read from the last {seen.used}, in which the same nodes are open")
    said.append(f"eigenvalues are {'; '.join(kinds)}")
    if seen.noise is not None:
        said.append(f"images of dependent directions differ by {figures(seen.noise, 2)} of the largest: noise")
    if not found.roles:
        said.append(f"No theta: {found.why_no_theta}.")
    yield section("given", "WHAT WAS GIVEN?", *said)
    if not found.roles:
        return
    rows = [
        ("least lambda", figures(spectrum.low), figures(spectrum.error_low, 2)),
        ("largest lambda, rho", figures(spectrum.high), figures(spectrum.error_high, 2)),
    ]
    if found.theta is None:
        rows[1] = (rows[1][0], Quantity(spectrum.high, f">= {rounded(spectrum.high, 4, up=False)}"), "not found")
        notes = [f"No theta: {found.why_no_theta}."]
        if found.method is not None:
            notes.append("With the roles exchanged theta depends on the least eigenvalue, which is found.")
        yield section("theta", "WHICH EIGENVALUES, AND WHICH THETA?", table(("", "lambda", "error"), rows), *notes)
        return
    theta, rate = found.chosen(found.best)
    formula = "2/(2 + least + largest)" if spectrum.real else "the theta of least factor over the spectrum"
    best = f"theta = {theta:.4g} = {formula}, with both errors: factor {near_one(rate)} a step"
    notes = ["Ritz values: eigenvalues as these vectors show them, from inside; the errors are estimates.", best]
    yield section("theta", "WHICH EIGENVALUES, AND WHICH THETA?", table(("", "lambda", "error"), rows), *notes)


def _at_predicted(role: Role) -> str:
    """The steps of the predicted theta where nothing opens or slips."""
    theta = role.predicted[0]
    rate = role.factor_where_tied(theta)
    if rate is None or rate >= 1:
        return f"grows at {figures(theta)}"
    return f"{count(steps(rate))} at {figures(theta)}"


def _friction(found: Advice) -> Iterator[Section]:
    """The friction for which contraction is proved."""
    if found.friction is None:
        return
    said = {}
    for role in found.roles:
        if role.rho is None:
            continue
        said[_name(found, role.neumann_body)] = role.reason.get("friction_threshold", "")
        if role.friction_threshold is not None:
            allowed = f"every small theta contracts for k < {figures(role.friction_threshold)}"
            allowed += f" (here k = {figures(found.friction, 2)})"
            if found.friction and found.problem is not None and found.problem.varies:
                share = figures(role.friction_threshold.value / found.friction)
                allowed = f"every small theta contracts for less than {share} times the friction along Gamma_c"
            said[_name(found, role.neumann_body)] = allowed
    if set(said.values()) == {NO_LAW}:
        return
    yield section("friction", "HOW MUCH FRICTION DOES THE ENERGY BOUND ALLOW?", *_together(said))


def _together(said: Mapping[str, str]) -> list[str]:
    """A text for each role, or one text for both."""
    return [
        f"{', '.join(name for name, own in said.items() if own == text)}: {text}"
        for text in dict.fromkeys(said.values())
    ]


def _paste(found: Advice, *more: str) -> Section:
    """Lines to paste, and notes on them."""
    several = found.problem is not None and found.problem.several
    said = [] if several else [f"Whole blocks: --snippets {', '.join(SNIPPETS)} or all."]
    auto = found.best.theta_auto
    if auto is not None and found.theta is not None:
        if found.theta == float(LARGEST_TO_PASTE) <= auto.theta:
            said.append(f'theta = "auto" takes {float(auto.theta):.4g}; {found.theta:g} is the largest to paste.')
        elif abs(found.theta - float(auto.theta)) <= 1e-3 * found.theta:
            said.append('This is what theta = "auto" takes, rounded.')
        elif found.tied:
            said.append('theta = "auto" takes another one, since contact may open and slip.')
        elif auto.source == "proved":
            takes = f'theta = "auto" takes the proved {float(auto.theta):.4g}'
            said.append(f"{takes}: at most twice the predicted steps.")
    said.append("For displacements (heat: temperatures) the same, but not in parallel coupling.")
    return _pasted(found, found.neumann_body, *said, *more)


def _pasted(found: Advice, neumann_body: BodyNumber | None, *notes: str, force: str = "Force") -> Section:
    """The lines of :func:`pasted` for the method that is advised in the roles of its theta."""
    assert found.theta is not None
    rule = [f"These are the roles as they are: {found.advised_exchanged}."] if found.advised_exchanged else []
    problem, method = found.problem, found.method_to_paste
    several = problem.numbers(neumann_body) if problem and problem.several and neumann_body else ()
    file = problem is not None
    return pasted(neumann_body, found.theta, *rule, *notes, method=method, file=file, force=force, several=several)


def snippets(found: Advice, library: str) -> Sections:
    """The whole blocks for a library, or for all of them, each below its name."""
    names = list(SNIPPETS) if library == "all" else [library]
    titles = names if library == "all" else [""]
    return tuple(
        section(name, title, Block(tuple(found.snippet(name).split("\n"))))
        for name, title in zip(names, titles, strict=True)
    )


def which_body(*notes: str) -> Section:
    """The body that gets the Neumann problem."""
    return section("body", "WHICH BODY GETS THE NEUMANN PROBLEM?", *notes)


def next_run(made: NextRun | None) -> Sections:
    """The run to make next, if there is one."""
    return () if made is None else (section("next", "WHICH RUN NEXT?", f"theta = {made.theta:g}: {made.why}"),)


def pasted(
    neumann_body: BodyNumber | None,
    theta: float,
    *notes: str,
    method: str = "constant",
    file: bool = False,
    force: str = "Force",
    several: Sequence[int] = (),
) -> Section:
    """The lines for a problem file of two or of ``several`` bodies, and for preCICE, where relaxed data has a name."""
    lines = [] if neumann_body is None else [f"neumann_body = {neumann_body}"]
    lines = [f"neumann_bodies = {list(several)}"] if several else lines
    lines.append(f"theta = {theta:g}")
    if file and method != "constant":
        lines.append(f'relaxation = "{method}"')
    scheme = CouplingScheme(neumann_body=None if several else neumann_body, theta=theta, steps=None, force=force)
    lines += precice_acceleration(scheme, method).split("\n")
    return section("paste", "TO PASTE", Block(tuple(lines), 2), *notes)


def given(seen: SeenMatrices, friction: float | None) -> Section:
    """The matrices that were given."""
    of = [f"S{body}: {one.rows} unknowns" for body, one in ((1, seen.S1), (2, seen.S2))]
    if seen.transfer is not None and seen.neumann_body is not None:
        rows, columns = seen.transfer
        of.append(f"P: {rows} x {columns}, from body {seen.neumann_body} to body {3 - seen.neumann_body}")
    said = ["; ".join(of)]
    if not friction:
        said.append("Assumed: no friction.")
    if seen.ordering is None:
        said.append("Ordering: any, so long as both have the same.")
    else:
        said.append(f"Ordering assumed: {seen.ordering}.")
    said += [f"Note: {words}." for words in seen.notes]
    for found in seen.lanczos:
        ends = f"rho {figures(found.rho, 6)}, residual {found.residual:.1e}"
        least = f"least {figures(found.rho_min)}, residual {found.residual_min:.1e}"
        said.append(f"Lanczos, Neumann body {found.neumann_body}: {ends}; {least}; steps: {found.steps}.")
    if seen.lanczos:
        said.append("An eigenvalue lies within each residual; rho is at least what was found, not proved to be it.")
    return section("given", "WHAT WAS GIVEN?", *said)


#: Columns of all logs together that are shown; the document holds every one.
MOST_COLUMNS = 8

#: Words for kinds of residuals; the others are called by their names.
RESIDUALS = {"assumed": "taken as absolute", "drop": "over the first or largest one", "previous": "over |x|"}


def assumed(found: Advice) -> Section:
    """The assumption under which runs are read, before all else."""
    free = not found.tied and found.assumes == assumption(tied=False, friction=False)
    otherwise = " With friction add --friction." if free else ""
    return section("assumed", "", Note(f"Assumed: {found.assumes}.{otherwise}", 0))


def of_a_run(found: Advice, run: SeenRun) -> Sections:
    """The readings of a run as values of rho, and the run to make next."""
    given = (
        f"theta = {float(run.theta):.4g}; the residual |Tg - g| is multiplied by {float(run.ratio):.4g} in each step"
    )
    notes = (
        f"{given}, absolute and unrelaxed, steadily over {run.steps} steps or more.",
        "A residual that rises and falls has no steady ratio: give 1.",
        "For the relative residual |Tg - g|/|Tg| that coupling libraries log, use --log.",
    )
    said = section("rho", "WHAT DOES THE RUN SAY OF RHO?", *notes, _readings(found.readings))
    return (said, *_with_friction(found.friction_bounds), *next_run(found.next))


def of_logs(found: Advice, interval: RhoInterval) -> Sections:
    """The values of rho that each log and all logs together allow, and the run to make next."""
    read = [_readings(found.readings)] if found.readings else []
    notes = [f"Aitken's {log.factors.says}." for log in found.accelerated if log.factors is not None]
    if not read and any(log.stays for log in found.logs):
        notes.append("Nothing by itself: a level is about where theta begins to diverge, or where contact changes.")
    elif not read and found.logs:
        notes.append("Nothing: no time window shows a steady ratio or level over enough steps.")
    elif not read and not notes:
        notes.append("Nothing: residuals show rho only where the relaxation is constant.")
    if found.logs and not found.roles and found.next is not None and not found.next.kept:
        notes.append("A few vectors of a run decide more than its log: ndtheory advise vectors --help.")
    if interval.contradiction is not None:
        notes.append(f"CONTRADICTION: {interval.contradiction}.")
    else:
        notes += _bound("least", interval.lo, found.logs) + _bound("most", interval.hi, found.logs)
    return (
        _seen(found.logs, found.accelerated),
        section("rho", "WHAT DO THEY SAY OF RHO?", *read, *notes),
        *_with_friction(found.friction_bounds),
        *next_run(found.next),
    )


def _seen(logs: Sequence[SeenLog], accelerated: Sequence[Accelerated]) -> Section:
    """The logs, column by column."""
    parts: list[Note | str] = []
    room = MOST_COLUMNS
    for log in logs:
        parts.append(f"theta = {float(log.theta):.4g}, {log.form}, {log.file}")
        for column in log.columns[:room]:
            parts.append(Note(f"{column.name}, {RESIDUALS.get(column.residual, column.residual)}: {column.says}", 4))
        room -= len(log.columns[:room])
        parts += [Note(words, 4) for words in log.notes]
    left = sum(len(log.columns) for log in logs) - MOST_COLUMNS
    if left > 0:
        parts.append(f"and {left} columns more, see --json")
    for one in accelerated:
        parts.append(f"{one.accelerator}, {one.form}, {one.file}")
        parts += [Note(words, 4) for words in (one.says if one.factors is None else one.counted, *one.notes)]
    if logs:
        steps = " and ".join(f"{n}" for n in sorted({log.steps for log in logs})) + " steps"
        parts.append(f"Assumed: theta constant in each run, no Aitken or quasi-Newton.  A ratio counts over {steps}.")
    return section("logs", "WHAT DO THE LOGS SHOW?", *parts)


def _readings(readings: Sequence[RunReading]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for reading in readings:
        low = reading.lo
        rho = NONE if low is None else Quantity(float(low), f">= {rounded(low, 4, up=False)}")
        rows.append((reading.kind, rho, reading.says))
    return table(("reading", "rho", "if it is the right one"), rows)


def _bound(which: str, bound: LogBound | None, logs: Sequence[SeenLog]) -> list[str]:
    if bound is None:
        return []
    source = f"theta = {float(bound.log.theta):.4g}: {bound.says}" if len(logs) > 1 else bound.says
    value = rounded(float(bound.value), 4, up=which == "most")
    return [f"rho is at {which} {value} given {bound.assumes} ({source})"]


def _with_friction(bounds: FrictionBounds | None) -> Sections:
    """Bounds that hold with friction; nothing without friction."""
    if bounds is None:
        return ()
    said = []
    if bounds.image is not None:
        image = rounded(bounds.image, 3, up=False)
        theorem = "sqrt(rho) R, with 2 R = s + sqrt(s^2 + 4 kappa_2) and s = sqrt(rho) + kappa_1"
        said.append(f"The Lipschitz constant of T in the norm (5.21) is at least {image}; it is at most {theorem}.")
    if bounds.eigenvalue is not None and bounds.theta is not None and bounds.rate is not None:
        least, most = (rounded(end, 3, up=up) for end, up in zip(bounds.eigenvalue, (False, True), strict=True))
        gain = rounded(1 - bounds.rate, 3, up=False)
        near = f"Near the solution of the run at theta = {bounds.theta:.4g}, if contact does not change there, its"
        words = f"slowest mode has |1 + lambda| from {least} to {most}, and a smaller theta' takes at most"
        said.append(f"{near} {words} 1 - {gain} theta'/{bounds.theta:.4g} a step.")
    return (section("with friction", "WHAT IS PROVED WITH FRICTION?", *(said or ["Nothing."])),)


PLANES = {"strain": "plane strain", "stress": "plane stress", "3d": "three-dimensional"}
ENDS: dict[Corners, str] = {
    "none": "any geometry",
    "1": "corners of body 1",
    "2": "corners of body 2",
    "both": "corners of both bodies",
}


def _of_moduli(found: Advice, seen: SeenModuli) -> Sections:
    """The sections of advice from moduli."""
    each = (f"body {i}: E = {float(b.young):.5g}, nu = {float(b.poisson):.5g}" for i, b in enumerate(seen.bodies, 1))
    started = [role for role in seen.roles if role.start is not None]
    tried = next((role for role in started if found.neumann_body in (role.neumann_body, None)), None)
    then = ""
    if found.next is not None:
        theta = f"{found.next.theta:g}"
        then = f"ndtheory advise run --theta {theta} --ratio R (R: the ratio of that run)"
    last: Sections = ()
    if tried is not None and tried.start is not None:
        start = found.next.theta if found.parallel and found.next is not None else tried.start.theta_guess
        last = (pasted(tried.neumann_body, start),)
    return (
        section("setting", "", Facts("", (*each, PLANES[seen.bodies[0].plane]))),
        _least_rho(seen),
        _excluded(seen),
        _who(found, seen),
        *_parallel(found),
        _start(started, None if last else found.next, bool(found.parallel)),
        *last,
        closing("a bound of rho from above with friction, or where no image fits", then=then),
    )


def _least_rho(seen: SeenModuli) -> Section:
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


def _start(started: Sequence[ModuliRole], first: NextRun | None, parallel: bool) -> Section:
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
    if first is not None:
        notes.append(f"theta = {first.theta:g}, a guess: {first.why}")
    if not started:
        notes[-1] += ". One is proved where the mirror image of a body fits into the other one: --shape mirror-1 or -2"
    elif parallel:
        notes.append("These are for serial coupling; the theta to paste is 1/(1 + rho) with the guess of rho.")
    return section("start", "WHICH THETA TO START WITH?", *notes)


#: Names of the bodies, and of what they read and write.
WORDS: dict[str, tuple[dict[int | None, str], str, str]] = {
    "heat": ({1: "plate 1", 2: "plate 2"}, "fluxes", "temperatures"),
    "fluid": ({1: "the fluid", 2: "the wall"}, "pressures", "displacements"),
}


def _of_waves(found: Advice, seen: SeenWaves) -> Sections:
    """The sections of advice for two plates that exchange heat, or for a fluid and a wall."""
    names, forces, moves = WORDS[seen.kind]
    data = [f"{key} {', '.join(f'{float(v):.5g}' for v in values)}" for key, values in seen.given.items()]
    neumann, contact = names[found.best.neumann_body or 2], names[3 - (found.best.neumann_body or 2)]
    who = [f"{neumann}'s solver reads {forces} and writes {moves}, {contact}'s the reverse.".capitalize()]
    if found.no_difference and len({figures(role.rho_tied) for role in found.roles}) == 1:
        who.append("It makes no difference with the roles exchanged.")
    if seen.kind == "fluid":
        who.append(f"With the roles exchanged: {found.roles[1].reason['rho']}.")
        then = f"ndtheory advise run --tied --theta {found.next.theta:g} --ratio R" if found.next else ""
        last = (_waves_of_a_fluid(found, seen), *_parallel(found), *_which_method(found, names), *next_run(found.next))
        claims = "a bound of rho from above, or anything with a viscous or compressible fluid"
    else:
        relaxed = "Fluxes and temperatures are both relaxed." if found.parallel else "For temperatures the same."
        paste = _pasted(found, None, relaxed, force="Heat-Flux")
        last = (_waves_of_heat(found, seen), *_parallel(found), *_which_method(found, names), paste)
        then = "ndtheory advise vectors X.npy TX.npy (iterates of a run: theta for your shapes)"
        claims = "anything about plates that are not flat, or coarse meshes; the command below reads those"
    return (section("setting", "", Facts("", tuple(data))), which_body(*who), *last, closing(claims, then=then))


def _waves_of_heat(found: Advice, seen: SeenWaves) -> Section:
    """Both ends of the spectrum of two plates, and the theta for them."""
    rows: list[tuple[Cell, ...]] = []
    for role in found.roles:
        ends = figures(role.rho_min), figures(role.rho_tied)
        best = figures(role.theta_tied), near_one(role.rate_tied or 0)
        limit = None if role.rho_tied is None else excluded_from(role.rho_tied)
        rows.append((WORDS["heat"][0][role.neumann_body], *ends, *best, "never" if limit is None else figures(limit)))
    thick, dt = "thickness" not in seen.given, seen.one("dt")
    notes = [
        f"For flat {'thick ' * thick}plates: conductance of the plate that reads temperatures over the other one's, "
        "least and largest over all waves of temperature, proved in the continuum; theta = 2/(2 + least + largest)."
    ]
    if dt is not None:
        pairs = zip(seen.given["conductivity"], seen.given["capacity"], strict=True)
        reach = " and ".join(f"{3 * math.sqrt(k * dt / c):.3g}" for k, c in pairs)
        notes.append(f"In dt heat reaches 3 sqrt(k dt/c), {reach}, into the plates; a thicker one counts as thick.")
    elif "capacity" in seen.given:
        notes.append("This holds for every step in time dt. A plate of more than 3 sqrt(k dt/c) counts as thick.")
    if "capacity" in seen.given:
        coarse = "Cells must be smaller than sqrt(k dt/c): with larger ones lambda is c times cell height over the same"
        notes.append(f"{coarse} of the other plate, and this theta may diverge.")
    elif not thick:
        notes.append("Both plates are held at given temperatures on their other sides.")
    if found.parallel:
        notes.append("These thetas and factors are for serial coupling.")
    heads = ("reads fluxes", "least", "largest", "theta", "factor a step", "diverges from")
    return section("theta", "WHICH THETA?", table(heads, rows), *notes)


def _waves_of_a_fluid(found: Advice, seen: SeenWaves) -> Section:
    """The lower bound of rho of a fluid and a wall, and the thetas that it excludes."""
    rho = found.roles[0].rho
    assert rho is not None
    short = "" if "young" in seen.given else ", where steps in time are so short that stiffness does not count"
    where = "tube" if len(seen.given["length"]) == 2 else "square over the plate"
    notes = (
        f"rho >= {figures(rho)}: added mass over the mass of the wall, for the longest wave{short}",
        f"Proved if the fluid fills the {where}, has no viscosity and is incompressible, and both solvers use one time "
        "scheme.",
        f"Theta from {figures(2 / (1 + rho.value))} on diverges." if rho.value > 1 else "No theta up to 1 is excluded.",
    )
    return section("bounds", "HOW LARGE IS RHO AT LEAST?", *notes)


def _parallel(found: Advice) -> Sections:
    """theta and factor of parallel coupling for each role, where it was asked for."""
    if not found.parallel:
        return ()
    names = None if found.waves is None else WORDS[found.waves.kind][0]
    notes = ["A mode lambda is multiplied by 1 - theta +- i theta sqrt(lambda) where nothing opens or slips."]
    for one in found.parallel:
        most, least = ("at most ", "at least ") if one.bound else ("", "")
        who = _name(found, one.neumann_body) if names is None else names[one.neumann_body]
        best = f"Neumann problem on {who}: best theta = 1/(1 + rho), {most}{figures(one.theta)}"
        notes.append(f"{best}; factor {least}{near_one(one.factor)} a step")
    return (section("parallel", "WHAT IF BOTH SOLVERS RUN AT ONCE?", *notes),)
