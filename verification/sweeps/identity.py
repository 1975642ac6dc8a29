"""The identity of a row: the problem, the values, how it is solved, and the number of the numerics.

A store outlives releases.  A row that another version of this library has made is the row that this one would make,
unless :data:`NUMERICS` was raised in between.
"""

from __future__ import annotations

import hashlib
import itertools
import json
from dataclasses import MISSING, dataclass, field, replace
from fractions import Fraction
from typing import Any

import numpy as np

from verification.algorithm.relaxation import rule_of
from verification.interface.friction import GivenOperator
from verification.interface.interface import Law
from verification.interface.pair import ContactPair
from verification.problem.specification import Problem
from verification.problem.tables import ProblemError
from verification.registry import LAWS, RULES
from verification.sweeps.grid import SweepGrid

#: The solver of step II in a row: the active set, and the model where that does not settle.
SOLVER = "auto"

#: Raised by every change of a digit of a row, and only by these: 2 since a residual is compared with present forces, 3
#: since a node that is held tangentially has no friction, and the normal between two lines is the mean of both.
NUMERICS = 3

#: Settings and arrays (name in the key: attribute) that always enter the key of a pair; a later setting enters where it
#: differs from its default, a later array where there is one, so that keys stay.
SETTINGS = ("theta", "relaxation", "tolerance", "max_iterations")
ARRAYS = {"stiffness": "schur", "load": "load", "known": "known", "free": "free", "motions": "motions"}

#: Why a rule or a law of a user's own has no key.
NEEDED = "needed a {} of this library, as nothing tells two versions of another one apart; or no store"

#: Bytes of a key: at a million rows two of them agree by chance once in 1e26 stores.
LENGTH = 16


@dataclass(frozen=True, kw_only=True)
class Identity:
    """The data that rows of a sweep have in common, as far as a digit of them can depend on it.

    Attributes
    ----------
    of : str
        The problem or the pair, as JSON; numbers exactly, mesh files and matrices by their content.
    source : str
        The name of the problem in errors.
    numerics : int
        Number of the numerics.
    version : str
        Empty, except in a store of 0.1.0: there a key holds the version of this library, too.
    """

    of: str
    source: str
    numerics: int = field(default_factory=lambda: NUMERICS)
    version: str = ""

    @classmethod
    def read(cls, start: Problem | ContactPair) -> Identity:
        """Return the identity of a problem or of a pair.

        Raises
        ------
        ProblemError
            The pair has a user's own law of friction, of which nothing distinguishes two versions.
        """
        if isinstance(start, Problem):
            return cls(of=json.dumps({"problem": start.digest}), source=start.source)
        return cls(of=json.dumps(_of_pair(start), sort_keys=True), source=start.source)

    def before(self, numerics: int, version: str = "") -> Identity:
        """Return the same under another number of the numerics; with a version, as a store of 0.1.0 has it."""
        return replace(self, numerics=numerics, version=version)

    def study(self, version: str) -> str:
        """Return the key under which a version of this library keeps it: SHA-256, in hexadecimal digits."""
        of = self._written() if self.version else {"made by": version} | self._written()
        return hashlib.sha256(json.dumps(of).encode("ascii")).hexdigest()

    def _written(self) -> dict[str, Any]:
        of = {"numerics": self.numerics, "solver": SOLVER, "of": self.of}
        return {"version": self.version} | of if self.version else of

    def keys(self, grid: SweepGrid) -> list[bytes]:
        """Return the key of each row of a grid, in the order of its rows.

        Raises
        ------
        ProblemError
            A user's own relaxation rule, of which nothing distinguishes two versions.

        Examples
        --------
        >>> bars = Problem.from_dict({"dimension": 1,
        ...     "body1": {"shape": "interval", "x": [0, 1], "cells": 4, "young": 2, "fixed": ["left"]},
        ...     "body2": {"shape": "interval", "x": [1, 2], "cells": 4, "young": 1, "prescribed": {"right": -0.1}}})
        >>> keys = lambda *theta: Identity.read(bars).keys(SweepGrid.of({"theta": theta}))
        >>> keys("1/3", 0.5)[1] == keys("1/2")[0] != keys("1/3")[0]
        True
        """
        axes = [[f"{name}={self._text(name, value)};".encode() for value in grid.axes[name]] for name in grid.axes]
        start, keys = hashlib.sha256(json.dumps(self._written()).encode("ascii")), []
        for values in itertools.product(*axes):
            one = start.copy()
            one.update(b"".join(values))
            keys.append(one.digest()[:LENGTH])
        return keys

    def _text(self, name: str, value: Any) -> str:
        if name == "rule":
            rule = rule_of(value)
            if RULES.get(rule.name) != rule:
                raise ProblemError(self.source, "rule", rule.name, NEEDED.format("rule"))
            return rule.name
        if isinstance(value, tuple):
            return ",".join(exactly(v) for v in value)
        return exactly(value) if isinstance(value, Fraction) else str(value)


def exactly(value: Fraction) -> str:
    """Write a rational as a text, of whatever length.

    >>> exactly(Fraction(1, 10))
    '1/a'
    """
    return f"{value.numerator:x}/{value.denominator:x}"


def _of_pair(pair: ContactPair) -> dict[str, Any]:
    """Describe a pair by its matrices, bit by bit, and by everything else on which a run of it depends."""
    default, interface = type(pair.settings)(), pair.interface
    settings = {
        name: value
        for name, value in vars(pair.settings).items()
        if name in SETTINGS or value != getattr(default, name)
    }
    arrays: dict[str, Any] = {"gap": interface.gap, "transfer": None if interface.one_grid else interface.transfer}
    arrays |= {} if interface.join.alike else {"on_traces": interface.carry(np.eye(interface.neumann.size))}
    arrays |= {"slipped": interface.slipped} if interface.slipped.any() else {}
    for name, side in (("contact", pair.contact), ("neumann", pair.neumann)):
        arrays |= {f"{name}.{part}": getattr(side, attribute) for part, attribute in ARRAYS.items()}
        arrays |= {f"{name}.x": side.grid.x, f"{name}.weights": side.grid.weights}
    profile = interface.profile
    varies = (
        {} if profile is None else {"profile": [[exactly(v) for v in vars(profile)[name]] for name in vars(profile)]}
    )
    return varies | {
        "matrices": {name: None if array is None else _content(array) for name, array in arrays.items()},
        "upward": [pair.contact.upward, pair.neumann.upward],
        "dimension": pair.contact.grid.dimension,
        "law": None if interface.law is None else _law(interface.law, pair.source),
        "friction": exactly(pair.friction),
        "neumann_body": pair.neumann_body,
        "settings": {name: str(value) for name, value in settings.items()},
        "problem": None if pair.problem is None else pair.problem.digest,
    }


def _content(array: Any) -> str:
    plain = np.ascontiguousarray(array)
    return f"{plain.dtype.str} {plain.shape} {hashlib.sha256(plain.tobytes()).hexdigest()}"


def _law(law: Law, source: str) -> dict[str, str]:
    if isinstance(law, GivenOperator):
        return {"name": law.name, "words": law.words, "outside": law.outside, "matrix": _content(law.matrix)}
    if type(law) not in LAWS.values():
        raise ProblemError(source, "law", type(law).__name__, NEEDED.format("law"))
    default = {name: field.default for name, field in getattr(type(law), "__dataclass_fields__", {}).items()}
    given = {name: str(value) for name, value in vars(law).items() if value != default.get(name, MISSING)}
    return {"name": law.name} | given
