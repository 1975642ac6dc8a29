"""The page on proved constants: what its table says of widths is what comes out."""

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
