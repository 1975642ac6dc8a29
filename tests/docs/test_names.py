"""What docstrings refer to exists, and what users call tells its parameters, results, errors and an example."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import re
from pathlib import Path
from types import ModuleType

import pytest

import verification as vf

ROLE = re.compile(r":(?:mod|class|func|data|meth|attr|exc):`~?([\w.]+)`")


def modules() -> dict[str, ModuleType]:
    """Every module of the three packages by name."""
    tops = [importlib.import_module(name) for name in ("fem1d2d", "ndtheory", "verification")]
    inside = [found.name for top in tops for found in pkgutil.walk_packages(top.__path__, f"{top.__name__}.")]
    return {top.__name__: top for top in tops} | {name: importlib.import_module(name) for name in inside}


def exists(name: str, module: str) -> bool:
    """Whether a dotted name is that of a module, of an object or of a field, seen from inside a module."""
    for full in (name, f"{module}.{name}"):
        parts = full.split(".")
        for count in range(len(parts), 0, -1):
            try:
                here = importlib.import_module(".".join(parts[:count]))
            except ImportError:
                continue
            for part in parts[count:]:
                here = getattr(here, part, getattr(here, "__annotations__", {}).get(part))
            if here is not None:
                return True
            break
    return False


def missing(module: str, source: str) -> list[str]:
    """References of the docstrings and comments of a module to what does not exist."""
    named = ROLE.findall(source)
    classes = re.findall(r"^ *class (\w+)", source, re.MULTILINE) if named else []
    seen_from = [module, *(f"{module}.{name}" for name in classes)]  # a method may be named inside its class
    return [name for name in named if not any(exists(name, place) for place in seen_from)]


def test_what_docstrings_refer_to_exists():
    found = {name: missing(name, inspect.getsource(module)) for name, module in modules().items()}
    assert {name: names for name, names in found.items() if names} == {}


def test_a_page_that_a_source_or_a_built_in_file_names_exists_and_has_the_title_that_is_given():
    root, titles = Path(vf.__file__).parents[1], 0
    sources = [path for top in ("fem1d2d", "ndtheory", "verification") for path in (root / top).rglob("*.*")]
    for path in sources:
        text = path.read_text("utf-8") if path.suffix in (".py", ".toml", ".js", ".j2") else ""
        for page, title in re.findall(r'(docs/[\w/]+\.md)(?: \("([^"]+)"\))?', text):
            first = next(line for line in (root / page).read_text("utf-8").splitlines() if line.startswith("# "))
            assert title in ("", first[2:])
            titles += bool(title)
        assert not re.search(r'\bpage "', text), f"{path}: the title of a page without its file"
    assert titles


def test_a_reference_to_nothing_is_found():
    text = '"""See :func:`ndtheory.bounds.evaluate`, :mod:`verification.jacobian`, :class:`Bounds`, :func:`small`."""'
    assert missing("ndtheory.bounds", text) == ["verification.jacobian", "small"]


#: Functions that answer with a sentence in place of an error.
ANSWERS = {"check"}


@pytest.mark.parametrize("name", [name for name in vf.__all__ if inspect.isfunction(getattr(vf, name))])
def test_a_public_function_tells_its_parameters_results_errors_and_an_example(name):
    told = inspect.getdoc(getattr(vf, name)) or ""
    sections = set(re.findall(r"^(\w+)\n-+$", told, re.MULTILINE))
    assert sections >= {"Parameters", "Examples"}
    assert ("Raises" in sections) == (name not in ANSWERS)
    assert sections & {"Returns", "Yields"}
    assert ">>> " in told


LINK = re.compile(r"\{py:(?:func|class)\}`(?:[^`<]*<)?([\w.]+)>?`")


def unlinked(text: str) -> list[str]:
    """Names of functions and classes in a page that the API pages do not list there: Sphinx links none of them."""
    found = []
    for name in LINK.findall(text):
        module, _, last = name.rpartition(".")
        if getattr(getattr(importlib.import_module(module), last, None), "__module__", None) != module:
            found.append(name)
    return found


@pytest.mark.parametrize(
    "page", sorted((Path(__file__).parents[2] / "docs" / "examples").glob("*.md")), ids=lambda page: page.name
)
def test_what_an_example_links_to_is_on_the_api_pages(page):
    assert unlinked(page.read_text(encoding="utf-8")) == []


def test_a_link_to_a_name_that_only_stands_for_another_is_found():
    text = "{py:func}`verification.run`, {py:func}`run <verification.algorithm.runs.run>`, {py:func}`fem1d2d.none`"
    assert unlinked(text) == ["verification.run", "fem1d2d.none"]
