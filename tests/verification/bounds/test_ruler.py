"""Steps that bounds promise: never fewer than the run needs, and as many as exact powers of the factor."""

from dataclasses import replace
from fractions import Fraction

import pytest

import verification as vf
from ndtheory import Number
from verification.algorithm.rates import steps
from verification.bounds.bound import BoundResult
from verification.bounds.ruler import OBSERVED, PREDICTED, promised, ruler
from verification.bounds.verdicts import Judgement
from verification.figures import draw_ruler, save


def result(factor: Number, rest: Number) -> BoundResult:
    return BoundResult(name="energy", proved=True, factor=factor, one_minus_factor=rest)


@pytest.mark.parametrize(
    ("factor", "tolerance"), [("1/10", "1/1000"), ("1/2", "1/1024"), ("7/8", "1/1000000000"), ("3/5", "1/7")]
)
def test_the_steps_are_the_least_power_that_reaches_the_tolerance(factor, tolerance):
    q, aim = Fraction(factor), Fraction(tolerance)
    count = promised(result(Number.of_float(float(q)), Number.of_float(float(1 - q))), float(aim))
    assert q**count <= aim < q ** (count - 1)


def test_a_factor_that_rounds_to_1_promises_by_its_distance_from_1():
    near = result(Number.of_float(1.0), Number.of_float(1e-20))
    assert promised(near, 1e-9) == pytest.approx(20.72326583694641e20, rel=1e-12)
    assert steps(1.0, 1e-9) is None
    assert steps(1.0, 1e-9, 1e-320) is None  # more than any double
    assert steps(0.0, 1e-9, 1 - Fraction(1, 10**30)) == 1
    proved = Number(value=0.5, lo=0.4, hi=0.6, level="verified")
    assert promised(result(proved, Number(value=0.5, lo=0.4, hi=0.6, level="verified")), 1e-9) == steps(0.6)


def test_the_marks_of_a_run_are_in_order_and_what_is_promised_covers_what_is_seen():
    found = vf.compare(vf.example("section6-190"), bounds=["printed", "repaired", "energy"])
    marks = {mark.name: mark for mark in ruler(found.computed, found.run)}
    assert list(marks) == ["energy", PREDICTED, OBSERVED]
    assert marks["energy"].promised
    assert not marks[PREDICTED].promised
    assert marks["energy"].steps >= marks[OBSERVED].steps == found.run.iterations
    axes = draw_ruler(found).axes[0]
    assert [text.get_text() for text in axes.get_yticklabels()] == list(marks)
    assert axes.get_xlabel() == "steps to 1e-09; no promise by printed, repaired"


def test_the_ruler_draws_more_steps_than_an_integer_of_64_bits_has(tmp_path):
    slow = vf.example("two-bars").with_theta(1e-25)
    slow = replace(slow, iteration=replace(slow.iteration, tolerance=2.5e-7, max_iterations=3))
    figure = draw_ruler(vf.compare(slow, bounds=["energy"]))
    save(figure, tmp_path / "ruler.png")
    assert figure.axes[0].get_xlim()[1] > 1e26
    assert figure.axes[0].get_xlabel() == "steps to 2.5e-07"


def test_the_first_screen_shows_each_violation():
    found = vf.compare(vf.example("two-bars"), bounds=["energy"])
    broken = Judgement(verdict="VIOLATED", reason="seen otherwise")
    assert "violated" not in (screen := found._repr_html_())
    assert "forecast" not in screen
    for name, words in (("energy", "violated"), ("linearised", "violated: seen otherwise")):
        assert words in replace(found, verdicts={**found.verdicts, name: broken})._repr_html_()


def test_bounds_promise_nothing_of_a_run_outside_the_theorem():
    found = vf.compare(vf.example("section6-190").changed(law="local"), bounds=["energy"])
    assert found.run.outside
    assert [mark.name for mark in ruler(found.computed, found.run) if mark.promised] == []
