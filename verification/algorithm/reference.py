"""The algorithm by cvxpy only: every step II is the program's own answer.

The active set solves step II to rounding, so that two runs with its digits agree to the last one and test nothing.
Here each T g is the answer of the convex program, and its error is the distance from the certified T at the same g.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice

from ndtheory.keys import Part, key
from verification.algorithm.fixed_point import FixedPointMap, iterate_at, iterates
from verification.algorithm.iterate import Iterate
from verification.algorithm.rates import rate_of
from verification.algorithm.runs import Run
from verification.contact.step import ProgramStep

#: A run that gives the program more steps, or more pairs of contact nodes in all its steps, is compared at its first
#: and at its last step: 350,000 pairs, 17 steps on 143 contact nodes, take some 2 s.  No clock decides, so that a
#: busy machine answers as an idle one.
MOST_STEPS, MOST_PAIRS = 50, 350_000


@dataclass(frozen=True, kw_only=True)
class Reference(Part):
    """A run by cvxpy's own answers beside the run it refers to.

    The difference is relative to the ``scale`` of the iterate.  ``why`` says why the run was not repeated, or shows no
    rate.
    """

    steps: int = key("how many evaluations of T were repeated")
    whole: bool = key("whether the whole run was; otherwise only its first and last step were")
    observed_rate: float | None = key(
        "the rate that they show", null="where they show none", why=lambda found: found.why
    )
    largest_difference: float = key("of both answers for T g in the norm (5.21), relative")
    why: str = ""


def by_cvxpy_alone(run: Run) -> Reference:
    """Repeat a run from its start with every step II taken from cvxpy's own answer.

    A run of more than :data:`MOST_STEPS` evaluations, or one whose steps give the program more than
    :data:`MOST_PAIRS` pairs of contact nodes, is compared only at its first and last iterate.

    Raises
    ------
    ContactError
        The program gave no answer.
    """
    pair, exact = run.pair, FixedPointMap(run.pair)
    program = FixedPointMap(pair, step=ProgramStep)
    nodes = pair.contact.grid.n
    if run.evaluations > MOST_STEPS or run.evaluations * nodes**2 > MOST_PAIRS:
        many = f"the run took {run.evaluations} evaluations on {nodes} contact nodes"
        return _at_the_ends(run, program, f"{many}; first and last step alone")
    step = run.rule.begin(pair, float(run.theta), run.choice.rho)
    seen: list[Iterate] = []
    errors: list[float] = []
    for found in islice(iterates(program, step, run.start.g, run.start.scale), run.evaluations):
        seen.append(found)
        errors.append(pair.neumann.dual_norm(found.image - iterate_at(exact, found.g).image))
    rate = rate_of([found.residual for found in seen], errors, [found.contact.pattern for found in seen])
    return Reference(
        steps=len(seen),
        whole=True,
        observed_rate=None if rate is None else rate.value,
        largest_difference=max(_over(error, own.scale) for error, own in zip(errors, run.iterates, strict=True)),
        why="" if rate is not None else "fewer than two step ratios are clear of the program's errors",
    )


def _at_the_ends(run: Run, program: FixedPointMap, why: str) -> Reference:
    ends = run.iterates[:1] + run.iterates[1:][-1:]
    norm = run.pair.neumann.dual_norm
    errors = [_over(norm(iterate_at(program, end.g).image - end.image), end.scale) for end in ends]
    return Reference(steps=len(ends), whole=False, observed_rate=None, largest_difference=max(errors), why=why)


def _over(error: float, scale: float) -> float:
    return error / scale if scale > 0 else error
