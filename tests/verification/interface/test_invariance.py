"""Laws that no change of units, of left and right or of above and below may break."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from itertools import islice
from typing import Any

import numpy as np
import strategies
from dense_oracle import dense_body, rounding
from hypothesis import example, given
from hypothesis import strategies as st
from problem_list import SHEARED
from sample_runs import SAMPLES, converged

import verification as vf
from verification.algorithm.loop import Outcome
from verification.algorithm.relaxation import Constant
from verification.algorithm.runs import Run
from verification.algorithm.start import Start
from verification.algorithm.theta import Choice
from verification.contact import ContactError
from verification.interface.pair import pair_from


def few_steps(data: Mapping[str, Any], count: int = 4) -> list[Run]:
    """The first evaluations of T, each to be read as a finished run."""
    pair = pair_from(vf.Problem.from_dict(data))
    try:
        states = list(islice(vf.iterate(pair, solver="active-set"), count))
    except ContactError:  # the guess cycled: slower, but sure
        states = list(islice(vf.iterate(pair, solver="auto"), count))
    theta = pair.settings.theta
    given = Choice(theta=theta, source="given")
    start = Start(g=states[0].g)
    return [
        Run(pair=pair, rule=Constant(), choice=given, start=start, iterates=(state,), outcome=Outcome.LIMIT)
        for state in states
    ]


def magnitude(runs: list[Run]) -> tuple[float, float]:
    """Largest nodal force and displacement that a few steps add up, without signs: rounding is measured by them."""
    pair = runs[0].pair
    force = displacement = 0.0
    sides = (pair.contact, pair.neumann)
    for name, side in zip(("body1", "body2"), sides[:: int(pair.normal_sign)], strict=True):
        body = dense_body(pair, name)
        acting = np.abs(body.forces) + np.abs(body.everything) @ np.abs(body.values)
        load = np.abs(body.R).T @ acting[~body.held]
        give = np.abs(np.linalg.pinv(side.schur))  # 0 where the body is held along Gamma_c
        for run in runs:
            state = run.last
            u = np.abs(state.displacement) + np.abs(state.contact.v) + float(pair.problem.contact.gap) + give @ load
            force = max(force, float((np.abs(side.schur) @ u + load + np.abs(state.image)).max()))
            displacement = max(displacement, float((u + give @ np.abs(state.image)).max()))
    return force, displacement


def assert_same_steps(
    here: Mapping[str, Any],
    there: Mapping[str, Any],
    *,
    force: float = 1.0,
    length: float = 1.0,
    reverse: bool = False,
    shear: float = 1.0,
) -> None:
    """The states of two runs agree, forces and lengths multiplied, perhaps read from the other end.

    The stiffness on Gamma_c comes from eliminating the rest of a body, and the condition of its matrix costs digits: so
    many in each step, with those of the steps before.
    """
    ours, theirs = few_steps(here), few_steps(there)
    F, U = magnitude(ours)
    bodies = [dense_body(ours[0].pair, name) for name in ("body1", "body2")]
    for step, (one, other) in enumerate(zip(ours, theirs, strict=True), 1):
        near = rounding(*bodies, solves=step)
        w = one.contact.weights
        turn = slice(None, None, -1) if reverse else slice(None)
        multiples = {"pressure": force, "shear": force * shear, "gap": length, "slip": length * shear}
        for quantity, factor in multiples.items():
            expected = factor * getattr(one.contact, quantity)[turn]
            off = np.abs(getattr(other.contact, quantity) - expected)
            if quantity in ("pressure", "shear"):
                assert (off * w).max() <= near * force * F
            else:
                assert off.max() <= near * length * U


def scaled_loads(body: Mapping[str, Any], force: Fraction, length: Fraction) -> dict[str, Any]:
    """Forces and prescribed displacements times a factor."""
    move = lambda v: v if v == "free" else length * v
    result = dict(body)
    if "body_force" in body:
        f = body["body_force"]
        result["body_force"] = [force * c for c in f] if isinstance(f, list) else force * f
    if "traction" in body:
        result["traction"] = {side: [force * c for c in t] for side, t in body["traction"].items()}
    if "prescribed" in body:
        result["prescribed"] = {
            side: [move(c) for c in u] if isinstance(u, list) else move(u) for side, u in body["prescribed"].items()
        }
    return result


factors = st.sampled_from([Fraction(1, 10**6), Fraction(1, 3), Fraction(7), Fraction(10**9)])
few = strategies.contact_problems()


@strategies.fewer(4, at_night=2)
@given(data=few, c=factors)
def test_moduli_and_loads_times_c_multiply_the_forces_and_leave_the_displacements(data, c):
    other = dict(data)
    for name in ("body1", "body2"):
        other[name] = scaled_loads(data[name], c, Fraction(1)) | {"young": c * data[name]["young"]}
    assert_same_steps(data, other, force=float(c))


@strategies.fewer(4, at_night=2)
@given(data=few, c=factors)
def test_loads_and_gap_times_c_multiply_everything(data, c):
    other = {name: scaled_loads(data[name], c, c) if name in ("body1", "body2") else data[name] for name in data}
    other["contact"] = data["contact"] | {"gap": c * data["contact"]["gap"]}
    assert_same_steps(data, other, force=float(c), length=float(c))


def even(data: dict[str, Any], axis: int) -> dict[str, Any]:
    """Twice the cells along an axis: only an even grid is its own mirror image, diagonals included."""
    other = dict(data)
    for name in ("body1", "body2"):
        cells = list(data[name]["cells"])
        cells[axis] *= 2
        other[name] = data[name] | {"cells": cells}
    return other


def reflected(body: Mapping[str, Any], axis: int) -> dict[str, Any]:
    """A body in a mirror: x -> -x or y -> -y."""
    names = (("left", "right"), ("bottom", "top"))[axis]
    rename = lambda side: names[1 - names.index(side)] if side in names else side
    turn = lambda v: [c if p != axis or c == "free" else -c for p, c in enumerate(v)]
    result = dict(body)
    key = "xy"[axis]
    result[key] = [-c for c in reversed(body[key])]
    result["fixed"] = [rename(side) for side in body["fixed"]]
    for table in ("prescribed", "traction"):
        result[table] = {rename(side): turn(v) for side, v in body[table].items()}
    result["body_force"] = turn(body["body_force"])
    return result


#: A block that slides as a whole and is held along Gamma_c at one end, under a kernel as wide as its cells.
SLIDES = {
    "dimension": 2,
    "body1": {"shape": "rectangle", "x": [0, 3], "y": [-1, 0], "cells": [3, 1], "young": Fraction(7)}
    | {"poisson": Fraction(3, 10), "fixed": ["bottom"], "prescribed": {}, "traction": {}, "body_force": [0, 0]},
    "body2": {"shape": "rectangle", "x": [0, 3], "y": [0, 1], "cells": [3, 1], "young": Fraction(2)}
    | {"poisson": Fraction(3, 10), "fixed": [], "traction": {}, "body_force": [0, 0]}
    | {"prescribed": {"top": [Fraction(1, 20), Fraction(-1, 50)], "left": [Fraction(1, 20), "free"]}},
    "contact": {"friction": Fraction(1, 5), "radius": Fraction(1), "gap": Fraction(0), "interval": [0, 3]},
    "iteration": {"neumann_body": 1, "theta": Fraction(1, 2)},
}

#: A thin cantilever: the condition of its stiffness is 2e5, and its displacements keep so many digits less.
CANTILEVER = {
    "dimension": 2,
    "body1": {"shape": "rectangle", "x": [0, 90], "y": [Fraction(-9, 5), 0], "cells": [3, 1], "young": Fraction(1)}
    | {"poisson": Fraction(-1, 2), "fixed": ["right"], "prescribed": {}, "traction": {}}
    | {"body_force": [Fraction(0), Fraction(1, 36000)]},
    "body2": {"shape": "rectangle", "x": [0, 30], "y": [0, Fraction(3, 5)], "cells": [1, 2], "young": Fraction(50)}
    | {"poisson": Fraction(-1, 2), "fixed": ["top"], "prescribed": {}, "traction": {}, "body_force": [0, 0]},
    "contact": {"interval": [0, 30], "friction": 0, "radius": Fraction(15), "gap": Fraction(0), "law": "nonlocal"},
    "iteration": {"neumann_body": 1, "theta": 1 - Fraction(1, 10**7)},
    "norm": {"length": Fraction(15)},
}


@strategies.fewer(4, at_night=2)
@given(data=strategies.plane_problems(most_cells=3))
@example(data=SLIDES)
@example(data=CANTILEVER)
def test_left_and_right_exchanged_reverse_everything_and_turn_the_shear(data):
    data = even(data, 0)
    other = {name: reflected(data[name], 0) if name in ("body1", "body2") else data[name] for name in data}
    other["contact"] = data["contact"] | {"interval": [-c for c in reversed(data["contact"]["interval"])]}
    assert_same_steps(data, other, reverse=True, shear=-1)


@strategies.fewer(4, at_night=2)
@given(data=strategies.plane_problems(most_cells=4))
@example(data=SLIDES)
def test_above_and_below_exchanged_change_the_names_alone(data):
    """Body 1 becomes body 2 and the other way round: shear on body 2 and slip of body 1 change their sign."""
    data = even(data, 1)
    turned = {"body1": reflected(data["body2"], 1), "body2": reflected(data["body1"], 1)}
    turned["iteration"] = data["iteration"] | {"neumann_body": 3 - data["iteration"]["neumann_body"]}
    assert_same_steps(data, data | turned, shear=-1)


def test_a_symmetric_problem_has_a_symmetric_answer():
    contact = converged("section 6").contact
    assert np.abs(contact.pressure - contact.pressure[::-1]).max() < 1e-10 * contact.pressure.max()
    assert np.abs(contact.shear + contact.shear[::-1]).max() < 1e-10 * contact.pressure.max()
    assert contact.status == contact.status[::-1]


def test_the_samples_show_every_state():
    states = {name: set(converged(name).contact.status) for name in SAMPLES}
    assert set().union(*states.values()) == {"stick", "slip", "open"}
    assert SHEARED["top"][0] != 0
