"""The convergence theorem of Bayada, Sabil and Sassi (2008), on paper.

Constants in, contraction interval out: the theorem as printed, as repaired, and in energy norms.  This package contains
no finite elements and needs only the standard library.

>>> from ndtheory import Constants, REPAIRED, evaluate
>>> c = Constants(m=1, M=2, C_R="3/2", C_K=0)
>>> evaluate(REPAIRED, c, theta="1/10").verdict
'contraction'
"""

import warnings
from importlib.machinery import PathFinder
from pathlib import Path

from ndtheory.bounds import EDITIONS, PRINTED, REPAIRED, Bounds, Edition, evaluate
from ndtheory.constants import Constants, EnergyConstants, relaxation_factor
from ndtheory.energy_norms import EnergyBounds, evaluate_energy
from ndtheory.errors import HypothesisError
from ndtheory.number import Number, exact

__version__ = "0.1.0"


def foreign_verification() -> str:
    """Say that the package `verification` beside this one is not ours; empty where it is, and where there is none.

    Another distribution on the package index installs a package of that name, whose first file is empty.  pip replaces
    ours by it without a message.  This looks for the file and does not import it.
    """
    found = PathFinder.find_spec("verification")
    if found is None:
        return ""
    here = found.origin or "a folder without __init__.py"
    try:
        ours = found.origin is not None and f'__version__ = "{__version__}"' in Path(found.origin).read_text("utf-8")
    except (OSError, UnicodeDecodeError):  # in an archive, for example
        ours = True
    return (
        ""
        if ours
        else f"ndtheory {__version__} found a package `verification` of another distribution or version ({here});"
        " needed: pip uninstall verification, then pip install --force-reinstall --no-deps WHEEL"
    )


if _message := foreign_verification():
    warnings.warn(_message, RuntimeWarning, stacklevel=2)

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
