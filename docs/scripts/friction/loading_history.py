"""
A loading history
=================

The upper plate is pressed down, pushed to the right and pulled back. It returns to its place, but the
shear force does not return to zero: friction remembers the path. ``vf.march`` follows the path in
increments, each of them a run.
"""

import verification as vf

done = vf.march(vf.example("history"))
forces = [each.contact.force["tangential"] for each in done.increments]
for each, force in zip(done.increments, forces, strict=True):
    print(f"time {each.time:.2f}: {each.iterations} steps, shear force {force:8.2f} MPa mm")
assert abs(forces[-1]) > 0.1 * max(map(abs, forces)) > 0
assert abs(forces[1]) < 1e-6
figure = done.plot()
figure.savefig("loading_history.png")
