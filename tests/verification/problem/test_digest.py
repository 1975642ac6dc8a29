"""Digests, keys of rows and certificates that a key of the problem file with a default leaves as they are."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction

import pytest
from stored import read

import verification as vf
from verification.certificate import claims, contraction
from verification.problem import reading
from verification.problem.entries import entry
from verification.problem.specs import ContactSpec, Settings
from verification.problem.tables import non_negative
from verification.sweeps import store
from verification.sweeps.grid import SweepGrid
from verification.sweeps.store import keys, plan

NAMES = ("section6", "two-bars", "inside", "signorini")
GRID = SweepGrid.of({"theta": ["0.3"]})
SMALL = vf.example("section6").changed(cells=((10, 2), (8, 2)), radius="0.2", max_iterations=200)


@dataclass(frozen=True, kw_only=True)
class LaterContact(ContactSpec):
    """The contact of a later release, with adhesion."""

    adhesion: Fraction = entry(read=non_negative, default=Fraction(0), later=True)


@dataclass(frozen=True, kw_only=True)
class CountingContact(ContactSpec):
    """The same, where the key counts whatever its value."""

    adhesion: Fraction = entry(read=non_negative, default=Fraction(0))


def later_contact(monkeypatch, kind=LaterContact):
    """Put `contact.adhesion` into the problem file, 0 by default."""
    monkeypatch.setattr(reading, "ContactSpec", kind)


@pytest.mark.parametrize("name", NAMES)
def test_a_later_key_with_a_default_changes_no_digest_and_no_key_of_a_row(monkeypatch, name):
    before, key = vf.example(name).digest, keys(vf.example(name), GRID)
    later_contact(monkeypatch)
    problem = vf.Problem.from_dict(vf.example(name).to_dict())
    assert problem.to_dict()["contact"]["adhesion"] == 0
    assert (problem.digest, keys(problem, GRID)) == (before, key)


def test_another_value_of_a_later_key_changes_the_digest(monkeypatch):
    later_contact(monkeypatch)
    problem = vf.Problem.from_dict(vf.example("section6").to_dict())
    found = {problem.with_keys({"contact.adhesion": value}).digest for value in ("0", "1/3", "0.3", "3e-1")}
    assert len(found) == 3
    assert problem.digest in found


def test_a_later_key_is_read_written_and_set_like_the_others(monkeypatch):
    later_contact(monkeypatch)
    problem = vf.Problem.from_dict(vf.example("section6").to_dict()).with_keys({"contact.adhesion": "1/3"})
    assert vf.Problem.from_dict(problem.to_dict()) == problem
    assert 'adhesion = "1/3"' in problem.to_toml()
    with pytest.raises(vf.ProblemError, match=r"contact\.adhesion = -1: needed a number >= 0"):
        problem.with_keys({"contact.adhesion": "-1"})
    with pytest.raises(vf.ProblemError, match="did you mean 'adhesion'"):
        problem.with_keys({"contact.adhesoin": "1"})


def test_a_key_that_is_not_said_to_be_later_counts(monkeypatch):
    before = vf.example("two-bars").digest
    later_contact(monkeypatch, CountingContact)
    assert vf.Problem.from_dict(vf.example("two-bars").to_dict()).digest != before


OF_THE_FIRST_RELEASE = [
    ("contact", "gap"),
    ("contact", "law"),
    ("iteration", "tolerance"),
    ("norm", "length"),
    ("body1", "body_force"),
]


@pytest.mark.parametrize(("table", "key"), OF_THE_FIRST_RELEASE)
def test_keys_of_the_first_release_count_with_their_defaults_too(table, key):
    """A release that changes a default leaves digests as they are, and tells its problems from those before."""
    assert key in vf.example("section6").tables(counting=True)[table]


@dataclass(frozen=True, kw_only=True)
class LaterSettings(Settings):
    """The settings of a later release."""

    patience: int = 5


def test_a_later_setting_with_a_default_changes_no_key_of_a_pair():
    pair = vf.build(vf.example("two-bars"))
    later = lambda **more: keys(replace(pair, settings=LaterSettings(**vars(pair.settings), **more)), GRID)
    assert later() == keys(pair, GRID) != later(patience=6)


# --- releases and numerics ---

TOLD = "{}: {} of these rows are of version {} with other numerics; they are not used, and stay"


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


def test_rows_of_other_numerics_are_told_by_version_and_neither_used_nor_lost(place, made, monkeypatch):
    for version, theta in (("0.3.0", ["0.3", "0.7"]), ("0.4.0", ["0.8"])):
        with monkeypatch.context() as patch:
            patch.setattr(store, "__version__", version)
            vf.sweep(SMALL, theta=theta, store=place)
    before = read(place, "SELECT * FROM rows ORDER BY key")
    del made[:]
    monkeypatch.setattr(store, "NUMERICS", store.NUMERICS + 2)
    grid = {"theta": ["0.7", "0.8", "0.9"]}
    assert plan(SMALL, SweepGrid.of(grid), place).others == {"0.3.0": 1, "0.4.0": 1}
    found = vf.sweep(SMALL, **grid, store=place)
    assert (len(made), found.stored) == (3, 0)
    assert found.notes == (TOLD.format(place, 1, "0.3.0"), TOLD.format(place, 1, "0.4.0"))
    assert set(before) < set(read(place, "SELECT * FROM rows"))
    assert vf.sweep(SMALL, **grid, store=place).stored == 3


def test_another_number_of_the_numerics_changes_the_key_and_another_version_does_not(monkeypatch):
    before = keys(SMALL, GRID)
    monkeypatch.setattr(store, "__version__", "9.9")
    assert keys(SMALL, GRID) == before
    monkeypatch.setattr(store, "NUMERICS", store.NUMERICS + 1)
    assert keys(SMALL, GRID) != before


# --- certificates ---


@pytest.fixture(scope="module")
def certified():
    problem = vf.example("section6").changed(cells=((10, 2), (8, 2)), radius="0.2")
    return problem, vf.certify(problem, edition="energy").to_dict()


def describing(monkeypatch, more):
    """Let descriptions have more keys."""
    describe = claims.describe
    monkeypatch.setattr(contraction, "describe", lambda *given: describe(*given) | more)


@pytest.mark.parametrize("of_a_body", [False, True])
def test_a_certificate_is_about_its_bodies_after_descriptions_got_another_key(monkeypatch, certified, of_a_body):
    problem, document = certified
    describing(monkeypatch, {"body1": document["discrete"]["body1"] | {"of": None}} if of_a_body else {"offset": None})
    checked = vf.check_again(document, problem)
    assert (checked.accepted, checked.same) == (True, True)


def test_a_certificate_is_not_about_bodies_that_have_another_value_of_that_key(monkeypatch, certified):
    problem, document = certified
    describing(monkeypatch, {"offset": {"normal": "1/3"}})
    assert vf.check_again(document, problem).same is False


def test_a_certificate_reads_a_problem_of_a_release_without_the_key(monkeypatch, certified):
    problem, document = certified
    before = problem.digest
    assert "adhesion" not in document["problem"]["contact"]
    later_contact(monkeypatch)
    read = vf.Problem.from_dict(document["problem"])
    assert (read.digest, read.contact.adhesion) == (before, 0)
    assert vf.check_again(document, read).same
    assert vf.check_again(document, read.with_keys({"contact.friction": "1/4"})).same is False
