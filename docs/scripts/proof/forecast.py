"""
Half a run predicts its end
===========================

Once no node changes its state any more, a step multiplies the error by a matrix. ``linearise`` finds it
half-way, at the step where the residual has fallen to the root of the tolerance, and forecasts the
last step from it.
"""

from matplotlib.figure import Figure

import verification as vf

run = vf.run(vf.example("section6").changed(cells=((20, 3), (12, 3)))).linearise()
said = run.forecast
print(f"at step {said.made_at_iteration}: will end at step {said.iterations}; it took {run.iterations}")
assert said.iterations == run.iterations
figure = Figure(layout="constrained")
ax = figure.subplots()
ax.semilogy(run.history, "o-", label="the run")
rest = range(said.iterations - said.made_at_iteration + 1)
begin = run.history[said.made_at_iteration]
ax.semilogy([said.made_at_iteration + n for n in rest], [begin * said.rate**n for n in rest], "--", label="its rate")
ax.set(xlabel="step", ylabel="residual")
ax.legend()
figure.savefig("forecast.png")
