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
        for value in vars(self).values():  # the fields: nothing else is set yet
            freeze(value)

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
    if hasattr(value, "setflags"):  # without numpy: the calculator starts without it
        value.setflags(write=False)
    elif isinstance(value, tuple):
        for member in value:
            freeze(member)
    elif hasattr(value, "indptr"):  # a sparse matrix
        freeze((value.data, value.indices, value.indptr))
    return value


def to_plain(value: Any) -> Any:
    """A value, or a tuple of values, as documents hold it: by its ``to_dict`` where it has one."""
    if isinstance(value, tuple):
        return [to_plain(member) for member in value]
    return value.to_dict() if hasattr(value, "to_dict") else value
