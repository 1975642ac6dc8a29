"""The page of commands: the help of each, as the command prints it; and what a command lacks to be documented."""

from __future__ import annotations

import re
from collections.abc import Iterator

import click

HEAD = """# Commands

What each command says with `--help`. With `--json` it writes one document, which {doc}`/json` describes key by key.
"""

#: The line of the page of documents that says which command writes one.
WRITTEN_BY = re.compile(r"^Written by .*", re.MULTILINE)


def commands(
    group: click.Group, name: str, parent: click.Context | None = None
) -> Iterator[tuple[str, click.Command, click.Context]]:
    """Every command with its words as they are typed, those of groups within too, and a context to ask it in.

    The context has its parent: a command keeps the help option that it was first asked for.
    """
    settings = {"max_content_width": 80, "terminal_width": 80}
    above = parent or click.Context(group, info_name=name, **{**group.context_settings, **settings})
    for word, command in group.commands.items():
        context = click.Context(command, info_name=word, parent=above, **settings)
        yield f"{name} {word}", command, context
        if isinstance(command, click.Group):
            yield from commands(command, f"{name} {word}", context)


def page(group: click.Group, name: str) -> str:
    """The page of all commands, as Markdown; a command is on it by being one."""
    parts = [HEAD]
    for typed, command, context in commands(group, name):
        parts.append(f"## `{typed}`\n\n```text\n{command.get_help(context)}\n```\n")
    return "\n".join(parts)


def undocumented(group: click.Group, name: str, documents: str) -> list[str]:
    """What commands lack, in words: an example in the help, the help of an option, a schema on the page of documents.

    Parameters
    ----------
    group : click.Group
    name : str
        Of the group, as it is typed.
    documents : str
        The page of documents.
    """
    written = " ".join(WRITTEN_BY.findall(documents))
    found = []
    for typed, command, context in commands(group, name):
        text = command.get_help(context)
        if not re.search(rf"Examples?[^\n]*:\s+{re.escape(typed)}", text):
            found.append(f"{typed}: no example in its help")
        options = [option for option in command.params if isinstance(option, click.Option) and not option.hidden]
        found += [f"{typed}: no help for {option.opts[-1]}" for option in options if not option.help]
        if not re.search(rf"`{re.escape(typed)}\b", written):
            found.append(f"{typed}: no schema on the page of documents")
    return found
