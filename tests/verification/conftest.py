"""A comparison, and the folder that is written of it."""

import pytest
from small_result import problem

import verification as vf
from verification.output.folder import Folder


@pytest.fixture(scope="module")
def comparison():
    return vf.compare(problem())


@pytest.fixture(scope="module")
def written(comparison, tmp_path_factory):
    """A folder with everything in it."""
    folder = tmp_path_factory.mktemp("written")
    Folder(folder, "compare").write_comparison(comparison)
    return folder
