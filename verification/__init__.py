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

from verification import registry

TYPE_CHECKING = False  # as typing has it, which takes longer to import than all the rest

#: Must equal ndtheory.__version__: `ndtheory.foreign_verification` looks for it, as another distribution has this name.
__version__ = "0.1.0"

if TYPE_CHECKING:
    from typing import Any

    from verification.algorithm.history import History as History
    from verification.algorithm.history import march as march
    from verification.algorithm.iterate import Iterate as Iterate
    from verification.algorithm.monolithic import Solution as Solution
    from verification.algorithm.monolithic import SolveError as SolveError
    from verification.algorithm.monolithic import solve as solve
    from verification.algorithm.relaxation import Rule as Rule
    from verification.algorithm.runs import Run as Run
    from verification.algorithm.runs import run as run
    from verification.algorithm.start import iterate as iterate
    from verification.certificate.contraction import certify as certify
    from verification.certificate.contraction import check_again as check_again
    from verification.comparison import Comparison as Comparison
    from verification.comparison import compare as compare
    from verification.constants.measured import Measured as Measured
    from verification.constants.measuring import measure as measure
    from verification.contact import ContactError as ContactError
    from verification.coupling.advice import Advice as Advice
    from verification.coupling.driver import Coupling as Coupling
    from verification.coupling.driver import couple as couple
    from verification.coupling.from_logs import advise_logs as advise_logs
    from verification.coupling.from_matrices import advise_matrices as advise_matrices
    from verification.coupling.from_moduli import advise_moduli as advise_moduli
    from verification.coupling.from_problems import advise as advise
    from verification.coupling.from_runs import advise_run as advise_run
    from verification.coupling.from_vectors import advise_vectors as advise_vectors
    from verification.exercises import check as check
    from verification.exploration.page import Exploration as Exploration
    from verification.exploration.page import explore as explore
    from verification.interface.build import build as build
    from verification.interface.interface import Law as Law
    from verification.interface.pair import ContactPair as ContactPair
    from verification.ledger import Ledger as Ledger
    from verification.ledger import verify as verify
    from verification.problem.examples import example as example
    from verification.problem.files import load as load
    from verification.problem.specification import Problem as Problem
    from verification.problem.tables import ProblemError as ProblemError
    from verification.schemas import schema as schema
    from verification.sweeps.sweep import Sweep as Sweep
    from verification.sweeps.sweep import sweep as sweep


def _table(text: str) -> dict[str, tuple[str, ...]]:
    """The words behind each name, a line for each."""
    lines = (line.partition(":") for line in text.split("\n") if ":" in line)
    return {name.strip(): tuple(words.split()) for name, _, words in lines}


#: The public names of each module.  No module at this level has the name of a public function: it would hide it.
_NAMES = _table(
    """
    algorithm.history: History march
    algorithm.iterate: Iterate
    algorithm.monolithic: Solution SolveError solve
    algorithm.relaxation: Rule
    algorithm.runs: Run run
    algorithm.start: iterate
    certificate.contraction: certify check_again
    comparison: Comparison compare
    constants.measured: Measured
    constants.measuring: measure
    contact: ContactError
    coupling.advice: Advice
    coupling.driver: Coupling couple
    coupling.from_logs: advise_logs
    coupling.from_matrices: advise_matrices
    coupling.from_moduli: advise_moduli
    coupling.from_problems: advise
    coupling.from_runs: advise_run
    coupling.from_vectors: advise_vectors
    exercises: check
    exploration.page: Exploration explore
    interface.build: build
    interface.interface: Law
    interface.pair: ContactPair
    ledger: Ledger verify
    problem.examples: example
    problem.files: load
    problem.specification: Problem
    problem.tables: ProblemError
    schemas: schema
    sweeps.sweep: Sweep sweep
    """
)

_HOME = {name: module for module, names in _NAMES.items() for name in names}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'verification' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"verification.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__


#: The modules that fill each table of :mod:`verification.registry`: all entries under "", one entry under its name, or
#: what is shown of the classes of a module.
FILLS: dict[str, dict[str, tuple[str, ...]]] = {
    "laws": _table(": interface.friction"),
    "rules": _table(": algorithm.relaxation"),
    "bounds": _table(": bounds.table semidefinite.bound free_norm.bound"),
    "log formats": _table(": coupling.log_formats"),
    "proofs": _table("constants: certificate.proved_constants\nlosses: semidefinite.losses"),
    "documents": {
        "": tuple(
            str.split(
                """
            algorithm.history algorithm.monolithic algorithm.runs bounds.table certificate.continuum
            certificate.contraction cli.console cli.problems comparison constants.measured coupling.advice
            exploration.page free_norm.two_layers interface.draft ledger.rows reproduce.experiments sweeps.region
            sweeps.store sweeps.sweep
            """
            )
        )
    },
    "sections": _table(
        """
        algorithm.history: sections.history
        algorithm.monolithic: sections.run
        algorithm.runs: sections.run
        bounds.table: sections.bounds
        certificate.continuum: certificate.sections
        certificate.contraction: certificate.sections
        comparison: sections.comparison
        constants.measured: sections.constants
        coupling.advice: coupling.sections coupling.runs_sections coupling.material_sections
        exploration.page: exploration.sections
        free_norm.two_layers: free_norm.sections
        ledger.rows: ledger.sections
        reproduce.experiments: reproduce.sections
        sweeps.region: sweeps.sections
        sweeps.store: sweeps.sections
        sweeps.sweep: sweeps.sections
        """
    ),
    "figures": _table(
        """
        algorithm.history: figures.history
        algorithm.monolithic: figures.bodies
        algorithm.runs: figures.residuals
        bounds.table: figures.squares
        comparison: figures.residuals
        constants.measured: figures.factor
        coupling.advice: figures.factor
        free_norm.two_layers: figures.layer_plane
        reproduce.experiments: figures.reproduction
        sweeps.region: figures.region
        sweeps.sweep: figures.sweep
        """
    ),
}


def _load(table: str, name: str) -> None:
    for module in FILLS[table].get(name, ()):
        importlib.import_module(f"verification.{module}")


registry.load = _load
