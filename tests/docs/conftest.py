"""The tools that build the site, for its tests."""

import shutil
import sys
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import pytest
from browser import chromium

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="session")
def site_tools():
    """Skips a test that builds pages where Sphinx and what comes with it are missing."""
    pytest.importorskip("myst_nb", reason="the tools of the site are not installed: make docs")


@pytest.fixture(scope="session")
def builder():
    """The modules of ``docs/builder`` that need no Sphinx; they lie in a folder of scripts, not in a package."""
    sys.path.append(str(DOCS))
    try:
        names = ("algorithm", "api", "cheat_sheet", "commands", "course", "documents", "equations", "exercises")
        names += ("notebooks", "questions", "remedies", "search", "widgets")
        return SimpleNamespace(**{name: import_module(f"builder.{name}") for name in names})
    finally:
        sys.path.remove(str(DOCS))


@pytest.fixture(scope="session")
def page(builder, tmp_path_factory):
    """A page with all widgets and nothing else."""
    folder = tmp_path_factory.mktemp("widgets")
    builder.widgets.write(folder)
    for file in (DOCS / "widgets").iterdir():
        shutil.copy(file, folder)
    names = list(builder.widgets.WIDGETS)
    scripts = "".join(f'<script defer src="{name}"></script>' for name in builder.widgets.scripts(names))
    body = "".join(builder.widgets.element(name, ".") for name in names)
    styles = "".join(f'<link rel="stylesheet" href="{name}">' for name in builder.widgets.styles(names))
    html = f'<!doctype html><meta charset="utf-8">{styles}{scripts}<body>{body}</body>'
    (folder / "page.html").write_text(html, encoding="utf-8")
    return folder / "page.html"


@pytest.fixture(scope="module")
def driver():
    with chromium("--window-size=1000,2400") as found:
        yield found


@pytest.fixture
def unanswered(driver, page):
    """The page as a reader finds it."""
    driver.get("about:blank")
    driver.get(page.as_uri())
    yield driver
    assert [entry["message"] for entry in driver.get_log("browser")] == []


@pytest.fixture
def browser(driver, page, builder):
    """The page with an address that holds a state of each widget, so that no question is asked."""
    first = {
        name: builder.questions.of(name).data()["sliders"][0]
        for name in (*builder.questions.PAGES, *builder.questions.FURTHER)
    }
    states = [f"{name}.{slider['name']}={slider['start']}" for name, slider in first.items()]
    states += ["cobweb.theta=1", "plane.unit=0", "spectrum.step=0", "map.unit=0", "chain.unit=0"]
    driver.get("about:blank")
    driver.get(f"{page.as_uri()}#{'&'.join(states)}")
    yield driver
    assert [entry["message"] for entry in driver.get_log("browser")] == []
