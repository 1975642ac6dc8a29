"""Find what keeps this commit from being released: ``python .ci/release_check.py [--quick]``.

It first reads: one version in all files, a changelog with a date, a tag on this commit and nothing else in the tree,
the addresses of the project.  Then, unless `--quick` is given, it builds, which takes minutes: `.ci/packages.py` makes
the archives twice and runs the wheel in an empty folder, the site is made, and its notebooks run with the wheel instead
of this folder.  It needs the environment that builds the site.  Every fault is a line; exit status 1 if there is one.
"""

from __future__ import annotations

import datetime
import re
import subprocess
import sys
import sysconfig
import tempfile
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path

ROOT = Path(__file__).parents[1]

#: Where each file has the version, as a pattern with one group.
VERSIONS = {
    "ndtheory/__init__.py": r'^__version__ = "(.*)"$',
    "verification/__init__.py": r'^__version__ = "(.*)"$',
    "CITATION.cff": r"^version: (.*)$",
    "docs/cite.md": r"^  version = \{(.*)\},$",
    "docs/install.md": r"pip install ndtheory-(.*)-py3-none-any\.whl",
}

#: The addresses that a released package names.
NEEDED_URLS = ("Documentation", "Source", "Issues", "Changelog")


def versions(texts: Mapping[str, str]) -> Iterator[str]:
    """Files whose version is missing, not a version, or another one than that of the first file.

    Examples
    --------
    >>> list(versions(dict.fromkeys(VERSIONS, "nothing")))[0]
    'ndtheory/__init__.py: no version'
    """
    found = {}
    for name, pattern in VERSIONS.items():
        there = re.findall(pattern, texts[name], re.MULTILINE)
        if len(there) != 1:
            yield f"{name}: {f'{len(there)} versions' if there else 'no version'}"
        elif not re.fullmatch(r"\d+\.\d+\.\d+", there[0]):
            yield f"{name}: version {there[0]}, needed three numbers"
        else:
            found[name] = there[0]
    first = next(iter(found.values()), "")
    yield from (f"{name}: version {other}, needed {first}" for name, other in found.items() if other != first)


def changelog(text: str, version: str, today: datetime.date) -> Iterator[str]:
    """What keeps a changelog from being that of a release of today or before.

    Examples
    --------
    >>> list(changelog("## [0.1.0] - 2026-11-30\\n\\n- All.\\n", "0.1.0", datetime.date(2026, 11, 30)))
    []
    >>> list(changelog("## [Unreleased]\\n\\n- All.\\n", "0.1.0", datetime.date(2026, 11, 30)))
    ['CHANGELOG.md: the first section is [Unreleased], needed [0.1.0] - YYYY-MM-DD']
    """
    heading, _, rest = f"\n{text}".partition("\n## ")[2].partition("\n")
    dated = re.fullmatch(rf"\[{re.escape(version)}\] - (\d{{4}}-\d\d-\d\d)", heading)
    if dated is None:
        yield f"CHANGELOG.md: the first section is {heading or 'missing'}, needed [{version}] - YYYY-MM-DD"
        return
    try:
        day = datetime.date.fromisoformat(dated[1])
    except ValueError:
        yield f"CHANGELOG.md: {dated[1]} is no date"
        return
    if day > today:
        yield f"CHANGELOG.md: {day} is in the future"
    if "\n- " not in rest.partition("\n## ")[0]:
        yield f"CHANGELOG.md: nothing is listed under {version}"


def citation(cff: str, log: str) -> Iterator[str]:
    """What of CITATION.cff disagrees with the changelog: the day, once there is one."""
    released = re.findall(r"(?m)^date-released: ['\"]?([\d-]+)", cff)
    dates = re.findall(r"(?m)^## \[[\d.]+\] - ([\d-]+)$", log)[:1]
    if dates and released != dates:
        yield f"CITATION.cff: date-released {' '.join(released) or 'is missing'}, needed {dates[0]}"


def urls(project: Mapping[str, object]) -> Iterator[str]:
    """The addresses that are still to be set."""
    there = project.get("urls", {})
    yield from (f"pyproject.toml: [project.urls] has no {name}" for name in NEEDED_URLS if name not in there)


def tag(version: str, tags: str, status: str) -> Iterator[str]:
    """What git says: the tags of this commit, and what differs from it."""
    if f"v{version}" not in tags.split():
        yield f"git: this commit has no tag v{version}"
    if status.strip():
        yield f"git: the tree is not this commit: {' '.join(status.split()[1::2])}"


def read(root: Path) -> list[str]:
    """All faults that are found by reading."""
    texts = {name: (root / name).read_text("utf-8") for name in (*VERSIONS, "CHANGELOG.md")}
    project = tomllib.loads((root / "pyproject.toml").read_text("utf-8"))["project"]
    version = (re.findall(VERSIONS["ndtheory/__init__.py"], texts["ndtheory/__init__.py"], re.MULTILINE) or [""])[0]
    git = lambda *words: subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, check=True).stdout
    return [
        *versions(texts),
        *changelog(texts["CHANGELOG.md"], version, datetime.date.today()),
        *citation(texts["CITATION.cff"], texts["CHANGELOG.md"]),
        *urls(project),
        *tag(version, git("tag", "--points-at", "HEAD"), git("status", "--porcelain")),
    ]


#: Run a notebook, with what is found in the environment that runs this.
NOTEBOOK = """
import sys, nbformat, ndtheory
from nbclient import NotebookClient
from pathlib import Path

path, away = Path(sys.argv[1]), Path(sys.argv[2])
if away in Path(ndtheory.__file__).parents:
    sys.exit(f"ndtheory comes from {ndtheory.__file__}, and not from the wheel")
NotebookClient(nbformat.read(path, as_version=4), timeout=None, kernel_name="python3").execute()
"""


def built() -> list[str]:
    """All faults that are found by building: the archives, the site, its notebooks with the wheel."""
    faults = []

    def passes(what: str, *command: str | Path, cwd: Path = ROOT) -> bool:
        print(f"{what} ..", flush=True)
        ended = subprocess.run(command, cwd=cwd, check=False)
        if ended.returncode:
            faults.append(f"{what}: exit status {ended.returncode}")
        return ended.returncode == 0

    with tempfile.TemporaryDirectory() as name:
        work = Path(name).resolve()
        packed = passes("archives", sys.executable, ".ci/packages.py", "--commands", "--keep", work / "dist")
        site = ROOT / "docs" / "_build" / "html"
        if passes("site", "make", "docs") and packed:
            [wheel] = (work / "dist").glob("*.whl")
            subprocess.run([sys.executable, "-m", "venv", "--without-pip", work / "wheel"], check=True)
            python = work / "wheel" / "bin" / "python"
            pip = [sys.executable, "-m", "pip", "--quiet", "--python", work / "wheel", "install", "--no-deps", wheel]
            subprocess.run(pip, check=True)
            [packages] = (work / "wheel" / "lib").glob("python*/site-packages")
            (packages / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n", "utf-8")
            notebooks = sorted(site.rglob("*.ipynb"))
            if not notebooks:
                faults.append("site: no notebooks")
            for notebook in notebooks:
                passes(f"notebook {notebook.stem}", python, "-c", NOTEBOOK, notebook, ROOT, cwd=work)
    return faults


def main() -> int:
    faults = read(ROOT)
    if "--quick" not in sys.argv[1:]:
        faults += built()
    print("\n".join(faults) or "nothing keeps this commit from being released")
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main())
