"""P1 elasticity a second time, in exact rationals: it shares no formula with `fem1d2d`.

Hat functions come from the inverse Vandermonde matrix, mass from the integrals of barycentric monomials, stiffness
from strain-displacement matrices.  Matrices are dense object arrays of Fractions.
"""

from fractions import Fraction
from math import factorial

import numpy as np

EPS = Fraction(float(np.finfo(float).eps))

#: Each float (or rational) of an array as the rational it is.
exactly = np.vectorize(lambda x: x if isinstance(x, Fraction) else Fraction(float(x)), otypes=[object])


def zeros(*shape):
    return np.full(shape, Fraction(0), dtype=object)


def identity(n):
    return exactly(np.eye(n))


# --- linear algebra -------------------------------------------------------------------------------------------------


def reduce(A, B=None):
    """Gauss-Jordan: rank and determinant of A, and A^-1 B where A is regular."""
    A = A.copy()
    B = zeros(len(A), 0) if B is None else B.copy()
    rank, det = 0, Fraction(1)
    for column in range(A.shape[1]):
        pivots = [row for row in range(rank, len(A)) if A[row, column]]
        if not pivots:
            det = Fraction(0)
            continue
        for matrix in (A, B):
            matrix[[rank, pivots[0]]] = matrix[[pivots[0], rank]]
        pivot = A[rank, column]
        det *= pivot if pivots[0] == rank else -pivot
        for matrix in (B, A):
            matrix[rank] = matrix[rank] / pivot
        for row in range(len(A)):
            if row != rank and A[row, column]:
                factor = A[row, column]
                B[row] = B[row] - factor * B[rank]
                A[row] = A[row] - factor * A[rank]
        rank += 1
    return rank, det, B


def rank(A):
    return reduce(A)[0]


def solve(A, B):
    return reduce(A, B)[2]


def inner(n, interface):
    """All of range(n) but the interface."""
    return np.setdiff1d(np.arange(n), interface)


def lift(A, interface):
    """-A_II^-1 A_IB."""
    inside = inner(len(A), interface)
    return -solve(A[np.ix_(inside, inside)], A[np.ix_(inside, interface)])


def schur(A, interface):
    """A_BB - A_BI A_II^-1 A_IB."""
    inside = inner(len(A), interface)
    return A[np.ix_(interface, interface)] + A[np.ix_(interface, inside)] @ lift(A, interface)


# --- one simplex ------------------------------------------------------------------------------------------------------


def hats(points):
    """Gradients of the hat functions of a simplex, shape (d + 1, d), and its signed measure."""
    n, d = points.shape
    vandermonde = np.concatenate([np.full((n, 1), Fraction(1), dtype=object), points], axis=1)
    _, det, coefficients = reduce(vandermonde, identity(n))  # column i: hat i as 1, x, y
    return coefficients[1:].T, det / factorial(d)


def monomial(exponents, measure):
    """Integral of a product of powers of the barycentric coordinates over a simplex."""
    d = len(exponents) - 1
    product = np.prod([factorial(e) for e in exponents], dtype=object)
    return Fraction(factorial(d) * product, factorial(sum(exponents) + d)) * measure


def element_mass(points):
    _, measure = hats(points)
    unit = np.eye(len(points), dtype=int)
    return np.array([[monomial([int(e) for e in i + j], measure) for j in unit] for i in unit], dtype=object)


def element_laplace(points):
    gradients, measure = hats(points)
    return gradients @ gradients.T * measure


def element_stiffness(points, material):
    """B' D B times the measure; rows d i + p belong to component p at vertex i."""
    gradients, measure = hats(points)
    n, d = gradients.shape
    lame_lambda, lame_mu = material.lame_lambda, material.lame_mu
    B, D = zeros(1 if d == 1 else 3, d * n), lame_lambda + 2 * lame_mu
    if d == 1:
        B[0] = gradients[:, 0]
        return B.T @ B * D * measure
    B[0, 0::2], B[1, 1::2] = gradients[:, 0], gradients[:, 1]
    B[2, 0::2], B[2, 1::2] = gradients[:, 1], gradients[:, 0]  # engineering shear
    hooke = np.array([[D, lame_lambda, 0], [lame_lambda, D, 0], [0, 0, lame_mu]], dtype=object)
    return B.T @ hooke @ B * measure


# --- the whole mesh ---------------------------------------------------------------------------------------------------


def assemble(mesh, elements, components):
    """Sum of element matrices of `components` unknowns a node."""
    total = zeros(components * len(mesh.points), components * len(mesh.points))
    for cell, element in zip(mesh.cells, elements, strict=True):
        unknowns = [components * node + p for node in cell for p in range(components)]
        total[np.ix_(unknowns, unknowns)] += element
    return total


def stiffness(mesh, material):
    elements = [element_stiffness(exactly(mesh.points[cell]), material) for cell in mesh.cells]
    return assemble(mesh, elements, mesh.dimension)


def scalar_gram(mesh, length):
    """The matrix of int u v / L^2 + grad u . grad v on scalar functions."""
    corners = [exactly(mesh.points[cell]) for cell in mesh.cells]
    return assemble(mesh, [element_laplace(p) + element_mass(p) / length**2 for p in corners], 1)


def gram(mesh, length=Fraction(1)):
    return np.kron(scalar_gram(mesh, length), identity(mesh.dimension))


# --- comparison -------------------------------------------------------------------------------------------------------


def is_rounded(computed, exact, roundings):
    """|computed - exact| <= roundings * eps * sqrt(diagonal) entry by entry: what summing semidefinite matrices costs.

    For positive semidefinite matrices with rational entries, `computed` in floats.
    """
    computed = computed.toarray() if hasattr(computed, "toarray") else computed
    squared = np.multiply.outer(exact.diagonal(), exact.diagonal())
    return bool(((exactly(computed) - exact) ** 2 <= (roundings * EPS) ** 2 * squared).all())
