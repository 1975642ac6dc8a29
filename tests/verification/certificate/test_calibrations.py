"""Calibrations: the identity behind them, their conditions at points, and fields that try to beat them."""

from dataclasses import replace
from fractions import Fraction as F
from itertools import pairwise

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse.linalg
import sympy
from hypothesis import given
from hypothesis import strategies as st
from strategies import AT_NIGHT, fewer

import verification as vf
from fem1d2d import plane_strain, rectangle, stiffness
from ndtheory import HypothesisError
from ndtheory.continuum.calibration import loss
from ndtheory.continuum.intervals import Interval
from ndtheory.continuum.rectangles import continuum_constants, friction_threshold, statement
from verification.certificate import calibrating, continuum
from verification.certificate.continuum import two_rectangles

KAPPA = F(9, 5)
CONTACT, NEUMANN = (F(4), F(0), F(4)), (F(20, 3), F(4, 3), F(16, 3))

#: Length, Gamma_c and Poisson's ratio of bodies, in thicknesses.
BODIES = [(*CONTACT, "0.3"), (*NEUMANN, "0.3"), (F(3, 2), F(1, 2), F(3, 2), "0.45"), (F(1), F(1, 4), F(2, 3), "-0.4")]


@pytest.fixture(scope="module")
def tracing(shared):
    return shared(("for_traces", *CONTACT, KAPPA), lambda: calibrating.for_traces(*CONTACT, KAPPA))


@pytest.fixture(scope="module")
def cutting(shared):
    return shared(("for_cut_off", *NEUMANN, KAPPA), lambda: calibrating.for_cut_off(*NEUMANN, KAPPA))


@pytest.fixture(scope="module")
def section6():
    return two_rectangles(vf.example("section6"))


# --- the proof ---


def test_the_identity_of_a_calibration_holds_for_polynomials():
    x, y = sympy.symbols("x y")
    kappa, length = sympy.Rational(9, 5), 2
    nu = (3 - kappa) / 4
    axes = (x, y)
    w = (x**2 * y - 3 * y + 1, x * y**2 + 2 * x - y)
    cubic = (1 + x * y, x - 2 * y**2, 3 + y, x**2 - y)  # xxx, xxy, xyy, yyy
    M = [[[cubic[i + j + k] for k in range(2)] for j in range(2)] for i in range(2)]
    over = lambda f, *ends: sum(
        c * sympy.prod(end ** (n + 1) / (n + 1) for n, (_, end) in zip(powers, ends, strict=True))
        for powers, c in sympy.Poly(f, *(axis for axis, _ in ends)).terms()
    )
    whole = lambda f: over(f, (x, sympy.Integer(length)), (y, sympy.Integer(1)))

    def strain(s):  # C^-1 for G = 1
        trace = s[0][0] + s[1][1]
        return [[(s[i][j] - nu * trace * int(i == j)) / 2 for j in range(2)] for i in range(2)]

    def energy(e):
        trace = e[0][0] + e[1][1]
        return 2 * sum(e[i][j] ** 2 for i in range(2) for j in range(2)) + 2 * nu / (1 - 2 * nu) * trace**2

    pairs = [(i, j) for i in range(2) for j in range(2)]
    e = [[(sympy.diff(w[i], axes[j]) + sympy.diff(w[j], axes[i])) / 2 for j in range(2)] for i in range(2)]
    of = [[[M[i][j][k] for j in range(2)] for i in range(2)] for k in range(2)]  # the stress of the unit vector k
    part = strain([[sum(M[i][j][k] * w[k] for k in range(2)) for j in range(2)] for i in range(2)])
    rest = [[e[i][j] - part[i][j] for j in range(2)] for i in range(2)]
    R = [
        [
            -sum(sympy.diff(M[i][j][k], axes[i]) for i in range(2))
            - sum(strain(of[j])[p][q] * of[k][p][q] for p, q in pairs)
            for k in range(2)
        ]
        for j in range(2)
    ]
    flux = [sum(M[i][j][k] * w[j] * w[k] for j, k in pairs) for i in range(2)]
    border = over(flux[0].subs(x, length) - flux[0].subs(x, 0), (y, sympy.Integer(1)))
    border += over(flux[1].subs(y, 1) - flux[1].subs(y, 0), (x, sympy.Integer(length)))
    inside = whole(energy(rest)) + whole(sum(R[j][k] * w[j] * w[k] for j, k in pairs))
    assert sympy.simplify(whole(energy(e)) - inside - border) == 0


def least_by_differences(proof, columns=None):
    """The least eigenvalue of ``y^2 (R - beta q)`` at a point of each cell of some columns.

    R is that of the field M = N/y itself, from differences: not from Bernstein's coefficients.
    """
    rng, step, nu = np.random.default_rng(3), 1e-6, 0.3
    x, y = (np.array(line, float) for line in (proof.x, proof.y))
    N = np.array([[[float(v) for v in cubic] for cubic in line] for line in proof.nodes])
    i, j = (
        index.ravel() for index in np.meshgrid(range(len(x) - 1) if columns is None else columns, range(len(y) - 1))
    )
    at, depth = (
        x[i] + np.diff(x)[i] * rng.uniform(0.01, 0.99, i.shape),
        y[j] + np.diff(y)[j] * rng.uniform(0.05, 0.95, i.shape),
    )

    def M(at, depth):
        s, t = (((value - line[n]) / np.diff(line)[n])[:, None] for value, line, n in ((at, x, i), (depth, y, j)))
        lower, upper = (N[i, n] * (1 - s) + N[i + 1, n] * s for n in (j, j + 1))
        return (lower * (1 - t) + upper * t) / depth[:, None]

    along = (M(at + step, depth) - M(at - step, depth)) / (2 * step)
    across = (M(at, depth + step) - M(at, depth - step)) / (2 * step)
    once = np.array([[0, 1], [1, 2]])
    stress = M(at, depth)[:, [once, once + 1]]
    trace = np.trace(stress, axis1=2, axis2=3)
    products = np.einsum("cpab,cqab->cpq", stress, stress) - nu * trace[:, :, None] * trace[:, None]
    R = -(along[:, once] + across[:, once + 1]) - products / 2
    R -= np.array(proof.beta, float)[i, None, None] * np.diag([3.5, 1.0])
    return np.linalg.eigvalsh(R * (depth**2)[:, None, None]).min()


def test_the_conditions_hold_at_points_of_every_cell_by_differences(tracing, cutting):
    for proof in (tracing, cutting):
        assert least_by_differences(proof) > -1e-6


def energies(proof, fields, points=24):
    """a(w) with G = 1, the trace and the q of a calibration, by Gauss' rule on every cell of its grid."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    total, proved = 0.0, 0.0
    for i, (left, right) in enumerate(pairwise(map(float, proof.x))):
        at = (left + right) / 2 + (right - left) / 2 * nodes
        X, Y = np.meshgrid(at, (1 + nodes) / 2, indexing="ij")
        W = np.outer(weights, weights) * (right - left) / 4
        w, (xx, xy, yx, yy) = fields(X, Y)
        shear, lame = (xy + yx) / 2, float((3 - proof.kappa) / (proof.kappa - 1))
        total += np.sum(W * (2 * (xx**2 + yy**2 + 2 * shear**2) + lame * (xx + yy) ** 2))
        stretched = float((proof.kappa + 1) / (proof.kappa - 1))
        proved += float(proof.beta[i]) * np.sum(W * (stretched * w[0] ** 2 + w[1] ** 2))
        along = fields(at, np.ones_like(at))[0][0]
        proved += float(proof.tau[i]) * np.sum(weights * (right - left) / 2 * along**2)
    return total, proved


@given(st.lists(st.floats(-1, 1), min_size=12, max_size=12), st.floats(0.1, 3), st.booleans())
def test_no_field_has_less_energy_than_is_proved(tracing, cutting, numbers, wave, first):
    proof = tracing if first else cutting
    a, b, c, d = np.array(numbers[:3]), np.array(numbers[3:6]), np.array(numbers[6:9]), np.array(numbers[9:])
    powers = np.arange(1, 4)

    def fields(X, Y):
        shape = [sum(u[p - 1] * Y**p for p in powers) for u in (a, b, c, d)]
        slope = [sum(u[p - 1] * p * Y ** (p - 1) for p in powers) for u in (a, b, c, d)]
        cos, sin = np.cos(wave * X), np.sin(wave * X)
        value = (cos * shape[0] + sin * shape[1], cos * shape[2] + sin * shape[3])
        by_x = [wave * (cos * shape[p + 1] - sin * shape[p]) for p in (0, 2)]
        by_y = [cos * slope[p] + sin * slope[p + 1] for p in (0, 2)]
        return value, (by_x[0], by_y[0], by_x[1], by_y[1])

    total, proved = energies(proof, fields)
    assert proved <= total * (1 + 1e-9) + 1e-12


def meshed(length, poisson, rows=6):
    """Stiffness on a mesh of a rectangle with d = G = 1, clamped below; its points, and which numbers are free."""
    mesh = rectangle((0.0, float(length)), (0.0, 1.0), (round(float(length) * rows), rows))
    points = np.asarray(mesh.points)
    return mesh, stiffness(mesh, plane_strain(2 * (1 + poisson), poisson)), np.repeat(points[:, 1] > 1e-9, 2)


def weighted(mesh, along, across, size):
    """The exact mass matrix of a mesh with weights of both components in each triangle."""
    points, cells = np.asarray(mesh.points), np.asarray(mesh.cells)
    corners = points[cells]
    area = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 24
    B = scipy.sparse.lil_matrix((size, size))
    for nodes, share, x, y in zip(cells, area, along, across, strict=True):
        mass = share * (np.ones((3, 3)) + np.eye(3))
        for component, weight in ((0, x), (1, y)):
            if weight:
                B[np.ix_(2 * nodes + component, 2 * nodes + component)] += weight * mass
    return B.tocsc()


def test_no_mesh_beats_the_weights_beside_gamma_c_and_one_comes_near(cutting):
    mesh, A, free = meshed(NEUMANN[0], 0.3)
    middles = np.asarray(mesh.points)[np.asarray(mesh.cells)][:, :, 0].mean(1)
    beta = np.array(cutting.beta, float)[np.searchsorted(np.array(cutting.x, float), middles) - 1]
    B = weighted(mesh, 3.5 * beta, beta, A.shape[0])
    A, B = (matrix.tocsc()[free][:, free] for matrix in (A, B))
    largest = scipy.sparse.linalg.eigsh(B, M=A, k=1, which="LA", return_eigenvectors=False)[0]
    assert 0.5 < largest <= 1  # the columns of the mesh are not those of the grid, whose beta falls towards the side


@pytest.mark.parametrize(("length", "lo", "hi", "poisson"), BODIES if AT_NIGHT else [*BODIES[:2], BODIES[3]])
def test_no_mesh_shows_a_larger_tangential_trace_than_a_calibration(length, lo, hi, poisson, shared):
    body = length, lo, hi, 3 - 4 * F(poisson)
    proof = shared(("for_traces", *body), lambda: calibrating.for_traces(*body))
    mesh, A, free = meshed(length, float(poisson), rows=6 if length > 2 else 12)
    points = np.asarray(mesh.points)
    top = np.flatnonzero((points[:, 1] > 1 - 1e-9) & (points[:, 0] >= lo - 1e-9) & (points[:, 0] <= hi + 1e-9))
    top = top[np.argsort(points[top, 0])]
    widths = np.diff(points[top, 0])
    mass = np.diag(np.r_[widths, 0] / 3 + np.r_[0, widths] / 3) + np.diag(widths / 6, 1) + np.diag(widths / 6, -1)
    load = np.zeros((A.shape[0], len(top)))
    load[2 * top, np.arange(len(top))] = 1
    flexibility = load[free].T @ scipy.sparse.linalg.spsolve(A.tocsc()[free][:, free], load[free])
    root = scipy.linalg.cholesky(mass)
    seen = scipy.linalg.eigvalsh(root @ flexibility @ root.T)[-1]
    assert 0.5 < seen * float(proof.trace(lo, hi)) <= 1


# --- the cut-off ---


def test_the_loss_is_attained_where_a_lift_is_a_hyperbolic_cosine():
    """A string on an elastic bed, a(v) = int v'^2 + v^2 with beta = 1: its lift is v = cosh, and tanh v = sinh."""
    for reach in (F(1, 2), F(3, 2)):
        x = np.linspace(0, float(reach), 20001)
        energy = lambda value, slope, x=x: np.trapezoid(value**2 + slope**2, x)
        scale = 1 / np.tanh(float(reach))
        there = energy(scale * np.sinh(x), scale * np.cosh(x)) / energy(np.cosh(x), np.sinh(x))
        assert float(loss(Interval.of(reach))) == pytest.approx(there - 1, rel=1e-7)


def test_the_cut_off_costs_every_lift_of_a_mesh_less_than_is_proved(cutting):
    mesh, A, free = meshed(NEUMANN[0], 0.3)
    points = np.asarray(mesh.points)
    ends = np.array(cutting.x, float)
    run = np.r_[0, np.cumsum(np.sqrt(np.array(cutting.beta, float)) * np.diff(ends))]
    middles = points[np.asarray(mesh.cells)][:, :, 0].mean(1)
    mirrored = np.minimum(middles, float(NEUMANN[0]) - middles)
    beside = mirrored < float(NEUMANN[1])
    reach = np.interp(float(NEUMANN[1]), ends, run)
    column = np.searchsorted(ends, mirrored) - 1
    slope = np.sqrt(np.array(cutting.beta, float))[column] / np.cosh(np.interp(mirrored, ends, run)) ** 2
    square = np.where(beside, (slope / np.tanh(reach)) ** 2, 0)
    B = weighted(mesh, 3.5 * square, square, A.shape[0]).tocsc()[free][:, free]
    gamma = (points[:, 1] > 1 - 1e-9) & (np.abs(points[:, 0] - float(NEUMANN[0]) / 2) < 2 + 1e-9)
    held = np.flatnonzero(np.repeat(gamma, 2)[free])
    rest = np.setdiff1d(np.arange(int(free.sum())), held)
    A = A.tocsc()[free][:, free]
    inner = scipy.sparse.linalg.splu(A[rest][:, rest].tocsc()).solve(A[rest][:, held].toarray())
    lifts = np.zeros((A.shape[0], len(held)))
    lifts[held], lifts[rest] = np.eye(len(held)), -inner
    largest = scipy.linalg.eigh(lifts.T @ (B @ lifts), lifts.T @ (A @ lifts), eigvals_only=True)[-1]
    assert 0.05 < largest <= float(loss(Interval.of(F(reach))))


# --- what is refused ---


@pytest.mark.parametrize("which", ["tau", "beta"])
def test_a_weight_that_grows_by_a_twentieth_is_no_longer_proved(tracing, cutting, which):
    proof = {"tau": tracing, "beta": cutting}[which]
    weights = getattr(proof, which)
    positive = [i for i, weight in enumerate(weights) if weight > 0]
    for i in (positive[0], positive[len(positive) // 3], positive[-1]):
        grown = (*weights[:i], weights[i] * F(21, 20), *weights[i + 1 :])
        with pytest.raises(HypothesisError, match="calibration"):
            replace(proof, **{which: grown})


@fewer(2)
@given(st.data())
def test_a_field_that_is_changed_at_a_node_is_refused_unless_its_conditions_hold(tracing, data):
    i, j, p = (data.draw(st.integers(0, most)) for most in (len(tracing.x) - 1, len(tracing.y) - 1, 3))
    change = data.draw(st.sampled_from([-1, 1])) * data.draw(st.fractions(F(1, 2), 4, max_denominator=8))
    cubic = list(tracing.nodes[i][j])
    cubic[p] += change
    line = (*tracing.nodes[i][:j], tuple(cubic), *tracing.nodes[i][j + 1 :])
    try:
        changed = replace(tracing, nodes=(*tracing.nodes[:i], line, *tracing.nodes[i + 1 :]))
    except HypothesisError:
        return
    beside = [column for column in (i - 1, i) if 0 <= column < len(tracing.tau)]
    assert least_by_differences(changed, beside) > -1e-6


@pytest.mark.parametrize(
    "changes",
    [
        {"kappa": F(1)},
        {"kappa": F(5, 2)},
        {"y": (F(1, 10), F(2, 5), F(3, 4), F(23, 25), F(1))},
        {"tau": (F(0),)},
        {"beta": (F(-1),) * 12},
        {"x": (F(0),)},
        {"nodes": ()},
        {"nodes": (((0.0,) * 4,) * 7,) * 17},
    ],
)
def test_a_calibration_of_another_grid_or_material_is_refused(tracing, changes):
    with pytest.raises(HypothesisError):
        replace(tracing, **changes)


def test_calibrations_of_another_body_are_refused(section6, tracing):
    with pytest.raises(HypothesisError, match="length"):
        continuum_constants(section6, neumann=[tracing])


# --- what follows ---


def test_section_6_contracts_in_the_continuum_at_the_friction_and_the_theta_of_the_paper(section6, known_continuum):
    constants, closed = continuum.bounded(section6), continuum_constants(section6)
    says = statement(constants, friction="0.2", theta="0.6")
    assert (says.verdict, says.factor.level) == ("contraction", "guaranteed")
    assert says.factor.hi < 0.7917
    assert says.theta_max_proved.lo > 0.723
    assert friction_threshold(constants).lo > 0.267
    assert statement(closed, friction="0.2", theta="0.6").verdict == "no conclusion"
    for ours, theirs in zip(constants.K, closed.K, strict=True):
        assert ours < theirs
    assert constants.cut_off < closed.cut_off / 4
    assert constants.rho > F(18, 35)  # of half-planes, proved from below


def test_a_solver_that_fails_leaves_the_closed_forms(section6, monkeypatch):
    class Failed:
        def __init__(self, *_):
            pass

        def solve(self):
            return self

        x = float("nan")

    monkeypatch.setattr(calibrating.clarabel, "DefaultSolver", Failed)
    monkeypatch.setattr(calibrating, "ROOMS", calibrating.ROOMS[-1:])
    for name in ("for_traces", "for_cut_off"):
        monkeypatch.setattr(continuum, name, getattr(calibrating, name).__wrapped__)  # not what the cache holds
    assert continuum.bounded(section6) == continuum_constants(section6)
