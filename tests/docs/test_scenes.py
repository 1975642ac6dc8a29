"""Widgets made of scenes: what they show before and after the answer, whether it can be read, and whether it is so."""

from __future__ import annotations

import random
import re
from fractions import Fraction
from itertools import islice, pairwise
from pathlib import Path

import numpy as np
import pytest
from browser import needs_browser
from scipy.linalg import eigh
from widget_page import drawn, frame, place, rows, says

import verification as vf
from ndtheory.energy_norms import predicted_factor
from verification.algorithm.fixed_point import FixedPointMap
from verification.bounds.bound import Subject
from verification.registry import BOUNDS

DOCS = Path(__file__).parents[2] / "docs"

#: Bounds of the plates are worked out once, for the page and for the tests of it.
pytestmark = pytest.mark.usefixtures("known_bounds")

#: The pages whose widget is made of scenes.
SCENES = sorted(path.stem for path in (DOCS / "builder" / "questions").glob("[!_]*.py"))


def test_all_questions_are_listed(builder):
    assert sorted((*builder.questions.PAGES, *builder.questions.FURTHER)) == SCENES


def test_a_page_asks_its_question_before_its_first_section(builder):
    for name in SCENES:
        page = builder.questions.FURTHER.get(name, name)
        introduction, _, rest = (DOCS / "examples" / f"{page}.md").read_text("utf-8").partition("\n## ")
        assert f"```{{widget}} {name}\n" in (introduction if page == name else rest)


def test_the_right_answer_is_found_neither_by_its_length_nor_by_its_place(builder):
    questions = [builder.questions.of(name).data() for name in SCENES]
    for asked in questions:
        assert len(set(asked["answers"])) == 3
        assert len(asked["right"]) <= max(len(answer) for answer in asked["answers"] if answer != asked["right"])
    assert len({asked["answers"].index(asked["right"]) for asked in questions}) > 1 or len(questions) == 1


def of_marks(marks):
    """The tags of the marks of a chart, from its data."""
    tags = {"line": ["path"], "note": ["text"]}
    each = {"dots": "circle", "crosses": "path"}
    return [tag for mark in marks for tag in tags.get(mark["kind"]) or [each[mark["kind"]]] * len(mark["points"])]


@needs_browser
@pytest.mark.parametrize("name", SCENES)
def test_before_the_answer_a_chart_has_its_fixed_marks_and_those_of_the_question_alone(unanswered, builder, name):
    data = builder.questions.of(name).data()
    charts = frame(unanswered, name).find_elements("css selector", "svg.chart")
    fixed = [chart["fixed"] for chart in data["charts"]]
    asked = [[*chart["fixed"], *chart["before"]] for chart in data["charts"]]
    assert [chart.is_displayed() for chart in charts] == [bool(marks) for marks in asked]
    assert [drawn(chart) for chart in charts] == [of_marks(marks) for marks in asked]
    frame(unanswered, name).find_element("css selector", ".reveal").click()
    scene = data["scenes"][",".join(str(slider["start"]) for slider in data["sliders"])]
    assert all(chart.is_displayed() for chart in charts)
    shown = [of_marks([*before, *after]) for before, after in zip(fixed, scene["marks"], strict=True)]
    assert [drawn(chart) for chart in charts] == shown
    assert frame(unanswered, name).find_element("css selector", ".told").text == f"Answer: {data['why']}"


@needs_browser
@pytest.mark.parametrize("name", SCENES)
def test_each_position_of_the_sliders_shows_its_scene(browser, builder, name):
    data = builder.questions.of(name).data()
    for key, scene in random.Random(name).sample(sorted(data["scenes"].items()), k=min(6, len(data["scenes"]))):
        positions = [int(position) for position in key.split(",")]
        place(browser, name, data, positions)
        shown = [slider["values"][i] for slider, i in zip(data["sliders"], positions, strict=True)]
        assert [output.text for output in frame(browser, name).find_elements("css selector", "output")] == shown
        assert says(browser, name) == scene["says"]
        assert rows(browser, name) == [[str(cell) for cell in row] for row in scene["rows"]]


#: Words of any scene that leave their chart, or lie on other words, a curve or a dot; the size of the smallest.
UNREADABLE = """
const [name] = arguments, frame = document.querySelector(`[data-widget=${name}]`), found = new Set();
const inputs = [...frame.querySelectorAll("input")];
const extent = (text) => { // without the room for accents
  const { x, y, width, height } = text.getBBox();
  return { left: x, right: x + width, top: y + 2, bottom: y + height - 2 };
};
const inside = (a, b) => a.left > b.left && a.right < b.right && a.top > b.top && a.bottom < b.bottom;
const meet = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
const dot = (x, y) => ({ left: x, right: x, top: y, bottom: y });
let smallest = Infinity;
for (const key of Object.keys(ndData[name].scenes)) {
  key.split(",").forEach((value, i) => { inputs[i].value = value; inputs[i].dispatchEvent(new Event("input")); });
  for (const chart of frame.querySelectorAll("svg.chart")) {
    const rect = chart.querySelector("clipPath rect").getBBox(), marks = chart.lastElementChild;
    const room = { left: rect.x, right: rect.x + rect.width, top: rect.y, bottom: rect.y + rect.height };
    const words = [...marks.querySelectorAll("text")].map((text) => [text.textContent, extent(text)]);
    const points = [...marks.querySelectorAll("circle")].map((one) => dot(one.cx.baseVal.value, one.cy.baseVal.value));
    for (const curve of marks.querySelectorAll("path.curve")) {
      for (let along = 0; along <= curve.getTotalLength(); along += 2) {
        const { x, y } = curve.getPointAtLength(along);
        points.push(dot(x, y));
      }
    }
    smallest = Math.min(smallest, 11 * chart.getBoundingClientRect().width / chart.viewBox.baseVal.width);
    words.forEach(([text, box], i) => {
      const say = (what) => found.add(`${key}: "${text}" ${what}`);
      if (!inside(box, room)) say("leaves its chart");
      if (points.some((point) => inside(point, box))) say("lies on a curve or a dot");
      for (const [other, its] of words.slice(i + 1)) if (meet(box, its)) say(`lies on "${other}"`);
    });
  }
}
return [[...found], smallest, document.documentElement.scrollWidth];
"""


@needs_browser
@pytest.mark.parametrize("name", SCENES)
def test_the_words_of_a_scene_lie_free_in_their_chart_and_are_read_on_a_phone(browser, name):
    metrics = {"width": 390, "height": 800, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    try:
        found, smallest, wide = browser.execute_script(UNREADABLE, name)
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    assert found == []
    assert smallest >= 9
    assert wide <= 390


@needs_browser
def test_words_that_cannot_be_read_are_found(browser):
    browser.execute_script(
        "const scene = Object.values(ndData.open_or_closed.scenes)[0];"
        "for (const [x, y, text] of [[0.4, 0.6, 'on a curve'], [0.74, 0.2, 'outside'], [0.39, 0.6, 'on words']])"
        "  scene.marks[0].push({ kind: 'note', points: [[x, y]], text, colour: '', anchor: 'start' });"
    )
    found = "; ".join(browser.execute_script(UNREADABLE, "open_or_closed")[0])
    assert '0: "on a curve" lies on a curve or a dot' in found
    assert '0: "outside" leaves its chart' in found
    assert '0: "on a curve" lies on "on words"' in found


# The numbers of each page.


def test_errors_of_open_or_closed_shrink_as_the_v_says(builder):
    pressed = vf.example("section6").changed(friction=0, young=(20000, 40000), cells=((10, 2), (6, 2)))
    rho = vf.measure(pressed).rho_normal.value
    for scene in builder.questions.of("open_or_closed").data()["scenes"].values():
        ((theta, closed),), ((_, opened),) = (mark["points"] for mark in scene["marks"][0] if mark["kind"] == "dots")
        assert opened == pytest.approx(1 - theta, abs=1e-5)
        assert closed == pytest.approx(abs(1 - theta * (1 + rho)), abs=1e-5)
        assert max(opened, closed) == pytest.approx(predicted_factor(theta, rho), abs=1e-5)
        for step, *sizes in scene["rows"]:
            for size, factor in zip(sizes, (closed, opened), strict=True):
                if size == "below 1e-06":
                    assert factor**step < 1.1e-6
                else:
                    assert float(size) == pytest.approx(factor**step, rel=6e-3, abs=1e-7)


@pytest.mark.parametrize("position", [2, 9])
def test_which_side_shows_what_the_advice_says_and_what_the_roles_cost(builder, position):
    """2/7 and 7/2, from moduli and thetas as the page writes them."""
    young = {2: (20000, 70000), 9: (70000, 20000)}[position]
    problem = vf.example("section6").changed(cells=((20, 3), (12, 3)), young=young)
    shown = builder.questions.of("which_side").data()["scenes"][str(position)]
    curves = [mark["points"] for mark in shown["marks"][1] if mark["kind"] == "line" and len(mark["points"]) > 2]
    roles = {role.neumann_body: role for role in vf.advise(problem).roles}
    for body, row, residuals in zip((1, 2), shown["rows"], curves, strict=True):
        run = vf.run(problem.changed(neumann_body=body), theta=f"{roles[body].theta_predicted:.3f}")
        assert run.converged
        name, *numbers = row
        assert name == {1: "lower plate", 2: "upper plate"}[body]
        rho, theta, factor, steps = map(float, numbers)
        assert rho == pytest.approx(roles[body].rho.value, rel=1e-3)
        assert theta == pytest.approx(roles[body].theta_predicted, abs=1e-4)
        assert factor == pytest.approx(roles[body].rate_predicted, abs=1e-4)
        assert len(residuals) - 1 == steps == pytest.approx(run.iterations, abs=1)
        assert residuals[1][1] == pytest.approx(run.iterates[1].relative_residual, rel=1e-2)


def test_constants_of_larger_plates_are_those_of_the_scenes(builder):
    """Plates of which each length is 100 times as long, where the scenes take a shorter length in the norm."""
    plates = vf.example("section6").changed(cells=((20, 3), (12, 3))).refined(1)
    one = vf.measure(plates)
    text = plates.to_dict()
    for body in ("body1", "body2"):
        text[body] |= {axis: [100 * Fraction(str(end)) for end in text[body][axis]] for axis in ("x", "y")}
    text["contact"] |= {"radius": 100 * Fraction(str(text["contact"]["radius"]))}
    large = vf.measure(vf.Problem.from_dict(text))
    shown = builder.questions.of("constants").data()["scenes"]["3,1"]
    ratios = {}
    for name, here, before, ratio in shown["rows"]:
        constant = "rho_max" if name == "rho" else name
        of_large, of_one = (getattr(measured, constant).value for measured in (large, one))
        assert float(here) == pytest.approx(of_large, rel=1e-3)
        assert float(before) == pytest.approx(of_one, rel=1e-3)
        assert float(ratio) == pytest.approx(of_large / of_one, rel=1e-2)
        ratios[name] = max(of_large / of_one, of_one / of_large)
    assert max(ratios, key=lambda name: ratios[name]) == builder.questions.of("constants").data()["right"]


def exact_solutions(k):
    """The states of all solutions at the node of the page on friction, in rational numbers.

    v = v0 - F c is the jump and minus the gap, c the force; F is the sum of the flexibilities of both bodies.
    """
    (F_TT, F_TN, F_NN), (v_T, v_N) = (Fraction(3, 2), Fraction(-1, 2), Fraction(3, 2)), (Fraction(12), Fraction(-1))
    found = {"open"} if v_N <= 0 else set()
    for sign in (1, -1):
        c = v_N / (F_NN + sign * k * F_TN)
        if c > 0 and sign * (v_T - (sign * k * F_TT + F_TN) * c) > 0:
            found.add("slip")
    det = F_TT * F_NN - F_TN**2
    c_T, c_N = (F_NN * v_T - F_TN * v_N) / det, (F_TT * v_N - F_TN * v_T) / det
    return found | ({"stick"} if c_N > 0 and abs(c_T) <= k * c_N else set())


def test_the_node_with_friction_has_the_solutions_of_the_picture_and_its_runs_end_there(builder):
    asked = builder.questions.of("friction")
    data = asked.data()
    for (i,), scene in ((map(int, key.split(",")), scene) for key, scene in data["scenes"].items()):
        k = Fraction(data["sliders"][0]["values"][i])
        named = {mark["text"] for mark in scene["marks"][0] if mark["kind"] == "note"}
        assert named - {"edge"} == exact_solutions(k), k
        for start, (_, state, force) in zip(asked.STARTS, scene["rows"], strict=True):
            end = vf.run(asked.node(float(k)), theta="0.4", start=start).last.g
            assert force == "({:.2f}, {:.2f})".format(*(end.round(4) + 0.0))
            assert state == ("open" if np.abs(end).max() < 1e-6 else "stick"), k
    assert exact_solutions(Fraction(34, 9)) == {"open"}
    assert exact_solutions(Fraction(36, 9)) == {"open", "slip", "stick"}
    measured = vf.measure(asked.node(4))
    assert f"Below k = {measured.friction_limit.value:.2f} it is proved" in data["why"]


def test_the_ruler_has_the_steps_of_comparisons_and_powers_of_the_factors(builder):
    """A comparison at one place, whose promises are counted by multiplying; the sentence of the answer at another."""
    asked = builder.questions.of("ruler")
    problem = vf.example("section6").changed(cells=((20, 3), (12, 3)), theta="0.7", friction="0.2")
    found, ours = vf.compare(problem), asked.marks()["0.7", "0.2"]
    for name in ("energy", "lmi"):
        factor, count = Fraction(found.bounds[name].factor.value), ours[name]
        assert factor**count <= Fraction(1, 10**9) < factor ** (count - 1)
    assert (ours["printed"], ours["repaired"], ours["run"]) == (None, None, found.run.iterations)
    for each in asked.marks().values():
        promised = [each[name] for name in ("printed", "repaired", "energy", "lmi") if each[name]]
        assert promised == sorted(promised, reverse=True)
        assert each["run"] is None or not promised or each["run"] <= promised[-1]
    tiny = asked.marks()["3.4e-11", "1e-22"]
    assert 5e11 < tiny["printed"] < 8e11
    assert float(asked.data()["right"]) == pytest.approx(tiny["printed"], rel=0.01)


@pytest.mark.parametrize("swapped", [False, True])
def test_runs_and_proofs_of_the_plane_of_dots_are_those_of_the_library(builder, swapped):
    """Each run by itself instead of in a sweep, and the factors of the bounds instead of their intervals."""
    data = builder.questions.of("theorem_and_experiment").data()
    problem = vf.example("section6").changed(cells=((20, 3), (12, 3)))
    problem = problem.swapped() if swapped else problem
    subject = Subject.of(vf.build(problem), vf.measure(problem))
    for k, row in [(1, 5), (2, 9), (4, 3), (5, 1)]:
        scene = data["scenes"][f"{int(swapped)},{k}"]
        friction = data["sliders"][1]["values"][k]
        theta, proved, q, outcome, rate = scene["rows"][row]
        run = vf.run(problem.changed(theta=str(theta), friction=friction, max_iterations=500))
        assert run.outcome == outcome, (theta, friction)
        assert rate == (f"{run.observed_rate.value:.3f}" if run.converged else "")
        here = subject.at(float(friction))
        bounds = {name: BOUNDS[name].evaluate(here, str(theta)).factor for name in ("energy", "lmi")}
        assert (proved == "yes") == any(bounds.values()), (theta, friction)
        assert (float(q) < 1) == (bounds["energy"] is not None)
        if bounds["energy"] is not None:
            assert float(q) == pytest.approx(bounds["energy"].value, abs=6e-4)


def test_predicted_rates_are_those_of_the_forecast_and_digits_come_at_the_last_change(builder):
    asked = builder.questions.of("prediction")
    data = asked.data()
    for i, k in enumerate(data["sliders"][0]["values"]):
        run = vf.run(asked.plates(k)).linearise()
        patterns = [iterate.contact.pattern for iterate in run.iterates]
        states = [(pattern.touching.tolist(), pattern.sliding.tolist()) for pattern in patterns]
        for n in (0, 1, 12, 15, 20):
            row = data["scenes"][f"{i},{n}"]["rows"][i]
            said, seen = float(row[2]), float(row[3])
            assert seen == pytest.approx(run.observed_rate.value, abs=6e-10)
            assert row[1] == max(m for m in range(1, len(states)) if states[m] != states[m - 1])
            assert (abs(said / seen - 1) < 1e-7) == (n >= row[1])
            if n >= row[1] and run.forecast:
                assert said == pytest.approx(run.forecast.rate, rel=1e-8)
    assert vf.run(asked.plates("0.2")).linearise().forecast


def normal_stiffness(body):
    """Stiffness and load of the normal unknowns, the tangential ones free."""
    free = np.flatnonzero(body.free)
    flexibility = np.linalg.inv(body.schur[np.ix_(free, free)])
    normal = free >= body.grid.normal.start
    stiffness = np.linalg.inv(flexibility[np.ix_(normal, normal)])
    return stiffness, stiffness @ (flexibility @ body.load[free])[normal]


def test_the_pressures_of_three_transfers_solve_the_problem_in_displacements(builder):
    """Forces are computed from flexibilities there, here from the stiffness of both bodies, tied by the transfer."""
    page = builder.questions.of("grids")
    data = page.data()
    for j, finer in enumerate(page.FINER):
        pair = vf.build(page.blocks(finer))
        (S1, l1), (S2, l2) = normal_stiffness(pair.contact), normal_stiffness(pair.neumann)
        x, y = pair.interface.contact.x, pair.interface.neumann.x
        exact = vf.solve(page.blocks(finer)).contact.pressure
        for i, (name, (transfer, _)) in enumerate(page.TRANSFERS.items()):
            P = transfer(x, y)
            u2 = np.linalg.solve(S2 + P.T @ S1 @ P, l2 + P.T @ l1)
            p = (l1 - S1 @ P @ u2) / pair.interface.contact.weights / exact
            scene = data["scenes"][f"{i},{j}"]
            assert [float(row[1]) for row in scene["rows"]] == pytest.approx(p, abs=1e-4)
            varies = "the pressure is constant" if name == "mortar" else f"varies by {100 * np.ptp(p):.1f} percent"
            assert varies in scene["says"]


def test_the_run_that_the_test_of_the_paper_stops_is_that_of_mixing_by_hand(builder):
    """Shares by a pseudo-inverse in the Cholesky coordinates of the norm, the solution by the global method."""
    page = builder.questions.of("beyond_constant")
    problem = page.plates()
    T, theta = FixedPointMap(vf.build(problem)), 0.5
    size = T.pair.neumann.grid.size
    root = np.linalg.cholesky(T.pair.neumann.flexibility(np.eye(size))).T
    gs, rs = [np.zeros(size)], []
    for _ in range(4):
        rs.append(T.contact(gs[-1], T.displacement(gs[-1])).force - gs[-1])
        G, R = np.diff(gs, axis=0).T.reshape(size, -1), np.diff(rs, axis=0).T.reshape(size, -1)
        shares = np.linalg.pinv(root @ R, rcond=1e-6) @ root @ rs[-1]
        gs.append(gs[-1] + theta * rs[-1] - (G + theta * R) @ shares)
    solution = vf.solve(problem).contact
    exact = solution.pressure * T.pair.interface.contact.weights
    error = gs[-1][T.pair.neumann.grid.normal] - exact
    wrong = np.linalg.norm(error) / np.linalg.norm(exact)
    changes = [np.linalg.norm(b - a) / np.linalg.norm(b) for a, b in pairwise(gs)]
    assert changes[3] < 1e-9 < 0.1 < min(changes[:3])
    data = page.data()
    assert data["right"] == f"{100 * wrong:.0f} percent of it"
    ends = gs[-1][T.pair.neumann.grid.normal][0] / exact[0]
    assert f"the pressure is {ends:.1f} times that of the solution" in data["why"]


def test_the_ratios_of_the_logs_are_factors_of_the_modes_of_the_closed_nodes(builder):
    page = builder.questions.of("other_code")
    data = page.data()
    pair = vf.build(page.plates())
    closed = np.flatnonzero(vf.run(pair, theta="0.5", rule="newton").last.contact.pattern.touching)
    soft, hard = (
        np.linalg.inv(normal_stiffness(body)[0])[np.ix_(closed, closed)] for body in (pair.neumann, pair.contact)
    )
    values = eigh(soft, hard, eigvals_only=True)
    steady = 0
    for i, theta in enumerate(page.THETAS):
        says = data["scenes"][str(i)]["says"]
        slowest = max(abs(1 - theta * (1 + value)) for value in (values[0], values[-1]))
        assert ("at a level" in says) == (slowest > 1), theta
        if slowest < 1:
            steady += 1
            ratio = float(re.search(r"by (0\.\d+)\.", says)[1])
            assert ratio == pytest.approx(slowest, abs=5e-3)  # eight soft modes, 3.50 to 3.54, share the pace
    assert 0 < steady < len(page.THETAS)
    rho = eigh(*(normal_stiffness(body)[0] for body in (pair.contact, pair.neumann)), eigvals_only=True)[-1]
    assert values[-1] < rho
    assert f"Here it is {rho:.2f}." in data["why"]


def test_contact_opens_and_closes_where_a_log_stays_at_a_level(builder):
    page = builder.questions.of("other_code")
    iterates = list(islice(vf.iterate(vf.build(page.plates()), theta=page.ASKED), page.MOST))
    patterns = [tuple(iterate.contact.pattern.touching) for iterate in iterates[-20:]]
    assert len(set(patterns)) > 1
    assert all(a != b for a, b in pairwise(patterns))


@pytest.mark.parametrize(("rows", "heights"), [((6, 3), ("2", "1")), ((6, 6), ("1", "1")), ((3, 6), ("1", "2"))])
def test_rho_of_fine_meshes_is_that_of_their_cells_or_a_little_less(builder, rows, heights):
    page = builder.questions.of("constant_theta")
    lower, upper = rows  # of two bodies 0.3 high, cells 0.05 wide
    mesh = vf.example("section6").changed(young=(1, 1), friction=0, cells=((40, lower), (24, upper)), neumann_body=1)
    rho = vf.measure(mesh.refined(2)).rho_max.value
    at = ",".join(str([str(value) for value in page.HEIGHTS].index(height)) for height in heights)
    scene = page.data()["scenes"][at]
    shown = next(float(row[1]) for row in scene["rows"] if row[0] == heights[0])
    assert f"rho* = {shown:.3f}" in scene["says"]
    short = shown > 1.81
    assert ("as short as the cells" in scene["says"]) == short
    assert (0.999 if short else 0.9) * shown < rho < 1.0005 * shown


def test_the_curve_of_each_scene_stays_below_rho_of_its_cells(builder):
    page = builder.questions.of("constant_theta")
    for scene in page.data()["scenes"].values():
        curve, best = (np.array(mark["points"]) for mark in scene["marks"][0])
        shown = float(re.search(r"rho\* = ([\d.]+)", scene["says"])[1])
        assert curve[:, 1].max() <= shown * (1 + 1e-3)
        assert curve[:, 1].max() == pytest.approx(best[0, 1])
        assert page.RHO[0] < curve[:, 1].min()
        assert curve[0, 1] > 0.98 * page.long_waves()  # long waves, or saw teeth of tall cells
