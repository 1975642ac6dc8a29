"""Words of the problem file that are defined above it: the laws of friction and the relaxation rules."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol


class LawEntry(Protocol):
    """The attributes of a law that a reader needs; see :class:`verification.interface.interface.Law`."""

    label: str
    needs_radius: bool


class RuleEntry(Protocol):
    """The attributes of a rule that a reader needs; see :class:`verification.algorithm.relaxation.Rule`."""

    takes_theta: bool


@dataclass(frozen=True)
class Vocabulary:
    """The laws and rules that a problem file may name."""

    laws: Mapping[str, LawEntry]
    rules: Mapping[str, RuleEntry]

    def takes_theta(self, relaxation: Any) -> bool:
        """True if the rule of a name uses a given theta; other names are refused elsewhere."""
        rule = self.rules.get(relaxation) if isinstance(relaxation, str) else None
        return rule is None or rule.takes_theta


def vocabulary() -> Vocabulary:
    """The laws and rules that are registered now.

    Their modules are imported by name, and only here: a law acts on an interface and a rule on a pair of bodies, both
    made from problems.
    """
    laws = importlib.import_module("verification.interface.friction").LAWS
    rules = importlib.import_module("verification.algorithm.relaxation").RULES
    return Vocabulary(laws, rules)
