"""
The rate over theta is a V
==========================

Without friction the observed rate over theta falls along one line and rises along another.
Where they meet the iteration is fastest. For bars that touch this is theta = 1/(1 + rho), here 1/4,
with the exact solution after one step; the runs start with the bars apart.
"""

import numpy as np
from matplotlib.figure import Figure

import verification as vf

bars = vf.example("two-bars")
rho = vf.measure(bars).rho_max.value
thetas = [0.05, 0.1, 0.15, 0.2, 0.3, 0.35, 0.4, 0.45]
rates = [vf.run(bars, theta=theta).observed_rate.value for theta in thetas]
line = np.linspace(0, 0.5, 51)
figure = Figure(layout="constrained")
ax = figure.subplots()
ax.plot(line, abs(1 - line * (1 + rho)), label="|1 - theta (1 + rho)|")
ax.plot(thetas, rates, "o", label="observed")
ax.set(xlabel="relaxation factor theta", ylabel="rate")
ax.legend()
assert np.allclose(rates, abs(1 - np.array(thetas) * (1 + rho)), atol=1e-6)
figure.savefig("rate_over_theta.png")
