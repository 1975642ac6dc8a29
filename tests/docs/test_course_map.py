"""The map of the course: what each page needs and takes, without a circle, drawn so that a phone shows it."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from browser import chromium, needs_browser

DOCS = Path(__file__).parents[2] / "docs"
SVG = "{http://www.w3.org/2000/svg}"

#: The width of the text on a phone of 390 pixels, and the least size of letters there.
PHONE, LEAST = 358, 9.0


@pytest.fixture(scope="module")
def course(builder):
    return builder.course.pages(DOCS)


def needs(course):
    return {name: page.needs for name, page in course.items()}


def test_each_page_with_exercises_is_on_the_map_with_times_and_prerequisites(course):
    pages = {
        path.relative_to(DOCS).with_suffix("").as_posix()
        for path in DOCS.glob("**/*.md")
        if not {"_build", "generated"} & set(path.parts) and "## Exercises" in path.read_text("utf-8")
    }
    assert set(course) == pages
    for name, page in course.items():
        assert 10 <= page.minutes <= 60, name
        assert page.needs or page.besides, name
        assert (DOCS / f"{name}.md").read_text("utf-8").count("{{ needs }}") == 1, name


def test_prerequisites_have_no_circle_and_come_earlier_in_the_course(course, builder):
    order = list(course)
    level = builder.course.levels(needs(course))
    assert set(level) == set(order)
    for name, page in course.items():
        assert all(order.index(need) < order.index(name) and level[need] < level[name] for need in page.needs)


@pytest.mark.parametrize("circle", [{"a": {"b": None}, "b": {"a": None}}, {"a": {"a": None}}, {"a": {"nowhere": None}}])
def test_a_circle_and_a_page_that_is_none_are_refused(builder, circle):
    with pytest.raises(ValueError, match="without a circle"):
        builder.course.levels(circle | {"c": {}})


def test_a_page_without_times_is_refused(builder, tmp_path):
    (tmp_path / "examples").mkdir()
    (tmp_path / "examples" / "index.md").write_text("```{gallery}\n```\n")
    (tmp_path / "chapter0.md").write_text("---\nfile_format: mystnb\n---\n\n# A page\n")
    with pytest.raises(ValueError, match=r"chapter0\.md: needed `course:`"):
        builder.course.pages(tmp_path)
    text = "---\ncourse:\n  minutes: 5\n---\n\n# A page\n\n:::{admonition} Exercise 1: x\nAn exercise.\n:::\n"
    with pytest.raises(ValueError, match=r"chapter0\.md: needed the minutes of each exercise"):
        builder.course.read("chapter0", text)


def test_the_arrows_of_the_map_say_what_the_pages_say(course, builder):
    """Following arrows backwards leads to every prerequisite, and to no other page than these and theirs."""
    arrows = builder.course.direct(needs(course))

    def behind(name, edges):
        found = {start for start, end in edges if end == name}
        return found.union(*(behind(start, edges) for start in found))

    listed = [(need, name) for name, page in course.items() for need in page.needs]
    assert set(arrows) <= set(listed)
    for name in course:
        assert behind(name, arrows) == behind(name, listed)


def boxes(drawn):
    return {
        link.get("href"): [float(link.find(f"{SVG}rect").get(key)) for key in ("x", "y", "width", "height")]
        for link in drawn.iter(f"{SVG}a")
    }


@pytest.fixture(scope="module")
def drawn(course, builder):
    text = builder.course.svg(course, lambda name: f"{name}.html")
    return ElementTree.fromstring(text.replace("<svg ", f'<svg xmlns="{SVG[1:-1]}" ', 1))


def test_each_page_is_a_link_in_a_box_with_its_minutes_and_no_two_boxes_overlap(course, drawn):
    found = boxes(drawn)
    assert set(found) == {f"{name}.html" for name in course}
    left, _, width, height = map(float, drawn.get("viewBox").split())
    for name, (x, y, w, h) in found.items():
        assert left <= x <= left + width - w, name
        assert 0 <= y <= height - h, name
        for other, (x2, y2, w2, h2) in found.items():
            assert name == other or x + w <= x2 or x2 + w2 <= x or y + h <= y2 or y2 + h2 <= y, (name, other)
    for link, page in zip(drawn.iter(f"{SVG}a"), course.values(), strict=True):
        said = [text.text for text in link.iter(f"{SVG}text")]
        assert said[-1] == f"{page.minutes} + {sum(n for _, n in page.exercises)} min"
        assert link.find(f"{SVG}title").text == page.title


def test_the_letters_of_the_map_are_large_enough_on_a_phone(drawn):
    css = (DOCS / "site.css").read_text("utf-8")
    sizes = [float(size) for size in re.findall(r"svg\.course text[^}]*?([\d.]+)px", css)]
    assert len(sizes) == 2
    assert min(sizes) * PHONE / float(drawn.get("viewBox").split()[2]) >= LEAST


@needs_browser
def test_words_stay_in_their_boxes(course, builder, tmp_path):
    style = (DOCS / "site.css").read_text("utf-8")
    drawn = builder.course.svg(course, lambda name: f"{name}.html")
    (tmp_path / "map.html").write_text(f'<!doctype html><meta charset="utf-8"><style>{style}</style>{drawn}', "utf-8")
    with chromium("--window-size=700,1200") as browser:
        browser.get((tmp_path / "map.html").as_uri())
        beyond = browser.execute_script("""
            return [...document.querySelectorAll("svg.course a")].flatMap((link) => {
              const box = link.querySelector("rect").getBBox();
              return [...link.querySelectorAll("text")].filter((text) => {
                const { x, y, width, height } = text.getBBox();
                return x < box.x || x + width > box.x + box.width || y < box.y || y + height > box.y + box.height;
              }).map((text) => text.textContent);
            });
        """)
    assert beyond == []
