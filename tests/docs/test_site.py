"""The site asks no other host, its pictures have words, and its notation page names code that exists.

Run on a built site: ``python tests/docs/test_site.py docs/_build/html`` prints what is wrong, exit 1.
"""

import ast
import importlib
import json
import os
import re
import sys
from html import unescape
from html.parser import HTMLParser
from importlib.resources import files
from pathlib import Path
from urllib.parse import unquote

import pytest

import verification as vf

DOCS = Path(__file__).parents[2] / "docs"

#: Packages whose names on the notation page must exist.
NAMED = ("fem1d2d", "ndtheory", "verification")

OTHER_HOST = re.compile(r"\s*(?:https?:)?//[^/\s]", re.IGNORECASE)
CSS_REFERENCE = re.compile(r"""(?:url\(|@import)\s*["']?([^"')\s;]+)""", re.IGNORECASE)
JS_REFERENCE = re.compile(
    r"""(?:\bimport\s*\(?|\bfrom|\bimportScripts\s*\(|\bfetch\s*\(|\.src\s*=)\s*["'`]([^"'`\s]+)""", re.IGNORECASE
)


class References(HTMLParser):
    """What a browser fetches by itself to show a page; ``<a href>`` waits for a click."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self.inside: str | None = None

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.inside = tag if tag in ("script", "style") else None
        given = {name: value for name, value in attrs if value}
        fetched = ["src", "poster", "data", "xlink:href", *(["href"] if tag in ("link", "image", "use") else [])]
        self.found += [given[name] for name in fetched if name in given]
        self.found += [part.split()[0] for part in given.get("srcset", "").split(",") if part.strip()]
        self.found += CSS_REFERENCE.findall(given.get("style", ""))

    def handle_endtag(self, tag: str) -> None:
        self.inside = None

    def handle_data(self, data: str) -> None:
        if self.inside == "style":
            self.found += CSS_REFERENCE.findall(data)
        elif self.inside == "script":
            self.found += JS_REFERENCE.findall(data)


def references(path: Path) -> list[str]:
    text = path.read_text(encoding="utf-8", errors="replace")
    if path.suffix == ".css":
        return CSS_REFERENCE.findall(text)
    if path.suffix in (".js", ".mjs"):
        return JS_REFERENCE.findall(text)
    page = References()
    page.feed(text)
    page.close()
    return page.found


def external_requests(html_dir: Path) -> list[str]:
    """Lines ``file: reference`` for all that the built site would fetch from another host."""
    files = [p for p in sorted(html_dir.rglob("*")) if p.suffix in (".html", ".svg", ".css", ".js", ".mjs")]
    return [
        f"{path.relative_to(html_dir)}: {reference}"
        for path in files
        for reference in references(path)
        if OTHER_HOST.match(reference)
    ]


def pictures_without_words(html_dir: Path) -> list[str]:
    """Lines ``file: picture`` for all whose alternative text is none, or less than three words."""
    found = []
    for path in sorted(html_dir.rglob("*.html")):
        for picture in re.findall(r"<img\b[^>]*>", path.read_text(encoding="utf-8")):
            words = re.search(r'\balt="([^"]*)"', picture)
            if "toggler" not in picture and (words is None or len(words[1].split()) < 3):
                found.append(f"{path.relative_to(html_dir)}: {picture}")
    return found


#: A role that was not read, as inside backquotes that belong to something else.
LINK = re.compile(
    r"""<(?:a|link|img|script|iframe|source|object|use|image)\b[^>]*?\s(?:href|src|data|xlink:href)=["']([^"'#?]*)"""
)


def lost_links(html_dir: Path) -> list[str]:
    """Lines ``file: link`` for links that lead out of the site's folder, or to no file in it.

    A site without them works in any folder of a host, and from disk.
    """
    found, seen = [], set()
    for path in sorted(html_dir.rglob("*.html")):
        for link in dict.fromkeys(LINK.findall(path.read_text(encoding="utf-8"))):
            if not link or re.match(r"[a-z][a-z0-9+.-]*:|//", link, re.IGNORECASE) or (path.parent, link) in seen:
                continue
            seen.add((path.parent, link))
            target = Path(os.path.normpath(path.parent / unquote(unescape(link))))
            if link.startswith("/") or not target.is_relative_to(html_dir) or not target.is_file():
                found.append(f"{path.relative_to(html_dir)}: {link} leads to no file of the site")
    return found


LEFTOVER = re.compile(r"\{(?:[a-z]+:)?[a-z]+\}(?:`|&#96;|</span>\s*<span[^>]*>`)|\{glue:[a-z]+\}|\{py:[a-z]+\}")


def roles_left_over(html_dir: Path) -> list[str]:
    """Lines ``file: text`` for each role of the page's source that the reader of the built page would see.

    Pages of source code show texts of keys as they are written, with their roles.
    """
    found = []
    for path in sorted({*html_dir.rglob("*.html")} - {*html_dir.glob("_modules/**/*.html")}):
        text = path.read_text(encoding="utf-8")
        text = re.sub(r"<script\b.*?</script>", "", text, flags=re.DOTALL)
        found += [f"{path.relative_to(html_dir)}: {left.group()}" for left in LEFTOVER.finditer(text)]
    return found


def foreign_sources(html_dir: Path) -> list[str]:
    """Pages of source code that belong to no package of ours."""
    pages = (path.relative_to(html_dir / "_modules") for path in sorted(html_dir.glob("_modules/**/*.html")))
    return [
        f"_modules/{path}: not our code" for path in pages if path.with_suffix("").parts[0] not in (*NAMED, "index")
    ]


#: The answer to an exercise that can be checked: the name of the exercise, and the solution.
SOLUTION = re.compile(
    r"vf\.check\(&quot;([\w.]+)&quot;(?:(?!</details>).)*?<summary.*?</summary>(.*?)</details>", re.DOTALL
)


def printed_answers(text: str) -> list[str]:
    """The numbers, fractions and verdicts that a solution of a built page prints."""
    text = unescape(re.sub(r"<[^>]*>", "", text)).replace("\N{MINUS SIGN}", "-")
    return re.findall(r"-?\d+(?:\.\d+)?(?:e-?\d+)?(?:/\d+)?|\b[A-Z]{4,}\b", text)


def refused_solutions(html_dir: Path) -> list[str]:
    """Lines ``file: exercise`` for each part of an answer that ``vf.check`` takes from no number of the solution."""
    known = json.loads((files("verification") / "data" / "exercises.json").read_text("utf-8"))
    found = []
    for path in sorted(html_dir.rglob("*.html")):
        for name, solution in SOLUTION.findall(path.read_text(encoding="utf-8")):
            right, shown = known[name]["right"], printed_answers(solution)
            for n in range(len(right)):
                asked = (vf.check(name, [*right[:n], each, *right[n + 1 :]]) for each in shown)
                if "right" not in asked:
                    found.append(f"{path.relative_to(html_dir)}: {name}, number {n + 1}: {right[n]} is not printed")
    return found


@pytest.mark.parametrize(
    ("solution", "count"),
    [
        ("<p>\\(\\rho\\) is 1.33 and 3.87, equal at <span>0.586</span>.</p>", 0),
        ("<p>equal at <span>0.59</span>.</p>", 1),
        ("<p>It is the root of a quotient.</p>", 1),
    ],
)
def test_a_printed_solution_that_is_not_right_is_found(tmp_path, solution, count):
    page = f"""<p><code>vf.check(&quot;which_side.1&quot;, ..)</code></p>
<details><summary>Solution 0.586</summary>{solution}</details>0.586"""
    (tmp_path / "page.html").write_text(page, encoding="utf-8")
    assert len(refused_solutions(tmp_path)) == count


@pytest.mark.parametrize(
    ("link", "count"),
    [
        ('<a class="x" href="other%20page.html#part">', 0),
        ('<a href="#part">', 0),
        ('<a href="https://example.org/">', 0),
        ('<a href="mailto:a@example.org">', 0),
        ('<a href="deep/page.html?q=1">', 0),
        ('<a href="missing.html">', 1),
        ('<img alt="a" src="/other.png">', 1),
        ('<a href="../outside.html">', 1),
        ('<a href="deep/">', 1),
        ('<p data-href="missing.html">', 0),
    ],
)
def test_a_link_that_leaves_the_folder_of_the_site_is_found(tmp_path, link, count):
    site = tmp_path / "site"
    (site / "deep").mkdir(parents=True)
    for path in (site / "other page.html", site / "deep" / "page.html", tmp_path / "outside.html"):
        path.write_text("", encoding="utf-8")
    (site / "page.html").write_text(link, encoding="utf-8")
    assert len(lost_links(site)) == count


def test_source_pages_of_other_packages_are_found(tmp_path):
    for name in ("index", "fractions", "fem1d2d/mesh", "ndtheory", "numpy/ma/core"):
        path = tmp_path / "_modules" / f"{name}.html"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("", encoding="utf-8")
    found = foreign_sources(tmp_path)
    assert [line.partition(":")[0] for line in found] == ["_modules/fractions.html", "_modules/numpy/ma/core.html"]


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("<p><code>{glue:text}</code>first``</p>", 1),
        ("<p>see {doc}`../theory`</p>", 1),
        ("<p>{verdict}`5.4`</p>", 1),
        ("<pre>f'{name}'</pre><p>{a, b}</p><script>`${x}`</script>", 0),
    ],
)
def test_a_role_that_was_not_read_is_found(tmp_path, text, count):
    (tmp_path / "page.html").write_text(text, encoding="utf-8")
    assert len(roles_left_over(tmp_path)) == count


@pytest.mark.parametrize(("alt", "count"), [('alt="Two lines that cross"', 0), ('alt="../_images/a.svg"', 1), ("", 1)])
def test_a_picture_without_words_is_found(tmp_path, alt, count):
    (tmp_path / "page.html").write_text(f'<p><img src="a.svg" {alt}></p>', encoding="utf-8")
    assert len(pictures_without_words(tmp_path)) == count


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("page.html", '<script async src="https://cdn.example.org/mathjax.js"></script>'),
        ("page.html", '<link rel="stylesheet" href="//fonts.example.org/css?family=Inter">'),
        ("page.html", '<img alt="" src="http://img.example.org/badge.svg">'),
        ("page.html", '<img alt="" srcset="a.png 1x, https://img.example.org/b.png 2x">'),
        ("page.html", "<style>@import 'https://fonts.example.org/a.css';</style>"),
        ("page.html", '<p style="background: url(https://img.example.org/a.png)">'),
        ("page.html", '<script type="module">import x from "https://cdn.example.org/x.js";</script>'),
        ("style.css", '@font-face { src: url("https://fonts.example.org/a.woff2"); }'),
        ("style.css", '@import "//fonts.example.org/a.css";'),
        ("code.js", 'const x = await import("https://cdn.example.org/x.js");'),
        ("code.js", 'script.src = "https://cdn.example.org/x.js";'),
    ],
)
def test_a_planted_request_to_another_host_is_found(tmp_path, name, text):
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / name).write_text(text)
    found = external_requests(tmp_path)
    assert len(found) == 1
    assert found[0].startswith(f"deep/{name}: ")
    assert "example.org" in found[0]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("page.html", '<a href="https://doi.org/10.1051/m2an:2008003">the paper</a>'),
        ("page.html", '<link href="_static/site.css"><img src="../a.png"><script src="/x.js"></script>'),
        ("page.html", '<p>url(https://example.org)</p><svg xmlns="http://www.w3.org/2000/svg"></svg>'),
        ("page.html", '<img src="data:image/svg+xml;base64,PHN2Zz4=">'),
        ("style.css", "a { background: url(data:image/svg+xml;utf8,<svg/>) }"),
        ("code.js", 'const ns = "http://www.w3.org/2000/svg"; // see https://example.org'),
    ],
)
def test_links_namespaces_and_local_files_are_no_requests(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    assert external_requests(tmp_path) == []


def test_a_slow_machine_and_a_stream_in_pieces_build_the_same_site():
    """No cell has a time limit (30 s by default), and what a cell prints is one block."""
    settings = {
        node.targets[0].id: ast.literal_eval(node.value)
        for node in ast.parse((DOCS / "conf.py").read_text(encoding="utf-8")).body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]).startswith("nb_")
    }
    assert settings["nb_execution_timeout"] == -1
    assert settings["nb_merge_streams"]


def code_names(page: str) -> list[str]:
    """Dotted names in the second column of the tables of a Markdown page."""
    rows = [line.split("|") for line in page.splitlines() if line.startswith("|")]
    return [name for row in rows for name in re.findall(r"`(\w+(?:\.\w+)+)`", row[2])]


def resolve(name: str) -> None:
    """Import a dotted name; a field of a dataclass counts.  AttributeError where there is none."""
    head, *rest = name.split(".")
    here = importlib.import_module(head)
    while rest:
        part = rest.pop(0)
        if part in getattr(here, "__dataclass_fields__", {}) and not rest:
            return
        if not hasattr(here, part) and hasattr(here, "__path__"):
            importlib.import_module(f"{here.__name__}.{part}")
        here = getattr(here, part)


def test_a_code_name_that_does_not_exist_is_noticed():
    resolve("ndtheory.Constants.C_R")
    for name in ("ndtheory.Constants.C_X", "ndtheory.bounds.C9", "ndtheory.bounds.Bounds.C2.more"):
        with pytest.raises(AttributeError):
            resolve(name)


def test_every_code_name_on_the_notation_page_exists():
    names = code_names((DOCS / "notation.md").read_text(encoding="utf-8"))
    ours = [name for name in names if name.split(".")[0] in NAMED]
    assert {"ndtheory.Constants.C_K", "ndtheory.bounds.C0", "ndtheory.bounds.G"} <= set(ours)
    for name in ours:
        resolve(name)


#: A word of a figure in which the contact line is typed as in a program.
UNSET = re.compile(r"""(?:label|title)\s*=\s*[rf]{0,2}"[^"$]*Gamma_c|\[r?"[^"$]*Gamma_c[^"$]*"\] =""")


def test_figures_of_pages_set_the_contact_line_as_mathematics():
    assert UNSET.search('ax.set(xlabel="position along Gamma_c")')
    assert not UNSET.search(r'ax.set(xlabel=r"position along $\Gamma_c$")')
    pages = [*DOCS.glob("*.md"), *(DOCS / "examples").glob("*.md"), *(DOCS / "builder").rglob("*.py")]
    assert [page.name for page in pages if UNSET.search(page.read_text("utf-8"))] == []


if __name__ == "__main__":
    if len(sys.argv) != 2 or not (Path(sys.argv[1]) / "index.html").exists():
        sys.exit("usage: python tests/docs/test_site.py DIRECTORY, the directory of a built site")
    site = Path(sys.argv[1])
    checks = (
        external_requests, pictures_without_words, roles_left_over, foreign_sources, lost_links, refused_solutions
    )  # fmt: skip
    faults = [fault for check in checks for fault in check(site.resolve())]
    fine = "no request to another host, no lost link; all pictures have words, all roles were read, solutions are right"
    print("\n".join(faults) or fine)
    sys.exit(bool(faults))


WIDEST = 83
BLOCK = re.compile(r"^```(\S*)[^\n]*\n(.*?)^```", re.DOTALL | re.MULTILINE)


def too_wide(text: str) -> list[str]:
    """Lines of screens and files that leave the column of a page; Python folds there (`site.css`)."""
    blocks = [(kind, block) for kind, block in BLOCK.findall(text) if kind in ("text", "console", "toml", "")]
    return [line for _, block in blocks for line in block.splitlines() if len(line) > WIDEST]


@pytest.mark.parametrize(
    "page",
    sorted(path for path in DOCS.rglob("*.md") if not {"_build", "generated"} & set(path.parts)),
    ids=lambda path: str(path.relative_to(DOCS)),
)
def test_no_screen_or_diagram_leaves_the_column_of_a_page(page):
    assert too_wide(page.read_text(encoding="utf-8")) == []


def test_a_line_that_leaves_the_column_is_found_in_screens_and_files_alone():
    wide = "x" * (WIDEST + 1)
    assert too_wide(f"```text\n{wide}\nshort\n```\n") == [wide]
    assert too_wide(f"```toml\n{wide}\n```\n") == [wide]
    assert too_wide(f"```{{code-cell}} python\n{wide}\n```\n{wide}\n") == []
    assert too_wide(f"```text\n{'─' * WIDEST}\n```\n") == []  # counted in characters, not in bytes


@pytest.mark.parametrize("name", ["spectrum", "which_side", "constants"])
def test_the_code_of_an_example_needs_no_folding(name):
    page = (DOCS / "examples" / f"{name}.md").read_text(encoding="utf-8")
    cells = [block for kind, block in BLOCK.findall(page) if kind == "{code-cell}"]
    assert cells
    assert max(len(line) for cell in cells for line in cell.splitlines()) <= WIDEST
