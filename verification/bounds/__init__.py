"""Proved bounds of one step, and the loss of each inequality behind them."""

#: The semidefinite bound and the losses are worked out up to this many contact nodes: some seconds.
LARGEST = 100
