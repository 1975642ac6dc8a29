"""A mode that changes its sign and hardly decays or grows: what iterates and logs of it may be called, and what not."""

import numpy as np
import pytest

import verification as vf


@pytest.mark.parametrize("steps", [6, 12, 24])
@pytest.mark.parametrize("fast", [0.0, 0.3, 0.6])
@pytest.mark.parametrize("factor", [0.999, 0.9999, 1.0, 1.0001, 1.001])
def test_what_iterates_cannot_tell_from_a_cycle_is_called_neither_a_cycle_nor_a_mode(factor, fast, steps):
    """A mode with -factor among others up to ``fast``: a theta below its limit, or both readings and more iterates."""
    z = np.append(np.linspace(1 - fast, 1 + fast, 14), 1 + factor) / 0.4
    solution = np.linspace(1, 2, 15)
    image = lambda x: solution - (z - 1) * (x - solution)
    found = vf.couple(
        lambda g: g, image, start=np.zeros(15), kind="tied", rule="constant", theta=0.4, max_iterations=steps
    )
    advice, limit = found.advice, 2 / z[-1]
    if advice.theta is not None:
        assert advice.theta < 0.98 * limit
    else:
        assert advice.vectors.period == 2
        assert "or theta at its limit, where a mode hardly decays or grows; more iterates" in advice.why_no_theta
    assert (factor, found.diverged) != (1.0, True)
    if steps == 24 and fast > 0:
        assert (advice.theta is None) == (factor == 1)


@pytest.mark.parametrize("kind", ["contact", "tied"])
@pytest.mark.parametrize("digits", [3, 9])
@pytest.mark.parametrize("steps", [6, 12, 24])
@pytest.mark.parametrize("factor", [0.999, 0.9999, 1.0, 1.0001, 1.001])
def test_logs_of_a_mode_near_minus_1_bound_rho_only_if_the_residual_stays_there(factor, steps, digits, kind, tmp_path):
    residuals = [factor**n * 3 + 0.3 ** (n + 1) for n in range(steps)]
    (tmp_path / "log").write_text("".join(f"{value:.{digits - 1}e}\n" for value in residuals))
    found, rho = vf.advise_logs([(tmp_path / "log", "0.4")], kind=kind), (1 + factor) / 0.4 - 1
    for reading in found.readings:
        assert reading.kind != "mode-high" or reading.lo <= rho + 1e-6
        assert reading.kind != "level" or "if a longer run stays there too" in reading.says or factor < 1
    if (least := found.interval.lo) is not None and float(least.value) > rho + 1e-6:
        assert "stays at its level in a longer run too" in least.assumes
    assert found.next.theta < 0.4 or (found.next.again and "steps or more" in found.next.why)
