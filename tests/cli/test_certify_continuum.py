"""ndtheory certify --continuum: what it proves, what it refuses, what it says it cannot prove."""

import pytest

pytestmark = pytest.mark.usefixtures("known_continuum")


def test_the_screen_says_that_section_6_contracts_at_its_own_friction(call, write):
    answer = call("certify", "--continuum", write({"contact.radius": "0.1"}), "--theta", "0.4")
    said = " ".join(answer.out.split())
    assert answer.status == 0
    assert "Every small theta contracts for k < 0.2357" in said
    assert "theta = 0.4: factor <= 0.9469, guaranteed." in said
    assert "Not claimed: the local Coulomb law" in said
    assert max(map(len, answer.out.splitlines()[:-1])) <= 80


def test_the_document_has_one_proved_end_for_each_bound(call, write):
    document = call("certify", "--continuum", write({"contact.radius": "0.1"}), "--theta", "0.4", "--json").document
    assert (document["schema"], document["kind"]) == ("ndtheory.certificate/1", "continuum")
    assert (document["verdict"], document["solvable"]) == ("contraction", True)
    for name, number in document["constants"].items():
        if name != "segments":
            assert number["level"] == "guaranteed"
            assert number["value"] == (number["lo"] if name in ("rho_least", "rho_ends") else number["hi"])
    assert document["factor"]["lo"] is None
    assert document["factor"]["hi"] < 0.947
    assert document["friction_threshold"]["hi"] is None
    assert document["friction_threshold"]["lo"] <= document["friction_limit"]["lo"]


def test_a_theta_or_a_friction_beyond_the_proof_is_no_conclusion(call, write):
    beyond = call("certify", "--continuum", write(), "--theta", "0.7", "--json")
    assert (beyond.status, beyond.document["verdict"], beyond.document["factor"]) == (1, "no conclusion", None)
    assert "theta" in beyond.document["reason"]["factor"]
    rough = call("certify", "--continuum", write({"contact.friction": "0.4"}))
    assert rough.status == 1
    assert "no theta is proved to contract: no conclusion" in " ".join(rough.out.split())


def test_where_gamma_c_reaches_an_end_small_theta_are_proved_and_none_in_numbers(call, write):
    answer = call("certify", "--continuum", write({"contact.radius": "0.1"}), "--swap-roles")
    said = " ".join(answer.out.split())
    assert answer.status == 1
    assert "Every small theta contracts for k < 0.3076" in said
    assert "For no single theta is anything proved" in said
    assert "rho >= 19.26 wedges at the ends of Gamma_c" in said


def test_the_mesh_plays_no_part(call, write):
    coarse, fine = (
        call("certify", "--continuum", write({"body1.cells": cells}), "--theta", "0.4", "--json").document
        for cells in ("[10, 2]", "[80, 12]")
    )
    assert coarse["factor"] == fine["factor"]


def test_without_friction_the_mirror_image_proves_the_classical_rate(call, write):
    document = call(
        "certify", "--continuum", write({"contact.friction": "0", "contact.radius": None}), "--json"
    ).document
    assert document["constants"]["rho_normal"]["hi"] == pytest.approx(2 / 7)
    assert document["factor_proved"]["hi"] == pytest.approx(1 / 8)


@pytest.mark.parametrize(
    ("edits", "key", "needed"),
    [
        ({"contact.law": '"local"', "contact.radius": None}, "contact.law", '"nonlocal"'),
        ({"body1.fixed": '["bottom", "left"]'}, "body1.fixed", '"bottom" alone'),
        ({"body2.prescribed": '{ top = ["free", -0.015] }'}, "body2.prescribed.top", "both components"),
    ],
)
def test_what_the_theory_does_not_speak_of_is_refused_in_one_line(call, write, edits, key, needed):
    complaint = call("certify", "--continuum", write(edits)).complaint
    assert key in complaint
    assert needed in complaint
    assert "for the continuum" in complaint


def test_bars_are_refused(call, tmp_path):
    call("example", "two-bars")
    (tmp_path / "bars.toml").write_text(call("example", "two-bars").out, "utf-8")
    assert "dimension = 1: needed 2" in call("certify", "--continuum", str(tmp_path / "bars.toml")).complaint
