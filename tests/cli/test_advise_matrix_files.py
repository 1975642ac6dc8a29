"""`advise` from files of every kind, with friction and between grids; matrices that are no Schur complement."""

import zlib

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp
from advice_calls import GOOD, by_body, fits, given, saved, wrong_roles

import verification as vf
from verification.coupling.matrix_files import read_matrix
from verification.interface.pair import pair_from

# --- other kinds of files ---------------------------------------------------------------------------------------------

FULL = np.array([[4.0, 1.0, 0.5], [1.0, 3.0, -0.25], [0.5, -0.25, 2.0]])


def text(separator, end="", before=""):
    rows = "\n".join(separator.join(map(repr, row)) + end for row in FULL.tolist())
    return lambda path: path.write_text(f"{before}{rows}\n", "utf-8")


WRITTEN = {
    "a.npy": lambda path: np.save(path, FULL),
    "b.npz": lambda path: np.savez(path, other=np.eye(7), S2=FULL),
    "c.mtx": lambda path: scipy.io.mmwrite(path, FULL, symmetry="symmetric"),
    "d.mtx": lambda path: scipy.io.mmwrite(path, FULL, symmetry="general"),
    "e.mtx": lambda path: scipy.io.mmwrite(path, sp.coo_array(FULL), symmetry="symmetric"),
    "f.mtx": lambda path: scipy.io.mmwrite(path, sp.coo_array(FULL), symmetry="general"),
    "g.mat": lambda path: scipy.io.savemat(path, {"anything": FULL}),
    "h.mat": lambda path: scipy.io.savemat(path, {"S2": FULL, "S1": np.eye(3)}, do_compression=True),
    "i.mat": lambda path: scipy.io.savemat(path, {"S2": sp.csc_array(FULL), "x": 1.0}),
    "j.mat": lambda path: scipy.io.savemat(path, {"S2": FULL}, format="4"),
    "k.csv": text(","),
    "l.csv": text("; ", end=";"),
    "m.txt": text(" "),
    "n.txt": text("\t", before="# K\u00f6rper\n\n% columns\n"),
    "o.CSV": lambda path: path.write_bytes(
        b"\xef\xbb\xbf" + b"\r\n".join(b",".join(b"%.17g" % v for v in r) for r in FULL)
    ),
}


@pytest.mark.parametrize("name", WRITTEN)
def test_a_matrix_is_read_from_every_kind_of_file(tmp_path, name):
    WRITTEN[name](tmp_path / name)
    assert np.array_equal(read_matrix(tmp_path / name, "S2"), FULL)


def compressed(path):
    """A MATLAB file of a few kB that unpacks to 40 MB; whoever reads it all finds a false checksum at the end."""
    scipy.io.savemat(path, {"S2": FULL})
    data = zlib.compressobj(9)
    first, other = (data.compress(bytes(10**6)) + data.flush(zlib.Z_FULL_FLUSH) for _ in range(2))
    block = first + 39 * other + data.flush()
    head = path.read_bytes()[:128]
    path.write_bytes(head + np.array([15, len(block)], dtype="<u4").tobytes() + block)


def hdf5(path):
    path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + bytes(384) + b"\x89HDF\r\n\x1a\n" + bytes(64))


MARKET = "%%MatrixMarket matrix "


def text_of(content):
    return lambda path: path.write_text(content)


HOSTILE = {
    "a.mat": (hdf5, ["7.3", "HDF5", "'-v7'"]),
    "b.mat": (compressed, ["unpacks to at most"]),
    "c.mat": (lambda path: path.write_bytes(b""), ["MATLAB or scipy"]),
    "d.mat": (lambda path: path.write_bytes(b"x" * 400), ["MATLAB or scipy"]),
    "e.mat": (lambda path: scipy.io.savemat(path, {}), ["one array", "none"]),
    "f.mat": (lambda path: scipy.io.savemat(path, {"K": FULL, "M": FULL}), ["named S2", "K, M"]),
    "g.mat": (lambda path: scipy.io.savemat(path, {"S2": "text"}), ["real numbers"]),
    "h.mat": (lambda path: scipy.io.savemat(path, {"S2": {"a": FULL}}), ["real numbers"]),
    "i.mat": (lambda path: scipy.io.savemat(path, {"S2": FULL * 1j}), ["complex"]),
    "j.mat": (lambda path: scipy.io.savemat(path, {"S2": sp.csc_array((10**6, 10**6))}), ["1000000", "4000"]),
    "p.mtx": (lambda path: scipy.io.mmwrite(path, FULL * 1j), ["complex", "real"]),
    "k.mtx": (text_of(MARKET + "coordinate real general\n3 3 9\n1 1 1\n"), ["Market"]),
    "l.mtx": (text_of(MARKET + "coordinate real general\n9 9 99999999999\n1 1 1\n"), ["4000"]),
    "m.mtx": (text_of(MARKET + "array real general\n1000000 1000000\n1\n"), ["1000000", "4000"]),
    "n.mtx": (text_of("1 2\n2 1\n"), ["Market"]),
    "o.mtx": (text_of(MARKET + "coordinate pattern symmetric\n2 2 1\n1 1\n"), ["pattern", "real"]),
    "q.mtx": (text_of(MARKET + "coordinate real general\n2 2 1\n5 5 1\n"), ["Market"]),
    "r.csv": (text_of("a,b\n1,2\n2,3\n"), ["line 1", "'a'", "header", "delete"]),
    "s.csv": (text_of("1,2\n2,x\n"), ["line 2", "'x'", "needed a number"]),
    "t.csv": (text_of("1,2\n2\n"), ["line 2", "1 numbers", "needed 2"]),
    "u.csv": (text_of("1,5;2,0\n2,0;3,0\n"), ["line 1", "decimal comma"]),
    "v.csv": (text_of("1,,2\n"), ["line 1", "''"]),
    "w.csv": (text_of("# nothing\n\n"), ["rows of numbers", "none"]),
    "x.csv": (text_of(",".join("1" * 4001) + "\n"), ["4001", "4000"]),
    "y.txt": (text_of("1\n" * 4001), ["4001", "4000"]),
    "z.txt": (lambda path: path.write_bytes(bytes(range(256))), ["text"]),
    "a.h5": (lambda path: path.write_bytes(b"x"), [".npy", ".mat", ".csv"]),
    "none": (lambda path: path.write_bytes(b"x"), [".npy", ".mat", ".csv"]),
    "b.csv": (lambda path: path.mkdir(), ["folder"]),
    "c.mtx": (lambda path: None, ["no such file"]),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_file_of_another_kind_that_holds_no_matrix_is_refused_in_one_line(call, tmp_path, monkeypatch, name):
    monkeypatch.setattr("verification.coupling.matrix_files.MOST_BYTES", 24 * 1264**2)  # of 24 * 4000**2
    write, fragments = HOSTILE[name]
    bad = tmp_path / name
    write(bad)
    # of one file for both its names may be asked for first
    for S1, parts in ((saved(tmp_path, "good", GOOD), [name, *fragments]), (bad, [name])):
        complaint = call("advise", "matrices", "--S1", S1, "--S2", bad).complaint
        assert [part for part in parts if part not in complaint] == []
        assert complaint.isprintable()
        assert len(complaint) < 1000


@pytest.mark.parametrize("ending", ["npz", "mat"])
def test_one_file_may_hold_both_matrices(call, tmp_path, ending):
    both, named = tmp_path / f"both.{ending}", dict(zip(("S1", "S2"), wrong_roles()[1], strict=True))
    np.savez(both, **named) if ending == "npz" else scipy.io.savemat(both, named)
    single = given(tmp_path, *named.values())
    expected = call(*single, "--json").document
    for words in (("--S1", both), ("--S1", both, "--S2", both), ("--S1", both, "--S2", single[-1])):
        assert call("advise", "matrices", *words, "--json").document == expected


# --- what is not a Schur complement -----------------------------------------------------------------------------------


@pytest.mark.parametrize("skew", [1e-9, 1e-6, 0.9e-3, 1.1e-3])
def test_an_asymmetry_is_rounded_told_or_taken(call, tmp_path, skew):
    skewed = FULL.copy()
    skewed[0, 1] += skew * 4
    words = given(tmp_path, skewed, GOOD)
    document = call(*words, "--json").document
    assert document["matrices"]["S1"]["asymmetry"] == pytest.approx(skew)
    told = [note for note in document["matrices"]["notes"] if "asymmetric" in note]
    assert len(told) == (skew > 1e-8)
    assert ("asymmetric by" in call(*words).out) == (skew > 1e-8)
    symmetric = call(*given(tmp_path, (skewed + skewed.T) / 2, GOOD), "--json").document
    same = 1e-14 if skew < 1e-3 else 1e-6  # of a larger asymmetry the eigenvalues of the matrix as it is
    assert document["roles"][0]["rho"]["value"] == pytest.approx(symmetric["roles"][0]["rho"]["value"], rel=same)


def test_an_assembled_matrix_is_told_from_a_condensed_one(call, tmp_path):
    """Both are positive definite: nothing but the zeros speaks."""
    body = pair_from(vf.example("section6-60")).body1
    sp.save_npz(tmp_path / "K.npz", body.mesh_body.stiffness)
    whole = call("advise", "matrices", "--S1", tmp_path / "K.npz", "--S2", tmp_path / "K.npz")
    assert whole.status == 0
    assert "assembled" in whole.out
    assert max(map(len, whole.out.splitlines())) <= 80
    assert "assembled" not in call(*given(tmp_path, body.schur, 2 * body.schur)).out


def test_decoupled_components_are_not_taken_for_an_assembled_matrix(call, tmp_path):
    """Three components that do not act on each other leave two thirds of zeros."""
    block = np.kron(np.eye(3), np.ones((9, 9)) + np.eye(9))
    found = call(*given(tmp_path, block, block), "--json").document
    assert found["matrices"]["notes"] == []
    assert found["matrices"]["S1"]["zeros"] == pytest.approx(2 / 3, abs=0.03)


# --- friction, maps, whole interfaces ---------------------------------------------------------------------------------


def same_advice(found, expected):
    assert found["neumann_body"] == expected["neumann_body"]
    assert len(found["roles"]) == len(expected["roles"])
    for role in expected["roles"]:
        other = by_body(found)[role["neumann_body"]]
        for name in ("rho", "factor_proved", "theta_max_proved", "friction_threshold"):
            assert other[name]["value"] == pytest.approx(role[name]["value"], rel=1e-7), name
        assert other["theta_proved"] == pytest.approx(role["theta_proved"], rel=1e-5)  # where the factor is flat


@pytest.fixture
def run_folder(call, write, quick, tmp_path):
    """A run of the small problem, with its interface file."""
    file = write({"contact.friction": "0.1"})
    call("run", file, "-o", tmp_path / "results")
    return file, tmp_path / "results"


def test_an_interface_file_is_read_whole_wherever_it_is_given(call, run_folder):
    file, results = run_folder
    expected = call("advise", file, "--json").document
    name = results / "interface.npz"
    for words in ((name,), ("matrices", "--S1", name), ("matrices", "--S1", name, "--S2", name)):
        same_advice(call("advise", *words, "--json").document, expected)
    assert "an interface file has all of it" in call("advise", "matrices", "--S1", name, "--friction", "0.2").complaint


def test_matrices_with_friction_give_the_advice_of_the_problem(call, run_folder, tmp_path):
    file, results = run_folder
    expected = call("advise", file, "--json").document
    radius = str(vf.load(file).contact.radius)
    with np.load(results / "interface.npz") as arrays:
        parts = {name: arrays[name] for name in ("S1", "S2", "x", "weights", "kernel")}
    for name, array in parts.items():
        np.save(tmp_path / f"{name}.npy", array)
    np.savetxt(tmp_path / "x.csv", parts["x"][None], delimiter=",", fmt="%.17g")
    place = lambda name: tmp_path / f"{name}.npy"
    both = ("--S1", place("S1"), "--S2", place("S2"), "--friction", "1/10", "--json")
    for words in (
        ("--x", place("x"), "--radius", radius),
        ("--x", tmp_path / "x.csv", "--radius", radius),
        ("--kernel", place("kernel"), "--weights", place("weights")),
        ("--kernel", place("kernel"), "--x", place("x")),
    ):
        found = call("advise", "matrices", *both, *words).document
        same_advice(found, expected)
        assert "tangential" in found["matrices"]["ordering"]


LACKING = [
    ("--friction 0.1", "needed a radius with x, or a kernel"),
    ("--friction 0.1 --radius 0.1", "needed x"),
    ("--friction 0.1 --x x.npy", "needed a radius with x, or a kernel"),
    ("--friction 0.1 --x x.npy --radius 0.1 --kernel k.npy", "not both"),
    ("--friction 0.1 --kernel k.npy", "needed weights of its nodes, or x"),
    ("--friction 0.1 --weights x.npy", "needed a radius with x, or a kernel"),
    ("--x x.npy", "x without friction"),
    ("--radius 0.1", "radius without friction"),
    ("--kernel k.npy", "kernel without friction"),
    ("--weights x.npy", "weights without friction"),
    ("--friction -1 --x x.npy --radius 0.1", "--friction = -1: needed a number >= 0"),
    ("--friction much --x x.npy --radius 0.1", "--friction = much: needed a number >= 0"),
    ("--friction 0.1 --x x.npy --radius 0", "--radius = 0: needed a number > 0"),
    ("--friction 0.1 --x x.npy --radius wide", "--radius = wide: needed a number > 0"),
    ("--friction 0.1 --x long.npy --radius 0.1", "x is a vector of 3: needed 2 real numbers"),
    ("--friction 0.1 --x back.npy --radius 0.1", "needed positions that increase"),
    ("--friction 0.1 --kernel k.npy --weights back.npy", "weights: needed positive ones"),
    ("--friction 0.1 --kernel long.npy --weights x.npy", "kernel is a vector of 3: needed 2 x 2"),
    ("--friction 0.1 --kernel k.npy --weights x.npy --map P.npy", "P.npy"),
    ("--map P.npy", "the transfer is 3 x 4, S1 has 4 rows, S2 4"),
    ("--map k.npy --neumann-body 3", "--neumann-body"),
]


@pytest.mark.parametrize(("words", "fragment"), LACKING)
def test_a_combination_that_lacks_or_mixes_something_is_one_clear_line(call, tmp_path, monkeypatch, words, fragment):
    monkeypatch.chdir(tmp_path)
    for name, array in {
        "S": np.diag([1.0, 2.0, 3.0, 4.0]),
        "x": np.array([0.5, 1.0]),
        "back": np.array([1.0, -1.0]),
        "long": np.array([0.0, 1.0, 2.0]),
        "k": np.eye(2),
        "P": np.ones((3, 4)),
    }.items():
        np.save(f"{name}.npy", array)
    assert fragment in call("advise", "matrices", "--S1", "S.npy", "--S2", "S.npy", *words.split()).complaint


@pytest.mark.parametrize("option", ["--S2", "--map", "--x", "--kernel", "--weights", "--friction", "--radius"])
def test_what_belongs_to_matrices_needs_matrices(call, tmp_path, option):
    complaint = call("advise", option, saved(tmp_path, "a", GOOD)).complaint
    assert f"{option} is an option of ndtheory advise matrices" in complaint
    value = {"--friction": "0.1", "--radius": "0.1"}.get(option, saved(tmp_path, "a", GOOD))
    assert "Missing option '--S1'" in call("advise", "matrices", option, value).complaint


def test_friction_of_an_odd_number_of_unknowns_is_refused(call, tmp_path):
    a = saved(tmp_path, "a", GOOD)
    np.save(tmp_path / "x.npy", np.arange(3.0))
    words = ("--friction", "0.1", "--x", tmp_path / "x.npy", "--radius", "1")
    assert "two components at each node" in call("advise", "matrices", "--S1", a, "--S2", a, *words).complaint


@pytest.fixture
def of_two_grids(call, write, quick, tmp_path):
    """A run between grids that differ, with P.npz."""
    file = write({"body2.cells": "[5, 2]", "contact.friction": "0.1"})
    answer = call("run", file, "-o", tmp_path / "results")
    assert answer.status in (0, 1), answer
    return file, tmp_path / "results"


def test_the_map_of_a_run_gives_the_role_it_leads_to_and_refuses_the_other(call, of_two_grids, tmp_path):
    file, results = of_two_grids
    neumann = vf.load(file).iteration.neumann_body
    expected = by_body(call("advise", file, "--json").document)[neumann]
    with np.load(results / "interface.npz") as arrays:
        both = tmp_path / "both.npz"
        np.savez(both, S1=arrays["S1"], S2=arrays["S2"])
        np.save(tmp_path / "kernel.npy", arrays["kernel"])
    words = ("advise", "matrices", "--S1", both, "--map", results / "P.npz")
    found = by_body(call(*words, "--json").document)
    assert found[neumann]["rho"]["value"] == pytest.approx(expected["rho"]["value"], rel=1e-9)
    assert found[3 - neumann]["rho"] is None
    assert "its own transfer" in found[3 - neumann]["reason"]["rho"]
    assert "its own transfer" in " ".join(call(*words).out.split())
    radius = str(vf.load(file).contact.radius)
    for law in (
        ("--radius", radius),  # positions and weights of both grids stand in P.npz
        ("--kernel", tmp_path / "kernel.npy"),
    ):
        rubbing = by_body(call(*words, "--friction", "0.1", *law, "--json").document)
        for name in ("rho", "friction_threshold", "factor_proved"):
            assert rubbing[neumann][name]["value"] == pytest.approx(expected[name]["value"], rel=1e-7)
        assert "its own transfer" in rubbing[3 - neumann]["reason"]["rho"]


@pytest.mark.parametrize("words", [(), ("--friction", "0.1")])
def test_the_screen_says_which_ordering_is_assumed_and_fits(call, tmp_path, words):
    _, matrices = wrong_roles()
    np.save(tmp_path / "x.npy", np.linspace(0, 1, len(matrices[0]) // 2))
    rest = ("--x", tmp_path / "x.npy", "--radius", "0.3") if words else ()
    out = call(*given(tmp_path, *matrices), *words, *rest).out
    folded = " ".join(out.split())
    assert ("Ordering: any" in folded) == (not words)
    assert ("tangential components from left to right" in folded) == bool(words)
    fits(out.splitlines())
