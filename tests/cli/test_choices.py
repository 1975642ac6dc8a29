"""`advise`, `region`, `--theta auto`, the sharp bound of `bounds`, and the relaxation rules from a file."""

import itertools
import json
import math
import re
import shlex
import signal
from xml.etree import ElementTree

import numpy as np
import pytest
import scipy.sparse as sp
from problem_list import SMALL, edited

import verification as vf
from ndtheory import PRINTED, REPAIRED, EnergyConstants, evaluate, evaluate_sharp
from verification.algorithm import runs
from verification.bounds import bound
from verification.bounds import region as plane
from verification.bounds.bound import NotComputed
from verification.bounds.semidefinite import SemidefiniteBound
from verification.cli.problems import examples
from verification.interface.assembly import build

ROLE = {
    "neumann_body",
    "rho",
    "theta_proved",
    "factor_proved",
    "theta_max_proved",
    "theta_predicted",
    "rate_predicted",
    "friction_threshold",
    "singular",
}
PROVED = {"theta_proved", "factor_proved", "theta_max_proved", "friction_threshold"}

#: A mesh of 20 nodes, the roles such that runs converge, stall and run away.
COARSE = {"body1.cells": "[5, 1]", "body2.cells": "[3, 1]", "contact.radius": "0.5", "iteration.neumann_body": "2"}


def saved(folder, name: str, matrix, how=np.savez):
    path = folder / f"{name}.npz"
    how(path, matrix)
    return path


def by_body(document):
    return {role["neumann_body"]: role for role in document["roles"]}


def pasted(screen: str) -> str:
    """The theta below the last heading, the same in both lines to paste."""
    place = screen.partition("TO PASTE\n")[2]
    plain = re.search(r"^ +theta = (\S+)$", place, flags=re.M)[1]
    assert f'<acceleration:constant><relaxation value="{plain}" /></acceleration:constant>' in place
    return plain


# --- advise, from a problem ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "edits", [None, "without friction", "wrong roles", "local law", "soft upper body", "stiff upper body"], ids=str
)
def test_advice_follows_rho_of_both_roles_and_names_the_smaller_rate(call, write, edits):
    file = write(edits)
    found = call("advise", file, "--json").document
    assert found["schema"] == "ndtheory.advice/1"
    problem = vf.load(file)
    for role, roles in zip(found["roles"], (problem, problem.swapped()), strict=True):
        assert set(role) >= ROLE
        assert role["neumann_body"] == roles.iteration.neumann_body
        measured = vf.measure(roles)
        rho = (measured.rho_normal if edits == "without friction" else measured.rho_max).value
        assert role["rho"]["value"] == pytest.approx(rho, rel=1e-12)
        assert role["theta_predicted"] == pytest.approx(2 / (2 + rho), rel=1e-12)
        assert role["rate_predicted"] == pytest.approx(rho / (2 + rho), rel=1e-12)
        assert role["singular"] is False
        assert {name for name in ROLE if role[name] is None} <= set(role["reason"])
    best = min(found["roles"], key=lambda role: role["rate_predicted"])
    assert found["neumann_body"] == best["neumann_body"] == (2 if edits == "stiff upper body" else 1)


@pytest.mark.parametrize("edits", [None, "without friction", "local law", "stiff upper body"], ids=str)
def test_the_advice_does_not_depend_on_the_role_that_the_file_gives(call, write, edits):
    file = write(edits)
    text = file.read_text(encoding="utf-8")
    other = write({"iteration.neumann_body": "2"}, "other.toml", text)
    a, b = call("advise", file, "--json").document, call("advise", other, "--json").document
    assert a["neumann_body"] == b["neumann_body"]
    assert by_body(a) == by_body(b)
    assert a["roles"] == b["roles"][::-1]


@pytest.mark.parametrize("neumann_body", [1, 2])
def test_where_both_roles_are_the_same_the_file_keeps_its_own(call, write, neumann_body):
    same = {"body1.x": "[0.4, 1.6]", "body1.cells": "[6, 2]", "body2.young": "7.0e4", "body2.cells": "[6, 2]"}
    file = write(same | {"iteration.neumann_body": str(neumann_body)})
    found = call("advise", file, "--json").document
    one, two = (role["rho"]["value"] for role in found["roles"])
    assert one == pytest.approx(two, rel=1e-9)
    assert found["neumann_body"] in (1, 2)
    if one == two:
        assert found["neumann_body"] == neumann_body


def test_advice_on_two_bars_is_that_of_their_stiffnesses(call, write):
    found = by_body(call("advise", write(text=examples()["two-bars"]), "--json").document)
    for body, rho in ((2, 3), (1, 1 / 3)):  # S = E/L is 3 and 1
        assert found[body]["rho"]["value"] == pytest.approx(rho, rel=1e-12)
        assert found[body]["theta_proved"] == pytest.approx(2 / (2 + rho), rel=1e-12)
        assert found[body]["factor_proved"]["value"] == pytest.approx(rho / (2 + rho), rel=1e-12)
        assert found[body]["theta_max_proved"]["value"] == pytest.approx(min(2 / (1 + rho), 1), rel=1e-12)


def test_without_friction_the_prediction_is_proved(call, write):
    for role in call("advise", write("without friction"), "--json").document["roles"]:
        assert role["theta_proved"] == pytest.approx(role["theta_predicted"], rel=1e-9)
        assert role["factor_proved"]["value"] == pytest.approx(role["rate_predicted"], rel=1e-9)
        assert role["friction_threshold"] is None
        assert "friction_threshold" in role["reason"]


@pytest.mark.parametrize("friction", ["0.05", "0.2", "0.4"])
def test_the_proved_theta_is_that_of_the_theorem_in_energy_norms(call, write, friction):
    file = write({"contact.friction": friction})
    problem = vf.load(file)
    for role, roles in zip(call("advise", file, "--json").document["roles"], (problem, problem.swapped()), strict=True):
        measured = vf.measure(roles)
        sharp = evaluate_sharp(measured.energy_constants())
        assert role["friction_threshold"]["value"] == measured.friction_threshold.value
        if sharp.interval is None:
            assert {role[name] for name in PROVED - {"friction_threshold"}} == {None}
            continue
        assert role["theta_proved"] == sharp.theta_proved
        assert role["factor_proved"]["value"] == sharp.factor_proved.value < 1
        assert role["theta_max_proved"]["value"] == sharp.interval[1]
        for theta in (0.9 * sharp.theta_proved, min(1.1 * sharp.theta_proved, 0.999)):
            beside = evaluate_sharp(measured.energy_constants(), theta).factor
            assert beside is None or beside.value > sharp.factor_proved.value


def test_nothing_is_proved_of_the_local_law(call, write):
    found = call("advise", write("local law"), "--json").document
    for role in found["roles"]:
        assert {role[name] for name in PROVED} == {None}
        assert all("local" in role["reason"][name] for name in PROVED)
    assert any("local" in reason for reason in found["outside_theorem"])
    screen = call("advise", write("local law")).out
    assert "Outside the theorem: the local Coulomb law" in screen
    assert "proved     -" in screen


def test_bodies_that_hold_different_components_get_no_advice_and_are_told_why(call, write):
    complaint = call("advise", write("held tangentially")).complaint
    assert "problem.toml: contact" in complaint
    assert "different tangential components" in complaint


@pytest.mark.parametrize("edits", [None, "wrong roles", "without friction"], ids=str)
def test_what_is_pasted_is_the_advice_and_the_next_line_runs_it(call, write, edits):
    file = write(edits)
    answer = call("advise", file)
    found = call("advise", file, "--json").document
    best = by_body(found)[found["neumann_body"]]
    assert pasted(answer.out) == f"{best['theta_predicted']:.3g}"
    assert f"  neumann_body = {found['neumann_body']}\n" in answer.out
    assert ("--swap-roles" in answer.out) == (edits == "wrong roles")
    following = answer.out.splitlines()[-1].removeprefix("Next: ndtheory ")
    run = call(*shlex.split(following), "--json").document
    assert run["neumann_body"] == found["neumann_body"]
    assert run["theta"] == float(pasted(answer.out))
    assert run["converged"]


@pytest.mark.parametrize("edits", ["soft upper body", "stiff upper body", {"body2.young": "7e-20"}], ids=str)
def test_however_soft_a_body_what_is_pasted_is_a_theta(call, write, edits):
    assert 0 < float(pasted(call("advise", write(edits)).out)) < 1


def test_a_body_without_support_is_named_singular(call, write):
    complaint = call("advise", write({"body2.prescribed": '{ top = ["free", -0.01] }'})).complaint
    assert "body2" in complaint
    assert "singular" in complaint


# --- advise, from matrices -------------------------------------------------------------------------------------------


@pytest.fixture
def matrices(write):
    pair = build(vf.load(write("wrong roles")))
    return pair.contact.stiffness, pair.neumann.stiffness  # bodies 1 and 2


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
def test_matrices_give_the_rho_of_the_problem(call, write, tmp_path, matrices, how):
    S1, S2 = (saved(tmp_path, name, matrix, HOW[how]) for name, matrix in zip("ab", matrices, strict=True))
    found = call("advise", "--S1", S1, "--S2", S2, "--json").document
    expected = call("advise", write("wrong roles"), "--json").document
    assert found["schema"] == "ndtheory.advice/1"
    assert found["neumann_body"] == expected["neumann_body"] == 1
    for body, role in by_body(found).items():
        assert set(role) >= ROLE
        assert role["rho"]["value"] == pytest.approx(by_body(expected)[body]["rho"]["value"], rel=1e-9)
        assert role["theta_proved"] == pytest.approx(role["theta_predicted"], rel=1e-9)  # matrices know no friction
        assert role["friction_threshold"] is None
        assert "friction" in role["reason"]["friction_threshold"]


def test_exchanged_matrices_exchange_the_advice(call, tmp_path, matrices):
    S1, S2 = (saved(tmp_path, name, matrix) for name, matrix in zip("ab", matrices, strict=True))
    found = call("advise", "--S1", S1, "--S2", S2, "--json").document
    swapped = call("advise", "--S1", S2, "--S2", S1, "--json").document
    assert {found["neumann_body"], swapped["neumann_body"]} == {1, 2}
    turned = {3 - body: role | {"neumann_body": 3 - body} for body, role in by_body(swapped).items()}
    assert turned == by_body(found)


@pytest.mark.parametrize("unit", [1e-300, 1e-12, 1e12, 1e300])
def test_the_unit_of_stiffness_does_not_change_the_advice(call, tmp_path, matrices, unit):
    largest = np.abs(matrices).max()
    given = [saved(tmp_path, name, matrix) for name, matrix in zip("ab", matrices, strict=True)]
    other = [saved(tmp_path, name, matrix / largest * unit) for name, matrix in zip("cd", matrices, strict=True)]
    one, two = (call("advise", "--S1", a, "--S2", b, "--json") for a, b in (given, other))
    assert two.err == ""
    assert one.document["neumann_body"] == two.document["neumann_body"]
    for a, b in zip(one.document["roles"], two.document["roles"], strict=True):
        assert b["rho"]["value"] == pytest.approx(a["rho"]["value"], rel=1e-9)


@pytest.mark.parametrize("times", [1e6, 1e60, 1e300])
def test_a_body_far_stiffer_than_the_other_gets_the_neumann_problem_or_is_refused(call, tmp_path, times):
    a, b = saved(tmp_path, "a", GOOD), saved(tmp_path, "b", GOOD * times)
    answer = call("advise", "--S1", a, "--S2", b, "--json")
    if answer.status == 2:
        assert times > 1e75
        assert "b.npz" in answer.complaint
        return
    assert (answer.status, answer.err) == (0, "")
    assert answer.document["neumann_body"] == 2
    assert by_body(answer.document)[2]["rho"]["value"] == pytest.approx(1 / times, rel=1e-9)


def test_matrices_of_whole_numbers_are_read(call, tmp_path):
    a, b = saved(tmp_path, "a", np.diag([1, 2, 3])), saved(tmp_path, "b", np.eye(3, dtype=np.int8))
    found = by_body(call("advise", "--S1", a, "--S2", b, "--json").document)
    assert found[2]["rho"]["value"] == pytest.approx(3)
    assert found[1]["rho"]["value"] == pytest.approx(1)


GOOD = np.diag([1.0, 2.0, 3.0])
BAD = {
    "not square": (np.ones((2, 3)), ["2 x 3", "square"]),
    "a vector": (np.ones(3), ["square"]),
    "a number": (np.float64(3), ["square"]),
    "a stack": (np.ones((2, 2, 2)), ["2 x 2 x 2", "square"]),
    "not symmetric": (np.array([[1.0, 0.5, 0], [0, 1, 0], [0, 0, 1]]), ["symmetric"]),
    "indefinite": (np.diag([1.0, -1.0, 1.0]), ["indefinite", "-1", "positive definite"]),
    "of the other sign": (-GOOD, ["indefinite", "-3", "positive definite"]),
    "singular": (np.diag([1.0, 0.0, 1.0]), ["singular", "support"]),
    "singular up to rounding": (np.ones((3, 3)) + 1e-17 * GOOD, ["singular", "support"]),
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
    complaint = call(
        "advise", "--S1", saved(tmp_path, "a", GOOD), "--S2", saved(tmp_path, "b", matrix, np.savez_compressed)
    ).complaint
    assert [fragment for fragment in ["b.npz", *fragments] if fragment not in complaint] == []


@pytest.mark.parametrize("kind", ["indefinite", "not symmetric", "not a number", "a vector"])
def test_the_first_matrix_is_held_to_the_same(call, tmp_path, kind):
    matrix, fragments = BAD[kind]
    complaint = call("advise", "--S1", saved(tmp_path, "a", matrix), "--S2", saved(tmp_path, "b", GOOD)).complaint
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
    "two arrays": (lambda path: np.savez(path, first=GOOD, second=GOOD), ["one array", "first, second"]),
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
    complaint = call("advise", "--S1", saved(tmp_path, "a", GOOD), "--S2", bad).complaint
    assert [fragment for fragment in [str(bad), *fragments] if fragment not in complaint] == []
    assert "unsafe" not in complaint  # nobody is told to load pickles
    assert complaint.isprintable()


# --- advise, from one run --------------------------------------------------------------------------------------------


def tail_ratio(history):
    """The ratio of consecutive residuals at the end of a history, over two steps."""
    return math.sqrt(history[-1] / history[-3])


@pytest.mark.parametrize(
    ("name", "theta", "rho", "within"),
    [
        ("two-bars", "0.45", "rho_max", 1e-5),
        ("signorini", "0.95", "rho_normal", 1e-2),
        ("section6", "0.95", "rho_max", 5e-2),
    ],
)
def test_one_run_that_alternates_tells_rho(call, write, name, theta, rho, within):
    file = write(text=examples()[name])
    ratio = tail_ratio(call("run", file, "--theta", theta, "--json").document["history"])
    found = call("advise", "--theta", theta, "--ratio", repr(ratio), "--json").document
    (role,) = found["roles"]
    assert role["rho"]["value"] == pytest.approx((1 + ratio) / float(theta) - 1, rel=1e-12)
    assert role["rho"]["value"] == pytest.approx(getattr(vf.measure(vf.load(file)), rho).value, rel=within)
    assert role["theta_predicted"] == pytest.approx(2 / (2 + role["rho"]["value"]))
    assert role["rate_predicted"] == pytest.approx(role["rho"]["value"] / (2 + role["rho"]["value"]))


def test_a_run_that_diverges_in_every_step_tells_rho_too(call, write):
    """1 - theta - theta rho = -1.4 for the first steps, until the bars part."""
    file = write(text=examples()["two-bars"])
    history = call("run", file, "--theta", "0.6", "--json").document["history"]
    ratios = [b / a for a, b in itertools.pairwise(history)]
    found = call("advise", "--theta", "0.6", "--ratio", f"{ratios[3]:.9f}", "--json").document
    assert ratios[3] == pytest.approx(1.4)
    assert {reading["kind"]: reading["rho"]["value"] for reading in found["readings"]} == {
        "mode-high": pytest.approx(3),
        "level": None,  # the bars may part and meet
    }
    assert found["roles"] == []
    assert call("run", file, "--theta", str(found["next"]["theta"]), "--json").document["converged"]


def test_one_run_tells_nothing_of_the_other_role_and_proves_nothing(call):
    found = call("advise", "--theta", "0.45", "--ratio", "0.8", "--json").document
    (role,) = found["roles"]
    assert set(role) >= ROLE
    assert found["neumann_body"] is role["neumann_body"] is None
    assert "neumann_body" in found["reason"]
    assert {role[name] for name in PROVED} == {None}
    assert set(role["reason"]) >= PROVED | {"neumann_body"}
    answer = call("advise", "--theta", "0.45", "--ratio", "0.8")
    assert pasted(answer.out) == "0.4"
    assert "neumann_body" not in answer.out
    assert max(map(len, answer.out.splitlines())) <= 80


@pytest.mark.parametrize(
    ("theta", "ratio", "rho"), [("1/3", "4/3", 6), ("1", "1/2", 0.5), ("1", "1e-60", 1e-60), ("1e-8", "1e-8", 1e8)]
)
def test_theta_and_ratio_are_read_exactly(call, theta, ratio, rho):
    found = call("advise", "--theta", theta, "--ratio", ratio, "--json").document
    assert found["readings"][0]["rho"]["value"] == pytest.approx(rho, rel=1e-7, abs=0)


@pytest.mark.parametrize("size", ["1e-300", "1e-8", "1e8", "1e300"])
@pytest.mark.parametrize("theta", ["1e-300", "1e-8", "1"])
def test_no_size_of_a_ratio_crashes_the_advice(call, theta, size):
    answer = call("advise", "--theta", theta, "--ratio", size, "--json")
    assert "Traceback" not in answer.err
    if answer.status == 2:
        assert "--" in answer.complaint
    else:
        assert 0 < answer.document["next"]["theta"] < 1
        assert call("advise", "--theta", theta, "--ratio", size).status == 0


@pytest.mark.parametrize("value", ["0", "-1", "nan", "inf", "-inf", "abc", "", "1e400", "1e-400", "1/0", "auto"])
@pytest.mark.parametrize("name", ["ratio", "theta"])
def test_a_ratio_or_theta_outside_its_meaning_is_refused(call, name, value):
    given = {"theta": "0.1", "ratio": "1.4"} | {name: value}
    complaint = call("advise", "--theta", given["theta"], "--ratio", given["ratio"]).complaint
    assert f"--{name} = {value}" in complaint
    assert {"ratio": "a number > 0", "theta": "0 < theta <= 1"}[name] in complaint


@pytest.mark.parametrize("theta", ["1.5", "1.0000000000000000000001"])
def test_a_theta_above_1_is_refused(call, theta):
    assert f"--theta = {theta}: needed" in call("advise", "--theta", theta, "--ratio", "1.4").complaint


FORMS = [{"FILE"}, {"--S1", "--S2"}, {"--theta", "--ratio"}]


@pytest.mark.parametrize(
    "given",
    [
        set(some)
        for n in range(6)
        for some in itertools.combinations(("FILE", "--S1", "--S2", "--theta", "--ratio"), n)
        if set(some) not in FORMS
    ],
    ids=lambda given: " ".join(sorted(given)) or "nothing",
)
def test_advise_needs_exactly_one_of_its_forms_and_that_whole(call, write, tmp_path, given):
    values = {"--theta": "0.1", "--ratio": "1.4"} | dict.fromkeys(("--S1", "--S2"), saved(tmp_path, "a", GOOD))
    options = [word for name in sorted(given - {"FILE"}) for word in (name, values[name])]
    complaint = call("advise", *(["FILE"] if "FILE" in given else []), *options).complaint
    assert "needed" in complaint
    assert all(name in complaint for name in given)


@pytest.mark.parametrize(
    ("name", "fragment"), [("missing.toml", "no such file"), ("", "folder"), ("a.npz", "interface file")]
)
def test_advise_names_a_file_that_is_no_problem(call, tmp_path, name, fragment):
    saved(tmp_path, "a", GOOD)
    complaint = call("advise", tmp_path / name).complaint
    assert str(tmp_path / name) in complaint
    assert fragment in complaint


# --- the sharp bound of bounds -------------------------------------------------------------------------------------

KAPPAS = ["--rho", "0.475", "--kappa1", "0.986", "--kappa2", "0.427"]
SECTION_5 = ["--m", "3084", "--M", "153229", "--CR", "1.70", "--CK", "1e-8"]


@pytest.mark.parametrize("beside", [[], SECTION_5, [*SECTION_5, "--edition", "repaired"]], ids=["alone", "all", "one"])
@pytest.mark.parametrize("theta", [[], ["--theta", "0.7"], ["--theta", "0.95"]], ids=["", "inside", "outside"])
def test_the_sharp_edition_of_bounds_is_the_theorem(call, beside, theta):
    found = call("bounds", *KAPPAS, *beside, *theta, "--json").document
    energy = EnergyConstants(rho="0.475", kappa_1="0.986", kappa_2="0.427")
    expected = evaluate_sharp(energy, *theta[1:]).to_dict()
    assert found["editions"]["sharp"] == json.loads(json.dumps(expected))
    shown = {name for name, edition in found["editions"].items() if edition is not None}
    of_section_5 = {"repaired"} if "--edition" in beside else {"printed", "repaired"} if beside else set()
    assert shown == {"sharp"} | of_section_5
    assert shown.isdisjoint(found["reason"])
    assert [found["inputs"][key] for key in ("rho", "kappa_1", "kappa_2")] == [0.475, 0.986, 0.427]
    rows = re.findall(r"^  (printed|repaired|sharp) .*", call("bounds", *KAPPAS, *beside, *theta).out, flags=re.M)
    assert set(rows) == shown


def test_the_editions_beside_the_sharp_one_are_what_they_are_alone(call):
    alone = call("bounds", *SECTION_5, "--theta", "1e-4", "--json").document["editions"]
    beside = call("bounds", *SECTION_5, *KAPPAS, "--theta", "1e-4", "--json").document["editions"]
    assert alone["sharp"] is None
    assert {name: beside[name] for name in ("printed", "repaired")} == {n: alone[n] for n in ("printed", "repaired")}


@pytest.mark.parametrize(("theta", "status"), [("0.7", 0), ("0.9", 1)])
def test_check_counts_the_sharp_edition(call, theta, status):
    assert call("bounds", *KAPPAS, "--theta", theta, "--check").status == status
    assert call("bounds", *SECTION_5, "--theta", theta, "--check").status == 1
    assert call("bounds", *SECTION_5, *KAPPAS, "--theta", theta, "--check").status == status


def test_the_screen_of_the_sharp_edition_tells_both_thetas(call):
    lines = call("bounds", *KAPPAS, "--theta", "0.7").out.splitlines()
    assert "WHICH THETA?" in lines
    assert any(re.search(r"^  proved +0\.70. .*least proved factor", line) for line in lines)
    assert any(re.search(r"^  predicted +0\.808 .*not a bound", line) for line in lines)
    assert max(map(len, lines)) <= 80
    none = call("bounds", "--rho", "3", "--kappa1", "2", "--kappa2", "2").out
    assert "q >= 1 for every theta: no conclusion" in none


@pytest.mark.parametrize("value", ["nan", "inf", "-1", "x", "", "1e400"])
@pytest.mark.parametrize("option", ["--rho", "--kappa1", "--kappa2"])
def test_an_energy_constant_that_is_none_is_refused_by_name(call, option, value):
    given = dict(zip(KAPPAS[::2], KAPPAS[1::2], strict=True)) | {option: value}
    assert f"{option} = {value}: needed" in call("bounds", *(w for pair in given.items() for w in pair)).complaint


@pytest.mark.parametrize("key", ["--m", "--M", "--CR", "--CK", "--k"])
def test_an_empty_constant_beside_rho_is_refused_as_it_is_without(call, key):
    assert call("bounds", "--rho", "1", f"{key}=").complaint


@pytest.mark.parametrize("size", ["1e-300", "1e-70", "1e-30", "1e30", "1e70", "1e300"])
@pytest.mark.parametrize("option", ["--rho", "--kappa1", "--kappa2"])
@pytest.mark.parametrize("theta", ["1e-300", "0.5"])
def test_no_size_of_an_energy_constant_crashes_the_calculator(call, option, size, theta):
    for others in ("0.5", size):
        given = dict.fromkeys(("--rho", "--kappa1", "--kappa2"), others) | {option: size, "--theta": theta}
        answer = call("bounds", *(word for pair in given.items() for word in pair), "--json")
        assert "Traceback" not in answer.err
        if answer.status == 2:
            assert f" = {size}: needed" in answer.complaint
            continue
        sharp = answer.document["editions"]["sharp"]
        assert sharp["interval"] is None or 0 <= sharp["interval"][0] < sharp["interval"][1] <= 1
        assert sharp["factor"] is None or 0 <= sharp["factor"]["value"] <= 1


# --- an automatic theta ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("edits", "source"),
    [
        ({"contact.friction": "0.05"}, "proved"),
        ({"contact.friction": "3"}, "predicted"),  # q >= 1 for every theta
        ({"contact.friction": "0"}, "proved"),
        ({"contact.law": '"local"', "contact.radius": None}, "predicted"),  # outside the theorem
        ({"iteration.neumann_body": "2"}, "proved"),
    ],
    ids=["little friction", "much friction", "no friction", "local law", "other roles"],
)
def test_an_automatic_theta_says_where_it_comes_from(call, write, edits, source):
    file = write(edits | {"iteration.theta": '"auto"'}, "auto.toml")
    found = call("run", file, "--json").document
    sharp = evaluate_sharp(vf.measure(vf.load(file)).energy_constants())
    assert (found["theta_source"], found["converged"]) == (source, True)
    assert found["theta"] == pytest.approx(sharp.theta_proved if source == "proved" else sharp.theta_predicted)
    assert f"is the {source} one" in call("run", file).out
    over = call("run", write(edits, "given.toml"), "--theta", "auto", "--json").document
    assert over == found
    again = call("run", write(edits, "given.toml"), "--theta", repr(found["theta"]), "--json").document
    assert (again["theta_source"], again["history"]) == ("given", found["history"])
    role = by_body(call("advise", file, "--json").document)[found["neumann_body"]]
    assert found["theta"] == role[f"theta_{source}"]


def test_an_automatic_theta_is_that_of_the_roles_that_run(call, write):
    file = write({"iteration.theta": '"auto"'})
    roles = by_body(call("advise", file, "--json").document)
    for options, body in (([], 1), (["--swap-roles"], 2)):
        found = call("run", file, *options, "--json").document
        assert (found["neumann_body"], found["theta"]) == (body, roles[body]["theta_proved"])


def test_a_comparison_at_the_proved_theta_is_consistent(call, write):
    answer = call("compare", write({"contact.friction": "0.05"}), "--theta", "auto", "--json")
    found = answer.document
    assert (answer.status, found["run"]["theta_source"]) == (0, "proved")
    assert found["verdicts"]["sharp"] == found["verdicts"]["lmi"] == "CONSISTENT"
    assert found["sharp"]["factor"]["value"] == pytest.approx(found["sharp"]["factor_proved"]["value"], rel=1e-9)


def test_an_automatic_theta_stays_below_1_however_soft_the_contact_body(call, write):
    found = call("run", write({"body2.young": "7e-20", "contact.friction": "0"}), "--theta", "auto", "--json").document
    assert 0.999 < found["theta"] < 1


@pytest.mark.parametrize("word", ["Auto", "AUTO", "auto ", "automatic", "predicted"])
def test_auto_is_one_word(call, write, word):
    line = call("run", write(), "--theta", word).complaint
    assert f"theta = {word}: needed a number with 0 < theta < 1, or" in line
    assert "iteration.theta" in call("run", write({"iteration.theta": f'"{word}"'})).complaint


@pytest.mark.parametrize("command", ["run", "compare"])
@pytest.mark.parametrize(("key", "word"), [("theta", "auto"), ("relaxation", "momentum")])
def test_what_needs_rho_is_refused_by_its_key_where_rho_does_not_exist(call, write, command, key, word):
    held = write("held tangentially").read_text(encoding="utf-8")
    complaint = call(command, write({f"iteration.{key}": f'"{word}"'}, text=held)).complaint
    assert f'problem.toml: iteration.{key} = "{word}": needed' in complaint
    assert "rho" in complaint


# --- relaxation rules ------------------------------------------------------------------------------------------------

RULES = ["aitken", "anderson", "newton", "momentum"]
SIDEWAYS = {"body2.prescribed": "{ top = [0.004, -0.015] }"}


@pytest.mark.parametrize("relaxation", RULES)
@pytest.mark.parametrize(
    "edits",
    [{"contact.friction": "0"}, {}, SIDEWAYS, {"iteration.theta": '"auto"'}],
    ids=["no friction", "friction", "pushed sideways", "an automatic theta"],
)
def test_a_rule_reaches_the_same_forces_and_is_labelled(call, write, relaxation, edits):
    constant = call("run", write(edits), "--json").document
    answer = call("run", write(edits | {"iteration.relaxation": f'"{relaxation}"'}), "--json")
    found = answer.document
    size = constant["force"]["normal"]
    assert (answer.status, found["relaxation"], found["pattern"]) == (0, relaxation, constant["pattern"])
    assert found["force"]["normal"] == pytest.approx(size, rel=1e-6)
    assert found["force"]["tangential"] == pytest.approx(constant["force"]["tangential"], abs=1e-6 * size)
    assert found["evaluations"] == len(found["history"]) < constant["evaluations"]
    assert found["history"][-1] <= 1e-9
    inside = relaxation == "momentum" and edits.get("contact.friction") == "0"
    assert found["outside_theorem"] == [] if inside else [r for r in found["outside_theorem"] if relaxation in r]
    assert (found["proved_rate"] is not None) == inside
    assert found["linearised_rate"] is None
    assert relaxation in found["reason"]["linearised_rate"]


@pytest.mark.parametrize("relaxation", RULES)
def test_the_screen_of_a_run_names_its_rule(call, write, relaxation):
    screen = call("run", write({"iteration.relaxation": f'"{relaxation}"'})).out
    assert screen.splitlines()[1].endswith(f"| {relaxation}")
    assert "Outside the theorem: " in screen
    assert "not linearised" in screen


@pytest.mark.parametrize("relaxation", RULES)
@pytest.mark.parametrize("example", ["two-bars", None], ids=["bars", "plates"])
@pytest.mark.parametrize("friction", ["0", "0.2"])
def test_a_run_with_a_rule_speaks_for_no_bound_of_a_constant_theta(call, write, relaxation, example, friction):
    """The bound of one step is that of T_theta with a constant theta: a step of momentum may be longer."""
    if example and friction != "0":
        return
    text = {} if example is None else {"text": examples()[example]}
    edits = {"iteration.relaxation": f'"{relaxation}"', "contact.friction": friction}
    answer = call("compare", write(edits, **text), "--json")
    verdicts = answer.document["verdicts"]
    assert {verdicts[name] for name in ("printed", "repaired", "sharp", "lmi")} == {"HYPOTHESES_NOT_MET"}
    assert verdicts["linearised"] == "NOT_COMPUTED"
    assert answer.status == 0
    reasons = answer.document["reasons"]
    assert all(relaxation in reasons[name] for name in ("sharp", "lmi", "linearised"))


def test_momentum_without_friction_keeps_its_proved_rate(call, write):
    """On a quadratic energy the residual falls by p = 1 - 1/sqrt(1 + rho) a step in the long run."""
    file = write({"iteration.relaxation": '"momentum"', "iteration.tolerance": "1e-12"}, text=examples()["two-bars"])
    found = call("run", file, "--json").document
    rho = vf.measure(vf.load(file)).rho_normal.value
    assert found["theta_source"] == "momentum"
    assert found["proved_rate"]["value"] == pytest.approx(1 - 1 / math.sqrt(1 + rho), rel=1e-12)
    assert found["theta"] == pytest.approx((1 + found["proved_rate"]["value"]) / (1 + rho), rel=1e-12)
    assert found["observed_rate"] <= found["proved_rate"]["value"] * (1 + 1e-3)
    assert "proved rate 0.5" in call("run", file).out


@pytest.mark.parametrize("word", ['"Aitken"', '"none"', "1", "true", '["aitken"]'])
def test_an_unknown_rule_is_refused_with_the_known_ones(call, write, word):
    complaint = call("run", write({"iteration.relaxation": word})).complaint
    assert "iteration.relaxation" in complaint
    assert all(f'"{rule}"' in complaint for rule in ("constant", *RULES))


# --- region ----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def charted(tmp_path_factory):
    """The plane of a coarse mesh, drawn once."""
    file = tmp_path_factory.mktemp("plane") / "problem.toml"
    file.write_text(edited(SMALL, COARSE), encoding="utf-8")
    problem = vf.load(file)
    shares = []
    told = lambda what, share: shares.append(share) if what.startswith("runs") else None
    return file, vf.measure(problem), plane.chart(problem, progress=told), shares


@pytest.fixture
def region(call, charted, monkeypatch):
    """`region` on that plane, as often as one likes."""
    monkeypatch.setattr(plane, "chart", lambda problem, progress: charted[2])
    return lambda *arguments: call("region", charted[0], *arguments)


def test_region_writes_a_picture_with_both_axes_every_edition_and_every_outcome(region, charted, tmp_path):
    answer = region("-o", tmp_path / "plane.svg")
    assert (answer.status, answer.err) == (0, "")
    assert [path.name for path in tmp_path.iterdir()] == ["plane.svg"]
    assert b"<dc:title>ndtheory</dc:title>" in (tmp_path / "plane.svg").read_bytes()
    drawn = ElementTree.parse(tmp_path / "plane.svg").getroot()
    text = "\n".join("".join(element.itertext()).strip() for element in drawn.iter() if element.tag.endswith("}text"))
    assert "relaxation factor theta" in text
    assert "coefficient of friction k" in text
    assert all(f"{name}: k < " in text for name in ("printed (MPa)", "repaired", "sharp", "lmi"))
    words = lambda outcome: "run still falling when stopped" if outcome == "limit" else f"run {outcome}"
    assert all(words(outcome) in text for outcome in {point.outcome for point in charted[2].points})
    assert region("-o", tmp_path / "plane.png").status == 0
    assert (tmp_path / "plane.png").read_bytes().startswith(b"\x89PNG")
    assert b"Software\x00ndtheory" in (tmp_path / "plane.png").read_bytes()


@pytest.mark.parametrize("ending", ["svg", "png"])
def test_region_writes_the_same_over_its_own_picture(region, tmp_path, ending):
    first = []
    for _ in range(2):
        assert region("-o", tmp_path / f"plane.{ending}").status == 0
        first.append((tmp_path / f"plane.{ending}").read_bytes())
    assert first[0] == first[1]
    assert len(list(tmp_path.iterdir())) == 1


def test_the_screen_of_region_counts_runs_and_gives_each_edition_its_line(region, charted, tmp_path):
    lines = region("-o", tmp_path / "plane.svg").out.splitlines()
    outcomes = [point.outcome for point in charted[2].points]
    assert any(f"{outcomes.count('converged')} converged" in line for line in lines)
    assert any("still falling when stopped after" in line for line in lines)
    head = next(i for i, line in enumerate(lines) if "every small theta: k <" in line and "some theta: k <" in line)
    assert [line.split()[0] for line in lines[head + 1 : head + 5]] == ["printed", "repaired", "sharp", "lmi"]
    assert "stresses in MPa" in lines[head + 5]
    assert lines[-1].endswith("plane.svg")
    assert [line for line in lines[:-1] if len(line) > 80] == []


def test_the_document_of_region_is_its_plane(region, charted, tmp_path):
    answer = region("-o", tmp_path / "plane.svg", "--json")
    found = answer.document
    assert (answer.status, answer.err, found["schema"]) == (0, "", "ndtheory.region/1")
    assert set(found["regions"]) | set(found["reason"]) == {"printed", "repaired", "sharp", "lmi"}
    for drawn in found["regions"].values():
        assert drawn["k"] == sorted(set(drawn["k"]))
        assert all(0 <= low < high <= 1 for low, high in drawn["theta"])
        assert len(drawn["k"]) == len(drawn["theta"]) > 0
    places = {(point["theta"], point["k"]) for point in found["points"]}
    assert len(places) == len(found["points"]) == len(plane.THETAS) * len(plane.FRICTIONS)
    assert {point["outcome"] for point in found["points"]} == {"converged", "limit", "stalled", "diverged"}
    shares = charted[3]
    assert shares == sorted(shares)
    assert 0 <= shares[0] < shares[-1] <= 1


def ends(region, every=1):
    """Points just inside the border of a region, and in its middle."""
    for k, (low, high) in list(zip(region.k, region.theta, strict=True))[::every]:
        for share in (1e-6, 0.5, 1 - 1e-6):
            yield k, low + share * (high - low)


def test_what_the_printed_theorem_contracts_the_repaired_one_does_where_m_is_at_least_1(charted):
    """In MPa, that is; with m below 1 the printed threshold is the larger one."""
    _, measured, drawn, _ = charted
    assert measured.m.value >= 1
    for k, theta in ends(drawn.regions["printed"], every=9):
        assert evaluate(REPAIRED, measured.with_friction(k).constants(), theta).verdict == "contraction"


def test_below_m_equal_to_1_the_printed_region_is_not_inside_the_repaired_one(write):
    measured = vf.measure(vf.load(write(COARSE | {"body1.young": "7e-8", "body2.young": "2e-8"})))
    constants = measured.constants()
    assert measured.m.value < 1
    assert evaluate(PRINTED, constants).C2.value > evaluate(REPAIRED, constants).C2.value


def test_what_the_repaired_theorem_contracts_the_one_in_energy_norms_does(charted):
    _, measured, drawn, _ = charted
    for k, theta in ends(drawn.regions["repaired"], every=9):
        assert evaluate_sharp(measured.with_friction(k).energy_constants(), theta).verdict == "contraction"


def test_what_the_theorem_in_energy_norms_contracts_the_semidefinite_bound_does(charted):
    _, measured, drawn, _ = charted
    sharp, lmi = drawn.regions["sharp"], drawn.regions["lmi"]
    assert max(sharp.k) < max(lmi.k)
    for k, (low, high) in zip(lmi.k, lmi.theta, strict=True):
        inner = evaluate_sharp(measured.with_friction(k).energy_constants()).interval
        assert inner is None or low <= inner[0] < inner[1] <= high * (1 + 1e-9)
    for k, (_, high) in zip(sharp.k, sharp.theta, strict=True):  # the border falls as friction grows
        assert high <= max((h for q, (_, h) in zip(lmi.k, lmi.theta, strict=True) if q <= k), default=1.0) * (1 + 1e-9)


def test_the_border_of_a_region_is_where_contraction_ends(charted):
    _, measured, drawn, _ = charted
    for k, (_, high) in list(zip(drawn.regions["sharp"].k, drawn.regions["sharp"].theta, strict=True))[::5]:
        energy = measured.with_friction(k).energy_constants()
        assert high == 1 or evaluate_sharp(energy, min(high * (1 + 1e-6), 1 - 1e-12)).verdict == "no conclusion"
    for name, edition in (("printed", PRINTED), ("repaired", REPAIRED)):
        for k, (_, high) in list(zip(drawn.regions[name].k, drawn.regions[name].theta, strict=True))[::20]:
            constants = measured.with_friction(k).constants()
            assert evaluate(edition, constants, high * (1 + 1e-6)).verdict == "no conclusion"


def test_no_run_inside_a_proved_region_stalls_or_runs_away(charted):
    _, measured, drawn, _ = charted
    proved = 0
    for point in drawn.points:
        sharp = evaluate_sharp(measured.with_friction(point.k).energy_constants(), point.theta)
        if sharp.verdict == "contraction":
            proved += 1
            assert point.outcome in ("converged", "limit"), point
            steps = math.log(1e-9 * (1 - sharp.factor.value)) / math.log(sharp.factor.value)
            assert point.outcome == "converged" or point.iterations == plane.MOST_STEPS < 2 * steps, point
    assert proved > 0
    assert any(point.outcome in ("stalled", "diverged") for point in drawn.points)


@pytest.mark.parametrize(
    ("edits", "target", "fragments"),
    [
        (None, "plane.pdf", ["-o", "plane.pdf", ".svg or .png"]),
        (None, "plane", ["-o", "plane", ".svg or .png"]),
        (None, "plane.SVG", ["-o", "plane.SVG", ".svg or .png"]),
        (None, ".svg", ["-o", ".svg or .png"]),
        (None, "problem.toml", ["-o", "problem.toml", ".svg or .png"]),
        (None, "missing/plane.svg", ["missing/plane.svg", "folder that exists", "-o"]),
        (None, "problem.toml/plane.svg", ["problem.toml/plane.svg", "folder that exists", "-o"]),
        (None, "foreign.svg", ["foreign.svg", "not written by this program", "-o"]),
        (None, "foreign.png", ["foreign.png", "not written by this program", "-o"]),
        (None, "folder.svg", ["folder.svg", "-o"]),
        ("local law", "plane.svg", ["problem.toml", "local"]),
        ({"contact.law": '"local"', "contact.radius": None, "contact.friction": "0"}, "plane.svg", ["local"]),
        ("held tangentially", "plane.svg", ["problem.toml", "held tangentially"]),
        ("without friction", "plane.svg", ["problem.toml", "contact.radius", "law of friction"]),
        ({"body1.young": "-1"}, "plane.svg", ["problem.toml", "body1.young", "-1"]),
    ],
    ids=str,
)
def test_region_refuses_what_it_cannot_draw_before_anything_is_run(
    call, write, tmp_path, monkeypatch, edits, target, fragments
):
    foreign = {"foreign.svg": "<svg>mine</svg>", "foreign.png": "mine, beside ndtheory"}
    for name, text in foreign.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "folder.svg").mkdir()
    file = write(edits)
    before = {path.name for path in tmp_path.iterdir()}
    monkeypatch.setattr(plane, "run", None)
    complaint = call("region", file, "-o", tmp_path / target).complaint
    assert [fragment for fragment in fragments if fragment not in complaint] == []
    assert {path.name for path in tmp_path.iterdir()} == before
    assert {name: (tmp_path / name).read_text() for name in foreign} == foreign


def test_region_refuses_two_bars(call, write, tmp_path):
    complaint = call("region", write(text=examples()["two-bars"]), "-o", tmp_path / "plane.svg").complaint
    assert "problem.toml" in complaint
    assert "friction" in complaint


def test_region_needs_the_name_of_a_picture(call, write):
    assert "-o" in call("region", write()).complaint
    assert "-o" in call("region", write(), "-o").complaint
    assert "-o" in call("region", write(), "-o", "").complaint


@pytest.fixture
def short(monkeypatch):
    """Few points on the borders, no semidefinite bound: what matters is the runs."""

    def fail(self, subject, progress):
        raise NotComputed("made up")

    monkeypatch.setattr(bound, "TRACED", 4)
    monkeypatch.setattr(SemidefiniteBound, "region", fail)


def test_a_bound_without_a_region_says_why(call, short, write, tmp_path, monkeypatch):
    monkeypatch.setattr(plane, "THETAS", (0.1,))
    monkeypatch.setattr(plane, "FRICTIONS", (0.1,))
    found = call("region", write(COARSE), "-o", tmp_path / "plane.svg", "--json").document
    assert "lmi" not in found["regions"]
    assert found["reason"] == {"lmi": "made up"}
    assert "lmi: made up" in call("region", write(COARSE), "-o", tmp_path / "plane.svg").out


@pytest.mark.parametrize("relaxation", ["newton", "momentum"])
def test_region_runs_a_constant_theta_whatever_the_file_says(call, short, write, tmp_path, monkeypatch, relaxation):
    monkeypatch.setattr(plane, "THETAS", (0.1, 0.9))
    monkeypatch.setattr(plane, "FRICTIONS", (0.1,))
    chosen = COARSE | {"iteration.relaxation": f'"{relaxation}"', "iteration.theta": '"auto"'}
    points = [
        call("region", write(edits), "-o", tmp_path / "plane.svg", "--json").document["points"]
        for edits in (COARSE, chosen)
    ]
    assert points[0] == points[1]
    assert [point["theta"] for point in points[0]] == [0.1, 0.9]


@pytest.mark.parametrize("evaluations", [1, 40])
def test_ctrl_c_ends_region(call, short, write, tmp_path, monkeypatch, evaluations):
    iterates, seen = runs.iterates, itertools.count(1)

    def interrupted(*args):
        for state in iterates(*args):
            if next(seen) == evaluations:
                signal.raise_signal(signal.SIGINT)
            yield state

    monkeypatch.setattr(runs, "iterates", interrupted)
    answer = call("region", write(COARSE), "-o", tmp_path / "plane.svg")
    assert answer.status == 130
    assert answer.err.strip().startswith("interrupted")
    assert answer.err.strip().count("\n") == 0
    assert next(seen) <= evaluations + 2  # no other run was begun
