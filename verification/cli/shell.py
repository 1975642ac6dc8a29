"""How the shell reaches the command: by its name, or not yet."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path
from shlex import quote


def unreached() -> list[str]:
    """What to tell a user whose shell does not find, by the name ``ndtheory``, the command that was started.

    Empty where it does, and where the program was started in another way than by this command.
    """
    started = Path(sys.argv[0])
    if started.name != "ndtheory" or not started.exists():
        return []
    found = shutil.which("ndtheory")
    if found is not None and os.path.samefile(found, started):
        return []
    near = os.path.relpath(started) if started.absolute().is_relative_to(Path.cwd()) else str(started)
    activate = os.path.join(os.path.dirname(near), "activate")
    said = [f"`ndtheory` is not on the PATH of this shell: type {quote(near)} for it"]
    if os.path.exists(activate):
        said.append(f"or, once in each shell: source {quote(activate)}")
    return said
