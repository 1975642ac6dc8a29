"""``ndtheory draft``: a problem file from mesh files."""

from __future__ import annotations

from pathlib import Path

import click

from verification.cli.console import complain, say
from verification.cli.forms import cli
from verification.cli.options import JSON, PATH


@cli.command()
@click.argument("mesh", type=PATH)
@click.argument("mesh2", type=PATH, required=False)
@JSON
def draft(mesh: Path, mesh2: Path | None, as_json: bool) -> None:
    """Write a problem file for one mesh file with all bodies, or for two.

    The bodies of one file are its pieces, by their physical surfaces (element sets).  With two files, each file is one
    body.  Named lines are sides, and those that face each other nearby may touch.  Comments name what you have to
    choose: in most files only the supports of both bodies.

    \b
    Example:
      ndtheory draft model.msh > my.toml
      ndtheory draft groove.msh pin.msh > my.toml
    """
    from verification.interface.draft import draft as drafted

    found = drafted(*(path for path in (mesh, mesh2) if path is not None))
    say(found.to_json() if as_json else found.toml.rstrip())
    for choice in () if as_json else found.choices:
        complain(f"to do: {choice}")
