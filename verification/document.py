"""Results as JSON documents, as one line, as sections and as figures."""

from __future__ import annotations

import html
import json
from abc import ABC
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from ndtheory import __version__, keys
from verification import registry
from verification.show.layout import text
from verification.show.parts import Section
from verification.value import Value

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Figure

    from verification.problem import Problem


LABEL = keys.Key(says="labels", type="text")


@dataclass(frozen=True, kw_only=True)
class Header(keys.Part):
    """The keys with which every document begins."""

    part = "Header"

    schema: str = keys.key("`ndtheory.` and a name, `/` and a version")
    version: str = keys.key("of this program", default=__version__)
    units: dict[str, str] = keys.key(inside={"length": LABEL, "stress": LABEL})
    colours: list[list[int]] | None = keys.key(
        "the bodies of the file that `body1` and `body2` stand for, and 1 and 2 under `neumann_body`",
        unit="",
        absent="of two bodies",
    )


class Document(Value, keys.Part, ABC):
    """A frozen result that can be written as one JSON document; subclasses name their schema, and their keys by
    :func:`ndtheory.keys.key` and :func:`ndtheory.keys.says`.

    Showing a document computes nothing: a part that was not asked for is null, with its reason.
    """

    schema: ClassVar[str]
    kind: ClassVar[str] = ""

    #: Labels ``length`` and ``stress``.
    units: Mapping[str, str]

    #: The problem of the result; None where there is none.
    problem: Problem | None = None

    def content(self) -> dict[str, Any]:
        """Return the values of the document besides schema, version, units and problem."""
        return keys.document(self)

    def to_dict(self) -> dict[str, Any]:
        """Return the document as plain dictionaries, lists and numbers."""
        problem = self.problem
        colours = [list(problem.numbers(body)) for body in (1, 2)] if problem is not None and problem.several else None
        head = Header(schema=self.schema, units=dict(self.units), colours=colours).to_dict()
        origin = {} if problem is None else {"problem": problem.to_dict()}
        kind = {"kind": self.kind} if type(self).kind else {}
        return {**head, **origin, **kind, **self.content()}

    def to_json(self) -> str:
        """Return the document as JSON text; every number is finite."""
        return json.dumps(self.to_dict(), indent=2, allow_nan=False)

    @property
    def summary(self) -> str:
        return self.schema

    def sections(self) -> tuple[Section, ...]:
        """Return the parts of the result that the command and the written report show, as data.

        They have titles, sentences, and tables whose cells are words or numbers with unit and level.  A part for only
        one place has that in ``only``.  There are none where only the document is shown, as for matrices without a
        problem.
        """
        registry.of_class("sections", self)
        return registry.sections(self)

    def _repr_html_(self) -> str:
        """Return the notebook view: what a command shows first, or the document where it shows nothing."""
        registry.of_class("sections", self)
        return f"<pre>{html.escape(text(registry.screen(self)) or self.to_json())}</pre>"

    def plot(self) -> Figure:
        """Draw the main figure of the result.

        Raises
        ------
        ValueError
            There is nothing to draw.
        """
        return self.drawn()

    def drawn(self, **options: Any) -> Figure:
        """Draw the main figure, with the options that the figure of this type takes."""
        registry.of_class("figures", self)
        figure: Figure = registry.draw(self, **options)
        return figure
