"""A comparison, and the folder that is written of it; the store of a sweep, and the rows that are made for it."""

import pytest
from small_result import problem

import verification as vf
from verification.output.folder import Folder
from verification.sweeps import workers


@pytest.fixture(scope="module")
def comparison():
    return vf.compare(problem())


@pytest.fixture(scope="module")
def written(comparison, tmp_path_factory):
    """A folder with everything in it."""
    folder = tmp_path_factory.mktemp("written")
    Folder(folder, "compare").write(comparison)
    return folder


@pytest.fixture
def place(tmp_path):
    """Where a sweep keeps its rows."""
    return tmp_path / "rows.sqlite"


@pytest.fixture
def made(monkeypatch):
    """The values of the rows that are made."""
    row, seen = workers.row, []
    monkeypatch.setattr(workers, "row", lambda *given: seen.append(given[1]) or row(*given))
    return seen
