"""cvxpy asks for scipy.stats, which takes more than half of its import, for one function that no program here calls."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any

NAME = "scipy.stats"


class _Statistics(ModuleType):
    """Stands for scipy.stats until `entropy` is called or anything else is asked of it."""

    def entropy(self, *args: Any, **options: Any) -> Any:
        self.step_back()
        from scipy.stats import entropy

        return entropy(*args, **options)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        self.step_back()
        from scipy import stats

        return getattr(stats, name)

    def step_back(self) -> None:
        """Let the next import load the module."""
        if sys.modules.get(NAME) is self:
            del sys.modules[NAME]


@contextmanager
def statistics_later() -> Iterator[None]:
    """A context in which ``from scipy.stats import entropy`` does not load scipy.stats: the first call does.

    Whatever else is asked of scipy.stats loads it at once; where it is loaded nothing changes.
    """
    if NAME in sys.modules:
        yield
        return
    sys.modules[NAME] = standing_in = _Statistics(NAME)
    try:
        yield
    finally:
        standing_in.step_back()
