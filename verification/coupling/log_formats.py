"""The forms of logs that are known by their signs."""

from __future__ import annotations

import re

from verification.coupling.log_lines import Form
from verification.registry import LOG_FORMATS

# The lines were read in: Kratos, convergence_criteria and convergence_accelerators of CoSimulationApplication, and logs
# of version 10.4.4; solids4foam, the sources of fluidSolidInterfaces (fluidSolidInterface.C, AitkenCouplingInterface.C,
# IQNILSCouplingInterface.C) and the output shown in its pages on fluids and solids; Norma.jl, src/evolve.jl and
# src/schwarz.jl; Feel++ (commit 03cff286), feelpp/feel/feelalg/aitken.hpp, printInfo; MOOSE, PicardSolve.C,
# SecantSolve.C and SteffensenSolve.C in framework/src/executioners, printFixedPointConvergenceHistory.
LOG_FORMATS.provide(
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
