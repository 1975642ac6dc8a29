"""What a page has for search engines, previews, keyboards and readers without scripts, and ids that are given once."""

from __future__ import annotations

import re
from html import escape
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

#: Characters of a description, and of a paragraph that may be one.
MOST, LEAST = 200, 60

#: What scrolls sideways takes the focus, so that arrow keys scroll it; what fits takes none.
KEYBOARD = """
(() => {
  const parts = () => document.querySelectorAll("pre, .table-wrapper, .math-wrapper, .sig, mjx-container");
  const each = () => parts().forEach((part) => {
    const scrolls = part.scrollWidth > part.clientWidth + 1 && getComputedStyle(part).overflowX !== "visible";
    if (scrolls) part.tabIndex = 0; else if (part.tabIndex === 0) part.removeAttribute("tabindex");
  });
  addEventListener("resize", each);
  addEventListener("load", async () => { each(); await window.MathJax?.startup?.promise; each(); });
})();
"""

#: The comment in a source above a block that answers the question of the widget before it.
WAITS = "waits"

#: Such a block is shown when somebody has answered, or asks for it, and on paper.
ANSWERS = """
addEventListener("DOMContentLoaded", () => {
  const widgets = [...document.querySelectorAll("[data-widget]")];
  for (const block of document.querySelectorAll(".waits")) {
    const above = (one) => one.compareDocumentPosition(block) & Node.DOCUMENT_POSITION_FOLLOWING;
    const widget = widgets.filter(above).at(-1);
    if (!widget || "answered" in widget.dataset) continue;
    const button = document.createElement("button"), show = () => { button.remove(); block.hidden = false; };
    Object.assign(button, { type: "button", className: "waiting", textContent: "Show the answer to the question" });
    block.before(button);
    block.hidden = true;
    button.addEventListener("click", show);
    widget.addEventListener("answered", show);
    addEventListener("beforeprint", show);
  }
});
"""

#: Said where formulas stay as they are typed.
TYPED = "<noscript><p>Formulas need JavaScript. Without it they are shown as they are typed in TeX.</p></noscript>"


def give_ids_once(app: Sphinx, doctree: nodes.document, page: str) -> None:
    """Take ids away that are given twice: from containers of the theme, and from parts of theorems and proofs."""
    seen: set[str] = set()
    for node in reversed(list(doctree.findall(nodes.Element))):
        if isinstance(node, nodes.container | nodes.section | nodes.admonition):
            node["ids"] = [name for name in node["ids"] if name not in seen]
        seen.update(node["ids"])


def let_answers_wait(app: Sphinx, doctree: nodes.document, page: str) -> None:
    """Give a class to the blocks that answer the question of a widget."""
    for mark in doctree.findall(nodes.comment):
        if mark.astext() == WAITS:
            block = mark.next_node(nodes.Element, descend=False, siblings=True)
            while isinstance(block, nodes.comment):
                block = block.next_node(nodes.Element, descend=False, siblings=True)
            if block is None:
                raise ValueError(f"{page}: the comment {WAITS!r} needs a block below it")
            block["classes"].append(WAITS)


def description(doctree: nodes.document) -> str:
    """The first paragraph of a page that says more than what it needs, cut at a word."""
    for paragraph in doctree.findall(nodes.paragraph):
        text = " ".join(re.sub(r"[\\{}$]", "", paragraph.astext()).split())
        if len(text) >= LEAST and not text.startswith("Needs "):
            return text if len(text) <= MOST else text[:MOST].rsplit(" ", 1)[0] + " ..."
    return ""


def describe(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: nodes.document | None) -> None:
    """Put the description of a page and the tags of its preview into its head, and the note on formulas on it."""
    tree = context.get("furo_navigation_tree", "")  # its captions are headings without a level
    context["furo_navigation_tree"] = tree.replace('role="heading"', 'role="heading" aria-level="2"')
    if doctree is None:
        return
    title = re.sub(r"<[^>]+>", "", context["title"]).replace('"', "&quot;")
    tags = {"og:title": title, "og:type": "article", "og:site_name": app.config.project}
    if said := description(doctree):
        tags |= {"description": escape(said), "og:description": escape(said)}
    if address := app.config.html_baseurl:
        tags |= {"og:url": context["pageurl"], "og:image": f"{address}_static/preview.png"}
    kind = lambda name: "property" if name.startswith("og:") else "name"
    context["metatags"] = context.get("metatags", "") + "".join(
        f'\n<meta {kind(name)}="{name}" content="{content}">' for name, content in tags.items()
    )
    # the words of a fold are its name
    context["body"] = context["body"].replace('<summary aria-label="Toggle hidden content">', "<summary>")
    if 'class="math ' in context["body"]:
        context["body"] = context["body"].replace("</h1>", f"</h1>\n{TYPED}", 1)


def connect(app: Sphinx) -> None:
    """Events of all pages."""
    app.connect("doctree-resolved", give_ids_once)
    app.connect("doctree-resolved", let_answers_wait)
    app.connect("html-page-context", describe, priority=900)  # after the theme
    app.add_js_file(None, body=KEYBOARD)
    app.add_js_file(None, body=ANSWERS)
