"""Certificates put forward for small problems: none that is accepted is false, by enumeration in rationals."""

import json
from collections import Counter
from fractions import Fraction
from importlib import import_module
from itertools import pairwise, permutations, product
from pathlib import Path

import numpy as np
import pytest
from mesh_writer import write_gmsh22
from problem_list import blocks, changed
from strategies import AT_NIGHT

import verification as vf
from fem1d2d import rectangle
from verification.algorithm.affine_piece import Piece
from verification.certificate import check
from verification.contact.active_set import Pattern

BENCHMARKS = Path(__file__).parents[3] / "benchmarks"
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
    problems = 200 if AT_NIGHT else 2
    counts, false = records(benchmark, problems)
    assert false == []
    assert counts["problems"] == problems
    assert counts["certificates"] > 80 * problems
    assert min(counts["accepted"], counts["false and refused"]) > 10 * problems


def test_a_checker_that_takes_every_form_as_definite_accepts_false_certificates(benchmark, monkeypatch):
    monkeypatch.setattr(check, "positive_definite", lambda form: True)
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


# --- bodies and rules that are not those claimed ----------------------------------------------------------------------

RUBBING = blocks(cells=[[1, 2], [2, 2]], contact={"friction": "1/20", "radius": "3/4"}, iteration={"theta": "0.3"})
ONE_GRID = changed(RUBBING, body1={"cells": [2, 2]})


def each_cell_four_times(body):
    body["cells"] *= 4


def four_copies_joined_at_every_other_contact_node(body):
    """No edge occurs twice: the nodes of each copy are its own, but for some on Gamma_c."""
    count, shared = len(body["points"]), set(body["surface"][::2])
    points, cells, held = list(body["points"]), list(body["cells"]), list(body["held"])
    for copy in (1, 2, 3):
        of = lambda i, copy=copy: i if i in shared else i + copy * count
        points += body["points"]
        cells += [[of(i) for i in cell] for cell in body["cells"]]
        held += [[of(i), component] for i, component in body["held"]]
    body.update(points=points, cells=cells, held=held)


def refused(document, **discrete):
    """Why a certificate with other bodies is refused, though it names their hash; empty if it is not."""
    document = {**document, "discrete": {**document["discrete"], **discrete}}
    document["sha256"] = check.digest(document["discrete"])
    return vf.check_again(document).why


@pytest.mark.parametrize("several", [each_cell_four_times, four_copies_joined_at_every_other_contact_node])
def test_a_body_whose_cells_lie_on_each_other_is_refused(several, benchmark, monkeypatch):
    """It is as stiff as several: a certificate for such a body proves a factor that the body drawn does not have."""
    stiff = vf.Problem.from_dict(changed(ONE_GRID, body1={"young": 2}, iteration={"neumann_body": 1}))
    document = json.loads(vf.certify(stiff).to_json())
    body = {**document["discrete"]["body1"], "young": "1/2"}
    drawn = benchmark.Truth({**document["discrete"], "body1": dict(body)}, document["claim"]["theta"])
    assert drawn.largest > 4 > 0.8 > float(Fraction(document["claim"]["factor"]))
    several(body)
    assert "cells that do not overlap" in refused(document, body1=body)
    if several is each_cell_four_times:
        monkeypatch.setattr(check, "demand_disjoint", lambda cells: None)
        assert not refused(document, body1=body)


def test_weights_and_a_kernel_that_are_not_those_of_the_points_are_refused(monkeypatch):
    """A quarter of either is a quarter of the friction."""
    for data, neumann in ((ONE_GRID, 1), (RUBBING, 1), (RUBBING, 2)):
        problem = vf.Problem.from_dict(changed(data, iteration={"neumann_body": neumann, "theta": "1/10"}))
        document = json.loads(vf.certify(problem, edition="energy").to_json())
        assert "hat kernel of radius 3/4" in vf.check_again(document, problem).words
        quarter = lambda numbers: [str(Fraction(x) / 4) for x in numbers]
        weights, kernel = (document["discrete"][name] for name in ("weights", "kernel"))
        assert "trapezoid weights" in refused(document, weights=quarter(weights))
        assert "trapezoid weights" in refused(document, weights=weights[:-1])
        assert "hat of the radius claimed" in refused(document, kernel=[quarter(row) for row in kernel])
        document["claim"]["radius"] = "1/2"
        assert "hat of the radius claimed" in refused(document)
        del document["claim"]["radius"]
        assert refused(document, kernel=[quarter(row) for row in kernel]) == ""
        assert "trapezoid weights" in refused(document, weights=quarter(weights))
        assert "kernel that it lists" in vf.check_again(document).words


@pytest.mark.parametrize("order", [p for p in permutations(range(4)) if p[0] < p[-1] and p != (0, 1, 2, 3)], ids=str)
def test_contact_nodes_in_another_order_are_refused(order):
    """With the cells between them going forth and back the trapezoid rule has half of the weights inside."""
    problem = vf.Problem.from_dict(changed(ONE_GRID, body1={"cells": [3, 1]}, body2={"cells": [3, 1]}))
    document = json.loads(vf.certify(problem, theta="1/10", edition="energy").to_json())
    discrete = document["discrete"]
    at = [Fraction(discrete["body1"]["points"][i][0]) for i in discrete["body1"]["surface"]]
    put = lambda values: [values[i] for i in order]
    widths = [b - a for a, b in pairwise([put(at)[0], *put(at), put(at)[-1]])]
    weights = [str(abs(a + b) / 2) for a, b in pairwise(widths)]
    bodies = {name: {**discrete[name], "surface": put(discrete[name]["surface"])} for name in ("body1", "body2")}
    kernel = [put(row) for row in put(discrete["kernel"])]
    assert refused(document, weights=weights, kernel=kernel, **bodies)
    assert not refused(document)


def test_a_body_with_a_hole_has_a_certificate(tmp_path):
    whole = rectangle((0.0, 3.0), (-3.0, 0.0), (3, 3))
    inside = np.all(np.abs(whole.points[whole.cells].mean(axis=1) - (1.5, -1.5)) < 0.5, axis=1)
    sides = {name: whole.sides[name] for name in ("bottom", "top")}
    write_gmsh22(tmp_path / "ring.msh", whole.points, whole.cells[~inside], sides)
    ring = {"mesh": str(tmp_path / "ring.msh"), "young": 3, "poisson": "0.3", "fixed": ["bottom"]}
    problem = vf.Problem.from_dict(
        {
            **blocks(
                width=3,
                cells=[[1, 1], [3, 1]],
                iteration={"neumann_body": 1},
                contact={"friction": "1/100", "radius": 1},
            ),
            "body1": ring,
        }
    )
    found = vf.certify(problem, theta="1/10", edition="energy")
    assert len(found.discrete["body1"]["cells"]) == 16
    assert vf.check_again(found.to_dict(), problem).accepted
