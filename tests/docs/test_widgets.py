"""The widgets show what the library computes, in a browser, by mouse and by keys."""

from __future__ import annotations

import json
import random
import re
from math import log10
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree

import pytest
from browser import needs_browser
from widget_page import frame, move, rows, says

import verification as vf
from ndtheory import PRINTED, REPAIRED, evaluate, evaluate_energy
from ndtheory.energy_norms import predicted_factor
from verification.algorithm.fixed_point import FixedPointMap
from verification.exploration.javascript import function

DOCS = Path(__file__).parents[2] / "docs"

#: More than any widget may weigh, with what it shares.
LARGEST = 300_000


def test_the_colour_d55e00_is_orange_in_all_words(builder):
    """Its name in programs is red, between quotes or behind a dot; what is built of them has words of its own."""
    files = [*DOCS.glob("*.md"), *DOCS.glob("examples/*.md"), *DOCS.glob("widgets/*.js")]
    files += DOCS.glob("builder/questions/*.py")
    assert [file.name for file in files if re.search(r"(?<![\w.\"'])[Rr]ed(?![\w\"'])", file.read_text("utf-8"))] == []
    shown = json.dumps([widget.data() for widget in builder.widgets.WIDGETS.values()])
    assert re.findall(r"[^\"]*\b[Rr]ed\b[^\"]*", shown.replace('"red"', "")) == []


# The formulas.


def draw(generator, argument):
    """A random value of an argument of a formula."""
    if argument == "theta":
        return generator.uniform(0.001, 0.999)
    if argument in ("kappa1", "P"):
        return generator.choice([0.0, 10 ** generator.uniform(-3, 0.5)])
    if argument == "CR":
        return generator.uniform(1, 4)
    return 10 ** generator.uniform(-2, 2)


@needs_browser
def test_formulas_in_the_browser_equal_those_of_the_library(browser, builder):
    """200 random points each, 1e-12 relative; where terms cancel, of the largest of them."""
    generator = random.Random(2008)
    formulas = builder.widgets.FORMULAS
    points = {
        name: [[draw(generator, argument) for argument in arguments] for _ in range(200)]
        for name, (_, arguments) in formulas.items()
    }
    each = "([name, points]) => [name, points.map(point => ndFormulas[name](...point))]"
    script = f"return Object.fromEntries(Object.entries(arguments[0]).map({each}))"
    found = browser.execute_script(script, points)
    for name, (formula, _) in formulas.items():
        for at, seen in zip(points[name], found[name], strict=True):
            expected = formula(*at)
            pairs = zip(expected, seen, strict=True) if isinstance(expected, tuple) else [(expected, seen)]
            for ours, theirs in pairs:
                assert theirs == pytest.approx(ours, rel=1e-12, abs=1e-12), (name, at)


def test_a_formula_that_branches_on_a_scalar_is_refused(builder):
    with pytest.raises(TypeError, match="takes no `if`"):
        function("f", lambda x: 1 if x > 0 else 2, "x")
    with pytest.raises(NotImplementedError, match="power"):
        function("f", lambda x: x**0.3, "x")


def test_what_is_written_twice_is_computed_once(builder):
    text = function("f", lambda x: (x + 1) * (x + 1), "x")
    assert text.count("x + 1") == 1


# The data.


def test_the_cobweb_is_that_of_two_bars(builder):
    data = builder.widgets.BARS
    bars = vf.Problem.from_dict(
        {
            "dimension": 1,
            "body1": {"shape": "interval", "x": [0, 1], "cells": 1, "young": data["S1"], "fixed": ["left"]},
            "body2": {
                "shape": "interval",
                "x": [1, 2],
                "cells": 1,
                "young": data["S2"],
                "prescribed": {"right": -data["moved"]},
            },
            "iteration": {"neumann_body": 2},
        }
    )
    T = FixedPointMap(vf.build(bars), solver="active-set")
    for g in (0.0, 0.03, 0.075, 0.2, 0.31):
        _, solution = T([g])
        assert solution.force[0] == pytest.approx(max(0.0, data["S1"] * data["moved"] - data["S1"] / data["S2"] * g))


@pytest.mark.parametrize("ratio", ["0.05", "0.4", "3.5", "30"])
def test_the_constants_scale_with_the_moduli_as_the_widget_says(builder, ratio):
    base = builder.widgets.plane()
    E2 = base["E2"]
    E1 = float(ratio) * E2
    measured = vf.measure(vf.example("section6").changed(young=(str(E1), str(E2))))
    scaled = {
        "m": min(base["m1"] * E1, base["m2"] * E2),
        "M": base["M1"] * E1 + base["M2"] * E2,
        "C_R": base["CR"],
        "C_s": max(base["Cs1"] * E1, base["Cs2"] * E2),
        "C_tr": base["Ctr"],
        "rho_max": base["rho"] * E2 / E1,
        "C_s_energy": base["CsEnergy"] * E1**0.5,
        "C_t1": base["Ct1"] / E2**0.5,
        "C_t2": base["Ct2"] / E1**0.5,
    }
    for name, value in scaled.items():
        assert value == pytest.approx(getattr(measured, name).value, rel=1e-9), name


def test_runs_of_the_spectrum_are_runs_of_the_library(builder):
    problem, swapped = builder.widgets.section6_in_both_roles()
    data = builder.widgets.spectrum()
    assert [role["neumann"] for role in data["roles"]] == ["lower", "upper"]
    for role, of in zip(data["roles"], (problem, swapped), strict=True):
        measured = vf.measure(of)
        assert role["eigenvalues"][-1] == pytest.approx(measured.rho_max.value)
        assert role["eigenvalues"][0] == pytest.approx(measured.rho_min.value)
    run = vf.run(problem, theta="0.6")
    shown = data["roles"][0]["runs"][data["thetas"].index(0.6)]
    assert shown["residuals"][: run.iterations] == pytest.approx(list(run.history)[: run.iterations], rel=1e-3)


def test_each_widget_weighs_little_and_has_a_picture(page, builder):
    folder = page.parent
    shared = sum((folder / name).stat().st_size for name in ("formulas.js", "drawing.js", "widgets.css"))
    for name, widget in builder.widgets.WIDGETS.items():
        script = f"{widget.script or name}.js"
        own = sum((folder / file).stat().st_size for file in (script, f"{name}-data.js", f"{name}.svg"))
        assert own + shared < LARGEST
        assert f'<img class="still" loading="lazy" src="./{name}.svg" alt="' in page.read_text(encoding="utf-8")


# The pictures.


#: Widget -> the right answer, and what the picture says afterwards.
ANSWERS = {
    "cobweb": ("nowhere: it goes round for ever", "theta = 1.00: in contact each step multiplies the error by 3"),
    "plane": ("the printed one", "In this unit m = 3.08"),
    "spectrum": ("it does not converge", "upper body Neumann, rho = 11.3, theta = 0.60: the largest factor is 6.41"),
    "open_or_closed": ("2/(2+rho) = 0.500", "theta = 0.500: one step multiplies the error of the open node by 0.500"),
    "constants": ("m", "Size 100, mesh halved 0 times: m = 19.2 MPa, M = 21711 MPa, C_R = 3.20, which are"),
    "which_side": (
        "12 times as many, 140",
        "E1/E2 = 3.5. With the lower plate as Neumann body rho = 0.38, theta = 0.840",
    ),
    "constant_theta": (
        "it tends to 2.35 or more",
        "Cells 2 and 1 times as high as wide: rho* = 2.355, waves as short as the cells decide",
    ),
    "best_theta": ("near 0.80", "k = 0.8: the best theta is in (5.21) 0.10, with the factor 0.996, in a free"),
    "friction": ("A opens, B sticks", "k = 4: this load has 3 solutions: open, slip, stick"),
    "theorem_and_experiment": ("all of them", "lmi for theta below 0.38. Of 10 runs 4 are proved to converge"),
    "ruler": ("6.5e11", "theta = 3.4e-11, k = 1e-22: at most 6.1e11 steps are promised, no run was made"),
    "prediction": ("nearly all at one step", "k = 0.2: the matrix of step 4 predicts the rate 0.50078235"),
    "grids": ("59 percent", "Nearest node, 80 cells below and 60 above: the pressure varies by 58.6 percent"),
    "beyond_constant": ("39 percent of it", "the test stops it at step 4. There the residual is 71 percent"),
    "other_code": ("rho is 3 or more", "theta = 0.5: the residual stays at a level"),
}


def test_each_widget_with_a_right_answer_is_answered_below(builder):
    scripts = {path.stem: path.read_text("utf-8") for path in (DOCS / "widgets").glob("*.js")}
    asks = {name for name, text in scripts.items() if re.search(r"^ +right: ", text, re.MULTILINE)}
    found = builder.widgets.WIDGETS.items()
    assert {name for name, one in found if (one.script or name) in asks - {"map"}} == set(ANSWERS)
    assert "map" in asks  # test_map_widget answers it


@needs_browser
@pytest.mark.parametrize("name", ANSWERS)
@pytest.mark.parametrize("choice", [0, 1, 2, 3])
def test_the_outcome_is_hidden_until_a_choice_is_made_which_is_then_judged(unanswered, name, choice):
    """Three answers, and to be shown it without one."""
    right, shown = ANSWERS[name]
    widget = frame(unanswered, name)
    hidden = widget.find_elements("css selector", ".told, .controls, .says, details, .link")
    assert len(hidden) == 5
    assert not any(part.is_displayed() for part in hidden)
    answer = widget.find_elements("css selector", ".ask button")[choice]
    said = answer.text
    assert (said == "Just show me") == (choice == 3)
    answer.click()
    told = widget.find_element("css selector", ".told").text
    assert told.startswith("Answer: " if choice == 3 else "Right: " if said == right else "Not quite: ")
    assert all(part.is_displayed() for part in hidden)
    assert not answer.is_displayed()
    assert shown in says(unanswered, name)


@needs_browser
def test_the_cobweb_and_its_factors_are_drawn_after_the_answer(unanswered):
    charts = frame(unanswered, "cobweb").find_elements("css selector", "svg.chart")
    curves = "path.curve"
    before = len(charts[0].find_elements("css selector", curves))
    assert [chart.is_displayed() for chart in charts] == [True, False]
    frame(unanswered, "cobweb").find_element("css selector", ".reveal").click()
    assert [chart.is_displayed() for chart in charts] == [True, True]
    assert len(charts[0].find_elements("css selector", curves)) == before + 1


@needs_browser
def test_a_count_in_the_answer_of_the_spectrum_is_that_of_the_library(unanswered, builder):
    _, swapped = builder.widgets.section6_in_both_roles()
    eigenvalues = builder.widgets.spectrum()["roles"][1]["eigenvalues"]
    growing = [value for value in eigenvalues if predicted_factor(0.6, value) > 1]
    frame(unanswered, "spectrum").find_element("css selector", ".reveal").click()
    told = frame(unanswered, "spectrum").find_element("css selector", ".told").text
    assert f"{len(growing)} of {len(eigenvalues)} now exceed 2/theta - 1 = 2.33" in told
    assert not vf.run(swapped, theta="0.6").converged


@needs_browser
def test_after_an_answer_the_words_have_the_focus_and_on_paper_only_the_still_is_shown(unanswered):
    unanswered.find_element("css selector", "[data-widget=cobweb] .ask button").click()
    assert unanswered.switch_to.active_element.get_attribute("class") == "told"
    parts = "[...document.querySelector('[data-widget=cobweb]').children]"
    shown = f"return {parts}.filter((part) => part.getClientRects().length).map((part) => part.className)"
    assert "still" not in unanswered.execute_script(shown)
    unanswered.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    assert unanswered.execute_script(shown) == ["still"]
    unanswered.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})


@needs_browser
def test_the_picture_of_a_widget_is_saved_as_an_svg_that_needs_no_style_sheet(unanswered):
    unanswered.find_element("css selector", "[data-widget=grids] .ask .reveal").click()
    link = unanswered.find_element("css selector", "[data-widget=grids] .link a[download]")
    unanswered.execute_script("arguments[0].addEventListener('click', e => e.preventDefault())", link)
    unanswered.execute_script("arguments[0].click()", link)
    saved = ElementTree.fromstring(unquote(link.get_attribute("href").partition(",")[2]))
    charts = [part for part in saved if part.tag.endswith("svg")]
    assert (len(charts), link.get_attribute("download")) == (2, "grids.svg")
    lines = [part for part in saved.iter() if part.get("class") == "curve"]
    assert lines
    assert all("stroke-width: 2px" in line.get("style") for line in lines)
    axes = {"".join(text.itertext()) for text in saved.iter() if text.tag.endswith("text")}
    assert "position along Γc" in axes


@needs_browser
def test_theta_moves_by_mouse_and_by_keys(browser):
    from selenium.webdriver import ActionChains, Keys

    slider = frame(browser, "cobweb").find_element("css selector", "input[name=theta]")
    for _ in range(60):
        slider.send_keys(Keys.ARROW_LEFT)
    assert slider.get_attribute("value") == "0.4"
    assert "in contact each step multiplies the error by 0.6, apart by 0.6" in says(browser, "cobweb")
    v = frame(browser, "cobweb").find_elements("css selector", "svg.chart")[1]
    ActionChains(browser).move_to_element_with_offset(v, 0, 0).click_and_hold().move_by_offset(
        40, 0
    ).release().perform()
    assert float(slider.get_attribute("value")) != 0.4


@needs_browser
def test_the_unit_of_stress_moves_the_printed_region_alone(browser):
    def regions():
        areas = frame(browser, "plane").find_elements("css selector", "path[data-region]")
        return {area.get_attribute("data-region"): area.get_attribute("d") for area in areas}

    before, numbers = regions(), rows(browser, "plane")
    move(browser, "plane", "unit", 3)
    after = regions()
    assert set(before) == set(after) == {"in energy norms", "repaired", "printed"}
    assert {name for name in before if before[name] != after[name]} == {"printed"}
    assert rows(browser, "plane")[:2] == numbers[:2]


@needs_browser
@pytest.mark.parametrize(("ratio", "unit"), [("3.5", 0), ("3.5", 3), ("0.8", -1)])
def test_thresholds_and_factors_of_the_plane_are_those_of_the_library(browser, ratio, unit):
    E2 = 20000.0
    for slider, value in (("ratio", log10(float(ratio))), ("unit", unit), ("k", log10(0.1)), ("theta", log10(0.3))):
        move(browser, "plane", slider, value)
    moduli = (float(ratio) * E2 / 10**unit, E2 / 10**unit)
    problem = vf.example("section6").changed(young=tuple(map(str, moduli)), friction="0.1")
    measured = vf.measure(problem)
    in_energy_norms, repaired, printed, small = rows(browser, "plane")
    for row, edition in ((repaired, REPAIRED), (printed, PRINTED)):
        expected = evaluate(edition, measured.constants()).C2.value
        assert float(row[1]) == pytest.approx(expected, rel=1e-3)
    energy = evaluate_energy(measured.energy_constants(), "0.3")
    assert float(in_energy_norms[1]) == pytest.approx(measured.friction_limit.value, rel=1e-3)
    assert float(small[1]) == pytest.approx(measured.friction_threshold.value, rel=1e-3)
    assert in_energy_norms[3] == f"contraction by {energy.factor.value:.4f} a step"


@needs_browser
def test_swapping_the_roles_shows_the_other_run(browser, builder):
    data = builder.widgets.spectrum()
    assert "lower body Neumann" in says(browser, "spectrum")
    frame(browser, "spectrum").find_element("css selector", "button[name=swap]").click()
    move(browser, "spectrum", "step", 5)
    told = says(browser, "spectrum")
    residual = data["roles"][1]["runs"][data["thetas"].index(0.6)]["residuals"][5]
    assert "upper body Neumann" in told
    coefficient, exponent = f"{residual:.1e}".split("e")
    assert f"residual {coefficient}e{int(exponent):+d}" in told
    assert len(rows(browser, "spectrum")) == len(data["roles"][1]["runs"][11]["residuals"])


@needs_browser
def test_a_link_brings_the_state_back(driver, browser, page):
    move(browser, "cobweb", "theta", 0.37)
    link = frame(browser, "cobweb").find_element("css selector", ".link a").get_attribute("href")
    assert "cobweb.theta=0.37" in link
    driver.get("about:blank")
    driver.get(link)
    assert says(driver, "cobweb").startswith("theta = 0.37")


@needs_browser
def test_a_link_leads_to_its_widget(driver, browser, page):
    """In a low window, so that the last widget is below the first view."""
    link = frame(browser, "spectrum").find_element("css selector", ".link a").get_attribute("href")
    before = driver.get_window_size()
    driver.set_window_size(1000, 600)
    try:
        for address, shown in ((page.as_uri(), "cobweb"), (link, "spectrum")):
            driver.get("about:blank")
            driver.get(address)
            top = "return arguments[0].getBoundingClientRect().top"
            assert abs(driver.execute_script(top, frame(driver, shown))) < 100, shown
    finally:
        driver.set_window_size(before["width"], before["height"])


@needs_browser
def test_an_address_that_means_nothing_is_ignored(driver, browser, page):
    driver.get("about:blank")
    driver.get(page.as_uri() + "#cobweb.theta=high&plane.k%3D99&spectrum.swap=2&spectrum.theta=3.4&x%")
    assert says(driver, "cobweb").startswith("theta = 1.00")
    assert "k = 7.94" in says(driver, "plane")
    assert "theta = 0.20" in says(driver, "spectrum")


def test_the_scripts_call_formulas_of_the_library_alone(builder):
    scripts = "\n".join(path.read_text(encoding="utf-8") for path in (DOCS / "widgets").glob("*.js"))
    called = set(re.findall(r"\b(?:f|ndFormulas)\.(\w+)\(", scripts))
    assert called
    assert called == set(builder.widgets.FORMULAS)
