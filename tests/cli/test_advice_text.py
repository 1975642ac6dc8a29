"""The answer of `advise`: roles, theta and steps, who reads what, what is proved, "auto", snippets and the quote."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from advice_calls import by_body, fits, given, pasted
from hypothesis import given as drawn
from strategies import AT_NIGHT, contact_problems, fewer

import verification as vf
from verification.cli.problems import examples
from verification.coupling.advice import Advice
from verification.coupling.kinds import kind_of
from verification.coupling.roles import steps
from verification.coupling.snippets import SNIPPETS
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


#: Screen and document of each form, which many tests look at.
KNOWN = {}


@pytest.fixture
def form(call, write):
    """``form(name)``: the answer and the document of a form."""

    def of(name):
        if name not in KNOWN:
            words = ("advise", write(), *FORMS[name])
            KNOWN[name] = call(*words), call(*words, "--json").document
        return KNOWN[name]

    return of


def flat(said):
    return " ".join(said.split())


def best_and_other(document):
    body = document["neumann_body"]
    return by_body(document)[body], by_body(document)[3 - body]


@pytest.mark.parametrize("name", FORMS)
def test_the_answer_fits_and_calls_the_table_of_methods_in_contact_a_prediction_as_if_tied(form, name):
    out = form(name)[0].out
    fits(out.splitlines())
    assert "WHICH METHOD?" in out
    warned = "Predicted as if tied: where contact changes, IQN-ILS may not converge." in flat(out)
    assert warned == ("--tied" not in FORMS[name])


@pytest.mark.parametrize("name", ["section 6", "section 6, tied", "without friction", "other roles"])
def test_it_says_how_many_steps_both_roles_take_and_who_reads_what(form, name):
    answer, document = form(name)
    said, (best, other) = flat(answer.out), best_and_other(document)
    rate = "rate_tied" if document["tied"] else "rate_predicted"
    assert f"{steps(best[rate])} steps to 1e-9, against" in said
    assert f"with the roles exchanged, {steps(other[rate])} steps" in said
    reads = f"solver reads forces and writes displacements, body {other['neumann_body']}'s the reverse."
    assert f"Body {document['neumann_body']}'s {reads}" in said
    assert "Relax displacements (heat: temperatures) alike, except in parallel coupling." in said


def test_roles_between_which_there_is_no_difference_are_told_so(call, tmp_path):
    """rho is 4 in either role."""
    words = given(tmp_path, np.diag([1.0, 4.0]), np.diag([4.0, 1.0]))
    assert "and no difference with the roles exchanged" in call(*words).out
    assert "the same with the roles exchanged." in call(*words, "--json").document["quote"]


def row_if_tied(out, role):
    return next(line for line in out.splitlines() if "if tied " in line and f"{role['theta_tied']:.3f}" in line)


def test_the_table_has_a_row_for_a_tied_interface_with_the_steps_of_both_thetas(form):
    answer, document = form("section 6")
    for role in document["roles"]:
        assert role["rate_tied"] < role["rate_predicted"]
        row = row_if_tied(answer.out, role)
        assert f"<= {steps(role['rate_tied'])} " in row
        at = max(abs(1 - role["theta_predicted"] * (1 + role[end]["value"])) for end in ("rho_min", "rho_tied"))
        assert row.endswith(f"{steps(at)} at {role['theta_predicted']:.3f}")


def test_tied_advice_says_what_it_assumes_and_pastes_the_tied_theta(form):
    answer, document = form("section 6, tied")
    assert pasted(answer.out) == f"{document['theta']:g}"
    assert document["theta"] == pytest.approx(best_and_other(document)[0]["theta_tied"], rel=1e-3)
    assert document["theta"] != form("section 6")[1]["theta"]
    assert "Not claimed: that nothing opens or slips, or that the coupling is linear." in answer.out
    assert f"--theta {document['theta']:g}" in answer.out.splitlines()[-1]


def test_a_frictionless_prediction_that_a_tied_interface_would_not_survive_is_marked(call, write):
    """2/(2 + rho_normal) may lie above 2/(1 + rho)."""
    file = write({"iteration.neumann_body": "2", "contact.friction": "0", "body2.poisson": "0.45"})
    roles, out = call("advise", file, "--json").document["roles"], call("advise", file).out
    grow = [role["theta_predicted"] * (1 + role["rho_tied"]["value"]) > 2 for role in roles]
    assert any(grow)
    assert ["grows at" in row_if_tied(out, role) for role in roles] == grow


# --- theta = "auto" and the advice -----------------------------------------------------------------------------------

SAME = 'This is what theta = "auto" takes, rounded.'


def explained(found):
    """Whether the pasted theta is that of "auto", or the screen says why not."""
    said = flat(text(found.sections()))
    auto = found.best.theta_auto
    if found.theta == 0.99 <= auto.theta:
        return f'theta = "auto" takes {float(auto.theta):.4g}; 0.99 is the largest to paste.' in said
    if abs(found.theta - auto.theta) <= 1e-3 * found.theta:
        return SAME in said
    proved = auto.source == "proved" and found.best.theta_proved == pytest.approx(float(auto.theta))
    told = f'theta = "auto" takes the proved {float(auto.theta):.4g}: at most twice the predicted steps.' in said
    return proved and told and SAME not in said


#: By day one mesh of each model.
EXAMPLES = [name for name in examples() if AT_NIGHT or not re.search(r"-\d{3}", name)]


@pytest.mark.parametrize("name", EXAMPLES)
def test_answers_for_built_in_problems_fit_and_agree_with_auto_or_say_why_not(name):
    problem = vf.example(name)
    both = [vf.advise(problem.changed(neumann_body=body)) for body in (1, 2)]
    assert all(map(explained, both))
    tied = Advice.of(replace(both[0].evidence, kind=kind_of(tied=True)))
    for found in (*both, tied):
        fits(text(found.sections()).splitlines())


@pytest.mark.parametrize("young", [7, 2000])
def test_a_theta_next_to_1_is_not_pasted_and_the_screen_says_what_auto_takes(call, write, young):
    out = call("advise", write({"body2.young": str(young)})).out
    capped = "0.99 is the largest to paste." in flat(out)
    assert capped == ("\n  theta = 0.99\n" in out) == (young == 7)


@fewer(5)
@drawn(contact_problems())
def test_auto_and_the_advice_agree_on_random_problems_or_the_screen_says_why_not(data):
    try:
        found = vf.advise(vf.Problem.from_dict(data))
    except vf.ProblemError:
        return
    assert explained(found)


# --- snippets and the quote ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("typed", ["preCICE", "kratos", "norma"])
def test_a_snippet_is_all_that_is_printed(call, write, typed):
    file, library = write(), {name.lower(): name for name in SNIPPETS}[typed.lower()]
    answer = call("advise", file, "--snippets", typed)
    assert (answer.status, answer.err) == (0, "")
    assert answer.out == vf.advise(vf.load(file)).snippet(library) + "\n"


def test_all_snippets_stand_below_their_names_and_have_one_theta(call, write, form):
    answer, document = form("section 6")
    assert "Whole blocks: --snippets preCICE, Kratos, Norma or all." in flat(answer.out)
    out, theta = call("advise", write(), "--snippets", "all").out, document["theta"]
    assert [line for line in out.splitlines() if line in SNIPPETS] == ["preCICE", "Kratos", "Norma"]
    settings = json.loads(re.search(r"\{\n.*\n\}", out, flags=re.S)[0])["solver_settings"]
    assert settings["convergence_accelerators"][0]["alpha"] == theta
    assert f'<relaxation value="{theta:g}" />' in out
    assert f"relaxation parameter: {theta:g}\n" in out


def test_there_is_no_snippet_while_readings_are_left(call):
    answer = call("advise", "run", "--theta", "0.1", "--ratio", "1.4", "--snippets", "all")
    assert answer.status == 0
    assert "WHICH RUN NEXT?" in answer.out
    assert answer.err == "no snippet: several readings or thetas are left; make the run that the answer names\n"


@pytest.mark.parametrize(
    ("words", "fragment"),
    [
        (["--snippets", "preCISE"], "--snippets = preCISE: needed one of preCICE"),
        (["--snippets", "all", "--json"], "received --snippets with --json"),
    ],
    ids=["unknown", "json"],
)
def test_snippets_that_cannot_be_had_are_refused_in_one_line(call, write, words, fragment):
    assert fragment in call("advise", write(), *words).complaint


def test_the_quote_has_the_numbers_of_the_document(form):
    answer, document = form("section 6")
    best, other = best_and_other(document)
    quote = document["quote"]
    assert f"is {best['rho']['value']:.3g} with body {document['neumann_body']} as Neumann body" in quote
    assert f"{other['rho']['value']:.3g} with the roles exchanged" in quote
    count, away = steps(best["rate_predicted"]), steps(other["rate_predicted"])
    assert f"2/(2+rho) = {best['theta_predicted']:.3g}: {count} steps to 1e-9 are predicted, against {away}." in quote
    assert quote in flat(answer.out)
    assert len(quote) < 280
    without = form("without friction")[1]["quote"]  # the theorem applies
    assert re.search(r": at most \d+ steps to 1e-9 without friction, against", without)


@pytest.mark.parametrize("ratio", ["1.4", "1.9"])
def test_a_tied_run_that_grows_gets_a_theta(call, ratio):
    words = ("advise", "run", "--tied", "--theta", "0.1", "--ratio", ratio)
    answer, document = call(*words), call(*words, "--json").document
    rho = (1 + float(ratio)) / 0.1 - 1
    assert document["roles"][0]["rho"]["value"] == pytest.approx(rho)
    assert pasted(answer.out) == f"{document['theta']:g}"
    assert answer.out.splitlines()[-1].startswith("Next: ndtheory advise run --tied --theta")


def test_a_number_of_steps_is_none_where_nothing_falls():
    assert [steps(rate) for rate in (0, 0.1, 0.5, 1, 1.5)] == [1, 9, 30, None, None]
