"""Section 5 where the grids of the two bodies differ: its constants from their definitions, and where P must stand."""

from __future__ import annotations

import math
from copy import deepcopy
from dataclasses import replace
from functools import cache
from itertools import islice

import numpy as np
import pytest
import section_5
from dense_oracle import DensePair, symmetric, top, trace
from section_5 import PAIRS, assert_all_hold, draw_pair, ratios, thetas_for
from strategies import AT_NIGHT

from verification.interface.interface import Interface
from verification.interface.join import Mortar
from verification.ledger.cases import NAMED, PROBLEMS, problem
from verification.ledger.convergence import RunsOfLevel, there_and_back
from verification.ledger.differences import Difference
from verification.ledger.inequalities import ALLOWANCE, INEQUALITIES, Reading
from verification.ledger.solutions import CHECKS
from verification.ledger.weak_forms import Case, Weak
from verification.ledger.worst import Trial, draw_cases, pairs_of
from verification.machine.threads import one_thread
from verification.problem.specification import Problem

ENTRY = {inequality.id: inequality for inequality in INEQUALITIES if inequality.of == "printed"}

#: Of the ledger's problems for whole fields.
APART = ["sheared, a finer contact grid", "open in part, a finer Neumann grid"]

#: Random problems.
COUNT = 12 if AT_NIGHT else 6

SEEDS = range(COUNT)


def trial(seed: int) -> Trial:
    return Trial.of(f"seed {seed}", problem(np.random.default_rng(seed), matching=False))


Pool = list[tuple[Trial, list[Difference]]]


def drawn() -> Pool:
    """Problems whose grids differ, with pairs of forces."""
    with one_thread():
        cases = islice(draw_cases(COUNT, lambda number: True), len(NAMED), None)
        return [(case, pairs_of(case, random, starts=1, realised=4)) for case, random in cases if case.grids_differ]


@pytest.fixture(scope="module")
def pool() -> Pool:
    return drawn()


# --- the constants, over all displacements of the bodies --------------------------------------------------------------


def by_definition(dense: DensePair) -> dict[str, float]:
    """Suprema over V^1 and V^2; "1" is the contact body, and P gamma v stands for the trace of the other one."""
    one, two, P = dense.contact, dense.neumann, dense.P
    own_1, own_2 = trace(one), trace(two)
    felt = P @ own_2
    normal = dense.pair.neumann.grid.normal
    stress_1, stress_2 = ((dense.hat @ forces[normal]) for forces in (P.T @ one.R.T @ one.A, two.R.T @ two.A))
    W, slides = np.diag(dense.weights), lambda body: np.arange(len(body.trace)) < len(body.trace) // 2
    form = lambda rows, gram: symmetric(rows.T @ gram @ rows)
    half = lambda body, traces: form(slides(body)[:, None] * traces, body.E)
    root = lambda *pencils: math.sqrt(max(top(*pencil)[0] for pencil in pencils))
    return {
        "C_R": root(
            (form(one.R @ own_1, one.H), one.H), (form(two.R @ own_2, two.H), two.H), (form(one.R @ felt, one.H), two.H)
        ),
        "C_tr": root((form(own_1, dense.B_T), one.H), (form(felt, dense.B_T), two.H)),
        "C_tr_half": max(
            root((half(one, own_1), one.H)), min(root((half(b, v), two.H)) for b, v in ((one, felt), (two, own_2)))
        ),
        "C_s": root((form(stress_1, W), one.H), (form(stress_2, W), two.H)),
        "rho_max": top(form(one.R @ felt, one.A), two.A)[0],
        "C_s_energy": root((form(stress_2, W), two.A)),
        "C_t1": root((form(own_1, dense.B_T), one.A)),
        "C_t2": root((form(felt, dense.B_T), two.A)),
    }


@pytest.mark.parametrize("seed", SEEDS)
def test_the_constants_are_those_of_the_definitions_with_the_trace_of_body_2_carried(seed):
    case = trial(seed)
    for name, value in by_definition(DensePair.of(case.pair)).items():
        assert getattr(case.measured, name).value == pytest.approx(value, rel=1e-8), name


# --- Section 5 for two forces, with dense matrices --------------------------------------------------------------------


@cache
def drawn_dense(seed: int) -> tuple[section_5.Case, np.random.Generator]:
    random = np.random.default_rng(seed)
    return section_5.Case(problem(random, matching=False)), random


def dense_case(seed: int) -> tuple[section_5.Case, np.random.Generator]:
    """The problem of a seed, made once, and the generator that drew it."""
    case, random = drawn_dense(seed)
    return case, deepcopy(random)


@pytest.mark.parametrize("kind", PAIRS)
@pytest.mark.parametrize("seed", SEEDS)
def test_section_5_holds_for_two_forces(seed, kind):
    case, random = dense_case(seed)
    for _ in range(3):
        forces = draw_pair(case, kind, random)
        for theta in thetas_for(case, random):
            assert_all_hold(ratios(case, forces, theta))


# --- where P must stand -----------------------------------------------------------------------------------------------


def own_lifts(case: Trial) -> Reading:
    """C_R of each body in its own norm: without ``R_D^1 P``."""
    return replace(case.reading, C_R=math.sqrt(max(top(N, E)[0] for N, E in zip(case.N, case.E, strict=True))))


def one_trace(case: Trial) -> Reading:
    """kappa_2 with the tangential trace of the contact body for that of the Neumann body, which P carries."""
    rho, kappa_1, _ = case.reading.energy
    return replace(case.reading, energy=(rho, kappa_1, kappa_1))


@pytest.mark.parametrize(("id", "wrong"), [("5.18", own_lifts), ("x-friction-energy", one_trace)])
def test_a_constant_that_does_not_know_P_is_found_out(id, wrong, pool):
    assert worst(id, pool) <= 1 + ALLOWANCE
    assert max(ENTRY[id].ratio(pair, wrong(case)) for case, pairs in pool for pair in pairs) > 1.001


def worst(id: str, pool: Pool) -> float:
    thetas = lambda case: (0.0,) if ENTRY[id].thetas is None else ENTRY[id].thetas(case.reading)
    return max(ENTRY[id].ratio(pair, case.reading, t) for case, pairs in pool for pair in pairs for t in thetas(case))


RETURNED = ["5.17", "5.27", "x-ratio", "x-energy"]


def test_forces_that_return_to_the_nearest_node_break_the_theorem(monkeypatch, pool):
    """Not by P': T then is another map, and its inequalities fail, not its equalities alone."""
    assert max(worst(id, pool) for id in RETURNED) <= 1 + ALLOWANCE

    def nearest(self, forces):
        closest = np.abs(self.neumann.x[:, None] - self.contact.x).argmin(axis=0)
        Q = np.zeros((self.neumann.n, self.contact.n))
        Q[closest, np.arange(self.contact.n)] = 1
        return np.concatenate([Q @ block for block in np.split(forces, 2)])

    monkeypatch.setattr(Interface, "carry_back", nearest)
    other = drawn()
    assert min(worst(id, other) for id in RETURNED) > 1.005


# --- what needs one grid ----------------------------------------------------------------------------------------------


def test_a_finer_neumann_grid_has_traces_that_the_contact_body_does_not_feel(pool):
    """(4.7) with the norm of the other body and Proposition 4.1 (i) have no meaning there: P takes some traces to 0."""
    finer = [case for case, _ in pool if case.pair.neumann.grid.n > case.pair.contact.grid.n]
    assert len(finer) >= 2
    for case in finer:
        felt = case.pair.interface.carry_form(case.N[0])
        assert np.linalg.eigvalsh(felt)[0] <= 1e-12 * np.linalg.eigvalsh(case.N[1])[0]


def test_the_lifts_of_proposition_5_1_do_not_lead_back_where_the_grids_differ():
    """``R^1 gamma R^2 gamma z = z`` on one grid; else not even the sign of the energy is kept."""
    found = {name: there_and_back(Case(name=name, problem=Problem.from_dict(PROBLEMS[name]))) for name in APART}
    assert found["sheared, a finer contact grid"] < 0
    assert found["open in part, a finer Neumann grid"] == pytest.approx(0.881, abs=0.001)


@pytest.mark.parametrize("name", APART)
@pytest.mark.parametrize("statement", ["2.3", "4.4", "4.9.2", "4.9.3", "5.1", "5.2", "5.3", "5.4", "5.5"])
def test_a_transfer_that_is_off_by_a_millionth_is_found_out_in_the_weak_forms(name, statement):
    """The solution and the run of one P against the weak forms of another; one that opens a gap, or one that closes."""
    case = Case(name=name, problem=Problem.from_dict(PROBLEMS[name]))
    kept = {what: getattr(case, what) for what in ("solution", "run", "limit", "steps", "arbitrary")}
    interface = case.weak.pair.interface
    middle = interface.contact.n // 2

    def holds(change):
        P = interface.transfer.copy()
        P[middle, P[middle].argmax()] += change
        pair = replace(case.weak.pair, interface=replace(interface, join=Mortar(nodal=P)))
        other = type("Given", (Case,), kept | {"weak": Weak(pair=pair)})(name=name, problem=case.problem)
        return CHECKS[statement](type("Only", (RunsOfLevel,), {"cases": [other]})(level="quick"))[-1].holds

    assert holds(0.0)
    assert not (holds(1e-6) and holds(-1e-6))
