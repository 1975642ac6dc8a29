"""
Theta from a convergence log
============================

A log falls by 0.8 a step at theta = 0.45. Without friction rho is at least (1 + 0.8)/0.45 - 1 = 3, about that if all
nodes stay closed. The best theta depends on the softest mode too, so the answer asks for a second run, at 0.316. Its
log, by 0.684 a step, shows a mode with lambda = 0: an open node. The dashed line has the predicted factor.
"""

import tempfile
from pathlib import Path

from matplotlib.figure import Figure

import verification as vf
from ndtheory.energy_norms import predicted_factor

runs = {"0.45": 0.8, "0.316": 0.684}
with tempfile.TemporaryDirectory() as folder:
    logs = [(Path(folder) / f"{theta}.txt", theta) for theta in runs]
    for log, theta in logs:
        log.write_text("\n".join(f"{runs[theta] ** step:.8e}" for step in range(40)))
    assert vf.advise_logs(logs[:1]).theta is None
    advice = vf.advise_logs(logs)
print("rho", round(advice.best.rho.value, 3), "next theta", advice.theta)
assert abs(advice.best.rho.value - 3) < 0.05
assert abs(advice.theta - 0.4) < 0.01
figure = Figure(layout="constrained")
ax = figure.subplots()
for theta, ratio in runs.items():
    ax.semilogy([ratio**step for step in range(40)], label=f"a log, theta = {theta}")
factor = predicted_factor(advice.theta, advice.best.rho.value)
ax.semilogy([factor**step for step in range(40)], "--", label=f"predicted, theta = {advice.theta}")
ax.set(xlabel="step", ylabel="residual", ylim=(1e-12, 2))
ax.legend()
figure.savefig("from_a_log.png")
