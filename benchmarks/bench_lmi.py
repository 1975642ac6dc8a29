"""The semidefinite bound on Section 6: what is made of its programs beside one of them.

python benchmarks/bench_lmi.py [--full] [--largest NODES] [--random N]

With --random N (100 with --full): how close branch and bound brings both bounds of the Lipschitz constant on N random
problems.
"""

from __future__ import annotations

import numpy as np
from models import of_section_6
from recording import Record, options, report, row
from timing import in_turn, timed

import verification as vf
from verification.ledger.cases import problem as random_problem
from verification.semidefinite import LMIError, interior_point
from verification.semidefinite.interior_point import Optimum, Program
from verification.semidefinite.lipschitz import GAP, budget, enclose
from verification.semidefinite.losses import locate
from verification.semidefinite.multipliers import QuadraticForms, friction_threshold

THETA = 0.7

#: Contact nodes.
SIZES = (7, 13, 25, 49)

#: Contact nodes up to which all that is made of the program is measured.
WHOLE, BOTH = 49, 25


def program_of(pair: vf.ContactPair, measured: vf.Measured) -> Program:
    """The program of the factor."""
    asked: list[Program] = []

    def solve(program: Program) -> Optimum:
        asked.append(program)
        return interior_point.solve(program)

    QuadraticForms(pair, measured, solver=solve).factor(THETA)
    return asked[0]


def whole(pair: vf.ContactPair, measured: vf.Measured) -> None:
    forms = QuadraticForms(pair, measured)
    forms.factor(THETA)
    forms.largest_theta()
    friction_threshold(pair, measured, measured.friction_threshold.value)


def both(pair: vf.ContactPair, measured: vf.Measured) -> None:
    enclose(pair, QuadraticForms(pair, measured), THETA, gap=GAP, programs=budget(pair.contact.grid.n))


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


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--random", type=int, metavar="N", help="branch and bound on N random problems")
    chosen = parser.parse_args()
    models = {nodes: of_section_6(nodes) for nodes in SIZES if nodes <= chosen.largest}
    programs = {nodes: program_of(*found) for nodes, found in models.items()}

    for place, name, title, what, call, most, wanted in (
        (7, "bound_whole", "The semidefinite bound", "the factor, the largest theta and the threshold of friction",
         whole, WHOLE, "less than 0.7 s at 25 nodes"),
        (9, "bound_losses", "What each inequality gives away", "the losses of all inequalities", locate, WHOLE, ""),
        (8, "bound_both", "Both bounds of the Lipschitz constant",
         f"branch and bound, down to a gap of {GAP:.0%} or until its budget of programs is spent", both, BOTH, ""),
    ):  # fmt: skip
        rows = []
        for nodes, (pair, measured) in models.items():
            if nodes > most:
                break
            pairs = in_turn(
                lambda call=call, pair=pair, measured=measured: call(pair, measured),
                lambda nodes=nodes: interior_point.solve(programs[nodes]),
                rounds=3,
            )
            rows.append(row(nodes, pairs))
        record = Record(
            name=name,
            place=place,
            title=title,
            ours=what,
            other="one program of the semidefinite bound at the same size, as a yardstick",
            peer="one program",
            size="contact nodes",
            rows=tuple(rows),
            wanted=wanted,
        )
        report(record, chosen.record)

    if count := 100 if chosen.random is None and chosen.full else chosen.random:
        on_random_problems(count)


if __name__ == "__main__":
    main()
