"""A contact pair from a problem, a problem file, an interface file, or matrices."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np

from fem1d2d import trapezoid
from fem1d2d.mesh import Floats
from verification.interface import pair as pairs
from verification.interface.body import NO_MOTIONS, Condensed
from verification.interface.files import read_interface
from verification.interface.friction import GivenOperator
from verification.interface.interface import Grid, Interface, Law
from verification.interface.matrices import check_matrix, check_nodes, check_unit, real_array, size, stiffness
from verification.interface.pair import ContactPair
from verification.problem import Problem, load


def build(
    problem: Problem | Path | str | None = None,
    *,
    law: Law | None = None,
    S1: Floats | None = None,
    S2: Floats | None = None,
    load1: Floats | None = None,
    load2: Floats | None = None,
    x: Floats | None = None,
    weights: Floats | None = None,
    gap: Floats | float = 0.0,
    kernel: Floats | None = None,
    transfer: Floats | None = None,
    friction: Any = None,
    neumann_body: Literal[1, 2] = 2,
    obstacle: bool = False,
) -> ContactPair:
    """Make a contact pair from a problem, or from the interface matrices of any code.

    Interface vectors list all tangential components from left to right, then all normal ones along y, which points from
    body 1 to body 2.

    Parameters
    ----------
    problem : Problem or path, optional
        A problem, its file, or an ``interface.npz``.  Its ``[iteration]`` gives the pair's settings and roles.  A pair
        from matrices has theta 1/2, tolerance 1e-9, at most 500 iterations.
    law : Law, optional
        A law of friction in place of the problem's, or of a kernel.
    S1, S2 : array, shapes (2 n1, 2 n1), (2 n2, 2 n2)
        Schur complements of the stiffness matrices on the contact nodes: symmetric, positive definite; for the
        contact body it may be singular, where only contact holds it.
    load1, load2 : array, shapes (2 n1,), (2 n2,), optional
        Loads condensed onto the contact nodes; 0 by default.
    x : array, shape (n,), optional
        Positions of the contact nodes of the contact body, increasing.  Without friction they may be left out: they are
        then 0, 1, .., and all weights 1, so that pressures are forces of nodes.
    weights : array, shape (n,), optional
        Weights of the quadrature on them; by default the trapezoid rule.
    gap : float or array, shape (n,)
        Initial distance at them; negative where the bodies overlap.
    kernel : array, shape (n, nodes of the Neumann body), optional
        The operator S: normal nodal forces on the Neumann body to normal stress at the contact nodes.
    transfer : array, shape (n, nodes of the Neumann body), optional
        P: from values at the nodes of the Neumann body to values at the contact body's nodes; the identity by default.
    friction : number, array or function, optional
        k >= 0, 0 by default; a number, one for each contact node from left to right, or a function of the distance s
        from the left end of Gamma_c.  It needs a kernel or a law.  With a problem it takes the place of the problem's,
        and may be a table as in its file.
    neumann_body : {1, 2}
    obstacle : bool
        True if a rigid body may have the Neumann problem; :func:`verification.run` takes such a pair.

    Returns
    -------
    ContactPair

    Raises
    ------
    ProblemError
        A problem that has no two elastic bodies facing each other.
    ValueError
        Matrices that do not fit, or cannot be stiffness matrices.

    Examples
    --------
    >>> pair = build(S1=np.diag([3.0, 2.0]), S2=np.eye(2), load2=np.array([0.0, -1.0]), x=np.array([0.0]))
    >>> pair.contact.grid.n, pair.outside
    (1, [])
    """
    if problem is not None:
        if S1 is not None or S2 is not None:
            raise ValueError("received a problem and matrices: needed one of them")
        if not isinstance(problem, (str, Path)) or Path(problem).suffix != ".npz":
            problem = problem if isinstance(problem, Problem) else load(problem)
            if friction is not None and not _varies(friction):
                problem, friction = problem.changed(friction=friction), None
            pair = pairs.pair_from(problem, law=law, obstacle=obstacle)
            return pair if friction is None else pair.along(friction)
        if law is not None:
            raise ValueError("received a law and an interface file: its operator S is a matrix already")
        pair = read_interface(Path(problem))
        return pair if friction is None else _rubbing(pair, friction)
    if S1 is None or S2 is None:
        raise ValueError("needed a problem, or S1 and S2")
    rubs = law is not None or kernel is not None or (friction is not None and (_varies(friction) or friction != 0))
    if x is None and rubs:
        raise ValueError("needed x, the positions of the contact nodes, as there is friction")
    if neumann_body not in (1, 2):
        raise ValueError(f"neumann_body {neumann_body!r}: needed 1 or 2")
    if kernel is not None and law is not None:
        raise ValueError("received a kernel and a law: needed one of them")
    S1, S2 = (real_array(name, S, (None, None), "a square matrix") for name, S in (("S1", S1), ("S2", S2)))
    for name, matrix in (("S1", S1), ("S2", S2)):
        check_unit(name, matrix)
        if name == f"S{neumann_body}":
            check_matrix(name, matrix)
        if len(matrix) % 2:
            raise ValueError(f"{name} is {size(matrix)}: needed two components at each contact node")
    lower, upper = (S1, load1), (S2, load2)
    (S_c, l_c), (S_n, l_n) = (lower, upper) if neumann_body == 2 else (upper, lower)
    motions = stiffness(f"S{3 - neumann_body}", S_c).motions
    n, m = len(S_c) // 2, len(S_n) // 2
    if transfer is None and n != m:
        raise ValueError(f"S1 is {size(S1)}, S2 is {size(S2)}: needed the same contact nodes, or a transfer")
    if x is None:
        x, even = np.arange(float(n)), np.ones(n)
    else:
        x = real_array("x", x, (n,))
        even = trapezoid(x)
    w = even if weights is None else real_array("weights", weights, (n,))
    distance = real_array("gap", gap, (n,), alone=True)
    check_nodes(x, w)
    P = None if transfer is None else real_array("transfer", transfer, (n, m))
    grid = Grid(x=x, weights=w)
    if P is not None and law is not None:
        raise ValueError("law: needed a kernel, as a transfer does not tell where the nodes of the Neumann body lie")
    other = grid if P is None else Grid(x=np.full(m, np.nan), weights=P.T @ w)
    given = law if kernel is None else GivenOperator(matrix=real_array("kernel", kernel, (n, m)))
    contact, neumann = (
        _condensed(name, matrix, load, own, free, upward=neumann_body == 2)
        for name, matrix, load, own, free in (("contact", S_c, l_c, grid, motions), ("neumann", S_n, l_n, other, None))
    )
    interface = Interface.joining(grid, other, P, gap=distance, law=given)
    pair = ContactPair(contact=contact, neumann=neumann, interface=interface, neumann_body=neumann_body)
    return _rubbing(pair, 0 if friction is None else friction)


def _varies(friction: Any) -> bool:
    """Return True for a value at each node, or a function."""
    return callable(friction) or isinstance(friction, (list, tuple)) or np.ndim(friction) > 0


def _rubbing(pair: ContactPair, friction: Any) -> ContactPair:
    return pair.along(friction) if _varies(friction) else pair.at(friction=friction)


def pair_of(problem: Problem | ContactPair | Path | str, *, obstacle: bool = False) -> ContactPair:
    """Return the pair that a problem, a file or a pair stands for; ``obstacle`` as of :func:`build`."""
    if not isinstance(problem, ContactPair):
        return build(problem, obstacle=obstacle)
    if problem.neumann.rigid and not obstacle:
        assert problem.problem is not None
        pairs.pair_from(problem.problem)  # refuses it
    return problem


def _condensed(
    name: str, matrix: Floats, load: Floats | None, grid: Grid, motions: Floats | None, *, upward: bool
) -> Condensed:
    condensed = Condensed(
        grid=grid,
        schur=(matrix + matrix.T) / 2,
        load=np.zeros(grid.size) if load is None else real_array(f"the load of the {name} body", load, (grid.size,)),
        known=np.zeros(grid.size),
        free=np.ones(grid.size, dtype=bool),
        motions=NO_MOTIONS if motions is None or not motions.size else motions,
    )
    return condensed if upward else condensed.turned()
