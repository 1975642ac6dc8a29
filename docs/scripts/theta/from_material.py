"""
Theta from the material data
============================

Before there is a mesh, the moduli of two wide bodies bound the ratio of stiffnesses rho, and with
it theta. The softer the body that gets the forces, the smaller theta must be. The picture has
2/(2 + rho) over the ratio of Young's moduli.
"""

import numpy as np
from matplotlib.figure import Figure

import verification as vf

ratios = np.geomspace(0.1, 10, 15)
thetas = []
for ratio in ratios:
    found = vf.advise_moduli(young=(1, f"{ratio:.6f}"), poisson=("0.3", "0.3"))
    rho = next(role.rho.value for role in found.roles if role.neumann_body == 1)
    thetas.append(2 / (2 + rho))
print(f"theta from {thetas[0]:.2f} down to {thetas[-1]:.2f}")
assert thetas == sorted(thetas, reverse=True)
figure = Figure(layout="constrained")
ax = figure.subplots()
ax.semilogx(ratios, thetas, "o-")
ax.set(xlabel="E of the other body / E of the body with the forces", ylabel="theta", ylim=(0, 1))
figure.savefig("from_material.png")
