"""The references of a page, in its notebook, say what they say on the site; visible cells run without hidden ones."""

import ast
import builtins
import re
from pathlib import Path

import pytest
from processes import sites

DOCS = Path(__file__).parents[2] / "docs"

#: A site that writes the text of one page as its notebook has it.
CONF = """
import sys
from pathlib import Path

sys.path.append({docs!r})
from sphinx.util.docutils import SphinxDirective
from builder.notebooks import plain
from builder.references import References

project, extensions = "references", ["myst_parser", "sphinx_proof", "sphinxcontrib.bibtex"]
myst_enable_extensions, bibtex_bibfiles = ["colon_fence", "dollarmath"], [{bibliography!r}]
html_baseurl = {base!r}


def write(app, failed):
    text = (Path(app.srcdir) / "examples" / "page.md").read_text("utf-8")
    (Path(app.outdir) / "told.md").write_text(plain(text, {{}}, References(app, "examples/page")), "utf-8")


class Widget(SphinxDirective):
    required_arguments = 1

    def run(self):
        return []


def setup(app):
    app.add_directive("widget", Widget)
    app.connect("build-finished", write)
"""

INDEX = """\
# The theory

```{py:function} run(problem)
```

```{glossary}
rate
  A number.
```

(small-friction)=
## Small friction

:::{prf:theorem} One step contracts
:label: thm-one

$$ K < 1 $$ (eq-one)
:::

:::{figure} dot.svg
:name: fig-dot

A dot.
:::

```{toctree}
examples/page
```

```{bibliography}
```
"""

DOT = '<svg xmlns="http://www.w3.org/2000/svg" width="1" height="1"/>'

PAGE = """\
# A page

:::{prf:lemma} Two norms
:label: lem-two

$$
a \\le b
$$ (eq-two)
:::

See {doc}`../index`, {doc}`the theory <../index>`, {ref}`small-friction`, {ref}`that part <small-friction>`;
by {prf:ref}`thm-one`, {prf:ref}`lem-two`, {prf:ref}`the theorem <thm-one>`, {eq}`eq-one` and {eq}`eq-two`,
seen in {numref}`fig-dot`.
{cite:t}`BayadaSabilSassi2008` and {cite:t}`HueberWohlmuth2005` prove it {cite}`EckWohlmuth2003`.
The [first page](../index.md) has the {term}`rates <rate>` of {py:func}`run`, or
of {py:func}`verification.run <run>`, {py:func}`~run`.

```{widget} cobweb
```
"""

TOLD = """\
# A page

**Lemma 1** (Two norms)


$$
a \\le b
\\tag{2}
$$


See *The theory*, the theory, *Small friction*, that part;
by Theorem 1, Lemma 1, the theorem, (1) and (2),
seen in Fig. 1.
Bayada, Sabil and Sassi (2008) and Hüeber and Wohlmuth (2005) prove it (Eck and Wohlmuth 2003).
The first page has the rates of run, or
of verification.run, run.

On the site a picture to move is here: *A page*, COBWEB.
"""

LINKS = (
    "See [The theory](https://a.org/b/index.html), [the theory](https://a.org/b/index.html),"
    " [Small friction](https://a.org/b/index.html#small-friction)"
)

MORE_LINKS = (
    "The [first page](https://a.org/b/index.html) has the [rates](https://a.org/b/index.html#term-rate)"
    " of [run](https://a.org/b/index.html#run), or\nof [verification.run](https://a.org/b/index.html#run),"
    " [run](https://a.org/b/index.html#run).\n\n"
    "On the site a picture to move is here: [A page](https://a.org/b/examples/page.html), COBWEB."
)


@pytest.fixture
def told(site_tools, builder, tmp_path):
    """From the place of a site to the text of its page; without the tools of the site there is none."""

    def build(name, base):
        folder = tmp_path / name
        (folder / "examples").mkdir(parents=True)
        conf = CONF.format(docs=str(DOCS), bibliography=str(DOCS / "references.bib"), base=base)
        files = {"conf.py": conf, "index.md": INDEX, "examples/page.md": PAGE, "dot.svg": DOT}
        for path, text in files.items():
            (folder / path).write_text(text, encoding="utf-8")
        return folder

    folders = [build("here", ""), build("hosted", "https://a.org/b")]
    assert sites(*folders) == "here 0\nhosted 0\n"
    label = builder.widgets.WIDGETS["cobweb"].label
    return {
        folder.name: (folder / "built" / "told.md").read_text("utf-8").replace(label, "COBWEB") for folder in folders
    }


def test_references_are_words_in_a_notebook_and_links_once_the_site_has_an_address(told):
    assert told["here"] == TOLD
    assert LINKS in told["hosted"]
    assert MORE_LINKS in told["hosted"]
    assert (
        "by [Theorem 1](https://a.org/b/index.html#thm-one), [Lemma 1](https://a.org/b/examples/page.html#lem-two)"
        in (told["hosted"])
    )


# --- what a reader who downloads a notebook can run ---

CELL = re.compile(r"^```\{code-cell\}[^\n]*\n(.*?)^```", re.DOTALL | re.MULTILINE)

#: The head of a cell, as a block or as lines, and its code.
OPTIONS = re.compile(r"((?:---\n.*?^---\n|(?::\w+:[^\n]*\n)*))(.*)", re.DOTALL | re.MULTILINE)


def unknown_names(page: str) -> list[str]:
    """Names that visible cells use, and that only hidden cells define."""
    known, unknown = set(dir(builtins)), []
    for cell in CELL.findall(page):
        options, code = OPTIONS.match(cell).groups()
        if "remove-cell" in options:
            continue
        lines = (line for line in code.splitlines() if not line.startswith("%"))
        nodes = list(ast.walk(ast.parse("\n".join(lines))))
        for node in nodes:
            if isinstance(node, ast.alias):
                known.add((node.asname or node.name).partition(".")[0])
            elif isinstance(node, (ast.FunctionDef, ast.ClassDef, ast.ExceptHandler)):
                known.add(node.name)
            elif isinstance(node, ast.arg):
                known.add(node.arg)
            elif isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
                known.add(node.id)
        unknown += sorted({node.id for node in nodes if isinstance(node, ast.Name)} - known)
    return unknown


PAGES = {
    path.relative_to(DOCS).as_posix(): path.read_text("utf-8")
    for path in sorted(DOCS.rglob("*.md"))
    if not {"_build", "generated", "jupyter_execute"} & set(path.parts)
}
NOTEBOOKS = [
    name
    for name, text in PAGES.items()
    if "file_format: mystnb" in text.partition("\n---\n")[0] and "notebook: none" not in text.partition("\n---\n")[0]
]


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_uses_no_name_that_only_a_hidden_cell_defines(name):
    assert unknown_names(PAGES[name]) == []


def test_a_name_from_a_hidden_cell_is_found():
    hidden = "```{code-cell} ipython3\n:tags: [remove-cell]\nbest = 1\n```\n"
    visible = "```{code-cell} ipython3\n%%matplotlib inline\nx = [i + %s for i in range(3)]\nprint(x, f'{x[0]}')\n```\n"
    assert unknown_names(hidden + visible % "best") == ["best"]
    assert unknown_names(hidden + visible % "1") == []
    assert "certificates.md" in NOTEBOOKS
