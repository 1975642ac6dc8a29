"""Run the tests with many more random cases, part by part, and note in CONTRIBUTING.md when each part last passed.

    python .ci/nightly.py [PART ...]     all parts one after the other, or those that are named

A part that passed is noted with its minutes, the date and the commit, if the tree was that commit before and after.
Exit status 1 where a part failed; the parts after it are run nevertheless.
"""

import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from datetime import date
from fnmatch import fnmatch
from pathlib import Path

ROOT = Path(__file__).parents[1]
NOTES = "CONTRIBUTING.md"

#: part: what it runs, patterns of files of tests or a package with its examples; * passes folders.
PARTS = {
    "theory": ("tests/theorem/*", "tests/ndtheory/*", "ndtheory"),
    "elements": ("tests/fem1d2d/*", "fem1d2d"),
    "bodies": tuple(f"tests/verification/{name}/*" for name in ("problem", "interface", "contact", "constants")),
    "runs": tuple(f"tests/verification/{name}/*" for name in ("algorithm", "sweeps")),
    "proofs": tuple(f"tests/verification/{name}/*" for name in ("bounds", "semidefinite", "certificate", "free_norm")),
    "couplings": ("tests/verification/coupling/*",),
    "paper": (
        "tests/verification/paper/*",
        "tests/verification/showing/*",
        "tests/verification/test_*",
        "verification",
    ),
    "cli": ("tests/cli/*",),
    "docs": ("tests/docs/*", "tests/test_*"),
    "mutants": ("tests/safeguards/*",),
}

COMMAND = ("-m", "pytest", "-n", "auto", "--dist", "worksteal", "-p", "no:cacheprovider")


def matches(part: str, file: str) -> bool:
    """True if a part runs a file of tests, named from the root with /."""
    return any(fnmatch(file, pattern) for pattern in PARTS[part])


def files(root: Path) -> list[str]:
    """All files of tests."""
    return sorted(path.relative_to(root).as_posix() for path in (root / "tests").rglob("test_*.py"))


def arguments(root: Path, part: str) -> list[str]:
    """The arguments of pytest for a part."""
    packages = [pattern for pattern in PARTS[part] if (root / pattern / "__init__.py").exists()]
    return [file for file in files(root) if matches(part, file)] + packages


def tested(root: Path, given: Sequence[str]) -> bool:
    """Whether tests pass in the nightly profile."""
    environment = os.environ | {"HYPOTHESIS_PROFILE": "nightly"}
    return subprocess.run([sys.executable, *COMMAND, *given], cwd=root, env=environment).returncode == 0


def commit(root: Path) -> str | None:
    """The commit checked out, if nothing but the notes has changed since; None otherwise."""
    ask = lambda *words: subprocess.run(["git", *words], cwd=root, capture_output=True, text=True)
    try:
        head, changed = ask("rev-parse", "--short=10", "HEAD"), ask("status", "--porcelain", "--", ".", f":!{NOTES}")
    except OSError:  # without git
        return None
    return head.stdout.strip() if head.returncode == changed.returncode == 0 and not changed.stdout else None


def noted(text: str, part: str, minutes: int, day: date, at: str) -> str:
    """The text of the notes with another row for a part."""
    row = f"| {part} | {minutes} | {day} | {at} |"
    changed, count = re.subn(rf"(?m)^\| {re.escape(part)} \|.*$", row, text)
    if count != 1:
        raise ValueError(f"{NOTES}: {count} rows of the part {part}, needed one")
    return changed


def main(parts: Sequence[str], root: Path = ROOT, test: Callable[[Path, Sequence[str]], bool] = tested) -> int:
    """Run parts and note those that pass; the exit status."""
    if unknown := sorted(set(parts) - set(PARTS)):
        print(f"{', '.join(unknown)}: no part; needed some of {', '.join(PARTS)}", file=sys.stderr)
        return 2
    outcomes = {}
    for part in parts or PARTS:
        given = arguments(root, part)
        if not given:
            outcomes[part] = "has no tests"
            continue
        print(f"part {part}: {len(given)} files and packages", flush=True)
        before, begun = commit(root), time.monotonic()
        passed = test(root, given)
        minutes = round((time.monotonic() - begun) / 60 + 0.5)
        outcomes[part] = f"{'passed' if passed else 'FAILED'} within {minutes} min"
        if passed and before is not None and commit(root) == before:
            notes = root / NOTES
            notes.write_text(noted(notes.read_text("utf-8"), part, minutes, date.today(), before), "utf-8")
        elif passed:
            outcomes[part] += f"; not noted in {NOTES}, as the tree is no commit"
    for part, outcome in outcomes.items():
        print(f"part {part} {outcome}")
    return int(any(outcome.startswith("FAILED") for outcome in outcomes.values()))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
