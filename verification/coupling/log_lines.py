"""Forms of logs that print a line for each residual: which lines have the iteration, the residual and the factor."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

Residual = Literal["absolute", "relative", "previous", "drop", "assumed"]

#: The groups that a pattern may name.
GROUPS = ("residual", "iteration", "omega", "theta")


class PatternError(ValueError):
    """A pattern for the lines of a log that is none."""


@dataclass(frozen=True, kw_only=True)
class Form:
    """A form of logs whose lines are searched one by one.

    Attributes
    ----------
    name : str
    signs : tuple of str
        Any of them shows that a log has this form.
    line : pattern
        Has some of the groups ``iteration``, ``field``, ``residual``, ``theta``, a factor, and ``omega``, one that is
        Aitken's where it changes.
    words : tuple of str
        Only lines with one of them are searched; none for all lines.
    residual, label : str
        The kind of the residuals, and their name, with ``{}`` for the field.
    needed : str
        What to do for a log that has no residuals.
    accelerator : pattern or None
        Its first group is the name of a rule that is not constant relaxation.
    rounded : bool
        True if the factor is written in a figure or two, so that it may be another one.
    every_step : bool
        True if constant relaxation and Aitken print their factor in every iteration, and quasi-Newton does not.
    again : bool
        True if every iteration prints all residuals of its window once more.
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


# The lines were read in: Kratos, convergence_criteria and convergence_accelerators of CoSimulationApplication, and logs
# of version 10.4.4; solids4foam, the sources of fluidSolidInterfaces (fluidSolidInterface.C, AitkenCouplingInterface.C,
# IQNILSCouplingInterface.C) and the output shown in its pages on fluids and solids; Norma.jl, src/evolve.jl and
# src/schwarz.jl; Feel++ (commit 03cff286), feelpp/feel/feelalg/aitken.hpp, printInfo; MOOSE, PicardSolve.C,
# SecantSolve.C and SteffensenSolve.C in framework/src/executioners, printFixedPointConvergenceHistory.
FORMS = (
    Form(
        name="Kratos CoSimulation",
        signs=("abs-norm =", "abs_norm =", "Coupling iteration:"),
        words=("abs-norm", "abs_norm", "Coupling iteration", "Convergence for", "factor"),
        line=re.compile(
            r"Coupling iteration:\s*(?P<iteration>\d+)\s*/"
            r"|Convergence for \"(?P<field>[^\"]+)\""
            r"|abs[-_]norm\s*=\s*(?P<residual>[^\s|]+)(?=[\s|])"  # a last line may be cut off in a number
            r"|relaxation[^\d=]*factor\s*=\s*(?P<theta>[^\s,]+)(?=[\s,])"
        ),
        label="abs-norm of {}",  # the norm of the residual over a constant
        needed="needed residuals: set echo_level to 3 or more in the convergence criteria",
        rounded=True,  # of Kratos 10
        # the name with which an accelerator begins a line, but that of constant relaxation: a path may have any of them
        accelerator=re.compile(
            r"^(?:\[WARNING\] )?(?!ConstantRelaxation)(\w*(?:Aitken|Anderson|MVQN|IBQN|IQN|ConvergenceAccelerator)\w*)"
            r"\s*:",
            re.IGNORECASE | re.MULTILINE,
        ),
    ),
    Form(
        name="solids4foam",
        signs=("fsi relative residual norm", "FSI relative residual norm"),
        words=("iteration:", "factor", "residual norm"),
        line=re.compile(
            r"Time = \S+, iteration:\s*(?P<iteration>\d+)\s*$"
            r"|under-relaxation factor[^:]*:\s*(?P<theta>\S+)(?=\s)"
            r"|[Cc]urrent (?:fsi|FSI) relative residual norm(?: \((?P<field>[^)]*)\))?:\s*(?P<residual>\S+)(?=\s)"
        ),
        residual="drop",  # over the largest one so far
        accelerator=re.compile(r"under-relaxation factor \((Aitken)\)"),
        every_step=True,
    ),
    Form(
        name="Norma.jl",
        signs=("|ΔU|/|U| =",),
        words=("Criterion", "Relaxation:"),
        line=re.compile(
            r"Criterion \[(?P<iteration>\d+)\] \|ΔU\| = (?P<residual>[^\s:]+)(?=[\s:])"
            r"|Relaxation: fixed, θ = (?P<theta>\S+)(?=\s)"
        ),
        label="|ΔU|",
        accelerator=re.compile(r"(?:Relaxation: )?(Aitken[- ]\w+|Anderson)(?:,| θ)"),
    ),
    Form(
        name="Feel++",
        signs=("[Aitken] iteration :",),
        words=("[Aitken]",),
        line=re.compile(
            r"\[Aitken\] iteration : (?P<iteration>\d+) theta=(?P<omega>\S+) residualNorm : (?P<residual>\S+)(?=\s)"
        ),
        residual="previous",  # over the last element
        label="residualNorm",
    ),
    Form(
        name="MOOSE",
        signs=(" Picard |R| =", " Secant |R| =", " Steffensen |R| ="),
        words=("|R| =",),
        line=re.compile(r"(?P<iteration>\d+) \w+ \|R\| (?==)|= (?P<residual>[-+.\w]+)(?=\s)"),
        label="|R|",  # of the equations of the main application, an image of the change
        accelerator=re.compile(r"\d (Secant|Steffensen|Anderson) \|R\| ="),
        again=True,
    ),
)


def form_of(text: str) -> Form | None:
    """The form whose signs a log has; None where it has none."""
    return next((form for form in FORMS if any(sign in text for sign in form.signs)), None)


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
