"""The distribution as a stranger gets it: ``python .ci/packages.py`` in the environment that runs the tests.

Builds the sdist and the wheel, and both once more from the sdist: the bytes must be the same.  Then, for every Python
of the classifiers and the one after them that lies on this machine, puts the wheel and click into an empty environment
and runs, in an empty folder, what needs nothing else: the doctests of the package `ndtheory` and the calculator.  With
--commands, as by night, the wheel also runs README's list of commands, as printed, with the dependencies of the calling
environment.

SOURCE_DATE_EPOCH is the date of all files in both archives, in seconds since 1970; by default that of the last commit.
"""

from __future__ import annotations

import argparse
import hashlib
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
NOT_SHIPPED = {".gitattributes", ".gitignore"}

BOUNDS = ["bounds", "--m", "1", "--M", "2", "--CR", "3/2", "--CK", "1/400", "--theta", "1/10", "--json"]

#: The package on paper needs the standard library alone; only `ndtheory.symbolic` needs sympy.
DOCTESTS = """
import doctest, importlib, pkgutil, sys, ndtheory
names = [module.name for module in pkgutil.iter_modules(ndtheory.__path__, "ndtheory.") if not module.ispkg]
results = [doctest.testmod(importlib.import_module(name)) for name in names]
assert sum(result.attempted for result in results) > 0
sys.exit(sum(result.failed for result in results))
"""


#: What a command has of the environment, on all systems.
INHERITED = ("PATH", "HOME", "LANG", "SYSTEMROOT", "USERPROFILE", "TEMP")


def listed(readme: str) -> list[str]:
    """README's list of commands, without the comments.

    >>> listed("## Commands\\n\\n    ndtheory example x > my.toml   # a file\\n    ndtheory run my.toml\\n\\nText")
    ['ndtheory example x > my.toml', 'ndtheory run my.toml']
    """
    return re.findall(r"(?m)^    (ndtheory .*?)(?: +#.*)?$", readme.partition("## Commands")[2])


#: The folder of commands in an environment.
COMMANDS = "Scripts" if os.name == "nt" else "bin"


def run(*command: str | Path, cwd: Path = ROOT, **more: str) -> str:
    """The output of a command that ends well, with more in its environment; one that does not ends this program."""
    alone = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    alone |= {"PYTHONUTF8": "1"} | more
    found = subprocess.run(command, cwd=cwd, env=alone, capture_output=True, text=True, encoding="utf-8", check=False)
    if found.returncode:
        sys.exit(f"{' '.join(map(str, command))}: exit status {found.returncode}\n{found.stdout}{found.stderr}")
    return found.stdout


def typed(command: str, path: Path, cwd: Path) -> None:
    """Run what a user types in a folder, with the commands of an environment; one that fails ends this program."""
    alone = {name: os.environ[name] for name in INHERITED if name in os.environ}
    alone["PATH"] = f"{path}{os.pathsep}{alone['PATH']}"
    found = subprocess.run(
        command, shell=True, cwd=cwd, env=alone, capture_output=True, text=True, encoding="utf-8", check=False
    )
    if found.returncode:
        sys.exit(f"{command}: exit status {found.returncode}\n{found.stdout}{found.stderr}")


def environment(folder: Path, interpreter: str, *packages: str | Path) -> Path:
    """A new environment with what pip installs for these arguments and nothing else; its folder of commands."""
    run(interpreter, "-m", "venv", "--without-pip", folder)
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", "--python", folder]
    run(*pip, "install", "--no-compile", "--constraint", "requirements.lock", *packages)
    return folder / COMMANDS


def epoch() -> str:
    """The date of the files in the archives: as the caller wishes, else that of the last commit."""
    if given := os.environ.get("SOURCE_DATE_EPOCH"):
        return given
    if (ROOT / ".git").exists():
        return run("git", "log", "-1", "--format=%ct").strip()
    return "1580601600"  # as hatchling does


def build(work: Path) -> tuple[Path, Path]:
    """The sdist, which must hold all that is tracked, and the wheel; from the sdist they must come out the same."""
    [backend] = PROJECT["build-system"]["requires"]
    hatch = [environment(work / "build", sys.executable, backend) / "python", "-m", "hatchling", "build", "-d"]
    both, date = ("-t", "sdist", "-t", "wheel"), epoch()
    run(*hatch, work / "tree", *both, SOURCE_DATE_EPOCH=date)
    [source], [wheel] = (work / "tree").glob("*.tar.gz"), (work / "tree").glob("*.whl")
    with tarfile.open(source) as archive:
        archive.extractall(work / "unpacked", filter="data")
    [unpacked] = (work / "unpacked").iterdir()
    if (ROOT / ".git").exists():
        tracked = set(run("git", "ls-files").splitlines()) - NOT_SHIPPED
        if missing := sorted(name for name in tracked if not (unpacked / name).is_file()):
            sys.exit(f"the sdist lacks {', '.join(missing)}")
    run(*hatch, work / "again", *both, cwd=unpacked, SOURCE_DATE_EPOCH=date)
    for archive in (source, wheel):
        if archive.read_bytes() != (work / "again" / archive.name).read_bytes():
            sys.exit(f"{archive.name}: built again from the sdist it has other bytes")
    with ZipFile(wheel) as inside:
        installed = {name.partition("/")[0] for name in inside.namelist() if ".dist-info/" not in name}
    if installed != set(PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]):
        sys.exit(f"the wheel installs {', '.join(sorted(installed))}")
    return source, wheel


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
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="where the sdist and the wheel stay")
    parser.add_argument("--commands", action="store_true", help="run README's list of commands, too: minutes")
    given = parser.parse_args()
    keep = given.keep
    versions = re.findall(r"Python :: (3\.\d+)", " ".join(PROJECT["project"]["classifiers"]))
    versions.append(f"3.{int(versions[-1].partition('.')[2]) + 1}")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        work = Path(name).resolve()
        source, wheel = build(work)
        print(f"{source.name}, {wheel.name}: the same bytes from the tree and from the sdist")
        if keep is not None:
            keep.mkdir(parents=True, exist_ok=True)
            for archive in (source, wheel):
                print(f"{hashlib.sha256(archive.read_bytes()).hexdigest()}  {shutil.copy(archive, keep)}")
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
            if given.commands and python == sys.executable:
                site = run(commands / "python", "-c", "import sysconfig; print(sysconfig.get_path('purelib'))").strip()
                Path(site, "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n", "utf-8")
                lines = listed((ROOT / "README.md").read_text("utf-8"))
                for line in lines:
                    typed(line, commands, empty)
                print(f"Python {version}: the {len(lines)} commands of README's list")
        if len(answers) != 1:
            sys.exit(f"the calculator gives {len(answers)} different documents under {', '.join(versions)}")


if __name__ == "__main__":
    main()
