"""Runs whose spectrum is known, and logs of runs in the forms that coupling codes write."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from verification.algorithm.fixed_point import FixedPointMap, iterates
from verification.algorithm.relaxation import Constant

Series = Sequence[float]

#: Eigenvalues of a tied interface, rho = 3.
MODES = (0.2, 0.5, 1.1, 3.0)


def kinds(found: Any) -> list[str]:
    """The kinds of the readings of an advice or a log."""
    return [reading.kind for reading in found.readings]


def written(path: Path, text: str | bytes, encoding: str = "utf-8") -> Path:
    """A file with this text."""
    path.write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
    return path


def linear_run(modes: Series, theta: float, steps: int) -> tuple[list[float], list[float]]:
    """Absolute and relative residuals of a tied interface with these eigenvalues, 0 for an open node."""
    eigenvalues = np.array(modes, float)
    load = np.arange(1.0, len(modes) + 1)
    x, absolute, relative = np.zeros(len(modes)), [], []
    for _ in range(steps):
        image = load - eigenvalues * x
        residual = float(np.linalg.norm(image - x))
        if not residual < 1e200:
            break
        absolute.append(residual)
        size = float(np.linalg.norm(image))
        relative.append(residual / size if size else float("inf"))
        x = x + theta * (image - x)
    return absolute, relative


def contact_run(pair: object, theta: float, steps: int) -> tuple[list[float], list[float]]:
    """The same of two bodies in contact, as Euclidean lengths of nodal forces: what a coupling library measures."""
    absolute, relative = [], []
    for state in islice(iterates(FixedPointMap(pair), Constant().begin(pair, theta, None)), steps):
        residual = float(np.linalg.norm(state.image - state.g))
        absolute.append(residual)
        size = float(np.linalg.norm(state.image))
        relative.append(residual / size if size else float("inf"))
        if not 1e-13 * max(absolute) < residual < 1e60:
            break
    return absolute, relative


def tied_run(pair: object, theta: float, steps: int) -> tuple[list[float], list[float]]:
    """The same of two bodies that are tied to each other."""
    neumann, contact = pair.neumann, pair.contact
    g, absolute, relative = np.zeros(neumann.grid.size), [], []
    for _ in range(steps):
        image = contact.load - contact.schur @ (neumann.known + neumann.flexibility(g + neumann.load))
        absolute.append(float(np.linalg.norm(image - g)))
        relative.append(absolute[-1] / float(np.linalg.norm(image)))
        g = g + theta * (image - g)
    return absolute, relative


def noisy(series: Series, share: float, seed: int) -> list[float]:
    """A series with multiplicative noise."""
    noise = np.random.default_rng(seed).normal(0, share, len(series))
    return [float(value) for value in np.array(series) * np.exp(noise)]


def precice(path: Path, windows: Sequence[dict[str, Series]], digits: int = 8) -> Path:
    """``precice-<participant>-convergence.log`` since preCICE 2.3; a window maps the names of columns to residuals."""
    width = digits + 8
    lines = ["  TimeWindow  Iteration  " + "  ".join(windows[0])]
    for window, columns in enumerate(windows, 1):
        for iteration, row in enumerate(zip(*columns.values(), strict=True), 1):
            numbers = "".join(f"{value:{width}.{digits}e}" for value in row)
            lines.append(f"{window:6d}  {iteration:6d}  {numbers}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def kratos(path: Path, windows: Sequence[dict[str, Series]], factor: Callable[[int], str] = lambda k: "0.5") -> Path:
    """What Kratos CoSimulation prints with echo_level 4, in colour."""
    green, red, plain = "\x1b[92m", "\x1b[91m", "\x1b[0m"
    lines = ["Importing  KratosCoSimulationApplication"]
    for step, columns in enumerate(windows, 1):
        lines.append(f"CoSimulationAnalysis: STEP: {step}; TIME: {0.1 * step:.2f}")
        rows = list(zip(*columns.values(), strict=True))
        for k, row in enumerate(rows, 1):
            lines.append(f"GaussSeidelStrong: {red}Coupling iteration:{plain} {k} / {len(rows)}")
            last = k == len(rows)
            for name, value in zip(columns, row, strict=True):
                verdict = f"{green}ACHIEVED{plain}" if last else f"{red}NOT ACHIEVED{plain}"
                norms = f"abs-norm = {value:.2e} | abs-tol = 1e-09 || rel-norm = {value / 7:.2e} | rel-tol = 1e-06"
                lines.append(f'RelativeNormInitialResidual: Convergence for "{name}": {verdict}\n\t {norms}')
            if not last:
                lines.append(f"ConstantRelaxation: Doing relaxation with factor =  {factor(k)}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path
