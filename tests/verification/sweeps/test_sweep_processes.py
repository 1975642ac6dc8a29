"""The processes of a sweep: no more than it needs, and none outlives the one that started it."""

import signal

import joblib
import joblib.executor
import pytest
from processes import running
from strategies import AT_NIGHT

import verification as vf
from verification.sweeps.workers import MOST_FOR_A_CORE, processes

SMALL = vf.example("section6").changed(cells=((10, 2), (8, 2)), radius="0.2", max_iterations=200)

#: A sweep in several processes, which says when they are asked for and when rows are done.
SWEEP = """
    import joblib.executor
    import verification as vf

    call = joblib.executor.get_memmapping_executor

    def asked(*args, **named):
        found = call(*args, **named)
        submit, found.submit = found.submit, lambda *given: (submit(*given), print("asked", flush=True))[0]
        return found

    joblib.executor.get_memmapping_executor = asked
    done = lambda what, share: share and print("rows", flush=True)
    vf.sweep(vf.example("section6"), theta=[f"{i}/4000" for i in range(1, 2000)], jobs=2, progress=done)
"""

#: Seconds within which processes must have ended; those that nobody ends wait five minutes for work.
SOON = 60


@pytest.mark.parametrize(
    ("jobs", "rows", "count"),
    [(40, 24, 24), (10_000, 10**6, 4 * 16), (3, 24, 3), (10_000, 1, 1), (-1, 24, 16), (-1, 5, 5), (64, 65, 64)],
)
def test_processes_are_no_more_than_the_jobs_the_rows_and_four_for_each_core(monkeypatch, jobs, rows, count):
    monkeypatch.setattr(joblib, "cpu_count", lambda: 16)
    monkeypatch.setattr(joblib, "effective_n_jobs", lambda n: n if n > 0 else 17 + n)
    assert MOST_FOR_A_CORE == 4
    assert processes(jobs, rows) == count


def test_ten_thousand_jobs_for_two_rows_start_two_processes_and_make_the_rows(monkeypatch, place):
    seen, call = [], joblib.executor.get_memmapping_executor
    monkeypatch.setattr(
        joblib.executor, "get_memmapping_executor", lambda n, **named: seen.append(n) or call(n, **named)
    )
    vf.sweep(SMALL, theta=["0.5"], store=place)
    more = {"theta": ["0.3", "0.5", "0.7"]}  # the store has one of the three
    assert vf.sweep(SMALL, **more, jobs=10_000, store=place).rows == vf.sweep(SMALL, **more).rows
    assert seen == [2]


@pytest.mark.parametrize(
    ("moment", "number"),
    [
        ("asked", signal.SIGKILL),
        ("rows", signal.SIGTERM),
        *[("asked", signal.SIGTERM), ("rows", signal.SIGKILL)] * AT_NIGHT,
    ],
)
def test_processes_end_with_the_one_that_started_them(moment, number):
    with running(SWEEP) as process:
        for line in process.stdout:
            if line == f"{moment}\n":
                break
        process.send_signal(number)
        process.communicate(timeout=SOON)  # until the last process has ended that could write there
        assert process.returncode == -number
