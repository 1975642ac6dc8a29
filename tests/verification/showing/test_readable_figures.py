"""Figures are read in grey print and by the colour-blind: no pale text, and no curves that only colour tells apart."""

from itertools import combinations

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from problem_list import changed
from readable import contrast, faults, grey
from strategies import AT_NIGHT

import verification as vf
from ndtheory import REPAIRED, Constants
from verification import figures
from verification.figures.sweep import draw_sweep
from verification.reproduce import reproduce

WHERE = {"body2": {"prescribed": {"top": ["0.006", "-0.015"]}}}


@pytest.fixture(scope="module")
def problem():
    return vf.Problem.from_dict(changed(**WHERE))


@pytest.fixture(scope="module")
def compared(problem):
    return vf.compare(problem)


@pytest.fixture(scope="module")
def drawn(problem, compared):
    """The figures by name."""
    swept = vf.sweep(problem, theta=["0.4", "0.7"], friction=[f"{0.02 * i:.2f}" for i in range(1, 13)])
    found = {
        "bodies": figures.draw_bodies(compared.run),
        "stresses": figures.draw_bodies(compared.run, stress="mises", motions=True),
        "residuals": figures.draw_residuals(compared.run, compared.computed),
        "ruler": figures.draw_ruler(compared),
        "losses": figures.draw_waterfall(compared.losses, "MPa"),
        "roles": vf.advise(problem).plot(),
        "squares": figures.draw_squares(Constants(m=1, M=1, C_R=1, C_K="1/10"), [REPAIRED]),
        "sweep": draw_sweep(swept, "theta", "iterations", curves="friction"),
    }
    return found | ({"Section 6": reproduce(["fig5"]).plot()} if AT_NIGHT else {})


NAMES = ("bodies", "stresses", "residuals", "losses", "roles", "squares", "sweep", *["Section 6"] * AT_NIGHT)


@pytest.mark.parametrize("name", NAMES)
def test_no_text_or_curve_is_too_light_and_no_two_curves_differ_only_in_colour(drawn, name):
    assert list(faults(drawn[name])) == []


def test_a_figure_with_faults_has_them_found():
    figure = figures.Figure()
    ax = figure.subplots()
    ax.plot([0, 1], [0, 1], color="#0072B2", label="blue")
    ax.plot([0, 1], [1, 0], color="#A04000", label="brown")
    ax.plot([0, 1], [1, 1], "--", color="#E69F00", label="orange")
    ax.set_title("pale", color="#E69F00")
    assert list(faults(figure)) == ["text 'pale'", "line 'orange'", "'blue' and 'brown'"]


def test_bodies_and_states_differ_in_grey_print(drawn):
    meshes, along = drawn["bodies"].axes
    fills = [c.get_facecolor()[0] for c in meshes.collections if isinstance(c, PolyCollection)]
    assert len(fills) == 2
    assert all(fill[3] == 1 for fill in fills)
    assert abs(grey(fills[0][:3]) - grey(fills[1][:3])) > 0.12
    marked = [line for line in along.lines if line.get_label() in ("stick", "slip", "open")]
    assert len(marked) > 1
    for one, other in combinations(marked, 2):
        assert one.get_marker() != other.get_marker()


def test_the_colours_of_stresses_rise_in_lightness(drawn):
    cells = drawn["stresses"].axes[0].collections[0]
    ramp = [grey(colour[:3]) for colour in cells.get_cmap()(np.linspace(0, 1, 12))]
    assert min(np.diff(ramp)) > 0.02
    assert contrast(cells.get_cmap()(0.0)[:3], cells.get_cmap()(1.0)[:3]) > 10
