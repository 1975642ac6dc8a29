"""
The work that friction takes
============================

The same history, now with the work of friction up to each increment. Pressing takes a little, since
the plates stretch by different amounts. The push to the side takes most. At first on the way back
nodes only stick, and friction takes nothing.
"""

from itertools import accumulate, pairwise

from matplotlib.figure import Figure

import verification as vf

done = vf.march(vf.example("history"))
work = [0, *accumulate(each.dissipated for each in done.increments)]
parts = {step: work[last] - work[first] for step, first, last in (("press", 0, 2), ("push", 2, 5), ("back", 5, 8))}
print({step: f"{part:.4f} MPa mm^2" for step, part in parts.items()})
assert max(parts, key=parts.get) == "push"
assert all(before <= after for before, after in pairwise(work))
assert work[6] - work[5] < 1e-9
figure = Figure(layout="constrained")
ax = figure.subplots()
ax.plot([0, *(each.time for each in done.increments)], work, "o-")
ax.set(xlabel="time", ylabel="work of friction / (MPa mm²)", ylim=(0, None))
figure.savefig("work.png")
