"""Advice for a file of two rectangles says what layers of their depths predict, in both roles."""

from fractions import Fraction as F

import numpy as np
import pytest
from problem_list import blocks
from strategies import AT_NIGHT

import verification as vf
from ndtheory.continuum.circle import TwoLayers
from ndtheory.continuum.strip import Strip
from ndtheory.moduli import Moduli
from verification.coupling.sections import sections
from verification.free_norm.search import Search
from verification.free_norm.two_layers import two_layers
from verification.show.layout import text

SECTION_6 = vf.example("section6").changed(cells=((10, 2), (6, 2)))


def layer(young, depth):
    return Strip(body=Moduli(young=young, poisson="0.3"), thickness=F(depth))


@pytest.mark.skipif(not AT_NIGHT, reason="three seconds: by night")
def test_the_numbers_are_those_of_the_calculator_of_layers():
    found = vf.advise(SECTION_6)
    one, other = found.layers
    said = two_layers(
        young=(70000, 20000), poisson=("0.3", "0.3"), depth=("0.3", "0.3"), friction="0.2", radius="0.1",
        theta=F(one.theta),
    )  # fmt: skip
    assert one.factor.value == pytest.approx(said.roles[0].lyapunov.factor.value, rel=1e-4)
    for given, role in zip((one, other), said.roles, strict=True):
        assert given.neumann_body == role.neumann
        assert given.friction_threshold.value == pytest.approx(role.lyapunov.friction_threshold.value, rel=1e-4)
    assert [given.theta for given in found.layers] == [role.theta_predicted for role in found.roles]
    assert {given.factor.level for given in found.layers} == {"float"}


def test_depths_radius_and_friction_are_those_of_the_file():
    changed = SECTION_6.with_keys({"body1.y": "[-0.9, 0]", "contact.radius": "0.2", "contact.friction": "0.7"})
    lower, upper = layer(70000, "0.9"), layer(20000, "0.3")
    for given, contact, neumann in zip(vf.advise(changed).layers, (upper, lower), (lower, upper), strict=True):
        search = Search(TwoLayers(contact=contact, neumann=neumann, radius=F(1, 5)))
        assert given.factor.value == pytest.approx(search.factor(given.theta, 0.7), rel=1e-6)
        assert given.friction_threshold.value == pytest.approx(search.friction_threshold, rel=1e-6)


def test_the_roles_of_the_file_do_not_matter_and_the_mesh_only_by_its_theta():
    by_body = lambda problem: {of.neumann_body: of.friction_threshold.value for of in vf.advise(problem).layers}
    assert by_body(SECTION_6.swapped()) == by_body(SECTION_6) == by_body(SECTION_6.refined(1))


def test_friction_that_varies_counts_with_its_largest_coefficient():
    table = {"s": [0, F(12, 10)], "k": [F(1, 10), F(3, 10)]}
    varying, constant = (vf.advise(SECTION_6.changed(friction=k)).layers for k in (table, "0.3"))
    assert [of.factor for of in varying] == [of.factor for of in constant]


def test_where_no_norm_is_found_the_reason_is_given():
    found = vf.advise(SECTION_6.changed(friction="9"))
    for role in found.to_dict()["layers"]:
        assert role["factor"] is None
        assert "no norm" in role["reason"]["factor"]
        assert role["friction_threshold"]["value"] < 9
    assert "no factor below 1 at" in text(sections(found))


@pytest.mark.parametrize(
    "given",
    [
        SECTION_6.changed(friction=0),
        vf.Problem.from_dict(blocks(contact={"friction": "0.2", "law": "local"})),
        SECTION_6.with_keys({"body1.fixed": '["bottom", "left"]'}),
        vf.example("two-bars"),
        vf.example("stack"),
    ],
    ids=["without friction", "local law", "held at a side", "bars", "several bodies"],
)
def test_other_bodies_have_none(given):
    found = vf.advise(given)
    assert found.to_dict()["layers"] == []
    assert "layers" not in text(sections(found))


def test_a_tied_interface_and_advice_without_a_file_have_none():
    assert vf.advise(SECTION_6, tied=True).layers == ()
    assert vf.advise_matrices(np.eye(2), np.eye(2)).layers == ()


def test_the_screen_says_what_kind_of_number_it_is():
    said = " ".join(text(sections(vf.advise(SECTION_6))).split())
    first, _ = vf.advise(SECTION_6).layers
    shown = f"factor {first.factor.value:.4g} at {first.theta:.3g}, k < {first.friction_threshold.value:.2f}"
    assert f"Predicted for endless layers, in a norm of a proof's choice: body 1: {shown}; body 2:" in said


def test_bodies_that_differ_too_much_for_doubles_have_none():
    assert vf.advise(SECTION_6.changed(young=("7e4", "7e-20"))).layers == ()
