"""
Up to which friction is the solution unique?
============================================

Below the threshold k_s at most one solution exists, whatever the loads are. The constants of the mesh
give it. The stiffer the body that gets the forces, the less friction is allowed: the picture
has k_s over its modulus, with the moduli of the other body fixed.
"""

from matplotlib.figure import Figure

import verification as vf

coarse = vf.example("section6-60")
stiffness = [10000, 20000, 40000, 80000, 160000]
found = [vf.measure(coarse.changed(young=(E, 20000))).friction_threshold.value for E in stiffness]
print("k_s from", round(found[0], 3), "to", round(found[-1], 3))
assert found == sorted(found, reverse=True)
figure = Figure(layout="constrained")
ax = figure.subplots()
ax.semilogx(stiffness, found, "o-")
ax.set(xlabel="E of the body that gets the forces / MPa", ylabel="threshold k_s", ylim=(0, None))
figure.savefig("unique.png")
