"""Widgets made of scenes: what they show before and after the answer, whether it can be read, and whether it is so."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from browser import needs_browser
from widget_page import drawn, frame, place, rows, says

import verification as vf
from ndtheory.energy_norms import predicted_factor

DOCS = Path(__file__).parents[2] / "docs"

#: The pages whose widget is made of scenes.
SCENES = sorted(path.stem for path in (DOCS / "builder" / "questions").glob("[!_]*.py"))


def test_all_questions_are_listed(builder):
    assert sorted(builder.questions.PAGES) == SCENES


def test_a_page_asks_its_question_before_its_first_section():
    for name in SCENES:
        introduction = (DOCS / "examples" / f"{name}.md").read_text("utf-8").partition("\n## ")[0]
        assert f"```{{widget}} {name}\n" in introduction


def test_the_right_answer_is_found_neither_by_its_length_nor_by_its_place(builder):
    questions = [builder.questions.of(name).data() for name in SCENES]
    for asked in questions:
        assert len(set(asked["answers"])) == 3
        assert len(asked["right"]) <= max(len(answer) for answer in asked["answers"] if answer != asked["right"])
    assert len({asked["answers"].index(asked["right"]) for asked in questions}) > 1 or len(questions) == 1


def of_marks(marks):
    """The tags of the marks of a chart, from its data."""
    tags = {"line": ["path"], "note": ["text"]}
    return [tag for mark in marks for tag in tags.get(mark["kind"], ["circle"] * len(mark["points"]))]


@needs_browser
@pytest.mark.parametrize("name", SCENES)
def test_before_the_answer_a_chart_has_its_fixed_marks_alone(unanswered, builder, name):
    data = builder.questions.of(name).data()
    charts = frame(unanswered, name).find_elements("css selector", "svg.chart")
    fixed = [chart["fixed"] for chart in data["charts"]]
    assert [chart.is_displayed() for chart in charts] == [bool(marks) for marks in fixed]
    assert [drawn(chart) for chart in charts] == [of_marks(marks) for marks in fixed]
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
