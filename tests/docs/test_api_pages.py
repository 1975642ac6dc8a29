"""Each module has a page of the API and one line in the list of modules."""

import importlib
import pkgutil
import re
from pathlib import Path

from processes import ended

import verification as vf


def test_each_module_but_those_of_commands_has_a_page(builder):
    tops = [importlib.import_module(name) for name in ("fem1d2d", "ndtheory", "verification")]
    inside = {found.name for top in tops for found in pkgutil.walk_packages(top.__path__, f"{top.__name__}.")}
    every = {top.__name__ for top in tops} | inside
    commands = {name for name in every if name.split(".")[:2] == ["verification", "cli"]}
    assert set(builder.api.modules()) == every - commands


def test_a_page_shows_the_members_of_its_module(builder):
    pages = builder.api.pages({"a": Path("a/__init__.py"), "a.b": Path("a/b.py")})
    assert ".. automodule:: a.b\n   :members:" in pages["a.b"]
    assert ".. automodule:: a\n   :no-members:" in pages["a"]
    assert all(page.startswith("---\norphan: true\n---\n") for page in pages.values())
    assert not any("{doc}" in page for page in pages.values())
    (page,) = builder.api.pages({"verification": Path("verification/__init__.py")}).values()
    assert "{doc}`/api/index`" in page


def test_the_list_has_each_module_once_with_its_first_sentence(builder):
    found = builder.api.modules()
    lines = builder.api.index(found).splitlines()
    rows = [line for line in lines if line.startswith("| {doc}")]
    assert sorted(row.split("`")[1].split(" ")[0] for row in rows) == sorted(found)
    assert [row for row in rows if row.endswith("|  |") or ":`" in row] == []
    assert "| {doc}`ndtheory.bounds <api/ndtheory.bounds>` | " in "\n".join(rows)


def test_pages_of_modules_that_are_gone_are_removed(builder, tmp_path):
    source = tmp_path / "source"
    for name in ("ndtheory", "fem1d2d", "verification"):
        (source / name).mkdir(parents=True)
        (source / name / "__init__.py").write_text(f'"""The package {name}."""\n', encoding="utf-8")
    (source / "ndtheory" / "old.py").write_text('"""An old module."""\n', encoding="utf-8")
    builder.api.write(tmp_path / "made", source)
    assert (tmp_path / "made" / "api" / "ndtheory.old.md").exists()
    (source / "ndtheory" / "old.py").unlink()
    builder.api.write(tmp_path / "made", source)
    pages = {path.name for path in (tmp_path / "made" / "api").iterdir()}
    assert pages == {"ndtheory.md", "fem1d2d.md", "verification.md"}
    assert "old" not in (tmp_path / "made" / "modules.md").read_text("utf-8")


ROW = re.compile(r"\| \{py:\w+\}`vf\.(\w+) <([\w.]+)>` \| .* \| (.*) \|")


def test_the_api_page_lists_each_public_name_once_with_its_place_and_meaning(builder):
    rows = [ROW.fullmatch(line).groups() for line in builder.api.calls().splitlines() if line.startswith("| {")]
    assert sorted(name for name, _, _ in rows) == sorted(vf.__all__)
    modules = builder.api.modules()
    for name, place, meaning in rows:
        module, _, last = place.rpartition(".")
        assert module in modules
        assert getattr(importlib.import_module(module), last) is getattr(vf, name)
        assert len(meaning.split()) > 1
    assert "```{calls}\n```" in (Path(__file__).parents[2] / "docs" / "api" / "index.md").read_text("utf-8")


def test_a_function_on_the_api_page_links_to_its_result(builder):
    assert builder.api.returned(vf.iterate) == f"iterator of {builder.api.link(vf.Iterate)}"
    assert builder.api.returned(vf.solve) == builder.api.link(vf.Solution)
    assert builder.api.returned(vf.schema) == "`dict`"
    assert builder.api.returned(vf.Run) == ""


#: Shows as lines of reStructuredText what a docstring of a value and a list of attributes become.
SHOWN = """
    import sys

    sys.path.append(sys.argv[1])
    from builder.pages import read_as_written
    from sphinx.ext.napoleon import Config, NumpyDocstring

    read_as_written()
    config = Config(napoleon_use_ivar=True)
    print(NumpyDocstring("Nodes at most: more\\nfill the memory.", config, what="data", name="MOST"))
    body = "A body.\\n\\nAttributes\\n----------\\nE, nu : float\\n    Moduli."
    print(NumpyDocstring(body, config, what="class", name="Body"))
"""


def test_the_text_of_a_value_is_text_and_each_attribute_of_a_line_has_a_name(site_tools):
    answer = ended(SHOWN, Path(__file__).parents[2] / "docs")
    assert answer.returncode == 0, answer.stderr
    lines = [line.strip() for line in answer.stdout.splitlines() if line.strip()]
    assert lines[:2] == ["Nodes at most: more", "fill the memory."]
    assert [line.rstrip() for line in lines if line.startswith(":ivar")] == [":ivar E: Moduli.", ":ivar nu: Moduli."]
