"""
Steps promised, steps taken
===========================

Without friction a theorem bounds the factor of each step, for all forces. It promises steps for the
worst of them, and none of these runs, with one load each, takes more. The promise is best at theta = 2/(2 + rho_N),
the dotted line.
"""

import math

from matplotlib.figure import Figure

import verification as vf
from ndtheory.energy_norms import predicted_factor, predicted_theta

problem = vf.example("section6-60").changed(friction=0)
rho = vf.measure(problem).rho_normal.value
thetas = [0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95]
promised = [math.ceil(math.log(1e-9) / math.log(predicted_factor(theta, rho))) for theta in thetas]
taken = [vf.run(problem, theta=theta).iterations for theta in thetas]
print("promised", promised, "taken", taken)
assert all(few <= many for few, many in zip(taken, promised, strict=True))
figure = Figure(layout="constrained")
ax = figure.subplots()
ax.plot(thetas, promised, "s--", label="promised for all forces")
ax.plot(thetas, taken, "o-", label="taken with this load")
ax.axvline(predicted_theta(rho), linestyle=":", color="0.4")
ax.set(xlabel="relaxation factor theta", ylabel="steps to 1e-9", ylim=(0, None))
ax.legend()
figure.savefig("promise.png")
