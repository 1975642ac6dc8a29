"""The inequalities of Sections 4 and 5 as the ledger searches them: each holds, and a wrong one would be found out."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from itertools import islice
from typing import Any

import numpy as np
import pytest
from chain_problems import state_of, with_loads
from dense_oracle import DensePair, symmetric, top
from scipy.linalg import eigh

from verification.ledger import inequalities
from verification.ledger.cases import NAMED
from verification.ledger.differences import Difference, DrawnSetting, along, between, directions, pieces, uniform_piece
from verification.ledger.evidence import Evidence
from verification.ledger.inequalities import ALLOWANCE, INEQUALITIES, LEVELS, SHARES, Inequality, Reading
from verification.ledger.worst import Trial, WorstTally, discrete, draw_cases, pairs_of
from verification.machine.threads import one_thread
from verification.problem.specification import Problem

#: What fails as printed, on bodies that are named.
REFUTED = {("4.7", "printed"), ("5.13", "printed"), ("5.30", "printed")}

PLATE, LAYER = "plate of thickness 0.01 clamped at one end", "layer of a ten-thousandth on a block"

#: Random problems on which mutants are tried, beside the named ones.
FEW = 12

key = lambda inequality: (inequality.id, inequality.of)
NAME = lambda inequality: f"{inequality.id} {inequality.of}"
ENTRY = {key(inequality): inequality for inequality in INEQUALITIES}


@pytest.fixture(scope="module")
def quick(evidence) -> dict[str, list[Evidence]]:
    return evidence("inequalities on random problems")[0]


@pytest.fixture(scope="module")
def found(quick) -> dict[tuple[str, str], Evidence]:
    return {(id, one.of): one for id, several in quick.items() for one in several}


Subjects = list[tuple[Trial, list[Any]]]


#: As the ledger draws them, and random ones whose grids are drawn apart.
POOLS: dict[str, Callable[[], Iterator[tuple[Trial, np.random.Generator]]]] = {
    "any grids": lambda: draw_cases(FEW),
    "grids that differ": lambda: islice(draw_cases(FEW, lambda number: True), len(NAMED), None),
}


def on_pools(*entries: Any) -> list[Any]:
    """Each entry, whose first members or itself name an inequality, with each of the pools it is tried on."""
    result = []
    for entry in entries:
        inequality = entry if isinstance(entry, Inequality) else ENTRY[entry[:2]]
        name = NAME(inequality) if entry is inequality else f"{entry[0]}: {entry[2]}"
        pools = list(POOLS)[:1] if inequality.one_grid else POOLS
        result += [pytest.param(entry, kind, id=f"{name}, {kind}") for kind in pools]
    return result


@pytest.fixture(scope="module")
def pools(shared) -> Callable[[str], dict[str, Subjects]]:
    return cache(lambda kind: shared(("pool", kind), lambda: pool_of(kind)))


def pool_of(kind: str) -> dict[str, Subjects]:
    """What the inequalities speak of, on a few problems."""
    result: dict[str, Subjects] = {"bodies": [], "pairs": [], "contraction": []}
    with one_thread():
        for case, random in POOLS[kind]():
            result["bodies"].append((case, case))
            result["pairs"].append((case, pairs_of(case, random, starts=1, realised=4)))
            slight = case.at_share(SHARES[-1])
            result["contraction"].append((slight, pairs_of(slight, random, starts=0, realised=4)))
    return result


def worst(inequality: Inequality, pool: dict[str, Subjects]) -> float:
    """The largest ratio on the pool."""
    tally = WorstTally(inequality=inequality)
    with one_thread():
        for case, subjects in pool[inequality.about]:
            tally.take(case, subjects)
    return max(found for found, *_ in tally.by_unit.values())


def case_named(name: str) -> Trial:
    return Trial.of(name, Problem.from_dict(NAMED[name]))


# --- what is found ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("inequality", INEQUALITIES, ids=NAME)
def test_every_inequality_holds_but_for_the_three_refuted_as_printed(inequality, found):
    assert found[key(inequality)].holds is (key(inequality) not in REFUTED)


def test_what_holds_as_repaired_fails_as_printed_where_it_is_refuted():
    assert {key(i) for i in INEQUALITIES if i.of == "repaired"} >= {(id, "repaired") for id, _ in REFUTED}


def test_evidence_says_how_to_find_it_again_in_plain_numbers(found):
    count = LEVELS["quick"][0] + len(NAMED)
    apart = sum(case.grids_differ for case, _ in draw_cases(LEVELS["quick"][0]))
    assert abs(apart - LEVELS["quick"][0] / 3) <= 1
    for (id, of), evidence in found.items():
        document = evidence.to_dict()
        shares = len(SHARES) if ENTRY[id, of].about == "contraction" else 1
        kept = apart if ENTRY[id, of].one_grid else 0
        assert json.loads(json.dumps(document)) == document
        assert (document["method"], document["of"]) == ("discrete", of)
        data = document["data"]
        assert data["seed"] == inequalities.SEED
        assert data["problems"] == shares * (count - kept)
        if not kept:
            assert data["grids_differ"]["problems"] == shares * apart
            assert f"of which {shares * apart} have grids that differ" in document["text"]
            assert 0 < data["grids_differ"]["worst_ratio"] <= data["worst_ratio"]
        assert data["where"].startswith(("problem", "plate", "layer"))
        assert f"{data['worst_ratio']:.4g}" in document["text"]
        assert ("problem" in data) == (not data["where"].startswith("problem"))


def test_a_named_problem_can_be_read_back_from_its_evidence(found):
    data = found["5.13", "printed"].data
    assert Problem.from_dict(data["problem"]) == Problem.from_dict(NAMED[PLATE])


def test_figures_repeat_and_do_not_depend_on_what_else_is_asked_for(monkeypatch):
    monkeypatch.setitem(LEVELS, "quick", (3, 1, 2))
    everything, asked = discrete(), ("5.13", "5.30", "5.47", "4.8")
    again = discrete(asked)
    assert again == {id: everything[id] for id in again}
    assert set(again) == set(asked)


def test_progress_grows_to_1():
    seen: list[float] = []
    assert discrete(["no such statement"], watch=seen.append) == {}
    assert seen == sorted(seen)
    assert seen[-1] == 1.0


# --- the same figures by another route --------------------------------------------------------------------------------


def random_and_named() -> Iterator[tuple[Trial, DensePair]]:
    for case, _ in draw_cases(LEVELS["quick"][0]):
        yield case, DensePair.of(case.pair)


def test_the_worst_ratios_without_T_are_eigenvalues_of_dense_pencils(found):
    """(5.19), (5.22), (5.23) with m and M from the spectra of both bodies, and (4.7) with the other body's norm."""
    largest = dict.fromkeys(("5.19", "5.22", "5.23", "x-root-M", "4.7"), 0.0)
    for case, dense in random_and_named():
        bodies = (dense.contact, dense.neumann)
        spectra = [eigh(body.A, body.H, eigvals_only=True) for body in bodies]
        m, M = min(values[0] for values in spectra), sum(values[-1] for values in spectra)
        two, flexibility, dual = dense.neumann, np.linalg.inv(dense.neumann.S), np.linalg.inv(dense.neumann.E)
        roots = {
            "5.19": m * math.sqrt(top(symmetric(flexibility @ two.N @ flexibility), dual)[0]),
            "5.22": math.sqrt(m * top(flexibility, dual)[0]),
            "5.23": math.sqrt(m * top(dual, flexibility)[0]) / M,
            "x-root-M": math.sqrt(top(dual, flexibility)[0] / M),
        }
        if not case.grids_differ:
            roots["4.7"] = math.sqrt(max(top(bodies[1].E, bodies[0].N)[0], top(bodies[0].E, bodies[1].N)[0]))
        largest |= {id: max(largest[id], value) for id, value in roots.items()}
    for id, value in largest.items():
        assert found[id, "printed"].data["worst_ratio"] == pytest.approx(value, rel=1e-6)


def sliding_apart(dense: DensePair) -> tuple[dict[str, np.ndarray], float]:
    """Forms while every node is open and slips one way, from dense matrices; and C_s."""
    t, one, two = dense.t, dense.contact, dense.neumann
    J = np.zeros_like(one.S)
    J[:t, t:] = dense.friction * dense.weights[:, None] * dense.hat
    give, flexibility = -np.linalg.solve(one.S, J), np.linalg.inv(two.S)
    forms = {
        "size1": give.T @ one.N @ give,
        "size2": flexibility @ two.N @ flexibility,
        "norm": flexibility,
        "friction": symmetric(-J.T @ (give - flexibility)),
    }
    return forms, math.sqrt(max(top(dense.squared_stress(body), body.E)[0] for body in (one, two)))


@pytest.mark.parametrize(("thickness", "least"), [("0.02", 1.73), ("0.01", 4.04)])
def test_5_13_with_the_trace_constant_into_H_half_fails_on_a_thin_plate(thickness, least):
    """By dense matrices of their own: the quotient over the directions that are worst for some |d1|/|d2|."""
    case = case_named(f"plate of thickness {thickness} clamped at one end")
    dense = DensePair.of(case.pair)
    forms, C_s = sliding_apart(dense)
    bodies = (dense.contact, dense.neumann)
    kept = [dense.keep_tangential(body) for body in bodies]
    half = math.sqrt(max(min(top(k, body.E)[0] for k in kept) for body in bodies))
    full = math.sqrt(max(top(dense.B_T, body.E)[0] for body in bodies))
    quotients = []
    for r in np.logspace(-2, 2, 81):
        y = eigh(forms["friction"], forms["size1"] / (2 * r) + (1 + r / 2) * forms["size2"])[1][:, -1]
        d1, d2 = (math.sqrt(y @ forms[name] @ y) for name in ("size1", "size2"))
        quotients.append(float(y @ forms["friction"] @ y) / (d1 * d2 + d2**2) / (dense.friction * C_s))
    assert max(quotients) / half == pytest.approx(least, abs=0.02)
    assert max(quotients) / full < 1


@pytest.mark.parametrize(("id", "name", "unit"), [("5.13", PLATE, 1.0), ("5.30", LAYER, 1e-6)])
def test_loads_bring_about_two_forces_that_break_what_is_printed(id, name, unit):
    """All nodes open and slipping; the forces go through steps I and II, and the difference is that of the piece."""
    case, random = case_named(name), np.random.default_rng(1)
    piece = uniform_piece(case.pair, touching=False, sliding=1)
    inequality = ENTRY[id, "printed"]
    reading = inequality.reading(case.reading.in_unit(unit))
    candidates = [along(case.setting, piece, y) for y in directions(case.setting, piece, random)]
    expected = max(candidates, key=lambda d: inequality.ratio(d, reading))
    n, t = case.pair.contact.grid.n, case.pair.contact.grid.t
    g = np.concatenate([random.uniform(-1, 1, t), random.uniform(0.5, 1, n)])
    pair = with_loads(case.pair, g, *state_of(case.pair, piece.pattern, g, random))
    step = expected.force * np.linalg.norm(g) / np.linalg.norm(expected.force) / 1e4
    seen = between(DrawnSetting(pair=pair), g + step, g - step)
    assert inequality.ratio(expected, reading) > 1.4
    assert inequality.ratio(seen, reading) == pytest.approx(inequality.ratio(expected, reading), rel=1e-3)
    assert ENTRY[id, "repaired"].ratio(seen, case.reading) < 1


def test_two_forces_inside_a_piece_differ_as_the_piece_says():
    """Searched pieces of random problems, for loads that bring them about."""
    compared = 0
    for case, random in islice(draw_cases(4), len(NAMED), None):
        grid = case.pair.neumann.grid
        for piece in pieces(case.setting, random, starts=1):
            g = np.concatenate([random.uniform(-1, 1, grid.t), random.uniform(0.5, 1, grid.n)])
            pair = with_loads(case.pair, g, *state_of(case.pair, piece.pattern, g, random))
            y = directions(case.setting, piece, random)[1]
            expected = along(case.setting, piece, y)
            step = expected.force * np.linalg.norm(g) / np.linalg.norm(expected.force) / 1e5
            seen = between(DrawnSetting(pair=pair), g + step, g - step)
            scale = 2 * step[0] / expected.force[0]
            for name in ("size_1", "size_2", "norm", "dual", "norm_T", "dual_T"):
                assert getattr(seen, name) == pytest.approx(
                    abs(scale) * getattr(expected, name), rel=1e-4, abs=1e-6 * seen.norm
                )
            for name in ("friction", "energy_1", "inner", "work", "mixed_1"):
                assert getattr(seen, name) == pytest.approx(
                    scale**2 * getattr(expected, name), rel=1e-4, abs=1e-6 * scale**2 * expected.size
                )
            compared += 1
    assert compared >= 16


# --- what each inequality would not survive ---------------------------------------------------------------------------


@pytest.mark.parametrize(("inequality", "kind"), on_pools(*(i for i in INEQUALITIES if not i.equality)))
def test_a_right_side_smaller_than_the_worst_ratio_is_found_out(inequality, kind, pools):
    """Of several terms on the right each positive one is shrunk."""
    pool = pools(kind)
    share = 0.99 * min(worst(inequality, pool), 1.0)
    assert share > 0

    def shrunk(subject: Any, reading: Reading, theta: float) -> Any:
        right = inequality.right(subject, reading, theta)
        if isinstance(right, tuple):
            return tuple(np.where(term > 0, share * term, term) for term in right)
        if inequality.about == "bodies":
            return np.asarray(right) * (share**2 if inequality.squares else share)
        return np.where(right > 0, right * share, right / share)

    assert worst(replace(inequality, right=shrunk), pool) > 1 + ALLOWANCE


FLIPPED: dict[str, Callable[[Difference, float], Any]] = {
    "5.17": lambda d, t: d.d_1 @ d.setting.felt_1.T @ d.setting.coordinates.T,
    "5.24": lambda d, t: t**2 * d.norm_T**2 + (1 - t) ** 2 * d.norm**2 - 2 * t * (1 - t) * d.inner,
    "5.25": lambda d, t: -d.mixed_2,
    "5.26": lambda d, t: -d.work,
    "5.27": lambda d, t: d.mixed_1,
}


@pytest.mark.parametrize("kind", POOLS)
@pytest.mark.parametrize("id", FLIPPED)
def test_an_equality_with_a_sign_flipped_is_found_out(id, kind, pools):
    flipped = replace(ENTRY[id, "printed"], right=lambda d, r, t: FLIPPED[id](d, t))
    assert worst(flipped, pools(kind)) > 1.1


def test_every_equality_has_a_flipped_sign():
    assert set(FLIPPED) == {i.id for i in INEQUALITIES if i.equality}


#: id, of, what is wrong with the right side, and that right side.
MUTANTS: list[tuple[str, str, str, Callable[[Any, Reading, float], Any]]] = [
    ("4.8", "repaired", "no M/m", lambda b, r, t: np.ones(2)),
    ("4.8", "repaired", "half of its root", lambda b, r, t: np.sqrt(b.contrast) / 4),
    ("prop-4.1.1", "repaired", "no M/m, and one trace norm", lambda b, r, t: np.ones(2)),
    ("prop-4.1.1", "repaired", "one trace norm", lambda b, r, t: b.contrast),
    ("prop-4.1.2", "printed", "no M/m", lambda b, r, t: b.across(b.E)),
    ("prop-4.1.2", "printed", "one trace norm", lambda b, r, t: b.contrast),
    ("x-continuity", "printed", "2 mu", lambda b, r, t: np.array([2 * body.material.lame_mu for body in b.bodies])),
    ("x-lift-bound", "printed", "its root", lambda b, r, t: np.sqrt(b.contrast) / 2),
    ("5.11", "printed", "no C_K", lambda d, r, t: r.A / r.m * d.size_2),
    ("5.12", "printed", "no friction term", lambda d, r, t: d.mixed_1),
    ("5.12", "printed", "friction with its sign flipped", lambda d, r, t: (d.mixed_1, -d.friction)),
    ("5.13", "repaired", "half of it", lambda d, r, t: r.C_K / 2 * (d.size_1 * d.size_2 + d.size_2**2)),
    ("5.13", "repaired", "no |d1|", lambda d, r, t: r.C_K * d.size_2**2),
    ("5.14", "printed", "no C_K", lambda d, r, t: r.A * d.size_1 * d.size_2),
    ("5.15", "printed", "no C_K", lambda d, r, t: (r.A + r.C_K) ** 2 / (4 * r.m) * d.size_2**2 * 0.9),
    ("5.18", "printed", "no C_R", lambda d, r, t: r.M * d.size_1),
    ("5.18", "printed", "half of M", lambda d, r, t: r.A / 2 * d.size_1),
    ("5.19", "printed", "root of m, m > 1", lambda d, r, t: d.dual / r.m**1.5),
    ("5.22", "printed", "1/m", lambda d, r, t: d.dual / r.m),
    ("5.23", "printed", "root of M", lambda d, r, t: math.sqrt(r.M / r.m) * d.norm),
    ("x-root-M", "printed", "root of m", lambda d, r, t: math.sqrt(r.m) * d.norm),
    ("5.28", "printed", "no friction term", lambda d, r, t: -d.energy_1),
    ("5.29", "printed", "root of m/(M C_R)", lambda d, r, t: -(r.give**0.25) * d.norm_T**2),
    ("5.30", "repaired", "M/m not squared", lambda d, r, t: r.C_K / r.m * d.norm**2),
    ("5.31", "repaired", "no friction term", lambda d, r, t: -r.give * d.norm_T**2),
    ("5.36", "repaired", "no T", lambda d, r, t: (1 - t) ** 2 * d.norm**2),
    ("5.44", "repaired", "P halved", lambda d, r, t: (1 - t) ** 2 * d.norm**2 * 0.99),
    ("x-reaction", "printed", "half of rho", lambda d, r, t: r.energy[0] / 2 * d.energy_1),
    ("x-friction-energy", "printed", "no kappa_2", lambda d, r, t: r.energy[1] * np.sqrt(d.energy_1) * d.norm),
    ("x-friction-energy", "printed", "no kappa_1", lambda d, r, t: r.energy[2] * d.norm**2),
    ("x-ratio", "printed", "no friction", lambda d, r, t: math.sqrt(r.energy[0]) * d.norm),
    (
        "x-energy",
        "printed",
        "no friction",
        lambda d, r, t: replace(r, energy=(r.energy[0], 0.0, 0.0)).q_squared(t) * d.norm**2,
    ),
    (
        "x-energy",
        "printed",
        "half of rho",
        lambda d, r, t: replace(r, energy=(r.energy[0] / 2, *r.energy[1:])).q_squared(t) * d.norm**2,
    ),
]


@pytest.mark.parametrize(("mutant", "kind"), on_pools(*MUTANTS))
def test_a_wrong_right_side_is_found_out(mutant, kind, pools):
    id, of, _, right = mutant
    assert worst(replace(ENTRY[id, of], right=right), pools(kind)) > 1 + 1e-3


# --- how a ratio is formed --------------------------------------------------------------------------------------------


def test_a_negative_term_changes_sides():
    """3 - 2 <= 5 - 1 as (3 + 1)/(5 + 2)."""

    class Energies:
        size = 0.0

    inequality = Inequality(id="x", left=lambda d, r, t: (3.0, -2.0), right=lambda d, r, t: (5.0, -1.0))
    assert inequality.ratio(Energies(), None) == 4 / 7
    assert replace(inequality, right=lambda d, r, t: (0.0, 0.0)).ratio(Energies(), None) == 1.5
    assert replace(inequality, left=lambda d, r, t: -1.0).ratio(Energies(), None) == 1 / 6
    nothing = replace(inequality, left=lambda d, r, t: 1.0, right=lambda d, r, t: 0.0)
    assert nothing.ratio(Energies(), None) == math.inf


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("id", ["4.7", "5.19", "5.12", "5.17", "5.27"])
def test_what_cannot_be_compared_is_not_called_true(id, side):
    entry = ENTRY[id, "printed"]
    nan = lambda d, r, t: math.nan if id == "5.12" else np.asarray(getattr(entry, side)(d, r, t)) * math.nan
    case = next(iter(draw_cases(1)))[0]
    piece = uniform_piece(case.pair, touching=True, sliding=0)
    pair = along(case.setting, piece, np.ones(case.pair.contact.grid.n * 2))
    tally = WorstTally(inequality=replace(entry, **{side: nan}))
    tally.take(case, case if entry.about == "bodies" else Difference.of([pair]))
    tally.inequality = entry  # what follows does not cover it up
    tally.take(case, case if entry.about == "bodies" else Difference.of([pair]))
    assert tally.evidence.holds is False
    assert tally.evidence.data["worst_ratio"] is None


def test_editions_read_the_constants_as_the_paper_does():
    case = next(iter(draw_cases(1)))[0]
    base = case.reading
    small, large = base.in_unit(0.5 / base.m), base.in_unit(4 / base.m)
    assert (small.bracket.m, small.bracket.u, small.u) == (small.m, 1, small.m)
    assert (small.printed.m, small.printed.u) == (small.m, 1)
    assert (large.bracket.m, large.bracket.u) == (large.m, 1)
    assert (large.printed.m, large.printed.u) == (1, 1)
    for name in ("P", "Q", "D", "C_T", "X", "give"):
        assert getattr(small, name) == pytest.approx(getattr(base, name), rel=1e-12)
    assert small.bracket.P < base.P < large.bracket.P
    where_m_is_1 = base.in_unit(1 / base.m).bracket.P
    assert where_m_is_1 == pytest.approx(base.P, rel=1e-12)
