"""The tables ``[[step]]`` of a problem file: read, refused, written; loads that are proportional."""

import pytest
from histories import pressed_and_sheared
from problem_list import bars, changed

import verification as vf
from verification.problem.steps import proportional

DOWN, ASIDE = {"top": [0, "-0.01"]}, {"top": ["0.004", "-0.01"]}


def read(*tables, **base):
    return vf.Problem.from_dict(changed(**base) | {"step": list(tables)})


def on(body=2, **loads):
    return {f"body{body}": loads}


def test_a_problem_with_steps_is_written_and_read_back_equal(tmp_path):
    data = pressed_and_sheared()
    data["step"][0] |= {"body1": {"body_force": ["1/3", 0], "traction": {"left": [1, 2]}}}
    problem = vf.Problem.from_dict(data)
    path = tmp_path / "my.toml"
    path.write_text(problem.to_toml())
    assert problem.to_toml().count("[[step]]") == 5
    assert vf.load(path) == problem == vf.Problem.from_dict(problem.to_dict())
    assert vf.load(path).digest == problem.digest != vf.Problem.from_dict(changed()).digest
    assert problem.steps[0].body1.body_force[0].denominator == 3


def test_a_step_has_a_name_and_one_increment_by_default():
    first, second = read({}, {"name": "shear", "increments": 3}).steps
    assert (first.name, first.increments, second.name, second.increments) == ("step 1", 1, "shear", 3)


REFUSED = {
    "no list": ({"step": 3}, "step", "needed tables, each as [[step]]"),
    "no table": ({"step": [3]}, "step", "needed tables"),
    "unknown key": ({"step": [{"incremets": 3}]}, "step[1].incremets", "did you mean 'increments'?"),
    "no increment": ({"step": [{"increments": 0}]}, "step[1].increments", "a whole number >= 1"),
    "too many": ({"step": [{"increments": 1500}, {"increments": 501}]}, "step[2].increments", "at most 2000"),
    "unknown side": ({"step": [on(prescribed={"tip": [0, 0]})]}, "step[1].body2.prescribed.tip", "unknown side"),
    "fixed side": ({"step": [on(1, prescribed={"bottom": [0, 0]})]}, "step[1].body1.prescribed.bottom", "fixed"),
    "support of a later step": (
        {"step": [{}, on(prescribed={"right": [0, 0]})]}, "step[2].body2.prescribed.right", "supports stay",
    ),
    "released": (
        {"step": [on(prescribed={"top": ["free", 0]})]}, "step[1].body2.prescribed.top", "supports stay",
    ),
    "lost force": ({"step": [on(traction={"top": [1, 0]})]}, "step[1].body2.traction.top", "a force there is lost"),
    "one number": ({"step": [on(body_force=3)]}, "step[1].body2.body_force", "two numbers"),
    "another material": ({"step": [on(young=3)]}, "step[1].body2.young", "unknown key"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_a_step_that_cannot_be_is_refused_by_its_key(name):
    tables, key, needed = REFUSED[name]
    with pytest.raises(vf.ProblemError) as refused:
        vf.Problem.from_dict(changed() | tables)
    assert refused.value.key == key
    assert needed in str(refused.value)
    assert "\n" not in str(refused.value)


def test_an_obstacle_has_no_loads():
    rigid = {"shape": "rigid", **dict.fromkeys(("cells", "young", "poisson", "fixed"))}
    with pytest.raises(vf.ProblemError, match=r"step\[1\]\.body1\.body_force: a rigid body has no loads"):
        read(on(1, body_force=[1, 0]), body1=rigid)


def test_the_first_step_may_prescribe_a_side_that_the_body_leaves_free():
    base = {"body2": {"prescribed": None}}
    found = vf.march(read(on(prescribed=DOWN), on(prescribed=ASIDE), **base))
    again = vf.march(read(on(prescribed=DOWN), on(prescribed=ASIDE)))
    assert found.increments[-1].contact.force == again.increments[-1].contact.force


def test_two_sides_that_contradict_each_other_at_the_end_of_a_step_are_refused_before_anything_runs():
    done = []
    data = read(on(prescribed=DOWN | {"right": [0, "free"]}), on(prescribed=ASIDE))
    with pytest.raises(vf.ProblemError, match=r"body2\.prescribed"):
        vf.march(data, watch=lambda *given: done.append(given))
    assert not done


PROPORTIONAL = {
    "no step": ([], True),
    "one step": ([on(prescribed=ASIDE)], True),
    "in parts": ([on(prescribed={"top": ["0.001", "-0.002"]}), on(prescribed={"top": ["0.002", "-0.004"]})], True),
    "kept": ([on(prescribed=DOWN), {}], True),
    "of 0": ([on(prescribed={"top": [0, 0]}), {}], True),
    "pressed and sheared": ([on(prescribed=DOWN), on(prescribed=ASIDE)], False),
    "lifted half way": ([on(prescribed=DOWN), on(prescribed={"top": [0, "-0.005"]})], False),
    "lifted": ([on(prescribed=DOWN), on(prescribed={"top": [0, 0]})], False),
    "drawn, then pressed": ([on(prescribed={"top": [0, "0.001"]}), on(prescribed=DOWN)], False),
}


@pytest.mark.parametrize("name", PROPORTIONAL)
def test_run_and_solve_warn_where_the_path_matters_and_only_there(name):
    tables, expected = PROPORTIONAL[name]
    problem = read(*tables)
    assert proportional(problem) is expected
    for found in (vf.run(problem), vf.solve(problem)):
        assert sum("`ndtheory march`" in warning for warning in found.warnings) == (not expected)
    smooth = problem.changed(friction=0)
    assert not any("march" in warning for warning in vf.run(smooth).warnings)
    if tables:
        assert not any("march" in warning for warning in vf.march(problem).warnings)


def test_loads_of_a_bar_are_single_numbers():
    problem = vf.Problem.from_dict(bars() | {"step": [on(prescribed={"right": "-0.1"}, body_force=2)]})
    assert vf.Problem.from_dict(problem.to_dict()) == problem
    assert problem.to_dict()["step"][0]["body2"] == {"prescribed": {"right": -0.1}, "body_force": 2}
