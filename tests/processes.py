"""Processes that tests start: one limit for all of them, and none outlives the test that started it."""

import os
import signal
import subprocess
import sys
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress

#: Seconds after which a process is taken to hang.  The slowest needs a few on an idle processor; a loaded one may take
#: fifty times as long, and that is no failure.
PATIENCE = 900


@contextmanager
def running(code: str, *arguments: object, flags: Sequence[str] = (), **options) -> Iterator[subprocess.Popen]:
    """A fresh interpreter in a process group of its own; at the end of the block the whole group is ended."""
    command = [sys.executable, *flags, "-c", textwrap.dedent(code), *map(str, arguments)]
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, start_new_session=True, **streams | options) as process:
        try:
            yield process
        finally:
            with suppress(ProcessLookupError):  # all of the group have ended by themselves
                os.killpg(process.pid, signal.SIGKILL)


def ended(code: str, *arguments: object, **options) -> subprocess.CompletedProcess:
    """A fresh interpreter that has run to its end: its status, and what it wrote to streams that are pipes."""
    with running(code, *arguments, **options) as process:
        out, err = process.communicate(timeout=PATIENCE)
    return subprocess.CompletedProcess(process.args, process.returncode, out, err)
