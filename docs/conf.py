"""Sphinx configuration: ``make docs`` builds the site into docs/_build/html, with warnings as errors."""

import os
import sys
from importlib.metadata import distribution
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxRole

from ndtheory import __version__
from verification.cli.main import cli
from verification.ledger import quote, sheets, verify

BENCHMARKS = Path(__file__).resolve().parents[1] / "benchmarks"
sys.path += [str(BENCHMARKS), str(Path(__file__).resolve().parent)]  # folders of scripts, not packages

import speed_page  # noqa: E402
from builder import api, cheat_sheet, commands, scripts  # noqa: E402

project = "ndtheory"
author = "The ndtheory maintainers"
copyright = author
version = release = __version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinx_proof",
    "sphinxcontrib.bibtex",
    "builder.pages",
    "builder.scripts",
]
# A page includes the second, the third is a paper, and the fourth are downloads.
exclude_patterns = ["_build", "generated/speed", "joss", "generated/scripts/**.ipynb"]
sphinx_gallery_conf = scripts.SETTINGS

# Pages with code cells run at every build; a cell that fails fails the build.
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = -1  # no limit: a cell takes 16 s of processor time, and a machine may be slow
nb_merge_streams = True  # one block for what a cell prints, however the kernel has cut it
myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]

bibtex_bibfiles = ["references.bib"]

napoleon_google_docstring = False
napoleon_use_ivar = True
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_member_order = "bysource"
autodoc_use_type_comments = False  # there are none: looking for them takes seconds
viewcode_follow_imported_members = False  # else the sources of the standard library become pages
# An attribute that a docstring lists is looked for by its bare name in all classes, of which two may have it.  Nothing
# else warns under this name; references to what does not exist are found by the tests.
suppress_warnings = ["ref.python"]

# Viewed offline the site asks no other host: no web fonts, no intersphinx, and its own copy of the one MathJax file.
MATHJAX = "tex-svg-full.js"
html_theme = "furo"
html_title = "ndtheory"
html_favicon = "favicon.svg"
# Links and marks in the blue of the slides and figures, each with a contrast of 4.5 or more.
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#0061a8", "color-brand-content": "#0061a8"},
    "dark_css_variables": {"color-brand-primary": "#7cc4ff", "color-brand-content": "#7cc4ff"},
}
# Where the site will be, if that is known: the canonical address of a page is that of the newest version.
if address := os.environ.get("SITE_URL"):
    html_baseurl = f"{address.rstrip('/')}/latest/"
html_static_path = [
    "site.css",
    "scripts.css",
    "versions.js",
    "widgets",
    "slides",
    "generated/widgets",
    "generated/search",
    str(distribution("sphinx-mathjax-offline").locate_file(f"sphinx-mathjax-offline/static/mathjax/{MATHJAX}")),
]
html_css_files = ["site.css"]
html_js_files = ["versions.js"]
mathjax_path = MATHJAX
mathjax3_config = {
    "tex": {
        "macros": {
            "norm": [r"\lVert #1 \rVert", 1],
            "tnorm": [r"\lvert\mkern-1.5mu\lVert #1 \rVert\mkern-1.5mu\rvert", 1],
        }
    }
}


def write_ledger(app: Sphinx) -> None:
    """The ledger and the errata sheet, from the checks themselves: run at every build, never typed.

    Raises
    ------
    ExtensionError
        A verdict differs from the recorded one, which the pages quote.
    """
    folder = Path(app.srcdir) / "generated"
    folder.mkdir(exist_ok=True)
    found = verify()
    if found.changed:
        raise ExtensionError(f"verdicts to be recorded anew: {', '.join(row.statement.id for row in found.changed)}")
    for name, text in (("ledger", sheets.page(found)), ("errata", sheets.errata(found))):
        (folder / f"{name}.md").write_text(text, encoding="utf-8")


def write_commands(app: Sphinx) -> None:
    """The page of commands, from the commands themselves.

    Raises
    ------
    ExtensionError
        A command without an example, the help of an option, or a schema.
    """
    source = Path(app.srcdir)
    lacking = commands.undocumented(cli, "ndtheory", (source / "json.md").read_text("utf-8"))
    if lacking:
        raise ExtensionError("; ".join(lacking))
    (source / "generated").mkdir(exist_ok=True)
    (source / "generated" / "commands.md").write_text(commands.page(cli, "ndtheory"), encoding="utf-8")


def write_api(app: Sphinx) -> None:
    """The pages of the API, one for each module that there is."""
    api.write(Path(app.srcdir) / "generated")


def write_cheat_sheet(app: Sphinx) -> None:
    """The cheat sheet as a page and a PDF, with the numbers of Section 6 as they are computed now."""
    cheat_sheet.write(Path(app.srcdir) / "generated")


def prepare_kernels(app: Sphinx, env: BuildEnvironment, pages: list[str]) -> None:
    """Before the first page is read, so that all processes that read have what the kernels need."""
    if pages:
        from builder.kernels import use_copies

        use_copies()


def write_speed(app: Sphinx) -> None:
    """The tables and the figure of the page on speed, from the records that ``make bench`` has left.

    Raises
    ------
    ExtensionError
        A file among the records is none.
    """
    try:
        speed_page.write(speed_page.RECORDS, Path(app.srcdir) / "generated" / "speed", "generated/speed")
    except ValueError as error:
        raise ExtensionError(str(error)) from None


class FromLedger(SphinxRole):
    """A role that shows what the ledger says of a statement.

    ``{verdict}`5.30` `` is its recorded verdict, with a link to the ledger; ``{ledger}`5.30 wrong` `` one of its texts.
    An unknown statement, or a text that it has not, fails the build.
    """

    def run(self) -> tuple[list[nodes.Node], list[nodes.system_message]]:
        try:
            text = quote(*self.text.split()) if self.name == "ledger" else f"[{quote(self.text)}](/generated/ledger.md)"
        except (TypeError, ValueError) as error:
            raise ExtensionError(f"{self.env.docname}, line {self.lineno}: {self.rawtext}: {error}") from None
        return self.inliner.parse(text, self.lineno, self.inliner, self.inliner.parent)


def setup(app: Sphinx) -> None:
    app.connect("builder-inited", write_ledger)
    app.connect("builder-inited", write_commands)
    app.connect("builder-inited", write_speed)
    app.connect("builder-inited", write_api)
    app.connect("builder-inited", write_cheat_sheet)
    app.connect("env-before-read-docs", prepare_kernels)
    for name in ("verdict", "ledger"):
        app.add_role(name, FromLedger())
