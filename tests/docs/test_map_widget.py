"""The map of the proof in a page: boxes open, edges follow the sliders as far as formulas reach."""

import random
from itertools import pairwise
from pathlib import Path

import pytest
from browser import needs_browser
from widget_page import frame, move, rows, says

import verification as vf
from ndtheory import bounds as editions
from ndtheory.statements import statements
from verification.figures.proof_map import PRINTED, STEPS
from verification.semidefinite.losses import locate

MAPS = ("map", "chain")
NEAR = 1e-9


def decades(browser, name="chain"):
    """Edge -> its decades, None where they are not known; the printed edge under 'printed'."""
    script = (
        "return [...document.querySelectorAll(`[data-widget=${arguments[0]}] [data-decades]`)]"
        ".map(e => [e.classList.contains('printed') ? 'printed' : e.dataset.edge, e.dataset.decades,"
        " Number(e.getAttribute('stroke-width')), e.classList.contains('unknown')])"
    )
    found = browser.execute_script(script, name)
    assert all(unknown == (value == "") for edge, value, _, unknown in found if edge != "printed")
    return {edge: float(value) if value else None for edge, value, *_ in found}, {edge: w for edge, _, w, _ in found}


def values(browser, name="chain"):
    """The values of the sliders, as powers of ten."""
    return {i.get_attribute("name"): 10 ** float(i.get_attribute("value")) for i in
            frame(browser, name).find_elements("css selector", "input")}  # fmt: skip


def of_the_library(at):
    """The losses of Section 6 with these moduli, this friction and unit of stress."""
    moduli = (at["ratio"] * 20000 / at["unit"], 20000 / at["unit"])
    problem = vf.example("section6").changed(young=tuple(map(repr, moduli)), friction=repr(at["k"]))
    return locate(vf.build(problem), vf.measure(problem))


def test_a_broken_proof_has_the_thresholds_of_both_editions_and_a_friction_term_of_1_where_it_ends(builder):
    """Sets of steps without their losses: from the printed edition to the repaired one, and on by the losses alone."""
    found, (losses, _) = builder.widgets.broken(), builder.widgets.searched()
    measured = vf.measure(vf.example("section6"))
    *links, unit = (loss.label for loss in losses.friction)
    for labels, edition in (("", editions.PRINTED), (unit, editions.REPAIRED)):
        assert found[labels] == pytest.approx(editions.evaluate(edition, measured.constants()).C4.value, rel=1e-9)
    m, M, C_R = (getattr(measured, name).value for name in ("m", "M", "C_R"))
    for labels in ([unit], [*links, unit], [links[0], links[3], unit]):
        lost = sum(loss.decades for loss in losses.friction if loss.label in labels and not loss.only_unit)
        x = found[" ".join(labels)] * measured.C_s.value * measured.C_tr.value
        assert editions.P(x, m, M, C_R, m) / 10**lost == pytest.approx(1, rel=1e-9)
    assert len(found) == 2 ** len(losses.friction)
    assert min(found, key=found.get) == ""
    assert max(found, key=found.get) == " ".join([*links, unit])
    most, energy = found[" ".join([*links, unit])], measured.friction_threshold.value
    assert most < energy
    page = (Path(__file__).parents[2] / "docs" / "theory.md").read_text("utf-8")
    assert f"it is {most:.3f}, somewhat less than the {energy:.3f} that" in page


@needs_browser
def test_a_button_takes_the_loss_of_a_step_away_and_says_the_threshold(browser, builder):
    found, (losses, _) = builder.widgets.broken(), builder.widgets.searched()
    label = losses.friction[0].label
    frame(browser, "chain").find_element("css selector", "[name=without0]").click()
    words = frame(browser, "chain").find_element("css selector", ".broke").text
    assert f"without the loss of {label} it would be k < " in words
    threshold = float(words.partition("it would be k < ")[2].split(" ")[0].rstrip("."))
    assert threshold == pytest.approx(found[label], rel=1e-3)
    edge = next(" ".join(edge) for edge, (_, labels) in STEPS.items() if labels == (label,))
    assert decades(browser)[0][edge] == 0


def expected(losses, step):
    chain, labels = STEPS[step]
    return [loss for loss in getattr(losses, chain) if loss.label in labels]


@needs_browser
@pytest.mark.parametrize("seed", range(4))
def test_decades_follow_the_sliders_as_those_of_the_library_do(browser, seed):
    """At random moduli, friction and unit; an edge whose pair is searched has no decades there."""
    generator = random.Random(seed)
    for slider, low, high in (("ratio", -1.4, 2.5), ("k", -4, 0.2), ("unit", -3, 6)):
        move(browser, "chain", slider, generator.uniform(low, high))
    losses, (found, widths) = of_the_library(values(browser)), decades(browser)
    unit = sum(loss.decades for loss in losses.friction if loss.only_unit)
    assert found.pop("printed") == pytest.approx(unit, rel=NEAR, abs=NEAR)
    assert set(found) == {" ".join(step) for step in STEPS}
    for step in STEPS:
        lost, seen = expected(losses, step), found[" ".join(step)]
        if any(loss.searched for loss in lost):
            assert seen is None
            assert widths[" ".join(step)] == pytest.approx(1.2)
        else:
            assert seen == pytest.approx(sum(loss.decades for loss in lost), rel=NEAR, abs=NEAR)
            assert widths[" ".join(step)] == pytest.approx(1.2 + seen, abs=0.051)
    assert sum(value is not None for value in found.values()) == 5
    assert "their loss is not known here" in says(browser, "chain")


@needs_browser
@pytest.mark.parametrize("unit", [-2, 0, 5])
def test_at_the_values_of_the_problem_every_loss_is_known_in_every_unit(browser, unit):
    move(browser, "chain", "unit", unit)
    losses, (found, _) = of_the_library(values(browser)), decades(browser)
    for step in STEPS:
        assert found[" ".join(step)] == pytest.approx(sum(loss.decades for loss in expected(losses, step)), abs=1e-4)
    assert "All widths belong to these values" in says(browser, "chain")
    assert ("As m < 1" in says(browser, "chain")) == (unit == 5)


@needs_browser
def test_the_unit_of_stress_changes_the_printed_edge_alone(browser):
    before, thick = decades(browser)
    move(browser, "chain", "unit", 2)
    after, thin = decades(browser)
    assert {edge for edge in before if before[edge] != pytest.approx(after[edge], abs=1e-9)} == {"printed"}
    assert before["printed"] > after["printed"] > 0
    assert thick["printed"] > thin["printed"] > thin[" ".join(PRINTED)]


@needs_browser
def test_the_table_and_the_button_show_the_losses_of_the_problem(browser):
    losses = of_the_library(values(browser))
    move(browser, "chain", "ratio", 2)
    searched = [row[1:] == [row[1], "not known here", "search: may be less"] for row in rows(browser, "chain")]
    assert searched == [loss.searched for loss in (*losses.links, *losses.friction, *losses.lipschitz)]
    frame(browser, "chain").find_element("css selector", "button[name=own]").click()
    shown = [(label, value) for _, label, value, _ in rows(browser, "chain")]
    everything = (*losses.links, *losses.friction, *losses.lipschitz)
    assert shown == [(loss.label, f"{loss.decades:.2f}") for loss in everything]


@needs_browser
@pytest.mark.parametrize("name", MAPS)
def test_each_answer_is_judged_with_the_numbers_of_the_problem(unanswered, name):
    """The edges are thin until somebody answers; each inequality of the friction term can be chosen."""
    losses = of_the_library(values(unanswered, name))
    (unit,) = (loss for loss in losses.friction if loss.only_unit)
    inequalities = [loss for loss in losses.friction if not loss.only_unit]
    most = max(inequalities, key=lambda loss: loss.decades)
    assert set(decades(unanswered, name)[1].values()) == {1.2}
    options = [button.text for button in frame(unanswered, name).find_elements("css selector", ".ask button")][:-1]
    assert [option.partition(",")[0] for option in options[:-1]] == [loss.label for loss in inequalities]
    assert unit.decades > most.decades
    said = []
    for at, _ in enumerate(options):
        unanswered.refresh()
        frame(unanswered, name).find_elements("css selector", ".ask button")[at].click()
        said.append(frame(unanswered, name).find_element("css selector", ".told").text)
    for loss, told in zip(inequalities, said, strict=False):
        begins = "Not quite: no inequality" if loss is most else f"Not quite: it adds {loss.decades:.1f}"
        assert told.startswith(begins)
    assert said[-1].startswith("Right: in MPa")
    for told in said:
        assert f"the unit of stress adds {unit.decades:.1f}" in told
        assert f"{most.label} loses most: {most.decades:.1f}" in told
    assert max(decades(unanswered, name)[1].values()) > 1.2


@needs_browser
@pytest.mark.parametrize("name", MAPS)
def test_a_box_opens_its_statement_by_keys(browser, name):
    from selenium.webdriver import ActionChains, Keys

    boxes = frame(browser, name).find_elements("css selector", "svg .node")
    browser.execute_script("arguments[0].focus()", boxes[0])
    for before, after in pairwise(boxes[:6]):
        assert browser.switch_to.active_element == before
        ActionChains(browser).send_keys(Keys.TAB).perform()
        assert browser.switch_to.active_element == after
    (box,) = [box for box in boxes if box.get_attribute("data-id") == "5.30"]
    browser.execute_script("arguments[0].focus()", box)
    ActionChains(browser).send_keys(Keys.ENTER).perform()
    panel, one = frame(browser, name).find_element("css selector", ".panel"), statements()["5.30"]
    assert browser.switch_to.active_element == panel
    text = panel.get_attribute("textContent").replace("\\(", "$").replace("\\)", "$")
    for words in (one.title, one.verdict, one.claims, one.wrong, one.repair, one.proof):
        assert words in text
    ActionChains(browser).send_keys(Keys.ESCAPE).perform()
    assert browser.switch_to.active_element == box
    assert one.verdict in box.get_attribute("aria-label")


@needs_browser
def test_a_box_opens_by_a_click_and_leads_to_its_grounds_and_pages(browser, builder):
    browser.execute_script(
        "document.querySelector('[data-widget=map] [data-id=\"5.11\"]').dispatchEvent(new MouseEvent('click'))"
    )
    panel = frame(browser, "map").find_element("css selector", ".panel")
    links = [link.get_attribute("href") for link in panel.find_elements("css selector", "a")]
    entry = builder.equations.anchor(statements()["5.11"])
    assert links[0].endswith(f"generated/equations.html#{entry}")
    assert links[1].endswith("generated/ledger.html")
    assert f"({entry})=\n## (5.11)" in builder.equations.page()
    (ground,) = panel.find_elements("css selector", "button")
    assert ground.text == "(5.14)"
    ground.click()
    assert panel.text.startswith("(5.14): ")


def test_links_start_from_the_root_of_the_site(builder):
    for static, root in (("_static", ""), ("../_static", "../")):
        assert f'data-site="{root}"' in builder.widgets.element("map", static)


def test_places_in_the_index_of_equations_differ(builder):
    assert len({builder.equations.anchor(one) for one in statements().values()}) == len(statements())


@needs_browser
@pytest.mark.parametrize("name", MAPS)
def test_every_text_lies_in_its_box_and_over_no_other(browser, name):
    script = (
        "const box = e => { const r = e.getBBox(); return [r.x, r.y, r.x + r.width, r.y + r.height]; };"
        "return [...document.querySelectorAll(`[data-widget=${arguments[0]}] svg .node`)].map(n =>"
        " [n.dataset.id, box(n.querySelector('path')), [...n.querySelectorAll('text')].map(t =>"
        " [box(t), parseFloat(getComputedStyle(t).fontSize)])])"
    )
    found = browser.execute_script(script, name)
    assert len(found) > 15
    for id, (left, top, right, bottom), texts in found:
        for (x, y, to, end), size in texts:
            assert size >= 9
            assert (left + 2 <= x, to <= right - 2, top <= y + 2, end <= bottom + 2) == (True,) * 4, id
        for (one, _), (other, _) in pairwise(texts):
            assert one[3] <= other[1] + 3, id  # lines of a font keep room for accents


@needs_browser
def test_the_boxes_of_the_question_are_in_view_and_after_the_answer_the_edge_behind_5_30(unanswered):
    seen = """const frame = document.querySelector(`[data-widget=${arguments[0]}] .map-frame`);
        const view = frame.getBoundingClientRect();
        return arguments[1].every(id => { const box = frame.querySelector(`[data-id="${id}"]`).getBoundingClientRect();
          return view.left <= box.left && box.right <= view.right && view.top <= box.top
            && box.bottom <= view.bottom })"""
    ids = [one for one, to in STEPS if to == "5.30"] + ["5.30"]
    assert len(ids) == 5
    for name in MAPS:
        widget = frame(unanswered, name)
        size = "flex:none;width:720px;max-height:none;height:460px"
        script = "arguments[0].querySelector('.map-frame').style.cssText = arguments[1]"
        unanswered.execute_script(script, widget, size)
        unanswered.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
        assert unanswered.execute_script(seen, name, ids), name
        widget.find_elements("css selector", ".ask button")[-1].click()
        assert unanswered.execute_script(seen, name, ["5.30", "5.31"]), name


@needs_browser
@pytest.mark.parametrize("dark", [False, True])
def test_on_a_phone_the_map_scrolls_in_its_frame_and_words_stand_out(browser, dark):
    paper, ink = ("#131416", "#cfd0d0") if dark else ("#ffffff", "#000000")
    metrics = {"width": 390, "height": 800, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    try:
        browser.execute_script(
            "document.body.style.cssText = `background:${arguments[0]};color:${arguments[1]};"
            "--color-foreground-primary:${arguments[1]}`",
            paper,
            ink,
        )
        for name in MAPS:
            window = frame(browser, name).find_element("css selector", ".map-frame")
            wide, seen = browser.execute_script("return [arguments[0].scrollWidth, arguments[0].clientWidth]", window)
            assert seen < 390 < wide
            right = browser.execute_script("return arguments[0].getBoundingClientRect().right", window)
            assert right <= browser.execute_script("return document.documentElement.clientWidth")
            legend = window.find_element("css selector", "text.legend")
            colour = browser.execute_script("return getComputedStyle(arguments[0]).fill", legend)
            assert colour == ("rgb(207, 208, 208)" if dark else "rgb(0, 0, 0)")
            assert not window.find_element("css selector", ".paper").is_displayed()
            assert not any(text.is_displayed() for text in window.find_elements("css selector", "text.lost"))
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
