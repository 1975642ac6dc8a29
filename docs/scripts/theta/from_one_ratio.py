"""
Theta from one number
=====================

A run at theta = 0.1 multiplied its residual by 1.4 in each step. Either a mode grows, or contact opens
and closes. Without friction each reading bounds rho from below only: the next theta is small enough
if rho is the least value of its reading. The picture shows the factor of this value over theta.
"""

import numpy as np
from matplotlib.figure import Figure

import verification as vf

advice = vf.advise_run("0.1", "1.4")
theta = np.linspace(0, 0.12)
figure = Figure(layout="constrained")
ax = figure.subplots()
for reading in advice.readings:
    print(reading.kind, "rho >=", reading.lo)
    ax.plot(theta, abs(1 - theta * (1 + reading.lo)), label=f"{reading.kind}: rho = {reading.lo:g}, the least")
    assert abs(1 - advice.next.theta * (1 + reading.lo)) < 1
ax.axvline(advice.next.theta, linestyle=":", color="0.3", label=f"next run: theta = {advice.next.theta}")
ax.set(xlabel="relaxation factor theta", ylabel="factor of the mode")
ax.legend()
figure.savefig("from_one_ratio.png")
