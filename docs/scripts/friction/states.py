"""
States of the nodes over time
=============================

Each contact node sticks, slips or is open, in each increment of the history. While the plate is pushed
more and more nodes slip. When the push turns back all of them stick at first. So
a step of a history must end where the motion reverses.
"""

import verification as vf

done = vf.march(vf.example("history"))
slipping = [each.contact.pattern["slip"] for each in done.increments]
print(slipping, "nodes slip")
assert slipping[2] < slipping[3] < slipping[4]
assert slipping[5] == 0
figure = done.plot(view="states")
figure.savefig("states.png")
