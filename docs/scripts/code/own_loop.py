"""
The loop stays yours
====================

Where another program owns the loop, a ``vf.Coupling`` gives the next force and nothing else. It
also tests whether both solvers agree, and its vectors advise a theta for the next time. With an
interface this stiff IQN-ILS arrives, and the constant theta that it starts from diverges.
"""

import numpy as np
from matplotlib.figure import Figure

import verification as vf

stiffness = np.linspace(1, 30, 40)
figure = Figure(layout="constrained")
ax = figure.subplots()
for rule in ("constant", "iqn-ils"):
    coupling, force, residuals = vf.Coupling(rule=rule, theta=0.1, kind="tied"), np.zeros(40), []
    for _ in range(60):
        image = stiffness * (0.1 - force)
        residuals.append(np.linalg.norm(image - force))
        force = coupling.next(force, image)
        if coupling.arrived:
            break
    ax.semilogy(residuals, "o-", label=rule)
    print(rule, len(residuals), "evaluations, arrived:", coupling.arrived)
assert coupling.arrived
assert residuals[-1] < 1e-5
print("theta for next time:", coupling.advice.theta)
ax.set(xlabel="step", ylabel="residual")
ax.legend()
figure.savefig("own_loop.png")
