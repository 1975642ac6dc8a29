"""
Vectors of Kratos
=================

Kratos can write the forces before and after each step as VTK files, in single precision. Six pairs are
enough for ``vf.advise_vectors``. Here the plates stand in for Kratos and are rounded like its files. The
theta found is close to 2/(2 + rho_N) from the matrices, the dotted line.
"""

from itertools import islice

import numpy as np
from matplotlib.figure import Figure

import verification as vf

plates = vf.example("section6").changed(cells=((20, 3), (12, 3)), friction=0)
steps = list(islice(vf.iterate(plates, theta="0.5"), 6))
X = np.array([step.g for step in steps], np.float32)
TX = np.array([step.image for step in steps], np.float32)
advice = vf.advise_vectors(X, TX)
best = 2 / (2 + vf.measure(plates).rho_normal.value)
print(f"theta {advice.theta} from vectors, {best:.4f} from matrices")
assert abs(advice.theta - best) < 0.05
thetas = np.linspace(0.3, 0.95, 14)
figure = Figure(layout="constrained")
ax = figure.subplots()
ax.plot(thetas, [vf.run(plates, theta=f"{theta:.3f}").iterations for theta in thetas], "o-", label="steps of a run")
ax.axvline(advice.theta, color="C1", label="theta from the vectors")
ax.axvline(best, linestyle=":", color="0.3", label="2/(2 + rho_N)")
ax.set(xlabel="relaxation factor theta", ylabel="steps to 1e-9", ylim=(0, None))
ax.legend()
figure.savefig("kratos_vectors.png")
