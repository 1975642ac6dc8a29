"""Results of property tests: a report of what holds, or a refusal with its counterexample."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from hypothesis.errors import Flaky

from verification.interface.pair import ContactPair
from verification.problem import Problem

#: Cases are drawn, and the first that fails is made simpler.
PHASES = (Phase.generate, Phase.shrink)

#: A counterexample is made simpler with at most so many more draws: they cost as much as the others.
SIMPLER = 40


class Fails(Exception):
    """A test of one case failed; the message describes how."""


class _Enough(BaseException):
    """The counterexample is simple enough; hypothesis stops only at a ``BaseException``."""


class Refused(AssertionError):
    """A property that does not hold, and a case in which it does not.

    Attributes
    ----------
    subject, property, how : str
        What was checked, what it must do, and what it did instead.
    counterexample : mapping
        The case by name: a pair, forces, a theta.
    """

    def __init__(self, subject: str, property: str, how: str, counterexample: Mapping[str, Any]) -> None:
        self.subject, self.property, self.how = subject, property, how
        self.counterexample: Mapping[str, Any] = MappingProxyType(dict(counterexample))
        shown = "".join(f"\n  {name} = {describe(value)}" for name, value in counterexample.items())
        super().__init__(f"{subject}: {property}: {how}" + (f"\ncounterexample:{shown}" if shown else ""))


@dataclass(frozen=True, kw_only=True)
class Finding:
    """The verdict on one property: 'holds', 'attained', 'not attained' or 'not asked'.

    ``detail`` says over how many cases, by how much, or why it was not asked.
    """

    property: str
    verdict: str
    detail: str = ""


@dataclass(frozen=True, kw_only=True)
class Report:
    """The findings on a subject, by property."""

    subject: str
    findings: tuple[Finding, ...]

    def __getitem__(self, property: str) -> Finding:
        return next(finding for finding in self.findings if finding.property == property)

    def __str__(self) -> str:
        width = max(len(finding.property) for finding in self.findings)
        lines = [f"  {f.property:{width}}  {f.verdict:12}  {f.detail}".rstrip() for f in self.findings]
        return "\n".join([self.subject, *lines])


def over(cases: int) -> str:
    """The number of cases in words."""
    return f"{cases} case{'s' if cases != 1 else ''}"


@dataclass(frozen=True)
class Kit:
    """The tests of one subject, with so many drawn cases for each property."""

    subject: str
    examples: int

    def refused(self, property: str, how: str, /, **case: Any) -> Refused:
        """The error for a property that does not hold in a case."""
        return Refused(self.subject, property, how, case)

    def examine(self, property: str, cases: st.SearchStrategy[dict[str, Any]], test: Callable[..., None]) -> Finding:
        """Test a property on drawn cases; raise Refused with the simplest case found in which it fails.

        A case is the keywords of ``test``, which raises :class:`Fails` where the property does not hold.
        """
        seen: list[Refused] = []
        tried = more = 0

        @st.composite
        def counted(draw: st.DrawFn) -> dict[str, Any]:
            nonlocal more
            more += bool(seen)
            if more > SIMPLER:
                raise _Enough
            return draw(cases)

        @settings(
            max_examples=self.examples,
            deadline=None,
            database=None,
            phases=PHASES,
            report_multiple_bugs=False,
            suppress_health_check=list(HealthCheck),
        )
        @given(case=counted())
        def run(case: dict[str, Any]) -> None:
            nonlocal tried
            tried += 1
            try:
                test(**case)
            except Fails as failure:
                seen.append(self.refused(property, str(failure), **case))
                raise seen[-1] from None

        try:
            run()
        except _Enough:
            raise seen[-1] from None
        except Flaky:  # what remembers earlier cases does not fail the same way twice
            if not seen:
                raise
            raise seen[-1] from None
        return Finding(property=property, verdict="holds", detail=over(tried))

    def report(self, *findings: Finding) -> Report:
        """The report of all findings."""
        return Report(subject=self.subject, findings=findings)


def describe(value: Any) -> str:
    """A value of a counterexample, so that it can be made again."""
    if isinstance(value, np.ndarray):
        return np.array2string(value, separator=", ", threshold=64, precision=6).replace("\n", "")
    if isinstance(value, Problem):
        return repr(value.to_dict())
    if not isinstance(value, ContactPair):
        return str(value)
    if value.problem is not None:
        return f"build(Problem.from_dict({value.problem.to_dict()!r}))"
    (lower, upper), interface = value.along_y, value.interface
    given = {
        "S1": lower.schur,
        "S2": upper.schur,
        "load1": lower.load,
        "load2": upper.load,
        "x": value.contact.grid.x,
        "weights": value.contact.grid.weights,
        "gap": interface.gap,
        "kernel": interface.kernel,
        "transfer": None if interface.one_grid else interface.transfer,
        "friction": value.friction,
        "neumann_body": value.neumann_body,
    }
    return f"build({', '.join(f'{name}={describe(entry)}' for name, entry in given.items() if entry is not None)})"
