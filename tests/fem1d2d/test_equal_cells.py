"""Layers of equal cells: against assembled periodic meshes, closed forms, and the other derivation in balls."""

from __future__ import annotations

from fractions import Fraction as F
from itertools import product

import numpy as np
import pytest
from flint import arb_mat, ctx
from scipy.linalg import eigh
from strategies import AT_NIGHT

from fem1d2d import MeshError, mortar, plane_strain, rectangle, stiffness
from fem1d2d.layers import FacingLayers, Layer, peaks
from fem1d2d.proofs import layers_proved
from fem1d2d.proofs.layers_proved import BITS, HalfPlane, Undecided, enclosed_ratio

STEEL = plane_strain(2.6, 0.3)  # G = 1


def mirrored_layers(contact: float, neumann: float, *, mirrored: bool = True, **interface) -> FacingLayers:
    """Cells of two aspects, one material."""
    layers = (Layer(material=STEEL, aspect=contact), Layer(material=STEEL, aspect=neumann, rising=mirrored))
    return FacingLayers(contact=layers[0], neumann=layers[1], **interface)


# --- against assembled meshes -----------------------------------------------------------------------------------------


def periodic(aspect: float, columns: int, rows: int, material, *, upper: bool = False) -> np.ndarray:
    """The Schur complement of a surface of rectangle()'s mesh whose ends are joined, the other side clamped.

    Components x and y of each node in turn.
    """
    mesh = rectangle((0.0, columns * aspect), (0.0, float(rows)), (columns, rows))
    node = np.arange(len(mesh.points)).reshape(columns + 1, rows + 1)
    joined = np.arange(len(mesh.points))
    joined[node[-1]] = node[0]
    fold = np.zeros((2 * len(mesh.points), 2 * len(mesh.points)))
    for i, j in enumerate(joined):
        fold[2 * i : 2 * i + 2, 2 * j : 2 * j + 2] = np.eye(2)
    K = fold.T @ stiffness(mesh, material).toarray() @ fold
    unknowns = lambda nodes: (2 * np.asarray(nodes)[:, None] + [0, 1]).ravel()
    near, far = (0, rows) if upper else (rows, 0)
    on = unknowns(node[:-1, near])
    inner = unknowns(np.setdiff1d(node[:-1], node[:-1, [near, far]]))
    return K[np.ix_(on, on)] - K[np.ix_(on, inner)] @ np.linalg.solve(K[np.ix_(inner, inner)], K[np.ix_(inner, on)])


def on_waves(matrix: np.ndarray, columns: int, phase: float) -> np.ndarray:
    """The block of a matrix on waves that change by a phase over two columns."""
    wave = np.exp(1j * phase * (np.arange(columns) // 2))
    basis = np.zeros((2 * columns, 4), dtype=complex)
    for node in range(columns):
        for p in range(2):
            basis[2 * node + p, 2 * (node % 2) + p] = wave[node]
    return basis.conj().T @ matrix @ basis / (columns // 2)


@pytest.mark.parametrize(("aspect", "rows", "nu"), list(product((0.25, 1.0, 3.0), (1, 2, 5), (0.0, 0.3, 0.49))))
def test_the_symbol_of_a_layer_is_that_of_an_assembled_mesh(aspect, rows, nu):
    columns, material = 8, plane_strain(1.0, nu)
    for upper in (False, True):
        S = periodic(aspect, columns, rows, material, upper=upper)
        # the cell in column 0 below the surface rises where the number of the row is even; the upper body is mirrored
        layer = Layer(material=material, aspect=aspect, rising=not upper and rows % 2 == 1, rows=rows)
        flip = np.tile([1.0, -1.0 if upper else 1.0], 2)
        for turn in range(columns // 2):
            phase = 4 * np.pi * turn / columns
            found = layer.surface(np.array([phase]), 2)[0] * np.outer(flip, flip)
            assert found == pytest.approx(on_waves(S, columns, phase), abs=1e-10 * np.abs(S).max())


@pytest.mark.parametrize(
    ("aspects", "nus"), [((0.5, 1.0), (0.3, 0.3)), ((2.0, 0.5), (0.0, 0.45)), ((1.0, 1.0), (0.3, 0.3))]
)
def test_the_largest_ratio_of_the_waves_is_rho_of_two_assembled_periodic_bodies(aspects, nus):
    columns, rows = 12, 3
    materials = [plane_strain(1.0, nu) for nu in nus]
    S_c = periodic(aspects[0], columns, rows, materials[0])
    S_n = periodic(aspects[1], columns, rows, materials[1], upper=True)
    phases = 4 * np.pi * np.arange(columns // 2) / columns
    layers = [
        Layer(material=material, aspect=aspect, rising=rising, rows=rows)
        for material, aspect, rising in zip(materials, aspects, (True, False), strict=True)
    ]
    rho, rho_normal = (found.max() for found in FacingLayers(contact=layers[0], neumann=layers[1]).ratios(phases))
    assert rho == pytest.approx(eigh(S_c, S_n, eigvals_only=True)[-1], rel=1e-10)
    condensed = [S[1::2, 1::2] - S[1::2, ::2] @ np.linalg.solve(S[::2, ::2], S[::2, 1::2]) for S in (S_c, S_n)]
    assert rho_normal == pytest.approx(eigh(*condensed, eigvals_only=True)[-1], rel=1e-10)


@pytest.mark.parametrize(("columns", "offset"), [((4, 6), 0.0), ((6, 4), -0.3), ((2, 2), -0.5), ((2, 8), 0.1)])
def test_the_transfer_of_waves_is_that_of_long_grids(columns, offset):
    own, other = columns
    periods, phase = 5, 0.7
    contact = np.arange(0.0, own * periods + 1)
    neumann = offset + own / other * np.arange(-other, other * (periods + 1) + 1)
    P = mortar(contact, neumann)
    middle = P[2 * own : 3 * own]
    node = np.arange(-other, other * (periods + 1) + 1)
    folded = np.zeros((own, other), dtype=complex)
    for i, j in enumerate(node):
        folded[:, j % other] += middle[:, i] * np.exp(1j * phase * (j // other - 2))
    found = mirrored_layers(1.0, 1.0, columns=columns, offset=offset).transfer(np.array([phase]))[0]
    assert found == pytest.approx(folded, abs=1e-13)


# --- against closed forms and known values ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("aspect", "nu", "diagonals"), list(product((0.3, 1.0, 3.0), (0.0, 0.3, 0.45), ("alternating", "uniform")))
)
def test_long_waves_on_a_half_plane_are_those_of_the_continuum_and_saw_teeth_have_a_closed_form(aspect, nu, diagonals):
    layer = Layer(material=plane_strain(2 * (1 + nu), nu), aspect=aspect, diagonals=diagonals)
    columns, phase = layer.period, 1e-3  # the next terms are like its square
    found = np.linalg.eigvalsh(layer.surface(np.array([phase]), columns)[0])
    own = found[:2] * columns / phase
    assert own == pytest.approx([2 / (3 - 4 * nu), 2], rel=1e-4)
    if diagonals == "alternating":
        M = 2 * (1 - nu) / (1 - 2 * nu)
        teeth = [2 * np.sqrt(1 + M * aspect**2) / aspect, 2 * np.sqrt(M**2 + M * aspect**2) / aspect]
        assert found[2:] == pytest.approx(sorted(teeth), rel=1e-5)


def test_many_rows_are_a_half_plane():
    phases = np.array([0.5, 2.0, 3.1])
    endless = Layer(material=STEEL, aspect=2.0).surface(phases, 2)
    assert Layer(material=STEEL, aspect=2.0, rows=200).surface(phases, 2) == pytest.approx(endless, abs=1e-12)


def test_more_columns_have_the_waves_of_fewer():
    layer, phase = Layer(material=STEEL, aspect=0.7), 1.1
    six = np.linalg.eigvalsh(layer.surface(np.array([phase]), 6)[0])
    two = np.linalg.eigvalsh(layer.surface((phase + 2 * np.pi * np.arange(3)) / 3, 2))
    assert np.sort(six) == pytest.approx(np.sort(two.ravel()), rel=1e-11)


KNOWN = [
    ((1.0, 1.0, True), (1.8, 1.0)),
    ((1.0, 1.0, False), (1.8, 1.2172646)),
    ((0.5, 1.0, True), (2.3547620, 1.2909944)),
    ((0.25, 1.0, True), (4.1143070, 2.0952950)),
]


@pytest.mark.parametrize(("cells", "expected"), KNOWN)
def test_known_values_in_units_of_the_ratio_of_moduli(cells, expected):
    contact, neumann, mirrored = cells
    found = [peak.ratio for peak in peaks(mirrored_layers(contact, neumann, mirrored=mirrored))]
    assert found == pytest.approx(expected, rel=2e-7)


@pytest.mark.parametrize("nu", [0.2, 0.3, 1 / 3, 0.4, 0.45, 0.49])
def test_cells_of_one_aspect_add_nothing_for_nu_up_to_a_third_and_beyond_only_if_they_are_wide_enough(nu):
    expected = {0.4: (2.102, 1.599, 1.4, 1.4), 0.45: (2.954, 2.037, 1.278, 1.2), 0.49: (4.844, 2.690, 1.533, 1.157)}
    for aspect, rho in zip((0.5, 1.0, 2.0, 4.0), expected.get(nu, [3 - 4 * nu] * 4), strict=True):
        layer = Layer(material=plane_strain(1.0, nu), aspect=aspect)
        found = [peak.ratio for peak in peaks(FacingLayers(contact=layer, neumann=layer))]
        assert found == pytest.approx([rho, 1.0], abs=1e-3)


def test_bad_layers_are_refused():
    for values in ({"aspect": 0.0}, {"aspect": float("nan")}, {"aspect": 1.0, "rows": 0}):
        with pytest.raises(MeshError):
            Layer(material=STEEL, **values)
    with pytest.raises(MeshError, match="3 columns"):
        mirrored_layers(1.0, 1.0, columns=(3, 3))
    with pytest.raises(MeshError, match="1 columns"):
        Layer(material=STEEL, aspect=1.0).surface(np.array([1.0]), 1)


# --- for all wave numbers, in balls -----------------------------------------------------------------------------------


def half_planes(aspects, nus, shear="1") -> tuple[list[HalfPlane], list[Layer]]:
    """The same two bodies for both derivations."""
    shears = (F(shear), F(1))
    proved = [HalfPlane(aspect=F(a), shear=g, poisson=F(nu)) for a, g, nu in zip(aspects, shears, nus, strict=True)]
    doubles = [
        Layer(material=plane_strain(float(2 * p.shear * (1 + p.poisson)), float(p.poisson)), aspect=float(p.aspect))
        for p in proved
    ]
    return proved, doubles


@pytest.mark.parametrize(("aspect", "nu"), [("1", "0.3"), ("1/3", "0"), ("4", "0.49")])
def test_both_derivations_of_a_row_have_one_symbol(aspect, nu):
    (proved, _), (layer, _) = half_planes((aspect, aspect), (nu, nu))
    with ctx.workprec(BITS):
        K = layers_proved.row_of_cells(proved.aspect, proved.modulus)
        for xi in (0.01, 0.4, 1.5):
            angle = layers_proved.arb(xi)
            s, _ = layers_proved.surface(K[0] + K[1] * angle.cos() + K[2] * angle.sin())
            own = np.linalg.eigvalsh([[float(x) for x in row] for row in s.tolist()])
            assert own == pytest.approx(np.linalg.eigvalsh(layer.surface(np.array([2 * xi]), 2)[0]), rel=1e-9)


def drawn(seed: int):
    """Two half-planes, whether their diagonals mirror, and the peaks in doubles."""
    random = np.random.default_rng(seed)
    pick = lambda values: [str(value) for value in random.choice(values, 2)]
    bodies, doubles = half_planes(pick(["1/4", "1/2", "1", "2", "4"]), pick(["0", "0.3", "0.49"]), shear="3/2")
    mirrored = bool(random.random() < 0.5)
    neumann = Layer(material=doubles[1].material, aspect=doubles[1].aspect, rising=mirrored)
    return bodies, mirrored, FacingLayers(contact=doubles[0], neumann=neumann)


@pytest.mark.parametrize("seed", range(60) if AT_NIGHT else (0,))
def test_the_supremum_is_enclosed_to_1e_9_and_no_wave_in_doubles_is_above_it(seed):
    (contact, neumann), mirrored, interface = drawn(seed)
    phases = np.linspace(1e-3, np.pi, 500)
    rounded = lambda phase: 1 + 1e-9 + 1e-12 / phase**2  # as `fem1d2d.layers.LONGEST` has it
    for which, peak in enumerate(peaks(interface, rounds=6)):
        lo, hi = enclosed_ratio(contact, neumann, peak.phase, mirrored=mirrored, normal=bool(which))
        assert 0 < lo < hi <= lo * (1 + 1e-9)
        assert (interface.ratios(phases)[which] <= hi * rounded(phases)).all()
        assert peak.ratio <= hi * rounded(peak.phase)


@pytest.mark.skipif(not AT_NIGHT, reason="in the nightly profile, as it takes eight seconds")
def test_a_phase_that_is_not_the_best_proves_nothing_false():
    (contact, neumann), _ = half_planes(("1/2", "1"), ("0.3", "0.3"))
    with pytest.raises(Undecided):
        enclosed_ratio(contact, neumann, 1.0, mirrored=True, normal=False)


@pytest.mark.parametrize("factor", ["0.999", "1.001"])
@pytest.mark.parametrize("long", [True, False])
def test_a_wrong_symbol_is_refused(factor, long):
    """Both inequalities are needed: a symbol that is too small fails in the upper one, one that is too large below."""
    with ctx.workprec(BITS):
        K = layers_proved.row_of_cells(F(1), F(7, 2))
        if long:
            lo, hi = F(0), layers_proved.LONG
            X, E = (
                [c * layers_proved.ball(hi) ** k for k, c in enumerate(p)]
                for p in layers_proved.long_waves(F(1), F(7, 2))
            )
            row = layers_proved.expanded(K, F(0), hi)
        else:
            lo, hi = F(1), F(9, 8)
            X, E = layers_proved.interpolated(K, (lo + hi) / 2, (hi - lo) / 2)
            row = layers_proved.expanded(K, (lo + hi) / 2, (hi - lo) / 2)
        assert layers_proved.proves(row, X, E, lo, hi)
        wrong = [layers_proved.arb(factor) * c for c in X]
        assert not layers_proved.proves(row, wrong, E, lo, hi)


def test_a_long_wave_with_a_wrong_field_below_is_refused():
    with ctx.workprec(BITS):
        K, long = layers_proved.row_of_cells(F(1), F(7, 2)), layers_proved.LONG
        X, E = (
            [c * layers_proved.ball(long) ** k for k, c in enumerate(p)]
            for p in layers_proved.long_waves(F(1), F(7, 2))
        )
        E[0][0, 0] += layers_proved.arb("1e-9")
        with pytest.raises(Undecided, match="coefficient 0 of entry 0, 0"):
            layers_proved.proves(layers_proved.expanded(K, F(0), long), X, E, F(0), long)


@pytest.mark.parametrize("aspect", [F(1, 4), F(1), F(2)])
def test_long_waves_obey_the_elimination_exactly_up_to_the_second_order(aspect):
    """With nu = 1/4, kappa = 2, all numbers of long amplitudes are dyadic, so that the balls are points."""
    with ctx.workprec(BITS):
        K = layers_proved.expanded(layers_proved.row_of_cells(aspect, F(3)), F(0), F(1))
        (_, Y), (one, slope) = layers_proved.long_waves(aspect, F(3))
        # values of the long amplitudes above and below a row: (1, 1 + slope xi)
        stacked = [arb_mat(np.vstack([np.eye(2), np.eye(2)]).tolist()), arb_mat(4, 2)]
        for i, j in product(range(2), range(2)):
            assert one[i, j] == int(i == j)
            stacked[1][2 + i, j] = slope[i, j]
        long = [0, 1, 4, 5]
        rows = [arb_mat([[c[i, j] for j in long] for i in long]) for c in K[:3]]
        energy = [arb_mat(2, 2) for _ in range(3)]
        for a, b, c in product(range(2), range(3), range(2)):
            if a + b + c <= 2:
                energy[a + b + c] += stacked[a].transpose() * rows[b] * stacked[c]
        Y, slope = (arb_mat([[c[i, j] for j in range(2)] for i in range(2)]) for c in (Y, slope))
        assert energy[0] == energy[1] == arb_mat(2, 2)
        # of order xi^2: X - E' X E = -(slope' Y + Y slope)
        assert energy[2] == -(slope.transpose() * Y + Y * slope)
        assert energy[2][0, 0] > 0
        assert energy[2].det() > 0


def test_a_polynomial_is_positive_only_if_it_is_at_both_ends_and_between():
    with ctx.workprec(BITS):
        one = [layers_proved.arb(1)]
        scalar = lambda *coefficients: [arb_mat([[c]]) for c in coefficients]
        assert layers_proved.positive(scalar(1, 0.9), one)
        assert not layers_proved.positive(scalar(1, 1.1), one)
        assert not layers_proved.positive(scalar(1, 0, -1.1), one)
        assert not layers_proved.positive([arb_mat([[1, 2], [2, 1]])], one * 2)


def test_a_ratio_of_normal_stiffness_is_proved_only_where_the_tangential_block_is_positive_as_the_proof_needs():
    """Components in turn tangential and normal; with a negative block the condensed form bounds no least energy."""
    with ctx.workprec(BITS):
        diagonal = lambda *values: [arb_mat(np.diag(values).tolist())]
        proved = lambda tangential: layers_proved.at_most(
            layers_proved.arb(1), diagonal(0.5, 0.5, 0.5, 0.5), diagonal(tangential, 1.0, tangential, 1.0),
            [layers_proved.arb(1)] * 4, normal=True,
        )  # fmt: skip
        assert proved(1.0)
        assert not proved(-1.0)
        assert not proved(0.1)  # the residual is weighed by an eighth


def test_a_part_that_is_not_linear_counts_whatever_its_sign_and_place():
    with ctx.workprec(BITS):
        two = [layers_proved.arb(1)] * 2
        form = lambda *values: [arb_mat([[float(a), float(b)], [float(b), float(a)]]) for a, b in values]
        assert layers_proved.positive(form((1, 0), (0, 0), (0, 0.5)), two)
        assert not layers_proved.positive(form((1, 0), (0, 0), (0, 1.1)), two)
        assert not layers_proved.positive(form((1, 0), (0, 0), (0, 0), (0, 1.1)), two)
