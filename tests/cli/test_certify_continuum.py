"""ndtheory certify --continuum: what it proves, what it refuses, what it says it cannot prove."""

from fractions import Fraction

import pytest
from strategies import AT_NIGHT

import verification as vf
from ndtheory import evaluate_energy
from ndtheory.continuum.rectangles import lower
from verification.certificate import continuum
from verification.free_norm.rectangles import RectangleNorm

pytestmark = pytest.mark.usefixtures("known_continuum")


def test_the_screen_says_that_section_6_contracts_at_its_own_friction_and_theta(call, write):
    answer = call("certify", "--continuum", write({"contact.radius": "0.1"}), "--theta", "0.6")
    said = " ".join(answer.out.split())
    assert answer.status == 0
    assert "Every small theta contracts for k < 0.2671" in said
    assert "theta = 0.6: factor <= 0.7917, guaranteed." in said
    assert "Not claimed: contraction on a mesh, which may need a smaller theta" in said
    assert max(map(len, answer.out.splitlines()[:-1])) <= 80


def test_the_document_has_one_proved_end_for_each_bound(call, write):
    document = call("certify", "--continuum", write({"contact.radius": "0.1"}), "--theta", "0.6", "--json").document
    assert (document["schema"], document["kind"]) == ("ndtheory.certificate/1", "continuum")
    assert (document["verdict"], document["solvable"]) == ("contraction", True)
    for name, number in document["constants"].items():
        if name != "K":
            assert number["level"] == "guaranteed"
            assert number["value"] == (number["lo"] if name in ("rho_least", "rho_ends") else number["hi"])
    assert document["factor"]["lo"] is None
    assert document["factor"]["hi"] < 0.792
    assert document["friction_threshold"]["hi"] is None
    assert document["friction_threshold"]["lo"] <= document["friction_limit"]["lo"]


def test_what_energy_norms_leave_open_is_proved_in_a_norm_that_the_proof_chooses(call, write):
    beyond = call("certify", "--continuum", write({"contact.radius": "0.1"}), "--theta", "0.95", "--json")
    assert (beyond.status, beyond.document["verdict"], beyond.document["factor"]) == (0, "contraction", None)
    assert "theta" in beyond.document["reason"]["factor"]
    free = beyond.document["free_norm"]
    assert free["theta_max"]["lo"] == 1
    assert free["factor"]["hi"] < 0.8
    assert {number["level"] for number in free.values() if "level" in (number if isinstance(number, dict) else ())} == {
        "guaranteed"
    }


@pytest.mark.skipif(not AT_NIGHT, reason="eight seconds: by night")
def test_friction_at_which_energy_norms_prove_no_theta_is_said_to_be_within_the_free_norm(call, write):
    rough = call("certify", "--continuum", write({"contact.friction": "0.4", "contact.radius": "0.1"}))
    said = " ".join(rough.out.split())
    assert rough.status == 0
    assert "no theta is proved to contract in energy norms" in said
    assert "In a norm that the proof chooses every small theta contracts for k < 0.80" in said
    assert max(map(len, rough.out.splitlines()[:-1])) <= 80


def test_a_friction_beyond_both_theorems_is_no_conclusion(call, write):
    answer = call("certify", "--continuum", write({"contact.friction": "0.9", "contact.radius": "0.1"}), "--json")
    assert (answer.status, answer.document["verdict"], answer.document["solvable"]) == (1, "no conclusion", False)
    free = answer.document["free_norm"]
    assert free["theta_max"] is free["factor"] is free["theta_best"] is free["factor_best"] is None
    assert "no multipliers" in free["reason"]["theta_max"]
    assert free["friction_threshold"]["lo"] < 0.9


def test_where_gamma_c_reaches_an_end_small_theta_are_proved_and_none_in_numbers(call, write):
    answer = call("certify", "--continuum", write({"contact.radius": "0.1"}), "--swap-roles")
    said = " ".join(answer.out.split())
    assert answer.status == 1
    assert "Every small theta contracts for k < 0.358:" in said
    assert "Nothing is proved for any particular theta" in said
    assert "In a norm that the proof chooses every small theta contracts for k < 0.80" in said
    assert "rho >= 19.26 wedges at the ends of Gamma_c" in said


@pytest.mark.skipif(not AT_NIGHT, reason="ten seconds and more: by night")
def test_the_mesh_enters_no_bound(call, write):
    coarse, fine = (
        call("certify", "--continuum", write({"body1.cells": cells}), "--theta", "0.4", "--json").document
        for cells in ("[10, 2]", "[80, 12]")
    )
    assert coarse["factor"] == fine["factor"]
    assert coarse["mesh"] != fine["mesh"]


#: Section 6 with the moduli exchanged and no friction; the upper cells are twice as high as wide, the lower are square.
EXCHANGED = {
    "body1.young": "2e4",
    "body2.young": "7e4",
    "contact.friction": "0",
    "body1.cells": "[40, 6]",
    "body2.cells": "[24, 3]",
}


def test_a_theta_that_contracts_in_the_continuum_and_not_on_the_mesh_is_shown_with_both_numbers(call, write):
    """rho_normal is 3.5 in the continuum and 4.5 on 25 nodes: theta = 0.43 lies between 2/5.5 and 2/4.5."""
    path = write(EXCHANGED)
    answer = call("certify", "--continuum", path, "--theta", "0.43")
    said = " ".join(answer.out.split())
    assert answer.status == 0
    assert "rho_normal: 4.5001 on 25 contact nodes (float); in the continuum <= 3.5, guaranteed." in said
    assert "On this mesh no theta from 0.3636 on contracts (float)." in said
    assert "theta = 0.43 contracts in the continuum (guaranteed), and NOT on this mesh (float)." in said
    assert "rho_normal of finer meshes of such cells tends to 4.5185 or more (float): no theta above 0.3624" in said
    assert said.index("NOT on this mesh") > said.index("guaranteed. DOES IT CONTRACT ON THE MESH")
    assert max(map(len, answer.out.splitlines()[:-1])) <= 80
    document = call("certify", "--continuum", path, "--theta", "0.43", "--json").document
    assert (document["verdict"], document["mesh"]["contracts"]) == ("contraction", False)
    assert document["mesh"]["rho_normal"]["level"] == "float"
    assert document["mesh"]["rho_normal_cells"]["value"] == pytest.approx(4.5184806, rel=1e-6)
    assert document["constants"]["rho_normal"]["level"] == "guaranteed"
    assert "a mesh, which may need a smaller theta" in document["not_claimed"]
    stalled = call("run", path, "--theta", "0.43", "--json")
    assert stalled.document["outcome"] == "stalled"
    assert call("run", path, "--theta", "0.33", "--json").document["outcome"] == "converged"


def test_the_best_theta_of_the_continuum_is_judged_where_the_file_has_none(call, write):
    """2/(2 + 3.5) = 0.36363.. lies a little above 2/(1 + 4.5001)."""
    mesh = call("certify", "--continuum", write({**EXCHANGED, "iteration.theta": '"auto"'}), "--json").document["mesh"]
    assert mesh["theta"] == pytest.approx(2 / 5.5)
    assert mesh["theta"] > mesh["theta_limit"]
    assert mesh["contracts"] is False


@pytest.mark.skipif(not AT_NIGHT, reason="ten seconds and more: by night")
def test_rho_of_the_mesh_is_that_of_constants_and_the_mesh_is_judged_by_its_own_bound(call, write):
    path = write({"contact.radius": "0.2"})
    mesh = call("certify", "--continuum", path, "--theta", "0.3", "--json").document["mesh"]
    measured = call("constants", path, "--json").document
    assert mesh["rho"]["value"] == pytest.approx(measured["rho_max"]["value"], rel=1e-12)
    assert mesh["rho_normal"]["value"] == pytest.approx(measured["rho_normal"]["value"], rel=1e-12)
    assert mesh["theta_limit"] == pytest.approx(2 / (1 + measured["rho_max"]["value"]))
    assert mesh["interface_nodes"] == measured["interface_nodes"]
    energy = vf.measure(path).energy_constants()
    seen = set()
    for theta in ("0.3", "0.99"):
        judged = call("certify", "--continuum", path, "--theta", theta, "--json").document["mesh"]["contracts"]
        assert judged is (True if evaluate_energy(energy, theta).verdict == "contraction" else None)
        seen.add(judged)
    assert seen == {True, None}
    stiff = write({"contact.radius": "0.2", "body1.young": "2e4", "body2.young": "7e4"})
    assert call("certify", "--continuum", stiff, "--theta", "0.5", "--json").document["mesh"]["contracts"] is False


@pytest.mark.skipif(not AT_NIGHT, reason="ten seconds and more: by night")
@pytest.mark.parametrize(
    ("edits", "why"),
    [
        ({"body1.cells": "[400, 2]"}, "up to 320 cells along a side and 30000 in all"),
        ({"contact.friction": "0.001", "contact.radius": "0.001"}, "the meshes are refused: "),
    ],
)
def test_where_rho_of_the_mesh_is_not_known_the_bounds_of_the_continuum_are_given_with_a_warning(
    call, write, edits, why
):
    path = write({"contact.radius": "0.1", "body1.cells": "[9, 2]", **edits})
    answer = call("certify", "--continuum", path, "--theta", "0.4")
    said = " ".join(answer.out.split())
    assert answer.status == 0
    assert "The mesh may need a smaller theta than the continuum" in said
    mesh = call("certify", "--continuum", path, "--theta", "0.3", "--json").document["mesh"]
    assert mesh["rho"] is mesh["contracts"] is mesh["theta_limit"] is None
    assert why in mesh["reason"]["rho"]


def test_without_friction_the_mirror_image_proves_the_classical_rate(call, write):
    document = call(
        "certify", "--continuum", write({"contact.friction": "0", "contact.radius": None}), "--json"
    ).document
    assert document["constants"]["rho_normal"]["hi"] == pytest.approx(2 / 7)
    assert document["factor_proved"]["hi"] == pytest.approx(1 / 8)


@pytest.mark.parametrize(
    ("theta", "verdict"), [("0.59", "contraction"), ("0.61", "no conclusion"), ('"auto"', "contraction")]
)
def test_every_theta_up_to_the_proved_one_contracts_without_a_factor(theta, verdict, call, write, monkeypatch):
    """The norm of a theta serves every smaller one; the search may still prove no factor there."""
    most = RectangleNorm(theta_max=lower(Fraction("0.6")))
    monkeypatch.setattr(continuum, "rectangle_norm", lambda *given: most)
    path = write({"contact.friction": "0.4", "contact.radius": "0.1", "iteration.theta": theta})
    answer = call("certify", "--continuum", path, "--json")
    assert (answer.document["interval"], answer.document["verdict"]) == (None, verdict)
    assert answer.status == (verdict != "contraction")


def test_a_factor_below_1_is_never_shown_as_1_and_a_small_theta_not_as_0(call, write):
    """Without friction the factor of a stiff contact body is 1 - theta up to theta = 1.3998..e-5."""
    stiff = write({"contact.friction": "0", "contact.radius": None, "body2.young": "1e10"})
    said = " ".join(call("certify", "--continuum", stiff, "--theta", "1e-5").out.split())
    assert "0 < theta < 1.399e-05; the best proved theta is 1.399e-05, factor <= 1 - 1.399e-05." in said
    assert "theta = 1e-05: factor <= 1 - 9.999e-06, guaranteed." in said


@pytest.mark.parametrize(
    ("edits", "key", "needed"),
    [
        ({"contact.law": '"local"', "contact.radius": None}, "contact.law", '"nonlocal"'),
        ({"body1.fixed": '["bottom", "left"]'}, "body1.fixed", '"bottom" only'),
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


def test_a_certificate_of_the_continuum_is_refused_by_the_check_of_those_of_meshes(call, write, tmp_path):
    target = tmp_path / "continuum.json"
    call("certify", "--continuum", write({"contact.radius": "0.1"}), "-o", target)
    complaint = call("certify", "--check", target).complaint
    assert "of the continuum" in complaint
    assert "KeyError" not in complaint
