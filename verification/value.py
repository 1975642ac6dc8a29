"""Values that are handed on: nobody changes them, and they travel."""

from __future__ import annotations

from dataclasses import fields
from typing import Any


class Value:
    """Base of a frozen dataclass that holds arrays, declared with ``repr=False``.

    Its arrays are read-only, its repr is one line, and it is pickled and copied without what was worked out from it and
    kept: that is worked out anew when asked for.
    """

    def __post_init__(self) -> None:
        for field in fields(self):  # type: ignore[arg-type]  # every subclass is a dataclass
            freeze(getattr(self, field.name))

    @property
    def summary(self) -> str:
        """What it is, in a few words."""
        return ""

    def __repr__(self) -> str:
        says = self.summary
        return f"<{type(self).__name__}{': ' if says else ''}{says}>"

    def __getstate__(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in fields(self)}  # type: ignore[arg-type]

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in state.items():
            object.__setattr__(self, name, value)
            freeze(value)  # numpy gives back arrays that can be written


def freeze(value: Any) -> Any:
    """Make an array, the arrays of a sparse matrix, or those of a tuple read-only; the same object."""
    if isinstance(value, tuple):
        for member in value:
            freeze(member)
    parts = [value, *(getattr(value, name, None) for name in ("data", "indices", "indptr"))]  # of a sparse matrix
    for part in parts:
        if hasattr(part, "setflags"):  # without numpy: the calculator starts without it
            part.setflags(write=False)
    return value
