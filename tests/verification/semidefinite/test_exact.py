"""The Lipschitz constant of T between two bounds, held to all pieces of T where these can be counted."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from chain_problems import case, every_piece, few_nodes
from problem_list import blocks, small
from strategies import AT_NIGHT

import verification as vf
from verification.semidefinite import LMIError, interior_point
from verification.semidefinite.conditions import Pieces
from verification.semidefinite.interior_point import Stop
from verification.semidefinite.lipschitz import Leaf, budget, enclose
from verification.semidefinite.multipliers import QuadraticForms

THETA, SECTION_6 = 0.7, vf.Problem.from_dict(small())


def sides(piece):
    """eps on a piece: the sign of ``p_T v_T`` against ``w k zeta v_T`` where a node slides, 0 where it sticks."""
    return piece.pattern.sliding * piece.sign


@pytest.mark.parametrize("index", range(10 if AT_NIGHT else 4))
def test_the_largest_norm_of_all_pieces_lies_between_the_bounds(index):
    pair, measured, theta, _ = case(few_nodes(index, 2))
    most = max(piece.factor(theta) for piece in every_piece(pair))
    found = enclose(pair, QuadraticForms(pair, measured), theta, gap=1e-6, programs=None)
    assert found.lower <= most * (1 + 1e-9)
    assert most <= found.upper.value
    assert found.upper.value <= most * (1 + 1e-4)
    assert found.piece.factor(theta) == found.lower


@pytest.mark.parametrize("index", range(5 if AT_NIGHT else 3))
def test_with_all_signs_fixed_the_multipliers_bound_the_pieces_with_these_signs(index):
    """They are not attained always: at seed 27 they prove 1.37 where no piece has more than 0.86."""
    pair, measured, theta, _ = case(few_nodes(index, 2))
    forms, pieces = QuadraticForms(pair, measured), list(every_piece(pair))
    for signs in product((1, -1), repeat=pair.contact.grid.t):
        eps = np.array(signs, dtype=np.int8)
        most = max(piece.factor(theta) for piece in pieces if ((sides(piece) == eps) | (sides(piece) == 0)).all())
        assert most <= forms.on(replace(forms.everywhere, signs=eps), theta)[0].value


def test_a_sign_that_a_piece_does_not_have_proves_less_than_the_piece_shows():
    """Else the test above could not fail."""
    below = 0
    for index in range(10):
        pair, measured, theta, _ = case(few_nodes(index, 2))
        forms = QuadraticForms(pair, measured)
        worst = max(every_piece(pair), key=lambda piece: piece.factor(theta))
        signs = np.where(sides(worst) != 0, -sides(worst), 1).astype(np.int8)
        if sides(worst).any():
            proved = forms.on(replace(forms.everywhere, signs=signs), theta)[0].value
            below += proved < worst.factor(theta) * (1 - 1e-6)
        if below > 2:
            break
    assert below > 2


@pytest.mark.parametrize("index", range(5 if AT_NIGHT else 3))
def test_on_a_single_piece_the_multipliers_prove_its_norm(index):
    pair, measured, theta, random = case(few_nodes(index, 2))
    forms, pieces = QuadraticForms(pair, measured), list(every_piece(pair))
    for i in random.integers(len(pieces), size=4):
        pattern, eps = pieces[i].pattern, sides(pieces[i])
        alone = Pieces(
            signs=np.where(eps != 0, eps, 1).astype(np.int8),
            normal=np.where(pattern.touching, 1, -1).astype(np.int8),
            slip=np.where(eps != 0, 1, -1).astype(np.int8),
        )
        proved = forms.on(alone, theta)[0].value
        assert pieces[i].factor(theta) <= proved <= pieces[i].factor(theta) * (1 + 1e-3)


@pytest.mark.parametrize("index", range(4 if AT_NIGHT else 2))
def test_to_fix_something_never_proves_more_than_its_parent_and_one_of_both_proves_as_much_as_a_piece(index):
    pair, measured, theta, random = case(few_nodes(index, 2))
    forms, n = QuadraticForms(pair, measured), pair.contact.grid.t
    parent = forms.factor(theta).value
    most = max(piece.factor(theta) for piece in every_piece(pair))
    node = int(random.integers(n))
    for name in ("signs", "normal"):
        children = [forms.on(forms.everywhere.where(name, node, value), theta)[0].value for value in (1, -1)]
        assert max(children) <= parent * (1 + 1e-6)
        assert max(children) >= most


def test_without_friction_the_first_program_is_attained():
    for seed in range(0, 12, 3):
        pair, measured, theta, _ = case(seed, friction=0)
        found = enclose(pair, QuadraticForms(pair, measured), theta, gap=1e-6, programs=None)
        assert found.programs == 1
        assert found.gap < 1e-6


def two_blocks(**changes):
    data = blocks(cells=((6, 2), (6, 2)), contact={"friction": "1/2", "radius": "1/4"}, iteration={"theta": "1/2"})
    return vf.Problem.from_dict(data).changed(**changes)


def test_an_answer_is_the_same_each_time_more_programs_come_closer_and_no_node_is_divided_twice_in_one_way():
    def paths(tree, before):
        if isinstance(tree, Leaf):
            return [before]
        return [path for part in tree.cases for path in paths(part, [*before, (tree.name, tree.node)])]

    pair = vf.build(two_blocks())
    forms = QuadraticForms(pair, vf.measure(pair))
    one, two = (enclose(pair, forms, 0.5, gap=1e-9, programs=5) for _ in range(2))
    assert (one.upper.value, one.lower, one.programs) == (two.upper.value, two.lower, two.programs)
    assert one.programs <= 5
    assert one.gap > 1e-9
    more = enclose(pair, forms, 0.5, gap=1e-9, programs=12)
    assert more.programs > one.programs
    assert more.upper.value <= one.upper.value
    assert more.lower >= one.lower
    found = paths(more.tree, [])
    assert max(map(len, found)) > 2
    assert all(len(path) == len(set(path)) for path in found)


def leaves(tree):
    """The sets of pieces into which all were divided."""
    return [tree] if isinstance(tree, Leaf) else [leaf for part in tree.cases for leaf in leaves(part)]


class Loose(QuadraticForms):
    """Proofs that are worse for a part of the pieces than for all of them, as a solver's may be, or none."""

    times: float

    def on(self, pieces, theta, **given):
        upper, proposal = super().on(pieces, theta, **given)
        if pieces.key == self.everywhere.key:
            return upper, proposal
        if self.times == np.inf:
            raise LMIError("no multipliers")
        return replace(upper, value=self.times * upper.value), proposal


@pytest.mark.parametrize("times", [2.0, np.inf])
def test_what_is_proved_of_all_pieces_holds_for_a_part_of_which_less_is_proved(times):
    pair = vf.build(two_blocks())
    forms = Loose(pair, vf.measure(pair))
    forms.times = times
    found = enclose(pair, forms, 0.5, gap=1e-9, programs=7)
    parts = leaves(found.tree)
    assert len(parts) > 1
    for leaf in parts:
        assert leaf.upper.value == pytest.approx(found.whole.value, rel=1e-9)
        assert leaf.proved_on.key == forms.everywhere.key  # its multipliers are for all signs


def test_fewer_programs_are_allowed_the_larger_the_interface():
    assert [budget(n) for n in (2, 13, 25, 100)] == sorted((budget(n) for n in (2, 13, 25, 100)), reverse=True)
    assert budget(100) == 1


def test_a_comparison_carries_both_bounds_and_they_come_closer_when_asked(known_bounds):
    quick, exact = (vf.compare(SECTION_6, exact=exact).to_dict()["lmi"] for exact in (False, True))
    for found in (quick, exact):
        assert found["gap"] == pytest.approx(found["lipschitz"]["value"] / found["lower"] - 1)
        assert found["lower"] <= found["lipschitz"]["value"]
    assert exact["gap"] <= 1e-3
    assert exact["lipschitz"]["value"] <= quick["lipschitz"]["value"]


def test_from_the_start_of_a_parent_the_solver_comes_to_the_same_bound_in_fewer_steps():
    pair = vf.build(vf.example("section6").changed(cells=((10, 2), (6, 2)), friction=0.4))
    forms = QuadraticForms(pair, vf.measure(pair))
    parent = forms.everywhere.where("signs", 6, 1).where("normal", 0, 1).where("normal", 2, -1)
    steps = []  # of one program alone they may change by dozens with the last digit of E
    for pieces in (forms.everywhere, parent.where("slip", 6, -1)):
        parent, proposal = pieces, forms.on(pieces, THETA)[1]
        for change in ((3, 1), (1, -1), (4, -1)):
            pieces = parent.where("signs", *change)
            cold, near = forms.on(pieces, THETA), forms.on(pieces, THETA, parent=(parent, proposal))
            assert near[0].value == pytest.approx(cold[0].value, rel=1e-6)
            steps.append((near[1].steps, cold[1].steps))
            parent, proposal = pieces, near[1]
    assert all(near < cold for near, cold in steps[:3]), steps
    fewer, more = np.sum(steps, axis=0)
    assert fewer < more, steps


def test_a_set_of_pieces_is_bounded_no_closer_than_is_enough_by_one_program():
    pair = vf.build(vf.example("section6").changed(cells=((10, 2), (6, 2)), friction=0.4))
    solved = []

    def solve(program):
        solved.append(interior_point.solve(program))
        return solved[-1]

    forms = QuadraticForms(pair, vf.measure(pair), solver=solve)
    parent, pieces = forms.everywhere, forms.everywhere.where("signs", 3, 1)
    for start in (None, (parent, forms.on(parent, THETA)[1])):
        least, closest = forms.on(pieces, THETA, parent=start)
        solved.clear()
        stop = Stop(accuracy=0.0, enough=(1.1 * least.value) ** 2)
        found, proposal = forms.on(pieces, THETA, stop=stop, parent=start)
        assert least.value < found.value < 1.1 * least.value
        assert proposal.steps < closest.steps
        assert solved == [proposal]
