"""A comparison, and the folder that is written of it; the store of a sweep, and the rows that are made for it."""

from importlib.util import find_spec

import pytest
from small_result import problem

import verification as vf
from verification.output.folder import Folder
from verification.sweeps import workers

#: A part of a model in Kratos is no module to import without it.
collect_ignore = [] if find_spec("KratosMultiphysics") else ["kratos_contact.py"]


@pytest.fixture(scope="session")
def comparison():
    return vf.compare(problem())


@pytest.fixture(scope="session")
def written(comparison, tmp_path_factory):
    """A folder with everything in it."""
    folder = tmp_path_factory.mktemp("written")
    Folder(folder, "compare").write(comparison)
    return folder


@pytest.fixture(autouse=True)
def in_this_process(meshes_read_here):
    """No process for each mesh file."""


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
