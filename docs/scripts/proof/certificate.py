"""
A certificate that anyone can check
===================================

``vf.certify`` proves in exact fractions that a step contracts on a mesh. ``vf.check_again`` decides this
anew, only from the numbers in the certificate. It refuses the same certificate with a factor
that is a little too small.
"""

import copy

from matplotlib.figure import Figure

import verification as vf

found = vf.certify(vf.example("section6-60"), theta="0.7")
document = found.to_dict()
false = copy.deepcopy(document)
false["claim"]["factor"] = "1/4"
print(f"proved: at most {float(found.factor):.4f}, and no better than {float(found.lower):.4f}")
print("accepted:", vf.check_again(document).accepted, "and the false one:", vf.check_again(false).accepted)
assert vf.check_again(document).accepted
assert not vf.check_again(false).accepted
figure = Figure(layout="constrained")
ax = figure.subplots()
ax.semilogy([float(found.factor) ** n for n in range(30)], label="proved: error at most")
ax.semilogy([float(found.lower) ** n for n in range(30)], "--", label="no proof can promise less than")
ax.set(xlabel="step", ylabel="error / first error")
ax.legend()
figure.savefig("certificate.png")
