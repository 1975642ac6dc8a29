"""The sections of all results of this program: importing a module registers its functions."""

# ruff: noqa: F401
from verification.show import (
    advice,
    bounds,
    certificate,
    comparison,
    constants,
    exploration,
    history,
    ledger,
    reproduction,
    run,
    sweep,
)
from verification.show.parts import of

__all__ = ["of"]
