"""The page on proved constants: what its table says of widths is what comes out."""

import re
from fnmatch import fnmatchcase
from pathlib import Path

import verification as vf

PAGE = Path(__file__).parents[2] / "docs" / "verified.md"


def test_the_widths_of_the_coarsest_mesh_are_those_of_the_page():
    row = next(line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("| 462 |"))
    widths = [float(cell) for cell in row.strip("| ").split(" | ")[3:]]
    measured = vf.measure(vf.example("section6"), verified=True)
    for name, width in zip(("m", "M", "rho_max", "C_R", "C_s", "C_t1", "kappa_1"), widths, strict=True):
        number = getattr(measured, name)
        found = (number.hi - number.lo) / number.value
        assert width / 10 < found < 10 * width, name  # another LAPACK rounds otherwise


def levels_of(document, path=""):
    """Key and level of every number that has one."""
    if isinstance(document, dict):
        if {"value", "lo", "hi", "level"} <= set(document):
            yield path, document["level"]
        for name, value in document.items():
            yield from levels_of(value, f"{path}.{name}".strip("."))


def test_the_levels_of_a_comparison_with_proofs_are_those_of_the_page():
    text = PAGE.read_text(encoding="utf-8").split("| key | level |\n|---|---|\n")[1].split("\n\n")[0]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines()]
    table = [(key, level.split(":")[0]) for keys, level in rows for key in re.findall(r"`([^`]+\.[^`]+)`", keys)]
    document = vf.compare(vf.example("section6-60"), verified=True).to_dict()
    found = dict(levels_of({name: document[name] for name in ("constants", "bounds", "energy", "lmi")}))
    assert len(found) > 50
    for path, level in found.items():
        assert [said for key, said in table if fnmatchcase(path, key)][:1] == [level], path
    for key, _ in table:
        assert any(fnmatchcase(path, key) for path in found), key
