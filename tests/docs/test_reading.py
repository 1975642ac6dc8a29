"""Blocks that answer a widget's question wait for somebody who answers."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from browser import chromium, needs_browser

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture
def reading(site_tools: None) -> ModuleType:
    sys.path.append(str(DOCS))
    try:
        from builder import reading as found
    finally:
        sys.path.remove(str(DOCS))
    module: ModuleType = found
    return module


def page(*blocks: tuple[str, str]) -> Any:
    """A page with a section of paragraphs and comments."""
    from docutils import nodes
    from docutils.utils import new_document

    found, section = new_document("page"), nodes.section()
    for kind, text in blocks:
        section += getattr(nodes, kind)("", text)
    found += section
    return found


def test_a_block_below_the_mark_waits_and_no_other(reading):
    from docutils import nodes

    mark, slide = ("comment", "waits"), ("comment", "slide")
    found = page(*(("paragraph", "before"), mark, slide, ("paragraph", "answer"), ("paragraph", "after")), slide)
    reading.let_answers_wait(None, found, "page")
    assert [block.astext() for block in found.findall(nodes.paragraph) if block["classes"] == ["waits"]] == ["answer"]


def test_a_mark_without_a_block_is_refused(reading):
    with pytest.raises(ValueError, match=r"page: the comment 'waits' needs a block below it"):
        reading.let_answers_wait(None, page(("paragraph", "before"), ("comment", "waits")), "page")


def test_pages_have_such_blocks_below_a_widget():
    pages = [path.read_text("utf-8") for path in (DOCS / "examples").glob("*.md")]
    marked = [text for text in pages if "\n% waits\n" in text]
    assert len(marked) > 1
    assert all("```{widget}" in text.partition("\n% waits\n")[0] for text in marked)


@needs_browser
def test_in_a_browser_it_is_hidden_until_the_widget_is_answered_or_somebody_asks(reading, tmp_path):
    body = '<p class="waits">0</p>'
    for i, _ in enumerate(("answered", "asked for", "left"), 1):
        body += f'<figure data-widget="w{i}"></figure><p class="waits">{i}</p>'
    (tmp_path / "page.html").write_text(f"<!doctype html>{body}<script>{reading.ANSWERS}</script>", "utf-8")
    with chromium() as browser:
        browser.get((tmp_path / "page.html").as_uri())
        shown = lambda: [each.text for each in browser.find_elements("css selector", ".waits") if each.is_displayed()]
        assert shown() == ["0"]  # no widget is before it
        browser.execute_script("document.querySelector('[data-widget=w1]').dispatchEvent(new CustomEvent('answered'))")
        assert shown() == ["0", "1"]
        browser.find_elements("css selector", "button.waiting")[0].click()
        assert shown() == ["0", "1", "2"]
        browser.execute_script("dispatchEvent(new Event('beforeprint'))")
        assert shown() == ["0", "1", "2", "3"]
