"""What screens and documents say of an automatic theta, of a theta beside momentum, and of the run of another code."""

import pytest

import verification as vf

MOMENTUM = {"iteration.relaxation": '"momentum"'}


# --- theta = "auto" --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("poisson", "source"), [("0.3", "proved"), ("0.49", "predicted")])
def test_run_and_advise_say_which_theta_is_taken_and_why(call, write, poisson, source):
    file = write({"body2.poisson": poisson, "contact.radius": "0.2", "iteration.theta": '"auto"'})
    chosen = vf.run(vf.load(file)).choice
    assert chosen.source == source
    said = f"{float(chosen.theta):.4g} is the {source} one: {chosen.why}"
    assert f"theta = {said}" in " ".join(call("run", file).out.split())
    run = call("run", file, "--json").document
    assert (run["theta_source"], run["theta_reason"]) == (source, chosen.why)
    screen = call("advise", file).out
    assert max(map(len, screen.splitlines()[:-1])) <= 80  # the last line names the file
    assert f'theta = "auto" takes {float(chosen.theta):.4g}, the {source} one: {chosen.why}' in " ".join(screen.split())
    role = call("advise", file, "--json").document["roles"][0]
    assert role["theta_auto"] == {"theta": float(chosen.theta), "source": source, "why": chosen.why}


def test_a_given_theta_is_called_given(call, write):
    run = call("run", write(), "--json").document
    assert run["theta_source"] == "given"
    assert "given" in run["theta_reason"]


# --- momentum takes its step from rho --------------------------------------------------------------------------------


@pytest.mark.parametrize("command", ["run", "compare"])
@pytest.mark.parametrize("theta", ["0.5", "auto", "1e-3"])
def test_a_theta_beside_momentum_is_refused_in_one_line(call, write, command, theta):
    complaint = call(command, write(MOMENTUM), "--theta", theta).complaint
    assert f'--theta = "{theta}": needed no theta beside relaxation = "momentum"' in complaint


def test_a_theta_of_the_file_beside_momentum_is_one_line_of_warning(call, write):
    answers = {
        theta: call("run", write(MOMENTUM | {"contact.friction": "0", "iteration.theta": theta}), "--json")
        for theta in ("0.7", '"auto"', None)
    }
    warning = "iteration.theta = 0.7 is not used: momentum takes its step from rho"
    assert answers["0.7"].err == f"warning: {warning}\n"
    assert answers['"auto"'].err == answers[None].err == ""
    runs = [answer.document for answer in answers.values()]
    assert [run.pop("warnings") for run in runs] == [[warning], [], []]
    assert runs[0] == runs[1] == runs[2]
