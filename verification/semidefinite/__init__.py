"""The semidefinite bound: its program, the multipliers that prove it, and the loss of each inequality."""

#: The bound and the losses are worked out up to this many contact nodes: some seconds.
LARGEST = 100


class LMIError(RuntimeError):
    """No multipliers that certify anything were found."""
