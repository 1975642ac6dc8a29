"""A problem with mesh files: written by path and content, and refused where a file has changed."""

import hashlib
import pickle

import pytest
from written_problems import BUILT_IN, MESH

import verification as vf


@pytest.fixture
def meshed(tmp_path):
    """A problem beside a mesh file of its own."""
    (tmp_path / "body.msh").write_bytes(b"a mesh")
    return vf.Problem.from_dict(BUILT_IN["section6"].to_dict() | {"body1": MESH}, str(tmp_path / "my.toml"))


def test_a_mesh_file_is_written_by_path_and_content(meshed, tmp_path):
    sha256 = hashlib.sha256(b"a mesh").hexdigest()
    assert meshed.to_dict()["body1"]["mesh"] == {"path": str(tmp_path / "body.msh"), "sha256": sha256}
    assert "shape" not in meshed.to_dict()["body1"]


@pytest.mark.parametrize("read", [vf.Problem.from_dict, lambda data: vf.Problem.from_dict(data, "/else/where.toml")])
def test_a_mesh_file_that_has_changed_is_refused_in_one_line(meshed, tmp_path, read):
    document = meshed.to_dict()
    assert read(document) == meshed
    (tmp_path / "body.msh").write_bytes(b"another mesh")
    with pytest.raises(vf.ProblemError, match="its content has changed: needed the file with sha256 ") as caught:
        read(document)
    assert caught.value.key == "body1.mesh"
    assert str(caught.value).isprintable()
    assert hashlib.sha256(b"another mesh").hexdigest() in str(caught.value)


def test_a_mesh_file_that_changes_between_reading_and_building_is_refused(meshed, tmp_path):
    (tmp_path / "body.msh").write_bytes(b"another mesh")
    for problem in (meshed, pickle.loads(pickle.dumps(meshed)), meshed.changed(friction="0.3")):
        with pytest.raises(vf.ProblemError, match="its content has changed") as caught:
            vf.measure(problem)
        assert caught.value.key == "body1.mesh"


def test_what_is_written_of_a_problem_does_not_read_its_mesh_again(meshed, tmp_path):
    document, key = meshed.to_dict(), meshed.digest
    (tmp_path / "body.msh").unlink()
    assert meshed.to_dict() == document
    assert meshed.digest == key
    assert meshed.changed(friction="0.3").body1 == meshed.body1
    assert meshed.changed(young=(5, None)).body1.young == 5


def test_the_place_of_a_mesh_is_kept_when_the_process_goes_elsewhere(meshed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    here = vf.Problem.from_dict(BUILT_IN["section6"].to_dict() | {"body1": MESH})
    (tmp_path / "deep").mkdir()
    monkeypatch.chdir(tmp_path / "deep")
    assert here == meshed
    assert vf.Problem.from_dict(here.to_dict()) == here


def test_the_same_mesh_at_another_place_has_the_same_key(meshed, tmp_path):
    (tmp_path / "copy.msh").write_bytes(b"a mesh")
    (tmp_path / "other.msh").write_bytes(b"another mesh")
    copied, other = (meshed.with_keys({"body1.mesh": name}) for name in ("copy.msh", "other.msh"))
    assert copied.digest == meshed.digest != other.digest
    assert copied != meshed


@pytest.mark.parametrize(
    ("mesh", "key", "needed"),
    [
        ("none.msh", "body1.mesh", "no such file"),
        ("", "body1.mesh", "this is a folder"),
        ("a\0b", "body1.mesh", "null"),
        (3, "body1.mesh", "a text in quotes"),
        ({}, "body1.mesh.path", "missing"),
        ({"path": "body.msh"}, "body1.mesh.sha256", "missing"),
        ({"path": "body.msh", "sha256": "abc"}, "body1.mesh.sha256", "64 hexadecimal digits"),
        ({"path": "body.msh", "sha256": 3}, "body1.mesh.sha256", "a text in quotes"),
        ({"path": "body.msh", "sha256": "0" * 64}, "body1.mesh", "its content has changed"),
        ({"path": "none.msh", "sha256": "0" * 64}, "body1.mesh", "no such file"),
        ({"path": "body.msh", "sha256": "0" * 64, "size": 3}, "body1.mesh.size", "unknown key"),
    ],
    ids=str,
)
def test_what_is_no_mesh_file_is_refused_when_the_problem_is_read(meshed, mesh, key, needed):
    with pytest.raises(vf.ProblemError) as caught:
        vf.Problem.from_dict(BUILT_IN["section6"].to_dict() | {"body1": MESH | {"mesh": mesh}}, meshed.source)
    assert caught.value.key == key
    assert needed in caught.value.needed


@pytest.mark.parametrize("side", [3, "half \ud83d", None])
def test_a_side_has_a_name_that_a_file_can_hold(meshed, side):
    for table in ({"fixed": [side]}, {"traction": {side: [0, 0]}}):
        with pytest.raises(vf.ProblemError):
            vf.Problem.from_dict(BUILT_IN["section6"].to_dict() | {"body1": MESH | table}, meshed.source)
