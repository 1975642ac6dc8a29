"""`advise moduli`: what the moduli alone say, on a screen and as a document."""

import itertools
import re

import pytest
from advice_calls import ROLE, fits, pasted
from complaints import assert_names
from strategies import AT_NIGHT

from verification.coupling.roles import TIED

GIVEN = ("--young", "7e4,2e4", "--poisson", "0.3,0.3")
SHAPES = [
    ",".join(word for word in words if word)
    for words in itertools.product(
        ("", "corners-none", "corners-both"),
        ("", "mirror-2", "mirror-1,mirror-2", "mirror-1,mirror-2,flat"),
        ("", "plane-stress", "3d"),
    )
]
FLUID = ("--density", "1000,1200", "--thickness", "1e-3", "--length", "0.05")
HEAT = ("--conductivity", "50,0.5")
OPTIONS = [("--shape", words) if words else () for words in SHAPES]
MODULI = [("7e4,2e4", "0.3,0.3"), ("2e4,2e4", "0.3,0.3"), ("1,2", "1/2,0.3"), ("1e-24,1e24", "0.499999999999,-0.9")]


@pytest.mark.parametrize(("young", "poisson"), MODULI)
def test_every_screen_fits_and_says_what_is_proved_and_what_is_not_claimed(call, young, poisson):
    for options in OPTIONS if AT_NIGHT else OPTIONS[MODULI.index((young, poisson)) % 2 :: 2]:
        answer = call("advise", "moduli", "--young", young, "--poisson", poisson, *options)
        assert (answer.status, answer.err) == (0, "")
        lines = answer.out.splitlines()
        fits(lines)
        assert "Proved without a mesh" in answer.out
        assert "Not claimed: a bound of rho from above with friction" in answer.out
        assert lines[-1].startswith("Next: ndtheory advise run --theta ")
        theta = re.findall(r"theta = (\S+), a guess", answer.out)
        assert theta  # one is named, and nothing says that there is none
        assert "no theta" not in answer.out


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


@pytest.mark.parametrize("kind", ["", "plane-stress", "3d"])
def test_nothing_is_pasted_unless_a_mirror_image_fits_into_the_body_that_is_tried(call, kind):
    shaped = lambda *words: (
        ("--shape", ",".join(word for word in (*words, kind) if word)) if any((*words, kind)) else ()
    )
    for corners in ("", "corners-none", "corners-1", "corners-2", "corners-both"):
        screen = call("advise", "moduli", *GIVEN, *shaped(corners)).out
        assert "TO PASTE" not in screen
        assert "relaxation value" not in screen
        assert "a guess" in screen.partition("WHICH THETA TO START WITH?")[2]
        assert "WHICH RUN NEXT?" not in screen  # one theta, in one place
    other = call("advise", "moduli", *GIVEN, *shaped("mirror-1")).out  # body 2 is no good Neumann body
    assert "TO PASTE" not in other
    assert "body 2, without friction" in other
    image = call("advise", "moduli", *GIVEN, *shaped("mirror-2"))
    assert "neumann_body = 1\n" in image.out
    assert "WHICH RUN NEXT?" not in image.out
    document = call("advise", "moduli", *GIVEN, *shaped("mirror-2"), "--json").document
    start = document["moduli"]["roles"][0]["start"]
    assert float(pasted(image.out)) == document["next"]["theta"] == start["theta_guess"]


def test_without_friction_the_start_is_proved_and_with_friction_it_is_called_a_guess(call):
    screen = " ".join(call("advise", "moduli", *GIVEN, "--shape", "mirror-2,corners-2,flat").out.split())
    assert "without friction: theta = 0.875, factor 0.125 a step, proved: rho_normal <= 0.286" in screen
    assert "with friction: theta = 0.7954, a guess: rho at most 0.514, as with a layer and its ends" in screen
    careful = " ".join(call("advise", "moduli", *GIVEN, "--shape", "mirror-2").out.split())
    assert "theta = 0.3344, a guess: rho at most 3.98, as with a slender column" in careful


def test_the_thetas_that_cannot_contract_are_those_from_two_over_one_plus_bound_on(call):
    screen = call("advise", "moduli", *GIVEN).out
    assert "body 1: none up to 1 is excluded" in screen
    assert "body 2: 0.274 and above where a piece may stick, 0.445 and above" in screen  # 2/7.3, 2/4.5 rounded up
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
    given = ("--young", "7e4,2e4", "--poisson", "0.4,0.1", "--shape")
    kinds = ["mirror-1,mirror-2", "mirror-1,plane-stress,mirror-2", "3d,mirror-2,mirror-1"]
    documents = [call("advise", "moduli", *given, kind, "--json").document for kind in kinds]
    assert [document["moduli"]["plane"] for document in documents] == ["strain", "stress", "3d"]
    starts = [document["moduli"]["roles"][1]["start"]["s"]["value"] for document in documents]
    assert all(a != b for a, b in itertools.combinations(starts, 2))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--young", "7e4,2e4"), ["--poisson = None", "two numbers"]),
        (("--poisson", "0.3,0.3"), ["--poisson alone", "--young"]),
        (("--young", "7e4", "--poisson", "0.3,0.3"), ["--young = 7e4", "two numbers E1,E2"]),
        (("--young", "", "--poisson", "0.3,0.3"), ["--young", "two numbers"]),
        (("--young", "-7e4,2e4", "--poisson", "0.3,0.3"), ["--young = -7e4", "E > 0"]),
        (("--young", "7e4,2e4", "--poisson", "0.3,0.6"), ["--poisson = 0.6", "-1 < nu <= 1/2"]),
        (("--young", "7e4,soft", "--poisson", "0.3,0.3"), ["--young = soft", "E > 0"]),
        (("my.toml", *GIVEN), ["received my.toml: needed options only"]),
        ((*GIVEN, "--theta", "0.3"), ["--theta is an option of ndtheory advise run"]),
        ((*GIVEN, "--shape", "plane-stress,3d"), ["--shape", "one plane"]),
        ((*GIVEN, "--shape", "corners-1,corners-2"), ["--shape", "one corners"]),
        ((*GIVEN, "--shape", "corners-1,mirror-2"), ["--shape, mirror = 2", "ends in a corner"]),
        ((*GIVEN, "--shape", "corners-3"), ["--shape = corners-3", "corners-1"]),
        ((*GIVEN, "--shape", "flat"), ["--shape = flat", "mirror-1"]),
        ((*GIVEN, "--dt", "1"), ["--dt = 1", "conductivity or density"]),
        ((), ["no material", "--conductivity"]),
        (("--dt", "1"), ["--dt alone", "--density"]),
        (("--conductivity", "1"), ["--conductivity = 1", "two numbers"]),
        (("--conductivity", "1,nan"), ["--conductivity = nan", "> 0"]),
        (("--conductivity", "1,1e13"), ["--conductivity = 1e13", "1e12"]),
        (("--conductivity", "1,2", "--dt", "1"), ["--capacity", "beside dt"]),
        ((*HEAT, "--capacity", "1,2", "--thickness", "1,1"), ["--dt", "beside capacity and thickness"]),
        (("--conductivity", "1,2", "--density", "1,2"), ["--density = 1,2", "no density beside conductivity"]),
        (("--conductivity", "1,2", "--young", "1,2"), ["--young = 1,2", "no young beside conductivity"]),
        (("--conductivity", "1,2", "--length", "1"), ["--length = 1", "no length beside conductivity"]),
        (("--conductivity", "1,2", "--shape", "3d"), ["--shape, plane = 3d", "beside conductivity"]),
        (("--density", "1,2"), ["--thickness", "beside density"]),
        (("--density", "1,2", "--thickness", "1"), ["--length", "beside density"]),
        ((*FLUID, "--young", "3e5"), ["--poisson", "beside young"]),
        ((*FLUID, "--young", "3e5", "--poisson", "0.3"), ["--dt", "beside young"]),
        ((*FLUID, "--young", "3e5", "--poisson", "0.6", "--dt", "1"), ["--poisson = 0.6", "1/2"]),
        ((*FLUID, "--poisson", "0.3", "--dt", "1"), ["--young", "beside poisson"]),
        ((*FLUID, "--capacity", "1,2"), ["--capacity = 1,2", "no capacity beside density"]),
        (("--density", "1,2", "--thickness", "1,2", "--length", "1"), ["--thickness = 1,2", "one number"]),
    ],
)
def test_what_no_two_bodies_have_is_refused_in_one_line(call, arguments, words):
    assert_names(call("advise", "moduli", *arguments).complaint, *words)


# --- heat and fluids -------------------------------------------------------------------------------------------------

WAVES = {
    "heat, steady": HEAT,
    "heat, in time": (*HEAT, "--capacity", "3.6e6,1.6e6"),
    "heat, thin plates": (*HEAT, "--capacity", "3.6e6,1.6e6", "--thickness", "0.01,0.05", "--dt", "10"),
    "heat, thin steady plates": (*HEAT, "--thickness", "0.01,0.05"),
    "plate": FLUID,
    "plate, with stiffness": (*FLUID, "--young", "3e5", "--poisson", "0.3", "--dt", "1e-3"),
    "tube": ("--density", "1000,1200", "--thickness", "1e-3", "--length", "0.05,0.005", "--dt", "1e-4"),
    "heavy plate": ("--density", "1,7800", "--thickness", "1e-2", "--length", "1"),
}


@pytest.mark.parametrize("parallel", [(), ("--parallel",)], ids=["serial", "parallel"])
@pytest.mark.parametrize("name", WAVES)
def test_the_screens_of_heat_and_of_fluids_fit_and_have_their_words(call, name, parallel):
    answer = call("advise", "moduli", *WAVES[name], *parallel)
    assert (answer.status, answer.err) == (0, "")
    lines, said = answer.out.splitlines(), " ".join(answer.out.split())
    fits(lines)
    heat = name.startswith("heat")
    words = ("fluxes", "temperatures") if heat else ("pressures", "displacements")
    assert f"solver reads {words[0]} and writes {words[1]}" in said
    assert not {"forces", "force", "stiffness" if heat else "temperature", "Gamma_c"} & set(said.split())
    document = call("advise", "moduli", *WAVES[name], *parallel, "--json").document
    assert document["tied"]
    assert document["waves"]["kind"] == ("heat" if heat else "fluid")
    assert [bool(document["parallel"]), bool(document["methods"])] == [bool(parallel), True]
    if heat:
        assert float(pasted(answer.out)) == document["theta"]
        wanted = document["roles"][document["neumann_body"] - 1]["theta_tied"]
        if parallel:
            wanted = {one["neumann_body"]: one["theta"] for one in document["parallel"]}[document["neumann_body"]]
        assert document["theta"] == pytest.approx(min(wanted, 0.99), rel=1e-3)
    else:
        assert "TO PASTE" not in answer.out
        assert document["theta"] is None
        assert (document["neumann_body"], document["roles"][1]["rho"]) == (2, None)
        rho = document["roles"][0]["rho"]["value"]
        assert document["next"]["theta"] == pytest.approx(1 / (2 + rho), rel=1e-3)
        assert (
            ("diverges" in said) == (rho > 1) == ("begin with 16 rows of absolute residuals with theta = 1" not in said)
        )


def test_parallel_coupling_of_elastic_bodies_bounds_its_factor_from_below(call):
    document = call("advise", "moduli", *GIVEN, "--parallel", "--json").document
    for one, role in zip(document["parallel"], document["roles"], strict=True):
        rho = role["rho"]["value"]
        assert (one["neumann_body"], one["bound"]) == (role["neumann_body"], True)
        assert (one["theta"], one["factor"]) == (pytest.approx(1 / (1 + rho)), pytest.approx((rho / (1 + rho)) ** 0.5))
    screen = " ".join(call("advise", "moduli", *GIVEN, "--parallel", "--shape", "mirror-2").out.split())
    assert "at least" in screen
    assert "These are for serial coupling" in screen
