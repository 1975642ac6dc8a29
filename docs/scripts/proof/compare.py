"""
A run against the bounds
========================

``vf.compare`` measures the constants, evaluates each bound of the theorem, makes a run, and judges.
No bound may lie below a step of the run. A bound that does not apply to this friction says so
and claims nothing.
"""

import verification as vf

found = vf.compare(vf.example("section6").changed(cells=((10, 2), (6, 2)), radius="0.3"))
for name, judgement in found.verdicts.items():
    print(f"{name:11} {judgement.verdict}")
assert "VIOLATED" not in {judgement.verdict for judgement in found.verdicts.values()}
figure = found.plot()
figure.savefig("compare.png")
