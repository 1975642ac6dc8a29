"""`constants --verified`, `compare --verified`: screens show ends outside what was proved, and documents keep it."""

import re
from fractions import Fraction as F

import pytest

from ndtheory import Number
from verification.certificate.exact_bodies import NotExact
from verification.constants.measured import ENERGY_NAMES, NAMES
from verification.show.numbers import between


def test_the_screen_shows_ends_that_lie_outside_those_of_the_document(call, write):
    file = write()
    document, screen = (call("constants", file, "--verified", *more) for more in (["--json"], []))
    rows = {line.split()[0]: line.split() for line in screen.out.splitlines() if line.startswith("  ")}
    for name in (*NAMES, *ENERGY_NAMES):
        number = document.document[name]
        assert number["level"] == "verified"
        assert number["lo"] < number["hi"]
        low, high = map(F, rows[name][2:4])
        assert low <= F(number["lo"])
        assert F(number["hi"]) <= high
    assert document.document["unverified"] == {}
    assert "rounding included" in " ".join(screen.out.split())
    assert max(map(len, screen.out.splitlines()[:-1])) <= 80  # the last one names the file


def test_with_halvings_each_mesh_has_its_own_bounds(call, write):
    answer = call("constants", write(), "--verified", "--refine", "1")
    assert len(re.findall("about +at least +at most", answer.out)) == 2
    assert answer.out.count(" verified") >= 2 * len(NAMES)


def test_an_end_is_rounded_away_from_the_number_in_every_digit():
    number = Number(value=-0.2, lo=-2 / 3, hi=2 / 3, level="verified")
    for digits in range(1, 18):
        low, high = map(str, between(number, digits))
        assert F(low) <= F(-2 / 3)
        assert F(high) >= F(2 / 3)
        assert F(high) - F(2 / 3) < F(10) ** -digits
    assert between(Number.of_float(1.0)) == between(None) == ("-", "-")


# --- compare --verified -----------------------------------------------------------------------------------------------


def numbers_of(line):
    """The numbers of a line that have the mark of level verified."""
    return [F(text) for text in re.findall(r"([0-9.]+(?:[eE][+-]?\d+)?) v", line)]


def test_compare_shows_proved_ends_with_their_mark_and_its_legend(call, write):
    file = write()
    document = call("compare", file, "--verified", "--json").document
    screen = call("compare", file, "--verified", "--full").out
    lines = screen.splitlines()
    assert max(map(len, lines[:-1])) <= 80
    assert "v (verified): proved for the exact data" in " ".join(screen.split())
    row = lambda name: next(line for line in lines if line.startswith(f"  {name} ") and " contracts v" in line)
    energy, lmi = document["energy"], document["lmi"]
    every, some, factor = numbers_of(row("energy"))
    assert every <= F(energy["friction_threshold"]["lo"])
    assert some <= F(energy["friction_limit"]["lo"])
    assert factor >= F(energy["factor"]["hi"])
    allowed, same, bound = numbers_of(row("lmi"))
    assert same == allowed  # where every small theta contracts some theta does
    assert allowed <= F(lmi["friction_threshold"]["lo"])
    assert allowed == pytest.approx(lmi["friction_threshold"]["lo"], rel=1e-2)
    assert bound == pytest.approx(lmi["lipschitz"]["hi"], abs=1e-3)
    assert bound >= F(lmi["lipschitz"]["hi"])
    assert document["lmi"]["certified"]
    rows = {line.split()[0]: line.split() for line in lines if line.startswith("  ") and "verified" in line.split()}
    for name in ("m", "M", "C_R", "rho_max"):
        assert F(rows[name][2]) <= F(document["constants"][name]["lo"])


def test_compare_without_the_word_has_no_marks(call, write):
    screen = call("compare", write(), "--full").out
    assert " v " not in screen
    assert "verified" not in screen


def test_what_is_not_certified_is_told_on_the_screen(call, write, monkeypatch):
    def refused(*given):
        raise NotExact("these bodies are made up")

    monkeypatch.setattr("verification.certificate.claims.describe", refused)
    screen = " ".join(call("compare", write(), "--verified", "--full").out.split())
    assert "lmi is not proved: these bodies are made up" in screen
