"""The semidefinite bound: one program beside cvxpy's and SCS's, the whole of it, and the losses, on Section 6.

Wanted: one program under 0.1 s at 25 contact nodes and under 3 s at 97, factor, largest theta and threshold under 0.7 s
at 25, and the values of both solvers within 1e-3.  CPU time, one BLAS thread, medians, in turn.

With --random N: how close branch and bound brings both bounds of the Lipschitz constant on N random problems.
"""

import argparse
import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import verification as vf
from verification.bounds import interior_point, model
from verification.bounds.exact import GAP, budget, enclose
from verification.bounds.losses import locate
from verification.bounds.multipliers import QuadraticForms, friction_threshold
from verification.bounds.program import LMIError, Optimum, Program
from verification.ledger.cases import problem as random_problem
from verification.threads import one_thread

THETA = 0.7


def timed(call: Callable[[], Any]) -> tuple[float, Any]:
    begin = time.process_time()
    result = call()
    return time.process_time() - begin, result


def of_section_6(cells: int) -> tuple[vf.ContactPair, vf.Measured]:
    """The model with so many cells on the upper body's side of Gamma_c, in the proportions of the built-in one."""
    rows = max(cells // 4, 1)
    pair = vf.build(vf.example("section6").changed(cells=((5 * cells // 3, rows), (cells, rows))))
    return pair, vf.measure(pair)


def one_program(cells: int, times: int) -> tuple[Program, float, Optimum]:
    """The program of the factor, the seconds it takes, and what it finds."""
    pair, measured = of_section_6(cells)
    asked: list[Program] = []

    def solve(program: Program) -> Optimum:
        asked.append(program)
        return interior_point.solve(program)

    QuadraticForms(pair, measured, solver=solve).factor(THETA)
    runs = [timed(lambda: interior_point.solve(asked[0])) for _ in range(times)]
    return asked[0], statistics.median(seconds for seconds, _ in runs), runs[0][1]


def whole(pair: vf.ContactPair, measured: vf.Measured) -> None:
    forms = QuadraticForms(pair, measured)
    forms.factor(THETA)
    forms.largest_theta()
    friction_threshold(pair, measured, measured.friction_threshold.value)


def on_random_problems(count: int) -> None:
    gaps, seconds = [], []
    for seed in range(count):
        random = np.random.default_rng(seed)
        pair = vf.build(random_problem(random, None))
        measured = vf.measure(pair)
        theta = min(2 / (2 + measured.rho_max.value) * random.uniform(0.3, 1.1), 0.97)
        allowed = budget(pair.contact.grid.n)
        try:
            spent, found = timed(
                lambda pair=pair, measured=measured, theta=theta, allowed=allowed: enclose(
                    pair, QuadraticForms(pair, measured), theta, gap=GAP, programs=allowed
                )
            )
        except (LMIError, ValueError) as error:
            print(f"problem {seed}: {error}")
            continue
        gaps.append(found.gap)
        seconds.append(spent)
        if found.gap > GAP:
            print(f"problem {seed}: {pair.contact.grid.n} nodes, k = {float(pair.friction):g}, gap {found.gap:.1%}")
    within = np.mean(np.array(gaps) <= GAP)
    print(f"{len(gaps)} random problems  {within:.0%} within {GAP:.0%}, {max(seconds):.1f} s at most")


if __name__ == "__main__":
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--random", type=int, default=0)
    chosen = arguments.parse_args()
    with one_thread():
        for cells, times in ((12, 9), (24, 9), (48, 5), (96, 3)):
            program, seconds, found = one_program(cells, times)
            print(f"{cells + 1:3d} contact nodes    {seconds:6.3f} s, {found.steps} steps, q = {found.s**0.5:.6f}")
            if cells == 24:
                other, answer = timed(
                    lambda program=program: model.solve(program, solver="SCS", eps=1e-4, max_iters=20_000)
                )
                print(f"     cvxpy with SCS  {other:6.3f} s, {other / seconds:.0f} times, q = {answer.s**0.5:.6f}")
                assert abs(answer.s - found.s) < 1e-3
        pair, measured = of_section_6(24)
        seconds = statistics.median(timed(lambda: whole(pair, measured))[0] for _ in range(5))
        print(f"whole, 25 nodes      {seconds:.2f} s")
        forms = QuadraticForms(pair, measured)
        seconds, found = timed(lambda: enclose(pair, forms, THETA, gap=GAP, programs=budget(25)))
        print(f"both bounds          {seconds:.2f} s, {found.programs} programs, gap {found.gap:.2%}")
        seconds = statistics.median(timed(lambda: locate(pair, measured))[0] for _ in range(5))
        print(f"losses               {seconds:.2f} s")
        if chosen.random:
            on_random_problems(chosen.random)
