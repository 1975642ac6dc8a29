"""What a long computation tells of itself while it runs."""

from __future__ import annotations

from collections.abc import Callable

#: Called with what is being done, and the share of it that is done; None where nobody knows the share.
Progress = Callable[[str, "float | None"], None]


def silent(what: str, share: float | None) -> None:
    """Tell nobody."""
