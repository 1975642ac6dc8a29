"""The tools that build the site, for its tests."""

import sys
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import pytest

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="session")
def site_tools():
    """Skips a test that builds pages where Sphinx and what comes with it are missing."""
    pytest.importorskip("myst_nb", reason="the tools of the site are not installed: make docs")


@pytest.fixture(scope="session")
def builder():
    """The modules of ``docs/builder`` that need no Sphinx; they lie in a folder of scripts, not in a package."""
    sys.path.append(str(DOCS))
    try:
        names = ("algorithm", "api", "cheat_sheet", "course", "equations", "notebooks", "widgets")
        return SimpleNamespace(**{name: import_module(f"builder.{name}") for name in names})
    finally:
        sys.path.remove(str(DOCS))
