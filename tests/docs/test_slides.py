"""The slides of a lecture are cut from its pages, work by keys and by clicks, and fit.

Run on a built site: ``PYTHONPATH=tests python tests/docs/test_slides.py docs/_build/html`` prints what is wrong and
exits with 1.
"""

from __future__ import annotations

import base64
import re
import shutil
import sys
from pathlib import Path

import pytest
from browser import BROWSER, DRIVER, chromium, needs_browser
from processes import sites

DOCS = Path(__file__).parents[2] / "docs"

#: At least so many slides in each deck: a title, the sections, three exercises.
FEWEST = 11

SLIDE = re.compile(r'<section class="slide">.*?</section>', re.DOTALL)
#: How a displayed formula begins.
FORMULA = r"\["

WIDGET = re.compile(r'data-widget="(\w+)"')


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
    return found


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
            found += [f"{deck.name}: slide {n} overflows" for n in browser.execute_script(BEYOND)]
    return found


def lectures() -> int:
    """The rows of the plan."""
    return len(re.findall(r"^\| \d+ \| \{doc\}", (DOCS / "lecturers.md").read_text("utf-8"), re.MULTILINE))


def test_each_row_of_the_plan_links_the_deck_of_its_pages() -> None:
    rows = re.findall(r"^\| \d+ \| (.*?) \|", (DOCS / "lecturers.md").read_text("utf-8"), re.MULTILINE)
    assert len(rows) == lectures() == 10
    for row in rows:
        (deck,) = re.findall(r"\{slides\}`([^`]+)`", row)
        assert deck.split(", ") == re.findall(r"\{doc\}`([^`]+)`", row)


#: A site of two pages and a plan.
CONF = """
import sys

sys.path.append({docs!r})
from builder import slides
from builder import reading
from builder.pages import WidgetDirective

project, extensions = "slides", ["myst_parser", "sphinx.ext.mathjax", "sphinx_design", "sphinx_proof"]
myst_enable_extensions, mathjax_path = ["colon_fence", "dollarmath"], "mathjax.js"
html_theme = "furo"  # which puts formulas and tables into containers
html_static_path = [{static!r}, {own!r}, "mathjax.js", *{widgets!r}]


def setup(app):
    app.add_directive("widget", WidgetDirective)
    slides.connect(app)
    reading.connect(app)
"""

PLAN = """\
# The plan

{slides}`first`: {slide}`cobweb`, {slide}`fig-dot`; then {slides}`second`

```{toctree}
:caption: Pages

first
second
```
"""

FIRST = """\
# A page about $x$

It begins. A second sentence is short. A third one is long, because it has to be so long that the three sentences
together have more characters than a slide takes, which are two hundred and forty of them, and that is a lot of
characters for a sentence that says nothing at all.

```{widget} cobweb
```

## A formula

The formula is {math}`y = x`, as a {ref}`picture <fig-dot>` shows. More.

$$ y = x $$

:::{figure} dot.svg
:name: fig-dot
:alt: A dot and nothing else

A dot.
:::

## A theorem

It is true.

:::{prf:theorem} Small
:label: thm-small

Then $K < 1$.
:::

:::{prf:proof}
It is small.
:::

:::{prf:proof}
It is smaller than 1.
:::

## A long listing

A file:

```text
SEVERAL```

## Left out

% no slide

It is not on a slide.

$$ y = 1 $$ (eq-line)

## Marked

A section with a list that is marked.

$$ z = 1 $$

% slide

- The list.

## Exercises

::::{admonition} Exercise 1: try
:class: exercise

Do it. (5 min)

:::{dropdown} Solution
Done.
:::
::::
"""

FIRST = FIRST.replace("SEVERAL", "".join(f"line {n}\n" for n in range(30)))

SECOND = "# Too long\n\nA screen.\n\n" + "1. a line\n" * 90

SAID = [
    "A page about \\(x\\) It begins. A second sentence is short.",
    "A page about \\(x\\) [widget]",
    "A formula The formula is \\(y = x\\), as a picture shows. More. \\[ y = x \\]",
    "A formula [picture] A dot.",
    "A theorem It is true. Theorem (Small) Then \\(K &lt; 1\\) .",
    f"A long listing A file: {' '.join(f'line {n}' for n in range(22))}",
    f"A long listing {' '.join(f'line {n}' for n in range(22, 30))}",
    "Marked A section with a list that is marked. The list.",
    "Marked \\[ z = 1 \\]",
    "Exercise 1: try Do it. (5 min)",
]


@pytest.fixture(scope="module")
def small(site_tools, builder, tmp_path_factory):
    """A small site with decks."""
    folder = tmp_path_factory.mktemp("slides")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(builder.widgets, "WIDGETS", {"cobweb": builder.widgets.WIDGETS["cobweb"]})
        builder.widgets.write(folder / "own")
    static, own = str(DOCS / "slides"), str(folder / "own")
    conf = CONF.format(docs=str(DOCS), static=static, own=own, widgets=[str(DOCS / "widgets")])
    dot = '<svg xmlns="http://www.w3.org/2000/svg" width="1" height="1"/>'
    files = {"conf.py": conf, "index.md": PLAN, "first.md": FIRST, "second.md": SECOND, "dot.svg": dot}
    files["mathjax.js"] = ""
    for path, text in files.items():
        (folder / path).write_text(text, encoding="utf-8")
    assert sites(folder) == f"{folder.name} 0\n"
    shutil.copy(folder / "built" / "index.html", folder / "built" / "lecturers.html")
    return folder / "built"


def test_slides_have_titles_first_sentences_formulas_figures_widgets_and_exercises(small):
    said = []
    for slide in SLIDE.findall((small / "first-slides.html").read_text("utf-8")):
        text = re.sub(
            r'<figure class="widget".*?</figure>', "[widget]", slide.partition("<footer>")[0], flags=re.DOTALL
        )
        text = re.sub(r"<a class=\"headerlink.*?</a>", "", re.sub(r"<img[^>]*>", "[picture]", text))
        said.append(re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", text)).replace(" ,", ",").strip())
    assert said == SAID


def test_links_of_slides_lead_to_the_page(small):
    text = (small / "first-slides.html").read_text("utf-8")
    assert 'href="first.html#fig-dot"' in text
    assert text.count('<footer><a href="first.html#') == len(SAID)
    assert '<a href="second-slides.html">next deck</a>' in text


def test_no_id_is_given_twice_and_the_page_has_a_description_and_a_note_where_scripts_are_off(small):
    page = (small / "first.html").read_text("utf-8")
    ids = re.findall(r'\sid="([^"]+)"', page)
    assert "equation-eq-line" in ids
    assert sorted(ids) == sorted(set(ids))
    assert '<meta name="description" content="It begins. A second sentence is short. A third one is long' in page
    assert '<meta property="og:title" content="A page about' in page
    assert page.count("Without it they are shown as they are typed") == 1
    assert page.count('role="heading" aria-level="2"') == page.count('role="heading"') == 1
    assert "Without it they are shown" not in (small / "second.html").read_text("utf-8")


def test_the_plan_counts_the_slides_of_a_deck_and_numbers_those_of_widgets_and_figures(small):
    plan = re.sub(r"</?span[^>]*>", "", (small / "lecturers.html").read_text("utf-8"))
    assert f'href="first-slides.html">{len(SAID)} slides</a>' in plan
    for shown in ("[widget]", "[picture]"):
        (number,) = [n for n, said in enumerate(SAID, 1) if shown in said]
        assert f'href="first-slides.html#{number}">slide {number}</a>' in plan


def test_a_deck_with_few_slides_and_one_without_its_files_are_found(small, tmp_path):
    expected = [f"first-slides.html: {len(SAID)} slides", "second-slides.html: 1 slides"]
    decks = [line for line in faults(small, 2) if "lecturers.html is missing" not in line]
    assert decks == expected
    shutil.copytree(small, tmp_path / "site")
    for file in ("_images/dot.svg", "_static/cobweb.js", "second-slides.html"):
        (tmp_path / "site" / file).unlink()
    found = faults(tmp_path / "site", 3)
    assert "lecturers.html: 2 decks for 3 lectures" in found
    assert "first-slides.html: _images/dot.svg is missing" in found
    assert "first-slides.html: _static/cobweb.js is missing" in found
    assert "second-slides.html: no such deck" in found


@needs_browser
def test_a_slide_that_overflows_and_one_with_small_letters_are_found_and_the_others_fit(small):
    decks = [small / "first-slides.html", small / "second-slides.html", small / "third-slides.html"]
    picture = '<svg viewBox="0 0 9 9" width="9" height="9"><text y="9" font-size="9">x</text></svg></h2>'
    decks[2].write_text(decks[0].read_text("utf-8").replace("</h2>", picture, 1), encoding="utf-8")
    assert unreadable(decks) == [
        "second-slides.html: slide 1 overflows",
        "third-slides.html: slide 1 has small letters",
    ]


@needs_browser
def test_a_deck_goes_on_by_keys_clicks_and_buttons_and_keeps_its_place(small):
    from selenium.webdriver import ActionChains, Keys

    def number():
        return browser.find_element("css selector", "nav output").text

    with chromium("--window-size=1280,800") as browser:
        browser.get((small / "first-slides.html").as_uri())
        body = browser.find_element("css selector", "body")
        assert number() == f"1/{len(SAID)}"
        for key, expected in (
            (Keys.ARROW_RIGHT, 2),
            (" ", 3),
            (Keys.ARROW_LEFT, 2),
            (Keys.END, len(SAID)),
            (Keys.HOME, 1),
        ):
            body.send_keys(key)
            assert number() == f"{expected}/{len(SAID)}"
        ActionChains(browser).move_by_offset(900, 600).click().perform()
        assert number() == f"2/{len(SAID)}"
        widget = browser.find_element("css selector", "figure.widget")
        widget.find_element("css selector", ".ask .reveal").click()
        slider = widget.find_element("css selector", "input[name=theta]")
        slider.send_keys(Keys.ARROW_LEFT)  # moves theta, not the deck
        assert (slider.get_attribute("value"), number()) == ("0.99", f"2/{len(SAID)}")
        browser.find_element("css selector", "nav button[name=on]").click()
        assert number() == f"3/{len(SAID)}"
        assert browser.current_url.endswith("#3")
        shown = [slide.is_displayed() for slide in browser.find_elements("css selector", ".slide h2")]
        assert shown == [n == 2 for n in range(len(SAID))]
        browser.refresh()
        assert number() == f"3/{len(SAID)}"
        assert [entry["message"] for entry in browser.get_log("browser")] == []


@needs_browser
def test_on_a_phone_and_on_paper_all_slides_are_shown(small):
    from selenium.webdriver import Keys

    with chromium() as browser:
        phone = {"width": 390, "height": 800, "deviceScaleFactor": 1, "mobile": True}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", phone)
        browser.get((small / "first-slides.html").as_uri())
        titles = browser.find_elements("css selector", ".slide h2")
        assert all(title.is_displayed() for title in titles)
        assert browser.execute_script("return document.documentElement.scrollWidth") <= 390
        sizes = "return [...document.querySelectorAll(arguments[0])].map(e => parseFloat(getComputedStyle(e).fontSize))"
        assert min(browser.execute_script(sizes, ".slide p:not(figcaption p, footer *, figure.widget *)")) >= 15
        assert min(browser.execute_script(sizes, ".slide :is(figcaption p, pre)"), default=12) >= 11
        browser.find_element("css selector", "body").send_keys(Keys.ARROW_RIGHT)
        top = "return document.querySelectorAll('.slide')[1].getBoundingClientRect().top"
        assert abs(browser.execute_script(top)) < 5
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
        printed = browser.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})["data"]
        assert base64.b64decode(printed).count(b"/Type /Page\n") == len(SAID)


if __name__ == "__main__":
    if len(sys.argv) != 2 or not (Path(sys.argv[1]) / "lecturers.html").exists():
        sys.exit("usage: PYTHONPATH=tests python tests/docs/test_slides.py DIRECTORY, the directory of a built site")
    site = Path(sys.argv[1]).resolve()
    wrong = faults(site, lectures())
    if BROWSER and DRIVER:
        wrong += unreadable(links(site / "lecturers.html"))
        print("\n".join(wrong) or "each lecture has a deck, and every slide fits and can be read")
    else:
        print("\n".join([*wrong, "no Chromium here: whether slides fit was not looked at"]))
    sys.exit(bool(wrong))
