"""
Theta from a convergence log
============================

Any code writes the residual of each step. From the log and its theta ``vf.advise_logs`` finds the
eigenvalue behind the rate, and the next theta to use. The log here falls by 0.8 at theta = 0.45.
Without friction rho is at least (1 + 0.8)/0.45 - 1 = 3, and about that if all nodes stay closed.
"""

import tempfile
from pathlib import Path

from matplotlib.figure import Figure

import verification as vf

residuals = [0.8**step for step in range(40)]
with tempfile.TemporaryDirectory() as folder:
    log = Path(folder) / "residuals.txt"
    log.write_text("\n".join(f"{value:.8e}" for value in residuals))
    advice = vf.advise_logs([(log, "0.45")])
print("rho", round(advice.best.rho.value, 3), "next theta", advice.theta)
assert abs(advice.best.rho.value - 3) < 1e-6
figure = Figure(layout="constrained")
ax = figure.subplots()
ax.semilogy(residuals, label="the log, theta = 0.45")
ax.semilogy([advice.best.rate_predicted**step for step in range(40)], label=f"expected, theta = {advice.theta}")
ax.set(xlabel="step", ylabel="residual", ylim=(1e-12, 2))
ax.legend()
figure.savefig("from_a_log.png")
