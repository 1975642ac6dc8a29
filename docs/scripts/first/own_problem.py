"""
A problem of your own
=====================

A problem is a dictionary, or a file with the same keys. A block of aluminium presses on steel with
1 MPa on a width of 2 mm, so the contact force must be 2 MPa mm, and it is. The right side of the block
is held sideways, so that it cannot slide away.
"""

import verification as vf

problem = vf.Problem.from_dict({
    "title": "Aluminium on steel",
    "units": {"length": "mm", "stress": "MPa"},
    "body1": {"shape": "rectangle", "x": [0, 4], "y": [-1, 0], "cells": [16, 4],
              "young": 210000, "poisson": 0.3, "fixed": ["bottom"]},
    "body2": {"shape": "rectangle", "x": [1, 3], "y": [0, 1], "cells": [8, 4],
              "young": 70000, "poisson": 0.3, "traction": {"top": [0, -1]},
              "prescribed": {"right": [0, "free"]}},
    "contact": {"friction": 0, "law": "local"},
    "iteration": {"neumann_body": 1},
})  # fmt: skip
run = vf.run(problem, theta="auto")
print("force", round(run.contact.force["normal"], 6), "MPa mm")
assert abs(run.contact.force["normal"] - 2) < 1e-6
figure = run.plot(view="bodies")
figure.savefig("own_problem.png")
