"""The command ``ndtheory``: the one door, and the only room that prints."""

from verification.cli.main import main

__all__ = ["main"]
