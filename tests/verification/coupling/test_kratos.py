"""Couplings of two structural models in Kratos: residuals are those of this project, counts those of the table."""

import ast
import json
import math
import re
from dataclasses import replace
from fractions import Fraction
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import kratos_models
import numpy as np
import pytest
from coupling_logs import contact_run, tied_run

import verification as vf
from verification.cli import main
from verification.coupling.from_logs import advise_logs
from verification.coupling.log_files import read_log
from verification.coupling.methods import METHODS, steps
from verification.coupling.snippets import CouplingScheme, snippet
from verification.problem.specs import SidePart

APPLICATIONS = ("CoSimulation", "StructuralMechanics", "ConstitutiveLaws", "Mapping", "LinearSolvers")
WHEELS = ("KratosMultiphysics", *(f"Kratos{name}Application" for name in APPLICATIONS))


def missing(wheel):
    try:
        version(wheel)
    except PackageNotFoundError:
        return True
    return False


needs_kratos = pytest.mark.skipif(
    any(map(missing, WHEELS)), reason=f"no {', '.join(filter(missing, WHEELS))} here: `make kratos` runs these tests"
)

#: With friction the models are tied, as the table of ``advise --tied`` has it.
PLATES = vf.example("section6").changed(cells=((20, 3), (12, 3)))

#: Half of the top is pressed, without friction: some contact nodes open.
HALF = SidePart(side="top", x=(Fraction(2, 5), Fraction(1)))
PRESSED = replace(
    PLATES.changed(friction=0),
    body2=replace(PLATES.body2, parts={"half": HALF}, prescribed={"half": PLATES.body2.prescribed["top"]}),
)

#: Steps for which the snippets leave room, twice.
ROOM_FOR = 50

#: What CoSimulation prints once in each iteration.
ITERATION = "Coupling iteration:"


def coupled(folder, problem, theta, method="constant", accelerator=None, **members):
    """What Kratos prints of a coupling with the roles of a problem, its models and its snippet."""
    pair = vf.build(problem)
    scheme = CouplingScheme(neumann_body=pair.neumann_body, theta=theta, steps=ROOM_FOR, tied=pair.friction > 0)
    return kratos_models.run(
        kratos_models.written(folder, pair, snippet("Kratos", scheme, method), accelerator, **members)
    )


def predicted(problem):
    """The rows of the table for the roles of a problem, by method."""
    rows = vf.advise(problem, tied=problem.contact.friction > 0).methods
    return {row.method: row for row in rows if row.neumann_body == problem.iteration.neumann_body}


#: The couplings on the page, and what was counted in Kratos there: by name and Neumann body, in the order of METHODS.
ON_PAGE = {"tied": PLATES, "contact without friction": PLATES.changed(friction=0)}
PAGE = (Path(__file__).parents[3] / "docs" / "coupling.md").read_text("utf-8")
COUNTED = ast.literal_eval(re.search(r"^counted = (\{.*?^\})$", PAGE, re.S | re.M)[1])


@needs_kratos
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("body", [1, 2])
@pytest.mark.parametrize("name", ON_PAGE)
def test_the_steps_of_the_page_are_those_that_Kratos_takes(tmp_path, name, body, method):
    problem = ON_PAGE[name].changed(neumann_body=body)
    row = predicted(problem)[method]
    printed = coupled(tmp_path, problem, row.theta, method)
    assert "CONVERGENCE WAS ACHIEVED" in printed
    counted = COUNTED[name]["Kratos"][body][METHODS.index(method)]
    assert abs(printed.count(ITERATION) - counted) <= 1  # by rounding a residual may miss the tolerance
    if name == "tied" or body == 1:
        assert printed.count(ITERATION) == pytest.approx(row.steps, rel=0.2)


@needs_kratos
@pytest.mark.parametrize("method", METHODS)
def test_Kratos_takes_the_steps_of_the_table_where_nodes_open(tmp_path, method):
    row = predicted(PRESSED)[method]
    printed = coupled(tmp_path, PRESSED, row.theta, method)
    assert "CONVERGENCE WAS ACHIEVED" in printed
    assert printed.count(ITERATION) == pytest.approx(row.steps, rel=0.2)


@needs_kratos
@pytest.mark.parametrize("body", [1, 2])
@pytest.mark.parametrize("problem", [PLATES, PRESSED], ids=["tied", "contact"])
def test_the_residuals_in_Kratos_are_those_of_this_project_and_its_log_is_read(tmp_path, problem, body):
    problem = problem.changed(neumann_body=body)
    theta = round(predicted(problem)["constant"].theta, 4)
    log = tmp_path / "screen.log"
    log.write_text(coupled(tmp_path, problem, theta), "utf-8")
    (column,) = read_log(log).columns
    (window,) = column.windows
    pair = vf.build(problem)
    own, _ = (tied_run if pair.friction else contact_run)(pair, theta, len(window))
    assert len(window) > 6
    assert math.sqrt(pair.neumann.grid.size) * window == pytest.approx(own, rel=column.digits)
    assert advise_logs([(log, theta)], tied=pair.friction > 0).logs[0].form == "Kratos CoSimulation"


def test_some_contact_nodes_of_the_pressed_half_are_open_and_some_closed():
    assert vf.solve(PRESSED).contact.pattern == {"stick": 0, "slip": 9, "open": 4}


@needs_kratos
@pytest.mark.parametrize("rule", ["constant", "iqn-ils"])
def test_our_accelerator_takes_the_steps_of_the_table_and_prints_the_eigenvalues(tmp_path, rule):
    problem = PLATES.changed(neumann_body=2)
    row = predicted(problem)[rule]
    ours = {"type": "verification.coupling.kratos", "rule": rule, "theta": row.theta, "echo_level": 4}
    printed = coupled(tmp_path, problem, row.theta, accelerator=ours)
    assert printed.count(ITERATION) == pytest.approx(row.steps, rel=0.2)
    if rule == "constant":
        assert printed.count(ITERATION) == coupled(tmp_path, problem, row.theta).count(ITERATION)
    (shown,) = re.findall(r"CouplingConvergenceAccelerator: Advice.*?largest lambda, rho +([\d.]+)", printed, re.S)
    assert float(shown) == pytest.approx(vf.advise(problem).roles[0].rho_tied.value, rel=0.05)


@needs_kratos
def test_the_vectors_that_Kratos_writes_by_the_block_of_the_page_give_theta(tmp_path, monkeypatch, capsys):
    problem = PLATES.changed(neumann_body=2)
    operations = json.loads(re.search(r"```json\n(\{\n  \"coupling_operations.*?)```", PAGE, re.S)[1])
    code = re.search(r"```python\n(import meshio\n.*?)```", PAGE, re.S)[1]
    coupled(tmp_path, problem, predicted(problem)["aitken"].theta, "aitken", **operations)
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "page", "exec"), {})
    assert main(["advise", "vectors", "X.npy", "TX.npy", "--tied", "--json"]) == 0
    found = vf.advise_vectors(np.load("X.npy"), np.load("TX.npy"), tied=True)
    assert json.loads(capsys.readouterr().out)["theta"] == found.theta
    role = next(role for role in vf.advise(problem, tied=True).roles if role.neumann_body == 2)
    ends = role.rho_min.value, role.rho_tied.value
    assert (found.spectrum.low, found.spectrum.high) == pytest.approx(ends, rel=0.25)
    assert steps(role.spectrum, "constant", found.theta) <= 1.4 * steps(role.spectrum, "constant", role.theta_tied)
