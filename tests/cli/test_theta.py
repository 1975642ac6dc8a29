"""What screens and documents say of an automatic theta, of a theta beside momentum, and of the run of another code."""

import pytest
from advice_calls import by_body

import verification as vf
from ndtheory import evaluate_energy

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
    proved = f'theta = "auto" takes the proved {float(chosen.theta):.4g}: at most twice the predicted steps.'
    same = 'This is what theta = "auto" takes, rounded.'
    assert (proved if source == "proved" else same) in " ".join(screen.split())
    role = call("advise", file, "--json").document["roles"][0]
    assert role["theta_auto"] == {"theta": float(chosen.theta), "source": source, "why": chosen.why}


def test_a_given_theta_is_called_given(call, write):
    run = call("run", write(), "--json").document
    assert run["theta_source"] == "given"
    assert "given" in run["theta_reason"]


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
    energy = evaluate_energy(vf.measure(vf.load(file)).energy_constants())
    assert (found["theta_source"], found["converged"]) == (source, True)
    assert found["theta"] == pytest.approx(energy.theta_proved if source == "proved" else energy.theta_predicted)
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
    assert found["verdicts"]["energy"] == found["verdicts"]["lmi"] == "CONSISTENT"
    assert found["energy"]["factor"]["value"] == pytest.approx(found["energy"]["factor_proved"]["value"], rel=1e-9)


def test_an_automatic_theta_stays_below_1_however_soft_the_contact_body(call, write):
    found = call("run", write({"body2.young": "7e-20", "contact.friction": "0"}), "--theta", "auto", "--json").document
    assert 0.999 < found["theta"] < 1


@pytest.mark.parametrize("word", ["Auto", "AUTO", "auto ", "automatic", "predicted"])
def test_auto_is_one_word(call, write, word):
    line = call("run", write(), "--theta", word).complaint
    assert f"theta = {word}: needed a number with 0 < theta < 1, or" in line
    assert "iteration.theta" in call("run", write({"iteration.theta": f'"{word}"'})).complaint


@pytest.mark.parametrize(("key", "word"), [("theta", "auto"), ("relaxation", "momentum")])
def test_rho_exists_where_a_contact_node_is_held_and_what_needs_it_runs(call, write, key, word):
    held = write("held tangentially").read_text(encoding="utf-8")
    assert call("run", write({f"iteration.{key}": f'"{word}"'}, text=held), "--json").document["converged"]


# --- momentum takes its step from rho --------------------------------------------------------------------------------


@pytest.mark.parametrize("command", ["run", "compare"])
@pytest.mark.parametrize("theta", ["0.5", "auto", "1e-3"])
def test_a_theta_beside_momentum_is_refused_in_one_line(call, write, command, theta):
    complaint = call(command, write(MOMENTUM), "--theta", theta).complaint
    assert f'--theta = "{theta}": needed no theta beside relaxation = "momentum"' in complaint


def test_a_theta_of_the_file_beside_momentum_is_one_line_of_warning(call, write):
    gently = {"contact.friction": "0", "body2.prescribed": "{ top = [0, -0.01] }"}  # strains below 5 %
    answers = {
        theta: call("run", write(MOMENTUM | gently | {"iteration.theta": theta}), "--json")
        for theta in ("0.7", '"auto"', None)
    }
    warning = "iteration.theta = 0.7 is not used: momentum takes its step from rho"
    assert answers["0.7"].err == f"warning: {warning}\n"
    assert answers['"auto"'].err == answers[None].err == ""
    runs = [answer.document for answer in answers.values()]
    assert [run.pop("warnings") for run in runs] == [[warning], [], []]
    assert [run.pop("problem")["iteration"]["theta"] for run in runs] == [0.7, "auto", "auto"]
    assert runs[0] == runs[1] == runs[2]


# --- one run of another code -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", ["1.4", "0.97", "4.51"])
def test_nothing_is_pasted_while_a_ratio_has_several_readings(call, ratio):
    answer = call("advise", "run", "--theta", "0.1", "--ratio", ratio)
    document = call("advise", "run", "--theta", "0.1", "--ratio", ratio, "--json").document
    assert (answer.status, answer.err) == (0, "")
    assert max(map(len, answer.out.splitlines())) <= 80
    assert len(document["readings"]) > 1
    assert document["roles"] == []
    assert "TO PASTE" not in answer.out
    assert "relaxation value" not in answer.out
    shown = [line.split()[0] for line in answer.out.splitlines() if line.startswith(("  mode-", "  level", "  open"))]
    assert shown == [reading["kind"] for reading in document["readings"]]
    flat = " ".join(answer.out.split())
    assert f"theta = {document['next']['theta']:g}: {document['next']['why']}" in flat
    assert f"Next: ndtheory advise run --theta {document['next']['theta']:g} --ratio R" in answer.out


def test_the_screen_of_a_run_says_which_residual_is_meant_and_what_is_sure(call):
    flat = " ".join(call("advise", "run", "--theta", "0.1", "--ratio", "1.4").out.split())
    for said in (
        "|Tg - g| is multiplied by 1.4 in each step, absolute and unrelaxed",
        "For the relative residual |Tg - g|/|Tg| that coupling libraries log, use --log",
        "without friction, if a longer run stays there too, and with solvers more accurate than that level, "
        "rho is at least 19; with friction",
        "rho is at least 23",
        "rises and falls has no steady ratio: give 1",
    ):
        assert said in flat
    assert "absolute" in " ".join(call("advise", "run", "--help").out.split())


def test_what_is_pasted_from_a_run_is_the_next_run(call):
    answer = call("advise", "run", "--theta", "0.45", "--ratio", "0.8")
    document = call("advise", "run", "--theta", "0.45", "--ratio", "0.8", "--json").document
    assert [reading["kind"] for reading in document["readings"]] == ["mode-high"]
    assert document["next"]["theta"] == 0.4
    assert 'relaxation value="0.4" />' in answer.out
    assert "Next: ndtheory advise run --theta 0.4 --ratio R" in answer.out
