"""The slides of a lecture are cut from its pages, finish their sentences, work by keys and by clicks, and fit.

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
from decks import DOCS, SLIDE, cut_short, faults, lectures, links, unreadable
from processes import sites


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

The formula is {math}`y = x`, as a {ref}`picture <fig-dot>` shows. LONG So

$$ y = x $$

and, what goes on,

$$ x = y . $$

% not on a slide

:::{figure} dot.svg
:alt: A dot that is on the page only

No slide.
:::

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

## A wrong turn

A section with a paragraph and a list that are marked, and no other of its parts.

$$ z = 1 $$

% slide 2

*The whole* paragraph. LONG

- The list.

% slide

The last slide of the section.

## Exercises

::::{admonition} Exercise 1: try
:class: exercise

Do it. (5 min)

:::{dropdown} Solution
Done.
:::
::::
"""

#: More than the first sentences of a slide.
LONG = " ".join(f"Sentence {n} says nothing more than any other sentence here." for n in range(8))

FIRST = FIRST.replace("LONG", LONG).replace("SEVERAL", "".join(f"line {n}\n" for n in range(30)))

SECOND = "# Too long\n\nA screen.\n\n## A list\n\nIt is long.\n\n" + "1. a line\n" * 90

SAID = [
    f"A page about \\(x\\) {' '.join(FIRST.splitlines()[2:5])}",
    "A page about \\(x\\) [widget]",
    f"A formula The formula is \\(y = x\\), as a picture shows. {LONG} So"
    " \\[ y = x \\] and, what goes on, \\[ x = y . \\]",
    "A formula [picture] A dot.",
    "A theorem It is true. Theorem (Small) Then \\(K &lt; 1\\) .",
    f"A long listing A file: {' '.join(f'line {n}' for n in range(22))}",
    f"A long listing {' '.join(f'line {n}' for n in range(22, 30))}",
    f"A wrong turn The whole paragraph. {LONG} The list.",
    "A wrong turn The last slide of the section.",
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
    dot = '<svg xmlns="http://www.w3.org/2000/svg" width="1" height="1" viewBox="0 0 1 1"/>'
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
    wrong = re.findall(r'<p class="wrong">(?:<[^>]+>)*([^<]+)', (small / "first-slides.html").read_text("utf-8"))
    assert wrong == ["The whole"]  # and not what the page says itself


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
    expected = [f"first-slides.html: {len(SAID)} slides", "second-slides.html: 2 slides"]
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


def test_an_introduction_that_is_cut_and_a_marked_paragraph_that_is_missing_are_found(small, tmp_path):
    shutil.copytree(small, tmp_path / "site")
    deck = tmp_path / "site" / "first-slides.html"
    assert cut_short(tmp_path / "site", deck) == []
    text = deck.read_text("utf-8")
    deck.write_text(text.replace(f"{LONG} So", "So").replace("The last slide of", ""), encoding="utf-8")
    cut, missing = cut_short(tmp_path / "site", deck)
    assert cut.startswith("first-slides.html: a formula after a part of a paragraph: The formula is")
    assert missing == "first-slides.html: marked in its source, and on no slide: The last slide of the section"


@needs_browser
def test_a_slide_that_overflows_and_those_with_small_letters_are_found_and_the_others_fit(small):
    decks = [small / f"{name}-slides.html" for name in ("first", "second", "third")]
    drawn = '<svg viewBox="0 0 9 9" width="9" height="9"><text y="9" font-size="9">x</text></svg></h2>'
    text = decks[0].read_text("utf-8").replace("</h2>", drawn, 1).replace("_images/dot.svg", "small.svg")
    decks[2].write_text(text, encoding="utf-8")
    glyph = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><g transform="scale(0.01 -0.01)"/></svg>'
    (small / "small.svg").write_text(glyph, encoding="utf-8")
    overflows, small_words, small_picture = unreadable(decks)
    assert overflows == "second-slides.html: slide 2 overflows"
    assert small_words == "third-slides.html: slide 1 has small letters"
    assert re.fullmatch(
        r"third-slides.html: slide 4 has a picture with letters of \d\.\d pixels of 1080", small_picture
    )


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
