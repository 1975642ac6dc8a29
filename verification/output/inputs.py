"""Files for every command that reads one: problems, matrices, and what a run shows and logs."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from verification.algorithm.runs import run
from verification.interface.pair import pair_from
from verification.ledger.cases import write
from verification.output.files import check_folder, staged
from verification.problem.examples import example, examples
from verification.problem.tables import ProblemError

#: The files, each with what it holds.
INPUTS = {
    "my.toml": "the plates of Section 6",
    "history.toml": "two plates with a loading history",
    "grid.toml": "a sweep of my.toml over theta and friction",
    "model.msh": "the meshes of both plates of my.toml",
    "S1.npy": "interface matrix of the lower plate of my.toml",
    "S2.npy": "interface matrix of the upper one",
    "convergence.log": "residuals of a run of my.toml with theta = 0.5 and no friction, as preCICE writes them",
    "X.npy": "nodal forces before each step of this run, one row a step",
    "TX.npy": "what both solvers made of them",
}

GRID = """\
problem = "my.toml"

[grid]
theta = [0.4, 0.6]
friction = [0.1, 0.2]
"""


def write_inputs(folder: Path) -> None:
    """Write the files of :data:`INPUTS` into a folder.

    Raises
    ------
    ProblemError
        The folder cannot be written to, or a file of one of these names has another content.
    """
    check_folder(folder, " (--inputs)")
    pair = pair_from(example("section6"))
    made, built_in = run(pair_from(example("section6").changed(friction=0)), theta="0.5"), examples()
    log = ["  TimeWindow  Iteration  ResRel(Force)"]  # as preCICE writes convergence logs
    log += [f"{1:6d}  {each.iteration + 1:6d}  {each.relative_residual:16.8e}" for each in made.iterates]
    texts = {"my.toml": built_in["section6"], "history.toml": built_in["history"], "grid.toml": GRID}
    texts["convergence.log"] = "\n".join(log)
    arrays = {f"S{i}": side.schur for i, side in enumerate(pair.along_y, 1)}
    arrays["X"], arrays["TX"] = (np.array(rows) for rows in zip(*((i.g, i.image) for i in made.iterates), strict=True))
    with staged(folder) as room:
        for name, text in texts.items():
            (room / name).write_text(text.rstrip() + "\n", encoding="utf-8")
        for name, array in arrays.items():
            np.save(room / f"{name}.npy", array)
        write(room / "model.msh", lower=pair.body1.loaded_body.mesh, upper=pair.body2.loaded_body.mesh)
        for name in INPUTS:
            there = folder / name
            if there.exists() and there.read_bytes() != (room / name).read_bytes():
                needed = "this file has another content: needed another folder (--inputs)"
                raise ProblemError(str(there), "", None, needed)
