"""A store whose rows or tables are sound for SQLite and JSON, and not what this program has written."""

import json
import sqlite3
import zlib
from contextlib import closing

import pytest

import verification as vf
from verification.sweeps import store
from verification.sweeps.grid import SweepGrid
from verification.sweeps.store import plan

SMALL = vf.example("section6").changed(cells=((10, 2), (8, 2)), radius="0.2", max_iterations=200)


def replaced(place, text, **columns):
    """Put another text into each row of a store, with a checksum that agrees, and other values into its columns."""
    with closing(sqlite3.connect(place)) as file:
        for (key,) in file.execute("SELECT key FROM rows").fetchall():
            content = text(json.loads(file.execute("SELECT row FROM rows WHERE key = ?", [key]).fetchone()[0]))
            values = {"row": content, "crc": zlib.crc32(content, zlib.crc32(key))} | columns
            cast = {"row": "CAST(? AS TEXT)"}
            names = ", ".join(f"{name} = {cast.get(name, '?')}" for name in values)
            file.execute(f"UPDATE rows SET {names} WHERE key = ?", [*values.values(), key])
        file.commit()


#: Texts that are JSON, or nearly, and no row of this program, with what becomes of a row that is one.
OTHERS = {
    **{text: lambda row, text=text: text.encode() for text in ("[]", "5", '"x"', "null", "{}", "[" * 10**5, "\x00")},
    "not UTF-8": lambda row: b'{"reason":"\xff"}',
    "a column less": lambda row: json.dumps({name: row[name] for name in list(row)[1:]}).encode(),
    "a column more": lambda row: json.dumps(row | {"mine": 1}).encode(),
    "a text for a number": lambda row: json.dumps(row | {"rho": "two"}).encode(),
    "no number": lambda row: json.dumps(row | {"rho": float("nan")}).encode(),
    "a number beyond all": lambda row: json.dumps(row | {"theta": 10**400}).encode(),
    "half a step": lambda row: json.dumps(row | {"steps": 0.5}).encode(),
    "a truth value": lambda row: json.dumps(row | {"friction": True}).encode(),
    "a number for a text": lambda row: json.dumps(row | {"rule": 3}).encode(),
    "a list for a text": lambda row: json.dumps(row | {"reason": ["a"]}).encode(),
    "control characters": lambda row: json.dumps(row | {"reason": "\x1b[2J"}).encode(),
    "no outcome": lambda row: json.dumps(row | {"outcome": None}).encode(),
    "another outcome": lambda row: json.dumps(row | {"outcome": "diverged"}).encode(),
}


@pytest.mark.parametrize("what", OTHERS)
def test_a_row_with_the_right_checksum_that_this_program_has_not_written_is_made_again(place, what):
    theta = ["0.3", "0.7"]
    first = vf.sweep(SMALL, theta=theta, store=place)
    replaced(place, OTHERS[what])
    assert plan(SMALL, SweepGrid.of({"theta": theta}), place).damaged == 2
    again = vf.sweep(SMALL, theta=theta, store=place)
    assert again.notes == (f"{place}: 2 of these rows are damaged: they are made again",)
    assert again.to_csv() == first.to_csv() == vf.sweep(SMALL, theta=theta, store=place).to_csv()


@pytest.mark.parametrize(
    "columns",
    [{"crc": "x"}, {"crc": b""}, {"crc": 2**62}, {"outcome": None}, {"outcome": b"x"}, {"outcome": 7}],
    ids=str,
)
def test_columns_that_do_not_fit_a_row_make_it_damaged(place, columns):
    vf.sweep(SMALL, theta=["0.3"], store=place)
    replaced(place, lambda row: json.dumps(row, separators=(",", ":")).encode(), **columns)
    assert plan(SMALL, SweepGrid.of({"theta": ["0.3"]}), place).damaged == 1


@pytest.mark.parametrize(
    "statements",
    [
        "ALTER TABLE rows ADD COLUMN mine",
        "DROP TABLE rows; CREATE TABLE rows (key, study, outcome, row, crc)",
        "DROP TABLE studies; CREATE TABLE studies (id TEXT, identity, version, problem)",
        "CREATE TRIGGER mine AFTER INSERT ON rows BEGIN DELETE FROM rows; END",
        "ALTER TABLE rows RENAME TO others; CREATE VIEW rows AS SELECT * FROM others",
        "DROP TABLE studies",
    ],
)
def test_a_database_with_the_mark_of_a_store_and_other_tables_is_refused_and_stays(place, statements):
    vf.sweep(SMALL, theta=["0.3"], store=place)
    with closing(sqlite3.connect(place)) as file:
        file.executescript(statements)
    before = place.read_bytes()
    with pytest.raises(store.StoreError, match="not a store of this program"):
        vf.sweep(SMALL, theta=["0.3"], store=place)
    assert place.read_bytes() == before


def test_versions_of_studies_that_are_no_text_are_shown_as_escapes(place, monkeypatch):
    vf.sweep(SMALL, theta=["0.3"], store=place)
    with closing(sqlite3.connect(place)) as file:
        file.execute("UPDATE studies SET version = CAST(x'ff1b' AS TEXT)")
        file.commit()
    monkeypatch.setattr(store, "NUMERICS", store.NUMERICS + 1)  # then they are told
    with pytest.raises(store.StoreError) as error:
        vf.sweep(SMALL, theta=["0.3"], store=place)
    assert str(error.value).isprintable()
