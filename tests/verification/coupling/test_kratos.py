"""Couplings of two structural models in Kratos: residuals are those of this project, counts those of the table."""

import ast
import json
import math
import re
from dataclasses import replace
from fractions import Fraction
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import kratos_runs
import meshio
import numpy as np
import pytest
from coupling_logs import contact_run, tied_run
from kratos_models import PLATES, coupled
from kratos_runs import ITERATION

import verification as vf
from verification.cli import main
from verification.coupling.from_logs import advise_logs
from verification.coupling.log_files import read_log
from verification.coupling.methods import METHODS, steps
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

#: Half of the top is pressed, without friction: some contact nodes open.
HALF = SidePart(side="top", x=(Fraction(2, 5), Fraction(1)))
PRESSED = replace(
    PLATES.changed(friction=0),
    body2=replace(PLATES.body2, parts={"half": HALF}, prescribed={"half": PLATES.body2.prescribed["top"]}),
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


@needs_kratos
@pytest.mark.parametrize("name", kratos_runs.RUNS)
def test_the_runs_of_the_page_take_the_iterations_of_their_logs(tmp_path, name):
    printed = kratos_runs.cut(kratos_runs.printed(tmp_path, name))
    logged = (kratos_runs.LOGS / f"{name}.log").read_text("utf-8")
    assert abs(printed.count(ITERATION) - logged.count(ITERATION)) <= 1  # by rounding a residual may miss the tolerance
    assert ("CONVERGENCE WAS ACHIEVED" in printed) == ("CONVERGENCE WAS ACHIEVED" in logged)
    first = lambda text: re.search(r"abs-norm = (\S+)", text)[1]
    assert first(printed) == first(logged)


@needs_kratos
@pytest.mark.parametrize("names", [("before", "after"), ("contact-before", "contact-after")], ids=str)
def test_both_assignments_of_the_roles_end_at_the_same_forces(tmp_path, names):
    forces = []
    for name in names:
        (folder := tmp_path / name).mkdir()
        body = kratos_runs.RUNS[name][1]["neumann_body"]
        output = {
            "model_part_name": "Structure.Interface",
            "output_path": "vectors",
            "file_format": "ascii",
            "output_precision": 9,
            "nodal_solution_step_data_variables": ["POINT_LOAD"],
        }
        operation = {
            "type": "coupling_output",
            "solver": f"Body{body}",
            "execution_point": "finalize_coupling_iteration",
            "output_parameters": output,
        }
        printed = kratos_runs.printed(folder, name, coupling_operations={"forces": operation})
        last = f"Body{body}_Structure.Interface_finalize_coupling_iteration_0_1_{printed.count(ITERATION)}.vtk"
        found = meshio.read(folder / "vectors" / last)
        forces.append(found.point_data["POINT_LOAD"][np.argsort(found.points[:, 0]), :2])
    assert np.linalg.norm(forces[0] + forces[1]) < 1e-5 * np.linalg.norm(forces[0])  # action and reaction
