"""Decks of slides cut from pages: what marks in their sources choose, else first sentences, formulas and figures."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from html import escape
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxRole
from sphinx.util.osutil import relative_uri
from sphinx_design.dropdown import dropdown_main
from sphinx_proof.nodes import theorem_node

from builder import widgets

#: What follows the first sentences of a section on its slide: the first of these.
SHOWN = (nodes.math_block, nodes.table, nodes.enumerated_list, theorem_node)

#: A comment in the source that puts the next block, or so many, whole on a slide: ``% slide`` or ``% slide 3``.
MARK = re.compile(r"slide(?: (\d+))?")

#: A comment that leaves a section out, or the figure or widget below it.
NONE, NOT_THIS = "no slide", "not on a slide"

SENTENCE = re.compile(r"[.?!](?=\s|$)|:$")
#: A section that opens with a false claim or a bad idea in italics.
WRONG = "A wrong turn"
LINES = 22  # of a listing on one slide: more would have letters too small for the back of a hall
LONGEST = 240  # characters of the first sentences, where there is more than one


@dataclass(kw_only=True)
class Slide:
    """A slide.

    Attributes
    ----------
    title : list of nodes
        What its heading says.
    anchor : str
        The section of the page from which it is taken.
    blocks : list of nodes
        What stands below the heading.
    opens : bool
        True for the first slide of a page.
    """

    title: list[nodes.Node]
    anchor: str
    blocks: list[nodes.Node] = field(default_factory=list)
    opens: bool = False


class SlidesRole(SphinxRole):
    """``{slides}`examples/spectrum, examples/which_side```: a link to the deck of these pages, which is then made."""

    def run(self) -> tuple[list[nodes.Node], list[nodes.system_message]]:
        pages = [name.strip() for name in self.text.split(",")]
        for name in pages:
            if name not in self.env.found_docs:
                raise ValueError(f"{self.env.docname}, line {self.lineno}: no page {name!r} for slides")
        self.env.metadata[self.env.docname].setdefault("slides", []).append(pages)
        return [slide_link(pages=pages, target="")], []


class slide_link(nodes.General, nodes.Element):
    """A link to a deck and the number of its slides, or to its slide with a target, once all pages are read."""


class SlideRole(SphinxRole):
    """``{slide}`cobweb```: the number of the slide that has this widget, or this label of a figure or theorem."""

    def run(self) -> tuple[list[nodes.Node], list[nodes.system_message]]:
        return [slide_link(pages=None, target=self.text)], []


def deck(page: str) -> str:
    """The name of the deck that begins with a page, beside the page, so that its relative links hold."""
    return f"{page}-slides"


def opening(paragraph: nodes.Node) -> nodes.paragraph:
    """The first sentence of a paragraph, and those after it while they are short."""
    whole = paragraph.astext()
    ends = [end.end() for end in SENTENCE.finditer(whole)] or [len(whole)]
    left = max(end for end in ends if end <= max(ends[0], LONGEST))
    kept = nodes.paragraph()
    for child in paragraph.children:
        if left > 0:
            kept += nodes.Text(child.astext()[:left]) if isinstance(child, nodes.Text) else child.deepcopy()
        left -= len(child.astext())
    return kept


def blocks(section: nodes.Element) -> Iterator[nodes.Node]:
    """The parts of a section, the outputs of its cells among them, without sections below it."""
    for child in section.children:
        classes = child.get("classes", ()) if isinstance(child, nodes.container) else ()
        if "cell" in classes:
            for part in child.children:
                if "cell_output" in part["classes"]:
                    yield from part.children
        elif any(name.endswith("-wrapper") for name in classes):  # in which a theme puts a table or a formula
            yield from child.children
        elif not isinstance(child, nodes.section | nodes.title):
            yield child


def is_widget(block: nodes.Node) -> bool:
    """True for the frame of a widget."""
    return isinstance(block, nodes.raw) and "data-widget" in block.astext()


def exercise(block: nodes.Node) -> Slide | None:
    """An exercise without its solution."""
    if not (isinstance(block, nodes.admonition) and "exercise" in block["classes"]):
        return None
    title, *body = block.children
    return Slide(title=title.children, anchor="", blocks=[part for part in body if not isinstance(part, dropdown_main)])


def in_parts(block: nodes.Node) -> list[nodes.Node]:
    """A listing in parts that fit a slide; any other block as it is."""
    lines = block.astext().splitlines() if isinstance(block, nodes.literal_block) else []
    if len(lines) <= LINES:
        return [block]
    parts = []
    while len(lines) > LINES:  # at an empty line, where there is one in the second half
        end = next((n for n in range(LINES, LINES // 2, -1) if not lines[n].strip()), LINES)
        parts.append("\n".join(lines[:end]))
        lines = lines[end + 1 :] if not lines[end].strip() else lines[end:]
    parts.append("\n".join(lines))
    return [nodes.literal_block(text, text, **block.attributes) for text in parts]


def argument(found: list[nodes.Node], formula: nodes.Node) -> list[nodes.Node]:
    """A formula with the whole paragraph that introduces it, and with what goes on behind it in small letters."""
    begin = end = found.index(formula)
    is_math = lambda at: 0 <= at < len(found) and isinstance(found[at], nodes.math_block)
    is_text = lambda at: 0 <= at < len(found) and isinstance(found[at], nodes.paragraph)
    goes_on = lambda at: is_text(at) and found[at].astext()[:1].islower()
    while is_math(begin - 1) or ((is_math(begin) or goes_on(begin)) and is_text(begin - 1)):
        begin -= 1
    while goes_on(end + 1) or (goes_on(end) and is_math(end + 1)):
        end += 1
    return found[begin : end + 1]


def marked(found: list[nodes.Node]) -> Iterator[list[nodes.Node]]:
    """The slides that the marks of a section choose."""
    for i, block in enumerate(found):
        mark = MARK.fullmatch(block.astext()) if isinstance(block, nodes.comment) else None
        if mark:
            below = [one for one in found[i:] if not isinstance(one, nodes.comment)]
            yield below[: int(mark[1] or 1)]


def unmarked(found: list[nodes.Node], *, opens: bool) -> Iterator[list[nodes.Node]]:
    """The slides of a section without marks.

    First the first sentences, with the first formula, table, list or theorem, or the output of a cell, or a figure; a
    page opens with a whole paragraph and nothing else. Then each further formula. All formulas come with their
    :func:`argument`.
    """
    paragraph = next((block for block in found if isinstance(block, nodes.paragraph)), None)
    if paragraph is None:
        return
    arguments = [argument(found, block) for block in found if isinstance(block, nodes.math_block)]
    if opens:
        yield [paragraph]
    else:
        first = opening(paragraph)
        shown = [block for block in found if isinstance(block, SHOWN)]
        outputs = [block for block in found if isinstance(block, nodes.literal_block)]
        shown += [block for block in outputs if not block.astext().startswith("<")]  # no repr of an object
        shown = shown or [block for block in found if isinstance(block, nodes.figure)]
        if first.astext().rstrip().endswith(":"):  # what it announces comes next
            shown = found[found.index(paragraph) + 1 :][:1] + shown
        beside = next((one for one in arguments if shown and shown[0] in one), shown[:1])
        yield [*([] if paragraph in beside else [first]), *beside]
    seen: list[nodes.Node] = [] if opens else beside
    for one in arguments:
        if one[-1] not in seen:
            seen = [*seen, *one]
            yield one


def cut(page: nodes.document) -> Iterator[Slide]:
    """The slides of a page, in its order: for each section those that are marked, or else those of :func:`unmarked`.

    Each figure and widget that is on none of them has a slide; each exercise has one.
    """
    for number, section in enumerate(page.findall(nodes.section)):
        if not isinstance(section[0], nodes.title):  # what a theorem says
            continue
        found = list(blocks(section))
        says = [block.astext() if isinstance(block, nodes.comment) else "" for block in found]
        if NONE in says:
            continue
        own = list(marked(found)) or list(
            unmarked([one for one in found if not isinstance(one, nodes.comment)], opens=not number)
        )
        taken = [block for one in own for block in one]
        for before, block in zip(["", *says], found, strict=False):
            picture = isinstance(block, nodes.figure) or is_widget(block)
            if picture and block not in taken and before != NOT_THIS:
                own.append([block])
        own.sort(key=lambda one: found.index(one[0]) if one[0] in found else -1)
        for i, one in enumerate(own):
            if section[0].astext() == WRONG and not i:
                one = [labelled(one[0]), *one[1:]]
            *kept, last = one
            last, *rest = in_parts(last)
            for shown in ([*kept, last], *([part] for part in rest)):
                yield Slide(
                    title=section[0].children, anchor=section["ids"][0], blocks=shown, opens=not number and not i
                )
        for slide in filter(None, map(exercise, found)):
            slide.anchor = section["ids"][0]
            yield slide


def labelled(block: nodes.Node) -> nodes.Node:
    """A paragraph; if it opens with italics, which the page refutes, with a class for which ``deck.css`` says so."""
    if not (isinstance(block, nodes.paragraph) and isinstance(block[0], nodes.emphasis)):
        return block
    block = block.deepcopy()
    block["classes"].append("wrong")
    return block


def found_on(slide: Slide, target: str) -> bool:
    """True if a slide has a widget of that name, or what has that label."""
    for block in slide.blocks:
        if is_widget(block) and f'data-widget="{target}"' in block.astext():
            return True
        if any(target.lower() in node["ids"] for node in block.findall(nodes.Element)):
            return True
    return False


def number_slides(app: Sphinx, doctree: nodes.document, page: str) -> None:
    """Put the number of its slide, and of the slides of a deck, into each link to one.

    Raises
    ------
    ExtensionError
        A target that is on no slide.
    """
    places = list(doctree.findall(slide_link))
    resolved = lambda name: app.env.get_and_resolve_doctree(name, app.builder)
    decks = {
        deck(pages[0]): [slide for name in pages for slide in cut(resolved(name))]
        for pages in (app.env.metadata[page].get("slides", ()) if places else ())
    }
    for place in places:
        target = place["target"]
        if place["pages"]:
            name, words, anchor = deck(place["pages"][0]), f"{len(decks[deck(place['pages'][0])])} slides", ""
        else:
            numbers = [
                (name, n) for name, slides in decks.items() for n, one in enumerate(slides, 1) if found_on(one, target)
            ]
            if not numbers:
                raise ExtensionError(f"{page}: no slide has {target!r}: needed a widget or a label on a page of a deck")
            name, number = numbers[0]
            words, anchor = f"slide {number}", f"#{number}"
        link = f"{app.builder.get_relative_uri(page, name)}{anchor}"
        place.replace_self(nodes.reference("", words, internal=True, refuri=link))


class Decks:
    """The decks of a site, written before its images are copied.

    Parameters
    ----------
    app : Sphinx
    """

    def __init__(self, app: Sphinx) -> None:
        self.app, self.builder = app, app.builder

    def html(self, page: str, block: nodes.Node) -> str:
        """A part of a page; links within the page lead to the page."""
        block = block.deepcopy()
        if isinstance(block, theorem_node):  # which docutils takes for an admonition that it does not have
            title, *body = block.children
            name = nodes.paragraph("", "", nodes.strong("", "Theorem ", *title.children))
            block = nodes.container("", name, *(part for one in body for part in one.children), classes=["proof"])
        for link in block.findall(nodes.reference):
            here = link["refid"] if "refid" in link else link.get("refuri", "").partition("#")[2]
            if "refid" in link or link.get("refuri", "").startswith("#"):
                link["refuri"] = f"{self.builder.get_relative_uri(deck(page), page)}#{here}"
        return str(self.builder.render_partial(block)["fragment"])

    def slides(self, page: str) -> Iterator[str]:
        """The slides of a page as HTML."""
        self.builder.imgpath = relative_uri(self.builder.get_target_uri(page), "_images")
        self.builder.current_docname = page
        tree = self.app.env.get_and_resolve_doctree(page, self.builder)
        self.builder.post_process_images(tree)
        for slide in cut(tree):
            title = self.html(page, nodes.paragraph("", "", *(node.deepcopy() for node in slide.title))).strip()
            title = title.removeprefix("<p>").removesuffix("</p>")
            body = "".join(self.html(page, block) for block in slide.blocks)
            link = f"{self.builder.get_relative_uri(deck(page), page)}#{slide.anchor}"
            yield (
                f'<section class="slide{" opens" * slide.opens}"><div><h2>{title}</h2>{body}</div>'
                f'<footer><a href="{link}">on the page</a></footer></section>'
            )

    def write(self, pages: list[str], following: list[str] | None) -> None:
        """The deck of some pages in one folder, with a link to the deck that follows."""
        name = deck(pages[0])
        static = relative_uri(self.builder.get_target_uri(name), "_static/x")[: -len("/x")]
        parts = [slide for page in pages for slide in self.slides(page)]
        shown = [widget for page in pages for widget in self.app.env.metadata[page].get("widgets", ())]
        links = {"the plan": self.builder.get_relative_uri(name, "lecturers")}
        if following:
            links["next deck"] = self.builder.get_relative_uri(name, deck(following[0]))
        scripts = [*widgets.scripts(shown), self.app.config.mathjax_path, "deck.js"]
        text = PAGE.format(
            title=escape(self.app.env.titles[pages[0]].astext()),
            styles="".join(f'<link rel="stylesheet" href="{static}/{file}">' for file in STYLES),
            mathjax=json.dumps(self.app.config.mathjax3_config),
            scripts="".join(f'<script defer src="{static}/{file}"></script>' for file in scripts),
            slides="\n".join(parts),
            links="".join(f'<a href="{link}">{words}</a>' for words, link in links.items()),
        )
        path = self.builder.get_outfilename(name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def connect(app: Sphinx) -> None:
    """Roles and events of the decks."""
    app.add_role("slides", SlidesRole())
    app.add_role("slide", SlideRole())
    app.add_node(slide_link)
    app.connect("doctree-resolved", number_slides)
    app.connect("html-collect-pages", write_decks)


STYLES = ("pygments.css", "widgets.css", "map.css", "deck.css")

PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{title} - slides</title>
{styles}<script>window.MathJax = {mathjax}</script>
{scripts}</head>
<body>
<main>
{slides}
</main>
<nav><button type="button" name="back" aria-label="previous slide">‹</button><output></output>\
<button type="button" name="on" aria-label="next slide">›</button>{links}</nav>
</body></html>
"""


def write_decks(app: Sphinx) -> Iterable[tuple[str, dict[str, Any], str]]:
    """Write the decks to which the pages link; there is nothing left for the theme to write."""
    decks = [pages for page in sorted(app.env.found_docs) for pages in app.env.metadata[page].get("slides", ())]
    made = Decks(app)
    for pages, following in zip(decks, [*decks[1:], None], strict=False):
        made.write(pages, following)
    return ()
