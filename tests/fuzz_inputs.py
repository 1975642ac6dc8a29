"""Mutated problem files, meshes, matrices and option sets."""

from __future__ import annotations

import contextlib
import random
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from problem_list import SMALL, edited

from fem1d2d import Mesh, MeshError, from_file, rectangle
from fem1d2d.mesh import measures
from verification.cli.problems import examples

#: `SMALL` with nearly every key that a file may have.
PLANE = edited(
    SMALL.replace("\n\n", "\n"),
    {
        "body1.prescribed": "{}",
        "body1.traction": "{ right = [0.0, 0.0] }",
        "body2.fixed": "[]",
        "body2.traction": "{}",
        "body2.body_force": "[0.0, 0.0]",
        "contact.interval": "[0.4, 1.6]",
        "contact.gap": "0.0",
        "iteration.relaxation": '"constant"',
        "iteration.max_iterations": "60",
    },
)
MESHED = re.sub(r'shape = "rectangle"\nx = \[0.0, 2.0\]\ny = .*\ncells = .*\n', 'mesh = "body.msh"\n', PLANE, count=1)
BASES = (PLANE, PLANE, examples()["two-bars"])

NUMBERS = (
    *("0", "1", "-1", "2", "0.5", "0.1", "1e-9", "1e9", "1e30", "1e-30", "-1e30", "1e31", "1e-31", "1e308"),
    *("nan", "inf"),
    *("0.49", "0.4999999", "0.49999999999999", "-0.9999", "1e-7", '"1/3"', '"1/0"', "0.30000000000000004", "1e16"),
)
VALUES = (
    *NUMBERS,
    *('""', '"x"', "true", "[]", "{}", "[0.0, 1.0]", "[1.0, 0.0]", "[0.0, 0.0, 0.0]", "1979-05-27", '"auto"', '"free"'),
    *('["bottom"]', '["top"]', '["left", "right"]', '["bottom", "left"]', '"local"', '"rigid"', '"mesh"', '"interval"'),
    *("{ top = [0.0, -0.015] }", '{ top = ["free", -0.01] }', "{ top = [0.01, 0.01] }", "{ left = [0.0, 0.0] }"),
    *("{ right = [0.0, -60.0] }", "{ bottom = [1.0, 1.0] }", '"aitken"', '"anderson"', '"newton"', '"momentum"'),
    *("[1, 1]", "[2, 1]", "[6, 2]", "[7, 3]", "[1000000, 1]", '"\\u0000"', '"' + "y" * 300 + '"', "0x" + "F" * 300),
)  # fmt: skip


def mutated(text: str, draw: random.Random, times: int) -> bytes:
    """A text with values, lines and bytes changed."""
    for _ in range(times):
        lines = text.splitlines()
        i = draw.randrange(len(lines))
        kind = draw.random()
        if kind < 0.45 and "=" in lines[i]:
            lines[i] = lines[i].partition("=")[0] + "= " + draw.choice(VALUES)
        elif kind < 0.65:
            scale = lambda found: f"{float(found[0]) * draw.choice((0, -1, 2, 0.5, 10, 0.1, 1e6, 1e-6, 1.0000001)):.9g}"
            if not lines[i].startswith("cells"):
                lines[i] = re.sub(r"(?<![\w.\"])-?\d+(\.\d+)?(e-?\d+)?(?![\w.])", scale, lines[i], count=1)
        elif kind < 0.72:
            del lines[i]
        elif kind < 0.78:
            lines.insert(draw.randrange(len(lines)), lines[i])
        elif kind < 0.84:
            lines[i] = lines[i].replace(
                draw.choice(lines[i] or " "), draw.choice('abz"[]{}=.,#\\ 019\N{GREEK SMALL LETTER RHO}'), 1
            )
        elif kind < 0.9:
            j = draw.randrange(len(lines))
            lines[i], lines[j] = lines[j], lines[i]
        elif kind < 0.95:
            lines = [
                line
                for line in lines
                if not line.startswith(draw.choice(("fixed", "prescribed", "radius", "x", "interval")))
            ]
        text = "\n".join(lines or [""]) + "\n"
    data = bytearray(text.encode())
    if draw.random() < 0.1:
        for _ in range(draw.randrange(1, 4)):
            data[draw.randrange(len(data))] = draw.randrange(256)
    if draw.random() < 0.03:
        del data[draw.randrange(len(data)) :]
    return bytes(data)


def problem(draw: random.Random, folder: Path) -> list[str]:
    """A command on a mutated problem file."""
    (folder / "problem.toml").write_bytes(mutated(draw.choice(BASES), draw, draw.choice((1, 1, 2, 2, 3, 5))))
    command = draw.choice(("run",) * 5 + ("solve",) * 5 + ("constants",) * 3 + ("advise",) * 2 + ("compare",))
    return [command, str(folder / "problem.toml"), "--json"]


# --- meshes -----------------------------------------------------------------------------------------------------------


def gmsh(mesh: Mesh) -> str:
    """A mesh as a Gmsh file of version 2.2."""
    names = [f'1 {i} "{name}"' for i, name in enumerate(mesh.sides, 1)]
    nodes = [f"{i} {x!r} {y!r} 0" for i, (x, y) in enumerate(mesh.points.tolist(), 1)]
    elements = [f"1 2 {i} {i} {a + 1} {b + 1}" for i, facets in enumerate(mesh.sides.values(), 1) for a, b in facets]
    elements += [f"2 2 9 1 {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.cells]
    numbered = [f"{i} {element}" for i, element in enumerate(elements, 1)]
    blocks = {"MeshFormat": ["2.2 0 8"], "PhysicalNames": [str(len(names)), *names]}
    blocks |= {"Nodes": [str(len(nodes)), *nodes], "Elements": [str(len(elements)), *numbered]}
    return "".join(f"${name}\n" + "\n".join(block) + f"\n$End{name}\n" for name, block in blocks.items())


def broken_mesh(draw: random.Random) -> dict[str, Any]:
    """The arrays of a rectangle with some entries changed."""
    mesh = rectangle((0.0, 2.0), (0.0, 1.0), (draw.randint(1, 4), draw.randint(1, 3)))
    points, cells, sides = mesh.points.copy(), mesh.cells.copy(), {name: f.copy() for name, f in mesh.sides.items()}
    for _ in range(draw.choice((1, 1, 2, 3))):
        kind, i, j = draw.randrange(9), draw.randrange(len(cells)), draw.randrange(len(points))
        if kind == 0:
            points[j] += [draw.gauss(0, 0.3), draw.gauss(0, 0.3)]
        elif kind == 1:
            points[j] = points[draw.randrange(len(points))]
        elif kind == 2:
            points[j, draw.randrange(2)] = draw.choice((np.nan, np.inf, 1e300, 1e31, -1e29, 5e-324, 0.5))
        elif kind == 3:
            cells[i, draw.randrange(3)] = draw.choice((-1, 0, j, len(points), 10**12))
        elif kind == 4:
            cells = np.concatenate([cells, cells[[i]]])
        elif kind == 5 and len(cells) > 1:
            cells = np.delete(cells, i, axis=0)
        elif kind == 6:
            name = draw.choice(list(sides))
            sides[name] = np.concatenate([sides[name], sides[draw.choice(list(sides))][:1]])
        elif kind == 7:
            name = draw.choice(list(sides))
            sides[name] = np.concatenate([sides[name], [[j, draw.randrange(-1, len(points) + 1)]]])
        else:
            cells[i] = cells[i][::-1]
    return {"points": points, "cells": cells, "sides": sides}


def check_arrays(draw: random.Random, folder: Path) -> str | None:
    """Whether Mesh refuses arrays by a MeshError, or makes of them what areas and the divergence theorem confirm."""
    given = broken_mesh(draw)
    try:
        mesh = Mesh(**given)
    except MeshError:
        return None
    a, b = (mesh.points[mesh.boundary[:, i]] for i in range(2))
    around = float((a[:, 0] * b[:, 1] - b[:, 0] * a[:, 1]).sum() / 2)
    area = float(measures(mesh.points, mesh.cells).sum())
    # Random points lie in as many cells as they are wound round by the boundary: 0 or 1.
    p = np.array([[draw.uniform(-0.5, 2.5), draw.uniform(-0.5, 1.5)] for _ in range(100)])
    corners = mesh.points[mesh.cells]
    inside = np.ones((len(p), len(corners)), dtype=bool)
    for k in range(3):
        u, v = corners[:, (k + 1) % 3] - corners[:, k], p[:, None] - corners[None, :, k]
        inside &= u[:, 0] * v[..., 1] - u[:, 1] * v[..., 0] > 0
    if inside.sum(axis=1).max() > 1 or not np.isclose(around, area, rtol=1e-9):
        return f"accepted with overlap: {given}"
    return None


def mesh_file(draw: random.Random, folder: Path) -> list[str] | None:
    """A mutated Gmsh file, in a problem or read alone."""
    mesh = rectangle((0.0, 2.0), (-0.3, 0.0), (10, 2))
    lines = gmsh(mesh).splitlines()
    for _ in range(draw.choice((1, 1, 2, 3, 5))):
        i = draw.randrange(len(lines))
        kind, words = draw.random(), lines[i].split()
        if kind < 0.5 and words:
            k = draw.randrange(len(words))
            words[k] = draw.choice(
                ("0", "-1", "1", "2", "3", "7", "15", "99", "1e9", "nan", "x", "", "0.1", "33", "9" * 12)
            )
            lines[i] = " ".join(words)
        elif kind < 0.65:
            del lines[i]
        elif kind < 0.8:
            lines.insert(draw.randrange(len(lines)), lines[i])
        else:
            j = draw.randrange(len(lines))
            lines[i], lines[j] = lines[j], lines[i]
    data = bytearray("\n".join(lines).encode())
    if draw.random() < 0.2:
        data[draw.randrange(len(data))] = draw.randrange(256)
    if draw.random() < 0.1:
        del data[draw.randrange(len(data)) :]
    (folder / "body.msh").write_bytes(data)
    if draw.random() < 0.7:
        with contextlib.suppress(MeshError):
            from_file(folder / "body.msh")
        return None
    (folder / "problem.toml").write_text(MESHED, encoding="utf-8")
    return [draw.choice(("run", "solve", "constants")), str(folder / "problem.toml"), "--json"]


# --- options ----------------------------------------------------------------------------------------------------------

OPTIONS: dict[str, dict[str, tuple[str, ...] | None]] = {
    "run": {"--theta": NUMBERS, "--solver": ("auto", "cvxpy", "active-set", "x"), "--swap-roles": None, "--json": None},
    "compare": {"--theta": NUMBERS, "--solver": ("auto", "x"), "--swap-roles": None, "--json": None},
    "constants": {"--refine": ("0", "1", "-1", "9", "x", ""), "--json": None},
    "solve": {"--json": None, "--theta": NUMBERS},
    "advise": {"--json": None, "--tied": None, "--swap-roles": None},
    "advise run": {"--json": None, "--theta": NUMBERS, "--ratio": NUMBERS, "--friction": None, "--tied": None},
    "advise moduli": {"--json": None, **dict.fromkeys(("--young", "--poisson", "--conductivity", "--dt"), NUMBERS)},
    "bounds": {
        **dict.fromkeys(("--m", "--M", "--CR", "--Cs", "--Ctr", "--k", "--CK", "--theta", "--rho"), NUMBERS),
        **dict.fromkeys(("--kappa1", "--kappa2"), NUMBERS), "--edition": ("printed", "repaired", "both", "x"),
        "--check": None, "--json": None,
    },
    "example": {"--json": None, "section6": None, "x" * 3000: None},
    "verify": {"2.1": None, "--level": ("quick", "x"), "--json": None},
}  # fmt: skip
USUAL = {"--m": "1", "--M": "3", "--CR": "1.5", "--CK": "0", "--theta": "0.3", "--rho": "1"}


def options(draw: random.Random, folder: Path) -> list[str]:
    """A call with options that may not fit."""
    command = draw.choice(tuple(OPTIONS) + ("bounds",) * 6 + ("advise run",) * 3 + ("run",) * 3)
    words = command.split()
    if command == "verify":  # all of them take minutes
        words.append(draw.choice(("5.30", "x", "C5")))
    known = OPTIONS[command]
    if command not in ("bounds", "example", "verify") and draw.random() < (
        0.1 if command.startswith("advise ") else 0.95
    ):
        (folder / "problem.toml").write_text(PLANE, encoding="utf-8")
        words.append(str(folder / "problem.toml"))
    for name in draw.sample(sorted(known), draw.randint(0, min(len(known), 8))):
        values = known[name]
        if values is None:
            words.append(name)
        else:
            value = draw.choice(values) if name not in USUAL or draw.random() < 0.4 else USUAL[name]
            words += [name, value.strip('"')] if draw.random() < 0.9 else [f"{name}={value}"]
    if draw.random() < 0.05:
        words.append(draw.choice(("--bogus", "-o", "--help", "extra", "", "-", "\n", "\x1b[2J", "9" * 5000)))
    return words


#: Every key of PLANE by its dotted name, and some that it has not.
KEYS = (
    *(f"{table}.{name}" for table, keys in tomllib.loads(PLANE).items() if isinstance(keys, dict) for name in keys),
    *("title", "dimension", "body1", "body1.mesh", "body2.prescribed.top", "body1.traction.left", "contact.wibble", ""),
)


def keys(draw: random.Random, folder: Path) -> list[str]:
    """A call with keys of the file set to what may not fit."""
    (folder / "problem.toml").write_text(PLANE, encoding="utf-8")
    words = [draw.choice(("run", "solve", "constants")), str(folder / "problem.toml"), "--json"]
    for _ in range(draw.randint(1, 3)):
        word = f"{draw.choice(KEYS)}={draw.choice(VALUES)}"
        if draw.random() < 0.3:
            cut = draw.randrange(len(word))
            word = word[:cut] + draw.choice(("", "=", '"', "[", ".", "#", "\n", "\x1b", " ")) + word[cut + 1 :]
        words += ["--set", word]
    return words


def matrices(draw: random.Random, folder: Path) -> list[str]:
    """Advice from two matrices, many of them none, in files that may be damaged."""
    rng = np.random.default_rng(draw.randrange(2**32))
    n = draw.randint(1, 5)
    words = ["advise", "matrices"]
    for name in ("S1", "S2"):
        root = rng.normal(size=(n, n))
        matrix = root @ root.T + np.eye(n) * draw.choice((1.0, 1e-3, 1e-12))
        kind = draw.randrange(12)
        if kind == 0:
            matrix = matrix * draw.choice((1e300, 1e-300, 1e150, 5e-324, 0.0))
        elif kind == 1:
            matrix[0, 0] = draw.choice((np.nan, np.inf, 1e308, -1.0))
        elif kind == 2:
            matrix = (matrix * 10).astype(draw.choice(("i1", "i8", "u4", "c16", "?", "U8", "f2", "f4", "f16")))
        elif kind == 3:
            matrix = draw.choice((matrix[:, :-1], matrix.ravel(), matrix[None], matrix[:0, :0]))
        path = folder / f"{name}.npz"
        written = draw.randrange(4)
        if written == 0 or matrix.ndim != 2 or matrix.dtype.kind in "U?" or matrix.dtype == np.float16:
            np.savez(path, matrix)
        elif written == 1:
            np.savez_compressed(path, a=matrix, b=matrix)
        elif matrix.size:
            sp.save_npz(path, sp.csr_array(matrix).asformat(draw.choice(("csr", "csc", "coo", "bsr", "dia"))))
        else:
            np.savez(path, matrix)
        if draw.random() < 0.3:
            data = bytearray(path.read_bytes())
            for _ in range(draw.randint(1, 3)):
                data[draw.randrange(len(data))] = draw.randrange(256)
            path.write_bytes(data[: draw.choice((len(data), len(data) // 2))])
        words += [f"--{name}", str(path)]
    return [*words, "--json"]
