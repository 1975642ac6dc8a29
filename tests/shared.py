"""What costs much and is asked for by several tests is computed once in a session, by whichever process is first."""

from __future__ import annotations

import fcntl
import hashlib
import pickle
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ndtheory.statements import statements
from ndtheory.symbolic.engine import Check, Decision
from verification.ledger import Evidence
from verification.ledger.sources import SOURCES

DECIDE = Check.decide


@dataclass(frozen=True)
class Shared:
    """Values kept in a folder that all processes of a session see.

    ``shared(key, compute)`` computes what was not computed before, while others who ask for the same wait.  Keys are
    told apart by their repr.  An exception is not kept.
    """

    folder: Path
    asked: set[Path] = field(default_factory=set)

    def __call__(self, key: object, compute: Callable[[], Any]) -> Any:
        path = self.folder / hashlib.sha256(repr(key).encode()).hexdigest()
        if path in self.asked:
            raise RuntimeError(f"{key} is computed from itself")  # else it would wait for itself
        self.asked.add(path)
        try:
            with path.with_suffix(".lock").open("w") as lock:
                fcntl.flock(lock, fcntl.LOCK_EX)
                if not path.exists():
                    part = path.with_suffix(".part")
                    part.write_bytes(pickle.dumps(compute()))
                    part.replace(path)
        finally:
            self.asked.remove(path)
        return pickle.loads(path.read_bytes())


def deciding_once(shared: Shared) -> Callable[[Check, Any], Decision]:
    """`Check.decide`, which keeps what it decides of the forms of a check, and nothing of other forms."""

    def known(check: Check, form: Any) -> Decision:
        of = next((of for of, own in check.forms.items() if own is form), None)
        if of is None:
            return DECIDE(check, form)
        return shared(("decision", check.id, check.text, of), lambda: DECIDE(check, form))

    return known


def gathered(source: str) -> tuple[dict[str, list[Evidence]], list[float]]:
    """What a source of the ledger finds of all statements, and the shares of its work that it told."""
    told: list[float] = []
    return dict(SOURCES[source](list(statements()), "quick", told.append)), told
