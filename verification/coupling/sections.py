"""Advice: roles and theta, from a problem, from matrices, from runs or from moduli."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import singledispatch

from verification import registry
from verification.algorithm.rates import steps
from verification.constants.measured import NO_LAW
from verification.coupling.advice import Advice
from verification.coupling.cells import NARROW, Suggested
from verification.coupling.evidence import Evidence
from verification.coupling.from_problems import FromProblem
from verification.coupling.kinds import LARGEST_TO_PASTE, BodyNumber
from verification.coupling.methods import NAMES as METHOD_NAMES
from verification.coupling.readings import NextRun
from verification.coupling.roles import Role, in_steps
from verification.coupling.sides import Matrices
from verification.coupling.snippets import SNIPPETS, CouplingScheme, precice_acceleration
from verification.coupling.vectors import Vectors
from verification.problem.readers import takes_theta
from verification.show.numbers import NONE, count, figures, near_one, rounded
from verification.show.parts import (
    Block,
    Cell,
    Next,
    Quantity,
    Section,
    Sections,
    closing,
    following,
    outside_the_theorem,
    section,
    table,
)


def name_of(found: Advice, body: int | None) -> str:
    """Words for the Neumann body of a role."""
    return "as in that run" if body is None else found.evidence.words(body)


#: Signs before a number of steps that is bounded.
SIGNS = {None: "", "at most": "<= ", "at least": ">= "}

#: The next step where nothing is left to type.
AS_ABOVE = "your coupling, with the lines above"

#: What it takes to exchange the roles of solvers that are already coupled.
EXCHANGED = (
    "To exchange the roles, the second solver, which now reads displacements (temperatures), must take forces "
    "(fluxes), and the first the reverse. Swapping two arguments is not enough."
)


@registry.sections.register
def sections(found: Advice) -> Sections:
    """The sections."""
    return tuple(of(found.evidence, found))


@singledispatch
def of(evidence: Evidence, found: Advice) -> Iterable[Section]:
    """The sections of advice by its evidence; a source registers its own."""
    raise TypeError(f"no sections of {type(evidence).__name__}")


@of.register
def _of_problem(evidence: FromProblem, found: Advice) -> Iterator[Section]:
    yield from _of_two_bodies(found)


@of.register
def _of_matrices(evidence: Matrices, found: Advice) -> Iterator[Section]:
    yield given(evidence)
    yield from _of_two_bodies(found)


def _of_two_bodies(found: Advice) -> Iterator[Section]:
    yield from which_body_and_theta(found)
    yield from which_method(found)
    yield from _friction(found)
    yield from paste_and_quote(found)
    yield _end(found, _after_a_problem(found))


@of.register
def _of_vectors(evidence: Vectors, found: Advice) -> Iterator[Section]:
    yield from of_vectors(found, evidence)
    yield from which_method(found)
    if found.roles:
        yield from paste_and_quote(found)
    if found.theta is None:
        again = f"ndtheory advise vectors {found.coupling.typed}X.npy TX.npy (with more iterates)"
        yield closing("a theta", then=again)
    else:
        yield _end(found, AS_ABOVE)


def which_body_and_theta(found: Advice) -> Sections:
    """The body that gets the Neumann problem, and theta."""
    return _which_body(found), _which_theta(found)


def paste_and_quote(found: Advice) -> Sections:
    """The lines to paste, and the reason to quote."""
    quoted = () if found.quote is None else (section("quote", "TO QUOTE", found.quote),)
    return () if found.theta is None else (paste(found), *quoted)


def _end(found: Advice, then: Next | str) -> Section:
    """The limits of the advice, and the command to type next."""
    claims = "that nothing opens or slips, or " * (not found.declared) + "that the coupling is linear"
    claims = claims if found.tied else "that the predicted theta is the best one for other loads or meshes"
    return closing(claims, *map(outside_the_theorem, found.evidence.outside), then=then)


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
        said = [f"{name_of(found, found.neumann_body)}: {kind} {near_one(rate)} a step, {in_steps(rate)} to 1e-9,"]
        if other is None:
            refused = next(role for role in found.roles if role is not best)
            said.append(f"{name_of(found, refused.neumann_body)}: {refused.reason['rho']}")
        elif found.no_difference:
            said.append("and no difference with the roles exchanged")
        else:
            away = found.chosen(other)[1]
            said.append(f"against {near_one(away)} with the roles exchanged, {in_steps(away)}")
        neumann, contact = found.evidence.words(found.neumann_body), found.evidence.words(3 - found.neumann_body)
    if found.problem is not None and found.problem.several:
        said.append(f"Solvers of {neumann} read forces and write displacements, those of {contact} the reverse.")
    else:
        said.append(reads(neumann, contact))
    return which_body(*said)


def reads(neumann: str, contact: str, forces: str = "forces", moves: str = "displacements") -> str:
    """The data that each solver reads and writes."""
    return f"{neumann[0].upper()}{neumann[1:]}'s solver reads {forces} and writes {moves}, {contact}'s the reverse."


def _which_theta(found: Advice) -> Section:
    """The predicted and the proved theta of each role, the one if nothing opens or slips, and the one of "auto"."""
    rows: list[tuple[Cell, ...]] = []
    why = {}
    possible = [role for role in found.roles if role.rho is not None]
    heads = ("Neumann", "rho", "theta is", "theta", "per step", "to 1e-9", "note")
    if found.coupling.parallel:
        for role in possible:
            best, a_step = found.chosen(role)
            shown = figures(best), near_one(a_step), count(steps(a_step))
            rows.append((name_of(found, role.neumann_body), figures(role.rho), "1/(1+rho)", *shown, "not a bound"))
        words = "Predicted for parallel coupling, where nothing opens or slips."
        return section("theta", "WHICH THETA?", table(heads, rows), words)
    for role in possible:
        name, rate = name_of(found, role.neumann_body), role.predicted[1]
        theta, bound = figures(role.theta_predicted), "proved" if role.proved else "not a bound"
        rows.append((name, figures(role.rho), "predicted", theta, near_one(rate), count(steps(rate)), bound))
        if role.factor_proved is not None and role.theta_proved is not None:
            q = role.factor_proved.value
            factor = replace(near_one(q), level=role.factor_proved.level)
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
        f"{figures(role.rho_min)}, {figures(role.rho_tied)} ({name_of(found, role.neumann_body)})"
        for role in possible
        if role.ends is not None
    ]
    if ends:
        said.append(f"if tied: 2/(2+rho_min+rho), {'; '.join(ends)}")
    said += [
        _cells(found, role, role.cells) for role in possible if role.cells is not None and role.cells.found is not None
    ]
    return section("theta", "WHICH THETA?", table(heads, rows), *said)


def _cells(found: Advice, role: Role, seen: Suggested) -> str:
    """Cells that make rho smaller."""
    assert seen.cells is not None
    assert seen.found is not None
    lower, upper = ("[{}, {}]".format(*counts) for counts in seen.cells)
    least, own = (figures(seen.value(of)) for of in (seen.found, seen.of_file))
    wide = f" (nu = {float(seen.poisson):.3g} > {NARROW})" if seen.poisson > NARROW else ""
    return (
        f"{name_of(found, role.neumann_body)}: with cells {lower}, {upper} fine meshes have rho >= {least}, "
        f"not >= {own}{wide}"
    )


def which_method(found: Advice, names: Mapping[int | None, str] | None = None) -> Iterator[Section]:
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
            roles = name_of(found, body) if names is None else names[body]
        rows.append((roles, figures(own[0].theta), *(count(row.steps, SIGNS[row.bound]) for row in own)))
    first, *others = (METHOD_NAMES[row.method] for row in own)
    heads = ("Neumann" if named else "roles", "theta", f"steps to 1e-6: {first}", *others)
    said = ["From g = 0 until |Tg - g| < 1e-6 |Tg|, with equal first errors of all modes."]
    if found.method is not None:
        who = ", with the roles exchanged" * (found.method.exchanged and not named)
        said.append(f"Advised: {METHOD_NAMES[found.method.name]}{who}: {found.method.reason}.")
        if who:
            said.append(EXCHANGED)
        if found.coupling.parallel:
            said.append("Predicted for parallel coupling, in which an evaluation runs both solvers.")
        if not found.tied:
            said.append("Predicted as if tied: where contact changes, IQN-ILS may not converge.")
        elif found.method.name != "constant":
            said.append("Predicted, not proved.")
    yield section("method", "WHICH METHOD?", table(heads, rows), *said)


def few_methods(found: Advice) -> str:
    """The same in one line, where only the largest eigenvalue is known."""
    each = [f"{METHOD_NAMES[row.method]} {count(row.steps, SIGNS[row.bound])}" for row in found.methods]
    return f"Steps from g = 0 to |Tg - g| < 1e-6 |Tg|: {', '.join(each)} (for eigenvalues from 0 to the largest)."


def of_vectors(found: Advice, seen: Vectors) -> Iterator[Section]:
    """The eigenvalues that vectors show, and the theta for them."""
    spectrum = seen.spectrum
    some = lambda number, what: f"{number} {what}{'s' * (number != 1)}"
    of, directions = some(seen.unknowns, "unknown"), some(seen.directions, "independent direction")
    said = [f"{seen.iterates} iterates of {'two fields with ' * found.coupling.parallel}{of}, {directions}"]
    changes = found.coupling.given(", contact changes") + " or it is not linear"
    kinds = ["real: the coupling looks symmetric" if seen.symmetric else f"complex: it is not symmetric{changes}"]
    if seen.changing and not seen.negative:
        bare = "nodes that are open bear no force in any, and have no error"
        kinds.append(f"contact changes between the iterates: {'a theta for open nodes too' if seen.loaded else bare}")
        if seen.used < seen.iterates:
            kinds.append(f"read from the last {seen.used}, in which the same nodes are open")
    said.append(f"eigenvalues are {'; '.join(kinds)}")
    if seen.noise is not None:
        differ = f"images of dependent directions differ by {figures(seen.noise, 2)} of the largest"
        said.append(f"{differ}: noise{found.coupling.given(', or contact that changes')}")
    if seen.apart is None:
        said.append("not seen: noise and memory of the solvers, which one iterate evaluated twice in succession shows")
    elif seen.apart:
        said.append(f"two images of one iterate differ by {figures(seen.apart, 2)} of its residual: noise, or a memory")
    if not found.roles:
        said.append(f"No theta: {found.why_no_theta}.")
    yield section("given", "WHAT WAS GIVEN?", *said)
    if not found.roles:
        return
    largest, errors = figures(spectrum.high), [figures(each, 2) for each in seen.estimated_errors]
    if found.theta is None:
        largest, errors[1] = Quantity(spectrum.high, f">= {rounded(spectrum.high, 4, up=False)}"), "not found"
        notes = [f"No theta: {found.why_no_theta}."]
        if found.method is not None:
            notes.append("With the roles exchanged theta depends on the least eigenvalue, which is found.")
    else:
        theta, rate = found.chosen(found.best)
        ends = "0, for open nodes, and largest" if seen.seen.low < spectrum.low else "least and largest"
        over = "the theta of least factor over"
        formula = f"fewest steps to 1e-6 with {ends}" if spectrum.real else f"{over} the spectrum"
        if found.coupling.parallel:
            formula = "1/(1 + largest)" if spectrum.low >= 0 else f"{over} both square roots"
        errors_of = "errors are estimates, for a linear T"
        if None in seen.estimated_errors:
            errors_of = "no error is known, as contact changes in these iterates, or friction acts"
        notes = [
            f"Ritz values: eigenvalues as these vectors show them, from inside; {errors_of}.",
            f"theta = {theta:.4g} = {formula}, and the error of the largest: factor {near_one(rate)} a step",
            f"With this theta: {found.steps_with_errors}.",
        ]
    if spectrum.low + spectrum.error_low < 0 and not found.coupling.signed:
        notes.append("An eigenvalue between -1 and 0 is positive feedback; a theta above 1 is not a mistake there.")
    rows = [
        ("least lambda" if spectrum.real else "least real part", figures(spectrum.low), errors[0]),
        ("largest lambda, rho" if spectrum.real else "largest real part", largest, errors[1]),
    ]
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
    friction = found.evidence.friction
    if friction is None:
        return
    said, varies = {}, found.problem is not None and found.problem.varies
    for role in found.roles:
        allowed, threshold = role.reason.get("friction_threshold", ""), role.friction_threshold
        if threshold is not None and friction and varies:
            share = figures(threshold.value / friction)
            allowed = f"every small theta contracts for less than {share} times the friction along Gamma_c"
        elif threshold is not None:
            allowed = f"every small theta contracts for k < {figures(threshold)} (here k = {figures(friction, 2)})"
        if role.rho is not None:
            said[name_of(found, role.neumann_body)] = allowed
    if set(said.values()) == {NO_LAW}:
        return
    yield section("friction", "HOW MUCH FRICTION DOES THE ENERGY BOUND ALLOW?", *_together(said), *_layers(found))


def _layers(found: Advice) -> Iterator[str]:
    """The prediction by layers without ends, in one line for both roles."""
    said = []
    for role in found.layers:
        factor = "no factor below 1" if role.factor is None else f"factor {near_one(role.factor.value)}"
        of = f"{factor} at {figures(role.theta)}, k < {figures(role.friction_threshold)}"
        said.append(f"{name_of(found, role.neumann_body)}: {of}")
    if said:
        yield f"Predicted for endless layers, in a norm of a proof's choice: {'; '.join(said)}."


def _together(said: Mapping[str, str]) -> list[str]:
    """A text for each role, or one text for both."""
    return [
        f"{', '.join(name for name, own in said.items() if own == text)}: {text}"
        for text in dict.fromkeys(said.values())
    ]


def paste(found: Advice, *more: str) -> Section:
    """Lines to paste, and notes on them."""
    several = found.problem is not None and found.problem.several
    beyond = (found.theta or 0) > 1
    blocks = not (several or found.coupling.parallel or beyond)
    said = [f"Whole blocks: --snippets {', '.join(SNIPPETS)} or all."] * blocks
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
    both = "Both fields are relaxed: the scheme is parallel, and names both as data of the acceleration."
    one = "Relax displacements (heat: temperatures) alike, except in parallel coupling."
    said.append(both if found.coupling.parallel else one)
    if beyond:
        said.append("preCICE takes a factor of at most 1: there use IQN-ILS, or relax in the solvers.")
    return pasted_for(found, found.neumann_body, *said, *more)


def pasted_for(
    found: Advice, neumann_body: BodyNumber | None, *notes: str, data: tuple[str, ...] = ("Force", "Displacement")
) -> Section:
    """The lines of :func:`pasted` for the method that is advised in the roles of its theta."""
    assert found.theta is not None
    rule = [f"These are the roles as they are: {found.advised_exchanged}."] if found.advised_exchanged else []
    problem, method = found.problem, found.method_to_paste
    several = problem.numbers(neumann_body) if problem and problem.several and neumann_body else ()
    file, data = problem is not None, data if found.coupling.parallel else data[:1]
    return pasted(neumann_body, found.theta, *rule, *notes, method=method, file=file, data=data, several=several)


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


def next_run(made: NextRun) -> Section:
    """The run to make next."""
    return section("next", "WHICH RUN NEXT?", f"theta = {made.theta:g}: {made.why}")


def pasted(
    neumann_body: BodyNumber | None,
    theta: float,
    *notes: str,
    method: str = "constant",
    file: bool = False,
    data: tuple[str, ...] = ("Force",),
    several: Sequence[int] = (),
) -> Section:
    """The lines for a problem file of two or of ``several`` bodies, and for preCICE, where relaxed data has a name."""
    lines = [] if neumann_body is None else [f"neumann_body = {neumann_body}"]
    lines = [f"neumann_bodies = {list(several)}"] if several else lines
    lines.append(f"theta = {theta:g}")
    if file and method != "constant":
        lines.append(f'relaxation = "{method}"')
    scheme = CouplingScheme(neumann_body=None if several else neumann_body, theta=theta, steps=None, data=data)
    lines += precice_acceleration(scheme, method).split("\n") if theta <= 1 else []
    return section("paste", "TO PASTE", Block(tuple(lines), 2), *notes)


def given(seen: Matrices) -> Section:
    """The matrices that were given."""
    of = [f"S{body}: {one.rows} unknowns" for body, one in ((1, seen.S1), (2, seen.S2))]
    if seen.transfer is not None and seen.neumann_body is not None:
        rows, columns = seen.transfer
        of.append(f"P: {rows} x {columns}, from body {seen.neumann_body} to body {3 - seen.neumann_body}")
    said = ["; ".join(of)]
    if not seen.friction:
        said.append("Assumed: no friction.")
    if seen.ordering is None:
        said.append("Ordering: any, if both bodies have the same.")
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
