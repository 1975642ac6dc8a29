"""The navigation of the site is the same on pages of source code that lie equally deep, and is made once for them."""

import sys
from functools import partial
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def share():
    pytest.importorskip("myst_nb", reason="the tools of the site are not installed: make docs")
    sys.path.append(str(ROOT / "docs"))
    try:
        from builder.pages import share_navigation
    finally:
        sys.path.remove(str(ROOT / "docs"))
    return partial(share_navigation, {})


def test_only_pages_of_source_code_that_lie_equally_deep_share_their_navigation(share):
    made = []

    def shown(page, **options):
        def make(**given):
            made.append(page)
            return f"the tree as {page} links it, {given}"

        context = {"toctree": make}
        share(None, page, "page.html", context, None)
        return context["toctree"](**options)

    first = shown("_modules/fem1d2d/mesh", collapse=False)
    assert first == "the tree as _modules/fem1d2d/mesh links it, {'collapse': False}"
    assert shown("_modules/ndtheory/bounds", collapse=False) == first
    others = [("_modules/ndtheory/bounds", True), ("_modules/index", False), ("api/ndtheory", False)]
    for page, collapse in [*others, ("api/fem1d2d", False)]:
        assert page in shown(page, collapse=collapse)
    assert made == ["_modules/fem1d2d/mesh", *(page for page, _ in others), "api/fem1d2d"]
