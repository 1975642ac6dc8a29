"""Numbers and figures of the paper: ``python docs/paper/compute.py FOLDER`` writes numbers.json and the figures there.

The source paper.typ reads each computed number by its name.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import verification as vf
from ndtheory.number import directed
from verification.certificate.continuum import certify_continuum
from verification.constants.cells import halved_cells, rho_of_cells
from verification.figures import draw_region, draw_waterfall, save
from verification.figures.style import BODIES, new_figure, styled
from verification.free_norm.norm import FreeNorm, friction_threshold
from verification.free_norm.two_layers import two_layers
from verification.sweeps.region import chart

Numbers = dict[str, Any]

#: Relaxation factors at which the bounds are compared with what is attained and seen.
THETAS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)

#: How often meshes are halved.
HALVINGS = 3

#: Digits of an enclosed number, rounded outwards.
DIGITS = 11


def exchanged() -> vf.Problem:
    """Section 6 without friction, with moduli exchanged and cells of the upper body twice as high as wide."""
    return vf.example("section6").changed(young=(20000, 70000), friction=0, cells=((40, 6), (24, 3)))


def values(document: Numbers, *names: str) -> Numbers:
    """Entries of a document; of an object only its value."""
    return {name: entry["value"] if isinstance(entry := document[name], dict) else entry for name in names}


def chain(document: Numbers) -> Numbers:
    """Constants, allowed friction and factors of each bound, and what the run showed."""
    editions, energy, lmi, run = document["bounds"]["editions"], document["energy"], document["lmi"], document["run"]
    constants = values(
        document["constants"], "m", "M", "C_R", "C_s", "C_tr", "C_s_energy", "C_t1", "C_t2", "rho_max", "rho_normal",
        "kappa_1", "kappa_2", "interface_nodes",
    )  # fmt: skip
    return constants | {
        "nodes": sum(document["constants"][body]["nodes"] for body in ("body1", "body2")),
        "k_printed": editions["printed"]["C2"]["value"],
        "k_repaired": editions["repaired"]["C2"]["value"],
        "k_energy": energy["friction_threshold"]["value"],
        "k_lmi": lmi["friction_threshold"]["value"],
        "factor_energy": energy["factor"]["value"],
        "factor_lmi": lmi["factor"]["value"],
        "attained": lmi["lower"],
        "theta_max": energy["theta_max_proved"]["value"],
        "theta_predicted": energy["theta_predicted"],
        **values(run, "linearised_rate", "linearised_norm", "observed_rate", "iterations"),
        "cvxpy_difference": document["cvxpy"]["largest_difference"],
    }


def other_unit() -> Numbers:
    """The friction that the printed and the repaired theorem allow if moduli are given in GPa."""
    document = vf.compare(vf.example("section6").changed(young=(70, 20)), bounds=("printed", "repaired")).to_dict()
    return {name: document["bounds"]["editions"][name]["C2"]["value"] for name in ("printed", "repaired")}


def lost(losses: Numbers) -> Numbers:
    """Powers of ten from the largest terms found to their bounds, and the part that only the unit adds."""
    adds = lambda chain, unit: sum(loss["decades"] for loss in losses[chain] if loss["only_unit"] == unit)
    return {"friction": adds("friction", False), "lipschitz": adds("lipschitz", False), "unit": adds("friction", True)}


def factors() -> list[Numbers]:
    """Bounds of the factor of a step, the largest factor found and the observed rate, by theta."""
    rows = []
    for theta in THETAS:
        found = vf.compare(vf.example("section6"), theta=theta, bounds=("energy", "lmi")).to_dict()
        free = of_section_6(0.2).factor(theta)
        rows.append({
            "theta": theta,
            "free": None if free is None else free.factor,
            **{name: (found[name]["factor"] or {"value": None})["value"] for name in ("energy", "lmi")},
            "attained": found["lmi"]["lower"],
            "observed": found["run"]["observed_rate"] if found["run"]["converged"] else None,
        })  # fmt: skip
    return rows


def of_section_6(k: float, halvings: int = 0) -> FreeNorm:
    """The free norm of Section 6 at a friction, on its mesh or a halved one."""
    pair = vf.build(vf.example("section6").refined(halvings).changed(friction=str(k)))
    return FreeNorm(pair, vf.measure(pair))


def free_norm() -> Numbers:
    """Section 6 in a free norm: proved on its mesh, on finer ones, and of the layers that contain its bodies."""
    proved = vf.certify(vf.example("section6"), theta="0.7", edition="lyapunov")
    assert vf.check_again(proved.to_dict()).accepted
    fine = [of_section_6(0.2, halvings).factor(0.7) for halvings in range(HALVINGS)]
    rough = of_section_6(0.9)
    pair = vf.build(vf.example("section6"))
    measured = vf.measure(pair)
    layers = two_layers(
        young=(70000, 20000), poisson=("0.3", "0.3"), depth=("0.3", "0.3"), friction="0.2", radius="0.1", theta="0.7",
        verified=True,
    ).roles[0]  # fmt: skip
    assert layers.energy.factor is not None
    return {
        "factor": float(proved.factor),
        "condition": float(Fraction(proved.claim["norm"]["condition"])),
        "bits": proved.claim["bits"],
        "radius": proved.lower,
        "fine": [found.factor for found in fine if found is not None],
        "rough": [found.factor for found in (rough.factor(0.6), rough.factor(0.8)) if found is not None],
        "k": friction_threshold(pair, measured, measured.friction_threshold.value)[0],
        "layers": {
            "factor": layers.lyapunov.factor.hi,
            "energy": layers.energy.factor.hi,
            "k": layers.lyapunov.friction_threshold.lo,
        },
    }


def halved(problem: vf.Problem, *names: str) -> list[Numbers]:
    """Constants of a problem on its mesh and on the halved ones."""
    meshes = [problem.refined(halvings) for halvings in range(HALVINGS + 1)]
    return [values(vf.measure(mesh).to_dict(), *names) for mesh in meshes]


def cells() -> Numbers:
    """The spectrum of the cells beside that of meshes and of the continuum."""
    problem = exchanged()
    enclosed = rho_of_cells(problem, verified=True).numbers
    ends = {
        name: [directed(number.lo, DIGITS, up=False), directed(number.hi, DIGITS, up=True)]
        for name, number in enclosed.items()
    }
    limit = 2 / (1 + enclosed["rho_normal_cells"].value)
    theta = Fraction("0.43")
    runs = {}
    for name, chosen in (("above", theta), ("below", Fraction("0.3"))):
        run = vf.run(problem, theta=chosen)
        runs[name] = {"theta": float(chosen), "outcome": str(run.outcome), "iterations": run.iterations}
    return {
        "meshes": halved(problem, "interface_nodes", "rho_max", "rho_normal"),
        "enclosed": {name: list(map(str, both)) for name, both in ends.items()},
        "theta_limit": limit,
        "runs": runs,
    }


def continuum() -> Numbers:
    """What is proved of Section 6 without a mesh."""
    document = certify_continuum(vf.example("section6")).to_dict()
    return values(document["constants"], "rho", "rho_normal", "C_s", "C_t1", "C_t2", "kappa_1", "kappa_2") | {
        "friction_threshold": document["friction_threshold"]["value"],
        "theta_max": document["theta_max_proved"]["value"],
        "free": values(document["free_norm"], "friction_threshold", "factor"),
    }


def certificate() -> Numbers:
    """The factor that the checker accepts for Section 6, its pieces divided into sets."""
    proved = vf.certify(vf.example("section6"), theta="0.7", exact=True)
    assert vf.check_again(proved.to_dict()).accepted
    sets = lambda tree: sum(map(sets, tree["cases"])) if "cases" in tree else 1
    return {
        "factor": float(proved.factor),
        "attained": proved.lower,
        "bits": proved.claim["bits"],
        "sets": sets(proved.claim["multipliers"]),
    }


def draw_factors(rows: list[Numbers]) -> Figure:
    """Bounds, the largest factor found and observed rates over theta."""
    with styled():
        figure = new_figure(5.2, 3.0)
        ax = figure.subplots()
        column = lambda name: [np.nan if row[name] is None else row[name] for row in rows]
        looks = {
            "energy": ("bound in energy norms", "-", BODIES[1]),
            "lmi": ("semidefinite bound", "--", BODIES[0]),
            "free": ("free norm", "-.", "#7A2E8C"),
            "attained": ("largest factor found", ":", "black"),
        }
        for name, (label, line, colour) in looks.items():
            ax.plot(column("theta"), column(name), line, color=colour, label=label)
        ax.plot(column("theta"), column("observed"), "o", color="0.4", markersize=4, label="observed rate")
        ax.set(xlabel="relaxation factor theta", ylabel="factor of a step", xlim=(0, 1), ylim=(0, 1.1))
        ax.legend(loc="lower left")
    return figure


def draw_symbol(meshes: list[Numbers]) -> Figure:
    """The largest ratio of stiffness over the wave number, for two kinds of cells, and rho_N on meshes."""
    phases = np.linspace(1e-3, np.pi, 200)  # per period of two columns
    tall = halved_cells(exchanged())
    square = replace(tall, contact=replace(tall.contact, aspect=tall.neumann.aspect))
    with styled():
        figure = new_figure(6.4, 2.8)
        left, right = figure.subplots(1, 2)
        for name, interface, line in (("cells 1:2 on square cells", tall, "-"), ("square cells on both", square, "--")):
            left.plot(phases / 2, interface.ratios(phases)[1], line, color=BODIES[0], label=name)
        left.axhline(3.5, linestyle=":", color="0.4", label="continuum")
        left.set(xlabel="wave number per column", ylabel="ratio of normal stiffness", ylim=(3, 5.5))
        left.legend(loc="upper left")
        nodes = [mesh["interface_nodes"] for mesh in meshes]
        right.plot(nodes, [mesh["rho_normal"] for mesh in meshes], "o-", color=BODIES[1], label="meshes")
        right.axhline(rho_of_cells(exchanged()).numbers["rho_normal_cells"].value, color=BODIES[0], label="cells")
        right.axhline(3.5, linestyle=":", color="0.4", label="continuum")
        right.set(xlabel="contact nodes", ylabel="rho_N", xscale="log", ylim=(3, 5.5))
        right.set_xticks(nodes, labels=list(map(str, nodes)))
        right.set_xticks([], minor=True)
        right.legend(loc="upper left")
    return figure


def write(folder: Path) -> None:
    """Compute everything and write it."""
    folder.mkdir(parents=True, exist_ok=True)
    compared = vf.compare(vf.example("section6"))
    document = compared.to_dict()
    assert compared.losses is not None
    found = {
        "chain": chain(document),
        "other_unit": other_unit(),
        "lost": lost(document["losses"]),
        "factors": factors(),
        "meshes": halved(vf.example("section6"), "interface_nodes", "rho_max", "C_s_energy", "kappa_1", "kappa_2"),
        "cells": cells(),
        "continuum": continuum(),
        "certificate": certificate(),
        "free": free_norm(),
    }
    (folder / "numbers.json").write_text(json.dumps(found, indent=1), encoding="utf-8")
    save(draw_waterfall(compared.losses, "MPa"), folder / "losses.svg")
    save(draw_region(chart(vf.example("section6"))), folder / "region.svg")
    save(draw_factors(found["factors"]), folder / "factors.svg")
    save(draw_symbol(found["cells"]["meshes"]), folder / "symbol.svg")


if __name__ == "__main__":
    write(Path(sys.argv[1]))
