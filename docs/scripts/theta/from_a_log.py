"""
Theta from a convergence log
============================

The log here falls by 0.8 at theta = 0.45. Without friction rho is at least (1 + 0.8)/0.45 - 1 = 3, and about
that if all nodes stay closed. 2/(2 + rho) = 0.4 would be the best theta for just this rho; the advised one is
smaller, and safe for what the log leaves open. The second line has the factor that is predicted there.
"""

import tempfile
from pathlib import Path

from matplotlib.figure import Figure

import verification as vf
from ndtheory.energy_norms import predicted_factor

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
factor = predicted_factor(advice.theta, advice.best.rho.value)
ax.semilogy([factor**step for step in range(40)], label=f"predicted, theta = {advice.theta}")
ax.set(xlabel="step", ylabel="residual", ylim=(1e-12, 2))
ax.legend()
figure.savefig("from_a_log.png")
