"""Several contacts as one Gamma_c: where the nodes of each lie on it, and with which friction each enters."""

import numpy as np
import pytest

import verification as vf


def stack(first, second):
    data = vf.example("stack").to_dict()
    data["contact"][0]["friction"], data["contact"][1]["friction"] = first, second
    return vf.build(vf.Problem.from_dict(data))


def lines(pair):
    """The stretches of Gamma_c on the contact grid."""
    return [stretch.contact for stretch in pair.interface.lines]


def test_the_positions_of_each_contact_begin_one_edge_behind_the_end_of_the_last():
    pair = stack("0.3", "0.2")
    x = pair.contact.grid.x
    first, second = (x[line] for line in lines(pair))
    assert (x[0], first[-1]) == (0, 2)
    assert second[0] - first[-1] == np.diff(first).max()
    assert np.diff(second) == pytest.approx(np.diff(first))
    assert (np.diff(x) > 0).all()


def test_each_contact_has_its_own_friction_bound_under_the_same_forces():
    """The bound is ``w_j k_i |(S sigma_N)_j|``, k_i of its contact, whichever has the larger one."""
    force = np.zeros(stack("0.3", "0.3").neumann.grid.size)
    force[len(force) // 2 :] = -1.0
    even = stack("0.3", "0.3").bound(force)
    for k in (("0.3", "0.1"), ("0.1", "0.3"), ("0.3", "0")):
        pair = stack(*k)
        found = pair.bound(force)
        for line, own in zip(lines(pair), k, strict=True):
            assert found[line] == pytest.approx(even[line] * float(own) / 0.3, rel=1e-12)
