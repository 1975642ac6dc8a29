"""Much friction: pieces of T_theta with a spectral radius above 1, and runs that begin in them."""

import re
from dataclasses import replace
from functools import cache
from itertools import islice, takewhile

import numpy as np
import pytest
from problem_list import blocks

import verification as vf
from verification.free_norm.norm import FreeNorm
from verification.free_norm.radius import largest_radius

#: k and theta of the equal blocks; 9 contact nodes on blocks of 1 x 1.
K, THETA = 8, 0.3


@cache
def found(radius):
    """The piece that the search finds where the hat kernel has some radius, and the largest eigenvalue of T' on it."""
    contact, iteration = {"friction": K, "radius": radius}, {"max_iterations": 2000}
    data = blocks(cells=((8, 8), (8, 8)), young=(1, 1), contact=contact, iteration=iteration)
    pair = vf.build(vf.Problem.from_dict(data))
    best = largest_radius(pair, THETA)
    values = np.linalg.eigvals(best.pieces[0].jacobian)
    return best, values[np.argmax(np.abs(1 - THETA + THETA * values))]


def with_fixed_point(piece, moved=3.0):
    """Loads for which a force g is a fixed point inside a piece, and g.

    Touching nodes have a pressure of 1, the others a gap, and nodes that slide a slip, of size ``moved``.
    """
    pair, pattern, t = piece.pair, piece.pattern, piece.pair.contact.grid.t
    g = np.concatenate([np.zeros(t), pattern.touching])
    g[:t] = pattern.sliding * pair.bound(g)
    v = moved * np.concatenate([pattern.sliding, -1.0 * ~pattern.touching])
    load = g + pair.contact.schur @ (pair.interface.carry(pair.neumann.flexibility(g + pair.neumann.load)) + v)
    return replace(pair, contact=replace(pair.contact, load=load)), g


def beside(piece, pair, g, distance=1e-6):
    """A force at some distance from g, relative to its size, along the dominant eigenvector of J in the norm (5.21)."""
    values, vectors = np.linalg.eig(piece.relaxed(THETA))
    direction = piece.basis @ vectors[:, np.argmax(np.abs(values))].real
    return g + distance * pair.neumann.dual_norm(g) / pair.neumann.dual_norm(direction) * direction


def steps(pair, theta, start, count):
    return list(islice(vf.iterate(pair, theta=theta, start=start), count))


@pytest.mark.parametrize(
    ("radius", "value", "eigenvalue", "pattern"),
    [
        ("1/2", 1.8045, -8.348, r"o> T> T> T> .. T< T< T< o<"),
        ("4/5", 1.1641, 1.292 + 1.384j, r"o< T< T< o< o< o< o< o< o<|o> o> o> o> o> o> T> T> o>"),
    ],
)
def test_equal_blocks_have_a_piece_in_which_no_norm_contracts(radius, value, eigenvalue, pattern):
    """T touches, o is open, < and > slide to either side; one pattern or its mirror image is found.

    The node in the middle of the first does not move with the dominant eigenvector, so its state does not matter.
    """
    best, largest = found(radius)
    piece = best.pieces[0].pattern
    assert best.value == pytest.approx(value, abs=1e-4)
    assert complex(largest.real, abs(largest.imag)) == pytest.approx(eigenvalue, abs=1e-3)
    states = zip(piece.touching.tolist(), piece.sliding.tolist(), strict=True)
    assert re.fullmatch(pattern, " ".join("oT"[touches] + "=><"[slides] for touches, slides in states))
    pair = best.pieces[0].pair
    assert FreeNorm(pair, vf.measure(pair)).factor(THETA) is None


@pytest.mark.parametrize("radius", ["1/2", "4/5"])
def test_a_run_leaves_the_piece_at_the_rate_of_its_spectral_radius(radius):
    best, _ = found(radius)
    piece = best.pieces[0]
    pair, g = with_fixed_point(piece)
    norm = pair.neumann.dual_norm
    at_g = next(vf.iterate(pair, theta=THETA, start=g))
    assert at_g.contact.pattern == piece.pattern
    assert at_g.residual < 1e-13 * norm(g)
    run = steps(pair, THETA, beside(piece, pair, g, 1e-9), 200)
    inside = list(takewhile(lambda state: state.contact.pattern == piece.pattern, run))
    assert 10 < len(inside) < len(run)
    distance = [norm(state.g - g) for state in inside]
    assert (distance[-1] / distance[0]) ** (1 / (len(inside) - 1)) == pytest.approx(best.value, rel=0.03)
    assert distance[-1] > 1e-3 * norm(g)


@pytest.mark.parametrize("start", ["beside", "zero"])
def test_a_negative_eigenvalue_makes_the_run_cycle_between_two_forces_and_a_smaller_theta_converges(start):
    piece = found("1/2")[0].pieces[0]
    pair, g = with_fixed_point(piece)
    norm = pair.neumann.dual_norm
    begin = beside(piece, pair, g) if start == "beside" else np.zeros_like(g)
    end = [state.g for state in steps(pair, THETA, begin, 300)[-3:]]
    assert norm(end[2] - end[0]) < 1e-12 * norm(g)
    assert norm(end[2] - end[1]) > 1e-2 * norm(g)
    assert vf.run(pair, theta=THETA, start=begin).outcome == "stalled"
    smaller = vf.run(pair, theta=0.1, start=begin)
    assert smaller.converged
    assert norm(smaller.last.g - g) < 1e-6 * norm(g)


@pytest.mark.parametrize("theta", [0.3, 0.1, 0.03])
def test_where_the_real_part_of_an_eigenvalue_is_above_1_no_theta_that_was_tried_arrives(theta):
    """|1 - theta + theta lambda| > 1 for every theta > 0: the fixed point repels, and the run stays at a distance."""
    best, eigenvalue = found("4/5")
    assert eigenvalue.real > 1.2
    pair, g = with_fixed_point(best.pieces[0])
    norm = pair.neumann.dual_norm
    run = steps(pair, theta, beside(best.pieces[0], pair, g, 1e-3), 1000)
    late = run[-200:]
    assert min(state.residual for state in late) > 1e-3 * norm(g)
    assert 1e-3 * norm(g) < min(norm(state.g - g) for state in late)
    assert max(norm(state.g - g) for state in run) < norm(g)


def test_on_section_6_every_load_has_one_solution_up_to_a_friction_and_some_load_has_two_a_little_above():
    """Below, some norm contracts for every small theta.  Above, T' has a real eigenvalue above 1 on a piece."""
    below, above = (vf.build(vf.example("section6")).at(friction=k) for k in ("2.4", "2.7"))
    assert FreeNorm(below, vf.measure(below)).every_small_theta() is not None
    assert FreeNorm(above, vf.measure(above)).every_small_theta() is None
    best = largest_radius(above, 0.02)
    assert 1 < best.value < 1.002
    pair, g = with_fixed_point(best.pieces[0], moved=3e-4)
    one, other = (steps(pair, 0.1, start, 1500)[-1] for start in (g, beside(best.pieces[0], pair, g, 1e-2)))
    norm = pair.neumann.dual_norm
    assert max(one.residual, other.residual) < 1e-10 * norm(g)
    assert norm(other.g - g) > 1e-2 * norm(g)
