"""A command that takes its time says what it is doing: on a terminal, and to whoever asks from Python."""

import pytest

import verification as vf

#: What a comparison does, in its order.
STAGES = ["measuring", "iterating", "linearising", "repeating the run by cvxpy", "searching", "semidefinite bound"]


@pytest.fixture
def known():
    """Nothing is known: these tests watch it being computed."""


def stages(told):
    """The stages that were told, each once."""
    return list(dict.fromkeys(stage for what in told for stage in STAGES if what.startswith(stage)))


def test_a_comparison_names_everything_it_does_in_its_order(write):
    told = []
    vf.compare(vf.load(write()), progress=lambda what, share: told.append((what, share)))
    assert stages(what for what, _ in told) == STAGES
    assert all(any(what.startswith(stage) for stage in STAGES) for what, _ in told)
    assert all(share is None or 0 <= share <= 1 for _, share in told)
    programs = {what for what, _ in told if what.startswith("semidefinite bound")}
    assert len(programs) > 3  # the largest theta, the threshold at several frictions, the factor


def test_constants_name_the_mesh_that_is_measured(write):
    told = []
    vf.measure(vf.load(write()), refine=2, progress=lambda what, share: told.append(what))
    assert told == ["measuring the constants", *(f"measuring the constants, {i} of 2 halvings" for i in (1, 2))]
