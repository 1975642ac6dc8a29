"""
Which body gets the forces?
===========================

One body is loaded with the forces, the other one is pushed against its shape. ``vf.advise`` measures
both assignments. Given to the stiffer lower plate, the forces settle in far fewer
steps than given to the softer upper one, each at the theta predicted as its best.
"""

from matplotlib.figure import Figure

import verification as vf

problem = vf.example("section6").changed(cells=((20, 3), (12, 3)))
advice = vf.advise(problem)
figure = Figure(layout="constrained")
ax = figure.subplots()
for role in advice.roles:
    given = problem.changed(neumann_body=role.neumann_body)
    run = vf.run(given, theta=f"{role.theta_predicted:.4f}")
    ax.semilogy(run.history, label=f"forces on body {role.neumann_body}: {run.iterations} steps")
ax.set(xlabel="step", ylabel="residual")
ax.legend()
print("advised:", advice.neumann_body)
assert advice.neumann_body == 1
figure.savefig("which_side.png")
