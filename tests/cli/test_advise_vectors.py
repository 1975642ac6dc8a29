"""``advise vectors``: files of iterates and images, the screen, and bad files."""

import numpy as np
import pytest
import scipy.io
from advice_calls import fits

IMAGE = lambda x: 1 - np.array([0.5, 1.0, 3.0]) * (x - 1)


@pytest.fixture
def files(tmp_path):
    X = np.random.default_rng(2).normal(size=(6, 3))
    TX = np.array([IMAGE(x) for x in X])
    np.save(tmp_path / "X.npy", X)
    np.save(tmp_path / "TX.npy", TX)
    np.savez(tmp_path / "run.npz", X=X, TX=TX)
    scipy.io.savemat(tmp_path / "run.mat", {"X": X, "TX": TX})
    for name, rows in (("X", X), ("TX", TX)):
        np.savetxt(tmp_path / f"{name}.csv", rows, delimiter=",", fmt="%.17g")
    return tmp_path


@pytest.mark.parametrize("names", [["X.npy", "TX.npy"], ["run.npz"], ["run.mat"], ["X.csv", "TX.csv"]])
def test_files_of_any_kind_show_the_ends_of_the_spectrum(call, files, names):
    document = call("advise", "vectors", *(files / name for name in names), "--json").document
    assert document["spectrum"] == pytest.approx({"low": 0.5, "high": 3.0})
    assert document["theta"] == pytest.approx(0.3592, abs=1e-4)
    assert document["vectors"]["directions"] == 3


def test_the_screen_fits_and_says_what_it_advises(call, files):
    answer = call("advise", "vectors", files / "run.npz")
    fits(answer.out.splitlines())
    assert "6 iterates of 3 unknowns, 3 independent directions" in answer.out
    assert "WHICH METHOD?" in answer.out
    assert "theta = 0.3592" in answer.out
    assert 'value="0.3592"' in call("advise", "vectors", files / "run.npz", "--snippets", "preCICE").out


def test_where_another_method_is_advised_it_is_pasted_quoted_and_written_into_blocks(call, tmp_path):
    """Eigenvalues 5 to 200: IQN-ILS takes the fewest steps in these roles, a constant theta few with them exchanged."""
    stiffness, X = np.diag(np.linspace(5.0, 200.0, 12)), np.random.default_rng(3).normal(size=(13, 12))
    np.savez(tmp_path / "run.npz", X=X, TX=1 - X @ stiffness)
    words = ["advise", "vectors", tmp_path / "run.npz", "--tied"]
    document, screen = call(*words, "--json").document, call(*words).out
    assert (document["method"]["name"], document["method"]["exchanged"]) == ("constant", True)
    element = f'<acceleration:IQN-ILS><initial-relaxation value="{document["theta"]:g}" />'
    assert element in screen.partition("TO PASTE")[2]
    assert "These are the roles as they are: exchanged, constant theta is advised." in " ".join(screen.split())
    own = {row["method"]: row["steps"] for row in document["methods"] if not row["exchanged"]}
    assert f"about {own['constant']} steps to 1e-6 if the coupling is linear" in document["quote"]
    assert document["quote"].endswith(f"predicted to take {own['iqn-ils']} steps to 1e-6.")
    assert element in call(*words, "--snippets", "preCICE").out


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (["missing.npy", "TX.npy"], ["missing.npy", "no such file"]),
        (["X.npy"], ["X.npy", "needed X and TX, or one file with arrays X and TX"]),
        (["X.npy", "short.npy"], ["X.npy", "short.npy", "6 x 3 and 5 x 3", "an image for each iterate"]),
        (["X.npy", "nan.npy"], ["TX has entries that are not finite"]),
        (["one.npy", "one.npy"], ["one.npy", "two rows or more"]),
        (["X.npy", "TX.npy", "--snippets", "preCICE", "--json"], ["--snippets with --json"]),
    ],
)
def test_bad_files_get_one_line(call, files, monkeypatch, words, parts):
    np.save(files / "short.npy", np.zeros((5, 3)))
    np.save(files / "nan.npy", np.full((6, 3), np.nan))
    np.save(files / "one.npy", np.zeros((1, 3)))
    monkeypatch.chdir(files)
    complaint = call("advise", "vectors", *words).complaint
    assert [part for part in parts if part not in complaint] == []


def test_the_same_file_for_iterates_and_images_is_refused_in_one_line(call, tmp_path):
    path = tmp_path / "X.npy"
    np.save(path, np.random.default_rng(7).normal(size=(5, 3)))
    complaint = call("advise", "vectors", path, path).complaint
    assert "X.npy: T x = x for every iterate, up to rounding: each is a solution already, or X was given" in complaint
