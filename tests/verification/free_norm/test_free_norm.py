"""The free norm on a mesh: as small a factor as a program with the norm among its unknowns, and never refuted."""

import json
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from full_program import FullProgram
from hypothesis import given
from problem_list import blocks, small
from strategies import AT_NIGHT, contact_problems, fewer, thetas

import verification as vf
from ndtheory.continuum.circle import disk
from verification.algorithm.fixed_point import FixedPointMap
from verification.bounds.bound import Subject
from verification.free_norm import norm
from verification.free_norm.circle import Circles
from verification.free_norm.norm import NEAR, SMALL, FreeNorm, friction_threshold
from verification.free_norm.radius import largest_radius
from verification.registry import BOUNDS
from verification.semidefinite import LMIError
from verification.semidefinite.multipliers import QuadraticForms
from verification.semidefinite.pattern_search import largest_factor
from verification.testing.transforms import problem_in_units, problem_mirrored

#: Least factors over all norms and multipliers by cvxpy and Clarabel, to 1e-5, both unknown: see full_program.py.
LEAST = {case["name"]: case for case in json.loads(Path(__file__).with_name("least_factors.json").read_text("utf-8"))}
CONTRACT = [name for name, case in LEAST.items() if case["least_q"] < 1]


def pair_of(name):
    return vf.build(vf.Problem.from_dict(LEAST[name]["problem"]))


def free(pair):
    return FreeNorm(pair, vf.measure(pair))


@pytest.mark.parametrize("name", CONTRACT)
def test_the_factor_is_the_least_over_all_norms(name):
    """Grids that match and that differ, both roles, with and without friction, and the local law."""
    found = free(pair_of(name)).factor(LEAST[name]["theta"]).factor
    least = LEAST[name]["least_q"]
    assert least * (1 - 1e-3) < found < least * (1 + 2 * NEAR)


@pytest.mark.parametrize("name", [name for name in LEAST if name not in CONTRACT])
def test_where_no_norm_contracts_none_is_found(name):
    assert free(pair_of(name)).factor(LEAST[name]["theta"]) is None


@pytest.mark.parametrize("name", LEAST if AT_NIGHT else ["blocks, 4 against 6 cells, k = 0.2"])
def test_the_program_with_the_norm_among_its_unknowns_changes_its_mind_at_the_least_factor(name):
    program, least = FullProgram(pair_of(name), LEAST[name]["theta"]), LEAST[name]["least_q"]
    assert program.proves(least * (1 + 1e-3)) is not None
    assert program.proves(least * (1 - 1e-3)) is None


# Of a program for the norm and the multipliers together, by Newton's method on a barrier, in plain numpy.
@pytest.mark.parametrize(
    ("k", "theta", "least"),
    [("0.2", 0.7, 0.339), ("0.9", 0.6, 0.567), *[("0.2", 0.8, 0.275), ("0.4", 0.7, 0.383)] * AT_NIGHT],
)
def test_section_6_has_the_factors_of_another_program(k, theta, least):
    found = free(vf.build(vf.example("section6").changed(friction=k))).factor(theta)
    assert found.factor == pytest.approx(least, rel=8e-3)


@given(data=contact_problems(law="nonlocal"), theta=thetas())
@fewer(5)
def test_no_step_no_piece_and_no_run_is_slower_than_proved(data, theta):
    """Random forces and the worst pieces of a search, in the norm that was found, and a run in (5.21)."""
    pair = vf.build(vf.Problem.from_dict(data))
    proof = free(pair).factor(float(theta))
    if proof is None:
        return
    T, size, random = FixedPointMap(pair), pair.neumann.grid.size, np.random.default_rng(0)
    image = lambda g: float(theta) * pair.interface.carry_back(T(g)[1].force) + (1 - float(theta)) * g
    scale = np.abs(image(np.zeros(size))).max() or 1.0
    for distance in (1e-3, 1.0, 1e3):
        one, other = scale * random.normal(size=(2, size))
        other = one + distance * other
        change = proof.norm.of(image(other) - image(one))
        assert change <= proof.factor * proof.norm.of(other - one) * (1 + 1e-9) + 1e-9 * proof.norm.of(one)
    kernel = pair.interface.kernel
    if not pair.rubs or np.linalg.matrix_rank(kernel) == len(kernel):  # then every pattern comes about
        worst = largest_factor(pair, float(theta), random=random, starts=3, norm=proof.norm)
        assert worst.value <= proof.factor * (1 + 1e-8)
        assert largest_radius(pair, float(theta), evaluations=40).value <= proof.factor * (1 + 1e-8)
    run = vf.run(pair, theta=theta)
    start = pair.neumann.dual_norm(run.iterates[0].g - run.last.g)
    for i, iterate in enumerate(run.iterates):
        error, bound = pair.neumann.dual_norm(iterate.g - run.last.g), proof.norm.condition**0.5 * proof.factor**i
        assert error <= bound * start + 1e-6 * run.last.scale


@given(data=contact_problems(law="nonlocal"), theta=thetas())
@fewer(5)
def test_the_norm_lies_between_5_21_and_its_condition_times_5_21(data, theta):
    pair = vf.build(vf.Problem.from_dict(data))
    proof = free(pair).factor(float(theta))
    if proof is not None:
        root = pair.neumann.root
        values = np.linalg.eigvalsh(root.T @ proof.norm.matrix @ root)
        assert 1 <= values[0] < 1 + 1e-4
        assert values[-1] <= proof.norm.condition * values[0] * (1 + 1e-9)


def test_without_friction_nothing_is_gained():
    pair = vf.build(vf.Problem.from_dict(small(contact={"friction": 0})))
    proof, energy = free(pair).factor(0.7), QuadraticForms(pair, vf.measure(pair)).factor(0.7)
    assert (proof.factor, proof.norm.condition) == (pytest.approx(energy.value, rel=1e-8), pytest.approx(1.0))
    assert largest_radius(pair, 0.7).value == pytest.approx(proof.factor, rel=1e-6)


@pytest.mark.parametrize("young", [(1, 1), (3, 1), (1, 3)])
def test_one_node_between_bars_contracts_for_every_theta_of_one_step(young):
    """With bars as stiff as each other the program of the circle has no row that is not 0."""
    found = free(vf.build(vf.example("two-bars").changed(young=young)))
    rho = young[0] / young[1]
    assert found.factor(0.05).factor == pytest.approx(0.95, abs=2 * NEAR)
    assert 0.99 * min(2 / (1 + rho), 1) <= found.largest_theta().theta <= min(2 / (1 + rho), 1)


def test_a_mirror_image_and_other_units_have_the_same_factor():
    problem = vf.Problem.from_dict(blocks(contact={"friction": "0.2", "radius": "0.6"}))
    images = [problem, problem_mirrored(problem), problem_in_units(problem, stress=Fraction(4096))]
    factors = [free(vf.build(image)).factor(0.2).factor for image in images]
    assert factors == pytest.approx([factors[0]] * 3, rel=NEAR)


def test_halves_of_a_mirrored_pair_give_what_the_whole_gives():
    pair = vf.build(vf.example("section6-60"))
    forms = QuadraticForms(pair, vf.measure(pair))
    assert forms.mirror is not None
    halves, ends = Circles(forms), disk(0.7, 0.36)
    forms.mirror = None
    whole = Circles(forms)
    assert halves.find(ends).margin == pytest.approx(whole.find(ends).margin, rel=2e-2)


def test_every_theta_up_to_the_largest_one_contracts_and_more_do_not_by_these_multipliers():
    pair = vf.build(vf.Problem.from_dict(small(contact={"friction": "3"})))
    one = free(pair)
    largest = one.largest_theta()
    assert 0.2 < largest.theta < 1
    for share in (0.1, 0.5, 0.95):
        assert one.factor(share * largest.theta).factor < 1
    assert one.factor(min(1.02 * largest.theta, 0.999)) is None


def test_the_friction_threshold_is_far_above_that_of_the_energy_norms():
    pair = vf.build(vf.Problem.from_dict(small()))
    measured = vf.measure(pair)
    energy = measured.friction_threshold.value
    k, proof = friction_threshold(pair, measured, energy)
    assert (proof.theta, proof.factor) == (SMALL, 1.0)
    assert k > 5 * energy
    assert FreeNorm(pair, measured, friction=1.03 * k).every_small_theta() is None
    # smaller thetas and smaller frictions contract as well
    assert FreeNorm(pair, measured, friction=k).factor(SMALL / 2).factor < 1
    assert FreeNorm(pair, measured, friction=k / 2).factor(SMALL).factor < 1


def test_a_larger_theta_in_the_same_norm_is_a_mean_of_the_identity_and_a_step():
    """If theta contracts by q in Q, s theta does by 1 - s (1 - q) in the same Q."""
    pair = vf.build(vf.Problem.from_dict(small()))
    proof = free(pair).factor(0.7)
    forms = QuadraticForms(pair, vf.measure(pair))
    for share in (0.25, 0.5):
        theta, q = 0.7 * share, 1 - share * (1 - proof.factor)
        weights = tuple(share * q / proof.factor * values for values in proof.multipliers)
        assert forms.traces.in_norm(proof.norm.matrix, weights, step=(theta, 1 - theta))(q**2 * (1 + 1e-9))


def test_a_form_that_is_not_definite_is_refused_with_its_rounding():
    pair = vf.build(vf.Problem.from_dict(small()))
    proof = free(pair).factor(0.7)
    forms = QuadraticForms(pair, vf.measure(pair))
    holds = forms.traces.in_norm(proof.norm.matrix, proof.multipliers, step=(0.7, 1 - 0.7))
    assert holds(proof.factor**2)
    assert not holds((0.99 * proof.factor) ** 2)
    assert not holds(float(Fraction(largest_radius(pair, 0.7).value) ** 2))


def test_equal_blocks_with_much_friction_have_no_norm():
    pair = vf.build(vf.Problem.from_dict(blocks(contact={"friction": "8", "radius": "0.3"})))
    assert free(pair).factor(0.3) is None


def fails(*given, **options):
    raise LMIError("no friction is found at which small thetas contract")


def test_where_no_friction_is_found_none_is_called_allowed(monkeypatch):
    """The contact body is so stiff that every theta up to SMALL is too large; any friction was shown."""
    pair = vf.build(vf.example("section6-60"))
    for name in ("factor", "largest_theta"):
        monkeypatch.setattr(FreeNorm, name, lambda *given: None)
    monkeypatch.setattr(norm, "friction_threshold", fails)
    found = BOUNDS["lyapunov"].evaluate(Subject.of(pair, vf.measure(pair)), 0.3)
    assert found.friction.every is None
    assert found.friction.on == "k"


def test_the_best_theta_has_three_digits_however_small(monkeypatch):
    factor = lambda self, theta, near=NEAR: SimpleNamespace(theta=theta, factor=1 - theta if theta < 3e-4 else theta)
    monkeypatch.setattr(FreeNorm, "factor", factor)
    unmade = object.__new__(FreeNorm)
    assert 2e-4 < unmade.best_theta(1e-3).theta < 1e-3
