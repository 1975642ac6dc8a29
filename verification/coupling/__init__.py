"""Two solvers of any code coupled by vectors: the loop, or the next vector for your loop."""

from verification.coupling.driver import Coupled, Coupling, CouplingError, CouplingState, couple

__all__ = ["Coupled", "Coupling", "CouplingError", "CouplingState", "couple"]
