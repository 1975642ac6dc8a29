"""
Theta from two matrices
=======================

Any finite element code can condense its bodies to the contact boundary. ``vf.advise_matrices`` takes
both stiffness matrices and finds the roles, the ratio rho and theta. Two strings with
100 points, one of them three times as stiff: rho is 3 one way, and 1/3 the other way.
"""

import numpy as np

import verification as vf

n = 100
string = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
advice = vf.advise_matrices(3 * string, string)
print("forces on body", advice.neumann_body, "with theta", round(advice.theta, 4))
assert abs(advice.best.rho.value - 1 / 3) < 1e-9
assert abs(advice.theta - 2 / (2 + 1 / 3)) < 1e-3
figure = advice.plot()
figure.savefig("from_matrices.png")
