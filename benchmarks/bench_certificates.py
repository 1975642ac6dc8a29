"""Certificates on Section 6: checking one beside the bound in doubles; and attempts to have false ones accepted.

python benchmarks/bench_certificates.py [--full] [--largest NODES] [--tampered N] [--random N]

With --tampered N (1000 with --full): one letter of a certificate is changed, N times.  What is accepted must have a
factor at or above the largest one found and name the bodies of the problem, or others.  With --random N (1000 with
--full): on random problems a factor just below the largest one found, with multipliers of a solver, must be refused.
"""

from __future__ import annotations

import json
import random
from fractions import Fraction
from typing import Any

import numpy as np
from models import of_section_6
from recording import Record, options, report, row
from timing import in_turn

import verification as vf
from verification.certificate import check
from verification.certificate.claims import NoCertificate
from verification.ledger.cases import problem as random_problem
from verification.semidefinite.multipliers import QuadraticForms

#: Contact nodes and rounds.
SIZES = {7: 5, 13: 5, 25: 3, 49: 1}


def in_doubles(pair: vf.ContactPair, measured: vf.Measured) -> None:
    QuadraticForms(pair, measured).factor(float(pair.settings.theta))


def with_one_letter_changed(text: str, drawn: random.Random) -> Any:
    at = drawn.choice([i for i, letter in enumerate(text) if letter.isdigit() or letter in '-/"'])
    return json.loads(text[:at] + drawn.choice("0123456789-/") + text[at + 1 :])


def tamper(count: int) -> None:
    """Tampered certificates of Section 6 on its coarsest mesh."""
    problem = vf.example("section6-60")
    document = vf.certify(problem).to_dict()
    text = json.dumps({name: document[name] for name in ("claim", "discrete")})
    drawn, outcomes = random.Random(1), {"unreadable": 0, "refused": 0, "accepted": 0, "of other bodies": 0}
    while sum(outcomes.values()) < count:
        try:
            given = {**document, **with_one_letter_changed(text, drawn)}
        except ValueError:
            outcomes["unreadable"] += 1
            continue
        given["sha256"] = check.digest(given["discrete"])  # a forger does that, too
        try:
            found = vf.check_again(given, problem)
        except ValueError:
            outcomes["unreadable"] += 1
            continue
        if not found.accepted:
            outcomes["refused"] += 1
        elif not found.same:
            outcomes["of other bodies"] += 1
        else:
            outcomes["accepted"] += 1
            assert given["claim"]["theta"] != document["claim"]["theta"] or Fraction(
                given["claim"]["factor"]
            ) >= Fraction(document["lower"])
    print(f"{count} tampered certificates: " + ", ".join(f"{n} {name}" for name, n in outcomes.items()))


def below_the_truth(count: int) -> None:
    """Claims just below the largest factor found, on random problems."""
    refused, without, gaps = 0, 0, []
    for seed in range(count):
        generator = np.random.default_rng(seed)
        problem = random_problem(generator, None, matching=bool(seed % 3))
        try:
            pair = vf.build(problem)
            theta = min(2 / (2 + vf.measure(pair).rho_max.value) * generator.uniform(0.3, 1.1), 0.97)
            made = vf.certify(problem.changed(friction=pair.friction / 4), theta=f"{theta:.3g}")
        except (NoCertificate, vf.ProblemError):
            without += 1
            continue
        document = made.to_dict()
        assert vf.check_again(document).accepted
        gaps.append(float(made.factor) / made.lower - 1)
        document["claim"] = {**made.claim, "factor": str(Fraction(made.lower) * (1 - Fraction(1, 10**9)))}
        assert not vf.check_again(document).accepted, seed
        refused += 1
    print(f"{refused} claims 1e-9 below a factor that occurs refused, {without} problems without a certificate")
    print(f"proved over attained: median {np.median(gaps):.2%}, 90 % within {np.quantile(gaps, 0.9):.2%} above")


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--tampered", type=int, metavar="N", help="certificates with one letter changed")
    parser.add_argument("--random", type=int, metavar="N", help="false claims on random problems")
    chosen = parser.parse_args()
    rows = []
    for nodes, rounds in SIZES.items():
        if nodes > chosen.largest:
            break
        pair, measured = of_section_6(nodes)
        assert pair.problem is not None
        document = vf.certify(pair.problem).to_dict()
        ours = lambda document=document: check.examine(document)
        rows.append(row(nodes, in_turn(ours, lambda p=pair, m=measured: in_doubles(p, m), rounds=rounds)))
    record = Record(
        name="certificates",
        place=10,
        title="Checking a certificate of contraction",
        ours="the checker, from rational data to the decision",
        other="the semidefinite bound in doubles, one factor",
        peer="doubles",
        size="contact nodes",
        rows=tuple(rows),
        wanted="less than 10 s at 25 nodes and less than 20 s at 49",
    )
    report(record, chosen.record)
    if count := 1000 if chosen.tampered is None and chosen.full else chosen.tampered:
        tamper(count)
    if count := 1000 if chosen.random is None and chosen.full else chosen.random:
        below_the_truth(count)


if __name__ == "__main__":
    main()
