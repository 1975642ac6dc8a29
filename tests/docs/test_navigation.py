"""The navigation of a page is made of titles, and once for pages of modules in equally deep folders."""

import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture
def navigation(site_tools):
    sys.path.append(str(ROOT / "docs"))
    try:
        from builder.pages import Navigation
    finally:
        sys.path.remove(str(ROOT / "docs"))
    return Navigation()


def test_only_pages_of_modules_and_source_code_in_equally_deep_folders_share_their_navigation(navigation):
    made = []

    def shown(page, **options):
        def make(**given):
            made.append(page)
            return f"the tree as {page} links it, {given}"

        context = {"toctree": make}
        navigation(None, page, "page.html", context, None)
        return context["toctree"](**options)

    first = shown("_modules/fem1d2d/mesh", collapse=False)
    assert first == "the tree as _modules/fem1d2d/mesh links it, {'collapse': False}"
    assert shown("_modules/ndtheory/bounds", collapse=False) == first
    assert (
        shown("generated/api/ndtheory.bounds", collapse=False) != first
    )  # "../ledger.html" leads elsewhere from there
    others = [("_modules/ndtheory/bounds", True), ("_modules/index", False), ("api/index", False)]
    for page, collapse in [*others, ("examples/index", False)]:
        assert page in shown(page, collapse=collapse)
    assert made == [
        "_modules/fem1d2d/mesh",
        "generated/api/ndtheory.bounds",
        *(page for page, _ in others),
        "examples/index",
    ]


def test_what_lies_below_titles_is_left_out_while_titles_alone_are_asked_for(navigation):
    from docutils import nodes
    from sphinx import addnodes

    item = lambda text, *below: nodes.list_item("", nodes.paragraph("", text), *below)
    leaf = nodes.bullet_list("", item("page", nodes.bullet_list("", item("section"))))
    branch = nodes.bullet_list("", item("folder", nodes.bullet_list("", addnodes.toctree(), item("section"))))
    whole = {"leaf": leaf, "branch": branch}
    app = SimpleNamespace(env=SimpleNamespace(tocs=whole))
    context = {"toctree": lambda **options: {page: toc.astext().split() for page, toc in app.env.tocs.items()}}
    navigation(app, "leaf", "page.html", context, None)
    assert context["toctree"](titles_only=True) == {"leaf": ["page"], "branch": ["folder", "section"]}
    assert context["toctree"](titles_only=False) == {"leaf": ["page", "section"], "branch": ["folder", "section"]}
    assert app.env.tocs is whole

    def breaks(**options):
        raise KeyError("leaf")

    context = {"toctree": breaks}
    navigation(app, "leaf", "page.html", context, None)
    with pytest.raises(KeyError):
        context["toctree"](titles_only=True)
    assert app.env.tocs is whole
