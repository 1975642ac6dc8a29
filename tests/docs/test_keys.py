"""Every document fits its schema, whose tables have its keys and no other; the page lists what files are written."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import re
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from coupling_logs import linear_run, precice
from key_problems import obstacles, stack, triangles
from known import DEAR, continuum_once, once, repeated_once
from made_up import Halfway
from shared import Shared

import verification as vf
from verification import comparison, figures, schemas
from verification.certificate import continuum
from verification.cli import main
from verification.exploration import page
from verification.ledger import Evidence
from verification.ledger.sources import SOURCES
from verification.registry import BOUNDS
from verification.reproduce import READINGS, reproduce
from verification.sweeps import region as plane

PAGE = (Path(__file__).parents[2] / "docs" / "json.md").read_text("utf-8")

BARS = {
    "dimension": 1,
    "body1": {"shape": "interval", "x": [0, 1], "cells": 2, "young": 3, "fixed": ["left"]},
    "body2": {"shape": "interval", "x": [1, 2], "cells": 2, "young": 2, "prescribed": {"right": "-0.1"}},
}
SIDE_BY_SIDE = {
    "body1": {"shape": "rectangle", "x": [-1, 0], "y": [0, 1], "cells": [1, 2], "young": 2, "poisson": 0}
    | {"fixed": ["left"]},
    "body2": {"shape": "rectangle", "x": [0, 1], "y": [0, 1], "cells": [1, 2], "young": 2, "poisson": 0}
    | {"prescribed": {"right": ["-0.1", 0]}},
    "contact": {"surface": ["right", "left"]},
}
COARSE = "--set body1.cells=[5,1] --set body2.cells=[3,1]"
GIVEN = "bounds --m 3084 --M 153229 --CR 1.7"
LAYERS = "layers --young 7e4,2e4 --poisson 0.3,0.3 --depth 0.3,0.3 --radius 0.1"


@cache
def validator(name: str) -> Any:
    """What holds a document against its schema; 1.0 is no integer, as in the documents themselves."""
    strict = jsonschema.Draft202012Validator.TYPE_CHECKER.redefine(
        "integer", lambda _, value: isinstance(value, int) and not isinstance(value, bool)
    )
    kind = jsonschema.validators.extend(jsonschema.Draft202012Validator, type_checker=strict)
    kind.check_schema(vf.schema(name))
    return kind(vf.schema(name))


def errors(document: Mapping[str, Any]) -> list[str]:
    """Where a document differs from its schema."""
    found = validator(document["schema"]).iter_errors(document)
    return [f"{document['schema']}{error.json_path[1:]}: {error.message[:300]}" for error in found]


class Reader:
    """Compares the keys of documents with the tables of which the schemas are made.

    Attributes
    ----------
    wrong : list of str
        Keys of documents that no table has.
    seen : set of pairs
        Table and key of the rows that some document has.
    """

    def __init__(self) -> None:
        self.wrong: list[str] = []
        self.seen: set[tuple[str, str]] = set()

    def read(self, document: Mapping[str, Any]) -> None:
        name, kind = document["schema"], document.get("kind")
        self.object(f"{name}, {kind}" if f"{name}, {kind}" in schemas.tables() else name, "", document)

    def object(self, name: str, path: str, value: Mapping[str, Any]) -> None:
        """Look up the keys of an object in the rows of a table whose paths begin with ``path``."""
        rows = {key: (home, row) for home, key, row in schemas.rows(name) if key.startswith(path)}
        first = {key[len(path) :].split(".")[0] for key in rows}
        for key, member in value.items():
            full = path + (key if key in first else "*")
            if full in rows:
                home, row = rows[full]
                self.seen.add((home, full))
                self.value(name, full, row.type, member)
            elif full.removeprefix(path) in first:
                self.object(name, f"{full}.", member)
            else:
                self.wrong.append(f"{name}: no table has {path}{key}")

    def value(self, name: str, path: str, kind: str, value: Any) -> None:
        if value is None:
            return
        if schemas.EITHER in kind:
            one, _, several = kind.partition(schemas.EITHER)
            kind = f"list of {several}" if isinstance(value, list) else one
        if kind.startswith(("list of ", "map of ")):
            of_map = isinstance(value, dict)
            for member in value.values() if of_map else value:
                self.value(name, f"{path}.*" if of_map else path, kind.partition(" of ")[2], member)
        elif kind in schemas.tables():
            self.object(kind, "", value)
        elif kind == "object":
            self.object(name, f"{path}.", value)

    @property
    def unseen(self) -> set[str]:
        """Rows that no document has."""
        everything = {(home, key): row for table in schemas.tables() for home, key, row in schemas.rows(table)}
        return {f"{home}: {key}" for (home, key), row in everything.items() if (home, key) not in self.seen}


@pytest.fixture(scope="module", autouse=True)
def sketched(shared: Shared, evidence: Callable[[str], Any]) -> Iterator[None]:
    """Pictures that cost nothing and few runs in the plane, as no key depends on them; what is dear is shared."""
    searched = "inequalities on random problems"
    found: dict[str, list[Evidence]] = evidence(searched)[0]

    with pytest.MonkeyPatch.context() as patch:
        for module, name in DEAR:
            patch.setattr(module, name, once(getattr(module, name), shared))
        patch.setattr(comparison, "by_cvxpy_alone", repeated_once(comparison.by_cvxpy_alone, shared))
        continuum_once(patch, shared)
        patch.setitem(SOURCES, searched, lambda ids, *_: {id: found[id] for id in ids if id in found})
        for name in ("draw_bodies", "draw_residuals", "draw_ruler", "draw_waterfall", "draw_region"):
            patch.setattr(figures, name, lambda *args, **options: None)
        patch.setattr(figures, "save", lambda figure, path: path.write_bytes(b""))
        patch.setattr(plane, "THETAS", (0.2, 0.6))
        patch.setattr(plane, "FRICTIONS", (0.1, 0.9))
        patch.setattr(page, "SHARES", page.SHARES[1:3])
        yield


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("documents")


@pytest.fixture(scope="module")
def small(folder: Path) -> vf.Problem:
    problem = vf.example("section6").changed(cells=((10, 2), (6, 2)), radius="0.1")  # as other tests in the continuum
    (folder / "small.toml").write_text(problem.to_toml(), "utf-8")
    (folder / "grid.toml").write_text('problem = "small.toml"\n[grid]\ntheta = [0.5]\n', "utf-8")
    return problem


def diverging(folder: Path) -> list[tuple[Path, str]]:
    """A log of a tied run that diverges, absolute and relative, its last line cut off."""
    absolute, relative = linear_run([1, 3], 0.8, 40)
    log = precice(folder / "diverging.log", [{"ResAbs(M:F)": absolute, "ResRel(M:F)": relative}])
    log.write_text(log.read_text("utf-8")[:-30], "utf-8")
    return [(log, "0.8")]


def falling(folder: Path) -> list[tuple[Path, str]]:
    """A log of another run, in which rho is smaller."""
    log = precice(folder / "falling.log", [{"ResAbs(M:F)": linear_run([0.5, 1], 0.9, 40)[0]}])
    return [(log, "0.9")]


def transient(folder: Path) -> list[tuple[Path, str]]:
    """A log of time windows that are too short one by one."""
    window = {"ResAbs(M:F)": linear_run([0.5, 1], 0.9, 6)[0]}
    return [(precice(folder / "transient.log", [window] * 12), "0.9")]


#: An Aitken run whose factors are named, and a quasi-Newton run.
LOGS_OF_KRATOS = [
    Path(__file__).parents[1] / "verification" / "kratos_logs" / f"{name}.log" for name in ("aitken", "iqn-ils")
]


def vectors() -> Iterator[tuple[Any, Any]]:
    """Iterates and their images: independent ones, ones of a stiff coupling that depend on each other, open contact."""
    X = np.random.default_rng(1).normal(size=(4, 2))
    for some, image in (
        (X[:2], lambda x: 1 - x),
        (X, lambda x: 1 - np.array([1.0, 1e9]) * x),
        (X, lambda x: np.maximum(x, 0.0)),
    ):
        yield some, [image(x) for x in some]


def point_load() -> dict[str, Any]:
    """A force that changes nothing."""
    return {"point_load": [{"at": [1, 0], "force": [0, 0]}]}


def histories(problem: vf.Problem) -> Iterator[Any]:
    """Histories by both methods, linearised, without a promise, with a bound of one's own that has no conclusion."""
    loads = {"prescribed": {"top": [0, "-0.01"]}, "traction": {"right": [1, 0]}, "body_force": [0, 1]}
    steps = [
        {"name": "press", "body1": {"prescribed": {"left": [0, "free"]}}, "body2": loads},
        {"increments": 2, "body1": {"traction": {"left": [0, 1]}} | point_load(), "body2": point_load()},
    ]
    steps += [{"body1": {"body_force": [1, 0]}, "body2": {"prescribed": {"top": [0, 1]}}}]
    named = {"body2": problem.to_dict()["body2"] | {"points": {"mid": [1, "0.1"]}}}
    found = vf.Problem.from_dict(problem.to_dict() | named | {"step": steps})
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(BOUNDS, Halfway.name, Halfway())
        yield vf.march(found).linearise()
    yield from (vf.march(found.changed(friction=5)), vf.march(found, method="monolithic"))
    yield vf.march(found.changed(law="local"))


def certified(*problems: vf.Problem) -> Iterator[Any]:
    """Certificates, and what comes of checking them again."""
    for problem in problems:
        of_small, of_energy = vf.certify(problem), vf.certify(problem.changed(friction=0), edition="energy")
        beside = vf.Problem.from_dict(SIDE_BY_SIDE)
        yield from (of_small, of_energy, vf.certify(beside, theta="0.5"), vf.solve(beside))
        yield vf.check_again(of_small.to_dict())
        yield vf.check_again(of_energy.to_dict(), problem)


def registered(problem: vf.Problem) -> Iterator[dict[str, Any]]:
    """Comparisons with a bound that is registered for a moment, where it has a conclusion and where not."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(BOUNDS, Halfway.name, Halfway())
        for some in (problem, problem.changed(friction=5)):
            yield vf.compare(some, bounds=[Halfway.name]).to_dict()
        with contextlib.redirect_stdout(io.StringIO()) as out:
            main(["bounds", "--rho", "2", "--kappa1", "0.1", "--kappa2", "0.1", "--theta", "0.3", "--json"])
        yield json.loads(out.getvalue())


@pytest.fixture(scope="module")
def documents(folder: Path, small: vf.Problem) -> list[dict[str, Any]]:
    """Documents of every schema: with and without friction, in one dimension, from matrices, of mesh files, of runs."""
    triangles(folder / "square.msh")
    triangles(folder / "lower.msh", "top", -1)
    triangles(folder / "upper.msh", "bottom", 0)
    above = {"shape": "rectangle", "x": [0, 1], "y": [0, 1], "cells": [1, 1], "young": 1, "poisson": "0.3"}
    of_mesh = vf.Problem.from_dict(
        {
            "body1": {"mesh": str(folder / "square.msh"), "young": 1, "poisson": "0.3", "fixed": ["bottom"]}
            | {"group": "square", "points": {"mid": ["0.5", "-0.5"]}}
            | {"point_load": [{"at": [1, -1], "force": [0, 0]}]},
            "body2": {**above, "prescribed": {"all": [0, "-0.1"]}, "traction": {"right": [0, 1]}}
            | {"parts": {"all": {"side": "top", "x": [0, 1]}, "edge": {"side": "left", "y": [0, 1]}}},
            "contact": {"interval": [0, 1]},
            "iteration": {"theta": "auto"},
        }
    )
    bars = vf.Problem.from_dict(BARS)
    matrices = vf.build(S1=np.diag([2.0, 3.0]), S2=np.eye(2), x=np.zeros(1))
    results = [
        vf.compare(bars),
        *(vf.run(problem) for problem in (small, bars, of_mesh, matrices)),
        vf.run(bars.changed(theta="0.99"), rule="momentum"),
        vf.run(small.changed(young=(70000, 20000000)), theta="0.99"),  # diverges
        *(vf.solve(problem) for problem in (small, bars, of_mesh, vf.example("signorini"), stack())),
        *(vf.solve(vf.Problem.from_dict(data)) for data in obstacles()),
        *histories(small),
        *(vf.measure(problem) for problem in (bars, matrices)),
        vf.measure(small, refine=1),
        vf.measure(matrices, verified=True),
        *(vf.advise(problem) for problem in (small, small.changed(cells=((10, 2), (6, 1))), bars)),
        vf.advise_matrices(np.diag([2.0, 3.0]), np.eye(2)),
        *(vf.advise_vectors(X, TX) for X, TX in vectors()),
        vf.advise_matrices(np.diag([2.0, 3.0]), np.eye(2), transfer=np.eye(1)),
        vf.advise_matrices(lambda u: 2 * u, solve2=lambda f: f, unknowns=3),
        *(vf.advise_run(theta, ratio) for theta, ratio in (("0.1", "1.4"), ("0.6", "0.7"), ("0.2", "0.5"))),
        vf.advise_logs(transient(folder)),
        vf.advise_logs([(accelerator, None) for accelerator in LOGS_OF_KRATOS]),
        *(vf.advise_run("0.45", ratio, friction=True) for ratio in ("0.8", "1.4")),
        *(vf.advise_logs(logs) for logs in (diverging(folder), falling(folder), diverging(folder) + falling(folder))),
        vf.advise_moduli(young=(7, 2), poisson=("0.3", "0.3"), mirror=[2]),
        vf.advise_moduli(young=(2, 2), poisson=("0.3", "1/3"), corners="both", mirror=[1], flat=True),
        vf.advise_moduli(young=(2, 2), poisson=("0.3", "0.3")),
        vf.advise_moduli(conductivity=(50, "0.5"), capacity=(2, 3), thickness=(1, 1), dt=1, parallel=True),
        vf.advise_moduli(density=(1, 2), thickness=1, length=(5, 1), young=3, poisson="0.3", dt=1),
        vf.sweep(small, theta=["0.5"], refine=[0, 8]),
        vf.sweep(matrices, theta=["0.5"], young=[(1, 2)]),
        vf.sweep(matrices, theta=["auto"], rule=["anderson"]),
        vf.verify(["2.1", "2.4", "4.7", "x-homogeneity", "thm-5.9"]),
        reproduce(["fig5", "fig11"], readings=READINGS[:2]),
        *certified(
            small, vf.Problem.from_dict({**small.to_dict(), "body2": {**small.to_dict()["body2"], "cells": [5, 2]}})
        ),
        *(
            continuum.certify_continuum(problem)
            for problem in (small, small.swapped(), small.changed(theta="auto", friction=0))
        ),
    ]
    return [*(result.to_dict() for result in results), *registered(small)]


@pytest.fixture(scope="module")
def printed() -> Callable[[str], dict[str, Any]]:
    def document(arguments: str) -> dict[str, Any]:
        with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()):
            main([*arguments.split(), "--json"])
        found: dict[str, Any] = json.loads(out.getvalue())
        return found

    return document


@pytest.fixture(scope="module")
def compared(folder: Path, small: vf.Problem, printed: Callable[[str], dict[str, Any]]) -> dict[str, Any]:
    return printed(f"compare {folder / 'small.toml'} --verified -o {folder / 'results'}")


def test_every_document_fits_its_schema_which_has_its_keys_and_no_other(documents, compared, printed, folder):
    reader, found = Reader(), set[str]()
    for arguments in (
        f"{GIVEN} --CK 1e-8 --rho 0.475 --kappa1 0.9 --kappa2 0.4 --theta 1e-4",
        f"{GIVEN} --k 0.1 --Cs 1 --Ctr 1",
        f"{GIVEN} --CK 0 --edition printed",
        "bounds --rho 2",
        f"{LAYERS} --friction 0.2 --theta 0.7",
        f"{LAYERS} --friction 6",
        "example",
        "example section6",
        f"example --inputs {folder / 'inputs'}",
        f"draft {folder / 'lower.msh'} {folder / 'upper.msh'}",
        f"sweep {folder / 'grid.toml'} --dry-run",
        f"certify {folder / 'small.toml'} --set contact.friction=5",  # no proof
        f"certify {folder / 'small.toml'} --norm lyapunov",
        f"compare {folder / 'small.toml'} --bounds lyapunov --verified",
        f"compare {folder / 'small.toml'} --bounds lyapunov --set contact.friction=9 {COARSE}",
        f"region {folder / 'small.toml'} -o {folder / 'plane.svg'}",
        f"explore {folder / 'small.toml'} -o {folder / 'page.html'}",
    ):
        documents = [*documents, printed(arguments)]
    for document in (*documents, compared):
        found.update(errors(document))
        reader.read(document)
    assert sorted(found) == []
    assert sorted(set(reader.wrong)) == []
    assert sorted(reader.unseen) == []


def test_a_key_that_no_table_has_and_one_that_no_document_has_are_found(small):
    document = vf.measure(small).to_dict()
    reader = Reader()
    document["rho_least"] = document.pop("rho_min")
    document["body1"]["weight"] = 1
    reader.read(document)
    assert reader.wrong == ["Body constants: no table has weight", "ndtheory.constants/1: no table has rho_least"]
    assert "Constants: rho_min" in reader.unseen
    assert errors(document) == ["ndtheory.constants/1: 'rho_min' is a required property"]


def places(value: Any, name: str, path: str = "") -> Iterator[tuple[dict[str, Any], str, schemas.Row]]:
    """Each key of a document that has a row of its own: the object that has it, the key, its row."""
    rows = {key: row for _, key, row in schemas.rows(name)}
    for key, member in value.items():
        row = rows.get(path + key)
        if row is not None:
            yield value, key, row
        if isinstance(member, dict) and row is not None and row.type in schemas.tables():
            yield from places(member, row.type)
        elif isinstance(member, dict) and (row is None or row.type.startswith("object")):
            yield from places(member, name, f"{path}{key}.")


@pytest.mark.parametrize("schema", ["constants", "bounds", "solve", "run"])
def test_a_schema_refuses_another_type_an_unexplained_null_and_a_key_that_is_missing(documents, schema):
    document = next(each for each in documents if each["schema"] == f"ndtheory.{schema}/1")
    fits = validator(document["schema"]).is_valid
    assert fits(document)
    for holder, key, row in list(places(document, document["schema"])):
        value = holder.pop(key)
        assert fits(document) == (row.absent is not None), key
        holder[key] = None
        assert fits(document) == (row.null is not None), key
        holder[key] = False if row.type != "truth" else "yes"
        assert not fits(document) or row.type == "free", key
        holder[key] = value
    document["further"] = document["units"]["further"] = "allowed"
    assert fits(document)
    del document["further"], document["units"]["further"]


def test_a_schema_of_several_kinds_takes_each_and_no_other(documents):
    certificates = [each for each in documents if each["schema"] == "ndtheory.certificate/1"]
    assert {each["kind"] for each in certificates} == {"contraction", "continuum"}
    for each in certificates:
        assert errors({**each, "kind": "guess"})


def test_the_page_shows_every_table_once():
    assert sorted(re.findall(r"^```\{keys\} (.+)$", PAGE, re.M)) == sorted(schemas.tables())


def test_no_key_is_in_two_rows_of_a_table():
    for table in schemas.tables():
        keys = [key for _, key, _ in schemas.rows(table)]
        assert len(set(keys)) == len(keys), table


# --- files ---


def listed(heading: str) -> dict[str, list[str]]:
    """What the page says of files or arrays: names in the first column -> the other cells of their row."""
    part = PAGE[PAGE.index(heading) :]
    rows = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in part.splitlines() if "| " in line]
    return {name: row[1:] for row in rows for name in re.findall("`([^`]+)`", row[0])}


def test_the_page_lists_every_file_that_a_comparison_writes(folder, compared):
    files = listed("## Files")
    written = {path.name for path in (folder / "results").iterdir()}
    # only where grids differ, points are named, the free norm is asked for
    others = {"run.json", "solve.json", "ledger.json", "P.npz", "points.csv", "factor.svg", "factor.png"}
    assert written == {name for name, row in files.items() if "compare" in row[0]} - others
    for name in ("contact.csv", "history.csv"):
        lines = (folder / "results" / name).read_text("utf-8").splitlines()
        assert files[name][1].endswith(": " + ", ".join(next(csv.reader(lines[1:]))))
    with np.load(folder / "results" / "interface.npz") as arrays:
        assert set(arrays.files) == set(listed("| array |")) - {
            "transfer",
            "motions1",
            "motions2",
        }  # in files of other pairs
