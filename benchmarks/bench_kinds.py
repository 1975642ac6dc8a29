"""What the advice from logs, vectors and `couple` costs in ten couplings with feedback and in ten parallel ones.

python benchmarks/bench_kinds.py [--record FOLDER]

Loops with feedback have eigenvalues below 0: fixed-stress poroelasticity, Joule heating, a wing whose lift grows with
its twist, and random ones; they are linear, and of kind general.  Parallel couplings are walls that exchange heat,
membranes, a tube and masses on springs, both solvers at once, with the second field in a unit that is a million times
larger.  Half of the couplings were made after the rules were fixed.
"""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from couplings import ARRIVED, NOISE, heat, lumped, membrane, tube
from recording import options

import verification as vf
from ndtheory import __version__

#: Thetas of the first run, the most runs for logs, and the most evaluations.
FIRST, RUNS, MOST = (0.5, 1.0), 5, 6000

#: A run ends where a number is larger.
LARGEST = 1e50

#: The unit of the second field of parallel couplings.
UNIT = 1e6

Floats = np.ndarray


@dataclass(frozen=True, kw_only=True)
class Loop:
    """Two linear solvers, ``neumann`` and ``contact`` as `couple` calls them, with the eigenvalues of both."""

    name: str
    kind: str
    parallel: bool
    unseen: bool
    values: Floats
    size: int
    neumann: Callable[[Floats], Floats]
    contact: Callable[[Floats], Floats]

    def states(self, theta: float, rule: str = "constant") -> Iterator[tuple[vf.Coupling, Floats, Floats]]:
        """The coupling, the vector and its image of each evaluation."""
        most = theta if self.kind == "general" else min(theta, 1.0)
        coupling = vf.Coupling(rule, most, kind=self.kind, parallel=self.parallel, tolerance=ARRIVED)
        n = self.size
        x = np.zeros(2 * n if self.parallel else n)
        while True:
            there = self.neumann(x[:n])
            image = np.concatenate([self.contact(x[n:]), there]) if self.parallel else self.contact(there)
            if not np.abs(image).max() < LARGEST:
                return
            after = coupling.next(x, image)
            yield coupling, x, image
            x = after

    def steps(self, theta: float, most: float = MOST) -> int | None:
        """Evaluations until it has arrived; None where it does not."""
        for n, (coupling, *_) in enumerate(islice(self.states(theta), int(min(most, MOST))), 1):
            if coupling.arrived:
                return n
        return None

    @property
    def fewest(self) -> int:
        """The fewest steps of a scan over theta."""
        low, high = float(self.values.min()), float(self.values.max())
        middle = 1 / (1 + high) if self.parallel else 2 / (2 + low + high)
        best = MOST
        for k in sorted(range(-12, 13), key=abs):
            best = min(best, self.steps(middle * 1.05**k, best) or MOST)
        return best

    def log(self, theta: float, path: Path, seed: int | None) -> Path:
        """The residuals of each field as preCICE logs them; with a seed, with noise."""
        rows = []
        for _, x, image in islice(self.states(theta), 60 + math.ceil(15 / theta)):
            rows.append([np.linalg.norm(part) for part in np.split(image - x, 1 + self.parallel)])
            if not 1e-12 * max(rows[0]) < max(rows[-1]) < 1e60 * max(rows[0]):
                break
        values = np.array(rows)
        if seed is not None:
            values = values * np.exp(NOISE * np.random.default_rng(seed).normal(size=values.shape))
        names = " ".join(f"ResAbs(Mesh:{name})" for name in ("Force", "Displacement")[: values.shape[1]])
        lines = [f"1 {n} {' '.join(f'{value:.8e}' for value in row)}" for n, row in enumerate(values, 1)]
        path.write_text("\n".join([f"TimeWindow Iteration {names}", *lines]) + "\n", encoding="utf-8")
        return path

    def followed(self, first: float, folder: Path, seed: int | None) -> tuple[float | None, int]:
        """The theta that logs lead to, None where they do not decide, and the number of runs."""
        logs: list[tuple[Path, str]] = []
        theta = first
        for n in range(RUNS):
            noise = None if seed is None else 97 * seed + n
            logs.append((self.log(theta, folder / f"{n}.log", noise), repr(float(theta))))
            found = vf.advise_logs(logs, kind=self.kind, parallel=self.parallel)
            assert found.next is not None
            if found.theta is not None or found.next.kept:
                return found.next.theta, n + 1
            theta = found.next.theta
        return None, RUNS

    def verdict(self, theta: float | None, fewest: int) -> str:
        """``right`` within 1.4 times the fewest steps, else ``slow``; ``wrong`` if it does not arrive; ``silent``."""
        if theta is None:
            return "silent"
        taken = self.steps(theta)
        return "wrong" if taken is None else "right" if 5 * taken <= 7 * fewest else "slow"


def feedback(name: str, values: Floats, seed: int, unseen: bool) -> Loop:
    """A loop with these eigenvalues, from one model to another and back."""
    generator, n = np.random.default_rng(seed), len(values)
    V = generator.normal(size=(n, n)) + 2 * np.eye(n)
    back = V @ np.diag(values) @ np.linalg.inv(V)
    load, shift = generator.normal(size=(2, n))
    return Loop(
        name=name, kind="general", parallel=False, unseen=unseen, values=values, size=n,
        neumann=lambda x: 3 * x + shift, contact=lambda y: load - back @ y / 3,
    )  # fmt: skip


def loops() -> Iterator[Loop]:
    """The ten with feedback."""
    made = {
        "fixed stress, weak": -np.linspace(0.001, 0.395, 20),
        "fixed stress, strong": -np.linspace(0.001, 0.88, 20),
        "Joule heating": -0.6 / np.arange(1, 16),
        "wing": np.array([-0.55, -0.1, 0.05]),
        "one number": np.array([-0.55]),
    }
    for n, (name, values) in enumerate(made.items()):
        yield feedback(name, values, n, False)
    for seed in range(101, 106):
        generator = np.random.default_rng(seed)
        low, high = -generator.uniform(0.1, 0.9), generator.choice([0.0, generator.uniform(0, 2)])
        values = np.sort(np.append(generator.uniform(low, high, generator.integers(3, 12)), [low, high]))
        yield feedback(f"random, lambda {low:.2f} to {high:.2f}", values, seed, True)


def at_once() -> Iterator[Loop]:
    """The ten parallel ones."""
    made = [*((kind, seed) for seed in (1, 2, 101) for kind in (heat, membrane, lumped)), (tube, 103)]
    for kind, seed in made:
        one = kind(seed)
        yield Loop(
            name=one.name, kind="tied", parallel=True, unseen=seed > 100, values=one.spectrum,
            size=len(one.neumann.load),
            neumann=lambda g, one=one: one.solve(g + one.neumann.load) * UNIT,
            contact=lambda u, one=one: one.image(u / UNIT),
        )  # fmt: skip


def judged(loop: Loop, seed: int | None) -> dict[str, Any]:
    """The verdicts of each source on one coupling."""
    fewest, n = loop.fewest, loop.size
    found: dict[str, Any] = {"name": loop.name, "unseen": loop.unseen, "fewest": fewest, "noise": seed is not None}
    found |= {"least": float(loop.values.min()), "largest": float(loop.values.max())}
    rows = [(x, image) for _, x, image in islice(loop.states(0.3, "iqn-ils"), 9)]
    X, TX = (np.array(each) for each in zip(*rows, strict=True))
    vectors = vf.advise_vectors(X, TX, kind=loop.kind, parallel=loop.parallel)
    ran = vf.couple(
        loop.neumann, loop.contact, start=np.zeros(n), kind=loop.kind, parallel=loop.parallel, tolerance=1e-8
    )
    thetas: dict[str, Any] = {"vectors": vectors.theta, "couple": ran.advice and ran.advice.theta}
    with tempfile.TemporaryDirectory() as folder:
        for first in FIRST:
            thetas[f"logs from {first}"], found[f"runs from {first}"] = loop.followed(first, Path(folder), seed)
    verdicts = {source: loop.verdict(theta, fewest) for source, theta in thetas.items()}
    return found | {"iterations": ran.iterations, "converged": ran.converged, "theta": thetas, "verdicts": verdicts}


def main() -> None:
    chosen = options(__doc__).parse_args()
    made = {"general": list(loops()), "parallel": list(at_once())}
    kinds: dict[str, list[dict[str, Any]]] = {}
    for kind, some in made.items():
        kinds[kind] = []
        for n, loop in enumerate(some):
            kinds[kind].append(judged(loop, n if n % 2 else None))
            print(f"  {kind}, {loop.name:32} {kinds[kind][-1]['verdicts']}", flush=True)
    if chosen.record is not None:
        head = {"schema": "ndtheory.kinds/1", "version": __version__, "date": datetime.now(UTC).date().isoformat()}
        folder = chosen.record / "advice"
        folder.mkdir(parents=True, exist_ok=True)
        text = json.dumps(head | {"arrived": ARRIVED, "noise": NOISE, "runs": RUNS, "kinds": kinds}, indent=1)
        (folder / "kinds.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
