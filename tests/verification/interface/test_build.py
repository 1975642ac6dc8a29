"""Pairs: from matrices alone, at another friction, with the roles exchanged, with a law of one's own."""

from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
import pytest
from problem_list import plates
from strategies import AT_NIGHT

import verification as vf
from ndtheory import HypothesisError, evaluate_energy
from verification.algorithm.affine_piece import piece_of
from verification.algorithm.fixed_point import FixedPointMap
from verification.algorithm.rates import largest_step_ratio
from verification.algorithm.theta import energy_bounds
from verification.constants import measure
from verification.interface.build import build
from verification.interface.friction import Nonlocal, hat
from verification.interface.interface import Law
from verification.interface.pair import ContactPair
from verification.semidefinite.multipliers import QuadraticForms


def as_matrices(pair: ContactPair) -> dict[str, object]:
    """What `build` takes to make the same pair from matrices: normal components along y."""
    lower, upper = pair.along_y
    return {
        "S1": lower.schur,
        "S2": upper.schur,
        "load1": lower.load,
        "load2": upper.load,
        "x": pair.contact.grid.x,
        "gap": pair.interface.gap,
        "kernel": pair.interface.kernel,
        "friction": pair.friction,
        "neumann_body": pair.neumann_body,
    }


def small(**changes: object) -> vf.Problem:
    """Section 6 with 7 contact nodes."""
    problem = vf.Problem.from_dict(plates())
    cells = {"body1": (10, 2), "body2": (6, 2)}
    bodies = {name: replace(getattr(problem, name), cells=cells[name]) for name in cells}
    contact = replace(problem.contact, **{k: v for k, v in changes.items() if k in ("friction", "gap")})
    iteration = replace(problem.iteration, **{k: v for k, v in changes.items() if k in ("neumann_body", "theta")})
    return replace(problem, contacts=(contact,), iteration=iteration, **bodies)


@pytest.mark.parametrize("neumann_body", [1, 2])
@pytest.mark.parametrize("friction", ["0", "1/5"])
def test_a_pair_from_its_matrices_is_the_pair(neumann_body, friction):
    pair = build(small(neumann_body=neumann_body, friction=Fraction(friction), theta=Fraction(1, 10)))
    other = replace(build(**as_matrices(pair)), settings=pair.settings)
    one, two = vf.run(pair).linearise(), vf.run(other).linearise()
    assert one.converged
    assert two.iterations == one.iterations
    assert two.history == pytest.approx(one.history, rel=1e-6, abs=1e-12)
    assert two.linearised.rate == pytest.approx(one.linearised.rate, rel=1e-9)
    assert two.contact.status == one.contact.status
    assert two.contact.shear == pytest.approx(one.contact.shear, rel=1e-9, abs=1e-9 * np.abs(one.contact.shear).max())
    bounds = [evaluate_energy(measure(p).energy_constants(), Fraction(1, 10)) for p in (pair, other)]
    for name in ("rho", "kappa_1", "kappa_2", "factor_proved"):
        first, second = (getattr(b, name) for b in bounds)
        assert (first is None) == (second is None)
        assert first is None or second.value == pytest.approx(first.value, rel=1e-12)
    factors = [QuadraticForms(p, measure(p)).factor(0.1).value for p in (pair, other)]
    assert factors[1] == pytest.approx(factors[0], rel=1e-6)


def test_what_needs_meshes_says_so():
    pair = build(**as_matrices(build(small())))
    measured = measure(pair)
    assert measured.m is measured.C_R is measured.constants() is None
    assert "matrices" in measured.reason["m"]
    content = measured.content()
    assert all(name in content["reason"] for name, value in content.items() if value is None)
    for needs in (vf.solve, lambda p: measure(p, refine=1), lambda p: vf.run(p).displacements):
        with pytest.raises(ValueError, match="matrices"):
            needs(pair)
    settings = replace(pair.settings, max_iterations=1)
    short = vf.run(replace(pair, settings=settings)).linearise()
    assert not short.converged
    assert "meshes" in short.why_not_linearised


def test_a_pair_from_matrices_has_settings_of_its_own_and_one_from_a_file_those_of_the_file():
    problem = small()
    pair = build(problem)
    assert pair.settings == problem.iteration.settings
    settings = build(**as_matrices(pair)).settings
    assert (settings.theta, settings.tolerance, settings.max_iterations) == (Fraction(1, 2), 1e-9, 500)


# --- grids that differ ------------------------------------------------------------------------------------------------


def spd(random: np.random.Generator, size: int) -> np.ndarray:
    """A symmetric positive definite matrix of condition some ten, as of a body with few interface nodes."""
    A = random.normal(size=(size, size))
    return A @ A.T + size * np.eye(size) / 2


@dataclass(frozen=True, kw_only=True)
class Unlike:
    """A random pair whose grids have 4 and 6 nodes."""

    pair: ContactPair
    P: np.ndarray
    random: np.random.Generator


def unlike(seed: int, friction: float, neumann_body: int = 2) -> Unlike:
    random = np.random.default_rng(seed)
    n, m = 4, 6
    P = random.uniform(-0.1, 1, (n, m))
    P /= P.sum(axis=1, keepdims=True)  # a constant passes
    x, y = np.sort(random.uniform(0, 1, n)), np.linspace(0, 1, m)
    sizes = (2 * n, 2 * m) if neumann_body == 2 else (2 * m, 2 * n)
    pair = build(
        S1=spd(random, sizes[0]),
        S2=spd(random, sizes[1]),
        load1=random.normal(size=sizes[0]),
        load2=random.normal(size=sizes[1]),
        x=x,
        gap=random.uniform(0, 0.1, n),
        kernel=hat(x[:, None] - y[None, :], 0.5),
        transfer=P,
        friction=Fraction(friction).limit_denominator(1000),
        neumann_body=neumann_body,
    )
    return Unlike(pair=pair, P=P, random=random)


@pytest.mark.parametrize("seed", range(6) if AT_NIGHT else range(3))
def test_across_unlike_grids_T_returns_what_equilibrium_and_contact_ask_for(seed):
    """Step I and II written out anew: displacements go by P, forces come back by its transpose."""
    case = unlike(seed, 0.4, 2 - seed % 2)
    pair, P = case.pair, np.kron(np.eye(2), case.P)
    n = 4
    g = case.random.normal(size=12)
    u, solution = FixedPointMap(pair)(g)
    assert pair.neumann.schur @ u == pytest.approx(g + pair.neumann.load)
    trace = P @ u + solution.v + np.concatenate([np.zeros(n), pair.interface.gap])
    assert pair.contact.load - pair.contact.schur @ trace == pytest.approx(solution.force, abs=1e-9)
    bound = 0.4 * pair.contact.grid.weights * np.abs(pair.interface.kernel @ g[6:])
    slip, gap = solution.v[:n], -solution.v[n:]
    assert np.all(np.abs(solution.force[:n]) <= bound + 1e-9)
    assert solution.force[:n] * slip == pytest.approx(bound * np.abs(slip), abs=1e-9)
    assert np.all(gap >= -1e-9)
    assert np.all(solution.force[n:] >= -1e-9)
    assert gap * solution.force[n:] == pytest.approx(0, abs=1e-9)
    state = next(vf.iterate(pair, start=g))
    assert state.image == pytest.approx(P.T @ solution.force)


@pytest.mark.parametrize("seed", range(6) if AT_NIGHT else range(3))
def test_across_unlike_grids_the_derivative_is_a_difference_of_T(seed):
    case = unlike(seed, 0.4)
    T = FixedPointMap(case.pair, "active-set")
    g = case.random.normal(size=12)
    pattern = T(g)[1].pattern
    piece, d = piece_of(case.pair, g, pattern), 1e-7 * case.random.normal(size=12)
    after = T(g + d)[1]
    assert after.pattern == pattern
    change = case.pair.interface.carry_back(after.force - T(g)[1].force)
    assert change == pytest.approx(piece.force @ d, abs=1e-6 * np.linalg.norm(d))


@pytest.mark.parametrize("seed", range(8) if AT_NIGHT else range(3))
@pytest.mark.parametrize("friction", [0.0, 0.05])
def test_across_unlike_grids_no_step_exceeds_the_bounds(seed, friction):
    """Observed <= semidefinite <= energy norms, for pairs of forces of every size."""
    case = unlike(seed, friction)
    pair, measured = case.pair, measure(case.pair)
    T, norm = FixedPointMap(pair), pair.neumann.dual_norm
    theta = float(energy_bounds(measured).theta_predicted) * 0.8
    energy = evaluate_energy(measured.energy_constants(), theta)
    lmi = QuadraticForms(pair, measured).factor(theta).value
    worst = 0.0
    for _ in range(60):
        g, d = case.random.normal(size=(2, 12)) * 10.0 ** case.random.uniform(-2, 1, (2, 1))
        images = [pair.interface.carry_back(T(force)[1].force) for force in (g, g + d)]
        worst = max(worst, norm(theta * (images[1] - images[0]) + (1 - theta) * d) / norm(d))
    assert worst <= lmi * (1 + 1e-9)
    assert energy.factor is None or lmi <= energy.factor.value * (1 + 1e-6)
    if friction == 0:
        assert energy.factor is not None
        assert worst >= 0.5 * lmi  # the bounds are those of this pair, not of any


def test_a_run_across_unlike_grids_ends_at_the_fixed_point():
    pair = unlike(1, 0.1).pair
    done = vf.run(pair, theta="1/4")
    assert done.converged
    assert done.last.image == pytest.approx(done.last.g, abs=1e-7 * np.abs(done.last.g).max())
    ratio = largest_step_ratio(pair, done.iterates)
    assert ratio.value <= QuadraticForms(pair, measure(pair)).factor(0.25).value


def test_roles_across_unlike_grids_are_not_exchanged():
    with pytest.raises(ValueError, match="its own transfer"):
        unlike(0, 0.1).pair.swapped()


# --- another friction, other roles ------------------------------------------------------------------------------------


def test_at_another_friction_everything_condensed_is_shared_and_the_run_is_that_of_the_file():
    pair = build(small())
    other = pair.at(friction="1/2")
    assert other.contact is pair.contact
    assert other.neumann is pair.neumann
    assert other.interface is pair.interface
    assert other.problem.contact.friction == Fraction(1, 2)
    again = vf.run(small(friction=Fraction(1, 2)))
    assert vf.run(other).history == again.history


def test_exchanged_roles_are_those_of_the_file_and_twice_exchanged_the_old_ones():
    pair = build(small())
    swapped, file = pair.swapped(), build(small().swapped())
    assert swapped.neumann_body == file.neumann_body
    assert swapped.problem == file.problem
    assert np.array_equal(swapped.contact.schur, file.contact.schur)
    assert np.array_equal(swapped.neumann.load, file.neumann.load)
    assert swapped.contact.body is pair.neumann.body
    assert np.array_equal(swapped.swapped().contact.schur, pair.contact.schur)


@pytest.mark.parametrize(("friction", "why"), [("-1", ">= 0"), ("nan", ">= 0"), ("much", ">= 0")])
def test_a_friction_that_is_none_is_refused(friction, why):
    with pytest.raises(HypothesisError, match=why):
        build(small()).at(friction=friction)


def test_without_a_law_there_is_no_friction():
    arguments = as_matrices(build(small())) | {"kernel": None, "friction": 0}
    with pytest.raises(HypothesisError, match="law of friction"):
        build(**arguments).at(friction="0.1")
    with pytest.raises(HypothesisError, match="law of friction"):
        build(**arguments | {"friction": "0.1"})


# --- a law of one's own -----------------------------------------------------------------------------------------------


class Box(Law):
    """A kernel that is constant over a width."""

    name = "box"
    words = "box kernel"

    def operator(self, interface):
        return (np.abs(interface.contact.x[:, None] - interface.neumann.x) <= 0.15) / 0.3


class Doubtful(Box):
    name = "doubtful"
    outside = "the doubtful law: nobody has proved anything"

    def warnings_after(self, interface, k, pressure, bound):
        return [f"{interface.contact.n} nodes are doubtful"]


def test_a_law_of_ones_own_is_run_measured_and_bounded():
    problem = small()
    pair = build(problem, law=Box())
    x = pair.contact.grid.x
    assert pair.interface.kernel == pytest.approx((np.abs(x[:, None] - x) <= 0.15) / 0.3)
    done = vf.run(pair)
    assert done.outside == []
    g = done.last.g
    bound = 0.2 * pair.contact.grid.weights * np.abs(pair.interface.kernel @ g[len(x) :])
    assert np.all(np.abs(done.last.image[: len(x)]) <= bound * (1 + 1e-9))
    measured = measure(pair)
    assert measured.kappa_1.value != measure(problem).kappa_1.value
    assert largest_step_ratio(pair, done.iterates).value <= QuadraticForms(pair, measured).factor(0.7).value


def test_a_law_outside_the_theorem_and_its_warnings_are_told():
    pair = build(small(), law=Doubtful())
    assert pair.outside == ["the doubtful law: nobody has proved anything"]
    assert pair.at(friction=0).outside == []
    done, smooth = vf.run(pair), vf.run(pair.at(friction=0))
    assert done.outside == pair.outside
    assert "7 nodes are doubtful" in done.warnings
    assert "7 nodes are doubtful" not in smooth.warnings


def test_a_matrix_in_place_of_the_kernel_and_the_law_it_comes_from_give_one_operator():
    pair = build(small())
    arguments = as_matrices(pair) | {"kernel": None, "law": Nonlocal(radius=0.2)}
    assert np.array_equal(build(**arguments).interface.kernel, pair.interface.kernel)


# --- what is refused --------------------------------------------------------------------------------------------------


def test_without_friction_matrices_need_no_positions_of_their_nodes():
    given = as_matrices(build(small(friction=0))) | {"kernel": None}
    placed, bare = build(**given), build(**given | {"x": None})
    one, two = vf.run(placed), vf.run(bare)
    assert (two.converged, two.iterations) == (True, one.iterations)
    assert np.array_equal(two.last.g, one.last.g)
    assert two.contact.x.tolist() == [*range(7)]
    assert two.contact.pressure == pytest.approx(one.contact.pressure * placed.contact.grid.weights)
    assert vf.advise(bare).to_dict()["roles"] == vf.advise(placed).to_dict()["roles"]
    assert vf.measure(bare).rho_max == vf.measure(placed).rho_max
    for friction in ("1/10", np.full(7, 0.1), lambda s: s):
        with pytest.raises(ValueError, match="needed x, the positions"):
            build(**given | {"x": None, "friction": friction})


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"S1": None}, "S1 and S2"),
        ({"x": None}, "needed x, the positions of the contact nodes, as there is friction"),
        ({"S1": np.eye(14)[:, :13]}, "square"),
        ({"S1": np.eye(13)}, "two components"),
        ({"S1": -np.eye(14)}, "positive definite"),
        ({"S1": np.eye(14) + np.triu(np.ones((14, 14)), 1)}, "symmetric"),
        ({"S1": np.full((14, 14), np.nan)}, "finite"),
        ({"S2": np.eye(12)}, "same contact nodes, or a transfer"),
        ({"x": np.zeros(7)}, "increase"),
        ({"x": np.arange(6.0)}, "6: needed 7"),
        ({"weights": -np.ones(7)}, "positive"),
        ({"gap": np.full(7, np.inf)}, "finite"),
        ({"load1": np.ones(3)}, "3: needed 14"),
        ({"kernel": np.eye(3)}, "3 x 3: needed 7 x 7"),
        ({"transfer": np.eye(3)}, "3 x 3: needed 7 x 7"),
        ({"neumann_body": 3}, "1 or 2"),
        ({"law": Nonlocal(radius=1.0)}, "a kernel and a law"),
        ({"law": Nonlocal(radius=1.0), "kernel": None, "transfer": np.eye(7)}, "needed a kernel"),
        ({"problem": small()}, "a problem and matrices"),
    ],
)
def test_what_does_not_fit_is_refused_in_words(changes, why):
    with pytest.raises(ValueError, match=why):
        build(**as_matrices(build(small())) | changes)


@pytest.mark.parametrize("given", [None, 3, [], {}])
def test_what_is_no_problem_is_refused_by_every_function_that_takes_one(given):
    for take in (vf.solve, vf.run, vf.measure, vf.advise, vf.compare, vf.march, vf.sweep, vf.certify):
        with pytest.raises(ValueError, match="needed a problem"):
            take(given)


def test_a_pair_of_matrices_has_no_problem_to_change():
    pair = vf.build(S1=np.diag([2.0, 3.0]), S2=np.eye(2), x=np.zeros(1))
    with pytest.raises(ValueError, match="made from matrices"):
        pair.changed(young=(1, 2))
    made = vf.build(vf.example("section6-60"))
    assert made.changed(young=(1, 2)).problem.body2.young == 2
