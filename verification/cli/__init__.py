"""The command ``ndtheory``, and the only package that prints."""

import contextlib
import os
import sys
import warnings

try:
    from verification.machine.interrupts import undisturbed

    with undisturbed():  # an import that is interrupted may fail in any way
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a foreign package `verification`: the command says so itself
            import ndtheory  # noqa: F401
        from verification.cli.main import main
except KeyboardInterrupt:
    with contextlib.suppress(OSError):  # stderr is closed; no buffer, which would be written again at the end
        os.write(2, b"interrupted before anything was computed\n")
    sys.exit(130)

__all__ = ["main"]
