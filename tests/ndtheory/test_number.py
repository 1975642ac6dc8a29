"""Scalars: exact reading, the square root in five arithmetics, and a package that needs the standard library alone."""

import dataclasses
import json
import sys
from decimal import Decimal
from fractions import Fraction as F
from pathlib import Path

import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf
from processes import ended

from ndtheory import Number, exact
from ndtheory.number import decimal, working_precision
from ndtheory.scalar import sqrt

ROOT = Path(__file__).parents[2]

FRACTIONS = st.builds(lambda f, sign: sign * f, strategies.log_uniform(-12, 12), st.sampled_from([-1, 1]))


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        (0, F(0)),
        (-3, F(-3)),
        (0.4, F(2, 5)),
        (1e-21, F(1, 10**21)),
        ("1/3", F(1, 3)),
        (" -2 / 6 ", F(-1, 3)),
        ("0.1/0.3", F(1, 3)),
        ("2.5e-3", F(1, 400)),
        ("1e300", F(10) ** 300),
        (Decimal("0.10"), F(1, 10)),
        (F(22, 7), F(22, 7)),
    ],
)
def test_a_number_is_read_as_it_was_written(written, meant):
    assert exact(written) == meant
    assert isinstance(exact(written), F)


@given(FRACTIONS)
def test_a_rational_is_read_back_from_what_it_prints(value):
    assert exact(str(value)) == exact(value) == value


@given(st.decimals(-(10**12), 10**12, places=15))
def test_a_decimal_is_read_digit_by_digit(value):
    assert exact(value) == exact(str(value)) == F(value)


@given(st.builds(lambda size, sign: sign * size, st.floats(1e-300, 1e300), st.sampled_from([-1, 0, 1])))
def test_a_float_means_its_shortest_decimal(value):
    assert exact(value) == F(repr(value))
    assert float(exact(value)) == value


@given(st.integers(-(10**300), 10**300))
def test_an_integer_is_itself(value):
    assert exact(value) == value


@pytest.mark.parametrize(
    "written",
    [
        *[
            True,
            False,
            None,
            "",
            " ",
            "abc",
            "1,5",
            "1/0",
            "1/0.0",
            "0/0",
            "1/2/3",
            "/2",
            "1/",
            [1],
            (1, 2),
            1 + 0j,
            b"1",
        ],
        *["nan", "sNaN", "inf", "-inf", "1/inf", "1/nan", float("nan"), float("inf"), Decimal("NaN"), Decimal("-Inf")],
        *["1e999999", "-1e999999", "1e-999999", "1e301", "1/1e301", 10**301],
    ],
)
def test_what_is_no_finite_number_is_refused(written):
    with pytest.raises(ValueError, match=r"not a|divides by zero"):
        exact(written)


@given(FRACTIONS.map(abs))
def test_the_root_of_a_rational_square_is_exact(root):
    found = sqrt(root**2)
    assert found == root
    assert isinstance(found, F)


@given(FRACTIONS.map(abs), st.sampled_from([2, 3, F(1, 5), F(7, 11)]))
def test_an_irrational_root_of_a_rational_is_refused(root, factor):
    with pytest.raises(ValueError, match="irrational"):
        sqrt(factor * root**2)


@given(FRACTIONS.map(abs), st.integers(20, 80))
def test_the_root_of_a_decimal_has_the_digits_of_the_context(value, digits):
    with working_precision(digits):
        root = sqrt(decimal(value))
        assert isinstance(root, Decimal)
    assert abs(F(root) ** 2 / value - 1) <= F(3, 10 ** (digits - 1))


@given(st.floats(1e-300, 1e300))
def test_the_root_of_a_float_is_right_to_its_last_place(value):
    root = sqrt(value)
    assert isinstance(root, float)
    with mp.workdps(40):
        assert abs(mpf(root) / mp.sqrt(mpf(value)) - 1) <= mpf(2) ** -53


@given(st.integers(0, 10**7))
def test_the_root_of_a_square_integer_is_that_integer(root):
    assert sqrt(root**2) == root


@given(FRACTIONS.map(abs))
def test_the_root_of_an_mpmath_number_stays_in_mpmath(value):
    with mp.workdps(60):
        number = mpf(value.numerator) / value.denominator
        assert isinstance(sqrt(number), mpf)
        assert abs(sqrt(number) ** 2 / number - 1) < mpf("1e-58")


@pytest.mark.parametrize("value", [-1, -1.0, F(-1), F(-4, 9)])
def test_a_negative_number_has_no_root(value):
    with pytest.raises(ValueError, match="a number >= 0 is needed"):
        sqrt(value)


def test_a_negative_decimal_has_no_root():
    with pytest.raises(ValueError, match="a number >= 0 is needed"):
        sqrt(Decimal(-1))


@given(FRACTIONS, st.integers(10, 100))
def test_a_rational_becomes_a_decimal_of_the_working_precision(value, digits):
    with working_precision(digits):
        assert abs(F(decimal(value)) / value - 1) <= F(1, 2 * 10 ** (digits - 1))


@given(FRACTIONS)
def test_a_number_is_the_nearest_double_and_survives_json(value):
    number = Number.of_float(value)
    assert number == Number(value=float(value), lo=None, hi=None, level="float")
    assert Number(**json.loads(json.dumps(number.to_dict()))) == number


def test_a_number_is_frozen():
    with pytest.raises(dataclasses.FrozenInstanceError):
        Number.of_float(1).value = 2


def test_the_theory_needs_the_standard_library_alone():
    """Isolated and without site-packages: a third-party import would fail, and none is hidden in a try."""
    program = f"import sys; sys.path.insert(0, {str(ROOT)!r}); import ndtheory; print(*sys.modules)"
    found = ended(program, flags=["-I", "-S"])
    assert (found.returncode, found.stderr) == (0, "")
    roots = {name.partition(".")[0] for name in found.stdout.split()}
    assert roots - sys.stdlib_module_names == {"ndtheory", "__main__"}


def test_importing_the_theory_loads_no_third_party_module():
    """As installed, where third-party modules could be had."""
    program = "import sys; before = set(sys.modules); import ndtheory; print(*set(sys.modules) - before)"
    found = ended(program, cwd=ROOT)
    assert (found.returncode, found.stderr) == (0, "")
    roots = {name.partition(".")[0] for name in found.stdout.split()}
    assert "ndtheory" in roots
    assert roots - sys.stdlib_module_names == {"ndtheory"}
