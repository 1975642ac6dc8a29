"""
A law of friction of your own
=============================

A law says by a matrix how the pressure bounds friction. The kernel of this one falls off like an
exponential, where the built-in one is a hat. The run obeys it: no node has more shear than
this bound, the dashed line.
"""

import numpy as np
from matplotlib.figure import Figure

import verification as vf


class Exponential(vf.Law):
    name = label = words = "exponential"
    radius = 0.1

    def operator(self, interface):
        t = np.abs(interface.contact.x[:, None] - interface.neumann.x[None, :])
        return np.exp(-t / self.radius) / (2 * self.radius)


pair = vf.build(vf.example("section6").changed(cells=((20, 3), (12, 3))), law=Exponential())
run = vf.run(pair, theta="1/2")
shear = np.abs(run.last.contact.force[pair.contact.grid.tangential])
bound = pair.bound(run.last.g)
assert run.converged
assert (shear <= bound * (1 + 1e-6)).all()
figure = Figure(layout="constrained")
ax = figure.subplots()
ax.plot(run.contact.x, bound, "--", label="bound")
ax.plot(run.contact.x, shear, "o", label="shear")
ax.set(xlabel="x / mm", ylabel="nodal force / (MPa mm)")
ax.legend()
figure.savefig("own_law.png")
