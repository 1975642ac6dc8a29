"""Interface files: a pair as matrices, written and read back with the same answers; and what is no such file."""

import csv
import io
import json
import zipfile

import numpy as np
import pytest
from problem_list import PROBLEMS, plates
from sample_runs import SAMPLES

import verification as vf
from verification.interface.files import NEEDED, read_interface, write_interface
from verification.output.folder import Folder
from verification.problem import ProblemError

#: All kinds: two bars, laws of both kinds, no friction, a held node, roles of both kinds.
COARSE = {
    name: problem
    for name, problem in ((name, PROBLEMS[name]) for name in SAMPLES)
    if all(body.get("shape") != "rigid" for body in (problem["body1"], problem["body2"])) and "mesh" not in str(problem)
}


@pytest.fixture(params=sorted(COARSE))
def pair(request):
    return vf.build(vf.Problem.from_dict(COARSE[request.param]))


def roles(advice):
    """The roles without what is known of a problem file only: its cells."""
    found = [role.to_dict() for role in advice.roles]
    for of in (part for role in found for part in (role, role["reason"])):
        for name in ("rho_cells", "rho_normal_cells", "cells"):
            of.pop(name, None)
    return found


def test_a_pair_that_was_written_gives_the_same_advice_and_the_same_run(pair, tmp_path):
    path = tmp_path / "interface.npz"
    write_interface(pair, path)
    other = vf.build(path)
    assert other.outside == pair.outside
    assert (other.friction, other.neumann_body) == (pair.friction, pair.neumann_body)
    if vf.measure(pair).rho_max is not None:
        assert roles(vf.advise(other)) == roles(vf.advise(pair))
    if pair.settings.relaxation == "constant":
        one, two = vf.run(pair), vf.run(path)
        assert two.history == one.history
        assert two.contact.status == one.contact.status


def coarse():
    return vf.Problem.from_dict(plates()).with_keys({"body1.cells": "[10, 2]", "body2.cells": "[6, 2]"})


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    path = tmp_path_factory.mktemp("interface") / "whole.npz"
    write_interface(vf.build(coarse()), path)
    with np.load(path) as found:
        return dict(found)


@pytest.fixture
def arrays(whole):
    """What an interface file holds."""
    return dict(whole)


@pytest.mark.parametrize("name", NEEDED)
def test_an_interface_file_without_one_of_its_arrays_is_refused(arrays, tmp_path, name):
    del arrays[name]
    np.savez(tmp_path / "part.npz", **arrays)
    with pytest.raises(ProblemError, match=f"part.npz: {name}"):
        read_interface(tmp_path / "part.npz")


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"S1": np.eye(3)}, "S1 is 3 x 3: needed 14 x 14 real numbers"),
        ({"S1": -np.eye(14)}, "positive definite"),
        ({"S1": np.full((14, 14), np.inf)}, "S1 has entries that are not finite"),
        ({"gap": np.array(["a"] * 7)}, "gap has no real numbers"),
        ({"kernel": np.eye(6)}, "kernel is 6 x 6: needed 7 x 7"),
        ({"transfer": np.eye(6)}, "transfer is 6 x 6: needed 7 x any"),
        ({"x": np.zeros(7)}, "increase"),
        ({"weights": -np.ones(7)}, "positive"),
        ({"friction": "-1"}, "friction"),
        ({"friction": "much"}, "friction"),
        ({"theta": "2"}, "theta"),
        ({"tolerance": "x"}, "x"),
        ({"tolerance": "1e400"}, 'tolerance = "1e400": needed a number with 0 < tolerance < 1'),
        ({"tolerance": "1e-400"}, "tolerance = "),
        ({"tolerance": "9" * 400}, "tolerance = "),
        ({"tolerance": "1e999999999"}, "tolerance = "),
        ({"tolerance": np.array([1e-9])}, "tolerance = "),
        ({"theta": "1e400"}, "theta = "),
        ({"friction": "1e400"}, "friction = "),
        ({"friction": "1e999999999"}, "friction = "),
        ({"friction": np.array(np.nan)}, "friction = "),
        ({"max_iterations": "1e400"}, "max_iterations = .*needed a whole number >= 1"),
        ({"max_iterations": "0"}, "max_iterations = 0: needed a whole number >= 1"),
        ({"max_iterations": "1.5"}, "max_iterations = "),
        ({"neumann_body": "3"}, "neumann_body = 3: needed one of 1, 2"),
        ({"neumann_body": "one"}, "neumann_body = "),
        ({"dimension": "3"}, "dimension = 3: needed one of 1, 2"),
        ({"law": "a\x1b[2Jb"}, "law = .*without control characters"),
        ({"outside": "\u202e"}, "outside = .*without control characters"),
        ({"load1": np.full(14, 1e308)}, "load1 has an entry of size 1e.308: needed at most 1e.60"),
        ({"S1": np.eye(14) * 1e300}, "S1 has an entry of size 1e.300"),
        ({"S2": np.eye(14) * 1e-300}, "the largest entry of S2 is 1e-300"),
        ({"transfer": np.array(1.0)}, "wrong.npz"),
        ({"x": np.array(1.0)}, "wrong.npz"),
        ({"free1": np.ones(3, dtype=bool)}, "free1"),
    ],
)
def test_an_interface_file_whose_arrays_do_not_fit_is_refused(arrays, tmp_path, changes, why):
    np.savez(tmp_path / "wrong.npz", **arrays | changes)
    with pytest.raises(ProblemError, match=why):
        read_interface(tmp_path / "wrong.npz")


@pytest.mark.parametrize("content", [b"", b"no archive", b"PK\x03\x04 nearly one"])
def test_what_is_no_interface_file_is_refused(tmp_path, content):
    path = tmp_path / "none.npz"
    path.write_bytes(content)
    with pytest.raises(ProblemError, match=r"none\.npz"):
        vf.build(path)


def test_an_interface_file_with_no_motions_of_any_shape_has_none(arrays, tmp_path):
    np.savez(tmp_path / "empty.npz", **arrays | {"motions1": np.empty(0)})
    assert vf.run(tmp_path / "empty.npz").converged


def test_an_interface_file_that_would_fill_the_memory_is_refused_by_its_headers(arrays, tmp_path):
    bomb = tmp_path / "bomb.npz"
    np.savez(bomb, **arrays)
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"shape": (10**6, 10**6), "fortran_order": False, "descr": "<f8"})
    with zipfile.ZipFile(bomb, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("unused.npy", head.getvalue() + bytes(1000))
    with pytest.raises(ProblemError, match=r"bomb\.npz: needed arrays of at most 600000000 bytes together, received 8"):
        read_interface(bomb)


@pytest.mark.parametrize(("values", "why"), [(np.eye(7) * 1j, "kernel has no real numbers"), ([["1"]], "no real")])
def test_matrices_in_memory_and_in_a_file_are_refused_in_the_same_words(arrays, tmp_path, values, why):
    np.savez(tmp_path / "wrong.npz", **arrays | {"kernel": np.array(values)})
    with pytest.raises(ProblemError, match=why) as read:
        read_interface(tmp_path / "wrong.npz")
    with pytest.raises(ValueError, match=why) as built:
        vf.build(S1=np.eye(14), S2=np.eye(14), x=np.arange(7.0), kernel=values)
    assert str(read.value).endswith(str(built.value))


# --- what a folder holds ----------------------------------------------------------------------------------------------


def rows(path):
    lines = path.read_text("utf-8").splitlines()
    assert lines[0].startswith("# ndtheory ")
    return list(csv.DictReader(lines[1:]))


def test_a_folder_holds_the_problem_the_tables_and_the_interface(arrays, tmp_path):
    problem = coarse()
    run = vf.run(problem)
    Folder(tmp_path / "run", "run").write(run)
    folder = tmp_path / "run"
    assert vf.load(folder / "problem.toml") == problem
    contact, history = rows(folder / "contact.csv"), rows(folder / "history.csv")
    assert [float(row["pressure"]) for row in contact] == run.contact.pressure.tolist()
    assert [row["status"] for row in contact] == list(run.contact.status)
    assert [float(row["relative_residual"]) for row in history] == run.history
    assert vf.run(folder / "interface.npz").history == run.history
    assert json.loads((folder / "run.json").read_text("utf-8"))["problem"] == problem.to_dict()


def test_a_problem_file_of_a_user_stays_as_it_is_and_ours_is_replaced(tmp_path):
    problem = coarse()
    there = tmp_path / "problem.toml"
    there.write_text("# mine\n" + problem.to_toml(), encoding="utf-8")
    solution = vf.solve(problem.changed(friction="1/3"))
    Folder(tmp_path, "solve").write(solution)
    assert there.read_text("utf-8").startswith("# mine")
    there.unlink()
    for found in (solution, vf.solve(problem.changed(friction="1/4"))):
        Folder(tmp_path, "solve").write(found)
        assert vf.load(there).contact.friction == found.problem.contact.friction
    assert found.problem != solution.problem
