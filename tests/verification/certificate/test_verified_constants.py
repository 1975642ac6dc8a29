"""Constants between proved bounds: against a second computation with 40 digits from the exact data of the problem."""

import json
from dataclasses import replace
from fractions import Fraction as F
from functools import cache

import numpy as np
import precise_oracle
import pytest
import scipy.sparse as sp
from mpmath import mp

import verification as vf
from fem1d2d.proofs.enclosed import Enclosed
from fem1d2d.proofs.loewner import Elimination
from ndtheory import REPAIRED, Constants, evaluate
from verification.certificate.proved_constants import verify
from verification.interface.interface import Law

NAMES = (
    "m", "M", "C_R", "C_s", "C_tr", "C_tr_half", "C_K", "rho_max", "rho_min", "rho_normal",
    "C_s_energy", "C_t1", "C_t2", "kappa_1", "kappa_2",
)  # fmt: skip

#: Two rectangles on a grid of thirds, which no double holds; the grids match where the upper one begins at 0.
PROBLEM = {
    "body1": {
        "shape": "rectangle", "x": [0, "4/3"], "y": ["-2/3", 0], "cells": [4, 2], "young": "700/3", "poisson": "3/10",
        "fixed": ["bottom"],
    },
    "body2": {
        "shape": "rectangle", "x": [0, "2/3"], "y": [0, "1/3"], "cells": [2, 1], "young": 50, "poisson": "1/7",
        "fixed": ["top"],
    },
    "contact": {"friction": "1/5", "radius": "2/5"},
    "iteration": {"neumann_body": 1},
    "norm": {"length": "3/2"},
}  # fmt: skip


def changed(**tables):
    return vf.Problem.from_dict({**PROBLEM, **{key: {**PROBLEM.get(key, {}), **tables[key]} for key in tables}})


MATCHING = {}
APART = {"body2": {"x": ["1/9", "7/9"]}, "contact": {"friction": "1/5", "radius": "4/5"}}
FINER = {"body2": {"x": ["1/9", "7/9"], "cells": [5, 1]}, "contact": {"friction": "1/5", "radius": "4/5"}}
SWAPPED = {"iteration": {"neumann_body": 2}}


TABLES = {"matching": MATCHING, "swapped": SWAPPED, "apart": APART, "finer": FINER}


@cache
def verified(name="matching"):
    return vf.measure(changed(**TABLES[name]), verified=True)


@pytest.fixture(scope="module")
def exactly(shared):
    """``exactly(name)``: the constants of a problem with 40 digits, worked out once."""
    of = lambda name: precise_oracle.constants(vf.build(changed(**TABLES[name])))
    return lambda name: shared(("40 digits", name), lambda: of(name))


@pytest.mark.parametrize("name", TABLES)
def test_every_constant_with_40_digits_lies_between_its_bounds(name, exactly):
    measured, truth = verified(name), exactly(name)
    assert measured.unverified == {}
    for constant in NAMES:
        number = getattr(measured, constant)
        if constant == "rho_min" and truth[constant] == 0:  # the grids tell: P has a kernel
            assert (number.value, number.level) == (0, "exact")
            continue
        assert number.level == "verified"
        assert mp.mpf(number.lo) < truth[constant] < mp.mpf(number.hi), constant
        assert number.hi - number.lo < 1e-11 * number.value, constant


def test_the_bounds_of_each_body_hold_too():
    measured = verified()
    for body in (measured.body1, measured.body2):
        for number in (body.m, body.M):
            assert number.level == "verified"
            assert 0 < number.hi - number.lo < 1e-12 * number.value
    assert measured.m.lo == min(measured.body1.m.lo, measured.body2.m.lo)
    assert F(measured.M.lo) < F(measured.body1.M.lo) + F(measured.body2.M.lo)


BARS = {
    "dimension": 1,
    "body1": {"shape": "interval", "x": [0, "1/3"], "cells": 3, "young": 7, "fixed": ["left"]},
    "body2": {"shape": "interval", "x": ["1/3", 1], "cells": 4, "young": "1/3", "fixed": ["right"]},
}


def test_rho_of_two_bars_is_the_ratio_of_their_stiffnesses():
    measured = vf.measure(vf.Problem.from_dict(BARS), verified=True)
    assert measured.unverified == {}
    for number in (measured.rho_max, measured.rho_min, measured.rho_normal):
        assert F(number.lo) < F(7 * 3) / (F(1, 3) * F(3, 2)) < F(number.hi)
        assert number.hi / number.lo < 1 + 1e-12
    assert measured.kappa_1.level == measured.C_K.level == measured.C_s_energy.level == "exact"


def test_rho_normal_of_mirror_images_is_the_ratio_of_their_moduli():
    measured = vf.measure(vf.example("section6"), verified=True)
    assert F(measured.rho_normal.lo) < F(2, 7) < F(measured.rho_normal.hi)


@pytest.mark.parametrize("factor", [0.5, 1 - 1e-5, 1 + 1e-5, 2.0])
def test_guesses_that_are_wrong_prove_nothing_that_is_false(factor, exactly):
    pair = vf.build(changed())
    plain, truth = vf.measure(pair), exactly("matching")
    bodies = {
        name: replace(
            body, m=replace(body.m, value=body.m.value * factor), M=replace(body.M, value=body.M.value * factor)
        )
        for name, body in (("body1", plain.body1), ("body2", plain.body2))
    }
    found = verify(replace(plain, **bodies), pair)
    for name in ("m", "M"):
        number = getattr(found, name)
        assert number.lo is None or number.lo < truth[name]
        assert number.hi is None or truth[name] < number.hi
        assert (number.level == "float") == (number.lo is None and number.hi is None)
        assert (number.level == "float") == (name in found.unverified)


class Careless(Elimination):
    """An elimination whose factors are wrong in the tenth digit."""

    def factors(self, shift):
        found = super().factors(shift)
        if found is None:
            return None
        L, pivots, solve = found
        return L * np.random.default_rng(0).uniform(1 - 1e-10, 1 + 1e-10, L.shape), pivots, solve


def test_factors_that_are_wrong_prove_nothing_that_is_false():
    found = 0
    for n in range(1, 40):
        chain = 2 * np.eye(n + 1) - np.eye(n + 1, k=1) - np.eye(n + 1, k=-1)
        chain[n, n] = 1  # held at one end, seen from the other: stiffness 1/(n + 1)
        for shift in (0.0, 1e-13, 1e-9, 1e-8):
            errors = np.full(n + 1, shift)
            careless = Careless(Enclosed.exactly(chain), np.array([n]), errors=errors)
            for side, bound in ((1, careless.bound(1)), (-1, careless.bound(-1))):
                if bound is not None:
                    found += 1
                    assert side * (F(1, n + 1) - F(bound[0, 0])) > 0
    assert found > 50


class Uncoupled(Elimination):
    """An elimination that is wrong by ``off`` in the rows of the interface alone."""

    off = 0.0

    def factors(self, shift):
        found = super().factors(shift)
        if found is None:
            return None
        L, pivots, solve = found
        wrong = L.copy() if isinstance(L, np.ndarray) else L.toarray()
        wrong[self.interface] += self.off
        return (wrong if isinstance(L, np.ndarray) else sp.csr_array(wrong)), pivots, solve


@pytest.mark.parametrize("make", [np.array, sp.csc_array])
@pytest.mark.parametrize("coupling", [0.0, 0.5, -0.5])
def test_factors_that_are_wrong_on_the_interface_alone_prove_nothing_that_is_false(make, coupling):
    found = 0
    matrix = Enclosed.exactly(make([[1.0, coupling], [coupling, 2.0]]))
    truth = 2 - F(coupling) ** 2
    for off in (1e-3, -1e-3, 1e-6, -1e-6):
        for slack in (1e-7, 1e-4, 1e-2):
            uncoupled = Uncoupled(matrix, np.array([1]), errors=np.full(2, slack))
            uncoupled.off = off
            for side in (1, -1):
                bound = uncoupled.bound(side)
                if bound is not None:
                    found += 1
                    assert side * (truth - F(bound[0, 0])) >= 0
    assert found >= 8


# --- what is not proved ---------------------------------------------------------------------------------------------


class Doubled(Law):
    name, label, words = "doubled", "doubled", "twice the local law"

    def operator(self, interface):
        return np.diag(2.0 / interface.neumann.weights)


def test_of_a_law_that_is_no_exact_one_the_stress_constants_are_not_proved():
    measured = vf.measure(vf.build(changed(), law=Doubled()), verified=True)
    assert set(measured.unverified) == {"C_s", "C_s_energy", "C_K", "kappa_1", "kappa_2"}
    assert "given from Python" in measured.unverified["C_s"]
    assert (measured.C_s.level, measured.rho_max.level) == ("float", "verified")


def test_the_local_law_is_an_exact_one():
    measured = vf.measure(changed(contact={"law": "local", "radius": "1/2"}), verified=True)
    assert (measured.C_s_energy.level, measured.unverified) == ("verified", {})


def test_of_a_body_that_contact_alone_holds_what_can_be_proved_is_proved():
    loose = changed(body2={"fixed": [], "prescribed": {"top": ["free", 0]}})
    measured = vf.measure(loose, verified=True)
    assert (measured.m.level, measured.M.level, measured.rho_max.level) == ("exact", "verified", "verified")
    assert set(measured.unverified) <= {"C_R", "rho_min", "rho_normal"}
    plain = vf.measure(loose)
    assert measured.rho_max.value == pytest.approx(plain.rho_max.value, rel=1e-12)


def test_of_matrices_nothing_is_proved_and_the_reason_is_told():
    pair = vf.build(S1=np.eye(4), S2=2 * np.eye(4), x=np.array([0.0, 1.0]))
    measured = vf.measure(pair, verified=True)
    assert "made from matrices" in measured.unverified["rho_max"]
    assert measured.rho_max.level == "float"


def test_without_the_word_nothing_is_proved():
    measured = vf.measure(changed())
    assert measured.unverified is None
    assert measured.rho_max.level == "float"
    assert "unverified" not in json.loads(measured.to_json())


# --- what follows from proved constants -------------------------------------------------------------------------------


def test_bounds_of_proved_constants_are_proved_and_hold_those_of_the_exact_ones(exactly):
    measured, truth = verified(), exactly("matching")
    found = evaluate(REPAIRED, measured.constants(), theta="1/1000")
    texts = {name: mp.nstr(truth[name], 30) for name in ("m", "M", "C_R", "C_s", "C_tr")}
    exactly = evaluate(REPAIRED, Constants(**texts, k="1/5"), theta="1/1000")
    for name in ("C0", "C2", "C3", "C4", "C5", "C_T"):
        number, value = getattr(found, name), getattr(exactly, name)
        assert number.level == "verified"
        assert number.lo <= value.value <= number.hi, name


def test_the_thresholds_of_proved_constants_are_proved(exactly):
    measured, truth = verified(), exactly("matching")
    plain = vf.measure(changed())
    with mp.workdps(40):  # kappa_2 + kappa_1^2/4 = 1
        a, b = (truth["C_s_energy"] * truth[name] for name in ("C_t1", "C_t2"))
        threshold = 2 * (mp.sqrt(b**2 + a**2) - b) / a**2
    found = measured.friction_threshold
    assert found.level == measured.friction_limit.level == "verified"
    assert found.lo < threshold < found.hi
    assert plain.friction_threshold.value == pytest.approx(found.value, rel=1e-12)
    assert (plain.friction_threshold.level, plain.friction_limit.level) == ("float", "float")
    assert measured.friction_limit.lo <= plain.friction_limit.value * (1 + 1e-12)


def test_friction_that_is_no_decimal_enters_the_bounds_as_it_was_written():
    measured = vf.measure(changed(contact={"friction": "1/3"}), verified=True)
    assert measured.constants().k == F(1, 3)
    given = measured.constants().number("C_K")
    assert F(given.lo) <= F(1, 3) * F(measured.C_s.lo) * F(measured.C_tr.lo)
    assert F(1, 3) * F(measured.C_s.hi) * F(measured.C_tr.hi) <= F(given.hi)
    assert F(measured.kappa_1.lo) <= F(1, 3) * F(measured.C_s_energy.lo) * F(measured.C_t1.lo)


def test_other_friction_keeps_the_bounds():
    measured = verified()
    more = measured.with_friction(0.4)
    for name in ("C_K", "kappa_1", "kappa_2"):
        twice, once = getattr(more, name), getattr(measured, name)
        assert twice.level == "verified"
        assert twice.value == pytest.approx(2 * once.value, rel=1e-12)
    assert measured.with_friction(0.0).kappa_1.value == 0
