"""Relaxation rules from a file: the same forces, a label, and no bound that speaks of a constant theta."""

import math

import pytest

import verification as vf
from verification.cli.problems import examples

# --- relaxation rules ------------------------------------------------------------------------------------------------

RULES = ["aitken", "anderson", "newton", "momentum"]
SIDEWAYS = {"body2.prescribed": "{ top = [0.004, -0.015] }"}


@pytest.mark.parametrize(
    ("relaxation", "edits"),
    [
        *((rule, edits) for rule in ("newton", "momentum") for edits in ({"contact.friction": "0"}, SIDEWAYS)),
        *[("aitken", {}), ("anderson", SIDEWAYS), ("aitken", {"iteration.theta": '"auto"'})],
    ],
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


@pytest.mark.parametrize(
    ("relaxation", "example", "friction"),
    [*((rule, None, "0.2") for rule in RULES), ("momentum", None, "0"), ("momentum", "two-bars", "0")],
)
def test_a_run_with_a_rule_speaks_for_no_bound_of_a_constant_theta(call, write, relaxation, example, friction):
    """The bound of one step is that of T_theta with a constant theta: a step of momentum may be longer."""
    text = {} if example is None else {"text": examples()[example]}
    edits = {"iteration.relaxation": f'"{relaxation}"', "contact.friction": friction}
    answer = call("compare", write(edits, **text), "--json")
    verdicts = answer.document["verdicts"]
    assert {verdicts[name] for name in ("printed", "repaired", "energy", "lmi")} == {"HYPOTHESES_NOT_MET"}
    assert verdicts["linearised"] == "NOT_COMPUTED"
    assert answer.status == 0
    reasons = answer.document["reasons"]
    assert all(relaxation in reasons[name] for name in ("energy", "lmi", "linearised"))


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
