"""The figure of h_1 and h_2: the paper's polynomials (5.39) and (5.45), its marks, and three regimes of friction."""

import math

import numpy as np
import pytest

from ndtheory import EDITIONS, REPAIRED, Constants, evaluate
from verification.bounds.table import Calculated
from verification.cli import main
from verification.figures import draw_squares

TEXTBOOK = {"m": 1.0, "M": 1.0, "C_R": 1.0}
SECTION_6 = {"m": 3084.0, "M": 153229.0, "C_R": 1.7}


def lines(ax):
    return {line.get_label(): line for line in ax.lines}


def friction(ax) -> float:
    return float(ax.get_title(loc="left").partition("$C_K$ = ")[2].partition(",")[0])


@pytest.mark.parametrize("given", [0.1, 0.4])
def test_both_curves_are_the_polynomials_of_the_paper(given):
    """(5.39) and (5.45) in the paper's own terms: a = 1 + 2 M^2/m^2 (..) and so on, with m = M = C_R = 1."""
    figure = draw_squares(Constants(**TEXTBOOK, C_K=given), [REPAIRED])
    (ax,) = (ax for ax in figure.axes if "as given" in ax.get_title(loc="left"))
    C_T = 1 + given + math.sqrt(given)
    term = given * C_T + given  # of the last bracket of (5.45)
    theta, h2 = lines(ax)["$h_2$"].get_data()
    assert 1 + np.array(h2) == pytest.approx((1 - theta) ** 2 + 2 * theta * (1 - theta) * term, abs=1e-12)
    _, h1 = lines(ax)["$h_1$"].get_data()
    rest = theta**2 - 2 * theta * (1 - theta)  # (5.36): vanishes at C_0 = 2/3
    assert np.array(h1) == pytest.approx(np.array(h2) + rest * C_T**2, abs=1e-12)


@pytest.mark.parametrize("edition", EDITIONS, ids=lambda edition: edition.name)
@pytest.mark.parametrize("constants", [TEXTBOOK, SECTION_6], ids=["textbook", "Section 6"])
def test_each_panel_has_a_friction_of_its_regime_and_the_marks_of_the_theorem(constants, edition):
    row = draw_squares(Constants(**constants, C_K=1e-30), [edition]).axes
    ends = evaluate(edition, Constants(**constants, C_K=1))
    regimes = [(0, ends.C3.value), (ends.C3.value, ends.C4.value), (ends.C4.value, ends.C5.value)]
    for ax, (low, high) in zip(row, regimes, strict=True):
        found = friction(ax)
        assert low * (1 - 6e-3) <= found <= high * (1 + 6e-3)  # a title has three digits
        marked = {
            text.get_text().strip(): line for text, line in zip(ax.texts, ax.lines[-len(ax.texts) :], strict=True)
        }
        assert set(marked) == {"$C_0$", "$C_1$"} | ({"$C_6$"} if ax is row[2] else set())
        at = {name: line.get_xdata()[0] for name, line in marked.items()}
        assert at["$C_0$"] == pytest.approx(ends.C0.value, rel=1e-12)
        below = np.array(lines(ax)["bound of the squared factor"].get_ydata()) < 0
        theta = np.array(lines(ax)["$h_2$"].get_xdata())
        inside = (theta > at.get("$C_6$", 0.0)) & (theta < at["$C_1$"])
        assert np.array_equal(below[1:], inside[1:])


def test_the_figure_of_the_calculator_has_the_editions_asked_for(tmp_path, capsys):
    target = tmp_path / "h.svg"
    words = ["bounds", "--m", "1", "--M", "2", "--CR", "1", "--CK", "0.1", "-o", str(target)]
    assert main([*words, "--edition", "repaired"]) == 0
    assert "repaired, " in target.read_text("utf-8")
    assert "printed, " not in target.read_text("utf-8")
    assert main(words) == 0  # over its own file
    assert "printed, " in target.read_text("utf-8")
    assert "factor" in capsys.readouterr().out


def test_a_figure_needs_the_constants_of_section_5_and_a_place(tmp_path, capsys):
    target = tmp_path / "h.svg"
    assert main(["bounds", "--rho", "0.5", "-o", str(target)]) == 2
    assert "-o draws h_1 and h_2: it needs --m, --M, --CR and --CK" in capsys.readouterr().err
    target.write_text("of a user")
    assert main(["bounds", "--m", "1", "--M", "2", "--CR", "1", "--CK", "0.1", "-o", str(target)]) == 2
    assert "not written by this program" in capsys.readouterr().err
    assert target.read_text() == "of a user"
    with pytest.raises(ValueError, match="h_1 and h_2 need the constants"):
        Calculated(constants=None, energy=None, theta=None, results={}).plot()
