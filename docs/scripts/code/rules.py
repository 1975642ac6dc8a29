"""
Rules of relaxation, side by side
=================================

With the forces on the soft plate a constant theta takes many steps. Aitken's rule and Anderson's
take fewer, and Newton's the fewest, but each of its steps also needs a derivative. No theorem covers
these three rules.
"""

from matplotlib.figure import Figure

import verification as vf

problem = vf.example("section6").swapped().changed(cells=((20, 4), (12, 4)), theta="0.15")
figure = Figure(layout="constrained")
ax = figure.subplots()
steps = {}
for rule in ("constant", "aitken", "anderson", "newton"):
    run = vf.run(problem, rule=rule)
    assert run.converged
    steps[rule] = run.iterations
    ax.semilogy(run.history, label=f"{rule}: {run.iterations} steps")
print(steps)
assert max(steps, key=steps.get) == "constant"
assert min(steps, key=steps.get) == "newton"
ax.set(xlabel="step", ylabel="residual")
ax.legend()
figure.savefig("rules.png")
