"""Versions of the site beside each other: the folder that a host serves, and the choice of a version in a browser."""

import doctest
import functools
import importlib.util
import json
import re
import threading
from contextlib import contextmanager
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from xml.etree import ElementTree

import pytest
from browser import chromium, needs_browser

ROOT = Path(__file__).parents[2]
SPEC = importlib.util.spec_from_file_location("publish", ROOT / ".ci" / "publish.py")
PUBLISH = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(PUBLISH)

PAGE = """<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{name}</title>
<link rel="icon" href="data:,">
<script src="{up}_static/versions.js?v=1"></script></head><body><a class="sidebar-brand" href="{up}index.html">all</a>
{name}</body></html>"""


def built(folder: Path, version: str, *more: str) -> Path:
    """A small site, as Sphinx leaves it."""
    site = folder / f"built-{version}"
    for name in ("index.html", "search.html", "deep/page.html", "_modules/code.html", *more):
        path = site / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(PAGE.format(name=f"{name} of {version}", up="../" * name.count("/")), encoding="utf-8")
    (site / "_static").mkdir()
    (site / "_static" / "versions.js").write_text((ROOT / "docs" / "versions.js").read_text("utf-8"), "utf-8")
    (site / ".doctrees").mkdir()
    (site / ".doctrees" / "large").write_text("for the next build", encoding="utf-8")
    return site


@pytest.fixture
def hosted(tmp_path):
    """The folder of a host after three releases, the last of them of an older line."""
    for version, more in [("0.9.0", ["gone.html"]), ("0.10.0", []), ("0.9.1", ["gone.html"])]:
        PUBLISH.publish(built(tmp_path, version, *more), tmp_path / "host", version, "https://example.org/docs")
    return tmp_path / "host"


def test_the_examples_of_its_functions_hold():
    found = doctest.testmod(PUBLISH)
    assert (found.failed, found.attempted > 0) == (0, True)


def test_each_version_stays_and_the_newest_is_latest(hosted):
    assert json.loads((hosted / "versions.json").read_text("utf-8")) == ["latest", "0.10.0", "0.9.1", "0.9.0"]
    for folder, version in [("0.9.0", "0.9.0"), ("0.9.1", "0.9.1"), ("0.10.0", "0.10.0"), ("latest", "0.10.0")]:
        assert f"index.html of {version}<" in (hosted / folder / "index.html").read_text("utf-8").replace("\n", "<")
        assert not (hosted / folder / ".doctrees").exists()
    assert (hosted / ".nojekyll").exists()


def test_a_version_that_is_published_again_replaces_itself_whole(hosted, tmp_path):
    again = tmp_path / "again"
    PUBLISH.publish(built(again, "0.9.1"), hosted, "0.9.1")
    assert not (hosted / "0.9.1" / "gone.html").exists()
    assert (hosted / "0.9.0" / "gone.html").exists()


def test_the_map_has_the_readable_pages_of_the_newest_version(hosted):
    places = [place.text for place in ElementTree.parse(hosted / "sitemap.xml").iter() if place.tag.endswith("}loc")]
    names = ("deep/page.html", "index.html", "search.html")
    assert places == [f"https://example.org/docs/latest/{name}" for name in names]


def test_the_page_for_lost_addresses_needs_no_other_file_and_leads_home_from_any_depth(hosted):
    text = (hosted / "404.html").read_text("utf-8")
    assert "src=" not in text
    links = re.findall('href="([^"]*)"', text)
    assert links == [f"https://example.org/docs/latest/{name}" for name in ("index.html", "search.html")]


def test_without_an_address_there_is_no_map_and_no_link_that_might_be_wrong(tmp_path):
    PUBLISH.publish(built(tmp_path, "0.1.0"), tmp_path / "host", "0.1.0")
    assert not (tmp_path / "host" / "sitemap.xml").exists()
    assert "href" not in (tmp_path / "host" / "404.html").read_text("utf-8")
    assert "url=latest/index.html" in (tmp_path / "host" / "index.html").read_text("utf-8")


@pytest.mark.parametrize(
    "given", [("nowhere", "0.1.0", ""), ("", "v0.1.0", ""), ("", "latest", ""), ("", "0.1.0", "a.b")]
)
def test_what_is_no_site_no_version_or_no_address_is_refused_and_nothing_is_written(tmp_path, given):
    folder, version, address = given
    site = tmp_path / folder if folder else built(tmp_path, "0.1.0")
    with pytest.raises(ValueError, match="needed"):
        PUBLISH.publish(site, tmp_path / "host", version, address)
    assert not (tmp_path / "host").exists()


def test_the_workflow_publishes_the_version_of_a_tag_at_the_address_of_the_repository():
    workflow = (ROOT / ".github" / "workflows" / "docs.yml").read_text("utf-8")
    assert 'tags: ["v*"]' in workflow
    assert '.venv/bin/python .ci/publish.py docs/_build/html site "${VERSION#v}" "$SITE_URL"' in workflow
    assert 'os.environ.get("SITE_URL")' in (ROOT / "docs" / "conf.py").read_text("utf-8")


@contextmanager
def serving(folder: Path):
    """The address of a server of a folder, which writes nothing to stderr."""
    quiet = type("Quiet", (SimpleHTTPRequestHandler,), {"log_message": lambda *given: None})
    server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(quiet, directory=folder))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}"
    finally:
        server.shutdown()
        server.server_close()


@needs_browser
def test_a_browser_offers_the_versions_and_leads_to_the_same_page_or_to_the_first(hosted):
    from selenium.webdriver.support.ui import Select, WebDriverWait

    with serving(hosted.parent) as address, chromium() as driver:

        def choice():
            found = WebDriverWait(driver, 60).until(lambda d: d.find_elements("css selector", "select.versions"))
            return Select(found[0])

        def leads(version, name):
            choice().select_by_value(version)
            WebDriverWait(driver, 60).until(lambda d: d.current_url == f"{address}/host/{version}/{name}")

        driver.get(f"{address}/host/latest/deep/page.html")
        assert [option.text for option in choice().options] == ["latest", "0.10.0", "0.9.1", "0.9.0"]
        assert choice().first_selected_option.text == "latest"
        leads("0.9.0", "deep/page.html")
        assert choice().first_selected_option.text == "0.9.0"
        driver.get(f"{address}/host/0.9.1/gone.html")
        leads("0.10.0", "")  # which has no such page
        driver.get((hosted / "latest" / "index.html").as_uri())
        assert driver.find_elements("css selector", "select.versions") == []
        driver.get(f"{address}/built-0.9.0/index.html")  # a site with no other beside it
        assert driver.find_elements("css selector", "select.versions") == []
