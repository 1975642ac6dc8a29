"""Progress messages of long computations."""

from __future__ import annotations

from collections.abc import Callable

#: Called with the name of what is being done, and the share of it that is done; None where that is unknown.
Progress = Callable[[str, "float | None"], None]


def silent(what: str, share: float | None) -> None:
    """Show nothing."""
