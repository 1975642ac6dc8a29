"""Two solvers driven by vectors."""

import math
import pickle
from itertools import pairwise

import numpy as np
import pytest
from linear_couplings import Linear

import verification as vf
from verification.algorithm.fixed_point import FixedPointMap
from verification.algorithm.relaxation import Rule
from verification.coupling.driver import CouplingError


def bars():
    """Neumann body of stiffness 1, contact body of stiffness 3 whose end is 0.1 too far: T g = max(0, 0.3 - 3 g)."""
    return (lambda g: g / 1.0), (lambda u: np.maximum(0.0, 3 * (0.1 - u)))


@pytest.mark.parametrize("rule", ["constant", "aitken", "anderson", "iqn-ils"])
def test_two_bars_end_at_their_force(rule):
    neumann, contact = bars()
    found = vf.couple(neumann, contact, start=[0.0], rule=rule, theta="2/5", tolerance=1e-10)
    assert found.converged
    assert found.force[0] == pytest.approx(0.075)
    assert found.displacement[0] == pytest.approx(0.075)
    assert len(found.history) == found.iterations
    assert found.history[-1] < 1e-10 <= found.history[-2]


@pytest.mark.parametrize("rule", ["constant", "aitken", "anderson", "iqn-ils"])
@pytest.mark.parametrize("n", [1, 2, 30])
def test_linear_couplings_of_any_length_end_at_the_solution(rule, n):
    coupling = Linear(np.linspace(0.4, 4.0, n), n)
    neumann, contact = (lambda g: coupling.H @ g), (lambda u: coupling.b - u)
    found = vf.couple(neumann, contact, start=np.zeros(n), rule=rule, theta=0.3, max_iterations=500)
    assert found.converged
    assert found.force == pytest.approx(coupling.solution, rel=1e-4, abs=1e-4)
    assert found.spectrum.high <= 4.0 * 1.2
    assert found.advice.to_dict()["method"] is not None


def test_it_takes_the_steps_of_the_same_rule_on_the_same_bodies():
    problem = vf.example("section6").changed(cells=((10, 2), (6, 2)))
    pair = vf.build(problem)
    run, T = vf.run(pair, theta="0.6"), FixedPointMap(pair)
    settings = {"rule": "constant", "theta": "0.6", "tolerance": 1e-9, "max_iterations": 200}
    found = vf.couple(lambda g: g, lambda u: T(u)[1].force, start=np.zeros(pair.neumann.grid.size), **settings)
    assert found.converged
    assert found.force == pytest.approx(run.last.g, rel=1e-6, abs=1e-6 * np.abs(run.last.g).max())


def test_iterations_count_evaluations_and_the_limit_is_kept():
    calls = []
    neumann, contact = bars()
    found = vf.couple(
        lambda g: calls.append(1) or neumann(g), contact, start=0.0, rule="constant", theta=0.45, max_iterations=7
    )
    assert (len(calls), found.iterations, found.converged) == (7, 7, False)


def test_a_coupling_has_diverged_where_it_runs_away_or_five_changes_have_grown():
    """The change of the only mode is multiplied by 1 - theta (1 + lambda): -26.9, 0.5 and -1.2."""
    run = lambda slope, theta, most: vf.couple(
        lambda g: g, lambda u: 1 - slope * u, start=0.0, rule="constant", theta=theta, max_iterations=most
    )
    away = run(30, 0.9, 1000)
    assert (away.converged, away.diverged) == (False, True)
    assert away.iterations < 60
    assert away.spectrum.high == pytest.approx(30)
    assert away.summary.startswith(f"diverged, {away.iterations} evaluations")
    falls, grows = run(1, 0.25, 8), run(3.4, 0.5, 8)
    assert (falls.converged, falls.diverged, grows.diverged) == (False, False, True)
    assert falls.summary.startswith("not converged, 8 evaluations")
    assert grows.summary.startswith("diverged, 8 evaluations")
    assert [run(3.4, 0.5, n).diverged for n in range(1, 8)] == [False] * 4 + [True] * 3  # fewer may be a transient


@pytest.mark.parametrize("at", [1, 4])
@pytest.mark.parametrize("who", [0, 1])
@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_what_a_solver_raises_reaches_the_caller_and_nothing_is_called_after_it(at, who, error):
    calls = []

    def fails(which):
        def solver(x):
            calls.append(which)
            if which == who and calls.count(which) == at:
                raise error("mine")
            return 1 - np.array([0.2, 0.5, 0.7, 0.9, 1.0]) * x

        return solver

    with pytest.raises(error, match="mine"):
        vf.couple(fails(0), fails(1), start=np.zeros(5), tolerance=1e-14)
    assert calls == [0, 1] * (at - 1) + [0, 1][: who + 1]


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (lambda x: x * np.nan, "not finite"),
        (lambda x: np.append(x, 1.0), "4: needed a vector of 3 real numbers"),
        (lambda x: "three", "needed a vector"),
        (lambda x: None, "needed a vector"),
        (lambda x: 1j * x, "no real numbers"),
        (lambda x: np.zeros((3, 1)), "3 x 1: needed a vector of 3 real numbers"),
    ],
)
@pytest.mark.parametrize("who", ["neumann", "contact"])
def test_an_answer_that_is_no_vector_is_an_error_with_its_place(answer, words, who):
    solvers = {"neumann": lambda x: x / 2, "contact": lambda x: 1 - x, who: answer}
    with pytest.raises(CouplingError, match=rf"evaluation 1: what {who} returned .*{words}"):
        vf.couple(solvers["neumann"], solvers["contact"], start=np.zeros(3))


def test_solvers_may_change_their_arrays_and_return_the_same_one_again():
    own = np.zeros(2)

    def neumann(g):
        g *= 0.5
        return g

    def contact(u):
        own[:] = 1 - np.array([1.0, 3.0]) * u
        return own

    found = vf.couple(neumann, contact, start=np.zeros(2), rule="aitken", theta=0.4)
    assert found.force == pytest.approx([1 / 1.5, 1 / 2.5], rel=1e-5)


def test_a_listener_hears_each_evaluation_in_one_line():
    said = []
    coupling = Linear(np.linspace(3.0, 20.0, 12), 1)
    vf.couple(lambda g: coupling.H @ g, lambda u: coupling.b - u, start=np.zeros(12), theta=0.05, listen=said.append)
    assert [state.iterations for state in said] == list(range(1, len(said) + 1))
    assert said[0].spectrum is None
    assert str(said[0]).startswith("1: residual ")
    assert "lambda " in str(said[-1])
    assert all("\n" not in str(state) for state in said)
    assert said[-1].steps_left == 0
    assert any("exchange the roles: " in str(state) for state in said)
    assert "must take forces (fluxes)" in str(said[-1].advice.sections())


def test_a_loop_of_ones_own_takes_the_same_steps():
    coupling = Linear(np.linspace(0.4, 4.0, 6), 2)
    found = vf.couple(lambda g: coupling.H @ g, lambda u: coupling.b - u, start=np.zeros(6), rule="aitken", theta=0.3)
    own, g = vf.Coupling(rule="aitken", theta=0.3), np.zeros(6)
    for _ in range(found.iterations):
        last, g = g, own.next(g, coupling.b - coupling.H @ g)
    assert last == pytest.approx(found.force, rel=1e-12)
    assert own.spectrum.high == pytest.approx(found.spectrum.high, rel=1e-6)
    assert own.advice.theta == found.advice.theta


def test_rest_is_a_solution_and_before_two_vectors_there_is_no_spectrum():
    found = vf.couple(lambda g: g, lambda u: -u, start=np.zeros(4))
    assert (found.converged, found.iterations, found.spectrum, found.advice) == (True, 1, None, None)
    own = vf.Coupling()
    assert own.spectrum is None
    own.next([0.0], [1.0])
    assert own.advice is None


@pytest.mark.parametrize("rule", ["newton", "momentum"])
def test_a_rule_that_needs_both_bodies_is_refused(rule):
    with pytest.raises(ValueError, match=f"{rule!r} needs both bodies"):
        vf.Coupling(rule=rule)


def test_an_own_rule_that_works_on_vectors_is_taken():
    class Half(Rule):
        name, words = "half", "half"

        def begin(self, pair, theta, rho):
            raise NotImplementedError

        def on_vectors(self, theta, metric=None):
            return lambda g, image: (g + image) / 2

    found = vf.couple(lambda g: g, lambda u: 1 - 0.5 * u, start=0.0, rule=Half())
    assert found.force[0] == pytest.approx(2 / 3, rel=1e-5)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"rule": "broyden"}, "needed one of constant, aitken, anderson, iqn-ils"),
        ({"theta": 0}, "0 < theta <= 1"),
        ({"tolerance": 0}, "tolerance = 0: needed a number > 0"),
        ({"tolerance": math.inf}, "tolerance = inf: needed a number > 0"),
        ({"max_iterations": 0}, "max_iterations = 0: needed a whole number > 0"),
        ({"max_iterations": 2.5}, "max_iterations = 2.5: needed a whole number > 0"),
        ({"max_iterations": None}, "max_iterations = None: needed a whole number > 0"),
        ({"start": [[1.0]]}, "start is 1 x 1: needed a vector"),
        ({"start": []}, "start is a vector of 0: needed a vector"),
        ({"start": ["a"]}, "start has no real numbers"),
    ],
)
def test_bad_settings_are_refused_before_a_solver_is_called(settings, words):
    called = []
    with pytest.raises(ValueError, match=words):
        vf.couple(called.append, called.append, **{"start": 0.0, **settings})
    assert not called


def test_the_end_can_be_pickled():
    found = vf.couple(*bars(), start=0.0, theta=0.4)
    again = pickle.loads(pickle.dumps(found))
    assert again.summary == found.summary
    assert again.advice.to_json() == found.advice.to_json()
    assert not again.force.flags.writeable


# --- steps in time, wrong signs ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("rule", ["constant", "aitken", "anderson", "iqn-ils"])
def test_in_a_loop_over_time_only_differences_within_a_step_show_the_spectrum(rule):
    """The loads change by much more than the iterates do."""
    linear = Linear(np.array([0.4, 1.0, 3.0]), 3)
    told, mixed = vf.Coupling(rule=rule, theta=0.3), vf.Coupling(rule=rule, theta=0.3)
    g = np.zeros(3)
    for time in range(4):
        told.new_step()
        for _ in range(5):
            image = linear.b + 50.0 * time * np.array([1.0, -2.0, 3.0]) - linear.H @ g
            following = told.next(g, image)
            mixed.see(g, image)
            g = following
    assert told.spectrum.low == pytest.approx(0.4, rel=0.02)
    assert told.spectrum.high == pytest.approx(3.0, rel=0.02)
    if rule in ("constant", "aitken"):  # the others arrive in each step, and begin the next one where they arrived
        wrong = mixed.spectrum
        assert wrong is None or abs(wrong.high - 3.0) > 0.1 or abs(wrong.low - 0.4) > 0.1


def test_a_wrong_sign_is_told_where_the_end_is_printed():
    found = vf.couple(lambda g: g / 2, lambda u: 3 + 0.5 * u, start=0.0)
    assert found.converged
    assert (
        "but all eigenvalues seem to be negative, which these make: contact that changes, solvers with noise"
        in found.summary
    )


def over_springs(n, k, load, gap):
    """A cantilever under a load over one-sided springs: most of them are open at first, and all when it swings back."""
    x = np.arange(1, n + 1) / n
    near, far = np.minimum.outer(x, x), np.maximum.outer(x, x)
    bends = near**2 * (3 * far - near) / 6 + 1e-3 * np.eye(n)
    return lambda g: bends @ g + load * x**2, lambda u: -k * np.maximum(0, u - gap * (1 - 2.5 * np.sin(3 * x)))


@pytest.mark.parametrize(
    ("n", "k", "load", "most"), [(10, 3, 0.2, 12), (20, 3, 0.1, 55), (30, 1.4, 0.2, 14), (30, 3, 0.2, 14)]
)
def test_iqn_ils_evaluates_no_force_twice_where_all_springs_open(n, k, load, most):
    """A model of other pieces of T may have its solution at the last force: without a new start the first takes 27
    evaluations, the second more than 300."""
    beam, springs = over_springs(n, k, load, 0.02)
    forces = []
    found = vf.couple(lambda g: (forces.append(g.copy()), beam(g))[1], springs, start=np.zeros(n))
    assert found.converged
    assert found.iterations <= most
    for before, after in pairwise(forces[1:]):
        assert np.linalg.norm(after - before) > 1e-10 * np.linalg.norm(before)


def test_contact_that_changed_before_the_remembered_evaluations_is_remembered_as_such():
    """The springs are the same for the last twenty evaluations; IQN-ILS is still not advised as for tied bodies."""
    beam, springs = over_springs(30, 1.4, 0.2, 0.02)
    images = []
    answer = lambda u: (images.append(springs(u)), images[-1])[1]
    found = vf.couple(beam, answer, start=np.zeros(30), rule="constant", theta=0.4, tolerance=1e-9, max_iterations=200)
    patterns = [tuple(image == 0) for image in images]
    assert found.converged
    assert len(set(patterns[-20:])) == 1 < len(set(patterns))
    assert found.advice.vectors.changing
    assert not found.advice.tied
    assert found.advice.method.name == "aitken"
    tied = vf.couple(beam, lambda u: -1.4 * u, start=np.zeros(30), rule="constant", theta=0.2, max_iterations=200)
    assert not tied.advice.vectors.changing
