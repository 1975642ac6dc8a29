"""
The same answer without the iteration
=====================================

``vf.solve`` computes both bodies at once and shares no step with the iteration. Both find the
same pressure: it differs by less than a millionth of its largest value. The picture has both along
the contact.
"""

import numpy as np
from matplotlib.figure import Figure

import verification as vf

problem = vf.example("section6").changed(cells=((20, 3), (12, 3)))
run, whole = vf.run(problem).contact, vf.solve(problem).contact
apart = np.abs(run.pressure - whole.pressure).max() / whole.pressure.max()
print(f"largest difference {apart:.0e} of the largest pressure")
assert apart < 1e-6
figure = Figure(layout="constrained")
ax = figure.subplots()
ax.plot(whole.x, whole.pressure, label="both at once")
ax.plot(run.x, run.pressure, "o", label="by the iteration")
ax.set(xlabel="x / mm", ylabel="pressure / MPa")
ax.legend()
figure.savefig("both_at_once.png")
