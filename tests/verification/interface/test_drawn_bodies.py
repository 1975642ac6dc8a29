"""The figure of the bodies: one x axis, bodies that do not overlap, stresses, the friction bound, a mark of failure."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from mesh_writer import write_curved
from problem_list import bars, changed

import verification as vf
from fem1d2d import depths
from verification.figures import draw_bodies, save
from verification.interface.friction import hat

STEEL = {"young": 70000, "poisson": "0.3"}
FLAT = {"shape": "rectangle", "x": ["-0.3", "0.3"], "y": ["-0.2", 0], "cells": [30, 10], "fixed": ["bottom"], **STEEL}
TALL = {"body1": {"x": ["0.4", "1.6"], "y": [-2, 0]}, "body2": {"y": [0, 3], "prescribed": {"top": [0, "-0.01"]}}}


def disc(folder: Path) -> vf.Problem:
    """A disc of radius 1 on a flat body: the gap differs from node to node."""
    grid = np.linspace(-0.2, 0.2, 21)
    line = lambda x: 1 - np.sqrt(1 - x**2)
    upper = {"mesh": write_curved(folder / "high.msh", grid, line, lambda x: 0 * x + 0.2), **STEEL}
    contact = {"interval": ["-0.1", "0.1"], "friction": 0}
    body2 = {**upper, "prescribed": {"top": [0, "-0.004"]}}
    return vf.Problem.from_dict({"body1": FLAT, "body2": body2, "contact": contact, "iteration": {"theta": "0.5"}})


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    problems = {
        "section 6": changed(),
        "tall": changed(**TALL),
        "other grid": changed(body2={"cells": [7, 2]}),
        "gap": changed(contact={"gap": "0.004"}),
        "local": changed(contact={"law": "local"}),
    }
    found = {name: vf.run(vf.Problem.from_dict(data)) for name, data in problems.items()}
    return found | {"disc": vf.run(disc(tmp_path_factory.mktemp("disc")))}


NAMES = ("section 6", "tall", "other grid", "gap", "local", "disc")


def drawn_cells(figure) -> list[np.ndarray]:
    """The cells of each body as they are drawn, shape (cells, 3, 2)."""
    bodies = [c for c in figure.axes[0].collections if isinstance(c, PolyCollection)]
    return [np.array([path.vertices[:3] for path in body.get_paths()]) for body in bodies]


def outline(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges of one cell only, with the body on their left."""
    edges = [(tuple(cell[i]), tuple(cell[(i + 1) % 3])) for cell in cells for i in range(3)]
    single = [edge for edge in edges if edge[::-1] not in set(edges)]
    start, end = np.array(single).transpose(1, 0, 2)
    return start, end


def scale(figure) -> float:
    return float(figure.axes[0].get_title(loc="left").rpartition(" x ")[2])


ALL = {"stress": "mises", "motions": True, "zoom": True}


@pytest.mark.parametrize(("name", "options"), [("section 6", {}), ("tall", {}), ("tall", ALL), ("disc", ALL)])
def test_the_frames_of_all_panels_line_up_over_one_x_axis(runs, name, options):
    figure = draw_bodies(runs[name], **options)
    figure.draw_without_rendering()
    first, *others = figure.axes
    assert len(others) == 1 + ("motions" in options)
    box = first.get_position()
    size = figure.get_size_inches()
    for ax in others:
        assert (ax.get_position().x0, ax.get_position().x1) == pytest.approx((box.x0, box.x1), abs=1e-6)
        assert ax.get_xlim() == first.get_xlim()
    assert box.height * size[1] <= 0.81 * box.width * size[0]  # tall bodies get room at both sides
    per_mm = [ends / np.ptp(limits) for ends, limits in (
        (box.width * size[0], first.get_xlim()), (box.height * size[1], first.get_ylim()))]  # fmt: skip
    assert per_mm[0] == pytest.approx(per_mm[1], rel=1e-6)  # as long as it is high


@pytest.mark.parametrize("name", NAMES)
def test_drawn_bodies_do_not_reach_into_each_other(runs, name):
    figure = draw_bodies(runs[name])
    lower, upper = map(outline, drawn_cells(figure))
    width = max(np.ptp(start[:, 0]) for start, _ in (lower, upper))
    for one, other in ((lower, upper), (upper, lower)):
        assert depths(one[0], *other).max() <= 0.0025 * width
    assert scale(figure) >= 1


def test_a_gap_that_differs_from_node_to_node_limits_the_scale_and_a_flat_one_does_not(runs):
    """At the scale above that of the disc the bodies, which touch, would be drawn into each other."""
    assert scale(draw_bodies(runs["disc"])) == 1
    assert scale(draw_bodies(runs["gap"])) > 1


def test_touching_nodes_above_a_flat_gap_are_drawn_touching(runs):
    for name in ("section 6", "gap"):
        (_, above), (_, below) = map(outline, drawn_cells(draw_bodies(runs[name]))[::-1])
        lowest = above[above[:, 1] < above[:, 1].min() + 0.02]
        sticking = runs[name].contact.pattern["stick"]
        shared = {tuple(p) for p in np.round(lowest, 9)} & {tuple(p) for p in np.round(below, 9)}
        assert len(shared) >= sticking > 0


def test_an_obstacle_is_drawn_where_the_body_touches_it():
    solution = vf.solve(vf.Problem.from_dict({**changed(contact={"gap": "0.003"}), "body1": {"shape": "rigid"}}))
    figure = draw_bodies(solution)
    (level,) = {y for line in figure.axes[0].lines for y in line.get_ydata()}
    assert scale(figure) > 1
    assert drawn_cells(figure)[0][..., 1].min() == pytest.approx(level, abs=1e-9)


@pytest.mark.parametrize("name", ["section 6", "other grid"])
def test_the_band_beside_the_shear_is_the_friction_bound_of_the_nonlocal_law(runs, name):
    """k times the sum of nodal forces by the hat kernel, from the table and the file's numbers."""
    run = runs[name]
    neumann = run.pair.neumann.grid
    k, radius = float(run.problem.contact.friction), float(run.problem.contact.radius)
    force = run.last.g[neumann.normal]
    kernel = np.array([[hat(np.array(x - at), radius) for at in neumann.x] for x in run.contact.x])
    assert run.contact.bound == pytest.approx(k * np.abs(kernel @ force), rel=1e-12)
    (band,) = draw_bodies(run).axes[1].collections
    heights = band.get_paths()[0].vertices[:, 1]
    assert (heights.min(), heights.max()) == pytest.approx((-run.contact.bound.max(), run.contact.bound.max()))


def test_the_bound_of_the_local_law_is_k_times_the_pressure(runs):
    contact = runs["local"].contact
    assert contact.bound == pytest.approx(0.2 * contact.pressure, rel=1e-7)
    solution = vf.solve(runs["local"].problem).contact
    assert solution.bound == pytest.approx(0.2 * solution.pressure, rel=1e-12)


@pytest.mark.parametrize("name", ["section 6", "other grid", "local"])
def test_the_shear_reaches_the_bound_where_it_slips_and_nowhere_beyond(runs, name):
    for contact in (runs[name].contact, vf.solve(runs[name].problem).contact):
        slips = np.array(contact.status) == "slip"
        assert slips.any()
        assert np.abs(contact.shear)[slips] == pytest.approx(contact.bound[slips], rel=1e-9)
        assert (np.abs(contact.shear) <= contact.bound * (1 + 1e-9)).all()


def test_gap_and_slip_are_drawn_on_request(runs):
    run = runs["gap"]
    lines = {line.get_label(): line for line in draw_bodies(run, motions=True).axes[2].lines}
    assert np.array_equal(lines["gap"].get_ydata(), run.contact.gap)
    assert np.array_equal(lines["slip $u^1_T - u^2_T$"].get_ydata(), run.contact.slip)


def test_the_zoom_shows_what_touches_and_little_else(runs):
    run = runs["disc"]
    low, high = draw_bodies(run, zoom=True).axes[0].get_xlim()
    touching = run.contact.x[np.array(run.contact.status) != "open"]
    assert low < touching.min() < touching.max() < high
    assert high - low < np.ptp(touching) + 7 * 0.02


def test_the_zoom_is_no_wider_where_the_bodies_touch_only_at_both_ends():
    parts = {"mid": ["0.8", "1.2"], "low": ["0.4", "0.5"], "high": ["1.5", "1.6"]}
    lifted = {
        "y": [0, "0.1"],
        "cells": [24, 3],
        "parts": {name: {"side": "top", "x": ends} for name, ends in parts.items()},
        "prescribed": {"mid": [0, "0.001"]},
        "traction": {"low": [0, -300], "high": [0, -300]},
    }
    solved = vf.solve(vf.Problem.from_dict(changed(body2=lifted)))
    assert set(solved.contact.status[10:15]) == {"open"} != {solved.contact.status[0], solved.contact.status[-1]}
    zoomed, whole = (np.ptp(draw_bodies(solved, zoom=part).axes[0].get_xlim()) for part in (True, False))
    assert zoomed < whole


@pytest.mark.parametrize("ends", [{}, {"x": ["-5", 5]}])
def test_an_obstacle_that_is_far_away_is_out_of_the_picture(ends):
    block = {"shape": "rectangle", "x": [0, 1], "y": [0, 1], "cells": [2, 2], "young": 1, "poisson": 0}
    upper = block | {"prescribed": {"top": [0, "-0.1"]}}
    far = {"body1": {"shape": "rigid", **ends}, "body2": upper, "contact": {"gap": 3, "friction": 0}}
    solved = vf.solve(vf.Problem.from_dict(far))
    assert solved.contact.apart
    low, high = draw_bodies(solved).axes[0].get_ylim()
    assert -0.5 < low < 0 < 0.9 < high < 1.5


def test_cells_have_the_colour_of_their_stress(runs):
    """Under the middle of a wide block the stress sigma_yy is minus the pressure."""
    run = runs["section 6"]
    cells = [c for c in draw_bodies(run, stress="sigma_yy").axes[0].collections if isinstance(c, PolyCollection)]
    for body, coloured in zip(run.bodies.elastic, cells, strict=True):
        centres = body.mesh.points[body.mesh.cells].mean(axis=1)
        near = np.argmin(np.hypot(centres[:, 0] - 1, centres[:, 1]))
        middle = run.contact.pressure[len(run.contact.x) // 2]
        assert coloured.get_array()[near] == pytest.approx(-middle, rel=0.1)


def test_stresses_that_there_are_not_are_refused(runs):
    with pytest.raises(ValueError, match="'shear': needed one of mises, sigma_yy"):
        draw_bodies(runs["section 6"], stress="shear")
    with pytest.raises(ValueError, match="'body': needed one of residuals, bodies"):
        runs["section 6"].plot("body")


def test_bars_are_coloured_by_their_only_stress():
    run = vf.run(vf.Problem.from_dict(bars()))
    for cells in draw_bodies(run, stress="mises", motions=True, zoom=True).axes[0].collections:
        assert np.asarray(cells.get_array()) == pytest.approx(
            np.full(len(cells.get_array()), run.contact.pressure[0]), rel=1e-6
        )


def test_a_run_that_has_not_converged_says_so_in_both_figures(runs, tmp_path):
    pair = vf.build(vf.Problem.from_dict(changed()))
    diverged = vf.run(pair.changed(friction=0, young=(70000, 7), theta="0.9", neumann_body=2))
    short = vf.run(vf.Problem.from_dict(changed(iteration={"max_iterations": 2})))
    for run, word in ((diverged, "diverged"), (short, "limit")):
        for figure in (run.plot("bodies"), run.plot()):
            assert f"not converged ({word})" in {text.get_text() for text in figure.axes[0].texts}
            save(figure, tmp_path / "figure.svg")
            assert f"not converged ({word})" in (tmp_path / "figure.svg").read_text("utf-8")
    for figure in (runs["gap"].plot("bodies"), runs["gap"].plot()):
        assert not [text for text in figure.axes[0].texts if "not converged" in text.get_text()]


def test_plot_of_a_run_and_of_a_solution_take_the_options(runs):
    run = runs["section 6"]
    for figure in (
        run.plot("bodies", stress="mises", motions=True),
        vf.solve(run.problem).plot(stress="mises", motions=True),
    ):
        assert len(figure.axes) == 3
        (bar,) = (ax for ax in figure.axes[0].child_axes)
        assert bar.get_ylabel() == "von Mises stress\n[MPa]"
