"""The sections of our results: a function is registered where it stands, and all of them are known here."""

from verification.sections import (  # noqa: F401
    advice,
    bounds,
    certificate,
    comparison,
    constants,
    continuum,
    ledger,
    region,
    reproduction,
    run,
    sweep,
)
from verification.sections.parts import of

__all__ = ["of"]
