"""
A run in five lines
===================

Two plates press on each other with friction, and the iteration computes one plate at a time: here it
converges in 18 steps. The residual is the change of the forces in a step without relaxation. Each
step multiplies it by about 0.3.
"""

import verification as vf

run = vf.run(vf.example("section6-60"))
assert (run.iterations, f"{run.observed_rate.value:.1f}") == (18, "0.3")
figure = run.plot()
figure.savefig("five_lines.png")
