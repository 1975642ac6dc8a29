"""A problem as it was typed, so that the command that is suggested next names the same one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from shlex import quote

from verification.sections.layout import nothing_typed
from verification.sections.parts import Next


@dataclass(frozen=True, kw_only=True)
class Typed:
    """A problem file and what the options changed.

    Attributes
    ----------
    file : Path
    keys : mapping
        Of ``--set``, in their order.
    theta, relaxation : str or None
    swap : bool
        ``--swap-roles``.
    """

    file: Path
    keys: Mapping[str, str] = field(default_factory=dict)
    theta: str | None = None
    relaxation: str | None = None
    swap: bool = False

    def command(self, part: Next) -> str:
        """The words of a command, with the problem where it belongs; empty where they could not be pasted."""
        if not part.problem:
            return nothing_typed(part)
        first, *options = part.words
        words = ["ndtheory", first, self._place()]
        words += [word for key, value in self.keys.items() for word in ("--set", f"{key}={value}")]
        if part.iteration:
            given = {"--theta": self.theta, "--relaxation": self.relaxation}
            words += [word for name, value in given.items() if value is not None for word in (name, value)]
        words += ["--swap-roles"] * (self.swap != part.exchanged)
        words += options
        return " ".join(map(quote, words)) if all(word.isprintable() for word in words) else ""

    def _place(self) -> str:
        """The file, with ./ before what could be read as an option or as the name of a command."""
        name = str(self.file)
        return f"./{name}" if name.startswith("-") or (self.file.name == name and not self.file.suffix) else name
