"""What the tests of `advise` share: the keys of a role, matrices in files, and the theta to paste."""

import re

import numpy as np

ROLE = {
    "neumann_body",
    "rho",
    "theta_proved",
    "factor_proved",
    "theta_max_proved",
    "theta_predicted",
    "rate_predicted",
    "friction_threshold",
    "singular",
}
PROVED = {"theta_proved", "factor_proved", "theta_max_proved", "friction_threshold"}


def saved(folder, name: str, matrix, how=np.savez):
    path = folder / f"{name}.npz"
    how(path, matrix)
    return path


def by_body(document):
    return {role["neumann_body"]: role for role in document["roles"]}


def pasted(screen: str) -> str:
    """The theta below the last heading, the same in both lines to paste."""
    place = screen.partition("TO PASTE\n")[2]
    plain = re.search(r"^ +theta = (\S+)$", place, flags=re.M)[1]
    factor = re.search(r'<acceleration:\S+?><(?:initial-)?relaxation value="(\S+)" />', place)[1]
    assert factor == plain
    return plain


GOOD = np.diag([1.0, 2.0, 3.0])
