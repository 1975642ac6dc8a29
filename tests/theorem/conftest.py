"""Fixtures of the tests of the theory."""

import pytest
from energy_oracle import DIGITS
from mpmath import mp


@pytest.fixture(scope="module")
def many_digits():
    """mpmath in the digits of the oracle."""
    with mp.workdps(DIGITS):
        yield
