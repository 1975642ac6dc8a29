"""Options that several commands share, the types of their values, and the problem as it was typed."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields
from fractions import Fraction
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any, TypeVar

import click

from ndtheory import exact
from ndtheory.texts import did_you_mean
from verification.show.layout import nothing_typed
from verification.show.parts import Next

if TYPE_CHECKING:
    from verification.output.files import Kind

F = TypeVar("F", bound=Callable[..., Any])
T = TypeVar("T")

PATH = click.Path(path_type=Path)
FILE = click.argument("file", type=PATH)
JSON = click.option("--json", "as_json", is_flag=True, help="One JSON document on stdout.")


def _pairs(context: click.Context, parameter: click.Parameter, given: Sequence[str]) -> dict[str, str]:
    pairs: dict[str, str] = {}
    for words in given:
        key, equals, value = words.partition("=")
        if not equals:
            needed = f"{words}: needed KEY=VALUE, such as contact.friction=0.4"
            raise click.BadParameter(needed)
        pairs.pop(key, None)  # the last one is set last
        pairs[key] = value
    return pairs


SET = click.option(
    "--set",
    "keys",
    multiple=True,
    callback=_pairs,
    metavar="KEY=VALUE",
    help="Set a key of FILE, such as contact.friction=0.4 or 'body1.x=[0, 3]'; may be repeated.",
)


class OneOf(click.Choice[str]):
    """A word of a list; the error for another word has the list and the word that may be meant."""

    def get_invalid_choice_message(self, value: Any, ctx: click.Context | None) -> str:
        """The value, the list, and the word that resembles the value."""
        return f"{value}: needed one of {', '.join(self.choices)}{did_you_mean(str(value), self.choices)}"


def number(needed: str, fits: Callable[[Fraction], bool], of: Callable[[str], T] = str) -> Callable[..., T | None]:  # type: ignore[assignment]
    """A callback that refuses what is not such a number."""

    def read(context: click.Context, parameter: click.Parameter, value: str | None) -> T | None:
        with suppress(ValueError, OverflowError):
            if value is None or fits(exact(value)):
                return None if value is None else of(value)
        raise click.BadParameter(f"{value}: needed {needed}")

    return read


class Registered(OneOf):
    """A registered name; ``names`` returns the names there are, and imports their module only when they are needed."""

    def __init__(self, names: Callable[[], Sequence[str]]) -> None:
        self.case_sensitive = True
        self._names = names

    @property
    def choices(self) -> Sequence[str]:  # type: ignore[override]
        """The names there are now."""
        return self._names()


def _rules() -> Sequence[str]:
    from verification.registry import RULES

    return tuple(RULES)


RELAXATION = click.option(
    "--relaxation",
    type=Registered(_rules),
    metavar="RULE",  # a list of the names would import the rules, and arrays with them
    help="Rule of relaxation, instead of the file's: one of constant, aitken, anderson, iqn-ils, newton, momentum or a "
    "registered one; all but constant are outside the theorem.",
)


def _bounds(context: click.Context, parameter: click.Parameter, value: str | None) -> tuple[str, ...] | None:
    from verification.bounds.table import chosen

    try:
        return None if value is None else chosen(value)
    except ValueError as error:
        raise click.BadParameter(f"{value}: {error}") from None


BOUNDS = click.option(
    "--bounds",
    callback=_bounds,
    metavar="NAMES",
    help="Only these bounds, of printed,repaired,energy,lmi,lyapunov and registered ones; by default all but lyapunov. "
    "Without lmi the command is fast.",
)

FULL = click.option("--full", is_flag=True, help="Show all numbers; the first screen has at most 15 lines.")

THETA = click.option("--theta", metavar="NUMBER", help="Relaxation factor, 0 < theta < 1, instead of the file's.")
SWAP = click.option("--swap-roles", "swap", is_flag=True, help="Exchange the roles of the bodies.")
SOLVER = click.option(
    "--solver",
    type=OneOf(["auto", "cvxpy", "active-set"]),
    default="auto",
    show_default=True,
    help="Solver of step II, the contact problem.",
)


def into(words: str, **more: Any) -> Callable[[F], F]:
    """The option ``-o`` of a command that fills a folder; an empty name is refused."""

    def named(context: click.Context, parameter: click.Parameter, value: str | None) -> Path | None:
        if value == "":
            raise click.BadParameter(": needed the name of a folder")
        return None if value is None else Path(value)

    return click.option("-o", "--output", "folder", callback=named, metavar="DIR", help=words, **more)


def writer(path: Path | None, kind: Kind) -> Callable[[Any], None] | None:
    """The function that writes a result into a folder, which is checked at once; None where none was named."""
    if path is None:
        return None
    from verification.output.folder import Folder

    return Folder(path, kind).write


def one_file(
    *endings: str, words: str, required: bool = False, names: Sequence[str] = ("-o", "--output")
) -> Callable[[F], F]:
    """The option ``-o``, or another, of a command that makes one file, with a name that ends in one of these.

    It is refused at once where it cannot be written, or another program has written it.
    """
    needed = f"a name ending in {' or '.join(endings)}"

    def named(context: click.Context, parameter: click.Parameter, value: Path | None) -> Path | None:
        if value is None or context.resilient_parsing:
            return value
        if value.suffix not in endings:
            raise click.BadParameter(f"{value}: needed {needed}")
        from verification.output.files import check_ours
        from verification.problem.tables import ProblemError

        if not value.parent.is_dir():
            raise ProblemError(str(value), "", None, f"needed a name in a folder that exists ({parameter.opts[0]})")
        check_ours(value, parameter.opts[0])
        return value

    return click.option(
        *names,
        "target",
        type=PATH,
        callback=named,
        required=required,
        metavar=f"FILE{endings[0]}",
        help=f"{words}, {needed}.",
    )


FOLDER = into("Folder for the results.")

JOBS = click.option(
    "--jobs",
    callback=number("a whole number of at least 1", lambda n: n >= 1, int),
    metavar="N",
    help="Number of processes; one for each core by default.",
)
STORE = click.option("--store", type=PATH, metavar="STORE", help="File that keeps the rows of runs (SQLite).")


@dataclass(frozen=True, kw_only=True)
class Typed:
    """A problem file and the changes by options, for the command that is suggested next.

    ``keys`` are those of ``--set``, in their order; ``folder`` has the results, if they were written.
    """

    file: Path
    keys: Mapping[str, str] = field(default_factory=dict)
    theta: str | None = None
    relaxation: str | None = None
    swap: bool = False
    folder: Path | None = None

    def command(self, part: Next) -> str:
        """The words of a command with the problem; empty if there is none, or they could not be pasted."""
        if not part.problem:
            return nothing_typed(part)
        done = self.folder is not None and "-o" in part.words
        if done and not part.written:
            return ""
        first, *options = part.written if done else part.words
        words = ["ndtheory", first, self._place()]
        again = {option.partition("=")[0] for option in options}
        words += [word for key, value in self.keys.items() if key not in again for word in ("--set", f"{key}={value}")]
        if part.iteration:
            given = {"--theta": self.theta, "--relaxation": self.relaxation}
            kept = {name: value for name, value in given.items() if value is not None and name not in options}
            words += [word for pair in kept.items() for word in pair]
        words += ["--swap-roles"] * (self.swap != part.exchanged)
        words += options
        return " ".join(map(quote, words)) if all(word.isprintable() for word in words) else ""

    def _place(self) -> str:
        """The file, with ./ before what could be read as an option or as the name of a command."""
        name = str(self.file)
        return f"./{name}" if name.startswith("-") or (self.file.name == name and not self.file.suffix) else name


def of_a_file(*options: Callable[[Any], Any]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Give a command FILE, --set and more options that change its problem; it gets them as one Typed."""

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(command)
        def run(**given: Any) -> Any:
            names = [each.name for each in fields(Typed) if each.name != "folder" and each.name in given]
            return command(Typed(**{name: given.pop(name) for name in names}), **given)

        changed: Callable[..., Any] = run
        for option in reversed((FILE, SET, *options)):
            changed = option(changed)
        return changed

    return decorate


#: The options that change the run of a problem.
RUN = (THETA, RELAXATION, SWAP, SOLVER)
