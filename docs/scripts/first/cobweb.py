"""
Two bars, step by step
======================

``vf.iterate`` makes one step after another and leaves it to you when to stop. Between two bars
there is a single force. With theta = 9/10 it keeps jumping, here for 25 steps; with theta = 2/5 it
alternates around the solution and comes closer.
"""

from itertools import islice

from matplotlib.figure import Figure

import verification as vf

bars = vf.example("two-bars")
figure = Figure(layout="constrained")
ax = figure.subplots()
for theta in ("9/10", "2/5"):
    forces = [step.g[0] for step in islice(vf.iterate(bars, theta=theta), 25)]
    ax.plot(forces, "o-", label=f"theta = {theta}")
    print(theta, [f"{force:.3f}" for force in forces[-3:]])
assert abs(forces[-1] - 0.075) < 1e-3
ax.set(xlabel="step", ylabel="force g / Pa")
ax.legend()
figure.savefig("cobweb.png")
