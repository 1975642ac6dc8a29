"""A sweep as a labelled dataset: every value stands at its place, with units, version and problem inside."""

import json
from importlib.util import find_spec

import numpy as np
import pytest

import verification as vf
from ndtheory import __version__
from verification.sweeps import workers
from verification.sweeps.export import dataset, write_dataset
from verification.sweeps.row import RESULTS

needs_dataset = "the extra `dataset` is not installed: there is nothing to export to"
pytestmark = pytest.mark.skipif(not all(map(find_spec, ("xarray", "netCDF4"))), reason=needs_dataset)

SMALL = vf.example("section6").changed(cells=((10, 2), (8, 2)), radius="0.2", max_iterations=200)


@pytest.fixture(scope="module")
def found():
    axes = {"theta": ["0.3", "0.7"], "young": [(7e4, 2e4), (2e4, 7e4), (2e4, 2e4)], "refine": [0, 8]}
    return vf.sweep(SMALL, **axes, rule=["constant", "aitken"])


def test_each_row_stands_at_its_place_in_a_file_that_was_read_back(found, tmp_path):
    import xarray

    write_dataset(found, tmp_path / "sweep.nc")
    with xarray.open_dataset(tmp_path / "sweep.nc") as read:
        assert dict(read.sizes) == {"refine": 2, "young": 3, "rule": 2, "theta": 2}
        moduli = list(zip(read.young1.values, read.young2.values, strict=True))
        for row in found.rows:
            pair = moduli.index((row["young1"], row["young2"]))
            one = read.sel(refine=row["refine"], rule=row["rule"], theta=row["theta"]).isel(young=pair)
            for name in RESULTS:
                value = one[name].item()
                if row[name] is None:
                    assert value == "" or np.isnan(value)
                else:
                    assert value == row[name]
        assert read.attrs["source"] == f"ndtheory sweep, version {__version__}"
        assert vf.Problem.from_dict(json.loads(read.attrs["problem"])) == SMALL
        units = {name: read[name].attrs.get("units") for name in ("young1", "theta", "rho", "outcome")}
        assert units == {"young1": "MPa", "theta": "1", "rho": "1", "outcome": None}


def test_a_row_that_was_not_made_is_missing(monkeypatch):
    row = workers.row

    def interrupted(*args):
        if args[1]["theta"] > 0.5:
            raise KeyboardInterrupt
        return row(*args)

    monkeypatch.setattr(workers, "row", interrupted)
    data = dataset(vf.sweep(SMALL, theta=["0.3", "0.7"]))
    assert data.outcome.values.tolist() == ["converged", "missing"]
    assert np.isnan(data.iterations.values).tolist() == [False, True]
