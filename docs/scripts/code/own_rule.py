"""
A rule of your own
==================

A relaxation rule is a class with one method that returns the next force. This one halves theta
whenever the residual grows. It starts from 0.9, with which the run of two bars stalls, and the
run converges. The picture shows that its last theta has the rate 0.8.
"""

import verification as vf


class Halving(vf.Rule):
    name, words = "halving", "theta halved when the residual grows"

    def begin(self, pair, theta, rho):
        state = {"theta": float(theta), "last": float("inf")}

        def step(iterate):
            state["theta"] /= 2 if iterate.residual > state["last"] else 1
            state["last"] = iterate.residual
            return iterate.g + state["theta"] * (iterate.image - iterate.g)

        return step


bars = vf.example("two-bars")
runs = [vf.run(bars, theta="0.9", rule=rule) for rule in (Halving(), "constant")]
print([(run.rule.name, run.outcome, run.iterations) for run in runs])
assert runs[0].converged
assert not runs[1].converged
assert abs(runs[0].observed_rate.value - 0.8) < 0.01
figure = runs[0].plot()
figure.savefig("own_rule.png")
