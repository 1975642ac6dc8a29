"""Windows and macOS, as far as they can be played here: what these systems lack is taken away before ours is imported.

The libraries are imported before that: each has separate code for each system.
"""

import errno
import json
import os
import signal
import sys
from types import SimpleNamespace

import pytest
from mesh_writer import write_gmsh22
from processes import ended
from strategies import AT_NIGHT

import verification as vf
from fem1d2d import mesh_reader, rectangle
from verification.cli import console
from verification.cli.console import gone

#: A Python whose modules lack what they lack on Windows; then the code of a test.
WINDOWS = """
import json, os, signal, subprocess, sys, tempfile, threading, types
import joblib, meshio, numpy, scipy.sparse.linalg, sqlite3
from joblib.externals.loky import process_executor
from multiprocessing import resource_tracker

for name in ("fcntl", "grp", "pwd", "pty", "resource", "termios", "tty"):
    sys.modules[name] = None
LACKS = {
    "signal": "ITIMER_REAL SIGALRM SIGHUP SIGKILL SIGXCPU SIG_BLOCK SIG_SETMASK pthread_sigmask setitimer",
    "os": "O_DIRECTORY fork getuid killpg sched_getaffinity setsid uname",
}
for module, names in LACKS.items():
    left = {name: what for name, what in vars(sys.modules[module]).items() if name not in names.split()}
    sys.modules[module] = types.ModuleType(module)
    vars(sys.modules[module]).update(left)

def none():
    raise ModuleNotFoundError("No module named '_posixsubprocess'")

resource_tracker.ensure_running = none
sys.path.insert(0, sys.argv.pop(1))
"""

#: A mesh from a file, a run with files over those of another run, a sweep in some processes, bad input.
USED = """
from verification.cli import main

drawn = dict.fromkeys(("draw_bodies", "draw_residuals", "draw_ruler"), lambda *given: None)
save = lambda figure, path: path.write_bytes(b"<svg><dc:title>ndtheory</dc:title></svg> Software\\0ndtheory")
sys.modules["verification.figures"] = types.SimpleNamespace(save=save, **drawn)
said = [main(["run", "plate.toml", "-o", "found"]) for _ in range(2)]
said.append(main(["sweep", "grid.toml", "--jobs", sys.argv[1]]))
said.append(main(["run", "nowhere.toml"]))
print(json.dumps(said), file=sys.stderr)
"""

PLATE = """
[body1]
mesh = "plate.msh"
young = 1
poisson = 0.25
fixed = ["bottom"]
[body2]
shape = "rectangle"
x = [0, 2]
y = [1, 2]
cells = [2, 1]
young = 2
poisson = 0.25
prescribed.top = [0, -0.01]
[contact]
friction = 0.1
law = "local"
[iteration]
theta = 0.5
"""


def test_where_windows_lacks_functions_files_are_read_and_written_and_processes_work(tmp_path):
    mesh = rectangle((0.0, 2.0), (0.0, 1.0), (2, 1))
    write_gmsh22(tmp_path / "plate.msh", mesh.points, mesh.cells, mesh.sides)
    (tmp_path / "plate.toml").write_text(PLATE)
    (tmp_path / "grid.toml").write_text('problem = "plate.toml"\n[grid]\ntheta = [0.4, 0.5]\n')
    done = ended(WINDOWS + USED, os.getcwd(), 2 if AT_NIGHT else 1, cwd=tmp_path)
    assert json.loads(done.stderr.splitlines()[-1]) == [0, 0, 0, 2], done.stderr
    assert "Traceback" not in done.stderr
    assert {"run.json", "body1.vtu", "residuals.svg"} <= {path.name for path in (tmp_path / "found").iterdir()}
    rows = [line for line in (tmp_path / "grid.csv").read_text("utf-8").splitlines() if not line.startswith("#")]
    assert [line.partition(",")[0] for line in rows] == ["theta", "0.4", "0.5"]


@pytest.mark.parametrize(("name", "there"), [("nt", True), ("posix", False)])
def test_a_pipe_that_is_closed_is_an_invalid_argument_on_windows_alone(monkeypatch, name, there):
    monkeypatch.setattr(console, "os", SimpleNamespace(name=name))
    assert gone(OSError(errno.EINVAL, "Invalid argument")) is there
    assert not gone(OSError(errno.EINVAL, "Invalid argument", "a file.csv"))
    assert gone(BrokenPipeError())


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_problem_file_is_read_as_the_shells_of_windows_write_it(tmp_path, encoding, end):
    bars = vf.example("two-bars").to_toml()
    (tmp_path / "my.toml").write_bytes(bars.replace("\n", end).encode(encoding))
    assert vf.load(tmp_path / "my.toml").to_toml() == bars


def test_where_macos_refuses_a_limit_the_others_are_set(monkeypatch):
    """It has the name of the limit on memory, and takes no value for it."""
    limits = {}

    def set_limit(what, values):
        if what == "memory":
            raise ValueError("current limit exceeds maximum limit")
        limits[what] = values

    macos = SimpleNamespace(
        RLIMIT_CPU="time", RLIMIT_AS="memory", RLIMIT_CORE="core", RLIM_INFINITY=-1,
        getrlimit=lambda what: (-1, -1), setrlimit=set_limit,
    )  # fmt: skip
    monkeypatch.setitem(sys.modules, "resource", macos)
    mesh_reader.limit(3, 10**9)
    assert limits == {"time": (3, 8), "core": (0, 0)}


def test_every_name_taken_away_is_one_that_this_system_has():
    """Else nothing is played: a name that is misspelt would take nothing away."""
    if sys.platform == "linux":
        names = "SIGALRM SIGXCPU SIG_BLOCK pthread_sigmask setitimer"
        assert [name for name in names.split() if not hasattr(signal, name) or name not in WINDOWS] == []
