"""Results as JSON documents and notebook tables."""

from __future__ import annotations

import html
import json
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

from ndtheory import __version__


class Document(ABC):
    """A frozen result that can be written as one JSON document; subclasses name their schema."""

    schema: ClassVar[str]

    #: Labels ``length`` and ``stress``.
    units: Mapping[str, str]

    @abstractmethod
    def content(self) -> dict[str, Any]:
        """What the document holds besides schema, version and units."""

    def to_dict(self) -> dict[str, Any]:
        """The document as plain dictionaries, lists and numbers."""
        return {"schema": self.schema, "version": __version__, "units": dict(self.units), **self.content()}

    def to_json(self) -> str:
        """The document as JSON text; every number is finite."""
        return json.dumps(self.to_dict(), indent=2, allow_nan=False)

    def _repr_html_(self) -> str:
        """Notebook view: a table of the values that fit on a line."""
        rows = []
        for key, value in self.content().items():
            if isinstance(value, Mapping) and "value" in value:
                value = value["value"]
            if isinstance(value, float):
                value = f"{value:.6g}"
            if isinstance(value, (str, int)):
                rows.append(f"<tr><th>{html.escape(key)}</th><td>{html.escape(str(value))}</td></tr>")
        return f"<table><caption>{html.escape(self.schema)}</caption>{''.join(rows)}</table>"
