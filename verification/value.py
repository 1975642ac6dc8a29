"""Values that are handed on: immutable, and they can be pickled and copied."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cached_property
from typing import Any, TypeVar, overload

T = TypeVar("T")

#: Types without arrays.
PLAIN = frozenset((bool, int, float, str, type(None)))


class Value:
    """Base of a frozen dataclass that holds arrays, declared with ``repr=False``.

    Its arrays are read-only and its repr is one line.  It is pickled and copied without its cached values, which are
    computed again when they are needed.
    """

    def __post_init__(self) -> None:
        for value in vars(self).values():  # only the fields: nothing else is set yet
            freeze(value)

    @property
    def summary(self) -> str:
        """A description in a few words."""
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


class lent(cached_property[T]):
    """A cached value that a copy made by :func:`copied` takes from its original, as what changed does not enter it."""

    @overload
    def __get__(self, instance: None, owner: type[Any] | None = None) -> lent[T]: ...

    @overload
    def __get__(self, instance: object, owner: type[Any] | None = None) -> T: ...

    def __get__(self, instance: Any, owner: type[Any] | None = None) -> Any:
        original = None if instance is None else original_of(instance)
        if original is None or self.attrname is None:
            return super().__get__(instance, owner)
        return vars(instance).setdefault(self.attrname, getattr(original, self.attrname))


#: The name under which a copy has its original.
_ORIGINAL = "_original"


def copied(value: T, **changes: Any) -> T:
    """Return a copy of a dataclass with other fields, to which the original lends its :class:`lent` values.

    A pickled copy leaves its original behind, and computes them again.
    """
    copy: T = replace(value, **changes)  # type: ignore[type-var]
    vars(copy)[_ORIGINAL] = value
    return copy


def original_of(value: T) -> T | None:
    """Return the value of which another is a copy by :func:`copied`; None where it is none."""
    original: T | None = vars(value).get(_ORIGINAL)
    return original


def freeze(value: T) -> T:
    """Make an array, or all arrays of a sparse matrix or a tuple, read-only, and return the same object."""
    if type(value) in PLAIN:  # most values of an iterate: it is made at every step
        return value
    held: Any = value
    if hasattr(held, "setflags"):  # numpy is not imported: the calculator starts without it
        held.setflags(write=False)
    elif isinstance(held, tuple):
        for member in held:
            freeze(member)
    elif hasattr(held, "indptr"):  # a sparse matrix
        freeze((held.data, held.indices, held.indptr))
    return value
