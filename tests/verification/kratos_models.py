"""The two bodies of a problem as models of Kratos Multiphysics, and runs of their coupling in CoSimulation."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from processes import PATIENCE, environment

import verification as vf
from verification.coupling.snippets import CouplingScheme, snippet

#: The wrapper of a contact body, :mod:`kratos_contact`, is loaded from here.
HERE = Path(__file__).parent

#: With friction the models are tied, as the table of ``advise --tied`` has it.
PLATES = vf.example("section6").changed(cells=((20, 3), (12, 3)))


def mdpa(body) -> str:
    """The mesh of a body in the format of Kratos, with parts for its contact nodes and for its held nodes by value."""
    mesh, n = body.mesh, len(body.nodes)
    corners = mesh.cells.shape[1]
    lines = ["Begin Properties 1", "End Properties", "Begin Nodes"]
    lines += [f"{i} {x!r} {y!r} 0.0" for i, (x, y) in enumerate(mesh.points.astype(float).tolist(), 1)]
    lines += ["End Nodes", f"Begin Elements SmallDisplacementElement2D{corners}N"]
    lines += [f"{i} 1 " + " ".join(map(str, cell + 1)) for i, cell in enumerate(mesh.cells, 1)]
    lines += ["End Elements", "Begin Conditions PointLoadCondition2D1N"]
    lines += [f"{i} 1 {node + 1}" for i, node in enumerate(body.nodes, 1)]
    lines += ["End Conditions", "Begin SubModelPart Body", "Begin SubModelPartNodes"]
    lines += [str(i + 1) for i in range(len(mesh.points))]
    lines += ["End SubModelPartNodes", "Begin SubModelPartElements"]
    lines += [str(i + 1) for i in range(len(mesh.cells))]
    lines += ["End SubModelPartElements", "End SubModelPart"]
    lines += ["Begin SubModelPart Interface", "Begin SubModelPartNodes", *(str(node + 1) for node in body.nodes)]
    lines += ["End SubModelPartNodes", "Begin SubModelPartConditions", *(str(i + 1) for i in range(n))]
    lines += ["End SubModelPartConditions", "End SubModelPart"]
    for k, (_, _, nodes) in enumerate(supports(body)):
        lines += [f"Begin SubModelPart Held{k}", "Begin SubModelPartNodes", *(str(node + 1) for node in nodes)]
        lines += ["End SubModelPartNodes", "End SubModelPart"]
    return "\n".join(lines) + "\n"


def supports(body) -> list[tuple[list[bool], list[float], np.ndarray]]:
    """The components that are held, their values, and the nodes at which they are."""
    known = np.column_stack([body.known.held, body.known.values])
    held = known[:, :2].any(axis=1)
    kinds, which = np.unique(known[held], axis=0, return_inverse=True)
    nodes = np.flatnonzero(held)
    return [(kind[:2].astype(bool).tolist(), kind[2:].tolist(), nodes[which == k]) for k, kind in enumerate(kinds)]


def parameters(body, name: str, reads_displacements: bool) -> dict[str, Any]:
    """The project parameters of a body: a linear static analysis in plane strain."""
    process = lambda part, held, values: {
        "python_module": "assign_vector_variable_process",
        "kratos_module": "KratosMultiphysics",
        "Parameters": {
            "model_part_name": f"Structure.{part}",
            "variable_name": "DISPLACEMENT",
            "constrained": [*held, False],
            "value": [value if holds else None for value, holds in zip(values, held, strict=True)] + [None],
        },
    }
    processes = [process(f"Held{k}", held, values) for k, (held, values, _) in enumerate(supports(body))]
    if reads_displacements:
        processes.append(process("Interface", [True, True], [0.0, 0.0]))
    return {
        "problem_data": {
            "problem_name": name,
            "parallel_type": "OpenMP",
            "echo_level": 0,
            "start_time": 0.0,
            "end_time": 1.0,
        },
        "solver_settings": {
            "solver_type": "static",
            "model_part_name": "Structure",
            "domain_size": 2,
            "analysis_type": "linear",
            "model_import_settings": {"input_type": "mdpa", "input_filename": name},
            "material_import_settings": {"materials_filename": f"{name}_materials.json"},
            "time_stepping": {"time_step": 1.0},
            "move_mesh_flag": False,
            "linear_solver_settings": {"solver_type": "LinearSolversApplication.sparse_lu"},
        },
        "processes": {"constraints_process_list": processes},
    }


def material(body) -> dict[str, Any]:
    """The material of a body."""
    law = body.material
    young = law.lame_mu * (3 * law.lame_lambda + 2 * law.lame_mu) / (law.lame_lambda + law.lame_mu)
    constants = {"YOUNG_MODULUS": float(young), "POISSON_RATIO": body.poisson, "THICKNESS": 1.0}
    settings = {"constitutive_law": {"name": "LinearElasticPlaneStrain2DLaw"}, "Variables": constants}
    return {"properties": [{"model_part_name": "Structure", "properties_id": 1, "Material": settings}]}


def written(folder: Path, pair, snippet: str, accelerator: dict[str, Any] | None = None, **members: Any) -> Path:
    """The files of a coupling, with the parameters of CoSimulation as a snippet has them.

    The contact body of a frictionless pair may open; with friction the interface is tied.  ``accelerator`` replaces the
    convergence accelerator, ``members`` are further ones of ``solver_settings``.
    """
    settings = json.loads(snippet)
    settings["solver_settings"].update(members)
    solvers = settings["solver_settings"]["solvers"]
    for k, condensed in enumerate((pair.body1, pair.body2), 1):
        body, name = condensed.mesh_body, f"ProjectParametersBody{k}"
        reads_displacements = k == pair.contact_body
        (folder / f"{name}.mdpa").write_text(mdpa(body), "utf-8")
        (folder / f"{name}.json").write_text(json.dumps(parameters(body, name, reads_displacements)), "utf-8")
        (folder / f"{name}_materials.json").write_text(json.dumps(material(body)), "utf-8")
        if reads_displacements and not pair.friction:
            solvers[f"Body{k}"]["type"] = "kratos_contact"
    accelerators = settings["solver_settings"]["convergence_accelerators"]
    if accelerator:
        accelerators[0] = {"solver": accelerators[0]["solver"], "data_name": "force", **accelerator}
    file = folder / "cosim.json"
    file.write_text(json.dumps(settings, indent=2), "utf-8")
    return file


def run(file: Path) -> str:
    """What CoSimulation prints."""
    path = os.pathsep.join([str(HERE), str(HERE.parents[1])])
    env = environment(PYTHONPATH=path, OMP_NUM_THREADS="1")
    command = [sys.executable, "-m", "KratosMultiphysics.CoSimulationApplication.co_simulation_analysis", file.name]
    done = subprocess.run(command, cwd=file.parent, env=env, capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout


def coupled(folder, problem, theta, method="constant", accelerator=None, steps=50, **members) -> str:
    """What Kratos prints of a coupling with the roles of a problem, its models and its snippet.

    The snippet leaves room for twice the ``steps``.
    """
    pair = vf.build(problem)
    scheme = CouplingScheme(neumann_body=pair.neumann_body, theta=theta, steps=steps, tied=pair.friction > 0)
    return run(written(folder, pair, snippet("Kratos", scheme, method), accelerator, **members))
