"""Values of a check on several problems, as evidence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem1d2d.mesh import Floats
from verification.ledger.evidence import Evidence, figure
from verification.ledger.weak_forms import SEED, Case


@dataclass(frozen=True, kw_only=True)
class Found:
    """Values of a check on one problem, and the bound they are held against."""

    case: Case
    values: Floats
    limit: float

    @property
    def name(self) -> str:
        """Of the problem."""
        return self.case.name


def on_problems(found: Sequence[Case]) -> str:
    """How many problems, and how many of them have grids that differ."""
    problems = {case.name: case.grids_differ for case in found}
    apart = sum(problems.values())
    return f"{len(problems)} problems" + (f", of which {apart} have grids that differ" if apart else "")


def equations(of: Any, text: str, found: Sequence[Found], **data: Any) -> Evidence:
    """All values at most their limits; rounding is not reported, only that it is below the limit."""
    worst = max(found, key=lambda f: float(f.values.max(initial=0.0)) / f.limit)
    top, limit = float(worst.values.max(initial=0.0)), max(f.limit for f in found)
    holds = all(bool((f.values <= f.limit).all()) for f in found)
    count = sum(f.values.size for f in found)
    data = _data(found, data) | {"limit": limit}
    if holds:
        return evidence(
            of, True, f"{text}: relative residuals below {limit:g} in {count} cases on {_problems(found)}", data
        )
    data |= {"worst": top, "where": worst.name}
    return evidence(of, False, f"{text}: a relative residual of {top:.3g} ({worst.name}); needed {limit:g}", data)


def inequalities(of: Any, text: str, found: Sequence[Found], **data: Any) -> Evidence:
    """All values at least minus their limits."""
    worst = min(found, key=lambda f: float(f.values.min(initial=0.0)) / f.limit)
    low, limit = float(worst.values.min(initial=0.0)), max(f.limit for f in found)
    holds = all(bool((f.values >= -f.limit).all()) for f in found)
    values = np.concatenate([f.values for f in found])
    # figures far from rounding, and from the test functions that barely leave u
    largest = float(values.max(initial=0.0))
    data = _data(found, data) | {"limit": limit, "largest": figure(largest)}
    if holds:
        seen = f"left minus right over its scale between -{limit:g} and {largest:.3g} for {len(values)} test functions"
        return evidence(of, True, f"{text}: {seen} on {_problems(found)}", data)
    data |= {"worst": low, "where": worst.name}
    return evidence(of, False, f"{text}: left minus right is {low:.3g} of its scale ({worst.name})", data)


def _problems(found: Sequence[Found]) -> str:
    return on_problems([f.case for f in found])


def _data(found: Sequence[Found], data: Mapping[str, Any]) -> dict[str, Any]:
    names = list(dict.fromkeys(f.name for f in found))
    return {"seed": SEED, "problems": names, "cases": sum(f.values.size for f in found), **data}


def evidence(of: Any, holds: bool | None, text: str, data: Mapping[str, Any]) -> Evidence:
    return Evidence(method="discrete", of=of, holds=holds, text=text, data=data)


def figures(values: Floats, size: float) -> list[float]:
    """Six digits relative to a size; what is smaller may be rounding."""
    return [figure(v) + 0.0 for v in np.round(values / size, 6) * size]


def with_friction(found: Sequence[Case]) -> list[Case]:
    return [case for case in found if float(case.problem.contact.friction) > 0]
