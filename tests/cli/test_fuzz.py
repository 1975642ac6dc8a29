"""A few mutated inputs of each kind; nightly some hundred, `python tests/fuzz.py` any number."""

import fuzz
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import fewer


@pytest.mark.parametrize("kind", fuzz.KINDS)
@fewer(4)
@given(seed=st.integers(0, 2**32))
def test_a_mutated_input_is_refused_in_one_line_or_answered_by_a_document_that_obeys_its_laws(
    kind, seed, tmp_path_factory
):
    assert fuzz.attempt(kind, seed, tmp_path_factory.getbasetemp()) is None


@pytest.mark.parametrize(
    ("status", "out", "err", "broken"),
    [
        (70, "", "Traceback (most recent call last)", "status 70"),
        (0, "{}", "x.py:3: RuntimeWarning: overflow", "a warning of a library"),
        (2, "", "one\ntwo\n", "not one short line"),
        (2, "", "x" * 2000 + "\n", "not one short line"),
        (2, "{}", "one\n", "on stdout"),
        (2, "", "ndtheory: young = -1\n", "does not name the file"),
        (0, '{"schema": "ndtheory.run/1", "x": NaN}', "", "not finite"),
        (0, '{"schema": "ndtheory.run/1", "kkt_residual": 1}', "", "kkt_residual"),
        (0, "{", "", "no valid document"),
        (1, "", "ndtheory: problem.toml: no certified solution\n", "no valid document"),
        (1, '{"schema": "ndtheory.failure/1"}', "ndtheory: problem.toml: no certified solution\n", None),
        (2, "", "ndtheory: problem.toml: body1.young = -1: needed a number > 0\n", None),
    ],
)
def test_the_judge_sees_what_breaks_a_rule(monkeypatch, status, out, err, broken):
    def answer(arguments):
        print(out, end="")
        print(err, end="", file=fuzz.sys.stderr)
        return status

    monkeypatch.setattr(fuzz, "main", answer)
    found = fuzz.judge(["run", "problem.toml", "--json"])
    assert found is None if broken is None else broken in found


def test_the_judge_sees_an_answer_that_comes_late(monkeypatch):
    monkeypatch.setattr(fuzz, "LIMIT", 0.1)
    monkeypatch.setattr(fuzz, "main", lambda arguments: sum(1 for _ in iter(int, 1)))
    assert fuzz.judge(["run", "problem.toml", "--json"]) == "no answer in 0.1 s"
