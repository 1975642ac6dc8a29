"""`ndtheory constants --verified`: what the screen shows lies outside what was proved, and the document keeps it."""

from fractions import Fraction as F

from ndtheory import Number
from verification.cli.console import between
from verification.constants import ENERGY_NAMES, NAMES


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
    assert "all rounding errors bounded" in " ".join(screen.out.split())
    assert max(map(len, screen.out.splitlines()[:-1])) <= 80  # the last one names the file


def test_with_halvings_each_mesh_has_its_own_bounds(call, write):
    answer = call("constants", write(), "--verified", "--refine", "1")
    assert answer.out.count(" at least ") == 2
    assert answer.out.count(" verified") >= 2 * len(NAMES)


def test_an_end_is_rounded_away_from_the_number_in_every_digit():
    number = Number(value=-0.2, lo=-2 / 3, hi=2 / 3, level="verified")
    for digits in range(1, 18):
        low, high = between(number, digits)
        assert F(low) <= F(-2 / 3)
        assert F(high) >= F(2 / 3)
        assert F(high) - F(2 / 3) < F(10) ** -digits
    assert between(Number.of_float(1.0)) == between(None) == ("-", "-")
