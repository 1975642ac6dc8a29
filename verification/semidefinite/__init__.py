"""The semidefinite bound: its program, the multipliers that prove it, and the loss of each inequality."""
