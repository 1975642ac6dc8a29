"""Tables that lower modules look into and upper modules fill: laws, rules, bounds, forms of logs,
what shows a result.

An entry may be added at any time: a loop over the table finds it.  Entries have the types that their own
modules check.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, MutableMapping
from functools import singledispatch
from typing import Any, NamedTuple, TypeVar

V = TypeVar("V")

#: Import the modules of ours that fill a table, or its entry of this name; set by the package, which lists them.
load: Callable[[str, str], object] = lambda table, name: None


class Registry(MutableMapping[str, V]):
    """Entries by name, in their order; ours are there from the first time that somebody looks.

    Examples
    --------
    >>> LAWS["local"].outside
    'the local Coulomb law: S must map into L2(Gamma_c)'
    """

    def __init__(self, table: str) -> None:
        self._table, self._entries, self._ours = table, dict[str, V](), list[str]()

    def provide(self, *entries: V) -> None:
        """Add entries of ours, each under its ``name``."""
        for entry in entries:
            name: str = entry.name  # type: ignore[attr-defined]
            self._entries[name] = entry
            self._ours.append(name)

    @property
    def ours(self) -> tuple[str, ...]:
        """The names of our own entries, whatever else was added."""
        load(self._table, "")
        return tuple(self._ours)

    def _filled(self) -> dict[str, V]:
        load(self._table, "")
        return self._entries

    def __getitem__(self, name: str) -> V:
        load(self._table, name)
        return self._filled()[name]

    def __setitem__(self, name: str, entry: V) -> None:
        self._filled()[name] = entry

    def __delitem__(self, name: str) -> None:
        del self._filled()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._filled())

    def __len__(self) -> int:
        return len(self._filled())


#: The laws of friction and the relaxation rules that a problem file may name.
LAWS: Registry[Any] = Registry("laws")
RULES: Registry[Any] = Registry("rules")

#: The forms of logs of other codes, by the lines that they print.
LOG_FORMATS: Registry[Any] = Registry("log formats")

#: The bounds, from the weakest to the strongest: all are worked out, judged, shown and drawn.
BOUNDS: Registry[Any] = Registry("bounds")


class Prover(NamedTuple):
    """A function of the proofs that the core calls where it is asked to.

    ``constants`` takes measured constants and what they were measured on and gives them between proved bounds;
    ``losses`` takes a pair and its constants and gives the loss of each inequality, or why there is none.
    """

    name: str
    of: Callable[..., Any]


#: What proves or explains a result of the core: :class:`Prover` by its subject.
PROOFS: Registry[Prover] = Registry("proofs")


def of_class(table: str, result: Any) -> None:
    """Import what shows the class of a result, or a class that it derives from."""
    for each in type(result).__mro__:
        load(table, each.__module__.removeprefix("verification."))


@singledispatch
def sections(result: Any) -> tuple[Any, ...]:
    """The sections of a result; a result without sections is shown as its document.

    ``sections.register`` adds a function for a class of results.
    """
    return ()


@singledispatch
def screen(result: Any) -> tuple[Any, ...]:
    """The sections that a reader sees first: all, unless ``screen.register`` has a shorter form for the class."""
    return sections(result)


@singledispatch
def draw(result: Any, **options: Any) -> Any:
    """Draw the main figure of a result with the options of its ``plot``; ValueError if there is nothing to draw."""
    raise ValueError(f"a {type(result).__name__} has no figure")
