"""All bounds, from the weakest to the strongest: what tables, verdicts, regions and reports loop over."""

from __future__ import annotations

from collections.abc import Sequence

from ndtheory.texts import did_you_mean
from verification.bounds.bound import by_name
from verification.bounds.energy import Energy
from verification.bounds.section5 import Printed, Repaired
from verification.bounds.semidefinite import SemidefiniteBound

#: The bounds by name.  A bound that is put in here at any time is worked out, judged, shown and drawn with the others.
BOUNDS = by_name((Printed(), Repaired(), Energy(), SemidefiniteBound()))


def certifying() -> tuple[str, ...]:
    """The names of the bounds that can propose a certificate, the strongest last."""
    return tuple(name for name, bound in BOUNDS.items() if bound.certifies)


def chosen(names: Sequence[str] | str | None) -> tuple[str, ...]:
    """The names of some bounds, in the order of :data:`BOUNDS`.

    Parameters
    ----------
    names : sequence of str, str or None
        A text has commas between the names; None stands for all bounds.

    Raises
    ------
    ValueError
        No name at all, or one that no bound has; the message lists the names there are.

    Examples
    --------
    >>> chosen("energy, printed")
    ('printed', 'energy')
    """
    if names is None:
        return tuple(BOUNDS)
    listed = [name.strip() for name in names.split(",")] if isinstance(names, str) else list(names)
    known = ", ".join(BOUNDS)
    if not any(listed):
        raise ValueError(f"needed one bound at least of {known}")
    for name in listed:
        if name not in BOUNDS:
            raise ValueError(f"no bound {str(name)!r}, there are {known}{did_you_mean(str(name), BOUNDS)}")
    return tuple(name for name in BOUNDS if name in listed)
