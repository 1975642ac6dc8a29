"""The paper: each name in its source has a number, and each citation an entry."""

import importlib.util
import json
import math
import re
from pathlib import Path

import pytest
from strategies import AT_NIGHT

ROOT = Path(__file__).parents[2]
SOURCE = (ROOT / "docs/paper/paper.typ").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def compute():
    spec = importlib.util.spec_from_file_location("paper_numbers", ROOT / "docs/paper/compute.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def used(part):
    """The names of a part of the numbers that the source reads."""
    return set(re.findall(rf"\bn\.{part}\.(\w+)", SOURCE))


def test_every_citation_is_in_the_bibliography():
    entries = set(re.findall(r"^@\w+\{(\w+),", (ROOT / "docs/references.bib").read_text(encoding="utf-8"), re.M))
    cited = set(re.findall(r"@([A-Z]\w+\d{4})", SOURCE))
    assert cited
    assert cited <= entries


def test_every_label_that_is_referred_to_exists():
    assert set(re.findall(r"@([a-z][\w-]*)", SOURCE)) <= set(re.findall(r"<([\w-]+)>", SOURCE))


def test_numbers_without_a_mesh_have_the_names_that_the_source_reads(compute, known_continuum):
    found = compute.continuum()
    assert used("continuum") <= set(found)
    assert found["rho_normal"] == pytest.approx(2 / 7, rel=1e-12)  # E_c / E_n


@pytest.mark.skipif(not AT_NIGHT, reason="in the nightly profile, as it takes half a minute")
def test_all_numbers_and_figures_are_made(compute, tmp_path):
    compute.write(tmp_path)
    numbers = json.loads((tmp_path / "numbers.json").read_text(encoding="utf-8"))
    assert set(re.findall(r"\bn\.(\w+)", SOURCE)) <= set(numbers)
    for part in ("chain", "lost", "other_unit", "certificate"):
        assert used(part) <= set(numbers[part])
    for figure in re.findall(r'"/(\w+\.svg)"', SOURCE):
        assert (tmp_path / figure).stat().st_size > 1000
    chain = numbers["chain"]
    assert chain["attained"] <= chain["factor_lmi"] <= chain["factor_energy"]
    assert all(row["attained"] <= row["lmi"] for row in numbers["factors"])
    low, high = map(float, numbers["cells"]["enclosed"]["rho_normal_cells"])
    saw_tooth = 3.5 * math.sqrt(5 / 3)  # of normal amplitudes: the lemma on long waves, with M = 7/2
    assert low <= saw_tooth <= high
    assert numbers["cells"]["runs"]["above"]["outcome"] != "converged"
    assert numbers["cells"]["runs"]["below"]["outcome"] == "converged"
