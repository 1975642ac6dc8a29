"""The widgets show what the library computes, in a browser, by mouse and by keys."""

from __future__ import annotations

import random
import re
from math import log10
from pathlib import Path

import pytest
from browser import needs_browser
from widget_page import frame, move, rows, says

import verification as vf
from ndtheory import PRINTED, REPAIRED, evaluate, evaluate_energy
from verification.algorithm.fixed_point import FixedPointMap
from verification.exploration.javascript import function

DOCS = Path(__file__).parents[2] / "docs"

#: More than any widget may weigh, with what it shares.
LARGEST = 300_000


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
        assert f'<noscript><img src="./{name}.svg" alt="' in page.read_text(encoding="utf-8")


# The pictures.


@needs_browser
def test_a_prediction_comes_first_and_is_answered(browser, builder):
    for name in builder.widgets.WIDGETS:
        told = frame(browser, name).find_element("css selector", ".told")
        assert not told.is_displayed()
        answer = frame(browser, name).find_elements("css selector", ".ask button")[0]
        said = answer.text
        answer.click()
        assert told.text.startswith(f"You said: {said}.")
        assert not answer.is_displayed()


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
    inputs = frame(browser, "plane").find_elements("css selector", "input")
    at = {i.get_attribute("name"): 10 ** float(i.get_attribute("value")) for i in inputs}
    moduli = (at["ratio"] * E2 / at["unit"], E2 / at["unit"])
    problem = vf.example("section6").changed(young=tuple(map(str, moduli)), friction=str(at["k"]))
    measured = vf.measure(problem)
    in_energy_norms, repaired, printed, small = rows(browser, "plane")
    for row, edition in ((repaired, REPAIRED), (printed, PRINTED)):
        expected = evaluate(edition, measured.constants()).C2.value
        assert float(row[1]) == pytest.approx(expected, rel=1e-3)
    energy = evaluate_energy(measured.energy_constants(), str(at["theta"]))
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
    driver.get(page.as_uri() + "#cobweb.theta=high&plane.k=99&spectrum.swap=2&x")
    assert says(driver, "cobweb").startswith("theta = 1.00")
    assert "k = 7.94" in says(driver, "plane")


def test_the_scripts_call_formulas_of_the_library_alone(builder):
    scripts = "\n".join(path.read_text(encoding="utf-8") for path in (DOCS / "widgets").glob("*.js"))
    called = set(re.findall(r"\b(?:f|ndFormulas)\.(\w+)\(", scripts))
    assert called
    assert called == set(builder.widgets.FORMULAS)
