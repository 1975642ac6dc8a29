"""All bounds, from the weakest to the strongest: what tables, verdicts, regions and reports loop over."""

from __future__ import annotations

from collections.abc import Sequence

from ndtheory.texts import did_you_mean
from verification.bounds.bound import Bound, Removed, by_name
from verification.bounds.energy import Energy
from verification.bounds.section5 import Printed, Repaired
from verification.bounds.semidefinite import SemidefiniteBound

#: The bounds by name.  A bound that is put in here at any time is worked out, judged, shown and drawn with the others.
BOUNDS = by_name((Printed(), Repaired(), Energy(), SemidefiniteBound()))


def named(name: str) -> Bound:
    """The bound of a result, which may have been taken out of :data:`BOUNDS` since the result was made."""
    return BOUNDS.get(name) or Removed(name)


def certifying() -> tuple[str, ...]:
    """The names of the bounds that can propose a certificate, in the order of :data:`BOUNDS`."""
    return tuple(name for name, bound in BOUNDS.items() if bound.certifies)


#: The bounds that this library brings along.
OURS = tuple(BOUNDS)


def strongest() -> str:
    """The bound that proposes a certificate where none is named: the last of our own, whatever is registered beside."""
    certify = certifying()
    return ([name for name in OURS if name in certify] or certify)[-1]


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
