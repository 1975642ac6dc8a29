"""What evidence says, in short: of which claim it speaks, and whether that holds."""

PRINTED, STEP, REPAIRED = "printed", "step", "repaired"
HOLDS = [(PRINTED, True)]


def holds(evidence):
    return [(e.of, e.holds) for e in evidence]
