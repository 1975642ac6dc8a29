"""Values that are computed once in a session."""

import pytest
from shared import Shared


def test_a_value_is_computed_by_the_first_that_asks_and_kept_for_every_process(tmp_path):
    calls = []
    compute = lambda: calls.append(1) or {"a": 1}
    for process in (Shared(tmp_path), Shared(tmp_path)):
        assert process("key", compute) == process("key", compute) == {"a": 1}
    assert calls == [1]
    assert Shared(tmp_path)("another key", lambda: 2) == 2


def test_an_exception_is_not_kept(tmp_path):
    shared = Shared(tmp_path)
    with pytest.raises(ZeroDivisionError):
        shared("key", lambda: 1 / 0)
    assert shared("key", lambda: 3) == 3


def test_a_value_computed_from_itself_is_an_error_and_no_wait_without_end(tmp_path):
    shared = Shared(tmp_path)
    with pytest.raises(RuntimeError, match="from itself"):
        shared("key", lambda: shared("key", lambda: 1))


def test_a_value_changed_by_one_test_is_not_that_of_another(tmp_path):
    shared = Shared(tmp_path)
    shared("key", lambda: [1]).append(2)
    assert shared("key", list) == [1]
