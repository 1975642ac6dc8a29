"""A convergence accelerator for CoSimulation of Kratos Multiphysics, which loads this module by its name.

Its settings, in ``convergence_accelerators``, are those of any other accelerator with a rule of this package::

    {"type": "verification.coupling.kratos", "solver": "Body1", "data_name": "force", "rule": "iqn-ils", "theta": 0.5}

It relaxes as :class:`~verification.coupling.driver.Coupling` does, and prints at the end which method the vectors
advise.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

from fem1d2d.mesh import Floats
from verification.coupling.driver import Coupling
from verification.show.layout import text

#: What begins its lines in the log, as the names of other accelerators do.
LABEL = "CouplingConvergenceAccelerator"

#: Its settings, and those that CoSimulation gives to each accelerator.
SETTINGS, COMMON = ("rule", "theta"), ("type", "echo_level", "backend")


def Create(settings: Any) -> Accelerator:
    """Return the accelerator, as CoSimulation calls it; ``settings`` are Parameters of Kratos."""
    from KratosMultiphysics import Logger

    return Accelerator(json.loads(settings.WriteJsonString()), lambda said: Logger.PrintInfo(LABEL, said))


class Accelerator:
    """Relaxation by a rule of this package, each time step anew; the names of methods are those of Kratos.

    Parameters
    ----------
    settings : mapping
        ``rule`` and ``theta`` as for :class:`~verification.coupling.driver.Coupling`, and ``echo_level``: from 1 on it
        prints advice, from 4 on its rule.
    say : callable
        Prints a text.

    Raises
    ------
    ValueError
        An unknown setting, a rule that needs both bodies or does not exist, a theta outside its range.

    Examples
    --------
    >>> import numpy as np
    >>> accelerator, g = Accelerator({"rule": "iqn-ils", "theta": 0.5}, print), np.zeros(2)
    >>> accelerator.InitializeSolutionStep()
    >>> for _ in range(4):
    ...     g = g + accelerator.UpdateSolution(np.array([1.5, 4.0]) * (1 - g), g)
    >>> bool(abs(g - 1).max() < 1e-12)
    True
    """

    def __init__(self, settings: Mapping[str, Any], say: Callable[[str], Any]) -> None:
        unknown = sorted(settings.keys() - {*SETTINGS, *COMMON})
        if unknown:
            raise ValueError(f"{LABEL}: {unknown[0]!r} is not a setting, needed {' or '.join(SETTINGS)}")
        self._chosen = {name: settings[name] for name in SETTINGS if name in settings}
        self._echo_level, self._say = settings.get("echo_level", 0), say
        self._coupling = Coupling(**self._chosen)
        self._seen = self._most = 0  # evaluations of T in this time step, and in the one with the most
        self._longest = self._coupling

    def InitializeSolutionStep(self) -> None:
        """Begin a time step: T is another map in each."""
        self._coupling, self._seen = Coupling(**self._chosen), 0

    def UpdateSolution(self, residual: Floats, guess: Floats) -> Floats:
        """Return what is added to ``guess``, the g whose residual is ``T g - g``."""
        self._seen += 1
        if self._seen > self._most:
            self._longest, self._most = self._coupling, self._seen
        if self._echo_level > 3:
            self._say(f"Relaxing by the rule {self._coupling.rule.name}")
        return self._coupling.next(guess, guess + residual) - guess

    def Finalize(self) -> None:
        """Print the advice from the vectors of the time step that had the most of them."""
        if self._echo_level < 1 or not self._most:
            return
        advice = self._longest.advice
        if advice is None:
            self._say(f"No advice: {self._most} vectors show no eigenvalue")
        else:
            self._say("Advice from the vectors of this coupling\n" + text(advice.sections()))

    def Initialize(self) -> None:
        """Do nothing, as other accelerators."""

    FinalizeSolutionStep = InitializeNonLinearIteration = FinalizeNonLinearIteration = Check = Initialize

    def PrintInfo(self) -> None:
        """Print the settings."""
        self._say(", ".join(f"{name} {value}" for name, value in self._chosen.items()) or "rule iqn-ils")

    @classmethod
    def SupportsDistributedData(cls) -> bool:
        """Return False: Kratos gathers the vectors on one process."""
        return False
