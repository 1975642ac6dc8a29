"""
Both bodies after a run
=======================

A run also draws its bodies: the deformed mesh with arrows where the plates touch, and below it the
pressure and the shear. In the middle the shear is less than friction allows, and the nodes
stick. Near the edges they slip.
"""

import verification as vf

run = vf.run(vf.example("section6").changed(cells=((20, 3), (12, 3))))
print(run.contact.pattern)
assert run.contact.status[6] == "stick"
assert run.contact.status[1] == run.contact.status[-2] == "slip"
figure = run.plot(view="bodies")
figure.savefig("two_bodies.png")
