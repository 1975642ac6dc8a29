"""A loading history: its steps, and what the theorem promised of their increments."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby

from verification import registry
from verification.algorithm.history import History
from verification.sections.comparison import WORDS
from verification.sections.run import AT_POINTS, counted, point_rows, then, unfinished
from verification.sections.setting import limits, setting
from verification.show.numbers import NONE, count, figures, near_one
from verification.show.parts import Cell, Note, Quantity, Sections, Shown, following, section, table

#: What the table of a history shows.
STEPS = (
    "Each row is a step: its increments, the steps that their runs took, and the work of friction. The forces between "
    "the bodies, and the nodes that stick, slip and are open, are those at its end."
)
PROMISE = "WHAT DOES THE THEOREM SAY OF EACH INCREMENT?"
PICTURES = (
    ("loop", "The force between the bodies against the displacement that drives them; friction took the area inside."),
    ("states", "What sticks, slips and is open along Gamma_c, increment by increment."),
    ("shear", "Shear on the upper body against the friction bound, at the ends of steps."),
)


@registry.sections.register
def sections(found: History) -> Sections:
    """The sections."""
    first = found.increments[0].result
    nodes, cuts = counted(first.bodies)
    page = () if found.problem.several else ("explore", "-o", "page.html")
    after = following("march", "-o", "results", written=page)
    return (
        setting(found.problem, nodes, len(found.increments[0].contact.x), cuts),
        section("history", "WHAT HAPPENED", *_happened(found), caption=STEPS, pictures=PICTURES),
        *_at_points(found),
        *([section("promise", PROMISE, *_promised(found))] if found.method == "iteration" else []),
        limits(found.outside, then(found.increments[-1].result, "march", after)),
    )


def _happened(found: History) -> Iterable[Shown | str]:
    units = found.problem.units
    rounding = 1e-12 * max(max(map(abs, each.contact.force.values())) for each in found.increments)
    small = 1e-12 * sum(abs(each.dissipated) for each in found.increments)
    rows = []
    for number, group in groupby(found.increments, key=lambda each: each.step):
        done = list(group)
        force, pattern = done[-1].contact.force, done[-1].contact.pattern
        taken = sum(each.dissipated for each in done)
        normal, tangential = (value if abs(value) > rounding else 0.0 for value in force.values())
        rows.append(
            (
                f"{number} {done[-1].name}".replace(f"{number} step {number}", f"step {number}"),
                count(len(done)),
                _range([each.iterations for each in done]),
                figures(normal, 4),
                figures(tangential, 4),
                "/".join(map(str, pattern.values())),
                figures(taken if abs(taken) > small else 0.0),
            )
        )
    head = ("step", "increments", "steps", "normal", "tangential", "stick/slip/open", "friction")
    yield table(head, rows, right=(1,))
    unit = f"{units['stress']} {units['length']}"
    if found.problem.dimension == 2:
        sums = ", sums over all contacts" if found.problem.several else ""
        yield f"normal and tangential force in {unit}{sums}, work of friction in {unit}^2 (per unit thickness)"
    else:
        yield f"normal force in {units['stress']} (per unit area)"
    if found.ended:
        yield Note(f"{found.ended}.", lead="Not whole:")
        if (last := found.increments[-1].run) is not None and last.unfinished:
            yield from unfinished(last, f"the end of increment {len(found.increments)}")


def _at_points(found: History) -> Sections:
    """The values at the points that a problem names, at the end of each step."""
    ends = [[*group][-1] for _, group in groupby(found.increments, key=lambda each: each.step)]
    rows = [(each.name, one) for each in ends for one in each.points]
    pictures = (("points", "The displacement of the named points over time."),)
    return (section("points", AT_POINTS, *point_rows(rows, found.units), pictures=pictures),) if rows else ()


def _range(numbers: Sequence[int | None]) -> Cell:
    known = [number for number in numbers if number is not None]
    if not known:
        return NONE
    low, high = min(known), max(known)
    return Quantity(high, f"{low} to {high}" if low < high else f"{high}")


def _promised(found: History) -> Iterable[Shown | str]:
    yield (
        "Friction measures slip from the last increment.  The slip so far is an offset that cancels in every"
        " difference: constants, bounds and the factor of one step are the same in each increment."
    )
    rows = []
    for name, bound in found.bounds.items():
        judged = [each.verdicts[name].verdict for each in found.increments]
        said = ", ".join(f"{judged.count(verdict)} {WORDS[verdict]}" for verdict in dict.fromkeys(judged))
        rows.append((name, NONE if bound.factor is None else near_one(bound.factor.value), said))
    yield table(("bound", "factor", "increments"), rows)
    promised = [each.promise.steps for each in found.increments if each.promise is not None and each.promise.steps]
    if promised:
        seen = [each.iterations for each in found.increments]
        yield (
            f"The size of each load increment bounds its steps in advance: at most {_range(promised)}; the runs took"
            f" {_range(seen)}."
        )
    elif why := next((each.why_none for each in found.increments if each.why_none), ""):
        yield f"No number of steps is promised: {why}."
    if predicted := [each.predicted_steps for each in found.increments if each.predicted_steps is not None]:
        yield f"The Jacobian at the end of each increment predicts {_range(predicted)} steps."
