"""Couplings of kind general: eigenvalues below 0 are positive feedback, and a theta above 1 may be the best one."""

import tempfile
from fractions import Fraction as F
from pathlib import Path

import numpy as np
import pytest
from coupling_logs import kinds, linear_run, written
from hypothesis import given
from hypothesis import strategies as st

import verification as vf
from ndtheory import HypothesisError
from verification.algorithm.rates import steps
from verification.coupling import methods
from verification.coupling.spectrum import Spectrum

#: Fixed-stress poroelasticity: lambda from -0.395 to -0.001.
FIXED_STRESS = tuple(np.linspace(-0.395, -0.001, 12))


def log_of(folder, modes, theta, n):
    absolute = linear_run(modes, float(theta), 120)[0]
    kept = [value for value in absolute if value > 1e-12 * max(absolute)]
    return written(Path(folder) / f"{n}.txt", "\n".join(f"{value:.8e}" for value in kept) + "\n"), repr(float(theta))


def followed(folder, modes, theta, most=5):
    """The advice from a first run and those that it asks for, and the thetas that were run."""
    logs = []
    for n in range(most):
        logs.append(log_of(folder, modes, theta, n))
        found = vf.advise_logs(logs, kind="general")
        if found.theta is not None or found.next.kept:
            break
        theta = found.next.theta
    return found, [float(at) for _, at in logs]


def factor(modes, theta):
    return float(np.abs(1 - theta * (1 + np.array(modes))).max())


def best(modes):
    return factor(modes, 2 / (2 + min(modes) + max(modes)))


def test_one_ratio_has_two_readings_one_of_which_is_positive_feedback():
    found = vf.advise_run(1, "0.885", kind="general")
    assert kinds(found) == ["mode-high", "mode-low"]
    high, low = found.readings
    assert (high.value, high.lo) == (0.885, 0.885)
    assert (low.value, low.lo) == (None, -0.885)
    assert "positive feedback" in low.says
    assert (found.theta, found.roles, found.coupling.name) == (None, (), "general")
    assert found.to_dict()["kind"] == "general"
    assert 0.7 < found.next.theta < 1  # converges for sure, and both readings have other ratios there
    assert abs(1 - found.next.theta * 1.885) < 0.5 < 1 - found.next.theta * 0.115


@given(st.floats(-0.9, 3), st.floats(0.1, 1.5))
def test_the_eigenvalue_of_a_run_is_one_of_its_readings(mode, theta):
    ratio = abs(1 - theta * (1 + mode))
    if ratio < 1e-6:
        return
    found = vf.advise_run(theta, ratio, kind="general")
    seen = [(1 + F(ratio)) / F(theta) - 1, (1 - F(ratio)) / F(theta) - 1]
    assert min(abs(float(value) - mode) for value in seen) < 1e-9 * (1 + 1 / theta)
    if found.readings:
        assert [one.lo for one in found.readings] == pytest.approx([float(value) for value in seen])


def test_two_ratios_fit_any_coupling_and_a_third_one_has_to_confirm_that_eigenvalues_are_real():
    """z = 0.45 to 2.2 and 1.6 +- 2.1 i: 0.431 was 1.1 times the fewest steps at most, and took 653, not 176."""
    z = np.array([0.45, 1.0, 2.2, 1.6 + 2.1j])
    ratio = lambda theta: float(np.abs(1 - theta * z).max())
    advised = lambda *thetas: vf.advise_run(
        thetas[-1], ratio(thetas[-1]), kind="general", earlier=[(theta, ratio(theta)) for theta in thetas[:-1]]
    )
    second = advised(0.5).next.theta
    two = advised(0.5, second)
    assert (two.theta, two.spectrum) == (None, None)
    assert "if all are real: then its ratio is" in two.next.why
    said = float(two.next.why.partition("its ratio is ")[2].split()[0])
    assert ratio(two.next.theta) > said + 0.05
    three = advised(0.5, second, two.next.theta)
    assert three.theta is None
    assert "no coupling with real eigenvalues" in three.next.why
    z = z[:3]
    assert "if all are real, by these runs" in (found := advised(0.5, second, advised(0.5, second).next.theta)).next.why
    assert found.theta == pytest.approx(2 / 2.65, rel=0.05)


@pytest.mark.parametrize("first", [1.0, 0.5])
def test_a_fixed_stress_loop_gets_its_theta_above_1(tmp_path, first):
    found, made = followed(tmp_path, FIXED_STRESS, first)
    assert found.theta == pytest.approx(2 / (2 - 0.396), rel=0.05)
    assert steps(factor(FIXED_STRESS, found.theta)) <= 1.4 * steps(best(FIXED_STRESS))
    assert len(made) <= 4
    assert -0.465 < found.spectrum.low <= -0.394
    assert -0.002 <= found.spectrum.high < 0.07
    assert "rho (the largest eigenvalue lambda)" in found.quote


def test_logs_of_positive_feedback_contradict_nothing_and_blame_no_solver(tmp_path):
    """T' = 0.55, lambda = -0.55, at theta = 0.5 and 1."""
    logs = [log_of(tmp_path, (-0.55,), theta, n) for n, theta in enumerate((0.5, 1.0))]
    found = vf.advise_logs(logs, kind="general")
    assert found.interval.contradiction is None
    assert "sign" not in found.next.why
    assert found.next.theta > 1


@given(st.lists(st.floats(-0.9, 3), min_size=2, max_size=8), st.sampled_from([1.0, 0.5, 0.3]))
def test_no_theta_that_is_pasted_is_wrong(modes, first):
    with tempfile.TemporaryDirectory() as folder:
        found, _ = followed(folder, modes, first)
    if found.theta is not None:
        fewest = max(steps(best(modes)) or 1, 7)
        assert factor(modes, found.theta) < 1
        assert max(steps(factor(modes, found.theta)), 7) <= 1.45 * fewest + 2


def test_ratios_of_several_runs_decide_like_their_logs():
    modes, earlier, theta = (-0.6, -0.2, 0.2), [], 1.0
    for _ in range(5):
        found = vf.advise_run(theta, factor(modes, theta), kind="general", earlier=earlier)
        if found.theta is not None:
            break
        earlier.append((theta, factor(modes, theta)))
        theta = found.next.theta
    assert found.theta == pytest.approx(2 / 1.6, rel=0.1)
    assert found.next.theta == found.theta


def test_an_eigenvalue_of_minus_1_or_less_leaves_no_theta(tmp_path):
    """Two runs that grow, and at the third theta the mode still grows: a larger feedback than 1."""
    made = [("1", 1.5), ("0.5", 1.25), ("0.2", 1.1)]  # 1 - theta z with z = -0.5
    found = vf.advise_run(*made[-1], kind="general", earlier=made[:-1])
    assert found.theta is None
    assert "no constant theta above 0 converges" in found.next.why
    assert "IQN-ILS" in found.next.why


def test_ratios_that_exclude_each_other_are_told():
    found = vf.advise_run("0.5", "0.2", kind="general", earlier=[("0.5", "0.9")])
    assert "no coupling with real eigenvalues" in found.next.why


def test_vectors_show_feedback_and_theta_above_1():
    modes = np.array([-0.6, -0.3, 0.1])
    X, TX, x = [], [], np.zeros(3)
    for _ in range(5):
        image = 1 - modes * (x - 1)
        X.append(x)
        TX.append(image)
        x = x + 0.8 * (image - x)
    found = vf.advise_vectors(X, TX, kind="general")
    assert (found.spectrum.low, found.spectrum.high) == pytest.approx((-0.6, 0.1))
    assert found.theta == pytest.approx(2 / 1.5, rel=0.03)
    assert found.vectors.negative == ""
    assert [row.exchanged for row in found.methods] == [False] * 3  # 1/lambda has a pole at 0
    wrong = vf.advise_vectors(X, TX, tied=True)
    assert (wrong.coupling.name, wrong.theta) == ("tied", None)
    assert "positive feedback (kind general)" in wrong.why_no_theta


def test_negative_eigenvalues_of_a_kind_that_has_none_name_both_causes():
    X, TX = [[0.0], [1.0]], [[1.0], [1.5]]
    with_sign = vf.advise_vectors(X, TX, tied=True)
    assert with_sign.theta is None
    assert "wrong sign" in with_sign.why_no_theta
    assert "kind general" in with_sign.why_no_theta
    assert vf.advise_vectors(X, TX, kind="general").theta == pytest.approx(2.0, rel=0.05)


def test_couple_takes_a_theta_above_1_of_this_kind_alone():
    neumann, contact = (lambda g: g), (lambda u: 1 + 0.55 * u)
    with pytest.raises(HypothesisError, match="0 < theta <= 1"):
        vf.couple(neumann, contact, start=0.0, rule="constant", theta=2.2)
    found = vf.couple(neumann, contact, start=0.0, rule="constant", theta=2.2, kind="general", tolerance=1e-9)
    assert found.iterations < 8
    assert found.spectrum.low == pytest.approx(-0.55)
    assert found.advice.theta == pytest.approx(1 / 0.45, rel=0.05)
    plain = vf.couple(neumann, contact, start=0.0, rule="constant", theta=1, kind="general", tolerance=1e-9)
    assert plain.iterations > 30


def test_the_first_iterates_of_a_linear_coupling_show_the_modes_that_have_died_out():
    modes = -np.linspace(0.001, 0.88, 30)
    found = vf.couple(
        lambda g: -modes * g, lambda u: u + 1, start=np.zeros(30), rule="constant", theta=1, kind="general"
    )
    assert found.iterations > 60
    assert found.spectrum.high == pytest.approx(-0.001, abs=0.02)
    assert found.advice.theta <= 2 / (2 - 0.881)
    counted = lambda theta: methods.steps(Spectrum.of(modes), "constant", theta) or 10**9
    assert counted(found.advice.theta) <= 1.05 * min(map(counted, np.linspace(1.5, 1.8, 31)))


@pytest.mark.parametrize(
    ("given", "needed"),
    [
        ({"kind": "fluid"}, "needed one of contact, tied, general"),
        ({"kind": "general", "tied": True}, "needed one of them"),
        ({"kind": "general", "friction": True}, "nothing slips"),
        ({"kind": "general", "parallel": True}, "advise vectors"),
        ({"earlier": [("0.5", "0.9")]}, "needed their logs, or kind general"),
    ],
)
def test_kinds_that_do_not_go_together_are_refused(given, needed):
    with pytest.raises(ValueError, match=needed):
        vf.advise_run("0.5", "0.9", **given)


def test_operators_of_this_kind_are_refused():
    """Lanczos needs a symmetric coupling; a theta of eigenvalues cut off at 0 would diverge."""
    with pytest.raises(ValueError, match="kind general with an operator"):
        vf.advise_matrices(lambda u: -2 * u, solve2=lambda f: f, unknowns=5, kind="general")


def test_moduli_say_nothing_of_this_kind():
    with pytest.raises(HypothesisError, match="moduli give no advice"):
        vf.advise_moduli(young=(1, 1), poisson=(0, 0), kind="general")
