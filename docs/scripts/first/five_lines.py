"""
A run in five lines
===================

Two plates press on each other with friction, and the iteration computes one plate at a time. On this
coarse mesh of the paper's model it converges in 18 steps. Each step multiplies the residual, the
difference of the forces before and after it, by about 0.3.
"""

import verification as vf

run = vf.run(vf.example("section6-60"))
print(run.outcome, "after", run.iterations, "steps, rate", round(run.observed_rate.value, 3))
assert run.iterations == 18
assert abs(run.observed_rate.value - 0.3) < 0.02
figure = run.plot()
figure.savefig("five_lines.png")
