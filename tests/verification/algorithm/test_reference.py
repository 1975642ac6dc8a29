"""The run by cvxpy alone: the program's own answers, no active set behind them."""

import itertools
import time
from dataclasses import replace

import numpy as np
import pytest
from problem_list import plates

import verification as vf
from verification.algorithm import reference
from verification.algorithm.fixed_point import FixedPointMap
from verification.algorithm.loop import Outcome
from verification.algorithm.reference import by_cvxpy_alone
from verification.contact import ContactError
from verification.contact.active_set import ActiveSet
from verification.contact.step import ProgramStep


@pytest.fixture(scope="module")
def run():
    """Section 6 with 7 contact nodes."""
    problem = vf.Problem.from_dict(plates())
    cells = {"body1.cells": "[10, 2]", "body2.cells": "[6, 2]"}
    return vf.run(problem.with_keys({**cells, "iteration.tolerance": "1e-9"}))


def test_the_program_alone_shows_the_rate_of_the_run(run):
    found = by_cvxpy_alone(run)
    assert (found.whole, found.steps, found.why) == (True, run.evaluations, "")
    assert found.observed_rate == pytest.approx(run.observed_rate.value, abs=1e-2)
    assert 0 < found.largest_difference < 1e-6  # the program's tolerance: its own digits, not those of the active set


def test_no_active_set_stands_behind_it(run, monkeypatch):
    """The program's own v: with no active set at all it answers the same."""
    g = run.iterates[2].g
    expected = FixedPointMap(run.pair, step=ProgramStep)(g)[1]
    monkeypatch.setattr(ActiveSet, "solve", None)
    again = FixedPointMap(run.pair, step=ProgramStep)(g)[1]
    assert np.array_equal(again.v, expected.v)
    assert again.force == pytest.approx(run.pair.contact.load - run.pair.contact.schur @ moved(run, g, again))


def moved(run, g, solved):
    """The trace of the contact body, from step I and the program's jump."""
    pair = run.pair
    u = np.linalg.solve(pair.neumann.schur, g + pair.neumann.load)
    return u + solved.v + np.concatenate([np.zeros(pair.contact.grid.t), pair.interface.gap])


def test_a_contact_body_that_is_stiffer_in_the_program_is_seen(run, monkeypatch):
    """What the comparison is for: a model of step II that is another one."""
    whole = ProgramStep.__init__

    def stiffer(self, S, *rest):
        whole(self, S + 0.1 * np.diag(np.diag(S)), *rest)

    monkeypatch.setattr(ProgramStep, "__init__", stiffer)
    assert by_cvxpy_alone(run).largest_difference > 1e-3


def test_a_long_run_is_compared_at_its_ends(run, monkeypatch):
    monkeypatch.setattr(reference, "MOST_STEPS", run.evaluations - 1)
    found = by_cvxpy_alone(run)
    assert (found.whole, found.steps, found.observed_rate) == (False, 2, None)
    assert "first and last" in found.why
    assert 0 < found.largest_difference < 1e-6


def test_large_programs_are_compared_at_the_ends_of_the_run(run, monkeypatch):
    pairs = run.evaluations * run.pair.contact.grid.n**2
    monkeypatch.setattr(reference, "MOST_PAIRS", pairs - 1)
    found = by_cvxpy_alone(run)
    assert (found.whole, found.steps) == (False, 2)
    assert f"{run.pair.contact.grid.n} contact nodes" in found.why
    monkeypatch.setattr(reference, "MOST_PAIRS", pairs)
    assert by_cvxpy_alone(run).whole


def test_no_clock_decides_what_is_compared(run, monkeypatch):
    before, ticks = by_cvxpy_alone(run), itertools.count(step=1e6)
    for clock in ("monotonic", "perf_counter", "process_time", "time"):
        monkeypatch.setattr(time, clock, lambda: next(ticks))
    assert by_cvxpy_alone(run) == before


def test_a_program_that_takes_too_long_has_no_answer(run, monkeypatch):
    monkeypatch.setattr("verification.contact.model.SECONDS", 1e-9)
    with pytest.raises(ContactError, match="no answer"):
        by_cvxpy_alone(run)


def test_a_program_with_too_many_unknowns_is_refused_where_it_is_asked_for_and_named_where_it_would_help(
    run, monkeypatch
):
    unknowns = 2 * run.pair.contact.grid.n
    monkeypatch.setattr("verification.contact.step.MOST_UNKNOWNS", unknowns - 1)
    says = f"the convex program of step II has {unknowns} unknowns: it is not tried beyond {unknowns - 1}"
    with pytest.raises(ContactError, match=says):
        vf.run(run.pair, solver="cvxpy")
    assert says in vf.compare(run.pair).to_dict()["reason"]["cvxpy"]
    assert vf.run(run.pair).history == run.history
    monkeypatch.setattr(ActiveSet, "solve", lambda *args: None)
    monkeypatch.setattr(ActiveSet, "repeated", lambda *args: iter(()))
    with pytest.raises(ContactError, match=f"did not reach a KKT residual of .*; {says}"):
        vf.run(run.pair)


def test_a_program_without_an_answer_is_told(run, monkeypatch):
    monkeypatch.setattr("verification.contact.model.ContactModel.solve", lambda self, q, bound: None)
    with pytest.raises(ContactError, match="no answer"):
        by_cvxpy_alone(run)
    compared = vf.compare(run.pair)
    assert compared.cvxpy is None
    assert "no answer" in compared.to_dict()["reason"]["cvxpy"]


@pytest.mark.parametrize("relaxation", ["aitken", "anderson", "newton", "momentum"])
def test_every_rule_is_repeated_from_its_beginning(run, relaxation):
    done = vf.run(run.pair, rule=relaxation)
    found = by_cvxpy_alone(done)
    assert found.whole
    assert found.largest_difference < 1e-6


def test_a_run_is_repeated_from_its_own_start():
    """At g = 0 nothing holds this block and the program has no answer: its run starts from the tied bodies."""
    pushed = plates(body2={"prescribed": None, "traction": {"top": [0, -3000]}, "body_force": [2, 0]})
    done = vf.run(vf.Problem.from_dict(pushed))
    found = by_cvxpy_alone(done)
    assert (done.start.source, found.whole, found.steps) == ("tied", True, done.evaluations)
    assert found.observed_rate == pytest.approx(done.observed_rate.value, abs=1e-2)


def test_auto_asks_the_program_only_where_the_active_set_does_not_close(run, monkeypatch):
    monkeypatch.setattr("verification.contact.model.ContactModel", None)
    again = vf.run(run.pair)
    assert again.history == run.history
    assert {iterate.contact.solver for iterate in again.iterates} == {"active-set"}


def test_where_the_active_set_does_not_close_auto_takes_the_program(run, monkeypatch):
    solve, calls = ActiveSet.solve, []

    def cycling(self, q, bound, start, hint=None):
        calls.append(start)
        return None if len(calls) == 1 else solve(self, q, bound, start, hint)

    monkeypatch.setattr(ActiveSet, "solve", cycling)
    state = next(vf.iterate(run.pair))
    assert state.contact.solver == "cvxpy"
    assert state.contact.kkt.residual <= 1e-11


def test_the_document_tells_steps_rate_and_difference(run):
    document = vf.compare(run.pair).to_dict()["cvxpy"]
    assert set(document) == {"steps", "whole", "observed_rate", "largest_difference", "reason"}
    short = replace(run, iterates=run.iterates[:2], outcome=Outcome.LIMIT)
    found = by_cvxpy_alone(short).to_dict()
    assert found["observed_rate"] is None
    assert "clear" in found["reason"]["observed_rate"]
