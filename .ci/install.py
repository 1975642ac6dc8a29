"""All that a lock holds, and the packages, into the environment that runs this: ``python .ci/install.py LOCK UV``.

`UV` is the uv to install first, as pip names it: uv unpacks the lock in a tenth of the processor time of pip.  It reads
none of pip's settings, so these are handed on to it.  pip itself installs where one of them has no counterpart, where
there is no wheel of uv, and where uv does not succeed.
"""

from __future__ import annotations

import ast
import os
import subprocess
import sys

#: What pip's settings are called in uv's environment.
HANDED_ON = {
    "cert": "SSL_CERT_FILE",
    "client-cert": "SSL_CLIENT_CERT",
    "find-links": "UV_FIND_LINKS",
    "index-url": "UV_DEFAULT_INDEX",
    "no-cache-dir": "UV_NO_CACHE",
    "no-index": "UV_NO_INDEX",
    "proxy": "ALL_PROXY",
    "trusted-host": "UV_INSECURE_HOST",
}

#: Settings of pip that change what it says, asks or where it keeps files, and not what is installed, nor from where.
OF_NO_MATTER = {
    "cache-dir", "config-file", "debug", "default-timeout", "disable-pip-version-check", "log", "no-color", "no-input",
    "no-python-version-warning", "progress-bar", "quiet", "require-virtualenv", "retries", "root-user-action",
    "timeout", "verbose",
}  # fmt: skip

PIP = [sys.executable, "-m", "pip", "--disable-pip-version-check"]

#: A lock holds all that is needed, so that nothing is resolved.
LOCKED = ["install", "--quiet", "--no-deps", "--editable", ".", "--requirement"]


def settings(listed: str) -> dict[str, str]:
    """What ``pip config list`` prints, as uv's environment; ValueError names a setting that cannot be handed on.

    Examples
    --------
    >>> settings("global.index-url='https://example.org/simple'\\n:env:.find-links='a b'\\n")
    {'UV_DEFAULT_INDEX': 'https://example.org/simple', 'UV_FIND_LINKS': 'a,b'}
    >>> settings("install.no-binary=':all:'")
    Traceback (most recent call last):
    ...
    ValueError: no-binary
    """
    found = {}
    for line in listed.splitlines():  # those of the environment come last, and count
        name, _, value = line.partition("=")
        name = name.rpartition(".")[2]
        if name in HANDED_ON:
            joined = "," if name == "find-links" else " "
            found[HANDED_ON[name]] = joined.join(ast.literal_eval(value).split())
        elif name not in OF_NO_MATTER:
            raise ValueError(name)
    return found


def by_uv(lock: str, uv: str) -> str:
    """Install with uv; where that does not succeed, why."""
    listed = subprocess.run([*PIP, "config", "list"], capture_output=True, text=True, check=True).stdout
    try:
        environment = settings(listed) | os.environ
    except ValueError as error:
        return f"uv has no setting like pip's {error}"
    wheel = [*PIP, "install", "--quiet", "--only-binary", ":all:", uv]
    if subprocess.run(wheel, capture_output=True, check=False).returncode:
        return f"pip finds no wheel of {uv}"
    command = [sys.executable, "-m", "uv", "pip", *LOCKED, lock, "--python", sys.executable]
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    return f"uv: {' '.join(ended.stderr.split())}" if ended.returncode else ""


def main() -> None:
    lock, uv = sys.argv[1:]
    if reason := by_uv(lock, uv):
        print(f"{reason}; pip installs {lock}, which takes longer", flush=True)
        subprocess.run([*PIP, *LOCKED, lock, "--no-compile"], check=True)  # a module is compiled when first imported
    subprocess.run([*PIP, "check"], check=True)


if __name__ == "__main__":
    try:
        main()
    except subprocess.CalledProcessError as error:  # pip has said why
        sys.exit(error.returncode)
