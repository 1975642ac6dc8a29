"""Mutated problem files, meshes and option sets, and what the command may answer to them.

``python tests/fuzz.py 10000 3000 500 [SEED]`` tries as many of each and prints what broke a rule; tests try a few.
An answer keeps the rules if it has an exit status of 0 to 3, no traceback and no warning of a library; a refusal is one
short line and nothing on stdout; a document is valid JSON of finite numbers that obeys its own laws; within LIMIT.
"""

from __future__ import annotations

import contextlib
import io
import json
import random
import re
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from fuzz_inputs import check_arrays, keys, matrices, mesh_file, options, problem

from verification.cli import main

#: Seconds of computing for an answer, whatever else the machine does.
LIMIT = 30


class Late(BaseException):
    """No answer within LIMIT."""


@contextlib.contextmanager
def in_time() -> Iterator[None]:
    def stop(*_: object) -> None:
        raise Late

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, LIMIT)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def finite(value: Any) -> Any:
    """The numbers of a document."""
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        for item in value:
            yield from finite(item)
    elif isinstance(value, float):
        yield value


def laws(document: dict[str, Any]) -> str | None:
    """What a document says against itself."""
    if not all(np.isfinite(v) for v in finite(document)):
        return "a number that is not finite"
    kind = document["schema"].partition("/")[0].removeprefix("ndtheory.")
    if kind == "compare":
        document, kind = document["run"], "run"
    if kind in ("run", "solve"):
        if not document["kkt_residual"] <= 1e-8:
            return f"kkt_residual {document['kkt_residual']}"
        pressure = np.array(document["contact"]["pressure"])
        if len(pressure) and pressure.min() < -1e-6 * np.abs(pressure).max():
            return "tension on Gamma_c"
    if kind == "run" and document["converged"] and document["outcome"] != "converged":
        return "converged and not"
    if kind == "constants":
        loose = document["m"]["value"] == 0  # where only contact holds the contact body
        for name in ("m", "M", "rho_max", "rho_min"):
            value = 1.0 if document[name] is None else document[name]["value"]
            if not value > 0 and not (loose and value == 0 and name in ("m", "rho_min")):
                return f"{name} = {value}"
        if not document["m"]["value"] <= document["M"]["value"]:
            return "m > M"
    return None


def judge(arguments: list[str]) -> str | None:
    """The rule that the answer to a call breaks, or None."""
    out, err = io.StringIO(), io.StringIO()
    try:
        with in_time(), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = main(arguments)
    except Late:
        return f"no answer in {LIMIT} s"
    except BaseException as error:
        return f"{type(error).__name__} escapes: {error}"
    shown, said = out.getvalue(), err.getvalue()
    if status not in (0, 1, 2, 3) or "Traceback" in said:
        return f"status {status}: {said[-600:]}"
    if re.search(r"\w+Warning\b|\.py:\d+", said):
        return f"a warning of a library: {said[-600:]}"
    lines = [line for line in said.splitlines() if not line.startswith("warning: ")]
    if status == 2 and "Usage: ndtheory" not in said:
        if shown:
            return f"a refusal with {len(shown)} characters on stdout"
        if len(lines) != 1 or not lines[0].isprintable() or len(lines[0]) > 1000:
            return f"a refusal that is not one short line: {said[:600]!r}"
        named = [word for word in arguments if word.endswith("problem.toml")]
        if named and named[0] not in said and arguments[2:] == ["--json"]:
            return f"a refusal that does not name the file: {said!r}"
    if status != 2 and "--json" in arguments and "--help" not in arguments:
        try:
            return laws(json.loads(shown))
        except (ValueError, KeyError, TypeError) as error:
            return f"status {status}, no valid document: {type(error).__name__} {error}; {said[-300:]}"
    return None


KINDS = {
    "problem": problem,
    "mesh": mesh_file,
    "arrays": check_arrays,
    "options": options,
    "keys": keys,
    "matrices": matrices,
}


def attempt(kind: str, seed: int, folder: Path) -> str | None:
    """The rule that one mutated input breaks, or None."""
    draw = random.Random(f"{kind} {seed}")
    try:
        with in_time():
            made = KINDS[kind](draw, folder)
    except Late:
        return f"no answer in {LIMIT} s"
    except Exception as error:
        return f"{type(error).__name__} escapes: {error}"
    found = made if made is None or isinstance(made, str) else judge(made)
    return None if found is None else f"{kind} {seed}: {made if isinstance(made, list) else ''} {found}"


def campaign(counts: dict[str, int], first: int) -> int:
    """Try as many of each kind and print what broke a rule; returns how many did."""
    broken = 0
    with tempfile.TemporaryDirectory() as folder:
        for kind, count in counts.items():
            start, slowest, here = time.process_time(), 0.0, 0
            for seed in range(first, first + count):
                begin = time.process_time()
                complaint = attempt(kind, seed, Path(folder))
                slowest = max(slowest, time.process_time() - begin)
                if complaint:
                    here += 1
                    print(complaint, flush=True)
            print(f"{kind}: {count} tried, {here} broke a rule, slowest {slowest:.1f} s, "
                  f"{time.process_time() - start:.0f} s", flush=True)  # fmt: skip
            broken += here
    return broken


if __name__ == "__main__":
    problems, meshes, calls, *seed = map(int, sys.argv[1:])
    asked = {
        "options": calls,
        "keys": calls,
        "matrices": calls,
        "arrays": meshes // 2,
        "mesh": meshes - meshes // 2,
        "problem": problems,
    }
    sys.exit(campaign(asked, *(seed or [0])) > 0)
