"""Hypothesis profiles: `dev` by default, `ci` where CI is set, any by name in HYPOTHESIS_PROFILE."""

import gc
import os
import signal

import pytest
from hypothesis import settings

# Read when numpy is imported: the workers of a session share the processors, and threads of one would wait for another.
if "PYTEST_XDIST_WORKER" in os.environ:
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Read when sympy is imported: with its 1000 entries the algebra of the paper is expanded again and again.
os.environ.setdefault("SYMPY_CACHE_SIZE", "100000")

settings.register_profile("dev", deadline=None, max_examples=25)
settings.register_profile("ci", deadline=None, derandomize=True, max_examples=6)  # the same ones every time
settings.register_profile("nightly", deadline=None, max_examples=2000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE") or ("ci" if os.environ.get("CI") else "dev"))

# Helpers that assert, so that a failure shows the values as it does in a test.
pytest.register_assert_rewrite("complaints", "section_5", "pieces", "two_methods")

# A shell that runs the tests in its background lets them ignore Ctrl-C, and their children inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """What is collected lives to the end: the garbage collector need not look through it again and again.

    Of what comes after it looks through more at a time: little of it are cycles.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(50_000)
        gc.enable()


@pytest.fixture(scope="session")
def shared(tmp_path_factory):
    """``shared(key, compute)``: a value computed once in the session, for all its processes."""
    folder = tmp_path_factory.getbasetemp()
    folder = (folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder) / "shared"
    folder.mkdir(exist_ok=True)
    from shared import Shared

    return Shared(folder)


@pytest.fixture(scope="session")
def ours(shared):
    """Every import of the packages."""
    from import_graph import ours

    return shared("imports", ours)


@pytest.fixture
def decided_once(monkeypatch, shared):
    """Each form of a check is decided once in the session."""
    from shared import deciding_once

    from ndtheory.symbolic.engine import Check

    monkeypatch.setattr(Check, "decide", deciding_once(shared))


@pytest.fixture(scope="session")
def evidence(shared):
    """``evidence(source)``: what a source of the ledger finds of all statements, and the shares it told on the way."""
    from shared import deciding_once, gathered

    from ndtheory.symbolic.engine import Check

    def find(source):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(Check, "decide", deciding_once(shared))
            return shared(("evidence", source), lambda: gathered(source))

    return find


@pytest.fixture
def known_continuum(monkeypatch, shared):
    """Calibrations of one body, constants of two, and what a proof in a free norm decides, are computed once."""
    from known import continuum_once

    continuum_once(monkeypatch, shared)


@pytest.fixture
def known_bounds(monkeypatch, shared):
    """Losses and semidefinite bounds of the same bodies are computed once, where a test is not about them.

    So is what cvxpy makes of the same run.
    """
    from known import DEAR, once, repeated_once

    from verification import comparison

    for module, name in DEAR:
        monkeypatch.setattr(module, name, once(getattr(module, name), shared))
    monkeypatch.setattr(comparison, "by_cvxpy_alone", repeated_once(comparison.by_cvxpy_alone, shared))


@pytest.fixture
def meshes_read_here(monkeypatch):
    """Mesh files are read in this process: those of most tests need no limits."""
    from mesh_writer import read_here

    monkeypatch.setattr("fem1d2d.mesh_files.read_in_process", read_here)
