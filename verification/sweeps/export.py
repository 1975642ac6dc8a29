"""A sweep as a labelled dataset: one dimension for each axis of the grid, one variable for each result."""

from __future__ import annotations

import json
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ndtheory import __version__
from verification.extras import require
from verification.sweeps.row import COLUMNS, RESULTS, plain, title
from verification.sweeps.sweep import Sweep

if TYPE_CHECKING:
    import xarray

#: The outcome of a row that was not made.
MISSING = "missing"


def dataset(sweep: Sweep) -> xarray.Dataset:
    """Return the sweep as an :class:`xarray.Dataset`.

    Dimensions are the axes of the grid, in its order; ``young`` counts pairs, with the coordinates ``young1`` and
    ``young2``.  A row that was not made has the outcome ``missing``.  A variable with a unit has it as the attribute
    ``units``, 1 for a number without one; the dataset itself has version, units and the problem as JSON.

    Raises
    ------
    ProblemError
        xarray or netCDF4 is not installed.
    """
    require("--export")
    import xarray

    axes = sweep.grid.axes
    shape = tuple(len(values) for values in axes.values())
    units = {"1": "1"} | dict(sweep.units)

    def attributes(name: str, words: bool) -> dict[str, str]:
        return {"long_name": title(name, {})} | ({} if words else {"units": units[COLUMNS[name].unit or "1"]})

    coordinates: dict[str, Any] = {}
    for name, values in axes.items():
        if name == "young":
            coordinates["young"] = ("young", np.arange(len(values)), {"long_name": "pair of moduli"})
            for i in (1, 2):
                of_body = [float(pair[i - 1]) for pair in values]
                coordinates[f"young{i}"] = ("young", of_body, attributes(f"young{i}", False))
        else:
            found = ["auto" if value == "auto" else plain(value) for value in values]
            words = any(isinstance(value, str) for value in found)
            coordinates[name] = (name, [str(value) for value in found] if words else found, attributes(name, words))

    variables: dict[str, Any] = {}
    for name in RESULTS:
        words = COLUMNS[name].type == "text"
        flat: Any = np.full(len(sweep.grid), "" if words else np.nan, dtype=object if words else float)
        if name == "outcome":
            flat[:] = MISSING
        for place, row in zip(sweep.places, sweep.rows, strict=True):
            if row[name] is not None:
                flat[place] = row[name]
        variables[name] = (tuple(axes), flat.reshape(shape), attributes(name, words))
    about = {
        "title": sweep.summary,
        "source": f"ndtheory sweep, version {__version__}",
        "unit_of_length": sweep.units["length"],
        "unit_of_stress": sweep.units["stress"],
    }
    if sweep.problem is not None:
        about["problem"] = json.dumps(sweep.problem.to_dict())
    return xarray.Dataset(variables, coordinates, about)


def write_dataset(sweep: Sweep, path: Path) -> None:
    """Write the dataset as netCDF 4; errors as for :func:`dataset`."""
    with tempfile.TemporaryDirectory() as room:  # the library writes only where names are UTF-8
        dataset(sweep).to_netcdf(f"{room}/sweep.nc", engine="netcdf4")
        shutil.copyfile(f"{room}/sweep.nc", path)
