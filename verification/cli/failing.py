"""The line and the document of a command that ends without a result: a solver failed, or nothing was proved."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import click

from verification.cli.console import complain, say
from verification.document import Document

if TYPE_CHECKING:
    from verification.problem.specification import Problem

#: Where the context of a command keeps the problem that it has read.
PROBLEM = "ndtheory.problem"


class Failure(Document):
    """The document of a command that ends without a result.

    Parameters
    ----------
    command : str
    outcome : {'error', 'not proved'}
        A solver failed; or nothing was proved, which says nothing about the problem.
    file : str or None
        The file that the command was given.
    error : str
        What happened, in words.
    problem : Problem or None
        None where the command reads none.
    """

    schema: ClassVar[str] = "ndtheory.failure/1"

    def __init__(self, *, command: str, outcome: str, file: str | None, error: str, problem: Problem | None) -> None:
        self.command, self.outcome, self.file, self.error, self.problem = command, outcome, file, error, problem
        self.units: Mapping[str, str] = {"length": "any", "stress": "any"} if problem is None else problem.units

    def content(self) -> dict[str, Any]:
        reason = {} if self.file is not None else {"file": "the command was given none"}
        return {
            "command": self.command,
            "outcome": self.outcome,
            "file": self.file,
            "error": self.error,
            "reason": reason,
        }


def remember(problem: Problem) -> Problem:
    """Keep the problem of a command until it ends: a failure is about it."""
    context = click.get_current_context(silent=True)
    if context is not None:
        context.meta[PROBLEM] = problem
    return problem


def fail(error: Exception, outcome: str = "error", lead: str = "") -> int:
    """Say in one line why the present command has no result, write the document of it under --json, and return 1.

    Parameters
    ----------
    error : Exception
    outcome : {'error', 'not proved'}
    lead : str
        Words that come before the message.
    """
    context = click.get_current_context()
    problem: Problem | None = context.meta.get(PROBLEM)
    given = context.params.get("file")
    file = None if given is None else str(given)
    complain(": ".join(part for part in ("ndtheory", file, lead, str(error)) if part))
    if context.params.get("as_json"):
        command = context.command_path.partition(" ")[2]
        found = Failure(command=command, outcome=outcome, file=file, error=str(error), problem=problem)
        say(found.to_json())
    return 1


def reported(command: Callable[..., Any]) -> Callable[..., Any]:
    """A command that says of which file a solver failed, and writes a document of it."""

    @functools.wraps(command)
    def run(*args: Any, **options: Any) -> Any:
        try:
            return command(*args, **options)
        except RuntimeError as error:
            if not solver_failed(error):
                raise
            return fail(error)

    return run


def solver_failed(error: RuntimeError) -> bool:
    """True for the errors of the solvers of step II and of the global method."""
    from verification.contact import ContactError  # numpy: only now
    from verification.monolithic import SolveError

    return isinstance(error, (ContactError, SolveError))
