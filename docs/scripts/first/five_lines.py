"""
A run in five lines
===================

Two plates press on each other with friction, and the iteration computes one plate at a time. On this
coarse mesh of the paper's model it converges in 18 steps. Each step multiplies the residual, the
difference of the forces before and after it, by about 0.3.
"""

import verification as vf

run = vf.run(vf.example("section6-60"))
assert (run.outcome, run.iterations, round(run.observed_rate.value, 1)) == ("converged", 18, 0.3)
figure = run.plot()
figure.savefig("five_lines.png")
