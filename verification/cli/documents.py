"""The command schema: the keys of documents, for programs that read them."""

from __future__ import annotations

import json

import click

from verification.cli.console import say
from verification.cli.forms import cli


def _names(context: click.Context, parameter: click.Parameter, begun: str) -> list[str]:
    from verification.schemas import names

    return [name for name in names() if name.startswith(begun)]


@cli.command()
@click.argument("name", required=False, shell_complete=_names)
def schema(name: str | None) -> None:
    """List the documents of all commands, or print one JSON Schema.

    NAME is the name of a document, such as run, or its key "schema", such as ndtheory.run/1.

    \b
    Example:
      ndtheory schema run > run.schema.json
    """
    from verification.schemas import names
    from verification.schemas import schema as found

    if name is None:
        for known in names():
            say(f"  {known}")
        say("\nNext: ndtheory schema run")
        return
    try:
        say(json.dumps(found(name), indent=2, ensure_ascii=False))
    except ValueError as error:
        raise click.UsageError(str(error)) from None
