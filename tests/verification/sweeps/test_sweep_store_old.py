"""Stores outlive releases: rows are used while the number of the numerics is that under which they were made."""

import json
import sqlite3
import zlib
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from stored import read

import verification as vf
from verification.sweeps import identity, store
from verification.sweeps.grid import SweepGrid
from verification.sweeps.identity import Identity
from verification.sweeps.row import is_row, renamed
from verification.sweeps.store import plan

SMALL = vf.example("section6").changed(cells=((10, 2), (8, 2)), radius="0.2", max_iterations=200)
MATRICES = {"S1": np.diag([3.0, 2.0]), "S2": np.eye(2), "x": np.zeros(1), "load2": np.array([0.0, -1.0])}

#: What the old store has, and its rows as they were made.
GRID = {"theta": ["0.3", "0.95"], "refine": [0, 8]}
OLD = (Path(__file__).parents[1] / "store_of_0_1_0.sql").read_text("utf-8")
FACTORS = [0.8454876938196176, 0.7742401092422802, None, None]

TOLD = "{}: {} of these rows are of version {} with other numerics; they are not used, and stay"


@pytest.fixture(params=["sharp_factor", "energy_factor"])
def old(place, request, monkeypatch):
    """A store that the commits before wrote, with either name of the column; the numerics are those of its rows."""
    monkeypatch.setattr(identity, "NUMERICS", 2)
    with closing(sqlite3.connect(place)) as file:
        file.executescript(OLD)
        for key, text in file.execute("SELECT key, row FROM rows").fetchall():
            content = text.replace("sharp_factor", request.param).encode()
            crc = zlib.crc32(content, zlib.crc32(key))
            file.execute("UPDATE rows SET row = CAST(? AS TEXT), crc = ? WHERE key = ?", [content, crc, key])
        file.execute(f"PRAGMA application_id = {store.APPLICATION}")
        file.execute("PRAGMA user_version = 1")
        file.commit()
    return place


# --- stores of 0.1.0 ---


def test_the_rows_of_a_store_of_0_1_0_are_used(old, made):
    found = vf.sweep(SMALL, **GRID, store=old)
    assert (made, found.stored, found.notes) == ([], 4, ())
    assert sorted(row["energy_factor"] or 2 for row in found.rows) == sorted(factor or 2 for factor in FACTORS)
    assert found.columns == vf.sweep(SMALL, **GRID).columns
    assert all("sharp" not in (row["reason"] or "") for row in found.rows)
    assert plan(SMALL, SweepGrid.of(GRID), old).stored == 4


def test_so_are_those_of_a_pair_of_matrices(old, made):
    found = vf.sweep(vf.build(**MATRICES), theta=["0.3"], store=old)
    assert (made, found.rows[0]["energy_factor"]) == ([], 0.7)
    other = vf.sweep(vf.build(**MATRICES | {"S2": 2 * np.eye(2)}), theta=["0.3"], store=old)
    assert other.stored == 0


def test_a_grid_that_grows_makes_what_is_new_and_keeps_it_beside_the_old_rows(old, made):
    vf.sweep(SMALL, theta=["0.3", "0.5", "0.95"], refine=[0], store=old)
    assert [float(values["theta"]) for values in made] == [0.5]
    again = vf.sweep(SMALL, theta=["0.3", "0.5", "0.95"], refine=[0], store=old)
    assert (len(made), again.stored) == (1, 3)
    assert read(old, "SELECT count(*) FROM rows") == [(6,)]


def test_fresh_rows_are_made_once_and_then_come_before_the_old_ones(old, made):
    made_again = vf.sweep(SMALL, theta=["0.3"], refine=[0], store=old, fresh=True)
    assert (len(made), read(old, "SELECT count(*) FROM rows")) == (1, [(6,)])
    with closing(sqlite3.connect(old)) as file:
        file.execute("UPDATE rows SET crc = 1 WHERE study <= 2")  # those of 0.1.0 cannot be what is read now
        file.commit()
    again = vf.sweep(SMALL, theta=["0.3"], refine=[0], store=old)
    assert (again.stored, again.rows, again.notes) == (1, made_again.rows, ())


def test_a_damaged_row_of_0_1_0_is_made_again(old, made):
    with closing(sqlite3.connect(old)) as file:
        file.execute("UPDATE rows SET crc = 1 WHERE json_extract(row, '$.theta') = 0.95")
        file.commit()
    found = vf.sweep(SMALL, theta=["0.3", "0.95"], refine=[0], store=old)
    assert [float(values["theta"]) for values in made] == [0.95]
    assert found.notes == (f"{old}: 1 of these rows are damaged: they are made again",)


def test_under_other_numerics_they_are_told_and_neither_used_nor_lost(old, made, monkeypatch):
    before = read(old, "SELECT * FROM rows ORDER BY key")
    monkeypatch.setattr(identity, "NUMERICS", identity.NUMERICS + 1)
    found = vf.sweep(SMALL, **GRID, store=old)
    assert (len(made), found.stored) == (4, 0)
    assert found.notes == (TOLD.format(old, 4, "0.1.0"),)
    assert set(before) < set(read(old, "SELECT * FROM rows"))
    assert plan(SMALL, SweepGrid.of(GRID), old).others == {"0.1.0": 4}


# --- releases and numerics ---


def test_rows_of_another_version_are_used(place, made, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(store, "__version__", "0.3.0")
        first = vf.sweep(SMALL, theta=["0.3", "0.7"], store=place)
    del made[:]
    found = vf.sweep(SMALL, theta=["0.3", "0.7", "0.8"], store=place)
    assert [float(values["theta"]) for values in made] == [0.8]
    assert (found.rows[:2], found.notes) == (first.rows, ())
    versions = "SELECT version, count(*) FROM rows JOIN studies ON studies.id = study GROUP BY version ORDER BY 1"
    assert read(place, versions) == [(store.__version__, 1), ("0.3.0", 2)]


def test_rows_of_other_numerics_are_told_by_version_and_not_used(place, made, monkeypatch):
    for version, theta in (("0.3.0", ["0.3", "0.7"]), ("0.4.0", ["0.8"])):
        with monkeypatch.context() as patch:
            patch.setattr(store, "__version__", version)
            vf.sweep(SMALL, theta=theta, store=place)
    del made[:]
    monkeypatch.setattr(identity, "NUMERICS", identity.NUMERICS + 2)
    found = vf.sweep(SMALL, theta=["0.7", "0.8", "0.9"], store=place)
    assert (len(made), found.stored) == (3, 0)
    assert found.notes == (TOLD.format(place, 1, "0.3.0"), TOLD.format(place, 1, "0.4.0"))
    assert vf.sweep(SMALL, theta=["0.7", "0.8", "0.9"], store=place).stored == 3


def test_another_number_of_the_numerics_changes_the_key(monkeypatch):
    grid = SweepGrid.of({"theta": ["0.3"]})
    before = Identity.read(SMALL).keys(grid)
    monkeypatch.setattr(store, "__version__", "9.9")
    assert Identity.read(SMALL).keys(grid) == before
    monkeypatch.setattr(identity, "NUMERICS", identity.NUMERICS + 1)
    assert Identity.read(SMALL).keys(grid) != before


def test_a_column_is_renamed_in_its_reason_too_and_nothing_else_is(old):
    row = json.loads(read(old, "SELECT row FROM rows")[0][0]) | {"reason": "proved_rate: no sharp_factor"}
    found = renamed(row)
    assert is_row(found)
    assert found["reason"] == row["reason"]
    assert [name for name in found if name not in row] in ([], ["energy_factor"])
    assert (
        renamed(row | {"reason": "sharp_factor: outside"} | {"sharp_factor": None})["reason"]
        == "energy_factor: outside"
    )
