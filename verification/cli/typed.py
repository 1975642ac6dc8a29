"""A problem as it was typed, so that the command that is suggested next names the same one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from shlex import quote

from verification.cli.console import say


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

    def suggest(self, command: str, *options: str, iteration: bool = False) -> None:
        """Say which command to type next.

        Parameters
        ----------
        command : str
        options : str
            Of that command, after the problem.
        iteration : bool
            Whether the command takes theta and relaxation, and is to have the same.
        """
        words = ["ndtheory", command, str(self.file)]
        words += [word for key, value in self.keys.items() for word in ("--set", f"{key}={value}")]
        if iteration:
            given = {"--theta": self.theta, "--relaxation": self.relaxation}
            words += [word for name, value in given.items() if value is not None for word in (name, value)]
        words += ["--swap-roles"] * self.swap
        words += options
        if all(word.isprintable() for word in words):  # else it could not be pasted from a screen
            say("Next: " + " ".join(map(quote, words)))
