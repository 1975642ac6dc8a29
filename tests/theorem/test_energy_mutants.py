"""No mutated formula of the theorem in energy norms survives the comparison with the search."""

from fractions import Fraction as F

import pytest
from energy_oracle import differences, formula_differences, right_side, work

from ndtheory import EnergyConstants, energy_norms

pytestmark = pytest.mark.usefixtures("many_digits")

#: Below and above the turning theta, with either kappa, both and none; friction beyond the threshold; rho_normal.
WITNESSES = [
    ({"rho": F(3, 2), "kappa_1": F(1, 2), "kappa_2": F(1, 10)}, F(3, 10)),
    ({"rho": F(3, 2), "kappa_1": F(1, 2), "kappa_2": F(1, 10)}, F(3, 5)),
    ({"rho": F(1, 2), "kappa_1": F(0), "kappa_2": F(1, 3)}, F(9, 10)),
    ({"rho": F(1, 100), "kappa_1": F(1), "kappa_2": F(4, 5)}, F(1, 2)),
    ({"rho": F(5), "rho_normal": F(3)}, F(9, 20)),
    ({"rho": F(5), "rho_normal": F(3), "kappa_2": F(1, 4)}, F(1, 4)),
]


def departures(constants, theta) -> list[str]:
    constants = {"rho_normal": None, "kappa_1": F(0), "kappa_2": F(0), **constants}
    return differences(constants, theta) + formula_differences(constants, theta)


def refuted(witness) -> bool:
    """Whether a comparison fails, or cannot be made."""
    try:
        return departures(*witness) != []
    except (ArithmeticError, IndexError):
        return True


def scaled(name):
    """A formula made a tenth smaller."""
    formula = getattr(energy_norms, name)
    return lambda *arguments: (1 - arguments[0] / arguments[0] / 10) * formula(*arguments)


def turned(theta):
    return lambda rho, kappa_1, kappa_2: theta * rho / rho


def friction_inside(bend):
    """1 - q^2 below the turning theta with another friction term."""
    return lambda t, rho, k1, k2: t * (2 - t - 2 * (1 - t) * k2 - (bend(t, k1, 2 - (2 + rho) * t) if k1 else 0))


def with_interval(change):
    interval = energy_norms.contraction_interval
    return lambda *data: change(*found, *data[:3]) if (found := interval(*data)) else None


root_of, ratio_of, turn_of = energy_norms.sqrt, energy_norms.largest_ratio, energy_norms.turning_theta

#: name: (formula replaced, its replacement)
MUTANTS = {
    "no kappa_2 in r": ("largest_ratio", lambda rho, k1, k2: root_of(rho) + k1),
    "no kappa_1 in r": ("largest_ratio", lambda rho, k1, k2: ratio_of(rho, 0 * k1, k2)),
    "rho for sqrt(rho) in r": ("largest_ratio", lambda rho, k1, k2: ratio_of(rho**2, k1, k2)),
    "2 kappa_2 for 4 kappa_2 in r": ("largest_ratio", lambda rho, k1, k2: ratio_of(rho, k1, k2 / 2)),
    "r not halved": ("largest_ratio", lambda rho, k1, k2: 2 * ratio_of(rho, k1, k2)),
    "the other root": ("largest_ratio", lambda rho, k1, k2: ratio_of(rho, k1, k2) - root_of(rho) - k1),
    "no kappa_2 in f": ("work", lambda x, k1, k2: k1 * x - x * x),
    "no kappa_1 in f": ("work", lambda x, k1, k2: k2 - x * x),
    "x for x^2 in f": ("work", lambda x, k1, k2: k2 + k1 * x - x),
    "no factor 2 in (5.24)": (
        "square_at",
        lambda x, t, rho, k1, k2: (1 - t) ** 2 + t * (1 - t) * work(x, k1, k2) + t**2 * rho * x * x,
    ),
    "theta for theta^2 in (5.24)": (
        "square_at",
        lambda x, t, rho, k1, k2: (1 - t) ** 2 + 2 * t * (1 - t) * work(x, k1, k2) + t * rho * x * x,
    ),
    "sqrt(rho) for rho in (5.24)": ("square_at", lambda x, t, rho, k1, k2: right_side(x, t, root_of(rho), k1, k2)),
    "the worst x always r": ("worst_ratio", lambda t, *data: ratio_of(*data)),
    "the worst x kappa_1/2": ("worst_ratio", lambda t, rho, k1, k2: k1 / 2),
    "the end branch everywhere": ("turning_theta", turned(0)),
    "the inside branch everywhere": ("turning_theta", turned(1)),
    "turning at 2/(2 + rho)": ("turning_theta", lambda rho, k1, k2: 2 / (2 + rho)),
    "kappa_1 twice in the turning theta": (
        "turning_theta",
        lambda rho, k1, k2: (2 * (r := ratio_of(rho, k1, k2)) - 2 * k1) / ((2 + rho) * r - k1),
    ),
    "rho for sqrt(rho) at the end": (
        "one_minus_end",
        lambda t, rho, k1, k2: 1 - (1 - t * (1 + rho * ratio_of(rho, k1, k2))) ** 2,
    ),
    "q for q^2 at the end": (
        "one_minus_end",
        lambda t, rho, k1, k2: 1 - abs(1 - t * (1 + root_of(rho) * ratio_of(rho, k1, k2))),
    ),
    "kappa_1 not squared": ("one_minus_inside", friction_inside(lambda t, k1, bottom: (1 - t) ** 2 * k1 / bottom)),
    "1 - theta not squared": ("one_minus_inside", friction_inside(lambda t, k1, bottom: (1 - t) * k1**2 / bottom)),
    "no kappa_1 inside": ("one_minus_inside", friction_inside(lambda t, k1, bottom: 0)),
    "kappa_2 once inside": (
        "one_minus_inside",
        lambda t, rho, k1, k2: t * (2 - t - (1 - t) * k2 - ((1 - t) * k1) ** 2 / (2 - (2 + rho) * t)),
    ),
    "wrong branch": ("one_minus_inside", energy_norms.one_minus_end),
    "the other wrong branch": ("one_minus_end", energy_norms.one_minus_inside),
    "slope without its bend": ("slope_inside", lambda t, rho, k1, k2: 2 - 2 * t - 2 * (1 - 2 * t) * k2),
    "slope with kappa_1": (
        "slope_inside",
        lambda t, rho, k1, k2: (
            2
            - 2 * t
            - 2 * (1 - 2 * t) * k2
            - 2 * k1 * (1 - t) * (1 - 3 * t + (2 + rho) * t**2) / (2 - (2 + rho) * t) ** 2
        ),
    ),
    "kappa_1/4 for kappa_1^2/4": ("friction_number", lambda k1, k2: k2 + k1 / 4),
    "kappa_1^2/2 for kappa_1^2/4": ("friction_number", lambda k1, k2: k2 + k1**2 / 2),
    "no kappa_2 in the friction number": ("friction_number", lambda k1, k2: k1**2 / 4),
    "1 for 2 in the multiple": ("friction_multiple", lambda k1, k2: 1 / (k2 + root_of(k2**2 + k1**2))),
    "kappa_1 for kappa_1^2 in the multiple": ("friction_multiple", lambda k1, k2: 2 / (k2 + root_of(k2**2 + k1))),
    "one over the friction number": ("friction_multiple", lambda k1, k2: 1 / (k2 + k1**2 / 4)),
    "2/(1 + rho) predicted": ("predicted_theta", lambda rho: 2 / (1 + rho)),
    "1/(2 + rho) predicted": ("predicted_rate", lambda rho: 1 / (2 + rho)),
    "no open node in the predicted factor": ("predicted_factor", lambda t, rho: abs(1 - t * (1 + rho))),
    "an open node alone in the predicted factor": ("predicted_factor", lambda t, rho: abs(1 - t)),
    "theta rho with the printed sign": ("predicted_factor", lambda t, rho: max(1 - t, abs(1 - t + t * rho))),
    "an interval that always starts at 0": ("contraction_interval", with_interval(lambda lo, hi, *data: (0 * lo, hi))),
    "an interval capped at the turning theta": (
        "contraction_interval",
        with_interval(lambda lo, hi, *data: (lo, min(hi, turn_of(*data)))),
    ),
    "an interval never capped": (
        "contraction_interval",
        with_interval(lambda lo, hi, *data: (lo, 2 / (1 + root_of(data[0]) * ratio_of(*data)))),
    ),
    "the turning theta called best": ("best_theta", lambda *data: turn_of(*data[:3])),
    "no best theta": ("best_theta", lambda *data: None),
    **{
        f"0.9 {name}": (name, scaled(name))
        for name in [
            *("largest_ratio", "work", "square_at", "turning_theta", "worst_ratio", "one_minus_end"),
            *("one_minus_inside", "one_minus_square", "slope_inside", "friction_number", "friction_multiple"),
            *("predicted_theta", "predicted_rate", "predicted_factor", "best_theta"),
        ]
    },
}


def test_the_theorem_in_energy_norms_passes_on_every_witness():
    assert [departures(*witness) for witness in WITNESSES] == [[]] * len(WITNESSES)


@pytest.mark.parametrize(("name", "formula"), MUTANTS.values(), ids=MUTANTS)
def test_no_mutated_formula_of_the_energy_norms_survives_the_comparison(monkeypatch, name, formula):
    monkeypatch.setattr(energy_norms, name, formula)
    assert any(map(refuted, WITNESSES))


@pytest.mark.parametrize(
    "rule", [lambda c: c.rho, lambda c: c.rho_normal or c.rho], ids=["rho always", "rho_normal always"]
)
def test_the_comparison_knows_which_rho_is_at_work(monkeypatch, rule):
    monkeypatch.setattr(EnergyConstants, "at_work", property(rule))
    assert any(map(refuted, WITNESSES))
