"""A sweep on a real dask scheduler with two real workers, and what is left when one or the other is killed."""

import json
import subprocess
import sys
import time
from contextlib import ExitStack, contextmanager, suppress
from importlib.util import find_spec

import pytest
from processes import environment
from strategies import AT_NIGHT

import verification as vf
from verification.sweeps.grid import SweepGrid
from verification.sweeps.store import plan
from verification.sweeps.workers import NoWorkers

needs_dask = "the extra `cluster` is not installed: there is no dask to sweep on"
pytestmark = pytest.mark.skipif(find_spec("distributed") is None, reason=needs_dask)

SMALL = vf.example("section6").changed(cells=((10, 2), (8, 2)), radius="0.2", max_iterations=200)
GRID = {"theta": [f"{n}/40" for n in range(1, 40)], "friction": [0, "1/5", "2/5"]}

#: Each starts a scheduler and its workers as processes, some 8 s.
at_night = pytest.mark.skipif(not AT_NIGHT, reason="in the nightly profile")

#: Seconds for a process of dask to come up.
PATIENCE = 300


class Cluster:
    """A scheduler and its workers, each a process of its own."""

    def __init__(self, address, scheduler, workers):
        self.address, self.scheduler, self.workers = address, scheduler, workers


@contextmanager
def process(module, *arguments, **more):
    command = [sys.executable, "-W", "ignore", "-m", f"distributed.cli.{module}", *map(str, arguments)]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with subprocess.Popen(command, env=environment(**more), **quiet) as started:
        try:
            yield started
        finally:
            started.kill()


@pytest.fixture
def cluster(tmp_path):
    """``cluster(workers, **environment)``: one that is up."""
    with ExitStack() as stack:

        def up(workers=2, **more):
            file = tmp_path / "scheduler.json"
            scheduler = stack.enter_context(
                process("dask_scheduler", "--port", 0, "--no-dashboard", "--scheduler-file", file, **more)
            )
            begun = time.monotonic()
            address = None
            while address is None:
                assert time.monotonic() - begun < PATIENCE
                with suppress(OSError, ValueError):  # not there, or not written to its end
                    address = json.loads(file.read_text("utf-8"))["address"]
                time.sleep(0.05)
            options = ["--nthreads", 1, "--no-nanny", "--no-dashboard", "--local-directory", tmp_path]
            started = [stack.enter_context(process("dask_worker", address, *options, **more)) for _ in range(workers)]
            from distributed import Client

            with Client(address, set_as_default=False) as client:
                client.wait_for_workers(workers, timeout=PATIENCE)
            return Cluster(address, scheduler, started)

        yield up


def once(when, act):
    """Progress that acts when a share of the rows is done."""
    acted = []

    def tell(what, share):
        if share >= when and not acted:
            acted.append(what)
            act()

    return tell


def test_rows_are_those_of_one_process(tmp_path):
    """Both workers are threads of this process, with sockets between them."""
    from distributed import LocalCluster

    few, place = GRID | {"theta": GRID["theta"][::4]}, tmp_path / "rows.sqlite"
    options = {"processes": False, "protocol": "tcp://", "dashboard_address": None}
    with LocalCluster(n_workers=2, threads_per_worker=1, **options) as up:
        found = vf.sweep(SMALL, **few, dask=up.scheduler_address, store=place)
    assert found.rows == vf.sweep(SMALL, **few).rows
    assert plan(SMALL, SweepGrid.of(few), place).left == 0


@at_night
def test_rows_are_those_of_one_process_though_a_worker_is_killed_half_way(cluster, tmp_path):
    up = cluster()
    place = tmp_path / "rows.sqlite"
    found = vf.sweep(SMALL, **GRID, dask=up.address, store=place, progress=once(0.4, up.workers[0].kill))
    assert up.workers[0].wait() == -9
    assert found.rows == vf.sweep(SMALL, **GRID).rows
    assert plan(SMALL, SweepGrid.of(GRID), place).left == 0


@at_night
def test_a_scheduler_that_goes_away_leaves_what_is_done_in_the_store(cluster, tmp_path, monkeypatch):
    up = cluster()
    place = tmp_path / "rows.sqlite"
    with pytest.raises(NoWorkers, match="the scheduler has gone") as stopped:
        vf.sweep(SMALL, **GRID, dask=up.address, store=place, progress=once(0.4, up.scheduler.kill))
    assert str(stopped.value).startswith(up.address)
    assert "the same command goes on" in str(stopped.value)
    found = vf.sweep(SMALL, **GRID, store=place)
    assert 117 > found.stored >= 0.4 * 117
    assert found.to_csv() == vf.sweep(SMALL, **GRID).to_csv()


@at_night
def test_of_the_rows_on_a_worker_that_dies_only_the_one_that_kills_it_is_an_error(cluster, tmp_path, monkeypatch):
    text = """
        import os
        from dataclasses import dataclass
        from verification.algorithm.relaxation import Constant

        @dataclass(frozen=True)
        class Deadly(Constant):
            name = "deadly"

            def begin(self, pair, theta, rho):
                if theta == 0.5:
                    os._exit(1)
                return super().begin(pair, theta, rho)
    """
    (tmp_path / "deadly_rule.py").write_text("\n".join(line[8:] for line in text.splitlines()))
    monkeypatch.syspath_prepend(tmp_path)
    from deadly_rule import Deadly

    # one death is enough for the scheduler: it gives up the row that runs and those that wait for the same worker
    up = cluster(3, PYTHONPATH=str(tmp_path), DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES="0")
    deadly, *rest = vf.sweep(SMALL, theta=["0.5", *GRID["theta"][:19]], rule=[Deadly()], dask=up.address).rows
    assert deadly["outcome"] == "error"
    assert deadly["reason"] == "outcome: the workers that ran it were killed, perhaps as memory ran out"
    assert (deadly["theta"], deadly["rule"]) == (0.5, "deadly")
    assert tuple(rest) == vf.sweep(SMALL, theta=GRID["theta"][:19], rule=[Deadly()]).rows
    assert [worker.poll() is None for worker in up.workers].count(True) == 1  # among others, and alone


@at_night
def test_bodies_are_condensed_once_a_worker(cluster, tmp_path, monkeypatch):
    text = f"""
        import os
        from verification.interface import body

        def counted(made):
            def count(*args, **named):
                with open({str(tmp_path / "made")!r}, "a") as file:
                    file.write(f"{{os.getpid()}}\\n")
                return made(*args, **named)

            return count

        body.Condensation, body.Lifted = counted(body.Condensation), counted(body.Lifted)  # of many unknowns, of few
    """
    (tmp_path / "counted_bodies.py").write_text("\n".join(line[8:] for line in text.splitlines()))
    up = cluster(PYTHONPATH=str(tmp_path), DASK_DISTRIBUTED__WORKER__PRELOAD="counted_bodies")
    assert len(vf.sweep(SMALL, **GRID, dask=up.address).rows) == 117
    made = (tmp_path / "made").read_text().split()
    assert sorted(map(made.count, set(made))) == [2, 2]  # two bodies, two workers


def test_no_scheduler_is_one_line(monkeypatch):
    from verification.sweeps import workers as module

    monkeypatch.setattr(module, "PATIENCE", 0.5)
    for address in ("tcp://127.0.0.1:9", "nonsense", "tls://127.0.0.1:9", "ftp://x:1"):
        with pytest.raises(vf.ProblemError, match="needed the address of a dask scheduler") as refused:
            vf.sweep(SMALL, theta=["0.3"], dask=address)
        assert "\n" not in str(refused.value)
