"""The reports on dependencies: each names a place that works round the fault, and a program that can be run."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
REPORTS = (ROOT / "docs" / "upstream.md").read_text("utf-8").split("\n## ")[1:]
PLACE = re.compile(r"`((?:fem1d2d|ndtheory|verification)/[\w/]+\.py)`")


@pytest.mark.parametrize("report", REPORTS, ids=lambda report: report.partition(":")[0])
def test_a_report_has_a_program_what_is_known_and_the_place_of_the_workaround(report):
    [program] = re.findall(r"```python\n(.*?)```", report, re.DOTALL)
    ast.parse(program)
    assert "Known upstream:" in report
    places = PLACE.findall(report)
    assert places
    assert [name for name in places if not (ROOT / name).is_file()] == []
