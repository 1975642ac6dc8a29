"""Directives and events of the site: widgets, notebooks, course, equations, keys, several processes, navigation."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Set
from functools import partialmethod
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.config import Config
from sphinx.errors import ExtensionError
from sphinx.ext.napoleon import NumpyDocstring
from sphinx.util.docutils import SphinxDirective
from sphinx_proof.domain import ProofDomain

import verification as vf
from builder import api, course, documents, equations, notebooks, reading, remedies, search, slides, widgets
from builder.references import References
from verification import schemas
from verification.algorithm import loop, remedy
from verification.problem import specs


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


class CourseDirective(SphinxDirective):
    """``{course}``: the map of the course, whose boxes are links."""

    def run(self) -> list[nodes.Node]:
        docs, page, builder = Path(self.env.srcdir), self.env.docname, self.env.app.builder
        found = course.pages(docs)
        for name in found:
            self.env.note_dependency(f"{name}.md")
        drawn = course.svg(found, lambda name: builder.get_relative_uri(page, name))
        return [nodes.raw("", drawn, format="html")]


def say_needs(app: Sphinx, page: str, source: list[str]) -> None:
    """Put what a page of the course needs, and its minutes, where its source has the mark for them."""
    found = course.read(page, source[0])
    if found is not None:
        source[0] = source[0].replace(course.MARK, found.sentence())


class KeysDirective(SphinxDirective):
    """``{keys} ndtheory.run/1``: the table of the keys of a document, of a part, or of a table of the problem file."""

    required_arguments = 1
    final_argument_whitespace = True

    def run(self) -> list[nodes.Node]:
        name = self.arguments[0]
        if name in documents.FILE:
            self.env.note_dependency(specs.__file__)
            return self._table(documents.file_table(name), "file")
        if name not in schemas.tables():
            raise self.error(f"keys {name!r}: needed one of {'; '.join(schemas.tables())}")
        self.env.note_dependency(str(Path(schemas.__file__).with_suffix(".toml")))
        return self._table(documents.table(name), "document")

    def _table(self, text: str, kind: str) -> list[nodes.Node]:
        """The table in a container, by which ``site.css`` has its rows below each other on a phone."""
        return [nodes.container("", *self.parse_text_to_nodes(text), classes=["keys", kind])]


class CallsDirective(SphinxDirective):
    """``{calls}``: the public names of ``verification``, by task."""

    def run(self) -> list[nodes.Node]:
        for path in api.modules().values():
            self.env.note_dependency(str(path))
        return list(self.parse_text_to_nodes(api.calls()))


class RemediesDirective(SphinxDirective):
    """``{remedies}``: the table of what to do after a run that did not converge."""

    def run(self) -> list[nodes.Node]:
        for module in (loop, remedy):
            self.env.note_dependency(str(module.__file__))
        return list(self.parse_text_to_nodes(remedies.table()))


class gallery(nodes.General, nodes.Element):
    """The place of a gallery; its pages are read first."""


class GalleryDirective(SphinxDirective):
    """``{gallery}``: the main picture and the title of each page named in its lines, as links.

    A line ``page | words`` shows these words, and no number and title.
    """

    has_content = True

    def run(self) -> list[nodes.Node]:
        lines = [line.partition("|") for line in self.content if line.strip()]
        return [gallery(pages=[(page.strip(), words.strip()) for page, _, words in lines])]


def fill_galleries(app: Sphinx, doctree: nodes.document, page: str) -> None:
    """Put the first figure of each page and its title where the gallery stands.

    Raises
    ------
    ExtensionError
        A page that does not exist, or has no figure.
    """
    for place in list(doctree.findall(gallery)):
        cards = nodes.container(classes=["gallery"])
        for number, (name, words) in enumerate(place["pages"], 1):
            if name not in app.env.found_docs:
                raise ExtensionError(f"{page}: no page {name!r} for the gallery")
            shown = next(app.env.get_doctree(name).findall(nodes.figure), None)
            if shown is None:
                raise ExtensionError(f"{page}: {name} has no figure for the gallery")
            picture = next(shown.findall(nodes.image)).deepcopy()
            link = nodes.reference("", "", internal=True, refuri=app.builder.get_relative_uri(page, name))
            link += [picture, nodes.inline("", words or f"{number}. {app.env.titles[name].astext()}")]
            cards += nodes.paragraph("", "", link, classes=["card"])
        place.replace_self(cards)


def write_widgets(app: Sphinx, config: Config) -> None:
    """What the widgets show, computed at every build, before Sphinx looks for the folder among the static ones."""
    folder = Path(app.srcdir) / "generated" / "widgets"
    widgets.write(folder)
    vf.explore(vf.example("section6"), folder / "explore.html")


def write_search(app: Sphinx, config: Config) -> None:
    """The script of the search page, at the same time."""
    search.write(Path(app.srcdir))


def write_equations(app: Sphinx) -> None:
    """The index of equations, from the sources as they are."""
    (Path(app.srcdir) / "generated" / "equations.md").write_text(equations.page(), encoding="utf-8")


def load_scripts(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    """Load the scripts of the widgets on the pages that show them, that of the search on its page, and on no other."""
    if page == "search":
        app.add_js_file(search.FILE, loading_method="defer")
    shown = app.env.metadata.get(page, {}).get("widgets", ())
    for file in widgets.scripts(shown):
        app.add_js_file(file, loading_method="defer")
    for file in widgets.styles(shown):
        app.add_css_file(file)


class Navigation:
    """The navigation of a page, which shows the titles of the others; kept where it would be made anew for each page.

    Sphinx copies all headings and all names of the API for every page, a quarter of a second, and drops them again:
    here they are left out before.  Pages of modules and of their source code are in no table of contents: those in
    equally deep folders below the same one share a navigation, as marks and relative links are the same.
    """

    SHARING = ("_modules/", "generated/api/")

    def __init__(self) -> None:
        self.titles: dict[str, Any] = {}  # page -> its table of contents, without what lies below its titles
        self.known: dict[tuple[Any, ...], str] = {}  # for pages that share: folder, depth, options -> HTML

    def of_titles(self, tocs: dict[str, Any]) -> dict[str, Any]:
        """The tables of contents of all pages without what ``titles_only`` drops."""
        for page, toc in tocs.items():
            if page not in self.titles:
                self.titles[page] = toc
                if next(toc.findall(addnodes.toctree), None) is None:
                    self.titles[page] = toc.deepcopy()
                    for item in self.titles[page]:
                        del item[1:]
        return self.titles

    def made(self, app: Sphinx, make: Callable[..., str], options: dict[str, Any]) -> str:
        """What Sphinx makes, of titles alone where no more is asked for."""
        if not options.get("titles_only"):
            return make(**options)
        whole = app.env.tocs
        app.env.tocs = self.of_titles(whole)
        try:
            return make(**options)
        finally:
            app.env.tocs = whole

    def __call__(self, app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
        make = context["toctree"]

        def toctree(**options: Any) -> str:
            if not page.startswith(self.SHARING):
                return self.made(app, make, options)
            key = (page.partition("/")[0], page.count("/"), *sorted(options.items()))
            if key not in self.known:
                self.known[key] = self.made(app, make, options)
            return self.known[key]

        context["toctree"] = toctree


def is_notebook(app: Sphinx, page: str) -> bool:
    """Whether a page is offered as a notebook: it has code cells, and its head does not say ``notebook: none``."""
    head = app.env.metadata.get(page, {})
    return head.get("file_format") == "mystnb" and head.get("notebook") != "none"


def keep_to_their_page(app: Sphinx, doctree: nodes.document) -> None:
    """Let every node belong to the document of its page.

    Those of ``{eval-rst}`` belong to a document of their own, whose settings hold everything that was read before: it
    would be written out with each page again.
    """
    for node in doctree.findall():
        node.document = doctree


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
    shutil.rmtree(site / "notebooks", ignore_errors=True)  # of pages that are none any more
    (site / "notebooks").mkdir()
    for page in sorted(app.env.found_docs):
        executed = site.parent / "jupyter_execute" / f"{page}.ipynb"
        if is_notebook(app, page) and executed.exists():
            try:
                notebooks.write(executed, site / name_of(page), References(app, page))
            except KeyError as error:
                raise ExtensionError(f"{page}: no cell glues this, and no reference leads to it: {error}") from None


def read_as_written() -> None:
    """Have napoleon leave two things as they are written.

    The docstring of a value or a property is text: what is before a colon is not its type. A line ``a, b : float`` of a
    list of attributes is about both, as one of parameters is.
    """

    def all_of_it(self: NumpyDocstring) -> tuple[str, list[str]]:
        return "", NumpyDocstring(self._dedent(self._consume_to_end()), self._config).lines()

    NumpyDocstring._consume_inline_attribute = all_of_it
    NumpyDocstring._consume_fields = partialmethod(NumpyDocstring._consume_fields, multiple=True)


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect all of it."""
    read_as_written()
    app.add_domain(Proofs, override=True)
    app.add_directive("widget", WidgetDirective)
    app.add_directive("course", CourseDirective)
    app.add_directive("keys", KeysDirective)
    app.add_directive("calls", CallsDirective)
    app.add_directive("remedies", RemediesDirective)
    slides.connect(app)
    reading.connect(app)
    app.connect("source-read", say_needs)
    app.add_node(gallery)
    app.add_directive("gallery", GalleryDirective)
    app.connect("doctree-read", keep_to_their_page)
    app.connect("doctree-resolved", fill_galleries)
    app.connect("config-inited", write_widgets)
    app.connect("config-inited", write_search)
    app.connect("builder-inited", write_equations)
    app.connect("html-page-context", link_notebook)
    app.connect("html-page-context", load_scripts)
    app.connect("html-page-context", Navigation(), priority=400)  # before the theme asks for it
    app.connect("build-finished", write_notebooks)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
