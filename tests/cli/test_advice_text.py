"""The answer of `advise`: roles, theta and steps, who reads what, what is proved, "auto", snippets and the quote."""

import json
import re

import numpy as np
import pytest
from advice_calls import by_body, pasted, saved
from hypothesis import given, settings
from strategies import contact_problems

import verification as vf
from verification.cli.problems import examples
from verification.coupling.roles import steps
from verification.show.layout import text

FORMS = {
    "section 6": [],
    "section 6, tied": ["--tied"],
    "other roles": ["--set", "iteration.neumann_body=2"],
    "without friction": ["--set", "contact.friction=0"],
    "much friction": ["--set", "contact.friction=3"],
    "tall cells": ["--set", "body2.cells=[24, 3]", "--set", "contact.friction=0"],
    "local law": ["--set", 'contact.law="local"', "--set", "contact.friction=0.2"],
    "sliding top": ["--set", 'body2.prescribed={ top = ["free", -0.01] }'],
}


def flat(answer):
    return " ".join(answer.out.split())


@pytest.mark.parametrize("form", FORMS)
def test_the_answer_fits_80_columns_and_46_lines(call, write, form):
    lines = call("advise", write(), *FORMS[form]).out.splitlines()
    assert max(map(len, lines[:-1])) <= 80  # the last line names the file
    assert len(lines) <= 46


@pytest.mark.parametrize("name", examples())
@pytest.mark.parametrize("tied", [[], ["--tied"]], ids=["contact", "tied"])
def test_the_answer_for_every_built_in_problem_fits_too(call, write, name, tied):
    lines = call("advise", write(text=examples()[name]), *tied).out.splitlines()
    assert max(map(len, lines[:-1])) <= 80
    assert len(lines) <= 46


@pytest.mark.parametrize("form", ["section 6", "section 6, tied", "without friction", "other roles"])
def test_it_says_how_many_steps_both_roles_take_and_who_reads_what(call, write, form):
    file = write()
    document, said = call("advise", file, *FORMS[form], "--json").document, flat(call("advise", file, *FORMS[form]))
    rate = "rate_tied" if document["tied"] else "rate_predicted"
    best = by_body(document)[document["neumann_body"]]
    other = by_body(document)[3 - document["neumann_body"]]
    assert f"{steps(best[rate])} steps to 1e-9, against" in said
    assert f"with the roles exchanged, {steps(other[rate])} steps" in said
    reads = f"solver reads forces and writes displacements, body {3 - document['neumann_body']}'s the reverse."
    assert f"Body {document['neumann_body']}'s {reads}" in said
    assert "For displacements (heat: temperatures) the same, but not in parallel coupling." in said


def test_roles_between_which_there_is_no_difference_are_told_so(call, tmp_path):
    """rho is 4 in either role."""
    S1, S2 = (saved(tmp_path, name, np.diag(values)) for name, values in (("a", [1.0, 4.0]), ("b", [4.0, 1.0])))
    answer = call("advise", "matrices", "--S1", S1, "--S2", S2)
    assert "and no difference with the roles exchanged" in answer.out
    quote = call("advise", "matrices", "--S1", S1, "--S2", S2, "--json").document["quote"]
    assert "the same with the roles exchanged." in quote


def test_the_table_has_a_row_for_a_tied_interface_with_the_steps_of_both_thetas(call, write):
    file = write()
    answer, document = call("advise", file), call("advise", file, "--json").document
    for role in document["roles"]:
        assert role["rate_tied"] < role["rate_predicted"]
        row = next(
            line for line in answer.out.splitlines() if "if tied " in line and f"{role['theta_tied']:.3f}" in line
        )
        assert f"<= {steps(role['rate_tied'])} " in row
        at = max(abs(1 - role["theta_predicted"] * (1 + role[end]["value"])) for end in ("rho_min", "rho_tied"))
        assert row.endswith(f"{steps(at)} at {role['theta_predicted']:.3f}")


def test_tied_advice_says_what_it_assumes_and_pastes_the_tied_theta(call, write):
    file = write()
    answer, document = call("advise", file, "--tied"), call("advise", file, "--tied", "--json").document
    best = by_body(document)[document["neumann_body"]]
    assert pasted(answer.out) == f"{document['theta']:g}"
    assert document["theta"] == pytest.approx(best["theta_tied"], rel=1e-3)
    assert document["theta"] != by_body(call("advise", file, "--json").document)[1]["theta_predicted"]
    assert "Not claimed: that nothing opens or slips." in answer.out
    assert f"--theta {document['theta']:g}" in answer.out.splitlines()[-1]


def test_a_frictionless_prediction_that_a_tied_interface_would_not_survive_is_marked(call, write):
    """2/(2 + rho_normal) may lie above 2/(1 + rho)."""
    file = write({"iteration.neumann_body": "2", "contact.friction": "0", "body2.poisson": "0.45"})
    document, out = call("advise", file, "--json").document, call("advise", file).out
    for role in document["roles"]:
        grows = role["theta_predicted"] * (1 + role["rho_tied"]["value"]) > 2
        row = next(line for line in out.splitlines() if "if tied " in line and f"{role['theta_tied']:.3f}" in line)
        assert ("grows at" in row) == grows
    assert any(role["theta_predicted"] * (1 + role["rho_tied"]["value"]) > 2 for role in document["roles"])


# --- theta = "auto" and the advice -----------------------------------------------------------------------------------

SAME = 'This is what theta = "auto" takes, rounded.'


def explained(found):
    """Whether the pasted theta is that of "auto", or the screen says why not."""
    said = " ".join(text(found.sections()).split())
    auto = found.best.theta_auto
    if found.theta == 0.99 <= auto.theta:
        return f'theta = "auto" takes {float(auto.theta):.4g}; 0.99 is the largest to paste.' in said
    if abs(found.theta - auto.theta) <= 1e-3 * found.theta:
        return SAME in said
    proved = auto.source == "proved" and found.best.theta_proved == pytest.approx(float(auto.theta))
    told = f'theta = "auto" takes the proved {float(auto.theta):.4g}: at most twice the predicted steps.' in said
    return proved and told and SAME not in said


@pytest.mark.parametrize("neumann_body", [1, 2])
@pytest.mark.parametrize("name", examples())
def test_auto_and_the_advice_agree_on_built_in_problems_or_the_screen_says_why_not(name, neumann_body):
    assert explained(vf.advise(vf.example(name).changed(neumann_body=neumann_body)))


@pytest.mark.parametrize("young", [7, 2000])
def test_a_theta_next_to_1_is_not_pasted_and_the_screen_says_what_auto_takes(call, write, young):
    said = flat(call("advise", write({"body2.young": str(young)})))
    capped = "0.99 is the largest to paste." in said
    assert capped == (young == 7)
    assert ("\n  theta = 0.99\n" in call("advise", write({"body2.young": str(young)})).out) == capped


@settings(max_examples=25)
@given(contact_problems())
def test_auto_and_the_advice_agree_on_random_problems_or_the_screen_says_why_not(data):
    try:
        found = vf.advise(vf.Problem.from_dict(data))
    except vf.ProblemError:
        return
    assert explained(found)


# --- snippets and the quote ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("library", ["preCICE", "Kratos", "Norma"])
@pytest.mark.parametrize("spelled", [str, str.lower])
def test_a_snippet_is_all_that_is_printed(call, write, library, spelled):
    file = write()
    answer = call("advise", file, "--snippets", spelled(library))
    assert (answer.status, answer.err) == (0, "")
    assert answer.out == vf.advise(vf.load(file)).snippet(library) + "\n"


def test_all_snippets_stand_below_their_names_and_have_one_theta(call, write):
    file = write()
    out, theta = call("advise", file, "--snippets", "all").out, call("advise", file, "--json").document["theta"]
    assert [line for line in out.splitlines() if line in ("preCICE", "Kratos", "Norma")] == [
        "preCICE",
        "Kratos",
        "Norma",
    ]
    text = re.search(r"\{\n.*\n\}", out, flags=re.S)[0]
    assert json.loads(text)["solver_settings"]["convergence_accelerators"][0]["alpha"] == theta
    assert f'<relaxation value="{theta:g}" />' in out
    assert f"relaxation parameter: {theta:g}\n" in out


def test_the_answer_names_the_snippets(call, write):
    assert "Whole blocks: --snippets preCICE, Kratos, Norma or all." in flat(call("advise", write()))


def test_there_is_no_snippet_while_readings_are_left(call):
    answer = call("advise", "run", "--theta", "0.1", "--ratio", "1.4", "--snippets", "all")
    assert answer.status == 0
    assert "WHICH RUN NEXT?" in answer.out
    assert answer.err == "no snippet: several readings are left, make the run that is named\n"


@pytest.mark.parametrize(
    ("words", "fragment"),
    [(["--snippets", "preCISE"], "'preCISE'"), (["--snippets", "all", "--json"], "received --snippets with --json")],
    ids=["unknown", "json"],
)
def test_snippets_that_cannot_be_had_are_refused_in_one_line(call, write, words, fragment):
    assert fragment in call("advise", write(), *words).complaint


def test_the_quote_has_the_numbers_of_the_document(call, write):
    file = write()
    document = call("advise", file, "--json").document
    best, other = (by_body(document)[body] for body in (document["neumann_body"], 3 - document["neumann_body"]))
    quote = document["quote"]
    assert f"is {best['rho']['value']:.3g} with body {document['neumann_body']} as Neumann body" in quote
    assert f"{other['rho']['value']:.3g} with the roles exchanged" in quote
    count, away = steps(best["rate_predicted"]), steps(other["rate_predicted"])
    assert f"2/(2+rho) = {best['theta_predicted']:.3g}: {count} steps to 1e-9 are predicted, against {away}." in quote
    assert quote in flat(call("advise", file))
    assert len(quote) < 280


def test_steps_of_which_the_theorem_speaks_are_at_most_so_many(call, write):
    quote = call("advise", write("without friction"), "--json").document["quote"]
    assert re.search(r": at most \d+ steps to 1e-9 without friction, against", quote)


@pytest.mark.parametrize("ratio", ["1.4", "1.9"])
def test_a_tied_run_that_grows_gets_a_theta(call, ratio):
    answer = call("advise", "run", "--tied", "--theta", "0.1", "--ratio", ratio)
    document = call("advise", "run", "--tied", "--theta", "0.1", "--ratio", ratio, "--json").document
    rho = (1 + float(ratio)) / 0.1 - 1
    assert document["roles"][0]["rho"]["value"] == pytest.approx(rho)
    assert pasted(answer.out) == f"{document['theta']:g}"
    assert answer.out.splitlines()[-1].startswith("Next: ndtheory advise run --tied --theta")


def test_a_number_of_steps_is_none_where_nothing_falls():
    assert [steps(rate) for rate in (0, 0.1, 0.5, 1, 1.5)] == [1, 9, 30, None, None]


@pytest.mark.parametrize("form", FORMS)
def test_in_contact_the_table_of_methods_is_called_a_prediction_as_if_tied(call, write, form):
    said = flat(call("advise", write(), *FORMS[form]))
    warned = "Predicted as if tied: where contact changes, IQN-ILS may not arrive." in said
    assert "WHICH METHOD?" in said
    assert warned == ("--tied" not in FORMS[form])
