"""`advise` from a problem and from one run: which body, which theta, and which of the two is proved."""

import itertools
import math
import shlex

import pytest
from advice_calls import GOOD, PROVED, ROLE, by_body, pasted, saved

import verification as vf
from ndtheory import evaluate_energy
from verification.cli.problems import examples

# --- advise, from a problem ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("edits", [None, "without friction", "wrong roles", "local law", "stiff upper body"], ids=str)
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


@pytest.mark.parametrize("edits", [None, "local law"], ids=str)
def test_the_advice_does_not_depend_on_the_role_that_the_file_gives(call, write, edits):
    file = write(edits)
    text = file.read_text(encoding="utf-8")
    other = write({"iteration.neumann_body": "2"}, "other.toml", text)
    a, b = call("advise", file, "--json").document, call("advise", other, "--json").document
    assert a["neumann_body"] == b["neumann_body"]
    assert by_body(a) == by_body(b)
    assert a["roles"] == b["roles"][::-1]


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
        energy = evaluate_energy(measured.energy_constants())
        assert role["friction_threshold"]["value"] == measured.friction_threshold.value
        if energy.interval is None:
            assert {role[name] for name in PROVED - {"friction_threshold"}} == {None}
            continue
        assert role["theta_proved"] == energy.theta_proved
        assert role["factor_proved"]["value"] == energy.factor_proved.value < 1
        assert role["theta_max_proved"]["value"] == energy.interval[1]
        for theta in (0.9 * energy.theta_proved, min(1.1 * energy.theta_proved, 0.999)):
            beside = evaluate_energy(measured.energy_constants(), theta).factor
            assert beside is None or beside.value > energy.factor_proved.value


def test_nothing_is_proved_of_the_local_law(call, write):
    file = write("local law")
    found, screen = call("advise", file, "--json").document, call("advise", file).out
    for role in found["roles"]:
        assert {role[name] for name in PROVED} == {None}
        assert all("local" in role["reason"][name] for name in PROVED)
    assert any("local" in reason for reason in found["outside_theorem"])
    assert "Outside the theorem: the local Coulomb law" in screen
    assert "proved     -" in screen


def test_bodies_of_which_one_is_held_along_gamma_c_are_advised_by_prediction(call, write):
    found = call("advise", write("held tangentially"), "--json").document
    assert any("held tangentially" in reason for reason in found["outside_theorem"])
    for role in found["roles"]:
        assert role["theta_predicted"] < 1
        assert {role[name] for name in PROVED} == {None}


@pytest.mark.parametrize("edits", [None, "wrong roles", "without friction"], ids=str)
def test_what_is_pasted_is_the_advice_and_the_next_line_runs_it(call, write, edits):
    file = write(edits)
    answer = call("advise", file)
    found = call("advise", file, "--json").document
    best = by_body(found)[found["neumann_body"]]
    assert pasted(answer.out) == f"{found['theta']:g}"
    assert 0.999 * best["theta_predicted"] < found["theta"] <= best["theta_predicted"]
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


@pytest.mark.parametrize("neumann", [1, 2])
def test_a_role_in_which_a_body_can_move_is_singular_and_the_other_is_advised(call, write, neumann):
    path = write({"body2.prescribed": '{ top = ["free", -0.01] }', "iteration.neumann_body": str(neumann)})
    document = call("advise", path, "--json").document
    assert document["neumann_body"] == 1
    assert {role["neumann_body"]: role["singular"] for role in document["roles"]} == {1: False, 2: True}
    screen = call("advise", path).out
    assert "these roles are refused: body2 can move rigidly" in screen
    following = screen.splitlines()[-1].removeprefix("Next: ndtheory ")
    run = call(*shlex.split(following), "--json").document
    assert run["neumann_body"] == 1
    assert run["converged"]


# --- advise, from one run --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "theta", "rho", "within"),
    [("two-bars", "0.45", "rho_max", 1e-5), ("signorini", "0.95", "rho_normal", 1e-2)],
)
def test_one_run_that_alternates_tells_rho(call, write, name, theta, rho, within):
    file = write(text=examples()[name])
    history = call("run", file, "--theta", theta, "--json").document["history"]
    ratio = math.sqrt(history[-1] / history[-3])
    found = call("advise", "run", "--theta", theta, "--ratio", repr(ratio), "--json").document
    (role,) = found["roles"]
    assert role["rho"]["value"] == pytest.approx((1 + ratio) / float(theta) - 1, rel=1e-12)
    assert role["rho"]["value"] == pytest.approx(getattr(vf.measure(vf.load(file)), rho).value, rel=within)
    assert role["theta_predicted"] == pytest.approx(2 / (2 + role["rho"]["value"]))
    assert role["rate_predicted"] == pytest.approx(role["rho"]["value"] / (2 + role["rho"]["value"]))


def test_a_run_that_diverges_in_every_step_tells_rho_too(call, write):
    """1 - theta - theta rho = -1.4 for the first steps, until the bars part."""
    file = write(text=examples()["two-bars"])
    residuals = [iterate.residual for iterate in vf.run(file, theta=0.6).iterates]
    ratios = [b / a for a, b in itertools.pairwise(residuals)]
    found = call("advise", "run", "--theta", "0.6", "--ratio", f"{ratios[3]:.9f}", "--json").document
    assert ratios[3] == pytest.approx(1.4)
    assert {reading["kind"]: reading["rho"]["value"] for reading in found["readings"]} == {
        "mode-high": pytest.approx(3),
        "level": None,  # the bars may part and meet
    }
    assert found["roles"] == []
    assert call("run", file, "--theta", str(found["next"]["theta"]), "--json").document["converged"]


def test_one_run_tells_nothing_of_the_other_role_and_proves_nothing(call):
    found = call("advise", "run", "--theta", "0.45", "--ratio", "0.8", "--json").document
    (role,) = found["roles"]
    assert set(role) >= ROLE
    assert found["neumann_body"] is role["neumann_body"] is None
    assert "neumann_body" in found["reason"]
    assert {role[name] for name in PROVED} == {None}
    assert set(role["reason"]) >= PROVED | {"neumann_body"}
    answer = call("advise", "run", "--theta", "0.45", "--ratio", "0.8")
    assert pasted(answer.out) == "0.4"
    assert "neumann_body" not in answer.out
    assert max(map(len, answer.out.splitlines())) <= 80


@pytest.mark.parametrize(
    ("theta", "ratio", "rho"), [("1/3", "4/3", 6), ("1", "1/2", 0.5), ("1", "1e-60", 1e-60), ("1e-8", "1e-8", 1e8)]
)
def test_theta_and_ratio_are_read_exactly(call, theta, ratio, rho):
    found = call("advise", "run", "--theta", theta, "--ratio", ratio, "--json").document
    assert found["readings"][0]["rho"]["value"] == pytest.approx(rho, rel=1e-7, abs=0)


@pytest.mark.parametrize("size", ["1e-300", "1e-8", "1e8", "1e300"])
@pytest.mark.parametrize("theta", ["1e-300", "1e-8", "1"])
def test_no_size_of_a_ratio_crashes_the_advice(call, theta, size):
    answer = call("advise", "run", "--theta", theta, "--ratio", size, "--json")
    assert "Traceback" not in answer.err
    if answer.status == 2:
        assert "--" in answer.complaint
    else:
        assert 0 < answer.document["next"]["theta"] < 1
        assert call("advise", "run", "--theta", theta, "--ratio", size).status == 0


OUTSIDE = ["0", "-1", "nan", "inf", "abc", "", "1e400", "1e-400", "1/0"]


@pytest.mark.parametrize(
    ("name", "value"), [*itertools.product(["ratio", "theta"], OUTSIDE), ("theta", "1.0000000000000000000001")]
)
def test_a_ratio_or_theta_outside_its_meaning_is_refused(call, name, value):
    given = {"theta": "0.1", "ratio": "1.4"} | {name: value}
    complaint = call("advise", "run", "--theta", given["theta"], "--ratio", given["ratio"]).complaint
    assert f"--{name} = {value}" in complaint
    assert {"ratio": "a number > 0", "theta": "0 < theta <= 1"}[name] in complaint


@pytest.mark.parametrize(
    ("name", "fragment"), [("missing.toml", "no such file"), ("", "folder"), ("a.npz", "interface file")]
)
def test_advise_names_a_file_that_is_no_problem(call, tmp_path, name, fragment):
    saved(tmp_path, "a", GOOD)
    complaint = call("advise", tmp_path / name).complaint
    assert str(tmp_path / name) in complaint
    assert fragment in complaint
