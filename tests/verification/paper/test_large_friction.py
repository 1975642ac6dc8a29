"""The printed (5.30) and what rests on it fail on every pair of bodies; what makes them fail is named rightly."""

from __future__ import annotations

import numpy as np
import pytest

from verification.ledger import large_friction
from verification.ledger.large_friction import IDS, witness
from verification.ledger.worst import draw_cases

HEIRS = [id for id in IDS if not id.startswith("x-")]

#: Named and random problems.
COUNT = 5


@pytest.fixture(scope="module")
def evidence():
    return large_friction.large_friction(IDS, "quick")


def cases():
    return [(case, random) for case, random in draw_cases(COUNT) if case.measured.of_friction]


@pytest.mark.parametrize("id", HEIRS)
def test_what_is_printed_fails_on_each_problem_and_what_is_repaired_holds(id, evidence):
    printed, repaired = evidence[id]
    assert (printed.of, printed.holds) == ("printed", False)
    assert (repaired.of, repaired.holds) == ("repaired", True)
    assert printed.data["problems"] >= 6
    assert printed.data["least_ratio"] > 3
    assert 0 < repaired.data["worst_ratio"] < 1


def test_the_fact_itself_holds_on_every_problem(evidence):
    (found,) = evidence["x-printed-false-everywhere"]
    assert found.holds
    assert found.data["least_ratio"] == min(evidence[id][0].data["least_ratio"] for id in HEIRS)


def test_the_quotients_are_the_factor_by_which_friction_exceeds_its_border():
    """F and t^2 are quadratic in k, the printed bound is linear where its bracket is 1."""
    for case, random in cases():
        of_printed = witness(case, random).ratios(printed=True)
        for id in ("5.31", "5.32", "5.33", "5.36", "5.39", "5.44"):
            assert of_printed[id] == pytest.approx(large_friction.BEYOND, rel=0.03)


def test_with_less_friction_the_same_forces_obey_what_is_printed(monkeypatch):
    monkeypatch.setattr(large_friction, "BEYOND", 0.2)
    for case, random in cases():
        of_printed = witness(case, random).ratios(printed=True)
        assert max(of_printed[id] for id in HEIRS if id != "5.30") < 1


def test_in_a_unit_of_stress_with_large_m_the_same_forces_obey_what_is_printed(monkeypatch):
    monkeypatch.setattr(large_friction, "BRACKET", 1e30)
    for case, random in cases():
        assert max(witness(case, random).ratios(printed=True).values()) < 1


def test_the_two_forces_are_realised_with_all_nodes_open_and_sliding_one_way():
    for case, random in cases():
        found = witness(case, random)
        d = found.difference
        pair = d.setting.pair
        interface, neumann = pair.interface, pair.neumann.grid
        assert not pair.interface.gap.any()
        assert np.abs(d.reaction[neumann.normal]).max() <= 1e-12 * np.abs(d.reaction).max()
        shear = found.friction * pair.contact.grid.weights * (interface.kernel @ d.force[neumann.normal])
        carried = interface.transfer.T @ shear
        assert d.reaction[neumann.tangential] == pytest.approx(carried, rel=1e-3)
        assert d.friction > 0
