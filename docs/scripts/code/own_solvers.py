"""
Your own two solvers
====================

``vf.couple`` takes two functions: forces to displacements, and displacements to forces. They may call
any program. Here they are a few springs; the coupling finds the common force, and
from its vectors the eigenvalues and the theta to use next time.
"""

import numpy as np

import verification as vf

soft, stiff = np.array([1.0, 2.0, 4.0]), np.array([3.0, 3.0, 3.0])
pushed = np.array([0.1, 0.1, 0.1])
coupled = vf.couple(
    lambda force: force / stiff - pushed,
    lambda displacement: -soft * displacement,
    start=np.zeros(3), kind="tied",
)  # fmt: skip
print(coupled)
assert coupled.converged
assert np.allclose(coupled.force, pushed / (1 / soft + 1 / stiff), rtol=1e-5)
assert abs(coupled.spectrum.high - 4 / 3) < 1e-3
figure = coupled.advice.plot()
figure.savefig("own_solvers.png")
