"""What the ledger decides with enclosures: what is refuted fails by proof, and doubles lie between the bounds."""

from fractions import Fraction

import numpy as np
import pytest

from ndtheory.continuum.intervals import Interval
from verification.ledger import enclosures
from verification.ledger.cases import ENCLOSED
from verification.ledger.differences import along, uniform_piece
from verification.ledger.enclosures import (
    BY_TRACES,
    CONTRACTION,
    DECIDED,
    LAYER,
    OF_BODIES,
    OF_MUCH,
    PLATE,
    ROLLERS,
    EnclosedBodies,
    EnclosedConstants,
    enclosed,
    on_bodies,
    place,
)
from verification.ledger.inequalities import INEQUALITIES
from verification.ledger.worst import WorstTally
from verification.problem.specification import Problem

REFUTED = [("4.7", "printed"), ("5.13", "printed"), ("5.30", "printed"), *OF_MUCH]
REFUTED += [(id, "printed") for id in BY_TRACES]

#: E is N where the lift of least energy is that of least norm too, and no enclosure tells equality.
EQUAL = ("4.7", "repaired")

#: Of one term on each side, so that doubles and enclosures form the same quotient.
QUOTIENTS = [
    ("5.11", "printed"), ("5.13", "printed"), ("5.13", "repaired"), ("prop-5.4", "printed"), ("5.18", "printed"),
    ("5.19", "printed"), ("5.22", "printed"), ("5.23", "printed"), ("x-root-M", "printed"), ("5.30", "printed"),
    ("5.30", "repaired"), ("x-reaction", "printed"), ("x-friction-energy", "printed"), ("5.14", "printed"),
    ("5.11", "repaired"), ("prop-5.4", "repaired"), ("5.14", "repaired"),
]  # fmt: skip

ENTRY = {(inequality.id, inequality.of): inequality for inequality in INEQUALITIES}


@pytest.fixture(scope="module")
def found(shared):
    return shared("enclosures", enclosed)


@pytest.fixture(scope="module")
def bodies():
    return {name: EnclosedBodies(name) for name in (PLATE, LAYER, ROLLERS)}


def of(found, key):
    return next((one for one in found.get(key[0], []) if one.of == key[1]), None)


@pytest.mark.parametrize("key", REFUTED)
def test_what_is_refuted_as_printed_is_refuted_by_proof(found, key):
    evidence = of(found, key)
    assert (evidence.method, evidence.holds) == ("verified", False)
    low, high = evidence.data["ratio"]
    assert 1 < low <= high
    assert "between proved bounds" in evidence.text
    named = {Problem.from_dict(table) for table in ENCLOSED.values()}
    assert Problem.from_dict(evidence.data["problem"]) in named


@pytest.mark.parametrize("key", DECIDED, ids=" ".join)
def test_everything_else_holds_by_proof(found, key):
    if key == EQUAL:
        assert of(found, key) is None
    elif key not in REFUTED:
        assert of(found, key).holds is True
        assert of(found, key).data["ratio"][1] <= 1


@pytest.mark.parametrize("key", [key for key in OF_BODIES if key != EQUAL], ids=" ".join)
def test_the_ratio_of_two_bodies_in_doubles_lies_between_the_bounds(found, bodies, key):
    evidence = of(found, key)
    case = bodies[place(key)].case
    tally = WorstTally(inequality=ENTRY[key])
    tally.take(case, case)
    squared = 1 if key[0].startswith("x-") else 2
    assert ("of their squares" in evidence.text) == (squared == 2)
    low, high = evidence.data["ratio"]
    assert low * (1 - 1e-9) <= tally.by_unit[1.0][0] ** squared <= high * (1 + 1e-9)


@pytest.mark.parametrize("key", QUOTIENTS, ids=" ".join)
def test_the_ratio_of_a_pair_in_doubles_lies_between_the_bounds(found, bodies, key):
    """Forces through the affine piece of T, where the enclosures solve with Schur complements."""
    evidence, inequality = of(found, key), ENTRY[key]
    one = bodies[place(key)]
    case, setting = one.case, one.case.setting
    piece = uniform_piece(case.pair, touching=False, sliding=1)
    force = np.linalg.solve(setting.forms.inverse, one.slides.u)
    pair = along(setting, piece, np.linalg.solve(setting.forms.root, force))
    reading = inequality.reading(case.reading.in_unit(evidence.data.get("unit", 1.0)))
    low, high = evidence.data["ratio"]
    assert low * (1 - 1e-7) <= inequality.ratio(pair, reading) <= high * (1 + 1e-7)


@pytest.mark.parametrize("holds", [True, False])
@pytest.mark.parametrize("key", [key for key in DECIDED if key != EQUAL], ids=" ".join)
def test_a_right_side_that_is_too_small_is_refuted_and_one_that_is_large_enough_is_not(
    found, bodies, monkeypatch, key, holds
):
    """Whatever the statement: with a constant in its right side that is off by enough the evidence turns."""
    low, high = of(found, key).data["ratio"]
    factor = Fraction(high * (1 + 1e-3) if holds else low * (1 - 1e-3))
    own = enclosures.both_sides
    scaled = lambda *given: [(left, right * factor) for left, right in own(*given)]
    monkeypatch.setattr(enclosures, "both_sides", scaled)
    assert on_bodies(bodies[place(key)], *key).holds is holds


def test_the_energy_of_sticking_nodes_lies_between_its_bounds(bodies):
    """What a pair where all nodes stick consists of, by solves in doubles with the matrices of the program."""
    for one in (bodies[PLATE], bodies[LAYER]):  # where it is used
        u, pair, d = one.sticks.u, one.case.pair, one.sticks
        S_1, S_2 = pair.contact.schur, pair.neumann.schur
        p = -S_1 @ u
        expected = {"energy_1": u @ S_1 @ u, "work": p @ u, "norm": np.sqrt(u @ S_2 @ u)}
        expected["norm_T"] = np.sqrt(p @ np.linalg.solve(S_2, p))
        for name, value in expected.items():
            ends = getattr(d, name)
            assert float(ends.lo) == pytest.approx(value, rel=1e-7) == float(ends.hi)


def test_a_step_is_bounded_below_C_2_alone(bodies):
    """At the friction of the bodies, which is far above, nothing is said of contraction."""
    r = EnclosedConstants(bodies=bodies[LAYER])
    slight = r.contracting()
    assert float(r.P.lo) > 1 + float(r.give.hi)
    assert float(slight.P.hi) < 1 + float(slight.give.lo)
    for share in CONTRACTION.values():
        theta = slight.inside(share)
        assert 0 < slight.gain(theta).lo < 2
    with pytest.raises(ArithmeticError):
        slight.inside(Fraction(101, 100))


def test_where_the_enclosures_overlap_nothing_is_said(bodies, monkeypatch):
    monkeypatch.setattr(enclosures, "both_sides", lambda d, r, key: [(d.norm.square(), d.norm.square())])
    assert on_bodies(bodies[PLATE], "5.11", "repaired") is None


def test_what_cannot_be_enclosed_is_not_decided(bodies, monkeypatch):
    def fail(slides: object, reading: EnclosedConstants, key: tuple[str, str]) -> None:
        raise ArithmeticError("made up")

    monkeypatch.setattr(enclosures, "both_sides", fail)
    assert on_bodies(bodies[PLATE], "5.11", "repaired") is None


def test_an_interval_has_the_two_powers_that_the_inequalities_take():
    x = Interval.between(-1, 2)
    assert x**2 == x.square()
    assert Interval.of(2) ** 0.5 == Interval.of(2).sqrt()
    with pytest.raises(ValueError, match="needed 2 or"):
        x**3


def test_only_what_is_asked_for_is_decided():
    assert set(enclosed(["5.30", "2.1"])) == {"5.30"}
    assert enclosed([]) == {}
