"""The theta of a run: given, or chosen by the theory."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from ndtheory import EnergyBounds, evaluate_energy, exact
from ndtheory.energy_norms import predicted_factor, predicted_theta
from ndtheory.keys import Part, key
from ndtheory.number import Numeric
from verification.algorithm.rates import steps
from verification.algorithm.relaxation import Rule, rule_of
from verification.constants import Measured, measure
from verification.interface.pair import ContactPair
from verification.problem.readers import read_theta

#: A theta chosen for the user stays below 1 by this much, however soft the contact body.
CLOSEST_TO_ONE = 1 - 1e-6

#: An automatic theta is the predicted one if the proved one takes more than so many times its steps.
TOO_SLOW = 2


def energy_bounds(measured: Measured) -> EnergyBounds | None:
    """Evaluate the theorem in energy norms for measured constants; None where they do not exist."""
    constants = measured.energy_constants()
    return None if constants is None else evaluate_energy(constants)


@dataclass(frozen=True, kw_only=True)
class Choice(Part):
    """The theta of a run and where it comes from.

    ``rho`` is known where it was needed.  ``unused`` is the theta that was given to a rule which takes its own step,
    with its key; empty where there is none.
    """

    theta: Fraction = key("relaxation factor", of=float, type="number")
    source: str = key("`given`, `proved`, `predicted`, or the rule that takes its own step")
    why: str = key("why this one", default="given by the problem or beside it")
    rho: float | None = None
    unused: str = ""

    @property
    def warnings(self) -> list[str]:
        """A setting that has no effect."""
        return [f"{self.unused} is not used: {self.source} takes its step from rho"] if self.unused else []


def choose(
    pair: ContactPair, theta: Numeric | None = None, measured: Measured | None = None, *, rule: Rule | str | None = None
) -> Choice:
    """Choose the theta of a run: the given one, else the problem's; for "auto" that of :func:`automatic`.

    A rule that takes its step from rho does so whatever theta is.  The constants of ``measured`` are not measured
    again; the rule is the pair's by default.

    Raises
    ------
    HypothesisError
        A given theta outside (0, 1).
    ProblemError
        The Neumann body is an obstacle, and theta is not a number.
    """
    wanted = pair.settings.theta if theta is None else read_theta(theta)
    relaxation = rule_of(rule or pair.settings.relaxation)
    if wanted != "auto" and not relaxation.needs_rho:
        return Choice(theta=wanted, source="given")
    if pair.neumann.rigid and pair.problem is not None:
        needed = "needed a number, and a rule that takes it: opposite an obstacle rho is 0, and nothing is predicted"
        raise pair.problem.refuse("iteration.theta", "auto" if wanted == "auto" else relaxation.name, needed)
    measured = measured or measure(pair)
    energy = energy_bounds(measured)
    assert measured.rho_max is not None  # the two bodies have interface matrices
    rho = (measured.rho_max if energy is None else energy.rho).value
    own = relaxation.own_step(rho) if relaxation.needs_rho else None
    if own is not None:
        why = f"the step of the {relaxation.words} for this rho"
        # a rule named in the call replaces the file's, and with it the theta that was meant for that one
        meant = theta is not None or pair.settings.relaxation == relaxation.name
        key = "iteration.theta" if theta is None else "theta"
        unused = f"{key} = {float(wanted):g}" if meant and wanted != "auto" else ""
        return Choice(theta=below_one(own), source=relaxation.name, rho=rho, why=why, unused=unused)
    if wanted != "auto":
        return Choice(theta=wanted, source="given", rho=rho)
    if energy is None:
        return by_prediction(rho, measured.why_no_energy)
    return automatic(energy, pair.outside, pair.settings.tolerance)


def automatic(energy: EnergyBounds, outside: Sequence[str] = (), tolerance: float = 1e-9) -> Choice:
    """Choose the proved theta, unless it is predicted to need more than twice as many steps as the predicted one.

    Both thetas are judged by one formula, :func:`ndtheory.energy_norms.predicted_factor`.  The proved factor would be
    no fair judge: with friction it is far from attained.  ``outside`` says why the theorem does not apply to the
    problem, and ``tolerance`` is the one to which steps are counted.

    Examples
    --------
    >>> from ndtheory import EnergyConstants
    >>> chosen = automatic(evaluate_energy(EnergyConstants(rho=2)))
    >>> chosen.source, chosen.theta
    ('proved', Fraction(1, 2))
    """
    rho = energy.rho.value
    predicted = below_one(energy.theta_predicted)
    if outside or energy.theta_proved is None:
        nothing = outside[0] if outside else "the energy bound is 1 or more for every theta"
        return Choice(theta=predicted, source="predicted", rho=rho, why=f"no theta is proved: {nothing}")
    proved = below_one(energy.theta_proved)
    needs = lambda theta: steps(predicted_factor(theta, Fraction(rho)), tolerance) or math.inf
    of_proved, of_predicted = needs(proved), needs(predicted)
    if of_proved > TOO_SLOW * of_predicted:
        why = f"{of_predicted} steps predicted, against {of_proved} at the proved theta {float(proved):.4g}"
        return Choice(theta=predicted, source="predicted", rho=rho, why=why)
    why = f"{of_proved} steps expected, at most twice the {of_predicted} of the predicted theta {float(predicted):.4g}"
    if energy.friction_multiple is None:
        why = "without friction the predicted one is proved"
    return Choice(theta=proved, source="proved", rho=rho, why=why)


def by_prediction(rho: float, why: str) -> Choice:
    """Choose the predicted theta, where no theorem applies to the problem."""
    theta = below_one(float(predicted_theta(Fraction(rho))))
    return Choice(theta=theta, source="predicted", rho=rho, why=f"no theta is proved: {why}")


def below_one(theta: float) -> Fraction:
    """Return a theta chosen for the user, below 1."""
    return exact(min(theta, CLOSEST_TO_ONE))
