"""The distribution as a stranger gets it: ``python .ci/packages.py`` in the environment that runs the tests.

Builds the sdist, and from it the wheel; then, for every Python of the classifiers that lies on this machine, puts the
wheel and click into an empty environment and runs, in an empty folder, what needs nothing else: the doctests of the
package `ndtheory` and the calculator.  With the dependencies of the calling environment the wheel also iterates.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import tomllib
from pathlib import Path
from zipfile import ZipFile

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))

#: What is tracked and no part of a source distribution.
NOT_SHIPPED = {".gitignore"}

BOUNDS = ["bounds", "--m", "1", "--M", "2", "--CR", "3/2", "--CK", "1/400", "--theta", "1/10", "--json"]

#: The package on paper needs the standard library alone; only `ndtheory.symbolic` needs sympy.
DOCTESTS = """
import doctest, importlib, pkgutil, sys, ndtheory
names = [module.name for module in pkgutil.iter_modules(ndtheory.__path__, "ndtheory.") if not module.ispkg]
results = [doctest.testmod(importlib.import_module(name)) for name in names]
assert sum(result.attempted for result in results) > 0
sys.exit(sum(result.failed for result in results))
"""


def run(*command: str | Path, cwd: Path = ROOT) -> str:
    """The output of a command that ends well; one that does not ends this program."""
    alone = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "PYTHONHOME")}
    found = subprocess.run(command, cwd=cwd, env=alone, capture_output=True, text=True, check=False)
    if found.returncode:
        sys.exit(f"{' '.join(map(str, command))}: exit status {found.returncode}\n{found.stdout}{found.stderr}")
    return found.stdout


def environment(folder: Path, interpreter: str, *packages: str | Path) -> Path:
    """A new environment with what pip installs for these arguments and nothing else; its folder of commands."""
    run(interpreter, "-m", "venv", "--without-pip", folder)
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", "--python", folder / "bin" / "python"]
    run(*pip, "install", "--no-compile", "--constraint", "requirements.lock", *packages)
    return folder / "bin"


def build(work: Path) -> Path:
    """The wheel built from the sdist, which must hold all that is tracked; both ways must give the same wheel."""
    [backend] = PROJECT["build-system"]["requires"]
    hatch = [environment(work / "build", sys.executable, backend) / "python", "-m", "hatchling", "build", "-d"]
    run(*hatch, work / "tree", "-t", "sdist", "-t", "wheel")
    [source], [direct] = (work / "tree").glob("*.tar.gz"), (work / "tree").glob("*.whl")
    with tarfile.open(source) as archive:
        archive.extractall(work / "unpacked", filter="data")
    [unpacked] = (work / "unpacked").iterdir()
    if (ROOT / ".git").exists():
        tracked = set(run("git", "ls-files").splitlines()) - NOT_SHIPPED
        if missing := sorted(name for name in tracked if not (unpacked / name).is_file()):
            sys.exit(f"the sdist lacks {', '.join(missing)}")
    run(*hatch, work / "wheel", "-t", "wheel", cwd=unpacked)
    [wheel] = (work / "wheel").glob("*.whl")
    with ZipFile(direct) as one, ZipFile(wheel) as other:
        if differ := sorted(set(one.namelist()) ^ set(other.namelist())):
            sys.exit(f"in one of the wheels from the tree and from the sdist alone: {', '.join(differ)}")
        installed = {name.partition("/")[0] for name in one.namelist() if ".dist-info/" not in name}
        if installed != set(PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]):
            sys.exit(f"the wheel installs {', '.join(sorted(installed))}")
    return wheel


def interpreter(version: str) -> str | None:
    """A Python of this version: the running one, one on the PATH, or one that pyenv keeps."""
    if version == f"{sys.version_info.major}.{sys.version_info.minor}":
        return sys.executable
    candidates = [shutil.which(f"python{version}")]
    if shutil.which("pyenv"):
        candidates += sorted(map(str, Path(run("pyenv", "root").strip()).glob(f"versions/{version}.*/bin/python")))
    for candidate in filter(None, candidates):  # a shim on the PATH may lead nowhere
        if subprocess.run([candidate, "-c", "import venv"], capture_output=True, check=False).returncode == 0:
            return candidate
    return None


def main() -> None:
    versions = re.findall(r"Python :: (3\.\d+)", " ".join(PROJECT["project"]["classifiers"]))
    with tempfile.TemporaryDirectory() as name:
        work = Path(name).resolve()
        wheel = build(work)
        print(f"{wheel.name}: built from the sdist")
        empty = work / "empty"
        empty.mkdir()
        answers = set()
        for version in versions:
            python = interpreter(version)
            if python is None:
                print(f"Python {version}: not on this machine, not tried")
                continue
            commands = environment(work / version, python, "--no-deps", "click", wheel)
            run(commands / "python", "-c", DOCTESTS, cwd=empty)
            answers.add(run(commands / "ndtheory", *BOUNDS, cwd=empty))
            print(f"Python {version}: doctests of ndtheory, ndtheory bounds")
            if python == sys.executable:
                site = run(commands / "python", "-c", "import sysconfig; print(sysconfig.get_path('purelib'))").strip()
                Path(site, "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n", "utf-8")
                (empty / "my.toml").write_text(run(commands / "ndtheory", "example", "section6", cwd=empty), "utf-8")
                run(commands / "ndtheory", "run", "my.toml", "-o", "results", cwd=empty)
                print(f"Python {version}: ndtheory run")
        if len(answers) != 1:
            sys.exit(f"the calculator gives {len(answers)} different documents under {', '.join(versions)}")


if __name__ == "__main__":
    main()
