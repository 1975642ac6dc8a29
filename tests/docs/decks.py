"""What may be wrong with the decks of a built site: files, words that are cut, slides that cannot be read."""

from __future__ import annotations

import re
from pathlib import Path
from urllib.parse import urlsplit

from browser import chromium

DOCS = Path(__file__).parents[2] / "docs"

#: At least so many slides in each deck: a title, the sections, three exercises.
FEWEST = 11

SLIDE = re.compile(r'<section class="slide[^"]*">.*?</section>', re.DOTALL)
#: How a displayed formula begins.
FORMULA = r"\["

WIDGET = re.compile(r'data-widget="(\w+)"')

#: A paragraph and the displayed formula after it; a theme may put the formula into a container.
INTRODUCED = re.compile(
    r'<p>((?:(?!</?p>).)*)</p>\s*(?:<div class="math-wrapper[^>]*>\s*)?<div class="math ', re.DOTALL
)
#: A mark in the source of a page, and the block below it.
MARKED = re.compile(r"^% slide(?: \d+)?\n\n(.*?)\n\n", re.DOTALL | re.MULTILINE)
#: How a picture of Matplotlib says the size of a text: its glyphs have one of 100.
GLYPHS = re.compile(r"scale\(([\d.]+) -[\d.]+\)")
#: The letters of a figure: a 45th of the height of its slide, which is 24 pixels on a projector of 1920 x 1080.
LEAST = 45


def links(page: Path) -> list[Path]:
    """The decks to which a page leads, without those of its navigation."""
    found = re.findall(r'href="([^"#]+-slides\.html)"', page.read_text("utf-8"))
    return list(dict.fromkeys((page.parent / link).resolve() for link in found))


def pages_of(deck: Path) -> list[Path]:
    """The pages from which a deck is cut."""
    found = re.findall(r'<footer><a href="([^"#]+)#', deck.read_text("utf-8"))
    return list(dict.fromkeys(deck.parent / link for link in found))


def script(widget: str) -> str:
    """The script that fills a widget."""
    if widget == "chain":  # the main chain of the map
        return "map"
    return widget if (DOCS / "widgets" / f"{widget}.js").exists() else "scenes"


def faults(site: Path, lectures: int) -> list[str]:
    """Lines ``deck: what is wrong``: lectures without a deck, few slides, missing files, pages and widgets."""
    decks, found = links(site / "lecturers.html"), []
    if len(decks) != lectures:
        found.append(f"lecturers.html: {len(decks)} decks for {lectures} lectures")
    for deck in decks:
        if not deck.exists():
            found.append(f"{deck.name}: no such deck")
            continue
        text = deck.read_text("utf-8")
        slides = SLIDE.findall(text)
        if len(slides) < FEWEST:
            found.append(f"{deck.name}: {len(slides)} slides")
        found += [f"{deck.name}: a slide without a title" for slide in slides if "<h2></h2>" in slide]
        for file in re.findall(r'(?:src|href)="([^"#:]+)', text):
            if not (deck.parent / file).exists():
                found.append(f"{deck.name}: {file} is missing")
        shown = {name for page in pages_of(deck) for name in WIDGET.findall(page.read_text("utf-8"))}
        if any(FORMULA in page.read_text("utf-8") for page in pages_of(deck)) > (FORMULA in text):
            found.append(f"{deck.name}: its pages have displayed formulas, and no slide has one")
        if shown != set(WIDGET.findall(text)):
            found.append(f"{deck.name}: needed the widgets {sorted(shown)}")
        found += [f"{deck.name}: no script of {name}" for name in shown if f'/{script(name)}.js"' not in text]
        found += cut_short(site, deck)
    return found


def words(html: str) -> str:
    """What a part of a page says."""
    html = re.sub(r'<a class="headerlink.*?</a>', "", html)
    return " ".join(re.sub(r"<[^>]+>|[\s\u2018\u2019\u201c\u201d]", " ", html).split())


def cut_short(site: Path, deck: Path) -> list[str]:
    """Lines ``deck: what is wrong``: formulas whose introduction is cut, and marked paragraphs that are on no slide."""
    text, found = deck.read_text("utf-8"), []
    whole = {words(said) for page in pages_of(deck) for said in INTRODUCED.findall(page.read_text("utf-8"))}
    found += [
        f"{deck.name}: a formula after a part of a paragraph: {words(said)}"
        for said in INTRODUCED.findall(text)
        if words(said) not in whole
    ]
    for page in pages_of(deck):
        source = site / "_sources" / page.relative_to(site).with_suffix(".md.txt")
        for block in MARKED.findall(source.read_text("utf-8")):
            plain = max(re.findall(r"[A-Za-z ,]+", block), key=len).strip(" ,")
            if plain not in words(text):
                found.append(f"{deck.name}: marked in its source, and on no slide: {plain}")
    return found


def letters(picture: Path) -> tuple[float, float, float]:
    """Width and height of a picture of Matplotlib and its smallest letters, indices apart, all in its own unit."""
    text = picture.read_text("utf-8")
    width, height = map(float, re.findall(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', text)[0])
    return width, height, 100 * min(map(float, GLYPHS.findall(text)), default=height)


#: The pictures of the slides: the number of the slide, the file, and the size of its place, in heights of the window.
PICTURES = """
return [...document.querySelectorAll(".slide")].flatMap((slide, i) =>
  [...slide.querySelectorAll("figure:not(.widget) img")].map((one) => {
    const { width, height } = one.getBoundingClientRect();
    return [i + 1, one.src, width / innerHeight, height / innerHeight];
  }));
"""


#: The slides that leave the window, before and after all questions of widgets are answered.
BEYOND = """
const beyond = () => [...document.querySelectorAll(".slide")].flatMap((slide, i) => {
  const inner = slide.firstElementChild, room = slide.clientHeight - 2 * inner.offsetTop;
  const wide = [...inner.children].some((part) => part.getBoundingClientRect().right > innerWidth + 1);
  return inner.scrollHeight > room + 1 || inner.scrollWidth > inner.clientWidth + 1 || wide ? [i + 1] : [];
});
const before = beyond();
document.querySelectorAll(".ask .reveal").forEach((button) => button.click());
return [...new Set([...before, ...beyond()])];
"""


#: The slides with letters below a 45th of their height: 24 pixels on a projector of 1920 x 1080.
SMALL = """
return [...document.querySelectorAll(".slide")].flatMap((slide, i) => {
  const walk = document.createTreeWalker(slide, NodeFilter.SHOW_TEXT), sizes = [];
  while (walk.nextNode()) {
    const parent = walk.currentNode.parentElement, range = document.createRange();
    range.selectNode(walk.currentNode);
    if (!walk.currentNode.textContent.trim() || parent.closest("mjx-container")) continue;
    if (!range.getBoundingClientRect().width) continue;
    const drawn = parent.closest("svg") ? parent.getScreenCTM() : { a: 1, b: 0 };
    sizes.push(parseFloat(getComputedStyle(parent).fontSize) * Math.hypot(drawn.a, drawn.b));
  }
  return Math.min(...sizes) < innerHeight / 45 - 0.1 ? [i + 1] : [];
});
"""


def unreadable(decks: list[Path]) -> list[str]:
    """Lines ``deck: slide`` for slides that leave a window of 1280 x 720 pixels or have small letters."""
    from selenium.webdriver.support.ui import WebDriverWait

    found = []
    with chromium("--window-size=1280,720") as browser:
        size = {"width": 1280, "height": 720, "deviceScaleFactor": 1, "mobile": False}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        for deck in decks:
            browser.get(deck.as_uri())
            WebDriverWait(browser, 120).until(lambda b: b.execute_script("return document.body.dataset.ready"))
            found += [f"{deck.name}: slide {n} has small letters" for n in browser.execute_script(SMALL)]
            for n, source, wide, high in browser.execute_script(PICTURES):
                width, height, letter = letters(deck.parent / urlsplit(source).path)
                if (share := letter * min(wide / width, high / height)) < 1 / LEAST:
                    found.append(
                        f"{deck.name}: slide {n} has a picture with letters of {1080 * share:.1f} pixels of 1080"
                    )
            found += [f"{deck.name}: slide {n} overflows" for n in browser.execute_script(BEYOND)]
    return found


def lectures() -> int:
    """The rows of the plan."""
    return len(re.findall(r"^\| \d+ \| \{doc\}", (DOCS / "lecturers.md").read_text("utf-8"), re.MULTILINE))
