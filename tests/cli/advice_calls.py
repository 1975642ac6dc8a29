"""What the tests of `advise` share: the keys of a role, matrices in files, and the theta to paste."""

import re
import tomllib
from functools import cache

import numpy as np
from problem_list import SMALL, edited

import verification as vf

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


def given(folder, S1, S2, how=np.savez):
    """The words of `advise matrices` for two matrices in files a.npz and b.npz."""
    return ("advise", "matrices", "--S1", saved(folder, "a", S1, how), "--S2", saved(folder, "b", S2, how))


@cache
def wrong_roles():
    """The advice for the small problem with its roles exchanged, and the matrices of bodies 1 and 2."""
    problem = vf.Problem.from_dict(tomllib.loads(edited(SMALL, {"iteration.neumann_body": "2"})))
    pair = vf.build(problem)
    return vf.advise(problem).to_dict(), (pair.contact.schur, pair.neumann.schur)


def fits(lines):
    """A screen of 80 columns and 46 lines; the last line may name a file."""
    assert max(map(len, lines[:-1])) <= 80
    assert len(lines) <= 46


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
