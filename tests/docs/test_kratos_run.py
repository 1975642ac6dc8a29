"""The page on runs in Kratos: its logs are read and have the counts that its text names, and the advice follows."""

import re
import tomllib
from pathlib import Path

import pytest

from verification.coupling.log_files import read_log

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "kratos_run.md").read_text("utf-8")
RECORD = tomllib.loads((DOCS / "kratos" / "runs.toml").read_text("utf-8"))
RUNS = {name: run for kind in ("tied", "contact") for name, run in RECORD[kind].items()}

#: What the names of accelerators begin with in a log; constant relaxation is none to the reader of logs.
ACCELERATORS = {"aitken": "Aitken", "iqn-ils": "IQNILS", "constant": ""}

#: Iterations of the runs that converge.
COUNTED = {
    name: text.count("Coupling iteration:")
    for name in RUNS
    if "CONVERGENCE WAS ACHIEVED" in (text := (DOCS / "kratos" / f"{name}.log").read_text("utf-8"))
}


def test_each_run_has_one_log():
    assert {path.stem for path in (DOCS / "kratos").glob("*.log")} == {*RUNS}


@pytest.mark.parametrize("name", RUNS)
def test_a_log_is_read_with_the_settings_of_its_run_and_the_count_of_the_page(name):
    path, run = DOCS / "kratos" / f"{name}.log", RUNS[name]
    log, text = read_log(path), path.read_text("utf-8")
    (column,) = log.columns
    (window,) = column.windows
    assert log.form == "Kratos CoSimulation"
    assert column.name == f"abs-norm of Body{run['neumann_body']}.force"
    assert (log.accelerator or "").startswith(ACCELERATORS[run["method"]])
    assert (log.accelerator is None) == (run["method"] == "constant")
    assert float(re.search(r"factor = +(\S+)", text)[1]) == pytest.approx(run["theta"], abs=0.051)  # one decimal
    assert len(window) == COUNTED.get(name, 50)


def test_the_text_names_the_counts_and_factors_of_the_logs():
    text = re.sub(r"```.*?```", "", PAGE.partition("## Does it help?")[2], flags=re.S)
    assert {str(count) for count in COUNTED.values()} <= {*re.findall(r"\b\d+\b", text)}
    assert {str(run["theta"]) for run in RUNS.values()} <= {*re.findall(r"\b0\.\d+\b", text)}


def test_the_cells_of_the_page_hold(monkeypatch, capsys):
    monkeypatch.chdir(DOCS)
    cells = re.findall(r"```\{code-cell\} ipython3\n(?::tags:[^\n]*\n)?(.*?)```", PAGE, re.S)
    assert len(cells) == 4
    exec(compile("\n".join(cells), "page", "exec"), {})
    said = capsys.readouterr().out
    assert "Advised: constant theta, with the roles exchanged: 7 steps" in said
    assert said.count("iterations\n") == 1 + len(RUNS)
