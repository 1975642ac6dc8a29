"""
Heat through two walls
======================

Steel beside insulation: the same theory advises couplings of heat. In the advised roles almost no
relaxation is needed, as insulation hardly changes the temperature of the steel. The picture has
the advised theta over the conductivity of the second wall.
"""

import numpy as np
from matplotlib.figure import Figure

import verification as vf

conductivities = np.geomspace(0.05, 50, 13)
advised = [vf.advise_moduli(conductivity=(50, f"{value:.6f}"), capacity=("3.6e6", "1.6e6")) for value in conductivities]
thetas = [advice.theta for advice in advised]
print("insulation:", thetas[0], "in body", advised[0].neumann_body)
assert thetas[0] > 0.9
assert all(advice.neumann_body == 1 for advice in advised)
figure = Figure(layout="constrained")
ax = figure.subplots()
ax.semilogx(conductivities, thetas, "o-")
ax.set(xlabel="conductivity of wall 2 / (W/(m K)), wall 1 has 50", ylabel="advised theta", ylim=(0, 1))
figure.savefig("heat.png")
