"""Certificates put forward for small problems: none that is accepted is false, by enumeration in rationals."""

from collections import Counter
from fractions import Fraction
from importlib import import_module
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from problem_list import blocks
from strategies import AT_NIGHT

import verification as vf
from verification.algorithm.affine_piece import Piece
from verification.certificate import check
from verification.contact.active_set import Pattern

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
TINY = blocks(cells=[[1, 1], [1, 2]], contact={"friction": "0.3", "radius": "0.6"}, iteration={"theta": "0.2"})
SLIDING = blocks(cells=[[2, 1], [1, 1]], contact={"friction": 0}, iteration={"neumann_body": 1, "theta": "0.2"})
PROBLEMS = {"friction": TINY, "grids that differ": {**TINY, "body1": SLIDING["body1"]}, "no friction": SLIDING}


@pytest.fixture
def benchmark(monkeypatch):
    """The benchmark that puts certificates forward, and knows the truth."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    return import_module("false_certificates")


def records(benchmark, problems, seed=0):
    """What was put forward in all, and what was accepted though it is false."""
    counts, false = Counter(), []
    for record in benchmark.count(problems, seed):
        counts += record.counts
        false += record.false
        assert not record.undecided
    return counts, false


def test_no_certificate_that_is_accepted_is_false(benchmark):
    problems = 200 if AT_NIGHT else 3
    counts, false = records(benchmark, problems)
    assert false == []
    assert counts["problems"] == problems
    assert counts["certificates"] > 80 * problems
    assert min(counts["accepted"], counts["false and refused"]) > 10 * problems


def test_a_checker_that_takes_every_form_as_definite_accepts_false_certificates(benchmark, monkeypatch):
    monkeypatch.setattr(check, "definite", lambda form: True)
    _, false = records(benchmark, 1)
    assert false


def test_a_checker_that_forgets_a_condition_on_the_multipliers_accepts_false_certificates(benchmark, monkeypatch):
    demand = check.demand
    monkeypatch.setattr(check, "demand", lambda holds, needed: demand(holds or needed.startswith("4 a b"), needed))
    record = benchmark.Record(draw=benchmark.random.Random(1))
    record.attack(vf.Problem.from_dict(blocks(cells=[[1, 1], [1, 1]], contact={"friction": "1/2", "radius": "0.6"})))
    assert record.false


def test_no_factor_is_right_where_contact_alone_holds_the_contact_body(benchmark):
    """Open nodes have no jump then, in rationals; doubles may name such a piece as the largest."""
    made = vf.certify(vf.Problem.from_dict(TINY))
    contact = f"body{3 - made.discrete['neumann_body']}"
    loose = {**made.discrete, contact: {**made.discrete[contact], "held": []}}
    for discrete, allowed in ((made.discrete, True), (loose, False)):
        truth = benchmark.Truth(discrete, made.claim["theta"])
        truth.sizes = np.array([None not in pattern for pattern in truth.patterns], dtype=float)  # all open and sliding
        assert truth.allows(benchmark.number("1000000")) == allowed


@pytest.mark.parametrize("name", PROBLEMS)
def test_the_largest_piece_in_rationals_is_that_of_the_jacobians_in_doubles(benchmark, name):
    problem = vf.Problem.from_dict(PROBLEMS[name])
    found = vf.certify(problem)
    truth = benchmark.Truth(found.discrete, found.claim["theta"])
    pair, theta, largest = vf.build(problem), float(problem.iteration.theta), 0.0
    n = pair.contact.grid.n
    still = np.zeros(pair.neumann.grid.n, dtype=bool)
    for touching, sliding, sign in product(*(product(of, repeat=n) for of in ((0, 1), (-1, 0, 1), (-1, 1)))):
        if pair.friction or all(sliding):
            pattern = Pattern(touching=np.array(touching, dtype=bool), sliding=np.array(sliding, dtype=np.int8))
            piece = Piece(pair=pair, pattern=pattern, sign=np.array(sign, dtype=np.int8), still=still)
            largest = max(largest, piece.factor(theta))
    assert truth.largest == pytest.approx(largest, rel=1e-12)
    beside = lambda share: str(Fraction(truth.largest) * (1 + Fraction(share)))
    assert truth.holds(beside("1e-9"))
    assert not truth.holds(beside("-1e-9"))
