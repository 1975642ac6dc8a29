"""Bad calls: an option, a path or a folder that cannot be one is refused by name on one short line."""

import pytest
from complaints import assert_names


@pytest.mark.parametrize(
    ("arguments", "fragments"),
    [
        ("run", ["FILE"]),
        ("run FILE FILE", ["extra argument"]),
        ("run FILE --bogus", ["--bogus"]),
        ("run FILE --refine 1", ["--refine"]),
        ("run FILE --theta", ["--theta"]),
        ("run FILE --theta nan", ["theta = nan", "0 < theta < 1"]),
        ("run FILE --theta 1/0", ["theta = 1/0", "0 < theta < 1"]),
        ("run FILE --theta -1", ["theta = -1", "0 < theta < 1"]),
        ("run FILE --theta 0", ["theta = 0", "0 < theta < 1"]),
        ("run FILE --theta 1", ["theta = 1", "0 < theta < 1"]),
        ("run FILE --theta 1e400", ["theta = 1e400", "0 < theta < 1"]),
        ("run FILE --theta=", ["theta = ", "0 < theta < 1"]),
        ("compare FILE --theta x", ["theta = x", "0 < theta < 1"]),
        ("run FILE --solver Auto", ["--solver", "Auto", "active-set"]),
        ("run FILE --swap-roles=1", ["--swap-roles"]),
        ("constants FILE --refine 9", ["constants: --refine = 9: needed a whole number from 0 to 8"]),
        ("constants FILE --refine -1", ["--refine = -1: needed a whole number from 0 to 8"]),
        ("constants FILE --refine 1.5", ["--refine = 1.5: needed a whole number from 0 to 8"]),
        ("sweep FILE --jobs 0", ["sweep: --jobs = 0: needed a whole number of at least 1"]),
        ("sweep FILE --jobs x", ["--jobs = x: needed a whole number of at least 1"]),
        ("sweep FILE --plot theta", ["--plot = theta: needed X,Y or X,Y,CURVES"]),
        ("certify FILE --norm l2", ["certify: --norm = l2: needed one of energy, lyapunov"]),
        ("run FILE --set friction", ["--set = friction: needed KEY=VALUE"]),
        ("region FILE -o plane.pdf", ["-o = plane.pdf: needed a name ending in .svg or .png"]),
        ("constants FILE --theta 0.5", ["--theta"]),
        ("example nothing", ["nothing", "section6", "two-bars"]),
        ("example section6.toml", ["section6.toml", "section6"]),
        ("example ../section6", ["../section6"]),
        ("demo FILE", ["extra argument"]),
        ("demo -o", ["-o"]),
        ("Run FILE", ["Run"]),
        ("bogus", ["bogus"]),
        ("--bogus", ["--bogus"]),
        ("bounds", ["--m"]),
        ("bounds --m 1 --M 2", ["--CR"]),
        ("bounds --m 1 --M 2 --CR 1", ["C_K"]),
        ("bounds --m 1 --M 2 --CR 1 --k 1 --Cs 1", ["C_tr"]),
        ("bounds --m 1 --M 2 --CR 1 --CK 0 --k 1", ["C_K", "k"]),
        ("bounds --m 0 --M 2 --CR 1 --CK 0", ["m = 0", "m > 0"]),
        ("bounds --m nan --M 2 --CR 1 --CK 0", ["m = nan", "m > 0"]),
        ("bounds --m 1e-400 --M 2 --CR 1 --CK 0", ["m = 1e-400", "m > 0"]),
        ("bounds --m= --M 2 --CR 1 --CK 0", ["m = ", "m > 0"]),
        ("bounds --m 3 --M 2 --CR 1 --CK 0", ["M = 2", "M >= m = 3"]),
        ("bounds --m 1 --M inf --CR 1 --CK 0", ["M = inf", "M >= m = 1"]),
        ("bounds --m 1 --M 2 --CR 0.99 --CK 0", ["C_R = 0.99", "C_R >= 1"]),
        ("bounds --m 1 --M 2 --CR 1 --CK -1", ["C_K = -1", "C_K >= 0"]),
        ("bounds --m 1 --M 2 --CR 1 --k -1 --Cs 1 --Ctr 1", ["k = -1", "k >= 0"]),
        ("bounds --m 1 --M 2 --CR 1 --CK 0 --theta 1", ["theta = 1", "0 < theta < 1"]),
        ("bounds --m 1 --M 2 --cr 1 --CK 0", ["--cr"]),
        ("bounds --m 1 --M 2 --CR 1 --CK 0 --check", ["--check", "--theta"]),
        ("bounds --m 1 --M 2 --CR 1 --CK 0 --edition Printed", ["--edition", "Printed", "repaired"]),
        ("bounds --m 1 --M 2 --CR 1 --CK 0 extra", ["extra"]),
    ],
)
def test_a_bad_call_is_refused_by_name(call, write, arguments, fragments):
    file = write()
    assert_names(call(*(str(file) if a == "FILE" else a for a in arguments.split(" "))).complaint, *fragments)


@pytest.mark.parametrize(
    ("options", "fragments"),
    [
        ("--kappa1 1", ["--m", "or --rho"]),
        ("--rho 1 --kappa1 1", ["--kappa2 missing"]),
        ("--rho 1 --k 0.2", ["--kappa1", "--kappa2", "with friction"]),
        ("--m 1 --M 2 --CR 1 --CK 1 --rho 1", ["--kappa1", "--kappa2", "with friction"]),
        ("--rho 0", ["--rho", "0", "rho > 0"]),
        ("--rho -1", ["--rho", "-1", "rho > 0"]),
        ("--rho nan", ["--rho", "nan"]),
        ("--rho 1 --kappa1 -1 --kappa2 1", ["--kappa1", "-1", ">= 0"]),
        ("--rho 1 --kappa1 1 --kappa2 nan", ["--kappa2", "nan", ">= 0"]),
        ("--rho 1 --theta 1", ["theta", "0 < theta < 1"]),
    ],
)
def test_the_edition_in_energy_norms_needs_rho_and_with_friction_both_kappas(call, options, fragments):
    assert_names(call("bounds", *options.split()).complaint, *fragments)


@pytest.mark.parametrize("folder", ["problem.toml", "problem.toml/results", "missing/../problem.toml", ""])
@pytest.mark.parametrize("command", ["run", "compare", "demo", "solve"])
def test_an_output_folder_that_cannot_be_one_is_refused_before_anything_is_computed(
    call, write, tmp_path, monkeypatch, command, folder
):
    file = write()
    (tmp_path / "missing").mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("fem1d2d.Mesh.__post_init__", None)  # a module that is imported now would keep a function
    assert_names(call(*([command] if command == "demo" else [command, file]), "-o", folder).complaint, folder, "folder")


@pytest.mark.parametrize("command", ["run", "solve", "constants", "advise"])
def test_a_path_is_not_repeated_at_length(call, command):
    line = call(command, "9" * 5000 + ".toml").complaint
    assert_names(line, "9.toml", "too long")
    assert len(line) < 700


@pytest.mark.parametrize("value", ["0.5\nx", "0.5\x1b[2Jx", "9" * 5000, "0." + "3" * 5000 + "x"], ids=lambda v: v[:8])
def test_a_theta_of_the_command_line_is_refused_on_one_short_line(call, write, value):
    line = call("run", write(), "--theta", value).complaint
    assert line.isprintable()
    assert len(line) < 700
    assert_names(line, "theta = ", "0 < theta < 1")


def test_an_id_that_resembles_no_statement_is_refused_without_a_guess(call):
    assert call("verify", "9.99").complaint == "ndtheory verify: '9.99': no such statement; `ndtheory verify` lists all"
    assert call("verify", "5.99").complaint.endswith("similar: 5.9, 5.39, 5.29")
