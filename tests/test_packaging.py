"""Which Pythons are promised, tried and run: the same in the classifiers, the workflow, the Makefile and the README."""

import re
import tomllib
from collections.abc import Iterable
from itertools import chain
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
PROMISED = re.findall(r"Python :: (3\.\d+)", " ".join(PROJECT["classifiers"]))


def read(name: str) -> str:
    return (ROOT / name).read_text("utf-8")


def test_every_promised_python_runs_the_whole_suite_in_the_workflow():
    workflow = read(".github/workflows/check.yml")
    [matrix] = re.findall(r"python: \[(.*)\]", workflow)
    assert re.findall(r'"(3\.\d+)"', matrix) == PROMISED
    assert "run: bash .ci/run" in workflow
    assert {"make check", ".venv/bin/python .ci/packages.py"} <= set(read(".ci/run").splitlines())
    [check] = re.findall(r"(?m)^check: (.*)$", read("Makefile"))
    assert {"lint", "test", "docs"} <= set(check.split())


def pinned(lock: str) -> dict[str, str]:
    """Name -> version of all that a lock holds, on every machine or on some."""
    return dict(line.partition(" ;")[0].split("==", 1) for line in read(lock).splitlines() if "==" in line)


def named(requirements: Iterable[str]) -> set[str]:
    return {re.match(r"[\w-]+", line)[0].lower() for line in requirements}


@pytest.mark.parametrize(("lock", "extras"), [("run", []), ("test", ["test"]), ("", ["test", "docs"])])
def test_a_lock_holds_what_its_extras_need_in_the_versions_of_the_whole_lock(lock, extras):
    """They are installed as they stand, with nothing resolved: `make` then runs `pip check`."""
    found, whole = pinned(f"requirements-{lock}.lock" if lock else "requirements.lock"), pinned("requirements.lock")
    assert found.items() <= whole.items()
    optional = PROJECT["optional-dependencies"]
    needed = named(PROJECT["dependencies"]).union(*(named(optional[extra]) for extra in extras))
    assert needed <= set(found)
    assert (named(chain.from_iterable(optional.values())) - needed) & set(found) <= {"mpmath"}  # sympy needs it too


def test_the_least_promised_python_is_the_one_that_is_needed():
    least = PROMISED[0]
    assert sorted(PROMISED, key=lambda version: int(version.partition(".")[2])) == PROMISED
    assert PROJECT["requires-python"] == f">={least}"
    assert f"Python {least} or later" in read("README.md")
    assert f"--python-version {least}" in read("Makefile")
    assert f"sys.version_info < ({least.replace('.', ', ')})" in read("Makefile")
