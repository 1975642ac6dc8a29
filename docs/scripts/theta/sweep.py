"""
Steps over theta and friction
=============================

``vf.sweep`` makes one run for each point of a grid. For each friction coefficient k a small
theta removes the error of the first force slowly. The best theta of the grid is 0.8 or 0.9: it
hardly depends on friction here.
"""

from matplotlib.figure import Figure

import verification as vf

thetas = ["0.3", "0.4", "0.5", "0.6", "0.7", "0.8", "0.9"]
sweep = vf.sweep(vf.example("section6-60"), theta=thetas, friction=["0", "0.2", "0.5"])
assert all(row["outcome"] == "converged" for row in sweep.rows)
figure = Figure(layout="constrained")
ax = figure.subplots()
for friction in (0, 0.2, 0.5):
    rows = [row for row in sweep.rows if row["friction"] == friction]
    steps = [row["iterations"] for row in rows]
    ax.plot([row["theta"] for row in rows], steps, "o-", label=f"k = {friction}")
    print(friction, steps)
    assert min(steps) in steps[-2:]
ax.set(xlabel="relaxation factor theta", ylabel="steps to 1e-9", ylim=(0, None))
ax.legend()
figure.savefig("sweep.png")
