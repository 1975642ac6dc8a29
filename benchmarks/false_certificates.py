"""Certificates of contraction put forward for small problems, to have a false one accepted; there must be none.

python benchmarks/false_certificates.py [--problems N] [--seed S] [--jobs J]

Each problem has two to four contact nodes.  One program makes its certificate; then the claim, the multipliers and the
bodies are changed, towards what is false.  The truth is that of ``contraction_truth``.
"""

from __future__ import annotations

import argparse
import json
import math
import random
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import product
from time import perf_counter
from typing import Any

import numpy as np
from contraction_truth import Truth, condensed, doubles, number
from joblib import Parallel, delayed

import verification as vf
from verification.certificate import check
from verification.certificate.claims import NoCertificate
from verification.machine.threads import one_thread
from verification.semidefinite import LMIError
from verification.semidefinite.multipliers import QuadraticForms

# --- what is put forward ----------------------------------------------------------------------------------------------


def drawn(draw: random.Random) -> vf.Problem:
    """Two rectangles: thin or high, soft or stiff, nearly incompressible, on one grid or two, with much friction."""
    cells, juts = draw.choice([1, 2, 2, 3]), [draw.choice([0, 0, 1]), draw.choice([0, 0, 1])]
    wider = draw.randint(0, 1)
    matching = draw.random() < 0.7
    bodies: list[dict[str, Any]] = []
    for i in (0, 1):
        left, right = juts if i == wider else (0, 0)
        width = cells + left + right
        height = Fraction(draw.choice(["1/30", "1/3", "1", "4"]))
        across = width if matching else draw.randint(1, 3) + left + right
        bodies.append(
            {
                "shape": "rectangle",
                "x": [-left, cells + right],
                "y": [-height, 0] if i == 0 else [0, height],
                "cells": [across, draw.randint(1, 2)],
                "young": Fraction(f"{1000 * 30 ** draw.uniform(-1, 1):.3g}"),
                "poisson": draw.choice(["-0.9", "0", "0.3", "0.45", "0.499"]),
            }
        )
    bodies[0]["fixed"], bodies[1]["fixed"] = ["bottom"], ["top"]
    radius = Fraction(f"{cells * draw.uniform(0.3, 2):.3g}")
    friction = Fraction(f"{3 * 10 ** draw.uniform(-2, 0):.3g}") if draw.random() < 0.9 else 0
    return vf.Problem.from_dict(
        {
            "body1": bodies[0],
            "body2": bodies[1],
            "contact": {"friction": friction, "radius": radius},
            # where the grids differ the wider body has the Neumann problem, and the other one nodes at both ends
            "iteration": {"neumann_body": draw.randint(1, 2) if matching else wider + 1},
        }
    )


#: The multipliers of a certificate.
NAMES = ("lambda", "tau", "a", "b")


def written(values: Any, upwards: bool) -> list[str]:
    """Multipliers as rationals: each exactly, or a little larger, so that ``4 a b >= tau^2`` is kept."""
    return [str(Fraction(float(x)) * (1 + upwards * Fraction(1, 10**12))) for x in values]


def proposed(discrete: dict[str, Any], theta: str) -> dict[str, Any]:
    """The multipliers of one program, for bodies that no problem file describes.

    Raises
    ------
    LMIError, ValueError
        The program gave up, or the bodies are none that the library takes.
    """
    numbers = lambda rows: None if rows is None else np.array([[float(Fraction(x)) for x in row] for row in rows])
    S1, S2 = (doubles(condensed(discrete[name])) for name in ("body1", "body2"))
    friction = Fraction(discrete["friction"])
    pair = vf.build(
        S1=(S1 + S1.T) / 2,
        S2=(S2 + S2.T) / 2,
        x=np.arange(float(len(discrete["weights"]))),
        weights=np.array([float(Fraction(w)) for w in discrete["weights"]]),
        kernel=numbers(discrete["kernel"]) if friction else None,
        transfer=numbers(discrete["transfer"]),
        friction=friction,
        neumann_body=discrete["neumann_body"],
    )
    found = QuadraticForms(pair, vf.measure(pair)).factor(float(Fraction(theta))).multipliers
    values = found if len(found) == 4 else (*found, *(np.zeros(1),) * 3)
    spread = [np.broadcast_to(x, pair.contact.grid.n) for x in values]
    return {name: written(x, name in "ab") for name, x in zip(NAMES, spread, strict=True)}


def changed(discrete: dict[str, Any], draw: random.Random) -> dict[str, Any]:
    """Other bodies: more friction, nearly incompressible, nearly flat, or a kernel that is nearly singular."""
    discrete = json.loads(json.dumps(discrete))
    body = discrete[draw.choice(["body1", "body2"])]
    times = lambda text, factor: str(Fraction(text) * Fraction(f"{factor:.6g}"))
    power = 10 ** draw.uniform(-9, -0.5) * draw.choice([-1, 1])
    kinds = ["young", "poisson", "node", "node", "flat", "weight", "support"]
    kinds += ["friction", "friction", "kernel", "rows"] if discrete["kernel"] else []
    kinds += ["transfer"] if discrete["transfer"] else []
    kind = draw.choice(kinds)
    if kind == "young":
        body["young"] = times(body["young"], 10 ** draw.uniform(-2, 2))
    elif kind == "poisson":
        body["poisson"] = str(draw.choice([Fraction(1, 2), Fraction(-1)]) + Fraction(f"{power:.3g}"))
    elif kind == "node":
        at = draw.choice(body["points"])
        for i in (0, 1):
            at[i] = str(Fraction(at[i]) + Fraction(f"{draw.uniform(-0.4, 0.4):.3g}"))
    elif kind == "flat":
        share = 10 ** draw.uniform(-3, 0)
        for at in body["points"]:
            at[1] = times(at[1], share)
    elif kind == "weight":
        i = draw.randrange(len(discrete["weights"]))
        discrete["weights"][i] = times(discrete["weights"][i], 10 ** draw.uniform(-1, 1))
    elif kind == "support":
        draw.choice(body["held"])[:] = [draw.randrange(len(body["points"])), draw.randint(0, 1)]
    elif kind == "friction":
        discrete["friction"] = times(discrete["friction"], draw.uniform(0.5, 5))
    elif kind == "rows":
        to, of = draw.choice(discrete["kernel"]), draw.choice(discrete["kernel"])
        to[:] = [times(x, 1 + power) for x in of]
    else:
        row = draw.choice(discrete[kind])
        row[draw.randrange(len(row))] = str(Fraction(f"{draw.uniform(-1, 1):.6g}"))
    return discrete


def perturbed(multipliers: dict[str, Any], draw: random.Random) -> dict[str, Any]:
    """Each multiplier a little larger or smaller, with ``4 a b >= tau^2`` kept to the last digit."""
    size = 10 ** draw.uniform(-6, -0.5)
    share = lambda: Fraction(f"{10 ** draw.gauss(0, size):.12g}")
    lam, tau, a = ([Fraction(x) * share() for x in multipliers[name]] for name in NAMES[:3])
    b = [t * t / (4 * x) if x else Fraction(y) for t, x, y in zip(tau, a, multipliers["b"], strict=True)]
    return {name: [str(x) for x in values] for name, values in zip(NAMES, (lam, tau, a, b), strict=True)}


def not_allowed(multipliers: dict[str, Any], draw: random.Random) -> dict[str, Any]:
    """Multipliers that prove nothing: negative, too small, too large or those of other nodes."""
    found = {name: list(values) for name, values in multipliers.items()}
    name, i = draw.choice(list(found)), draw.randrange(len(found["a"]))
    kind = draw.choice(["negative", "less", "less", "larger", "turned", "exchanged", "dropped", "all", "all"])
    if kind == "exchanged":
        found["a"], found["b"] = found["b"], found["a"]
    elif kind == "turned":
        found[name] = found[name][::-1]
    elif kind == "dropped":
        del found[name][i]
    elif kind == "all":
        share = draw.choice([Fraction(1, 2), 1 - Fraction(1, 10 ** draw.randint(1, 9)), 10**6])
        found |= {name: [str(Fraction(x) * share) for x in found[name]] for name in "ab"}
    else:
        share = {"negative": -1, "less": 1 - Fraction(1, 10 ** draw.randint(1, 12)), "larger": 10**9}[kind]
        found[name][i] = str(Fraction(found[name][i]) * share)
    return found


def one_digit_changed(document: dict[str, Any], draw: random.Random) -> dict[str, Any] | None:
    """A certificate with one digit, sign or stroke changed; None where it can no longer be read."""
    text = json.dumps(document)
    at = draw.choice([i for i, letter in enumerate(text) if letter.isdigit() or letter in '-/"'])
    try:
        found = json.loads(text[:at] + draw.choice("0123456789-/") + text[at + 1 :])
    except ValueError:
        return None
    return found if isinstance(found, dict) and {"discrete", "claim"} <= set(found) else None


# --- one problem ------------------------------------------------------------------------------------------------------


@dataclass
class Record:
    """What was put forward for one problem, and what came of it."""

    draw: random.Random
    counts: Counter[str] = field(default_factory=Counter)
    accepted: dict[str, list[Fraction]] = field(default_factory=dict)
    refused: dict[str, list[Fraction]] = field(default_factory=dict)
    truths: dict[str, Truth] = field(default_factory=dict)
    false: list[Any] = field(default_factory=list)
    undecided: list[Any] = field(default_factory=list)
    nearest: float = math.inf

    def put(self, discrete: Any, claim: Any) -> bool:
        """Whether the checker accepts a certificate that names the hash of its own bodies."""
        self.counts["certificates"] += 1
        try:
            check.examine({"discrete": discrete, "claim": claim, "sha256": check.digest(discrete)})
        except check.UNREADABLE:
            held = self.refused
        else:
            held = self.accepted
        try:
            key, factor = json.dumps([discrete, claim["theta"]]), Fraction(claim["factor"])
        except (ArithmeticError, LookupError, TypeError, ValueError):
            assert held is self.refused
            return False
        held.setdefault(key, []).append(factor)
        return held is self.accepted

    def judged(self) -> None:
        """Hold all that was accepted against the truth, and count what was false and refused."""
        for key, factors in self.accepted.items():
            self.counts["accepted"] += len(factors)
            try:
                truth = self.truths.get(key) or Truth(*json.loads(key))
                self.nearest = min(self.nearest, float(min(factors)) / truth.largest - 1)
                for factor in sorted(factors):
                    if truth.holds(str(factor)):
                        break  # so do the larger ones
                    self.false.append((key, str(factor)))
            except (ZeroDivisionError, np.linalg.LinAlgError):  # a contact body that contact alone holds
                self.undecided.append((key, str(min(factors))))
        for key, truth in self.truths.items():
            below = [x for x in self.refused.get(key, []) if x < truth.largest * (1 - 1e-14)]
            if below and not truth.allows(number(str(max(below)))):
                self.counts["false and refused"] += len(below)

    def attack(self, problem: vf.Problem) -> None:
        """Everything that is put forward for one problem.

        Raises
        ------
        NoCertificate
        """
        draw, put = self.draw, self.put
        rho = vf.measure(problem).rho_max.value
        theta = f"{min(2 / (2 + rho) * draw.uniform(0.3, 1), 0.97):.3g}"
        made = vf.certify(problem, theta=theta).to_dict()
        discrete, own = made["discrete"], made["claim"]
        n = len(discrete["weights"])
        one_each = lambda values: values if isinstance(values, list) else [values] * n
        multipliers = {name: one_each(own["multipliers"][name]) for name in NAMES}
        truth = Truth(discrete, own["theta"])
        assert put(discrete, own)
        self.beside(truth, discrete, own | {"multipliers": multipliers}, tries=12)
        below = str(Fraction(truth.largest) * (1 - Fraction(1, 10**6)))
        for _ in range(12):
            wrong = not_allowed(multipliers, draw)
            put(discrete, own | {"factor": draw.choice([below, own["factor"]]), "multipliers": wrong})
        for bits, factor in product((2, 10, 20, 30, 40, 53, 64), (own["factor"], below)):
            put(discrete, own | {"factor": factor, "bits": bits})
        for turn in range(4):
            other = changed(discrete, draw)
            try:
                values = multipliers if turn % 2 else proposed(other, own["theta"])
                self.beside(Truth(other, own["theta"]), other, own | {"multipliers": values}, tries=4)
            except (LMIError, ValueError, ArithmeticError, np.linalg.LinAlgError):
                self.counts["bodies that are none"] += 1
        for _ in range(20):
            given = one_digit_changed({"discrete": discrete, "claim": own}, draw)
            if given is None:
                self.counts["unreadable"] += 1
            else:
                put(given["discrete"], given["claim"])
        self.judged()

    def beside(self, truth: Truth, discrete: dict[str, Any], claim: dict[str, Any], tries: int) -> None:
        """Claims next to the truth on either side; then the least factor that perturbed multipliers prove."""
        largest = Fraction(truth.largest)
        self.truths[json.dumps([discrete, claim["theta"]])] = truth

        def claimed(share: float, multipliers: dict[str, Any]) -> bool:
            factor = str(largest * (1 + Fraction(share)))
            return self.put(discrete, claim | {"factor": factor, "multipliers": multipliers})

        multipliers = claim["multipliers"]
        for share in (1e-12, 1e-9, 1e-6, 1e-3):
            claimed(-share, multipliers)
        best = next((share for share in (1e-9, 1e-4, 0.01, 0.1, 1) if claimed(share, multipliers)), None)
        for _ in range(tries if best else 0):
            other, share = perturbed(multipliers, self.draw), best * self.draw.choice([0.5, 0.9, 0.99])
            if claimed(share, other):
                multipliers, best = other, share


def attacked(seed: str) -> Record:
    """One problem; the friction is halved until there is a certificate."""
    draw = random.Random(seed)
    record = Record(draw=draw)
    problem = drawn(draw)
    with one_thread():
        while True:
            try:
                record.attack(problem)
            except NoCertificate:
                problem = problem.changed(friction=Fraction(problem.contact.friction) / 2)
                record.counts["halved"] += 1
            else:
                record.counts["problems"] += 1
                record.truths.clear()  # rationals of another library are not sent between processes
                return record


def count(problems: int, seed: int = 0, jobs: int = 1) -> Iterator[Record]:
    """A record of each problem; they do not depend on the processes."""
    seeds = (f"{seed}, {i}" for i in range(problems))
    yield from Parallel(n_jobs=jobs, return_as="generator")(delayed(attacked)(own) for own in seeds)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--problems", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args()
    started, counts, false, nearest = perf_counter(), Counter(), 0, []
    for record in count(options.problems, options.seed, options.jobs):
        counts += record.counts
        false += len(record.false)
        nearest.append(record.nearest)
        for key, factor in record.false:
            print(f"FALSE: factor {factor} of {key}")
        for key, factor in record.undecided:
            print(f"not decided: factor {factor} of {key}")
    print(f"{counts['problems']} problems from seed {options.seed}, {perf_counter() - started:.0f} s")
    for kind in ("certificates", "unreadable", "false and refused", "accepted"):
        print(f"  {kind:20} {counts[kind]:8}")
    print(f"of the accepted {false} are false; the least factor accepted for a problem lies above the truth by")
    print(f"  {min(nearest):.2g} at the least, {np.median(nearest):.2g} in the median")
    raise SystemExit(1 if false else 0)
