"""Hypothesis profiles: `dev` by default, `ci` where CI is set, any by name in HYPOTHESIS_PROFILE."""

import os
import signal

import pytest
from hypothesis import settings

# Read when sympy is imported: with its 1000 entries the algebra of the paper is expanded again and again.
os.environ.setdefault("SYMPY_CACHE_SIZE", "100000")

settings.register_profile("dev", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True)
settings.register_profile("nightly", deadline=None, max_examples=2000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE") or ("ci" if os.environ.get("CI") else "dev"))

# Helpers that assert, so that a failure shows the values as it does in a test.
pytest.register_assert_rewrite("complaints", "section_5", "pieces")

# A shell that runs the tests in its background lets them ignore Ctrl-C, and their children inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def known_bounds(monkeypatch):
    """Losses and semidefinite bounds of the same bodies are computed once, where a test is not about them."""
    from known import KNOWN

    for module, name, known in KNOWN:
        monkeypatch.setattr(module, name, known)
