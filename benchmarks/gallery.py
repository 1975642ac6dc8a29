"""Contact problems with answers from elsewhere, on lines of any shape: problem file, mesh, answer and error over h.

``python benchmarks/gallery.py`` prints the table, ``--record FILE`` keeps it for the page docs/curved_contact.md, and
``--write FOLDER`` writes each problem as a file with its meshes, which any command takes.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import meshio
import numpy as np

import verification as vf
from ndtheory import __version__

Floats = np.ndarray
Answer = Callable[["vf.Problem", Any], float]

#: Both bodies have this Poisson ratio.
POISSON = 0.3

#: Half the width of a Hertz contact is about this part of the radius.
HERTZ = 0.03


# --- meshes -----------------------------------------------------------------------------------------------------------


def write_mesh(path: Path, corners: Floats) -> None:
    """Quadrilaterals with these corners, shape (n, m, 2), each split by both diagonals, as a Gmsh file.

    Sides: ``left`` and ``right`` at the first and the last row, ``bottom`` and ``top`` at the ends of each.
    """
    n, m = corners.shape[:2]
    node = np.arange(n * m).reshape(n, m)
    a, b, c, d = node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]
    middle = n * m + np.arange(a.size).reshape(a.shape)
    centres = (corners[:-1, :-1] + corners[1:, :-1] + corners[1:, 1:] + corners[:-1, 1:]) / 4
    points = np.concatenate([corners.reshape(-1, 2), centres.reshape(-1, 2)])
    cells = np.concatenate(
        [np.stack([*ends, middle], axis=-1).reshape(-1, 3) for ends in ((a, b), (b, c), (c, d), (d, a))]
    )
    sides = {"left": node[0], "right": node[-1], "bottom": node[:, 0], "top": node[:, -1]}
    lines = [np.column_stack([line[:-1], line[1:]]) for line in sides.values()]
    tags = [np.concatenate([np.full(len(line), i) for i, line in enumerate(lines, 1)]), np.full(len(cells), 9)]
    meshio.write(
        path,
        meshio.Mesh(
            np.pad(points, ((0, 0), (0, 1))),
            [("line", np.concatenate(lines)), ("triangle", cells)],
            cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
            field_data={name: np.array([i, 1]) for i, name in enumerate(sides, 1)},
        ),
        file_format="gmsh22",
        binary=False,
    )


def between(x: Floats, t: Floats, low: Callable[[Floats], Floats], high: Callable[[Floats], Floats]) -> Floats:
    """Corners between two curves y = low(x) and y = high(x), at the parts t of the height."""
    y = low(x)[:, None] * (1 - t) + high(x)[:, None] * t
    return np.stack([np.broadcast_to(x[:, None], y.shape), y], axis=-1)


def ring(radii: Floats, angles: Floats) -> Floats:
    """Corners of a sector of a ring."""
    return np.stack([np.outer(radii, np.cos(angles)), np.outer(radii, np.sin(angles))], axis=-1)


def graded(fine: float, cells: int, end: float) -> Floats:
    """Positions from 0 to ``end``: equal cells up to ``fine``, then each a fifth longer than the one before."""
    widths = fine / cells * 1.2 ** np.arange(1, 200)
    beyond = np.cumsum(widths)
    beyond = beyond[: int(np.searchsorted(beyond, end - fine)) + 1]
    return np.concatenate([np.linspace(0, fine, cells + 1), fine + beyond * (end - fine) / beyond[-1]])


def nearest(x: Floats, position: float) -> str:
    """The position of the node nearest to a place, a little enlarged so that its edge is part of a side."""
    return repr(float(x[np.argmin(np.abs(x - position))]) * (1 + 1e-12))


# --- problems ---------------------------------------------------------------------------------------------------------


def body(path: Path, corners: Floats, young: float, **more: Any) -> dict[str, Any]:
    """A body of a problem file, its mesh written."""
    write_mesh(path, corners)
    return {"mesh": str(path), "young": young, "poisson": str(POISSON), **more}


def part(side: str, x: Floats, reach: float, *, half: bool = False) -> dict[str, Any]:
    end = nearest(x, reach)
    return {"side": side, "x": ["-0.001" if half else f"-{end}", end]}


def hertz(
    folder: Path, n: int, *, lower: float | None = None, contact: int = 2, half: bool = False, push: str = "-0.0016"
) -> vf.Problem:
    """A cylinder of radius 1 above a plane, or above a surface of radius ``lower``: hollow if positive, else round.

    n cells along half the width of contact, for the upper body; five sixths of them for the lower one, except in half a
    model, where supports hold the ends of both lines and one grid serves both.
    """
    arc = lambda r: (lambda x: 0 * x) if r is None else (lambda x: r - np.sign(r) * np.sqrt(r * r - x * x))
    found: list[dict[str, Any]] = []
    for i, (cells, low, high) in enumerate(
        ((n if half else 5 * n // 6, lambda x: 0 * x - 0.5, arc(lower)), (n, arc(1.0), lambda x: 0 * x + 0.5))
    ):
        x = graded(1.6 * HERTZ, 8 * cells // 5, 0.5)
        t = x / 0.5
        across = x if half else np.concatenate([-x[:0:-1], x])
        reach = (1.6 if i + 1 == contact else 3) * HERTZ
        corners = between(across, t if i else 1 - t[::-1], low, high)
        parts = {"facing": part("bottom" if i else "top", x, reach, half=half)}
        path = folder / f"{'upper' if i else 'lower'}.msh"
        found.append(body(path, corners, 1e5 if i else 2e5, parts=parts))
    axis = {"left": [0, "free"]} if half else {}
    found[0] |= {"prescribed": {"bottom": [0, 0]} | axis}
    found[1] |= {"prescribed": {"top": [0, push]} | axis}
    return vf.Problem.from_dict(
        {
            "title": "Hertz",
            "body1": found[0],
            "body2": found[1],
            "contact": {"surface": ["facing", "facing"]},
            "iteration": {"neumann_body": 3 - contact, "theta": "auto"},
        }
    )


def stiffness(problem: vf.Problem) -> float:
    """E* of both bodies: ``1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2``."""
    return 1 / sum((1 - float(b.poisson) ** 2) / float(b.young) for b in (problem.body1, problem.body2))


def of_hertz(lower: float | None = None, *, half: bool = False) -> Answer:
    """The largest error of pressure within 0.8 a, over p_0: a and p_0 are those of the force that is found."""

    def error(problem: vf.Problem, contact: Any) -> float:
        radius, E = 1 / (1 - (0 if lower is None else 1 / lower)), stiffness(problem)
        force = (1 + half) * contact.to_dict()["force"]["vector"][1]
        a, p0 = np.sqrt(4 * force * radius / np.pi / E), np.sqrt(force * E / np.pi / radius)
        inner = np.abs(contact.x) <= 0.8 * a
        return float(np.abs(contact.pressure - p0 * np.sqrt(np.maximum(1 - (contact.x / a) ** 2, 0)))[inner].max() / p0)

    return error


def ramp(folder: Path, n: int) -> vf.Problem:
    """A body on a ramp of slope -0.3, pushed down without friction; n cells along a length of 1."""
    slope, t = lambda x: -0.3 * x, np.linspace(0, 1, n + 1)
    low = between(np.linspace(-1, 1, 2 * n + 1), t, lambda x: 0 * x - 1, slope)
    up = between(np.linspace(-0.8, 0.8, 8 * n // 5 + 1), t, slope, lambda x: 0 * x + 1)
    return vf.Problem.from_dict(
        {
            "title": "A ramp",
            "body1": body(folder / "lower.msh", low, 7e4, fixed=["bottom"]),
            "body2": body(folder / "upper.msh", up, 2e4, prescribed={"top": [0, "-0.01"]}),
            "contact": {"surface": ["top", "bottom"]},
            "iteration": {"neumann_body": 1, "theta": "auto"},
        }
    )


def of_the_ramp(problem: vf.Problem, contact: Any) -> float:
    """Distance of the force on the upper body to (69.2, 230.7), relative to its size."""
    known = np.array([69.2, 230.7])
    return float(np.linalg.norm(contact.to_dict()["force"]["vector"] - known) / np.linalg.norm(known))


#: Radii of two rings that are pressed into each other, and by how much the outer one is too small.
RADII, INTERFERENCE = (1.0, 2.0, 3.0), 0.002


def press_fit(folder: Path, n: int) -> vf.Problem:
    """A quarter of two rings, the outer one too small; n cells along each quarter."""
    inner, middle, outer = RADII
    angles, held = np.linspace(0, np.pi / 2, n + 1), {"bottom": ["free", 0], "top": [0, "free"]}
    one = ring(np.linspace(inner, middle + INTERFERENCE / 2, n // 2 + 1), angles)
    two = ring(np.linspace(middle - INTERFERENCE / 2, outer, n // 2 + 1), angles)
    return vf.Problem.from_dict(
        {
            "title": "A press fit",
            "body1": body(folder / "inner.msh", one, 2e5, prescribed=held),
            "body2": body(folder / "outer.msh", two, 1e5, prescribed=held),
            "contact": {"surface": ["right", "left"]},
            "iteration": {"neumann_body": 1, "theta": "auto"},
        }
    )


def of_lame(problem: vf.Problem, contact: Any) -> float:
    """The largest error of the pressure against Lame's solution of both rings, relative."""
    a, b, c = RADII
    nu = POISSON / (1 - POISSON)  # of plane strain, as E below
    inner, outer = (float(part.young) / (1 - POISSON**2) for part in (problem.body1, problem.body2))
    grows = b / outer * ((c * c + b * b) / (c * c - b * b) + nu)
    shrinks = b / inner * ((b * b + a * a) / (b * b - a * a) - nu)
    pressure = INTERFERENCE / (grows + shrinks)
    return float(np.abs(contact.pressure / pressure - 1).max())


def punch(folder: Path, n: int) -> vf.Problem:
    """A stiff flat punch of width 2 on a large block; n cells along half of it, finer towards its edge."""
    half = 1 - graded(0.1, n // 2, 1.0)[::-1]
    beyond = 1 + graded(0.1, n // 2, 19.0)[1:]
    x, depth = np.concatenate([-half[:0:-1], half]), graded(0.1, n // 2, 20.0) / 20
    wide = np.concatenate([-beyond[::-1], x, beyond])
    block = between(wide, 1 - depth[::-1], lambda x: 0 * x - 20, lambda x: 0 * x)
    above = between(x, graded(0.1, n // 2, 1.0), lambda x: 0 * x, lambda x: 0 * x + 1)
    return vf.Problem.from_dict(
        {
            "title": "A flat punch",
            "body1": body(folder / "block.msh", block, 1e3, fixed=["bottom"], parts={"under": part("top", wide, 1.0)}),
            "body2": body(folder / "punch.msh", above, 1e9, prescribed={"top": [0, "-0.01"]}),
            "contact": {"surface": ["under", "bottom"]},
            "iteration": {"neumann_body": 2, "theta": "auto"},
        }
    )


def of_the_punch(problem: vf.Problem, contact: Any) -> float:
    """The largest error of pressure for |x| <= 0.8 against ``P/(pi sqrt(1 - x^2))``, relative to that in the middle."""
    force = contact.to_dict()["force"]["vector"][1]
    inner = np.abs(contact.x) <= 0.8
    known = force / np.pi / np.sqrt(1 - contact.x[inner] ** 2)
    return float(np.abs(contact.pressure[inner] - known).max() * np.pi / force)


#: Plates of a stack: ends in y, Young's modulus, Poisson ratio, columns of cells as a multiple of n.
STACK = ((0.0, 1.0, 2e4, 0.3, 2), (1.0, 1.5, 7e4, 0.1, 3), (1.5, 3.0, 1e4, 0.45, 1))


def stack(folder: Path, n: int) -> vf.Problem:
    """Three plates pressed together without friction, each held by a roller at its left side."""
    ends = ({"bottom": ["free", 0]}, {}, {"top": ["free", "-0.01"]})
    data: dict[str, Any] = {}
    for i, ((low, high, young, poisson, times), more) in enumerate(zip(STACK, ends, strict=True), 1):
        middle = [str((3 * low + high) / 4), str((low + 3 * high) / 4)]
        data[f"body{i}"] = {
            "shape": "rectangle",
            "x": [0, 2],
            "y": [str(low), str(high)],
            "cells": [times * n, n],
            "young": str(young),
            "poisson": str(poisson),
            "parts": {"roller": {"side": "left", "y": middle}},
            "prescribed": {"roller": [0, "free"]} | more,
        }
    touch = {"surface": ["top", "bottom"], "friction": 0, "radius": 1}
    contacts = [{"bodies": [1, 2]} | touch, {"bodies": [2, 3]} | touch]
    iteration = {"neumann_bodies": [1, 3], "theta": "auto"}
    return vf.Problem.from_dict(data | {"title": "A stack of three", "contact": contacts, "iteration": iteration})


def of_the_stack(problem: vf.Problem, contact: Any) -> float:
    """The largest error of pressure against springs in series: the stress is uniaxial, and plane strain."""
    exact = 0.01 / sum((high - low) * (1 - nu**2) / young for low, high, young, nu, _ in STACK)
    return float(np.abs(contact.pressure / exact - 1).max())


@dataclass(frozen=True, kw_only=True)
class Entry:
    """A problem of the gallery.

    Attributes
    ----------
    make : callable
        From a folder and a number of cells to a problem.
    error : callable
        From a problem and its fields along Gamma_c to an error, relative.
    cells : tuple of int
        Of meshes that are halved.
    allowed : float
        The error that the finest one may have.
    source : str
        Where the answer comes from.
    """

    title: str
    make: Callable[[Path, int], vf.Problem]
    error: Answer
    cells: tuple[int, ...]
    allowed: float
    source: str


JOHNSON = "Johnson, Contact Mechanics (1985), section 4.2"
GALLERY: Mapping[str, Entry] = {
    **{
        f"{name}-{role}": Entry(
            title=f"{words}; contact body {role}",
            make=lambda folder, n, lower=lower, role=role, push=push: hertz(
                folder, n, lower=lower, contact=role, push=push
            ),
            error=of_hertz(lower),
            cells=(6, 12, 24),
            allowed=0.005,
            source=JOHNSON,
        )
        for name, words, lower, push in (
            ("cylinder-on-plane", "a cylinder on a plane", None, "-0.0014"),
            ("cylinder-in-groove", "a cylinder in a groove, radii 1 and 1.25", 1.25, "-0.0003"),
            ("two-cylinders", "two cylinders, radii 1 and 1.5", -1.5, "-0.0022"),
        )
        for role in (1, 2)
    },
    "half-model": Entry(
        title="half of the cylinder on a plane",
        make=lambda folder, n: hertz(folder, n, half=True, contact=1, push="-0.0014"),
        error=of_hertz(half=True),
        cells=(6, 12, 24),
        allowed=0.005,
        source=JOHNSON,
    ),
    "ramp": Entry(
        title="a ramp without friction: the force",
        make=ramp,
        error=of_the_ramp,
        cells=(5, 10, 20),
        allowed=0.01,
        source="an independent code",
    ),
    "press-fit": Entry(
        title="a press fit of two rings",
        make=press_fit,
        error=of_lame,
        cells=(12, 24, 48),
        allowed=0.005,
        source="Lame's solution for thick rings, in plane strain",
    ),
    "flat-punch": Entry(
        title="a flat punch",
        make=punch,
        error=of_the_punch,
        cells=(8, 16, 32),
        allowed=0.03,
        source="Johnson, section 2.8: P/(pi sqrt(a^2 - x^2))",
    ),
    "stack": Entry(
        title="a stack of three plates without friction",
        make=stack,
        error=of_the_stack,
        cells=(4, 8, 16),
        allowed=1e-10,
        source="springs in series: uniaxial stress",
    ),
}


@dataclass(frozen=True, kw_only=True)
class Row:
    """What an entry shows: errors over h, and on the coarsest mesh rho and theta of its roles."""

    name: str
    title: str
    source: str
    cells: tuple[int, ...]
    errors: tuple[float, ...]
    rho: float | None
    theta: float | None
    neumann_body: int


def shown(name: str) -> Row:
    """Solve the meshes of an entry."""
    entry = GALLERY[name]
    errors, rho, theta, role = [], None, None, 0
    for cells in entry.cells:
        with tempfile.TemporaryDirectory() as folder:
            problem = entry.make(Path(folder), cells)
            errors.append(entry.error(problem, vf.solve(problem).contact))
            if rho is None:
                role = problem.iteration.neumann_body
                found = next(one for one in vf.advise(problem).roles if one.neumann_body == role)
                rho = None if found.rho is None else found.rho.value
                theta = None if found.theta_predicted is None else float(found.theta_predicted)
    return Row(
        name=name,
        title=entry.title,
        source=entry.source,
        cells=entry.cells,
        errors=tuple(errors),
        rho=rho,
        theta=theta,
        neumann_body=role,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--record", type=Path)
    parser.add_argument("--write", type=Path)
    given = parser.parse_args()
    if given.write:
        for name, entry in GALLERY.items():
            folder = given.write / name
            folder.mkdir(parents=True, exist_ok=True)
            problem = entry.make(folder, entry.cells[0])
            (folder / "problem.toml").write_text(problem.to_toml(), "utf-8")
        return
    rows = [shown(name) for name in GALLERY]
    for row in rows:
        errors = ", ".join(f"{100 * error:.2g} %" for error in row.errors)
        print(f"{row.title:55} {errors:28} rho {row.rho}, theta {row.theta}")
    if given.record:
        document = {"version": __version__, "rows": [asdict(row) for row in rows]}
        given.record.write_text(json.dumps(document, indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main()
