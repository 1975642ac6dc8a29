"""The evidence that a check of a statement found, and the verdict that follows."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol

from ndtheory.keys import ABSENT, Part, key
from verification.machine.threads import one_thread

Level = Literal["quick", "full"]
Method = Literal["symbolic", "dimension", "verified", "discrete", "reading"]
Aspect = Literal["printed", "step", "repaired"]
Verdict = Literal["PROVED", "REPAIRED", "REFUTED", "NUMERICAL", "ASSUMED", "INCONCLUSIVE"]

#: Strongest first.
METHODS: tuple[Method, ...] = ("symbolic", "dimension", "verified", "discrete", "reading")


@dataclass(frozen=True, kw_only=True)
class Evidence(Part):
    """One piece of evidence; the method is the kind of arithmetic, and decides how strong it is."""

    method: Method = key(
        "`symbolic`, exact arithmetic over all admissible values, or an exact counterexample; `dimension`, units on"
        " both sides; `verified`, both sides between proved bounds, or rational, on one problem, which is in `data`"
        " with `where` and the bounds `ratio` of left over right (and the `unit` of stress and how many times the"
        " `friction` of the problem, where these are not its own), or with both `forces` and the largest `difference`"
        " of both sides; `discrete`, floating point on random problems; `reading`, a definition, a cited result, a"
        " proof in words or one case computed exactly"
    )
    of: Aspect = key("what was checked: `printed`, `step` by which the paper reaches it, or `repaired`")
    holds: bool | None = key(null="where the check could not decide", why=None)
    text: str = key("what was checked and found")
    data: Mapping[str, Any] = key(
        "the data needed to run it again: a counterexample, or seed, cases, worst ratio and where; of the figures of"
        " Section 6 `departs`, true if every reading that shows one departs from the text",
        default_factory=dict,
        type="free",
        absent="where nothing is needed",
        of=lambda data: dict(data) or ABSENT,
    )


#: A function that gets the share of the work that is done.
Watch = Callable[[float], None]


class Source(Protocol):
    """A function that gathers evidence, by statement: each module that gathers has one.

    ``ids`` are statements, None for all; those that it has no check for are left out of the answer.  The level decides
    how many problems are taken, where that matters.  ``watch`` is called with the share that is done.
    """

    def __call__(self, ids: Collection[str], level: Level, watch: Watch, /) -> Mapping[str, Sequence[Evidence]]: ...


def figure(value: float, digits: int = 6) -> float:
    """A number to so many significant digits: what another machine reproduces."""
    return float(f"{value:.{digits - 1}e}")


def source(checks: Mapping[str, Callable[[Any], list[Evidence]]], shared: Callable[[Level, Watch], Any]) -> Source:
    """A source with one check for each statement; the checks share an object, made for the level if any is wanted."""

    def gather(
        ids: Collection[str] | None = None, level: Level = "quick", watch: Watch = lambda done: None
    ) -> dict[str, list[Evidence]]:
        chosen = [id for id in checks if ids is None or id in ids]
        found, shares = {}, [0.0]

        def grow(share: float) -> None:
            shares.append(max(shares[-1], share))
            watch(shares[-1])

        with one_thread():
            given = shared(level, grow) if chosen else None
            for done, id in enumerate(chosen):
                grow(done / len(chosen))
                if entries := checks[id](given):
                    found[id] = entries
        watch(1.0)
        return found

    return gather


def settle(evidence: Sequence[Evidence]) -> tuple[Verdict, Method | None]:
    """The verdict on a statement, and the method that decided it.

    A printed form or a step that fails makes the statement REPAIRED where a repaired form is proved in exact
    arithmetic or by reading, else REFUTED.  Units decide nothing: in one fixed unit of stress numbers may be added, and
    sides of one unit may still differ.  What exact arithmetic leaves undecided stays INCONCLUSIVE, and a repaired form
    that fails is a fault of ours.  Enclosures on one problem prove that a statement fails, but not that it holds on
    others; floating point proves nothing: at best a statement is NUMERICAL.  Nor does it add
    anything to a definition or to a theorem of others, which stay ASSUMED on however many problems they were seen.

    Examples
    --------
    >>> seen = Evidence(method="discrete", of="printed", holds=True, text="ratio <= 0.4 in 100 cases")
    >>> settle([seen])
    ('NUMERICAL', 'discrete')
    >>> settle([seen, Evidence(method="reading", of="printed", holds=True, text="Definition.")])
    ('ASSUMED', 'reading')
    """
    ordered = sorted(evidence, key=lambda e: METHODS.index(e.method))
    undecided = [e for e in ordered if e.holds is None]
    if any(e.method == "symbolic" for e in undecided) or any(e.holds is False for e in ordered if e.of == "repaired"):
        return "INCONCLUSIVE", ordered[0].method
    broken = [e for e in ordered if e.holds is False and e.method != "dimension"]
    if broken:
        mended = any(e.holds and e.of == "repaired" and e.method in ("symbolic", "reading") for e in ordered)
        return ("REPAIRED" if mended else "REFUTED"), broken[0].method
    differ = [e for e in ordered if e.holds is False]  # only of units
    stands = {e.method for e in ordered if e.holds}
    if differ or (undecided and "symbolic" not in stands):
        return "INCONCLUSIVE", (*differ, *undecided)[0].method
    verdicts: dict[Method, Verdict] = {
        "symbolic": "PROVED",
        "reading": "ASSUMED",
        "verified": "NUMERICAL",
        "discrete": "NUMERICAL",
    }
    return next(((verdict, method) for method, verdict in verdicts.items() if method in stands), ("INCONCLUSIVE", None))
