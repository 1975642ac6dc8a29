"""Bodies that are their own mirror image: what is proved of a set of pieces holds for its image, and is checked."""

from dataclasses import replace

import numpy as np
import pytest

import verification as vf
from verification.semidefinite.lipschitz import enclose
from verification.semidefinite.mirror import Mirror
from verification.semidefinite.multipliers import QuadraticForms

THETA = 0.7


def section_6(**changes):
    return vf.build(vf.example("section6").changed(cells=((10, 2), (6, 2)), **changes))


def matrices(pair):
    return {
        "S1": np.array(pair.neumann.schur),  # the lower body has the Neumann problem
        "S2": np.array(pair.contact.schur),
        "kernel": np.array(pair.interface.kernel),
        "weights": np.array(pair.contact.grid.weights),
    }


def built(given):
    return vf.build(**given, x=np.linspace(0, 1, 7), friction="1/5", neumann_body=1)


def mirror_of(pair):
    forms = QuadraticForms(pair, vf.measure(pair))
    return forms, Mirror.of(pair, forms)


def test_section_6_is_its_own_mirror_image_and_so_are_its_matrices():
    pair = section_6()
    assert mirror_of(pair)[1] is not None
    assert mirror_of(built(matrices(pair)))[1] is not None


@pytest.mark.parametrize("name", ["S1", "S2", "kernel", "weights"])
def test_one_entry_that_differs_in_the_ninth_digit_is_no_mirror_image(name):
    given = matrices(section_6())
    given[name][(2, 2)[: given[name].ndim]] *= 1 + 1e-9
    assert mirror_of(built(given))[1] is None


def test_bodies_whose_left_edges_are_aligned_are_no_mirror_image():
    data = vf.example("section6").to_dict()
    data["body2"]["x"], data["contact"]["interval"] = [0.0, 1.2], [0.0, 1.2]
    pair = vf.build(vf.Problem.from_dict(data).changed(cells=((10, 2), (6, 2))))
    assert mirror_of(pair)[1] is None


def test_without_friction_nothing_is_divided_and_no_mirror_needed():
    assert mirror_of(section_6(friction=0))[1] is None


@pytest.mark.parametrize("seed", range(4))
def test_the_image_of_multipliers_proves_for_the_image_of_pieces_what_a_program_of_its_own_proves(seed):
    pair, random = section_6(friction=0.4), np.random.default_rng(seed)
    forms, mirror = mirror_of(pair)
    n = pair.contact.grid.n
    signs = random.integers(-1, 2, size=n).astype(np.int8)
    pieces = replace(
        forms.everywhere,
        signs=signs,
        normal=np.where(random.random(n) < 0.3, random.choice([-1, 1], size=n), 0).astype(np.int8),
        slip=np.where((signs != 0) & (random.random(n) < 0.5), random.choice([-1, 1], size=n), 0).astype(np.int8),
    )
    found, proposal = forms.on(pieces, THETA)
    image = mirror.pieces(pieces)
    assert mirror.pieces(image).key == pieces.key != image.key
    alone, _ = forms.on(image, THETA)
    proved = forms.proved_by(mirror.multipliers(found.multipliers), THETA)
    assert proved.value == pytest.approx(found.value, rel=1e-9)
    assert proved.value == pytest.approx(alone.value, rel=1e-5)
    # and the worst pairs of forces are each other's images, node by node
    reflected = mirror.proposal(proposal, forms, pieces)
    products = lambda moments, left, right: np.einsum("ij,ij->i", left @ moments, right)
    for left, right in forms.families[:4]:
        before, after = (products(m, left, right) for m in (proposal.moments, reflected.moments))
        sizes = np.linalg.norm(left, axis=1) * np.linalg.norm(right, axis=1) * np.linalg.norm(proposal.moments)
        assert (np.abs(after[::-1] - before) <= 1e-12 * sizes).all()
    for before, after in zip(forms.parts(proposal.y, pieces), forms.parts(reflected.y, image), strict=True):
        assert (after[::-1] == before).all()


def test_multipliers_that_are_no_image_prove_less():
    """Else the check of the images could not fail."""
    pair = section_6(friction=0.4)
    forms, mirror = mirror_of(pair)
    pieces = replace(forms.everywhere, signs=np.array([1, 1, 1, 0, 0, 0, 0], dtype=np.int8))
    found, _ = forms.on(pieces, THETA)
    lam, tau, a, b, sign, *rest = mirror.multipliers(found.multipliers)
    proved = forms.proved_by((lam, tau, a, b, -sign, *rest), THETA)
    assert proved is None or proved.value > found.value * (1 + 1e-6)


def of_six_nodes():
    """Made-up bodies: no node is in the middle."""
    random, turn = np.random.default_rng(1), np.kron(np.diag([-1, 1]), np.eye(6)[::-1])
    even = lambda matrix, turn: (matrix + turn @ matrix @ turn) / 2
    S1, S2 = (even(A @ A.T + 6 * np.eye(12), turn) for A in random.normal(size=(2, 12, 12)))
    kernel = even(random.uniform(0.5, 1, size=(6, 6)), turn[6:, 6:])
    return vf.build(S1=S1, S2=S2, kernel=kernel, weights=np.ones(6), x=np.arange(6.0), friction="1/10", neumann_body=1)


@pytest.mark.parametrize("pair", [of_six_nodes(), section_6(friction=0.4)], ids=["six nodes", "seven nodes"])
def test_a_program_of_half_the_multipliers_has_the_value_of_the_whole_one(pair):
    forms, whole = (QuadraticForms(pair, vf.measure(pair)) for _ in range(2))
    whole.mirror = None
    assert forms.mirror is not None
    found, other = forms.on(forms.everywhere, THETA), whole.on(forms.everywhere, THETA)
    assert found[0].value == pytest.approx(other[0].value, rel=1e-6)
    assert found[1].moments == pytest.approx(other[1].moments, abs=1e-4 * np.abs(other[1].moments).max())
    for part in forms.parts(found[1].y, forms.everywhere):
        assert (part == part[::-1]).all()
    assert forms.friction_number().value == pytest.approx(whole.friction_number().value, rel=1e-6)
    assert forms.largest_theta().value == pytest.approx(whole.largest_theta().value, rel=1e-6)


def test_a_mirror_halves_the_programs_and_changes_nothing_else():
    given = matrices(section_6())
    alike = built(given)
    given["S1"][1, 1] *= 1 + 1e-9
    unlike = built(given)
    asked = {"gap": 1e-3, "programs": None}
    mirrored, plain = (
        enclose(pair, QuadraticForms(pair, vf.measure(pair)), THETA, **asked) for pair in (alike, unlike)
    )
    assert mirrored.upper.value == pytest.approx(plain.upper.value, rel=asked["gap"])  # where each of them may end
    assert mirrored.lower == pytest.approx(plain.lower, rel=1e-6)
    assert 2 * mirrored.programs <= plain.programs + 2
    assert mirrored.gap <= 1e-3


@pytest.mark.parametrize("less", [None, 1.5])
def test_where_images_of_multipliers_prove_less_a_program_of_its_own_is_solved(less):
    """By rounding, they may prove nothing: the bound is then the one without the mirror."""

    class Unproved(QuadraticForms):
        def proved_by(self, multipliers, theta):
            found = super().proved_by(multipliers, theta)
            return None if less is None or found is None else replace(found, value=less * found.value)

    pair = section_6()
    asked = {"gap": 1e-9, "programs": 3}  # for one division, in two images of each other
    found = enclose(pair, Unproved(pair, vf.measure(pair)), THETA, **asked)
    mirrored = enclose(pair, QuadraticForms(pair, vf.measure(pair)), THETA, **asked)
    assert (mirrored.programs, found.programs) == (2, 3)
    assert found.upper.value == pytest.approx(mirrored.upper.value, rel=1e-6)
    assert found.upper.value < found.whole.value
