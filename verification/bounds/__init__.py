"""Proved bounds of one step, from constants of the bodies, and their verdicts on runs."""
