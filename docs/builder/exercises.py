"""The answers to exercises of the course and to their usual mistakes: computed here, recorded for ``vf.check``.

``python docs/builder/exercises.py`` writes the record; a test computes it again.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import eigh

import verification as vf
from ndtheory import PRINTED, Constants, energy_norms, evaluate
from ndtheory.moduli import Moduli, half_planes
from verification.algorithm.affine_piece import piece_of
from verification.algorithm.rates import StepRatio
from verification.bounds.verdicts import judge
from verification.constants.measuring import normal_pencil
from verification.interface.pair import ContactPair
from verification.semidefinite.losses import locate

RECORD = Path(__file__).resolve().parents[2] / "verification" / "data" / "exercises.json"

Numbers = Sequence[Any]

#: Mistakes in an answer that any exercise may have whose answer is neither a verdict nor a number of steps.
ANSWER: dict[str, Callable[[float], float]] = {
    "Is the quotient upside down?": lambda x: 1 / x,
    "Did you exchange theta and 1 - theta?": lambda x: 1 - x,
    "Is this 1 + lambda in place of lambda?": lambda x: 1 + x,
    "Is the sign right?": lambda x: -x,
    "Is a factor 2 missing?": lambda x: x / 2,
    "Is there a factor 2 too many?": lambda x: 2 * x,
    "Is a root still to be taken?": lambda x: x**2,
    "Is this in degrees? Take radians.": math.degrees,
}

# Mistakes in what an answer is computed from.
OTHER_BODY = "Did you take the other body?"
SQUARE = "Did you forget a square?"
ROOT = "Did you forget a root?"
OPEN = "Is the 1 of 1 + rho there? It stands for open nodes."
TIED = "Does this serve open nodes too?"


@dataclass(frozen=True)
class Exercise:
    """An exercise: what it asks, the answer as a function of some numbers, and mistakes as functions of the same."""

    asks: str
    answer: Callable[..., Numbers]
    given: Callable[[], Numbers]
    mistakes: dict[str, Callable[..., Numbers]] = field(default_factory=dict)

    def wrong(self, numbers: Numbers, right: Numbers) -> Iterator[tuple[str, list[Any]]]:
        """What each mistake leads to."""
        for hint, mistake in self.mistakes.items():
            yield hint, list(mistake(*numbers))
        for hint, change in ANSWER.items() if all(isinstance(x, float) for x in right) else ():
            with suppress(ArithmeticError):
                yield hint, [change(x) for x in right]

    def record(self) -> dict[str, Any]:
        """The answer, and what each mistake leads to; what the exercise says of a mistake counts first."""
        numbers = self.given()
        right = list(self.answer(*numbers))
        wrong: dict[str, list[Any]] = {}
        for hint, found in self.wrong(numbers, right):
            wrong.setdefault(hint, found)
        return {"asks": self.asks, "right": right, "wrong": wrong}


def measured(name: str, key: str, *bodies: int, **changes: Any) -> list[float]:
    """A constant of a built-in problem, for each body as the Neumann body."""
    problem = vf.example(name).changed(**changes)
    return [getattr(vf.measure(problem.changed(neumann_body=body)), key).value for body in bodies]


def bonded(**changes: Any) -> tuple[float, float]:
    """The ends of the spectrum of the plates of ``spectrum``."""
    found = vf.measure(vf.example("section6").changed(cells=((10, 2), (6, 2)), radius="0.2", friction=0, **changes))
    return found.rho_min.value, found.rho_max.value


def decay(rho: float) -> float:
    """Steps to 1e-9 that the best theta promises, in fractions of a step."""
    return math.log(1e-9) / math.log(energy_norms.predicted_rate(rho))


def steps(rho: float) -> int:
    """Steps to 1e-9 that the best theta promises."""
    return math.ceil(decay(rho))


def thetas(rho: float) -> Numbers:
    """What the exercise on two bars asks."""
    return rho, 1 / (1 + rho), energy_norms.predicted_theta(rho), 2 / (1 + rho)


def last_theta() -> tuple[float, float]:
    """The numbers of the last theta: rho and kappa_1 at the largest friction."""
    found = vf.measure(vf.example("section6").changed(cells=((20, 3), (12, 3))))
    edge = found.with_friction(found.friction_limit.value * (1 - 1e-6))
    return edge.rho_max.value, edge.kappa_1.value


def verdicts(error: float, *ratios: float) -> list[str]:
    """The verdicts on a bound of 0.5, for ratios known to within an error."""
    seen = (StepRatio(value=x, lo=x - error, hi=x + error, steps=9) for x in ratios)
    return [judge(0.5, ratio, "").verdict for ratio in seen]


def readings(theta: float, ratio: float) -> list[float]:
    """The smallest rho of each reading of a run."""
    found = {reading.kind: reading.lo for reading in vf.advise_run(theta, ratio).readings}
    return [found["mode-high"], found["mode-low"]]


def cost(rho: float) -> float:
    """How many times as many steps 1/(1 + rho) takes as 2/(2 + rho)."""
    return math.log(energy_norms.predicted_rate(rho)) / math.log(rho / (1 + rho))


def limit(nu: float) -> float:
    """The half-plane limit with a Poisson's ratio of the Neumann body."""
    upper, lower = Moduli(young=20000, poisson="0.3"), Moduli(young=70000, poisson=str(nu))
    return float(half_planes(upper, lower).high)


def ends_of(t1: float, q1: float, t2: float, q2: float, less: float = 1) -> Numbers:
    """Both ends of a spectrum, and the best theta, from two logs."""
    low, high = (1 - q1) / t1, (1 + q2) / t2
    return low - less, high - less, 2 / (low + high)


def by_hand(rho: float, a: float, b: float) -> Numbers:
    """k_s and k_e of the single node."""
    return energy_norms.friction_multiple(a, b), energy_norms.friction_limit(rho, a, b)


def half_way() -> tuple[float, int, int]:
    """The rate that the run of the page forecasts, the step at which it does, and the step of its end."""
    forecast = pressed().linearise().forecast
    assert forecast is not None
    return forecast.rate, forecast.made_at_iteration, forecast.iterations


def pressed() -> vf.Run:
    """The run of the page on predictions."""
    return vf.run(vf.example("section6").changed(cells=((20, 4), (12, 4)), theta="0.5"))


def spectrum_of_step() -> tuple[float, float, float]:
    """rho of these plates, and the ends of the spectrum of T' at their solution, which is real."""
    run = pressed()
    piece = piece_of(run.pair, run.last.g, run.last.contact.pattern)
    values = np.sort(np.linalg.eigvals(piece.jacobian).real)
    return vf.measure(run.pair).rho_max.value, float(values[0]), float(values[-1])


def all_thetas(rho: float, low: float, high: float) -> Numbers:
    """The least ``max |1 - theta + theta mu|``, its theta, and 2/(2 + rho)."""
    theta = 2 / (2 - low - high)
    return 1 - theta + theta * high, theta, 2 / (2 + rho)


def normal_ends() -> list[float]:
    """The ends of the spectrum of the pressed plates of ``open_or_closed``, for normal displacements."""
    plates = vf.example("section6").changed(friction=0, young=(20000, 40000), cells=((10, 2), (6, 2)))
    values = eigh(*normal_pencil(vf.build(plates)), eigvals_only=True)
    return [float(values[0]), float(values[-1])]


@cache
def plates() -> ContactPair:
    """The plates of ``printed_theorem``."""
    return vf.build(vf.example("section6"))


def constants() -> Constants:
    """Their constants."""
    return vf.measure(plates()).constants()


def power(of: Constants) -> list[float]:
    """The power of m that is nearest to the quotient of the printed and the repaired bound, without their roots."""
    m, S = float(of.m), float(of.M * of.C_R + of.C_K)
    return [float(round(math.log(m**3 * (S + 1) / (S / m + 1), m)))]


def slope(of: Constants) -> list[float]:
    """The power of the unit of stress by which the printed threshold grows where m is a large number."""
    ends = []
    for power in (-8, -6):
        unit = of.m * Fraction(10) ** power
        scaled = Constants(m=of.m / unit, M=of.M / unit, C_R=of.C_R, C_s=of.C_s / unit, C_tr=of.C_tr, k=of.k)
        ends.append(evaluate(PRINTED, scaled).C2.value)
    return [math.log10(ends[1] / ends[0]) / 2]


def bar() -> float:
    """The decades that (5.23) loses."""
    return next(loss.decades for loss in locate(plates(), vf.measure(plates())).friction if loss.label == "(5.23)")


EXERCISES = {
    "two_bars.1": Exercise(
        "both ends of the interval of g", lambda rho: (0.1, 0.1 * (1 + 1 / rho)),
        lambda: measured("two-bars", "rho_max", 2),
        {"Is it divided by theta in place of 1 - theta?": lambda rho: (0.1, 0.1 * (1 + rho)),
         "Is it the force of the other bar?": lambda rho: (0.1 * rho, 0.1 * (1 + rho))},
    ),
    "two_bars.2": Exercise(
        "rho, 1/(1+rho), 2/(2+rho) and the limit of theta", thetas, lambda: measured("two-bars", "rho_max", 1),
        {OTHER_BODY: lambda rho: thetas(1 / rho), OPEN: lambda rho: (rho, 1 / rho, 1 / (1 + rho), 2 / rho),
         "Does a theta above 1 converge too? The limit may exceed 1.": lambda rho: (*thetas(rho)[:3], 1)},
    ),
    "two_bars.3": Exercise(
        "m for E = L = 1", lambda t: [1 / (1 + 1 / t**2)], lambda: [math.pi / 2],
        {SQUARE: lambda t: [1 / (1 + 1 / t)], "Is the frequency upside down?": lambda t: [1 / (1 + t**2)],
         "This is the ratio t of the integrals. What is m with it?": lambda t: [t**2]},
    ),
    "open_or_closed.1": Exercise(
        "theta, and its factor",
        lambda low, high: (energy_norms.tied_theta(low, high), energy_norms.tied_rate(low, high)), normal_ends,
        {TIED: lambda low, high: (energy_norms.predicted_theta(high), energy_norms.predicted_rate(high)),
         "Is that the factor of an open node? All nodes stay closed.": lambda low, high: (
             energy_norms.tied_theta(low, high), 1 - energy_norms.tied_theta(low, high)),
         "Is the 1 of 1 + lambda there, for both ends?": lambda low, high: (
             2 / (low + high), (high - low) / (high + low)),
         "This makes the factor of the largest lambda 0. What becomes of the smallest?": lambda low, high: (
             1 / (1 + high), (high - low) / (1 + high)),
         "This is the limit, where the factor of the largest lambda is -1.": lambda low, high: (2 / (1 + high), 1.0)},
    ),
    "open_or_closed.2": Exercise(
        "the ratio of the steps for rho = 1, and its limit for large rho", lambda *rho: [cost(x) for x in rho],
        lambda: [1, 1e8],
        {"Is it a ratio of the factors? The steps are in the ratio of their logarithms.": lambda *rho:
         [(x / (1 + x)) / energy_norms.predicted_rate(x) for x in rho]},
    ),
    "open_or_closed.3": Exercise(
        "both theta for rho = 3", lambda rho: (1 / (1 + rho), 2 / (1 + rho)), lambda: [3],
        {OPEN: lambda rho: (1 / rho, 2 / rho),
         "Is that the theta of the best rate? It has the largest fall.": lambda rho: [2 / (2 + rho)] * 2},
    ),
    "spectrum.1": Exercise(
        "how many times as many steps with the lower plate as Neumann body, and with the upper one",
        lambda low, high: [
            math.log(energy_norms.tied_rate(a, b)) / math.log(energy_norms.predicted_rate(b))
            for a, b in ((low, high), (1 / high, 1 / low))
        ],
        bonded,
        {"Is it a ratio of the factors? The steps are in the ratio of their logarithms.": lambda low, high: [
            energy_norms.predicted_rate(b) / energy_norms.tied_rate(a, b) for a, b in ((low, high), (1 / high, 1 / low))
        ]},
    ),
    "spectrum.2": Exercise(
        "the largest eigenvalue, the bonded optimum and the contact optimum of case (b)",
        lambda low, high: (high, energy_norms.tied_theta(low, high), energy_norms.predicted_theta(high)),
        lambda: bonded(young=(700000, 20000)),
        {"Did you change the modulus of the contact body?": lambda low, high: (
            100 * high, energy_norms.tied_theta(100 * low, 100 * high), energy_norms.predicted_theta(100 * high)),
         "Is this case (a)?": lambda low, high: (
            10 * high, energy_norms.tied_theta(10 * low, 10 * high), energy_norms.predicted_theta(10 * high))},
    ),
    "spectrum.3": Exercise(
        "nu_n, and the limit there over the limit for nu_n = 0", lambda nu: (nu, limit(nu) / limit(0)), lambda: [0.5],
        {"Does G_n depend on nu_n too?": lambda nu: (nu, (3 - 4 * nu) / 3)},
    ),
    "which_side.1": Exercise(
        "E1/E2", lambda lower, upper: [math.sqrt(lower / upper)],
        lambda: measured("section6", "rho_max", 1, 2, cells=((20, 3), (12, 3)), young=(20000, 20000)),
        {OTHER_BODY: lambda lower, upper: [math.sqrt(upper / lower)], ROOT: lambda lower, upper: [lower / upper],
         "Have the plates the same shape? Compare both rho at equal moduli.": lambda lower, upper: [1.0],
         "This is rho of the lower body. At which ratio is it that of the upper one?": lambda lower, upper: [lower],
         "This is rho of the upper body. At which ratio is it that of the lower one?": lambda lower, upper: [upper]},
    ),
    "which_side.2": Exercise(
        "the least rho for the mode of the largest eigenvalue, and for the smallest", readings, lambda: [0.5, 0.45],
        {"Is the ratio divided by theta before 1 is added?": lambda theta, q: (q / theta, (1 - q / theta) - 1)},
    ),
    "which_side.3": Exercise(
        "the promised steps with the lower body as Neumann body, and with the upper one",
        lambda *rho: [*map(steps, rho)],
        lambda: measured("section6", "rho_normal", 1, 2, cells=((20, 3), (12, 3)), friction=0),
        {OTHER_BODY: lambda *rho: [steps(x) for x in reversed(rho)],
         "Is this 1/(1 + rho)? The promise is made for 2/(2 + rho).":
         lambda *rho: [math.ceil(math.log(1e-9) / math.log(x / (1 + x))) for x in rho],
         "Is it rounded up? A step is taken as a whole.": lambda *rho: [*map(decay, rho)],
         "Is it rounded down? The last step has to be taken too.": lambda *rho: [int(decay(x)) for x in rho]},
    ),
    "constants.1": Exercise(
        "the length", lambda full: [full / 2], lambda: [math.pi],
        {"Is this where m = E / 3? Half of E needs mu = 1.": lambda full: [full / math.sqrt(2)]},
    ),
    "constants.2": Exercise(
        "C_R for the length 10", lambda x: [math.sqrt((x / 3 + 1 / x) * math.tanh(x))], lambda: [10],
        {"Is this the short bar? C_R grows with the length.": lambda x: [1.0],
         "Where is the term 1/l?": lambda x: [math.sqrt(x / 3)]},
    ),
    "constants.3": Exercise(
        "the length under [norm]", lambda mm: [1 / mm], lambda: [0.001],
        {"Is it the other way round? One millimetre is how many micrometres?": lambda mm: [mm],
         "Square millimetres? A length is asked for.": lambda mm: [1 / mm**2]},
    ),
    "printed_theorem.1": Exercise(
        "the power of m", power, lambda: [constants()],
        {"That is the lost factor alone. Where else does m become 1?": lambda of: [1],
         "Those are the factors outside. What does the bracket gain?": lambda of: [3]},
    ),
    "printed_theorem.2": Exercise(
        "the slope", slope, lambda: [constants()],
        {"Does C_s in the denominator of k change with the unit, too?": lambda of: [slope(of)[0] - 1]},
    ),
    "printed_theorem.3": Exercise(
        "the decades gained, and those left of the bar", lambda won, bar: (won, bar - won),
        lambda: [math.log10(constants().M / constants().m), bar()],
        {"Does the estimate enter the bound squared?": lambda won, bar: (won / 2, bar - won / 2),
         "The figure rounds its bars. All digits are in losses.friction.": lambda won, bar: (won, round(bar, 1) - won)},
    ),
    "friction.1": Exercise(
        "k_s and k_e",
        by_hand, lambda: (1.0, math.sqrt(2), 1.0),
        {ROOT: lambda rho, a, b: by_hand(rho, a**2, b**2),
         "Did you exchange the bodies of C_t1 and C_t2?":
         lambda rho, a, b: by_hand(rho, b, a),
         "The entry of S_n is the square of C_s. Did you take its root?":
         lambda rho, a, b: by_hand(rho, math.sqrt(2) * a, math.sqrt(2) * b),
         "Is C_s from the contact body? It belongs to the Neumann body.":
         lambda rho, a, b: by_hand(rho, math.sqrt(2 / 3) * a, math.sqrt(2 / 3) * b),
         "Are C_t1 and C_t2 from S? They are from its inverse.":
         lambda rho, a, b: by_hand(rho, math.sqrt(4 / 3) * a, 2 * b),
         "Is rho the largest eigenvalue of S_c alone? It is that of S_c against S_n.":
         lambda rho, a, b: by_hand(2 * rho, a, b)},
    ),
    "friction.2": Exercise(
        "the k from which there are three", lambda slip: [(3 * slip - 1) / (slip - 3)], lambda: [12],
        {"This is necessary only. Does the slip have the right direction?": lambda slip: [3.0],
         "Does the normal force give no tangential jump? F_TN is not 0.": lambda slip: [3 * slip / (slip - 3)],
         "Is the sign of F_TN right?": lambda slip: [(3 * slip + 1) / (slip - 3)],
         "Is F the inverse of S_c alone? The Neumann body belongs to it.": lambda slip: [2.0],
         "This is k_e, below which there is one solution.": lambda slip: [
             energy_norms.friction_limit(1.0, math.sqrt(2), 1.0)]},
    ),
    "friction.3": Exercise(
        "k_s with the roles of the model, and with the roles exchanged",
        lambda *found: [each.friction_threshold.value for each in found],
        lambda: [vf.measure(vf.example("section6").changed(neumann_body=body)) for body in (1, 2)],
        {"This is k_e, below which some theta contracts. Where does every small theta?": lambda *found:
         [each.friction_limit.value for each in found],
         OTHER_BODY: lambda *found: [each.friction_threshold.value for each in reversed(found)]},
    ),
    "theorem_and_experiment.2": Exercise(
        "the three verdicts", lambda *ratios: verdicts(0.01, *ratios), lambda: (0.52, 0.48, 0.501),
        {"Does the ratio exceed the bound by more than its own error?": lambda *ratios: verdicts(0, *ratios),
         "Is the error of a ratio as large as its distance from the bound?": lambda *ratios: verdicts(0.03, *ratios),
         "Which of the two refutes a bound, a ratio above it or one below it?":
         lambda *ratios: verdicts(0.01, *(1 - x for x in ratios)),
         "Can a ratio be said to be below the bound if the bound lies within its error?":
         lambda *ratios: [*verdicts(0.01, *ratios[:2]), "CONSISTENT"],
         "The bound applies to each run. What does the comparison with its ratio say?":
         lambda *ratios: ["HYPOTHESES_NOT_MET"] * len(ratios)},
    ),
    "theorem_and_experiment.3": Exercise(
        "theta at k_e", lambda rho, a: [(2 - a * math.sqrt(rho)) / (2 + rho - a * math.sqrt(rho))], last_theta,
        {"Did you forget the root of rho?": lambda rho, a: [(2 - a * rho) / (2 + rho - a * rho)],
         "This is the theta that is predicted as best.": lambda rho, a: [2 / (2 + rho)]},
    ),
    "prediction.1": Exercise(
        "the number of further steps, and the step at which the run ends",
        lambda rate, made, end: (math.ceil(-4.5 / math.log10(rate)), end), half_way,
        {"Does the residual still have to fall by nine decades? It has fallen by half of them.": lambda rate, made, end:
         (math.ceil(-9 / math.log10(rate)), made + math.ceil(-9 / math.log10(rate))),
         "Are these counted from the start? The run is at the step of the forecast.": lambda rate, made, end:
         (end, made + end),
         "Is this a natural logarithm? 4.5 counts powers of ten.": lambda rate, made, end:
         (math.ceil(-4.5 / math.log(rate)), made + math.ceil(-4.5 / math.log(rate))),
         "Is it rounded up? A step is taken as a whole.": lambda rate, made, end:
         (-4.5 / math.log10(rate), made - 4.5 / math.log10(rate)),
         "Is it rounded down? The last step has to be taken too.": lambda rate, made, end:
         (int(-4.5 / math.log10(rate)), made + int(-4.5 / math.log10(rate))),
         "The second number is the step at which the run ends, from the start.": lambda rate, made, end:
         (end - made, end - made)},
    ),
    "prediction.3": Exercise(
        "the least rho(J), its theta, and 2/(2+rho)", all_thetas, spectrum_of_step,
        {"Is the sign of an eigenvalue of T' lost?":
         lambda rho, low, high: (max(abs(low), abs(high)), 1.0, 2 / (2 + rho)),
         "Is this the spectrum of T'? That of J is 1 - theta + theta mu.": lambda rho, low, high:
         (high, *all_thetas(rho, low, high)[1:])},
    ),
    "other_code.1": Exercise(
        "the smallest and the largest eigenvalue, and the best theta", ends_of, lambda: (0.1, 0.85, 0.22, 0.76),
        {"Is this 1 + lambda in place of lambda?": lambda *logs: ends_of(*logs, less=0),
         "Does the other reading of each log fit the other log?":
         lambda t1, q1, t2, q2: ((1 - q2) / t2 - 1, (1 + q1) / t1 - 1, 2 / ((1 - q2) / t2 + (1 + q1) / t1)),
         "Did you forget the 1 of 1 + lambda in theta?":
         lambda *logs: (*ends_of(*logs)[:2], 2 / sum(ends_of(*logs)[:2])),
         "Is this 2/(2 + rho)? No node of bonded blocks opens.": lambda *logs: (
             *ends_of(*logs)[:2], energy_norms.predicted_theta(ends_of(*logs)[1])),
         "Is the softest mode the slowest in both logs?": lambda t1, q1, t2, q2: ends_of(t2, q2, t1, -q1),
         "Is the stiffest mode the slowest in both logs?": lambda t1, q1, t2, q2: ends_of(t2, -q2, t1, q1)},
    ),
}  # fmt: skip


def text() -> str:
    """The record as it is in its file; numbers to nine digits, which all machines share."""
    short = lambda x: float(f"{x:.9g}") if isinstance(x, float) else x
    found = {name: exercise.record() for name, exercise in EXERCISES.items()}
    for record in found.values():
        record["right"] = [*map(short, record["right"])]
        record["wrong"] = {hint: [*map(short, numbers)] for hint, numbers in record["wrong"].items()}
    return "{\n" + ",\n".join(f"{json.dumps(name)}: {json.dumps(found[name])}" for name in found) + "\n}\n"


if __name__ == "__main__":
    RECORD.write_text(text(), encoding="utf-8")
