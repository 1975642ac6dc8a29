"""
The printed theorem depends on the unit of stress
=================================================

The theorem as printed and as repaired, with the same two bodies. Writing the same stresses in
another unit changes the friction that the printed edition allows by powers of ten. It leaves the
repaired edition where it is.
"""

from matplotlib.figure import Figure

import verification as vf
from ndtheory import PRINTED, REPAIRED, Constants, evaluate

c = vf.measure(vf.example("section6-60")).constants()
units = [10**n for n in range(-2, 7)]
figure = Figure(layout="constrained")
ax = figure.subplots()
for edition, style in ((PRINTED, "s--"), (REPAIRED, "o-")):
    found = []
    for unit in units:
        same = Constants(m=c.m / unit, M=c.M / unit, C_R=c.C_R, C_K=c.C_K / unit)
        found.append(evaluate(edition, same).C2.value * unit / float(c.C_K))
    print(edition.name, f"{min(found):.1e} to {max(found):.1e}")
    ax.loglog(units, found, style, label=edition.name)
assert max(found) < 1.001 * min(found)
ax.set(xlabel="unit of stress / MPa", ylabel="allowed C_K / actual C_K")
ax.legend()
figure.savefig("units.png")
