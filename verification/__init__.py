"""The theorem compared with finite elements: problem files, constants, the iteration, verdicts.

Each name is imported at its first use: ``ndtheory bounds`` starts without numpy.

>>> import verification as vf
>>> bars = vf.Problem.from_dict({
...     "dimension": 1,
...     "body1": {"shape": "interval", "x": [0, 1], "cells": 4, "young": 1, "fixed": ["left"]},
...     "body2": {"shape": "interval", "x": [1, 2], "cells": 4, "young": 2, "prescribed": {"right": -0.1}},
... })
>>> vf.run(bars, theta="2/3").iterations
1
"""

from __future__ import annotations

import importlib

TYPE_CHECKING = False  # as typing has it, which takes longer to import than all the rest

#: Must equal ndtheory.__version__; the command checks it, as another distribution installs a package of this name.
__version__ = "0.1.0"

if TYPE_CHECKING:
    from typing import Any

    from verification.advice.from_logs import advise_logs
    from verification.advice.from_matrices import advise_matrices
    from verification.advice.from_moduli import advise_moduli
    from verification.advice.from_runs import advise_run
    from verification.advice.roles import Advice, advise
    from verification.algorithm.iterate import Iterate
    from verification.algorithm.relaxation import Rule
    from verification.algorithm.runs import Run, run
    from verification.algorithm.start import iterate
    from verification.certificate.contraction import certify, check_again
    from verification.comparison import Comparison, compare
    from verification.constants.measured import Measured
    from verification.constants.measuring import measure
    from verification.contact import ContactError
    from verification.interface.build import build
    from verification.interface.interface import Law
    from verification.interface.pair import ContactPair
    from verification.ledger import Ledger, verify
    from verification.monolithic import Solution, SolveError, solve
    from verification.problem.examples import example
    from verification.problem.files import load
    from verification.problem.specification import Problem
    from verification.problem.tables import ProblemError
    from verification.sweeps.sweep import Sweep, sweep

#: The module of each public name.  No module at this level has the name of a public function: it would hide it.
_HOME = {
    "Advice": "advice.roles",
    "Comparison": "comparison",
    "ContactError": "contact",
    "ContactPair": "interface.pair",
    "Law": "interface.interface",
    "Ledger": "ledger",
    "Measured": "constants.measured",
    "Problem": "problem.specification",
    "ProblemError": "problem.tables",
    "Rule": "algorithm.relaxation",
    "Run": "algorithm.runs",
    "Solution": "monolithic",
    "SolveError": "monolithic",
    "Sweep": "sweeps.sweep",
    "Iterate": "algorithm.iterate",
    "advise": "advice.roles",
    "advise_logs": "advice.from_logs",
    "advise_matrices": "advice.from_matrices",
    "advise_moduli": "advice.from_moduli",
    "advise_run": "advice.from_runs",
    "build": "interface.build",
    "certify": "certificate.contraction",
    "check_again": "certificate.contraction",
    "compare": "comparison",
    "example": "problem.examples",
    "iterate": "algorithm.start",
    "load": "problem.files",
    "measure": "constants.measuring",
    "run": "algorithm.runs",
    "solve": "monolithic",
    "sweep": "sweeps.sweep",
    "verify": "ledger",
}

__all__ = [
    "Advice",
    "Comparison",
    "ContactError",
    "ContactPair",
    "Iterate",
    "Law",
    "Ledger",
    "Measured",
    "Problem",
    "ProblemError",
    "Rule",
    "Run",
    "Solution",
    "SolveError",
    "Sweep",
    "advise",
    "advise_logs",
    "advise_matrices",
    "advise_moduli",
    "advise_run",
    "build",
    "certify",
    "check_again",
    "compare",
    "example",
    "iterate",
    "load",
    "measure",
    "run",
    "solve",
    "sweep",
    "verify",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'verification' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"verification.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
