"""Kernels of pages as copies of the process that builds the site, with all that pages import in memory.

To start an interpreter and to import these takes 3 s of processor time a page, more than most pages compute.
"""

from __future__ import annotations

import asyncio
import logging
import math
import multiprocessing
import os
import sys
from collections.abc import Mapping, Sequence
from importlib import import_module
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

from jupyter_client.provisioning import KernelProvisionerFactory
from jupyter_client.provisioning.local_provisioner import LocalProvisioner

#: What is in memory before the first page is read.
IMPORTED = ("ipykernel.kernelapp", "matplotlib_inline.backend_inline", "cvxpy", "sympy", "verification.figures")

ROOT = Path(__file__).resolve().parents[2]


class Copy:
    """A kernel in a copy of this process, with what a provisioner asks of ``subprocess.Popen``."""

    stdin = stdout = stderr = None

    def __init__(self, arguments: Sequence[str], env: Mapping[str, str], cwd: str | os.PathLike[str]) -> None:
        work = (list(arguments), dict(env), cwd)
        self._process = multiprocessing.get_context("fork").Process(target=_become_kernel, args=work)
        self._process.start()
        self.pid = self._process.pid

    def poll(self) -> int | None:
        return self._process.exitcode

    def wait(self) -> int | None:
        self._process.join()
        return self._process.exitcode

    def send_signal(self, number: int) -> None:
        if self.poll() is None:
            os.kill(self.pid, number)


def _become_kernel(arguments: list[str], env: dict[str, str], cwd: str | os.PathLike[str]) -> None:
    from ipykernel.iostream import OutStream
    from ipykernel.kernelapp import launch_new_instance

    OutStream.flush_interval = math.inf  # a cell's output at its end, in one part: merged parts may gain an empty line

    os.environ.clear()
    os.environ.update(env)
    os.chdir(cwd)
    sys.path[:] = [folder for folder in sys.path if Path(folder).parent != ROOT]  # scripts of the site
    logging.captureWarnings(False)  # Sphinx collects them; a page shows them
    logging.root.handlers.clear()  # which a style of code has configured
    logging.root.setLevel(logging.WARNING)
    asyncio.set_event_loop(asyncio.new_event_loop())
    # It ends with the process that started it, and need not warn that it talks to this machine unencrypted.
    launch_new_instance(argv=arguments, parent_handle=os.getppid(), log_level=logging.ERROR)


class CopyProvisioner(LocalProvisioner):
    """Starts the kernel of a page as a :class:`Copy`."""

    async def launch_kernel(self, cmd: list[str], **kwargs: Any) -> dict[str, Any]:
        at = cmd.index("-m") + 2  # python [options] -m ipykernel_launcher [arguments of the kernel]
        self.cwd = kwargs.get("cwd") or Path.cwd()
        self.process = Copy(cmd[at:], kwargs.get("env") or os.environ, self.cwd)
        self.pid = self.process.pid  # no process group of its own: signals are for it alone
        return self.connection_info


def use_copies() -> None:
    """Start every kernel of this process, and of those that are forked from it, as a copy."""
    for name in IMPORTED:
        import_module(name)
    factory = KernelProvisionerFactory.instance()
    entry = EntryPoint("copy", f"{__name__}:{CopyProvisioner.__name__}", KernelProvisionerFactory.GROUP_NAME)
    factory.provisioners[entry.name] = entry
    factory.default_provisioner_name = entry.name
