"""Step II for a body that can move along Gamma_c in one rigid motion, which only friction resists."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import verification as vf
from verification.contact import ContactError, ContactStep
from verification.contact.active_set import ActiveSet, Pattern, Systems
from verification.contact.step import way_out
from verification.reproduce import READINGS


def one_motion(random, n):
    """S, shape (2 n, 2 n), and its kernel: one motion along Gamma_c."""
    A, z = random.normal(size=(2 * n, 2 * n)), np.concatenate([np.full(n, n**-0.5), np.zeros(n)])
    off = np.eye(2 * n) - np.outer(z, z)
    return off @ (A @ A.T + np.eye(2 * n)) @ off, z[:, None]


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 6), kind=st.sampled_from(["along", "off", "both"]))
def test_the_way_out_of_one_motion_is_that_of_the_linear_program(seed, n, kind):
    """A second motion that moves nothing leaves the question as it is, and it to the program."""
    random = np.random.default_rng(seed)
    z = np.zeros((2 * n, 1))
    if kind != "off":
        z[:n, 0] = random.choice([-1.0, 0.0, 1.0], n)
    if kind != "along":
        z[n:, 0] = random.choice([-1.0, 1.0]) * random.integers(0, 2, n) if seed % 3 else random.normal(size=n)
    q, bound = random.normal(size=2 * n), random.choice([0.0, 0.1, 1.0], n)
    assert way_out(z, q, bound) == way_out(np.hstack([z, 0 * z]), q, bound)


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(2, 7))
def test_a_body_that_friction_alone_holds_along_the_line_has_the_active_set_of_the_program(seed, n):
    random = np.random.default_rng(seed)
    S, z = one_motion(random, n)
    q, bound = random.normal(size=2 * n), random.uniform(0.2, 1.0, n)
    q[n:] += 2.0
    make = lambda solver: ContactStep(S, np.ones(2 * n, dtype=bool), n, solver, motions=z)
    if way_out(z, q, bound):
        with pytest.raises(ContactError):
            make("active-set").solve(q, bound)
        return
    found, expected = (make(solver).solve(q, bound) for solver in ("auto", "cvxpy"))
    assert found.pattern == expected.pattern
    assert np.array_equal(found.force, expected.force)


@pytest.mark.parametrize("way", [-1, 1])
def test_the_node_that_sticks_while_all_others_slide_is_found_without_the_program(way):
    """Three nodes in a chain of springs, worked out by hand; a fourth one slides, and the motion does not move it."""
    S = np.diag([1.0, 2, 1, 1, 2, 2, 2, 2])
    S[[0, 1, 1, 2], [1, 0, 2, 1]] = -1
    z = np.sqrt(np.array([1, 1, 1, 0, 0, 0, 0, 0])[:, None] / 3)
    q = np.array([*(way * np.array([3, 0.5, -1.5, 3])), 1, 1, 1, 1])
    found = ContactStep(S, np.ones(8, dtype=bool), 4, "active-set", motions=z).solve(q, np.ones(4))
    assert found.pattern.sliding.tolist() == [way, way, 0, way]
    assert found.v[:4] == pytest.approx(way * np.array([3.5, 1.5, 0, 2]), abs=1e-12)
    assert found.force[:4] == pytest.approx(way * np.array([1, 1, 0, 1]), abs=1e-12)


@pytest.mark.parametrize("way", [-1, 1])
def test_a_body_that_the_loads_move_along_the_line_slides_as_a_whole(way):
    """Friction holds 2 and the loads are 5, so that no node sticks while the second one opens."""
    S, z = np.diag([1.0, 1, 2, 2]), np.sqrt([[0.5], [0.5], [0], [0]])
    S[0, 1] = S[1, 0] = -1
    systems = Systems(S, np.ones(4, dtype=bool), z)
    asked, of = [], systems.of
    systems.of = lambda pattern: asked.append(pattern) or of(pattern)
    start = Pattern(touching=np.ones(2, dtype=bool), sliding=np.full(2, way, dtype=np.int8))
    q = np.array([3.0 * way, 2.0 * way, 2, -1])
    assert way_out(z, q, np.ones(2)).startswith("along Gamma_c")
    *_, pattern = ActiveSet(S, np.ones(4, dtype=bool), 2, z, systems).solve(q, np.ones(2), start)
    assert pattern.touching.tolist() == [True, False]
    assert [found.sliding.tolist() for found in asked] == [[way, way]] * 2


def test_the_bodies_of_section_6_that_slide_below_their_top_need_no_program():
    """Moduli exchanged: most steps of these runs had been left to the program, as all nodes slip but one."""
    reading = next(r for r in READINGS if (r.top, r.neumann_body, r.moduli) == ("free to slide", 1, "exchanged"))
    run = vf.run(reading.problem(60), theta="0.6")
    assert run.outcome == "stalled"
    assert any(np.count_nonzero(state.contact.pattern.sliding) >= 8 for state in run.iterates)
    assert all(state.contact.solver == "active-set" for state in run.iterates)
