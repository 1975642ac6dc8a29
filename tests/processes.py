"""Processes that tests start: one limit for all of them, and none outlives the test that started it."""

import os
import pty
import re
import signal
import subprocess
import sys
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress

#: Seconds after which a process is taken to hang.  The slowest needs a few on an idle processor; a loaded one may take
#: fifty times as long, and that is no failure.
PATIENCE = 900


#: The command line, for a fresh interpreter.
COMMAND = "import sys; from verification.cli import main; sys.exit(main())"


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


def on_a_terminal(*arguments: object, columns: int = 120, streams: Sequence[str] = ("stderr",)) -> str:
    """What the command writes to a terminal, without its movements; ``streams`` of stdout and stderr lead there."""
    leader, follower = pty.openpty()
    environment = os.environ | {"TERM": "xterm", "COLUMNS": str(columns)}
    to = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL} | dict.fromkeys(streams, follower)
    written = b""
    with running(COMMAND, *arguments, env=environment, **to) as process:
        os.close(follower)
        with suppress(OSError):  # the other end was closed
            while chunk := os.read(leader, 4096):
                written += chunk
        process.wait(PATIENCE)
    os.close(leader)
    assert process.returncode == 0
    return re.sub(rb"\x1b\[[0-9;?]*[a-zA-Z]", b"", written).decode()
