"""The gallery of short scripts: how sphinx-gallery runs them, and what it shows of each."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
from cycler import cycler
from docutils import nodes
from sphinx.application import Sphinx
from sphinx_gallery.scrapers import figure_rst

from builder import notebooks
from verification.figures import style

#: The folders of scripts in the order of the page.
SECTIONS = ("first", "theta", "friction", "proof", "code")

#: How figures of scripts look: those of the packages bring their look along.
LOOK = {
    **style.PARAMETERS,
    "font.size": 10,
    "figure.figsize": (5.4, 3.2),
    "savefig.dpi": 130,
    "axes.prop_cycle": cycler(color=[*style.BODIES, style.STATES["stick"], style.SHEAR]),
    "lines.markersize": 4.5,
}

#: The settings of sphinx-gallery.  They go into the environment of Sphinx, so functions are here by their names.
SETTINGS = {
    "examples_dirs": "scripts",
    "gallery_dirs": "generated/scripts",
    "filename_pattern": r"\.py$",  # all of them are executed
    "run_stale_examples": True,  # at each build: the packages may have changed
    "abort_on_example_error": True,
    "subsection_order": [f"scripts/{name}" for name in SECTIONS],
    "nested_sections": False,
    "image_scrapers": ("builder.scripts.take_figure",),
    "reset_modules": ("builder.scripts.dress",),
    "reset_modules_order": "both",
    "capture_repr": (),  # what a script prints is shown, what a line evaluates to is not
    "first_notebook_cell": notebooks.FIRST.strip(),
    "last_notebook_cell": "figure",
    "write_computation_times": False,  # and no times on pages: the same sources give the same site
    "min_reported_time": 1e9,
    "show_signature": False,
    "css": (),  # scripts.css has what the pages need
}

#: The pages of scripts, and the one with all of them.
FOLDER = "generated/scripts/"


def dress(settings: Mapping[str, Any], file: str | None, when: str) -> None:
    """Give a script the look of the site, and take it away afterwards."""
    mpl.rcdefaults()
    if when == "before":
        mpl.rcParams.update(LOOK)


def described(figure: Any, title: str) -> str:
    """The words for a picture: the title of its script, its axes and its curves."""
    parts = [title]
    for ax in figure.axes:
        names = [line.get_label() for line in ax.get_lines() if not line.get_label().startswith("_")]
        axes = [f"{ax.get_ylabel()} over {ax.get_xlabel()}"] if ax.get_xlabel() and ax.get_ylabel() else []
        parts += [": ".join(filter(None, [*axes, ", ".join(names)]))] if axes or names else []
    return "; ".join(parts).replace("\n", " ").replace("\\", "")


def take_figure(block: Any, variables: dict[str, Any], settings: Mapping[str, Any]) -> str:
    """Move the picture that a script has saved to where its page shows it.

    Raises
    ------
    ValueError
        The script has saved no picture of its name.
    """
    if block[0] != "code":
        return ""
    script = Path(variables["src_file"])
    saved = script.with_suffix(".png")
    if not saved.exists():
        raise ValueError(f"{script}: no picture; needed figure.savefig({saved.name!r})")
    target = next(variables["image_path_iterator"])
    saved.replace(target)
    title = (ast.get_docstring(ast.parse(script.read_text("utf-8"))) or "").partition("\n")[0]
    return figure_rst([target], settings["src_dir"], described(variables["example_globals"]["figure"], title))


def name_thumbnails(app: Sphinx, doctree: nodes.document, page: str) -> None:
    """Give each thumbnail the title of its script as its words."""
    shown = None
    for node in doctree.findall() if page == f"{FOLDER}index" else ():
        if isinstance(node, nodes.image):
            shown = node
        elif isinstance(node, nodes.reference) and shown is not None:
            shown["alt"] = f"The picture of the script: {node.astext()}"
            shown = None


def load_style(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    """Load the style sheet of the scripts on their pages only, and on no page a script for tags, which none has."""
    context["script_files"] = [file for file in context["script_files"] if "sg-tags.js" not in str(file.filename)]
    if page.startswith(FOLDER):
        app.add_css_file("scripts.css")


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect the pages of scripts."""
    app.setup_extension("sphinx_gallery.gen_gallery")
    app.connect("doctree-resolved", name_thumbnails)
    app.connect("html-page-context", load_style)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
