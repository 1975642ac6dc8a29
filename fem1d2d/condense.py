"""Condensation of a matrix onto an interface: Schur complement, forms on lifts, condensed loads, solves."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import LinAlgWarning, lu_factor, lu_solve
from scipy.linalg.blas import dtrmm
from scipy.linalg.lapack import dtrtri
from scipy.sparse.linalg import spilu, splu, spsolve_triangular

from fem1d2d.mesh import Floats, Ints, MeshError

#: A linear map of vectors: a product with a matrix, or a solver.
Apply = Callable[[Floats], Floats]

#: Why no factor of a matrix is found.
SINGULAR = "a matrix of the body is singular in doubles: needed cells that differ less in size and shape"

#: Right-hand sides solved at once; more of them leave the cache.
BLOCK = 16

#: SuperLU for a matrix whose diagonal entries can serve as pivots.  Panels of 8 columns stay in the cache: a tenth
#: faster than SuperLU's default of 20.
SYMMETRIC: dict[str, Any] = {"diag_pivot_thresh": 0.0, "panel_size": 8, "options": {"SymmetricMode": True}}

#: The step of a derivative taken along the imaginary axis, relative to the matrix: its square is far below rounding.
STEP = 2.0**-70

#: Up to so many unknowns dense matrices cost less than sparse ones: a tenth at 100, as much at 270.
FEW = 200

#: Rows of a factor that are multiplied together: neighbours in the order reach few unknowns of the interface.
ROWS = 256


@dataclass(frozen=True, kw_only=True, eq=False)
class Response:
    """Displacements of a body under a load and under forces on its interface B.

    Attributes
    ----------
    flexibility : array, shape (b, b)
        ``(A^-1)_BB``: displacements of the interface for forces on it.
    loaded : array, shape (n,)
        ``A^-1 load``: displacements of all unknowns for the load.
    field : callable
        Returns the displacements of all unknowns, shape (n,), for forces on the interface, shape (b,).  It keeps one
        triangle of the factorisation, a third of what SuperLU and the copies it hands out would take.
    """

    flexibility: Floats
    loaded: Floats
    field: Apply


class Condensation:
    """A symmetric positive definite matrix seen from some of its unknowns, the interface B; I is the rest.

    It may be semidefinite, as the stiffness matrix of a body without support is, where its part inside is definite.

    ``lift = -A_II^-1 A_IB`` extends interface values with least energy, ``schur = A_BB + A_BI lift`` is that energy:
    ``phi' schur phi = min { v' A v : v_B = phi }``.

    Parameters
    ----------
    matrix : sparse array, shape (n, n)
    interface : int array, shape (b,)
        Positions of B, in the order wanted on the interface.
    order : int array, shape (n,), optional
        An order of elimination that ends with the interface, as :func:`elimination_order` finds it; matrices of one
        mesh can share it.
    singular : bool
        True if the matrix is only semidefinite.  Elimination would then end with pivots of 0: the block of the
        interface is shifted meanwhile, which shifts the Schur complement by as much and changes nothing else.
    """

    #: Unknowns on the interface from which on its dense block costs SuperLU more than the products that leave it out.
    MANY = 1000

    def __init__(
        self, matrix: sp.csc_array, interface: Ints, order: Ints | None = None, *, singular: bool = False
    ) -> None:
        self.matrix = matrix
        self.interface = interface
        self._shift = _power_of_two(matrix) if singular else 0.0
        self.order = elimination_order(matrix, interface) if order is None else order
        inside = np.ones(matrix.shape[0], dtype=bool)
        inside[interface] = False
        self.inside: Ints = np.flatnonzero(inside)

    def _block(self, rows: Ints, columns: Ints) -> Any:
        return self.matrix[:, columns][rows]

    @cached_property
    def _coupling(self) -> Any:
        """``A_IB``."""
        return self._block(self.inside, self.interface)

    @cached_property
    def _on_interface(self) -> Any:
        """``A_BB``."""
        return self._block(self.interface, self.interface)

    @cached_property
    def _solve_inside(self) -> Apply:
        order = np.searchsorted(self.inside, self.order[: len(self.inside)])
        return solver(self._block(self.inside, self.inside), order)

    @cached_property
    def lift(self) -> Floats:
        """``-A_II^-1 A_IB``, shape (n - b, b): dense, and as large as the body; computed only where it is read."""
        lift = -self._solve_inside(self.matrix[:, self.interface][self.inside].toarray())
        lift.setflags(write=False)
        return lift

    @cached_property
    def schur(self) -> Floats:
        """``A_BB + A_BI lift``, shape (b, b)."""
        if len(self.inside) == 0:
            return symmetric(self._on_interface.toarray())
        return self._unshifted(self._rest(self._shifted(self.matrix), self.order))

    def _unshifted(self, schur: Floats) -> Floats:
        """The Schur complement of the matrix, given the one of the shifted matrix."""
        return symmetric(schur - self._shift * np.eye(len(schur)) if self._shift else schur)

    def _shifted(self, matrix: Any) -> Any:
        """The matrix with the shift on the diagonal of its interface."""
        if not self._shift:
            return matrix
        diagonal = np.zeros(matrix.shape[0])
        diagonal[self.interface] = self._shift
        return (matrix + sp.diags_array(diagonal, format="csc")).tocsc()

    def times(self, trace: Floats) -> Floats:
        """``schur @ trace`` for displacements of the interface, shape (b,), by one solve inside."""
        return np.asarray(self._on_interface @ trace - self._coupling.T @ self._solve_inside(self._coupling @ trace))

    def _needs_definite(self) -> None:
        if self._shift:
            raise ValueError("the matrix is singular: needed a definite one")

    def solver(self) -> Apply:
        """``load -> A^-1 load`` on all unknowns, as :func:`solver`; a small Schur complement comes with it.

        The factorisation, the largest part of the memory, lives as long as the function that is returned.  ValueError
        if the matrix is singular.
        """
        self._needs_definite()
        factor = _factor(self.matrix, self.order)
        if len(self.inside) and len(self.interface) < self.MANY:
            self.schur = _last_block(factor, len(self.inside))
        return _solving(factor, self.order)

    def response(self, load: Floats) -> Response:
        """``A^-1 load`` for a load, shape (n,), and A^-1 on the interface, from one factorisation.

        Of ``A = L D L'`` with the interface last, ``(A^-1)_BB = L_BB^-T D_BB^-1 L_BB^-1`` needs only the last block.
        ValueError if the matrix is singular.
        """
        self._needs_definite()
        factor = _factor(self.matrix, self.order)
        place = _places(factor)
        loaded = _solving(factor, self.order)(load)
        if not len(self.interface):  # of which LAPACK makes errors
            return Response(flexibility=np.zeros((0, 0)), loaded=loaded, field=lambda force: np.zeros(len(loaded)))
        L, pivots = factor.L, factor.U.diagonal()
        last = place[len(self.inside) :]
        triangle = np.sort(last)
        half, _ = dtrtri(L[:, triangle][triangle].toarray(order="F"), lower=1, unitdiag=1)
        inverse = dtrmm(1.0, half, half / pivots[triangle, None], lower=1, trans_a=1, diag=1)
        rows = np.searchsorted(triangle, last)
        half = half[:, rows] / pivots[triangle, None]
        order = np.empty_like(self.order)
        order[place] = self.order

        def field(force: Floats) -> Floats:
            y, result = np.zeros(len(order)), np.empty(len(order))
            y[triangle] = half @ force
            result[order] = spsolve_triangular(L.T, y, lower=False, unit_diagonal=True)
            return result

        return Response(flexibility=symmetric(inverse[np.ix_(rows, rows)]), loaded=loaded, field=field)

    def on_lifts(self, form: sp.csc_array) -> Floats:
        """``R' X R``, shape (b, b): a symmetric form X on all unknowns, evaluated at lifted interface values.

        It is the derivative of the Schur complement of ``A + t X`` at t = 0: the lift minimises the energy, so that a
        change of the lift has no effect of first order.  The step is taken along the imaginary axis, where no
        difference cancels, and one factorisation gives all entries to rounding.
        """
        step = STEP * _power_of_two(self.matrix) / _power_of_two(form)
        return self._rest(self._shifted(self.matrix + 1j * step * form), self.order).imag / step

    def _rest(self, matrix: sp.csc_array, order: Ints) -> NDArray[Any]:
        """``X_BB - X_BI X_II^-1 X_IB`` of a symmetric matrix X and an order of elimination that ends with B."""
        i = len(self.inside)
        if len(self.interface) < self.MANY:
            return _last_block(_factor(matrix, order), i)
        return _by_columns(matrix[:, order][order].tocsc(), i)

    def condense(self, load: Floats) -> Floats:
        """The load condensed onto the interface, ``load_B + lift' load_I``, shape (b,), of its unit.

        ``load`` is a force for each unknown, shape (n,).  If the Schur complement is not known yet, the factorisation
        made here gives it too.
        """
        inner = load[self.inside]
        if not inner.any():  # without a load there is nothing to factorise for
            return np.asarray(load[self.interface])
        if "schur" not in vars(self):  # one elimination gives both: the load is the last row and column
            column = sp.csc_array(load[:, None])
            bordered = sp.block_array([[self._shifted(self.matrix), column], [column.T, None]], format="csc")
            rest = self._rest(bordered, np.append(self.order, len(load)))
            self.schur = self._unshifted(rest[:-1, :-1])
            return rest[:-1, -1].copy()
        return np.asarray(load[self.interface] - self._coupling.T @ self._solve_inside(inner))

    def extend(self, trace: Floats, load: Floats | None = None) -> Floats:
        """Displacements of all unknowns, shape (n,), in equilibrium with the forces that ``load`` has inside.

        Parameters
        ----------
        trace : float array, shape (b,)
            Displacements of the interface, in its order; the result has their unit.
        load : float array, shape (n,), optional
            None for no forces.
        """
        full = np.empty(self.matrix.shape[0])
        full[self.interface] = trace
        inner = -(self._coupling @ trace)
        full[self.inside] = self._solve_inside(inner if load is None else inner + load[self.inside])
        return full


class Uncoupled(Condensation):
    """A :class:`Condensation` of a matrix that couples no two components of the unknowns, such as the matrix of a norm.

    Each component is eliminated by itself, and those with the same matrix share one factorisation; ``component``, int
    array of shape (n,), is the component of each unknown.

    Examples
    --------
    >>> matrix = sp.csc_array(np.kron([[2.0, -1.0], [-1.0, 2.0]], np.eye(2)))
    >>> Uncoupled(matrix, np.array([2, 3]), np.array([0, 1, 0, 1])).schur
    array([[1.5, 0. ],
           [0. , 1.5]])
    """

    def __init__(self, matrix: sp.csc_array, interface: Ints, component: Ints, order: Ints | None = None) -> None:
        super().__init__(matrix, interface, order)
        self.component = component

    @cached_property
    def _parts(self) -> list[tuple[Ints, Ints, Condensation]]:
        """For each component its unknowns, its rows on the interface, and its condensation."""
        parts: list[tuple[Ints, Ints, Condensation]] = []
        place = np.empty(len(self.component), dtype=np.int64)
        for component in np.unique(self.component):
            own = np.flatnonzero(self.component == component)
            rows = np.flatnonzero(self.component[self.interface] == component)
            place[own] = np.arange(len(own))
            matrix, interface = self.matrix[:, own][own], place[self.interface[rows]]
            same = (part for _, _, part in parts if _equal(part.matrix, matrix, part.interface, interface))
            order = place[self.order[self.component[self.order] == component]]
            parts.append((own, rows, next(same, None) or Condensation(matrix, interface, order)))
        return parts

    @cached_property
    def schur(self) -> Floats:
        """``A_BB + A_BI lift``, shape (b, b)."""
        schur = np.zeros((len(self.interface),) * 2)
        for _, rows, part in self._parts:
            schur[np.ix_(rows, rows)] = part.schur
        return symmetric(schur)

    def solver(self) -> Apply:
        """As :meth:`Condensation.solver`."""
        solvers = {part: part.solver() for part in {part for _, _, part in self._parts}}
        parts = [(own, solvers[part]) for own, _, part in self._parts]

        def solve(right: Floats) -> Floats:
            result = np.empty(right.shape)
            for own, solve_part in parts:
                result[own] = solve_part(right[own])
            return result

        return solve


class Lifted(Condensation):
    """A :class:`Condensation` of few unknowns in dense matrices, by the formulas that define it.

    Examples
    --------
    >>> Lifted(sp.csc_array(np.array([[2.0, -1.0], [-1.0, 2.0]])), np.array([1])).schur
    array([[1.5]])
    """

    def __init__(self, matrix: sp.csc_array, interface: Ints, *, singular: bool = False) -> None:
        super().__init__(matrix, interface, interface[:0], singular=singular)  # without an order: none is used
        self._dense: Floats = matrix.toarray()

    def _block(self, rows: Ints, columns: Ints) -> Any:
        return self._dense[np.ix_(rows, columns)]

    @cached_property
    def _solve_inside(self) -> Apply:
        return _dense_solver(self._block(self.inside, self.inside))

    @cached_property
    def schur(self) -> Floats:
        """``A_BB + A_BI lift``, shape (b, b)."""
        return symmetric(self._on_interface + self._coupling.T @ self.lift)

    def solver(self) -> Apply:
        """As :meth:`Condensation.solver`."""
        self._needs_definite()
        return _dense_solver(self._dense)

    def response(self, load: Floats) -> Response:
        """As :meth:`Condensation.response`."""
        solve, columns = self.solver(), np.zeros((len(self._dense), len(self.interface)))
        columns[self.interface] = np.eye(len(self.interface))
        fields = solve(columns)
        return Response(
            flexibility=symmetric(fields[self.interface]), loaded=solve(load), field=lambda force: fields @ force
        )

    def on_lifts(self, form: sp.csc_array) -> Floats:
        """``R' X R``, shape (b, b): a symmetric form X on all unknowns, evaluated at lifted interface values."""
        fields = np.zeros((len(self._dense), len(self.interface)))
        fields[self.interface] = np.eye(len(self.interface))
        fields[self.inside] = self.lift
        return symmetric(fields.T @ (form @ fields))

    def condense(self, load: Floats) -> Floats:
        """As :meth:`Condensation.condense`."""
        return np.asarray(load[self.interface] + self.lift.T @ load[self.inside])


def _equal(one: sp.csc_array, other: sp.csc_array, *places: Ints) -> bool:
    """True if two matrices are stored alike, and two lists of places are the same."""
    pairs = [(one.data, other.data), (one.indices, other.indices), (one.indptr, other.indptr), places]
    return all(bool(np.array_equal(a, b)) for a, b in pairs)


def symmetric(matrix: NDArray[Any]) -> NDArray[Any]:
    """The symmetric part, read-only."""
    result: NDArray[Any] = (matrix + matrix.T) / 2
    result.setflags(write=False)
    return result


def _power_of_two(matrix: sp.csc_array) -> float:
    """The power of two next above the largest entry, so that scaling by it rounds nothing."""
    return float(np.ldexp(1.0, int(np.frexp(np.abs(matrix.data).max(initial=0.0))[1])))


def elimination_order(matrix: sp.csc_array, interface: Ints) -> Ints:
    """An order of elimination with little fill, first the unknowns inside, shape (n,); it uses only the pattern."""
    inside = np.delete(np.arange(matrix.shape[0]), interface)
    if len(inside) == 0:
        return interface
    inner = matrix[:, inside][inside]
    # an incomplete factorisation that drops everything costs little more than the order it finds
    try:
        found = spilu(inner, drop_tol=1.0, fill_factor=1.0, permc_spec="MMD_AT_PLUS_A", **SYMMETRIC)
    except RuntimeError:
        raise MeshError(SINGULAR) from None
    return np.concatenate([inside[np.argsort(found.perm_c)], interface])


def _factor(matrix: sp.csc_array, order: Ints | None) -> Any:
    """``L U`` of the matrix with its unknowns in the given order; without one, SuperLU chooses it.

    MeshError if a pivot is 0, by rounding or because the matrix is singular.
    """
    ordered = matrix.tocsc() if order is None else matrix[:, order][order].tocsc()
    if order is not None:
        ordered.eliminate_zeros()
    try:
        return splu(ordered, permc_spec="MMD_AT_PLUS_A" if order is None else "NATURAL", **SYMMETRIC)
    except RuntimeError:
        raise MeshError(SINGULAR) from None


def _places(factor: Any) -> Ints:
    """The place in the factor of each unknown in the order of elimination.

    MeshError if a pivot lies beside the diagonal: one on it was 0.
    """
    if not np.array_equal(factor.perm_c, factor.perm_r):
        raise MeshError(SINGULAR)
    return np.asarray(factor.perm_c)


def _last_block(factor: Any, i: int) -> NDArray[Any]:
    """The Schur complement of all unknowns but the first i, from the factors of the whole matrix."""
    # the last rows and columns, unless SuperLU moved some that do not depend on each other
    last = _places(factor)[i:]
    L, U = (part[:, last][last].toarray() for part in (factor.L, factor.U))
    return symmetric(L @ U)


def _by_columns(X: sp.csc_array, i: int) -> NDArray[Any]:
    """The same of a symmetric matrix, in products: with ``X_II = L D L'`` and ``W = L^-1 X_IB``, ``X_BB - W' D^-1 W``.

    W is what elimination makes of the columns of B where their own block is the identity and the rows of B are empty,
    so that SuperLU finds it without that block.
    """
    n = X.shape[0]
    above = sp.block_array([[X[:i, :i], X[:i, i:]], [None, sp.eye_array(n - i, dtype=X.dtype)]], format="csc")
    factor = _factor(above, np.arange(n))
    rows, last = np.sort(_places(factor)[:i]), factor.perm_c[i:]
    pivots, W = factor.U.diagonal()[rows], factor.U[:, last].tocsr()[rows]
    rest: NDArray[Any] = X[i:, i:].toarray()
    for start in range(0, i, ROWS):
        part = W[start : start + ROWS]
        own = np.unique(part.indices)
        w = part[:, own].toarray()
        rest[np.ix_(own, own)] -= w.T @ (w / pivots[start : start + ROWS, None])
    return symmetric(rest)


def solver(matrix: sp.csc_array, order: Ints | None = None) -> Apply:
    """Factorise a symmetric positive definite matrix once.

    Parameters
    ----------
    matrix : sparse array, shape (n, n)
    order : int array, shape (n,), optional
        An order of elimination, if one is known.

    Returns
    -------
    callable
        ``b -> matrix^-1 b`` for one column, shape (n,), or several, shape (n, k).

    Raises
    ------
    MeshError
        A pivot is 0, by rounding.
    """
    if matrix.shape[0] == 0:
        return lambda right: right
    return _solving(_factor(matrix, order), order)


def solver_with_inertia(matrix: sp.csc_array) -> tuple[Apply, int | None]:
    """Factorise a symmetric matrix that may be indefinite, and count its negative eigenvalues.

    By Sylvester's law of inertia they are as many as the negative pivots.  The pivots stay on the diagonal: with
    rounding they belong to a matrix near the given one, as long as they are not small beside what they divide.

    Returns
    -------
    callable, int or None
        As :func:`solver`; the number of negative eigenvalues, None if a pivot of 0 on the diagonal had to be avoided,
        so that the signs show nothing.

    Examples
    --------
    >>> solve, negative = solver_with_inertia(sp.csc_array(np.array([[2.0, 3.0], [3.0, 1.0]])))
    >>> negative, np.round(solve(np.array([5.0, 4.0])), 12).tolist()
    (1, [1.0, 1.0])
    """
    factor = _factor(matrix, None)
    on_diagonal = np.array_equal(factor.perm_r, factor.perm_c)
    return _solving(factor, None), int((factor.U.diagonal() < 0).sum()) if on_diagonal else None


def _solving(factor: Any, order: Ints | None) -> Apply:
    rows = slice(None) if order is None else order

    def solve(right: Floats) -> Floats:
        result = np.empty(right.shape)
        if right.ndim == 1:
            result[rows] = factor.solve(right[rows])
        else:
            for i in range(0, right.shape[1], BLOCK):
                result[rows, i : i + BLOCK] = factor.solve(right[rows, i : i + BLOCK])
        return result

    return solve


def _dense_solver(matrix: Floats) -> Apply:
    """``right -> matrix^-1 right``, factorised once."""
    if len(matrix) == 0:
        return lambda right: right
    with warnings.catch_warnings():
        warnings.simplefilter("error", LinAlgWarning)
        try:
            factor = lu_factor(matrix, check_finite=False)
        except LinAlgWarning:
            raise MeshError(SINGULAR) from None
    return lambda right: np.asarray(lu_solve(factor, right, check_finite=False))
