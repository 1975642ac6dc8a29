"""Fixtures of the tests of the theory."""

import pytest
from mpmath import mp
from sharp_oracle import DIGITS


@pytest.fixture(scope="module")
def many_digits():
    """mpmath in the digits of the oracle."""
    with mp.workdps(DIGITS):
        yield
