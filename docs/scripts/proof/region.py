"""
Where is contraction proved?
============================

In the plane of theta and friction, the theorem in energy norms proves that all runs of the plates
on this mesh converge inside this region. It ends at one friction coefficient, the tip, above which it proves
nothing for any theta.
"""

import numpy as np
from matplotlib.figure import Figure

import verification as vf
from ndtheory.energy_norms import contraction_interval

measured = vf.measure(vf.example("section6").changed(cells=((20, 3), (12, 3))))
tip = measured.friction_limit.value
frictions = np.linspace(0.001, 0.999, 80) * tip
ends = []
for k in frictions:
    at = measured.with_friction(k)
    ends.append(contraction_interval(at.rho_max.value, at.kappa_1.value, at.kappa_2.value))
low, high = np.array(ends, float).T
print(f"the region ends at k = {tip:.3f}")
assert (low < high).all()
assert high[-1] - low[-1] < 0.1 * (high[0] - low[0])
figure = Figure(layout="constrained")
ax = figure.subplots()
ax.fill_betweenx(frictions, low, high, alpha=0.5)
ax.set(xlabel="relaxation factor theta", ylabel="friction coefficient k", xlim=(0, None), ylim=(0, None))
figure.savefig("region.png")
