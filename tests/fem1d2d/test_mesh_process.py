"""The process that reads a mesh file: its limits, its end, and what it may import."""

import contextlib
import os
import signal
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from mesh_writer import GMSH41, write_gmsh22
from processes import PATIENCE, running

from fem1d2d import MeshError, from_file, mesh_files, mesh_reader, rectangle

MESH = rectangle((0.0, 2.0), (0.0, 1.0), (3, 2))

#: Numbers of elements or nodes that would fill 8 GB, as many strings, lines that never come: each in a few bytes.
NODE = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n1000000000 0 0 0\n$EndNodes\n$Elements\n0\n$EndElements\n"
NODES = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 1000000000 1 2\n2 1 0 1000000000\n"
SET = "*NODE\n1,0,0\n2,1,0\n*ELEMENT, TYPE=T3D2\n1,1,2\n*ELSET, ELSET=top, GENERATE\n1, 2000000000, 1\n"
STRINGS = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$NodeData\n999999999999\n"
LINES = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$NodeData\n0\n999999999999\n"


@pytest.fixture
def good(tmp_path):
    write_gmsh22(tmp_path / "good.msh", MESH.points, MESH.cells, MESH.sides)
    return tmp_path / "good.msh"


@pytest.fixture
def endless(tmp_path):
    (tmp_path / "endless.msh").write_text(LINES)
    return tmp_path / "endless.msh"


def refusal(path):
    with pytest.raises(MeshError) as caught:
        from_file(path)
    assert "\n" not in str(caught.value)
    return str(caught.value).removeprefix(f"{path}: ")


def same(found):
    return (
        np.array_equal(found.points, MESH.points)
        and np.array_equal(found.cells, MESH.cells)
        and {name: facets.tolist() for name, facets in found.sides.items()}
        == {name: facets.tolist() for name, facets in MESH.sides.items()}
    )


def test_a_mesh_comes_back_from_the_process_bit_by_bit(good):
    assert same(from_file(good))


def test_names_of_any_letters_come_back(tmp_path):
    write_gmsh22(tmp_path / "body.msh", MESH.points, MESH.cells, {"bødën ∂Ω": MESH.sides["bottom"]})
    assert list(from_file(tmp_path / "body.msh").sides) == ["bødën ∂Ω"]


def begins(monkeypatch, code):
    """The process runs this code before its script."""
    run = subprocess.run
    code += "\nimport runpy, sys\ndel sys.argv[0]\nrunpy.run_path(sys.argv[0], run_name='__main__')"
    started = lambda command: [command[0], "-P", "-c", code, *command[4:]]
    monkeypatch.setattr(subprocess, "run", lambda command, **options: run(started(command), **options))


# --- limits ---


@pytest.mark.parametrize(("name", "content"), [("body.inp", SET), ("body.msh", NODE), ("body.msh", NODES)])
def test_a_file_that_needs_too_much_memory_is_refused(tmp_path, name, content):
    (tmp_path / name).write_text(content)
    assert refusal(tmp_path / name) == "reading it needs more than 1 GB of memory"


@pytest.mark.parametrize("content", [LINES, STRINGS])
def test_a_file_that_takes_too_long_is_refused(tmp_path, monkeypatch, content):
    monkeypatch.setattr(mesh_files, "SECONDS", 1)
    monkeypatch.setattr(mesh_files, "PATIENCE", PATIENCE)  # a busy machine may keep the process waiting
    (tmp_path / "body.msh").write_text(content)
    assert refusal(tmp_path / "body.msh") == "reading it takes more than 1 s of processor time"


def test_a_process_that_waits_is_ended_by_the_clock(monkeypatch, good):
    begins(monkeypatch, "import time; time.sleep(100)")
    monkeypatch.setattr(mesh_files, "PATIENCE", 0.02)
    assert refusal(good) == "reading it takes longer than 0.2 s"


def test_the_limits_grow_with_the_file_up_to_a_largest_one(monkeypatch, tmp_path):
    given = []

    def run(command, **options):
        given.append((int(command[-2]), int(command[-1]), options["timeout"]))
        raise FileNotFoundError(2, "none")

    monkeypatch.setattr(subprocess, "run", run)
    for size in (0, 50_000_000, 10**10):
        with (tmp_path / "body.msh").open("wb") as file:
            file.truncate(size)
        assert refusal(tmp_path / "body.msh") == "no process to read it could be started: none"
    assert given == [(10, 10**9, 60), (60, 15 * 10**8, 360), (210, 3 * 10**9, 1260)]


@pytest.mark.parametrize(("ending", "status"), [("os._exit(7)", 7), ("os.kill(os.getpid(), 11)", -11)])
def test_a_process_that_dies_is_told_from_one_that_refuses(monkeypatch, good, ending, status):
    begins(monkeypatch, f"import os; {ending}")
    assert refusal(good) == f"the process that read it ended with status {status}"


def test_a_file_that_is_gone_when_the_process_opens_it_is_refused(monkeypatch, good):
    begins(monkeypatch, f"import os; os.unlink({str(good)!r})")
    assert refusal(good) == "cannot be read: No such file or directory"


# --- what it imports ---


def test_modules_beside_the_user_s_files_are_not_imported(tmp_path, monkeypatch, good):
    for name in ("numpy", "meshio", "json", "resource", "rich", "sitecustomize", "usercustomize"):
        (tmp_path / f"{name}.py").write_text(
            f"open({str(tmp_path / 'seen')!r}, 'a').write({name!r}); raise SystemExit(5)"
        )
    monkeypatch.chdir(tmp_path)
    assert same(from_file(good))
    assert same(from_file(good.name))
    assert not (tmp_path / "seen").exists()


# --- its end ---


def state(pid):
    """State and parent of a process, as Linux lists them; None where it has gone."""
    with contextlib.suppress(FileNotFoundError, ProcessLookupError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[:2]
    return None


def readers(parent):
    """The processes that a process has started."""
    return [int(pid.name) for pid in Path("/proc").glob("[0-9]*") if (state(pid.name) or [0, 0])[1] == str(parent)]


def alive(pid):
    return (state(pid) or "Z")[0] != "Z"


def until(found):
    """What a function finds, once it is anything."""
    last = time.monotonic() + PATIENCE
    while not (answer := found()):
        assert time.monotonic() < last
        time.sleep(0.01)
    return answer


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are looked up as Linux lists them")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_the_process_ends_with_its_parent(endless, number):
    with running("import sys; from fem1d2d import from_file; from_file(sys.argv[1])", endless) as parent:
        (reader,) = until(lambda: readers(parent.pid))
        os.kill(parent.pid, number)
        parent.wait(PATIENCE)
        until(lambda: not alive(reader))


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are looked up as Linux lists them")
def test_ctrl_c_ends_the_command_with_130_and_the_process_with_it(endless):
    """To the whole group, as a terminal sends it."""
    problem = endless.with_name("problem.toml")
    problem.write_text(PROBLEM)
    code = "import sys; from verification.cli import main; sys.exit(main())"
    with running(code, "run", problem, "--json") as parent:
        (reader,) = until(lambda: readers(parent.pid))
        time.sleep(0.3)
        os.killpg(parent.pid, signal.SIGINT)
        out, err = parent.communicate(timeout=PATIENCE)
        assert (parent.returncode, out, err) == (130, "", "interrupted before anything was computed\n")
        until(lambda: not alive(reader))


PROBLEM = """
[body1]
mesh = "endless.msh"
young = 1
poisson = 0
fixed = ["bottom"]
[body2]
shape = "rectangle"
x = [0, 1]
y = [0, 1]
cells = [2, 2]
young = 1
poisson = 0
prescribed = { top = [0, "-0.01"] }
[contact]
friction = 0
[iteration]
neumann_body = 2
theta = 0.5
"""


def test_threads_read_at_the_same_time(good):
    with ThreadPoolExecutor(4) as pool:
        assert all(map(same, pool.map(from_file, [good] * 4)))


def test_what_is_read_here_and_there_is_the_same(tmp_path):
    (tmp_path / "body.msh").write_text(GMSH41)
    here = mesh_reader.contents(tmp_path / "body.msh")
    there = mesh_files.read_in_process(tmp_path / "body.msh")
    assert {name: cells.tolist() for name, cells in there.surfaces.items()} == {"body": [0, 1]}
    assert (there.split, there.cut, there.plane) == (here["split"], here["cut"], here["plane"]) == ("", "", {})
    assert np.array_equal(there.points, here["points"])
    assert np.array_equal(there.triangles, here["triangles"])
    assert there.sides.keys() == here["lines"].keys()
    assert all(np.array_equal(there.sides[name], facets) for name, facets in here["lines"].items())
