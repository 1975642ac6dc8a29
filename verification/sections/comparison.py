"""A comparison: each section as soon as it is known, or all of them at the end."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from verification import registry
from verification.algorithm.reference import Reference
from verification.algorithm.runs import Run
from verification.algorithm.theta import Choice
from verification.bounds.bound import BoundResult
from verification.bounds.losses import Losses
from verification.bounds.ruler import promised
from verification.bounds.verdicts import RunVerdict
from verification.comparison import Comparison, Listener
from verification.constants import Measured
from verification.interface.pair import ContactPair
from verification.sections.answer import answer
from verification.sections.bounds import bounds, contracts, thetas
from verification.sections.constants import compared
from verification.sections.constants import sections as all_constants
from verification.sections.run import happened, remedied, then
from verification.sections.setting import limits, setting
from verification.show.numbers import count, factor, marked, near_one
from verification.show.parts import (
    Labelled,
    Note,
    Quantity,
    Section,
    Sections,
    Shown,
    following,
    outside_the_theorem,
    section,
    table,
)

#: The captions of the table of verdicts and of the figure of the losses.
RATIOS = (
    "Each bound is compared with the largest ratio of successive residuals in the norm (5.21), which measures forces "
    "by their energy in the Neumann body. The forecast made half way is compared with the end of the run."
)
WATERFALL = (
    (
        "waterfall",
        "Losses of the inequalities of the proof, in powers of ten. The top panel shows each inequality by itself, at "
        "the pair of forces that comes closest to equality. These pairs differ, so these bars do not add up. Each "
        "panel below follows one quantity step by step to its bound, and its bars add up. The repaired and the "
        "printed bound differ only by the unit of stress.",
    ),
)


RULER = (
    (
        "ruler",
        "Steps to the tolerance: until each bound promises the error to be that share of the first one, for any loads; "
        "as the linearisation at the solution predicts them; and until the residual of this run was there.",
    ),
)

FACTOR = (("factor", "The factor of one step over theta by each bound, and the rate of the run."),)

#: The verdicts as they are read; a bound has no conclusion where its hypotheses are not met.
WORDS: Mapping[RunVerdict, str] = {
    "CONSISTENT": "consistent",
    "VIOLATED": "violated",
    "INCONCLUSIVE": "inconclusive",
    "HYPOTHESES_NOT_MET": "no conclusion",
    "NOT_COMPUTED": "not computed",
}

#: Lines on bounds beside which the first screen has room to name what shows more, in 15 lines.
MOST_BOUNDS = 5

#: Verdicts that are not on a bound, as they are read.
NAMES: Mapping[str, str] = {"linearised": "forecast"}


class Parts(Listener):
    """Passes the sections of a comparison to ``show``, each when it is known; several of one id may follow each other.

    The pair is made from a problem.  The answer comes first: what is known before the run waits for it, until the
    listener is closed at the latest: where a run is slow, its bounds appear late.
    """

    def __init__(self, pair: ContactPair, show: Callable[[Sections], None]) -> None:
        self.pair, self.show, self.unit = pair, show, pair.units["stress"]
        self.waiting: list[Section] = []
        self.results: Sequence[BoundResult] = ()

    def __enter__(self) -> Parts:
        return self

    def __exit__(self, *ended: object) -> None:
        """Show what waited for a run that did not come."""
        if self.waiting:
            self.show(tuple(self.waiting))
            self.waiting = []

    def constants(self, measured: Measured, choice: Choice) -> None:
        problem = self.pair.problem
        assert problem is not None  # see `sections`
        first = setting(problem.with_theta(choice.theta), measured.nodes, measured.interface_nodes, measured.cuts)
        self.show((first,))
        if measured.unverified is not None:
            self.waiting.append(compared(measured))

    def bounds(self, results: Sequence[BoundResult], measured: Measured) -> None:
        self.results = self._told(results)
        self.waiting.append(contracts(self.results, self.unit, measured.why_no_energy))

    def _told(self, results: Sequence[BoundResult]) -> Sequence[BoundResult]:
        """The results; where friction varies along Gamma_c its thresholds are factors by which it may grow."""
        if not self.pair.interface.varies:
            return results
        return [replace(result, friction=result.friction.over(self.pair.friction)) for result in results]

    def run(self, finished: Run) -> None:
        before, self.waiting = self.waiting, []
        self.show((answer(finished, self.results), *before, happened(finished, alone=False)))

    def cvxpy(self, reference: Reference | None, why: str) -> None:
        part: Labelled | str = f"cvxpy: {why}"
        if reference is not None:
            rate = "no rate" if reference.observed_rate is None else f"rate {near_one(reference.observed_rate)}"
            what = f"{rate}, {reference.steps - 1} steps" if reference.whole else "first and last step"
            part = Labelled("check by cvxpy", f"{what}; forces differ by {reference.largest_difference:.0e} at most")
        self.show((section("run", "", part),))

    def losses(self, losses: Losses | None, why: str) -> None:
        friction = () if losses is None else losses.friction
        parts = [f"losses: {why}"] if why else []
        if friction:
            estimates = [loss for loss in friction if not loss.only_unit]
            total = sum(loss.decades for loss in estimates)
            unit = sum(loss.decades for loss in friction) - total
            links = ", ".join(f"10^{loss.decades:.1f} by {loss.label}" for loss in estimates)
            sizes = f"10^{total:.1f} (printed 10^{total + unit:.1f})"
            parts.append(f"The friction bound (5.30) exceeds what was found by {sizes}: {links}.")
        if parts:
            self.show((section("losses", "HOW MUCH DOES EACH ESTIMATE LOSE?", *parts, pictures=WATERFALL),))

    def programs(self, results: Sequence[BoundResult]) -> None:
        parts = [
            *bounds(self._told(results), self.unit),
            *(f"{r.name}: {r.not_computed}" for r in results if not r.worked_out),
        ]
        title = "WHAT DO SEMIDEFINITE PROGRAMS PROVE OF ONE STEP?"
        caption = "These columns for the bound that takes the matrices of the bodies."
        if parts:
            self.show((section("programs", title, *parts, caption=caption, pictures=FACTOR),))


class FirstParts(Parts):
    """Passes on what the first screen shows before its table: the problem, and the answer as soon as the run ends."""

    def run(self, finished: Run) -> None:
        self.waiting = []
        found = answer(finished, self.results, alone=False)
        self.show((replace(found, parts=(*found.parts, *remedied(finished))),))

    def cvxpy(self, reference: Reference | None, why: str) -> None:
        """Left out."""

    def losses(self, losses: Losses | None, why: str) -> None:
        """Left out."""

    def programs(self, results: Sequence[BoundResult]) -> None:
        """In the table of all bounds, which is the last part."""


@registry.screen.register
def first(result: Comparison) -> Sections:
    """The first screen, of at most 15 lines: does it converge, how fast, proved by what, which theta, what next?"""
    if result.problem is None:
        return ()
    found: list[Section] = []
    result.tell(FirstParts(result.run.pair, found.extend))
    return (*found, *proofs(result))


def proofs(result: Comparison) -> Sections:
    """The end of the first screen: what each bound says of one step and of the run, and what is not claimed."""
    tolerance = result.run.pair.settings.tolerance
    rows, without = [], dict[str, list[str]]()
    for name, bound in result.bounds.items():
        verdict, steps = result.verdicts[name], promised(bound, tolerance)
        if bound.factor is None or verdict.verdict in ("HYPOTHESES_NOT_MET", "NOT_COMPUTED"):
            if bound.asked:
                without.setdefault(WORDS[verdict.verdict], []).append(name)
            continue
        says = marked("contracts", bound.level) if bound.proved else "claims contraction"
        most = count(steps, "<= ") if steps is None or steps < 1e6 else Quantity(steps, f"<= {steps:.1e}")
        rows.append((name, says, factor(bound.factor, bound.one_minus_factor), most, WORDS[verdict.verdict]))
    parts: list[Shown] = []
    for words, names in without.items():
        why = f"{'; '.join(names)}: {result.verdicts[names[-1]].reason}"  # each has another reason
        parts.append(Labelled(words, ", ".join(names) if result.run.outside else why))
    wrong = {n: j.reason for n, j in result.verdicts.items() if j.verdict == "VIOLATED"}
    parts += [Labelled(NAMES[n], f"violated: {wrong[n]}") for n in wrong.keys() & NAMES]
    if rows:
        known = "v: verified" if any(bound.marked for bound in result.bounds.values()) else "in doubles"
        to = f"steps to {tolerance:.0e}".replace("e-0", "e-")
        parts.append(table((f"bound, {known}", "one step", "factor", to, "the run"), rows))
    *limit, last = (end := _limits(result)).parts
    room = len(rows) + len(parts) - bool(rows) < MOST_BOUNDS
    more = [Note("All numbers: --full.", 0, only="terminal")] * room
    return section("answer", "", *parts), replace(end, parts=(*limit, *more, last))


def verdicts(result: Comparison) -> Sections:
    """The end of a comparison."""
    judged = table(
        ("bound", "verdict", "why"), [(NAMES.get(n, n), WORDS[j.verdict], j.reason) for n, j in result.verdicts.items()]
    )
    title = "DOES THE RUN AGREE WITH THE BOUND?"
    return section("verdicts", title, judged, caption=RATIOS, pictures=RULER), _limits(result)


def _limits(result: Comparison) -> Section:
    return limits(result.run.outside, then(result.run, "run", following("advise")))


@registry.sections.register
def sections(result: Comparison) -> Sections:
    """The sections; a report has more at its beginning and end: warnings, the theta, all constants."""
    if result.problem is None:
        return ()
    found: list[Section] = []
    result.tell(Parts(result.run.pair, found.extend))
    warnings = [outside_the_theorem(reason) for reason in result.run.outside]
    warnings += [Note(f"{warning}.", 0, "Warning:") for warning in result.run.warnings]
    first = [replace(section("setting", "", *warnings), only="report")] if warnings else []
    details = [bound.detail for bound in result.bounds.values()]
    _, *constants = all_constants(result.measured)
    last = [replace(each, only="report") for each in (*thetas(details), *constants)]
    return (found[0], *first, *found[1:], *verdicts(result), *last)
