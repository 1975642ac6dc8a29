"""scipy.stats is loaded by the first call of what cvxpy takes from it, or at once where more is asked of it.

Each case is a process of its own, as another test may have loaded it in this one.
"""

import subprocess
import sys

import pytest

BY_CVXPY = """
import verification.contact.model, verification.bounds.model
assert "scipy.stats" not in sys.modules
import cvxpy as cp, numpy as np
value = cp.quantum_rel_entr(np.diag([0.5, 0.5]), np.diag([0.25, 0.75])).value
assert abs(value - np.log(4 / 3) / 2) < 1e-12, value
assert sys.modules["scipy.stats"].norm.cdf(0) == 0.5
"""

AT_ONCE = """
try:
    with statistics_later():
        raise KeyError
except KeyError:
    assert "scipy.stats" not in sys.modules
with statistics_later():
    from scipy.stats import entropy, norm
    assert norm.cdf(0) == 0.5
    try:
        from scipy.stats import nothing_of_the_kind
    except ImportError:
        pass
    else:
        raise AssertionError
import scipy.stats
assert scipy.stats.norm is norm
assert entropy([0.5, 0.5]) == scipy.stats.entropy([0.5, 0.5]) > 0
with statistics_later():  # as it is
    assert sys.modules["scipy.stats"] is scipy.stats
assert sys.modules["scipy.stats"] is scipy.stats
"""


@pytest.mark.parametrize("case", [BY_CVXPY, AT_ONCE])
def test_statistics_come_when_they_are_asked_for(case):
    source = f"import sys\nfrom verification.imports import statistics_later\n{case}"
    ended = subprocess.run([sys.executable, "-c", source], capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
