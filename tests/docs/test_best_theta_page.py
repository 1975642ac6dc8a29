"""The page on the best theta and friction: its widget is small and shows what the library computes."""

import json
from pathlib import Path

import pytest

import verification as vf
from verification.free_norm.norm import FreeNorm
from verification.semidefinite.multipliers import QuadraticForms

ROOT = Path(__file__).parents[2]
RECORD = json.loads((ROOT / "benchmarks" / "records" / "theta" / "curves.json").read_text("utf-8"))

#: More than the data of the widget may weigh.
LARGEST = 60_000


@pytest.fixture
def question(builder):
    return builder.questions.of("best_theta")


def test_the_data_of_the_widget_are_small(question):
    assert len(json.dumps(question.data(), separators=(",", ":"))) < LARGEST


def test_each_scene_has_the_curves_of_the_record_and_a_dot_where_each_is_least(question):
    thetas = RECORD["thetas"]
    for i, at in enumerate(RECORD["curves"]):
        over_theta, _ = question.data()["scenes"][str(i)]["marks"]
        curves = {mark["colour"]: mark["points"] for mark in over_theta if mark["kind"] == "line"}
        lowest = {mark["colour"]: mark["points"][0] for mark in over_theta if mark["kind"] == "dots"}
        for way, (_, colour) in question.WAYS.items():
            assert [theta for theta, _ in curves[colour]] == thetas
            assert [factor for _, factor in curves[colour]] == pytest.approx(at[way], rel=1e-5)
            if min(at[way]) < 1:
                assert lowest[colour] == min(curves[colour], key=lambda point: point[1])
            else:
                assert colour not in lowest
        assert [factor for _, factor in curves["grey"]] == pytest.approx(at["no_less"], rel=1e-5)


@pytest.mark.parametrize("position", [2, 6])
def test_the_table_of_a_scene_has_what_the_library_computes_on_the_smallest_mesh(question, position):
    data = question.data()
    k = data["sliders"][0]["values"][position]
    problem = vf.example("section6").changed(cells=((10, 2), (6, 2)), radius="0.2", friction=k)
    pair = vf.build(problem)
    energy, free, _, run = data["scenes"][str(position)]["rows"]
    measured = vf.measure(pair)
    assert float(energy[2]) == pytest.approx(QuadraticForms(pair, measured).factor(float(energy[1])).value, abs=6e-4)
    assert float(free[2]) == pytest.approx(FreeNorm(pair, measured).factor(float(free[1])).factor, rel=1e-2)
    assert float(run[2]) == pytest.approx(vf.run(problem, theta=run[1]).observed_rate.value, abs=6e-4)
    assert data["scenes"][str(position)]["says"].startswith(f"k = {k}: the best theta is in (5.21) {energy[1]}")


def test_a_friction_at_which_nothing_is_proved_says_so(question):
    assert question.best([0.1, 0.2], [1.1, None]) is None
    assert question.best([0.1, 0.2, 0.3], [0.9, 0.8, None]) == (0.2, 0.8)
    *_, last = question.data()["scenes"].values()
    assert last["says"].startswith("k = 1.6: the best theta is in (5.21) none, in a free norm 0.75")
    assert last["rows"][0] == ["in the norm (5.21)", "none", ""]
