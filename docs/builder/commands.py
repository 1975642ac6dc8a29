"""The page of commands: the help of each, as the command prints it; and what a command lacks to be documented."""

from __future__ import annotations

import re
from collections.abc import Iterator

import click

HEAD = """# Commands

The help of each command, as `--help` prints it on a terminal of 80 columns. With `--json` a command
writes one document, which {doc}`/json` describes key by key.
"""

#: Columns of a help on a terminal of 80.
SCREEN = 78

#: The line of the page of documents that says which command writes one.
WRITTEN_BY = re.compile(r"^Written by .*", re.MULTILINE)


def commands(
    group: click.Group, name: str, parent: click.Context | None = None
) -> Iterator[tuple[str, click.Command, click.Context]]:
    """Every command with its words as they are typed, those of groups within too, and a context to ask it in.

    The context has its parent: a command keeps the help option that it was first asked for.  The command is that which
    writes the help: a group that works without the name of a command leaves it to its default.
    """
    settings = {"terminal_width": SCREEN}
    above = parent or click.Context(group, info_name=name, **{**group.context_settings, **settings})
    for word, command in group.commands.items():
        context = command.make_context(word, [], above, resilient_parsing=True, **settings)
        yield f"{name} {word}", context.command, context
        if isinstance(command, click.Group):
            yield from commands(command, f"{name} {word}", click.Context(command, parent=above, info_name=word))


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
