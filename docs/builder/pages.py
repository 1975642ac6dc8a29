"""What the pages need of Sphinx: widgets, notebooks, the index of equations, several processes, a shared navigation."""

from __future__ import annotations

from collections.abc import Set
from functools import partial
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.config import Config
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective
from sphinx_proof.domain import ProofDomain

from builder import equations, notebooks, widgets
from builder.references import References


class Proofs(ProofDomain):
    """The domain of theorems and proofs, when pages are read in several processes.

    All that it knows is a list of the environment, which sphinx_proof itself merges.
    """

    def merge_domaindata(self, docnames: Set[str], otherdata: dict[str, Any]) -> None:
        pass


class WidgetDirective(SphinxDirective):
    """``{widget} plane``: the widget of that name."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        name = self.arguments[0]
        if name not in widgets.WIDGETS:
            raise self.error(f"widget {name!r}: needed one of {', '.join(widgets.WIDGETS)}")
        page = self.env.metadata[self.env.docname]
        page["widgets"] = sorted({name, *page.get("widgets", ())})
        static = "../" * self.env.docname.count("/") + "_static"
        return [nodes.raw("", widgets.element(name, static), format="html")]


class gallery(nodes.General, nodes.Element):
    """The place of a gallery; its pages are read first."""


class GalleryDirective(SphinxDirective):
    """``{gallery}``: the main picture and the title of each page named in its lines, as links."""

    has_content = True

    def run(self) -> list[nodes.Node]:
        return [gallery(pages=[line.strip() for line in self.content if line.strip()])]


def fill_galleries(app: Sphinx, doctree: nodes.document, page: str) -> None:
    """Put the first figure of each page and its title where the gallery stands.

    Raises
    ------
    ExtensionError
        A page that does not exist, or has no figure.
    """
    for place in list(doctree.findall(gallery)):
        cards = nodes.container(classes=["gallery"])
        for number, name in enumerate(place["pages"], 1):
            if name not in app.env.found_docs:
                raise ExtensionError(f"{page}: no page {name!r} for the gallery")
            shown = next(app.env.get_doctree(name).findall(nodes.figure), None)
            if shown is None:
                raise ExtensionError(f"{page}: {name} has no figure for the gallery")
            picture = next(shown.findall(nodes.image)).deepcopy()
            link = nodes.reference("", "", internal=True, refuri=app.builder.get_relative_uri(page, name))
            link += [picture, nodes.inline("", f"{number}. {app.env.titles[name].astext()}")]
            cards += nodes.paragraph("", "", link, classes=["card"])
        place.replace_self(cards)


def write_widgets(app: Sphinx, config: Config) -> None:
    """What the widgets show, computed at every build, before Sphinx looks for the folder among the static ones."""
    widgets.write(Path(app.srcdir) / "generated" / "widgets")


def write_equations(app: Sphinx) -> None:
    """The index of equations, from the sources as they are."""
    (Path(app.srcdir) / "generated" / "equations.md").write_text(equations.page(), encoding="utf-8")


def load_scripts(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    """Load the scripts of the widgets on the pages that show them, and on no other."""
    shown = app.env.metadata.get(page, {}).get("widgets", ())
    for file in widgets.scripts(shown):
        app.add_js_file(file, loading_method="defer")
    if shown:
        app.add_css_file("widgets.css")


def share_navigation(
    known: dict[tuple[Any, ...], str], app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: Any
) -> None:
    """Make the navigation once for all pages of source code that lie equally deep.

    They stand in no table of contents, and no document in their folder: marks and relative links are the same.  Sphinx
    would copy all headings of the site for each of them, a quarter of a second a page.

    Parameters
    ----------
    known : dict
        What was made before: depth and options -> HTML.
    """
    if page.startswith("_modules/"):
        make = context["toctree"]

        def toctree(**options: Any) -> str:
            key = (page.count("/"), *sorted(options.items()))
            if key not in known:
                known[key] = make(**options)
            return known[key]

        context["toctree"] = toctree


def is_notebook(app: Sphinx, page: str) -> bool:
    """Whether a page is offered as a notebook: it has code cells, and its head does not say ``notebook: none``."""
    head = app.env.metadata.get(page, {})
    return head.get("file_format") == "mystnb" and head.get("notebook") != "none"


def name_of(page: str) -> str:
    """The file of its notebook, from the root of the site."""
    return f"notebooks/{page.rsplit('/', 1)[-1]}.ipynb"


def link_notebook(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    """Put the link to its notebook under the title of a page."""
    if doctree is not None and is_notebook(app, page):
        link = f'<a href="{context["pathto"](name_of(page), 1)}" download>Download as a notebook</a>'
        line = f'<p class="notebook">{link}</p>'
        context["body"] = context["body"].replace("</h1>", f"</h1>\n{line}", 1)


def write_notebooks(app: Sphinx, failed: Exception | None) -> None:
    """Write the notebooks of all pages that were executed, once the site is built.

    Raises
    ------
    ExtensionError
        A number in the text that no cell has computed, or a reference to nothing.
    """
    if failed is not None or app.builder.format != "html":
        return
    site = Path(app.outdir)
    (site / "notebooks").mkdir(exist_ok=True)
    for page in sorted(app.env.found_docs):
        executed = site.parent / "jupyter_execute" / f"{page}.ipynb"
        if is_notebook(app, page) and executed.exists():
            try:
                notebooks.write(executed, site / name_of(page), References(app, page))
            except KeyError as error:
                raise ExtensionError(f"{page}: no cell glues this, and no reference leads to it: {error}") from None


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect all of it."""
    app.add_domain(Proofs, override=True)
    app.add_directive("widget", WidgetDirective)
    app.add_node(gallery)
    app.add_directive("gallery", GalleryDirective)
    app.connect("doctree-resolved", fill_galleries)
    app.connect("config-inited", write_widgets)
    app.connect("builder-inited", write_equations)
    app.connect("html-page-context", link_notebook)
    app.connect("html-page-context", load_scripts)
    app.connect("html-page-context", partial(share_navigation, {}), priority=400)  # before the theme asks for it
    app.connect("build-finished", write_notebooks)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
