"""`advise moduli`: what the moduli alone say, on a screen and as a document."""

import itertools
import re

import pytest
from advice_calls import ROLE, pasted
from complaints import assert_names

from verification.advice.roles import TIED

GIVEN = ("--young", "7e4,2e4", "--poisson", "0.3,0.3")
OPTIONS = [
    (*corners, *mirror, *kind)
    for corners in ((), ("--corners", "none"), ("--corners", "both"))
    for mirror in ((), ("--mirror", "2"), ("--mirror", "both"), ("--mirror", "both", "--flat"))
    for kind in ((), ("--plane-stress",), ("--three-dimensional",))
]
MODULI = [("7e4,2e4", "0.3,0.3"), ("2e4,2e4", "0.3,0.3"), ("1,2", "1/2,0.3"), ("1e-24,1e24", "0.499999999999,-0.9")]


@pytest.mark.parametrize(("young", "poisson"), MODULI)
def test_every_screen_fits_and_says_what_is_proved_and_what_is_not_claimed(call, young, poisson):
    for options in OPTIONS:
        answer = call("advise", "moduli", "--young", young, "--poisson", poisson, *options)
        assert (answer.status, answer.err) == (0, "")
        lines = answer.out.splitlines()
        assert max(map(len, lines)) <= 80, options
        assert len(lines) <= 46, options
        assert "Proved for the continuum" in answer.out
        assert "Not claimed: a bound of rho from above with friction" in answer.out
        assert lines[-1].startswith("Next: ndtheory advise run --theta ")


def test_the_document_has_both_roles_with_a_bound_from_below_and_nothing_predicted(call):
    found = call("advise", "moduli", *GIVEN, "--json").document
    assert found["schema"] == "ndtheory.advice/1"
    assert found["neumann_body"] == 1
    for role, bound in zip(found["roles"], (18 / 35, 6.3), strict=True):
        assert set(role) >= ROLE
        assert role["rho"] == {"value": pytest.approx(bound), "lo": role["rho"]["value"], "hi": None, "level": "exact"}
        assert {name for name in ROLE if role[name] is None} == set(role["reason"]) - {"theta_auto", *TIED}
        assert role["theta_predicted"] is role["theta_proved"] is None
        why = {role["reason"][name] for name in TIED}  # no run was made, so that no residual is the reason
        assert why == {"moduli bound rho from below, and no other end of the spectrum"}
    assert found["moduli"]["young"] == [70000, 20000]
    assert found["moduli"]["poisson"] == [0.3, 0.3]


@pytest.mark.parametrize("kind", [(), ("--plane-stress",), ("--three-dimensional",)])
def test_nothing_is_pasted_unless_a_mirror_image_fits_into_the_body_that_is_tried(call, kind):
    for corners in ((), *(("--corners", name) for name in ("none", "1", "2", "both"))):
        screen = call("advise", "moduli", *GIVEN, *corners, *kind).out
        assert "TO PASTE" not in screen
        assert "relaxation value" not in screen
        assert "a guess" in screen.partition("WHICH THETA TO START WITH?")[2]
        assert "WHICH RUN NEXT?" not in screen  # one theta, in one place
    other = call("advise", "moduli", *GIVEN, "--mirror", "1", *kind).out  # body 2 is no good Neumann body
    assert "TO PASTE" not in other
    assert "body 2, without friction" in other
    fits = call("advise", "moduli", *GIVEN, "--mirror", "2", *kind)
    assert "neumann_body = 1\n" in fits.out
    assert "WHICH RUN NEXT?" not in fits.out
    document = call("advise", "moduli", *GIVEN, "--mirror", "2", *kind, "--json").document
    assert (
        float(pasted(fits.out)) == document["next"]["theta"] == document["moduli"]["roles"][0]["start"]["theta_guess"]
    )


def test_without_friction_the_start_is_proved_and_with_friction_it_is_called_a_guess(call):
    screen = " ".join(call("advise", "moduli", *GIVEN, "--mirror", "2", "--corners", "2", "--flat").out.split())
    assert "without friction: theta = 0.875, factor 0.125 a step, proved: rho_normal <= 0.286" in screen
    assert "with friction: theta = 0.7954, a guess: rho at most 0.514, as with a layer and its ends" in screen
    careful = " ".join(call("advise", "moduli", *GIVEN, "--mirror", "2").out.split())
    assert "theta = 0.3344, a guess: rho at most 3.98, as with a slender column" in careful


def test_the_thetas_that_cannot_contract_are_those_from_two_over_one_plus_bound_on(call):
    screen = call("advise", "moduli", *GIVEN).out
    assert "body 1: none up to 1 is excluded" in screen
    assert f"body 2: {2 / 7.3:.3f} and above where a piece may stick, {2 / 4.5:.3f} and above" in screen
    document = call("advise", "moduli", *GIVEN, "--json").document
    every = document["moduli"]["roles"][1]["bounds"][0]
    assert every["corners"] == "none"
    assert every["theta_excluded_stick"] == pytest.approx(2 / 7.3)
    assert document["moduli"]["roles"][0]["bounds"][0]["theta_excluded_stick"] is None


def test_the_table_of_corners_is_that_of_both_bodies_in_both_roles(call):
    screen = call("advise", "moduli", "--young", "1,1", "--poisson", "0.3,0.3").out
    rows = re.findall(r"^  (any geometry|corners of .*?)  +(\S+) +(\S+) +(\S+) +(\S+)$", screen, re.M)
    assert [(name, *map(float, values)) for name, *values in rows] == [
        ("any geometry", 1.8, 1, 1.8, 1),
        ("corners of body 1", 5.5, 3.36, 1.8, 1),
        ("corners of body 2", 1.8, 1, 5.5, 3.36),
        ("corners of both bodies", 4.5, 1, 4.5, 1),
    ]
    assert "No difference" in screen


def test_the_three_kinds_of_bodies_have_different_numbers(call):
    given = ("--young", "7e4,2e4", "--poisson", "0.4,0.1", "--mirror", "both")
    kinds = [(), ("--plane-stress",), ("--three-dimensional",)]
    documents = [call("advise", "moduli", *given, *kind, "--json").document for kind in kinds]
    assert [document["moduli"]["plane"] for document in documents] == ["strain", "stress", "3d"]
    starts = [document["moduli"]["roles"][1]["start"]["s"]["value"] for document in documents]
    assert all(a != b for a, b in itertools.combinations(starts, 2))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--young", "7e4"), ["Missing option", "--poisson"]),
        (("--poisson", "0.3,0.3"), ["Missing option", "--young"]),
        (("--young", "7e4", "--poisson", "0.3,0.3"), ["--young = 7e4", "two numbers E1,E2"]),
        (("--young", "1,2,3", "--poisson", "0.3,0.3"), ["--young = 1,2,3", "two numbers"]),
        (("--young", "", "--poisson", "0.3,0.3"), ["--young", "two numbers"]),
        (("--young", "-7e4,2e4", "--poisson", "0.3,0.3"), ["--young = -7e4", "E > 0"]),
        (("--young", "7e4,2e4", "--poisson", "0.3,0.6"), ["--poisson = 0.6", "-1 < nu <= 1/2"]),
        (("--young", "7e4,soft", "--poisson", "0.3,0.3"), ["--young = soft", "E > 0"]),
        (("my.toml", *GIVEN), ["received my.toml: needed options only"]),
        ((*GIVEN, "--theta", "0.3"), ["--theta is an option of ndtheory advise run"]),
        ((*GIVEN, "--set", "contact.friction=0"), ["--set is an option of ndtheory advise FILE"]),
        ((*GIVEN, "--plane-stress", "--three-dimensional"), ["--plane-stress with --three-dimensional"]),
        ((*GIVEN, "--corners", "1", "--mirror", "2"), ["--mirror = 2", "ends in a corner"]),
        ((*GIVEN, "--corners", "3"), ["--corners", "'3'"]),
        ((*GIVEN, "--flat"), ["--flat without --mirror"]),
    ],
)
def test_what_no_two_bodies_have_is_refused_in_one_line(call, arguments, words):
    assert_names(call("advise", "moduli", *arguments).complaint, *words)
