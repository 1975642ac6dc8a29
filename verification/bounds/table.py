"""All bounds, from the weakest to the strongest: what tables, verdicts, regions and reports loop over."""

from __future__ import annotations

from verification.bounds.bound import by_name
from verification.bounds.energy import Energy
from verification.bounds.section5 import Printed, Repaired
from verification.bounds.semidefinite import SemidefiniteBound

BOUNDS = by_name((Printed(), Repaired(), Energy(), SemidefiniteBound()))
