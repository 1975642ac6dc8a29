"""How far a sweep is: rows done, failed and left, and the time to go."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from verification.progress import Progress


@dataclass(kw_only=True)
class Tally:
    """Counts rows while they come in, and tells.

    Attributes
    ----------
    asked, stored : int
        Rows of the grid, and how many of them a store had already.
    progress : callable
        Told in words, with the share that is done.
    """

    asked: int
    stored: int
    progress: Progress
    made: int = 0
    failed: int = 0
    begun: float = field(default_factory=time.monotonic)

    def count(self, rows: int, failed: int) -> None:
        """Rows that have come in, and how many of them have no run."""
        self.made += rows
        self.failed += failed
        self.tell()

    def tell(self) -> None:
        """Say how far the sweep is."""
        done = self.stored + self.made
        left = self.asked - done
        says = f"runs: {done} done, {self.failed} failed, {left} left"
        if self.made:
            says += f", {duration((time.monotonic() - self.begun) * left / self.made)} to go"
        self.progress(says, done / self.asked)


def duration(seconds: float) -> str:
    """An estimate of a time.

    >>> duration(4.2), duration(80), duration(8000)
    ('about 4 s', 'about 1 min', 'about 2.2 h')
    """
    if seconds < 60:
        return f"about {seconds:.0f} s"
    return f"about {seconds / 60:.0f} min" if seconds < 3600 else f"about {seconds / 3600:.1f} h"
