"""The figure of the factor over theta: each bound has its curve, and a freer norm or more multipliers prove no less."""

import numpy as np
import pytest
from problem_list import small

import verification as vf
from verification.figures import factor
from verification.output.folder import Folder


@pytest.fixture(scope="module")
def compared():
    return vf.compare(vf.Problem.from_dict(small()), bounds=("printed", "energy", "lmi", "lyapunov"))


def test_curves_are_those_of_the_bounds_in_their_order(compared, monkeypatch):
    monkeypatch.setattr(factor, "PROVED", 4)
    (ax,) = factor.draw_proved(compared).axes
    curves = {line.get_label(): np.array(line.get_ydata(), float) for line in ax.get_lines()}
    energy, lmi, free = (
        curves[words] for words in ("the theorem in energy norms", "the semidefinite bound", "the free norm")
    )
    assert np.array(ax.get_lines()[0].get_xdata()) == pytest.approx([0.05, 0.35, 0.65, 0.95])
    proved = ~np.isnan(energy)
    assert proved.any()
    assert (lmi[proved] <= energy[proved] + 1e-6).all()
    assert (free <= lmi + 5e-3).all()
    assert "the printed theorem" not in curves
    assert curves["rate of the run"] == pytest.approx([compared.run.observed_rate.value])
    assert curves["rate of the run"][0] < np.interp(float(compared.run.theta), [0.65, 0.95], lmi[2:])


def test_it_is_written_where_the_free_norm_was_asked_for(compared, tmp_path, monkeypatch):
    monkeypatch.setattr(factor, "PROVED", 2)
    Folder(tmp_path / "asked", "compare").write(compared)
    assert (tmp_path / "asked" / "factor.svg").exists()
    assert "The factor of one step over theta by each bound" in (tmp_path / "asked" / "report.html").read_text("utf-8")
    Folder(tmp_path / "not", "compare").write(vf.compare(vf.Problem.from_dict(small()), bounds=("energy",)))
    assert not (tmp_path / "not" / "factor.svg").exists()
