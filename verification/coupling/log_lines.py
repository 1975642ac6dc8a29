"""Logs that print a line for each residual: what a form says of the lines with iteration, residual and factor."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from verification.registry import LOG_FORMATS

Residual = Literal["absolute", "relative", "previous", "drop", "assumed"]

#: The groups that a pattern may name.
GROUPS = ("residual", "iteration", "omega", "theta")


class PatternError(ValueError):
    """A pattern for the lines of a log that is none."""


@dataclass(frozen=True, kw_only=True)
class Form:
    """A form of logs whose lines are searched one by one; any of its ``signs`` shows it.

    ``line`` has some of the groups ``iteration``, ``field``, ``residual``, ``theta``, a factor, and ``omega``, one that
    is Aitken's where it changes.  Only lines with one of the ``words`` are searched, or all.  ``label`` is the name of
    a residual, with ``{}`` for the field; ``needed`` what to do for a log that has none; the first group of
    ``accelerator`` the name of a rule that is not constant.  A factor is ``rounded`` if it is written in a figure or
    two; with ``every_step`` constant relaxation and Aitken print it in every iteration and quasi-Newton does not;
    ``again`` if every iteration prints all residuals of its window once more.
    """

    name: str
    signs: tuple[str, ...]
    line: re.Pattern[str]
    words: tuple[str, ...] = ()
    residual: Residual = "absolute"
    label: str = "{}"
    needed: str = "needed residuals"
    accelerator: re.Pattern[str] | None = None
    rounded: bool = False
    every_step: bool = False
    again: bool = False


def form_of(text: str) -> Form | None:
    """The form whose signs a log has; None where it has none."""
    return next((form for form in LOG_FORMATS.values() if any(sign in text for sign in form.signs)), None)


def form_of_pattern(pattern: str) -> Form:
    """The form that a user's pattern describes.

    One group is the residual; several are named ``residual``, ``iteration``, ``theta`` or ``omega``.

    Raises
    ------
    PatternError
        No regular expression, or other groups.

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
