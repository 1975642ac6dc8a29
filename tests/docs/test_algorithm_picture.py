"""The picture of one step in README is what its script draws, small, and on a ground of its own."""

import re
from pathlib import Path

import numpy as np
import pytest
from readable import faults

from verification.figures import save

PICTURE = Path(__file__).parents[2] / "docs" / "algorithm.svg"


@pytest.fixture(scope="module")
def figure(builder):
    return builder.algorithm.drawn()


def parts(svg: str) -> tuple[list[str], np.ndarray]:
    """What lies between the numbers, without the ids that are made of them, and the numbers."""
    svg = re.sub(r'(id="|href="#|url\(#)[^")]*', r"\1", svg)
    number = r"-?\d+(?:\.\d+)?(?:e-?\d+)?"
    return re.split(number, svg), np.array(re.findall(number, svg), dtype=float)


def test_the_committed_picture_is_what_the_script_draws(figure, tmp_path):
    save(figure, tmp_path / "algorithm.svg")
    words, numbers = parts((tmp_path / "algorithm.svg").read_text("utf-8"))
    committed, there = parts(PICTURE.read_text("utf-8"))
    assert words == committed, "python docs/builder/algorithm.py draws it again"
    assert numbers == pytest.approx(there, abs=1e-3)


def test_it_is_read_on_a_dark_page_too_and_is_small(figure):
    assert PICTURE.stat().st_size < 200_000
    assert list(faults(figure)) == []
    assert figure.get_facecolor() == (1.0, 1.0, 1.0, 1.0)
    assert "fill: #ffffff" in PICTURE.read_text("utf-8").partition("</g>")[0]


def test_the_third_frame_mixes_the_forces_of_the_other_two(figure):
    old, new, mixed = (np.array(line.get_ydata()) for line in figure.axes[2].lines)
    assert mixed == pytest.approx((old + new) / 2)
    assert np.abs(new - old).max() > 0.2 * old.max()  # else one would see nothing
