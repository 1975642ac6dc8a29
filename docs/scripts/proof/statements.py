"""
Which statements of the paper hold?
===================================

The ledger checks the numbered statements of the paper, and some of ours, one by one. Here it checks three
again: one is proved as printed, and one after a repair. The picture counts the recorded verdicts
of all statements.
"""

from collections import Counter

from matplotlib.figure import Figure

import verification as vf
from ndtheory.statements import recorded

verdicts = {row.statement.id: row.verdict for row in vf.verify(["C1", "5.42", "x-attained"]).rows}
print(verdicts)
assert verdicts["C1"] == "PROVED"
assert verdicts["5.42"] == "REPAIRED"
assert all(recorded()[name] == verdict for name, verdict in verdicts.items())
counts = Counter(recorded().values())
figure = Figure(layout="constrained")
ax = figure.subplots()
ax.bar_label(ax.barh(list(counts), list(counts.values())), padding=3)
ax.set(xlabel="statements")
figure.savefig("statements.png")
