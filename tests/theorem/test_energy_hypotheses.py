"""Each hypothesis on the constants of the energy norms, just broken and just kept, and the written form."""

import json
from dataclasses import fields
from fractions import Fraction as F

import pytest
import strategies
from energy_oracle import FIELDS, energies
from hypothesis import given
from hypothesis import strategies as st

from ndtheory import EnergyConstants, HypothesisError, Number, evaluate_energy

pytestmark = pytest.mark.usefixtures("many_digits")

# --- each hypothesis, just broken and just kept --------------------------------------------------------------------

NO_NUMBER = [
    *(float("nan"), float("inf"), float("-inf"), True, False, "", "abc", "nan", "1/0", "1e999999", "-1", -1, [1], 1j),
    *("1_000", 10**400),
]
BROKEN = {
    "rho": [None, 0, 0.0, "0", "-1e-300", "9e-76", "1.1e75", *NO_NUMBER],
    "kappa_1": [None, "-1e-300", -1e-300, 1e-300, "1.1e75", *NO_NUMBER],
    "kappa_2": [None, "-1e-300", -1e-300, 1e-300, "1.1e75", *NO_NUMBER],
    "rho_normal": [0, "0", "-1e-300", "2." + 60 * "0" + "1", 2.0000000000000004, *NO_NUMBER],
}
NEEDED = {
    "rho": "a number rho > 0 (1e-75 to 1e75)",
    "kappa_1": "a number kappa_1 >= 0 (0, or 1e-75 to 1e75)",
    "kappa_2": "a number kappa_2 >= 0 (0, or 1e-75 to 1e75)",
    "rho_normal": "a number 0 < rho_normal <= rho = 2",
}


@pytest.mark.parametrize(("key", "value"), [(key, value) for key, values in BROKEN.items() for value in values])
def test_a_broken_hypothesis_on_an_energy_constant_is_named_with_the_value_received(key, value):
    with pytest.raises(HypothesisError) as refusal:
        EnergyConstants(**{"rho": 2, key: value})
    assert (refusal.value.key, refusal.value.needed) == (key, NEEDED[key])
    shown = "an integer of 1329 bits" if value == 10**400 else value
    assert str(refusal.value) == f"{key} = {shown}: needed {NEEDED[key]}"


@pytest.mark.parametrize("value", [0, 1, 0.0, 1.0, "1", "-1e-300", 1.5, "1." + 60 * "0" + "1", *NO_NUMBER])
def test_a_theta_that_is_not_between_0_and_1_is_refused(value):
    with pytest.raises(HypothesisError, match=r"^theta = .*: needed a number with 0 < theta < 1$") as refusal:
        evaluate_energy(EnergyConstants(rho=1), value)
    assert refusal.value.key == "theta"


def test_rho_is_required_and_constants_are_given_by_name():
    with pytest.raises(TypeError):
        EnergyConstants()
    with pytest.raises(TypeError):
        EnergyConstants(1)


@pytest.mark.parametrize("small", ["1e-75", F(1, 10**75)])
def test_the_hypotheses_of_the_energy_constants_are_kept_with_equality(small):
    assert EnergyConstants(rho=small, rho_normal=small, kappa_1=0, kappa_2="0").at_work == F(1, 10**75)
    assert EnergyConstants(rho=small, kappa_1=small, kappa_2="1e75").frictionless is False
    assert EnergyConstants(rho=2, rho_normal="1.9999999999999999999").at_work == F(2) - F(1, 10**19)
    assert evaluate_energy(EnergyConstants(rho=1), "1e-300").one_minus_factor.value == 1e-300
    assert evaluate_energy(EnergyConstants(rho="1/2"), "0." + 60 * "9").verdict == "contraction"


# --- the written form ----------------------------------------------------------------------------------------------


@given(energies(), st.one_of(st.none(), strategies.thetas()))
def test_what_is_null_has_a_reason_and_nothing_else_has_one(constants, theta):
    found = evaluate_energy(EnergyConstants(**constants), theta)
    document = json.loads(json.dumps(found.to_dict()))
    proved = [*FIELDS]
    proved.insert(proved.index("interval") + 1, "interval_proved")  # of constants that have enclosures
    assert list(document) == [*proved, "reason"] == [*(field.name for field in fields(found)), "reason"]
    assert {name for name, value in document.items() if value is None} == set(document["reason"])
    assert all(document["reason"].values())


@given(energies(), st.one_of(st.none(), strategies.thetas()))
def test_the_written_form_holds_the_numbers_themselves(constants, theta):
    found = evaluate_energy(EnergyConstants(**constants), theta)
    document = json.loads(json.dumps(found.to_dict()))
    for name in FIELDS:
        value = getattr(found, name)
        if isinstance(value, Number):
            assert document[name] == {"value": value.value, "lo": None, "hi": None, "level": "float"}
        else:
            assert document[name] == (list(value) if isinstance(value, tuple) else value)


def test_each_reason_says_what_is_missing():
    def reason(theta=None, **given):
        found = dict(evaluate_energy(EnergyConstants(rho=1, **given), theta).to_dict()["reason"])
        assert found.pop("interval_proved").startswith("the constants have no enclosures")
        return found

    none, outside = "no theta given", "theta outside the interval: no conclusion"
    still = dict.fromkeys(["friction_multiple", "friction_limit_multiple"], "no friction")
    assert reason() == {**still, **dict.fromkeys(["theta", "factor", "one_minus_factor", "verdict"], none)}
    assert reason("1/2") == still
    assert reason("9/10", kappa_1="1/2") == dict.fromkeys(["factor", "one_minus_factor"], outside)
    assert reason("9/10", kappa_2=3) == {
        **dict.fromkeys(["interval", "theta_proved", "factor_proved", "theta_max_proved"], "q >= 1 for every theta"),
        **dict.fromkeys(["factor", "one_minus_factor"], outside),
    }


@pytest.mark.parametrize(("excess", "verdict"), [(F(1, 10**101), "no conclusion"), (-F(1, 10**101), "contraction")])
def test_a_theta_where_q_exceeds_1_does_not_contract_though_it_lies_beside_the_interval_by_less_than_the_margin(
    excess, verdict
):
    """Beyond kappa_2 = 1 the interval begins near the excess, which counts as 0 where the ends are compared."""
    found = evaluate_energy(EnergyConstants(rho=1, kappa_2=1 + excess), F(1, 10**105))
    assert found.interval[0] == 0
    assert found.verdict == verdict
