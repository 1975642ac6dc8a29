"""Properties of every law of friction."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from hypothesis import strategies as st

from fem1d2d import Condensation, plane_strain, rectangle, stiffness, supports, surface
from fem1d2d.mesh import Floats
from verification.algorithm.fixed_point import FixedPointMap
from verification.interface.build import build
from verification.interface.interface import Grid, Interface, Law
from verification.interface.pair import ContactPair
from verification.problem import Problem
from verification.testing.properties import Fails, Finding, Kit, Report
from verification.testing.strategies import SEEDS, forces, plane_problems

#: Two operators are the same up to this part of their largest entry.
SAME = 1e-9

#: A friction force may exceed its bound by this part of the forces: the certificate of step II allows as much.
BEYOND = 1e-6

#: Cells along Gamma_c of the body on which the norm of S is followed, each mesh a halving of the one before.
CELLS = (8, 16, 32, 64)

#: The norm of a bounded S settles; the norm of the local law grows by sqrt(2) at each halving.
GROWS = 1.2


def check_law(law: Law, *, examples: int = 20, length: float = 1.0) -> Report:
    """Test a law of friction.

    ``a matrix of its grids``
        ``operator`` gives finite real numbers, of shape (contact nodes, Neumann nodes), the same ones each time, on
        grids that are alike and on grids that differ.
    ``linear``
        ``S (a f + b h) = a S f + b S h``.
    ``is independent of units``
        Of lengths: on grids s times as large ``law.scaled(s)`` has the operator S/s.  Of stress: S is linear, and never
        sees one.
    ``sees no left or right``
        On the mirrored grids S has its rows and columns in the opposite order.
    ``bounds friction``
        The friction bound is ``w_j k |(S sigma_N)_j|``, and every step II obeys it.
    ``maps into L2``
        Asked where the theorem applies (``outside`` is empty): the norm of S, from the normal forces of an elastic body
        in the norm (5.21) into L2(Gamma_c), settles when the mesh is halved.  A local law fails here, so its
        ``outside`` must name the reason why the theorem does not apply.

    ``examples`` is the number of cases for each property; the first property that fails raises Refused.
    ``length`` is the length of Gamma_c in the cases, of the order of the law's lengths.  The last property is followed
    down to cells of 1/64 of it.
    """
    kit = Kit(f"law {law.name!r}", examples)
    grids = st.fixed_dictionaries({"law": st.just(law), "interface": _interfaces(law, length)})
    tests: dict[str, tuple[Any, Any]] = {
        "a matrix of its grids": (grids, _is_matrix),
        "linear": (_with_forces(law, length), _is_linear),
        "is independent of units": (grids, _is_independent_of_units),
        "sees no left or right": (grids, _sees_no_sides),
        "bounds friction": (_pressed(law, length), _bounds_friction),
    }
    findings = [kit.examine(name, cases, test) for name, (cases, test) in tests.items()]
    return kit.report(*findings, _maps_into_L2(kit, law, length))


# --- cases ------------------------------------------------------------------------------------------------------------


def interpolation(x: Floats, y: Floats) -> Floats:
    """Values at x of the piecewise linear function with values at y, shape (n, m)."""
    return np.column_stack([np.interp(x, y, unit) for unit in np.eye(len(y))])


@st.composite
def _interfaces(draw: st.DrawFn, law: Law, length: float) -> Interface:
    """Grids along Gamma_c of unequal cells, alike or, for a law of the Neumann grid's forces, not."""
    random = np.random.default_rng(draw(SEEDS))
    spread = lambda n: length * np.concatenate([[0.0], np.cumsum(random.uniform(0.3, 1, n - 1))]) / n
    x = spread(draw(st.integers(2, 8)))
    contact = Grid.on(x)
    if law.of_contact or draw(st.booleans()):
        return Interface.joining(contact, contact, None, gap=np.zeros(contact.n), law=law)
    y = spread(draw(st.integers(2, 8)))
    neumann = Grid.on(y * x[-1] / y[-1])
    return Interface.joining(contact, neumann, interpolation(x, neumann.x), gap=np.zeros(contact.n), law=law)


@st.composite
def _with_forces(draw: st.DrawFn, law: Law, length: float) -> dict[str, Any]:
    interface = draw(_interfaces(law, length))
    random = np.random.default_rng(draw(SEEDS))
    compressive = np.abs(random.normal(size=interface.neumann.n))  # and one of either sign
    other = random.normal(size=interface.neumann.n)
    return {
        "law": law,
        "interface": interface,
        "compressive": compressive,
        "other": other,
        "a": 2.0 ** draw(st.integers(-8, 8)),
    }


@st.composite
def _pressed(draw: st.DrawFn, law: Law, length: float) -> dict[str, Any]:
    """A pair of meshes whose Gamma_c has about the given length, with this law."""
    data = draw(plane_problems(friction=st.sampled_from([0.1, 0.5, 1.0]), law="nonlocal", most_cells=3))
    problem = Problem.from_dict(data)
    span = float(np.ptp(build(problem).contact.grid.x)) or 1.0
    scaled = law.scaled(span / length)
    pair = build(problem, law=scaled)
    return {"law": scaled, "pair": pair, "force": draw(forces(pair))}


# --- tests of one case ------------------------------------------------------------------------------------------------


def _is_matrix(law: Law, interface: Interface) -> None:
    S: Any = law.operator(interface)
    shape = interface.contact.n, interface.neumann.n
    if not isinstance(S, np.ndarray) or S.shape != shape or S.dtype.kind != "f" or not np.isfinite(S).all():
        got = f"shape {S.shape}, {S.dtype}" if isinstance(S, np.ndarray) else type(S).__name__
        raise Fails(f"needed finite real numbers of shape {shape}, received {got}")
    if not np.array_equal(np.asarray(S), np.asarray(law.operator(interface))):
        raise Fails("asked twice, it gives two operators")


def _is_linear(law: Law, interface: Interface, compressive: Floats, other: Floats, a: float) -> None:
    S = law.operator(interface)
    expected = a * (S @ compressive) + S @ other
    stress = S @ (a * compressive + other)
    size = float((np.abs(np.asarray(S)) @ (a * compressive + np.abs(other))).max())
    if not np.abs(stress - expected).max() <= SAME * size:
        raise Fails(f"S (a f + h) - a S f - S h is {np.abs(stress - expected).max():.2g} of {size:.2g}")


def _is_independent_of_units(law: Law, interface: Interface) -> None:
    S = law.operator(interface)
    for factor in (2.0**-10, 25.4, 1e3):
        scale = lambda grid, by=factor: Grid(x=by * grid.x, weights=by * grid.weights)
        scaled = replace(interface, contact=scale(interface.contact), neumann=scale(interface.neumann))
        _same(factor * law.scaled(factor).operator(scaled), S, f"with lengths {factor:g} times as large")


def _sees_no_sides(law: Law, interface: Interface) -> None:
    mirror = lambda grid: Grid(x=-grid.x[::-1], weights=grid.weights[::-1])
    image = replace(
        interface,
        contact=mirror(interface.contact),
        neumann=mirror(interface.neumann),
        join=interface.join.mapped(lambda P: P[::-1, ::-1]),
    )
    _same(law.operator(image)[::-1, ::-1], law.operator(interface), "in a mirror")


def _same(S: Floats, expected: Floats, where: str) -> None:
    off, size = float(np.abs(S - expected).max()), float(np.abs(expected).max())
    if not off <= SAME * size:
        raise Fails(f"{where} the operator differs by {off:.2g} of {size:.2g}")


def _bounds_friction(law: Law, pair: ContactPair, force: Floats) -> None:
    grid, t = pair.contact.grid, pair.contact.grid.t
    stress = np.asarray(law.operator(pair.interface)) @ force[pair.neumann.grid.normal]
    bound = float(pair.friction) * grid.weights * np.abs(stress)
    used = pair.bound(force)
    if not (np.all(used >= 0) and np.allclose(used, bound, rtol=SAME, atol=SAME * float(bound.max()))):
        raise Fails("the friction bound is not w_j k |(S sigma_N)_j|")
    _, solved = FixedPointMap(pair)(force)
    size = float(np.abs(solved.force).max()) + float(np.abs(force).max())
    beyond = float((np.abs(solved.force[:t]) - bound).max())
    if not beyond <= BEYOND * size:
        raise Fails(f"a friction force is {beyond:.2g} beyond its bound, forces are {size:.2g} large")


# --- the norm of S on finer meshes ------------------------------------------------------------------------------------


@cache
def _normal_stiffness(cells: int) -> tuple[Floats, Floats]:
    """Positions and ``(S_2)_NN`` along the top of a block of length 1 and height 1/2, E = 1, fixed below."""
    mesh = rectangle((0.0, 1.0), (-0.5, 0.0), (cells, cells // 2))
    nodes = surface(mesh, upper=True)
    known = supports(mesh, {"bottom": (0.0, 0.0)})
    free = np.flatnonzero(~known.held.ravel())
    interface = np.flatnonzero(np.isin(free, np.concatenate([2 * nodes, 2 * nodes + 1])))
    matrix = stiffness(mesh, plane_strain(1.0, 0.3))[free][:, free]
    schur = Condensation(matrix.tocsc(), interface).schur
    normal = np.flatnonzero(free[interface] % 2 == 1)
    return mesh.points[nodes, 0], schur[np.ix_(normal, normal)]


def norms(law: Law, length: float = 1.0) -> list[float]:
    """``sup |S sigma_N|_L2 / |sigma_N|`` with (5.21) below, on meshes with 8, 16, 32, 64 cells along Gamma_c.

    It is the constant C_s of the theorem in energy norms for a block of that length and half that height.
    """
    found = []
    for cells in CELLS:
        x, stiff = _normal_stiffness(cells)
        grid = Grid.on(length * x)
        S = np.asarray(law.operator(Interface.joining(grid, grid, None, gap=np.zeros(grid.n), law=law)))
        root = np.sqrt(grid.weights)[:, None] * S
        found.append(float(np.sqrt(np.linalg.eigvalsh(root @ stiff @ root.T)[-1])))
    return found


def _maps_into_L2(kit: Kit, law: Law, length: float) -> Finding:
    property = "maps into L2"
    found = norms(law, length)
    growth = found[-1] / found[-2] if found[-2] else 1.0
    shown = f"C_s {', '.join(f'{value:.3g}' for value in found)} on {', '.join(map(str, CELLS))} cells"
    if law.outside:
        return Finding(property=property, verdict="not asked", detail=f"it is {law.outside!r}; {shown}")
    if not growth <= GROWS:
        how = f"the norm of S grows with the mesh, so that the theorem does not apply: {shown}"
        raise kit.refused(property, how, length=length)
    return Finding(property=property, verdict="holds", detail=shown)
