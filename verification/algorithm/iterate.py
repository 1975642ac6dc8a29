"""The values of one evaluation of T."""

from __future__ import annotations

from dataclasses import dataclass

from fem1d2d.mesh import Floats
from verification.contact import ContactSolution
from verification.value import Value


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Iterate(Value):
    """The values of one evaluation of T.

    Interface vectors list tangential components, then normal ones along n of the contact body; g and T g are nodal
    forces on the Neumann body.

    Attributes
    ----------
    iteration : int
        Number of relaxations that led to g.
    g : array
        Nodal forces before the step.
    image : array
        T g: the result of step II, on the Neumann grid.
    displacement : array
        Interface displacement of the Neumann body, from step I, on its own grid.
    contact : ContactSolution
        Step II, on the contact grid.
    residual : float
        ``|||T g - g|||`` in the norm (5.21): taken before relaxation, so that it does not become small with theta.
    size : float
        ``|||T g|||``.
    scale : float
        ``max(|||g|||, |||T g|||)``, the present size of the forces, with which the residual is compared.  An earlier
        size would mislead: a stiff contact body may throw the bodies apart in the first step, and g then decays
        without contact.  A run whose loads give no force has a fixed scale instead, see
        :func:`verification.algorithm.start.least_scale`.
    """

    iteration: int
    g: Floats
    image: Floats
    displacement: Floats
    contact: ContactSolution
    residual: float
    size: float
    scale: float

    @property
    def summary(self) -> str:
        return f"step {self.iteration}, relative residual {self.relative_residual:.2e}"

    @property
    def relative_residual(self) -> float:
        """The residual over the scale; 0 where both vanish."""
        return self.residual / self.scale if self.scale > 0 else (0.0 if self.residual == 0 else float("inf"))
