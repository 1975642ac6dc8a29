"""Certificates in a norm of their own: the checker holds it between its ends, and accepts nothing that is false."""

import copy
import json
import random
from fractions import Fraction

import numpy as np
import pytest
from problem_list import changed, small

import verification as vf
from verification.algorithm.rates import ForceNorm
from verification.certificate import check
from verification.certificate.claims import NoCertificate
from verification.certificate.contraction import certify, check_again
from verification.free_norm.norm import FreeNorm
from verification.semidefinite.pattern_search import largest_factor

PROBLEMS = {
    "small": small(),
    "grids that differ": changed(small(), body2={"cells": [5, 2]}),
    "roles exchanged": small(iteration={"neumann_body": 2, "theta": "0.05"}),
    "without friction": small(contact={"friction": 0}),
    "much friction": small(contact={"friction": "1.2"}, iteration={"theta": "0.5"}),
}


@pytest.fixture(scope="module")
def made(shared):
    def document(name):
        problem = vf.Problem.from_dict(PROBLEMS[name])
        return shared(("free", name), lambda: json.loads(certify(problem, edition="lyapunov").to_json()))

    return lambda name: copy.deepcopy(document(name))


def norm_of(document):
    """The norm of a certificate in doubles, its normal components along y, and the pair turned alike."""
    lower = document["claim"]["norm"]["matrix"]
    size = len(lower)
    Q = np.array([[float(Fraction(lower[max(i, j)][min(i, j)])) for j in range(size)] for i in range(size)])
    pair = vf.build(vf.Problem.from_dict(document["problem"]))
    condition = float(Fraction(document["claim"]["norm"]["condition"]))
    return pair, ForceNorm(matrix=pair.neumann.orient_form(Q), condition=condition)


def worst(document, theta):
    """The largest factor found of two forces in the norm of a certificate."""
    pair, norm = norm_of(document)
    return largest_factor(pair, theta, random=np.random.default_rng(0), starts=3, norm=norm).value


@pytest.mark.parametrize("name", PROBLEMS)
def test_the_factor_and_the_norm_of_doubles_are_confirmed(made, name):
    document = made(name)
    claim, theta = document["claim"], float(Fraction(document["claim"]["theta"]))
    pair, norm = norm_of(document)
    proof = FreeNorm(pair, vf.measure(pair)).factor(theta)
    assert float(Fraction(claim["factor"])) == pytest.approx(proof.factor, rel=1e-8)
    assert norm.matrix == pytest.approx(proof.norm.matrix, rel=1e-6, abs=1e-9 * np.abs(proof.norm.matrix).max())
    assert 1 <= norm.condition / proof.norm.condition < 1.001
    assert document["lower"] <= float(Fraction(claim["factor"])) * (1 + 1e-9)
    assert worst(document, theta) <= float(Fraction(claim["factor"])) * (1 + 1e-9)
    assert check_again(document, vf.Problem.from_dict(document["problem"])).same


def test_the_factor_of_5_21_is_far_larger_with_much_friction(made):
    document = made("much friction")
    assert Fraction(document["claim"]["factor"]) < Fraction(7, 10)
    with pytest.raises(NoCertificate, match="proves no contraction"):
        certify(vf.Problem.from_dict(PROBLEMS["much friction"]))


BROKEN = {
    "a condition that is too small": lambda norm: norm.update(condition=str(Fraction(norm["condition"]) * 99 / 100)),
    "a norm below (5.21)": lambda norm: norm.update(matrix=[[str(Fraction(x) / 2) for x in r] for r in norm["matrix"]]),
    "no norm at all": lambda norm: norm.update(matrix=[["0" for _ in row] for row in norm["matrix"]]),
    "a row too few": lambda norm: norm["matrix"].pop(),
    "a row that is too long": lambda norm: norm["matrix"][0].append("0"),
    "no triangle": lambda norm: norm.update(matrix="1"),
    "a text": lambda norm: norm["matrix"][0].__setitem__(0, "nan"),
}


@pytest.mark.parametrize("edit", BROKEN.values(), ids=BROKEN)
def test_a_broken_norm_is_refused(made, edit):
    document = made("small")
    edit(document["claim"]["norm"])
    assert not check_again(document).accepted


def test_a_norm_without_a_condition_is_no_certificate(made):
    document = made("small")
    del document["claim"]["norm"]["condition"]
    with pytest.raises(ValueError, match="not a certificate of contraction"):
        check_again(document)


def test_the_claim_does_not_hold_in_5_21_nor_below_a_factor_that_occurs(made):
    document = made("small")
    assert check_again(document).accepted
    below = copy.deepcopy(document)
    below["claim"]["factor"] = str(Fraction(worst(document, 0.7)) * (1 - Fraction(1, 10**9)))
    assert not check_again(below).accepted
    del document["claim"]["norm"]
    assert not check_again(document).accepted


def test_the_words_of_the_checker_name_the_norm_and_its_condition(made):
    document = made("small")
    said = check.words(document)
    assert f"in the norm Q of the certificate, of condition {norm_of(document)[1].condition:.6g} in (5.21)" in said
    del document["claim"]["norm"]
    assert check.words(document).endswith("in the norm (5.21)")


def test_what_is_accepted_of_tampered_certificates_is_so(made):
    """One digit of the claim is another: what is accepted is not below a factor that occurs in the norm then."""
    document, drawn, accepted, draws = made("small"), random.Random(11), 0, 10000
    text = json.dumps(document["claim"])
    places = [i for i, letter in enumerate(text) if letter.isdigit() and text[i - 1] not in "abcdeklmnrtuy_"]
    for _ in range(draws):
        at = drawn.choice(places)
        given = document | {"claim": json.loads(text[:at] + drawn.choice("123456789") + text[at + 1 :])}
        if not check_again(given).accepted:
            continue
        accepted += 1
        theta, factor = (float(Fraction(given["claim"][key])) for key in ("theta", "factor"))
        assert factor >= worst(given, theta) * (1 - 1e-9)
    assert 0 < accepted < draws
