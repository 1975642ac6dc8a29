"""Couplings that are copied, restarted, ended by an absolute tolerance or by who listens, and that jump at first."""

import copy
import pickle

import numpy as np
import pytest

import verification as vf
from verification.algorithm.loop import RUNAWAY, Ending, Outcome
from verification.coupling.driver import GROWING

LAMBDA = np.array([0.4, 1.0, 3.0])
RULES = ("constant", "aitken", "anderson", "iqn-ils")


def image(g):
    return 1 - LAMBDA * g


def walked(coupling, g, steps):
    for _ in range(steps):
        g = coupling.next(g, image(g))
    return g


@pytest.mark.parametrize("way", [copy.deepcopy, copy.copy, lambda coupling: pickle.loads(pickle.dumps(coupling))])
@pytest.mark.parametrize("rule", RULES)
def test_a_copy_goes_on_as_the_original_and_neither_moves_the_other(rule, way):
    coupling = vf.Coupling(rule=rule, theta=0.3)
    g = walked(coupling, np.zeros(3), 3)
    expected = walked(copy.deepcopy(coupling), g, 4)
    twin = way(coupling)
    walked(twin, 7 + np.zeros(3), 5)  # elsewhere, in another step in time
    twin.new_step()
    assert np.array_equal(walked(coupling, g, 4), expected)
    again = way(coupling)
    assert again.spectrum.high == coupling.spectrum.high


def test_an_absolute_tolerance_ends_a_coupling_whose_solution_is_0():
    answers = {"start": 1.0, "rule": "constant", "theta": 0.5, "max_iterations": 100}
    relative = vf.couple(lambda g: g / 2, lambda u: -u, **answers)
    absolute = vf.couple(lambda g: g / 2, lambda u: -u, absolute=1e-9, **answers)
    assert (relative.outcome, absolute.outcome) == (Outcome.LIMIT, Outcome.CONVERGED)
    assert abs(float(absolute.force[0])) < 1e-9
    assert absolute.history[-1] > 0.1
    assert absolute.iterations < 20


@pytest.mark.parametrize("absolute", [-1.0, np.nan, "a"])
def test_an_absolute_tolerance_that_is_none_is_refused(absolute):
    with pytest.raises(ValueError, match=r"absolute = .*needed a number >= 0"):
        vf.couple(image, image, start=np.zeros(3), absolute=absolute)


def test_who_listens_may_end_a_coupling_with_what_was_found():
    found = vf.couple(
        lambda g: g, image, start=np.zeros(3), rule="constant", theta=0.3, listen=lambda state: state.iterations == 6
    )
    assert (found.outcome, found.iterations, found.converged) == (Outcome.INTERRUPTED, 6, False)
    assert found.summary.startswith("interrupted, 6 evaluations")
    assert found.spectrum.high == pytest.approx(3, rel=1e-2)
    words = []
    other = vf.couple(lambda g: g, image, start=np.zeros(3), listen=lambda state: words.append(str(state)) or "yes")
    assert other.converged  # only True itself ends it
    assert len(words) == other.iterations


def test_the_last_state_within_the_tolerance_has_converged_whatever_the_listener_says():
    found = vf.couple(lambda g: g, image, start=np.zeros(3), listen=lambda state: state.residual <= 1e-6)
    assert found.converged


def test_a_residual_that_jumps_has_not_diverged_until_it_has_grown_three_times():
    """A start next to the solution of an earlier step has a first residual that says nothing of the later ones."""
    ending = Ending(1e-6, 99, growing=GROWING)
    far = [1e-12, 1.0, 0.5, 2.0, 3.0]
    assert [ending.at(residual, 1.0) for residual in far] == [Outcome.CONVERGED, None, None, None, None]
    assert far[-1] > RUNAWAY * far[0]
    assert ending.at(4.0, 1.0) is Outcome.DIVERGED
    assert Ending(1e-6, 99).at(np.inf, 1.0) is Outcome.DIVERGED
    assert Ending(1e-6, 99).at(np.nan, 1.0) is Outcome.DIVERGED
