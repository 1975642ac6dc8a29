"""The sections of any result: a kind of result that comes later registers its function here."""

from __future__ import annotations

from functools import singledispatch
from typing import Any

from verification.advice.roles import Advice
from verification.algorithm.runs import Run
from verification.bounds.calculated import Calculated
from verification.bounds.region import Plane
from verification.certificate.continuum import ContinuumCertificate
from verification.certificate.contraction import Certificate, Checked
from verification.comparison import Comparison
from verification.constants import Measured
from verification.ledger.rows import Ledger
from verification.monolithic import Solution
from verification.reproduce.experiments import Reproduction
from verification.sections import (
    advice,
    bounds,
    certificate,
    comparison,
    constants,
    continuum,
    ledger,
    region,
    reproduction,
    run,
    sweep,
)
from verification.sections.parts import Sections
from verification.sweeps.keeping import Plan
from verification.sweeps.sweep import Sweep


@singledispatch
def of(result: Any) -> Sections:
    """The sections of a result; none of a kind that has none, which is shown as its document.

    ``of.register(Mine, function)`` gives the results of a class their sections.
    """
    return ()


of.register(Advice, advice.sections)
of.register(Calculated, bounds.sections)
of.register(Certificate, certificate.sections)
of.register(Checked, certificate.checked)
of.register(Comparison, comparison.sections)
of.register(ContinuumCertificate, continuum.sections)
of.register(Ledger, ledger.sections)
of.register(Measured, constants.sections)
of.register(Plan, sweep.plan)
of.register(Plane, region.sections)
of.register(Reproduction, reproduction.sections)
of.register(Run, run.sections)
of.register(Solution, run.solution)
of.register(Sweep, sweep.sections)
