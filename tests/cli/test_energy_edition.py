"""The edition in energy norms of `bounds` and of `check`: constants of the energy norms on the command line."""

import json
import re

import pytest

from ndtheory import EnergyConstants, evaluate_energy

# --- the bound in energy norms of `bounds` ---

KAPPAS = ["--rho", "0.475", "--kappa1", "0.986", "--kappa2", "0.427"]
SECTION_5 = ["--m", "3084", "--M", "153229", "--CR", "1.70", "--CK", "1e-8"]


@pytest.mark.parametrize("beside", [[], SECTION_5, [*SECTION_5, "--edition", "repaired"]], ids=["alone", "all", "one"])
@pytest.mark.parametrize("theta", [[], ["--theta", "0.7"], ["--theta", "0.95"]], ids=["", "inside", "outside"])
def test_the_edition_in_energy_norms_of_bounds_is_the_theorem(call, beside, theta):
    found = call("bounds", *KAPPAS, *beside, *theta, "--json").document
    energy = EnergyConstants(rho="0.475", kappa_1="0.986", kappa_2="0.427")
    expected = evaluate_energy(energy, *theta[1:]).to_dict()
    assert found["editions"]["energy"] == json.loads(json.dumps(expected))
    shown = {name for name, edition in found["editions"].items() if edition is not None}
    of_section_5 = {"repaired"} if "--edition" in beside else {"printed", "repaired"} if beside else set()
    assert shown == {"energy"} | of_section_5
    assert shown.isdisjoint(found["reason"])
    assert [found["inputs"][key] for key in ("rho", "kappa_1", "kappa_2")] == [0.475, 0.986, 0.427]
    rows = re.findall(r"^  (printed|repaired|energy) .*", call("bounds", *KAPPAS, *beside, *theta).out, flags=re.M)
    assert set(rows) == shown


def test_the_editions_beside_the_one_in_energy_norms_are_what_they_are_alone(call):
    alone = call("bounds", *SECTION_5, "--theta", "1e-4", "--json").document["editions"]
    beside = call("bounds", *SECTION_5, *KAPPAS, "--theta", "1e-4", "--json").document["editions"]
    assert alone["energy"] is None
    assert {name: beside[name] for name in ("printed", "repaired")} == {n: alone[n] for n in ("printed", "repaired")}


@pytest.mark.parametrize(("theta", "status"), [("0.7", 0), ("0.9", 1)])
def test_check_counts_the_edition_in_energy_norms(call, theta, status):
    assert call("bounds", *KAPPAS, "--theta", theta, "--check").status == status
    assert call("bounds", *SECTION_5, "--theta", theta, "--check").status == 1
    assert call("bounds", *SECTION_5, *KAPPAS, "--theta", theta, "--check").status == status


def test_the_screen_of_the_edition_in_energy_norms_tells_both_thetas(call):
    lines = call("bounds", *KAPPAS, "--theta", "0.7").out.splitlines()
    assert "WHICH THETA?" in lines
    assert any(re.search(r"^  proved +0\.70. .*least proved factor", line) for line in lines)
    assert any(re.search(r"^  predicted +0\.808 .*not a bound", line) for line in lines)
    assert max(map(len, lines)) <= 80
    none = call("bounds", "--rho", "3", "--kappa1", "2", "--kappa2", "2").out
    assert "q >= 1 for every theta: no conclusion" in none


@pytest.mark.parametrize("value", ["nan", "inf", "-1", "x", "", "1e400"])
@pytest.mark.parametrize("option", ["--rho", "--kappa1", "--kappa2"])
def test_an_energy_constant_that_is_none_is_refused_by_name(call, option, value):
    given = dict(zip(KAPPAS[::2], KAPPAS[1::2], strict=True)) | {option: value}
    assert f"{option} = {value}: needed" in call("bounds", *(w for pair in given.items() for w in pair)).complaint


@pytest.mark.parametrize("key", ["--m", "--M", "--CR", "--CK", "--k"])
def test_an_empty_constant_beside_rho_is_refused_as_it_is_without(call, key):
    assert call("bounds", "--rho", "1", f"{key}=").complaint


@pytest.mark.parametrize("size", ["1e-300", "1e-70", "1e-30", "1e30", "1e70", "1e300"])
@pytest.mark.parametrize("option", ["--rho", "--kappa1", "--kappa2"])
@pytest.mark.parametrize("theta", ["1e-300", "0.5"])
def test_no_size_of_an_energy_constant_crashes_the_calculator(call, option, size, theta):
    for others in ("0.5", size):
        given = dict.fromkeys(("--rho", "--kappa1", "--kappa2"), others) | {option: size, "--theta": theta}
        answer = call("bounds", *(word for pair in given.items() for word in pair), "--json")
        assert "Traceback" not in answer.err
        if answer.status == 2:
            assert f" = {size}: needed" in answer.complaint
            continue
        energy = answer.document["editions"]["energy"]
        assert energy["interval"] is None or 0 <= energy["interval"][0] < energy["interval"][1] <= 1
        assert energy["factor"] is None or 0 <= energy["factor"]["value"] <= 1
