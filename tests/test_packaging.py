"""Which Pythons are promised, tried and run: the same in the classifiers, the workflow, the Makefile and the README."""

import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterable
from importlib.metadata import packages_distributions
from itertools import chain
from pathlib import Path
from types import SimpleNamespace

import pytest
from import_graph import PACKAGES, Import, within
from processes import ended, environment
from strategies import AT_NIGHT

import ndtheory
from verification.extras import EXTRAS

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
    [check] = re.findall(r"(?m)^check: (.*)$", read("Makefile"))
    assert {"lint", "test", "docs"} <= set(check.split())
    commands = " ".join(line for line in read(".ci/run").splitlines() if not line.lstrip().startswith("#"))
    assert ".venv/bin/python .ci/packages.py" in commands
    for target in check.split():
        assert re.search(rf"\bmake {re.escape(target).replace(re.escape('$(VENV)'), '.venv')}(?![\w-])", commands), (
            target
        )


@pytest.mark.parametrize(
    ("name", "command"), [("check", "make ${{ matrix.versions }}"), ("nightly", "make ${{ matrix.versions }} WHOLE=1")]
)
def test_the_oldest_and_the_newest_versions_are_tried_up_to_the_python_after_the_promised_ones(name, command):
    workflow = read(f".github/workflows/{name}.yml")
    after = f"3.{int(PROMISED[-1].partition('.')[2]) + 1}"
    tried = re.findall(r'\{python-version: "(3\.\d+)", versions: (\w+)\}', workflow)
    assert tried == [(PROMISED[0], "lowest"), *((version, "newest") for version in [*PROMISED, after])]
    assert f"- run: {command}\n" in workflow
    assert f"\n{' '.join(sorted({versions for _, versions in tried}))}: $(VENV)" in read("Makefile")


def test_a_part_of_the_tests_is_named_for_the_sample_of_all_versions():
    [sample] = re.findall(r"(?m)^SAMPLE := ((?:.*\\\n)*.*)$", read("Makefile"))
    files = sample.replace("\\", "").split()
    assert [name for name in files if not (ROOT / "tests" / name).is_file()] == []


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


#: Modules of a program that loads one of ours: it is there wherever that runs.
HOSTS = {"KratosMultiphysics"}


def missing(found: Iterable[Import]) -> set[str]:
    """The distributions whose modules are imported and which are no dependencies."""
    tops = {each.name.partition(".")[0] for each in found if each.kind != "name"}
    tops -= {"mpl_toolkits", *HOSTS, *PACKAGES, *sys.stdlib_module_names}
    distributions = packages_distributions()
    return {distributions[name][0].lower() for name in tops} - named(PROJECT["dependencies"])


def test_a_plain_installation_has_all_that_the_packages_import_but_for_extras_and_the_test_kit(ours):
    kit = [each for each in ours if within(each.module, "verification.testing")]
    assert missing(each for each in ours if each not in kit) == {"distributed", "xarray"}
    assert missing(kit) == {"hypothesis"}


def test_each_option_with_an_extra_names_one_that_installs_what_it_needs_and_readme_has_it():
    for option, (extra, modules) in EXTRAS.items():
        installed = " ".join(PROJECT["optional-dependencies"][extra])
        assert [name for name in modules if name not in installed] == []
        assert re.search(rf"`{extra}` .*{option}`", read("README.md"))


def test_the_page_on_installation_says_what_each_dependency_is_for():
    rows = re.findall(r"(?m)^\| ([\w, -]+) \| .*\w.* \|$", read("docs/install.md"))
    assert {name for row in rows for name in row.split(", ")} - {"library"} == named(PROJECT["dependencies"])


def test_readme_names_every_extra_and_asks_for_no_other():
    extras = set(PROJECT["optional-dependencies"])
    assert {extra for extra in extras if f"`{extra}`" in read("README.md")} == extras
    assert set(re.findall(r"pip install '?[\w.]+\[(\w+)\]", read("README.md"))) <= extras


@pytest.mark.parametrize(
    ("target", "lock"),
    [("demo", "requirements-run.lock"), ("test", "requirements-test.lock"), ("docs", "requirements.lock")],
)
def test_a_lock_is_installed_by_pip_alone_which_knows_the_settings_of_the_machine(target, lock):
    dry = ["make", "--dry-run", "--always-make", target]
    told = subprocess.run(dry, cwd=ROOT, env=environment(), capture_output=True, text=True, check=True).stdout
    [line] = [line for line in told.splitlines() if "install" in line]
    assert re.search(rf"-m pip .*install .*--no-deps .*--requirement {lock} && .* -m pip check$", line)


@pytest.mark.skipif(not AT_NIGHT, reason="every command from the wheel, in a minute or two: by night")
def test_the_wheel_runs_readme_s_list_of_commands_as_printed():
    of_pip = {name: value for name, value in os.environ.items() if name.startswith("PIP_")}
    command = [sys.executable, ".ci/packages.py", "--commands"]
    done = subprocess.run(command, cwd=ROOT, env=environment(**of_pip), capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert "commands of README's list" in done.stdout


def test_the_least_promised_python_is_the_one_that_is_needed():
    least = PROMISED[0]
    assert sorted(PROMISED, key=lambda version: int(version.partition(".")[2])) == PROMISED
    assert PROJECT["requires-python"] == f">={least}"
    assert f"Python {least} or later" in read("README.md")
    assert f"--python-version {least}" in read("Makefile")
    assert f"sys.version_info < ({least.replace('.', ', ')})" in read("Makefile")


# --- the names at the top ---

WARNED = "import ndtheory"
COMMAND = "import sys; from verification.cli import main; sys.exit(main(['bounds']))"


@pytest.fixture
def overwritten(tmp_path):
    """Run code where the first file of `verification` has another content."""

    def found(code, content):
        for name in ("fem1d2d", "ndtheory"):
            (tmp_path / name).symlink_to(ROOT / name)
        folder = tmp_path / "verification"
        folder.mkdir()
        for path in (ROOT / "verification").iterdir():
            if path.name != "__init__.py":
                (folder / path.name).symlink_to(path)
        (folder / "__init__.py").write_text(content, encoding="utf-8")
        return ended(code, cwd=tmp_path, env=environment(PYTHONPATH=str(tmp_path)))

    return found


@pytest.mark.parametrize(
    ("content", "code", "status"),
    [("", COMMAND, 2), ('__version__ = "0.0.9"\n', WARNED, 0)],
    ids=["empty", "another version"],
)
def test_a_foreign_package_named_verification_is_told_in_one_line(overwritten, content, code, status):
    found = overwritten(code, content)
    assert (found.returncode, found.stdout) == (status, "")
    [line] = found.stderr.splitlines()
    assert "a package `verification` of another distribution or version" in line
    mended = re.findall("`(pip [^`]*)`", read("docs/install.md").partition("The line says what to type:")[2])
    assert line.endswith(f"needed: {', then '.join(mended)}")


def test_our_own_package_named_verification_is_told_nowhere(overwritten):
    assert overwritten(WARNED, read("verification/__init__.py")).stderr == ""
    assert ndtheory.foreign_verification() == ""


@pytest.mark.parametrize(
    ("found", "told"),
    [
        (None, False),  # the formulas alone
        (SimpleNamespace(origin=None), True),  # a folder from which pip has uninstalled the first file
        (SimpleNamespace(origin="all.zip/verification/__init__.py"), False),
    ],
)
def test_a_folder_without_a_first_file_is_foreign_and_an_archive_is_not(monkeypatch, found, told):
    monkeypatch.setattr(ndtheory, "PathFinder", SimpleNamespace(find_spec=lambda name: found))
    assert ("a folder without __init__.py" in ndtheory.foreign_verification()) is told
