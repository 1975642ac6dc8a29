"""
Stick and slip along the contact
================================

In the middle of the contact nodes stick, and near the edges they slip: there the shear is as large as
friction allows. With more friction fewer nodes slip, and the curves come together where they stick.
Each label counts the nodes that stick, of 25.
"""

from matplotlib.figure import Figure

import verification as vf

figure = Figure(layout="constrained")
ax = figure.subplots()
stuck = []
for friction in ("0.1", "0.2", "0.4"):
    contact = vf.run(vf.example("section6").changed(friction=friction)).contact
    stuck.append(contact.pattern["stick"])
    ax.plot(contact.x, contact.shear, label=f"k = {friction}: {stuck[-1]} nodes stick")
print("nodes that stick:", stuck, "of", len(contact.x))
assert stuck == sorted(stuck)
assert len(contact.x) == 25
ax.set(xlabel="x / mm", ylabel="shear / MPa")
ax.legend()
figure.savefig("stick_slip.png")
