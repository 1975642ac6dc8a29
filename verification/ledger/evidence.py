"""The evidence that a check of a statement found, and the verdict that follows."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

from verification.machine.threads import one_thread

Level = Literal["quick", "full"]
Method = Literal["symbolic", "dimension", "verified", "discrete", "reading"]
Form = Literal["printed", "step", "repaired"]
Verdict = Literal["PROVED", "REPAIRED", "REFUTED", "NUMERICAL", "ASSUMED", "INCONCLUSIVE"]

#: Strongest first.
METHODS: tuple[Method, ...] = ("symbolic", "dimension", "verified", "discrete", "reading")


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """One piece of evidence.

    Attributes
    ----------
    method : {'symbolic', 'dimension', 'verified', 'discrete', 'reading'}
        Exact arithmetic over all admissible values, or an exact counterexample; units on both sides; both sides on one
        problem, between proved bounds or rational; floating point on random problems; a definition, a cited result, a
        proof in words or one case computed exactly.
    of : {'printed', 'step', 'repaired'}
        What was checked: the statement as printed, the step by which the paper reaches it, or its repaired form.
    holds : bool or None
        None where the check could not decide.
    text : str
        What was checked and found.
    data : mapping
        What it takes to run it again: an exact counterexample, or seed, cases, worst ratio and where.
    """

    method: Method
    of: Form
    holds: bool | None
    text: str
    data: Mapping[str, Any] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """An entry of ``evidence`` in ``ndtheory.ledger/1``."""
        return {
            "method": self.method,
            "of": self.of,
            "holds": self.holds,
            "text": self.text,
            **({"data": dict(self.data)} if self.data else {}),
        }


class Source(Protocol):
    """A function that gathers evidence, by statement: each module that gathers has one.

    ``ids`` are statements, None for all; those that it has no check for are left out of the answer.  The level decides
    how many problems are taken, where that matters.  ``watch`` is called with the share that is done.
    """

    def __call__(
        self, ids: Collection[str], level: Level, watch: Callable[[float], None], /
    ) -> Mapping[str, Sequence[Evidence]]: ...


def figure(value: float, digits: int = 6) -> float:
    """A number to so many significant digits: what another machine reproduces."""
    return float(f"{value:.{digits - 1}e}")


def source(checks: Mapping[str, Callable[[Any], list[Evidence]]], shared: Callable[[Level], Any]) -> Source:
    """A source with one check for each statement; the checks share an object, made for the level if any is wanted."""

    def gather(
        ids: Collection[str] | None = None, level: Level = "quick", watch: Callable[[float], None] = lambda done: None
    ) -> dict[str, list[Evidence]]:
        chosen = [id for id in checks if ids is None or id in ids]
        found = {}
        with one_thread():
            given = shared(level) if chosen else None
            for done, id in enumerate(chosen):
                watch(done / len(chosen))
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
