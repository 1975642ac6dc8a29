"""Optional libraries, by the extra of the package that installs them."""

from __future__ import annotations

import importlib.util

from verification.problem.tables import ProblemError

#: For each option of a command that needs an extra: its name and the modules in it.
EXTRAS = {"--export": ("dataset", ("xarray", "netCDF4")), "--dask": ("cluster", ("distributed",))}


def require(option: str) -> None:
    """Raise ProblemError for an option whose libraries are not installed, before any work is done for it."""
    extra, modules = EXTRAS[option]
    if missing := [name for name in modules if importlib.util.find_spec(name) is None]:
        verb = "is" if len(missing) == 1 else "are"
        needed = f"needed the extra `{extra}`: pip install 'ndtheory[{extra}]'"
        raise ProblemError(option, "", None, f"{' and '.join(missing)} {verb} not installed: {needed}")
