"""The store of a sweep: what was made is made once, whatever ends the process that made it."""

import json
import os
import sqlite3
from contextlib import closing
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
import pytest
from processes import ended, environment, running
from stored import read
from strategies import AT_NIGHT

import verification as vf
from verification.algorithm.relaxation import Constant
from verification.interface.friction import Local
from verification.sweeps import row as row_module
from verification.sweeps import store
from verification.sweeps.grid import SweepGrid
from verification.sweeps.store import Store, keys, plan

SMALL = vf.example("section6").changed(cells=((10, 2), (8, 2)), radius="0.2", max_iterations=200)

#: Runs that converge, that reach their limit, and that are refused.
GRID = {"theta": ["1/50", "0.3", "0.7", "0.95"], "friction": [0, "1/5"], "refine": [0, 8]}


# --- a row is made once ---


def test_a_second_sweep_makes_no_row_and_has_the_same_table(place, made):
    alone = vf.sweep(SMALL, **GRID)
    first = vf.sweep(SMALL, **GRID, store=place)
    del made[:]
    again = vf.sweep(SMALL, **GRID, store=place)
    assert made == []
    assert {each["outcome"] for each in again.rows} >= {"converged", "limit", "refused"}
    assert (again.rows, again.to_csv()) == (first.rows, first.to_csv()) == (alone.rows, alone.to_csv())
    assert (alone.stored, first.stored, again.stored) == (0, 0, 16)


def test_a_larger_grid_makes_what_is_new(place, made):
    vf.sweep(SMALL, theta=["0.3", "0.7"], store=place)
    del made[:]
    vf.sweep(SMALL, theta=["0.1", 0.7, "3/10"], store=place)
    assert made == [{"theta": Fraction(1, 10)}]


def test_rows_of_several_processes_are_those_of_one(place, tmp_path):
    alone = vf.sweep(SMALL, **GRID, store=place)
    together = vf.sweep(SMALL, **GRID, store=tmp_path / "other.sqlite", jobs=2)
    question = "SELECT key, outcome, row, crc FROM rows ORDER BY key"
    assert read(place, question) == read(tmp_path / "other.sqlite", question)
    assert together.to_csv() == alone.to_csv()


def test_fresh_makes_every_row_again(place, made):
    vf.sweep(SMALL, theta=["0.3", "0.7"], store=place)
    del made[:]
    assert vf.sweep(SMALL, theta=["0.3", "0.7"], store=place, fresh=True).stored == 0
    assert len(made) == 2
    assert read(place, "SELECT count(*) FROM rows") == [(2,)]


def test_what_raises_is_a_row_with_its_reason_and_is_not_made_again(place, monkeypatch):
    def broken(*args):
        raise ZeroDivisionError("made up")

    monkeypatch.setattr("verification.sweeps.row.course", broken)
    vf.sweep(SMALL, theta=["0.3"], store=place)
    monkeypatch.undo()
    [found] = vf.sweep(SMALL, theta=["0.3"], store=place).rows
    assert (found["outcome"], found["reason"]) == ("error", "outcome: ZeroDivisionError: made up")
    assert read(place, "SELECT outcome FROM rows") == [("error",)]


def test_what_ended_in_an_error_is_told_and_made_again_when_asked(place, made, monkeypatch):
    grid = {"theta": ["0.3", "0.7"], "refine": [0, 8]}  # a mesh of refine = 8 is refused
    course, thetas = row_module.course, []

    def broken_once(pair, rule, choice, *given):
        thetas.append(float(choice.theta))
        if thetas == [0.3]:
            raise MemoryError("made up")
        return course(pair, rule, choice, *given)

    monkeypatch.setattr(row_module, "course", broken_once)
    first = vf.sweep(SMALL, **grid, store=place)
    assert sorted(each["outcome"] for each in first.rows) == ["converged", "error", "refused", "refused"]
    told = f"{place}: 1 of these rows ended in an error and stay as they are; --retry makes them again"
    asked = SweepGrid.of(grid)
    del made[:]
    again = vf.sweep(SMALL, **grid, store=place)
    assert (again.rows, again.notes, made) == (first.rows, (told,), [])
    assert (plan(SMALL, asked, place).errors, plan(SMALL, asked, place).notes) == (1, (told,))
    assert (plan(SMALL, asked, place, retry=True).left, plan(SMALL, asked, place, fresh=True).left) == (1, 4)
    mended = vf.sweep(SMALL, **grid, store=place, retry=True)
    assert made == [{"theta": Fraction(3, 10), "refine": 0}]
    assert (mended.stored, mended.notes) == (3, ())
    assert mended.rows == vf.sweep(SMALL, **grid).rows
    assert vf.sweep(SMALL, **grid, store=place).rows == mended.rows


def test_a_plan_counts_and_makes_neither_rows_nor_a_file(place, made):
    grid = SweepGrid.of({"theta": ["0.3", "0.7"]})
    assert plan(SMALL, grid, place).left == 2
    assert not place.exists()
    vf.sweep(SMALL, theta=["0.7"], store=place)
    del made[:]
    found = plan(SMALL, grid, place)
    assert (found.asked, found.stored, found.left, made) == (2, 1, 1, [])


# --- what a key depends on ---


def key(start, **axes):
    [one] = keys(start, SweepGrid.of(axes or {"theta": ["0.3"]}))
    return one


CHANGES = {
    "friction": {"friction": "0.21"},
    "modulus": {"young": (None, "20000.000000000000001")},
    "mesh": {"cells": ((10, 2), (8, 4))},
    "tolerance": {"tolerance": "1e-8"},
    "limit": {"max_iterations": 201},
    "roles": {"neumann_body": 2},
}


def test_whatever_changes_a_number_changes_the_key():
    found = [key(SMALL), *(key(SMALL.changed(**change)) for change in CHANGES.values())]
    found += [key(SMALL, theta=["0.3"], friction=["0.2"]), key(SMALL, theta=["0.30000000000000000001"])]
    found += [key(vf.build(SMALL)), key(vf.build(SMALL, law=Local())), key(vf.build(SMALL).at(friction="0.3"))]
    found += [key(SMALL, young=[young]) for young in ([1, 2], [2, 1])]
    assert len(set(found)) == len(found)


def test_another_solver_of_step_ii_changes_the_key(monkeypatch):
    before = key(SMALL)
    monkeypatch.setattr(store, "SOLVER", "active-set")
    assert key(SMALL) != before


def test_an_operator_given_as_a_matrix_counts_by_its_entries():
    stiffness = {"S1": np.diag([3.0, 2.0, 3.0, 2.0]), "S2": np.eye(4), "x": np.array([0.0, 1.0]), "friction": "0.1"}
    kernels = (np.eye(2), 2 * np.eye(2), np.eye(2)[::-1])
    assert len({key(vf.build(**stiffness, kernel=kernel)) for kernel in kernels}) == len(kernels)


def test_title_units_and_place_do_not():
    other = vf.Problem.from_dict({**SMALL.to_dict(), "title": "another", "units": {"length": "m"}}, "elsewhere.toml")
    assert key(other) == key(SMALL)
    assert key(SMALL, theta=["3/10"]) == key(SMALL, theta=[0.3])


def test_a_pair_counts_by_its_matrices():
    matrices = {"S1": np.diag([3.0, 2.0]), "S2": np.eye(2), "load2": np.array([0.0, -1.0]), "x": np.array([0.0])}
    pair = vf.build(**matrices)
    assert key(pair) == key(vf.build(**matrices))
    nearly = matrices | {"S1": np.diag([3.0, np.nextafter(2.0, 3.0)])}
    assert len({key(pair), key(vf.build(**nearly)), key(pair.swapped())}) == 3
    assert key(replace(pair, settings=replace(pair.settings, max_iterations=9))) != key(pair)


@dataclass(frozen=True)
class MyRule(Constant):
    name = "mine"


class MyLaw(Local):
    name = "mine"


def test_a_rule_or_a_law_of_ones_own_is_refused_in_words(place):
    with pytest.raises(vf.ProblemError, match='rule = "mine": needed a rule of this library'):
        vf.sweep(SMALL, theta=["0.3"], rule=[MyRule()], store=place)
    with pytest.raises(vf.ProblemError, match='law = "MyLaw": needed a law of this library'):
        vf.sweep(vf.build(SMALL, law=MyLaw()), theta=["0.3"], store=place)
    assert not place.exists()
    assert vf.sweep(SMALL, theta=["0.3"], rule=[MyRule()]).rows[0]["rule"] == "mine"


# --- killed ---

#: Sweeps in processes that are killed after the milliseconds of the arguments, until one ends; says how many did not.
KILLED = """
    import os, signal, sys, time
    from pathlib import Path
    import verification as vf
    from verification.sweeps.workers import row  # noqa: F401  what a child would import first

    folder = Path({folder!r})
    problem = vf.Problem.from_dict({problem!r})

    def swept(place):
        child = os.fork()
        if not child:
            vf.sweep(problem, **{grid!r}, store=str(place))
            os._exit(0)
        return child

    begun = time.monotonic()
    os.waitpid(swept(folder / "not killed.sqlite"), 0)
    whole = time.monotonic() - begun

    stores = [folder / "0.sqlite"]
    killed = 0
    for share in map(float, sys.argv[1:]):
        child = swept(stores[-1])
        time.sleep(share * whole)
        os.kill(child, signal.SIGKILL)
        if os.waitpid(child, 0)[1] == signal.SIGKILL:
            killed += 1
        else:  # all rows are there: what comes after it would only read them
            stores.append(folder / f"{{len(stores)}}.sqlite")
    print(killed, len(stores))
"""

LONG = {"theta": [f"{n}/20" for n in range(1, 20)], "friction": [0, "1/5", "2/5"]}


@pytest.fixture(scope="module")
def whole():
    """The table of a sweep that was not killed."""
    return vf.sweep(SMALL, **LONG).to_csv()


@pytest.mark.parametrize("moments", [50 if AT_NIGHT else 8])
def test_a_sweep_killed_at_random_moments_ends_with_the_table_of_one_that_was_not(tmp_path, whole, moments):
    """After a tenth of the time of a whole sweep on the average; where all rows are there a new store is begun."""
    random = np.random.default_rng(moments)
    code = KILLED.format(problem=SMALL.to_dict(), grid=LONG, folder=str(tmp_path))
    chosen = random.exponential(0.1, size=moments).round(4)
    answer = ended(code, *chosen, env=environment(OPENBLAS_NUM_THREADS="1"))
    assert answer.returncode == 0, answer.stderr
    killed, stores = map(int, answer.stdout.split())
    assert killed >= moments // 2
    found = [vf.sweep(SMALL, **LONG, store=tmp_path / f"{n}.sqlite") for n in range(stores)]
    assert [each.to_csv() == whole for each in found] == [True] * stores
    # where the machine is busy a few moments may all come before the first row; the next test is about kept rows
    assert not AT_NIGHT or sum(each.stored for each in found) > 0
    # a row that was written a second time would have another number
    counted = [read(tmp_path / f"{n}.sqlite", "SELECT count(*), max(rowid) FROM rows") for n in range(stores)]
    assert counted == [[(57, 57)]] * stores


def test_rows_that_were_kept_when_the_process_is_killed_are_there(place):
    """At the moment when the tenth row is told of, and in the middle of the transaction of the next one."""
    code = f"""
        import os, signal
        import verification as vf

        def killed(what, share):
            if what.startswith("runs: 10 done"):
                os.kill(os.getpid(), signal.SIGKILL)

        vf.sweep(vf.Problem.from_dict({SMALL.to_dict()!r}), **{LONG!r}, store={str(place)!r}, progress=killed)
    """
    assert ended(code).returncode == -9
    assert place.with_name("rows.sqlite-wal").exists()
    found = plan(SMALL, SweepGrid.of(LONG), place)
    assert (found.stored, found.damaged) == (10, 0)


# --- a store that does not serve ---


def test_a_disk_that_is_full_loses_nothing_that_was_there(place, whole):
    vf.sweep(SMALL, theta=["0.3", "0.7"], store=place)
    before = read(place, "SELECT * FROM rows ORDER BY key")
    code = f"""
        import resource
        import verification as vf

        resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, resource.RLIM_INFINITY))
        try:
            vf.sweep(vf.Problem.from_dict({SMALL.to_dict()!r}), **{LONG!r}, store={str(place)!r})
        except vf.ProblemError as error:
            print(error)
    """
    answer = ended(code)
    assert (answer.returncode, answer.stderr) == (0, "")
    assert answer.stdout.startswith(f"{place}: the disk does not take it: needed room on it")
    kept = int(answer.stdout.partition("; the ")[2].partition(" rows")[0])
    assert kept > 0
    assert set(before) < set(read(place, "SELECT * FROM rows"))
    found = vf.sweep(SMALL, **LONG, store=place)
    assert found.stored == kept
    assert found.to_csv() == whole


def test_a_folder_that_may_only_be_read_is_told(place, tmp_path):
    if os.geteuid() == 0:
        place = tmp_path / "missing" / "rows.sqlite"  # the superuser may write anywhere
    else:
        tmp_path.chmod(0o500)
    try:
        with pytest.raises(store.StoreError, match="needed a folder that exists and can be written to"):
            vf.sweep(SMALL, theta=["0.3"], store=place)
    finally:
        tmp_path.chmod(0o700)


def test_a_second_sweep_on_the_same_store_is_told_and_changes_nothing(place, monkeypatch):
    monkeypatch.setattr(store, "PATIENCE", 0.1)
    one = SweepGrid.of({"theta": ["0.3"]})
    with Store(place, SMALL, one), pytest.raises(store.StoreError, match="another sweep is at work on it"):
        vf.sweep(SMALL, theta=["0.3"], store=place)
    code = f"""
        import sys
        from pathlib import Path
        import verification as vf
        from verification.sweeps.grid import SweepGrid
        from verification.sweeps.store import Store
        with Store(Path({str(place)!r}), vf.example("two-bars"), SweepGrid.of({{}})):
            print("held", flush=True)
            sys.stdin.read()
    """
    with running(code, stdin=-1) as process:
        assert process.stdout.readline() == "held\n"
        with pytest.raises(store.StoreError, match="another sweep is at work on it"):
            plan(SMALL, one, place)
        process.stdin.close()
        process.wait()
    assert vf.sweep(SMALL, theta=["0.3"], store=place).stored == 0


@pytest.mark.parametrize("what", ["text", "another database", "a later format", "a folder"])
def test_a_file_that_is_no_store_is_told_and_stays(place, what):
    if what == "text":
        place.write_text("mine, " * 1000)
    elif what == "a folder":
        place.mkdir()
    else:
        with closing(sqlite3.connect(place)) as file:
            file.execute("CREATE TABLE mine (a)")
            if what == "a later format":
                file.execute(f"PRAGMA application_id = {store.APPLICATION}")
                file.execute("PRAGMA user_version = 99")
            file.commit()
    before = None if what == "a folder" else place.read_bytes()
    needed = {"a later format": "format 99", "a folder": "needed the name of a file"}.get(what, "not a store")
    with pytest.raises(store.StoreError, match=needed):
        vf.sweep(SMALL, theta=["0.3"], store=place)
    assert before is None or place.read_bytes() == before


def test_an_empty_file_is_a_new_store(place):
    place.touch()
    assert len(vf.sweep(SMALL, theta=["0.3"], store=place).rows) == 1


def test_a_digit_that_was_changed_on_the_disk_is_found_and_the_row_made_again(place, made):
    first = vf.sweep(SMALL, theta=["0.3", "0.7"], store=place)
    content = place.read_bytes()
    at = content.index(b'"rho":') + 6
    place.write_bytes(content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :])
    assert plan(SMALL, SweepGrid.of({"theta": ["0.3", "0.7"]}), place).damaged == 1
    del made[:]
    again = vf.sweep(SMALL, theta=["0.3", "0.7"], store=place)
    assert len(made) == 1
    assert again.notes == (f"{place}: 1 of these rows are damaged: they are made again",)
    assert again.to_csv() == first.to_csv()
    assert vf.sweep(SMALL, theta=["0.3", "0.7"], store=place).notes == ()


def test_a_row_that_stands_under_the_key_of_another_one_is_found(place):
    vf.sweep(SMALL, theta=["0.3", "0.7"], store=place)
    with closing(sqlite3.connect(place)) as file:
        rows = file.execute("SELECT key, CAST(row AS BLOB), crc FROM rows").fetchall()
        for (key, _, _), (_, row, crc) in zip(rows, rows[::-1], strict=True):
            file.execute("UPDATE rows SET row = CAST(? AS TEXT), crc = ? WHERE key = ?", [row, crc, key])
        file.commit()
    assert plan(SMALL, SweepGrid.of({"theta": ["0.3", "0.7"]}), place).damaged == 2


def table_or_words(place):
    try:
        return vf.sweep(SMALL, theta=["0.3", "0.7", "0.8"], friction=[0, "1/5"], store=place).to_csv()
    except store.StoreError as error:
        return str(error)


@pytest.mark.parametrize("seed", range(40 if AT_NIGHT else 12))
def test_a_store_damaged_anywhere_is_words_or_the_true_table(place, seed):
    true = vf.sweep(SMALL, theta=["0.3", "0.7", "0.8"], friction=[0, "1/5"], store=place).to_csv()
    random = np.random.default_rng(seed)
    content = bytearray(place.read_bytes())
    if seed % 3:
        for at in random.integers(0, len(content), size=40):
            content[at] = random.integers(256)
    else:
        del content[random.integers(100, len(content)) :]
    place.write_bytes(content)
    found = table_or_words(place)
    assert found == true or (found.startswith(str(place)) and "\n" not in found)


@pytest.mark.parametrize("name", [b"\xe4", b"a\nb", b"\x1b[2J"])
def test_what_sqlite_repeats_of_a_damaged_store_is_not_shown(place, name):
    """The name of a table that it cannot read is part of its message: bytes that are no text, or no letters."""
    vf.sweep(SMALL, theta=["0.3"], store=place)
    with closing(sqlite3.connect(place)) as file:
        file.execute("PRAGMA writable_schema = ON")
        broken = "UPDATE sqlite_master SET name = CAST(? AS TEXT), sql = 'CREATE nonsense' WHERE name = 'rows'"
        file.execute(broken, [name])
        file.commit()
    with pytest.raises(store.StoreError) as refused:
        vf.sweep(SMALL, theta=["0.3"], store=place)
    assert str(refused.value) == f"{place}: {store.DAMAGED}"


def test_the_store_says_what_its_rows_are_made_from(place):
    vf.sweep(SMALL, theta=["0.3"], store=place)
    [(version, problem)] = read(place, "SELECT version, problem FROM studies JOIN rows ON rows.study = studies.id")
    assert version == store.__version__
    assert vf.Problem.from_dict(json.loads(problem)) == SMALL
    assert sorted(path.name for path in place.parent.iterdir()) == ["rows.sqlite"]
