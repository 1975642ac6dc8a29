"""Schur complements, lifts and solves against elimination in rationals.

A matrix in floats is a rational matrix: its exact Schur complement exists, and only the factorisation's rounding, of
the size n eps |A| (1 + |lift|^2), separates the computed one from it.
"""

from fractions import Fraction

import fem_oracle
import numpy as np
import pytest
import scipy.sparse as sp
from condensed_cases import EPS, condensed_bodies, definite, either, norm
from hypothesis import given
from hypothesis import strategies as st
from strategies import fewer, held_bodies, numbers, powers_of_two

from fem1d2d import (
    Condensation,
    bar,
    elimination_order,
    gram,
    interval,
    plane_strain,
    rectangle,
    solver,
    solver_with_inertia,
    stiffness,
)
from fem1d2d.condense import BLOCK


def rounding(A, lift):
    """n eps |A| (1 + |lift|^2)."""
    return len(A) * EPS * norm(A) * (1 + norm(lift) ** 2)


# --- against elimination in rationals ---------------------------------------------------------------------------------


@either
@given(definite())
def test_the_schur_complement_and_the_lift_are_those_of_elimination_in_rationals(kind, case):
    A, floats, interface = case
    found = kind(floats, interface)
    lift, schur = fem_oracle.lift(A, interface), fem_oracle.schur(A, interface)
    assert found.schur.shape == (len(interface),) * 2
    assert found.lift.shape == (len(A) - len(interface), len(interface))
    assert norm(fem_oracle.exactly(found.schur) - schur) <= rounding(A, lift)
    inside = fem_oracle.inner(len(A), interface)
    residual = A[np.ix_(inside, inside)] @ (fem_oracle.exactly(found.lift) - lift)
    assert norm(residual) <= len(A) * EPS * norm(A) * (1 + norm(lift))


@either
@fewer(10)
@given(held_bodies(most=2), st.integers(1, 3), st.integers(0, 2**16))
def test_a_small_elastic_body_is_condensed_as_in_rationals(kind, body, b, seed):
    mesh, material, free = body
    matrix = stiffness(mesh, material)[free][:, free].tocsc()
    interface = np.random.default_rng(seed).permutation(len(free))[:b]
    A = fem_oracle.exactly(matrix.toarray())
    A = (A + A.T) / 2
    found = kind(matrix, interface)
    lift = fem_oracle.lift(A, interface)
    assert norm(fem_oracle.exactly(found.schur) - fem_oracle.schur(A, interface)) <= rounding(A, lift)


@either
@given(definite())
def test_the_lift_solves_the_inner_equations_and_its_energy_is_the_schur_complement(kind, case):
    A, floats, interface = case
    found = kind(floats, interface)
    basis = np.array([found.extend(row) for row in np.eye(len(interface))]).T  # columns: extended unit vectors
    assert np.array_equal(basis[interface], np.eye(len(interface)))
    if kind is Condensation:
        assert np.array_equal(basis[found.inside], found.lift)
    cond = np.linalg.cond(A.astype(float))
    assert norm(basis[found.inside] - found.lift) <= len(A) * EPS * cond * norm(found.lift)  # one by one or at once
    R = fem_oracle.exactly(basis)
    assert norm(R.T @ A @ R - fem_oracle.schur(A, interface)) <= rounding(A, found.lift)


@given(definite(), st.integers(0, 2**16))
def test_no_extension_of_interface_values_has_less_energy_than_their_schur_form(case, seed):
    A, floats, interface = case
    random = np.random.default_rng(seed)
    v = fem_oracle.exactly(random.integers(-9, 10, len(A)))
    phi = v[interface]
    assert v @ A @ v >= phi @ fem_oracle.schur(A, interface) @ phi
    schur = Condensation(floats, interface).schur
    slack = rounding(A, fem_oracle.lift(A, interface)) * float(phi @ phi)
    assert v @ A @ v >= phi.astype(float) @ schur @ phi.astype(float) - slack


@either
@given(definite(), st.integers(0, 2**16))
def test_condensed_loads_extensions_and_solves_are_those_of_the_whole_system(kind, case, seed):
    A, floats, interface = case
    n, found = len(A), kind(floats, interface)
    random = np.random.default_rng(seed)
    load, phi = random.integers(-9, 10, n), random.integers(-9, 10, len(interface))
    inside, lift = fem_oracle.inner(n, interface), fem_oracle.lift(A, interface)
    scale = n * EPS * (1 + norm(lift)) * (1 + norm(A))
    condensed = load[interface] + lift.T @ load[inside]
    assert norm(fem_oracle.exactly(found.condense(load.astype(float))) - condensed) <= scale * (1 + norm(load))
    exact = fem_oracle.zeros(n)
    exact[interface] = phi
    coupling = A[np.ix_(inside, interface)] @ phi
    exact[inside] = fem_oracle.solve(A[np.ix_(inside, inside)], (load[inside] - coupling)[:, None])[:, 0]
    extended = found.extend(phi.astype(float), load.astype(float))
    assert extended[interface].tolist() == phi.tolist()
    A_II = A[np.ix_(inside, inside)]
    assert norm(A_II @ (fem_oracle.exactly(extended) - exact)[inside]) <= scale * (1 + norm(load) + norm(phi))
    solution = fem_oracle.exactly(solver(found.matrix)(load.astype(float)))
    assert norm(A @ solution - load) <= 4 * n * EPS * norm(A) * (1 + norm(solution))


@either
@given(definite(), st.integers(0, 2**16))
def test_a_form_on_lifts_is_its_product_with_the_lift_of_elimination_in_rationals(kind, case, seed):
    A, floats, interface = case
    n = len(A)
    G = np.random.default_rng(seed).integers(-4, 5, (n, n))
    X = G + G.T
    R = fem_oracle.zeros(n, len(interface))
    R[interface, np.arange(len(interface))] = 1
    R[fem_oracle.inner(n, interface)] = fem_oracle.lift(A, interface)
    exact = R.T @ fem_oracle.exactly(X) @ R
    found = kind(floats, interface).on_lifts(sp.csc_array(X.astype(float)))
    cond = np.linalg.cond(A.astype(float))
    assert norm(fem_oracle.exactly(found) - exact) <= n * EPS * cond * norm(X) * norm(R) ** 2
    assert np.array_equal(found, found.T)


# --- semidefinite ----------------------------------------------------------------------------------------------------


@st.composite
def semidefinite(draw, most=7):
    """Springs between points on a line that nothing holds: the kernel is what moves all of them by as much."""
    n = draw(st.integers(2, most))
    random = np.random.default_rng(draw(st.integers(0, 2**16)))
    A = np.zeros((n, n), dtype=int)
    for i in range(1, n):
        for j in {i - 1, int(random.integers(i))}:
            A[np.ix_([i, j], [i, j])] += random.integers(1, 5) * np.array([[1, -1], [-1, 1]])
    interface = random.permutation(n)[: draw(st.integers(1, n))]
    return fem_oracle.exactly(A), sp.csc_array(A.astype(float)), interface


@either
@given(semidefinite(), st.integers(0, 2**16))
def test_what_nothing_holds_is_condensed_as_in_rationals_and_keeps_its_rigid_motion(kind, case, seed):
    A, floats, interface = case
    found, lift = kind(floats, interface, singular=True), fem_oracle.lift(A, interface)
    assert norm(fem_oracle.exactly(found.schur) - fem_oracle.schur(A, interface)) <= 4 * rounding(A, lift)
    assert np.abs(found.schur.sum(axis=0)).max() <= 4 * rounding(A, lift)
    load = np.random.default_rng(seed).integers(-9, 10, len(A))
    loaded = kind(floats, interface, singular=True)
    condensed = load[interface] + lift.T @ load[fem_oracle.inner(len(A), interface)]
    scale = len(A) * EPS * (1 + norm(lift)) * (1 + norm(A))
    assert norm(fem_oracle.exactly(loaded.condense(load.astype(float))) - condensed) <= 4 * scale * (1 + norm(load))
    assert norm(fem_oracle.exactly(loaded.schur) - fem_oracle.schur(A, interface)) <= 4 * rounding(A, lift)
    G = np.random.default_rng(seed).integers(-4, 5, A.shape)
    R = fem_oracle.zeros(len(A), len(interface))
    R[interface, np.arange(len(interface))] = 1
    R[fem_oracle.inner(len(A), interface)] = lift
    exact = R.T @ fem_oracle.exactly(G + G.T) @ R
    slack = 1e3 * len(A) * EPS * norm(G + G.T) * norm(R) ** 2
    assert norm(fem_oracle.exactly(found.on_lifts(sp.csc_array((G + G.T).astype(float)))) - exact) <= slack
    for call in (found.solver, lambda: found.response(load.astype(float))):
        with pytest.raises(ValueError, match="singular: needed a definite one"):
            call()


# --- on elastic bodies, against dense linear algebra ------------------------------------------------------------------


def dense_lift(A, interface):
    inside = fem_oracle.inner(len(A), interface)
    return (
        -np.linalg.solve(A[np.ix_(inside, inside)], A[np.ix_(inside, interface)])
        if len(inside)
        else np.empty((0, len(A)))
    )


@either
@fewer(4, at_night=1)
@given(condensed_bodies())
def test_a_condensed_body_is_its_dense_schur_complement(kind, case):
    matrix, interface = case
    A, found = matrix.toarray(), kind(matrix, interface)
    inside, lift = fem_oracle.inner(len(A), interface), dense_lift(A, interface)
    assert found.inside.tolist() == inside.tolist()
    schur = A[np.ix_(interface, interface)] + A[np.ix_(interface, inside)] @ lift
    assert norm(found.schur - schur) <= rounding(A, lift)
    assert np.array_equal(found.schur, found.schur.T)
    assert np.linalg.eigvalsh(found.schur).min() > 0


@fewer(4, at_night=1)
@given(condensed_bodies())
def test_the_matrix_itself_on_lifts_is_its_schur_complement(case):
    matrix, interface = case
    found = Condensation(matrix, interface)
    assert norm(found.on_lifts(matrix) - found.schur) <= rounding(matrix.toarray(), found.lift)


@fewer(4, at_night=1)
@given(held_bodies(3), st.integers(0, 2**16), powers_of_two(-40, 40))
def test_the_norm_of_the_elastic_lift_is_read_off_one_factorisation(body, seed, unit):
    """In any unit of stress."""
    mesh, material, free = body
    A, H = (matrix[free][:, free].tocsc() for matrix in (stiffness(mesh, material) * float(unit), gram(mesh)))
    interface = np.random.default_rng(seed).permutation(len(free))[: (len(free) + 1) // 2]
    found = Condensation(A, interface)
    fields = np.zeros((len(free), len(interface)))
    fields[interface, np.arange(len(interface))] = 1
    fields[found.inside] = dense_lift(A.toarray(), interface)
    slack = len(free) * EPS * np.linalg.cond(A.toarray()) * norm(H.toarray()) * norm(fields) ** 2
    assert norm(found.on_lifts(H) - fields.T @ H @ fields) <= slack


@fewer(4, at_night=1)
@given(held_bodies(3), st.integers(0, 2**16))
def test_matrices_of_one_mesh_share_an_order_of_elimination(body, seed):
    mesh, material, free = body
    A, H = (matrix[free][:, free].tocsc() for matrix in (stiffness(mesh, material), gram(mesh)))
    interface = np.random.default_rng(seed).permutation(len(free))[: (len(free) + 1) // 2]
    order = elimination_order(A, interface)
    assert sorted(order) == list(range(len(free)))
    assert order[len(free) - len(interface) :].tolist() == interface.tolist()
    shared, own = Condensation(H, interface, order), Condensation(H, interface)
    assert norm(shared.schur - own.schur) <= rounding(H.toarray(), own.lift)
    assert norm(shared.lift - own.lift) <= rounding(H.toarray(), own.lift)
    load = np.arange(1.0, len(free) + 1)
    assert norm(H @ solver(H, order)(load) - load) <= len(free) * EPS * (
        norm(H.toarray()) * norm(solver(H, order)(load)) + norm(load)
    )


@either
@fewer(4, at_night=1)
@given(condensed_bodies(), st.integers(0, 2**16))
def test_the_solver_of_a_condensation_solves_the_whole_system_and_leaves_its_schur_complement(kind, case, seed):
    matrix, interface = case
    load = np.random.default_rng(seed).standard_normal(matrix.shape[0])
    one, other = kind(matrix, interface), kind(matrix, interface)
    x = one.solver()(load)
    assert norm(matrix @ x - load) <= len(load) * EPS * (norm(matrix.toarray()) * norm(x) + norm(load))
    assert np.array_equal(one.schur, other.schur)


def test_an_interface_longer_than_a_block_of_right_hand_sides_is_condensed_whole():
    mesh = rectangle((0.0, 4.0), (0.0, 1.0), (2 * BLOCK, 2))
    matrix = gram(mesh)[::2, ::2].tocsc()
    interface = np.arange(0, len(mesh.points), 3)[::-1][: 2 * BLOCK + 1]
    A, found = matrix.toarray(), Condensation(matrix, interface)
    inside, lift = fem_oracle.inner(len(A), interface), dense_lift(A, interface)
    schur = A[np.ix_(interface, interface)] + A[np.ix_(interface, inside)] @ lift
    assert norm(found.schur - schur) <= rounding(A, lift)
    assert norm(Condensation(matrix, interface).lift - lift) <= rounding(A, lift)


@either
@fewer(4, at_night=1)
@given(condensed_bodies(), st.integers(0, 2**16))
def test_a_solve_leaves_no_residual(kind, case, seed):
    matrix, interface = case
    load = np.random.default_rng(seed).standard_normal(matrix.shape[0])
    found = kind(matrix, interface)
    x = solver(found.matrix)(load)
    n, size = len(load), norm(matrix.toarray())
    assert norm(matrix @ x - load) <= n * EPS * (size * norm(x) + norm(load))
    trace = x[interface]
    assert norm(found.extend(trace, load) - x) <= n * EPS * np.linalg.cond(matrix.toarray()) * norm(x)
    assert norm(found.schur @ trace - found.condense(load)) <= n * EPS * (1 + norm(found.lift)) ** 2 * (
        size * norm(x) + norm(load)
    )


@fewer(4, at_night=1)
@given(condensed_bodies(), st.integers(0, 2**16))
def test_the_order_of_the_interface_is_the_order_of_the_schur_complement(case, seed):
    matrix, interface = case
    order = np.random.default_rng(seed).permutation(len(interface))
    one, other = Condensation(matrix, interface), Condensation(matrix, interface[order])
    slack = rounding(matrix.toarray(), one.lift)
    assert norm(other.schur - one.schur[np.ix_(order, order)]) <= slack
    assert norm(other.lift - one.lift[:, order]) <= slack
    phi = np.arange(1.0, len(interface) + 1)
    assert other.extend(phi[order])[interface].tolist() == phi.tolist()


@fewer(4, at_night=1)
@given(condensed_bodies(), st.integers(0, 2**16))
def test_condensing_in_two_steps_is_condensing_at_once(case, seed):
    matrix, interface = case
    some = np.random.default_rng(seed).permutation(len(interface))[: (len(interface) + 1) // 2]
    first = Condensation(matrix, interface)
    second, once = Condensation(sp.csc_array(first.schur), some), Condensation(matrix, interface[some])
    slack = rounding(matrix.toarray(), once.lift) + rounding(first.schur, second.lift)
    assert norm(second.schur - once.schur) <= (1 + norm(first.lift)) ** 2 * slack


@either
@fewer(4, at_night=1)
@given(condensed_bodies())
def test_an_interface_of_all_unknowns_leaves_the_matrix_as_it_is(kind, case):
    matrix, interface = case
    everything = np.concatenate([interface, fem_oracle.inner(matrix.shape[0], interface)])
    found, A = kind(matrix, everything), matrix.toarray()
    assert found.lift.shape == (0, len(everything))
    permuted = A[np.ix_(everything, everything)]
    assert np.array_equal(found.schur, (permuted + permuted.T) / 2)
    load = np.arange(1.0, len(A) + 1)
    assert found.condense(load).tolist() == load[everything].tolist()
    assert norm(A @ solver(found.matrix)(load) - load) <= len(A) * EPS * norm(A) * (
        1 + norm(solver(found.matrix)(load))
    )


@either
@fewer(4, at_night=1)
@given(condensed_bodies(), powers_of_two(-20, 20))
def test_scaling_the_matrix_scales_the_energy_and_keeps_the_lift(kind, case, c):
    matrix, interface = case
    one, other = kind(matrix, interface), kind((matrix * float(c)).tocsc(), interface)
    assert np.array_equal(other.lift, one.lift)
    assert np.array_equal(other.schur, one.schur * float(c))


@pytest.mark.parametrize("power", [-300, -40, 40, 300])
def test_a_body_that_nothing_holds_is_condensed_alike_in_every_unit(power):
    """What is added on the way scales with the matrix, whose entries far from each other include zeros."""
    mesh = rectangle((0.0, 4.0), (0.0, 1.0), (8, 2))
    matrix, c = stiffness(mesh, plane_strain(1.0, 0.25)).tocsc(), 2.0**power
    assert 0 in np.abs(matrix.data)
    interface = np.arange(0, 12)
    one, other = (Condensation((matrix * unit).tocsc(), interface, singular=True) for unit in (1.0, c))
    assert np.array_equal(other.schur, one.schur * c)
    forms = [gram(mesh).tocsc() * unit for unit in (1.0, c)]
    assert np.array_equal(other.on_lifts(forms[0]), one.on_lifts(forms[0]))
    assert np.array_equal(one.on_lifts(forms[1]), one.on_lifts(forms[0]) * c)


def test_a_body_without_an_interface_answers_with_nothing_there():
    matrix = sp.csc_array(np.array([[2.0, -1.0], [-1.0, 2.0]]))
    found = Condensation(matrix, np.array([], dtype=int)).response(np.array([1.0, 1.0]))
    assert found.flexibility.shape == (0, 0)
    assert found.loaded == pytest.approx([1.0, 1.0])
    assert found.field(np.array([])).tolist() == [0.0, 0.0]


@either
@pytest.mark.parametrize("name", ["lift", "schur"])
def test_the_lift_and_the_schur_complement_are_read_only(name, kind):
    found = kind(sp.csc_array(np.array([[2.0, 1.0], [1.0, 2.0]])), np.array([0]))
    with pytest.raises(ValueError, match="read-only"):
        getattr(found, name)[0] = 0


@pytest.mark.parametrize("columns", [0, 1, BLOCK - 1, BLOCK, BLOCK + 1, 3 * BLOCK])
def test_many_right_hand_sides_are_solved_as_one_by_one(columns):
    matrix = stiffness(interval((0.0, 1.0), 30), bar(2.0))[1:][:, 1:].tocsc()
    solve, right = solver(matrix), np.random.default_rng(0).integers(-9, 10, (30, columns)).astype(float)
    found = solve(right)
    assert found.shape == (30, columns)
    for b, x in zip(right.T, found.T, strict=True):
        assert norm(x - solve(b)) <= 30**2 * EPS * norm(x)


@pytest.mark.parametrize("shape", [(0,), (0, 0), (0, 3)])
def test_no_equations_have_no_unknowns(shape):
    assert solver(sp.csc_array((0, 0)))(np.empty(shape)).shape == shape


def test_a_solver_does_not_change_the_right_hand_side():
    right = np.ones((2, 3))
    solver(sp.csc_array(np.array([[2.0, 1.0], [1.0, 2.0]])))(right)
    assert (right == 1).all()


# --- a bar ------------------------------------------------------------------------------------------------------------


@given(numbers(Fraction(1, 4), 5, 12), numbers(Fraction(1, 4), 9, 12), st.integers(1, 30))
def test_the_schur_complement_of_a_bar_is_young_over_length(length, young, n):
    mesh, law = interval((Fraction(0), length), n), bar(young)
    A = fem_oracle.stiffness(mesh, law)[1:, 1:] if n <= 8 else None
    end = np.array([n - 1])
    if A is not None:
        assert fem_oracle.schur(A, end).tolist() == [[young / length]]
    found = Condensation(stiffness(mesh, law)[1:][:, 1:].tocsc(), end)
    rounding = n**2 * EPS  # the condition of the matrix
    assert abs(found.schur[0, 0] - young / length) <= rounding * float(young / length)
    expected = np.arange(1, n) / n  # the lift is linear
    assert np.abs(found.lift[:, 0] - expected).max(initial=0) <= rounding


@given(st.integers(1, 40), powers_of_two(-6, 6))
def test_a_bar_pulled_at_its_end_stretches_linearly(n, young):
    """Up to n^2 eps, the condition of the matrix."""
    matrix = stiffness(interval((0.0, 1.0), n), bar(float(young)))[1:][:, 1:].tocsc()
    found = Condensation(matrix, np.array([n - 1]))
    load = np.zeros(n)
    load[-1] = 1.0
    np.testing.assert_allclose(solver(found.matrix)(load), np.arange(1, n + 1) / n / float(young), rtol=n**2 * EPS)


# --- without the Schur complement -------------------------------------------------------------------------------------


@either
@given(definite(), st.integers(0, 2**16))
def test_a_product_with_the_schur_complement_needs_no_schur_complement(kind, case, seed):
    _, A, interface = case
    phi = np.random.default_rng(seed).standard_normal(len(interface))
    body = kind(A, interface)
    size = np.abs(A.toarray()).sum() * (1 + norm(body.lift)) ** 2 * np.abs(phi).max()
    assert np.abs(kind(A, interface).times(phi) - body.schur @ phi).max() <= 64 * EPS * size


@given(st.integers(1, 12), st.integers(0, 2**16))
def test_the_negative_pivots_are_as_many_as_the_negative_eigenvalues(n, seed):
    """``L D L'`` with integers D and |L_ij| <= 1/2 beside a unit diagonal, in any order: the inertia is that of D."""
    random = np.random.default_rng(seed)
    D = random.choice([-3.0, -1.0, 1.0, 2.0], n)
    L = np.eye(n) + np.diag(random.integers(-2, 3, n - 1) / 4, -1)
    order = random.permutation(n)
    A = (L * D @ L.T)[np.ix_(order, order)]
    solve, negative = solver_with_inertia(sp.csc_array(A))
    assert negative in (None, (D < 0).sum())  # None where the diagonal offers a pivot of 0
    x = random.integers(-5, 6, n).astype(float)
    assert np.allclose(solve(A @ x), x, rtol=0, atol=1e-9)


def test_where_no_pivot_stands_on_the_diagonal_nothing_is_counted():
    solve, negative = solver_with_inertia(sp.csc_array(np.array([[0.0, 1.0], [1.0, 0.0]])))
    assert negative is None
    assert solve(np.array([2.0, 3.0])).tolist() == [3, 2]
