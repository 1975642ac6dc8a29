"""Libraries that a plain installation goes without, by the extra that installs them."""

from __future__ import annotations

import importlib.util

from verification.problem.tables import ProblemError

#: The extra of each option of a command that needs one, and the modules that it needs.
EXTRAS = {"--export": ("dataset", ("xarray", "netCDF4")), "--dask": ("cluster", ("distributed",))}


def require(option: str) -> None:
    """Refuse an option whose libraries are not installed, before any work is done for it.

    Raises
    ------
    ProblemError
    """
    extra, modules = EXTRAS[option]
    if missing := [name for name in modules if importlib.util.find_spec(name) is None]:
        verb = "is" if len(missing) == 1 else "are"
        needed = f"needed the extra `{extra}`: pip install 'ndtheory[{extra}]'"
        raise ProblemError(option, "", None, f"{' and '.join(missing)} {verb} not installed: {needed}")
