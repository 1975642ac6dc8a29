"""What a notebook shows of a result: the screen of its command, as text."""

from __future__ import annotations

from typing import Any

from verification.cli import screens
from verification.cli.console import heard


def screen(result: Any) -> str:
    """The screen of the command that makes such a result; empty where there is none."""
    with heard() as lines:
        shown = screens.show(result)
    return "\n".join(lines) if shown else ""
