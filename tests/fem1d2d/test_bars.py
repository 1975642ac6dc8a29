"""One dimension in closed form: the discrete constants of a bar, and the continuous ones that they converge to.

On a bar of length L in n cells of h = L/n, held at its left end, `sin((2k - 1) pi j / 2n)` diagonalises the stiffness
and the mass matrix at once; with t = (2k - 1) pi / 2n the quotient of their eigenvalues is

    mu_k = (6 / h^2) (1 - cos t) / (2 + cos t),     eigenvalue of (A, H):  E mu_k / (mu_k + 1 / l^2)

in the norm |v|^2/l^2 + |v'|^2.  For its trace, hyperbolic functions solve the same recurrence.
"""

from fractions import Fraction

import fem_oracle
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import numbers

from fem1d2d import Condensation, bar, gram, interval, largest, largest_sparse, solver, stiffness

EPS = np.finfo(float).eps
lengths, youngs = numbers(Fraction(1, 4), 4, 12), numbers(Fraction(1, 4), 9, 12)
sizes = st.integers(1, 60)


def matrices(L, E, n, norm_length=1.0):
    """A and H of the unknowns of a bar held at its left end; the last one is the contact."""
    mesh = interval((0.0, float(L)), n)
    pair = stiffness(mesh, bar(float(E))), gram(mesh, float(norm_length))
    return [matrix[1:][:, 1:].tocsc() for matrix in pair]


def condensed(L, E, n, norm_length=1.0):
    return [Condensation(matrix, np.array([n - 1])) for matrix in matrices(L, E, n, norm_length)]


def measured(L, E, n, norm_length=1.0):
    """m and M as the eigenvalue solver finds them."""
    A, H = condensed(L, E, n, norm_length)
    m = 1 / largest_sparse(H.matrix, A.matrix, solver(A.matrix)).value
    return m, largest_sparse(A.matrix, H.matrix, solver(H.matrix), above=float(E)).value


def discrete(L, E, n, k, norm_length=1.0):
    """Eigenvalue k of (A, H), k = 1 .. n."""
    t = (2 * k - 1) * np.pi / (2 * n)
    mu = 6 * (n / float(L)) ** 2 * (1 - np.cos(t)) / (2 + np.cos(t))
    return float(E) * mu / (mu + 1 / float(norm_length) ** 2)


def lift_gram(elastic, H):
    """N = R' H R for the elastic lift R."""
    R = elastic.extend(np.ones(1))
    return R @ (H.matrix @ R)


# --- on the mesh ------------------------------------------------------------------------------------------------------


@given(lengths, youngs, st.integers(1, 12))
def test_sines_diagonalise_the_pencil_of_a_bar(L, E, n):
    A, H = (matrix.toarray() for matrix in matrices(L, E, n))
    j = np.arange(1, n + 1)
    for k in range(1, n + 1):
        x = np.sin((2 * k - 1) * np.pi * j / (2 * n))
        residual = A @ x - discrete(L, E, n, k) * (H @ x)
        assert np.abs(residual).max() <= 16 * EPS * np.abs(A).max() * n


@given(lengths, youngs, sizes, numbers(Fraction(1, 2), 3, 12))
def test_m_and_M_of_a_bar_are_the_ends_of_the_spectrum_of_two_toeplitz_matrices(L, E, n, norm_length):
    low, high = measured(L, E, n, norm_length)
    assert low == pytest.approx(discrete(L, E, n, 1, norm_length), rel=1e-12)
    assert high == pytest.approx(discrete(L, E, n, n, norm_length), rel=1e-12)
    assert high < E
    assert n == 1 or low < high


@pytest.mark.parametrize("n", [100, 200])
def test_M_is_found_on_a_bar_of_many_cells_where_the_top_of_the_spectrum_is_crowded(n):
    A, H = condensed(1, 1, n)
    found = largest_sparse(A.matrix, H.matrix, solver(H.matrix), above=1.0)
    assert found.value == pytest.approx(discrete(1, 1, n, n), rel=1e-12)


@given(lengths, youngs, st.integers(1, 12))
def test_the_whole_spectrum_of_a_bar_is_the_closed_form(L, E, n):
    A, H = (matrix.toarray() for matrix in matrices(L, E, n))
    shifted = [largest(A - float(E) * H, H).value + float(E), float(E) - largest(float(E) * H - A, H).value]
    np.testing.assert_allclose(shifted, [discrete(L, E, n, n), discrete(L, E, n, 1)], atol=1e-13 * float(E) * n)


@given(lengths, youngs, st.integers(1, 7))
def test_the_gram_norm_of_the_elastic_lift_of_a_bar_is_L_over_3_plus_1_over_L(L, E, n):
    mesh = interval((Fraction(0), L), n)
    A, H = fem_oracle.stiffness(mesh, bar(E))[1:, 1:], fem_oracle.gram(mesh)[1:, 1:]
    R = np.append(fem_oracle.lift(A, np.array([n - 1]))[:, 0], Fraction(1))
    assert R @ H @ R == L / 3 + 1 / L
    elastic, H = condensed(L, E, n)
    assert lift_gram(elastic, H) == pytest.approx(float(L / 3 + 1 / L), rel=4 * n * EPS)
    assert elastic.schur[0, 0] == pytest.approx(float(E / L), rel=2 * n * EPS)


@given(lengths, sizes, numbers(Fraction(1, 2), 3, 12))
def test_the_trace_norm_of_a_bar_is_a_discrete_hyperbolic_cotangent(L, n, norm_length):
    """sqrt(1 + x^2/12) coth(n a) / l with x = h/l and cosh a = (1 + x^2/3) / (1 - x^2/6).

    On a coarse mesh, x^2 > 6, the cosine is negative: a = b + i pi, and coth(n a) = coth(n b).  An error of one unit in
    the last place of each entry, at most 2/h + h/l^2, counts at n + 1 nodes whose values are at most 1.
    """
    x = float(L) / n / float(norm_length)
    square = 1 - x**2 / 6  # never zero: x is rational
    a = 2 * np.arcsinh(x / 2 / np.sqrt(square)) if square > 0 else np.arccosh((1 + x**2 / 3) / -square)
    expected = np.sqrt(1 + x**2 / 12) / np.tanh(n * a) / float(norm_length)
    entries = 2 * n / float(L) + x / float(norm_length)
    assert condensed(L, 1, n, norm_length)[1].schur[0, 0] == pytest.approx(expected, abs=2 * (n + 1) * entries * EPS)


@given(lengths, st.integers(1, 7), numbers(Fraction(1, 2), 3, 12))
def test_the_trace_norm_of_a_bar_is_that_of_elimination_in_rationals(L, n, norm_length):
    mesh = interval((Fraction(0), L), n)
    exact = fem_oracle.schur(fem_oracle.gram(mesh, norm_length)[1:, 1:], np.array([n - 1]))[0, 0]
    assert condensed(L, 1, n, norm_length)[1].schur[0, 0] == pytest.approx(float(exact), rel=8 * n * EPS)


# --- as the mesh is refined -------------------------------------------------------------------------------------------

LEVELS = (24, 48, 96)
SECOND_ORDER = pytest.approx(2, abs=0.01)


def orders(errors):
    """Observed orders of convergence under halving."""
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:])).tolist()


@pytest.mark.parametrize("L", [0.3, 1.0, 2.5])
@pytest.mark.parametrize("E", [1.0, 7e4])
def test_m_of_a_bar_falls_to_its_closed_form_with_order_2(L, E):
    m = E / (1 + (2 * L / np.pi) ** 2)
    errors = [measured(L, E, n)[0] - m for n in LEVELS]
    assert min(errors) > 0
    assert orders(errors) == [SECOND_ORDER] * 2


@pytest.mark.parametrize("L", [1.0, 2.5])
@pytest.mark.parametrize("E", [1.0, 7e4])
def test_M_of_a_bar_rises_to_E_with_order_2_and_does_not_attain_it(L, E):
    errors = [E - measured(L, E, n)[1] for n in LEVELS]
    assert min(errors) > 0
    assert orders(errors) == [SECOND_ORDER] * 2


@pytest.mark.parametrize(("L1", "L2"), [(1.0, 1.0), (0.5, 2.0), (3.0, 1.5), (0.2, 0.3)])
def test_C_R_of_two_bars_rises_to_its_closed_form_with_order_2(L1, L2):
    lengths = (L1, L2)
    exact = max((a / 3 + 1 / a) * np.tanh(b) for a in lengths for b in lengths)
    errors = []
    for n in LEVELS:
        bars = [condensed(L, E, n) for L, E in [(L1, 3.0), (L2, 5.0)]]  # no modulus enters
        N, trace = [lift_gram(*pair) for pair in bars], [pair[1].schur[0, 0] for pair in bars]
        errors.append(exact - max(a / b for a in N for b in trace))
    assert min(errors) > 0
    assert orders(errors) == [SECOND_ORDER] * 2


@pytest.mark.parametrize("L", [0.25, 1.0, 4.0])
@pytest.mark.parametrize("n", [1, 2, 5, 33])
def test_C_R_squared_of_a_bar_with_its_own_norm_is_at_least_one(L, n):
    elastic, H = condensed(L, 2.0, n)
    assert lift_gram(elastic, H) >= H.schur[0, 0] * (1 - 4 * n * EPS)
