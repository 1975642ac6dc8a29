"""A small problem, whose results the tests of files and of the report write."""

from problem_list import small

import verification as vf

ONE_STEP = {"theta": "0.7", "max_iterations": 1}


def problem(**changes):
    return vf.Problem.from_dict(small() | {"title": "Small"} | changes)
