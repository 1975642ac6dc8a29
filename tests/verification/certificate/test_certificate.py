"""Certificates of contraction: what they prove is so, what is false is refused, and the checker stands alone."""

import ast
import copy
import json
import random
import subprocess
import sys
from fractions import Fraction
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from flint import ctx, fmpq_mat
from problem_list import blocks, changed, plates, small
from processes import environment
from rational_forms import form_of, is_definite
from strategies import AT_NIGHT

import verification as vf
from verification.bounds.bound import Subject
from verification.certificate import check, claims
from verification.certificate.claims import FEWEST, LEFT, MARGINS, Claims, NoCertificate, describe
from verification.certificate.contraction import certify, check_again
from verification.machine.progress import silent
from verification.registry import BOUNDS
from verification.semidefinite.lipschitz import enclose
from verification.semidefinite.multipliers import QuadraticForms

GRIDS_DIFFER = changed(small(), body2={"cells": [5, 2]})
PROBLEMS = {
    "small": small(),
    "grids that differ": GRIDS_DIFFER,
    "without friction": small(contact={"friction": 0}),
    "roles exchanged": small(iteration={"neumann_body": 2, "theta": "0.1"}),
    "another side held": small(body1={"fixed": ["bottom", "right"]}),
    "grids that differ without friction": changed(GRIDS_DIFFER, contact={"friction": 0}),
}


@pytest.fixture(scope="module")
def made(shared):
    return lambda name, **options: shared(
        ("certificate", name, *options.items()),
        lambda: json.loads(certify(vf.Problem.from_dict(PROBLEMS[name]), **options).to_json()),
    )


@pytest.fixture(params=PROBLEMS)
def certificate(request, made):
    return made(request.param)


def factor(document):
    return Fraction(document["claim"]["factor"])


def test_what_is_proved_lies_between_the_largest_factor_found_and_the_bound_in_doubles(certificate):
    problem = vf.Problem.from_dict(certificate["problem"])
    pair = vf.build(problem)
    theta = float(Fraction(certificate["claim"]["theta"]))
    forms = QuadraticForms(pair, vf.measure(pair))
    found = enclose(pair, forms, theta, gap=np.inf, programs=1)
    assert found.lower * (1 - 1e-12) <= factor(certificate) <= found.upper.value * (1 + 1e-8)
    assert certificate["lower"] == pytest.approx(found.lower, rel=1e-12)


def test_a_claim_below_a_factor_that_occurs_is_refused(certificate):
    certificate["claim"]["factor"] = str(Fraction(certificate["lower"]) * (1 - Fraction(1, 10**9)))
    assert not check_again(certificate).accepted


@pytest.mark.parametrize("edition", ["energy", "repaired"])
def test_other_bounds_have_certificates_with_one_number_for_all_nodes(edition):
    problem = (
        vf.example("inside") if edition == "repaired" else vf.Problem.from_dict(small(contact={"friction": "0.1"}))
    )
    found = certify(problem, edition=edition)
    assert all(isinstance(value, str) for value in found.claim["multipliers"].values())
    pair = vf.build(problem)
    bound = BOUNDS[edition].evaluate(Subject.of(pair, vf.measure(pair)), problem.iteration.theta)
    assert 1 - found.factor == pytest.approx(bound.one_minus_factor.value, rel=1e-8)
    assert found.lower is None


def test_the_checker_imports_nothing_of_ours_and_says_the_same_in_an_empty_folder(tmp_path, made):
    source = Path(check.__file__).read_text(encoding="utf-8")
    imported = {
        name.name if isinstance(node, ast.Import) else node.module
        for node in ast.walk(ast.parse(source))
        if isinstance(node, (ast.Import, ast.ImportFrom))
        for name in node.names
    }
    assert {name.split(".")[0] for name in imported} <= {*sys.stdlib_module_names, "flint"}
    (tmp_path / "alone.py").write_text(source, encoding="utf-8")
    document = made("small")
    below = copy.deepcopy(document)
    below["claim"]["factor"] = str(factor(document) / 2)
    for given, status, word in ((document, 0, "ACCEPTED"), (below, 1, "REFUSED")):
        (tmp_path / "certificate.json").write_text(json.dumps(given), encoding="utf-8")
        call = [sys.executable, "-I", "alone.py", "certificate.json"]
        ended = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True, check=False, env=environment())
        assert (ended.returncode, ended.stderr) == (status, "")
        assert word in ended.stdout


def test_the_checker_condenses_the_bodies_as_the_library_does(certificate):
    pair = vf.build(vf.Problem.from_dict(certificate["problem"]))
    ctx.prec = 200
    for i, side in enumerate(pair.along_y, 1):
        found = check.surface_stiffness(certificate["discrete"][f"body{i}"], both=True)
        doubles = np.array([[float(entry.mid()) for entry in row] for row in found.tolist()])
        widest = max(float(entry.rad()) for row in found.tolist() for entry in row)
        assert doubles == pytest.approx(side.schur, rel=0, abs=1e-12 * np.abs(side.schur).max())
        assert widest < 1e-30 * np.abs(doubles).max()


@pytest.fixture(scope="module")
def condensed():
    """The Schur complement of a body by another path: full meshes and one solve, exactly."""
    with pytest.MonkeyPatch.context() as patched:
        patched.syspath_prepend(str(Path(__file__).parents[3] / "benchmarks"))
        found = import_module("contraction_truth").condensed
    return lambda body: np.array(found(body).tolist())


def in_fractions(document, condensed):
    """Whether the form of a certificate is positive definite, in rationals."""
    discrete, claim = document["discrete"], document["claim"]
    theta, bound, k = (Fraction(v) for v in (claim["theta"], claim["factor"], discrete["friction"]))
    bodies = (discrete["body1"], discrete["body2"])[:: -1 if discrete["neumann_body"] == 2 else 1]
    S_n, S_c = map(condensed, bodies)
    spread = lambda values: [Fraction(v) for v in (values if isinstance(values, list) else [values] * (len(S_c) // 2))]
    multipliers = [spread(claim["multipliers"][name]) for name in ("lambda", "tau", "a", "b")]
    kernel, wk = (
        [[Fraction(v) for v in row] for row in discrete["kernel"]],
        [k * w for w in spread(discrete["weights"])],
    )
    assert discrete["transfer"] is None
    return is_definite(form_of(S_c, S_n, multipliers, bound**2, step=(theta, 1 - theta), wk=wk, kernel=kernel))


@pytest.mark.parametrize("both", [True, False])
@pytest.mark.parametrize("block", [1, 3, 5, 32])
def test_the_balls_of_the_checker_hold_the_exact_schur_complement(monkeypatch, made, condensed, both, block):
    """However many unknowns are eliminated at once: one by one, few, or all."""
    monkeypatch.setattr(check, "BLOCK", block)
    body = made("grids that differ")["discrete"]["body2"]
    exact = condensed(body)
    if not both:  # tangential components are condensed out
        n = len(exact) // 2
        part = lambda i, j: fmpq_mat(exact[i * n : (i + 1) * n, j * n : (j + 1) * n].tolist())
        exact = np.array((part(1, 1) - part(1, 0) * part(0, 0).solve(part(0, 1))).tolist())
    with ctx.workprec(128):
        balls = check.surface_stiffness(body, both)
    assert (balls.nrows(), balls.ncols()) == (len(exact), len(exact))
    for i, row in enumerate(balls.tolist()):
        for j, ball in enumerate(row):
            assert ball.contains(exact[i][j])
            assert ball.rad() < 1e-25 * balls[i, i].mid()


def test_the_bits_of_a_certificate_are_fitted_to_its_bodies_and_more_serve_too(made):
    document = made("small")
    bits = document["claim"]["bits"]
    assert FEWEST < bits < 320, "few unknowns need less than certificates of old, which had 320, 640 or 1280"
    for more in (320, 640, 1280):
        assert check_again({**document, "claim": {**document["claim"], "bits": more}}).accepted


def test_bodies_that_balls_of_few_bits_do_not_enclose_are_given_more(monkeypatch):
    problem = vf.Problem.from_dict(small())
    usual = Claims(describe(problem), silent).bits
    monkeypatch.setattr(claims, "FEWEST", 1)
    monkeypatch.setattr(claims, "STEP", 1)
    monkeypatch.setattr(claims, "UNKNOWNS", 1e9)
    fitted = Claims(describe(problem), silent).bits
    assert LEFT < fitted <= usual, "from balls in which nothing can be eliminated up to those that suffice"
    monkeypatch.setattr(claims, "LEFT", LEFT + 40)
    assert Claims(describe(problem), silent).bits == pytest.approx(fitted + 40, abs=3)


def test_fractions_decide_as_the_balls_do_next_to_the_least_factor(condensed):
    tiny = blocks(cells=[[2, 1], [2, 1]], contact={"friction": "0.1", "radius": "0.6"}, iteration={"theta": "0.3"})
    document = json.loads(certify(vf.Problem.from_dict(tiny)).to_json())
    decided = set()
    for share in ("-1/10", "-1/100000", "-1/1000000000", "0", "1/100000"):
        tried = copy.deepcopy(document)
        tried["claim"]["factor"] = str(factor(document) * (1 + Fraction(share)))
        accepted = check_again(tried).accepted
        assert accepted == in_fractions(tried, condensed)
        decided.add(accepted)
    assert decided == {True, False}


def tampered(document, drawn):
    """A certificate with one digit of its claim or of its bodies changed."""
    text = json.dumps({"claim": document["claim"], "discrete": document["discrete"]})
    places = [i for i, letter in enumerate(text) if letter.isdigit() and text[i - 1] not in "abcdeklmnrtuy_"]
    at = drawn.choice(places)
    changed_text = text[:at] + drawn.choice("0123456789") + text[at + 1 :]
    try:
        return {**document, **json.loads(changed_text)}
    except ValueError:
        return document


def test_what_is_accepted_of_tampered_certificates_is_so(made):
    document, drawn, accepted = made("small"), random.Random(7), 0
    problem = vf.Problem.from_dict(document["problem"])
    draws = 100 if AT_NIGHT else 20
    for _ in range(draws):
        given = tampered(document, drawn)
        found = check_again(given, problem)
        if found.accepted:
            accepted += 1
            assert found.same
            same_theta = given["claim"]["theta"] == document["claim"]["theta"]
            assert factor(given) >= Fraction(document["lower"]) * (1 - Fraction(1, 10**12)) or not same_theta
    assert 0 < accepted < draws


def test_a_certificate_of_a_changed_mesh_that_names_its_own_hash_is_about_that_mesh(made):
    document = copy.deepcopy(made("small"))
    document["discrete"]["body1"]["young"] = "70001"
    assert "hash" in check_again(document).why
    document["claim"]["factor"] = "9/10"
    document["sha256"] = check.digest(document["discrete"])
    found = check_again(document, vf.Problem.from_dict(PROBLEMS["small"]))
    assert found.accepted
    assert found.same is False


def broken(document, edit):
    document = copy.deepcopy(document)
    edit(document["discrete"], document["claim"])
    document["sha256"] = check.digest(document["discrete"])
    return document


def a_little_short(claim):
    """The first a a millionth below ``tau^2/(4 b)``."""
    tau, b = (next(iter([values] if isinstance(values, str) else values)) for values in map(claim.get, ("tau", "b")))
    short = Fraction(tau) ** 2 / (4 * Fraction(b)) * (1 - Fraction(1, 10**6))
    claim["a"] = str(short) if isinstance(claim["a"], str) else [str(short), *claim["a"][1:]]


def with_a_leaning_normal(discrete, claim, length=1):
    """Both bodies list normals; the first of the contact body leans, or is longer than 1."""
    for body in (discrete["body1"], discrete["body2"]):
        body["normals"] = [["0", "1"] for _ in body["surface"]]
    x, y = Fraction(3, 5) * length, Fraction(4, 5) * length
    discrete[f"body{3 - discrete['neumann_body']}"]["normals"][0] = [str(x), str(y)]


def with_a_leaning_normal_where_a_support_holds(discrete, claim):
    """Along x, which is not its tangent; without friction the checker keeps the normal component only."""
    with_a_leaning_normal(discrete, claim)
    body = discrete[f"body{3 - discrete['neumann_body']}"]
    body["held"].append([body["surface"][0], 0])
    discrete["friction"] = "0"


def negative(claim, name):
    values = claim["multipliers"][name]
    claim["multipliers"][name] = [str(-Fraction(values[0])), *values[1:]]


BREAKS = {
    **{
        "multipliers that are not negative" + i * " ": lambda d, c, name=name: negative(c, name)
        for i, name in enumerate(("lambda", "tau", "a", "b"))
    },
    "4 a b": lambda d, c: c["multipliers"].update(a="0"),
    "4 a b ": lambda d, c: a_little_short(c["multipliers"]),
    "a rational": lambda d, c: d["weights"].__setitem__(0, 0.5),
    "a rational, ": lambda d, c: d["weights"].__setitem__(0, "0.5"),
    "0 < theta": lambda d, c: c.update(theta="2"),
    "-1 < nu < 1/2": lambda d, c: d["body1"].update(poisson="2/3"),
    "-1 < nu < 1/2 ": lambda d, c: d["body1"].update(poisson="-3/2"),
    "E > 0": lambda d, c: d["body2"].update(young="-1"),
    "anticlockwise": lambda d, c: d["body1"]["cells"][0].reverse(),
    "contact nodes that are free": lambda d, c: d["body1"]["held"].append([d["body1"]["surface"][0], 1]),
    "each once": lambda d, c: d["body2"]["surface"].__setitem__(0, d["body2"]["surface"][1]),
    "node numbers": lambda d, c: d["body2"]["surface"].__setitem__(0, -1),
    "trapezoid weights": lambda d, c: d["weights"].__setitem__(0, "0"),
    "normals of length 1": lambda d, c: with_a_leaning_normal(d, c, length=2),
    "normals of length 1 ": lambda d, c: with_a_leaning_normal(d, c, length=Fraction(1, 2)),
    "no support of a contact node with its own normal": with_a_leaning_normal_where_a_support_holds,
    "cells that do not overlap": lambda d, c: d["body1"]["cells"].append(d["body1"]["cells"][0]),
    "hat of the radius claimed": lambda d, c: c.update(radius="1/4"),
    "a matrix of": lambda d, c: d["kernel"].pop(),
    "multipliers of each kind": lambda d, c: c["multipliers"]["lambda"].pop(),
    "neumann_body": lambda d, c: d.update(neumann_body=3),
    "balls of these bits": lambda d, c: c.update(bits=50),
}


@pytest.mark.parametrize("said", BREAKS)
def test_what_the_proof_does_not_allow_is_refused_with_what_is_needed(said, made):
    found = check_again(broken(made("small"), BREAKS[said]))
    assert not found.accepted
    assert said.strip(", ") in found.why


def test_a_weaker_claim_is_accepted_too(made):
    assert check_again(broken(made("small"), lambda d, c: c.update(factor="9/10"))).accepted


@pytest.mark.parametrize("data", [plates(), GRIDS_DIFFER], ids=["one grid", "grids that differ"])
def test_a_problem_is_described_in_the_rationals_of_its_file(data):
    problem = vf.Problem.from_dict(data)
    pair, found = vf.build(problem), describe(problem)
    numbers = lambda rows: np.array([[float(Fraction(x)) for x in row] for row in rows])
    assert numbers([found["weights"]])[0] == pytest.approx(pair.contact.grid.weights, rel=1e-14)
    assert numbers(found["kernel"]) == pytest.approx(pair.interface.kernel, rel=1e-12, abs=1e-12)
    if pair.interface.one_grid:
        assert found["transfer"] is None
    else:
        assert numbers(found["transfer"]) == pytest.approx(pair.interface.transfer, abs=1e-14)
        assert all(sum(map(Fraction, row)) == 1 for row in found["transfer"])
    assert found["body1"]["young"] == "70000"


def test_where_no_contraction_is_proved_there_is_no_certificate():
    with pytest.raises(NoCertificate, match=r"no contraction at theta = 0\.7, k = 5"):
        certify(vf.Problem.from_dict(small(contact={"friction": 5})))
    with pytest.raises(NoCertificate, match="the theorem repaired"):
        certify(vf.Problem.from_dict(small()), edition="repaired")
    with pytest.raises(vf.ProblemError, match="outside the theorem"):
        certify(vf.Problem.from_dict(small(contact={"law": "local", "radius": None})))


@pytest.mark.parametrize(
    ("needed", "tried"),
    [
        ({1e-10: 128}, [(128, 1e-10)]),
        ({1e-6: 128}, [(128, 1e-10), (128, 1e-8), (128, 1e-6)]),
        ({1e-10: 192, 1e-2: 128}, [(128, 1e-10), (128, 1e-8), (128, 1e-6), (192, 1e-10)]),
        ({1e-2: 192}, [(128, 1e-10), (128, 1e-8), (128, 1e-6), *((192, margin) for margin in MARGINS)]),
    ],
)
def test_sharp_margins_are_tried_before_more_bits_and_weak_ones_after_them(monkeypatch, needed, tried):
    """A checker that accepts a margin from so many bits on: 1 minus the factor is 1/2 in doubles."""
    seen = []

    def fake(discrete, claim, eliminated):
        margin = min(MARGINS, key=lambda one: abs(1 - Fraction(claim["factor"]) - Fraction(1, 2) * (1 - Fraction(one))))
        seen.append((claim["bits"], margin))
        if claim["bits"] < needed.get(margin, 10**6):
            raise ValueError("too wide")

    monkeypatch.setattr(claims, "check", fake)
    found = Claims({}, silent)
    monkeypatch.setitem(vars(found), "bits", 128)
    assert (found.confirmed(Fraction(1, 2), 0.5, {}) is not None) == any(seen[-1][1] == one for one in needed)
    assert seen == tried
