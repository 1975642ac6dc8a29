"""The page about one problem: its numbers are those of runs, in the data, in the browser and in the pictures."""

import base64
import json
import random
import re
import time
from contextlib import contextmanager
from fractions import Fraction

import numpy as np
import pytest
from browser import chromium, needs_browser
from histories import VARIANTS, pressed_and_sheared
from kinds import problem as plates
from problem_list import bars
from strategies import AT_NIGHT

import verification as vf
from ndtheory.energy_norms import one_minus_square, predicted_factor
from verification.contact import ContactError
from verification.exploration import page
from verification.exploration.film import STATES, film, packed, steps_shown
from verification.machine.progress import silent

#: A page of a problem with 25 contact nodes weighs at most so many bytes.
LARGEST = 1_500_000

#: Rounding of displacements to a byte and of lifts to two.
ROUNDED = 1 / 100

#: Rounding to the nearest 127th, and of its size to four digits.
NEAREST = 0.5 / 127 + 0.5e-3


@pytest.fixture(scope="module", autouse=True)
def few():
    """Each friction is twenty runs in each role, or a history: three of the five frictions are enough."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page, "SHARES", page.SHARES[::2])
        yield


@pytest.fixture(scope="module")
def found(few):
    return vf.explore(plates(10))


def data_of(found):
    return json.loads(re.search(r"explore: (\{.*\}) \};</script>", found.page())[1])


@pytest.fixture(scope="module")
def data(found):
    return data_of(found)


def places(found, count):
    """Random positions: role, friction, theta."""
    sizes = len(found.films), len(found.frictions), len(found.thetas)
    return [tuple(map(random.Random(i).randrange, sizes)) for i in range(count)]


def run_at(found, role, k, theta):
    pair = found.films[role].pair.at(friction=found.frictions[k])
    return vf.run(pair, theta=found.thetas[theta], rule="constant")


def test_the_grid_has_the_problems_own_theta_and_friction_and_the_predicted_thetas(found):
    assert found.thetas[found.own[0]] == Fraction(found.problem.iteration.theta)
    assert found.frictions[found.own[1]] == found.problem.contact.friction
    for role in vf.advise(found.problem).roles:
        assert min(abs(float(theta) / role.theta_predicted - 1) for theta in found.thetas) < 0.005
    first = [each for each in found.thetas if each not in page.THETAS] + [Fraction(found.problem.iteration.theta)]
    others = [each for each in found.thetas if each not in first]
    assert min(abs(each - one) for each in others for one in first) >= page.APART


def test_each_position_is_a_run(found, data):
    for role, k, theta in places(found, 8):
        made, shown = run_at(found, role, k, theta), data["roles"][role]["runs"][k][theta]
        assert (shown["outcome"], shown["steps"]) == (made.outcome, made.iterations)
        assert shown["residuals"] == pytest.approx(made.history, rel=5e-3)
        rate = made.observed_rate
        assert shown["rate"] == (None if rate is None else pytest.approx(rate.value, rel=1e-3))


def test_factors_are_those_of_a_comparison(found, data):
    for role, k, theta in places(found, 3):
        pair = found.films[role].pair.at(friction=found.frictions[k])
        compared = vf.compare(pair, theta=found.thetas[theta], bounds=("printed", "repaired", "energy"))
        shown = dict(
            zip([b["name"] for b in data["bounds"]], data["roles"][role]["runs"][k][theta]["factors"], strict=True)
        )
        for bound in compared.computed:
            proved = bound.proved and bound.factor is not None
            assert shown[bound.name] == (pytest.approx(bound.factor.value, rel=1e-5) if proved else None)


def test_the_line_of_the_bound_is_that_of_the_bound_at_each_friction(found, data):
    """The page multiplies kappa by the friction that is shown."""
    for role, each in zip(data["roles"], found.films, strict=True):
        for k in data["friction"]:
            if k:
                constants = each.measured.with_friction(k).energy_constants()
                expected = [float(constants.kappa_1), float(constants.kappa_2)]
                assert [k * kappa for kappa in role["kappa"]] == pytest.approx(expected)


def test_no_bound_is_drawn_outside_the_theorem():
    local = vf.explore(plates(10).changed(law="local", radius=None, friction="1/100"))
    for role, each in zip(data_of(local)["roles"], local.films, strict=True):
        assert each.measured.energy_constants() is not None
        assert role["kappa"] is None
        proved = [any(run.factors["energy"] is not None for run in line) for line in each.lines]
        assert proved == [k == 0 for k in local.frictions]


def numbers(text, kind):
    return np.frombuffer(base64.b64decode(text), dtype=kind).astype(float)


def test_the_pictures_of_a_step_are_those_of_the_run(found, data):
    for role, k, theta in places(found, 6):
        made, shown = run_at(found, role, k, theta), data["roles"][role]["runs"][k][theta]
        at = random.Random(role + k + theta).randrange(len(shown["shown"]))
        iterate, n = made.iterates[shown["shown"][at]], data["roles"][role]["contactNodes"]
        sizes = [2 * len(body["contact"]) for body in data["bodies"]]
        width, frame = sum(sizes) + 3 * n, shown["first"] + at
        row = numbers(data["roles"][role]["frames"], np.int8)[frame * width : (frame + 1) * width]
        length, stress = data["roles"][role]["scales"][frame]
        fields = made.contact_at(iterate)
        assert row[sum(sizes) : -n] * stress / 127 == pytest.approx(
            np.concatenate([fields.pressure, fields.shear]), abs=NEAREST * stress
        )
        assert [STATES[int(i)] for i in row[-n:]] == list(fields.status)
        begin = 0
        for body, side, trace in zip(
            data["bodies"], (made.pair.body1, made.pair.body2), made.traces_at(iterate), strict=True
        ):
            lift = numbers(body["lift"], "<i2").reshape(-1, len(trace)) * body["size"] / 32767
            drawn = np.array(body["still"]) + lift @ (row[begin : begin + len(trace)] * length / 127)
            assert row[begin : begin + len(trace)] * length / 127 == pytest.approx(trace, abs=NEAREST * length)
            exact = side.mesh_body.displacement(trace).ravel()
            assert drawn == pytest.approx(exact, abs=3 * ROUNDED * max(length, np.abs(exact).max()))
            begin += len(trace)


def test_later_steps_are_shown_more_rarely_and_the_last_one_always():
    history = list(np.geomspace(1, 1e-9, 400))
    shown = steps_shown(history)
    assert shown[:11] == list(range(11))
    assert shown[-1] == 399
    assert len(shown) <= 21
    assert list(np.diff(shown)[:-1]) == sorted(np.diff(shown)[:-1])


def test_a_step_that_leaves_the_picture_leaves_out_no_later_one():
    """A run that stalls goes to and fro: every second step is further than the others."""
    pair = vf.build(vf.example("section6").changed(cells=((10, 2), (6, 2)), radius="0.2", neumann_body=2))
    made = vf.run(pair, theta="0.9", rule="constant")
    sizes = [max(float(np.abs(u).max()) for u in made.traces_at(each)) for each in made.iterates]
    farthest = max(sizes) / 2
    found = film(pair, vf.measure(pair), [made.theta], [pair.friction], farthest, silent)
    (shown,) = found.lines[0]
    assert made.outcome == "stalled"
    assert shown.residuals == tuple(made.history)
    assert list(shown.steps) == [i for i in steps_shown(made.history) if sizes[i] <= farthest]
    assert shown.left_out == len(steps_shown(made.history)) - len(shown.steps) > 0
    assert len(shown.steps) == len(shown.frames) == len(shown.sizes) > 5
    (told,) = packed(found)["runs"][0]
    assert (told["leftOut"], len(told["residuals"])) == (shown.left_out, made.evaluations)


def test_a_contact_body_so_soft_that_the_predicted_theta_is_nearly_1_is_explored():
    found = vf.explore(vf.example("two-bars").changed(young=(7, 70000)))
    assert min(one.measured.rho_max.value for one in found.films) < 1e-3
    assert max(found.thetas) == Fraction(999, 1000)


def test_a_body_that_contact_alone_holds_keeps_its_role():
    loose = vf.example("section6").changed(cells=((5, 2), (3, 2)), radius="0.4").to_dict()
    loose["body2"] |= {"prescribed": {"top": ["free", "-0.01"]}}
    found = vf.explore(vf.Problem.from_dict(loose))
    assert len(found.films) == 1
    assert "can move rigidly" in found.why_one_role
    assert "The roles cannot be exchanged" in found.page()


def test_a_pair_of_matrices_is_refused():
    one = np.diag([2.0, 3.0])
    pair = vf.build(S1=one, S2=one, x=[0.0], load1=np.ones(2), load2=np.zeros(2))
    with pytest.raises(vf.ProblemError, match="needed the meshes"):
        vf.explore(pair)


def test_the_friction_terms_of_the_page_are_those_at_friction_1(found, data):
    for role, each in zip(data["roles"], found.films, strict=True):
        at_1 = each.measured.with_friction(1.0).energy_constants()
        assert role["kappa"] == pytest.approx([float(at_1.kappa_1), float(at_1.kappa_2)], rel=1e-12)


def test_texts_of_a_problem_do_not_end_the_script():
    ending = "</script><b>x</b>"
    bars = vf.example("two-bars").to_dict() | {"title": ending, "units": {"length": ending, "stress": "MPa"}}
    page = vf.explore(vf.Problem.from_dict(bars)).page()
    assert "</script><b>" not in page
    assert page.count("</script>") == 4


@pytest.mark.skipif(not AT_NIGHT, reason="eight seconds: by night")
def test_a_page_of_25_nodes_is_small():
    assert len(vf.explore(vf.example("section6")).page().encode()) < LARGEST


@contextmanager
def in_browser(found, folder):
    """The page of what was explored, opened in Chromium."""
    path = folder / "page.html"
    path.write_text(found.page(), "utf-8")
    with chromium("--window-size=1280,1400") as driver:
        driver.get(path.as_uri())
        yield driver


@pytest.fixture(scope="module")
def opened(found, tmp_path_factory):
    with in_browser(found, tmp_path_factory.mktemp("explore")) as driver:
        yield driver


MOVE = """
const set = (name, value) => { const input = document.querySelector(`input[name=${name}]`); input.value = value;
  input.dispatchEvent(new Event("input")); };
const button = document.querySelector("button[name=roles]");
if ((button.getAttribute("aria-pressed") === "true") !== (arguments[0] === 1)) button.click();
set("friction", arguments[1]); set("theta", arguments[2]);
return document.querySelector(".answer").textContent;
"""


@needs_browser
def test_the_page_says_what_a_run_does(found, opened):
    for role, k, theta in places(found, 20):
        made, text = run_at(found, role, k, theta), opened.execute_script(MOVE, role, k, theta)
        assert f"theta = {float(f'{float(made.theta):.4g}'):g}, k = {float(found.frictions[k]):g}" in text
        assert f"Neumann body {made.pair.neumann_body} " in text
        assert int(re.search(r"after (\d+) steps", text)[1]) == made.iterations
        assert ("converged after" in text) == made.converged
        assert "steps are needed" not in text  # bounds are of the error, and a run ends by its residual
        assert ("of the first error is left after" in text) == ("For any loads" in text)
    assert opened.get_log("browser") == []


@needs_browser
def test_formulas_of_the_page_are_those_of_the_library(opened):
    for theta, rho, one, two in np.random.default_rng(0).uniform(0.05, 0.95, (20, 4)):
        seen = opened.execute_script(
            "return [ndFormulas.predictedFactor(...arguments[0]), ndFormulas.energyOneMinusSquare(...arguments[1])]",
            [theta, rho],
            [theta, rho, one, two],
        )
        assert seen == pytest.approx([predicted_factor(theta, rho), one_minus_square(theta, rho, one, two)], rel=1e-12)


@needs_browser
def test_the_page_fits_a_phone_and_obeys_the_keyboard(opened):
    from selenium.webdriver.common.keys import Keys

    small = {"width": 390, "height": 1600, "deviceScaleFactor": 1, "mobile": True}
    opened.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", small)
    assert opened.execute_script("return document.documentElement.scrollWidth") <= 390
    size = "(s) => 11 * s.clientWidth / s.viewBox.baseVal.width"
    sizes = f"return Math.min(...[...document.querySelectorAll('svg.chart')].map({size}))"
    assert opened.execute_script(sizes) >= 9
    slider = opened.find_element("css selector", "input[name=theta]")
    before = slider.get_attribute("value")
    slider.send_keys(Keys.ARROW_LEFT)
    assert int(slider.get_attribute("value")) == int(before) - 1
    opened.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


@needs_browser
def test_a_film_plays_to_its_end(opened):
    opened.execute_script(MOVE, 0, 1, 12)
    opened.execute_script("[...document.querySelectorAll('button')].find((b) => b.textContent === 'play').click()")
    end = time.monotonic() + 30
    position = "const s = document.querySelector('input[name=step]'); return [Number(s.value), Number(s.max)]"
    assert opened.execute_script(position)[0] <= 1
    while time.monotonic() < end and len({*opened.execute_script(position)}) == 2:
        time.sleep(0.1)
    assert len({*opened.execute_script(position)}) == 1


# --- loading histories ------------------------------------------------------------------------------------------------


def with_history(**tables):
    return vf.Problem.from_dict(pressed_and_sheared(**tables))


@pytest.fixture(scope="module")
def followed(few):
    return vf.explore(with_history(**VARIANTS["grids that differ"]))


def moved(body, row, length, time):
    """The displacement of a drawn body, as the page has it: loads between the ends of steps are mixed in proportion."""
    stills = np.array([body["still"], *body["later"]])
    before, part = int(time), time - int(time)
    still = stills[before] if not part else (1 - part) * stills[before] + part * stills[before + 1]
    lift = numbers(body["lift"], "<i2").reshape(-1, len(row)) * body["size"] / 32767
    return still + lift @ (row * length / 127)


def test_a_page_of_a_history_has_the_increments_of_a_march_at_each_friction(followed):
    data = data_of(followed)
    role, past = data["roles"][0], data["past"]
    sizes = [2 * len(body["contact"]) for body in data["bodies"]]
    width = sum(sizes) + 3 * role["contactNodes"]
    frames = numbers(role["frames"], np.int8).reshape(-1, width)
    assert followed.frictions[followed.own[1]] == followed.problem.contact.friction
    for k, friction in enumerate(followed.frictions):
        path = vf.march(followed.problem.changed(friction=friction))
        shown, told = role["runs"][k][0], past["told"][k]
        assert (shown["outcome"], shown["shown"]) == ("converged", list(range(1, 31)))
        assert shown["steps"] == sum(each.iterations for each in path.increments)
        assert told["dissipated"][-1] == pytest.approx(path.content()["dissipated"], rel=1e-9)
        for name in ("pressure", "shear", "bound", "slip"):
            assert np.array(told[name]) == pytest.approx(path.fields[name], rel=1e-4, abs=1e-12)
        for i in random.Random(k).sample(range(30), 4):
            each, frame = path.increments[i], shown["first"] + i
            length, stress = role["scales"][frame]
            assert [STATES[int(n)] for n in frames[frame, -role["contactNodes"] :]] == list(each.contact.status)
            stresses = np.concatenate([each.contact.pressure, each.contact.shear])
            assert frames[frame, sum(sizes) : -role["contactNodes"]] * stress / 127 == pytest.approx(
                stresses, abs=ROUNDED * stress
            )
            rows = np.split(frames[frame, : sum(sizes)], sizes[:1])
            for body, row, exact in zip(data["bodies"], rows, each.result.displacements, strict=True):
                most = max(length, np.abs(exact).max())
                assert moved(body, row, length, each.time) == pytest.approx(exact.ravel(), abs=3 * ROUNDED * most)


def test_a_history_that_ends_early_says_why_and_one_without_a_first_increment_is_left_out(monkeypatch):
    short = vf.explore(with_history(iteration={"max_iterations": 12}))
    assert len(short.histories[short.own[1]].increments) < 30
    assert "ended otherwise: limit" in short.to_dict()["roles"][0]["runs"][short.own[1]]["outcome"]
    march = page.march

    def picky(pair):
        if pair.friction > Fraction(1, 5):
            raise ContactError("no solution")
        return march(pair)

    monkeypatch.setattr(page, "march", picky)
    assert vf.explore(with_history()).frictions == (0, Fraction(1, 5))
    with pytest.raises(ContactError):
        vf.explore(with_history(contact={"friction": "0.3"}))


def test_a_history_of_bars_and_of_a_pair_at_its_own_friction_is_shown():
    steps = [{"increments": 3, "body2": {"prescribed": {"right": "-0.1"}}}]
    found = vf.explore(vf.Problem.from_dict(bars() | {"step": steps}))
    assert data_of(found)["past"]["axis"] == 1
    pair = vf.build(with_history()).at(friction="0.1")
    assert vf.explore(pair).histories[1].increments[0].run.pair.friction == Fraction(1, 10)


@pytest.fixture(scope="module")
def opened_history(followed, tmp_path_factory):
    with in_browser(followed, tmp_path_factory.mktemp("explore")) as driver:
        yield driver


GO = """
const set = (name, value) => { const input = document.querySelector(`input[name=${name}]`); input.value = value;
  input.dispatchEvent(new Event("input")); };
set("friction", arguments[0]); set("increment", arguments[1]);
const states = document.querySelectorAll("svg.bodies .stick, svg.bodies .slip, svg.bodies .open");
const marks = [...states].map((mark) => {
  const { x, y, width, height } = mark.getBBox();
  return [mark.getAttribute("class"), x + width / 2, y + height / 2]; });
return { text: document.querySelector(".answer").textContent, most: document.querySelector("input[name=increment]").max,
  rows: [...document.querySelectorAll("tbody tr")].map((row) => [...row.children].map((cell) => cell.textContent)),
  legend: document.querySelector(".legend").textContent, marks };
"""


@needs_browser
def test_a_slider_moves_through_the_increments_of_a_march(followed, opened_history):
    farthest = 0.0
    for k, i in [(0, 0), (1, 8), (1, 18), (2, 26), (1, 29)]:
        history = vf.march(followed.problem.changed(friction=followed.frictions[k]))
        each, seen = history.increments[i], opened_history.execute_script(GO, k, i)
        contact = each.contact
        assert seen["most"] == "29"
        assert f"increment {i + 1} of 30, time {each.time:.4g} ({each.name})" in seen["text"]
        assert int(re.search(r"took (\d+) steps", seen["text"])[1]) == each.iterations
        force = re.search(r"normal (\S+), tangential (\S+) MPa mm", seen["text"])
        assert [float(value) for value in force.groups()] == pytest.approx(
            list(contact.force.values()), rel=1e-3, abs=1e-6
        )
        assert [row[-1] for row in seen["rows"]] == list(contact.status)
        read = np.array([[float(value) for value in row[:-1]] for row in seen["rows"]]).T
        columns = contact.x, contact.pressure, contact.shear, contact.bound, contact.slip
        for shown, exact in zip(read, columns, strict=True):
            assert shown == pytest.approx(exact, rel=1e-3, abs=1e-12)
        # the marks sit at the contact nodes of the upper body; 12 % of the wider body are left free around both
        names, *seen_at = zip(*seen["marks"], strict=True)
        assert list(names) == list(contact.status)
        enlarged = float(re.search(r"Displacements times (\S+)\.", seen["legend"])[1])
        u = enlarged * each.result.displacements[1][each.result.pair.body2.mesh_body.nodes]
        free, unit = 0.12 * 2, 1000 / (1.24 * 2)
        at = (contact.x + u[:, 0] + free) * unit, (0.3 + free - u[:, 1]) * unit
        farthest = max(farthest, np.abs(u * unit).max())
        assert np.array(seen_at) == pytest.approx(np.array(at), abs=1.5)
    assert farthest > 15
    assert opened_history.get_log("browser") == []
