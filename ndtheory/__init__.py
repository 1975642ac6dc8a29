"""The convergence theorem of Bayada, Sabil and Sassi (2008), on paper.

Constants in, contraction interval out: the theorem as printed, as repaired, and in energy norms.  This package contains
no finite elements and needs only the standard library.

>>> from ndtheory import Constants, REPAIRED, evaluate
>>> c = Constants(m=1, M=2, C_R="3/2", C_K=0)
>>> evaluate(REPAIRED, c, theta="1/10").verdict
'contraction'
"""

from ndtheory.bounds import EDITIONS, PRINTED, REPAIRED, Bounds, Edition, evaluate
from ndtheory.constants import Constants, EnergyConstants, relaxation_factor
from ndtheory.energy_norms import EnergyBounds, evaluate_energy
from ndtheory.errors import HypothesisError
from ndtheory.number import Number, exact

__version__ = "0.1.0"

__all__ = [
    "EDITIONS",
    "PRINTED",
    "REPAIRED",
    "Bounds",
    "Constants",
    "Edition",
    "EnergyBounds",
    "EnergyConstants",
    "HypothesisError",
    "Number",
    "__version__",
    "evaluate",
    "evaluate_energy",
    "exact",
    "relaxation_factor",
]
