"""Logs that print a line for each residual: what a form says of the lines with iteration, residual and factor."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from difflib import SequenceMatcher
from typing import Literal

from verification.registry import LOG_FORMATS

Residual = Literal["absolute", "relative", "previous", "drop", "assumed"]

#: The formats of columns that any log may have.
COLUMNS = ("preCICE", "columns")

#: So many lines of a log are compared with those of known formats, and how much alike they must be.
LOOKED_AT, ALIKE = 40, 0.7

#: Characters of a line that are looked at.
WIDEST = 300

#: A number between blanks, and one after a word as programs name residuals.
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d[\d.]*(?:[eE][-+]?\d+)?(?![\w.])")
_RESIDUAL = re.compile(
    r"(?P<before>\b(?:\w*(?:resid|norm|err|diff|change)|(?:\w*_)?res).*?)(?<![\w.])[-+]?\d+\.\d+(?:e[-+]?\d+)?",
    re.IGNORECASE,
)

#: The groups that a pattern may name.
GROUPS = ("residual", "iteration", "omega", "theta")


class PatternError(ValueError):
    """A pattern for the lines of a log that is none."""


@dataclass(frozen=True, kw_only=True)
class Format:
    """A format of logs; any of its ``signs`` shows it.

    ``program`` names the program and its versions, ``example`` has some lines.  A log of a format that ``warns`` is
    read with this note; of one that is ``refused`` these words say why.
    """

    name: str
    signs: tuple[str, ...]
    program: str = ""
    example: str = ""
    residual: Residual = "absolute"
    warns: str = ""
    refused: str = ""


@dataclass(frozen=True, kw_only=True)
class Form(Format):
    """A format whose lines are searched one by one.

    ``line`` has some of the groups ``iteration``, ``field``, ``residual``, ``theta``, a factor, and ``omega``, one that
    is Aitken's where it changes.  Only lines with one of the ``words`` are searched, or all.  A field in whose name one
    of the ``kinds`` is found has this residual.  ``label`` is the name of a residual, with ``{}`` for the field;
    ``needed`` what to do for a log that has none; the first group of ``accelerator`` the name of a rule that is not
    constant, or ``renamed``.  A factor is ``rounded`` if it is written in a figure or two; with ``every_step`` constant
    relaxation and Aitken print it in every iteration and quasi-Newton does not; ``again`` if every iteration prints all
    residuals of its window once more; ``once`` if only the first residual after an iteration is of the coupling, and
    none after a line without groups.
    """

    line: re.Pattern[str]
    words: tuple[str, ...] = ()
    kinds: tuple[tuple[str, Residual], ...] = ()
    label: str = "{}"
    needed: str = "needed residuals"
    accelerator: re.Pattern[str] | None = None
    renamed: Mapping[str, str] = field(default_factory=dict)
    rounded: bool = False
    every_step: bool = False
    again: bool = False
    once: bool = False

    def kind_of(self, name: str) -> Residual:
        """The residual of a field."""
        return next((kind for word, kind in self.kinds if word in name), self.residual)


@dataclass(frozen=True, kw_only=True)
class ColumnsForm(Format):
    """A format of columns with names, all ``signs`` of which are there.

    The columns whose names match ``residuals`` count, in rows in which the column ``only`` is 1; a column ``split``
    says which field a row is of.  Their numbers may be decimal logarithms, ``log10``.
    """

    residuals: re.Pattern[str]
    iteration: str
    split: str = ""
    only: str = ""
    log10: bool = False


def form_of(text: str, name: str | None = None) -> Form | None:
    """The form of lines of a name, or whose signs a log has; None for columns.  PatternError for another name."""
    if name is not None:
        if name not in (*LOG_FORMATS, *COLUMNS):
            raise PatternError(f"needed one of {', '.join([*LOG_FORMATS, *COLUMNS])}")
        found = LOG_FORMATS.get(name)
        return found if isinstance(found, Form) else None
    lines = (form for form in LOG_FORMATS.values() if isinstance(form, Form))
    return next((form for form in lines if any(sign in text for sign in form.signs)), None)


def columns_of(names: Sequence[str]) -> ColumnsForm | None:
    """The form of columns with these names; None for any others."""
    tables = (form for form in LOG_FORMATS.values() if isinstance(form, ColumnsForm))
    return next((form for form in tables if set(form.signs) <= set(names)), None)


def to_try(text: str) -> str:
    """The nearest known format, and a pattern to try, for a log that none fits; empty for a table of numbers."""
    lines = [line[:WIDEST] for line in text.strip().splitlines()[:LOOKED_AT] if line.strip()]
    if 2 * sum(bool(_NUMBER.match(line.split()[0])) for line in lines) > len(lines):
        return ""
    said, bare = [], [_NUMBER.sub("#", line) for line in lines]
    alike, nearest = max(
        (SequenceMatcher(None, _NUMBER.sub("#", one), line).ratio(), form.name)
        for form in LOG_FORMATS.values()
        for one in form.example.splitlines()
        for line in bare
    )
    if alike > ALIKE:
        said.append(f"the nearest format is {nearest}")
    if match := next(filter(None, map(_RESIDUAL.search, lines)), None):
        words = re.sub(r"([^\w\s])", r"\\\1", _NUMBER.sub("0", match["before"].strip()))
        pattern = re.sub(r"\s+", r"\\s+", re.sub(r"\b0\b", r"\\S+", words))
        said.append(f"to try: --pattern '{pattern}\\s*([^\\s,;]+)'")
    return ", ".join(said)


def form_of_pattern(pattern: str) -> Form:
    """The form that a user's pattern describes.

    One group is the residual; several are named ``residual``, ``iteration``, ``theta`` or ``omega``.  PatternError for
    other groups, and where it is no regular expression.

    Examples
    --------
    >>> form_of_pattern(r"it (?P<iteration>[0-9]+) err=(?P<residual>[0-9.e+-]+)").line.groups
    2
    """
    try:
        compiled = re.compile(pattern)
    except (re.error, RecursionError, OverflowError) as error:
        raise PatternError(f"needed a regular expression: {error}") from None
    names = set(compiled.groupindex)
    if compiled.groups == 1 and not names:
        pass
    elif unknown := sorted(names.difference(GROUPS)):
        raise PatternError(f"group {unknown[0]}: needed {', '.join(GROUPS)}")
    elif "residual" not in names or compiled.groups != len(names):
        raise PatternError("needed one group, the residual, or groups (?P<residual>..) with names")
    return Form(
        name="pattern",
        signs=(),
        line=compiled,
        residual="assumed",
        label="residual",
        needed="needed residuals: the pattern is found in no line",
    )
