"""Put a built site into the folder that a host serves: ``python .ci/publish.py BUILT FOLDER VERSION [ADDRESS]``.

Each version has a folder, and `latest` is a copy of the newest.  Beside them are written: `versions.json`, from which
the pages make the choice of versions; `index.html`, which leads to the newest; `404.html` for addresses that do not
exist; `.nojekyll`, as some hosts leave out folders that begin with an underscore.  With the ADDRESS of the folder also
`sitemap.xml`, of the newest version.
"""

from __future__ import annotations

import json
import re
import shutil
import sys
from collections.abc import Iterable
from html import escape
from pathlib import Path

LATEST = "latest"

PAGE = """<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{title}</title>{head}
<style>body {{ font: 1.1rem/1.5 sans-serif; max-width: 40rem; margin: 4rem auto; padding: 0 1rem; }}</style></head>
<body><h1>{title}</h1><p>{text}</p></body>
</html>
"""


def by_age(names: Iterable[str]) -> list[str]:
    """The versions among some names, the newest first.

    Examples
    --------
    >>> by_age(["latest", "0.2.0", "0.10.0", "1.0.0", "figures"])
    ['1.0.0', '0.10.0', '0.2.0']
    """
    versions = [name for name in names if re.fullmatch(r"\d+\.\d+\.\d+", name)]
    return sorted(versions, key=lambda name: [int(part) for part in name.split(".")], reverse=True)


def sitemap(pages: Iterable[str], address: str) -> str:
    """The list of pages for programs that search.

    Examples
    --------
    >>> print(sitemap(["a b.html"], "https://example.org/docs/"))
    <?xml version="1.0" encoding="utf-8"?>
    <urlset xmlns="http://www.sitemaps.org/schemas/sitemap/0.9">
    <url><loc>https://example.org/docs/a%20b.html</loc></url>
    </urlset>
    <BLANKLINE>
    """
    rows = [f"<url><loc>{escape(address + page.replace(' ', '%20'))}</loc></url>" for page in pages]
    head = '<?xml version="1.0" encoding="utf-8"?>\n<urlset xmlns="http://www.sitemaps.org/schemas/sitemap/0.9">'
    return "\n".join([head, *rows, "</urlset>", ""])


def publish(built: Path, folder: Path, version: str, address: str = "") -> None:
    """Put a version into the folder.

    Raises
    ------
    ValueError
        No version, no site, or an address without a scheme.
    """
    if by_age([version]) != [version]:
        raise ValueError(f"{version}: needed a version of three numbers")
    if not (built / "index.html").is_file():
        raise ValueError(f"{built}: needed a built site")
    if address and not re.match(r"https?://", address):
        raise ValueError(f"{address}: needed an address that begins with https://")
    hidden = shutil.ignore_patterns(".*")  # what Sphinx keeps for the next build
    folder.mkdir(parents=True, exist_ok=True)
    shutil.rmtree(folder / version, ignore_errors=True)
    shutil.copytree(built, folder / version, ignore=hidden)
    versions = by_age(path.name for path in folder.iterdir() if path.is_dir())
    shutil.rmtree(folder / LATEST, ignore_errors=True)
    shutil.copytree(folder / versions[0], folder / LATEST)
    home = f"{address.rstrip('/')}/" if address else ""
    text = {
        "versions.json": json.dumps([LATEST, *versions]),
        "index.html": PAGE.format(
            title="ndtheory",
            head=f'<meta http-equiv="refresh" content="0; url={LATEST}/index.html">',
            text=f'The documentation is in <a href="{LATEST}/index.html">{LATEST}</a>.',
        ),
        "404.html": PAGE.format(
            title="There is no page here",
            head='<meta name="robots" content="noindex">',
            text="It may have been renamed, or belong to another version. "
            + (f'<a href="{escape(home)}{LATEST}/index.html">All questions and their pages</a>' if home else "")
            + (f' | <a href="{escape(home)}{LATEST}/search.html">Search</a>' if home else ""),
        ),
        ".nojekyll": "",
    }
    if home:
        pages = (path.relative_to(folder).as_posix() for path in (folder / LATEST).rglob("*.html"))
        text["sitemap.xml"] = sitemap(sorted(page for page in pages if "/_" not in page), home)
    for name, content in text.items():
        (folder / name).write_text(content, encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) not in (4, 5):
        sys.exit("usage: python .ci/publish.py BUILT FOLDER VERSION [ADDRESS]")
    try:
        publish(Path(sys.argv[1]), Path(sys.argv[2]), *sys.argv[3:])
    except ValueError as error:
        sys.exit(str(error))
