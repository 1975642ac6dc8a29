"""References of a page as a notebook shows them, where nothing resolves a role: in words, and as links to the site."""

from __future__ import annotations

from collections.abc import Iterable
from urllib.parse import urljoin

from docutils import nodes
from pybtex.database import Entry
from pybtex.richtext import Text
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx

from builder.widgets import WIDGETS

#: Where a notebook has neither the title of a page or a section nor a link to it, it is set apart from the sentence.
TITLES = ("doc", "ref")


class References:
    """What the references of a page say, once the site is built.

    Parameters
    ----------
    app : Sphinx
        Its ``html_baseurl`` says where the site will be; without it there are words and no links.
    page : str
    """

    def __init__(self, app: Sphinx, page: str) -> None:
        self.app, self.page = app, page

    def __call__(self, role: str, target: str, title: str = "") -> str:
        """A reference in Markdown.

        Parameters
        ----------
        role : str
            Its name on the page: one of :data:`builder.notebooks.REFERENCES`; or ``widget``, for the page and the label
            of a widget.
        target : str
        title : str
            The words that the page gives it; by default those of the target.

        Raises
        ------
        KeyError
            There is no such target.
        """
        if role == "widget":
            return f"{self('doc', '/' + self.page)}, {WIDGETS[target].label}"
        if role in ("cite", "cite:t"):
            entries = self.app.env.get_domain("cite").bibdata.data.entries
            return cited([entries[key.strip()] for key in target.split(",")], in_brackets=role == "cite")
        prefix, _, kind = role.rpartition(":")
        domain = prefix or ("math" if kind == "eq" else "std")
        if target.startswith("~"):
            target = target[1:]
            title = title or target.rpartition(".")[2]
        wanted = pending_xref(
            refdoc=self.page, refdomain=domain, reftype=kind, reftarget=target, refexplicit=bool(title)
        )
        found = self.app.env.get_domain(domain).resolve_xref(
            self.app.env, self.page, self.app.builder, kind, target, wanted, nodes.inline("", title or target)
        )
        if found is None:
            raise KeyError(f"{{{role}}}`{target}`")
        words = title or found.astext()
        if base := self.app.config.html_baseurl:
            here = urljoin(f"{base.rstrip('/')}/", self.app.builder.get_target_uri(self.page))
            there = f"#{found['refid']}" if "refid" in found else found["refuri"]
            return f"[{words}]({urljoin(here, there)})"
        return f"*{words}*" if role in TITLES and not title else words


def cited(entries: Iterable[Entry], *, in_brackets: bool) -> str:
    """Authors and year of works, as a sentence names them or in brackets behind it.

    Examples
    --------
    >>> from pybtex.database import Person
    >>> entry = Entry("article", {"year": "2003"}, {"author": [Person("Eck, C."), Person('W{\\\\"o}hl, B.')]})
    >>> cited([entry], in_brackets=False), cited([entry, entry], in_brackets=True)
    ('Eck and Wöhl (2003)', '(Eck and Wöhl 2003; Eck and Wöhl 2003)')
    """
    works = []
    for entry in entries:
        people = entry.persons["author"] if "author" in entry.persons else entry.persons["editor"]
        names = [str(Text.from_latex(" ".join(person.prelast_names + person.last_names))) for person in people]
        authors = " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
        works.append((authors, entry.fields["year"]))
    if in_brackets:
        return f"({'; '.join(f'{authors} {year}' for authors, year in works)})"
    return ", ".join(f"{authors} ({year})" for authors, year in works)
