"""The sources of evidence for the ledger."""

from __future__ import annotations

from functools import partial

from ndtheory.symbolic.checks import checks
from ndtheory.symbolic.dimension import consistent
from ndtheory.symbolic.symbols import DIMENSIONS
from verification.ledger.enclosures import enclosed
from verification.ledger.evidence import Evidence, Method, Source, source
from verification.ledger.experiments import experiments
from verification.ledger.large_friction import large_friction
from verification.ledger.rational_pairs import in_rationals
from verification.ledger.solutions import solutions
from verification.ledger.worst import discrete


def _exact(id: str, given: object) -> list[Evidence]:
    entries = []
    for check in (each for each in checks() if each.id == id):
        for of, form in check.forms.items():
            decision = check.decide(form)
            data = {"counterexample": dict(decision.counterexample)} if decision.counterexample else {}
            # one case refutes; where it does not, it shows no more than that case
            shown = check.one_case and decision.holds
            method: Method = "reading" if shown else "symbolic"
            text = f"One case, computed exactly.  {check.text}" if shown else check.text
            entries.append(Evidence(method=method, of=of, holds=decision.holds, text=text, data=data))
        for of, relations in check.units.items():
            differ = consistent(relations, DIMENSIONS)
            text = "both sides have one unit" if differ is None else f"units differ: {differ}"
            entries.append(Evidence(method="dimension", of=of, holds=differ is None, text=text))
    return entries


#: Symbolic evidence and units, the same at both levels.
exact = source({check.id: partial(_exact, check.id) for check in checks()}, lambda level, watch: None)

#: By the name that progress messages have.
SOURCES: dict[str, Source] = {
    "exact arithmetic and units": exact,
    "inequalities on random problems": discrete,
    "inequalities with enclosures": enclosed,
    "equalities in rationals": in_rationals,
    "large friction": large_friction,
    "solutions": solutions,
    "experiments of Section 6": experiments,
}
