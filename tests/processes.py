"""Processes that tests start: one limit for all of them, and none outlives the test that started it."""

import os
import pty
import re
import signal
import subprocess
import sys
import textwrap
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress

#: Seconds after which a process is taken to hang.  The slowest needs a few on an idle processor; a loaded one may take
#: fifty times as long, and that is no failure.
PATIENCE = 900


#: The command line, for a fresh interpreter.
COMMAND = "import sys; from verification.cli import main; sys.exit(main())"

#: The same without matplotlib: figures that nobody looks at.
UNDRAWN = """
    import sys
    from types import SimpleNamespace
    from verification.cli import main

    drawn = lambda *args: None
    figures = dict.fromkeys(("draw_bodies", "draw_residuals", "draw_ruler", "draw_waterfall"), drawn)
    save = lambda figure, path: path.write_bytes(b"<svg><dc:title>ndtheory</dc:title></svg> Software\\0ndtheory")
    sys.modules["verification.figures"] = SimpleNamespace(save=save, **figures)
    sys.exit(main())
"""

#: The same without cvxpy too, which repeats the run.
SKETCHED = (
    """
    from verification import comparison
    from verification.contact import ContactError

    def none(run):
        raise ContactError("not asked for")

    comparison.by_cvxpy_alone = none
"""
    + UNDRAWN
)


#: What a child inherits: where programs and files are, and what `conftest` sets.
INHERITED = ("PATH", "HOME", "LANG", "TMPDIR", "SYSTEMROOT", "OPENBLAS_NUM_THREADS", "SYMPY_CACHE_SIZE")


def environment(**more: str) -> dict[str, str]:
    """The environment of a child: what else a shell exports, as PYTHONUNBUFFERED, decides how no test ends."""
    return {name: os.environ[name] for name in INHERITED if name in os.environ} | more


@contextmanager
def running(
    code: str, *arguments: object, flags: Sequence[str] = (), first: Callable[[], object] = lambda: None, **options
) -> Iterator[subprocess.Popen]:
    """A fresh interpreter in a process group of its own; at the end of the block the whole group is ended.

    It calls ``first`` before it is one.  What `nohup` or a shell in the background ignores is inherited, and ends it.
    """

    def begin() -> None:
        for number in (signal.SIGHUP, signal.SIGINT):
            signal.signal(number, signal.SIG_DFL)
        first()

    command = [sys.executable, *flags, "-c", textwrap.dedent(code), *map(str, arguments)]
    usual = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "env": environment()}
    with subprocess.Popen(command, start_new_session=True, preexec_fn=begin, **usual | options) as process:
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


#: Builds a site in each folder, warnings as errors, and prints a line: folder, status, what was said.
SITES = """
    import contextlib, io, sys
    from pathlib import Path
    from sphinx.cmd.build import build_main

    for folder in map(Path, sys.argv[1:]):
        with contextlib.redirect_stderr(io.StringIO()) as err:
            status = build_main(["-W", "-q", "-b", "html", str(folder), str(folder / "built")])
        print(folder.name, status, *err.getvalue().split())
"""


def sites(*folders: os.PathLike) -> str:
    """A line for each folder once its site is built, by one process: its name, the status, what was said on stderr."""
    answer = ended(SITES, *folders)
    assert answer.returncode == 0, answer.stderr
    return answer.stdout


def on_a_terminal(
    *arguments: object, code: str = COMMAND, columns: int = 120, streams: Sequence[str] = ("stderr",)
) -> str:
    """What the command writes to a terminal, without its movements; ``streams`` of stdout and stderr lead there."""
    leader, follower = pty.openpty()
    to = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL} | dict.fromkeys(streams, follower)
    written = b""
    with running(code, *arguments, env=environment(TERM="xterm", COLUMNS=str(columns)), **to) as process:
        os.close(follower)
        with suppress(OSError):  # the other end was closed
            while chunk := os.read(leader, 4096):
                written += chunk
        process.wait(PATIENCE)
    os.close(leader)
    assert process.returncode == 0
    return re.sub(rb"\x1b\[[0-9;?]*[a-zA-Z]", b"", written).decode()
