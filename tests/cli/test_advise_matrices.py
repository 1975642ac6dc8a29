"""`advise` from two stiffness matrices: the advice of the problem, and what is no stiffness matrix."""

import math

import numpy as np
import pytest
import scipy.sparse as sp
from advice_calls import GOOD, ROLE, by_body, given, saved, wrong_roles


def one_array(path, matrix):
    with path.open("wb") as file:
        np.save(file, matrix)


HOW = {
    "numpy": np.savez,
    "numpy, named": lambda path, matrix: np.savez(path, stiffness=matrix),
    "compressed": np.savez_compressed,
    "Fortran order": lambda path, matrix: np.savez(path, np.asfortranarray(matrix)),
    "one array": one_array,
    "rows": lambda path, matrix: sp.save_npz(path, sp.csr_array(matrix)),
    "columns": lambda path, matrix: sp.save_npz(path, sp.csc_matrix(matrix)),
    "triplets": lambda path, matrix: sp.save_npz(path, sp.coo_array(matrix)),
}


@pytest.mark.parametrize("how", HOW)
def test_matrices_give_the_rho_of_the_problem(call, tmp_path, how):
    expected, matrices = wrong_roles()
    found = call(*given(tmp_path, *matrices, HOW[how]), "--json").document
    assert found["schema"] == "ndtheory.advice/1"
    assert found["neumann_body"] == expected["neumann_body"] == 1
    for body, role in by_body(found).items():
        assert set(role) >= ROLE
        assert role["rho"]["value"] == pytest.approx(by_body(expected)[body]["rho"]["value"], rel=1e-9)
        assert role["theta_proved"] == pytest.approx(role["theta_predicted"], rel=1e-9)  # matrices know no friction
        assert role["friction_threshold"] is None
        assert "friction" in role["reason"]["friction_threshold"]


def test_exchanged_matrices_exchange_the_advice(call, tmp_path):
    _, (S1, S2) = wrong_roles()
    found, swapped = (call(*given(tmp_path, *both), "--json").document for both in ((S1, S2), (S2, S1)))
    assert {found["neumann_body"], swapped["neumann_body"]} == {1, 2}
    turned = {3 - body: role | {"neumann_body": 3 - body} for body, role in by_body(swapped).items()}
    assert turned == by_body(found)


@pytest.mark.parametrize("unit", [1e-300, 1e-12, 1e300])
def test_the_unit_of_stiffness_does_not_change_the_advice(call, tmp_path, unit):
    _, matrices = wrong_roles()
    largest = np.abs(matrices).max()
    one, two = (call(*given(tmp_path, *both), "--json") for both in (matrices, [S / largest * unit for S in matrices]))
    assert two.err == ""
    assert one.document["neumann_body"] == two.document["neumann_body"]
    for a, b in zip(one.document["roles"], two.document["roles"], strict=True):
        assert b["rho"]["value"] == pytest.approx(a["rho"]["value"], rel=1e-9)


@pytest.mark.parametrize("times", [1e6, 1e60, 1e300])
def test_a_body_far_stiffer_than_the_other_gets_the_neumann_problem_or_is_refused(call, tmp_path, times):
    answer = call(*given(tmp_path, GOOD, GOOD * times), "--json")
    if answer.status == 2:
        assert times > 1e75
        assert "b.npz" in answer.complaint
        return
    assert (answer.status, answer.err) == (0, "")
    assert answer.document["neumann_body"] == 2
    assert by_body(answer.document)[2]["rho"]["value"] == pytest.approx(1 / times, rel=1e-9)


def test_matrices_of_whole_numbers_are_read(call, tmp_path):
    found = by_body(call(*given(tmp_path, np.diag([1, 2, 3]), np.eye(3, dtype=np.int8)), "--json").document)
    assert (found[2]["rho"]["value"], found[1]["rho"]["value"]) == pytest.approx((3, 1))


BAD = {
    "not square": (np.ones((2, 3)), ["2 x 3", "square"]),
    "a vector": (np.ones(3), ["square"]),
    "a number": (np.float64(3), ["square"]),
    "a stack": (np.ones((2, 2, 2)), ["2 x 2 x 2", "square"]),
    "not symmetric": (
        np.array([[1.0, 2.5, 0], [0, 1, 0], [0, 0, 1]]),
        ["symmetric", "u'Su = -0.25", "positive definite"],
    ),
    "indefinite": (np.diag([1.0, -1.0, 1.0]), ["indefinite", "-1", "positive definite"]),
    "of the other sign": (-GOOD, ["indefinite", "-3", "positive definite"]),
    "zero": (np.zeros((3, 3)), ["singular"]),
    "not a number": (np.diag([1.0, math.nan, 1.0]), ["finite"]),
    "infinite": (np.diag([1.0, math.inf, 1.0]), ["finite"]),
    "another size": (np.eye(4), ["3 x 3", "4 x 4", "same interface"]),
    "empty": (np.zeros((0, 0)), ["square"]),
    "complex": (1j * np.eye(3), ["complex"]),
    "complex without an imaginary part": (GOOD + 0j, ["complex"]),
    "text": (np.array([["a"]]), ["numbers"]),
    "numbers as text": (np.array([["2", "0", "0"], ["0", "2", "0"], ["0", "0", "2"]]), ["numbers"]),
    "dates": (np.eye(3).astype("M8[s]"), ["numbers"]),
    "records": (np.zeros((3, 3), dtype=[("a", float)]), ["numbers"]),
    "objects": (np.array([[None]], dtype=object), ["numpy or scipy saved"]),
    "too large": (np.zeros((4001, 4001), dtype=np.int8), ["4001", "4000"]),
}


@pytest.mark.parametrize("kind", BAD)
def test_what_is_no_stiffness_matrix_is_refused_by_name(call, tmp_path, kind):
    matrix, fragments = BAD[kind]
    complaint = call(*given(tmp_path, GOOD, matrix, np.savez_compressed)).complaint
    assert [fragment for fragment in ["b.npz", *fragments] if fragment not in complaint] == []


@pytest.mark.parametrize("matrix", [np.diag([1.0, 0.0, 1.0]), np.ones((3, 3)) + 1e-17 * GOOD])
def test_a_body_that_can_move_rigidly_is_refused_as_neumann_body_alone(call, tmp_path, matrix):
    words = given(tmp_path, GOOD, matrix)
    roles = by_body(call(*words, "--json").document)
    assert roles[1]["rho"]["value"] == pytest.approx(np.linalg.eigvals(np.linalg.solve(GOOD, matrix)).real.max())
    assert (roles[1]["singular"], roles[2]["singular"], roles[2]["rho"]) == (False, True, None)
    assert "S2 is singular" in roles[2]["reason"]["rho"]
    assert "S2 is singular" in call(*words).out
    both = call("advise", "matrices", "--S1", words[-1], "--S2", words[-1]).complaint
    assert all(words in both for words in ("b.npz", "S1 is singular", "S2 is singular", "supports"))


@pytest.mark.parametrize("kind", ["indefinite", "not symmetric", "not a number", "a vector"])
def test_the_first_matrix_is_held_to_the_same(call, tmp_path, kind):
    matrix, fragments = BAD[kind]
    complaint = call(*given(tmp_path, matrix, GOOD)).complaint
    assert [fragment for fragment in ["a.npz", "S1", *fragments] if fragment not in complaint] == []


def half(path):
    np.savez(path, GOOD)
    path.write_bytes(path.read_bytes()[:-90])


def header(path):
    """An array of 8 TB, of which the header alone is there."""
    described = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1000000, 1000000), }".ljust(117) + b"\n"
    path.write_bytes(b"\x93NUMPY\x01\x00" + len(described).to_bytes(2, "little") + described)


NO_MATRIX = {
    "text under another ending": (lambda path: path.write_text("1 2\n2 1\n"), ["numpy or scipy saved"]),
    "an empty file": (lambda path: path.write_bytes(b""), ["numpy or scipy saved"]),
    "rubbish": (lambda path: path.write_bytes(bytes(range(256)) * 8), ["numpy or scipy saved"]),
    "half a file": (half, ["numpy or scipy saved"]),
    "more than fits into memory": (header, []),
    "no array": (np.savez, ["one array", "none"]),
    "two arrays": (lambda path: np.savez(path, first=GOOD, second=GOOD), ["one array", "named S2", "first, second"]),
    "the head of a sparse one": (lambda path: np.savez(path, format="csr", shape=(2, 2)), ["numpy or scipy saved"]),
    "a sparse one of no format": (lambda path: np.savez(path, format="zzz", shape=(2, 2)), ["numpy or scipy saved"]),
    "a large sparse one": (lambda path: sp.save_npz(path, sp.csr_array((10**7, 10**7))), ["10000000", "4000"]),
    "a folder": (lambda path: path.mkdir(), ["folder"]),
    "nothing": (lambda path: None, ["no such file"]),
    "a loop": (lambda path: path.symlink_to(path.name), ["b.npz"]),
}


@pytest.mark.parametrize("kind", NO_MATRIX)
def test_files_that_hold_no_matrix_are_refused_by_name(call, tmp_path, kind):
    write, fragments = NO_MATRIX[kind]
    bad = tmp_path / "b.npz"
    write(bad)
    complaint = call("advise", "matrices", "--S1", saved(tmp_path, "a", GOOD), "--S2", bad).complaint
    assert [fragment for fragment in [str(bad), *fragments] if fragment not in complaint] == []
    assert "unsafe" not in complaint  # nobody is told to load pickles
    assert complaint.isprintable()
