"""What is loaded when it is asked for, in processes of their own: another test may have loaded it in this one."""

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


#: Python without hypothesis, which says how often it was asked for.
WITHOUT = """
import sys

class Missing:
    asked = 0

    def find_spec(self, name, path=None, target=None):
        if name == "hypothesis":
            Missing.asked += 1
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, Missing())
import verification as vf

for name in vf.__all__:
    getattr(vf, name)
print(Missing.asked)
import verification.testing
"""


def test_nothing_but_the_kit_asks_for_hypothesis_and_it_says_what_to_install():
    done = subprocess.run([sys.executable, "-c", WITHOUT], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.strip()) == (1, "0")
    assert "verification.testing needs hypothesis: pip install 'ndtheory[test]'" in done.stderr.splitlines()[-1]
