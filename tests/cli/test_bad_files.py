"""Files that are no meshes, no matrices or without an end are refused by their fault, unread where need be."""

import io
import os
import re
import zipfile

import numpy as np
import pytest
import scipy.sparse as sp
from complaints import assert_names
from mesh_writer import write_gmsh22

from fem1d2d import rectangle
from verification.coupling.matrix_files import read_matrix

# --- files without an end ---


def endless(path, kind):
    """A pipe nobody writes to, a device, or a file of 3 GB that takes no room."""
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    else:
        with path.open("wb") as file:
            file.truncate(3 * 10**9)
    return path


ENDLESS = {"pipe": "this is a pipe or a device", "device": "this is a pipe or a device", "large": "this one has 3000"}


@pytest.mark.parametrize(("kind", "says"), ENDLESS.items())
def test_a_file_without_an_end_is_refused_unread(call, write, tmp_path, kind, says):
    endless(tmp_path / "problem.toml", kind)
    for command in ("run", "advise"):
        assert_names(call(command, tmp_path / "problem.toml").complaint, "problem.toml", says)
    endless(tmp_path / "body1.msh", kind)
    meshed = write(MESHED, "meshed.toml")
    assert_names(call("run", meshed).complaint, "meshed.toml", "body1.mesh", "body1.msh", says)
    bad = endless(tmp_path / "bad.npz", kind)
    np.save(tmp_path / "good.npy", np.eye(2))
    assert_names(call("advise", "matrices", "--S1", bad, "--S2", tmp_path / "good.npy").complaint, "bad.npz", says)


@pytest.mark.parametrize(
    ("kind", "command", "name"),
    [("pipe", "run", "run.json"), ("device", "compare", "report.html"), ("device", "solve", "bodies.svg")],
)
def test_a_result_without_an_end_is_somebody_elses(call, write, tmp_path, kind, command, name):
    (tmp_path / "results").mkdir()
    endless(tmp_path / "results" / name, kind)
    line = call(command, write(), "-o", tmp_path / "results").complaint
    assert_names(line, name, "not written by this program")


def packed(path, **headers):
    """An archive of arrays whose headers promise more than their data hold."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, (shape, kind) in headers.items():
            head = io.BytesIO()
            np.lib.format.write_array_header_1_0(head, {"shape": shape, "fortran_order": False, "descr": kind})
            archive.writestr(f"{name}.npy", head.getvalue() + bytes(10_000_000))
    return path


@pytest.mark.parametrize(
    ("headers", "says"),
    [
        ({"S": ((100_000, 100_000), "<f8")}, "needed at most 4000 rows, received 100000"),
        ({"S": ((10**12,), "<f8")}, "needed at most 4000 rows, received 1000000"),
        ({"S": ((3,), "<U300000000")}, "not a matrix"),
        ({"format": ((), "|S3"), "shape": ((2,), "<i8"), "data": ((10**11,), "<f8")}, "needed at most 4000 rows"),
    ],
)
def test_a_matrix_that_would_fill_the_memory_is_refused_by_its_header(call, tmp_path, headers, says):
    bomb = packed(tmp_path / "bomb.npz", **headers)
    assert bomb.stat().st_size < 100_000
    assert_names(call("advise", "matrices", "--S1", bomb, "--S2", bomb).complaint, "bomb.npz", says)


@pytest.mark.parametrize("blocks", [((0, 0), (0, 0, 0)), ((2, 2), (1, 0, 0)), ((2, 2), (1, 0, 2))])
def test_a_matrix_of_empty_blocks_is_refused(call, tmp_path, blocks):
    shape, data = blocks
    np.savez(
        tmp_path / "S.npz", format=np.array(b"bsr"), shape=np.array(shape), data=np.zeros(data),
        indices=np.zeros(len(np.zeros(data)), dtype=int), indptr=np.array([0, len(np.zeros(data))]),
    )  # fmt: skip
    answer = call("advise", "matrices", "--S1", tmp_path / "S.npz", "--S2", tmp_path / "S.npz")
    assert_names(answer.complaint, "S.npz", "not a matrix")


@pytest.mark.parametrize("entry", ["1.7e308", "1e300", "5e-324"])
def test_a_matrix_at_the_ends_of_the_doubles_is_judged_without_a_warning_of_numpy(call, tmp_path, entry):
    np.save(tmp_path / "S.npy", float(entry) * np.eye(3))
    np.save(tmp_path / "bad.npy", float(entry) * (np.eye(3) - 1))
    answer = call("advise", "matrices", "--S1", tmp_path / "S.npy", "--S2", tmp_path / "S.npy")
    assert (answer.status, answer.err) == (0, "")
    line = call("advise", "matrices", "--S1", tmp_path / "S.npy", "--S2", tmp_path / "bad.npy").complaint
    assert_names(line, "S2 is indefinite", "needed a positive definite matrix")


@pytest.mark.parametrize("entry", ["1.7e308", "1e300", "1e-300"])
def test_a_matrix_whose_sums_would_overflow_is_read_in_any_unit(call, tmp_path, entry):
    np.save(tmp_path / "S.npy", float(entry) * (np.eye(3) / 2 + np.ones((3, 3)) / 9))
    answer = call("advise", "matrices", "--S1", tmp_path / "S.npy", "--S2", tmp_path / "S.npy", "--json")
    assert (answer.status, answer.err) == (0, "")
    assert answer.document["roles"][0]["rho"]["value"] == pytest.approx(1, rel=1e-9)


def test_a_matrix_whose_header_is_damaged_is_refused(call, tmp_path):
    np.save(tmp_path / "S.npy", np.eye(3))
    whole = (tmp_path / "S.npy").read_bytes()
    (tmp_path / "S.npy").write_bytes(whole.replace(b"}", b"{", 1))
    assert_names(
        call("advise", "matrices", "--S1", tmp_path / "S.npy", "--S2", tmp_path / "S.npy").complaint,
        "S.npy",
        "not a matrix",
    )


#: A column outside, a negative one, a row that ends outside, a last row that does.
OUTSIDE = [([0, 10**6], [0, 1, 2]), ([0, -(10**6)], [0, 1, 2]), ([0, 1], [0, 10**6, 2]), ([0, 1], [0, 2, 10**6])]


@pytest.mark.parametrize(("indices", "indptr"), OUTSIDE)
def test_a_sparse_matrix_that_points_outside_itself_is_refused_and_not_followed(call, tmp_path, indices, indptr):
    """A process that followed would end by a signal."""
    good, bad = tmp_path / "good.npz", tmp_path / "bad.npz"
    np.savez(good, np.eye(2))
    np.savez(bad, format="csr", shape=(2, 2), data=np.ones(2), indices=np.array(indices), indptr=np.array(indptr))
    assert "bad.npz" in call("advise", "matrices", "--S1", good, "--S2", bad).complaint


@pytest.mark.parametrize("kind", ["csr", "csc", "coo", "dia", "bsr"])
def test_a_sparse_matrix_of_every_kind_is_read(tmp_path, kind):
    full = np.diag([2.0, 3.0, 4.0, 5.0]) + np.eye(4, k=1) + np.eye(4, k=-1)
    sp.save_npz(tmp_path / "S.npz", sp.coo_array(full).asformat(kind))
    assert np.array_equal(read_matrix(tmp_path / "S.npz"), full)


# --- mesh files ---


def mesh_file(path, y=(-0.3, 0.0), names=("left", "right", "bottom", "top"), lift=None, twice=False, surfaces=()):
    """The built-in rectangle as a Gmsh file.

    ``lift`` moves its upper side, ``twice`` doubles its cells, ``surfaces`` names equal parts of them.
    """
    mesh = rectangle((0.0, 2.0), y, (10, 2))
    points = mesh.points.copy()
    if lift is not None:
        upper = points[:, 1] == y[1]
        points[upper, 1] += lift(points[upper, 0])
    sides = dict(zip(names, (mesh.sides[side] for side in ("left", "right", "bottom", "top")), strict=True))
    write_gmsh22(path, points, np.tile(mesh.cells, (2 if twice else 1, 1)), sides, surfaces)


MESHED = {"body1.mesh": '"body1.msh"'} | dict.fromkeys(f"body1.{key}" for key in ("shape", "x", "y", "cells"))


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("missing.msh", None),
        ("folder.msh", "folder"),
        ("rubbish.msh", bytes(range(256))),
        ("text.msh", b"hello\nworld\n"),
        ("empty.msh", b""),
        ("text.vtu", b"<xml"),
        ("text.unheard", b"hello"),
        ("noending", b"hello"),
        ("line\nbreak.msh", b""),
    ],
    ids=lambda v: str(v)[:12],
)
def test_an_unreadable_mesh_is_refused_by_name(call, write, tmp_path, name, content):
    if content == "folder":
        (tmp_path / name).mkdir()
    elif content is not None:
        (tmp_path / name).write_bytes(content)
    escaped = name.replace("\n", "\\n")
    line = call("run", write(MESHED | {"body1.mesh": f'"{escaped}"'})).complaint
    assert_names(line, "problem.toml", "body1.mesh", name.partition("\n")[0])


@pytest.mark.parametrize(
    ("name", "content", "fragments"),
    [
        (
            "body.dat",
            'VARIABLES = "X" "Y"\nZONE N=3,E=1,F=FEPOINT,ET=TRIANGLE\n0 0\n1 0\n',
            ["(.msh)", "(.inp)", "convert"],
        ),
        ("body.e", "CDF", ["(.msh)", "(.inp)", "meshio convert -o gmsh22 FILE out.msh"]),
        ("body.inp", "*INCLUDE, INPUT=/dev/zero\n", ["it includes another file"]),
        ("body.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1000000000\n", ["more than 1 GB of memory"]),
        ("body.inp", "*NODE\n1,0,0\n*ELSET, ELSET=a, GENERATE\n1, 2000000000, 1\n", ["more than 1 GB of memory"]),
    ],
    ids=["tecplot", "exodus", "include", "nodes", "elements"],
)
def test_a_hostile_mesh_file_is_refused_within_its_limits(call, write, tmp_path, name, content, fragments):
    """Files that hung, or took all memory."""
    (tmp_path / name).write_text(content)
    line = call("run", write(MESHED | {"body1.mesh": f'"{name}"'})).complaint
    assert_names(line, "problem.toml", "body1.mesh", name, *fragments)


@pytest.mark.usefixtures("meshes_read_here")
def test_a_body_of_two_materials_is_refused_with_their_names(call, write, tmp_path):
    mesh_file(tmp_path / "body1.msh", surfaces=("rubber", "steel"))
    line = call("run", write(MESHED)).complaint
    assert_names(line, "problem.toml", "body1.mesh", "body1.msh", 'split into the groups "rubber", "steel"')
    mesh_file(tmp_path / "body1.msh", surfaces=("steel",))
    assert call("run", write(MESHED)).status == 0


@pytest.mark.usefixtures("meshes_read_here")
@pytest.mark.parametrize(
    ("changes", "fragments"),
    [
        ({"names": ("left", "right", "under", "top")}, ["body1.fixed", '"bottom"', "left, right, under, top"]),
        ({"lift": lambda x: 0.1 * x}, ["contact", "top"]),
        ({"y": (-0.2, 0.1)}, ["the bodies overlap", "y = 0.1"]),
    ],
    ids=["unknown side", "slope", "in each other"],
)
def test_a_mesh_that_does_not_fit_is_refused_by_name(call, write, tmp_path, changes, fragments):
    mesh_file(tmp_path / "body1.msh", **changes)
    assert_names(call("run", write(MESHED)).complaint, "problem.toml", *fragments)


@pytest.mark.usefixtures("meshes_read_here")
def test_a_mesh_file_cannot_be_halved_and_that_is_said_before_anything_is_measured(call, write, tmp_path, monkeypatch):
    mesh_file(tmp_path / "body1.msh")
    monkeypatch.setattr("verification.constants.measuring.largest_sparse", None)
    line = call("constants", write(MESHED), "--refine", "1").complaint
    assert_names(line, "problem.toml", "body1.mesh", "body1.msh", "halved")


@pytest.mark.usefixtures("meshes_read_here")
@pytest.mark.parametrize(
    ("command", "fault", "key", "says"),
    [
        ("run", lambda lines: [*lines, lines[0]], "mesh", "listed twice|2 times"),
        (
            "compare",  # of each side
            lambda lines: [*lines, *{line[3]: [*line[:-1], "12"] for line in lines if line[1] == "1"}.values()],
            "fixed",
            "the line 'bottom' of the file lies on no outer edge",
        ),
        ("solve", lambda lines: [*lines, lines[-1]], "mesh", "have the same nodes"),
    ],
    ids=["a line twice", "a line inside", "a cell twice"],
)
def test_a_malformed_mesh_is_refused_by_its_fault(call, write, tmp_path, command, fault, key, says):
    mesh_file(tmp_path / "body1.msh")
    head, _, rest = (tmp_path / "body1.msh").read_text().partition("$Elements\n")
    _count, *lines = rest.partition("\n$EndElements")[0].splitlines()
    lines = fault([line.split() for line in lines])
    listed = "\n".join(" ".join([str(i), *line[1:]]) for i, line in enumerate(lines, 1))
    (tmp_path / "body1.msh").write_text(f"{head}$Elements\n{len(lines)}\n{listed}\n$EndElements\n")
    line = call(command, write(MESHED)).complaint
    assert_names(line, f"problem.toml: body1.{key}", *(["body1.msh"] if key == "mesh" else []))
    assert re.search(says, line)
    assert "matching" not in line


@pytest.mark.usefixtures("meshes_read_here")
def test_a_mesh_with_every_cell_twice_is_refused_as_that(call, write, tmp_path):
    """Not for its grid on Gamma_c: no edge would be left on the boundary."""
    mesh_file(tmp_path / "body1.msh", twice=True)
    line = call("run", write(MESHED)).complaint
    assert_names(line, "body1.mesh", "have the same nodes: each cell is needed once")
    assert "matching" not in line


def test_reading_a_mesh_prints_nothing_beside_the_document(call, write, tmp_path):
    mesh_file(tmp_path / "body1.msh")
    answer = call("solve", write(MESHED), "--json")
    assert (answer.status, answer.err) == (0, "")
    assert answer.document
