"""The document of the calculator: bounds of constants that were given."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from ndtheory import Constants, EnergyConstants
from ndtheory.constants import relaxation_factor
from verification.bounds.bound import BoundResult
from verification.document import Document

#: The constants of Section 5 that may be given, and those of the theorem in energy norms.
SECTION_5, ENERGY = ("m", "M", "C_R", "C_s", "C_tr", "k", "C_K"), ("rho", "kappa_1", "kappa_2")


class Calculated(Document):
    """``ndtheory.bounds/1``.

    Parameters
    ----------
    constants : Constants or None
    energy : EnergyConstants or None
    theta : number or None
    results : mapping from the name of a bound to BoundResult
    """

    schema: ClassVar[str] = "ndtheory.bounds/1"
    units: Mapping[str, str] = {"length": "any", "stress": "that of m"}

    def __init__(
        self,
        *,
        constants: Constants | None,
        energy: EnergyConstants | None,
        theta: Any,
        results: Mapping[str, BoundResult],
    ) -> None:
        self.constants, self.energy, self.theta, self.results = constants, energy, theta, results

    def content(self) -> dict[str, Any]:
        given: dict[str, Any] = {key: getattr(self.constants, key, None) for key in SECTION_5}
        given |= {key: getattr(self.energy, key, None) for key in ENERGY}
        given["theta"] = None if self.theta is None else relaxation_factor(self.theta)
        absent = {key: "not given" for key, value in given.items() if value is None}
        inputs = {key: None if value is None else float(value) for key, value in given.items()}
        return {
            "inputs": inputs | {"reason": absent},
            "editions": {name: result.to_dict() for name, result in self.results.items()},
            "reason": {name: result.not_computed for name, result in self.results.items() if result.not_computed},
        }
