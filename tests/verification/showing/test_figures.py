"""Figures: the same file every time, axes with units, nothing taken from the user's settings."""

import re
from dataclasses import replace
from xml.etree import ElementTree

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.text import Text
from readable import contrast, grey
from strategies import AT_NIGHT

import verification as vf
from verification import figures
from verification.algorithm.loop import Outcome
from verification.bounds.bound import Region
from verification.cli.problems import examples
from verification.figures import draw_bodies, draw_residuals, save
from verification.figures.style import OUTCOMES, RAISED, new_figure
from verification.registry import BOUNDS
from verification.sweeps.region import Plane, Point

LOWERED = {raised: plain for plain, raised in RAISED.items()}


@pytest.fixture(scope="module")
def problems(tmp_path_factory):
    folder = tmp_path_factory.mktemp("problems")
    for name, text in examples().items():
        # coarser: what is drawn is the same
        text = text.replace("cells = [40, 6]", "cells = [15, 3]").replace("cells = [24, 6]", "cells = [9, 3]")
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    return {name: vf.load(folder / f"{name}.toml") for name in examples()}


def test_the_waterfall_says_which_bars_are_squared_and_what_they_are_without_the_square(comparisons):
    found = comparisons["inside"].losses
    alone, _, chain = (
        [text.get_text().strip() for text in ax.texts] for ax in figures.draw_waterfall(found, "MPa").axes
    )
    squared = {loss.label: says for loss, says in zip(found.links, alone, strict=True) if "squared" in says}
    assert set(squared) == {"(5.29)", "(5.38)"}
    assert squared["(5.38)"].split("\N{MULTIPLICATION SIGN} ")[1] == f"{chain[-1]} (squared)"


#: What stands for mathematics where none is set.
TYPED = re.compile(r"Gamma_c|\|\|\||~")


def test_no_figure_has_mathematics_as_it_is_typed_in_a_program(comparisons):
    for comparison in comparisons.values():
        drawn = [draw_bodies(comparison.run, motions=True), draw_residuals(comparison.run, comparison.computed)]
        if comparison.losses:
            drawn.append(figures.draw_waterfall(comparison.losses, "MPa"))
        for figure in drawn:
            texts = [text.get_text() for text in figure.findobj(Text)]
            assert [text for text in texts if TYPED.search(re.sub(r"\$.*?\$", "", text))] == []


@pytest.fixture(scope="module")
def comparisons(problems):
    """With bounds: these are dear."""
    return {name: vf.compare(problems[name]) for name in ("inside", "section6", "two-bars")}


@pytest.fixture(scope="module")
def runs(problems):
    return {name: vf.run(problem) for name, problem in problems.items()}


def files(comparison, folder, ending):
    """Both figures as they are written."""
    result = {}
    drawings = {"bodies": draw_bodies(comparison.run), "residuals": draw_residuals(comparison.run, comparison.computed)}
    for figure, drawing in drawings.items():
        save(drawing, folder / f"{figure}.{ending}")
        result[figure] = (folder / f"{figure}.{ending}").read_bytes()
    return result


@pytest.mark.parametrize(
    ("name", "ending"), [("inside", "svg"), ("two-bars", "png"), *[("two-bars", "svg")] * AT_NIGHT]
)
def test_the_same_run_gives_the_same_file_whatever_settings_the_user_has_and_leaves_them(
    comparisons, tmp_path, name, ending
):
    first = files(comparisons[name], tmp_path, ending)
    other = {"axes.linewidth": 9.0, "figure.facecolor": "black", "savefig.transparent": True, "lines.linewidth": 7.0}
    with mpl.rc_context(other):
        before = dict(mpl.rcParams)
        assert files(comparisons[name], tmp_path, ending) == first
        assert dict(mpl.rcParams) == before


@pytest.mark.parametrize("name", examples())
def test_lengths_and_stresses_are_drawn_with_their_units(runs, name):
    run = runs[name]
    length, stress = (f"[{run.units[quantity]}]" for quantity in ("length", "stress"))
    meshes, *stresses = draw_bodies(run).axes
    if run.pair.contact.grid.dimension == 1:
        assert (meshes.get_xlabel(), stresses) == (f"x {length}", [])
    else:
        assert meshes.get_ylabel() == f"y {length}"
        assert stresses[0].get_xlabel().endswith(length)
        assert stresses[0].get_ylabel() == f"stress {stress}"


@pytest.mark.parametrize("name", examples())
def test_residuals_are_drawn_on_a_logarithmic_axis_that_says_what_it_shows(runs, name):
    run = runs[name]
    (axes,) = draw_residuals(run).axes
    assert axes.get_yscale() == "log"
    assert (axes.get_xlabel(), axes.get_ylabel()) == (
        "evaluations of T",
        r"residual $|\!|\!|T g - g|\!|\!|$, relative to the forces",
    )
    x, y = axes.lines[0].get_data()
    shown = [(i, r) for i, r in enumerate(run.history) if r > 0]
    assert list(zip(x, y, strict=True)) == shown


def test_only_an_edition_with_a_factor_draws_its_bound(comparisons):
    labels = lambda name: (
        draw_residuals(comparisons[name].run, comparisons[name].computed).axes[0].get_legend_handles_labels()[1]
    )
    drawn = lambda name: [label for label in labels(name) if label.endswith("bound")]
    assert drawn("inside") == ["repaired bound", "energy bound", "lmi bound"]
    assert drawn("section6") == ["energy bound", "lmi bound"]


def test_pressure_shear_and_states_are_those_of_the_run(comparisons):
    run = comparisons["section6"].run
    lines = {line.get_label(): line for line in draw_bodies(run).axes[1].lines}
    assert np.array_equal(lines["pressure $-\\sigma_N$"].get_ydata(), run.contact.pressure)
    assert np.array_equal(lines["shear $\\sigma_T$ on body 2"].get_ydata(), run.contact.shear)
    for state, count in run.contact.pattern.items():
        assert (state in lines) == (count > 0)
        assert count == 0 or len(lines[state].get_xdata()) == count


def test_bodies_pressed_together_are_drawn_touching(comparisons):
    meshes = draw_bodies(comparisons["section6"].run).axes[0]
    lower, upper = (collection for collection in meshes.collections if isinstance(collection, PolyCollection))
    edge = lambda body: np.unique(np.round(np.concatenate([path.vertices for path in body.get_paths()]), 9), axis=0)
    shared = {tuple(point) for point in edge(lower)} & {tuple(point) for point in edge(upper)}
    assert len(shared) >= comparisons["section6"].run.contact.pattern["stick"]


@pytest.mark.parametrize(
    ("name", "history"), [("inside", 1), ("two-bars", 2), *[("inside", 2), ("two-bars", 1)] * AT_NIGHT]
)
def test_a_run_cut_short_can_be_drawn(comparisons, tmp_path, name, history):
    comparison = comparisons[name]
    short = replace(comparison.run, iterates=comparison.run.iterates[:history], outcome=Outcome.INTERRUPTED)
    save(draw_bodies(short), tmp_path / "bodies.svg")
    save(draw_residuals(short, comparison.computed), tmp_path / "residuals.svg")
    for figure in ("bodies", "residuals"):
        assert ElementTree.parse(tmp_path / f"{figure}.svg").getroot().tag.endswith("svg")


def test_powers_of_ten_are_written_as_text(tmp_path):
    figure = new_figure(4.0, 3.0)
    ax = figure.subplots()
    ax.set(xscale="log", yscale="log", xlim=(1e-12, 1e2), ylim=(0.2, 0.9))
    save(figure, tmp_path / "powers.svg")
    texts = {"".join(text.itertext()) for text in ElementTree.parse(tmp_path / "powers.svg").findall(".//{*}text")}
    assert {"10⁻¹⁰", "10⁰", "2×10⁻¹", "4×10⁻¹"} <= texts
    assert all(float(text.replace("×10", "e").replace("10", "1e").translate(LOWERED)) > 0 for text in texts)


# --- read by everyone, on paper too -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def plane():
    """A plane with a region of every bound and a run of every outcome."""
    region = lambda k: Region(k=(k / 2, k), theta=((0.1, 0.9), (0.2, 0.8)), every=k, some=k)
    points = [
        Point(theta=0.1 * i, k=0.1, outcome=Outcome(outcome), iterations=9, coupled_residual=None)
        for i, outcome in enumerate(OUTCOMES, 1)
    ]
    regions = {name: region(10.0**-i) for i, name in enumerate([*BOUNDS][::-1])}
    return Plane(
        title="all",
        regions=regions,
        points=tuple(points),
        reason={},
        problem=vf.example("section6"),
        units={"length": "mm", "stress": "MPa"},
    )


def test_the_border_of_a_region_is_a_line_between_two_frictions_on_linear_and_on_logarithmic_axes(plane):
    for ax in plane.plot().axes:
        drawn = [c for c in ax.collections if isinstance(c, PolyCollection)]
        for each, region in zip(drawn, reversed([plane.regions[name] for name in BOUNDS]), strict=True):
            outline, middle = each.get_paths()[0].transformed(ax.transScale), 0.75 * region.k[-1]
            covers = lambda theta, at=outline, k=middle, ax=ax: at.contains_point(ax.transScale.transform((theta, k)))
            assert [covers(theta) for theta in (0.149, 0.151, 0.849, 0.851)] == [False, True, True, False]


def test_regions_are_told_apart_in_grey_print_and_their_hatches_seen(plane):
    drawn = [c for c in plane.plot().axes[0].collections if isinstance(c, PolyCollection)]
    assert len(drawn) == len(BOUNDS)
    fills = [each.get_facecolor()[0] for each in drawn]
    assert all(fill[3] == 1 for fill in fills)  # else what lies below changes it
    shades = sorted(grey(fill[:3]) for fill in fills)
    assert min(np.diff([*shades, 1.0])) > 0.05
    assert min(np.diff(shades)) > 0.15
    for each, fill in zip(drawn, fills, strict=True):
        if each.get_hatch():
            assert contrast(each.get_edgecolor()[0][:3], fill[:3]) > 3


def test_runs_of_each_outcome_have_a_marker_of_their_own_that_stands_out(plane):
    lines = plane.plot().axes[0].lines
    assert len({line.get_marker() for line in lines}) == len(OUTCOMES)
    for line in lines:
        assert contrast(line.get_markerfacecolor(), line.get_markeredgecolor()) > 3


def test_lines_of_bounds_stand_out_on_white_and_have_dashes_of_their_own(comparisons):
    assert all(contrast(bound.colour, "white") > 4.5 for bound in BOUNDS.values())
    for comparison in comparisons.values():
        lines = draw_residuals(comparison.run, comparison.computed).axes[0].lines
        assert all(contrast(line.get_color(), "white") > 3 for line in lines if len(line.get_xdata()) > 2)
    assert len({str(bound.dashes) for bound in BOUNDS.values()}) == len(BOUNDS)
