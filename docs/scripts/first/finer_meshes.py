"""
What changes on finer meshes?
=============================

``vf.measure(problem, refine=2)`` measures the constants on three meshes. The ratio of stiffnesses
rho, which decides on theta, grows here. It is a largest value over all displacements of the mesh, and a
finer mesh has more of them; but the stiffness of each falls, so on other bodies rho may fall too.
"""

from matplotlib.figure import Figure

import verification as vf

levels = vf.measure(vf.example("section6-60"), refine=2).levels
rho = [level.rho_max.value for level in levels]
print("rho on three meshes:", [round(value, 4) for value in rho])
assert rho[0] < rho[1] < rho[2]
figure = Figure(layout="constrained")
ax = figure.subplots()
ax.plot([level.interface_nodes for level in levels], rho, "o-")
ax.set(xlabel="nodes on the contact boundary", ylabel="rho", ylim=(0, None))
figure.savefig("finer_meshes.png")
