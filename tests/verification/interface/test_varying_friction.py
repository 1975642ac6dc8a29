"""A coefficient of friction that varies along Gamma_c: everywhere w_j k_j in place of w_j k."""

from __future__ import annotations

import copy
import json
import tomllib
from dataclasses import replace
from fractions import Fraction as F

import numpy as np
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st
from problem_list import changed, small
from scipy.linalg import eigh

import verification as vf
from ndtheory.number import exact
from verification.algorithm.monolithic import solve
from verification.bounds.bound import Subject, Thresholds
from verification.certificate import check
from verification.certificate.claims import describe, same
from verification.certificate.continuum import certify_continuum
from verification.certificate.contraction import certify, check_again
from verification.interface.build import build
from verification.interface.files import write_interface
from verification.problem.specs import Profile
from verification.registry import BOUNDS
from verification.show.layout import text
from verification.sweeps.grid import SweepGrid
from verification.sweeps.store import keys
from verification.sweeps.sweep import sweep
from verification.testing.bounds import observed
from verification.testing.strategies import problems
from verification.testing.transforms import in_units, mirrored, problem_mirrored

VARYING = {"friction": st.integers(1, 10).map(lambda i: F(i, 10)), "varying": True}


def section_6(friction, **changes):
    return vf.example("section6").changed(friction=friction, cells=((10, 2), (6, 2)), **changes)


def table(*k, length=F(6, 5)):
    return {"s": [length * i / (len(k) - 1) for i in range(len(k))], "k": [exact(v) for v in k]}


RISING = table("0.1", "0.3", "0.2")


# --- the table --------------------------------------------------------------------------------------------------------


def test_a_constant_table_gives_every_digit_of_its_number():
    one, other = section_6("0.3"), section_6(table("0.3", "0.3", "0.3"))
    assert np.array_equal(vf.build(one).interface.kernel, vf.build(other).interface.kernel)
    runs = [vf.run(problem) for problem in (one, other)]
    assert np.array_equal(runs[0].last.g, runs[1].last.g)
    assert [found.contact.bound.tolist() for found in runs] == [runs[0].contact.bound.tolist()] * 2
    measured = [json.loads(vf.measure(problem).to_json()) for problem in (one, other)]
    solutions = [json.loads(solve(problem).to_json()) for problem in (one, other)]
    for two in (measured, solutions):
        for document in two:
            del document["problem"]
        assert two[0] == two[1]
    assert describe(one) == describe(other)


@given(problems(**VARYING))
def test_a_problem_with_a_table_is_read_back_from_its_dictionary_and_its_file(problem):
    assert vf.Problem.from_dict(problem.to_dict()) == problem
    assert vf.Problem.from_dict(tomllib.loads(problem.to_toml())) == problem
    assert vf.Problem.from_dict(json.loads(json.dumps(problem.to_dict()))).digest == problem.digest


def test_the_digest_of_a_problem_changes_with_each_number_of_its_table():
    digests = [section_6(RISING).digest, section_6("0.3").digest, section_6("0.1").digest]
    for name in ("s", "k"):
        moved = copy.deepcopy(RISING)
        moved[name][1] += F(1, 100)
        digests.append(section_6(moved).digest)
    assert len(set(digests)) == len(digests)


@given(st.lists(st.fractions(0, 1), min_size=2, max_size=6), st.data())
def test_the_share_between_two_positions_lies_on_the_line_between_them(values, data):
    s = [F(i) * 3 / 7 for i in range(len(values))]
    largest, profile = Profile.of(s, values)
    if not largest:
        assert profile is None
        return
    at = data.draw(st.fractions(0, s[-1]))
    expected = np.interp(float(at), [float(v) for v in s], [float(v) for v in values])
    assert float(largest * profile.at(at)) == pytest.approx(expected, abs=1e-12)
    assert [largest * profile.at(v) for v in s] == values
    assert max(profile.share) == 1


@pytest.mark.parametrize(
    ("friction", "said"),
    [
        ({"s": [0, 1], "k": ["0.1", "0.2"]}, "friction.s = [0, 1]: needed distances up to the length of Gamma_c, 1.2"),
        ({"s": ["0.1", "1.2"], "k": [1, 1]}, "friction.s = [0.1, 1.2]: needed increasing numbers, the first one at"),
        ({"s": [0, "0.6", "0.6", "1.2"], "k": [1, 1, 1, 1]}, "needed increasing numbers"),
        ({"s": [0, "1.2"], "k": [1]}, "friction.k = [1]: needed a list of two numbers or more"),
        ({"s": [0, "0.6", "1.2"], "k": [1, 1]}, "friction.k = [1, 1]: needed as many values as s has, 3"),
        ({"s": [0, "1.2"], "k": ["0.1", "-0.2"]}, "friction.k = [0.1, -0.2]: needed a number >= 0"),
        ({"s": [0, "1.2"]}, "friction.k: this key is missing"),
        ({"s": [0, "1.2"], "k": [1, 1], "kappa": 1}, "friction.kappa: unknown key"),
    ],
)
def test_a_bad_table_is_refused_in_one_line(friction, said):
    friction = {name: [F(v) for v in values] if name in "sk" else values for name, values in friction.items()}
    with pytest.raises(vf.ProblemError) as refused:
        vf.build(section_6(friction))
    line = str(refused.value).replace("1/10", "0.1").replace("-1/5", "-0.2").replace("6/5", "1.2")
    assert said in line
    assert "\n" not in line


def test_bars_take_no_table():
    with pytest.raises(vf.ProblemError, match="needed 0: two bars have no friction"):
        vf.example("two-bars").changed(friction=RISING)


# --- functions and arrays ---------------------------------------------------------------------------------------------


def test_a_function_a_table_and_an_array_are_one_friction():
    function = lambda s: 0.1 + s / 4
    plain = section_6("0.3")
    nodes = vf.build(plain).contact.grid.x
    pairs = [
        vf.build(plain.changed(friction=function)),
        vf.build(plain, friction=function),
        vf.build(plain, friction=function(nodes - nodes[0])),
        vf.build(plain, friction=table("0.1", "0.4")),
    ]
    for pair in pairs:
        assert float(pair.friction) * pair.interface.shares == pytest.approx(function(nodes - nodes[0]), rel=1e-14)
        assert pair.problem.contact.profile == pair.interface.profile


def test_matrices_take_a_coefficient_for_each_node():
    pair = vf.build(section_6(RISING))
    shares = float(pair.friction) * pair.interface.shares
    plain = vf.build(section_6("0.3"))
    lower, upper = pair.along_y
    given = {"S1": lower.schur, "S2": upper.schur, "load1": lower.load, "load2": upper.load, "x": pair.contact.grid.x}
    found = build(**given, kernel=plain.interface.kernel, friction=shares, neumann_body=pair.neumann_body)
    assert found.interface.kernel == pytest.approx(pair.interface.kernel, rel=1e-13)
    assert found.friction == pytest.approx(pair.friction)
    advice = vf.advise_matrices(
        lower.schur, upper.schur, friction=shares, x=pair.contact.grid.x, kernel=plain.interface.kernel
    )
    expected = vf.measure(pair).friction_threshold.value
    own = next(role for role in advice.roles if role.neumann_body == pair.neumann_body)
    assert own.friction_threshold.value == pytest.approx(expected, rel=1e-9)


def test_an_interface_file_keeps_the_friction_of_each_node(tmp_path):
    pair = vf.build(section_6(RISING))
    write_interface(pair, tmp_path / "interface.npz")
    found = vf.build(tmp_path / "interface.npz")
    assert np.array_equal(vf.run(found).last.g, vf.run(replace(pair, problem=None)).last.g)
    assert vf.build(tmp_path / "interface.npz", friction="0.1").friction == F(1, 10)


def test_an_obstacle_rubs_as_a_body_does():
    data = small(body1={"fixed": None})
    data["body1"] = {"shape": "rigid"}
    problem = vf.Problem.from_dict(data).changed(friction=RISING)
    found = solve(problem)
    k = np.interp(found.contact.x - found.contact.x[0], [0, 0.6, 1.2], [0.1, 0.3, 0.2])
    same = solve(problem.changed(friction="0.3", law="local")), solve(problem.changed(law="local"))
    assert same[0].contact.bound == pytest.approx(0.3 * same[0].contact.pressure, abs=1e-9)
    assert same[1].contact.bound == pytest.approx(k * same[1].contact.pressure, abs=1e-9)


@pytest.mark.parametrize("friction", [lambda s: -1.0, lambda s: float("nan"), [0.1, 0.2], "some", np.full((2, 2), 0.1)])
def test_a_friction_that_is_none_is_refused(friction):
    with pytest.raises(ValueError, match=r"friction.*needed"):
        vf.build(section_6("0.3"), friction=friction)


# --- bounds, runs -----------------------------------------------------------------------------------------------------


def test_the_friction_bound_at_each_node_has_its_own_coefficient():
    problem = section_6(RISING)
    run, plain = vf.run(problem), vf.build(section_6("1"))
    s = run.contact.x - run.contact.x[0]
    k = np.interp(s, [0, 0.6, 1.2], [0.1, 0.3, 0.2])
    stress = plain.interface.stress(run.last.g)
    assert run.contact.bound == pytest.approx(k * np.abs(stress), rel=1e-9)
    assert (np.abs(run.contact.shear) <= run.contact.bound * (1 + 1e-6)).all()
    slips = np.array(run.contact.status) == "slip"
    assert slips.any()
    assert np.abs(run.contact.shear[slips]) == pytest.approx(run.contact.bound[slips], rel=1e-6)


def test_the_iteration_and_the_global_method_agree_where_the_solution_is_unique():
    found = 0
    for friction in (RISING, table("0.4", "0", "0.1"), table("0", "0.2", "0", "0.3")):
        for law in ("nonlocal", "local"):
            run, solution = (f(section_6(friction, law=law)) for f in (vf.run, solve))
            assert run.converged
            scale = solution.contact.pressure.max()
            for name in ("pressure", "shear"):
                assert getattr(run.contact, name) == pytest.approx(getattr(solution.contact, name), abs=1e-7 * scale)
            found += len(set(solution.contact.status))
    assert found > 6  # nodes stick and slip


def test_all_of_the_friction_is_multiplied_at_another_largest_value():
    pair = vf.build(section_6(RISING))
    twice = section_6({"s": RISING["s"], "k": [2 * k for k in RISING["k"]]})
    at = pair.at(friction=2 * pair.friction)
    assert at.problem == twice
    assert np.array_equal(vf.run(at).last.g, vf.run(twice).last.g)
    rows = sweep(section_6(RISING), friction=["0.6"]).rows
    assert rows[0]["observed_rate"] == sweep(twice).rows[0]["observed_rate"]
    assert rows[0]["friction"] == 0.6
    assert pair.at(friction=0).at(friction=pair.friction).problem == pair.problem


def test_pairs_of_matrices_with_different_frictions_have_different_rows():
    pairs = [replace(vf.build(section_6(k)), problem=None) for k in ("0.3", RISING, table("0.3", "0.3"))]
    assert len({keys(pair, SweepGrid.of({}))[0] for pair in pairs}) == 3


@strategies.fewer(3)
@given(problems(**VARYING, law="nonlocal"))
def test_kappa_is_at_most_that_of_the_largest_coefficient_and_is_an_eigenvalue(problem):
    pair = vf.build(problem)
    constant = vf.build(problem.changed(friction=problem.contact.friction))
    measured, largest = vf.measure(pair), vf.measure(constant)
    if measured.kappa_1 is None or not pair.friction:
        return
    for name in ("kappa_1", "kappa_2", "C_K"):
        assert getattr(measured, name).value <= getattr(largest, name).value * (1 + 1e-9)
    # C_s anew: sup |k S sigma_N(w)|_L2 over w of energy 1
    s = pair.contact.grid.x - pair.contact.grid.x[0]
    written = problem.to_dict()["contact"]["friction"]
    k = np.full(len(s), float(problem.contact.friction))
    if isinstance(written, dict):
        k = np.interp(s, *([float(F(v)) for v in written[name]] for name in "sk"))
    stress = constant.interface.kernel @ pair.neumann.schur[pair.neumann.grid.normal]
    Z = (np.sqrt(pair.contact.grid.weights) * k)[:, None] * stress
    free = pair.neumann.free
    square = eigh(Z.T @ Z, pair.neumann.schur, eigvals_only=True)[-1] if free.all() else None
    if square is not None:
        C_s = float(pair.friction) * measured.C_s_energy.value
        assert C_s == pytest.approx(np.sqrt(max(square, 0.0)), rel=1e-6, abs=1e-12 * np.abs(stress).max())


def test_no_unit_of_length_and_no_mirror_changes_the_factor():
    pair = vf.build(section_6(RISING)).at(friction="0.05")
    theta = F(1, 2)
    factor = lambda one: BOUNDS["energy"].evaluate(Subject.of(one, vf.measure(one)), theta)
    expected = vf.measure(pair)
    for image in (in_units(pair, length=0.001), mirrored(pair)):
        found = vf.measure(image)
        for name in ("kappa_1", "kappa_2"):
            assert getattr(found, name).value == pytest.approx(getattr(expected, name).value, rel=1e-9)
        assert factor(image).factor.value == pytest.approx(factor(pair).factor.value, rel=1e-9)
        assert factor(image).interval == pytest.approx(factor(pair).interval, rel=1e-9)


def test_roles_exchanged_on_grids_that_differ_keep_the_friction_along_the_line():
    problem = vf.Problem.from_dict(changed(small(), body2={"cells": [5, 2]}, contact={"friction": 0}))
    length = float(np.ptp(vf.build(problem).contact.grid.x))
    friction = {"s": [0, length / 3, length], "k": [0.1, 0.3, 0.2]}
    problem = problem.changed(friction=friction)
    pair = vf.build(problem)
    back = pair.swapped()
    for each in (pair, back):
        x = each.contact.grid.x
        expected = np.interp(x - x[0], friction["s"], friction["k"])
        assert float(each.friction) * each.interface.shares == pytest.approx(expected, rel=1e-12)
    assert np.array_equal(back.interface.kernel, vf.build(problem.swapped()).interface.kernel)


# --- proofs -----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def certificate():
    problem = vf.Problem.from_dict(small())
    length = float(np.ptp(vf.build(problem).contact.grid.x))
    problem = problem.changed(friction={"s": [0, length / 2, length], "k": ["1/10", "3/10", "1/5"]})
    return problem, json.loads(certify(problem).to_json())


def test_a_certificate_has_the_rational_coefficients_and_is_accepted(certificate):
    problem, document = certificate
    found = check_again(document, problem)
    assert found.accepted
    assert found.same
    discrete, constant = document["discrete"], describe(problem.changed(friction="3/10"))
    pair = vf.build(problem)
    for own, other, share in zip(discrete["kernel"], constant["kernel"], pair.interface.shares, strict=True):
        shares = {F(a) / F(b) for a, b in zip(own, other, strict=True) if F(b)}
        assert len(shares) == 1
        assert float(shares.pop()) == pytest.approx(share, rel=1e-14)
    assert discrete["friction"] == "3/10"


@pytest.mark.parametrize("node", [0, 2])
def test_a_certificate_whose_coefficient_at_a_node_was_changed_is_refused(certificate, node):
    problem, document = certificate
    more = copy.deepcopy(document)
    more["discrete"]["kernel"][node] = [str(F(v) * 40) for v in more["discrete"]["kernel"][node]]
    assert not check_again(more, problem).accepted  # its hash
    more["sha256"] = check.digest(more["discrete"])
    found = check_again(more, problem)
    assert not found.accepted  # its multipliers
    assert not found.same
    less = copy.deepcopy(document)
    less["discrete"]["kernel"][node] = [str(F(v) / 2) for v in less["discrete"]["kernel"][node]]
    less["sha256"] = check.digest(less["discrete"])
    assert not check_again(less, problem).same


def test_a_certificate_of_a_table_is_not_about_its_largest_number(certificate):
    problem, document = certificate
    assert not same(describe(problem.changed(friction="3/10")), document["discrete"])


def test_proved_constants_hold_those_measured_with_a_table():
    problem = section_6(RISING)
    proved, measured = vf.measure(problem, verified=True), vf.measure(problem)
    for name in ("C_s", "C_K", "kappa_1", "kappa_2"):
        number = getattr(proved, name)
        assert number.level == "verified"
        assert number.lo * (1 - 1e-9) <= getattr(measured, name).value <= number.hi * (1 + 1e-9)


# --- what is shown ----------------------------------------------------------------------------------------------------


def test_screens_name_the_range_and_the_factor_by_which_friction_may_grow():
    problem = section_6(RISING)
    measured = vf.measure(problem)
    factor = f"{measured.friction_threshold.value / 0.3:.3g}"
    comparison, advice = text(vf.compare(problem).sections()), text(vf.advise(problem).sections())
    assert "k = 0.10 to 0.30, non-local" in comparison
    assert f"{factor} x given" in comparison
    assert f"less than {factor} times the friction" in " ".join(advice.split())
    assert "contracts for k <" not in advice


@pytest.mark.usefixtures("known_continuum")
@pytest.mark.skipif(not strategies.AT_NIGHT, reason="six seconds: by night")
def test_the_continuum_takes_the_largest_coefficient():
    found = certify_continuum(vf.example("section6").changed(friction=RISING))
    constants = found.content()["constants"]
    product = 0.3 * constants["C_s"]["value"] * constants["C_t1"]["value"]
    assert constants["kappa_1"]["value"] == pytest.approx(product, rel=1e-6)
    assert "contracts for max k < " in text(found.sections())


def test_thresholds_over_a_friction_are_rounded_outwards():
    pair = vf.build(section_6(RISING))
    found = BOUNDS["energy"].evaluate(Subject.of(pair, vf.measure(pair.problem, verified=True)), "1/2").friction
    over = found.over(pair.friction)
    assert over.on == "multiple"
    assert F(over.every.lo) * pair.friction <= F(found.every.lo)
    assert over.every.lo <= over.every.value
    assert Thresholds(on="any").over(F(1)) == Thresholds(on="any")


def test_the_mirror_image_of_a_problem_has_the_mirror_image_of_its_table():
    problem = vf.Problem.from_dict(small()).with_keys({"contact.interval": "[0.4, 1.6]"})
    low, high = problem.contact.interval
    problem = problem.changed(friction={"s": [0, high - low + 1], "k": [F(1, 10), F(1, 2)]})
    one, other = vf.build(problem), vf.build(problem_mirrored(problem))
    assert other.interface.shares == pytest.approx(one.interface.shares[::-1], rel=1e-12)


@pytest.mark.parametrize(("name", "friction"), [("energy", "0.1"), ("lmi", "0.5")])
def test_no_step_exceeds_the_factor_of_the_table_but_some_exceeds_that_of_the_least_coefficient(name, friction):
    data = small(contact={"interval": ["0.6", "1.4"], "radius": "0.2"})
    given = vf.Problem.from_dict(data).changed(theta="0.8")
    pair = vf.build(given.changed(friction=table("0.5", "0", "0.5", length=F(4, 5)))).at(friction=friction)
    theta, random = F(4, 5), np.random.default_rng(0)
    factor = lambda one: BOUNDS[name].evaluate(Subject.of(one, vf.measure(one)), theta).factor.value
    seen = 0.0
    for _ in range(3):
        force, other = (random.normal(size=pair.neumann.grid.size) for _ in range(2))
        seen = max(seen, observed(pair, float(theta), force, other, seed=0))
    assert seen <= factor(pair) * (1 + 1e-9)
    if name == "lmi":  # the only one of the two that is attained
        assert factor(vf.build(given.changed(friction=0))) < seen
    constant = vf.build(given.changed(friction=pair.friction))
    assert factor(pair) <= factor(constant) * (1 + 1e-9)
